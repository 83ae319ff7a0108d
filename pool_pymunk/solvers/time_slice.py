"""This solver is the report's own: it advances every ball by a slice, then seeks overlaps.

A slice moves all balls (Eq. 10), then answers each ball's overlaps with cushions (Eq. 9), then
those of each pair of balls in their order (Listing 3). The arithmetic is the listing's, so that its
rounding is reproduced as well. The search for overlaps is skipped where it provably finds nothing:
for a ball at rest, and where balls are too far off to touch within the skipped slices.

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

from pool_pymunk.model import Point, Scene, State, Table
from pool_pymunk.physics.contact import NO_BALL, NT, Contact, Pair
from pool_pymunk.physics.impulses import Impulse, impulse_of
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.sides import Wall
from pool_pymunk.physics.surface import GYRATION, NO_ROLL, SHARE
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.record import Settings, Solver, Stepping

Motion = list[float]  # x, y (m), vx, vy (m/s)

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
        self.motion: list[Motion] = [
            [*p, *v] for p, v in zip(start.position, start.velocity, strict=True)
        ]
        self.roll = list(start.roll or (NO_ROLL,) * len(self.motion))  # m/s
        self.colliding: set[tuple[int, int]] = set()
        self.present = [i for i, ball in enumerate(scene.balls) if ball.id not in start.off]
        self.moving = [i for i in self.present if self._moves(i)]
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
        self.is_finite = all(math.isfinite(sum(self.motion[i])) for i in self.moving)

    def move(self, slices: int) -> None:
        """Advance every moving ball by this many slices, and stop what stops."""
        travel = slide if self.loss > 0.0 else drift
        for i in self.moving:
            if self.rolls:
                self._move_sphere(i, slices)
                continue
            self.motion[i], used = travel(self.motion[i], self.loss, self.dt, slices)
            if not self._moves(i):
                x, y, _, _ = self.motion[i]
                self.trace.stop(i, (self.trace.steps + used) * self.dt, (x, y))
        self.moving = [i for i in self.moving if self._moves(i)]
        self.trace.steps += slices

    def _move_sphere(self, i: int, slices: int) -> None:
        """Advance a ball that slips until it rolls, and then until it rests."""
        travel, used = slide if self.drag > 0.0 else drift, 0
        while used < slices and self._moves(i):
            motion, roll, rest = self.motion[i], self.roll[i], slices - used
            slipped = tuple(motion[2:]) != roll
            if slipped and self.loss > 0.0:
                motion, roll, more = slip(motion, roll, self.loss, self.dt, rest)
            else:
                motion, more = travel(motion, self.drag, self.dt, rest)
                roll = roll if slipped else (motion[2], motion[3])
            used += more
            t = (self.trace.steps + used) * self.dt
            x, y, vx, vy = motion
            if slipped and (vx, vy) == roll:
                if hypot(vx, vy) > self.drag:
                    self.trace.roll(i, t)
                    self.trace.breakpoint(i, t, (x, y), roll, roll=roll)
                else:  # It would rest within a slice.
                    motion, roll = [x, y, 0.0, 0.0], NO_ROLL
            self.motion[i], self.roll[i] = motion, roll
            if not self._moves(i):
                self.trace.stop(i, t, (x, y))

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
        self.moving = sorted(i for i in active if self._moves(i))

    def _velocity(self, i: int) -> Point:
        return self.motion[i][2], self.motion[i][3]

    def _moves(self, i: int) -> bool:
        _, _, vx, vy = self.motion[i]
        return vx != 0.0 or vy != 0.0 or self.roll[i] != NO_ROLL

    def _is_pocketed(self, i: int) -> bool:
        """Tell whether a pocket has the ball's centre, and take the ball off the table if so."""
        center = self.pocketed(i, *self.motion[i])
        if center is not None:
            self.motion[i], self.roll[i] = [*center, 0.0, 0.0], NO_ROLL
            self.present.remove(i)
        return center is not None

    def _rectangle(self, i: int, table: Table) -> None:
        """Answer the listing's cushions: first the two across x, then the two across y."""
        motion, r = self.motion[i], self.radius[i]
        for axis, numbers in ((0, (3, 1)), (1, (0, 2))):
            low, high = table.bounds[axis] + r, table.bounds[axis + 2] - r
            at, approach = motion[axis], motion[axis + 2]
            if at > high or at < low:
                motion[axis] = min(max(at, low), high)
                wall, before = self.scene.cushions[numbers[at > high]], self._velocity(i)
                motion[axis + 2], motion[3 - axis] = self.law.cushion(
                    NT(approach, motion[3 - axis]), wall.restitution, wall.friction
                )
                self._rub(i, wall, (1.0 - axis, 0.0 + axis), motion[axis + 2] - approach)
                inwards = -1.0 if at > high else 1.0
                normal = (inwards * (1.0 - axis), inwards * axis)
                self._note_cushion(i, wall, approach, normal, before)

    def _overlaps(self, i: int) -> None:
        """Answer a ball's overlaps with the sides of walls, one by one, by the listing's rule."""
        r = self.radius[i]
        for wall in self.walls:
            for side in wall.sides:
                x, y, _, _ = self.motion[i]
                gap = side.gap(x, y, r)
                if -2.0 * r < gap < 0.0:
                    self._bounce(i, wall, side.normal(x, y), -gap)

    def _bounce(self, i: int, wall: Wall, normal: Point, depth: float) -> None:
        (x, y, vx, vy), (nx, ny), before = self.motion[i], normal, self._velocity(i)
        v = NT(vx * nx + vy * ny, vy * nx - vx * ny)
        if v.n < 0.0:
            n, s = self.law.cushion(v, wall.restitution, wall.friction)
            vx, vy = n * nx - s * ny, n * ny + s * nx
            self._rub(i, wall, normal, n - v.n)
        self.motion[i][:] = x + depth * nx, y + depth * ny, vx, vy
        self._note_cushion(i, wall, min(v.n, 0.0), normal, before)

    def _rub(self, i: int, wall: Wall, normal: Point, change: float) -> None:
        """Let friction slow the roll into a cushion that changed the normal velocity (m/s)."""
        if not self.rolls:
            return
        (wx, wy), (nx, ny) = self.roll[i], normal
        n = wx * nx + wy * ny
        less = copysign(min(wall.friction * abs(change) / GYRATION, abs(n)), n)
        self.roll[i] = wx - less * nx, wy - less * ny

    def _note_cushion(
        self, i: int, wall: Wall, approach: float, normal: Point, before: Point
    ) -> None:
        """List a hit, or none if the ball came to rest in this slice and is only put back."""
        if abs(approach) > self.press:
            pair = Pair(self.scene.balls[i].mass, math.inf, wall.restitution, wall.friction)
            contact = Contact(i, NO_BALL, normal, pair)
            push = impulse_of(contact, [before], [self._velocity(i)])
            self.trace.ball_cushion(self.time, i, wall.number, push)
        self._note(i, lists=approach != 0.0)

    def _pair(self, i: int, j: int, active: set[int]) -> None:
        """Answer an overlap once; the pair answers again only after it has separated."""
        (x, y, _, _), (u, v, _, _) = self.motion[i], self.motion[j]
        if not hypot(x - u, y - v) < self.radius[i] + self.radius[j]:
            self.colliding.discard((i, j))
            return
        # Balls that roll answer whenever they close, because a roll may drive them together.
        closing = self._closing(i, j) if self.rolls else 0.0
        if (i, j) not in self.colliding or closing > 0.0:
            self.colliding.add((i, j))
            if self._moves(i) or self._moves(j):
                push = self._collide(i, j)
                if not self.rolls or closing > 2.0 * self.press:
                    self.trace.ball_ball(self.time, i, j, push)
                active.update((i, j))
                self._note(i)
                self._note(j)

    def _closing(self, i: int, j: int) -> float:
        """Return how fast (m/s) two balls come together."""
        (x, y, vx, vy), (u, v, ux, uy) = self.motion[i], self.motion[j]
        apart = hypot(x - u, y - v)
        return ((u - x) * (vx - ux) + (v - y) * (vy - uy)) / apart if apart > 0.0 else 0.0

    def _collide(self, i: int, j: int) -> Impulse:
        """Answer a hit by Listing 3: turn to the frame of impact, apply the law, turn back.

        Return its impulse.
        """
        before = [self._velocity(i), self._velocity(j)]
        (x, y, _, _), (u, v, _, _) = self.motion[i], self.motion[j]
        impact = atan2(v - y, u - x)
        a, b, pair = self._in_frame(i, impact), self._in_frame(j, impact), self.scene.pair(i, j)
        if self.law.jumps(a, b, pair):
            self.trace.warn(
                f"in the hit of balls {self.scene.balls[i].id} and {self.scene.balls[j].id} the "
                f"slip was only a rounding error ({a.t - b.t:.0e} m/s), and its sign decided the "
                f"friction of law {self.law.name}. The report's program does the same",
                self.time,
            )
        for ball, after in zip((i, j), self.law.ball_ball(a, b, pair), strict=True):
            self.motion[ball][2:] = (
                cos(impact) * after.n - cos(pi / 2 - impact) * after.t,
                sin(impact) * after.n + sin(pi / 2 - impact) * after.t,
            )
        contact = Contact(i, j, (cos(impact), sin(impact)), pair)
        return impulse_of(contact, before, [self._velocity(i), self._velocity(j)])

    def _in_frame(self, i: int, impact: float) -> NT:
        _, _, vx, vy = self.motion[i]
        speed, angle = hypot(vx, vy), atan2(vy, vx)
        return NT(cos(angle - impact) * speed, sin(angle - impact) * speed)

    # -- what the trace needs --------------------------------------------------------------------

    def _note(self, i: int, lists: bool = True) -> None:
        """Write down where a ball is, and that it stops if it does."""
        x, y, vx, vy = self.motion[i]
        if lists and not self._moves(i):
            self.trace.stop(i, self.time, (x, y))
        else:
            self.trace.breakpoint(i, self.time, (x, y), (vx, vy), roll=self.roll[i])

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
        travels = [0.0] * len(self.motion)
        for i in self.moving:
            x, y, _, _ = self.motion[i]
            rounding = 4.0 * EPSILON * (abs(x) + abs(y) + self.radius[i])
            travels[i] = self._fastest(i) * self.dt + rounding
        to_walls = [gap / travels[i] for i in self.moving for gap in self._wall_gaps(i)]
        least = min(to_walls, default=math.inf)
        for i in self.moving:
            x, y, _, _ = self.motion[i]
            for j in self.present:
                if j > i or travels[j] == 0.0:
                    u, v, _, _ = self.motion[j]
                    gap = abs(hypot(x - u, y - v) - self.radius[i] - self.radius[j])
                    least = min(least, gap / (travels[i] + travels[j]))
        if least < math.inf:
            return least * SAFE - 2.0
        # There is nothing to meet: these are the slices until every ball has stopped.
        loss = self.drag if self.rolls else self.loss
        fastest = max(self._fastest(i) for i in self.moving)
        return fastest / loss + 1.0 if loss > 0.0 else math.inf

    def _fastest(self, i: int) -> float:
        """Return a speed (m/s) above which the ball does not come before it meets something."""
        return max(hypot(*self.motion[i][2:]), hypot(*self.roll[i]))

    def _wall_gaps(self, i: int) -> Iterator[float]:
        """Yield how far (m) the ball is from cushions, and its centre from pockets."""
        table, (x, y, _, _), r = self.scene.table, self.motion[i], self.radius[i]
        for pocket in self.scene.pockets:
            yield hypot(x - pocket.position[0], y - pocket.position[1]) - pocket.radius
        for post in self.scene.posts:
            yield hypot(x - post.position[0], y - post.position[1]) - post.radius - r
        if table is not None and table.is_rectangle:
            x0, y0, x1, y1 = table.bounds
            yield min(x - x0, x1 - x, y - y0, y1 - y) - r
        elif table is not None:
            yield from (edge.distance(x, y) - r for edge in table.edges)


def slide(motion: Motion, loss: float, dt: float, slices: int) -> tuple[Motion, int]:
    """Move a ball by slices of Eq. 10, as in the listing, or until it stops; count those used."""
    x, y, vx, vy = motion
    for used in range(1, slices + 1):
        angle = atan2(vy, vx)
        old = hypot(vx, vy)
        new = old - loss
        if new < 0.0:
            new = 0.0
        c = cos(angle)
        s = sin(angle)
        x += c * (old + new) / 2 * dt
        y += s * (old + new) / 2 * dt
        vx = c * new
        vy = s * new
        if new == 0.0:
            return [x, y, 0.0, 0.0], used
    return [x, y, vx, vy], slices


def slip(
    motion: Motion, roll: Point, loss: float, dt: float, slices: int
) -> tuple[Motion, Point, int]:
    """Move a ball that slips by this many slices, or until it rolls; count those used."""
    (x, y, vx, vy), (wx, wy) = motion, roll
    for used in range(1, slices + 1):
        ux, uy = vx - wx, vy - wy
        share = min(loss / hypot(ux, uy), SHARE)
        x += (vx - share * ux / 2) * dt
        y += (vy - share * uy / 2) * dt
        vx -= share * ux
        vy -= share * uy
        if share == SHARE:
            return [x, y, vx, vy], (vx, vy), used
        wx += share * ux / GYRATION
        wy += share * uy / GYRATION
    return [x, y, vx, vy], (wx, wy), slices


def drift(motion: Motion, _loss: float, dt: float, slices: int) -> tuple[Motion, int]:
    """Move a ball by slices without surface friction, where no velocity changes."""
    x, y, vx, vy = motion
    for _ in range(slices):
        x += vx * dt
        y += vy * dt
    return [x, y, vx, vy], slices


PUBLISHED_STEP = 1e-6  # s; the report uses this slice

SOLVER = Solver(
    name="time-slice", solve=solve, about="the report's own algorithm", dt=PUBLISHED_STEP,
    late=True, rolls=True,
    limits="the report's method: contacts come up to a slice late, a pair answers only once "
    "until it has parted (unless its balls roll), contacts of one instant are answered one after "
    "the other, and rounding decides the sign of a slip of zero",
    ladder=(1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, PUBLISHED_STEP),
    stability_steps=(1e-5,), quick_stability_steps=(1e-4,), all_pairs=True,
    published_step=PUBLISHED_STEP, finest=1e-6, color="#d55e00", marker="D",
)  # fmt: skip
