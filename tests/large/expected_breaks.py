"""The stability suite must break where a table on file says; this makes the table anew.

The table is ``tests/data/expected_breaks.toml``, for the quick form of the suite. Its part
``expected`` lists, for every row, law and solver, the claims that do not hold, each with the cases
that break it; ``not run`` lists cases that would take too long. Its part ``undecided`` lists breaks
that may come or not because rounding decides, each group with its reason.

``python -m tests.large.expected_breaks`` makes the table anew; this takes ten minutes on two cores.
It plays every row again and again with time steps that differ by next to nothing. A break that
always comes is expected, and one that comes now and then is undecided. Reasons are kept; where one
is missing, it is left empty, and a test asks for it.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from multiprocessing import Pool
from random import Random
from typing import Any, NamedTuple

from pool_pymunk.results.words import step_text
from pool_pymunk.studies.stability import (
    EXTREMES,
    CaseResult,
    Cell,
    Extreme,
    check,
    claims,
    columns,
)
from tests import DATA

FILE = DATA / "expected_breaks.toml"
# Time steps are changed by shares of up to 1e-12, which is far below the error of any solver.
NUDGES = [Random(seed).uniform(-1e-12, 1e-12) for seed in range(30)]
PROCESSES = 2
NEVER = "raises nothing"  # No solver may break this claim anywhere.
NOT_RUN = "not run"
REASON = "reason"

Break = tuple[str, str]  # These are a claim, and the label of the case that breaks it.


class Key(NamedTuple):
    """A key names a cell of the suite: a row, a law and a solver."""

    row: str
    law: str
    solver: str


class Entry(NamedTuple):
    """An entry has the breaks of a cell that must come, and those that may, with the reason."""

    expected: frozenset[Break] = frozenset()
    undecided: frozenset[Break] = frozenset()
    reason: str = ""


KEYS = [
    Key(extreme.name, law, solver.name)
    for extreme in EXTREMES
    for law in extreme.laws
    for solver in columns()
    if law == "coulomb" or not solver.own_law
]


# -- playing ---------------------------------------------------------------------------------------


def played(key: Key, nudge: float = 0.0) -> Cell:
    """Work out a cell, with all time steps longer by the share ``nudge``."""
    row = replace(next(e for e in EXTREMES if e.name == key.row), laws=(key.law,))
    usual = _check(row, key.solver)
    steps = dict.fromkeys(one.dt for one in usual.outcomes)
    if nudge == 0.0 or None in steps:
        return usual
    nudged = tuple(dt * (1.0 + nudge) for dt in steps if dt is not None)
    cell = _check(replace(row, steps=nudged), key.solver)
    pairs = zip(cell.outcomes, usual.outcomes, strict=True)
    return replace(cell, outcomes=tuple(replace(one, dt=other.dt) for one, other in pairs))


def _check(row: Extreme, solver: str) -> Cell:
    """Check a row in its quick form, and measure every claim however slow the machine is."""
    usual, claims.QUICK = claims.QUICK, math.inf
    try:
        return check(row, solver, quick=True)
    finally:
        claims.QUICK = usual


def breaks(cell: Cell) -> frozenset[Break]:
    """Return all that breaks in a cell, and all that is not run."""
    broken = {(measure.claim, _label(one)) for one in cell.run for measure in one.broken}
    return frozenset(broken | {(NOT_RUN, _label(one)) for one in cell.outcomes if one.not_run})


def _label(one: CaseResult) -> str:
    """Return the label of a case, or of its step where the row has but one case."""
    return one.case or ("no step" if one.dt is None else step_text(one.dt))


def entry(key: Key) -> Entry:
    """Find which breaks of a cell always come, and which come now and then."""
    cells = [breaks(played(key, nudge)) for nudge in (0.0, *NUDGES)]
    always = frozenset.intersection(*cells)
    return Entry(always, frozenset.union(*cells) - always)


# -- the file --------------------------------------------------------------------------------------


@cache
def table() -> Mapping[Key, Entry]:
    """Read the table on file."""
    content = tomllib.loads(FILE.read_text(encoding="utf-8"))
    reasons = {key: cell.pop(REASON) for key, cell in _cells(content["undecided"]).items()}
    expected, undecided = (
        {key: _read(cell) for key, cell in _cells(content[part]).items()}
        for part in ("expected", "undecided")
    )
    none: frozenset[Break] = frozenset()
    return {
        key: Entry(expected.get(key, none), undecided.get(key, none), reasons.get(key, ""))
        for key in expected | undecided
    }


def _cells(part: Mapping[str, Any]) -> dict[Key, dict[str, Any]]:
    return {
        Key(row, law, solver): cell
        for row, laws in part.items()
        for law, solvers in laws.items()
        for solver, cell in solvers.items()
    }


def _read(cell: Mapping[str, list[str]]) -> frozenset[Break]:
    return frozenset((claim, case) for claim, cases in cell.items() for case in cases)


def text(entries: Mapping[Key, Entry]) -> str:
    """Write a table as it stands in the file, in the order of the suite."""
    lines = [
        "# `python -m tests.large.expected_breaks` makes this file; its text says what this is."
    ]
    heading = ""
    for key, one in entries.items():
        for line in _claims(key, one.expected):
            if heading != (heading := f"[expected.{_name(key.row)}.{key.law}]"):
                lines += ["", heading]
            lines.append(f"{key.solver}.{line}")
    for key, one in entries.items():
        if one.undecided:
            lines += ["", f"[undecided.{_name(key.row)}.{key.law}.{key.solver}]"]
            lines += [f"{REASON} = {_quoted(one.reason)}", *_claims(key, one.undecided)]
    return "\n".join(lines) + "\n"


def _claims(key: Key, found: Iterable[Break]) -> list[str]:
    """Write a line for each claim, with its cases in the order of the row."""
    cases = dict.fromkeys(map(_label, played(key).outcomes)) if found else {}
    return [
        f"{_name(claim)} = [{', '.join(_quoted(c) for c in cases if (claim, c) in found)}]"
        for claim in sorted({claim for claim, _ in found})
    ]


def _name(words: str) -> str:
    return words if re.fullmatch(r"[\w-]+", words, re.ASCII) else _quoted(words)


def _quoted(words: str) -> str:
    return json.dumps(words, ensure_ascii=False)


def main() -> None:
    """Make the file anew."""
    known = table() if FILE.exists() else {}
    with Pool(PROCESSES) as pool:
        made = dict(zip(KEYS, pool.map(entry, KEYS, chunksize=1), strict=True))
    for key, one in made.items():
        if any(claim == NEVER for claim, _ in one.expected | one.undecided):
            raise SystemExit(f"error: {key.solver} raises an error in the row {key.row!r}")
        if one.undecided:
            made[key] = one._replace(reason=known.get(key, Entry()).reason)
    FILE.write_text(text(made), encoding="utf-8")
    print(f"{FILE.name}: {sum(len(one.expected) for one in made.values())} breaks are expected")


if __name__ == "__main__":
    main()
