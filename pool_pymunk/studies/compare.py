"""This module compares runs of one shot: how far their ends are apart, and where they part ways."""

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

# This is the balls, and the cushion or the pocket if one of them was met.
Meeting = tuple[tuple[str, ...], int | str | None]
# This is a contact, and for each of its balls, the how-manieth contact of that ball it is.
Place = tuple[Meeting, tuple[int, ...]]
# s; if the times of the same contact are further apart than this, it is late or early
SAME_TIME = 1e-3


@dataclass(frozen=True)
class Divergence:
    """A divergence is the first contact that two runs do not share.

    It tells when (s) this contact came, what it was, and what came instead.
    """

    t: float
    event: Event
    kind: str  # missed | late | early | extra
    text: str


@dataclass(frozen=True)
class Comparison:
    """A comparison sets a run beside a ``reference`` run of the same shot.

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
        """Return how far each ball's end lies from its end in the reference (m)."""
        return end_distances(self.run, self.reference.final)

    @property
    def farthest(self) -> str:
        """Return the ball whose ends lie farthest apart."""
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
        """Return where the runs part ways; None if they share every contact."""
        return first_divergence(self.reference, self.run)

    @cached_property
    def shared(self) -> int:
        """Count the contacts of the reference that the run shares, in order, before they part."""
        last = math.inf if self.divergence is None else self.divergence.t
        return sum(event.t < last for event in contacts(self.reference))

    def apart(self, times: Array) -> Array:
        """Return the distance (T,) at ``times`` (s) of the ball that is farthest apart then (m)."""
        return longest(self.reference.at(times)[0] - self.run.at(times)[0])


def longest(gaps: Array) -> Array:
    """Return the length (T,) of the longest of the gaps (T, N, 2) at each time."""
    return np.asarray(np.hypot(gaps[..., 0], gaps[..., 1]).max(axis=1))


def end_distances(run: Run, ends: Mapping[str, Point]) -> dict[str, float]:
    """Return the distance (m) of each ball's end from the one in ``ends``, for the balls in it."""
    return {id_: math.dist(run.final[id_], end) for id_, end in ends.items()}


def contacts(run: Run) -> list[Event]:
    """Return the run's events without the stops: contacts, and balls that were pocketed."""
    return [event for event in run.events if event.kind != "stop"]


def first_divergence(reference: Run, run: Run) -> Divergence | None:
    """Return the earliest contact that only one of two runs has.

    A contact is the same in both runs if for each of its balls it is the same one in that ball's
    own sequence. Contacts far apart on the table may swap their order in time without meaning.
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
    """Tell what ``run`` did about a contact of the reference that it does not have in its place."""
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
    """Return a contact in words.

    >>> describe(Event(0.1, "ball-ball", ("C", "1")))
    'ball C on ball 1'
    >>> describe(Event(0.1, "ball-cushion", ("1",), 2))
    'ball 1 on cushion 2'
    >>> describe(Event(0.1, "pocket", ("1",), pocket="head-left"))
    'ball 1 in pocket head-left'
    """
    if event.pocket is not None:
        return f"ball {event.balls[0]} in pocket {event.pocket}"
    if event.cushion is None:
        return " on ".join(f"ball {id_}" for id_ in event.balls)
    return f"ball {event.balls[0]} on cushion {event.cushion}"


def _contact(event: Event) -> Meeting:
    where = event.cushion if event.pocket is None else event.pocket
    return (tuple(sorted(event.balls)), where)


def contact_order(run: Run) -> frozenset[Place]:
    """Return the place of every contact.

    The places of two runs are equal if every ball meets the same others in the same order.

    >>> from pool_pymunk import load, simulate
    >>> sorted(contact_order(simulate(load("report"), "Simulation 3")))
    [((('C',), 2), (1,))]
    """
    return frozenset(_placed(run))


def _placed(run: Run) -> dict[Place, Event]:
    """Return each contact of a run in its place."""
    so_far: Counter[str] = Counter()
    placed = {}
    for event in contacts(run):
        so_far.update(event.balls)
        placed[_contact(event), tuple(so_far[id_] for id_ in sorted(event.balls))] = event
    return placed
