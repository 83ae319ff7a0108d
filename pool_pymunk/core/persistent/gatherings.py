"""Groups and crowds end here: their balls go on alone, or rest."""

from __future__ import annotations

from typing import Final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Pair
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.persistent.gathering import Gathering, gathering_of
from pool_pymunk.core.persistent.member import REST, ROLL, Member
from pool_pymunk.core.persistent.persistence import Persisted, Persistence
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.spells import Spell, Spells
from pool_pymunk.core.persistent.touch import Touch, is_of
from pool_pymunk.core.present import Present
from pool_pymunk.core.walls.wall import Wall

SOON: Final = 0.05  # s; hits that follow each other faster count together
# After so many hits a ball is one of a crowd. The hardest soft break that is known has some 45.
WORN: Final = 100
SUNK: Final = 1e-3  # radii; balls that have waited for a contact have sunk in by less
SHORTEST: Final = 1e-3  # of the shortest piece; a wall whose motion ends so soon presses no more


class Gatherings(Persistence):
    """The gatherings of an engine can be taken apart, and their spells are kept.

    ``freed`` (s) is when that was last done, and ``braked`` (s) until when the surface has slowed
    balls that have left a crowd within its step. Rolling resistance is ``spared`` (s) so long to
    balls that have left a group.
    """

    def __init__(self, scale: Scale) -> None:
        super().__init__()
        self.scale = scale
        self.spells = Spells()
        self.freed = -INF
        self.braked: dict[int, float] = {}
        self.spared: dict[int, float] = {}

    def begin_step(self, present: Present) -> None:
        for ball in present.balls:
            group = ball.group
            if group is not None and (group.halts or (group.answers_all and not group.sleeps)):
                self.leave(present, ball)

    def persisted(self, present: Present) -> list[Persisted]:
        for ball in present.balls:
            group = gathering_of(ball)
            if group is not None and group.leader is ball:
                group.go_to(present.now)
                group.add_up(self.spells)
        return self.spells.rows()

    def leave(self, present: Present, ball: Ball) -> None:
        group = gathering_of(ball)
        if group is not None:
            self._take_apart_around(present, group, [])

    def take_ended(self, balls: list[Ball]) -> list[Spell]:
        """Return the spells of contacts that are over, and forget them."""
        spells = self.spells
        if len(spells.last) == 0:
            return []
        over = [*spells.over, *[each for each in spells.last.values() if not goes_on(each, balls)]]
        spells.over.clear()
        spells.last = {key: each for key, each in spells.last.items() if goes_on(each, balls)}
        return [each for each in over if each.is_one]

    def _take_apart_around(self, present: Present, group: Gathering, changed: list[Ball]) -> None:
        """Let the balls of a group go, except those that are on new paths already."""
        self.freed = present.now
        group.go_to(present.now)
        group.add_up(self.spells)
        for member in group.members:
            member.ball.group = None
            if group.answers_all:
                wear_out(member.ball, present.now)
                if present.now > group.began:
                    self.braked[member.ball.number] = group.began + group.time
            if group.sleeps:  # If it rests again at this instant, nobody hears of it.
                member.ball.stopped = present.now
            if not any(member.ball is ball for ball in changed):
                self._let_go(present, member)

    def _let_go(self, present: Present, member: Member) -> None:
        """Let a ball go on by itself, without rolling resistance as long as that is spared."""
        ball = member.ball
        if member.phase == REST:
            self._rest(present, member)
            return
        x, y, vx, vy, wx, wy = member.state
        if member.phase == ROLL and member.spared > self.scale.least:
            end = self.spared[ball.number] = present.now + member.spared
            present.lead(ball, Path(present.now, x, y, vx, vy, 0.0, 0.0, end, False, wx, wy))
        else:
            present.begin(ball, (x, y), (vx, vy), (wx, wy), self.scale.noise)
        put(self.loose, ball)

    def _rest(self, present: Present, member: Member) -> None:
        """Let a ball rest in its place, if it does not yet."""
        ball = member.ball
        if ball.rested == INF:
            present.rest_at(ball, (member.x, member.y))
            put(self.loose, ball)

    def _member(self, present: Present, ball: Ball) -> Member:
        path, now = ball.path, present.now
        surface, roll = present.table.surface_of(ball.patch), present.roll_of(ball)
        member = Member(ball, self.scale, surface, path.at(now), roll, now)
        if len(self.spared) > 0:
            member.spared = max(self.spared.get(ball.number, now) - now, 0.0)
        return member

    def _touch_of(self, present: Present, a: Member, wall: Wall, far: float) -> Touch | None:
        """Return the touch of a ball and a wall that is no farther (m), or none.

        A wall that goes through the ball, or is about to move otherwise, presses on nothing.
        """
        ball, r, soon = a.ball, a.ball.radius, present.now + SHORTEST * self.scale.least
        if wall.is_pocket or ball.ignores(wall.categories, wall.mask) or wall.until <= soon:
            return None
        if wall.moves and present.squeezes.goes_through(ball, wall):
            return None
        side = wall.side_beside(a.x, a.y, r, present.now)
        if not -SUNK * r <= side.gap(a.x, a.y, r) <= far:
            return None
        return Touch(a, None, wall, side, Pair(a.mass, INF, wall.restitution, wall.friction))


def goes_on(spell: Spell, balls: list[Ball]) -> bool:
    """Tell whether the contact of a spell is one of a group now."""
    a, b, wall = spell.touch.a.ball, spell.touch.b, spell.touch.wall
    group, other = gathering_of(balls[a.number]), None if b is None else b.ball
    return group is not None and any(
        [one.on and is_of(one, a, other, wall) for one in group.touches]
    )


def put(balls: list[Ball], ball: Ball) -> None:
    """Put a ball into a list, once."""
    for other in balls:
        if other is ball:
            return
    balls.append(ball)


def is_worn(ball: Ball, now: float) -> bool:
    """Tell whether a ball has been hit over and over of late."""
    return ball.hits >= WORN and now - ball.hit < SOON


def wear_out(ball: Ball, now: float) -> None:
    ball.hits, ball.hit = max(ball.hits, WORN), now
