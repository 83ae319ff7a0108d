"""Every input of the table is taken by every study, or refused in one clear line."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Restitution,
    Scene,
    SettingError,
    Shot,
    Table,
    Uncertainty,
    atlas,
    find,
    fit,
    sensitivity,
    simulate,
    simulate_many,
    sweep,
)
from pool_pymunk.model.inputs import BALL, ROWS, SHOT, TABLE, Input, table_lines, with_inputs

needs = pytest.mark.skipif(
    not all(map(find_spec, ("numba", "scipy", "pyarrow"))), reason="an extra is not installed"
)
DOCS = Path(__file__).parents[1] / "docs" / "inputs.md"
STRUCK, OTHER = "C", "1"


def scene() -> Scene:
    """Return a cue ball that meets ball 1, which moves; ball 1 meets ball 2 and a cushion."""
    balls = (
        Ball(STRUCK, (0.5, 0.5), 0.03, 0.2, cue=True),
        Ball(OTHER, (0.9, 0.53), 0.03, 0.17, velocity=(0.05, 0.1)),
        Ball("2", (1.2, 0.66), 0.03, 0.16),
    )
    return Scene(
        balls, Table.rectangle(2.0, 1.0), Restitution(0.9, 0.92, 0.8), Friction(0.03, 0.1, 0.05),
        shots=(Shot("on", STRUCK, speed=2.0, angle=3.0),),
    )  # fmt: skip


NAMES = [
    f"{row.name}.{ball}" if ball else row.name
    for row in ROWS
    for ball in ((STRUCK, OTHER) if row.of == BALL else ("",))
]
OWN = {"speed": 2.0, "angle": 3.0, "turn": 0.0, "vx.C": 2.0 * math.cos(math.radians(3.0)),
       "vy.C": 2.0 * math.sin(math.radians(3.0))}  # fmt: skip


def own(name: str) -> float:
    """Return the number of the scene, as the shot begins."""
    if name in OWN:
        return OWN[name]
    kind, _, whose = name.partition(".")
    row = TABLE.get(name) or TABLE[kind]
    part = scene().balls[scene().index[whose]] if row.of == BALL else getattr(scene(), row.group)
    return row.read(part)


def played(name: str, value: float) -> Any:
    """Return where the balls end with another number, played by itself."""
    table, kind = scene(), name.partition(".")[0]
    if kind in ("vx", "vy"):
        state = table.start(table.shots[0])
        i, axis = table.index[name[3:]], "xy".index(name[1])
        velocity = [list(v) for v in state.velocity]
        velocity[i][axis] = value
        alone, start = replace(table, shots=()), (state.position, velocity)
        return np.array(simulate(alone, solver="event-driven", start=start).end.position)
    numbered = f"{name}.1" if name in TABLE and TABLE[name].of == SHOT else name
    changed = with_inputs(table, {numbered: value})
    return np.array(simulate(changed, 1, solver="event-driven").end.position)


def by_derivatives(name: str, folder: Path) -> None:
    run = simulate(scene(), 1, solver="event-driven")
    found = run.derivatives(name).final[..., 0]
    step = 1e-6
    slope = (played(name, own(name) + step) - played(name, own(name) - step)) / (2.0 * step)
    np.testing.assert_allclose(found, slope, rtol=1e-4, atol=1e-6)


def by_fit(name: str, folder: Path) -> None:
    numbered = f"{name}.1" if name in TABLE and TABLE[name].of == SHOT else name
    true = own(name) + 0.001 * max(abs(own(name)), 0.1)
    ends = played(name, true).tolist()
    rows = [(1, id_, *end) for id_, end in zip(scene().index, ends, strict=True)]
    found = fit(scene(), rows, numbered, starts=1)
    assert found.values[numbered] == pytest.approx(true, rel=1e-6)


def by_batch(name: str, folder: Path) -> None:
    start = scene().start(scene().shots[0])
    values = [own(name), own(name) + 0.01]
    batch = simulate_many(scene(), start.position, start.velocity, vary={name: values})
    for k, value in enumerate(values):
        np.testing.assert_allclose(batch.final[k], played(name, value), atol=1e-9)
        np.testing.assert_array_equal(batch.run(k).end.position, batch.final[k])


def by_sweep(name: str, folder: Path) -> None:
    from pyarrow import dataset

    low = 0.0 if name == "angle" else own(name)  # It is relative to the shot's.
    sweep(scene(), 1, vary={name: (low, low + 0.01)}, samples=3, out=folder)
    table = dataset.dataset(folder, format="parquet").to_table()
    column = name.replace(".", "_")
    values = table[f"start_{column}" if name[:2] in ("x.", "y.") else column].to_pylist()
    assert len(set(values)) == 3 and all(low <= value <= low + 0.01 for value in values)
    for k, value in enumerate(values):
        end = [
            (table[f"x_{id_}"][k].as_py(), table[f"y_{id_}"][k].as_py()) for id_ in scene().index
        ]
        np.testing.assert_allclose(
            end, played(name, value + 3.0 * (name == "angle")), atol=1e-9
        )  # fmt: skip


def by_atlas(name: str, folder: Path) -> None:
    low = 0.0 if name == "angle" else own(name)
    other = "friction.surface" if name in ("speed", "vx.C", "vy.C") else "speed"
    axes = {name: (low, low + 0.01), other: (own(other), own(other) + 0.01)}
    found = atlas(scene(), 1, axes=axes, size=(3, 2), ball=OTHER)
    for k, value in enumerate(found.angle.tolist()):
        end = played(name, value + 3.0 * (name == "angle"))[1]
        np.testing.assert_allclose(found.end[0, k], end, atol=1e-9)


def by_find(name: str, folder: Path) -> None:
    def meets(batch: Any) -> Any:
        return batch.first_hit == 1

    how: dict[str, Any] = {"angle": (0.0, 6.0), "tries": 600, "best": 1}
    how["samples"] = 10 if name.startswith("radius") else 50
    [exact] = find(scene(), 1, meets, **how)
    [found] = find(scene(), 1, meets, **how, errors={name: 1e-9})
    assert found.share == pytest.approx(exact.share, abs=0.1)
    width = 0.2 if name[0] in "xy" else 1e-3
    [doubtful] = find(scene(), 1, meets, **how, errors={name: width})
    if name == "y.1":
        assert doubtful.share < 0.8 * exact.share


def by_sensitivity(name: str, folder: Path) -> None:
    errors = Uncertainty(inputs={name: 1e-5})
    found = sensitivity(scene(), 1, errors, 200)
    slopes = found.reference.derivatives(name).final[..., 0]
    std = np.array([ball.std for ball in found.balls])
    np.testing.assert_allclose(std, np.abs(slopes) * 1e-5 / math.sqrt(3.0), rtol=0.1, atol=1e-9)
    assert std.max() > 0.0


OF_THE_SHOT = "the ball is struck, so its velocity is that of the shot: speed and angle"
# Each study, and the inputs that it refuses, with the end of its line.
STUDIES: dict[str, tuple[Callable[[str, Path], None], dict[str, str]]] = {
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


@needs
@pytest.mark.heavy
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("study", STUDIES)
def test_every_study_takes_every_input_or_says_why_not(
    study: str, name: str, tmp_path: Path
) -> None:
    takes, refused = STUDIES[study]
    if name not in refused:
        takes(name, tmp_path / "out")
        return
    with pytest.raises(SettingError) as caught:
        takes(name, tmp_path / "out")
    line = str(caught.value)
    assert line.endswith(refused[name]) and name in line and "\n" not in line


@pytest.mark.parametrize(
    ("ask", "key"),
    [
        (lambda name: simulate(scene(), 1, solver="event-driven").derivatives(name), "wrt"),
        (lambda name: fit(scene(), [(1, "C", 0.5, 0.5)], name), "free"),
        (lambda name: simulate_many(scene(), vary={name: [1.0]}), "vary"),
        (lambda name: sweep(scene(), 1, vary={name: (0, 1)}, samples=1, out="none"), "vary"),
        (lambda name: atlas(scene(), 1, axes={name: (0, 1), "speed": (1, 2)}), "axes"),
        (lambda name: find(scene(), 1, lambda batch: batch.hits > 0, errors={name: 1.0}), "errors"),
        (lambda name: sensitivity(scene(), 1, Uncertainty(inputs={name: 1.0})), "inputs"),
    ],
    ids=list(STUDIES),
)
@pytest.mark.parametrize("name", ["mass.Z", "spin.C", "speed.C.1", "restitution"])
@needs
def test_other_names_are_refused_in_one_line(
    ask: Callable[[str], object], key: str, name: str
) -> None:
    if name == "restitution" and key in ("wrt", "free"):
        return  # It is a group.
    with pytest.raises(SettingError, match=f"^{key} = {name}: there is no such [^\\n]*$"):
        ask(name)


@needs
def test_old_names_keep_their_meanings() -> None:
    start = scene().start(scene().shots[0])
    both = simulate_many(scene(), start.position, start.velocity, vary={"mass": [0.3]})
    each = {f"mass.{id_}": [0.3] for id_ in scene().index}
    same = simulate_many(scene(), start.position, start.velocity, vary=each)
    np.testing.assert_array_equal(both.final, same.final)


def test_two_names_of_one_input_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    for one, other in (("mass", "mass.C"), ("angle", "turn")):
        with pytest.raises(SettingError, match=f"vary = {other}: means the same as {one}"):
            sweep(scene(), 1, vary={one: (1, 2), other: (1, 2)}, samples=1, out=tmp_path / "no")


def test_the_documentation_has_the_table() -> None:
    assert "\n".join(table_lines()) in DOCS.read_text(encoding="utf-8")


def test_columns_of_a_batch_are_each_there_once() -> None:
    columns = [row.column for row in ROWS if row.column is not None]
    assert len(set(columns)) == len(columns)
    assert all(isinstance(row, Input) for row in ROWS)
