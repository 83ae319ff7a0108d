"""Round cushions: arcs of the outline, and posts."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Post,
    Restitution,
    Run,
    Scene,
    Shot,
    Table,
    load,
    simulate,
    simulate_many,
)
from pool_pymunk.core.motion.path import Path, sliding
from pool_pymunk.core.motion.surface import Rolling
from pool_pymunk.core.walls.arc import Arc
from tests.oracle.hard_reference import hard_run
from tests.oracle.reference import Refused
from tests.shared.shots import check_bits

R, r = 0.5, 0.03  # m; of a round table, and of its ball
LENS = Table(((0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)), (0.3, -0.2, 0.0, -0.3))
INNER = R - r  # m; the centre of the ball is on this circle as it touches the cushion


def on_a_circle(
    speed: float, angle: float, e: float = 1.0, rubs: float = 0.0, slows: float = 0.0, **more: Any
) -> Scene:
    """Return a scene with a ball that touches a round cushion at its lowest point, and sets off."""
    velocity = speed * math.cos(angle), speed * math.sin(angle)
    return Scene(
        balls=(Ball("C", (R, R - INNER), r, 0.2, cue=True, velocity=velocity),),
        table=Table.circle(R),
        restitution=Restitution(cushion=e),
        friction=Friction(slows, rubs),
        physics=Physics(max_time=more.pop("max_time", None)),
    )


def play(scene: Scene) -> Run:
    return simulate(scene, solver="event-driven")


def around(run: Run) -> float:
    """Return by which angle (rad) the ball ends beyond the lowest point, from 0 to a whole turn."""
    x, y = run.final["C"]
    return (math.atan2(y - R, x - R) + math.pi / 2) % math.tau


# -- arcs ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("e", "rubs"), [(0.0, 0.0), (0.2, 0.2)])
def test_a_ball_runs_along_an_arc_as_the_equation_has_it(e: float, rubs: float) -> None:
    """With s along the arc, d(v^2)/ds = -2 (mu_s g + mu v^2 / R) holds until the ball rests."""
    slows = 0.05
    run = play(on_a_circle(1.2, 0.0, e, rubs, slows))
    pull = slows * 9.80665
    if rubs:
        length = INNER / (2 * rubs) * math.log(1 + rubs * 1.2**2 / (pull * INNER))
    else:
        length = 1.2**2 / (2 * pull)
    off = abs(around(run) - (length / INNER) % math.tau) * INNER
    assert run.persistent and run.policies == set()
    assert off < run.persistent_shift < 5e-3
    assert off < 2e-5


@pytest.mark.parametrize("rubs", [0.0, 0.1])
def test_a_ball_rolls_along_an_arc_as_the_equation_has_it(rubs: float) -> None:
    """While the cloth turns its roll, d(v^2)/ds = -2 (mu_r g + mu v^2 / (R (1 + mu))) holds.

    The push of the cushion is 7/5 v^2 / R / (1 + mu): its friction helps to turn the roll.
    """
    speed, pull = 0.4, 0.05 * 9.80665
    scene = on_a_circle(speed, 0.0, 0.2, rubs, 0.2)
    friction = replace(scene.friction, rolling=0.05)
    scene = replace(scene, balls=(replace(scene.balls[0], roll=1.0),), friction=friction)
    run = play(scene)
    length = speed**2 / (2 * pull)
    if rubs:
        loss = rubs / (1 + rubs)
        length = INNER / (2 * loss) * math.log(1 + loss * speed**2 / (pull * INNER))
    off = abs(around(run) - length / INNER) * INNER
    assert run.persistent
    assert off < run.persistent_shift < 1e-3
    assert off < 1e-5
    assert [event.kind for event in run.events].count("roll") <= 2
    assert np.diff(run.energy_at(run.knots[0][:, 0])).max() <= 1e-15 * run.energy["initial"]


def test_a_ball_without_losses_runs_along_an_arc_for_ever() -> None:
    run = play(on_a_circle(1.0, 0.0, 0.5, max_time=2.0))
    assert math.hypot(*run.velocity[-1, 0]) == pytest.approx(1.0, abs=1e-4)
    assert abs(around(run) - (2.0 / INNER) % math.tau) * INNER < run.persistent_shift


def test_no_ball_leaves_a_stadium() -> None:
    for k in range(12):
        shot = Shot("hard", "C", speed=20.0, angle=30.0 * k)
        run = play_shot(replace(load("stadium"), shots=(shot,)), 1)
        x, y = np.moveaxis(run.at(np.linspace(0.0, run.duration, 500))[0], -1, 0)
        beside = np.maximum(np.abs(x - 1.0) - 0.5, 0.0)
        assert np.hypot(beside, y - 0.5).max() < R - r + 1e-9


@pytest.mark.slow
def test_ends_with_segments_in_place_of_arcs_converge_with_their_number() -> None:
    """A hit on one of n segments has the normal of a chord, which is off by up to 90 / n degrees.

    The error of a gentle shot at the segments' ends falls with 1/n; it is averaged over 24 shots.
    """
    off = []
    arcs = gentle(Table.stadium(2.0, 1.0))
    for n in (16, 64, 256):
        turns = [math.pi * (k / n - 0.5) for k in range(n + 1)]
        right = [(1.5 + R * math.cos(a), R + R * math.sin(a)) for a in turns]
        outline = (*right, *((2.0 - x, 1.0 - y) for x, y in right))
        off.append(float(np.hypot(*(gentle(Table(outline)) - arcs).T).mean()))
    slope = np.polyfit(np.log((16, 64, 256)), np.log(off), 1)[0]
    assert slope == pytest.approx(-1.0, abs=0.25)
    assert off[-1] < 1.5 / 256


def gentle(table: Table) -> Any:
    """Return the ends (shots, 2) of gentle shots all around on a table."""
    base = replace(load("stadium"), table=table, posts=(), balls=load("stadium").balls[:1])
    shots = tuple(Shot(f"{k}", "C", speed=0.8, angle=15.0 * k + 3.0) for k in range(24))
    scene = replace(base, shots=shots)
    return np.array([play_shot(scene, k).final["C"] for k in range(1, 25)])


def play_shot(scene: Scene, k: int) -> Run:
    return simulate(scene, k, solver="event-driven")


def test_an_arc_waits_for_the_second_crossing() -> None:
    """A parabola comes into the circle beside the arc, and leaves it there; then it meets it."""
    arc = Arc((0.0, 0.0), 1.0, (0.0, -1.0), (0.0, 1.0), -1.0)
    path = Path(0.0, -3.0, 0.2, 2.0, 0.0, -0.1, 0.03, 5.0, False, 0.0, 0.0)
    t = arc.time_of_contact(path, 0.1, 0.0)
    assert math.hypot(*path.place(t)) == pytest.approx(0.9, abs=1e-14)
    assert path.place(t)[0] > 0.0
    away = sliding(0.0, (-3.0, 0.2), (-1.0, 0.0), 0.1)
    assert arc.time_of_contact(away, 0.1, 0.0) == math.inf


def test_a_ball_behind_an_arc_meets_it_when_it_comes_back() -> None:
    arc = Arc((0.0, 0.0), 1.0, (0.0, -1.0), (0.0, 1.0), 1.0)
    assert arc.time_of_contact(sliding(0.0, (0.5, 0.0), (3.0, 0.0), 0.1), 0.1, 0.0) == math.inf
    path = Path(0.0, 0.5, 0.0, 3.0, 0.0, -2.0, 0.0, 10.0, False, 0.0, 0.0)
    t = arc.time_of_contact(path, 0.1, 0.0)
    assert t > 1.5
    assert path.place(t)[0] == pytest.approx(1.1, abs=1e-13)


# -- posts -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_a_post_answers_as_a_cushion(radius: float) -> None:
    """A ball that meets a post half full leaves it by Eq. 9 along the line of centres."""
    touching, e, mu = radius + r, 0.8, 0.1
    ball = Ball("C", (0.0, touching / 2), r, 0.2, velocity=(2.0, 0.0))
    scene = Scene((ball,), restitution=Restitution(cushion=e), friction=Friction(0.2, mu))
    scene = replace(scene, posts=(Post((1.0, 0.0), radius),))
    run = play(scene)
    pull, n = 0.2 * 9.80665, (-math.sqrt(0.75), 0.5)
    hit = 1.0 - math.sqrt(0.75) * touching
    speed = math.sqrt(4.0 - 2 * pull * hit)
    v_n, v_t = speed * math.sqrt(0.75), speed / 2
    v_n, v_t = e * v_n, v_t - mu * (1 + e) * v_n
    far = (v_n**2 + v_t**2) / (2 * pull) / math.hypot(v_n, v_t)
    x = hit + far * (v_n * n[0] + v_t * n[1])
    y = touching / 2 + far * (v_n * n[1] - v_t * n[0])
    assert math.dist(run.final["C"], (x, y)) < 1e-13
    assert [event.cushion for event in run.events] == [0, None]


def test_a_post_has_its_own_coefficients() -> None:
    ball = Ball("C", (0.0, 0.0), r, 0.2, velocity=(2.0, 0.0))
    own = Scene((ball,), friction=Friction(0.2), posts=(Post((1.0, 0.0), 0.1, 0.5, 0.3),))
    as_all = Scene((ball,), None, Restitution(cushion=0.5), Friction(0.2, 0.3))
    as_all = replace(as_all, posts=(Post((1.0, 0.0), 0.1),))
    assert play(own).final == play(as_all).final
    batch = simulate_many(own, None, None)
    assert batch.final[0].tolist() == [list(play(own).final["C"])]


# -- wedges ----------------------------------------------------------------------------------------

# These are the bulges of the sides that meet at the tip, from one and the other half of the angle.
WEDGES = {
    "two arcs inwards": (-0.08, -0.06, 0.4),
    "two arcs outwards": (0.05, 0.09, 0.15),
    "an arc inwards and a face": (-0.106, 0.0, 0.4),
    "an arc outwards and a face": (0.06, 0.0, 0.2),
}


def in_a_wedge(kind: str, e: float, rubs: float = 0.0) -> Scene:
    """Return a scene with a ball that runs into the tip of a triangle at the origin."""
    below, above, high = WEDGES[kind]
    table = Table(((0.0, 0.0), (1.0, -high / 2), (1.0, high / 2)), (below, 0.0, above))
    ball = Ball("C", (0.6, 0.02), 0.014, 0.2, velocity=(-0.9, -0.07))
    return Scene((ball,), table, Restitution(cushion=e), Friction(0.03, rubs))


@pytest.mark.parametrize("rubs", [0.0, 0.2])
@pytest.mark.parametrize("e", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("kind", WEDGES)
def test_a_ball_in_a_wedge_of_arcs_ends_where_many_digits_have_it(
    kind: str, e: float, rubs: float
) -> None:
    """Hits that collapse there are leapt over; a ball that slides along an arc is refused."""
    scene = in_a_wedge(kind, e, rubs)
    try:
        answer = hard_run(scene)
    except Refused:
        assert play(scene).persistent
        return
    (end,), run = answer.final, play(scene)
    assert run.status == "settled"
    assert math.dist(run.final["C"], (float(end.real), float(end.imag))) < 1e-11


def test_a_dull_hit_on_an_arc_inwards_is_one_hit() -> None:
    """The ball moves along the arc then, and so away from it."""
    run = play(in_a_wedge("an arc inwards and a face", 0.0))
    first = run.events[0].t
    assert [event.t for event in run.events].count(first) == 1
    assert run.steps < 200


# -- everywhere ------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0])
def test_a_ball_at_rest_that_its_roll_drives_along_an_arc_sets_off(turn: float) -> None:
    """It meets the arc when it is off the circle by rounding, and not at once, for ever."""
    (x, y), (cos, sin) = (0.3, 0.2), (math.cos(turn), math.sin(turn))
    arc = Arc((x, y), 1.0, (sin, -cos), (-sin, cos), -1.0)
    place, roll = (x + (1.0 - r) * cos, y + (1.0 - r) * sin), (-0.5 * sin, 0.5 * cos)
    path = Rolling(2.0, 0.1).path(2.0, place, (0.0, 0.0), roll)
    t = arc.time_of_contact(path, r, 2.0)
    assert 1e-5 < t - 2.0 < 1e-3
    assert abs(arc.gap(*path.place(t), r)) < 1e-14


STADIUM = Table.stadium(2.0, 1.0)


def test_a_batch_has_the_coefficients_of_posts() -> None:
    """What a post has of its own stays as it is where those of cushions differ."""
    ball = Ball("C", (0.0, 0.0), r, 0.2, velocity=(2.0, 0.1))
    for own in ((0.5, 0.3), (0.5, None), (None, 0.3), (None, None)):
        scene = Scene((ball,), None, Restitution(cushion=0.9), Friction(0.2, 0.1))
        scene = replace(scene, posts=(Post((1.0, 0.0), 0.1, *own),))
        vary = {"restitution.cushion": [0.4, 0.9], "friction.cushion": [0.1, 0.2]}
        batch = simulate_many(scene, vary=vary)
        assert (batch.final[0] == batch.final[1]).all() == (None not in own)
        check_bits(batch, range(2))


@pytest.mark.parametrize(
    ("outline", "bulge"),
    [(STADIUM.outline, STADIUM.bulge),
     (((2.0, 0.5), (0.0, 0.5)), (1.0, 1.0)),
     (((0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)), (2.5, 0.0, 0.3, 0.0)),
     (((0.0, 0.0), (2.0, 0.0), (2.2, 1.0), (0.0, 1.0)), (-0.0625, 0.125, -0.3, -0.0625))],
)  # fmt: skip
def test_a_table_contains_what_its_arcs_enclose(outline: Any, bulge: Any) -> None:
    """A string of many corners tells the same, also level with corners and on chords."""
    table, rnd = Table(outline, bulge), random.Random(0)
    strung, (x0, y0, x1, y1) = Table(table.polyline), table.bounds
    for _ in range(2000):
        x, y = rnd.uniform(x0 - 0.1, x1 + 0.1), rnd.uniform(y0 - 0.1, y1 + 0.1)
        x = rnd.choice((x, x, x, *(corner[0] for corner in outline)))
        y = rnd.choice((y, y, y, *(corner[1] for corner in outline)))
        if all(edge.distance(x, y) > 1e-4 for edge in table.edges):
            assert table.contains(x, y) == strung.contains(x, y)


def test_a_table_ends_at_its_arcs() -> None:
    """A string of corners would leave a sliver of 2e-5 m out."""
    assert load("stadium").table == STADIUM
    for turn in (0.1, 1.0, 2.0, 3.0):
        x, y = math.sin(turn), -math.cos(turn)
        assert STADIUM.contains(1.5 + (0.5 - 1e-12) * x, 0.5 + (0.5 - 1e-12) * y)
        assert not STADIUM.contains(1.5 + (0.5 + 1e-12) * x, 0.5 + (0.5 + 1e-12) * y)


# -- without losses --------------------------------------------------------------------------------


@pytest.mark.parametrize("table", [Table.stadium(4.2, 2.2), Table.circle(1.1), LENS])
def test_a_front_of_paths_widens_as_sinai_has_it(table: Table) -> None:
    """Its curvature B becomes B / (1 + t B) on a free path, and changes by 2 k / cos at a side.

    It widens by 1 + t B on the path (Chernov and Markarian, Chaotic Billiards, 2006, 3.8).
    """
    (x, y), velocity, bend, width = (1.3, 1.0), (0.8, 0.6), 0.3, 1.0
    scene = Scene(
        balls=(Ball("C", (x, y), 0.1, 0.2, velocity=velocity),),
        table=table,
        restitution=Restitution(cushion=1.0),
        physics=Physics(max_time=60.0),
    )
    run = simulate(scene, solver="event-driven")
    rows = run.knots[0].tolist()
    for k, (before, after) in enumerate(pairwise(rows)):
        stretched = 1.0 + (after[0] - before[0]) * bend
        width, bend = width * stretched, bend / stretched
        if k < len(run.events):
            number, (x, y, vx, vy) = run.events[k].cushion, after[1:5]
            assert number is not None
            edge = table.edges[number]
            nx, ny = edge.at(edge.share(x, y))[1]
            around = math.copysign(edge.arc_radius, -edge.bulge) + 0.1  # of the centre's boundary
            bend += 2.0 / (around * (vx * nx + vy * ny))
    found = run.derivatives()
    start = np.array((-velocity[1], velocity[0], -0.3 * velocity[1], 0.3 * velocity[0]))
    vx, vy = run.end.velocity[0]
    assert len(run.events) > 20
    assert abs((-vy, vx) @ found.final[0] @ start) == pytest.approx(abs(width), rel=1e-9)


# -- crokinole -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shot", "taken", "met"), [(1, {"S"}, []), (2, {"S"}, []), (3, set(), [8, 0]), (4, set(), [0])]
)
def test_shots_of_crokinole_do_what_their_names_say(
    shot: int, taken: set[str], met: list[int]
) -> None:
    """Cushion 8 is a post; a disc whose centre comes to the edge, 13 in off, stops there."""
    scene, inch = load("crokinole"), 0.0254
    run = simulate(scene, shot, solver="event-driven")
    assert set(run.pocketed) == taken
    assert [event.cushion for event in run.events if event.kind == "ball-cushion"] == met
    middle = scene.pockets[0].position
    far = [math.dist(end, middle) / inch for end in run.final.values()]
    assert sum(distance == pytest.approx(13.0, abs=1e-6) for distance in far) == (shot > 2)
