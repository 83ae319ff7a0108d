"""A shot may place its ball before it strikes it: ball in hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pool_pymunk import (
    Ball,
    Batch,
    Friction,
    Pocket,
    Post,
    Restitution,
    Scene,
    SceneError,
    Shot,
    Table,
    Uncertainty,
    find,
    loads,
    sensitivity,
    simulate,
    simulate_all,
    sweep,
)
from pool_pymunk.model.inputs import with_inputs
from pool_pymunk.studies.derivatives import follow
from pool_pymunk.studies.sweep import Sweep
from tests.shared.texts import PLACE

R = 0.03  # m
HAND = (0.3, 0.6)
BALLS = (Ball("C", (0.5, 0.5), R, 0.2, cue=True), Ball("A", (1.0, 0.55), R, 0.2))
SCENE = Scene(
    BALLS,
    table=Table.rectangle(2.0, 1.0),
    restitution=Restitution(0.9, cushion=0.8),
    friction=Friction(0.1, 0.2, 0.05),
    pockets=(Pocket("far", (2.0, 0.5), 0.08),),
    posts=(Post((1.5, 0.8), 0.05),),
    shots=(
        Shot("placed", "C", speed=2.0, aim="A", place=HAND),
        Shot("again", "C", speed=1.0, angle=80.0, from_previous=True, place=(0.4, 0.2)),
    ),
)
MOVED = replace(
    SCENE,
    balls=(replace(BALLS[0], position=HAND), BALLS[1]),
    shots=(replace(SCENE.shots[0], place=None),),
)


@pytest.mark.parametrize("solver", ["event-driven", "pymunk", "time-slice"])
def test_a_placed_ball_begins_there(solver: str) -> None:
    dt = {"time-slice": 1e-3}.get(solver)
    placed, moved = (simulate(scene, 1, solver=solver, dt=dt) for scene in (SCENE, MOVED))
    assert placed.final == moved.final
    assert tuple(placed.knots[0][0, 1:3]) == HAND


def test_a_pocketed_ball_comes_back() -> None:
    into = Shot("into the pocket", "C", speed=3.0, angle=0.0, place=(1.6, 0.5))
    runs = list(simulate_all(replace(SCENE, shots=(into, SCENE.shots[1])), solver="event-driven"))
    assert runs[0].pocketed == {"C": "far"}
    assert tuple(runs[1].knots[0][0, 1:3]) == (0.4, 0.2)
    assert not runs[1].end.off


def test_a_file_says_it(tmp_path: Path) -> None:
    scene = loads(PLACE.format("[0.3, 0.6]"))
    assert scene.shots[0].place == HAND
    assert loads(scene.to_toml()) == scene
    assert "place=(0.3, 0.6)" in repr(scene.shots[0])
    inches = loads('[units]\nlength = "in"\n' + PLACE.format("[0.3, 0.6]"))
    assert inches.shots[0].place == (0.3 * 0.0254, 0.6 * 0.0254)


def test_a_place_that_a_ball_has_come_to_is_refused_when_it_is_played() -> None:
    slow = replace(SCENE.shots[0], speed=0.9)
    there = simulate(replace(SCENE, shots=(slow,)), solver="event-driven").final["A"]
    shots = (slow, replace(SCENE.shots[1], place=there))
    with pytest.raises(SceneError, match=r'shot\.place = .*: ball "C" overlaps ball "A"'):
        list(simulate_all(replace(SCENE, shots=shots), solver="event-driven"))


def test_derivatives_by_the_place_are_those_of_shifted_places() -> None:
    names, step = ("x.C", "y.C", "x.A"), 1e-6
    runs = dict(enumerate(simulate_all(SCENE, solver="event-driven"), start=1))
    for k, found in follow(runs, names, aims_anew=True):
        for p, name in enumerate(names):
            own = {"x.C": 0.5, "y.C": 0.5, "x.A": 1.0}[name]
            low, high = (
                list(simulate_all(with_inputs(SCENE, {name: at}), solver="event-driven"))[k - 1]
                for at in (own - step, own + step)
            )
            slope = (np.array(high.end.position) - low.end.position) / (2.0 * step)
            assert found.final[..., p] == pytest.approx(slope, rel=1e-4, abs=1e-4)


def ends(found: Sweep) -> list[tuple[float, ...]]:
    """Return where the balls of the shots of a sweep end (m), from its files."""
    table = pytest.importorskip("pyarrow.parquet").read_table(found.out)
    columns = [table[name].to_pylist() for name in ("x_C", "y_C", "x_A", "y_A")]
    return list(zip(*columns, strict=True))


def test_studies_begin_at_the_place(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    how: dict[str, Any] = {"vary": {"start": 1e-4}, "samples": 50}
    placed, moved = (
        sweep(scene, 1, **how, out=tmp_path / name)
        for name, scene in (("placed", SCENE), ("moved", MOVED))
    )
    assert ends(placed) == ends(moved)
    spread = [sensitivity(scene, 1, Uncertainty(1e-4), samples=20).ends for scene in (SCENE, MOVED)]
    assert (spread[0] == spread[1]).all()


def test_a_search_puts_the_ball_where_it_is_told(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    varied = sweep(
        SCENE, 1, grid={"x.C": (0.2, 0.6, 3), "y.C": (0.3, 0.7, 3)}, out=tmp_path / "grid",
        aims_anew=True,
    )  # fmt: skip
    assert varied.played == 9
    for k, end in enumerate(ends(varied)):
        place = (0.2 + 0.2 * (k // 3), 0.3 + 0.2 * (k % 3))
        shot = replace(SCENE.shots[0], place=place)
        alone = simulate(replace(SCENE, shots=(shot,)), 1, solver="event-driven")
        assert end == pytest.approx(np.ravel(alone.end.position), abs=1e-12)


def test_a_ball_in_hand_is_looked_for_where_there_is_room() -> None:
    """A straight shot pots the ball from behind it alone."""
    lone = replace(SCENE, posts=(), shots=(Shot("pot", "C", speed=2.0, angle=0.0),))

    def pots(batch: Batch) -> NDArray[np.bool_]:
        return np.asarray(batch.pocketed[:, 1] == 0)

    how: dict[str, Any] = {"speed": (1.0, 3.0), "tries": 60_000, "samples": 200, "best": 2}
    found = find(lone, 1, pots, place=((0.2, 1.6), (0.1, 0.9)), **how)
    assert found
    for one in found:
        assert one.shot.place is not None
        assert one.run.pocketed["A"] == "far"
        again = simulate(one.run.scene, one.shot, solver="event-driven")
        assert again.final == one.run.final
    assert found[0].share > find(lone, 1, pots, **how)[0].share


def test_a_search_errs_around_the_place() -> None:
    """Errors of a struck ball's place are around where its shot puts it."""
    seen = []

    def meets(batch: Batch) -> Any:
        seen.append(batch.source.position[:, 0])
        return batch.hits > 0

    errors = {"x.C": 1e-6, "y.C": 1e-6}
    assert find(SCENE, 1, meets, errors=errors, tries=600, samples=10, best=1)
    assert abs(np.concatenate(seen) - HAND).max() < 1e-5
