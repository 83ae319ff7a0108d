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

    def seen(self, room: Box) -> Box:
        """Return the part of the plane (m) that lies in a room of the canvas (points)."""
        (x0, x1), (y0, y1) = (
            ((low - origin) / self.scale, (high - origin) / self.scale)
            for low, high, origin in ((room.x0, room.x1, self.x), (room.y0, room.y1, self.y))
        )
        return Box(x0, y0, x1, y1)


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


def contact_places(run: Run) -> list[tuple[float, Point, float]]:
    """Return the time (s), the place (m) and the size (m) of each contact, in their order.

    The size is the radius of the smaller ball, and at a cushion half the ball's radius.
    """
    contacts = [event for event in run.events if event.is_contact]
    positions = run.at([event.t for event in contacts])[0]
    found = []
    for event, places in zip(contacts, positions.tolist(), strict=True):
        balls = [run.scene.index[id_] for id_ in event.balls]
        (x, y), radius = places[balls[0]], run.scene.balls[balls[0]].radius
        if event.kind == "ball-ball":
            (x2, y2), other = places[balls[1]], run.scene.balls[balls[1]].radius
            share = radius / (radius + other)
            x, y, radius = x + share * (x2 - x), y + share * (y2 - y), min(radius, other)
        elif run.scene.table is not None and event.cushion is not None:
            edge = run.scene.table.edges[event.cushion]
            s = min(max(edge.along(x, y), 0.0), edge.length)
            x, y = edge.start[0] + s * edge.tangent[0], edge.start[1] + s * edge.tangent[1]
            radius /= 2.0
        found.append((event.t, (x, y), radius))
    return found
