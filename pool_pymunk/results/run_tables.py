"""This module makes the tables of a run: samples, events, persistent contacts, and contacts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pool_pymunk.model import Units
from pool_pymunk.results.contacts import contacts_table
from pool_pymunk.results.events import IMPULSES, two
from pool_pymunk.results.run import Run, energies_of
from pool_pymunk.results.table import ResultTable, TableColumn, numbers

KIND, BALL, OTHER, POCKET = (
    TableColumn(key, missing="") for key in ("kind", "ball", "other", "pocket")
)
SIDES = BALL, OTHER, TableColumn("cushion", missing=-1)


def samples(run: Run, units: Units) -> ResultTable:
    """Return a row for each time and ball."""
    length, speed = units.to_si(1.0, "length"), units.to_si(1.0, "speed")
    energies = energies_of(run, run.t)[..., np.newaxis]
    values = np.concatenate((run.position / length, run.velocity / speed, energies), axis=2)
    columns = (
        *numbers("s", "t"), BALL, *numbers(units.length, "x", "y"),
        *numbers(units.speed, "vx", "vy"), *numbers("J", "energy"),
    )  # fmt: skip
    return ResultTable(columns, [
        [t, id_, *row]
        for t, rows in zip(run.t.tolist(), values.tolist(), strict=True)
        for id_, row in zip(run.scene.index, rows, strict=True)
    ])  # fmt: skip


def events(run: Run, _: Units) -> ResultTable:
    """Return a row for each event."""
    return ResultTable(("t", KIND, *SIDES, POCKET, *numbers("N s", *IMPULSES)), [
        (e.t, e.kind, *two(e.balls), e.cushion, e.pocket, *e.impulses) for e in run.events
    ])  # fmt: skip


def persistent(run: Run, _: Units) -> ResultTable:
    """Return a row for each persistent contact."""
    times, impulse = numbers("s", "since", "until"), numbers("N s", "impulse_x", "impulse_y")
    return ResultTable((*times, *SIDES, *impulse), [
        (c.since, c.until, *two(c.balls), c.cushion, *c.impulse) for c in run.persistent
    ])  # fmt: skip


TABLES: dict[str, Callable[[Run, Units], ResultTable]] = {
    "samples": samples,
    "events": events,
    "persistent": persistent,
    "contacts": contacts_table,
}
