"""This module differentiates a contact law by dual numbers, through the law's own functions.

A dual number is a number with its derivatives by some inputs. Sums and products of dual numbers
follow the rules of differentiation, so a law that is asked with dual numbers answers with its exact
Jacobian (forward accumulation: Griewank and Walther, Evaluating Derivatives, SIAM 2008, ch. 3).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np

from pool_pymunk.physics.contact import NT, Pair
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import Array

TINY = 1e-30  # m/s; no velocity is so small, and its square is a number that is not zero
STEP = 2.0**-30  # of a velocity; so far beside it a law is asked whether it jumps there
SAME = 1e-6  # Answers that differ by less than this share are the same, but for that step.

Slopes = tuple[float, ...]
Answer = Callable[[Sequence[Any]], tuple[Any, ...]]


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
        if isinstance(other, Dual):
            slopes = tuple([a - b for a, b in zip(self.slopes, other.slopes, strict=True)])
            return Dual(self.value - other.value, slopes)
        return Dual(self.value - other, self.slopes)

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


def hit_jacobian(law: Law, a: NT, b: NT, pair: Pair, moves: Sequence[bool]) -> Array | None:
    """Return the derivatives (4, 8) of the velocities after a hit of two balls.

    The rows are a_n, a_t, b_n and b_t after it, and the columns the same before it, then m_a, m_b,
    the restitution and the friction. ``moves`` tells for a_t and b_t whether they may be other than
    they are: a law may jump where a tangential velocity is zero, as that of a resting ball is.
    Return None where the law jumps. NaN stands where it has a kink.

    >>> from pool_pymunk.physics.laws import Coulomb
    >>> a, b, pair = NT(1.0, 0.0), NT(0.0, 0.0), Pair(0.2, 0.2, 0.5, 0.1)
    >>> found = hit_jacobian(Coulomb(), a, b, pair, (True, True))
    >>> found[:, :4].round(3).tolist()
    [[0.25, 0.0, 0.75, 0.0], [0.0, 0.5, 0.0, 0.5], [0.75, 0.0, 0.25, 0.0], [0.0, 0.5, 0.0, 0.5]]
    """

    def answer(inputs: Sequence[Any]) -> tuple[Any, ...]:
        after_a, after_b = law.ball_ball(NT(*inputs[:2]), NT(*inputs[2:4]), Pair(*inputs[4:]))
        return (*after_a, *after_b)

    if law.jumps(a, b, pair):
        return None
    inputs = (*a, *b, *pair)
    slip = a.t - b.t
    free = [k for k, may_move in zip((1, 3), moves, strict=True) if may_move]
    if slip == 0.0 and free:  # A change of either tangential velocity makes a slip.
        return _beside(answer, inputs, free[:1])
    return _beside(answer, inputs, [k for k in free if inputs[k] == 0.0])


def cushion_jacobian(
    law: Law, v: NT, restitution: float, friction: float, moves: bool
) -> Array | None:
    """Return the derivatives (2, 4) of the velocity after a hit on a cushion.

    The rows are v_n and v_t after it; the columns are v_n and v_t before it, the restitution and
    the friction. ``moves``, None and NaN are as in :func:`hit_jacobian`.

    >>> from pool_pymunk.physics.laws import Coulomb
    >>> cushion_jacobian(Coulomb(), NT(-2.0, 1.0), 0.5, 0.1, True)[1].round(3).tolist()
    [0.15, 1.0, -0.2, -3.0]
    """

    def answer(inputs: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(law.cushion(NT(*inputs[:2]), *inputs[2:]))

    return _beside(answer, (*v, restitution, friction), [1] if moves and v.t == 0.0 else [])


def _beside(answer: Answer, inputs: Sequence[float], at: Sequence[int]) -> Array | None:
    """Return the Jacobian; None or NaN where a law jumps or has a kink at some of the inputs.

    It is None if the answers beside these inputs differ; an entry that differs there is NaN.
    """
    if not at:
        return _jacobian(answer, inputs)[1]
    (above, by_above), (below, by_below) = (
        _jacobian(
            answer,
            [x + way * (STEP * abs(x) or TINY) if k in at else x for k, x in enumerate(inputs)],
        )
        for way in (1.0, -1.0)
    )
    size = max(map(abs, inputs))
    if not np.allclose(above, below, rtol=0.0, atol=SAME * size):
        return None
    same = np.isclose(by_above, by_below, rtol=SAME, atol=SAME * size)
    return np.where(same, by_above, math.nan)


def _jacobian(answer: Answer, inputs: Sequence[float]) -> tuple[Array, Array]:
    """Return the answer and its derivatives."""
    count = len(inputs)
    duals = [
        Dual(value, tuple([1.0 if k == j else 0.0 for j in range(count)]))
        for k, value in enumerate(inputs)
    ]
    zero = (0.0,) * count
    answers = answer(duals)
    values = np.array([_value(one) for one in answers])
    return values, np.array([one.slopes if isinstance(one, Dual) else zero for one in answers])
