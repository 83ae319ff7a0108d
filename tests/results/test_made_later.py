"""A run makes its breakpoints and events when they are first asked for, and nobody can tell."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Run, load, simulate
from pool_pymunk.results.run import LATE, TRACE

REPORT = load("report")


def fresh(solver: str = "event-driven") -> Run:
    """Return a run of which nobody has asked anything."""
    return simulate(REPORT, 1, solver=solver)


@pytest.mark.parametrize("name", LATE)
def test_they_are_made_once_when_one_is_asked_for(name: str) -> None:
    run = fresh()
    assert TRACE in vars(run) and not set(LATE) & set(vars(run))
    first = getattr(run, name)
    assert TRACE not in vars(run) and set(LATE) <= set(vars(run))
    assert getattr(run, name) is first


def test_they_are_what_the_solver_kept() -> None:
    run = fresh()
    trace = vars(run)[TRACE]
    for rows, others in zip(run.knots, trace.knots, strict=True):
        assert np.array_equal(rows, others)
    assert [(event.t, event.kind) for event in run.events] == [row[:2] for row in trace.events]


@pytest.mark.parametrize("asked", [False, True])
@pytest.mark.parametrize(
    "again",
    [
        copy.copy,
        copy.deepcopy,
        lambda run: pickle.loads(pickle.dumps(run)),
        lambda run: replace(run, wall_time=0.0),
    ],
)
def test_a_copy_is_equal(again: Callable[[Run], Run], asked: bool) -> None:
    run = fresh()
    if asked:
        assert len(run.events) == 24
    other = again(run)
    assert TRACE not in vars(other)  # A law of a user's own may not be picklable.
    assert other == fresh() and hash(other) == hash(run)
    assert len(other.events) == 24
    assert [len(rows) for rows in other.knots] == [len(rows) for rows in run.knots]


def test_what_is_missing_is_said_as_usual(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(AttributeError, match="'Run' object has no attribute 'evnts'"):
        fresh().evnts  # type: ignore[attr-defined]  # noqa: B018

    def broken(run: Run) -> Any:
        return run.shot.title  # type: ignore[union-attr]

    monkeypatch.setattr(Run, "name", property(broken))
    with pytest.raises(AttributeError, match="'Shot' object has no attribute 'title'"):
        fresh().name  # noqa: B018
