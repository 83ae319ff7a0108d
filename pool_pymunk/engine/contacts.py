"""The contact engine moves balls along their paths and answers contacts in the order of time.

When a ball sets off on a new path, the engine predicts its contacts with walls and with the paths
of other balls, and puts them in a queue. The earliest prediction happens next. A
:class:`~pool_pymunk.engine.near.Near` tells what is near a ball, and a
:class:`~pool_pymunk.engine.recorder.Recorder` listens.

What is due at an instant is answered by :mod:`pool_pymunk.engine.instants`, and contacts that
persist by :mod:`pool_pymunk.engine.modes`; compiled shots use both, too.

- *Grazing*: a path that is tangent up to rounding misses a corner.
- *Touching*: two balls that touch have a contact now if they close faster than rounding explains.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from heapq import heappop, heappush
from typing import Any

from pool_pymunk.engine import borders, decisions, groups, instants, modes, persisting
from pool_pymunk.engine.answers import Instant
from pool_pymunk.engine.due import Due, Hit, Queue, What, ends_of, hit_of
from pool_pymunk.engine.groups import Groups
from pool_pymunk.engine.near import Near
from pool_pymunk.engine.policies import Errors, Variant, begin_errors, nearly_closed
from pool_pymunk.engine.recorder import Motion, Motions, Recorder
from pool_pymunk.physics.contact import NO_BALL, Contact, Pair, Vector
from pool_pymunk.physics.laws import NO_FRICTION, Law
from pool_pymunk.physics.of_core import patches_of, surface_of
from pool_pymunk.physics.pairs import pair_time
from pool_pymunk.physics.patches import NO_PATCHES
from pool_pymunk.physics.path import (
    NOISE,
    Path,
    fastest_of,
    motion_at,
    sets_off,
)
from pool_pymunk.physics.pressed import Press
from pool_pymunk.physics.sides import Wall, unit
from pool_pymunk.physics.surface import NO_ROLL, Surface

# Once the compiled loop is loaded, it puts in here what plays a table's engine, with the same bits
# (pool_pymunk/fast/live.py).
LOOPS: list[Callable[[ContactEngine, Any], Any]] = []


Key = tuple[int, int]  # a ball and the place of a wall


class Tally:
    """A tally counts instants, events, and instants without an event, up to its bounds."""

    def __init__(self, most: float = math.inf, most_unlisted: float = math.inf) -> None:
        self.answered = self.listed = self.unlisted = 0
        self.most, self.most_unlisted = most, most_unlisted


class ContactEngine:
    """The contact engine finds what happens to the balls next, and plays it.

    ``noises`` (m/s) tells how much of each ball's velocity may be rounding. ``rested`` (s) is the
    time at which a ball came to rest, infinite for one that moves. ``is_finite`` is False once a
    ball is lost (:meth:`~pool_pymunk.physics.path.Path.is_lost`) or a number has overflowed.
    """

    near: Near

    def __init__(
        self, law: Law, pair: Callable[[int, int], Pair], surface: Any, recorder: Recorder
    ) -> None:
        self.pair = pair
        self.recorder = recorder
        self.now = 0.0
        self.is_finite = True
        self.walls: list[Wall] = []
        self.paths: list[Path] = []
        self.radii: list[float] = []
        self.masses: list[float] = []
        self.speeds: list[float] = []  # m/s, the highest on the paths
        self.noises: list[float] = []
        self.rested: list[float] = []
        self.path_ends: list[float] = []  # the time (s) at which each path meets a wall
        self.surfaces: list[Surface] = []  # those where the balls are
        self.ends: list[float] = []  # the time (s) up to which each path's hits are found
        self.law = law
        self.slip = NO_FRICTION
        self.collapses = 0  # of more than two contacts, so far
        self.groups, self.press = Groups(), Press()  # balls in persistent contact
        self.lay(surface)
        self.compiled = True  # Presses are compiled where that is loaded.
        self.tally = Tally()
        self.queue = Queue(self.paths)
        self.push = self.queue.push
        self.upcoming = self.queue.upcoming
        self.instant = Instant()
        self.errors = Errors()
        # the places of walls that move, by their numbers; how often each of them has hit a ball in
        # the present step, which balls they squeeze, and which ones they go through
        self.movers: dict[int, int] = {}
        self.struck: Counter[Key] = Counter()
        self.met: Counter[Key] = Counter()  # the same, with what is no hit
        self.squeezed: set[int] = set()
        self.jams: set[Key] = set()
        # when (s) walls have last kicked balls, and were last jammed, by a ball and a wall's number
        self.kicked: dict[tuple[int, int | None], float] = {}
        self.jammed: dict[tuple[int, int | None], float] = {}
        self.loop: Any = None  # It may have the groups, and what is due.

    # -- setting up ----------------------------------------------------------------------------

    def lay(self, surface: Any, patches: Any = NO_PATCHES) -> None:
        """Let balls move over a surface, and over others where there are patches."""
        surface, patches = surface_of(surface), patches_of(patches)
        self.surface, self.patches = surface, patches
        self.has_patches = len(patches.borders) > 0
        self.pull = max([surface.pull, *(each.pull for each in patches.surfaces)])
        if self.has_patches:
            self.groups.hold_patches(len(self.paths))
            self.put_all()
        else:
            self.surfaces[:] = [surface] * len(self.surfaces)

    def put(self, i: int, patch: int) -> None:
        """Let ball ``i`` be in a patch, or in none (-1)."""
        self.groups.patch[i] = patch
        self.surfaces[i] = self.surface if patch < 0 else self.patches.surfaces[patch]

    def put_all(self) -> None:
        """Let all balls be in their patches, which are known."""
        for i in range(len(self.paths)):
            self.put(i, self.groups.patch[i])

    def path_at(
        self, i: int, t: float, place: Vector, velocity: Vector, roll: Vector = NO_ROLL
    ) -> Path:
        """Return the path of a ball, old or new, that somebody puts at a place (m) now (s)."""
        if not self.has_patches:
            return self.surface.path(t, place, velocity, roll)
        patch = self.patches.at(*place)
        if i < len(self.paths):
            self.put(i, patch)
        surface = self.surface if patch < 0 else self.patches.surfaces[patch]
        return surface.path(t, place, velocity, roll)

    def add_ball(self, path: Path, radius: float, mass: float) -> int:
        """Put a ball on the table, and return its number."""
        self.take_over()
        i, moves = len(self.paths), sets_off(path)
        self.paths.append(path)
        self.radii.append(radius)
        self.masses.append(mass)
        self.rested.append(math.inf if moves else -math.inf)
        self.path_ends.append(math.inf)
        self.ends.append(math.inf)
        self.speeds.append(0.0)
        self.noises.append(0.0)
        self.groups.hold(i + 1, 0)
        self.surfaces.append(self.surface)
        if self.has_patches:
            self.groups.hold_patches(i + 1)
            self.put(i, self.patches.at(path.x, path.y))
        if moves:
            self.begin(i, path)
        return i

    def vary(self, variant: Variant) -> None:
        """Play this variant of the run."""
        begin_errors(self.errors, variant)
        self.slip = variant.slip or NO_FRICTION
        self.groups.coarser = variant.coarser

    def remove(self, i: int, at: Vector | None = None) -> None:
        """Take ball ``i`` off the table, and let it lie where it is, or ``at`` a place (m)."""
        self.take_over()
        self.release(i)
        path = self.paths[i]
        x, y, _, _ = motion_at(path, max(self.now, path.t))
        self.paths[i], self.speeds[i] = self.surface.path(self.now, at or (x, y), (0.0, 0.0)), 0.0
        self.rested[i] = self.now
        self.near.remove(i)
        for k in [k for k in self.take_loose() if k != i]:
            groups.loosen(self.groups, k)

    def turn_back(self, t: float) -> None:
        """Go back to an earlier time (s): predictions are forgotten, and all paths must be new."""
        self.take_over()
        for i in range(len(self.paths)):
            self.release(i)
            groups.forget_ball(self.groups, i)
        groups.forget_all(self.groups)
        self.groups.persisted.clear()
        self.kicked.clear()
        self.jammed.clear()
        self.now, self.instant = t, Instant()
        self.queue.clear()
        self.queue.presses.clear()

    def set_off(self, i: int, path: Path) -> None:
        """Put ball ``i`` on a new path that somebody else gave it."""
        self.take_over()
        self.release(i)
        self.lead(i, path)

    def lead(self, i: int, path: Path) -> None:
        """Put ball ``i`` on a new path, whatever it was doing."""
        if path.moves:
            self.rested[i] = math.inf
        self.begin(i, path)
        self.recorder.path(i, path)

    # -- what is due -----------------------------------------------------------------------------

    def predict(self, balls: Collection[int]) -> None:
        """Predict where the paths of these balls lead: to walls, to their ends, to other balls."""
        if self.has_loop:
            for i in (*balls, *self.loose()):
                self.near.begin(i, self.paths[i], self.radii[i], self.now, math.inf)
            return
        push, leader = self.push, self.groups.leader
        if self.groups.loosened:
            balls = dict.fromkeys((*balls, *self.take_loose()))
        for i in balls:
            path, end = self.paths[i], math.inf
            if self.speeds[i] > 0.0 or path.moves:
                for wall in self.near.walls(i):
                    t = self.meet_wall(i, wall)
                    if t < end:
                        end = t
                if end < math.inf:
                    end += decisions.nearly_now(self.radii[i], self.speeds[i])
                if self.has_patches and (t := borders.next_crossing(self, i)) < math.inf:
                    push(t, What("patch", i))
                    end = min(end, t)
                if end == math.inf > path.end and leader[i] < 0:
                    push(path.end, What("stop", i))
            else:
                for wall in self.movers.values():
                    self.meet_wall(i, wall)
            self.path_ends[i] = end
        self._look_ahead(balls)

    def play(self, until: float) -> None:
        """Play what is due next, or by a loop all up to a time (s) or to what somebody hears of."""
        if self.loop is None or not self.loop.play(until):
            self.next()

    def foresees(self) -> bool:
        """Tell whether a loop has predicted what walls that move meet in the step that begins."""
        return self.loop is not None and bool(self.loop.foresee())

    def take_over(self) -> None:
        """Take over what a loop has, because somebody changes the balls."""
        if self.loop is not None:
            self.loop.leave()

    @property
    def has_loop(self) -> bool:
        """Tell whether a loop has predicted what is due, or will do so when it plays again."""
        return self.loop is not None and self.loop.predicts

    def loose(self) -> list[int]:
        """Return the balls whose groups were taken apart, and which are not predicted yet."""
        return list(self.groups.out[: self.groups.loosened])

    def take_loose(self) -> list[int]:
        """Return the loose balls, and forget them."""
        found, known = self.loose(), self.groups
        for i in found:
            known.loose[i] = 0
        known.loosened = 0
        return found

    def _look_ahead(self, balls: Collection[int]) -> None:
        """Predict which others these balls meet, up to the horizon of their paths."""
        near = self.near
        for i in balls:
            path, end = self.paths[i], self.path_ends[i]
            horizon = near.horizon(path, self.now)
            if horizon < end and horizon < path.end:
                end = horizon
                self.push(end, What("look", i))
            self.ends[i] = end
            near.begin(i, path, self.radii[i], self.now, end)
        done: set[int] = set()
        meet, now = self.meet, self.now
        for i in balls:
            for j in near.balls(i, now):
                if j not in done:
                    meet(i, j)
            done.add(i)

    def meet(self, i: int, j: int) -> None:
        """Predict when two balls meet."""
        if i > j:
            i, j = j, i
        if groups.holds(self.groups, i, j):
            return
        hit = What("pair", i, j)
        a, b, radii = self.paths[i], self.paths[j], self.radii
        until, other = self.ends[i], self.ends[j]
        until = until if until < other else other
        noise, other = self.noises[i], self.noises[j]
        noise = noise if noise > other else other
        t = pair_time(a, b, radii[i] + radii[j], self.now, until, noise)
        if t < math.inf and not (self._may_press(hit, t) and persisting.takes(self, None, i, j, t)):
            self.push(t, hit)

    def _may_press(self, hit: Hit, t: float) -> bool:
        """Tell whether a hit at ``t`` (s) may be of sides that are held together, or of groups.

        It is so soon then that its balls hardly move until it comes.
        """
        speed = self.speeds[hit.i]
        if self.groups.members or self.groups.waits:
            return True
        if hit.kind == "pair" and self.speeds[hit.j] > speed:
            speed = self.speeds[hit.j]
        return not (t - self.now) * speed > decisions.SOON * self.radii[hit.i]

    def meet_wall(self, i: int, wall: int) -> float:
        """Predict when a ball meets a wall, and return that time (s), or infinity."""
        if groups.holds(self.groups, i, -1 - wall) or (i, wall) in self.jams:
            return math.inf
        hit = What("wall", i, wall)
        t = self.walls[wall].time_of_contact(self.paths[i], self.radii[i], self.now)
        if (
            t < math.inf
            and self._may_press(hit, t)
            and persisting.takes(self, None, i, -1 - wall, t)
        ):
            return math.inf
        if t < math.inf:
            self.push(t, hit)
        return t

    # -- what happens ----------------------------------------------------------------------------

    @property
    def is_over(self) -> bool:
        """Tell whether the run has come to its bounds."""
        tally = self.tally
        return tally.listed >= tally.most or tally.unlisted >= tally.most_unlisted

    def advance(self, until: float) -> None:
        """Play what is due up to ``until`` (s), within the engine's bounds."""
        while self.upcoming() <= until and self.queue and self.is_finite and not self.is_over:
            self.next()

    def next(self) -> None:
        """Play what is due next: a look ahead, a stop, or the contacts of one instant."""
        t, _, what, _, _ = heappop(self.queue)
        if t > self.now:
            self.now = t
        if what.kind == "look":
            self._look_ahead((what.i,))
            return
        self.tally.answered += 1
        if what.kind == "pair" or what.kind == "wall":
            if self.movers and self._meets_too_often(what):
                self.predict((what.i,))  # It may meet others behind the wall.
            else:
                self._find_due(what)
                instants.answer(self, None)
        elif what.kind == "stop":
            instants.end_path(self, None, what.i)
        elif what.kind == "patch":
            borders.cross(self, None, what.i)
        elif what.kind == "piece":
            modes.go_on(self, None, what.i)
        else:
            self.queue.presses.pop((what.i, t), None)
            modes.begin_at(self, None, what.i)

    def _find_due(self, what: Hit) -> None:
        """Let this contact be ``due``, and all others of its instant."""
        at, latest = self.instant, self._latest(what)
        at.dues, at.due[0] = 1, ends_of(what)
        if self.queue and self.queue[0][0] <= latest:
            hits = sorted([what, *self._at_this_instant(what, latest)])
            at.dues = len(hits)
            for k, hit in enumerate(hits):
                at.due[k] = ends_of(hit)

    def _latest(self, hit: Hit) -> float:
        """Return the latest time (s) of contacts that may be of the same instant as this one."""
        speed = self.speeds[hit.i]
        if hit.kind == "pair":
            speed = max(speed, self.speeds[hit.j])
        return self.now + decisions.nearly_now(self.radii[hit.i], speed)

    def _at_this_instant(self, first: Hit, latest: float) -> list[Hit]:
        """Return further contacts that are due until ``latest`` (s) and already closed."""
        same: dict[Hit, None] = {}
        later: list[Due] = []
        for due in self.queue.take_until(latest):
            t, _, what, _, _ = due
            if what.kind != "pair" and what.kind != "wall":
                later.append(due)
            elif t <= self._latest(what) and self.is_closed(what, self.motions([what])):
                same[what] = None
            else:
                later.append(due)
        for due in later:
            heappush(self.queue, due)
        return [hit for hit in same if hit != first]

    def take_in(self, i: int, k: int) -> None:
        """Let the pocket that is wall ``k`` take in a ball."""
        wall, motion = self.walls[k], motion_at(self.paths[i], self.now)
        assert wall.center is not None, "it is a pocket"
        self.tally.listed += 1
        self.remove(i, wall.center)
        self.recorder.pocketed(i, wall.number, self.now, motion, wall.center)

    # -- persistent contacts -------------------------------------------------------------------

    def state_of(self, i: int) -> list[float]:
        """Return x, y (m), vx, vy, wx, wy (m/s) of a ball now."""
        leader = self.groups.leader[i]
        if leader >= 0 and self.loop is not None and self.loop.is_on:
            return list(self.loop.state_of(i))
        if leader < 0:
            path = self.paths[i]
            return [*motion_at(path, self.now), *self.surface.roll(path, self.now)]
        groups.find_state(self, leader, self.now)
        p = 6 * self.groups.local[i]
        return list(self.press.end[p : p + 6])

    def presses(self, hit: Hit) -> bool:
        """Tell whether a contact has a force now."""
        if self.loop is not None and self.loop.is_on:
            return bool(self.loop.presses(*ends_of(hit)))
        return groups.holds(self.groups, *ends_of(hit))

    def release(self, i: int, gap: float = 0.0) -> bool:
        """Take the group of a ball apart; tell whether there was one."""
        return self.groups.members > 0 and modes.release(self, i, gap)

    def tell(self, hit: Hit) -> None:
        """Tell the recorder about a persistent contact that is over."""
        if self.loop is not None and self.loop.is_on:
            self.loop.forget(hit)
        if hit in self.groups.persisted:
            self.recorder.persistent(self.groups.persisted.pop(hit))

    def tell_all(self) -> None:
        """Tell the recorder about all persistent contacts, because the run is over now."""
        for i, leader in enumerate(self.groups.leader[: len(self.paths)]):
            if i == leader:
                groups.find_state(self, i, self.now)
                modes.note_impulses(self, self.groups.began[i])
        for hit in list(self.groups.persisted):
            self.tell(hit)

    # -- contacts --------------------------------------------------------------------------------

    def motions(self, hits: Iterable[Hit]) -> Motions:
        """Return how the balls of these hits move now."""
        paths, now = self.paths, self.now
        return {i: motion_at(paths[i], now) for hit in hits for i in hit.balls}

    def motion(self, i: int) -> Motion:
        """Return how a ball moves now."""
        return motion_at(self.paths[i], self.now)

    def contact(self, hit: Hit) -> Contact:
        """Return the contact of two balls, or of a ball and a wall, now."""
        return self.contact_at(*ends_of(hit), {i: self.motion(i)[:2] for i in hit.balls})

    def contact_at(self, i: int, other: int, place: Mapping[int, Vector]) -> Contact:
        """Return a contact of balls at these places (m); ``other`` is a ball, or -1 - a wall."""
        (x, y), r = place[i], self.radii[i]
        is_squeezed = i in self.squeezed or other in self.squeezed
        if other < 0:
            wall = self.walls[-1 - other]
            side = wall.nearest(x, y, r)
            nx, ny = normal = side.normal(x, y)
            e, kick = (0.0, 0.0) if is_squeezed else (wall.restitution, wall.kick)
            pair = Pair(self.masses[i], math.inf, e, wall.friction)
            point, bends = (x - r * nx, y - r * ny), side.curvature(x, y)
            drift = wall.drift(x, y, r)
            return Contact(i, NO_BALL, normal, pair, wall.number, point, 0.0, bends, drift, kick)
        bx, by = place[other]
        nx, ny = normal = unit(bx - x, by - y)
        pair = self.pair(i, other)
        if is_squeezed:
            pair = pair._replace(restitution=0.0)
        return Contact(i, other, normal, pair, None, (x + r * nx, y + r * ny))

    def kick_at(self, one: Contact) -> float:
        """Return by how much (m/s) a wall kicks the ball that has hit it: once in an instant."""
        if one.kick == 0.0:
            return 0.0
        return 0.0 if self._is_again(self.kicked, (one.a, one.cushion)) else one.kick

    def _is_again(self, seen: dict[tuple[int, int | None], float], key: tuple[int, Any]) -> bool:
        """Tell whether a ball and a wall were seen at this instant; note when (s) they are not."""
        x, y, _, _ = self.motion(i := key[0])
        length = decisions.instant(self.now, x, y, self.radii[i], self.speeds[i])
        if abs(self.now - seen.get(key, -math.inf)) <= length:
            return True
        seen[key] = self.now
        return False

    def count_hit(self, i: int, wall: int) -> None:
        """Count a hit of a ball on a wall that moves.

        After many hits in one step the ball is squeezed, and bounces no more. After some more the
        wall goes through it, because it has nowhere to go.
        """
        key = i, wall
        self.struck[key] += 1
        if self.struck[key] >= decisions.SQUEEZED:
            self.squeezed.add(i)
        if self.struck[key] >= decisions.JAMMED:
            self.jam(key)

    def _meets_too_often(self, hit: Hit) -> bool:
        """Count that a ball meets a wall that moves, hit or not; tell whether this jams it."""
        key = hit.i, hit.j
        if hit.kind != "wall" or hit.j not in self.movers.values():
            return False
        self.met[key] += 1
        if self.met[key] < decisions.MET:
            return False
        self.jam(key)
        return True

    def jam(self, key: Key) -> None:
        """Let a wall go through a ball."""
        if key not in self.jams:
            self.jams.add(key)
            wall = self.walls[key[1]].number
            if not self._is_again(self.jammed, (key[0], wall)):
                self.recorder.jammed(key[0], wall, self.now)

    def gap(self, hit: Hit, motions: Motions) -> float:
        """Return the distance (m) between two surfaces; it is negative where they overlap."""
        x, y, _, _ = motions[hit.i]
        r = self.radii[hit.i]
        if hit.kind == "wall":
            return self.walls[hit.j].nearest(x, y, r).gap(x, y, r)
        dx, dy = motions[hit.j][0] - x, motions[hit.j][1] - y
        return math.sqrt(dx * dx + dy * dy) - r - self.radii[hit.j]

    def is_closed(self, hit: Hit, motions: Motions, times: float = 1.0) -> bool:
        """Tell whether a gap is at most this many ``times`` as wide as rounding explains."""
        x, y, _, _ = motions[hit.i]
        touching = self.radii[hit.i] + (self.radii[hit.j] if hit.kind == "pair" else 0.0)
        gap = self.gap(hit, motions)
        if self.movers and hit.kind == "wall":
            ux, uy, _, _ = self.walls[hit.j].sweep(x, y)
            gap -= decisions.late_by(self.now, self.speeds[hit.i], ux, uy)
        return decisions.is_closed(gap / times, x, y, touching)

    def touching(self, hits: Iterable[Hit], balls: Iterable[int] = ()) -> list[Hit]:
        """Return these hits, and all contacts in the cluster around their balls or ``balls``."""
        found: dict[Hit, None] = dict.fromkeys(hits)
        balls = list(dict.fromkeys([*balls, *(i for hit in found for i in hit.balls)]))
        motions: Motions = {}
        for i in balls:  # This list grows.
            for j in self.near.touching(i, self.now):
                if j < 0 and self.walls[-1 - j].is_pocket:
                    continue
                hit = hit_of(i, j)
                if hit in found or (i, -1 - j) in self.jams:
                    continue
                for k in hit.balls:
                    if k not in motions:
                        motions[k] = motion_at(self.paths[k], self.now)
                if self.is_closed(hit, motions, nearly_closed(self.errors)):
                    found[hit] = None
                    balls += [k for k in hit.balls if k not in balls]
        return sorted(found)

    # -- what follows ----------------------------------------------------------------------------

    def begin(self, i: int, path: Path, noise: float | None = None) -> None:
        """Put ball ``i`` on a new path; ``noise`` (m/s) of its velocity may be rounding."""
        self.paths[i], fastest = path, fastest_of(path)
        # A ball that sets off without a velocity has no highest speed yet.
        self.speeds[i] = fastest if fastest > 0.0 or path.slows else math.inf
        self.noises[i] = NOISE * fastest if noise is None else noise
        if path.is_lost(self.radii[i]):
            self.is_finite = False

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Note that a ball comes to rest at a place (m)."""
        self.tally.listed += 1
        self.rested[i] = t
        self.recorder.stop(i, t, position)
