"""Where a run has a kink, its derivatives are NaN with a reason; just beside it they are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pool_pymunk import (
    Physics,
    Scene,
    SceneError,
    simulate,
)
from pool_pymunk.core.motion.path import Path, standing
from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.core.tangent.touches import EDGE, Corner, touch_of_discs, touch_of_face
from pool_pymunk.core.walls.face import Face
from pool_pymunk.model.inputs import input_value, with_inputs
from pool_pymunk.studies.derivatives import Derivatives
from tests.shared.kinks import BESIDE, KINKS, MU, A, E, R, ball, scene, slipping

ROUNDED = {"graze", "comes to rest", "touches what it does not hit", "the run ends just"}


def found(of: Scene, *wrt: str) -> Derivatives:
    return simulate(of, solver="event-driven").derivatives(wrt or ("position", "velocity"))


@pytest.mark.parametrize("kind", KINKS, ids=lambda kind: kind.__name__)
def test_there_is_none_at_a_kink_and_one_beside_it(kind: Callable[[float], Scene]) -> None:
    at = found(kind(0.0))
    assert np.isnan(at.final).any(), at.warnings
    reasons = {KINKS[kind], *(ROUNDED if "touch" in KINKS[kind] or "ends" in KINKS[kind] else ())}
    assert any(reason in text for text in at.warnings for reason in reasons), at.warnings
    for off in (-BESIDE, BESIDE):
        beside = found(kind(off))
        assert np.isfinite(beside.final).all(), (off, beside.warnings)


def moved(of: Scene, name: str, step: float) -> Scene | None:
    """Return the scene with one input moved, or None where that makes none."""
    try:
        return with_inputs(of, {name: input_value(of, name) + step})
    except SceneError:
        return None


@pytest.mark.parametrize("kind", KINKS, ids=lambda kind: kind.__name__)
def test_what_is_known_at_a_kink_is_so_on_both_sides(kind: Callable[[float], Scene]) -> None:
    """One-sided differences to either side agree with every derivative that is given."""
    of, step = kind(0.0), 1e-7
    run = simulate(of, solver="event-driven")
    at = run.derivatives("all")
    ends = np.array([run.end.position, run.end.velocity])
    for column, name in enumerate(at.names):
        given = np.array([at.final[..., column], at.velocity[..., column]])
        for shift in (-step, step):
            other = moved(of, name, shift)
            if other is None:
                continue
            end = simulate(other, solver="event-driven").end
            slope = (np.array([end.position, end.velocity]) - ends) / shift
            wrong = np.abs(slope - given) > 1e-3 + 1e-3 * np.abs(given)
            assert not wrong.any(), (name, shift, slope, given)


def test_a_ball_that_rests_just_at_the_end_has_a_place_and_no_velocity() -> None:
    """Its place is smooth; its velocity is v - a t on one side, and 0 on the other."""
    of = scene(ball("a", 0, 0, 1.0), ball("b", 0, 1, 2.0), max_time=1.0 / A)
    at = found(of, "vx.a", "friction.surface")
    assert np.allclose(at.final[0], [[1.0 / A, -5.0 / A], [0.0, 0.0]])
    assert np.isnan(at.velocity[0]).all() and np.isfinite(at.velocity[1]).all()
    assert "comes to rest just as the run ends" in at.warnings[0]


def test_a_place_just_at_the_time_of_a_hit_has_none() -> None:
    of = scene(ball("a", 0, 0, 2.0), ball("b", 0.5, 0.01), table=None)
    run = simulate(of, solver="event-driven")
    hit, stop = (run.events[k].t for k in (0, 1))
    at = run.derivatives("vx.a").at([0.0, hit, 0.999 * hit, 1.001 * hit, stop], "a")
    assert np.isnan(at).any(axis=(1, 2)).tolist() == [False, True, False, False, False]


def test_contacts_that_only_rounding_sets_apart_are_of_one_instant() -> None:
    """The gap to the second ball closes after the first hit, by less than rounding tells."""
    for off, known in ((1e-14, False), (1e-6, True)):
        balls = (ball("a", 0, 0, 2.0), ball("b", 0.5, 0.05), ball("c", 0.5 + off, -0.05))
        at = found(scene(*balls))
        assert np.isfinite(at.final[1]).all() == known, at.warnings


def test_the_border_of_the_listing_is_a_kink() -> None:
    """Listing 3 clamps a ball's own tangential velocity at zero: a_t = mu (a_n - a_n')."""
    for off in (0.0, 1e-6, -1e-6):
        u = 1.0, MU * (1.0 + E) / 2.0 * (1.0 + off)
        balls = ball("a", -0.3 * u[0], -0.3 * u[1], 2 * u[0], 2 * u[1]), ball("b", 2 * R, 0)
        of = replace(scene(*balls), physics=Physics(law="published"))
        at = simulate(of, solver="event-driven").derivatives()
        assert np.isnan(at.final).any() == (off == 0.0), at.warnings


def before_the_hit(
    place: tuple[float, float], velocity: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Return where a ball was 0.1 s before it has this velocity at a place, and how fast."""
    (x, y), (u, v), time = place, velocity, 0.1
    speed = math.hypot(u, v)
    along, more = time + A * time * time / 2.0 / speed, 1.0 + A * time / speed
    return x - along * u, y - along * v, more * u, more * v


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_clamp_of_the_listing_is_a_jump_on_either_side_of_the_slip(side: float) -> None:
    """Its clamp looks at the tangential velocity of the second ball, which is 0 here."""
    balls = (
        ball("a", *before_the_hit((0.0, 0.0), (2.0, 0.5 * side))),
        ball("b", *before_the_hit((2.0 * R, 0.0), (0.5, 0.0))),
    )
    of = scene(*balls)
    assert np.isfinite(found(of).final).all()
    at = found(replace(of, physics=Physics(law="published")))
    assert np.isnan(at.final).any()
    assert any("law published jumps or has a kink" in text for text in at.warnings)


def test_what_a_kink_does_not_depend_on_is_known() -> None:
    """The border of sticking does not move with the ball's speed, or its start along the path."""
    at = found(slipping(0.0), "friction.surface", "friction.ball_ball")
    assert np.isfinite(at.final[..., 0]).all() and np.isnan(at.final[..., 1]).any()


@pytest.mark.parametrize(("off", "touches"), [(0.0, True), (100 * EPSILON, True), (1e-9, False)])
def test_a_ball_touches_what_only_rounding_sets_it_off(off: float, touches: bool) -> None:
    """A ball goes along a face, ends its path at a ball at rest, and lies beside a corner."""
    path = Path(0.0, 0.0, R + off, 1.0, 0.0, 0.0, 0.0, 1.0, False, 0.0, 0.0)
    face = Face((-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), 3.0)
    assert touch_of_face(path, face, 1.0, R, (True, True)) == (touches, 1.0 if touches else -1.0)
    other = standing(0.0, 1.0 + 2.0 * R + off, R + off)
    found = touch_of_discs(path, other, 1.0, (2.0 * R, 1.0), (True, True))
    assert found == (False, 1.0 if touches else -1.0)
    assert Corner(0.0, 0.0, (1.0, 0.0)).is_met(off, R - off, R) == (off < EDGE * R)
