"""A run of balls that lie frozen together says how far tiny gaps would move its ends."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pytest

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, Table, simulate
from pool_pymunk.core.ball import Ball as CoreBall
from pool_pymunk.core.contact.laws import Coulomb
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.motion.surface import Sliding
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import hit_at
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table as CoreTable
from pool_pymunk.core.variant import NEARLY_CLOSED
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws import LAWS
from pool_pymunk.solvers.frozen import CLOSED, NARROW, TURN, WIDE, nudged, touching
from tests.shared.frozen import (
    DRAWS,
    FORMS,
    JUMP,
    Draw,
    count_verdicts,
    opened,
    random_frozen_scene,
    touches,
    truth,
    verdict,
)
from tests.shared.hard_scenes import exact
from tests.shared.scenes import seeds, share_of

R = 0.05


def two_on_a_cushion(friction: float = 0.0) -> Scene:
    """Return balls f and g that touch on a cushion, and a cue ball that hits f."""
    balls = (
        Ball("c", (0.9, 0.4), R, 0.17, velocity=(0.3, -1.5)),
        Ball("f", (1.0, R), R, 0.17),
        Ball("g", (1.0 + 2.0 * R, R), R, 0.17),
    )
    return Scene(
        balls, Table.rectangle(2.0, 1.0), Restitution(0.9, None, 0.75), Friction(0.1, 0.1, friction)
    )


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_two_balls_frozen_on_a_cushion_say_what_a_gap_does(friction: float) -> None:
    scene = two_on_a_cushion(friction)
    found = truth(scene, exact(scene))
    run = simulate(scene, solver="event-driven")
    assert found.jump > 0.01
    assert "one instant" in run.policies
    assert found.far <= run.policy_shift


@pytest.mark.parametrize("law", LAWS)
def test_what_is_said_does_not_depend_on_the_listing_order(law: str) -> None:
    scene = two_on_a_cushion(0.1)
    scene = replace(scene, physics=Physics(law=law))
    said = {
        round(exact(replace(scene, balls=balls)).policy_shift, 3)
        for balls in (scene.balls, scene.balls[::-1])
    }
    assert law == "published" or len(said) == 1
    assert min(said) > 0.01


def test_a_row_that_is_hit_end_on_has_no_order() -> None:
    """Newton's cradle: each contact closes because of the one before."""
    balls = [Ball("c", (0.3, 0.5), R, 0.17, velocity=(1.0, 0.0))]
    balls += [Ball(str(k), (0.6 + 2.0 * R * k, 0.5), R, 0.17) for k in range(4)]
    scene = Scene(tuple(balls), Table.rectangle(3.0, 1.0), Restitution(1.0, None, 0.7),
                  Friction(0.05))  # fmt: skip
    run = exact(scene)
    assert not run.warnings
    assert run.policy_shift == 0.0
    assert len(touches(scene)) == 3
    apart = exact(opened(scene, (1e-9, 2e-9, 1e-9)))
    assert max(map(math.dist, run.end.position, apart.end.position)) < JUMP


@pytest.mark.parametrize("at_cushion", [True, False])
@pytest.mark.parametrize("form", FORMS)
def test_random_frozen_balls(form: str, at_cushion: bool) -> None:
    for k in range(1):
        scene = random_frozen_scene(form, at_cushion, random.Random(f"{form} {at_cushion} {k}"))
        assert verdict(scene) not in ("missed", "false alarm"), k


@pytest.mark.slow
@pytest.mark.seeded
@pytest.mark.parametrize("draw", DRAWS)
@pytest.mark.parametrize("at_cushion", [True, False])
@pytest.mark.parametrize("form", FORMS)
def test_many_random_frozen_balls(form: str, at_cushion: bool, draw: Draw) -> None:
    """Balls that lie frozen are met at first, or in mid-run."""
    for seed in seeds(1):
        found = count_verdicts(form, at_cushion, share_of(8, 4), seed, draw)
        assert not found["missed"]
        assert not found["false alarm"]


# -- gaps that no order of the hits of one instant shows -------------------------------------------


def head_on() -> Scene:
    """Return a ball that hits another head-on, again and again between two cushions.

    Each hit makes a distance from their common line several times larger. A third ball touches the
    second one beside that line.
    """
    balls = (
        Ball("c", (0.885607605408818, 0.9295010722131879), 0.03, 0.2, velocity=(0.0, -2.0)),
        Ball("f", (0.825607605408818, 0.5719806895731351), 0.03, 0.1),
        Ball("g", (0.885607605408818, 0.5719806895731351), 0.03, 0.1),
    )
    return Scene(
        balls, Table.rectangle(2.0, 1.0), Restitution(0.95, None, 1.0), Friction(0.05, 0.2, 0.0)
    )


def test_gaps_that_the_run_amplifies_to_centimetres_are_said() -> None:
    scene = head_on()
    found = truth(scene, exact(scene))
    run = simulate(scene, solver="event-driven")
    assert found.far > 0.01
    assert run.policies == {"frozen balls"}
    assert found.far <= run.policy_shift
    assert any("touch at the start" in line for line in run.warnings)


def test_starts_with_gaps_overlap_nowhere() -> None:
    for form in FORMS:
        scene = random_frozen_scene(form, True, random.Random(form))
        start = scene.start(None)
        assert len(touching(scene, start)) == len(touches(scene))
        for number in range(24):
            other = scene.start(None, nudged(scene, start, number))  # It refuses overlaps.
            assert math.dist(other.position[0], start.position[0]) < 2.0 * NARROW, "it touches none"
            assert 0.0 < math.dist(other.velocity[0], start.velocity[0]) < 6.0 * TURN
            assert other.velocity[1:] == start.velocity[1:]
            far = max(map(math.dist, other.position, start.position))
            assert far < 10.0 * (max(WIDE) if number % 2 else NARROW)


def test_a_nudge_turns_a_roll_with_its_velocity() -> None:
    """Else a ball that rolls would slip."""
    rolls = Friction(0.2, rolling=0.01)
    ball = Ball("a", (0.5, 0.5), R, 0.17, velocity=(2.0, 1.0), roll=1.0)
    start = (scene := Scene((ball,), None, friction=rolls)).start(None)
    other = nudged(scene, start, 0)
    assert other.roll == other.velocity != start.velocity


@pytest.mark.slow
def test_balls_that_a_plastic_hit_has_left_together_have_an_unknown_order() -> None:
    """Gaps at the start do not open this contact; the truth is that of gaps just before the hit."""
    pair = (Ball("d", (0.5, R), R, 0.17, velocity=(0.6, 0.0)), Ball("f", (0.65, R), R, 0.17))
    friction = Friction(0.1, 0.0, 0.05)
    scene = Scene(pair, Table.rectangle(2.0, 1.0), Restitution(0.0, 0.9, 0.75), friction)
    aim = exact(scene).end.position[0][0] - 0.1
    cue = Ball("c", (aim, R + 0.5), R, 0.17, cue=True, velocity=(0.24, -1.2))
    scene = replace(scene, balls=(cue, *pair))
    run = exact(scene)
    first, second = run.events[0], next(event for event in run.events if "c" in event.balls)
    assert first.balls == ("d", "f")
    ((places,), (velocities,)) = run.at([second.t - 0.01])
    motions = zip(scene.balls, places.tolist(), velocities.tolist(), strict=True)
    later = [replace(ball, position=(*p,), velocity=(*v,)) for ball, p, v in motions]
    frozen = replace(scene, balls=tuple(later))
    found = truth(frozen, exact(frozen))
    assert len(touches(frozen)) == 3
    assert found.jump > 1e-3
    assert found.far <= run.policy_shift


# -- contacts that strong friction makes unstable --------------------------------------------------


def wedged(closing: float) -> Scene:
    """Return a ball that slides along a cushion, and one that touches it and closes so slowly.

    Friction is so strong that each hit makes the next one faster.
    """
    turn, (slide, slip) = 1.4986399535473245, (-0.4483347973012577, -0.014679451277816558)
    (nx, ny), along = (math.cos(turn), math.sin(turn)), slide * math.cos(turn) - closing
    velocity = (along * nx - slip * ny, along * ny + slip * nx)
    balls = (
        Ball("a", (1.0, R), R, 1.1111199978301411, velocity=(slide, 0.0)),
        Ball("b", (1.0 + 2 * R * nx, R + 2 * R * ny), R, 3.9592983472570595, velocity=velocity),
    )
    return Scene(
        balls, Table.rectangle(2.0, 1.0), Restitution(0.5, None, 0.5), Friction(0.1, 1.0, 10.0)
    )


def random_wedge(seed: int, closing: float) -> Scene:
    """Return such a scene with other numbers."""
    rng = random.Random(seed)
    turn, slide, slip = (rng.uniform(*of) for of in ((0.3, 2.8), (-1.0, 1.0), (-0.3, 0.3)))
    mass, other = (10.0 ** rng.uniform(-0.5, 0.7) for _ in "ab")
    e, mu, strong = rng.uniform(0.1, 0.9), rng.uniform(0.3, 1.0), 10.0 ** rng.uniform(-0.5, 1.0)
    (nx, ny), along = (math.cos(turn), math.sin(turn)), slide * math.cos(turn) - closing
    velocity = (along * nx - slip * ny, along * ny + slip * nx)
    balls = (
        Ball("a", (1.0, R), R, mass, velocity=(slide, 0.0)),
        Ball("b", (1.0 + 2 * R * nx, R + 2 * R * ny), R, other, velocity=velocity),
    )
    return Scene(
        balls, Table.rectangle(2.0, 1.0), Restitution(e, None, e), Friction(0.1, mu, strong)
    )


@pytest.mark.parametrize(
    "wedge", [wedged, *(partial(random_wedge, seed) for seed in (49, 99, 201, 274))]
)
def test_a_closing_speed_that_rounding_hides_is_said(wedge: Callable[[float], Scene]) -> None:
    """Friction makes it grow; velocities turned at random seldom close both contacts."""
    faster, hidden = (simulate(wedge(v), solver="event-driven") for v in (1e-11, 0.0))
    far = max(map(math.dist, faster.end.position, hidden.end.position))
    assert 1e-3 < far <= hidden.policy_shift


def test_a_scene_keeps_the_touching_balls_of_the_start_that_was_asked_for() -> None:
    balls = tuple(Ball(id_, (x, 0.5), R, 0.17) for id_, x in (("a", 0.5), ("b", 0.5 + 2.0 * R)))
    scene = Scene(balls, None, Restitution(1.0), Friction(0.05))
    frozen, velocity = scene.start(None), ((0.0, 0.0), (0.0, 0.0))
    apart = scene.state((((0.5, 0.5), (0.8, 0.5)), velocity))
    gone = frozen._replace(off=frozenset({"b"}))
    assert [len(touching(scene, start)) for start in (frozen, apart, gone, frozen)] == [1, 0, 0, 1]


@pytest.mark.parametrize(("x", "r"), [(0.0, 0.25), (1.5, 0.25), (2.0**20, 0.5)])
def test_what_touches_is_what_the_engine_lets_touch_in_a_moment(x: float, r: float) -> None:
    """A ball lies over a cushion, at a height that has no rounding."""
    widest = CLOSED * (x + 2.0 * r)
    for gap in (0.0, 0.99 * widest, 1.01 * widest):
        floor = Face((x - 1.0, -gap), (1.0, 0.0), (0.0, 1.0), 2.0)
        wall, ball = Wall([floor], 1.0, 0.0, 0), CoreBall(0, r, 1.0, standing(0.0, x, r))
        table = CoreTable([wall], Sliding(0.0), Patches([], []), 1.0, 1.0, 0.0)
        present, hit = Present(table, [ball], Coulomb(), Recorder()), hit_at(0.0, ball, None, wall)
        assert (gap <= widest) == present.is_closed(hit, NEARLY_CLOSED)
