"""This module makes the arrays that compiled shots take of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from pool_pymunk.fast.kinds import KINDS, MET
from pool_pymunk.fast.records import MOST_BALLS, NOTHING, NUMBERS, SIDE, TableArrays
from pool_pymunk.model import Scene, Table
from pool_pymunk.physics.laws import COMPILED, Law
from pool_pymunk.physics.sides import Wall, core_of
from pool_pymunk.physics.surface import Rolling, Sliding
from pool_pymunk.solvers.exact import pockets, walls

HITS = ("ball_ball", "cushion", "jumps")  # what a law answers of a contact that comes alone


def law_number(law: Law) -> int:
    """Return the number of the compiled law with the same single hits, -1 if there is none.

    >>> from pool_pymunk.physics.laws import LAWS
    >>> law_number(Law()), law_number(LAWS["published"])
    (0, 1)
    """
    own = [getattr(getattr(law, name), "__func__", None) for name in HITS]
    for number, known in enumerate(COMPILED):
        if own == [getattr(known, name) for name in HITS]:
            return number
    return NOTHING


def together_number(law: Law) -> int:
    """Return the number of the compiled law that answers contacts of one instant so, or -1."""
    known = [each.together for each in COMPILED]
    own = getattr(law.together, "__func__", None)
    return known.index(own) if own in known else NOTHING


def table_of(scene: Scene) -> TableArrays:
    """Return the scene's walls and pockets in arrays."""
    return arrays_of([*walls(scene), *pockets(scene)], scene.table)


def arrays_of(found: Sequence[Wall], outline: Table | None) -> TableArrays:
    """Return the sides of walls and pockets in arrays, with the corners of the table's outline."""
    sides: list[tuple[Any, ...]] = []
    for number, wall in enumerate(found):
        pocket = wall.number if wall.is_pocket else NOTHING
        its = number, len(sides), len(sides) + len(wall.sides), pocket, wall.center or (0.0, 0.0)
        for side in wall.sides:
            numbers = np.hstack(side)  # type: ignore[call-overload]
            numbers = np.pad(numbers, (0, NUMBERS - len(numbers)))
            sides.append((list(KINDS).index(type(side)), numbers, core_of(side), *its))
    xs, ys = np.array(outline.polyline if outline else np.empty((0, 2))).T.copy()
    return TableArrays(np.array(sides, dtype=SIDE).view(np.recarray), xs, ys)


def can_compile(scene: Scene, law: Law) -> bool:
    """Tell whether numba can compile the ordinary shots of this scene by this law."""
    sides = {type(side) for wall in walls(scene) for side in wall.sides}
    has_own = any(post.restitution is not None or post.friction is not None for post in scene.posts)
    is_known = sides <= set(MET) and type(scene.surface) in (Sliding, Rolling)
    return (
        is_known and not has_own and law_number(law) != NOTHING and len(scene.balls) <= MOST_BALLS
    )


def plain(table: TableArrays) -> TableArrays:
    """Return a table with objects for records: plain Python reads them several times as fast."""
    names = table.sides.dtype.names
    sides = [SimpleNamespace(**dict(zip(names, row, strict=True))) for row in table.sides.tolist()]
    return TableArrays(sides, table.xs.tolist(), table.ys.tolist())


def cue_of(scene: Scene) -> int:
    """Return the number of the cue ball, or -1."""
    return next((i for i, ball in enumerate(scene.balls) if ball.cue), NOTHING)
