"""Groups of the core play contacts that persist, as accurately as a tolerance asks.

Only scenes with a reference are here.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    SOLVERS,
    Ball,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    Shot,
    Table,
    load,
    simulate,
)
from pool_pymunk.core.ball import Ball as CoreBall
from pool_pymunk.core.contact.contact import Pair
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.motion.surface import Rolling
from pool_pymunk.core.persistent import bounces
from pool_pymunk.core.persistent.group import Group
from pool_pymunk.core.persistent.member import ROLL, Member
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.touch import Touch
from pool_pymunk.report.listing import figures, shot_lines
from pool_pymunk.results.trace import Trace
from pool_pymunk.results.variants import SURE_OF_FINER
from pool_pymunk.solvers import event_driven
from pool_pymunk.solvers.again import Again
from pool_pymunk.solvers.in_core import table_of
from pool_pymunk.solvers.record import CONTACT_TOLERANCE, Settings
from tests.shared.hard_scenes import unmeasured
from tests.shared.press_scenes import farthest, press_scene
from tests.shared.scenes import largest_distance

TOLERANCE = 1e-8  # m
R, M = 0.0286, 0.17


def play(scene: Scene, tolerance: float = TOLERANCE) -> Trace:
    """Play a scene by the core alone."""
    settings = Settings(None, max_time=60.0, contact_tolerance=tolerance)
    trace = event_driven.solve(scene, scene.start(None), settings)
    assert trace.status == "settled"
    return trace


def ends_of(trace: Trace) -> list[complex]:
    return [complex(*rows[-1][1:3]) for rows in trace.knots]


def test_a_force_that_no_other_one_makes_redundant_is_exact() -> None:
    """A ball that rolls pushes one that slides, which the surface slows down more."""
    pull, drag = 2.0, 0.1
    scale, surface = Scale(TOLERANCE, R, pull), Rolling(pull, drag)
    behind, ahead = (
        Member(
            CoreBall(k, R, M, standing(0.0, 2.0 * R * k, 0.0)), scale, surface,
            (2.0 * R * k, 0.0, 1.0, 0.0), (1.0 - k, 0.0), 0.0,
        )
        for k in (0, 1)
    )  # fmt: skip
    behind.phase = ROLL
    touch = Touch(behind, ahead, None, None, Pair(M, M, 0.5, 0.0))
    group = Group([behind, ahead], [touch], 0.0, scale)
    assert group.decide(0.0, True)
    assert touch.n == pytest.approx(7.0 / 12.0 * M * (pull - drag), rel=1e-14)


def follower(e: float) -> Scene:
    """Return a ball that turns fast behind another one, and bounces on it ever lower."""
    return Scene(
        (
            Ball("b0", (0.0, 0.0), R, M, velocity=(0.602, 0.0), roll=4.31),
            Ball("b1", (0.057307, 0.0), R, M, velocity=(0.602, 0.0), roll=1.0),
        ),
        None, Restitution(e), Friction(0.25, 0.0, 0.0, rolling=0.01),
    )  # fmt: skip


@pytest.mark.parametrize("e", [0.5, 0.8, 0.9])
def test_bounces_that_are_left_out_count_in_first_order(e: float) -> None:
    """A ball that bounces slips for a share of the time, and does not feel rolling resistance then.

    Without that, the ends would move with the root of the tolerance: by 4e-4 m at 1e-5 m.
    """
    ends = [ends_of(play(follower(e), tolerance)) for tolerance in (1e-5, 1e-6, 1e-7)]
    assert farthest(ends[0], ends[2]) < 1e-6 and farthest(ends[1], ends[2]) < 1e-7


@pytest.mark.parametrize(("e", "mu"), [(0.7, 0.1), (0.7, 0.3), (0.5, 0.5), (0.9, 0.6)])
def test_so_do_bounces_of_a_ball_that_rolls_along_a_rough_arc(e: float, mu: float) -> None:
    """Friction on its roll is used up by hits sooner than in contact, where mu (1 + e) > 2/5.

    Otherwise the ends would move by up to 4e-4 m at 1e-5 m.
    """
    ball = Ball("a", (0.5, R + 1e-9), R, M, velocity=(0.6, -0.05), roll=1.0)
    rough = Friction(0.2, mu, 0.0, rolling=0.01)
    scene = Scene((ball,), Table.circle(0.5), Restitution(1.0, None, e), rough)
    ends = [ends_of(play(scene, tolerance)) for tolerance in (1e-5, 1e-7, 1e-10)]
    assert farthest(ends[0], ends[2]) < 1e-6 and farthest(ends[1], ends[2]) < 1e-8


@pytest.mark.parametrize("seed", [57, 88])
def test_so_do_hits_without_bounces(seed: int) -> None:
    """A ball follows two others, hits one after the other, and each hit parts it from the other.

    Otherwise the ends would move by 1e-5 m.
    """
    ends = [ends_of(play(press_scene(seed), tolerance)) for tolerance in (1e-6, 1e-9)]
    assert farthest(*ends) < 2e-6


# A ball rolls into a row of three, of which the first one is heavier.
IN_A_ROW = Scene(
    (
        Ball("0", (1.0, 0.6), R, M, velocity=(-0.4836, 0.0488), roll=1.0),
        Ball("1", (0.9116, 0.6089), R, 0.289),
        Ball("2", (0.8531, 0.6148), R, M),
        Ball("3", (0.7945, 0.6207), R, M),
    ),
    None, Restitution(0.3), Friction(0.1504, 0.1, 0.15, rolling=0.008),
)  # fmt: skip
# A ball rolls along an arc into another one.
ON_AN_ARC = Scene(
    (
        Ball("0", (1.10087, 0.3252), R, 0.102, velocity=(0.34388, 0.58635), roll=1.0),
        Ball("1", (1.13439, 0.39771), R, M),
    ),
    Table.circle(0.6), Restitution(0.1, cushion=0.2), Friction(0.22157, 0.1, 0.15, rolling=0.05),
)  # fmt: skip


@pytest.mark.parametrize("scene", [IN_A_ROW, ON_AN_ARC], ids=["row", "arc"])
def test_a_hit_that_would_be_seen_is_played(scene: Scene) -> None:
    """It neither waits, for balls slip meanwhile, nor loses its bounce where nothing presses then.

    The ends would move by 5e-6 and by 2e-6 m.
    """
    ends = [ends_of(play(scene, tolerance)) for tolerance in (1e-7, 1e-9)]
    assert farthest(*ends) < 5e-7


def grown(run: Run) -> float:
    """Return by what share of the start energy grows, at, before and between all breakpoints."""
    moments = np.unique(np.concatenate([rows[:, 0] for rows in run.knots]))
    spans = np.diff(moments)[:, np.newaxis] * np.array([0.0, 0.3, 0.6])
    before = np.maximum(np.nextafter(moments, 0.0), 0.0)
    times = np.unique(np.concatenate([(moments[:-1, np.newaxis] + spans).ravel(), before]))
    energy = run.energy_at(times)
    return float((energy - np.minimum.accumulate(energy)).max() / energy[0])


@pytest.mark.parametrize("e", [0.5, 0.8, 0.9])
def test_energy_does_not_grow_where_bounces_are_left_out(e: float) -> None:
    """Rolling resistance that they spare is less in the next pieces; given at once, it was 3e-5."""
    for tolerance in (1e-5, CONTACT_TOLERANCE):
        run = simulate(follower(e), solver="event-driven", contact_tolerance=tolerance)
        assert grown(run) < 1e-14


def test_a_ball_that_leaves_is_spared_the_resistance_that_it_did_not_feel() -> None:
    """Two balls that roll part at once after their slips were merged; it would be 3e-6 m."""
    balls = (
        Ball("0", (1.0, 0.6), R, 1.7 * M, velocity=(-0.342264150067, -0.412631365283), roll=1.0),
        Ball("1", (0.955117421379, 0.533289696449), R, 0.6 * M),
        Ball("2", (0.909789510568, 0.570887708072), R, M),
    )
    surface = Friction(0.168556044750, 0.1, 0.0, rolling=0.05)
    scene = Scene(balls, None, Restitution(0.0), surface)
    ends = [ends_of(play(scene, tolerance)) for tolerance in (CONTACT_TOLERANCE, 1e-9)]
    assert farthest(*ends) < 1e-6


@pytest.mark.parametrize("rough", [0.5, 1.0])
def test_no_impulses_of_a_rough_corner_add_energy(rough: float) -> None:
    """A ball leaves a corner; friction of one cushion drives it to the other one, and so on.

    Such impulses have no solution where friction is 1: rounding gave them 1e11 m/s.
    """
    friction = Friction(0.2, rough, 0.0, rolling=0.01)
    ball = Ball("a", (R, R), R, M)
    table = table_of(
        Scene((ball,), Table.rectangle(1.0, 1.0), Restitution(0.5, cushion=0.5), friction)
    )
    scale, surface, rest = (
        Scale(TOLERANCE, R, table.surface.pull),
        table.surface,
        standing(0.0, R, R),
    )
    member = Member(CoreBall(0, R, M, rest), scale, surface, (R, R, 1e-5, 1e-5), (1e-5, -1e-5), 0.0)
    sides = [(wall, wall.side_beside(R, R, R, 0.0)) for wall in table.walls]
    pair = Pair(M, math.inf, 0.5, rough)
    touches = [Touch(member, None, *each, pair) for each in sides if abs(each[1].gap(R, R, R)) < R]
    group = Group([member], touches, 0.0, scale)
    for one, slides in zip(touches, (-1.0, 1.0), strict=True):
        one.on, one.slides, one.turns = True, slides, 1.0
    group.list_unknowns()
    before = group.energy
    group.join()
    assert group.energy <= before


def round_table(friction: Friction, e: float, speed: float, tilt: float = 0.0) -> Scene:
    """Return a ball that meets a round cushion at a small angle, and stays there."""
    table, start = Table.circle(0.5), (0.15 * speed, 0.9 * speed)
    table = dataclasses.replace(table, tilt=(0.0, -tilt))
    ball = Ball("a", (0.9587, 0.5), 0.0213, 0.2, velocity=start)
    physics = Physics(max_time=1.0 / speed)
    return Scene((ball,), table, Restitution(0.9, cushion=e), friction, physics)


@pytest.mark.parametrize(("tilt", "most"), [(0.0, 1e-14), (0.3, 1e-11)])
def test_energy_does_not_grow_within_pieces(tilt: float, most: float) -> None:
    """A piece is no parabola where a wall bends it: by that it would grow by 1e-5."""
    run = simulate(round_table(Friction(0.0), 0.1, 1.0, tilt), solver="event-driven")
    assert len(run.knots[0]) > 50
    assert grown(run) < most


@pytest.mark.parametrize("seed", [65, 101, 174, 208])
def test_energy_never_grows_while_balls_press_on_each_other(seed: int) -> None:
    """Between breakpoints it fell too far, and grew again by up to 6e-8, by curves alone."""
    assert grown(unmeasured(press_scene(seed))) < 1e-14


def test_contacts_that_stick_and_slip_in_turn_take_few_pieces() -> None:
    """A hit at the same instant forms each group anew, of which none knew of the turns before."""
    places = [
        ((0.5726176764666708, 0.3450228731602691), 0.04282290430740979, 0.17),
        ((0.094290185752931, 0.10424377868741047), 0.030219112649431737, 0.17),
        ((0.0866164441425599, 0.16423996944285713), 0.030264837672666443, 0.34),
        ((0.38098501679037633, 0.21133508720265298), 0.0327482033931375, 0.17),
        ((0.28096759590358217, 0.2848909107904946), 0.04841313523768968, 0.085),
    ]
    velocities = [
        (1.4751428649420284, -1.7831334826181389), (0.9337138001267945, -0.07087295376803844),
        (-0.7818666526115602, 1.5537611008772507), (-0.5213107330689647, -0.24933906823888363),
        (0.0, 0.0),
    ]  # fmt: skip
    balls = [
        Ball(f"{k}", place, r, m, velocity=v)
        for k, ((place, r, m), v) in enumerate(zip(places, velocities, strict=True))
    ]
    corners = ((0.25, 0.0), (0.75, 0.0), (0.75, 0.5), (0.25, 0.5))
    table = Table(corners, bulge=(0.0, 1.0, 0.0, 1.0))
    friction = Friction(0.4, 0.1, 1.0, rolling=1e-6)
    scene = Scene(tuple(balls), table, Restitution(0.1, cushion=0.5), friction, Physics(max_time=2))
    assert sum(map(len, unmeasured(scene).knots)) < 20_000


def along_an_arc(tolerance: float) -> Group:
    """Return a ball that rolls along a round cushion, both without losses."""
    ball = Ball("a", (0.5, R), R, M)
    dead, surface = Restitution(0.5, cushion=0.0), Friction(0.2, rolling=0.0)
    table = table_of(Scene((ball,), Table.circle(0.5), dead, surface))
    scale, rest = Scale(tolerance, R, table.surface.pull), standing(0.0, 0.5, R)
    state, roll = (0.5, R, 1.0, 0.0), (1.0, 0.0)
    member = Member(CoreBall(0, R, M, rest), scale, table.surface, state, roll, 0.0)
    member.phase = member.mode = ROLL
    beside = [(wall, wall.side_beside(0.5, R, R, 0.0)) for wall in table.walls]
    [(wall, side)] = [each for each in beside if abs(each[1].gap(0.5, R, R)) < 1e-9]
    touch = Touch(member, None, wall, side, Pair(M, math.inf, 0.5, 0.0))
    return Group([member], [touch], 0.0, scale)


def test_the_errors_of_a_long_piece_add_no_energy() -> None:
    """They added 2e-8 of it; nor do they where a hit cuts a piece short."""
    group = along_an_arc(1e-3)
    before, group.longest = group.energy, 0.05
    group.decide(0.0, True)
    group.play(0.0)
    assert group.time == 0.05
    assert group.energy <= before * (1.0 + 1e-15)
    end = group.members[0].state
    group.states_at(0.5 * group.time)
    assert group.members[0].state == end  # To look at it changes nothing.
    group.go_to(0.9 * group.time)
    assert group.energy <= before * (1.0 + 1e-15)


def test_a_ball_whose_velocity_joining_changes_is_struck() -> None:
    """It is to go on along a new path, though nothing presses on it after that."""
    group = along_an_arc(TOLERANCE)
    [member], [touch] = group.members, group.touches
    member.vy = member.wy = -0.1
    touch.on = True
    group.look()
    group.list_unknowns()
    group.join()
    assert abs(member.vy) < 1e-9
    assert member.is_struck


def test_balls_that_stay_in_contact_do_not_overlap_between_breakpoints() -> None:
    balls = (
        Ball("A", (0.0, 0.0), R, M, velocity=(1.0, 0.0), roll=1.0),
        Ball("B", (2.0 * R + 1e-4, 0.01), R, M),
    )
    scene = Scene(balls, None, Restitution(0.0), Friction(0.1, 0.1, 0.1, rolling=0.01))
    run = simulate(scene, solver="event-driven", contact_tolerance=1e-6)
    [contact] = run.persistent
    a, b = run.at(np.linspace(contact.since, contact.until, 1001))[0].transpose(1, 0, 2)
    assert abs(np.hypot(*(b - a).T) - 2.0 * R).max() < 1e-9


def test_friction_that_bounces_spare_is_spared_however_short_they_are() -> None:
    """Otherwise bounces that take less than a piece would move the end by 8e-8 m."""
    ball = Ball("a", (0.3, 0.3), R, M, velocity=(0.5, -0.4))
    rough = Friction(0.3, 0.1, 0.0, rolling=0.02)
    scene = Scene((ball,), Table.rectangle(2.0, 1.0), Restitution(1.0, cushion=0.1), rough)
    tolerances = 10.0 ** np.arange(-11.0, -5.0)
    ends = [ends_of(play(scene, tolerance)) for tolerance in tolerances.tolist()]
    assert max(farthest(each, ends[0]) for each in ends) < 2e-8


@pytest.mark.parametrize("speed", [1.0, 100.0, 10_000.0])
def test_a_fast_ball_on_a_table_without_friction_is_as_exact_as_a_slow_one(speed: float) -> None:
    scene = round_table(Friction(0.0, 0.1), 0.1, speed)
    runs = [simulate(scene, solver="event-driven", contact_tolerance=t) for t in (1e-7, 1e-11)]
    assert largest_distance(*runs) < 1e-9


def test_a_lone_hit_comes_again_at_a_share_of_its_speed() -> None:
    """Two sides without slips, of restitution e, close at e times the last speed."""
    assert math.isclose(bounces.return_speed(0.5, [(2.0, 0.0), (2.0, 0.0)], 2.0), 0.5)


# -- the tolerance, and the figure -----------------------------------------------------------------


def bounced(tolerance: float | None = None) -> Run:
    """Play a ball that bounces on another one ever lower, to a tolerance (m)."""
    return simulate(follower(0.9), solver="event-driven", contact_tolerance=tolerance)


def test_a_finer_tolerance_takes_more_pieces_and_a_wide_one_is_a_share_of_a_radius() -> None:
    assert bounced().end == bounced(CONTACT_TOLERANCE).end
    pieces = [len(bounced(tolerance).knots[0]) for tolerance in (1e-5, CONTACT_TOLERANCE, 1e-9)]
    assert pieces == sorted(set(pieces))
    assert bounced(1.0).end == bounced(1e-3 * R).end


@pytest.mark.parametrize(
    ("speed", "angle", "most"),
    [
        (0.902628606666011, 1.1880513447940508, 6_000),
        (1.1784332681651901, 2.9729720593884412, 8_000),
        (1.1551848965911258, 2.7770781266097204, 4_500),
    ],
)
def test_groups_that_touch_do_not_take_each_other_apart(
    speed: float, angle: float, most: int
) -> None:
    """They did, hundreds of times in these soft breaks, or hit as often although no force acted."""
    scene = dataclasses.replace(load("eight-ball"), restitution=Restitution(0.5, cushion=0.5))
    scene = dataclasses.replace(scene, shots=(Shot("Break", "cue", speed=speed, angle=angle),))
    settings = Settings(None, max_time=60.0, contact_tolerance=CONTACT_TOLERANCE)
    trace = event_driven.solve(scene, scene.start(scene.shots[0]), settings)
    assert sum(map(len, trace.knots)) <= most


@pytest.mark.parametrize(("count", "gap"), [(3, 0.0), (3, 1e-12), (4, 1e-10)])
def test_balls_that_follow_each_other_round_a_table_go_on_in_long_pieces(
    count: int, gap: float
) -> None:
    """Their hits are rounding; each took groups apart, in up to 180,000 pieces."""
    table, r = Table.circle(0.3), 0.3 - R
    step = 2.0 * math.asin((R + gap / 2.0) / r)
    angles = [0.3 + k * step for k in range(count)]
    (x, y), (p, q) = table.outline
    balls = tuple(
        Ball(
            str(k), ((x + p) / 2.0 + r * math.cos(a), (y + q) / 2.0 + r * math.sin(a)), R, M,
            velocity=(-0.5 * math.sin(a), 0.5 * math.cos(a)), roll=1.0,
        )
        for k, a in enumerate(angles)
    )  # fmt: skip
    friction = Friction(0.2, rolling=0.0)
    scene = Scene(balls, table, Restitution(0.5, cushion=0.0), friction, Physics(max_time=5.0))
    run = simulate(scene, solver="event-driven")
    assert sum(map(len, run.knots)) < 12_000
    places = run.at(np.linspace(0.0, 5.0, 101))[0]
    distances = np.hypot(*np.diff(places, axis=1).transpose(2, 0, 1))
    assert abs(distances - 2.0 * R - gap).max() < CONTACT_TOLERANCE


def test_no_ball_whose_hit_is_none_is_forgotten() -> None:
    """Ball 2 slips along the cushion; it was played no more, and flew off the table in the run."""
    rows = (
        (0.485141311695456, 0.20053060087539082, -1.979006130813134, 0.48254269309135495, 0.17),
        (0.46768318734724995, 0.25500127196215616, 0.0, 0.0, 0.34),
        (0.1343740282738446, 0.07449907097692615, 0.22407748477066122, -0.13640284695124766, 0.085),
        (
            0.16538009271286574,
            0.12375213147069922,
            0.16389317875045076,
            -0.39586469415605496,
            0.085,
        ),
        (0.1354550814904442, 0.17249978478178635, 0.0, 0.0, 0.085),
        (0.19623178352724013, 0.19292827124503803, 0.0, 0.0, 0.17),
        (
            0.41404851864904496,
            0.27488283916984346,
            -0.04775330311798036,
            0.08119907689409671,
            0.085,
        ),
    )
    balls = tuple(
        Ball(str(k), (x, y), R, mass, velocity=(u, v)) for k, (x, y, u, v, mass) in enumerate(rows)
    )
    table = Table(((0.5299693840066618, 0.2649846920033309), (0.0, 0.2649846920033309)), (1.0, 1.0))
    friction = Friction(0.1, 0.3, 0.0, rolling=0.0)
    scene = Scene(balls, table, Restitution(0.9, cushion=0.0), friction, Physics(max_time=5.0))
    run = simulate(scene, solver="event-driven")
    assert grown(run) < 1e-6
    assert all(
        table.contains(x, y) for x, y in run.at(np.linspace(0.0, 5.0, 501))[0].reshape(-1, 2)
    )


@pytest.mark.parametrize("tolerance", [1e-6, 1e-7, 1e-8])
def test_a_slip_fades_however_short_its_last_pieces_are(tolerance: float) -> None:
    """du/dt = D - L u / |u| with |D| < L: the ball rolls, at each tolerance, and ends alike."""
    r = 0.5532809846688761
    start, speed = (0.37832588326965255, 0.9989019521918046), (-1.616081854278979, -0.45501678)
    ball = Ball("a", start, 0.05670269574339504, 0.2, velocity=speed, roll=-0.9019322714192797)
    surface = Friction(0.1, 0.0, 0.0, rolling=0.01)
    scene = Scene((ball,), Table.circle(r), Restitution(0.9, cushion=0.1), surface)
    runs = [
        simulate(scene, solver="event-driven", max_time=1.0, contact_tolerance=each)
        for each in (tolerance, 1e-10)
    ]
    assert len(runs[0].knots[0]) < 2000
    assert largest_distance(*runs) < 10.0 * tolerance


@pytest.mark.parametrize("tolerance", [3e-5, 1e-5])
def test_a_slip_too_small_to_be_followed_fades_where_friction_holds(tolerance: float) -> None:
    """Its direction changes within a piece; the ball slipped on, and ended 0.5 m off."""
    ball = Ball("a", (0.4941, 0.4487), R, M, velocity=(2.732, 0.3188), roll=1.0)
    smooth = Friction(0.02, rolling=0.001)
    scene = Scene((ball,), Table.circle(0.32), Restitution(1.0, cushion=0.0), smooth)
    ends = [ends_of(play(scene, each)) for each in (tolerance, 1e-8)]
    assert farthest(*ends) < 1e-3


def test_a_ball_whose_last_motion_was_an_error_of_a_piece_rests() -> None:
    rack = load("eight-ball")
    angle = 331 * (math.tau / 400)
    velocity = 4.5 * math.cos(angle), 4.5 * math.sin(angle)
    cue = rack.index["cue"]
    struck = dataclasses.replace(rack.balls[cue], velocity=velocity, roll=0.5)
    balls = (*rack.balls[:cue], struck, *rack.balls[cue + 1 :])
    scene = dataclasses.replace(
        rack, balls=balls, shots=(), physics=Physics(gravity=1.0),
        friction=dataclasses.replace(rack.friction, surface=1.96133, rolling=0.0980665),
    )  # fmt: skip
    assert play(scene, CONTACT_TOLERANCE).duration < 5.0


@pytest.mark.parametrize("solver", [name for name in SOLVERS if not SOLVERS[name].to_tolerance])
def test_a_solver_without_a_tolerance_takes_no_notice_of_it(solver: str) -> None:
    """So it is with the step of a solver that has none."""
    run = simulate(load("two-balls"), solver=solver, dt=1e-3, contact_tolerance=1e-3)
    assert run.contact_tolerance is None
    assert run == simulate(load("two-balls"), solver=solver, dt=1e-3)


def soft_break() -> Scene:
    """Return a soft break of eight-ball, whose hits amplify what is left out."""
    shot = Shot("soft", "cue", speed=1.0, aim="1", roll=1.0)
    return dataclasses.replace(load("eight-ball"), shots=(shot,))


def against_a_dead_cushion() -> Scene:
    """Return a ball that rolls on to a cushion and stays there, by closed forms."""
    ball = Ball("a", (0.2, 0.2), R, M, velocity=(-1.0, 0.5), roll=1.0)
    dead = Restitution(1.0, cushion=0.0)
    return Scene((ball,), Table.rectangle(2.0, 1.0), dead, Friction(0.2, 0.1, 0.0, rolling=0.02))


@pytest.mark.parametrize("is_amplified", [True, False])
def test_the_figure_is_ten_changes_by_finer_tolerances_or_ten_times_the_finest(
    is_amplified: bool,
) -> None:
    scene, tolerance = soft_break() if is_amplified else against_a_dead_cushion(), 1e-6
    run, *others = (
        simulate(scene, solver="event-driven", contact_tolerance=tolerance * share)
        for share in (1.0, 0.1, 1e-3)
    )
    moved = max(largest_distance(run, other) for other in others)
    least = SURE_OF_FINER * 1e-3 * tolerance
    assert (SURE_OF_FINER * moved > least) == is_amplified
    assert run.persistent_shift == max(SURE_OF_FINER * moved, least) < 0.1


def test_the_figure_covers_the_reference() -> None:
    final = [complex(4.095778492736671), complex(4.152978492736671)]
    for tolerance in (1e-4, 1e-5, 1e-6):
        run = bounced(tolerance)
        ends = [complex(*end) for end in run.final.values()]
        assert farthest(ends, final) <= min(run.persistent_shift, 0.1 * tolerance)


def test_the_run_is_played_again_when_the_figure_is_asked_for_and_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    played, play = list[float](), Again.moves

    def counted(
        self: Again, one: Any, variants: Any, known: Any, most: int | None = None
    ) -> Iterator[float]:
        played.extend(each.coarser for each in variants)
        return play(self, one, variants, known, most)

    monkeypatch.setattr(Again, "moves", counted)
    run = bounced()
    assert (sorted(run.policies), run.policy_shift, played) == ([], 0.0, [])
    assert run.persistent_shift == run.persistent_shift > 0.0
    assert played == [0.1, 1e-3]


def test_the_figure_is_at_most_the_diagonal_of_the_table() -> None:
    table = Table(((-1.0, -1.0), (9.0, -1.0), (9.0, 1.0), (-1.0, 1.0)))
    restitution = Restitution(0.9, cushion=0.9)
    scene = dataclasses.replace(follower(0.9), table=table, restitution=restitution)
    run = simulate(scene, solver="event-driven", contact_tolerance=9999.0)
    assert run.persistent_shift == scene.diagonal < 99.0


def test_a_run_without_such_contacts_has_no_figure() -> None:
    run = simulate(load("report"), 1, solver="event-driven")
    assert not run.persistent and run.persistent_shift == 0.0


@pytest.mark.parametrize("tolerance", [1e-7, 1e-3])
def test_the_log_and_the_json_say_it(tolerance: float) -> None:
    run = bounced(tolerance)
    [said] = [line for line in shot_lines(run) if "Contacts that persist" in line]
    assert said.endswith(f"by up to {run.scene.units.text(run.persistent_shift)}")
    assert figures(run)["persistent_shift"] == run.persistent_shift


def test_the_tolerance_is_saved(tmp_path: Path) -> None:
    run = bounced(1e-6)
    run.save(tmp_path / "run.npz")
    again = Run.load(tmp_path / "run.npz")
    assert again == run and again.contact_tolerance == 1e-6
    assert math.isnan(again.persistent_shift)
