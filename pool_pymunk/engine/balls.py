"""This module holds the balls and walls of the contact engine, and how they lie and touch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from pool_pymunk.engine import decisions
from pool_pymunk.engine.due import Hit
from pool_pymunk.engine.recorder import Motion
from pool_pymunk.physics.contact import NO_BALL, Contact, Pair
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import NOISE, Path, motion_at
from pool_pymunk.physics.sides import Wall, unit
from pool_pymunk.physics.surface import Surface

Motions = dict[int, Motion]  # by ball number


class Balls:
    """All balls are on their paths, between walls.

    ``noises`` (m/s) tells how much of each ball's velocity may be rounding. ``rested`` (s) is since
    when a ball rests; it is infinite for a ball that moves. ``is_finite`` is False once a ball is
    lost: within one rounding error of the time it travels more than ``LOST`` radii, so that contact
    times mean nothing, or a number has overflowed.
    """

    def __init__(self, pair: Callable[[int, int], Pair], surface: Surface) -> None:
        self.pair = pair
        self.surface = surface
        self.now = 0.0
        self.paths: list[Path] = []
        self.radii: list[float] = []
        self.masses: list[float] = []
        self.speeds: list[float] = []  # m/s, the highest on the paths
        self.noises: list[float] = []
        self.rested: list[float] = []
        self.path_ends: list[float] = []  # the time (s) at which each path meets a wall
        self.ends: list[float] = []  # the time (s) until which each path is looked at
        self.walls: list[Wall] = []
        self.is_finite = True

    def add_ball(self, path: Path, radius: float, mass: float) -> int:
        """Put a ball on the table, and return its number."""
        speed = path.fastest
        self.paths.append(path)
        self.speeds.append(speed)
        self.noises.append(NOISE * speed)
        self.path_ends.append(math.inf)
        self.ends.append(math.inf)
        self.radii.append(radius)
        self.masses.append(mass)
        self.rested.append(math.inf if path.moves else -math.inf)
        self.is_finite = self.is_finite and not path.is_lost(radius)
        return len(self.paths) - 1

    def motions(self, hits: Iterable[Hit]) -> Motions:
        """Return how the balls of these hits move now."""
        paths, now = self.paths, self.now
        return {i: motion_at(paths[i], now) for hit in hits for i in hit.balls}

    def contact(self, hit: Hit, motions: Motions) -> Contact:
        """Return the contact of two balls, or of a ball and a wall."""
        i = hit.i
        x, y, _, _ = motions[i]
        r = self.radii[i]
        if hit.kind == "wall":
            wall = self.walls[hit.wall]
            nx, ny = normal = wall.nearest(x, y, r).normal(x, y)
            pair = Pair(self.masses[i], math.inf, wall.restitution, wall.friction)
            return Contact(i, NO_BALL, normal, pair, wall.number, (x - r * nx, y - r * ny))
        bx, by, _, _ = motions[hit.j]
        nx, ny = normal = unit(bx - x, by - y)
        return Contact(i, hit.j, normal, self.pair(i, hit.j), None, (x + r * nx, y + r * ny))

    def gap(self, hit: Hit, motions: Motions) -> float:
        """Return the distance (m) between two surfaces; it is negative where they overlap."""
        x, y, _, _ = motions[hit.i]
        r = self.radii[hit.i]
        if hit.kind == "wall":
            return self.walls[hit.wall].nearest(x, y, r).gap(x, y, r)
        dx, dy = motions[hit.j][0] - x, motions[hit.j][1] - y
        return math.sqrt(dx * dx + dy * dy) - r - self.radii[hit.j]

    def known_gap(self, hit: Hit, motions: Motions) -> float:
        """Return a gap (m), or 0 where rounding hides it."""
        x, y, _, _ = motions[hit.i]
        gap = self.gap(hit, motions)
        return gap if gap > 2.0 * EPSILON * (abs(x) + abs(y) + self.radii[hit.i]) else 0.0

    def is_closed(self, hit: Hit, motions: Motions, times: float = 1.0) -> bool:
        """Tell whether a gap is closed, to rounding, or no more than this many times wider."""
        x, y, _, _ = motions[hit.i]
        reach = self.radii[hit.i] + (self.radii[hit.j] if hit.kind == "pair" else 0.0)
        return decisions.is_closed(self.gap(hit, motions) / times, x, y, reach)

    def noise(self, balls: Iterable[int]) -> float:
        """Return how much of these balls' velocities (m/s) may be rounding."""
        return max([self.noises[i] for i in balls])
