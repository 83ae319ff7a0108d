"""Single runs by the compiled loop are those of Python: every bit, event, warning and figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import fields, replace
from importlib import import_module

import numpy as np
import pytest
from press_scenes import AT_A_CUSHION, HEAD_ON, ON_A_CIRCLE
from scenes import seeds, takes_long
from shots import KINDS, LATE, ROLLING, ROLLS, great_crowd, needs_numba, some_scene

from pool_pymunk import Run, Scene, load, simulate, simulate_many
from pool_pymunk.engine import asked
from pool_pymunk.engine.policies import Variant
from pool_pymunk.fast import ahead, single
from pool_pymunk.fast.loop import PIECE
from pool_pymunk.fast.press import RecordPress
from pool_pymunk.solvers import event_driven, grouped

EXACT = "event-driven"
pytestmark = needs_numba


@pytest.fixture(autouse=True)
def contact_engine_plays(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop plays runs of the contact engine; here that is every run."""
    monkeypatch.setattr(event_driven, "solve", grouped.solve)


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> Iterator[Counter[str]]:
    """Count the runs that the compiled loop plays, and those that it leaves to Python."""
    count = Counter[str]()
    solve = single.solve

    def counted(*args: object) -> object:
        trace = solve(*args)  # type: ignore[arg-type]
        count["Python" if trace is None else "compiled"] += 1
        return trace

    monkeypatch.setattr(single, "solve", counted)
    monkeypatch.setattr(grouped, "FASTER", [])
    yield count


def check_same(scene: Scene, **options: float) -> Run:
    """Check that the loop and Python tell the same of a run, and return it."""
    one = simulate(scene, solver=EXACT, **options)  # type: ignore[arg-type]
    other = simulate(scene, solver=EXACT, compiled=False, **options)  # type: ignore[arg-type]
    for each in fields(Run):
        if each.compare:
            assert getattr(one, each.name) == getattr(other, each.name), each.name
    for mine, its in zip(one.knots, other.knots, strict=True):
        np.testing.assert_array_equal(mine, its)
    return one


def of_kind(kind: str, seed: int) -> Scene:
    """Return a random scene whose runs end."""
    scene = some_scene(kind, seed)
    return replace(scene, physics=replace(scene.physics, max_time=scene.physics.max_time or 20.0))


def try_kind(kind: str, numbers: Iterator[int] | range, played: Counter[str]) -> None:
    """Check random scenes of a kind; most of them are compiled."""
    ahead.compile(of_kind(kind, 0))
    for seed in numbers:
        check_same(of_kind(kind, seed))
    # Python plays what needs impulses of several contacts of balls that roll: a fifth of hard runs.
    is_hard = kind in ("hard" + ROLLS, "frozen" + ROLLS)
    assert played["compiled"] > (3 if is_hard else 9) * played["Python"]


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("frozen", *LATE)])
def test_random_runs_are_those_of_python(kind: str, played: Counter[str]) -> None:
    try_kind(kind, range(5), played)


@pytest.mark.slow
@pytest.mark.seeded
@pytest.mark.parametrize("kind", [*KINDS, *ROLLING])
def test_many_random_runs_are_those_of_python(kind: str, played: Counter[str]) -> None:
    try_kind(kind, seeds(3 if kind.startswith(("hard", "frozen", "crowd")) else 10), played)


@takes_long
@pytest.mark.slow
def test_a_great_crowd_is_that_of_python(played: Counter[str]) -> None:
    crowd = great_crowd(130, rolls=True)
    ahead.compile(crowd)
    check_same(crowd, max_time=0.5)
    assert played["compiled"] == 1


def test_bounds_cut_a_run_at_the_same_event(played: Counter[str]) -> None:
    scene = of_kind("rack", 3)
    ahead.compile(scene)
    events = len(check_same(scene).events)
    for most in (1, 2, events // 2, events - 1, events):
        run = check_same(scene, max_events=most)
        assert run.status == ("settled" if most == events else "max_events")
        assert len(run.events) == most
    assert check_same(scene, max_time=0.1).status == "max_time"
    assert played["compiled"] == 7
    assert played["Python"] == 0


@pytest.mark.parametrize("variant", [Variant(seed=3), Variant(nudge=5), Variant(coarser=30.0)])
def test_variants_are_those_of_python(variant: Variant, played: Counter[str]) -> None:
    scene = of_kind("rack", 1)
    ahead.compile(scene)
    again = simulate(scene, solver=EXACT).again
    assert again is not None
    assert again(variant) == again(variant, compiled=False)
    assert (again(variant).end == again(Variant()).end) == (variant.coarser > 1.0)
    assert played["compiled"] >= 4


def test_python_plays_where_it_is_asked_to(played: Counter[str]) -> None:
    ahead.compile(load("two-balls"))
    simulate(load("two-balls"), solver=EXACT, max_time=1.0, compiled=False)
    assert not played


def test_compiled_shots_are_loaded_where_a_long_run_has_variants(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = list[Scene]()
    monkeypatch.setattr(ahead, "load", found.append)
    plain, frozen = of_kind("rack", 3), of_kind("frozen", 1)
    requests = import_module("pool_pymunk.solvers.request")
    monkeypatch.setattr(requests, "LONG", 0.0)
    for scene in (plain, frozen):
        simulate(scene, solver=EXACT)
    simulate(frozen, solver=EXACT, compiled=False)
    simulate(frozen, solver="pymunk")
    monkeypatch.setattr(requests, "LONG", 1e9)
    simulate(frozen, solver=EXACT)
    assert found == [frozen]


def test_what_is_compiled_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    ahead.compile(load("report"))
    assert capsys.readouterr().err.splitlines()[-1].startswith("balls that slide: ready after ")


# -- the engine's press ----------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["event-driven", "pymunk"])
@pytest.mark.parametrize("scene", [HEAD_ON, AT_A_CUSHION, ON_A_CIRCLE])
def test_persistent_contacts_of_the_engine_are_compiled(
    scene: Scene, solver: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead.compile(load("report"))
    monkeypatch.setattr(grouped, "FASTER", [])
    rolls = [replace(ball, roll=1.0) for ball in scene.balls]
    balls = [
        replace(ball, velocity=(0.3, 0.4)) if ball.velocity == (0.0, 0.0) else ball
        for ball in rolls
    ]
    scene = replace(scene, balls=tuple(balls), physics=replace(scene.physics, max_time=0.3))
    asks = Counter[int]()
    ask = RecordPress.ask

    def counted(press: RecordPress, what: int, **arguments: float) -> list[float]:
        asks[what] += 1
        return ask(press, what, **arguments)

    monkeypatch.setattr(RecordPress, "ask", counted)
    one = simulate(scene, solver=solver)
    assert asks[PIECE] > 0
    monkeypatch.setattr(asked, "PRESSES", [])
    other = simulate(scene, solver=solver)
    assert one == other
    assert len(one.persistent) > 0


@pytest.mark.slow
def test_derivatives_of_a_compiled_run_with_persistent_contacts(played: Counter[str]) -> None:
    ahead.compile(HEAD_ON)
    scene = replace(HEAD_ON, balls=tuple(replace(ball, roll=1.0) for ball in HEAD_ON.balls))
    run = check_same(scene)
    assert run.persistent
    assert played["compiled"] > 0
    python = simulate(scene, solver=EXACT, compiled=False)
    np.testing.assert_array_equal(run.derivatives().final, python.derivatives().final)
    assert run.rounding == python.rounding


def test_many_shots_load_what_single_runs_use(played: Counter[str]) -> None:
    scene = load("report")
    simulate_many(scene, 1)
    simulate(scene, 1, solver=EXACT)
    assert played["compiled"] == 1
