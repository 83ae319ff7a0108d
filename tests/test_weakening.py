"""The law `weakening` is one class in physics/laws.py, and everything knows it from there."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from shots import (
    KINDS,
    check_bits,
    check_derivatives,
    in_the_loop,
    needs_numba,
    shots_of,
    some_scene,
)

from pool_pymunk import (
    NT,
    Ball,
    Friction,
    Pair,
    Physics,
    Restitution,
    Scene,
    load,
    loads,
    simulate,
    simulate_many,
)
from pool_pymunk.fast import compiled
from pool_pymunk.fast.kinds import bounce_by_duals, hit_by_duals
from pool_pymunk.physics.dual import Dual, by_duals, dual, slope
from pool_pymunk.physics.laws import COMPILED, Law
from pool_pymunk.report.listing import modelled

NAME, R = "weakening", 0.05


def scene_of(kind: str, seed: int) -> Scene:
    """Return a random scene of this law, whose balls rub much."""
    scene = some_scene(kind, seed)
    friction = replace(scene.friction, ball_ball=0.3)
    return replace(scene, friction=friction, physics=replace(scene.physics, law=NAME))


def compare(kind: str, seed: int, count: int) -> int:
    batch = simulate_many(scene_of(kind, seed), *shots_of(some_scene(kind, seed), count, seed))
    assert batch.law == NAME
    check_bits(batch, range(count))
    return batch.by_reference


@needs_numba
@pytest.mark.parametrize("kind", ["rectangle", "hexagon", "pockets"])
def test_shots_have_the_bits_of_the_exact_solver(kind: str) -> None:
    assert sum(compare(kind, seed, 10) for seed in range(5)) <= 5


@needs_numba
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* were handed back to the Python solver")
@pytest.mark.parametrize("kind", KINDS)
def test_many_shots_have_the_bits_of_the_exact_solver(kind: str) -> None:
    for seed in range(1 if kind == "crowd" else 8):
        compare(kind, seed, 5)


def test_what_numba_compiles_has_the_same_bits_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    in_the_loop(monkeypatch)
    assert compare("rectangle", 1, 5) == 0


@needs_numba
@pytest.mark.filterwarnings("ignore:.* were handed back to the Python solver")
def test_shots_with_contacts_of_one_instant_are_compiled() -> None:
    assert sum(compare("frozen", seed, 3) for seed in range(8)) <= 2


def test_contacts_of_one_instant_take_the_mean_over_their_orders() -> None:
    """A ball that comes between two others moves on along its line, as by any symmetric answer."""
    balls = (
        Ball("a", (0.0, 0.0), R, 0.2, velocity=(2.0, 0.0)),
        Ball("b", (0.3 + R * math.sqrt(3.0), R), R, 0.2),
        Ball("c", (0.3 + R * math.sqrt(3.0), -R), R, 0.2),
    )
    scene = Scene(balls, None, Restitution(0.9), Friction(0.2, 0.0, 0.3), Physics(law=NAME))
    run = simulate(scene, solver="event-driven")
    assert run.final["a"][1] == pytest.approx(0.0, abs=1e-12)
    assert run.final["b"][1] == pytest.approx(-run.final["c"][1], abs=1e-12)
    assert run.final["b"][1] > 2.0 * R


# -- names -----------------------------------------------------------------------------------------


def test_files_name_it_and_say_that_energy_does_not_grow() -> None:
    scene = loads(scene_of("rectangle", 1).to_toml())
    assert scene.physics.law == NAME
    assert any(f"law {NAME}" in line for line in modelled(scene))
    assert not any("gain energy" in line for line in modelled(scene))
    worse = replace(scene, physics=replace(scene.physics, law="published"))
    assert any("gain energy" in line for line in modelled(worse))


def test_energy_never_grows_in_runs() -> None:
    for seed in range(5):
        run = simulate(scene_of("rectangle", seed), solver="event-driven")
        energy = run.energy_at(np.linspace(0.0, run.duration, 200))
        assert np.diff(energy).max() <= 1e-12 * energy[0]


# -- derivatives -----------------------------------------------------------------------------------


INPUTS = {"speed": 2.0, "friction.ball_ball": 0.3, "restitution.ball_ball": 0.8}


def test_derivatives_are_those_of_differences() -> None:
    """They go through a hit that slips on, where the slip moves the friction."""
    scene, h = replace(load("two-balls"), friction=Friction(0.2, 0.1, 0.3)), 1e-6
    start = {name: np.full(2 * len(INPUTS) + 1, value) for name, value in INPUTS.items()}
    for k, name in enumerate(INPUTS):
        start[name][2 * k + 1 : 2 * k + 3] += h, -h
    batch = simulate_many(scene, vary=start, law=NAME, derivatives=list(INPUTS))
    found = batch.run(0).derivatives(list(INPUTS)).final
    for k in range(len(INPUTS)):
        moved = (batch.final[2 * k + 1] - batch.final[2 * k + 2]) / (2.0 * h)
        np.testing.assert_allclose(found[:, :, k], moved, rtol=0.0, atol=1e-7)
    assert check_derivatives(batch, [0]) == compiled.is_there()


@needs_numba
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rectangle", "hexagon", "rack"])
def test_compiled_derivatives_are_those_of_runs(kind: str) -> None:
    """Nobody wrote down the slopes of this law: numba follows dual numbers through it."""
    known = 0
    for seed in range(6):
        shots = shots_of(some_scene(kind, seed), 3, seed)
        batch = simulate_many(scene_of(kind, seed), *shots, derivatives="all")
        known += check_derivatives(batch, range(3))
    assert known >= 9


BEFORE = [
    (NT(1.0, 0.3), NT(-0.2, 0.1)),
    (NT(1.0, -2.0), NT(0.0, 0.5)),
    (NT(-1.0, 0.0), NT(0.5, 0.1)),
]


@needs_numba
@pytest.mark.parametrize("law", COMPILED)
@pytest.mark.parametrize("friction", [0.05, 2.0])
def test_numbas_dual_numbers_are_those_of_python(law: type[Law], friction: float) -> None:
    import_module(compiled.DUALS)
    pair, v = Pair(0.2, 0.3, 0.9, friction), NT(-1.0, 0.4)
    hit = compiled.alone(hit_by_duals(law.ball_ball))
    bounce = compiled.alone(bounce_by_duals(law.cushion))
    rows = np.empty((4, 8))
    for a, b in BEFORE:
        hit(a, b, pair, rows)
        np.testing.assert_array_equal(rows, by_duals(law().ball_ball, (a, b, pair)))
    bounce(v, 0.8, friction, rows)
    found = by_duals(law().cushion, (v, 0.8, friction))
    np.testing.assert_array_equal(rows[:2, :4], found)


def test_the_cache_goes_by_the_source_of_numbas_dual_numbers() -> None:
    assert compiled.DUALS in compiled.sources(hit_by_duals(Law.ball_ball))
    assert compiled.DUALS not in compiled.sources()


def odd(self: None, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Use all that dual numbers know."""
    n = max(a.n, 0.5) - min(2.0, b.n) + abs(-a.t) / 3.0 + (+b.t) ** 3 + 1 / a.n
    t = 0.0 if a.t < b.t or not pair.m_a or a.n == b.n else a.t * 2
    if a.n >= b.n and a.n > 0 and b.t <= 5.0 and a.n != pair.m_b:
        n -= 1.0
    return NT(n, t), NT(min(a.n, b.n), max(a.t, b.t))


@needs_numba
@pytest.mark.parametrize(("a", "b"), BEFORE)
def test_numbas_dual_numbers_know_what_those_of_python_know(a: NT, b: NT) -> None:
    import_module(compiled.DUALS)
    rows, pair, njit = np.empty((4, 8)), Pair(0.2, 0.3, 0.9, 0.1), import_module("numba").njit
    for each in dual, slope:
        import_module("numba.extending").register_jitable(each)
    njit(hit_by_duals(njit(odd)))(a, b, pair, rows)
    wanted = by_duals(lambda a, b, pair: odd(None, a, b, pair), (a, b, pair))
    np.testing.assert_array_equal(rows, wanted)


def test_a_plain_number_in_a_cushions_answer_has_no_slopes() -> None:
    """Friction of 2 stops a ball along the cushion, and the law answers a plain 0."""
    normal, tangential = by_duals(Law().cushion, (NT(-1.0, 0.4), 0.8, 2.0))
    assert normal == (-0.8, 0.0, 1.0, 0.0)
    assert tangential == (0.0, 0.0, 0.0, 0.0)


def test_a_dual_number_with_one_slope() -> None:
    assert slope(dual(3.0, True) * dual(2.0, False)) == 2.0
    assert slope(3.0) == 0.0
    assert isinstance(dual(3.0, True), Dual)
