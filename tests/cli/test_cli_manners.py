"""The command line behaves as people expect: hints, choices, digits, and clear refusals."""

from __future__ import annotations

import errno
import io
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import typer
from rich.console import Console
from rich.table import Table as Printed

from pool_pymunk import (
    SOLVERS,
    Scene,
    State,
    load,
    simulate,
    simulate_all,
)
from pool_pymunk.cli import COMMANDS, app, read, terminal
from pool_pymunk.cli import options as choices
from pool_pymunk.model import UNITS, Units
from pool_pymunk.model.quantities import quantity
from pool_pymunk.report.listing import shot_lines
from pool_pymunk.results.table import NO_BREAK, ResultTable, alike
from pool_pymunk.results.trace import Trace
from pool_pymunk.safety.files import bundled
from pool_pymunk.solvers import Settings
from pool_pymunk.solvers.request import Request
from tests.shared.commands import Capture, exit_code, refusal


def scene_in(folder: Path, unit: str, start: float, more: str = "") -> Path:
    """Write a scene of one ball that rolls along x, with lengths in ``unit``."""
    file = folder / f"{unit}.toml"
    file.write_text(
        f"[units]\nlength = '{unit}'\n[friction]\nsurface = 0.1\n[[balls]]\nid = 'C'\ncue = true\n"
        f"radius = 0.05\nmass = 0.2\nposition = [{start}, 0.0]\n"
        f"[[shots]]\nvelocity = [1.0, 0.0]\n{more}"
    )
    return file


# -- collide -----------------------------------------------------------------------------------

HIT = ("collide", "--mass-a", 0.2, "--mass-b", 0.2, "--radius", 0.03, "--velocity-a", -1, 0)


def test_collide_prints_no_negative_zero(capsys: Capture) -> None:
    for offset in (0.0, 1e-9, 0.02, 0.03):
        assert exit_code(*HIT, "--offset", offset) == 0
        printed = capsys.readouterr().out
        assert "0.00% lost" in printed
        assert re.search(r"-0(\.0*)?(?![\d.e])", printed) is None, printed


def test_a_collision_has_whole_numbers_in_80_columns(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(terminal, "WIDTH", 80)
    more = ("--velocity-b", "0.5", "-0.0123456", "--offset", "0.01")
    assert exit_code(*HIT, *more) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines[3:])) <= 80
    assert sum(line.startswith("velocity of ") for line in lines) == 4
    assert not any(line.startswith(" ") and line.strip() for line in lines[5:])  # Cells are whole.


def test_the_picture_of_a_collision_calls_the_offset_by_its_name(tmp_path: Path) -> None:
    file = tmp_path / "hit.svg"
    assert exit_code(*HIT, "--offset", 0.02, "--picture", file) == 0
    drawn = file.read_text(encoding="utf-8")
    assert "<!-- offset 0.02 m -->" in drawn
    assert "<!-- e = " not in drawn


def printed_by(table: Printed, width: int = 80) -> list[str]:
    """Return the lines of a table on a terminal of this width."""
    console = Console(width=width, file=io.StringIO(), highlight=False)
    console.print(table)
    return str(console.file.getvalue()).splitlines()  # type: ignore[attr-defined]


def test_headings_break_between_words_alone() -> None:
    steps = (f"pymunk-discrete 0.0001{NO_BREAK}s", f"time-slice 1e-06{NO_BREAK}s")
    columns = ("ball", "exact", *steps, "contacts shared")
    table = ResultTable(columns, [("C", "27.3639, 29.1243", 0.1, 2e-5, "44 of 44")])
    lines = printed_by(table.rich())
    heading = " ".join(lines[: next(k for k, line in enumerate(lines) if "──" in line)]).split()
    whole = "ball exact pymunk- discrete 0.0001 s time- slice 1e-06 s contacts shared"
    assert {*heading} == {*whole.split()}


@pytest.mark.parametrize("scene", ["report", "hexagon"])
def test_tables_of_comparisons_fit_80_columns(
    scene: str, capsys: Capture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(terminal, "WIDTH", 80)
    solvers = "pymunk,pymunk-discrete:1e-3,pymunk-builtin,time-slice:1e-3"
    options = ("--solvers", solvers, "--shot", 1, "--no-pictures", "--max-time", 0.5)
    assert exit_code("compare", scene, *options, "--out", tmp_path) == 0
    lines = capsys.readouterr().out.splitlines()
    first = next(k for k, line in enumerate(lines) if "──" in line)
    balls = lines[first + 1 : first + 1 + len(load(scene).balls)]
    assert [line.split()[0] for line in balls] == [ball.id for ball in load(scene).balls]
    assert max(map(len, balls)) <= 80
    assert {"discrete", "builtin"} <= set(" ".join(lines[:first]).split())


def test_a_table_that_is_too_wide_is_printed_as_several(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No cell and no word of a heading is broken, and each part has the first column."""
    steps = [f"pymunk-discrete 0.00{k}{NO_BREAK}s" for k in range(1, 10)]
    table = ResultTable(("ball", *steps), [(str(k), *[10.0 + k] * 9) for k in range(3)])
    monkeypatch.setenv("COLUMNS", "40")
    terminal.show(table)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 40
    assert sum(line.split()[:1] == ["ball"] for line in lines) == 3
    shown = " ".join(lines).split()
    assert shown.count("discrete") == shown.count("12") == 9


def test_a_table_without_rows_has_its_headings() -> None:
    assert printed_by(ResultTable(("ball", "x"), []).rich())[0].split() == ["ball", "x"]


def test_a_column_has_one_notation() -> None:
    assert alike([0.00451, 12.0, 0.0, None, math.nan]) == ["0.0045", "12.0000", "0", "", ""]
    assert alike([4.2e-12, 42.0, "failed"]) == ["4.2e-12", "4.2e+01", "failed"]
    assert alike([-0.25, 12.0], sign="+") == ["-0.25", "+12.00"]
    assert alike([3, 14]) == ["3", "14"]
    assert alike([0.5, -12.3456, 1e-9], largest=4) == ["0.50", "-12.35", "0.00"]
    assert alike([2e-7, 1e-9], largest=3) == ["2.00e-07", "1.00e-09"]
    assert alike([123456.0, 1.0], largest=3) == ["1.23e+05", "1.00e+00"]


# -- the log's digits ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "start", "end"),
    [
        ("m", 0.2, "[ 0.7099,  0.0000] (m)"),
        ("cm", 20.0, "[70.99,  0.00] (cm)"),
        ("mm", 200.0, "[709.9,  0.0] (mm)"),
        ("in", 0.0, "[20.07,  0.00] (in)"),
    ],
)
def test_the_log_has_digits_that_suit_the_unit(
    unit: str, start: float, end: str, tmp_path: Path
) -> None:
    run = simulate(load(scene_in(tmp_path, unit, start)), solver="event-driven")
    assert f"    Ball  C: {end}" in list(shot_lines(run))


def test_published_ends_are_compared_in_the_digits_of_the_log(
    tmp_path: Path, capsys: Capture
) -> None:
    file = scene_in(tmp_path, "m", 0.2, "published = { C = [0.7089, 0.0] }\n")
    assert exit_code("run", file, "--out", tmp_path, "--no-pictures") == 0
    printed = capsys.readouterr().out
    assert "[ 0.7089,  0.0000]   off by 0.0010" in printed
    assert "0 of 1 agree with the published ends to 0.0001 m; the farthest" in printed
    assert "Published ends: 0 of 1 agree to 0.0001\n" in printed


# -- law, friction, time -------------------------------------------------------------------------


def test_run_takes_law_friction_and_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ends = {}
    for law in ("coulomb", "published"):
        file = tmp_path / f"{law}.json"
        options = ("--law", law, "--friction", "callback", "--max-time", "1/2", "--json", file)
        where = ("--out", tmp_path, "--no-pictures", "--shot", 1, "--solver", "pymunk")
        assert exit_code("run", "report", *options, *where) == 0
        [shot] = json.loads(file.read_text(encoding="utf-8"))["shots"]
        assert (shot["status"], shot["duration"]) == ("max_time", 0.5)
        ends[law] = shot["final"]
    assert ends["coulomb"] != ends["published"]


@pytest.mark.parametrize("command", ["compare", "render", "tradeoff"])
def test_the_options_reach_the_solver(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every run of the solver that has the option gets it, and every scene has law and time."""
    seen = []

    def spy(scene: Scene, start: State, settings: Settings, **options: str) -> Trace:
        seen.append((settings.law_of(scene).name, settings.max_time, options))
        return SOLVERS["event-driven"].solve(scene, start, settings)

    monkeypatch.setitem(SOLVERS, "pymunk", replace(SOLVERS["pymunk"], solve=spy))
    options = ("--law", "published", "--friction", "callback", "--max-time", 0.25)
    more = {
        "compare": ("--no-pictures",),
        "render": ("--no-films", "--picture-format", "svg"),
        "tradeoff": ("--solvers", "pymunk", "--samples", 2, "--budget", 0),
    }
    assert exit_code(command, "two-balls", *options, *more[command], "--out", tmp_path) == 0
    assert seen
    assert set(map(str, seen)) == {str(("published", 0.25, {"friction": "callback"}))}


@pytest.mark.parametrize(
    ("command", "more", "asked"),
    [
        ("run", ("--solver", "event-driven", "--no-pictures"), {1e-3}),
        ("compare", ("--no-pictures", "--solvers", "pymunk"), {1e-3}),
        ("render", ("--solver", "event-driven", "--no-films", "--no-pictures"), {1e-3}),
        ("page", ("--solver", "event-driven"), {1e-3}),
        ("tradeoff", ("--budget", 0), {1e-3, 1e-4}),
    ],
)
def test_the_tolerance_of_contacts_reaches_the_exact_solver(
    command: str, more: tuple[object, ...], asked: set[float],
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Without a unit it is in the scenario's, which are inches here."""
    seen, solve = set(), SOLVERS["event-driven"].solve

    def spy(scene: Scene, start: State, settings: Settings) -> Trace:
        seen.add(settings.contact_tolerance)
        return solve(scene, start, settings)

    monkeypatch.setitem(SOLVERS, "event-driven", replace(SOLVERS["event-driven"], solve=spy))
    out = tmp_path / "page.html" if command == "page" else tmp_path
    typed = str(1e-3 / 0.0254)
    options = ("--contact-tolerance", typed, "--out", out, *more)
    assert exit_code(command, "two-balls", *options) == 0
    found = {round(each, 9) for each in seen}
    assert found == asked


def test_the_json_of_run_has_the_tolerance_of_a_solver_that_has_one(tmp_path: Path) -> None:
    file, solvers = tmp_path / "run.json", []
    for solver, more in (
        ("event-driven", ("--contact-tolerance", "0.001mm")), ("pymunk-discrete", ()),
    ):  # fmt: skip
        where = ("--no-pictures", "--json", file, "--out", tmp_path, "--max-time", 1)
        assert exit_code("run", "two-balls", "--solver", solver, *more, *where) == 0
        solvers.append(json.loads(file.read_text(encoding="utf-8"))["solver"])
    assert solvers[0] == {"name": "event-driven", "dt": None, "contact_tolerance": 1e-6}
    assert "contact_tolerance" not in solvers[1]


def test_run_draws_the_energy(tmp_path: Path) -> None:
    assert exit_code("run", "two-balls", "--show", "energy", "--out", tmp_path) == 0
    pictures = {path.name for path in tmp_path.glob("*.png")}
    assert pictures == {"shot-1-start.png", "shot-1-end.png", "shot-1-energy.png"}
    only = tmp_path / "only"
    options = ("--show", "energy", "--no-pictures", "--out", only)
    assert exit_code("run", "two-balls", *options) == 0
    assert [path.name for path in only.glob("*.png")] == ["shot-1-energy.png"]


# -- help, completion, hints ---------------------------------------------------------------------


def test_the_choices_are_those_of_the_library() -> None:
    assert tuple(SOLVERS) == choices.SOLVERS
    assert SOLVERS["pymunk"].options["friction"] == choices.FRICTION
    assert {kind: tuple(known) for kind, known in UNITS.items()} == choices.UNITS


def test_help_shows_the_choices(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    for command in ("run", "compare", "render", "tradeoff"):
        assert exit_code(command, "--help") == 0
        shown = re.sub(r"-\n +", "-", capsys.readouterr().out)  # Lines also end at hyphens.
        for choice in (*choices.SOLVERS, "coulomb|published", "joint|callback", "--max-time"):
            assert choice in shown, (command, choice)
    assert exit_code("collide", "--help") == 0
    assert "m|cm|mm|in, kg|g, m/s|in/s" in capsys.readouterr().out


@pytest.mark.parametrize("command", COMMANDS)
def test_help_fits_eighty_columns_and_has_an_example(
    command: str, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert exit_code(command, "-h") == 0
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    assert "<bool>" not in shown and "<str>" not in shown and "{" not in shown
    assert "…" not in shown
    words = " ".join(shown.split())
    assert f"Example: pool-pymunk {command} {COMMANDS[command]}" in words
    others = set(bundled()) - {"report"} - set(COMMANDS[command].split())
    assert not any(name in words for name in others)


@cache
def commands() -> Any:
    """Return the commands as typer makes them."""
    return typer.main.get_command(app)


def options(command: str) -> list[str]:
    """Return the first name of each option of a command."""
    own = commands().commands[command].params
    return [option.opts[0] for option in own if option.param_type_name == "option"]


def test_help_is_short_and_explains_every_option(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The top lists the scenarios, once."""
    monkeypatch.setenv("COLUMNS", "80")
    assert exit_code("--help") == 0
    lines = (top := capsys.readouterr().out).splitlines()
    assert all(top.count(name) for name in bundled())
    for command in COMMANDS:
        assert exit_code(command, "--help") == 0
        lines += (shown := capsys.readouterr().out).splitlines()
        for option in options(command):
            assert re.search(rf"^ +(-h, )?{option}\b", shown, re.MULTILINE), (command, option)
    assert len(lines) < 500


@pytest.mark.parametrize("command", COMMANDS)
def test_the_example_of_a_command_can_be_read(command: str) -> None:
    commands().commands[command].make_context(command, shlex.split(COMMANDS[command]))


def test_angles_and_times_have_units() -> None:
    angles = ("5", "5 deg", "5°", "1rad", "1 mrad")
    said = [quantity("--angle", text, "angle", Units()) for text in angles]
    assert said == pytest.approx([5, 5, 5, 57.29577951, 0.05729577951])
    times = ("1/240", "1 / 240 s", "0.001", "1ms", "1e-3 s")
    assert [read.seconds("--dt", text) for text in times] == [1 / 240, 1 / 240, 0.001, 0.001, 0.001]


def test_help_imports_no_solver_and_nothing_that_draws() -> None:
    """An answer to --help must come quickly."""
    code = (
        "import sys\nfrom pool_pymunk.cli import main\n"
        "for command in ('run', 'collide', 'compare', 'tradeoff', 'render', 'check'):\n"
        "    try:\n        main([command, '--help'])\n    except SystemExit:\n        pass\n"
        "heavy = ('numpy', 'pymunk', 'pool_pymunk.solvers', 'pool_pymunk.model', 'matplotlib', "
        "'av', 'imageio', 'PIL')\n"
        "print([name for name in heavy if name in sys.modules])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip().endswith("[]")


@pytest.mark.parametrize(
    ("line", "offers"),
    [
        ("pool-pymunk st", {"stability"}),
        ("pool-pymunk run rep", {"report", "report-corrected"}),
        ("pool-pymunk check two", {"two-balls"}),
        ("pool-pymunk run report --solver e", {"event-driven"}),
        ("pool-pymunk run report --law p", {"published"}),
        ("pool-pymunk run report --friction ", {"joint", "callback"}),
        ("pool-pymunk compare report --solvers pymunk,ti", {"pymunk,time-slice"}),
    ],
)
def test_the_shell_completes(
    line: str, offers: set[str], monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """This is what bash is offered for the last word of a line."""
    monkeypatch.setenv("_POOL_PYMUNK_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(line.count(" ")))
    exit_code()
    assert {*capsys.readouterr().out.split()} == offers


def test_completion_can_be_installed(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert exit_code("--help") == 0
    shown = capsys.readouterr().out
    assert "--install-completion" in shown
    assert "--show-completion" in shown


# -- runs that take long -------------------------------------------------------------------------


def test_a_run_in_a_pipe_says_nothing_of_its_progress(tmp_path: Path, capsys: Capture) -> None:
    where = ("--no-pictures", "--out", tmp_path)
    assert exit_code("run", "two-balls", "--solver", "time-slice", *where) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("solver", ["time-slice", "pymunk", "pymunk-discrete", "pymunk-builtin"])
def test_a_solver_tells_how_far_it_has_come_and_the_run_is_the_same(solver: str) -> None:
    scene, times = load("report"), list[float]()
    dt = {"time-slice": 1e-6, "pymunk": 1e-3}.get(solver, 1e-4)
    usual = simulate(scene, 2, solver=solver, dt=dt)
    [run] = simulate_all(scene, [2], solver=solver, dt=dt, on_time=times.append)
    assert run == usual
    assert times == sorted(times)
    assert len(times) > 10
    assert max(b - a for a, b in pairwise([0.0, *times, run.duration])) < 0.2


WRITERS = {
    "run": ("two-balls", "--max-time", 1),
    "compare": ("two-balls", "--max-time", 1),
    "sensitivity": ("report", "--shot", 3),
    "tradeoff": ("report", "--shot", 3),
    "render": ("two-balls", "--max-time", 1),
    "stability": ("--quick",),
    "sweep": ("report", "--shot", 1, "--samples", 2, "--vary", "angle=1"),
    "fit": ("report", "--measured", "published", "--free", "restitution"),
}
FILE_WRITERS = {
    "page": ("two-balls", ".html"),
    "worksheet": ("", ".html"),
    "atlas": ("report", ".png"),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_place_that_cannot_be_written_is_refused_before_the_run(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """Rights do not tell: root has all of them. So a file is made, and is gone at once."""
    if command in ("collide", "play", "check"):
        return

    def no_file(*_: object, **__: object) -> None:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(tmp_path / "tmpx"))

    monkeypatch.setattr(tempfile, "TemporaryFile", no_file)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Request, "play", no_file)
    words, suffix = WRITERS.get(command), ""
    if words is None:
        scenario, suffix = FILE_WRITERS[command]
        words = (scenario,) if scenario else ()
    out = f"zz{suffix}"
    assert refusal(capsys, command, *words, "--out", out) == f"error: {out}: Permission denied"
    if command != "sweep":  # It has no place of its own.
        line = refusal(capsys, command, *words)
        assert line.startswith("error: renders") and line.endswith("Permission denied"), line
    assert not list(tmp_path.iterdir())


def test_a_folder_in_place_of_a_file_is_refused(tmp_path: Path, capsys: Capture) -> None:
    (tmp_path / "a.html").mkdir()
    line = refusal(capsys, "page", "two-balls", "--out", tmp_path / "a.html")
    assert line == f"error: {tmp_path / 'a.html'}: Is a directory"
