"""In every class of random runs the figure of rounding covers 99 of 100 true errors."""

from __future__ import annotations

import pytest
from mpmath import mpf

from tests.large import covered
from tests.oracle import reference
from tests.shared.scenes import share_of

RUNS = 100


@pytest.mark.slow
@pytest.mark.parametrize("kind", covered.DRAWS)
def test_ninety_nine_of_a_hundred_figures_cover_and_none_is_absurd(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reference, "GENTLE", mpf(10) ** -25)
    found = covered.count(kind, share_of(RUNS, 5))
    assert found.total > 0
    assert found.above <= 0.01 * RUNS
    assert found.absurd == 0


@pytest.mark.parametrize(("kind", "k"), [("row", 4), ("row", 7), ("squeeze", 21)])
def test_the_figure_of_a_collapse_covers_what_its_end_leaves_out(kind: str, k: int) -> None:
    """Gaps that count as closed, and the last hits of a collapse, move these ends."""
    found = covered.answered(f"collapse: {kind}", f"collapse: {kind} {k}")
    assert found is not None
    run, off = found
    assert not run.policies
    assert off <= run.rounding <= 1e-10
