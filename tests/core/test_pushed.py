"""Walls that move push balls: contacts that persist, in closed forms, and walls without room."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import pytest

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.laws import Coulomb
from pool_pymunk.core.engine import Engine
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.path import Motion
from pool_pymunk.core.motion.surface import Rolling, Sliding, Surface
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.persistent.groups import persistence_of
from pool_pymunk.core.persistent.persistence import Persisted
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.moving import Body, MovingWall
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Wall

R, M, PULL, DRAG = 0.03, 0.2, 2.0, 0.1
STEPS = [1 / 30, 1 / 120]
Pose = tuple[Vector, float, Vector, float]  # place (m), angle, velocity (m/s), turns (rad/s)


class Jams(Recorder):
    def __init__(self) -> None:
        self.jams: list[tuple[int, float]] = []

    def jammed(self, ball: Ball, wall: Wall, t: float) -> None:
        self.jams.append((ball.number, t))


class Pushed:
    """The core plays steps in which one wall moves; balls have a place, a velocity and a roll."""

    def __init__(
        self, surface: Surface, balls: Sequence[tuple[Vector, Vector, Vector]], wall: MovingWall,
        walls: Sequence[Wall] = (), e: float = 0.0, mu: float = 0.0,
    ) -> None:  # fmt: skip
        table = Table([*walls, wall], surface, Patches([], []), e, e, mu)
        self.balls = [Ball(k, R, M, surface.path(0.0, *ball)) for k, ball in enumerate(balls)]
        self.heard, self.wall, self.steps = Jams(), wall, 0
        persistence = persistence_of(table, self.balls, 1e-7)
        self.engine = Engine(table, self.balls, Coulomb(), self.heard, persistence)
        self.engine.begin_run()

    def go(self, seconds: float, dt: float, pose: Callable[[float], Pose]) -> None:
        """Make steps in which the wall moves as its pose at their beginning says."""
        for _ in range(round(seconds / dt)):
            now, until = self.steps * dt, (self.steps + 1) * dt
            self.wall.body = Body(*pose(now), now, until)
            self.engine.begin_step(now)
            self.engine.advance(until)
            self.engine.now = until
            self.steps += 1

    def motion(self, ball: int = 0) -> Motion:
        return self.balls[ball].path.at(self.engine.now)

    def persisted(self) -> list[Persisted]:
        return self.engine.persistence.persisted(self.engine)


def going(
    velocity: Vector = (0.0, 0.0), turns: float = 0.0, x: float = 0.0
) -> Callable[[float], Pose]:
    """Return how a body moves evenly from (x, 0)."""
    vx, vy = velocity
    return lambda t: ((x + t * vx, t * vy), t * turns, velocity, turns)


def paddle(e: float = 0.0, mu: float = 0.0) -> MovingWall:
    """Return a wall across x that faces +x."""
    return MovingWall([Face((0.0, 5.0), (0.0, -1.0), (1.0, 0.0), 10.0)], e, mu, 0)


def arm(mu: float = 0.0) -> MovingWall:
    """Return a wall on which the centre of a ball lies on the axis."""
    return MovingWall([Face((0.0, -R), (1.0, 0.0), (0.0, 1.0), 5.0)], 0.0, mu, 0)


def cushion(x: float, e: float = 0.0, mu: float = 0.0) -> Wall:
    """Return a wall at x that faces -x."""
    return Wall([Face((x, -5.0), (0.0, 1.0), (-1.0, 0.0), 10.0)], e, mu, 1)


# -- closed forms ----------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", STEPS)
@pytest.mark.parametrize(("mu", "along"), [(0.5, 0.1), (0.2, 0.3)])
def test_a_paddle_that_drifts_across_takes_a_disc_along_by_friction(
    mu: float, along: float, dt: float
) -> None:
    """The disc sticks if the wall's direction lies in the cone of friction.

    Otherwise it slides along at mu times the wall's speed along the normal: T / N is mu then.
    """
    u = 0.4
    play = Pushed(Sliding(PULL), [((R, 0.0), (u, 0.0), (0.0, 0.0))], paddle(0.0, mu))
    play.go(4.0, dt, going((u, along)))
    x, _y, vx, vy = play.motion()
    assert (x, vx) == pytest.approx((R + 4.0 * u, u), abs=1e-12)
    assert vy == pytest.approx(min(along, mu * u), abs=1e-9)


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.5])
def test_a_paddle_pushes_a_ball_that_rolls(mu: float) -> None:
    """Its friction slows the roll: N / m = (7/5) drag / (1 - mu)."""
    play = Pushed(Rolling(PULL, DRAG), [((R, 0.0), (0.4, 0.0), (0.4, 0.0))], paddle(0.0, mu))
    play.go(1.0, 1 / 60, going((0.4, 0.0)))
    x, _y, vx, _vy = play.motion()
    assert (x, vx) == pytest.approx((R + 0.4, 0.4), abs=1e-12)
    [(*_, push, _across)] = play.persisted()
    assert push == pytest.approx(M * 1.4 * DRAG / (1.0 - mu), abs=1e-9)


@pytest.mark.parametrize("dt", STEPS)
def test_a_disc_on_an_arm_that_turns_flies_outwards(dt: float) -> None:
    """Without a surface's friction its distance is s cosh(w t), for s'' = w^2 s."""
    w, s, time = 2.0, 0.2, 0.5
    play = Pushed(Sliding(0.0), [((s, 0.0), (0.0, w * s), (0.0, 0.0))], arm())
    play.go(time, dt, going(turns=w))
    far = s * math.cosh(w * time)
    there = far * math.cos(w * time), far * math.sin(w * time)
    assert math.dist(play.motion()[:2], there) < 1e-9


def outwards(s: float, w: float, mu: float, time: float) -> float:
    """Return how far out a disc is on an arm that turns: by many steps of order four.

    s'' = w^2 s - pull s' / |v| - mu N/m, N/m = 2 w s' + pull w s / |v|, as long as the slip
    s' - w R of the place where it touches is positive, and with + mu N/m while it is negative.
    """

    def rates(s: float, v: float) -> Vector:
        speed = math.hypot(v, w * s)
        normal = 2.0 * w * v + PULL * w * s / speed
        return v, w * w * s - PULL * v / speed - math.copysign(mu * normal, v - w * R)

    v, h = 0.1 + w * R, time / 2000
    for _ in range(2000):
        a = rates(s, v)
        b = rates(s + h / 2 * a[0], v + h / 2 * a[1])
        c = rates(s + h / 2 * b[0], v + h / 2 * b[1])
        d = rates(s + h * c[0], v + h * c[1])
        s += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        v += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
    return s


@pytest.mark.parametrize("mu", [0.0, 0.15])
def test_a_disc_slides_along_an_arm_with_friction_and_on_a_surface(mu: float) -> None:
    w, s, time = 2.0, 0.2, 0.5
    start = (s, 0.0), (0.1 + w * R, w * s), (0.0, 0.0)
    play = Pushed(Sliding(PULL), [start], arm(mu))
    play.go(time, 1 / 60, going(turns=w))
    far = outwards(s, w, mu, time)
    there = far * math.cos(w * time), far * math.sin(w * time)
    assert math.dist(play.motion()[:2], there) < 1e-8


def test_a_disc_goes_round_the_end_of_a_thick_paddle() -> None:
    """Where a face ends, its rounded end goes on; pushed by it, the disc comes off at last."""
    sides: list[Side] = [
        Face((0.0, 1.0), (0.0, -1.0), (1.0, 0.0), 1.05, 0.02),
        RoundSide((0.0, -0.05), 0.02, (0.0, -1.0), (1.0, 0.0)),
    ]
    play = Pushed(
        Sliding(PULL), [((R + 0.02, 0.0), (0.4, 0.0), (0.0, 0.0))], MovingWall(sides, 0.0, 0.0, 0)
    )
    play.go(1.0, 1 / 60, going((0.4, 0.3)))
    x, y, _vx, _vy = play.motion()
    assert math.dist((x, y), (0.4, 0.25)) > R + 0.02 - 1e-9
    assert x < 0.4 + R + 0.02 - 1e-3  # It is not on the face any more.


# -- balls between a wall and a cushion ------------------------------------------------------------


@pytest.mark.parametrize("surface", [Sliding(PULL), Sliding(0.0), Rolling(PULL, DRAG)])
@pytest.mark.parametrize("e", [0.0, 0.9, 1.0])
@pytest.mark.parametrize("balls", [1, 3])
@pytest.mark.parametrize("speed", [0.5, 1e-4])
def test_a_wall_goes_through_a_ball_that_has_no_room(
    surface: Surface, e: float, balls: int, speed: float
) -> None:
    """Balls in line are pushed on, fast or very slowly, until there is no room; then one jams."""
    gap = speed / 500.0
    start = 1.0 - (2.0 * R + gap) * balls - 10.0 * gap
    row = [
        ((1.0 - R - gap - k * (2.0 * R + gap), 0.0), (0.0, 0.0), (0.0, 0.0)) for k in range(balls)
    ]
    play = Pushed(surface, row, paddle(e, 0.1), [cushion(1.0, e, 0.1)], e, 0.1)
    for k in range(12):
        play.go(1 / 60, 1 / 60, going((speed, 0.0), x=start))
        places = [1.0 + R, *(play.motion(i)[0] for i in range(balls))]
        assert min(a - b for a, b in pairwise(places)) > 2.0 * R - 1e-7
        wall = start + speed * (k + 1) / 60
        assert places[-1] > wall + R - 1e-6 or play.heard.jams
    assert play.heard.jams[0][0] == balls - 1
    x = start + 12 * speed / 60
    play.go(0.5, 1 / 60, lambda t: ((x - speed * (t - 0.2), 0.0), 0.0, (-speed, 0.0), 0.0))
    assert not play.engine.squeezes.jams


def test_a_row_that_is_pushed_to_a_cushion_buckles() -> None:
    """Balls out of line have room beside them: the wall pushes them there, and none is jammed."""
    row = [((1.0 - R - 1e-6 - k * 1.8 * R, R * (k % 2)), (0.0, 0.0), (0.0, 0.0)) for k in range(3)]
    start = 1.0 - 5.6 * R - 1e-5
    play = Pushed(Sliding(PULL), row, paddle(), [cushion(1.0)])
    play.go(0.5, 1 / 60, going((0.05, 0.0), x=start))
    assert not play.heard.jams
    assert max(abs(play.motion(k)[1]) for k in range(3)) > R / 2.0
