"""This module finds where paths of an exact run touch, to rounding, without a contact.

A path may be tangent to a ball, a corner, an arc or the rim of a pocket, run along a cushion, or
end just where it touches. A small change makes a contact there or leaves a gap, so ends have a
kink.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.physics.motion import Array, free_motions
from pool_pymunk.physics.saltation import BLUR, GRAZE
from pool_pymunk.physics.sides import Arc, Rim, RoundSide, within_sector
from pool_pymunk.results.run import Run
from pool_pymunk.studies import Mask

CHUNK = 1 << 18  # pairs of pieces that are looked at together, in some 50 MB
LAST = 1e-9  # of a piece; this long before its end it is asked whether a ball that stops parts
HALVINGS = 60  # After this many halvings an interval of time is as short as rounding.

Whole = NDArray[np.int64]
# when (s) a ball met what: another ball with a higher number, or a thing at rest by its name
Times = dict[tuple[int, str], set[float]]
Pairs = tuple[Whole, Whole, Array, Array]  # two pieces, since when and until when (s)


class Touch(NamedTuple):
    """A touch is that of ball ``i`` with ball ``j``, or with something at rest (-1), at ``t`` (s).

    ``begins`` tells that a path begins there, along what it touches.
    """

    t: float
    begins: bool
    i: int
    j: int


class Pieces(NamedTuple):
    """Pieces are those of the paths of all balls, and things at rest, as arrays of one length.

    ``own`` is the number of the ball, or -1 - k for the ``k``-th thing at rest. A piece lasts
    from its breakpoint, ``start`` (K, 7), until ``t1`` (s). ``size`` (m) is the radius. A ball's
    radius counts ``facing`` times: 0 at the rim of a pocket, -1 in an arc that bulges outwards.
    """

    own: Whole
    start: Array
    t1: Array
    size: Array
    facing: Array

    @property
    def moves(self) -> Mask:
        """Tell which of them move, or set off."""
        return np.asarray(self.start[:, 3:7].any(axis=1))

    @property
    def bends(self) -> Mask:
        """Tell which of them are no straight lines, as of balls that slide before they roll."""
        vx, vy, ax, ay = self.start[:, 3:7].T
        return np.asarray(np.abs(vx * ay - vy * ax) > BLUR * (np.abs(vx * ay) + np.abs(vy * ax)))

    def at(self, rows: Whole, t: Array) -> tuple[Array, Array]:
        """Return places (m) and velocities (m/s) of these pieces, each at its own time."""
        return free_motions(self.start[rows], t)


def touches(run: Run) -> list[Touch]:
    """Return all touches of a run that are no contacts, in the order of time."""
    met, pieces = Times(), _pieces(run)
    for event in run.events:
        i, *others = sorted(run.scene.index[id_] for id_ in event.balls)
        name = str(others[0]) if others else f"{event.cushion}, {event.pocket}"
        met.setdefault((i, name), set()).add(event.t)
    return sorted([*_of_discs(run, pieces, met), *_of_faces(run, pieces, met)])


def _at_rest(run: Run) -> list[tuple[RoundSide | Arc | Rim, str]]:
    """Return corners, arcs, posts and the rims of pockets, each with its name."""
    table, found = run.scene.table, list[tuple[RoundSide | Arc | Rim, str]]()
    if table is not None:
        found += ((RoundSide(table.outline[k]), f"{k}, None") for k in table.reflex_corners)
        sides = ((edge.side, f"{k}, None") for k, edge in enumerate(table.edges))
        found += ((side, name) for side, name in sides if isinstance(side, Arc))
    posts = enumerate(run.scene.posts, start=run.scene.first_post)
    found += ((RoundSide(post.position, post.radius), f"{k}, None") for k, post in posts)
    rims = ((Rim(hole.position, hole.radius), f"None, {hole.id}") for hole in run.scene.pockets)
    return [*found, *rims]


def _pieces(run: Run) -> Pieces:
    """Return the pieces of a run's paths, as long as the balls are on the table."""
    rows: list[tuple[float, ...]] = []
    leaves = {event.balls[0]: event.t for event in run.events if event.pocket is not None}
    for i, (ball, breakpoints) in enumerate(zip(run.scene.balls, run.knots, strict=True)):
        last = leaves.get(ball.id, -1.0 if ball.id in run.off else run.duration)
        ends = np.minimum(np.append(breakpoints[1:, 0], last), last).tolist()
        pieces = zip(breakpoints.tolist(), ends, strict=True)
        rows += [(i, *row[:7], end, ball.radius, 1.0) for row, end in pieces if row[0] < end]
    for k, (side, _) in enumerate(_at_rest(run)):
        still = 0.0, *side.center, *[0.0] * 4, run.duration
        facing = side.facing if isinstance(side, Arc) else float(isinstance(side, RoundSide))
        rows.append((-1 - k, *still, side.radius, facing))
    table = np.array(rows).reshape(-1, 11)
    return Pieces(table[:, 0].astype(int), table[:, 1:8], *table[:, 8:].T)


# -- balls, corners and pockets --------------------------------------------------------------------


def _of_discs(run: Run, pieces: Pieces, met: Times) -> Iterator[Touch]:
    """Yield where a path is tangent to a disc, begins along it, or ends at it."""
    p, q, since, until = _near(pieces)
    for t, begins in ((since, True), (until, False)):
        yield from _closed(run, pieces, (p, q, t), met, begins)
    last = until - LAST * (until - since)  # A velocity that is zero has no sign.
    inner = (_rate(pieces, p, q, since)[0] < 0.0) & (_rate(pieces, p, q, last)[0] > 0.0)
    if inner.any():
        p, q, near, part = p[inner], q[inner], since[inner], until[inner]
        for _ in range(HALVINGS):  # They near at first and part at last.
            middle = 0.5 * (near + part)
            parts = _rate(pieces, p, q, middle)[0] > 0.0
            near, part = np.where(parts, near, middle), np.where(parts, middle, part)
        yield from _closed(run, pieces, (p, q, part), met, begins=False)


def _closed(
    run: Run, pieces: Pieces, at: tuple[Whole, Whole, Array], met: Times, begins: bool
) -> Iterator[Touch]:
    """Yield which of these pairs of pieces touch at their times; paths that begin go along."""
    p, q, t = at
    others = _at_rest(run)
    place, other = pieces.at(p, t)[0], pieces.at(q, t)[0]
    radii, distance = _radii(pieces, p, q), np.sqrt(((other - place) ** 2).sum(axis=1))
    blur = BLUR * (np.abs(place).sum(axis=1) + np.abs(other).sum(axis=1) + radii)
    found = np.abs(distance - radii) <= blur
    if begins:
        rate, fastest = _rate(pieces, p, q, t)
        found &= np.abs(rate) <= GRAZE * fastest * distance
    for k in np.flatnonzero(found).tolist():
        i, j = int(pieces.own[p[k]]), int(pieces.own[q[k]])
        side, name = others[-1 - j] if j < 0 else (None, str(max(i, j)))
        x, y = (place[k] - other[k]).tolist()
        is_beside = not isinstance(side, Arc) or within_sector(x, y, side.first, side.last)
        key = (min(i, j) if j >= 0 else i, name)
        if is_beside and t[k] not in met.get(key, ()):
            yield Touch(float(t[k]), begins, i, max(j, -1))


def _rate(pieces: Pieces, p: Whole, q: Whole, t: Array) -> tuple[Array, Array]:
    """Return distances times how fast gaps grow (m^2/s), and the largest speeds (m/s)."""
    (place, velocity), (other, its) = pieces.at(p, t), pieces.at(q, t)
    rate = ((other - place) * (its - velocity)).sum(axis=1)
    rate = np.where(pieces.facing[q] < 0.0, -rate, rate)
    return rate, np.abs([velocity, its]).max(axis=(0, 2))


def _radii(pieces: Pieces, p: Whole, q: Whole) -> Array:
    """Return the distance (m) of the centres at which pairs of pieces touch."""
    return np.asarray(pieces.facing[q] * pieces.size[p] + pieces.size[q])


def _near(pieces: Pieces) -> Pairs:
    """Return pairs of pieces that may touch, of which the first one moves."""
    moving = np.flatnonzero(pieces.moves)
    parts = len(moving) * len(pieces.own) // CHUNK + 1
    found: Any = [_near_some(pieces, some) for some in np.array_split(moving, parts)]
    p, q, since, until = map(np.concatenate, zip(*found, strict=True))
    return p, q, since, until


def _near_some(pieces: Pieces, moving: Whole) -> Pairs:
    """Return pairs of these moving pieces with others that may touch.

    A relative path that bends deviates from its chord by |a| T^2 / 8 at most.
    """
    own = pieces.own
    since = np.maximum(pieces.start[moving, :1], pieces.start[:, 0])
    until = np.minimum(pieces.t1[moving, np.newaxis], pieces.t1)
    once = ~pieces.moves | (own > own[moving, np.newaxis])
    row, q = np.nonzero((since < until) & once & (own != own[moving, np.newaxis]))
    p, since, until = moving[row], since[row, q], until[row, q]
    first, last = (pieces.at(q, t)[0] - pieces.at(p, t)[0] for t in (since, until))
    chord = last - first
    length = (chord**2).sum(axis=1)
    share = -(first * chord).sum(axis=1) / np.where(length > 0.0, length, 1.0)
    nearest = first + np.clip(share, 0.0, 1.0)[:, np.newaxis] * chord
    pull = np.sqrt(((pieces.start[q, 5:7] - pieces.start[p, 5:7]) ** 2).sum(axis=1))
    bends = pieces.moves[q] | pieces.bends[p]
    bow = np.where(bends, pull * (until - since) ** 2 / 8.0, 0.0)
    blur = BLUR * (np.abs(pieces.start[p, 1:3]) + np.abs(pieces.start[q, 1:3])).sum(axis=1)
    within = (_radii(pieces, p, q) + bow) * (1.0 + BLUR) + 4.0 * blur
    near = (nearest**2).sum(axis=1) <= within**2
    near |= pieces.facing[q] < 0.0
    return p[near], q[near], since[near], until[near]


# -- cushions --------------------------------------------------------------------------------------


def _of_faces(run: Run, pieces: Pieces, met: Times) -> Iterator[Touch]:
    """Yield where a path begins along the face of a cushion, ends at it, or is tangent to it."""
    table, bends = run.scene.table, pieces.bends & pieces.moves
    edges = [edge for edge in enumerate(table.edges) if not edge[1].bulge] if table else []
    for number, edge in edges:
        normal, tangent = np.array(edge.normal), np.array(edge.tangent)
        rate, pull = pieces.start[:, 3:5] @ normal, pieces.start[:, 5:7] @ normal
        turns = pieces.start[:, 0] - rate / np.where(pull > 0.0, pull, 1.0)
        within = bends & (rate < 0.0) & (pull > 0.0) & (turns < pieces.t1)
        for some, t, begins in (
            (pieces.moves, pieces.start[:, 0], True),
            (pieces.moves, pieces.t1, False),
            (within, turns, False),
        ):
            rows = np.flatnonzero(some)
            place, velocity = pieces.at(rows, t[rows])
            blur = BLUR * (np.abs(place).sum(axis=1) + pieces.size[rows])
            offset = place - np.array(edge.start)
            foot = offset @ tangent
            found = np.abs(offset @ normal - pieces.size[rows]) <= blur
            found &= (foot >= -blur) & (foot <= edge.length + blur)
            if begins:
                found &= np.abs(velocity @ normal) <= GRAZE * np.abs(velocity).max(axis=1)
            for row in rows[found].tolist():
                i, now = int(pieces.own[row]), float(t[row])
                if now not in met.get((i, f"{number}, None"), ()):
                    yield Touch(now, begins, i, -1)
