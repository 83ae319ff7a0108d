"""This module tells on which sides of a kink a contact lies, and how its law answers there.

A law has a kink where it changes from one branch to another, as from sticking to slipping. Rounding
may put a contact on either side. So the law is also asked a little beside the contact. Python asks
an object for its answers and slopes, and numba asks the laws that it knows by their numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pool_pymunk.physics.columns import is_of_errors
from pool_pymunk.physics.contact import NT, Pair
from pool_pymunk.physics.dual import by_duals, slopes_of
from pool_pymunk.physics.laws import balls_after, cushion_after, jumps_at
from pool_pymunk.physics.motion import EPSILON

# A law is also asked at velocities that are off by this share of the speeds. Splitting a velocity
# along the normal takes a dozen roundings, and the velocity itself comes from dozens more.
BESIDE = 256.0 * EPSILON
# At velocities this many times as far off the law gives only its answer, at little cost. A kink
# bends that answer by WIDE BESIDE = 4e-12 of the speeds, far more than `STRAIGHT`.
WIDE = 64.0
STRAIGHT = 64.0 * EPSILON  # of the speeds; answers that bend by less do so by rounding
# Answers on both sides that differ by less than this share are equal. They differ by `BESIDE` at a
# kink, 6e-14, and by a finite share where a law jumps.
SAME = 1e-6


def hit_slopes(law: Any, a: NT, b: NT, pair: Pair, rows: Any) -> None:
    """Write the derivatives (4, 8) of the answer to a hit into ``rows``."""
    _slopes(law, law.ball_ball, (a, b, pair), rows)


def bounce_slopes(law: Any, v: NT, restitution: float, friction: float, rows: Any) -> None:
    """Write the derivatives (2, 4) of the answer to a hit on a cushion into ``rows``."""
    _slopes(law, law.cushion, (v, restitution, friction), rows)


def _slopes(law: Any, method: Any, asked: tuple[Any, ...], rows: Any) -> None:
    known = slopes_of(method)
    if known is not None:
        known(*asked, rows)
        return
    found = by_duals(method, asked)
    for row, slopes in zip(rows, found, strict=False):
        row[: len(slopes)] = slopes


def ask(law: Any, x: Any, balls: int, found: Any) -> None:
    """Write a law's answer into ``found``: a_n, a_t, b_n and b_t, or v_n and v_t of one ball.

    It is asked with ``x``: the same before the contact, and a pair, or the restitution and the
    friction of a cushion.
    """
    if balls == 2:
        pair = Pair(x[4], x[5], x[6], x[7])
        a, b = balls_after(law, NT(x[0], x[1]), NT(x[2], x[3]), pair)
        found[0], found[1], found[2], found[3] = a.n, a.t, b.n, b.t
    else:
        v = cushion_after(law, NT(x[0], x[1]), x[2], x[3])
        found[0], found[1] = v.n, v.t


def write_slopes(law: Any, x: Any, balls: int, rows: Any) -> None:
    """Write the derivatives (2 C, K) of a law's answer by the K numbers of ``x`` into ``rows``."""
    if balls == 2:
        pair = Pair(x[4], x[5], x[6], x[7])
        hit_slopes(law, NT(x[0], x[1]), NT(x[2], x[3]), pair, rows)
    else:
        bounce_slopes(law, NT(x[0], x[1]), x[2], x[3], rows)


def law_sides(g: Any, balls: int, moves_a: bool, moves_b: bool, fastest: float) -> int:
    """Write the law's derivatives on S sides of a contact into ``slopes`` (S, 4, 8); return S.

    The law is ``asked`` at the contact. The sides lie within rounding of it, and there is one where
    the law has no kink. ``moves_a`` and ``moves_b`` tell whether inputs change a_t, and b_t: a law
    may jump where a tangential velocity is zero, as that of a resting ball is. ``fastest`` (m/s) is
    the largest speed in the contact. The answer is 0 where the law jumps.
    """
    x, law, count = g.one.asked, g.law, 2 * balls
    t_b = x[3] if balls == 2 else 0.0
    if balls == 2:
        pair = Pair(x[4], x[5], x[6], x[7])
        if jumps_at(law, NT(x[0], x[1]), NT(x[2], x[3]), pair):
            return 0
    size = 0.0
    for k in range(count):
        size = max(size, abs(x[k]))
    step, slip, most = BESIDE * max(fastest, size), x[1] - t_b, size
    for k in range(count, 2 * count):
        most = max(most, abs(x[k]))
    # What makes the slip smaller is tried, with a larger or smaller closing speed.
    closer = step if balls == 2 else -step
    less_a = math.copysign(step, -slip) if moves_a else 0.0
    less_b = math.copysign(step, slip) if moves_b and not moves_a else 0.0
    turns = (moves_a and min(abs(slip), abs(x[1])) <= WIDE * step) or (
        moves_b and min(abs(slip), abs(t_b)) <= WIDE * step
    )
    wide = WIDE * closer, WIDE * less_a, WIDE * less_b
    if not turns and (is_of_errors(g) or bend(g, balls, wide) <= STRAIGHT * most):
        write_slopes(law, x, balls, g.one.slopes[0])
        return 1
    sides = 0
    for direction in range(2 if moves_a and moves_b and abs(t_b) <= step < abs(slip) else 1):
        for sign in (1.0, -1.0):
            if direction == 0:
                step_to(g, balls, (sign * closer, sign * less_a, sign * less_b))
            else:
                step_to(g, balls, (0.0, 0.0, sign * step))
            ask(law, g.one.beside, balls, g.one.answers[sides])
            write_slopes(law, g.one.beside, balls, g.one.slopes[sides])
            sides += 1
    for side in range(1, sides):
        for k in range(count):
            if not abs(g.one.answers[side][k] - g.one.answers[0][k]) <= SAME * most:
                return 0
    return sides


def step_to(g: Any, balls: int, steps: Sequence[float]) -> None:
    """Write what the law is asked beside a contact: a_n, a_t and b_t are other by ``steps``."""
    for k in range(4 * balls):
        g.one.beside[k] = g.one.asked[k]
    g.one.beside[0] += steps[0]
    g.one.beside[1] += steps[1]
    if balls == 2:
        g.one.beside[3] += steps[2]


def bend(g: Any, balls: int, steps: Sequence[float]) -> float:
    """Return how far (m/s) the law's answers on either side and at the contact are from a line."""
    step_to(g, balls, steps)
    ask(g.law, g.one.beside, balls, g.one.answers[0])
    step_to(g, balls, (-steps[0], -steps[1], -steps[2]))
    ask(g.law, g.one.beside, balls, g.one.answers[1])
    ask(g.law, g.one.asked, balls, g.one.answers[2])
    most = 0.0
    for k in range(2 * balls):
        most = max(most, abs(g.one.answers[0][k] - 2.0 * g.one.answers[2][k] + g.one.answers[1][k]))
    return most
