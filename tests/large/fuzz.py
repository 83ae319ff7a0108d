"""Play many random scenes by solvers that must agree, and keep what came of each scene.

``python -m tests.large.fuzz 100000 fuzz.jsonl`` plays this many scenes, of all kinds in turn: by
the event-driven solver, by pymunk at a step drawn at random, and by ``simulate_many``. Every 200th
scene is played in forty digits, too. Each scene is a line of the file. The program goes on after
the last line, so it may be stopped at any time; in the end it counts the verdicts. A third number
is that of the file's first scene, so that several programs can share the scenes.

Two ends *disagree* if they lie farther apart than 1e-12 m and than both runs say that rounding and
policies may move them. ``simulate_many`` must end where the event-driven solver ends, bit for bit.
``python -m tests.large.fuzz "round 17"`` plays one scene again, and prints what came of it.
"""

from __future__ import annotations

import json
import math
import random
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from pool_pymunk import Run, simulate, simulate_many
from pool_pymunk.solvers.request import request
from tests.large.hard_random import TooLongError, time_limit
from tests.oracle.reference import Refused, reference_run
from tests.shared.shots import KINDS, ROLLING, some_scene

LONG = ("frozen", "hard", "crowd that rolls", "frozen that rolls", "hard that rolls")
SHORT = tuple(kind for kind in (*KINDS, *ROLLING) if kind not in LONG)
LONG_EVERY = 50  # A scene of a kind that takes long comes after 49 others.
STEPS = (1 / 30, 1 / 60, 1 / 240)  # s
AGREES = 1e-12  # m
MOST = 300  # events; scenes end at the time of this one
SLOW = 1.0  # s of the processor
REFERENCE_EVERY = 200  # scenes
ENOUGH = 20  # s; a reference that takes longer is given up
DRAWN = 3  # s; the reference draws some hard scenes, and one that takes it longer is left out


def apart(one: Run, other: Run) -> float:
    """Return how far apart (m) two runs end."""
    return max(map(math.dist, one.end.position, other.end.position))


def beside(exact: Run, off: float, other_doubt: float = 0.0) -> str:
    """Say in a word what a distance (m) of ends means."""
    if off <= AGREES:
        return "agrees"
    figures = max(exact.rounding, other_doubt)
    if off <= AGREES + figures:
        return "within the figure of rounding"
    if exact.persistent and off <= figures + exact.persistent_shift:
        return "within the figure of persistent contacts"
    if exact.policies and off <= figures + exact.policy_shift + exact.persistent_shift:
        return "within the figure of policies"
    return "disagrees"


def compiled_verdict(exact: Run) -> str:
    """Say in a word whether ``simulate_many`` ends where the event-driven solver ends."""
    start = exact.scene.start(None)
    batch = simulate_many(
        exact.scene, np.array([start.position]), np.array([start.velocity]),
        roll=None if start.roll is None else np.array([start.roll]),
    )  # fmt: skip
    same = np.array_equal(batch.final[0], np.array(exact.end.position))
    same = same and batch.duration[0] == exact.duration and batch.events[0] == len(exact.events)
    how = "handed back" if batch.handed_back[0] else "compiled"
    return f"{how}, {'same bits' if same else 'OTHER BITS'}"


def reference_verdict(exact: Run) -> str:
    """Compare a run with the forty-digit reference, as far as that plays the scene."""
    try:
        with time_limit(ENOUGH):
            answer = reference_run(exact.scene)
    except Refused:
        return "refused"
    except TooLongError:
        return "too long"
    ends = zip(exact.end.position, answer.final, strict=True)
    return beside(exact, max(math.dist(p, (float(x), float(y))) for p, (x, y) in ends))


def record_of(number: int, kind: str, seed: int) -> dict[str, Any]:
    """Play a scene by all, and return what came of it."""
    try:
        with time_limit(DRAWN):
            scene = some_scene(kind, seed)
    except TooLongError:
        return {"scene": f"{kind} {seed}", "left out": f"drawing it takes over {DRAWN} s"}
    began = time.process_time()
    exact = simulate(scene, solver="event-driven", max_events=MOST)
    seconds = time.process_time() - began
    is_cut = exact.status == "max_events"
    if is_cut:
        scene = replace(scene, physics=replace(scene.physics, max_time=exact.duration))
        exact = simulate(scene, solver="event-driven")
    step = random.Random(f"step {number}").choice(STEPS)
    asked = request(scene, "pymunk", dt=step)  # The exact run has measured its policies.
    pymunk = asked._replace(settings=asked.settings._replace(measures_policies=False)).play(None)
    off = apart(exact, pymunk)
    found: dict[str, Any] = {
        "scene": f"{kind} {seed}", "seconds": round(seconds, 4), "events": len(exact.events),
        "off": off, "step": round(1 / step), "is cut": is_cut,
        "pymunk": beside(exact, off, pymunk.rounding if off > AGREES else 0.0),
        "many": compiled_verdict(exact),
    }  # fmt: skip
    if exact.status != pymunk.status:
        found["status"] = f"{exact.status}, pymunk: {pymunk.status}"
    if seconds > SLOW:
        found["warnings"] = exact.warnings
    if number % REFERENCE_EVERY == 0:
        found["reference"] = reference_verdict(exact)
    return found


def recorded(number: int) -> str:
    """Return the line of the file for the scene of this number."""
    turn, place = divmod(number, LONG_EVERY)
    of_long = place == LONG_EVERY - 1
    kinds, k = (LONG, turn) if of_long else (SHORT, number - turn)
    kind, seed = kinds[k % len(kinds)], k // len(kinds)
    try:
        found = record_of(number, kind, seed)
    except Exception as error:  # A crash is what this program looks for.
        found = {"scene": f"{kind} {seed}", "crash": f"{type(error).__name__}: {error}"}
    return json.dumps(found)


def counted(lines: list[str]) -> None:
    """Print how many scenes came out how, and those that need a look."""
    records = [json.loads(line) for line in lines]
    for key in ("pymunk", "many", "reference", "status", "crash", "left out"):
        print(key, dict(Counter(each[key] for each in records if key in each)))
    for each in records:
        said = " ".join(str(each.get(key)) for key in ("pymunk", "many", "reference"))
        if {"crash", "status"} & set(each) or "disagrees" in said or "OTHER" in said:
            print("look:", each)
        elif each.get("seconds", 0.0) > SLOW:
            print("slow:", each)


def main(count: int, path: Path, first: int = 0) -> None:
    """Play scenes up to this number, from the first one or from where the file ends."""
    done = first + (len(path.read_text().splitlines()) if path.exists() else 0)
    with path.open("a") as file:
        for number in track(range(done, count), "scenes", disable=not sys.stderr.isatty()):
            file.write(recorded(number) + "\n")
            file.flush()
    counted(path.read_text().splitlines())


if __name__ == "__main__":
    if len(sys.argv) == 2:
        kind, _, seed = sys.argv[1].rpartition(" ")
        print(json.dumps(record_of(0, kind, int(seed)), indent=2))
    else:
        main(int(sys.argv[1]), Path(sys.argv[2]), *map(int, sys.argv[3:]))
