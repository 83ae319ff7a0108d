"""The examples run, and what they show is so."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import load, simulate_many
from tests import ROOT
from tests.shared.scenes import example


def shown(module: Any, folder: Path) -> Any:
    """Run an example, and return what it returns, once it has drawn its picture."""
    result = module.main(["--out", str(folder)])
    picture = folder / f"{module.__name__}.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    return result


def numbers(line: str) -> list[str]:
    """Return the numbers of a line."""
    return re.findall(r"\d[\d.]*", line)


tutorial, flipper = map(example, ("tutorial_beside_ours", "obstacles_and_flipper"))

# -- the tutorial, and ours beside it --------------------------------------------------------------


def test_ours_is_exact_at_all_frame_rates_and_the_tutorial_at_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = shown(tutorial, tmp_path)
    assert [row.rate for row in rows["Billiards"]] == [30, 60, 120, 240]
    assert [row.rate for row in rows["the tutorial"]] == [30, 60, 120, 240]
    for row in rows["Billiards"]:
        assert row.off < 1e-9
        assert row.deepest < 1e-9
        assert row.turned < 1e-9
        assert row.lost == row.passed == 0
    for row in rows["the tutorial"]:
        assert row.off > tutorial.RADIUS
        assert row.deepest > 1.0
        assert row.turned > 5.0
    assert [row.passed for row in rows["the tutorial"]] == [21, 1, 0, 0]
    assert rows["the tutorial"][0].lost > 0
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 12
    page = (ROOT / "docs" / "from-pygame.md").read_text(encoding="utf-8")
    on_page = re.findall(r"^\| *\d.*$", page, flags=re.MULTILINE)
    assert list(map(numbers, on_page)) == list(map(numbers, printed[2:6]))


def test_the_tutorials_ends_differ_with_the_frame_rate_and_ours_do_not() -> None:
    for play, differ in ((tutorial.tutorial, True), (tutorial.ours, False)):
        ends = [play(tutorial.rack(), tutorial.BREAK, rate)[-1] for rate in tutorial.COLORS]
        for other in ends[1:]:
            assert (tutorial.farthest(ends[0], other) > tutorial.RADIUS) is differ
            assert differ or tutorial.farthest(ends[0], other) < 1e-9


@pytest.mark.slow
def test_the_tutorial_tends_to_the_exact_ends() -> None:
    """It plays the same physics, so the comparison is fair."""
    start = tutorial.rack()
    exact = tutorial.exact_ends(start, tutorial.BREAK)
    off = [
        tutorial.farthest(tutorial.tutorial(start, tutorial.BREAK, rate)[-1], exact)
        for rate in (1_000, 10_000)
    ]
    assert 10.0 < off[0] < 30.0
    assert 0.5 < off[1] < 1.5


def test_the_tutorial_hardly_minds_the_order_of_a_loose_rack() -> None:
    start, order = tutorial.rack(), [0, *range(15, 0, -1)]
    for play, most in ((tutorial.tutorial, 0.02), (tutorial.ours, 1e-9)):
        for rate in tutorial.COLORS:
            ends = play(start, tutorial.BREAK, rate)[-1]
            again = play(start[order], tutorial.BREAK, rate)[-1]
            assert tutorial.farthest(ends[order], again) < most


@pytest.mark.parametrize("rate", [30, 120])
def test_a_free_ball_of_the_tutorial_goes_half_a_step_too_far(rate: int) -> None:
    start, speed = np.array([(100.0, 262.0)]), 400.0
    distance = speed * speed / (2.0 * tutorial.DECELERATION)
    too_far = speed / rate / 2.0
    for play, off in ((tutorial.tutorial, too_far), (tutorial.ours, 0.0)):
        assert play(start, (speed, 0.0), rate)[-1, 0, 0] - 100.0 == pytest.approx(distance + off)


# -- obstacles, a flipper and a box ----------------------------------------------------------------


def test_the_flipper_hits_balls_and_they_go_faster(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    world = shown(flipper, tmp_path)
    blows = [blow for blow in world.blows if blow.by == "flipper"]
    assert blows[0].ball == 0
    assert blows[0].after > 1.5 * blows[0].before > 0.0
    before, after = speeds_around(world, blows[0])
    assert before == pytest.approx(blows[0].before, rel=1e-2)
    assert after == pytest.approx(blows[0].after, rel=1e-2)
    assert any(blow.by == "box" for blow in world.blows)
    assert math.dist(world.box.position, flipper.BOX_START) > 0.01
    assert "the flipper hits ball 0" in capsys.readouterr().out


def speeds_around(world: Any, blow: Any) -> tuple[float, float]:
    """Return the speeds (m/s) of a ball in the steps before and after a blow, from its track."""
    track, k = world.tracks[blow.ball], round(blow.t / flipper.STEP)
    before, after = math.dist(track[k - 1], track[k]), math.dist(track[k], track[k + 1])
    return before / flipper.STEP, after / flipper.STEP


def test_the_flipper_and_the_box_push_no_ball_off_the_table() -> None:
    world = flipper.World()
    world.play()
    assert len(world.contacts) > 5
    x, y = np.array(world.tracks).T
    r = flipper.RADIUS - 1e-9
    assert r <= x.min() and x.max() <= flipper.LENGTH - r
    assert r <= y.min() and y.max() <= flipper.WIDTH - r


def test_every_obstacle_is_a_wall() -> None:
    world = flipper.World()
    for wall, (x, y) in enumerate(((1.63, 0.5), *flipper.POSTS), start=4):
        world.table.place(world.balls[0], (x, y - 0.25))
        assert world.table.predict(world.balls[0], (0.0, 1.0)).wall == wall


# -- an opponent that looks ahead ------------------------------------------------------------------


@pytest.mark.slow
def test_the_opponents_pot_what_they_see(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    opponent = example("pool_opponent")
    monkeypatch.setattr(opponent, "ERROR", 0.0)
    turns = opponent.main(["--out", str(tmp_path), "--angles", "200"])
    assert (tmp_path / "pool_opponent.png").read_bytes().startswith(b"\x89PNG")
    potted = [name for turn in turns for name in turn.potted]
    assert sorted(potted, key=int) == [f"{k}" for k in range(1, 16)]
    assert len(turns) < 20
    assert "tries 1000 shots" in capsys.readouterr().out


# -- a thousand shots that learn -------------------------------------------------------------------


@pytest.mark.slow
def test_shots_learn_where_to_leave_the_cue_ball(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    steer = example("steer_a_thousand")
    found = steer.main(["--out", str(tmp_path), "--shots", "100", "--rounds", "40"])
    there = int((found.off < steer.NEAR).sum())
    assert there >= 40
    assert np.hypot(*(found.first - steer.TARGET).T).min() > found.off.min() < 1e-9
    assert f"{there} of 100 shots leave the cue ball within 1 cm" in capsys.readouterr().out
    angle, speed = found.shots.T
    again = simulate_many(load("report"), vary={"angle": angle, "speed": speed})
    assert np.allclose(again.final[:, 0], found.last, rtol=0.0, atol=0.0)
    assert (tmp_path / "steer_a_thousand.png").read_bytes().startswith(b"\x89PNG")


# -- a ball without losses -------------------------------------------------------------------------


def test_a_ball_without_losses_is_chaotic_in_a_stadium_and_regular_in_a_circle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    billiards = example("dynamical_billiards")
    count = 800
    found = billiards.main(["--out", str(tmp_path), "--contacts", str(count)])
    assert (tmp_path / "dynamical_billiards.png").read_bytes().startswith(b"\x89PNG")
    assert "800 contacts" in capsys.readouterr().out
    exponents = [exponent for _, exponent in found]
    assert exponents[0] == pytest.approx(0.43, abs=0.1)
    assert max(exponents[1:]) < 0.02
    for run, _ in found:
        assert len(run.events) == count and run.warnings == ()
        assert abs(run.energy["final"] - 0.5) < 1e-15 * count
    along, sines = np.transpose(billiards.boundary_map(found[0][0]))
    assert 0.0 <= along.min() < 0.1 and 4.0 + math.tau - 0.1 < along.max() <= 4.0 + math.tau
    assert sines.min() < -0.95 and sines.max() > 0.95
    for run, angle in ((found[1][0], 60.0), (found[2][0], 20.0)):
        along, sines = np.transpose(billiards.boundary_map(run))
        assert np.abs(sines - 0.6 * math.sin(math.radians(angle))).max() < 1e-12
        turned = math.pi - 2.0 * math.asin(sines[0])
        assert np.abs(np.sin((np.diff(along) - turned) / 2.0)).max() < 1e-10


# -- contacts that persist -------------------------------------------------------------------------


def test_soft_breaks_are_nearer_to_their_ends_at_finer_tolerances(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    contact_tolerance = example("contact_tolerance")
    found = contact_tolerance.main(["--out", str(tmp_path), "--shots", "4", "--budget", "0"])
    assert (tmp_path / "contact_tolerance.png").read_bytes().startswith(b"\x89PNG")
    tolerances = [one.contact_tolerance for one in found.settings]
    assert tolerances == list(contact_tolerance.TOLERANCES)
    assert "1e-07 m: errors of" in capsys.readouterr().out
    medians = np.median(contact_tolerance.errors_of(found), axis=1)
    assert 30.0 * medians[-1] < medians[0] < 0.01
