"""A crowd of balls that hit each other over and over goes on by steps (Moreau; Jean).

To follow each of its hits takes thousands a second, and which comes first decides nothing that
could be known. In a step, impulses of contacts and of the surface answer all that happens: sides
that close in it part as the law says, or come to touch if that is too slow to be seen, and friction
stops what it can. The impulses are those of a complementarity problem, found by relaxing one after
another (projected Gauss-Seidel).
"""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import INF, length_of
from pool_pymunk.core.persistent.gathering import APART, LAST_SHIFTS, Gathering, joined
from pool_pymunk.core.persistent.member import REST, Member, State
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.touch import Touch
from pool_pymunk.core.walls.wall import Wall

LONGEST: Final = 10.0  # times the shortest step
SWEEPS: Final = 60
ENOUGH: Final = 5e-2  # of the speed that the surface takes in a step; the impulses are as exact
# Where friction does not slow balls, only impulses that are more exact bring piles to rest. With
# steps of LONGEST, or with FAST_SWEEPS for all, one of six piles of fifty balls never rests.
SHORT: Final = 2.0  # times the shortest step, in place of LONGEST
FAST_SWEEPS: Final = 120  # while a ball is faster than it gets in a step
SLOW_SWEEPS: Final = 360
LEAST: Final = 1e-9  # of the speed that a ball gets in a step; slower ones are none
SHIFTS: Final = 30  # rounds at most, after each step
# radii, a free choice; where balls overlap by more, as a light one that heavy ones press, they are
# moved apart in as many rounds as that takes
DEEP: Final = 0.03


@final
class Crowd(Gathering):
    """A crowd has the contacts that may close in a step of ``pace`` (s).

    After it, members were moved apart; ``overlap`` is how deep (radii) the deepest had sunk in, in
    the last round.
    """

    def __init__(
        self, members: list[Member], touches: list[Touch], now: float, scale: Scale, pace: float
    ) -> None:
        super().__init__(members, touches, now, scale)
        self.pace = pace
        self.overlap = 0.0
        self.slows = members[0].drag > 0.0  # Friction of the surface ends small motions.

    @property
    def answers_all(self) -> bool:
        return True

    def holds(self, a: Ball, b: Ball | None, wall: Wall | None) -> bool:
        return wall is None or not wall.is_pocket

    def path(self, each: Member) -> Path:
        """Return the straight path of a member in this step, after which it may be moved apart."""
        x, y, _vx, _vy, _wx, _wy = each.start
        end, vx, vy = self.began + self.time, each.vx, each.vy
        return Path(self.began, x, y, vx, vy, 0.0, 0.0, end, False, each.wx, each.wy)

    def states_at(self, t: float) -> list[State]:
        return self._states_at(t, LAST_SHIFTS)

    def _states_at(self, t: float, shifts: int) -> list[State]:
        """Return the states at a time (s): velocities are those of the whole step.

        On straight paths balls may overlap before the end of the step. So they are moved apart, in
        at most so many rounds.
        """
        if self.sleeps or t <= self.began:
            return [each.start for each in self.members]
        ends = [each.state for each in self.members]
        for each in self.members:
            each.x, each.y = self.path(each).place(t)
            each.time = t
        self.make_room(shifts, APART)
        found = [each.state for each in self.members]
        for each, (x, y, _vx, _vy, _wx, _wy) in zip(self.members, ends):
            each.x, each.y, each.time = x, y, self.began + self.time
        return found

    def go_to(self, t: float) -> None:
        """Let the state be that at a time (s): its velocities are those of the whole step."""
        if self.sleeps:
            super().go_to(t)
        elif t < self.began + self.time:
            self.played = max(t - self.began, 0.0)
            shifts = 1 if self.slows else LAST_SHIFTS
            for each, state in zip(self.members, self._states_at(t, shifts)):
                each.x, each.y, each.vx, each.vy, each.wx, each.wy = state
                each.time = max(t, self.began)

    def rests(self, each: Member) -> bool:
        """Tell whether a member rests in this step, and no wall that moves takes it along."""
        if each.phase != REST or not each.stands:
            return False
        return self.until == INF or not any(
            [one.on and one.until < INF and one.a is each for one in self.touches]
        )

    def next_pace(self, members: list[Member], room: float, least: float) -> float:
        """Return how long (s) a step may be, so that changes of velocity move no ball farther."""
        change = 0.0
        for each in members:
            change = max(change, length_of(each.ax, each.ay))
        change *= self.time
        longest = (LONGEST if self.slows else SHORT) * least
        return max(least, min(room / change, longest) if change > 0.0 else longest)

    def parts(self, tolerance: float, pace: float) -> list[list[Member]]:
        """Return the members, part by part: those of each press on each other, or soon may (s)."""
        return joined(self.members, [t for t in self.touches if t.on or t.comes(tolerance, pace)])

    def play(self, now: float) -> None:
        self.began, self.time = now, self.pace
        for each in self.members:
            each.begin()
        self.step(self.pace)

    def step(self, h: float) -> float:
        for each in self.members:
            each.go_back()
            each.face()
        before = self.energy
        self._press(h, 1.0)
        if self.energy > before:
            for each in self.members:
                each.go_back()
            for one in self.touches:
                one.n = one.t = one.i = 0.0
            self._press(h, 0.0)
        self.played = h
        for one in self.touches:
            one.on = one.n > 0.0
            one.at_start = one.halfway = one.push
        if self.slows:
            self.overlap = self.make_room(1, 1.0)
            if self.overlap > DEEP:
                self.overlap = self.make_room(LAST_SHIFTS, APART, DEEP)
        else:
            self.overlap = self.make_room(SHIFTS, APART)
        self.adds_no_energy()
        return 0.0

    def _press(self, h: float, bounces: float) -> None:
        """Find the forces of a step (s), and the state after it; ``bounces`` is 0 or 1."""
        gain = speed = enough = 0.0
        for each in self.members:
            each.fx = each.fy = each.cx = each.cy = 0.0
            each.face()
            enough = max(enough, ENOUGH * h * each.pull)
            gain, speed = max(gain, h * each.pull), max(speed, length_of(each.vx, each.vy))
        if not self.slows:
            enough = min(enough, ENOUGH * max(speed, LEAST * gain))
        for one in self.touches:
            n, t, i = one.n, one.t, one.i  # as in the step before
            one.n = one.t = one.i = 0.0
            one.look()
            one.aim(h, bounces)
            one.press(n, t, i)
        for each in self.members:
            each.brake(h)
        sweeps = SWEEPS
        if not self.slows:
            sweeps = FAST_SWEEPS if speed > gain else SLOW_SWEEPS
        for _ in range(sweeps):
            change = 0.0
            for one in self.touches:
                change = max(change, one.carry(h))
            if change <= enough:
                break
        for each in self.members:
            each.land(h)
