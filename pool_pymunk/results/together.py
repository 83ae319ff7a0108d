"""Balls that go on together, in persistent contact, never gain energy between their breakpoints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.model.arrays import Array
from pool_pymunk.results.persistent import pieces, spells

if TYPE_CHECKING:
    from pool_pymunk.results.run import Run

DEGREE = 4  # of the kinetic energy, where a velocity is of the second one


def losses(run: Run, bent: Sequence[Array], rolls: Sequence[Array]) -> tuple[Array, ...]:
    """Return for each ball's breakpoints (K, 12) how balls lose energy that go on together.

    They have breakpoints at the same times. Between these their energy by the curves of place and
    roll would fall a little too far, and rise again. It is to fall by a cubic with the same slopes
    at both ends, as far as it falls all the time by that (Fritsch and Carlson). The numbers are the
    time (s), how long the piece is, and the coefficients of two polynomials in the share of the
    piece that is over: the kinetic energy (J) of these balls by the curves, and what it is to be.
    """
    counts = [len(rows) for rows in run.knots]
    mass = np.repeat([ball.mass for ball in run.scene.balls], counts)
    t = np.concatenate([rows[:, 0] for rows in run.knots])
    ends = np.concatenate([np.append(rows[1:, 0], rows[-1, 0]) for rows in run.knots])
    persist = np.zeros(len(t), bool)
    for ball, rows, first in zip(run.scene.balls, run.knots, np.cumsum([0, *counts]), strict=False):
        persist[first + pieces(rows[:, 0], spells(run, ball.id))] = True
    _, which = np.unique(np.column_stack((t, ends)), axis=0, return_inverse=True)
    which = which.ravel()
    kinetic, lift = _curves(np.concatenate(bent), np.concatenate(rolls), ends - t, mass, run)
    found = np.zeros((3, which.max() + 1, DEGREE + 1))
    np.add.at(found[0], which, kinetic)
    np.add.at(found[1], which, lift)
    np.add.at(found[2], which[:-1], kinetic[1:])  # the next breakpoints'
    table = np.zeros((len(t), 2 * DEGREE + 4))
    table[:, 0], table[:, 1:3], table[:, DEGREE + 3] = t, 1.0, 1.0
    k = np.flatnonzero(np.isin(which, which[persist]))
    table[k, 1], table[k, 2 : DEGREE + 3] = (ends - t)[k], found[0][which[k]]
    table[k, DEGREE + 3 :] = _falling(found[0], found[1], found[2][:, 0])[which[k]]
    return tuple(np.split(table, np.cumsum(counts)[:-1]))


def _curves(bent: Array, rolls: Array, time: Array, mass: Array, run: Run) -> tuple[Array, Array]:
    """Return the coefficients of each ball's kinetic energy, and of what its height adds (J)."""
    h = time[:, np.newaxis]
    share = math.sqrt(GYRATION)
    a = np.hstack((bent[:, 3:5], share * rolls[:, 1:3]))
    b = np.hstack((bent[:, 5:7], share * rolls[:, 3:5])) * h
    c = np.hstack((bent[:, 7:9], share * rolls[:, 5:7])) * h * h / 2.0
    products = ((a, a), (a, 2.0 * b), (b, b), (2.0 * b, c), (c, c))
    kinetic = np.stack([(u * v).sum(axis=1) for u, v in products], axis=1)
    kinetic[:, 2] += 2.0 * (a * c).sum(axis=1)
    lift = np.zeros_like(kinetic)
    for power in range(1, DEGREE):
        far = (a, b / 2.0, c / 3.0)[power - 1][:, :2] * h
        lift[:, power] = -2.0 * far @ np.array(run.scene.tilt)
    half = mass[:, np.newaxis] / 2.0
    return half * kinetic, half * lift


def _falling(kinetic: Array, lift: Array, then: Array) -> Array:
    """Return the coefficients of the kinetic energies that are to be: all energy falls.

    It falls no lower than ``then`` (J), which the next breakpoints have.
    """
    power = np.arange(DEGREE + 1)
    both, height = kinetic + lift, lift.sum(axis=1)
    loss = np.minimum(np.maximum(both.sum(axis=1), then + height) - both[:, 0], 0.0)
    first = np.clip(both[:, 1], 3.0 * loss, 0.0)
    last = np.clip(both @ power, 3.0 * loss, 0.0)
    found = -lift
    found[:, 0] += both[:, 0]
    found[:, 1] += first
    found[:, 2] += 3.0 * loss - 2.0 * first - last
    found[:, 3] += first + last - 2.0 * loss
    return found


def slowed(rows: Array, times: Array) -> Array:
    """Return by what factor (..., 1) velocities differ from the curves' at times (..., 1) (s)."""
    over = (times - rows[..., 0]) / rows[..., 1]
    powers = over[..., np.newaxis] ** np.arange(DEGREE + 1)
    curve = (rows[..., 2 : DEGREE + 3] * powers).sum(axis=-1)
    aim = (rows[..., DEGREE + 3 :] * powers).sum(axis=-1)
    share = np.divide(np.maximum(aim, 0.0), curve, out=np.ones_like(aim), where=curve > 0.0)
    return np.asarray(np.sqrt(share)[..., np.newaxis])
