"""Bounces that are left out when two sides begin to stay in contact have an effect of first order.

A ball that rolls slips after each hit, and rolling resistance does not act meanwhile. While sides
bounce ever lower, it therefore acts for a share of the time only. What else the bounces do is of
second order in their speed.
"""

from __future__ import annotations

import math

from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import Vector, length_of
from pool_pymunk.core.persistent.member import FREE, ROLL, SHARE, Member
from pool_pymunk.core.persistent.touch import Touch


def count_bounces(one: Touch, parting: float) -> None:
    """Give balls what they have by their bounces, beyond what contact gives them meanwhile.

    The sides part at a speed (m/s), or close if it is negative, and have the forces by which they
    stay in contact. Each hit at a closing speed c lets a ball slip for a time that is proportional
    to c, and the next one closes at r c. So all slips last 1 / (1 - r) times as long as the first.
    Where e is 0, nothing bounces, and hits count as they come (``Member.fade``).
    """
    e, press = one.pair.restitution, one.press_on
    if press <= 0.0 or e == 1.0 or e == 0.0:
        return
    a, b = one.a, one.b
    slip_a, slip_b = slip_after(one, a), (0.0, 0.0) if b is None else slip_after(one, b)
    if slip_a == slip_b == (0.0, 0.0):
        return
    ratio = next_closing(one, press, slip_a, slip_b)
    closing = -parting
    if parting > 0.0:  # It has hit already, at parting / e.
        closing = ratio * parting / e
    hits = closing / (1.0 - ratio) if ratio < 1.0 else 0.0
    a.spare_drag(slip_time(a, slip_a) * hits)
    if b is not None:
        b.spare_drag(slip_time(b, slip_b) * hits)
    elif one.wrings:
        one.rub(missed(one) * hits)


def time_of_bounces(one: Touch, parting: float) -> float:
    """Return how long (s) sides bounce that part at a speed (m/s), or close if it is negative.

    Each bounce takes 2 v / press, and the next one parts at e v. Only a ball that falls, or moves
    on a surface of a user's own, rests when its bounces end; elsewhere friction takes longer.
    """
    e, press = one.pair.restitution, one.press_on
    if one.a.phase != FREE or press <= 0.0 or e == 1.0:
        return 0.0
    return 2.0 * max(parting, -e * parting) / (press * (1.0 - e))


def missed(one: Touch) -> float:
    """Return the impulse (N s) of a hit of a ball that rolls, beyond that of contact, for each m/s.

    Friction of a cushion on the roll takes part in a hit, and in contact, until there is none. A
    hit at a speed c takes 5/2 mu (1 + e) c of it, and contact 5/2 mu N / m of the 7/5 of the ball's
    acceleration. So where mu (1 + e) > 2/5, hits have to be harder than N is.
    """
    e, held = one.pair.restitution, min(one.mu, GYRATION)
    by_hits = min(one.mu, GYRATION / (1.0 + e))
    return one.a.mass * (1.0 + e) * (held - by_hits) / (1.0 + held)


def slip_after(one: Touch, each: Member) -> Vector:
    """Return the slip of a ball that rolls after a hit, for each m/s of the closing speed.

    It is that along the normal and that along the tangent. The hit changes its velocity by
    (1 + e) m / m_a (m: the reduced mass), and mu times that across if the sides slip. A cushion
    also slows the roll into it, by 5/2 mu of that, up to all of it.
    """
    if each.phase != ROLL or each.pull == 0.0:
        return 0.0, 0.0
    slip = (1.0 + one.pair.restitution) * one.unit / each.mass
    across = one.mu * slip if one.slides != 0.0 else 0.0
    if one.wrings:
        slip -= min(one.mu * slip / GYRATION, 1.0)
    return slip, across


def slip_time(each: Member, slip: Vector) -> float:
    """Return how long (s) a slip u (m/s) lasts: 2 |u| / (7 pull)."""
    return SHARE * length_of(*slip) / each.pull if slip != (0.0, 0.0) else 0.0


def next_closing(one: Touch, press: float, slip_a: Vector, slip_b: Vector) -> float:
    """Return the closing speed of the next hit, as a share of that of the last one.

    The sides part at e times the last one, and ``press`` pulls them together (m/s^2). As long as a
    ball slips, the friction of the surface does so, too, in place of rolling resistance.
    """
    a, b, side = one.a, one.b, 1.0 if one.b is None else -1.0
    time_a, time_b = slip_time(a, slip_a), 0.0 if b is None else slip_time(b, slip_b)
    pull_a = gain(a, slip_a, side * (a.hx * one.nx + a.hy * one.ny))
    pull_b = 0.0 if b is None else gain(b, slip_b, b.hx * one.nx + b.hy * one.ny)
    both = press + pull_a + pull_b
    if time_a < time_b:
        spans = [(both, time_a), (press + pull_b, time_b - time_a)]
    else:
        spans = [(both, time_b), (press + pull_a, time_a - time_b)]
    return return_speed(one.pair.restitution, spans, press)


def gain(each: Member, slip: Vector, along: float) -> float:
    """Return how much more (m/s^2) a ball is pressed on while it slips.

    Rolling resistance has the direction of its motion, of which ``along`` is the part along the
    normal.
    """
    size = length_of(*slip)
    return each.pull * slip[0] / size - each.drag * along if size > 0.0 else 0.0


def return_speed(parting: float, spans: list[tuple[float, float]], press: float) -> float:
    """Return the speed (m/s) at which sides close again that part at another one.

    Accelerations (m/s^2) drive them together for some spans of time (s), and then ``press`` does.

    >>> return_speed(1.0, [(2.0, 0.0)], 2.0), round(return_speed(1.0, [(4.0, 0.25)], 2.0), 4)
    (1.0, 0.7071)
    """
    gap = 0.0
    for pull, span in spans:
        back = (parting + math.sqrt(parting * parting + 2.0 * pull * gap)) / pull
        if back <= span:
            return pull * back - parting
        gap += span * (parting - pull * span / 2.0)
        parting -= pull * span
    return math.sqrt(parting * parting + 2.0 * press * gap)
