"""This module linearises the motion of a group in persistent contact, in one mode.

Within a mode the rates are smooth in the state and in the scene's numbers. Complex steps give their
derivatives to rounding: the imaginary part of a function at a number that has a tiny imaginary part
(Squire and Trapp, SIAM Review 40, 1998, 110). The changes then follow a linear equation, which is
stiff where a slip is short: friction turns it fast. An implicit method solves it (Radau IIA, of
order five: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5).

A press (:mod:`pool_pymunk.physics.pressed`) has the mode. A state is a list of six numbers a ball,
its changes are rows (6 N, P), one column an input.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.physics import forces, pieces
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.pressed import (
    FORM,
    REST,
    ROLL,
    SLIP,
    Press,
    gap_of,
    lengths,
    look,
    opening,
    roll_into,
    room,
    rows_of,
)
from pool_pymunk.physics.surface import SHARE

TINY_STEP = 1e-30  # the imaginary part of what is differentiated
# The method's nodes, as shares of a step, and its weights.
ROOT = math.sqrt(6.0)
NODES = ((4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0, 1.0)
WEIGHTS = np.array(
    [
        [(88.0 - 7.0 * ROOT) / 360.0, (296.0 - 169.0 * ROOT) / 1800.0, (3.0 * ROOT - 2.0) / 225.0],
        [(296.0 + 169.0 * ROOT) / 1800.0, (88.0 + 7.0 * ROOT) / 360.0, -(2 + 3.0 * ROOT) / 225.0],
        [(16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0],
    ]
)
ORDER = 5
# A step and its two halves may differ by this share of the changes; the better answer errs by about
# a hundredth of it.
WRONG = 1e-7
MOST = 4  # A step within a piece is halved so often.
LEAST = 1e-6  # Changes (SI) that are less need not be as right as others.
BESIDE = 1e-3  # radii; so far beside a place the distance to the end of a side is linear
WRITTEN = ("push", "rate", "force", "normal", "bend", "slip", "matrix")  # by those of a press
REDUNDANT = 1e-10  # A force is redundant if less than this share of its response is independent.

Spell = tuple[float, float]  # from when to when (s) after the beginning of a piece


class Numbers(NamedTuple):
    """The inputs change masses, pulls and drags of balls (N, P), frictions of contacts (M, P) so.

    The slip of a ball that is ``steady`` has no changes.
    """

    mass: Array
    mu: Array
    pull: Array
    drag: Array
    steady: tuple[int, ...] = ()


# -- rates -------------------------------------------------------------------------------------


def in_columns(g: Any, changes: Numbers, plain: int = 0) -> Any:
    """Return a press whose numbers are columns, after ``plain`` ones with changes by the inputs.

    Its lists are those of ``g``, except for what the functions of a press write.
    """

    def varied(number: float, change: Array) -> Any:
        column = np.full(plain + len(change), number, complex)
        column[plain:] += 1j * TINY_STEP * change
        return column

    found: Any = Press()
    vars(found).update(vars(g))
    for name in WRITTEN:
        kind, shape = FORM[name]
        setattr(found, name, rows_of(kind, lengths(shape, *g.room)))
    found.mass = [varied(*both) for both in zip(g.mass, changes.mass, strict=False)]
    found.mu = [varied(*both) for both in zip(g.mu, changes.mu, strict=False)]
    found.pull = [varied(*both) for both in zip(g.pull, changes.pull, strict=False)]
    found.drag = [varied(*both) for both in zip(g.drag, changes.drag, strict=False)]
    found.steady = changes.steady
    return found


def as_columns(s: Any, changes: Array) -> Any:
    """Return a state (6 N) with changes of it (6 N, C) as columns."""
    return np.array(s, complex)[:, np.newaxis] + 1j * TINY_STEP * np.nan_to_num(changes)


def solved(found: Any, count: int, size: int) -> Any:
    """Solve the system of a press in columns, without redundant forces; real parts are equal."""
    both = np.array([[m + np.zeros(size, complex) for m in row[: count + 1]]
                     for row in found.matrix[:count]])  # fmt: skip
    matrix, wanted = both[:, :count], both[:, count]
    left, sizes, right = np.linalg.svd(matrix[:, :, 0].real)
    rank = int((sizes > REDUNDANT * sizes[0]).sum())
    left, right = left[:, :rank], right[:rank].T
    inner = np.einsum("pr,pqc,qs->crs", left, matrix, right)
    reduced = np.linalg.solve(inner, np.einsum("pr,pc->cr", left, wanted)[..., np.newaxis])
    return np.einsum("qs,cs->qc", right, reduced[..., 0])


def solve_columns(found: Any, s: Any, count: int) -> Any:
    """Solve the system for the forces of a press in columns, and return the rates by them."""
    if count:
        for row, force in zip(found.matrix, solved(found, count, s.shape[1]), strict=False):
            row[count] = force
    forces.take_forces(found, s, count)
    return np.array([rate + np.zeros(s.shape[1]) for rate in found.rate[: len(s)]])


def unchanged(g: Any, count: int) -> Numbers:
    """Return that so many inputs do not change the numbers of a press."""
    balls, contacts = np.zeros((g.balls, count)), np.zeros((g.contacts, count))
    return Numbers(balls, contacts, balls, balls)


def rate_of(g: Any, s: Any) -> Array:
    """Return the rate (6 N) of a state."""
    forces.find_forces(g, s)
    return np.array(g.rate[: len(s)], float)


def slopes(found: Any, s: Any, count: int) -> tuple[Array, Array]:
    """Return the derivatives of the rates by the state (6 N, 6 N) and by the inputs (6 N, P).

    The press is in columns, the first of which are for the state, and has so many unknown forces.
    """
    size, state = len(s), as_columns(s, np.eye(len(s), len(found.pull[0])))
    forces.fill_system(found, state, count)
    rates = solve_columns(found, state, count).imag / TINY_STEP
    return rates[:, :size], rates[:, size:]


# -- motion ------------------------------------------------------------------------------------


class Course:
    """A course is the motion of a press ``g`` in one mode, in pieces that follow each other.

    ``steps`` (s, changes) are those at which changes were found.
    """

    def __init__(self, g: Any, t: float, s: Any) -> None:
        self.g, self.starts, self.states = g, [t], [s]
        self.steps: list[tuple[float, Array]] = []

    def go_on(self, t: float, s: Any) -> None:
        """Go on with a step that begins at a time (s) in a state, whatever was to come then."""
        while self.starts[-1] >= t and len(self.starts) > 1:
            self.starts.pop()
            self.states.pop()
        self.starts.append(t)
        self.states.append(s)

    def piece_at(self, t: float) -> int:
        """Return the number of the piece of a time (s)."""
        return max(int(np.searchsorted(self.starts, t, side="right")) - 1, 0)

    def at(self, t: float) -> list[float]:
        """Return the state at a time (s)."""
        k = self.piece_at(t)
        g, s, time = self.g, self.states[k], t - self.starts[k]
        if time <= 0.0:
            return list(s)
        forces.find_forces(g, s)
        end = [0.0] * len(s)
        pieces.step(g, s, time, end)
        return end

    def evolve(self, z: Array, spell: Spell, changes: Numbers) -> Array:
        """Return changes (6 N, P) at the end of a spell (s) by those at its beginning."""
        if spell[1] <= spell[0]:
            return z
        return self._evolve((z, implicit_step(self, z, spell, changes)), spell, changes, MOST)

    def _evolve(
        self, ends: tuple[Array, Array], spell: Spell, changes: Numbers, halvings: int
    ) -> Array:
        """Go on from the one end of a spell, the other of which a single step has found.

        A step is halved where it is too long, so many times within a piece.
        """
        (z, whole), (since, until) = ends, spell
        middle, is_within = (since + until) / 2.0, self.piece_at(since) == self.piece_at(until)
        half = implicit_step(self, z, (since, middle), changes)
        both = implicit_step(self, half, (middle, until), changes)
        wrong, size = np.abs(both - whole).max(axis=0), np.abs(both).max(axis=0) + LEAST
        if halvings == 0 or not (wrong > WRONG * size).any():
            found = both + (both - whole) / (2**ORDER - 1)
            self.steps.append((until, found))
            return np.asarray(found)
        first = self._evolve((z, half), (since, middle), changes, halvings - is_within)
        whole = implicit_step(self, first, (middle, until), changes)
        return self._evolve((first, whole), (middle, until), changes, halvings - is_within)


def implicit_step(course: Course, z: Array, spell: Spell, changes: Numbers) -> Array:
    """Return changes after one step of the implicit method."""
    (since, until), size, count = spell, len(z), forces.number_unknowns(course.g)
    h, press = until - since, in_columns(course.g, changes, len(z))
    found = [slopes(press, course.at(since + h * node), count) for node in NODES]
    matrix, given = np.eye(3 * size), np.concatenate([z] * 3)
    for p, row in enumerate(WEIGHTS):
        here = slice(p * size, (p + 1) * size)
        for q, (weight, (by_state, by_inputs)) in enumerate(zip(row, found, strict=True)):
            matrix[here, q * size : (q + 1) * size] -= h * weight * by_state
            given[here] += h * weight * by_inputs
    return np.asarray(np.linalg.solve(matrix, given)[-size:])


# -- a mode begins and ends --------------------------------------------------------------------


def settled(phases: Any, z: Array) -> Array:
    """Return changes where balls roll or rest from now on: what slips a little is gone at once."""
    found = z.copy().reshape(len(phases), 6, -1)
    for own, phase in zip(found, phases, strict=True):
        if phase == ROLL:
            own[2:4] = own[4:] = (1.0 - SHARE) * own[2:4] + SHARE * own[4:]
        elif phase == REST:
            own[2:] = 0.0
    return found.reshape(z.shape)


def gaps(g: Any, s: Any, z: Array, of_radius: Array) -> Array:
    """Return the changes (M, P) of the gaps, where radii (N, P) change."""
    state, found = as_columns(s, z), np.zeros((g.contacts, z.shape[1]))
    for k, wide in enumerate(found):
        wide[:] = gap_of(g, state, k).imag / TINY_STEP
        for i in (g.one[k], g.other[k]):
            wide -= of_radius[i] if i >= 0 else 0.0
    return found


def joined(g: Any, s: Any, z: Array) -> Array:
    """Return changes after the sides that press move together.

    Small hits do this, or somewhat more or less pressing: impulses of the same kinds as the forces.
    """
    count, state = forces.number_unknowns(g), as_columns(s, z)
    if not count:
        return z
    found = in_columns(g, unchanged(g, z.shape[1]))
    found.pull = found.drag = [0.0] * g.balls
    forces.fill_system(found, state, count)
    for row, (k, kind) in zip(found.matrix, g.unknown[:count], strict=False):
        row[count] = -part_of(found, state, k, kind).imag / TINY_STEP
        row[:count] = [part.real for part in row[:count]]
    after = z.copy().reshape(-1, 6, z.shape[1])
    after[:, 2:] += solve_columns(found, state, count).real.reshape(after.shape)[:, 2:]
    return after.reshape(z.shape)


def part_of(g: Any, s: Any, k: int, kind: int) -> Any:
    """Return the speed (m/s) in a contact that a kind of force brings to 0."""
    if kind == forces.NORMAL:
        return opening(g, s, k)
    if kind == forces.ALONG:
        return g.slip[k]
    return roll_into(g, s, k) if g.phase[g.one[k]] != ROLL else 0.0 * g.slip[k]


def slip_of(g: Any, s: Any, i: int) -> Array:
    """Return the slip (m/s) of ball i, or its velocity if it rolls; or the changes of it."""
    one, p = np.asarray(s), 6 * i
    is_slip = g.phase[i] == SLIP
    return one[p + 2 : p + 4] - one[p + 4 : p + 6] if is_slip else one[p + 2 : p + 4]


def fades_later(g: Any, s: Any, rate: Array, z: Array, i: int) -> Array:
    """Return how much later (s) the slip of ball i has faded, or its speed if it rolls."""
    u = slip_of(g, s, i)
    return np.asarray(-(u @ slip_of(g, z, i)) / (u @ slip_of(g, rate, i)))


def falls_later(g: Any, s: Any, rate: Array, z: Array, fell: int) -> Array | None:
    """Return how much later (s) a measure falls to 0 (:func:`pool_pymunk.physics.pieces.measure`).

    It is None where the rates do not jump: a force falls to 0, or grows beyond what friction holds.
    """
    k, kind = fell // 4, fell % 4
    if k >= len(g.one) or kind == 0 or (kind < 3 and not (g.slides, g.into)[kind - 1][k]):
        return None
    both = np.column_stack((rate, z))
    if kind == 3:
        slope = end_slope(g, s, k) @ both
    else:
        state, found = as_columns(s, both), in_columns(g, unchanged(g, 0))
        look(found, state)
        slope = (found.slip[k] if kind == 1 else roll_into(found, state, k)).imag
    return np.asarray(-slope[1:] / slope[0])


def end_slope(g: Any, s: Any, k: int) -> Array:
    """Return how fast the distance to the end of a side grows with the state (6 N)."""
    found, i, h = np.zeros(len(s)), 6 * g.one[k], BESIDE * g.radius[g.one[k]]
    for p, dx, dy in ((i, h, 0.0), (i + 1, 0.0, h)):
        there, back = (room(g, k, s[i] + sign * dx, s[i + 1] + sign * dy) for sign in (1.0, -1.0))
        found[p] = (there - back) / (2.0 * h)  # It is linear in the place.
    return found
