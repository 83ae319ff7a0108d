"""Many shots at once are bit for bit those of the exact solver."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pool_pymunk
from pool_pymunk import (
    Ball,
    Batch,
    Friction,
    Law,
    Physics,
    Restitution,
    Scene,
    Shot,
    State,
    Table,
    load,
    loads,
    simulate,
    simulate_many,
)
from pool_pymunk.many import play
from pool_pymunk.many.source import read_source
from pool_pymunk.solvers import request
from pool_pymunk.studies.compare import contact_order, play_beside, reference_of
from tests.shared.hard_scenes import squeezed
from tests.shared.scenes import AT_A_TERMINAL, frozen_rack
from tests.shared.shots import (
    check_bits,
    great_crowd,
    shots_of,
    some_scene,
)


def compare(kind: str, seed: int, count: int) -> Batch:
    scene = some_scene(kind, seed)
    batch = simulate_many(scene, *shots_of(scene, count, seed))
    check_bits(batch, range(count))
    return batch


def test_shots_of_a_great_crowd() -> None:
    crowd = great_crowd(70)
    position, velocity = shots_of(crowd, 1, 3)
    batch = simulate_many(crowd, position, velocity, max_time=0.1)
    check_bits(batch, range(1))
    assert batch.by_reference == 0


def report(rolls: bool) -> Scene:
    """Return the scene of the report, where balls may roll; then the cue ball has some draw."""
    scene = load("report")
    if not rolls:
        return scene
    shots = tuple(replace(shot, roll=-0.4) for shot in scene.shots)
    return replace(scene, friction=replace(scene.friction, rolling=0.01), shots=shots)


def simulation_1(
    count: int, rolls: bool = False
) -> tuple[Scene, np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return shot 1 of the report with its starts varied."""
    scene = report(rolls)
    state = scene.start(scene.shots[0])
    rng = np.random.default_rng(1)
    position = np.array(state.position) + rng.uniform(-1.27e-4, 1.27e-4, (count, 11, 2))
    return scene, position, np.array(state.velocity)


@pytest.mark.parametrize("law", ["coulomb", "published"])
def test_the_reports_first_shot(law: str) -> None:
    scene, position, velocity = simulation_1(300)
    batch = simulate_many(scene, position, velocity, law=law)
    assert batch.law == law
    assert batch.by_reference == 0
    check_bits(batch, range(0, 300, 10))


def test_results_do_not_depend_on_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, position, velocity = simulation_1(1000)
    usual = simulate_many(scene, position, velocity)
    monkeypatch.setattr(play, "FEWEST", 37)
    done: list[int] = []
    other = simulate_many(scene, position, velocity, on_done=done.append)
    for name in ("final", "duration", "hits", "cushions", "events", "first_hit", "pocketed"):
        np.testing.assert_array_equal(getattr(usual, name), getattr(other, name))
    assert done[:2] == [0, 37] and sum(done) == 1000


VARY = {
    "restitution.ball_ball": [0.5, 0.9, 1.0],
    "restitution.cue_ball": [0.6, 0.8, 1.0],
    "restitution.cushion": [0.3, 0.7, 0.99],
    "friction.surface": [0.05, 0.1, 0.3],
    "friction.cushion": [0.0, 0.2, 1.0],
    "friction.ball_ball": [0.0, 0.1, 0.5],
    "friction.rolling": [0.002, 0.01, 0.04],
    "roll": [-1.0, 0.0, 1.0],
    "mass": [0.1, 0.2, 0.3],
}


@pytest.mark.parametrize("key", [*VARY, "mass of each"])
@pytest.mark.parametrize("rolls", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_what_differs_from_shot_to_shot(key: str, rolls: bool) -> None:
    if not rolls and key in ("roll", "friction.rolling"):
        pytest.skip("nothing rolls")
    scene = report(rolls)
    velocity = np.array(scene.start(scene.shots[0]).velocity)
    if key == "mass of each":
        vary = {"mass": np.random.default_rng(0).uniform(0.1, 1.0, (3, 11))}
    else:
        vary = {key: np.array(VARY[key])}
    batch = simulate_many(scene, velocity=velocity, vary=vary)
    if key != "mass":  # Equal masses do not matter.
        assert len({tuple(end.ravel()) for end in batch.final}) == 3
    check_bits(batch, range(3))


def test_the_cue_balls_restitution_is_that_of_the_others_if_it_has_none() -> None:
    scene = load("report")
    scene = replace(scene, restitution=replace(scene.restitution, cue_ball=None))
    velocity = np.array(scene.start(scene.shots[0]).velocity)
    batch = simulate_many(scene, velocity=velocity, vary={"restitution.ball_ball": [0.4, 0.8]})
    check_bits(batch, range(2))


def test_a_rolling_friction_above_that_of_sliding_cannot_start() -> None:
    batch = simulate_many(report(True), vary={"friction.rolling": [0.01, 0.5]})
    assert [batch.statuses[status] for status in batch.status] == ["settled", "cannot_start"]


def test_what_cannot_start_has_a_status() -> None:
    scene = load("eight-ball")
    start = np.array([ball.position for ball in scene.balls])
    position = np.tile(start, (5, 1, 1))
    position[1, 0] = position[1, 1]  # one in the other
    position[2, 0] = -1.0, -1.0  # off the table
    position[3, 0] = scene.pockets[0].position
    position[4, 0, 1] = 0.001  # in a cushion
    batch = simulate_many(scene, position, np.zeros_like(start))
    assert [batch.statuses[status] for status in batch.status] == ["settled"] + 4 * ["cannot_start"]
    assert "4 cannot_start" in repr(batch)
    with pytest.raises(ValueError, match="overlaps"):
        batch.run(1)


def test_a_ball_that_is_off_the_table_meets_nothing() -> None:
    scene = load("two-balls")
    position = np.array([ball.position for ball in scene.balls])
    position[1] = np.nan
    batch = simulate_many(scene, position, [[1.0, 0.0], [np.nan, np.nan]], max_time=3.0)
    assert batch.hits.tolist() == [0]
    assert np.isnan(batch.final[0, 1]).all()
    assert batch.run(0).off == {scene.balls[1].id}


@pytest.mark.parametrize("name", ["two-balls", "follow-and-draw"])
@pytest.mark.parametrize("differ", ["places", "velocities", "rolls", "all"])
def test_balls_that_come_and_go_begin_as_they_are_given(name: str, differ: str) -> None:
    scene, rng = load(name), np.random.default_rng(3)
    start = np.array([ball.position for ball in scene.balls])
    shape = (12, *start.shape)
    position = np.broadcast_to(start, shape)
    velocity = np.broadcast_to(rng.normal(0.0, 0.5, start.shape), shape)
    roll = np.broadcast_to(rng.normal(0.0, 0.5, start.shape), shape)
    if differ in ("places", "all"):
        position = start + rng.normal(0.0, 1e-3, shape)
        position[rng.random(shape[:2]) < 0.3] = np.nan
    if differ in ("velocities", "all"):
        velocity = np.round(rng.normal(0.0, 0.5, shape))  # Some rest.
    if differ in ("rolls", "all"):
        roll = np.round(rng.normal(0.0, 0.5, shape))
    rolls = roll if scene.surface.rolls else None
    check_bits(simulate_many(scene, position, velocity, roll=rolls, max_time=2.0), range(12))


def test_hits_without_end() -> None:
    scene, count = squeezed(1e4, 0.5, 0.5, 0.1, 0.0), 40
    velocity = np.tile([ball.velocity for ball in scene.balls], (count, 1, 1))
    velocity[12:] *= -1.0  # The heavy ball rolls away from the light one.
    batch = simulate_many(scene, velocity=velocity)
    assert batch.by_reference == 0
    check_bits(batch, range(0, count, 3))


def test_a_law_of_ones_own_answers_contacts_of_one_instant() -> None:
    class Own(Law):
        def together(self, *args: Any) -> None:
            super().together(*args)

    scene, count = squeezed(1e4, 0.5, 0.5, 0.1, 0.0), 40
    velocity = np.tile([ball.velocity for ball in scene.balls], (count, 1, 1))
    velocity[12:] *= -1.0  # The heavy ball rolls away from the light one.
    batch = simulate_many(scene, velocity=velocity, law=Own())
    assert not batch.handed_back.any()
    check_bits(batch, range(0, count, 3))


def test_a_frozen_rack_says_what_the_order_of_its_contacts_decides() -> None:
    """The figures are those of runs; where nothing comes together there is none."""
    batch, other = (
        simulate_many(scene, figures=True) for scene in (frozen_rack(0.0), load("two-balls"))
    )
    for each in (batch, other):
        run = each.run(0)
        assert each.policy_shift is not None and each.rounding is not None
        assert each.policy_shift.tolist() == [run.policy_shift]
        assert each.rounding.tolist() == [run.rounding]
        assert each.persistent_shift is not None
        assert each.persistent_shift.tolist() == [run.persistent_shift]
    assert batch.run(0).policy_shift > 0.01
    assert other.run(0).policy_shift == 0.0 < other.run(0).rounding
    with pytest.raises(AttributeError, match=r"figures=True\) gives batch.policy_shift"):
        _ = batch.spread
    assert (batch.in_doubt.tolist(), other.in_doubt.tolist()) == ([True], [False])


@pytest.mark.slow
@pytest.mark.parametrize("law", ["coulomb", "published"])
def test_two_cushions_at_once_slow_a_roll(law: str) -> None:
    """In a corner each cushion slows the roll by its own impulse."""
    scene = Scene(
        (Ball("C", (0.6, 0.6), 0.03, 0.2, cue=True),), Table.rectangle(2.0, 1.0),
        Restitution(0.9, None, 0.8), Friction(0.2, 0.15, 0.05, 0.01), Physics(law=law),
    )  # fmt: skip
    velocity = np.repeat(np.linspace(-3.0, -1.0, 20), 2).reshape(20, 1, 2)
    batch = simulate_many(scene, velocity=velocity, roll=velocity * 0.3)
    assert batch.by_reference == 0
    assert batch.in_doubt.all()
    check_bits(batch, range(20))


@pytest.mark.slow
def test_balls_begin_with_the_rolls_that_are_given() -> None:
    balls = (
        Ball("C", (0.5, 0.5), 0.03, 0.2, cue=True),
        Ball("1", (0.9, 0.53), 0.03, 0.2, velocity=(0.05, 0.1), roll=0.5),
    )
    scene = Scene(
        balls, Table.rectangle(2.0, 1.0), Restitution(0.9, None, 0.8),
        Friction(0.2, 0.1, 0.05, 0.01), shots=(Shot("on", "C", speed=2.0, angle=3.0, roll=-0.7),),
    )  # fmt: skip
    start, alone = scene.start(scene.shots[0]), replace(scene, shots=())
    assert start.roll is not None
    rolls = np.array([start.roll, np.zeros((2, 2)), [(0.0, 1.0), (2.0, -1.0)]])
    batch = simulate_many(scene, start.position, start.velocity, roll=rolls)
    check_bits(batch, range(3))
    for k, own in enumerate(rolls.tolist()):
        run = simulate(alone, solver="event-driven", start=start._replace(roll=own))
        np.testing.assert_array_equal(batch.final[k], run.end.position)
    own = simulate_many(scene, start.position, start.velocity)  # the shares of ball and shot
    np.testing.assert_array_equal(own.final[0], batch.final[0])
    fixed = simulate_many(
        scene, start.position, start.velocity, roll=rolls[0], vary={"speed": [2.0, 1.0]}
    )
    np.testing.assert_allclose(fixed.final[0], batch.final[0], atol=1e-12)
    slow = start._replace(velocity=((start.velocity[0][0] / 2.0, start.velocity[0][1] / 2.0),
                                    start.velocity[1]))  # fmt: skip
    run = simulate(alone, solver="event-driven", start=slow)  # Vectors stay as they are given.
    np.testing.assert_allclose(fixed.final[1], run.end.position, atol=1e-12)


def test_no_shots_and_resting_ones() -> None:
    scene = load("report")
    assert len(simulate_many(scene, np.empty((0, 11, 2)))) == 0
    still = simulate_many(replace(scene, shots=()))
    assert (still.duration.tolist(), still.events.tolist()) == ([0.0], [0])


@pytest.mark.parametrize("rolls", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_shot_ends_at_its_latest_time(rolls: bool) -> None:
    scene, position, velocity = simulation_1(4, rolls)
    batch = simulate_many(scene, position, velocity, max_time=0.7)
    assert {batch.statuses[status] for status in batch.status} == {"max_time"}
    check_bits(batch, range(4))
    one = simulate(
        replace(scene, shots=()), solver="event-driven", max_time=0.7,
        start=State(
            tuple(map(tuple, position[2].tolist())), tuple(map(tuple, velocity.tolist())),
            roll=tuple(map(tuple, (-0.4 * velocity).tolist())) if rolls else None,
        ),
    )  # fmt: skip
    assert batch.final[2].tolist() == [list(place) for place in one.end.position]


def test_a_path_ends_before_other_balls_hit_each_other_at_the_same_time() -> None:
    """Whatever was predicted first; otherwise two programs may have the events in another order."""
    balls = (
        Ball("0", (0.0, 0.0), 0.125, 0.2, velocity=(2.0, 0.0)),
        Ball("1", (1.75, 0.0), 0.125, 0.2),
        Ball("2", (0.0, 2.0), 0.125, 0.2, velocity=(1.0, 0.0)),
    )
    scene = Scene(balls, None, Restitution(1.0), Friction(0.25), Physics(gravity=4.0))
    events = simulate(scene, solver="event-driven").events
    assert [(event.t, event.kind) for event in events[:2]] == [(1.0, "stop"), (1.0, "ball-ball")]


# -- sensitivity -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "shot"),
    [("report", 1), ("report", 4), ("eight-ball", 1), ("stadium", 1), ("follow-and-draw", 1)],
)
def test_samples_are_compared_as_runs_are(name: str, shot: int) -> None:
    """Where a sample leaves the reference, if it does, and whether its contacts are the same."""
    scene, rng = load(name), np.random.default_rng(1)
    turns = {"turn": rng.normal(0.0, 1.0, 40) * 10.0 ** rng.uniform(-7.0, 0.0, 40)}
    source = read_source(request(scene), shot, None, turns)
    reference = reference_of(simulate(scene, shot, solver="event-driven"), 1e-3)
    found, same, departure = play_beside(source, lambda _: None, reference)
    for k in range(len(found.status)):
        run = source.run(k, measures_policies=False)
        off = run.at(reference.times)[0] - reference.path
        np.testing.assert_array_equal(departure[k], reference.first_off(off))
        assert same[k] == (contact_order(run) == reference.order)
    assert same.any() and np.isfinite(departure).any()


# -- processes -------------------------------------------------------------------------------------

SCRIPT = """
import json, sys, time
import numpy as np
from pool_pymunk import load, simulate_many
scene = load("report")
velocity = np.zeros((int(sys.argv[1]), 11, 2))
velocity[:, scene.index["C"], 0] = np.linspace(-4.0, -3.0, len(velocity))
print("ready", flush=True)
began = time.perf_counter()
batch = simulate_many(scene, velocity=velocity)
print(json.dumps([batch.final.sum(), time.perf_counter() - began]))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to one process")
def test_an_interrupt_ends_it_at_once() -> None:
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, "3000000"],
        stdout=pipe,
        stderr=pipe,
        text=True,
        preexec_fn=AT_A_TERMINAL,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(1.5)
    process.send_signal(signal.SIGINT)
    began = time.perf_counter()
    process.communicate(timeout=60)
    assert process.returncode != 0
    assert time.perf_counter() - began < 3.0  # All shots take nine seconds.


# -- a shot in place of positions and velocities ---------------------------------------------------


ROLLS_ON = """
restitution = { ball_ball = 0.9 }
[friction]
surface = 0.2
rolling = 0.01
[ball]
radius = 0.03
mass = 0.17
[[balls]]
id = "1"
cue = true
position = [0.0, 0.0]
[[balls]]
id = "2"
position = [0.5, 0.0]
[[shots]]
name = "a"
velocity = [1.0, 0.0]
[[shots]]
name = "b"
ball = "2"
velocity = [0.0, 1.0]
roll = 0.3
"""


@pytest.mark.parametrize("name", ["report", "follow-and-draw", "nine-ball", "stadium"])
def test_a_shot_is_that_of_simulate(name: str) -> None:
    """A Shot, its name and its number mean the same, by place and by keyword."""
    scene = load(name)
    for number, shot in enumerate(scene.shots, start=1):
        run = simulate(scene, shot, solver="event-driven", max_time=3.0)
        for said in (shot, shot.name, number, np.int64(number)):
            batch = simulate_many(scene, said, max_time=3.0)
            assert np.array_equal(batch.final[0], run.end.position), (name, said)
            assert batch.run(0).events == run.events
        assert np.array_equal(simulate_many(scene, shot=number, max_time=3.0).final, batch.final)


def test_a_shot_goes_on_from_the_one_before() -> None:
    scene = loads(ROLLS_ON + 'from = "previous"\n')
    run = simulate(scene, "b", solver="event-driven")
    assert np.array_equal(simulate_many(scene, "b").final[0], run.end.position)
    assert run.final["1"][0] > 0.1


def test_what_varies_is_that_of_the_ball_of_the_shot() -> None:
    """That ball is not the cue ball, and its roll stays its share of the speed."""
    scene = loads(ROLLS_ON)
    batch = simulate_many(scene, "b", vary={"speed": [0.5, 0.8]})
    for k, speed in enumerate((0.5, 0.8)):
        faster = replace(scene, shots=(replace(scene.shots[1], velocity=(0.0, speed)),))
        run = simulate(faster, 1, solver="event-driven")
        assert np.allclose(batch.final[k], run.end.position, rtol=0.0, atol=1e-12)
        assert batch.run(k).struck == "2"
    drawn = simulate_many(scene, "b", vary={"roll": [-0.2, 0.3]})
    assert drawn.final[0, 1, 1] < drawn.final[1, 1, 1] == simulate_many(scene, "b").final[0, 1, 1]


def test_to_compile_does_nothing_and_says_so() -> None:
    for options in ({}, {"balls": 500}, {"moving": True}):
        with pytest.warns(DeprecationWarning, match="does nothing any more"):
            pool_pymunk.compile(load("report"), **options)
