"""The cheap figures of README and docs are what their commands print today."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pool_pymunk import Sensitivity, load, sensitivity, simulate, written_uncertainty

pytestmark = pytest.mark.heavy

HOME = Path(__file__).parent.parent
INCH = 0.0254


def text(page: str) -> str:
    """Return a page with its line breaks taken out."""
    return " ".join((HOME / page).read_text(encoding="utf-8").split())


@cache
def spread() -> Sensitivity:
    """Do what `pool-pymunk sensitivity report --shot 1` does."""
    return sensitivity(load("report"), 1, written_uncertainty("report"))


def test_what_the_starts_do_to_the_ends() -> None:
    worst, page = spread().worst, text("docs/solver-and-step.md")
    assert f"Ball {worst.ball} spreads most" in page
    assert f"standard deviation of {worst.deviation / INCH:.1f} in" in page
    assert worst.amplification is not None
    assert f"{worst.amplification:.0f} times that of the starts" in page
    low, high = worst.low[0] / INCH, worst.high[0] / INCH
    assert f"95 % of its ends lie between {low:.2f} and {high:.2f} in along x" in page
    kept, all_ = spread().kept_digits
    assert f"Of the {all_} digits of the printed ends, {kept} mean anything" in page
    assert f"From {spread().horizon:.2f} s on, half of the runs" in page
    assert f"in {100 * spread().same:.0f} % of them" in page


def test_the_same_figure_stands_in_what_was_found_in_the_report() -> None:
    assert f"standard deviation of {spread().worst.deviation / INCH:.1f} in" in text(
        "docs/report.md"
    )


def test_published_ends_beside_exact_ones() -> None:
    scene, page = load("report"), text("docs/report.md")
    shot = scene.shots[0]
    run = simulate(scene, shot, solver="event-driven")
    off = np.array([np.subtract(run.final[id_], end) for id_, end in shot.published.items()])
    found = re.search(
        r"published ends are up to ([0-9.]+) in off the exact ones along x or y", page
    )
    assert found
    assert float(found[1]) == pytest.approx(np.abs(off).max() / INCH, abs=0.0005)


def test_a_shot_takes_so_many_bytes() -> None:
    page = text("docs/simulate-many.md")
    assert f"takes {25 + 21 * 11} bytes of the result" in page
