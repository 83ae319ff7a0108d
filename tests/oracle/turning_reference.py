"""This is an independent reference for one ball between walls that turn, move and stand.

It shares nothing with the core. Vectors are complex numbers. The gaps to all walls are looked at in
steps in which none of them can close, and where one of them changes its sign, its root is closed in
by bisection. The law is "coulomb". What is refused: grazes, contacts of several walls at one
instant, contacts that persist, and more than fifty contacts.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from tests.oracle.reference import Refused

LEAST = 1e-6  # s; no look ahead is shorter
GRAZE = 1e-7  # m; a gap that turns below this one is refused
APART = 1e-7  # s; contacts that follow sooner are refused
MOST = 50  # contacts


@dataclass(frozen=True)
class Bar:
    """A bar is a convex polygon, a line or a point, with a radius around its corners (m).

    They are given around ``place`` (m), which moves with a velocity (m/s) while the bar ``turns``
    (rad/s) from an angle. A ball is hit with a restitution and friction.
    """

    corners: tuple[complex, ...]
    radius: float
    place: complex
    angle: float
    velocity: complex
    turns: float
    restitution: float
    friction: float

    @property
    def size(self) -> float:
        """The distance (m) of the farthest corner."""
        return max(map(abs, self.corners))

    def beside(self, t: float, at: complex) -> tuple[float, complex, complex]:
        """Return how far (m) a place is from the bar, the normal, and the bar's velocity there."""
        turned = cmath.exp(1j * (self.angle + self.turns * t))
        z = (at - self.place - self.velocity * t) / turned
        ring = [*self.corners, self.corners[0]] if len(self.corners) > 2 else self.corners
        near = [nearest(a, b, z) for a, b in pairwise(ring)] or [self.corners[0]]
        best = min(near, key=lambda each: abs(z - each))
        is_inside = len(self.corners) > 2 and all(
            cross(b - a, z - a) > 0 for a, b in pairwise(ring)
        )
        far = -abs(z - best) if is_inside else abs(z - best)
        normal = (z - best) / far
        spot = best + self.radius * normal
        return far - self.radius, normal * turned, self.velocity + 1j * self.turns * spot * turned


@dataclass(frozen=True)
class Ball:
    """A ball is at a place (m) with a velocity (m/s) at ``since`` (s), and slows down (m/s^2)."""

    since: float
    place: complex
    velocity: complex
    slows: float

    def at(self, t: float) -> tuple[complex, complex]:
        """Return its place (m) and its velocity (m/s) at a time (s)."""
        speed = abs(self.velocity)
        if speed == 0.0:
            return self.place, 0j
        unit, time = self.velocity / speed, t - self.since
        if self.slows > 0.0:
            time = min(time, speed / self.slows)
        left = speed - self.slows * time
        return self.place + unit * time * (speed + left) / 2.0, unit * left


@dataclass(frozen=True)
class Played:
    """What came of it: when (s) the ball hit which bars, and its place (m) at the end."""

    hits: tuple[tuple[float, int], ...]
    end: complex


def cross(a: complex, b: complex) -> float:
    """Return the cross product."""
    return (a.conjugate() * b).imag


def nearest(a: complex, b: complex, z: complex) -> complex:
    """Return the point between two others that is nearest to a third one."""
    along = b - a
    share = ((z - a) * along.conjugate()).real / abs(along) ** 2
    return a + min(max(share, 0.0), 1.0) * along


def play(bars: Sequence[Bar], ball: Ball, radius: float, until: float) -> Played:
    """Let a ball of this radius (m) fly until a time (s)."""
    hits, t = list[tuple[float, int]](), ball.since
    while (found := first(bars, ball, radius, t, until)) is not None:
        t, k = found
        hits.append((t, k))
        if len(hits) > MOST:
            raise Refused("too many contacts")
        ball = answered(bars[k], ball, t)
        t += APART
        if min(gaps(bars, ball, radius, t)) <= 0.0:
            raise Refused("a contact persists")
    return Played(tuple(hits), ball.at(until)[0])


def gaps(bars: Sequence[Bar], ball: Ball, radius: float, t: float) -> list[float]:
    """Return the gaps (m) to all bars at a time (s)."""
    place, _ = ball.at(t)
    return [bar.beside(t, place)[0] - radius for bar in bars]


def first(
    bars: Sequence[Bar], ball: Ball, radius: float, t: float, until: float
) -> tuple[float, int] | None:
    """Return when (s) a ball hits the first bar, and which."""
    fastest = [abs(ball.velocity) + abs(b.velocity) + abs(b.turns) * (b.size + 1.0) for b in bars]
    before, falls = gaps(bars, ball, radius, t), [False] * len(bars)
    while t < until:
        h = min(gap / fast for gap, fast in zip(before, fastest, strict=True) if fast > 0.0)
        later = min(t + max(h, LEAST), until)
        now = gaps(bars, ball, radius, later)
        if (closed := [k for k, gap in enumerate(now) if gap <= 0.0]) != []:
            if len(closed) > 1:
                raise Refused("two contacts of one instant")
            return root(bars, ball, radius, (t, later), closed[0]), closed[0]
        for k, gap in enumerate(now):
            if falls[k] and gap > before[k] and before[k] < GRAZE:
                raise Refused("a graze")
            falls[k] = gap < before[k]
        before, t = now, later
    return None


def root(
    bars: Sequence[Bar], ball: Ball, radius: float, between: tuple[float, float], k: int
) -> float:
    """Return when (s) the gap to a bar changes its sign."""
    low, high = between
    while low < (middle := (low + high) / 2.0) < high:
        if gaps(bars, ball, radius, middle)[k] > 0.0:
            low = middle
        else:
            high = middle
    return high


def answered(bar: Bar, ball: Ball, t: float) -> Ball:
    """Return a ball after its hit on a bar: v_n' = -e v_n, and v_t loses mu |v_n' - v_n|."""
    place, velocity = ball.at(t)
    _, normal, moves = bar.beside(t, place)
    along = (velocity - moves) / normal  # its parts along the normal and the tangent
    bounced = -bar.restitution * along.real
    loss = min(bar.friction * (bounced - along.real), abs(along.imag))
    left = along.imag - (loss if along.imag > 0.0 else -loss)
    return Ball(t, place, moves + complex(bounced, left) * normal, ball.slows)
