"""Random scenes in which balls lie frozen together, or to a cushion, and another ball hits them.

The truth about such a scene is what tiny gaps make of it. :func:`opened` gives every contact that
is closed at the start a gap of its own, and :func:`truth` tells how far the ends lie from those
without gaps at most, for gaps from 1e-14 to 1e-6 m.

``python -m tests.shared.frozen 30 SEED`` counts the verdicts on 30 scenes of each form.
"""

from __future__ import annotations

import math
import random
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import product
from typing import NamedTuple

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    SceneError,
    Table,
)
from pool_pymunk.results.trace import FROZEN, ONE_INSTANT
from tests.shared.hard_scenes import exact

Point = tuple[float, float]
Draw = Callable[[str, bool, random.Random], Scene]

LENGTH, WIDTH = 2.0, 1.0  # m
CLOSED = 1e-13  # m; a smaller gap is none
GAPS = tuple(10.0**-k for k in range(14, 5, -1))  # m
RANDOM_PATTERNS = 4  # of gaps, beside the equal ones and those of one contact alone
FORMS = ("pair", "row", "triangle")


class Touch(NamedTuple):
    """A touch is a contact that is closed at the start: of two balls, or of a ball and a cushion.

    ``rows`` has the change of the gap for a change of place, by ball number.
    """

    rows: dict[int, Point]


def alone(scene: Scene) -> Run:
    """Play the scene, and no variants of its run: that takes a tenth of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(import_module("pool_pymunk.solvers.request"), "QUICK", -1.0)
        return exact(scene)


def touches(scene: Scene) -> list[Touch]:
    """Return the contacts that are closed at the start."""
    found = []
    for i, a in enumerate(scene.balls):
        x, y = a.position
        for j in range(i):
            b = scene.balls[j]
            dx, dy = x - b.position[0], y - b.position[1]
            distance = math.hypot(dx, dy)
            if distance - a.radius - b.radius < CLOSED:
                nx, ny = dx / distance, dy / distance
                found.append(Touch({i: (nx, ny), j: (-nx, -ny)}))
        if scene.table is not None:
            for edge in scene.table.edges:
                nx, ny = edge.normal
                height = (x - edge.start[0]) * nx + (y - edge.start[1]) * ny
                if height - a.radius < CLOSED:
                    found.append(Touch({i: (nx, ny)}))
    return found


def opened(scene: Scene, gaps: Sequence[float]) -> Scene:
    """Return the scene with these gaps (m) between what touches, as far as geometry allows."""
    closed = touches(scene)
    rows = np.zeros((len(closed), 2 * len(scene.balls)))
    for k, touch in enumerate(closed):
        for i, normal in touch.rows.items():
            rows[k, 2 * i : 2 * i + 2] = normal
    moves = np.linalg.lstsq(rows, np.array(gaps), rcond=None)[0].reshape(-1, 2)
    balls = [
        replace(ball, position=(ball.position[0] + dx, ball.position[1] + dy))
        for ball, (dx, dy) in zip(scene.balls, moves.tolist(), strict=True)
    ]
    return replace(scene, balls=tuple(balls))


def patterns(scene: Scene, rnd: random.Random) -> Iterator[list[float]]:
    """Yield shares of a gap for every closed contact: equal, one alone, all but one, random."""
    count = len(touches(scene))
    yield [1.0] * count
    if count > 1:
        for k in range(count):
            yield [float(i == k) for i in range(count)]
            yield [float(i != k) for i in range(count)]
        for _ in range(RANDOM_PATTERNS):
            yield [rnd.random() for _ in range(count)]


class Truth(NamedTuple):
    """The largest distance (m) to the ends with gaps, and that which even the smallest gaps give.

    ``jump`` is the least of the largest distances for each gap up to 1e-12 m. Where it is small,
    but ``far`` is not, the run amplifies gaps as it amplifies any change of the start. It
    ``is_unknown`` if the order of hits is hidden by rounding, or by symmetry, with every gap.
    """

    far: float
    jump: float
    is_unknown: bool


def truth(scene: Scene, run: Run) -> Truth:
    """Return how far the ends with gaps lie from those of the run without."""
    shares = list(patterns(scene, random.Random(1)))
    far: dict[float, float] = {}
    for gap, share in product(GAPS, shares):
        try:
            other = alone(opened(scene, [gap * each for each in share]))
        except SceneError:  # Some balls overlap.
            continue
        if ONE_INSTANT not in other.policies:  # Otherwise rounding hides the order there, too.
            off = max(map(math.dist, run.end.position, other.end.position))
            far[gap] = max(far.get(gap, 0.0), off)
    tiny = [off for gap, off in far.items() if gap <= 1e-12]
    return Truth(max(far.values(), default=0.0), min(tiny, default=0.0), not far)


def random_frozen_scene(form: str, at_cushion: bool, rnd: random.Random) -> Scene:
    """Return a scene of this form, at a cushion or in the open, that the cue ball ``c`` hits."""
    r = rnd.choice((0.02, 0.03, 0.05))
    while True:
        scene = _scene(form, at_cushion, r, rnd)
        if scene is not None:
            return scene


def _scene(form: str, at_cushion: bool, r: float, rnd: random.Random) -> Scene | None:
    """Return a scene, or None if the cue ball misses or what was drawn overlaps."""
    turn = 0.0 if at_cushion else rnd.choice((0.0, math.pi / 2, rnd.uniform(0.0, 2 * math.pi)))
    if form == "pair":
        if at_cushion and rnd.random() < 0.4:
            turn = rnd.choice((math.pi / 2, math.pi / 4, rnd.uniform(0.1, math.pi - 0.1)))
        places = [(0.0, 0.0), (2 * r, 0.0)]
    elif form == "row":
        if at_cushion and rnd.random() < 0.3:
            turn = rnd.choice((math.pi / 2, rnd.uniform(0.1, math.pi - 0.1)))
        places = [(2 * r * k, 0.0) for k in range(rnd.choice((3, 3, 4, 5)))]
    else:
        places = [(0.0, 0.0), (2 * r, 0.0), (r, math.sqrt(3.0) * r)]
        if at_cushion and rnd.random() < 0.3:
            turn = math.pi
    cos, sin = math.cos(turn), math.sin(turn)
    if turn == math.pi / 2:
        cos, sin = 0.0, 1.0
    elif turn == math.pi:
        cos, sin = -1.0, 0.0
    places = [(x * cos - y * sin, x * sin + y * cos) for x, y in places]
    lowest = min(y for _, y in places)
    x0 = rnd.uniform(0.7, 1.2)
    y0 = r - lowest if at_cushion else rnd.uniform(0.4, 0.6)
    mass = rnd.choice((0.1, 0.17, 0.3))
    balls = [
        Ball("fghij"[k], (x0 + x, y0 + y), r, mass * rnd.choice((1.0, 1.0, 1.0, 0.5, 3.0)))
        for k, (x, y) in enumerate(places)
    ]
    aim = rnd.choice(balls).position
    if rnd.random() < 0.2:
        (x1, y1), (x2, y2) = (b.position for b in balls[:2])
        aim = ((x1 + x2) / 2, (y1 + y2) / 2)
    away = rnd.uniform(0.2, math.pi - 0.2) if at_cushion else rnd.uniform(0, 2 * math.pi)
    if rnd.random() < 0.25:
        away = math.pi / 2
    far = rnd.uniform(0.2, 0.4)
    at = (aim[0] + far * math.cos(away), aim[1] + far * math.sin(away))
    aside = rnd.choice((0.0, rnd.uniform(-0.8, 0.8)))
    at = (at[0] - aside * r * math.sin(away), at[1] + aside * r * math.cos(away))
    speed = rnd.choice((0.5, 1.0, 2.0, 3.0))
    velocity = (-speed * math.cos(away), -speed * math.sin(away))
    cue = Ball("c", at, r, mass * rnd.choice((1.0, 1.0, 2.0)), velocity=velocity)
    e = rnd.choice((1.0, 0.95, 0.9, 0.7, 0.5))
    restitution = Restitution(e, None, rnd.choice((1.0, 0.9, 0.75, 0.5)))
    mu = rnd.choice((0.0, 0.0, 0.05, 0.2))
    friction = Friction(rnd.choice((0.05, 0.2)), rnd.choice((0.0, 0.1, 0.2)), mu)
    try:
        scene = Scene(
            (cue, *balls), Table.rectangle(LENGTH, WIDTH), restitution, friction,
            physics=Physics(max_time=30.0),
        )  # fmt: skip
    except SceneError:
        return None
    run = alone(scene)
    hit = any(event.kind == "ball-ball" for event in run.events)
    return scene if hit and touches(scene) else None


def random_later_scene(form: str, at_cushion: bool, rnd: random.Random) -> Scene:
    """Return a scene of this form that another ball ``d`` meets, after the cue ball has hit it."""
    while True:
        scene = random_frozen_scene(form, at_cushion, rnd)
        cue, *frozen = scene.balls
        (x, y), (vx, vy) = cue.position, cue.velocity
        speed, back = math.hypot(vx, vy), rnd.uniform(2.2, 4.0) * cue.radius
        aside = rnd.choice((0.0, rnd.uniform(-0.3, 0.3))) * cue.radius
        at = (x - (back * vx + aside * vy) / speed, y - (back * vy - aside * vx) / speed)
        balls = (replace(cue, position=at), replace(cue, id="d", velocity=(0.0, 0.0)), *frozen)
        try:
            scene = replace(scene, balls=balls)
        except SceneError:
            continue
        hits = [event.balls for event in alone(scene).events if event.kind == "ball-ball"]
        met = [len({"c", "d"}.intersection(pair)) for pair in hits]
        if met and met[0] == 2 and 1 in met:
            return scene


DRAWS = (random_frozen_scene, random_later_scene)

# -- verdicts --------------------------------------------------------------------------------------

JUMP = 1e-5  # m; gaps of 1e-12 m that move the ends farther are not merely amplified
SMALL = 1e-9  # m; ends that gaps of 1e-14 m move farther do depend on a gap
WIDE = 2e-6  # m; gaps of 1e-6 m move the balls themselves as far, and no end depends on them


def verdict(scene: Scene) -> str:
    """Tell in a word whether the run says what tiny gaps do to its ends."""
    run = exact(scene)
    found = truth(scene, run)
    is_said = bool(run.policies & {ONE_INSTANT, FROZEN})
    if found.far <= WIDE and found.jump <= SMALL and not found.is_unknown:
        return "false alarm" if is_said else "no gap matters"
    if found.far <= run.policy_shift:
        return "covered"
    if found.jump > JUMP:
        return "missed"
    return "a gap matters little" if is_said else "gaps are amplified"


def count_verdicts(
    form: str, at_cushion: bool, count: int, seed: object = 0, draw: Draw = random_frozen_scene
) -> Counter[str]:
    """Count the verdicts on this many random scenes, and print what was missed."""
    found: Counter[str] = Counter()
    for k in range(count):
        rnd = random.Random(f"frozen {form} {at_cushion} {seed} {k}")
        word = verdict(draw(form, at_cushion, rnd))
        if word in ("missed", "false alarm"):
            print(f"{form}, at a cushion: {at_cushion}, seed {seed}, scene {k}: {word}")
        found[word] += 1
    return found


def main() -> None:
    """Count the verdicts on this many scenes of each form, with one seed."""
    count, seed = sys.argv[1:]
    for draw, form, at_cushion in product(DRAWS, FORMS, (True, False)):
        counts = count_verdicts(form, at_cushion, int(count), seed, draw)
        where = "at a cushion" if at_cushion else "in the open"
        print(draw.__name__, form, where, dict(counts), flush=True)


if __name__ == "__main__":
    main()
