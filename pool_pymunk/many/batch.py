"""This module has the results of many shots, in arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NoReturn

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.many.source import Floats, Ints
from pool_pymunk.model.problems import setting_error
from pool_pymunk.solvers.by_core import ENDINGS

if TYPE_CHECKING:
    from pool_pymunk.many.source import Source
    from pool_pymunk.model import Scene
    from pool_pymunk.results.run import Run


STATUSES = ENDINGS
SETTLED, NON_FINITE, CANNOT_START = map(STATUSES.index, ("settled", "non_finite", "cannot_start"))


@dataclass(frozen=True, eq=False)
class Batch:
    """A batch has the results of S shots of a scene with N balls, in SI.

    - ``final`` (S, N, 2): where each ball ended (m); NaN for a ball off the table at the start.
      A pocketed ball lies at its pocket's position.
    - ``duration`` (S,): when the last ball came to rest, or the time at which the shot was cut (s).
    - ``hits``, ``cushions`` and ``events`` (S,): the numbers of hits of two balls, of hits on
      cushions, and of all events, stops and pockets included.
    - ``first_hit`` (S,): the number of the ball that the cue ball met first, -1 for none; ``met``
      (S, N): which balls it met. Both are of the shot's ball if there is a shot; without one and
      without a cue ball they are of the first ball that moves.
    - ``pocketed`` (S, N): the number of the pocket that took each ball in, -1 for none.
    - ``status`` (S,): 0 settled, 1 max_time, 2 max_events, 3 non_finite, 4 cannot_start: balls
      overlap, or one is off the table or within a pocket. ``statuses`` has the names. In
      a shot with one of the last two, the numbers in the other arrays mean nothing.

    ``in_doubt`` (S,) marks shots in which contacts of one instant have no known order.
    ``wall_time`` is in s. No shot is ``handed_back`` (S,) to another solver any more, so that
    ``by_reference`` is 0.

    ``derivatives`` (S, N, 2, P) are those of ``final`` by the inputs ``by`` (P), in SI, as
    ``run(k).derivatives`` has them: NaN where none exists, or where a shot cannot start. It is None
    if none were asked for. ``derived_in_python`` (S,) marks no shot any more.

    ``rounding``, ``policy_shift`` and ``persistent_shift`` (S,) tell how far (m) rounding, what has
    no exact answer, and contacts that persist may have moved the ends, as ``run(k)`` says. They
    are NaN for a shot without an end, and None if no figures were asked for.
    """

    scene: Scene
    law: str
    final: Floats
    duration: Floats
    hits: Ints
    cushions: Ints
    events: Ints
    first_hit: Ints
    met: NDArray[np.bool_]
    pocketed: Ints
    status: NDArray[np.int8]
    by_reference: int
    handed_back: NDArray[np.bool_]
    in_doubt: NDArray[np.bool_]
    wall_time: float
    source: Source = field(repr=False)
    derivatives: Floats | None = field(default=None, repr=False)
    by: tuple[str, ...] = ()
    derived_in_python: NDArray[np.bool_] | None = field(default=None, repr=False)
    rounding: Floats | None = field(default=None, repr=False)
    policy_shift: Floats | None = field(default=None, repr=False)
    persistent_shift: Floats | None = field(default=None, repr=False)

    statuses = STATUSES

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        counts = np.bincount(self.status, minlength=len(STATUSES))
        ends = ", ".join(f"{n} {name}" for n, name in zip(counts, STATUSES, strict=True) if n)
        text = f"{self.by_reference} by reference"
        if self.derived_in_python is not None:
            text += f"; derivatives of {int(self.derived_in_python.sum())} in Python"
        return f"<Batch of {len(self):,} shots: {ends or 'none'}; {text}>"

    @property
    def ended(self) -> NDArray[np.bool_]:
        """Tell which shots (S,) started, and ended with finite numbers."""
        return self.status < NON_FINITE

    @property
    def spread(self) -> NoReturn:
        """Raise AttributeError with a sentence that names what serves instead."""
        raise AttributeError(
            "spread (m/s) is gone: simulate_many(..., figures=True) gives batch.policy_shift (m)"
        )

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the clouds of ends."""
        from pool_pymunk.page import batch_in_notebook

        return batch_in_notebook(self)

    def run(self, k: int) -> Run:
        """Play shot ``k`` again, as a full :class:`~pool_pymunk.Run` of the exact solver.

        Raises SceneError for a shot that cannot start, and SettingError if there is no such shot.
        """
        if not 0 <= k < len(self):
            raise setting_error("k", k, f"the shots have the numbers 0 to {len(self) - 1}")
        return self.source.run(k)
