"""A batch plays many shots, one after the other: only what differs comes in, and goes out.

Balls, engine and queue are made once. Each shot has the bits of a run of its own.
"""

from __future__ import annotations

import gc
from typing import Final, final

from librt.strings import BytesWriter, read_f64_le, write_f64_le, write_i64_le
from mypy_extensions import i64

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.beside import Beside
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.contact.laws import Law
from pool_pymunk.core.engine import SETTLED, Engine
from pool_pymunk.core.floor import Floor, overlap
from pool_pymunk.core.motion.path import Motion, Path
from pool_pymunk.core.motion.surface import NO_ROLL, Rolling, Sliding, Surface
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.near import FEW
from pool_pymunk.core.persistent.groups import persistence_of
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent.follower import Follower
from pool_pymunk.core.variant import Errors
from pool_pymunk.core.walls.wall import Pocket, Wall

CANNOT_START: Final = 4  # The other endings are those of the engine.
SUNK: Final = 1e-2  # of a radius; balls that overlap by less may start
NOBODY: Final = -1  # stands for no ball, and for no pocket
EIGHT: Final = 8  # bytes of a number


@final
class Given:
    """Some shots are given by what differs from shot to shot.

    Those of the balls are ``changing`` that do not begin all shots alike. The rest are the bytes of
    arrays. ``starts`` are places (m), velocities and, if balls roll, rolls (m/s). Each has x and y
    of all balls in the first shot, and of the changing ones in all others, unless they are those of
    the first shot. NaN as a velocity: the ball is off the table. ``coefficients`` and ``masses``
    (kg) are those of all shots, or none if these do not differ.
    """

    def __init__(
        self, changing: list[int], starts: list[bytes], coefficients: bytes, masses: bytes
    ) -> None:
        self.changing: Final = changing
        self.places: Final = starts[0]
        self.velocities: Final = starts[1]
        self.rolls: Final = starts[2] if len(starts) > 2 else b""
        self.coefficients: Final = coefficients
        self.masses: Final = masses
        self.next: i64 = 0  # where the next of the places, velocities and rolls begin


@final
class Ends:
    """This is what has become of some shots, one after the other.

    ``counts`` has four numbers of each shot: how many events, hits and cushions there were, and the
    first ball that the watched one hit, or -1. ``durations`` are in s. Shots that did not settle
    have ``endings``, which follow their numbers, and in those of ``doubts`` contacts had no known
    order. In those of ``guesses`` something else had no exact answer, such as a slip of zero. Balls
    have numbers that go on from shot to shot: those that have ``moved``, which lie at ``places``, x
    and y (m), those that the watched ball has ``met``, and those that are ``pocketed``, which their
    pockets follow.
    """

    def __init__(self) -> None:
        self.counts: Final = BytesWriter()
        self.durations: Final = BytesWriter()
        self.endings: Final = BytesWriter()
        self.doubts: Final = BytesWriter()
        self.guesses: Final = BytesWriter()
        self.moved: Final = BytesWriter()
        self.places: Final = BytesWriter()
        self.met: Final = BytesWriter()
        self.pocketed: Final = BytesWriter()


@final
class Start:
    """A start is how a ball begins a shot, and what becomes of it there.

    ``is_new`` tells whether it lies elsewhere than when room was found for it last, and ``is_over``
    whether the shot before has moved it, so that it has to begin anew.
    """

    def __init__(self, ball: Ball) -> None:
        self.ball: Final = ball
        self.path: Path = ball.path
        self.x = self.y = INF
        self.velocity: Vector = NO_ROLL
        self.roll: Vector = NO_ROLL
        self.patch = NOBODY
        self.is_off = False
        self.is_new = True
        self.is_over = True
        self.is_met = False
        self.pocket: i64 = NOBODY

    def read(self, given: Given) -> None:
        """Read place, velocity and roll, as far as they differ from those before."""
        places, velocities, rolls, k = given.places, given.velocities, given.rolls, given.next
        given.next = k + 2 * EIGHT
        if k < len(places):
            x, y = read_f64_le(places, k), read_f64_le(places, k + EIGHT)
            self.is_new = self.is_new or x != self.x or y != self.y
            self.x, self.y = x, y
        if k < len(velocities):
            vx, vy = read_f64_le(velocities, k), read_f64_le(velocities, k + EIGHT)
            is_off = vx != vx
            self.is_new = self.is_new or is_off != self.is_off
            self.is_off = is_off
            self.velocity = NO_ROLL if is_off else (vx, vy)
        if k < len(rolls):
            self.roll = read_f64_le(rolls, k), read_f64_le(rolls, k + EIGHT)

    def lay(self, table: Table) -> None:
        """Find the first path of the ball on a table."""
        if self.is_new:
            self.patch = table.patches.at(self.x, self.y)
        surface = table.surface_of(self.patch)
        self.path = surface.path(0.0, (self.x, self.y), self.velocity, self.roll)
        self.is_over = True

    def begin(self) -> None:
        """Let the ball begin a shot anew."""
        self.ball.begin(self.path)
        self.ball.patch = self.patch
        self.pocket = NOBODY
        self.is_met = False
        self.is_over = False

    @property
    def is_touched(self) -> bool:
        """This tells whether a shot has moved the ball, or the watched one has met it."""
        ball = self.ball
        is_led = ball.paths > 1 or ball.rested > -INF
        return is_led or ball.hits > 0 or ball.group is not None or self.is_met


@final
class Tally(Recorder):
    """A tally counts what happens in a shot; ``listener`` may do something else now and then.

    It lets a comparison with a reference hear what it hears, if there is one.
    """

    def __init__(
        self, starts: list[Start], watched: int, listener: Recorder, beside: Beside | None
    ) -> None:
        self.beside: Final = beside
        self.starts: Final = starts
        self.watched: Final = watched
        self.listener: Final = listener
        self.begin()

    def begin(self) -> None:
        """Forget the shot before."""
        self.hits: i64 = 0
        self.cushions: i64 = 0
        self.first_hit: i64 = NOBODY
        self.duration = 0.0
        self.is_in_doubt = self.is_guessed = False

    def contact(self, one: Contact, t: float) -> None:
        if self.beside is not None:
            self.beside.contact(one, t)
        a, b = one.a.ball.number, one.b
        if b is None:
            self.cushions += 1
            return
        self.hits += 1
        if a == self.watched:
            self._meet(b.ball.number)
        elif b.ball.number == self.watched:
            self._meet(a)

    def _meet(self, number: int) -> None:
        """Note that the watched ball hits another one."""
        self.starts[number].is_met = True
        if self.first_hit == NOBODY:
            self.first_hit = number

    def path(self, ball: Ball, path: Path) -> None:
        if self.beside is not None:
            self.beside.path(ball, path)

    def stop(self, ball: Ball, t: float, place: Vector) -> None:
        if self.beside is not None:
            self.beside.stop(ball, t, place)
        self.duration = max(self.duration, t)

    def pocketed(self, ball: Ball, pocket: Pocket, t: float, motion: Motion) -> None:
        if self.beside is not None:
            self.beside.pocketed(ball, pocket, t, motion)
        self.duration = max(self.duration, t)
        self.starts[ball.number].pocket = pocket.number

    def order_unknown(self, t: float) -> None:
        self.is_in_doubt = True

    def zero_slip(self, one: Contact, t: float) -> None:
        self.is_guessed = True

    def collapse(self, contacts: list[Contact], hits: int, is_over: bool, t: float) -> None:
        self.is_guessed = self.is_guessed or not is_over

    def pause(self, t: float) -> None:
        self.listener.pause(t)


@final
class Coefficients:
    """Coefficients that differ from shot to shot are put on a table, which is the batch's own.

    Walls that ``bounce`` or ``rub`` have the restitution or the friction of each shot. A patch has
    its ``own`` decelerations (m/s^2) of sliding and rolling, or negative ones: the table's.
    """

    def __init__(
        self, table: Table, bounce: list[Wall], rub: list[Wall], own: list[tuple[float, float]]
    ) -> None:
        self.table = table
        self.bounce = bounce
        self.rub = rub
        self.own = own

    def put(self, rows: bytes, k: i64) -> bool:
        """Put the coefficients of shot ``k`` on the table; tell whether its surface is another one.

        The seven are the restitutions of two balls, with the cue ball, and of cushions, the
        deceleration (m/s^2) of sliding, the frictions of cushions and of two balls, and that of
        rolling.
        """
        at, table = 7 * EIGHT * k, self.table
        e, cue = read_f64_le(rows, at), read_f64_le(rows, at + EIGHT)
        cushion, pull = read_f64_le(rows, at + 2 * EIGHT), read_f64_le(rows, at + 3 * EIGHT)
        rubbing, mu = read_f64_le(rows, at + 4 * EIGHT), read_f64_le(rows, at + 5 * EIGHT)
        drag = read_f64_le(rows, at + 6 * EIGHT)
        table.restitution, table.cue_restitution, table.friction = e, cue, mu
        for wall in self.bounce:
            wall.restitution = cushion
        for wall in self.rub:
            wall.friction = rubbing
        if table.surface.pull == pull and table.surface.drag == drag:
            return False
        rolls = table.surface.rolls
        table.surface = surface_of(rolls, pull, drag)
        for n in range(len(self.own)):
            own_pull, own_drag = self.own[n]
            table.patches.surfaces[n] = surface_of(
                rolls, own_pull if own_pull >= 0.0 else pull, own_drag if own_drag >= 0.0 else drag
            )
        return True


def surface_of(rolls: bool, pull: float, drag: float) -> Surface:
    """Return a surface with these decelerations (m/s^2) of sliding and of rolling."""
    return Rolling(pull, drag) if rolls else Sliding(pull)


@final
class Shots:
    """Shots of some balls on a table are played here up to the ``latest`` (s).

    ``watched`` is the number of the ball whose hits count. Contacts persist to a ``tolerance`` (m).
    A shot whose balls may not lie where they are on the ``floor`` is not played. Shots that are
    variants of a run have their own ``errors``, one after the other.
    """

    def __init__(self, table: Table, balls: list[Ball], law: Law, floor: Floor) -> None:
        self.table: Final = table
        self.balls: Final = balls
        self.floor: Final = floor
        self.starts: Final = [Start(ball) for ball in balls]
        persistence = persistence_of(table, balls, 1e-7)
        self.engine: Final = Engine(table, balls, law, Recorder(), persistence)
        self.coefficients: Coefficients | None = None
        self.beside: Beside | None = None
        self.follower: Follower | None = None
        self.errors: list[Errors] = []
        self.watched = NOBODY
        self.latest = INF
        self.tolerance = 1e-7
        self.is_free = False  # All lie where they may.
        self.are_off = False  # Some are off the table.
        self.changing: list[Start] = []  # They do not begin all shots alike.

    def play(self, count: int, given: Given, listener: Recorder) -> Ends:
        """Play so many shots, and return what comes of them."""
        is_collecting = gc.isenabled()
        gc.disable()  # A shot leaves no circles of references.
        try:
            tally = Tally(self.starts, self.watched, listener, self.beside)
            return self._play_all(count, given, tally)
        finally:
            for ball in self.balls:
                ball.group = None
            if is_collecting:
                gc.enable()

    def _play_all(self, count: int, given: Given, tally: Tally) -> Ends:
        engine, ends = self.engine, Ends()
        engine.persistence = persistence_of(self.table, self.balls, self.tolerance)
        self.changing = [self.starts[number] for number in given.changing]
        for k in range(count):
            self._read(given, k)
            if not self.is_free:
                self._skip(ends, k)
                continue
            tally.begin()
            self._begin(tally)
            if len(self.errors) > 0:
                engine.errors = self.errors[k]
            if self.beside is not None:
                self.beside.begin(self.balls)
            if self.follower is not None:
                self.follower.begin(engine)
            engine.begin_run()
            engine.advance(self.latest)
            self._write(ends, k, tally)
            if self.follower is not None:
                self.follower.end(engine, self.latest)
        return ends

    def _skip(self, ends: Ends, k: i64) -> None:
        """Leave out shot ``k``, which cannot start."""
        write_i64_le(ends.endings, k)
        write_i64_le(ends.endings, CANNOT_START)
        for number in (0, 0, 0, NOBODY):
            write_i64_le(ends.counts, number)
        write_f64_le(ends.durations, 0.0)
        for start in self.starts:
            start.begin()
            start.is_over = True
        if self.beside is not None:
            self.beside.begin(self.balls)
            self.beside.end(0.0)
        if self.follower is not None:
            self.follower.skip()

    # -- before a shot -----------------------------------------------------------------------------

    def _read(self, given: Given, k: i64) -> None:
        """Read how shot ``k`` begins, and find out whether its balls may lie where they are."""
        is_other, is_moved = self._put_numbers(given, k), False
        for start in self.starts if k == 0 else self.changing:
            start.read(given)
            is_moved = is_moved or start.is_new
        for start in self.starts if k == 0 or is_other else self.changing:
            start.lay(self.table)
        if is_moved or not self.is_free:
            self._find_room()

    def _begin(self, tally: Tally) -> None:
        """Let those balls begin anew that do not lie as they began the shot before."""
        are_many = len(self.balls) >= FEW
        for start in self.starts:
            if start.is_over or are_many:  # Of many balls all boxes are put anew.
                start.begin()
        self.engine.start_anew(tally)
        if self.are_off:
            for start in self.starts:
                if start.is_off and start.ball.is_fresh:
                    self.engine.remove(start.ball, (start.x, start.y))

    def _put_numbers(self, given: Given, k: i64) -> bool:
        """Put the coefficients and masses of shot ``k``; tell whether all paths are others."""
        if len(given.masses) > 0:
            at = EIGHT * k * len(self.balls)
            for ball in self.balls:
                ball.mass = read_f64_le(given.masses, at)
                at += EIGHT
        if self.coefficients is None or not self.coefficients.put(given.coefficients, k):
            return False
        self.engine.persistence = persistence_of(self.table, self.balls, self.tolerance)
        return True

    def _find_room(self) -> None:
        """Find out whether all balls lie where they may: those that lie where they lay do."""
        floor, looks_again = self.floor, not self.is_free
        self.is_free = True
        self.are_off = any(start.is_off for start in self.starts)
        for n in range(len(self.starts)):
            one = self.starts[n]
            if one.is_off:
                continue
            is_new, place, r = one.is_new or looks_again, (one.x, one.y), one.ball.radius
            if is_new and not floor.holds(one.x, one.y, r, SUNK):
                self.is_free = False
                return
            for k in range(n):
                other = self.starts[k]
                if other.is_off or not (is_new or other.is_new):
                    continue
                if overlap(place, r, (other.x, other.y), other.ball.radius, SUNK):
                    self.is_free = False
                    return
        for one in self.starts:
            one.is_new = False

    # -- after it ----------------------------------------------------------------------------------

    def _write(self, ends: Ends, k: i64, tally: Tally) -> None:
        """Write down what has become of shot ``k``."""
        engine, end = self.engine, tally.duration
        ending = engine.end(self.latest)
        if ending != SETTLED:
            end = engine.now
            engine.persistence.persisted(engine)
            write_i64_le(ends.endings, k)
            write_i64_le(ends.endings, ending)
        if tally.is_in_doubt:
            write_i64_le(ends.doubts, k)
        if tally.is_guessed:
            write_i64_le(ends.guesses, k)
        write_f64_le(ends.durations, end)
        if self.beside is not None:
            self.beside.end(end)
        number = k * len(self.starts)
        for start in self.starts:
            if start.is_touched:
                start.is_over = True
                self._write_ball(ends, number, start, end)
            number += 1
        write_i64_le(ends.counts, min(engine.events, engine.most_events))
        write_i64_le(ends.counts, tally.hits)
        write_i64_le(ends.counts, tally.cushions)
        write_i64_le(ends.counts, tally.first_hit)

    def _write_ball(self, ends: Ends, number: i64, start: Start, end: float) -> None:
        """Write down what has become of a ball, of this number, by the end (s) of a shot."""
        ball = start.ball
        if start.is_met:
            write_i64_le(ends.met, number)
        if start.is_off:
            return
        if start.pocket != NOBODY:
            write_i64_le(ends.pocketed, number)
            write_i64_le(ends.pocketed, start.pocket)
        x, y = ball.path.place(end)
        if ball.path.end > end and ball.group is not None:
            (x, y, _vx, _vy), _roll = self.engine.motion_of(ball)
        write_i64_le(ends.moved, number)
        write_f64_le(ends.places, x)
        write_f64_le(ends.places, y)
