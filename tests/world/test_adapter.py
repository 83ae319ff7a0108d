"""The pymunk adapter finds contacts at their true time, has friction, and fits any pymunk world."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from functools import partial

import pymunk
import pytest

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, Table, load, simulate
from pool_pymunk.solvers import Settings, pymunk_space
from pool_pymunk.world import Billiards, TableBall, same_balls
from tests.shared.scenes import gas, lines_run, some_slow
from tests.shared.worlds import ball as ball_at
from tests.shared.worlds import hexagon


@pytest.mark.parametrize(
    "solver", ["pymunk", pytest.param("pymunk-discrete", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("share", [0.04, 0.6])
def test_work_grows_little_faster_than_the_balls_that_move(share: float, solver: str) -> None:
    """All of them set off in one step, and many meet in each of the others."""
    few, many = (
        lines_run(partial(simulate, gas(count, share, 0.05), solver=solver, dt=1 / 60))
        for count in (60, 240)
    )
    assert many < few * 4**1.2


@pytest.mark.parametrize("seed", some_slow(40, quick=6))
def test_fast_random_shots_stay_on_the_table(seed: int) -> None:
    rnd = random.Random(seed)
    scene = load("report-corrected")
    angle, speed = rnd.uniform(0, 2 * math.pi), 10 ** rnd.uniform(0.5, 3)
    shot = replace(scene.shots[0], velocity=(speed * math.cos(angle), speed * math.sin(angle)))
    scene = replace(scene, shots=(shot,))
    run = simulate(scene, solver="pymunk", dt=1 / 60)
    assert run.status == "settled"
    assert scene.table is not None
    x0, y0, x1, y1 = scene.table.bounds
    r = scene.balls[0].radius * (1 - 1e-9)
    for x, y in run.final.values():
        assert x0 + r <= x <= x1 - r
        assert y0 + r <= y <= y1 - r


# -- friction --------------------------------------------------------------------------------------


def test_bodies_follow_their_paths_step_by_step() -> None:
    """The bodies themselves are where Eq. 10 puts them, not only the paths kept of them."""
    space = pymunk.Space()
    table = Billiards(
        space, 1 / 60, pair=same_balls(1, 0, 0.2), deceleration=0.5
    )  # fmt: skip
    body = pymunk.Body(0.2, math.inf)
    ball = table.add_ball(pymunk.Circle(body, 0.05))
    table.strike(ball, (1.0, 0.0))
    for k in range(1, 115):
        table.step()
        t = k / 60
        assert body.position.x == pytest.approx(t - 0.25 * t * t, abs=1e-13)
    while table.moving:
        table.step()
    assert body.position.x == 1.0
    assert tuple(body.velocity) == (0.0, 0.0)
    assert not space.constraints
    assert body.velocity_func == pymunk.Body.update_velocity


# -- warnings ------------------------------------------------------------------------------------


def test_zero_slip_of_the_published_law_is_reported() -> None:
    for solver in ("pymunk", "pymunk-discrete", "event-driven"):
        warnings = simulate(load("report"), "Simulation 4", solver=solver).warnings
        assert len(warnings) == 1
        assert "only a rounding error" in warnings[0]
        assert not simulate(load("report-corrected"), "Simulation 4", solver=solver).warnings


# -- what a scene leaves out is not installed ------------------------------------------------------


def test_a_part_that_is_left_out_costs_nothing() -> None:
    """Cushions are installed only where the scene asks for them, and friction installs nothing."""
    bare = Scene(
        balls=(Ball("1", (0.5, 0.5), 0.05, 0.2, velocity=(1.0, 0.0)),), physics=Physics(max_time=1)
    )
    whole = replace(
        bare,
        table=Table.rectangle(1.0, 1.0),
        restitution=Restitution(cushion=0.9),
        friction=Friction(surface=0.1),
    )

    def installed(scene: Scene) -> tuple[int, int, int, bool]:
        world = pymunk_space.set_up(scene, scene.start(None), Settings(0.01))
        (ball,), space = world.balls, world.space
        is_bare = ball.body.velocity_func == pymunk.Body.update_velocity
        return len(world.walls), len(space.shapes), len(space.constraints), is_bare

    assert installed(bare) == (0, 1, 0, True)
    assert installed(whole) == (4, 5, 0, True)
    happened = [simulate(scene, solver="pymunk", dt=0.01).events for scene in (bare, whole)]
    assert [[event.kind for event in events] for events in happened] == [
        [], ["ball-cushion", "stop"],
    ]  # fmt: skip


# -- any pymunk world ------------------------------------------------------------------------------


def _ball(table: Billiards, position: tuple[float, float]) -> TableBall:
    return ball_at(table, *position)


def test_debug_draw_of_a_world() -> None:
    space, table = hexagon(0.01)
    table.add_wall(pymunk.Circle(space.static_body, 0.1, (0.3, 0.1)), 0.9, 0.1)
    _ball(table, (0.0, 0.0))
    drawn: list[str] = []

    class Options(pymunk.SpaceDebugDrawOptions):
        def draw_circle(self, *_: object) -> None:
            drawn.append("circle")

        def draw_fat_segment(self, *_: object) -> None:
            drawn.append("segment")

    space.debug_draw(Options())
    assert drawn.count("segment") == 6
    assert drawn.count("circle") >= 2


# -- pockets ---------------------------------------------------------------------------------------


def test_a_pocket_takes_body_and_shapes_out_of_a_world_of_ones_own() -> None:
    space, dt = pymunk.Space(), 1 / 60
    pair = same_balls(0.9, 0.05)
    table = Billiards(space, dt, pair=pair, deceleration=0.5)
    first, second = (_ball(table, (x, 0.0)) for x in (-0.5, -0.8))
    number = table.add_pocket((0.0, 0.0), 0.05)
    taken: list[tuple[TableBall, int]] = []
    table.on_pocket = lambda ball, pocket, _t: taken.append((ball, pocket))
    for ball in (first, second):
        table.strike(ball, (1.0, 0.0))
    bodies = len(space.bodies)
    for _ in range(180):
        space.step(dt)
    assert taken == [(first, number), (second, number)]
    assert len(space.bodies) == bodies - 2
    assert not [shape for shape in space.shapes if shape.body in (first.body, second.body)]
    assert not space.constraints
    assert tuple(first.body.position) == (0.0, 0.0)
    assert tuple(first.body.velocity) == (0.0, 0.0)
    assert table.moving == {}
    third = _ball(table, (-0.3, 0.0))
    table.strike(third, (1.0, 0.0))
    for _ in range(60):
        space.step(dt)
    assert [ball for ball, _ in taken] == [first, second, third]
