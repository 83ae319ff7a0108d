"""Two contacts that share a ball may hit in turn without end; their limit has a closed form.

A light ball between a heavy one and a cushion is the usual case. Let x and y be the closing speeds
of contact A, which closes, and of contact B, which parts. A hit of A and then one of B change them
linearly, because restitution is linear and friction is mu J_n as long as the balls slip:

    z = y + g_ba x,   x' = -e_a x + g_ab z,   y' = -e_b z.

If this map has two real positive eigenvalues, and x has a positive share of the larger one, then x
stays positive for ever: the hits have no end, and in their limit no contact closes any more. The
impulses of all hits together are then the solution of two linear equations. If the eigenvalues are
complex, the hits come to an end, and have to be played.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pool_pymunk.physics.contact import (
    NO_BALL,
    Contact,
    Vector,
    Velocities,
    closing_speed,
    split,
)

STILL = 1e-15  # A slip below this share of the closing speeds counts as none.


class Push(NamedTuple):
    """A push holds the velocity (m/s) that a unit impulse at a contact gives to its balls."""

    a: Vector
    b: Vector


def limit_of_two(first: Contact, second: Contact, velocity: Velocities) -> bool:
    """Give two contacts the limit of their hits without end: change ``velocity`` (m/s).

    Returns False, with nothing done, if the hits have an end, or if friction changes its direction
    on the way.

    >>> from pool_pymunk.physics.contact import Pair
    >>> squeezed = Contact(0, 1, (-1.0, 0.0), Pair(1e3, 1.0, 0.5, 0.0))
    >>> cushion = Contact(1, NO_BALL, (1.0, 0.0), Pair(1.0, math.inf, 0.5, 0.0))
    >>> velocity = {0: (-1.0, 0.0), 1: (0.0, 0.0)}
    >>> limit_of_two(squeezed, cushion, velocity), [round(v[0], 12) for v in velocity.values()]
    (True, [0.0, 0.0])
    """
    a, b = (first, second) if closing_speed(first, velocity) > 0.0 else (second, first)
    x, y = closing_speed(a, velocity), closing_speed(b, velocity)
    push_a, push_b = _push(a, velocity), _push(b, velocity)
    g_aa, g_ab = _opens(a, a, push_a), _opens(a, b, push_b)
    g_ba, g_bb = _opens(b, a, push_a), _opens(b, b, push_b)
    if not _is_endless(a, b, (x, y), (-g_ab / g_bb, -g_ba / g_aa)):
        return False
    determinant = g_aa * g_bb - g_ab * g_ba
    after = {i: velocity[i] for i in {*a.balls, *b.balls}}
    _apply(a, push_a, (x * g_bb - y * g_ab) / determinant, after)
    _apply(b, push_b, (y * g_aa - x * g_ba) / determinant, after)
    speed = max(math.hypot(*velocity[i]) for i in after)
    if any(_turned(contact, velocity, after, speed) for contact in (a, b)):
        return False
    for i, v in after.items():
        velocity[i] = v
    return True


def _is_endless(a: Contact, b: Contact, speeds: Vector, drives: Vector) -> bool:
    """Tell whether hits of A and B in turn have no end, by the eigenvalues of two hits."""
    (x, y), (drive_a, drive_b) = speeds, drives
    e_a, e_b = a.pair.restitution, b.pair.restitution
    g_ab, g_ba = (1.0 + e_b) * drive_a, (1.0 + e_a) * drive_b
    trace, product = g_ab * g_ba - e_a - e_b, e_a * e_b
    discriminant = trace * trace - 4.0 * product
    if x <= 0.0 or trace <= 0.0 or discriminant <= 0.0:
        return False
    larger = (trace + math.sqrt(discriminant)) / 2.0
    smaller = product / larger
    z = y + g_ba * x
    return z > 0.0 and larger < 1.0 and g_ab * z - e_a * x > smaller * x


def _push(contact: Contact, velocity: Velocities) -> Push:
    """Return what a unit normal impulse does, with the friction of a contact that slips."""
    (nx, ny), pair = contact.normal, contact.pair
    rub = pair.friction * _direction(contact, velocity)
    px, py = nx - rub * ny, ny + rub * nx
    if contact.b == NO_BALL:
        return Push((px / pair.m_a, py / pair.m_a), (0.0, 0.0))
    return Push((-px / pair.m_a, -py / pair.m_a), (px / pair.m_b, py / pair.m_b))


def _direction(contact: Contact, velocity: Velocities) -> float:
    """Return in which direction friction pushes along the tangent: 1, -1, or 0 without slip."""
    slip = _slip(contact, velocity)
    return math.copysign(1.0, slip) if slip != 0.0 else 0.0


def _slip(contact: Contact, velocity: Velocities) -> float:
    """Return the slip (m/s) of A past B, or of a cushion past its ball."""
    a = split(velocity[contact.a], contact.normal).t
    return -a if contact.b == NO_BALL else a - split(velocity[contact.b], contact.normal).t


def _opens(contact: Contact, other: Contact, push: Push) -> float:
    """Return by how much (m/s) a push at another contact opens this one."""
    pushed: dict[int, Vector] = dict.fromkeys(contact.balls, (0.0, 0.0))
    pushed |= dict(zip(other.balls, push, strict=False))
    return -closing_speed(contact, pushed)


def _apply(contact: Contact, push: Push, impulse: float, velocity: Velocities) -> None:
    for i, (px, py) in zip(contact.balls, push, strict=False):
        vx, vy = velocity[i]
        velocity[i] = (vx + impulse * px, vy + impulse * py)


def _turned(contact: Contact, before: Velocities, after: Velocities, speed: float) -> bool:
    """Tell whether friction would have changed its direction on the way."""
    old, new = _slip(contact, before), _slip(contact, after)
    if contact.pair.friction == 0.0:
        return False
    return abs(new) > STILL * speed if abs(old) <= STILL * speed else old * new < 0.0
