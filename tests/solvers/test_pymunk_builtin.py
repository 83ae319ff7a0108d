"""The baseline in stock pymunk agrees with our law, or differs from it by amounts that are derived.

Its balls spin. A solid disc of mass m has the moment m r^2 / 2, so that an impulse J along the
tangent changes how fast its rim slips by J / m through its velocity, and by 2 J / m through its
spin. To end a slip s therefore takes a third of what it takes without spin: m s / 3 at a cushion,
m s / 6 between two equal balls, where `coulomb` takes all of m s and m s / 2.
"""

from __future__ import annotations

import math

import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    Table,
    simulate,
)
from pool_pymunk.solvers.pymunk_builtin import Builtin
from tests.shared.scenes import contact_list

R = 0.05
FINE = 1e-6  # s
LATE = 2.0 * FINE / R  # rad; how far the normal turns at 2 m/s until a contact is found
ROUGH = 10.0  # This coefficient of friction ends every slip here.


def builtin(scene: Scene, **settings: float) -> Run:
    return simulate(scene, solver="pymunk-builtin", **settings)  # type: ignore[arg-type]


def on_plane(
    *balls: Ball, e: float = 0.9, cue: float | None = None, mu: float = 0.0, time: float = 1.0
) -> Scene:
    """Put balls on an open plane, where they meet only each other."""
    return Scene(
        balls, None, Restitution(e, cue), Friction(ball_ball=mu), Physics(max_time=time)
    )  # fmt: skip


def on_table(
    *balls: Ball, e: float, mu: float = 0.0, width: float = 1.0, time: float = 0.6
) -> Scene:
    """Put balls on a table 1 m long."""
    return Scene(
        balls,
        Table.rectangle(1.0, width),
        Restitution(0.9, 0.5, e),
        Friction(cushion=mu, ball_ball=0.04),
        Physics(max_time=time),
    )


# -- restitution -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mass", "e", "cue"),
    [*((0.2, e, None) for e in (0.0, 0.3, 0.9, 1.0)), (0.1, 0.9, None), (0.1, 0.9, 0.5)],
)
def test_two_balls_part_with_their_restitution(mass: float, e: float, cue: float | None) -> None:
    """Momentum is kept, and e of the closing speed comes back; the cue ball may have its own."""
    scene = on_plane(Ball("a", (0.0, 0.0), R, 0.2, cue is not None, (1.0, 0.0)),
                     Ball("b", (0.3, 0.0), R, mass), e=e, cue=cue)  # fmt: skip
    share, e = 0.2 / (0.2 + mass), e if cue is None else cue
    one, other = builtin(scene).end.velocity
    assert one == pytest.approx((share - e * (1.0 - share), 0.0), abs=1e-15)
    assert other == pytest.approx((share * (1.0 + e), 0.0), abs=1e-15)


@pytest.mark.parametrize("cue", [True, False])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_cushion_has_its_restitution_for_the_cue_ball_and_for_others(e: float, cue: bool) -> None:
    scene = on_table(Ball("a", (0.5, 0.5), R, 0.2, cue, (1.0, 0.25)), e=e)
    assert builtin(scene).end.velocity[0] == pytest.approx((-e, 0.25), abs=1e-15)


def test_a_product_with_zero_is_zero() -> None:
    """Coefficients of two shapes multiply, so balls that do not bounce make dead cushions.

    Likewise smooth balls make smooth cushions.
    """
    ball = Ball("a", (0.5, 0.5), R, 0.2, velocity=(1.0, 0.25))
    other = Ball("b", (0.5, 0.2), R, 0.2)
    scene = Scene((ball, other), Table.rectangle(1.0, 1.0), Restitution(0.0, None, 0.8),
                  Friction(cushion=0.1), Physics(max_time=0.6))  # fmt: skip
    assert builtin(scene).end.velocity[0] == pytest.approx((0.0, 0.25), abs=1e-15)
    ours = simulate(scene, solver="event-driven").end.velocity[0]
    assert ours == pytest.approx((-0.8, 0.25 - 0.1 * 1.8), abs=1e-15)


# -- what differs from our law: spin ---------------------------------------------------------------


def sliding_hit(mu: float) -> Scene:
    """Let a ball hit another at 1 m/s along the normal and slip along it at 0.6 m/s."""
    return on_plane(Ball("a", (0.0, 0.0), R, 0.2, velocity=(1.0, 0.6)),
                    Ball("b", (2.0 * R, 0.0), R, 0.2), e=1.0, mu=mu, time=0.01)  # fmt: skip


def test_as_long_as_balls_slip_friction_is_that_of_our_law() -> None:
    """Friction takes 0.05 m/s from A; only 0.1 m/s would end the slip of balls that spin."""
    scene = sliding_hit(0.05)
    run, ours = builtin(scene, dt=FINE), simulate(scene, solver="event-driven")
    for found, wanted in zip(run.end.velocity, ours.end.velocity, strict=True):
        assert found == pytest.approx(wanted, abs=LATE)
    assert ours.end.velocity[0] == pytest.approx((0.0, 0.55), abs=1e-15)


def test_spin_takes_two_thirds_of_the_slip_between_balls() -> None:
    """A gives a sixth of its slip of 0.6 m/s to B, and in our law it gives half."""
    scene = sliding_hit(ROUGH)
    run, ours = builtin(scene, dt=FINE), simulate(scene, solver="event-driven")
    assert run.end.velocity[0] == pytest.approx((0.0, 0.5), abs=LATE)
    assert run.end.velocity[1] == pytest.approx((1.0, 0.1), abs=LATE)
    assert ours.end.velocity[1] == pytest.approx((1.0, 0.3), abs=1e-15)


def test_a_rough_hit_at_an_offset_ends_elsewhere_by_a_third_of_its_slip() -> None:
    """At an offset of a radius the centres stand at 30 degrees, and the slip is half of 1 m/s.

    B gets a sixth of it across the line of centres, 1/12 m/s, and in our law half of it, 1/4 m/s.
    """
    normal = (math.sqrt(0.75), 0.5)
    there = (0.1 + 2.0 * R * normal[0], 2.0 * R * normal[1])
    scene = on_plane(Ball("a", (0.0, 0.0), R, 0.2, velocity=(1.0, 0.0)),
                     Ball("b", there, R, 0.2), mu=ROUGH, time=0.2)  # fmt: skip

    def across(run: Run) -> float:
        vx, vy = run.end.velocity[1]
        return abs(vy * normal[0] - vx * normal[1])

    run, ours = builtin(scene, dt=FINE), simulate(scene, solver="event-driven")
    assert across(run) == pytest.approx(1.0 / 12.0, abs=LATE)
    assert across(ours) - across(run) == pytest.approx(1.0 / 6.0, abs=LATE)


@pytest.mark.parametrize(("mu", "its", "ours"), [(0.05, 0.51, 0.51), (ROUGH, 0.4, 0.0)])
def test_friction_of_a_cushion_leaves_no_less_than_two_thirds(
    mu: float, its: float, ours: float
) -> None:
    """It takes 0.05 of the change of 1.8 m/s from 0.6 m/s; a third of these would end it.

    A rough cushion leaves two thirds, and nothing in our law, which has no spin.
    """
    scene = on_table(Ball("a", (0.5, R), R, 0.2, velocity=(0.6, -1.0)), e=0.8, mu=mu, time=0.1)
    assert builtin(scene, dt=FINE).end.velocity[0] == pytest.approx((its, 0.8), abs=1e-12)
    exact = simulate(scene, solver="event-driven").end.velocity[0]
    assert exact == pytest.approx((ours, 0.8), abs=1e-15)


def test_spin_takes_up_what_the_speed_along_a_cushion_loses() -> None:
    """About the point of contact, m v r - m r^2 w / 2 is kept, and the next cushion meets the spin.

    There the spin adds to the speed, so that of 0.4 m/s a third remains.
    """
    scene = on_table(
        Ball("a", (0.5, R), R, 0.2, velocity=(0.6, -1.0)), e=1.0, mu=ROUGH, width=0.4, time=1.0
    )
    world = Builtin(scene, scene.start(None), 1e-5)
    body = world.bodies[0]
    found: list[tuple[float, float]] = []
    while len(found) < 2:
        world.advance(1)
        if len(world.trace.events) > len(found):
            found.append((body.velocity.x, R * body.angular_velocity))
    (after, rim), (last, _) = found
    assert (after, rim) == pytest.approx((0.4, -2.0 * (0.6 - 0.4)), abs=1e-12)
    assert last == pytest.approx(0.4 / 3.0, abs=1e-12)


# -- events ----------------------------------------------------------------------------------------


def test_events_are_those_of_the_exact_solver_up_to_a_step_late_each() -> None:
    """Where all is smooth, elastic and head-on, the physics is the same."""
    scene = Scene(
        (Ball("a", (0.5, 0.5), R, 0.2, velocity=(1.0, 0.0)), Ball("b", (0.2, 0.5), R, 0.2)),
        Table.rectangle(1.0, 1.0),
        Restitution(1.0, None, 1.0),
        physics=Physics(max_time=2.0),
    )
    dt = 1e-4
    run, exact = builtin(scene, dt=dt), simulate(scene, solver="event-driven")
    assert contact_list(run)[:2] == [("ball-cushion", ("a",), 1), ("ball-ball", ("a", "b"), None)]
    for kind in ("ball-cushion", "ball-ball"):
        times = [[e.t for e in one.events if e.kind == kind] for one in (run, exact)]
        late = [found - due for found, due in zip(*times, strict=True)]
        assert all(0.0 <= t <= 2.0 * dt * len(run.events) for t in late)


def test_balls_that_stay_together_have_met_once() -> None:
    scene = on_plane(Ball("a", (0.0, 0.0), R, 0.2, velocity=(1.0, 0.0)),
                     Ball("b", (0.3, 0.0), R, 0.2), e=0.0)  # fmt: skip
    assert contact_list(builtin(scene)) == [("ball-ball", ("a", "b"), None)]
