"""A ball on the table: what it is, on which path it is, and until when that is looked at."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import i64

from pool_pymunk.core.motion.patches import OPEN
from pool_pymunk.core.motion.path import NOISE, Motion, Path
from pool_pymunk.core.motion.times import INF, Vector

EVERYTHING: Final = 0xFFFFFFFF  # all bits
NEARLY_NOW: Final = 1e-6  # radii; contacts this near in time may be of one instant


class Company:
    """Balls that go on together are a company; what ends the present piece is due for its leader.

    It ``halts`` where the motion of a wall ends, and ``sleeps`` while forces hold its balls in
    their places. The engine asks it, and
    :class:`~pool_pymunk.core.persistent.gathering.Gathering` is one.
    """

    def __init__(self) -> None:
        self.leader: Ball | None = None
        self.halts = self.sleeps = False

    @property
    def answers_all(self) -> bool:
        """This tells whether it answers itself whatever its balls hit."""
        return False

    def state_of(self, ball: Ball, t: float) -> tuple[Motion, Vector]:
        """Return the motion (m, m/s) and the roll (m/s) of one of its balls at a time (s)."""
        raise NotImplementedError


@final
class Ball:
    """A ball has a number, a radius (m), a mass (kg), and its present path.

    ``noise`` (m/s) of its velocity may be rounding, ``speed`` (m/s) is the highest on its path.
    ``rested`` (s) is when it came to rest, infinite while it moves. Its path meets a wall at
    ``end`` (s), and its hits are found up to ``horizon`` (s), within the box from ``low_x`` to
    ``high_y`` (m). It has had so many ``paths`` after the first one, and ``is_fresh`` until a run
    has begun with that. ``patch`` is that of the table in which it is, or -1. The bits of
    ``categories`` and ``mask`` say what it is, and whom it may meet. The engine owns it; all others
    ask it.
    """

    def __init__(
        self, number: int, radius: float, mass: float, path: Path, is_cue: bool = False
    ) -> None:
        self.number: i64 = number
        self.radius = radius
        self.mass = mass
        self.path = path
        self.paths: i64 = 0
        self.is_fresh = True
        self.is_cue = is_cue
        self.noise = 0.0
        self.speed = 0.0
        self.rested = INF if path.moves else -INF
        self.end = INF
        self.horizon = INF
        self.is_off = False
        self.patch = OPEN
        self.crossed = -INF  # s; when it crossed a border last, and how often at that instant
        self.crossings = 0
        self.hits = 0  # so many, each soon after the one before; the last at ``hit`` (s)
        self.hit = -INF
        self.creep = 0.0  # m/s; more slowly, it rests
        self.bounces = -INF  # s; until then bounces last that are left out, if a group forms anew
        self.pace = INF  # s; a guess for the first piece of a group: twice its last one
        self.changed = -INF  # s; when the mode of its group has changed last, and how soon again
        self.least = 0.0  # it may
        self.categories: i64 = EVERYTHING
        self.mask: i64 = EVERYTHING
        self.group: Company | None = None  # in which it stays in contact
        self.stopped = -INF  # s; when the recorder has last heard of a stop
        self.seen = 0  # the number of the search for near balls that last saw it
        self.predicted: i64 = 0  # the number of the prediction that last looked for its hits
        self.low_x = self.low_y = INF
        self.high_x = self.high_y = -INF

    def begin(self, path: Path) -> None:
        """Let the ball begin another run on its first path, as if it were new."""
        self.path = path
        self.paths = 0
        self.is_fresh = True
        self.rested = INF if path.moves else -INF
        self.end = self.horizon = INF
        self.is_off = False
        self.patch = OPEN
        self.crossed = self.hit = self.stopped = self.bounces = -INF
        self.crossings = self.hits = self.seen = self.predicted = 0
        self.noise = self.speed = self.creep = 0.0
        self.pace, self.changed, self.least = INF, -INF, 0.0
        self.group = None

    def forget_hits(self) -> None:
        """Let the ball have met nothing of late."""
        self.hits, self.hit, self.bounces = 0, -INF, -INF
        self.creep = 0.0

    def lead(self, path: Path, noise: float) -> None:
        """Put the ball on a path; ``noise`` (m/s) of its velocity may be rounding."""
        self.path, fastest = path, path.fastest
        self.paths += 1
        # A ball that sets off without a velocity has no highest speed yet.
        self.speed = fastest if fastest > 0.0 or path.slows else INF
        self.noise = noise

    def set_off(self, path: Path) -> None:
        """Put the ball on a path whose velocity has only the noise of its numbers."""
        self.lead(path, NOISE * path.fastest)

    def ignores(self, categories: i64, mask: i64) -> bool:
        """Tell whether it goes through another ball, or a wall, by the bits of both."""
        return self.categories & mask == 0 or categories & self.mask == 0

    def time_for(self, share: float) -> float:
        """Return how long (s) it takes at its highest speed for a share of its radius."""
        return share * self.radius / self.speed if self.speed > 0.0 else 0.0

    @property
    def is_in_crowd(self) -> bool:
        """This tells whether it is in a group that answers itself whatever it hits."""
        return self.group is not None and self.group.answers_all

    def creeps(self, velocity: Vector, roll: Vector) -> bool:
        """Tell whether the ball moves too slowly to be seen until it rests."""
        vx, vy = velocity
        wx, wy = roll
        return vx * vx + vy * vy + wx * wx + wy * wy <= self.creep * self.creep

    # -- its box -----------------------------------------------------------------------------------

    def put_box(self, since: float, end: float) -> None:
        """Put a box around the path from a time (s) to another one."""
        path, r = self.path, self.radius
        x, y, ex, ey = path.x, path.y, path.x, path.y
        last = end if end < path.end else path.end
        if last == INF:
            ex = far_off(x, path.vx, path.ax)
            ey = far_off(y, path.vy, path.ay)
        elif path.end > path.t:
            s = last - path.t
            ex = x + s * (path.vx + s * path.ax / 2.0)
            ey = y + s * (path.vy + s * path.ay / 2.0)
        if since > path.t and path.end > path.t:
            x, y = path.place(since)
        r += 2.0 * NEARLY_NOW * r + 1e-9 * (abs(x) + abs(y))
        self.low_x, self.high_x = min(x, ex) - r, max(x, ex) + r
        self.low_y, self.high_y = min(y, ey) - r, max(y, ey) + r
        if not path.slows:
            self._widen_box(since, last, r)

    def _widen_box(self, since: float, last: float, r: float) -> None:
        """Let the box hold the places at which a bent path turns back between two times (s)."""
        path, s = self.path, last - since
        x, y, vx, vy = path.at(since)
        if vx * path.ax < 0.0 and abs(vx) < abs(path.ax) * s:
            x -= vx * vx / (2.0 * path.ax)
        if vy * path.ay < 0.0 and abs(vy) < abs(path.ay) * s:
            y -= vy * vy / (2.0 * path.ay)
        self.low_x, self.high_x = min(self.low_x, x - r), max(self.high_x, x + r)
        self.low_y, self.high_y = min(self.low_y, y - r), max(self.high_y, y + r)

    def take_box_away(self) -> None:
        """Let the box hold nothing."""
        self.low_x = self.low_y = INF
        self.high_x = self.high_y = -INF


def far_off(x: float, v: float, a: float) -> float:
    """Return where a coordinate leads that goes on for ever, from its place, rate and bend."""
    rate = a if a != 0.0 else v
    return x if rate == 0.0 else (INF if rate > 0.0 else -INF)
