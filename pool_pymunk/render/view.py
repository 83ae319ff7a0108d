"""This module says what is shown, and maps metres on the plane to points on the canvas."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from matplotlib.transforms import Bbox

from pool_pymunk.model import Point, Scene
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import differing
from pool_pymunk.model.plain import argument, made
from pool_pymunk.results.contacts import ContactRow
from pool_pymunk.results.run import Run
from pool_pymunk.results.words import step_text
from pool_pymunk.safety.files import RenderError

CUSHION, RAIL = 0.035, 0.075  # the widths of both, as shares of the table's shorter side
MOST_LONG = 2.4  # Without a table, one side of the picture is at most this many times the other.
MOST_WORDS = 3  # More differences of two scenes are only counted.
DOT = "  \N{MIDDLE DOT}  "


class View(NamedTuple):
    """A view has points per metre, the origin on the canvas, and the size of letters (points)."""

    scale: float
    x: float
    y: float
    letter: float

    def place(self, point: Point) -> Point:
        """Return where a point of the plane (m) lies on the canvas (points)."""
        return self.x + self.scale * point[0], self.y + self.scale * point[1]

    def places(self, points: Array) -> Array:
        """Return where points of the plane (N, 2), m, lie on the canvas (points)."""
        return self.scale * points + (self.x, self.y)


def fit(extent: Bbox, room: Bbox, letter: float) -> View:
    """Return the view that shows ``extent`` (m) as large as ``room`` (points) allows, centred."""
    scale = min(room.width / extent.width, room.height / extent.height)
    x = (room.x0 + room.x1 - scale * (extent.x0 + extent.x1)) / 2
    return View(scale, x, (room.y0 + room.y1 - scale * (extent.y0 + extent.y1)) / 2, letter)


def extent(scene: Scene, runs: Sequence[Run] = ()) -> Bbox:
    """Return what there is to see (m): the table with its rails, or all paths with a margin."""
    if scene.table is not None:
        box = Bbox.from_extents(*scene.table.bounds)
        return box.padded((CUSHION + RAIL) * min(box.size))
    points = [np.array([ball.position for ball in scene.balls])]
    for run in runs:
        points += [breakpoints[:, 1:3] for breakpoints in run.knots] + [np.array(run.end.position)]
    discs = [(hole.position, hole.radius) for hole in scene.pockets]
    discs += [(post.position, post.radius) for post in scene.posts]
    discs += [(corner, 0.0) for patch in scene.patches for corner in patch.corners]
    discs += [(p.center, p.radius) for p in scene.patches if p.center is not None and p.radius]
    points += [np.add.outer((-radius, radius), place) for place, radius in discs]
    every = np.concatenate(points)
    every = every[np.isfinite(every).all(axis=1)]
    box = Bbox([every.min(axis=0), every.max(axis=0)])
    box = box.padded(2.5 * max(ball.radius for ball in scene.balls))
    wide, high = box.size
    return box.padded(max(0.0, high / MOST_LONG - wide) / 2, max(0.0, wide / MOST_LONG - high) / 2)


def contact_places(run: Run) -> Iterator[tuple[ContactRow, Point, float]]:
    """Yield each contact that has a place, in their order, with its place and its size (m)."""
    for row in run.contacts:
        if row.point is not None:
            radius = min(run.scene.balls[run.scene.index[id_]].radius for id_ in row.balls)
            yield row, row.point, radius if row.cushion is None else radius / 2.0


@dataclass(frozen=True)
class Show:
    """A show is one run, or two to compare: one of them as a ghost, or side by side."""

    runs: tuple[Run, ...]
    side_by_side: bool = False

    def __post_init__(self) -> None:
        """Raise RenderError for runs that do not go together, SettingError if any is no Run."""
        argument("runs", self.runs, made(Run, in_row=True))
        if not 1 <= len(self.runs) <= 2:
            raise RenderError(f"runs = {len(self.runs)}: one can be shown, or two to compare")
        if len({tuple(ball.id for ball in run.scene.balls) for run in self.runs}) > 1:
            raise RenderError("runs of different balls cannot be compared")

    @property
    def panels(self) -> tuple[tuple[Run, ...], ...]:
        """Return the runs shown on each table; the first of them is solid, the other a ghost."""
        return tuple((run,) for run in self.runs) if self.side_by_side else (self.runs,)

    @cached_property
    def seen(self) -> Bbox:
        """Return the part of the plane (m) that shows all that happens."""
        return extent(self.runs[0].scene, self.runs)

    @cached_property
    def tray(self) -> tuple[str, ...]:
        """Return the balls that are off the table at the end, in the order in which they left."""
        return (*self.before, *self.runs[0].pocketed)

    @property
    def before(self) -> tuple[str, ...]:
        """Return the balls that were off the table before the shot."""
        run = self.runs[0]
        return tuple(b.id for b in run.scene.balls if b.id in run.off - run.pocketed.keys())

    @cached_property
    def movers(self) -> tuple[str, ...]:
        """Return the balls that move in any run."""
        balls = enumerate(self.runs[0].scene.balls)
        return tuple(b.id for i, b in balls if any(r.knots[i][:, 3:5].any() for r in self.runs))

    @property
    def duration(self) -> float:
        """Return the time at which the last ball of any run stops (s)."""
        return max(run.duration for run in self.runs)

    def caption(self, *more: str) -> str:
        """Return scenario, shot, solver and time step in one line."""
        run, names = self.runs[0], [] if self.side_by_side else headings(self.runs)
        title = run.scene.title if len({one.scene.title for one in self.runs}) == 1 else ""
        if len(names) > 1:
            names = [f"{names[0]} (ghost: {names[1]})"]
        return DOT.join(text for text in (title, run.name, *names, *more) if text)


def headings(runs: Sequence[Run]) -> list[str]:
    """Return what tells runs apart: numbers that differ in their scenes, or the solvers.

    >>> from dataclasses import replace
    >>> from pool_pymunk import load, simulate
    >>> soft = load("report")
    >>> hard = replace(soft, restitution=replace(soft.restitution, cushion=0.9))
    >>> headings([simulate(scene, 1) for scene in (soft, hard)])
    ['cushion restitution 0.7', 'cushion restitution 0.9']
    """
    plain, titles = settings(runs), [run.scene.title or "" for run in runs]
    if len(runs) < 2 or runs[0].scene == runs[1].scene:
        return plain
    first = runs[0].scene
    shot = first.shots.index(runs[0].shot) + 1 if runs[0].shot else 1
    words = differing(first, runs[1].scene, shot)
    if titles[0] != titles[1] and not 0 < len(words[0]) <= MOST_WORDS:
        words = ([titles[0]], [titles[1]])
    more = [f"and {len(words[0]) - MOST_WORDS} more"] if len(words[0]) > MOST_WORDS else []
    alike = plain[0] == plain[1] and words[0] != words[1]
    each = zip(words, plain, strict=True)
    return [", ".join((*its[:MOST_WORDS], *more, *[how] * (not alike))) for its, how in each]


def settings(runs: Sequence[Run]) -> list[str]:
    """Return each run's solver and step, and its law if laws differ: "pymunk, dt = 1/240 s"."""
    solvers = {run.solver for run in runs}
    differ = len({run.law for run in runs} - solvers) > 1
    found = []
    for run in runs:
        step = "" if run.dt is None else f"dt = {step_text(run.dt)}"
        law = f"{run.law} law" if differ and run.law != run.solver else ""
        found.append(", ".join(filter(None, (run.solver, step, law))))
    return found
