"""This module has the state of the balls, and reads one from what users pass."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from pool_pymunk.model.plain import Unfit, each, is_row, point, text
from pool_pymunk.model.problems import Point, Problem, SceneError, listed, shown

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

    Balls that are off the table rest. Where balls roll, those of a state that leaves their roll out
    have none. Raises SceneError for what is no state of these balls.
    """
    if not is_row(value) or not 2 <= len(value) <= 4:
        message = "must be a State: positions, velocities, and the ids of balls off the table"
        raise SceneError([Problem("start", value, message)])
    position, velocity, off, roll = (*value, *((), None)[len(value) - 2 :])[:4]
    places = _read_points("position", position, ids)
    speeds = _read_points("velocity", velocity, ids)
    gone = _read_off(off, ids)
    if not rolls:
        if roll is not None:
            raise SceneError([Problem("start.roll", roll, NO_ROLLING)])
        return State(places, _at_rest(speeds, ids, gone), gone)
    turns = ((0.0, 0.0),) * len(ids) if roll is None else _read_points("roll", roll, ids)
    return State(places, _at_rest(speeds, ids, gone), gone, _at_rest(turns, ids, gone))


def _at_rest(
    vectors: Iterable[Point], ids: Iterable[str], gone: Collection[str]
) -> tuple[Point, ...]:
    """Return these vectors, with zero for balls that are off the table."""
    return tuple((0.0, 0.0) if id_ in gone else v for id_, v in zip(ids, vectors, strict=True))


def _read_points(name: str, value: Any, ids: Collection[str]) -> tuple[Point, ...]:
    """Read one point a ball."""
    key = f"start.{name}"
    if not is_row(value) or len(value) != len(ids):
        given = f"{len(value)} given" if is_row(value) else "none given"
        raise SceneError([Problem(key, value, f"must be {len(ids)} points, one a ball ({given})")])
    balls = list(ids)
    try:
        return tuple(each(point, enumerate(value)))
    except Unfit as unfit:
        found = [problem.under("start", name) for problem in unfit.inside]
        raise SceneError([_of_ball(one, balls[int(one.steps[2])]) for one in found]) from None


def _of_ball(problem: Problem, id_: str) -> Problem:
    return replace(problem, message=f"{problem.message} (ball {shown(id_)})")


def _read_off(value: Any, ids: Collection[str]) -> frozenset[str]:
    """Read the ids of the balls that are off the table."""
    if not (is_row(value) or isinstance(value, set | frozenset)):
        raise SceneError([Problem("start.off", value, "must be the ids of balls, in a set")])
    for id_ in value:
        if not isinstance(id_, str) or id_ not in ids:
            message = f"there is no such ball (there are: {listed(ids)})"
            raise SceneError([Problem("start.off", id_, message)])
    return frozenset(map(text, value))
