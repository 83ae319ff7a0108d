"""This module keeps the walls and pockets of a table, and where their shapes are."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from functools import partial

import pymunk

from pool_pymunk.model.places import said
from pool_pymunk.model.problems import LARGEST, SettingError, setting_error, shown
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.moving import MovingWall
from pool_pymunk.physics.path import motion_at
from pool_pymunk.physics.sides import Face, RoundSide, Wall, face_between
from pool_pymunk.world.ball import HAIR, TYPES, TableBall
from pool_pymunk.world.bodies import Snapshot
from pool_pymunk.world.broad_phase import may_collide
from pool_pymunk.world.checks import WALL, Obstacle, changed_error
from pool_pymunk.world.movers import Mover
from pool_pymunk.world.state import LiveState, Phase

# Lines from a place within walls cross an odd number of them, except through gaps and obstacles.
# OFF is a share of the lines. Of 4,576 places on and off tables with six gaps, 32 or 64 lines
# misjudge none, and 16 lines misjudge five; half or twice OFF misjudges 163 or 8.
LINES, OFF = 32, 0.25

Features = tuple[object, ...]  # the values of these keys, and of those of a kind of shapes
BODY = ("body_type", "body.position", "body.angle")
SHAPE = ("radius", "sensor", "filter", "collision_type", "body")
OUTLINES = {pymunk.Segment: ("a", "b"), pymunk.Circle: ("offset",), pymunk.Poly: ("corners",)}
# At most this many walls are looked at in a step, in turn: one takes 2 us, a polygon 15 us.
AT_ONCE = 12


class Walls:
    """The walls and pockets have places in the engine; a place that becomes free is used again."""

    def __init__(self, state: LiveState) -> None:
        self.state = state
        self.count = self.holes = 0  # of walls and pockets that were ever put up
        self._unused: list[int] = []
        self.obstacles: dict[int, Obstacle] = {}  # by places
        # the bodies of walls, and their shapes by places, as they came to the table
        self._bodies: dict[pymunk.Body, Features] = {}
        self._shapes: dict[int, Features] = {}
        self._turn = 0
        self.movers: dict[int, Mover] = {}  # the walls that move, by places

    def put_if_free(self, obstacle: Obstacle) -> int:
        """Put up a wall or a pocket if no ball lies in it now, and return its number."""
        obstacle.shape.cache_bb()  # A shape outside of the space does not know where it is.
        for ball, (place, radius) in self.state.discs().items():
            if obstacle.holds(place, radius):
                center, room = obstacle.wall.center, obstacle.room(place, radius)
                if center is not None:
                    message = "a ball lies within this pocket"
                    raise setting_error("position", list(center), message)
                message = said(f"ball {ball.number}", "this wall", room, radius, None)
                raise setting_error("shape", type(obstacle.shape).__name__, message)
        return self.put(obstacle)

    def put(self, obstacle: Obstacle) -> int:
        """Put up a wall or a pocket without a check, and return its number."""
        (shape, wall, _), state, walls = obstacle, self.state, self.state.engine.walls
        state.engine.take_over()
        assert shape.body is not None
        if shape.body is not state.space.static_body:
            state.join(shape.body)
        state.join(shape)
        self._bodies.setdefault(shape.body, body_features(shape.body))
        self.count += not wall.is_pocket
        self.holes += wall.is_pocket
        place = self._unused.pop() if self._unused else len(walls)
        walls[place : place + 1] = [wall]
        state.near.numbers[shape] = -1 - place
        shape.collision_type = WALL
        self.obstacles[place], self._shapes[place] = obstacle, shape_features(shape)
        if isinstance(wall, MovingWall):
            self.movers[place] = Mover(shape.body, shape, wall.moving, wall.number)
            state.engine.movers[wall.number] = place
            self.movers[place].stand()
        paths = state.engine.paths
        if any(paths[i].t < state.now for i in state.moving):  # They may have crossed it then.
            state.predict_anew()
        if state.phase is Phase.TELLING:  # pymunk reports only in the next step what is near.
            for i in state.moving:
                state.engine.meet_wall(i, place)
        return wall.number

    def plan(self) -> None:
        """Let walls move with their bodies in the step that begins, and ask what they may meet."""
        state, engine = self.state, self.state.engine
        engine.struck.clear()
        engine.met.clear()
        engine.squeezed.clear()
        end = state.end_of_step()
        until = min(end, state.latest)
        for place, mover in self.movers.items():
            state.near.swept[place] = mover.plan(state.time, until, end), mover.shape.filter
        engine.now = state.time
        if engine.foresees():
            if engine.upcoming() <= until:
                state.wake = -math.inf
            return
        for place, mover in self.movers.items():
            for ball in self.balls_in(mover, until - state.time, state.near.swept[place][0]):
                state.near.pairs[ball.number, -1 - place] = None

    def balls_around(self, mover: Mover, seen: Snapshot) -> list[TableBall]:
        """Return the balls whose bodies were seen around a wall, by a look at all of them at once.

        Bodies are on their paths, to rounding.
        """
        balls, (left, bottom, right, top) = self.state.ball_of, mover.shape.bb
        far = (1.0 + HAIR) * max((ball.radius for ball in balls.values()), default=0.0)
        far += HAIR * (abs(left) + abs(right) + abs(bottom) + abs(top))
        found = set(seen.within((left - far, bottom - far, right + far, top + far)))
        return [ball for body, ball in balls.items() if body in found] if found else []

    def balls_in(
        self,
        mover: Mover,
        time: float,
        box: pymunk.BB | None = None,
        among: Collection[TableBall] | None = None,
    ) -> list[TableBall]:
        """Return the balls that may come into a box (m) within a time (s), by default the wall's.

        Balls that collide with no such wall are left out. Look ``among`` some only, or at all.
        """
        left, bottom, right, top = box or mover.shape.bb
        paths, speeds, now = self.state.engine.paths, self.state.engine.speeds, self.state.time
        found = []
        for ball in self.state.ball_of.values() if among is None else among:
            i = ball.number
            x, y, _, _ = motion_at(paths[i], now)
            far = ball.radius * (1.0 + HAIR) + min(speeds[i], LARGEST) * time
            is_near = left - far <= x <= right + far and bottom - far <= y <= top + far
            if is_near and may_collide(ball.circle.filter, mover.shape.filter):
                found.append(ball)
        return found

    def finish(self) -> None:
        """Let walls stand that have moved in the present step."""
        for mover in self.movers.values():
            mover.finish(self.state.time)

    @property
    def are_moving(self) -> bool:
        """Tell whether any wall moves."""
        bodies = [mover.body for mover in self.movers.values()]
        return any(body.velocity != (0.0, 0.0) or body.angular_velocity for body in bodies)

    def remove(self, number: int, is_pocket: bool = False) -> None:
        """Take the wall or the pocket of this number out of the space."""
        for place, each in self.obstacles.items():
            if each.wall.is_pocket == is_pocket and each.wall.number == number:
                self._take_down([place])
                return
        what = "pocket" if is_pocket else "wall"
        raise setting_error(what, shown(number), f"there is no {what} of this number")

    def drop_lost(self) -> None:
        """Take the walls and pockets down whose shapes somebody took out of the space."""
        space, walls = self.state.space, self.obstacles.items()
        lost = [place for place, each in walls if each.shape.space is not space]
        lost += [
            place for place, mover in self.movers.items()
            if place not in lost and mover.body.space is not space
        ]  # fmt: skip
        if lost:
            self._take_down(lost)

    def _take_down(self, places: Sequence[int]) -> None:
        """Take the walls and pockets at these places out of the engine, and out of the space."""
        state = self.state
        state.engine.take_over()
        for place in places:
            shape = self.obstacles.pop(place).shape
            if (mover := self.movers.pop(place, None)) is not None:
                del state.engine.movers[mover.number]
                state.engine.jams = {key for key in state.engine.jams if key[1] != place}
            del self._shapes[place]
            state.near.forget(shape)
            shape.collision_type = 0
            state.take_out(shape)
            state.engine.walls[place] = Wall((), 0.0, 0.0, -1)
            self._unused.append(place)
        bodies = {each.shape.body for each in self.obstacles.values()}
        self._bodies = {body: at for body, at in self._bodies.items() if body in bodies}
        state.predict_anew()

    def refuse_off_table(self, old: Vector, new: Vector) -> None:
        """Refuse a place (m) off the table, if walls enclose the ``old`` place of the ball."""
        walls = [each for each in self.obstacles.values() if each.is_solid]
        shapes = [each.shape for each in walls if each.is_drawn]
        # A wall with sides of its own is not its shape: such tables are not judged.
        is_judged = len(shapes) == len(walls)
        if is_judged and enclosed(old, shapes) > 0.5 and enclosed(new, shapes) < OFF:
            raise setting_error("position", list(new), "the ball would lie off the table")

    def _in_turn(self) -> Sequence[int]:
        """Return the places of the walls and pockets that are to be looked at next."""
        places = list(self._shapes)
        if len(places) > AT_ONCE:
            self._turn = (self._turn + AT_ONCE) % len(places)
            places = (places + places)[self._turn : self._turn + AT_ONCE]
        return places

    def refuse_changed(self, some: bool = False) -> None:
        """Refuse walls and pockets that somebody has moved or changed; look only at ``some``."""
        for body, was in self._bodies.items():
            if (now := body_features(body)) != was:
                its = next(each for each in self.obstacles.values() if each.shape.body is body)
                raise _changed(its, BODY, was, now)
        for place in self._in_turn() if some else self._shapes:
            was, shape = self._shapes[place], (its := self.obstacles[place]).shape
            if (now := shape_features(shape)) != was:
                raise _changed(its, (*SHAPE, *OUTLINES[type(shape)]), was, now)


def body_features(body: pymunk.Body) -> Features:
    """Return what nobody may change of the body of a wall."""
    if body.body_type == pymunk.Body.KINEMATIC:
        return (TYPES[body.body_type],)
    return TYPES[body.body_type], body.position, body.angle


def shape_features(shape: pymunk.Shape) -> Features:
    """Return what nobody may change of the shape of a wall."""
    assert isinstance(shape, pymunk.Segment | pymunk.Circle | pymunk.Poly), "walls are these"
    outline: Features = ()
    if isinstance(shape, pymunk.Segment):
        outline = shape.a, shape.b
    elif isinstance(shape, pymunk.Circle):
        outline = (shape.offset,)
    else:
        outline = (shape.get_vertices(),)
    return shape.radius, shape.sensor, shape.filter, shape.collision_type, shape.body, *outline


def _changed(obstacle: Obstacle, keys: Sequence[str], was: Features, now: Features) -> SettingError:
    wall = obstacle.wall
    what = "pocket" if wall.is_pocket else "wall"
    return changed_error(what, wall.number, zip(keys, now, was, strict=False))


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


def around(center: Vector, place: Vector) -> Vector:
    """Return where a place (m) lies from a center."""
    return place[0] - center[0], place[1] - center[1]


def sides_of(shape: pymunk.Shape) -> tuple[Face | RoundSide, ...]:
    """Return the faces and corners of a segment, circle or polygon.

    They are those in the world, or, if the body moves, in its frame around its center of gravity.
    """
    body = shape.body
    assert body is not None
    put: Callable[[Vector], Vector] = body.local_to_world
    if body.body_type == pymunk.Body.KINEMATIC:
        put = partial(around, body.center_of_gravity)
    if isinstance(shape, pymunk.Circle):
        center = put(shape.offset)
        return (RoundSide((center[0], center[1]), shape.radius),)
    if isinstance(shape, pymunk.Segment):
        ends = [put(end) for end in (shape.a, shape.b)]
    else:
        assert isinstance(shape, pymunk.Poly), "walls are segments, circles or polygons"
        ends = [put(corner) for corner in shape.get_vertices()]
    corners = [(x, y) for x, y in ends]
    outline = zip(corners, corners[1:] + corners[:1], strict=True)
    # The faces are those of a polygon's outside.
    faces = [face_between(b, a, shape.radius) for a, b in outline]
    beside = zip([faces[-1], *faces[:-1]], faces, strict=True)
    rounds = [
        RoundSide(corner, shape.radius, before.outward, after.outward)
        for corner, (before, after) in zip(corners, beside, strict=True)
    ]
    return (*faces, *rounds)
