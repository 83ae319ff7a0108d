"""The cheap figures of README and docs are what their commands print today."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import re
import runpy
import shlex
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Disc,
    Material,
    Sensitivity,
    collide,
    load,
    sensitivity,
    simulate,
    simulate_many,
    sweep,
    written_uncertainty,
)
from pool_pymunk.cli import main
from pool_pymunk.core.contact import collapse, instant, rounds
from pool_pymunk.core.motion.path import LOST
from pool_pymunk.core.persistent import gatherings, unseen
from pool_pymunk.core.persistent.groups import WIDEST
from pool_pymunk.render import FilmSettings
from pool_pymunk.results.variants import FINER
from pool_pymunk.solvers.record import CONTACT_TOLERANCE
from pool_pymunk.solvers.request import QUICK
from pool_pymunk.studies.atlas import SIZE
from pool_pymunk.studies.grid import Column
from tests import DATA, ROOT
from tests.oracle import reference
from tests.oracle.hard_reference import Settings
from tests.oracle.press_reference import press_run
from tests.shared.scenes import tradeoff

HOME = ROOT
INCH = 0.0254
PAGES = "README.md", "docs/solver-and-step.md"  # Both have the table of the solvers.


def text(page: str) -> str:
    """Return a page with its line breaks taken out."""
    return flat((HOME / page).read_text(encoding="utf-8"))


def flat(lines: str) -> str:
    return " ".join(lines.split())


def blocks(page: str, language: str = "") -> list[str]:
    """Return the blocks of a page in one language, or those of commands and what they print."""
    lines = (HOME / page).read_text(encoding="utf-8")
    fenced = re.findall(r"^```(\S*).*?\n(.*?)^```$", lines, flags=re.DOTALL | re.MULTILINE)
    return [block for name, block in fenced if name == language]


def printed(command: str) -> str:
    """Return what a command prints, with its line breaks taken out, and paths as on Linux."""
    with contextlib.redirect_stdout(io.StringIO()) as out, pytest.raises(SystemExit) as ended:
        main(shlex.split(command)[1:])
    assert not ended.value.code
    return flat(out.getvalue().replace("\\", "/"))


def lines_that_stay(block: str) -> list[str]:
    """Return the lines of a block without the times at their ends, and without what is left out."""
    lines = [flat(re.sub(r"[\d.]+ s$", "", line)) for line in block.splitlines()]
    return [line for line in lines if line not in ("", "...")]


@cache
def played(page: str) -> tuple[dict[str, Any], str]:
    """Run the Python of a page; return its names, and what it prints."""
    names: dict[str, Any] = {}
    with contextlib.redirect_stdout(io.StringIO()) as out:
        exec("\n".join(blocks(page, "python")), names)
    return names, out.getvalue()


# -- the solvers -----------------------------------------------------------------------------------


@cache
def error(solver: str, dt: float | None, *shots: int) -> float:
    """Return the largest error of an end (in), as `tradeoff report --solvers all` has it."""
    scene = load("report")
    chosen = [scene.shots[k - 1] for k in shots]
    [setting] = tradeoff(scene, [Column(solver, dt)], *chosen).settings
    return setting.largest / INCH


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.slow
def test_what_the_solvers_err(page: str) -> None:
    for solver in ("pymunk-discrete", "pymunk-builtin"):
        assert f" {error(solver, 1e-4):.2g} in at 1e-4 s" in text(page)
    # The first shot is the worst of them, and quick enough.
    assert f" {error('time-slice', 1e-6, 1):.1g} in at 1e-6 s" in text(page)


@pytest.mark.parametrize("page", PAGES)
def test_what_rounding_leaves(page: str) -> None:
    found = re.search(r"\| rounding \((.*?) in\)", text(page))
    assert found
    assert 0.2 < error("event-driven", None) / float(found[1]) < 5.0


@pytest.mark.parametrize("page", ["docs/accuracy.md"])
def test_the_references(page: str) -> None:
    data = DATA
    for names, words in ((reference.FILES, "random scenes"), (["hard"], "scenes")):
        files = [(data / f"{name}_runs.json").read_text(encoding="utf-8") for name in names]
        assert f"{sum(len(json.loads(file)) for file in files)} {words}" in text(page)
    assert (reference.DIGITS, Settings().digits) == (40, 90)
    assert re.search(r"forty (and ninety )?digits", text(page))
    assert "ninety digits" in text(page)


# -- what the starts do to the ends ----------------------------------------------------------------


@cache
def spread(shot: int = 1, samples: int = 1000) -> Sensitivity:
    """Do what `pool-pymunk sensitivity report --shot 1` does."""
    return sensitivity(load("report"), shot, written_uncertainty("report"), samples=samples)


def test_what_the_starts_do_to_the_ends() -> None:
    worst, page = spread().worst, text("docs/solver-and-step.md")
    assert f"Ball {worst.ball} spreads most" in page
    assert f"standard deviation of {worst.deviation / INCH:.1f} in" in page
    assert worst.amplification is not None
    assert f"{worst.amplification:.0f} times that of the starts" in page
    low, high = worst.low[0] / INCH, worst.high[0] / INCH
    assert f"95 % of its ends lie between {low:.2f} and {high:.2f} in along x" in page
    kept, all_ = spread().kept_digits
    assert f"Of the {all_} digits of the printed ends, {kept} mean anything" in page
    assert f"From {spread().horizon:.2f} s on, half of the runs" in page
    assert f"in {100 * spread().same:.0f} % of them" in page


def test_in_simulation_3_all_digits_hold() -> None:
    kept, all_ = spread(shot=3).kept_digits
    assert kept == all_
    assert f"all its {all_} digits hold" in text("docs/solver-and-step.md")


# -- what was found in the report ------------------------------------------------------------------


def test_the_log_of_the_reports_listing(tmp_path: Path) -> None:
    of_shot_1 = blocks("docs/report.md")[0].rpartition("...")[0]
    out = printed(
        f"pool-pymunk run report --shot 1 --solver time-slice --no-pictures --out '{tmp_path}'"
    )
    assert len(lines_that_stay(of_shot_1)) > 6
    for line in lines_that_stay(of_shot_1):
        assert line in out


def test_the_same_figure_stands_in_what_was_found_in_the_report() -> None:
    assert f"standard deviation of {spread().worst.deviation / INCH:.1f} in" in text(
        "docs/report.md"
    )


def test_published_ends_beside_exact_ones() -> None:
    scene, page = load("report"), text("docs/report.md")
    shot = scene.shots[0]
    run = simulate(scene, shot, solver="event-driven")
    off = np.array([np.subtract(run.final[id_], end) for id_, end in shot.published.items()])
    found = re.search(
        r"published ends are up to ([0-9.]+) in off the exact ones along x or y", page
    )
    assert found
    assert float(found[1]) == pytest.approx(np.abs(off).max() / INCH, abs=0.0005)


def test_a_rounding_error_moves_ball_9() -> None:
    ends = [
        simulate(load("report"), 4, solver=solver).final["9"]
        for solver in ("event-driven", "time-slice")
    ]
    assert f"moves ball 9 by {math.dist(*ends) / INCH:.2f} in" in text("docs/report.md")


def test_simulation_4_has_three_ends() -> None:
    page = text("docs/report.md")
    names, out = played("docs/report.md")
    assert out == blocks("docs/report.md")[1]
    aimed, published = simulate(names["scene"], 4, solver="event-driven"), names["shot"].published
    assert "({:.2f}, {:.2f}) in".format(*(x / INCH for x in published["9"])) in page
    assert f"ends may lie elsewhere: {aimed.policy_shift / INCH:.2g} in" in page
    ends = re.findall(r"ends at \(([\d.]+), ([\d.]+)\) in", out)
    plus, own, minus = ((float(x), float(y)) for x, y in ends)
    far = math.dist(plus, own), math.dist(minus, own)
    assert "of ball 9 ({:.2f} and {:.2f} in)".format(*far) in page
    anew = sensitivity(names["scene"], 4, spread(4).uncertainty, aims_anew=True).worst.deviation
    assert f"deviation of {spread(4).worst.deviation / INCH:.2g} in" in page
    assert f"one of {anew / INCH:.2g} in for a player who" in page


def test_eight_things_were_found() -> None:
    lines = (HOME / "docs" / "report.md").read_text(encoding="utf-8")
    assert re.findall(r"^(\d)\. ", lines, flags=re.MULTILINE) == list("12345678")
    assert "eight things were found" in text("README.md")


# -- inelastic collapse, and other limits ----------------------------------------------------------


def test_hits_without_end_are_leapt_over() -> None:
    names, _ = played("docs/accuracy.md")
    more = re.search(r"([\d,]+) more followed", names["run"].warnings[0])
    assert more
    millions = round(int(more[1].replace(",", "")) / 1e6)
    assert f"show {millions} million hits" in text("docs/accuracy.md")


def test_limits_of_hits_that_have_no_exact_answer() -> None:
    page = text("docs/accuracy.md")
    assert f"within {collapse.MOST_HITS:,} hits" in page
    assert f"({collapse.MOST_IN_CLUSTER:,} if it has more than eight contacts, " in page
    assert f"contacts, {rounds.MOST_IN_PILE} in a pile)" in page
    assert (collapse.CLUSTER, instant.LISTED) == (8, 100)
    assert (LOST, QUICK) == (1e-3, 2.0)
    assert (CONTACT_TOLERANCE, WIDEST) == (1e-7, 1e-3)
    assert "which is 1e-7 m by default" in page
    assert "never wider than a thousandth of the smallest radius" in page
    assert "travels 1e-3 of its radius" in page
    assert "Runs computed in under two seconds" in page


def test_numbers_of_persistent_contacts() -> None:
    page = text("docs/how-it-works.md")
    assert (unseen.EACH, unseen.MOST) == (0.15, 1_000.0)
    assert r"$\varepsilon$ is 0.15 of the tolerance" in page
    assert (unseen.FEW, gatherings.SOON, unseen.GROWTH) == (15, 0.05, 1.5)
    assert "After fifteen hits of a ball, each within 0.05 s of the one before" in page
    assert "by a factor of 1.5 with each hit, a thousandfold at most" in page
    assert [variant.coarser for variant in FINER] == [0.1, 1e-3]
    assert {variant.sure for variant in FINER} == {10.0}
    assert "at a tenth and at a thousandth of its contact tolerance" in page
    assert "The figure is ten times the largest change of an end" in " ".join(page.split())


def test_the_force_that_is_drawn_gives_the_impulse_and_the_ends() -> None:
    """It is worked out from the breakpoints; friction is a small part of the impulse."""
    drawn = runpy.run_path(str(HOME / "docs" / "figures" / "draw.py"))
    run = drawn["pushing"]()
    [contact] = run.persistent
    assert [event.balls for event in run.events if event.kind == "roll"] == [("A",), ("B",)]
    t, force = drawn["normal_force"](run)
    ends = [(end.real, end.imag) for end in press_run(run.scene).final]
    assert max(map(math.dist, ends, run.end.position)) < 1e-8
    assert np.trapezoid(force, t) == pytest.approx(math.hypot(*contact.impulse), rel=5e-3)
    assert force.min() > 0.0


def test_coordinates_far_from_the_origin() -> None:
    assert f"at 1e6 m they are {math.ulp(1e6):.2g} m apart" in text("docs/accuracy.md")


# -- tutorial and worksheet ------------------------------------------------------------------------

SHOWN = [block for block in blocks("docs/tutorial.md") if block.startswith("$ ")]


@pytest.mark.parametrize("block", SHOWN, ids=lambda block: block.splitlines()[0])
def test_the_tutorial_shows_what_its_commands_print(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(HOME / "docs" / "figures" / "mine.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    command, _, shown = block.removeprefix("$ ").partition("\n")
    out = printed(command)
    assert len(lines_that_stay(shown)) > 1
    for line in lines_that_stay(shown):
        assert line in out


def answer(number: int) -> str:
    """Return an answer of the worksheet."""
    lines = (HOME / "docs" / "worksheet-answers.md").read_text(encoding="utf-8")
    return flat(re.split(r"^\d+\. ", lines, flags=re.MULTILINE)[number])


def test_the_share_of_energy_that_is_lost() -> None:
    for e in (1.0, 0.5, 0.0):
        hit = collide(Disc(0.17, 1.0, (2.0, 0.0)), Disc(0.17, 1.0), material=Material(e))
        before, after = hit.energy
        assert f" {100 * (1 - after / before):.3g} %" in answer(1)


def test_a_light_ball_comes_back_from_a_heavy_one() -> None:
    light, heavy = Disc(0.1, 1.0, (3.0, 0.0)), Disc(0.2, 1.0)
    hit = collide(light, heavy)
    assert f"back at {-hit.velocity_a[0]:g} m/s" in answer(3)
    assert f"on at {hit.velocity_b[0]:g} m/s" in answer(3)
    assert collide(light, heavy, material=Material(0.5)).velocity_a[0] == pytest.approx(0.0)


@pytest.mark.parametrize("number", [7, 8])
def test_the_worksheets_lines_print_its_answers(number: int) -> None:
    _, out = played("docs/worksheet.md")
    shown = re.findall(r"\d+\.\d\d+", answer(number))
    assert len(shown) >= 2
    for figure in shown:
        assert figure in out


def test_how_far_friction_throws_a_ball() -> None:
    _, out = played("docs/worksheet.md")
    thrown = ["2.862", "5.711", "16.699", "2.877"]
    for angle in thrown:
        assert angle in answer(5)
        assert f"thrown by -{angle} degrees" in out
    for mu, angle in zip((0.05, 0.1, 0.3), thrown, strict=False):
        assert math.degrees(math.atan(mu)) == pytest.approx(float(angle), abs=5e-4)
    limits = [math.sin(math.atan(2.0 * mu)) for mu in (0.05, 0.1, 0.3)]
    assert "the offsets {:.3f}, {:.3f} and {:.3f} of".format(*limits) in answer(5)


def test_the_best_ball_in_the_middle() -> None:
    names, _ = played("docs/worksheet.md")
    assert f"is {names['best']} g; the exact answer is" in answer(9)
    assert f"= {math.sqrt(0.05):.4f}$ kg" in answer(9)


def test_how_long_a_break_can_be_foretold() -> None:
    worst = spread(samples=200).worst
    assert f"Ball {worst.ball} spreads most" in answer(10)
    assert f"standard deviation of {worst.deviation / INCH:.1f} in" in answer(10)
    assert f"{worst.amplification:.0f} times that of the starts" in answer(10)
    # The errors of this shot are largest elsewhere at 1/240 s, and in ball 8 at 1e-4 s.
    assert f"At 1e-4 s it is {error('pymunk-discrete', 1e-4, 1):.1f} in" in answer(10)


def test_so_many_hits_lead_to_the_ball_that_spreads_most() -> None:
    run = simulate(load("report"), 1, solver="event-driven")
    hits, behind = list[str](), {"8"}
    for event in reversed(run.events):
        if event.kind == "ball-ball" and behind & set(event.balls):
            behind |= set(event.balls)
            hits.insert(0, " and ".join(event.balls))
    assert ", ".join(hits) in answer(10)
    factor = 540 ** (1 / len(hits))
    assert f"540^{{1/{len(hits)}}}={factor:.1f}$" in answer(10)
    assert f"={math.log(44 / 0.0029) / math.log(factor):.1f}$ hits" in answer(10)


# -- many shots ------------------------------------------------------------------------------------


def test_a_shot_takes_so_many_bytes() -> None:
    scene = load("report")
    start = scene.start(scene.shots[0])
    batch = simulate_many(scene, start.position, start.velocity)
    size = sum(each.nbytes for each in vars(batch).values() if isinstance(each, np.ndarray))
    assert len(batch) == 1
    assert f"takes {size} bytes of the result" in text("docs/many-shots.md")


@pytest.mark.parametrize("more", ["", " with its starts"])
def test_a_shot_takes_so_many_bytes_of_a_file(more: str, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    vary: dict[str, Any] = {"angle": (-5, 5), "speed": (1, 6)}
    if more:
        vary["start"] = 0.005 * INCH
    sweep(load("report"), 1, vary=vary, samples=50_000, out=tmp_path)
    size = sum(file.stat().st_size for file in tmp_path.glob("*.parquet")) / 50_000
    page = text("docs/many-shots.md")
    found = re.search(rf" (\d+) bytes{more or ', and'}", page)
    assert found
    assert size == pytest.approx(int(found[1]), rel=0.02)


@pytest.mark.parametrize("page", ["README.md", "docs/many-shots.md"])
def test_an_atlas_is_of_so_many_shots(page: str) -> None:
    assert re.search(rf"{math.prod(SIZE):,} (exact )?shots", text(page))


# -- what a class hands in -------------------------------------------------------------------------


def test_what_is_handed_in_has_all_its_parts(tmp_path: Path) -> None:
    """Long slices are quick; with the report's own all ends agree (test_time_slice.py)."""
    made = runpy.run_path(str(HOME / "docs" / "figures" / "hand_in.py"))
    small = FilmSettings(size=(320, 180), fps=5.0)
    made["hand_in"](tmp_path, small, dt=1e-4)
    page = (tmp_path / "hand-in.html").read_text(encoding="utf-8")
    files = re.findall(r"src='(.*?)'", page)
    assert len(files) == 4 * 3
    assert all((tmp_path / name).stat().st_size > 0 for name in files)
    assert [f"Figure {k}." in page for k in range(1, 9)] == [True] * 8
    rows = ends(tmp_path)
    assert 1 + len(rows) == 1 + 44 == page.count("<tr>")
    assert max(float(row["off (in)"]) for row in rows) < 2.0
    for row in rows:
        place = place_in(row, "", "in")
        off = math.dist(place, place_in(row, "published ", "in"))
        assert off == pytest.approx(float(row["off (in)"]), abs=1.5e-4)
    head_on = next(row for row in rows if (row["shot"], row["ball"]) == ("Simulation 4", "9"))
    assert place_in(head_on, "exact ", "in") == pytest.approx((19.61, 21.69), abs=0.005)
    for said in ("slices of 100 microseconds", "Restitution: ball on ball 0.9", "88 x 44 in"):
        assert page.count(said) == 1
    assert "law published" not in page and "1e-" not in page.replace("4e-14", "")
    for end in ("(17.19, 21.28)", "(19.61, 21.69)", "(21.48, 22.58)"):
        assert end in page


def test_shots_of_ones_own_are_handed_in_with_exact_ends(tmp_path: Path) -> None:
    made = runpy.run_path(str(HOME / "docs" / "figures" / "hand_in.py"))
    small, scenario = (
        FilmSettings(size=(320, 180), fps=5.0),
        HOME / "docs" / "figures" / "mine.toml",
    )
    page = made["hand_in"](tmp_path, small, dt=3e-4, scenario=str(scenario))
    exact = simulate(load(scenario), solver="event-driven")
    for row in ends(tmp_path):
        end = exact.final[row["ball"]]
        assert place_in(row, "exact ", "m") == pytest.approx(end, abs=1e-6)
        assert place_in(row, "", "m") == pytest.approx(end, abs=1e-2)
    text = page.read_text(encoding="utf-8")
    assert text.count("<tr>") == 1 + len(exact.final)
    assert "<h1>My first table</h1>" in text and "the law coulomb" in text
    assert "published" not in text and "Simulation 4" not in text


def ends(folder: Path) -> list[dict[str, str]]:
    """Return the rows of what is handed in as the table of ends."""
    with (folder / "ends.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def place_in(row: dict[str, str], whose: str, unit: str) -> tuple[float, float]:
    """Return a place from a row of the table of ends."""
    return float(row[f"{whose}x ({unit})"]), float(row[f"{whose}y ({unit})"])
