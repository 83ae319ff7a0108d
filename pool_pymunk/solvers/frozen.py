"""This module opens tiny gaps between balls that lie frozen together, or to a cushion.

Real balls always have such gaps. What a run says of frozen balls comes from runs with gaps of at
most 4e-6 m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core import present as engine
from pool_pymunk.core.variant import NEARLY_CLOSED
from pool_pymunk.laws.contact import Vector
from pool_pymunk.model import Scene, State

# m; gaps of the starts. Nobody sees a gap of 1e-6 m. A few draws seldom meet the worst gaps, so the
# widest ones are four times as wide.
NARROW, WIDE = 1e-13, (4e-6, 4e-8, 4e-10)
TURN = 2e-11  # rad, and of a speed; rounding hides closing speeds of 4e-15 of the fastest one
DECIDED = 1e-5  # m; a run that moves ends less by narrow gaps may only amplify them
# of a radius and of a place; a gap up to so wide closes in a moment, says the engine
CLOSED = NEARLY_CLOSED * engine.CLOSED
HAIR = 1e-9  # of a radius and of a place; more than CLOSED
PASSES = 8  # The gaps of a closed ring depend on each other; after a few passes no balls overlap.

Rows = NDArray[np.float64]
Touch = tuple[int, int, Vector]  # a ball, another ball or a wall, and the normal


class Spot(NamedTuple):
    """A spot is where a ball of this number lies (m), and its radius (m)."""

    x: float
    y: float
    r: float
    number: int


def touching(scene: Scene, start: State) -> Rows:
    """Return how each gap that is closed at the start changes as balls move: (contacts, 2 N).

    The scene keeps these rows for the latest start.
    """
    at = start.position, start.off
    known: tuple[object, Rows] | None = scene.found.get(touching)
    if known is None or known[0] != at:
        known = scene.found[touching] = at, _touching(scene, start)
    return known[1]


def _touching(scene: Scene, start: State) -> Rows:
    places = start.position
    each = enumerate(zip(scene.balls, places, strict=True))
    discs = [Spot(x, y, ball.radius, i) for i, (ball, (x, y)) in each if ball.id not in start.off]
    found = [*_touching_balls(discs), *_touching_walls(scene, discs)]
    rows = np.zeros((len(found), 2 * len(places)))
    rank = {i: k for k, i in enumerate(_order(start))} if found else {}
    found.sort(key=lambda each: sorted(rank.get(i, i) for i in each[:2]))
    for row, (i, j, (nx, ny)) in zip(rows, found, strict=True):
        row[2 * i : 2 * i + 2] = nx, ny
        if j < len(places):
            row[2 * j : 2 * j + 2] = -nx, -ny
    return rows


def _touching_balls(discs: Sequence[Spot]) -> Iterator[Touch]:
    """Yield what touches, by a sweep along x; the ball that is listed later comes first."""
    active: list[tuple[float, Spot]] = []  # the right end of each with a hair more, and the disc
    for disc in sorted(discs, key=lambda disc: disc.x - disc.r):
        hair = HAIR * (abs(disc.x) + abs(disc.y) + disc.r)
        active = [one for one in active if one[0] >= disc.x - disc.r]
        for _, near in active:
            if abs(disc.y - near.y) - disc.r - near.r <= hair:
                later, earlier = (disc, near) if disc.number > near.number else (near, disc)
                (x, y, r, i), (u, v, q, j) = later, earlier
                distance = math.hypot(x - u, y - v)
                if distance - r - q <= CLOSED * (abs(x) + abs(y) + r):
                    yield i, j, ((x - u) / distance, (y - v) / distance)
        active.append((disc.x + disc.r + hair, disc))


def _touching_walls(scene: Scene, discs: Sequence[Spot]) -> Iterator[Touch]:
    """Yield which balls touch which walls; their numbers come after those of the balls."""
    if scene.table is not None and scene.table.is_rectangle and not scene.posts:
        # Most discs lie well within a rectangle, and touch no cushion.
        (x0, y0, x1, y1), hair = scene.table.bounds, HAIR * sum(map(abs, scene.table.bounds))
        discs = [d for d in discs if min(d.x - x0, x1 - d.x, d.y - y0, y1 - d.y) - d.r <= hair]
    for x, y, r, i in discs:
        for k, wall in enumerate(scene.cushions):
            side = wall.nearest(x, y, r, 0.0)
            gap = side.gap(x, y, r)
            if -r < gap <= r and gap <= CLOSED * (abs(x) + abs(y) + r):
                yield i, len(scene.balls) + k, side.normal(x, y)


def nudged(scene: Scene, start: State, number: int) -> State:
    """Return a start in which what touches has gaps, which differ from number to number.

    An even number opens a narrow gap, and an odd number a wide one. Mostly one gap opens alone, so
    that its contact comes after the others. Every fourth even number opens no gap, and every
    fourth odd number opens all. Balls that touch nothing move by ``NARROW`` at most, and velocities
    and rolls change by ``TURN``. With number 0 moving balls close the gaps to what they touch.
    """
    (turn, k), is_wide = divmod(number // 2, 4), number % 2
    rng, rows = np.random.default_rng(number), touching(scene, start)
    gaps = rng.random(len(rows)) * is_wide
    if k and len(rows):
        gaps = np.eye(len(rows))[(3 * turn + k - 1) % len(rows)]
    gaps *= WIDE[turn % len(WIDE)] if is_wide else NARROW
    open_ = _opening(scene, rows)
    moves = open_ @ gaps
    for _ in range(PASSES):
        moves += open_ @ np.maximum(-(rows @ moves), 0.0)
    draws = np.empty((len(start.position), 4))
    draws[_order(start)] = rng.uniform(-1.0, 1.0, draws.shape)
    moves = np.where(rows.any(axis=0), moves, NARROW * draws[:, :2].ravel())
    places = np.array(start.position) + moves.reshape(-1, 2)
    turns = 1.0 + TURN * (draws[:, 2:] @ (1.0, 1.0j))
    if number == 0:
        turns = _closing(start.velocity, open_, turns)
    return start._replace(
        position=tuple(map(tuple, places.tolist())),
        velocity=_turned(start.velocity, turns),
        roll=None if start.roll is None else _turned(start.roll, turns),
    )


def _opening(scene: Scene, rows: Rows) -> NDArray[Any]:
    """Return how balls move to open gaps; the scene keeps this for the latest rows of gaps."""
    known: tuple[Rows, NDArray[Any]] | None = scene.found.get(_opening)
    if known is None or known[0] is not rows:
        known = scene.found[_opening] = rows, np.linalg.pinv(rows)
    return known[1]


def _closing(
    velocities: Sequence[Vector], open_: NDArray[Any], turns: NDArray[Any]
) -> NDArray[Any]:
    """Return the factors by which moving balls close what they touch, and ``turns`` of others."""
    moves, apart = (
        np.array(rows) @ (1.0, 1.0j) for rows in (velocities, open_.sum(1).reshape(-1, 2))
    )
    meets = (moves != 0.0) & (apart != 0.0)
    moves, apart = np.where(meets, (moves, apart), 1.0)
    apart = apart / np.abs(apart) * np.abs(moves) / moves
    return np.where(meets, 1.0 - TURN * apart, turns)


def _order(start: State) -> list[int]:
    """Return the balls' numbers by their places, in whatever order they are listed."""
    return sorted(range(len(start.position)), key=start.position.__getitem__)


def _turned(velocities: Sequence[Vector], turns: NDArray[Any]) -> tuple[Vector, ...]:
    """Return velocities (m/s), each turned and stretched by a complex factor."""
    found = (np.array(velocities) @ (1.0, 1.0j)) * turns
    return tuple(zip(found.real.tolist(), found.imag.tolist(), strict=True))
