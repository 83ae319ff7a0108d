"""`make test` is quick; `make test-all` plays what it leaves out, and random scenes anew.

What takes longer than half a second stands in data/takes_long.txt, and has the mark ``long``. Where
all cases of a test that crosses lists of parameters take long together, it stands there with
``[...]``, and so many of them are quick as have each row of each list.

Hypothesis draws its examples by a profile. The default, "quick", draws the same every time, and
"fixed" three times as many; "random" (`pytest --hypothesis-profile random`) draws twenty times as
many again, and others every time. Where hypothesis finds a failure, it prints a line that repeats
it.
The seeds of random scenes count from 0, or from POOL_SEED where it is set (:func:`scenes.seeds`);
the tests then end with a line that says so.
"""

from __future__ import annotations

import gc
import os
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Generator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from _pytest.doctest import DoctestModule
from hypothesis import HealthCheck, settings

from pool_pymunk import core

# Tests import each other's scenes as `tests.shared.scenes`. An installed package comes first.
ROOT = Path(__file__).parent.parent
sys.path.append(str(ROOT))

settings.register_profile(
    "fixed",
    deadline=None,
    derandomize=True,
    print_blob=False,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "random",
    settings.get_profile("fixed"),
    derandomize=False,
    print_blob=True,
    max_examples=1000,
)
settings.register_profile("quick", settings.get_profile("fixed"), max_examples=15)
settings.load_profile("quick")

UNTIL = float(os.environ.get("POOL_UNTIL", "inf"))  # s; as time.time() has it

# Thousands of tests are objects that stay. While they are made nothing is collected, and then no
# collection looks at them again: with that, tests that make many objects took ten times as long.
gc.disable()

# These tests, or cases of them, take longer than half a second.
LONG = frozenset((ROOT / "tests" / "data" / "takes_long.txt").read_text("utf-8").splitlines())


# The examples in these modules need an optional library.
NEEDED = {
    "pool_pymunk.studies.fit": "scipy",
    "pool_pymunk.studies.sweep": "pyarrow",
}


# These cannot even be imported without one.
NEEDING = {
    "env": "gymnasium",
    "page/live/server.py": "uvicorn",
}


Collected = list[pytest.Collector]

STALE = "the core is compiled from other sources than there are now: run `make build`"


def pytest_configure(config: pytest.Config) -> None:
    """Refuse compiled code of other sources, and say nothing of plain Python on command lines.

    Look for no examples in modules that cannot be imported without an optional library.
    """
    from hatch_build import is_stale

    if core.compiled and is_stale(Path(core.__file__).parents[2]):
        raise pytest.UsageError(STALE)
    if not core.compiled:
        os.environ["POOL_PYMUNK_PURE"] = "1"
    home = ROOT / "pool_pymunk"
    missing = [
        str(home / place) for place, library in NEEDING.items() if find_spec(library) is None
    ]
    config.option.ignore = [*(config.option.ignore or []), *missing]


@pytest.hookimpl(wrapper=True)
def pytest_collect_file() -> Generator[None, Collected, Collected]:
    """Look for no examples in the docstrings of tests."""
    return [found for found in (yield) if not isinstance(found, DoctestModule)]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what takes long, skip what lacks a library, and begin with files of many long tests.

    So no processor waits at the end while another plays a long test. The tests of a file stay
    together, for they share fixtures and what they have worked out.
    """
    long = Counter[Path]()
    crossed = defaultdict[str, list[pytest.Item]](list)
    for item in items:
        is_example = isinstance(item, pytest.DoctestItem)
        name = item.name if is_example else f"{item.path.name}::{item.name}"
        if not LONG.isdisjoint((name, name.partition("[")[0])):
            item.add_marker(pytest.mark.long)
        is_long = any(map(item.get_closest_marker, ("long", "slow")))
        long[item.path] += is_long
        if f"{name.partition('[')[0]}[...]" in LONG and not is_long:
            crossed[name.partition("[")[0]].append(item)
        for module, library in NEEDED.items() if is_example else ():
            if item.name.startswith(module) and find_spec(library) is None:
                item.add_marker(pytest.mark.skip(reason=f"{library} is not installed"))
    for cases in crossed.values():
        for item in left_out(cases):
            item.add_marker(pytest.mark.long)
    items.sort(key=lambda item: -long[item.path])


def rows_of(item: pytest.Item) -> set[tuple[int, ...]]:
    """Return which row of each of its lists of parameters a case has."""
    assert isinstance(item, pytest.Function)
    rows = set[tuple[int, ...]]()
    for k, mark in enumerate(item.iter_markers("parametrize")):
        names = mark.args[0].split(",") if isinstance(mark.args[0], str) else mark.args[0]
        rows.add((k, *(id(item.callspec.params[name.strip()]) for name in names)))
    return rows


def left_out(cases: list[pytest.Item]) -> list[pytest.Item]:
    """Return the cases without which each row is still in a case, each time with another one."""
    rows = {case: rows_of(case) for case in cases}
    played = Counter[tuple[int, ...]]()
    rest = list(cases)
    while any(not played[row] for case in rest for row in rows[case]):
        chosen = min(rest, key=lambda case: sorted(played[row] for row in rows[case]))
        rest.remove(chosen)
        played.update(rows[chosen])
    return rest


def pytest_collection_finish() -> None:
    """Leave what was collected alone from now on, and look rarely for what nobody needs."""
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)
    gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Look no more at what a file has worked out for others, such as the trees of all sources."""
    if nextitem is None or nextitem.path != item.path:
        gc.collect()
        gc.freeze()


def pytest_runtest_setup() -> None:
    """Leave out what would begin when the time is over that `.ci/run` has for the long tests."""
    if time.time() > UNTIL:
        pytest.skip("its time was over (POOL_UNTIL)")


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say whether the core was compiled, and how the same random scenes come again."""
    how = "compiled" if core.compiled else "plain Python"
    terminalreporter.write_line(f"The core was tested as it is: {how}.")
    if seed := int(os.environ.get("POOL_SEED", "0")):
        terminalreporter.write_line(f"Random scenes are those of POOL_SEED={seed}.")
