"""Tests: a folder for each room of pool_pymunk, and at the top what belongs to none.

`shared/` has scenes, generators of random scenes, worlds and programs that tests share; `oracle/`
has the independent references; `large/` has comparisons of any size, each a program (`python -m
tests.large.batches`); `data/` has answers and tables on file.
"""

from pathlib import Path

ROOT = Path(__file__).parent.parent
DATA = ROOT / "tests" / "data"
