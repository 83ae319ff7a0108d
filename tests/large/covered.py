"""How often the figure of rounding covers the true error of a run's ends, and how large it is.

``python -m tests.large.covered 100`` plays 100 random runs of each class in forty digits, too. It
prints how many true errors lie above ``Run.rounding``, and by how much the figure is larger than
the error in the median and in 99 of 100 runs; a smaller error than ``LEAST`` counts as that. It
names runs that say decimetres where the error is small: they are *absurd*. Runs with policies count
apart, because what the policies decided is no rounding. Only in the class of persistent contacts is
their figure ``Run.persistent_shift``, too, in runs without policies: the reference knows the order
of contacts of one instant. Classes may be named after the number.
"""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from mpmath import mpf

from pool_pymunk import Restitution, Run, Scene, SceneError, simulate
from tests.large.hard_random import TooLongError, time_limit
from tests.oracle import reference
from tests.oracle.hard_reference import hard_run
from tests.oracle.press_reference import press_run
from tests.shared.hard_kinds import random_hard_scene
from tests.shared.press_scenes import press_scene
from tests.shared.rounding_scenes import CLASSES, error, rolling
from tests.shared.shots import KINDS, ROLLING, some_scene

LEAST = 1e-16  # m
FINEST = 1e-12, 1e-10  # m; such errors of persistent contacts count as that, and as covered
ABSURD, SMALL = 0.1, 1e-9  # m; a run that says more than the one, and errs by less than the other
ENOUGH = 20  # s; a reference that takes longer is given up

Draw = Callable[[str], Scene]  # of a random scene from its name


class Counts(NamedTuple):
    """These are the runs of a class: all, true errors above the figure, absurd, with policies.

    ``median`` and ``most`` (of 99 of 100) are of the figures, as multiples of the true errors.
    """

    total: int
    above: int
    absurd: int
    unknown: int
    median: float
    most: float


def of_class(kind: str, name: str) -> Scene:
    """Return a scene of a class of the tests of rounding."""
    return CLASSES[kind](random.Random(name))


def that_rolls(kind: str, name: str) -> Scene:
    """Return a scene of such a class, whose balls roll."""
    rng = random.Random(name)
    return rolling(CLASSES[kind](rng), rng)


def of_reference(draw: Callable[[str, str, random.Random], Scene], name: str) -> Scene:
    """Return a scene that the reference draws."""
    rng = random.Random(name)
    return draw(rng.choice(("coulomb", "published")), rng.choice(sorted(reference.OUTLINES)), rng)


def of_shots(kind: str, name: str) -> Scene:
    """Return a scene of the tests of many shots."""
    return some_scene(kind, int(name.rpartition(" ")[2]))


def of_collapse(kind: str, name: str) -> Scene:
    """Return a hard scene whose sides hardly bounce, so that its hits may collapse."""
    rng = random.Random(name)
    scene = random_hard_scene(kind, rng)
    e, other = (rng.choice((0.0, round(rng.uniform(0.0, 0.3), 3))) for _ in range(2))
    return replace(scene, restitution=Restitution(e, cushion=rng.choice((e, other))))


def in_contact(name: str) -> Scene:
    """Return a scene whose balls press on each other, or on cushions."""
    return press_scene(int(name.rpartition(" ")[2]))


IN_CONTACT = "persistent contacts"
COLLAPSES = {f"collapse: {kind}": kind for kind in ("squeeze", "row", "corner")}
DRAWS: dict[str, Draw] = {
    **{kind: partial(of_class, kind) for kind in CLASSES},
    **{f"{kind}, rolling": partial(that_rolls, kind)
       for kind in CLASSES if kind != "nearly plastic"},
    "any table": partial(of_reference, reference.random_scene),
    "any pockets": partial(of_reference, reference.random_pocket_scene),
    "any arcs and posts": partial(of_reference, reference.random_round_scene),
    "any rolls": partial(of_reference, reference.random_rolling_scene),
    **{kind: partial(of_shots, kind) for kind in (*KINDS[:6], *ROLLING[:6])},
    **{name: partial(of_collapse, kind) for name, kind in COLLAPSES.items()},
    IN_CONTACT: in_contact,
}  # fmt: skip


def true_ends(kind: str, scene: Scene) -> list[tuple[Any, Any]]:
    """Return the ends of a scene by the reference for its class."""
    if kind == IN_CONTACT:
        return [(place.real, place.imag) for place in press_run(scene).final]
    if kind in COLLAPSES:
        return [(place.real, place.imag) for place in hard_run(scene).final]
    return list(reference.reference_run(scene).final)


def answered(kind: str, name: str) -> tuple[Run, float] | None:
    """Play a scene; return the run and its true error (m), or None if the reference refuses it."""
    try:
        scene = DRAWS[kind](name)
        with time_limit(ENOUGH):
            ends = true_ends(kind, scene)
    except (reference.Refused, TooLongError, SceneError, ArithmeticError):
        return None
    run = simulate(scene, solver="event-driven")
    return run, error(run, ends)


def figure_of(kind: str, run: Run) -> float:
    """Return how far off (m) a run says that its ends may be; nan where that is not asked."""
    if kind == IN_CONTACT:
        is_asked = run.persistent and not run.policies
        return run.rounding + run.persistent_shift if is_asked else math.nan
    return math.nan if run.policies else run.rounding + run.persistent_shift


def count(kind: str, runs: int) -> Counts:
    """Play this many runs of a class, and count; name those that are not covered, or absurd."""
    ratios, total, above, absurd, unknown = [], 0, 0, 0, 0
    least, fine = FINEST if kind == IN_CONTACT else (LEAST, 0.0)
    for k in range(runs):
        found = answered(kind, f"{kind} {k}")
        if found is None:
            continue
        run, off = found
        says = figure_of(kind, run)
        if math.isnan(says) and (run.policies or kind == IN_CONTACT):
            unknown += 1
            continue
        says_too_much, is_above = says > ABSURD and off < SMALL, off > max(says, fine)
        total, above, absurd = total + 1, above + is_above, absurd + says_too_much
        if is_above or says_too_much:
            print(f"  {kind} {k}: off by {off:.1e} m, says {says:.1e} m")
        if says > 0.0:  # Otherwise nothing moves.
            ratios.append(says / max(off, least))
    median, most = np.quantile(ratios, (0.5, 0.99)).tolist() if ratios else (math.nan, math.nan)
    return Counts(total, above, absurd, unknown, median, most)


def main(runs: int, *kinds: str) -> None:
    """Count for each class."""
    reference.GENTLE = mpf(10) ** -25
    for kind in kinds or DRAWS:
        total, above, absurd, unknown, median, most = count(kind, runs)
        print(f"{kind}: {above} of {total} above, {absurd} absurd; {median:.3g} times in the "
              f"median, {most:.3g} in 99 of 100; {unknown} with policies", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, *sys.argv[2:])
