"""This module looks ahead: where a ball would go, and where a ball has room."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

from pool_pymunk.engine.contacts import ContactEngine, Motion, Recorder
from pool_pymunk.engine.near import MANY, Boxes, ManyBoxes
from pool_pymunk.physics.contact import Contact, Pair, Vector
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.path import Path, motion_at, set_off
from pool_pymunk.physics.sides import Wall

RINGS = 400  # Room is looked for on so many rings around the place that is wanted,
FINE = 0.25  # radii apart,
AROUND = 24  # in so many directions on each.
MOST = 2_000  # So many instants are played at most.


Who = TypeVar("Who")


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


class Outlook(NamedTuple):
    """An outlook has what a look ahead needs: balls by their numbers, walls, law and friction."""

    paths: dict[int, Path]
    radii: dict[int, float]
    masses: dict[int, float]
    walls: Sequence[Wall]
    law: Law
    pair: Callable[[int, int], Pair]
    deceleration: float

    def sketch(self, ball: int, velocity: Vector, now: float) -> Prediction[int]:
        """Strike the ball, and play until it and what it met have turned once more each."""
        numbers = list(self.paths)
        witness = Witness(numbers.index(ball))
        engine = self._engine(ball, velocity, now, witness)
        start = engine.paths[witness.ball]
        for _ in range(MOST):
            if witness.has_seen_all or not engine.is_finite or engine.upcoming() == math.inf:
                break
            engine.next()
        turns = witness.turns.get(witness.ball, [(start.rest_x, start.rest_y)])
        met = witness.met
        return Prediction(
            met=None if met is None else numbers[met],
            wall=witness.first.cushion if witness.first else None,
            pocket=witness.pocket,
            t=witness.at,
            way=((start.x, start.y), *turns[:2]),
            other_way=() if met is None else tuple(witness.turns[met][:2]),
        )

    def _engine(
        self, ball: int, velocity: Vector, now: float, recorder: Recorder
    ) -> ContactEngine:  # fmt: skip
        """Return an engine with all balls on their way from now on, the struck one included."""
        numbers = list(self.paths)

        def pair(i: int, j: int) -> Pair:
            return self.pair(numbers[i], numbers[j])

        engine = ContactEngine(self.law, pair, self.deceleration, recorder)
        for number, path in self.paths.items():
            x, y, vx, vy = motion_at(path, now)
            moves = velocity if number == ball else (vx, vy)
            path = set_off(0.0, (x, y), moves, self.deceleration)
            engine.add_ball(path, self.radii[number], self.masses[number])
        engine.walls = list(self.walls)
        boxes = Boxes if len(numbers) < MANY else ManyBoxes
        engine.near = near = boxes(len(numbers), len(engine.walls))
        near.measure(engine.paths)
        for i, path in enumerate(engine.paths):
            near.begin(i, path, engine.radii[i], 0.0, math.inf)
        engine.predict([i for i, path in enumerate(engine.paths) if path.speed > 0.0])
        return engine


def free_spot(
    near: Vector, radius: float, others: Sequence[tuple[Vector, float]], walls: Sequence[Wall]
) -> Vector | None:
    """Return the place nearest to ``near`` (m) at which a disc overlaps nothing, or None.

    It lies on the same side of all walls as ``near``. Places are looked for on rings.
    """
    for ring in range(RINGS):
        for k in range(AROUND if ring else 1):
            turn = math.tau * k / AROUND
            far = FINE * radius * ring
            spot = (near[0] + far * math.cos(turn), near[1] + far * math.sin(turn))
            if _is_free(near, spot, radius, others, walls):
                return spot
    return None


def _is_free(
    near: Vector,
    spot: Vector,
    radius: float,
    others: Sequence[tuple[Vector, float]],
    walls: Sequence[Wall],
) -> bool:
    """Tell whether a disc overlaps nothing at a spot, and no wall lies between it and ``near``."""
    if any(math.dist(spot, place) < radius + other for place, other in others):
        return False
    reach = math.dist(near, spot)
    way = set_off(0.0, near, (spot[0] - near[0], spot[1] - near[1]), 0.0)
    for wall in walls:
        if wall.is_pocket:
            if wall.sides[0].gap(*spot, radius) < 0.0:
                return False
        elif overlaps(wall, spot, radius) or wall.length_along(way, 0.0) < reach:
            return False
    return True


def overlaps(wall: Wall, spot: Vector, radius: float, slack: float = 0.0) -> bool:
    """Tell whether a disc at a spot overlaps a wall that bounces balls off, by more than ``slack``.

    A side that turns its back on the spot has a gap of less than -``radius``, and does not count.
    """
    if wall.is_pocket:
        return False
    gaps = [side.gap(*spot, radius) for side in wall.sides]
    return any(-radius <= gap < -slack for gap in gaps)
