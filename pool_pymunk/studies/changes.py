"""This module follows small changes of the inputs through a run, from event to event."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Collection, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.fast.doubts import around, may_be_at_corner
from pool_pymunk.model.inputs import Names, starts_of
from pool_pymunk.physics.contact import split
from pool_pymunk.physics.dual import SAME
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.path import NOISE, from_breakpoint, motion_at
from pool_pymunk.physics.saltation import (
    AGREE,
    BLUR,
    GRAZE,
    MOST,
    Geometry,
    Motion6,
    begins_to_roll,
    is_now,
    lateness,
    most_of_roll,
    slowed_roll,
)
from pool_pymunk.physics.surface import roll_rate
from pool_pymunk.results.run import Event, Run
from pool_pymunk.studies.contacts import Contacts, offset, through
from pool_pymunk.studies.touches import Touch, touches

ByInputs = list[Array | None]


class Lost(Exception):
    """This error says why an event has no derivative; it is empty if its balls had none before."""


class VariedInputs:
    """These are the P inputs that vary: each has a column in every change; None means no change.

    ``starts()`` are the changes (N, K, P) of the balls' states at the start: of place, velocity
    and, where balls roll, roll. ``unit(name)`` and ``of_ball(kind, i)`` are the changes (P,) of
    the numbers that contacts need.
    """

    def __init__(self, run: Run, names: Names) -> None:
        self.run, self.count = run, len(names)
        self.column = {name: k for k, name in enumerate(names)}

    def starts(self) -> Array:
        """Return the changes of the balls' states at the start."""
        return self.by_names(self.column)

    def by_names(self, names: Collection[str]) -> Array:
        """Return the same changes by some of the inputs."""
        scene, shot, struck = self.run.scene, self.run.shot, self.run.struck
        number = None if struck is None else scene.index[struck]
        begun = np.array([breakpoints[0] for breakpoints in self.run.knots])[np.newaxis]
        share = shot.roll if shot and shot.ball == struck else None
        roll = begun[..., 7:9] if scene.surface.rolls else None
        found = starts_of(scene, names, number, begun[..., 3:5], roll, share)[0]
        changes = np.zeros((*found.shape[:2], self.count))
        changes[..., [self.column[name] for name in names]] = found
        return changes

    def unit(self, name: str) -> Array | None:
        """Return the change of one input itself; None if it is not varied."""
        return np.eye(self.count)[self.column[name]] if name in self.column else None

    def of_cushion(self, kind: str, wall: int) -> Array | None:
        """Return the change of a cushion's restitution or friction; a post may have its own."""
        number, posts = wall - self.run.scene.first_post, self.run.scene.posts
        is_own = number >= 0 and getattr(posts[number], kind) is not None
        return None if is_own else self.unit(f"{kind}.cushion")

    def of_ball(self, kind: str, i: int) -> Array | None:
        """Return the change of a ball's mass or radius."""
        return self.unit(f"{kind}.{self.run.scene.balls[i].id}")


class Hit(NamedTuple):
    """This is a hit of two balls, or of one ball with a wall, at ``t`` (s)."""

    balls: Sequence[int]
    wall: int
    t: float
    geometry: Geometry
    states: Sequence[Motion6]
    fastest: float


class Changes:
    """Changes say how the balls' states depend on the inputs.

    ``change[i]`` (K, P) is that of ball i at its last breakpoint. ``kept[i]`` has all its changes
    so far, each with the time (s) from which it holds and the number of its breakpoint. ``times``
    are the changes (P,) of the times of the events.
    """

    def __init__(self, run: Run, inputs: VariedInputs) -> None:
        self.run, self.inputs, self.scene, self.contacts = run, inputs, run.scene, Contacts(run)
        self.surface = self.scene.surface
        rubs = [inputs.unit(f"friction.{key}") for key in ("surface", "rolling")]
        gravity = self.scene.physics.gravity * np.eye(2)[: 1 + self.surface.rolls]
        # These are the changes of the surface's own numbers.
        self.rubs = gravity @ [np.zeros(inputs.count) if each is None else each for each in rubs]
        _, _, self.corners = around(self.scene)
        self.breakpoints = [breakpoints.tolist() for breakpoints in run.knots]
        self.until = [np.append(breakpoints[1:, 0], run.duration) for breakpoints in run.knots]
        self.jacobians = [
            self.surface.jacobian(breakpoints, until - breakpoints[:, 0])
            for breakpoints, until in zip(run.knots, self.until, strict=True)
        ]
        self.at = [0] * len(self.breakpoints)  # the number of each ball's last breakpoint
        self.change = list(inputs.starts())
        self.kept = [[(0.0, 0, change)] for change in self.change]
        self.times: list[Array] = []
        self.warnings: dict[str, None] = {}
        self.unknown = np.full(inputs.count, math.nan)
        latest = self.scene.physics.max_time
        self.is_cut = run.status == "max_time" or run.duration == latest

    def follow(self) -> None:
        """Go through the events of the run; raise SettingError for a law without derivatives."""
        waiting = touches(self.run)[::-1]
        for k, event in enumerate(self.run.events):
            while waiting and waiting[-1][:2] <= (event.t, False):
                self._touch(waiting.pop())
            self._pass(k, event)
        while waiting:
            self._touch(waiting.pop())

    @cached_property
    def ends(self) -> Array:
        """Return the changes (N, K, P) of the balls' states at the end."""
        t = self.run.duration
        changes = []
        for i, breakpoints in enumerate(self.breakpoints):
            if self.at[i] + 1 < len(breakpoints) and breakpoints[self.at[i] + 1][0] < t:
                self._lose([i], "a contact is persistent", breakpoints[self.at[i] + 1][0])
            change = self._moved(i, t)[1]
            if self.is_cut and change.any() and self._rests_just_at(i, t):
                self._warn("a ball comes to rest just as the run ends", t)
                change[2:, change.any(axis=0)] = math.nan  # The place alone is smooth.
            changes.append(change)
        return np.array(changes)

    def at_times(self, times: Sequence[float], i: int) -> Array:
        """Return the changes (T, 2, P) of a ball's place at these times."""
        breakpoints, kept, changes = self.breakpoints[i], self.kept[i], []
        begun = [t for t, _, _ in kept]
        for time in times:
            t = min(max(time, 0.0), self.run.duration)
            last = max(bisect_right(begun, t) - 1, 0)
            _, k, change = kept[last]
            if k + 1 < len(breakpoints) and breakpoints[k + 1][0] < t:  # What began is unknown.
                change = np.full_like(change, math.nan)
            if any(self._is_hit(i, n, t) for n in (last, last + 1) if 0 < n < len(kept)):
                change = np.where(change.any(axis=0), math.nan, change)
            changes.append(self._slid(i, k, change, t)[1][:2])
        return np.array(changes).reshape(len(changes), 2, self.inputs.count)

    def _is_hit(self, i: int, n: int, t: float) -> bool:
        """Tell whether a ball is hit at this time (s), where its ``n``-th change began."""
        if t == self.run.duration and not self.is_cut:  # The end is at no fixed time.
            return False
        begun, k, _ = self.kept[i][n]
        path = from_breakpoint(*self.breakpoints[i][self.kept[i][n - 1][1]][:7])
        before, after = path.at(t)[1], self.breakpoints[i][k][3:5]
        jump = max(abs(a - b) for a, b in zip(after, before, strict=True))
        is_hit = jump > AGREE * math.hypot(*before) + NOISE * path.speed
        return is_hit and self._is_now(begun, t, [i])

    # -- events ------------------------------------------------------------------------------------

    def _pass(self, k: int, event: Event) -> None:
        """Follow the changes through an event, or lose them where it has no derivative."""
        balls = [self.scene.index[id_] for id_ in event.balls]
        try:
            if any(np.isnan(self.change[i]).all() for i in balls):
                raise Lost
            if event.kind == "stop":
                self._stop(balls[0], event)
            elif event.kind == "roll":
                self._roll(balls[0], event)
            elif self._shares_a_ball(k):
                raise Lost("contacts of one instant share a ball")
            elif event.t == self.run.duration and self.run.status == "max_events":
                raise Lost("the run was cut off at a contact")
            elif self.is_cut and self._is_now(event.t, self.run.duration, balls):
                raise Lost("the run ends just at a contact")
            elif any(self._rests_just_at(i, event.t) for i in balls):
                raise Lost("a ball comes to rest just as it is hit, or just where it touches")
            elif event.pocket is not None:
                self._fall(balls[0], event)
            else:
                self._contact(balls, event)
        except Lost as why:
            self.times.append(self.unknown)
            self._lose(balls, str(why), event.t)
        if any((np.abs(self.change[i]) > MOST).any() for i in balls):
            self._lose(balls, f"the derivatives have grown beyond {MOST:g}", event.t)
        for i in balls:
            self.kept[i].append((event.t, self.at[i], self.change[i]))

    def _touch(self, touch: Touch) -> None:
        """Lose the derivatives at a touch: a contact there acts by the root of the gap's change.

        Every input that has changed one of the balls therefore matters, even to second order.
        """
        balls = [i for i in (touch.i, touch.j) if i >= 0]
        changes = [self._moved(i, touch.t)[1] for i in balls]
        changes += [change for i in balls for _, _, change in self.kept[i]]
        matters = np.any([change.any(axis=0) for change in changes], axis=0)
        matters |= self._gap(balls) != 0.0
        if matters.any() and not any(np.isnan(self.change[i]).all() for i in balls):
            self._warn("a path touches what it does not hit", touch.t)
        for i in balls:
            self.change[i] = np.where(matters, math.nan, self.change[i])
            self.kept[i].append((touch.t, self.at[i], self.change[i]))

    def _is_now(self, t: float, now: float, balls: Sequence[int]) -> bool:
        """Tell whether a time (s) is that of an instant, to rounding, in the motion of balls."""
        fastest, size = 0.0, 0.0
        for i in balls if t != now else ():
            _, x, y, vx, vy = self.breakpoints[i][self.at[i]][:5]
            fastest = max(fastest, abs(vx), abs(vy))
            size = max(size, abs(x) + abs(y) + self.scene.balls[i].radius)
        return is_now(t, now, fastest, size)

    def _rests_just_at(self, i: int, t: float) -> bool:
        """Tell whether a ball that moved comes to rest at this time (s)."""
        t0, x, y, vx, vy, _, _, *roll = self.breakpoints[i][self.at[i]]
        moved = vx != 0.0 or vy != 0.0 or self.at[i] > 0
        end = self.surface.path(t0, (x, y), (vx, vy), (*roll, 0.0, 0.0)[:2]).end
        return moved and self._is_now(end, t, [i])

    def _shares_a_ball(self, k: int) -> bool:
        """Tell whether a contact has a ball in common with another event of its instant."""
        events, own = self.run.events, self.run.events[k]
        balls = [self.scene.index[id_] for id_ in own.balls]
        for numbers in (range(k - 1, -1, -1), range(k + 1, len(events))):
            for j in numbers:
                if not self._is_now(events[j].t, own.t, balls):
                    break
                is_its_stop = events[j].kind == "stop" and j > k  # The contact has stopped it.
                if not is_its_stop and {*own.balls} & {*events[j].balls}:
                    return True
        return False

    def _contact(self, balls: list[int], event: Event) -> None:
        """Follow the changes through a hit."""
        if not all(self._is_next(i, event.t) for i in balls):
            raise Lost("a contact is persistent, or answered by a policy")
        before, wall = [self._moved(i, event.t) for i in balls], event.cushion or 0
        changes, states = [change for _, change in before], [state for state, _ in before]
        x, y = states[0][:2]
        radii = [self.scene.balls[i].radius for i in balls]
        if len(balls) == 1 and may_be_at_corner(self.corners, x, y, radii[0]):
            raise Lost("a ball meets a cushion just where a corner begins")
        geometry = self.contacts.geometry(balls, states, wall)
        fastest = max(abs(part) for state in states for part in state[2:4])
        size = sum(radii) + sum(abs(x) + abs(y) for x, y, *_ in states)
        if geometry.closing <= GRAZE * fastest or geometry.depth <= BLUR * size:
            raise Lost("a contact is a graze")
        late = lateness(geometry, *offset(changes), self._gap(balls))
        if late.any() and self._is_now(event.t, 0.0, balls):
            self._warn("balls touch at the start", event.t)
            late = np.where(late != 0.0, math.nan, late)
        rolls = [self._roll_rates(i) for i in balls]
        hit = Hit(balls, wall, event.t, geometry, states, fastest)
        new = through(
            geometry,
            [(*state, *roll) for state, (roll, _) in zip(states, rolls, strict=True)],
            [(*self._next(i)[3:7], *roll) for i, (_, roll) in zip(balls, rolls, strict=True)],
            changes, late, partial(self._answered, hit), partial(self._slowed, hit),
        )  # fmt: skip
        self.times.append(late)
        for i, change in zip(balls, new, strict=True):
            self.at[i] += 1
            self.change[i] = change

    def _next(self, i: int) -> Any:
        """Return a ball's next breakpoint."""
        return self.breakpoints[i][self.at[i] + 1]

    def _roll_rates(self, i: int) -> tuple[Sequence[float], Sequence[float]]:
        """Return how fast a ball's roll changes before its next breakpoint, and after it."""
        if not self.surface.rolls:
            return (), ()
        return roll_rate(self.breakpoints[i][self.at[i]]), roll_rate(self._next(i))

    def _slowed(self, hit: Hit, change: Array, turn: Array, of_push: Array) -> Array:
        """Return the change of a ball's roll after a cushion whose normal turns has slowed it."""
        last = self.breakpoints[hit.balls[0]][self.at[hit.balls[0]]]
        rate, time, (w, z) = roll_rate(last), hit.t - last[0], change
        roll = last[7] + time * rate[0], last[8] + time * rate[1]
        of_mu = self.inputs.of_cushion("friction", hit.wall)
        wall, of_mu = self.contacts.walls[hit.wall], 0.0 * turn if of_mu is None else of_mu
        before = split(hit.states[0][2:4], hit.geometry.normal)
        push = self.contacts.law.cushion(before, wall.restitution, wall.friction).n - before.n
        most = most_of_roll(wall.friction, push, of_mu, of_push)
        return np.array(slowed_roll(hit.geometry, roll, w, z, turn, *most))

    def _given(self, balls: Sequence[int], wall: int) -> ByInputs:
        """Return the changes of the numbers that the law is given."""
        inputs, has_own = self.inputs, self.scene.restitution.cue_ball is not None
        if len(balls) == 1:
            return [inputs.of_cushion(kind, wall) for kind in ("restitution", "friction")]
        of_cue = has_own and any(self.scene.balls[i].cue for i in balls)
        masses = [inputs.of_ball("mass", i) for i in balls]
        restitution = inputs.unit(f"restitution.{'cue_ball' if of_cue else 'ball_ball'}")
        return [*masses, restitution, inputs.unit("friction.ball_ball")]

    def _answered(self, hit: Hit, parts: Array) -> Array:
        """Return the velocities' changes after a contact; nan where its one-sided ones differ."""
        before = [split(state[2:4], hit.geometry.normal) for state in hit.states]
        moves = [bool(row.any()) for row in parts[1::2]]
        law, answer = self.contacts.asked(hit.balls, hit.wall, before, moves, hit.fastest)
        name = self.contacts.law.name
        if law is None:
            raise Lost(f"law {name} jumps or has a kink")
        velocities = ((vx, vy) for vx, vy in (self._next(i)[3:5] for i in hit.balls))
        found = [split(velocity, hit.geometry.normal) for velocity in velocities]
        if np.abs(np.subtract(found, answer)).max() > AGREE * hit.fastest:
            raise Lost("a contact is answered by a policy")
        given = self._given(hit.balls, hit.wall)
        sides = [np.asarray(side[:, : len(parts)] @ parts) for side in law]
        for result, side in zip(sides, law, strict=True):
            for slopes, change in zip(side.T[len(parts) :], given, strict=True):
                if change is not None:
                    result += slopes[:, np.newaxis] * change
        if len(sides) == 1:
            return sides[0]
        change = np.vstack([parts, *(row for row in given if row is not None)])
        size = np.abs(law).max() * np.abs(change).max(axis=0)
        bent = (np.abs(np.array(sides) - sides[0]) > SAME * size).any(axis=(0, 1))
        if bent.any():
            self._warn(f"law {name} has a kink, as between sticking and slipping", hit.t)
        return np.asarray(np.where(bent, math.nan, np.mean(sides, axis=0)))

    def _gap(self, balls: list[int]) -> Array | float:
        """Return the change of the gap by the radii: it shrinks as they grow."""
        radii = [change for i in balls if (change := self.inputs.of_ball("radius", i)) is not None]
        return -np.sum(radii, axis=0) if radii else 0.0

    def _stop(self, i: int, event: Event) -> None:
        """Follow a ball to rest, at the end of its path."""
        last = self.breakpoints[i][self.at[i]]
        change = self.change[i]
        if not any(last[3:5]):  # A contact has stopped it.
            self._warn("a ball stops at contact, so the time of its stop has a kink", event.t)
            self.times.append(self.unknown)
        elif not self._is_next(i, event.t):
            raise Lost("a contact is persistent, or answered by a policy")
        else:
            self.times.append(self._end_times(i))
            change = self._moved(i, event.t)[1]
            change[2:] = np.where(np.isnan(change[2:]), math.nan, 0.0)
        self._come_to(i, event.t)
        self.change[i] = change

    def _end_times(self, i: int) -> Array:
        """Return how much later (P,) the ball's present path ends."""
        by_state, by_friction = self.surface.end_slopes(np.array(self.breakpoints[i][self.at[i]]))
        return np.asarray(by_state @ self.change[i] + by_friction @ self.rubs)

    def _roll(self, i: int, event: Event) -> None:
        """Follow a ball that begins to roll: its acceleration changes, and its slip is gone."""
        if not self._is_next(i, event.t):
            raise Lost("a contact is persistent, or answered by a policy")
        times, change = self._end_times(i), self._moved(i, event.t)[1]
        before = self.breakpoints[i][self.at[i]]
        self._come_to(i, event.t)
        after = self.breakpoints[i][self.at[i]]
        _, _, u, v, _, _ = change
        change[2:4] = change[4:] = begins_to_roll(before[5:7], after[5:7], u, v, times)
        self.times.append(times)
        self.change[i] = change

    def _fall(self, i: int, event: Event) -> None:
        """Follow a ball into its pocket, where it stays."""
        hole = next(hole for hole in self.scene.pockets if hole.id == event.pocket)
        (x, y, vx, vy, _, _), change = self._moved(i, event.t)
        nx, ny = (x - hole.position[0]) / hole.radius, (y - hole.position[1]) / hole.radius
        closing = -(vx * nx + vy * ny)
        if closing <= GRAZE * max(abs(vx), abs(vy)) or not self._is_next(i, event.t):
            raise Lost("a ball grazes the rim of a pocket")
        self.times.append(np.asarray((nx * change[0] + ny * change[1]) / closing))
        self._come_to(i, event.t)
        self.change[i] = np.where(np.isnan(change).any(axis=0), math.nan, np.zeros_like(change))

    # -- states ------------------------------------------------------------------------------------

    def _is_next(self, i: int, t: float) -> bool:
        """Tell whether the ball's next breakpoint is at this time."""
        breakpoints, k = self.breakpoints[i], self.at[i] + 1
        return k < len(breakpoints) and breakpoints[k][0] == t

    def _moved(self, i: int, t: float) -> tuple[Motion6, Array]:
        """Return how a ball moves at the time t, and how that depends on the inputs."""
        return self._slid(i, self.at[i], self.change[i], t)

    def _slid(self, i: int, k: int, change: Array, t: float) -> tuple[Motion6, Array]:
        """Return how a ball moves at a time, from its ``k``-th breakpoint on, and its change."""
        path = from_breakpoint(*self.breakpoints[i][k][:7])
        if t == self.until[i][k]:
            by_state, by_friction = (found[k] for found in self.jacobians[i])
        else:
            row = np.array(self.breakpoints[i][k])
            by_state, by_friction = self.surface.jacobian(row, np.array(t - path.t))
        moved = by_state @ change + by_friction @ self.rubs
        return (*motion_at(path, t), path.ax, path.ay), moved

    def _come_to(self, i: int, t: float) -> None:
        """Go on to a ball's last breakpoint of this time."""
        breakpoints = self.breakpoints[i]
        while self.at[i] + 1 < len(breakpoints) and breakpoints[self.at[i] + 1][0] <= t:
            self.at[i] += 1

    def _lose(self, balls: list[int], why: str, t: float) -> None:
        """Note that balls have no derivatives from ``t`` (s) on, and warn ``why`` unless empty."""
        if why:
            self._warn(why, t)
        for i in balls:
            self.change[i] = np.full_like(self.change[i], math.nan)
            self._come_to(i, t)

    def _warn(self, why: str, t: float) -> None:
        text = f"{why} (at {t:.6g} s): what depends on it has no derivative, and is NaN"
        self.warnings[text] = None
