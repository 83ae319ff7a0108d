"""The impulses of a run's events add up to the changes of the balls' velocities."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Event,
    Friction,
    Law,
    Physics,
    Restitution,
    Run,
    Scene,
    Table,
    load,
    simulate,
    simulate_many,
)
from pool_pymunk.laws.contact import NT, Pair
from pool_pymunk.results.events import IMPULSES
from pool_pymunk.world import Billiards, ContactEvent, same_balls
from tests.shared.scenes import frozen_rack, random_scene, typed

BY_LAW: list[dict[str, Any]] = [
    {"solver": "event-driven"},
    {"solver": "pymunk"},
    {"solver": "pymunk-discrete", "dt": 1e-3},
    {"solver": "time-slice", "dt": 1e-4},
]
Vector = tuple[float, float]


def named(what: object) -> str:
    """Return a name for a test of a law or a solver's settings."""
    if isinstance(what, dict):
        return "-".join(map(str, what.values()))
    return str(getattr(what, "name", what))


def normal_of(run: Run, event: Event) -> Vector:
    """Return the unit vector from the first ball to the second, or from the cushion to the ball."""
    places = dict(zip(run.scene.index, run.at(event.t)[0], strict=True))
    x, y = places[event.balls[0]].tolist()
    if event.cushion is not None:
        ball = run.scene.balls[run.scene.index[event.balls[0]]]
        return run.scene.cushions[event.cushion].nearest(x, y, ball.radius, 0.0).normal(x, y)
    u, v = places[event.balls[1]].tolist()
    apart = math.hypot(u - x, v - y)
    return (u - x) / apart, (v - y) / apart


def pushes(run: Run) -> dict[str, np.ndarray[Any, Any]]:
    """Return the momentum (N s) that the events of a run have given to each ball."""
    total = {id_: np.zeros(2) for id_ in run.scene.index}
    for event in run.events:
        if not event.is_contact:
            continue
        assert event.impulse is not None and event.tangential is not None
        n = np.array(normal_of(run, event))
        t = np.array((-n[1], n[0]))
        total[event.balls[-1]] += event.impulse * n + event.tangential * t
        if event.cushion is None:
            assert event.tangential_first is not None
            total[event.balls[0]] += -event.impulse * n + event.tangential_first * t
    return total


def jumps(run: Run) -> dict[str, np.ndarray[Any, Any]]:
    """Return the sum of the jumps of each ball's momentum (N s), which no friction explains."""
    total = {}
    for ball, known in zip(run.scene.balls, run.knots, strict=True):
        rows = known[:-1] if ball.id in run.pocketed else known  # A pocket takes the last jump.
        before = rows[:-1, 3:5] + np.diff(rows[:, 0])[:, None] * rows[:-1, 5:7]
        total[ball.id] = ball.mass * (rows[1:, 3:5] - before).sum(axis=0)
    return total


def assert_adds_up(run: Run, within: float = 1e-12) -> None:
    """Assert that the impulses explain all jumps, as a share of the momentum at the start."""
    whole = sum(np.linalg.norm(p) for p in jumps(run).values())
    assert whole > 0.0
    for id_, pushed in pushes(run).items():
        lacking = pushed - jumps(run)[id_]
        assert np.linalg.norm(lacking) <= within * whole, (id_, pushed, jumps(run)[id_])


@pytest.mark.parametrize("law", ["coulomb", "published"])
@pytest.mark.parametrize("how", BY_LAW, ids=named)
def test_the_shots_of_the_report(how: dict[str, Any], law: str) -> None:
    scene = load("report")
    for shot in scene.shots:
        # A breakpoint of pymunk-discrete comes after the friction of its step.
        within = 1e-2 if how["solver"] == "pymunk-discrete" else 1e-12
        assert_adds_up(simulate(scene, shot, law=law, **how), within)


EXACT = ("event-driven", "pymunk")


@pytest.mark.parametrize("solver", EXACT)
@pytest.mark.parametrize(
    "name",
    ["carrom", "eight-ball", "nine-ball", "follow-and-draw", "hexagon", "l-shaped", "stadium"],
)
def test_bundled_scenes(name: str, solver: str) -> None:
    """In these, balls roll, pockets take some, and cushions are arcs."""
    assert_adds_up(simulate(load(name), 1, solver=solver, max_time=3.0))


class Mean(Law):
    """This law leaves contacts of one instant to the mean over their orders."""


class Tears(Law):
    """This law gives each ball of a hit a friction of its own, so that momentum is not kept."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        a, b = super().ball_ball(a, b, pair)
        return NT(a.n, 0.5 * a.t), NT(b.n, 0.7 * b.t + 0.01)


@pytest.mark.parametrize("solver", EXACT)
@pytest.mark.parametrize("gap", [0.0, 1e-9])
@pytest.mark.parametrize("law", ["coulomb", "published", Mean(), Tears()], ids=named)
def test_frozen_racks(law: str | Law, gap: float, solver: str) -> None:
    """Contacts of one instant share balls, and come in rounds.

    Nothing presses balls together, because impulses of persistent contacts are no events.
    """
    rack = frozen_rack(gap)
    balls = tuple(replace(ball, mass=0.1 + 0.01 * k) for k, ball in enumerate(rack.balls))
    physics, friction = replace(rack.physics, max_time=1.0), replace(rack.friction, surface=0.0)
    scene = replace(rack, balls=balls, physics=physics, friction=friction)
    run = simulate(scene, solver=solver, law=law)
    assert sum(event.t == run.events[0].t for event in run.events) > 2 or gap > 0.0
    assert_adds_up(run, 1e-9)


@pytest.mark.parametrize("how", BY_LAW, ids=named)
def test_a_corner(how: dict[str, Any]) -> None:
    """A ball meets two cushions at one instant, and each has given its own part."""
    ball = Ball("A", (0.5, 0.5), 0.05, 0.2, velocity=(-2.0, -2.0))
    physics = Physics(max_time=0.4)
    scene = Scene((ball,), Table.rectangle(1.0, 1.0), Restitution(0.9, None, 0.5), physics=physics)
    run = simulate(scene, **how)
    assert [event.impulse for event in run.events] == pytest.approx([0.2 * 1.5 * 2.0] * 2)
    assert sorted(event.cushion or 0 for event in run.events) == [0, 3]
    assert run.end.velocity[0] == pytest.approx((1.0, 1.0), abs=1e-12)
    assert_adds_up(run)


@pytest.mark.parametrize("how", [*BY_LAW, {"solver": "pymunk-builtin"}], ids=named)
@pytest.mark.parametrize("seed", [3, 4, 5, 6])
def test_random_scenes(seed: int, how: dict[str, Any]) -> None:
    """Without friction of the surface, no solver has to tell friction from the contacts."""
    scene = random_scene(seed)
    scene = replace(scene, friction=replace(scene.friction, surface=0.0))
    assert_adds_up(simulate(scene, max_time=2.0, **how), 1e-9)


def test_a_roll_pressed_to_a_cushion() -> None:
    """The impulses of the hit explain the change of momentum up to the hit."""
    balls = (Ball("A", (0.5, 0.2), 0.05, 0.2, velocity=(1.0, -0.5)),)
    friction = Friction(0.2, 0.1, 0.1, rolling=0.01)
    scene = Scene(balls, Table.rectangle(3.0, 3.0), Restitution(0.9, None, 1e-6), friction)
    run = simulate(scene, solver="event-driven")
    hit = next(event for event in run.events if event.is_contact)
    assert "presses ball A to cushion" in " ".join(run.warnings)
    rows = run.knots[0][: np.searchsorted(run.knots[0][:, 0], hit.t) + 1]
    assert_adds_up(replace(run, knots=(rows,), events=(hit,)))  # No more hits are events.


def test_the_published_law_gives_the_two_balls_other_tangential_impulses() -> None:
    events = [e for e in simulate(load("report"), 1, law="published").events if len(e.balls) == 2]
    assert any(abs((e.tangential or 0.0) + (e.tangential_first or 0.0)) > 1e-3 for e in events)
    events = [e for e in simulate(load("report"), 1, law="coulomb").events if len(e.balls) == 2]
    assert all(abs((e.tangential or 0.0) + (e.tangential_first or 0.0)) < 1e-15 for e in events)


def test_the_tangent_is_a_quarter_turn_to_the_left_of_the_normal() -> None:
    """A ball slides along a cushion below it, towards +x; friction pulls it back, along +t."""
    ball = Ball("A", (0.5, 0.2), 0.05, 0.2, velocity=(1.0, -1.0))
    friction, physics = Friction(surface=0.0, cushion=0.1), Physics(max_time=0.3)
    scene = Scene(
        (ball,), Table.rectangle(3.0, 1.0), Restitution(0.9, None, 0.5), friction, physics
    )
    hit = simulate(scene).events[0]
    assert hit.impulse == pytest.approx(0.2 * 1.5)
    assert hit.tangential == pytest.approx(0.1 * 0.2 * 1.5)
    assert hit.tangential_first is None


# -- where they stand ------------------------------------------------------------------------------


def test_what_is_no_contact_has_no_impulse() -> None:
    run = simulate(load("eight-ball"), 1, solver="event-driven")
    kinds = {event.kind for event in run.events}
    assert kinds == {"ball-ball", "ball-cushion", "roll", "stop", "pocket"}
    for event in run.events:
        assert all((each is None) != event.is_contact for each in event.impulses[:2])
        assert (event.tangential_first is None) == (event.kind != "ball-ball")


def test_files_and_tables_have_the_impulses_last(tmp_path: Path) -> None:
    run = simulate(load("report"), 1, solver="event-driven")
    run.write_events_csv(tmp_path / "events.csv")
    with (tmp_path / "events.csv").open(newline="", encoding="utf-8") as file:
        heading, *rows = csv.reader(file)
    named = ["impulse (N s)", "tangential (N s)", "tangential_first (N s)"]
    assert heading == ["t", "kind", "ball", "other", "cushion", "pocket", *named]
    for row, event in zip(rows, run.events, strict=True):
        assert row[6:] == ["" if each is None else repr(each) for each in event.impulses]
        said = event.as_dict()
        assert [said.get(key) for key in list(IMPULSES)] == list(event.impulses)
        assert not event.is_contact or list(said)[-1] in IMPULSES
    run.write_npz(tmp_path / "shot.npz")
    with np.load(tmp_path / "shot.npz") as arrays:
        for k, name in enumerate(IMPULSES):
            found = np.array([e.impulses[k] for e in run.events], dtype=float)
            assert np.array_equal(arrays[f"event_{name}"], found, equal_nan=True)
    run.save(tmp_path / "run.npz")
    assert Run.load(tmp_path / "run.npz").events == run.events


def test_the_json_of_a_run_has_the_impulses(tmp_path: Path) -> None:
    answer = typed("run", "report", "--shot", 1, "--no-pictures", "--json", tmp_path / "run.json")
    assert answer.returncode == 0, answer.stderr
    events = json.loads((tmp_path / "run.json").read_text())["shots"][0]["events"]
    assert events[0]["impulse"] > 0.0
    assert {"tangential", "tangential_first"} < events[0].keys()
    assert "impulse" not in events[-1]


def test_a_run_saved_before_has_no_impulses(tmp_path: Path) -> None:
    event = Event(0.5, "ball-ball", ("A", "B"))
    assert event.impulses == (None, None, None)
    assert event.as_dict() == {"t": 0.5, "kind": "ball-ball", "balls": ["A", "B"]}


def test_a_run_of_a_batch_has_them_too() -> None:
    scene = load("report")
    velocity = np.zeros((2, len(scene.balls), 2))
    first = scene.index[scene.shots[0].ball]
    velocity[:, first] = [scene.start(scene.shots[0]).velocity[first]] * 2
    velocity[1] *= 0.9
    batch = simulate_many(scene, velocity=velocity)
    for k in (0, 1):
        assert_adds_up(batch.run(k))
        assert all(e.impulse is not None for e in batch.run(k).events if e.is_contact)


def test_callbacks_hear_of_the_tangential_impulse() -> None:
    space, heard = pymunk.Space(), list[ContactEvent]()
    table = Billiards(space, 0.01, pair=same_balls(0.9, 0.1))
    table.on_contact = heard.append
    for x, y, v in ((0.0, 0.0, 1.0), (0.3, 0.05, 0.0)):
        body = pymunk.Body(0.2, math.inf)
        body.position, body.velocity = (x, y), (v, 0.0)
        table.add_ball(pymunk.Circle(body, 0.05))
    while not heard:
        table.step()
    [hit] = heard
    assert abs(hit.tangential) == pytest.approx(0.1 * hit.impulse)
    vx, vy = hit.balls[1].body.velocity
    assert vx * -hit.normal[1] + vy * hit.normal[0] == pytest.approx(hit.tangential / 0.2)
