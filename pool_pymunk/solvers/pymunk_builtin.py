"""This solver is a baseline: stock pymunk, as its tutorials use it.

Balls spin, the built-in impulse solver answers contacts, with its default iterations, and a
PivotJoint to the static body brakes each ball. pymunk multiplies elasticity and friction of two
shapes. For a fair comparison the products are the scene's coefficients in every kind of hit; but a
coefficient of 0 for balls makes the product with cushions 0, too. So
each cushion is there twice, once for the cue ball and once for the others, and shape filters keep
the two apart. The slop is a thousandth of a radius; pymunk's default, 0.1 m, is above a radius.
"""

from __future__ import annotations

import math
from itertools import pairwise

import pymunk

from pool_pymunk.laws.contact import Impulse, split
from pool_pymunk.model import Point, Scene, State
from pool_pymunk.model.scene import ball_ball_restitution
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.record import Settings, Stepping

BALL, CUSHION = 1, 2
CUE, OTHER = 0b01, 0b10  # These are categories: each kind of ball has its own cushions.
# The balls are looked at this many times a second, because looking costs more than the steps.
LOOKS = 240
AT_REST = 1e-4  # radii a second; a slower ball is at rest: one does not see it move in a minute


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate with steps of ``settings.dt`` s and the built-in response."""
    return Builtin(scene, start, settings.dt).play(settings)


class Overlap:
    """An overlap adds up the momentum (N s) that pymunk gives two shapes while they touch."""

    def __init__(self, normal: Point, is_pair: bool) -> None:
        self.normal, self.is_pair = normal, is_pair
        self.total = (0.0, 0.0)  # on the second ball, or on the ball at a cushion

    def add(self, impulse: Point) -> None:
        self.total = self.total[0] + impulse[0], self.total[1] + impulse[1]

    def impulse(self) -> Impulse:
        """Return the impulse along the normal of the first step, and across it."""
        normal, tangential = split(self.total, self.normal)
        return Impulse(normal, tangential, -tangential if self.is_pair else None)


class Builtin(Stepping):
    """This is a stock pymunk space with a scene's balls and cushions."""

    moving: set[int]

    def __init__(self, scene: Scene, start: State, dt: float | None) -> None:
        super().__init__(scene, start, dt)
        self.space = pymunk.Space()
        self.space.collision_slop = 1e-3 * min(ball.radius for ball in scene.balls)
        self.bodies: dict[int, pymunk.Body] = {}  # of the balls on the table
        self.number: dict[pymunk.Shape, int] = {}
        self.overlaps: dict[tuple[pymunk.Shape, pymunk.Shape], Overlap] = {}
        for i in range(len(scene.balls)):
            self._add_ball(i, start)
        for id_ in start.off:
            self._take_out(scene.index[id_])
        for kind in (CUE, OTHER):
            self._add_cushions(kind)
        self.space.on_collision(BALL, BALL, post_solve=self._met)
        self.space.on_collision(BALL, CUSHION, post_solve=self._met)
        self.steps_a_look = max(1, round(1.0 / (LOOKS * self.dt)))
        self.moving = {i for i, v in enumerate(start.velocity) if v != (0.0, 0.0)}

    def _elasticity(self, cue: bool) -> float:
        """Return the elasticity of a ball; the product of two is the restitution of their hit."""
        both = ball_ball_restitution(self.scene.restitution, False)
        with_cue = ball_ball_restitution(self.scene.restitution, True)
        if both is None:
            return math.sqrt(with_cue or 1.0)
        return (with_cue or 0.0) / math.sqrt(both) if cue and both > 0.0 else math.sqrt(both)

    def _add_ball(self, i: int, start: State) -> None:
        ball = self.scene.balls[i]
        body = pymunk.Body(ball.mass, pymunk.moment_for_circle(ball.mass, 0.0, ball.radius))
        body.position, body.velocity = start.position[i], start.velocity[i]
        circle = pymunk.Circle(body, ball.radius)
        circle.collision_type = BALL
        circle.elasticity = self._elasticity(ball.cue)
        circle.friction = math.sqrt(self.scene.friction.ball_ball)
        circle.filter = pymunk.ShapeFilter(categories=CUE if ball.cue else OTHER)
        self.space.add(body, circle)
        self.bodies[i] = body
        self.number[circle] = i
        if self.scene.deceleration > 0.0:
            brake = pymunk.PivotJoint(self.space.static_body, body, (0.0, 0.0), (0.0, 0.0))
            brake.max_bias = 0.0
            brake.max_force = ball.mass * self.scene.deceleration
            self.space.add(brake)

    def _take_out(self, i: int) -> None:
        body = self.bodies.pop(i)
        self.space.remove(body, *body.shapes, *body.constraints)

    def _add_cushions(self, kind: int) -> None:
        """Add the cushions that one kind of ball meets; arcs are strings of segments."""
        scene, ground, shapes = self.scene, self.space.static_body, list[tuple[pymunk.Shape, int]]()
        for number, edge in enumerate(scene.table.edges if scene.table else ()):
            for a, b in pairwise([*edge.points(), edge.end]):
                shapes.append((pymunk.Segment(ground, a, b, 0.0), number))
        for number, post in enumerate(scene.posts, start=scene.first_post):
            shapes.append((pymunk.Circle(ground, post.radius, post.position), number))
        elasticity, friction = self._elasticity(kind == CUE), math.sqrt(scene.friction.ball_ball)
        for shape, number in shapes:
            wall = scene.cushions[number]
            shape.collision_type = CUSHION
            shape.elasticity = wall.restitution / elasticity if elasticity > 0.0 else 0.0
            shape.friction = wall.friction / friction if friction > 0.0 else 0.0
            shape.filter = pymunk.ShapeFilter(categories=0b100, mask=kind)
            self.space.add(shape)
            self.number[shape] = number

    def _met(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        a, b = arbiter.shapes
        i, j = self.number[a], self.number[b]
        is_pair, (nx, ny), (x, y) = b.collision_type == BALL, arbiter.normal, arbiter.total_impulse
        # pymunk's normal points from a to b, and its impulse is that on a.
        to = 1.0 if is_pair and i < j else -1.0
        if arbiter.is_first_contact:
            overlap = self.overlaps[a, b] = self.overlaps[b, a] = Overlap(
                (to * nx, to * ny), is_pair
            )
            if is_pair:
                self.trace.ball_ball(self.time, min(i, j), max(i, j), overlap.impulse)
            else:
                self.trace.ball_cushion(self.time, i, j, overlap.impulse)
        self.overlaps[a, b].add((-x, -y) if is_pair and i < j else (x, y))

    def advance(self, most: float) -> None:
        """Make one step of the space, and now and then note who moves and who has stopped."""
        self.trace.steps += 1
        self.space.step(self.dt)
        for i in sorted(self.moving) if self.scene.pockets else ():
            body = self.bodies[i]
            if self.pocketed(i, *body.position, *body.velocity) is not None:
                self._take_out(i)
                self.moving.discard(i)
        if self.trace.steps % self.steps_a_look == 0:
            self._look()

    def _look(self) -> None:
        for i, body in self.bodies.items():
            (x, y), (vx, vy) = body.position, body.velocity
            self.is_finite = self.is_finite and math.isfinite(x + y)
            moves = math.hypot(vx, vy) > AT_REST * self.scene.balls[i].radius
            if moves:
                self.trace.breakpoint(i, self.time, (x, y), (vx, vy))
            elif i in self.moving:
                self.trace.stop(i, self.time, (x, y))
            (self.moving.add if moves else self.moving.discard)(i)
