"""Balls slide, then roll: closed forms, forty digits, and the odd ends of a phase."""

from __future__ import annotations

import json
import math
import random
from typing import Any

import numpy as np
import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Billiards,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    SettingError,
    Shot,
    State,
    Table,
    load,
    same_balls,
    simulate,
)
from pool_pymunk.solvers import SOLVERS
from tests import DATA
from tests.oracle.reference import OUTLINES, random_rolling_scene
from tests.oracle.reference import scene_from_dict as scene_of
from tests.shared.hard_scenes import exact
from tests.shared.scenes import seeds

ANSWERS = json.loads((DATA / "rolling_runs.json").read_text())
G = 9.80665
R, MASS = 0.03, 0.2
BODIES: list[pymunk.Body] = []  # A shape of pymunk's does not keep its body alive.
SLIDING, ROLLING = 0.2, 0.01


def ball(id_: str = "C", x: float = 0.0, y: float = 0.0, **parts: Any) -> Ball:
    return Ball(id_, (x, y), R, MASS, cue=id_ == "C", **parts)


def scene(*balls: Ball, **parts: Any) -> Scene:
    """Return balls that roll, on a plane unless a table is given; the first one is struck."""
    made: dict[str, Any] = {
        "restitution": Restitution(1.0, None, 0.8),
        "friction": Friction(SLIDING, 0.0, 0.0, ROLLING),
        **parts,
    }
    return Scene(balls or (ball(),), **made)


def struck(speed: float, roll: float, *others: Ball, angle: float = 0.0, **parts: Any) -> Run:
    """Play one shot of the cue ball from the origin."""
    shot = Shot("shot", "C", speed=speed, angle=angle, roll=roll)
    return exact(scene(ball(), *others, shots=(shot,), **parts))


def kinds(run: Run) -> list[tuple[str, str]]:
    return [(event.kind, "".join(event.balls)) for event in run.events]


@pytest.mark.parametrize(
    "name", ["coulomb l-shape 1 rolling", "published hexagon 1 rolling", "stadium"]
)
def test_slices_come_to_the_exact_ends_with_order_one(name: str) -> None:
    recorded = {record["name"]: record["scene"] for record in ANSWERS}
    what = scene_of(recorded[name]) if name in recorded else load(name)
    ends, errors = exact(what).final, []
    for dt in (1e-3, 1e-4, 1e-5):
        run = simulate(what, solver="time-slice", dt=dt)
        errors.append(max(math.dist(run.final[id_], ends[id_]) for id_ in ends))
    assert errors[0] < (2e-3 if name in recorded else 0.5)  # A stadium amplifies them.
    assert -0.7 > math.log10(errors[2] / errors[0]) / 2 > -1.3


def test_slices_lead_a_ball_that_follows_on_behind_the_other() -> None:
    """A dull hit, and then the roll presses the ball on to the one that it has hit."""
    shot = Shot("shot", "C", speed=1.0, angle=0.0, roll=1.0)
    dull = Restitution(0.1, None, 0.8)
    what = scene(ball(), ball("1", 0.3), restitution=dull, shots=(shot,))
    run = simulate(what, solver="time-slice", dt=1e-4)
    assert run.final["C"] == pytest.approx((1.5033, 0.0), abs=2e-3)
    assert run.final["1"] == pytest.approx((1.5633, 0.0), abs=2e-3)
    assert len(run.events) < 60


@pytest.mark.parametrize("y", [0.0, 0.01])
def test_slices_list_the_hit_of_a_ball_that_pushes_another_and_not_each_slice(y: float) -> None:
    """At e = 0 both stay in contact, and friction closes them by up to 2 mu g dt in a slice."""
    balls = ball("A", velocity=(1.0, 0.0), roll=1.0), ball("B", 0.0605, y)
    run = simulate(scene(*balls, restitution=Restitution(0.0)), solver="time-slice", dt=1e-4)
    assert kinds(run).count(("ball-ball", "AB")) == 1
    assert run.end.position[1][0] > 0.5


# -- tables in pymunk spaces -----------------------------------------------------------------------


def table_of(dt: float = 1 / 60, **settings: Any) -> Billiards:
    parts = {"pair": same_balls(0.95, 0.0), "deceleration": 2.0, "rolling": 0.1, **settings}
    return Billiards(pymunk.Space(), dt, **parts)


def circle(x: float = 0.0, y: float = 0.0) -> pymunk.Circle:
    body = pymunk.Body(MASS, math.inf)
    BODIES.append(body)
    body.position = x, y
    return pymunk.Circle(body, R)


def rest(table: Billiards, *lengths: float) -> list[float]:
    """Make steps of these lengths (s) in turn until all rest, and return x and y of each ball."""
    for k in range(100_000):
        if not table.moving:
            break
        table.space.step(lengths[k % len(lengths)])
    return [number for each in table.balls for number in each.body.position]


def test_a_ball_does_not_stop_while_it_has_a_roll() -> None:
    table, heard = table_of(), list[str]()
    cue, other = table.add_ball(circle()), table.add_ball(circle(0.5))
    table.on_contact = lambda contact: heard.append("hit")
    table.on_stop = lambda ball, t: heard.append(f"stop {ball.number}")
    table.strike(cue, (1.0, 0.0), roll=1.0)
    seen = table.predict(cue, (1.0, 0.0), roll=1.0)
    ends = rest(table, 1 / 60)
    assert heard == ["hit", "stop 0", "stop 1"]
    assert seen.met is other
    assert seen.way[1] == seen.where == pytest.approx((0.5 - 2 * R, 0.0), abs=1e-12)
    assert [*seen.way[-1], *seen.other_way[-1]] == pytest.approx(ends, abs=1e-9)
    assert len(seen.way) == len(seen.other_way) + 1 == 4


def test_a_saved_state_has_the_roll_and_a_placed_ball_has_none() -> None:
    table = table_of()
    one = table.add_ball(circle())
    table.strike(one, (1.0, 0.0), roll=-2.0)
    for _ in range(5):
        table.space.step(1 / 60)
    saved = table.save_state()
    assert saved.rolls is not None and saved.rolls[0][0] < -1.5
    first = rest(table, 1 / 60)
    table.restore_state(saved)
    assert table.save_state() == saved
    assert rest(table, 1 / 60) == pytest.approx(first, abs=1e-14)
    table.restore_state(saved)
    table.place(one, (1.0, 1.0))
    assert (table.save_state().rolls, table.moving) == ({0: (0.0, 0.0)}, {})


def test_a_velocity_set_by_hand_leaves_the_roll() -> None:
    table = table_of()
    one = table.add_ball(circle())
    table.strike(one, (1.0, 0.0), roll=1.0)
    one.body.velocity = 0.0, 1.4
    assert table.save_state().rolls == {0: (1.0, 0.0)}
    rest(table, *[1 / 60] * 60)
    x, y = one.body.position
    assert (x > 0.2) and (y > 1.0)


def test_settings_and_strikes_that_cannot_be() -> None:
    table = table_of(rolling=None)
    one = table.add_ball(circle())
    with pytest.raises(SettingError, match=r"^roll = 1\.0: balls do not roll on a table without"):
        table.strike(one, (1.0, 0.0), roll=1.0)
    with pytest.raises(SettingError, match=r"^roll = inf: must be a finite number"):
        table.strike(one, (1.0, 0.0), roll=math.inf)


# -- closed forms ----------------------------------------------------------------------------------


@pytest.mark.parametrize("roll", [-1.5, 0.0, 0.4, 2.0])
def test_a_ball_rolls_at_five_sevenths_of_its_velocity_and_two_of_its_roll(roll: float) -> None:
    speed = 1.4
    run = struck(speed, roll)
    rolling = (5.0 + 2.0 * roll) / 7.0 * speed
    time = 2.0 * abs(1.0 - roll) * speed / (7.0 * SLIDING * G)
    last = rolling / (ROLLING * G)
    assert kinds(run) == [("roll", "C"), ("stop", "C")]
    assert run.events[0].t == pytest.approx(time, rel=1e-14)
    assert run.at(time)[1][0].tolist() == pytest.approx([rolling, 0.0], rel=1e-13)
    assert run.roll_at(time)[0].tolist() == pytest.approx([rolling, 0.0], rel=1e-13)
    assert run.duration == pytest.approx(time + abs(last), rel=1e-13)
    far = (speed + rolling) / 2.0 * time + rolling * last / 2.0
    assert run.final["C"] == pytest.approx((far, 0.0), rel=1e-12)


def test_the_slip_keeps_its_direction_and_the_path_is_a_parabola() -> None:
    start = State(((0.0, 0.0),), ((1.0, 0.0),), frozenset(), ((0.0, 2.0),))
    run = exact(scene(), start)
    time, (ux, uy) = run.events[0].t, (1.0 / math.sqrt(5.0), -2.0 / math.sqrt(5.0))
    t = np.linspace(0.0, time, 7)
    places, velocities = run.at(t)
    slips = velocities[:, 0] - run.roll_at(t)[:, 0]
    assert slips @ np.array([-uy, ux]) == pytest.approx(np.zeros(7), abs=1e-15)
    pull = SLIDING * G
    assert places[:, 0, 0] == pytest.approx(t - pull * ux * t**2 / 2.0, abs=1e-14)
    assert places[:, 0, 1] == pytest.approx(-pull * uy * t**2 / 2.0, abs=1e-14)


@pytest.mark.parametrize(("full", "degrees"), [(0.25, 27.27), (0.5, 33.67), (0.75, 27.63)])
def test_a_rolling_ball_leaves_a_hit_by_the_30_degree_rule(full: float, degrees: float) -> None:
    """Tan of the angle is sin a cos a / (sin^2 a + 2/5), where sin a = 1 - full.

    Straight after the hit the ball moves along the tangent, at v sin a. Its roll is still v along
    the old path, and it rolls at 5/7 of the one and 2/7 of the other.
    """
    a = math.asin(1.0 - full)
    other = ball("1", 0.5 + 2 * R * math.cos(a), 2 * R * math.sin(a))
    friction = Friction(SLIDING, 0.0, 0.0, 0.0)
    run = struck(1.0, 1.0, other, friction=friction, physics=Physics(max_time=2.0))
    vx, vy = run.end.velocity[0]
    expected = math.atan2(math.sin(a) * math.cos(a), math.sin(a) ** 2 + 0.4)
    assert math.degrees(expected) == pytest.approx(degrees, abs=0.005)
    assert math.atan2(-vy, vx) == pytest.approx(expected, abs=1e-13)


def test_a_cushion_slows_the_roll_into_it() -> None:
    """A ball that rolls head-on into a cushion has 5/2 mu |v_n' - v_n| of its roll less."""
    e, mu = 0.5, 0.1
    run = struck(
        1.0, 1.0, table=Table(((-2, -1), (2, -1), (2, 1), (-2, 1))),
        restitution=Restitution(1.0, None, e), friction=Friction(SLIDING, mu, 0.0, ROLLING),
    )  # fmt: skip
    hit = run.events[0]
    assert hit.kind == "ball-cushion"
    v = math.sqrt(1.0 - 2.0 * ROLLING * G * (2.0 - R))
    assert run.at(hit.t)[1][0].tolist() == pytest.approx([-e * v, 0.0], rel=1e-12)
    kept = v - 2.5 * mu * (1.0 + e) * v
    assert run.roll_at(hit.t)[0].tolist() == pytest.approx([kept, 0.0], rel=1e-12)


@pytest.mark.parametrize("solver", [name for name, one in SOLVERS.items() if one.rolls])
@pytest.mark.parametrize("far", [2.0, 2.5])  # A rectangle has a rule of its own in time slices.
def test_friction_at_a_cushion_never_turns_the_roll_round(solver: str, far: float) -> None:
    table = Table(((-2, -1), (0.25, -1), (0.25, 1), (-far, 1)))
    what = scene(table=table, friction=Friction(SLIDING, 5.0, 0.0, ROLLING),
                 shots=(Shot("shot", "C", (1.0, 0.0), roll=1.0),))  # fmt: skip
    run = simulate(what, solver=solver, max_time=0.3)
    hit = next(event for event in run.events if event.kind == "ball-cushion")
    assert run.roll_at(hit.t)[0].tolist() == [0.0, 0.0]


# -- invariants ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", seeds(12))
@pytest.mark.seeded
def test_energy_never_grows(seed: int) -> None:
    rng = random.Random(seed)
    what = random_rolling_scene("coulomb", rng.choice(sorted(OUTLINES)), rng)
    run = exact(what)
    energy = run.energy_at(np.linspace(0.0, run.duration, 2_000))
    assert np.diff(energy).max() <= 1e-12 * energy[0]
    assert run.energy["initial"] == pytest.approx(energy[0])


@pytest.mark.parametrize(("speed", "roll", "angle"), [(2.0, 1.0, 60.0), (2.0, 3.0, 90.0)])
def test_what_a_roll_presses_to_a_cushion_gains_no_energy(
    speed: float, roll: float, angle: float
) -> None:
    table = Table(((-5.0, -1.0), (25.0, -1.0), (25.0, 1.0), (-5.0, 1.0)))
    dull = Restitution(1.0, None, 0.0)
    run = struck(speed, roll, angle=angle, table=table, restitution=dull)
    assert np.diff(run.energy_at(run.knots[0][:, 0])).max() <= 1e-15 * run.energy["initial"]


def test_a_hit_keeps_momentum_and_rolls() -> None:
    run = struck(2.0, 0.7, ball("1", 0.5, 0.02), friction=Friction(SLIDING, 0.0, 0.1, ROLLING))
    t = run.events[0].t
    before, after = np.nextafter(t, 0.0), t
    assert run.at(before)[1].sum(axis=0) == pytest.approx(run.at(after)[1].sum(axis=0), abs=1e-12)
    assert run.roll_at(before) == pytest.approx(run.roll_at(after), abs=1e-12)


def test_a_scene_without_rolling_has_no_roll() -> None:
    slides = scene(friction=Friction(SLIDING), shots=(Shot("s", "C", speed=1.0, angle=0.0),))
    run = exact(slides)
    assert run.knots[0].shape[1] == 7
    assert run.end.roll is None
    with pytest.raises(SettingError, match=r"friction\.rolling"):
        run.roll_at(0.0)


# -- the odd ends of a phase -----------------------------------------------------------------------


def test_a_ball_at_rest_that_rotates_sets_off() -> None:
    start = State(((0.0, 0.0),), ((0.0, 0.0),), frozenset(), ((0.7, 0.0),))
    run = exact(scene(), start)
    assert kinds(run) == [("roll", "C"), ("stop", "C")]
    assert run.at(run.events[0].t)[1][0].tolist() == pytest.approx([0.2, 0.0], rel=1e-13)


@pytest.mark.parametrize("deep", [-1e-12, 1e-12])
def test_a_ball_with_draw_that_grazes_a_ball_where_it_turns_back(deep: float) -> None:
    """The stability matrix has faces, corners and rims, and the other odd ends."""
    pull, vy = SLIDING * G, -0.5
    far = vy * vy / (2.0 * pull)  # at most: the slip points along -y while v_y > -roll
    places = ((0.0, far - deep + 2 * R), (0.0, 0.0))
    start = State(places, ((0.0, vy), (0.0, 0.0)), frozenset(), ((0.0, 2.0), (0.0, 0.0)))
    run = exact(scene(ball(), ball("1", 1.0)), start)
    assert (("ball-ball", "C1") in kinds(run)) == (deep > 0.0)


# -- held to a cushion -----------------------------------------------------------------------------


def held(mu: float, v: float, w_t: float, w_n: float, step: float = 1e-6) -> float:
    """Return how far (m) a ball that its roll holds to a cushion goes on along it, by slices.

    With p = mu_s g |u_n| / |u|: dv/dt = -mu_s g u_t / |u| - mu p sign(v), dw_t/dt = (5/2) mu_s g
    u_t / |u|, and |w_n| falls at (5/2) (p + mu p). Then the ball rolls to rest.
    """
    x, pull = 0.0, SLIDING * G
    while True:
        u_t, u = v - w_t, math.hypot(v - w_t, w_n)
        if u < 10.0 * pull * step:
            return x + v * abs(v) / (2.0 * ROLLING * G)
        press = pull * abs(w_n) / u
        slows = pull * u_t / u
        x += v * step
        v -= (slows + math.copysign(mu * press, v)) * step
        w_t += 2.5 * slows * step
        w_n -= math.copysign(min(2.5 * (1.0 + mu) * press * step, abs(w_n)), w_n)


@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_a_roll_holds_a_ball_to_a_cushion(mu: float) -> None:
    table = Table(((-5.0, -1.0), (25.0, -1.0), (25.0, 1.0), (-5.0, 1.0)))
    run = struck(
        2.0, 1.0, angle=60.0, table=table, restitution=Restitution(1.0, None, 0.0),
        friction=Friction(SLIDING, mu, 0.0, ROLLING),
    )  # fmt: skip
    hit = run.events[0]
    (v, _), (w_t, w_n) = run.at(hit.t)[1][0].tolist(), run.roll_at(hit.t)[0].tolist()
    far = run.at(hit.t)[0][0, 0] + held(mu, v, w_t, w_n)
    assert run.persistent and run.policies == set()
    assert run.final["C"][0] == pytest.approx(far, abs=2e-5)  # which is the error of the slices
    assert 0.0 < run.persistent_shift < 1e-6
    assert run.final["C"][1] == pytest.approx(1.0 - R, abs=1e-12)


def test_a_ball_begins_to_roll_once_while_an_arc_presses_it() -> None:
    """The arc turns it in many pieces of its path, and none of their ends is an event.

    There are 93 at the tolerance that a run has by default.
    """
    start, dull = ball(x=0.5, y=R, velocity=(0.15, 0.0)), Restitution(cushion=0.2)
    run = exact(scene(start, table=Table.circle(0.5), restitution=dull))
    assert run.persistent and run.policies == set()
    assert len(run.knots[0]) > 60
    assert kinds(run) == [("roll", "C"), ("stop", "C")]


# -- input -----------------------------------------------------------------------------------------


def test_shots_go_on_with_the_roll_that_there_was() -> None:
    first = Shot("one", "C", speed=1.0, angle=0.0, roll=1.0)
    then = Shot("two", "1", speed=0.5, angle=90.0, from_previous=True)
    what = scene(ball(), ball("1", 3.0), shots=(first, then), physics=Physics(max_time=0.5))
    run = simulate(what, "two", solver="event-driven")
    assert run.roll_at(0.0)[0].tolist() == run.at(0.0)[1][0].tolist() != [0.0, 0.0]
    assert run.roll_at(0.0)[1].tolist() == [0.0, 0.0]
