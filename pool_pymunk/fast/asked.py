"""This module has twins of the functions by which groups ask the engine (engine/asked.py).

They look into the records of compiled shots. A wall's number is that of its first side.
"""

from __future__ import annotations

from typing import Any

from pool_pymunk.engine import asked
from pool_pymunk.fast import due, moves
from pool_pymunk.fast.due import may_roll, note_next, predict_marked
from pool_pymunk.fast.instant import cluster_around, gap_to_wall, touch, touches_wall
from pool_pymunk.fast.instant import gap_between as gap_of_pair
from pool_pymunk.fast.kinds import curvature, normal, shape
from pool_pymunk.fast.moves import put_on, stop
from pool_pymunk.fast.records import MOST_BALLS, MOST_TOGETHER, NOTHING, Sides, Work
from pool_pymunk.fast.walls import coefficients as coefficients_of_wall
from pool_pymunk.fast.walls import nearest
from pool_pymunk.physics.changes import ROLL
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import NOISE, Path, fastest_of, motion_at, standing
from pool_pymunk.physics.pieces import Piece
from pool_pymunk.physics.pressed import BALL
from pool_pymunk.physics.pressed import is_own as asks_own
from pool_pymunk.physics.pressed import own_pull as asks_pull
from pool_pymunk.physics.sides import unit
from pool_pymunk.physics.surface import NO_ROLL, roll_on

Four = tuple[float, float, float, float]


def path_of(w: Work, i: int) -> Path:
    return due.path_of(w.ball[i])


def motion(w: Work, i: int) -> Four:
    return motion_at(due.path_of(w.ball[i]), w.now)


def roll_of(w: Work, i: int) -> Vector:
    return moves.roll_of(w, i)


def noise_of(w: Work, i: int) -> float:
    return float(w.ball[i].noise)


def radius_of(w: Work, i: int) -> float:
    return float(w.ball[i].radius)


def mass_of(w: Work, i: int) -> float:
    return float(w.ball[i].mass)


def rolls(w: Work) -> bool:
    return may_roll(w.ball[0])


def pull_and_drag(w: Work) -> Vector:
    return w.scene.pull, w.scene.drag if may_roll(w.ball[0]) else w.scene.pull


def path_from(w: Work, place: Vector, velocity: Vector, roll: Vector) -> Path:
    return moves.path_from(w, w.now, place, velocity, roll)


def follower(w: Work, path: Path) -> Path:
    return standing(path.end, path.x, path.y) if path.slows else roll_on(path, w.scene.drag)


def is_pocket(w: Work, sides: Sides, other: int) -> bool:
    return other < 0 and sides[-1 - other].pocket != NOTHING


def facing(w: Work, sides: Sides, i: int, other: int) -> tuple[float, float, float]:
    x, y, _, _ = motion_at(due.path_of(w.ball[i]), w.now)
    if other >= 0:
        u, v, _, _ = motion_at(due.path_of(w.ball[other]), w.now)
        nx, ny = unit(u - x, v - y)
        return nx, ny, 0.0
    side = nearest(sides, sides[-1 - other], x, y, w.ball[i].radius)
    nx, ny = normal(side, x, y)
    return nx, ny, curvature(side, x, y)


def coefficients(w: Work, sides: Sides, i: int, other: int) -> Vector:
    scene = w.scene
    if other < 0:
        return coefficients_of_wall(sides[-1 - other], scene)
    e = scene.cue_ball if scene.cue in (i, other) else scene.ball_ball
    return e, scene.ball_friction


def gap_between(w: Work, sides: Sides, i: int, other: int) -> float:
    return gap_of_pair(w, i, other) if other >= 0 else gap_to_wall(w, sides, i, -1 - other)


def is_closed(w: Work, sides: Sides, i: int, other: int) -> bool:
    if other >= 0:
        return touch(w, i, other, 1.0)
    return touches_wall(w, sides, i, -1 - other, 1.0)


def read_shape(w: Work, sides: Sides, i: int, other: int, numbers: Any) -> int:
    r = w.ball[i].radius
    if other >= 0:
        numbers[0] = r + w.ball[other].radius
        return BALL
    x, y, _, _ = motion_at(due.path_of(w.ball[i]), w.now)
    what, found = shape(nearest(sides, sides[-1 - other], x, y, r), x, y, r)
    numbers[0], numbers[1], numbers[2], numbers[3] = found[0], found[1], found[2], found[3]
    numbers[4], numbers[5], numbers[6], numbers[7] = found[4], found[5], found[6], found[7]
    return int(what)


def find_touching(w: Work, sides: Sides, i: int) -> None:
    cluster_around(w, sides, i)


def lead(w: Work, i: int, path: Path) -> None:
    ball = w.ball[i]
    w.groups.is_full |= not put_on(w, i, path)
    ball.noise, ball.moves = NOISE * fastest_of(path), 1
    moves.keep(w, i, path)


def begins_to_rest(w: Work, i: int, x: float, y: float) -> bool:
    if not w.ball[i].moves:
        return False
    put_on(w, i, standing(w.now, x, y))
    stop(w, i, w.now)
    return True


def begins_to_roll(w: Work, i: int) -> None:
    w.count.events += 1
    moves.keep_event(w, i, ROLL, w.now)


def count_piece(w: Work) -> None:
    w.together.unlisted += 1


def push_piece(w: Work, i: int, t: float) -> None:
    w.due[i].piece_t = min(w.due[i].piece_t, t)
    note_next(w, i)


def push_press(w: Work, i: int, t: float) -> None:
    for m in range(w.groups.waits):
        if w.groups.wait[m][0] == i and w.groups.until[m] == t:
            w.groups.asked[m] = 1
    w.due[i].press_t = min(w.due[i].press_t, t)
    note_next(w, i)


def predict_loose(w: Work, sides: Sides) -> None:
    if w.groups.loosened:
        for i in range(w.scene.balls):
            w.together.changed[i] = 0
        predict_marked(w, sides)


def note_impulse(w: Work, i: int, other: int, began: float, impulse: Vector) -> None:
    """Do nothing: compiled shots do not tell of persistent contacts."""


def note_piece(w: Work, leader: int, piece: Piece) -> None:
    """Do nothing: nobody follows changes through the pieces of compiled shots."""


def note_let_go(w: Work, i: int) -> None:
    """Do nothing: nobody follows changes through the pieces of compiled shots."""


def open_gaps(g: Any, gap: float) -> None:
    """Do nothing: compiled shots are no variants."""


def has_room(w: Work, balls: int, contacts: int) -> bool:
    g = w.press
    g.rolls = may_roll(w.ball[0])
    g.pull, g.drag = pull_and_drag(w)
    if balls > MOST_BALLS or contacts > MOST_TOGETHER or w.scene.keeps:
        w.groups.is_full = 1
    return bool(w.groups.is_full == 0)


def has_room_to_wait(w: Work) -> bool:
    return bool(w.groups.waits < MOST_TOGETHER)


def next_place(w: Work) -> int:
    if w.groups.used == MOST_TOGETHER:
        w.groups.is_full = 1
        return MOST_TOGETHER - 1
    w.groups.used += 1
    return int(w.groups.used - 1)


def is_own(g: Any) -> bool:
    return False


def own_pull(g: Any, s: Any, p: int) -> Vector:
    return NO_ROLL


TWINS: dict[Any, Any] = {
    asked.path_of: path_of, asked.motion: motion, asked.roll_of: roll_of,
    asked.noise_of: noise_of, asked.radius_of: radius_of, asked.mass_of: mass_of,
    asked.rolls: rolls, asked.pull_and_drag: pull_and_drag, asked.path_from: path_from,
    asked.follower: follower, asked.is_pocket: is_pocket, asked.facing: facing,
    asked.coefficients: coefficients, asked.gap_between: gap_between,
    asked.is_closed: is_closed, asked.read_shape: read_shape,
    asked.find_touching: find_touching, asked.lead: lead,
    asked.begins_to_rest: begins_to_rest, asked.begins_to_roll: begins_to_roll,
    asked.count_piece: count_piece, asked.push_piece: push_piece,
    asked.push_press: push_press, asked.predict_loose: predict_loose,
    asked.note_impulse: note_impulse, asked.note_piece: note_piece,
    asked.note_let_go: note_let_go, asked.open_gaps: open_gaps, asked.has_room: has_room,
    asked.has_room_to_wait: has_room_to_wait, asked.next_place: next_place,
    asks_own: is_own, asks_pull: own_pull,
}  # fmt: skip
for _function, _twin in TWINS.items():
    _function.compiled = _twin
