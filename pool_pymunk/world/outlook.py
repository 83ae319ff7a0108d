"""This module looks ahead: where a ball would go, and where a ball has room."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.floor import TOUCHING, overlap
from pool_pymunk.core.live import SAME, LiveEngine
from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.path import Motion, Path, sliding
from pool_pymunk.core.motion.times import Vector, unit
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.walls.arc import Arc
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import Rim, RoundSide
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Pocket
from pool_pymunk.model import places
from pool_pymunk.model.problems import setting_error
from pool_pymunk.world.ball import HAIR, Disc, TableBall
from pool_pymunk.world.walls import Obstacle

VISIBLE = 1e-3  # of a speed; lines that turn by less are straight
FINE = 0.01  # of a radius; the lines of balls that fall are straight to it between their places
MOST = 2_000  # This many instants are played at most; those of nine balls take 0.2 s.


class Round(NamedTuple):
    """The centre of a ball that touches a corner, a post or a ball is on a circle (m)."""

    center: Vector
    radius: float

    def nearest(self, place: Vector) -> Vector:
        """Return the point that is nearest to a place."""
        (x, y), (u, v) = self.center, place
        nx, ny = unit(u - x, v - y) if (u, v) != (x, y) else (1.0, 0.0)
        return x + self.radius * nx, y + self.radius * ny


class Straight(NamedTuple):
    """The centre of a ball that touches a face is on a line (m)."""

    point: Vector
    normal: Vector

    def height(self, place: Vector) -> float:
        """Return how far (m) a place is before the line."""
        (x, y), (nx, ny) = self.point, self.normal
        return (place[0] - x) * nx + (place[1] - y) * ny

    def nearest(self, place: Vector) -> Vector:
        """Return the point that is nearest to a place."""
        nx, ny = self.normal
        height = self.height(place)
        return place[0] - height * nx, place[1] - height * ny


Locus = Round | Straight  # on which the centre of a touching ball lies
Going = tuple[Vector, Vector]  # a velocity and a roll (m/s)


class Prediction(NamedTuple):
    """A prediction says what a ball would meet first, and the lines that both balls follow (m).

    ``met`` is a ball, ``wall`` or ``pocket`` a number, each None if it meets none. The contact is
    ``t`` (s) from now, infinite if nothing is met, and the ball is ``where`` then. ``way`` has the
    ball's turning points: its place now, that at the contact, and where it turns next or stops.
    ``other_way`` has those of the ball met, from the contact on. Both have the places, too, where
    balls begin to roll, up to which the line may be curved, and places along contacts that persist.
    Where balls fall, both have places along the curve.
    """

    met: TableBall | None
    wall: int | None
    pocket: int | None
    t: float
    way: tuple[Vector, ...]
    other_way: tuple[Vector, ...]
    where: Vector | None = None


class Witness(Recorder):
    """This recorder notes where balls turn, and what one of them meets first."""

    def __init__(self, ball: int, falls: bool) -> None:
        self.ball, self.falls = ball, falls
        self.met: int | None = None
        self.wall: int | None = None
        self.pocket: int | None = None
        self.at = math.inf
        self.where: Vector | None = None
        # the first two turns of each ball, with the places where it began to roll before them
        self.lines: defaultdict[int, list[Vector]] = defaultdict(list)
        self.turns: defaultdict[int, int] = defaultdict(int)
        self.paths: dict[int, Path] = {}  # the last one of each ball, unless it has hit since
        self.curves: dict[int, Path] = {}  # the last one of each ball that falls

    def contact(self, one: Contact, t: float) -> None:
        balls = [disc.ball.number for disc in (one.a, one.b) if disc is not None]
        if self.at == math.inf and self.ball in balls:
            self.wall, self.at = None if one.wall is None else one.wall.number, t
            self.met = next((i for i in balls if i != self.ball), None)
            if self.met is not None:  # Its line begins here.
                self.lines[self.met], self.turns[self.met] = [], 0
                self.curves.pop(self.met, None)
        for i in balls:
            self.paths.pop(i, None)

    def path(self, ball: Ball, path: Path) -> None:
        i = ball.number
        before, place = self.paths.get(i), (path.x, path.y)
        self.paths[i] = path
        self._bend(ball, path.t)
        if before is None or turns(before, path):
            self._turn(i, place)
        elif self.turns[i] < 2:
            self.lines[i].append(place)
        if self.falls:
            self.curves[i] = path

    def stop(self, ball: Ball, t: float, place: Vector) -> None:
        self._bend(ball, t)
        self._turn(ball.number, place)

    def pocketed(self, ball: Ball, pocket: Pocket, t: float, motion: Motion) -> None:
        if self.at == math.inf and ball.number == self.ball:
            self.pocket, self.at = pocket.number, t
        self._bend(ball, t)
        self._turn(ball.number, motion[:2])
        self._turn(ball.number, pocket.center)

    def _bend(self, ball: Ball, t: float) -> None:
        """Note places along the curve on which a ball falls up to a time (s)."""
        curve = self.curves.pop(ball.number, None)
        if curve is not None and self.turns[ball.number] < 2:
            self.lines[ball.number] += bent(curve, t, ball.radius)

    def _turn(self, i: int, place: Vector) -> None:
        if self.turns[i] < 2:
            self.turns[i] += 1
            self.lines[i].append(place)
        if i == self.ball and self.at < math.inf:
            self.where = self.where or place

    @property
    def has_seen_all(self) -> bool:
        """Tell whether the ball, and the one that it met, have turned once more each."""
        both = self.ball, self.ball if self.met is None else self.met
        return self.at < math.inf and all(self.turns[i] == 2 for i in both)


def turns(before: Path, path: Path) -> bool:
    """Tell whether a ball turns visibly where it begins a new path."""
    vx, vy = before.velocity(path.t)
    return abs(path.vx - vx) + abs(path.vy - vy) > VISIBLE * (abs(vx) + abs(vy))


def bent(path: Path, t: float, radius: float) -> list[Vector]:
    """Return places (m) on a path up to a time (s), between which it is as good as straight."""
    pull, past = math.hypot(path.ax, path.ay), t - path.t
    pieces = math.ceil(past * math.sqrt(pull / (8.0 * FINE * radius)))
    return [path.place(path.t + past * k / pieces) for k in range(1, pieces)]


def sketch(engine: LiveEngine, balls: Sequence[TableBall], i: int, going: Going) -> Prediction:
    """Strike ball ``i`` in a copy of the table; play until it and what it met have turned."""
    witness, now = Witness(i, isinstance(engine.table.surface, Falling)), engine.now
    engine.recorder = witness
    own = engine.balls[i]
    witness.paths.update((each.number, each.path) for each in engine.balls if each is not own)
    engine.send(own, SAME, *going)
    start = own.path
    witness.lines.clear()
    witness.turns.clear()
    for _ in range(MOST):
        if witness.has_seen_all or not engine.go_on():
            break
    met = witness.met
    return Prediction(
        met=None if met is None else balls[met],
        wall=witness.wall,
        pocket=witness.pocket,
        t=witness.at - now,
        way=((start.x, start.y), *(witness.lines[i] or [start.place(start.end)])),
        other_way=() if met is None else tuple(witness.lines[met]),
        where=witness.where,
    )


def free_spot(
    near: Vector,
    radius: float,
    discs: Collection[Disc],
    obstacles: Collection[Obstacle],
    is_off: Callable[[Vector], bool],
    most: float = math.inf,
) -> Vector:
    """Return the place nearest to ``near`` (m) at which a disc overlaps nothing.

    It is not farther off than ``most`` (m). The straight line there crosses no wall, and it is not
    off the table unless ``near`` is. The nearest place is ``near`` itself, or the nearest one at
    the edge of an obstacle, or one at which the edges of two obstacles cross.
    """
    size = (1.0 + HAIR) * radius

    def leaves(spot: Vector) -> bool:
        """Tell whether a spot is off the table, but not ``near``, which may be in an obstacle."""
        if spot == near or not is_off(spot):
            return False
        return any(each.room(near, 0.0) <= 0.0 for each in obstacles) or not is_off(near)

    def has_room(spot: Vector) -> bool:
        line = sliding(0.0, near, (spot[0] - near[0], spot[1] - near[1]), 0.0)
        return not (
            any(overlap(spot, radius, place, other, TOUCHING) for place, other in discs)
            or any(each.holds(spot, radius) or each.lies_across(line) for each in obstacles)
            or leaves(spot)
        )

    edges: list[Locus] = [Round(place, size + other) for place, other in discs]
    for each in obstacles:
        # The centre of a disc may lie at the very rim of a pocket.
        far = HAIR * each.wall.sides[0].core if each.wall.is_pocket else size
        found = [edge_of(side, far) for side in each.wall.sides]
        edges += [edge for edge in found if edge is not None]
    away = [math.dist(near, edge.nearest(near)) for edge in edges]
    farthest, within = min(max(away, default=0.0), most), 0.0
    while within <= 2.0 * farthest and within < most:
        within = min(max(2.0 * within, radius), most)
        about = [edge for edge, far in zip(edges, away, strict=True) if far <= within]
        spots = [near, *(edge.nearest(near) for edge in about)]
        spots += [spot for one, other in combinations(about, 2) for spot in crossings(one, other)]
        for spot in sorted(spots, key=lambda spot: math.dist(near, spot)):
            if math.dist(near, spot) <= within and has_room(spot):
                return spot
    raise setting_error("near", list(near), "there is no room for a ball near this place")


def edge_of(side: Side, size: float) -> Locus | None:
    """Return where the centre of a disc of this size (m) lies that touches a side, if known."""
    if isinstance(side, Face):
        (x, y), (nx, ny), far = side.start, side.outward, side.core + size
        return Straight((x + far * nx, y + far * ny), (nx, ny))
    if isinstance(side, RoundSide | Rim):
        return Round(side.center, side.core + size)
    if isinstance(side, Arc):
        return Round(side.center, side.radius + side.facing * size)
    return None


def crossings(one: Locus, other: Locus) -> list[Vector]:
    """Return the points that two edges share; none if they share infinitely many.

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
        # The points also lie on the line of equal power to both circles.
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


def check_free(obstacle: Obstacle, discs: Mapping[TableBall, Disc]) -> None:
    """Refuse a wall or a pocket in which a ball lies now."""
    wall = obstacle.wall
    for ball, (place, radius) in discs.items():
        if obstacle.holds(place, radius):
            if isinstance(wall, Pocket):
                message = "a ball lies within this pocket"
                raise setting_error("position", list(wall.center), message)
            room = obstacle.room(place, radius)
            message = places.said(f"ball {ball.name}", "this wall", room, radius, None)
            raise setting_error("shape", type(obstacle.shape).__name__, message)


def check_place(
    center: Vector, radius: float, discs: Mapping[TableBall, Disc], obstacles: Iterable[Obstacle]
) -> None:
    """Refuse a ball that lies in another ball, a wall or a pocket."""
    for obstacle in obstacles:
        if obstacle.holds(center, radius):
            wall, room = obstacle.wall, obstacle.room(center, radius)
            how, what = ("is within", "pocket") if wall.is_pocket else ("overlaps", "wall")
            message = places.said("the ball", f"{what} {wall.number}", room, radius, None, how)
            raise setting_error("position", list(center), message)
    for ball, (place, other) in discs.items():
        if overlap(center, radius, place, other, TOUCHING):
            room = places.room_beside_ball(*center, radius, *place, other)
            message = places.said("the ball", f"ball {ball.name}", room, min(radius, other), None)
            raise setting_error("position", list(center), message)
