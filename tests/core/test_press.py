"""Contacts that persist: their ends by other methods, their energy, symmetries and gaps."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    SceneError,
    Table,
    simulate,
)
from pool_pymunk.solvers.record import CONTACT_TOLERANCE
from tests.oracle.press_reference import PressRun, press_run
from tests.oracle.reference import Refused
from tests.shared.hard_scenes import unmeasured
from tests.shared.press_scenes import ON_FILE, amplification, farthest, press_scene
from tests.shared.scenes import seeds

FAR = 1e-7  # m, times the amplification
NEAR = 1e-6  # m; times a tenth of the amplification, at least 1
LEAST = 1e-10  # m; the reference's own accuracy
# m; that after a cascade of hits, whose last ones it cannot resolve: in scene 17 it is 2.8e-7 off
# what the core plays to any tolerance from 1e-6 to 1e-9 m.
AFTER_CASCADES = 5e-7
CASCADE = 40  # events
SOME = 40  # scenes; a contact persists in about half of them
# In the middle of a piece of a group, the velocity is that of a parabola. At its ends, energy does
# not grow at all.
GROWN = 1e-12  # of the energy at the start
# of the momentum; it was 5.2e-6 in one of 89 scenes, and 5e-16 in the others.
KEPT = 1e-5
# m; a parabola stands for a piece of the motion, which errs by no more. A run of the engine before
# the core sank in by 1e-8 radii, because its pieces were as short as that takes.
SINKS = CONTACT_TOLERANCE
# m, times the amplification. In 135 scenes it was 1.2e-11 m at most but once, and 4e-10 m there.
SAME = 2e-9


def ends_of(run: Run) -> list[complex]:
    return [complex(*place) for place in run.end.position]


def some_scenes(drawn: range) -> Iterator[tuple[int, Scene]]:
    """Yield random scenes, without those whose balls would overlap."""
    for seed in drawn:
        try:
            yield seed, press_scene(seed)
        except SceneError:
            continue


def has_force(run: PressRun) -> bool:
    return any(force > 0.0 for force in run.strongest.values())


# -- ends ------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.seeded
def test_random_scenes_end_where_the_reference_has_them() -> None:
    """No run is farther off than it says, and all are near."""
    forces, far, beyond = [], [], []
    drawn = seeds(200, 6)
    for seed, scene in some_scenes(drawn):
        try:
            expected = press_run(scene)
        except Refused:
            continue
        run = simulate(scene, solver="event-driven")
        off = farthest(ends_of(run), expected.final)
        forces.append(has_force(expected))
        # Which of two modes begins may move an end by some tolerances more.
        if off > NEAR and off > 5.0 * max(NEAR, FAR * amplification(scene, expected.final)):
            far.append(seed)
        resolved = AFTER_CASCADES if len(expected.events) > CASCADE else LEAST
        if off > resolved and off > run.policy_shift + run.persistent_shift + run.rounding:
            beyond.append(seed)
    assert sum(forces) > len(drawn) / 4
    assert not far and not beyond, (far, beyond)


@pytest.mark.parametrize(("scene", "ends"), ON_FILE.values(), ids=ON_FILE)
def test_ends_by_tiny_time_steps(scene: Scene, ends: list[complex]) -> None:
    run = unmeasured(scene)
    assert farthest(ends_of(run), ends) < 1e-6
    assert len(run.events) <= 400


def test_nothing_pulls_at_sides_that_a_hit_parts() -> None:
    """Two discs slide along an arc; the last one hits the arc once more, and leaves the first."""
    discs = (
        Ball("0", (0.0293, 0.5746), 0.0286, 0.1, velocity=(-0.029, -0.585)),
        Ball("1", (0.0383, 0.4954), 0.0286, 0.1),
    )
    friction = Friction(0.2286, 0.1, 0.15)
    scene = Scene(discs, Table.circle(0.6), Restitution(0.0, cushion=0.0), friction)
    assert farthest(ends_of(unmeasured(scene)), press_run(scene).final) < 1e-8


# -- what holds in every run -----------------------------------------------------------------------


@cache
def some_runs() -> tuple[tuple[int, Run], ...]:
    """Return runs of random scenes in which a contact has persisted."""
    runs = ((seed, unmeasured(scene)) for seed, scene in some_scenes(seeds(SOME, 10)))
    return tuple((seed, run) for seed, run in runs if run.persistent)


def breakpoints(run: Run) -> Any:
    return np.unique(np.concatenate([rows[:, 0] for rows in run.knots]))


@pytest.mark.seeded
def test_energy_never_grows() -> None:
    """It is that of the motion and of the roll: (m/2) v^2 + (m/5) w^2."""
    for seed, run in some_runs():
        energy = run.energy_at(breakpoints(run))
        assert np.diff(energy).max() <= GROWN * energy[0], seed


def rolls_on(scene: Scene) -> Scene:
    """Return the scene without rolling resistance, which bounces that are left out do not feel.

    Where these begin to persist, balls get the speed that it does not take meanwhile.
    """
    if not scene.surface.rolls:
        return scene
    friction = replace(scene.friction, rolling=0.0)
    return replace(scene, friction=friction, physics=Physics(max_time=0.5))


def jump(run: Run) -> float:
    """Return how much the momentum changes at an instant, as a share of all there may be.

    The surface gives 5/2 of the velocity that it takes to the roll, at once where a slip is merged.
    """
    mass = np.array([ball.mass for ball in run.scene.balls])
    t = breakpoints(run)[1:]
    before, after = (momentum(run, mass, times) for times in (np.nextafter(t, 0.0), t))
    fastest = math.hypot(*run.scene.balls[0].velocity)
    return float(np.abs(after - before).max() / (mass.sum() * fastest))


def momentum(run: Run, mass: Any, times: Any) -> Any:
    """Return the momentum (T, 2) of all balls, with 2/5 of that of their rolls, at some times."""
    velocity = run.at(times)[1]
    if run.scene.surface.rolls:
        velocity = velocity + 0.4 * run.roll_at(times)
    return mass @ velocity


@pytest.mark.seeded
def test_contacts_of_balls_do_not_change_the_momentum() -> None:
    """Only surface friction and cushions do; neither acts at one instant on an open plane."""
    for seed, run in some_runs():
        assert run.scene.table is not None or jump(unmeasured(rolls_on(run.scene))) <= KEPT, seed


def test_a_ball_that_pushes_a_group_gives_it_momentum_of_its_own() -> None:
    """Three balls join; the first one has no part in the forces then."""
    run = unmeasured(rolls_on(press_scene(57)))
    assert len(run.persistent) > 1
    assert jump(run) <= GROWN  # Slips that took momentum with them made it 7.8e-6.


def deepest(run: Run) -> float:
    """Return by how much (m) two sides overlap at most, at many times."""
    position, _ = run.at(np.linspace(0.0, run.duration, 2000))
    balls, least = run.scene.balls, math.inf
    for (i, a), (j, b) in combinations(enumerate(balls), 2):
        apart = np.linalg.norm(position[:, i] - position[:, j], axis=-1)
        least = min(least, float(apart.min()) - a.radius - b.radius)
    for wall in run.scene.cushions:
        for i, ball in enumerate(balls):
            gaps = (
                wall.nearest(x, y, ball.radius, 0.0).gap(x, y, ball.radius)
                for x, y in position[:, i]
            )
            least = min(least, *gaps)
    return -least


@pytest.mark.seeded
def test_nothing_sinks_in() -> None:
    for seed, run in some_runs():
        assert deepest(run) <= SINKS, seed


def turned(scene: Scene, turn: complex, mirrors: bool) -> Scene:
    """Return the scene times a number of size 1, after its x and y were exchanged, or not."""

    def to(p: Sequence[float]) -> tuple[float, float]:
        z = turn * (complex(p[1], p[0]) if mirrors else complex(*p))
        return z.real, z.imag

    balls = [replace(b, position=to(b.position), velocity=to(b.velocity)) for b in scene.balls]
    table = scene.table
    if table is not None:  # Outlines go round counterclockwise.
        outline, bulge = table.outline, table.bulge
        if mirrors:
            outline, bulge = outline[::-1], bulge and (*bulge[-2::-1], bulge[-1])
        table = replace(table, outline=tuple(map(to, outline)), bulge=bulge)
    return replace(scene, balls=tuple(balls), table=table)


def turned_ends(run: Run, turn: complex, mirrors: bool) -> list[complex]:
    """Return the ends of a scene that is turned, turned back."""
    places = [z / turn for z in ends_of(unmeasured(turned(run.scene, turn, mirrors)))]
    return [complex(z.imag, z.real) for z in places] if mirrors else places


def relabelled_ends(run: Run) -> list[complex]:
    """Return the ends of the scene whose balls have other numbers."""
    return ends_of(unmeasured(replace(run.scene, balls=run.scene.balls[::-1])))[::-1]


@pytest.mark.slow
@pytest.mark.seeded
def test_mirrored_turned_and_relabelled_scenes_have_the_same_ends() -> None:
    """They differ by rounding, which decides nothing."""
    unequal = []
    for seed, run in some_runs():
        ends = ends_of(run)
        others = [
            turned_ends(run, 1.0, True),
            turned_ends(run, cmath.rect(1.0, 0.7), False),
            turned_ends(run, cmath.rect(1.0, 4.0), True),
            relabelled_ends(run),
        ]
        off = max(farthest(ends, other) for other in others)
        if off > SAME and off > SAME * amplification(run.scene, ends):
            unequal.append((seed, off))
    assert not unequal
