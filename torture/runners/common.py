"""This module is what all runners share: it reads a request as JSON from each line, and answers.

It needs only Python, so it runs in every environment.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

# what a general engine of rigid bodies offers
RIGID_BODIES = {
    "restitution below 1",
    "friction of sliding discs",
    "any outline",
    "hits of one instant",
    "unequal masses",
    "unequal radii",
    "gravity in the plane",
}

Play = Callable[[dict[str, Any], list[list[float]], list[float], dict[str, Any]], Any]


def serve(offers: set[str], versions: dict[str, str], settings: dict[str, Any], play: Play) -> None:
    """Answer requests until there are no more.

    ``play(scene, balls, times, setting)`` returns the states (x, y, vx, vy of each ball) at the
    times, of balls [x, y, vx, vy, r, m]. ``settings`` says what each setting passes on to ``play``.
    """
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # What a package prints is no answer.
    print(json.dumps({"versions": versions, "settings": settings}), file=out, flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(_answer(request, offers, settings, play)), file=out, flush=True)


def _answer(
    request: dict[str, Any], offers: set[str], settings: dict[str, Any], play: Play
) -> dict[str, Any]:
    scene, setting = request["scene"], settings[request["setting"]]["given"]
    lacks = sorted(set(scene["needs"]) - offers)
    if lacks:
        return {"not offered": lacks}

    def too_long(*_: object) -> None:
        raise TimeoutError(f"not done after {request['limit']} s")

    # The limit is on processor time, because other programs may use the machine, too.
    signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, request["limit"])
    try:
        began = time.perf_counter()
        answer = _played(scene, setting, play)
        return answer | {"seconds": time.perf_counter() - began}
    except Exception as error:
        return {"error": f"{type(error).__name__}: {error}"[:300]}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _played(scene: dict[str, Any], setting: dict[str, Any], play: Play) -> dict[str, Any]:
    """Play a scene: in parts, forwards and backwards, or with its starts nudged."""
    balls, last = scene["balls"], scene["time"]
    if scene["nudge"]:
        return {"gradient": _gradient(scene, setting, play)}
    times = [last * (k + 1) / scene["looks"] for k in range(scene["looks"])]
    states: list[Any] = []
    for part in range(scene["parts"] + scene["reverse"]):
        if part:
            sign = -1.0 if scene["reverse"] else 1.0
            rows = zip(states[-1], balls, strict=True)
            balls = [[x, y, sign * u, sign * v, *ball[4:]] for (x, y, u, v), ball in rows]
        states = play(scene, balls, times, setting)
    return {"states": states}


def _gradient(scene: dict[str, Any], setting: dict[str, Any], play: Play) -> list[float]:
    """Return the derivatives of the last ball's x by all balls' x, then by their vx."""
    slopes, h = [], scene["nudge"]
    for column in (0, 2):
        for i in range(len(scene["balls"])):
            ends = []
            for change in (h, -h):
                balls = [list(ball) for ball in scene["balls"]]
                balls[i][column] += change
                ends.append(play(scene, balls, [scene["time"]], setting)[-1][-1][0])
            slopes.append((ends[0] - ends[1]) / (2 * h))
    return slopes


def setting(given: dict[str, Any], why: str, link: str) -> dict[str, Any]:
    """Return a setting: what is passed on, and the page that recommends it."""
    return {"given": given, "why": why, "link": link}


def sides(corners: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    """Yield both ends of each side of a closed outline."""
    yield from zip(corners, [*corners[1:], *corners[:1]], strict=True)


def stepped(
    times: list[float], dt: float, step: Callable[[float], object], look: Callable[[], Any]
) -> list[Any]:
    """Return what one sees at the times (s), after equal steps of at most ``dt`` (s) to each."""
    seen, before = [], 0.0
    for end in times:
        steps = math.ceil((end - before) / dt - 1e-9)
        for _ in range(steps):
            step((end - before) / steps)
        before = end
        seen.append(look())
    return seen
