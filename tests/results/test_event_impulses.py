"""Events have the impulses of their contacts, in files, tables and callbacks, too."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Event,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    Table,
    load,
    simulate,
)
from pool_pymunk.results.events import IMPULSES
from pool_pymunk.world import Billiards, ContactEvent, same_balls
from tests.shared.scenes import typed

BY_LAW: list[dict[str, Any]] = [
    {"solver": "event-driven"},
    {"solver": "pymunk"},
    {"solver": "pymunk-discrete", "dt": 1e-3},
    {"solver": "time-slice", "dt": 1e-4},
]


def named(what: object) -> str:
    """Return a name for a test of a law or a solver's settings."""
    if isinstance(what, dict):
        return "-".join(map(str, what.values()))
    return str(getattr(what, "name", what))


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
