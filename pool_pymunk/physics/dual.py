"""This module differentiates a contact law by dual numbers, through the law's own functions.

A dual number is a number with its derivatives by some inputs. Sums and products of dual numbers
follow the rules of differentiation, so a law that is asked with dual numbers answers with its exact
Jacobian (forward accumulation: Griewank and Walther, Evaluating Derivatives, SIAM 2008, ch. 3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np

from pool_pymunk.physics.contact import NT, Pair
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import Array

TINY = 1e-200  # m/s; no velocity is as small, but a number that is not zero

Slopes = tuple[float, ...]


class Dual:
    """A dual number is a ``value`` with its derivatives by the inputs, the ``slopes``.

    It knows sums, differences, products, quotients, ``abs``, ``min``, ``max`` and comparisons.
    Functions of the module ``math`` raise TypeError.

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
    Return None where the law jumps, or has a kink.

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
    free = [k for k, may_move in zip((1, 3), moves, strict=True) if may_move]
    return _smooth(answer, (*a, *b, *pair), free)


def cushion_jacobian(law: Law, v: NT, restitution: float, friction: float) -> Array | None:
    """Return the derivatives (2, 4) of the velocity after a hit on a cushion.

    The rows are v_n and v_t after it; the columns are v_n and v_t before it, the restitution and
    the friction. Return None where the law jumps, or has a kink.

    >>> from pool_pymunk.physics.laws import Coulomb
    >>> cushion_jacobian(Coulomb(), NT(-2.0, 1.0), 0.5, 0.1)[1].round(3).tolist()
    [0.15, 1.0, -0.2, -3.0]
    """

    def answer(inputs: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(law.cushion(NT(*inputs[:2]), *inputs[2:]))

    return _smooth(answer, (*v, restitution, friction), [1])


def _smooth(
    answer: Callable[[Sequence[Any]], tuple[Any, ...]], inputs: Sequence[float], free: Sequence[int]
) -> Array | None:
    """Return the Jacobian at the inputs; None where it differs on both sides of a free zero."""
    zeros = [k for k in free if inputs[k] == 0.0]
    if not zeros:
        return _jacobian(answer, inputs)

    def beside(tiny: float) -> Array:
        moved = [tiny if k in zeros else value for k, value in enumerate(inputs)]
        return _jacobian(answer, moved)

    above, below = beside(TINY), beside(-TINY)
    return above if np.allclose(above, below, rtol=1e-12, atol=1e-100) else None


def _jacobian(answer: Callable[[Sequence[Any]], tuple[Any, ...]], inputs: Sequence[float]) -> Array:
    count = len(inputs)
    duals = [
        Dual(value, tuple([1.0 if k == j else 0.0 for j in range(count)]))
        for k, value in enumerate(inputs)
    ]
    zero = (0.0,) * count
    return np.array([one.slopes if isinstance(one, Dual) else zero for one in answer(duals)])
