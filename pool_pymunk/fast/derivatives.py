"""This module follows small changes of the inputs through compiled shots, in a pass of its own.

It goes through a shot's breakpoints and contacts, as :mod:`pool_pymunk.studies.changes` goes
through the events of a run, with the same functions. Two kinds of shots are left to that module:
those that may have no derivative somewhere, and those that the exact solver has played in Python.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from pool_pymunk.fast import compiled
from pool_pymunk.fast.batch import CANNOT_START
from pool_pymunk.fast.doubts import (
    CAREFUL,
    NO_ONE,
    UNCLEAR,
    around,
    is_doubtful,
    largest,
    may_be_at_corner,
    may_touch,
    size_of,
)
from pool_pymunk.fast.due import may_roll, path_of, slows
from pool_pymunk.fast.kinds import (
    ball_ball,
    curvature,
    cushion,
    cushion_slopes,
    hit_slopes,
    jumps,
    normal,
)
from pool_pymunk.fast.loop import OUT_OF_TIME, read_shot
from pool_pymunk.fast.moves import nearest, path_from, put_path
from pool_pymunk.fast.records import NOTHING, Moving, Out, Tracks
from pool_pymunk.fast.shots import COLUMNS, OF_SURFACE, Floats, Source, is_gone
from pool_pymunk.fast.tables import table_of, walls_differ
from pool_pymunk.fast.walls import coefficients, owns
from pool_pymunk.model.inputs import Names, parts, starts_of
from pool_pymunk.model.scene import Scene
from pool_pymunk.physics import saltation
from pool_pymunk.physics.contact import NT, Pair, split
from pool_pymunk.physics.dual import BESIDE, STRAIGHT, WIDE
from pool_pymunk.physics.path import motion_at
from pool_pymunk.physics.saltation import AGREE, GRAZE, MOST, Geometry, is_now
from pool_pymunk.physics.surface import (
    longer,
    roll_at,
    roll_rate,
    slipped,
    slipping,
    slowed,
    slowing,
    without_slip,
)
from pool_pymunk.results.run import Run

# A follow has a record for one shot, the tracks of some shots, and arrays. The first arrays are
# what balls may touch: the sides of walls, the `first` side of each wall, and discs, faces and
# corners as `around` has them. Then come the changes by P inputs: of starts (S, N, K, P), masses
# (N, P), radii (N, P) and coefficients (7, P). A state has K numbers: place, velocity, and the
# roll if balls roll. Each ball then has the change of its state (N, K, P) at its last breakpoint,
# what it met there, the number of its breakpoints, and whether it is off the table. The last are of
# one contact: its balls (2), their motions (2, 6) and changes of velocities' parts (4, P), how late
# it comes (P), how far its normal turns (P), and the derivatives of the law (4, 8).
Follow = namedtuple(
    "Follow",
    "w tracks sides first discs faces corners starts of_mass of_radius of_coefficients "
    "change met at gone balls motion parts late turn law",
)


class Follower:
    """A follower watches shots, and works out the derivatives of their ends by ``names``.

    ``found`` (S, N, 2, P) has them. ``known`` (S,) marks the shots whose derivatives are there, and
    ``again`` (S,) those among them whose derivatives were worked out in Python.
    """

    replays = True  # A shot that is hard while its track is kept is played without one.

    def __init__(self, source: Source, names: Names, out: Out) -> None:
        self.source, self.names, self.out = source, names, out
        count, balls, _ = source.position.shape
        self.found = np.full((count, balls, 2, len(names)), math.nan)
        self.known = np.zeros(count, np.bool_)
        self.again = self.known.copy()
        self.around = _around(source.scene)
        self.latest = source.scene.physics.max_time

    def watch(self, part: slice, tracks: Tracks) -> None:
        """Follow the changes through these shots, as far as nothing in them is doubtful."""
        source, duration = self.source, self.out.duration[part]
        is_cut = (self.out.status[part] == OUT_OF_TIME) | (duration == self.latest)
        balls, count = len(source.scene.balls), len(self.names)
        inputs = _inputs(source, self.names, part)
        shapes = inputs[0].shape[1:], (2, 6), (4, count), (count,), (count,), (4, 8)
        changes, *others = (np.empty(shape) for shape in shapes)
        numbers = np.empty((3, balls), np.int64)
        room = (changes, *numbers, np.empty(2, np.int64), *others)
        g = Follow(source.work(keeps=True), tracks, *self.around, *inputs, *room)
        found, known = self.found[part], self.known[part]
        compiled.follow_shots(follow_shots)(g, source.shots(part), duration, is_cut, found, known)

    def see(self, k: int, run: Run) -> None:
        """Work out the derivatives of shot ``k``, which was not compiled."""
        self.found[k] = run.derivatives(self.names).final
        self.known[k] = self.again[k] = True

    def complete(self) -> None:
        """Work out the derivatives that are still missing, in Python."""
        for k in np.flatnonzero(~self.known & (self.out.status != CANNOT_START)).tolist():
            self.see(k, self.source.run(k, measures_policies=False))


def _inputs(source: Source, names: Names, part: slice) -> tuple[Floats, ...]:
    """Return what the inputs change in some shots, in the arrays of a follow."""
    scene, count, is_off = source.scene, len(names), is_gone(source.position[part])
    velocity, roll = (
        None if each is None else np.where(is_off[..., np.newaxis], 0.0, each[part])
        for each in (source.velocity, source.roll)
    )
    assert velocity is not None
    sizes = {key: np.zeros((len(scene.balls), count)) for key in ("mass", "radius")}
    coefficients = np.zeros((len(COLUMNS), count))
    for p, name in enumerate(names):
        kind, whose = parts(name)
        if kind in sizes:
            sizes[kind][scene.index[whose], p] = 1.0
        elif kind in COLUMNS:
            unit = scene.physics.gravity if kind in OF_SURFACE else 1.0
            coefficients[COLUMNS[kind], p] = unit
    struck = source.watched if source.watched >= 0 else None
    starts = starts_of(scene, names, struck, velocity, roll)
    if scene.restitution.cue_ball is None and "restitution.cue_ball" not in source.vary:
        coefficients[1] = coefficients[0]  # The cue ball is as any other.
    return starts, *sizes.values(), coefficients


def _around(scene: Scene) -> tuple[Any, ...]:
    """Return what balls may touch in a scene, in the arrays of a follow."""
    sides = table_of(scene, walls_differ(scene)).sides
    found = zip(around(scene), (5, 8, 6), strict=True)
    grids = (np.array(rows, float).reshape(-1, size) for rows, size in found)
    return sides, np.unique(sides.first), *grids


# -- what numba compiles ---------------------------------------------------------------------------


def follow_shots(g: Follow, shots: Any, duration: Any, is_cut: Any, found: Any, known: Any) -> int:
    """Follow changes through some shots; mark the ``known`` ones, and return their number."""
    count = first = begun = 0
    for s in range(len(known)):
        last, ended = g.tracks.ends[s, 0], g.tracks.ends[s, 1]
        if last > first:
            read_shot(g.w, shots, s)
            g.w.now, g.w.scene.latest = duration[s], duration[s] if is_cut[s] else math.inf
            start(g, g.starts[s], first)
            if follow_shot(g, first, last, begun, ended):
                known[s] = finish(g, found[s])
                count += known[s]
            if not known[s]:
                found[s] = math.nan
        first, begun = last, ended
    return count


def start(g: Follow, starts: Any, first: int) -> None:
    """Put the balls on their first paths, with the changes of their starts."""
    for i in range(g.w.scene.balls):
        g.at[i], g.gone[i] = -1, g.w.ball[i].is_off
        copy(starts[i], g.change[i])
        set_out(g, i, g.tracks.rows[first + i], NO_ONE)


def set_out(g: Follow, i: int, row: Any, met: int) -> None:
    """Put a ball on the path from its next breakpoint on, and note what it has met there."""
    path = path_from(g.w, row[1], (row[2], row[3]), (row[4], row[5]), (row[8], row[9]))
    put_path(g.w.ball[i], path)
    g.at[i] += 1
    g.met[i] = met


def follow_shot(g: Follow, first: int, last: int, begun: int, ended: int) -> bool:
    """Follow the changes from breakpoint to breakpoint; return False where one is doubtful."""
    breakpoints, k = g.tracks.rows, first + g.w.scene.balls
    while k < last:
        i, t, met, takes_in = int(breakpoints[k, 0]), breakpoints[k, 1], NO_ONE, False
        is_roll = begins_to_roll(g.w.ball[i], breakpoints[k])
        if not is_roll and not comes_to_rest(g.w.ball[i], breakpoints[k]):
            if begun == ended or g.tracks.contacts[begun, 0] != i:
                return False
            met = g.tracks.contacts[begun, 1]
            takes_in = met < 0 and g.sides[g.first[-1 - met]].pocket != NOTHING
            begun += 1
        g.balls[0], g.balls[1] = i, met if met >= 0 else i
        there = k + (met >= 0 or takes_in)
        is_there = (
            there < last and int(breakpoints[there, 0]) == g.balls[1] and breakpoints[there, 1] == t
        )
        if not is_there or is_doubtful(g, t, met):
            return False
        if is_roll:
            is_sound = rolls(g, i, breakpoints[k])
        elif met == NO_ONE:
            is_sound = rests(g, i, breakpoints[k])
        elif takes_in:
            is_sound = falls(g, i, breakpoints[k + 1], met)
        else:
            is_sound = meets(g, breakpoints, k, t, met)
        if not is_sound:
            return False
        k = there + 1
    return begun == ended


def comes_to_rest(ball: Moving, row: Any) -> bool:
    """Tell whether a ball rests at a breakpoint because its path ends there."""
    is_still = row[4] == 0.0 and row[5] == 0.0 and row[6] == 0.0 and row[7] == 0.0
    return bool(is_still and ball.end == row[1])


def begins_to_roll(ball: Moving, row: Any) -> bool:
    """Tell whether a ball that slid begins to roll at a breakpoint."""
    is_roll = row[4] == row[8] and row[5] == row[9] and not (row[4] == 0.0 and row[5] == 0.0)
    return bool(not slows(ball) and is_roll and ball.end == row[1])


def finish(g: Follow, found: Any) -> bool:
    """Write the changes of the ends into ``found``; return False if one is doubtful."""
    t = g.w.now
    for i in range(g.w.scene.balls):
        if may_touch(g, i, t, NO_ONE, NO_ONE):
            return False
        ball = g.w.ball[i]
        is_cut = g.w.scene.latest < math.inf
        if is_cut and is_now(ball.end, t, largest(g, i), size_of(g, i), UNCLEAR):
            return False
    for i in range(g.w.scene.balls):
        carry(g, i, t)
        copy(g.change[i, :2], found[i])
    return True


def copy(numbers: Any, there: Any) -> None:
    """Copy rows of numbers; for an assignment of arrays numba would allocate memory."""
    for row in range(numbers.shape[0]):
        for p in range(numbers.shape[1]):
            there[row, p] = numbers[row, p]


def carry(g: Follow, i: int, t: float) -> None:
    """Take a ball's change along its path, to a time (s)."""
    ball, change, scene = g.w.ball[i], g.change[i], g.w.scene
    if not slows(ball):
        slip_on(g, i, t)
    elif not may_roll(ball):
        numbers = slowing(ball.vx, ball.vy, t - ball.t, scene.pull)
        for p in range(change.shape[1]):
            pull = g.of_coefficients[3, p]
            change[0, p], change[1, p], change[2, p], change[3, p] = slowed(
                numbers, change[0, p], change[1, p], change[2, p], change[3, p], pull
            )
    elif t > ball.t:
        numbers = slowing(ball.vx, ball.vy, t - ball.t, scene.drag)
        for p in range(change.shape[1]):
            u, v = (
                without_slip(change[2, p], change[4, p]),
                without_slip(change[3, p], change[5, p]),
            )
            change[0, p], change[1, p], u, v = slowed(
                numbers, change[0, p], change[1, p], u, v, g.of_coefficients[6, p]
            )
            change[2, p] = change[4, p] = u
            change[3, p] = change[5, p] = v


def slip_on(g: Follow, i: int, t: float) -> None:
    """Take the change of a ball along its path while it slips, to a time (s)."""
    ball, own = g.w.ball[i], g.change[i]
    numbers = slipping(ball.vx, ball.vy, ball.roll[1], ball.roll[2], t - ball.t, g.w.scene.pull)
    for p in range(own.shape[1]):
        own[0, p], own[1, p], own[2, p], own[3, p], own[4, p], own[5, p] = slipped(
            numbers, own[0, p], own[1, p], own[2, p], own[3, p], own[4, p], own[5, p],
            g.of_coefficients[3, p],
        )  # fmt: skip


def rolls(g: Follow, i: int, row: Any) -> bool:
    """Let a ball begin to roll; return False where its change is too large."""
    ball, own, most = g.w.ball[i], g.change[i], 0.0
    ux, uy = ball.vx - ball.roll[1], ball.vy - ball.roll[2]
    for p in range(own.shape[1]):
        of_slip, pull = (own[2, p] - own[4, p], own[3, p] - own[5, p]), g.of_coefficients[3, p]
        g.late[p] = longer(ux, uy, g.w.scene.pull, of_slip[0], of_slip[1], pull)
    carry(g, i, row[1])
    for p in range(own.shape[1]):
        before, after = (ball.ax, ball.ay), (row[6], row[7])
        u, v = saltation.begins_to_roll(before, after, own[2, p], own[3, p], g.late[p])
        own[2, p] = own[4, p] = u
        own[3, p] = own[5, p] = v
        most = max(most, abs(own[0, p]), abs(own[1, p]), max(abs(u), abs(v)))
    set_out(g, i, row, NO_ONE)
    return most * CAREFUL < MOST


def rests(g: Follow, i: int, row: Any) -> bool:
    """Let a ball come to rest."""
    carry(g, i, row[1])
    g.change[i, 2:] = 0.0
    set_out(g, i, row, NO_ONE)
    return True


def falls(g: Follow, i: int, row: Any, met: int) -> bool:
    """Let a ball fall into a pocket, where it stays; return False if it grazes the rim."""
    x, y, vx, vy = motion_at(path_of(g.w.ball[i]), row[1])
    nx, ny = normal(g.sides[g.first[-1 - met]], x, y)
    g.change[i], g.gone[i] = 0.0, 1
    set_out(g, i, row, met)
    return bool(-(vx * nx + vy * ny) > CAREFUL * GRAZE * max(abs(vx), abs(vy)))


# -- contacts --------------------------------------------------------------------------------------


def meets(g: Follow, breakpoints: Any, k: int, t: float, met: int) -> bool:
    """Take changes through a contact, as `Changes` does; return False where it is doubtful."""
    i, count, fastest, size = g.balls[0], 1 if met < 0 else 2, 0.0, 0.0
    for n in range(count):
        carry(g, g.balls[n], t)
        ball, motion = g.w.ball[g.balls[n]], g.motion[n]
        x, y, vx, vy = motion_at(path_of(ball), t)
        motion[0], motion[1], motion[2], motion[3] = x, y, vx, vy
        motion[4], motion[5] = ball.ax, ball.ay
        fastest, size = max(fastest, abs(vx), abs(vy)), size + abs(x) + abs(y) + ball.radius
    a, b = six(g.motion[0]), six(g.motion[1])
    if met >= 0:
        geometry = saltation.hit(a, b)
    else:
        if may_be_at_corner(g.corners, a[0], a[1], g.w.ball[i].radius):
            return False
        side = g.sides[g.first[-1 - met]]
        side = nearest(g.sides, side, a[0], a[1], g.w.ball[i].radius)
        geometry = saltation.bounce(a, normal(side, a[0], a[1]), curvature(side, a[0], a[1]))
    if geometry.closing <= CAREFUL * GRAZE * fastest or geometry.depth <= UNCLEAR * size:
        return False
    move_on(g, geometry, count)
    for n in range(count):
        move_roll(g, g.balls[n], 1.0)
    if count == 2:
        is_sound = answer_hit(g, geometry, fastest, breakpoints, k)
    else:
        is_sound = answer_bounce(g, g.sides[g.first[-1 - met]], geometry, fastest, breakpoints[k])
    most = 0.0
    for n in range(count):
        row, change = breakpoints[k + n], g.change[g.balls[n]]
        rate = row[4], row[5], row[6], row[7]
        for p in range(change.shape[1]):
            place = change[0, p], change[1, p]
            own = g.parts[2 * n, p], g.parts[2 * n + 1, p]
            new = saltation.after(geometry, rate, place, own, g.turn[p], g.late[p])
            change[0, p], change[1, p], change[2, p], change[3, p] = new
        set_out(g, g.balls[n], row, g.balls[1 - n] if count == 2 else met)
        move_roll(g, g.balls[n], -1.0)
        for p in range(change.shape[1]):
            for m in range(change.shape[0]):
                most = max(most, abs(change[m, p]))
    return bool(is_sound and most * CAREFUL < MOST)


def move_roll(g: Follow, i: int, later: float) -> None:
    """Take the change of a ball's roll to a late contact; with ``later`` = -1 take it back."""
    ball, change = g.w.ball[i], g.change[i]
    if may_roll(ball):
        roll = ball.roll[1], ball.roll[2]
        ax, ay = roll_rate((ball.t, ball.x, ball.y, ball.vx, ball.vy, ball.ax, ball.ay, *roll))
        for p in range(change.shape[1]):
            change[4, p] += later * ax * g.late[p]
            change[5, p] += later * ay * g.late[p]


def six(motion: Any) -> Any:
    """Return a motion as a tuple."""
    return motion[0], motion[1], motion[2], motion[3], motion[4], motion[5]


def move_on(g: Follow, geometry: Geometry, count: int) -> None:
    """Work out how much later the contact comes, and the changes of states and velocities at it."""
    i, j = g.balls[0], g.balls[1]
    for p in range(len(g.late)):
        of_i, of_j = g.change[i], g.change[j if count == 2 else i]
        x, y, gap = of_i[0, p], of_i[1, p], -g.of_radius[i, p]
        if count == 2:
            x, y, gap = of_j[0, p] - x, of_j[1, p] - y, gap - g.of_radius[j, p]
        late = g.late[p] = saltation.lateness(geometry, x, y, gap)
        for n in range(count):
            own = g.change[g.balls[n]]
            change = own[0, p], own[1, p], own[2, p], own[3, p]
            own[0, p], own[1, p], own[2, p], own[3, p] = saltation.at_contact(
                six(g.motion[n]), change, late
            )
        x, y = of_i[0, p], of_i[1, p]
        if count == 2:
            x, y = of_j[0, p] - x, of_j[1, p] - y
        turn = g.turn[p] = saltation.turning(geometry, x, y)
        for n in range(count):
            own, velocity = g.change[g.balls[n]], (g.motion[n, 2], g.motion[n, 3])
            g.parts[2 * n, p], g.parts[2 * n + 1, p] = saltation.parts_before(
                geometry, velocity, own[2, p], own[3, p], turn
            )


def answer_hit(g: Follow, geometry: Geometry, fastest: float, breakpoints: Any, k: int) -> bool:
    """Answer a hit by the law's derivatives; return False where they are not known for sure."""
    i, j, scene = g.balls[0], g.balls[1], g.w.scene
    is_cue, masses = scene.cue in (i, j), (g.w.ball[i].mass, g.w.ball[j].mass)
    e = scene.cue_ball if is_cue else scene.ball_ball
    pair = Pair(masses[0], masses[1], e, scene.ball_friction)
    a = split((g.motion[0, 2], g.motion[0, 3]), geometry.normal)
    b = split((g.motion[1, 2], g.motion[1, 3]), geometry.normal)
    after_a, after_b = ball_ball(scene, a, b, pair)
    own, most = 0.5 * AGREE * fastest, max(abs(a.n), abs(a.t), max(abs(b.n), abs(b.t)))
    is_sound = is_answer(breakpoints[k], after_a, geometry, own)
    is_sound &= is_answer(breakpoints[k + 1], after_b, geometry, own)
    slip, of_a, of_b, wide = a.t - b.t, moves(g, 1), moves(g, 3), WIDE * BESIDE * max(fastest, most)
    turns_a = of_a and min(abs(slip), abs(a.t)) <= CAREFUL * wide
    turns_b = of_b and min(abs(slip), abs(b.t)) <= CAREFUL * wide
    if not is_sound or turns_a or turns_b or jumps(scene, a, b, pair):
        return False
    less = -wide if slip > 0.0 else wide
    t_a, t_b = (less, 0.0) if of_a else (0.0, -less if of_b else 0.0)
    more_a, more_b = ball_ball(scene, NT(a.n + wide, a.t + t_a), NT(b.n, b.t + t_b), pair)
    less_a, less_b = ball_ball(scene, NT(a.n - wide, a.t - t_a), NT(b.n, b.t - t_b), pair)
    bend = max(bend_of(more_a, after_a, less_a), bend_of(more_b, after_b, less_b))
    hit_slopes(scene, a, b, pair, g.law)
    for p in range(len(g.late)):
        own_e, mu = g.of_coefficients[1 if is_cue else 0, p], g.of_coefficients[5, p]
        answer_change(g, p, 4, (g.of_mass[i, p], g.of_mass[j, p], own_e, mu))
    return bend * CAREFUL <= STRAIGHT * most


def answer_bounce(g: Follow, side: Any, geometry: Geometry, fastest: float, row: Any) -> bool:
    """Answer a hit on a cushion by the law's derivatives; return False as for a hit of balls."""
    scene, (e, mu), (is_own, is_its) = g.w.scene, coefficients(side, g.w.scene), owns(side)
    v = split((g.motion[0, 2], g.motion[0, 3]), geometry.normal)
    after, most, slides = cushion(scene, v, e, mu), max(abs(v.n), abs(v.t)), moves(g, 1)
    wide = WIDE * BESIDE * max(fastest, most)
    is_sound = is_answer(row, after, geometry, 0.5 * AGREE * fastest)
    if not is_sound or (slides and abs(v.t) <= CAREFUL * wide):
        return False
    slower = (-wide if v.t > 0.0 else wide) if slides else 0.0
    more = cushion(scene, NT(v.n - wide, v.t + slower), e, mu)
    less = cushion(scene, NT(v.n + wide, v.t - slower), e, mu)
    cushion_slopes(scene, v, e, mu, g.law)
    roll = roll_at(path_of(g.w.ball[g.balls[0]]), row[1])
    for p in range(len(g.late)):
        before, of_e, of_mu = g.parts[0, p], g.of_coefficients[2, p], g.of_coefficients[4, p]
        of_e, of_mu = 0.0 if is_own else of_e, 0.0 if is_its else of_mu
        answer_change(g, p, 2, (of_e, of_mu))
        if may_roll(g.w.ball[g.balls[0]]):
            most, of_most = saltation.most_of_roll(mu, after.n - v.n, of_mu, g.parts[0, p] - before)
            own, turn = g.change[g.balls[0]], g.turn[p]
            own[4, p], own[5, p] = saltation.slowed_roll(
                geometry, roll, own[4, p], own[5, p], turn, most, of_most
            )
    return bend_of(more, after, less) * CAREFUL <= STRAIGHT * most


def answer_change(g: Follow, p: int, count: int, numbers: Any) -> None:
    """Multiply the changes of velocities' parts, and of the law's numbers, by the law's slopes."""
    law, parts = g.law, g.parts
    a, t, b, u = parts[0, p], parts[1, p], parts[2, p], parts[3, p]
    for m in range(count):
        total = law[m, 0] * a + law[m, 1] * t
        if count == 4:
            total += law[m, 2] * b + law[m, 3] * u
        for n in range(len(numbers)):
            total += law[m, count + n] * numbers[n]
        parts[m, p] = total


def is_answer(row: Any, answer: NT, geometry: Geometry, most: float) -> bool:
    """Tell whether a ball's new velocity is the law's answer, to ``most`` (m/s)."""
    n, t = split((row[4], row[5]), geometry.normal)
    return abs(n - answer.n) <= most and abs(t - answer.t) <= most


def moves(g: Follow, row: int) -> bool:
    """Tell whether an input changes this part of a velocity."""
    found = False
    for p in range(len(g.late)):
        found |= g.parts[row, p] != 0.0
    return found


def bend_of(more: NT, here: NT, less: NT) -> float:
    """Return how far three answers are from lying on a line (m/s)."""
    return max(abs(more.n - 2.0 * here.n + less.n), abs(more.t - 2.0 * here.t + less.t))
