"""Scenes with a kink, each beside one that has none, for the tests of derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from pool_pymunk import Ball, Friction, Physics, Pocket, Post, Restitution, Scene, Table

R = 0.05  # m
MU, E = 0.1, 0.9  # of balls
SURFACE = 0.1
A = SURFACE * 9.80665  # m/s^2
BESIDE = 1e-6  # A kink so far away (m, or a share) does no harm.
TABLE = Table.rectangle(2.0, 1.0)
L_SHAPED = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 2.0), (1.0, 1.0), (0.0, 1.0)))


def ball(id_: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> Ball:
    return Ball(id_, (x, y), R, 0.2, velocity=(vx, vy))


def scene(*balls: Ball, max_time: float | None = None, **more: object) -> Scene:
    return Scene(
        balls,
        restitution=Restitution(ball_ball=E, cushion=0.8),
        friction=Friction(surface=SURFACE, ball_ball=MU, cushion=0.1),
        physics=Physics(max_time=max_time),
        **more,  # type: ignore[arg-type]
    )


def slipping(off: float) -> Scene:
    """Return a hit at which the slip is mu (1 + e) times the closing speed."""
    u = 1.0, MU * (1.0 + E) * (1.0 + off)  # It keeps its direction while the ball slides.
    return scene(ball("a", -0.3 * u[0], -0.3 * u[1], 2.0 * u[0], 2.0 * u[1]), ball("b", 2 * R, 0))


def oblique(off: float) -> Scene:
    """Return the same with a line of centres that is oblique."""
    tilt = math.radians(30.0)
    slip = math.atan(MU * (1.0 + E) * (1.0 + off))
    u = math.cos(tilt + slip), math.sin(tilt + slip)
    meets = (0.5 - 2 * R * math.cos(tilt), 0.3 - 2 * R * math.sin(tilt))
    start = (meets[0] - 0.4 * u[0], meets[1] - 0.4 * u[1])
    return scene(ball("a", *start, 2.0 * u[0], 2.0 * u[1]), ball("b", 0.5, 0.3))


def rolling_off(off: float) -> Scene:
    """Return a cushion hit whose friction takes the whole tangential speed, and no more."""
    return scene(ball("a", 1.0, 0.5, 0.1 * 1.8 * 1.5 * (1.0 + off), -1.5), table=TABLE)


def tangent(off: float) -> Scene:
    """Return a path that is tangent to a resting ball."""
    return scene(ball("a", 0, 0, 2.0), ball("b", 0.5, 2 * R + off))


def tangent_moving(off: float) -> Scene:
    """Return two moving balls that are tangent: without friction, they pass at 2 R."""
    still = scene(ball("a", 0, 0, 2.0), ball("b", 0.5, 2 * R + off, -1.0), max_time=1.0)
    return replace(still, friction=Friction(0.0, 0.1, 0.1))


def tangent_crossing(off: float) -> Scene:
    """Return two balls on crossing paths that are nearest at 2 R, while both slow down."""
    place = slid(2.0, 0.25), slid(1.5, 0.25)
    still = (-slid_speed(2.0, 0.25), slid_speed(1.5, 0.25))
    length = math.hypot(*still)
    apart = 2 * R + off
    # At 0.25 s the offset is at right angles to the relative velocity.
    dx, dy = still[1] / length * apart, -still[0] / length * apart
    return scene(ball("a", -place[0], 0.0, 2.0), ball("b", dx, dy - place[1], 0.0, 1.5))


def slid(v: float, t: float) -> float:
    return v * t - 0.5 * A * t * t


def slid_speed(v: float, t: float) -> float:
    return v - A * t


def corner(off: float) -> Scene:
    """Return a path that is tangent to a corner."""
    c = math.sqrt(0.5)
    at = (1.0 + (R + off) * c, 1.0 - (R + off) * c)
    return scene(ball("a", at[0] - 0.3 * c, at[1] - 0.3 * c, 2.0 * c, 2.0 * c), table=L_SHAPED)


def post(off: float) -> Scene:
    """Return a path that is tangent to a post."""
    return scene(ball("a", 0, 0, 2.0), posts=(Post((0.5, R + 0.1 + off), 0.1),))


def arc(off: float) -> Scene:
    """Return a path that is tangent to an arc, whose top is at (1, 0.2)."""
    table = replace(TABLE, bulge=(-0.2, 0.0, 0.0, 0.0))
    return scene(ball("a", 0.3, 0.2 + R + off, 2.0), table=table)


def rim(off: float) -> Scene:
    """Return a path that is tangent to the rim of a pocket."""
    return scene(ball("a", 0, 0, 2.0), pockets=(Pocket("p", (0.5, 0.08 + off), 0.08),))


def along(off: float) -> Scene:
    """Return a ball that moves along the cushion that it touches."""
    return scene(ball("a", 0.5, R + abs(off), 1.0), table=TABLE)


def stops_at_ball(off: float) -> Scene:
    """Return a ball that comes to rest where it touches another one."""
    return scene(ball("a", 0, 0, 1.0), ball("b", 2 * R + 0.5 / A + off, 0.0))


def stops_at_cushion(off: float) -> Scene:
    """Return a ball that comes to rest where it touches a cushion."""
    return scene(ball("a", 2.0 - R - 0.5 / A - off, 0.5, 1.0), table=TABLE)


def at_the_end(off: float) -> Scene:
    """Return a contact at max_time."""
    return scene(ball("a", 0, 0, 2.0), ball("b", 2 * R + slid(2.0, 0.25) + off, 0.0), max_time=0.25)


def cushion_at_the_end(off: float) -> Scene:
    """Return a hit on a cushion at max_time."""
    return scene(ball("a", 2.0 - R - slid(2.0, 0.25) - off, 0.5, 2.0), table=TABLE, max_time=0.25)


def pocket_at_the_end(off: float) -> Scene:
    """Return a ball that comes to the rim of a pocket at max_time."""
    pockets = (Pocket("p", (slid(2.0, 0.25) + 0.08 + off, 0.0), 0.08),)
    return scene(ball("a", 0, 0, 2.0), pockets=pockets, max_time=0.25)


def hit_at_rest(off: float) -> Scene:
    """Return a ball that comes to rest just as another one hits it."""
    t = 1.0 / A
    rest = slid(1.0, t)
    return scene(ball("a", 0, 0, 0.0, 1.0),
                 ball("b", 2 * R + slid(2.0, t) + off, rest, -2.0))  # fmt: skip


def touching(off: float) -> Scene:
    """Return balls that touch at the start, and close."""
    return scene(ball("a", 0, 0, 2.0, 0.1), ball("b", 2 * R + abs(off), 0.0))


KINKS: dict[Callable[[float], Scene], str] = {
    slipping: "sticking and slipping",
    oblique: "sticking and slipping",
    rolling_off: "sticking and slipping",
    tangent: "touches what it does not hit",
    tangent_moving: "touches what it does not hit",
    tangent_crossing: "touches what it does not hit",
    corner: "touches what it does not hit",
    post: "touches what it does not hit",
    arc: "touches what it does not hit",
    rim: "touches what it does not hit",
    along: "touches what it does not hit",
    stops_at_ball: "touches what it does not hit",
    stops_at_cushion: "touches what it does not hit",
    at_the_end: "the run ends just at a contact",
    cushion_at_the_end: "the run ends just at a contact",
    pocket_at_the_end: "the run ends just at a contact",
    hit_at_rest: "comes to rest just as it is hit",
    touching: "balls touch at the start",
}
