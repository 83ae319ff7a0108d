"""This is an independent reference for hard contacts, in many digits, for tests.

It shares nothing with the solvers except the scene's numbers, and knows the law "coulomb" only.
Three ways of moving on take turns:

- In free flight gaps are polynomials in time, and their first roots are found in 90 digits.
- Where hits come within 1e-28 s of each other, they are played one at a time in the gaps
  themselves, which keep their digits however small they get. Normals stand still meanwhile.
  A long series between two contacts goes on by powers of the linear map of two hits, as long as
  no hit slides where it stuck, or the other way.
- Where surface friction presses touching balls together, contact forces N >= 0 keep the gap closed.
  The motion is integrated by extrapolation of the midpoint rule, with steps of any order needed.

A scene is refused if two closing contacts that share a ball coincide.

``python -m tests.hard_reference`` makes ``tests/data/hard_runs.json`` anew from its seeds.
"""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, localcontext
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, SceneError, Table

sys.path.insert(0, str(Path(__file__).parent))  # for python -m tests.hard_reference
from reference import scene_to_dict

DATA = Path(__file__).parent / "data"

Vec = tuple[Decimal, Decimal]
Poly = list[Decimal]  # coefficients, lowest first
Contact = tuple[str, int, int]  # kind ("ball", "face", "corner"), ball, the other ball or cushion
Matrix = list[list[Decimal]]
Force = tuple[Contact, Vec, Vec, bool]  # contact, direction, direction of its measure, normal?

ZERO, ONE = Decimal(0), Decimal(1)
FAR = Decimal("Infinity")
MOST_STEPS = 500


class Refused(Exception):
    """This error says that the scene has contacts which this reference does not decide."""


@dataclass(frozen=True)
class Settings:
    """These are the bounds of the arithmetic; a second set shows what they cost."""

    digits: int = 90
    still: Decimal = Decimal("1e-22")  # m/s; slower closing is none
    closed: Decimal = Decimal("1e-20")  # m/s; slower opening is none where friction presses
    at_once: Decimal = Decimal("1e-28")  # s; hits this near come in the gaps themselves
    near: Decimal = Decimal("1e-21")  # m; gaps of contacts that may be among them
    no_gap: Decimal = Decimal("1e-40")  # m; gaps below are rounding
    step_error: Decimal = Decimal("1e-23")  # m, m/s; of one step under contact forces
    shortcut: bool = True  # go on by powers of the map of two hits
    kick: Decimal = ZERO  # m/s; balls part at least so fast: tiny hits instead of contact forces
    most_hits: int = 10_000  # played one at a time


FINE = Settings()
COARSE = Settings(
    digits=70,
    still=Decimal("1e-19"),
    closed=Decimal("1e-17"),
    at_once=Decimal("1e-25"),
    near=Decimal("1e-18"),
    step_error=Decimal("1e-20"),
)


# -- vectors and polynomials -----------------------------------------------------------------------


def minus(a: Vec, b: Vec) -> Vec:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1])


def dot(a: Vec, b: Vec) -> Decimal:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1]


def plus(a: Vec, k: Decimal, b: Vec) -> Vec:
    """Return a + k b."""
    return (a[0] + k * b[0], a[1] + k * b[1])


def size(a: Vec) -> Decimal:
    """Return the length."""
    return (a[0] * a[0] + a[1] * a[1]).sqrt()


def across(a: Vec) -> Vec:
    """Return the vector turned by a quarter, counter-clockwise."""
    return (-a[1], a[0])


def value(poly: Poly, t: Decimal) -> Decimal:
    """Return the polynomial at ``t``."""
    total = ZERO
    for c in reversed(poly):
        total = total * t + c
    return total


def slope_of(poly: Poly) -> Poly:
    """Return the derivative."""
    return [k * c for k, c in enumerate(poly)][1:]


def square_sum(x: Poly, y: Poly) -> Poly:
    """Return x^2 + y^2 of two quadratics."""
    out = [ZERO] * 5
    for p in (x, y):
        for i, a in enumerate(p):
            for j, b in enumerate(p):
                out[i + j] += a * b
    return out


def roots(poly: Poly, low: Decimal, high: Decimal, fine: Decimal) -> list[Decimal]:
    """Return where the polynomial changes sign in (low, high), in order."""
    while poly and poly[-1] == 0:
        poly = poly[:-1]
    if len(poly) < 2:
        return []
    if len(poly) == 2:
        t = -poly[0] / poly[1]
        return [t] if low < t < high else []
    turns = [low, *roots(slope_of(poly), low, high, fine), high]
    heights = [value(poly, t) for t in turns]
    return [
        root_between(poly, a, b, fine)
        for (a, p), (b, q) in pairwise(zip(turns, heights, strict=True))
        if p * q < 0
    ]


def root_between(poly: Poly, low: Decimal, high: Decimal, fine: Decimal) -> Decimal:
    """Find the root between two signs by Newton's steps, and by halving where they leave."""
    slope = slope_of(poly)
    rises = value(poly, high) > 0
    t = low
    for _ in range(2000):
        height, steepness = value(poly, t), value(slope, t)
        if height == 0:
            return t
        if (height > 0) == rises:
            high = t
        else:
            low = t
        new = t - height / steepness if steepness != 0 else FAR
        if abs(new - t) <= fine or high - low <= fine:
            return min(max(new, low), high)
        t = new if low < new < high else (low + high) / 2
    raise ArithmeticError("no root where the sign changes")


# -- linear algebra --------------------------------------------------------------------------------


def solved(rows: Matrix, right: list[Decimal]) -> list[Decimal]:
    """Solve a small linear system by elimination with pivots."""
    n = len(right)
    a = [[*row, b] for row, b in zip(rows, right, strict=True)]
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(a[i][k]))
        if abs(a[best][k]) < Decimal("1e-30"):
            raise Refused("contact forces are not determined")
        a[k], a[best] = a[best], a[k]
        for i in range(k + 1, n):
            factor = a[i][k] / a[k][k]
            if factor:
                a[i] = [x - factor * y for x, y in zip(a[i], a[k], strict=True)]
    out = [ZERO] * n
    for k in reversed(range(n)):
        out[k] = (a[k][n] - sum((a[k][j] * out[j] for j in range(k + 1, n)), ZERO)) / a[k][k]
    return out


def times(a: Matrix, b: Matrix) -> Matrix:
    """Return the product of two square matrices."""
    columns = list(zip(*b, strict=True))
    return [
        [sum((x * y for x, y in zip(row, column, strict=True)), ZERO) for column in columns]
        for row in a
    ]


def applied(a: Matrix, v: list[Decimal]) -> list[Decimal]:
    """Return the matrix times the vector."""
    return [sum((x * y for x, y in zip(row, v, strict=True)), ZERO) for row in a]


# -- the balls and what they meet ------------------------------------------------------------------


@dataclass
class Disc:
    """This is a disc of the scene, at the present time."""

    place: Vec
    velocity: Vec
    radius: Decimal
    mass: Decimal
    cue: bool

    @property
    def moves(self) -> bool:
        """Tell whether the disc moves."""
        return self.velocity != (ZERO, ZERO)


@dataclass
class Press:
    """This is a contact that forces keep closed, with the way its friction goes.

    ``slides`` is the sign of the slip, or 0 where the contact sticks or has no friction.
    """

    contact: Contact
    slides: int
    sticks: bool
    mu: Decimal


@dataclass
class HardRun:
    """This holds the end of a run, how many hits there were, and how they came."""

    final: list[Vec] = field(default_factory=list)
    velocity: list[Vec] = field(default_factory=list)
    duration: Decimal = ZERO
    hits: int = 0
    most_at_once: int = 0
    pressed: Decimal = ZERO  # s; so long did forces keep contacts closed
    struck_while_pressed: int = 0
    events: list[tuple[Decimal, str, Contact]] = field(default_factory=list)


class HardReference:
    """This is the scene in many digits; ``run`` plays it."""

    def __init__(
        self, scene: Scene, settings: Settings = FINE, nudges: Sequence[Vec] | None = None
    ) -> None:
        if scene.physics.law != "coulomb":
            raise Refused("the law is not coulomb")
        self.scene, self.set = scene, settings
        self.fine = Decimal(10) ** (5 - settings.digits)
        self.loss = Decimal(scene.friction.surface) * Decimal(scene.physics.gravity)
        start = scene.start(None)
        self.discs = [
            Disc(_vec(p), _vec(v), Decimal(ball.radius), Decimal(ball.mass), ball.cue)
            for ball, p, v in zip(scene.balls, start.position, start.velocity, strict=True)
        ]
        for disc, nudge in zip(self.discs, nudges or (), strict=False):
            disc.place = plus(disc.place, ONE, nudge)
        outline = [_vec(c) for c in scene.table.outline] if scene.table else []
        self.sides: list[tuple[Vec, Vec, Decimal]] = []  # start, tangent, length
        for a, b in zip(outline, outline[1:] + outline[:1], strict=True):
            along = minus(b, a)
            self.sides.append((a, (along[0] / size(along), along[1] / size(along)), size(along)))
        self.now = ZERO
        limit = scene.physics.max_time
        self.last = FAR if limit is None else Decimal(limit)
        self.due: dict[Contact, Decimal] = {}
        self.stops: dict[int, Decimal] = {}
        self.out = HardRun()
        self.known: dict[Contact, tuple[Decimal, ...]] = {}
        self.shut: set[Contact] = set()  # a series of hits has closed them: they have no gap
        self.steps = 0  # under contact forces
        self.played = 0  # hits one at a time
        count = len(self.discs)
        self.contacts: list[Contact] = [
            ("ball", i, j) for i in range(count) for j in range(i + 1, count)
        ]
        for k, (_, along, _) in enumerate(self.sides):
            reflex = dot(across(self.sides[k - 1][1]), along) < 0
            for i in range(count):
                self.contacts += [("face", i, k)] + ([("corner", i, k)] if reflex else [])

    def run(self) -> HardRun:
        """Play until everything rests, or until the scene's ``max_time``."""
        self._at_once(range(len(self.discs)))
        pressed = self._pressed()
        self._foresee(set(range(len(self.discs))))
        while True:
            if pressed:
                changed = self._go_pressed(pressed)
                pressed = self._pressed()
                self._foresee(changed)
            elif not self._go_free():
                break
            else:
                pressed = self._pressed()
            if self.now >= self.last:
                break
        self.out.final = [disc.place for disc in self.discs]
        self.out.velocity = [disc.velocity for disc in self.discs]
        return self.out

    # -- geometry ----------------------------------------------------------------------------------

    def _normal(self, contact: Contact) -> Vec:
        """Return the unit vector from the ball to what it meets."""
        kind, i, j = contact
        if kind == "face":
            along = self.sides[j][1]
            return (along[1], -along[0])
        to = minus(self.discs[j].place if kind == "ball" else self.sides[j][0], self.discs[i].place)
        far = size(to)
        return (to[0] / far, to[1] / far)

    def _gap(self, contact: Contact) -> Decimal:
        kind, i, j = contact
        disc = self.discs[i]
        if kind == "ball":
            other = self.discs[j]
            return size(minus(other.place, disc.place)) - disc.radius - other.radius
        start, along, length = self.sides[j]
        to = minus(disc.place, start)
        if kind == "corner":
            return size(to) - disc.radius
        if not 0 <= dot(to, along) <= length:
            return FAR
        height = dot(to, across(along)) - disc.radius
        return height if height > -disc.radius else FAR  # behind the cushion's line

    def _rest_velocity(self, contact: Contact) -> Vec:
        """Return the velocity of the ball relative to what it meets."""
        kind, i, j = contact
        v = self.discs[i].velocity
        return minus(v, self.discs[j].velocity) if kind == "ball" else v

    def _closing(self, contact: Contact) -> Decimal:
        return dot(self._rest_velocity(contact), self._normal(contact))

    def _touches(self, contact: Contact) -> bool:
        """Tell whether the gap is next to nothing; in floats first, which is far quicker."""
        kind, i, j = contact
        if kind == "ball":
            a, b = self.discs[i], self.discs[j]
            x, y = float(b.place[0] - a.place[0]), float(b.place[1] - a.place[1])
            if math.hypot(x, y) > float(a.radius + b.radius) + 1e-9:
                return False
        return self._gap(contact) <= self.set.near

    # -- free flight -------------------------------------------------------------------------------

    def _drag(self, disc: Disc) -> Vec:
        if not disc.moves:
            return (ZERO, ZERO)
        k = -self.loss / size(disc.velocity)
        return (k * disc.velocity[0], k * disc.velocity[1])

    def _path(self, disc: Disc) -> tuple[Poly, Poly]:
        (x, y), (u, v), (a, b) = disc.place, disc.velocity, self._drag(disc)
        return [x, u, a / 2], [y, v, b / 2]

    def _stops_in(self, disc: Disc) -> Decimal:
        return size(disc.velocity) / self.loss if disc.moves and self.loss else FAR

    def _fly(self, discs: Iterable[Disc], dt: Decimal) -> None:
        for disc in discs:
            if disc.moves:
                x, y = self._path(disc)
                k = 1 - self.loss * dt / size(disc.velocity)
                disc.place = (value(x, dt), value(y, dt))
                disc.velocity = (disc.velocity[0] * k, disc.velocity[1] * k)

    def _foresee(self, changed: set[int]) -> None:
        """Work out anew when the balls that changed stop, and what they meet."""
        for i in changed:
            self.stops.pop(i, None)
            if self.discs[i].moves and self.loss:
                self.stops[i] = self.now + self._stops_in(self.discs[i])
        for contact in self.contacts:
            if not changed.isdisjoint(_balls(contact)):
                t = self._meeting(contact)
                if t is None:
                    self.due.pop(contact, None)
                else:
                    self.due[contact] = self.now + t

    def _meeting(self, contact: Contact) -> Decimal | None:
        """Return in how many seconds the gap closes, None if it never does."""
        kind, i, j = contact
        a = self.discs[i]
        if kind == "ball":
            b = self.discs[j]
            if not (a.moves or b.moves):
                return None
            until = min(self._stops_in(a), self._stops_in(b))
            reach = a.radius + b.radius
            (ax, ay), (bx, by) = self._path(a), self._path(b)
            x, y = ([q - p for p, q in zip(s, t, strict=True)] for s, t in ((ax, bx), (ay, by)))
        else:
            if not a.moves:
                return None
            until, reach = self._stops_in(a), a.radius
            x, y = self._path(a)
            x[0] -= self.sides[j][0][0]
            y[0] -= self.sides[j][0][1]
        until = min(until, self.last - self.now)
        if kind == "face":
            return self._meets_face(x, y, j, reach, until)
        gap = square_sum(x, y)
        gap[0] -= reach * reach
        if gap[0] <= 2 * reach * self.set.no_gap and gap[1] < -2 * reach * self.set.still:
            return ZERO
        slope = slope_of(gap)
        for t in self._entries(gap, until):
            if value(slope, t) < -2 * reach * self.set.still:
                return t
        return None

    def _meets_face(
        self, x: Poly, y: Poly, k: int, reach: Decimal, until: Decimal
    ) -> Decimal | None:
        _, (tx, ty), length = self.sides[k]
        height = [-ty * p + tx * q for p, q in zip(x, y, strict=True)]
        if height[0] <= 0:
            return None  # The ball is behind the line of a cushion that is elsewhere.
        height[0] -= reach
        at_once = [ZERO] if height[0] <= self.set.no_gap and height[1] < 0 else []
        slope = slope_of(height)
        for t in at_once or self._entries(height, until):
            foot = value(x, t) * tx + value(y, t) * ty
            if 0 <= foot <= length and value(slope, t) < -self.set.still:
                return t
        return None

    def _entries(self, gap: Poly, until: Decimal) -> Iterator[Decimal]:
        if until == FAR:
            while gap and gap[-1] == 0:
                gap = gap[:-1]
            if len(gap) < 2:
                return
            until = 1 + max(abs(c / gap[-1]) for c in gap[:-1])
        slope = slope_of(gap)
        for t in roots(gap, ZERO, until, self.fine):
            if value(slope, t) < 0:
                yield t

    def _go_free(self) -> bool:
        """Go on to the next event; return False where there is none any more."""
        stop = min(self.stops, key=lambda i: self.stops[i], default=None)
        hit = min(self.due, key=lambda c: self.due[c], default=None)
        t_stop = self.stops[stop] if stop is not None else FAR
        t_hit = self.due[hit] if hit is not None else FAR
        t = min(t_stop, t_hit, self.last)
        if t == FAR:
            if any(disc.moves for disc in self.discs):
                raise Refused("the scene never ends")
            return False
        if not any(disc.moves for disc in self.discs):
            return False
        self._fly(self.discs, t - self.now)
        self.now = self.out.duration = t
        if t == t_hit and hit is not None:
            self.out.events.append((t, "hit", hit))
            self._foresee(self._at_once(_balls(hit), hit) | set(_balls(hit)))
        elif t == t_stop and stop is not None:
            self.discs[stop].velocity = (ZERO, ZERO)
            self._foresee({stop})
        return True

    # -- hits --------------------------------------------------------------------------------------

    def _coefficients(self, contact: Contact) -> tuple[Decimal, Decimal]:
        """Return restitution and friction of the contact."""
        kind, i, j = contact
        given, mu = self.scene.restitution, self.scene.friction
        if kind != "ball":
            return Decimal(given.cushion or 0), Decimal(mu.cushion)
        e = given.ball_ball
        if (self.discs[i].cue or self.discs[j].cue) and given.cue_ball is not None:
            e = given.cue_ball
        return Decimal(e or 0), Decimal(mu.ball_ball)

    def _numbers(self, contact: Contact) -> tuple[Decimal, ...]:
        """Return restitution, friction, both inverse masses and the effective mass."""
        if contact not in self.known:
            kind, i, j = contact
            a = 1 / self.discs[i].mass
            b = 1 / self.discs[j].mass if kind == "ball" else ZERO
            self.known[contact] = (*self._coefficients(contact), a, b, 1 / (a + b))
        return self.known[contact]

    def _struck(
        self, contact: Contact, n: Vec, va: Vec, vb: Vec, regime: int | None = None
    ) -> tuple[Vec, Vec, int]:
        """Return the velocities after a hit, and how it went: 0 stuck, or the sign of the slip.

        With ``regime`` given, the hit goes that way whatever the slip is: it is then linear.
        """
        e, mu, inverse_a, inverse_b, effective = self._numbers(contact)
        t = across(n)
        apart = minus(va, vb)
        closing = dot(apart, n)
        away = e * closing if regime is not None else max(e * closing, self.set.kick)
        push = effective * (closing + away)
        slip = dot(apart, t)
        if regime is None:
            sticks = mu * push >= effective * abs(slip)
            regime = 0 if sticks else (1 if slip > 0 else -1)
        rub = effective * slip if regime == 0 and mu else mu * push * regime
        va = plus(plus(va, -push * inverse_a, n), -rub * inverse_a, t)
        vb = plus(plus(vb, push * inverse_b, n), rub * inverse_b, t)
        return va, vb, regime

    def _hit(self, contact: Contact, n: Vec) -> None:
        kind, i, j = contact
        b = self.discs[j].velocity if kind == "ball" else (ZERO, ZERO)
        va, vb, _ = self._struck(contact, n, self.discs[i].velocity, b)
        self.discs[i].velocity = va
        if kind == "ball":
            self.discs[j].velocity = vb

    def _at_once(self, seeds: Iterable[int], met_now: Contact | None = None) -> set[int]:
        """Play the hits of this instant among all that touches, and return whose motion changed.

        The gap of ``met_now`` is none, though rounding may have left a little of it.
        """
        cluster = self._touching(set(seeds), met_now)
        normals = {c: self._normal(c) for c in cluster}
        gaps = self._gaps_of(cluster, met_now)
        changed: set[int] = set()
        latest: list[tuple[Contact, ...]] = []
        hits = 0
        while True:
            speeds = {c: dot(self._rest_velocity(c), n) for c, n in normals.items()}
            waits = {c: gaps[c] / s for c, s in speeds.items() if s > self.set.still}
            dt = min(waits.values(), default=FAR)
            if dt > 100 * self.set.at_once:
                break
            now = [c for c, wait in waits.items() if wait - dt <= dt * self.set.no_gap]
            met = [i for c in now for i in _balls(c)]
            if len(met) > len(set(met)):
                raise Refused(f"{now} at one instant")
            for c in cluster:
                gaps[c] = max(ZERO, gaps[c] - speeds[c] * dt)
            for c in now:
                self._hit(c, normals[c])
                gaps[c] = ZERO
                changed.update(_balls(c))
            hits += len(now)
            self.played += len(now)
            if self.played > self.set.most_hits:
                raise Refused("too many hits")
            latest.append(tuple(now))
            if len(latest) == 40 and self.set.shortcut:
                if len(set(latest)) == 2 or not any(gaps.values()):
                    hits += self._shortcut(latest, normals)
                    gaps.update({c: ZERO for batch in latest for c in batch})
                latest = []
        self._settle(changed, normals)
        self.out.hits += hits
        self.out.most_at_once = max(self.out.most_at_once, hits)
        return changed

    def _gaps_of(
        self, cluster: Iterable[Contact], met_now: Contact | None
    ) -> dict[Contact, Decimal]:
        """Return the gaps, and 0 where rounding alone or the bounds of a series left some."""
        gaps = {c: self._gap(c) for c in cluster}
        for c, gap in gaps.items():
            if gap <= self.set.no_gap or c in self.shut or c == met_now:
                gaps[c] = ZERO
        return gaps

    def _settle(self, changed: Iterable[int], normals: dict[Contact, Vec]) -> None:
        """Let balls rest that hardly move, and note which contacts a series of hits has closed."""
        for i in changed:
            if size(self.discs[i].velocity) < self.set.closed:
                self.discs[i].velocity = (ZERO, ZERO)
        for c, n in normals.items():
            if abs(dot(self._rest_velocity(c), n)) <= self.set.closed:
                self.shut.add(c)
            else:
                self.shut.discard(c)

    def _touching(self, balls: set[int], met_now: Contact | None) -> list[Contact]:
        """Return the contacts without gap that hang together with these balls."""
        closed = [c for c in self.contacts if c == met_now or self._touches(c)]
        while True:
            more = {i for c in closed if not balls.isdisjoint(_balls(c)) for i in _balls(c)}
            if more <= balls:
                return [c for c in closed if not balls.isdisjoint(_balls(c))]
            balls = balls | more

    # -- a long series of hits that repeats itself -------------------------------------------------

    def _shortcut(self, latest: Sequence[tuple[Contact, ...]], normals: dict[Contact, Vec]) -> int:
        """Go on by powers of the map of one period; return how many hits that were.

        Two contacts take turns whatever their gaps are. More contacts have no gaps here.
        """
        periods = [
            p for p in (2, 4, 6, 8, 10) if all(latest[-k] == latest[-k - p] for k in range(1, 21))
        ]
        if not periods:
            return 0
        pattern = latest[-periods[0] :]
        balls = sorted({i for c in normals for i in _balls(c)})
        v = [x for i in balls for x in self.discs[i].velocity]
        total = 0
        while True:
            way = self._way(pattern, normals, balls, v)
            if way is None:
                break
            power = self._period(pattern, normals, balls, way)
            leap, gained = sum(len(batch) for batch in pattern), 0
            while True:
                ahead = applied(power, v)
                if self._way(pattern, normals, balls, ahead) != way:
                    break
                best, gained = ahead, leap
                power, leap = times(power, power), 2 * leap
            if not gained:
                break
            v, total = best, total + gained
        for k, i in enumerate(balls):
            self.discs[i].velocity = (v[2 * k], v[2 * k + 1])
        return total

    def _of(self, contact: Contact, balls: list[int], v: list[Decimal]) -> tuple[Vec, Vec]:
        """Return the velocities of both sides of a contact out of a vector."""

        def one(i: int) -> Vec:
            if i not in balls:
                return self.discs[i].velocity
            k = balls.index(i)
            return (v[2 * k], v[2 * k + 1])

        kind, i, j = contact
        return one(i), one(j) if kind == "ball" else (ZERO, ZERO)

    def _with(
        self,
        contact: Contact,
        n: Vec,
        balls: list[int],
        v: list[Decimal],
        regime: int | None = None,
    ) -> tuple[list[Decimal], int]:
        """Return the vector of velocities after a hit, and how the hit went."""
        va, vb, regime = self._struck(contact, n, *self._of(contact, balls, v), regime)
        out = list(v)
        k = balls.index(contact[1])
        out[2 * k : 2 * k + 2] = va
        if contact[0] == "ball":
            k = balls.index(contact[2])
            out[2 * k : 2 * k + 2] = vb
        return out, regime

    def _way(
        self,
        pattern: Sequence[tuple[Contact, ...]],
        normals: dict[Contact, Vec],
        balls: list[int],
        v: list[Decimal],
    ) -> list[int] | None:
        """Tell how each hit of the period goes, None if not exactly these hits come."""
        ways: list[int] = []
        for batch in pattern:
            closing = set()
            for c, n in normals.items():
                a, b = self._of(c, balls, v)
                if dot(minus(a, b), n) > self.set.still:
                    closing.add(c)
            if closing != set(batch):
                return None
            for c in batch:
                v, way = self._with(c, normals[c], balls, v)
                ways.append(way)
        return ways

    def _period(
        self,
        pattern: Sequence[tuple[Contact, ...]],
        normals: dict[Contact, Vec],
        balls: list[int],
        way: list[int],
    ) -> Matrix:
        """Return the linear map of the hits of one period, each going its way."""
        columns = []
        for k in range(2 * len(balls)):
            v = [ONE if i == k else ZERO for i in range(2 * len(balls))]
            for c, one in zip((c for batch in pattern for c in batch), way, strict=True):
                v, _ = self._with(c, normals[c], balls, v, one)
            columns.append(v)
        return [list(row) for row in zip(*columns, strict=True)]

    # -- contacts that forces keep closed ----------------------------------------------------------

    def _pressed(self) -> list[Press]:
        """Return the contacts that surface friction presses together now."""
        if not self.loss or not any(disc.moves for disc in self.discs):
            return []
        touching = [
            c
            for c in self.contacts
            if any(self.discs[i].moves for i in _balls(c))
            and self._touches(c)
            and abs(self._closing(c)) <= self.set.closed
        ]
        presses = [self._as_press(c) for c in touching]
        while presses:
            presses, forces, _ = self._stuck_or_not(presses)
            weakest = min(range(len(presses)), key=lambda k: forces[k])
            if forces[weakest] > Decimal("1e-22"):
                break
            del presses[weakest]
        if presses:
            acceleration, _, _ = self._forces(presses)
            kept = {p.contact for p in presses}
            for c in touching:
                if c not in kept and self._opening(c, acceleration) < -Decimal("1e-15"):
                    raise Refused("contact forces have no one way")
            self._refuse_pushed_off(presses)
        return presses

    def _as_press(self, contact: Contact) -> Press:
        slip = dot(self._rest_velocity(contact), across(self._normal(contact)))
        _, mu = self._coefficients(contact)
        rubs = mu > 0 and abs(slip) > 10 * self.set.closed
        return Press(contact, (1 if slip > 0 else -1) if rubs else 0, mu > 0 and not rubs, mu)

    def _stuck_or_not(
        self, presses: list[Press]
    ) -> tuple[list[Press], list[Decimal], list[Decimal]]:
        """Let contacts slide that would need more friction than there is."""
        for _ in range(2 * len(presses) + 1):
            _, forces, rubs = self._forces(presses)
            loose = [
                k for k, p in enumerate(presses) if p.sticks and abs(rubs[k]) > p.mu * forces[k] > 0
            ]
            if not loose:
                return presses, forces, rubs
            presses = list(presses)
            k = loose[0]
            presses[k] = Press(presses[k].contact, 1 if rubs[k] > 0 else -1, False, presses[k].mu)
        raise Refused("contact friction has no one way")

    def _opening(self, contact: Contact, acceleration: list[Vec]) -> Decimal:
        """Return the second derivative of the gap."""
        kind, i, j = contact
        n = self._normal(contact)
        other = acceleration[j] if kind == "ball" else (ZERO, ZERO)
        return dot(minus(other, acceleration[i]), n) + self._curving(contact, n)

    def _curving(self, contact: Contact, n: Vec) -> Decimal:
        """Return how fast the gap's rate grows because the normal turns."""
        kind, i, j = contact
        if kind == "face":
            return ZERO
        reach = self.discs[i].radius + (self.discs[j].radius if kind == "ball" else ZERO)
        return dot(self._rest_velocity(contact), across(n)) ** 2 / reach

    def _forces(self, presses: list[Press]) -> tuple[list[Vec], list[Decimal], list[Decimal]]:
        """Return all accelerations, and each contact's normal and tangential force.

        A force pushes the first ball of its contact along -direction, and the second one along it.
        """
        acceleration = [self._drag(disc) for disc in self.discs]
        unknown: list[Force] = []
        normals = [self._normal(p.contact) for p in presses]
        for p, n in zip(presses, normals, strict=True):
            unknown.append((p.contact, plus(n, p.slides * p.mu, across(n)), n, True))
        for p, n in zip(presses, normals, strict=True):
            if p.sticks:
                unknown.append((p.contact, across(n), across(n), False))
        rows = [[self._gain(one, other) for other in unknown] for one in unknown]
        right = []
        for contact, _, along, is_normal in unknown:
            apart = sum((s * dot(acceleration[i], along) for i, s in _sides(contact)), ZERO)
            right.append(-apart - (self._curving(contact, along) if is_normal else ZERO))
        found = solved(rows, right)
        for (contact, direction, _, _), force in zip(unknown, found, strict=True):
            for i, side in _sides(contact):
                if self.discs[i].moves:
                    k = side * force / self.discs[i].mass
                    acceleration[i] = plus(acceleration[i], k, direction)
        sticking = iter(found[len(presses) :])
        rubs = [
            next(sticking) if p.sticks else p.slides * p.mu * f
            for p, f in zip(presses, found, strict=False)
        ]
        return acceleration, found[: len(presses)], rubs

    def _gain(self, measured: Force, force: Force) -> Decimal:
        """Return how much a unit of the force speeds up what is measured."""
        gain = ZERO
        for i, side in _sides(measured[0]):
            for j, push in _sides(force[0]):
                if i == j and self.discs[i].moves:
                    gain += side * push * dot(force[1], measured[2]) / self.discs[i].mass
        return gain

    def _refuse_pushed_off(self, presses: list[Press]) -> None:
        """Refuse where contact forces push a resting ball harder than surface friction holds it."""
        _, forces, rubs = self._forces(presses)
        for i, disc in enumerate(self.discs):
            push: Vec = (ZERO, ZERO)
            for p, force, rub in zip(presses, forces, rubs, strict=True):
                n = self._normal(p.contact)
                for j, side in _sides(p.contact):
                    if i == j:
                        push = plus(plus(push, side * force, n), side * rub, across(n))
            if not disc.moves and size(push) > disc.mass * self.loss * (1 + Decimal("1e-15")):
                raise Refused("a resting ball is pushed off")

    def _go_pressed(self, presses: list[Press]) -> set[int]:
        """Go on under contact forces until one ends, a ball stops, or a new hit comes.

        Return the balls whose motion changed.
        """
        group = sorted({i for p in presses for i in _balls(p.contact) if self.discs[i].moves})
        held = {p.contact for p in presses}
        free = [disc for i, disc in enumerate(self.discs) if i not in group]
        watched = [
            c
            for c in self.contacts
            if c not in held and any(self.discs[i].moves for i in _balls(c))
        ]
        everything = set(range(len(self.discs)))
        step = Decimal("0.05")
        while self.steps < MOST_STEPS:
            self.steps += 1
            slowest = min(group, key=lambda i: size(self.discs[i].velocity))
            if size(self.discs[slowest].velocity) <= self.set.closed * 10:
                self.discs[slowest].velocity = (ZERO, ZERO)
                self.out.duration = self.now
                return everything
            before = self._saved()
            room = size(self.discs[slowest].velocity) / self.loss * Decimal("0.4")
            stop = min((self._stops_in(disc) for disc in free), default=FAR)
            step = min(step, room, stop, self.last - self.now)
            step, grown = self._stepped(presses, group, free, step, before)
            after = self._saved()
            event = self._first_event(presses, group, free, watched, before, after, step)
            self.out.pressed += step if event is None else event[0]
            if event is not None:
                self.now += event[0]
                self.out.duration = self.now
                if event[1] is not None:
                    self.out.events.append((self.now, "hit", event[1]))
                    self.out.struck_while_pressed += any(i in group for i in _balls(event[1]))
                    self._at_once(_balls(event[1]), event[1])
                return everything
            self.now += step
            self.out.duration = self.now
            if self.now >= self.last:
                return everything
            if step == stop:
                for disc in free:
                    if size(disc.velocity) < self.set.closed:
                        disc.velocity = (ZERO, ZERO)
                return everything
            step = grown
        raise Refused("too many steps under contact forces")

    def _saved(self) -> list[tuple[Vec, Vec]]:
        return [(disc.place, disc.velocity) for disc in self.discs]

    def _restore(self, saved: list[tuple[Vec, Vec]]) -> None:
        for disc, (place, velocity) in zip(self.discs, saved, strict=True):
            disc.place, disc.velocity = place, velocity

    def _stepped(
        self,
        presses: list[Press],
        group: list[int],
        free: list[Disc],
        step: Decimal,
        before: list[tuple[Vec, Vec]],
    ) -> tuple[Decimal, Decimal]:
        """Take one step with little error, shorter if need be; return it and the next one's."""
        for _ in range(60):
            error = self._extrapolated(presses, group, step)
            if error <= self.set.step_error:
                self._fly(free, step)
                grown = step * (2 if error * 1000 < self.set.step_error else 1)
                return step, grown
            self._restore(before)
            step /= 2
        raise Refused("no step is short enough under contact forces")

    def _extrapolated(self, presses: list[Press], group: list[int], step: Decimal) -> Decimal:
        """Step the group by midpoint rules of ever more substeps, and return the error."""
        with localcontext() as context:
            context.prec = 45
            start = self._vector(group)
            slope = self._rates(presses, group, start)
            table: list[list[list[Decimal]]] = []
            error = FAR
            for k in range(12):
                count = 2 * (k + 1)
                row = [self._midpoint(presses, group, start, slope, step, count)]
                for m in range(1, k + 1):
                    ratio = (Decimal(count) / (2 * (k - m + 1))) ** 2 - 1
                    row.append(
                        [
                            a + (a - b) / ratio
                            for a, b in zip(row[-1], table[-1][m - 1], strict=True)
                        ]
                    )
                table.append(row)
                if k >= 2:
                    error = max(abs(a - b) for a, b in zip(row[-1], row[-2], strict=True))
                    if error <= self.set.step_error:
                        break
            self._put(group, table[-1][-1])
            return error

    def _midpoint(
        self,
        presses: list[Press],
        group: list[int],
        start: list[Decimal],
        slope: list[Decimal],
        step: Decimal,
        count: int,
    ) -> list[Decimal]:
        h = step / count
        last, now = start, [a + h * b for a, b in zip(start, slope, strict=True)]
        for _ in range(count - 1):
            rates = self._rates(presses, group, now)
            last, now = now, [a + 2 * h * b for a, b in zip(last, rates, strict=True)]
        rates = self._rates(presses, group, now)
        return [(a + b + h * c) / 2 for a, b, c in zip(last, now, rates, strict=True)]

    def _vector(self, group: list[int]) -> list[Decimal]:
        return [x for i in group for x in (*self.discs[i].place, *self.discs[i].velocity)]

    def _put(self, group: list[int], state: list[Decimal]) -> None:
        for k, i in enumerate(group):
            x, y, u, v = state[4 * k : 4 * k + 4]
            self.discs[i].place, self.discs[i].velocity = (x, y), (u, v)

    def _rates(self, presses: list[Press], group: list[int], state: list[Decimal]) -> list[Decimal]:
        self._put(group, state)
        acceleration, _, _ = self._forces(presses)
        return [x for i in group for x in (*self.discs[i].velocity, *acceleration[i])]

    def _first_event(
        self,
        presses: list[Press],
        group: list[int],
        free: list[Disc],
        watched: list[Contact],
        before: list[tuple[Vec, Vec]],
        after: list[tuple[Vec, Vec]],
        step: Decimal,
    ) -> tuple[Decimal, Contact | None] | None:
        """Find what first ends the step, and leave the balls there."""
        found: list[tuple[Decimal, Contact | None]] = []
        measures: list[tuple[Callable[[], Decimal], Contact | None]] = []
        for k, p in enumerate(presses):
            measures.append((lambda k=k: self._forces(presses)[1][k], None))  # type: ignore[misc]
            if p.slides:
                measures.append((lambda p=p: p.slides * self._slip(p.contact), None))  # type: ignore[misc]
        for c in watched:
            measures.append((lambda c=c: self._gap(c), c))  # type: ignore[misc]
        slack = -Decimal("1e-22")
        for measure, contact in measures:
            self._restore(after)
            end = measure()
            self._restore(before)
            start = measure()
            touches = contact is not None and start <= self.set.near
            if contact is not None and touches and self._closing(contact) > self.set.closed:
                found.append((ZERO, contact))
            elif end < slack:  # What touches and opens may close again within the step.
                found.append((self._crossing(measure, presses, group, free, before, step), contact))
            elif contact is not None and not touches and end < FAR:
                self._refuse_hidden(contact, before, after, start, end, step)
        self._restore(after)
        if not found:
            return None
        first = min(found, key=lambda one: one[0])
        self._restore(before)
        self._go(presses, group, free, first[0])
        return first

    def _refuse_hidden(
        self,
        contact: Contact,
        before: list[tuple[Vec, Vec]],
        after: list[tuple[Vec, Vec]],
        start: Decimal,
        end: Decimal,
        step: Decimal,
    ) -> None:
        """Refuse a gap that may have closed and opened again within the step."""
        self._restore(before)
        closing = self._closing(contact)
        self._restore(after)
        opening = -self._closing(contact)
        if closing > 0 and opening > 0:
            middle = (start + end) / 2 - (closing + opening) * step / 8
            if middle < min(start, end) / 10:
                raise Refused("a graze under contact forces")

    def _slip(self, contact: Contact) -> Decimal:
        return dot(self._rest_velocity(contact), across(self._normal(contact)))

    def _go(self, presses: list[Press], group: list[int], free: list[Disc], dt: Decimal) -> None:
        self._extrapolated(presses, group, dt)
        self._fly(free, dt)

    def _crossing(
        self,
        measure: Callable[[], Decimal],
        presses: list[Press],
        group: list[int],
        free: list[Disc],
        before: list[tuple[Vec, Vec]],
        step: Decimal,
    ) -> Decimal:
        """Return where within the step the measure falls through zero (regula falsi, Illinois).

        A gap that is zero and opens is looked at from a moment on at which it is open.
        """

        def at(dt: Decimal) -> Decimal:
            self._restore(before)
            self._go(presses, group, free, dt)
            return measure()

        self._restore(before)
        low, high = ZERO, step
        f_low, f_high = measure(), at(step)
        if f_low <= self.set.near:
            opened = (step / 2**k for k in range(1, 60))
            low = next((dt for dt in opened if at(dt) > self.set.near), ZERO)
            f_low = at(low)
        if f_low <= 0:
            return ZERO
        for _ in range(80):
            t = high - f_high * (high - low) / (f_high - f_low)
            f = at(t)
            if abs(f) < Decimal("1e-26") or high - low < Decimal("1e-27"):
                return t
            if f < 0:
                high, f_high = t, f
                f_low /= 2
            else:
                low, f_low = t, f
                f_high /= 2
        return t


def _balls(contact: Contact) -> tuple[int, ...]:
    return contact[1:] if contact[0] == "ball" else contact[1:2]


def _sides(contact: Contact) -> tuple[tuple[int, int], ...]:
    """Return the balls of a contact, each with the sign of its part in the gap's growth."""
    return ((contact[1], -1), (contact[2], 1)) if contact[0] == "ball" else ((contact[1], -1),)


def _vec(point: Sequence[float]) -> Vec:
    return (Decimal(point[0]), Decimal(point[1]))


def hard_run(
    scene: Scene, settings: Settings = FINE, nudges: Sequence[Vec] | None = None
) -> HardRun:
    """Play the scene from its velocities, in many digits."""
    with localcontext() as context:
        context.prec = settings.digits
        run = HardReference(scene, settings, nudges).run()
    for ball, (x, y) in zip(scene.balls, run.final, strict=True):
        if scene.table is not None and not scene.table.contains(float(x), float(y)):
            raise Refused(f"ball {ball.id} ended off the table: a hit was passed over")
    for (a, p), (b, q) in combinations(zip(scene.balls, run.final, strict=True), 2):
        if float(size(minus(p, q))) < (a.radius + b.radius) * (1.0 - 1e-9):
            raise Refused(f"balls {a.id} and {b.id} overlap at the end: a hit was passed over")
    return run


def off(a: HardRun, b: HardRun) -> float:
    """Return how far apart (m) two runs end."""
    return max(float(size(minus(p, q))) for p, q in zip(a.final, b.final, strict=True))


# -- random scenes ---------------------------------------------------------------------------------

KINDS = ("squeeze", "corner", "row", "slow", "packed", "moving", "persistent", "struck")
RECTANGLE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
HEXAGON = tuple(
    (round(1.1 * math.cos(k * math.pi / 3), 3), round(1.1 * math.sin(k * math.pi / 3), 3))
    for k in range(6)
)
L_SHAPE = ((0.0, 0.0), (2.0, 0.0), (2.0, 0.8), (0.9, 0.8), (0.9, 1.7), (0.0, 1.7))
WEDGE = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.5))  # its corner at the origin has 27 degrees
LONG = ((-3.0, 0.0), (5.0, 0.0), (5.0, 3.0), (-3.0, 3.0))
FINISH = 20.0  # s

Row = tuple[float, float, float, float, float, float]  # x, y, vx, vy, radius, mass of a ball


def random_hard_scene(kind: str, rng: random.Random) -> Scene:
    """Return a scene of that kind; what it is like otherwise, chance decides."""
    makers: dict[str, Callable[[random.Random], Scene]] = {
        "squeeze": _squeeze,
        "corner": _corner,
        "row": _row,
        "slow": lambda r: _crowd(r, slow=True),
        "packed": _packed,
        "moving": lambda r: _crowd(r, slow=False),
        "persistent": _persistent,
        "struck": _struck_pair,
    }
    while True:
        try:
            return makers[kind](rng)
        except (SceneError, Refused):
            continue


def _scene(
    balls: Sequence[Row],
    outline: Sequence[tuple[float, float]] | None,
    e: tuple[float, float | None, float],
    friction: tuple[float, float, float],
) -> Scene:
    """Return the scene of balls (x, y, vx, vy, radius, mass); ball 0 is the cue ball."""
    return Scene(
        balls=tuple(
            Ball(str(i), (x, y), r, m, cue=i == 0, velocity=(vx, vy))
            for i, (x, y, vx, vy, r, m) in enumerate(balls)
        ),
        table=Table(tuple(outline)) if outline else None,
        restitution=Restitution(*e),
        friction=Friction(*friction),
        physics=Physics(max_time=FINISH),
    )


def _random_e(rng: random.Random) -> tuple[float, float | None, float]:
    one, other, cushion = (rng.choice([0.0, round(rng.uniform(0, 0.9), 2)]) for _ in "abc")
    return one, rng.choice([None, other]), rng.choice([one, cushion])


def _random_friction(rng: random.Random) -> tuple[float, float, float]:
    return (
        round(rng.uniform(0.01, 0.3), 3),
        rng.choice([0.0, round(rng.uniform(0, 0.4), 2)]),
        rng.choice([0.0, round(rng.uniform(0, 0.4), 2)]),
    )


def _random_gap(rng: random.Random) -> float:
    return rng.choice([0.0, 0.0, 1e-9, 1e-6, 1e-4, 1e-2, 0.1]) * round(rng.uniform(0.3, 1), 3)


def _turned(balls: Iterable[Row], side: int) -> list[Row]:
    """Move balls from cushion 0 of a square, whose side is 2 m, to another of its cushions."""
    out = list(balls)
    for _ in range(side):
        out = [(2 - y, x, -vy, vx, r, m) for x, y, vx, vy, r, m in out]
    return out


SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))


def _squeeze(rng: random.Random) -> Scene:
    """Return a heavy ball that drives a light one to a cushion, head on or nearly so."""
    r, big = 0.0625, rng.choice([0.0625, 0.125])
    ratio = round(10 ** rng.uniform(1, 6), 1)
    below, between = _random_gap(rng), _random_gap(rng)
    aside = rng.choice([0.0, rng.uniform(-1, 1)]) * min(r, 2 * math.sqrt(r * (below + between)))
    up = math.sqrt((r + big) ** 2 - aside**2) + between if aside else r + big + between
    speed = round(10 ** rng.uniform(-1, 0.7), 3)
    drift = rng.choice([0.0, round(rng.uniform(-0.3, 0.3), 3)]) * speed
    balls = [(1 + aside, r + below + up, drift, -speed, big, 0.125 * ratio)]
    balls.append((1.0, r + below, 0.0, 0.0, r, 0.125))
    return _scene(_turned(balls, rng.randrange(4)), SQUARE, _random_e(rng), _random_friction(rng))


def _corner(rng: random.Random) -> Scene:
    """Return one ball that drives another into a corner: square, acute, or one that sticks out."""
    outline, corner, inwards = rng.choice(
        [
            (RECTANGLE, (0.0, 0.0), math.pi / 4),
            (WEDGE, (0.0, 0.0), math.atan2(1.5, 3) / 2),
            (HEXAGON, (1.1, 0.0), math.pi),
            (L_SHAPE, (0.9, 0.8), math.radians(-135)),
        ]
    )
    r, big = round(rng.uniform(0.02, 0.05), 3), round(rng.uniform(0.03, 0.07), 3)
    angle = inwards + rng.uniform(-0.3, 0.3)
    far = r * rng.uniform(1.1, 6)
    x, y = (c + far * d for c, d in zip(corner, (math.cos(angle), math.sin(angle)), strict=True))
    way = angle + rng.uniform(-0.3, 0.3)
    gap = rng.choice([1e-6, 1e-3, 0.05, 0.2]) * rng.uniform(0.3, 1)
    bx, by = x + (r + big + gap) * math.cos(way), y + (r + big + gap) * math.sin(way)
    speed, course = 10 ** rng.uniform(-1, 0.5), way + math.pi + rng.uniform(-0.1, 0.1)
    mass = round(0.1 * 10 ** rng.uniform(0, 3), 3)
    return _scene(
        [
            (bx, by, speed * math.cos(course), speed * math.sin(course), big, mass),
            (x, y, 0.0, 0.0, r, 0.1),
        ],
        outline,
        _random_e(rng),
        _random_friction(rng),
    )


def _row(rng: random.Random) -> Scene:
    """Return a row of two or three light balls between a heavy one and a cushion or a heavy one."""
    r, ratio = 0.0625, round(10 ** rng.uniform(0.5, 2.5), 1)
    gaps = [_random_gap(rng) for _ in range(rng.choice([2, 3]))]
    bend = rng.choice([0.0, 1e-3, 0.02])
    at = r + _random_gap(rng)
    balls = [(1.0, at, 0.0, 0.0, r, 0.125)]
    for gap in gaps:
        at += 2 * r + gap
        balls.append((1 + bend * rng.uniform(-1, 1), at, 0.0, 0.0, r, 0.125))
    if rng.random() < 0.3:
        balls[0] = (*balls[0][:5], 0.125 * ratio)
    x, y, *_ = balls.pop()
    balls.insert(0, (x, y, 0.0, -round(rng.uniform(0.1, 3), 3), r, 0.125 * ratio))
    return _scene(_turned(balls, rng.randrange(4)), SQUARE, _random_e(rng), _random_friction(rng))


def _crowd(rng: random.Random, slow: bool) -> Scene:
    """Return 3 to 9 balls of very different masses, most of them moving, slowly or not."""
    outline = rng.choice([RECTANGLE, HEXAGON, L_SHAPE])
    scale = 10 ** rng.uniform(-5, -1.5) if slow else 1.0
    friction = _random_friction(rng)
    wanted = rng.randint(3, 9)
    balls: list[Row] = []
    spread = rng.choice([0.2, 0.6, 1.0])
    table = Table(tuple(outline))
    while len(balls) < wanted:
        r = round(rng.uniform(0.02, 0.07), 4)
        x, y = (round(0.45 + spread * rng.uniform(-0.8, 1.2), 4) for _ in "xy")
        near = scale**2 / (20 * friction[0]) if slow else 0.0
        if balls and slow:
            ox, oy, _, _, other, _ = rng.choice(balls)
            turn, far = rng.uniform(-math.pi, math.pi), r + other + near * rng.uniform(0.1, 3)
            x, y = ox + far * math.cos(turn), oy + far * math.sin(turn)
        if any(math.dist((x, y), b[:2]) < r + b[4] + near / 20 for b in balls):
            continue
        if not table.contains(x, y) or any(edge.distance(x, y) <= r for edge in table.edges):
            if len(balls) < 2:
                balls = []
            continue
        speed, turn = scale * rng.uniform(0.1, 2), rng.uniform(-math.pi, math.pi)
        speed *= rng.random() < 0.8
        mass = round(0.05 * 10 ** rng.uniform(0, 3), 4)
        balls.append((x, y, speed * math.cos(turn), speed * math.sin(turn), r, mass))
    return _scene(balls, outline, _random_e(rng), friction)


def _packed(rng: random.Random) -> Scene:
    """Return a triangle of balls 2.02 to 2.3 radii apart, and a ball shot at it."""
    r = 0.03
    balls = [(0.5, 0.5 + rng.uniform(-0.02, 0.02), rng.uniform(0.5, 4), 0.0, r, 0.17)]
    for row in range(rng.choice([2, 3])):
        for k in range(row + 1):
            pitch = rng.uniform(2.02, 2.3) * r
            x = 0.9 + 2.3 * r * row * 0.9 + rng.uniform(-0.02, 0.02) * r
            balls.append((x, 0.5 + pitch * (k - row / 2), 0.0, 0.0, r, rng.choice([0.17, 1.7])))
    return _scene(balls, RECTANGLE, _random_e(rng), _random_friction(rng))


def _pair(
    rng: random.Random,
) -> tuple[list[Row], float]:
    """Return two balls, of which one catches up with the other at an angle, and surface friction.

    They go so slowly that friction can press them together against the turning of their normal.
    """
    surface = round(rng.uniform(0.05, 0.4), 3)
    r, other = round(rng.uniform(0.03, 0.07), 3), round(rng.uniform(0.03, 0.07), 3)
    along = rng.uniform(0.15, 0.8) * math.sqrt(surface * 9.8 * (r + other) / 2)
    aside, rest = along * rng.uniform(-1.2, 1.2), along * rng.uniform(-0.2, 0.2)
    extra = rng.choice([0.0, rng.uniform(0.01, 0.4)]) * along
    gap = rng.choice([0.0, 1e-6, 1e-4, 1e-3]) * rng.uniform(0.3, 1)
    turn = rng.choice([0.0, rng.uniform(-math.pi, math.pi)])
    c, s = math.cos(turn), math.sin(turn)

    def turned(x: float, y: float) -> tuple[float, float]:
        return c * x - s * y, s * x + c * y

    mass, mass_other = (round(0.1 * 10 ** rng.uniform(0, 1.5), 3) for _ in "ab")
    return [
        (0.0, 0.0, *turned(along + extra, aside), r, mass),
        (*turned(r + other + gap, 0.0), *turned(along, rest), other, mass_other),
    ], surface


def _persistent(rng: random.Random) -> Scene:
    """Return two balls that surface friction may press together, perhaps along a cushion."""
    balls, surface = _pair(rng)
    e, (_, cushion, mu) = _random_e(rng), _random_friction(rng)
    if rng.random() < 0.25:
        (x, y, vx, vy, r, m), (x2, y2, vx2, vy2, r2, m2) = balls
        low = min(y - r, y2 - r2)
        balls = [(1 + x, y - low, vx, vy, r, m), (1 + x2, y2 - low, vx2, vy2, r2, m2)]
        return _scene(balls, LONG, e, (surface, cushion, mu))
    return _scene(balls, None, e, (surface, cushion, mu))


def _struck_pair(rng: random.Random) -> Scene:
    """Return a pair that friction presses together, and a third ball that hits it meanwhile."""
    while True:
        balls, surface = _pair(rng)
        e, (_, cushion, mu) = _random_e(rng), _random_friction(rng)
        alone = hard_run(_scene(balls, None, e, (surface, cushion, mu)))
        if alone.pressed > Decimal("0.02"):
            break
    until = float(alone.duration)
    r = round(rng.uniform(0.03, 0.07), 3)
    for _ in range(200):
        turn, speed = rng.uniform(-math.pi, math.pi), rng.uniform(0.2, 2)
        target = rng.choice(balls)
        t = rng.uniform(0.1, 0.8) * until
        far = target[4] + r + speed * t
        x, y = target[0] + 0.7 * t * target[2], target[1] + 0.7 * t * target[3]
        third = (
            x + far * math.cos(turn), y + far * math.sin(turn),
            -speed * math.cos(turn), -speed * math.sin(turn), r, 0.2,
        )  # fmt: skip
        scene = _scene([*balls, third], None, e, (surface, cushion, mu))
        run = hard_run(scene)
        if run.struck_while_pressed:
            return scene
    raise Refused("no third ball hits the pair while friction presses it together")


# -- the data file ---------------------------------------------------------------------------------

NUDGE = Decimal("1e-15")  # m
MOST_AMPLIFIED = 1e5  # Scenes that amplify nudges more than so say little of a solver.
FOUND = (
    ("squeeze", 33),
    ("corner", 16),
    ("corner", 113),
    ("corner", 141),
    ("row", 7),
    ("row", 23),
)
CLEAR = 1e-15  # m; a coarser run that differs by more leaves the answer open
RECORDS = {
    "squeeze": 16,
    "corner": 6,
    "row": 6,
    "slow": 4,
    "packed": 4,
    "moving": 4,
    "persistent": 10,
    "struck": 5,
}


def amplification(scene: Scene, run: HardRun) -> float:
    """Return how much farther ends move than starts, from two nudges of every start."""
    rng = random.Random(0)
    worst = 1.0
    for _ in range(2):
        nudges = [(NUDGE * rng.choice((-1, 1)), NUDGE * rng.choice((-1, 1))) for _ in run.final]
        worst = max(worst, off(hard_run(scene, FINE, nudges), run) / float(NUDGE))
    return worst


def is_hard(kind: str, run: HardRun) -> bool:
    """Tell whether the run has what its kind is about."""
    if kind == "persistent":
        return run.pressed > Decimal("0.01")
    if kind == "struck":
        return run.struck_while_pressed > 0
    if kind in ("slow", "packed", "moving"):
        return run.hits >= 4
    return run.most_at_once >= 10 or run.hits >= 20


def answered(kind: str, scene: Scene) -> dict[str, Any] | None:
    """Return the scene's answer as it stands in the data file; None if it is not hard, or unclear.

    The answer is trusted as far as a run with coarser bounds agrees with it, times ten.
    """
    try:
        run = hard_run(scene)
        if not is_hard(kind, run):
            return None
        coarse = off(hard_run(scene, COARSE), run)
        amplified = amplification(scene, run)
    except Refused:
        return None
    if coarse > CLEAR:
        print(f"unclear by {coarse:.1e} m: {scene_to_dict(scene)}")
    if amplified > MOST_AMPLIFIED or coarse > CLEAR:
        return None
    return {
        "kind": kind,
        "scene": scene_to_dict(scene),
        "final": [[f"{x:.20g}" for x in place] for place in run.final],
        "duration": f"{run.duration:.20g}",
        "hits": run.hits,
        "most_at_once": run.most_at_once,
        "pressed": float(run.pressed),
        "trusted": max(1e-19, 10 * coarse),
        "amplification": amplified,
    }


def made(kind: str, k: int) -> dict[str, Any]:
    """Make record ``k`` of that kind: the first hard scene from its seed that has an answer."""
    rng = random.Random(f"hard {kind} {k}")
    while True:
        answer = answered(kind, random_hard_scene(kind, rng))
        if answer is not None:
            return {"name": f"{kind} {k}", **answer}


def found(kind: str, k: int) -> dict[str, Any]:
    """Return one more record, by a search for scenes that a solver has wrong."""
    answer = answered(kind, random_hard_scene(kind, random.Random(f"found {kind} {k}")))
    if answer is None:
        raise Refused(f"found {kind} {k}")
    return {"name": f"found {kind} {k}", **answer}


def main() -> None:
    """Write the data file anew; it takes some minutes."""
    lines = []
    for kind, count in RECORDS.items():
        for k in range(count):
            lines.append(json.dumps(made(kind, k)))
            print(kind, k, flush=True)
    for kind, k in FOUND:
        lines.append(json.dumps(found(kind, k)))
    text = "[\n" + ",\n".join(lines) + "\n]\n"
    (DATA / "hard_runs.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
