"""Groups of balls that press on each other form, go on, and are taken apart, here.

Two sides that touch stay together if what presses them makes the bounces to come too low to be
seen. A hit takes the groups of its balls apart first; what presses after it is a group again.
"""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.persistent.crowd import Crowd
from pool_pymunk.core.persistent.crowds import balls_of, sides_in
from pool_pymunk.core.persistent.forming import Cluster, Forming, jam_around, parts_of
from pool_pymunk.core.persistent.gathering import gathering_of
from pool_pymunk.core.persistent.gatherings import SHORTEST, put
from pool_pymunk.core.persistent.group import FINE, NEVER, Group
from pool_pymunk.core.persistent.member import FREE, REST, ROLL, SLIP, Member
from pool_pymunk.core.persistent.persistence import Persistence, sides_of
from pool_pymunk.core.persistent.scale import Scale, scale_of_speed
from pool_pymunk.core.persistent.touch import Touch
from pool_pymunk.core.persistent.unseen import CROWD, FEW, STRONGEST
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due
from pool_pymunk.core.table import Table, may_press

SMOOTH: Final = 1e-6  # radii, and rad; sides whose ends differ by less are one smooth line
FAINT: Final = 1e-4  # of the surface's pull; what presses less may be rounding of a short piece
WIDEST: Final = 1e-3  # radii; a tolerance is no wider


def persistence_of(table: Table, balls: list[Ball], tolerance: float) -> Persistence:
    """Return what plays contacts that persist to a tolerance (m), if there may be any."""
    if not may_press(table):
        return Persistence()
    least = min([ball.radius for ball in balls])
    tolerance = min(tolerance, WIDEST * least)
    if table.pull == 0.0:
        return Groups(scale_of_speed(tolerance, least, 0.0))
    return Groups(Scale(tolerance, least, table.pull))


@final
class Groups(Forming):
    """The groups of an engine; ``loose`` balls are to be predicted at the end of an instant.

    ``tried``, ``formed`` (s) are when groups have last begun or could not, and have begun.
    """

    def __init__(self, scale: Scale) -> None:
        super().__init__(scale)
        # s; since when slow hits wait, over and over, and until when they do
        self.quiet: dict[tuple[int, int], tuple[float, float]] = {}
        self.tried = self.formed = -INF

    def begin_run(self) -> None:
        super().begin_run()
        self.tried = -INF
        if self.is_hushed or self.formed > -INF or self.crowds > 0:
            self._forget()

    def _forget(self) -> None:
        """Forget what contacts have persisted, and what has waited."""
        self.quiet.clear()
        self.opened.clear()
        self.braked.clear()
        self.spared.clear()
        self.last.clear()
        self.places.clear()
        self.spells.clear()
        self.is_hushed = False
        self.formed = self.freed = -INF
        self.crowds = 0

    def begin_step(self, present: Present) -> None:
        super().begin_step(present)
        moving = [-1 - wall.place for wall in present.table.walls if wall.moves]
        if len(moving) > 0:  # They may go on otherwise than they did, so nothing waits for them.
            self.quiet = {k: t for k, t in self.quiet.items() if k[1] not in moving}

    # -- what is asked by the engine -----------------------------------------------------------

    def allows(self, present: Present, hit: Due) -> float:
        """Return when (s) a predicted hit is due: later, or never if its sides are in contact."""
        t, a, b, wall = hit.t, hit.a, hit.b, hit.wall
        group = gathering_of(a)
        if group is not None and (b is None or b.group is group) and group.holds(a, b, wall):
            return INF
        if t <= present.now and (wall is None or not wall.is_pocket):
            hit_now = self._contact(present, hit)
            until = self._waits_until(present, hit, hit_now)
            hushed = self._wear(present, a, b) * self.scale.hushed
            if until > present.now and hit_now.closing <= 2.0 * hushed:
                return until
            if self.formed == present.now and self._is_slow(present, hit_now):
                return self._wait(present, hit)
            if hit_now.closing <= max(hit_now.noise, self.scale.noise) < INF:
                if self._press(present, hit_now) > FAINT * present.pull:
                    if self.tried == present.now:
                        return self._wait(present, hit)
                    put(self.loose, a)
                elif a.hits > FEW or not (b is None or present.is_closed(hit, 1.0)):
                    return self._wait(present, hit)
        if not self.is_hushed or sides_of(a, b, wall) not in self.quiet:
            return t
        hit_now = self._contact(present, hit)
        until = self._waits_until(present, hit, hit_now)
        return until if until > t and self._is_slow(present, hit_now) else t

    def _is_nothing(self, present: Present, due: Due) -> bool:
        """Tell whether a hit is one by rounding alone, or has waited until its sides had parted."""
        a, b, wall = due.a, due.b, due.wall
        if wall is not None and wall.is_pocket:
            return False
        is_grouped = a.group is not None or (b is not None and b.group is not None)
        has_waited = self.is_hushed and sides_of(a, b, wall) in self.quiet
        if not (is_grouped or has_waited):
            return False
        one = self._contact(present, due)
        if is_grouped and self.scale.noise < one.closing and self._is_slow(present, one):
            one = self._exact(present, due)
        return one.closing <= self.scale.noise if is_grouped else one.closing <= 0.0

    def concerns(self, present: Present, one: Contact) -> bool:
        """Tell whether a lone hit may be more than that: it is faint, or a group's."""
        if one.a.ball.group is not None or (one.b is not None and one.b.ball.group is not None):
            return True
        if self._is_loud(present, one, one.closing):
            return False
        return self._is_faint(present, one) or self._is_dull(present, one)

    def loud(self, present: Present, dues: list[Due]) -> list[Due]:
        """Return the hits that are to be answered.

        None is if groups begin instead; where a group was hit, too slow ones wait.
        """
        found = list[Due]()
        for due in dues:
            if self._is_nothing(present, due):
                self._look_again(present, due)
            else:
                found.append(due)
        if len(found) == 0 or self._crowds(present, found):
            return []
        dues = found
        for ball in balls_of(dues):
            self.leave(present, ball)
        if self._absorbs(present, dues):
            return []
        if self.freed != present.now:
            return dues
        found = []
        for due in dues:
            if self._is_slow(present, self._contact(present, due)):
                self._wait(present, due)
                self._predict_anew([due])
            else:
                found.append(due)
        return found

    def _absorbs(self, present: Present, dues: list[Due]) -> bool:
        """Let groups begin instead of hits, if these would be too faint to be seen."""
        seeds = balls_of(dues)
        for ball in (*self.loose, *self.seeds):
            if ball.group is None and not ball.is_off:
                put(seeds, ball)
        for due in dues:
            one = self._contact(present, due)
            if self._is_dull(present, one):
                continue
            may = len(seeds) > CROWD or (
                self._is_pressed(present, one) and not self._goes_on(present, one)
            )
            if not (may and self.are_faint(present, [one])):
                return False
        cluster = self._form(present, seeds)
        if not all(cluster.holds(due) for due in dues):
            return False
        self._begin_in(present, cluster)
        self._predict_anew(dues)
        return True

    def _predict_anew(self, dues: list[Due]) -> None:
        """Predict balls anew whose hits are none: these have kept them from coming to an end."""
        for ball in balls_of(dues):
            put(self.loose, ball)

    def _goes_on(self, present: Present, one: Contact) -> bool:
        """Tell whether a hit follows from another one of this instant, and is not very slow."""
        a, b, now = one.a.ball, one.b, present.now
        follows = a.hit == now or (b is not None and b.ball.hit == now)
        return follows and one.closing > self._hushed(present, a, None if b is None else b.ball)

    def _look_again(self, present: Present, due: Due) -> None:
        """Look later whether two sides hit, or on a new path if they have parted meanwhile."""
        if due.a.group is None and (due.b is None or due.b.group is None):
            self.quiet.pop(sides_of(due.a, due.b, due.wall), None)
            self._set_off_again(present, due.a, [])
        else:
            self._wait(present, due)
            self._predict_anew([due])

    def _wait(self, present: Present, hit: Due) -> float:
        """Let a contact be none for a moment, in which nothing sinks in to be seen.

        One that soon waits again does so for as long as it has waited until now, or until it would
        sink in as it moves.
        """
        one, sides, now = self._contact(present, hit), sides_of(hit.a, hit.b, hit.wall), present.now
        least = self._shortest_wait(present, one)
        since, until = self.quiet.get(sides, (now, -INF))
        if now - until > max(least, until - since):
            since = now
        until = now + max(least, min(now - since, self._sinks_in(present, hit, one, now)))
        self.quiet[sides] = since, until
        self.is_hushed = True
        return until

    def _waits_until(self, present: Present, hit: Due, one: Contact) -> float:
        """Return until when (s) a contact waits, at most until it would sink in on new paths."""
        _since, until = self.quiet.get(sides_of(hit.a, hit.b, hit.wall), (-INF, -INF))
        t = max(hit.t, present.now)
        if until <= t:
            return until
        least = self._shortest_wait(present, one)
        return min(until, t + max(least, self._sinks_in(present, hit, one, t)))

    def takes_over(self, present: Present, contacts: list[Contact], many: int) -> bool:
        return many > CROWD and self.are_faint(present, contacts)

    def go_after_lone(self, present: Present, one: Contact) -> None:
        """Do so after a lone hit, after which mostly nothing presses."""
        if self._is_loud(present, one, -one.closing):
            self._note_hit(present, one.a.ball)
            if one.b is not None:
                self._note_hit(present, one.b.ball)
        else:
            self.go_after(present, [one], [each.ball for each in one.discs])

    def go_after(self, present: Present, contacts: list[Contact], changed: list[Ball]) -> None:
        """Let groups begin after the hits of an instant."""
        for one in contacts:
            if self.is_hushed and one.b is None and one.closing <= 0.0:
                self._set_off_again(present, one.a.ball, changed)
        if any(ball.is_off for ball in self.loose):  # A pocket has taken it in.
            self.loose = [ball for ball in self.loose if not ball.is_off]
        for ball in changed:
            group = gathering_of(ball)
            if group is not None:  # A cluster has drawn it in.
                self._take_apart_around(present, group, changed)
            put(self.loose, ball)
            self._note_hit(present, ball)
        may = [one for one in contacts if one.closing > 0.0 or self._is_faint(present, one)]
        if len(may) > 0 or len(self.loose) > len(changed):
            for ball in self.loose:
                put(self.seeds, ball)

    def form(self, present: Present) -> None:
        seeds = [ball for ball in self.seeds if ball.group is None and not ball.is_off]
        self.seeds = []
        left = seeds if self._may_crowd(present, seeds) else []
        while len(left) > 0:  # Those that are far from each other are no crowd together.
            near = self._near(present, left[:1])
            self._crowd(present, near)
            known = {ball.number for ball in near}
            left = [ball for ball in left if ball.group is None and ball.number not in known]
        self.tried = present.now
        self._begin_around(present, [ball for ball in seeds if ball.group is None])

    def _set_off_again(self, present: Present, ball: Ball, changed: list[Ball]) -> None:
        """Let a ball that has waited for a contact, but has missed it, go on along a new path."""
        if ball.group is not None or any(ball is one for one in changed):
            return
        x, y, vx, vy = ball.path.at(present.now)
        if ball.rested == INF:
            present.begin(ball, (x, y), (vx, vy), present.roll_of(ball), ball.noise)
        else:
            ball.lead(standing(present.now, x, y), 0.0)
        put(self.loose, ball)

    def go_on_from(self, present: Present, ball: Ball) -> None:
        """Let groups begin around a ball that goes on otherwise."""
        put(self.loose, ball)
        self.go_after(present, [], [])

    def go_on(self, present: Present, ball: Ball) -> None:
        """Go on at the end of a piece: the mode may change."""
        group = gathering_of(ball)
        if group is None:
            return
        group.add_up(self.spells)
        if isinstance(group, Crowd):
            self._go_on_crowded(present, group)
            return
        assert isinstance(group, Group), "a gathering is a crowd or a group"
        if self._breaks(present, group):
            self.leave(present, ball)
            self._begin_around(present, [*self.loose])
        elif group.fell == NEVER and not any(group.lets_rest(each) for each in group.members):
            self._play(present, group)
        else:
            self._go_on_otherwise(present, group)

    def _go_on_otherwise(self, present: Present, group: Group) -> None:
        """Go on in another mode, as one group, or as its parts."""
        now = present.now
        self._change(present, group)
        group.decide(now, False)
        parts = parts_of(group, now)
        if len(parts) == 1 and parts[0] is group:
            self._play(present, group)
            return
        for member in group.members:
            member.ball.group = None
        for part in parts:
            self._begin(present, part)
        for member in group.members:
            if member.ball.group is None:
                self._let_go(present, member)

    def _breaks(self, present: Present, group: Group) -> bool:
        """Tell whether a group has to form anew: a wall has no room, or a side has ended."""
        if jam_around(present, group.touches):
            return True
        if not 0 <= group.fell < 4 * len(group.touches) or group.fell % 4 != 3:
            return False  # No side has ended.
        pass_on(present, group.touches[group.fell // 4].a)
        return True

    def _change(self, present: Present, group: Group) -> None:
        """Change a mode at the end of its piece."""
        now, which = present.now, group.fell
        longer = min(2.0 * group.least, group.longest, self.scale.seen)
        is_again = now - group.changed < self._soon(group.least)
        group.least = max(longer if is_again else 0.0, FINE * self.scale.least)
        group.changed = now
        group.longest = max(group.members[0].ball.pace, group.least)
        for each in group.members:
            each.ball.changed, each.ball.least = now, group.least
            if group.settles(each):
                was = each.phase
                each.settle()
                if group.time < 100.0 * self.scale.least:
                    each.held = now + 100.0 * self.scale.least
                if was == SLIP and each.phase == ROLL:
                    present.events += 1
                    present.recorder.roll(each.ball, now)
        if 0 <= which < 4 * len(group.touches):
            one = group.touches[which // 4]
            if which % 4 == 0:
                for one in group.fallen():
                    self._open(present, one)
            elif which % 4 == 1 and one.slides != 0.0:
                one.stick()
            elif which % 4 == 2 and one.turns != 0.0 and one.a.phase >= SLIP:
                one.stop_turning()
        group.close()

    def _soon(self, least: float) -> float:
        """Return in what time (s) a mode changes again too soon that lasts so long (s) at least."""
        return 4.0 * max(least, self.scale.least)

    def _open(self, present: Present, one: Touch) -> None:
        """Let two sides be no contact for a moment, as nothing presses them."""
        self.quiet.pop(sides_in(one), None)  # It has not waited: it may soon press again.
        one.later = self._wait(present, one.hit_at(present.now))
        self.opened[sides_in(one)] = one.later

    def _begin_around(self, present: Present, seeds: list[Ball]) -> None:
        """Let groups begin around some balls, if they press on each other."""
        cluster = self._form(present, seeds)
        if len(cluster.groups) > 0:
            self._begin_in(present, cluster)

    def _begin_in(self, present: Present, cluster: Cluster) -> None:
        """Let the groups of a cluster begin; other balls that were struck there go on alone."""
        self.formed = present.now
        for group in cluster.groups:
            self._begin(present, group)
        for one in cluster.touches:
            if one.a.ball.group is None and one.struck != (0.0, 0.0):
                self.spells.add(one, present.now, present.now, one.struck)
        for member in cluster.members:
            if member.is_struck and member.ball.group is None:
                self._let_go(present, member)

    def _begin(self, present: Present, group: Group) -> None:
        for member in group.members:
            ball = member.ball
            ball.group = group
            if ball.least >= group.least and present.now - ball.changed < self._soon(ball.least):
                group.changed, group.least = ball.changed, ball.least
        group.longest = min([self.scale.first] + [member.ball.pace for member in group.members])
        self._play(present, group)

    def _play(self, present: Present, group: Group) -> None:
        """Play the next piece of a group, and lead its balls along it, or let all of them rest."""
        if group.is_still(present.now):
            self._let_rest(present, group)
            return
        if group.until - present.now < SHORTEST * self.scale.least:
            self.leave(present, group.members[0].ball)
            return
        group.play(present.now)
        pace = min(max(2.0 * group.time, 100.0 * self.scale.least), self.scale.first)
        first: Ball | None = None
        moves = any(member.phase != REST and not member.stays for member in group.members)
        for member in group.members:
            member.ball.pace = pace
            if member.phase == REST:
                self._rest(present, member)
                continue
            if moves and member.stays:  # Its neighbours hold it; it would stop again and again.
                continue
            present.lead(member.ball, group.path(member))
            put(self.loose, member.ball)
            first = member.ball if first is None else first
        if first is not None:
            group.leader = first

    def _let_rest(self, present: Present, group: Group) -> None:
        """Let the balls of a group rest; where a surface goes on pulling them, it sleeps."""
        group.add_up(self.spells)
        if any(member.phase == FREE for member in group.members):
            group.sleep(present.now)
        for member in group.members:
            if not group.sleeps:
                member.ball.group = None
            self._rest(present, member)


def pass_on(present: Present, each: Member) -> None:
    """Lead a ball that has come to the end of a side along the next one, if it goes on smoothly.

    It is a little beyond the end, so it has turned a little too far, or not enough. Where it is too
    fast to be pressed on to the next side, it flies off as it moves.
    """
    r, far = each.ball.radius, SMOOTH * each.ball.radius
    for wall in present.table.walls:
        if wall.is_pocket:
            continue
        side = wall.nearest(each.x, each.y, r, present.now)
        gap, (nx, ny) = side.gap(each.x, each.y, r), side.normal(each.x, each.y)
        ux, uy, _spins, _lifts = wall.sweep(each.x, each.y, present.now)
        across = (each.vx - ux) * nx + (each.vy - uy) * ny
        along = (each.vx - ux) * ny - (each.vy - uy) * nx
        flies_off = side.curvature(each.x, each.y) * along * along > STRONGEST * present.pull
        if not flies_off and abs(gap) <= far and abs(across) <= SMOOTH * abs(along):
            each.x, each.y = each.x - gap * nx, each.y - gap * ny
            each.vx, each.vy = each.vx - across * nx, each.vy - across * ny
            if each.phase == ROLL:
                each.wx, each.wy = each.vx, each.vy
