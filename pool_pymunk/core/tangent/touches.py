"""Touches are where a path touches something, to rounding, and does not hit it.

A path may be tangent to a ball, a corner, an arc or the rim of a pocket. It may run along a cushion
or end just where it touches. A small change makes a contact there or leaves a gap, so the ends have
a kink.
"""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import i64, mypyc_attr

from pool_pymunk.core.motion.pairs import HAIR
from pool_pymunk.core.motion.path import Path, standing
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent.change import BLUR, GRAZE
from pool_pymunk.core.tangent.course import ANYTHING, NOTHING, Step
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.reasons import TOUCHES
from pool_pymunk.core.tangent.track import Track
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import Curved
from pool_pymunk.core.walls.side import Side

# Halvings find the time of the least distance to 2**-40 of an interval, and this distance, which is
# flat there, to its square. After 20 that is 1e-12, near rounding; after 52 nothing changes.
HALVINGS: Final = 40
# The last velocity is that at this share of an interval before its end, where it may be zero.
LAST: Final = 1e-9
# of a radius; a ball that meets a side this near to its end may meet a corner
EDGE: Final = 1e-9
NEVER: Final = -1.0  # s; no touch has this time

# whether a ball goes along something at first, and when (s) it turns back or ends there
Touch = tuple[bool, float]
NO_TOUCH: Final = (False, NEVER)
Found = list[tuple[float, str]]  # when (s) something was lost, and the reason


@final
class Corner:
    """A corner of the table is at (x, y), in m, where a side with this tangent begins or ends."""

    def __init__(self, x: float, y: float, tangent: Vector) -> None:
        self.x = x
        self.y = y
        self.tx, self.ty = tangent

    def is_met(self, x: float, y: float, r: float) -> bool:
        """Tell whether a ball of a radius (m) touches the table just where the side ends."""
        dx, dy = x - self.x, y - self.y
        along, height = dx * self.tx + dy * self.ty, dy * self.tx - dx * self.ty
        return abs(along) <= EDGE * r and abs(height - r) <= EDGE * r


@final
class Obstacle:
    """An obstacle is a side of a wall; ``met`` is what a ball that hits it has met."""

    def __init__(self, side: Side, met: i64) -> None:
        self.met: i64 = met
        self.face: Final = side if isinstance(side, Face) else None
        self.curved: Final = side if isinstance(side, Curved) else None
        # the normal of a face; (0, 0) for what is round
        self.across: Final = (0.0, 0.0) if self.face is None else self.face.outward
        x, y = (0.0, 0.0) if self.curved is None else self.curved.center
        self.stands: Final = standing(0.0, x, y)

    def touch(self, path: Path, until: float, r: float, free: tuple[bool, bool]) -> Touch:
        """Tell how the path of a ball touches the side, up to a time (s)."""
        face, side = self.face, self.curved
        if face is not None:
            return touch_of_face(path, face, until, r, free)
        if side is None:
            return NO_TOUCH
        apart, facing = side.reach(r), side.facing
        if facing > 0.0 and are_far(path, self.stands, until, apart):
            return NO_TOUCH
        along, turns = touch_of_discs(path, self.stands, until, (apart, facing), free)
        along = along and side.is_beside(path.x, path.y)
        if turns != NEVER:
            x, y = path.place(turns)
            turns = turns if side.is_beside(x, y) else NEVER
        return along, turns


def touch_of_face(path: Path, face: Face, until: float, r: float, free: tuple[bool, bool]) -> Touch:
    """Tell whether a ball goes along a face at first, and when (s) it turns back or ends there.

    The beginning counts if it is ``free`` of a contact, and so does the end.
    """
    if path.t >= until:
        return NO_TOUCH
    x, y = path.place(until)
    blur = BLUR * (abs(path.x) + abs(path.y) + abs(x) + abs(y) + r)
    if path.slows and not (
        abs(face.gap_beyond(path.x, path.y, r)) <= blur or abs(face.gap_beyond(x, y, r)) <= blur
    ):
        return NO_TOUCH  # A straight path touches where it begins or ends.
    begins, ends = free
    nx, ny = face.outward
    rate, pull = path.vx * nx + path.vy * ny, path.ax * nx + path.ay * ny
    along = begins and abs(rate) <= GRAZE * max(abs(path.vx), abs(path.vy))
    along = along and abs(face.gap(path.x, path.y, r)) <= blur
    if rate < 0.0 and pull > 0.0 and path.t - rate / pull < until and bends(path):
        turns = path.t - rate / pull
        turn_x, turn_y = path.place(turns)
        if abs(face.gap(turn_x, turn_y, r)) <= blur:
            return along, turns
    return along, until if ends and abs(face.gap(x, y, r)) <= blur else NEVER


def bends(path: Path) -> bool:
    """Tell whether a path is curved, as that of a ball which slides before it rolls may be."""
    left, right = path.vx * path.ay, path.vy * path.ax
    return abs(left - right) > BLUR * (abs(left) + abs(right))


def are_far(a: Path, b: Path, until: float, apart: float) -> bool:
    """Tell by bounds whether discs stay farther apart than ``apart`` (m) until a time (s)."""
    far = apart + HAIR * (abs(a.x) + abs(b.x) + abs(a.y) + abs(b.y) + apart)
    own_x, own_y = longest(a, until)
    its_x, its_y = longest(b, until)
    return abs(a.x - b.x) > far + own_x + its_x or abs(a.y - b.y) > far + own_y + its_y


def longest(path: Path, until: float) -> Vector:
    """Return how far (m) a path leads at most along x, and along y, until a time (s)."""
    time = until - path.t
    if path.slows:
        time = min(time, path.end - path.t)
        return time * abs(path.vx + time * path.ax / 2.0), time * abs(
            path.vy + time * path.ay / 2.0
        )
    return time * (abs(path.vx) + time * abs(path.ax)), time * (abs(path.vy) + time * abs(path.ay))


def misses(mover: Path, rester: Path, apart: float) -> bool:
    """Tell whether the line of a straight path stays farther than ``apart`` (m) from a disc."""
    dx, dy, vx, vy = rester.x - mover.x, rester.y - mover.y, mover.vx, mover.vy
    far = apart + HAIR * (abs(mover.x) + abs(rester.x) + abs(mover.y) + abs(rester.y) + apart)
    across = dx * vy - dy * vx
    return mover.slows and across * across > far * far * (vx * vx + vy * vy)


def touch_of_discs(
    a: Path, b: Path, until: float, circle: Vector, free: tuple[bool, bool]
) -> Touch:
    """Tell how discs touch at a distance (m), as :func:`touch_of_face` does.

    ``circle`` is the distance and the facing: if it is negative, one disc is within the other.
    """
    since = max(a.t, b.t)
    if since >= until:
        return NO_TOUCH
    return Approach(a, b, since, until, circle).touch(free)


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Approach:
    """This is how a disc moves as another one sees it, from a time (s) until another one.

    Between its ends, the relative path deviates from its chord by |a| T^2 / 8 at most.
    """

    def __init__(self, a: Path, b: Path, since: float, until: float, circle: Vector) -> None:
        apart, facing = circle
        own_x, own_y, own_u, own_v = a.at(since)
        its_x, its_y, its_u, its_v = b.at(since)
        self.since, self.until = since, until
        self.apart: Final = apart
        self.sign: Final = -1.0 if facing < 0.0 else 1.0
        self.time = until - since
        self.dx, self.dy, self.vx, self.vy = (
            its_x - own_x, its_y - own_y, its_u - own_u, its_v - own_v
        )  # fmt: skip
        self.ax, self.ay = b.ax - a.ax, b.ay - a.ay
        self.fastest: Final = max(max(abs(own_u), abs(own_v)), max(abs(its_u), abs(its_v)))
        size = abs(own_x) + abs(own_y) + abs(its_x) + abs(its_y) + 4.0 * self.time * self.fastest
        self.blur = BLUR * (size + apart)
        self.bow = self.time * self.time / 8.0
        self.x = self.dx + self.time * (self.vx + self.time * self.ax / 2.0)
        self.y = self.dy + self.time * (self.vy + self.time * self.ay / 2.0)

    def touch(self, free: tuple[bool, bool]) -> Touch:
        """Tell whether the discs go along each other at first, and when (s) they touch later."""
        begins, ends = free
        if self.sign > 0.0 and self._stay_apart():
            return NO_TOUCH
        dx, dy, x, y, sign, blur = self.dx, self.dy, self.x, self.y, self.sign, self.blur
        first, last = math.sqrt(dx * dx + dy * dy), math.sqrt(x * x + y * y)
        late = (1.0 - LAST) * self.time
        rate = dx * self.vx + dy * self.vy
        at_last = x * (self.vx + late * self.ax) + y * (self.vy + late * self.ay)
        is_still = abs(rate) <= GRAZE * self.fastest * first
        along = is_still and begins and abs(first - self.apart) <= blur
        # Discs that have just met may seem to approach, by rounding.
        turns_back = sign * rate < 0.0 and sign * at_last > 0.0 and (begins or not is_still)
        if turns_back and (sign < 0.0 or self._may_come_near()):
            turns, distance = self._turning()
            if abs(distance - self.apart) <= blur:
                return along, self.since + turns
        # Discs that have just met may never be seen to part.
        is_bent = self._bend() > blur * max(abs(x - dx), abs(y - dy))
        stay = not begins and abs(first - self.apart) <= blur and not is_bent
        return along, self.until if ends and not stay and abs(last - self.apart) <= blur else NEVER

    def _stay_apart(self) -> bool:
        """Tell by a box around the relative path whether it stays away."""
        far = self.apart + self.blur
        x, y = far + self.bow * abs(self.ax), far + self.bow * abs(self.ay)
        if min(self.dx, self.x) > x or max(self.dx, self.x) < -x:
            return True
        return min(self.dy, self.y) > y or max(self.dy, self.y) < -y

    def _bend(self) -> float:
        """Return how far the path lies off its chord, times the chord's length."""
        cx, cy = self.x - self.dx, self.y - self.dy
        return self.bow * abs(self.ax * cy - self.ay * cx)

    def _may_come_near(self) -> bool:
        """Tell whether the chord comes so near that the path may touch."""
        cx, cy = self.x - self.dx, self.y - self.dy
        near = (self.apart + self.blur) * math.sqrt(cx * cx + cy * cy) + self._bend()
        return abs(self.dx * cy - self.dy * cx) <= near

    def _turning(self) -> Vector:
        """Return when (s) discs cease to approach, or within another to part, and how far apart."""
        near, part = 0.0, self.time
        for _ in range(HALVINGS):
            middle = 0.5 * (near + part)
            ux, uy = self.vx + middle * self.ax, self.vy + middle * self.ay
            x = self.dx + middle * (self.vx + middle * self.ax / 2.0)
            y = self.dy + middle * (self.vy + middle * self.ay / 2.0)
            if self.sign * (x * ux + y * uy) > 0.0:
                part = middle
            else:
                near = middle
        x = self.dx + part * (self.vx + part * self.ax / 2.0)
        y = self.dy + part * (self.vy + part * self.ay / 2.0)
        return part, math.sqrt(x * x + y * y)


@final
class Lookout:
    """A lookout knows the obstacles of a table, and the tracks of the balls.

    It looks at a path when a step ends it, and notes what it has ``found``. A small change makes a
    contact at a touch or leaves a gap, so the ends have a kink.
    """

    def __init__(self, table: Table, inputs: Inputs, tracks: list[Track], found: Found) -> None:
        self.table: Final = table
        self.inputs: Final = inputs
        self.tracks: Final = tracks
        self.found: Final = found
        self.obstacles: list[Obstacle] = []  # all sides, also of posts and of pockets
        for place, wall in enumerate(table.walls):
            self.obstacles += [Obstacle(side, -1 - place) for side in wall.sides]

    def look_before(self, step: Step, a: Track, b: Track, meets_more: bool) -> None:
        """Look for touches on the paths that a step ends."""
        self.catch_up(step.t)
        self.look(a, step.t, ANYTHING if meets_more else step.met, a)
        if b is not a:
            self.look(b, step.t, ANYTHING if meets_more else a.number, a)

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
                self._look_at_balls(track, then.t, ANYTHING, track)
                track.go_on(NOTHING)
                then = track.following

    def look(self, track: Track, t: float, met: i64, done: Track) -> None:
        """Lose what touches decide on the path of a ball up to a time (s), where it has ``met``.

        The ball of track ``done`` was looked at before.
        """
        if track.is_gone:
            return
        if track.moves:
            for each in self.obstacles:
                free = track.met != each.met, met not in (each.met, ANYTHING)
                along, turns = each.touch(track.path, t, track.radius, free)
                if along:
                    self._touch(track, track, track.path.t, each)
                if turns != NEVER:
                    self._touch(track, track, turns, each)
        self._look_at_balls(track, t, met, done)

    def _look_at_balls(self, track: Track, t: float, met: i64, done: Track) -> None:
        """Lose what touches of other balls decide on the path of a ball up to a time (s)."""
        path = track.path
        if path.t >= t:
            return
        for other in self.tracks:
            its = other.path
            if other.is_gone or other is track or other is done or its.t >= t:
                continue
            apart = track.radius + other.radius
            if not other.moves:
                if not track.moves or misses(path, its, apart):
                    continue
            elif not track.moves and misses(its, path, apart):
                continue
            if are_far(path, its, t, apart):
                continue
            have_met = track.met == other.number and other.met == track.number
            free = not have_met or path.t != its.t, met not in (other.number, ANYTHING)
            along, turns = touch_of_discs(path, its, t, (apart, 1.0), free)
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
        own, is_new = self.inputs.radius[a.number], False
        rows = [own, self.inputs.radius[b.number]]  # and how the inputs change what slows them
        for track in [a, b]:
            if track.path.moves and t > track.path.t:
                rows.append(track.ground(self.table, self.inputs).by)
        for p in range(self.inputs.count):
            c, d = a.changes[p], b.changes[p]
            matters = c.ever or d.ever or any(row[p] != 0.0 for row in rows)
            if matters and (nx != 0.0 or ny != 0.0):
                matters = c.moves_across(own[p], nx, ny)
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
