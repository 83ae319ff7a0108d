"""The exact solver agrees with references in high precision, and keeps invariants."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from itertools import permutations

import pytest
from amplified import amplification
from hard_scenes import exact
from scenes import INCH, asymmetry, contact_list, exact_run, frozen_rack, off_exact

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, Table, load, simulate

R = 0.05


# -- references ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shot", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("name", "law"), [("report", "published"), ("report-corrected", "coulomb")]
)
def test_the_reports_shots(name: str, law: str, shot: int) -> None:
    run = simulate(load(name), shot, solver="event-driven")
    assert off_exact(run, law, shot) < 1e-9 * INCH
    events = exact_run(law, shot)["events"]
    assert contact_list(run) == [(e["kind"], tuple(e["balls"]), e.get("cushion")) for e in events]
    assert max(abs(e.t - float(x["t"])) for e, x in zip(run.events, events, strict=True)) < 1e-11


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


def test_one_ball_on_two_at_one_instant_in_any_listing_order() -> None:
    """By hand, e = 1: the ball comes back with v/5, the others leave with 2 sqrt(3)/5 v."""
    dx, dy = 2 * R * math.cos(math.pi / 6), 2 * R * math.sin(math.pi / 6)
    balls = (
        Ball("a", (-1, 0), R, 1, velocity=(1, 0)),
        Ball("b", (dx, dy), R, 1),
        Ball("c", (dx, -dy), R, 1),
    )
    for order in permutations(balls):
        run = exact(on_plane(*order))
        velocity = dict(zip((b.id for b in order), run.end.velocity, strict=True))
        assert velocity["a"] == pytest.approx((-0.2, 0), abs=1e-12)
        for id_, sign in (("b", 1), ("c", -1)):
            assert velocity[id_] == pytest.approx((0.6, sign * math.sqrt(0.12)), abs=1e-12)


@pytest.mark.parametrize("solver", ["event-driven", "pymunk"])
def test_both_cushions_of_a_corner_answer(solver: str) -> None:
    scene = Scene(
        balls=(Ball("a", (0.5, 0.5), R, 1, velocity=(-1, -1)),),
        table=Table.rectangle(2, 1),
        restitution=Restitution(cushion=0.5),
        physics=Physics(max_time=0.6),
    )
    run = simulate(scene, solver=solver, dt=1 / 60)
    assert sorted(e.cushion for e in run.events if e.cushion is not None) == [0, 3]
    assert run.end.velocity[0] == pytest.approx((0.5, 0.5), abs=1e-12)


@pytest.mark.parametrize("count", range(2, 8))
@pytest.mark.parametrize("solver", ["event-driven", "pymunk"])
def test_newtons_cradle(count: int, solver: str) -> None:
    balls = [Ball("0", (-0.5, 0), R, 1, velocity=(1, 0))]
    balls += [Ball(str(k), (2 * R * k, 0), R, 1) for k in range(1, count)]
    run = simulate(on_plane(*balls), solver=solver, dt=1 / 60)
    assert run.end.velocity[-1] == pytest.approx((1, 0), abs=1e-12)
    assert all(v == pytest.approx((0, 0), abs=1e-12) for v in run.end.velocity[:-1])


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-12, 1e-9, 1e-6])
@pytest.mark.parametrize("solver", ["event-driven", "pymunk"])
def test_a_head_on_break_of_a_frozen_rack_stays_symmetric(solver: str, gap: float) -> None:
    """Rounding breaks the mirror by 1e-16, and the break amplifies that by less than 1e6."""
    run = simulate(frozen_rack(gap), solver=solver, dt=1 / 60)
    assert run.status == "settled"
    assert asymmetry(run) < 1e-9


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
