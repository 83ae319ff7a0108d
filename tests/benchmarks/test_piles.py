"""Dense piles come to rest; ``pytest tests/benchmarks/test_piles.py -s`` prints in what time."""

from __future__ import annotations

import time

import pytest

from pool_pymunk import simulate
from tests.shared.scenes import pile


@pytest.mark.parametrize("rolling", [None, 0.01, 1e-4])
@pytest.mark.parametrize(("count", "e"), [(50, 0.0), (200, 0.5)])
def test_piles(count: int, e: float, rolling: float | None) -> None:
    """Play a pile, and print its time."""
    began = time.perf_counter()
    run = simulate(pile(count, e, rolling), solver="event-driven")
    took = time.perf_counter() - began
    print(f"{count} balls, e = {e}, rolling {rolling}: {took:.2f} s, {len(run.events):,} events")
    assert run.status == "settled"
