"""Motion along a path: from where a ball is it goes on as before; NumPy has the same bits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pool_pymunk.core.motion.path import Path, sliding
from pool_pymunk.core.motion.surface import Rolling
from pool_pymunk.results.motion import free_motions

EPSILON = 2.0**-52

coordinates = st.floats(-100.0, 100.0)
speeds = st.just(0.0) | st.floats(1e-9, 100.0)  # Squares of less would lose digits.
angles = st.floats(-math.pi, math.pi)
decelerations = st.just(0.0) | st.floats(1e-3, 100.0)
times = st.floats(0.0, 100.0)


def along(speed: float, angle: float) -> tuple[float, float]:
    return (speed * math.cos(angle), speed * math.sin(angle))


def rounding(speed: float, time: float) -> float:
    """Return the rounding of some ten operations on numbers of the coordinates' size."""
    return 16 * EPSILON * (100.0 + speed * time)


def slide(
    x: float, y: float, vx: float, vy: float, deceleration: float, time: float
) -> tuple[float, float, float, float]:
    """Return position (m) and velocity (m/s) of a free disc after ``time`` (s)."""
    return sliding(0.0, (x, y), (vx, vy), deceleration).at(time)


@given(
    x=coordinates, y=coordinates, speed=speeds, angle=angles, a=decelerations, t1=times, t2=times
)
def test_sliding_on_is_sliding_in_one_go(
    x: float, y: float, speed: float, angle: float, a: float, t1: float, t2: float
) -> None:
    start = (x, y, *along(speed, angle))
    once = slide(*start, a, t1 + t2)
    twice = slide(*slide(*start, a, t1), a, t2)
    assert math.dist(once[:2], twice[:2]) <= rounding(speed, t1 + t2) + 8 * EPSILON * speed * t2
    # An error of EPSILON a t in the time of the stop is one in the velocity just before.
    assert math.dist(once[2:], twice[2:]) <= 16 * EPSILON * (speed + a * (t1 + t2))


@given(
    st.lists(st.tuples(times, coordinates, coordinates, speeds, angles, times), max_size=20),
    decelerations,
)
def test_free_motions_are_those_of_paths(
    rows: list[tuple[float, float, float, float, float, float]], a: float
) -> None:
    breakpoints = [
        (t, x, y, *along(speed, angle), a, -a / 3.0) for t, x, y, speed, angle, _ in rows
    ]
    at = np.array([row[0] for row in breakpoints]) + np.array([row[-1] for row in rows])
    position, velocity = free_motions(np.array(breakpoints).reshape(-1, 7), at)
    for k, (t, x, y, vx, vy, ax, ay) in enumerate(breakpoints):
        path = Path(t, x, y, vx, vy, ax, ay, math.inf, False, 0.0, 0.0)
        assert (*position[k], *velocity[k]) == path.at(at[k])


def test_free_motions_of_nothing() -> None:
    position, velocity = free_motions(np.empty((0, 7)), np.empty(0))
    assert position.shape == velocity.shape == (0, 2)


@given(speed=speeds, angle=angles, roll=speeds, turned=angles)
def test_no_ball_is_faster_on_its_path_than_the_fastest(
    speed: float, angle: float, roll: float, turned: float
) -> None:
    """A ball that slips is the fastest where its path begins, or where it begins to roll."""
    path = Rolling(2.0, 0.1).path(0.0, (0.0, 0.0), along(speed, angle), along(roll, turned))
    found = [math.hypot(*path.velocity(share * path.end)) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert path.fastest == pytest.approx(max(found), rel=8 * EPSILON)
