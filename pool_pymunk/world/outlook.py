"""This module looks ahead: where a ball would go, and where a ball has room."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Any, Generic, NamedTuple, TypeVar

import pymunk

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.near import MANY, Boxes, ManyBoxes
from pool_pymunk.engine.recorder import Motion, Recorder
from pool_pymunk.model.places import TOUCHING, lies_in, overlap, room_beside
from pool_pymunk.physics.contact import Contact, Pair, Vector
from pool_pymunk.physics.path import Path, motion_at, set_off
from pool_pymunk.physics.sides import Round, Straight, Wall

HAIR = 1e-9  # radii; a ball is put so far off what it would touch
MOST = 2_000  # This many instants are played at most.

Who = TypeVar("Who")
Edge = Round | Straight  # on which the centre of a touching ball lies


class Prediction(NamedTuple, Generic[Who]):
    """A prediction says what a ball would meet first, and the ways of both balls (m).

    ``met`` is the ball that it would meet, ``wall`` or ``pocket`` the number of a wall or a pocket,
    each None if there is none. ``t`` (s) is how long that takes; it is infinite if nothing is met.
    ``way`` has the ball's turning points: its place, where it meets what it meets, and where it
    turns next or stops. ``other_way`` is that of the ball met, from its place at the contact on.
    """

    met: Who | None
    wall: int | None
    pocket: int | None
    t: float
    way: tuple[Vector, ...]
    other_way: tuple[Vector, ...]


class Witness(Recorder):
    """This recorder notes where balls turn, and what one of them meets first."""

    def __init__(self, ball: int) -> None:
        self.ball = ball
        self.first: Contact | None = None
        self.pocket: int | None = None
        self.at = math.inf
        self.turns: dict[int, list[Vector]] = {}

    def contact(self, contact: Contact, t: float) -> None:
        """Note the first contact of the ball."""
        if self.at == math.inf and self.ball in contact.balls:
            self.first, self.at = contact, t

    def path(self, i: int, path: Path) -> None:
        """Note where a new path begins."""
        self.turns.setdefault(i, []).append((path.x, path.y))

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Note where a path ends."""
        self.turns.setdefault(i, []).append(position)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        """Note the way into a pocket."""
        self.turns.setdefault(i, []).extend([motion[:2], center])
        if self.at == math.inf and i == self.ball:
            self.pocket, self.at = pocket, t

    @property
    def met(self) -> int | None:
        """Return the ball that the ball meets first."""
        others = [i for i in self.first.balls if i != self.ball] if self.first else []
        return others[0] if others else None

    @property
    def has_seen_all(self) -> bool:
        """Tell whether the ball, and the one that it met, have turned once more each."""
        if self.at == math.inf:
            return False
        both = [self.ball] if self.met is None else [self.ball, self.met]
        return all(len(self.turns.get(i, ())) > 1 for i in both)


def sketch(
    table: ContactEngine, numbers: list[int], ball: int, velocity: Vector, now: float
) -> Prediction[Any]:
    """Strike a ball of a table, and play until it and what it met have turned once more each.

    ``numbers`` are those of the balls on the table; in the prediction balls are numbers.
    """
    witness = Witness(numbers.index(ball))
    engine = _copy(table, numbers, witness, velocity, now)
    start = engine.paths[witness.ball]
    for _ in range(MOST):
        if witness.has_seen_all or not engine.is_finite or engine.upcoming() == math.inf:
            break
        engine.next()
    turns = witness.turns.get(witness.ball, [start.rest])
    met = witness.met
    return Prediction(
        met=None if met is None else numbers[met],
        wall=witness.first.cushion if witness.first else None,
        pocket=witness.pocket,
        t=witness.at,
        way=((start.x, start.y), *turns[:2]),
        other_way=() if met is None else tuple(witness.turns[met][:2]),
    )


def _copy(
    table: ContactEngine, numbers: list[int], witness: Witness, velocity: Vector, now: float
) -> ContactEngine:
    """Return an engine with these balls on their way from now on, the struck one included."""

    def pair(i: int, j: int) -> Pair:
        return table.pair(numbers[i], numbers[j])

    engine = ContactEngine(table.resolver.law, pair, table.surface, witness)
    for k, number in enumerate(numbers):
        x, y, vx, vy = motion_at(table.paths[number], now)
        path = table.surface.path(0.0, (x, y), velocity if k == witness.ball else (vx, vy))
        engine.add_ball(path, table.radii[number], table.masses[number])
    engine.walls = list(table.walls)
    boxes = Boxes if len(numbers) < MANY else ManyBoxes
    engine.near = near = boxes(len(numbers), len(engine.walls))
    near.measure(engine.paths)
    for i, path in enumerate(engine.paths):
        near.begin(i, path, engine.radii[i], 0.0, math.inf)
    engine.predict([i for i, path in enumerate(engine.paths) if path.moves])
    return engine


def free_spot(
    near: Vector,
    radius: float,
    discs: Sequence[tuple[Vector, float]],
    obstacles: Sequence[tuple[pymunk.Shape | None, Wall]],
) -> Vector | None:
    """Return the place nearest to ``near`` (m) at which a disc overlaps nothing, or None.

    The straight way there crosses no wall. The nearest place is ``near`` itself, or the nearest
    one at the edge of an obstacle, or one at which the edges of two obstacles cross.
    """
    size = (1.0 + HAIR) * radius
    edges: list[Edge] = [Round(place, size + other) for place, other in discs]
    sides = [side for _, wall in obstacles for side in wall.sides]
    edges += [side.edge(size) for side in sides if hasattr(side, "edge")]
    away = [math.dist(near, edge.nearest(near)) for edge in edges]
    farthest, reach = max(away, default=0.0), 0.0
    while reach <= 2.0 * farthest:
        reach = max(2.0 * reach, radius)
        about = [edge for edge, far in zip(edges, away, strict=True) if far <= reach]
        spots = [near, *(edge.nearest(near) for edge in about)]
        spots += [spot for one, other in combinations(about, 2) for spot in crossings(one, other)]
        for spot in sorted(spots, key=lambda spot: math.dist(near, spot)):
            if math.dist(near, spot) <= reach and _is_free(near, spot, radius, discs, obstacles):
                return spot
    return None


def _is_free(
    near: Vector,
    spot: Vector,
    radius: float,
    discs: Sequence[tuple[Vector, float]],
    obstacles: Sequence[tuple[pymunk.Shape | None, Wall]],
) -> bool:
    """Tell whether a disc overlaps nothing at a spot, and no wall lies between it and ``near``.

    A wall in which ``near`` lies is not between them.
    """
    if any(overlap(*spot, radius, *place, other, TOUCHING) for place, other in discs):
        return False
    if any(
        lies_in(wall, room(spot, radius, shape, wall), *spot, radius) for shape, wall in obstacles
    ):
        return False
    way = set_off(0.0, near, (spot[0] - near[0], spot[1] - near[1]), 0.0)
    return all(
        wall.is_pocket
        or room(near, 0.0, shape, wall) <= 0.0
        or wall.time_of_contact(way, 0.0, 0.0) > 1.0
        for shape, wall in obstacles
    )


def room(center: Vector, radius: float, shape: pymunk.Shape | None, wall: Wall) -> float:
    """Return how much room (m) is left between a ball and a wall; it is negative if they overlap.

    For a pocket it is the room between the ball's centre and the rim. Without a shape the wall's
    sides are asked.
    """
    if shape is None or wall.is_pocket:
        return room_beside(wall.sides, *center, radius)
    return shape.point_query(center).distance - radius


def crossings(one: Edge, other: Edge) -> list[Vector]:
    """Return the points that two edges share, if there are any and not too many.

    >>> crossings(Round((0.0, 0.0), 5.0), Straight((3.0, 0.0), (1.0, 0.0)))
    [(3.0, 4.0), (3.0, -4.0)]
    >>> crossings(Straight((3.0, 0.0), (1.0, 0.0)), Straight((0.0, 2.0), (0.0, 1.0)))
    [(3.0, 2.0)]
    >>> crossings(Round((0.0, 0.0), 5.0), Round((6.0, 0.0), 5.0))
    [(3.0, 4.0), (3.0, -4.0)]
    """
    if isinstance(one, Straight):
        return _on_line(one, other)
    if isinstance(other, Straight):
        return _on_line(other, one)
    # The points lie on a line, too: that of equal power to both circles.
    (x, y), (u, v) = one.center, other.center
    apart = math.dist((x, y), (u, v))
    if apart == 0.0:
        return []
    nx, ny = (u - x) / apart, (v - y) / apart
    far = (apart + (one.radius - other.radius) * (one.radius + other.radius) / apart) / 2.0
    return _on_line(Straight((x + far * nx, y + far * ny), (nx, ny)), one)


def _on_line(line: Straight, other: Edge) -> list[Vector]:
    nx, ny = line.normal
    if isinstance(other, Straight):
        (x, y), (mx, my) = line.point, other.normal
        slope = my * nx - mx * ny
        if slope == 0.0:
            return []
        along = -other.height((x, y)) / slope
        return [(x - along * ny, y + along * nx)]
    height = line.height(other.center)
    if abs(height) > other.radius:
        return []
    half = math.sqrt((other.radius - height) * (other.radius + height))
    x, y = other.center[0] - height * nx, other.center[1] - height * ny
    return [(x - half * ny, y + half * nx), (x + half * ny, y - half * nx)]
