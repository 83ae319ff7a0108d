"""Paths meet when roots in forty digits say so, and what rounding would decide is settled."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp, mpf

from pool_pymunk.core.motion import pairs, times
from pool_pymunk.core.motion.path import Path, sliding
from pool_pymunk.core.motion.times import path_to_disc
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.laws.contact import Vector
from tests.oracle.reference import DIGITS, product, real_roots, value

EPSILON = 2.0**-52
R = 0.05


def time_of_impact(
    offset: Vector,
    velocity: Vector,
    pull: Vector,
    touching: float,
    horizon: float,
    noise: float = 0.0,
) -> float:
    return times.time_of_impact(offset, velocity, pull, touching, horizon, noise)


def pair_time(a: Path, b: Path, touching: float, since: float, until: float) -> float:
    return pairs.pair_time(a, b, touching, since, until, 0.0)


def square_of(*motion: Vector) -> list[Any]:
    """Return the polynomial |offset + velocity t + pull t^2 / 2|^2."""
    x, y = ([mpf(p), mpf(v), mpf(a) / 2] for p, v, a in zip(*motion, strict=True))
    return [a + b for a, b in zip(product(x, x), product(y, y), strict=True)]


def first_touch(
    offset: Vector, velocity: Vector, pull: Vector, touching: float, horizon: float
) -> float:
    """Return the first root of the quartic |offset + velocity t + pull t^2 / 2|^2 = touching^2."""
    with mp.workdps(DIGITS):
        gap = square_of(offset, velocity, pull)
        gap[0] -= mpf(touching) ** 2
        roots = real_roots(gap, mpf(0), mpf(horizon))
        return float(roots[0]) if roots else math.inf


def smallest_gap(
    offset: Vector, velocity: Vector, pull: Vector, touching: float, t: float
) -> float:
    """Return how near to each other discs come until ``t``, in forty digits."""
    with mp.workdps(DIGITS):
        square = square_of(offset, velocity, pull)
        turns = real_roots([k * c for k, c in enumerate(square)][1:], mpf(0), mpf(t))
        return float(min(mp.sqrt(value(square, s)) for s in (0, *turns, mpf(t))) - mpf(touching))


def closing_speed_at(offset: Vector, velocity: Vector, pull: Vector, t: float) -> float:
    x, y = (p + t * (v + 0.5 * t * a) for p, v, a in zip(offset, velocity, pull, strict=True))
    vx, vy = (v + t * a for v, a in zip(velocity, pull, strict=True))
    return -(x * vx + y * vy) / math.hypot(x, y)


places = st.floats(-2.0, 2.0)
speeds = st.floats(-5.0, 5.0)
pulls = st.floats(-4.0, 4.0) | st.just(0.0)
vectors = st.tuples


@given(
    vectors(places, places), vectors(speeds, speeds), vectors(pulls, pulls), st.floats(0.01, 0.3)
)
def test_it_is_the_first_root_of_the_quartic(
    offset: Vector, velocity: Vector, pull: Vector, touching: float
) -> None:
    """Coordinates are good to a few roundings, and so is the time, divided by the closing speed."""
    assume(math.hypot(*offset) > touching * (1 + 1e-12))
    t = time_of_impact(offset, velocity, pull, touching, 10.0)
    expected = first_touch(offset, velocity, pull, touching, 10.0)
    if t == math.inf or expected == math.inf:
        until = 10.0 if t == expected else min(t, expected)
        assert t == expected or abs(smallest_gap(offset, velocity, pull, touching, until)) < 1e-14
        return
    distance = math.hypot(*offset) + t * math.hypot(*velocity) + t * t * math.hypot(*pull)
    slack = 16 * EPSILON * (distance + touching)
    closing = max(closing_speed_at(offset, velocity, pull, expected), 1e-300)
    curving = math.sqrt(2 * slack / max(abs(closing_acceleration(offset, velocity, pull)), 1e-3))
    assert abs(t - expected) <= min(2 * slack / closing, 10 * curving) + 4 * EPSILON * t


@pytest.mark.parametrize("pull", [(0.0, 0.0), (1e-17, 0.0), (0.0, 1e-300), (0.5, 0.0), (-0.5, 0.0)])
def test_decelerations_that_are_equal_or_parallel_are_no_special_case(pull: Vector) -> None:
    """The quartic loses its degree: x = 1 - 2 t + p t^2 / 2 meets 0.1."""
    p = pull[0]
    expected = 0.9 * 2 / (2 + math.sqrt(4 - 2 * p * 0.9))
    t = time_of_impact((1.0, 0.0), (-2.0, 0.0), pull, 0.1, 9.0)
    assert t == pytest.approx(expected, rel=1e-15, abs=0.0)


@pytest.mark.parametrize("across", [1.0 - 1e-12, 1.0 - 1e-9, 1.0 + 1e-12, 1.0 + 1e-9])
@pytest.mark.parametrize("pull", [0.0, 0.3])
def test_a_millionth_of_a_micrometre_decides_a_grazing_hit(across: float, pull: float) -> None:
    """Discs pass at ``across`` contact distances, resting or both moving, and hit or do not."""
    touching = 2 * R
    y = across * touching
    length = path_to_disc((1.0, y), (1.0, 0.0), touching)
    t = time_of_impact((1.0, y), (-2.0, 0.0), (pull, 0.0), touching, 9.0)
    if across > 1.0:
        assert (length, t) == (math.inf, math.inf)
        return
    chord = math.sqrt((touching - y) * (touching + y))
    assert length == pytest.approx(1.0 - chord, rel=1e-9)  # The root of a rounding of y is 1e-8 R.
    assert 2.0 * t - 0.5 * pull * t * t == pytest.approx(1.0 - chord, rel=1e-9)


@pytest.mark.parametrize("gap", [0.0, -1e-17, -1e-13, -1e-10])
@pytest.mark.parametrize("pull", [(0.0, 0.0), (0.0, 0.4)])
def test_touching_and_approaching_is_now_and_receding_is_never(gap: float, pull: Vector) -> None:
    offset = (2 * R + gap, 0.0)
    assert time_of_impact(offset, (-1e-3, 0.5), pull, 2 * R, 1.0, 1e-15) == 0.0
    assert time_of_impact(offset, (1e-3, 0.5), pull, 2 * R, 1.0, 1e-15) == math.inf
    assert path_to_disc(offset, (1.0, 0.0), 2 * R) == 0.0
    assert path_to_disc(offset, (-1.0, 0.0), 2 * R) == math.inf
    assert path_to_disc(offset, (0.0, 1.0), 2 * R) == math.inf


@pytest.mark.parametrize("speed", [1e-6, 1e-3, 0.5])
def test_touching_discs_that_are_thrown_apart_and_pulled_back_meet_again(speed: float) -> None:
    """x = d + v t - t^2 / 2 is at d again after 2 v, to rounding over v."""
    t = time_of_impact((2 * R, 0.0), (speed, 0.0), (-1.0, 0.0), 2 * R, 9.0, 1e-15)
    assert t == pytest.approx(2 * speed, abs=1e-15 / speed)


def test_discs_that_touch_and_rest_with_each_other_do_not_meet() -> None:
    assert time_of_impact((2 * R, 0.0), (0.0, 0.0), (0.0, 0.0), 2 * R, 1e9) == math.inf
    assert time_of_impact((2 * R, 0.0), (1e-17, -1e-17), (0.0, 0.0), 2 * R, 9.0, 1e-15) == math.inf


def test_concentric_discs_have_an_answer() -> None:
    assert time_of_impact((0.0, 0.0), (1.0, 0.0), (0.0, 0.0), R, 1.0) == 0.0


@pytest.mark.parametrize("miss", [1e-18, 1e-16, 1e-15, 1e-14])
def test_a_path_that_passes_within_a_hair_ends(miss: float) -> None:
    """Discs that part never meet; in motion they meet where they pass, or not at all."""
    slow = (1e-9, 0.0)
    assert time_of_impact((0.0, 1.0 + miss), slow, (0.0, 0.0), 1.0, 1e10, 1e-20) == math.inf
    t = time_of_impact((-1.0, 1.0 + miss), slow, (0.0, 0.0), 1.0, 1e10, 1e-20)
    # Rounding of 8 EPSILON in the gap changes the time by this much.
    passes = pytest.approx(1e9, abs=math.sqrt(16.0 * EPSILON) * 1e9)
    assert t == math.inf or (t == passes and miss < 8.0 * EPSILON)


def closing_acceleration(offset: Vector, velocity: Vector, acceleration: Vector) -> float:
    """Return the acceleration (m/s^2) at which two discs close: -d'' of their distance d."""
    (dx, dy), (vx, vy), (ax, ay) = offset, velocity, acceleration
    distance = math.hypot(dx, dy)
    slip = (dx * vy - dy * vx) / distance
    return -(dx * ax + dy * ay + slip * slip) / distance


# -- paths: balls that stop before they meet -------------------------------------------------------


def slid(x: float, speed: float, deceleration: float = 0.5) -> Path:
    return sliding(0.0, (x, 0.0), (speed, 0.0), deceleration)


@pytest.mark.parametrize("short", [-1e-9, -1e-15, 0.0, 1e-15, 1e-9])
def test_a_ball_that_stops_at_contact_stops(short: float) -> None:
    """2 m/s and 0.5 m/s^2 last for 4 m: a ball at 4 m + 2 R is touched, but not hit."""
    t = pair_time(slid(0.0, 2.0), slid(4.0 + 2 * R + short, 0.0), 2 * R, 0.0, math.inf)
    if short == -1e-9:  # It comes in at the speed sqrt(2 a s), which is 3e-5 m/s.
        assert t == pytest.approx(4.0 - math.sqrt(2 * 1e-9 / 0.5), abs=1e-9)
    elif short > 1e-12:
        assert t == math.inf
    else:
        assert t == math.inf or t == pytest.approx(4.0, abs=1e-7)


@pytest.mark.parametrize("late", [k * 2.0**-53 for k in range(-8, 9)])
def test_a_contact_at_the_very_moment_the_other_stops_is_not_lost(late: float) -> None:
    """B stops at 1 m after 2 s; A comes from behind and would touch it just then."""
    for speed in (1.7, 2.0, 3.0):
        stop = 2.0 * (1.0 + late)
        a = slid(1.0 - 2 * R - (speed * stop - 0.25 * stop * stop), speed)
        b = slid(0.0, 1.0)
        assert pair_time(a, b, 2 * R, 0.0, math.inf) == pytest.approx(2.0, abs=1e-14)


def test_a_fast_ball_passes_where_a_slow_one_is_to_rest() -> None:
    """A has crossed B's place of rest before B arrives there, from the side."""
    a = sliding(0.0, (-0.5, 1.0), (9.0, 0.0), 0.5)
    b = sliding(0.0, (0.0, 0.0), (0.0, 1.0), 0.5)
    assert b.place(b.end) == (0.0, 1.0)
    assert pair_time(a, b, 2 * R, 0.0, math.inf) == math.inf


def test_both_stop_before_they_meet() -> None:
    assert pair_time(slid(0.0, 1.0), slid(3.0, -1.0), 2 * R, 0.0, math.inf) == math.inf
    assert pair_time(slid(0.0, 1.0), slid(2.0, -1.0), 2 * R, 0.0, math.inf) < 2.0


# -- walls -----------------------------------------------------------------------------------------

FLOOR = Face((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), 1.0)
CORNER = RoundSide((1.0, 0.0))


def flying(x: float, y: float, vx: float, vy: float) -> Path:
    return sliding(0.0, (x, y), (vx, vy), 0.0)


def test_a_ball_that_touches_a_cushion_and_slides_along_it_does_not_hit_it() -> None:
    assert FLOOR.time_of_contact(flying(0.5, R, 1.0, 0.0), R, 0.0) == math.inf
    assert FLOOR.time_of_contact(flying(0.5, R, 1.0, -1e-14), R, 0.0) == math.inf
    assert FLOOR.time_of_contact(flying(0.5, R, 1.0, -1e-9), R, 0.0) == 0.0
    assert FLOOR.time_of_contact(flying(0.5, R, 1.0, 1.0), R, 0.0) == math.inf


@pytest.mark.parametrize("above", [-1e-12, -1e-17, 0.0, 7e-18, 1e-17, 1e-12])
def test_a_ball_that_slides_along_a_cushion_goes_past_its_end(above: float) -> None:
    """The path is tangent to rounding: a hit at the corner would turn the ball by 1e-8.

    A corner is grazed, or missed, to a millionth of a micrometre.
    """
    met = CORNER.time_of_contact(flying(0.3, R + above, 1.0, 0.0), R, 0.0) < math.inf
    assert met == (above == -1e-12)


@given(st.floats(-1.5, 1.5), st.floats(0.5, 1.5))
def test_between_a_cushion_and_its_corner_there_is_no_hole(angle: float, distance: float) -> None:
    """A ball may aim at face or corner, anywhere about the seam: one of them answers."""
    for across in (-1e-9, -1e-15, -1e-16, 0.0, 1e-16, 1e-15, 1e-9):
        ux, uy = math.sin(angle), -math.cos(angle)
        x, y = 1.0 + across - distance * ux, R - distance * uy
        path = flying(x, y, ux, uy)
        length = min(FLOOR.time_of_contact(path, R, 0.0), CORNER.time_of_contact(path, R, 0.0))
        assert length == pytest.approx(distance, abs=1e-8)


def test_a_ball_beside_or_behind_a_cushion_does_not_hit_it() -> None:
    assert FLOOR.time_of_contact(flying(1.2, 0.5, 0.0, -1.0), R, 0.0) == math.inf
    assert FLOOR.time_of_contact(flying(0.5, -0.5, 0.0, -1.0), R, 0.0) == math.inf
