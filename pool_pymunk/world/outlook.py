"""This module looks ahead: where a ball would go, and where a ball has room."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

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


class Sketch(NamedTuple):
    """A sketch says what a ball meets first, and the ways of both balls.

    ``met`` is the number of the ball that is met, ``wall`` that of the wall, ``pocket`` that of the
    pocket; they are None where there is none of them. ``t`` (s) is when, from now on. ``way`` and
    ``other_way`` are the turning points (m) of the two balls, until each has met something else or
    has stopped.
    """

    met: int | None
    wall: int | None
    pocket: int | None
    t: float
    way: tuple[Vector, ...]
    other_way: tuple[Vector, ...]


class Witness(Recorder):
    """This recorder notes where balls turn."""

    def __init__(self) -> None:
        self.first: Contact | None = None
        self.at = math.inf
        self.pocket: int | None = None
        self.turns: dict[int, list[Vector]] = {}
        self.ball = -1

    def contact(self, contact: Contact, t: float) -> None:
        if self.first is None and self.pocket is None and self.ball in contact.balls:
            self.first, self.at = contact, t

    def path(self, i: int, path: Path) -> None:
        self.turns.setdefault(i, []).append((path.x, path.y))

    def stop(self, i: int, t: float, position: Vector) -> None:
        self.turns.setdefault(i, []).append(position)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        self.turns.setdefault(i, []).extend([motion[:2], center])
        if i == self.ball and self.first is None and self.pocket is None:
            self.pocket, self.at = pocket, t


class Table(NamedTuple):
    """A table is what a look ahead needs: balls by their numbers, walls, law and friction."""

    paths: dict[int, Path]
    radii: dict[int, float]
    masses: dict[int, float]
    walls: Sequence[Wall]
    law: Law
    pair: Callable[[int, int], Pair]
    deceleration: float

    def sketch(self, ball: int, velocity: Vector, now: float) -> Sketch:
        """Play until the ball, and what it met, have turned once more each."""
        numbers = list(self.paths)
        place = {number: k for k, number in enumerate(numbers)}
        witness = Witness()
        witness.ball = place[ball]
        engine = ContactEngine(
            self.law,
            lambda i, j: self.pair(numbers[i], numbers[j]),
            self.deceleration,
            witness,
        )
        start: Vector = (0.0, 0.0)
        for number, path in self.paths.items():
            x, y, vx, vy = motion_at(path, now)
            if number == ball:
                start, (vx, vy) = (x, y), velocity
            moved = set_off(0.0, (x, y), (vx, vy), self.deceleration)
            engine.add_ball(moved, self.radii[number], self.masses[number])
        engine.walls = list(self.walls)
        boxes = Boxes if len(numbers) < MANY else ManyBoxes
        engine.near = near = boxes(len(numbers), len(engine.walls))
        near.measure(engine.paths)
        for i, path in enumerate(engine.paths):
            near.begin(i, path, engine.radii[i], 0.0, math.inf)
        engine.predict([i for i, path in enumerate(engine.paths) if path.speed > 0.0])
        return _watch(engine, witness, numbers, start)


def _watch(
    engine: ContactEngine, witness: Witness, numbers: Sequence[int], start: Vector
) -> Sketch:
    ball = witness.ball
    other: int | None = None
    for _ in range(MOST):
        if not engine.is_finite or engine.upcoming() == math.inf:
            break
        engine.next()
        if witness.first is not None and other is None:
            others = [i for i in witness.first.balls if i != ball]
            other = others[0] if others else ball
        if witness.pocket is not None or (
            other is not None and all(len(witness.turns.get(i, ())) > 1 for i in (ball, other))
        ):
            break
    met = witness.first
    hit = None if met is None or other in (ball, None) else numbers[other or 0]
    way = (
        start,
        *witness.turns.get(ball, [(engine.paths[ball].rest_x, engine.paths[ball].rest_y)]),
    )
    return Sketch(
        met=hit,
        wall=None if met is None else met.cushion,
        pocket=witness.pocket,
        t=witness.at,
        way=way[:3],
        other_way=() if hit is None or other is None else tuple(witness.turns[other][:2]),
    )


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
    if any(math.dist(spot, place) < radius + other for place, other in others):
        return False
    reach = math.dist(near, spot)
    way = set_off(0.0, near, (spot[0] - near[0], spot[1] - near[1]), 0.0)
    for wall in walls:
        gaps = [side.gap(*spot, radius) for side in wall.sides]
        if wall.is_pocket and gaps[0] < 0.0:
            return False
        # A side that turns its back on the spot has a smaller gap than these.
        if any(-radius <= gap < 0.0 for gap in gaps):
            return False
        if not wall.is_pocket and wall.length_along(way, 0.0) < reach:
            return False
    return True
