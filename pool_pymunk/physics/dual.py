"""This module differentiates contact laws.

The slopes of the package's own laws are written down. Another law is differentiated by dual
numbers, through its own functions. A dual number is a number with its derivatives by some inputs.
Sums and products of dual numbers follow the rules of differentiation, so a law that is asked with
dual numbers answers with its exact Jacobian (forward accumulation: Griewank and Walther, Evaluating
Derivatives, SIAM 2008, ch. 3).
"""

from __future__ import annotations

from itertools import chain, islice
from typing import Any, NoReturn

from pool_pymunk.physics.contact import NT, Pair
from pool_pymunk.physics.laws import Law, Published, cushion, published

Slopes = tuple[float, ...]


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


def dual(value: float, is_input: bool) -> Any:
    """Return a dual number with one derivative: 1 if the number is the input, 0 if it is another.

    >>> dual(3.0, True) * dual(2.0, False)
    Dual(6.0, (2.0,))
    """
    return Dual(value, (1.0 if is_input else 0.0,))


def slope(number: Dual | float) -> float:
    """Return the only derivative of a number that came out of dual numbers.

    >>> slope(dual(3.0, True)), slope(3.0)
    (1.0, 0.0)
    """
    return (number + Dual(0.0, (0.0,))).slopes[0]


def by_duals(law: Any, asked: tuple[Any, ...]) -> list[Slopes]:
    """Return the derivatives of a method of a law by all numbers that it is asked with.

    Functions of the module math lose the derivatives, and raise TypeError.

    >>> by_duals(Law().cushion, (NT(-2.0, 1.0), 0.5, 0.1))[1]
    (0.15000000000000002, 1.0, -0.2, -3.0)
    """
    numbers = [*chain.from_iterable(each if isinstance(each, tuple) else (each,) for each in asked)]
    count = range(len(numbers))
    duals = iter([Dual(x, tuple([float(k == j) for j in count])) for k, x in enumerate(numbers)])
    given: list[Any] = []
    for each in asked:
        is_one = not isinstance(each, tuple)
        given.append(next(duals) if is_one else type(each)(*islice(duals, len(each))))
    found = law(*given)
    answers = chain.from_iterable(each if isinstance(each, tuple) else (each,) for each in found)
    zero = (0.0,) * len(numbers)
    return [each.slopes if isinstance(each, Dual) else zero for each in answers]


# -- slopes that are known -------------------------------------------------------------------------


def coulomb_slopes(a: NT, b: NT, pair: Pair, rows: Any) -> None:
    """Write the derivatives (4, 8) of :func:`~pool_pymunk.physics.laws.coulomb` into ``rows``.

    Rows are a_n, a_t, b_n and b_t; columns are the same, and then the numbers of the pair. With the
    shares s_a = m_b / (m_a + m_b) and s_b = 1 - s_a, the balls' velocities change by -s_a j and
    s_b j.
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
        rows[0][k], rows[1][k] = -share_a * by_n[k], -share_a * by_t[k]
        rows[2][k], rows[3][k] = share_b * by_n[k], share_b * by_t[k]
    for m in range(4):
        j = j_t if m % 2 else j_n
        rows[m][m] += 1.0
        rows[m][4] += j * share_a / both
        rows[m][5] -= j * share_b / both


def published_slopes(a: NT, b: NT, pair: Pair, rows: Any) -> None:
    """Write the derivatives of :func:`~pool_pymunk.physics.laws.published` into ``rows``."""
    m_a, m_b, e, mu = pair
    both, closing, after = m_a + m_b, a.n - b.n, published(a, b, pair)
    for m in range(4):
        for k in range(8):
            rows[m][k] = 0.0
    rows[0][0], rows[0][2] = (m_a - m_b * e) / both, m_b * (1.0 + e) / both
    rows[2][0], rows[2][2] = m_a * (1.0 + e) / both, (m_b - m_a * e) / both
    rows[0][4], rows[0][5] = (a.n - after[0].n) / both, (b.n - e * closing - after[0].n) / both
    rows[2][4], rows[2][5] = (a.n + e * closing - after[1].n) / both, (b.n - after[1].n) / both
    rows[0][6], rows[2][6] = -m_b * closing / both, m_a * closing / both
    slip = a.t - b.t
    sign = 1.0 if slip > 0.0 else -1.0 if slip < 0.0 else 0.0
    for m in (1, 3):
        before, new = (a, after[0]) if m == 1 else (b, after[1])
        if new.t == 0.0 and before.t != 0.0:
            continue  # It is held at zero.
        each = sign if m == 1 else -sign
        for k in range(8):
            rows[m][k] = each * mu * rows[m - 1][k]
        rows[m][m - 1] -= each * mu
        rows[m][m] += 1.0
        rows[m][7] -= each * (before.n - new.n)


def cushion_slopes(v: NT, restitution: float, friction: float, rows: Any) -> None:
    """Write the derivatives (2, 4) of :func:`~pool_pymunk.physics.laws.cushion` into ``rows``."""
    after = cushion(v, restitution, friction)
    push, toward = after.n - v.n, 1.0 if after.n >= v.n else -1.0
    sign = 1.0 if v.t > 0.0 else -1.0 if v.t < 0.0 else 0.0
    rows[0][0], rows[0][1], rows[0][2], rows[0][3] = -restitution, 0.0, -v.n, 0.0
    rows[1][0] = rows[1][1] = rows[1][2] = rows[1][3] = 0.0
    if after.t != 0.0 or v.t == 0.0:
        each = sign * friction * toward
        rows[1][0], rows[1][1] = each * (1.0 + restitution), 1.0
        rows[1][2], rows[1][3] = each * v.n, -sign * abs(push)


SLOPES = {Law.ball_ball: coulomb_slopes, Published.ball_ball: published_slopes,
          Law.cushion: cushion_slopes}  # fmt: skip


def slopes_of(method: Any) -> Any:
    """Return what writes down the derivatives of this method of a law; None if it is not known."""
    return SLOPES.get(getattr(method, "__func__", method))
