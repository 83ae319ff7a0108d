"""Derivatives of ends and contact times agree with differences of the forty-digit reference."""

from __future__ import annotations

import math
import random
import timeit
from collections.abc import Callable, Mapping
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from pool_pymunk import (
    NT,
    Ball,
    Friction,
    Law,
    Pair,
    Physics,
    Pocket,
    Post,
    Restitution,
    Run,
    Scene,
    Shot,
    Table,
    load,
    simulate,
)
from pool_pymunk.model.inputs import input_value, with_inputs
from pool_pymunk.results.trace import places_at
from pool_pymunk.results.variants import Variant
from pool_pymunk.studies.changes import rounding
from tests.oracle.reference import (
    DIGITS,
    OUTLINES,
    ReferenceRun,
    Refused,
    random_pocket_scene,
    random_rolling_scene,
    random_scene,
    reference_run,
)
from tests.shared.scenes import seeds, share_of

STEP = 2.0**-40  # The central differences of forty digits err by its square.
Steps = Mapping[str, float]


# -- the reference -----------------------------------------------------------------------------


def varied(scene: Scene, direction: Steps, step: float) -> Scene:
    """Return the scene with every input moved by ``step`` along a direction."""
    moved = {name: step * slope for name, slope in direction.items()}

    def ball(b: Ball) -> Ball:
        def at(name: str, value: float) -> float:
            return value + moved.get(f"{name}.{b.id}", 0.0)

        return replace(
            b,
            position=(at("x", b.position[0]), at("y", b.position[1])),
            velocity=(at("vx", b.velocity[0]), at("vy", b.velocity[1])),
            mass=at("mass", b.mass),
            radius=at("radius", b.radius),
        )

    def coefficients(part: Any, group: str) -> Any:
        changes = {
            key: value + moved.get(f"{group}.{key}", 0.0)
            for key in part.__slots__
            if (value := getattr(part, key)) is not None
        }
        return replace(part, **changes)

    return replace(
        scene,
        balls=tuple(map(ball, scene.balls)),
        restitution=coefficients(scene.restitution, "restitution"),
        friction=coefficients(scene.friction, "friction"),
    )


def inputs_of(scene: Scene) -> dict[str, float]:
    """Return the value of every input of a scene, by its name."""
    found: dict[str, float] = {}
    for b in scene.balls:
        found |= {f"x.{b.id}": b.position[0], f"y.{b.id}": b.position[1]}
        found |= {f"vx.{b.id}": b.velocity[0], f"vy.{b.id}": b.velocity[1]}
        found |= {f"mass.{b.id}": b.mass, f"radius.{b.id}": b.radius}
    for group in ("restitution", "friction"):
        part = getattr(scene, group)
        known = {f"{group}.{key}": getattr(part, key) for key in part.__slots__}
        found |= {name: value for name, value in known.items() if value is not None}
    return found


def random_direction(scene: Scene, rng: random.Random) -> dict[str, float]:
    """Return a random direction of all inputs; those at a bound stay, and resting balls rest."""
    resting = {b.id for b in scene.balls if b.velocity == (0.0, 0.0)}
    found = {}
    for name, value in inputs_of(scene).items():
        group, _, key = name.partition(".")
        at_bound = (group == "restitution" and value == 1.0) or (
            group == "friction" and value == 0.0
        )
        rests = group in ("vx", "vy") and key in resting
        size = abs(value) if group in ("mass", "radius") else 1.0
        if not (at_bound or rests):
            found[name] = size * rng.uniform(-1.0, 1.0)
    return found


def along(run: Run, change: Steps) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Return what a change of inputs does to ends (N, 2) and event times (E,), to first order."""
    found = run.derivatives(tuple(change))
    step = np.array(list(change.values()))
    return found.final @ step, found.times @ step, found.warnings


def differences(low: ReferenceRun, high: ReferenceRun) -> tuple[np.ndarray, np.ndarray]:
    """Return how far apart the ends and the event times of two reference runs are."""
    with mp.workdps(DIGITS):
        ends = [
            [float(b - a) for a, b in zip(p, q, strict=True)]
            for p, q in zip(low.final, high.final, strict=True)
        ]
        times = [
            float(b[0] - a[0])
            for a, b in zip(
                sorted(low.events, key=lambda event: event[0]),
                sorted(high.events, key=lambda event: event[0]),
                strict=True,
            )
        ]
    return np.array(ends), np.array(times)


def assert_agrees(scene: Scene, rng: random.Random) -> bool:
    """Compare one random direction.

    Return False for a scene that the reference refuses, or whose contacts come in another order
    within a step.
    """
    direction = random_direction(scene, rng)
    low, high = (varied(scene, direction, sign * STEP) for sign in (-1.0, 1.0))
    try:
        runs = [reference_run(each) for each in (low, high)]
    except Refused:
        return False
    if [e[1:] for e in runs[0].events] != [e[1:] for e in runs[1].events]:
        return False
    before, after = inputs_of(low), inputs_of(high)
    with mp.workdps(DIGITS):  # Rounding leaves the steps that were really made.
        change = {name: float(mpf(after[name]) - mpf(before[name])) for name in direction}
    run = simulate(scene, solver="event-driven")
    ends, times, warnings = along(run, change)
    assert warnings == ()
    true_ends, true_times = differences(*runs)
    scale = np.abs(true_ends).max()
    longest = np.abs(true_times).max(initial=1e-30)
    # Where a start is amplified a million times, rounding of the run itself moves the derivatives.
    close = max(1e-9, 1e-13 * scale / STEP)
    assert np.abs(ends - true_ends).max() <= close * scale
    assert np.abs(times - true_times).max(initial=0.0) <= close * longest
    return True


def exactly_rolling_scene(law: str, table: str, rng: random.Random) -> Scene:
    """Return balls whose rolls are their velocities times powers of two, which has no rounding."""
    scene = random_rolling_scene(law, table, rng)
    shares = [rng.choice([0.0, 1.0, -0.5, 2.0, -2.0]) for _ in scene.balls]
    balls = [replace(b, roll=share) for b, share in zip(scene.balls, shares, strict=True)]
    return replace(scene, balls=tuple(balls))


def compared(law: str, table: str, count: int, draw: Callable[..., Scene] = random_scene) -> None:
    """Compare this many random scenes that the reference plays."""
    rng = random.Random(f"derivatives {law} {table} {seeds(1)[0]}")
    done = 0
    while done < count:
        done += assert_agrees(draw(law, table, rng), rng)


@pytest.mark.parametrize("table", OUTLINES)
def test_derivatives_agree_with_forty_digits(table: str) -> None:
    compared("coulomb" if table == "rectangle" else "published", table, 1)


@pytest.mark.slow
@pytest.mark.seeded
@pytest.mark.parametrize("table", OUTLINES)
@pytest.mark.parametrize("law", ["coulomb", "published"])
def test_derivatives_of_many_scenes_agree_with_forty_digits(law: str, table: str) -> None:
    """Two hundred scenes: both laws, three tables and the open plane, 25 each."""
    compared(law, table, share_of(25, 5))
    compared(law, table, 3, exactly_rolling_scene)


def test_derivatives_with_pockets_agree_with_forty_digits() -> None:
    compared("coulomb", "rectangle", 1, random_pocket_scene)


# -- closed forms ------------------------------------------------------------------------------


def sliding(**more: Any) -> Scene:
    """Return one ball that slides to rest: its end is x + v |v| / (2 a)."""
    ball = Ball("C", (0.2, 0.1), 0.05, 0.2, cue=True)
    shot = Shot("s", "C", speed=2.0, angle=30.0)
    return Scene((ball,), friction=Friction(surface=0.1), shots=(shot,), **more)


def test_a_ball_that_slides_to_rest() -> None:
    scene = sliding()
    a, v, angle = scene.deceleration, 2.0, math.radians(30.0)
    u = np.array([math.cos(angle), math.sin(angle)])
    found = simulate(scene, solver="event-driven").derivatives("all")
    assert found.of("C", "x.C") == (1.0, 0.0)
    assert np.allclose(found.of("C", "speed"), v / a * u, rtol=1e-14)
    across = np.array([-u[1], u[0]])
    assert np.allclose(found.of("C", "angle"), v * v / (2 * a) * math.pi / 180 * across, rtol=1e-14)
    assert np.allclose(found.of("C", "friction.surface"), -v * v / (2 * a * 0.1) * u, rtol=1e-14)
    assert found.of("C", "mass.C") == found.of("C", "radius.C") == (0.0, 0.0)
    assert math.isclose(found.times[0, found.names.index("speed")], 1 / a)
    assert np.array_equal(found.velocity, np.zeros_like(found.velocity))


def test_a_run_that_is_cut_off_has_derivatives_at_that_time() -> None:
    run = simulate(sliding(), solver="event-driven", max_time=0.5)
    found = run.derivatives("velocity")
    a, v, t = run.scene.deceleration, 2.0, 0.5
    along_path = 0.5 * np.array([math.cos(math.pi / 6), math.sin(math.pi / 6)])
    across_path = np.array([-along_path[1], along_path[0]])
    moved = found.final[0] @ (2 * along_path)
    assert np.allclose(moved, t * 2 * along_path, rtol=1e-14)  # A faster ball is ahead by dv t.
    moved = found.final[0] @ (2 * across_path)
    assert np.allclose(moved, (t - a * t * t / (2 * v)) * 2 * across_path, rtol=1e-14)


def test_speed_and_angle_are_velocities() -> None:
    run = simulate(load("report"), 2, solver="event-driven")
    found = run.derivatives(["speed", "angle", "vx.C", "vy.C"])
    vx, vy = run.knots[run.scene.index["C"]][0, 3:5]
    by_vx, by_vy = found.final[..., 2], found.final[..., 3]
    unit = math.hypot(vx, vy)
    assert np.allclose(found.final[..., 0], (vx * by_vx + vy * by_vy) / unit, rtol=1e-12)
    turned = math.pi / 180.0 * (vx * by_vy - vy * by_vx)
    assert np.allclose(found.final[..., 1], turned, rtol=1e-12, atol=1e-12)


def test_everything_moves_with_the_table_where_there_is_none() -> None:
    """On an open plane all ends move with all starts, and turn with all velocities."""
    scene = random_scene("coulomb", "plane", random.Random(5))
    run = simulate(scene, solver="event-driven")
    found = run.derivatives("position")
    x = found.final[:, :, ::2].sum(axis=2)
    assert np.allclose(x, np.tile([1.0, 0.0], (len(scene.balls), 1)), atol=1e-9)


def test_a_law_of_ones_own_is_differentiated_through_its_own_functions() -> None:
    class Rough(Law):
        """The tangential impulse grows with the square of the slip."""

        def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
            (a_n, _), (b_n, _) = super().ball_ball(a, b, pair)
            slip = a.t - b.t
            push = 0.1 * slip * abs(slip) / (1.0 + abs(slip))
            return NT(a_n, a.t - push), NT(b_n, b.t + push)

    scene = load("report")
    run = simulate(scene, 2, solver="event-driven", law=Rough())
    found = run.derivatives("vy.C").final[..., 0]
    shot = scene.shots[1]
    vx, vy = run.knots[scene.index["C"]][0, 3:5].tolist()
    h = 1e-7

    def ends(change: float) -> np.ndarray:
        turned = replace(shot, velocity=(vx, vy + change), speed=None, angle=None, aim=None)
        other = replace(scene, shots=(scene.shots[0], turned, *scene.shots[2:]))
        return np.array(simulate(other, turned, solver="event-driven", law=Rough()).end.position)

    assert np.allclose((ends(h) - ends(-h)) / (2 * h), found, rtol=1e-5, atol=1e-6)


# -- where there is none -----------------------------------------------------------------------


def head_on(*balls: Ball, **more: Any) -> Scene:
    physics = Physics(max_time=more.pop("max_time", None), law=more.pop("law", "coulomb"))
    return Scene(
        balls,
        restitution=Restitution(ball_ball=more.pop("e", 0.9), cushion=0.8),
        friction=Friction(surface=0.1, ball_ball=0.1, cushion=0.1),
        physics=physics,
        **more,
    )


def ball(id_: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> Ball:
    return Ball(id_, (x, y), 0.05, 0.2, velocity=(vx, vy))


def test_contacts_of_one_instant_have_none() -> None:
    scene = head_on(ball("a", 0, 0, 2.0), ball("b", 0.5, 0.05), ball("c", 0.5, -0.05))
    found = simulate(scene, solver="event-driven").derivatives()
    assert any("contacts of one instant share a ball" in text for text in found.warnings)
    assert np.isnan(found.final).all()


def test_what_hangs_on_nothing_lost_stays_known() -> None:
    """The pair beside the rack has its derivatives, though those of the rack are unknown."""
    rack = (ball("a", 0, 0, 2.0), ball("b", 0.5, 0.05), ball("c", 0.5, -0.05))
    pair = (ball("d", 0, 9, 2.0), ball("e", 0.5, 9.01))
    found = simulate(head_on(*rack, *pair), solver="event-driven").derivatives()
    assert np.isnan(found.final[:3]).all() and np.isfinite(found.final[3:]).all()
    alone = simulate(head_on(*pair), solver="event-driven").derivatives()
    columns = [found.names.index(name) for name in alone.names]
    assert np.allclose(found.final[3:, :, columns], alone.final, rtol=1e-12, atol=1e-12)


def test_zero_slip_under_the_published_law_has_none() -> None:
    run = simulate(head_on(ball("a", 0, 0, 2.0), ball("b", 0.5, 0), law="published"),
                   solver="event-driven")  # fmt: skip
    found = run.derivatives()
    assert any("jumps or has a kink" in text for text in found.warnings)
    assert np.isnan(found.final).all()


def test_zero_slip_under_coulombs_law_is_smooth() -> None:
    scene = head_on(ball("a", 0, 0, 2.0), ball("b", 0.5, 0))
    found = simulate(scene, solver="event-driven").derivatives(["y.a"])
    assert found.warnings == ()
    h = 1e-7
    moved = simulate(head_on(ball("a", 0, h, 2.0), ball("b", 0.5, 0)), solver="event-driven")
    assert np.allclose(np.array(moved.end.position)[:, 1] / h, found.final[:, 1, 0], rtol=1e-5)


def test_a_cushion_that_is_met_head_on_is_smooth() -> None:
    table = Table.rectangle(2.0, 1.0)
    scene = head_on(ball("a", 0.5, 0.5, 2.0), table=table)
    found = simulate(scene, solver="event-driven").derivatives(["vy.a", "y.a"])
    assert found.warnings == ()
    h = 1e-7
    moved = simulate(head_on(ball("a", 0.5, 0.5, 2.0, h), table=table), solver="event-driven")
    change = (moved.end.position[0][1] - 0.5) / h
    assert math.isclose(change, found.final[0, 1, 0], rel_tol=1e-5)
    assert found.final[0, 1, 1] == 1.0


def test_a_ball_that_a_contact_stops_has_no_derivative_of_its_stop_alone() -> None:
    scene = head_on(ball("a", 0, 0, 2.0), ball("b", 0.5, 0), e=1.0)
    run = simulate(scene, solver="event-driven")
    found = run.derivatives("velocity")
    (stop,) = [k for k, event in enumerate(run.events) if event.balls == ("a",)]
    assert np.isnan(found.times[stop]).all() and np.isfinite(found.final).all()
    assert len(found.warnings) == 1 and "stops at contact" in found.warnings[0]


def test_hits_of_one_instant_in_a_rack_have_none() -> None:
    """Balls that touch at the start are hit at once, and then push each other."""
    from tests.shared.scenes import frozen_rack

    run = simulate(frozen_rack(0.0), solver="event-driven")
    found = run.derivatives("position")
    assert found.warnings and np.isnan(found.final).any()


def ends_of(scene: Scene) -> np.ndarray:
    return np.array(simulate(scene, solver="event-driven").end.position)


def test_friction_that_is_zero_has_its_one_sided_derivative() -> None:
    """More friction than none acts against the slip, whatever its sign."""
    for vy in (0.1, -0.1):
        balls = (ball("a", 0, 0, 2.0, vy), ball("b", 0.5, 0.02 * math.copysign(1.0, vy)))
        scene = replace(head_on(*balls), friction=Friction(surface=0.1))
        found = simulate(scene, solver="event-driven").derivatives("friction.ball_ball")
        h = 1e-8
        rough = replace(scene, friction=Friction(surface=0.1, ball_ball=h))
        assert np.allclose((ends_of(rough) - ends_of(scene)) / h, found.final[..., 0], atol=1e-5)


def test_a_kink_by_one_input_leaves_the_others_alone() -> None:
    """Friction of cushions that is zero has a kink head-on, but the place of the ball has none."""
    table = Table.rectangle(2.0, 1.0)
    scene = replace(head_on(ball("a", 0.5, 0.5, 2.0), table=table), friction=Friction(surface=0.1))
    found = simulate(scene, solver="event-driven").derivatives(["friction.cushion", "vy.a"])
    assert np.isnan(found.final[..., 0]).any() and np.isfinite(found.final[..., 1]).all()
    assert len(found.warnings) == 1


def test_balls_that_touch_at_the_start_feel_each_others_velocity() -> None:
    scene = head_on(ball("a", 0, 0, 2.0), ball("b", 0.06, 0.08), e=0.5)
    found = simulate(scene, solver="event-driven").derivatives(["vy.b", "vx.b"])
    for k, (vx, vy) in enumerate(((0.0, 1e-7), (1e-7, 0.0))):
        moved = ends_of(head_on(ball("a", 0, 0, 2.0), ball("b", 0.06, 0.08, vx, vy), e=0.5))
        assert np.allclose((moved - ends_of(scene)) / 1e-7, found.final[..., k], atol=1e-4)


class Jumping(Law):
    """The tangential impulse has another size for slip of another sign."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        (a_n, _), (b_n, _) = super().ball_ball(a, b, pair)
        push = 0.2 if a.t - b.t > 0.0 else -0.1
        return NT(a_n, a.t - push), NT(b_n, b.t + push)


class Bent(Law):
    """The tangential impulse depends on the size of the slip alone."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        (a_n, _), (b_n, _) = super().ball_ball(a, b, pair)
        push = 0.1 * abs(a.t - b.t)
        return NT(a_n, a.t - push), NT(b_n, b.t + push)


@pytest.mark.parametrize("law", [Jumping(), Bent()])
@pytest.mark.parametrize("wrt", ["y.a", "vy.a", "y.b"])
@pytest.mark.parametrize("vy", [0.0, 0.3])
def test_a_law_that_is_not_smooth_at_zero_slip_has_none(law: Law, wrt: str, vy: float) -> None:
    balls = (ball("a", 0, 0, 2.0, vy), ball("b", 0.5, 0, 0.0, vy))
    scene = replace(head_on(*balls, max_time=1.0), friction=Friction())
    found = simulate(scene, solver="event-driven", law=law).derivatives(wrt)
    assert np.isnan(found.final).any() and found.warnings


def test_a_law_may_ask_whether_a_velocity_is_zero() -> None:
    class Choosy(Law):
        def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
            (a_n, a_t), (b_n, b_t) = super().ball_ball(a, b, pair)
            return (NT(a_n, 0.5 * a_t), NT(b_n, b_t)) if not b.t else (NT(a_n, a_t), NT(b_n, b_t))

    def run(vy: float) -> Run:
        return simulate(head_on(ball("a", 0, 0, 2.0, vy), ball("b", 0.5, 0.02)),
                        solver="event-driven", law=Choosy())  # fmt: skip

    found = run(0.1).derivatives("vy.a")
    change = np.array(run(0.1 + 1e-7).end.position) - np.array(run(0.1).end.position)
    assert np.allclose(change / 1e-7, found.final[..., 0], atol=1e-4)


def test_a_ball_that_touches_another_and_then_falls_has_none() -> None:
    """A small change makes it hit the other one, which then does not stay where it is."""
    r = 0.03
    scene = Scene(
        (Ball("a", (0.5, 0.5), r, 0.2, velocity=(1.5, 0.0)), Ball("b", (1.0, 0.5 + 2 * r), r, 0.2)),
        Table.rectangle(2.0, 1.0),
        Restitution(0.9, cushion=0.8),
        Friction(0.05),
        pockets=(Pocket("p", (1.7, 0.5), 0.05),),
    )
    found = simulate(scene, solver="event-driven").derivatives()
    assert [event.kind for event in found.run.events] == ["pocket"]
    assert found.warnings[0].startswith("a path touches what it does not hit (at 0.353791 s)")
    assert np.isnan(found.final[1]).all()


def test_a_pocketed_ball_whose_way_is_not_known_has_none() -> None:
    pockets = (Pocket("p", (1.0, 0.0), 0.06),)
    scene = head_on(ball("a", 0, 0, 3.0), ball("b", 0.5, 0), law="published", pockets=pockets)
    found = simulate(scene, solver="event-driven").derivatives("y.a")
    assert "b" in found.run.pocketed and np.isnan(found.final).all()
    known = simulate(replace(scene, physics=Physics()), solver="event-driven").derivatives("y.a")
    assert known.of("b", "y.a") == (0.0, 0.0)


def test_where_a_corner_begins_there_is_none() -> None:
    outline = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 2.0), (1.0, 1.0), (0.0, 1.0))
    scene = head_on(ball("a", 1.0, 0.5, 0.0, 2.0), table=Table(outline))
    found = simulate(scene, solver="event-driven").derivatives("x.a")
    assert "just where a corner begins" in found.warnings[0] and np.isnan(found.final).all()


def test_a_run_that_is_cut_off_at_a_contact_has_none_there() -> None:
    scene = head_on(ball("a", 0, 0, 2.0), ball("b", 0.5, 0.02))
    found = simulate(scene, solver="event-driven", max_events=1).derivatives("x.a")
    assert "cut off at a contact" in found.warnings[0] and np.isnan(found.final).all()


@pytest.mark.parametrize("rooted", [lambda v: math.sqrt(v * v), lambda v: np.sqrt(v * v), abs])
def test_a_law_may_use_any_function(rooted: Any) -> None:
    """It answers as a cushion with restitution 1, and has the derivatives of that."""

    class Rooted(Law):
        def cushion(self, v: NT, restitution: float, friction: float) -> NT:
            return NT(float(rooted(-v.n)), v.t)

    table = Table.rectangle(2.0, 1.0)
    scene = head_on(ball("a", 0.5, 0.5, 2.0, 0.1), table=table)
    run = simulate(scene, solver="event-driven", law=Rooted())
    assert 0.0 < run.rounding < 1e-12
    ends = Restitution(0.9, cushion=1.0), replace(scene.friction, cushion=0.0)
    usual = replace(scene, restitution=ends[0], friction=ends[1])
    wanted = simulate(usual, solver="event-driven").derivatives().final
    assert np.allclose(run.derivatives().final, wanted, rtol=1e-10, atol=1e-10)


def test_rounding_is_never_larger_than_the_table_by_far() -> None:
    rng = random.Random(1)
    balls: list[Ball] = []
    while len(balls) < 30:
        at = (rng.uniform(0.05, 0.95), rng.uniform(0.05, 0.95))
        if all(math.dist(at, b.position) > 0.08 for b in balls):
            velocity = (rng.uniform(-3, 3), rng.uniform(-3, 3))
            balls.append(Ball(str(len(balls)), at, 0.03, 0.2, velocity=velocity))
    scene = Scene(tuple(balls), Table.rectangle(1.0, 1.0), Restitution(1.0, cushion=1.0),
                  Friction(surface=0.05))  # fmt: skip
    assert simulate(scene, solver="event-driven").rounding < 10.0


def test_all_starts_of_eleven_balls_cost_less_than_ten_runs() -> None:
    """44 differences would cost 44."""
    scene = load("report")
    run = simulate(scene, 1, solver="event-driven")
    works = (lambda: simulate(scene, 1, solver="event-driven"), run.derivatives)
    rounds = [
        [timeit.timeit(work, timer=process_time, number=1) for work in works] for _ in range(60)
    ]
    played, differentiated = map(min, zip(*rounds, strict=True))
    assert differentiated < 10.0 * played


# -- what is made of them ----------------------------------------------------------------------


def test_amplification_is_that_of_the_worst_small_step() -> None:
    run = simulate(load("report"), 1, solver="event-driven")
    found = run.derivatives("position")
    amplified = found.amplification
    i = run.scene.index["8"]
    _, _, directions = np.linalg.svd(found.final[i])
    moved = np.hypot(*(found.final[i] @ directions[0]))
    assert math.isclose(moved, amplified["8"], rel_tol=1e-12)


def test_rounding_is_of_the_size_that_runs_with_random_rounding_have() -> None:
    for scenario, shot in (("report", 1), ("report", 2), ("hexagon", 1)):
        run = simulate(load(scenario), shot, solver="event-driven")
        assert run.again is not None
        traces = [run.again.play(Variant(seed=seed)) for seed in range(40)]
        ends = [places_at(trace, trace.duration) for trace in traces]
        apart = np.hypot(*(np.array(ends) - np.array(run.end.position)).transpose(2, 0, 1))
        assert 0.25 < rounding(run) / (4.0 * np.sqrt((apart**2).mean(axis=0)).max()) < 4.0
        assert run.rounding == rounding(run)


def test_rounding_is_measured_by_runs_where_there_are_no_derivatives() -> None:
    run = simulate(load("report"), 4, solver="event-driven")
    assert math.isnan(rounding(run)) and 0.0 < run.rounding < 1e-12


def test_derivatives_that_outgrow_the_numbers_are_lost_and_it_is_said() -> None:
    """The tests turn NumPy's warning of an overflow into an error."""
    balls = tuple(
        Ball(
            str(k), (0.2 + 0.6 * (k % 2), 0.2 + 0.25 * (k // 2)), 0.1, 0.2, velocity=(3.0 - k, 1.3)
        )
        for k in range(6)
    )
    elastic = Restitution(1.0, None, 1.0)
    scene = Scene(balls, Table.rectangle(1.2, 0.9), elastic, physics=Physics(max_time=60.0))
    run = simulate(scene, solver="event-driven")
    found = run.derivatives()
    assert np.isnan(found.final).any()
    assert any("the derivatives have grown beyond 1e+150" in each for each in found.warnings)
    known = found.times[np.isfinite(found.times)]
    assert 1e100 < np.abs(known).max() < 1e300
    assert np.isnan(found.amplification["0"])


@pytest.mark.parametrize("roll", [1.0, -0.6, 0.3])
@pytest.mark.parametrize("friction", [0.05, 0.4])
def test_a_roll_that_a_post_and_an_arc_slow_down(friction: float, roll: float) -> None:
    """Their normals turn with the place of the hit, and what they take off the roll turns, too."""
    scene = Scene(
        (Ball("a", (0.5, 0.52), 0.03, 0.2, velocity=(2.0, 0.3), roll=roll),),
        Table(((0, 0), (2, 0), (2, 1), (0, 1)), (0, 0.4, 0, 0.4)), Restitution(cushion=0.7),
        Friction(0.2, friction, 0.0, rolling=0.02), Physics(max_time=3.0),
        posts=(Post((1.0, 0.62), 0.08),),
    )  # fmt: skip
    names, step = ["x.a", "y.a", "vx.a", "vy.a", "friction.cushion", "restitution.cushion"], 1e-6
    run = simulate(scene, solver="event-driven")
    found = run.derivatives(names)
    assert sum(event.kind == "ball-cushion" for event in run.events) > 1
    for k, name in enumerate(names):
        low, high = (
            simulate(
                with_inputs(scene, {name: input_value(scene, name) + off}), solver="event-driven"
            ).end.position
            for off in (-step, step)
        )
        slope = np.subtract(high, low) / (2.0 * step)
        assert np.abs(slope - found.final[..., k]).max() < 1e-7 * max(1.0, np.abs(slope).max())
