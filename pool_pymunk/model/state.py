"""This module has the state of the balls, and reads one from what users pass."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any, NamedTuple

from pool_pymunk.model.plain import Unfit, each, is_row, point, text
from pool_pymunk.model.problems import Point, Problem, SceneError, no_such_ball, shown

NO_ROLLING = "balls do not roll in a scene without friction.rolling"


class State(NamedTuple):
    """A state tells where the balls are (m) and how they move (m/s), in the scene's order.

    ``off`` has the ids of the balls that are off the table: they meet nothing and stay where they
    are. ``roll`` has the velocity at which each ball would roll (m/s), where balls roll, and is
    None elsewhere.
    """

    position: tuple[Point, ...]
    velocity: tuple[Point, ...]
    off: frozenset[str] = frozenset()
    roll: tuple[Point, ...] | None = None


def read_state(value: Any, ids: Collection[str], rolls: bool = False) -> State:
    """Read a :class:`State`, or positions and velocities, in tuples, lists or arrays.

    Balls off the table get the velocity 0. A roll that is left out is 0 if balls roll. Raises
    SceneError for what is no state of these balls.
    """
    if not is_row(value) or not 2 <= len(value) <= 4:
        message = "must be a State: positions, velocities, and the ids of balls off the table"
        raise SceneError([Problem("start", value, message)])
    position, velocity, off, roll = (*value, *((), None)[len(value) - 2 :])[:4]
    places = _read_points("position", position, ids)
    speeds = _read_points("velocity", velocity, ids)
    gone = _read_off(off, ids)
    if roll is not None and not rolls:
        raise SceneError([Problem("start.roll", roll, NO_ROLLING)])
    still = ((0.0, 0.0),) * len(ids)
    turns = still if roll is None else _read_points("roll", roll, ids)
    moves, turns = (
        tuple((0.0, 0.0) if id_ in gone else v for id_, v in zip(ids, vectors, strict=True))
        for vectors in (speeds, turns)
    )
    return State(places, moves, gone, turns if rolls else None)


def _read_points(name: str, value: Any, ids: Collection[str]) -> tuple[Point, ...]:
    """Read one point for each ball."""
    if not is_row(value) or len(value) != len(ids):
        given = f"{len(value)} given" if is_row(value) else "none given"
        message = f"must be {len(ids)} points, one for each ball ({given})"
        raise SceneError([Problem(f"start.{name}", value, message)])
    try:
        return tuple(each(point, enumerate(value)))
    except Unfit as unfit:
        balls = [shown(id_) for id_ in ids]
        raise SceneError([
            replace(one, message=f"{one.message} (ball {balls[int(one.steps[0])]})")
            .under("start", name) for one in unfit.inside
        ]) from None  # fmt: skip


def _read_off(value: Any, ids: Collection[str]) -> frozenset[str]:
    """Read the ids of the balls that are off the table."""
    if not (is_row(value) or isinstance(value, set | frozenset)):
        raise SceneError([Problem("start.off", value, "must be the ids of balls, in a set")])
    for id_ in value:
        if not isinstance(id_, str) or id_ not in ids:
            raise SceneError([Problem("start.off", id_, no_such_ball(ids))])
    return frozenset(map(text, value))
