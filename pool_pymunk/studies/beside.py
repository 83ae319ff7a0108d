"""This module compares tracks of compiled shots with the unperturbed run."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.fast import compiled
from pool_pymunk.fast.records import Out, Tracks
from pool_pymunk.model import Scene
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.path import from_breakpoint, motion_at
from pool_pymunk.results.run import Event, Run
from pool_pymunk.studies.compare import contact_order, contacts

INSTANTS = 256  # Runs are compared at this many times, besides their start.


class Reference(NamedTuple):
    """A reference is a run with which others are compared.

    Its balls are at ``path`` (T, N, 2) at the ``times`` (T,). A ball has left it that is more than
    ``agree`` (m) off. Contact c of ball i is with ``other[i, c]``, a ball or as -1 - its number a
    wall; it is contact number ``place[i, c]`` of the other ball, and ``contacts[i]`` is how many
    there are.
    """

    times: Any
    path: Any
    agree: float
    other: Any
    place: Any
    contacts: Any


def reference_of(run: Run, agree: float) -> Reference:
    """Return a run as others are compared with it, to ``agree`` (m)."""
    times = np.linspace(0.0, run.duration, INSTANTS + 1)
    seen: list[list[tuple[int, int]]] = [[] for _ in run.scene.balls]
    for event in contacts(run):
        one, *other = (run.scene.index[id_] for id_ in event.balls)
        for i in other:
            place = len(seen[one]) + 1, len(seen[i]) + 1
            seen[one].append((i, place[1]))
            seen[i].append((one, place[0]))
        if not other:
            seen[one].append((-1 - _wall(run.scene, event), 0))
    rows = np.zeros((2, len(seen), max(map(len, seen))), dtype=np.int64)
    for i, each in enumerate(seen):
        rows[:, i, : len(each)] = np.array(each, dtype=np.int64).reshape(-1, 2).T
    counts = np.array([len(each) for each in seen])
    return Reference(times, np.array(run.at(times)[0]), agree, rows[0], rows[1], counts)


def _wall(scene: Scene, event: Event) -> int:
    """Return the number of a cushion or pocket among all walls: cushions come first."""
    if event.cushion is not None:
        return event.cushion
    cushions = len(scene.table.edges) if scene.table else 0
    return cushions + [hole.id for hole in scene.pockets].index(str(event.pocket))


class Beside:
    """This watches shots, and compares each with the reference.

    ``left`` (S, N) is when (s; inf: never) each ball left it, and ``same`` (S,) whether every ball
    met the same others in the same order. ``reference`` is made of ``run``.
    """

    def __init__(self, run: Run, reference: Reference, out: Out) -> None:
        self.reference, self.duration = reference, out.duration
        self.order = contact_order(run)
        self.left = np.empty(out.final.shape[:2])
        self.same = np.empty(len(out.duration), np.bool_)

    def watch(self, part: slice, tracks: Tracks) -> None:
        """Compare these shots."""
        compiled.alone(compare)(
            tracks, self.duration[part], self.reference, self.left[part], self.same[part],
            np.zeros(self.left.shape[1], np.int64),
        )  # fmt: skip

    def see(self, k: int, run: Run) -> None:
        """Compare the run of shot ``k``, which was not compiled."""
        self.left[k] = self.first_off(run.at(self.reference.times)[0] - self.reference.path)
        self.same[k] = contact_order(run) == self.order

    def first_off(self, off: Array) -> Array:
        """Return when (s; inf: never) balls (N,) first leave, by their offsets (T, N, 2) in m."""
        apart = np.hypot(off[..., 0], off[..., 1]) > self.reference.agree
        return np.where(apart.any(axis=0), self.reference.times[apart.argmax(axis=0)], math.inf)


# -- what numba compiles ---------------------------------------------------------------------------


def compare(
    tracks: Tracks, duration: Any, reference: Reference, left: Any, same: Any, count: Any
) -> int:
    """Compare some shots with the reference, and return how many; ``count`` (N,) is overwritten."""
    first = begun = 0
    for s in range(len(left)):
        last, ended = tracks.ends[s, 0], tracks.ends[s, 1]
        if last > first:
            for i in range(left.shape[1]):
                left[s, i] = leaves(tracks.knots, first, last, duration[s], reference, i)
            same[s] = has_same_contacts(tracks.contacts, begun, ended, reference, count)
        first, begun = last, ended
    return len(left)


def leaves(
    knots: Any, first: int, last: int, duration: float, reference: Reference, i: int
) -> float:
    """Return when (s) ball ``i`` is first seen off the reference's path; infinite if never.

    Its breakpoints are among those from ``first`` up to ``last``.
    """
    k = first + i  # The first breakpoints are those of the start, one a ball.
    coming = following(knots, k, last, i)
    for n in range(len(reference.times)):
        t = min(reference.times[n], duration)
        while coming < last and knots[coming, 1] <= t:
            k, coming = coming, following(knots, coming, last, i)
        path = from_breakpoint(
            knots[k, 1], knots[k, 2], knots[k, 3], knots[k, 4], knots[k, 5], knots[k, 6],
            knots[k, 7],
        )  # fmt: skip
        x, y, _, _ = motion_at(path, t)
        dx, dy = x - reference.path[n, i, 0], y - reference.path[n, i, 1]
        if math.sqrt(dx * dx + dy * dy) > reference.agree:
            return float(reference.times[n])
    return math.inf


def following(knots: Any, k: int, last: int, i: int) -> int:
    """Return the number of the next breakpoint of ball ``i``, or that after all of them."""
    k += 1
    while k < last and knots[k, 0] != i:
        k += 1
    return k


def has_same_contacts(
    contacts: Any, begun: int, ended: int, reference: Reference, count: Any
) -> bool:
    """Tell whether every ball met the same others in the same order as in the reference."""
    count[:] = 0
    for c in range(begun, ended):
        i, j = contacts[c, 0], contacts[c, 1]
        count[i] += 1
        place = 0
        if j >= 0:
            count[j] += 1
            place = count[j]
        n = count[i] - 1
        if n >= reference.contacts[i]:
            return False
        if reference.other[i, n] != j or reference.place[i, n] != place:
            return False
    return bool((count == reference.contacts).all())
