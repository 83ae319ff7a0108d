"""Sweeps: every shot once, the same bits whoever plays it, and on from where it was."""

from __future__ import annotations

import errno
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pool_pymunk
from pool_pymunk import Scene, SettingError, load, simulate, sweep
from pool_pymunk.studies.sweep import job
from pool_pymunk.studies.sweep.job import Done
from pool_pymunk.studies.sweep.plan import Plan, as_begun, make_plan
from tests.shared.commands import exit_code, refusal, without_remarks
from tests.shared.scenes import AT_A_TERMINAL, share_of, sliding, takes_long

pytestmark = pytest.mark.skipif(find_spec("pyarrow") is None, reason="pyarrow is not installed")
INCH = 0.0254
VARY: dict[str, Any] = {"angle": (-5, 5), "speed": (1, 6), "start": 0.005 * INCH}


def read(folder: Path) -> Any:
    """Return the dataset as any reader has it, its rows in the shots' order."""
    dataset = import_module("pyarrow.dataset").dataset(folder, format="parquet")
    return dataset.to_table().sort_by("shot")


def same(one: Path, other: Path) -> bool:
    """Tell whether two datasets have the same rows, to the last bit."""
    a, b = read(one), read(other)
    return bool(a.equals(b))


def plan(scene: Scene | None = None, shot: int | None = 1, **said: Any) -> Plan:
    how: dict[str, Any] = {
        "vary": VARY, "grid": None, "samples": 100, "seed": 0, "chunk": 30,
    }  # fmt: skip
    of_shot = {"law": None} | {key: said.pop(key) for key in ("law", "aims_anew") if key in said}
    return make_plan(as_begun(scene or load("report"), shot, **of_shot), **(how | said))


# -- inputs ----------------------------------------------------------------------------------------


def test_what_is_varied_lies_in_its_range() -> None:
    every: dict[str, Any] = {
        "speed": (1, 2), "angle": (-30, 10), "mass": (0.1, 0.4), "restitution.cushion": (0.5, 0.6),
        "friction.surface": (0.1, 0.2), "noise.speed": 0.1, "noise.angle": 2.0, "start": 1e-4,
    }  # fmt: skip
    found = plan(vary=every).draw(range(1000))
    scene = load("report")
    cue = scene.index["C"]
    for key in ("speed", "angle", "mass", "restitution.cushion", "friction.surface"):
        low, high = every[key]
        column = found.columns[key.replace(".", "_")]
        assert low <= column.min() < low + 0.02 * (high - low)
        assert high - 0.02 * (high - low) < column.max() <= high
    speed = found.columns["speed"] + found.columns["noise_speed"]
    np.testing.assert_allclose(np.hypot(*found.velocity[:, cue].T), speed, rtol=1e-12)
    turned = np.degrees(np.arctan2(*-found.velocity[:, cue, ::-1].T))  # the shot goes along -x
    np.testing.assert_allclose(
        turned, found.columns["angle"] + found.columns["noise_angle"], atol=1e-9
    )
    assert abs(found.columns["noise_angle"].std() - 2.0) < 0.2
    np.testing.assert_array_equal(found.vary["mass.C"], found.columns["mass"])
    assert found.vary.keys() == {"mass.C", "restitution.cushion", "friction.surface"}
    moved = found.position - np.array([ball.position for ball in scene.balls])
    assert np.abs(moved).max() <= 1e-4


@pytest.mark.parametrize("key", ["start", "y.1"])
def test_an_aimed_shot_is_aimed_once(key: str) -> None:
    """A speed or a turn changes this one direction."""
    scene = load("eight-ball")
    cue, vary = scene.index["cue"], {key: 1e-3 if key == "start" else (0.63, 0.64)}
    own = np.array(scene.start(scene.shots[0]).velocity[cue])
    found = plan(scene, vary=vary).draw(range(50))
    assert (found.velocity[:, cue] == own).all()
    turned = plan(scene, vary={**vary, "turn": (90.0, 90.0), "speed": (2.0, 2.0)}).draw(range(50))
    expected = 2.0 * np.array([-own[1], own[0]]) / np.hypot(*own)
    np.testing.assert_allclose(turned.velocity[:, cue], np.tile(expected, (50, 1)), atol=1e-12)


def test_an_aimed_shot_may_aim_at_where_the_ball_is() -> None:
    scene = load("eight-ball")
    found = plan(scene, vary={"start": 1e-3}, aims_anew=True).draw(range(50))
    cue, target = scene.index["cue"], scene.index["1"]
    offset = found.position[:, target] - found.position[:, cue]
    velocity = found.velocity[:, cue]
    cross = offset[:, 0] * velocity[:, 1] - offset[:, 1] * velocity[:, 0]
    np.testing.assert_allclose(cross, 0.0, atol=1e-12)


# -- the dataset -----------------------------------------------------------------------------------


def test_the_dataset_has_every_shot_as_the_exact_solver_plays_it(tmp_path: Path) -> None:
    scene = sliding("eight-ball")
    done: list[Done] = []
    found = sweep(
        scene, 1, vary={"speed": (4, 8), "start": 1e-4}, samples=50, chunk=20, out=tmp_path,
        on_done=done.append,
    )  # fmt: skip
    assert (found.shots, found.played) == (50, 50)
    assert [each.shots for each in done] == [0, 20, 20, 10]
    table = read(tmp_path)
    assert table["shot"].to_pylist() == list(range(50))
    inputs = plan(scene, vary={"speed": (4, 8), "start": 1e-4}, samples=50).draw(range(50))
    for k in (0, 19, 20, 49):
        row = {name: table[name][k].as_py() for name in table.column_names}
        places = tuple(map(tuple, inputs.position[k].tolist()))
        speeds = tuple(map(tuple, inputs.velocity[k].tolist()))
        run = simulate(
            Scene(**{**vars_of(scene), "shots": ()}),
            solver="event-driven",
            start=[places, speeds],
        )
        assert row["speed"] == inputs.columns["speed"][k]
        assert (row["start_x_cue"], row["start_y_cue"]) == places[scene.index["cue"]]
        for ball in scene.balls:
            assert (row[f"x_{ball.id}"], row[f"y_{ball.id}"]) == run.final[ball.id]
            hole = run.pocketed.get(ball.id)
            number = -1 if hole is None else [p.id for p in scene.pockets].index(hole)
            assert row[f"pocketed_{ball.id}"] == number
        assert row["duration"] == run.duration
        assert row["status"] == 0
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units["x_8"] == units["start_x_8"] == "m"
    assert (units["speed"], units["duration"], units["shot"]) == ("m/s", "s", "")


def vars_of(scene: Scene) -> dict[str, Any]:
    return {name: getattr(scene, name) for name in scene.__dataclass_fields__}


def test_all_but_finished_parts_begins_with_a_mark(tmp_path: Path) -> None:
    sweep(load("report"), 1, vary=VARY, samples=50, chunk=20, out=tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"_manifest.parquet", *(f"part-{k:08d}.parquet" for k in range(3))}
    said = job.read_manifest(tmp_path)
    assert said["samples"] == 50
    assert said["vary"]["angle"] == [-5.0, 5.0]
    assert "[[balls]]" in said["scene"]


@pytest.mark.parametrize("reader", ["pandas", "polars", "duckdb", "pyarrow"])
def test_any_reader_takes_the_folder(tmp_path: Path, reader: str) -> None:
    library = pytest.importorskip(reader)
    sweep(load("report"), 1, vary=VARY, samples=50, chunk=20, out=tmp_path)
    if reader == "pandas" or reader == "polars":
        count = len(library.read_parquet(tmp_path))
    elif reader == "duckdb":
        count = len(library.sql(f"SELECT * FROM '{tmp_path}/*.parquet'").fetchall())
    else:
        count = len(read(tmp_path))
    assert count == 50


def test_a_manifest_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / job.MANIFEST).write_bytes(b"no Parquet")
    with pytest.raises(SettingError, match=r"_manifest\.parquet cannot be read: begin anew"):
        sweep(load("report"), 1, vary=VARY, samples=50, out=tmp_path)


@pytest.mark.slow
def test_chunks_and_executors_do_not_matter(tmp_path: Path) -> None:
    how: dict[str, Any] = {"vary": VARY, "samples": 500}
    sweep(load("report"), 1, **how, out=tmp_path / "one")
    sweep(load("report"), 1, **how, out=tmp_path / "other", chunk=37)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        sweep(load("report"), 1, **how, out=tmp_path / "third", chunk=100, workers=executor)
    assert same(tmp_path / "one", tmp_path / "other")
    assert same(tmp_path / "one", tmp_path / "third")


def test_it_goes_on_where_it_was(tmp_path: Path) -> None:
    how: dict[str, Any] = {"vary": VARY, "samples": 200, "chunk": 50}
    sweep(load("report"), 1, **how, out=tmp_path / "whole")
    folder = tmp_path / "cut"
    sweep(load("report"), 1, **how, out=folder)
    (folder / "part-00000001.parquet").unlink()
    cut = folder / "part-00000002.parquet"
    cut.write_bytes(cut.read_bytes()[:-100])
    (folder / ".part-00000003-abc.parquet").write_bytes(b"half")
    found = sweep(load("report"), 1, **how, out=folder)
    assert found.played == 100
    assert same(folder, tmp_path / "whole")
    assert not list(folder.glob(".part-*"))
    assert sweep(load("report"), 1, **how, out=folder).played == 0
    assert sweep(load("report"), 1, **how, out=folder, resume=False).played == 200


def test_more_samples_go_on_with_it(tmp_path: Path) -> None:
    """Only the last part, which was smaller than the others, is played again."""
    how: dict[str, Any] = {"vary": VARY, "chunk": 50}
    sweep(load("report"), 1, **how, samples=220, out=tmp_path / "whole")
    folder = tmp_path / "grown"
    assert sweep(load("report"), 1, **how, samples=120, out=folder).played == 120
    assert sweep(load("report"), 1, **how, samples=220, out=folder).played == 120
    assert job.read_manifest(folder)["samples"] == 220
    assert same(folder, tmp_path / "whole")


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"seed": 1}, r"another seed \(0\)"),
        ({"law": "coulomb"}, "another (scene|law)"),
        ({"vary": {"angle": (-5, 6)}}, "another vary"),
        ({"samples": 199}, r"other samples \(200\)"),
        ({"samples": 201, "seed": 1}, r"another seed \(0\)"),
        ({"chunk": 10}, r"another chunk \(50\)"),
        ({"shot": 2}, "another shot"),
        ({"aims_anew": True}, "another shot"),
    ],
)
def test_another_sweep_is_refused(tmp_path: Path, change: dict[str, Any], word: str) -> None:
    how: dict[str, Any] = {"shot": 4, "vary": VARY, "samples": 200, "chunk": 50}
    scene = load("report")
    sweep(scene, **how, out=tmp_path)
    with pytest.raises(SettingError, match=f"has a sweep with {word}.*: begin anew with resume=F"):
        sweep(scene, **(how | change), out=tmp_path)


def test_the_command_names_its_own_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = f"sweep report --shot 1 --vary angle=-5:5 --samples 5 --out {tmp_path}"
    assert exit_code(*line.split()) == 0
    capsys.readouterr()
    said = refusal(capsys, *line.split(), "--seed", 1)
    assert said.rstrip().endswith("another seed (0): begin anew with --restart")


def test_another_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep(load("report"), 1, vary=VARY, samples=10, out=tmp_path)
    monkeypatch.setattr(pool_pymunk, "__version__", "99.0")
    with pytest.raises(SettingError, match="has a sweep with another version"):
        sweep(load("report"), 1, vary=VARY, samples=10, out=tmp_path)


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    for resume in (True, False):
        with pytest.raises(SettingError, match=r"no sweep has written, such as notes\.txt"):
            sweep(load("report"), 1, vary=VARY, samples=10, out=tmp_path, resume=resume)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_full_disk_keeps_what_was_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write: Callable[..., None] = job.os.fsync  # type: ignore[attr-defined]
    calls: list[int] = []

    def full(handle: int) -> None:
        calls.append(handle)
        if len(calls) > 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(handle)

    monkeypatch.setattr(os, "fsync", full)
    monkeypatch.setitem(sweep.__kwdefaults__, "chunk", 20)  # type: ignore[arg-type]
    line = f"sweep report --shot 1 --vary angle=-5:5 --samples 90 --out {tmp_path}"
    assert exit_code(*line.split()) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert "No space left" in said
    assert len(said.splitlines()) == 1
    assert sorted(path.name[0] for path in tmp_path.iterdir()) == ["_", "p", "p"]
    monkeypatch.undo()
    monkeypatch.setitem(sweep.__kwdefaults__, "chunk", 20)  # type: ignore[arg-type]
    assert exit_code(*line.split()) == 0
    assert "50 played" in capsys.readouterr().out


def test_the_command_plays_units_and_grids(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = "sweep report --shot 1 --vary start=0.005in --vary noise.speed=0.1 --grid angle=-1:1:5"
    assert exit_code(*line.split(), "--out", tmp_path, "--workers", 1) == 0
    assert capsys.readouterr().out.startswith(f"5 shots in {tmp_path}: 5 played in ")
    table = read(tmp_path)
    assert table["angle"].to_pylist() == [-1.0, -0.5, 0.0, 0.5, 1.0]
    ball = load("report").balls[1]
    assert abs(table[f"start_x_{ball.id}"][0].as_py() - ball.position[0]) <= 0.005 * INCH


# -- killed and gone on with -----------------------------------------------------------------------

IN_SMALL_PARTS = """
import sys
from pool_pymunk.cli import main
from pool_pymunk.studies.sweep import sweep

sweep.__kwdefaults__["chunk"] = 2000
main(sys.argv[1:])
"""
COMMAND = [
    sys.executable, "-c", IN_SMALL_PARTS, "sweep", "report", "--shot", "1", "--vary", "angle=-5:5",
    "--vary", "speed=1:6", "--vary", "start=0.005in", "--samples", "60000",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_killed_again_and_again_it_has_every_shot_once(tmp_path: Path) -> None:
    rnd = random.Random(5)
    alone, killed = tmp_path / "alone", tmp_path / "killed"
    subprocess.run([*COMMAND, "--out", str(alone)], check=True, capture_output=True)
    for _ in range(share_of(10, 3)):
        process = subprocess.Popen([*COMMAND, "--out", str(killed)], stdout=subprocess.DEVNULL)
        time.sleep(rnd.uniform(0.5, 1.2))
        process.send_signal(signal.SIGKILL)
        process.wait()
    subprocess.run([*COMMAND, "--out", str(killed)], check=True, capture_output=True)
    assert same(alone, killed)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to one process")
def test_an_interrupt_keeps_what_was_finished(tmp_path: Path) -> None:
    command = [*COMMAND, "--out", str(tmp_path)]
    command[command.index("60000")] = "3000000"
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=AT_A_TERMINAL)
    while not list(tmp_path.glob("part-*")):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=20)
    assert process.returncode == 130
    assert without_remarks(said) == "error: interrupted\n"
    assert len(read(tmp_path)) % 2000 == 0


@pytest.mark.slow
@pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed")
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_with_a_killed_worker_has_every_shot_once(tmp_path: Path) -> None:
    distributed = import_module("distributed")
    how: dict[str, Any] = {"vary": VARY, "samples": 20_000, "chunk": 500}
    sweep(load("report"), 1, **how, out=tmp_path / "alone")
    killed: list[int] = []
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):

        def kill(done: Done) -> None:
            if done.shots and not killed:
                killed.extend(client.run(os.getpid).values())
                os.kill(killed[0], signal.SIGKILL)

        executor = client.get_executor(retries=3)
        found = sweep(
            load("report"), 1, **how, out=tmp_path / "cluster", workers=executor, on_done=kill
        )
    assert killed
    assert found.played == 20_000
    assert same(tmp_path / "alone", tmp_path / "cluster")


@takes_long
@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's own figures are read")
def test_memory_does_not_grow_with_the_sweep(tmp_path: Path) -> None:
    code = (
        "import re, sys\n"
        "from pool_pymunk import load, sweep\n"
        "sweep(load('report'), 1, vary={'angle': (-5, 5), 'start': 1e-4}, "
        "samples=int(sys.argv[2]), out=sys.argv[1])\n"
        "print(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1])"
    )
    # (ru_maxrss would not do: a new process begins with that of its parent.)
    used = []
    for count in (100_000, 600_000):
        command = [sys.executable, "-c", code, str(tmp_path / str(count)), str(count)]
        used.append(int(subprocess.run(command, capture_output=True, check=True).stdout))
    assert used[1] < 1_000_000  # kB
    assert used[1] < 1.5 * used[0]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to one process")
@pytest.mark.parametrize(
    ("send", "number"),
    [("kill", signal.SIGINT), ("kill", signal.SIGTERM), ("killpg", signal.SIGTERM)],
)
def test_an_interrupt_ends_large_parts_at_once(tmp_path: Path, send: str, number: int) -> None:
    """While workers play, hardly anything in the first process is the package's own code.

    SIGTERM may come to the workers, too.
    """
    small = COMMAND.index(IN_SMALL_PARTS)
    command = [*COMMAND[: small - 1], "-m", "pool_pymunk", *COMMAND[small + 1 :]]
    command[command.index("60000")] = "3000000"
    process = subprocess.Popen(
        [*command, "--out", str(tmp_path), "--workers", "2"],
        stderr=subprocess.PIPE, text=True, preexec_fn=AT_A_TERMINAL, start_new_session=True,
    )  # fmt: skip
    while not list(tmp_path.glob("_*")):
        time.sleep(0.05)
    time.sleep(5.0)
    getattr(os, send)(process.pid, number)
    _, said = process.communicate(timeout=20)
    assert (process.returncode, without_remarks(said)) == (128 + number, "error: interrupted\n")
