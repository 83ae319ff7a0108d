"""This module differentiates contact laws.

The slopes of the package's own laws are written down. Another law is differentiated by dual
numbers, through its own functions. A dual number is a number with its derivatives by some inputs.
Sums and products of dual numbers follow the rules of differentiation, so a law that is asked with
dual numbers answers with its exact Jacobian (forward accumulation: Griewank and Walther, Evaluating
Derivatives, SIAM 2008, ch. 3).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any, NoReturn

import numpy as np

from pool_pymunk.physics.contact import NT, Pair
from pool_pymunk.physics.laws import Law, Published, cushion, published
from pool_pymunk.physics.motion import EPSILON, Array

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

Slopes = tuple[float, ...]
Answer = Callable[[Sequence[Any]], tuple[Any, ...]]
Steps = Sequence[float]


class Dual:
    """A dual number is a ``value`` with its derivatives by the inputs, the ``slopes``.

    It knows sums, differences, products, quotients, powers, ``abs``, ``min``, ``max``, comparisons,
    and whether it is zero. Functions of the module ``math`` raise TypeError.

    >>> x, y = Dual(3.0, (1.0, 0.0)), Dual(2.0, (0.0, 1.0))
    >>> (x * x - 2.0 * y).slopes, (x / y).slopes
    ((6.0, -2.0), (0.5, -0.75))
    """

    __slots__ = ("slopes", "value")

    def __init__(self, value: float, slopes: Slopes) -> None:
        self.value = value
        self.slopes = slopes

    def __repr__(self) -> str:
        return f"Dual({self.value!r}, {self.slopes!r})"

    def __add__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            slopes = tuple([a + b for a, b in zip(self.slopes, other.slopes, strict=True)])
            return Dual(self.value + other.value, slopes)
        return Dual(self.value + other, self.slopes)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, tuple([-a for a in self.slopes]))

    def __sub__(self, other: Dual | float) -> Dual:
        return self + -other

    def __rsub__(self, other: float) -> Dual:
        return -self + other

    def __mul__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            x, y = self.value, other.value
            both = zip(self.slopes, other.slopes, strict=True)
            return Dual(x * y, tuple([a * y + x * b for a, b in both]))
        return Dual(self.value * other, tuple([a * other for a in self.slopes]))

    __rmul__ = __mul__

    def __truediv__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            quotient, y = self.value / other.value, other.value
            both = zip(self.slopes, other.slopes, strict=True)
            return Dual(quotient, tuple([(a - quotient * b) / y for a, b in both]))
        return Dual(self.value / other, tuple([a / other for a in self.slopes]))

    def __rtruediv__(self, other: float) -> Dual:
        return Dual(other, (0.0,) * len(self.slopes)) / self

    def __pow__(self, power: float) -> Dual:
        slope = power * self.value ** (power - 1.0)
        return Dual(self.value**power, tuple([a * slope for a in self.slopes]))

    def __pos__(self) -> Dual:
        return self

    def __bool__(self) -> bool:
        return self.value != 0.0

    def __abs__(self) -> Dual:
        return self if self.value >= 0.0 else -self

    def __lt__(self, other: Dual | float) -> bool:
        return self.value < _value(other)

    def __le__(self, other: Dual | float) -> bool:
        return self.value <= _value(other)

    def __gt__(self, other: Dual | float) -> bool:
        return self.value > _value(other)

    def __ge__(self, other: Dual | float) -> bool:
        return self.value >= _value(other)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Dual | float | int) and self.value == _value(other)

    __hash__ = None  # type: ignore[assignment]

    def __float__(self) -> NoReturn:
        raise TypeError(
            "a dual number is more than a float: functions of math lose its derivatives"
        )


def _value(number: Dual | float) -> float:
    return number.value if isinstance(number, Dual) else number


def law_jacobian(
    law: Law,
    before: Sequence[NT],
    numbers: Pair | tuple[float, float],
    moves: Sequence[bool],
    fastest: float = 0.0,
) -> Array | None:
    """Return the derivatives (S, 2 C, K) of the velocities after a contact of C balls, on S sides.

    The rows are a_n, a_t, b_n and b_t after a hit, or v_n and v_t after a bounce. The columns are
    the same before it, then its ``numbers``: a pair, or the restitution and the friction of a
    cushion. The sides lie within rounding of the contact. They differ where the law has a kink
    there, such as that between sticking and slipping. ``moves`` tells whether inputs change a_t,
    and b_t: a law may jump where a tangential velocity is zero, as that of a resting ball is.
    ``fastest`` (m/s) is the largest speed in the contact. Return None where the law jumps.

    >>> from pool_pymunk.physics.laws import Coulomb
    >>> hit, pair = (NT(1.0, 0.0), NT(0.0, 0.0)), Pair(0.2, 0.2, 0.5, 0.1)
    >>> found = law_jacobian(Coulomb(), hit, pair, (True, True))
    >>> (found[0, :, :4].round(3) + 0.0).tolist()
    [[0.25, 0.0, 0.75, 0.0], [0.0, 0.5, 0.0, 0.5], [0.75, 0.0, 0.25, 0.0], [0.0, 0.5, 0.0, 0.5]]
    >>> law_jacobian(Coulomb(), [NT(-2.0, 1.0)], (0.5, 0.1), [True])[0, 1].round(3).tolist()
    [0.15, 1.0, -0.2, -3.0]
    """
    a, *others = before
    asked: Any = law.ball_ball if others else law.cushion

    def arguments(inputs: Sequence[Any]) -> tuple[Any, ...]:
        if others:
            return NT(*inputs[:2]), NT(*inputs[2:4]), Pair(*inputs[4:])
        return NT(*inputs[:2]), *inputs[2:]

    def answer(inputs: Sequence[Any]) -> tuple[Any, ...]:
        found = asked(*arguments(inputs))
        return (*found[0], *found[1]) if others else tuple(found)

    def slopes(inputs: Sequence[float], rows: Array) -> None:
        known(*arguments(inputs), rows)

    known, inputs = slopes_of(asked), [*chain.from_iterable(before), *numbers]
    if others and law.jumps(a, others[0], Pair(*numbers)):
        return None
    step = BESIDE * max(fastest, *map(abs, inputs[: 2 * len(before)]))
    tangential = [each.t for each in before]
    slip = a.t - sum(tangential[1:])
    less = [math.copysign(step, -slip), math.copysign(step, slip)]  # what makes the slip smaller
    free = [k for k, is_moved in enumerate(moves) if is_moved]
    aside = [less[k] if free[:1] == [k] else 0.0 for k in (0, 1)]
    first = (step, aside[0], 0.0, aside[1]) if others else (-step, aside[0])
    directions: list[Steps] = [first]
    if free == [0, 1] and abs(tangential[1]) <= step < abs(slip):
        directions.append((0.0, 0.0, 0.0, step))
    turns = any(min(abs(slip), abs(tangential[k])) <= WIDE * step for k in free)
    return _sides(answer, slopes if known else None, inputs, directions, turns)


def _sides(
    answer: Answer, slopes: Any, inputs: Sequence[float], directions: Sequence[Steps], turns: bool
) -> Array | None:
    """Return the Jacobians (S, M, K) a step to either side; None where the answers differ there."""
    if not turns:
        here, jacobian = _jacobian(answer, slopes, inputs)
        if all(_is_straight(answer, inputs, here.tolist(), steps) for steps in directions):
            return jacobian[np.newaxis]
    both = [[sign * step for step in steps] for steps in directions for sign in (1.0, -1.0)]
    found = [_jacobian(answer, slopes, _moved(inputs, steps)) for steps in both]
    answers = np.array([values for values, _ in found])
    size = max(map(abs, inputs))
    if not (np.abs(answers - answers[0]) <= SAME * size).all():
        return None
    return np.array([slopes for _, slopes in found])


def _is_straight(
    answer: Answer, inputs: Sequence[float], here: Sequence[float], steps: Steps
) -> bool:
    """Tell whether the answers on either side and ``here`` lie on a line, to rounding."""
    wide = [WIDE * step for step in steps]
    above, below = (answer(_moved(inputs, [sign * step for step in wide])) for sign in (1.0, -1.0))
    bend = max(abs(a - 2.0 * b + c) for a, b, c in zip(above, here, below, strict=True))
    return bool(bend <= STRAIGHT * max(map(abs, inputs)))


def _moved(inputs: Sequence[float], steps: Steps) -> list[float]:
    """Return the inputs with steps added to the first of them."""
    return [x + step for x, step in zip(inputs, steps, strict=False)] + list(inputs[len(steps) :])


def _jacobian(answer: Answer, slopes: Any, inputs: Sequence[float]) -> tuple[Array, Array]:
    """Return the answer and its derivatives, by the law's ``slopes`` if they are known."""
    count = len(inputs)
    if slopes is not None:
        values = np.array(answer(inputs))
        rows = np.empty((len(values), count))
        slopes(inputs, rows)
        return values, rows
    duals = [
        Dual(value, tuple([1.0 if k == j else 0.0 for j in range(count)]))
        for k, value in enumerate(inputs)
    ]
    zero = (0.0,) * count
    answers = answer(duals)
    values = np.array([_value(one) for one in answers])
    return values, np.array([one.slopes if isinstance(one, Dual) else zero for one in answers])


# -- slopes that are known -------------------------------------------------------------------------


def coulomb_slopes(a: NT, b: NT, pair: Pair, rows: Any) -> None:
    """Write the derivatives (4, 8) of :func:`~pool_pymunk.physics.laws.coulomb` into ``rows``.

    Rows and columns are those of :func:`law_jacobian`; numba can compile this. With the shares
    s_a = m_b / (m_a + m_b) and s_b = 1 - s_a, the balls' velocities change by -s_a j and s_b j.
    """
    m_a, m_b, e, mu = pair
    both = m_a + m_b
    share_a, share_b = m_b / both, m_a / both
    closing, slip = max(a.n - b.n, 0.0), a.t - b.t
    j_n = (1.0 + e) * closing
    of_closing = 1.0 + e if a.n >= b.n else 0.0
    by_n = (of_closing, 0.0, -of_closing, 0.0, 0.0, 0.0, closing, 0.0)
    j_t, by_t = slip, (0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0)
    if abs(slip) > mu * j_n:
        sign = 1.0 if slip > 0.0 else -1.0
        most, each = sign * mu, sign * mu * of_closing
        j_t, by_t = most * j_n, (each, 0.0, -each, 0.0, 0.0, 0.0, most * closing, sign * j_n)
    for k in range(8):
        rows[0, k], rows[1, k] = -share_a * by_n[k], -share_a * by_t[k]
        rows[2, k], rows[3, k] = share_b * by_n[k], share_b * by_t[k]
    for m in range(4):
        j = j_t if m % 2 else j_n
        rows[m, m] += 1.0
        rows[m, 4] += j * share_a / both
        rows[m, 5] -= j * share_b / both


def published_slopes(a: NT, b: NT, pair: Pair, rows: Any) -> None:
    """Write the derivatives of :func:`~pool_pymunk.physics.laws.published` into ``rows``."""
    m_a, m_b, e, mu = pair
    both, closing, after = m_a + m_b, a.n - b.n, published(a, b, pair)
    rows[:, :] = 0.0
    rows[0, 0], rows[0, 2] = (m_a - m_b * e) / both, m_b * (1.0 + e) / both
    rows[2, 0], rows[2, 2] = m_a * (1.0 + e) / both, (m_b - m_a * e) / both
    rows[0, 4], rows[0, 5] = (a.n - after[0].n) / both, (b.n - e * closing - after[0].n) / both
    rows[2, 4], rows[2, 5] = (a.n + e * closing - after[1].n) / both, (b.n - after[1].n) / both
    rows[0, 6], rows[2, 6] = -m_b * closing / both, m_a * closing / both
    slip = a.t - b.t
    sign = 1.0 if slip > 0.0 else -1.0 if slip < 0.0 else 0.0
    for m in (1, 3):
        before, new = (a, after[0]) if m == 1 else (b, after[1])
        if new.t == 0.0 and before.t != 0.0:
            continue  # It is held at zero.
        each = sign if m == 1 else -sign
        for k in range(8):
            rows[m, k] = each * mu * rows[m - 1, k]
        rows[m, m - 1] -= each * mu
        rows[m, m] += 1.0
        rows[m, 7] -= each * (before.n - new.n)


def cushion_slopes(v: NT, restitution: float, friction: float, rows: Any) -> None:
    """Write the derivatives (2, 4) of :func:`~pool_pymunk.physics.laws.cushion` into ``rows``."""
    after = cushion(v, restitution, friction)
    push, toward = after.n - v.n, 1.0 if after.n >= v.n else -1.0
    sign = 1.0 if v.t > 0.0 else -1.0 if v.t < 0.0 else 0.0
    rows[:, :] = 0.0
    rows[0, 0], rows[0, 2] = -restitution, -v.n
    if after.t != 0.0 or v.t == 0.0:
        each = sign * friction * toward
        rows[1, 0], rows[1, 1] = each * (1.0 + restitution), 1.0
        rows[1, 2], rows[1, 3] = each * v.n, -sign * abs(push)


SLOPES = {Law.ball_ball: coulomb_slopes, Published.ball_ball: published_slopes,
          Law.cushion: cushion_slopes}  # fmt: skip


def slopes_of(method: Any) -> Any:
    """Return what writes down the derivatives of this method of a law; None if it is not known."""
    return SLOPES.get(getattr(method, "__func__", method))
