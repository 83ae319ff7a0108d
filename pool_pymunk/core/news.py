"""News tell a live table what happens while it plays, until the table has read them."""

from __future__ import annotations

from typing import final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.motion.path import Motion
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.persistent.spells import Spell
from pool_pymunk.core.record import BALL_BALL, BALL_CUSHION, POCKET, STOP, Recorder
from pool_pymunk.core.walls.wall import Pocket, Wall

JAM = "jam"


@final
class Event:
    """An event is of a ``kind``, at ``t`` (s), of balls ``a`` and ``b`` (-1 if there is none).

    ``wall`` is the number of a wall or a pocket, or -1. For contacts, the rest is as in
    :class:`pool_pymunk.world.ContactEvent`; ``since`` is infinite for a hit.
    """

    def __init__(self, t: float, kind: str, a: int, b: int, wall: int) -> None:
        self.t = t
        self.kind = kind
        self.a = a
        self.b = b
        self.wall = wall
        self.px = self.py = self.nx = self.ny = 0.0
        self.closing = self.normal = self.along = 0.0
        self.since = INF


@final
class News(Recorder):
    """The news are a list of events; the live table says of which it wants to hear.

    Nobody hears of hits that close more slowly than ``least`` (m/s).
    """

    def __init__(self) -> None:
        self.hears_contacts = False
        self.hears_stops = False
        self.hears_jams = False
        self.least = 0.0
        self.events: list[Event] = []

    @property
    def hears_persistent(self) -> bool:
        """This tells whether anybody hears of contacts that have persisted."""
        return self.hears_contacts and self.least <= 0.0

    def take(self) -> list[Event]:
        """Return what has happened since the last time."""
        events, self.events = self.events, []
        return events

    def contact(self, one: Contact, t: float) -> None:
        if not self.hears_contacts:
            return
        a, b, wall, nx, ny = one.a, one.b, one.wall, one.nx, one.ny
        if b is not None:
            closing = (a.before_x - b.before_x) * nx + (a.before_y - b.before_y) * ny
            event = Event(t, BALL_BALL, a.ball.number, b.ball.number, -1)
        else:
            closing = -((a.before_x - one.ux) * nx + (a.before_y - one.uy) * ny)
            number = -1 if wall is None else wall.number
            event = Event(t, BALL_CUSHION, a.ball.number, -1, number)
        if closing < self.least:
            return
        event.px, event.py, event.nx, event.ny = one.px, one.py, nx, ny
        event.closing, event.normal, event.along = closing, one.normal, one.along
        self.events.append(event)

    def persistent(self, spell: Spell) -> None:
        """Take note that a contact is over which has persisted."""
        kind = BALL_CUSHION if spell.b < 0 else BALL_BALL
        event = Event(spell.until, kind, spell.a, spell.b, spell.cushion)
        event.px, event.py, event.nx, event.ny = spell.place
        event.normal = spell.x * event.nx + spell.y * event.ny
        event.along = spell.y * event.nx - spell.x * event.ny
        event.since = spell.since
        self.events.append(event)

    def stop(self, ball: Ball, t: float, place: Vector) -> None:
        if self.hears_stops:
            # In one instant a ball may come to rest in each of many rounds of hits.
            self.events = [e for e in self.events if not (e.kind == STOP and e.a == ball.number)]
            self.events.append(Event(t, STOP, ball.number, -1, -1))

    def pocketed(self, ball: Ball, pocket: Pocket, t: float, motion: Motion) -> None:
        self.events.append(Event(t, POCKET, ball.number, -1, pocket.number))

    def jammed(self, ball: Ball, wall: Wall, t: float) -> None:
        if self.hears_jams:
            self.events.append(Event(t, JAM, ball.number, -1, wall.number))
