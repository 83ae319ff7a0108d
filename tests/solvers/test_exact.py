"""The exact solver agrees with references in high precision, and keeps invariants."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

import pytest

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, Table, load, simulate
from tests.shared.amplified import amplification
from tests.shared.hard_scenes import exact

R = 0.05


# -- hard contacts ---------------------------------------------------------------------------------


def on_plane(*balls: Ball, e: float = 1.0, surface: float = 0.0, law: str = "coulomb") -> Scene:
    return Scene(
        balls=balls,
        restitution=Restitution(e),
        friction=Friction(surface=surface),
        physics=Physics(law=law, max_time=10.0),
    )


@pytest.mark.parametrize(("inside", "hits"), [(1e-12, 1), (-1e-12, 0)])
def test_a_grazing_hit_is_decided_to_a_millionth_of_a_micrometre(inside: float, hits: int) -> None:
    angle = math.asin(2 * R / 1.0) - inside  # the angle of a path tangent to a ball 1 m away
    scene = on_plane(
        Ball("a", (0, 0), R, 1, velocity=(math.cos(angle), math.sin(angle))),
        Ball("b", (1, 0), R, 1),
    )
    assert len(exact(scene).events) == hits


# -- invariants ------------------------------------------------------------------------------------


def gas(count: int, seed: int, max_time: float) -> Scene:
    """Return balls that lose nothing."""
    rnd = random.Random(seed)
    columns = math.ceil(math.sqrt(count))
    balls = tuple(
        Ball(
            str(k), ((k % columns + 0.5) * 0.25, (k // columns + 0.5) * 0.25), R,
            rnd.uniform(0.1, 0.3), velocity=(rnd.uniform(-2, 2), rnd.uniform(-2, 2)),
        )
        for k in range(count)
    )  # fmt: skip
    side = 0.25 * columns
    return Scene(
        balls=balls,
        table=Table.rectangle(side, side),
        restitution=Restitution(1, cushion=1),
        physics=Physics(max_time=max_time),
    )


@pytest.mark.slow
def test_energy_holds_over_a_hundred_thousand_contacts() -> None:
    run = exact(gas(4, 1, 1e6), max_events=100_000)
    assert run.status == "max_events"
    assert len(run.events) == 100_000
    assert run.energy["final"] == pytest.approx(run.energy["initial"], rel=1e-12, abs=0.0)


def test_forward_and_back_returns_to_the_start() -> None:
    scene = gas(9, 2, 1.0)
    there = exact(scene)
    assert len(there.events) > 30
    turned = there.end._replace(velocity=tuple((-vx, -vy) for vx, vy in there.end.velocity))
    back = simulate(scene, solver="event-driven", start=turned)
    slack = 1e-15 * amplification(scene, there)[0] * len(there.events)
    for ball in scene.balls:
        assert math.dist(back.final[ball.id], ball.position) < max(slack, 1e-12)


# -- bounds ----------------------------------------------------------------------------------------


def test_samples_are_exact_at_any_times() -> None:
    scene = load("report-corrected")
    times: Sequence[float] = [0.0, 0.1234567, 0.5, 1.0, 9.0]
    run = simulate(scene, 1, solver="event-driven", times=times)
    assert run.t.tolist() == times
    cut = simulate(scene, 1, solver="event-driven", max_time=0.5)
    assert run.position[2].ravel() == pytest.approx(
        [x for p in cut.end.position for x in p], abs=1e-14
    )
    assert run.position[4].ravel() == pytest.approx(
        [x for p in run.final.values() for x in p], abs=0
    )
