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

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.contact import NT, Law, Pair, cushion, published, slips_by_rounding
from pool_pymunk.motion import Array, Vector

NO_BALL = -1
SAME_NORMAL = 1e-12
ROUNDING = 64.0 * 2.0**-52
MOST_EXCHANGES = 10  # for each contact
NOTHING = 1e-14


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

    @property
    def balls(self) -> tuple[int, ...]:
        """The balls of the contact, one or two."""
        return (self.a,) if self.b == NO_BALL else (self.a, self.b)


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
                for touch in sorted(group, key=_as_listed):
                    if closing_speed(touch, velocity) > 0.0:
                        self._one(touch, velocity)
            else:
                _together(group, velocity)

    def settle(self, touches: Sequence[Touch], velocity: Velocities) -> None:
        """The limit of hits without end: no contact closes any more (plastic, no friction)."""
        for group in _groups(touches):
            _push_normally(group, [closing_speed(touch, velocity) for touch in group], velocity)

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


def distinct(touches: Iterable[Touch]) -> list[Touch]:
    """The touches without those that say the same twice, as two cushions at a common corner do."""
    kept: list[Touch] = []
    for touch in touches:
        if not any(_same(touch, other) for other in kept):
            kept.append(touch)
    return kept


def _same(one: Touch, other: Touch) -> bool:
    turn = one.normal[0] * other.normal[0] + one.normal[1] * other.normal[1]
    return (one.a, one.b) == (other.a, other.b) and turn > 1.0 - SAME_NORMAL


def _groups(touches: Sequence[Touch]) -> Iterator[list[Touch]]:
    """The contacts in groups that share balls."""
    left = list(touches)
    while left:
        group = [left.pop()]
        balls = set(group[0].balls)
        grown = True
        while grown:
            joined = [touch for touch in left if balls.intersection(touch.balls)]
            left = [touch for touch in left if touch not in joined]
            group += joined
            balls.update(ball for touch in joined for ball in touch.balls)
            grown = bool(joined)
        yield group


def _as_listed(touch: Touch) -> tuple[bool, int, int, bool]:
    """The listing's order: cushions first, those across x before those across y; then pairs."""
    nx, ny = touch.normal
    return touch.b != NO_BALL, touch.a, touch.b, abs(nx) < abs(ny)


def _together(group: Sequence[Touch], velocity: Velocities) -> None:
    """Normal impulses at once, then friction at every contact that pushes."""
    wanted = [(1.0 + touch.pair.restitution) * closing_speed(touch, velocity) for touch in group]
    impulses = _push_normally(group, wanted, velocity)
    pushing = [touch for touch, j_n in zip(group, impulses, strict=True) if j_n > 0.0]
    shares = Counter(i for touch in pushing for i in touch.balls)
    slips = [_slip(touch, velocity) for touch in group]
    for touch, j_n, slip in zip(group, impulses, slips, strict=True):
        share = max(shares[i] for i in touch.balls)
        j_t = min(touch.pair.friction * j_n, abs(slip) / (max(share, 1) * _inverse_mass(touch)))
        nx, ny = touch.normal
        _push(touch, (-math.copysign(j_t, slip) * ny, math.copysign(j_t, slip) * nx), velocity)


def _push_normally(
    group: Sequence[Touch], wanted: Sequence[float], velocity: Velocities
) -> list[float]:
    """Open every contact by what is wanted (m/s) or more; returns the impulses (kg m/s)."""
    impulses: list[float] = _normal_impulses(_response(group), np.array(wanted)).tolist()
    for touch, j_n in zip(group, impulses, strict=True):
        nx, ny = touch.normal
        _push(touch, (j_n * nx, j_n * ny), velocity)
    return impulses


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
    """Slip (m/s) that friction acts on: of A past B; of a cushion past its ball."""
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
    """The impulses J >= 0 (kg m/s) that open every contact by ``wanted`` (m/s) or more.

    A contact that pushes opens by just that: J (response J - wanted) = 0, a linear
    complementarity problem. It is solved in units in which each contact's own response is 1, as
    masses may differ widely.
    """
    unit = np.sqrt(response.diagonal())
    impulses: Array = _complementary(response / np.outer(unit, unit), wanted / unit) / unit
    return impulses


def _complementary(response: Array, wanted: Array) -> Array:
    """All contacts that are wrong change sides at once, so that their order does not matter.

    Where this goes in circles, they do so one by one.
    """
    pushing = wanted > 0.0
    for _ in range(len(wanted) + 1):
        impulses = _pushed(response, wanted, pushing)
        lacking = wanted - response @ impulses
        slack = _slack(response, wanted, impulses)
        wrong = np.where(pushing, (impulses < 0.0) | (lacking < -slack), lacking > slack)
        if not wrong.any():
            return impulses
        pushing ^= wrong
    return _one_by_one(response, wanted)


def _pushed(response: Array, wanted: Array, pushing: NDArray[np.bool_]) -> Array:
    """The (smallest) impulses of the pushing contacts that open these by what is wanted."""
    impulses = np.zeros(len(wanted))
    part = response[np.ix_(pushing, pushing)]
    impulses[pushing] = np.linalg.lstsq(part, wanted[pushing], rcond=1e-12)[0]
    return impulses


def _slack(response: Array, wanted: Array, impulses: Array) -> float:
    """What an opening speed (m/s) may lack by rounding."""
    pushed = np.abs(response) @ np.abs(impulses)
    return float(1e-12 * np.abs(wanted).max() + ROUNDING * pushed.max())


def _one_by_one(response: Array, wanted: Array) -> Array:
    """The same by an active set (Lawson and Hanson, 1974, for non-negative least squares).

    Every exchange lowers the energy J response J / 2 - wanted J. Should rounding keep it from an
    end, contacts that still close are a next impact.
    """
    impulses = np.zeros(len(wanted))
    pushing = np.zeros(len(wanted), dtype=bool)
    for _ in range(MOST_EXCHANGES * len(wanted)):
        lacking = np.where(pushing, 0.0, wanted - response @ impulses)
        if lacking.max() <= _slack(response, wanted, impulses):
            break
        pushing[lacking.argmax()] = True
        impulses = _towards(impulses, response, wanted, pushing)
    return impulses


def _towards(impulses: Array, response: Array, wanted: Array, pushing: NDArray[np.bool_]) -> Array:
    """Go to the impulses of the pushing contacts; who would have to pull drops out on the way."""
    while True:
        target = _pushed(response, wanted, pushing)
        pulls = pushing & (target <= 0.0)
        if not pulls.any():
            return target
        share = (impulses[pulls] / (impulses[pulls] - target[pulls])).min()
        impulses = impulses + share * (target - impulses)
        pushing &= impulses > NOTHING * impulses.max()
        impulses[~pushing] = 0.0
