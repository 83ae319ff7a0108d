"""The command line works as a user types it."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pool_pymunk import SOLVERS, SettingError, Units, __version__, load
from pool_pymunk.cli import main, read
from pool_pymunk.cli.options import CompareOptions
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.scenario import bundled
from tests.shared.scenes import INCH, Answer, typed


def one_line(result: Answer) -> str:
    """Return the single line that answers bad input.

    The exit code is 2, stdout is empty, and there is no traceback.
    """
    assert result.returncode == 2
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1, result.stderr
    return result.stderr.strip()


# -- help and version ------------------------------------------------------------------------------


def test_a_process_of_its_own_answers_as_well() -> None:
    def ran(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "pool_pymunk", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert ran("--version").stdout.splitlines()[0] == __version__
    refused, said = ran("run", "nowhere"), typed("run", "nowhere")
    assert (refused.returncode, refused.stdout, refused.stderr) == said
    assert one_line(said)


# -- run -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def report_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Return the log of ``run report`` and the folder with what it wrote."""
    folder = tmp_path_factory.mktemp("report")
    result = typed("run", "report", "--out", folder / "out", "--json", folder / "all.json")
    assert result.returncode == 0, result.stderr
    return result.stdout, folder


def test_the_log_has_the_form_of_listing_1(report_run: tuple[str, Path]) -> None:
    lines = report_run[0].splitlines()
    assert "Closest ball to Cue ball: Ball  1" in lines
    assert "Attitude to closest ball: -178.298 deg" in lines
    assert "Simulation 1: Cue velocity = [-4.000, 0.000] (m/s)" in lines
    assert "Simulation 2: Cue velocity = [-2.415, 0.647] (m/s)" in lines
    ends = [line for line in lines if line.startswith("    Ball ")]
    assert len(ends) == 8 + 3 + 1 + 4  # The other balls have a line in common.
    assert "    Balls 1, 2, 3, 4, 5, 6, 7, 8, 9, 10: did not move" in lines
    assert not any("step" in line for line in lines)
    assert ends[0].startswith("    Ball  C: [27.36, 29.12] (in)   [27.37, 29.12]")
    assert any(line.startswith("    Warning: in the hit of balls C and 1") for line in lines)


def test_the_json_can_be_printed_in_place_of_the_log(tmp_path: Path) -> None:
    shot = ("--shot", 1, "--max-time", "0.2", "--no-pictures", "--out", tmp_path)
    plain, printed = typed("run", "report", *shot), typed("run", "report", *shot, "--json", "-")
    assert json.loads(printed.stdout)["shots"][0]["name"] == "Simulation 1"
    assert printed.stderr == plain.stdout + plain.stderr
    disc = ("--mass-a", 1, "--mass-b", 1, "--radius", 0.03, "--velocity-a", 2, 0)
    assert json.loads(typed("collide", *disc, "--json", "-").stdout)["energy"]
    assert one_line(typed("run", "nowhere", "--json", "-"))
    assert not Path("-").exists()


def test_a_file_is_not_taken_for_a_folder(tmp_path: Path) -> None:
    for file in (tmp_path / "film.gif", tmp_path / "all.json"):
        said = one_line(typed("render", "report", "--out", file))
        assert said == f"error: --out = {file}: must be a folder, in which each file gets a name"
    folder = tmp_path / "v1.csv"
    folder.mkdir()
    assert typed("run", "report", "--shot", 1, "--no-pictures", "--out", folder).returncode == 0


def test_the_json_has_everything(report_run: tuple[str, Path]) -> None:
    content = json.loads((report_run[1] / "all.json").read_text())
    assert content["scenario"] == "report"
    assert content["solver"] == {"name": "pymunk", "dt": 1 / 240, "contact_tolerance": 1e-7}
    first = content["shots"][0]
    assert first["name"] == "Simulation 1"
    assert first["ball"] == "C"
    assert first["velocity"] == [-4.0, 0.0]
    assert first["status"] == "settled"
    assert first["duration"] == pytest.approx(1.51905415938, abs=1e-10)
    assert first["steps"] > 300
    assert first["wall_time"] > 0
    assert first["final"]["8"] == pytest.approx([0.374564807887, 0.238579756841], abs=1e-11)
    assert first["events"][0] == {
        "t": pytest.approx(0.13880005116119, abs=1e-13), "kind": "ball-ball", "balls": ["C", "1"],
        "impulse": pytest.approx(0.57526459879793), "tangential": pytest.approx(0.02876322993990),
        "tangential_first": pytest.approx(0.02876322993990),
    }  # fmt: skip
    cushions = [e["cushion"] for e in first["events"] if e["kind"] == "ball-cushion"]
    assert cushions == [0, 0, 3, 3, 2]
    assert first["events"][-1]["kind"] == "stop"
    assert first["energy"] == {"initial": pytest.approx(1.6), "final": 0.0}
    assert 0.0 < first["rounding"] < 1e-11 and first["persistent_shift"] == 0.0
    assert content["shots"][3]["policy_shift"] == pytest.approx(2.45 * 0.0254, abs=2e-4)
    [warning] = first["warnings"]
    assert warning.startswith("law published added energy in 1 contact: 0.0235 % of")
    assert "only a rounding error" in content["shots"][3]["warnings"][0]


def test_the_data_files_hold_the_run(report_run: tuple[str, Path]) -> None:
    out = report_run[1] / "out"
    content = json.loads((report_run[1] / "all.json").read_text())
    data = np.load(out / "shot-1.npz")
    assert data["position"].shape == (len(data["t"]), 11, 2)
    final = np.array(list(content["shots"][0]["final"].values()))
    np.testing.assert_allclose(data["position"][-1], final, rtol=0.0, atol=1e-15)
    with (out / "shot-1.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 11 * len(data["t"])
    assert float(rows[-1]["x (m)"]) == final[-1][0]
    energies = [float(row["energy (J)"]) for row in rows]
    energy = content["shots"][0]["energy"]
    assert sum(energies[:11]) == pytest.approx(energy["initial"], rel=1e-12)
    assert sum(energies[-11:]) == pytest.approx(energy["final"], abs=1e-12)
    with (out / "shot-1-events.csv").open() as file:
        events = list(csv.DictReader(file))
    assert [float(e["t"]) for e in events] == [e["t"] for e in content["shots"][0]["events"]]
    for shot in (1, 2, 3, 4):
        for when in ("start", "end"):
            assert (out / f"shot-{shot}-{when}.png").stat().st_size > 20_000
    assert not [path for path in out.iterdir() if path.name.startswith(".")]


def test_the_data_are_in_the_units_asked_for(tmp_path: Path) -> None:
    """The energy is in J everywhere, and includes that of the roll."""
    scene = replace(load("follow-and-draw"), units=Units("in", "g", "in/s"))
    (tmp_path / "inches.toml").write_text(scene.to_toml())
    tables: dict[str, tuple[list[str], Array]] = {}
    for units in ("m,kg,m/s", "scene", "cm"):
        more = ("--shot", "follow", "--no-pictures", "--solver", "event-driven", "--units", units)
        done = typed("run", tmp_path / "inches.toml", *more, "--out", tmp_path)
        assert done.returncode == 0, done.stderr
        with (tmp_path / "shot-1.csv").open() as file:
            heading, *rows = csv.reader(file)
        tables[units] = heading, np.array([[row[0], *row[2:]] for row in rows], dtype=float)
        assert (*heading[:2], heading[-1]) == ("t (s)", "ball", "energy (J)")
    assert tables["scene"][0][2:6] == ["x (in)", "y (in)", "vx (in/s)", "vy (in/s)"]
    assert tables["cm"][0][2:6] == ["x (cm)", "y (cm)", "vx (m/s)", "vy (m/s)"]
    si, inches, cm = (tables[units][1] for units in ("m,kg,m/s", "scene", "cm"))
    assert inches[:, 1:5] * 0.0254 == pytest.approx(si[:, 1:5], rel=1e-12, abs=1e-15)
    assert cm[:, 1:3] == pytest.approx(100.0 * si[:, 1:3], rel=1e-12)
    assert np.array_equal(inches[:, 5], si[:, 5])
    # The cue ball of 0.17 kg rolls at 3 m/s: m v^2 / 2 + m v^2 / 5.
    assert si[0, 5] == pytest.approx(0.7 * 0.17 * 3.0**2)
    assert "there is no such unit" in one_line(typed("run", "report", "--units", "mile"))


def test_one_shot_by_number_or_name(tmp_path: Path) -> None:
    for folder_name, shot in (("by number", "3"), ("by name", "Simulation 3")):
        folder = tmp_path / folder_name
        options = ("--no-pictures", "--out", folder, "--solver", "event-driven")
        result = typed("run", "report", "--shot", shot, *options)
        assert result.returncode == 0, result.stderr
        assert result.stdout.count("Simulation") == 1
        assert "Simulation 3" in result.stdout
        assert {path.name for path in folder.glob("*.npz")} == {"shot-3.npz"}


def test_a_shot_that_goes_on_from_the_one_before(tmp_path: Path) -> None:
    file = tmp_path / "chain.toml"
    file.write_text(
        "[friction]\nsurface = 0.1\n[[balls]]\nid = 'C'\ncue = true\nradius = 0.05\nmass = 0.2\n"
        "position = [0.0, 0.0]\n[[shots]]\nvelocity = [1.0, 0.0]\n"
        "[[shots]]\nvelocity = [0.0, 1.0]\nfrom = 'previous'\n"
    )
    length = 1 / (2 * 0.1 * 9.80665)
    for arguments in ((), ("--shot", "2")):
        out = tmp_path / "r.json"
        result = typed("run", file, *arguments, "--json", out, "--out", tmp_path, "--no-pictures")
        assert result.returncode == 0, result.stderr
        last = json.loads(out.read_text())["shots"][-1]
        assert last["final"]["C"] == pytest.approx([length, length])


def test_the_time_slice_solver_reports_44_of_44(tmp_path: Path) -> None:
    began = time.perf_counter()
    file = tmp_path / "r.json"
    options = ("--solver", "time-slice", "--dt", "1e-6", "--no-pictures", "--out", tmp_path)
    result = typed("run", "report", *options, "--json", file)
    assert "Published ends: 44 of 44 agree to 0.01 (11 + 11 + 11 + 11)" in result.stdout
    assert "Simulation" not in result.stdout.partition("Published ends:")[2]
    walls = [shot["wall_time"] for shot in json.loads(file.read_text())["shots"]]
    assert 0 < sum(walls) <= time.perf_counter() - began


Said = pytest.CaptureFixture[str]


def test_an_exact_run_says_why_the_ends_of_the_report_lie_elsewhere(
    tmp_path: Path, capsys: Said
) -> None:
    copy = tmp_path / "another-name.toml"
    copy.write_bytes(bundled()["report"].read_bytes())
    for scenario in ("report", copy):
        first, fourth = reasons(capsys, scenario, tmp_path, "--solver", "event-driven")
        assert first.startswith("Simulation 1: the published ends are those of time slices")
        assert fourth.startswith("Simulation 4: the first hit has no slip")
    (alone,) = reasons(capsys, "report", tmp_path, "--solver", "event-driven", "--shot", "4")
    assert alone.startswith("Simulation 4")


@pytest.mark.parametrize(
    ("old", "new", "options"),
    [
        ("length = 88.0", "length = 87.0", ()),
        ("C = [27.37, 29.12]", "C = [27.99, 29.12]", ()),
        ("speed = 2.5", "speed = 2.6", ()),
        ("", "", ("--law", "coulomb")),
        ("", "", ("--max-time", "0.3")),
        ("", "", ("--solver", "pymunk-discrete")),
        ("", "", ("--solver", "pymunk-builtin")),
    ],
)
def test_no_reason_is_given_for_what_has_been_changed(
    old: str, new: str, options: tuple[str, ...], tmp_path: Path, capsys: Said
) -> None:
    changed = tmp_path / "report.toml"
    text = bundled()["report"].read_text()
    assert old in text
    changed.write_text(text.replace(old, new))
    assert reasons(capsys, changed, tmp_path, "--solver", "event-driven", *options) == []


def reasons(capsys: Said, scenario: object, out: Path, *options: str) -> list[str]:
    """Return what a log says of single shots after the line that counts published ends."""
    with pytest.raises(SystemExit) as ended:
        main(["run", str(scenario), *options, "--no-pictures", "--out", str(out)])
    assert ended.value.code == 0
    count, *lines = capsys.readouterr().out.partition("Published ends:")[2].splitlines()
    assert "agree to 0.01" in count
    return [line for line in lines if line.startswith("Simulation")]


def test_a_second_log_is_the_differences_from_the_first(tmp_path: Path) -> None:
    """`make run` plays the report by time slices, then in pymunk."""
    options = ("report", "--no-pictures", "--out")
    first = typed("run", *options, tmp_path / "one", "--solver", "time-slice", "--dt", "1e-5")
    assert first.returncode == 0, first.stderr
    log = typed("run", *options, tmp_path / "two", "--against", tmp_path / "one").stdout
    shots = log.split("Simulation")
    assert f"    All 11 ends in {tmp_path / 'one'} are the same to 0.01 in" in shots[3]
    ends = [line.split() for line in log.splitlines() if line.startswith("    Ball ")]
    assert all(line[-2:] == ["from", "there"] for line in ends)
    assert f"    Ends that differ from those in {tmp_path / 'one'}:" in shots[1].splitlines()
    one, two = (np.load(tmp_path / name / "shot-1.npz") for name in ("one", "two"))
    apart = np.hypot(*(one["position"][-1] - two["position"][-1]).T) / INCH
    far = {ball: f"{d:.3f}" for ball, d in zip(one["balls"], apart, strict=True) if d > 0.01}
    said = [line for line in shots[1].splitlines() if line.endswith("from there")]
    assert {
        line.split(":")[0].split()[-1]: line.split()[-3] for line in said
    }.items() >= far.items()


@pytest.mark.parametrize("scene", ["report", "two-balls"])
def test_a_log_needs_a_run_of_the_same_balls_to_differ_from(scene: str, tmp_path: Path) -> None:
    typed("run", "hexagon", "--shot", 2, "--no-pictures", "--out", tmp_path / "other")
    there = {"report": tmp_path / "none", "two-balls": tmp_path / "other"}[scene]
    if scene == "two-balls":
        (there / "shot-2.npz").rename(there / "shot-1.npz")
    result = typed("run", scene, "--no-pictures", "--against", there, "--out", tmp_path / "out")
    says = {"report": "shot-1.npz is missing there, or no run has written it",
            "two-balls": "shot-1.npz has other balls"}[scene]  # fmt: skip
    assert result.returncode == 2 and result.stderr.startswith("error: --against = ")
    assert result.stderr.endswith(f": {says}\n")


@pytest.mark.parametrize(
    ("arguments", "serves"),
    [
        (("run", "report", "--verbose"), "--json"),
        (("sweep", "report", "--chunk", 100, "--out", "o"), "chunk="),
        (("sensitivity", "report", "--threads=2"), "--workers"),
        (("page", "--help-all"), "--help"),
        (("--help-all",), "--help"),
    ],
)
def test_who_types_a_former_option_learns_what_serves(
    arguments: tuple[object, ...], serves: str
) -> None:
    gone = next(str(each) for each in arguments if str(each)[:3] in ("--v", "--c", "--t", "--h"))
    line = one_line(typed(*arguments))
    assert line.startswith(f"error: {gone.partition('=')[0]}: is no more: ")
    assert serves in line.partition("is no more")[2]


def test_balls_off_the_table_have_a_line_in_common(tmp_path: Path) -> None:
    options = ("--shot", 2, "--no-pictures", "--solver", "event-driven", "--out", tmp_path)
    lines = typed("run", "eight-ball", *options).stdout.splitlines()
    assert "    Ball 12: off the table" in lines
    assert sum(line.startswith("    Ball 12") for line in lines) == 1


# -- check and compare -----------------------------------------------------------------------------


def test_check_says_what_is_modelled() -> None:
    full = typed("check", "report").stdout
    assert Path(full.partition("file: ")[2].splitlines()[0]).samefile(bundled()["report"])
    assert "law published" in full
    assert "4 cushions" in full
    bare = typed("check", "two-balls").stdout
    assert "no cushions" in bare
    assert "no damping callback" in bare and "roll" not in bare
    rolls = typed("check", "follow-and-draw").stdout
    assert "rolling friction: 0.0980665 m/s^2; balls slide, then roll" in rolls
    assert rolls.count("rolling friction") == 1


@pytest.mark.parametrize(
    ("name", "once"), [("report", ("0.9", "0.05", "0.1")), ("eight-ball", ("0.14", "0.03", "0.01"))]
)
def test_check_says_each_coefficient_once(name: str, once: tuple[str, ...]) -> None:
    words = typed("check", name).stdout.replace(",", " ").split()
    assert [words.count(number) for number in once] == [1, 1, 1]


def test_solvers_that_nobody_named_may_be_unable_to_roll() -> None:
    scene = load("follow-and-draw")
    rolling = [name for name, solver in SOLVERS.items() if solver.rolls]
    playing, left_out = read.columns(CompareOptions(scenario=""), scene, 1e-3, every=True)
    assert {each.solver for each in playing} == {*rolling}
    assert list(left_out) == [name for name in SOLVERS if name not in rolling]
    assert all("friction.rolling" in why for why in left_out.values())
    every, none = read.columns(CompareOptions(scenario=""), load("report"), 1e-3, every=True)
    assert ({each.solver for each in every}, none) == ({*SOLVERS}, {})
    with pytest.raises(SettingError, match="pymunk-discrete: does not roll balls"):
        read.columns(CompareOptions(scenario="", solvers="pymunk-discrete"), scene)


def test_compare_explains_the_published_ends(tmp_path: Path) -> None:
    file = tmp_path / "c.json"
    options = ("--solvers", "pymunk:1/60,pymunk-discrete:1e-3", "--no-pictures", "--out", tmp_path)
    result = typed("compare", "report", *options, "--json", file)
    assert result.returncode == 0, result.stderr
    assert "up to 0.014 in off the exact ones, along x or y (ball 3)" in result.stdout
    assert "got its sign from rounding there" in result.stdout
    found = json.loads(file.read_text())
    records, exact = found["comparisons"], found["exact"]
    assert len(records) == 8
    assert all(r["largest"] < 1e-9 * INCH for r in records if r["solver"]["name"] == "pymunk")
    parted = [r for r in records if r["divergence"]]
    assert parted
    assert {"t", "kind", "text"} <= set(parted[0]["divergence"])
    with (tmp_path / "ends.csv").open() as table:
        rows = [row for row in csv.DictReader(table) if row["solver"] == "event-driven"]
    assert len(rows) == 44 and {float(row["distance"]) for row in rows} == {0.0}
    for row in rows:
        assert [float(row["x"]), float(row["y"])] == exact[row["shot"]][row["ball"]]


def test_tradeoff_measures_and_draws(tmp_path: Path) -> None:
    options = ("--shot", 3, "--solvers", "pymunk,pymunk-discrete,event-driven", "--budget", 0.2)
    result = typed("tradeoff", "report", *options, "--samples", 8, "--out", tmp_path)
    assert result.returncode == 0, result.stderr
    assert "time for Simulation 3" in result.stdout
    assert "Within 0.001 in: pymunk at" in result.stdout
    assert (tmp_path / "tradeoff.png").stat().st_size > 20_000
    assert (tmp_path / "tradeoff.svg").exists()
    with (tmp_path / "tradeoff.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {"solver", "dt", "largest", "rms", "time", "python", "seed"} <= set(rows[0])


# -- bad input -------------------------------------------------------------------------------------


def test_problems_of_a_scenario_name_file_key_and_value(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(
        "[ball]\nradius = -1\nmass = 0.2\n[friction]\nsurface = 0.1\n"
        "[[balls]]\nid = 'a'\nposition = [0, 'x']\n"
    )
    result = typed("run", file, cwd=tmp_path)
    assert result.returncode == 2
    lines = result.stderr.splitlines()
    assert len(lines) == 2
    assert all(str(file) in line for line in lines)
    assert any("radius = -1" in line for line in lines)
    assert any('= "x"' in line for line in lines)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]


def test_check_says_how_large_all_is_and_warns_of_giants(tmp_path: Path) -> None:
    shown = typed("check", "report").stdout
    assert "size over all: 88 x 44 in (2.2352 x 1.1176 m)" in shown
    assert "mass: 160, 200 g (0.16, 0.2 kg)" in shown
    assert "fastest shot: 4 m/s" in shown
    assert "Warning" not in shown
    text = bundled()["report"].read_text()
    (tmp_path / "giant.toml").write_text(text.replace('"in"', '"m"').replace('"g"', '"kg"'))
    giant = typed("check", str(tmp_path / "giant.toml"))
    assert giant.returncode == 0
    assert "Warning: the table is 88 m long; is a unit or a digit wrong?" in giant.stdout
    assert "ball C has 4.19 kg/m^3, less than a foam" in giant.stdout
    assert all("Warning" not in typed("check", name).stdout for name in bundled())


def test_check_and_run_warn_of_a_pocket_that_no_ball_can_reach(tmp_path: Path) -> None:
    pocket = "[[pockets]]\nid = 'corner'\nposition = [88.0, 44.0]\nradius = 3.0\n[[shots]]"
    text = bundled()["report"].read_text().replace("[[shots]]", pocket, 1)
    (tmp_path / "small.toml").write_text(text)
    for line in (("check",), ("run", "--no-pictures", "--shot", 3, "--solver", "event-driven")):
        said = typed(line[0], "small.toml", *line[1:], cwd=tmp_path).stdout
        assert said.count("Warning: no ball can reach pocket corner: ") == 1


def test_a_range_with_dots_is_told_how_it_is_written() -> None:
    with pytest.raises(Exception, match=r"--vary angle = -2\.\.2: must be LOW:HIGH"):
        read.varied("--vary", ["angle=-2..2"], Units())
