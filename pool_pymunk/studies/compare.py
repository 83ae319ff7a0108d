"""Runs of one shot side by side: how far their ends lie apart, and where they first part ways."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import Event, Run

Meeting = tuple[tuple[str, ...], int | None]  # the balls, and the cushion if it was one
Place = tuple[Meeting, tuple[int, ...]]  # a contact, and the how-manieth it is of each of its balls
SAME_TIME = 1e-3  # s; the same contact at times further apart than this is called late or early


@dataclass(frozen=True)
class Divergence:
    """The first contact that two runs do not share: when (s), what it was, what came instead."""

    t: float
    event: Event
    kind: str  # missed | late | early | extra
    text: str


@dataclass(frozen=True)
class Comparison:
    """A run beside a ``reference`` run of the same shot.

    >>> from pool_pymunk import load, simulate
    >>> scene = load("report")
    >>> exact = simulate(scene, "Simulation 3", solver="event-driven")
    >>> late = simulate(scene, "Simulation 3", solver="pymunk-discrete", dt=1 / 60)
    >>> beside = Comparison(exact, late)
    >>> beside.farthest, round(beside.largest, 3), beside.divergence is None
    ('C', 0.005, True)
    """

    reference: Run
    run: Run

    @cached_property
    def distances(self) -> dict[str, float]:
        """How far each ball's end lies from its end in the reference (m)."""
        return end_distances(self.run, self.reference.final)

    @property
    def farthest(self) -> str:
        """The ball whose ends lie farthest apart."""
        return max(self.distances, key=lambda id_: self.distances[id_])

    @property
    def largest(self) -> float:
        """The largest distance of ends (m)."""
        return self.distances[self.farthest]

    @property
    def rms(self) -> float:
        """The root mean square over balls of the distances of ends (m)."""
        return math.sqrt(sum(d * d for d in self.distances.values()) / len(self.distances))

    @cached_property
    def divergence(self) -> Divergence | None:
        """Where the runs part ways; None where they share every contact."""
        return first_divergence(self.reference, self.run)

    @cached_property
    def shared(self) -> int:
        """How many contacts of the reference, in its order, the run shares before they part."""
        last = math.inf if self.divergence is None else self.divergence.t
        return sum(event.t < last for event in contacts(self.reference))

    def apart(self, times: Array) -> Array:
        """The distance (T,) at ``times`` (s) of the ball that is farthest apart then (m)."""
        gap = self.reference.at(times)[0] - self.run.at(times)[0]
        return np.asarray(np.hypot(gap[..., 0], gap[..., 1]).max(axis=1))


def end_distances(run: Run, ends: Mapping[str, Point]) -> dict[str, float]:
    """Distance (m) of each ball's end from the one in ``ends``, for the balls in it."""
    return {id_: math.dist(run.final[id_], end) for id_, end in ends.items()}


def contacts(run: Run) -> list[Event]:
    """The run's events without the stops."""
    return [event for event in run.events if event.kind != "stop"]


def first_divergence(reference: Run, run: Run) -> Divergence | None:
    """The earliest contact that only one of two runs has.

    A contact is the same in both where it is, for each of its balls, the same one in the ball's own
    sequence: contacts far apart on the table may swap their order in time without meaning.
    """
    ours, theirs = _placed(reference), _placed(run)
    only_reference = [event for key, event in ours.items() if key not in theirs]
    only_run = [event for key, event in theirs.items() if key not in ours]
    if not only_reference and not only_run:
        return None
    first_reference = min(only_reference, key=lambda event: event.t, default=None)
    first_run = min(only_run, key=lambda event: event.t, default=None)
    if first_reference and (not first_run or first_reference.t <= first_run.t):
        return _what_became_of(first_reference, run, first_run)
    assert first_run is not None
    text = f"{run.solver} alone has {describe(first_run)} at {first_run.t:.4f} s"
    if first_reference:
        text += f"; next {reference.solver} has {describe(first_reference)}"
    return Divergence(first_run.t, first_run, "extra", text)


def _what_became_of(event: Event, run: Run, instead: Event | None) -> Divergence:
    """What ``run`` did about a contact of the reference that it does not have in its place."""
    same = [other for other in contacts(run) if _contact(other) == _contact(event)]
    later = min(same, key=lambda other: abs(other.t - event.t), default=None)
    kind = "missed"
    text = f"{run.solver} misses {describe(event)} at {event.t:.4f} s"
    if later is not None and abs(later.t - event.t) > SAME_TIME:
        kind = "late" if later.t > event.t else "early"
        text = f"{run.solver} has {describe(event)} at {later.t:.4f} s instead of {event.t:.4f} s"
    elif later is not None:
        kind = "reordered"
        text = f"{run.solver} has {describe(event)} at {event.t:.4f} s in another order"
    if instead is not None and _contact(instead) != _contact(event):
        text += f"; it has {describe(instead)} at {instead.t:.4f} s"
    return Divergence(event.t, event, kind, text)


def describe(event: Event) -> str:
    """A contact in words.

    >>> describe(Event(0.1, "ball-ball", ("C", "1")))
    'ball C on ball 1'
    >>> describe(Event(0.1, "ball-cushion", ("1",), 2))
    'ball 1 on cushion 2'
    """
    if event.cushion is None:
        return " on ".join(f"ball {id_}" for id_ in event.balls)
    return f"ball {event.balls[0]} on cushion {event.cushion}"


def _contact(event: Event) -> Meeting:
    return (tuple(sorted(event.balls)), event.cushion)


def contact_order(run: Run) -> frozenset[Place]:
    """The place of every contact: equal where every ball meets the same, one after the other.

    >>> from pool_pymunk import load, simulate
    >>> sorted(contact_order(simulate(load("report"), "Simulation 3")))
    [((('C',), 2), (1,))]
    """
    return frozenset(_placed(run))


def _placed(run: Run) -> dict[Place, Event]:
    """Each contact of a run in its place."""
    so_far: Counter[str] = Counter()
    placed = {}
    for event in contacts(run):
        so_far.update(event.balls)
        placed[_contact(event), tuple(so_far[id_] for id_ in sorted(event.balls))] = event
    return placed
