"""This solver is the report's own: it advances every ball by a slice, then seeks overlaps.

A slice moves all balls (Eq. 10), then answers each ball's overlaps with cushions (Eq. 9), then
those of each pair of balls in their order (Listing 3). The arithmetic is the listing's, so that its
rounding is reproduced as well; that of a slice stands in `core/motion/slices.py`, where it is
compiled. The search for overlaps is skipped where it provably finds nothing: for a ball at rest,
and where balls are too far off to touch within the skipped slices.

Where balls roll, a slice takes mu_s g dt off the velocity of a ball along its slip, and adds 5/2 of
that to its roll. Once a slice would reverse the slip, the ball rolls.

On polygon tables the listing's rule holds edge by edge, and at corners that stick out; a ball at
rest stays where it is. A ball that travels more than its radius in a slice can pass an edge there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from math import atan2, copysign, cos, hypot, pi, sin

from pool_pymunk.core.motion.slices import SlicedDisc
from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws.contact import NO_BALL, NT, Contact, Impulse, Pair, impulse_of
from pool_pymunk.laws.own import ball_ball_by, cushion_by
from pool_pymunk.model import Point, Scene, State, Table
from pool_pymunk.results.trace import NONE, Trace
from pool_pymunk.solvers.record import Settings, Stepping

MOST_QUIET = 100_000  # slices between two looks, so that ``on_time`` hears of a long run
SAFE = 1.0 - 1e-6  # of a gap: the balls provably do not cross this share of it, rounding included


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate with slices of ``settings.dt`` s; a contact is found up to one slice late.

    At 1e-6 s with law ``published``, this reproduces Listing 1 of the report to every printed
    digit.
    """
    slices = Slices(scene, start, settings)
    trace = slices.play(settings)
    if trace.status == "settled":
        trace.steps = round(trace.duration / slices.dt)
    return trace


class Slices(Stepping):
    """This class holds the balls in the middle of a run, and advances them slice by slice."""

    def __init__(self, scene: Scene, start: State, settings: Settings) -> None:
        super().__init__(scene, start, settings.dt)
        self.loss = self.dt * scene.friction.surface * scene.physics.gravity
        self.rolls = scene.friction.rolling is not None
        # m/s; the speed that a ball which rolls loses in a slice
        self.drag = self.dt * (scene.friction.rolling or 0.0) * scene.physics.gravity
        # m/s; slower contacts of balls that roll are persistent, and no events
        self.press = self.loss if self.rolls else 0.0
        self.law = settings.law_of(scene)
        self.radius = [ball.radius for ball in scene.balls]
        rolls = start.roll or (NONE,) * len(start.position)
        motions = zip(start.position, start.velocity, rolls, strict=True)
        self.discs = [SlicedDisc(*place, *velocity, *roll) for place, velocity, roll in motions]
        self.colliding: set[tuple[int, int]] = set()
        self.present = [i for i, ball in enumerate(scene.balls) if ball.id not in start.off]
        self.moving = [i for i in self.present if self.discs[i].moves]
        self.first_look = True
        is_rectangle = scene.table is not None and scene.table.is_rectangle
        # The listing has its own rule for the cushions of a rectangle.
        self.walls = scene.cushions[scene.first_post if is_rectangle else 0 :]

    # -- motion ----------------------------------------------------------------------------------

    def advance(self, most: float) -> None:
        """Make the slices in which provably nothing meets, then one more, and look for overlaps."""
        quiet = min(self.quiet(), most - 1, MOST_QUIET)
        if quiet > 0:
            self.move(int(quiet))
        if self.moving:
            moved = list(self.moving)
            self.move(1)
            self.look(moved)
        self.is_finite = all(math.isfinite(sum(self.discs[i].motion)) for i in self.moving)

    def move(self, slices: int) -> None:
        """Advance every moving ball by this many slices, and stop what stops."""
        for i in self.moving:
            if self.rolls:
                self._move_sphere(i, slices)
                continue
            disc = self.discs[i]
            used = disc.slide(self.loss, self.dt, slices)
            if not disc.moves:
                self.trace.stop(i, (self.trace.steps + used) * self.dt, disc.place)
        self.moving = [i for i in self.moving if self.discs[i].moves]
        self.trace.steps += slices

    def _move_sphere(self, i: int, slices: int) -> None:
        """Advance a ball that slips until it rolls, and then until it rests."""
        disc, used = self.discs[i], 0
        while used < slices and disc.moves:
            slipped = disc.slips
            if slipped:
                used += disc.slip(self.loss, self.dt, slices - used)
            else:
                used += disc.roll_on(self.drag, self.dt, slices - used)
            t = (self.trace.steps + used) * self.dt
            if slipped and not disc.slips:
                if hypot(*disc.velocity) > self.drag:
                    self.trace.roll(i, t)
                    self._breakpoint(i, t)
                else:  # It would rest within a slice.
                    disc.rest()
            if not disc.moves:
                self.trace.stop(i, t, disc.place)

    # -- contacts --------------------------------------------------------------------------------

    def look(self, moved: list[int]) -> None:
        """Let pockets take balls in, answer overlaps with cushions, and then those of pairs."""
        moved = [i for i in moved if not self._is_pocketed(i)]
        table = self.scene.table
        for i in moved:
            if table is not None and table.is_rectangle:
                self._rectangle(i, table)
            self._overlaps(i)
        active = set(self.present if self.first_look else moved)
        self.first_look = False
        for i, j in combinations(self.present, 2):
            if i in active or j in active:
                self._pair(i, j, active)
        self.moving = sorted(i for i in active if self.discs[i].moves)

    def _is_pocketed(self, i: int) -> bool:
        """Tell whether a pocket has the ball's centre, and take the ball off the table if so."""
        disc = self.discs[i]
        center = self.pocketed(i, *disc.motion)
        if center is not None:
            disc.x, disc.y = center
            disc.rest()
            self.present.remove(i)
        return center is not None

    def _rectangle(self, i: int, table: Table) -> None:
        """Answer the listing's cushions: first the two across x, then the two across y."""
        disc, r = self.discs[i], self.radius[i]
        for axis, numbers in ((0, (3, 1)), (1, (0, 2))):
            low, high = table.bounds[axis] + r, table.bounds[axis + 2] - r
            place, velocity, before = list(disc.place), list(disc.velocity), disc.velocity
            at, approach = place[axis], velocity[axis]
            if at > high or at < low:
                place[axis] = min(max(at, low), high)
                wall = self.scene.cushions[numbers[at > high]]
                velocity[axis], velocity[1 - axis] = cushion_by(
                    self.law, NT(approach, velocity[1 - axis]), wall.restitution, wall.friction
                )
                self._rub(disc, wall, (1.0 - axis, 0.0 + axis), velocity[axis] - approach)
                (disc.x, disc.y), (disc.vx, disc.vy) = place, velocity
                inwards = -1.0 if at > high else 1.0
                normal = (inwards * (1.0 - axis), inwards * axis)
                self._note_cushion(i, wall, approach, normal, before)

    def _overlaps(self, i: int) -> None:
        """Answer a ball's overlaps with the sides of walls, one by one, by the listing's rule."""
        disc, r = self.discs[i], self.radius[i]
        for wall in self.walls:
            for side in wall.sides:
                gap = side.gap(disc.x, disc.y, r)
                if -2.0 * r < gap < 0.0:
                    self._bounce(i, wall, side.normal(disc.x, disc.y), -gap)

    def _bounce(self, i: int, wall: Wall, normal: Point, depth: float) -> None:
        disc, (nx, ny) = self.discs[i], normal
        (x, y, vx, vy), before = disc.motion, disc.velocity
        v = NT(vx * nx + vy * ny, vy * nx - vx * ny)
        if v.n < 0.0:
            n, s = cushion_by(self.law, v, wall.restitution, wall.friction)
            vx, vy = n * nx - s * ny, n * ny + s * nx
            self._rub(disc, wall, normal, n - v.n)
        disc.x, disc.y, disc.vx, disc.vy = x + depth * nx, y + depth * ny, vx, vy
        self._note_cushion(i, wall, min(v.n, 0.0), normal, before)

    def _rub(self, disc: SlicedDisc, wall: Wall, normal: Point, change: float) -> None:
        """Let friction slow the roll into a cushion that changed the normal velocity (m/s)."""
        if not self.rolls:
            return
        (wx, wy), (nx, ny) = disc.roll, normal
        n = wx * nx + wy * ny
        less = copysign(min(wall.friction * abs(change) / GYRATION, abs(n)), n)
        disc.wx, disc.wy = wx - less * nx, wy - less * ny

    def _note_cushion(
        self, i: int, wall: Wall, approach: float, normal: Point, before: Point
    ) -> None:
        """List a hit, or none if the ball came to rest in this slice and is only put back."""
        if abs(approach) > self.press:
            pair = Pair(self.scene.balls[i].mass, math.inf, wall.restitution, wall.friction)
            contact = Contact(i, NO_BALL, normal, pair)
            push = impulse_of(contact, [before], [self.discs[i].velocity])
            self.trace.ball_cushion(self.time, i, wall.number, push)
        self._note(i, lists=approach != 0.0)

    def _pair(self, i: int, j: int, active: set[int]) -> None:
        """Answer an overlap once; the pair answers again only after it has separated."""
        a, b = self.discs[i], self.discs[j]
        if not hypot(a.x - b.x, a.y - b.y) < self.radius[i] + self.radius[j]:
            self.colliding.discard((i, j))
            return
        # Balls that roll answer whenever they close, because a roll may drive them together.
        closing = closing_speed(a, b) if self.rolls else 0.0
        if (i, j) not in self.colliding or closing > 0.0:
            self.colliding.add((i, j))
            if a.moves or b.moves:
                push = self._collide(i, j)
                if not self.rolls or closing > 2.0 * self.press:
                    self.trace.ball_ball(self.time, i, j, push)
                active.update((i, j))
                self._note(i)
                self._note(j)

    def _collide(self, i: int, j: int) -> Impulse:
        """Answer a hit by Listing 3: turn to the frame of impact, apply the law, turn back.

        Return its impulse.
        """
        ball, other = self.discs[i], self.discs[j]
        before = [ball.velocity, other.velocity]
        impact = atan2(other.y - ball.y, other.x - ball.x)
        a, b, pair = in_frame(ball, impact), in_frame(other, impact), self.scene.pair(i, j)
        if self.law.jumps(a, b, pair):
            balls = f"balls {self.scene.balls[i].id} and {self.scene.balls[j].id}"
            slip, law = self.scene.units.text(a.t - b.t, ".0e", "speed"), self.law.name
            what = (
                f"the slip was only a rounding error ({slip}), and its sign decided the friction "
                f"of law {law}. The report's program does the same"
            )
            if a.t == b.t:
                what = f"there was no slip, so law {law} gave no friction; any slip gives all of it"
            self.trace.warn(f"in the hit of {balls} {what}", self.time)
        for disc, after in zip((ball, other), ball_ball_by(self.law, a, b, pair), strict=True):
            disc.vx = cos(impact) * after.n - cos(pi / 2 - impact) * after.t
            disc.vy = sin(impact) * after.n + sin(pi / 2 - impact) * after.t
        contact = Contact(i, j, (cos(impact), sin(impact)), pair)
        return impulse_of(contact, before, [ball.velocity, other.velocity])

    # -- what the trace needs --------------------------------------------------------------------

    def _note(self, i: int, lists: bool = True) -> None:
        """Write down where a ball is, and that it stops if it does."""
        disc = self.discs[i]
        if lists and not disc.moves:
            self.trace.stop(i, self.time, disc.place)
        else:
            self._breakpoint(i, self.time)

    def _breakpoint(self, i: int, t: float) -> None:
        disc = self.discs[i]
        self.trace.breakpoint(i, t, disc.place, disc.velocity, roll=disc.roll)

    def cut_off(self) -> None:
        for i in self.moving:
            self._note(i)

    # -- what can be skipped ---------------------------------------------------------------------

    def quiet(self) -> float:
        """Return a number of slices in which no overlap can begin or end, however the balls move.

        In one slice a ball travels no farther than its speed times dt, plus a rounding error of
        each coordinate. While it slips, its speed may grow up to that of its roll. So a gap lasts
        for at least gap / (how far both can travel in a slice) slices.
        """
        if not self.moving:
            return 0.0
        travels = [0.0] * len(self.discs)
        for i in self.moving:
            disc = self.discs[i]
            rounding = 4.0 * EPSILON * (abs(disc.x) + abs(disc.y) + self.radius[i])
            travels[i] = fastest(disc) * self.dt + rounding
        to_walls = [gap / travels[i] for i in self.moving for gap in self._wall_gaps(i)]
        least = min(to_walls, default=math.inf)
        for i in self.moving:
            x, y = self.discs[i].place
            for j in self.present:
                if j > i or travels[j] == 0.0:
                    u, v = self.discs[j].place
                    gap = abs(hypot(x - u, y - v) - self.radius[i] - self.radius[j])
                    least = min(least, gap / (travels[i] + travels[j]))
        if least < math.inf:
            return least * SAFE - 2.0
        # There is nothing to meet: these are the slices until every ball has stopped.
        loss = self.drag if self.rolls else self.loss
        speed = max(fastest(self.discs[i]) for i in self.moving)
        return speed / loss + 1.0 if loss > 0.0 else math.inf

    def _wall_gaps(self, i: int) -> Iterator[float]:
        """Yield how far (m) the ball is from cushions, and its centre from pockets."""
        table, (x, y), r = self.scene.table, self.discs[i].place, self.radius[i]
        for pocket in self.scene.pockets:
            yield hypot(x - pocket.position[0], y - pocket.position[1]) - pocket.radius
        for post in self.scene.posts:
            yield hypot(x - post.position[0], y - post.position[1]) - post.radius - r
        if table is not None and table.is_rectangle:
            x0, y0, x1, y1 = table.bounds
            yield min(x - x0, x1 - x, y - y0, y1 - y) - r
        elif table is not None:
            yield from (edge.distance(x, y) - r for edge in table.edges)


def fastest(disc: SlicedDisc) -> float:
    """Return a speed (m/s) above which a ball does not come before it meets something."""
    return max(hypot(*disc.velocity), hypot(*disc.roll))


def closing_speed(a: SlicedDisc, b: SlicedDisc) -> float:
    """Return how fast (m/s) two balls come together."""
    apart = hypot(a.x - b.x, a.y - b.y)
    if not apart > 0.0:
        return 0.0
    return ((b.x - a.x) * (a.vx - b.vx) + (b.y - a.y) * (a.vy - b.vy)) / apart


def in_frame(disc: SlicedDisc, impact: float) -> NT:
    """Return the velocity of a ball in the frame of an impact at this angle (Listing 3)."""
    speed, angle = hypot(*disc.velocity), atan2(disc.vy, disc.vx)
    return NT(cos(angle - impact) * speed, sin(angle - impact) * speed)
