"""This is an independent reference for contacts that persist, of discs and of balls that roll.

It shares nothing with the solvers except the scene's numbers, and knows the law "coulomb" only.
Vectors are complex numbers, in floats. Ends are right to some 1e-11 m times the amplification
where e is low. The bounces that are left out cost up to 1e-9 m times the amplification at e = 0.9.
One rule of order five (Dormand and Prince) plays all motion, free or in contact. Where sides touch,
forces N >= 0 keep their gap closed, in equations for the accelerations:

- Surface: a ball that slips has a = f - mu_s g u/|u| and dw/dt = c + (5/2) mu_s g u/|u|. One that
  rolls has a = dw/dt = (5/7) f + (2/7) c - mu_r g v/|v| while (2/7) |f - c| <= mu_s g. One at rest
  stays while |(5/7) f + (2/7) c| <= mu_r g; a disc slides, or stays while |f| <= mu_s g.
  Here u = v - w is the slip, f the push of contacts, and c what cushions do to the roll w.
- Contact: N >= 0, the gap's acceleration is >= 0, and one of both is 0. Friction is mu N against
  the slip, or holds the slip at 0. A cushion slows the roll into it by (5/2) mu N / m, or holds it.
- A contact persists when the bounces to come would move its sides apart by less than 1e-13 m.

What the forces are, is decided anew at each event: a force, slip or speed falls through zero, a
hold fails, a side ends, or balls hit. What is refused: pockets, corners that point inwards, sides
that bulge inwards, contacts of one instant that share a ball and slip, a resting ball that is
pressed on to a cushion, and scenes of over a thousand events, such as an inelastic collapse.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpmath import mp, mpc

from pool_pymunk import Scene, State
from tests.oracle.reference import Contact, Curve, Flight, Number, Refused, Side, balls_of

Key = tuple[str, Contact]
Measures = dict[Key, float]  # what ends a step where it falls through zero
Saved = tuple[list[complex], list[complex], list[complex], list[str]]  # places, v, w, phases

REST, SLIP, ROLL = "rest", "slip", "roll"
TOUCH = 1e-11  # m; gaps below are none where a force presses
HERE = 1e-13  # m; gaps below are none where balls hit
SUNK = 1e-9  # m; two sides never overlap by more
SLOW = 1e-10  # m/s; slower closing and slip of a contact are none
DONE = 1e-12  # m/s; slower slip of a ball is none
KICK = 1e-11  # m/s; a ball sets off with it, so that it has a direction
LOW = 1e-13  # m; bounces are left out that are no higher in all
FIT = 1e-12  # m/s^2; forces and accelerations below are none
STEP, ERROR = 0.02, 3e-14  # s; m and m/s in a step
MOST_STEPS, MOST_EVENTS = 40_000, 1_000
# By what ends a step: how far it must fall, in m, m/s or m/s^2.
BELOW = {"gap": 3e-15, "end": 1e-13, "slip": 1e-13, "into": 1e-13, "border": 3e-15}

# The method of Dormand and Prince: its stages, and the difference to its embedded method.
STAGES = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
SPREAD = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)


def dot(a: complex, b: complex) -> float:
    """Return the scalar product."""
    return a.real * b.real + a.imag * b.imag


def unit(a: complex) -> complex:
    """Return the direction of a vector; that of none is 0."""
    return a / abs(a) if a else 0j


def sign(x: float) -> int:
    """Return the sign of a number, and 0 of one that is next to nothing."""
    return 0 if abs(x) < SLOW else int(math.copysign(1, x))


def alone(i: int) -> Contact:
    """Return what stands for a ball by itself where events name contacts."""
    return "alone", i, i


@dataclass
class Press:
    """This is a contact that a force keeps closed.

    ``slides`` is the sign of its slip, ``into`` that of the roll into a cushion. A sign of 0 says
    that friction holds what would grow there.
    """

    slides: int
    into: int


@dataclass
class PressRun:
    """This holds the end of a run (m, s), its events, and the energy (J) after each step."""

    final: list[complex] = field(default_factory=list)
    duration: float = 0.0
    events: list[tuple[float, str, Contact]] = field(default_factory=list)
    energy: list[float] = field(default_factory=list)
    strongest: dict[Contact, float] = field(default_factory=dict)  # N, the largest of each contact


def in_floats(shape: Side | Curve) -> list[Any]:
    """Return the numbers of a side or a curve as floats, and its vectors as complex numbers."""
    return [x if x is None else complex(x) if isinstance(x, mpc) else float(x) for x in shape]


class PressReference:
    """This is the scene in floats; ``run`` plays it."""

    def __init__(self, scene: Scene, start: State) -> None:
        flight = Flight(scene, start, 0, 0)
        self.contacts = flight.contacts
        if scene.physics.law != "coulomb" or scene.pockets:
            raise Refused("the law is not coulomb, or there are pockets")
        if any(c[0] == "corner" for c in self.contacts):
            raise Refused("a corner points inwards")
        if any(curve.bulge < 0 and curve.start is not None for curve in flight.curves.values()):
            raise Refused("a side bulges inwards")
        self.sides = [Side(*in_floats(side)) for side in flight.sides]
        self.curves = {k: Curve(*in_floats(curve)) for k, curve in flight.curves.items()}
        self.known = {c: [float(x) for x in known] for c, known in flight.known.items()}
        self.rolls, count = flight.rolls, len(scene.balls)
        self.grip, self.drag = [float(flight.loss)] * count, [float(flight.drag)] * count
        self.radius = [ball.radius for ball in scene.balls]
        self.mass = [ball.mass for ball in scene.balls]
        self.place = [complex(*p) for p in start.position]
        self.v = [complex(*v) for v in start.velocity]
        self.w = [complex(*w) for w in start.roll] if start.roll else [0j] * len(self.v)
        self.everybody = range(len(self.v))
        self.phase = [self._phase_of(i) for i in self.everybody]
        self.presses: dict[Contact, Press] = {}
        self.now, self.last = 0.0, float(flight.last)
        self.out = PressRun()

    def run(self) -> PressRun:
        """Play until everything rests, or until the scene's ``max_time``."""
        self._hit_now()
        self._decide()
        step = STEP
        for _ in range(MOST_STEPS):
            self._note()
            if self.now >= self.last or all(phase == REST for phase in self.phase):
                self.out.final, self.out.duration = self.place, self.now
                return self.out
            step, is_event = self._go_on(min(step, self.last - self.now))
            if is_event:
                self._note()
                self._hit_now()
                self._decide()
                step = STEP
        raise Refused("too many steps")

    def _note(self) -> None:
        if any(self._gap(c) < -SUNK and self._room(c) >= 0 for c in self.contacts):
            raise ArithmeticError("the reference has let two sides sink in")
        speeds = zip(self.mass, self.v, self.w, strict=True)
        self.out.energy.append(sum(m * (abs(v) ** 2 / 2 + abs(w) ** 2 / 5) for m, v, w in speeds))

    # -- geometry ----------------------------------------------------------------------------------

    def _gap(self, contact: Contact) -> float:
        """Return the gap; that of a side goes on along its line or circle beyond its ends."""
        kind, i, k = contact
        if kind == "ball":
            return abs(self.place[k] - self.place[i]) - self.radius[i] - self.radius[k]
        if kind == "face":
            side = self.sides[k]
            return dot(self.place[i] - side.start, 1j * side.along) - self.radius[i]
        curve = self.curves[k]
        out = abs(self.place[i] - curve.center) - curve.radius
        return float(-out if curve.bulge > 0 else out) - self.radius[i]

    def _room(self, contact: Contact) -> float:
        """Return how far (m) a ball is from the nearer end of a side; below 0 it is beyond it."""
        kind, i, k = contact
        if kind == "face":
            foot = dot(self.place[i] - self.sides[k].start, self.sides[k].along)
            return min(foot, float(self.sides[k].length) - foot)
        if kind == "ball" or self.curves[k].start is None:
            return math.inf
        curve = self.curves[k]
        top = -1j * (curve.end - curve.start)  # from the chord to the arc
        angle = cmath.phase((self.place[i] - curve.center) / top)
        return float(curve.radius) * (2 * math.atan(curve.bulge) - abs(angle))

    def _normal(self, contact: Contact) -> complex:
        """Return the unit vector from the ball to what it meets."""
        kind, i, k = contact
        if kind == "ball":
            return unit(self.place[k] - self.place[i])
        if kind == "face":
            return -1j * complex(self.sides[k].along)
        out = unit(self.place[i] - self.curves[k].center)
        return out if self.curves[k].bulge > 0 else -out

    def _bend(self, contact: Contact) -> float:
        """Return how much (1/m) the normal turns with the length along the contact."""
        kind, i, k = contact
        if kind == "face":
            return 0.0
        if kind == "ball":
            return -1 / (self.radius[i] + self.radius[k])
        curve = self.curves[k]
        return 1 / (math.copysign(curve.radius, curve.bulge) - self.radius[i])

    def _relative(self, contact: Contact, of: Sequence[complex]) -> complex:
        kind, i, j = contact
        return of[i] - of[j] if kind == "ball" else of[i]

    def _closing(self, contact: Contact) -> float:
        return dot(self._relative(contact, self.v), self._normal(contact))

    def _slip(self, contact: Contact) -> float:
        return dot(self._relative(contact, self.v), 1j * self._normal(contact))

    def _into(self, contact: Contact) -> float:
        """Return the roll into a cushion (m/s)."""
        return dot(self.w[contact[1]], self._normal(contact))

    def _wrings(self, contact: Contact) -> bool:
        """Tell whether the contact's friction slows the roll."""
        return self.rolls and contact[0] != "ball" and self.known[contact][1] > 0

    # -- hits --------------------------------------------------------------------------------------

    def _phase_of(self, i: int) -> str:
        if abs(self.v[i]) < DONE and abs(self.w[i]) < DONE:
            return REST
        return ROLL if self.rolls and abs(self.v[i] - self.w[i]) < DONE else SLIP

    def _hit_now(self) -> None:
        """Play the hits of this instant; what closes then is the next one."""
        while met := [
            c
            for c in self.contacts
            if self._gap(c) < (TOUCH if c in self.presses else HERE)
            and self._closing(c) > SLOW
            and self._room(c) >= 0
        ]:
            if len(self.out.events) > MOST_EVENTS:
                raise Refused("too many hits")
            self._hit(met)

    def _hit(self, contacts: Sequence[Contact]) -> None:
        """Let contacts hit at once: each opens at e times its closing speed, or faster."""
        self.out.events += [(self.now, "hit", c) for c in contacts]
        balls = [i for c in contacts for i in balls_of(c)]
        slips = any(self.known[c][1] and abs(self._slip(c)) > SLOW for c in contacts)
        if slips and len(balls) > len(set(balls)):
            raise Refused(f"{contacts} slip at one instant")
        wanted = {c: (1 + self._restitution(c)) * self._closing(c) for c in contacts}
        pushing = list(contacts)
        while True:
            matrix = [[self._response(one, other) for other in pushing] for one in pushing]
            found, *_ = np.linalg.lstsq(matrix, [wanted[c] for c in pushing], rcond=1e-11)
            if found.min() >= 0:
                break
            del pushing[int(found.argmin())]
        for c in contacts:
            gained = sum(self._response(c, d) * x for d, x in zip(pushing, found, strict=True))
            if gained < wanted[c] - SLOW:
                raise Refused(f"{contacts} have no impulses of one instant")
        for c, push in zip(pushing, found.tolist(), strict=True):
            self._strike(c, push)

    def _response(self, one: Contact, other: Contact) -> float:
        """Return by how much (1/kg) a unit impulse of the other contact opens the one."""
        across = dot(self._normal(one), self._normal(other))
        mine, its = (dict(zip(balls_of(c), (-1, 1), strict=False)) for c in (one, other))
        return across * sum(mine[i] * its[i] / self.mass[i] for i in mine.keys() & its.keys())

    def _restitution(self, contact: Contact) -> float:
        """Return that of a hit: 0 where the contact persists from now on."""
        e, _, effective = self.known[contact]
        away = e * self._closing(contact)
        if not 0 < away < 1e-3 or e == 1:
            return e
        before = self._saved()
        self._strike(contact, effective * self._closing(contact))
        self._decide(without=contact)
        pressing = -self._opening(contact, self._moves(self._forces())[0])
        self._restore(before)
        return 0.0 if away**2 < 2 * pressing * (1 - e**2) * LOW else e

    def _strike(self, contact: Contact, push: float) -> None:
        """Give a contact its impulse (N s), with what friction adds."""
        n, (_, mu, effective) = self._normal(contact), self.known[contact]
        slip = self._slip(contact)
        rub = math.copysign(min(mu * push, effective * abs(slip)), slip)
        impulse = push * n + rub * 1j * n
        for i, side in zip(balls_of(contact), (-1, 1), strict=False):
            self.v[i] += side / self.mass[i] * impulse
        if self._wrings(contact):
            i, into = contact[1], self._into(contact)
            less = min(2.5 * mu * push / self.mass[i], abs(into))
            self.w[i] -= math.copysign(less, into) * n
        for i in balls_of(contact):
            self.phase[i] = self._phase_of(i)

    # -- forces ------------------------------------------------------------------------------------

    def _pushes(self, x: Sequence[float]) -> tuple[list[complex], list[complex]]:
        """Return f and c of all balls for the unknown forces x of the contacts."""
        f, c = [0j for _ in self.v], [0j for _ in self.v]
        for contact, (force, rub, wring) in zip(self.presses, self._three(x), strict=True):
            n = self._normal(contact)
            for i, side in zip(balls_of(contact), (-1, 1), strict=False):
                f[i] += side / self.mass[i] * (force * n + rub * 1j * n)
            c[contact[1]] -= wring / self.mass[contact[1]] * n
        return f, c

    def _three(self, x: Sequence[float]) -> Iterator[tuple[float, float, float]]:
        """Yield of each contact its normal force, its friction, and what slows the roll.

        Unknown forces that are left out are 0.
        """
        unknown = iter(x)
        for contact, press in self.presses.items():
            mu, force = self.known[contact][1], next(unknown, 0.0)
            rub, wring = press.slides * mu * force, press.into * 2.5 * mu * force
            if mu and not press.slides:
                rub = next(unknown, 0.0)
            if self._wrings(contact) and not press.into:
                wring = next(unknown, 0.0)
            yield force, rub, wring

    def _moves(self, x: Sequence[float]) -> tuple[list[complex], list[complex]]:
        """Return the rates of velocity and of roll for the contacts' forces."""
        a, b = [0j for _ in self.v], [0j for _ in self.v]
        for i, (f, c) in enumerate(zip(*self._pushes(x), strict=True)):
            if self.phase[i] == SLIP:
                against = self.grip[i] * unit(self.v[i] - self.w[i])
                a[i] = f - against
                b[i] = c + 2.5 * against if self.rolls else 0j
            elif self.phase[i] == ROLL:
                a[i] = b[i] = (5 * f + 2 * c) / 7 - self.drag[i] * unit(self.v[i])
        return a, b

    def _opening(self, contact: Contact, a: list[complex]) -> float:
        """Return the second derivative of the gap."""
        apart = -dot(self._relative(contact, a), self._normal(contact))
        return apart - self._bend(contact) * self._slip(contact) ** 2

    def _residuals(self, x: Sequence[float]) -> list[float]:
        """Return what the forces must bring to 0."""
        (a, b), (f, c) = self._moves(x), self._pushes(x)
        found = []
        for contact, press in self.presses.items():
            n, i = self._normal(contact), contact[1]
            found.append(self._opening(contact, a))
            if not press.slides and self.known[contact][1]:
                found.append(dot(self._relative(contact, a), 1j * n))
            if self._wrings(contact) and not press.into:
                turning = self._bend(contact) * self._slip(contact) * dot(self.w[i], 1j * n)
                rate = {REST: dot(c[i], n), ROLL: dot(c[i] - f[i], n)}
                found.append(rate.get(self.phase[i], dot(b[i], n) + turning))
        return found

    def _solved(self) -> tuple[list[float], float]:
        """Return the unknown forces, of least norm, and how badly (m/s^2) they fit."""
        if not self.presses:
            return [], 0.0
        base = np.array(self._residuals(()))
        units = min(self.mass) * np.eye(len(base))
        matrix = np.array([self._residuals(row) - base for row in units.tolist()]).T
        x, *_ = np.linalg.lstsq(matrix, -base, rcond=1e-11)
        misfit = float(np.abs(matrix @ x + base).max())
        return [min(self.mass) * force for force in x.tolist()], misfit

    def _forces(self) -> list[float]:
        """Return the unknown forces."""
        x, misfit = self._solved()
        if misfit > 1e-9:
            raise Refused("no forces fit")
        return x

    # -- what touches, presses, sticks and rolls ---------------------------------------------------

    def _fresh(self, contact: Contact) -> Press:
        into = sign(self._into(contact)) if self._wrings(contact) else 0
        return Press(sign(self._slip(contact)), into)

    def _decide(self, without: Contact | None = None) -> None:
        """Find forces, holds and phases that fit, from those that hold as much as they can."""
        closed = [
            c
            for c in self.contacts
            if c != without
            and self._gap(c) < TOUCH
            and abs(self._closing(c)) < 10 * SLOW
            and self._room(c) >= 0
            and any(self.phase[i] != REST for i in balls_of(c))
        ]
        self.presses = {c: self._fresh(c) for c in closed}
        for _ in range(30 + 20 * len(closed)):
            if not self._mend(closed):
                return
        raise Refused("the forces of contacts are not found")

    def _mend(self, closed: Sequence[Contact]) -> bool:
        """Change one thing that does not fit; return False where all fits."""
        x, misfit = self._solved()
        a, _ = self._moves(x)
        if misfit > 1e-9:  # Two sides whose joint is met ask for two motions: one of them opens.
            del self.presses[max(self.presses, key=lambda c: self._opening(c, a))]
            return True
        three = dict(zip(self.presses, self._three(x), strict=True))
        weakest = min(three, key=lambda c: three[c][0], default=None)
        if weakest is not None and three[weakest][0] < -FIT:
            del self.presses[weakest]
            return True
        for contact, (force, rub, wring) in three.items():
            press, mu = self.presses[contact], self.known[contact][1]
            if not press.slides and abs(rub) > mu * force + FIT:
                press.slides = 1 if rub > 0 else -1
                return True
            if self._wrings(contact) and not press.into and abs(wring) > 2.5 * mu * force + FIT:
                press.into = 1 if wring > 0 else -1
                return True
        for contact in closed:
            if contact not in self.presses and self._opening(contact, a) < -100 * FIT:
                self.presses[contact] = self._fresh(contact)
                return True
        return self._let_go(x)

    def _let_go(self, x: Sequence[float]) -> bool:
        """Let a ball slip that cannot roll on, or move that cannot rest."""
        f, c = self._pushes(x)
        for i in self.everybody:
            if self._spare(i, f[i], c[i]) >= -FIT:
                continue
            if self.phase[i] == ROLL:
                self.w[i] = self.v[i] - KICK * unit(f[i] - c[i])
                self.phase[i] = SLIP
            else:
                self._set_off(i, unit(5 * f[i] + 2 * c[i]))
            return True
        return False

    def _set_off(self, i: int, heading: complex) -> None:
        for contact in self.contacts:
            if contact[0] != "ball" and contact[1] == i and self._gap(contact) < TOUCH:
                n = self._normal(contact)
                heading -= max(dot(heading, n), 0.0) * n
        if abs(heading) < 1e-6:
            raise Refused("a resting ball is pressed on to a cushion")
        self.v[i] = KICK * unit(heading)
        self.w[i] = self.v[i] if self.rolls else 0j
        self.phase[i] = ROLL if self.rolls else SLIP

    def _spare(self, i: int, f: complex, c: complex) -> float:
        """Return how much more (m/s^2) what holds a ball could hold."""
        if self.phase[i] == ROLL:
            return self.grip[i] - 2 / 7 * abs(f - c)
        if self.phase[i] == REST:
            return self.drag[i] - abs(5 * f + 2 * c) / 7 if self.rolls else self.grip[i] - abs(f)
        return math.inf

    # -- steps -------------------------------------------------------------------------------------

    def _saved(self) -> Saved:
        return list(self.place), list(self.v), list(self.w), list(self.phase)

    def _restore(self, saved: Saved) -> None:
        place, v, w, phase = saved
        self.place, self.v, self.w, self.phase = list(place), list(v), list(w), list(phase)

    def _rates(self, state: np.ndarray) -> np.ndarray:
        self.place, self.v, self.w = state.tolist()
        return np.array([self.v, *self._moves(self._forces())])

    def _advance(self, dt: float) -> float:
        """Move everything on, and return the error of the step."""
        start = np.array([self.place, self.v, self.w])
        rates = [self._rates(start)]
        for weights in STAGES:
            state = start + dt * sum(k * rate for k, rate in zip(weights, rates, strict=True))
            rates.append(self._rates(state))
        self.place, self.v, self.w = state.tolist()
        spread = sum(k * rate for k, rate in zip(SPREAD, rates, strict=True))
        return float(np.abs(dt * spread).max())

    def _fading(self) -> Iterator[tuple[int, float, float]]:
        """Yield the balls whose slip or speed fades: how fast it is, and in what time it is 0."""
        a, b = self._moves(self._forces())
        for i, phase in enumerate(self.phase):
            what, rate = (self.v[i], a[i])
            if phase == SLIP:
                what, rate = self.v[i] - self.w[i], a[i] - b[i]
            loss = -dot(rate, unit(what))
            if phase != REST and loss > 0:
                yield i, abs(what), abs(what) / loss

    def _measures(self) -> Measures:
        """Return what ends a step where it falls through zero."""
        x = self._forces()
        f, c = self._pushes(x)
        found: Measures = {("hold", alone(i)): self._spare(i, f[i], c[i]) for i in self.everybody}
        for contact, (force, rub, wring) in zip(self.presses, self._three(x), strict=True):
            press, mu = self.presses[contact], self.known[contact][1]
            found["force", contact] = force
            self.out.strongest[contact] = max(force, self.out.strongest.get(contact, 0.0))
            if mu and press.slides:
                found["slip", contact] = press.slides * self._slip(contact)
            elif mu:
                found["stick", contact] = mu * force - abs(rub)
            if self._wrings(contact) and press.into:
                found["into", contact] = press.into * self._into(contact)
            elif self._wrings(contact):
                found["wring", contact] = 2.5 * mu * force - abs(wring)
        for contact in self.contacts:
            if any(self.phase[i] != REST for i in balls_of(contact)):
                if contact not in self.presses:
                    found["gap", contact] = self._gap(contact)
                if contact[0] != "ball":
                    found["end", contact] = self._room(contact)
        return found

    def _go_on(self, step: float) -> tuple[float, bool]:
        """Take one step; return the next one's length, and whether something happened."""
        before, first = self._saved(), self._measures()
        closing = {c: self._closing(c) for kind, c in first if kind == "gap"}
        step = min([step, *(0.9 * t for _, _, t in self._fading())])
        while True:
            error = self._advance(step)
            last = self._measures()
            if error <= ERROR and not self._may_dip(first, closing, step):
                break
            self._restore(before)
            step /= 2
            if step < 1e-18:
                raise Refused("no step is short enough")
        after = self._saved()
        found = [
            (self._crossing(key, first[key], before, step), *key)
            for key in last
            if self._falls(key, first[key], last[key], after)
        ]
        self._restore(after)
        for t, kind, who in sorted(found, key=lambda one: one[0]):
            self._restore(before)
            self._advance(t)
            if kind == "gap" and self._room(who) < 0:
                continue
            self.now += t
            self.out.events.append((self.now, kind, who))
            return step, True
        self._restore(after)
        self.now += step
        grown = step * min(2.0, 0.9 * (ERROR / max(error, 1e-20)) ** 0.2)
        return min(max(grown, step / 2), STEP), self._settled()

    def _settled(self) -> bool:
        """Let balls roll that slip no more, and rest that hardly move."""
        for i, speed, _ in self._fading():
            if speed > (DONE if self.phase[i] == SLIP and self.rolls else SLOW):
                continue
            if max(abs(self.v[i]), abs(self.w[i])) <= 10 * SLOW:
                self._rest()
            else:
                self.v[i] = self.w[i] = (5 * self.v[i] + 2 * self.w[i]) / 7
                self.phase[i] = ROLL
            self.out.events.append((self.now, self.phase[i], alone(i)))
            return True
        return False

    def _rest(self) -> None:
        """Let all balls rest that hardly move: those that touch stop together."""
        for i in self.everybody:
            if max(abs(self.v[i]), abs(self.w[i])) <= 10 * SLOW:
                self.v[i] = self.w[i] = 0j
                self.phase[i] = REST

    def _may_dip(self, first: Measures, closing: dict[Contact, float], step: float) -> bool:
        """Tell whether a gap that closes at first and opens at last may close within the step."""
        return step > 1e-9 and any(
            speed > 0 > self._closing(c)
            and first["gap", c] < (speed + max(self.grip) * step) * step
            for c, speed in closing.items()
        )

    def _falls(self, key: Key, start: float, end: float, after: Saved) -> bool:
        """Tell whether a measure has fallen through zero, and that matters."""
        below = BELOW.get(key[0], 10 * FIT)
        if key[0] == "end":
            return end < -below if start >= 0 else end > below
        if end >= -2 * below or start < (-TOUCH if key[0] == "gap" else -below):
            return False
        self._restore(after)
        slow = SLOW if end > -TOUCH else 0.0
        return key[0] != "gap" or self._closing(key[1]) > slow

    def _crossing(self, key: Key, start: float, before: Saved, step: float) -> float:
        """Return where within the step a measure falls through zero, or a side ends or begins.

        A gap that is none at first is looked at from a moment on at which it is open. One that
        never opens has closed where it is not yet seen to be negative.
        """
        below = BELOW.get(key[0], 10 * FIT)
        turn = -1 if key[0] == "end" and start < 0 else 1

        def at(dt: Number) -> float:
            self._restore(before)
            self._advance(float(dt))
            return turn * self._measures()[key] + below

        low = 0.0
        if key[0] == "gap" and start <= 0:
            opened = (step / 2**k for k in range(1, 50))
            low = next((dt for dt in opened if at(dt) > 2 * below), step)
            if low == step:
                closed = (step / 2**k for k in range(50))
                return next((dt for dt in closed if at(dt) > -HERE), 0.0)
        ends = (low, step)
        return float(mp.findroot(at, ends, solver="illinois", tol=1e-17, maxsteps=40, verify=False))


def press_run(scene: Scene, start: State | None = None) -> PressRun:
    """Play the scene from a state, by default with the velocities of its balls."""
    return PressReference(scene, start or scene.start(None)).run()
