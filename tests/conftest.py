"""Random choices are always the same in `make test`, and new ones in `make test-slow`.

Hypothesis draws its examples by a profile. The default, "fixed", draws the same every time;
"random" (`pytest --hypothesis-profile random`) draws ten times as many, and others every time.
Where hypothesis finds a failure, it prints a line that repeats it. The seeds of random scenes count
from 0, or from POOL_SEED where it is set (:func:`scenes.seeds`); the tests then end with a line
that says so.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from scenes import BASE_SEED
from shots import with_twins

from pool_pymunk import Law, Scene
from pool_pymunk.engine import asked, contacts
from pool_pymunk.fast import compiled, many, single
from pool_pymunk.fast.tables import Form, can_compile, walls_differ
from pool_pymunk.physics import changes
from pool_pymunk.solvers import event_driven

settings.register_profile(
    "fixed",
    deadline=None,
    derandomize=True,
    print_blob=False,
    max_examples=100,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "random",
    settings.get_profile("fixed"),
    derandomize=False,
    print_blob=True,
    max_examples=1000,
)
settings.load_profile("fixed")


# The examples in these modules need an optional library.
NEEDED = {
    "pool_pymunk.fast.many": "numba",
    "pool_pymunk.studies.atlas": "numba",
    "pool_pymunk.studies.find": "numba",
    "pool_pymunk.studies.fit": "scipy",
    "pool_pymunk.studies.sweep": "pyarrow",
}


# These cannot even be imported without one.
NEEDING = {
    "env": "gymnasium",
    "fast/duals.py": "numba",
    "fast/linked.py": "numba",
    "page/live/server.py": "uvicorn",
}


# These tests play compiled shots, which `make test` compiles beside the first tests.
COMPILED = (
    "atlas", "docs", "env", "fast", "figures", "find", "inputs", "linear", "live", "many",
    "many_derivatives", "own_laws", "place", "places", "play", "same_bits", "sensitivity",
    "shapes", "single", "sweep", "weakening",
)  # fmt: skip


def pytest_configure(config: pytest.Config) -> None:
    """Look for no examples in modules that cannot be imported without an optional library."""
    home = Path(__file__).parent.parent / "pool_pymunk"
    missing = [
        str(home / place) for place, library in NEEDING.items() if find_spec(library) is None
    ]
    config.option.ignore = [*(config.option.ignore or []), *missing]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip examples that need a library which is not installed; compiled shots come last."""
    items.sort(key=lambda item: item.path.stem.removeprefix("test_") in COMPILED)
    for item in items:
        if isinstance(item, pytest.DoctestItem):
            for module, library in NEEDED.items():
                if item.name.startswith(module) and find_spec(library) is None:
                    item.add_marker(pytest.mark.skip(reason=f"{library} is not installed"))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say how the same random scenes come again."""
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
    monkeypatch.setattr(event_driven, "FASTER", [])
    monkeypatch.setattr(asked, "PRESSES", [])
    monkeypatch.setattr(contacts, "LOOPS", [])
    monkeypatch.setattr(changes, "FASTER", [])
    monkeypatch.setattr(single, "follow_run", lambda *_: None)


@pytest.fixture(autouse=True)
def rolls_and_arcs_are_compiled_in_slow_tests_alone(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiling their loops takes half a minute each; other tests play such shots in Python.

    So it is with the pass of derivatives.
    """
    if "slow" not in request.keywords:
        monkeypatch.setattr(compiled, "follow_shots", with_twins)
        monkeypatch.setattr(compiled, "note_form", lambda *_: None)
        monkeypatch.setattr(compiled, "has_form", lambda *_: False)
        monkeypatch.setattr(many, "can_compile", can_compile_without_rolls_and_arcs)


def can_compile_without_rolls_and_arcs(scene: Scene, law: Law) -> bool:
    is_special = scene.surface.rolls or walls_differ(scene)
    return not is_special and can_compile(scene, law)
