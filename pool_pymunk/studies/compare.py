"""This module compares runs of one shot: how far their ends are apart, and where they diverge."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core.beside import Beside, Companion
from pool_pymunk.many.play import Done, Results, play_all
from pool_pymunk.many.source import Source
from pool_pymunk.many.workers import Workers
from pool_pymunk.model import Point
from pool_pymunk.model.arrays import Array
from pool_pymunk.results.events import Event
from pool_pymunk.results.run import Run

ContactKey = tuple[tuple[str, ...], int | str | None]
Place = tuple[ContactKey, tuple[int, ...]]
INSTANTS = 256  # times at which runs are compared, so that a horizon is known to 1/256 of a run
SAME_TIME = 1e-3  # s; a contact is late or early if off by more; most solvers' steps are longer


@dataclass(frozen=True)
class Divergence:
    """A divergence is the first contact that two runs do not share, at the time ``t`` (s)."""

    t: float
    kind: str  # missed | late | early | reordered | extra
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
    ('C', 0.006, True)
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
        return max(self.distances, key=self.distances.__getitem__)

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
        """Return where the runs diverge; None if they share every contact."""
        return first_divergence(self.reference, self.run)

    @property
    def shared(self) -> int:
        """Count the contacts that both runs share, in order, before they diverge."""
        last = math.inf if self.divergence is None else self.divergence.t
        return sum(event.t < last for event in contacts(self.reference))

    def apart(self, times: Array) -> Array:
        """Return the largest distance (T,) (m) between a ball's two places at ``times`` (s)."""
        return longest(self.reference.at(times)[0] - self.run.at(times)[0])


def longest(gaps: Array) -> Array:
    """Return the length (T,) of the longest of the gaps (T, N, 2) at each time."""
    return np.asarray(np.hypot(gaps[..., 0], gaps[..., 1]).max(axis=1))


def end_distances(run: Run, ends: Mapping[str, Point]) -> dict[str, float]:
    """Return the distance (m) of each ball's end from the one in ``ends``, for the balls in it."""
    return {id_: math.dist(run.final[id_], end) for id_, end in ends.items()}


def contacts(run: Run) -> list[Event]:
    """Return the events of a run that are contacts, or in which a ball is pocketed."""
    return [event for event in run.events if event.is_contact or event.pocket is not None]


def first_divergence(reference: Run, run: Run) -> Divergence | None:
    """Return the earliest contact that only one of two runs has.

    Two runs share a contact if it has the same number in the sequence of contacts of each of its
    balls. Contacts that have no ball in common may swap their order in time: they are still shared.
    """
    ours, theirs = _placed(reference), _placed(run)
    missed, extra = (
        min((one[key] for key in one if key not in other), key=lambda e: e.t, default=None)
        for one, other in ((ours, theirs), (theirs, ours))
    )
    if missed and (not extra or missed.t <= extra.t):
        return _what_became_of(missed, run, extra)
    if not extra:
        return None
    text = f"{run.solver} alone has {describe(extra)} at {extra.t:.4f} s"
    text += f"; next {reference.solver} has {describe(missed)}" if missed else ""
    return Divergence(extra.t, "extra", text)


def _what_became_of(event: Event, run: Run, instead: Event | None) -> Divergence:
    """Tell if ``run`` misses this contact of the reference, or has it late, early or reordered."""
    same = [other.t for other in contacts(run) if _contact(other) == _contact(event)]
    came = min(same, key=lambda t: abs(t - event.t), default=None)
    what, at, kind = describe(event), f"{event.t:.4f} s", "reordered"
    text = f"{run.solver} has {what} at {at} in another order"
    if came is None:
        kind, text = "missed", f"{run.solver} misses {what} at {at}"
    elif abs(came - event.t) > SAME_TIME:
        kind = "late" if came > event.t else "early"
        text = f"{run.solver} has {what} at {came:.4f} s instead of {at}"
    if instead is not None and _contact(instead) != _contact(event):
        text += f"; it has {describe(instead)} at {instead.t:.4f} s"
    return Divergence(event.t, kind, text)


def describe(event: Event) -> str:
    """Return a contact in words.

    >>> describe(Event(0.1, "ball-ball", ("C", "1"))), describe(Event(0.1, "", ("1",), 2))
    ('ball C on ball 1', 'ball 1 on cushion 2')
    >>> describe(Event(0.1, "pocket", ("1",), pocket="head-left"))
    'ball 1 in pocket head-left'
    """
    balls = " on ".join(f"ball {id_}" for id_ in event.balls)
    if event.pocket is not None:
        return f"{balls} in pocket {event.pocket}"
    return balls if event.cushion is None else f"{balls} on cushion {event.cushion}"


def _contact(event: Event) -> ContactKey:
    """Return the balls, and the cushion or the pocket if one of them was met."""
    return tuple(sorted(event.balls)), event.cushion if event.pocket is None else event.pocket


def _placed(run: Run) -> dict[Place, Event]:
    """Return the contacts of a run by what meets, and by their number in each ball's sequence."""
    so_far, placed = Counter[str](), {}
    for event in contacts(run):
        so_far.update(event.balls)
        placed[_contact(event), tuple(so_far[id_] for id_ in sorted(event.balls))] = event
    return placed


def contact_order(run: Run) -> tuple[tuple[int, ...], ...]:
    """Return what each ball met, in order: the number of a ball, or -1 - the number of a wall.

    >>> from pool_pymunk import load, simulate
    >>> contact_order(simulate(load("report"), "Simulation 3"))[:2]
    ((-3,), ())
    """
    cushions = len(run.scene.cushions)  # Pockets are numbered after them.
    pockets = {hole.id: cushions + k for k, hole in enumerate(run.scene.pockets)}
    met: list[list[int]] = [[] for _ in run.scene.balls]
    for event in contacts(run):
        one, *other = (run.scene.index[id_] for id_ in event.balls)
        wall = event.cushion if event.pocket is None else pockets[event.pocket]
        met[one].append(other[0] if other else -1 - (wall or 0))
        for i in other:
            met[i].append(one)
    return tuple(map(tuple, met))


# -- many shots beside a reference run -------------------------------------------------------------


class Reference(NamedTuple):
    """A reference is the run with which others are compared.

    Its balls are at ``path`` (T, N, 2) at the ``times`` (T,). A ball leaves the reference where
    it is more than ``agree`` (m) off. ``order`` has what each ball meets, as
    :func:`contact_order` returns it.
    """

    times: Array
    path: Array
    agree: float
    order: tuple[tuple[int, ...], ...]

    def in_core(self) -> Beside:
        """Return what compares shots with it."""
        places = [list(map(tuple, each)) for each in self.path.swapaxes(0, 1).tolist()]
        both = zip(places, map(list, self.order), strict=True)
        return Beside(self.times.tolist(), self.agree, [Companion(*each) for each in both])

    def first_off(self, off: Array) -> Array:
        """Return when (s; inf: never) balls (N,) first leave, by their offsets (T, N, 2) in m."""
        apart = np.hypot(off[..., 0], off[..., 1]) > self.agree
        return np.where(apart.any(axis=0), self.times[apart.argmax(axis=0)], math.inf)


def reference_of(run: Run, agree: float) -> Reference:
    """Return a run as the reference that others are compared with, to ``agree`` (m)."""
    times = np.linspace(0.0, run.duration, INSTANTS + 1)
    return Reference(times, np.array(run.at(times)[0]), agree, contact_order(run))


def play_beside(
    source: Source, done: Done, reference: Reference, workers: Workers | None = None
) -> tuple[Results, NDArray[np.bool_], Array]:
    """Play shots; return also which (S,) have the reference's contacts, and when balls leave it.

    These times (S, N) are in s, and infinite for balls that never do.
    """
    found = play_all(source, done, workers, reference.in_core)
    return found, found.beside[:, 0] == 1.0, found.beside[:, 1:].copy()
