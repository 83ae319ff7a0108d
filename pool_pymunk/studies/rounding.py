"""This module works out how far rounding may have moved the ends of an exact run.

The errors that every path and every contact make (:mod:`pool_pymunk.physics.errors`) go through the
run as changes do, in ``COLUMNS`` draws of random signs.
"""

from __future__ import annotations

import math

import numpy as np

from pool_pymunk.model import SettingError
from pool_pymunk.physics import changes, errors
from pool_pymunk.physics.errors import COLUMNS, SURE
from pool_pymunk.physics.motion_changes import CHAOS, FOLLOWED
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import find_solver
from pool_pymunk.studies.changes import follow_of, followed, listed


def rounding(run: Run) -> float:
    """Return how far (m) rounding may have moved the ends, to first order.

    The answer is ``SURE`` times the largest root mean square move of a ball over the draws. It is
    inf where errors grow until other contacts may come, and nan where the run has no derivative.
    """
    if not find_solver(run.solver).exact:
        return math.nan
    count, size = len(run.scene.balls), 6 if run.scene.surface.rolls else 4
    none = [np.zeros((rows, COLUMNS)) for rows in (7, count, count)]
    try:
        g = follow_of(run, np.zeros((count, size, COLUMNS)), none, errors.room())
        why = followed(g, run)
        if why is None:
            g = listed(g)
            with np.errstate(all="ignore"):
                why = changes.follow(g, 0, len(g.events)) or changes.finish(g)
    except SettingError:
        return math.nan
    except (TypeError, AttributeError) as error:
        if "dual" not in str(error).lower():
            raise
        return math.nan
    if why != FOLLOWED:
        return math.inf if why == CHAOS else math.nan
    return float(SURE * np.sqrt((g.change[:, :2] ** 2).sum(axis=1).mean(axis=1)).max(initial=0.0))
