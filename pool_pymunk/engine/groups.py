"""Groups of balls in persistent contact move in pieces, by the forces that keep their gaps closed.

The engine gives each ball of a group two short paths for a piece. What ends the piece is due like
the end of any path: a force, a slip or a speed falls to zero, or a side ends. A hit on a ball of a
group takes the group apart; what presses after it is a group again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from copy import copy
from itertools import accumulate
from operator import mul
from typing import TYPE_CHECKING

from pool_pymunk.engine.due import Hit, What
from pool_pymunk.engine.recorder import Begun, Motions, Persisted
from pool_pymunk.physics import pieces
from pool_pymunk.physics.contact import NO_BALL, Contact, Pair, Vector, closing_speed
from pool_pymunk.physics.path import Path, motion_at, standing
from pool_pymunk.physics.persistent import UNSEEN, persists, pressing_of_balls, pressing_of_wall
from pool_pymunk.physics.pieces import Piece
from pool_pymunk.physics.pressed import (
    BALL,
    NEAR,
    REST,
    ROLL,
    begin,
    decide,
    find_forces,
    opening,
    press_of,
    set_scale,
)
from pool_pymunk.physics.pressed import part_of as part_of_press
from pool_pymunk.physics.sides import shape_of

if TYPE_CHECKING:
    from pool_pymunk.engine.contacts import ContactEngine

Totals = list[list[float]]

# s; the first piece of a group is no longer, and the next ones are up to three times as long. Where
# a contact has just opened it is shorter, because the gap is still narrower than pieces deviate.
FIRST, OPENED = 5e-5, 1e-6
# After this many changes of the mode at one instant, or groups that begin at it for each ball, a
# group has no forces for a moment.
MOST_CHANGES = 50
STILL = 1e-10  # of a speed that friction gives within a radius: slower sides do not part or close
DEAD = Pair(1.0, 1.0, restitution=0.0, friction=0.0)  # What does not persist with it never does.
NEVER = -math.inf, 0.0
# Once a ball has had more than FEW hits, each less than AGO (s) after the one before, each further
# one lets GROWTH times as much go unseen, for MOST hits at most.
GROWTH, FEW, MOST, AGO = 1.3, 30, 50, 0.05
WEAR = list(accumulate([GROWTH] * MOST, mul, initial=1.0))
SHORTLY = 1e-3  # of the time to a hit; a piece is cut so much before it


class Group:
    """A group is the balls that contacts in persistent contact join, and plays them in pieces."""

    def __init__(self, engine: ContactEngine, hits: Sequence[Hit], balls: Sequence[int]) -> None:
        self.hits, self.balls = list(hits), list(balls)
        self.number = {i: k for k, i in enumerate(balls)}
        self.state: list[float] = []
        for i in balls:
            self.state += engine.groups.state_of(i)
        motions: Motions = {}
        for i in balls:
            x, y, vx, vy, _, _ = self.of(i)
            motions[i] = x, y, vx, vy
        self.contacts = [engine.contact(hit, motions) for hit in hits]
        rows = [self._row(engine, *pair) for pair in zip(hits, self.contacts, strict=True)]
        masses, radii = ([of[i] for i in self.balls] for of in (engine.masses, engine.radii))
        self.press = press_of(engine.surface, masses, radii, rows)
        self.press.small[2] = engine.groups.coarser
        self.total = [[0.0] * 3 for _ in hits]
        self.began, self.changes, self.longest = engine.now, 0, FIRST
        self.piece = Piece(self.state, 0.0, 0.0, FIRST, -1, False)

    def of(self, i: int) -> list[float]:
        """Return x, y (m), vx, vy, wx, wy (m/s) of a ball at the beginning of the piece."""
        p = 6 * self.number[i]
        return self.state[p : p + 6]

    def _row(self, engine: ContactEngine, hit: Hit, contact: Contact) -> tuple[object, ...]:
        """Return what a press takes of a contact."""
        i, mu = self.number[contact.a], contact.pair.friction
        if contact.b != NO_BALL:
            touching = engine.radii[contact.a] + engine.radii[contact.b]
            return i, self.number[contact.b], BALL, mu, [touching]
        (x, y), r = self.of(contact.a)[:2], engine.radii[contact.a]
        what, shape = shape_of(engine.walls[hit.j].nearest(x, y, r), x, y, r)
        return i, -1, what, mu, shape

    @property
    def end(self) -> float:
        """The time (s) at which the present piece ends."""
        return self.began + float(self.piece.time)

    def begun(self, state: list[float], mode: tuple[list[int], ...]) -> Begun:
        """Return what is noted of the present piece, which began in this state and mode."""
        piece, balls = self.piece, tuple(self.balls)
        return Begun(
            self.began, self.end, balls, self.contacts, self.press, state, mode,
            piece.fell, piece.faded,
        )  # fmt: skip

    def is_on(self, hit: Hit) -> bool:
        """Tell whether a contact presses."""
        return hit in self.hits and bool(self.press.on[self.hits.index(hit)])

    def state_at(self, t: float, total: Totals | None = None) -> list[float]:
        """Return the state at a time (s) within the piece; ``total`` becomes the impulses."""
        total = [[0.0] * 3 for _ in self.hits] if total is None else total
        if t >= self.end:
            total[:] = self.total
            return list(self.piece.end)
        if t <= self.began:
            total[:] = [[0.0] * 3 for _ in self.hits]
            return list(self.state)
        press = self.press
        rate, forces = list(press.rate), [list(force) for force in press.force]
        find_forces(press, self.state)
        state, _ = pieces.step(press, self.state, t - self.began, total)
        pieces.recall(press, rate, forces)
        return list(state)

    def cut(self, t: float) -> None:
        """End the piece at a time (s); its impulses are those until then."""
        total = [[0.0] * 3 for _ in self.hits]
        self.state[:] = self.state_at(t, total)
        self.total[:] = total

    def open(self, gap: float) -> None:
        """Move the balls away from a wall that one of them touches, or from each other (m)."""
        if gap == 0.0:
            return
        walls = [c.point for c in self.contacts if c.b == NO_BALL]
        places = [self.of(i)[:2] for i in self.balls]
        middle = [sum(place[k] for place in places) / len(places) for k in (0, 1)]
        x, y = walls[0] if walls else middle
        share = gap / (2.0 * min(self.press.radius))
        for p in range(0, len(self.state), 6):
            self.state[p] += share * (self.state[p] - x)
            self.state[p + 1] += share * (self.state[p + 1] - y)

    def tangent(self, i: int, t: float) -> Path:
        """Return a path with the exact motion and acceleration of a ball at a time (s)."""
        press, p = self.press, 6 * self.number[i]
        rate, forces = list(press.rate), [list(force) for force in press.force]
        s = self.state_at(t)
        find_forces(press, s)
        x, y, vx, vy, wx, wy = s[p : p + 6]
        ax, ay = press.rate[p + 2 : p + 4]
        pieces.recall(press, rate, forces)
        return Path(t, x, y, vx, vy, ax, ay, math.inf, False, wx, wy)

    def path(self, i: int, is_second: bool) -> Path | None:
        """Return the path of a ball in a half of the piece; None for one that rests."""
        k, s, end, h = self.number[i], self.state, self.piece.end, self.piece.time
        if self.press.phase[k] == REST:
            return None
        p, middle = 6 * k, h / 2.0
        x, y, vx, vy, wx, wy = s[p : p + 6]
        ax, ay, bx, by = pieces.halves(self.press, s, end, h, k)
        if not is_second:
            return Path(self.began, x, y, vx, vy, ax, ay, self.began + middle, False, wx, wy)
        x, y = x + middle * (vx + middle * ax / 2.0), y + middle * (vy + middle * ay / 2.0)
        vx, vy = vx + middle * ax, vy + middle * ay
        if self.press.phase[k] == ROLL:
            wx, wy = vx, vy
        else:
            wx, wy = (wx + end[p + 4]) / 2.0, (wy + end[p + 5]) / 2.0
        return Path(self.began + middle, x, y, vx, vy, bx, by, self.end, False, wx, wy)


class Groups:
    """These are the groups of an engine."""

    def __init__(self, engine: ContactEngine) -> None:
        self.engine = engine
        self.coarser = 1.0  # so many times as much is left out
        self.of: dict[int, Group] = {}
        self.persisted: dict[Hit, Persisted] = {}
        self.met: dict[int, tuple[float, int]] = {}
        self.begun = (-math.inf, 0)  # when (s) groups began last, and how many of them
        self.waits: dict[Hit, float] = {}  # s; until then these contacts have no forces
        self.waited: dict[Hit, tuple[float, float]] = {}  # s; until when they had none, how long
        self.loose: dict[int, None] = {}  # balls of groups that were taken apart

    # -- what the engine asks ----------------------------------------------------------------------

    def state_of(self, i: int) -> list[float]:
        """Return x, y (m), vx, vy, wx, wy (m/s) of a ball now."""
        engine, group = self.engine, self.of.get(i)
        if group is not None:
            p = 6 * group.number[i]
            return group.state_at(engine.now)[p : p + 6]
        path = engine.paths[i]
        return [*motion_at(path, engine.now), *engine.surface.roll(path, engine.now)]

    def takes(self, hit: Hit, t: float) -> bool:
        """Tell whether a hit at ``t`` (s) is no hit: a contact persists, or is predicted later."""
        groups = [self.of[i] for i in hit.balls if i in self.of]
        if any(group.is_on(hit) or self._is_idle(hit, group) for group in groups):
            return True
        if (until := self.waits.get(hit, -math.inf)) > self.engine.now:
            self.engine.push(until, What("press", hit.i))
            return True
        return self.look_at(hit) or self.cuts(hit, t) or (t <= self.engine.now and self.rubs(hit))

    def persists_now(self, hit: Hit, motions: Motions) -> bool:
        """Tell whether two sides are in persistent contact from now on, by their present paths.

        The pair is asked only where its restitution matters.
        """
        engine = self.engine
        contact = engine.contact(hit, motions, DEAD)
        parting = -closing_speed(contact, self._velocities(contact))
        noise = engine.noise(contact.balls)
        if parting < -noise:
            return False
        return self._persists(hit, motions, parting if parting > noise else 0.0)

    def _persists(self, hit: Hit, motions: Motions, parting: float) -> bool:
        """Tell whether two sides that part at this speed (m/s) stay in contact, to the eye.

        What presses them now presses them at the end of a slip, too, if it ends before the bounces.
        """
        engine, contact, now = self.engine, self.engine.contact(hit, motions, DEAD), self.engine.now
        paths = [self._path(i) for i in contact.balls]
        pressing = pressing_of(contact, paths, now)
        radius = min(engine.radii[i] for i in contact.balls) * self.wear(hit)
        if parting <= 0.0 or not persists(parting, pressing, DEAD.restitution, radius):
            return parting <= 0.0 < pressing
        e = engine.contact(hit, motions).pair.restitution
        if not persists(parting, pressing, e, radius):
            return False
        bounces = 2.0 * parting / (pressing * (1.0 - e))
        soonest = min(path.end if not path.slows else math.inf for path in paths)
        if soonest >= now + bounces or any(i in self.of for i in contact.balls):
            return True
        then = [engine.surface.then(path) if path.end == soonest else path for path in paths]
        later = [
            path or standing(soonest, old.x, old.y) for path, old in zip(then, paths, strict=True)
        ]
        goes = {
            i: motion_at(path, soonest)[2:] for i, path in zip(contact.balls, later, strict=True)
        }
        parting = max(-closing_speed(contact, goes), 0.0)
        return persists(parting, pressing_of(contact, later, soonest), e, radius)

    def wear(self, hit: Hit) -> float:
        """Return how many times as much as UNSEEN the bounces of this contact may be."""
        many = max(self.met.get(i, (0.0, 0))[1] for i in hit.balls)
        return self.coarser * WEAR[min(max(many - FEW, 0), MOST)]

    def note_hit(self, hit: Hit) -> None:
        """Count a hit of its balls."""
        now = self.engine.now
        for i in hit.balls:
            t, many = self.met.get(i, (-math.inf, 0))
            self.met[i] = (now, many + 1 if now - t < AGO else 1)

    def _path(self, i: int) -> Path:
        """Return a path with the exact motion of a ball now; those of groups are mean ones."""
        group, engine = self.of.get(i), self.engine
        return engine.paths[i] if group is None else group.tangent(i, engine.now)

    def rubs(self, hit: Hit) -> bool:
        """Tell whether two sides that touch close no faster than rounding explains."""
        engine = self.engine
        motions = engine.motions([hit])
        contact = engine.contact(hit, motions, DEAD)
        closing = closing_speed(contact, self._velocities(contact))
        return engine.is_closed(hit, motions) and closing <= engine.noise(contact.balls)

    def _velocities(self, contact: Contact) -> dict[int, Vector]:
        motions = {i: self.engine.motion(i) for i in contact.balls}
        return {i: (vx, vy) for i, (_, _, vx, vy) in motions.items()}

    def look_at(self, hit: Hit) -> bool:
        """Look whether two sides touch that persist from now on: a group begins at this instant."""
        engine = self.engine
        if hit.kind == "wall" and engine.walls[hit.j].is_pocket:
            return False
        motions = engine.motions([hit])
        if engine.is_closed(hit, motions) and self.persists_now(hit, motions):
            engine.push(engine.now, What("press", hit.i))
            return True
        return False

    def _is_idle(self, hit: Hit, group: Group) -> bool:
        """Tell whether two sides of a group touch, but have no force and do not visibly move."""
        if hit not in group.hits:
            return False
        engine = self.engine
        motions = engine.motions([hit])
        contact = engine.contact(hit, motions)
        speed = closing_speed(contact, self._velocities(contact))
        radius = min(engine.radii[i] for i in contact.balls)
        still = STILL * math.sqrt(engine.surface.pull * radius)
        return abs(speed) <= still and abs(engine.gap(hit, motions)) <= NEAR * radius

    def cuts(self, hit: Hit, t: float) -> bool:
        """Cut the pieces of balls that are to hit at ``t`` (s) shortly before that.

        Within a piece places are off by its deviation; at the beginning of the next one they are
        not.
        """
        engine, is_cut = self.engine, False
        for i in hit.balls:
            wait = t - engine.now
            if i in self.of and wait > 2.0 * SHORTLY * self.of[i].piece.time:
                engine.push(t - SHORTLY * wait, What("piece", i))
                is_cut = True
        return is_cut

    def look(self, hits: Iterable[Hit]) -> None:
        """Look at contacts that were answered at this instant."""
        for hit in hits:
            self.note_hit(hit)
            if self._may_persist(hit):
                self.look_at(hit)

    def _may_persist(self, hit: Hit) -> bool:
        """Tell whether the strongest pressing could hold two sides that have just hit.

        Sliding alone presses no ball on to a straight wall.
        """
        engine, own = self.engine, self.engine.paths[hit.i]
        pull, radius = engine.surface.pull, engine.radii[hit.i] * self.wear(hit)
        if hit.kind == "wall":
            side = engine.walls[hit.j].nearest(own.x, own.y, engine.radii[hit.i])
            return engine.surface.rolls or side.curvature(own.x, own.y) < 0.0 or not own.slows
        other = engine.paths[hit.j]
        dx, dy = other.x - own.x, other.y - own.y
        parting = dx * (other.vx - own.vx) + dy * (other.vy - own.vy)
        square = parting * parting / (dx * dx + dy * dy)
        return parting <= 0.0 or square < 4.0 * pull * UNSEEN * radius

    # -- groups begin and end ------------------------------------------------------------------

    def clear(self) -> None:
        """Take all groups apart, and forget what has been until now."""
        self.release(list(self.of))
        self.persisted.clear()
        self.waits.clear()
        self.loose.clear()

    def begin(self, i: int) -> None:
        """Let the contacts around ball ``i`` press that persist from now on."""
        engine = self.engine
        for hit in [hit for hit, until in self.waits.items() if until <= engine.now]:
            del self.waits[hit]
            self.loose |= dict.fromkeys(hit.balls)  # Their hits are predicted again.
        hits = [hit for hit in engine.touching((), (i,)) if self._stays(hit)]
        balls = sorted({i for hit in hits for i in hit.balls})
        self.release(balls)
        when, count = self.begun
        self.begun = engine.now, count + 1 if when == engine.now else 1
        if self.begun[1] > MOST_CHANGES * max(len(balls), 1):
            for hit in hits:
                self._wait(hit)
        elif hits:
            group = Group(engine, hits, balls)
            self._join(group)
            begin(group.press, group.state)
            pieces.close(group.press, group.state)
            self._decide(group)
        if self.loose:
            engine.predict(())

    def _join(self, group: Group) -> None:
        """Take away the speeds at which the sides of a new group part or close."""
        engine, press, s = self.engine, group.press, group.state
        set_scale(press, s)
        noise = engine.noise(group.balls)
        if any(abs(opening(press, s, k)) > noise for k in range(len(group.hits))):
            pieces.join(press, s, noise, group.total)
            self.of.update(dict.fromkeys(group.balls, group))  # All of them leave their paths.

    def _stays(self, hit: Hit) -> bool:
        """Tell whether two sides that touch neither part nor close, to the eye."""
        engine = self.engine
        if any(group.is_on(hit) for i in hit.balls if (group := self.of.get(i)) is not None):
            return True
        motions = engine.motions([hit])
        contact = engine.contact(hit, motions, DEAD)
        speed = abs(closing_speed(contact, self._velocities(contact)))
        radius = min(engine.radii[i] for i in contact.balls)
        still = STILL * math.sqrt(engine.surface.pull * radius)
        if speed <= max(engine.noise(contact.balls), still):
            return True
        return self._persists(hit, motions, speed)

    def absorb(self, hits: list[Hit]) -> bool:
        """Let sides persist that close too slowly to be seen to bounce; tell whether all do so."""
        if not all(self._may_be_faint(hit) and self._is_faint(hit) for hit in hits):
            return False
        self.begin(hits[0].i)
        return all(self.of.keys() >= set(hit.balls) or self.rubs(hit) for hit in hits)

    def _may_be_faint(self, hit: Hit) -> bool:
        """Tell whether the strongest pressing could hold two sides that close now."""
        engine = self.engine
        x, y, vx, vy = engine.motion(hit.i)
        strongest = 2.0 * engine.surface.pull
        if hit.kind == "wall":
            side = engine.walls[hit.j].nearest(x, y, engine.radii[hit.i])
            nx, ny = side.normal(x, y)
            closing = vx * nx + vy * ny
            strongest += abs(side.curvature(x, y)) * (vx * vx + vy * vy)
        else:
            bx, by, u, v = engine.motion(hit.j)
            dx, dy = bx - x, by - y
            closing = (dx * (vx - u) + dy * (vy - v)) / math.sqrt(dx * dx + dy * dy)
        radius = engine.radii[hit.i] * self.wear(hit)
        return closing * closing < 2.0 * strongest * UNSEEN * radius

    def _is_faint(self, hit: Hit) -> bool:
        """Tell whether two sides would bounce too low to be seen."""
        motions = self.engine.motions([hit])
        contact = self.engine.contact(hit, motions, DEAD)
        return self._persists(hit, motions, closing_speed(contact, self._velocities(contact)))

    def _decide(self, group: Group, before: int = 0) -> None:
        """Go on with a group in a mode that fits, or without forces for a moment if there is none.

        So many contacts had a force ``before``.
        """
        if group.changes <= MOST_CHANGES and decide(group.press, group.state):
            group.longest = OPENED if sum(group.press.on) < before else FIRST
            self._note(group)
            self._go_on_in_parts(group)
            return
        pieces.join(group.press, group.state, 0.0, group.total)
        self._note(group)
        for hit in group.hits:
            self._wait(hit)
        for i in group.balls:
            self.of[i] = group
        for i in group.balls:
            self._let_go(i, group)

    def _wait(self, hit: Hit) -> None:
        """Let a contact have no force for a moment, in which no ball sinks in to be seen.

        Each time the moment is twice as long, because what presses so weakly hardly moves a ball.
        """
        engine = self.engine
        radius = min(engine.radii[i] for i in hit.balls)
        first = math.sqrt(2.0 * pieces.DEVIATION * radius / max(engine.surface.pull, 1.0))
        if self.waits.get(hit, -math.inf) > engine.now:
            return
        until, length = self.waited.get(hit, NEVER)
        length = first if until < engine.now - length else 2.0 * length
        self.waits[hit] = engine.now + length
        self.waited[hit] = engine.now + length, length
        engine.push(engine.now + length, What("press", hit.i))

    def _go_on_in_parts(self, group: Group) -> None:
        """Go on with the balls that contacts press together, and let go of the others."""
        for i in group.balls:
            if group.press.phase[group.number[i]] == REST:
                self._rest(i, group)
        parts = parts_of(group)
        joined = {i for part in parts for i in part.balls}
        for i in group.balls:
            if i in self.of and i not in joined:
                self._let_go(i, group)
        for part in parts:
            for i in part.balls:
                self.of[i] = part
        for part in parts:
            self._play(part)

    def _let_go(self, i: int, group: Group) -> None:
        """Let a ball of a group go on by itself."""
        engine = self.engine
        del self.of[i]
        x, y, vx, vy, wx, wy = group.of(i)
        path = engine.surface.path(engine.now, (x, y), (vx, vy), (wx, wy))
        if path.moves:
            engine.lead(i, path)
            self.loose[i] = None
        else:
            self._rest(i, group)
        engine.recorder.let_go(i, engine.now)

    def release(self, balls: Iterable[int], is_hit: bool = False) -> bool:
        """Take the groups of some balls apart, at the present time; tell whether there were any.

        A variant opens the gaps of a group that is hit: their order is unknown then.
        """
        engine, found = self.engine, {id(g): g for i in balls if (g := self.of.get(i)) is not None}
        for group in found.values():
            group.cut(engine.now)
            self._note(group)
            if is_hit:
                group.open(engine.policy.gap())
            for i in group.balls:
                self._let_go(i, group)
        return bool(found)

    def _note(self, group: Group) -> None:
        """Note the impulses of a group's contacts up to now."""
        now = self.engine.now
        for k, (hit, contact) in enumerate(zip(group.hits, group.contacts, strict=True)):
            normal, x, y = group.total[k]
            if not group.press.on[k] and normal == 0.0:
                continue
            old = self.persisted.get(hit)
            if old is None or old.until < group.began:
                self.tell(hit)
                old = Persisted(contact, group.began, group.began)
            self.persisted[hit] = old._replace(until=now, x=old.x + x, y=old.y + y)
            group.total[k] = [0.0] * 3

    def tell(self, hit: Hit) -> None:
        """Tell the recorder about a persistent contact that is over."""
        if hit in self.persisted:
            self.engine.recorder.persistent(self.persisted.pop(hit))

    def tell_all(self) -> None:
        """Tell the recorder about all persistent contacts, because the run is over now."""
        for group in {id(group): group for group in self.of.values()}.values():
            group.state_at(self.engine.now, group.total)
            self._note(group)
        for hit in list(self.persisted):
            self.tell(hit)

    # -- pieces --------------------------------------------------------------------------------

    def go_on(self, i: int) -> None:
        """Go on at the end of a half of a piece, or of the piece."""
        group, engine = self.of.get(i), self.engine
        if group is None:  # A ball at rest has kept its path.
            return
        if engine.now == engine.paths[i].end < group.end:
            self._set_out(group, is_second=True)
        else:
            is_cut = engine.now < group.end
            group.cut(engine.now)
            self._note(group)
            group.began = engine.now
            if is_cut:
                group.longest = group.piece.time
                self._play(group)
            elif group.piece.fell < 0 and not group.piece.faded and not any(group.press.stuck):
                group.longest = group.piece.next
                self._play(group)
            else:
                group.press.stuck[:] = [False] * len(group.balls)
                self._turn(group)
        engine.predict(())

    def _turn(self, group: Group) -> None:
        """Change the mode of a group at the end of a piece."""
        press, s, piece = group.press, group.state, group.piece
        if piece.faded:
            for k in pieces.settle(press, s):
                self._has_settled(group.balls[k], group)
        before = sum(press.on)
        if piece.fell >= 0:
            pieces.change(press, s, piece.fell)
            if piece.time == 0.0 and piece.fell < 4 * len(group.hits) and piece.fell % 4 == 0:
                self._wait(group.hits[piece.fell // 4])
        self._decide(group, before)

    def _has_settled(self, i: int, group: Group) -> None:
        """Tell that a ball rolls now, or rests."""
        if group.press.phase[group.number[i]] == ROLL:
            self.engine.tally.listed += 1
            self.engine.recorder.roll(i, self.engine.now)

    def _rest(self, i: int, group: Group) -> None:
        """Let a ball rest that has moved."""
        engine, (x, y, *_) = self.engine, group.of(i)
        if engine.rested[i] == math.inf:
            engine.paths[i] = standing(engine.now, x, y)
            engine.speeds[i] = 0.0
            self.loose[i] = None
            engine.stop(i, engine.now, (x, y))

    def _play(self, group: Group) -> None:
        """Play the next piece of a group, whose mode is known."""
        press = group.press
        mode = list(press.phase), list(press.on), list(press.slides), list(press.into)
        state = list(group.state)
        group.piece = pieces.piece_of(press, group.state, group.longest, group.total)
        self.engine.recorder.begun(group.begun(state, mode))
        if group.piece.time == 0.0:
            group.changes += 1
            self._turn(group)
            return
        group.changes = 0
        self._set_out(group, is_second=False)

    def _set_out(self, group: Group, is_second: bool) -> None:
        """Put the balls of a group on the paths of a half of its piece."""
        engine, moving = self.engine, []
        for i in group.balls:
            path = group.path(i, is_second)
            if path is not None:
                engine.lead(i, path)
                self.loose[i] = None
                moving.append(i)
        engine.tally.unlisted += 1
        engine.push(engine.paths[moving[0]].end, What("piece", moving[0]))


def pressing_of(contact: Contact, paths: Sequence[Path], t: float) -> float:
    """Return how strongly (m/s^2) two sides are pressed together on these paths."""
    if contact.b != NO_BALL:
        return pressing_of_balls(paths[0], paths[1], t)
    return pressing_of_wall(paths[0], contact.normal, contact.curvature, t)


def parts_of(group: Group) -> list[Group]:
    """Return the parts of a group that contacts press together; it may be all of it."""
    first = {i: i for i in group.balls}
    press = group.press
    pressing = [hit for k, hit in enumerate(group.hits) if press.on[k] and pieces.moves(press, k)]
    for hit in pressing * len(pressing):
        low = min(first[i] for i in hit.balls)
        for i in hit.balls:
            first[i] = low
    parts: dict[int, list[int]] = {}
    for i in sorted({i for hit in pressing for i in hit.balls}):
        parts.setdefault(first[i], []).append(i)
    if len(parts) == 1 and len(next(iter(parts.values()))) == len(group.balls):
        return [group]
    return [part_of(group, balls) for balls in parts.values()]


def part_of(group: Group, balls: Sequence[int]) -> Group:
    """Return the part of a group that has some of its balls."""
    part, numbers = copy(group), [group.number[i] for i in balls]
    part.balls, part.number = list(balls), {i: k for k, i in enumerate(balls)}
    kept = [k for k, hit in enumerate(group.hits) if part.number.keys() >= set(hit.balls)]
    part.hits, part.contacts = [group.hits[k] for k in kept], [group.contacts[k] for k in kept]
    part.total, part.state = [group.total[k] for k in kept], []
    for i in balls:
        part.state += group.of(i)
    part.press = part_of_press(group.press, numbers, kept)
    return part
