"""This module makes the scenes with known answers that other programs play, too (``torture/``).

All numbers are those of the torture suite, which is exported from this row.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from pool_pymunk.model import Ball, Friction, Physics, Point, Restitution, Scene, Table
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.making import REST, SMOOTH, rectangle, unit
from pool_pymunk.studies.stability.trial import Case, Claim

R, POOL, M = 0.03, 0.028575, 0.17  # m, m, kg
G = 9.81  # m/s^2
LIGHT, HEAVY = 1e-3, 1e3  # kg
AROUND = rectangle(2.54, 1.27, (-1.27, -0.635))
ELASTIC = Restitution(1.0, cushion=1.0)
SLIDES, ROLLS = Friction(0.2), Friction(0.2, rolling=0.01)

Row = Sequence[float]  # x, y (m), and vx, vy (m/s) of a ball that moves


def played(
    label: str, rows: Sequence[Row], time: float, *claims: Claim, table: Table | None = None,
    r: float = R, masses: Sequence[float] = (), e: Restitution = ELASTIC,
    friction: Friction = SMOOTH, roll: float = 0.0, **more: Any,
) -> Case:  # fmt: skip
    """Return the case of a scene of equal balls, or of balls of these ``masses`` (kg)."""
    balls = list[Ball]()
    for (x, y, *v), mass in zip(rows, masses or [M] * len(rows), strict=True):
        velocity = (v[0], v[1]) if v else REST
        balls.append(Ball(str(len(balls)), (x, y), r, mass, velocity=velocity, roll=roll))
    physics = Physics(gravity=G, max_time=time)
    return Case(label, Scene(tuple(balls), table, e, friction, physics), claims, **more)


def velocities(*ends: Point) -> Claim:
    """Claim the velocities (m/s) of all balls at the end."""
    return must.leave_with({str(k): end for k, end in enumerate(ends)})


def places(*ends: Point) -> Claim:
    """Claim the places (m) of all balls at the end."""
    return must.end_at({str(k): end for k, end in enumerate(ends)})


# -- closed forms ----------------------------------------------------------------------------------


def in_box(start: Point, velocity: Point, r: float, size: Point, time: float) -> Point:
    """Return where a lone ball in a rectangle from the origin is (m), e = 1."""
    one, other = zip(start, velocity, size, strict=True)
    (x, y) = (_folded(at - r, v * time, wide - 2.0 * r) + r for at, v, wide in (one, other))
    return x, y


def _folded(start: float, path: float, width: float) -> float:
    """Return where a point between two mirrors is (m), by a straight path that is folded."""
    unfolded = (start + path) % (2.0 * width)
    return min(unfolded, 2.0 * width - unfolded)


def in_wedge(start: Point, velocity: Point, half: float, time: float) -> Point:
    """Return where a lone ball is (m) in a wedge from the origin, by an unfolded path."""
    tip = R / math.sin(half)  # m; the tip of the wedge of centres
    x, y = start[0] - tip + velocity[0] * time, start[1] + velocity[1] * time
    angle = _folded(math.atan2(y, x) + half, 0.0, 2.0 * half) - half
    return tip + math.hypot(x, y) * math.cos(angle), math.hypot(x, y) * math.sin(angle)


def elastic(m: float, v: float, other_m: float, other_v: float) -> tuple[float, float]:
    """Return both velocities (m/s) after a head-on hit with e = 1."""
    common = (m * v + other_m * other_v) / (m + other_m)
    return 2.0 * common - v, 2.0 * common - other_v


def pi_velocities(light: float, heavy: float) -> tuple[float, float, int]:
    """Return both last velocities (m/s), and the hits, of Galperin's balls and a wall."""
    v, big, hits = 0.0, -1.0, 0
    while v > big or v < 0.0:
        v, big = elastic(light, v, heavy, big) if v > big else (-v, big)
        hits += 1
    return v, big, hits


def roll_on(speed: float, roll: float) -> float:
    """Return how far (m) a ball moves along its line: it slides, then rolls, then rests."""
    slip, rolls_at = speed - roll, speed - 2.0 / 7.0 * (speed - roll)
    slides = 2.0 / 7.0 * abs(slip) / (ROLLS.surface * G)
    return (speed + rolls_at) / 2.0 * slides + rolls_at**2 / (2.0 * 0.01 * G)


def rack(tip: Point, gap: float = 0.0, r: float = R, along: Point = (1.0, 0.0)) -> list[Row]:
    """Return fifteen balls in a triangle that opens along ``along`` from its tip."""
    step, (a, b), (x, y) = (2.0 + gap) * r, along, tip
    at = [
        (k * step * math.sqrt(0.75), (j - k / 2.0) * step) for k in range(5) for j in range(k + 1)
    ]
    return [(x + a * u - b * w, y + b * u + a * w) for u, w in at]


# -- the scenes ------------------------------------------------------------------------------------

SIX: tuple[Row, ...] = (
    (0.5, 0.6, 4.0, 0.15), (1.5, 0.635), (1.62, 0.7), (1.64, 0.56), (1.9, 0.65), (2.1, 0.3),
)  # fmt: skip
# These are the places (m) of SIX after 2 s, in forty digits; tests/test_torture.py computes them.
SIX_ENDS = (
    (1.44122631104375061, 0.929414110556115874), (1.9412329216008767, 0.305649623903262667),
    (1.62, 0.7), (1.64, 0.56), (1.874297236299658, 0.0635624828980220188),
    (2.50816199634496953, 1.21520200375483121),
)  # fmt: skip
MIRROR = [  # No ball is on the axis, so every hit is of two balls.
    (x, side * y, vx, side * vy)
    for x, y, vx, vy in ((-1.0, 0.3, 2.0, -0.1), (0.0, 0.24, *REST), (0.3, 0.1, *REST),
                         (0.6, 0.35, *REST))
    for side in (1.0, -1.0)
]  # fmt: skip


def known_answers() -> Iterator[Case]:
    """Play the scenes of the torture suite by all solvers."""
    yield from balls_that_meet()
    yield from walls()
    yield from unequal_and_inelastic()
    yield from braked()


def balls_that_meet() -> Iterator[Case]:
    """Make elastic hits of equal balls, alone, at one instant, in racks, and within a graze."""
    yield played(
        "fast ball, ball at rest", [(0.0, 0.0, 100.0, 0.0), (1.0, 0.0)], 0.05,
        velocities(REST, (100.0, 0.0)),
    )  # fmt: skip
    leaves, (x, y) = 2.0 * math.sqrt(3.0) / 5.0, unit(30.0)
    touching = [(-0.5, 0.0, 1.0, 0.0), (0.0, 0.03), (0.0, -0.03)]
    after = velocities((-0.2, 0.0), (leaves * x, leaves * y), (leaves * x, -leaves * y))
    yield played("three balls at once", touching, 1.0, after)
    row = [(-0.5, 0.0, 1.0, 0.0), *((0.06 * k, 0.0) for k in range(5))]
    yield played("Newton's cradle", row, 1.0, velocities(*[REST] * 5, (1.0, 0.0)))
    rows = [(-0.6, 0.0, 3.0, 0.0), *rack((0.3, 0.0))]
    yield played("frozen rack", rows, 0.5, must.mirrored, table=AROUND)
    yield played("mirror", MIRROR, 3.0, must.mirrored, table=AROUND)
    for label, share in (("thin cut", 1e-3), ("graze", 1e-9)):
        across = 2.0 * R * (1.0 - share)
        x, y = math.sqrt(4.0 * R * R - across**2) / (2.0 * R), across / (2.0 * R)
        hit = velocities((1.0 - x * x, -x * y), (x * x, x * y))
        yield played(label, [(-0.5, 0.0, 1.0, 0.0), (0.0, across)], 1.0, hit)


def walls() -> Iterator[Case]:
    """Make elastic bounces, of balls alone and of several."""
    room, square, table = rectangle(2.0, 1.0), rectangle(4.5, 4.5), rectangle(2.54, 1.27)
    there = in_box((0.4, 0.5), (100.0, 7.0), R, (2.0, 1.0), 0.5)
    yield played("fast ball, thin walls", [(0.4, 0.5, 100.0, 7.0)], 0.5, places(there), table=room)
    v = math.sqrt(2.0)
    for label, y in (("corner", 1.0 + 1e-9), ("corner, both walls at once", 1.0)):
        there = in_box((1.0, y), (v, v), POOL, (4.5, 4.5), 6.0)
        yield played(label, [(1.0, y, v, v)], 6.0, places(there), table=square, r=POOL)
    half = math.radians(10.0)
    wedge = Table(tuple((u, v * math.tan(half)) for u, v in ((0, 0), (4, -4), (4, 4))))
    there = in_wedge((3.0, 0.1), (-1.0, 0.02), half, 5.5)
    yield played("wedge", [(3.0, 0.1, -1.0, 0.02)], 5.5, places(there), table=wedge)
    bounces = [(0.5, 0.5, 1.9, 0.7)]
    yield played("e = 1, a thousand bounces", bounces, 600.0, table=room, slow=True)
    gas = [
        (0.15 + 0.23 * (k % 4), 0.2 + 0.3 * (k // 4), math.cos(2.4 * k), math.sin(2.4 * k))
        for k in range(10)
    ]
    yield played("ten balls in a box", gas, 25.0, table=rectangle(1.0, 1.0), slow=True)
    yield played("reversal", SIX[:4], 2.0, table=table)
    yield played("six balls", SIX, 2.0, places(*SIX_ENDS), table=table)


def unequal_and_inelastic() -> Iterator[Case]:
    """Make hits of a heavy and a light ball, and a collapse of three in a row."""
    fast, slow = elastic(LIGHT, 0.0, HEAVY, 1.0)
    rows, masses = [(0.5, 0.0), (0.0, 0.0, 1.0, 0.0)], (LIGHT, HEAVY)
    hit = velocities((fast, 0.0), (slow, 0.0))
    yield played("heavy on light", rows, 1.0, hit, masses=masses)
    back, on = elastic(LIGHT, 1.0, HEAVY, 0.0)
    rows = [(0.0, 0.0, 1.0, 0.0), (0.5, 0.0)]
    yield played("light on heavy", rows, 1.0, velocities((back, 0.0), (on, 0.0)), masses=masses)
    light, heavy, hits = pi_velocities(LIGHT, HEAVY)
    rows, last = [(0.5, 1.0), (1.5, 1.0, -1.0, 0.0)], velocities((light, 0.0), (heavy, 0.0))
    yield played(
        "three digits of pi", rows, 4.0, last, must.contacts_are(hits),
        table=rectangle(10.0, 2.0), masses=masses,
    )  # fmt: skip
    rows = [(-0.5, 0.0, 1.0, 0.0), (0.0, 0.0), (0.9, 0.0, -0.6, 0.0)]
    together = velocities(*[((1.0 - 0.6) / 3.0, 0.0)] * 3)
    yield played("inelastic collapse", rows, 2.0, together, e=Restitution(0.05, cushion=1.0))


def braked() -> Iterator[Case]:
    """Make balls that slide or roll to rest: one hits another head-on, and a break."""
    brake, meets = 0.2 * G, 0.5 - 2.0 * R  # m/s^2, m
    left = 2.0**2 - 2.0 * brake * meets  # (m/s)^2; the square of the speed at which they meet
    slid, after = left / (2.0 * brake), math.sqrt(left)
    rows = [(0.0, 0.0, 2.0, 0.0), (0.5, 0.0)]
    there = places((meets, 0.0), (0.5 + slid, 0.0))
    yield played("slide to rest", rows, 3.0, there, friction=SLIDES)
    rolls = math.sqrt(1.5**2 - 2.0 * 0.01 * G * meets)
    there = places((meets + roll_on(0.0, rolls), 0.0), (0.5 + roll_on(rolls, 0.0), 0.0))
    yield played(
        "follow", [(0.0, 0.0, 1.5, 0.0), (0.5, 0.0)], 60.0, there, friction=ROLLS, roll=1.0
    )
    gained = 2.5 * (2.0 - after)  # m/s; the roll that the cloth has given the ball by then
    there = places((meets + roll_on(0.0, gained), 0.0), (0.5 + roll_on(after, 0.0), 0.0))
    yield played("stop shot", rows, 60.0, there, friction=ROLLS)
    angle = 1.428286  # rad; from the thread
    broken: list[Row] = [(0.4953, 0.4953, 5.0 * math.cos(angle), 5.0 * math.sin(angle))]
    broken += rack((0.4953, 1.4859), 1e-3, POOL, (0.0, 1.0))
    yield played(
        "balls pass through each other", broken, 6.0, table=rectangle(0.9906, 1.9812), r=POOL,
        e=Restitution(0.95, cushion=0.85), friction=ROLLS, slow=True,
    )  # fmt: skip
