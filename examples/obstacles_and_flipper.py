"""Obstacles and a flipper
=======================

Balls move around obstacles, with a flipper and a box that pymunk moves, all in one space.

The rails, a wedge and the posts are static shapes. As walls of :class:`pool_pymunk.Billiards` they
bounce balls off at the true time, whatever the step. The flipper is a kinematic body, and the box a
dynamic one. Billiards leaves both to pymunk: they meet balls, walls and each other at the end of a
step, by their elasticities, and therefore the steps are short. A ball that they hit is on a new
exact path from then on.

The flipper plays by itself: it swings when a ball comes near, and goes back.

Run it with ``python examples/obstacles_and_flipper.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pymunk
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from pool_pymunk import Billiards, same_balls
from pool_pymunk.world import ContactEvent, TableBall

Point = tuple[float, float]

LENGTH, WIDTH, RADIUS, MASS = 2.54, 1.27, 0.028575, 0.17  # m, m, m, kg
STEP, SECONDS = 1 / 240, 6.0  # s
STARTS = ((2.1, 0.3), (1.05, 0.35), (1.2, 0.62), (0.7, 1.05), (2.25, 1.0), (1.6, 0.95))
SHOT = (-3.0, -0.05)  # m/s
WEDGE = ((1.55, 0.4), (1.75, 0.5), (1.6, 0.65))
POSTS, POST = ((0.95, 0.85), (2.0, 0.75), (0.3, 0.95)), 0.06
PIVOT, BLADE, DOWN, UP, SWING = (0.42, 0.4), 0.32, -0.5, 0.6, 8.0  # m, m, rad, rad, rad/s
BOX, BOX_MASS, BOX_START = 0.16, 0.4, (1.95, 1.08)  # m, kg, m
GUEST = 1  # the collision type of the flipper and the box


class Blow(NamedTuple):
    """A blow tells when (s) which ball was hit by the flipper or box, and its speeds (m/s)."""

    t: float
    by: str
    ball: int
    before: float
    after: float


class World:
    """A world is a space with balls, walls, a flipper and a box, and what happened in it."""

    def __init__(self) -> None:
        self.space = pymunk.Space()
        self.space.collision_slop = 1e-4
        pair = same_balls(0.95, 0.05)
        self.table = Billiards(self.space, max_dt=STEP, pair=pair, deceleration=0.1)
        self._add_walls()
        self.balls = [self._add_ball(place) for place in STARTS]
        self.flipper, self.blade = self._add_flipper()
        self.box = self._add_box()
        self.tracks: list[list[Point]] = [[place] for place in STARTS]
        self.speeds: dict[pymunk.Shape, float] = {}  # m/s, before this step
        self.blows: list[Blow] = []
        self.contacts: list[ContactEvent] = []
        self.table.on_contact = self.contacts.append
        self.space.on_collision(GUEST, None, post_solve=self._hit)

    def _add_walls(self) -> None:
        ground = self.space.static_body
        corners = [(0.0, 0.0), (LENGTH, 0.0), (LENGTH, WIDTH), (0.0, WIDTH)]
        sides = zip(corners, corners[1:] + corners[:1], strict=True)
        rails = [pymunk.Segment(ground, a, b, 0.0) for a, b in sides]
        posts = [pymunk.Circle(ground, POST, place) for place in POSTS]
        for shape in (*rails, pymunk.Poly(ground, WEDGE), *posts):
            shape.elasticity = 0.8  # with the box
            self.table.add_wall(shape, restitution=0.75, friction=0.14)

    def _add_ball(self, place: Point) -> TableBall:
        body = pymunk.Body(MASS, pymunk.moment_for_circle(MASS, 0.0, RADIUS))
        body.position = place
        circle = pymunk.Circle(body, RADIUS)
        circle.elasticity = 0.9  # with the flipper and the box
        return self.table.add_ball(circle)

    def _add_flipper(self) -> tuple[pymunk.Body, pymunk.Segment]:
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position, body.angle = PIVOT, DOWN
        blade = pymunk.Segment(body, (0.0, 0.0), (BLADE, 0.0), 0.02)
        blade.elasticity, blade.collision_type = 0.9, GUEST
        self.space.add(body, blade)
        return body, blade

    def _add_box(self) -> pymunk.Body:
        body = pymunk.Body(BOX_MASS, pymunk.moment_for_box(BOX_MASS, (BOX, BOX)))
        body.position = BOX_START
        shape = pymunk.Poly.create_box(body, (BOX, BOX))
        shape.elasticity, shape.collision_type = 0.8, GUEST
        slide = pymunk.PivotJoint(self.space.static_body, body, (0.0, 0.0), (0.0, 0.0))
        turn = pymunk.GearJoint(self.space.static_body, body, 0.0, 1.0)
        slide.max_bias = turn.max_bias = 0.0  # Both are friction only.
        slide.max_force, turn.max_force = 0.5 * BOX_MASS, 0.02 * BOX_MASS
        self.space.add(body, shape, slide, turn)
        return body

    def _hit(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        """Note a blow, if what the flipper or the box met is a ball."""
        guest, other = arbiter.shapes
        for ball in self.balls:
            if ball.circle is other and arbiter.is_first_contact:
                by = "flipper" if guest is self.blade else "box"
                speeds = (self.speeds[other], ball.body.velocity.length)
                self.blows.append(Blow(self.table.time + STEP, by, ball.number, *speeds))

    def _steer(self) -> None:
        """Swing the flipper if a ball is near, and let it back if it is up."""
        gap = min(self.blade.point_query(ball.body.position).distance for ball in self.balls)
        if self.flipper.angle >= UP:
            self.flipper.angular_velocity = -SWING / 4
        elif self.flipper.angle <= DOWN:
            self.flipper.angular_velocity = SWING if gap < 2.0 * RADIUS else 0.0

    def play(self) -> None:
        """Shoot, and step until the time is over."""
        self.table.strike(self.balls[0], SHOT)
        for _ in range(round(SECONDS / STEP)):
            self._steer()
            self.speeds = {ball.circle: ball.body.velocity.length for ball in self.balls}
            self.space.step(STEP)
            for ball, track in zip(self.balls, self.tracks, strict=True):
                track.append((ball.body.position.x, ball.body.position.y))


def draw(axes: Axes, world: World) -> None:
    """Draw obstacles, the flipper at rest and swung, the box before and after, and the tracks."""
    axes.set(xlim=(0.0, LENGTH), ylim=(0.0, WIDTH), aspect="equal", xticks=[], yticks=[])
    axes.set_title("Balls: hollow at first, filled at last. Pale: the flipper up, the box at first")
    axes.add_patch(Polygon(WEDGE, color="#8a9199"))
    for place in POSTS:
        axes.add_patch(Circle(place, POST, color="#8a9199"))
    for angle, alpha in ((DOWN, 1.0), (UP, 0.3)):
        tip = pymunk.Vec2d(BLADE, 0.0).rotated(angle) + PIVOT
        ends = zip(PIVOT, tip, strict=True)
        axes.plot(*ends, color="#d55e00", alpha=alpha, linewidth=10, solid_capstyle="round")
    for place, angle, alpha in ((BOX_START, 0.0, 0.3), (world.box.position, world.box.angle, 1.0)):
        corners = [pymunk.Vec2d(x, y) * (BOX / 2) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        outline = [corner.rotated(angle) + place for corner in corners]
        axes.add_patch(Polygon(outline, color="#0072b2", alpha=alpha))
    for track in world.tracks:
        (line,) = axes.plot(*zip(*track, strict=True), linewidth=1.2)
        axes.add_patch(Circle(track[0], RADIUS, fill=False, color=line.get_color()))
        axes.add_patch(Circle(track[-1], RADIUS, color=line.get_color()))


def main(argv: Sequence[str] | None = None) -> World:
    """Play, print the blows, draw the picture, and return the world."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    out = parser.parse_args(argv).out
    world = World()
    world.play()
    for blow in world.blows:
        print(
            f"{blow.t:.3f} s: the {blow.by} hits ball {blow.ball}, {blow.before:.2f} m/s before "
            f"and {blow.after:.2f} m/s after"
        )
    moved = math.dist(world.box.position, BOX_START)
    print(f"{len(world.contacts)} contacts of balls and walls; the box was moved by {moved:.2f} m")
    figure = Figure((11.0, 5.7), layout="constrained")
    draw(figure.subplots(), world)
    figure.savefig(out / "obstacles_and_flipper.png", dpi=120)
    return world


if __name__ == "__main__":
    main()
