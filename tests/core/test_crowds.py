"""Balls that hit each other over and over are a crowd, which goes on by steps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from pool_pymunk import Ball as SceneBall
from pool_pymunk import Friction, Patch, Physics, Restitution, Scene, Table, load, simulate
from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Pair
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.motion.surface import Rolling, Sliding, Surface
from pool_pymunk.core.persistent.crowd import ENOUGH, Crowd
from pool_pymunk.core.persistent.member import Member
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.spells import Spell
from pool_pymunk.core.persistent.touch import Touch
from pool_pymunk.report.listing import shot_lines
from pool_pymunk.solvers.again import Again
from pool_pymunk.solvers.in_core import table_of
from tests.shared.scenes import pile

R, M, PULL, DRAG, STEP = 0.03, 0.2, 2.0, 0.1, 1e-3
OVER_AND_OVER = "hit each other over and over"


def row(speeds: list[float], surface: Surface, e: float) -> Crowd:
    """Return balls in a row that touch; those of a rolling surface roll."""
    scale = Scale(1e-7, R, PULL)
    members = []
    for k, v in enumerate(speeds):
        ball = Ball(k, R, M, standing(0.0, 2.0 * R * k, 0.0))
        roll = (v if surface.rolls else 0.0, 0.0)
        members.append(Member(ball, scale, surface, (2.0 * R * k, 0.0, v, 0.0), roll, 0.0))
    pairs = itertools.pairwise(members)
    touches = [Touch(a, b, None, None, Pair(M, M, e, 0.0)) for a, b in pairs]
    return Crowd(members, touches, 0.0, scale, STEP)


def test_the_normal_of_a_contact_that_persisted_points_to_the_last_ball() -> None:
    """Impulses of a contact are those on the ball of the higher number."""
    one, other = row([0.0, 0.0], Sliding(PULL), 0.0).members
    for first, second in ((one, other), (other, one)):
        touch = Touch(first, second, None, None, Pair(M, M, 0.0, 0.0))
        assert Spell(0, 1, -1, 0.0, touch).place == (R, 0.0, 1.0, 0.0)


def speeds_after(crowd: Crowd) -> list[float]:
    crowd.play(0.0)
    return [each.vx for each in crowd.members]


EXACT = ENOUGH * PULL * STEP


def test_a_plastic_row_goes_on_together() -> None:
    together = 1.0 / 4.0 - PULL * STEP
    assert speeds_after(row([1.0, 0.0, 0.0, 0.0], Sliding(PULL), 0.0)) == pytest.approx(
        [together] * 4, abs=4.0 * EXACT
    )


def test_a_bounce_is_that_of_the_law() -> None:
    after = speeds_after(row([1.0, 0.0], Sliding(PULL), 0.5))
    assert after == pytest.approx([0.25 - PULL * STEP, 0.75 - PULL * STEP], abs=EXACT)


def test_friction_of_the_surface_holds_a_row() -> None:
    """The push is weaker than what friction takes from all three in a step."""
    assert speeds_after(row([2.0 * PULL * STEP, 0.0, 0.0], Sliding(PULL), 0.0)) == pytest.approx(
        [0.0] * 3, abs=EXACT
    )


def test_a_ball_that_rolls_slips_after_the_hit() -> None:
    """Two balls have half the speed of one; their slips are theirs to the surface."""
    after = speeds_after(row([1.0, 0.0], Rolling(PULL, DRAG), 0.0))
    assert after == pytest.approx([0.5, 0.5], abs=EXACT)


def test_a_slip_that_fades_in_a_step_rolls() -> None:
    crowd = row([1e-3], Rolling(PULL, DRAG), 0.0)
    crowd.members[0].wx = 0.0
    assert speeds_after(crowd) == pytest.approx([5.0 / 7.0 * 1e-3 - DRAG * STEP])


def test_a_crowd_never_gains_energy() -> None:
    for e in (0.0, 0.5, 1.0):
        crowd = row([1.0, -0.3, 0.7, 0.0, -1.0], Rolling(PULL, DRAG), e)
        before = sum(each.energy for each in crowd.members)
        crowd.play(0.0)
        assert sum(each.energy for each in crowd.members) <= before


def test_a_crowd_that_a_round_cushion_bends_gains_no_energy() -> None:
    """The push that turns a velocity by its end adds to it: it would be 5e-6 of the energy."""
    ball, slow = SceneBall("a", (0.5, R), R, M), Sliding(1e-6)
    scene = Scene((ball,), Table.circle(0.5), Restitution(0.0, cushion=0.0), Friction(0.2))
    member = Member(
        Ball(0, R, M, standing(0.0, 0.5, R)), Scale(1e-7, R, PULL), slow, (0.5, R, 1.0, 0.0),
        (0.0, 0.0), 0.0,
    )  # fmt: skip
    beside = [(wall, wall.side_beside(0.5, R, R, 0.0)) for wall in table_of(scene).walls]
    [(wall, side)] = [each for each in beside if abs(each[1].gap(0.5, R, R)) < 1e-9]
    touch = Touch(member, None, wall, side, Pair(M, math.inf, 0.0, 0.0))
    crowd = Crowd([member], [touch], 0.0, Scale(1e-7, R, PULL), STEP)
    before = crowd.energy
    crowd.play(0.0)
    assert member.vy > 0.0
    assert crowd.energy <= before * (1.0 + 1e-15)


def test_a_path_has_the_velocity_after_the_step_wherever_balls_are_moved_apart() -> None:
    crowd = row([0.1, 0.1], Sliding(PULL), 0.0)
    crowd.members[1].x -= 0.01 * R
    crowd.play(0.0)
    for each in crowd.members:
        assert crowd.path(each).velocity(STEP) == (each.vx, each.vy) != (0.1, 0.0)


@pytest.mark.parametrize(("e", "rolling"), [(0.0, 0.01), (0.5, 1e-4)])
def test_energy_never_grows_while_balls_are_a_crowd(e: float, rolling: float) -> None:
    """Velocities by which balls would be moved apart in a step made it 3e-5 and 3e-6."""
    run = simulate(pile(20, e, rolling), solver="event-driven")
    assert any(OVER_AND_OVER in warning for warning in run.warnings)
    moments = np.unique(np.concatenate([rows[:, 0] for rows in run.knots]))
    spans = np.diff(moments)[:, np.newaxis] * np.array([0.0, 0.25, 0.5, 0.75, 0.999])
    energy = run.energy_at(np.append((moments[:-1, np.newaxis] + spans).ravel(), moments[-1]))
    assert (energy - np.minimum.accumulate(energy)).max() <= 1e-13 * energy[0]


@pytest.mark.parametrize(("evenly", "first", "second"), [(False, 0.75, 0.25), (True, 0.5, 0.5)])
def test_the_lighter_ball_makes_more_room(evenly: bool, first: float, second: float) -> None:
    """A ball of a third of the other one's mass gets three quarters of the shift, or half of it."""
    overlap, scale = 0.01 * R, Scale(1e-7, R, PULL)
    light, heavy = (
        Member(
            Ball(k, R, mass, standing(0.0, x, 0.0)), scale, Sliding(PULL), (x, 0.0, 0.0, 0.0),
            (0.0, 0.0), 0.0,
        )
        for k, mass, x in ((0, M, 0.0), (1, 3.0 * M, 2.0 * R - overlap))
    )  # fmt: skip
    touch = Touch(light, heavy, None, None, Pair(M, 3.0 * M, 0.0, 0.0))
    touch.look()
    assert touch.part(1.0, evenly) == pytest.approx(0.01)
    assert light.x == pytest.approx(-first * overlap)
    assert heavy.x == pytest.approx(2.0 * R - overlap + second * overlap)


@pytest.mark.parametrize("rolling", [None, 0.01, 1e-4])
def test_a_pile_comes_to_rest_and_the_run_says_how(rolling: float | None) -> None:
    scene = pile(50, 0.0, rolling)
    run = simulate(scene, solver="event-driven")
    assert run.status == "settled"
    warnings = [w for w in run.warnings if OVER_AND_OVER in w]
    assert len(warnings) == 1 and "their ends are not exact, and overlap by up to" in warnings[0]
    assert OVER_AND_OVER in "\n".join(shot_lines(run))
    moments = sorted({float(t) for rows in run.knots for t in rows[:, 0]})  # of all new paths
    left = run.energy_at(moments)
    assert all(after - before < 1e-4 * left[0] for before, after in itertools.pairwise(left))
    times = np.linspace(0.0, run.duration, 20)
    deepest = min(
        math.dist(a, b) - 2.0 * scene.balls[0].radius
        for places in run.at(times)[0].tolist()
        for k, a in enumerate(places)
        for b in places[:k]
    )
    assert deepest > -0.05 * scene.balls[0].radius


def test_a_pile_ends_in_time_that_grows_with_its_contacts() -> None:
    """Two hundred balls take about as many steps as fifty; nothing is played hit by hit."""
    few, many = (simulate(pile(n, 0.5, None), solver="event-driven") for n in (50, 200))
    assert few.status == many.status == "settled"
    assert len(many.events) < 10 * len(few.events)


def test_a_crowd_is_not_played_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its steps decide more than its policies do."""

    def moves(*_: object) -> Iterator[None]:
        raise AssertionError("variants are played")
        yield

    monkeypatch.setattr(import_module("pool_pymunk.solvers.request"), "QUICK", math.inf)
    monkeypatch.setattr(Again, "moves", moves)
    run = simulate(pile(50, 0.0, 0.01), solver="event-driven")
    assert any(OVER_AND_OVER in w for w in run.warnings) and run.known_shift is None


def test_no_ball_that_heavy_ones_squeeze_into_a_corner_leaves_the_table() -> None:
    """A crowd that is cut off has given its impulses until then, and no longer."""
    corners = (
        (1.8601150690987451, 1.0), (1.0, 2.141678164201833),
        (0.316551133236474, 1.0000000000000002), (0.9999999999999999, 0.006403459809689593),
    )  # fmt: skip
    balls = (
        SceneBall("0", (0.918676754979138, 0.5765719263419249), 0.09643937343946066,
                  0.07183870962644359, velocity=(0.49489294394100547, -1.9376864772230549)),
        SceneBall("1", (1.1075316548641907, 0.38914220911828545), 0.15796113359557573,
                  78.03585942194894, velocity=(-1.2786365079667077, -2.5946803065635207)),
        SceneBall("2", (1.0091297460940618, 0.1623798681319752), 0.08669188608702513,
                  0.014291150885296226, velocity=(-4.6222656235220105, 4.001302495887214)),
        SceneBall("3", (1.2365182986919154, 1.057982262284119), 0.05327398969290699,
                  57.51030267633417, velocity=(2.538641035574766, -0.896729889407702)),
    )  # fmt: skip
    sand = Patch(center=(1.6638847228636298, 0.95), radius=0.221, surface=0.05)
    coefficients = Restitution(0.8, cushion=0.7), Friction(0.0, 0.1, 0.05)
    scene = Scene(balls, Table(corners), *coefficients, Physics(max_time=0.2), patches=(sand,))
    run = simulate(scene, solver="event-driven")
    assert [one for one in run.warnings if OVER_AND_OVER in one]
    assert all(one.until <= run.duration for one in run.persistent)
    assert scene.table is not None
    for x, y in (place for state in run.at(np.linspace(0.0, 0.2, 201))[0] for place in state):
        assert scene.table.contains(x, y)


def test_heavy_balls_press_a_light_one_into_nothing() -> None:
    """In a wedge of seven degrees, between balls of 430 times its mass: it was 13 mm before.

    Whether they become a crowd is chance: from the second start they do.
    """
    table = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 0.30788245514781865), (0.0, 0.05)))
    balls = (
        SceneBall("0", (0.4197815205888584, 0.05314116738651242), 0.047210245573260014,
                  2.3515492457292173, velocity=(-2.867246920458569, -1.5829879110065144)),
        SceneBall("1", (1.6751779942136462, 0.14584544222709417), 0.03370542202406761,
                  0.6485177890496693, velocity=(-1.9639666374414322, -0.4554935327266003)),
        SceneBall("2", (1.3130721961418952, 0.1608128717606837), 0.04404647336925191,
                  0.026863445909864708, velocity=(-1.7069803558658183, 1.8661654179019385)),
        SceneBall("3", (1.1746857149088048, 0.04479015243171658), 0.033181038917149394,
                  11.625696467950677, velocity=(-3.2389520465812307, -1.6381345125402405)),
        SceneBall("4", (1.942214210471146, 0.20099642868676482), 0.050533697106955384,
                  36.34844331006314, velocity=(-1.566155401825632, -1.1182682160742141)),
    )  # fmt: skip
    coefficients = Restitution(0.95, cushion=0.3), Friction(0.2, 0.1, 0.05, rolling=0.01)
    crowds = 0
    for far in (0.0, 1e-5):
        x, y = balls[0].position
        moved = replace(balls[0], position=(x + far, y)), *balls[1:]
        scene = Scene(moved, table, *coefficients, Physics(max_time=1.5))
        run = simulate(scene, solver="event-driven")
        crowds += any(OVER_AND_OVER in one for one in run.warnings)
        places = run.at(np.linspace(0.0, 1.5, 3001))[0]
        for i, j in itertools.combinations(range(5), 2):
            apart = np.hypot(*(places[:, i] - places[:, j]).T) - balls[i].radius - balls[j].radius
            assert apart.min() > -0.05 * min(balls[i].radius, balls[j].radius)
    assert crowds > 0


def test_a_crowd_that_a_ball_joins_at_once_is_slowed() -> None:
    """Two balls of this pile rolled on for ever, as the surface seemed to have slowed them."""
    scene = pile(50, 0.0, 1e-4)
    scene = replace(scene, physics=replace(scene.physics, max_time=20.0))
    assert simulate(scene, solver="event-driven", contact_tolerance=1e-8).status == "settled"


def test_a_hard_break_is_no_crowd() -> None:
    run = simulate(load("eight-ball"), solver="event-driven")
    assert not [w for w in run.warnings if OVER_AND_OVER in w]
