"""This module has the compiled twins of the functions of engine/asked.py.

They look into the records of compiled shots. A wall's number is that of its first side.
"""

from __future__ import annotations

import inspect
import math
from typing import Any

from pool_pymunk.engine import asked, decisions
from pool_pymunk.engine.answers import MISSED, answer_lone, squared
from pool_pymunk.engine.modes import release
from pool_pymunk.engine.near import NOWHERE
from pool_pymunk.engine.policies import velocity_after
from pool_pymunk.fast import due, instant, kinds, moves
from pool_pymunk.fast.due import forget, look_for_walls, may_roll, note_next, put_box, refresh
from pool_pymunk.fast.instant import cluster_around, gap_to_wall, touch, touches_wall
from pool_pymunk.fast.instant import gap_between as gap_of_pair
from pool_pymunk.fast.kinds import curvature, normal, shape
from pool_pymunk.fast.moves import keep_event, put_on, stop
from pool_pymunk.fast.records import (
    CHANGES,
    COLUMNS,
    HITS,
    IN_COLLAPSE,
    IS_CUT,
    IS_OVER,
    MOST_TOGETHER,
    NOTHING,
    OUT,
    ROLL,
    WHOLE,
    Sides,
    Work,
)
from pool_pymunk.fast.shared import share_out
from pool_pymunk.fast.tables import AS_LISTED, AT_ONCE
from pool_pymunk.fast.walls import (
    STILL,
    drift_of,
    drives,
    nearest,
    note_struck,
    read_how,
    read_moving,
    speed_with_walls,
    sweep_of,
)
from pool_pymunk.fast.walls import coefficients as coefficients_of_wall
from pool_pymunk.physics import contact, laws, moving
from pool_pymunk.physics.complementarity import decide
from pool_pymunk.physics.contact import NO_BALL, Pair, Vector, closing_speed, relative, speed_in
from pool_pymunk.physics.forces import is_own as asks_own
from pool_pymunk.physics.forces import own_pull as asks_pull
from pool_pymunk.physics.impulses import slowing
from pool_pymunk.physics.laws import Slip, as_listed, respond
from pool_pymunk.physics.patches import crossing
from pool_pymunk.physics.path import NOISE, Path, fastest_of, motion_at, sets_off, standing
from pool_pymunk.physics.pieces import Piece, part_of, piece_of
from pool_pymunk.physics.pressed import BALL
from pool_pymunk.physics.sides import unit
from pool_pymunk.physics.surface import NO_ROLL, changed_by, roll_on, slowed_by
from pool_pymunk.physics.together import begin_orders, next_in_order, push_at_once

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


def speed_of(w: Work, i: int) -> float:
    return float(w.ball[i].speed)


def velocity_of(w: Work, i: int) -> Vector:
    return w.ball[i].vx, w.ball[i].vy


def rolls(w: Work) -> bool:
    return may_roll(w.ball[0])


def pull_of(w: Work) -> float:
    most = w.scene.pull
    for k in range(w.scene.patches):
        most = max(most, w.own[k][0])
    return float(most)


def pull_and_drag(w: Work, i: int) -> Vector:
    return moves.pull_and_drag(w, i)


def path_from(w: Work, i: int, place: Vector, velocity: Vector, roll: Vector) -> Path:
    return moves.path_from(w, i, w.now, place, velocity, roll)


def follower(w: Work, i: int, path: Path) -> Path:
    if path.slows:
        return standing(path.end, path.x, path.y)
    return roll_on(path, moves.pull_and_drag(w, i)[1])


def is_at_its_end(w: Work, path: Path) -> bool:
    return path.slows


def roll_after(w: Work, i: int) -> Vector:
    at, roll, change = w.instant, moves.roll_of(w, i), NO_ROLL
    if not may_roll(w.ball[i]):
        return roll
    for n in range(at.turns):
        k = at.turn[n]
        one = at.contact[k]
        if one.a == i and one.b == NO_BALL and at.kind[k] != MISSED:
            nx, ny = one.normal
            slows_by = slowing(one.pair.friction, at.impulse[k][0], one.pair.m_a)
            change = slowed_by(((nx, ny), slows_by), roll, change)
    return changed_by(change, roll)


def law_of(w: Work) -> Any:
    return w.scene


def slip_of(w: Work) -> Slip:
    return w.scene.slip[0], w.scene.slip[1]


def pair_of(one: Any) -> Pair:
    return Pair(one.pair.m_a, one.pair.m_b, one.pair.restitution, one.pair.friction)


def kick_of(w: Work, k: int) -> float:
    return 0.0  # Tables with walls that kick are played in Python.


def sweep(w: Work, sides: Sides, i: int, other: int) -> Four:
    if other >= 0:
        return STILL
    x, y, _, _ = motion_at(due.path_of(w.ball[i]), w.now)
    moves: Four = sweep_of(sides[-1 - other], sides, w.now, x, y)
    return moves


def read_drift(w: Work, sides: Sides, other: int, row: Any) -> None:
    for n in range(6):
        row[n] = 0.0
    if other < 0:
        read_how(sides[-1 - other], w.now, row)


def squeezes(w: Work) -> bool:
    return False


def squeeze(w: Work, k: int) -> bool:
    return False


def read_contact(w: Work, sides: Sides, k: int, i: int, other: int) -> Any:
    at = w.instant
    one, x, y = at.contact[k], at.place[i][0], at.place[i][1]
    one.a, one.pair.m_a = i, w.ball[i].mass
    one.pair.restitution, one.pair.friction = coefficients(w, sides, i, other)
    read_moving(one, w, sides, i, other)
    if other >= 0:
        one.b, one.pair.m_b = other, w.ball[other].mass
        one.normal[0], one.normal[1] = unit(at.place[other][0] - x, at.place[other][1] - y)
        return one
    side = nearest(sides[-1 - other], sides, w.now, x, y, w.ball[i].radius)
    one.b, one.wall, one.pair.m_b = NO_BALL, side.wall, math.inf
    one.normal[0], one.normal[1] = normal(side, x, y)
    one.curvature = curvature(side, x, y)
    return one


def answer_group(w: Work, count: int) -> None:
    """Answer a group of contacts by the law: at once, in the listing's order, or by a mean.

    Where walls that move leave balls no room, the engine plays on.
    """
    at = w.instant
    usual = speed_with_walls(at.group[0], at, count)
    if w.scene.together == AT_ONCE and push_at_once(at.group, count, at.velocity, at):
        for m in range(count):
            at.impulse[at.member[m]] = (at.pushes[m], at.rest[m], -at.rest[m])
    elif w.scene.together == AS_LISTED:
        answer_as_listed(w, count)
    else:
        answer_in_orders(w, count)
    w.is_hard |= usual > 0.0 and speed_in(at.group, count, at.velocity) > asked.SQUIRTS * usual


def answer_as_listed(w: Work, count: int) -> None:
    """Answer a group of contacts one after the other, in the listing's order."""
    at = w.instant
    for m in range(count):
        at.listed[m], at.impulse[at.member[m]] = m, (0.0, 0.0, 0.0)
    for m in range(count):
        for q in range(m + 1, count):
            if as_listed(at.group[at.listed[q]]) < as_listed(at.group[at.listed[m]]):
                at.listed[m], at.listed[q] = at.listed[q], at.listed[m]
        if closing_speed(at.group[at.listed[m]], at.velocity) > 0.0:
            answer_lone(w, at.member[at.listed[m]])


def answer_in_orders(w: Work, count: int) -> None:
    """Answer a group by the mean over orders; a shot that needs its impulses is handed back."""
    at, o = w.instant, w.orders
    w.is_hard |= w.scene.keeps == WHOLE or may_roll(w.ball[0])
    for m in range(count):
        i, (nx, ny) = at.group[m].a, at.group[m].normal
        r = w.ball[i].radius if at.group[m].b != NO_BALL else -w.ball[i].radius
        o.point[m] = (at.place[i][0] + r * nx, at.place[i][1] + r * ny)
    begin_orders(o, at.group, count, at.velocity)
    m = next_in_order(o, at.group, at.velocity)
    while m >= 0:
        jumps = respond(w.scene, at.group[m], at.velocity, slip_of(w))
        at.jumped[at.member[m]] |= jumps
        m = next_in_order(o, at.group, at.velocity)


def can_leap(w: Work) -> bool:
    return bool(w.scene.kind == 0) and not drives(w.instant.contact[0], w.instant)


def room_to_collapse(w: Work) -> Any:
    return w.collapse


def read_plastic(w: Work, k: int) -> None:
    at = w.instant
    at.hitting[k] = at.contact[k]
    at.hitting[k].pair.restitution = at.hitting[k].pair.friction = 0.0


def settle_group(w: Work, count: int) -> None:
    at = w.instant
    usual = speed_with_walls(at.group[0], at, count)
    w.is_hard |= not push_at_once(at.group, count, at.velocity, at)
    w.is_hard |= usual > 0.0 and speed_in(at.group, count, at.velocity) > asked.SQUIRTS * usual
    if may_roll(w.ball[0]) and not w.is_hard:  # Cushions slow a roll by their impulses.
        share_out(w, count)


def may_answer(w: Work) -> bool:
    w.is_hard |= w.scene.keeps == CHANGES or w.scene.together == NOTHING
    return bool(not w.is_hard)


def may_go_on(w: Work) -> bool:
    is_over = w.count.events >= w.scene.most or w.instant.unlisted >= decisions.NEVER_SETTLES
    return bool(not w.is_hard and not is_over)


def give_up(w: Work) -> None:
    w.is_hard = 1


def is_pocket(w: Work, sides: Sides, other: int) -> bool:
    return other < 0 and sides[-1 - other].pocket != NOTHING


def facing(w: Work, sides: Sides, i: int, other: int) -> tuple[float, float, float]:
    x, y, _, _ = motion_at(due.path_of(w.ball[i]), w.now)
    if other >= 0:
        u, v, _, _ = motion_at(due.path_of(w.ball[other]), w.now)
        nx, ny = unit(u - x, v - y)
        return nx, ny, 0.0
    side = nearest(sides[-1 - other], sides, w.now, x, y, w.ball[i].radius)
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
    what, found = shape(nearest(sides[-1 - other], sides, w.now, x, y, r), x, y, r)
    numbers[0], numbers[1], numbers[2], numbers[3] = found[0], found[1], found[2], found[3]
    numbers[4], numbers[5], numbers[6], numbers[7] = found[4], found[5], found[6], found[7]
    return int(what)


def lead(w: Work, i: int, path: Path) -> None:
    ball = w.ball[i]
    put_on(w, i, path)
    ball.noise, ball.moves = NOISE * fastest_of(path), 1
    moves.keep(w, i, path)


def begin(w: Work, i: int, place: Vector, velocity: Vector, roll: Vector, noise: float) -> None:
    ball = w.ball[i]
    if squared(velocity) <= noise * noise:
        velocity = (0.0, 0.0)
    velocity = velocity_after(w.errors, velocity, noise)
    path = moves.path_from(w, i, w.now, place, velocity, roll)
    put_on(w, i, path)
    ball.noise = noise
    if sets_off(path):
        ball.moves = 1
        moves.keep(w, i, path)
    elif ball.moves:
        stop(w, i, w.now)


def put_to_rest(w: Work, i: int, t: float) -> None:
    ball = w.ball[i]
    if not ball.moves:  # A path's end may be due twice.
        w.due[i].stop_t = math.inf
        note_next(w, i)
        return
    if not due.slows(ball):
        put_on(w, i, roll_on(due.path_of(ball), moves.pull_and_drag(w, i)[1]))
        ball.noise = NOISE * ball.speed
    stop(w, i, t)


def begins_to_rest(w: Work, i: int, x: float, y: float) -> bool:
    if not w.ball[i].moves:
        return False
    put_on(w, i, standing(w.now, x, y))
    stop(w, i, w.now)
    return True


def begins_to_roll(w: Work, i: int, t: float) -> None:
    w.count.events += 1
    keep_event(w, i, ROLL, t)


def crossing_of(w: Work, i: int) -> tuple[float, int]:
    path, patch = due.path_of(w.ball[i]), int(w.groups.patch[i])
    return crossing(w.border, w.scene.borders, path, patch, w.now)


def enter(w: Work, i: int, patch: int) -> None:
    w.groups.patch[i] = patch
    w.count.events += 1
    keep_event(w, i, OUT - 1 - patch, w.now)


def take_in(w: Work, sides: Sides, i: int, other: int) -> None:
    ball, count, side = w.ball[i], w.count, sides[-1 - other]
    w.track.is_heard |= w.scene.hears & HITS
    keep_event(w, i, -1 - side.wall, w.now)
    x, y, vx, vy = motion_at(due.path_of(ball), w.now)
    if w.groups.members:
        release(w, i, 0.0)
    moves.keep(w, i, Path(w.now, x, y, vx, vy, 0.0, 0.0, w.now, True, 0.0, 0.0))
    path = standing(w.now, side.center[0], side.center[1])
    put_on(w, i, path)
    ball.noise, ball.moves = 0.0, 0
    moves.keep(w, i, path)
    count.events += 1
    count.pocket[i] = side.pocket
    count.duration = max(count.duration, w.now)
    put_box(ball, NOWHERE)
    forget(w, i)
    refresh(w, i)
    w.groups.loose[i] = 0


def count_unlisted(w: Work) -> None:
    w.instant.unlisted += 1


def note_contact(w: Work, k: int) -> None:
    one = w.instant.contact[k]
    note_struck(one, w)
    if w.scene.hears & HITS:
        w.track.is_heard |= closing_of(w, one) >= (1.0 - NOISE) * w.scene.least
    if one.b != NO_BALL:
        moves.note_hit(w, one.a, one.b)
    else:
        moves.note_cushion(w, one.a, one.wall)
    moves.keep_impulse(w, w.instant.impulse[k])


def closing_of(w: Work, one: Any) -> float:
    """Return how fast (m/s) the sides of a contact close on the present paths."""
    (nx, ny), (_, _, vx, vy) = one.normal, motion(w, one.a)
    if one.b == NO_BALL:
        vx, vy = relative((vx, vy), drift_of(one))
        return float(-(vx * nx + vy * ny))
    _, _, ux, uy = motion(w, one.b)
    return float((vx - ux) * nx + (vy - uy) * ny)


def note_jump(w: Work, k: int) -> None:
    one = w.instant.contact[k]
    moves.keep_note(w, one.a, one.b)


def note_collapse(w: Work) -> None:
    at = w.instant
    for n in range(at.balls):
        moves.keep_note(w, at.ball[n], IN_COLLAPSE)
    moves.keep_note(w, w.collapse.played, IS_OVER if w.collapse.is_over else IS_CUT)


def note_order(w: Work) -> None:
    w.in_doubt = 1
    moves.keep_note(w, NOTHING, NOTHING)


def push_piece(w: Work, i: int, t: float) -> None:
    w.due[i].piece_t = min(w.due[i].piece_t, t)
    note_next(w, i)


def push_press(w: Work, i: int, t: float) -> None:
    for m in range(w.groups.waits):
        if w.groups.wait[m][0] == i and w.groups.until[m] == t:
            w.groups.asked[m] = 1
    w.due[i].press_t = min(w.due[i].press_t, t)
    note_next(w, i)


def predict_changed(w: Work, sides: Sides) -> None:
    at = w.instant
    for n in range(at.balls):
        w.anew[at.ball[n]] = at.changed[at.ball[n]]
    due.predict_anew(w, sides)


def predict_loose(w: Work, sides: Sides) -> None:
    if w.groups.loosened:
        due.predict_anew(w, sides)


def meet(w: Work, sides: Sides, i: int, j: int) -> None:
    due.meet(w, sides, i, j)
    refresh(w, i)


def use_up(w: Work, sides: Sides, i: int, other: int) -> None:
    if other >= 0 and w.pair_t[i, other] <= w.now:
        w.pair_t[i, other] = math.inf
        refresh(w, i)
    elif other < 0 and w.due[i].wall_t <= w.now:
        look_for_walls(w, sides, i, w.now)
        note_next(w, i)


def note_impulse(w: Work, i: int, other: int, began: float, impulse: Vector) -> None:
    r, m = w.groups, 0
    if w.scene.keeps != WHOLE:
        return
    while m < r.helds and (r.held[m][0] != i or r.held[m][1] != other):
        m += 1
    if m < r.helds and r.held[m][3] < began:
        forget_held(w, m)
        m = r.helds
    if m == len(r.held):
        w.is_hard = 1
        return
    one = r.held[m]
    if m == r.helds:
        r.helds += 1
        one[0], one[1], one[2], one[4], one[5] = i, other, began, 0.0, 0.0
        one[6], one[7], _, _ = motion(w, i)
        one[8], one[9], _, _ = motion(w, other) if other >= 0 else (w.now, 0.0, 0.0, 0.0)
    one[3], one[4], one[5] = w.now, one[4] + impulse[0], one[5] + impulse[1]


def forget_held(w: Work, m: int) -> None:
    """Tell of a persistent contact that is over, and forget it."""
    r = w.groups
    moves.keep_held(w, m)
    r.helds -= 1
    for k in range(m, r.helds):
        for n in range(COLUMNS):
            r.held[k][n] = r.held[k + 1][n]


def find_piece(w: Work, longest: float) -> Piece:
    return piece_of(w.press, longest)


def finds_forces(w: Work) -> bool:
    return decide(w.press, w.press.state)


def find_end(w: Work, steps: int, longest: float, time: float) -> None:
    part_of(w.press, steps, longest, time)


def has_room(w: Work, balls: int, contacts: int) -> bool:
    g = w.press
    g.rolls = may_roll(w.ball[0])
    if balls > len(g.mass) or contacts > MOST_TOGETHER or w.scene.keeps == CHANGES:
        w.is_hard = 1
    return bool(not w.is_hard)


def has_room_to_wait(w: Work) -> bool:
    return bool(w.groups.waits < len(w.groups.until))


def next_place(w: Work) -> int:
    if w.groups.used == len(w.groups.one):
        w.is_hard = 1
        return int(w.groups.used - 1)
    w.groups.used += 1
    return int(w.groups.used - 1)


def is_own(g: Any) -> bool:
    return False


def own_pull(g: Any, s: Any, p: int) -> Vector:
    return NO_ROLL


# Each of these functions is the twin of the one of the same name.
TWINS: dict[Any, Any] = {
    getattr(asked, name): value
    for name, value in [*globals().items()]
    if name in vars(asked) and inspect.isfunction(value) and value is not vars(asked)[name]
}
TWINS |= {
    asked.predict: due.predict, asked.find_cluster: instant.find_cluster,
    asked.find_touching: cluster_around, contact.pair_of: pair_of,
    contact.drift_of: drift_of, asks_own: is_own,
    moving.gap_of: kinds.flat_gap, moving.normal_of: kinds.flat_normal,
    moving.curvature_of: kinds.flat_curvature, moving.height_of: kinds.flat_height,
    asks_pull: own_pull,
    laws.balls_after: kinds.ball_ball, laws.cushion_after: kinds.cushion,
    laws.jumps_at: kinds.jumps,
}  # fmt: skip
for _function, _twin in TWINS.items():
    _function.compiled = _twin
