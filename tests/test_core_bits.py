"""The core plays with the same bits, compiled or not."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

import pool_pymunk
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.event_driven import solve
from tests import ROOT
from tests.shared.core_scenes import Case, digests, own_shots, same
from tests.shared.scenes import share_of

# -- compiled or not -------------------------------------------------------------------------------


@pytest.mark.skipif(not pool_pymunk.compiled, reason="the core is not compiled here")
@pytest.mark.seeded
@pytest.mark.parametrize(
    "count", [20, pytest.param(share_of(2_000, 200), marks=pytest.mark.slow, id="many")]
)
def test_compiled_code_and_plain_python_have_the_same_bits(count: int) -> None:
    command = [sys.executable, "-m", "tests.shared.core_scenes", "--digests", str(count)]
    pure = os.environ | {"POOL_PYMUNK_PURE": "1"}
    plain = subprocess.run(command, cwd=ROOT, env=pure, capture_output=True, check=True)
    assert plain.stdout.decode().splitlines() == digests(count)


# -- these tests can fail --------------------------------------------------------------------------


def some_trace() -> Trace:
    """Return what the core makes of a shot with hits, rolls and stops."""
    trace = solve(*own_case("carrom")[1:])
    assert len(trace.events) > 3
    return trace


def own_case(name: str) -> Case:
    """Return the first shot of a bundled scene."""
    return next(iter(own_shots(name)))


def change_event(trace: Trace, k: int, value: Any) -> None:
    """Put another value into the second event."""
    row: Any = list(trace.events[1])
    row[k] = value
    trace.events[1] = tuple(row)


CHANGES: dict[str, Callable[[Trace], object]] = {
    "event 1": lambda t: change_event(t, 0, math.nextafter(t.events[1][0], 9.0)),
    "event 1 ": lambda t: change_event(t, 1, "stop"),
    "event 0": lambda t: t.events.reverse(),
    "event": lambda t: t.events.append(t.events[-1]),
    "event ": lambda t: t.events.pop(),
    "breakpoint": lambda t: t.knots[0].append(t.knots[0][-1]),
    "breakpoint ": lambda t: t.knots[0].pop(),
    "warning": lambda t: t.warn("something else", 0.5, "collapse"),
    "instant": lambda t: t.instants.update({0.5: None}),
    "end 0": lambda t: setattr(t, "status", "max_time"),
    "end 1": lambda t: setattr(t, "duration", math.nextafter(t.duration, 0.0)),
    "end 2": lambda t: setattr(t, "steps", t.steps + 1),
}


@pytest.mark.parametrize("what", CHANGES)
def test_another_trace_is_not_the_same(what: str) -> None:
    one, other = some_trace(), some_trace()
    assert same(one, other) == ""
    CHANGES[what](other)
    assert same(one, other).startswith(what.strip())


def test_the_sign_of_a_zero_and_a_whole_number_are_not_the_same() -> None:
    for number in (-0.0, 0, True):
        one, other = some_trace(), some_trace()
        (t, _, *rest) = one.knots[0][0]
        one.knots[0][0], other.knots[0][0] = (t, 0.0, *rest), (t, number, *rest)
        assert same(one, other).startswith("breakpoint")
