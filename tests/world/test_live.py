"""A live table plays by the core: ``pymunk`` has the bits of ``event-driven`` at every step.

``python -m tests.world.test_live 150`` plays so many random scenes, and prints where bits differ.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    Shot,
    Table,
    load,
    simulate,
)
from pool_pymunk.world.ball import AsItCame
from pool_pymunk.world.bodies import Bodies
from tests.shared.core_scenes import BUNDLED, SCENES, drawn
from tests.shared.scenes import BASE_SEED, share_of
from tests.shared.worlds import STEP, A, ball, fence, plane

LENGTHS = 1 / 60, 1 / 37  # s; the steps
LATEST, MOST = 5.0, 400  # s, and events of a run
QUICK, LONG = 10, 500  # random scenes


def said(run: Run) -> dict[str, Any]:
    """Return all that has bits: events, ends, the time, and contacts that persisted."""
    return {
        "status": run.status, "duration": run.duration, "events": run.events, "end": run.end,
        "persistent": run.persistent,
    }  # fmt: skip


def differences(
    scene: Scene, shot: Shot | None = None, lengths: Sequence[float] = LENGTHS
) -> Iterator[str]:
    """Yield what differs between the exact solver and live tables of some steps."""
    most: Any = {"max_time": scene.physics.max_time or LATEST, "max_events": MOST}
    exact = said(simulate(scene, shot, solver="event-driven", **most))
    for dt in lengths:
        live = said(simulate(scene, shot, solver="pymunk", dt=dt, **most))
        yield from (f"{key} at dt = {dt}" for key in exact if exact[key] != live[key])


def random_scenes(count: int) -> Iterator[tuple[str, Scene]]:
    """Yield scenes of all kinds in turn: of them many roll, press or have patches."""
    kinds = [*SCENES]
    for seed in range(BASE_SEED, BASE_SEED + count):
        kind = kinds[seed % len(kinds)]
        yield f"{kind} {seed}", drawn(random.Random(f"{kind} {seed}"), kind)


def differing(count: int) -> dict[str, list[str]]:
    """Return in which random scenes something differs at one of the steps in turn."""
    found = {
        name: [*differences(scene, lengths=LENGTHS[k % 2 :][:1])]
        for k, (name, scene) in enumerate(random_scenes(count))
    }
    return {name: what for name, what in found.items() if what}


@pytest.mark.parametrize("dt", [0.252, 0.126, 0.036])
def test_to_look_into_a_piece_of_a_group_changes_no_bit(dt: float) -> None:
    """An arc presses on each ball, and a step ends within a piece."""
    outline = (1.982534660513005, 1.1860796627538708), (0.34758295467100475, 1.7578601447260462)
    table = Table((*outline, (0.6698823848159905, 0.05606019252008332)), (0.0, 0.577, 0.577))
    balls = (
        Ball("0", (1.7086, 0.8967), 0.0384, 0.1355, velocity=(0.1969, -2.3069), roll=0.5),
        Ball("1", (1.3991, 1.1371), 0.0345, 0.1426),
        Ball("2", (0.8547, 1.321), 0.0535, 0.1026),
        Ball("3", (1.1212, 1.1779), 0.0512, 0.2159, velocity=(-2.8127, 1.8011), roll=0.566),
        Ball("4", (1.0113, 1.1878), 0.0333, 0.2014, velocity=(-1.9521, 2.7477), roll=0.402),
    )
    coefficients = Restitution(0.5, 0.9, 0.1), Friction(0.2, 3.0, 5.0, 0.0)
    scene = Scene(balls, table, *coefficients, Physics(max_time=5.0))
    assert not [*differences(scene, None, [dt])]


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_scenes_have_the_same_bits(name: str) -> None:
    scene = load(name)
    for shot in scene.shots or (None,):
        assert not [*differences(scene, shot, LENGTHS[:1])]


def test_random_scenes_have_the_same_bits() -> None:
    assert not differing(QUICK)


@pytest.mark.slow
def test_many_random_scenes_have_the_same_bits() -> None:
    assert not differing(share_of(LONG, 44))


@pytest.mark.parametrize("settings", [{"alone": True}, {"friction": "callback"}])
def test_former_settings_do_nothing(settings: dict[str, Any]) -> None:
    space, table = plane(**settings)
    one = ball(table, 0.0)
    space.add(pymunk.Circle(space.static_body, 0.1, (0.0, 1.0)))
    one.body.velocity = 1.0, 0.0
    for _ in range(120):
        table.step()
        space.step(STEP)
    assert one.body.position.x == pytest.approx(1.0 / (2.0 * A), abs=1e-12)
    assert not space.constraints


def fail(*_: object) -> None:
    raise AssertionError("this takes time that nothing asks for")


def test_a_step_in_which_all_balls_rest_writes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    space, table = plane()
    for k in range(11):
        ball(table, 0.1 * k)
    space.step(STEP)
    for what in ("write", "shown", "see"):
        monkeypatch.setattr(Bodies, what, fail)
    monkeypatch.setattr(AsItCame, "refuse_changed", fail)
    space.step(STEP)
    assert table.steps == 2


def test_another_wall_looks_at_one_that_is_there_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    _, table = plane()
    looked_at: list[object] = []
    monkeypatch.setattr(AsItCame, "refuse_changed", lambda its: looked_at.append(its))
    fence(table, [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], 0.0, 0.9, 0.0)
    assert len(table.walls) == 4
    assert len(looked_at) == 3


def test_another_ball_leaves_those_alone_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    space, table = plane()
    for k in range(20):
        if k == 2:
            for what in ("know", "write", "shown", "see"):
                monkeypatch.setattr(Bodies, what, fail)
        ball(table, 0.1 * k)
    monkeypatch.undo()
    table.balls[7].body.velocity = 1.0, 0.0
    space.step(STEP)
    assert [*table.moving] == [7]


if __name__ == "__main__":
    for name, what in differing(int(sys.argv[1])).items():
        print(name, *what, sep="\n    ")
