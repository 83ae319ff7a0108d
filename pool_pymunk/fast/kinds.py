"""By numbers numba can call methods of classes: those of laws, and of kinds of sides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from pool_pymunk.physics.laws import COMPILED
from pool_pymunk.physics.sides import Face, Post, Rim

# These kinds of sides are compiled, each with how it is read from its numbers.
KINDS: dict[type, Callable[[Any], Any]] = {
    Face: lambda p: Face((p[0], p[1]), (p[2], p[3]), (p[4], p[5]), p[6], p[7]),
    Post: lambda p: Post((p[0], p[1]), p[2]),
    Rim: lambda p: Rim((p[0], p[1]), p[2]),
}


def by_law(methods: Sequence[Callable[..., Any]], number: int = 0) -> Callable[..., Any]:
    """Return a function that calls the law with a number, in place of ``self``, of these."""
    first, *others = methods
    if not others:
        return first
    other = by_law(others, number + 1)

    def called(law: int, *told: Any) -> Any:
        return first(law, *told) if law == number else other(law, *told)

    return called


def by_kind(question: str, number: int = 0) -> Callable[..., Any]:
    """Return a function that asks a record of SIDE what its kind of side answers."""
    kind, read = list(KINDS.items())[number]
    ask = getattr(kind, question)

    def asked(side: Any, *told: Any) -> Any:
        return ask(read(side.numbers), *told)

    if number + 1 == len(KINDS):
        return asked
    other = by_kind(question, number + 1)

    def answered(side: Any, *told: Any) -> Any:
        return ask(read(side.numbers), *told) if side.kind == number else other(side, *told)

    return answered


ball_ball = by_law([law.ball_ball for law in COMPILED])
cushion = by_law([law.cushion for law in COMPILED])
jumps = by_law([law.jumps for law in COMPILED])
gap, normal, time_of_contact = by_kind("gap"), by_kind("normal"), by_kind("time_of_contact")
