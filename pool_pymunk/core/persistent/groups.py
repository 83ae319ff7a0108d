"""Groups of balls that press on each other form, go on, and are taken apart, here.

Two sides that touch stay together if what presses them makes the bounces to come too low to be
seen. A hit takes the groups of its balls apart first; what presses after it is a group again.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact, Pair
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.persistent.bounces import spare_drag
from pool_pymunk.core.persistent.group import NEVER, Group
from pool_pymunk.core.persistent.member import REST, ROLL, SLIP, Member
from pool_pymunk.core.persistent.persistence import Persisted, Persistence, sides_of
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.spells import Spells
from pool_pymunk.core.persistent.touch import Touch
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due, hit_at
from pool_pymunk.core.table import Table, may_press
from pool_pymunk.core.walls.wall import Wall

STRONGEST: Final = 2.0  # Surface friction presses two sides together by no more than so many pulls.
# Once a ball has had FEW hits, each less than SOON (s) after the one before, each further one lets
# GROWTH times as much go unseen, up to MOST times.
FEW: Final = 15
SOON: Final = 0.05
SMOOTH: Final = 1e-6  # radii, and rad; sides whose ends differ by less are one smooth line
GROWTH: Final = 1.3
MOST: Final = 100.0
# A bounce of balls that touch others, too, loses at least this share of its energy by them.
SHARED: Final = 0.1
SUNK: Final = 1e-3  # radii; balls that have waited for a contact have sunk in by less
CROWD: Final = 8  # balls; where more are together, hits are faint whatever presses
FAINT: Final = 1e-4  # of the surface's pull; what presses less may be rounding of a short piece
WIDEST: Final = 1e-3  # radii; a tolerance is no wider
TINY: Final = 1e-6  # Where no energy is lost, bounces of this share of the tolerance are none.


@final
class Cluster:
    """A cluster has the balls and contacts around a hit, and the groups that they form."""

    def __init__(self, members: list[Member], touches: list[Touch], groups: list[Group]) -> None:
        self.members = members
        self.touches = touches
        self.groups = groups

    def holds(self, due: Due) -> bool:
        """Tell whether a contact is one of the cluster."""
        return any([is_of(one, due.a, due.b, due.wall) for one in self.touches])


def persistence_of(table: Table, balls: list[Ball], tolerance: float) -> Persistence:
    """Return what plays contacts that persist to a tolerance (m), if there may be any."""
    if not may_press(table):
        return Persistence()
    least = min([ball.radius for ball in balls])
    return Groups(Scale(min(tolerance, WIDEST * least), least, table.pull))


@final
class Groups(Persistence):
    """The groups of an engine; ``loose`` balls are to be predicted at the end of an instant."""

    def __init__(self, scale: Scale) -> None:
        super().__init__()
        self.scale = scale
        self.tolerance = scale.tolerance
        self.quiet: dict[tuple[int, int], float] = {}  # s; until when slow hits wait
        self.is_hushed = False  # There are some.
        self.opened: dict[tuple[int, int], float] = {}  # s; until when opened contacts are none
        # s; when groups have begun or could not, have begun, and were taken apart
        self.tried = self.formed = self.freed = -INF
        self.pace = scale.first  # s; twice the last piece, a guess for the next group's first one
        self.spells = Spells()
        self.pieces = self.misfits = self.begun = self.absorbed = 0

    def begin_run(self) -> None:
        super().begin_run()
        self.quiet.clear()
        self.opened.clear()
        self.is_hushed = False
        self.tried = self.formed = self.freed = -INF
        self.pace = self.scale.first
        self.spells.clear()
        self.pieces = self.misfits = self.begun = self.absorbed = 0

    # -- what is asked by the engine -----------------------------------------------------------

    def allows(self, present: Present, hit: Due) -> float:
        """Return when (s) a predicted hit is due: later, or never if its sides are in contact."""
        t, a, b, wall = hit.t, hit.a, hit.b, hit.wall
        group = a.group
        if group is not None and (b is None or b.group is group):
            for one in group.touches:
                if is_of(one, a, b, wall):
                    return INF
        if t <= present.now and (wall is None or not wall.is_pocket):
            hit_now = self._contact(present, a, b, wall)
            until = self.quiet.get(sides_of(a, b, wall), -INF)
            if until > present.now and hit_now.closing <= 2.0 * MOST * self.scale.hushed:
                return until
            if self.formed == present.now and hit_now.closing <= self._hushed(present, a, b):
                return self._wait(present, a, b, wall)
            if hit_now.closing <= max(hit_now.noise, self.scale.noise) < INF:
                if self._press(present, hit_now) > FAINT * present.pull:
                    if self.tried == present.now:
                        return self._wait(present, a, b, wall)
                    put(self.loose, a)
                elif a.hits > FEW or not (b is None or present.is_closed(hit, 1.0)):
                    return self._wait(present, a, b, wall)
        if not self.is_hushed:
            return t
        until = self.quiet.get(sides_of(a, b, wall), t)
        return max(t, until) if until > t and self._is_slow(present, a, b, wall) else t

    def _is_slow(self, present: Present, a: Ball, b: Ball | None, wall: Wall | None) -> bool:
        """Tell whether two sides close so slowly that they may wait for a moment."""
        return self._contact(present, a, b, wall).closing <= self._hushed(present, a, b)

    def _contact(self, present: Present, a: Ball, b: Ball | None, wall: Wall | None) -> Contact:
        """Return the present contact of two sides."""
        return present.contact(present.disc(a), None if b is None else present.disc(b), wall)

    def release(self, present: Present, dues: list[Due]) -> None:
        """Take the groups of balls apart that are due, if they close."""
        for due in dues:
            if not self._is_nothing(present, due):
                self.take_apart(present, due.a)
                if due.b is not None:
                    self.take_apart(present, due.b)

    def _is_nothing(self, present: Present, due: Due) -> bool:
        """Tell whether a hit is one by rounding alone, or has waited until its sides had parted."""
        a, b, wall = due.a, due.b, due.wall
        if wall is not None and wall.is_pocket:
            return False
        is_grouped = a.group is not None or (b is not None and b.group is not None)
        has_waited = self.is_hushed and sides_of(a, b, wall) in self.quiet
        if not (is_grouped or has_waited):
            return False
        closing = self._contact(present, a, b, wall).closing
        return closing <= self.scale.noise if is_grouped else closing <= 0.0

    def _absorbs(self, present: Present, dues: list[Due]) -> bool:
        """Let groups begin instead of hits, if these would be too faint to be seen."""
        seeds: list[Ball] = []
        for due in dues:
            put(seeds, due.a)
            if due.b is not None:
                put(seeds, due.b)
        for ball in (*self.loose, *self.seeds):
            if ball.group is None and not ball.is_off:
                put(seeds, ball)
        for due in dues:
            one = self._contact(present, due.a, due.b, due.wall)
            may = len(seeds) > CROWD or (
                self._is_pressed(present, one) and not self._goes_on(present, one)
            )
            if not (may and self.are_faint(present, [one])):
                return False
            self.opened.pop(sides_of(due.a, due.b, due.wall), None)
        cluster = self._form(present, seeds)
        if len(cluster.groups) == 0 or not all([cluster.holds(due) for due in dues]):
            return False
        self.absorbed += 1
        self._begin_in(present, cluster)
        return True

    def _goes_on(self, present: Present, one: Contact) -> bool:
        """Tell whether a hit follows from another one of this instant, and is not very slow."""
        a, b, now = one.a.ball, one.b, present.now
        follows = a.hit == now or (b is not None and b.ball.hit == now)
        return follows and one.closing > self._hushed(present, a, None if b is None else b.ball)

    def concerns(self, present: Present, one: Contact) -> bool:
        """Tell whether a lone hit may be more than that: it is faint, or a group's."""
        if one.a.ball.group is not None or (one.b is not None and one.b.ball.group is not None):
            return True
        return not self._is_loud(present, one, one.closing) and self._is_faint(present, one)

    def go_after_lone(self, present: Present, one: Contact) -> None:
        """Do so after a lone hit, after which mostly nothing presses."""
        a, b = one.a.ball, None if one.b is None else one.b.ball
        if self._is_loud(present, one, -one.closing):
            self._note_hit(present, a)
            if b is not None:
                self._note_hit(present, b)
        else:
            self.go_after(present, [one], [a] if b is None else [a, b])

    def _is_loud(self, present: Present, one: Contact, speed: float) -> bool:
        """Tell whether a speed (m/s) is above all that may go unseen."""
        pull = STRONGEST * present.pull + abs(one.curvature) * one.slip * one.slip
        return (
            speed > 0.0
            and speed * speed
            > 4.0 * pull * MOST * self.tolerance + self.scale.noise * self.scale.noise
        )

    def loud(self, present: Present, dues: list[Due]) -> list[Due]:
        """Return the hits that are to be answered.

        None is if groups begin instead; where a group was hit, too slow ones wait.
        """
        nothing = [due for due in dues if self._is_nothing(present, due)]
        if len(nothing) > 0:
            for due in nothing:
                self._look_again(present, due)
            dues = [due for due in dues if not any([due is other for other in nothing])]
        if len(dues) > 0 and self._absorbs(present, dues):
            return []
        if self.freed != present.now:
            return dues
        found: list[Due] = []
        for due in dues:
            if self._is_slow(present, due.a, due.b, due.wall):
                self._wait(present, due.a, due.b, due.wall)
            else:
                found.append(due)
        return found

    def _look_again(self, present: Present, due: Due) -> None:
        """Look later whether two sides hit, or on a new path if they have parted meanwhile."""
        if due.a.group is None and (due.b is None or due.b.group is None):
            self.quiet.pop(sides_of(due.a, due.b, due.wall), None)
            self._set_off_again(present, due.a, [])
        else:
            self._wait(present, due.a, due.b, due.wall)

    def _wait(self, present: Present, a: Ball, b: Ball | None, wall: Wall | None) -> float:
        """Let a contact be none for a moment, in which nothing sinks in to be seen."""
        press = self._press(present, self._contact(present, a, b, wall))
        pull = max(STRONGEST * max(present.pull, 1e-9), press)
        until = present.now + math.sqrt(2.0 * self.tolerance / pull)
        self.quiet[sides_of(a, b, wall)] = until
        self.is_hushed = True
        return until

    def takes_over(self, present: Present, contacts: list[Contact], many: int) -> bool:
        return many > CROWD and self.are_faint(present, contacts)

    def are_faint(self, present: Present, contacts: list[Contact]) -> bool:
        """Tell whether all these hits are so faint that a group may begin instead."""
        for one in contacts:
            if one.closing <= self.scale.noise or not self._is_faint(present, one):
                return False
        return True

    def _is_faint(self, present: Present, one: Contact) -> bool:
        """Tell whether a hit is so faint that neither it nor what follows can be seen."""
        parting = one.pair.restitution * one.closing
        return one.closing <= self._unseen(present, one, 1.0) and self._parts_unseen(
            present, one, parting
        )

    def _lost(self, present: Present, one: Contact) -> float:
        """Return the share of the energy of a bounce that is lost, by other contacts, too."""
        e, a, b = one.pair.restitution, one.a.ball, one.b
        alone = len(self.loose) <= (1 if b is None else 2) and a.hit != present.now
        alone = alone and not any([ball is a for ball in self.seeds])
        alone = alone and (b is None or b.ball.hit != present.now)
        return max(1.0 - e * e, TINY if alone else SHARED)

    def go_after(self, present: Present, contacts: list[Contact], changed: list[Ball]) -> None:
        """Let groups begin after the hits of an instant."""
        for one in contacts:
            if self.is_hushed and one.b is None and one.closing <= 0.0:
                self._set_off_again(present, one.a.ball, changed)
        if any([ball.is_off for ball in self.loose]):  # A pocket has taken it in.
            self.loose = [ball for ball in self.loose if not ball.is_off]
        for ball in changed:
            if ball.group is not None:  # A cluster has drawn it in.
                self._take_apart_around(present, ball.group, changed)
            put(self.loose, ball)
            self._note_hit(present, ball)
        may = [one for one in contacts if self._parts_unseen(present, one, -one.closing)]
        if len(may) > 0 or len(self.loose) > len(changed):
            for ball in self.loose:
                put(self.seeds, ball)

    def form(self, present: Present) -> None:
        seeds = [ball for ball in self.seeds if ball.group is None and not ball.is_off]
        self.seeds = []
        self.tried = present.now
        self._begin_in(present, self._form(present, seeds))

    def _set_off_again(self, present: Present, ball: Ball, changed: list[Ball]) -> None:
        """Let a ball that has waited for a contact, but has missed it, go on along a new path."""
        if ball.group is not None or any([ball is one for one in changed]):
            return
        x, y, vx, vy = ball.path.at(present.now)
        if ball.rested == INF:
            present.begin(ball, (x, y), (vx, vy), present.roll_of(ball), ball.noise)
        else:
            ball.lead(standing(present.now, x, y), 0.0)
        put(self.loose, ball)

    def go_on(self, present: Present, ball: Ball) -> None:
        """Go on at the end of a piece: the mode may change."""
        group, now = ball.group, present.now
        if group is None:
            return
        group.add_up(self.spells)
        regains = any([-INF < one.free <= now for one in group.touches])
        for one in group.touches:
            one.regain_friction(now)
        if group.fell == NEVER and not regains:
            self._play(present, group)
        elif group.fell != NEVER and self._has_side_ended(group):
            pass_on(present, group.touches[group.fell // 4].a)
            self.take_apart(present, ball)
            self._begin_in(present, self._form(present, [*self.loose]))
        else:
            self._change(present, group)
            if not group.decide(now, False):
                self.misfits += 1
            parts = parts_of(group, now)
            if len(parts) == 1 and len(parts[0].members) == len(group.members):
                group.touches = parts[0].touches
                group.before, group.after = parts[0].before, parts[0].after
                self._play(present, group)
            else:
                for member in group.members:
                    member.ball.group = None
                for part in parts:
                    part.least = group.least
                    self._begin(present, part)
                for member in group.members:
                    if member.ball.group is None:
                        self._let_go(present, member)

    def leave(self, present: Present, ball: Ball) -> None:
        """Take the group of a ball apart, which is to go on otherwise."""
        self.take_apart(present, ball)

    def go_on_from(self, present: Present, ball: Ball) -> None:
        """Let groups begin around a ball that goes on otherwise."""
        put(self.loose, ball)
        self.go_after(present, [], [])

    def persisted(self, present: Present) -> list[Persisted]:
        for ball in present.balls:
            group = ball.group
            if group is not None and group.leader is ball:
                group.go_to(present.now)
                group.add_up(self.spells)
        return self.spells.rows()

    # -- how groups end ------------------------------------------------------------------------

    def take_apart(self, present: Present, ball: Ball) -> None:
        if ball.group is not None:
            self._take_apart_around(present, ball.group, [])

    def _take_apart_around(self, present: Present, group: Group, changed: list[Ball]) -> None:
        """Let the balls of a group go, except those that are on new paths already."""
        self.freed = present.now
        group.go_to(present.now)
        group.add_up(self.spells)
        for member in group.members:
            member.ball.group = None
            if not any([member.ball is ball for ball in changed]):
                self._let_go(present, member)

    def _let_go(self, present: Present, member: Member) -> None:
        """Let a ball go on by itself."""
        ball = member.ball
        if member.phase == REST:
            self._rest(present, member)
            return
        x, y, vx, vy, wx, wy = member.state
        present.begin(ball, (x, y), (vx, vy), (wx, wy), self.scale.noise)
        put(self.loose, ball)

    def _rest(self, present: Present, member: Member) -> None:
        """Let a ball rest in its place, if it does not yet."""
        ball = member.ball
        if ball.rested == INF:
            present.rest_at(ball, (member.x, member.y))
            put(self.loose, ball)

    def _has_side_ended(self, group: Group) -> bool:
        return group.fell < 4 * len(group.touches) and group.fell % 4 == 3

    def _change(self, present: Present, group: Group) -> None:
        """Change a mode at the end of its piece."""
        now, which = present.now, group.fell
        group.least = 2.0 * group.least if group.time < 4.0 * group.least else self.scale.least
        group.longest = max(self.pace, group.least)
        if 0 <= which < 4 * len(group.touches):
            one = group.touches[which // 4]
            if which % 4 == 0:
                b = None if one.b is None else one.b.ball
                one.later = self._wait(present, one.a.ball, b, one.wall)
                self.opened[sides_of(one.a.ball, b, one.wall)] = one.later
            elif which % 4 == 1 and one.slides != 0.0:
                one.stick()
            elif which % 4 == 2 and one.turns != 0.0:
                one.stop_turning()
        for each in group.members:
            left = each.left()
            if each.phase != REST and (
                left < 0.0 or (left <= 10.0 * self.scale.none and each.fades_in() < INF)
            ):
                was = each.phase
                each.settle()
                if group.time < 100.0 * self.scale.least:
                    each.held = now + 100.0 * self.scale.least
                if was == SLIP and each.phase == ROLL:
                    present.events += 1
                    present.recorder.roll(each.ball, now)
        group.close()

    # -- how groups begin ----------------------------------------------------------------------

    def _begin_in(self, present: Present, cluster: Cluster) -> None:
        """Let the groups of a cluster begin; other balls that were struck there go on alone."""
        if len(cluster.groups) == 0:
            return
        for group in cluster.groups:
            self.formed = present.now
            self._begin(present, group)
        for one in cluster.touches:
            if one.a.ball.group is None and one.struck != (0.0, 0.0):
                self.spells.add(one, present.now, present.now, one.struck)
        for member in cluster.members:
            if member.is_struck and member.ball.group is None:
                self._let_go(present, member)

    def _begin(self, present: Present, group: Group) -> None:
        self.begun += 1
        for member in group.members:
            member.ball.group = group
        group.longest = self.pace
        self._play(present, group)

    def _play(self, present: Present, group: Group) -> None:
        """Play the next piece of a group, and lead its balls along it, or let all of them rest."""
        if group.is_still:
            group.add_up(self.spells)
            for member in group.members:
                member.ball.group = None
                self._rest(present, member)
            return
        group.play(present.now)
        self.pace = min(max(2.0 * group.time, 100.0 * self.scale.least), self.scale.first)
        self.pieces += 1
        first: Ball | None = None
        for member in group.members:
            if member.phase == REST:
                self._rest(present, member)
                continue
            present.lead(member.ball, group.path(member))
            put(self.loose, member.ball)
            first = member.ball if first is None else first
        if first is not None:
            group.leader = first

    def _form(self, present: Present, seeds: list[Ball]) -> Cluster:
        """Return the cluster around some balls; its groups have not begun."""
        members, now = list[Member](), present.now
        touches = self._touches(present, seeds, members)
        parting = [one.opening for one in touches]
        states = [each.state for each in members]
        while len(touches) > 0:
            for each, state in zip(members, states):
                each.x, each.y, each.vx, each.vy, each.wx, each.wy = state
                each.is_struck = False
                self._set_phase(present, each)
            for one in touches:
                one.struck = 0.0, 0.0
                one.spared = 0.0
            group = Group(members, touches, now, self.scale)
            group.decide(now, True)
            for one, v in zip(touches, parting):
                spare_drag(one, v)
            if group.strike():
                group.decide(now, True)
            group.join()
            fits = group.goes_on(now) or group.decide(now, False)
            if not fits:
                self.misfits += 1
            keep = [self._stays(present, group, one, v) for one, v in zip(touches, parting)]
            if all(keep):
                for one in touches:
                    one.spare_friction(now)
                if any([one.free > now for one in touches]):
                    group.decide(now, False)
                return Cluster(members, touches, parts_of(group, now))
            parting = [v for v, kept in zip(parting, keep) if kept]
            touches = [one for one, kept in zip(touches, keep) if kept]
        return Cluster([], [], [])

    def _touches(self, present: Present, seeds: list[Ball], members: list[Member]) -> list[Touch]:
        """Return the contacts of a cluster that may persist; find its members."""
        found = list[Touch]()
        for ball in seeds:
            members.append(self._member(present, ball))
        k = 0
        while k < len(members):  # This list grows.
            found += self._touches_of_balls(present, members, k)
            found += self._touches_of_walls(present, members[k])
            k += 1
        return found

    def _touches_of_balls(self, present: Present, members: list[Member], k: int) -> list[Touch]:
        """Return the contacts of a member with balls that have not been looked at."""
        found, a = list[Touch](), members[k]
        for ball in present.near.around(a.ball):
            hit = hit_at(present.now, a.ball, ball, None)
            far = max(a.ball.radius, ball.radius)
            if a.ball.ignores(ball.categories, ball.mask) or not (
                -SUNK * far <= present.gap(hit) <= self.tolerance
            ):
                continue
            self.take_apart(present, ball)
            b = member_of(members, ball)
            if b is None:
                b = self._member(present, ball)
            elif is_before(members, b, k):
                continue
            one = Touch(a, b, None, None, present.table.pair(a.ball, ball))
            if self._may_persist(present, one, a.ball, ball, None):
                found.append(one)
                if member_of(members, ball) is None:
                    members.append(b)
        return found

    def _touches_of_walls(self, present: Present, a: Member) -> list[Touch]:
        """Return the contacts of a member with walls."""
        found, r = list[Touch](), a.ball.radius
        for wall in present.table.walls:
            if wall.is_pocket or a.ball.ignores(wall.categories, wall.mask):
                continue
            side = wall.nearest(a.x, a.y, r, present.now)
            if -SUNK * r <= side.gap(a.x, a.y, r) <= self.tolerance:
                pair = Pair(a.mass, INF, wall.restitution, wall.friction)
                one = Touch(a, None, wall, side, pair)
                if self._may_persist(present, one, a.ball, None, wall):
                    found.append(one)
        return found

    def _member(self, present: Present, ball: Ball) -> Member:
        path = ball.path
        return Member(
            ball,
            self.scale,
            present.table.surface_of(ball.patch),
            path.at(present.now),
            present.roll_of(ball),
        )

    def _may_persist(
        self, present: Present, one: Touch, a: Ball, b: Ball | None, wall: Wall | None
    ) -> bool:
        one.look()
        one.on = True
        e, v = one.pair.restitution, one.opening
        pull = STRONGEST * present.pull + abs(one.bend) * one.slip * one.slip
        most = math.sqrt(2.0 * pull * self._tolerance(present, a, b))
        until = self.opened.get(sides_of(a, b, wall), -INF)
        return (
            until <= present.now
            and -most <= v
            and (v if v > 0.0 else -e * v)
            <= most * math.sqrt(max(1.0 - e * e, SHARED)) + self.scale.noise
        )

    def _set_phase(self, present: Present, each: Member) -> None:
        """Find the phase of a member; a slip rolls that would fade unseen."""
        each.phase = SLIP
        x, y = each.gliding
        if x * x + y * y <= self._faint_slip(present):
            each.settle()
        each.mode = each.phase

    def _faint_slip(self, present: Present) -> float:
        """Return the square of a slip (m/s) that moves its ball unseen until it has faded."""
        surface = present.table.surface
        return (
            max(0.245 * self.tolerance * surface.pull, self.scale.none * self.scale.none)
            if surface.rolls
            else self.scale.none * self.scale.none
        )

    def _stays(self, present: Present, group: Group, one: Touch, parting: float) -> bool:
        """Tell whether two sides that part (m/s) stay together, to the eye."""
        if not one.on:
            return one.opening >= -self.scale.none
        e = one.pair.restitution
        v = parting if parting > 0.0 else -e * parting
        press = one.n * one.softness
        if v <= self.scale.none:
            return True
        room = self._tolerance(present, one.a.ball, None if one.b is None else one.b.ball)
        lost = max(1.0 - e * e, TINY if group.has_alone(one) else SHARED)
        if press <= 0.0 or v * v > 2.0 * press * lost * room:
            return False
        if v <= self._hushed(present, one.a.ball, None if one.b is None else one.b.ball):
            return True
        bounces = 2.0 * v / (press * (1.0 - math.sqrt(1.0 - lost)))
        for each in (one.a, one.b):
            if each is not None and each.phase == SLIP and each.fades_in() < bounces:
                return False
        return True

    def _is_pressed(self, present: Present, one: Contact) -> bool:
        """Tell whether the paths of two sides that hit press them, so that bounces are not seen."""
        press, e, v = self._press(present, one), one.pair.restitution, one.closing
        room = self._tolerance(present, one.a.ball, None if one.b is None else one.b.ball)
        return press > 0.0 and e * e * v * v <= 2.0 * press * self._lost(present, one) * room

    def _press(self, present: Present, one: Contact) -> float:
        """Return how strongly (m/s^2) the present paths press two sides together."""
        a = one.a.ball.path
        x, y = a.ax, a.ay
        if one.b is not None:
            b = one.b.ball.path
            x, y = b.ax - x, b.ay - y
        bend = one.curvature
        if one.b is not None:
            bend = 1.0 / (one.a.ball.radius + one.b.ball.radius)
        return -(x * one.nx + y * one.ny) - bend * one.slip * one.slip

    def _tolerance(self, present: Present, a: Ball, b: Ball | None) -> float:
        """Return what may go unseen (m)."""
        return self._wear(present, a, b) * self.tolerance

    def _hushed(self, present: Present, a: Ball, b: Ball | None) -> float:
        """Return the speed (m/s) below which hits around groups may wait."""
        many = len(self.seeds) + len(self.loose)
        if a.group is not None:
            many = max(many, len(a.group.members))
        return self.scale.hushed * (self._wear(present, a, b) if many > CROWD else 1.0)

    def _wear(self, present: Present, a: Ball, b: Ball | None) -> float:
        """Return how many times more may go unseen, because these balls have hit often of late."""
        hits, now = a.hits if present.now - a.hit < SOON else 0, present.now
        if b is not None and now - b.hit < SOON:
            hits = max(hits, b.hits)
        times = 1.0
        while hits > FEW and times < MOST:
            times, hits = GROWTH * times, hits - 1
        return times

    def _note_hit(self, present: Present, ball: Ball) -> None:
        now = present.now
        ball.hits = ball.hits + 1 if now - ball.hit < SOON else 1
        ball.hit = now
        ball.creep = self.scale.creep if ball.hits > FEW else 0.0

    def _unseen(self, present: Present, one: Contact, lost: float) -> float:
        """Return the speed (m/s) at which sides part unseen, whatever presses them."""
        pull = STRONGEST * present.pull + abs(one.curvature) * one.slip * one.slip
        room = self._tolerance(present, one.a.ball, None if one.b is None else one.b.ball)
        return math.sqrt(2.0 * pull * lost * room)

    def _parts_unseen(self, present: Present, one: Contact, parting: float) -> bool:
        return parting <= self._unseen(present, one, self._lost(present, one)) + self.scale.noise


def is_of(one: Touch, a: Ball, b: Ball | None, wall: Wall | None) -> bool:
    """Tell whether a touch is that of two balls, or of a ball and a wall."""
    if one.b is None:
        return b is None and one.a.ball is a and one.wall is wall
    return (one.a.ball is a and one.b.ball is b) or (one.a.ball is b and one.b.ball is a)


def pass_on(present: Present, each: Member) -> None:
    """Lead a ball that has come to the end of a side along the next one, if it goes on smoothly.

    It is a little beyond the end, so it has turned a little too far, or not enough.
    """
    r, far = each.ball.radius, SMOOTH * each.ball.radius
    for wall in present.table.walls:
        if wall.is_pocket:
            continue
        side = wall.nearest(each.x, each.y, r, present.now)
        gap, (nx, ny) = side.gap(each.x, each.y, r), side.normal(each.x, each.y)
        across = each.vx * nx + each.vy * ny
        along = each.vx * ny - each.vy * nx
        if abs(gap) <= far and abs(across) <= SMOOTH * abs(along):
            each.x, each.y = each.x - gap * nx, each.y - gap * ny
            each.vx, each.vy = each.vx - across * nx, each.vy - across * ny
            if each.phase == ROLL:
                each.wx, each.wy = each.vx, each.vy


def member_of(members: list[Member], ball: Ball) -> Member | None:
    for each in members:
        if each.ball is ball:
            return each
    return None


def is_before(members: list[Member], member: Member, count: int) -> bool:
    for k in range(count):
        if members[k] is member:
            return True
    return False


def put(balls: list[Ball], ball: Ball) -> None:
    """Put a ball into a list, once."""
    for other in balls:
        if other is ball:
            return
    balls.append(ball)


def parts_of(group: Group, now: float) -> list[Group]:
    """Return the parts of a group that contacts join, and in which a ball moves."""
    parts: list[Group] = []
    left = list(group.members)
    while len(left) > 0:
        part = [left[0]]
        touches: list[Touch] = []
        for each in part:  # It grows.
            for one in group.touches:
                if one.on and one.has(each) and not any([one is other for other in touches]):
                    touches.append(one)
                    for other in (one.a, one.b):
                        if other is not None and not any([other is known for known in part]):
                            part.append(other)
        left = [each for each in left if not any([each is known for known in part])]
        for one in group.touches:
            if one.closed and not one.on and one.rests_in(part):
                touches.append(one)  # It may press as soon as a ball is let go.
        if len(touches) > 0 and any([each.phase != REST for each in part]):
            new = Group(part, touches, now, group.scale)
            for force in group.unknowns:
                if any([force.touch is one for one in touches]):
                    new.hold(force.touch, force.kind)
            new.make_room()
            parts.append(new)
    return parts
