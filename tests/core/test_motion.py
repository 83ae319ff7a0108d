"""The closed form of motion agrees with Eq. 10, slice by slice, and keeps its own laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pool_pymunk.core.motion.path import Path, sliding
from pool_pymunk.core.motion.surface import Rolling
from pool_pymunk.core.motion.times import stopping_time
from pool_pymunk.results.motion import free_motions

EPSILON = 2.0**-52
G = 9.80665

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


def stepped(speed: float, deceleration: float, time: float, slices: int) -> tuple[float, float]:
    """Return Eq. 10 as the report has it: v' = max(0, v - a dt), s' = s + (v + v') / 2 dt."""
    s, v, dt = 0.0, speed, time / slices
    for _ in range(slices):
        new = max(0.0, v - deceleration * dt)
        s += (v + new) / 2 * dt
        v = new
    return s, v


@pytest.mark.parametrize("time", [0.1, 1.0, 1.5, 3.0])
@pytest.mark.parametrize("surface", [0.1, 0.5])
def test_closed_form_is_the_limit_of_eq_10(surface: float, time: float) -> None:
    """Only the slice in which the ball stops is wrong, by less than a dt^2 / 8."""
    speed, a, slices = 4.0, surface * G, 10_000
    s, v = stepped(speed, a, time, slices)
    x, y, vx, vy = slide(0.0, 0.0, speed, 0.0, a, time)
    tolerance = a * (time / slices) ** 2 / 8 + slices * EPSILON * 4 * speed  # The sums are rounded.
    assert (y, vy) == (0.0, 0.0)
    assert abs(x - s) <= tolerance
    assert abs(vx - v) <= slices * EPSILON * speed


@given(speed=st.floats(0.1, 10.0), surface=st.floats(0.01, 1.0))
def test_eq_10_errs_by_the_square_of_its_slice(speed: float, surface: float) -> None:
    a = surface * G
    exact = speed**2 / (2 * a)
    for slices in (16, 64, 256):
        time = 1.1 * speed / a
        s, v = stepped(speed, a, time, slices)
        assert v == 0.0
        assert abs(s - exact) <= a * (time / slices) ** 2 / 8 + slices * EPSILON * exact


@given(speed=st.floats(1e-6, 1e3), angle=angles, a=st.floats(1e-3, 100.0))
def test_a_ball_stops_after_v_over_a_having_gone_v_squared_over_2a(
    speed: float, angle: float, a: float
) -> None:
    vx, vy = along(speed, angle)
    speed = math.hypot(vx, vy)
    end = stopping_time(speed, a)
    assert end == speed / a
    x, y, wx, wy = slide(0.0, 0.0, vx, vy, a, end * (1 + 4 * EPSILON))
    assert (wx, wy) == (0.0, 0.0)
    assert math.hypot(x, y) == pytest.approx(speed**2 / (2 * a), rel=8 * EPSILON, abs=0.0)
    assert slide(0.0, 0.0, vx, vy, a, 10 * end) == (x, y, 0.0, 0.0)


@given(x=coordinates, y=coordinates, speed=speeds, angle=angles, a=decelerations, t=times)
def test_the_velocity_keeps_its_direction_and_loses_a_t(
    x: float, y: float, speed: float, angle: float, a: float, t: float
) -> None:
    vx, vy = along(speed, angle)
    _, _, wx, wy = slide(x, y, vx, vy, a, t)
    speed_now = max(math.hypot(vx, vy) - a * t, 0.0)
    # v - a t is formed as v (1 - a t / v), so an error of EPSILON in the bracket is one of v's
    # size.
    assert abs(math.hypot(wx, wy) - speed_now) <= 8 * EPSILON * speed
    assert abs(wx * vy - wy * vx) <= 8 * EPSILON * speed**2
    assert wx * vx + wy * vy >= 0.0


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


@given(x=coordinates, y=coordinates, speed=speeds, angle=angles, t=times)
def test_without_friction_a_ball_goes_straight_on(
    x: float, y: float, speed: float, angle: float, t: float
) -> None:
    vx, vy = along(speed, angle)
    assert slide(x, y, vx, vy, 0.0, t) == (x + vx * t, y + vy * t, vx, vy)
    assert stopping_time(speed, 0.0) == (math.inf if speed > 0.0 else 0.0)


@given(x=coordinates, y=coordinates, a=decelerations, t=times)
def test_a_ball_at_rest_stays(x: float, y: float, a: float, t: float) -> None:
    assert slide(x, y, 0.0, 0.0, a, t) == (x, y, 0.0, 0.0)
    assert stopping_time(0.0, a) == 0.0


@given(x=coordinates, y=coordinates, speed=speeds, angle=angles, a=decelerations)
def test_no_time_no_change(x: float, y: float, speed: float, angle: float, a: float) -> None:
    vx, vy = along(speed, angle)
    assert slide(x, y, vx, vy, a, 0.0) == (x, y, vx, vy)


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


@given(speed=speeds, angle=angles, a=st.floats(1e-3, 100.0), t=times)
def test_friction_does_the_work_that_the_energy_loses(
    speed: float, angle: float, a: float, t: float
) -> None:
    """The closed form obeys Newton's second law: m v^2 / 2 - m v'^2 / 2 = m a s."""
    vx, vy = along(speed, angle)
    x, y, wx, wy = slide(0.0, 0.0, vx, vy, a, t)
    lost = vx * vx + vy * vy - wx * wx - wy * wy
    scale = speed**2 + 2.0 * a * math.hypot(x, y)
    assert lost == pytest.approx(2.0 * a * math.hypot(x, y), rel=0, abs=16 * EPSILON * scale)


def test_slide_by_hand() -> None:
    """At 5 m/s and 2 m/s^2 for 1.5 s a ball travels 5 * 1.5 - 1.5^2 = 5.25 m and still has 2 m/s.

    Its velocity is (3, -4) m/s.
    """
    assert slide(1.0, 2.0, 3.0, -4.0, 2.0, 1.5) == pytest.approx(
        (1.0 + 0.6 * 5.25, 2.0 - 0.8 * 5.25, 0.6 * 2.0, -0.8 * 2.0), rel=4 * EPSILON, abs=0.0
    )


@given(speed=speeds, angle=angles, roll=speeds, turned=angles)
def test_no_ball_is_faster_on_its_path_than_the_fastest(
    speed: float, angle: float, roll: float, turned: float
) -> None:
    """A ball that slips is the fastest where its path begins, or where it begins to roll."""
    path = Rolling(2.0, 0.1).path(0.0, (0.0, 0.0), along(speed, angle), along(roll, turned))
    found = [math.hypot(*path.velocity(share * path.end)) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert path.fastest == pytest.approx(max(found), rel=8 * EPSILON)
