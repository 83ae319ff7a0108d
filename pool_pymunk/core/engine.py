"""The engine moves balls along their paths and answers contacts in the order of time.

When a ball sets off on a new path, the engine predicts its contacts with walls and with the paths
of other balls, and puts them in a queue. The earliest prediction happens next. What comes at one
instant is answered by :mod:`pool_pymunk.core.contact.instant`.

- *Grazing*: a path that is tangent up to rounding misses a corner.
- *Touching*: two balls that touch have a contact now if they close faster than rounding explains.
"""

from __future__ import annotations

import time
from typing import Final

from mypy_extensions import i64

from pool_pymunk.core.ball import NEARLY_NOW, Ball
from pool_pymunk.core.contact.instant import Instant
from pool_pymunk.core.contact.laws import Law
from pool_pymunk.core.motion.pairs import pair_time
from pool_pymunk.core.motion.path import Motion
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.near import FEW, near_of, overlap
from pool_pymunk.core.persistent.gathering import gathering_of
from pool_pymunk.core.persistent.persistence import Persistence
from pool_pymunk.core.present import Present, is_among, is_new
from pool_pymunk.core.queue import BORDER, HIT, LOOK, PIECE, STOP, Due, Queue, hit_at, key_of
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table
from pool_pymunk.core.walls.middle import Middle
from pool_pymunk.core.walls.moving import MovingWall
from pool_pymunk.core.walls.side import OVERLAP
from pool_pymunk.core.walls.wall import Pocket, Wall

# A ball crosses at most so many borders at one instant. More would come only where each of two
# patches turns a path into the other one, just where it is tangent to their border.
MOST_CROSSINGS: Final = 4
# A run is given up after this many events, unless the user says otherwise, and after this many
# instants without one. So a run takes some minutes at most.
NEVER_SETTLES: Final = 1_000_000
# How a run ends.
SETTLED: Final = 0
OUT_OF_TIME: Final = 1
OUT_OF_EVENTS: Final = 2
NON_FINITE: Final = 3
PAUSE: Final = 0.01  # s; the recorder may do something else so often
OFTEN: Final = 15  # The clock is looked at after so many instants, a power of two less one.


class Engine(Present):
    """The engine has balls on a table, and plays what happens to them up to a time.

    Solvers ask it. Balls begin on their first paths at the time 0.

    >>> from pool_pymunk.core.contact.laws import Coulomb
    >>> from pool_pymunk.core.motion.patches import Patches
    >>> from pool_pymunk.core.motion.path import standing
    >>> from pool_pymunk.core.motion.surface import Sliding
    >>> table = Table([], Sliding(0.5), Patches([], []), 1.0, 1.0, 0.0)
    >>> path = table.surface.path(0.0, (0.0, 0.0), (2.0, 0.0), (0.0, 0.0))
    >>> balls = [Ball(0, 0.03125, 0.2, path), Ball(1, 0.03125, 0.2, standing(0.0, 1.8125, 0.0))]
    >>> engine = Engine(table, balls, Coulomb(), Recorder(), Persistence())
    >>> engine.begin_run()
    >>> engine.advance(INF)
    >>> engine.events, engine.now, [ball.path.place(engine.now) for ball in balls]
    (3, 4.0, [(1.75, 0.0), (4.0625, 0.0)])
    """

    def __init__(
        self, table: Table, balls: list[Ball], law: Law, recorder: Recorder,
        persistence: Persistence,
    ) -> None:  # fmt: skip
        super().__init__(table, balls, law, recorder)
        self.queue: Final = Queue()
        self.instant: Final = Instant(self.queue)
        self.persistence = persistence
        self.cushions: list[Wall] = []  # all walls but pockets; some of them are movers
        self.movers: list[MovingWall] = []
        self.pockets: list[Pocket] = []
        self.middle = Middle([])
        self.chooses = False  # Some balls go through others, by their bits.
        self.answered: i64 = 0  # so many things that were due
        self.predictions: i64 = 0
        self.heard = 0.0  # s, of the machine's clock; when the recorder has last paused the play
        self.near = near_of(balls)
        self.has_patches = len(table.patches.borders) > 0
        for place, wall in enumerate(table.walls):
            wall.place = place
        self._sort_walls()

    def _sort_walls(self) -> None:
        """Tell the table's pockets from its other walls, and note which of these move."""
        self.cushions, self.movers, self.pockets = [], [], []
        for wall in self.table.walls:
            if isinstance(wall, Pocket):
                self.pockets.append(wall)
            else:
                self.cushions.append(wall)
            if isinstance(wall, MovingWall):
                self.movers.append(wall)
        self.middle = Middle(self.table.walls)

    def start_anew(self, recorder: Recorder) -> None:
        """Forget the run before; the balls are on the first paths of another one, which begins."""
        self.recorder = recorder
        self.now = 0.0
        self.is_finite, self.is_endless = True, False
        self.events = self.idle = 0
        self.pull = self.table.pull
        self.queue.clear()
        self.instant.begin_run()
        self.persistence.begin_run()
        self.squeezes.kicked.clear()
        if len(self.balls) >= FEW:  # How far is looked ahead depends on where they lie.
            self.near = near_of(self.balls)

    def begin_run(self) -> None:
        """Begin a run: predict what the balls meet that move.

        Balls that are not fresh lie where they lay in the run before.
        """
        movers: list[Ball] = []
        for ball in self.balls:
            if ball.is_fresh:
                ball.is_fresh = False
                if not ball.is_off and self._sets_off(ball):
                    movers.append(ball)
        if self.is_finite:
            self._predict(movers)
            self._begin_pressed()

    def _sets_off(self, ball: Ball) -> bool:
        """Put a ball on its first path; tell whether it moves there."""
        ball.set_off(ball.path)
        self._look_at(ball)
        self.near.put(ball, 0.0, INF)
        return ball.path.moves

    # -- playing -----------------------------------------------------------------------------------

    def advance(self, until: float) -> None:
        """Play what is due up to a time (s), within the bounds of the run."""
        queue = self.queue
        while self.may_go_on and self.idle < NEVER_SETTLES:
            t = queue.upcoming()
            if t > until or t == INF:
                break
            self._next(queue.pop())

    def end(self, latest: float) -> int:
        """End a run that was to end at the ``latest`` (s), and return why it has ended."""
        upcoming = self.queue.upcoming()
        if not self.is_finite:
            return NON_FINITE
        if upcoming <= latest and upcoming < INF:
            return OUT_OF_EVENTS
        goes_on = self.is_endless and any(ball.path.end == INF for ball in self.balls)
        if upcoming == INF and not goes_on:
            return SETTLED
        self.now = latest if latest < INF else self.now
        return OUT_OF_TIME

    def motion_of(self, ball: Ball) -> tuple[Motion, Vector]:
        """Return place and velocity of a ball now, and its roll, once ``persisted`` was asked.

        In a persistent contact the state of its group is exact, and its path only has the place.
        """
        group = gathering_of(ball)
        if group is not None:
            for member in group.members:
                if member.ball is ball:
                    return member.motion
        return ball.path.at(self.now), self.roll_of(ball)

    def upcoming(self) -> float:
        """Return the time (s) at which something is due next; infinite if nothing is."""
        return self.queue.upcoming()

    def _next(self, due: Due) -> None:
        """Play what is due: a look ahead, an end of a path, or the contacts of an instant."""
        if due.t > self.now:
            self.now = due.t
        if due.kind == LOOK:
            self._look_ahead(due.a)
            self._meet_others(due.a, None)
            return
        self.answered += 1
        if self.answered & OFTEN == 0:
            self._pause()
        if due.kind == HIT:
            self._answer(due)
        elif due.kind == STOP:
            self._end_path(due.a)
            self.queue.keep(due)
        elif due.kind == PIECE:
            self.persistence.go_on(self, due.a)
            self._predict(self.persistence.take_loose())
        else:
            self._cross_border(due.a)
        self._begin_pressed()

    def _begin_pressed(self) -> None:
        """Let contacts persist that do not close, but are pressed together, after an instant."""
        persistence = self.persistence
        if len(persistence.loose) > 0:
            persistence.go_after(self, [], [])
            persistence.take_loose()
        if len(persistence.seeds) > 0 and self.queue.upcoming() > self.now:
            persistence.form(self)
            self._predict(persistence.take_loose())

    def _pause(self) -> None:
        """Let the recorder do something else now and then: compiled code hears no interrupt."""
        now = time.monotonic()
        if now - self.heard > PAUSE:
            if self.heard > 0.0:
                self.recorder.pause(self.now)
            self.heard = now

    def _answer(self, first: Due) -> None:
        """Answer a hit, and all others of its instant; then predict what follows."""
        wall, ball, instant = first.wall, first.a, self.instant
        if wall is not None and wall.moves and self.squeezes.meet(ball, wall):
            self.jam(ball, wall)
            self._predict_few(ball, None)  # It may meet others behind the wall.
            return
        persistence, dues = self.persistence, self._due_now(first)
        is_lone = dues is None or len(dues) == 1
        is_lone = is_lone and instant.answer_lone(self, persistence, first)
        if not is_lone:
            instant.answer(self, persistence, [first] if dues is None else dues)
        if len(persistence.loose) > 0:
            self._predict(persistence.take_loose())
        elif is_lone:
            self._predict_few(ball, first.b)
        else:
            self._predict(instant.changed)
        if is_lone:
            return
        for one in instant.missed:  # They touch, but do not hit now.
            a, b = one.a.ball, one.b
            if b is not None and min(a.path.end, b.ball.path.end) > self.now:
                self._meet(a, b.ball)

    def _due_now(self, first: Due) -> list[Due] | None:
        """Return a hit, and all others of its instant: those that are closed already.

        If nothing else is due, as mostly, that is None, and no list is made.
        """
        latest = self._latest(first)
        return None if self.queue.upcoming() > latest else self._all_due(first, latest)

    def _all_due(self, first: Due, latest: float) -> list[Due]:
        """Return a hit, and those of all that is due by the latest time (s) which are closed."""
        queue, found, later = self.queue, [first], list[Due]()
        while queue.upcoming() <= latest and queue.upcoming() < INF:
            due = queue.pop()
            if due.kind != HIT or due.t > self._latest(due) or not self.is_closed(due, 1.0):
                later.append(due)
            elif is_new(due, found):
                found.append(due)
        for due in later:
            queue.push(due)
        found.sort(key=key_of)
        return found

    def _latest(self, due: Due) -> float:
        """Return the latest time (s) of contacts that may be of the same instant as this one."""
        speed = due.a.speed
        if due.b is not None:
            speed = max(speed, due.b.speed)
        return self.now + (NEARLY_NOW * due.a.radius / speed if speed > 0.0 else 0.0)

    def _end_path(self, ball: Ball) -> None:
        """Let a ball rest at the end of its path, or go on as the surface says."""
        path = ball.path
        if self.table.surface.then(path) is None:
            self.put_to_rest(ball, path.end)
            return
        then = self.table.surface_of(ball.patch).then(path)
        if then is not None and then.moves:
            self.events += 1
            self.recorder.roll(ball, then.t)
            self.lead(ball, then)
        else:
            self.put_to_rest(ball, path.end)
        self._predict_few(ball, None)

    # -- patches -----------------------------------------------------------------------------------

    def _next_crossing(self, ball: Ball) -> float:
        """Return when (s) a ball crosses into another patch, or infinity."""
        t, _patch = self.table.patches.crossing(ball.path, ball.patch, self.now)
        is_stuck = t <= self.now and self.now == ball.crossed and ball.crossings >= MOST_CROSSINGS
        return INF if is_stuck else t

    def _cross_border(self, ball: Ball) -> None:
        """Let a ball go on in the patch into which its path leads now."""
        t, patch = self.table.patches.crossing(ball.path, ball.patch, self.now)
        if t <= self.now:
            ball.crossings = ball.crossings + 1 if ball.crossed == self.now else 1
            ball.crossed = self.now
            self.persistence.leave(self, ball)
            x, y, vx, vy = ball.path.at(self.now)
            roll = self.roll_of(ball)
            ball.patch = patch
            self.events += 1
            self.recorder.crossed(ball, patch, self.now)
            path = self.table.surface_of(patch).path(self.now, (x, y), (vx, vy), roll)
            if path.moves:
                self.lead(ball, path)
            else:
                self.rest_at(ball, (x, y))
            self.persistence.go_on_from(self, ball)
        loose = self.persistence.take_loose()
        self._predict(loose if len(loose) > 0 else [ball])

    # -- what is due -------------------------------------------------------------------------------

    def _predict(self, balls: list[Ball]) -> None:
        """Predict where the paths of these balls lead: to walls, to their ends, to other balls."""
        if len(balls) == 1:
            self._predict_few(balls[0], None)
            return
        for ball in balls:
            self._predict_end(ball)
            self._look_ahead(ball)
        self.predictions += 1
        for ball in balls:
            for other in self.near.around(ball):
                if other.predicted != self.predictions:
                    self._meet(ball, other)
            ball.predicted = self.predictions

    def _predict_few(self, a: Ball, b: Ball | None) -> None:
        """Predict so for one ball, or for two that have hit each other, without a list of them."""
        self._predict_end(a)
        self._look_ahead(a)
        if b is not None:
            self._predict_end(b)
            self._look_ahead(b)
        self._meet_others(a, None)
        if b is not None:
            self._meet_others(b, a)

    def _meet_others(self, ball: Ball, known: Ball | None) -> None:
        """Predict which others a ball meets, up to its horizon; one is known already."""
        for other in self.near.candidates(ball):
            if overlap(ball, other) and other is not ball and other is not known:
                self._meet(ball, other)

    def _predict_end(self, ball: Ball) -> None:
        """Predict where the path of a ball ends: at a wall, at a border, or at rest."""
        path, end = ball.path, INF
        if ball.speed > 0.0 or path.moves:
            end = self._meet_walls(ball)
            stops = end == INF or end > path.end  # A hit may wait longer than that.
            if end < INF:
                end += ball.time_for(NEARLY_NOW)
            if self.has_patches:
                t = self._next_crossing(ball)
                if t < INF:
                    self.queue.put(t, BORDER, ball)
                    end = min(end, t)
                    stops = False
            group = ball.group
            if group is not None:
                if group.leader is ball and not group.halts:
                    self.queue.put(path.end, PIECE, ball)
            elif stops and path.end < INF:
                self.queue.put(path.end, STOP, ball)
        else:
            for mover in self.movers:
                self._meet_wall(ball, mover)
        ball.end = end

    def _meet_walls(self, ball: Ball) -> float:
        """Predict which walls and pockets a ball meets; return when (s) it meets the first one."""
        path, r, now, first = ball.path, ball.radius, self.now, INF
        if self.middle.holds(path, r):
            return first
        if not ball.is_in_crowd:
            for wall in self.cushions:
                face = wall.face
                if face is None:
                    t = wall.time_of_contact(path, r, now)
                else:
                    t = face.time_of_contact(path, r, now)
                if t < INF:
                    first = min(first, self._hit_wall(ball, wall, t))
        for pocket in self.pockets:
            t = pocket.time_of_contact(path, r, now)
            if t < INF and not (self.chooses and ball.ignores(pocket.categories, pocket.mask)):
                self.queue.push(self.queue.due(t, HIT, ball, None, pocket))
                first = min(first, t)
        return first

    def _meet_wall(self, ball: Ball, wall: Wall) -> None:
        """Predict when a ball meets a wall that moves."""
        if not ball.is_in_crowd:
            t = wall.time_of_contact(ball.path, ball.radius, self.now)
            if t < INF:
                self._hit_wall(ball, wall, t)

    def _hit_wall(self, ball: Ball, wall: Wall, t: float) -> float:
        """Note that a ball comes to a wall (s); return when it hits the wall, or infinity."""
        if self.chooses and ball.ignores(wall.categories, wall.mask):
            return INF
        if wall.moves and self.squeezes.goes_through(ball, wall):
            return INF
        hit = self.queue.due(t, HIT, ball, None, wall)
        t = hit.t = self._allowed(hit)
        if t < INF:
            self.queue.push(hit)
        return t

    def _look_ahead(self, ball: Ball) -> None:
        """Look at the path of a ball up to its horizon."""
        path, end, now = ball.path, ball.end, self.now
        if self.near.ahead < INF:
            horizon = self.near.horizon(path, now)
            if horizon < end and horizon < path.end:
                end = horizon
                self.queue.put(end, LOOK, ball)
        ball.horizon = end
        self.near.put(ball, now, end)

    def _meet(self, a: Ball, b: Ball) -> None:
        """Predict when two balls meet."""
        if self.chooses and a.ignores(b.categories, b.mask):
            return
        if a.group is not None and a.group is b.group:
            group = gathering_of(a)
            if group is not None and (group.answers_all or group.holds(a, b, None)):
                return  # They touch, and stay together.
        until, noise = min(a.horizon, b.horizon), max(a.noise, b.noise)
        if a.number > b.number:
            a, b = b, a
        t = pair_time(a.path, b.path, a.radius + b.radius, self.now, until, noise)
        if t < INF:
            hit = self.queue.due(t, HIT, a, b, None)
            hit.t = self._allowed(hit)
            if hit.t < INF:
                self.queue.push(hit)

    def _allowed(self, hit: Due) -> float:
        """Return when (s) a predicted hit is due, or infinity if its sides are in contact."""
        persistence = self.persistence
        if hit.t > self.now and hit.a.group is None and not persistence.is_hushed:
            return hit.t  # Mostly nothing is in contact.
        t = persistence.allows(self, hit)
        return INF if t <= self.now and self.rubs(hit) else t

    # -- walls that move ---------------------------------------------------------------------------

    def begin_step(self, now: float) -> None:
        """Look for hits of walls that begin a new motion now (s)."""
        self.now = now
        self.squeezes.begin_step()
        self.persistence.begin_step(self)
        fresh = self.persistence.take_loose()
        for ball in self.balls:
            if not ball.is_off:
                for wall in self.movers:
                    if self.squeezes.goes_through(ball, wall) and not self._lies_in(ball, wall):
                        self.squeezes.free(ball, wall)
                    if not is_among(ball, fresh, len(fresh)):
                        self._meet_wall(ball, wall)
        self._predict(fresh)
        self._begin_pressed()

    def _lies_in(self, ball: Ball, wall: Wall) -> bool:
        """Tell whether a ball lies in a wall now."""
        return self.gap(hit_at(self.now, ball, None, wall)) < -OVERLAP * ball.radius
