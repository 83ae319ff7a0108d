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

from pool_pymunk.physics import pieces
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.pressed import (
    ALONG,
    BALL,
    FLAT,
    NORMAL,
    REST,
    ROLL,
    SLIP,
    find_forces,
    number_unknowns,
)
from pool_pymunk.physics.surface import GYRATION, SHARE

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
REDUNDANT = 1e-10  # A force is redundant if less than this share of its response is independent.

Spell = tuple[float, float]  # from when to when (s) after the beginning of a piece


class Numbers(NamedTuple):
    """These numbers of a press change: masses (N, P), frictions of contacts (M, P), pull, drag (P).

    Or they are these numbers themselves, with changes as imaginary parts. The slip of a ball that
    is ``steady`` has no changes.
    """

    mass: Any
    mu: Any
    pull: Any
    drag: Any
    steady: tuple[int, ...] = ()


class System(NamedTuple):
    """A system for Q unknown forces, at the states of C columns.

    ``gives`` (Q, N, 4, C) are the pushes of each on balls and on their rolls (m/s^2), and ``asks``
    (Q, N, 6, C) what each must bring to ``rest`` (Q, C), of the balls' rates and of what the
    surface holds. The ``rates`` (N, 6, C) are those without forces.
    """

    gives: Any
    asks: Any
    rest: Any
    rates: Any


# -- rates -------------------------------------------------------------------------------------


def geometry_of(g: Any, s: Any) -> tuple[Any, Any]:
    """Return the normals (M, 2, C) and the bends (M, C) of the contacts."""
    shape = (len(g.one), s.shape[-1])
    normals, bends = np.zeros((shape[0], 2, shape[1]), complex), np.zeros(shape, complex)
    for k, (i, what, numbers) in enumerate(zip(g.one, g.what, g.edge, strict=True)):
        if what == FLAT:
            normals[k] = np.array(numbers[:2])[:, np.newaxis]
            continue
        facing = 1.0 if what == BALL else numbers[2]
        center = s[i, :2] if what == BALL else np.array(numbers[:2])[:, np.newaxis]
        apart = (s[g.other[k], :2] if what == BALL else s[i, :2]) - center
        distance = np.sqrt(apart[0] ** 2 + apart[1] ** 2)
        normals[k], bends[k] = facing * apart / distance, facing / distance
    return normals, bends


def signs_of(g: Any) -> Array:
    """Return the signs (M, N) with which the contacts push balls along their normals."""
    signs = np.zeros((len(g.one), len(g.mass)))
    for k, (i, j) in enumerate(zip(g.one, g.other, strict=True)):
        signs[k, i] = 1.0 if j < 0 else -1.0
        if j >= 0:
            signs[k, j] = 1.0
    return signs


def across(normals: Any) -> Any:
    """Return the tangents of normals (M, 2, C)."""
    return np.stack((-normals[:, 1], normals[:, 0]), axis=1)


def replies_of(g: Any) -> Array:
    """Return how balls reply (N, 6, 4) to pushes on them and on their rolls, by their phases.

    The last two numbers are what the surface must hold of a ball that rolls.
    """
    found, one = np.zeros((len(g.mass), 6, 4)), np.eye(2)
    for reply, phase in zip(found, g.phase, strict=True):
        if phase == SLIP:
            reply[:2, :2] = one
            reply[2:4, 2:] = one * g.rolls
        elif phase == ROLL:
            for first in (0, 2):
                reply[first : first + 2] = np.hstack(((1.0 - SHARE) * one, SHARE * one))
            reply[4:] = np.hstack((-one, one))
    return found


def free_rates(g: Any, s: Any, by: Numbers) -> Any:
    """Return the rates (N, 6, C) of balls that no contact pushes."""
    rates = np.zeros_like(s)
    for i, phase in enumerate(g.phase):
        if phase == REST:
            continue
        v, rate = s[i, 2:4], rates[i]
        rate[:2] = v
        u = v - s[i, 4:] if phase == SLIP else v
        u = u.real if i in by.steady else u
        most = by.pull if phase == SLIP else by.drag
        rate[2:4] = -most / np.sqrt(u[0] ** 2 + u[1] ** 2) * u
        if phase == ROLL:
            rate[4:] = rate[2:4]
        elif g.rolls:
            rate[4:] = -rate[2:4] / GYRATION
    return rates


def system_of(g: Any, s: Any, by: Numbers) -> System:
    """Return the system for the forces of a mode, as :mod:`pool_pymunk.physics.pressed` has it."""
    unknown = [tuple(g.unknown[q]) for q in range(number_unknowns(g))]
    (normals, bends), signs, rates = geometry_of(g, s), signs_of(g), free_rates(g, s, by)
    tangents, (balls, _, columns) = across(normals), s.shape
    gives = np.zeros((len(unknown), balls, 4, columns), complex)
    asks, rest = (
        np.zeros((len(unknown), balls, 6, columns), complex),
        np.zeros((len(unknown), columns), complex),
    )
    for q, (k, kind) in enumerate(unknown):
        i, n, t, sign = g.one[k], normals[k], tangents[k], signs[k][:, np.newaxis, np.newaxis]
        slip = np.einsum("n,nxc,xc->c", signs[k], s[:, 2:4], t)
        unit, mu = g.unit[k] / by.mass[:, np.newaxis], by.mu[k]
        if kind == NORMAL:
            gives[q, :, :2] = sign * unit * (n - g.slides[k] * mu * t)
            gives[q, i, 2:] = -g.into[k] * unit[i] * mu / GYRATION * n
            asks[q, :, :2], rest[q] = sign * n, bends[k] * slip**2
        elif kind == ALONG:
            gives[q, :, :2] = sign * unit * t
            asks[q, :, :2] = sign * t
        else:
            gives[q, i, 2:] = unit[i] * n
            first = 4 if g.phase[i] == ROLL else 2
            asks[q, i, first : first + 2] = n
            if g.phase[i] != ROLL:
                rest[q] = bends[k] * slip * np.einsum("xc,xc->c", s[i, 4:], t)
    return System(gives, asks, rest, rates)


def solved(matrix: Any, wanted: Any) -> Any:
    """Solve systems (Q, Q, C) for (Q, C), without redundant forces; their real parts are equal."""
    left, sizes, right = np.linalg.svd(matrix[:, :, 0].real)
    rank = int((sizes > REDUNDANT * sizes[0]).sum())
    left, right = left[:, :rank], right[:rank].T
    inner = np.einsum("pr,pqc,qs->crs", left, matrix, right)
    found = np.linalg.solve(inner, np.einsum("pr,pc->cr", left, wanted)[..., np.newaxis])
    return np.einsum("qs,cs->qc", right, found[..., 0])


def rates(g: Any, s: Any, by: Numbers) -> Any:
    """Return the rates (N, 6, C) of states (N, 6, C) in the mode of a press."""
    gives, asks, rest, free = system_of(g, s, by)
    if not len(gives):
        return free
    replies = np.einsum("nab,qnbc->qnac", replies_of(g), gives)
    matrix = np.einsum("pnac,qnac->pqc", asks, replies)
    wrong = np.einsum("pnac,nac->pc", asks[:, :, :4], free[:, 2:]) + rest
    forces = solved(matrix, -wrong)
    free[:, 2:] += np.einsum("qnac,qc->nac", replies[:, :, :4], forces)
    return free


def numbers_of(g: Any, changes: Numbers, plain: int = 0) -> Numbers:
    """Return the numbers of a press with changes as imaginary parts, after ``plain`` columns."""

    def with_changes(number: Any, change: Any) -> Any:
        some = np.zeros((*change.shape[:-1], plain + change.shape[-1]), complex)
        some[...] = np.asarray(number)[..., np.newaxis]
        some[..., plain:] += 1j * TINY_STEP * change
        return some

    mass, mu = with_changes(g.mass, changes.mass), with_changes(g.mu, changes.mu)
    pull, drag = with_changes(g.pull, changes.pull), with_changes(g.drag, changes.drag)
    return Numbers(mass, mu, pull, drag, changes.steady)


def as_columns(s: Any, count: int) -> Any:
    """Return a state as so many columns (N, 6, C)."""
    rows = np.array(s, complex).reshape(-1, 6, 1)
    return np.repeat(rows, count, axis=2)


def rate_of(g: Any, s: Any) -> Array:
    """Return the rate (6 N) of a state."""
    found = rates(g, as_columns(s, 1), numbers_of(g, unchanged(g, 1)))
    return np.asarray(found.real.reshape(-1))


def unchanged(g: Any, count: int) -> Numbers:
    """Return that so many inputs do not change the numbers of a press."""
    balls, contacts = np.zeros((len(g.mass), count)), np.zeros((len(g.one), count))
    return Numbers(balls, contacts, np.zeros(count), np.zeros(count))


def slopes(g: Any, s: Any, changes: Numbers) -> tuple[Array, Array]:
    """Return the derivatives of the rates by the state (6 N, 6 N) and by the inputs (6 N, P)."""
    size = len(s)
    state = as_columns(s, size + len(changes.pull))
    flat = state.reshape(size, -1)
    flat[:, :size] += 1j * TINY_STEP * np.eye(size)
    found = rates(g, state, numbers_of(g, changes, size)).imag.reshape(size, -1) / TINY_STEP
    return found[:, :size], found[:, size:]


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
        find_forces(g, s)
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
    (since, until), size = spell, len(z)
    h = until - since
    found = [slopes(course.g, course.at(since + h * node), changes) for node in NODES]
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
    normals, _ = geometry_of(g, as_columns(s, 1))
    signs, places = signs_of(g), z.reshape(len(g.mass), 6, -1)[:, :2]
    wide = np.einsum("kn,kx,nxp->kp", signs, normals[:, :, 0].real, places)
    return np.asarray(wide - np.abs(signs) @ of_radius)


def joined(g: Any, s: Any, z: Array) -> Array:
    """Return changes after the sides that press move together.

    Small hits do this, or somewhat more or less pressing: impulses of the same kinds as the forces.
    """
    count = z.shape[1]
    state = as_columns(s, count)
    state += 1j * TINY_STEP * np.nan_to_num(z).reshape(state.shape)
    gives, asks, _, _ = system_of(g, state, numbers_of(g, unchanged(g, count)))
    if not len(gives):
        return z
    replies = np.einsum("nab,qnbc->qnac", replies_of(g), gives).real
    matrix = np.einsum("pnac,qnac->pqc", asks.real, replies)
    parting = np.einsum("pnac,nac->pc", asks[:, :, :4], state[:, 2:]).imag / TINY_STEP
    pushes = solved(matrix, -parting)
    found = z.copy().reshape(state.shape)
    found[:, 2:] += np.einsum("qnac,qc->nac", replies[:, :, :4], pushes)
    return found.reshape(z.shape)


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
        state = as_columns(s, both.shape[1])
        state += 1j * TINY_STEP * np.nan_to_num(both).reshape(state.shape)
        normals, _ = geometry_of(g, state)
        if kind == 1:
            moves, sides = state[:, 2:4], signs_of(g)[k]
            slope = np.einsum("n,nxc,xc->c", sides, moves, across(normals)[k]).imag
        else:
            slope = np.einsum("xc,xc->c", state[g.one[k], 4:], normals[k]).imag
    return np.asarray(-slope[1:] / slope[0])


def end_slope(g: Any, s: Any, k: int) -> Array:
    """Return the direction (6 N) in which a ball comes nearer to the end of a side, or away."""
    i, shape, found = 6 * g.one[k], g.edge[k], np.zeros(len(s))
    if g.what[k] == FLAT:
        found[i], found[i + 1] = -shape[1], shape[0]
        return found
    x, y = s[i] - shape[0], s[i + 1] - shape[1]
    ends = ((shape[4], shape[5]), (shape[6], shape[7]))
    ex, ey = min(ends, key=lambda end: math.hypot(end[0] - x / shape[3], end[1] - y / shape[3]))
    found[i], found[i + 1] = -ey, ex
    return found
