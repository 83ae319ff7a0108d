"""Changes go through a contact, which does four things to them.

It comes at another time. At that time the states are changed by more, because they went on changing
until then. The law answers other velocities, along a normal that has turned. And the balls have
been on their new paths for more or less time. Written as a matrix, the four are the saltation
matrix (Kong, Payne, Zhu and Johnson, Saltation Matrices: The Essential Tool for Linearizing Hybrid
Dynamical Systems, Proceedings of the IEEE 112, 2024, 585).
"""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import i64, mypyc_attr

from pool_pymunk.core.contact.contact import NT
from pool_pymunk.core.contact.laws import Law
from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent import rounding
from pool_pymunk.core.tangent.change import BLUR, GRAZE, SAME, Change, Column, Rates
from pool_pymunk.core.tangent.course import Step
from pool_pymunk.core.tangent.differences import off_of
from pool_pymunk.core.tangent.inputs import E_BALLS, E_CUE, E_WALLS, MU_BALLS, MU_WALLS, Inputs
from pool_pymunk.core.tangent.kinks import hit_of, sides_of
from pool_pymunk.core.tangent.rounding import UNIT, RoundingErrors
from pool_pymunk.core.tangent.slopes import Four, Hit, largest
from pool_pymunk.core.tangent.track import Track

# of the speeds (the root of rounding); a velocity farther off the law's answer is a policy's
AGREE: Final = 1e-8


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Encounter:
    """This is a contact of ball ``a`` with ball ``b`` or with a wall, and how it closes.

    The normal points to ball b, or from the wall to ball a. With the velocity of what it points to
    relative to the other side, ``closing`` (m/s) is how fast the gap shrinks, and ``slip`` how fast
    the two move along each other. Without a hit they would sink into each other by ``depth`` (m)
    before they part again. ``curvature`` (1/m) says how fast the normal turns as they move along.
    """

    def __init__(self, step: Step, a: Track, b: Track | None, rolls: bool) -> None:
        self.step: Final = step
        self.a: Final = a
        self.b: Final = b
        self.rolls = rolls
        nx, ny, t = step.nx, step.ny, step.t
        self.nx, self.ny = nx, ny
        self.x, self.y, vx, vy = a.path.at(t)
        self.fastest = max(abs(vx), abs(vy))
        self.extent = abs(self.x) + abs(self.y) + a.radius
        self.before: Final = Rates(a.path, vx, vy, rolls)
        self.its_before = self.before
        self.curvature = step.curvature
        ux, uy, ax, ay = vx, vy, a.path.ax, a.path.ay
        if b is not None:
            x, y, its_vx, its_vy = b.path.at(t)
            self.its_before = Rates(b.path, its_vx, its_vy, rolls)
            self.fastest = max(self.fastest, max(abs(its_vx), abs(its_vy)))
            self.extent += abs(x) + abs(y) + b.radius
            x, y = x - self.x, y - self.y
            self.curvature = 1.0 / math.sqrt(x * x + y * y)
            ux, uy, ax, ay = its_vx - vx, its_vy - vy, b.path.ax - ax, b.path.ay - ay
        self.closing, self.slip = -(ux * nx + uy * ny), uy * nx - ux * ny
        out = ax * nx + ay * ny + self.curvature * self.slip * self.slip
        self.depth: Final = self.closing * self.closing / (2.0 * out) if out > 0.0 else INF
        self.mu: Final = 0.0 if step.pair is None else step.pair.friction
        self.after: Final = rates_after(a, rolls)
        self.its_after: Final = self.after if b is None else rates_after(b, rolls)

    @property
    def is_graze(self) -> bool:
        """This tells whether rounding may decide that the contact comes at all."""
        return self.closing <= GRAZE * self.fastest or self.depth <= BLUR * self.extent

    def _parts(self, rates: Rates) -> NT:
        """Return the parts (m/s) of a velocity along the normal and across it."""
        vx, vy, nx, ny = rates.vx, rates.vy, self.nx, self.ny
        return vx * nx + vy * ny, vy * nx - vx * ny

    # -- before the law ----------------------------------------------------------------------------

    def come_late(self, columns: list[Column], inputs: Inputs) -> None:
        """Find how late the contact comes, and take the changes to that time.

        A gap g that closes at a speed c, and is wider by dg, closes later by dg / c. The normal
        turns as the place moves across it.
        """
        a, b, nx, ny = self.a, self.b, self.nx, self.ny
        a_n, a_t = self._parts(self.before)
        b_n, b_t = self._parts(self.its_before)
        other = a if b is None else b
        own, its = inputs.radius[a.number], inputs.radius[other.number]
        for column, c, d, of_a, of_b in zip(columns, a.changes, other.changes, own, its):
            x, y, gap = c.x, c.y, column.gap - of_a
            if b is not None:
                x, y, gap = d.x - x, d.y - y, gap - of_b
            late = (nx * x + ny * y + gap) / self.closing
            turn = self.curvature * (nx * y - ny * x + self.slip * late) + column.turned
            column.late, column.turn = late, turn
            if late != 0.0:
                c.advance(self.before, late)
            by = column.by
            by.an = nx * c.vx + ny * c.vy + a_t * turn
            by.at = nx * c.vy - ny * c.vx - a_n * turn
            by.bn = by.bt = 0.0
            if b is not None:
                if late != 0.0:
                    d.advance(self.its_before, late)
                by.bn = nx * d.vx + ny * d.vy + b_t * turn
                by.bt = nx * d.vy - ny * d.vx - b_n * turn

    # -- the law -----------------------------------------------------------------------------------

    def is_usual(self, table: Table, a_is_cue: bool) -> bool:
        """Tell whether the law is asked with the table's numbers: a scene may have other pairs."""
        pair = self.step.pair
        if self.b is None or pair is None:
            return True
        e = table.cue_restitution if a_is_cue else table.restitution
        same = pair.m_a == self.a.mass and pair.m_b == self.b.mass
        return same and pair.restitution == e and pair.friction == table.friction

    def hit(self, law: Law, minds_kinks: bool) -> Hit:
        """Return the hit as the law is asked about it."""
        pair, b = self.step.pair, (0.0, 0.0)
        assert pair is not None, "it is a hit"
        if self.b is not None:
            b = self._parts(self.its_before)
        return hit_of(law, self._parts(self.before), b, pair, self.b is None, minds_kinks)

    def sides(self, hit: Hit, columns: list[Column], minds_kinks: bool) -> list[Hit]:
        """Return the hits on all sides of a kink of the law; none where it jumps."""
        moves_a, moves_b = hit.a != (0.0, 0.0), hit.b != (0.0, 0.0)
        if minds_kinks:
            moves_a = any(column.by.at != 0.0 for column in columns)
            moves_b = any(column.by.bt != 0.0 for column in columns)
        return sides_of(hit, moves_a, moves_b, self.fastest, minds_kinks)

    def is_by_law(self, hit: Hit) -> bool:
        """Tell whether the law has answered this hit, and no policy."""
        a, b, c, d = hit.after
        n, t = self._parts(self.after)
        m = r = 0.0
        if self.b is None:
            n -= self.step.kick
        else:
            m, r = self._parts(self.its_after)
        return largest(n - a, t - b, m - c, r - d) <= AGREE * self.fastest

    def answer(self, sides: list[Hit], columns: list[Column], inputs: Inputs, cue: bool) -> None:
        """Give the changes the law's answer: the mean of those on all sides of a kink.

        Where they differ, the column is bent. The normal of the new velocities has turned, too.
        """
        a, b, nx, ny = self.a, self.b, self.nx, self.ny
        e, mu = self._coefficients(inputs, cue)
        after, its_after = self.after, self.its_after
        a_n, a_t = self._parts(after)
        b_n, b_t = self._parts(its_after)
        roll = self._roll() if self.rolls and b is None else (0.0, 0.0)
        other = a if b is None else b
        of_a, of_b = inputs.mass[a.number], inputs.mass[other.number]
        p: i64 = -1
        for column, c, d in zip(columns, a.changes, other.changes):
            p += 1
            turn, by = column.turn, column.by
            by.e, by.mu = e[p], mu[p]
            by.m_a = by.m_b = 0.0
            if b is not None:
                by.m_a, by.m_b = of_a[p], of_b[p]
            column.is_bent = False
            if column.late == 0.0 and turn == 0.0 and by.is_zero and c.wx == 0.0 and c.wy == 0.0:
                continue
            n, t, m, r = mean_slope(sides, column)
            if self.rolls and b is None:
                self._slow_roll(c, column, n - by.an, roll)
            n, t = n - turn * a_t, t + turn * a_n
            c.vx, c.vy = nx * n - ny * t, ny * n + nx * t
            c.advance(after, -column.late)
            if b is not None:
                m, r = m - turn * b_t, r + turn * b_n
                d.vx, d.vy = nx * m - ny * r, ny * m + nx * r
                d.advance(its_after, -column.late)

    def _coefficients(self, inputs: Inputs, cue: bool) -> tuple[list[float], list[float]]:
        """Return how the inputs change restitution and friction of the contact."""
        numbers, wall, none = inputs.numbers, self.step.wall, inputs.numbers[-1]
        if self.b is not None or wall is None:
            return numbers[E_CUE if cue else E_BALLS], numbers[MU_BALLS]
        place = wall.place
        e = none if inputs.own_restitution[place] else numbers[E_WALLS]
        return e, (none if inputs.own_friction[place] else numbers[MU_WALLS])

    def _roll(self) -> Vector:
        """Return the roll (m/s) of ball a at the contact."""
        path = self.a.path
        if path.slows:
            return self.before.vx, self.before.vy
        time = self.step.t - path.t
        return path.wx + time * self.before.px, path.wy + time * self.before.py

    def _slow_roll(self, c: Change, column: Column, by_push: float, roll: Vector) -> None:
        """Let a cushion take (5/2) mu |v_n' - v_n| off the part of a roll along its normal.

        It does not change the sign of this part.
        """
        nx, ny, mu, turn = self.nx, self.ny, self.mu, column.turn
        wx, wy = roll
        after = self.after
        part, across = wx * nx + wy * ny, wy * nx - wx * ny
        push = (after.vx - self.before.vx) * nx + (after.vy - self.before.vy) * ny
        most = mu * push / GYRATION
        if most > abs(part):  # All of it goes.
            taken, less = part, nx * c.wx + ny * c.wy + turn * across
        else:
            taken = math.copysign(most, part)
            less = math.copysign(1.0, part) * (column.by.mu * push + mu * by_push) / GYRATION
        c.wx -= nx * less - ny * turn * taken
        c.wy -= ny * less + nx * turn * taken

    # -- rounding ----------------------------------------------------------------------------------

    def misjudge(self, errors: RoundingErrors, columns: list[Column]) -> bool:
        """Draw errors of the gap, of the time and of the normal; tell whether one can go on.

        The errors before a graze change its closing speed. A gap g changes a closing speed c, at
        the slip s and the curvature k, to the root of c^2 +- 2 s^2 k g. It therefore changes c by
        s^2 k g / c, but by no more than s sqrt(2 k g). The linear map gives this bound for a
        contact that closes at s sqrt(k g / 2). One cannot go on if errors grow so large that other
        contacts may come.
        """
        t, a, b, wall = self.step.t, self.a, self.b, self.step.wall
        gap, kind = 0.0, self.step.a + self.step.other  # Contacts of one kind err alike.
        if b is not None:
            gap = errors.gap_of_balls(a.path, b.path, t, a.radius + b.radius)
        elif wall is not None:
            kind += wall.place
            side = wall.nearest(self.x, self.y, a.radius, t)
            gap = errors.gap_at_side(side, a.path, t, a.radius)
        errors.begin(kind)
        errors.draw(gap + UNIT * t * self.closing, rounding.TIMES, 0)
        for p, column in enumerate(columns):
            column.gap = errors.of(p)
        errors.draw(2.0 * UNIT * abs(self.nx * self.ny), rounding.TIMES, 1)
        for p, column in enumerate(columns):
            column.turned = errors.of(p)
        if self.curvature <= 0.0:
            return True
        others = None if b is None else b.changes
        far, along = rounding.sizes_of(a.changes, others, self.nx, self.ny)
        slip = abs(self.slip)
        least = slip * math.sqrt(self.curvature * max(gap, far) / 2.0)
        self.closing = max(self.closing, least)
        return self.curvature * (along + slip * far / self.closing) <= rounding.TURNED

    def round_answer(self, errors: RoundingErrors, hit: Hit) -> None:
        """Draw errors of the new velocities and of the new paths.

        The parts of the velocities before a contact are sums of products, and so err by a unit of
        each. A part that the law does not change keeps every bit. A normal errs by a unit.
        """
        a, b, nx, ny = self.a, self.b, self.nx, self.ny
        vx, vy, share = abs(self.before.vx), abs(self.before.vy), 1.0
        if b is not None:
            vx, vy = vx + abs(self.its_before.vx), vy + abs(self.its_before.vy)
            share = b.mass / (a.mass + b.mass)
        skew = UNIT * (2.0 if nx != 0.0 and ny != 0.0 else 1.0)
        along, across = abs(nx) * vx + abs(ny) * vy, abs(ny) * vx + abs(nx) * vy
        parts = skew * along, skew * across
        n, t, m, r = hit.after
        self._round(errors, a, hit.a, (n, t), share, parts)
        if b is not None:
            self._round(errors, b, hit.b, (m, r), 1.0 - share, parts)

    def _round(
        self, errors: RoundingErrors, track: Track, asked: NT, answer: NT, share: float,
        parts: Vector,
    ) -> None:  # fmt: skip
        """Draw errors of the new velocity of one ball, and of its path."""
        along, across = parts
        after = self.after if track is self.a else self.its_after
        made_n, made_t = self._parts(after)
        asked_n, asked_t = asked
        answer_n, answer_t = answer
        if track is self.a:
            made_n -= self.step.kick
        n = abs(made_n - answer_n) + (share * along if made_n != asked_n else 0.0)
        t = abs(made_t - answer_t) + (share * across if made_t != asked_t else 0.0)
        errors.add(track.changes, 2, UNIT * abs(after.vx), rounding.ANSWERS, 0)
        errors.add(track.changes, 3, UNIT * abs(after.vy), rounding.ANSWERS, 1)
        errors.push(track.changes, self.nx, self.ny, n, 2)
        errors.push(track.changes, -self.ny, self.nx, t, 3)
        path = track.following
        if self.rolls and path is not None:
            errors.add(track.changes, 4, UNIT * abs(path.wx), rounding.PATHS, 0)
            errors.add(track.changes, 5, UNIT * abs(path.wy), rounding.PATHS, 1)


def rates_after(track: Track, rolls: bool) -> Rates:
    """Return the rates with which a ball sets off on its next path."""
    path = track.following
    assert path is not None, "a hit sets its balls off"
    return Rates(path, path.vx, path.vy, rolls)


def mean_slope(sides: list[Hit], column: Column) -> Four:
    """Return the mean slope on all sides of a kink, and note whether they differ."""
    by = column.by
    n, t, m, r = sides[0].slope(by)
    column.is_bent = n != n and by.is_known
    if len(sides) == 1:
        return n, t, m, r
    first, share, most = (n, t, m, r), 1.0 / len(sides), 2.0 * SAME * by.size
    n = t = m = r = 0.0
    for side in sides:
        n1, t1, m1, r1 = side.slope(by)
        column.is_bent = column.is_bent or off_of((n1, t1, m1, r1), first) > most
        n, t, m, r = n + share * n1, t + share * t1, m + share * m1, r + share * r1
    return n, t, m, r
