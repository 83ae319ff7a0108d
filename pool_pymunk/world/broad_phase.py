"""What pymunk's broad phase finds near a ball, as the contact engine wants to know it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import pymunk

from pool_pymunk.engine.contacts import ContactEngine, Key
from pool_pymunk.physics.contact import closing_speed
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at

EVERYTHING = pymunk.ShapeFilter()


class BroadPhase:
    """The pairs that touched during a step, and what a ball may meet in the rest of it.

    ``until`` (s) is the end of the present step. ``changed`` are the balls that have begun a new
    path in it: their bodies are no longer where their paths are.
    """

    def __init__(self, space: pymunk.Space, engine: ContactEngine) -> None:
        self.space = space
        self.engine = engine
        self.until = 0.0
        self.sensors: list[pymunk.Circle] = []
        self.numbers: dict[pymunk.Shape, int] = {}  # of a sensor's ball, or -1 - that of a wall
        self.pairs: dict[Key, None] = {}  # that touched during this step
        self.changed: dict[int, None] = {}
        self._foreseen: dict[Key, tuple[Path, Path | None]] = {}
        self._around: dict[int, list[int]] = {}

    def touched(self, a: pymunk.Shape, b: pymunk.Shape) -> None:
        """Two shapes came so near that their balls may have met during this step."""
        i, j = self.numbers[a], self.numbers[b]
        self.pairs[(i, j) if j < 0 or i < j else (j, i)] = None

    def foresee(self) -> None:
        """Predict the contacts of the pairs that touched, once for every two paths."""
        pairs = list(self.pairs)
        self.pairs.clear()
        paths, foreseen = self.engine.paths, self._foreseen
        for pair in pairs:
            i, j = pair
            both = (paths[i], paths[j] if j >= 0 else None)
            if foreseen.get(pair) != both:
                foreseen[pair] = both
                self._meet(i, j)

    def _meet(self, i: int, j: int) -> None:
        if j < 0:
            self.engine.meet_wall(i, -1 - j)
        else:
            self.engine.meet(i, j)

    # -- what the engine asks ------------------------------------------------------------------

    def walls(self, i: int) -> Iterable[int]:
        """The walls that ball ``i`` may meet in the rest of the step."""
        found = self._around[i] = self._look_around(i)
        return [-1 - j for j in found if j < 0]

    def begin(self, i: int, path: Path, radius: float, end: float) -> None:
        """Note that the body of ball ``i`` is to be put on a new path."""
        self.changed[i] = None

    def balls(self, i: int, now: float) -> Iterable[int]:
        """The balls that ball ``i`` may meet in the rest of the step."""
        found = self._around.pop(i, None) or self._look_around(i)
        others = dict.fromkeys((*found, *self.changed))
        return [j for j in others if j >= 0 and j != i]

    def remove(self, i: int) -> None:
        """Leave ball ``i`` out from now on."""
        self.changed.pop(i, None)

    def _look_around(self, i: int) -> list[int]:
        """Whose shapes are near ball ``i`` in the rest of the step, or near its sensor.

        What the sensor touches now is not reported again until they part.
        """
        path, r = self.engine.paths[i], self.engine.radii[i]
        x, y, _, _ = motion_at(path, max(self.until, path.t))
        x0, x1 = (x, path.x) if x < path.x else (path.x, x)
        y0, y1 = (y, path.y) if y < path.y else (path.y, y)
        r += 1e-6 * r + 16.0 * EPSILON * (abs(x) + abs(y))
        left, bottom, right, top = self.sensors[i].bb
        box = pymunk.BB(
            min(x0 - r, left), min(y0 - r, bottom), max(x1 + r, right), max(y1 + r, top)
        )
        numbers = self.numbers
        return [numbers[s] for s in self.space.bb_query(box, EVERYTHING) if s in numbers]


class Overlaps(BroadPhase):
    """The pairs that overlap at the end of a step: what a plain handler sees."""

    def __init__(self, space: pymunk.Space, engine: ContactEngine) -> None:
        super().__init__(space, engine)
        self._touching: dict[Key, None] = {}

    def foresee(self) -> None:
        """Ask for the contacts of all pairs that touched, in every step anew."""
        self._foreseen.clear()
        self._touching = dict(self.pairs)
        super().foresee()

    def walls(self, i: int) -> Iterable[int]:
        """The walls that ball ``i`` touched during the step."""
        return [-1 - j for k, j in self._touching if k == i and j < 0]

    def balls(self, i: int, now: float) -> Iterable[int]:
        """The balls that ball ``i`` touched during the step."""
        return [k + j - i for k, j in self._touching if j >= 0 and i in (k, j)]


class EndOfStep(ContactEngine):
    """The engine of contacts at the end of a step, as a plain handler finds them.

    Two sides meet at the end of the step (``step_end``, s) if they overlap there and close: up to a
    step late, and not at all where a ball only grazed or tunnelled.
    """

    step_end = 0.0

    def meet(self, i: int, j: int) -> None:
        """The balls meet at the end of the step, if they overlap there and close."""
        key = (i, j) if i < j else (j, i)
        if self._closes(key):
            self._push(self.step_end, key)

    def meet_wall(self, i: int, wall: int) -> float:
        """The end of the step (s), if the ball overlaps the wall there and closes."""
        if not self._closes((i, -1 - wall)):
            return math.inf
        self._push(self.step_end, (i, -1 - wall))
        return self.step_end

    def _closes(self, key: Key) -> bool:
        motions = {i: motion_at(self.paths[i], self.step_end) for i in key if i >= 0}
        if self.gap(key, motions) >= 0.0:
            return False
        velocity = {i: (vx, vy) for i, (_, _, vx, vy) in motions.items()}
        noise = max(self.paths[i].noise for i in motions)
        return closing_speed(self.contact(key, motions), velocity) > noise
