"""Round cushions: arcs of the outline, and posts."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from amplified import amplification
from reference import OUTLINES, Refused, random_round_scene, reference_run
from scenes import seeds, share_of

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Post,
    Restitution,
    Run,
    Scene,
    SceneError,
    Shot,
    Table,
    load,
    loads,
    simulate,
    simulate_many,
)
from pool_pymunk.physics.path import Path, set_off
from pool_pymunk.physics.sides import Arc

EXACT = (("event-driven", None), ("pymunk", 1 / 60))
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


def play(scene: Scene, solver: str = "event-driven", dt: float | None = None) -> Run:
    return simulate(scene, solver=solver, dt=dt)


def around(run: Run) -> float:
    """Return by which angle (rad) the ball ends beyond the lowest point, from 0 to a whole turn."""
    x, y = run.final["C"]
    return (math.atan2(y - R, x - R) + math.pi / 2) % math.tau


# -- arcs ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("solver", "dt"), EXACT)
def test_a_ball_goes_around_a_circle_by_equal_angles(solver: str, dt: float | None) -> None:
    """A chord at the angle a to the tangent turns by 2 a, and is 2 R sin a long."""
    angle, hits, speed = 0.3, 50, 1.0
    time = (hits + 0.5) * 2 * INNER * math.sin(angle) / speed
    run = play(on_a_circle(speed, angle, max_time=time), solver, dt)
    assert sum(event.kind == "ball-cushion" for event in run.events) == hits
    middle = INNER * math.cos(angle)  # of a chord lies so far from the middle of the table
    turned = (2 * hits + 1) * angle - math.pi / 2
    at = R + middle * math.cos(turned), R + middle * math.sin(turned)
    assert math.dist(run.final["C"], at) < 1e-11


@pytest.mark.parametrize(("e", "rubs"), [(0.0, 0.0), (0.2, 0.2)])
@pytest.mark.parametrize(("solver", "dt"), EXACT)
def test_a_ball_runs_along_an_arc_as_the_equation_has_it(
    solver: str, dt: float | None, e: float, rubs: float
) -> None:
    """With s along the arc, d(v^2)/ds = -2 (mu_s g + mu v^2 / R) holds until the ball rests."""
    slows = 0.05
    run = play(on_a_circle(1.2, 0.0, e, rubs, slows), solver, dt)
    pull = slows * 9.80665
    if rubs:
        length = INNER / (2 * rubs) * math.log(1 + rubs * 1.2**2 / (pull * INNER))
    else:
        length = 1.2**2 / (2 * pull)
    off = abs(around(run) - (length / INNER) % math.tau) * INNER
    assert run.policies == {"persistent contact"}
    assert off < run.policy_shift < 5e-3
    assert off < 2e-5


@pytest.mark.heavy
@pytest.mark.parametrize("rubs", [0.0, 0.1])
@pytest.mark.parametrize(("solver", "dt"), EXACT)
def test_a_ball_rolls_along_an_arc_as_the_equation_has_it(
    solver: str, dt: float | None, rubs: float
) -> None:
    """While the cloth turns its roll, d(v^2)/ds = -2 (mu_r g + mu v^2 / R) holds.

    The push of the cushion is 7/5 v^2 / R, of which the cloth's static friction takes 2/5.
    """
    speed, pull = 0.4, 0.05 * 9.80665
    scene = on_a_circle(speed, 0.0, 0.2, rubs, 0.2)
    friction = replace(scene.friction, rolling=0.05)
    scene = replace(scene, balls=(replace(scene.balls[0], roll=1.0),), friction=friction)
    run = play(scene, solver, dt)
    length = speed**2 / (2 * pull)
    if rubs:
        length = INNER / (2 * rubs) * math.log(1 + rubs * speed**2 / (pull * INNER))
    off = abs(around(run) - length / INNER) * INNER
    assert "persistent contact" in run.policies
    assert off < run.policy_shift < 1e-3
    assert off < 1e-5
    assert [event.kind for event in run.events].count("roll") <= 2
    assert np.diff(run.energy_at(run.knots[0][:, 0])).max() <= 1e-15 * run.energy["initial"]


def test_a_ball_without_losses_runs_along_an_arc_for_ever() -> None:
    run = play(on_a_circle(1.0, 0.0, 0.5, max_time=2.0))
    assert math.hypot(*run.velocity[-1, 0]) == pytest.approx(1.0, abs=1e-4)
    assert abs(around(run) - (2.0 / INNER) % math.tau) * INNER < run.policy_shift


@pytest.mark.parametrize("far", [0.0, 1e-15, 1e-13, 1e-11, 1e-9])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(("solver", "dt"), EXACT)
def test_there_is_no_gap_between_a_face_and_an_arc(
    solver: str, dt: float | None, sign: float, far: float
) -> None:
    shot = Shot("down", "C", velocity=(0.0, -2.0))
    scene = Scene(
        balls=(Ball("C", (1.5 + sign * far, 0.5), r, 0.2, cue=True),),
        table=Table.stadium(2.0, 1.0),
        restitution=Restitution(cushion=0.9),
        friction=Friction(0.3),
        shots=(shot,),
    )
    run = simulate(scene, shot, solver=solver, dt=dt)
    assert [event.kind for event in run.events] == ["ball-cushion", "stop"]
    assert run.final["C"][1] > 0.1


@pytest.mark.parametrize("off", [-1e-12, 0.0, 1e-12])
def test_a_path_tangent_to_an_arc_that_bulges_inwards(off: float) -> None:
    """The nose of cushion 0 reaches 0.25 m into the table; so high a path just touches it."""
    table = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)), (-0.25, 0.0, 0.0, 0.0))
    ball = Ball("C", (0.2, 0.25 + r + off), r, 0.2, velocity=(3.0, 0.0))
    found = play(Scene((ball,), table, Restitution(cushion=0.9), Friction(0.1)))
    assert sum(event.cushion == 0 for event in found.events) == (off < 0.0)


def test_an_arc_waits_for_the_second_crossing() -> None:
    """A parabola comes into the circle beside the arc, and leaves it there; then it meets it."""
    arc = Arc((0.0, 0.0), 1.0, (0.0, -1.0), (0.0, 1.0), -1.0)
    path = Path(0.0, -3.0, 0.2, 2.0, 0.0, -0.1, 0.03, 5.0, False, 0.0, 0.0)
    t = arc.time_of_contact(path, 0.1, 0.0)
    assert math.hypot(*path.at(t)[0]) == pytest.approx(0.9, abs=1e-14)
    assert path.at(t)[0][0] > 0.0
    away = set_off(0.0, (-3.0, 0.2), (-1.0, 0.0), 0.1)
    assert arc.time_of_contact(away, 0.1, 0.0) == math.inf


def test_a_ball_behind_an_arc_meets_it_when_it_comes_back() -> None:
    arc = Arc((0.0, 0.0), 1.0, (0.0, -1.0), (0.0, 1.0), 1.0)
    assert arc.time_of_contact(set_off(0.0, (0.5, 0.0), (3.0, 0.0), 0.1), 0.1, 0.0) == math.inf
    path = Path(0.0, 0.5, 0.0, 3.0, 0.0, -2.0, 0.0, 10.0, False, 0.0, 0.0)
    t = arc.time_of_contact(path, 0.1, 0.0)
    assert t > 1.5
    assert path.at(t)[0][0] == pytest.approx(1.1, abs=1e-13)


# -- posts -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize(("solver", "dt"), EXACT)
def test_a_post_answers_as_a_cushion(solver: str, dt: float | None, radius: float) -> None:
    """A ball that meets a post half full leaves it by Eq. 9 along the line of centres."""
    touching, e, mu = radius + r, 0.8, 0.1
    ball = Ball("C", (0.0, touching / 2), r, 0.2, velocity=(2.0, 0.0))
    scene = Scene((ball,), restitution=Restitution(cushion=e), friction=Friction(0.2, mu))
    scene = replace(scene, posts=(Post((1.0, 0.0), radius),))
    run = play(scene, solver, dt)
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


def test_posts_count_after_the_cushions() -> None:
    scene = load("stadium")
    run = simulate(scene, 1, solver="event-driven")
    assert 4 in {event.cushion for event in run.events}


# -- forty digits ----------------------------------------------------------------------------------


def fresh(count: int) -> Iterator[Scene]:
    """Yield random scenes with arcs and posts that are not decided by a policy."""
    played, k = 0, seeds(1)[0] * 10_000
    while played < count:
        k += 1
        rng = random.Random(f"round {k}")
        law, table = rng.choice(["coulomb", "published"]), rng.choice(sorted(OUTLINES))
        scene = random_round_scene(law, table, rng)
        if not play(scene).policies:
            played += 1
            yield scene


def agrees(scene: Scene) -> None:
    try:
        answer = reference_run(scene)
    except Refused:
        return
    for solver, dt in EXACT:
        run = play(scene, solver, dt)
        ends, _ = amplification(scene, run)
        assert len(run.events) == len(answer.events)
        for ball, (x, y) in zip(scene.balls, answer.final, strict=True):
            assert math.dist(run.final[ball.id], (float(x), float(y))) < 1e-12 * ends


@pytest.mark.seeded
def test_random_round_scenes_in_forty_digits() -> None:
    for scene in fresh(8):
        agrees(scene)


@pytest.mark.slow
def test_hundred_and_fifty_round_scenes_in_forty_digits() -> None:
    for scene in fresh(share_of(150)):
        agrees(scene)


# -- everywhere ------------------------------------------------------------------------------------


def test_slices_come_to_the_exact_ends_with_order_one() -> None:
    scene = load("stadium")
    end = np.array(simulate(scene, 1, solver="event-driven").end.position)
    off = []
    for dt in (1e-3, 1e-4):
        run = simulate(scene, 1, solver="time-slice", dt=dt)
        off.append(float(np.abs(np.array(run.end.position) - end).max()))
    assert off[1] < off[0] / 4


def test_many_shots_have_the_same_bits() -> None:
    scene = load("stadium")
    velocity = np.zeros((20, 2, 2))
    angles = np.linspace(0.0, 2 * math.pi, 20)
    velocity[:, 0] = 3.0 * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    batch = simulate_many(scene, None, velocity)
    for k in range(0, 20, 5):
        assert batch.final[k].tolist() == [list(p) for p in batch.run(k).end.position]


def test_a_round_scene_survives_its_file() -> None:
    scene = load("stadium")
    assert loads(scene.to_toml()) == scene
    assert scene.table == Table.stadium(2.0, 1.0)


@pytest.mark.parametrize(
    ("parts", "named"),
    [
        ({"posts": (Post((3.0, 0.5), 0.1),)}, ("posts[0].position", "off the table")),
        ({"posts": (Post((1.0, 0.05), 0.1),)}, ("posts[0].position", "cushion 0 by 0.05 m")),
        ({"posts": (Post((0.3, 0.4), 0.1),)}, ("balls[0].position", "overlaps post 0")),
        ({"restitution": Restitution(ball_ball=0.9)}, ("restitution.cushion", "is missing")),
    ],
)
def test_what_cannot_be_is_said_in_one_line(parts: dict[str, Any], named: tuple[str, str]) -> None:
    with pytest.raises(SceneError) as said:
        replace(load("stadium"), **parts)
    [line] = str(said.value).splitlines()
    assert all(part in line for part in named)


def test_outlines_that_cannot_be() -> None:
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    for outline, bulge, said in (
        (square, (0.0, -1.5, 0.0, 0.0), "crosses itself"),
        (square, (0.0, 1.0), "must have 4 numbers"),
        (square, (0.0, 1e-9, 0.0, 0.0), r"bulge\[1\] = 1e-09: must be 0, or between"),
        (square, (0.0, 0.0, -1e200, 0.0), r"bulge\[2\] = -1e\+200: must be 0, or between"),
        (square[:2], (1.0, -1.0), "three corners or more"),
        (square[::-1], (0.0, 0.1, 0.0, 0.1), "counter-clockwise"),
    ):
        with pytest.raises(SceneError, match=said):
            Table(outline, bulge)
    with pytest.raises(SceneError, match=r"table\.bulge\[1\] = 1\.0: cushion 1 is no wider"):
        large = Ball("C", (0.5, 0.5), 0.5, 0.2)
        replace(load("stadium"), balls=(large,), posts=(), shots=())
    with pytest.raises(SceneError, match="greater than the width"):
        Table.stadium(1.0, 1.0)


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
