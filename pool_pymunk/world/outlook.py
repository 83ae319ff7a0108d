"""This module looks ahead: where a ball would go, and where a ball has room."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection
from itertools import combinations
from typing import Any, Generic, NamedTuple, TypeVar

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.near import boxes_around
from pool_pymunk.engine.recorder import Motion, Recorder
from pool_pymunk.model.places import TOUCHING, overlap
from pool_pymunk.physics.contact import Contact, Pair, Vector
from pool_pymunk.physics.path import Path, set_off
from pool_pymunk.physics.sides import Round, Straight
from pool_pymunk.world.checks import Obstacle

HAIR = 1e-9  # radii; a ball is put this far from what it would touch
MOST = 2_000  # This many instants are played at most.

Who = TypeVar("Who")
Locus = Round | Straight  # on which the centre of a touching ball lies
Disc = tuple[Vector, float]  # a place and a radius (m)
Going = tuple[Vector, Vector]  # a velocity and a roll (m/s)


class Prediction(NamedTuple, Generic[Who]):
    """A prediction says what a ball would meet first, and the lines that both balls follow (m).

    ``met`` is a ball, ``wall`` or ``pocket`` a number, each None if it meets none. That takes ``t``
    (s), which is infinite if nothing is met. ``way`` has the ball's turning points: its place,
    where it meets what it meets, and where it turns next or stops. ``other_way`` is that of the
    ball met, from its place at the contact on. Both have the places, too, where balls begin to
    roll; until then the line may be curved. ``where`` is the ball's place when it meets that.
    """

    met: Who | None
    wall: int | None
    pocket: int | None
    t: float
    way: tuple[Vector, ...]
    other_way: tuple[Vector, ...]
    where: Vector | None = None


class Witness(Recorder):
    """This recorder notes where balls turn, and what one of them meets first."""

    def __init__(self, ball: int) -> None:
        self.ball = ball
        self.met: int | None = None
        self.wall: int | None = None
        self.pocket: int | None = None
        self.at = math.inf
        self.turn = 0  # the number of the ball's turn at that time
        self.turns: defaultdict[int, list[Vector]] = defaultdict(list)
        self.rolled: defaultdict[int, int] = defaultdict(int)  # how many of them are no turns

    def contact(self, contact: Contact, t: float) -> None:
        if self.at == math.inf and self.ball in contact.balls:
            self.wall, self.at, self.turn = contact.cushion, t, len(self.turns[self.ball])
            self.met = next((i for i in contact.balls if i != self.ball), None)
            if self.met is not None:  # Its line begins here.
                self.turns[self.met], self.rolled[self.met] = [], 0

    def path(self, i: int, path: Path) -> None:
        self.turns[i].append((path.x, path.y))

    def roll(self, i: int, t: float) -> None:
        self.rolled[i] += len(self.turns[i]) - self.rolled[i] < 2

    def stop(self, i: int, t: float, position: Vector) -> None:
        self.turns[i].append(position)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        if self.at == math.inf and i == self.ball:
            self.pocket, self.at, self.turn = pocket, t, len(self.turns[i])
        self.turns[i] += [motion[:2], center]

    def turns_of(self, i: int) -> list[Vector]:
        """Return the first two turns of ball ``i``, and where it began to roll before them."""
        return self.turns[i][: 2 + self.rolled[i]]

    @property
    def has_seen_all(self) -> bool:
        """Tell whether the ball, and the one that it met, have turned once more each."""
        both = {self.ball, self.ball if self.met is None else self.met}
        return self.at < math.inf and all(len(self.turns[i]) - self.rolled[i] > 1 for i in both)


def sketch(
    table: ContactEngine, numbers: list[int], ball: int, struck: Going, now: float
) -> Prediction[Any]:
    """Strike one of the balls of these ``numbers``; play until it and what it met have turned."""
    witness = Witness(numbers.index(ball))
    engine = _copy(table, numbers, witness, struck, now)
    start = engine.paths[witness.ball]
    for _ in range(MOST):
        if witness.has_seen_all or not engine.is_finite or engine.upcoming() == math.inf:
            break
        engine.next()
    met = witness.met
    return Prediction(
        met=None if met is None else numbers[met],
        wall=witness.wall,
        pocket=witness.pocket,
        t=witness.at,
        way=((start.x, start.y), *(witness.turns_of(witness.ball) or [start.rest])),
        other_way=() if met is None else tuple(witness.turns_of(met)),
        where=None if witness.at == math.inf else witness.turns[witness.ball][witness.turn],
    )


def _copy(
    table: ContactEngine, numbers: list[int], witness: Witness, struck: Going, now: float
) -> ContactEngine:
    """Return an engine with these balls in motion from now on, the struck one included."""

    def pair(i: int, j: int) -> Pair:
        return table.pair(numbers[i], numbers[j])

    engine = ContactEngine(table.resolver.law, pair, table.surface, witness)
    for k, number in enumerate(numbers):
        place, velocity = table.paths[number].at(now)
        goes = velocity, table.surface.roll(table.paths[number], now)
        path = table.surface.path(0.0, place, *(struck if k == witness.ball else goes))
        engine.add_ball(path, table.radii[number], table.masses[number])
    engine.walls = list(table.walls)
    engine.near = boxes_around(engine.paths, engine.radii, len(engine.walls))
    engine.predict([i for i, path in enumerate(engine.paths) if path.moves])
    return engine


def free_spot(
    near: Vector, radius: float, discs: Collection[Disc], obstacles: Collection[Obstacle]
) -> Vector | None:
    """Return the place nearest to ``near`` (m) at which a disc overlaps nothing, or None.

    The straight line there crosses no wall. The nearest place is ``near`` itself, or the nearest
    one at the edge of an obstacle, or one at which the edges of two obstacles cross.
    """
    size = (1.0 + HAIR) * radius

    def is_free(spot: Vector) -> bool:
        if any(overlap(*spot, radius, *place, other, TOUCHING) for place, other in discs):
            return False
        line = set_off(0.0, near, (spot[0] - near[0], spot[1] - near[1]), 0.0)
        return not any(each.holds(spot, radius) or each.lies_across(line) for each in obstacles)

    edges: list[Locus] = [Round(place, size + other) for place, other in discs]
    sides = [side for each in obstacles for side in each.wall.sides]
    edges += [side.edge(size) for side in sides if hasattr(side, "edge")]
    away = [math.dist(near, edge.nearest(near)) for edge in edges]
    farthest, within = max(away, default=0.0), 0.0
    while within <= 2.0 * farthest:
        within = max(2.0 * within, radius)
        about = [edge for edge, far in zip(edges, away, strict=True) if far <= within]
        spots = [near, *(edge.nearest(near) for edge in about)]
        spots += [spot for one, other in combinations(about, 2) for spot in crossings(one, other)]
        for spot in sorted(spots, key=lambda spot: math.dist(near, spot)):
            if math.dist(near, spot) <= within and is_free(spot):
                return spot
    return None


def crossings(one: Locus, other: Locus) -> list[Vector]:
    """Return the points that two edges share, if there are any and not too many.

    >>> crossings(Round((0.0, 0.0), 5.0), Straight((3.0, 0.0), (1.0, 0.0)))
    [(3.0, 4.0), (3.0, -4.0)]
    >>> crossings(Straight((3.0, 0.0), (1.0, 0.0)), Straight((0.0, 2.0), (0.0, 1.0)))
    [(3.0, 2.0)]
    >>> crossings(Round((0.0, 0.0), 5.0), Round((6.0, 0.0), 5.0))
    [(3.0, 4.0), (3.0, -4.0)]
    """
    if isinstance(other, Straight) and not isinstance(one, Straight):
        one, other = other, one
    if isinstance(one, Round) and isinstance(other, Round):
        # The points lie on a line, too: that of equal power to both circles.
        (x, y), (u, v) = one.center, other.center
        apart = math.dist((x, y), (u, v))
        if apart == 0.0:
            return []
        nx, ny = (u - x) / apart, (v - y) / apart
        far = (apart + (one.radius - other.radius) * (one.radius + other.radius) / apart) / 2.0
        one, other = Straight((x + far * nx, y + far * ny), (nx, ny)), one
    assert isinstance(one, Straight)
    nx, ny = one.normal
    if isinstance(other, Straight):
        (x, y), (mx, my) = one.point, other.normal
        slope = my * nx - mx * ny
        if slope == 0.0:
            return []
        along = -other.height((x, y)) / slope
        return [(x - along * ny, y + along * nx)]
    height = one.height(other.center)
    if abs(height) > other.radius:
        return []
    half = math.sqrt((other.radius - height) * (other.radius + height))
    x, y = other.center[0] - height * nx, other.center[1] - height * ny
    return [(x - half * ny, y + half * nx), (x + half * ny, y - half * nx)]
