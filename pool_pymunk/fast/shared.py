"""This module finds the impulses of a group of contacts in a collapse of balls that roll.

It does what :class:`pool_pymunk.physics.impulses.Shared` does without calls of a law, with the same
bits.
"""

from __future__ import annotations

from typing import Any

from pool_pymunk.fast.records import Work
from pool_pymunk.fast.walls import let_stand
from pool_pymunk.physics.contact import NO_BALL
from pool_pymunk.physics.impulses import explain
from pool_pymunk.physics.together import push_at_once


def share_out(w: Work, count: int) -> None:
    """Find the impulses of a group; those of least norm if one answer does not explain them all."""
    at, own, changes = w.instant, w.shared, False
    for m in range(count):
        at.group[m] = at.contact[at.member[m]]
        one = at.group[m]
        changes |= note_change(w, one.a, one.pair.m_a)
        if one.b != NO_BALL:
            changes |= note_change(w, one.b, one.pair.m_b)
    if changes and not explains_at_once(w, count):
        for m in range(count):
            put_lines(own, at.group[m], 2 * m)
        explain(own.line, 2 * count, own.momentum, own)
        for m in range(count):
            at.pushes[m], at.rest[m] = own.pushes[2 * m], own.pushes[2 * m + 1]
    for m in range(count):
        along = at.rest[m] if changes else 0.0
        first = along if at.group[m].b == NO_BALL else -along
        at.impulse[at.member[m]] = (at.pushes[m] if changes else 0.0, along, first)


def note_change(w: Work, i: int, mass: float) -> bool:
    """Note what momentum (N s) a ball has got in this round; tell whether it is any."""
    at, own = w.instant, w.shared
    x, y = at.velocity[i][0] - at.before[i][0], at.velocity[i][1] - at.before[i][1]
    own.trial[i] = (at.before[i][0], at.before[i][1])
    own.momentum[i] = (mass * x, mass * y)
    return bool(x != 0.0 or y != 0.0)


def explains_at_once(w: Work, count: int) -> bool:
    """Tell whether all impulses at once give the balls of a group the velocities that they have."""
    at, trial = w.instant, w.shared.trial
    is_so = push_at_once(at.group, count, trial, at)
    for m in range(count):
        for i in (at.group[m].a, at.group[m].b):
            if i != NO_BALL:
                is_so &= trial[i][0] == at.velocity[i][0] and trial[i][1] == at.velocity[i][1]
    return bool(is_so)


def put_lines(own: Any, one: Any, k: int) -> None:
    """Put the normal and the tangent of a contact into the lines, with masses of 1."""
    for n in (k, k + 1):
        own.line[n] = one
        let_stand(own.line[n])
        own.line[n].pair.m_a = own.line[n].pair.m_b = 1.0
    own.line[k + 1].normal[0], own.line[k + 1].normal[1] = -one.normal[1], one.normal[0]
