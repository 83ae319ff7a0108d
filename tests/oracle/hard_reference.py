"""This is an independent reference for hard contacts, in many digits, for tests.

It shares nothing with the solvers except the scene's numbers, and knows the law "coulomb" only.
Numbers, roots and linear systems are those of mpmath; vectors are complex numbers. Three kinds of
moving on take turns:

- In free flight gaps are polynomials in time, and their first roots are found in 90 digits.
- Where hits come within 1e-28 s of each other, they are played one at a time in the gaps
  themselves, which keep their digits however small they get. Normals stand still meanwhile.
  A long series between two contacts goes on by powers of the linear map of two hits, as long as
  no hit slides where it stuck, or the reverse.
- Where surface friction presses touching balls together, contact forces N >= 0 keep the gap closed.
  The motion is integrated by extrapolation of the midpoint rule, with steps of any order needed.

A scene is refused if two closing contacts that share a ball coincide.
``press_reference`` has balls that roll, and contacts with cushions and arcs that persist.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations
from typing import Any, NamedTuple

from mpmath import mp, mpc, mpf

from pool_pymunk import Scene
from tests.oracle.reference import FAR, Contact, Flight, Number, Refused, Vec, across, balls_of, dot

Batch = tuple[Contact, ...]  # hits at one time
Normals = dict[Contact, Vec]

MOST_STEPS = 500
WORK = 45  # digits of contact forces


@dataclass(frozen=True)
class Settings:
    """These are the bounds of the arithmetic; a second set shows what they cost."""

    digits: int = 90
    still: float = 1e-22  # m/s; slower closing is none
    closed: float = 1e-20  # m/s; slower opening is none where friction presses
    at_once: float = 1e-28  # s; hits this near come in the gaps themselves
    near: float = 1e-21  # m; gaps of contacts that may be among them
    no_gap: float = 1e-40  # m; gaps below are rounding
    step_error: float = 1e-23  # m, m/s; of one step under contact forces
    shortcut: bool = True  # go on by powers of the map of two hits
    kick: float = 0.0  # m/s; balls part at least so fast: tiny hits instead of contact forces
    most_hits: int = 10_000  # played one at a time


FINE = Settings()
COARSE = Settings(
    digits=70,
    still=1e-19,
    closed=1e-17,
    at_once=1e-25,
    near=1e-18,
    step_error=1e-20,
)


class Press(NamedTuple):
    """This is a contact that forces keep closed, with the direction of its friction.

    ``slides`` is the sign of the slip, or 0 where the contact sticks or has no friction.
    """

    contact: Contact
    slides: int
    sticks: bool
    mu: Number


class Held(NamedTuple):
    """These are the contacts that forces keep closed, the balls that move with them, and others."""

    presses: list[Press]
    group: list[int]
    free: list[int]


class Force(NamedTuple):
    """This is an unknown force, its direction, and the direction in which it is measured."""

    contact: Contact
    direction: Vec
    along: Vec
    is_normal: bool


@dataclass
class HardRun:
    """This holds the end of a run, how many hits there were, and how they came."""

    final: list[Vec] = field(default_factory=list)
    velocity: list[Vec] = field(default_factory=list)
    duration: Number = 0
    hits: int = 0
    most_at_once: int = 0
    persistent: Number = 0  # s; so long did forces keep contacts closed
    struck_while_persistent: int = 0
    events: list[tuple[Number, str, Contact]] = field(default_factory=list)


# -- linear systems --------------------------------------------------------------------------------


def column(v: Iterable[Vec]) -> Any:
    """Return the vectors as one column of numbers."""
    return mp.matrix([x for each in v for x in (each.real, each.imag)])


def solved(rows: list[list[Number]], right: list[Number]) -> list[Number]:
    """Solve a small linear system."""
    try:
        lower_upper, pivots = mp.LU_decomp(mp.matrix(rows))
    except ZeroDivisionError as singular:
        raise Refused("contact forces are not determined") from singular
    if min(abs(lower_upper[k, k]) for k in range(len(right))) < 1e-30:
        raise Refused("contact forces are not determined")
    return list(mp.U_solve(lower_upper, mp.L_solve(lower_upper, mp.matrix(right), pivots)))


def sides_of(contact: Contact) -> Iterator[tuple[int, int]]:
    """Return the balls of a contact, each with the sign of its part in the gap's growth."""
    return zip(balls_of(contact), (-1, 1), strict=False)


class HardReference(Flight):
    """This is the scene in many digits; ``run`` plays it."""

    def __init__(self, scene: Scene, settings: Settings, nudges: Sequence[Vec] | None) -> None:
        super().__init__(scene, scene.start(None), settings.no_gap, settings.still)
        if scene.physics.law != "coulomb" or scene.pockets:
            raise Refused("the law is not coulomb, or there are pockets")
        self.set = settings
        for i, nudge in enumerate(nudges or ()):
            self.place[i] += nudge
        self.stops: dict[int, Number] = {}
        self.out = HardRun()
        self.shut: set[Contact] = set()  # a series of hits has closed them: they have no gap
        self.steps = 0  # under contact forces
        self.played = 0  # hits one at a time

    def run(self) -> HardRun:
        """Play until everything rests, or until the scene's ``max_time``."""
        everybody = set(self.everybody)
        self._at_once(everybody)
        presses = self._persistent()
        self._foresee(everybody)
        while self.now < self.last:
            if presses:
                self._go_persistent(presses)
                presses = self._persistent()
                self._foresee(everybody)
            elif self._go_free():
                presses = self._persistent()
            else:
                break
        self.out.final, self.out.velocity = self.place, self.velocity
        return self.out

    # -- geometry ----------------------------------------------------------------------------------

    def _gap(self, contact: Contact) -> Number:
        kind, i, j = contact
        touching = self._contact_distance(contact)
        if kind == "ball":
            return abs(self.place[j] - self.place[i]) - touching
        if kind == "curve":
            curve = self.curves[j]
            out = abs(self.place[i] - curve.center) - curve.radius
            return -mp.sign(curve.bulge) * out - touching if curve.has(self.place[i]) else FAR
        start, along, length = self.sides[j]
        to = (self.place[i] - start) * along.conjugate()
        if kind == "corner":
            return abs(to) - touching
        return to.imag - touching if 0 <= to.real <= length and to.imag > 0 else FAR

    def _relative(self, contact: Contact, velocity: list[Vec] | None = None) -> Vec:
        """Return the velocity of the ball relative to what it meets."""
        kind, i, j = contact
        v = velocity or self.velocity
        return v[i] - v[j] if kind == "ball" else v[i]

    def _closing(self, contact: Contact) -> Number:
        return dot(self._relative(contact), self._normal(contact))

    def _slip(self, contact: Contact) -> Number:
        return dot(self._relative(contact), across(self._normal(contact)))

    def _touches(self, contact: Contact) -> bool:
        """Tell whether the gap is next to nothing; in floats first, which is far quicker."""
        kind, i, j = contact
        if kind == "ball":
            far = complex(self.place[j] - self.place[i])
            if abs(far) > float(self.radius[i] + self.radius[j]) + 1e-9:
                return False
        return bool(self._gap(contact) <= self.set.near)

    # -- free flight -------------------------------------------------------------------------------

    def _foresee(self, changed: set[int]) -> None:
        """Work out anew when the balls that changed stop, and what they meet."""
        for i in changed:
            self.stops.pop(i, None)
            if self.velocity[i] and self.loss:
                self.stops[i] = self.now + self._ends_in(i)
        for contact in self.contacts:
            if not changed.isdisjoint(balls_of(contact)):
                self.due.pop(contact, None)
                t = self._meeting(contact)
                if t is not None:
                    self.due[contact] = self.now + t

    def _go_free(self) -> bool:
        """Go on to the next event; return False where there is none any more."""
        if not any(self.velocity):
            return False
        t_stop, t_hit = (min(due.values(), default=FAR) for due in (self.stops, self.due))
        t = min(t_stop, t_hit, self.last)
        if t == FAR:
            raise Refused("the scene never ends")
        self._fly(self.everybody, t - self.now)
        self.now = self.out.duration = t
        if t == t_hit:
            hit = next(c for c, due in self.due.items() if due == t)
            self.out.events.append((t, "hit", hit))
            self._foresee(self._at_once(balls_of(hit), hit) | set(balls_of(hit)))
        elif t == t_stop:
            stop = next(i for i, due in self.stops.items() if due == t)
            self.velocity[stop] = mpc(0)
            self._foresee({stop})
        return True

    # -- hits --------------------------------------------------------------------------------------

    def _struck(
        self, contact: Contact, n: Vec, velocity: list[Vec], regime: int | None = None
    ) -> tuple[list[Vec], int]:
        """Return the velocities after a hit, and how it went: 0 stuck, or the sign of the slip.

        With ``regime`` given, the hit goes like that whatever the slip is: it is then linear.
        """
        e, mu, effective = self.known[contact]
        apart = self._relative(contact, velocity)
        closing, slip = dot(apart, n), dot(apart, across(n))
        away = e * closing if regime is not None else max(e * closing, self.set.kick)
        push = effective * (closing + away)
        if regime is None:
            sticks = mu * push >= effective * abs(slip)
            regime = 0 if sticks else (1 if slip > 0 else -1)
        rub = effective * slip if regime == 0 and mu else mu * push * regime
        impulse = push * n + rub * across(n)
        after = list(velocity)
        for i, side in sides_of(contact):
            after[i] += side / self.mass[i] * impulse
        return after, regime

    def _at_once(self, seeds: Iterable[int], met_now: Contact | None = None) -> set[int]:
        """Play the hits of this instant among all that touches, and return whose motion changed.

        The gap of ``met_now`` is none, though rounding may have left a little of it.
        """
        normals = {c: self._normal(c) for c in self._touching(set(seeds), met_now)}
        gaps = self._gaps_of(normals, met_now)
        changed: set[int] = set()
        latest: list[Batch] = []
        hits = 0
        while True:
            speeds = {c: dot(self._relative(c), n) for c, n in normals.items()}
            waits = {c: gaps[c] / s for c, s in speeds.items() if s > self.set.still}
            dt = min(waits.values(), default=FAR)
            if dt > 100 * self.set.at_once:
                break
            now = [c for c, wait in waits.items() if wait - dt <= dt * self.set.no_gap]
            met = [i for c in now for i in balls_of(c)]
            if len(met) > len(set(met)):
                raise Refused(f"{now} at one instant")
            for c in gaps:
                gaps[c] = max(mpf(0), gaps[c] - speeds[c] * dt)
            for c in now:
                self.velocity, _ = self._struck(c, normals[c], self.velocity)
                gaps[c] = mpf(0)
            changed.update(met)
            hits += len(now)
            self.played += len(now)
            if self.played > self.set.most_hits:
                raise Refused("too many hits")
            latest.append(tuple(now))
            if len(latest) == 40 and self.set.shortcut:
                if len(set(latest)) == 2 or not any(gaps.values()):
                    hits += self._shortcut(latest, normals)
                    gaps.update({c: mpf(0) for batch in latest for c in batch})
                latest = []
        self._settle(changed, normals)
        self.out.hits += hits
        self.out.most_at_once = max(self.out.most_at_once, hits)
        return changed

    def _gaps_of(
        self, cluster: Iterable[Contact], met_now: Contact | None
    ) -> dict[Contact, Number]:
        """Return the gaps, and 0 where rounding alone or the bounds of a series left some."""
        gaps = {c: self._gap(c) for c in cluster}
        for c, gap in gaps.items():
            if gap <= self.set.no_gap or c in self.shut or c == met_now:
                gaps[c] = mpf(0)
        return gaps

    def _settle(self, changed: Iterable[int], normals: Normals) -> None:
        """Let balls rest that hardly move, and note which contacts a series of hits has closed."""
        for i in changed:
            if abs(self.velocity[i]) < self.set.closed:
                self.velocity[i] = mpc(0)
        for c, n in normals.items():
            closed = abs(dot(self._relative(c), n)) <= self.set.closed
            is_hollow = c[0] == "curve" and self.curves[c[2]].bulge > 0
            if closed and is_hollow and self.velocity[c[1]]:
                raise Refused(f"{c}: a ball runs along the inside of an arc")
            (self.shut.add if closed else self.shut.discard)(c)

    def _touching(self, balls: set[int], met_now: Contact | None) -> list[Contact]:
        """Return the contacts without gap that hang together with these balls."""
        closed = [c for c in self.contacts if c == met_now or self._touches(c)]
        while True:
            mine = [c for c in closed if not balls.isdisjoint(balls_of(c))]
            more = {i for c in mine for i in balls_of(c)}
            if more <= balls:
                return mine
            balls = balls | more

    # -- a long series of hits that repeats itself -------------------------------------------------

    def _shortcut(self, latest: Sequence[Batch], normals: Normals) -> int:
        """Go on by powers of the map of one period; return how many hits that were.

        Two contacts take turns whatever their gaps are. More contacts have no gaps here.
        """
        periods = (2, 4, 6, 8, 10)
        same = (p for p in periods if all(latest[-k] == latest[-k - p] for k in range(1, 21)))
        period = next(same, None)
        total = 0
        while period is not None:
            pattern = latest[-period:]
            regimes = self._regimes(pattern, normals, self.velocity)
            if regimes is None:
                break
            power = self._map(pattern, normals, regimes)
            leap, gained = len(regimes), 0
            while True:
                ends = power * column(self.velocity)
                ahead = [mpc(ends[2 * i], ends[2 * i + 1]) for i in self.everybody]
                if self._regimes(pattern, normals, ahead) != regimes:
                    break
                best, gained = ahead, leap
                power, leap = power * power, 2 * leap
            if not gained:
                break
            self.velocity, total = best, total + gained
        return total

    def _regimes(
        self, pattern: Sequence[Batch], normals: Normals, v: list[Vec]
    ) -> list[int] | None:
        """Tell how each hit of the period goes, None if not exactly these hits come."""
        found: list[int] = []
        for batch in pattern:
            closing = {
                c for c, n in normals.items() if dot(self._relative(c, v), n) > self.set.still
            }
            if closing != set(batch):
                return None
            for c in batch:
                v, regime = self._struck(c, normals[c], v)
                found.append(regime)
        return found

    def _map(self, pattern: Sequence[Batch], normals: Normals, regimes: list[int]) -> Any:
        """Return the linear map of the hits of one period, each in its regime."""
        hits = [c for batch in pattern for c in batch]
        columns = []
        for i in self.everybody:
            for unit in (mpc(1), mpc(0, 1)):
                v = [unit if k == i else mpc(0) for k in self.everybody]
                for c, regime in zip(hits, regimes, strict=True):
                    v, _ = self._struck(c, normals[c], v, regime)
                columns.append(list(column(v)))
        return mp.matrix(columns).T

    # -- contacts that forces keep closed ----------------------------------------------------------

    def _moves(self, contact: Contact) -> bool:
        return any(self.velocity[i] for i in balls_of(contact))

    def _persistent(self) -> list[Press]:
        """Return the contacts that surface friction presses together now."""
        if not self.loss or not any(self.velocity):
            return []
        touching = [
            c
            for c in self.contacts
            if self._moves(c) and self._touches(c) and abs(self._closing(c)) <= self.set.closed
        ]
        presses = [self._as_press(c) for c in touching]
        while presses:
            presses, forces = self._stuck_or_not(presses)
            weakest = min(range(len(presses)), key=forces.__getitem__)
            if forces[weakest] > 1e-22:
                break
            del presses[weakest]
        if presses:
            acceleration, _, _ = self._forces(presses)
            kept = {p.contact for p in presses}
            if any(self._opening(c, acceleration) < -1e-15 for c in touching if c not in kept):
                raise Refused("contact forces are not unique")
            self._refuse_pushed_off(presses)
        return presses

    def _as_press(self, contact: Contact) -> Press:
        slip, mu = self._slip(contact), self.known[contact][1]
        rubs = mu > 0 and abs(slip) > 10 * self.set.closed
        return Press(contact, (1 if slip > 0 else -1) if rubs else 0, mu > 0 and not rubs, mu)

    def _stuck_or_not(self, presses: list[Press]) -> tuple[list[Press], list[Number]]:
        """Let contacts slide that would need more friction than there is."""
        for _ in range(2 * len(presses) + 1):
            _, forces, rubs = self._forces(presses)
            for k, p in enumerate(presses):
                if p.sticks and abs(rubs[k]) > p.mu * forces[k] > 0:
                    sliding = p._replace(slides=1 if rubs[k] > 0 else -1, sticks=False)
                    presses = [*presses[:k], sliding, *presses[k + 1 :]]
                    break
            else:
                return presses, forces
        raise Refused("contact friction is not unique")

    def _opening(self, contact: Contact, acceleration: list[Vec]) -> Number:
        """Return the second derivative of the gap."""
        n = self._normal(contact)
        apart = sum(side * acceleration[i] for i, side in sides_of(contact))
        return dot(apart, n) + self._curving(contact, n)

    def _curving(self, contact: Contact, n: Vec) -> Number:
        """Return how fast the gap's rate grows because the normal turns."""
        if contact[0] == "face":
            return mpf(0)
        return dot(self._relative(contact), across(n)) ** 2 / self._contact_distance(contact)

    def _forces(self, presses: list[Press]) -> tuple[list[Vec], list[Number], list[Number]]:
        """Return all accelerations, and each contact's normal and tangential force.

        A force pushes the first ball of its contact along -direction, and the second one along it.
        """
        acceleration = [self._pull(i) for i in self.everybody]
        normals = [(p, self._normal(p.contact)) for p in presses]
        unknown = [Force(p.contact, n + p.slides * p.mu * across(n), n, True) for p, n in normals]
        unknown += [Force(p.contact, across(n), across(n), False) for p, n in normals if p.sticks]
        right = []
        for contact, _, along, is_normal in unknown:
            apart = sum(side * acceleration[i] for i, side in sides_of(contact))
            curving = self._curving(contact, along) if is_normal else 0
            right.append(-dot(apart, along) - curving)
        rows = [[self._gain(one, other) for other in unknown] for one in unknown]
        found = solved(rows, right)
        for (contact, direction, _, _), force in zip(unknown, found, strict=True):
            for i, side in sides_of(contact):
                if self.velocity[i]:
                    acceleration[i] += side * force / self.mass[i] * direction
        sticking = iter(found[len(presses) :])
        rubs = [
            next(sticking) if p.sticks else p.slides * p.mu * f
            for p, f in zip(presses, found, strict=False)
        ]
        return acceleration, found[: len(presses)], rubs

    def _gain(self, measured: Force, force: Force) -> Number:
        """Return how much a unit of the force speeds up what is measured."""
        shared = (
            side * push / self.mass[i]
            for i, side in sides_of(measured.contact)
            for j, push in sides_of(force.contact)
            if i == j and self.velocity[i]
        )
        return sum(shared) * dot(force.direction, measured.along)

    def _refuse_pushed_off(self, presses: list[Press]) -> None:
        """Refuse where contact forces push a resting ball harder than surface friction holds it."""
        _, forces, rubs = self._forces(presses)
        pushes = [mpc(0)] * len(self.place)
        for p, force, rub in zip(presses, forces, rubs, strict=True):
            n = self._normal(p.contact)
            for i, side in sides_of(p.contact):
                pushes[i] += side * (force * n + rub * across(n))
        for i, push in enumerate(pushes):
            if not self.velocity[i] and abs(push) > self.mass[i] * self.loss * (1 + mpf("1e-15")):
                raise Refused("a resting ball is pushed off")

    def _go_persistent(self, presses: list[Press]) -> None:
        """Go on under contact forces until one ends, a ball stops, or a new hit comes."""
        group = sorted({i for p in presses for i in balls_of(p.contact) if self.velocity[i]})
        held = Held(presses, group, [i for i in self.everybody if i not in group])
        closed = {p.contact for p in presses}
        watched = [c for c in self.contacts if c not in closed and self._moves(c)]
        step = mpf("0.05")
        while self.steps < MOST_STEPS:
            self.steps += 1
            slowest = min(group, key=lambda i: abs(self.velocity[i]))
            if abs(self.velocity[slowest]) <= self.set.closed * 10:
                self.velocity[slowest] = mpc(0)
                self.out.duration = self.now
                return
            before = self._saved()
            room = self._ends_in(slowest) * mpf("0.4")
            stop = min(map(self._ends_in, held.free), default=FAR)
            step, grown = self._stepped(held, min(step, room, stop, self.last - self.now), before)
            event = self._first_event(held, watched, before, self._saved(), step)
            passed = step if event is None else event[0]
            self.out.persistent += passed
            self.now += passed
            self.out.duration = self.now
            if event is not None:
                if event[1] is not None:
                    self.out.events.append((self.now, "hit", event[1]))
                    self.out.struck_while_persistent += any(i in group for i in balls_of(event[1]))
                    self._at_once(balls_of(event[1]), event[1])
                return
            if self.now >= self.last:
                return
            if step == stop:
                for i in held.free:
                    if abs(self.velocity[i]) < self.set.closed:
                        self.velocity[i] = mpc(0)
                return
            step = grown
        raise Refused("too many steps under contact forces")

    def _saved(self) -> tuple[list[Vec], list[Vec]]:
        return list(self.place), list(self.velocity)

    def _restore(self, saved: tuple[list[Vec], list[Vec]]) -> None:
        self.place, self.velocity = (list(each) for each in saved)

    def _stepped(
        self, held: Held, step: Number, before: tuple[list[Vec], list[Vec]]
    ) -> tuple[Number, Number]:
        """Take one step with little error, shorter if need be; return it and the next one's."""
        for _ in range(60):
            error = self._extrapolated(held, step)
            if error <= self.set.step_error:
                self._fly(held.free, step)
                return step, step * (2 if error * 1000 < self.set.step_error else 1)
            self._restore(before)
            step /= 2
        raise Refused("no step is short enough under contact forces")

    def _extrapolated(self, held: Held, step: Number) -> Number:
        """Step the group by midpoint rules of ever more substeps, and return the error."""
        with mp.workdps(WORK):
            start = [x for i in held.group for x in (self.place[i], self.velocity[i])]
            slope = self._rates(held, start)
            row: list[list[Vec]] = []
            for k in range(1, 13):
                last, row = row, [self._midpoint(held, start, slope, step, 2 * k)]
                for m, older in enumerate(last, start=1):
                    ratio = (mpf(k) / (k - m)) ** 2 - 1
                    newer = row[-1]
                    row.append([a + (a - b) / ratio for a, b in zip(newer, older, strict=True)])
                error = max(map(abs, map(mp.fsub, row[-1], row[-2]))) if k > 2 else FAR
                if error <= self.set.step_error:
                    break
            self._put(held, row[-1])
            return error

    def _midpoint(
        self, held: Held, start: list[Vec], slope: list[Vec], step: Number, count: int
    ) -> list[Vec]:
        h = step / count
        last, now = start, [a + h * b for a, b in zip(start, slope, strict=True)]
        for _ in range(count - 1):
            rates = self._rates(held, now)
            last, now = now, [a + 2 * h * b for a, b in zip(last, rates, strict=True)]
        rates = self._rates(held, now)
        return [(a + b + h * c) / 2 for a, b, c in zip(last, now, rates, strict=True)]

    def _put(self, held: Held, state: list[Vec]) -> None:
        for i, place, velocity in zip(held.group, state[::2], state[1::2], strict=True):
            self.place[i], self.velocity[i] = place, velocity

    def _rates(self, held: Held, state: list[Vec]) -> list[Vec]:
        self._put(held, state)
        acceleration, _, _ = self._forces(held.presses)
        return [x for i in held.group for x in (self.velocity[i], acceleration[i])]

    def _measures(
        self, held: Held, watched: list[Contact]
    ) -> Iterator[tuple[Callable[[], Number], Contact | None]]:
        """Yield what ends a step where it falls through zero: forces, slips, and gaps."""
        for k, p in enumerate(held.presses):
            yield partial(lambda k: self._forces(held.presses)[1][k], k), None
            if p.slides:
                yield partial(lambda p: p.slides * self._slip(p.contact), p), None
        for c in watched:
            yield partial(self._gap, c), c

    def _first_event(
        self,
        held: Held,
        watched: list[Contact],
        before: tuple[list[Vec], list[Vec]],
        after: tuple[list[Vec], list[Vec]],
        step: Number,
    ) -> tuple[Number, Contact | None] | None:
        """Find what first ends the step, and leave the balls there."""
        found: list[tuple[Number, Contact | None]] = []
        for measure, contact in self._measures(held, watched):
            self._restore(after)
            end = measure()
            self._restore(before)
            start = measure()
            touches = contact is not None and start <= self.set.near
            if contact is not None and touches and self._closing(contact) > self.set.closed:
                found.append((mpf(0), contact))
            elif end < -1e-22:  # What touches and opens may close again within the step.
                found.append((self._crossing(measure, held, before, step), contact))
            elif contact is not None and not touches and end < FAR:
                closing = self._closing(contact)
                self._restore(after)
                opening = -self._closing(contact)
                middle = (start + end) / 2 - (closing + opening) * step / 8
                if closing > 0 and opening > 0 and middle < min(start, end) / 10:
                    raise Refused("a graze under contact forces")
        self._restore(after)
        if not found:
            return None
        first = min(found, key=lambda one: one[0])
        self._go(held, before, first[0])
        return first

    def _go(self, held: Held, before: tuple[list[Vec], list[Vec]], dt: Number) -> None:
        self._restore(before)
        self._extrapolated(held, dt)
        self._fly(held.free, dt)

    def _crossing(
        self,
        measure: Callable[[], Number],
        held: Held,
        before: tuple[list[Vec], list[Vec]],
        step: Number,
    ) -> Number:
        """Return where within the step the measure falls through zero.

        A gap that is zero and opens is looked at from a moment on at which it is open.
        """

        def at(dt: Number) -> Number:
            self._go(held, before, dt)
            return measure()

        self._restore(before)
        low, height = mpf(0), measure()
        if height <= self.set.near:
            opened = (step / 2**k for k in range(1, 60))
            low = next((dt for dt in opened if at(dt) > self.set.near), mpf(0))
            height = at(low)
        if height <= 0:
            return mpf(0)
        between = (low, step)
        return mp.findroot(
            at, between, solver="illinois", tol=mpf("1e-26"), maxsteps=80, verify=False
        )


def hard_run(
    scene: Scene, settings: Settings = FINE, nudges: Sequence[Vec] | None = None
) -> HardRun:
    """Play the scene from its velocities, in many digits."""
    with mp.workdps(settings.digits):
        run = HardReference(scene, settings, nudges).run()
    for ball, end in zip(scene.balls, run.final, strict=True):
        if scene.table is not None and not scene.table.contains(float(end.real), float(end.imag)):
            raise Refused(f"ball {ball.id} ended off the table: a hit was passed over")
    for (a, p), (b, q) in combinations(zip(scene.balls, run.final, strict=True), 2):
        if float(abs(p - q)) < (a.radius + b.radius) * (1.0 - 1e-9):
            raise Refused(f"balls {a.id} and {b.id} overlap at the end: a hit was passed over")
    return run


def off(a: HardRun, b: HardRun) -> float:
    """Return how far apart (m) two runs end."""
    return max(float(abs(p - q)) for p, q in zip(a.final, b.final, strict=True))
