"""What makes no sense is refused in one sentence, in Python as on the command line.

data/refusals.txt is one table of both. In it a line of Python stands behind ``>>>``, and what
``pool-pymunk`` is asked behind ``$``; below stands the answer, in which ``...`` is any text.
Behind the name of a section stands the optional library without which it cannot be asked.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from contextlib import chdir
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pymunk
import pytest

from pool_pymunk import (
    SOLVERS,
    Ball,
    Billiards,
    Friction,
    Restitution,
    Scene,
    SettingError,
    Shot,
    Table,
    load,
)
from pool_pymunk import simulate as simulate_by
from tests import DATA
from tests.shared.commands import Capture, refusal
from tests.shared.worlds import ball as put
from tests.shared.worlds import plane

BY_PYTHON, BY_COMMAND = ">>> ", "$ "
# A name of the table is one of these modules, or one of the functions and scenes below.
HOMES = (
    "pool_pymunk", "tests.shared.texts", "tests.shared.worlds", "pymunk", "pool_pymunk.laws.law",
    "pool_pymunk.report.collide", "pool_pymunk.render", "pool_pymunk.solvers",
    "pool_pymunk.studies", "pool_pymunk.page", "dataclasses", "math", "numpy", "builtins",
    "pool_pymunk.env", "pool_pymunk.world",
)  # fmt: skip


def rows(sign: str) -> list[Any]:
    """Return what is asked behind a sign, the library that it needs, and the answer."""
    found, needs = [], ""
    table = (DATA / "refusals.txt").read_text("utf-8")
    for row in re.split(r"\n+(?=# |>>> |\$ )", table.rstrip("\n")):
        if row.startswith("# "):
            needs = row.partition("(")[2].rstrip(")")
        elif row.startswith(sign):
            asked, _, answer = row.removeprefix(sign).partition("\n")
            found.append(pytest.param(asked, needs, answer, id=asked[:60]))
    return found


def assert_answers(answer: str, lines: str) -> None:
    """Check that lines are the answer of the table."""
    wanted = ".*".join(map(re.escape, answer.split("...")))
    assert re.fullmatch(wanted, lines), f"{lines}\nis not\n{answer}"


def ball(name: str, x: float, y: float, cue: bool = False, radius: float = 0.05) -> Ball:
    return Ball(name, (x, y), radius, 0.2, cue)


def scene(*balls: Ball, table: Table | None = None, shots: tuple[Shot, ...] = ()) -> Scene:
    return Scene(balls, table, Restitution(1.0, cushion=1.0), Friction(surface=0.1), shots=shots)


def new_table() -> Billiards:
    return plane()[1]


def two_on(pair: Any) -> None:
    """Put two balls on a table with this function of pairs."""
    _, table = plane(pair=pair)
    put(table, 0.0), put(table, 1.0)


BODIES: list[pymunk.Body] = []  # A shape of pymunk's does not keep its body alive.


def circle(
    *, offset: tuple[float, float] = (0.0, 0.0), mass: float = 0.17, radius: float = 0.03,
    kind: int = pymunk.Body.DYNAMIC,
) -> pymunk.Circle:  # fmt: skip
    BODIES.append(pymunk.Body(mass, 1e-4, kind))
    return pymunk.Circle(BODIES[-1], radius, offset)


def segment(a: tuple[float, float], b: tuple[float, float]) -> pymunk.Segment:
    BODIES.append(pymunk.Body(body_type=pymunk.Body.STATIC))
    return pymunk.Segment(BODIES[-1], a, b, 0.0)


def ready(env: Any) -> Any:
    """Return an environment, or some, in which an episode has begun."""
    env.reset(seed=0)
    return env


OWN: dict[str, Any] = {
    "ball": ball, "scene": scene, "ready": ready, "put": put, "new_table": new_table,
    "two_on": two_on, "circle": circle, "segment": segment,
}  # fmt: skip


def simulate(scene: Scene, *shot: Any, **settings: Any) -> None:
    """Ask all solvers, unless one is named: all refuse alike."""
    said = set()
    for solver in [settings.pop("solver")] if "solver" in settings else SOLVERS:
        with pytest.raises(ValueError) as refused:
            simulate_by(scene, *shot, solver=solver, **settings)
        said.add(str(refused.value))
    (line,) = said
    raise SettingError(line)


@cache
def own_names() -> dict[str, Any]:
    """Return the scenes and other values that the table names."""
    report, two_balls = load("report-corrected"), load("two-balls")
    return {
        "report": report,
        "two_balls": two_balls,
        "bare": Scene(report.balls, report.table, report.restitution, report.friction),
        "published": load("report"),
        "rolling": load("follow-and-draw"),
        "places": [ball.position for ball in report.balls],
        "rest": [(0.0, 0.0)] * len(report.balls),
        "run": simulate_by(report, 1),
        **OWN,
        "simulate": simulate,
    }


class Names(dict[str, Any]):
    """These are all names of the table."""

    def __missing__(self, name: str) -> Any:
        if name in own_names():
            return own_names()[name]
        for home in HOMES:
            if hasattr(import_module(home), name):
                return getattr(import_module(home), name)
        raise KeyError(name)


@pytest.fixture(autouse=True, scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Let all be asked in one empty folder."""
    folder = tmp_path_factory.mktemp("empty")
    with chdir(folder):
        yield folder


@pytest.mark.parametrize(("asked", "needs", "answer"), rows(BY_PYTHON))
def test_python_refuses_in_one_sentence(asked: str, needs: str, answer: str, empty: Path) -> None:
    if needs:
        pytest.importorskip(needs)
    with pytest.raises((ValueError, OSError, RuntimeError)) as refused:
        eval(asked, Names())
    assert_answers(answer, str(refused.value))
    assert not list(empty.iterdir()), "bad input must write nothing"


@pytest.mark.parametrize(("asked", "needs", "answer"), rows(BY_COMMAND))
def test_the_command_line_refuses_in_one_line(
    asked: str, needs: str, answer: str, empty: Path, capsys: Capture
) -> None:
    if needs:
        pytest.importorskip(needs)
    assert_answers(f"error: {answer}", refusal(capsys, *shlex.split(asked)))
    assert not list(empty.iterdir()), "bad input must write nothing"
