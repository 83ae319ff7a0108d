"""A batch has the bits of single runs, shot by shot, in random scenes of every kind."""

from __future__ import annotations

from itertools import islice

import pytest

from tests.large.batches import wrong
from tests.shared.core_scenes import BUNDLED, bundled_shot, case_of, names
from tests.shared.scenes import seeds, share_of

HANDFUL, QUICK, MANY = 25, 4, 2_000


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
