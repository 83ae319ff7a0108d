"""This study goes to extremes: it finds where each solver breaks, and whether it says so.

- ``extremes`` has the scenes: an extreme is a row of small ones, from mild to extreme. The row
  "known answers" stands in ``known.json``, which programs of other authors play, too.
- ``claims`` has what is known: what must hold in every scene, and the closed forms, symmetries and
  likenesses of single ones. Each claim measures a run, with a bound that it must not pass.
- ``trial`` plays a scene by a solver, beside a reference run whose sensitivity is measured.
- ``suite`` plays every extreme by every solver, and makes the table of who breaks where.
"""

from pool_pymunk.studies.stability.extremes import EXTREMES
from pool_pymunk.studies.stability.suite import CaseResult, Cell, check, check_all, columns
from pool_pymunk.studies.stability.trial import Case, Extreme, Measure, Trial

__all__ = [
    "EXTREMES", "Case", "CaseResult", "Cell", "Extreme", "Measure", "Trial", "check", "check_all",
    "columns",
]  # fmt: skip
