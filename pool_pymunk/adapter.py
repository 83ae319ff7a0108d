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
from collections.abc import Callable
from typing import Literal, NamedTuple

import pymunk

from pool_pymunk.contact import LAWS, Pair
from pool_pymunk.impact import NO_BALL, Impacts, Touch, closing_speed
from pool_pymunk.motion import Vector
from pool_pymunk.path import (
    EPSILON,
    Face,
    Path,
    Post,
    face_length,
    pair_time,
    post_length,
)

Contacts = Literal["swept", "discrete"]
FrictionBy = Literal["joint", "callback"]
Near = tuple[int, int]  # two balls, lower number first; or a ball and -1 - the number of a wall

BALL, FEELER, WALL = 0x42616C6C, 0x4665656C, 0x57616C6C  # collision types of our own
NEARLY_NOW = 1e-9  # s; contacts so close in time may be of one instant: their gaps decide
COLLAPSE = 500  # hits in a row, each within CONTACT_TIME of the last: elastic from there
CONTACT_TIME = 1e-3  # in units of radius / speed


class Contact(NamedTuple):
    """A contact that was answered: when, and of which balls, or of a ball and a wall's number."""

    t: float
    balls: tuple[int, ...]
    wall: int | None


class Wall(NamedTuple):
    """What a ball can bounce off: the sides of a shape, its coefficients, and its number."""

    sides: tuple[Face | Post, ...]
    restitution: float
    friction: float
    number: int


class Ball:
    """A ball on the table: its body, the circle that feels what is near, and its path."""

    __slots__ = ("body", "feeler", "hits", "joint", "last_hit", "number", "path", "radius", "rests")

    def __init__(self, number: int, radius: float, feeler: pymunk.Circle, path: Path) -> None:
        assert feeler.body is not None
        self.number = number
        self.radius = radius
        self.feeler = feeler
        self.body = feeler.body
        self.path = path
        self.rests = path.speed == 0.0
        self.joint: pymunk.PivotJoint | None = None  # friction, while it moves
        self.hits = 0  # in a row, each soon after the one before
        self.last_hit = -math.inf


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
        self.impacts = Impacts(LAWS[law])
        self.on_contact: Callable[[Contact], None] | None = None
        self.on_path: Callable[[Ball], None] | None = None
        self.on_stop: Callable[[Ball], None] | None = None
        self.on_warning: Callable[[str], None] | None = None
        self.balls: list[Ball] = []
        self.walls: list[Wall] = []
        self.moving: dict[int, Ball] = {}
        self.time = 0.0
        self.steps = 0
        self.is_finite = True
        self._next_stop = math.inf
        self._near: dict[Near, None] = {}
        self._number: dict[pymunk.Shape, int] = {}  # of a feeler's ball, or -1 - that of a wall
        self._ball_of: dict[pymunk.Body, Ball] = {}
        self._moved_by_others: list[Ball] = []
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
        self._carry(ball)
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
        self._set_off(ball, self.time, ball.path.at(self.time)[0], velocity)
        self._carry(ball)

    # -- stepping --------------------------------------------------------------------------------

    def step(self) -> None:
        """One step of a space that holds nothing else, contacts and stops inside it included.

        What a callback raised comes out here: pymunk itself only prints it.
        """
        self.space.step(self.dt)
        self._after_step()

    def _after_step(self, *_: object) -> None:
        """Answer what happened in the step that pymunk has just made; mostly nothing."""
        since = self.time
        self.steps += 1
        self.time = self.steps * self.dt
        if self._near or self._moved_by_others:
            near, self._near = self._near, {}
            self._answer_contacts(list(near), since)
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
        """A ball begins a new path at ``t``; it may have stopped earlier in the same step."""
        if ball.path.stop <= t:
            self._note_rest(ball)
        ball.rests = False
        ball.path = self._path(t, position, velocity)
        self.is_finite = self.is_finite and math.isfinite(ball.path.speed)
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
        ball.body.velocity = self._mean_velocity(path, self.time)
        margin = math.hypot(*velocity) * self.dt if self.contacts == "swept" else 0.0
        rounding = 1e-9 * ball.radius + 16.0 * EPSILON * (abs(position[0]) + abs(position[1]))
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
        ball.feeler.unsafe_set_radius(ball.radius * (1.0 - 1e-9))
        self._note_rest(ball)
        if self.moving.pop(ball.number, None) is None:
            return
        if ball.joint is not None:
            self.space.remove(ball.joint)
            ball.joint = None
        elif self.deceleration > 0.0:
            ball.body.velocity_func = pymunk.Body.update_velocity

    def _note_rest(self, ball: Ball) -> None:
        if not ball.rests and self.on_stop is not None:
            self.on_stop(ball)
        ball.rests = True

    def _stop_balls(self) -> None:
        """Put balls to rest whose paths have ended, and lead those there that end in this step."""
        for ball in list(self.moving.values()):
            if ball.path.stop <= self.time:
                self._carry(ball)
            elif ball.path.stop <= self.time + self.dt:
                ball.body.velocity = self._mean_velocity(ball.path, self.time)
        self._next_stop = min((ball.path.stop for ball in self.moving.values()), default=math.inf)

    # -- contacts --------------------------------------------------------------------------------

    def _answer_contacts(self, near: list[Near], since: float) -> None:
        """Find the contacts of the step that began at ``since``, and answer them in their order."""
        changed = {ball.number: ball for ball in self._moved_by_others}
        self._moved_by_others.clear()
        for i in changed:
            near += self._what_may_follow(i, changed)
        times = {pair: self._contact_time(pair, since) for pair in near}
        while times:
            t = min(times.values())
            if t > self.time:
                break
            now = [p for p, at in times.items() if at == t or self._meets_at(p, at, t)]
            touched = self._answer(now, t)
            for pair in now:
                times[pair] = math.inf
            for i in touched:
                changed[i] = self.balls[i]
                times.update((pair, 0.0) for pair in self._what_may_follow(i, changed))
            for pair in [pair for pair in times if touched.intersection(pair)]:
                times[pair] = self._contact_time(pair, t)
        for ball in changed.values():
            self._carry(ball)

    def _contact_time(self, pair: Near, since: float) -> float:
        """When the two meet in what is left of this step; infinite if they do not."""
        i, j = pair
        if self.contacts == "discrete":
            closes = self._gap(pair, self.time) < 0.0 and self._closes(pair, self.time)
            return self.time if closes else math.inf
        a = self.balls[i]
        if j >= 0:
            b = self.balls[j]
            begin = max(since, a.path.t, b.path.t)
            return pair_time(a.path, b.path, a.radius + b.radius, begin, self.time)
        length = min(
            face_length(a.path, a.radius, side)
            if isinstance(side, Face)
            else post_length(a.path, a.radius, side)
            for side in self.walls[-1 - j].sides
        )
        t = max(a.path.time_at(length), since) if length < a.path.reach else math.inf
        return t if t <= self.time else math.inf

    def _meets_at(self, pair: Near, at: float, t: float) -> bool:
        """Whether a contact predicted for ``at`` has its gap closed, to rounding, at ``t``."""
        if at > t + NEARLY_NOW:
            return False
        x, y = self.balls[pair[0]].path.at(t)[0]
        return self._gap(pair, t) <= 32.0 * EPSILON * (abs(x) + abs(y) + self.balls[pair[0]].radius)

    def _gap(self, pair: Near, t: float) -> float:
        """Distance (m) between two surfaces at ``t``; negative where they overlap."""
        i, j = pair
        position = self.balls[i].path.at(t)[0]
        if j >= 0:
            other = self.balls[j].path.at(t)[0]
            return math.dist(position, other) - self.balls[i].radius - self.balls[j].radius
        return _nearest_side(self.walls[-1 - j], position)[0] - self.balls[i].radius

    def _closes(self, pair: Near, t: float) -> bool:
        velocity = {i: self.balls[i].path.at(t)[1] for i in pair if i >= 0}
        speeds = sum(math.hypot(*v) for v in velocity.values())
        return closing_speed(self._touch(pair, t), velocity) > 16.0 * EPSILON * speeds

    def _touch(self, pair: Near, t: float) -> Touch:
        i, j = pair
        x, y = self.balls[i].path.at(t)[0]
        if j >= 0:
            bx, by = self.balls[j].path.at(t)[0]
            return Touch(
                i, j, _unit(bx - x, by - y), self._elastic_if_squeezed(pair, self.pair(i, j))
            )
        wall = self.walls[-1 - j]
        normal = _nearest_side(wall, (x, y))[1]
        mass = self.balls[i].body.mass
        coefficients = Pair(mass, math.inf, wall.restitution, wall.friction)
        return Touch(i, NO_BALL, normal, self._elastic_if_squeezed(pair, coefficients), wall.number)

    def _answer(self, pairs: list[Near], t: float) -> set[int]:
        """Answer contacts of one instant by the law; returns the balls that have a new path."""
        touches = _distinct([self._touch(p, t) for p in pairs if self._closes(p, t)])
        balls = {i for touch in touches for i in touch[:2] if i != NO_BALL}
        state = {i: self.balls[i].path.at(t) for i in balls}
        velocity = {i: v for i, (_, v) in state.items()}
        self.impacts.answer(touches, velocity)
        for touch in touches:
            self._report(touch, t)
        for i in sorted(balls):
            self._count_hit(self.balls[i], t)
            self._set_off(self.balls[i], t, state[i][0], velocity[i])
        return balls

    def _what_may_follow(self, i: int, changed: dict[int, Ball]) -> list[Near]:
        """What a ball with a new path can meet in the rest of the step."""
        ball = self.balls[i]
        if ball.path.stop <= ball.path.t or self.contacts == "discrete":
            return []
        x0, y0 = ball.path.position
        x1, y1 = ball.path.at(self.time)[0]
        r = ball.radius * (1.0 + 1e-6)
        box = pymunk.BB(min(x0, x1) - r, min(y0, y1) - r, max(x0, x1) + r, max(y0, y1) + r)
        found = [self._number.get(s) for s in self.space.bb_query(box, pymunk.ShapeFilter())]
        others = {j for j in found if j is not None and j != i} | (changed.keys() - {i})
        return [(i, j) if j < 0 or i < j else (j, i) for j in others]

    def _report(self, touch: Touch, t: float) -> None:
        if self.on_contact is not None:
            balls = (touch.a,) if touch.b == NO_BALL else (touch.a, touch.b)
            self.on_contact(Contact(t, balls, touch.cushion))

    # -- inelastic collapse ----------------------------------------------------------------------

    def _count_hit(self, ball: Ball, t: float) -> None:
        contact_time = CONTACT_TIME * ball.radius / max(ball.path.speed, 1e-100)
        ball.hits = ball.hits + 1 if t - ball.last_hit <= contact_time else 0
        ball.last_hit = t

    def _elastic_if_squeezed(self, pair: Near, coefficients: Pair) -> Pair:
        squeezed = any(self.balls[i].hits > COLLAPSE for i in pair if i >= 0)
        if not squeezed or coefficients.restitution == 1.0:
            return coefficients
        if self.on_warning is not None:
            self.on_warning("inelastic collapse: hits taken as elastic from there (TC model)")
        return coefficients._replace(restitution=1.0)


def same_balls(restitution: float, friction: float, mass: float) -> Callable[[int, int], Pair]:
    """The ``pair`` of a table whose balls are all alike.

    >>> same_balls(0.9, 0.05, mass=0.2)(0, 1)
    Pair(m_a=0.2, m_b=0.2, restitution=0.9, friction=0.05)
    """
    return lambda _i, _j: Pair(mass, mass, restitution, friction)


def sides_of(shape: pymunk.Shape) -> tuple[Face | Post, ...]:
    """The faces and corners of a static segment, circle or polygon."""
    body = shape.body
    assert body is not None
    if isinstance(shape, pymunk.Circle):
        return (Post(_vector(body.local_to_world(shape.offset)), shape.radius),)
    if isinstance(shape, pymunk.Segment):
        corners = [_vector(body.local_to_world(end)) for end in (shape.a, shape.b)]
    else:
        assert isinstance(shape, pymunk.Poly), "walls are segments, circles or polygons"
        corners = [_vector(body.local_to_world(corner)) for corner in shape.get_vertices()]
    outline = zip(corners, corners[1:] + corners[:1], strict=True)
    faces = [face_between(b, a, shape.radius) for a, b in outline]  # a polygon's outside
    return (*faces, *(Post(corner, shape.radius) for corner in corners))


def face_between(start: Vector, end: Vector, radius: float = 0.0) -> Face:
    """The face on the left of the way from ``start`` to ``end``."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    tangent = (dx / length, dy / length)
    return Face(start, tangent, (-tangent[1], tangent[0]), length, radius)


def _nearest_side(wall: Wall, point: Vector) -> tuple[float, Vector]:
    """Distance (m) of a point from the wall's surface, and the normal there."""
    found: list[tuple[float, Vector]] = []
    for side in wall.sides:
        if isinstance(side, Post):
            dx, dy = point[0] - side.center[0], point[1] - side.center[1]
            found.append((math.hypot(dx, dy) - side.radius, _unit(dx, dy)))
        elif 0.0 <= side.along(point) <= side.length:
            found.append((side.height(point) - side.radius, side.normal))
    return min(found, key=lambda item: abs(item[0])) if found else (math.inf, (1.0, 0.0))


def _distinct(touches: list[Touch]) -> list[Touch]:
    """The touches without those that say the same twice, as two cushions at a common corner do."""
    kept: list[Touch] = []
    for touch in touches:
        if not any(touch.b == NO_BALL and _same(touch, other) for other in kept):
            kept.append(touch)
    return kept


def _same(one: Touch, other: Touch) -> bool:
    turn = one.normal[0] * other.normal[0] + one.normal[1] * other.normal[1]
    return one.a == other.a and other.b == NO_BALL and turn > 1.0 - 1e-12


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


def _unit(x: float, y: float) -> Vector:
    length = math.hypot(x, y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)
