"""Impacts in the plane: contact laws applied to the velocities of the balls that touch.

One contact is the law itself. Contacts that happen at one instant and share a ball are answered
together, so that the order in which balls are listed cannot matter:

- normal impulses J >= 0 are solved for at once, such that every contact leaves with -e times the
  speed it closed with (Newton's law of restitution for simultaneous impact; where the contacts
  are redundant, the smallest such impulses);
- then every contact takes its friction, min(mu J_n, m_eff |slip|), shared out where a ball has
  several contacts, so that no slip is reversed and energy cannot grow;
- contacts that close only because of this are a next impact at the same instant: a hit runs
  through a row of touching balls one after the other, as in Newton's cradle.

The law `published` depends on which ball is called A, so simultaneous contacts are answered as in
the listing: one after the other, cushions first, then pairs in the scene's order.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from pool_pymunk.contact import NT, Law, Pair, cushion, published, slips_by_rounding
from pool_pymunk.motion import Array, Vector

NO_BALL = -1


class Velocities(Protocol):
    """Velocities (m/s) by ball number: a list of all, or a dict of those that matter."""

    def __getitem__(self, i: int, /) -> Vector: ...

    def __setitem__(self, i: int, v: Vector, /) -> None: ...


class Touch(NamedTuple):
    """Ball ``a`` touches ball ``b`` (or a cushion: ``NO_BALL``, with its number).

    ``normal`` is the unit vector from a to b, or from the cushion into the table. Of ``pair``, a
    cushion uses ``m_a``, ``restitution`` and ``friction``.
    """

    a: int
    b: int
    normal: Vector
    pair: Pair
    cushion: int | None = None


def split(v: Vector, normal: Vector) -> NT:
    """A velocity along the normal and the tangent (-n_y, n_x).

    >>> split((3.0, 4.0), (0.0, 1.0))
    NT(n=4.0, t=-3.0)
    """
    nx, ny = normal
    return NT(v[0] * nx + v[1] * ny, v[1] * nx - v[0] * ny)


def changed(v: Vector, before: NT, after: NT, normal: Vector) -> Vector:
    """The velocity ``v`` with its parts changed; what the law leaves alone keeps every bit."""
    nx, ny = normal
    dn, dt = after.n - before.n, after.t - before.t
    return (v[0] + dn * nx - dt * ny, v[1] + dn * ny + dt * nx)


def closing_speed(touch: Touch, velocity: Velocities) -> float:
    """How fast (m/s) the two sides of a contact approach each other; negative: they part."""
    nx, ny = touch.normal
    ax, ay = velocity[touch.a]
    if touch.b == NO_BALL:
        return -(ax * nx + ay * ny)
    bx, by = velocity[touch.b]
    return (ax - bx) * nx + (ay - by) * ny


class Impacts:
    """Answers contacts by a law; ``zero_slips`` collects pairs whose slip was only rounding."""

    def __init__(self, law: Law) -> None:
        self.law = law
        self.zero_slips: list[tuple[int, int]] = []

    def answer(self, touches: Sequence[Touch], velocity: Velocities) -> None:
        """Change the velocities (m/s) of the balls in ``touches``, contacts of one instant."""
        for group in _groups(touches):
            if len(group) == 1:
                self._one(group[0], velocity)
            elif self.law is published:
                for touch in sorted(group, key=lambda touch: (touch.b != NO_BALL, touch[:2])):
                    if closing_speed(touch, velocity) > 0.0:
                        self._one(touch, velocity)
            else:
                _together(group, velocity)

    def _one(self, touch: Touch, velocity: Velocities) -> None:
        i, j, normal, pair, _ = touch
        a = split(velocity[i], normal)
        if j == NO_BALL:
            after = cushion(a, pair.restitution, pair.friction)
            velocity[i] = changed(velocity[i], a, after, normal)
            return
        b = split(velocity[j], normal)
        if self.law is published and pair.friction > 0.0 and slips_by_rounding(a, b):
            self.zero_slips.append((i, j))
            pair = pair._replace(friction=0.0)
        new_a, new_b = self.law(a, b, pair)
        velocity[i] = changed(velocity[i], a, new_a, normal)
        velocity[j] = changed(velocity[j], b, new_b, normal)


def _groups(touches: Sequence[Touch]) -> Iterator[list[Touch]]:
    """The contacts in groups that share balls."""
    left = list(touches)
    while left:
        group = [left.pop()]
        balls = set(_balls(group[0]))
        grown = True
        while grown:
            joined = [touch for touch in left if balls.intersection(_balls(touch))]
            left = [touch for touch in left if touch not in joined]
            group += joined
            balls.update(ball for touch in joined for ball in _balls(touch))
            grown = bool(joined)
        yield group


def _balls(touch: Touch) -> tuple[int, ...]:
    return (touch.a,) if touch.b == NO_BALL else (touch.a, touch.b)


def _together(group: Sequence[Touch], velocity: Velocities) -> None:
    """Normal impulses at once, then friction at every contact."""
    wanted = np.array(
        [(1.0 + touch.pair.restitution) * closing_speed(touch, velocity) for touch in group]
    )
    impulses = _normal_impulses(_response(group), wanted).tolist()
    for touch, j_n in zip(group, impulses, strict=True):
        nx, ny = touch.normal
        _push(touch, (j_n * nx, j_n * ny), velocity)
    contacts = {i: sum(i in _balls(touch) for touch in group) for i in _all_balls(group)}
    slips = [_slip(touch, velocity) for touch in group]
    for touch, j_n, slip in zip(group, impulses, slips, strict=True):
        share = max(contacts[i] for i in _balls(touch))
        j_t = min(touch.pair.friction * j_n, abs(slip) / (share * _inverse_mass(touch)))
        j_t = j_t if slip > 0.0 else -j_t
        nx, ny = touch.normal
        _push(touch, (-j_t * ny, j_t * nx), velocity)


def _all_balls(group: Iterable[Touch]) -> set[int]:
    return {i for touch in group for i in _balls(touch)}


def _inverse_mass(touch: Touch) -> float:
    """1 / m_eff (1/kg)."""
    return 1.0 / touch.pair.m_a + (0.0 if touch.b == NO_BALL else 1.0 / touch.pair.m_b)


def _sides(touch: Touch) -> Iterator[tuple[int, float, float]]:
    """Each ball of a contact, its mass, and the sign with which an impulse along n acts on it."""
    if touch.b == NO_BALL:
        yield touch.a, touch.pair.m_a, 1.0
    else:
        yield touch.a, touch.pair.m_a, -1.0
        yield touch.b, touch.pair.m_b, 1.0


def _push(touch: Touch, impulse: Vector, velocity: Velocities) -> None:
    """Apply an impulse (kg m/s): to B and its opposite to A, or from the cushion to its ball."""
    jx, jy = impulse
    for i, mass, sign in _sides(touch):
        vx, vy = velocity[i]
        velocity[i] = (vx + sign * jx / mass, vy + sign * jy / mass)


def _slip(touch: Touch, velocity: Velocities) -> float:
    """Tangential speed (m/s) that friction acts on: of A past B; negated, of a ball on a cushion."""
    a = split(velocity[touch.a], touch.normal).t
    return -a if touch.b == NO_BALL else a - split(velocity[touch.b], touch.normal).t


def _response(group: Sequence[Touch]) -> Array:
    """G[k, l]: by how much a unit normal impulse at contact l opens contact k (1/kg)."""
    response = np.zeros((len(group), len(group)))
    for k, one in enumerate(group):
        for m, other in enumerate(group):
            turn = one.normal[0] * other.normal[0] + one.normal[1] * other.normal[1]
            for ball, mass, sign in _sides(one):
                for also, _, other_sign in _sides(other):
                    if also == ball:
                        response[k, m] += sign * other_sign * turn / mass
    return response


def _normal_impulses(response: Array, wanted: Array) -> Array:
    """J >= 0 (kg m/s) with response J = wanted on the contacts that push at all."""
    impulses = np.zeros(len(wanted))
    pushing = np.arange(len(wanted))
    while len(pushing):
        part = response[np.ix_(pushing, pushing)]
        solved = np.linalg.lstsq(part, wanted[pushing], rcond=1e-12)[0]
        if (solved >= 0.0).all():
            impulses[pushing] = solved
            break
        pushing = pushing[solved > 0.0]
    return impulses
