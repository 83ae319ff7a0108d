"""The contact law and surface friction, on shapes of any pymunk space.

Cushions are pymunk shapes, balls are circles, collision handlers replace the built-in response by
the contact law, and friction is a per-step damping callback or a joint inside the C step.

pymunk moves the balls and finds what is near. The adapter keeps each ball's exact path and, with
``contacts="swept"``, finds when inside the step the paths meet, answers there, and lets the balls
travel the rest of the step with their new velocities; as many contacts as there are, in their
order in time. For this a ball's circle carries a margin, the way that the ball can come in one
step: whatever it touched during a step is then near at its end. Only what is near costs a call
back into Python. ``contacts="discrete"`` answers overlaps at the end of the step instead, as a
plain handler does: up to a step late, and not at all where a ball only grazed or tunnelled.

A step of pymunk moves positions first and changes velocities last. Between steps a body therefore
carries the mean velocity of its path over the coming step, which makes positions exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator
from heapq import heappop, heappush
from typing import Literal, NamedTuple

import pymunk

from pool_pymunk.contact import LAWS, Pair
from pool_pymunk.hits import Answer, Hits
from pool_pymunk.impact import NO_BALL, Touch, closing_speed
from pool_pymunk.motion import Vector
from pool_pymunk.path import EPSILON, Face, Path, Post, pair_time
from pool_pymunk.walls import Wall, length_to, sides_of, unit

Contacts = Literal["swept", "discrete"]
FrictionBy = Literal["joint", "callback"]
Near = tuple[int, int]  # two balls, lower number first; or a ball and -1 - the number of a wall

BALL, FEELER, WALL = 0x42616C6C, 0x4665656C, 0x57616C6C  # collision types of our own
TOUCH = 1e-9  # radii by which a feeler is larger than what moves, and smaller than what rests
NEARLY_NOW = 1e-6  # radii; contacts so near each other may be of one instant: their gaps decide


class Contact(NamedTuple):
    """A contact that was answered: when, and of which balls, or of a ball and a wall's number."""

    t: float
    balls: tuple[int, ...]
    wall: int | None


class Due(NamedTuple):
    """A contact that is due at ``t`` (s), unless one of the two has another path by then."""

    t: float
    order: int
    pair: Near
    path: Path
    other: Path | None


class Ball:
    """A ball on the table: its body, the circle that feels what is near, and its path."""

    __slots__ = ("body", "feeler", "joint", "number", "path", "radius", "rested")

    def __init__(self, number: int, radius: float, feeler: pymunk.Circle, path: Path) -> None:
        assert feeler.body is not None
        self.number = number
        self.radius = radius
        self.feeler = feeler
        self.body = feeler.body
        self.path = path
        self.rested = path.stop if path.speed == 0.0 else math.inf  # since when (s)
        self.joint: pymunk.PivotJoint | None = None  # friction, while it moves


class Billiards:
    """The report's physics for balls and walls of a pymunk space that is stepped by ``dt`` (s).

    ``deceleration`` (m/s^2) is what surface friction takes, mu_s g; 0 leaves friction out.
    ``pair`` tells masses and coefficients of a hit of two balls by their numbers.

    Call ``space.step(dt)`` as ever; everything else in the space keeps its built-in response, with
    each other and with the balls, and a velocity that you or a spring or a flipper gives to a ball
    is noticed. Only where nothing else touches balls (``alone=True``), the circles themselves are
    the feelers, and :meth:`step` steps the space: that is faster.

    >>> space = pymunk.Space()
    >>> table = Billiards(space, dt=1 / 60, deceleration=0.5, pair=same_balls(0.9, 0.05, mass=0.2))
    >>> body = pymunk.Body(0.2, math.inf)
    >>> body.position = (0.0, 0.0)
    >>> ball = table.add_ball(pymunk.Circle(body, 0.03))
    >>> body.velocity = (1.0, 0.0)
    >>> for _ in range(180):
    ...     space.step(1 / 60)
    >>> [round(x, 12) for x in body.position], table.moving
    ([1.0, 0.0], {})
    """

    def __init__(
        self,
        space: pymunk.Space,
        dt: float,
        *,
        pair: Callable[[int, int], Pair],
        law: str = "coulomb",
        deceleration: float = 0.0,
        contacts: Contacts = "swept",
        friction: FrictionBy = "joint",
        alone: bool = False,
    ) -> None:
        self.space = space
        self.dt = dt
        self.pair = pair
        self.deceleration = deceleration
        self.contacts = contacts
        self.friction = friction
        self.alone = alone
        self.hits: Hits[Near] = Hits(LAWS[law], self)
        self.on_contact: Callable[[Contact], None] | None = None
        self.on_answer: Callable[[float], None] | None = None  # after the contacts of an instant
        self.on_path: Callable[[Ball], None] | None = None
        self.on_stop: Callable[[Ball], None] | None = None
        self.on_stir: Callable[[Ball], None] | None = None  # on_stop spoke too soon
        self.on_warning: Callable[[str, float], None] | None = None
        self.name_of: Callable[[int], str] = str
        self.balls: list[Ball] = []
        self.walls: list[Wall] = []
        self.moving: dict[int, Ball] = {}
        self.time = 0.0
        self.latest = math.inf  # when to stop (s), in the middle of a step if need be
        self.steps = 0
        self.is_finite = True
        self._next_stop = math.inf
        self._near: dict[Near, None] = {}
        self._number: dict[pymunk.Shape, int] = {}  # of a feeler's ball, or -1 - that of a wall
        self._ball_of: dict[pymunk.Body, Ball] = {}
        self._moved_by_others: list[Ball] = []
        self._order = 0  # of contacts that fall due
        self._error: Exception | None = None
        self._install()

    def _install(self) -> None:
        """Set the collision handlers and, in a shared space, the clock that calls every step."""
        self.space.on_collision(FEELER, FEELER, pre_solve=self._feels)
        self.space.on_collision(FEELER, WALL, pre_solve=self._feels)
        if not self.alone:
            self.space.on_collision(BALL, BALL, pre_solve=_no_response)
            self.space.on_collision(BALL, WALL, pre_solve=_no_response)
            clock = pymunk.Body(1.0, 1.0)
            clock.velocity_func = self._on_clock
            self.space.add(clock)

    # -- setting up ------------------------------------------------------------------------------

    def add_ball(self, circle: pymunk.Circle) -> Ball:
        """Make ``circle`` and its body a ball; both join the space if they are not in it.

        In a shared space the ball gets a second circle, its feeler, a sensor a little larger than
        the ball; alone, the circle itself is the feeler.
        """
        body = circle.body
        assert body is not None
        self._join(body, circle)
        feeler, radius = circle, circle.radius
        if not self.alone:
            circle.collision_type = BALL
            feeler = pymunk.Circle(body, radius)
            feeler.sensor = True
            feeler.color = (0, 0, 0, 0)
            self.space.add(feeler)
        feeler.collision_type = FEELER
        position, velocity = _vector(body.position), _vector(body.velocity)
        ball = Ball(len(self.balls), radius, feeler, self._path(self.time, position, velocity))
        self._number[feeler] = ball.number
        self._ball_of[body] = ball
        self.balls.append(ball)
        if ball.path.speed > 0.0:
            self.hits.strike(ball.number, velocity)
            self._carry(ball)
        else:
            feeler.unsafe_set_radius(radius * (1.0 - TOUCH))
        return ball

    def _join(self, *things: pymunk.Body | pymunk.Shape) -> None:
        self.space.add(*(thing for thing in things if thing.space is None))

    def add_wall(
        self,
        shape: pymunk.Shape,
        restitution: float,
        friction: float = 0.0,
        sides: tuple[Face | Post, ...] | None = None,
    ) -> int:
        """Make a static segment, circle or polygon something that balls bounce off (Eq. 9).

        ``sides`` are what a ball can meet of it (default: all there is). Returns its number.
        """
        self._join(shape)
        shape.collision_type = WALL
        number = len(self.walls)
        self.walls.append(Wall(sides or sides_of(shape), restitution, friction, number))
        self._number[shape] = -1 - number
        return number

    def strike(self, ball: Ball, velocity: Vector) -> None:
        """Give a ball a velocity (m/s) now, between two steps."""
        self.hits.strike(ball.number, velocity)
        self._set_off(ball, self.time, ball.path.at(self.time)[0], velocity)
        self._carry(ball)

    # -- stepping --------------------------------------------------------------------------------

    def step(self) -> None:
        """One step of a space that holds nothing else, contacts and stops inside it included.

        What a callback raised comes out here: pymunk itself only prints it.
        """
        self.space.step(self.dt)
        self._after_step()

    def play(self) -> None:
        """Step until everything rests, it is ``latest``, or a number is out of range."""
        step, dt, moving = self.space.step, self.dt, self.moving
        while moving and self.time < self.latest and self.is_finite:
            step(dt)
            self._after_step()

    def end_at(self, t: float) -> None:
        """End now, in the middle of a step: balls that have stopped by ``t`` (s) rest."""
        self.time = t
        self._stop_balls()

    def _after_step(self, *_: object) -> None:
        """Answer what happened in the step that pymunk has just made; mostly nothing."""
        since = self.time
        self.steps += 1
        self.time = self.steps * self.dt
        if self.time > self.latest:
            self.time = self.latest
        if self._near or self._moved_by_others:
            near, self._near = self._near, {}
            self._answer_contacts(near, since)
        if self.time + self.dt >= self._next_stop:
            self._stop_balls()
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def _on_clock(
        self, _clock: pymunk.Body, _gravity: Vector, _damping: float, dt: float
    ) -> None:  # fmt: skip
        """Called in every step of a shared space, when positions are new and velocities are not."""
        try:
            self.space.add_post_step_callback(self._after_step, self)
            if abs(dt - self.dt) > 1e-9 * self.dt:
                raise ValueError(f"the space was stepped by {dt} s, its Billiards by {self.dt} s")
            for ball in self.balls:
                self._notice(ball)
        except Exception as error:
            self._error = self._error or error

    def _notice(self, ball: Ball) -> None:
        """Follow a ball that somebody else moved: its path begins anew at the step's start."""
        (x, y), (vx, vy) = ball.body.position, ball.body.velocity
        expected, (ex, ey) = ball.path.at(self.time + self.dt)[0], (0.0, 0.0)
        if ball.number in self.moving:
            ex, ey = self._mean_velocity(ball.path, self.time)
        scale = abs(vx) + abs(vy) + abs(ex) + abs(ey)
        slack = 1e-9 * (ball.radius + abs(x) + abs(y)) + self.deceleration * self.dt**2
        if abs(vx - ex) + abs(vy - ey) <= 1e-9 * scale and math.dist((x, y), expected) <= slack:
            return
        begin = (x - vx * self.dt, y - vy * self.dt)
        self.hits.strike(ball.number, (vx, vy))
        self._set_off(ball, self.time, begin, (vx, vy))
        self._moved_by_others.append(ball)

    def _feels(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        """The collision handler: these two are near enough to have met during this step."""
        try:
            arbiter.process_collision = False
            a, b = arbiter.shapes
            i, j = self._number[a], self._number[b]
            self._near[(i, j) if j < 0 or i < j else (j, i)] = None
        except Exception as error:
            self._error = self._error or error

    def _damp(
        self, body: pymunk.Body, _gravity: Vector, _damping: float, _dt: float
    ) -> None:  # fmt: skip
        """The damping callback: a body carries its path's mean velocity over the coming step."""
        try:
            now = (self.steps + 1) * self.dt
            body.velocity = self._mean_velocity(self._ball_of[body].path, now)
        except Exception as error:
            self._error = self._error or error

    def _mean_velocity(self, path: Path, t: float) -> Vector:
        """The velocity (m/s) that takes a body along its path from ``t`` to ``t + dt``."""
        (x0, y0), (x1, y1) = path.at(t)[0], path.at(t + self.dt)[0]
        return ((x1 - x0) / self.dt, (y1 - y0) / self.dt)

    def _path(self, t: float, position: Vector, velocity: Vector) -> Path:
        return Path(t, position, velocity, self.deceleration)

    def _set_off(self, ball: Ball, t: float, position: Vector, velocity: Vector) -> None:
        """A ball begins a new path at ``t``."""
        if velocity != (0.0, 0.0):
            ball.rested = math.inf
        ball.path = self._path(t, position, velocity)
        self.is_finite = self.is_finite and not ball.path.is_lost(ball.radius)
        if self.on_path is not None:
            self.on_path(ball)

    def _carry(self, ball: Ball) -> None:
        """Put a ball's body on its path at the end of this step, or to rest."""
        path = ball.path
        position, velocity = path.at(self.time)
        ball.body.position = position
        if path.stop <= self.time:
            self._rest(ball)
            return
        (x, y), (next_x, next_y) = position, path.at(self.time + self.dt)[0]
        ball.body.velocity = ((next_x - x) / self.dt, (next_y - y) / self.dt)
        margin = math.hypot(*velocity) * self.dt if self.contacts == "swept" else 0.0
        rounding = TOUCH * ball.radius + 16.0 * EPSILON * (abs(x) + abs(y))
        ball.feeler.unsafe_set_radius(ball.radius + margin + rounding)
        if ball.number not in self.moving:
            self.moving[ball.number] = ball
            self._slow_down(ball)
        self._next_stop = min(self._next_stop, path.stop)

    def _slow_down(self, ball: Ball) -> None:
        """Install surface friction on a ball that begins to move."""
        if self.deceleration == 0.0:
            return
        if self.friction == "joint":
            ball.joint = _friction_joint(self.space, ball.body, self.deceleration)
            self.space.add(ball.joint)
        else:
            ball.body.velocity_func = self._damp

    def _rest(self, ball: Ball) -> None:
        """A ball stops; from now on it costs nothing."""
        ball.body.velocity = (0.0, 0.0)
        ball.feeler.unsafe_set_radius(ball.radius * (1.0 - TOUCH))
        self._note_rest(ball)
        if self.moving.pop(ball.number, None) is None:
            return
        if ball.joint is not None:
            self.space.remove(ball.joint)
            ball.joint = None
        elif self.deceleration > 0.0:
            ball.body.velocity_func = pymunk.Body.update_velocity

    def _note_rest(self, ball: Ball) -> None:
        if ball.rested < math.inf:
            return
        ball.rested = ball.path.stop
        if self.on_stop is not None:
            self.on_stop(ball)

    def _note_rest_before(self, ball: Ball, t: float, kicked: bool) -> None:
        """A ball that is hit at ``t`` had come to rest, or stopped for a moment between kicks."""
        stopped = min(ball.rested, ball.path.stop)
        if not (kicked and self.hits.was_kicked(ball.number, stopped, t)):
            self._note_rest(ball)
        elif ball.rested < math.inf:
            if self.on_stir is not None:
                self.on_stir(ball)
            ball.rested = math.inf

    def _stop_balls(self) -> None:
        """Put balls to rest whose paths have ended, and lead those there that end in this step."""
        for ball in list(self.moving.values()):
            if ball.path.stop <= self.time:
                self._carry(ball)
            elif ball.path.stop <= self.time + self.dt:
                ball.body.velocity = self._mean_velocity(ball.path, self.time)
        self._next_stop = min((ball.path.stop for ball in self.moving.values()), default=math.inf)

    # -- contacts --------------------------------------------------------------------------------

    def _answer_contacts(self, near: Collection[Near], since: float) -> None:
        """Find the contacts of the step that began at ``since``, and answer them in their order."""
        changed = {ball.number: ball for ball in self._moved_by_others}
        self._moved_by_others.clear()
        due: list[Due] = []
        self._foresee(due, near, since)
        for i in changed:
            self._foresee(due, self._what_may_follow(i, changed, near), since)
        while due and due[0].t <= self.time and self.is_finite:
            first = heappop(due)
            if self._is_current(first):
                answer = self.hits.answer(self._at_this_instant(first, due), first.t)
                self._go_on(answer, first.t, changed)
                for i in answer.velocity:
                    self._foresee(due, self._what_may_follow(i, changed, near), first.t)
                self._foresee(due, self._still_touching(answer, first.t), first.t)
                if not self.is_finite:
                    self.time = first.t
                if self.on_answer is not None:
                    self.on_answer(first.t)
        for ball in changed.values():
            self._carry(ball)

    def _foresee(self, due: list[Due], pairs: Iterable[Near], since: float) -> None:
        """Note when these pairs meet."""
        contact_time = self._overlap_time if self.contacts == "discrete" else self._contact_time
        for pair in pairs:
            t = contact_time(pair, since)
            if t < math.inf:
                self._order += 1
                heappush(due, Due(t, self._order, pair, *self._paths(pair)))

    def _contact_time(self, pair: Near, since: float) -> float:
        """When the two meet, if they do in this step, or in the next if nothing else happens."""
        i, j = pair
        a = self.balls[i]
        until = self.time + self.dt
        if j >= 0:
            b = self.balls[j]
            since = max(since, a.path.t, b.path.t)
            past = self.hits.past(i, j, since)
            return pair_time(a.path, b.path, a.radius + b.radius, since, until, past)
        length = min([length_to(side, a.path, a.radius) for side in self.walls[-1 - j].sides])
        t = max(a.path.time_at(length), since) if length < a.path.reach else math.inf
        return t if t <= until else math.inf

    def _still_touching(self, answer: Answer, t: float) -> Iterator[Near]:
        """Pairs that touch and do not close: they may, where both move."""
        for touch in answer.missed:
            if all(self.balls[i].path.stop > t for i in touch.balls):
                yield touch[:2]

    def _overlap_time(self, pair: Near, _since: float) -> float:
        """The end of the step, if they overlap there and close; "discrete" knows no other time."""
        closes = self._gap(pair, self.time) < 0.0 and self._closes(pair, self.time)
        return self.time if closes else math.inf

    def _instant(self, pair: Near) -> float:
        """How far apart in time (s) contacts of one instant may seem to be."""
        i, j = pair
        speed = self.balls[i].path.speed
        if j >= 0:
            speed = max(speed, self.balls[j].path.speed)
        return NEARLY_NOW * self.balls[i].radius / speed if speed > 0.0 else 0.0

    def _paths(self, pair: Near) -> tuple[Path, Path | None]:
        i, j = pair
        return self.balls[i].path, self.balls[j].path if j >= 0 else None

    def _is_current(self, due: Due) -> bool:
        path, other = self._paths(due.pair)
        return path is due.path and other is due.other

    def _at_this_instant(self, first: Due, due: list[Due]) -> list[Near]:
        """The pair that is due, and all whose gaps are closed with its."""
        latest = first.t + self._instant(first.pair)
        same, later = {first.pair: None}, []
        while due and due[0].t <= latest:
            other = heappop(due)
            if self._is_current(other):
                if self._gap(other.pair, first.t) <= self._rounding(other.pair, first.t):
                    same[other.pair] = None
                else:
                    later.append(other)
        for other in later:
            heappush(due, other)
        return list(same)

    def _gap(self, pair: Near, t: float) -> float:
        """Distance (m) between two surfaces at ``t``; negative where they overlap."""
        i, j = pair
        position = self.balls[i].path.at(t)[0]
        if j >= 0:
            other = self.balls[j].path.at(t)[0]
            return math.dist(position, other) - self.balls[i].radius - self.balls[j].radius
        return self.walls[-1 - j].nearest(position)[0] - self.balls[i].radius

    def _rounding(self, pair: Near, t: float) -> float:
        x, y = self.balls[pair[0]].path.at(t)[0]
        reach = sum(self.balls[i].radius for i in pair if i >= 0)
        return 32.0 * EPSILON * (abs(x) + abs(y) + reach)

    def _closes(self, pair: Near, t: float) -> bool:
        velocity = {i: self.balls[i].path.at(t)[1] for i in pair if i >= 0}
        return closing_speed(self.touch(pair, t), velocity) > self.hits.noise_of(*pair)

    def _what_may_follow(
        self, i: int, changed: Collection[int], near: Collection[Near]
    ) -> list[Near]:
        """What a ball with a new path can meet in the rest of the step."""
        if self.contacts == "discrete":
            return [pair for pair in near if i in pair]
        path, r = self.balls[i].path, self.balls[i].radius
        (x0, y0), (x1, y1) = path.position, path.at(self.time)[0]
        r += 1e-6 * r + 16.0 * EPSILON * (abs(x0) + abs(y0))
        box = pymunk.BB(min(x0, x1) - r, min(y0, y1) - r, max(x0, x1) + r, max(y0, y1) + r)
        found = [self._number.get(s) for s in self.space.bb_query(box, pymunk.ShapeFilter())]
        others = {j for j in found if j is not None and j != i} | {*changed} - {i}
        return [(i, j) if j < 0 or i < j else (j, i) for j in others]

    def _go_on(self, answer: Answer, t: float, changed: dict[int, Ball]) -> None:
        """New paths for the balls that were hit; tell of the hits."""
        kicked = {i for touch in answer.pressed for i in touch.balls}
        for i, velocity in answer.velocity.items():
            ball = changed[i] = self.balls[i]
            if ball.path.stop <= t:
                self._note_rest_before(ball, t, i in kicked)
            self._set_off(ball, t, ball.path.at(t)[0], velocity)
        if self.on_contact is not None:
            for touch in answer.listed:
                self.on_contact(Contact(t, touch.balls, touch.cushion))

    # -- what the policies ask for ---------------------------------------------------------------

    def path_of(self, i: int) -> Path:
        """The path of ball ``i``."""
        return self.balls[i].path

    def radius_of(self, i: int) -> float:
        """The radius (m) of ball ``i``."""
        return self.balls[i].radius

    def touch(self, pair: Near, t: float) -> Touch:
        """How the two touch at ``t``."""
        i, j = pair
        x, y = self.balls[i].path.at(t)[0]
        if j >= 0:
            bx, by = self.balls[j].path.at(t)[0]
            return Touch(i, j, unit(bx - x, by - y), self.pair(i, j))
        wall = self.walls[-1 - j]
        pair_ = Pair(self.balls[i].body.mass, math.inf, wall.restitution, wall.friction)
        return Touch(i, NO_BALL, wall.nearest((x, y))[1], pair_, wall.number)

    def warn(self, text: str, t: float) -> None:
        """Tell the user something about what happened at ``t`` (s)."""
        if self.on_warning is not None:
            self.on_warning(text, t)


def same_balls(restitution: float, friction: float, mass: float) -> Callable[[int, int], Pair]:
    """The ``pair`` of a table whose balls are all alike.

    >>> same_balls(0.9, 0.05, mass=0.2)(0, 1)
    Pair(m_a=0.2, m_b=0.2, restitution=0.9, friction=0.05)
    """
    return lambda _i, _j: Pair(mass, mass, restitution, friction)


def _friction_joint(
    space: pymunk.Space, body: pymunk.Body, deceleration: float
) -> pymunk.PivotJoint:
    """Coulomb friction inside the C step: a joint that pulls back with m a and holds no place."""
    joint = pymunk.PivotJoint(space.static_body, body, (0.0, 0.0), (0.0, 0.0))
    joint.max_bias = 0.0
    joint.max_force = body.mass * deceleration
    return joint


def _no_response(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
    arbiter.process_collision = False


def _vector(v: tuple[float, float]) -> Vector:
    return (v[0], v[1])
