"""This module tells whether a ball may lie at a place, and says in words what is wrong there.

The ``room`` (m) of a ball beside another ball, a wall or a pocket is negative where it overlaps
that. A ball that overlaps by no more than rounding of coordinates touches. The rules are those of
the core (:mod:`pool_pymunk.core.floor`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import NamedTuple

from pool_pymunk.core.floor import TOUCHING as TOUCHING
from pool_pymunk.core.floor import overlap, sinks
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Pocket as Hole
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.model.outline import Table, sweep
from pool_pymunk.model.parts import Ball, Pocket, Post
from pool_pymunk.model.problems import Point, Problem, listed, shown
from pool_pymunk.model.quantities import Units
from pool_pymunk.model.state import State

# At the start of a run the share is this: other runs end with overlaps of 1e-4 in persistent
# contacts (DEEPEST), and of the distance of a step where contacts are found late.
SUNK = 1e-2
MOST_OVERLAPS = 100  # of one scene are reported: more lines than a screen has
METRES = Units()


class Placed(NamedTuple):
    """A placed ball may be at another place than in its scene."""

    id: str
    position: Point
    radius: float


Lying = Mapping[int, Ball | Placed]  # balls by their numbers


def placed(balls: Sequence[Ball], state: State) -> dict[int, Placed]:
    """Return the balls, by their numbers, that are on the table in a state."""
    both = enumerate(zip(balls, state.position, strict=True))
    there = {i: Placed(ball.id, position, ball.radius) for i, (ball, position) in both}
    return {i: ball for i, ball in there.items() if ball.id not in state.off}


def room_beside_ball(x: float, y: float, r: float, u: float, v: float, q: float) -> float:
    """Return the room (m) between a ball of radius ``r`` at (x, y) and one of ``q`` at (u, v)."""
    return RoundSide((u, v), q).gap(x, y, r)


# -- walls and pockets -----------------------------------------------------------------------------


def room_beside(sides: Iterable[Side], x: float, y: float, r: float) -> float:
    """Return the room (m) that a ball has beside some sides; those behind it do not count."""
    gaps = [(side.gap(x, y, r), side.core) for side in sides]
    return min([gap for gap, core in gaps if gap >= -(r + core)], default=math.inf)


def lies_in(wall: Wall, room: float, x: float, y: float, r: float, share: float = TOUCHING) -> bool:
    """Tell whether a ball that has this ``room`` (m) lies in a wall or a pocket."""
    if wall.is_pocket:
        r, share = wall.sides[0].core, TOUCHING
    return sinks(room, r, x, y, share)


def post_wall(post: Post, k: int, restitution: float = 0.0, friction: float = 0.0) -> Wall:
    """Return wall ``k`` of a post, with these coefficients unless it has its own."""
    e, mu = post.restitution, post.friction
    side = RoundSide(post.position, post.radius)
    return Wall([side], restitution if e is None else e, friction if mu is None else mu, k)


# -- what is wrong, in words -----------------------------------------------------------------------


class Surroundings(NamedTuple):
    """A table or a plane, pockets and posts surround balls; depths are said in ``units``."""

    table: Table | None
    pockets: Sequence[Pocket] = ()
    posts: Sequence[Post] = ()
    units: Units = METRES

    def problems(self, balls: Lying, share: float = TOUCHING) -> Iterator[Problem]:
        """Find balls off the table, or in cushions, posts, pockets, balls."""
        posts = [(f"post {k}", post_wall(post, k)) for k, post in enumerate(self.posts)]
        pockets = [
            (f"pocket {shown(hole.id)}", Hole(hole.position, hole.radius, k))
            for k, hole in enumerate(self.pockets)
        ]
        for k, ball in balls.items():
            for message in self._problems_below(ball, (*posts, *pockets), share):
                yield Problem(("balls", k, "position"), list(ball.position), message)
        for i, j in sorted(islice(_overlaps(balls, share), MOST_OVERLAPS)):
            a, b = balls[i], balls[j]
            room = room_beside_ball(*b.position, b.radius, *a.position, a.radius)
            what, smaller = f"ball {shown(a.id)}", min(a.radius, b.radius)
            message = said(f"ball {shown(b.id)}", what, room, smaller, self.units)
            yield Problem(("balls", j, "position"), list(b.position), message)

    def _problems_below(
        self, ball: Ball | Placed, things: Iterable[tuple[str, Wall]], share: float
    ) -> Iterator[str]:
        """Say that a ball is off the table, or in which cushions, posts and pockets it lies."""
        (x, y), r, name = ball.position, ball.radius, f"ball {shown(ball.id)}"
        is_off = self.table is not None and not self.table.contains(x, y)
        if is_off:
            yield f"{name} is off the table"
        cushions = () if self.table is None or is_off else self.table.walls
        rooms = [room_beside(wall.sides, x, y, r) for wall in cushions]
        touched = [str(k) for k, room in enumerate(rooms) if sinks(room, r, x, y, share)]
        if touched:
            what = f"cushion{'s' * (len(touched) > 1)} {listed(touched)}"
            yield said(name, what, min(rooms), r, self.units)
        for what, thing in things:
            room = room_beside(thing.sides, x, y, r)
            if lies_in(thing, room, x, y, r, share):
                how = "is within" if thing.is_pocket else "overlaps"
                yield said(name, what, room, r, self.units, how)

    def no_room(self, ball: Placed, others: Iterable[Ball | Placed]) -> Iterator[str]:
        """Say why a ball cannot lie at its place: it is off the table, or it overlaps something."""
        balls = {k: other for k, other in enumerate(others) if other.id != ball.id}
        last = len(balls) + 1  # Overlaps are problems of the later ball.
        for problem in self.problems({**balls, last: ball}):
            if problem.steps[1] == last:
                yield problem.message

    def post_problems(self, post: Post) -> Iterator[str]:
        """Say that a post is off the table, in which cushion it lies, or over which pockets.

        It may overlap a pocket's rim, but not its middle, where pocketed balls lie.
        """
        (x, y), r = post.position, post.radius
        for hole in self.pockets:
            if math.dist(post.position, hole.position) < r:
                yield f"the post lies over the middle of pocket {shown(hole.id)}"
        if self.table is not None and not self.table.contains(x, y):
            yield "the post is off the table"
        elif self.table is not None:
            edges = enumerate(self.table.edges)
            room, cushion = min((edge.distance(x, y) - r, k) for k, edge in edges)
            if sinks(room, r, x, y, TOUCHING):
                depth = self.units.from_si(-room, "length")
                yield f"the post lies in cushion {cushion} by {depth:.2g} {self.units.length}"


def said(
    ball: str,
    what: str,
    room: float,
    radius: float,
    units: Units | None = METRES,
    how: str = "overlaps",
) -> str:
    """Say in what a ball lies, and how deep; without ``units`` lengths have none.

    >>> said("the ball", "pocket 0", -0.0127, 0.0254, Units(length="in"), how="is within")
    'the ball is within pocket 0 by 0.5 in (0.5 radii)'
    """
    depth = f"{-room:.2g}"
    if units is not None:
        depth = f"{units.from_si(-room, 'length'):.2g} {units.length}"
    return f"{ball} {how} {what} by {depth} ({-room / radius:.2g} radii)"


def _overlaps(balls: Lying, share: float) -> Iterator[tuple[int, int]]:
    """Find overlapping balls by a sweep along the longer side of what the balls cover."""
    if not balls:
        return
    spread = [max(s) - min(s) for s in zip(*(b.position for b in balls.values()), strict=True)]
    axis = spread.index(max(spread))
    sides = {k: (b.position[axis], b.radius) for k, b in balls.items()}
    for i, j in sweep({k: (middle - r, middle + r) for k, (middle, r) in sides.items()}):
        (p, r), (q, other) = ((balls[k].position, balls[k].radius) for k in (i, j))
        is_near = abs(p[1 - axis] - q[1 - axis]) < r + other
        if is_near and overlap(p, r, q, other, share):
            yield i, j
