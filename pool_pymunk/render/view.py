"""This module says what is shown, and maps metres on the plane to points on the canvas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from pool_pymunk.model import Point, Scene
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import RenderError

CUSHION = 0.035  # the width of the cushions and of the wooden rail, in the table's shorter side
RAIL = 0.075
MOST_LONG = 2.4  # A side of what is seen of a plane is at most this many times the other.
DOT = "  \N{MIDDLE DOT}  "


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
        origin = (self.x, self.y, self.x, self.y)
        return Box(*((at - zero) / self.scale for at, zero in zip(room, origin, strict=True)))


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
    largest = max(ball.radius for ball in scene.balls)
    points = [ball.position for ball in scene.balls]
    for run in runs:
        points += [(row[1], row[2]) for breakpoints in run.knots for row in breakpoints.tolist()]
        points += run.end.position
    for hole in scene.pockets:
        (x, y), r = hole.position, hole.radius
        points += [(x - r, y - r), (x + r, y + r)]
    xs, ys = zip(*(point for point in points if all(map(math.isfinite, point))), strict=True)
    box = Box(min(xs), min(ys), max(xs), max(ys)).grown(2.5 * largest)
    dx = max(0.0, box.height / MOST_LONG - box.width) / 2
    dy = max(0.0, box.width / MOST_LONG - box.height) / 2
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


# -- runs that are shown together ---------------------------------------------------------------


@dataclass(frozen=True)
class Show:
    """A show is one run, or two of the same shot to compare.

    Two runs are on one table, one of them as a ghost, or side by side.
    """

    runs: tuple[Run, ...]
    side_by_side: bool = False

    def __post_init__(self) -> None:
        """Raise RenderError for runs that cannot be shown together."""
        if not 1 <= len(self.runs) <= 2:
            raise RenderError(f"runs = {len(self.runs)}: one can be shown, or two to compare")
        if len({tuple(ball.id for ball in run.scene.balls) for run in self.runs}) > 1:
            raise RenderError("runs of other balls cannot be compared")

    @property
    def panels(self) -> tuple[tuple[Run, ...], ...]:
        """Return the runs shown on each table; the first of them is solid, the other a ghost."""
        return tuple((run,) for run in self.runs) if self.side_by_side else (self.runs,)

    @cached_property
    def seen(self) -> Box:
        """Return the part of the plane (m) that shows all that happens."""
        return extent(self.runs[0].scene, self.runs)

    @cached_property
    def tray(self) -> tuple[str, ...]:
        """Return the balls that are beside the table at the end, in the order in which they left.

        Those that were off the table before the shot come first.
        """
        return (*self.before, *self.runs[0].pocketed)

    @property
    def before(self) -> tuple[str, ...]:
        """Return the balls that were off the table before the shot."""
        run = self.runs[0]
        gone = run.off - run.pocketed.keys()
        return tuple(ball.id for ball in run.scene.balls if ball.id in gone)

    @property
    def duration(self) -> float:
        """Return the time at which the last ball of any run stops (s)."""
        return max(run.duration for run in self.runs)

    def caption(self, *more: str) -> str:
        """Return scenario, shot, solver and time step in one line."""
        run, names = self.runs[0], settings(self.runs)
        if self.side_by_side:
            names = []
        elif len(names) > 1:
            names = [f"{names[0]} (ghost: {names[1]})"]
        return DOT.join(text for text in (run.scene.title, run.name, *names, *more) if text)


def settings(runs: Sequence[Run]) -> list[str]:
    """Return the setting of each run, with the contact law if they differ in it."""
    laws = {run.law for run in runs} - {run.solver for run in runs}
    return [setting(run, with_law=len(laws) > 1) for run in runs]


def setting(run: Run, with_law: bool = False) -> str:
    """Return solver and time step as "pymunk, dt = 1/240 s", with the law if it is asked for.

    A solver's own law goes without saying.
    """
    parts = [run.solver] if run.solver else []
    if run.dt is not None:
        parts.append(f"dt = {step(run.dt)} s")
    if with_law and run.law != run.solver:
        parts.append(f"{run.law} law")
    return ", ".join(parts)


def step(dt: float) -> str:
    """Return a time step as a number, or as a fraction if the number would be rounded.

    >>> step(0.0001), step(1 / 240), step(1e-6), step(0.0123)
    ('0.0001', '1/240', '1e-06', '0.0123')
    """
    number, per_second = f"{dt:g}", round(1.0 / dt)
    is_fraction = per_second > 0 and abs(per_second * dt - 1.0) < 1e-9
    return f"1/{per_second}" if is_fraction and float(number) != dt else number
