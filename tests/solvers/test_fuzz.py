"""Scenes of the large comparison of solvers (:mod:`tests.large.fuzz`), and what it would find."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pool_pymunk import load, simulate
from tests.large import fuzz

FEW = len(fuzz.SHORT) + 1


@pytest.mark.slow
def test_no_solvers_disagree_on_a_few_scenes(tmp_path: Path) -> None:
    path = tmp_path / "fuzz.jsonl"
    for count in (5, FEW):  # The second call goes on where the first one ended.
        fuzz.main(count, path)
    found = [json.loads(line) for line in path.read_text().splitlines()]
    assert len({each["scene"] for each in found}) == FEW
    assert all("crash" not in each and each["pymunk"] != "disagrees" for each in found)
    assert all(each["many"].endswith("same bits") for each in found)


def test_what_is_farther_apart_than_the_figures_disagrees() -> None:
    run = simulate(load("report-corrected"), 1, solver="event-driven")
    assert fuzz.beside(run, 1e-13) == "agrees"
    assert fuzz.beside(run, fuzz.AGREES + 0.9 * run.rounding) == "within the figure of rounding"
    assert fuzz.beside(run, 1e-3) == "disagrees"
