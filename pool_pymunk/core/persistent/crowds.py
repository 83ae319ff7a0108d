"""Crowds begin where balls hit each other over and over, and end where few press on each other."""

from __future__ import annotations

import math
from typing import Final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.times import INF, length_of
from pool_pymunk.core.persistent.crowd import Crowd
from pool_pymunk.core.persistent.gathering import gathering_of
from pool_pymunk.core.persistent.gatherings import SHORTEST, SOON, is_worn, put, wear_out
from pool_pymunk.core.persistent.member import Member
from pool_pymunk.core.persistent.persistence import sides_of
from pool_pymunk.core.persistent.scale import Scale, scale_of_speed
from pool_pymunk.core.persistent.touch import Touch
from pool_pymunk.core.persistent.unseen import CROWD, MOST, Unseen
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due

MANY: Final = 1000  # CROWD balls or fewer are a crowd after so many hits, together.
# balls; more that press on each other are a crowd at once. Where balls fall, more than CROWD are:
# there they hit each other most of the time.
LARGE: Final = 16
STRIDE: Final = 0.05  # radii; a step of a crowd moves no ball farther
# s; balls that fall rest once they have not moved for so long, to the eye. In that time even a ball
# that is pulled by a share of 1e-4 of gravity would be seen to move.
CALM: Final = 0.25
NEIGHBOURS: Final = 6  # So many equal discs touch one. Of more contacts the old ones are forgotten.


class Crowds(Unseen):
    """The crowds of an engine."""

    def __init__(self, scale: Scale) -> None:
        super().__init__(scale)
        self.crowds = 0  # steps, so far
        self.room = 2.0 * MOST * self.tolerance  # m
        self.shortest = math.sqrt(self.room / scale.pull)  # s; of steps
        self.last: dict[tuple[int, int], Touch] = {}  # of crowds, by their sides
        # where a ball of a crowd has been for how long: a place (m), since a time (s)
        self.places: dict[int, tuple[float, float, float]] = {}

    def _look_at_speeds(self, present: Present) -> None:
        """Let the fastest ball tell what is usual, where no friction slows balls."""
        if present.pull > 0.0:
            return
        fastest = max([ball.path.speed for ball in present.balls])
        self.scale = scale_of_speed(self.scale.tolerance, self.scale.radius, fastest)
        self.shortest = math.sqrt(self.room / self.scale.pull)

    def _crowds(self, present: Present, dues: list[Due]) -> bool:
        """Let a crowd begin in place of hits, if one of their balls has been hit too often."""
        seeds = balls_of(dues)
        return self._may_crowd(present, seeds) and self._crowd(present, self._near(present, seeds))

    def _may_crowd(self, present: Present, seeds: list[Ball]) -> bool:
        """Tell whether one of these balls has been hit too often, or there are very many."""
        is_one_worn = any(is_worn(ball, present.now) for ball in seeds)
        return is_one_worn or len(present.balls) > self._largest(present)

    def _largest(self, present: Present) -> int:
        """Return how many balls that press on each other are a group, and no crowd."""
        return LARGE if present.table.slows else CROWD

    def _crowd(self, present: Present, balls: list[Ball]) -> bool:
        """Let balls that are near each other be a crowd, if there are enough."""
        is_one_worn = any(is_worn(ball, present.now) for ball in balls)
        are_crowd = is_crowd(balls, present.now, present.table.slows)
        if not (len(balls) > self._largest(present) or (is_one_worn and are_crowd)):
            return False
        self._look_at_speeds(present)
        self._begin_crowd(present, self._taken_out(present, balls), self.shortest)
        return True

    def _taken_out(self, present: Present, balls: list[Ball]) -> list[Member]:
        """Return balls as members of a crowd, with all of other crowds, and take them out there."""
        found = list[Member]()
        for ball in balls:
            group = gathering_of(ball)
            if group is not None and group.is_over:
                found += [each for each in group.members if each.ball is ball]
                ball.group = None
            elif group is not None:
                others = [each.ball for each in group.members] if group.answers_all else [ball]
                self.leave(present, ball)
                found += [self._member(present, other) for other in others]
            elif all(each.ball is not ball for each in found):
                found.append(self._member(present, ball))
        taken = {each.ball.number for each in found}
        self.loose = [ball for ball in self.loose if ball.number not in taken]
        return found

    def _near(self, present: Present, seeds: list[Ball]) -> list[Ball]:
        """Return the balls around some that may press on each other within the shortest step."""
        found = list(seeds)
        known = {ball.number for ball in seeds}
        for ball in found:  # It grows.
            crowd = gathering_of(ball)
            if crowd is not None and crowd.answers_all:
                for each in crowd.members:
                    if each.ball.number not in known:
                        known.add(each.ball.number)
                        found.append(each.ball)
            x, y, vx, vy = ball.path.at(present.now)
            for other in present.near.around(ball):
                if other.number in known or ball.ignores(other.categories, other.mask):
                    continue
                p, q, u, v = other.path.at(present.now)
                dx, dy = p - x, q - y
                distance = math.sqrt(dx * dx + dy * dy)
                closing = ((vx - u) * dx + (vy - v) * dy) / distance
                gap = distance - ball.radius - other.radius
                if gap <= self.tolerance + max(closing, 0.0) * self.shortest:
                    known.add(other.number)
                    found.append(other)
        return found

    def _begin_crowd(self, present: Present, members: list[Member], pace: float) -> None:
        """Let balls be a crowd, with all that they meet in its first step, which it plays."""
        for each in members:
            speed = math.sqrt(each.vx * each.vx + each.vy * each.vy)
            if speed * pace > STRIDE * each.ball.radius:
                pace = STRIDE * each.ball.radius / speed
        pace = self._pace_beside_movers(present, members, pace)
        touches = self._reach(present, members)
        crowd = Crowd(members, touches, present.now, self.scale, pace)
        crowd.halts = present.now + pace >= self._motions_end(present)
        for each in members:
            braked = self.braked.get(each.ball.number, present.now)
            each.share = min(max((present.now + pace - braked) / pace, 0.0), 1.0)
        self.crowds += 1
        crowd.play(present.now)
        others = self._met_by(present, crowd)
        if len(others) > 0:
            for each in members:
                each.go_back()
            self._begin_crowd(present, members + self._taken_out(present, others), pace)
            return
        present.recorder.crowd(len(members), present.now, present.now + pace, crowd.overlap)
        for each in members:
            self.braked.pop(each.ball.number, None)
            each.ball.group = crowd
        for each in members:
            if crowd.rests(each):
                self._rest(present, each)
            else:
                present.lead(each.ball, crowd.path(each))
                put(self.loose, each.ball)
                crowd.leader = each.ball

    def _met_by(self, present: Present, crowd: Crowd) -> list[Ball]:
        """Return the other balls that a crowd meets in its step."""
        found, end = list[Ball](), present.now + crowd.time
        known = {each.ball.number for each in crowd.members}
        for each in crowd.members:
            ball = each.ball
            path, ball.path = ball.path, crowd.path(each)
            present.near.put(ball, present.now, end)
            ball.path = path
            for other in present.near.around(ball):
                if other.number in known or ball.ignores(other.categories, other.mask):
                    continue
                x, y = other.path.place(end)
                dx, dy = x - each.x, y - each.y
                near = ball.radius + other.radius + self.tolerance
                if dx * dx + dy * dy < near * near:
                    known.add(other.number)
                    found.append(other)
        return found

    def _reach(self, present: Present, members: list[Member]) -> list[Touch]:
        """Return the touches that may close in a step: two balls move by two strides at most."""
        found = list[Touch]()
        in_line = sorted(members, key=lambda each: each.x)
        widest = 2.0 * (1.0 + STRIDE) * max([each.ball.radius for each in members])
        for k, a in enumerate(in_line):
            ball, r = a.ball, a.ball.radius
            for b in in_line[k + 1 :]:
                other, dx, dy = b.ball, b.x - a.x, b.y - a.y
                if dx > widest:
                    break
                near, square = (1.0 + STRIDE) * (r + other.radius), dx * dx + dy * dy
                if square <= near * near and not ball.ignores(other.categories, other.mask):
                    found.append(self._beside(present, a, b))
            for wall in present.table.walls:
                far = 2.0 * STRIDE * r if wall.moves else STRIDE * r
                one = self._touch_of(present, a, wall, far)
                if one is not None:
                    found.append(one)
        now = present.now
        if len(self.last) > NEIGHBOURS * len(present.balls):
            self.last = {key: one for key, one in self.last.items() if now - one.a.time < SOON}
        for one in found:
            key = sides_in(one)
            known = self.last.get(key)
            goes_on = known is not None and known.a.time == now
            if known is None or not goes_on or one.a.slows:
                one.n = one.t = one.i = 0.0
            else:  # It presses as it did.
                one.n, one.t, one.i = known.n, known.t, known.i
            self.last[key] = one
        return found

    def _beside(self, present: Present, a: Member, b: Member) -> Touch:
        """Return the touch of two members; a table of a user's is not asked again and again."""
        known = self.last.get(sides_of(a.ball, b.ball, None))
        if known is None or present.now - known.a.time >= SOON:
            return Touch(a, b, None, None, present.table.pair(a.ball, b.ball))
        return known if known.a is a and known.b is b else Touch(a, b, None, None, known.pair)

    def _pace_beside_movers(self, present: Present, members: list[Member], pace: float) -> float:
        """Return how long (s) a step may be, so that walls that move come no farther than balls."""
        now = present.now
        pace = min(pace, self._motions_end(present) - now)
        for wall in present.table.walls:
            for each in members if wall.moves and wall.until > now else []:
                r = each.ball.radius
                speed = length_of(*wall.drift(each.x, each.y, r, now))
                gap = wall.nearest(each.x, each.y, r, now).gap(each.x, each.y, r)
                if speed * pace > max(gap - STRIDE * r, STRIDE * r):
                    pace = STRIDE * r / speed
        return pace

    def _motions_end(self, present: Present) -> float:
        """Return until when (s) all walls move as they do now."""
        soon, end = present.now + SHORTEST * self.scale.least, INF
        for wall in present.table.walls:
            if wall.until > soon:
                end = min(end, wall.until)
        return end

    def _go_on_crowded(self, present: Present, crowd: Crowd) -> None:
        """Go on at the end of a step: parts with few hits go on as groups, or alone."""
        crowd.is_over = True
        for each in crowd.members:
            wear_out(each.ball, present.now)
        if any(one.has_sunk(STRIDE) for one in crowd.touches):
            for one in crowd.touches:
                if one.on and one.wall is not None and one.wall.moves:
                    present.jam(one.a.ball, one.wall)
        soon = crowd.next_pace(crowd.members, self.room, self.shortest)
        for joint in crowd.parts(self.tolerance, soon):
            part = [each for each in joint if each.ball.group is crowd]  # No other part has met it.
            for each in part:
                each.ball.group = None
            if len(part) == 0:
                continue
            moves = any(not crowd.rests(each) for each in part)
            if self._is_calm(present, part):
                self._let_sleep(present, crowd, part)
                continue
            if moves and is_crowd([each.ball for each in part], present.now, crowd.slows):
                pace = crowd.next_pace(part, self.room, self.shortest)
                self._begin_crowd(present, part, pace)
                continue
            for each in part:
                self._let_go(present, each)
                put(self.seeds, each.ball)

    def _is_calm(self, present: Present, part: list[Member]) -> bool:
        """Tell whether no ball of a part that falls has moved visibly for a while."""
        is_calm, now = True, present.now
        if any(each.slows for each in part):
            return False
        for each in part:
            x, y, since = self.places.get(each.ball.number, (INF, INF, now))
            if abs(each.x - x) + abs(each.y - y) > MOST * self.tolerance:
                since = now
                self.places[each.ball.number] = each.x, each.y, now
            is_calm = is_calm and now - since >= CALM
        return is_calm

    def _let_sleep(self, present: Present, crowd: Crowd, part: list[Member]) -> None:
        """Let balls of a crowd rest that hold each other, until something comes."""
        touches = [one for one in crowd.touches if one.a in part]
        asleep = Crowd(part, touches, present.now, self.scale, crowd.pace)
        asleep.sleep(present.now)
        for each in part:
            each.ball.group = asleep
            self._rest(present, each)


def balls_of(dues: list[Due]) -> list[Ball]:
    """Return the balls of some hits, each of them once."""
    found: list[Ball] = []
    for due in dues:
        for ball in due.balls:
            put(found, ball)
    return found


def sides_in(one: Touch) -> tuple[int, int]:
    """Return the numbers of the two sides of a touch."""
    return sides_of(one.a.ball, None if one.b is None else one.b.ball, one.wall)


def is_crowd(balls: list[Ball], now: float, slows: bool) -> bool:
    """Tell whether balls have been hit so often of late, together, that they are a crowd.

    Where friction does not slow them, two are enough.
    """
    hits = 0
    for ball in balls:
        if now - ball.hit < SOON:
            hits += ball.hits
    return len(balls) > (CROWD if slows else 1) or hits > MANY
