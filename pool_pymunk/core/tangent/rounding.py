"""Rounding errors of a run are columns of changes, with random signs.

Every path and every contact makes errors of a few units of rounding: of the place, of the time of
the contact, of the normal, of the new velocities. They are injected where they are made, and go
through the run as any other change does (:mod:`pool_pymunk.core.tangent.tangent`).
"""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import i64

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent.change import Change
from pool_pymunk.core.variant import MODULUS, MULTIPLIER
from pool_pymunk.core.walls.arc import Arc
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import Side

# A sum or a product errs by up to half a spacing; this is the root mean square, as a share.
UNIT: Final = EPSILON / 2.0 / math.sqrt(3.0)
DRAWS: Final = 32  # of random signs; their root mean square is then right to some 12 %
SURE: Final = 4.0  # A figure is this many times a root mean square.
# Contacts of one kind err alike: a ball between two cushions adds the same interval to the time
# again and again, with the same rounding. SURE times this share of UNIT is half a spacing.
ALIKE: Final = 0.43
# time_of_contact shrinks corners by 8 EPSILON of the coordinates; SURE times this is twice that.
CORNER: Final = 4.0 * EPSILON
KINDS: Final = 16  # kinds of contacts, by balls and cushion; each kind errs alike; a free choice
TURNED: Final = 0.5  # rad; where a normal may have turned this far, the first order says nothing
MOST_ROWS: Final = 6  # errors that one source makes at once

# what errs
TIMES: Final = 0
PLACES: Final = 1
PATHS: Final = 2
ANSWERS: Final = 3
SOURCES: Final = 4

# Half of the bits of a random number are used, and two numbers make a row of signs.
HALF: Final[i64] = 65_536


@final
class RoundingErrors:
    """Errors have random signs, which are drawn one row after the other.

    To each sign one is added that all errors of one source and of one ``kind`` of events share.
    """

    def __init__(self, table: Table) -> None:
        self.rolls: Final = table.surface.rolls
        self.pull: Final = UNIT if table.pull > 0.0 else 0.0
        self.state: i64 = 1
        self.kind = 0
        self.size = 0.0
        self.signs: i64 = 0
        self.shared: i64 = 0
        self.alike: Final = [self._row() for _ in range(SOURCES * KINDS * MOST_ROWS)]

    def _row(self) -> i64:
        """Return DRAWS random bits."""
        first = self.state * MULTIPLIER % MODULUS
        self.state = first * MULTIPLIER % MODULUS
        return first // 128 % HALF * HALF + self.state // 128 % HALF

    def begin(self, kind: int) -> None:
        """Begin an event of a kind."""
        self.kind = kind % KINDS

    def draw(self, size: float, source: int, row: int) -> None:
        """Draw errors of a size, of a source and of one of its rows."""
        self.size = size
        self.signs = self._row()
        self.shared = self.alike[(source * KINDS + self.kind) * MOST_ROWS + row]

    def of(self, p: i64) -> float:
        """Return the error of a draw."""
        own = self.size if (self.signs >> p) & 1 == 1 else -self.size
        less = ALIKE * self.size
        return own + (less if (self.shared >> p) & 1 == 1 else -less)

    def misplace(self, path: Path, changes: list[Change], t: float) -> None:
        """Add the errors of a ball's state at a time (s) on its path.

        A coordinate errs by a unit of itself, and the path there, a product, by two. An
        acceleration errs by three where a ball slips: a difference, a root and a quotient.
        """
        x, y = path.place(t)
        far_x, far_y = self.moved(path, x, y, t)
        turned = 3.0 * UNIT * (t - path.t) if self.rolls else 0.0
        vx, vy = abs(path.vx), abs(path.vy)
        if self.falls(path):
            vx, vy = vx + (t - path.t) * abs(path.ax), vy + (t - path.t) * abs(path.ay)
        self.add(changes, 0, UNIT * (abs(x) + 2.0 * far_x) if far_x > 0.0 else 0.0, PLACES, 0)
        self.add(changes, 1, UNIT * (abs(y) + 2.0 * far_y) if far_y > 0.0 else 0.0, PLACES, 1)
        self.add(changes, 2, self.pull * vx + turned * abs(path.ax), PLACES, 2)
        self.add(changes, 3, self.pull * vy + turned * abs(path.ay), PLACES, 3)
        if self.rolls:
            spun = turned if path.slows else turned / GYRATION
            self.add(changes, 4, UNIT * abs(path.wx) + spun * abs(path.ax), PLACES, 4)
            self.add(changes, 5, UNIT * abs(path.wy) + spun * abs(path.ay), PLACES, 5)

    def add(self, changes: list[Change], k: int, size: float, source: int, row: int) -> None:
        """Add errors of a size (m, m/s), if there is any, to one of the six numbers of changes."""
        if size > 0.0:
            self.draw(size, source, row)
            for p, c in enumerate(changes):
                c.add(k, self.of(p))

    def push(self, changes: list[Change], nx: float, ny: float, size: float, row: int) -> None:
        """Add errors of a size (m/s), along a direction, to velocities."""
        if size > 0.0:
            self.draw(size, ANSWERS, row)
            for p, c in enumerate(changes):
                by = self.of(p)
                c.vx += nx * by
                c.vy += ny * by

    def falls(self, path: Path) -> bool:
        """Tell whether a ball falls: its speed may grow, and it may turn back."""
        return not (self.rolls or path.slows)

    def moved(self, path: Path, x: float, y: float, t: float) -> tuple[float, float]:
        """Return how far (m) a ball has moved to (x, y), even if its roll turned it back."""
        if not (self.rolls or self.falls(path)):
            return abs(x - path.x), abs(y - path.y)
        time = t - path.t
        return (
            time * (abs(path.vx) + time / 2.0 * abs(path.ax)),
            time * (abs(path.vy) + time / 2.0 * abs(path.ay)),
        )

    def gap_at_side(self, side: Side, path: Path, t: float, r: float) -> float:
        """Return the error (m) of a gap to a side that is found closed.

        At a straight side the path along the normal counts, and the offset from the start of the
        side. A circle errs by some units of its radius and of the path. A circle that bulges into
        the table was shrunk by some spacings of the coordinates.
        """
        x, y = path.place(t)
        far_x, far_y = self.moved(path, x, y, t)
        nx, ny = side.normal(x, y)
        curvature = side.curvature(x, y)
        at_x, at_y = anchor_of(side, x, y)
        far_x, far_y = far_x + abs(x - at_x), far_y + abs(y - at_y)
        if curvature == 0.0:
            return UNIT * (far_x * abs(nx) + far_y * abs(ny) + 2.0 * r)
        corner = CORNER * (abs(path.x) + abs(path.y) + r) if curvature > 0.0 else 0.0
        return corner + 2.0 * UNIT * (2.0 * (1.0 / abs(curvature) + r) + far_x + far_y)

    def gap_of_balls(self, a: Path, b: Path, t: float, r: float) -> float:
        """Return the error (m) of a gap of balls whose radii are ``r`` in all.

        It errs by a unit of their offset at the start of a path, or by four where the time is found
        by an iteration: both move, or one slips. If the ball that set off first still moved when
        the other one set off, its place was rounded then.
        """
        x, y = a.place(t)
        u, v = b.place(t)
        far_x, far_y = self.moved(a, x, y, t)
        its_far_x, its_far_y = self.moved(b, u, v, t)
        size = far_x + far_y + (its_far_x + its_far_y) + 2.0 * r
        first = a if a.t <= b.t else b
        places = 0.0
        if first.moves and a.t != b.t:
            places = abs(x) + abs(y) + abs(u) + abs(v)
        is_found = a.moves and b.moves
        if self.rolls:
            is_found = is_found or slips(a) or slips(b)
        return UNIT * ((4.0 if is_found else 1.0) * size + places)


def anchor_of(side: Side, x: float, y: float) -> tuple[float, float]:
    """Return a point (m) by which a side is known; that of a side of somebody's own is (x, y)."""
    if isinstance(side, Face):
        return side.start
    if isinstance(side, RoundSide):
        return side.center
    if isinstance(side, Arc):
        cx, cy = side.center
        fx, fy = side.first
        return cx + side.radius * fx, cy + side.radius * fy
    return x, y


def slips(path: Path) -> bool:
    """Tell whether the velocity of a ball is not its roll."""
    return path.vx != path.wx or path.vy != path.wy


def sizes_of(
    changes: list[Change], others: list[Change] | None, nx: float, ny: float
) -> tuple[float, float]:
    """Return how large (m) the error of a place is along a normal, and across it.

    With those of ``others`` it is the error of their offset.
    """
    along = across = 0.0
    for p, c in enumerate(changes):
        x, y = c.x, c.y
        if others is not None:
            x, y = others[p].x - x, others[p].y - y
        u, v = nx * x + ny * y, nx * y - ny * x
        along, across = along + u * u, across + v * v
    share = SURE / math.sqrt(DRAWS)
    return share * math.sqrt(along), share * math.sqrt(across)


def farthest(balls: list[list[Change]]) -> float:
    """Return SURE times the largest root mean square move (m) of a ball."""
    most = 0.0
    for changes in balls:
        total = 0.0
        for c in changes:
            total += c.x * c.x + c.y * c.y
        if total != total:
            return math.nan
        most = max(most, total / DRAWS)
    return SURE * math.sqrt(most)
