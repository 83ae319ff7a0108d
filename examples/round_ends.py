"""Round ends
==========

This is a table with round ends, with round posts and a lens in its middle.

Walls of :class:`pool_pymunk.Billiards` are static segments, circles and polygons, which balls meet
from outside. A round end is met from inside, so it consists of many short segments, whose corners
lie on the circle. A hit then has the normal of a chord, which is up to 90/n degrees off for n
segments: the ends of a gentle shot converge with 1/n. Every hit of something round multiplies the
error, however, so a hard shot needs more segments than anybody has.

What it converges to is a side of one's own in place of the segments, which answers exactly when a
ball meets a circle from inside (CONTRIBUTING.md, "a side").

Run it with ``python examples/round_ends.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pymunk
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from pool_pymunk import Billiards, same_balls
from pool_pymunk.physics.path import Path as Motion
from pool_pymunk.physics.path import arrival

Array = NDArray[np.float64]
Point = tuple[float, float]

RADIUS, MASS, DECELERATION = 0.028575, 0.17, 0.1
HALF, ROUND = 0.6, 0.5  # m; half the length of the straight rails, and the radius of the ends
RESTITUTION, FRICTION = 0.75, 0.14
POSTS, POST = ((-HALF, 0.0), (HALF, 0.0)), 0.05
LENS = [(x / 50, side * (0.07 - x * x / 1430)) for side in (1, -1) for x in range(-10, 11)]
STARTS = ((-0.3, 0.25), (0.35, 0.2), (0.35, -0.25), (0.9, 0.1), (-0.9, -0.2))
STEP, FRAME = 1 / 60, 1 / 240  # s; the longest step, and that of the film
SEGMENTS = (16, 64, 256, 1024)
GENTLE, HARD = 0.8, 2.4  # m/s
SHOTS = 12  # all around
FILMED = (1.81, -0.845)  # m/s


class Inside(NamedTuple):
    """This side is the half of a circle that lies ``toward`` the right (1) or left (-1)."""

    center: Point
    radius: float
    toward: float

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from a ball in this half, and infinity elsewhere."""
        dx, dy = x - self.center[0], y - self.center[1]
        here = dx * self.toward >= 0.0
        return self.radius - r - math.sqrt(dx * dx + dy * dy) if here else math.inf

    def normal(self, x: float, y: float) -> Point:
        """Return the unit vector from the circle to a ball."""
        dx, dy = self.center[0] - x, self.center[1] - y
        distance = math.sqrt(dx * dx + dy * dy)
        return dx / distance, dy / distance

    def curvature(self, x: float, y: float) -> float:
        """Return how fast (1/m) the normal turns: against the motion of a ball that goes round."""
        return -1.0 / math.hypot(x - self.center[0], y - self.center[1])

    def time_of_contact(self, path: Motion, r: float, now: float) -> float:
        """Return the time (s), not before now, at which a ball comes to the circle from inside."""
        dx, dy = self.center[0] - path.x, self.center[1] - path.y
        along, across = dx * path.ux + dy * path.uy, dx * path.uy - dy * path.ux
        apart = self.radius - r
        if not path.moves or abs(across) >= apart:
            return math.inf
        length = max(along + math.sqrt((apart - across) * (apart + across)), 0.0)
        is_here = (path.ux * length - dx) * self.toward >= 0.0
        return arrival(path, length, now) if is_here else math.inf


def add_end(table: Billiards, toward: float, segments: int | None) -> None:
    """Add a round end of this many segments, or of none, exactly."""
    ground, center = table.space.static_body, (toward * HALF, 0.0)
    if segments is None:
        whole = pymunk.Circle(ground, ROUND, center)
        whole.sensor = True  # Others are not to meet it from outside.
        table.add_wall(whole, RESTITUTION, FRICTION, sides=(Inside(center, ROUND, toward),))
        return
    angles = [math.pi * (k / segments - 0.5) for k in range(segments + 1)]
    corners = [(toward * (HALF + ROUND * math.cos(a)), ROUND * math.sin(a)) for a in angles]
    for a, b in pairwise(corners):
        table.add_wall(pymunk.Segment(ground, a, b, 0.0), RESTITUTION, FRICTION)


def set_up(segments: int | None) -> Billiards:
    """Return the table with balls on it, whose ends have this many segments."""
    space = pymunk.Space()
    pair = same_balls(0.95, 0.05)
    table = Billiards(space, max_dt=STEP, pair=pair, deceleration=DECELERATION)
    for side in (1.0, -1.0):
        rail = pymunk.Segment(space.static_body, (-HALF, side * ROUND), (HALF, side * ROUND), 0.0)
        table.add_wall(rail, RESTITUTION, FRICTION)
        add_end(table, side, segments)
    posts = [pymunk.Circle(space.static_body, POST, place) for place in POSTS]
    for bumper in (*posts, pymunk.Poly(space.static_body, LENS)):
        table.add_wall(bumper, 0.9, 0.1)
    for place in STARTS:
        body = pymunk.Body(MASS, 1e-4)
        body.position = place
        table.add_ball(pymunk.Circle(body, RADIUS))
    return table


def play(table: Billiards, velocity: Point, step: float = STEP) -> Array:
    """Shoot, and return where the balls are at each frame (frames, balls, 2) until all rest."""
    table.strike(table.balls[0], velocity)
    frames = [[ball.body.position for ball in table.balls]]
    while table.moving:
        table.space.step(step)
        frames.append([ball.body.position for ball in table.balls])
    return np.array(frames)


def ends(segments: int | None, speed: float) -> Array:
    """Return the ends (shots, balls, 2) of shots all around, each from the same start."""
    table = set_up(segments)
    start = table.save_state()
    found = []
    for k in range(SHOTS):
        table.restore_state(start)
        angle = math.tau * (k + 0.2) / SHOTS
        found.append(play(table, (speed * math.cos(angle), speed * math.sin(angle)))[-1])
    return np.array(found)


def errors(speed: float) -> list[float]:
    """Return how far (m) the farthest ball ends off, on average, by the number of segments."""
    exact = ends(None, speed)
    off = [np.linalg.norm(ends(n, speed) - exact, axis=-1).max(axis=-1) for n in SEGMENTS]
    return [float(each.mean()) for each in off]


def draw(axes: Axes, frames: Array) -> None:
    """Draw the table and the tracks of the balls."""
    axes.set(aspect="equal", xlim=(-1.12, 1.12), ylim=(-0.52, 0.52))
    axes.axis("off")
    turns = np.linspace(-math.pi / 2, math.pi / 2, 100)
    right = np.stack([HALF + ROUND * np.cos(turns), ROUND * np.sin(turns)], axis=-1)
    axes.add_patch(Polygon(np.concatenate([right, -right]), fill=False, linewidth=1.5))
    axes.add_patch(Polygon(LENS, color="#8a9199"))
    for place in POSTS:
        axes.add_patch(Circle(place, POST, color="#8a9199"))
    for track in frames.swapaxes(0, 1):
        (line,) = axes.plot(*track.T, linewidth=1.0)
        axes.add_patch(Circle(track[0], RADIUS, fill=False, color=line.get_color()))
        axes.add_patch(Circle(track[-1], RADIUS, color=line.get_color()))


def main(argv: Sequence[str] | None = None) -> tuple[dict[float, list[float]], Array]:
    """Play, print how the ends converge, draw the picture, and return the errors and a film."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    out = parser.parse_args(argv).out
    found = {speed: errors(speed) for speed in (GENTLE, HARD)}
    frames = play(set_up(SEGMENTS[-1]), FILMED, FRAME)
    figure = Figure((14.0, 4.2), layout="constrained")
    picture, diagram = figure.subplots(1, 2, width_ratios=(2.6, 1.0))
    draw(picture, frames)
    for (speed, off), color in zip(found.items(), ("#009e73", "#22262a"), strict=True):
        print(f"shots of {speed} m/s")
        for n, error in zip(SEGMENTS, off, strict=True):
            print(f"{n:6} segments an end: the farthest ball ends {error:.2g} m off, on average")
        diagram.loglog(SEGMENTS, off, "o-", color=color, label=f"{speed} m/s")
    diagram.loglog(SEGMENTS, [1.7 / n for n in SEGMENTS], "--", color="#8a9199", label="1/n")
    diagram.set(xlabel="segments of an end", ylabel="farthest ball's end off (m)")
    diagram.legend()
    figure.savefig(out / "round_ends.png", dpi=120)
    return found, frames


if __name__ == "__main__":
    main()
