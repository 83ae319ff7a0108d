"""This module puts a scene into the arrays that compiled shots need."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.kinds import KINDS
from pool_pymunk.fast.records import (
    CROWD,
    MOST_BALLS,
    MOST_BORDERS,
    MOST_MOVERS,
    MOST_PATCHES,
    NOTHING,
    NUMBERS,
    OF_BODY,
    SIDES,
    STANDS,
    WORKS,
    TableArrays,
)
from pool_pymunk.model import Scene, Table
from pool_pymunk.physics.laws import COMPILED, Coulomb, Law, Published
from pool_pymunk.physics.moving import Motion, Moving, MovingWall
from pool_pymunk.physics.patches import Patches
from pool_pymunk.physics.sides import Arc, Wall, core_of
from pool_pymunk.physics.surface import Rolling, Sliding
from pool_pymunk.solvers.exact import pockets

HITS = ("ball_ball", "cushion", "jumps")  # the methods that answer a contact that comes alone
# Compiled shots answer contacts of one instant in these manners (fast/asked.py).
TOGETHER = Coulomb.together, Published.together, Law.together
AT_ONCE, AS_LISTED, IN_ORDERS = range(len(TOGETHER))
NO_MOTION = (0.0,) * len(Motion._fields[2:])


class Form(NamedTuple):
    """A loop is compiled for each form of scenes: ``many`` have more than MOST_BALLS balls."""

    rolls: bool
    differ: bool  # walls do, and they do where some of them move
    many: bool = False
    moves: bool = False  # a wall does

    @property
    def work(self) -> Any:
        """The form of the record."""
        return WORKS[self.rolls, self.many, self.moves]

    @property
    def sides(self) -> Any:
        """The form of a side."""
        return SIDES[self.differ, self.moves]


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
    """Return the number of the compiled answer to contacts of one instant, -1 if there is none."""
    own = getattr(law.together, "__func__", None)
    return TOGETHER.index(own) if own in TOGETHER else NOTHING


def loop_form(scene: Scene) -> Form:
    """Return the form of the compiled loop that plays a scene."""
    return Form(scene.surface.rolls, walls_differ(scene), len(scene.balls) > MOST_BALLS)


def walls_differ(scene: Scene) -> bool:
    """Tell whether a scene has arcs, or posts with coefficients of their own."""
    has_arcs = any(isinstance(side, Arc) for wall in scene.cushions for side in wall.sides)
    return has_arcs or any(own >= 0.0 for wall in own_of_walls(scene) for own in wall)


def own_of_walls(scene: Scene) -> list[tuple[float, float]]:
    """Return restitution and friction of each wall, -1 where it has those of the scene."""
    own = [(post.restitution, post.friction) for post in scene.posts]
    posts = [(-1.0 if e is None else e, -1.0 if mu is None else mu) for e, mu in own]
    return [*[(-1.0, -1.0)] * scene.first_post, *posts, *[(-1.0, -1.0)] * len(scene.pockets)]


def table_of(scene: Scene, differ: bool = False) -> TableArrays:
    """Return walls and pockets in arrays; if they ``differ``, with their own coefficients."""
    own = own_of_walls(scene) if differ else ()
    return arrays_of([*scene.cushions, *pockets(scene)], scene.table, own)


def arrays_of(
    found: Sequence[Wall],
    outline: Table | None,
    owned: Sequence[tuple[float, float]] = (),
    moves: bool = False,
) -> TableArrays:
    """Return the sides of walls and pockets in arrays, with the corners of the table's outline."""
    sides: list[tuple[Any, ...]] = []
    movers, motion = 0, NO_MOTION if moves else ()
    for number, wall in enumerate(found):
        its_sides: list[Any] = [*wall.sides]
        marks = [(STANDS,) if moves else ()] * len(its_sides)
        if isinstance(wall, MovingWall):
            of_body = wall.moving.sides
            its_sides, marks = [of_body[0], *of_body], [(movers,), *[(OF_BODY,)] * len(of_body)]
            movers += 1
        pocket = wall.number if wall.is_pocket else NOTHING
        its = number, len(sides), len(sides) + len(its_sides), pocket, wall.center or (0.0, 0.0)
        own = owned[number] if owned else ()
        for side, mark in zip(its_sides, marks, strict=True):
            kind = list(KINDS).index(type(side))
            sides.append((kind, numbers_of(side), core_of(side), *its, own, mark, motion))
    xs, ys, arcs = outline.lines if outline else ((), (), ())
    lines = np.array(xs, float), np.array(ys, float), np.array(arcs, float).reshape(-1, 8)
    form = SIDES[len(owned) > 0, moves]
    return TableArrays(np.array(sides, dtype=form).view(np.recarray), *lines)


def numbers_of(side: Any) -> list[float]:
    """Return the numbers of a side, and zeros after them."""
    # NumPy's hstack and pad took an eighth of the time of a shot that is played alone.
    each = (part if isinstance(part, tuple) else (part,) for part in side)
    numbers = [*chain.from_iterable(each)]
    return numbers + [0.0] * (NUMBERS - len(numbers))


def knows(walls: Sequence[Wall]) -> bool:
    """Tell whether the compiled loop knows all kinds of sides of these walls, and none kicks."""
    kinds = {type(side) for wall in walls for side in wall.sides}
    is_known = kinds <= {*KINDS, Moving} and sum(map(moves, walls)) <= MOST_MOVERS
    return is_known and not any(wall.kick for wall in walls)


def moves(wall: Wall) -> bool:
    """Tell whether a wall moves with its body."""
    return isinstance(wall, MovingWall)


def own_of(walls: Sequence[Wall]) -> tuple[float, float] | None:
    """Return restitution and friction of all cushions; None if there are arcs, or they differ."""
    solid = [wall for wall in walls if wall.sides and not wall.is_pocket]
    if any(isinstance(side, Arc | Moving) for wall in solid for side in wall.sides):
        return None
    found = {(wall.restitution, wall.friction) for wall in solid} or {(1.0, 0.0)}
    return next(iter(found)) if len(found) == 1 else None


def can_compile(scene: Scene, law: Law) -> bool:
    """Tell whether numba can compile the ordinary shots of this scene by this law."""
    is_known = knows(scene.cushions) and type(scene.surface) in (Sliding, Rolling)
    is_small = len(scene.balls) <= CROWD and fits(scene.ground)
    return is_known and is_small and law_number(law) != NOTHING


def fits(patches: Patches) -> bool:
    """Tell whether a record has room for patches."""
    return len(patches.borders) <= MOST_BORDERS and len(patches.own) <= MOST_PATCHES


def put_patches(array: Any, patches: Patches) -> None:
    """Put patches into the only record of an array."""
    borders, own = len(patches.borders), len(patches.own)
    array["scene"]["borders"], array["scene"]["patches"] = borders, own
    if borders:
        array["border"][0][:borders], array["own"][0][:own] = patches.borders, patches.own


def plain(table: TableArrays) -> TableArrays:
    """Return a table with objects for records, which Python reads several times as fast."""
    names = table.sides.dtype.names
    sides = [SimpleNamespace(**dict(zip(names, row, strict=True))) for row in table.sides.tolist()]
    return TableArrays(sides, *(each.tolist() for each in table[1:]))


def cue_of(scene: Scene) -> int:
    """Return the number of the cue ball, or -1."""
    return next((i for i, ball in enumerate(scene.balls) if ball.cue), NOTHING)


def coefficients_of(scene: Scene) -> NDArray[np.float64]:
    """Return the coefficients of a scene, as `Shots` have them; NaN where it has none."""
    r, f, surface = scene.restitution, scene.friction, scene.surface
    cue = r.ball_ball if r.cue_ball is None else r.cue_ball
    own = r.ball_ball, cue, r.cushion, surface.pull, f.cushion, f.ball_ball, surface.drag
    return np.array(own, float)
