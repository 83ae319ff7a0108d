"""A side of one's own is played by all solvers that take sides, many times, and differentiated."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Restitution,
    Run,
    Scene,
    SettingError,
    Shot,
    Table,
    simulate,
    simulate_many,
)
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws.contact import Vector

CORNERS = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
SIZE = 6.0  # m; the radius of the round ends
DEEP = SIZE - math.sqrt(SIZE * SIZE - 0.25)  # m; so far they bulge out, by less than any ball


class Hollow(Side):
    """A round end of the table, which bulges outwards."""

    def __init__(self, x: float, outward: float) -> None:
        super().__init__()
        self.center = (x - outward * (SIZE - DEEP), 0.5)

    def gap(self, x: float, y: float, r: float) -> float:
        return SIZE - r - math.dist((x, y), self.center)

    def normal(self, x: float, y: float) -> Vector:
        far = math.dist((x, y), self.center)
        return (self.center[0] - x) / far, (self.center[1] - y) / far

    def curvature(self, x: float, y: float) -> float:
        return -1.0 / math.dist((x, y), self.center)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return the first root of the gap, found by small steps and halving."""
        if not path.moves:
            return math.inf
        end = min(path.end, path.t + 4.0 / path.speed)

        def closed(t: float) -> bool:
            x, y, vx, vy = path.at(t)
            nx, ny = self.normal(x, y)
            return self.gap(x, y, r) <= 0.0 and vx * nx + vy * ny < 0.0

        times = np.linspace(now, end, 400).tolist()
        late = next((t for t in times if closed(t)), math.inf)
        early = max((t for t in times if t < late), default=now)
        for _ in range(80 if late < math.inf else 0):
            middle = 0.5 * (early + late)
            early, late = (early, middle) if closed(middle) else (middle, late)
        return late


class Rounded(Table):
    """A table with two such ends."""

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        ends: dict[int, Side] = {1: Hollow(2.0, 1.0), 3: Hollow(0.0, -1.0)}
        plain = Table(CORNERS).walls
        return tuple(
            Wall([ends[k]] if k in ends else wall.sides, 0.0, 0.0, k)
            for k, wall in enumerate(plain)
        )


def table() -> Scene:
    """Return balls on the table; the cue ball meets an end, a long side and another ball."""
    return Scene(
        balls=(Ball("C", (0.5, 0.4), 0.03, 0.2, cue=True), Ball("1", (0.9, 0.7), 0.04, 0.3)),
        table=Rounded(CORNERS),
        restitution=Restitution(0.95, cushion=0.8),
        friction=Friction(surface=0.05, cushion=0.1, ball_ball=0.05),
        shots=(Shot("one", "C", velocity=(2.0, 0.9)),),
    )  # fmt: skip


def ends(run: Run) -> np.ndarray:
    return np.array([run.final[ball.id] for ball in run.scene.balls])


def test_solvers_play_a_side_of_ones_own() -> None:
    run = simulate(table(), solver="event-driven")
    met = {event.cushion for event in run.events}
    assert met & {1, 3} and met & {0, 2}
    position, _ = run.at(np.linspace(0.0, run.duration, 3000))
    for i, ball in enumerate(run.scene.balls):
        for side in (Hollow(2.0, 1.0), Hollow(0.0, -1.0)):
            assert min(side.gap(x, y, ball.radius) for x, y in position[:, i]) > -1e-9
    assert ends(simulate(table(), solver="pymunk")) == pytest.approx(ends(run), abs=1e-9)


def test_many_shots_play_it() -> None:
    scene = table()
    velocity = np.zeros((3, 2, 2))
    velocity[:, 0] = [(2.0, 0.9), (1.5, 0.2), (-1.0, 0.3)]
    batch = simulate_many(scene, velocity=velocity)
    assert (batch.final[0] == ends(simulate(scene, solver="event-driven"))).all()


def test_derivatives_know_how_its_normal_turns() -> None:
    scene, step = table(), 1e-7
    found = simulate(scene, solver="event-driven").derivatives(("vx.C", "vy.C")).final
    for column, axis in enumerate(np.eye(2)):
        shots = [
            Shot("one", "C", velocity=tuple((np.array((2.0, 0.9)) + sign * step * axis).tolist()))
            for sign in (-1.0, 1.0)
        ]
        low, high = (
            ends(simulate(replace(scene, shots=(shot,)), solver="event-driven")) for shot in shots
        )
        assert found[..., column] == pytest.approx((high - low) / (2 * step), rel=1e-4, abs=1e-4)


def test_pymunk_refuses_a_wall_that_no_edge_has() -> None:
    class More(Rounded):
        @cached_property
        def walls(self) -> tuple[Wall, ...]:
            return (*super().walls, Wall([Hollow(9.0, 1.0)], 0.0, 0.0, 4))

    with pytest.raises(SettingError, match="this scene has walls of its own"):
        simulate(replace(table(), table=More(CORNERS)), solver="pymunk")
