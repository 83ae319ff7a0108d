"""This module keeps the walls and pockets of a table, and where their shapes are."""

from __future__ import annotations

import pymunk

from pool_pymunk.model.places import lies_in, said
from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.sides import Post, Side, Wall, face_between, pocket
from pool_pymunk.world.broad_phase import EVERYTHING
from pool_pymunk.world.outlook import room
from pool_pymunk.world.state import Phase, State

WALL = 0x57616C6C  # This is our own collision type.


class Walls:
    """The walls and pockets have places in the engine; a place that becomes free is used again."""

    def __init__(self, state: State) -> None:
        self.state = state
        self.count = 0  # of walls that were ever put up
        self._unused: list[int] = []
        self._shapes: dict[int, pymunk.Shape] = {}  # by places
        self._carriers: set[pymunk.Shape] = set()  # shapes of walls whose sides are others
        # the bodies of walls, each with its position (m) and angle
        self._bodies: dict[pymunk.Body, tuple[Vector, float]] = {}

    def obstacles(self) -> list[tuple[pymunk.Shape | None, Wall]]:
        """Return the walls and pockets, each with its shape if the sides are those of the shape."""
        walls, carriers = self.state.engine.walls, self._carriers
        return [
            (None if shape in carriers else shape, walls[k]) for k, shape in self._shapes.items()
        ]

    def refuse_on_balls(self, shape: pymunk.Shape, wall: Wall, has_own_sides: bool) -> None:
        """Refuse a wall or a pocket in which a ball lies now."""
        shape.cache_bb()  # A shape outside of the space does not know where it is.
        form = None if has_own_sides else shape
        for number, (place, radius) in self.state.discs().items():
            left = room(place, radius, form, wall)
            if not lies_in(wall, left, *place, radius):
                continue
            if wall.center is not None:
                message = "a ball lies within this pocket"
                raise setting_error("position", list(wall.center), message)
            message = said(f"ball {number}", "this wall", left, radius)
            raise setting_error("shape", type(shape).__name__, message)

    def put_wall(self, shape: pymunk.Shape, wall: Wall, has_own_sides: bool) -> int:
        """Put up a wall of which nothing is wrong, unchecked."""
        self.state.join(shape)
        assert shape.body is not None
        self._bodies[shape.body] = shape.body.position, shape.body.angle
        if has_own_sides:
            self._carriers.add(shape)
        self.count += 1
        self._put(shape, wall)
        return wall.number

    def put_pocket(self, position: Vector, radius: float) -> int:
        """Put up a pocket if no ball lies in it."""
        number = sum(wall.is_pocket for wall in self.state.engine.walls)
        hole = pocket(position, radius, number)
        shape = pymunk.Circle(self.state.space.static_body, radius, position)
        shape.sensor = True
        self.refuse_on_balls(shape, hole, has_own_sides=True)
        self.state.space.add(shape)
        self._put(shape, hole)
        return number

    def _put(self, shape: pymunk.Shape, wall: Wall) -> None:
        """Let balls meet a wall or pocket, which is where its shape is."""
        state = self.state
        walls, near, shape.collision_type = state.engine.walls, state.near, WALL
        near.filters = near.filters or shape.filter != EVERYTHING
        place = self._unused.pop() if self._unused else len(walls)
        walls[place : place + 1] = [wall]
        near.numbers[shape] = -1 - place
        self._shapes[place] = shape
        if state.phase is Phase.TELLING:  # pymunk reports what is near in the next step only.
            for i in state.moving:
                state.engine.meet_wall(i, place)

    def remove(self, number: int) -> bool:
        """Take a wall out of the space, and tell whether there was one of this number."""
        state, walls = self.state, self.state.engine.walls
        own = (k for k in self._shapes if not walls[k].is_pocket and walls[k].number == number)
        place = next(own, None)
        if place is None:
            return False
        shape = self._shapes.pop(place)
        state.near.forget(shape)
        self._carriers.discard(shape)
        shape.collision_type = 0
        if shape.space is not None:
            state.space.remove(shape)
        if shape.body is not None and shape.body not in {
            each.body for each in self._shapes.values()
        }:
            self._bodies.pop(shape.body, None)
        walls[place] = Wall((), 0.0, 0.0, -1)
        self._unused.append(place)
        state.predict_anew()
        return True

    def refuse_moved(self) -> None:
        """Refuse a step in which balls may meet something if walls have moved."""
        for body, (place, angle) in self._bodies.items():
            if body.position != place or body.angle != angle:
                message = "a wall's body stands still: to move a wall, remove it and add it again"
                raise setting_error("position", list(body.position), message)


def sides_of(shape: pymunk.Shape) -> tuple[Side, ...]:
    """Return the faces and corners of a static segment, circle or polygon."""
    body = shape.body
    assert body is not None
    if isinstance(shape, pymunk.Circle):
        center = body.local_to_world(shape.offset)
        return (Post((center[0], center[1]), shape.radius),)
    if isinstance(shape, pymunk.Segment):
        ends = [body.local_to_world(end) for end in (shape.a, shape.b)]
    else:
        assert isinstance(shape, pymunk.Poly), "walls are segments, circles or polygons"
        ends = [body.local_to_world(corner) for corner in shape.get_vertices()]
    corners = [(x, y) for x, y in ends]
    outline = zip(corners, corners[1:] + corners[:1], strict=True)
    # The faces are those of a polygon's outside.
    faces = [face_between(b, a, shape.radius) for a, b in outline]
    return (*faces, *(Post(corner, shape.radius) for corner in corners))
