"""This is an independent exact solver in 40 digits, for tests: it is slow and plain.

It shares nothing with ``event-driven`` except the scene's numbers. Vectors are complex numbers.
Gaps are polynomials in time (degree 4 between discs, 2 to a cushion). Their roots are isolated
between the roots of their derivatives, and closed in by mpmath's findroot. The contact laws are
written anew from Eqs. 1-10 and Listing 3. Contacts are answered one at a time. So a scene is
refused if several contacts happen at one instant in it, or if balls come together at next to no
speed.

``python -m tests.oracle.reference`` makes ``tests/data/reference_runs.json``, ``pocket_runs.json``
and ``rolling_runs.json`` anew from their seeds; a name makes one of them.
"""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations, count, pairwise
from typing import Any, NamedTuple

from mpmath import mp, mpc, mpf

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Pocket,
    Post,
    Restitution,
    Scene,
    SceneError,
    State,
    Table,
)
from tests import DATA

DIGITS = 40
ROUNDING = mpf(10) ** -30  # m, m/s; 40 digits leave so much of zero
GENTLE = mpf(10) ** -6  # m/s; contacts that close more slowly are refused
APART = mpf(10) ** -8  # s; contacts of neighbours that are closer in time are refused
MOST_EVENTS = 400
FAR = mp.inf

Number = Any  # mpmath has no types
Vec = Any  # a complex number, x + iy
Poly = list[Any]  # coefficients, lowest first
# This is a kind, a ball, and the other ball, cushion or pocket (-1: stop).
Contact = tuple[str, int, int]


class Refused(Exception):
    """This error says that the scene has contacts which a reference does not decide."""


# -- polynomials and vectors -----------------------------------------------------------------------


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
    signs = [mp.sign(value(poly, t)) for t in turns]
    return [
        mp.findroot(partial(value, poly), between, solver="anderson", maxsteps=2000, verify=False)
        for between, (a, b) in zip(pairwise(turns), pairwise(signs), strict=True)
        if a * b < 0
    ]


def beyond_all_roots(poly: Poly) -> Number:
    """Return Cauchy's bound on the size of a polynomial's roots."""
    while poly and poly[-1] == 0:
        poly = poly[:-1]
    return 1 + max((abs(c / poly[-1]) for c in poly[:-1]), default=mpf(0)) if poly else mpf(1)


def dot(a: Vec, b: Vec) -> Number:
    """Return the scalar product."""
    return a.real * b.real + a.imag * b.imag


def across(a: Vec) -> Vec:
    """Return the vector turned by a quarter, counter-clockwise."""
    return mpc(-a.imag, a.real)


def vector(point: Sequence[float]) -> Vec:
    """Return the point as a vector."""
    return mpc(*point)


# -- free flight -----------------------------------------------------------------------------------


def balls_of(contact: Contact) -> tuple[int, ...]:
    """Return the numbers of the balls that meet."""
    return contact[1:] if contact[0] == "ball" else contact[1:2]


class Side(NamedTuple):
    """This is a side of the outline."""

    start: Vec
    along: Vec
    length: Number


class Curve(NamedTuple):
    """This is a round cushion: a part of a circle from ``start`` to ``end``, or all of it.

    ``bulge`` is that of an arc, and -1 for a post: balls are outside of it.
    """

    center: Vec
    radius: Number
    bulge: Number
    start: Vec = None
    end: Vec = None

    def has(self, place: Vec) -> bool:
        """Tell whether the curve lies in the direction of a place from its centre."""
        if self.start is None:
            return True
        top = -across(self.end - self.start) * mp.sign(self.bulge)  # from the chord to the arc
        return bool(abs(mp.arg((place - self.center) / top)) <= 2 * mp.atan(abs(self.bulge)))


class Flight:
    """Balls fly by Eq. 10 until they meet each other, a cushion, a corner or a pocket's rim.

    Where balls roll, ``roll`` is the velocity (m/s) at which they would; else it is the velocity.

    ``no_gap`` (m) and ``still`` (m/s) are what rounding leaves of a gap and of its closing.
    """

    def __init__(self, scene: Scene, start: State, no_gap: Number, still: Number) -> None:
        self.scene, self.no_gap, self.still = scene, no_gap, still
        self.loss = mpf(scene.friction.surface) * mpf(scene.physics.gravity)
        self.place = [vector(p) for p in start.position]
        self.velocity = [vector(v) for v in start.velocity]
        rolling = scene.friction.rolling
        self.rolls = rolling is not None
        self.drag = mpf(rolling) * mpf(scene.physics.gravity) if self.rolls else self.loss
        self.roll = [vector(w) for w in start.roll or start.velocity]
        self.radius = [mpf(ball.radius) for ball in scene.balls]
        self.mass = [mpf(ball.mass) for ball in scene.balls]
        corners = [vector(c) for c in scene.table.outline] if scene.table else []
        self.sides = [
            Side(a, (b - a) / abs(b - a), abs(b - a))
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
        ]
        self.holes = [(vector(hole.position), mpf(hole.radius)) for hole in scene.pockets]
        self.now = mpf(0)
        limit = scene.physics.max_time
        self.last = FAR if limit is None else mpf(limit)
        self.due: dict[Contact, Number] = {}
        self.everybody = range(len(self.place))
        self.contacts: list[Contact] = [("ball", i, j) for i, j in combinations(self.everybody, 2)]
        bulges = (scene.table.bulge or (0.0,) * len(corners)) if scene.table else ()
        self.curves = {k: arc(self.sides[k], mpf(b)) for k, b in enumerate(bulges) if b}
        self.curves |= {
            len(self.sides) + k: Curve(vector(post.position), mpf(post.radius), mpf(-1))
            for k, post in enumerate(scene.posts)
        }
        turns = [mp.expj(2 * mp.atan(mpf(b))) for b in bulges]  # from the chord to an end's heading
        for k, side in enumerate(self.sides):
            before = self.sides[k - 1].along * turns[k - 1]
            reflex = dot(across(before), side.along / turns[k]) < -ROUNDING
            for i in self.everybody:
                if k not in self.curves:
                    self.contacts.append(("face", i, k))
                if reflex:
                    self.contacts.append(("corner", i, k))
        self.contacts += [("curve", i, k) for i in self.everybody for k in self.curves]
        self.contacts += [("pocket", i, k) for i in self.everybody for k in range(len(self.holes))]
        self.known = {c: self._coefficients(c) for c in self.contacts}

    def _coefficients(self, contact: Contact) -> tuple[Number, Number, Number]:
        """Return restitution, friction and the effective mass of a contact."""
        given, mu = self.scene.restitution, self.scene.friction
        effective = 1 / sum(1 / self.mass[i] for i in balls_of(contact))
        if contact[0] != "ball":
            own = self.scene.posts[contact[2] - len(self.sides)] if self._is_post(contact) else None
            e = given.cushion if own is None or own.restitution is None else own.restitution
            rubs = mu.cushion if own is None or own.friction is None else own.friction
            return mpf(e or 0), mpf(rubs), effective
        has_cue = any(self.scene.balls[i].cue for i in balls_of(contact))
        e = given.cue_ball if has_cue and given.cue_ball is not None else given.ball_ball
        return mpf(e or 0), mpf(mu.ball_ball), effective

    def _is_post(self, contact: Contact) -> bool:
        return contact[0] == "curve" and contact[2] >= len(self.sides)

    def _normal(self, contact: Contact) -> Vec:
        """Return the unit vector from the ball to what it meets."""
        kind, i, j = contact
        if kind == "curve":
            out = self.place[i] - self.curves[j].center
            return mp.sign(self.curves[j].bulge) * out / abs(out)
        if kind == "face":
            return -across(self.sides[j].along)
        to = (self.place[j] if kind == "ball" else self.sides[j].start) - self.place[i]
        return to / abs(to)

    def _contact_distance(self, contact: Contact) -> Number:
        """Return how far apart centres, or a centre and what is met, are at contact."""
        if contact[0] == "pocket":
            return self.holes[contact[2]][1]
        return sum(self.radius[i] for i in balls_of(contact))

    def _cloth_slip(self, i: int) -> Vec:
        """Return the velocity less the roll, without what rounding leaves of it."""
        slip = self.velocity[i] - self.roll[i] if self.rolls else mpc(0)
        return slip if abs(slip) > self.still else mpc(0)

    def _pull(self, i: int) -> Vec:
        """Return the acceleration: against the slip where there is some, else the velocity."""
        slip, v = self._cloth_slip(i), self.velocity[i]
        if slip:
            return -self.loss / abs(slip) * slip
        return -self.drag / abs(v) * v if v else mpc(0)

    def _path(self, i: int) -> Poly:
        return [self.place[i], self.velocity[i], self._pull(i) / 2]

    def _ends_in(self, i: int) -> Number:
        """Return in how many seconds the ball rests, or rolls if it slips."""
        slip, v = self._cloth_slip(i), self.velocity[i]
        if slip:
            return 2 * abs(slip) / (7 * self.loss) if self.loss else FAR
        return abs(v) / self.drag if v and self.drag else FAR

    def _fly(self, balls: Iterable[int], dt: Number) -> None:
        """Let balls fly; a sphere that slips gains roll at 5/2 of what its velocity loses."""
        for i in balls:
            pull, slips = self._pull(i), bool(self._cloth_slip(i))
            self.place[i] = value(self._path(i), dt)
            self.velocity[i] += dt * pull
            self.roll[i] = self.roll[i] - dt * pull * 5 / 2 if slips else self.velocity[i]

    def _meeting(self, contact: Contact) -> Number | None:
        """Return in how many seconds the gap closes, None if it never does."""
        kind, i, j = contact
        balls, touching = balls_of(contact), self._contact_distance(contact)
        if not any(self.velocity[k] or self._cloth_slip(k) for k in balls):
            return None
        until = min(self.last - self.now, *(self._ends_in(k) for k in balls))
        path = self._path(i)
        if kind == "ball":
            path = [b - a for a, b in zip(path, self._path(j), strict=True)]
        else:
            path[0] -= self.holes[j][0] if kind == "pocket" else self._place_of(contact)
        if kind == "curve":
            return self._meets_curve(path, self.curves[j], self.radius[i], until)
        if kind == "face":
            return self._meets_face(path, self.sides[j], touching, until)
        x, y = [c.real for c in path], [c.imag for c in path]
        gap = [a + b for a, b in zip(product(x, x), product(y, y), strict=True)]
        gap[0] -= touching * touching
        return next(self._closings(gap, until, 2 * touching), None)

    def _place_of(self, contact: Contact) -> Vec:
        """Return the centre of a curve, or the first corner of a side."""
        kind, _, k = contact
        return self.curves[k].center if kind == "curve" else self.sides[k].start

    def _meets_curve(self, path: Poly, curve: Curve, r: Number, until: Number) -> Number | None:
        """Return when a ball meets a curve: from within its circle, or from outside."""
        facing = -mp.sign(curve.bulge)
        touching = curve.radius + facing * r
        x, y = [c.real for c in path], [c.imag for c in path]
        gap = [facing * (a + b) for a, b in zip(product(x, x), product(y, y), strict=True)]
        gap[0] -= facing * touching * touching
        is_within = facing < 0 or abs(path[0]) < curve.radius
        times = self._closings(gap, until, 2 * touching, is_within=is_within)
        return next((t for t in times if curve.has(curve.center + value(path, t))), None)

    def _meets_face(self, path: Poly, side: Side, touching: Number, until: Number) -> Number | None:
        turned = [c * side.along.conjugate() for c in path]
        foot, height = [c.real for c in turned], [c.imag for c in turned]
        if height[0] <= 0:
            return None  # The ball is behind the line of a cushion that is elsewhere.
        height[0] -= touching
        times = self._closings(height, until, 1)
        return next((t for t in times if 0 <= value(foot, t) <= side.length), None)

    def _closings(
        self, gap: Poly, until: Number, scale: Number, is_within: bool = False
    ) -> Iterator[Number]:
        """Yield the times from now at which a gap closes, whose unit is ``scale`` metres.

        One that is negative now closes now, unless a ball may be outside and come in first.
        """
        slope, slow = derivative(gap), -scale * self.still
        is_in = not is_within or gap[0] >= -scale * self.no_gap
        if gap[0] <= scale * self.no_gap and gap[1] < slow and is_in:
            yield mpf(0)
            return
        for t in real_roots(gap, mpf(0), until if until < FAR else beyond_all_roots(gap)):
            if value(slope, t) < slow:
                yield t


def arc(side: Side, bulge: Number) -> Curve:
    """Return the curve of a side, by the angle of which ``bulge`` is the tangent of a quarter."""
    half = 2 * mp.atan(abs(bulge))
    radius = side.length / (2 * mp.sin(half))
    end = side.start + side.length * side.along
    inwards = across(side.along) * mp.sign(bulge)
    center = (side.start + end) / 2 + inwards * radius * mp.cos(half)
    return Curve(center, radius, bulge, side.start, end)


# -- contacts one at a time ------------------------------------------------------------------------


@dataclass
class ReferenceRun:
    """This holds the events and the end of a run, in 40 digits.

    An event is its time, kind, balls, and the number of the cushion or pocket.
    """

    events: list[tuple[Number, str, tuple[int, ...], int | None]] = field(default_factory=list)
    final: list[tuple[Number, Number]] = field(default_factory=list)
    duration: Number = 0


class Reference(Flight):
    """This is the scene in 40 digits; ``run`` plays it."""

    def __init__(self, scene: Scene, start: State) -> None:
        super().__init__(scene, start, ROUNDING, ROUNDING)
        self.gone: set[int] = set()  # Pockets have them.
        self.out = ReferenceRun()

    def run(self) -> ReferenceRun:
        """Play until everything rests, or until the scene's ``max_time``."""
        self._foresee(set(self.everybody))
        while self.due and len(self.out.events) < MOST_EVENTS:
            key, t = min(self.due.items(), key=lambda one: one[1])
            if t > self.last:
                break
            self._refuse_what_is_near(key, t)
            self._fly(self.everybody, t - self.now)
            self.now = t
            self._foresee(self._happen(key))
        if any(self.velocity[i] or self._cloth_slip(i) for i in self.everybody):
            if self.last == FAR or len(self.out.events) >= MOST_EVENTS:
                raise Refused("too many events")
            self._fly(self.everybody, self.last - self.now)
            self.out.duration = self.last
        self.out.final = [(place.real, place.imag) for place in self.place]
        return self.out

    def _refuse_what_is_near(self, key: Contact, t: Number) -> None:
        mine = set(balls_of(key))
        for other, due in self.due.items():
            if other != key and due - t < APART and not mine.isdisjoint(balls_of(other)):
                raise Refused(f"{key} and {other} within {due - t} s")

    def _foresee(self, changed: set[int]) -> None:
        """Work out anew what may happen to the discs that changed."""
        self.due = {c: t for c, t in self.due.items() if changed.isdisjoint(balls_of(c))}
        for i in changed:
            if self._ends_in(i) < FAR:
                kind = "roll" if self._cloth_slip(i) else "stop"
                self.due[kind, i, -1] = self.now + self._ends_in(i)
        for contact in self.contacts:
            balls = balls_of(contact)
            if not changed.isdisjoint(balls) and self.gone.isdisjoint(balls):
                t = self._meeting(contact)
                if t is not None:
                    self.due[contact] = self.now + t

    def _happen(self, key: Contact) -> set[int]:
        """Let it happen, and return the discs whose motion changed."""
        kind, i, j = key
        balls = balls_of(key)
        if kind == "stop" or (kind == "roll" and abs(self.velocity[i]) < ROUNDING):
            self._stop(i)
        elif kind == "roll":
            self._refuse_gentle(abs(self.velocity[i]))  # e = 0.4, in binary, nearly stops a ball.
            self.roll[i] = self.velocity[i]
            self.out.events.append((self.now, kind, balls, None))
        elif kind == "pocket":
            self.place[i], self.velocity[i], self.roll[i] = self.holes[j][0], mpc(0), mpc(0)
            self.gone.add(i)
            self.out.events.append((self.now, kind, balls, j))
            self.out.duration = self.now
        else:
            name, number = ("ball-ball", None) if kind == "ball" else ("ball-cushion", j)
            self.out.events.append((self.now, name, balls, number))
            (self._collide if kind == "ball" else self._bounce)(key)
            for k in balls:
                if abs(self.velocity[k]) < ROUNDING and not self._cloth_slip(k):
                    self._stop(k)
        return set(balls)

    def _stop(self, i: int) -> None:
        self.velocity[i] = self.roll[i] = mpc(0)
        self.out.events.append((self.now, "stop", (i,), None))
        self.out.duration = self.now

    def _refuse_gentle(self, speed: Number) -> None:
        if speed < GENTLE:
            raise Refused(f"a contact closes, or a ball rolls, at {mp.nstr(speed, 3)} m/s")

    def _bounce(self, contact: Contact) -> None:
        """Answer by Eq. 9: v_n' = -e v_n, and the tangential speed loses mu |v_n' - v_n|.

        It does not pass zero.
        """
        i, (e, mu, _), n = contact[1], self.known[contact], self._normal(contact)
        v_n, v_t = dot(self.velocity[i], n), dot(self.velocity[i], across(n))
        self._refuse_gentle(v_n)
        new_n = -e * v_n
        new_t = mp.sign(v_t) * max(mpf(0), abs(v_t) - mu * abs(new_n - v_n))
        self.velocity[i] = new_n * n + new_t * across(n)
        w_n, w_t = dot(self.roll[i], n), dot(self.roll[i], across(n))
        w_n = mp.sign(w_n) * max(mpf(0), abs(w_n) - mu * abs(new_n - v_n) * 5 / 2)
        self.roll[i] = w_n * n + w_t * across(n)

    def _collide(self, contact: Contact) -> None:
        """Answer by Eqs. 1-7: momentum and restitution along n, and the law's friction along t."""
        (_, i, j), (e, mu, effective), n = contact, self.known[contact], self._normal(contact)
        m_a, m_b, t = self.mass[i], self.mass[j], across(n)
        a_n, b_n, a_t, b_t = (dot(self.velocity[k], w) for w in (n, t) for k in (i, j))
        self._refuse_gentle(a_n - b_n)
        common = (m_a * a_n + m_b * b_n) / (m_a + m_b)
        new_a_n = common - e * m_b * (a_n - b_n) / (m_a + m_b)
        new_b_n = new_a_n + e * (a_n - b_n)
        slip = a_t - b_t
        if self.scene.physics.law == "coulomb":
            j_t = mp.sign(slip) * min(mu * m_a * (a_n - new_a_n), effective * abs(slip))
            new_a_t, new_b_t = a_t - j_t / m_a, b_t + j_t / m_b
        else:
            rubs = abs(slip) >= mpf("1e-9") * (a_n - b_n)
            drag = mu * mp.sign(slip) if rubs else mpf(0)
            new_a_t = _clamped(a_t, a_t - drag * (a_n - new_a_n))
            new_b_t = _clamped(b_t, b_t + drag * (b_n - new_b_n))
        self.velocity[i] = new_a_n * n + new_a_t * t
        self.velocity[j] = new_b_n * n + new_b_t * t


def _clamped(before: Number, after: Number) -> Number:
    """Return 0 if a tangential velocity was not 0 and changed sign, as Listing 3 clamps it."""
    return mpf(0) if before != 0 and mp.sign(after) != mp.sign(before) else after


def reference_run(scene: Scene, start: State | None = None) -> ReferenceRun:
    """Play the scene as its velocities have it (or from ``start``), in 40 digits."""
    with mp.workdps(DIGITS):
        return Reference(scene, start or scene.start(None)).run()


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


def random_round_scene(law: str, table: str, rng: random.Random) -> Scene:
    """Return a random scene with posts, some of whose cushions are arcs; some of them roll."""
    make = random_rolling_scene if rng.random() < 0.4 else random_scene
    while True:
        scene = make(law, table, rng)
        outline = OUTLINES[table] or ()
        bulge = tuple(rng.choice([0.0, round(rng.uniform(-0.25, 0.9), 3)]) for _ in outline)
        posts = []
        for _ in range(rng.randint(0 if any(bulge) else 1, 3)):
            place = round(rng.uniform(-1.0, 2.0), 4), round(rng.uniform(-1.0, 1.7), 4)
            own = [rng.choice([None, round(rng.uniform(0.3, 1.0), 2)]) for _ in "ef"]
            posts.append(Post(place, rng.choice([0.0, round(rng.uniform(0.01, 0.2), 4)]), *own))
        try:
            ground = Table(outline, bulge) if outline else None
            return replace(scene, table=ground, posts=tuple(posts))
        except SceneError:
            continue  # An outline crosses itself, or something lies in something.


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


# By what a data file is called: its scenes, the kind of event that each run must have, and what
# the names of its scenes end with.
FILES: dict[str, tuple[Any, str, str]] = {
    "reference": (random_scene, "", ""),
    "pocket": (random_pocket_scene, "pocket", " pockets"),
    "rolling": (random_rolling_scene, "roll", " rolling"),
}


def made(law: str, table: str, k: int, file: str = "reference") -> dict[str, Any]:
    """Make scene ``k`` of that law, table and data file, with its run.

    It is the first one from its seed that is not refused.
    """
    draw, has, ending = FILES[file]
    name = f"{law} {table} {k}{ending}"
    rng = random.Random(name)
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


def fresh_scenes(file: str, first: int) -> Iterator[tuple[Scene, dict[str, Any]]]:
    """Yield new random scenes of a data file's kind with their runs, from the seed ``first`` on."""
    draw, has, _ = FILES[file]
    for k in count(first):
        rng = random.Random(f"{file} {k}")
        table = rng.choice(sorted(OUTLINES))
        scene = draw(rng.choice(("coulomb", "published")), table, rng)
        try:
            run = run_to_dict(reference_run(scene))
        except Refused:
            continue
        if any(kind == has for _, kind, *_ in run["events"]):
            yield scene, run


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
