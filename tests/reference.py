"""This is an independent exact solver in 40 digits, for tests: it is slow and plain.

It shares nothing with ``event-driven`` except the scene's numbers. Gaps are polynomials in time
(degree 4 between discs, 2 to a cushion). Their roots are isolated between the roots of their
derivatives, and closed in by bisection and Newton. The contact laws are written anew from Eqs. 1-10
and Listing 3. Contacts are answered one at a time. So a scene is refused if several contacts happen
at one instant in it, or if balls come together at next to no speed.

``python -m tests.reference`` makes ``tests/data/reference_runs.json``, ``pocket_runs.json`` and
``rolling_runs.json`` anew from their seeds; a name makes one of them.
"""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from mpmath import mp, mpf

from pool_pymunk import Ball, Friction, Physics, Pocket, Restitution, Scene, State, Table

DATA = Path(__file__).parent / "data"
DIGITS = 40
ROUNDING = mpf(10) ** -30  # m, m/s; 40 digits leave so much of zero
GENTLE = mpf(10) ** -6  # m/s; contacts that close more slowly are refused
APART = mpf(10) ** -8  # s; contacts of neighbours that are closer in time are refused
MOST_EVENTS = 400

Number = Any  # mpmath has no types
Poly = list[Number]  # coefficients, lowest first
Vec = tuple[Number, Number]


class Refused(Exception):
    """This error says that the scene has contacts which this reference does not decide."""


# -- polynomials -----------------------------------------------------------------------------------


def value(poly: Poly, t: Number) -> Number:
    """Return the polynomial at ``t``, by Horner's rule."""
    total = mpf(0)
    for coefficient in reversed(poly):
        total = total * t + coefficient
    return total


def derivative(poly: Poly) -> Poly:
    """Return d/dt of the polynomial."""
    return [k * coefficient for k, coefficient in enumerate(poly)][1:]


def product(p: Poly, q: Poly) -> Poly:
    """Return the product of two polynomials."""
    out = [mpf(0)] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            out[i + j] += a * b
    return out


def real_roots(poly: Poly, low: Number, high: Number) -> list[Number]:
    """Return the real roots of odd multiplicity in (low, high), in order."""
    while poly and poly[-1] == 0:
        poly = poly[:-1]
    if len(poly) < 2:
        return []
    turns = [low, *real_roots(derivative(poly), low, high), high]
    return [
        _root_between(poly, a, b) for a, b in pairwise(turns) if value(poly, a) * value(poly, b) < 0
    ]


def _root_between(poly: Poly, low: Number, high: Number) -> Number:
    """Find the root by Newton's iteration, kept inside a shrinking bracket."""
    slope = derivative(poly)
    rises = value(poly, high) > 0
    t = (low + high) / 2
    for _ in range(4 * mp.prec):
        height, steepness = value(poly, t), value(slope, t)
        low, high = (low, t) if (height > 0) == rises else (t, high)
        newton = t - height / steepness if steepness != 0 else low
        if abs(newton - t) <= mp.eps * (1 + abs(t)) or high - low <= mp.eps * (1 + abs(t)):
            return t
        t = newton if low < newton < high else (low + high) / 2
    raise ArithmeticError("no root where the sign changes")


# -- the balls and what they meet ------------------------------------------------------------------


@dataclass
class Disc:
    """This is a disc of the scene, at the present time."""

    place: Vec
    velocity: Vec
    radius: Number
    mass: Number
    cue: bool
    roll: Vec | None = None  # m/s; the velocity at which it would roll, where balls roll
    gone: bool = False  # A pocket has it.

    @property
    def speed(self) -> Number:
        return mp.hypot(*self.velocity)

    @property
    def slip(self) -> Vec:
        """The velocity less the roll (m/s), without what rounding leaves; 0 where none rolls."""
        u = (mpf(0), mpf(0)) if self.roll is None else _minus(self.velocity, self.roll)
        return u if mp.hypot(*u) > ROUNDING else (mpf(0), mpf(0))

    @property
    def moves(self) -> bool:
        return bool(self.velocity != (0, 0) or self.slip != (0, 0))


@dataclass
class ReferenceRun:
    """This holds the events and the end of a run, in 40 digits.

    An event is its time, kind, balls, and the number of the cushion or pocket.
    """

    events: list[tuple[Number, str, tuple[int, ...], int | None]] = field(default_factory=list)
    final: list[Vec] = field(default_factory=list)
    velocity: list[Vec] = field(default_factory=list)
    duration: Number = 0
    gentlest: Number = mp.inf


# This is a kind, a ball, and the other ball, cushion, corner or pocket (-1: stop).
Key = tuple[str, int, int]


class Reference:
    """This is the scene in 40 digits; ``run`` plays it."""

    def __init__(self, scene: Scene, start: State) -> None:
        self.scene = scene
        gravity, rolling = mpf(scene.physics.gravity), scene.friction.rolling
        self.loss = mpf(scene.friction.surface) * gravity
        self.drag = self.loss if rolling is None else mpf(rolling) * gravity
        rolls = [None] * len(scene.balls) if start.roll is None else [_vec(w) for w in start.roll]
        self.discs = [
            Disc(_vec(p), _vec(v), mpf(ball.radius), mpf(ball.mass), ball.cue, w)
            for ball, p, v, w in zip(
                scene.balls, start.position, start.velocity, rolls, strict=True
            )
        ]
        outline = [_vec(corner) for corner in scene.table.outline] if scene.table else []
        self.sides = list(zip(outline, outline[1:] + outline[:1], strict=True))
        self.pockets = [(_vec(hole.position), mpf(hole.radius)) for hole in scene.pockets]
        self.now = mpf(0)
        self.due: dict[Key, Number] = {}
        self.out = ReferenceRun()

    def run(self, max_time: float | None) -> ReferenceRun:
        """Play until everything rests or ``max_time`` (s)."""
        self._foresee(set(range(len(self.discs))))
        last = mp.inf if max_time is None else mpf(max_time)
        while self.due:
            key = min(self.due, key=lambda one: self.due[one])
            t = self.due[key]
            if t > last or len(self.out.events) >= MOST_EVENTS:
                break
            self._refuse_what_is_near(key, t)
            self._advance(t)
            self._foresee(self._happen(key))
        if any(disc.moves for disc in self.discs):
            if last == mp.inf or len(self.out.events) >= MOST_EVENTS:
                raise Refused("too many events")
            self._advance(last)
            self.out.duration = last
        self.out.final = [disc.place for disc in self.discs]
        self.out.velocity = [disc.velocity for disc in self.discs]
        return self.out

    def _refuse_what_is_near(self, key: Key, t: Number) -> None:
        mine = _balls(key)
        for other, due in self.due.items():
            if other != key and due - t < APART and mine & _balls(other):
                raise Refused(f"{key} and {other} within {due - t} s")

    # -- motion, Eq. 10; a sphere that slips gains roll at 5/2 of what its velocity loses ----------

    def _acceleration(self, disc: Disc) -> Vec:
        """Return the acceleration: against the slip where there is some, else the velocity."""
        slips = disc.slip != (0, 0)
        along, size = (disc.slip, self.loss) if slips else (disc.velocity, self.drag)
        length = mp.hypot(*along)
        return (mpf(0), mpf(0)) if length == 0 else _scaled(-size / length, along)

    def _path(self, disc: Disc) -> tuple[Poly, Poly]:
        """Return x and y as polynomials in the time from now, until the phase ends."""
        ax, ay = self._acceleration(disc)
        return [disc.place[0], disc.velocity[0], ax / 2], [disc.place[1], disc.velocity[1], ay / 2]

    def _ends_in(self, disc: Disc) -> Number:
        """Return in how long the disc stops, or rolls if it slips."""
        if disc.slip != (0, 0):
            return 2 * mp.hypot(*disc.slip) / (7 * self.loss) if self.loss > 0 else mp.inf
        return disc.speed / self.drag if disc.moves and self.drag > 0 else mp.inf

    def _advance(self, t: Number) -> None:
        for disc in self.discs:
            if disc.moves:
                x, y = self._path(disc)
                dt, slips = t - self.now, disc.slip != (0, 0)
                if disc.roll is not None and slips:
                    gain = _scaled(-dt * 5 / 2, self._acceleration(disc))
                    disc.roll = (disc.roll[0] + gain[0], disc.roll[1] + gain[1])
                disc.place = (value(x, dt), value(y, dt))
                disc.velocity = (value(derivative(x), dt), value(derivative(y), dt))
                if disc.roll is not None and not slips:
                    disc.roll = disc.velocity
        self.now = t

    # -- what comes ------------------------------------------------------------------------------

    def _foresee(self, changed: set[int]) -> None:
        """Work out anew what may happen to the discs that changed."""
        self.due = {key: t for key, t in self.due.items() if not _balls(key) & changed}
        for i in sorted(changed):
            if self.discs[i].moves:
                self.due.update({k: self.now + t for k, t in self._alone(i) if t is not None})
            for j in range(len(self.discs)):
                if j != i and (j not in changed or j > i) and not self._are_gone(i, j):
                    t = self._meeting(min(i, j), max(i, j))
                    if t is not None:
                        self.due["ball-ball", min(i, j), max(i, j)] = self.now + t

    def _are_gone(self, i: int, j: int) -> bool:
        return self.discs[i].gone or self.discs[j].gone

    def _alone(self, i: int) -> Iterator[tuple[Key, Number | None]]:
        """Yield the end of the disc's phase, its falls into pockets, and contacts with sides."""
        disc = self.discs[i]
        until = self._ends_in(disc)
        if until < mp.inf:
            yield ("stop" if disc.slip == (0, 0) else "roll", i, -1), until
        x, y = self._path(disc)
        for k, (center, radius) in enumerate(self.pockets):
            yield ("pocket", i, k), self._first_touch(x, y, center, radius, until)
        for k, (start, end) in enumerate(self.sides):
            (tx, ty), length = _unit(_minus(end, start))
            height = [-ty * px + tx * py for px, py in zip(x, y, strict=True)]
            height[0] -= -ty * start[0] + tx * start[1] + disc.radius
            for t in _entries(height, until):
                foot = (value(x, t) - start[0]) * tx + (value(y, t) - start[1]) * ty
                if 0 <= foot <= length:
                    yield ("face", i, k), t
                    break
            if self._is_reflex(k):
                yield ("corner", i, k), self._first_touch(x, y, start, disc.radius, until)

    def _is_reflex(self, k: int) -> bool:
        (a, b), (_, c) = self.sides[k - 1], self.sides[k]
        u, v = _minus(b, a), _minus(c, b)
        return bool(u[0] * v[1] - u[1] * v[0] < 0)

    def _first_touch(
        self, x: Poly, y: Poly, point: Vec, reach: Number, until: Number
    ) -> Number | None:
        """Return when a moving point first comes within ``reach`` of a fixed one."""
        dx, dy = [x[0] - point[0], *x[1:]], [y[0] - point[1], *y[1:]]
        gap = [a + b for a, b in zip(product(dx, dx), product(dy, dy), strict=True)]
        gap[0] -= reach**2
        return next(iter(_entries(gap, until)), None)

    def _meeting(self, i: int, j: int) -> Number | None:
        a, b = self.discs[i], self.discs[j]
        if not (a.moves or b.moves):
            return None
        (ax, ay), (bx, by) = self._path(a), self._path(b)
        x = [p - q for p, q in zip(bx, ax, strict=True)]
        y = [p - q for p, q in zip(by, ay, strict=True)]
        until = min(self._ends_in(a), self._ends_in(b))
        return self._first_touch(x, y, (mpf(0), mpf(0)), a.radius + b.radius, until)

    # -- what happens ----------------------------------------------------------------------------

    def _happen(self, key: Key) -> set[int]:
        """Let it happen, and return the discs whose motion changed."""
        kind, i, j = key
        if kind == "stop" or (kind == "roll" and self.discs[i].speed < ROUNDING):
            self._stop(i)
            return {i}
        if kind == "roll":
            self.discs[i].roll = self.discs[i].velocity
            self.out.events.append((self.now, "roll", (i,), None))
            return {i}
        if kind == "pocket":
            disc = self.discs[i]
            disc.place, disc.velocity, disc.gone = self.pockets[j][0], (mpf(0), mpf(0)), True
            disc.roll = None if disc.roll is None else disc.velocity
            self.out.events.append((self.now, kind, (i,), j))
            self.out.duration = self.now
            return {i}
        if kind == "ball-ball":
            self.out.events.append((self.now, kind, (i, j), None))
            self._collide(self.discs[i], self.discs[j])
        else:
            self.out.events.append((self.now, "ball-cushion", (i,), j))
            self._bounce(self.discs[i], self._cushion_normal(kind, i, j))
        for k in _balls(key):
            disc = self.discs[k]
            if disc.slip == (0, 0) and (not disc.moves or disc.speed < ROUNDING):
                self._stop(k)
        return _balls(key)

    def _stop(self, i: int) -> None:
        disc = self.discs[i]
        disc.velocity = (mpf(0), mpf(0))
        disc.roll = None if disc.roll is None else disc.velocity
        self.out.events.append((self.now, "stop", (i,), None))
        self.out.duration = self.now

    def _cushion_normal(self, kind: str, i: int, k: int) -> Vec:
        start, end = self.sides[k]
        if kind == "corner":
            return _unit(_minus(self.discs[i].place, start))[0]
        (tx, ty), _ = _unit(_minus(end, start))
        return (-ty, tx)

    def _note_closing(self, speed: Number) -> None:
        if speed < GENTLE:
            raise Refused(f"a contact closes at {mp.nstr(speed, 3)} m/s")
        self.out.gentlest = min(self.out.gentlest, speed)

    def _bounce(self, disc: Disc, n: Vec) -> None:
        """Answer by Eq. 9: v_n' = -e v_n, and the tangential speed loses mu |v_n' - v_n|.

        It does not pass zero.
        """
        e, mu = mpf(self.scene.restitution.cushion or 0), mpf(self.scene.friction.cushion)
        t = (-n[1], n[0])
        v_n, v_t = _dot(disc.velocity, n), _dot(disc.velocity, t)
        self._note_closing(-v_n)
        new_n = -e * v_n
        new_t = mp.sign(v_t) * max(mpf(0), abs(v_t) - mu * abs(new_n - v_n))
        disc.velocity = _combine(new_n, n, new_t, t)
        if disc.roll is not None:
            w_n, w_t = _dot(disc.roll, n), _dot(disc.roll, t)
            w_n = mp.sign(w_n) * max(mpf(0), abs(w_n) - mu * abs(new_n - v_n) * 5 / 2)
            disc.roll = _combine(w_n, n, w_t, t)

    def _collide(self, a: Disc, b: Disc) -> None:
        """Answer by Eqs. 1-7: momentum and restitution along n, and the law's friction along t."""
        r = self.scene.restitution
        cue = (a.cue or b.cue) and r.cue_ball is not None
        e, mu = mpf((r.cue_ball if cue else r.ball_ball) or 0), mpf(self.scene.friction.ball_ball)
        n, _ = _unit(_minus(b.place, a.place))
        t = (-n[1], n[0])
        a_n, b_n, a_t, b_t = (_dot(d.velocity, w) for w in (n, t) for d in (a, b))
        self._note_closing(a_n - b_n)
        common = (a.mass * a_n + b.mass * b_n) / (a.mass + b.mass)
        new_a_n = common - e * b.mass * (a_n - b_n) / (a.mass + b.mass)
        new_b_n = new_a_n + e * (a_n - b_n)
        slip = a_t - b_t
        if self.scene.physics.law == "coulomb":
            m_eff = a.mass * b.mass / (a.mass + b.mass)
            j_t = min(mu * a.mass * (a_n - new_a_n), m_eff * abs(slip))
            new_a_t = a_t - mp.sign(slip) * j_t / a.mass
            new_b_t = b_t + mp.sign(slip) * j_t / b.mass
        else:
            rubs = abs(slip) >= mpf("1e-9") * (a_n - b_n)
            drag = mu * mp.sign(slip) if rubs else mpf(0)
            new_a_t = _clamped(a_t, a_t - drag * (a_n - new_a_n))
            new_b_t = _clamped(b_t, b_t + drag * (b_n - new_b_n))
        a.velocity = _combine(new_a_n, n, new_a_t, t)
        b.velocity = _combine(new_b_n, n, new_b_t, t)


def _clamped(before: Number, after: Number) -> Number:
    """Return 0 if a tangential velocity was not 0 and changed sign, as Listing 3 clamps it."""
    return mpf(0) if before != 0 and mp.sign(after) != mp.sign(before) else after


def _entries(gap: Poly, until: Number) -> Iterator[Number]:
    """Yield the times from now at which a gap closes: it goes from positive to negative."""
    if abs(gap[0]) < ROUNDING and gap[1] < -ROUNDING:
        yield mpf(0)
        return
    slope = derivative(gap)
    for t in real_roots(gap, mpf(0), until if until < mp.inf else _beyond_all_roots(gap)):
        if value(slope, t) < 0:
            yield t


def _beyond_all_roots(poly: Poly) -> Number:
    """Return Cauchy's bound on the size of a polynomial's roots."""
    while poly and poly[-1] == 0:
        poly = poly[:-1]
    return 1 + max((abs(c / poly[-1]) for c in poly[:-1]), default=mpf(0)) if poly else mpf(1)


def _balls(key: Key) -> set[int]:
    return {key[1], key[2]} if key[0] == "ball-ball" else {key[1]}


def _vec(point: Sequence[float]) -> Vec:
    return (mpf(point[0]), mpf(point[1]))


def _minus(a: Vec, b: Vec) -> Vec:
    return (a[0] - b[0], a[1] - b[1])


def _scaled(factor: Number, v: Vec) -> Vec:
    return (factor * v[0], factor * v[1])


def _dot(a: Vec, b: Vec) -> Number:
    return a[0] * b[0] + a[1] * b[1]


def _unit(v: Vec) -> tuple[Vec, Number]:
    length = mp.hypot(*v)
    return (v[0] / length, v[1] / length), length


def _combine(n_part: Number, n: Vec, t_part: Number, t: Vec) -> Vec:
    return (n_part * n[0] + t_part * t[0], n_part * n[1] + t_part * t[1])


def reference_run(scene: Scene, start: State | None = None) -> ReferenceRun:
    """Play the scene as its velocities have it (or from ``start``), in 40 digits."""
    with mp.workdps(DIGITS):
        return Reference(scene, start or scene.start(None)).run(scene.physics.max_time)


# -- random scenes ---------------------------------------------------------------------------------

OUTLINES: dict[str, tuple[tuple[float, float], ...] | None] = {
    "rectangle": ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)),
    "hexagon": tuple(
        (round(1.1 * math.cos(k * math.pi / 3), 3), round(1.1 * math.sin(k * math.pi / 3), 3))
        for k in range(6)
    ),
    "l-shape": ((0.0, 0.0), (2.0, 0.0), (2.0, 0.8), (0.9, 0.8), (0.9, 1.7), (0.0, 1.7)),
    "plane": None,
}
SCENES_EACH = 5  # There are this many for every law and table.
MOST_BALLS = 12


def random_scene(law: str, table: str, rng: random.Random) -> Scene:
    """Return 2 to 12 balls of any mass and size, most of them moving, with any coefficients."""
    outline = OUTLINES[table]
    surface = rng.choice([0.0, round(rng.uniform(0.02, 0.3), 3)])
    balls: list[Ball] = []
    wanted = rng.randint(2, MOST_BALLS)
    while len(balls) < wanted:
        radius = round(rng.uniform(0.02, 0.07), 4)
        x, y = round(rng.uniform(-1.0, 2.0), 4), round(rng.uniform(-1.0, 1.7), 4)
        ball = Ball(
            id=str(len(balls)),
            position=(x, y),
            radius=radius,
            mass=round(10 ** rng.uniform(-1.3, -0.2), 4),
            cue=not balls,
            velocity=_random_velocity(outline is None, (x, y), rng)
            if rng.random() < 0.7
            else (0.0, 0.0),
        )
        if _fits(ball, balls, outline):
            balls.append(ball)
    return Scene(
        balls=tuple(balls),
        table=Table(outline) if outline else None,
        restitution=Restitution(*(round(rng.uniform(0.3, 1.0), 2) for _ in range(3))),
        friction=Friction(
            surface, *(rng.choice([0.0, round(rng.uniform(0, 0.5), 2)]) for _ in "cb")
        ),
        physics=Physics(law=law, max_time=None if surface else 1.5),
    )


def random_pocket_scene(law: str, table: str, rng: random.Random) -> Scene:
    """Return a random scene with one to eight pockets, at corners and anywhere."""
    scene = random_scene(law, table, rng)
    corners = OUTLINES[table] or ()
    pockets: list[Pocket] = []
    wanted = rng.randint(1, 8)
    while len(pockets) < wanted:
        anywhere = (round(rng.uniform(-1.0, 2.0), 4), round(rng.uniform(-1.0, 1.7), 4))
        place = rng.choice(corners) if corners and rng.random() < 0.5 else anywhere
        radius = round(rng.uniform(0.02, 0.2), 4)
        if all(math.dist(ball.position, place) > 1.05 * radius for ball in scene.balls):
            pockets.append(Pocket(f"p{len(pockets)}", place, radius))
    return replace(scene, pockets=tuple(pockets))


def random_rolling_scene(law: str, table: str, rng: random.Random) -> Scene:
    """Return a random scene, some with pockets, in which balls slide, then roll."""
    scene = (random_pocket_scene if rng.random() < 0.4 else random_scene)(law, table, rng)
    surface = round(rng.uniform(0.05, 0.3), 3)
    rolling = rng.choice([0.0, round(rng.uniform(0.005, surface), 3)])
    rolls = [rng.choice([0.0, 1.0, round(rng.uniform(-3, 3), 3)]) for _ in scene.balls]
    return replace(
        scene,
        balls=tuple(replace(b, roll=w) for b, w in zip(scene.balls, rolls, strict=True)),
        friction=replace(scene.friction, surface=surface, rolling=rolling),
        physics=replace(scene.physics, max_time=None if rolling else 1.5),
    )


def _random_velocity(
    open_plane: bool, position: tuple[float, float], rng: random.Random
) -> tuple[float, float]:
    """Return any direction; on the open plane one towards the middle, so that balls meet."""
    speed = rng.uniform(0.3, 3.0)
    angle = rng.uniform(-math.pi, math.pi)
    if open_plane:
        angle = math.atan2(0.35 - position[1], 0.5 - position[0]) + rng.uniform(-0.2, 0.2)
    return (round(speed * math.cos(angle), 3), round(speed * math.sin(angle), 3))


def _fits(
    ball: Ball, balls: Sequence[Ball], outline: tuple[tuple[float, float], ...] | None
) -> bool:
    if any(math.dist(ball.position, b.position) < 1.05 * (ball.radius + b.radius) for b in balls):
        return False
    if outline is None:
        return True
    table = Table(outline)
    return table.contains(*ball.position) and all(
        edge.distance(*ball.position) > 1.05 * ball.radius for edge in table.edges
    )


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """Return a random scene as it stands in the data file."""
    return {
        "law": scene.physics.law,
        "max_time": scene.physics.max_time,
        "outline": scene.table.outline if scene.table else None,
        "restitution": [
            scene.restitution.ball_ball,
            scene.restitution.cue_ball,
            scene.restitution.cushion,
        ],
        "friction": [scene.friction.surface, scene.friction.cushion, scene.friction.ball_ball],
        "balls": [[*b.position, *b.velocity, b.radius, b.mass] for b in scene.balls],
        **({"rolling": scene.friction.rolling} if scene.surface.rolls else {}),
        **({"roll": [b.roll for b in scene.balls]} if scene.surface.rolls else {}),
        **({"pockets": [[*p.position, p.radius] for p in scene.pockets]} if scene.pockets else {}),
    }


def scene_from_dict(data: dict[str, Any]) -> Scene:
    """Return the scene of an entry of the data file; ball 0 is the cue ball."""
    rolls = data.get("roll", [0.0] * len(data["balls"]))
    return Scene(
        balls=tuple(
            Ball(str(i), (x, y), r, m, cue=i == 0, velocity=(vx, vy), roll=w)
            for i, ((x, y, vx, vy, r, m), w) in enumerate(zip(data["balls"], rolls, strict=True))
        ),
        table=Table(tuple((x, y) for x, y in data["outline"])) if data["outline"] else None,
        restitution=Restitution(*data["restitution"]),
        friction=replace(Friction(*data["friction"]), rolling=data.get("rolling")),
        physics=Physics(law=data["law"], max_time=data["max_time"]),
        pockets=tuple(
            Pocket(f"p{k}", (x, y), radius)
            for k, (x, y, radius) in enumerate(data.get("pockets", ()))
        ),
    )


def run_to_dict(run: ReferenceRun) -> dict[str, Any]:
    """Return the run as it stands in the data file, with 20 digits."""
    return {
        "duration": mp.nstr(run.duration, 20),
        "events": [
            [mp.nstr(t, 20), kind, balls, cushion] for t, kind, balls, cushion in run.events
        ],
        "final": [[mp.nstr(x, 20) for x in place] for place in run.final],
    }


# By what a data file is called: its scenes, and the kind of event that each run must have.
FILES: dict[str, tuple[Any, str]] = {
    "reference": (random_scene, ""),
    "pocket": (random_pocket_scene, "pocket"),
    "rolling": (random_rolling_scene, "roll"),
}
SAID = {"reference": "", "pocket": " pockets", "rolling": " rolling"}


def made(law: str, table: str, k: int, file: str = "reference") -> dict[str, Any]:
    """Make scene ``k`` of that law, table and data file, with its run.

    It is the first one from its seed that is not refused.
    """
    name = f"{law} {table} {k}{SAID[file]}"
    rng = random.Random(name)
    draw, has = FILES[file]
    while True:
        scene = draw(law, table, rng)
        try:
            run = reference_run(scene)
        except Refused:
            continue
        kinds = [kind for _, kind, _, _ in run.events]
        contacts = len(kinds) - kinds.count("stop") - kinds.count("roll")
        if 3 <= contacts <= 60 and (not has or has in kinds):
            return {"name": name, "scene": scene_to_dict(scene), "run": run_to_dict(run)}


def main() -> None:
    """Write the data files anew; it takes some minutes."""
    for file in sys.argv[1:] or FILES:
        lines = []
        for law in ("coulomb", "published"):
            for table in OUTLINES:
                for k in range(SCENES_EACH):
                    lines.append(json.dumps(made(law, table, k, file)))
                    print(file, law, table, k, flush=True)
        path = DATA / f"{file}_runs.json"
        path.write_text("[\n" + ",\n".join(lines) + "\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
