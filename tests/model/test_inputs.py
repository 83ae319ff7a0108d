"""Every input of the table is taken by every study, or refused in one clear line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Scene,
    SettingError,
    Shot,
    State,
    Table,
    Uncertainty,
    atlas,
    find,
    fit,
    sensitivity,
    simulate,
    simulate_all,
    simulate_many,
    sweep,
)
from pool_pymunk.model.inputs import BALL, ROWS, SHOT, SI, TABLE, Input, with_inputs
from pool_pymunk.studies.derivatives import follow
from tests import ROOT

needs = pytest.mark.skipif(
    not all(map(find_spec, ("scipy", "pyarrow"))), reason="an extra is not installed"
)
DOCS = ROOT / "docs" / "inputs.md"
STRUCK, OTHER = "C", "1"


def scene(rolls: bool = False) -> Scene:
    """Return a cue ball that meets ball 1, which moves; ball 1 meets ball 2 and a cushion."""
    balls = (
        Ball(STRUCK, (0.5, 0.5), 0.03, 0.2, cue=True),
        Ball(OTHER, (0.9, 0.53), 0.03, 0.17, velocity=(0.05, 0.1), roll=0.5 * rolls),
        Ball("2", (1.2, 0.66), 0.03, 0.16),
    )
    friction = Friction(0.2, 0.1, 0.05, 0.02) if rolls else Friction(0.03, 0.1, 0.05)
    return Scene(
        balls, Table.rectangle(2.0, 1.0), Restitution(0.9, 0.92, 0.8), friction,
        shots=(Shot("on", STRUCK, speed=2.0, angle=3.0, roll=0.4 * rolls),),
    )  # fmt: skip


ROLLING = ("roll", "friction.rolling")
NAMES = [
    f"{row.name}.{ball}" if ball else row.name
    for row in ROWS
    for ball in ((STRUCK, OTHER) if row.of == BALL else ("",))
    if row.name not in ROLLING
]
SLIDES, ROLLS = scene(), scene(rolls=True)
CASES = [(name, SLIDES) for name in NAMES]
# Where balls roll, their rolls go with their velocities.
CASES += [(name, ROLLS) for name in (*ROLLING, "speed", "turn", "vx.1")]
OWN = {"speed": 2.0, "angle": 3.0, "turn": 0.0, "vx.C": 2.0 * math.cos(math.radians(3.0)),
       "vy.C": 2.0 * math.sin(math.radians(3.0)), "roll": 0.4}  # fmt: skip


def own(name: str, table: Scene = SLIDES) -> float:
    """Return the number of the scene, as the shot begins."""
    if name in OWN:
        return OWN[name]
    kind, _, whose = name.partition(".")
    row = TABLE.get(name) or TABLE[kind]
    part = table.balls[table.index[whose]] if row.of == BALL else getattr(table, row.group)
    return row.read(part)


def played(table: Scene, name: str, value: float) -> Any:
    """Return where the balls end with another number, played by itself."""
    kind = name.partition(".")[0]
    if kind in ("vx", "vy"):
        state = table.start(table.shots[0])
        i, axis = table.index[name[3:]], "xy".index(name[1])
        velocity = [list(v) for v in state.velocity]
        velocity[i][axis] = value
        rolls = [list(w) for w in state.roll or ()]
        if rolls:
            rolls[i][axis] = table.balls[i].roll * value
        alone = replace(table, shots=())
        start = State(state.position, velocity, state.off, rolls or None)  # type: ignore[arg-type]
        return np.array(simulate(alone, solver="event-driven", start=start).end.position)
    numbered = f"{name}.1" if name in TABLE and TABLE[name].of == SHOT else name
    changed = with_inputs(table, {numbered: value})
    return np.array(simulate(changed, 1, solver="event-driven").end.position)


def by_derivatives(table: Scene, name: str, folder: Path) -> None:
    run = simulate(table, 1, solver="event-driven")
    found = run.derivatives(name).final[..., 0]
    step = 1e-6
    slope = (
        played(table, name, own(name, table) + step) - played(table, name, own(name, table) - step)
    ) / (2.0 * step)
    np.testing.assert_allclose(found, slope, rtol=1e-4, atol=1e-6)


def by_fit(table: Scene, name: str, folder: Path) -> None:
    numbered = f"{name}.1" if name in TABLE and TABLE[name].of == SHOT else name
    true = own(name, table) + 0.001 * max(abs(own(name, table)), 0.1)
    ends = played(table, name, true).tolist()
    rows = [(1, id_, *end) for id_, end in zip(table.index, ends, strict=True)]
    found = fit(table, rows, numbered, starts=1)
    assert found.values[numbered] == pytest.approx(true, rel=1e-6)


def by_batch(table: Scene, name: str, folder: Path) -> None:
    start = table.start(table.shots[0])
    values = [own(name, table), own(name, table) + 0.01]
    batch = simulate_many(table, start.position, start.velocity, vary={name: values})
    for k, value in enumerate(values):
        np.testing.assert_allclose(batch.final[k], played(table, name, value), atol=1e-9)
        np.testing.assert_array_equal(batch.run(k).end.position, batch.final[k])


def by_sweep(table: Scene, name: str, folder: Path) -> None:
    from pyarrow import dataset

    low = 0.0 if name == "angle" else own(name, table)  # It is relative to the shot's.
    sweep(table, 1, vary={name: (low, low + 0.01)}, samples=3, out=folder)
    found = dataset.dataset(folder, format="parquet").to_table()
    column = name.replace(".", "_")
    values = found[f"start_{column}" if name[:2] in ("x.", "y.") else column].to_pylist()
    assert len(set(values)) == 3 and all(low <= value <= low + 0.01 for value in values)
    for k, value in enumerate(values):
        end = [(found[f"x_{id_}"][k].as_py(), found[f"y_{id_}"][k].as_py()) for id_ in table.index]
        np.testing.assert_allclose(
            end, played(table, name, value + 3.0 * (name == "angle")), atol=1e-9
        )  # fmt: skip


def by_atlas(table: Scene, name: str, folder: Path) -> None:
    low = 0.0 if name == "angle" else own(name, table)
    other = "friction.surface" if name in ("speed", "vx.C", "vy.C") else "speed"
    axes = {name: (low, low + 0.01), other: (own(other, table), own(other, table) + 0.01)}
    found = atlas(table, 1, axes=axes, size=(3, 2), ball=OTHER)
    for k, value in enumerate(found.angle.tolist()):
        end = played(table, name, value + 3.0 * (name == "angle"))[1]
        np.testing.assert_allclose(found.end[0, k], end, atol=1e-9)


def by_find(table: Scene, name: str, folder: Path) -> None:
    def meets(batch: Any) -> Any:
        return batch.first_hit == 1

    how: dict[str, Any] = {"angle": (0.0, 6.0), "tries": 600, "best": 1}
    how["samples"] = 10 if name.startswith("radius") or table is ROLLS else 50
    if table is ROLLS:  # They are played in Python, so few of them are.
        how |= {"angle": (2.5, 3.5), "speed": (1.95, 2.05)}
    [exact] = find(table, 1, meets, **how)
    [found] = find(table, 1, meets, **how, errors={name: 1e-9})
    assert found.share == pytest.approx(exact.share, abs=0.1)
    if table is ROLLS:
        assert found.shot.roll == 0.4
        return
    width = 0.2 if name[0] in "xy" else 1e-3
    [doubtful] = find(table, 1, meets, **how, errors={name: width})
    if name == "y.1":
        assert doubtful.share < 0.8 * exact.share


def by_sensitivity(table: Scene, name: str, folder: Path) -> None:
    errors = Uncertainty(inputs={name: 1e-5})
    found = sensitivity(table, 1, errors, 200)
    slopes = found.reference.derivatives(name).final[..., 0]
    std = np.array([ball.std for ball in found.balls])
    np.testing.assert_allclose(std, np.abs(slopes) * 1e-5 / math.sqrt(3.0), rtol=0.1, atol=1e-9)
    assert std.max() > 0.0


OF_THE_SHOT = "the shot gives the velocity of its ball: write speed or angle instead"
# Each study, and the inputs that it refuses, with the end of its line.
STUDIES: dict[str, tuple[Callable[[Scene, str, Path], None], dict[str, str]]] = {
    "derivatives": (by_derivatives, {}),
    "fit": (by_fit, dict.fromkeys(
        ("vx.C", "vy.C"), "ball C is struck, so its velocity is that of the shot: speed and angle"
    )),
    "simulate_many": (by_batch, {}),
    "sweep": (by_sweep, {}),
    "atlas": (by_atlas, {}),
    "find": (by_find, dict.fromkeys(("vx.C", "vy.C"), OF_THE_SHOT) | {
        "speed": "is the player's: give it as speed_error",
        "angle": "is the player's: give it as angle_error",
        "turn": "is the player's: give it as angle_error",
    }),
    "sensitivity": (by_sensitivity, dict.fromkeys(("vx.C", "vy.C"), OF_THE_SHOT)),
}  # fmt: skip


def some_slow() -> Iterator[Any]:
    """Yield each study with each input; a fit and a sweep of a few inputs are quick."""
    for study in STUDIES:
        for k, (name, on) in enumerate(CASES):
            is_slow = study == "find" or (study in ("fit", "sweep") and k % 4 > 0)
            marks, how = [pytest.mark.slow] * is_slow, "-rolls" * (on is ROLLS)
            yield pytest.param(study, name, on, marks=marks, id=f"{study}-{name}{how}")


@needs
@pytest.mark.parametrize(("study", "name", "table"), [*some_slow()])
def test_every_study_takes_every_input_or_says_why_not(
    study: str, name: str, table: Scene, tmp_path: Path
) -> None:
    takes, refused = STUDIES[study]
    if name not in refused:
        takes(table, name, tmp_path / "out")
        return
    with pytest.raises(SettingError) as caught:
        takes(table, name, tmp_path / "out")
    line = str(caught.value)
    assert line.endswith(refused[name]) and name in line and "\n" not in line


@needs
def test_rolls_are_carried_on_to_the_next_shot() -> None:
    more = Shot("more", STRUCK, speed=1.0, aim="2", roll=-0.5, from_previous=True)
    table = replace(ROLLS, physics=Physics(max_time=0.8), shots=(*ROLLS.shots, more))
    run = simulate(table, 2, solver="event-driven")
    found = atlas(
        table, 2, axes={"roll": (-0.5, 0.5), "speed": (1.0, 2.0)}, size=(2, 2), ball=OTHER
    )
    np.testing.assert_array_equal(found.end[0, 0], run.final[OTHER])
    errors = Uncertainty(inputs={"roll": 1e-4})  # of both shots
    std = [ball.std for ball in sensitivity(table, 2, errors, 400).balls]
    runs = dict(enumerate(simulate_all(table, solver="event-driven"), start=1))
    *_, (_, slopes) = follow(runs, ("roll.1", "roll.2"))
    expected = np.hypot(*np.moveaxis(slopes.final, -1, 0)) * 1e-4 / math.sqrt(3.0)
    np.testing.assert_allclose(std, expected, rtol=0.1)


def test_frictions_that_bound_each_other_are_put_together() -> None:
    for surface, rolling in ((0.01, 0.005), (0.5, 0.4)):
        found = with_inputs(ROLLS, {"friction.surface": surface, "friction.rolling": rolling})
        assert (found.friction.surface, found.friction.rolling) == (surface, rolling)


@needs
def test_a_shot_whose_place_moves_with_its_ball_keeps_its_other_new_inputs() -> None:
    shot = Shot("in hand", STRUCK, speed=2.0, angle=3.0, place=(0.25, 0.75))
    table = replace(SLIDES, shots=(*SLIDES.shots, shot))
    found = with_inputs(table, {"y.C": 0.625, "speed.2": 1.5, "angle.1": 4.0})
    assert found.balls[0].position == (0.5, 0.625)
    assert found.shots[1] == replace(shot, speed=1.5, place=(0.25, 0.875))
    assert found.shots[0] == replace(SLIDES.shots[0], angle=4.0)


def test_old_names_keep_their_meanings() -> None:
    start = scene().start(scene().shots[0])
    both = simulate_many(scene(), start.position, start.velocity, vary={"mass": [0.3]})
    each = {f"mass.{id_}": [0.3] for id_ in scene().index}
    same = simulate_many(scene(), start.position, start.velocity, vary=each)
    np.testing.assert_array_equal(both.final, same.final)


def test_the_documentation_has_the_table() -> None:
    lines = ["| name | what it is | unit | group | values |", "|---|---|---|---|---|"]
    for row in ROWS:
        name, limits = row.name + ".ID" * (row.of == BALL), row.limits.removeprefix("must be ")
        lines.append(f"| `{name}` | {row.about} | {SI[row.quantity]} | `{row.group}` | {limits} |")
    assert "\n".join(lines) in DOCS.read_text(encoding="utf-8")


def test_columns_of_a_batch_are_each_there_once() -> None:
    columns = [row.column for row in ROWS if row.column is not None]
    assert len(set(columns)) == len(columns)
    assert all(isinstance(row, Input) for row in ROWS)
