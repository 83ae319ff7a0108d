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
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

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

# A name of the table is one of these modules, or one of the functions and scenes below.
HOMES = (
    "pool_pymunk", "tests.shared.texts", "tests.shared.worlds", "pymunk", "pool_pymunk.laws.law",
    "pool_pymunk.report.collide", "pool_pymunk.render", "pool_pymunk.solvers",
    "pool_pymunk.studies", "pool_pymunk.page", "dataclasses", "math", "numpy", "builtins",
    "pool_pymunk.env", "pool_pymunk.world",
)  # fmt: skip


class Row(NamedTuple):
    """A row of the table has the sign before what is asked, and the answer."""

    section: str
    needs: str  # the optional library without which it cannot be asked
    sign: str
    asked: str
    answer: str


def rows() -> Iterator[Row]:
    """Yield the rows of the table."""
    section, needs = "", ""
    table = (DATA / "refusals.txt").read_text("utf-8")
    for row in re.split(r"\n+(?=# |>>> |\$ )", table.rstrip("\n")):
        sign, rest = row.split(" ", 1)
        if sign == "#":
            section, needs = rest, rest.partition("(")[2].rstrip(")")
        else:
            asked, _, answer = rest.partition("\n")
            yield Row(section, needs, sign, asked, answer)


BY_PYTHON = {
    section: list(its)
    for section, its in groupby((row for row in rows() if row.sign == ">>>"), lambda row: row[0])
}
BY_COMMAND = [row for row in rows() if row.sign == "$"]


def is_answer(answer: str, lines: str) -> bool:
    """Tell whether lines are the answer of the table."""
    wanted = ".*".join(map(re.escape, answer.split("...")))
    return re.fullmatch(wanted, lines) is not None


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


def said_of(asked: str) -> str:
    """Return what Python answers, or that it is no refusal."""
    try:
        eval(asked, Names())
    except (ValueError, OSError, RuntimeError) as refused:
        return str(refused)
    except Exception as error:
        return f"{error!r}, which is no refusal"
    return "no error"


@pytest.mark.parametrize("section", BY_PYTHON)
def test_python_refuses_in_one_sentence(section: str, empty: Path) -> None:
    others = []
    for row in BY_PYTHON[section]:
        if row.needs:
            pytest.importorskip(row.needs)
        if not is_answer(row.answer, said := said_of(row.asked)):
            others.append(f"{row.asked}\n  says {said}\n  and not {row.answer}")
        assert not list(empty.iterdir()), f"{row.asked}: bad input must write nothing"
    assert not others, "\n".join(others)


@pytest.mark.parametrize("row", BY_COMMAND, ids=lambda row: row.asked[:60])
def test_the_command_line_refuses_in_one_line(row: Row, empty: Path, capsys: Capture) -> None:
    if row.needs:
        pytest.importorskip(row.needs)
    line = refusal(capsys, *shlex.split(row.asked))
    assert is_answer(f"error: {row.answer}", line), f"{line}\nis not\n{row.answer}"
    assert not list(empty.iterdir()), "bad input must write nothing"
