"""Few shots are followed in Python where the pass is not compiled yet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shots import in_the_loop

from pool_pymunk import Batch, load, simulate_many
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
