"""This module describes a live table as a Scene and a State, for solvers and many shots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import pymunk

from pool_pymunk.core.contact.contact import Pair
from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.walls.face import face_between
from pool_pymunk.laws import LAWS, Law
from pool_pymunk.model import (
    Ball,
    Friction,
    Physics,
    Pocket,
    Post,
    Restitution,
    Scene,
    State,
    Table,
)
from pool_pymunk.model.outline import LEVEL
from pool_pymunk.model.problems import setting_error
from pool_pymunk.world.ball import TableBall
from pool_pymunk.world.outlook import Straight, crossings, edge_of
from pool_pymunk.world.table import LiveTable
from pool_pymunk.world.walls import Line, Obstacle, line_of

JOINED = 1e-9  # of the size of an outline; ends of walls that are nearer are one corner
STEEP = 1e-9  # the sine of an angle; walls that meet at a smaller one go straight on


def scene_of(live: LiveTable, law: Law, table: Table | None) -> tuple[Scene, State]:
    """Return the balls on a table and all around them, and how the balls move now.

    ``table`` is the outline; by default it is that of the walls.
    """
    balls, surface, walls, obstacles = live.on_table, live.surface, live.walls.solid, live.walls
    if moving := obstacles.moving:
        message = "a scene has no walls that move: remove them first, and add them again later"
        raise setting_error("walls", f"{len(moving)} of kinematic bodies", message)
    for each in walls:
        if each.wall.kick:
            message = f"a scene has no walls that kick: remove wall {each.wall.number} first"
            raise setting_error("kick", each.wall.kick, message)
    _refuse_pushes(live)
    posts = [each for each in walls if each.is_drawn and isinstance(each.shape, pymunk.Circle)]
    others = [each for each in walls if each not in posts]
    hits, cue = _of_balls(live)
    if cue is None:
        cue = next((ball.number for ball in balls if ball.id == "cue"), None)
    at_cushions, rubs = _of_cushions(others)
    moves = [live.motion_of(ball) for ball in balls]
    places = tuple([(x, y) for (x, y, _, _), _ in moves])
    scene = Scene(
        tuple([
            Ball(name_of(ball), place, ball.radius, ball.body.mass, cue=ball.number == cue)
            for ball, place in zip(balls, places, strict=True)
        ]),
        _ground(live, _outline(others) if table is None and others else table),
        Restitution(hits[0], cue_ball=hits[1], cushion=at_cushions),
        Friction(
            0.0 if isinstance(surface, Falling) else surface.pull, rubs, hits[2],
            surface.drag if surface.rolls else None,
        ),
        Physics(_law_of(law), gravity=1.0),
        pockets=tuple([Pocket(f"{k}", *hole) for k, hole in obstacles.pockets.items()]),
        posts=tuple([_post(each) for each in posts]),
        patches=tuple(live.patches.values()),
    )  # fmt: skip
    rolls = tuple([roll for _, roll in moves]) if surface.rolls else None
    return scene, State(places, tuple([(u, v) for (_, _, u, v), _ in moves]), roll=rolls)


def _refuse_pushes(live: LiveTable) -> None:
    """Refuse what pushes balls at the end of each step."""
    for key, value in live.left_out.items():
        message = f"a scene has no {key} of a space"
        if key == "gravity":
            message = "balls of a scene fall only without deceleration and rolling"
        raise setting_error(key, value, message)
    for ball in live.on_table:
        if ball.body.constraints:
            message = f"a scene has no springs and joints: remove those of ball {ball.name} first"
            raise setting_error("constraints", len(ball.body.constraints), message)


def _ground(live: LiveTable, table: Table | None) -> Table | None:
    """Return a table that is tilted as the live one is."""
    if table is None and live.falls != LEVEL:
        message = "a scene without a table has no tilt: give the table"
        raise setting_error("gravity", list(live.falls), message)
    return table if table is None else replace(table, tilt=live.falls)


def name_of(ball: TableBall) -> str:
    """Return the id of a ball, or its number if it has none."""
    return f"{ball.number}" if ball.id is None else ball.id


def _law_of(law: Law) -> str:
    if LAWS.get(law.name) is not law:
        message = "a scene has a law by its name, so it cannot have one of your own"
        raise setting_error("law", law.name, message)
    return law.name


# -- coefficients ----------------------------------------------------------------------------------


def _of_balls(live: LiveTable) -> tuple[tuple[float | None, float | None, float], int | None]:
    """Return what hits of balls have, and the ball whose hits have another restitution, if any.

    That is the restitution of all hits, that of this ball's, and the friction.
    """
    balls = [ball.number for ball in live.on_table]
    live.engine.table.forget()
    pairs: dict[tuple[int, int], Pair] = {
        (i, j): live.engine.table.pair(live.balls[i].core, live.balls[j].core)
        for i, j in combinations(balls, 2)
    }
    if not pairs:
        return (None, None, 0.0), None
    frictions = {pair.friction for pair in pairs.values()}
    for cue in (None, *balls):
        apart = {pair.restitution for two, pair in pairs.items() if cue in two}
        rest = {pair.restitution for two, pair in pairs.items() if cue not in two}
        if len(rest) == len(frictions) == 1 and len(apart) <= 1:
            return (rest.pop(), apart.pop() if apart else None, frictions.pop()), cue
    message = "a scene has one restitution for all balls, and one for a cue ball, and one friction"
    raise setting_error("pair", "several coefficients", message)


def _of_cushions(walls: Sequence[Obstacle]) -> tuple[float | None, float]:
    """Return the restitution and the friction of all walls that are no posts."""
    found = {(each.wall.restitution, each.wall.friction) for each in walls}
    if len(found) > 1:
        message = "a scene has one restitution and one friction for all cushions"
        raise setting_error("walls", "several coefficients", message)
    return found.pop() if found else (None, 0.0)


# -- places ----------------------------------------------------------------------------------------


def _post(each: Obstacle) -> Post:
    shape, wall = each.shape, each.wall
    assert isinstance(shape, pymunk.Circle) and shape.body is not None
    x, y = shape.body.local_to_world(shape.offset)
    return Post((x, y), shape.radius, wall.restitution, wall.friction)


def _outline(walls: Sequence[Obstacle]) -> Table:
    """Return the outline that segments enclose, which begins with the first one."""
    message = "these walls are no single outline of segments: give it as table=Table(...)"
    lines = []
    for each in walls:
        shape = each.shape
        if not isinstance(shape, pymunk.Segment) or not each.is_drawn:
            raise setting_error("walls", type(shape).__name__, message)
        lines.append((line_of(shape), shape.radius))
    size = max(math.dist(*line) for line, _ in lines)
    loop = _loop(lines, JOINED * size)
    if loop is None:
        raise setting_error("walls", len(walls), message)
    corners = [_corner(*two) for two in zip(loop[-1:] + loop[:-1], loop, strict=True)]
    if None in corners:
        raise setting_error("walls", "thick at an inner corner", message)
    return Table(tuple(corner for corner in corners if corner is not None))


def _loop(lines: list[tuple[Line, float]], near: float) -> list[tuple[Line, float]] | None:
    """Return lines from end to end, counter-clockwise; None if they do not close."""
    found, left = lines[:1], lines[1:]
    while left:
        _, end = found[-1][0]
        here = [
            (k, line)
            for k, line in enumerate(left)
            if min(math.dist(end, p) for p in line[0]) <= near
        ]
        if len(here) != 1:
            return None
        k, ((a, b), radius) = here[0]
        found.append((((a, b) if math.dist(end, a) <= near else (b, a)), radius))
        del left[k]
    if math.dist(found[-1][0][1], found[0][0][0]) > near:
        return None
    area = sum(a[0] * b[1] - a[1] * b[0] for (a, b), _ in found)
    if area > 0.0:
        return found
    turned = [((b, a), radius) for (a, b), radius in reversed(found)]
    return turned[-1:] + turned[:-1]  # It begins with the same wall.


def _corner(before: tuple[Line, float], after: tuple[Line, float]) -> Vector | None:
    """Return where the surfaces (m) of two walls meet; None where a thick wall has a round end."""
    ((_, b), r), (_, s) = before, after
    one, two = (edge_of(face_between(*line, radius), 0.0) for line, radius in (before, after))
    assert isinstance(one, Straight) and isinstance(two, Straight)
    (nx, ny), (mx, my) = one.normal, two.normal
    turn = nx * my - ny * mx
    if r == s == 0.0 or (abs(turn) <= STEEP and r == s):
        return b[0] + r * nx, b[1] + r * ny
    return crossings(one, two)[0] if turn > STEEP else None
