"""This study goes to extremes: it finds where each solver breaks, and whether it says so.

An extreme is a row of small scenes made from parameters, from mild to extreme. Each claim measures
what must hold, with a bound; the module of claims says where the bounds come from
(:mod:`pool_pymunk.studies.stability.claims`).
"""

from pool_pymunk.studies.stability.extremes import EXTREMES
from pool_pymunk.studies.stability.suite import CaseResult, Cell, check, check_all, columns
from pool_pymunk.studies.stability.trial import Case, Extreme, Measure, Trial

__all__ = [
    "EXTREMES", "Case", "CaseResult", "Cell", "Extreme", "Measure", "Trial", "check", "check_all",
    "columns",
]  # fmt: skip
