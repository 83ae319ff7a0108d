"""A group of balls moves in pieces; a mode says what presses, slides, slips and rolls.

The mode is a complementarity problem: of each force and of what it holds, one is at its bound.
Relaxing the contacts in turn (Gauss and Seidel) finds what is at its bound, and a linear system
then gives the forces. A piece is one step of the method of Runge, Kutta and Nystroem; it ends where
a force, a slip, a speed, or what static friction has left, falls to 0.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import INF, length_of
from pool_pymunk.core.persistent.gathering import Gathering
from pool_pymunk.core.persistent.linear import System
from pool_pymunk.core.persistent.member import FREE, REST, ROLL, SLIP, Member, Rates, State
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.persistent.touch import ALONG, INTO, NORMAL, Touch

EXACT: Final = 0.1  # of the tolerance; pieces deviate by less
LATE: Final = 0.1  # of that; friction that is spared later than by bounces moves a ball by less
WEAK: Final = 1e-9  # of the surface's pull; accelerations that are not larger are none
EXACTLY: Final = 1e-3  # of what is weak; forces that miss less have only their rounding
SLOWLY: Final = 0.03  # Factors are found anew if they take away less of what forces still miss.
RIDGE: Final = 1e-10  # Redundant forces are those of least norm, to such a share.
ROUNDS: Final = 20
EXCHANGES: Final = 12
FEW: Final = 12  # Groups of more contacts have FEW_ROUNDS.
FEW_ROUNDS: Final = 4
SWEEPS: Final = 4
GROWTH: Final = 4.0
NEVER: Final = -1
NOTHING: Final = [INF, INF, INF, INF]  # ends a mode
# how a touch fits its mode
FITS: Final = 0
CLOSES: Final = 1  # without a force
PULLS: Final = 2
SLIDES: Final = 3  # though friction was to hold it
TURNS: Final = 4
HAS_TURNED: Final = 5  # against the friction that is at its bound
STRIKES: Final = 16  # a contact
NEARLY: Final = 1e-6
ALIKE: Final = 1.0 - 1e-9  # times the hardest hit; harder ones are equally hard
SHORT: Final = 10.0  # of the shortest pieces; what stops within one moves 4e-9 radii at most
FINE: Final = 0.01  # of the shortest piece that is tried; where a mode ends is found as finely
CLOSING: Final = 100  # rounds at most, in which gaps close
LEAST_CLOSING: Final = 2  # After so many it goes on if a round leaves less than this share.
SLOW_CLOSING: Final = 0.9
CLOSED: Final = 1e-13  # radii, or of the usual speed; what is less is rounding


@final
class Unknown:
    """An unknown force of the linear system is of a ``kind``, and has a row there."""

    __slots__ = ("kind", "rate", "row", "touch")

    def __init__(self, touch: Touch, kind: int, row: int) -> None:
        self.touch = touch
        self.kind = kind
        self.row = row
        self.rate = 0.0  # m/s^2; what it is to bring to 0


@final
class Group(Gathering):
    """A group has members and touches, and plays a piece at a time from ``began`` (s).

    ``tolerance`` (m) is what may go unseen. ``fell`` is the number of the measure that ends it.
    """

    def __init__(
        self, members: list[Member], touches: list[Touch], now: float, scale: Scale
    ) -> None:
        super().__init__(members, touches, now, scale)
        self.tolerance = EXACT * scale.tolerance
        self.longest = scale.first
        self.least = FINE * scale.least  # s; its mode ends no sooner
        self.changed = -INF  # s; when its mode has changed last
        self.fell = NEVER
        self.is_even = True
        self.mode = list[int]()  # of members and touches
        self.unknowns: list[Unknown] = []
        self.system: System | None = None  # of the forces in this mode, at one state of it
        self.before = list[float]()
        self.after = list[float]()
        pull = max([max(each.pull, each.drag) for each in members])
        for one in touches:
            one.look()
            pull = max(pull, abs(one.lift) if one.b is None else 0.0)
        self.weak = WEAK * pull

    def is_still(self, now: float) -> bool:
        """Tell whether the forces hold all its balls in their places, and none bounces unseen."""
        for one in self.touches:
            if one.bounces - now > self.scale.least:
                return False
        for each in self.members:
            if each.phase == FREE and each.slows:
                return False
            if largest(each.rates) > 10.0 * self.weak:
                return False
            speed = max(length_of(each.vx, each.vy), length_of(each.wx, each.wy))
            # No friction of the surface ends the last of the motion of a ball that falls.
            if speed > (self.scale.creep if each.phase == FREE else self.scale.faded):
                return False
        return True

    def lets_rest(self, each: Member) -> bool:
        """Tell whether a ball may rest that hardly moves in a very short piece.

        A ball may roll if its slip turns round, and does not fade although friction could hold it:
        pieces are too long to follow that, and the slip is too small to be seen.
        """
        is_short = self.time <= SHORT * self.scale.least
        if each.phase == SLIP and each.rolls:
            is_short = each.left() * self.time <= self.tolerance and each.slips_on(self.time)
        return is_short and each.hardly_moves(self.time)

    def settles(self, each: Member) -> bool:
        """Tell whether the slip or the speed of a ball has faded after a piece, or nearly so."""
        if each.phase == REST:
            return False
        if self.fell == 4 * len(self.touches) + 2 * each.place + 1:  # It has ended the piece.
            return True
        left = each.left()
        fades = left <= 10.0 * self.scale.none and each.fades_in() < INF
        return left < 0.0 or fades or self.lets_rest(each)

    def has_alone(self, one: Touch) -> bool:
        """Tell whether no other contact of the group has a ball of this one."""
        for other in self.touches:
            if other is not one and (other.has(one.a) or (one.b is not None and other.has(one.b))):
                return False
        return True

    # -- forces --------------------------------------------------------------------------------

    def look(self) -> None:
        """Find normals and slips, and the pushes of the present forces along them."""
        for each in self.members:
            each.fx = each.fy = each.cx = each.cy = 0.0
            each.face()
        for one in self.touches:
            one.look()
            n, t, i = one.n, one.t, one.i
            one.n = one.t = one.i = 0.0
            if n != 0.0:
                one.press(n, t, i)

    def decide(self, now: float, joins: bool) -> bool:
        """Find the mode of the present state, and its forces; tell whether all fits.

        Sides that part or close are no contacts, unless the group ``joins`` them next.
        """
        none = self.scale.none
        for each in self.members:
            each.mode = each.phase
            each.begin()
        self.look()
        for one in self.touches:
            one.closed = joins or (one.later <= now and abs(one.opening) <= 100.0 * self.scale.none)
            if not one.closed or one.softness == 0.0:  # What rests presses on nothing by itself.
                one.press(0.0, 0.0, 0.0)
        fits, tried = False, list[list[int]]()
        rounds = ROUNDS if len(self.touches) <= FEW else FEW_ROUNDS
        for k in range(rounds):
            for each in self.members:
                each.hold(now)
                each.move()
            for _ in range(SWEEPS * (k + 1)):
                for one in self.touches:
                    if one.closed:
                        one.relax(now, sign(one.slip, none), sign(one.roll_in, none))
            self._adopt(joins)
            self.solve()
            fits = self._fits(now) or (k < FEW_ROUNDS and self._exchange(now, tried))
            if fits:
                self._drop_idle(now, joins)
                break
        for each in self.members:
            if each.mode != each.phase:  # It is let go.
                each.phase, each.gx, each.gy = each.mode, each.hx, each.hy
        return fits

    def _drop_idle(self, now: float, joins: bool) -> None:
        """Let contacts without a force be none, if all fits without them, too.

        Whether relaxing finds them is rounding.
        """
        none = [one for one in self.touches if one.on and not self._presses(one, joins)]
        if len(none) == 0:
            return
        for one in none:
            one.on = False
        self.list_unknowns()
        self.solve()
        if not self._fits(now):
            for one in none:
                one.on = True
            self.list_unknowns()
            self.solve()

    def _presses(self, one: Touch, joins: bool) -> bool:
        """Tell whether a force is one, or its sides are joined without."""
        return one.n > self.weak * one.unit or (joins and one.is_dull)

    def goes_on(self, now: float) -> bool:
        """Find the forces of the present state in this mode; tell whether it still fits."""
        for each in self.members:
            each.mode = each.phase
            each.begin()
        self._find_forces()
        return self._fits(now)

    def _adopt(self, joins: bool) -> None:
        """Take the mode of the forces that relaxing has found: which are at their bounds."""
        none = self.scale.none
        for one in self.touches:
            one.on = one.closed and self._presses(one, joins)
            if not one.on:
                one.press(0.0, 0.0, 0.0)
                continue
            one.slides, most = sign(one.slip, none), 0.999999999 * one.mu * one.n
            if one.slides == 0.0 and abs(one.t) > most:
                one.slides = -math.copysign(1.0, one.t)
            one.turns, most = sign(one.roll_in, none), most / GYRATION
            if one.turns == 0.0 and abs(one.i) > most:
                one.turns = -math.copysign(1.0, one.i)
        self.list_unknowns()

    def list_unknowns(self) -> None:
        """List the unknown forces: those that are not at their bounds, if the mode has changed."""
        mode = [each.mode for each in self.members] + [one.mode for one in self.touches]
        if mode == self.mode:
            return
        self.mode, self.unknowns, self.system = mode, [], None
        for one in self.touches:
            if one.on:
                self._hold(one, NORMAL)
                if one.slides == 0.0 and one.mu > 0.0:
                    self._hold(one, ALONG)
                if one.turns == 0.0 and one.wrings and one.a.mode != REST:
                    self._hold(one, INTO)

    def _hold(self, one: Touch, kind: int) -> None:
        self.unknowns.append(Unknown(one, kind, len(self.unknowns)))

    def _find_forces(self) -> None:
        """Find the forces and the rates of a state to which the group has moved."""
        self.look()
        self.solve()

    def solve(self) -> None:
        """Find the forces and the rates of the present state in this mode, from none on.

        They let no gap and no slip change that they are to hold. Factors of the mode serve while
        each round takes away nearly all that is missing (iterative refinement). Forces that are
        redundant are those of least norm.
        """
        system, is_new, missed = self.system, False, INF
        self._free()
        while True:
            misses = self._misses()
            if misses <= EXACTLY * self.weak or (is_new and misses > SLOWLY * missed):
                return
            if system is None or misses > SLOWLY * missed:
                system, is_new, misses = self._find_system(), True, INF
                self.system = self.system or system
            self._press(system)
            missed = misses

    def _misses(self) -> float:
        """Return how fast (m/s^2) a gap or a slip changes at most that a force is to hold."""
        most = 0.0
        for force in self.unknowns:
            force.rate = force.touch.rate(force.kind)
            most = max(most, abs(force.rate))
        return most

    def _press(self, system: System) -> None:
        """Add the forces that stop what is missing, and find the rates by them."""
        for force in self.unknowns:
            system.rows[force.row].right = -force.rate
        system.solve()
        for force in self.unknowns:
            force.touch.add(force.kind, system.solution(force.row) * force.touch.unit)
        for each in self.members:
            each.move()

    def _free(self) -> None:
        """Find the rates without forces."""
        for one in self.touches:
            one.n = one.t = one.i = 0.0
        for each in self.members:
            each.fx = each.fy = each.cx = each.cy = 0.0
            each.move()

    def _find_system(self) -> System:
        """Find the factors of how each force changes what all are to hold; there are none then."""
        self._free()
        self._misses()
        acting = [list[Unknown]() for _ in self.members]  # on each
        for force in self.unknowns:
            for member in force.touch.members:
                acting[member.place].append(force)
        system = System(len(self.unknowns))
        for force in self.unknowns:
            one = force.touch
            one.add(force.kind, one.unit)
            one.move()
            for member in one.members:
                for other in acting[member.place]:
                    if member is one.a or not other.touch.has(one.a):
                        gain = other.touch.rate(other.kind) - other.rate
                        gain = gain + RIDGE if other is force else gain
                        system.rows[other.row].put(force.row, gain)
            one.press(0.0, 0.0, 0.0)
            one.move()
        system.decompose()
        return system

    def _fits(self, now: float) -> bool:
        """Tell whether no force pulls, friction holds what it should, and nothing closes."""
        for one in self.touches:
            if self._misfit_of(one) != FITS:
                return False
        for each in self.members:
            if not self._fits_member(each, now):
                return False
        return True

    def _misfit_of(self, one: Touch) -> int:
        """Tell whether a force pulls, or friction does not hold what it should, or has turned."""
        none, slack = self.scale.none, self.weak * one.unit
        if not one.on:
            return CLOSES if one.closed and one.rate(NORMAL) < -4.0 * self.weak else FITS
        if one.n < -slack:
            return PULLS
        most = one.mu * one.n + slack
        if one.slides == 0.0 and abs(one.t) > most:
            return SLIDES
        if one.turns == 0.0 and abs(one.i) > most / GYRATION:
            return TURNS
        slides = sign(one.slip, none)
        if slides == 0.0 and one.slides != 0.0 and one.rate(ALONG) * one.slides < -self.weak:
            return HAS_TURNED
        is_other = slides != 0.0 and slides != one.slides
        return HAS_TURNED if is_other or sign(one.roll_in, none) * one.turns < 0.0 else FITS

    def _fits_member(self, each: Member, now: float) -> bool:
        """Tell whether static friction holds a ball, or what it lets go moves on."""
        if each.mode == each.phase:
            return each.spare(now) >= -self.weak
        x, y = each.ax, each.ay
        if each.mode == SLIP:
            x, y = x - each.bx, y - each.by
        return x * each.hx + y * each.hy >= -self.weak

    def _exchange(self, now: float, tried: list[list[int]]) -> bool:
        """Exchange a force and what it holds where they do not fit, one after another.

        One of both is free then that was at its bound, and the other one is not. Redundant forces
        may need it: those of least norm can lie beyond a bound. It tells whether all fits, and ends
        where it comes to a mode that was ``tried``.
        """
        for _ in range(EXCHANGES):
            if not (self._exchange_at_touch() or self._exchange_at_member(now)):
                return False
            self.list_unknowns()
            if self.mode in tried:
                return False
            tried.append(self.mode)
            self.solve()
            if self._fits(now):
                return True
        return False

    def _exchange_at_touch(self) -> bool:
        """Change the mode of the first touch that does not fit; tell whether there is one."""
        for one in self.touches:
            misfit = self._misfit_of(one)
            if misfit == FITS:
                continue
            if misfit == PULLS:
                one.on = False
                one.press(0.0, 0.0, 0.0)
            elif misfit == SLIDES:
                one.slides = -math.copysign(1.0, one.t)
            elif misfit == TURNS:
                one.turns = -math.copysign(1.0, one.i)
            else:
                one.on = True
                one.slides = sign(one.slip, self.scale.none)
                one.turns = sign(one.roll_in, self.scale.none)
            return True
        return False

    def _exchange_at_member(self, now: float) -> bool:
        """Let static friction hold the first ball that does not fit, or let it go."""
        for each in self.members:
            if not self._fits_member(each, now):
                if each.mode != each.phase:
                    each.mode = each.phase
                    each.face()
                else:
                    each.hold(now)
                return True
        return False

    # -- changes of velocity -------------------------------------------------------------------

    def strike(self) -> bool:
        """Let sides that close hit each other without bounces, the hardest first, nearly all.

        So they do by the law, where each hit makes others close. It tells whether any has closed.
        Hits that are equally hard come at once, each by its share: their order is rounding.
        """
        enough = 0.0
        for _ in range(STRIKES * len(self.touches)):
            most = least = max(enough, self.scale.noise)
            for one in self.touches:
                most = max(most, one.hardness)
            if most == least:
                break
            enough = most * NEARLY if enough == 0.0 else enough
            hardest = [one for one in self.touches if one.hardness > ALIKE * most]
            share = 1.0 / len(hardest)
            for one, (n, t, i) in zip(hardest, [one.impulses() for one in hardest]):
                one.strike(share * n, share * t, share * i)
        return enough > 0.0

    def join(self) -> None:
        """Take away the speeds at which sides part or close, by impulses with their friction.

        They are the forces of the present mode that would change velocities as much in 1 s. Where
        energy would grow, as in a corner so rough that it jams a ball, there are none.
        """
        before, states = self.energy, [each.state for each in self.members]
        system = self.system or self._find_system()
        self._free()
        for each in self.members:
            each.second = each.rates
        for force in self.unknowns:
            force.rate = force.touch.speed(force.kind)
        self._press(system)
        for each in self.members:
            ax, ay, bx, by = each.second
            each.vx, each.vy = each.vx + each.ax - ax, each.vy + each.ay - ay
            each.wx, each.wy = each.wx + each.bx - bx, each.wy + each.by - by
        if self.energy > before:
            for each, state in zip(self.members, states):
                each.x, each.y, each.vx, each.vy, each.wx, each.wy = state
        else:
            for each in self.members:
                each.is_struck = each.is_struck or each.rates != each.second
            for one in self.touches:
                x, y = one.struck
                p, q = one.push
                one.struck = x + p, y + q
        self._free()

    def close(self) -> None:
        """Close the gaps that a step has left open by its error, until they are rounding.

        In a large group this may be slow, or not go on at all.
        """
        widest = INF
        for k in range(CLOSING):
            was, widest = widest, 0.0
            for one in self.touches:
                if one.on:
                    one.look()
                    gap, opening = one.gap_beyond, one.opening
                    if gap < INF:
                        one.shift(-gap, -opening)
                        share = max(abs(gap) / one.a.ball.radius, abs(opening) / self.scale.speed)
                        widest = max(widest, share)
            if widest <= CLOSED or (k >= LEAST_CLOSING and widest > SLOW_CLOSING * was):
                break
        for each in self.members:
            if each.phase == ROLL:
                each.wx, each.wy = each.vx, each.vy

    # -- pieces --------------------------------------------------------------------------------

    def play(self, now: float) -> None:
        """Play a piece; the present state, whose forces are known, becomes that at its end."""
        self.began, self.system = now, None
        for each in self.members:
            each.mode = each.phase
            each.begin()
        self.solve()
        h = self._first_length(now)
        self._spare(h)
        for each in self.members:
            each.first = each.rates
        for one in self.touches:
            one.at_start, one.kept = one.push, one.struck
        self.before = self._measure(now)
        while True:
            off = self.step(h)
            if off <= 1.0 or h <= self.scale.least:
                break
            h = max(h * max(0.1, 0.9 / off ** (1.0 / 3.0)), self.scale.least)
        self.longest = h * min(GROWTH, 0.9 / max(off, 1e-9) ** (1.0 / 3.0))
        self.after = self._measure(now + h)
        self.fell = self._first_to_fall()
        if self.fell >= 0 and h > self.least:
            h = self._locate(h, now)
        self.time = h
        self.halts = h >= self.until - now
        self._add_no_energy()

    def _first_length(self, now: float) -> float:
        """Return how long (s) a piece is at first; what fades, or is awaited, ends it."""
        h = self.longest
        for each in self.members:
            fades = each.fades_in()
            if 0.0 < fades < INF:
                h = min(h, 1.01 * fades)
            if each.spared > 0.0:
                h = min(h, self._spares_in(each.spared, each.drag))
        for one in self.touches:
            if one.spared > 0.0:
                spares = one.spares_for
                h = min(h, self._spares_in(spares, one.mu * one.n / one.unit))
            if one.bounces > now:
                h = min(h, one.bounces - now)
        return min(max(h, self.least, self.scale.least), self.until - now)

    def _spares_in(self, spared: float, rate: float) -> float:
        """Return how long (s) a piece may be in which friction (m/s^2) is spared for a time (s).

        A part of it acts until then, and moves a ball by what may go unseen.
        """
        speed = rate * spared
        return max(spared, 2.0 * LATE * self.tolerance / speed) if speed > 0.0 else INF

    def _spare(self, h: float) -> None:
        """Let friction in a piece be less by what bounces that are left out spare of it."""
        are_new = [one.slacken(h) for one in self.touches if one.mu > 0.0]
        are_new += [each.slacken(h) for each in self.members]
        if any(are_new):
            self.solve()

    def states_at(self, t: float) -> list[State]:
        """Play up to a time (s) of the piece, look, and play to its end again."""
        if self.sleeps or t >= self.began + self.time:
            return [each.state for each in self.members]
        if t <= self.began:
            return [each.start for each in self.members]
        self.step(t - self.began)
        self._add_no_energy()
        states = [each.state for each in self.members]
        self.step(self.time)
        self._add_no_energy()
        return states

    def step(self, h: float) -> float:
        """Go on from the beginning for a time (s); return how many times too far off that is."""
        self.played = h
        for one in self.touches:
            one.struck = one.kept
        for each in self.members:
            each.hx, each.hy = each.gx, each.gy
            each.advance(h, 0.5, each.first, each.first)
        self._find_forces()
        for one in self.touches:
            one.halfway = one.push
        jump = 0.0
        for each in self.members:
            each.second = each.rates
            jump = max(jump, largest(difference(each.second, each.first)))
        self.is_even = jump * h * h <= 1e-6 * self.tolerance
        off = 0.0
        if self.is_even:
            for each in self.members:
                each.advance(h, 1.0, each.second, each.second)
        else:
            off = self._rest_of_step(h)
        self.close()
        self._find_forces()
        return off

    def go_to(self, t: float) -> None:
        super().go_to(t)
        self._add_no_energy()

    def _add_no_energy(self) -> None:
        """Take away what errors of a piece have added to the energy.

        They add much where no mode fits, as in a corner so rough that it jams a ball.
        """
        if self.adds_no_energy():
            self._find_forces()

    def _rest_of_step(self, h: float) -> float:
        for each in self.members:
            each.advance(h, 0.5, each.second, each.first)
        self._find_forces()
        for one in self.touches:
            x, y = one.halfway
            p, q = one.push
            one.halfway = (x + p) / 2.0, (y + q) / 2.0
        for each in self.members:
            each.third = each.rates
            each.advance(h, 1.0, each.third, each.third)
        self._find_forces()
        jump = error = 0.0
        for each in self.members:
            a, b, c, d = each.first, each.second, each.third, each.rates
            each.advance(h, 1.0, mean(a, b, c, d, 2.0, 1.0), mean(a, b, c, d, 1.0, 0.0))
            jump = max(jump, length_of(d[0] - a[0], d[1] - a[1]))
            error = max(error, largest(difference(c, b)))
        return max(0.025 * jump * h, 0.1 * error) * h / self.tolerance

    # -- what ends a piece ---------------------------------------------------------------------

    def _measure(self, t: float) -> list[float]:
        """Return the numbers that end the mode where they fall to 0."""
        found = list[float]()
        for one in self.touches:
            if not one.on or one.softness == 0.0:
                found += NOTHING
                continue
            slides, turns, most = INF, INF, one.mu * one.n
            if one.mu > 0.0:
                held = (most - abs(one.t)) / one.unit
                slides = one.slides * one.slip if one.slides != 0.0 else held
            if one.wrings and one.turns != 0.0 and (one.a.phase >= SLIP or one.drift != 0.0):
                turns = one.turns * one.roll_in
            elif one.wrings and one.turns == 0.0 and one.a.phase >= SLIP:
                turns = (most / GYRATION - abs(one.i)) / one.unit
            found += [one.n / one.unit, slides, turns, one.room]
        for each in self.members:
            found += [each.spare(t), each.left()]
        return found

    def _slack(self, which: int) -> float:
        """Return how far below 0 a measure is where it ends the mode."""
        k, kind = which // 4, which % 4
        if k >= len(self.touches):
            return self.scale.faded if (which - 4 * len(self.touches)) % 2 == 1 else 2.0 * self.weak
        if kind == 3:
            return 1e-10 * self.tolerance
        one = self.touches[k]
        is_speed = (kind == 1 and one.slides != 0.0) or (kind == 2 and one.turns != 0.0)
        return self.scale.faded if is_speed else 2.0 * self.weak

    def _first_to_fall(self) -> int:
        soonest, found = INF, NEVER
        for q in range(len(self.after)):
            if self.after[q] < 0.0 and self.after[q] < -self._slack(q):
                start = max(self.before[q], 0.0)
                when = start / (start - self.after[q])
                if when < soonest or (when == soonest and self.after[q] < self.after[found]):
                    soonest, found = when, q
        return found

    def fallen(self) -> list[Touch]:
        """Return the contacts that end as the first one does; which of two falls is rounding."""
        deepest = self.after[self.fell]
        return [one for k, one in enumerate(self.touches) if self.after[4 * k] <= 0.5 * deepest]

    def _locate(self, h: float, now: float) -> float:
        """Find when (s) a measure falls to 0 within a piece (Illinois); play until then.

        Which one it is may be rounding, so all are known at both ends of where it falls.
        """
        which, finest = self.fell, self.least
        low, high, at_low, at_high = 0.0, h, self.before, self.after
        share_low, share_high, was_high = 1.0, 1.0, True
        t = h
        for _ in range(50):
            m_low, m_high, slack = max(at_low[which], 0.0), at_high[which], self._slack(which)
            if m_high >= -4.0 * slack or high - low <= FINE * self.scale.least or high <= finest:
                break
            m_low, m_high = share_low * m_low, share_high * m_high
            t = max(low + (high - low) * (m_low + 2.0 * slack) / (m_low - m_high), finest)
            t = min(t, high)
            self.step(t)
            self.after = self._measure(now + t)
            falls = self._first_to_fall()
            if falls >= 0:
                which, high, at_high, share_high = falls, t, self.after, 1.0
                share_low /= 2.0 if was_high else 1.0
            else:
                low, at_low, share_low = t, self.after, 1.0
                share_high /= 1.0 if was_high else 2.0
            was_high = falls >= 0
        if t != high:
            self.step(high)
        self.fell, self.after = which, at_high
        return high


def sign(x: float, none: float) -> float:
    """Return 1 or -1, or 0 for a speed (m/s) that is none."""
    return 0.0 if abs(x) <= none else (1.0 if x > 0.0 else -1.0)


def difference(a: Rates, b: Rates) -> Rates:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]


def largest(a: Rates) -> float:
    """Return the largest size of some rates."""
    return max(length_of(a[0], a[1]), length_of(a[2], a[3]))


def mean(a: Rates, b: Rates, c: Rates, d: Rates, middle: float, last: float) -> Rates:
    """Return the mean rates of a step, with these weights."""
    total = 1.0 + 2.0 * middle + last
    return (
        (a[0] + middle * (b[0] + c[0]) + last * d[0]) / total,
        (a[1] + middle * (b[1] + c[1]) + last * d[1]) / total,
        (a[2] + middle * (b[2] + c[2]) + last * d[2]) / total,
        (a[3] + middle * (b[3] + c[3]) + last * d[3]) / total,
    )
