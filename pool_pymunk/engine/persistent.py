"""Persistent contacts are those of balls that surface friction presses together.

They would touch all the time. Instead they hit each other once in a contact time, in
micro-collisions (:mod:`pool_pymunk.engine.decisions`), which are no events; a warning names the
balls. The error is of second order in the contact time for two balls, of first for a cluster. A
ball that its roll presses to a wall is played alike, and so is a ball that runs along the inside of
an arc, on which v^2 / R presses it. Their bounces add no energy. A ball that rolls goes on rolling
through micro-collisions, as long as surface friction can turn its roll.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from pool_pymunk.engine import decisions
from pool_pymunk.physics.contact import NO_BALL, Contact
from pool_pymunk.physics.path import NOT_MET, Path, Persistent
from pool_pymunk.physics.surface import Surface

# the numbers of two balls, the lower one first; a wall is -1 less the number of its cushion
Two = tuple[int, int]


class History(NamedTuple):
    """A history tells when two balls met, after which they were not apart for long."""

    met: float  # s
    last: float  # s; the time of their last hit
    hits: int  # micro-collisions


class ContactStage(NamedTuple):
    """A stage says how far a persistent contact has come when its balls touch again."""

    least: float = 0.0  # m/s; the least bounce
    faint: float = 0.0  # m/s; slower closing is no hit yet
    past: History | None = None  # None for balls that meet anew
    is_micro: bool = False
    time: float = 0.0  # s; the contact time


MEETS = ContactStage()


class PersistentContacts:
    """Each pair of balls has a history, from which its contact time follows, times ``longer``."""

    def __init__(self, paths: Sequence[Path], radii: Sequence[float], surface: Surface) -> None:
        self.paths = paths
        self.radii = radii
        self.roll = surface.roll
        self.pull = surface.pull
        self.rolls = surface.rolls
        self.longer = 1.0
        self.history: dict[Two, History] = {}

    def forget(self, i: int) -> None:
        """Forget ball ``i``, which meets nothing any more."""
        for pair in [pair for pair in self.history if i in pair]:
            del self.history[pair]

    def between(
        self, i: int, j: int, now: float, press: float = 0.0, turn: float = 0.0
    ) -> Persistent:
        """Return the contact time of two balls, or of a ball at a wall, and what is faint in it.

        The wall presses by ``press`` (m/s^2); an arc turns the ball by a radian in ``turn`` (s).
        """
        past, pull = self.history.get((i, j)), self.pull if self.pull > press else press
        if past is None or pull == 0.0:
            return NOT_MET
        end, radius = self.paths[i].end, self.radii[i]
        end = end if end < math.inf else now
        if j >= 0:
            other = self.paths[j].end
            end = other if end < other < math.inf else end
            radius = self.radii[j] if self.radii[j] < radius else radius
        to_go = end - now if end - now > turn else turn
        return decisions.persistent(past, now, to_go, radius, pull, self.longer)

    def is_persistent(self, pair: Two, now: float) -> bool:
        """Tell whether two balls are in persistent contact."""
        past = self.history.get(pair)
        if past is None or past.hits == 0:
            return False
        return decisions.persists(now - past.last, self.between(*pair, now).time)

    def stage(self, contact: Contact, closing: float, now: float) -> ContactStage:
        """Return how far a persistent contact has come, at this ``closing`` speed (m/s)."""
        i, j = pair = pair_of(contact)
        past = self.history.get(pair)
        if past is None:
            return MEETS
        press, turn = self._pressing(contact, now) if j < 0 else (0.0, 0.0)
        time, faint = self.between(i, j, now, press, turn)
        if j < 0:
            least = decisions.least_off(press, time, self.too_slow_to_move(i))
        else:
            least = decisions.least_parting(self.paths[i], self.paths[j], now, time, self.radii[i])
        if not decisions.persists(now - past.last, time):
            return ContactStage(least, faint, time=time)
        pull = max(self.pull, press)
        return ContactStage(least, faint, past, decisions.is_micro(closing, time, pull), time)

    def begin(self, contact: Contact, now: float) -> tuple[float, float]:
        """Return the least bounce (m/s) of a ball that lies at a wall, and its contact time (s).

        The bounce is 0 if nothing presses the ball.
        """
        pair = pair_of(contact)
        self.history.setdefault(pair, History(now, now, 0))
        press, turn = self._pressing(contact, now)
        time = self.between(*pair, now, press, turn).time
        return decisions.least_off(press, time, self.too_slow_to_move(contact.a)), time

    def roll_into(self, contact: Contact, now: float) -> float:
        """Return the part of a ball's roll (m/s) along the normal of its wall; -1 without rolls."""
        if not self.rolls:
            return -1.0
        wx, wy = self.roll(self.paths[contact.a], now)
        return abs(wx * contact.normal[0] + wy * contact.normal[1])

    def _pressing(self, contact: Contact, now: float) -> tuple[float, float]:
        """Return how strongly (m/s^2) a wall presses, and the time (s) in which it turns a ball."""
        path, bends = self.paths[contact.a], contact.curvature
        press = decisions.pressing(path, contact.normal, bends, now)
        return press, decisions.turning_time(path, bends, press)

    def note(self, contact: Contact, stage: ContactStage, now: float) -> int:
        """Note a hit of two balls, and return how many micro-collisions they have had."""
        if self.pull == 0.0 and contact.curvature >= 0.0:
            return 0
        pair, past = pair_of(contact), stage.past
        before = self.history.get(pair)
        hits = stage.is_micro if before is None else before.hits + stage.is_micro
        self.history[pair] = History(now if past is None else past.met, now, hits)
        return hits

    def too_slow_to_move(self, i: int) -> float:
        """Return the speed (m/s) at which ball ``i`` would stop before its place changes."""
        path = self.paths[i]
        return decisions.too_slow_to_move(self.pull, path.x, path.y, self.radii[i])


def pair_of(contact: Contact) -> Two:
    """Return the numbers of the two sides of a contact."""
    return contact.a, contact.b if contact.b != NO_BALL else -1 - (contact.cushion or 0)
