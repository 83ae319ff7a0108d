"""This module compares runs of one shot: how far their ends are apart, and where they diverge."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.fast import compiled
from pool_pymunk.fast.records import STOP, Out, Tracks
from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.path import from_breakpoint, motion_at
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
    """A reference is the run with which others are compared, as numba takes it.

    Its balls are at ``path`` (T, N, 2) at the ``times`` (T,). A ball leaves the reference where
    it is more than ``agree`` (m) off. Ball i has ``contacts[i]`` contacts; contact c is with
    ``other[i, c]``: the number of a ball, or -1 - the number of a wall.
    """

    times: Any
    path: Any
    agree: float
    other: Any
    contacts: Any


def reference_of(run: Run, agree: float) -> Reference:
    """Return a run as the reference that others are compared with, to ``agree`` (m)."""
    times, met = np.linspace(0.0, run.duration, INSTANTS + 1), contact_order(run)
    counts = np.array([len(each) for each in met])
    rows = np.array(list(zip_longest(*met, fillvalue=0)), np.int64)
    others = rows.reshape(-1, len(met)).T.copy()
    return Reference(times, np.array(run.at(times)[0]), agree, others, counts)


class Beside:
    """This watches shots, and compares each with the reference, which is made of ``run``.

    ``departure`` (S, N) is when (s; inf: never) a ball leaves it; ``same`` (S,) if contacts agree.
    """

    replays = False
    compiles = ()  # `compare` takes a second.

    def __init__(self, run: Run, reference: Reference, out: Out) -> None:
        self.reference, self.duration = reference, out.duration
        self.order = contact_order(run)
        self.departure = np.empty(out.final.shape[:2])
        self.same = np.empty(len(out.duration), np.bool_)

    def watch(self, part: slice, tracks: Tracks) -> None:
        """Compare these shots."""
        count = np.zeros(self.departure.shape[1], np.int64)
        parts = self.duration[part], self.reference, self.departure[part], self.same[part]
        compiled.alone(compare)(tracks, *parts, count)

    def see(self, k: int, run: Run) -> None:
        """Compare the run of shot ``k``, which was not compiled."""
        self.departure[k] = self.first_off(run.at(self.reference.times)[0] - self.reference.path)
        self.same[k] = contact_order(run) == self.order

    def first_off(self, off: Array) -> Array:
        """Return when (s; inf: never) balls (N,) first leave, by their offsets (T, N, 2) in m."""
        apart = np.hypot(off[..., 0], off[..., 1]) > self.reference.agree
        return np.where(apart.any(axis=0), self.reference.times[apart.argmax(axis=0)], math.inf)


# -- what numba compiles ---------------------------------------------------------------------------


def compare(
    tracks: Tracks, duration: Any, reference: Reference, departure: Any, same: Any, count: Any
) -> int:
    """Compare some shots with the reference, and return how many; ``count`` (N,) is overwritten."""
    first = begun = 0
    for s in range(len(departure)):
        last, ended = tracks.ends[s, 0], tracks.ends[s, 1]
        if last > first:
            for i in range(departure.shape[1]):
                departure[s, i] = leaves(tracks.rows, first, last, duration[s], reference, i)
            same[s] = has_same_contacts(tracks.events[begun:ended], reference, count)
        first, begun = last, ended
    return len(departure)


def leaves(
    rows: Any, first: int, last: int, duration: float, reference: Reference, i: int
) -> float:
    """Return when (s; inf: never) ball ``i`` leaves the reference in ``rows[first:last]``."""
    k = first + i  # The first breakpoints are those of the start, one a ball.
    coming = k + 1
    for n in range(len(reference.times)):
        t = min(reference.times[n], duration)
        while coming < last and (rows[coming, 0] != i or rows[coming, 1] <= t):
            if rows[coming, 0] == i:
                k = coming
            coming += 1
        path = from_breakpoint(
            rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4], rows[k, 5], rows[k, 6],
            rows[k, 7],
        )  # fmt: skip
        x, y, _, _ = motion_at(path, t)
        dx, dy = x - reference.path[n, i, 0], y - reference.path[n, i, 1]
        if math.sqrt(dx * dx + dy * dy) > reference.agree:
            return float(reference.times[n])
    return math.inf


def has_same_contacts(events: Any, reference: Reference, count: Any) -> bool:
    """Tell whether every ball met the same others in the same order as in the reference."""
    count[:] = 0
    for k in range(len(events)):
        for side in (1, 2):
            i, j = int(events[k, side]), int(events[k, 3 - side])
            if i >= 0 and j > STOP:  # Negative numbers are walls.
                if count[i] >= reference.contacts[i] or reference.other[i, count[i]] != j:
                    return False
                count[i] += 1
    return bool((count == reference.contacts).all())
