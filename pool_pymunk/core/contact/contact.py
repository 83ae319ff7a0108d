"""Contacts tell who touches whom at an instant, and how fast; discs are balls as they move then."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.walls.wall import Wall

NT = tuple[float, float]  # a velocity (m/s) along a normal and along its tangent (-n_y, n_x)

# What becomes of a contact.
MISSED: Final = 0  # Two balls touch, but do not close.
HIT: Final = 1  # The law answers; this is an event.
LED: Final = 2  # A cushion leads a ball along itself.
COLLAPSED: Final = 3  # The law answers many hits of an inelastic collapse.

SAME_NORMAL: Final = 1e-12  # 1 - cosine of two normals that are the same


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Pair:
    """A pair holds masses (kg), restitution e and friction mu of two sides that hit.

    The mass of a cushion is infinite. Laws ask it.
    """

    def __init__(self, m_a: float, m_b: float, restitution: float, friction: float) -> None:
        self.m_a = m_a
        self.m_b = m_b
        self.restitution = restitution
        self.friction = friction

    def with_restitution(self, restitution: float) -> Pair:
        """Return the same pair with another restitution."""
        return Pair(self.m_a, self.m_b, restitution, self.friction)

    def with_friction(self, friction: float) -> Pair:
        """Return the same pair with another friction."""
        return Pair(self.m_a, self.m_b, self.restitution, friction)


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Disc:
    """A disc is a ball at an instant: its place (m), its velocity (m/s) now and before a round.

    Contacts change its velocity. The rest is what answers of several contacts note: how it
    ``moved``, whether it ``plays`` in a round, whether the instant has ``changed`` it.
    """

    def __init__(self, ball: Ball, x: float, y: float, vx: float, vy: float) -> None:
        self.ball: Final = ball
        self.x, self.y = x, y
        self.vx, self.vy = vx, vy
        self.before_x, self.before_y = vx, vy
        self.moved = MISSED
        self.plays = False
        self.changed = False
        self.shares = 0  # so many contacts push it
        self.first: Disc | None = None  # of those that contacts join, if it is another one
        self.start_x = self.start_y = 0.0  # m/s; the velocity before an answer whose impulses are
        self.sum_x = self.sum_y = 0.0  # asked for, and the sum of what its single hits changed

    @property
    def square(self) -> float:
        """The square of the speed (m^2/s^2)."""
        return self.vx * self.vx + self.vy * self.vy

    def change(self, dn: float, dt: float, nx: float, ny: float) -> None:
        """Change the velocity's parts along a normal and its tangent; 0 keeps every bit."""
        self.vx = self.vx + dn * nx - dt * ny
        self.vy = self.vy + dn * ny + dt * nx

    def root(self) -> Disc:
        """Return the first of the discs that contacts join to this one."""
        root = self
        while root.first is not None:
            root = root.first
        return root


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Contact:
    """A contact is a place where disc ``a`` touches disc ``b``, or a wall.

    The normal points from a to b, or from the wall into the table. The two touch at (``px``,
    ``py``), in m. ``gap`` (m) is the distance between them; 0 where rounding hides it.
    ``curvature`` (1/m) is that of the side. A wall that moves drifts at (``ux``, ``uy``), in m/s,
    and one that kicks has a ``kick`` (m/s); it has ``kicked`` by that, or not at all. ``normal``,
    ``along`` and ``along_first`` are the impulses (N s) along the normal, and along the tangent on
    the second and the first ball; a cushion's ``along`` is that on the ball.
    """

    def __init__(
        self, a: Disc, b: Disc | None, wall: Wall | None, nx: float, ny: float, pair: Pair
    ) -> None:
        self.a: Final = a
        self.b: Final = b
        self.wall: Final = wall
        self.nx, self.ny = nx, ny
        self.pair = pair
        self.px, self.py = a.x, a.y
        self.gap = 0.0
        self.curvature = 0.0
        self.ux = self.uy = 0.0
        self.kick = self.kicked = 0.0
        self.kind = MISSED
        self.jumped = False  # The law jumps here, and rounding would decide its answer.
        self.normal = self.along = self.along_first = 0.0
        # N s; the sums of the impulses of single hits by which a law has answered several contacts
        self.called = self.called_along = self.called_first = 0.0

    @property
    def discs(self) -> list[Disc]:
        """The balls of the contact."""
        return [self.a] if self.b is None else [self.a, self.b]

    @property
    def closing(self) -> float:
        """The speed (m/s) at which the two sides approach; negative if they part."""
        a, b = self.a, self.b
        if b is None:
            return -((a.vx - self.ux) * self.nx + (a.vy - self.uy) * self.ny)
        return (a.vx - b.vx) * self.nx + (a.vy - b.vy) * self.ny

    @property
    def slip(self) -> float:
        """The speed (m/s) at which the far side moves along the tangent."""
        a, b, nx, ny = self.a, self.b, self.nx, self.ny
        own = a.vy * nx - a.vx * ny
        if b is None:
            return own - (self.uy * nx - self.ux * ny)
        return (b.vy * nx - b.vx * ny) - own

    @property
    def noise(self) -> float:
        """The part (m/s) of the velocities that may be rounding."""
        b = self.b
        return self.a.ball.noise if b is None else max(self.a.ball.noise, b.ball.noise)

    @property
    def lightness(self) -> float:
        """1/m of the two sides, added up (1/kg)."""
        m_b = self.pair.m_b
        return 1.0 / self.pair.m_a + (0.0 if m_b == INF else 1.0 / m_b)

    @property
    def drifts(self) -> bool:
        """This tells whether the wall moves."""
        return self.ux != 0.0 or self.uy != 0.0

    def parts_of_a(self) -> NT:
        """Return the velocity of a (relative to a wall) along the normal and the tangent."""
        vx, vy = self.a.vx - self.ux, self.a.vy - self.uy
        return vx * self.nx + vy * self.ny, vy * self.nx - vx * self.ny

    def parts_of_b(self) -> NT:
        """Return the velocity of b along the normal and the tangent."""
        b = self.b
        assert b is not None, "it is a contact of two balls"
        return b.vx * self.nx + b.vy * self.ny, b.vy * self.nx - b.vx * self.ny

    def push(self, normal: float, along: float) -> None:
        """Drive the two sides apart by impulses (N s) along the normal and the tangent."""
        x, y = normal * self.nx - along * self.ny, normal * self.ny + along * self.nx
        a, b, m_a = self.a, self.b, self.pair.m_a
        if b is None:
            a.vx += x / m_a
            a.vy += y / m_a
            return
        m_b = self.pair.m_b
        a.vx -= x / m_a
        a.vy -= y / m_a
        b.vx += x / m_b
        b.vy += y / m_b

    def measure(self, ax: float, ay: float, bx: float, by: float) -> None:
        """Find the impulses by the velocities (m/s) of the balls before, and those now."""
        a, b, nx, ny, m_a = self.a, self.b, self.nx, self.ny, self.pair.m_a
        x, y = a.vx - ax, a.vy - ay
        self.normal, self.along_first = m_a * (x * nx + y * ny), m_a * (y * nx - x * ny)
        self.along = self.along_first
        if b is not None:
            x, y = b.vx - bx, b.vy - by
            self.normal, self.along = -self.normal, self.pair.m_b * (y * nx - x * ny)

    def set_impulses(self, normal: float, along: float) -> None:
        """Note impulses (N s) that push two balls by as much, in opposite directions."""
        self.normal, self.along = normal, along
        self.along_first = along if self.b is None else -along

    def is_same(self, other: Contact) -> bool:
        """Tell whether two contacts are of the same balls, and have the same normal."""
        is_of_same = self.a is other.a and self.b is other.b
        return is_of_same and self.nx * other.nx + self.ny * other.ny > 1.0 - SAME_NORMAL


def groups(contacts: list[Contact]) -> list[list[Contact]]:
    """Sort contacts into groups, so that two contacts that share a ball are in one group."""
    for one in contacts:
        if one.b is not None:
            p, q = one.a.root(), one.b.root()
            if p.ball.number < q.ball.number:
                q.first = p
            elif p is not q:
                p.first = q
    found: dict[int, list[Contact]] = {}
    for one in contacts:
        found.setdefault(one.a.root().ball.number, []).append(one)
    for one in contacts:  # Compiled code cannot free long chains of objects that are acyclic.
        for each in one.discs:
            each.first = None
    return list(found.values())
