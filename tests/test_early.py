"""Few shots are played in Python where their loop is not compiled yet, with the same bits."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shots import check_bits, in_the_loop, needs_numba

from pool_pymunk import Batch, Uncertainty, load, sensitivity, simulate_many
from pool_pymunk.fast import compiled, many
from pool_pymunk.fast.tables import Form

SHOTS = 5


def some_shots(**more: Any) -> Batch:
    scene = load("two-balls")
    velocity = np.zeros((SHOTS, 2, 2))
    velocity[:, 0, 0] = np.linspace(0.5, 2.5, SHOTS)
    return simulate_many(scene, velocity=velocity, **more)


@pytest.fixture
def compiling(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Let no loop be there yet, and tell for which forms one was asked for."""
    in_the_loop(monkeypatch)
    asked, play_of = list[object](), many.play_of
    monkeypatch.setattr(compiled, "has_form", lambda *_: False)

    def noted(form: Form) -> Any:
        asked.append(form)
        return play_of(form)

    monkeypatch.setattr(many, "play_of", noted)
    monkeypatch.setattr(many, "spent", many.spent.__class__(float))
    return asked


def test_few_shots_compile_nothing(
    compiling: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(many, "EARLY", 60.0)
    heard = list[int]()
    batch = some_shots(on_done=heard.append)
    assert (compiling, heard) == ([], [0, *[1] * SHOTS])
    assert batch.by_reference == 0
    check_bits(batch, range(SHOTS))
    assert 0.0 < sum(many.spent.values()) < 60.0
    sensitivity(load("two-balls"), None, Uncertainty(position=1e-4), samples=3)
    assert compiling == []


@pytest.mark.parametrize("early", [0.0, 1e-9])
def test_what_takes_longer_is_compiled(
    early: float, compiling: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(many, "EARLY", early)
    heard = list[int]()
    batch = some_shots(on_done=heard.append)
    assert len(compiling) == 1
    assert heard == ([0, 0, SHOTS] if early == 0.0 else [0, 1, 0, SHOTS - 1])
    check_bits(batch, range(SHOTS))
    heard.clear()
    some_shots(on_done=heard.append)
    assert heard == [0, 0, SHOTS]  # What was spent counts in later calls, too.


def test_derivatives_of_few_shots_compile_nothing(
    compiling: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(many, "EARLY", 60.0)
    batch = some_shots(derivatives="position")
    assert compiling == []
    assert batch.derivatives is not None
    for k in range(SHOTS):
        own = batch.run(k).derivatives("position").final
        assert batch.derivatives[k].tobytes() == own.tobytes()


@needs_numba
def test_a_new_machine_plays_few_shots_at_once(tmp_path: Path) -> None:
    script = "from pool_pymunk import *; print(simulate_many(load('report'), 1).events.tolist())"
    played = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True,
        env=os.environ | {compiled.CACHE: str(tmp_path)},
    )  # fmt: skip
    assert (played.stdout, played.stderr) == ("[24]\n", "")
    assert not [*tmp_path.rglob("*.nbc")]
