"""What is played says what it warns of, what is left out, what rules a verdict, and how long."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from pool_pymunk import load
from pool_pymunk.cli import beside, read, runs
from pool_pymunk.cli.options import CompareOptions
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.safety.files import bundled
from pool_pymunk.studies import grid
from pool_pymunk.studies.find import find
from pool_pymunk.studies.sweep import job
from pool_pymunk.studies.uncertainty import digits_sentence
from tests.shared.commands import Capture, exit_code

FOURTH = ("report", "--shot", 4)
FEW = ("--budget", 0, "--samples", 2, "--solvers", "pymunk")
# Each command plays the report's fourth shot, in which law published jumps.
PLAYING = {
    "run": ("--no-pictures", "--solver", "event-driven"),
    "render": ("--no-films", "--no-pictures"),
    "page": (),
    "compare": ("--no-pictures", "--solvers", "pymunk"),
    "tradeoff": FEW,
    "sensitivity": ("--no-pictures", "--samples", 2),
}


@pytest.fixture
def out(tmp_path: Path) -> Callable[[str], tuple[object, ...]]:
    """Return the option of a command for its place."""
    return lambda command: ("--out", tmp_path / ("page.html" if command == "page" else "out"))


Out = Callable[[str], tuple[object, ...]]


# -- warnings of runs --------------------------------------------------------------------------


@pytest.mark.parametrize("command", PLAYING)
def test_what_plays_a_run_says_what_it_warns_of(command: str, out: Out, capsys: Capture) -> None:
    assert exit_code(command, *FOURTH, *PLAYING[command], *out(command)) == 0
    printed, errors = capsys.readouterr()
    assert (printed + errors).count("the slip was only a rounding error") == 1
    if command in ("render", "page"):
        assert printed.count("Warning") == 0, "what goes into a pipe is the paths"


@pytest.mark.parametrize("command", ["run", "render", "page", "compare"])
def test_who_misses_published_ends_learns_which_solver_may_have_them(
    command: str, out: Out, capsys: Capture
) -> None:
    assert exit_code(command, *FOURTH, *PLAYING[command], *out(command)) == 0
    assert "--solver time-slice plays by the report's own method." in "".join(capsys.readouterr())
    third = (*FOURTH[:2], 3, *PLAYING[command])
    assert exit_code(command, *third, *out(command)) == 0
    assert "report's own method" not in "".join(capsys.readouterr()), "all its ends agree"
    if command in ("run", "compare"):
        return
    slices = (*FOURTH, *PLAYING[command], "--solver", "time-slice")
    assert exit_code(command, *slices, *out(command)) == 0
    assert "published ends" not in capsys.readouterr().err


def test_published_ends_are_those_of_the_scenario_not_of_a_file(
    tmp_path: Path, capsys: Capture
) -> None:
    """Another scene has published ends, too; only its law tells whether slices may have them."""
    text = bundled()["two-balls"].read_text() + "[shots.published]\nA = [1.0, 2.0]\n"
    for law, says in (("coulomb", False), ("published", True)):
        file = tmp_path / f"{law}.toml"
        file.write_text(text.replace('law = "coulomb"', f'law = "{law}"'))
        assert exit_code("render", file, "--no-films", "--no-pictures", "--out", tmp_path) == 0
        said = capsys.readouterr().err
        assert "0 of 1 agree with the published ends to 0.01 in" in said
        assert ("--solver time-slice" in said) == says


def test_runs_of_a_shot_that_warn_alike_are_one_line() -> None:
    settings = [grid.Column("event-driven"), grid.Column("pymunk", 1 / 240)]
    scene = load("report")
    ((one, other),) = beside.simulate_beside(scene, scene.shots[3:], settings)
    (line,) = runs.warnings_of([one, other])
    assert line.startswith("Warning: Simulation 4 (event-driven; alike: pymunk): in the hit")
    assert line.endswith("s).")


# -- what is left out --------------------------------------------------------------------------


def test_solvers_that_are_left_out_are_named_with_the_reason(
    tmp_path: Path, capsys: Capture
) -> None:
    scene, file = ("follow-and-draw", "--shot", 1), tmp_path / "all.json"
    ends = ("--max-time", 0.05, "--json", file, "--out", tmp_path / "out")
    for command, options in (
        ("compare", ("--no-pictures",)),
        ("tradeoff", ("--budget", 0, "--samples", 2)),
    ):
        assert exit_code(command, *scene, *options, *ends) == 0
        printed = capsys.readouterr().out
        found = json.loads(file.read_text())["left_out"]
        found = found if command == "compare" else found["solvers"]
        longest = "time-slice 1e-06 s"
        assert list(found) == ["pymunk-discrete", "pymunk-builtin", longest]
        assert f"{longest} is left out: it takes longest; --solvers all" in printed
        for name, why in found.items() - {(longest, found[longest])}:
            assert f"{name} is left out: it {why}." in printed
            assert "friction.rolling" in why
            assert "without this key balls only slide" in why


def test_solvers_that_all_play_leave_none_out(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "all.json"
    options = ("--max-time", 0.005, "--no-pictures", "--json", file, "--out", tmp_path)
    assert exit_code("compare", "two-balls", "--solvers", "all", *options) == 0
    assert "left out" not in capsys.readouterr().out
    found = json.loads(file.read_text())
    assert found["left_out"] == {}
    assert found["comparisons"][-1]["solver"] == {"name": "time-slice", "dt": 1e-6}


def test_slices_of_the_report_are_played_where_they_are_asked_for() -> None:
    """By default those of 1e-6 s are left out, because they take longest."""
    scene = load("two-balls")
    for every in (False, True):
        columns, left_out = read.columns(CompareOptions(scenario=""), scene, every=every)
        assert left_out == {"time-slice 1e-06 s": "takes longest; --solvers all plays it, too"}
        longest = [grid.Column("time-slice", 1e-6)]
        for typed in (read.ALL, "time-slice"):
            asked = CompareOptions(scenario="", solvers=typed)
            found, left_out = read.columns(asked, scene, every=every)
            assert [each for each in found if each not in columns] == longest
            assert left_out == {}
    typed_step, left_out = read.columns(CompareOptions(scenario=""), scene, 1e-3)
    assert str(typed_step[-1]) == "time-slice 0.001 s"
    assert left_out == {}


def test_a_shot_without_an_exact_end_is_named_also_when_it_is_alone(
    tmp_path: Path, capsys: Capture
) -> None:
    assert exit_code("tradeoff", *FOURTH, *FEW, "--out", tmp_path) == 0
    printed = capsys.readouterr().out
    assert "Errors of Simulation 4 mean little: it has no exact end (zero slip)." in printed
    assert "is left out" not in printed


# -- from which digits the uncertainty is read -------------------------------------------------


def coarse(folder: Path) -> Path:
    """Return the file of a scene in which one start has a single digit."""
    text = bundled()["follow-and-draw"].read_text()
    file = folder / "coarse.toml"
    file.write_text(text.replace("position = [0.635, 0.635]", "position = [0.635, 0.6]"))
    return file


DIGITS = "Positions given as 0.6 (y of ball cue) are taken to be known to 0.05 m"


def test_the_coarsest_digits_are_named(tmp_path: Path) -> None:
    assert digits_sentence(coarse(tmp_path)).startswith(f"{DIGITS}, half of their last digit;")
    assert "given as 66.00 (x of ball C) are taken to be known to 0.005 in" in digits_sentence(
        "report"
    )


def test_tradeoff_says_from_which_digits_its_verdict_comes(tmp_path: Path, capsys: Capture) -> None:
    scene, file = (coarse(tmp_path), "--shot", 1, *FEW), tmp_path / "all.json"
    where = ("--json", file, "--out", tmp_path)
    assert exit_code("tradeoff", *scene, *where) == 0
    printed = capsys.readouterr().out
    assert DIGITS in printed
    assert "--position-error" in printed
    assert "gains nothing, so it rules the choice: 5 of 5 settings err by less." in printed
    assert json.loads(file.read_text())["known_by"].startswith(DIGITS)
    assert exit_code("tradeoff", *scene, "--position-error", "1e-16", *where) == 0
    printed = capsys.readouterr().out
    assert "taken to be known" not in printed
    assert "and every setting errs by more, so it rules nothing." in printed
    assert json.loads(file.read_text())["known_by"] == ""


def test_sensitivity_says_from_which_digits_it_reads(tmp_path: Path, capsys: Capture) -> None:
    scene = (coarse(tmp_path), "--shot", 1, "--samples", 2, "--no-pictures", "--out", tmp_path)
    file = tmp_path / "all.json"
    assert exit_code("sensitivity", *scene, "--json", file) == 0
    assert DIGITS in capsys.readouterr().out
    assert json.loads(file.read_text())["known_by"].startswith(DIGITS)
    assert exit_code("sensitivity", *scene, "--position-error", "1mm") == 0
    assert "taken to be known" not in capsys.readouterr().out


# -- how long it takes -------------------------------------------------------------------------


def at_a_terminal(arguments: list[str]) -> str:
    """Return what a command writes to a terminal on stderr, while its results go into a pipe."""
    import pty  # Windows has none.

    main, other = pty.openpty()
    subprocess.run(
        [sys.executable, "-m", "pool_pymunk", *arguments],
        stdout=subprocess.PIPE, stderr=other, check=True,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    )  # fmt: skip
    os.close(other)
    said = b""
    with os.fdopen(main, "rb", buffering=0) as screen, suppress(OSError):  # It ends with an error.
        while part := screen.read(4096):
            said += part
    return said.decode()


def test_a_terminal_shows_how_far_a_command_is(tmp_path: Path) -> None:
    options = ["--shot", "3", "--no-pictures", "--out", str(tmp_path)]
    said = at_a_terminal(["run", "report", "--dt", "1e-4", *options])
    assert re.search(r"simulating \(at \d\.\d{3} s\).*0/1", said)
    assert re.search(r"measuring .*0/3", at_a_terminal(["compare", "report", *options]))


def test_a_pipe_is_not_told_how_far_a_command_is(capsys: Capture) -> None:
    with Bar("playing", 10) as bar:
        bar.step()
        bar.at(1.0)
        assert bar.tasks[0].completed == 1
    assert capsys.readouterr() == ("", "")


def test_a_search_says_how_far_it_has_come() -> None:
    said: list[tuple[int, int]] = []
    find(
        load("two-balls"), 1, lambda batch: batch.hits > 0, tries=600, samples=10, best=1,
        on_done=lambda *both: said.append(both),
    )  # fmt: skip
    done, planned_ = zip(*said, strict=True)
    assert list(done) == sorted(done)
    assert planned_[0] == 600 + 12 * 5 * 10
    assert 600 < done[-1] <= planned_[-1]


def test_a_long_part_of_a_sweep_counts_its_shots(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow")
    shots: list[int] = []
    vary = {"angle": (-1.0, 1.0)}
    job.sweep(load("two-balls"), 1, vary=vary, samples=30, chunk=30, out=tmp_path,
              on_shots=shots.append)  # fmt: skip
    assert sum(shots) == 30


def test_what_is_printed_under_a_bar_goes_where_it_was_sent(tmp_path: Path) -> None:
    """Tables and log are in a pipe, while the bar is on a terminal."""
    import pty  # Windows has none.

    main, other = pty.openpty()
    options = ("--shot", "3", "--no-pictures", "--out", str(tmp_path))
    for command, says in (("run", "Final Ball positions"), ("compare", "Exact ends, and")):
        done = subprocess.run(
            [sys.executable, "-m", "pool_pymunk", command, "report", *options],
            stdout=subprocess.PIPE, stderr=other, text=True, check=True,
            env={**os.environ, "TERM": "xterm"},
        )  # fmt: skip
        assert says in done.stdout
    os.close(other)
    os.close(main)
