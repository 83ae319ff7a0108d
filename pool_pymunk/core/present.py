"""The present is what is on the table now: who touches whom, what sets off, and who listens."""

from __future__ import annotations

import math
from typing import Final

from mypy_extensions import i64

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact, Disc, Pair
from pool_pymunk.core.contact.laws import Law
from pool_pymunk.core.motion.path import Path, standing
from pool_pymunk.core.motion.times import EPSILON, INF, Vector, unit
from pool_pymunk.core.near import Near
from pool_pymunk.core.queue import Due, hit_at, key_of
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.squeeze import Key, Squeezes
from pool_pymunk.core.table import Table
from pool_pymunk.core.variant import Errors
from pool_pymunk.core.walls.wall import Pocket, Wall

CLOSED: Final = 32.0 * EPSILON  # of coordinates; so wide may a gap seem that is closed


class Present:
    """Balls lie on a table or move on their paths, and it is ``now`` (s).

    The engine is a present that goes on. Instants ask the present about contacts, and set balls off
    by it. ``is_finite`` is False once a ball is lost or a number has overflowed, and ``is_endless``
    is True once a path was without end. ``events`` counts what the recorder has heard, and ``idle``
    the rounds without an event.
    """

    def __init__(self, table: Table, balls: list[Ball], law: Law, recorder: Recorder) -> None:
        self.table = table
        self.balls: Final = balls
        self.law: Final = law
        self.recorder = recorder
        self.errors = Errors()
        self.near = Near(balls)
        self.squeezes: Final = Squeezes()
        self.pull = table.pull
        self.now = 0.0
        self.is_finite = True
        self.is_endless = False
        self.events: i64 = 0
        self.most_events: i64 = 1_000_000
        self.idle: i64 = 0

    @property
    def may_go_on(self) -> bool:
        """This tells whether the run has not come to its bounds."""
        return self.is_finite and self.events < self.most_events

    # -- contacts ----------------------------------------------------------------------------------

    def disc(self, ball: Ball) -> Disc:
        """Return a ball as it moves now."""
        x, y, vx, vy = ball.path.at(self.now)
        if self.errors.of_places:
            x, y = self.errors.place_met(x, y, vx, vy, self.now)
        return Disc(ball, x, y, vx, vy)

    def contact(self, a: Disc, b: Disc | None, wall: Wall | None) -> Contact:
        """Return the contact of two balls, or of a ball and a wall, now."""
        if b is not None:
            return self._contact_of_balls(a, b)
        assert wall is not None, "a contact has another side"
        r, now, ball = a.ball.radius, self.now, a.ball
        side = wall.nearest(a.x, a.y, r, now)
        nx, ny = side.normal(a.x, a.y)
        e = 0.0 if self.squeezes.is_squeezed(ball) else wall.restitution
        one = Contact(a, None, wall, nx, ny, Pair(ball.mass, INF, e, wall.friction))
        one.px, one.py = a.x - r * nx, a.y - r * ny
        one.curvature = side.curvature(a.x, a.y)
        one.kick = 0.0 if self.squeezes.is_squeezed(ball) else wall.kick
        if wall.moves:
            one.ux, one.uy = wall.drift(a.x, a.y, r, now)
        return one

    def _contact_of_balls(self, a: Disc, b: Disc) -> Contact:
        nx, ny = unit(b.x - a.x, b.y - a.y)
        pair = self.table.pair(a.ball, b.ball)
        if self.squeezes.is_squeezed(a.ball) or self.squeezes.is_squeezed(b.ball):
            pair = pair.with_restitution(0.0)
        one, r = Contact(a, b, None, nx, ny, pair), a.ball.radius
        one.px, one.py = a.x + r * nx, a.y + r * ny
        return one

    def gap(self, hit: Due) -> float:
        """Return the distance (m) between two surfaces now; it is negative where they overlap."""
        x, y = hit.a.path.place(self.now)
        r, wall, b = hit.a.radius, hit.wall, hit.b
        if b is None:
            assert wall is not None, "it is a hit"
            return wall.nearest(x, y, r, self.now).gap(x, y, r)
        bx, by = b.path.place(self.now)
        dx, dy = bx - x, by - y
        return math.sqrt(dx * dx + dy * dy) - r - b.radius

    def is_closed(self, hit: Due, times: float) -> bool:
        """Tell whether a gap is at most this many times as wide as rounding explains."""
        a, wall, gap = hit.a, hit.wall, self.gap(hit)
        x, y = a.path.place(self.now)
        if wall is not None and wall.moves:
            ux, uy, _spins, _lifts = wall.sweep(x, y, self.now)
            if ux != 0.0 or uy != 0.0:  # Rounding of the time moves the two sides so far:
                gap -= EPSILON * self.now * (a.speed + abs(ux) + abs(uy))
        touching = a.radius + (0.0 if hit.b is None else hit.b.radius)
        return gap / times <= CLOSED * (abs(x) + abs(y) + touching)

    def rubs(self, hit: Due) -> bool:
        """Tell whether two sides that touch close no faster than rounding explains."""
        a, b, wall, now = hit.a, hit.b, hit.wall, self.now
        x, y, vx, vy = a.path.at(now)
        noise = a.noise
        if b is not None:
            px, py, ux, uy = b.path.at(now)
            nx, ny = unit(px - x, py - y)
            closing = vx * nx + vy * ny - (ux * nx + uy * ny)
            noise = max(noise, b.noise)
        else:
            assert wall is not None, "a hit has another side"
            nx, ny = wall.nearest(x, y, a.radius, now).normal(x, y)
            ux, uy, _spins, _lifts = wall.sweep(x, y, now)
            closing = -((vx - ux) * nx + (vy - uy) * ny)
        return closing <= noise and self.is_closed(hit, 1.0)

    def touching(self, hits: list[Due], balls: list[Ball]) -> list[Due]:
        """Return these hits, and all contacts in the cluster around their balls or ``balls``."""
        found, around = list(hits), list(balls)
        for hit in hits:
            add_balls(around, hit)
        times = self.errors.nearly_closed
        for ball in around:  # This list grows.
            for hit in self._around(ball):
                if self.is_closed(hit, times) and is_new(hit, found):
                    found.append(hit)
                    add_balls(around, hit)
        found.sort(key=key_of)
        return found

    def _around(self, ball: Ball) -> list[Due]:
        """Return all hits of a ball that may be closed now."""
        found: list[Due] = []
        for other in self.near.around(ball):
            if not ball.ignores(other.categories, other.mask):
                found.append(hit_at(self.now, ball, other, None))
        for wall in self.table.walls:
            if wall.is_pocket or ball.ignores(wall.categories, wall.mask):
                continue
            if not (wall.moves and self.squeezes.goes_through(ball, wall)):
                found.append(hit_at(self.now, ball, None, wall))
        return found

    # -- what follows ------------------------------------------------------------------------------

    def begin(
        self, ball: Ball, place: Vector, velocity: Vector, roll: Vector, noise: float
    ) -> None:
        """Set a ball off on a new path, or put it to rest if its speed is noise (m/s)."""
        vx, vy = velocity
        if vx * vx + vy * vy <= noise * noise < INF:  # Else a number has overflowed.
            velocity = (0.0, 0.0)
        if ball.creep > 0.0 and ball.creeps(velocity, roll):
            velocity = roll = (0.0, 0.0)
        velocity = self.errors.velocity_after(velocity, noise)
        path = self.table.surface_of(ball.patch).path(self.now, place, velocity, roll)
        if path.moves:
            ball.rested = INF
            self.recorder.path(ball, path)
        elif ball.rested == INF:
            self._stop(ball, self.now, place)
        else:  # It stays where it has come to rest.
            path = standing(self.now, *ball.path.place(self.now))
        ball.lead(path, noise)
        self._look_at(ball)

    def lead(self, ball: Ball, path: Path) -> None:
        """Put a ball on a path that follows its last one, and tell the recorder."""
        ball.rested = INF
        ball.set_off(path)
        self.recorder.path(ball, path)
        self._look_at(ball)

    def _look_at(self, ball: Ball) -> None:
        """Find out whether a ball is lost on its new path, or goes on without end."""
        path = ball.path
        if path.is_lost(ball.radius):
            self.is_finite = False
        if path.end == INF:
            self.is_endless = True

    def put_to_rest(self, ball: Ball, t: float) -> None:
        """Put a ball to rest at the end of its path, unless it rests already."""
        if ball.rested == INF:  # A path's end may be due twice.
            self._stop(ball, t, ball.path.place(t))
            then = self.table.surface_of(ball.patch).then(ball.path)
            if then is not None:
                ball.lead(then, 0.0)

    def rest_at(self, ball: Ball, place: Vector) -> None:
        """Let a ball rest at a place (m) from now on, if it has moved."""
        if ball.rested == INF:
            x, y = place
            ball.lead(standing(self.now, x, y), 0.0)
            self._stop(ball, self.now, place)

    def _stop(self, ball: Ball, t: float, place: Vector) -> None:
        """Take note that a ball comes to rest at a place (m), once in an instant."""
        x, y = place
        ball.rested = t
        if abs(t - ball.stopped) <= self.instant_at(ball, x, y):
            self.recorder.path(ball, standing(t, x, y))
            return
        ball.stopped = t
        self.events += 1
        self.recorder.stop(ball, t, place)

    def roll_of(self, ball: Ball) -> Vector:
        """Return the roll (m/s) of a ball now, without signs of zeros."""
        wx, wy = self.table.surface.roll(ball.path, self.now)
        return wx + 0.0, wy + 0.0

    def take_in(self, ball: Ball, pocket: Pocket) -> None:
        """Let a pocket take in a ball."""
        self.events += 1
        motion = ball.path.at(self.now)
        self.remove(ball, pocket.center)
        self.recorder.pocketed(ball, pocket, self.now, motion)

    def remove(self, ball: Ball, place: Vector) -> None:
        """Take a ball off the table, and let it lie at a place (m)."""
        x, y = place
        ball.path = standing(self.now, x, y)
        ball.paths += 1
        ball.speed = 0.0
        ball.rested = self.now
        ball.is_off = True
        self.near.remove(ball)

    # -- walls that kick and that move -------------------------------------------------------------

    def instant_at(self, ball: Ball, x: float, y: float) -> float:
        """Return how long (s) an instant is: rounding may move some hundred contacts by as much."""
        size, speed = abs(x) + abs(y) + ball.radius, ball.speed
        return 256.0 * EPSILON * (self.now + (size / speed if speed > 0.0 else 0.0))

    def jam(self, ball: Ball, wall: Wall) -> None:
        """Let a wall go through a ball that has nowhere to go."""
        if self.squeezes.jam(ball, wall) and self.is_first(self.squeezes.jammed, ball, wall):
            self.recorder.jammed(ball, wall, self.now)

    def is_first(self, seen: dict[Key, float], ball: Ball, wall: Wall) -> bool:
        """Tell whether a ball and a wall were not seen at this instant, and note when (s) it is."""
        x, y = ball.path.place(self.now)
        key = ball.number, wall.number
        if abs(self.now - seen.get(key, -INF)) <= self.instant_at(ball, x, y):
            return False
        seen[key] = self.now
        return True


def add_balls(balls: list[Ball], hit: Due) -> None:
    """Add the balls of a hit to a list, each of them once."""
    for ball in hit.balls:
        if not is_among(ball, balls, len(balls)):
            balls.append(ball)


def is_new(hit: Due, found: list[Due]) -> bool:
    """Tell whether a hit is of other sides than all that were found."""
    return not any(other.is_same(hit) for other in found)


def is_among(ball: Ball, balls: list[Ball], count: int) -> bool:
    """Tell whether a ball is one of the first ones."""
    return any(balls[k] is ball for k in range(count))
