"""The spread of ends is right where the ends are known in closed form, and it is reproducible."""

from __future__ import annotations

import csv
import json
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Pocket,
    Restitution,
    Scene,
    Sensitivity,
    Shot,
    Table,
    Uncertainty,
    load,
    rack,
    sensitivity,
    simulate_all,
    written_uncertainty,
)
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.scenario import bundled
from pool_pymunk.render.balls import DrawnBall
from pool_pymunk.render.canvas import canvas
from pool_pymunk.render.clouds import _cloud
from pool_pymunk.studies.sensitivity import by_causes, digits_that_hold, linear, table
from pool_pymunk.studies.uncertainty import StartSampler
from tests.shared.commands import exit_code

INCH = 0.0254
RESTITUTION, BRAKE, RADIUS, SPEED = 0.8, 0.2 * 9.80665, 0.03, 2.0
HALF = 1e-4  # m; it is half the width of the range in which starts may be
STD = HALF / math.sqrt(3.0)  # This is the standard deviation of numbers uniform within +-HALF.


def off_one_cushion() -> Scene:
    """Return a ball that slides into the cushion x = 1.5 and back."""
    ball = Ball("C", (0.7, 0.5), RADIUS, 0.2, cue=True)
    return Scene(
        (ball,),
        Table.rectangle(1.5, 1.0),
        Restitution(cushion=RESTITUTION),
        Friction(surface=0.2),
        shots=(Shot("in and out", "C", (SPEED, 0.0)),),
    )


def head_on_pair() -> Scene:
    """Return a ball that hits another of the same mass head-on."""
    a = Ball("A", (0.0, 0.0), RADIUS, 0.2, cue=True)
    b = Ball("B", (0.5, 0.0), RADIUS, 0.2)
    return Scene(
        (a, b),
        None,
        Restitution(ball_ball=RESTITUTION),
        Friction(surface=0.2),
        shots=(Shot("straight", "A", (SPEED, 0.0)),),
    )


def played(
    scene: Scene, uncertainty: Uncertainty, samples: int = 2000, seed: int = 1
) -> Sensitivity:
    return sensitivity(scene, None, uncertainty, samples, seed)


def standard_error(values: Array) -> float:
    """Return that of the standard deviation of ``values``, from their fourth moment."""
    off = (values - values.mean()) ** 2
    return float(off.std() / (2.0 * math.sqrt(off.mean() * len(values))))


# -- known spreads ---------------------------------------------------------------------------------


def test_off_one_cushion_the_spread_shrinks_by_the_square_of_the_restitution() -> None:
    """The end is x = L - r - e^2 (v^2 / 2 a - (L - r - x0)), so its slope in x0 is -e^2."""
    found = played(off_one_cushion(), Uncertainty(HALF))
    (ball,) = found.balls
    assert repr(found).startswith("<Sensitivity of ") and f"ball {ball.ball} spreads" in repr(found)
    assert [row["end_x"] for row in found.table.json()] == [ball.end[0]]
    assert ball.std == pytest.approx((RESTITUTION**2 * STD, STD), rel=0.05)
    assert ball.deviation == max(ball.std)
    assert ball.amplification == pytest.approx(1.0, rel=0.05)
    assert np.subtract(ball.high, ball.low) == pytest.approx(
        [1.9 * HALF * RESTITUTION**2, 1.9 * HALF], rel=0.02
    )
    off = found.starts[:, 0, 0] - 0.7
    assert found.ends[:, 0, 0] == pytest.approx(ball.end[0] - RESTITUTION**2 * off, abs=1e-12)


def test_a_faster_ball_comes_farther_back() -> None:
    found = played(off_one_cushion(), Uncertainty(speed=0.01))
    slope = RESTITUTION**2 * SPEED / BRAKE
    assert found.balls[0].std[0] == pytest.approx(slope * 0.01 / math.sqrt(3.0), rel=0.05)
    assert found.balls[0].std[1] == pytest.approx(0.0, abs=1e-15)
    assert found.balls[0].amplification is None
    assert found.agree == pytest.approx(0.01)  # This is a digit of the printed end, here of metres.


def test_a_turned_cue_misses_sideways() -> None:
    found = played(off_one_cushion(), Uncertainty(angle=0.001))
    distance = 1.5 - RADIUS - 0.7
    # This is to first order, if friction did not matter.
    sideways = distance + (distance - RESTITUTION**2 * distance)
    assert found.balls[0].std[1] > 0.001 * distance / math.sqrt(3.0)
    assert found.balls[0].std[1] < 0.001 * 2.0 * sideways / math.sqrt(3.0)
    assert found.balls[0].std[0] < 1e-6


def test_a_head_on_pair() -> None:
    """B ends at x_B + c^2 (v^2 / 2 a - gap), c = (1 + e) / 2: slope c^2 in x_A, 1 - c^2 in x_B."""
    along = Uncertainty({"A": (HALF, 0.0), "B": (HALF, 0.0)})
    found = played(head_on_pair(), along)
    for ball, c in zip(found.balls, ((1 - RESTITUTION) / 2, (1 + RESTITUTION) / 2), strict=True):
        assert ball.std[0] == pytest.approx(STD * math.hypot(c**2, 1 - c**2), rel=0.05)
        assert ball.std[1] == pytest.approx(0.0, abs=1e-15)
    assert found.same == 1.0


def test_no_uncertainty_no_spread() -> None:
    found = played(load("report"), Uncertainty(), samples=10)
    for ball in found.balls:
        assert ball.std == (0.0, 0.0)
        assert ball.low == ball.high == ball.end
        assert ball.amplification is None
        assert ball.horizon == math.inf
        assert "?" not in "".join(ball.digits(load("report")))
    assert found.same == 1.0
    assert found.horizon == math.inf


# -- the report ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def simulation_1() -> Sensitivity:
    return sensitivity(load("report"), "Simulation 1", written_uncertainty("report"))


def test_ball_8_of_simulation_1_spreads_by_about_1_7_inches(simulation_1: Sensitivity) -> None:
    assert simulation_1.samples == 1000
    assert simulation_1.worst.ball == "8"
    assert simulation_1.worst.deviation / INCH == pytest.approx(1.7, abs=0.25)
    amplification = simulation_1.worst.amplification
    assert amplification is not None
    assert 500 < amplification < 700
    assert simulation_1.worst.digits(load("report")) == ("1?.??", "?.??")


def test_a_ball_that_nothing_hits_ends_where_it_starts(simulation_1: Sensitivity) -> None:
    rester = simulation_1.balls[4]
    assert rester.ball == "4"
    assert rester.amplification == pytest.approx(1.0, rel=0.06)
    assert rester.horizon == math.inf
    assert rester.digits(load("report")) == ("10.47", "25.10")
    assert (simulation_1.ends[:, 4] == simulation_1.starts[:, 4]).all()


def test_runs_part_when_balls_meet(simulation_1: Sensitivity) -> None:
    first = simulation_1.reference.events[0].t
    assert first < simulation_1.horizon < first + 0.2
    assert 0.4 < simulation_1.same < 0.7
    off = np.hypot(*(simulation_1.ends - simulation_1.reference.end.position).T).T
    assert (off[np.isinf(simulation_1.left)] < 1.5 * simulation_1.agree).mean() > 0.99


def test_two_seeds_agree_within_their_standard_error(simulation_1: Sensitivity) -> None:
    other = sensitivity(load("report"), 1, written_uncertainty("report"), 1000, seed=1)
    assert not np.array_equal(other.starts, simulation_1.starts)
    for i, (one, two) in enumerate(zip(simulation_1.balls, other.balls, strict=True)):
        for axis in (0, 1):
            values = simulation_1.ends[:, i, axis], other.ends[:, i, axis]
            error = math.hypot(*map(standard_error, values))
            assert abs(one.std[axis] - two.std[axis]) < 4.5 * error, one.ball


def test_the_seed_decides_and_not_the_workers() -> None:
    scene, uncertainty = load("report"), written_uncertainty("report")
    alone = sensitivity(scene, 1, uncertainty, samples=600, seed=7)
    with ThreadPoolExecutor(2) as workers:
        shared = sensitivity(scene, 1, uncertainty, samples=600, seed=7, workers=workers)
    for name in ("starts", "ends", "left", "same_contacts"):
        assert np.array_equal(getattr(alone, name), getattr(shared, name)), name
    assert alone.balls == shared.balls


def test_progress_counts_every_sample() -> None:
    done: list[int] = []
    sensitivity(off_one_cushion(), 1, Uncertainty(HALF), 60, on_done=done.append)
    assert sum(done) == 60


@pytest.mark.parametrize(
    ("value", "std", "kept"),
    [
        (14.76, 0.0, "14.76"),
        (14.76, 0.0049, "14.76"),
        (14.76, 0.0051, "14.7?"),
        (14.76, 0.051, "14.??"),
        (-9.5, 4.9, "-?.??"),
        (123.0, 4.9, "12?.??"),
        (123.0, 51.0, "???.??"),
    ],
)
def test_a_digit_holds_if_it_is_twice_the_deviation(value: float, std: float, kept: str) -> None:
    assert digits_that_hold(value, std) == kept


# -- what a scenario writes ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "half"),
    [("66.00", 0.005), ("66.0", 0.05), ("66", 0.5), ("0.0", 0.05), ("6.6e1", 0.5), ("1_0.5", 0.05),
     ("-3.25e-2", 0.00005)],
)  # fmt: skip
def test_the_last_written_digit(written: str, half: float, tmp_path: Path) -> None:
    text = f'[units]\nlength = "in"\n[[balls]]\nid = "1"\nposition = [{written}, 1.000]\n'
    path = tmp_path / "one.toml"
    path.write_text(text, encoding="utf-8")
    position = written_uncertainty(path).position
    assert isinstance(position, dict)
    assert position["1"] == pytest.approx((half * INCH, 0.0005 * INCH))


def test_each_ball_has_its_own_digits() -> None:
    widths = written_uncertainty("two-balls").widths(load("two-balls"))
    assert widths == pytest.approx(np.full((2, 2), 0.05 * INCH))
    mixed = Uncertainty({"A": (0.1, 0.2)}).widths(load("two-balls"))
    assert mixed.tolist() == [[0.1, 0.2], [0.0, 0.0]]


# -- starts that overlap ---------------------------------------------------------------------------


def frozen() -> Scene:
    """Return a cue ball and a triangle of balls that touch."""
    cue = Ball("C", (0.3, 0.5), RADIUS, 0.2, cue=True)
    racked = rack((1.0, 0.5), radius=RADIUS, mass=0.2, rows=4)
    shots = (Shot("break", "C", (3.0, 0.0)),)
    losses = Restitution(0.95, None, 0.8), Friction(0.2)
    return Scene((cue, *racked), Table.rectangle(2.0, 1.0), *losses, shots=shots)


def test_starts_that_overlap_are_apart() -> None:
    found = played(frozen(), Uncertainty(HALF), samples=100)
    assert found.rejected > 100
    gap = found.starts[:, :, None] - found.starts[:, None]
    distance = np.hypot(gap[..., 0], gap[..., 1]) + 10.0 * np.eye(11)
    assert distance.min() >= 2 * RADIUS * (1 - 1e-8)
    base = np.array([ball.position for ball in frozen().balls])
    assert np.abs(found.starts - base).max() <= 4.0 * HALF
    assert found.worst.deviation > 100 * HALF  # The spread of a break is shown.


def test_balls_are_apart_as_little_as_possible() -> None:
    """Each ball of an overlapping pair moves half of the overlap, and free balls do not move."""
    balls = [
        Ball(str(k), (0.1 + x, 0.1), RADIUS, 0.2) for k, x in enumerate((0.0, 2 * RADIUS, 1.0))
    ]
    sampler = StartSampler(Scene(tuple(balls), restitution=Restitution(0.9)), np.full((3, 2), HALF))
    drawn = np.array([[(0.0, 0.0), (2 * RADIUS - 1e-4, 0.0), (1.0, 0.0)]])
    moved = sampler.apart(drawn)[0, :, 0]
    assert moved == pytest.approx((-5e-5, 2 * RADIUS - 5e-5, 1.0), abs=1e-12)


def test_a_ball_at_a_slanting_cushion_stays_on_the_table() -> None:
    triangle = Table(((0.0, 0.0), (2.0, 0.0), (0.0, 2.0)))
    place = 1.0 - RADIUS / math.sqrt(2.0)
    ball = Ball("C", (place, place), RADIUS, 0.2, cue=True)
    scene = Scene(
        (ball,), triangle, Restitution(cushion=0.8), Friction(0.2),
        shots=(Shot("away", "C", (-1.0, 0.0)),),
    )  # fmt: skip
    found = played(scene, Uncertainty(0.01), samples=500)
    assert found.rejected == pytest.approx(250, rel=0.3)  # This is half of all draws.
    x, y = found.starts[:, 0].T
    assert ((2.0 - x - y) / math.sqrt(2.0)).min() >= RADIUS * (1 - 1e-8)
    # This is farther than a radius past the cushion.
    wide = played(scene, Uncertainty(0.9), samples=100)
    assert (wide.starts > 0.0).all()
    assert (wide.starts.sum(axis=2) < 2.0).all()


def test_a_ball_without_room_keeps_its_place() -> None:
    ball = Ball("C", (1.0, RADIUS), RADIUS, 0.2, cue=True)
    scene = Scene(
        (ball,), Table.rectangle(2.0, 2 * RADIUS), Restitution(cushion=0.8), Friction(0.2),
        shots=(Shot("along", "C", (1.0, 0.0)),),
    )  # fmt: skip
    found = played(scene, Uncertainty(0.01), samples=10)
    assert found.starts[:, 0, 1] == pytest.approx(RADIUS, abs=1e-9 * RADIUS)


# -- shots -----------------------------------------------------------------------------------------


def test_a_shot_that_goes_on_spreads_by_both() -> None:
    scene = off_one_cushion()
    twice = Scene(
        scene.balls, scene.table, scene.restitution, scene.friction,
        shots=(scene.shots[0], Shot("again", "C", (SPEED, 0.0), from_previous=True)),
    )  # fmt: skip
    found = sensitivity(twice, 2, Uncertainty(HALF), 500)
    assert found.balls[0].std[0] == pytest.approx(RESTITUTION**4 * STD, rel=0.1)


def with_directions(scene: Scene) -> Scene:
    """Return the scene whose shots have the velocities that their aims give them."""
    runs = simulate_all(scene, solver="event-driven")
    return replace(
        scene,
        shots=tuple(
            replace(shot, aim=None, speed=None, velocity=run.knots[0][0, 3:5].tolist())
            for shot, run in zip(scene.shots, runs, strict=True)
        ),
    )


@pytest.mark.parametrize("shot", [1, 2])
def test_a_shot_is_aimed_once_or_follows_its_ball(shot: int) -> None:
    """So it is if it goes on from another one, too."""
    shots = tuple(Shot(str(k), "A", speed=SPEED, aim="B", from_previous=k > 1) for k in (1, 2))
    aimed, errors = replace(head_on_pair(), shots=shots), Uncertainty(HALF)
    once, held = (sensitivity(one, shot, errors, 300) for one in (aimed, with_directions(aimed)))
    assert not once.aims_anew
    assert (once.ends == held.ends).all()
    anew = sensitivity(aimed, shot, errors, 300, aims_anew=True)
    assert anew.aims_anew and anew.as_dict()["aims_anew"]
    assert anew.worst.deviation < 0.2 * once.worst.deviation


def test_each_cause_alone_aims_as_all_of_them_do() -> None:
    aimed = replace(head_on_pair(), shots=(Shot("aimed", "A", speed=SPEED, aim="B"),))
    for anew in (False, True):
        errors = Uncertainty(HALF, speed=1e-9)
        found = sensitivity(aimed, 1, errors, 300, aims_anew=anew)
        alone = by_causes(found)["starts"]
        assert alone.aims_anew is anew
        assert alone.worst.deviation == pytest.approx(found.worst.deviation, rel=1e-3)


def test_a_sample_whose_target_lies_in_a_pocket_is_played() -> None:
    """Only a shot that aims anew cannot be played there."""
    second = Shot("on", "cue", speed=1.0, aim="B", from_previous=True)
    balls = (
        Ball("cue", (0.0, 0.0), RADIUS, 0.2, cue=True), Ball("B", (0.5, 0.0), RADIUS, 0.2),
    )  # fmt: skip
    hole = Pocket("hole", (0.95, 0.0), 0.06)
    stops = Scene(
        balls, None, Restitution(RESTITUTION), Friction(0.2), pockets=(hole,),
        shots=(Shot("first", "cue", speed=1.85, angle=0.0), second),
    )  # fmt: skip
    errors = Uncertainty(0.0, speed=0.3)
    once, anew = (sensitivity(stops, 2, errors, 200, aims_anew=it) for it in (False, True))
    assert once.unfinished == 0 < anew.unfinished < 200


@pytest.mark.parametrize("option", [(), ("--aim-anew",)])
def test_the_command_says_when_it_aims(
    option: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = tmp_path / "data.json"
    options = ["--samples", 200, "--no-pictures", "--out", tmp_path, "--json", data, *option]
    assert exit_code("sensitivity", "report", "--shot", 4, *options) == 0
    said = "aimed anew in each sample" if option else "aimed once, in the scenario as it is"
    assert f"Shots that aim at a ball are {said}" in capsys.readouterr().out
    [record] = json.loads(data.read_text(encoding="utf-8"))["shots"]
    assert record["aims_anew"] is bool(option)
    deviation = record["balls"]["9"]["deviation"] / 0.0254
    assert deviation == pytest.approx(0.028 if option else 2.2, rel=0.1)
    assert exit_code("sensitivity", "report", "--shot", 3, *options) == 0
    assert "that aim at a ball" not in capsys.readouterr().out


def test_a_scene_without_shots() -> None:
    ball = Ball("1", (0.0, 0.0), RADIUS, 0.2, velocity=(1.0, 0.0))
    scene = Scene((ball,), friction=Friction(), physics=Physics(max_time=2.0))
    found = played(scene, Uncertainty(HALF))
    assert found.balls[0].std == pytest.approx((STD, STD), rel=0.05)
    assert found.reference.status == "max_time"


# -- causes ----------------------------------------------------------------------------------------


def test_each_cause_alone_makes_what_its_closed_form_says() -> None:
    """The ratio to the starts' spread is that of the starts alone, and there is no other one."""
    angle = 0.001
    found = played(off_one_cushion(), Uncertainty(HALF, speed=0.01, angle=angle))
    assert all(ball.amplification is None for ball in found.balls)
    alone = by_causes(found)
    assert [*alone] == ["starts", "speed", "angle"]
    (starts,), (speed,), (turned,) = (each.balls for each in alone.values())
    assert starts.std == pytest.approx((RESTITUTION**2 * STD, STD), rel=0.05)
    assert starts.amplification == pytest.approx(1.0, rel=0.05)
    assert starts.deviation / alone["starts"].deviation_of_starts == starts.amplification
    slope = RESTITUTION**2 * SPEED / BRAKE
    assert speed.std[0] == pytest.approx(slope * 0.01 / math.sqrt(3.0), rel=0.05)
    assert speed.amplification is turned.amplification is None
    # The causes are independent, so that their variances add up where ends are linear in them.
    squares = sum(each.balls[0].std[1] ** 2 for each in alone.values())
    assert found.balls[0].std[1] ** 2 == pytest.approx(squares, rel=0.05)
    line = linear(off_one_cushion(), None, found.uncertainty)
    for cause, std in line.by_causes().items():
        assert alone[cause].balls[0].std == pytest.approx(tuple(std[0]), rel=0.05, abs=1e-6)


def test_one_cause_is_not_played_again() -> None:
    found = played(off_one_cushion(), Uncertainty(speed=0.01), samples=10)
    assert by_causes(found) == {"speed": found}
    assert by_causes(played(off_one_cushion(), Uncertainty(), samples=10)) == {}


def test_the_command_says_what_each_cause_makes_in_eighty_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pool_pymunk.cli.terminal.WIDTH", 80)
    options = ["--shot", 3, "--samples", 30, "--angle-error", 0.1, "--speed-error", "0.1"]
    log = tmp_path / "log.json"
    arguments = (*options, "--linear", "--no-pictures", "--out", tmp_path, "--json", log)
    assert exit_code("sensitivity", "report", *arguments) == 0
    printed = capsys.readouterr().out
    assert "…" not in printed
    assert "std of x, y  by starts  by speed  by angle" in printed  # in one line
    assert "Each ± is half the width of a uniform distribution" in printed
    assert "Its standard deviation by each cause alone: starts 0.0" in printed
    assert "by the starts alone, divided by that of the starts (0.0029 in)" in printed
    assert " x that of the starts" not in printed
    (shot,) = json.loads(log.read_text(encoding="utf-8"))["shots"]
    assert [*shot["causes"]] == [*shot["linear"]["causes"]] == ["starts", "speed", "angle"]
    assert shot["balls"]["C"]["amplification"] is None
    assert shot["causes"]["starts"]["C"]["amplification"] > 1.0
    assert shot["causes"]["speed"]["C"]["std"][0] > 0.0


def test_the_command_takes_errors_of_any_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--shot", 3, "--samples", 30, "--position-error", 0, "--no-pictures")
    typed = ("--input-error", "restitution.cushion=0.05", "--input-error", "mass.8=2 g")
    log, out = tmp_path / "log.json", ("--out", tmp_path)
    assert exit_code("sensitivity", "report", *options, *typed, *out, "--json", log) == 0
    assert "restitution.cushion ±0.05, mass.8 ±2 g; seed 0" in capsys.readouterr().out
    (shot,) = json.loads(log.read_text(encoding="utf-8"))["shots"]
    assert [*shot["causes"]] == ["restitution.cushion", "mass.8"]
    report = load("report")
    errors = Uncertainty(inputs={"restitution.cushion": 0.05, "mass.8": 0.002})
    own = sensitivity(report, 3, errors, 30).balls[0].std
    assert shot["balls"]["C"]["std"] == list(own)


# -- the command line ------------------------------------------------------------------------------


def test_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "data.json"
    options = ["--shot", 1, "--samples", 100, "--seed", 3, "--out", tmp_path, "--json", data]
    assert exit_code("sensitivity", "report", *options) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("100 samples a shot with starts within ±0.005 in; seed 3\n")
    assert "Ball 8 spreads most: its end has a standard deviation of" in printed
    assert "half of the runs are more than 0.01 in off the reference run" in printed
    rows = list(csv.DictReader((tmp_path / "spread.csv").read_text("utf-8").splitlines()))
    assert [row["ball"] for row in rows] == [ball.id for ball in load("report").balls]
    found = json.loads(data.read_text(encoding="utf-8"))["shots"][0]
    assert float(rows[8]["std_x"]) == found["balls"]["8"]["std"][0]
    assert found["samples"] == 100
    ends = np.load(tmp_path / "shot-1.npz")["ends"]
    assert ends.shape == (100, 11, 2)
    assert ends[:, 8, 0].std() == pytest.approx(found["balls"]["8"]["std"][0])
    assert (tmp_path / "shot-1.png").stat().st_size > 50_000


def test_errors_as_typed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    errors = ["--position-error", "1mm", "--speed-error", "2in/s", "--angle-error", 0.5]
    options = [*errors, "--samples", 30, "--no-pictures", "--out", tmp_path]
    assert exit_code("sensitivity", "two-balls", *options) == 0
    expected = "starts within ±0.0394 in, speed ±0.0508 m/s, angle ±0.5°"
    assert expected in capsys.readouterr().out
    assert not (tmp_path / "shot-1.png").exists()


def test_a_scenario_that_can_be_read_but_once(capsys: pytest.CaptureFixture[str]) -> None:
    """A pipe cannot be read a second time for its digits, so the errors must be typed."""
    read, write = os.pipe()
    os.write(write, bundled()["two-balls"].read_bytes())
    os.close(write)
    assert exit_code("sensitivity", f"/dev/fd/{read}") == 2
    os.close(read)
    assert "--position-error: is missing" in capsys.readouterr().err


# -- pockets ---------------------------------------------------------------------------------------


def at_the_rim(offset: float) -> Scene:
    """Return a ball whose centre passes a pocket so far (m) outside of its rim."""
    return Scene(
        (Ball("a", (-1.0, 0.1 + offset), 0.05, 0.2, velocity=(1.0, 0.0)),),
        friction=Friction(0.01),
        pockets=(Pocket("hole", (0.0, 0.0), 0.1),),
    )


@pytest.mark.parametrize(("offset", "chance"), [(-0.02, 1.0), (0.0, 0.5), (0.005, 0.25), (0.02, 0)])
def test_the_chance_to_be_pocketed(offset: float, chance: float) -> None:
    """Starts lie within +-0.01 m: the share of them within the rim is known."""
    found = sensitivity(at_the_rim(offset), None, Uncertainty(0.01), 1000)
    (ball,) = found.balls
    assert ball.pocketed.get("hole", 0.0) == pytest.approx(chance, abs=0.05)
    assert ball.pocketed.keys() <= {"hole"}
    record: Any = found.as_dict()
    assert record["balls"]["a"]["pocketed"] == ball.pocketed
    assert (found.pocketed[:, 0] == 0).mean() == ball.pocketed.get("hole", 0.0)


def test_no_start_lies_in_a_pocket() -> None:
    """A ball rests a millimetre outside the rim; starts within a centimetre would be in it."""
    scene = replace(at_the_rim(0.001), balls=(Ball("a", (0.0, 0.101), 0.05, 0.2),))
    starts = StartSampler(scene, Uncertainty(0.01).widths(scene)).starts(200, seed=1)
    assert np.hypot(*starts[:, 0].T).min() >= 0.1


def test_a_break_has_its_chances(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("eight-ball", "--shot", "Second shot", "--samples", "30", "--out", str(tmp_path))
    assert exit_code("sensitivity", *arguments) == 0
    printed = capsys.readouterr().out
    assert "pocketed" in printed
    assert "%" in printed
    with np.load(tmp_path / "shot-2.npz") as archive:
        pocketed = archive["pocketed"]
    assert pocketed.shape == (30, 16)
    assert set(np.unique(pocketed)) <= set(range(-1, 6))
    assert (pocketed >= 0).any()


def test_a_cloud_is_of_dots_without_rims() -> None:
    _, axes = canvas(100.0, 100.0)
    ball = DrawnBall(50.0, 50.0, 10.0, "#ff0000", "1", 7.0)
    _cloud(axes, ball, np.array([[20.0, 20.0], [30.0, 20.0], [40.0, 25.0]]))
    (dots,) = axes.collections
    assert np.asarray(dots.get_offsets()).shape == (3, 2)
    assert np.asarray(dots.get_edgecolor()).size == 0
    assert tuple(np.asarray(dots.get_facecolor())[0][:3]) == (1.0, 0.0, 0.0)


def test_the_table_is_the_same_as_csv_and_json(tmp_path: Path) -> None:
    scene = load("two-balls")
    spread = table([sensitivity(scene, 1, Uncertainty(1e-6), 2)])
    spread.csv(tmp_path / "spread.csv")
    rows = list(csv.DictReader((tmp_path / "spread.csv").read_text("utf-8").splitlines()))
    records = spread.json()
    assert [list(each) for each in records] == [list(each) for each in rows]
    assert [each["ball"] for each in records] == [ball.id for ball in scene.balls]
    assert [float(each["std_x"]) for each in rows] == [each["std_x"] for each in records]
