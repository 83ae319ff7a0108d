"""This module has the extremes with bent paths and bent sides: balls that roll, round cushions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from pool_pymunk.model import (
    STANDARD_GRAVITY,
    Friction,
    Physics,
    Pocket,
    Post,
    Restitution,
    Scene,
    Table,
)
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.scenes import (
    CLOTH,
    DRAG,
    ELASTIC,
    LIVELY,
    PULL,
    REST,
    ROLLS,
    SMOOTH,
    R,
    Row,
    alike,
    rectangle,
    unit,
)
from pool_pymunk.studies.stability.trial import Case

# -- balls that roll -------------------------------------------------------------------------------


def rolling(rows: Iterable[Row], *rolls: float, **parts: Any) -> Scene:
    """Return a scene of balls that roll; ``rolls`` are the first ones' shares of their velocity."""
    balls = alike(rows)
    struck = tuple(replace(ball, roll=roll) for ball, roll in zip(balls, rolls, strict=False))
    made = {"restitution": ELASTIC, "friction": ROLLS, **parts}
    return Scene((*struck, *balls[len(struck) :]), **made)


def far(v: float, w: float, time: float = math.inf, drag: float = DRAG) -> float:
    """Return how far (m) a ball slides and rolls from v with a roll w (m/s), to rest or for a time.

    It slides for 2 |v - w| / 7 mu_s g, until it rolls at 5/7 v + 2/7 w.
    """
    slides, last = 2.0 * abs(v - w) / (7.0 * PULL), (5.0 * v + 2.0 * w) / 7.0
    rolls = min(abs(last) / drag if drag else math.inf, time - slides)
    return (v + last) / 2.0 * slides + (last - math.copysign(drag, last) * rolls / 2.0) * rolls


def slides_and_rolls() -> Iterator[Case]:
    """Let a ball slide, then roll: draw that cancels the motion, next to no slip, and no end."""
    for label, speed, degrees, roll, drag in (
        ("draw", 1.0, 20.0, -1.0, DRAG), ("slip of 1e-9", 1.0, 20.0, 1.0 + 1e-9, DRAG),
        ("slip of 1e-12", 1.0, 20.0, 1.0 + 1e-12, DRAG), ("-1e-12", 1.0, 20.0, 1.0 - 1e-12, DRAG),
        ("no slip", 1.0, 20.0, 1.0, DRAG), ("v = w = 0 at once", 1.0, 20.0, -2.5, DRAG),
        ("at 1e-6 m/s", 1e-6, 20.0, -2.5, DRAG), ("at 1e3 m/s", 1e3, 20.0, -2.5, DRAG),
        ("rolls for ever", 1.0, 20.0, 0.5, 0.0),
    ):  # fmt: skip
        time = math.inf if drag else 3.0
        (x, y), track = unit(degrees), far(speed, roll * speed, time, drag)
        friction = replace(ROLLS, rolling=drag / STANDARD_GRAVITY)
        physics = Physics(max_time=None if drag else time)
        scene = rolling(
            [(0.0, 0.0, speed * x, speed * y)], roll, friction=friction, physics=physics
        )
        rolls = roll not in (1.0, -2.5)
        kinds = ["roll"] * rolls + ["stop"] * (drag > 0.0)
        yield Case(label, scene, (must.end_at({"0": (track * x, track * y)}), must.happens(*kinds)))


def follows() -> Iterator[Case]:
    """Stop a ball by a full hit: it only rotates then, and sets off at 2/7 of its roll.

    It hits at the start, or within 1e-12 m of where it begins to roll.
    """
    for roll in (1.0, 1e-6, -1.0):
        ends = {"0": (far(0.0, roll), 0.0), "1": (2.0 * R + far(1.0, 0.0), 0.0)}
        scene = rolling([(0.0, 0.0, 1.0, 0.0), (2.0 * R, 0.0, *REST)], roll)
        yield Case(f"at once, roll {roll:g}", scene, (must.end_at(ends), must.contacts_are(1)))
    slides, last = 12.0 / (49.0 * PULL), 5.0 / 7.0  # m, m/s
    for off in (1e-3, 1e-9, 1e-12, 1e-15, 0.0, -1e-15, -1e-12):
        x, v = slides + max(off, 0.0), math.sqrt(last * last - 2.0 * DRAG * max(off, 0.0))
        ends = {"0": (x + far(0.0, v), 0.0), "1": (x + 2.0 * R + far(v, 0.0), 0.0)}
        scene = rolling([(0.0, 0.0, 1.0, 0.0), (slides + off + 2.0 * R, 0.0, *REST)])
        # A hit before the end of sliding takes the ball by less than this.
        claims = (must.end_at(ends, 1e-11 * (off < 0.0)), must.contacts_are(1))
        yield Case(f"rolls {off:+g} m before", scene, claims)


def turns_back() -> Iterator[Case]:
    """Let a ball with draw turn back as it grazes a face, a corner or a rim, or before that."""
    ell = Table(((-4.0, -4.0), (0.0, -4.0), (0.0, -R), (4.0, -R), (4.0, 4.0), (-4.0, 4.0)))
    hole = Pocket("hole", (0.0, 0.0), 2.0 * R)
    for deep in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12):
        met = int(deep > 0.0)
        # A full hit leaves (0, -0.5) of (0.25, -0.5) m/s, and the roll of (-1, 2) m/s.
        y = 0.05 * math.hypot(1.0, 2.5) / PULL - deep
        rows = [(0.0, y, 0.25, -0.5), (2.0 * R, y, *REST)]
        face = rolling(rows, -4.0, table=rectangle(8.0, 4.0, (-4.0, -R)))
        yield Case(f"face {deep:+g} m", face, (must.contacts_are(1 + met),))
        y = 0.125 / PULL - deep
        corner = rolling([(0.0, y, 0.0, -0.5)], -4.0, table=ell)
        yield Case(f"corner {deep:+g} m", corner, (must.contacts_are(met),))
        rim = rolling([(0.0, y + hole.radius, 0.0, -0.5)], -4.0, pockets=(hole,))
        yield Case(f"rim {deep:+g} m", rim, (must.pocket("0" * met),))


def pressed_by_rolls() -> Iterator[Case]:
    """Let a roll press a ball to a cushion, or to a ball that lies there: there they rest."""
    table = rectangle(2.0, 1.0)
    alone, other = (2.0 - R - 2.0**-9, 0.5, 0.125, 0.0), (2.0 - R, 0.5, *REST)
    for label, e, rows in (
        ("e = 0", 0.0, [alone]),
        ("e = 0.2", 0.2, [alone]),
        ("follows a frozen ball, e = 0", 0.0, [(2.0 - 3.0 * R - 2.0**-9, 0.5, 0.125, 0.0), other]),
    ):
        ends = {"0": (2.0 - (2 * len(rows) - 1) * R, 0.5)}
        dull = Restitution(e, None, e)
        scene = rolling(rows, 1.0, table=table, restitution=dull)
        yield Case(label, scene, (must.know_of_ends(ends),), slow=len(rows) > 1)


# -- round cushions and posts ----------------------------------------------------------------------


def circles() -> Iterator[Case]:
    """Let a ball go around a circle at an angle to the tangent, by twice that angle at each hit."""
    angle, inner = 0.3, 0.5 - R
    middle = inner * math.cos(angle)  # m; each chord lies so far from the table's middle
    for hits, speed in ((10, 4.0), (300, 4.0), (10_000, 64.0)):
        time = (hits + 0.5) * 2.0 * inner * math.sin(angle) / speed
        row = (0.5, R, speed * math.cos(angle), speed * math.sin(angle))
        at = (2 * hits + 1) * angle - math.pi / 2.0
        ends = {"0": (0.5 + middle * math.cos(at), 0.5 + middle * math.sin(at))}
        # Each hit turns the ball by a few roundings, which all later hits add again.
        turned = must.CARE * EPSILON * hits * hits * inner
        claims = (must.contacts_are(hits), must.end_at(ends, turned))
        physics = Physics(max_time=time)
        scene = Scene(alike([row]), Table.circle(0.5), ELASTIC, SMOOTH, physics)
        yield Case(f"{hits} contacts", scene, claims, slow=hits > 300)


def tangents() -> Iterator[Case]:
    """Let a ball pass an arc that bulges inwards, a post or a pin: it hits, or it misses."""
    outline = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
    nose = Table(outline, (-0.25, 0.0, 0.0, 0.0))  # It is 0.25 m high, and its radius is 2.125 m.
    dull, physics = Restitution(0.9, None, 0.9), Physics(max_time=1.0)
    for what, table, posts, radius in (
        ("arc", nose, (), 2.125), ("post", None, (Post((1.0, 0.0), 0.25),), 0.25),
        ("pin", None, (Post((1.0, 0.25), 0.0),), 0.0),
    ):  # fmt: skip
        for share in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12, 0.0):
            deep, apart = max(-share * R, 0.0), radius + R
            sine, cosine = math.sqrt(deep * (2.0 * apart - deep)) / apart, 1.0 - deep / apart
            leaves = (1.0 - 1.9 * sine * sine, 1.9 * sine * cosine)
            # The ball meets something round a few roundings deep, which turns the normal.
            slack = must.CARE * EPSILON / (apart * sine) if sine else 0.0
            claims = (must.contacts_are(int(sine > 0.0)), must.leave_with({"0": leaves}, slack))
            balls = alike([(0.25, 0.25 + R * (1.0 + share), 1.0, 0.0)])
            scene = Scene(balls, table, dull, SMOOTH, physics, posts=posts)
            yield Case(f"{what} {share:+g}", scene, claims)


def joints() -> Iterator[Case]:
    """Hit the joint of a face and an arc that goes on from it: one contact, and no gap there."""
    e, pull = 0.7, CLOTH.surface * STANDARD_GRAVITY
    back = e * e * (4.0 / (2.0 * pull) - (1.0 - R))  # m; so far the ball comes back
    for off in (-1e-9, 1e-9, -1e-10, 1e-10, -1e-12, 1e-12, -1e-15, 1e-15, 0.0):
        # The arc's normal is turned by off / 1 m there, and the ball's path back by twice as much.
        at_rest = must.end_at({"0": (3.0 + off, R + back)}, 2.0 * max(off, 0.0))
        scene = Scene(alike([(3.0 + off, 1.0, 0.0, -2.0)]), Table.stadium(4.0, 2.0), LIVELY, CLOTH)
        yield Case(f"{off:+g} m", scene, (must.contacts_are(1), at_rest))


def corners_of_arcs() -> Iterator[Case]:
    """Run a ball along the diagonal into a corner of two arcs, or onto one that sticks out."""
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    for label, bulge, e, mu in (
        ("inwards, e = 0.7", -0.125, 0.7, 0.0), ("inwards, rough", -0.125, 0.7, 0.2),
        ("inwards, e = 0", -0.125, 0.0, 0.2), ("reflex, e = 0.7", 0.625, 0.7, 0.2),
        ("reflex, e = 1", 0.625, 1.0, 0.0), ("reflex, e = 0", 0.625, 0.0, 0.0),
    ):  # fmt: skip
        table = Table(square, (bulge, 0.0, 0.0, bulge))
        scene = Scene(alike([(0.25, 0.25, -1.0, -1.0)]), table, Restitution(1.0, None, e),
                      Friction(0.05, mu))  # fmt: skip
        yield Case(label, scene, (must.on_the_diagonal,))


def held_to_arcs() -> Iterator[Case]:
    """Let a ball slide along the inside of a circle, from a tangent or after hits that converge.

    Along the arc d(v^2)/ds = -2 (mu_s g + mu v^2 / R). Hits at an angle to the tangent have closing
    speeds that shrink by e, and each turns the ball by twice the angle at which it leaves.
    """
    inner, speed, time = 0.5 - R, 1.0, 0.375
    for label, e, angle, mu in (
        ("e = 0", 0.0, 0.0, 0.0), ("e = 0, rough", 0.0, 0.0, 0.2), ("e = 0.2", 0.2, 0.0, 0.2),
        ("e = 0, from a hit", 0.0, 0.25, 0.2), ("e = 0.2, converging", 0.2, 0.25, 0.2),
    ):  # fmt: skip
        v_n, v_t, turned, left = speed * math.sin(angle), speed * math.cos(angle), 0.0, time
        while v_n > 1e-12:  # One chord after another, and then along the arc
            half = math.atan2(v_n, v_t)
            left -= 2.0 * inner * math.sin(half) / math.hypot(v_n, v_t)
            v_t, v_n, turned = v_t - mu * (1.0 + e) * v_n, e * v_n, turned + 2.0 * half
        along = math.log1p(mu * v_t * left / inner) / mu if mu else v_t * left / inner
        at = turned + along - math.pi / 2.0
        ends = {"0": (0.5 + inner * math.cos(at), 0.5 + inner * math.sin(at))}
        row = (0.5, R, speed * math.cos(angle), speed * math.sin(angle))
        scene = Scene(alike([row]), Table.circle(0.5), Restitution(1.0, None, e),
                      Friction(0.0, mu), Physics(max_time=time))  # fmt: skip
        yield Case(label, scene, (must.know_of_ends(ends),), slow=angle == 0.0)
