"""A live engine plays while others change what is on the table: balls, walls, the surface."""

from __future__ import annotations

from typing import Final, final

from librt.strings import BytesWriter, write_f64_le
from mypy_extensions import i64

from pool_pymunk.core.ball import EVERYTHING, Ball
from pool_pymunk.core.contact.laws import Law
from pool_pymunk.core.engine import NEVER_SETTLES, Engine
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.path import Motion
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.near import MANY, near_of
from pool_pymunk.core.news import News
from pool_pymunk.core.persistent.gathering import gathering_of
from pool_pymunk.core.persistent.gatherings import Gatherings, put
from pool_pymunk.core.persistent.groups import persistence_of
from pool_pymunk.core.persistent.persistence import Persistence
from pool_pymunk.core.queue import HIT, Due
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table
from pool_pymunk.core.walls.moving import MovingWall
from pool_pymunk.core.walls.wall import Pocket, Wall

MOST_EVENTS: Final = 1_000_000  # in one step; more than that never end
SAME: Vector = (INF, INF)  # This stands for a place, velocity or roll that stays.


@final
class LiveEngine(Engine):
    """A live engine has ``news``, or a recorder of the user's, and a tolerance (m).

    The tolerance is that of contacts that persist. After walls or the surface have changed, all is
    predicted anew before anything else is played. ``taken`` are the balls that pockets have taken
    in, until somebody reads them. A live table asks it.
    """

    def __init__(self, table: Table, law: Law, tolerance: float) -> None:
        self.news = News()
        super().__init__(table, [], law, self.news, Persistence())
        self.tolerance = tolerance
        self.is_stale = False  # What is due is not known any more.
        self.places = 0  # of walls, so far
        self.sorted = 0  # balls when they were last sorted in
        self.loosened: list[Ball] = []  # Around these, groups may begin when all is predicted anew.
        self.taken: list[Ball] = []
        self.most_events = MOST_EVENTS

    # -- playing -----------------------------------------------------------------------------------

    def play(self, until: float) -> bool:
        """Play what is due up to a time (s), but stop after an instant of which there are news.

        Return whether it has stopped so.
        """
        self.refresh()
        queue = self.queue
        while not self.has_given_up:
            t = queue.upcoming()
            if t > self.now and self._has_news():
                return True
            if t > until or t == INF:
                break
            self._next(queue.pop())
        if self.has_given_up:
            return False
        self.now = max(self.now, until)
        return self._has_news()

    def go_on(self) -> bool:
        """Play what is due next, or return False if that is nothing."""
        self.refresh()
        if self.queue.upcoming() == INF or not self.may_go_on:
            return False
        self._next(self.queue.pop())
        return True

    def start_step(self, now: float) -> None:
        """Start a step now (s), in which walls may have a new motion."""
        self.refresh()
        if self.recorder is self.news:  # Else somebody counts the events of the whole run.
            self.events = self.idle = 0
        if len(self.movers) > 0:
            self.begin_step(now)

    def _has_news(self) -> bool:
        self._tell_ended()
        return len(self.news.events) > 0

    def _tell_ended(self) -> None:
        """Tell of the contacts that have persisted, and are over now, if somebody hears that."""
        persistence = self.persistence
        if self.news.hears_persistent and isinstance(persistence, Gatherings):
            for spell in persistence.take_ended(self.balls):
                self.news.persistent(spell)

    @property
    def has_given_up(self) -> bool:
        """This tells whether the step does not end: numbers are none, or events too many."""
        return not self.may_go_on or self.idle >= NEVER_SETTLES

    def refresh(self) -> None:
        """Predict anew what is due, if that is not known any more; pairs may be others now."""
        self.table.forget()
        if self.is_stale:
            self.is_stale = False
            self._predict_anew()
        self._begin_pressed()

    def take_in(self, ball: Ball, pocket: Pocket) -> None:
        super().take_in(ball, pocket)
        self.taken.append(ball)

    # -- balls that others move --------------------------------------------------------------------

    def add(self, ball: Ball) -> None:
        """Put a ball on the table; its number is the next one."""
        self.balls.append(ball)
        x, y, vx, vy = ball.path.at(self.now)
        self._begin_on(ball, (x, y), (vx, vy), (ball.path.wx, ball.path.wy))
        if not ball.path.moves:
            ball.rested = -INF
        if len(self.balls) >= max(MANY, 2 * self.sorted) or len(self.balls) == 1:
            self.is_stale = True
        self.near.add(ball)
        self._settle(ball)

    def send(self, ball: Ball, place: Vector, velocity: Vector, roll: Vector) -> None:
        """Let a ball go on from a place (m) with a velocity and a roll (m/s) from now on.

        What is ``SAME`` stays as it is. A ball that was off the table comes back to it.
        """
        self.persistence.leave(self, ball)
        (x, y, vx, vy), own = ball.path.at(self.now), self.roll_of(ball)
        place = (x, y) if place == SAME else place
        velocity = (vx, vy) if velocity == SAME else velocity
        roll = own if roll == SAME else roll
        ball.is_off = False
        ball.forget_hits()
        self._begin_on(ball, place, velocity, roll)
        self.recorder.path(ball, ball.path)
        self._settle(ball)

    def push(self, ball: Ball, gain: Vector) -> None:
        """Add to the velocity (m/s) of a ball; its roll stays."""
        self.persistence.leave(self, ball)
        (vx, vy), (gx, gy) = ball.path.velocity(self.now), gain
        self.send(ball, SAME, (vx + gx, vy + gy), SAME)

    def take_off(self, ball: Ball) -> None:
        """Take a ball off the table; others of its group go on."""
        self.persistence.leave(self, ball)
        x, y = ball.path.place(self.now)
        self.remove(ball, (x, y))
        self._predict_loose()

    def choose(self, ball: Ball, categories: i64, mask: i64) -> None:
        """Let a ball meet only what its bits say; this counts for what is predicted from now on."""
        ball.categories, ball.mask = categories, mask
        self.chooses = self.chooses or categories != EVERYTHING or mask != EVERYTHING

    def put_back(self, now: float, balls: list[Ball], motions: list[Motion], rolls: list[Vector],
                 bounces: list[float]) -> None:  # fmt: skip
        """Let it be a time (s) at which balls had these motions, rolls and unseen bounces."""
        self._leave_all()
        self.is_finite = True
        self.persistence.begin_run()
        self.instant.begin_run()
        self.squeezes.kicked.clear()
        self.squeezes.jammed.clear()
        self.now = now
        for ball, (x, y, vx, vy), roll, until in zip(balls, motions, rolls, bounces, strict=True):
            ball.is_off = False
            ball.forget_hits()
            ball.crossed, ball.bounces = -INF, until
            self._begin_on(ball, (x, y), (vx, vy), roll)
        self.loosened = [ball for ball in balls if ball.path.moves]
        self.is_stale = True

    def _begin_on(self, ball: Ball, place: Vector, velocity: Vector, roll: Vector) -> None:
        """Put a ball on a new path that begins now."""
        x, y = place
        ball.patch = self.table.patches.at(x, y)
        path = self.table.surface_of(ball.patch).path(self.now, place, velocity, roll)
        ball.set_off(path)
        ball.rested, ball.stopped = INF if path.moves else self.now, -INF
        self._look_at(ball)

    def _settle(self, ball: Ball) -> None:
        """Predict what a ball on a new path meets, and what it presses on."""
        if self.is_stale:
            return
        self.near.put(ball, self.now, self.now)  # Its neighbours are those of its new place.
        self.persistence.go_on_from(self, ball)
        put(self.persistence.loose, ball)
        self._predict_loose()
        self._fall_in(ball)

    def _fall_in(self, ball: Ball) -> None:
        """Let a pocket take a ball in at once that somebody has put into it."""
        x, y = ball.path.place(self.now)
        for wall in self.table.walls:
            if isinstance(wall, Pocket) and wall.sides[0].gap(x, y, ball.radius) < 0.0:
                self.queue.push(Due(self.now, HIT, ball, None, wall))

    def _predict_loose(self) -> None:
        loose = self.persistence.take_loose()
        if not self.is_stale:
            self._predict([ball for ball in loose if not ball.is_off])

    # -- walls and the surface ---------------------------------------------------------------------

    def lay(self, table: Table) -> None:
        """Let all happen on another table, which has no walls yet."""
        self.table = table
        self.has_patches = len(table.patches.borders) > 0
        self._sort_walls()
        self.is_stale = True

    def put_up(self, wall: Wall) -> None:
        """Let there be a wall or a pocket from now on."""
        wall.place = self.places
        self.places += 1
        self.chooses = self.chooses or wall.categories != EVERYTHING or wall.mask != EVERYTHING
        self.table.walls.append(wall)
        self._sort_walls()
        self.is_stale = True

    def take_down(self, wall: Wall) -> None:
        """Let there be no such wall or pocket from now on."""
        self.table.walls = [each for each in self.table.walls if each is not wall]
        self._sort_walls()
        self.squeezes.forget(wall)
        self.is_stale = True

    def change_surface(self, surface: Surface, patches: Patches) -> None:
        """Let balls go on from now on over another surface; they keep their rolls if it has any."""
        self._leave_all()
        rolls = [self.roll_of(ball) if surface.rolls else (0.0, 0.0) for ball in self.balls]
        self.table.surface, self.table.patches = surface, patches
        self.has_patches = len(patches.borders) > 0
        for ball, roll in zip(self.balls, rolls, strict=True):
            if not ball.is_off:
                x, y, vx, vy = ball.path.at(self.now)
                self._begin_on(ball, (x, y), (vx, vy), roll)
        self.is_stale = True

    def _leave_all(self) -> None:
        """Take all groups apart; they may begin anew when all is predicted."""
        for ball in self.balls:
            ball.bounces = self.bounces_of(ball)
        for ball in self.balls:
            if ball.group is not None:
                put(self.loosened, ball)
                self.persistence.leave(self, ball)
        for ball in self.persistence.take_loose():
            put(self.loosened, ball)

    def _predict_anew(self) -> None:
        """Predict anew what is due: balls go on from where they are now."""
        self._leave_all()
        self._tell_ended()
        self.pull = self.table.pull
        if len(self.balls) > 0:
            self.persistence = persistence_of(self.table, self.balls, self.tolerance)
        self.queue.clear()
        self.sorted = len(self.balls)
        there = [ball for ball in self.balls if not ball.is_off]
        for ball in there:
            path = ball.path
            if path.moves and path.t < self.now:  # A wall may have stood elsewhere before.
                x, y, vx, vy = path.at(self.now)
                surface, roll = self.table.surface_of(ball.patch), self.roll_of(ball)
                ball.lead(surface.path(self.now, (x, y), (vx, vy), roll), ball.noise)
        self.near = near_of(self.balls)
        for ball in self.balls:
            if ball.is_off:
                self.near.remove(ball)
            else:
                self.near.put(ball, self.now, self.now)
        self._predict([ball for ball in there if ball.path.moves or len(self.movers) > 0])
        for ball in self.loosened:
            if not ball.is_off:
                self.persistence.go_on_from(self, ball)
        self.loosened = []
        self._predict_loose()
        for ball in there:
            self._fall_in(ball)

    # -- what others see ---------------------------------------------------------------------------

    def copy(self, table: Table, recorder: Recorder) -> LiveEngine:
        """Return an engine on another table that goes on from now by itself.

        The walls of the table are added by :meth:`put_up`. In the copy, walls that move stand.
        """
        other = LiveEngine(table, self.law, self.tolerance)
        other.recorder, other.now, other.chooses = recorder, self.now, self.chooses
        for wall in self.table.walls:
            other.put_up(still(wall, self.now))
        for ball in self.balls:
            (x, y, vx, vy), roll = self.state_of(ball)
            path = table.surface_of(ball.patch).path(self.now, (x, y), (vx, vy), roll)
            twin = Ball(ball.number, ball.radius, ball.mass, path, ball.is_cue)
            twin.set_off(path)
            twin.categories, twin.mask, twin.patch = ball.categories, ball.mask, ball.patch
            twin.is_off, twin.noise, twin.rested = ball.is_off, ball.noise, ball.rested
            other.balls.append(twin)
            if ball.group is not None:  # The copy forms its groups by itself.
                other.loosened.append(twin)
        other.is_stale = True
        return other

    def state_of(self, ball: Ball) -> tuple[Motion, Vector]:
        """Return the motion (m, m/s) and the roll (m/s) of a ball now."""
        if ball.group is not None:
            return ball.group.state_of(ball, self.now)
        return ball.path.at(self.now), self.roll_of(ball)

    def bounces_of(self, ball: Ball) -> float:
        """Return until when (s) bounces of a ball's group last that are left out, or -inf."""
        group = gathering_of(ball)
        known = ball.bounces
        if group is not None:
            known = max([one.bounces for one in group.touches], default=known)
        return known if known > self.now else -INF

    def motions(self) -> bytes:
        """Return places (m) and velocities (m/s) of all balls now, as rows of four numbers."""
        found = BytesWriter()
        for ball in self.balls:
            (x, y, vx, vy), _roll = self.state_of(ball)
            for number in (x, y, vx, vy):
                write_f64_le(found, number)
        return found.getvalue()

    def moving(self) -> list[Ball]:
        """Return the balls that move now, or have a roll; some may just ride on walls that move."""
        return [ball for ball in self.balls if self._goes_on(ball) or rides(ball)]

    @property
    def is_playing(self) -> bool:
        """This tells whether a ball moves by itself."""
        return any(self._goes_on(ball) for ball in self.balls)

    def _goes_on(self, ball: Ball) -> bool:
        return ball.path.end > self.now and not ball.is_off


def still(wall: Wall, now: float) -> Wall:
    """Return a wall for the copy of a table: one that moves stands where it is now (s)."""
    if isinstance(wall, Pocket):
        return Pocket(wall.center, wall.radius, wall.number)
    sides = wall.sides_at(now) if isinstance(wall, MovingWall) else wall.sides
    twin = Wall(sides, wall.restitution, wall.friction, wall.number, wall.kick)
    twin.categories, twin.mask = wall.categories, wall.mask
    return twin


def rides(ball: Ball) -> bool:
    """Tell whether a ball moves with its group, up to where the motion of a wall ends now."""
    group = ball.group
    return group is not None and group.halts and ball.rested == INF
