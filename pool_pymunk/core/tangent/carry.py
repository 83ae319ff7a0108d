"""Changes evolve with the motion of a ball along its path, and so does the time of its end."""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent.change import Change, Column
from pool_pymunk.core.tangent.course import Leg
from pool_pymunk.core.tangent.inputs import DRAG, PULL, UNCHANGED, Inputs

SHARE: Final = 2.0 / 7.0  # of a slip goes to the velocity of a ball that begins to roll


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Ground:
    """The ground says how a leg's ball is slowed down, and how the inputs change that.

    ``rate`` (m/s^2) is the deceleration of sliding or rolling, and ``by`` are its derivatives by
    the inputs. ``slips`` tells whether the ball slides and has a roll, so that its path bends.
    """

    def __init__(self, leg: Leg, table: Table, inputs: Inputs) -> None:
        path, patch, surface = leg.path, leg.patch, table.surface_of(leg.patch)
        self.rolls: Final = surface.rolls
        self.slips = surface.rolls and (path.vx != path.wx or path.vy != path.wy)
        if self.slips or not surface.rolls:
            self.rate, row = surface.pull, PULL
            is_own = patch >= 0 and inputs.own_pull[patch]
        else:
            self.rate, row = surface.drag, DRAG
            is_own = patch >= 0 and inputs.own_drag[patch]
        if isinstance(surface, Falling):  # Its acceleration is no input, and the same everywhere.
            self.rate, is_own = 0.0, True
        self.by: Final = inputs.numbers[UNCHANGED if is_own else row]

    def carry(self, path: Path, changes: list[Change], t: float) -> None:
        """Take changes along a path from its beginning to a time (s)."""
        time = t - path.t
        if self.slips:
            self._carry_bent(path, changes, time)
        elif time > 0.0:
            self._carry_straight(path, changes, time)

    def _carry_straight(self, path: Path, changes: list[Change], time: float) -> None:
        """Take changes along a path on which the ball slows down straight on.

        Friction stops any small velocity of a ball that rests. A slip that is given to a ball that
        rolls is gone at once: it goes on with 5/7 of the change of its velocity, and 2/7 of that of
        its roll.
        """
        vx, vy, rate, rolls, by = path.vx, path.vy, self.rate, self.rolls, self.by
        speed = math.sqrt(vx * vx + vy * vy)
        ux = uy = lost = along = 0.0
        kept, place = 1.0, time
        if speed == 0.0:
            kept = 1.0 if rate == 0.0 else 0.0
            place, time = kept * time, 0.0
        else:
            if rate > 0.0:
                time = min(time, speed / rate)
            lost, ux, uy = rate * time / speed, vx / speed, vy / speed
            kept, place, along = 1.0 - lost, time * (1.0 - lost / 2.0), time * lost / 2.0
        xx, xy, yy, far = ux * ux, ux * uy, uy * uy, time * time / 2.0
        for c, more in zip(changes, by):
            u, v = c.vx, c.vy
            if rolls:
                u, v = (1.0 - SHARE) * u + SHARE * c.wx, (1.0 - SHARE) * v + SHARE * c.wy
            if u == 0.0 and v == 0.0 and more == 0.0:
                if rolls:
                    c.vx, c.vy, c.wx, c.wy = u, v, u, v
                continue
            c.x += (place + along * xx) * u + along * xy * v - far * ux * more
            c.y += along * xy * u + (place + along * yy) * v - far * uy * more
            c.vx = (kept + lost * xx) * u + lost * xy * v - time * ux * more
            c.vy = lost * xy * u + (kept + lost * yy) * v - time * uy * more
            if rolls:
                c.wx, c.wy = c.vx, c.vy

    def _carry_bent(self, path: Path, changes: list[Change], time: float) -> None:
        """Take changes along a path on which the ball slips: its acceleration turns with the slip.

        Only a change of the slip across itself turns it.
        """
        ux, uy, rate, by = path.vx - path.wx, path.vy - path.wy, self.rate, self.by
        slip = math.sqrt(ux * ux + uy * uy)
        if rate > 0.0:
            time = min(time, SHARE * slip / rate)
        ux, uy, turn, far, spun = (
            ux / slip, uy / slip, rate / slip, time * time / 2.0, time / GYRATION
        )  # fmt: skip
        for c, more in zip(changes, by):
            across = turn * (uy * (c.vx - c.wx) - ux * (c.vy - c.wy))
            ax, ay = -across * uy - more * ux, across * ux - more * uy
            c.x += time * c.vx + far * ax
            c.y += time * c.vy + far * ay
            c.vx += time * ax
            c.vy += time * ay
            c.wx -= spun * ax
            c.wy -= spun * ay

    def note_end(self, path: Path, changes: list[Change], columns: list[Column]) -> None:
        """Note how much later the path ends, by the changes at its beginning.

        A ball stops after |v| / a, and begins to roll after 2 |u| / (7 a), with its slip u.
        """
        ux, uy, rate, factor = path.vx, path.vy, self.rate, 1.0
        if self.slips:
            ux, uy, factor = ux - path.wx, uy - path.wy, SHARE
        speed = math.sqrt(ux * ux + uy * uy)
        for c, column, more in zip(changes, columns, self.by):
            u, v = c.vx, c.vy
            if self.slips:
                u, v = u - c.wx, v - c.wy
            late = math.nan
            if rate > 0.0 and speed > 0.0:
                grows = (ux * u + uy * v) / (speed * rate)
                late = factor * (grows - speed / rate / rate * more)
            column.late = late
