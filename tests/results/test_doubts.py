"""A run says what depends on policies, what rounding may have done, and where energy came from."""

from __future__ import annotations

import math
import pickle
import re
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Law,
    Physics,
    Restitution,
    Run,
    Scene,
    Table,
    Units,
    load,
    simulate,
)
from pool_pymunk.model import Point
from pool_pymunk.report.listing import shot_lines
from pool_pymunk.results.trace import farthest
from pool_pymunk.studies.tolerance import simulate_within
from tests.shared.hard_scenes import disc, exact, persistent, squeezed
from tests.shared.scenes import INCH, largest_distance

R = 0.05


def figure(run: Run, words: str) -> float:
    """Return the figure in the one warning that has these words."""
    [warning] = [warning for warning in run.warnings if words in warning]
    return float(re.findall(r"up to ([-+.\de]+) m", warning)[0])


def one_on_two(gap: float = 0.0) -> Scene:
    """Return a ball that runs into two touching ones, between them."""
    dx, dy = math.sqrt(3.0) * R, R + gap / 2.0
    balls = (
        disc("a", (-1.0, 0.0), (1.0, 0.0)),
        disc("b", (dx, dy)),
        disc("c", (dx, -dy - gap)),
    )
    return Scene(balls, restitution=Restitution(1.0), physics=Physics(max_time=2.0))


# -- contacts of one instant -----------------------------------------------------------------------


def test_what_hangs_on_the_order_of_one_instant_is_said() -> None:
    run = exact(one_on_two())
    assert run.policies == {"one instant"}
    assert "several contacts came at one instant, in an unknown order" in run.warnings[0]
    said = figure(run, "have no exact answer")
    for gap in (1e-9, 1e-7):
        far = largest_distance(run, exact(one_on_two(gap)))
        assert 0.1 < far <= said < 8.0 * far


def test_what_is_said_is_the_same_in_any_listing_order() -> None:
    scene = one_on_two()
    said = {
        round(exact(replace(scene, balls=balls)).policy_shift, 3)
        for balls in permutations(scene.balls)
    }
    assert len(said) == 1


def test_contacts_whose_order_does_not_matter_give_no_warning() -> None:
    """A ball in a square corner, without friction."""
    scene = Scene(
        (disc("a", (0.5, 0.5), (-1.0, -1.0)),), Table.rectangle(2.0, 2.0),
        Restitution(cushion=0.5), physics=Physics(max_time=1.0),
    )  # fmt: skip
    run = exact(scene)
    assert not run.warnings
    assert run.policies == frozenset()
    assert run.policy_shift == 0.0


# -- zero slip -------------------------------------------------------------------------------------


def head_on(
    speeds: Point, along: float = 0.0, turns: Point = (0.0, 0.0), apart: float = 0.3, e: float = 0.9
) -> Scene:
    """Return two balls that hit head-on along a direction (rad), up to small ``turns`` (rad)."""
    balls = []
    for k, (speed, turn) in enumerate(zip(speeds, turns, strict=True)):
        place = (k * apart * math.cos(along), k * apart * math.sin(along))
        velocity = (speed * math.cos(along + turn), speed * math.sin(along + turn))
        balls.append(disc("ab"[k], place, velocity))
    friction, physics = Friction(0.1, ball_ball=0.05), Physics(law="published")
    return Scene(tuple(balls), None, Restitution(e), friction, physics)


@pytest.mark.parametrize("along", [0.0, 0.3, -1.2])
@pytest.mark.parametrize("speeds", [(1.0, 0.0), (0.0, -1.0), (1.0, -1.0), (1.0, 0.5)])
def test_the_figure_of_a_zero_slip_is_the_largest_shift_of_tiny_turns(
    speeds: Point, along: float
) -> None:
    """Each ball that moves is turned by some millionths of a radian, to both sides."""
    run = exact(head_on(speeds, along))
    assert run.policies == {"zero slip"}
    moved = [
        largest_distance(run, exact(head_on(speeds, along, (1e-6 * one, 1e-6 * other))))
        for one in range(-4, 5)
        for other in range(-4, 5)
    ]
    assert max(moved) == pytest.approx(run.policy_shift, rel=1e-3, abs=0.0)
    assert max(moved) > 0.005


def test_simulation_4_says_the_larger_of_two_shifts() -> None:
    run = simulate(load("report"), 4, solver="event-driven")
    shot, (vx, vy) = run.shot, run.knots[0][0, 3:5].tolist()
    assert shot is not None
    moved = []
    for turn in (1e-6, -1e-6):
        angle = math.degrees(math.atan2(vy, vx)) + turn
        turned = replace(run.scene, shots=(replace(shot, aim=None, angle=angle),))
        moved.append(largest_distance(run, exact(turned)) / INCH)
    assert moved == pytest.approx([2.45, 2.07], abs=0.01)
    assert run.policy_shift / INCH == pytest.approx(max(moved), abs=1e-4)
    [said] = [line for line in shot_lines(run) if "have no exact answer" in line]
    assert said.strip() == (
        "Some contacts have no exact answer (zero slip). With other answers the ends may lie up to "
        "2.5 in elsewhere"
    )


@pytest.mark.parametrize("speed", [0.005, 1.0])
def test_what_is_not_sampled_has_no_factor(speed: float) -> None:
    """One hit has a zero slip, and two other balls press on each other for long."""
    hit = head_on((speed, 0.0), apart=2 * R + 1e-6, e=0.0)
    near, far = persistent(0.0).balls
    pair = (
        replace(near, id="c", position=(0.0, 9.0)),
        replace(far, id="d", position=(0.101, 9.0)),
    )
    run = exact(replace(hit, balls=(*hit.balls, *pair)))
    assert run.policies == {"zero slip"}
    assert run.again is not None and run.persistent
    assert run.policy_shift == max(farthest(run, run.again.play(v)) for v in run.variants) > 0.0


# -- persistent contact ----------------------------------------------------------------------------


def test_a_persistent_contact_is_no_policy_and_has_a_figure() -> None:
    run = simulate(persistent(0.0), solver="event-driven", dt=1 / 60)
    assert run.policies == set() and run.policy_shift == 0.0
    assert not any("have no exact answer" in line for line in run.warnings)
    assert 0.0 < run.persistent_shift < 1e-5


def test_a_warning_is_in_the_scenes_units_and_has_two_sentences_at_most() -> None:
    scene = replace(one_on_two(), units=Units(length="mm"))
    run = exact(scene)
    [far] = [line for line in run.warnings if "have no exact answer" in line]
    [said] = re.findall(r"up to ([-+.\de]+) mm elsewhere", far)
    assert float(said) == pytest.approx(1e3 * run.policy_shift, rel=0.1)
    assert all(line.count(". ") <= 1 and ";" not in line for line in run.warnings)


# -- inelastic collapse ----------------------------------------------------------------------------


def test_the_first_hundred_of_hits_without_end_are_listed_and_the_others_counted() -> None:
    scene = squeezed(1e6, 0.8, 0.8, 0.0, 0.0)
    run = exact(scene)
    hits = [event for event in run.events if event.kind != "stop"]
    assert 90 < len(hits) < 300
    [warning] = run.warnings
    [count] = re.findall(r"([\d,]+) more followed", warning)
    assert int(count.replace(",", "")) > 1_000_000
    assert exact(scene, max_events=300).status == "settled"
    ends = zip(run.end.position, ((R, 1.0), (3 * R, 1.0)), strict=True)
    assert max(math.dist(p, q) for p, q in ends) < 1e-12


# -- rounding --------------------------------------------------------------------------------------


def test_rounding_grows_with_what_amplifies_it() -> None:
    """In a break of many balls, errors of 1e-16 m grow by a million times and more."""
    alone = exact(Scene((disc("a", (0.5, 0.5), (1.0, 0.3)),), Table.rectangle(2.0, 1.0),
                        Restitution(cushion=0.9), Friction(0.01)))  # fmt: skip
    assert 0.0 < alone.rounding < 2e-14
    report = simulate(load("report-corrected"), 1, solver="event-driven")
    assert 5.0 * alone.rounding < report.rounding < 1e-11


def test_rounding_is_not_known_of_a_run_from_a_file(tmp_path: Path) -> None:
    run = simulate(load("two-balls"), solver="event-driven")
    run.save(tmp_path / "one.npz")
    assert math.isnan(Run.load(tmp_path / "one.npz").rounding)
    assert Run.load(tmp_path / "one.npz") == run
    assert math.isnan(simulate(load("two-balls"), solver="time-slice", dt=1e-3).rounding)


# -- energy ----------------------------------------------------------------------------------------


def glancing(law: str) -> Scene:
    """Return a ball that hits another that moves across: line 132 pushes that one on."""
    balls = (disc("a", (0.0, 0.0), (1.0, 0.0)), disc("b", (0.5, 0.0), (0.0, -1.0)))
    balls = (balls[0], replace(balls[1], position=(0.5, 0.4)))
    physics = Physics(law=law, max_time=2.0)
    return Scene(
        balls, restitution=Restitution(1.0), friction=Friction(ball_ball=0.5), physics=physics
    )


@pytest.mark.parametrize("solver", ["event-driven", "pymunk", "time-slice"])
def test_a_run_says_that_its_contacts_gained_energy(solver: str) -> None:
    run = simulate(glancing("published"), solver=solver, dt=1e-3)
    assert run.energy["final"] > 1.01 * run.energy["initial"]
    [warning] = [each for each in run.warnings if "added energy" in each]
    [gained] = re.findall(r"contact: ([.\d]+) % of", warning)
    assert float(gained) / 100.0 == pytest.approx(
        run.energy["final"] / run.energy["initial"] - 1, rel=0.01
    )
    assert "The first was that of balls a, b" in warning
    own = simulate(glancing("coulomb"), solver=solver, dt=1e-3)
    assert not any("added energy" in each for each in own.warnings)


def test_what_falls_from_rest_gains_by_the_energy_of_its_height() -> None:
    table = replace(Table.rectangle(1.0, 2.0), tilt=(0.0, -9.8))
    balls = (disc("a", (0.55, 1.5), (0.0, 0.0)), disc("b", (0.5, 0.6), (0.0, 0.0)))
    bounces = Restitution(0.95, cushion=0.8)
    scene = replace(glancing("published"), balls=balls, table=table, restitution=bounces)
    run = simulate(scene, solver="event-driven")
    times = np.array([event.t for event in run.events if event.is_contact])
    gains = run.energy_at(times + 1e-9) - run.energy_at(times - 1e-9)
    [gained] = gains[gains > 1e-6]
    [warning] = [each for each in run.warnings if "added energy" in each]
    assert f"in 1 contact: {100.0 * gained / run.energy['initial']:.3g} % of" in warning


# -- tolerance -------------------------------------------------------------------------------------


def test_a_tolerance_vouches_for_nothing_that_a_policy_decided() -> None:
    [(run, choice)] = simulate_within(one_on_two(), [None], tolerance=1e-3)
    assert run.policies
    assert not choice.reached
    assert choice.error >= run.policy_shift > 1e-3
    assert "one instant" in choice.reason


# -- piles -----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("count", "e"), [(4, 0.0), (7, 0.5)])
def test_a_packed_moving_pile_comes_to_rest(count: int, e: float) -> None:
    """Every ball of a square of balls moves, with gaps of a tenth of a radius."""
    pitch, turn = 2.1 * R, 2.399963  # golden angle
    balls = tuple(
        Ball(str(k), (pitch * (k % count + 0.6), pitch * (k // count + 0.6)), R, 0.2,
             velocity=(math.cos(turn * k), math.sin(turn * k)))
        for k in range(count * count)
    )  # fmt: skip
    table = Table.rectangle(pitch * (count + 0.2), pitch * (count + 0.2))
    run = exact(Scene(balls, table, Restitution(e, None, e), Friction(0.1, 0.05, 0.05)))
    assert run.status == "settled"
    for t in (0.3, 0.6, 1.0):
        places = run.at(t * run.duration)[0]
        gaps = [math.dist(p, q) / R - 2 for k, p in enumerate(places) for q in places[:k]]
        assert min(gaps) > -1e-3


# -- runs as objects -------------------------------------------------------------------------------


def test_a_run_can_be_pickled_whatever_its_law() -> None:
    class Own(Law):
        pass

    run = simulate(load("two-balls"), solver="event-driven", law=Own())
    copy = pickle.loads(pickle.dumps(run))
    assert copy == run
    assert math.isnan(copy.rounding)
