"""A solver is a record: one record more is one solver more, and nothing knows it by name."""

from __future__ import annotations

import ast
import json
import math
import re
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, replace
from io import StringIO
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from pool_pymunk import (
    SOLVERS,
    Scene,
    SettingError,
    State,
    Uncertainty,
    load,
    sensitivity,
    simulate,
)
from pool_pymunk.cli import read
from pool_pymunk.cli.options import CompareOptions
from pool_pymunk.laws import Law
from pool_pymunk.laws.contact import NT
from pool_pymunk.render.diagram import draw, figure_of
from pool_pymunk.results.trace import Trace
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import Settings, Solver, find_solver, reference_solver
from pool_pymunk.studies.compare import Comparison
from pool_pymunk.studies.grid import Column, order, sentences
from pool_pymunk.studies.stability import EXTREMES, Cell, check, columns, suite
from pool_pymunk.studies.stability.trial import LISTED
from pool_pymunk.studies.tolerance import simulate_within
from tests.shared.commands import exit_code, refusal
from tests.shared.scenes import tradeoff
from tests.shared.sources import trees

# m; how far an end in the scenario two-balls is off for each second by which the hit is late:
# the balls close at 2.5 m/s, and then go 0.7 m in a direction that is off by that over 2 r.
LATENESS = 2.5 * (1.0 + 0.7 / 0.1143)
HEAD_ON = next(extreme for extreme in EXTREMES if extreme.name == "head-on hits")


def explicit(scene: Scene, start: State, settings: Settings) -> Trace:
    """On an open plane without friction, move every ball on, then answer overlaps."""
    assert settings.dt is not None and settings.max_time is not None
    trace = Trace(start)
    x, v = np.array(start.position), np.array(start.velocity)
    trace.steps = math.ceil(settings.max_time / settings.dt)
    for step in range(1, trace.steps + 1):
        x += v * settings.dt
        for i, j in combinations(range(len(x)), 2):
            if answered(scene, settings.law_of(scene), (i, j), x, v):
                trace.ball_ball(step * settings.dt, i, j)
                for ball in (i, j):
                    trace.breakpoint(ball, step * settings.dt, point(x[ball]), point(v[ball]))
    trace.status, trace.duration = "max_time", trace.steps * settings.dt
    return trace


def answered(
    scene: Scene, law: Law, balls: tuple[int, int], x: np.ndarray, v: np.ndarray
) -> bool:  # fmt: skip
    """Tell whether two balls overlap and close; if so, the law changes their velocities."""
    i, j = balls
    between = x[j] - x[i]
    normal = between / np.hypot(*between)
    apart = np.hypot(*between) > scene.balls[i].radius + scene.balls[j].radius
    if apart or (v[j] - v[i]) @ normal >= 0.0:
        return False
    frame = np.array([normal, (-normal[1], normal[0])])
    a, b = (NT(*point(frame @ v[ball])) for ball in balls)
    v[i], v[j] = np.array(law.ball_ball(a, b, scene.pair(i, j))) @ frame
    return True


def point(values: np.ndarray) -> tuple[float, float]:
    """Return a row of an array as plain numbers."""
    return float(values[0]), float(values[1])


EXPLICIT = Solver(
    name="explicit",
    solve=explicit,
    about="explicit steps on an open plane",
    dt=1e-3,
    late=True,
    limits="contacts come up to a step late, and rounding decides the sign of a slip of zero",
    ladder=(1e-2, 3e-3, 1e-3, 3e-4),
    quick_stability_steps=(2e-3,),
    finest=1e-4,
    color="#0072b2",
    marker="v",
)


@pytest.fixture
def added(monkeypatch: pytest.MonkeyPatch) -> Solver:
    """Return a record that the registry has in addition."""
    monkeypatch.setitem(SOLVERS, EXPLICIT.name, EXPLICIT)
    return EXPLICIT


@pytest.fixture
def registry() -> Iterator[dict[str, Solver]]:
    """Return the registry; put it back as it was afterwards, with its order."""
    kept = dict(SOLVERS)
    yield SOLVERS
    SOLVERS.clear()
    SOLVERS.update(kept)


# -- one record more -------------------------------------------------------------------------------


def test_it_simulates_at_its_own_step(added: Solver) -> None:
    scene = load("two-balls")
    run = simulate(scene, solver=added.name)
    assert (run.solver, run.dt, run.steps) == (added.name, added.dt, 500)
    beside = Comparison(simulate(scene, solver=reference_solver().name), run)
    assert beside.divergence is None
    assert 0.0 < beside.largest < LATENESS * 1e-3
    with pytest.raises(SettingError, match="explicit has no such option \\(it has none\\)"):
        simulate(scene, solver=added.name, friction="joint")


def test_its_work_and_precision_are_measured_and_drawn(added: Solver, tmp_path: Path) -> None:
    every, _ = read.columns(
        CompareOptions(scenario="", solvers="all"), load("two-balls"), every=True
    )
    assert [*dict.fromkeys(each.solver for each in every)][-2:] == [
        added.name, reference_solver().name,
    ]  # fmt: skip
    result = tradeoff(load("two-balls"), [each for each in every if each.solver == added.name])
    found = result.of(added.name)
    assert tuple(setting.dt for setting in found) == added.ladder
    assert all(setting.dt and setting.largest < LATENESS * setting.dt for setting in found)
    assert order(found, result.rounding, 1.0) is not None
    assert any(f"{added.name} at " in line for line in sentences(result))
    diagram = tmp_path / "diagram.svg"
    draw(result, [diagram])
    drawn = diagram.read_text(encoding="utf-8")
    words = (
        f"{added.name}\n{' to '.join(map(step_text, (added.ladder[0], added.ladder[-1])))}\norder "
    )
    (legend,) = figure_of(result).legends
    assert any(text.get_text().startswith(words) for text in legend.get_texts())
    assert f"stroke: {added.color}" in drawn


def test_its_stability_is_checked_at_its_steps(added: Solver, tmp_path: Path) -> None:
    names = [solver.name for solver in columns()]
    # Solvers with a law of their own come last.
    assert names[-2:] == [added.name, "pymunk-builtin"]
    quick, full = (check(HEAD_ON, added.name, quick=quick) for quick in (True, False))
    assert {outcome.dt for outcome in quick.outcomes} == {2e-3}
    assert {outcome.dt for outcome in full.outcomes} == {added.dt}
    assert {outcome.law for outcome in full.run} == set(LISTED)
    console = Console(width=160, file=StringIO(), record=True)
    console.print(suite.verdicts(suite.in_order([full, check(HEAD_ON, "pymunk")])))
    assert re.search(r"extreme .* pymunk .* explicit ", console.export_text())


def test_what_its_record_says_is_what_it_is_held_to(
    added: Solver, monkeypatch: pytest.MonkeyPatch
) -> None:
    def claims(cell: Cell) -> set[str]:
        under_coulomb = (outcome for outcome in cell.run if outcome.law == "coulomb")
        return {measure.claim for outcome in under_coulomb for measure in outcome.broken}

    def with_record(**facts: object) -> Cell:
        monkeypatch.setitem(SOLVERS, added.name, replace(added, **facts))  # type: ignore[arg-type]
        return check(HEAD_ON, added.name)

    assert not claims(with_record())
    assert suite.notes([with_record()]) == [f"explicit: {added.limits}"]
    punctual = with_record(late=False, limits="")
    assert {"overlap", "exact run"} <= claims(punctual)
    (note,) = suite.notes([punctual])
    assert note.startswith("explicit breaks at head-on hits: ")
    assert {outcome.law for outcome in with_record(own_law=True).run} == {"coulomb"}
    monkeypatch.setattr(suite, "MOST_PAIRS", 100)
    assert with_record(all_pairs=False).left_out == ""
    assert with_record(all_pairs=True).left_out.startswith("not run: would look at ")


def test_its_step_is_chosen_by_a_tolerance(added: Solver, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load("two-balls")
    [(run, choice)] = simulate_within(scene, scene.shots, 1e-2, added.name)
    assert choice.reached and run.solver == added.name
    [(run, choice)] = simulate_within(scene, scene.shots, 1e-12, added.name)
    assert not choice.reached and 1e-4 <= choice.dt < 2e-4
    monkeypatch.setitem(SOLVERS, added.name, replace(added, finest=None))
    with pytest.raises(SettingError, match=f"solver = explicit: {added.no_tolerance}"):
        next(simulate_within(scene, scene.shots, 1e-2, added.name))


def test_the_command_line_runs_and_compares_it(added: Solver, tmp_path: Path) -> None:
    where = ("--no-pictures", "--out", tmp_path, "--json", tmp_path / "data.json")
    assert exit_code("run", "two-balls", "--solver", added.name, *where) == 0
    data = json.loads((tmp_path / "data.json").read_text(encoding="utf-8"))
    assert data["solver"] == {"name": added.name, "dt": added.dt}
    assert exit_code("compare", "two-balls", "--dt", "1e-3", *where) == 0
    data = json.loads((tmp_path / "data.json").read_text(encoding="utf-8"))
    assert data["reference"] == reference_solver().name
    compared = [one["solver"]["name"] for one in data["comparisons"]]
    assert compared == [name for name in SOLVERS if name != reference_solver().name]
    assert added.name in compared


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "two-balls", "--solver"),
        ("run", "two-balls", "--tolerance", "1 cm", "--solver"),
        ("render", "two-balls", "--solver"),
        ("render", "two-balls", "--overlay"),
        ("compare", "two-balls", "--solvers"),
        ("tradeoff", "two-balls", "--solvers"),
        ("stability", "--solvers"),
    ],
    ids=" ".join,
)
def test_an_unknown_name_answers_with_the_valid_ones(
    arguments: tuple[str, ...], added: Solver, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refusal(capsys, *arguments, "magic")
    found = re.fullmatch(
        r"error: (--)?(solvers?|overlay) = magic: there is no such solver \((.*)\)", line
    )
    assert found is not None
    assert set(found[3].split(", ")) == {*SOLVERS} >= {added.name, reference_solver().name}


# -- the records -----------------------------------------------------------------------------------


def test_the_records_stand_under_their_names_in_the_order_that_users_see() -> None:
    assert list(SOLVERS) == [
        "pymunk", "pymunk-discrete", "pymunk-builtin", "event-driven", "time-slice",
    ]  # fmt: skip
    assert all(find_solver(name).name == name for name in SOLVERS)
    with pytest.raises(FrozenInstanceError):
        SOLVERS["pymunk"].dt = 1.0  # type: ignore[misc]


def test_the_looks_tell_the_lines_apart_by_colour_and_in_grey() -> None:
    assert len({solver.color for solver in SOLVERS.values()}) == len(SOLVERS)
    assert len({solver.marker for solver in SOLVERS.values()}) == len(SOLVERS)


def test_the_reference_solver_is_found_by_what_it_can_do(
    registry: dict[str, Solver], tmp_path: Path
) -> None:
    """It serves all studies as before under another name, though it is last in the registry."""
    registry["truth"] = replace(registry.pop("event-driven"), name="truth")
    assert reference_solver() is registry["truth"]
    scene, data = load("two-balls"), tmp_path / "data.json"
    every, _ = read.columns(CompareOptions(scenario=""), scene, every=True)
    assert every[-1].solver == columns()[0].name == "truth"
    result = tradeoff(scene, [Column("pymunk", 1 / 60), Column("truth")])
    assert any(line.startswith("Without a step: truth in ") for line in sentences(result))
    cell = check(HEAD_ON, "truth", quick=True)
    assert cell.run and cell.worst is None
    study = sensitivity(scene, 1, Uncertainty(1e-6), samples=2)
    assert study.reference.solver == "truth"
    options = ("--solvers", "pymunk", "--no-pictures", "--out", tmp_path, "--json", data)
    assert exit_code("compare", "two-balls", *options) == 0
    assert json.loads(data.read_text(encoding="utf-8"))["reference"] == "truth"


# -- no one else knows a name ----------------------------------------------------------------------

OTHERWISE = {  # a text that has a solver's name in it, and why it may
    *(("cli/options.py", name) for name in SOLVERS),  # for --help, which imports no solver
    # contacts="discrete" is refused, and this says what serves.
    ("world/checks.py", 'is a solver of its own now; ask for solver="pymunk-discrete"'),
    ("page/live/answers.py", "pymunk"),  # a shot's default, as that of simulate
    ("safety/interrupts.py", "pymunk"),  # the library, as a module
    ("studies/grid.py", "pymunk"),  # the library, whose version is written down
    # the library, and its classes
    (
        "world/billiards.py",
        "pymunk is stepping the space: do this between steps, or from on_contact",
    ),
    ("world/checks.py", "must be a pymunk.Space"),
    ("world/checks.py", "a ball must be a pymunk.Circle"),
    ("world/checks.py", "a wall must be a pymunk.Segment, Circle or Poly"),
}


def texts(tree: ast.Module) -> Iterator[str]:
    """Yield the string literals of a module, except docstrings and default arguments."""
    apart: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and node.body:
            first = node.body[0]
            apart |= {first.value} if isinstance(first, ast.Expr) else set()
        if isinstance(node, ast.arguments):
            apart |= {default for default in (*node.defaults, *node.kw_defaults) if default}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in apart:
            yield node.value


def test_no_other_module_knows_a_solver_by_name() -> None:
    """A list that is too long fails as well, so an entry must leave it when its text does."""
    found = {
        (path, text)
        for path, tree in trees().items()
        if "solvers" not in path.split("/")
        for text in texts(tree)
        if SOLVERS.keys() & set(re.findall(r"[\w-]+", text))
    }
    assert found == OTHERWISE


def test_that_test_sees_a_name_in_a_text_and_not_in_prose() -> None:
    module = '''
"""Prose: event-driven."""
def run(solver="pymunk", *, other="time-slice"):
    """Prose: event-driven."""
    return {"pymunk-discrete": f"time-slice at {solver}"}
'''
    assert list(texts(ast.parse(module))) == ["pymunk-discrete", "time-slice at "]


@pytest.mark.parametrize("solver", ["time-slice", "pymunk-discrete", "pymunk-builtin"])
def test_a_step_that_is_longer_than_a_radius_is_warned_of_once(solver: str) -> None:
    far = simulate(load("report"), 1, solver=solver, dt=0.1, max_time=5.0)
    (warning,) = [text for text in far.warnings if "radius" in text]
    assert warning.startswith("a step of 0.1 s moves ball C by up to 15.7 in, farther than its ")
    near = simulate(load("report"), 1, solver=solver, dt=1 / 240)
    assert not [text for text in near.warnings if "radius" in text]


@pytest.mark.parametrize("solver", ["event-driven", "pymunk", "time-slice", "pymunk-discrete"])
def test_a_run_that_is_cut_is_the_beginning_of_the_whole_one(solver: str) -> None:
    how: dict[str, Any] = {"solver": solver}
    how |= {} if solver == "event-driven" else {"dt": 1 / 240}
    whole = simulate(load("report"), 2, **how)
    count = len(whole.events)
    assert whole.status == "settled" and count > 6
    assert [event.t for event in whole.events] == sorted(event.t for event in whole.events)
    assert simulate(load("report"), 2, max_events=count + 1, **how).status == "settled"
    for most in (1, 3, count - 2):
        part = simulate(load("report"), 2, max_events=most, **how)
        assert (part.status, part.events) == ("max_events", whole.events[:most])
        assert part.duration == whole.events[most - 1].t
        assert all(rows[-1, 0] <= part.duration for rows in part.knots)
        times = [0.0, 0.5 * part.duration, part.duration]
        np.testing.assert_allclose(part.at(times)[0], whole.at(times)[0], rtol=0, atol=1e-12)


def test_events_of_a_slice_come_in_the_order_of_their_times() -> None:
    """A ball stops within a slice, and hits are found at its end."""
    found = simulate(load("report"), 1, solver="time-slice", dt=1 / 240).events
    assert [event.t for event in found] == sorted(event.t for event in found)
