"""Live tables have patches, too: sand and ice in the form of shapes."""

from __future__ import annotations

import math
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards, Patch, SettingError, State, simulate
from pool_pymunk.solvers.pymunk_space import cushion_shapes
from pool_pymunk.world import TableState
from tests.shared.patch_scenes import random_scene
from tests.shared.worlds import STEP, A, ball, fence, plane, steps

SAND, ICE = 2.0, 0.05  # m/s^2
GROUND = pymunk.Body(body_type=pymunk.Body.STATIC)  # A shape does not keep its body alive.
LOOSE = pymunk.Body(1.0, 1.0)


def square(x: float, size: float = 0.2, body: pymunk.Body | None = None) -> pymunk.Poly:
    """Return a square whose left side is at ``x`` (m), on both sides of the line y = 0."""
    corners = [(x, -size), (x + size, -size), (x + size, size), (x, size)]
    return pymunk.Poly(body or GROUND, corners)


def end_of(v: float, *stretches: tuple[float, float], last: float = A) -> float:
    """Return how far (m) a ball goes over stretches with a deceleration and a length each."""
    square, far = v * v, 0.0
    for a, length in stretches:
        if square < 2 * a * length:
            return far + square / (2 * a)
        square, far = square - 2 * a * length, far + length
    return far + square / (2 * last)


@pytest.mark.parametrize("pull", [SAND, ICE, 0.0])
def test_a_ball_crosses_a_patch(pull: float) -> None:
    space, table = plane()
    assert table.add_patch(square(0.5), pull) == 0
    moving, resting = ball(table, 0.0), ball(table, 0.0, 0.5)
    table.strike(moving, (1.2, 0.0))
    for _ in range(600):
        space.step(STEP)
    expected = end_of(1.2, (A, 0.5), (pull, 0.2))
    assert moving.body.position.x == pytest.approx(expected, abs=1e-11)
    assert resting.body.position == (0.0, 0.5)
    assert not table.moving


def test_a_patch_that_is_removed_slows_no_ball_any_more() -> None:
    space, table = plane()
    sand, ice = table.add_patch(square(0.5), SAND), table.add_patch(square(0.6), ICE)
    moving = ball(table, 0.0)
    table.strike(moving, (1.2, 0.0))
    table.remove_patch(sand)
    assert [*table.patches] == [ice]
    steps(space, 10.0)
    expected = end_of(1.2, (A, 0.6), (ICE, 0.2))
    assert moving.body.position.x == pytest.approx(expected, abs=1e-11)
    with pytest.raises(SettingError, match="patch = 0: there is no patch of this number"):
        table.remove_patch(sand)
    assert table.add_patch(square(0.5), SAND) == 2  # Numbers do not come again.


@pytest.mark.parametrize("seed", range(12))
def test_a_live_table_plays_as_the_exact_solver(seed: int) -> None:
    scene = random_scene(seed)
    rolls, g = scene.friction.rolling, scene.physics.gravity
    space = pymunk.Space()
    table = Billiards(
        space, STEP, pair=scene.pair, deceleration=scene.friction.surface * g,
        rolling=None if rolls is None else rolls * g,
    )  # fmt: skip
    for shape in cushion_shapes(scene, space):
        table.add_wall(shape, scene.restitution.cushion or 0.0, scene.friction.cushion)
    for patch in scene.patches:
        shape = (
            pymunk.Poly(space.static_body, patch.corners)
            if patch.center is None
            else pymunk.Circle(space.static_body, patch.radius or 0.0, patch.center)
        )
        if isinstance(shape, pymunk.Poly) and len(shape.get_vertices()) < len(patch.corners):
            pytest.skip("pymunk makes a polygon convex")
        assert patch.surface is not None
        table.add_patch(
            shape, patch.surface * g, None if patch.rolling is None else patch.rolling * g
        )
    for own in scene.balls:
        body = pymunk.Body(own.mass, math.inf)
        body.position = own.position
        table.strike(table.add_ball(pymunk.Circle(body, own.radius)), own.velocity, own.roll)
    other, state = table.to_scene()
    assert len(other.patches) == len(scene.patches)
    for _ in range(2000):
        space.step(STEP)
        if not table.moving:
            break
    run = simulate(scene, solver="event-driven")
    again = simulate(other, solver="event-driven", start=state)
    for k, place in enumerate(run.end.position):
        assert math.dist(table.balls[k].body.position, place) < 1e-9
        assert math.dist(again.end.position[k], place) < 1e-9


def test_a_ball_that_is_put_on_a_patch_slows_down_there() -> None:
    space, table = plane()
    table.add_patch(square(0.5, size=3.0), SAND)
    moving = ball(table, 0.0)
    table.place(moving, (1.0, 0.0))
    table.strike(moving, (1.0, 0.0))
    steps(space, 2.0)
    assert moving.body.position.x == pytest.approx(1.25, abs=1e-12)


def test_a_patch_that_comes_under_a_moving_ball_counts_from_then_on() -> None:
    space, table = plane()
    moving = ball(table, 0.0, velocity=(1.0, 0.0))
    steps(space, 0.5)
    x, v = moving.body.position.x, 1.0 - 0.5 * A
    table.add_patch(square(0.2, size=3.0), SAND)
    steps(space, 1.0)
    assert moving.body.position.x == pytest.approx(x + v * v / (2 * SAND), abs=1e-12)


def test_the_cloth_may_change_where_there_are_patches() -> None:
    space, table = plane()
    table.add_patch(square(0.2, size=0.2), SAND)
    table.deceleration = 0.1
    moving = ball(table, 0.0, velocity=(1.2, 0.0))
    steps(space, 10.0)
    expected = end_of(1.2, (0.1, 0.2), (SAND, 0.2), last=0.1)
    assert moving.body.position.x == pytest.approx(expected, abs=1e-11)


def test_one_may_look_ahead_when_the_patch_of_a_ball_that_has_left_is_gone() -> None:
    _, table = plane()
    gone, there = ball(table, 0.6), ball(table, 0.0, 0.5)
    sand = table.add_patch(square(0.5), SAND)
    table.remove_ball(gone)
    table.remove_patch(sand)
    assert table.predict(there, (1.0, 0.0)).way[0] == (0.0, 0.5)
    table.place(gone, (0.6, 0.0))
    assert gone.body.position == (0.6, 0.0)


def test_a_state_is_saved_and_restored_on_a_patch() -> None:
    space, table = plane()
    table.add_patch(square(0.2, size=0.3), SAND)
    moving = ball(table, 0.0, velocity=(1.5, 0.0))
    steps(space, 0.25)
    assert 0.2 < moving.body.position.x < 0.5
    saved = TableState.from_json(table.save_state().to_json())
    steps(space, 10.0)
    end = moving.body.position
    assert end.x == pytest.approx(end_of(1.5, (A, 0.2), (SAND, 0.3)), abs=1e-11)
    table.restore_state(saved)
    steps(space, 10.0)
    assert math.dist(moving.body.position, end) < 1e-12


def test_a_scene_of_the_table_has_its_patches() -> None:
    space, table = plane()
    body = space.static_body
    fence(table, [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)], 0.0, 0.8, 0.1)
    table.add_patch(pymunk.Poly(body, [(1.0, 0.2), (1.5, 0.2), (1.5, 0.8), (1.0, 0.8)]), SAND)
    table.add_patch(pymunk.Circle(body, 0.2, (0.5, 0.5)), ICE)
    ball(table, 0.2, 0.5, (1.0, 0.0))
    scene, state = table.to_scene()
    square_, circle = scene.patches
    assert set(square_.corners) == {(1.0, 0.2), (1.5, 0.2), (1.5, 0.8), (1.0, 0.8)}
    assert square_.surface == SAND and square_.rolling is None
    assert circle == Patch(center=(0.5, 0.5), radius=0.2, surface=ICE)
    assert table.patches[1] == ((), (0.5, 0.5), 0.2)
    assert isinstance(state, State)
    line = table.predict(table.balls[0], (1.0, 0.0))[4]
    run = simulate(scene, solver="event-driven", start=state)
    assert math.dist(line[-1], run.end.position[0]) < 1e-9


def test_turned_bodies_have_turned_patches() -> None:
    body = pymunk.Body(body_type=pymunk.Body.STATIC)
    body.position, body.angle = (1.0, 0.0), math.pi / 2
    _, table = plane()
    table.add_patch(square(0.5, body=body), SAND)
    corners = table.patches[0][0]
    assert sorted((round(x, 9), round(y, 9)) for x, y in corners) == [
        (0.8, 0.5), (0.8, 0.7), (1.2, 0.5), (1.2, 0.7),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("shape", "how", "text"),
    [
        (square(0.0), (-1.0,), "deceleration = -1.0: must be 0 or more"),
        (square(0.0), (math.nan,), "deceleration = nan: must be a finite number"),
        (square(0.0), (1.0, 0.1), "rolling = 0.1: balls do not roll on a table without rolling"),
        (pymunk.Segment(GROUND, (0, 0), (1, 0), 0.1), (1.0,),
         "shape = Segment: a patch must be a Poly or a Circle"),
        (square(0.0, body=LOOSE), (1.0,),
         "shape = Poly: a patch's body must be static, as patches lie still"),
        (pymunk.Poly(GROUND, [(0, 0), (1, 0), (1, 1)], radius=0.1), (1.0,),
         "shape = Poly: a patch has sharp corners, so its radius must be 0"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_patch_is_refused(shape: Any, how: Any, text: str) -> None:
    _, table = plane()
    with pytest.raises(SettingError) as refused:
        table.add_patch(shape, *how)
    assert str(refused.value) == text
    assert table.patches == {}


def test_rolling_may_not_be_above_sliding_in_a_patch() -> None:
    _, table = plane(rolling=0.1)
    for how in ((0.05,), (1.0, 1.5), (1.0, -0.1)):
        with pytest.raises(SettingError, match="rolling = "):
            table.add_patch(square(0.0), *how)
    table.add_patch(square(0.0), 0.2)
    with pytest.raises(SettingError, match=r"rolling = 0\.25"):
        table.rolling = 0.25
    assert table.rolling == 0.1
    assert len(table.patches) == 1
