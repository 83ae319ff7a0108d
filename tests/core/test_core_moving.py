"""Walls that move and kick in the core have closed forms."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import mpmath
import pytest

from pool_pymunk import Ball
from pool_pymunk.core.walls.round import RoundSide
from tests.shared.core_movers import (
    PISTON,
    Mover,
    New,
    Note,
    Play,
    Pose,
    bar,
    going,
    on_a_plane,
    piston,
    upright,
)
from tests.shared.core_scenes import M, R

# -- closed forms ----------------------------------------------------------------------------------


def played(play: Play) -> list[Note]:
    """Return what the core tells of a play."""
    its = New(play)
    for k, poses in enumerate(play.steps):
        its.step(k * play.dt, (k + 1) * play.dt, poses)
    notes: list[Note] = its.heard.notes
    return notes


def hits(notes: list[Note], wall: int = 0) -> list[tuple[float, float, float, float]]:
    """Return the times (s) of hits on a wall, the velocities (m/s) after them, and impulses."""
    return [
        (note[1], path[6], path[7], note[13])
        for note, path in pairwise(notes)
        if note[0] == "contact" and note[4] == wall
    ]


@pytest.mark.parametrize("dt", [1 / 30, 1 / 240])
def test_a_piston_keeps_length_times_relative_speed(dt: float) -> None:
    """Between a piston at u and a wall, L (v - u) is the same after each hit on the piston."""
    kept = [
        (1.0 - PISTON * t - 2.0 * R) * (vx - PISTON)
        for t, vx, *_ in hits(played(piston(1.0, dt, 4.0)))
    ]
    assert len(kept) == 13
    assert max(kept) - min(kept) < 1e-12


@pytest.mark.parametrize(("e", "mu"), [(1.0, 0.0), (0.5, 0.0), (0.7, 0.2)])
def test_a_hit_is_that_of_the_law_in_the_walls_frame(e: float, mu: float) -> None:
    """v_n' - u_n = -e (v_n - u_n), and friction slows the slip relative to the wall (Eq. 9)."""
    ball = Ball("a", (0.5, 0.0), R, M, velocity=(-1.0, 0.5))
    play = on_a_plane(ball, [(upright(e, mu), going((0.4, -0.3)))], 1 / 60, 0.5)
    [(_, vx, vy, impulse)] = hits(played(play))
    assert vx == pytest.approx(0.4 + e * 1.4, abs=1e-12)
    assert vy == pytest.approx(0.5 - mu * (1.0 + e) * 1.4, abs=1e-12)
    assert impulse == pytest.approx(M * (1.0 + e) * 1.4, abs=1e-12)


@pytest.mark.parametrize(("turns", "speed"), [(1.0, 1.0), (8.0, 0.5), (-30.0, 2.0)])
@pytest.mark.parametrize("dt", [1 / 30, 1 / 120])
def test_a_bat_that_turns_hits_at_the_root_of_its_equation(
    turns: float, speed: float, dt: float
) -> None:
    """The gap to the bat's line is c(t) . n(t) - r; its first root is found in 40 digits."""
    up = math.copysign(1.0, turns)
    ball = Ball("a", (0.2, 0.4 * up), R, M, velocity=(0.0, -speed * up))
    play = on_a_plane(ball, [(bar((-0.5, 0.0), (0.5, 0.0)), going(turns=turns))], dt, 0.4)
    with mpmath.workdps(40):
        w = mpmath.mpf(turns)

        def gap(t: Any) -> Any:
            y = up * mpmath.mpf(0.4) - up * mpmath.mpf(speed) * t
            away = y * mpmath.cos(w * t) - mpmath.mpf(0.2) * mpmath.sin(w * t)
            return up * away - mpmath.mpf(R)

        low = high = mpmath.mpf(0)
        while gap(high) > 0:
            low, high = high, high + mpmath.mpf(1) / 10000
        for _ in range(120):
            middle = (low + high) / 2
            low, high = (middle, high) if gap(middle) > 0 else (low, middle)
        assert abs(hits(played(play))[0][0] - high) < 1e-14


def test_a_ball_at_rest_is_struck_at_its_time() -> None:
    disc = Mover([RoundSide((0.0, 0.0), 0.05)], 1.0, 0.0, 0.0)
    play = on_a_plane(Ball("a", (0.9, 0.5), R, M), [(disc, going((0.6, 0.0), place=(0.5, 0.5)))],
                      1 / 30, 1.0)  # fmt: skip
    [(t, vx, _, impulse)] = hits(played(play))
    assert t == pytest.approx((0.4 - 0.05 - R) / 0.6, abs=1e-14)
    assert vx == pytest.approx(1.2, abs=1e-12)
    assert impulse == pytest.approx(M * 1.2, abs=1e-12)


@pytest.mark.parametrize("kick", [0.5, 2.0])
def test_a_wall_kicks_once_in_an_instant(kick: float) -> None:
    """A wall adds its kick to the law's answer, along the normal; its impulse has both."""
    ball = Ball("a", (0.5, 0.0), R, M, velocity=(-1.0, 0.0))
    play = on_a_plane(ball, [(upright(0.5)._replace(kick=kick), going())], 1 / 60, 1.0)
    [(_, vx, _, impulse)] = hits(played(play))
    assert vx == pytest.approx(0.5 + kick, abs=1e-12)
    assert impulse == pytest.approx(M * (1.5 + kick), abs=1e-12)


def test_a_wall_goes_through_a_ball_that_has_nowhere_to_go_and_meets_it_again() -> None:
    """A wall comes up at 1 m/s, jams the ball, goes on for 0.1 m, and comes back at 2 m/s."""

    def pose(t: float) -> Pose:
        if t < 0.6 - 1e-9:
            return Pose((0.5 + t, 0.0), 0.0, (1.0, 0.0), 0.0)
        return Pose((1.1 - 2.0 * (t - 0.6), 0.0), 0.0, (-2.0, 0.0), 0.0)

    ball, still = Ball("a", (1.0 - R, 0.0), R, M), (upright(), going(place=(1.0, 0.0)))
    notes = played(on_a_plane(ball, [(upright(), pose), still], 1 / 60, 0.8))
    [jam] = [k for k, note in enumerate(notes) if note[0] == "jam"]
    assert notes[jam][1] == pytest.approx(0.5 - 2.0 * R, abs=1e-9)
    [(t, vx, *_)] = hits(notes[jam:])
    assert t == pytest.approx(0.65, abs=1e-9)
    assert vx == pytest.approx(-4.0, abs=1e-9)
