"""This module makes the extremes of arcs, posts and pins."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pool_pymunk.model import (
    STANDARD_GRAVITY,
    Friction,
    Post,
    Table,
)  # fmt: skip
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.making import (
    CLOTH,
    LIVELY,
    TABLE,
    R,
    diagonal,
    into,
    rectangle,
    scene_of,
)  # fmt: skip
from pool_pymunk.studies.stability.trial import Case, Extreme

ROWS: list[Extreme] = []
extreme = into(ROWS)


@extreme("around a circle", "up to 10,000 contacts, by equal angles", "coulomb")
def circles() -> Iterator[Case]:
    """Let a ball go around a circle: each hit takes it on by twice its angle to the tangent."""
    angle, inner = 0.3, 0.5 - R
    middle = inner * math.cos(angle)  # m; the distance of each chord from the table's middle
    for hits, speed in ((10, 4.0), (300, 4.0), (10_000, 64.0)):
        time = (hits + 0.5) * 2.0 * inner * math.sin(angle) / speed
        row = (0.5, R, speed * math.cos(angle), speed * math.sin(angle))
        at = (2 * hits + 1) * angle - math.pi / 2.0
        ends = {"0": (0.5 + middle * math.cos(at), 0.5 + middle * math.sin(at))}
        # Each hit turns the ball by a few roundings, and all later hits add that angle again.
        turned = must.CARE * EPSILON * hits * hits * inner
        claims = (must.contacts_are(hits), must.end_at(ends, turned))
        scene = scene_of([row], Table.circle(0.5), time=time)
        yield Case(f"{hits} contacts", scene, claims, slow=hits > 300)


@extreme("tangent to something round", "an arc, a post or a pin, within 1e-12 of a miss", "coulomb")
def tangents() -> Iterator[Case]:
    """Let a ball pass an arc that bulges inwards, a post or a pin: it hits, or it misses."""
    nose = Table(TABLE.outline, (-0.25, 0.0, 0.0, 0.0))  # 0.25 m high, with a radius of 2.125 m
    for what, table, posts, radius in (
        ("arc", nose, (), 2.125), ("post", None, (Post((1.0, 0.0), 0.25),), 0.25),
        ("pin", None, (Post((1.0, 0.25), 0.0),), 0.0),
    ):  # fmt: skip
        for share in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12, 0.0):
            deep, apart = max(-share * R, 0.0), radius + R
            sine, cosine = math.sqrt(deep * (2.0 * apart - deep)) / apart, 1.0 - deep / apart
            leaves = (1.0 - 1.9 * sine * sine, 1.9 * sine * cosine)
            # Rounding lets the ball come a few units too deep, which turns the normal.
            slack = must.CARE * EPSILON / (apart * sine) if sine else 0.0
            claims = (must.contacts_are(int(sine > 0.0)), must.leave_with({"0": leaves}, slack))
            row = (0.25, 0.25 + R * (1.0 + share), 1.0, 0.0)
            scene = scene_of([row], table, 0.9, time=1.0, posts=posts)
            yield Case(f"{what} {share:+g}", scene, claims)


@extreme("joint of a face and an arc", "hit within 1e-9 to 1e-15 m", "coulomb")
def joints() -> Iterator[Case]:
    """Hit the joint of a face and an arc that continues it: one contact, and no gap there."""
    e, pull = 0.7, CLOTH.surface * STANDARD_GRAVITY
    back = e * e * (4.0 / (2.0 * pull) - (1.0 - R))  # m; how far the ball comes back
    for off in (-1e-9, 1e-9, -1e-10, 1e-10, -1e-12, 1e-12, -1e-15, 1e-15, 0.0):
        # The arc's normal is turned by off / (1 m) there, and the ball's path back by twice that.
        at_rest = must.end_at({"0": (3.0 + off, R + back)}, 2.0 * max(off, 0.0))
        scene = scene_of([(3.0 + off, 1.0, 0.0, -2.0)], Table.stadium(4.0, 2.0), LIVELY, CLOTH)
        yield Case(f"{off:+g} m", scene, (must.contacts_are(1), at_rest))


@extreme("corners of two arcs", "ran into, and sticking out", "coulomb")
def corners_of_arcs() -> Iterator[Case]:
    """Run a ball along the diagonal into a corner of two arcs, or onto one that sticks out."""
    square = rectangle(1.0, 1.0).outline
    for label, bulge, e, mu in (
        ("inwards, e = 0.7", -0.125, 0.7, 0.0), ("inwards, rough", -0.125, 0.7, 0.2),
        ("inwards, e = 0", -0.125, 0.0, 0.2), ("reflex, e = 0.7", 0.625, 0.7, 0.2),
        ("reflex, e = 1", 0.625, 1.0, 0.0), ("reflex, e = 0", 0.625, 0.0, 0.0),
    ):  # fmt: skip
        yield diagonal(label, Table(square, (bulge, 0.0, 0.0, bulge)), -1.0, e, mu)


@extreme("held to an arc", "from a tangent, and after hits that converge", "coulomb")
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
        scene = scene_of([row], Table.circle(0.5), e, Friction(0.0, mu), time)
        yield Case(label, scene, (must.know_of_ends(ends),), slow=angle == 0.0)
