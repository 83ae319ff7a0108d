"""This module has what users of a table hold in hand: balls, contacts, and a table's state."""

from __future__ import annotations

from typing import NamedTuple

import pymunk

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.persistent import History
from pool_pymunk.engine.recorder import Motion
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path


class Ball:
    """A ball has a number, its circle and body, and a sensor that feels what is near.

    ``is_on_table`` says whether it has not been pocketed or removed.
    """

    __slots__ = ("_engine", "before", "body", "circle", "id", "is_on_table", "joint", "number",
                 "radius", "sensor", "shapes", "type")  # fmt: skip

    def __init__(
        self, number: int, circle: pymunk.Circle, sensor: pymunk.Circle, engine: ContactEngine
    ) -> None:
        assert circle.body is not None
        self.number = number
        self.radius = circle.radius
        self.circle = circle
        self.sensor = sensor
        self.body = circle.body
        self.id = circle.body.id
        self.joint: pymunk.PivotJoint | None = None  # This is the friction while the ball moves.
        self.is_on_table = True
        self.type = circle.collision_type
        # what leaves the space with the ball, and comes back with it
        self.shapes: tuple[pymunk.Shape, ...] = ()
        self.before: Path | None = None  # its path before the contact of which on_contact tells
        self._engine = engine

    def __repr__(self) -> str:
        where = "" if self.is_on_table else ", off the table"
        return f"<Ball {self.number} at {tuple(self.body.position)}{where}>"

    @property
    def path(self) -> Path:
        """The ball's exact path; for ``on_contact`` it is the path before the contact."""
        return self.before or self._engine.paths[self.number]


class ContactEvent(NamedTuple):
    """A contact event tells when (s) a contact was answered, and whose it was.

    ``balls`` are two balls, or one ball that met the wall of number ``wall``. They touched at
    ``point`` (m). ``normal`` is the unit vector from the first ball to the second, or from the wall
    to the ball, and ``closing`` (m/s) is how fast they came together. ``ball.path.at(event.t)`` has
    a ball's place and velocity before the contact; its body is still where the step took it.
    """

    t: float
    balls: tuple[Ball, ...]
    wall: int | None
    point: Vector
    normal: Vector
    closing: float


class TableState(NamedTuple):
    """A table's state has the time (s), each ball's motion (m, m/s), and which contacts last.

    Balls are numbers, so a state can be pickled.
    """

    time: float
    motions: dict[int, Motion]
    history: dict[tuple[int, int], History]
