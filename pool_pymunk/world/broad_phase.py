"""This module tells the contact engine what pymunk's broad phase finds near a ball."""

from __future__ import annotations

import math
from collections.abc import Iterable

import pymunk

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.near import ManyBoxes, box
from pool_pymunk.physics.path import Path

Key = tuple[int, int]  # two balls, the lower number first; or a ball and -1 - a wall

# Up to this number of changed balls, hits with all of them are predicted without boxes around their
# paths. Of 4, 8, 16 and 32, 8 was the fastest, or nearly so, for 16 to 1,000 moving balls.
FEW = 8


def may_collide(one: pymunk.ShapeFilter, other: pymunk.ShapeFilter) -> bool:
    """Tell whether the filters of two shapes let them collide."""
    if one.group != 0 and one.group == other.group:
        return False
    return bool(one.categories & other.mask and other.categories & one.mask)


class BroadPhase:
    """A broad phase knows the pairs that touched during a step, and what is near a ball."""

    def __init__(self, space: pymunk.Space, engine: ContactEngine) -> None:
        self.space, self.engine = space, engine
        self.until = 0.0  # s; the end of the present step
        self.sensors: list[pymunk.Circle] = []
        # the number of a sensor's ball, or -1 - the number of a wall
        self.numbers: dict[pymunk.Shape, int] = {}
        # the boxes (m) that walls that move sweep in this step, with their filters, by their places
        self.swept: dict[int, tuple[pymunk.BB, pymunk.ShapeFilter]] = {}
        self.pairs: dict[Key, None] = {}  # the pairs that touched during this step
        self.changed: dict[int, None] = {}  # the balls that have begun a new path in it
        self.gone: list[int] = []  # the balls that have left the table in this step
        self._around: dict[int, list[int]] = {}
        # around the paths of the changed balls in the rest of this step, if these balls are many
        self._boxes = ManyBoxes(0, 0)

    def touched(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        """Handle a collision: note that these two shapes may have met during this step."""
        arbiter.process_collision = False
        i, j = map(self.numbers.get, arbiter.shapes)
        if i is not None and j is not None:  # A handler may have removed one in this very step.
            self.pairs[(i, j) if j < 0 or i < j else (j, i)] = None

    def foresee(self) -> None:
        """Predict the contacts of the pairs whose sensors have begun to touch."""
        for i, j in () if self.engine.has_loop else self.pairs:
            if j < 0:
                self.engine.meet_wall(i, -1 - j)
            else:
                self.engine.meet(i, j)
        self.pairs.clear()

    # -- what the engine asks ------------------------------------------------------------------

    def walls(self, i: int) -> Iterable[int]:
        """Return the walls that ball ``i`` may meet in the rest of the step."""
        found = self._around[i] = self._look_around(i)
        return [-1 - j for j in found if j < 0]

    def horizon(self, path: Path, now: float) -> float:
        return math.inf  # The engine goes to the end of the step only.

    def begin(self, i: int, path: Path, radius: float, since: float, end: float) -> None:
        """Note that the body of ball ``i`` is to be put on a new path."""
        self.changed[i] = None
        if i < len(self._boxes.boxes):
            self._boxes.begin(i, path, radius, since, max(self.until, path.t))

    def settle(self) -> None:
        """Note that all bodies are on their paths again."""
        self.changed.clear()
        if len(self._boxes.boxes):
            self._boxes = ManyBoxes(0, 0)

    def balls(self, i: int, now: float) -> Iterable[int]:
        """Return the balls that ball ``i`` may meet in the rest of the step."""
        found = self._around.pop(i, None) or self._look_around(i)
        others = dict.fromkeys((*found, *self._changed_near(i)))
        return [j for j in others if j >= 0 and j != i]

    def touching(self, i: int, now: float) -> Iterable[int]:
        found = dict.fromkeys((*self._look_around(i), *self._changed_near(i)))
        return [j for j in found if j != i]

    def remove(self, i: int) -> None:
        self.changed.pop(i, None)
        self.pairs = {pair: None for pair in self.pairs if i not in pair}
        self.numbers.pop(self.sensors[i], None)
        self.gone.append(i)

    def forget(self, shape: pymunk.Shape) -> None:
        """Leave out the wall or pocket of this shape from now on."""
        k = self.numbers.pop(shape)
        self.swept.pop(-1 - k, None)
        self.pairs = {pair: None for pair in self.pairs if k not in pair}

    def _changed_near(self, i: int) -> Iterable[int]:
        """Return the changed balls that may come to ball ``i`` in this step, or all of a few."""
        if len(self.changed) <= FEW:
            return self.changed
        paths, radii, now = self.engine.paths, self.engine.radii, self.engine.now
        new = [i]
        if len(self._boxes.boxes) < len(paths):
            self._boxes, new = ManyBoxes(2 * len(paths), 0), [*self.changed, i]
        for j in new:
            self._boxes.begin(j, paths[j], radii[j], now, max(self.until, paths[j].t))
        return [j for j in self._boxes.balls(i, now) if j in self.changed]

    def _look_around(self, i: int) -> list[int]:
        """Return what is near ball ``i`` in the rest of the step, or touches its sensor already."""
        path, r = self.engine.paths[i], self.engine.radii[i]
        x0, y0, x1, y1 = box(path, r, path.t, max(self.until, path.t))
        left, bottom, right, top = self.sensors[i].bb
        around = pymunk.BB(min(x0, left), min(y0, bottom), max(x1, right), max(y1, top))
        numbers, found = self.numbers, self.space.bb_query(around, self.sensors[i].filter)
        near = [numbers[shape] for shape in found if shape in numbers]
        for place, (swept, filter_) in self.swept.items():
            key = -1 - place
            if swept.intersects(around) and key not in near:
                near += [key] * may_collide(filter_, self.sensors[i].filter)
        return near
