"""A group in persistent contact is played in pieces, by a method of high order.

A mode ends where a measure falls to 0: a force, what friction has left, a slip, what holds a ball,
or the distance to the end of a side. A slip or a speed that fades ends it, too. A piece ends there,
or where two parabolas would deviate too far from it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pool_pymunk.physics.complementarity import (
    FADED,
    SLOW,
    begin_to_roll,
    put_to_rest,
    set_free,
    set_phases,
    spare_hold,
)
from pool_pymunk.physics.forces import find_forces, is_own, solve
from pool_pymunk.physics.motion import Vector
from pool_pymunk.physics.pressed import (
    LET_GO,
    MOST_STEPS,
    NEAR,
    REST,
    ROLL,
    SLIP,
    STUCK,
    energy_of,
    gap_of,
    is_driven,
    look,
    opening,
    roll_into,
    room,
    set_time,
    sign,
    smallest,
    wrings,
)
from pool_pymunk.physics.surface import GYRATION, SHARE

# This is the method of Dormand and Prince, of order five, and its difference to that of order four
# (J. Comp. Appl. Math. 6, 1980, 19). Its last stage is its end.
STAGES = (
    (1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0),
    (3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0),
    (44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
TIMES = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)  # of the stages, as shares of the step
SPREAD = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
# A piece is short enough that two parabolas deviate from it by less than this share of a radius. If
# the acceleration changes by J in a piece of h (s), they deviate by J h^2 / 324.
DEVIATION = 4e-9
GROWTH = 3.0  # A piece is at most so many times as long as the one before.
EVEN = 1e-12  # radii; where one parabola ends nearer to its piece's end, two are not needed
ERROR = 1e-9  # of the largest speed of a group; a step errs by less, by its estimate
MOST_HALVINGS = 60  # The end of a piece is looked for so often; seven times are usual.


def step(g: Any, s: Any, h: float, end: Any) -> float:
    """Let ``end`` be the state a time h (s) later, in the same mode; return its error (m, m/s).

    ``g`` has the forces of the state first, and those of the end at last. Its ``total`` (N s)
    becomes the impulses of the forces: along the normal, and as x and y.
    """
    g.at[1] = g.at[0]
    look(g, s)
    keep_stage(g, 0)
    for stage in range(1, len(SPREAD)):
        weights = STAGES[stage - 1]
        for p in range(6 * g.balls):
            x = s[p]
            for q in range(stage):
                x += h * weights[q] * g.rates[q][p]
            end[p] = x
        g.at[1] = g.at[0] + TIMES[stage - 1] * h
        if stage == len(STAGES):
            close(g, end)
        find_forces(g, end)
        keep_stage(g, stage)
    weights = STAGES[len(STAGES) - 1]
    for k in range(g.contacts):
        for kind in range(3):
            much = 0.0
            for q in range(len(STAGES)):
                much += h * weights[q] * g.forces[q][k][kind]
            g.total[k][kind] = much
    error = 0.0
    for p in range(6 * g.balls):
        wrong = 0.0
        for q in range(len(SPREAD)):
            wrong += SPREAD[q] * g.rates[q][p]
        error = max(error, abs(h * wrong))
    return error


def keep_stage(g: Any, stage: int) -> None:
    """Keep the present rates as those of a stage, and of each contact N and its force (N)."""
    rates = g.rates[stage]
    for p in range(6 * g.balls):
        rates[p] = g.rate[p]
    for k in range(g.contacts):
        normal, along, nx, ny = g.force[k][0], g.force[k][1], g.normal[k][0], g.normal[k][1]
        force = g.forces[stage][k]
        force[0], force[1], force[2] = normal, normal * nx - along * ny, normal * ny + along * nx


def close(g: Any, s: Any) -> None:
    """Close the gaps that a step has left open by its error, and keep rolling balls rolling."""
    look(g, s)
    for i in range(g.balls):
        if g.phase[i] == ROLL:
            s[6 * i + 4], s[6 * i + 5] = s[6 * i + 2], s[6 * i + 3]
    count = 0
    for k in range(g.contacts):
        if g.on[k] and moves(g, k):
            g.chosen[count] = k
            count += 1
    for p in range(count):
        k = g.chosen[p]
        g.matrix[p][count], g.matrix[p][count + 1] = -gap_of(g, s, k), -opening(g, s, k)
        for q in range(count):
            m = g.chosen[q]
            g.matrix[p][q] = g.unit[m] * shared(g, k, m)
    solve(g, count, count + 1)
    for p in range(count):
        k = g.chosen[p]
        shift(g, s, k, g.unit[k] * g.matrix[p][count], (0, 0))
        shift(g, s, k, g.unit[k] * g.matrix[p][count + 1], (2, 0))


def join(g: Any, s: Any, least: float) -> None:
    """Let all sides move together that part or close; ``total`` has the impulses (N s).

    With the hit before, this is a hit of restitution 0: it gives the friction back, too, of what
    the hit has pushed too much. Slips are none that are not larger than ``least`` (m/s).
    """
    set_phases(g, s)
    look(g, s)
    clear_total(g)
    push_together(g, s)
    for k in range(g.contacts):
        i, much = g.one[k], g.mu[k] * g.total[k][0]
        if abs(g.slip[k]) > least:
            rub = -math.copysign(much, g.slip[k])
            g.total[k][1] -= rub * g.normal[k][1]
            g.total[k][2] += rub * g.normal[k][0]
            shift(g, s, k, rub, (2, 1))
        if wrings(g, k):
            into = roll_into(g, s, k)
            part = -math.copysign(min(much / (GYRATION * g.mass[i]), abs(into)), into)
            s[6 * i + 4] += part * g.normal[k][0]
            s[6 * i + 5] += part * g.normal[k][1]
    push_together(g, s)


def clear_total(g: Any) -> None:
    """Forget the impulses."""
    for k in range(g.contacts):
        g.total[k][0] = g.total[k][1] = g.total[k][2] = 0.0


def push_together(g: Any, s: Any) -> None:
    """Take away the speeds at which sides part, by impulses along the normals."""
    count = g.contacts
    for p in range(count):
        g.matrix[p][count] = -opening(g, s, p)
        for q in range(count):
            g.matrix[p][q] = g.unit[q] * shared(g, p, q)
    solve(g, count, count)
    for p in range(count):
        much = g.unit[p] * g.matrix[p][count]
        g.total[p][0] += much
        g.total[p][1] += much * g.normal[p][0]
        g.total[p][2] += much * g.normal[p][1]
        shift(g, s, p, much, (2, 0))


def moves(g: Any, k: int) -> bool:
    """Tell whether a ball of a contact moves."""
    return bool(g.phase[g.one[k]] != REST or (g.other[k] >= 0 and g.phase[g.other[k]] != REST))


def sign_in(g: Any, k: int, i: int) -> float:
    """Return the sign with which a contact pushes a moving ball along its normal, or 0."""
    if g.phase[i] == REST:
        return 0.0
    if i == g.other[k]:
        return 1.0
    if i != g.one[k]:
        return 0.0
    return 1.0 if g.other[k] < 0 else -1.0


def lightness(g: Any, i: int) -> float:
    """Return how much (1/kg) a weak push moves a ball; one that rolls goes on rolling."""
    return float((1.0 - SHARE if g.phase[i] == ROLL else 1.0) / g.mass[i])


def shared(g: Any, k: int, m: int) -> float:
    """Return by how much (1/kg) a push along one contact opens another one."""
    i, j = g.one[k], g.other[k]
    part = sign_in(g, k, i) * sign_in(g, m, i) * lightness(g, i)
    if j >= 0:
        part += sign_in(g, k, j) * sign_in(g, m, j) * lightness(g, j)
    if part == 0.0:
        return 0.0
    return float(part * (g.normal[k][0] * g.normal[m][0] + g.normal[k][1] * g.normal[m][1]))


def shift(g: Any, s: Any, k: int, much: float, how: tuple[int, int]) -> None:
    """Move the balls of a contact apart, or change their velocities.

    ``how`` is 0 or 2 for places or velocities, and 0 or 1 for the normal or the tangent.
    """
    first, is_along = how
    nx, ny = g.normal[k][0], g.normal[k][1]
    if is_along:
        nx, ny = -ny, nx
    for i in (g.one[k], g.other[k]):
        if i >= 0:
            part, p = sign_in(g, k, i) * much * lightness(g, i), 6 * i + first
            s[p], s[p + 1] = s[p] + part * nx, s[p + 1] + part * ny
            if first and g.phase[i] == ROLL:
                s[p + 2], s[p + 3] = s[p], s[p + 1]


def measure(g: Any, s: Any, found: Any) -> None:
    """Find the numbers that end the mode where they fall through 0; infinite if there is none.

    Four numbers of each contact are its force, what friction or the slip has left, the same of the
    roll into a wall, and how far it is to the side's end. One of each ball is what holds it.
    """
    for k in range(g.contacts):
        force = slips = rolls_in = end = math.inf
        if g.on[k] and moves(g, k):
            p, unit, most = 6 * g.one[k], g.unit[k], g.mu[k] * g.force[k][0]
            force, end = g.force[k][0] / unit, room(g, k, s[p], s[p + 1])
            if g.slides[k]:
                slips = g.slides[k] * g.slip[k]
            elif most > 0.0:
                slips = (most - abs(g.force[k][1])) / unit
            if wrings(g, k) and g.phase[g.one[k]] == SLIP:
                if g.into[k]:
                    rolls_in = g.into[k] * roll_into(g, s, k)
                else:
                    rolls_in = (most / GYRATION - abs(g.force[k][2])) / unit
        m = 4 * k
        found[m], found[m + 1], found[m + 2], found[m + 3] = force, slips, rolls_in, end
    for i in range(g.balls):
        found[4 * g.contacts + i] = spare_hold(g, i)


def slack_of(g: Any, which: int) -> float:
    """Return how far below 0 a measure may be by rounding."""
    k, kind = which // 4, which % 4
    if k >= g.contacts or kind == 0:
        return float(10.0 * g.small[1])
    if kind == 3:
        return float(NEAR * g.radius[g.one[k]])
    is_speed = g.slides[k] if kind == 1 else g.into[k]
    return float(g.small[0] if is_speed else 10.0 * g.small[1])


def change(g: Any, s: Any, which: int) -> None:
    """Change the mode where a measure has fallen to 0."""
    k, kind = which // 4, which % 4
    look(g, s)
    if k >= g.contacts:
        set_free(g, s, which - 4 * g.contacts)
        close(g, s)
    elif kind in (0, 3):
        g.on[k], g.over[k] = 0, int(kind == 3)
    elif kind == 1:
        was, slip = g.slides[k], sign(g.slip[k], g.small[0])
        g.slides[k] = fallen(was, slip) if was else (-1 if g.force[k][1] > 0.0 else 1)
    else:
        was, slip = g.into[k], sign(roll_into(g, s, k), g.small[0])
        g.into[k] = fallen(was, slip) if was else (-1 if g.force[k][2] > 0.0 else 1)


def fallen(was: int, now: int) -> int:
    """Return the sign of a slip that has fallen to 0, although rounding may keep the old sign."""
    return 0 if now == was else now


def fading(g: Any, s: Any, i: int) -> tuple[float, float]:
    """Return the slip (m/s) of a ball, or its speed where it rolls, and in what time (s) it is 0.

    The time is infinite if it does not fade. Where contacts hold a ball that was let go, its speed
    neither grows nor falls: it has faded, too.
    """
    p, d = 6 * i, g.rate
    if g.phase[i] == REST or is_own(g):
        return 0.0, math.inf
    x, y, a, b = s[p + 2], s[p + 3], d[p + 2], d[p + 3]
    if g.phase[i] == SLIP:
        x, y, a, b = x - s[p + 4], y - s[p + 5], a - d[p + 4], b - d[p + 5]
    size = math.sqrt(x * x + y * y)
    if size <= FADED * g.small[2] * g.small[0] and max(abs(a), abs(b)) <= g.small[1]:
        return size, 0.0
    loss = -(x * a + y * b)
    return size, size * size / loss if loss > 0.0 else math.inf


class Piece(NamedTuple):
    """A piece has a length (s), and how long (s) the next one may be.

    ``fell`` is the measure that ends the mode at its end, or -1; ``faded`` tells whether a slip or
    a speed has faded.
    """

    time: float
    next: float
    fell: int
    faded: bool


def creeps(g: Any, s: Any, i: int) -> bool:
    """Tell whether the slip of a ball, or its speed where it rolls, is hardly more than none."""
    p = 6 * i
    x, y = s[p + 2], s[p + 3]
    if g.phase[i] == SLIP:
        x, y = x - s[p + 4], y - s[p + 5]
    return bool(math.sqrt(x * x + y * y) <= slowest(g))


def slowest(g: Any) -> float:
    """Return the speed (m/s) below which a ball rests that was let go, and has not set off."""
    return float(10.0 * FADED * g.small[2] * g.small[0])


def piece_of(g: Any, longest: float) -> Piece:
    """Play a piece of the motion from ``state`` to ``end``.

    Its first step is no longer than a time (s). Steps in which the balls move evenly are one piece:
    a slip that fades takes many. ``total`` becomes the impulses.
    """
    begin_steps(g)
    one = step_of(g, longest)
    add_impulses(g)
    time, after = one.time, one.next
    while g.steps < MOST_STEPS and one.time > 0.0 and one.fell < 0 and is_even(g, time):
        keep_stop(g, time)
        one = step_of(g, after)
        if one.time > 0.0 and not is_even(g, time + one.time):
            g.steps -= 1
            copy(g, (g.here, g.so_far), (g.end, g.total))
            return Piece(time, after, -1, False)
        add_impulses(g)
        time, after = time + one.time, one.next
    return Piece(time, after, one.fell, one.faded)


def part_of(g: Any, steps: int, longest: float, time: float) -> None:
    """Let ``end`` and ``total`` be those at a time (s) of a piece that had so many steps."""
    begin_steps(g)
    past = 0.0
    while g.steps < steps:
        one = step_of(g, longest)
        if past + one.time >= time:
            break
        add_impulses(g)
        past, longest = past + one.time, one.next
        keep_stop(g, past)
    find_forces(g, g.here)
    step(g, g.here, time - past, g.end)
    add_impulses(g)


def begin_steps(g: Any) -> None:
    """Begin the steps of a piece."""
    set_time(g, g.at[2])
    g.steps = 1
    for p in range(6 * g.balls):
        g.here[p] = g.state[p]
    for k in range(g.contacts):
        g.so_far[k][0] = g.so_far[k][1] = g.so_far[k][2] = 0.0


def keep_stop(g: Any, time: float) -> None:
    """Let the end of a step, at a time (s) of the piece, be the start of the next one."""
    g.stop_t[g.steps - 1] = time
    g.at[0] = g.at[1] = g.at[2] + time
    stop = g.stop[g.steps - 1]
    g.steps += 1
    for p in range(6 * g.balls):
        g.here[p] = stop[p] = g.end[p]


def add_impulses(g: Any) -> None:
    """Add the impulses of a step to those of its piece; ``total`` becomes those of the piece."""
    for k in range(g.contacts):
        for kind in range(3):
            g.so_far[k][kind] += g.total[k][kind]
            g.total[k][kind] = g.so_far[k][kind]


def step_of(g: Any, longest: float) -> Piece:
    """Play a step of a piece from ``here`` to ``end``, no longer than a time (s).

    ``total`` becomes its impulses.
    """
    s, end = g.here, g.end
    g.at[1] = g.at[0]
    clear_total(g)
    find_forces(g, s)
    measure(g, s, g.before)
    copy(g, (g.rate, g.force), (g.first, g.held))
    fades = math.inf
    for i in range(g.balls):
        size, time = fading(g, s, i)
        if time < math.inf and size <= FADED * g.small[2] * g.small[0]:
            return Piece(0.0, longest, -1, True)
        fades = min(fades, time)
    h = min(longest, (0.6 if 10.0 * fades > longest else 0.999) * fades)
    share, grows = share_of(g, h, step(g, s, h, end)), GROWTH
    while share < 1.0:  # Numbers that are not finite end it, too.
        longest = h = h * max(0.2, 0.9 * share)
        recall(g)
        share, grows = share_of(g, h, step(g, s, h, end)), 1.0
    measure(g, end, g.after)
    which = first_to_fall(g)
    if which < 0:
        lose(g, s, end)
        return Piece(h, max(longest, h) * min(grows, 0.9 * share), -1, False)
    t, which = time_of_fall(g, h, which)
    recall(g)
    if t == 0.0:
        clear_total(g)
        for p in range(6 * g.balls):
            end[p] = s[p]
        return Piece(0.0, longest, which, False)
    step(g, s, t, end)
    lose(g, s, end)
    return Piece(t, longest, which, False)


def time_of_fall(g: Any, h: float, which: int) -> tuple[float, int]:
    """Return when (s) a measure falls to 0 within a step, and which one falls first.

    It is found by the Illinois method; the answer is not before the fall.
    """
    low, high, m_low, was_high = 0.0, h, g.before[which], True
    m_high = g.after[which]
    for _ in range(MOST_HALVINGS):
        slack = slack_of(g, which)
        if m_low <= slack and low == 0.0:
            return 0.0, which
        if abs(m_high) <= slack or high - low <= 1e-14 * h:
            break
        t = low + (high - low) * m_low / (m_low - m_high)
        recall(g)
        step(g, g.here, t, g.end)
        measure(g, g.end, g.after)
        now = first_to_fall(g)
        if now >= 0 and now != which:
            which, low, m_low = now, 0.0, g.before[now]
        is_high = now >= 0 or g.after[which] <= slack_of(g, which)
        if is_high:
            high, m_high = t, g.after[which]
            m_low /= 2.0 if was_high else 1.0
        else:
            low, m_low = t, g.after[which]
            m_high /= 1.0 if was_high else 2.0
        was_high = is_high
    return high, which


def recall(g: Any) -> None:
    """Let a press have the rates and the forces again that it had at the start of a step."""
    copy(g, (g.first, g.held), (g.rate, g.force))


def copy(g: Any, source: tuple[Any, Any], target: tuple[Any, Any]) -> None:
    """Copy numbers of a state, or of its rates, and three numbers of each contact."""
    (state, of_contacts), (to_state, to_contacts) = source, target
    for p in range(6 * g.balls):
        to_state[p] = state[p]
    for k in range(g.contacts):
        for kind in range(3):
            to_contacts[k][kind] = of_contacts[k][kind]


def share_of(g: Any, h: float, error: float) -> float:
    """Return how many times as long a step could be whose length is h (s).

    Square roots have the same bits on every machine. They are on the safe side: deviations grow
    with the third power of a step, and errors with the fifth.
    """
    jump, share = 0.0, math.inf
    for i in range(g.balls):
        for p in (6 * i + 2, 6 * i + 3):
            jump = max(jump, abs(g.rate[p] - g.first[p]))
    deviates = jump * h * h / 324.0
    if deviates > 0.0:
        share = DEVIATION * g.small[2] * smallest(g) / deviates
        share = math.sqrt(share) if share < 1.0 else math.sqrt(math.sqrt(share))
    if error > 0.0:
        most = ERROR / SLOW * g.small[2] * g.small[0]
        share = min(share, math.sqrt(math.sqrt(most / error)))
    return share


def first_to_fall(g: Any) -> int:
    """Return the measure that falls through 0 first, by straight lines; -1 if none does."""
    soonest, found = math.inf, -1
    for q in range(4 * g.contacts + g.balls):
        if g.after[q] < -slack_of(g, q):
            start = max(g.before[q], 0.0)
            when = start / (start - g.after[q])
            if when < soonest:
                soonest, found = when, q
    return found


def lose(g: Any, s: Any, end: Any) -> None:
    """Take away energy that a step has gained by its error; walls that move may give some."""
    if is_driven(g):
        return
    before, after = energy_of(g, s), energy_of(g, end)
    if after > before:
        share = math.sqrt(before / after)
        for i in range(g.balls):
            for p in range(6 * i + 2, 6 * i + 6):
                end[p] *= share


def settle(g: Any, s: Any) -> None:
    """Let balls roll or rest whose slip or speed has faded."""
    least = slowest(g)
    for i in range(g.balls):
        size, time = fading(g, s, i)
        if g.phase[i] == REST or size > least or time == math.inf:
            continue
        if g.phase[i] == SLIP and g.rolls:
            begin_to_roll(g, s, i)
            size, time = fading(g, s, i)
        if size <= least:
            put_to_rest(g, s, i)
            g.stuck[i] = STUCK if g.stuck[i] == LET_GO else 0
    close(g, s)


def hold(g: Any, s: Any, i: int) -> None:
    """Let a ball roll or rest again that was let go, for a piece."""
    if g.phase[i] == SLIP and g.rolls:
        begin_to_roll(g, s, i)
    else:
        put_to_rest(g, s, i)
    g.stuck[i] = STUCK


def is_even(g: Any, h: float) -> bool:
    """Tell whether the balls move evenly in the piece of length h (s) in the press.

    One parabola a ball, with the mean acceleration, then ends at the place of its state.
    """
    s, end, off = g.state, g.end, 0.0
    for i in range(g.balls):
        for p in (6 * i, 6 * i + 1):
            off = max(off, abs(end[p] - s[p] - h * (s[p + 2] + end[p + 2]) / 2.0))
    return bool(off <= EVEN * smallest(g))


def halves(g: Any, h: float, i: int) -> tuple[Vector, Vector]:
    """Return the accelerations (m/s^2) of the two halves of a ball's piece of length h (s).

    With them place and velocity at its end are those of the state there.
    """
    s, end, p = g.state, g.end, 6 * i
    mean_x, mean_y = (end[p + 2] - s[p + 2]) / h, (end[p + 3] - s[p + 3]) / h
    x = 4.0 * ((end[p] - s[p]) / h - s[p + 2]) / h - mean_x
    y = 4.0 * ((end[p + 1] - s[p + 1]) / h - s[p + 3]) / h - mean_y
    return (x, y), (2.0 * mean_x - x, 2.0 * mean_y - y)
