"""This module keeps the walls and pockets of a table, and where their shapes are."""

from __future__ import annotations

import math

import pymunk

from pool_pymunk.model.places import said
from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.sides import RoundSide, Side, Wall, face_between
from pool_pymunk.world.checks import Obstacle
from pool_pymunk.world.state import LiveState, Phase

WALL = 0x57616C6C  # This is our own collision type.
# This number of lines tells whether walls enclose a place; they are askew, as walls seldom are.
# Within the walls all cross an odd number of them, except through gaps and obstacles.
LINES, SKEW = 32, 0.37
# A place is off the table if fewer lines than this share say that it is on it: beside an obstacle
# up to half of them say the wrong thing, across from two gaps an eighth.
OFF = 0.25


class Walls:
    """The walls and pockets have places in the engine; a place that becomes free is used again."""

    def __init__(self, state: LiveState) -> None:
        self.state = state
        self.count = 0  # of walls that were ever put up
        self._unused: list[int] = []
        self._shapes: dict[int, pymunk.Shape] = {}  # by places
        self.obstacles: dict[int, Obstacle] = {}  # by places
        # the bodies of walls, each with its position (m) and angle
        self._bodies: dict[pymunk.Body, tuple[Vector, float]] = {}

    def put_if_free(self, shape: pymunk.Shape, obstacle: Obstacle) -> int:
        """Put up a wall or a pocket if no ball lies in it now, and return its number."""
        shape.cache_bb()  # A shape outside of the space does not know where it is.
        for number, (place, radius) in self.state.discs().items():
            if obstacle.holds(place, radius):
                center, room = obstacle.wall.center, obstacle.room(place, radius)
                if center is not None:
                    message = "a ball lies within this pocket"
                    raise setting_error("position", list(center), message)
                message = said(f"ball {number}", "this wall", room, radius)
                raise setting_error("shape", type(shape).__name__, message)
        return self.put(shape, obstacle)

    def put(self, shape: pymunk.Shape, obstacle: Obstacle) -> int:
        """Put up a wall or a pocket of which nothing is wrong, unchecked, and return its number."""
        state, wall, walls = self.state, obstacle.wall, self.state.engine.walls
        state.join(shape)
        assert shape.body is not None
        self._bodies[shape.body] = shape.body.position, shape.body.angle
        self.count += not wall.is_pocket
        place = self._unused.pop() if self._unused else len(walls)
        walls[place : place + 1] = [wall]
        state.near.numbers[shape] = -1 - place
        self._shapes[place], self.obstacles[place] = shape, obstacle
        shape.collision_type = WALL
        if state.phase is Phase.TELLING:  # pymunk reports what is near in the next step only.
            for i in state.moving:
                state.engine.meet_wall(i, place)
        return wall.number

    def remove(self, number: int) -> bool:
        """Take a wall out of the space, and tell whether there was one of this number."""
        walls = [(k, each.wall) for k, each in self.obstacles.items() if not each.wall.is_pocket]
        place = next((k for k, wall in walls if wall.number == number), None)
        if place is None:
            return False
        state, shape = self.state, self._shapes.pop(place)
        del self.obstacles[place]
        state.near.forget(shape)
        shape.collision_type = 0
        if shape.space is not None:
            state.space.remove(shape)
        bodies = {each.body for each in self._shapes.values()}
        self._bodies = {body: at for body, at in self._bodies.items() if body in bodies}
        state.engine.walls[place] = Wall((), 0.0, 0.0, -1)
        self._unused.append(place)
        state.predict_anew()
        return True

    def refuse_off_table(self, old: Vector, new: Vector) -> None:
        """Refuse a place (m) off the table, if walls enclose the ``old`` place of the ball."""
        # The shape of a wall with sides of its own is not the wall: such tables are not judged.
        walls = [each for each in self.obstacles.values() if not each.wall.is_pocket]
        is_drawn = all(each.shape is not None for each in walls)
        if is_drawn and self._enclosed(old) > 0.5 and self._enclosed(new) < OFF:
            raise setting_error("position", list(new), "the ball would lie off the table")

    def _enclosed(self, place: Vector) -> float:
        """Return which share of the straight lines from a place crosses an odd number of walls."""
        shapes = [self._shapes[k] for k, each in self.obstacles.items() if not each.wall.is_pocket]
        corners = [abs(x) for shape in shapes for x in shape.bb] or [0.0]
        far = 4.0 * (max(corners) + abs(place[0]) + abs(place[1]))
        odd = 0
        for k in range(LINES):
            angle = 2.0 * math.pi * (k + SKEW) / LINES
            end = place[0] + far * math.cos(angle), place[1] + far * math.sin(angle)
            odd += sum(each.segment_query(place, end) is not None for each in shapes) % 2
        return odd / LINES

    def refuse_moved(self) -> None:
        """Refuse the present step if walls have moved, and put the balls back on their paths."""
        for body, (place, angle) in self._bodies.items():
            if body.position != place or body.angle != angle:
                self.state.tick(-1)
                for ball in self.state.on_table():
                    self.state.carry(ball)
                message = "a wall's body stands still: to move a wall, remove it and add it again"
                raise setting_error("position", list(body.position), message)


def sides_of(shape: pymunk.Shape) -> tuple[Side, ...]:
    """Return the faces and corners of a static segment, circle or polygon."""
    body = shape.body
    assert body is not None
    if isinstance(shape, pymunk.Circle):
        center = body.local_to_world(shape.offset)
        return (RoundSide((center[0], center[1]), shape.radius),)
    if isinstance(shape, pymunk.Segment):
        ends = [body.local_to_world(end) for end in (shape.a, shape.b)]
    else:
        assert isinstance(shape, pymunk.Poly), "walls are segments, circles or polygons"
        ends = [body.local_to_world(corner) for corner in shape.get_vertices()]
    corners = [(x, y) for x, y in ends]
    outline = zip(corners, corners[1:] + corners[:1], strict=True)
    # The faces are those of a polygon's outside.
    faces = [face_between(b, a, shape.radius) for a, b in outline]
    return (*faces, *(RoundSide(corner, shape.radius) for corner in corners))
