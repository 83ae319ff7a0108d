"""This module keeps the walls and pockets of a table: shapes, and walls of the core for them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import pymunk

from pool_pymunk.core.live import LiveEngine, still
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.walls.face import face_between
from pool_pymunk.core.walls.moving import Body, MovingWall
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Pocket, Wall
from pool_pymunk.model import places
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.world.ball import AsItCame
from pool_pymunk.world.checks import Drawn, check_motion, set_apart

# Lines from a place within walls cross an odd number of them, except through gaps and obstacles.
# OFF is a share of the lines. Of 4,576 places on and off tables with six gaps, 32 or 64 lines
# misjudge none, and 16 lines misjudge five; half or twice OFF misjudges 163 or 8.
LINES, OFF = 32, 0.25

# What stays of each wall and pocket, and where an Obstacle has it.
STANDS = "body.body_type", "body.position", "body.angle"
SHAPE = "shape.radius", "shape.sensor", "shape.filter", "shape.body"
OUTLINES: dict[type[pymunk.Shape], tuple[str, ...]] = {
    pymunk.Segment: ("shape.a", "shape.b"), pymunk.Circle: ("shape.offset",),
    pymunk.Poly: ("corners",),
}  # fmt: skip
Line = tuple[Vector, Vector]  # the ends of a wall (m)
Pose = tuple[Vector, float]  # the place (m) of a body's center of gravity, and its angle
STILL = (0.0, 0.0)
OFF_TABLE = "the ball would lie off the table"


@dataclass(eq=False)
class Obstacle:
    """An obstacle has a wall or pocket, and its shape: if it ``is_drawn``, both are the same."""

    shape: Drawn
    wall: Wall
    is_drawn: bool = False

    def __post_init__(self) -> None:
        assert self.shape.body is not None
        self.body, self.own_filter = self.shape.body, self.shape.filter

    @property
    def stands_as_segment(self) -> bool:
        """Tell whether the obstacle is a segment that stands."""
        return self.is_drawn and isinstance(self.shape, pymunk.Segment) and not self.wall.moves

    @property
    def corners(self) -> list[pymunk.Vec2d]:
        """The corners (m) of a polygon in the frame of its body."""
        assert isinstance(self.shape, pymunk.Poly)
        return self.shape.get_vertices()

    def room(self, center: Vector, radius: float) -> float:
        """Return the gap (m) of a ball, or of its centre to a pocket's rim; negative inside."""
        if self.is_drawn:
            return self.shape.point_query(center).distance - radius
        return places.room_beside(self.wall.sides, *center, radius)

    def holds(self, center: Vector, radius: float) -> bool:
        """Tell whether a ball lies in the obstacle."""
        return places.lies_in(self.wall, self.room(center, radius), *center, radius)

    def lies_across(self, path: Path) -> bool:
        """Tell whether a wall lies between where a path begins and where it is after 1 s."""
        if self.wall.is_pocket or self.room((path.x, path.y), 0.0) <= 0.0:
            return False
        return any(side.time_of_contact(path, 0.0, 0.0) <= 1.0 for side in self.wall.sides)

    def come(self) -> None:
        """Keep what nobody may change of it any more, and let pymunk leave it out."""
        set_apart(self.shape)
        what = "pocket" if self.wall.is_pocket else "wall"
        places = *STANDS[: 1 if self.wall.moves else 3], *SHAPE, *OUTLINES[type(self.shape)]
        self.as_it_came = AsItCame(what, self, places)

    @property
    def name(self) -> str:
        """The number of the wall or pocket, as errors name it."""
        return f"{self.wall.number}"


class Walls:
    """The walls and pockets of a table have numbers of their own, and an engine plays them."""

    def __init__(self, space: pymunk.Space, engine: LiveEngine) -> None:
        self._space, self._engine = space, engine
        self.count = self.holes = 0  # of walls and pockets that were ever put up
        self.obstacles: list[Obstacle] = []
        self.moving: list[tuple[Obstacle, MovingWall]] = []  # those whose bodies are kinematic
        self._left: dict[int, Pose] = {}  # where steps have left walls that move

    @property
    def solid(self) -> list[Obstacle]:
        """The walls, without the pockets."""
        return [each for each in self.obstacles if not each.wall.is_pocket]

    @property
    def pockets(self) -> dict[int, tuple[Vector, float]]:
        """The centre and the radius (m) of each pocket, by its number."""
        its = [each.wall for each in self.obstacles]
        return {hole.number: (hole.center, hole.radius) for hole in its if isinstance(hole, Pocket)}

    @property
    def are_moving(self) -> bool:
        """Tell whether any wall moves."""
        bodies = [each.body for each, _ in self.moving]
        return any(body.velocity != STILL or body.angular_velocity for body in bodies)

    def now(self) -> list[Obstacle]:
        """Return the walls and pockets where they are at this instant: none of them moves."""
        for each, wall in self.moving:
            (x, y, c, s), (u, v) = wall.body.frame(self._engine.now), each.body.center_of_gravity
            at = pymunk.Transform(c, s, -s, c, x - c * u + s * v, y - s * u - c * v)
            each.shape.update(at)  # The next step lets it follow its body again.
        return [replace(each, wall=still(each.wall, self._engine.now)) if each.wall.moves else each
                for each in self.obstacles]  # fmt: skip

    def put(self, obstacle: Obstacle) -> int:
        """Put up a wall or a pocket without a check, and return its number."""
        shape, wall, body = obstacle.shape, obstacle.wall, obstacle.body
        things = [shape] if body is self._space.static_body else [body, shape]
        self._space.add(*[thing for thing in things if thing.space is None])
        self.count += not wall.is_pocket
        self.holes += wall.is_pocket
        wall.categories, wall.mask = shape.filter.categories, shape.filter.mask
        obstacle.come()
        self.obstacles.append(obstacle)
        if isinstance(wall, MovingWall):
            self.moving.append((obstacle, wall))
            stand_still(obstacle, wall, self._engine.now)
        self._engine.put_up(wall)
        return wall.number

    def remove(self, number: int, is_pocket: bool = False) -> None:
        """Take the wall or the pocket of this number out of the space."""
        for each in self.obstacles:
            if each.wall.is_pocket == is_pocket and each.wall.number == number:
                self._take_down(each)
                return
        what = "pocket" if is_pocket else "wall"
        raise setting_error(what, shown(number), f"there is no {what} of this number")

    def drop_lost(self) -> None:
        """Take the walls and pockets down that somebody has taken out of the space."""
        for each in list(self.obstacles):
            is_lost = each.shape.space is not self._space
            if is_lost or (each.wall.moves and each.body.space is not self._space):
                self._take_down(each)

    def _take_down(self, each: Obstacle) -> None:
        self.obstacles.remove(each)
        self.moving = [two for two in self.moving if two[1] is not each.wall]
        each.shape.filter = each.own_filter
        if each.shape.space is self._space:
            self._space.remove(each.shape)
        self._engine.take_down(each.wall)

    # -- walls that move ---------------------------------------------------------------------------

    def stand(self) -> None:
        """Let walls that move stand where their bodies are now."""
        for each, wall in self.moving:
            stand_still(each, wall, self._engine.now)

    def leave(self) -> None:
        """Let walls that move stand where a step has left them."""
        now = self._engine.now
        self._left = {wall.number: stand_still(each, wall, now) for each, wall in self.moving}

    def is_put(self, each: Obstacle) -> bool:
        """Tell whether somebody has put a wall elsewhere since the last step."""
        return pose(each.body) != self._left.get(each.wall.number)

    def plan(self, until: float) -> None:
        """Let walls, which stand, move with their bodies from now until a time (s)."""
        now = self._engine.now
        for each, wall in self.moving:
            (vx, vy), turns, stands = each.body.velocity, each.body.angular_velocity, wall.body
            wall.body = Body((stands.x, stands.y), stands.angle, (vx, vy), turns, now, until)

    def steer(self, dt: float) -> None:
        """Let pymunk's step of ``dt`` (s) take bodies to where walls are, whatever has set them.

        That is so if a callback has set a velocity, which counts from the next step, and if it has
        put up a wall. What a callback has put elsewhere stays there.
        """
        for each, wall in self.moving:
            plan, body = wall.body, each.body
            (vx, vy), turns = body.velocity, body.angular_velocity
            if (vx, vy, turns) == (plan.ux, plan.uy, plan.turns):
                continue
            if pose(body) == ((plan.x, plan.y), plan.angle):
                x, y, _, _ = plan.frame(plan.until)
                move_to(body, (x - dt * vx, y - dt * vy), plan.angle_at(plan.until) - dt * turns)

    def put_back(self) -> None:
        """Put bodies where walls are now, as their motion is cut short."""
        now = self._engine.now
        for each, wall in self.moving:
            x, y, _, _ = wall.body.frame(now)
            move_to(each.body, (x, y), wall.body.angle_at(now))
        self.leave()

    # -- what is refused ---------------------------------------------------------------------------

    def is_off_table(self, new: Vector, known: Iterable[Vector]) -> bool:
        """Tell whether a place (m) is off the table, if walls enclose one of the ``known`` ones."""
        solid = [each for each in self.now() if not each.wall.is_pocket]
        shapes = [each.shape for each in solid if each.is_drawn]
        # A wall with sides of its own is not its shape: such tables are not judged.
        if len(shapes) < len(solid) or enclosed(new, shapes) >= OFF:
            return False
        return any(enclosed(place, shapes) > 0.5 for place in known)

    def refuse_off_table(self, new: Vector, old: Vector) -> None:
        """Refuse a place (m) off the table, if walls enclose the ``old`` place of the ball."""
        if self.is_off_table(new, [old]):
            raise setting_error("position", list(new), OFF_TABLE)

    def refuse_outside(self, new: Vector, balls: Iterable[Vector]) -> None:
        """Refuse a new ball's place (m) outside of joined segments that hold all ``balls``."""
        closed = ring([line_of(each.shape) for each in self.solid if each.stands_as_segment])
        if closed and not lies_among(new, closed):
            its = [lies_among(place, closed) for place in balls]
            if its and all(its):
                raise setting_error("position", list(new), OFF_TABLE)

    def refuse_moved(self, body: pymunk.Body) -> None:
        """Refuse another wall on a body that has moved since the last one came to it."""
        last = next((each for each in reversed(self.obstacles) if each.body is body), None)
        if last is not None:
            last.as_it_came.refuse_changed()

    def refuse_changed(self) -> None:
        """Refuse walls and pockets that somebody has moved or changed."""
        for each in self.obstacles:
            each.as_it_came.refuse_changed()


def pose(body: pymunk.Body) -> Pose:
    """Return where a body is."""
    x, y = body.local_to_world(body.center_of_gravity)
    return (x, y), body.angle


def move_to(body: pymunk.Body, place: Vector, angle: float) -> None:
    """Put a body's center of gravity at a place (m), and turn it to an angle."""
    body.angle = angle
    (x, y), _ = pose(body)
    body.position += place[0] - x, place[1] - y


def stand_still(obstacle: Obstacle, wall: MovingWall, now: float) -> Pose:
    """Let a wall stand where its body is now (s), and return where that is."""
    check_motion(wall.number, obstacle.body)
    place, angle = pose(obstacle.body)
    wall.body = Body(place, angle, STILL, 0.0, now, now)
    return place, angle


def pocket_of(space: pymunk.Space, center: Vector, radius: float, number: int) -> Obstacle:
    """Return a pocket, which has a circle in the space that nothing hits."""
    shape = pymunk.Circle(space.static_body, radius, center)
    shape.sensor = True
    return Obstacle(shape, Pocket(center, radius, number))


def enclosed(place: Vector, shapes: Sequence[pymunk.Shape]) -> float:
    """Return which share of the straight lines from a place crosses an odd number of shapes."""
    corners = [abs(x) for shape in shapes for x in shape.bb]
    far = 4.0 * (max(corners, default=0.0) + abs(place[0]) + abs(place[1]))
    odd = 0
    for k in range(LINES):
        angle = 2.0 * math.pi * (k + 0.5) / LINES  # No line is parallel to x or y.
        end = place[0] + far * math.cos(angle), place[1] + far * math.sin(angle)
        odd += sum(each.segment_query(place, end) is not None for each in shapes) % 2
    return odd / LINES


def line_of(shape: pymunk.Shape) -> Line:
    """Return the ends (m) of a segment that stands."""
    assert isinstance(shape, pymunk.Segment) and shape.body is not None
    (x, y), (u, v) = (shape.body.local_to_world(end) for end in (shape.a, shape.b))
    return (x, y), (u, v)


def ring(lines: list[Line]) -> list[Line]:
    """Return the lines that stay when those with free ends are taken out, so that they close.

    >>> square = [((0.0, 0.0), (1.0, 0.0)), ((1.0, 0.0), (1.0, 1.0)), ((1.0, 1.0), (0.0, 0.0))]
    >>> ring([*square, ((1.0, 1.0), (2.0, 2.0))]) == square, ring(square[1:])
    (True, [])
    """
    while True:
        ends = Counter(chain.from_iterable(lines))
        kept = [(a, b) for a, b in lines if ends[a] > 1 and ends[b] > 1]
        if kept == lines:
            return lines
        lines = kept


def lies_among(place: Vector, lines: Iterable[Line]) -> bool:
    """Tell whether lines (m) lie on all four sides of a place, as on a table that is closed."""
    x, y = place
    rows = [a + (y - b) * (c - a) / (d - b) for (a, b), (c, d) in lines if (b > y) != (d > y)]
    columns = [b + (x - a) * (d - b) / (c - a) for (a, b), (c, d) in lines if (a > x) != (c > x)]
    return bool(rows and columns) and min(rows) < x < max(rows) and min(columns) < y < max(columns)


def sides_of(shape: Drawn) -> list[Side]:
    """Return the faces and corners of a segment, circle or polygon.

    They are those in the world, or, if the body moves, in its frame around its center of gravity.
    """
    body = shape.body
    assert body is not None
    (u, v), moves = body.center_of_gravity, body.body_type == pymunk.Body.KINEMATIC

    def put(place: Vector) -> Vector:
        return (place[0] - u, place[1] - v) if moves else body.local_to_world(place)

    if isinstance(shape, pymunk.Circle):
        x, y = put(shape.offset)
        return [RoundSide((x, y), shape.radius)]
    given = shape.get_vertices() if isinstance(shape, pymunk.Poly) else [shape.a, shape.b]
    corners = [(x, y) for x, y in map(put, given)]
    outline = zip(corners, corners[1:] + corners[:1], strict=True)
    # The faces are those of a polygon's outside.
    faces = [face_between(b, a, shape.radius) for a, b in outline]
    beside = zip([faces[-1], *faces[:-1]], faces, strict=True)
    rounds = [
        RoundSide(corner, shape.radius, before.outward, after.outward)
        for corner, (before, after) in zip(corners, beside, strict=True)
    ]
    return [*faces, *rounds]
