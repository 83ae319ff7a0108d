"""This module maps metres on the plane to points on the canvas, y upwards."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from pool_pymunk.model import Point, Scene
from pool_pymunk.results.run import Run

CUSHION = 0.035  # the width of the cushions and of the wooden rail, in the table's shorter side
RAIL = 0.075


class Box(NamedTuple):
    """A box is a rectangle, given by its lower left and its upper right corner."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def width(self) -> float:
        return self.x1 - self.x0

    @property
    def height(self) -> float:
        return self.y1 - self.y0

    def grown(self, by: float) -> Box:
        """Return the box with a margin all around it."""
        return Box(self.x0 - by, self.y0 - by, self.x1 + by, self.y1 + by)


class View(NamedTuple):
    """A view has a ``scale`` in points per metre, and the plane's origin on the canvas (points).

    ``letter`` is the size (points) of the smallest letters that are easy to read there.
    """

    scale: float
    x: float
    y: float
    letter: float

    def place(self, point: Point) -> Point:
        """Return where a point of the plane (m) lies on the canvas (points)."""
        return self.x + self.scale * point[0], self.y + self.scale * point[1]


def fit(extent: Box, room: Box, letter: float) -> View:
    """Return the view that shows ``extent`` (m) as large as ``room`` (points) allows, centred."""
    scale = min(room.width / extent.width, room.height / extent.height)
    return View(
        scale,
        (room.x0 + room.x1 - scale * (extent.x0 + extent.x1)) / 2,
        (room.y0 + room.y1 - scale * (extent.y0 + extent.y1)) / 2,
        letter,
    )


def extent(scene: Scene, runs: Sequence[Run] = ()) -> Box:
    """Return what there is to see (m): the table with its rails, or all paths with a margin."""
    if scene.table is not None:
        x0, y0, x1, y1 = scene.table.bounds
        short = min(x1 - x0, y1 - y0)
        return Box(x0, y0, x1, y1).grown((CUSHION + RAIL) * short)
    reach = max(ball.radius for ball in scene.balls)
    points = [ball.position for ball in scene.balls]
    points += [(knot[1], knot[2]) for run in runs for knots in run.knots for knot in knots.tolist()]
    points += [point for run in runs for point in run.end.position]
    for hole in scene.pockets:
        (x, y), r = hole.position, hole.radius
        points += [(x - r, y - r), (x + r, y + r)]
    xs, ys = zip(*(point for point in points if all(map(math.isfinite, point))), strict=True)
    return _widened(Box(min(xs), min(ys), max(xs), max(ys)).grown(2.5 * reach))


def _widened(box: Box, most: float = 2.4) -> Box:
    """Return the box made less long and thin: a side is at most ``most`` times the other."""
    dx = max(0.0, box.height / most - box.width) / 2
    dy = max(0.0, box.width / most - box.height) / 2
    return Box(box.x0 - dx, box.y0 - dy, box.x1 + dx, box.y1 + dy)
