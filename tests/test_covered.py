"""In every class of random runs the figure of rounding covers 99 of 100 true errors."""

from __future__ import annotations

import covered
import pytest
import reference
from mpmath import mpf
from scenes import share_of

RUNS = 100


@pytest.mark.slow
@pytest.mark.parametrize("kind", covered.DRAWS)
def test_ninety_nine_of_a_hundred_figures_cover_and_none_is_absurd(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reference, "GENTLE", mpf(10) ** -25)
    found = covered.count(kind, share_of(RUNS))
    assert found.total > 0
    assert found.above <= 0.01 * RUNS
    assert found.absurd == 0
