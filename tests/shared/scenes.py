"""These are random scenes, exact ends, a measure of work, and programs, which tests share."""

from __future__ import annotations

import gc
import importlib.util
import io
import json
import math
import os
import random
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import replace
from functools import cache, reduce
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    SceneError,
    Shot,
    Table,
    load,
)
from pool_pymunk.cli import main
from pool_pymunk.model import Point
from pool_pymunk.studies.grid import Column, Tradeoff, begin
from tests import DATA, ROOT

BASE_SEED = int(os.environ.get("POOL_SEED", "0"))
SHARE = float(os.environ.get("POOL_SHARE", "1"))  # of the random scenes of slow tests
# These tests take ten seconds or more each; `.ci/run`, which plays a share, leaves them out.
takes_long = pytest.mark.skipif(SHARE < 1.0, reason="it takes ten seconds or more")
MANY = 10  # From so many scenes on, a share of them is played.
INCH = 0.0254
TABLES = {
    "rectangle": Table.rectangle(2.0, 1.0),
    "hexagon": Table(
        tuple((1 + math.cos(math.pi / 3 * k), 1 + math.sin(math.pi / 3 * k)) for k in range(6))
    ),
    "L": Table(((0, 0), (2, 0), (2, 0.9), (0.9, 0.9), (0.9, 2), (0, 2))),
    "open plane": None,
}


def seeds(count: int, least: int = MANY) -> range:
    """Return the seeds of this many random scenes, or a share; they count from POOL_SEED."""
    return range(BASE_SEED, BASE_SEED + share_of(count, least))


def share_of(count: int, least: int = MANY) -> int:
    """Return how many scenes or steps of many are played: all, or the share POOL_SHARE of them."""
    return count if count < least else max(least, math.ceil(SHARE * count))


def sliding(name: str) -> Scene:
    """Return a bundled scene whose balls roll as one whose balls slide as far instead."""
    scene = load(name)
    assert scene.friction.rolling is not None
    slow = replace(scene.friction, surface=scene.friction.rolling, rolling=None)
    return replace(scene, friction=slow)


def some_slow(count: int, quick: int) -> list[Any]:
    """Return the seeds of this many random scenes as parameters; the first ones are quick."""
    return [
        pytest.param(seed, marks=[pytest.mark.slow] if k >= quick else [])
        for k, seed in enumerate(seeds(count))
    ]


def turned(scene: Scene, angle: float) -> Scene:
    """Return the scene turned by ``angle`` (rad) about the origin."""
    c, s = math.cos(angle), math.sin(angle)

    def turn(p: Point) -> Point:
        return (c * p[0] - s * p[1], s * p[0] + c * p[1])

    table = scene.table and Table(tuple(map(turn, scene.table.outline)))
    balls = tuple(
        replace(ball, position=turn(ball.position), velocity=turn(ball.velocity))
        for ball in scene.balls
    )
    shots = tuple(
        replace(shot, velocity=turn(shot.launch), speed=None, angle=None) if shot.launch else shot
        for shot in scene.shots
    )
    return replace(scene, table=table, balls=balls, shots=shots)


def random_scene(
    seed: int, table: str = "rectangle", law: str = "coulomb", speed: tuple[float, float] = (0.5, 8)
) -> Scene:
    """Return two to nine balls of different sizes; some of them move at speeds within ``speed``."""
    rnd = random.Random(seed)
    balls: list[Ball] = []
    wanted = rnd.randint(2, 9)
    while len(balls) < wanted:
        angle, fast = rnd.uniform(0, 2 * math.pi), rnd.uniform(*speed) * (rnd.random() < 0.4)
        ball = Ball(
            id=str(len(balls)),
            position=(rnd.uniform(0, 2), rnd.uniform(0, 2)),
            radius=rnd.uniform(0.02, 0.06),
            mass=rnd.uniform(0.1, 0.3),
            velocity=(fast * math.cos(angle), fast * math.sin(angle)),
        )
        try:
            Scene((*balls, ball), TABLES[table], Restitution(1, 1, 1), physics=Physics(max_time=1))
        except SceneError:
            continue
        balls.append(ball)
    return Scene(
        balls=tuple(balls),
        table=TABLES[table],
        restitution=Restitution(rnd.uniform(0.5, 1), None, rnd.uniform(0.5, 1)),
        friction=Friction(rnd.uniform(0.05, 0.3), rnd.uniform(0, 0.4), rnd.uniform(0, 0.3)),
        physics=Physics(law=law, max_time=10.0),
    )


def frozen_rack(gap: float, e: float = 0.95, law: str = "coulomb") -> Scene:
    """Return fifteen balls in a triangle, ``gap`` (m) apart, and one that hits it head-on."""
    r = 0.05
    pitch = 2 * r + gap
    balls = [Ball("C", (-0.6, 0), r, 0.17, cue=True, velocity=(3, 0))]
    for row in range(5):
        for k in range(row + 1):
            place = (row * pitch * math.sqrt(3) / 2, (k - row / 2) * pitch)
            balls.append(Ball(f"{row}.{k}", place, r, 0.17))
    friction = Friction(0.1, 0, 0.05)
    return Scene(tuple(balls), None, Restitution(e), friction, Physics(law=law))


def gas(count: int, share: float, max_time: float) -> Scene:
    """Return balls that all move from the start, and cover this share of the table."""
    rnd = random.Random(7)
    r, columns = 0.03, math.ceil(math.sqrt(2 * count))
    rows, pitch = math.ceil(count / columns), r * math.sqrt(math.pi / share)
    shake, balls = 0.9 * (pitch / 2 - r), []
    for k in range(count):
        x, y = (k % columns + 0.5) * pitch, (k // columns + 0.5) * pitch
        place = (x + rnd.uniform(-shake, shake), y + rnd.uniform(-shake, shake))
        angle, fast = rnd.uniform(0, 2 * math.pi), rnd.uniform(0.4, 2.0)
        velocity = (fast * math.cos(angle), fast * math.sin(angle))
        balls.append(Ball(str(k), place, r, 0.17, velocity=velocity))
    return Scene(
        balls=tuple(balls),
        table=Table.rectangle(columns * pitch, rows * pitch),
        restitution=Restitution(0.9, 0.9, 0.7),
        friction=Friction(0.2, 0.2, 0.05),
        physics=Physics(max_time=max_time),
    )


def pile(count: int, e: float, rolling: float | None) -> Scene:
    """Return a gas so dense that its balls soon lie against each other."""
    return replace(
        gas(count, 0.7, 1e9),
        restitution=Restitution(e, e, e),
        friction=Friction(0.2, 0.1, 0.1, rolling=rolling),
        physics=Physics(),
    )


def asymmetry(run: Run) -> float:
    """Return how far (m) a ball of the frozen rack ends from its mirror image's end, at most."""
    ends = {(row, k): run.final[f"{row}.{k}"] for row in range(5) for k in range(row + 1)}
    mirrored = ((end, ends[row, row - k]) for (row, k), end in ends.items())
    return max(math.dist((x, y), (mx, -my)) for (x, y), (mx, my) in mirrored)


def contact_list(run: Run) -> list[tuple[str, tuple[str, ...], int | None]]:
    """Return the run's events without their times."""
    return [(event.kind, event.balls, event.cushion) for event in run.events]


def largest_distance(a: Run, b: Run) -> float:
    """Return the largest distance of two runs' ends (m)."""
    return max(math.dist(a.final[id_], b.final[id_]) for id_ in a.final)


@cache
def exact_run(law: str, shot: int) -> dict[str, Any]:
    """Return the exact end of one of the report's shots (from 1), in quadruple precision."""
    runs = json.loads((DATA / "exact_report.json").read_text())["runs"]
    found: dict[str, Any] = next(r for r in runs if r["law"] == law and r["shot"] == shot)
    return found


def off_exact(run: Run, law: str, shot: int) -> float:
    """Return how far (m) the worst end of a run lies from the exact one."""
    final = exact_run(law, shot)["final"]
    return max(math.dist(run.final[i], (float(x), float(y))) for i, (x, y) in final.items())


def at_a_terminal() -> None:
    """Let Ctrl-C count in a new process, even where the tests run in the background and ignore it.

    ``subprocess`` calls this as ``preexec_fn``.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)


AT_A_TERMINAL = None if sys.platform == "win32" else at_a_terminal  # Windows knows no preexec_fn.


def lines_run(work: Callable[[], object]) -> int:
    """Count the lines of Python that the work runs, which no machine and no load changes.

    Nothing that others left behind is collected meanwhile, because some of it runs Python lines.
    """
    lines = 0

    def count(_frame: FrameType, event: str, _arg: object) -> Any:
        nonlocal lines
        lines += event == "line"
        return count

    usual = sys.gettrace()
    gc.collect()
    gc.disable()
    sys.settrace(count)
    try:
        work()
    finally:
        sys.settrace(usual)
        gc.enable()
    return lines


class Answer(NamedTuple):
    """An answer is what the command line printed, and its exit code."""

    returncode: int
    stdout: str
    stderr: str


def typed(*arguments: object, cwd: Path | None = None) -> Answer:
    """Run ``pool-pymunk`` with these arguments in this process, as if typed in a folder."""
    code: object = None
    out, err = io.StringIO(), io.StringIO()
    with chdir(cwd or Path.cwd()), redirect_stdout(out), redirect_stderr(err):
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as ended:
            code = ended.code
    assert isinstance(code, int), "the command line ends with an exit code"
    return Answer(code, out.getvalue(), err.getvalue())


def columns_of(**steps: Sequence[float | None]) -> list[Column]:
    """Return the columns of a grid: solvers, with ``_`` for a hyphen, and their steps (s)."""
    return [Column(name.replace("_", "-"), dt) for name, its in steps.items() for dt in its]


def tradeoff(scene: Scene, columns: Sequence[Column], *shots: Shot) -> Tradeoff:
    """Measure these columns, each shot (default: all of the scene's) by one run."""
    return reduce(Tradeoff.measured, columns, begin(scene, shots or None))


def example(name: str) -> Any:
    """Import an example by its path."""
    path = ROOT / "examples" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
