"""Spells of persistent contacts: from when until when two sides press on each other."""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.motion.times import Vector, unit
from pool_pymunk.core.persistent.persistence import Persisted
from pool_pymunk.core.persistent.touch import Touch

BREAK: Final = 1e-12  # of the time; what is shorter is rounding


@final
class Spell:
    """A spell is the time in which a contact persists without a break, with its impulse (N s)."""

    __slots__ = ("a", "b", "cushion", "since", "touch", "until", "x", "y")

    def __init__(self, a: int, b: int, cushion: int, since: float, touch: Touch) -> None:
        self.a = a
        self.b = b
        self.cushion = cushion
        self.touch = touch  # of the group in which the contact was last
        self.since = since
        self.until = since
        self.x = self.y = 0.0

    @property
    def is_one(self) -> bool:
        """This tells whether the contact has lasted, or has given an impulse."""
        return self.until > self.since or self.x != 0.0 or self.y != 0.0

    @property
    def place(self) -> tuple[float, float, float, float]:
        """Where its sides have touched last (m), and the normal, which points to the last ball."""
        a, b, side, r = self.touch.a, self.touch.b, self.touch.side, self.touch.a.ball.radius
        if b is None:
            assert side is not None, "a touch has another side"
            nx, ny = side.normal(a.x, a.y)
            return a.x - r * nx, a.y - r * ny, nx, ny
        if a.ball.number > b.ball.number:
            a, b, r = b, a, b.ball.radius
        nx, ny = unit(b.x - a.x, b.y - a.y)
        return a.x + r * nx, a.y + r * ny, nx, ny

    @property
    def row(self) -> Persisted:
        return self.a, self.b, self.cushion, self.since, self.until, self.x, self.y


@final
class Spells:
    """The spells of a run; groups add the pieces of their contacts, and solvers ask for the rows.

    A contact that goes on in another group, without a break, is in the same spell.
    """

    def __init__(self) -> None:
        self.last: dict[tuple[int, int, int], Spell] = {}
        self.over: list[Spell] = []

    def clear(self) -> None:
        """Forget all spells, for another run."""
        self.last.clear()
        self.over.clear()

    def add(self, one: Touch, since: float, until: float, impulse: Vector) -> None:
        """Add what a contact has given to its last ball in some time (s)."""
        x, y = impulse
        a, b, cushion = one.a.ball.number, -1, -1
        if one.b is not None:
            b = one.b.ball.number
            if a > b:
                a, b, x, y = b, a, -x, -y
        elif one.wall is not None:
            cushion = one.wall.number
        key = a, b, cushion
        spell = self.last.get(key)
        if spell is None or since - spell.until > BREAK * since:
            if spell is not None:
                self.over.append(spell)
            spell = self.last[key] = Spell(a, b, cushion, since, one)
        spell.until, spell.touch = max(spell.until, until), one
        spell.x, spell.y = spell.x + x, spell.y + y

    def rows(self) -> list[Persisted]:
        """Return the rows of all spells."""
        spells = [*self.over, *self.last.values()]
        return [spell.row for spell in spells if spell.is_one]
