"""Groups form around hits and around balls that are pressed together."""

from __future__ import annotations

import math
from typing import final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.persistent.bounces import count_bounces, time_of_bounces
from pool_pymunk.core.persistent.crowds import Crowds, sides_in
from pool_pymunk.core.persistent.gathering import gathering_of, joined, sorted_to
from pool_pymunk.core.persistent.gatherings import SUNK
from pool_pymunk.core.persistent.group import Group
from pool_pymunk.core.persistent.member import FREE, REST, SLIP, Member
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.touch import Touch, is_of
from pool_pymunk.core.persistent.unseen import FEW, SHARED, STRONGEST, TINY
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due, hit_at


@final
class Cluster:
    """A cluster has the balls and contacts around a hit, and the groups that they form."""

    def __init__(self, members: list[Member], touches: list[Touch], groups: list[Group]) -> None:
        self.members = members
        self.touches = touches
        self.groups = groups

    def take(self, other: Cluster) -> None:
        """Take in what another cluster has."""
        self.members += other.members
        self.touches += other.touches
        self.groups += other.groups

    def holds(self, due: Due) -> bool:
        """Tell whether a contact is one of the cluster."""
        return any(is_of(one, due.a, due.b, due.wall) for one in self.touches)


class Forming(Crowds):
    """Clusters of balls that touch are looked at here: which groups they form."""

    def __init__(self, scale: Scale) -> None:
        super().__init__(scale)
        self.opened: dict[tuple[int, int], float] = {}  # s; until when opened contacts are none

    def _form(self, present: Present, seeds: list[Ball]) -> Cluster:
        """Return the cluster around some balls; its groups have not begun."""
        members = list[Member]()
        self._look_at_speeds(present)
        touches = self._touches(present, seeds, members)
        cluster = Cluster([], [], [])
        parts = joined(members, touches)
        for part, near in zip(parts, sorted_to(parts, touches)):
            cluster.take(self._form_part(present, part, near))
        return cluster

    def _form_part(self, present: Present, members: list[Member], touches: list[Touch]) -> Cluster:
        """Return the part of a cluster with these members, which touch each other."""
        now = present.now
        parting = [one.opening for one in touches]
        states = [(each.state, each.spared) for each in members]
        while len(touches) > 0:
            for each, (state, spared) in zip(members, states):
                each.x, each.y, each.vx, each.vy, each.wx, each.wy = state
                each.is_struck, each.spared = False, spared
                each.ux = each.uy = 0.0
                self._set_phase(present, each)
            for one in touches:
                one.struck = 0.0, 0.0
                one.spared = 0.0
            for one, v in zip(touches, parting):
                b = None if one.b is None else one.b.ball
                one.is_dull = abs(v) < self._dullest(present, one.a.ball, b)
            group = Group(members, touches, now, self.scale)
            group.decide(now, True)
            for one, v in zip(touches, parting):
                count_bounces(one, v)
                one.bounces = max(now + time_of_bounces(one, v), one.a.ball.bounces)
            if group.strike():
                for each in members:
                    each.fade()
                group.decide(now, True)
            group.join()
            if not group.goes_on(now):
                group.decide(now, False)
            keep = [self._stays(present, group, one, v) for one, v in zip(touches, parting)]
            jam_around(present, touches)
            if all(keep):
                group.close()
                return Cluster(members, touches, parts_of(group, now))
            parting = [v for v, kept in zip(parting, keep) if kept]
            touches = [one for one, kept in zip(touches, keep) if kept]
        return Cluster([], [], [])

    def _touches(self, present: Present, seeds: list[Ball], members: list[Member]) -> list[Touch]:
        """Return the contacts of a cluster that may persist; find its members."""
        found = list[Touch]()
        for ball in seeds:
            add(members, self._member(present, ball))
        for a in members:  # This list grows.
            found += self._touches_of_balls(present, members, a)
            found += self._touches_of_walls(present, a)
        return found

    def _touches_of_balls(self, present: Present, members: list[Member], a: Member) -> list[Touch]:
        """Return the contacts of a member with balls that have not been looked at."""
        found = list[Touch]()
        for ball in present.near.around(a.ball):
            group = gathering_of(ball)
            if group is not None and group.answers_all and group.began == present.now:
                continue  # It has just become one of a crowd, and would come out again and again.
            hit = hit_at(present.now, a.ball, ball, None)
            far = max(a.ball.radius, ball.radius)
            if a.ball.ignores(ball.categories, ball.mask) or not (
                -SUNK * far <= present.gap(hit) <= self.tolerance
            ):
                continue
            b = member_of(members, ball)
            if b is not None and b.place < a.place:
                continue
            pair = present.table.pair(a.ball, ball)
            one = Touch(a, b or self._member(present, ball), None, None, pair)
            if not self._may_persist(present, one):
                continue
            if b is None:  # Its group gives it its exact state.
                self.leave(present, ball)
                b = self._member(present, ball)
                add(members, b)
                one = Touch(a, b, None, None, pair)
                one.look()
                one.on = True
            found.append(one)
        return found

    def _touches_of_walls(self, present: Present, a: Member) -> list[Touch]:
        """Return the contacts of a member with walls."""
        found = list[Touch]()
        for wall in present.table.walls:
            one = self._touch_of(present, a, wall, self.tolerance)
            if one is not None and self._may_persist(present, one):
                found.append(one)
        return found

    def _may_persist(self, present: Present, one: Touch) -> bool:
        """Tell whether two sides that touch may stay in contact, if forces press them together."""
        one.look()
        one.on = True
        b = None if one.b is None else one.b.ball
        e, pull = one.pair.restitution, STRONGEST * present.pull + abs(one.lift)
        most = 2.0 * pull * self._tolerance(present, one.a.ball, b)
        is_shut = self.opened.get(sides_in(one), -INF) <= present.now
        return is_shut and self._is_unseen(-one.opening, e, max(1.0 - e * e, SHARED), most)

    def _set_phase(self, present: Present, each: Member) -> None:
        """Find the phase of a member; a slip rolls that would fade unseen."""
        each.phase = SLIP
        if each.own is not None:
            each.phase = FREE
            each.face()
        each.begin()
        x, y = each.gliding
        surface, most = present.table.surface, self.scale.none * self.scale.none
        if surface.rolls:  # Such a slip moves its ball unseen until it has faded.
            most = max(0.245 * self.tolerance * surface.pull, most)
        if each.slows and x * x + y * y <= most:
            each.settle()
            each.is_struck = each.ball.hits > FEW  # It would slip into the same hit again.
        each.mode = each.phase

    def _stays(self, present: Present, group: Group, one: Touch, parting: float) -> bool:
        """Tell whether two sides that part (m/s) stay together, to the eye."""
        e, a, b = one.pair.restitution, one.a.ball, None if one.b is None else one.b.ball
        v = parting if parting > 0.0 else -e * parting
        if not one.on:
            x, y = one.struck
            # Sides may have been pulled together, or not have bounced, that nothing presses then.
            is_pulled = x * one.nx + y * one.ny < -self.scale.none * one.unit
            parts = parting < 0.0 and v > self._hushed(present, a, b)
            return one.opening >= -self.scale.none and not is_pulled and not parts
        if one.is_jammed:
            return False
        press = one.n * one.softness
        if v <= self.scale.none or one.is_dull:
            return True
        room = self._tolerance(present, a, b)
        lost = max(1.0 - e * e, TINY if group.has_alone(one) else SHARED)
        if press <= 0.0 or v * v > 2.0 * press * lost * room:
            return False
        if v <= self._hushed(present, a, b):
            return True
        bounces = 2.0 * v / (press * (1.0 - math.sqrt(1.0 - lost)))
        for each in one.members:
            slips = each.phase == SLIP and each.left() > self.scale.none
            if slips and each.fades_in() < bounces:
                return False
        return True


def jam_around(present: Present, touches: list[Touch]) -> bool:
    """Let walls go through balls that have no room; tell whether one does."""
    jammed = [one for one in touches if one.is_jammed]
    for one in jammed:
        if one.wall is not None:
            present.jam(one.a.ball, one.wall)
    return len(jammed) > 0


def add(members: list[Member], member: Member) -> None:
    """Add a member in the next place."""
    member.place = len(members)
    members.append(member)


def member_of(members: list[Member], ball: Ball) -> Member | None:
    for each in members:
        if each.ball is ball:
            return each
    return None


def parts_of(group: Group, now: float) -> list[Group]:
    """Return the parts of a group that contacts join, and in which a ball moves; it may be one."""
    found = list[Group]()
    parts = joined(group.members, [one for one in group.touches if one.on])
    may_press = [one for one in group.touches if one.on or (one.closed and one.rests_in_part)]
    for part, touches in zip(parts, sorted_to(parts, may_press)):
        if len(touches) == 0 or all(each.phase == REST for each in part):
            continue
        if len(parts) == 1:
            group.touches = touches
            return [group]
        new = Group(part, touches, now, group.scale)
        new.list_unknowns()
        found.append(new)
    return found
