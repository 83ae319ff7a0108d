"""What can be worked out on paper holds for every solver, to what its method allows."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from itertools import permutations
from typing import Any

import pytest

from pool_pymunk import (
    SOLVERS,
    Ball,
    Friction,
    Law,
    Physics,
    Restitution,
    Scene,
    Table,
    load,
    simulate,
)
from pool_pymunk.solvers.pymunk_builtin import LOOKS
from tests.shared.hard_scenes import exact
from tests.shared.scenes import (
    INCH,
    asymmetry,
    contact_list,
    exact_run,
    frozen_rack,
    largest_distance,
    off_exact,
    random_scene,
)

How = dict[str, Any]  # the solver, its step and options
R, V = 0.05, 1.5  # m, m/s
EXACT: list[How] = [{"solver": "event-driven"}, {"solver": "pymunk", "dt": 1 / 60}]
STEPS = {"time-slice": 1e-3, "pymunk-builtin": 1 / 240}  # s
every_solver = pytest.mark.parametrize("solver", SOLVERS)


class Mean(Law):
    """This law leaves contacts of one instant to the mean over their orders."""


def one_ball(velocity: tuple[float, float], surface: float = 0.1, walled: bool = False) -> Scene:
    return Scene(
        (Ball("1", (0.5, 0.5), R, 0.2, velocity=velocity),),
        Table.rectangle(2.0, 1.0) if walled else None,
        Restitution(cushion=1.0),
        Friction(surface),
        Physics(max_time=9.0),
    )


# -- Eq. 10 ----------------------------------------------------------------------------------------

STOPS: list[tuple[How, float, float]] = [
    ({"solver": "event-driven"}, 1e-14, 1e-14),
    *(({"solver": "pymunk", "dt": dt}, 1e-14, 1e-14) for dt in (1 / 60, 1 / 240, 0.3)),
    # The step in which it stops errs by a dt^2 / 8 at most, and the sum of others by rounding.
    *(({"solver": solver, "dt": dt}, 0.13 * dt**2 + 1e-12, dt * (1 + 1e-9))
      for dt in (1e-2, 1e-3, 1e-4) for solver in ("pymunk-discrete", "time-slice")),
    *(({"solver": "pymunk-builtin", "dt": dt}, 1e-12, dt + 1.0 / LOOKS)
      for dt in (1 / 240, 1e-3, 1e-4)),
]  # fmt: skip


@pytest.mark.parametrize(("how", "off", "late"), STOPS, ids=lambda row: str(row)[:70])
def test_a_ball_stops_after_v_over_a_having_gone_v_squared_over_2a(
    how: How, off: float, late: float
) -> None:
    """In stock pymunk each step keeps the speed of its start, so a ball goes v dt / 2 too far."""
    scene = one_ball((0.8 * V, -0.6 * V))
    run, a, dt = simulate(scene, **how), 0.1 * 9.80665, how.get("dt", 0.0)
    gone = V**2 / (2.0 * a)
    if how["solver"] == "pymunk-builtin":
        gone = sum((V - k * a * dt) * dt for k in range(math.ceil(V / (a * dt))))
    (stop,) = run.events
    assert (run.status, stop.kind, stop.balls, stop.t) == ("settled", "stop", ("1",), run.duration)
    assert math.dist(run.final["1"], (0.5 + 0.8 * gone, 0.5 - 0.6 * gone)) <= off
    assert -1e-14 <= run.duration - V / a <= late


@every_solver
def test_a_scene_at_rest_is_settled_at_once(solver: str) -> None:
    run = simulate(one_ball((0.0, 0.0)), solver=solver)
    assert (run.status, run.duration, run.events) == ("settled", 0.0, ())
    assert run.final == {"1": (0.5, 0.5)}


@every_solver
@pytest.mark.parametrize("shot", [1, 2, 3, 4])
def test_max_time_ends_a_run_in_the_middle(shot: int, solver: str) -> None:
    scene, how = load("report-corrected"), How(solver=solver, dt=STEPS.get(solver))
    whole = simulate(scene, shot, **how)
    part = simulate(scene, shot, max_time=0.3, **how)
    assert (part.status, part.duration) == ("max_time", 0.3)
    assert part.events == tuple(event for event in whole.events if event.t <= 0.3)
    for one, other in zip((part.position, part.velocity), whole.at([0.3]), strict=True):
        assert one[-1] == pytest.approx(other[0], abs=1e-12)


@pytest.mark.parametrize("solver", [name for name in SOLVERS if not name.startswith("pymunk-")])
def test_without_losses_a_ball_goes_on_until_max_time_and_keeps_its_energy(solver: str) -> None:
    """Along x 30 m are 1.45 m, then 15 times 1.9 m; along y 21 m are 0.45 m, then 22 times 0.9."""
    scene = one_ball((1.0, 0.7), 0.0, walled=True)
    run = simulate(scene, solver=solver, dt=STEPS.get(solver), max_time=30.0)
    assert (run.status, run.duration) == ("max_time", 30.0)
    assert len(run.events) == 16 + 23
    assert run.energy["final"] == run.energy["initial"]  # Signs turn, and nothing is rounded.


# -- the exact solver: `pymunk` has its bits (tests/world/test_live.py) ---------------------------


@pytest.mark.parametrize("shot", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("name", "law"), [("report", "published"), ("report-corrected", "coulomb")]
)
@pytest.mark.parametrize("how", EXACT, ids=lambda how: how["solver"])
def test_ends_and_events_of_the_report_are_exact(how: How, name: str, law: str, shot: int) -> None:
    """Rounding is amplified by the scene."""
    run, events = simulate(load(name), shot, **how), exact_run(law, shot)["events"]
    assert off_exact(run, law, shot) < 1e-9 * INCH
    assert contact_list(run) == [(e["kind"], tuple(e["balls"]), e.get("cushion")) for e in events]
    assert max(abs(e.t - float(x["t"])) for e, x in zip(run.events, events, strict=True)) < 1e-11


RACKS = [
    *((1e-9, 0.95, gap, "coulomb") for gap in (0.0, 1e-15, 1e-12, 1e-9, 1e-6)),
    *(pytest.param(1e-9 if e > 0.5 else 1e-6, e, gap, "coulomb", marks=pytest.mark.slow)
      for e in (1.0, 0.7, 0.3) for gap in (0.0, 1e-12, 1e-6)),
    *((1e-9, 0.95, gap, Mean()) for gap in (0.0, 1e-9)),
]  # fmt: skip


@pytest.mark.parametrize(("limit", "e", "gap", "law"), RACKS)
def test_a_head_on_break_of_a_rack_stays_symmetric(
    limit: float, e: float, gap: float, law: Any
) -> None:
    """Rounding breaks the mirror by 1e-16, and the break amplifies that by less than 1e6.

    This also holds where balls press on each other; all are answered as if at once. Their pieces
    err by more than rounding.
    """
    run = simulate(frozen_rack(gap, e), law=law, contact_tolerance=1e-8, solver="event-driven")
    assert run.status == "settled"
    assert asymmetry(run) < limit


def test_the_mean_over_orders_does_not_depend_on_the_listing_order() -> None:
    """The stability matrix has the answer of Coulomb's law to one ball on two, in any order."""
    dx, dy = 2 * R * math.cos(math.pi / 6), 2 * R * math.sin(math.pi / 6)
    balls = (
        Ball("a", (-1, 0), R, 1, velocity=(1, 0)),
        Ball("b", (dx, dy), R, 1),
        Ball("c", (dx, -dy), R, 1),
    )
    first = None
    for order in permutations(balls):
        scene = Scene(order, None, Restitution(1.0), physics=Physics(max_time=2.0))
        run = simulate(scene, law=Mean(), solver="event-driven")
        first = first or run
        assert largest_distance(first, run) < 1e-12


@pytest.mark.parametrize("seed", range(100, 105))
def test_listing_order_does_not_matter(seed: int) -> None:
    scene = random_scene(seed)
    shuffled = random.Random(seed).sample(scene.balls, len(scene.balls))
    runs = [exact(scene), exact(replace(scene, balls=tuple(shuffled)))]
    assert largest_distance(*runs) < 1e-8


@pytest.mark.parametrize("count", range(2, 8))
def test_newtons_cradle(count: int) -> None:
    balls = [Ball("0", (-0.5, 0), R, 1, velocity=(1, 0))]
    balls += [Ball(str(k), (2 * R * k, 0), R, 1) for k in range(1, count)]
    for e, ends in ((1.0, [0.0] * (count - 1) + [1.0]), (0.0, [1 / count] * count)):
        scene = Scene(tuple(balls), None, Restitution(e), physics=Physics(max_time=2.0))
        for end, v in zip(exact(scene).end.velocity, ends, strict=True):
            assert end == pytest.approx((v, 0.0), abs=1e-12)
