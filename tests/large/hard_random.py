"""Random hard scenes, solved by the exact solver and by the reference in ninety digits.

``python -m tests.large.hard_random 20`` plays 20 scenes of each kind and counts: how many ends
agree within 1e-12 m times the scene's amplification, how many are off by less than a warning of the
run says, and how many by more. The reference refuses some scenes, and some would take it long.

Scenes of balls that lie frozen together are drawn, too (:mod:`tests.shared.frozen`): there the
answer is what tiny gaps make of the scene.
"""

from __future__ import annotations

import random
import re
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from tests.oracle.hard_reference import hard_run
from tests.oracle.reference import Refused
from tests.shared.amplified import amplification
from tests.shared.frozen import FORMS, count_verdicts
from tests.shared.hard_kinds import KINDS, random_hard_scene
from tests.shared.hard_scenes import exact

NUDGES = 8  # of all starts
TIME_LIMIT = 20  # s


class TooLongError(Exception):
    """This error says that a scene takes the reference too long."""


@contextmanager
def time_limit(seconds: int = TIME_LIMIT) -> Iterator[None]:
    """Raise an error in what takes longer."""

    def stop(*_: object) -> None:
        raise TooLongError

    signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def verdict(kind: str, k: int) -> str:
    """Compare one scene, and say what came of it in a word; print what is off by too much."""
    scene = random_hard_scene(kind, random.Random(f"check {kind} {k}"))
    try:
        with time_limit():
            answer = hard_run(scene)
    except (Refused, TooLongError):
        return "refused"
    run = exact(scene)
    ends = zip(run.end.position, answer.final, strict=True)
    off = max(abs(complex(*p) - complex(q)) for p, q in ends)
    if off <= 1e-12 * amplification(scene, run, NUDGES)[0]:
        return "agrees"
    said = [float(m) for w in run.warnings for m in re.findall(r"up to ([-\d.e+]+) m elsewhere", w)]
    if said and off <= max(said):
        return "within its warning"
    print(f"{kind} {k}: off by {off:.1e} m, warned of {said}, rounding {run.rounding:.1e} m")
    return "off"


def main(count: int) -> None:
    """Compare this many scenes of each kind, and count the verdicts."""
    total: Counter[str] = Counter()
    for kind in KINDS:
        found = Counter(verdict(kind, k) for k in range(count))
        print(kind, dict(found), flush=True)
        total += found
    print("all", dict(total))
    for form in FORMS:
        for at_cushion in (True, False):
            where = "at a cushion" if at_cushion else "in the open"
            print("frozen", form, where, dict(count_verdicts(form, at_cushion, count)), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
