"""This module looks ahead: where a ball would go, and where a ball has room."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from itertools import combinations
from typing import NamedTuple

from pool_pymunk.core.floor import TOUCHING, overlap
from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.near import boxes_around
from pool_pymunk.engine.recorder import Motion, Recorder
from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.contact import Contact, Pair, Vector
from pool_pymunk.physics.impulses import Impulse
from pool_pymunk.physics.moving import MovingWall
from pool_pymunk.physics.path import Path, motion_at, set_off
from pool_pymunk.physics.sides import Round, Straight, Wall, unit
from pool_pymunk.world.ball import HAIR, Disc, TableBall
from pool_pymunk.world.checks import Obstacle
from pool_pymunk.world.state import LiveState, Phase

VISIBLE = 1e-3  # of a speed; lines that turn by less are straight
MOST = 2_000  # This many instants are played at most; those of nine balls take 0.2 s.

Locus = Round | Straight  # on which the centre of a touching ball lies
Going = tuple[Vector, Vector]  # a velocity and a roll (m/s)


class Prediction(NamedTuple):
    """A prediction says what a ball would meet first, and the lines that both balls follow (m).

    ``met`` is a ball, ``wall`` or ``pocket`` a number, each None if it meets none. The contact is
    ``t`` (s) from now, infinite if nothing is met, and the ball is ``where`` then. ``way`` has the
    ball's turning points: its place now, that at the contact, and where it turns next or stops.
    ``other_way`` has those of the ball met, from the contact on. Both have the places, too, where
    balls begin to roll, up to which the line may be curved, and places along contacts that persist.
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

    def __init__(self, ball: int) -> None:
        self.ball = ball
        self.met: int | None = None
        self.wall: int | None = None
        self.pocket: int | None = None
        self.at = math.inf
        self.where: Vector | None = None
        # the first two turns of each ball, with the places where it began to roll before them
        self.lines: defaultdict[int, list[Vector]] = defaultdict(list)
        self.turns: defaultdict[int, int] = defaultdict(int)
        self.paths: dict[int, Path] = {}  # the last one of each ball, unless it has hit since

    def contact(self, contact: Contact, impulse: Impulse, t: float) -> None:
        if self.at == math.inf and self.ball in contact.balls:
            self.wall, self.at = contact.cushion, t
            self.met = next((i for i in contact.balls if i != self.ball), None)
            if self.met is not None:  # Its line begins here.
                self.lines[self.met], self.turns[self.met] = [], 0
        for i in contact.balls:
            self.paths.pop(i, None)

    def path(self, i: int, path: Path) -> None:
        before, place = self.paths.get(i), (path.x, path.y)
        self.paths[i] = path
        if before is None or turns(before, path):
            self._turn(i, place)
        elif self.turns[i] < 2:
            self.lines[i].append(place)

    def stop(self, i: int, t: float, position: Vector) -> None:
        self._turn(i, position)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        if self.at == math.inf and i == self.ball:
            self.pocket, self.at = pocket, t
        self._turn(i, motion[:2])
        self._turn(i, center)

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
    _, _, vx, vy = motion_at(before, path.t)
    return abs(path.vx - vx) + abs(path.vy - vy) > VISIBLE * (abs(vx) + abs(vy))


def sketch(state: LiveState, ball: TableBall, struck: Going) -> Prediction:
    """Strike a ball in a copy of the table; play until it and what it met have turned."""
    balls = state.on_table()
    witness = Witness(balls.index(ball))
    engine = copy_of(state, witness, {ball: struck})
    witness.paths.update(enumerate(engine.paths))
    start = engine.paths[witness.ball]
    for _ in range(MOST):
        if witness.has_seen_all or not engine.is_finite or engine.upcoming() == math.inf:
            break
        engine.next()
    met = witness.met
    return Prediction(
        met=None if met is None else balls[met],
        wall=witness.wall,
        pocket=witness.pocket,
        t=witness.at,
        way=((start.x, start.y), *(witness.lines[witness.ball] or [start.rest])),
        other_way=() if met is None else tuple(witness.lines[met]),
        where=witness.where,
    )


def copy_of(
    state: LiveState, recorder: Recorder, going: Mapping[TableBall, Going] | None = None
) -> ContactEngine:
    """Return an engine with the balls on the table, in their order, whose time (s) begins now.

    Some balls may be ``going`` otherwise than they do. What the engine plays changes no ball.
    """
    balls, table = state.on_table(), state.engine

    def pair(i: int, j: int) -> Pair:
        return table.pair(balls[i].number, balls[j].number)

    engine = ContactEngine(table.law, pair, table.surface, recorder)
    engine.lay(table.surface, table.patches)
    for k, each in enumerate(balls):
        (x, y, vx, vy), roll = state.state_of(each.number)
        goes = (going or {}).get(each, ((vx, vy), roll))
        path = engine.path_at(k, 0.0, (x, y), *goes)
        engine.add_ball(path, each.radius, table.masses[each.number])
    numbers = {each.number: k for k, each in enumerate(balls)}
    engine.movers = table.movers
    engine.jams = {(numbers[i], place) for i, place in table.jams if i in numbers}
    engine.walls = [wall_in(state, engine, wall) for wall in table.walls]
    engine.near = boxes_around(engine.paths, engine.radii, len(engine.walls))
    engine.predict([i for i, path in enumerate(engine.paths) if path.moves])
    return engine


def wall_in(state: LiveState, engine: ContactEngine, wall: Wall) -> Wall:
    """Return a wall for the copy of a table; one that moves stands there unless a step goes on."""
    if not isinstance(wall, MovingWall):
        return wall
    if state.phase is Phase.STEPPING:
        return wall.copy(wall.moving.copy(engine, state.time))
    return wall.copy(wall.moving.standing(engine))


def motions_after(state: LiveState, dt: float) -> dict[TableBall, tuple[Vector, Vector]]:
    """Return where balls are in ``dt`` s, and how fast, to which something happens until then."""
    balls, engine = state.on_table(), copy_of(state, Recorder())
    began = list(engine.paths)
    for _ in range(MOST):
        if not engine.is_finite or engine.upcoming() > dt:
            break
        engine.next()
    changed = [k for k, path in enumerate(began) if engine.paths[k] is not path]
    return {balls[k]: engine.paths[k].at(dt) for k in changed}


def free_spot(
    near: Vector,
    radius: float,
    discs: Collection[Disc],
    obstacles: Collection[Obstacle],
    most: float = math.inf,
) -> Vector:
    """Return the place nearest to ``near`` (m) at which a disc overlaps nothing.

    It is not farther off than ``most`` (m). The straight line there crosses no wall. The nearest
    place is ``near`` itself, or the nearest one at the edge of an obstacle, or one at which the
    edges of two obstacles cross.
    """
    size = (1.0 + HAIR) * radius

    def is_open(spot: Vector) -> bool:
        line = set_off(0.0, near, (spot[0] - near[0], spot[1] - near[1]), 0.0)
        return not any(each.lies_across(line) for each in obstacles)

    edges: list[Locus] = [Round(place, size + other) for place, other in discs]
    sides = [side for each in obstacles for side in each.sides]
    edges += [side.edge(size) for side in sides if hasattr(side, "edge")]
    away = [math.dist(near, edge.nearest(near)) for edge in edges]
    farthest, within = min(max(away, default=0.0), most), 0.0
    while within <= 2.0 * farthest and within < most:
        within = min(max(2.0 * within, radius), most)
        about = [edge for edge, far in zip(edges, away, strict=True) if far <= within]
        spots = [near, *(edge.nearest(near) for edge in about)]
        spots += [spot for one, other in combinations(about, 2) for spot in crossings(one, other)]
        for spot in sorted(spots, key=lambda spot: math.dist(near, spot)):
            is_near = math.dist(near, spot) <= within
            if is_near and is_free(spot, radius, discs, obstacles) and is_open(spot):
                return spot
    raise setting_error("near", list(near), "there is no room for a ball near this place")


def is_free(
    spot: Vector, radius: float, discs: Iterable[Disc], obstacles: Iterable[Obstacle]
) -> bool:
    """Tell whether a disc at a place (m) overlaps nothing."""
    if any(overlap(spot, radius, place, other, TOUCHING) for place, other in discs):
        return False
    return not any(each.holds(spot, radius) for each in obstacles)


def beside(
    place: Vector, radius: float, discs: Iterable[Disc], obstacles: Iterable[Obstacle]
) -> Vector:
    """Return where a disc that overlaps one other disc or wall a little touches it instead (m)."""
    x, y = place
    for (u, v), other in discs:
        touching = radius + other
        if math.dist((x, y), (u, v)) < touching:
            nx, ny = unit(x - u, y - v)
            x, y = u + touching * nx, v + touching * ny
    for side in [side for each in obstacles for side in each.sides]:
        gap = side.gap(x, y, radius)
        if -radius <= gap < 0.0:
            nx, ny = side.normal(x, y)
            x, y = x - gap * nx, y - gap * ny
    return x, y


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
