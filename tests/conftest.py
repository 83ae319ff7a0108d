"""`make test` is quick; `make test-all` plays what it leaves out, and random scenes anew.

What takes longer than half a second stands in data/takes_long.txt, and has the mark ``long``.
`make test` compiles nothing by numba: Python plays the loop of tables.

Hypothesis draws its examples by a profile. The default, "quick", draws the same every time, and
"fixed" twice as many; "random" (`pytest --hypothesis-profile random`) draws twenty times as many
again, and others every time. Where hypothesis finds a failure, it prints a line that repeats it.
The seeds of random scenes count from 0, or from POOL_SEED where it is set (:func:`scenes.seeds`);
the tests then end with a line that says so.
"""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from scenes import BASE_SEED, DATA
from shots import uncompiled

from pool_pymunk import core
from pool_pymunk.engine import asked, contacts
from pool_pymunk.fast import compiled, single
from pool_pymunk.fast.tables import Form
from pool_pymunk.solvers import grouped

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
settings.register_profile("quick", settings.get_profile("fixed"), max_examples=25)
settings.load_profile("quick")

# These tests, or cases of them, take longer than half a second.
LONG = frozenset((DATA / "takes_long.txt").read_text("utf-8").splitlines())


# The examples in these modules need an optional library.
NEEDED = {
    "pool_pymunk.studies.fit": "scipy",
    "pool_pymunk.studies.sweep": "pyarrow",
}


# These cannot even be imported without one.
NEEDING = {
    "env": "gymnasium",
    "fast/linked.py": "numba",
    "page/live/server.py": "uvicorn",
}


# These tests play compiled shots; in `make test` Python plays them.
COMPILED = (
    "atlas", "docs", "env", "fast", "figures", "find", "handed_back", "inputs", "linear", "live",
    "live_moving",
    "many", "many_derivatives", "many_patches", "own_laws", "place", "places", "play", "same_bits",
    "sensitivity", "shapes", "single", "sweep", "variation", "weakening",
)  # fmt: skip
WAITING = ("collapse", "round", "together")  # Some slow tests of these play compiled shots, too.


STALE = "the core is compiled from other sources than there are now: run `make build`"


def pytest_configure(config: pytest.Config) -> None:
    """Refuse compiled code of other sources, and say nothing of plain Python on command lines.

    Look for no examples in modules that cannot be imported without an optional library.
    """
    root = Path(__file__).parent.parent
    sys.path.append(str(root))
    from hatch_build import is_stale

    if core.compiled and is_stale(Path(core.__file__).parents[2]):
        raise pytest.UsageError(STALE)
    if not core.compiled:
        os.environ["POOL_PYMUNK_PURE"] = "1"
    home = root / "pool_pymunk"
    missing = [
        str(home / place) for place, library in NEEDING.items() if find_spec(library) is None
    ]
    config.option.ignore = [*(config.option.ignore or []), *missing]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what takes long or is compiled, which comes last; skip what lacks a library."""
    for item in items:
        is_example = isinstance(item, pytest.DoctestItem)
        name = item.name if is_example else f"{item.path.name}::{item.name}"
        if not LONG.isdisjoint((name, name.partition("[")[0])):
            item.add_marker(pytest.mark.long)
        if item.path.stem.removeprefix("test_") in COMPILED:
            item.add_marker(pytest.mark.compiled)
        for module, library in NEEDED.items() if is_example else ():
            if item.name.startswith(module) and find_spec(library) is None:
                item.add_marker(pytest.mark.skip(reason=f"{library} is not installed"))
    items.sort(key=lambda item: item.path.stem.removeprefix("test_") in (*COMPILED, *WAITING))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say whether the core was compiled, and how the same random scenes come again."""
    how = "compiled" if core.compiled else "plain Python"
    terminalreporter.write_line(f"The core was tested as it is: {how}.")
    if BASE_SEED:
        terminalreporter.write_line(f"Random scenes are those of POOL_SEED={BASE_SEED}.")


@pytest.fixture(autouse=True)
def single_runs_are_played_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other tests may have loaded the compiled loop; a test that loads it uses it from then on."""
    remember = single.remember

    def remember_compiled(form: Form, play: Any) -> None:
        if hasattr(play, "get_overload"):  # Other tests let Python play the loop.
            remember(form, play)

    monkeypatch.setattr(single, "remember", remember_compiled)
    monkeypatch.setattr(grouped, "FASTER", [])
    monkeypatch.setattr(asked, "PRESSES", [])
    monkeypatch.setattr(contacts, "LOOPS", [])


@pytest.fixture(autouse=True)
def shots_are_compiled_in_test_all(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiling a loop takes a minute; Python plays it in `make test`, with the twins of numba."""
    if "slow" in request.keywords:
        return
    monkeypatch.setattr(compiled, "note_form", lambda *_: None)
    monkeypatch.setattr(compiled, "has_form", lambda *_: False)
    is_quick = request.config.getoption("--hypothesis-profile") in (None, "quick")
    if is_quick and "long" not in request.keywords:
        monkeypatch.setattr(compiled, "play_shots", uncompiled)
