"""This solver is the report's own: it advances every ball by a slice, then seeks overlaps.

A slice moves all balls (Eq. 10), then lets every ball answer the cushions (Eq. 9), then every pair
of balls in their order (Listing 3). The arithmetic is the listing's: angles come from atan2, and
cosine and sine turn the velocities, in the same order. So the rounding is reproduced as well.

The search for overlaps is skipped where it provably finds nothing. This is so for a ball at rest,
and for a cushion or another ball that is farther off than the balls can come in the slices that are
skipped. The arithmetic of every slice is done all the same, so skipping does not change a single
bit.

On polygon tables the listing's rule holds edge by edge, and at corners that stick out; a ball at
rest stays where it is. A ball that travels more than its radius in a slice can pass an edge there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from math import atan2, cos, hypot, pi, sin

from pool_pymunk.model import Point, Scene, State
from pool_pymunk.physics.contact import NT
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.record import Solver
from pool_pymunk.solvers.settings import Settings

MOST_QUIET = 100_000  # slices between two looks
SAFE = 1.0 - 1e-6  # of a gap: the balls provably do not cross this share of it, rounding included


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate with slices of ``settings.dt`` s; a contact is found up to one slice late.

    At 1e-6 s with law ``published``, this reproduces Listing 1 of the report to every printed
    digit.
    """
    assert settings.dt is not None
    slices = Slices(scene, start, settings.dt, settings.law_of(scene))
    trace = slices.trace
    last = math.inf if settings.max_time is None else math.ceil(settings.max_time / settings.dt)
    most = settings.most
    k = 0
    while slices.moving:
        if k >= last or len(trace.events) >= most:
            trace.status = "max_time" if k >= last else "max_events"
            trace.duration = k * settings.dt
            for i in slices.moving:
                slices.note(i, trace.duration)
            break
        quiet = min(slices.quiet(), last - k - 1, MOST_QUIET)
        if quiet > 0:
            slices.move(k, int(quiet))
            k += int(quiet)
        if slices.moving:
            moved = list(slices.moving)
            slices.move(k, 1)
            k += 1
            slices.look(moved, k * settings.dt)
        if settings.on_time is not None:
            settings.on_time(k * settings.dt)
        if not slices.is_finite():
            trace.status, trace.duration = "non_finite", k * settings.dt
            break
    trace.steps = k if trace.status != "settled" else round(trace.duration / settings.dt)
    return trace


class Slices:
    """This class holds the balls in the middle of a run, and advances them slice by slice."""

    def __init__(self, scene: Scene, start: State, dt: float, law: Law) -> None:
        self.scene = scene
        self.dt = dt
        self.loss = dt * scene.friction.surface * scene.physics.gravity
        self.law = law
        self.radius = [ball.radius for ball in scene.balls]
        self.x, self.y = ([p[axis] for p in start.position] for axis in (0, 1))
        self.vx, self.vy = ([v[axis] for v in start.velocity] for axis in (0, 1))
        self.colliding: set[tuple[int, int]] = set()
        self.trace = Trace(start)
        self.present = [i for i, ball in enumerate(scene.balls) if ball.id not in start.off]
        self.moving = [i for i in self.present if self._moves(i)]
        self.pairs = list(combinations(self.present, 2))
        self.first_look = True

    # -- motion ----------------------------------------------------------------------------------

    def move(self, done: int, slices: int) -> None:
        """Advance every moving ball by this many slices, after ``done`` slices; stop what stops."""
        travel = slide if self.loss > 0.0 else drift
        for i in self.moving:
            x, y, vx, vy, used = travel(
                (self.x[i], self.y[i]), (self.vx[i], self.vy[i]), self.loss, self.dt, slices
            )
            self.x[i], self.y[i], self.vx[i], self.vy[i] = x, y, vx, vy
            if vx == 0.0 and vy == 0.0:
                self.trace.stop(i, (done + used) * self.dt, (x, y))
        self.moving = [i for i in self.moving if self._moves(i)]

    # -- contacts --------------------------------------------------------------------------------

    def look(self, moved: list[int], t: float) -> None:
        """Answer overlaps with cushions, then those of pairs, for balls that have moved.

        Balls whose centres are within a pocket have left the table before.
        """
        moved = [i for i in moved if not self._is_pocketed(i, t)]
        if self.scene.table is not None:
            answer = self._rectangle if self.scene.table.is_rectangle else self._polygon
            for i in moved:
                answer(i, t)
        active = set(self.present if self.first_look else moved)
        self.first_look = False
        for i, j in self.pairs:
            if i in active or j in active:
                self._pair(i, j, t, active)
        self.moving = sorted(i for i in active if self._moves(i))

    def _moves(self, i: int) -> bool:
        return self.vx[i] != 0.0 or self.vy[i] != 0.0

    def _is_pocketed(self, i: int, t: float) -> bool:
        """Tell whether a pocket has the ball's centre, and take the ball off the table if so."""
        for number, pocket in enumerate(self.scene.pockets):
            cx, cy = pocket.position
            if hypot(self.x[i] - cx, self.y[i] - cy) <= pocket.radius:
                motion = self.x[i], self.y[i], self.vx[i], self.vy[i]
                self.trace.pocketed(i, t, number, motion, pocket.position)
                self.x[i], self.y[i], self.vx[i], self.vy[i] = cx, cy, 0.0, 0.0
                self.present.remove(i)
                self.pairs = [pair for pair in self.pairs if i not in pair]
                return True
        return False

    def _rectangle(self, i: int, t: float) -> None:
        """Answer the listing's cushions: first the two across x, then the two across y."""
        assert self.scene.table is not None
        x0, y0, x1, y1 = self.scene.table.bounds
        r = self.radius[i]
        across_x = self.x, self.vx, self.vy, x0 + r, x1 - r, (3, 1)
        across_y = self.y, self.vy, self.vx, y0 + r, y1 - r, (0, 2)
        for p, v, u, low, high, numbers in (across_x, across_y):
            if p[i] > high or p[i] < low:
                number, approach = numbers[p[i] > high], v[i]
                p[i] = min(max(p[i], low), high)
                v[i], u[i] = self._cushion(NT(v[i], u[i]))
                self._note_cushion(i, t, number, approach)

    def _polygon(self, i: int, t: float) -> None:
        """Answer cushions edge by edge by the listing's rule, and corners that stick out."""
        assert self.scene.table is not None
        r = self.radius[i]
        for number, edge in enumerate(self.scene.table.edges):
            height = edge.height(self.x[i], self.y[i])
            if -r < height < r and 0.0 <= edge.along(self.x[i], self.y[i]) <= edge.length:
                self._bounce(i, t, number, edge.normal, r - height)
        for number in self.scene.table.reflex_corners:
            corner_x, corner_y = self.scene.table.outline[number]
            dx, dy = self.x[i] - corner_x, self.y[i] - corner_y
            distance = hypot(dx, dy)
            if 0.0 < distance < r:
                self._bounce(i, t, number, (dx / distance, dy / distance), r - distance)

    def _bounce(self, i: int, t: float, number: int, normal: Point, depth: float) -> None:
        nx, ny = normal
        self.x[i] += depth * nx
        self.y[i] += depth * ny
        v = NT(self.vx[i] * nx + self.vy[i] * ny, self.vy[i] * nx - self.vx[i] * ny)
        if v.n < 0.0:
            n, s = self._cushion(v)
            self.vx[i], self.vy[i] = n * nx - s * ny, n * ny + s * nx
        self._note_cushion(i, t, number, min(v.n, 0.0))

    def _cushion(self, v: NT) -> NT:
        e = self.scene.restitution.cushion
        assert e is not None
        return self.law.cushion(v, e, self.scene.friction.cushion)

    def _note_cushion(self, i: int, t: float, number: int, approach: float) -> None:
        if approach == 0.0:  # The ball came to rest in this very slice and is only put back.
            self.trace.knot(i, t, (self.x[i], self.y[i]), (self.vx[i], self.vy[i]))
            return
        self.trace.ball_cushion(t, i, number)
        self.note(i, t)

    def _pair(self, i: int, j: int, t: float, active: set[int]) -> None:
        """Answer an overlap once; the pair answers again only after it has separated."""
        touching = hypot(self.x[i] - self.x[j], self.y[i] - self.y[j]) < (
            self.radius[i] + self.radius[j]
        )
        if touching and (i, j) not in self.colliding:
            self.colliding.add((i, j))
            if self._moves(i) or self._moves(j):
                self._collide(i, j, t)
                self.trace.ball_ball(t, i, j)
                active.update((i, j))
                self.note(i, t)
                self.note(j, t)
        elif not touching:
            self.colliding.discard((i, j))

    def _collide(self, i: int, j: int, t: float) -> None:
        """Answer a hit by Listing 3: turn to the frame of impact, apply the law, turn back."""
        impact = atan2(self.y[j] - self.y[i], self.x[j] - self.x[i])
        a, b, pair = self._in_frame(i, impact), self._in_frame(j, impact), self.scene.pair(i, j)
        if self.law.jumps(a, b, pair):
            self.trace.warn(
                f"law {self.law.name} jumps at zero slip: in the head-on hit of balls "
                f"{self.scene.balls[i].id} and {self.scene.balls[j].id} the slip was "
                f"{a.t - b.t:.0e} m/s, a rounding error, and its sign decided, as in the report",
                t,
            )
        after = self.law.ball_ball(a, b, pair)
        for ball, v in zip((i, j), after, strict=True):
            self.vx[ball] = cos(impact) * v.n - cos(pi / 2 - impact) * v.t
            self.vy[ball] = sin(impact) * v.n + sin(pi / 2 - impact) * v.t

    def _in_frame(self, i: int, impact: float) -> NT:
        speed = hypot(self.vx[i], self.vy[i])
        angle = atan2(self.vy[i], self.vx[i])
        return NT(cos(angle - impact) * speed, sin(angle - impact) * speed)

    # -- what the trace needs --------------------------------------------------------------------

    def note(self, i: int, t: float) -> None:
        """Write down where a ball is, and that it stops if it does."""
        if self.vx[i] == 0.0 and self.vy[i] == 0.0:
            self.trace.stop(i, t, (self.x[i], self.y[i]))
        else:
            self.trace.knot(i, t, (self.x[i], self.y[i]), (self.vx[i], self.vy[i]))

    def is_finite(self) -> bool:
        return all(math.isfinite(self.x[i] + self.y[i] + self.vx[i]) for i in self.moving)

    # -- what can be skipped ---------------------------------------------------------------------

    def quiet(self) -> float:
        """Return a number of slices in which no overlap can begin or end, however the balls move.

        In one slice a ball travels no farther than its speed times dt, plus a rounding error of
        each coordinate. So a gap lasts for at least gap / (how far both can travel in a slice)
        slices.
        """
        if not self.moving:
            return 0.0
        reach = [0.0] * len(self.x)
        for i in self.moving:
            rounding = 4.0 * EPSILON * (abs(self.x[i]) + abs(self.y[i]) + self.radius[i])
            reach[i] = hypot(self.vx[i], self.vy[i]) * self.dt + rounding
        to_cushions = (gap / reach[i] for i in self.moving for gap in self._wall_gaps(i))
        to_balls = (gap / (reach[i] + reach[j]) for i, j, gap in self._pair_gaps())
        least = min(min(to_cushions, default=math.inf), min(to_balls, default=math.inf))
        if least < math.inf:
            return least * SAFE - 2.0
        # There is nothing to meet: these are the slices until every ball has stopped.
        fastest = max(hypot(self.vx[i], self.vy[i]) for i in self.moving)
        return fastest / self.loss + 1.0 if self.loss > 0.0 else math.inf

    def _wall_gaps(self, i: int) -> Iterator[float]:
        """Yield how far (m) the ball is from cushions, and its centre from pockets."""
        table, r = self.scene.table, self.radius[i]
        x, y = self.x[i], self.y[i]
        for pocket in self.scene.pockets:
            yield hypot(x - pocket.position[0], y - pocket.position[1]) - pocket.radius
        if table is not None and table.is_rectangle:
            x0, y0, x1, y1 = table.bounds
            yield min(x - x0, x1 - x, y - y0, y1 - y) - r
        elif table is not None:
            yield from (edge.distance(x, y) - r for edge in table.edges)

    def _pair_gaps(self) -> Iterator[tuple[int, int, float]]:
        moving = set(self.moving)
        for i in self.moving:
            for j in self.present:
                if j not in moving or j > i:
                    distance = hypot(self.x[i] - self.x[j], self.y[i] - self.y[j])
                    yield i, j, abs(distance - self.radius[i] - self.radius[j])


def slide(
    p: Point, v: Point, loss: float, dt: float, slices: int
) -> tuple[float, float, float, float, int]:
    """Move one ball by this many slices of Eq. 10, as the listing computes them, or until it stops.

    Returns x, y, vx, vy and the slices used.
    """
    (x, y), (vx, vy) = p, v
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
            return x, y, 0.0, 0.0, used
    return x, y, vx, vy, slices


def drift(
    p: Point, v: Point, _loss: float, dt: float, slices: int
) -> tuple[float, float, float, float, int]:
    """Do the same without surface friction, where no velocity changes."""
    (x, y), (vx, vy) = p, v
    for _ in range(slices):
        x += vx * dt
        y += vy * dt
    return x, y, vx, vy, slices


PUBLISHED_STEP = 1e-6  # s; the report uses this slice

SOLVER = Solver(
    name="time-slice", solve=solve, about="the report's own algorithm", dt=PUBLISHED_STEP,
    late=True,
    limits="the report's method: contacts come up to a slice late, a pair answers only once "
    "until it has parted, contacts of one instant are answered one after the other, and rounding "
    "decides the sign of a slip of zero",
    ladder=(1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, PUBLISHED_STEP),
    stability_steps=(1e-5,), quick_stability_steps=(1e-4,), all_pairs=True,
    published_step=PUBLISHED_STEP, finest=1e-6, color="#d55e00", marker="D",
)  # fmt: skip
