"""Balls that fall between straight walls and round posts, followed in forty digits.

It shares no code with the package. From contact to contact, the time of the next one is a root of a
polynomial: of degree two at a wall and between two balls, which move on straight lines seen from
each other, and of degree four at a post.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpc, mpf

DIGITS = 40
NEWTON = 9  # Six would do: each doubles the digits, and numpy finds at least half of a double's.
BLURRED = 1e-6  # of a root; a smaller imaginary part may be rounding
SPREAD = 1e-5  # s; encounters that are so near each other are looked at in all digits
NOW = mpf(10) ** -30  # s; a contact so soon is the last one
Point = tuple[Any, Any]


class Body(NamedTuple):
    """A body is a ball with its place (m), velocity (m/s), radius (m) and mass (kg)."""

    place: Point
    velocity: Point
    radius: Any
    mass: Any


class World(NamedTuple):
    """A world has walls (a point and the inward normal), posts (a centre and a radius), and g.

    ``e`` and ``mu`` are those of walls and posts. Balls are smooth, with ``e_balls``.
    """

    walls: list[tuple[Point, Point]]
    posts: list[tuple[Point, Any]]
    gravity: Point
    e: Any
    mu: Any
    e_balls: Any


def dot(a: Point, b: Point) -> Any:
    return a[0] * b[0] + a[1] * b[1]


def minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1]


def along(a: Point, share: Any, b: Point) -> Point:
    return a[0] + share * b[0], a[1] + share * b[1]


class Encounter(NamedTuple):
    """Two sides hit at a root of a polynomial at which they close.

    The coefficients begin with that of the highest power.
    """

    powers: list[Any]
    closes: Callable[[Any], bool]

    def nearly(self) -> float:
        """Return the first root (s) to some digits; infinite if there is none."""
        powers = [float(k) for k in self.powers]
        real = [t.real for t in np.roots(powers) if abs(t.imag) <= BLURRED * (1 + abs(t))]
        return min([t for t in real if t > 0 and self.closes(t)], default=math.inf)

    def exactly(self) -> Any:
        """Return the first root (s), to all digits."""
        roots = [refined(self.powers, mpc(t)) for t in np.roots([float(k) for k in self.powers])]
        real = [mp.re(t) for t in roots if abs(mp.im(t)) < mpf(10) ** -25 and mp.re(t) > NOW]
        return min([t for t in real if self.closes(t)], default=mpf("inf"))


def soonest(encounters: dict[tuple[int, int], Encounter]) -> tuple[Any, int, int]:
    """Return when (s) two sides hit first, and which."""
    near = {sides: each.nearly() for sides, each in encounters.items()}
    first = min(near.values())
    found = [sides for sides, t in near.items() if t <= first + SPREAD]
    return min((encounters[sides].exactly(), *sides) for sides in found)


def refined(coefficients: list[Any], t: Any) -> Any:
    """Return the root of a polynomial that is near a number, by Newton's method."""
    for _ in range(NEWTON):
        value = slope = mpf(0)
        for k in coefficients:  # Horner's scheme
            value, slope = value * t + k, slope * t + value
        if slope == 0:
            return t
        t -= value / slope
    return t


def to_wall(body: Body, wall: tuple[Point, Point], g: Point) -> Encounter:
    """Return when a ball meets a wall."""
    point, n = wall
    gap, rate, bend = (
        dot(minus(body.place, point), n) - body.radius,
        dot(body.velocity, n),
        dot(g, n),
    )
    return Encounter([bend / 2, rate, gap], lambda t: rate + bend * t < 0)


def to_post(body: Body, post: tuple[Point, Any], g: Point) -> Encounter:
    """Return when a ball meets a post."""
    (d, v), far = (minus(body.place, post[0]), body.velocity), body.radius + post[1]
    powers = [dot(g, g) / 4, dot(v, g), dot(v, v) + dot(d, g), 2 * dot(d, v), dot(d, d) - far**2]
    return Encounter(powers, lambda t: dot(fly(d, v, g, t), along(v, t, g)) < 0)


def to_body(a: Body, b: Body) -> Encounter:
    """Return when two balls meet."""
    (d, v), far = (minus(b.place, a.place), minus(b.velocity, a.velocity)), a.radius + b.radius
    powers = [dot(v, v), 2 * dot(d, v), dot(d, d) - far**2]
    return Encounter(powers, lambda t: dot(along(d, t, v), v) < 0)


def fly(place: Point, velocity: Point, g: Point, t: Any) -> Point:
    """Return the place (m) on a parabola at a time (s)."""
    return along(along(place, t, velocity), t * t / 2, g)


def off_wall(body: Body, n: Point, world: World) -> Body:
    """Answer a hit of a wall by restitution, and by friction that does not turn the slip back."""
    v_n, tangent = dot(body.velocity, n), (-n[1], n[0])
    v_t, gain = dot(body.velocity, tangent), -(1 + world.e) * v_n
    loss = min(world.mu * gain, abs(v_t)) * (1 if v_t > 0 else -1)
    velocity = along(along(body.velocity, gain, n), -loss, tangent)
    return body._replace(velocity=velocity)


def off_each_other(a: Body, b: Body, e: Any) -> tuple[Body, Body]:
    """Answer a hit of two smooth balls."""
    d = minus(b.place, a.place)
    n = d[0] / mp.sqrt(dot(d, d)), d[1] / mp.sqrt(dot(d, d))
    push = (1 + e) * dot(minus(a.velocity, b.velocity), n) * a.mass * b.mass / (a.mass + b.mass)
    return (
        a._replace(velocity=along(a.velocity, -push / a.mass, n)),
        b._replace(velocity=along(b.velocity, push / b.mass, n)),
    )


def play(bodies: list[Body], world: World, until: Any, most: int) -> tuple[list[Body], int]:
    """Return how balls move at a time (s), and how many hits there were; at most so many."""
    mp.dps = DIGITS
    left, hits, g = mpf(until), 0, world.gravity
    while True:
        due: dict[tuple[int, int], Encounter] = {}
        for i, body in enumerate(bodies):
            due |= {(i, -1 - k): to_wall(body, each, g) for k, each in enumerate(world.walls)}
            posts = enumerate(world.posts, start=len(world.walls))
            due |= {(i, -1 - k): to_post(body, each, g) for k, each in posts}
            due |= {(i, j): to_body(body, bodies[j]) for j in range(i + 1, len(bodies))}
        t, i, other = soonest(due)
        step = min(t, left)
        bodies = [
            each._replace(
                place=fly(each.place, each.velocity, g, step),
                velocity=along(each.velocity, step, g),
            )
            for each in bodies
        ]
        left -= step
        if left <= 0 or hits == most:
            return bodies, hits
        hits += 1
        if other >= 0:
            bodies[i], bodies[other] = off_each_other(bodies[i], bodies[other], world.e_balls)
            continue
        k = -1 - other
        if k < len(world.walls):
            n = world.walls[k][1]
        else:
            d = minus(bodies[i].place, world.posts[k - len(world.walls)][0])
            n = d[0] / mp.sqrt(dot(d, d)), d[1] / mp.sqrt(dot(d, d))
        bodies[i] = off_wall(bodies[i], n, world)
