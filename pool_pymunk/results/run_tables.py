"""This module makes the tables of a run: samples, events, persistent contacts, and contacts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pool_pymunk.model import Units
from pool_pymunk.results.contacts import contacts_table
from pool_pymunk.results.events import IMPULSES, two
from pool_pymunk.results.run import Run, energies_of
from pool_pymunk.results.table import Columns, ResultTable, TableColumn

PUSHES = [TableColumn(push, unit="N s") for push in (*IMPULSES, "impulse_x", "impulse_y")]
EVENTS: Columns = ("t", "kind", "ball", "other", "cushion", "pocket", *PUSHES[:3])
SPELL = (TableColumn("since", unit="s"), TableColumn("until", unit="s"))
PERSISTENT: Columns = (*SPELL, "ball", "other", "cushion", *PUSHES[3:])


def table_of(run: Run, what: str, units: Units) -> ResultTable:
    """Return one of a run's tables; samples and contacts are in ``units``."""
    if what == "events":
        return ResultTable(EVENTS, (
            (e.t, e.kind, *two(e.balls), e.cushion, e.pocket, *e.impulses) for e in run.events
        ))  # fmt: skip
    if what == "persistent":
        return ResultTable(PERSISTENT, (
            (c.since, c.until, *two(c.balls), c.cushion, *c.impulse) for c in run.persistent
        ))  # fmt: skip
    if what == "contacts":
        return contacts_table(run.contacts, units)
    lengths = (TableColumn(axis, unit=units.length) for axis in "xy")
    speeds = (TableColumn(f"v{axis}", unit=units.speed) for axis in "xy")
    time, energy = TableColumn("t", unit="s"), TableColumn("energy", unit="J")
    return ResultTable((time, "ball", *lengths, *speeds, energy), _samples(run, units))


def _samples(run: Run, units: Units) -> Iterator[list[float | str]]:
    """Yield a row for each time and ball."""
    length, speed = units.to_si(1.0, "length"), units.to_si(1.0, "speed")
    energies = energies_of(run, run.t)[..., np.newaxis]
    samples = np.concatenate((run.position / length, run.velocity / speed, energies), axis=2)
    for t, rows in zip(run.t.tolist(), samples.tolist(), strict=True):
        for ball, row in zip(run.scene.balls, rows, strict=True):
            yield [t, ball.id, *row]
