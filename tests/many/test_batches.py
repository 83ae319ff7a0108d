"""A batch has the bits of single runs, shot by shot, in random scenes of every kind."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from pool_pymunk.many.batch import NON_FINITE
from pool_pymunk.many.play import play_all
from pool_pymunk.results.run import FIGURES
from tests.large.batches import shots_of, wrong
from tests.shared.core_scenes import BUNDLED, SHORT, bundled_shot, case_of, names
from tests.shared.scenes import BASE_SEED, seeds, share_of

HANDFUL, QUICK, MANY = 25, 2, 2_000
# Many runs tell their figures, and take seconds.
MANY_RUNS = ("lattice", "rack", "patches", "goes on", "star that rolls")


@pytest.mark.seeded
@pytest.mark.parametrize("name", BUNDLED)
def test_shots_of_a_bundled_scene(name: str) -> None:
    assert [said for seed in seeds(5) for said in wrong(bundled_shot(name, seed))] == []


@pytest.mark.seeded
@pytest.mark.parametrize(
    "handful",
    [pytest.param(k, marks=[pytest.mark.slow] if k >= QUICK else [])
     for k in range(share_of(MANY // HANDFUL))],
)  # fmt: skip
def test_random_scenes(handful: int) -> None:
    chosen = islice(names(), HANDFUL * handful, HANDFUL * (handful + 1))
    assert [said for name in chosen for said in wrong(case_of(name))] == []


@pytest.mark.seeded
@pytest.mark.parametrize("name", [f"{kind} {BASE_SEED}" for kind in SHORT if kind not in MANY_RUNS])
def test_figures_are_those_of_runs(name: str) -> None:
    source = shots_of(case_of(name))._replace(has_figures=True)
    found = play_all(source, lambda _: None)
    for k in np.flatnonzero(found.status < NON_FINITE).tolist():
        run = source.run(k)
        wanted = [getattr(run, figure) for figure in FIGURES]
        assert found.figures[k].tolist() == wanted
