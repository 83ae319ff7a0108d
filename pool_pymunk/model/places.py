"""May a ball lie here? This module answers, and says in words what is wrong with a place.

Balls, walls, pockets and the outline are asked the same: how much ``room`` (m) is there? It
is negative where a ball lies in them. What sinks in by no more than rounded coordinates do is taken
as touching. numba compiles the rules for many layouts at once (:mod:`pool_pymunk.fast.places`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import NamedTuple

from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import Ball, Pocket, Post
from pool_pymunk.model.problems import COORDINATE_ROUNDING, Point, Problem, listed, shown
from pool_pymunk.model.state import State
from pool_pymunk.model.units import Units
from pool_pymunk.physics.sides import RoundSide, Side, Wall, core_of, pocket

# A ball touches what it sinks into by this share of its radius, or of the smaller radius of two
# balls, because somebody rounded the coordinates of a frozen rack. For a pocket, which asks for the
# ball's centre, it is a share of the pocket's radius.
TOUCHING = 1e-6
# This is that share where a run starts, as balls lie where others end: in persistent contacts they
# sink in by 1e-4, where contacts are found late by the distance of a step.
SUNK = 1e-2
MOST_OVERLAPS = 100  # reported of one scene
METRES = Units()

room_at_round = RoundSide.gap


class Placed(NamedTuple):
    """This ball is at a place that is not its own in the scene."""

    id: str
    position: Point
    radius: float


def placed(balls: Sequence[Ball], state: State) -> dict[int, Placed]:
    """Return the balls, by their numbers, that are on the table in a state."""
    return {
        i: Placed(ball.id, position, ball.radius)
        for i, (ball, position) in enumerate(zip(balls, state.position, strict=True))
        if ball.id not in state.off
    }


# -- the rules, which numba can compile ------------------------------------------------------------


def is_beside(gap: float, r: float, core: float) -> bool:
    """Tell whether a ball lies beside a side or in it, and not behind it.

    ``gap`` (m) is that of the side to a ball of radius ``r``, ``core`` (m) how far the side is
    solid below its surface.
    """
    return gap >= -(r + core)


def sinks(room: float, size: float, x: float, y: float, share: float) -> bool:
    """Tell whether a ball at (x, y) lies deeper in something than what touches it.

    What touches it may overlap by a ``share`` of ``size`` (m), and by rounded coordinates.
    """
    return room < 0.0 and room < -(share * size + COORDINATE_ROUNDING * max(abs(x), abs(y)))


def room_beside_ball(x: float, y: float, r: float, u: float, v: float, q: float) -> float:
    """Return the room (m) between a ball of radius ``r`` at (x, y) and one of ``q`` at (u, v)."""
    return room_at_round(RoundSide((u, v), q), x, y, r)


def overlap(
    x: float, y: float, r: float, u: float, v: float, q: float, share: float
) -> bool:  # fmt: skip
    """Tell whether a ball of radius ``r`` at (x, y) lies in one of radius ``q`` at (u, v)."""
    room = room_beside_ball(x, y, r, u, v, q)
    return room < 0.0 and (sinks(room, min(r, q), max(abs(x), abs(u)), max(abs(y), abs(v)), share))


# -- walls and pockets -----------------------------------------------------------------------------


def room_beside(sides: Iterable[Side], x: float, y: float, r: float) -> float:
    """Return the room (m) that a ball has beside some sides; those behind it do not count."""
    gaps = [(side.gap(x, y, r), core_of(side)) for side in sides]
    return min([gap for gap, core in gaps if is_beside(gap, r, core)], default=math.inf)


def lies_in(
    wall: Wall, room: float, x: float, y: float, r: float, share: float = TOUCHING
) -> bool:  # fmt: skip
    """Tell whether a ball that has this ``room`` (m) lies in a wall or a pocket."""
    if wall.is_pocket:
        return sinks(room, core_of(wall.sides[0]), x, y, TOUCHING)
    return sinks(room, r, x, y, share)


# -- what is wrong, in words -----------------------------------------------------------------------


def place_problems(
    balls: Mapping[int, Ball | Placed],
    table: Table | None,
    pockets: Sequence[Pocket] = (),
    share: float = TOUCHING,
    units: Units = METRES,
    posts: Sequence[Post] = (),
) -> Iterator[Problem]:
    """Find balls off the table, or in cushions, posts, pockets, balls; lengths in ``units``."""
    cushions = table.walls if table is not None else ()
    holes = [pocket(each.position, each.radius, k) for k, each in enumerate(pockets)]
    for k, ball in balls.items():
        name = f"ball {shown(ball.id)}"
        for message in _ground_problems(name, ball, table, cushions, share, units):
            yield Problem(("balls", k, "position"), list(ball.position), message)
        for number, post in enumerate(posts):
            room = room_at_round(RoundSide(post.position, post.radius), *ball.position, ball.radius)
            if sinks(room, ball.radius, *ball.position, share):
                message = said(name, f"post {number}", room, ball.radius, units)
                yield Problem(("balls", k, "position"), list(ball.position), message)
        for hole in holes:
            room = room_beside(hole.sides, *ball.position, ball.radius)
            if lies_in(hole, room, *ball.position, ball.radius):
                what = f"pocket {shown(pockets[hole.number].id)}"
                message = said(name, what, room, ball.radius, units, how="is within")
                yield Problem(("balls", k, "position"), list(ball.position), message)
    for i, j in sorted(islice(_overlaps(balls, share), MOST_OVERLAPS)):
        a, b = balls[i], balls[j]
        room = room_beside_ball(*b.position, b.radius, *a.position, a.radius)
        what, smaller = f"ball {shown(a.id)}", min(a.radius, b.radius)
        message = said(f"ball {shown(b.id)}", what, room, smaller, units)
        yield Problem(("balls", j, "position"), list(b.position), message)


def no_room(
    ball: Placed,
    others: Iterable[Ball | Placed],
    table: Table | None,
    pockets: Sequence[Pocket] = (),
    posts: Sequence[Post] = (),
    units: Units = METRES,
) -> Iterator[str]:
    """Say why a ball cannot lie where it is placed: off the table, or in what."""
    balls = {k: other for k, other in enumerate(others) if other.id != ball.id}
    last = len(balls) + 1  # Overlaps are problems of the later ball.
    for problem in place_problems({**balls, last: ball}, table, pockets, units=units, posts=posts):
        if problem.steps[1] == last:
            yield problem.message


def post_problems(
    post: Post, table: Table | None, pockets: Sequence[Pocket], units: Units = METRES
) -> Iterator[str]:
    """Say that a post is off the table, in which cushion it lies, or over which pockets.

    It may stand at a pocket's rim, but not where balls lie that the pocket took in.
    """
    (x, y), r = post.position, post.radius
    for hole in pockets:
        if math.dist(post.position, hole.position) < r:
            yield f"the post lies over the middle of pocket {shown(hole.id)}"
    if table is None:
        return
    if not table.contains(x, y):
        yield "the post is off the table"
        return
    rooms = [edge.distance(x, y) - r for edge in table.edges]
    room = min(rooms)
    if sinks(room, r, x, y, TOUCHING):
        depth = units.from_si(-room, "length")
        cushion = rooms.index(room)
        yield f"the post lies in cushion {cushion} by {depth:.2g} {units.length}"


def _ground_problems(
    name: str, ball: Ball | Placed, table: Table | None, cushions: Sequence[Wall], share: float,
    units: Units,
) -> Iterator[str]:  # fmt: skip
    """Say that a ball is off the table, or in which cushions it lies."""
    (x, y), r = ball.position, ball.radius
    if table is not None and not table.contains(x, y):
        yield f"{name} is off the table"
        return
    rooms = {wall: room_beside(wall.sides, x, y, r) for wall in cushions}
    touched = [
        str(wall.number) for wall, room in rooms.items() if lies_in(wall, room, x, y, r, share)
    ]
    if touched:
        what = f"{'cushion' if len(touched) == 1 else 'cushions'} {listed(touched)}"
        yield said(name, what, min(rooms.values()), r, units)


def said(
    ball: str, what: str, room: float, radius: float, units: Units = METRES, how: str = "overlaps"
) -> str:
    """Say in what a ball lies, and how deep.

    >>> said("the ball", "pocket 0", -0.0127, 0.0254, Units(length="in"), how="is within")
    'the ball is within pocket 0 by 0.5 in (0.5 radii)'
    """
    depth = units.from_si(-room, "length")
    return f"{ball} {how} {what} by {depth:.2g} {units.length} ({-room / radius:.2g} radii)"


def _overlaps(balls: Mapping[int, Ball | Placed], share: float) -> Iterator[tuple[int, int]]:
    """Find overlapping balls by a sweep along the longer side of what the balls cover."""
    if not balls:
        return
    spread = [max(s) - min(s) for s in zip(*(b.position for b in balls.values()), strict=True)]
    axis = spread.index(max(spread))
    active: list[int] = []
    for i in sorted(balls, key=lambda k: balls[k].position[axis] - balls[k].radius):
        (x, y), r, across = balls[i].position, balls[i].radius, balls[i].position[1 - axis]
        near = balls[i].position[axis] - r
        active = [j for j in active if balls[j].position[axis] + balls[j].radius > near]
        for j in active:
            (u, v), q = balls[j].position, balls[j].radius
            if abs(balls[j].position[1 - axis] - across) < r + q and overlap(
                x, y, r, u, v, q, share
            ):
                yield min(i, j), max(i, j)
        active.append(i)
