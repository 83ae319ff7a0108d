"""A lookout finds where paths touch what they do not hit, and loses what the touches decide."""

from __future__ import annotations

from typing import final

from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent.course import ANYTHING, NOTHING, Step
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.reasons import TOUCHES
from pool_pymunk.core.tangent.touches import (
    NEVER,
    Obstacle,
    touch_of_discs,
)
from pool_pymunk.core.tangent.track import Track

Found = list[tuple[float, str]]  # when (s) something was lost, and the reason


@final
class Lookout:
    """A lookout knows the obstacles of a table, and the tracks of the balls.

    It looks at a path when a step ends it, and notes what it has ``found``. A small change makes a
    contact at a touch or leaves a gap, so the ends have a kink.
    """

    def __init__(self, table: Table, inputs: Inputs, tracks: list[Track], found: Found) -> None:
        self.table = table
        self.inputs = inputs
        self.tracks = tracks
        self.found = found
        self.obstacles: list[Obstacle] = []  # all sides, also of posts and of pockets
        for place, wall in enumerate(table.walls):
            self.obstacles += [Obstacle(side, -1 - place) for side in wall.sides]

    def look_before(self, step: Step, a: Track, b: Track, meets_more: bool) -> None:
        """Look for touches on the paths that a step ends."""
        self.catch_up(step.t)
        self.look(a, step.t, ANYTHING if meets_more else step.met, a.number)
        if b is not a:
            self.look(b, step.t, ANYTHING if meets_more else a.number, a.number)

    def catch_up(self, t: float) -> None:
        """Let balls of which nothing is known go on to their last legs before a time (s).

        In a persistent contact they have legs between which there are no events. Others may touch
        them there. While nothing was found, all is known.
        """
        if len(self.found) == 0:
            return
        for track in self.tracks:
            then = track.following
            while then is not None and then.t < t and track.is_lost:
                self._look_at_balls(track, then.t, ANYTHING, track.number)
                track.go_on(NOTHING)
                then = track.following

    def look(self, track: Track, t: float, met: int, done: int) -> None:
        """Lose what touches decide on the path of a ball up to a time (s), where it has ``met``.

        Ball ``done`` was looked at before.
        """
        if track.is_gone:
            return
        if track.path.moves:
            for each in self.obstacles:
                free = track.met != each.met, met not in (each.met, ANYTHING)
                along, turns = each.touch(track.path, t, track.radius, free)
                if along:
                    self._touch(track, track, track.path.t, each)
                if turns != NEVER:
                    self._touch(track, track, turns, each)
        self._look_at_balls(track, t, met, done)

    def _look_at_balls(self, track: Track, t: float, met: int, done: int) -> None:
        """Lose what touches of other balls decide on the path of a ball up to a time (s)."""
        path, i = track.path, track.number
        is_still = not path.moves
        for other in self.tracks:
            j, its = other.number, other.path
            if j in (i, done) or other.is_gone or (is_still and not its.moves):
                continue
            begins = not (track.met == j and other.met == i) or path.t != its.t
            free = begins, met not in (j, ANYTHING)
            along, turns = touch_of_discs(path, its, t, (track.radius + other.radius, 1.0), free)
            if along:
                self._touch(track, other, max(path.t, its.t), None)
            if turns != NEVER:
                self._touch(track, other, turns, None)

    def _touch(self, a: Track, b: Track, t: float, obstacle: Obstacle | None) -> None:
        """Lose the derivatives at a touch: a contact there acts by the root of the gap's change.

        Every input that has changed one of the balls therefore matters, even to second order. At a
        face, inputs that move a ball along it alone do not: the ball stays at it.
        """
        was_known = not a.is_lost and not b.is_lost
        nx, ny = (0.0, 0.0) if obstacle is None else obstacle.across
        of_a, of_b, is_new = self.inputs.radius[a.number], self.inputs.radius[b.number], False
        slows_a, slows_b = self._slows(a, t), self._slows(b, t)
        for p in range(self.inputs.count):
            c, d = a.changes[p], b.changes[p]
            matters = c.ever or d.ever or of_a[p] != 0.0 or of_b[p] != 0.0
            matters = matters or (slows_a is not None and slows_a[p] != 0.0)
            matters = matters or (slows_b is not None and slows_b[p] != 0.0)
            if matters and (nx != 0.0 or ny != 0.0):
                matters = c.moves_across(of_a[p], nx, ny)
            if matters:
                is_new = True
                c.lose()
                d.lose()
                c.ever = d.ever = True
        if is_new and was_known:
            self.found.append((t, TOUCHES))
        a.keep(t)
        if b is not a:
            b.keep(t)

    def _slows(self, track: Track, t: float) -> list[float] | None:
        """Return how the inputs change the deceleration of a ball that has moved until a time."""
        if not track.path.moves or t <= track.path.t:
            return None
        return track.ground(self.table, self.inputs).by
