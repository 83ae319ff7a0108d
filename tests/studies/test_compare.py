"""Comparisons of runs are right on runs whose differences are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pool_pymunk import Ball, Friction, Restitution, Run, Scene, load, simulate
from pool_pymunk.results.events import Event
from pool_pymunk.studies.compare import Comparison, contacts, first_divergence


def _with_events(run: Run, *events: Event) -> Run:
    return replace(run, events=events)


@pytest.fixture
def exact() -> Run:
    return simulate(load("report"), "Simulation 3", solver="event-driven")


def test_a_run_beside_itself(exact: Run) -> None:
    same = Comparison(exact, exact)
    assert same.largest == same.rms == 0.0
    assert same.divergence is None
    assert same.shared == 1
    assert not same.apart(np.linspace(0, 2, 9)).any()


def test_distances_of_ends_are_those_of_two_known_paths() -> None:
    """A ball slides alone: at twice the speed it goes four times as far."""
    scene = Scene(
        balls=(Ball("a", (0, 0), 0.05, 1, velocity=(1, 0)), Ball("b", (0, 9), 0.05, 1)),
        restitution=Restitution(1),
        friction=Friction(surface=0.1),
    )
    fast = replace(scene, balls=(replace(scene.balls[0], velocity=(2, 0)), scene.balls[1]))
    beside = Comparison(simulate(scene), simulate(fast))
    length = 1 / (2 * scene.deceleration)
    assert beside.distances == {"a": pytest.approx(3 * length), "b": 0.0}
    assert beside.farthest == "a"
    assert beside.largest == pytest.approx(3 * length)
    assert beside.rms == pytest.approx(3 * length / math.sqrt(2))
    assert beside.apart(np.array([0.5]))[0] == pytest.approx(0.5)


HIT, WALL, LATER = (
    Event(0.1, "ball-ball", ("a", "b")),
    Event(0.2, "ball-cushion", ("a",), 1),
    Event(0.3, "ball-ball", ("b", "c")),
)


@pytest.mark.parametrize(
    ("events", "kind", "t", "says"),
    [
        ((HIT, LATER), "missed", 0.2, "misses ball a on cushion 1"),
        ((HIT, replace(WALL, t=0.25), LATER), None, 0, ""),
        ((HIT, WALL, Event(0.25, "ball-cushion", ("c",), 0), LATER), "extra", 0.25, "alone has"),
        ((WALL, replace(HIT, t=0.22), LATER), "late", 0.1, "at 0.2200 s instead of 0.1000 s"),
    ],
)
def test_the_first_divergence_is_named(
    exact: Run, events: tuple[Event, ...], kind: str | None, t: float, says: str
) -> None:
    found = first_divergence(_with_events(exact, HIT, WALL, LATER), _with_events(exact, *events))
    if kind is None:
        assert found is None
        return
    assert found is not None
    assert found.kind == kind
    assert found.t == t
    assert says in found.text


def test_far_apart_contacts_may_swap_their_order(exact: Run) -> None:
    other = Event(0.1, "ball-ball", ("c", "d"))
    swapped = replace(other, t=0.1001)
    assert (
        first_divergence(_with_events(exact, other, HIT), _with_events(exact, HIT, swapped)) is None
    )


def test_stops_are_no_contacts(exact: Run) -> None:
    assert [event.kind for event in contacts(exact)] == ["ball-cushion"]


def test_a_ball_that_begins_to_roll_is_no_contact() -> None:
    run = simulate(load("follow-and-draw"), "draw", solver="event-driven")
    kinds = ["ball-ball", *["ball-cushion"] * 4]
    assert [event.kind for event in contacts(run)] == kinds
    assert {"roll", "stop"} < {event.kind for event in run.events}


def test_a_coarse_step_misses_what_the_exact_solver_finds() -> None:
    scene = load("report")
    reference = simulate(scene, "Simulation 1", solver="event-driven")
    coarse = Comparison(
        reference, simulate(scene, "Simulation 1", solver="pymunk-discrete", dt=1 / 60)
    )
    assert coarse.divergence is not None
    assert 0 < coarse.shared < len(contacts(reference))
    assert coarse.largest > 0.1
