"""The option --tolerance keeps its promise: an end that it accepts is within the tolerance.

Where it cannot promise that, it says so.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pymunk
import pytest

from pool_pymunk import (
    SOLVERS,
    Ball,
    Friction,
    Outcome,
    Physics,
    Restitution,
    Scene,
    Shot,
    Table,
    choose_step,
    load,
    rack,
    simulate,
    simulate_within,
)
from pool_pymunk.model import Point
from pool_pymunk.studies.tolerance import outcome
from pool_pymunk.world import Billiards, same_balls
from tests.shared.commands import exit_code
from tests.shared.hard_scenes import exact, persistent
from tests.shared.scenes import largest_distance, random_scene, seeds, some_slow, takes_long

# -- any function of the step ----------------------------------------------------------------------


def euler(dt: float) -> list[Point]:
    """Solve x' = -x from 1, to t = 1, with first order."""
    return [((1.0 - dt) ** (1.0 / dt), 0.0)]


def midpoint(dt: float) -> list[Point]:
    """Solve the same with second order."""
    return [((1.0 - dt + dt * dt / 2.0) ** (1.0 / dt), 0.0)]


@pytest.mark.parametrize(("method", "order"), [(euler, 1.0), (midpoint, 2.0)])
@pytest.mark.parametrize("limit", [1e-3, 1e-5])
def test_known_orders(method: Callable[[float], list[Point]], order: float, limit: float) -> None:
    choice = choose_step(method, limit, start=1 / 4)
    assert choice.reached
    assert abs(method(choice.dt)[0][0] - math.exp(-1.0)) < choice.error <= limit
    assert choice.order == pytest.approx(order, abs=0.35)
    assert method(choice.dt) == method(choice.levels[-1].dt)


def test_a_run_without_error_needs_two_halvings_and_five_steps_between() -> None:
    asked: list[float] = []
    choice = choose_step(lambda dt: [(1.0, 2.0)], 1e-9, on_run=asked.append)
    assert choice.reached
    assert choice.error == 0.0
    assert asked[:3] == [1 / 60, 1 / 120, 1 / 240]
    assert all(1 / 240 < dt < 1 / 120 for dt in asked[3:])
    assert choice.runs == len(asked) == 8


INSTANTS = [0.3 + 0.7 * k / 500 for k in range(500)]


def found_at_the_end_of_a_step(instant: float) -> Callable[[float], list[Point]]:
    """Return the outcome of a contact at ``instant`` that is answered when the step is over."""
    return lambda dt: [(math.ceil(instant / dt) * dt, 0.0)]


def test_halves_that_agree_by_chance_do_not_fool_it() -> None:
    """Half of the step finds half of all contacts at the same late time as the step does."""
    for instant in INSTANTS:
        choice = choose_step(found_at_the_end_of_a_step(instant), 1e-3)
        assert choice.reached
        assert abs(found_at_the_end_of_a_step(instant)(choice.dt)[0][0] - instant) < 1e-3


def test_without_the_steps_between_it_would_be_fooled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pool_pymunk.studies.tolerance.BETWEEN", ())
    wrong = 0
    for instant in INSTANTS:
        run = found_at_the_end_of_a_step(instant)
        wrong += abs(run(choose_step(run, 1e-3).dt)[0][0] - instant) > 1e-3
    assert wrong > 100


def test_a_tolerance_out_of_reach_says_why_and_keeps_the_finest() -> None:
    choice = choose_step(euler, 1e-9, start=1 / 4, smallest=1 / 300)
    assert not choice.reached
    assert choice.dt == 1 / 256
    assert "the smallest step tried" in choice.reason
    assert choice.error == pytest.approx(4.0 * choice.levels[-1].change, rel=0.01)


def test_ends_that_do_not_settle() -> None:
    choice = choose_step(lambda dt: [(math.sin(1.0 / dt**2), 0.0)], 1e-3, smallest=1e-4)
    assert not choice.reached
    assert "do not settle" in choice.reason


def test_contacts_that_depend_on_the_step() -> None:
    choice = choose_step(lambda dt: Outcome([(0.0, 0.0)], contacts=dt), 1e-3, smallest=1e-4)
    assert not choice.reached
    assert "ill-conditioned" in choice.reason
    assert choice.error == math.inf


def test_contacts_at_steps_between_count_too() -> None:
    """Powers of two of 1/60 s all have the same contacts, and no other step has."""

    def run(dt: float) -> Outcome:
        halved = math.log2(1 / 60 / dt)
        return Outcome([(0.0, 0.0)], contacts=dt < 1e-3 or abs(halved - round(halved)) < 1e-9)

    choice = choose_step(run, 1e-3)
    assert choice.reached
    assert choice.dt < 0.5e-3


def test_contacts_that_steps_blur() -> None:
    choice = choose_step(lambda dt: Outcome([(0.0, 0.0)], resolved=dt < 1e-3), 1e-3)
    assert choice.reached
    assert choice.dt < 1e-3


@pytest.mark.parametrize(("steps", "resolved"), [(1, False), (2, True)])
@pytest.mark.parametrize("solver", ["pymunk-discrete", "time-slice"])
def test_contacts_of_a_ball_that_come_a_step_apart_are_blurred(
    solver: str, steps: int, resolved: bool
) -> None:
    """A ball comes to two cushions, and to the second one so many steps later."""
    r, dt = 0.05, 0.01
    x = 1.0 - r - 4.5 * dt
    ball = Ball("a", (x, x - steps * dt), r, 0.2, velocity=(1.0, 1.0))
    limit = Physics(max_time=20 * dt)
    scene = Scene((ball,), Table.rectangle(1.0, 1.0), Restitution(cushion=1.0), Friction(), limit)
    run = simulate(scene, solver=solver, dt=dt)
    first, second = (event.t for event in run.events)
    assert second - first == pytest.approx(steps * dt)
    assert outcome(run).resolved == resolved


def test_ends_that_are_no_numbers() -> None:
    choice = choose_step(lambda dt: [(math.nan, 0.0)], 1e-3, smallest=1e-3)
    assert not choice.reached
    assert "ends in numbers that are not finite" in choice.reason


# -- scenes with a known end -----------------------------------------------------------------------

RESTITUTION, BRAKE, RADIUS, SPEED = 0.8, 0.2 * 9.80665, 0.03, 2.0


def off_one_cushion() -> tuple[Scene, dict[str, Point]]:
    """Return a ball that slides into the cushion x = 1.5 and back, and where it ends."""
    ball = Ball("C", (0.7, 0.5), RADIUS, 0.2, cue=True, velocity=(SPEED, 0.0))
    scene = Scene(
        (ball,), Table.rectangle(1.5, 1.0), Restitution(cushion=RESTITUTION), Friction(surface=0.2)
    )
    distance = 1.5 - RADIUS - 0.7
    back = RESTITUTION**2 * (SPEED**2 - 2 * BRAKE * distance) / (2 * BRAKE)
    return scene, {"C": (1.5 - RADIUS - back, 0.5)}


def head_on_pair() -> tuple[Scene, dict[str, Point]]:
    """Return a ball that hits another of the same mass head-on, and where both end."""
    a = Ball("A", (0.0, 0.0), RADIUS, 0.2, velocity=(SPEED, 0.0))
    b = Ball("B", (0.5, 0.0), RADIUS, 0.2)
    scene = Scene((a, b), None, Restitution(ball_ball=RESTITUTION), Friction(surface=0.2))
    distance = 0.5 - 2 * RADIUS
    after = (SPEED**2 - 2 * BRAKE * distance) / (2 * BRAKE)
    slow, fast = ((1 + sign * RESTITUTION) / 2 for sign in (-1, 1))
    return scene, {"A": (distance + slow**2 * after, 0.0), "B": (0.5 + fast**2 * after, 0.0)}


LIMITS = {"pymunk": (1e-2, 1e-4), "pymunk-discrete": (1e-2, 1e-3), "time-slice": (1e-2, 1e-4)}


@pytest.mark.parametrize("known", [off_one_cushion, head_on_pair])
@pytest.mark.parametrize("solver", LIMITS)
def test_known_ends(known: Callable[[], tuple[Scene, dict[str, Point]]], solver: str) -> None:
    scene, ends = known()
    for limit in LIMITS[solver]:
        [(run, choice)] = simulate_within(scene, [None], limit, solver)
        assert choice.reached
        assert run.dt == choice.dt
        assert max(math.dist(run.final[id_], end) for id_, end in ends.items()) < limit


def test_where_every_step_is_exact_no_step_is_searched_for() -> None:
    scene, _ = head_on_pair()
    asked: list[float] = []
    [(run, choice)] = simulate_within(scene, [None], 1e-9, on_run=asked.append)
    assert asked == [run.dt] == [SOLVERS["pymunk"].dt]
    assert choice.reached and choice.runs == 1 and choice.error == run.rounding < 1e-12
    [(_, choice)] = simulate_within(scene, [None], 1e-9)
    assert choice.reached and choice.runs == 1
    [(_, choice)] = simulate_within(scene, [None], 1e-18)
    assert not choice.reached and "rounding" in choice.reason


# -- twenty random scenes --------------------------------------------------------------------------

TABLES = ("rectangle", "hexagon", "L", "open plane")


@pytest.mark.seeded
@pytest.mark.parametrize("seed", some_slow(20, quick=5))
def test_swept_contacts_are_within_a_micrometre(seed: int) -> None:
    scene = random_scene(seed, TABLES[seed % 4], speed=(0.5, 3.0))
    [(run, choice)] = simulate_within(scene, [None], 1e-6)
    assert choice.reached
    assert largest_distance(run, exact(scene)) < 1e-6


@takes_long
@pytest.mark.seeded
def test_discrete_contacts_keep_the_word_that_is_given() -> None:
    """An estimate may refuse what is within the tolerance, but must not pass what is not."""
    limit, kept = 2e-3, 0
    for seed in seeds(20):
        scene = random_scene(seed, TABLES[seed % 4], speed=(0.5, 3.0))
        [(run, choice)] = simulate_within(scene, [None], limit, "pymunk-discrete", smallest=1e-4)
        kept += choice.reached
        if choice.reached:
            assert largest_distance(run, exact(scene)) < limit, seed
        else:
            assert choice.reason
    assert kept >= 5


def test_a_frozen_rack_is_refused_with_discrete_contacts() -> None:
    """Its contacts follow each other without a pause, so no step tells their order."""
    cue = Ball("C", (0.3, 0.5), 0.03, 0.2, cue=True)
    balls = (cue, *rack((1.0, 0.5), radius=0.03, mass=0.2, rows=3))
    scene = Scene(
        balls,
        Table.rectangle(2.0, 1.0),
        Restitution(0.95, None, 0.8),
        Friction(0.2),
        Physics(),
        (Shot("break", "C", (3.0, 0.1)),),
    )
    [(_, choice)] = simulate_within(scene, scene.shots, 1e-3, "pymunk-discrete", smallest=1e-4)
    assert not choice.reached
    assert "contacts" in choice.reason


def test_runs_cut_off_by_max_time_are_compared_at_max_time() -> None:
    scene = load("two-balls")
    [(run, choice)] = simulate_within(scene, scene.shots, 1e-6)
    assert run.status == "max_time"
    assert choice.reached


def test_what_persistent_contacts_may_do_is_part_of_the_error() -> None:
    scene = persistent(0.0)
    run = exact(scene)
    for limit in (0.5, 2.0):
        tolerance = limit * run.persistent_shift
        [(_, choice)] = simulate_within(scene, [None], tolerance, "pymunk")
        assert choice.error >= run.persistent_shift > run.rounding
        assert choice.reached == (limit > 1.0)
        assert choice.reached or choice.reason.startswith("contacts that persist may put the ends")


def test_a_shot_that_goes_on_is_run_with_the_one_before() -> None:
    scene = load("report-corrected")
    second = Shot("on", "C", (1.0, 0.5), from_previous=True)
    scene = Scene(
        scene.balls, scene.table, scene.restitution, scene.friction, scene.physics,
        (scene.shots[2], second),
    )  # fmt: skip
    [(run, choice)] = simulate_within(scene, [second], 1e-6)
    assert choice.reached
    assert largest_distance(run, simulate(scene, second, solver="event-driven")) < 1e-6


# -- a world that no other solver knows ------------------------------------------------------------


def pinball(dt: float) -> list[Point]:
    """Return a ball between two posts and a slanting wall, in a pymunk space of its own."""
    space = pymunk.Space()
    table = Billiards(space, dt, pair=same_balls(0.9, 0.05, mass=0.2), deceleration=0.5)
    space.gravity = 0.0, -0.2  # It acts once a step, so ends depend on the step.
    for x in (0.0, 0.5):
        table.add_wall(pymunk.Circle(space.static_body, 0.1, (x, 0.0)), restitution=0.9)
    table.add_wall(pymunk.Segment(space.static_body, (-1.0, 0.5), (1.5, 0.9), 0.01), 0.8, 0.1)
    body = pymunk.Body(0.2, math.inf)
    body.position = (0.25, -0.5)
    table.strike(table.add_ball(pymunk.Circle(body, 0.05)), (0.05, 1.2))
    while table.moving:
        space.step(dt)
    return [(body.position.x, body.position.y)]


@takes_long
@pytest.mark.slow
def test_a_world_of_other_shapes() -> None:
    choice = choose_step(pinball, 1e-2, smallest=1e-4)
    assert choice.reached
    assert math.dist(pinball(choice.dt)[0], pinball(1e-5)[0]) < 1e-2


# -- the command line ------------------------------------------------------------------------------


def test_run_says_which_step_it_chose(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "run.json"
    options = ["--shot", 3, "--out", tmp_path, "--no-pictures", "--json", data]
    assert exit_code("run", "report", "--tolerance", "0.01 in", *options) == 0
    printed = capsys.readouterr().out
    assert "Tolerance 0.01 in: reached with dt = 1/240 s, estimated error" in printed
    assert "Work: 1 run, " in printed
    found = json.loads(data.read_text(encoding="utf-8"))
    assert found["solver"] == {"name": "pymunk", "dt": 1 / 240, "contact_tolerance": 1e-7}
    record = found["shots"][0]["tolerance"]
    assert record["reached"]
    assert record["tolerance"] == pytest.approx(0.000254)
    assert record["dt"] == 1 / 240


def test_run_ends_with_1_where_it_falls_short(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    coarser = replace(SOLVERS["pymunk-discrete"], finest=1e-3)
    monkeypatch.setitem(SOLVERS, "pymunk-discrete", coarser)
    options = ["--solver", "pymunk-discrete", "--shot", 1, "--out", tmp_path, "--no-pictures"]
    assert exit_code("run", "report", "--tolerance", "0.01in", *options) == 1
    answer = capsys.readouterr()
    assert "Tolerance 0.01 in: not reached; the finest run is kept: with dt = " in answer.out
    assert "Why: at 0.00104 s, the smallest step tried, the contacts or their order" in answer.out
    assert answer.err.splitlines()[-1] == "error: Simulation 1: the tolerance is not reached"
    assert (tmp_path / "shot-1.npz").exists()
