"""The atlas has one exact shot a pixel, and found shots do what is asked for."""

from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pool_pymunk import (
    Ball,
    Batch,
    Friction,
    Restitution,
    Scene,
    Shot,
    atlas,
    find,
    load,
    simulate,
)
from pool_pymunk.cli import atlas as commands_atlas
from pool_pymunk.model.inputs import with_inputs
from pool_pymunk.render import atlas as drawing
from pool_pymunk.render.atlas import atlas_picture
from pool_pymunk.studies import atlas as maps
from pool_pymunk.studies.atlas import MAPS
from tests.shared.commands import exit_code
from tests.shared.scenes import sliding


def test_every_pixel_is_an_exact_shot() -> None:
    scene = load("report")
    found = atlas(scene, 1, angle=(-10, 20), speed=(2, 5), size=(7, 4), ball="8")
    assert repr(found) == "<Atlas of 28 shots: angle (7) by speed (4)>"
    assert found.angle.tolist() == [-10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0]
    assert found.speed.tolist() == [2.0, 3.0, 4.0, 5.0]
    for row, column in ((0, 0), (2, 2), (3, 6), (1, 4)):
        angle = math.radians(180.0 + found.angle[column])
        speed = found.speed[row]
        shot = Shot("one", "C", velocity=(speed * math.cos(angle), speed * math.sin(angle)))
        run = simulate(replace(scene, shots=(shot,)), solver="event-driven")
        assert found.end[row, column] == pytest.approx(run.final["8"], abs=1e-9)
        assert found.duration[row, column] == pytest.approx(run.duration, abs=1e-9)
        hits = [event.balls for event in run.events if event.kind == "ball-ball"]
        assert found.hits[row, column] == len(hits)
        first = [b if a == "C" else a for a, b in hits if "C" in (a, b)]
        number = scene.index[first[0]] if first else -1
        assert found.first_hit[row, column] == number


@pytest.mark.parametrize("anew", [False, True])
def test_a_shot_is_aimed_once_or_in_each_pixel(anew: bool) -> None:
    scene = load("report")
    axes = {"x.1": (1.0, 1.04), "y.1": (0.5, 0.55)}
    found = atlas(scene, 4, axes=axes, size=(2, 2), ball="C", aims_anew=anew)
    velocity = scene.start(scene.shots[3]).velocity[scene.index["C"]]
    held = Shot("held", "C", velocity=velocity)
    for row, y in enumerate(axes["y.1"]):
        for column, x in enumerate(axes["x.1"]):
            moved = with_inputs(scene, {"x.1": x, "y.1": y})
            moved = replace(moved, shots=(moved.shots[3] if anew else held,))
            end = simulate(moved, solver="event-driven").final["C"]
            assert tuple(found.end[row, column]) == end


def test_a_search_and_derivatives_hold_the_direction_of_an_aimed_shot() -> None:
    scene = load("report")
    aimed, names = replace(scene, shots=scene.shots[3:]), ("x.1", "y.C")
    velocity = scene.start(scene.shots[3]).velocity[scene.index["C"]]
    held = replace(scene, shots=(Shot("held", "C", velocity=velocity),))
    runs = [simulate(one, solver="event-driven", law="coulomb") for one in (aimed, held)]
    one, other = (run.derivatives(names).final for run in runs)
    np.testing.assert_array_equal(one, other)
    how: dict[str, Any] = {
        "speed": (1.0, 2.0), "errors": {"y.1": 0.01}, "tries": 2_000, "samples": 500, "best": 2,
    }  # fmt: skip
    found = [find(each, 1, lambda batch: batch.hits > 1, **how) for each in (aimed, held)]
    assert len(found[0]) == 2
    assert [(f.angle, f.share) for f in found[0]] == [(f.angle, f.share) for f in found[1]]


@pytest.mark.parametrize("axes", [("angle", "speed"), ("speed", "turn"), ("mass", "speed")])
def test_an_axis_of_angles_says_what_they_are_turned_from(
    axes: tuple[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The angles of an atlas are relative, and those of a scenario file are not."""
    drawn: list[Figure] = []
    monkeypatch.setattr(drawing, "save_figure", lambda figure, *_: drawn.append(figure))
    ranges = {"angle": (-1, 1), "turn": (-1, 1), "speed": (2, 3), "mass": (0.1, 0.2)}
    found = atlas(load("report"), 1, axes={axis: ranges[axis] for axis in axes}, size=(2, 2))
    atlas_picture(found, "hits", tmp_path / "atlas.png")
    map_ = drawn[0].axes[0]
    for axis, label in zip(axes, (map_.get_xlabel(), map_.get_ylabel()), strict=True):
        assert label.startswith("turned from the shot's angle (") == (axis in ("angle", "turn"))
        assert "angle of the shot" not in label


def test_the_ball_is_the_aimed_one_or_the_nearest() -> None:
    assert load("report").balls[atlas(load("report"), 1, size=(2, 2)).ball].id == "1"
    scene = load("eight-ball")
    assert scene.balls[atlas(scene, 1, size=(2, 2)).ball].id == "1"


@pytest.mark.parametrize("show", ["end", "first-hit", "hits", "duration", "pocket"])
def test_the_command_draws_it(
    show: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from PIL import Image

    path, scenario = tmp_path / "map.png", tmp_path / "scene.toml"
    scene = sliding("eight-ball") if show == "pocket" else load("report")
    scene.to_toml(scenario)
    line = f"atlas {scenario} --shot 1 --size 120x80 --angle -8:8 --show {show} --out {path}"
    assert exit_code(*line.split()) == 0
    assert capsys.readouterr().out.startswith("9,600 shots in ")
    image = np.asarray(Image.open(path).convert("RGB"))
    assert image.shape[0] > 80
    assert image.shape[1] > 120
    colors = np.unique(image.reshape(-1, 3), axis=0)
    assert len(colors) > 5


@pytest.mark.parametrize("show", MAPS)
def test_an_atlas_for_one_map_has_what_this_map_shows(show: str) -> None:
    scene = sliding("eight-ball")
    how: dict[str, Any] = {"size": (40, 30), "angle": (-8, 8)}
    every, one = atlas(scene, 1, **how), atlas(scene, 1, **how, show=show)
    for name, key in MAPS.items():
        found, whole = getattr(one, key), getattr(every, key)
        if name == show:
            assert np.array_equal(
                found, whole.astype(found.dtype), equal_nan=found.dtype.kind == "f"
            )
            assert found.itemsize == 4
        else:
            assert found.size == 0


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* shots were handed back")  # Their balls roll and press.
@pytest.mark.parametrize("show", ["end", "hits"])
def test_a_map_is_drawn_in_little_memory(show: str, tmp_path: Path) -> None:
    """What is kept of a pixel, its bytes in the picture, and twice those of the whole page."""
    height, width = 1200, 1000
    few = atlas(load("eight-ball"), 1, size=(10, 12), show=show)
    wide: dict[str, Any]
    wide = {key: np.kron(each, np.ones((100, 100, 1)[: each.ndim], each.dtype))
            for key, each in vars(few).items() if key in MAPS.values() and each.size}  # fmt: skip
    angle, speed = np.linspace(-30, 30, width), np.linspace(1, 2, height)
    found = replace(few, angle=angle, speed=speed, **wide)
    tracemalloc.start()
    atlas_picture(found, show, tmp_path / "map.png")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 45 * height * width  # bytes


# -- find ------------------------------------------------------------------------------------------


def few_balls() -> Scene:
    """Return an eight-ball table with four balls on it."""
    scene = sliding("eight-ball")
    places = {"cue": (0.6, 0.4), "8": (1.6, 0.9), "1": (1.1, 0.75), "4": (2.0, 0.35)}
    balls = tuple(replace(b, position=places[b.id]) for b in scene.balls if b.id in places)
    return replace(scene, balls=balls, shots=(Shot("pot", "cue", speed=3.0, aim="8"),))


@pytest.mark.slow
def test_found_shots_do_what_is_wanted_and_forgive_what_they_say() -> None:
    scene = few_balls()
    eight, cue = scene.index["8"], scene.index["cue"]

    def potted(batch: Batch) -> NDArray[np.bool_]:
        return (batch.pocketed[:, eight] >= 0) & (batch.pocketed[:, cue] < 0)

    found = find(scene, 1, potted, tries=30_000, samples=1000, best=3)
    assert len(found) == 3
    assert [one.share for one in found] == sorted((one.share for one in found), reverse=True)
    assert found[0].share > 0.2
    for one in found:
        assert one.run.solver == "event-driven"
        assert "8" in one.run.pocketed
        assert "cue" not in one.run.pocketed
        again = simulate(replace(scene, shots=(one.shot,)), solver="event-driven")
        assert again.pocketed == one.run.pocketed
    rng = np.random.default_rng(9)
    best = found[0]
    wins = 0
    for _ in range(200):
        angle, speed = best.angle + 0.5 * rng.normal(), best.speed + 0.05 * rng.normal()
        shot = Shot("try", "cue", speed=speed, angle=angle)
        run = simulate(replace(scene, shots=(shot,)), solver="event-driven")
        wins += "8" in run.pocketed and "cue" not in run.pocketed
    assert abs(wins / 200 - best.share) < 4 * math.sqrt(best.share * (1 - best.share) / 200)


@pytest.mark.slow
def test_a_shot_is_improved_until_a_ball_ends_where_it_shall() -> None:
    scene, goal = load("report"), (1.0, 0.5)

    def met(batch: Batch) -> NDArray[np.bool_]:
        return np.asarray(batch.met.any(axis=1))

    how: dict[str, Any] = {"tries": 10_000, "samples": 100, "best": 3}
    best, *others = find(scene, 1, met, ends={"C": goal}, **how)
    assert best.off < 1e-12
    assert math.dist(best.run.final["C"], goal) == pytest.approx(best.off, abs=1e-15)
    again = simulate(replace(scene, shots=(best.shot,)), solver="event-driven")
    assert any(event.kind == "ball-ball" and "C" in event.balls for event in again.events)
    assert [one.off for one in (best, *others)] == sorted(one.off for one in (best, *others))
    assert find(scene, 1, met, **how)[0].off == 0.0


@pytest.mark.slow
def test_found_shots_stay_within_the_ranges() -> None:
    scene = load("report")

    def met(batch: Batch) -> NDArray[np.bool_]:
        return np.asarray(batch.met.any(axis=1))

    how: dict[str, Any] = {"tries": 3_000, "samples": 50, "best": 3, "ends": {"C": (0.2, 0.2)}}
    for angle, speed in (((170.0, 180.0), (1.5, 2.0)), ((-180.0, 180.0), (1.0, 2.0)),
                         ((179.0, 180.0), (1.0, 1.01))):  # fmt: skip
        for one in find(scene, 1, met, angle=angle, speed=speed, **how):
            assert angle[0] <= one.angle <= angle[1]
            assert speed[0] <= one.speed <= speed[1]


def test_the_draw_of_a_shot_after_which_the_cue_ball_stays() -> None:
    """Friction of the cloth, 5/2 mu g t, takes just this draw away until the balls meet."""
    balls = (Ball("C", (0.0, 0.0), 0.03, 0.2, cue=True), Ball("1", (0.5, 0.0), 0.03, 0.2))
    scene = Scene(
        balls, restitution=Restitution(1.0), friction=Friction(0.2, rolling=0.02),
        shots=(Shot("straight", "C", speed=1.5, angle=0.0),),
    )  # fmt: skip

    def met(batch: Batch) -> NDArray[np.bool_]:
        return batch.hits > 0

    how: dict[str, Any] = {"angle": (-1, 1), "speed": (1.4, 1.6), "tries": 600, "samples": 10}
    [found] = find(scene, 1, met, roll=(-3, 1), best=1, ends={"C": (0.44, 0.0)}, **how)
    pull, v = 0.2 * scene.physics.gravity, found.speed
    time = (v - math.sqrt(v * v - 2.0 * pull * 0.44)) / pull
    assert found.shot.roll == pytest.approx(-2.5 * pull * time / v, rel=1e-6)
    again = simulate(replace(scene, shots=(found.shot,)), solver="event-driven")
    assert again.final == found.run.final


def test_what_nothing_does_is_an_empty_list() -> None:
    def never(batch: Batch) -> NDArray[np.bool_]:
        return np.zeros(len(batch), dtype=bool)

    assert find(few_balls(), 1, never, tries=1000) == []


def test_an_interrupt_leaves_the_map_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pixel that was not played shows the outcome of one close by that was."""
    done = list[int]()

    def interrupt(count: int) -> None:
        done.append(count)
        if sum(done) > 20:
            raise KeyboardInterrupt

    with pytest.raises(maps.CutShort) as cut:
        maps.atlas(load("report"), 1, size=(9, 7), on_done=interrupt)
    whole, found = maps.atlas(load("report"), 1, size=(9, 7)), cut.value.found
    coarse = whole.end[::2, ::2].repeat(2, axis=0).repeat(2, axis=1)[:7, :9]
    assert found.end.tobytes() == coarse.tobytes()


def test_an_atlas_goes_from_coarse_to_fine_and_plays_each_pixel_once() -> None:
    done, seen = list[int](), list[NDArray[np.floating]]()
    how: dict[str, Any] = {"size": (40, 33), "show": "end"}
    found = maps.atlas(
        load("report"), 1, **how, on_done=done.append,
        on_pass=lambda so_far: seen.append(so_far.end.copy()),
    )  # fmt: skip
    assert sum(done) == 40 * 33
    assert len(seen) == len(maps.STEPS)
    for step, each in zip(maps.STEPS, seen, strict=True):
        assert (each[::step, ::step] == found.end[::step, ::step]).all()
        blocks = np.unique(each.reshape(-1, 2), axis=0)
        assert len(blocks) <= math.ceil(40 / step) * math.ceil(33 / step)


def test_a_long_atlas_has_a_coarse_picture_early(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The picture so far is drawn while the pixels are played, and then the whole one."""
    monkeypatch.setattr(commands_atlas, "EARLY", 0.0)
    path = tmp_path / "map.png"
    line = f"atlas report --shot 1 --size 40x30 --workers 1 --out {path}"
    assert exit_code(*line.split()) == 0
    said = capsys.readouterr()
    assert said.err.splitlines() == [f"the picture so far: {path}"] * len(maps.STEPS)
    assert said.out.startswith("1,200 shots in ")


def test_ctrl_c_keeps_the_picture_of_a_small_atlas(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    kept, play = list[int](), maps._keep

    def interrupt(*about: Any) -> None:
        kept.append(len(about[1]))
        if len(kept) == 4:
            raise KeyboardInterrupt
        play(*about)

    monkeypatch.setattr(maps, "_keep", interrupt)
    path = tmp_path / "map.png"
    line = f"atlas report --shot 1 --size 64x48 --workers 1 --out {path}"
    assert exit_code(*line.split()) == 130
    assert kept[:3] == [12, 36, 144]
    assert path.exists()
