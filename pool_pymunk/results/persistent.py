"""A run tells of the contacts that persisted, and what a roll does while one lasts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.model import Point
from pool_pymunk.model.arrays import Array
from pool_pymunk.results.events import parts_of
from pool_pymunk.results.motion import free_motions, roll_rates

if TYPE_CHECKING:
    from pool_pymunk.results.run import Run
    from pool_pymunk.results.trace import Persisted, Trace

Spell = tuple[float, float]  # from when to when (s)


@dataclass(frozen=True, slots=True)
class PersistentContact:
    """A persistent contact is one that lasts: two sides touch from ``since`` to ``until`` (s).

    Surface friction, a roll or an arc presses them together. ``balls`` are the ids of two balls, or
    of the one that touches the ``cushion`` of this number. ``impulse`` (x, y) in N s is what the
    contact has given to the last ball in all this time; the first of two balls got the opposite.
    For each ball these impulses, those of the events and the friction of the surface add up to its
    change of momentum.

    A ball rolls into another one, does not bounce, and pushes it until both roll:

    >>> from pool_pymunk import Ball, Friction, Restitution, Scene, simulate
    >>> balls = (
    ...     Ball("A", (0.0, 0.0), 0.03, 0.2, velocity=(1.0, 0.0), roll=1.0),
    ...     Ball("B", (0.0601, 0.01), 0.03, 0.2),
    ... )
    >>> scene = Scene(balls, None, Restitution(0.0), Friction(0.1, rolling=0.01))
    >>> [contact] = simulate(scene, solver="event-driven").persistent
    >>> contact.balls, contact.cushion, round(contact.since, 4), round(contact.until, 3)
    (('A', 'B'), None, 0.0009, 0.176)
    """

    balls: tuple[str, ...]
    cushion: int | None
    since: float
    until: float
    impulse: Point

    def as_dict(self) -> dict[str, object]:
        """Return the contact as it stands in the JSON."""
        return parts_of(self)


def contacts_of(
    persisted: Iterable[Persisted], ids: Sequence[str]
) -> tuple[PersistentContact, ...]:
    """Return what a run tells of the contacts that persisted, in the order of their beginnings."""
    return tuple(
        PersistentContact(
            tuple(ids[i] for i in balls_of(a, b)),
            cushion if b < 0 else None, since, until, (x, y),
        )
        for a, b, cushion, since, until, x, y in sorted(persisted, key=SINCE)
    )  # fmt: skip


SINCE = itemgetter(3)


def balls_of(a: int, b: int) -> tuple[int, ...]:
    """Return the numbers of the balls of a contact, one or two."""
    return (a,) if b < 0 else (a, b)


def warn_of_persisted(trace: Trace, ids: Sequence[str], presses: str) -> None:
    """Warn once of the sets of balls and cushions that contacts have joined, and what presses."""
    found = joined(trace.persisted)
    if not found:
        return
    said = "; ".join(
        f"{each.words(ids)}: they stay in contact "
        f"{'now and then ' if each.times > 1 else ''}"
        f"{f'from {each.since:.6g} s ' if len(found) > 1 else ''}until {each.until:.6g} s"
        for each in found
    )
    more = "In Python, run.persistent_shift says how far that may put the ends off"
    trace.warn(f"{presses} presses {said}. {more}", found[0].since)


class Joined(NamedTuple):
    """These were joined so many ``times``: first at ``since``, and at last until ``until`` (s).

    ``balls`` and ``cushions`` are numbers.
    """

    balls: tuple[int, ...]
    cushions: tuple[int, ...]
    since: float
    until: float
    times: int = 1

    def words(self, ids: Sequence[str]) -> str:
        """Say in words what is pressed together: balls by their ids, cushions by their numbers."""
        balls = _named("ball", [ids[i] for i in self.balls])
        if len(self.balls) == 1:
            return f"{balls} to {_named('cushion', self.cushions)}"
        cushions = f" and {_named('cushion', self.cushions)}" if self.cushions else ""
        return f"{balls}{cushions} together"


def _named(what: str, those: Sequence[object]) -> str:
    return f"{what}{'s' if len(those) > 1 else ''} {', '.join(map(str, those))}"


def joined(persisted: Iterable[Persisted]) -> list[Joined]:
    """Return which balls and cushions were joined by contacts that overlap in time.

    Each set of them stands there once, in the order in which they were joined first.
    """
    now: list[Joined] = []
    past: list[Joined] = []
    for a, b, cushion, since, until, _, _ in sorted(persisted, key=SINCE):
        balls, group = set(balls_of(a, b)), [cushion] if b < 0 else []
        one = Joined(tuple(sorted(balls)), tuple(group), since, until)
        past += [each for each in now if each.until < since]
        now = [each for each in now if each.until >= since]
        touching = [each for each in now if not balls.isdisjoint(each.balls)]
        now = [each for each in now if balls.isdisjoint(each.balls)]
        for each in touching:
            one = Joined(
                tuple(sorted({*one.balls, *each.balls})),
                tuple(sorted({*one.cushions, *each.cushions})),
                min(one.since, each.since), max(one.until, each.until),
            )  # fmt: skip
        now.append(one)
    found: dict[tuple[object, object], Joined] = {}
    for one in sorted(past + now, key=lambda each: each.since):
        first = found.get(one[:2], one._replace(times=0))
        found[one[:2]] = first._replace(until=max(first.until, one.until), times=first.times + 1)
    return list(found.values())


def spells(run: Run, ball: str) -> list[Spell]:
    """Return from when until when (s) each persistent contact of a ball lasted."""
    return [(each.since, each.until) for each in run.persistent if ball in each.balls]


def turning(breakpoints: Array, persists: Iterable[Spell]) -> Array:
    """Return how fast (K, 2) in m/s^2 a roll changes after a ball's breakpoints (K, 9).

    In the spells in which a contact of the ball ``persists``, it goes evenly from each breakpoint
    to the next one.
    """
    rates, k = roll_rates(breakpoints), pieces(breakpoints[:, 0], persists)
    time, rolls = np.diff(breakpoints[:, 0])[k], breakpoints[:, 7:9]
    rates[k] = (rolls[k + 1] - rolls[k]) / time[:, np.newaxis]
    return rates


def turning_with(breakpoints: Array, persists: Iterable[Spell], bent: Array) -> Array:
    """Return the same, and how fast that changes: (K, 4) in m/s^2 and m/s^3.

    Where a ball rolls at both ends of a piece, its roll is its velocity, whose rates are ``bent``.
    """
    k, rolls = pieces(breakpoints[:, 0], persists), breakpoints[:, 7:9] == breakpoints[:, 3:5]
    rates = np.column_stack((turning(breakpoints, persists), np.zeros((len(breakpoints), 2))))
    k = k[rolls[k].all(axis=-1) & rolls[k + 1].all(axis=-1)]
    rates[k] = bent[k, 5:9]
    return rates


def bending(breakpoints: Array, persists: Iterable[Spell], tolerance: float) -> Array:
    """Return a ball's breakpoints (K, 9) with the rates (m/s^3) at which accelerations change.

    A piece of a persistent contact is played more exactly than its parabola is. The next breakpoint
    tells how it ends, and the cubic that does so, too, is its path (Hermite). Where the ends differ
    by more than the ``tolerance`` (m), or than accelerations could explain, something else has
    happened there.
    """
    rows = np.column_stack((breakpoints[:, :7], np.zeros((len(breakpoints), 2))))
    k = pieces(rows[:, 0], persists)
    time = np.diff(rows[:, 0])[k, np.newaxis]
    place, velocity = free_motions(rows[k], rows[k + 1, 0])
    far, fast = rows[k + 1, 1:3] - place, (rows[k + 1, 3:5] - velocity) * time
    pull = np.hypot(*rows[:, 5:7].T)
    most = np.minimum(time[:, 0] ** 2 * (pull[k] + pull[k + 1]), tolerance)
    bends = np.maximum(np.hypot(*far.T), np.hypot(*fast.T)) <= most
    k, time, far, fast = k[bends], time[bends], far[bends], fast[bends]
    rows[k, 5:7] += (6.0 * far - 2.0 * fast) / time**2
    rows[k, 7:9] = (6.0 * fast - 12.0 * far) / time**3
    return rows


def pieces(t: Array, persists: Iterable[Spell]) -> NDArray[np.intp]:
    """Return which breakpoints, at times ``t`` (s), begin pieces of some spells."""
    found = np.zeros(max(len(t) - 1, 0), bool)
    for since, until in persists:
        found |= (since <= t[:-1]) & (t[:-1] < until)
    return np.flatnonzero(found & (np.diff(t) > 0.0))
