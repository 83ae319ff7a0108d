"""This module gives the engine a press whose numbers are in a record, and which is compiled.

Where compiled shots are loaded, the engine plays persistent contacts by it, in whatever world it
plays: the heavy functions of :mod:`pool_pymunk.physics.pieces` are then those of the compiled loop,
with the same bits.
"""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from pool_pymunk.fast.loop import DECIDE, END, PIECE
from pool_pymunk.fast.records import CROWD, MOST_BALLS, MOST_TOGETHER, nothing
from pool_pymunk.fast.tables import Form
from pool_pymunk.physics.pieces import Piece
from pool_pymunk.physics.pressed import FORM, Press

NUMBERS = ("balls", "contacts", "steps", "rolls")  # of a press, besides its rows


def number(name: str) -> Any:
    """Return a property of a press that is a number of its record."""

    def get(press: RecordPress) -> Any:
        return press.numbers[name][0]

    def put(press: RecordPress, value: Any) -> None:
        press.numbers[name][0] = value

    return property(get, put)


class RecordPress(Press):
    """The rows of this press are those of a record, as Python reads them without NumPy.

    ``play`` is the compiled loop of a form, to which the record belongs.
    """

    is_fixed = True
    balls, contacts, steps, rolls = map(number, NUMBERS)

    def __init__(self, form: Form, play: Any) -> None:
        work = np.zeros(1, dtype=form.work)
        self.play, self.work = play, work
        self.nothing = nothing(form.sides)
        press, self.asks = work["press"], work["scene"][0]
        self.numbers = {name: views(press[name]) for name in NUMBERS}
        self.room = CROWD if form.many else MOST_BALLS, MOST_TOGETHER
        for name in FORM:
            setattr(self, name, views(press[name][0]))

    def piece(self, longest: float) -> Piece:
        """Play a piece, as `piece_of` in physics/pieces.py."""
        time, after, fell, faded = self.ask(PIECE, longest=longest)
        return Piece(time, after, int(fell), bool(faded))

    def decide(self) -> bool:
        """Find forces that fit, as `decide` in physics/complementarity.py."""
        return bool(self.ask(DECIDE)[0])

    def find_end(self, steps: int, longest: float, time: float) -> None:
        """Find the state after a time (s) of a piece, as `part_of` in physics/pieces.py."""
        self.ask(END, steps=steps, longest=longest, time=time)

    def ask(self, what: int, **arguments: float) -> list[float]:
        """Ask the compiled loop, and return its answer."""
        self.asks["asks"] = what
        for name, value in arguments.items():
            self.asks[name] = value
        self.play(self.work, *self.nothing, 0, 0)
        answer: list[float] = self.asks["answer"].tolist()
        return answer


class Presses:
    """These are the presses of a compiled loop; one of an engine that is gone serves again.

    It takes a millisecond or more to make one, so the first one is made ahead.
    """

    def __init__(self, form: Form, play: Any) -> None:
        self.form, self.play = form, play
        self.free = [RecordPress(form, play)]

    def __call__(self, engine: object) -> RecordPress:
        """Return a press for an engine."""
        press = self.free.pop() if self.free else RecordPress(self.form, self.play)
        weakref.finalize(engine, self.free.append, press)
        return press


def views(rows: Any) -> Any:
    """Return views of the rows of an array; those of rows in rows are in lists."""
    return memoryview(rows) if rows.ndim == 1 else [views(row) for row in rows]
