"""This module lets small changes evolve with the motion of a ball, from event to event of a run.

It has the numbers of what is no contact, and of the reasons for which there is no derivative.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.physics import errors
from pool_pymunk.physics.columns import advance, advance_slowing, columns, warn
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.patches import patch_of
from pool_pymunk.physics.path import from_breakpoint, set_off
from pool_pymunk.physics.saltation import MOST, is_now
from pool_pymunk.physics.surface import (
    longer,
    rolling_on,
    slide_or_roll,
    slipping,
    slowing,
    stops_later,
)

# An event has its time, its ball, and what that meets: another ball, or a wall, which is -1 - its
# number; pockets come after the walls. Or the ball comes to rest, begins to roll, or comes OUT of
# all patches; into patch k it comes by OUT - 1 - k. From a row with LASTS on, which is no event, it
# is in a persistent contact.
STOP = -(1 << 30)
ROLL = STOP - 1
OUT = STOP - 3
LASTS = 2 * STOP
UNCHANGED = 7  # This row of `of_numbers` is 0.
ROUNDED = 64.0 * EPSILON  # of a unit of an input; rounding changes a gap by as much
ANYTHING = STOP - 2  # stands for all that a ball may meet

# why there is no derivative
REASONS = (
    "",
    "it was not known before",
    "contacts of one instant share a ball",
    "the run was cut off at a contact",
    "the run ends just at a contact",
    "a ball comes to rest just as it is hit, or just where it touches",
    "a contact is persistent, or answered by a policy",
    "a ball meets a cushion just where a corner begins",
    "a contact is a graze",
    "law {} jumps or has a kink",
    "a contact is answered by a policy",
    "a ball grazes the rim of a pocket",
    f"the derivatives have grown beyond {MOST:g}",
    "a path touches what it does not hit",
    "balls touch at the start",
    "law {} has a kink, as between sticking and slipping",
    "a ball stops at contact, so the time of its stop has a kink",
    "a contact is persistent",
    "a ball comes to rest just as the run ends",
    "errors grow until other contacts may come",
    "a ball grazes the border of a patch, or starts at one",
)
(
    FOLLOWED, KNOWN_BEFORE, SHARED, CUT_OFF, ENDS_THERE, RESTS_THERE, PERSISTS, AT_CORNER,
    IS_GRAZE, JUMPS, BY_POLICY, AT_RIM, GROWN, TOUCHES, TOUCH_FIRST, BENT, STOPPED, GOES_ON,
    RESTS_LAST, CHAOS, AT_BORDER,
) = range(len(REASONS))  # fmt: skip


def is_at(g: Any, t: float, now: float, i: int, j: int) -> bool:
    """Tell whether a time (s) is that of an instant, to rounding, in the motion of two balls."""
    fastest = size = 0.0
    for n in (i, j):
        row = g.rows[g.ball[n].at]
        fastest = max(fastest, max(abs(row[4]), abs(row[5])))
        size = max(size, abs(row[2]) + abs(row[3]) + g.ball[n].radius)
    return is_now(t, now, fastest, size)


def end_of(g: Any, row: Any, until: float) -> float:
    """Return when (s) the path of a breakpoint ends; until a time (s) it crosses no border."""
    pull, drag, _, _ = friction_of(g, row, until)
    t, place, velocity = row[1], (row[2], row[3]), (row[4], row[5])
    if len(g.change[0]) > 4:
        return slide_or_roll(t, place, velocity, (row[8], row[9]), pull, drag).end
    return set_off(t, place, velocity, pull).end


def friction_of(g: Any, row: Any, until: float) -> tuple[float, float, int, int]:
    """Return the decelerations (m/s^2) of sliding and rolling on the path of a breakpoint.

    Until a time (s) the path crosses no border. The last two numbers are the rows of ``of_numbers``
    by which the inputs change the decelerations.
    """
    pull, drag, of_pull, of_drag = g.one.numbers[3], g.one.numbers[6], 3, 6
    if len(g.borders) > 0:
        path = from_breakpoint(row[1], row[2], row[3], row[4], row[5], row[6], row[7])
        patch = patch_of(g.borders, len(g.borders), path, row[1], until)
        if patch >= 0 and g.ground[patch][0] >= 0.0:
            pull, of_pull = g.ground[patch][0], UNCHANGED
        if patch >= 0 and g.ground[patch][1] >= 0.0:
            drag, of_drag = g.ground[patch][1], UNCHANGED
    return pull, drag, of_pull, of_drag


def is_sliding(row: Any, size: int) -> bool:
    """Tell whether a ball slides from a breakpoint on, and does not roll."""
    return size == 4 or row[4] != row[8] or row[5] != row[9]


def move(g: Any, i: int, t: float) -> None:
    """Take the change of a ball along its path to a time (s), with the errors that this makes."""
    carry(g, g.rows[g.ball[i].at], g.change[i], t)
    errors.misplace(g, i, t)


def carry(g: Any, row: Any, own: Any, t: float) -> None:
    """Take a change from a breakpoint along the path to a time (s)."""
    vx, vy, time = row[4], row[5], t - row[1]
    pull, drag, of_pull, of_drag = friction_of(g, row, t)
    if len(own) == 4:
        by_state, by_pull = slowing(vx, vy, time, pull)
        advance_slowing(g, own, by_state, by_pull, g.of_numbers[of_pull])
    elif is_sliding(row, len(own)):
        by_state, by_pull = slipping((vx - row[8], vy - row[9]), time, pull)
        advance(g, own, by_state, by_pull, g.of_numbers[of_pull])
    elif time > 0.0:
        by_state, by_pull = rolling_on(vx, vy, time, drag)
        advance(g, own, by_state, by_pull, g.of_numbers[of_drag])


def note_end(g: Any, i: int, t: float) -> None:
    """Note how much later than at ``t`` (s) the path of a ball ends, by the change at its start."""
    row, own, of_numbers = g.rows[g.ball[i].at], g.change[i], g.of_numbers
    vx, vy, (pull, drag, of_pull, of_drag) = row[4], row[5], friction_of(g, row, t)
    for p in columns(g):
        u, v = own[2, p], own[3, p]
        if len(own) == 4:
            g.late[p] = stops_later(vx, vy, pull, u, v, of_numbers[of_pull, p])
        elif not is_sliding(row, len(own)):
            g.late[p] = stops_later(vx, vy, drag, u, v, of_numbers[of_drag, p])
        else:
            u, v = u - own[4, p], v - own[5, p]
            g.late[p] = longer(vx - row[8], vy - row[9], pull, u, v, of_numbers[of_pull, p])


def come_to(g: Any, i: int, t: float) -> None:
    """Go on to a ball's last breakpoint of this time."""
    while g.following[g.ball[i].at] >= 0 and g.rows[g.following[g.ball[i].at]][1] <= t:
        g.ball[i].at, g.ball[i].met = g.following[g.ball[i].at], STOP


def lose(g: Any, why: int, i: int, j: int, t: float) -> None:
    """Note that two balls have no derivatives from ``t`` (s) on, and why."""
    if why != KNOWN_BEFORE:
        warn(g, why, t)
    for n in (i, j):
        for p in columns(g):
            for k in range(len(g.change[n])):
                g.change[n, k, p] = math.nan
        come_to(g, n, t)
