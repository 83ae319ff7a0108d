"""numba learns dual numbers here, so that compiled derivatives go through any compiled law.

A dual number of numba has one slope, and knows what :class:`~pool_pymunk.physics.dual.Dual` knows.
All this is documented as numba's extension API.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import (
    lower_builtin,
    lower_cast,
    make_attribute_wrapper,
    models,
    overload,
    register_jitable,
    register_model,
    type_callable,
)

from pool_pymunk.physics.dual import Dual

SLOPES = types.UniTuple(types.float64, 1)


class DualType(types.Type):
    """This is numba's type of a dual number."""

    def __init__(self) -> None:
        super().__init__(name="Dual")

    def can_convert_from(self, context: Any, other: Any) -> Any:
        """Tell numba that a plain number becomes a dual one where branches have both."""
        return context.can_convert(other, types.float64) if is_number(other) else None

    def unify(self, context: Any, other: Any) -> Any:
        """Return the type of what is a dual number in one branch and a plain one in another."""
        return self if is_number(other) else None


@register_model(DualType)
class DualModel(models.StructModel):
    """A dual number is kept as its value and its slope."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("value", types.float64), ("slopes", SLOPES)])


DUAL = DualType()
make_attribute_wrapper(DualType, "value", "value")
make_attribute_wrapper(DualType, "slopes", "slopes")


def is_number(kind: Any) -> bool:
    """Tell whether a type is that of a plain number."""
    return isinstance(kind, types.Float | types.Integer)


@type_callable(Dual)
def type_dual(_: Any) -> Callable[..., Any]:
    """Tell numba what a dual number is made of."""

    def typed(value: Any, slopes: Any) -> Any:
        return DUAL if is_number(value) and slopes == SLOPES else None

    return typed


@lower_builtin(Dual, types.float64, SLOPES)
def make(context: Any, builder: Any, signature: Any, parts: Any) -> Any:
    """Make a dual number of a value and a slope."""
    made = cgutils.create_struct_proxy(signature.return_type)(context, builder)
    made.value, made.slopes = parts
    return made._getvalue()


@lower_cast(types.Number, DUAL)
def lift(context: Any, builder: Any, own: Any, kind: Any, number: Any) -> Any:
    """Make a dual number of a plain one, which does not change."""
    made = cgutils.create_struct_proxy(kind)(context, builder)
    made.value = context.cast(builder, number, own, types.float64)
    made.slopes = context.get_constant_null(SLOPES)
    return made._getvalue()


# -- what it knows ---------------------------------------------------------------------------------

# These rules take the values and slopes of two numbers; a plain number has the slope 0.
OF_TWO: dict[Any, Callable[..., Any]] = {
    operator.add: lambda x, y, dx, dy: Dual(x + y, (dx + dy,)),
    operator.sub: lambda x, y, dx, dy: Dual(x - y, (dx - dy,)),
    operator.mul: lambda x, y, dx, dy: Dual(x * y, (dx * y + x * dy,)),
    operator.truediv: lambda x, y, dx, dy: Dual(x / y, ((dx - x / y * dy) / y,)),
    operator.pow: lambda x, y, dx, dy: Dual(x**y, (dx * (y * x ** (y - 1.0)),)),
    max: lambda x, y, dx, dy: Dual(y, (dy,)) if y > x else Dual(x, (dx,)),
    min: lambda x, y, dx, dy: Dual(y, (dy,)) if y < x else Dual(x, (dx,)),
    operator.lt: lambda x, y, dx, dy: x < y,
    operator.le: lambda x, y, dx, dy: x <= y,
    operator.gt: lambda x, y, dx, dy: x > y,
    operator.ge: lambda x, y, dx, dy: x >= y,
    operator.eq: lambda x, y, dx, dy: x == y,
    operator.ne: lambda x, y, dx, dy: x != y,
}
OF_ONE: dict[Any, Callable[..., Any]] = {
    operator.neg: lambda x, dx: Dual(-x, (-dx,)),
    operator.pos: lambda x, dx: Dual(x, (dx,)),
    abs: lambda x, dx: Dual(x, (dx,)) if x >= 0.0 else Dual(-x, (-dx,)),
    bool: lambda x, dx: x != 0.0,
}


IN_PLACE = {
    operator.iadd: operator.add, operator.isub: operator.sub, operator.imul: operator.mul,
    operator.itruediv: operator.truediv, operator.ipow: operator.pow,
}  # fmt: skip


def teach() -> None:
    """Teach numba all rules."""
    in_place = {operation: OF_TWO[rule] for operation, rule in IN_PLACE.items()}
    for operation, rule in (OF_TWO | in_place).items():
        overload(operation, strict=False)(between(register_jitable(rule)))
    for operation, rule in OF_ONE.items():
        overload(operation, strict=False)(alone(register_jitable(rule)))


def between(rule: Callable[..., Any]) -> Callable[..., Any]:
    """Return what numba asks for an operation on two numbers, of which one or both are dual."""
    dual: Any = {
        (True, True): lambda a, b: rule(a.value, b.value, a.slopes[0], b.slopes[0]),
        (True, False): lambda a, b: rule(a.value, b, a.slopes[0], 0.0),
        (False, True): lambda a, b: rule(a, b.value, 0.0, b.slopes[0]),
    }

    def asked(a: Any, b: Any) -> Any:
        is_known = all(each == DUAL or is_number(each) for each in (a, b))
        return dual.get((a == DUAL, b == DUAL)) if is_known else None

    return asked


def alone(rule: Callable[..., Any]) -> Callable[..., Any]:
    """Return what numba asks for an operation on one dual number."""

    def asked(a: Any) -> Any:
        return (lambda a: rule(a.value, a.slopes[0])) if a == DUAL else None

    return asked


teach()
