"""What a user chooses reaches what it is for: seeds, units, shots and other folders."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from pool_pymunk import load, simulate
from pool_pymunk.cli import beside, runs
from pool_pymunk.render import diagram
from pool_pymunk.studies.grid import Column
from tests.shared.commands import Capture, exit_code, refusal

THIRD = ("report", "--shot", 3)
PLAIN = (*THIRD, "--solver", "event-driven", "--no-pictures")


def test_the_seed_of_a_tradeoff_decides_what_rounded_inputs_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagram, "draw", lambda found, paths: None)
    few = ("--budget", 0, "--samples", 3, "--solvers", "pymunk:1/60", "--position-error", "0.01 in")
    spreads = []
    for seed in (1, 2):
        file = tmp_path / "all.json"
        where = ("--seed", seed, "--json", file, "--out", tmp_path)
        assert exit_code("tradeoff", *THIRD, *few, *where) == 0
        found = json.loads(file.read_text())
        assert found["seed"] == seed
        spreads.append(found["spread"])
    assert spreads[0] != spreads[1]


def test_a_shot_is_compared_with_the_same_shot_of_a_folder(tmp_path: Path, capsys: Capture) -> None:
    first, second = tmp_path / "one", tmp_path / "two"
    assert exit_code("run", *PLAIN, "--out", first) == 0
    assert [path.name for path in first.glob("*.npz")] == ["shot-3.npz"]
    assert exit_code("run", *PLAIN, "--out", second, "--against", first) == 0
    assert f"All 11 ends in {first} are the same to 0.01 in" in capsys.readouterr().out


@pytest.mark.parametrize("unit", ["in", "m", "mm"])
def test_all_tables_of_a_run_are_in_the_units_that_are_asked_for(unit: str, tmp_path: Path) -> None:
    assert exit_code("run", *PLAIN, "--contacts", "--units", unit, "--out", tmp_path) == 0
    samples, contacts = (
        (tmp_path / f"shot-3{name}.csv").read_text("utf-8").splitlines()[0].split(",")
        for name in ("", "-contacts")
    )
    assert f"x ({unit})" in contacts and "impulse (N s)" in contacts
    assert f"x ({unit})" in samples


def test_another_scene_plays_the_shots_that_were_chosen() -> None:
    scene, other = load("report"), load("report-corrected")
    chosen = [scene.shots[2], scene.shots[1]]
    rows = beside.play_beside(scene, chosen, [Column("event-driven")], [other])
    for shot, (one, its) in zip(chosen, rows, strict=True):
        assert one.shot == shot and its.scene == other
        assert its.shot == other.shots[scene.shots.index(shot)]


def test_a_solver_that_warns_twice_alike_is_named_once() -> None:
    run = simulate(load("two-balls"), solver="event-driven", max_time=0.1)
    one, other = (replace(run, warnings=(f"a ball is {x} m off",)) for x in (0.5, 0.7))
    [line] = runs.warnings_of([one, other, replace(other, solver="pymunk")])
    assert line.startswith("Warning: ")
    assert "(event-driven; alike: pymunk): a ball is 0.5 m off" in line


def test_an_option_that_is_nearly_right_is_suggested(capsys: Capture) -> None:
    said = refusal(capsys, "compare", "report", "--solver", "pymunk")
    assert said == 'error: No such option: --solver; did you mean "--solvers"?'
    assert refusal(capsys, "run", "report", "--xyz", "5") == "error: No such option: --xyz"


def test_compare_lists_each_solver_once(tmp_path: Path) -> None:
    words = ("--shot", "3", "--solvers", "event-driven,pymunk,pymunk:1/240,pymunk", "--no-pictures")
    file = tmp_path / "ends.json"
    assert exit_code("compare", "report", *words, "--out", tmp_path, "--json", file) == 0
    rows = json.loads(file.read_text())["comparisons"]
    assert [row["solver"]["name"] for row in rows] == ["pymunk"]
