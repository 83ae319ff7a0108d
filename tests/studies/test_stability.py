"""The extremes break where the table says, and the claims notice what they are for."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from rich.console import Console

from pool_pymunk import Ball, Friction, Physics, Restitution, Run, Scene, Table, simulate
from pool_pymunk.cli.terminal import WIDTH, draw
from pool_pymunk.laws import LAWS, Law
from pool_pymunk.laws.contact import NT, Pair
from pool_pymunk.studies.stability import (
    EXTREMES,
    Case,
    Cell,
    Extreme,
    Trial,
    check,
    check_all,
    claims,
    columns,
    suite,
)
from pool_pymunk.studies.stability.claims import NEAR
from pool_pymunk.studies.stability.suite import CaseResult
from pool_pymunk.studies.stability.trial import reference_of, wrong
from tests.large import expected_breaks
from tests.large.expected_breaks import KEYS, NEVER, Entry, Key, breaks, played
from tests.shared.scenes import takes_long

SOLVERS = [solver.name for solver in columns()]
# These must hold, except where the law breaks it.
EXACT = [solver.name for solver in columns() if solver.exact]


# Rows that take long; event-driven alone plays them among the quick tests.
LONG = (
    "meeting at one instant", "frozen racks of 15", "many contacts", "many balls",
    "Newton's cradles", "converging cushions", "soft breaks", "known answers",
)  # fmt: skip


def marks(key: Key) -> list[pytest.MarkDecorator]:
    """Return the marks of a cell, of which the slow tests play most.

    The rows of the report's law take as long again, and differ in the law alone. The other
    solvers play the same rows. `.ci/run` leaves out what differs in both.
    """
    others = key.law == "published", key.solver != "event-driven"
    return [pytest.mark.slow] * any(others) + [takes_long] * all(others)


ROWS = [pytest.param(key, marks=marks(key), id="-".join(key)) for key in KEYS]


@pytest.mark.parametrize("key", ROWS)
def test_every_row(key: Key, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cell breaks where the table says and nowhere else, and whatever breaks has a reason."""
    if key.row in LONG:  # No claim asks how far policies may have moved the ends.
        monkeypatch.setattr(import_module("pool_pymunk.solvers.request"), "QUICK", -1.0)
    cell, listed = played(key), expected_breaks.table().get(key, Entry())
    assert all(outcome.measures or outcome.not_run for outcome in cell.outcomes)
    assert breaks(cell) - listed.undecided == listed.expected
    assert cell.worst is None or cell.reason


def test_the_table_of_breaks_is_sound() -> None:
    """The table lists only cells that are played, no errors, and reasons for what is undecided."""
    listed = expected_breaks.table()
    assert set(listed) <= set(KEYS)
    for key, entry in listed.items():
        assert not entry.expected & entry.undecided, key
        assert bool(entry.undecided) == bool(entry.reason.strip()), key
        assert all(claim != NEVER for claim, _ in entry.expected | entry.undecided), key


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_solver_that_raises_is_not_as_the_table_has_it(
    solver: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raises(scene: Scene, **settings: Any) -> Run:
        if settings["solver"] == solver:
            raise RuntimeError("broken")
        return simulate(scene, **settings)

    key = Key("mass ratios", "coulomb", solver)
    reference_of.cache_clear()
    monkeypatch.setattr("pool_pymunk.studies.stability.trial.simulate", raises)
    try:
        found = breaks(played(key))
    finally:
        reference_of.cache_clear()
    assert {claim for claim, _ in found} == {NEVER}
    assert found != expected_breaks.table().get(key, Entry()).expected


@takes_long
@pytest.mark.slow
def test_in_every_case_something_happens() -> None:
    """The exceptions are balls that miss what they graze, and one that is alone on a plane."""
    for extreme in EXTREMES:
        for case in extreme.cases():
            if not case.slow:
                grazes = extreme.name in ("grazing hits", "pockets")
                misses = grazes and not case.label.startswith(("-", "with"))
                misses |= case.label.startswith(("corner -", "rim -"))
                misses |= extreme.name == "sliding, then rolling"
                misses |= extreme.name == "tangent to something round" and "+" in case.label
                met = Trial(case, extreme.laws[0], "event-driven", None).contacts > 0
                assert met != (misses or case.label == "no table"), (extreme.name, case.label)


def test_the_reports_law_breaks_in_every_solver_that_has_it() -> None:
    """The law is the cause, not the solver: line 132 has a sign wrong."""
    for solver in columns():
        cell = check(EXTREMES[-1], solver.name, quick=True)
        if solver.own_law:
            assert str(cell) == "not run: it has a law of its own"
            continue
        momentum = [m.value for o in cell.run for m in o.measures if m.claim == "momentum"]
        assert min(momentum) > 0.1
        assert "line 132" in cell.because


def test_pymunk_is_as_far_from_the_exact_run_as_rounding_at_every_step() -> None:
    cases = [case_of("table sizes", label) for label in ("10000 m", "1e4 m, usual balls")]
    trials = [Trial(c, "coulomb", "pymunk", dt) for c in cases for dt in (1 / 60, 1 / 240, 1e-3)]
    apart = [m.value for trial in trials for m in claims.measures(trial) if m.claim == NEAR]
    assert len(apart) == len(trials)
    assert max(apart) < 1e-10  # m, on a table of 10 km


# -- the claims notice -----------------------------------------------------------------------------


def two_balls(**of_scene: object) -> Scene:
    """Return two balls that meet head-on on an open plane, without losses."""
    balls = (
        Ball("a", (0.0, 0.0), 0.05, 0.2, velocity=(1.0, 0.0)),
        Ball("b", (0.5, 0.0), 0.05, 0.2),
    )
    whole = {"balls": balls, "restitution": Restitution(1.0, None, 1.0),
             "physics": Physics(max_time=1.0), **of_scene}  # fmt: skip
    return Scene(**whole)  # type: ignore[arg-type]


def trial_of(run: Run, solver: str = "pymunk") -> Trial:
    """Return a trial whose run is this one, of whatever scene."""
    trial = Trial(Case("", two_balls()), "coulomb", solver, None)
    trial.__dict__["run"] = run
    return trial


def broken(trial: Trial) -> set[str]:
    """Return the claims that do not hold."""
    return {measure.claim for measure in claims.measures(trial) if not measure.holds}


def tampered(run: Run, change: Callable[[np.ndarray], None]) -> Run:
    """Return the run with the last breakpoint of its first ball changed."""
    breakpoints = [ball.copy() for ball in run.knots]
    change(breakpoints[0][-1])
    return replace(run, knots=tuple(breakpoints))


def test_an_honest_run_holds() -> None:
    run = simulate(two_balls(), solver="event-driven")
    assert run.final["b"][0] == pytest.approx(1.1)
    assert not broken(trial_of(run))


@pytest.mark.parametrize(
    ("claim", "column", "value"),
    [
        ("energy", 3, 1e-6),
        ("momentum", 3, 1e-6),
        ("overlap", 1, 1.05),
        ("exact run", 1, 1e-9),
        ("finite", 1, math.nan),
        ("there and back", 2, 1e-6),
    ],
)
def test_a_changed_number_is_noticed(claim: str, column: int, value: float) -> None:
    run = simulate(two_balls(), solver="event-driven")

    def change(row: np.ndarray) -> None:
        row[column] = value if claim == "overlap" else row[column] + value

    assert claim in broken(trial_of(tampered(run, change)))


def test_a_ball_off_the_table_is_noticed() -> None:
    square = Table.rectangle(1.0, 1.0)
    points = np.array([[[0.5, 0.5], [0.95, 0.5], [0.951, 0.5], [1.2, 0.5]]])
    depth = claims.beyond(square, points, np.full(4, 0.05))
    assert depth[0] == pytest.approx([-0.45, 0.0, 0.001, 0.25])


def test_a_ball_in_the_notch_of_a_table_is_off_it() -> None:
    ell = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)))
    points = np.array([[[0.5, 1.5], [1.5, 1.5], [0.9, 0.9]]])
    depth = claims.beyond(ell, points, np.full(3, 0.05))
    assert depth[0] == pytest.approx([-0.45, 0.55, 0.05 - math.hypot(0.1, 0.1)])


@pytest.mark.parametrize(
    ("table", "places"),
    [
        (Table.stadium(4.0, 2.0), {(3.5, 1.0): -0.45, (4.2, 1.0): 0.25, (3.0, 0.01): 0.04}),
        (Table.stadium(4.0, 2.0), {(3.0, 1.0): -0.95, (1.0, 1.0): -0.95, (0.1, 1.0): -0.05}),
        (Table.circle(0.5), {(0.5, 0.5): -0.45, (0.5, -0.1): 0.15, (1.0, 0.5): 0.05}),
        (
            Table(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)), (-0.25, 0.0, 0.0, 0.0)),
            {(1.0, 0.1): 0.2, (1.0, 0.5): -0.2, (1.0, 0.0): 0.3, (1.0, -0.1): 0.4},
        ),
        (
            Table(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), (2.0, 0.0, 0.0, 0.0)),
            {(0.5, -0.5): -0.45, (0.5, -1.9): 0.95, (0.5, 0.5): -0.45},
        ),
    ],
)
def test_a_ball_beyond_an_arc_is_noticed(table: Table, places: dict[Any, float]) -> None:
    depth = claims.beyond(table, np.array([list(places)]), np.full(len(places), 0.05))
    assert depth[0] == pytest.approx([*places.values()])


def test_a_law_that_adds_energy_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    class Generous(Law):
        def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
            new_a, new_b = super().ball_ball(a, b, pair)
            return new_a, NT(new_b.n * (1.0 + 1e-9), new_b.t)

    monkeypatch.setitem(LAWS, "coulomb", Generous())
    reference_of.cache_clear()
    try:
        trial = Trial(Case("", two_balls()), "coulomb", "pymunk", 1 / 60)
        assert {"energy", "momentum"} <= broken(trial)
    finally:
        reference_of.cache_clear()


def test_a_wrong_end_is_noticed() -> None:
    case = Case("", two_balls(), ends="settled")
    measures = list(claims.measures(Trial(case, "coulomb", "pymunk", 1 / 60)))
    (ends,) = (measure for measure in measures if measure.claim == "ends")
    assert not ends.holds
    assert str(ends) == "ends with max_time, not settled"


def test_what_a_solver_raises_is_a_break() -> None:
    """The bounds of a run are kept, and an error is a row like any other."""

    def broken_claim(trial: Trial) -> None:
        raise ZeroDivisionError("float division by zero")

    row = Extreme("bad", "", lambda: iter([Case("x", two_balls(), (broken_claim,))]))
    cell = check(row, "pymunk", quick=True)
    assert str(cell) == "ZeroDivisionError: float division by zero; everywhere"


def test_amplification_of_a_ball_that_only_runs() -> None:
    """A ball runs 1 m in 1 s; nudged by one in its place and its speed, it ends so far off."""
    scene = Scene(
        (Ball("a", (0.0, 0.0), 0.05, 0.2, velocity=(1.0, 0.0)),), physics=Physics(max_time=1.0)
    )
    reference = reference_of(scene, 100)
    assert reference.extent == pytest.approx(1.0)
    assert len(reference.times) == 201
    assert 0.3 < reference.growth[-1] < 2.9  # m; both are at most 1 along and 1 across


def test_old_names_of_the_reference_run_say_what_they_are_now() -> None:
    (row,) = (extreme for extreme in EXTREMES if extreme.name == "head-on hits")
    trial = Trial(next(row.cases()), "coulomb", "pymunk", 1 / 60)
    with pytest.deprecated_call(match="reference"):
        assert trial.exact is trial.reference
    with pytest.deprecated_call(match="is_reference"):
        assert not trial.is_exact_run


def test_a_chaotic_run_is_compared_until_it_is_chaotic() -> None:
    (row,) = (extreme for extreme in EXTREMES if extreme.name == "many contacts")
    case = next(row.cases())
    reference = reference_of(case.scene, case.max_events)
    assert 0.01 < reference.times[-1] / reference.run.duration < 0.5
    assert reference.growth[-1] > 1e3


# -- what broke once -------------------------------------------------------------------------------


def case_of(row: str, label: str) -> Case:
    """Return the case of that label in that row."""
    (extreme,) = (extreme for extreme in EXTREMES if extreme.name == row)
    (case,) = (case for case in extreme.cases() if case.label == label)
    return case


def test_an_instant_is_not_split_by_the_end_of_a_step() -> None:
    """Six balls meet at 105/240 s; rounding puts some of their contacts beyond the step's end."""
    case = case_of("meeting at one instant", "6 meet, e = 0.9")
    assert not broken(Trial(case, "coulomb", "pymunk", 1 / 240))


def test_a_run_ends_at_max_time_and_in_the_middle_of_a_step() -> None:
    case = case_of("never at rest", "three balls")
    run = Trial(case, "coulomb", "pymunk", 1 / 60).run
    assert (run.status, run.duration) == ("max_time", math.pi)
    exact_run = Trial(case, "coulomb", "event-driven", None).run
    assert max(math.dist(run.final[id_], end) for id_, end in exact_run.final.items()) < 1e-12


def test_a_run_ends_at_max_events_and_in_the_middle_of_a_step() -> None:
    case = case_of("squeezed to a cushion", "1 : 1e+06")
    run = simulate(case.scene, solver="pymunk", dt=0.5, max_events=1000)
    exact_run = simulate(case.scene, solver="event-driven", max_events=1000)
    assert (run.status, len(run.events)) == ("max_events", 1000)
    assert run.duration == exact_run.duration
    assert run.final == exact_run.final


def test_balls_that_friction_presses_together_have_one_hit() -> None:
    """Here two balls meet once, and friction presses them together then."""
    balls = (
        Ball("a", (0.0, 0.0), 0.05, 0.2, velocity=(0.0697, 0.0717)),
        Ball("b", (0.1, 0.0), 0.05, 0.2, velocity=(0.0348, 0.0)),
    )
    scene = Scene(balls, None, Restitution(0.0), Friction(0.1))
    free = simulate(scene, solver="pymunk", dt=1 / 60, max_events=50)
    assert (free.status, len(free.events)) == ("settled", 3)


def test_the_same_warning_comes_once_and_says_how_often() -> None:
    balls = (Ball("a", (0.0, 0.0), 0.05, 0.2), Ball("b", (0.5, 0.0), 0.05, 0.2))
    balls = (replace(balls[0], velocity=(1.0, 0.0)), balls[1])
    table = Table(((-0.2, -0.2), (0.8, -0.2), (0.8, 0.2), (-0.2, 0.2)))
    physics = Physics(law="published", max_time=3.0)
    scene = Scene(balls, table, Restitution(1.0, None, 1.0), Friction(ball_ball=0.1), physics)
    assert any(
        "there was no slip" in text for text in simulate(scene, solver="time-slice").warnings
    )
    (warning,) = simulate(scene, solver="event-driven").warnings
    assert "only a rounding error" in warning
    assert warning.endswith("times, first at 0.4 s)")


@pytest.mark.parametrize("solver", EXACT)
def test_far_from_the_origin_hits_without_end_have_one(solver: str) -> None:
    """Gaps there round to more than one instant elsewhere; once, these were hits forever."""
    case = case_of("squeezed to a cushion", "1 : 1e6, e = 0.9, far")
    trial = Trial(case, "coulomb", solver, 1 / 60)
    assert trial.contacts < 1000
    assert any("inelastic collapse" in warning for warning in trial.run.warnings)


@pytest.mark.parametrize("solver", EXACT)
def test_hits_that_feed_each_other_end_as_non_finite(solver: str) -> None:
    """The law `published` gains energy there; once, pymunk went on with balls that were lost."""
    rows = ((1.46, 0.44, 1.9, -0.1), (1.75, 0.76, -0.6, 1.6), (0.49, 0.21, 1.0, 0.5))
    balls = tuple(
        Ball(str(k), (x, y), 0.1, mass, velocity=(vx, vy))
        for k, ((x, y, vx, vy), mass) in enumerate(zip(rows, (1e-3, 1e-3, 1.0), strict=True))
    )
    physics = Physics(law="published", max_time=20.0)
    elastic = Restitution(1.0, None, 1.0)
    scene = Scene(balls, Table.rectangle(2.0, 1.0), elastic, Friction(ball_ball=10.0), physics)
    run = simulate(scene, solver=solver, dt=0.1, max_events=1000)
    assert run.status == "non_finite"
    assert run.duration == pytest.approx(0.95214, rel=1e-4)
    assert all(0.0 < x < 2.0 and 0.0 < y < 1.0 for x, y in run.final.values())


def test_a_ball_that_slides_past_one_at_rest_ends_the_step() -> None:
    """It touches and does not close; once, pymunk predicted that contact again and again."""
    rows = ((-0.3, 0.07, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0))
    balls = tuple(
        Ball(str(k), (x, y), 0.05, 0.2 * 1000.0**k, velocity=(vx, vy))
        for k, (x, y, vx, vy) in enumerate(rows)
    )
    scene = Scene(balls, None, Restitution(0.0), Friction(0.1))
    run = simulate(scene, solver="pymunk", dt=1 / 60, max_events=100)
    exact_run = simulate(scene, solver="event-driven")
    assert run.status == exact_run.status == "settled"
    assert [event.balls for event in run.events] == [event.balls for event in exact_run.events]


# -- closed forms ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("ratio", "digits"), [("1 : 100", 31), ("1 : 10000", 314)])
def test_a_squeezed_ball_counts_the_digits_of_pi(ratio: str, digits: int) -> None:
    case = case_of("squeezed to a cushion", ratio)
    assert Trial(case, "coulomb", "event-driven", None).contacts == digits
    assert claims.contacts_are(digits + 1)(Trial(case, "coulomb", "event-driven", None)) == wrong(
        "contacts", f"{digits} contacts, not {digits + 1}"
    )


# -- the table -------------------------------------------------------------------------------------


def test_a_cell_tells_what_breaks_and_from_where_on() -> None:
    bad = wrong("contacts", "3 contacts, not 4")
    good = wrong("finite", "", is_so=False)
    outcomes = [
        CaseResult("1 m/s", "coulomb", 0.1, (good,)),
        CaseResult("10 m/s", "coulomb", 0.1, (good, bad)),
        CaseResult("100 m/s", "coulomb", 0.1, (bad,)),
        CaseResult("1 m/s", "coulomb", 1e-9, not_run="would need 1e+09 steps"),
    ]
    cell = Cell("speeds", "time-slice", tuple(outcomes))
    assert str(cell) == (
        "3 contacts, not 4; from 10 m/s on (1 of 4 not run: would need 1e+09 steps)"
    )
    only = Cell("time steps", "pymunk", (CaseResult("", "coulomb", 0.1, (bad,)),
                                         CaseResult("", "coulomb", 0.01, (good,))))  # fmt: skip
    assert str(only) == "3 contacts, not 4; at 0.1 s"


@pytest.fixture(scope="module")
def cells() -> list[Cell]:
    """Return two rows by three solvers, worked out in processes."""
    rows = (EXTREMES[1], EXTREMES[-1])
    found = check_all(rows, ("event-driven", "pymunk", "pymunk-builtin"), True, 2)
    return suite.in_order(found)


def test_cells_come_in_order_whoever_worked_them_out(cells: list[Cell]) -> None:
    assert [(cell.extreme, cell.solver) for cell in cells] == [
        (extreme, solver)
        for extreme in ("mass ratios", "the report's law")
        for solver in ("event-driven", "pymunk", "pymunk-builtin")
    ]


def test_the_table_is_printed_and_its_breaks_are_explained(cells: list[Cell]) -> None:
    console = Console(width=400)
    with console.capture() as printed:
        console.print(suite.verdicts(cells))
    cell = next(cell for cell in cells if cell.solver == "pymunk-builtin")
    for words in ("mass ratios", "driven", "holds", str(cell), "not run"):
        assert words in printed.get()
    lines = suite.notes(cells)
    assert any(line.startswith("the report's law: line 132") for line in lines)
    assert any(line.startswith("pymunk-builtin: another contact law") for line in lines)
    assert not any("breaks at" in line for line in lines)


def test_the_table_fits_a_hundred_columns(cells: list[Cell]) -> None:
    """Cells say how many cases are not run, and a note says why."""
    not_run = CaseResult("", "coulomb", 1e-9, not_run="would need 1e+09 steps")
    partly = replace(cells[2], outcomes=(*cells[2].outcomes, not_run))
    console = Console(width=100)
    with console.capture() as printed:
        console.print(suite.verdicts([*cells[:2], partly, *cells[3:]]))
    lines = printed.get().splitlines()
    assert max(map(len, lines)) <= 100 and len(lines) < 20
    said = " ".join(printed.get().split())
    assert "not run)" in said and "1e+09" not in said
    assert suite.notes([partly])[-1] == suite.LEFT_OUT != suite.notes(cells)[-1]


def test_the_csv_has_every_measure(cells: list[Cell], tmp_path: Path) -> None:
    path = tmp_path / "stability.csv"
    suite.table(cells).csv(path)
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    measured = [m for cell in cells for outcome in cell.outcomes for m in outcome.measures]
    assert len(rows) == len(measured)
    for row, measure in zip(rows, measured, strict=True):
        assert row["claim"] == measure.claim
        assert float(row["value"]) == measure.value
        assert row["holds"] == str(measure.holds)


def test_the_picture_is_the_table_that_is_printed(cells: list[Cell], tmp_path: Path) -> None:
    """It has all words in the colours of a terminal, and asks no host for a font."""
    table, path = suite.verdicts(cells), tmp_path / "stability.svg"
    draw("a title", [table, *suite.notes(cells), "at [red]"], path)
    picture = ElementTree.parse(path)
    hosts = [text for text in picture.getroot().itertext() if "url(" in text and "http" in text]
    drawn = " ".join(" ".join(picture.getroot().itertext()).split())
    console = Console(width=WIDTH)
    with console.capture() as printed:
        console.print(table, *suite.notes(cells), sep="\n")
    words = re.findall(r"\w[\w.-]*", printed.get())
    assert len(words) > 50 and not [word for word in words if word not in drawn]
    assert "at [red]" in drawn and "fill: #8a4b00" in drawn and not hosts
