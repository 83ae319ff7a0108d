"""This module numbers laws and kinds of sides, so that numba can call their methods."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from pool_pymunk.physics.laws import COMPILED
from pool_pymunk.physics.moving import height_before
from pool_pymunk.physics.sides import Arc, Face, Rim, RoundSide

# These kinds of sides are compiled, each with how it is read from its numbers.
KINDS: dict[type, Callable[[Any], Any]] = {
    Face: lambda p: Face((p[0], p[1]), (p[2], p[3]), (p[4], p[5]), p[6], p[7]),
    RoundSide: lambda p: RoundSide((p[0], p[1]), p[2], (p[3], p[4]), (p[5], p[6])),
    Rim: lambda p: Rim((p[0], p[1]), p[2]),
    Arc: lambda p: Arc((p[0], p[1]), p[2], (p[3], p[4]), (p[5], p[6]), p[7]),
}
FLATS, FACE = (Face, RoundSide), 0
read_face, read_round = KINDS[Face], KINDS[RoundSide]


def by_kind(methods: Sequence[Callable[..., Any]], number: int = 0) -> Callable[..., Any]:
    """Return a function that calls the method of the kind of a record, its first argument."""
    first, *others = methods
    if set(others) <= {first}:
        return first
    other = by_kind(others, number + 1)

    def called(record: Any, *args: Any) -> Any:
        return first(record, *args) if record.kind == number else other(record, *args)

    return called


def where(has: str, one: Callable[..., Any], other: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that is ``one`` for a record whose field ``has`` is not empty.

    It is the ``other`` function for a record whose field is empty. numba knows the form of a record
    when it compiles, so it compiles one of the two.
    """

    def chosen(record: Any, *args: Any) -> Any:
        return one(record, *args) if len(getattr(record, has)) > 0 else other(record, *args)

    chosen.choice = has, one, other  # type: ignore[attr-defined]
    chosen.__module__ = one.__module__
    return chosen


def answer(question: str, kind: type) -> Callable[..., Any]:
    """Return a function of a record of SIDES, which asks this kind of side a question."""
    return reading(getattr(kind, question), kind)


def reading(ask: Callable[..., Any], kind: type) -> Callable[..., Any]:
    """Return a function of a record of SIDES, for a function of this kind of side."""
    read = KINDS[kind]

    def answered(side: Any, *args: Any) -> Any:
        return ask(read(side.numbers), *args)

    return answered


def has_no_line(side: Any, x: float, y: float) -> float:
    """Return that no place is before the line of a round side."""
    return -math.inf


ball_ball = by_kind([law.ball_ball for law in COMPILED])
cushion = by_kind([law.cushion for law in COMPILED])
jumps = by_kind([law.jumps for law in COMPILED])
gap = by_kind([answer("gap", kind) for kind in KINDS])
curvature = by_kind([answer("curvature", kind) for kind in KINDS])
normal = by_kind([answer("normal", kind) for kind in KINDS])
shape = by_kind([answer("shape", kind) for kind in KINDS])
# Sides of bodies that move are of the first two kinds only.
flat_gap = by_kind([answer("gap", kind) for kind in FLATS])
flat_curvature = by_kind([answer("curvature", kind) for kind in FLATS])
flat_normal = by_kind([answer("normal", kind) for kind in FLATS])
flat_height = by_kind([reading(height_before, Face), has_no_line])
time_of_contact = where(
    "own",
    by_kind([answer("time_of_contact", kind) for kind in KINDS]),
    by_kind([answer("time_of_contact", kind) for kind in KINDS if kind is not Arc]),
)
