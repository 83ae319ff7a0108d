"""Eq. 8 of the report bounds the angular error of a grazing hit; here the worst one is measured.

The report divides the path of one slice, v dt = 4 m/s x 1e-5 s, by 2.25 in (its radius). This is
7.0e-4 rad, or 0.0401 degrees, or 1.40 mm over 2 m. A contact may be found late by up to v dt. The
normal is then off by up to v dt over the distance of the centres, 2 r, which is half of that. The
bound holds with a factor of 2.
"""

from __future__ import annotations

import math

import pytest

from pool_pymunk import Ball, Physics, Restitution, Scene, simulate

SPEED, DT, R, WAY = 4.0, 1e-5, 2.25 * 0.0254, 2.0
BOUND = SPEED * DT / R


def angle_after(offset: float, lead: float, solver: str) -> float | None:
    """Return the direction (rad) in which a resting ball leaves a frictionless hit.

    It is None if the ball is missed.
    """
    scene = Scene(
        balls=(
            Ball("a", (0.0, 0.0), R, 0.16, velocity=(SPEED, 0.0)),
            Ball("b", (lead + math.sqrt(max(4 * R * R - offset * offset, 0.0)), offset), R, 0.16),
        ),
        restitution=Restitution(1.0),
        physics=Physics(max_time=2 * lead / SPEED + 1e-3),
    )
    vx, vy = simulate(scene, solver=solver, dt=DT).end.velocity[1]
    return math.atan2(vy, vx) if (vx, vy) != (0.0, 0.0) else None


def test_eq_8_is_the_way_of_a_slice_over_the_radius() -> None:
    assert math.degrees(BOUND) == pytest.approx(0.0401, abs=5e-5)
    off = BOUND * WAY
    assert off == pytest.approx(1.40e-3, abs=5e-6)


def test_the_worst_grazing_hit_is_off_by_half_the_bound() -> None:
    offsets = [2 * R * math.sin(math.pi / 2 * k / 12) for k in range(1, 12)]
    offsets += [2 * R * (1 - 10.0**-k) for k in (2, 3, 4, 5, 6)]
    errors = []
    for offset in offsets:
        for phase in range(8):
            lead = 1e-3 + SPEED * DT * phase / 8
            exact, found = (angle_after(offset, lead, s) for s in ("event-driven", "time-slice"))
            assert exact is not None
            assert found is not None
            errors.append(abs(found - exact))
    assert math.degrees(max(errors)) == pytest.approx(0.0201, abs=5e-5)
    assert max(errors) * WAY == pytest.approx(0.70e-3, abs=5e-6)


def test_a_hit_with_a_shorter_chord_than_a_slice_may_be_missed() -> None:
    """A hit that is missed would also have turned the ball by less than the bound."""
    chord = 0.3 * SPEED * DT
    offset = math.sqrt(4 * R * R - (chord / 2) ** 2)
    assert angle_after(offset, 1e-3 + 0.5 * SPEED * DT, "event-driven") is not None
    missed = [
        angle_after(offset, 1e-3 + SPEED * DT * k / 8, "time-slice") is None for k in range(8)
    ]
    assert any(missed)
    turned = chord / 2 / (2 * R)  # This is the closing speed over the speed.
    assert turned < BOUND
