"""This module lets small changes go through a run whose contacts persist now and then.

Between and at its events changes go as in :mod:`pool_pymunk.physics.changes`. A group in persistent
contact has pieces, and its mode changes at the end of some. If that comes later by dt, a change of
the state is larger by dt times what the rates lose there: the saltation of a mode that ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from pool_pymunk.engine.recorder import Begun
from pool_pymunk.physics import changes, columns, contact_changes, motion_changes, pieces
from pool_pymunk.physics.complementarity import FADED, SLOW
from pool_pymunk.physics.forces import find_forces
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.motion_changes import FOLLOWED, OUT, STOP, UNCHANGED
from pool_pymunk.physics.patches import normal_at
from pool_pymunk.physics.path import motion_at
from pool_pymunk.physics.persistent import UNSEEN
from pool_pymunk.physics.persistent_changes import (
    Course,
    Numbers,
    fades_later,
    falls_later,
    gaps,
    joined,
    rate_of,
    settled,
    slip_of,
)
from pool_pymunk.physics.pressed import REST, SLIP, size_of
from pool_pymunk.physics.pressed import ROLL as ROLLS
from pool_pymunk.results.run import Run

# Rates that differ by less than this share of the strongest one do not jump.
STEADY = 1e-7
# Delays that differ by less than this share, and gaps of this share of all changes at the start,
# are the same.
SAME, SHUT = 1e-4, 1e-6
NO_GAP, NO_DELAY = 1e-9, 1e-9  # m, s by the unit of an input
FADES = 3e-7  # of the largest speed of a group; a slip that fades has faded to first order
# A slip that turns until it has faded depends on inputs in no smooth manner. Then changes across it
# are more than this share of all changes of it.
ASTRAY = 1e-2
FEEBLE = 1e-5  # of the balls' speeds; hits that close more slowly are none before a group begins
UNLISTED = 1e-4  # of the balls' speeds; hits that are not listed change velocities by more
FAINT = 1e-4  # of all changes; bounces that are left out leave gaps of less


class ModeChanges:
    """A group in one mode has changes ``z`` (6 N, P) at the beginning of its motion, or its end.

    Just before a slip of it has faded, and its direction is rounding, they become those of a state
    that is as much ``later`` (s) as the slip fades later (``is_late``).
    """

    def __init__(self, g: Any, piece: Begun) -> None:
        press = piece.press
        self.press, self.first, self.last, self.balls = press, piece, piece, piece.balls
        self.course = Course(press, piece.since, piece.state)
        self._stop(piece)
        self.numbers = numbers_of(g, piece)
        self.state, self.rate = piece.state, rate_of(press, piece.state)
        self.z = np.zeros((len(self.state), len(g.late)))
        self.until = -1.0  # s; the motion was followed until then
        self.later: Array | None = None  # (P,), how much later the mode ends
        self.fading: list[int] = []
        self.why = motion_changes.TWICE  # why it is not known
        self.is_late = self.is_over = False

    def rows(self, i: int) -> slice:
        """Return where a ball stands in the state."""
        k = self.balls.index(i)
        return slice(6 * k, 6 * k + 6)

    def goes_on(self, piece: Begun) -> bool:
        """Tell whether a piece goes on in the same mode, and go on with it if so."""
        last = self.last
        if piece.press is not last.press or last.fell >= 0 or last.faded:
            return False
        self.last = piece
        self.course.go_on(piece.since, piece.state)
        self._stop(piece)
        return True

    def _stop(self, piece: Begun) -> None:
        """Let the course go on in the steps of a piece."""
        for t, state in piece.stops:
            self.course.go_on(t, state)

    def end(self, t: float) -> None:
        """Follow the motion until a time (s)."""
        last, course, g = self.last, self.course, self.press
        self.is_over = t >= last.until and (last.faded or last.fell >= 0)
        fades = t
        if self.is_over:
            least = 10.0 * FADED * g.small[2] if last.faded else FADES / SLOW
            self.fading = fading_in(g, course.at(t), least * g.small[0])
            fades = self._fades(t) if self.fading else t
        self.z = course.evolve(self.z, (self.first.since, fades), self.numbers)
        if self.fading:
            self._go_late(fades)
            numbers = self.numbers._replace(steady=tuple(self.fading))
            self.z = course.evolve(self.z, (fades, t), numbers)
        self.until, self.state = t, course.at(t)
        self.rate = rate_of(g, self.state)
        if self.is_over and not self.is_late:
            self.later = falls_later(g, self.state, self.rate, self.z, last.fell)

    def _fades(self, t: float) -> float:
        """Return when (s) a slip is next to nothing."""
        least, course = FADES * self.press.small[0] / SLOW, self.course
        times, states = [*course.starts, t], [*course.states, course.at(t)]
        sizes = [min(size_of(*slip_of(self.press, s, i)) for i in self.fading) for s in states]
        k = next(k for k, size in enumerate(sizes) if size <= least or k == len(sizes) - 1)
        if k == 0 or sizes[k] > least:
            return times[k]
        share = (sizes[k - 1] - least) / (sizes[k - 1] - sizes[k])
        return float(times[k - 1] + share * (times[k] - times[k - 1]))

    def _go_late(self, t: float) -> None:
        """Go on with the changes of a state that is later, as the slip fades later."""
        g, s = self.press, self.course.at(t)
        rate = rate_of(g, s)
        before = self.z
        times = np.array([fades_later(g, s, rate, self.z, i) for i in self.fading])
        size, self.later = np.abs(times).max(axis=0), times[0].copy()
        self.later[np.ptp(times, axis=0) > SAME * size + NO_DELAY] = np.nan
        self.z = self.z + np.outer(rate, self.later)
        for i in self.fading:
            after, all_of_it = (np.hypot(*slip_of(g, z, i)) for z in (self.z, before))
            is_astray = after > ASTRAY * all_of_it + NO_DELAY
            self.why = motion_changes.TURNS if is_astray.any() else self.why
            self.later[is_astray] = np.nan
        phases = [
            (ROLLS if g.rolls and phase == SLIP else REST) if i in self.fading else SLIP
            for i, phase in enumerate(g.phase)
        ]
        self.z, self.is_late = settled(phases, self.z), True


def fading_in(g: Any, s: Sequence[float], least: float) -> list[int]:
    """Return which balls lose a slip or a speed that is not larger than ``least`` (m/s)."""
    find_forces(g, s)
    sizes = [pieces.fading(g, s, i) for i in range(len(g.mass))]
    return [i for i, (size, time) in enumerate(sizes) if time < np.inf and size <= least]


class GroupChanges:
    """The groups of a run change with its inputs, and so do the balls that they let go."""

    def __init__(self, g: Any, run: Run) -> None:
        self.g = g
        self.of: dict[int, ModeChanges] = {}
        self.later: dict[int, tuple[float, Array]] = {}  # when (s) balls met something, how late
        # what the delay of a hit multiplies, of balls that were let go at a time (s)
        self.waits: dict[int, tuple[float, Array, ModeChanges]] = {}
        lengths = np.cumsum([0, *(len(rows) - 1 for rows in run.knots)]).tolist()
        self.begins = {
            (i, what.since)
            for _, _, what in run.groups
            if isinstance(what, Begun)
            for i in what.balls
        }
        self.first = [len(run.knots) + length - 1 for length in lengths]

    def row(self, i: int, number: int) -> int:
        """Return the number of a breakpoint of a ball in the rows of the pass."""
        return i if number == 0 else self.first[i] + number

    # -- pieces ------------------------------------------------------------------------------------

    def begin(self, piece: Begun, counts: Sequence[int]) -> None:
        """Let a piece begin: in another mode, with other balls, or as the one before."""
        t, old = piece.since, self.of.get(piece.balls[0])
        if old is not None and old.goes_on(piece):
            live = old
        else:
            live = ModeChanges(self.g, piece)
            before = [*{id(own): own for i in piece.balls if (own := self.of.get(i))}.values()]
            for own in before:
                self.end(own, t)
            self._change_mode(live, before)
            firsts = [own.first for own in before]
            if piece.until == t and any(f.until == f.since and not f.faded for f in firsts):
                self.lose(live, motion_changes.TWICE, live.z.any(axis=0))
            live.z[:, ~np.isfinite(live.z).all(axis=0)] = np.nan
        for i, count in zip(piece.balls, counts, strict=True):
            moves = live.press.phase[piece.balls.index(i)] != REST and piece.until > t
            row = self.row(i, count if moves else count - 1)
            if live is old:
                self.g.ball[i].at = row
            else:
                self.of[i] = live
                self.put(i, live.z[live.rows(i)], row, t)

    def _change_mode(self, live: ModeChanges, before: Sequence[ModeChanges]) -> None:
        """Let the changes of a group go on in another mode."""
        g, t, balls, s = self.g, live.first.since, live.balls, live.state
        rate = np.concatenate([self.rate_of(i, t) for i in balls])
        live.z = np.concatenate([self.change_of(i, t) for i in balls])
        speeds = np.abs(np.stack((live.rate - rate, live.rate))).reshape(2, -1, 6)[:, :, :2]
        unseen = math.sqrt(4.0 * max(live.press.pull) * UNSEEN * min(live.press.radius))
        if not before and speeds[0].max() > unseen + UNLISTED * speeds[1].max():
            self.lose(live, motion_changes.BY_POLICY, live.z.any(axis=0))
        later = self.delay(balls, t)
        if not jumps(rate, live.rate) and not any(own.is_late for own in before):
            later = np.zeros(len(later))
        if any(own.last.faded and turns(own, live) for own in before):
            self.lose(live, motion_changes.TURNS, live.z.any(axis=0))
        for i in balls:
            when, lost, _ = self.waits.get(i, (-1.0, rate, live))
            if when == t:
                live.z[live.rows(i)] += np.outer(lost, later)
                del self.waits[i]
        late = np.concatenate([np.full(6, self.is_late(i)) for i in balls])
        live.z += np.outer(np.where(late, 0.0, rate), later)
        live.z = joined(live.press, s, settled(live.press.phase, live.z))
        wide = np.abs(gaps(live.press, s, live.z, g.of_radius[list(live.balls)]))
        wide = wide[[k for k, on in enumerate(live.press.on) if on]].max(axis=0, initial=0.0)
        least = (SHUT if t == 0.0 else FAINT) * np.abs(live.z).max(axis=0) + NO_GAP
        why = motion_changes.TOUCH_FIRST if t == 0.0 else motion_changes.OPENS
        self.lose(live, why, wide > least)
        live.z -= np.outer(live.rate, later)

    def is_late(self, i: int) -> bool:
        """Tell whether the changes of a ball are those of a later state."""
        return i in self.of and self.of[i].is_late

    def lose(self, live: ModeChanges, why: int, flag: Any) -> None:
        """Lose the changes of a group by some inputs."""
        if flag.any() and np.isfinite(live.z[:, flag]).any():
            columns.warn(self.g, why, live.first.since)
        live.z[:, flag] = np.nan

    def end(self, live: ModeChanges, t: float) -> None:
        """Follow the motion of a group until a time (s), at which it ends or is cut."""
        if live.until == t:
            return
        g, since, size = self.g, live.first.since, self.g.change.shape[1]
        live.z = np.concatenate([self.change_of(i, t) for i in live.balls])
        start, known = live.z, np.isfinite(live.z).all(axis=0)
        live.end(t)
        if live.later is not None and np.isnan(live.later[known]).any():
            columns.warn(g, live.why, t)
        if columns.is_beyond(live.z):
            columns.warn(g, motion_changes.GROWN, t)
            live.z[:] = np.nan
        for i in live.balls:
            own = [(when, z[live.rows(i)][:size]) for when, z in live.course.steps]
            g.kept.spells[i].append([(since, start[live.rows(i)][:size]), *own])
            if live.is_over and live.later is not None:
                self.meet(i, t, live.later)

    # -- balls -------------------------------------------------------------------------------------

    def change_of(self, i: int, t: float) -> Array:
        """Return the change (6, P) of a ball at a time (s), to which its path leads."""
        g, found = self.g, np.zeros((6, len(self.g.late)))
        live = self.of.get(i)
        if live is None:
            motion_changes.move(g, i, t)
            g.kept.changes[i].append((t, g.ball[i].at, g.change[i].copy()))
        elif live.until == t:
            return np.asarray(live.z[live.rows(i)])
        found[: g.change.shape[1]] = g.change[i]
        return found

    def rate_of(self, i: int, t: float) -> Array:
        """Return the rate (6,) of a ball at a time (s)."""
        g, live = self.g, self.of.get(i)
        if live is not None:
            return live.rate[live.rows(i)]
        return free_rate(g.rows[g.ball[i].at], motion_at(columns.path_of(g, i), t), g)

    def put(self, i: int, change: Array, row: int, t: float) -> None:
        """Put a ball on the path of a breakpoint, with a change (6, P) there."""
        g, ball = self.g, self.g.ball[i]
        g.change[i] = change[: g.change.shape[1]]
        g.ever[i] |= (g.change[i] != 0.0).any(axis=0)
        ball.at, ball.met = row, STOP
        columns.keep(g, -1, i, i, t)

    def let_go(self, i: int, t: float, count: int) -> None:
        """Let a ball go on by itself, from the breakpoint of this number on."""
        live = self.of.get(i)
        if live is None:
            return
        self.end(live, t)
        rows, g = live.rows(i), self.g
        del self.of[i]
        for contact in live.first.contacts:
            if i in contact.balls:
                wall = -1 - (contact.cushion or 0)
                one, other = (*contact.balls, wall)[:2]
                g.kept.parted |= {(one, other), (other, one)}
        row = g.rows[self.row(i, count - 1)]
        z, rate = live.z[rows].copy(), live.rate[rows]
        after = free_rate(row, tuple(row[2:6]), g) if row[1] == t else np.zeros(6)
        if jumps(rate, after) or live.is_late:
            lost = (0.0 if live.is_late else rate) - after
            z += np.outer(lost, self.delay((i,), t))
            if i not in self.later or self.later[i][0] != t:
                self.waits[i] = t, lost, live
        if not after.any():
            z[2:] = 0.0
        self.put(i, z, self.row(i, count - 1), t)

    # -- times -------------------------------------------------------------------------------------

    def meet(self, i: int, t: float, later: Array, why: int = motion_changes.TWICE) -> None:
        """Note how much later (s) something comes to a ball; at one instant all delays agree."""
        when, other = self.later.get(i, (-1.0, later))
        self.later[i] = t, self._agreed(later, other, t, why) if when == t else later

    def delay(self, balls: Sequence[int], t: float) -> Array:
        """Return how much later (s) comes what happens to these balls at this instant."""
        found: Array | None = None
        for i in balls:
            when, later = self.later.get(i, (-1.0, None))
            if when == t and later is not None:
                found = later if found is None else self._agreed(later, found, t)
        return np.zeros(len(self.g.late)) if found is None else found

    def _agreed(self, one: Array, other: Array, t: float, why: int = motion_changes.TWICE) -> Array:
        """Return one of two delays (s) that agree; they are unknown where they differ."""
        differ = np.abs(one - other) > SAME * np.maximum(np.abs(one), np.abs(other)) + NO_DELAY
        if differ.any():
            columns.warn(self.g, why, t)
        return np.where(differ, np.nan, one)

    # -- events ------------------------------------------------------------------------------------

    def go_through(self, k: int) -> None:
        """Follow the changes through an event."""
        g = self.g
        t, i, j = changes.time_and_balls(g, k)
        other = int(g.events[k][2])
        if other <= OUT and i in self.of:
            self._cross(i, t)
        if other <= STOP and i in self.of:
            self.end(self.of[i], t)
            when, later = self.later.get(i, (-1.0, None))
            g.late[:] = np.nan if when != t or later is None else later
            g.kept.lates.append(g.late.copy())
            return
        if other <= STOP:
            is_followed = changes.go_through(g, k, 0, len(g.events)) == FOLLOWED
            if is_followed and not np.isnan(g.late).all():
                self.meet(i, t, g.late.copy())
            return
        self._wait_no_more(i, other, t)
        if {(i, t), (j, t)} <= self.begins and changes.shares_a_ball(g, k, 0, len(g.events)):
            self._go_on_at_once(k)
        elif changes.go_through(g, k, 0, len(g.events)) == FOLLOWED:
            for n in {i, j}:
                self.meet(n, t, g.late.copy())

    def _cross(self, i: int, t: float) -> None:
        """Note how much later (s) a ball of a group crosses the border of a patch."""
        g, live = self.g, self.of[i]
        self.end(live, t)
        rows = live.rows(i)
        x, y, vx, vy, _, _ = live.state[rows]
        nx, ny = normal_at(g.borders, len(g.borders), x, y)
        self.meet(i, t, -(nx * live.z[rows][0] + ny * live.z[rows][1]) / (nx * vx + ny * vy))

    def _go_on_at_once(self, k: int) -> None:
        """Follow the changes through one of several hits of an instant, from which a group goes on.

        They come as late as the first of them; else they are a kink. The last ones are too feeble
        to matter: the group goes on as if they were one.
        """
        g = self.g
        (t, i, j), other = changes.time_and_balls(g, k), int(g.events[k][2])
        balls, later = dict.fromkeys((i, j)), self.delay((i, j), t)
        is_first = not any(self.later.get(n, (-1.0,))[0] == t for n in balls)
        _, closing, fastest = self.hit_later(i, other, t)
        if is_first or closing > FEEBLE * fastest:
            if changes.go_through(g, k, k, k + 1) == FOLLOWED:
                for n in balls:
                    self.meet(n, t, g.late.copy(), motion_changes.SHARED)
                    g.change[n][:, np.isnan(self.later[n][1])] = np.nan
            return
        for n in balls:
            row, following = g.rows[g.ball[n].at], g.following[g.ball[n].at]
            if following >= 0 and g.rows[following][1] == t:
                after = g.rows[following]
                lost = free_rate(row, motion_at(columns.path_of(g, n), t), g)
                lost -= free_rate(after, after[2:6], g)
                motion_changes.move(g, n, t)
                g.change[n] += np.outer(lost, later)[: g.change.shape[1]]
                g.ball[n].at = following
        g.late[:] = later
        columns.keep(g, k, i, j, t)

    def _wait_no_more(self, i: int, other: int, t: float) -> None:
        """Let groups end that a hit takes apart, as much later as the hit comes."""
        balls = (i, other) if other >= 0 else (i,)
        lives = {id(self.waits[n][2]) for n in balls if n in self.waits and self.waits[n][0] == t}
        if not lives:
            return
        later, _, _ = self.hit_later(i, other, t)
        for n, (when, lost, live) in list(self.waits.items()):
            if when == t and id(live) in lives:
                self.g.change[n] += np.outer(lost, later)[: self.g.change.shape[1]]
                self.meet(n, t, later)
                del self.waits[n]

    def hit_later(self, i: int, other: int, t: float) -> tuple[Array, float, float]:
        """Return how much later (s) a hit comes, how fast (m/s) it closes, and the balls' speed."""
        g, wide = self.g, np.zeros(len(self.g.late))
        balls, size, before = (i, other) if other >= 0 else (i,), len(g.change[0]), g.one.before
        contact_changes.read_motions(g, i, other, t)
        fastest = sum(size_of(*before[c * size : c * size + 2]) for c in range(len(balls)))
        (nx, ny), _, closing, _, _ = contact_changes.geometry_at(g, i, other)
        for n in balls:
            own, sign = g.change[n].copy(), 1.0 if n == other or other < 0 else -1.0
            motion_changes.carry(g, g.rows[g.ball[n].at], own, t)
            wide += sign * (nx * own[0] + ny * own[1]) - g.of_radius[n]
        return wide / closing, closing, fastest

    def finish(self) -> None:
        """Follow the changes to the end of the run."""
        g, t = self.g, self.g.one.ends[0]
        lives = list(self.of.items())
        for i, live in lives:
            self.end(live, t)
            g.ball[i].gone = 1
            while g.following[g.ball[i].at] >= 0:
                g.ball[i].at = g.following[g.ball[i].at]
        changes.finish(g)
        for i, live in lives:
            g.change[i] = live.z[live.rows(i)][: g.change.shape[1]]


def numbers_of(g: Any, piece: Begun) -> Numbers:
    """Return how the inputs change the numbers of a group."""
    mu = np.zeros((len(piece.contacts), len(g.late)))
    for own, contact in zip(mu, piece.contacts, strict=True):
        if contact.cushion is None:
            own[:] = g.of_numbers[5]
        elif not contact_changes.owns(g, contact.cushion)[1]:
            own[:] = g.of_numbers[4]
    of_pull, of_drag = (
        np.array([g.of_numbers[k if own == g.one.numbers[k] else UNCHANGED] for own in of_balls])
        for k, of_balls in ((3, piece.press.pull), (6, piece.press.drag))
    )
    return Numbers(g.of_mass[list(piece.balls)], mu, of_pull, of_drag)


def jumps(before: Array, after: Array) -> bool:
    """Tell whether accelerations jump at an instant."""
    a, b = (rate.reshape(-1, 6)[:, 2:] for rate in (before, after))
    return bool(np.abs(a - b).max() > STEADY * max(np.abs(a).max(), np.abs(b).max()))


def turns(old: ModeChanges, live: ModeChanges) -> bool:
    """Tell whether a ball slips on although its slip has fallen to zero."""
    balls = [old.balls[k] for k in old.fading if old.press.phase[k] == SLIP]
    phases = dict(zip(live.balls, live.press.phase, strict=True))
    return any(live.press.rolls and phases.get(i) == SLIP for i in balls)


def free_rate(row: Any, motion: Any, g: Any) -> Array:
    """Return the rate (6,) of a ball on the path of a breakpoint."""
    found = np.zeros(6)
    if any(row[4:8]):
        contact_changes.put_rates(found, 0, g.change.shape[1], motion[2], motion[3], row)
    return found


def follow_all(g: Any, run: Run) -> None:
    """Follow the changes through the events of a run, and through its groups.

    Where the groups are not known, balls lose their derivatives when a contact begins to persist.
    """
    groups, steps, done = GroupChanges(g, run), run.groups, 0
    unknown = [] if steps else sorted(run.persistent, key=lambda one: -one.since)
    for k in range(len(g.events) + 1):
        while unknown and (k == len(g.events) or unknown[-1].since < g.events[k][0]):
            one = unknown.pop()
            columns.warn(g, motion_changes.PERSISTS, one.since)
            for i in (run.scene.index[id_] for id_ in one.balls):
                g.change[i] = math.nan
                columns.keep(g, -1, i, i, one.since)
        while done < len(steps) and steps[done][0] <= k:
            _, counts, what = steps[done]
            done += 1
            if isinstance(what, Begun):
                groups.begin(what, counts)
            else:
                groups.let_go(*what, counts[0])
        if k < len(g.events):
            groups.go_through(k)
    groups.finish()
