"""Balls that go on together, from one piece of their motion to the next."""

from __future__ import annotations

import math
from typing import Final

from pool_pymunk.core.ball import Ball, Company
from pool_pymunk.core.motion.path import Motion, Path
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.persistent.member import Member, State
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.spells import Spells
from pool_pymunk.core.persistent.touch import Touch, is_of
from pool_pymunk.core.walls.wall import Wall

# Balls that overlap by errors are moved apart by a little more than they overlap.
APART: Final = 1.2
# In the first rounds the lighter ball moves farther. Later both move evenly, for it may have no
# room, as in a corner. How many rounds these are is a free choice.
FIRST_SHIFTS: Final = 5
LAST_SHIFTS: Final = 1000  # rounds at most, where balls come to rest or are looked at
SUNK: Final = 1e-10  # radii; less is none


class Gathering(Company):
    """A gathering has members and the touches among them; its present piece began at ``began`` (s).

    The piece lasts for ``time`` (s), and the state is that after ``played`` (s) of it. Its end is
    due for the ``leader``. Walls move as they do now ``until`` (s); a gathering that has played up
    to there ``halts``, and one that ``is_over`` goes on as others. A group and a crowd are
    gatherings: they differ in how they play.
    """

    def __init__(
        self, members: list[Member], touches: list[Touch], now: float, scale: Scale
    ) -> None:
        super().__init__()
        for k, each in enumerate(members):
            each.place = k
        self.members = members
        self.touches = touches
        self.scale = scale
        self.began = now
        self.time = self.played = 0.0
        self.looked = -INF  # s; when somebody has last asked for the states of the members
        self.states: list[State] = []
        self.is_over = False
        self.until = INF
        for one in touches:
            self.until = min(self.until, one.until)

    def holds(self, a: Ball, b: Ball | None, wall: Wall | None) -> bool:
        """Tell whether a contact of its members is one of its own."""
        return any(is_of(one, a, b, wall) for one in self.touches)

    @property
    def energy(self) -> float:
        """Twice the energy (J) of the motion, and of the roll."""
        total = 0.0
        for each in self.members:
            total += each.energy
        return total

    def play(self, now: float) -> None:
        """Play the next piece, from now (s) on."""
        raise NotImplementedError

    def step(self, h: float) -> float:
        """Let the state be that after a time (s) of the piece; return its error in tolerances."""
        raise NotImplementedError

    def go_to(self, t: float) -> None:
        """Let the state be that at a time (s) of the piece."""
        if self.sleeps:
            self.played = max(t - self.began, 0.0)
        elif t < self.began + self.time:
            self.played = 0.0
            for each in self.members:
                each.mode = each.phase
                if t <= self.began:
                    each.go_back()
            if t > self.began:
                self.step(t - self.began)

    def state_of(self, ball: Ball, t: float) -> tuple[Motion, Vector]:
        if self.looked != t:
            self.looked, self.states = t, self.states_at(t)
        for each, (x, y, vx, vy, wx, wy) in zip(self.members, self.states, strict=True):
            if each.ball is ball:
                return (x, y, vx, vy), (wx, wy)
        raise ValueError("the ball is no member")

    def sleep(self, now: float) -> None:
        """Let all members lie still from now (s) on, with the forces that hold them."""
        self.make_room(LAST_SHIFTS, APART)
        self.sleeps, self.leader = True, None
        self.began, self.time, self.played = now, INF, 0.0
        self.halts = self.until < INF
        for each in self.members:
            each.vx = each.vy = 0.0
            each.begin()
        for one in self.touches:
            one.at_start = one.halfway = one.push

    def make_room(self, most: int, times: float, enough: float = SUNK) -> float:
        """Move balls apart that overlap, one pair after another, in at most so many rounds.

        Each pair is moved by so many times its overlap. It is ``enough`` if none was deeper (radii)
        in a round; how deep the deepest was in the last one is returned.
        """
        deepest = 0.0
        for k in range(most):
            deepest = 0.0
            for one in self.touches:
                deepest = max(deepest, one.part(times, k >= FIRST_SHIFTS))
            if deepest <= enough:
                break
        return deepest

    def adds_no_energy(self) -> bool:
        """Slow all balls alike if a piece has added energy, and no wall drives them; tell so."""
        most = energy = 0.0
        for each in self.members:
            most += each.kinetic(each.start) + each.fallen
            energy += each.kinetic(each.state)
        if energy <= most or any([one.is_carried for one in self.touches]):
            return False
        share = math.sqrt(max(most, 0.0) / energy)
        for each in self.members:
            each.vx, each.vy = share * each.vx, share * each.vy
            each.wx, each.wy = share * each.wx, share * each.wy
        return True

    def states_at(self, t: float) -> list[State]:
        """Return the states of the members at a time (s) of the piece."""
        raise NotImplementedError

    def add_up(self, spells: Spells) -> None:
        """Add what the contacts have done in the present piece until now (Simpson's rule).

        What friction was spared in it is spared no more.
        """
        for one in self.touches:
            if one.on:
                x, y = one.at_start
                p, q = one.halfway
                u, v = one.push
                jx, jy = one.struck
                h = self.played / 6.0
                impulse = jx + h * (x + 4.0 * p + u), jy + h * (y + 4.0 * q + v)
                spells.add(one, self.began, self.began + self.played, impulse)
                one.struck = 0.0, 0.0
            one.spend(self.played)
        for each in self.members:
            each.spend(self.played)
        self.played = 0.0  # It counts once.

    def path(self, each: Member) -> Path:
        """Return the path of a member in this piece: it has its place at the end, too.

        In a very short one that place tells no acceleration, for its rounding is larger.
        """
        x, y, vx, vy, wx, wy = each.start
        h = self.time
        ax, ay = 2.0 * ((each.x - x) / h - vx) / h, 2.0 * ((each.y - y) / h - vy) / h
        if h < self.scale.least:
            ax, ay, _bx, _by = each.first
        return Path(self.began, x, y, vx, vy, ax, ay, self.began + h, False, wx, wy)


def gathering_of(ball: Ball) -> Gathering | None:
    """Return the gathering of a ball, if it is in one."""
    group = ball.group
    return group if isinstance(group, Gathering) else None


def joined(members: list[Member], touches: list[Touch]) -> list[list[Member]]:
    """Return the members, part by part: those of each are joined by touches."""
    for k, each in enumerate(members):
        each.place = k
    leads_to = list(range(len(members)))  # a member of the same part that is not behind it
    for one in touches:
        if one.b is not None:
            k, m = first_of(leads_to, one.a.place), first_of(leads_to, one.b.place)
            leads_to[max(k, m)] = min(k, m)
    parts = list[list[Member]]()
    for k, each in enumerate(members):
        first = members[first_of(leads_to, k)]
        if first is each:
            each.part = len(parts)
            parts.append([])
        each.part = first.part
        parts[each.part].append(each)
    return parts


def sorted_to(parts: list[list[Member]], touches: list[Touch]) -> list[list[Touch]]:
    """Return the touches of each part, of which the first ball is a member."""
    found = [list[Touch]() for _ in parts]
    for one in touches:
        found[one.a.part].append(one)
    return found


def first_of(leads_to: list[int], k: int) -> int:
    """Return the first member of the part of another one; those between lead nearer to it."""
    while leads_to[k] != k:
        leads_to[k] = leads_to[leads_to[k]]
        k = leads_to[k]
    return k
