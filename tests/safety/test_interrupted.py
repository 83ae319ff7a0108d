"""After Ctrl-C or with a full disk, files are whole or absent, and finished work is kept.

The command ends with one line and the right code.
"""

from __future__ import annotations

import csv
import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from pool_pymunk import SOLVERS
from pool_pymunk.results.run import FILES, Run
from pool_pymunk.safety.files import whole
from pool_pymunk.studies import stability
from pool_pymunk.studies.grid import Tradeoff
from tests.shared.commands import exit_code, without_remarks
from tests.shared.programs import TIMEOUT, interrupt, is_alive, start, wait_until

# Its name is also that of a function.

# Slices of 1e-6 s take about a second for each of the report's shots, so there is time to
# interrupt.
SLOW_RUN = ("run", "report", "--solver", "time-slice", "--dt", "1e-6", "--no-pictures")
SOON = 20.0  # s; on a busy machine


def rows(path: Path) -> list[list[str]]:
    """Return the rows of a CSV, the heading included."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


def all_whole(folder: Path) -> set[str]:
    """Return the names of the files in a folder.

    Each must be readable to its end, and none may be temporary.
    """
    for path in folder.iterdir():
        assert not path.name.startswith(".") and path.stat().st_size > 0, path
        if path.suffix == ".npz":
            with np.load(path) as data:
                assert len(data["t"]) == len(data["position"])
        elif path.suffix == ".csv":
            assert len({len(row) for row in rows(path)}) == 1
        elif path.suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"))
    return {path.name for path in folder.iterdir()}


# -- Ctrl-C ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_keeps_the_shots_that_were_finished(tmp_path: Path, number: int, code: int) -> None:
    """So does SIGTERM, with which other programs end this one."""
    results = tmp_path / "all.json"
    process = start(*SLOW_RUN, "--out", tmp_path / "out", "--json", results)
    wait_until((tmp_path / "out" / "shot-1-events.csv").exists)
    assert interrupt(process, number, code) == "error: interrupted\n"
    shots = json.loads(results.read_text(encoding="utf-8"))["shots"]
    assert [shot["name"] for shot in shots] == ["Simulation 1"]
    assert shots[0]["status"] == "settled"
    assert all_whole(tmp_path / "out") >= {"shot-1.npz", "shot-1.csv", "shot-1-events.csv"}
    assert "shot-4.npz" not in all_whole(tmp_path / "out")


def test_ctrl_c_before_the_first_shot_leaves_nothing(tmp_path: Path) -> None:
    results = tmp_path / "all.json"
    process = start("run", "report", "--solver", "time-slice", "--dt", "1e-8",
                    "--out", tmp_path / "out", "--json", results)  # fmt: skip
    assert process.stdout is not None
    process.stdout.readline()  # The log has begun, and the first shot runs.
    assert interrupt(process) == "error: interrupted\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("module", ["typer", "pool_pymunk.cli.options", "pool_pymunk.core"])
def test_ctrl_c_while_the_command_line_is_imported_is_one_line(module: str) -> None:
    lines = (
        "import os, runpy, signal, sys",
        "signal.signal(signal.SIGINT, signal.default_int_handler)",  # It may be ignored here.
        "class Finder:",
        "    def find_spec(name, *where):",
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)",
        "sys.meta_path.insert(0, Finder)",
        "runpy.run_module('pool_pymunk', run_name='__main__')",
    )
    found = subprocess.run(
        [sys.executable, "-c", "\n".join(lines), "--help"], capture_output=True, text=True
    )
    assert (found.stdout, found.stderr, found.returncode) == ("", "error: interrupted\n", 130)


@pytest.mark.slow
def test_ctrl_c_keeps_the_films_that_were_finished(tmp_path: Path) -> None:
    process = start("render", "report", "--size", "640x360", "--out", tmp_path / "out")
    wait_until((tmp_path / "out" / "shot-1.mp4").exists)
    assert interrupt(process) == "error: interrupted\n"
    films = all_whole(tmp_path / "out")
    assert "shot-1.mp4" in films and "all.mp4" not in films
    assert frames(tmp_path / "out" / "shot-1.mp4") > 100


def frames(film: Path) -> int:
    """Return how many frames a film has, read to its end."""
    import av

    with av.open(str(film)) as opened:
        return sum(1 for _ in opened.decode(video=0))


def test_ctrl_c_keeps_the_settings_that_were_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Tradeoff, "measured", twice_then_ctrl_c(Tradeoff.measured))
    arguments = ("tradeoff", "two-balls", "--budget", "0", "--samples", "2")
    assert exit_code(*arguments, "--out", str(tmp_path)) == 130
    printed, errors = capsys.readouterr()
    assert without_remarks(errors) == "error: interrupted\n"
    assert "pymunk" in printed
    assert all_whole(tmp_path) == {"tradeoff.csv", "tradeoff.png", "tradeoff.svg"}
    heading, *measured = rows(tmp_path / "tradeoff.csv")
    solver, step = heading.index("solver"), heading.index("dt")
    assert [(row[solver], float(row[step])) for row in measured] == [
        ("pymunk", dt) for dt in SOLVERS["pymunk"].ladder[:2]
    ]


def test_ctrl_c_keeps_the_solvers_that_were_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Tradeoff, "measured", twice_then_ctrl_c(Tradeoff.measured))
    results = tmp_path / "all.json"
    arguments = ("compare", "report", "--no-pictures", "--max-time", 0.3, "--json", results)
    assert exit_code(*arguments, "--out", str(tmp_path / "out")) == 130
    assert without_remarks(capsys.readouterr().err) == "error: interrupted\n"
    assert all_whole(tmp_path / "out") == {"ends.csv"}
    found = [
        (one["solver"]["name"], one["shot"])
        for one in json.loads(results.read_text())["comparisons"]
    ]
    names = [f"Simulation {k}" for k in range(1, 5)]
    assert found == [(one, name) for name in names for one in ("pymunk", "pymunk-discrete")]


def twice_then_ctrl_c(work: Callable[..., object]) -> Callable[..., object]:
    """Return a function that works twice, and is then interrupted."""
    calls = 0

    def so(*arguments: object) -> object:
        nonlocal calls
        calls += 1
        if calls > 2:
            raise KeyboardInterrupt
        return work(*arguments)

    return so


@pytest.mark.slow
def test_ctrl_c_ends_stability_and_its_processes(tmp_path: Path) -> None:
    """Some cells are done after a few seconds, or none: the CSV is whole, or not there.

    The rows that are being played take far longer than this test waits.
    """
    process = start("stability", "--out", tmp_path / "out")
    time.sleep(4.0)
    asked = time.monotonic()
    assert interrupt(process) == "error: interrupted\n"
    assert time.monotonic() - asked < SOON
    if (tmp_path / "out").exists():
        assert all_whole(tmp_path / "out") >= {"stability.csv"}
    wait_until(lambda: not is_alive(process.pid))


def test_ctrl_c_keeps_the_rows_of_stability(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(stability.suite, "check_all", lambda *_: one_cell(KeyboardInterrupt()))
    assert exit_code("stability", "--out", str(tmp_path)) == 130
    said = capsys.readouterr()
    assert without_remarks(said.err) == "error: interrupted\n"
    assert "Incomplete: 1 of " in said.out
    assert all_whole(tmp_path) == {"stability.csv", "stability.svg"}
    assert "Incomplete" in (tmp_path / "stability.svg").read_text(encoding="utf-8")
    heading, *measured = rows(tmp_path / "stability.csv")
    extreme, solver = heading.index("extreme"), heading.index("solver")
    assert {(row[extreme], row[solver]) for row in measured} == {("speeds", "event-driven")}


def one_cell(then: BaseException | None = None) -> Iterator[stability.Cell]:
    """Yield the first cell of the table, then raise ``then``."""
    yield stability.check(stability.EXTREMES[0], "event-driven", quick=True)
    if then is not None:
        raise then


# -- a full disk -----------------------------------------------------------------------------------


def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    process = start("run", "report", "--out", tmp_path / "out", limited=True)
    _, stderr = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 1, stderr
    assert stderr.startswith(f"error: {tmp_path / 'out' / 'shot-1'}")
    assert stderr.endswith(": File too large\n")
    assert len(stderr.splitlines()) == 1
    all_whole(tmp_path / "out")


def test_a_disk_that_fills_up_keeps_what_was_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(run: Run, path: Path, **_: object) -> None:
        if run.name == "Simulation 2":
            path.write_text("t,ball,x")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        run.write_csv(path)

    files = [(ending, full if ending == ".csv" else write) for ending, write in FILES]
    monkeypatch.setattr("pool_pymunk.cli.run.FILES", files)
    folder, results = tmp_path / "out", tmp_path / "all.json"
    arguments = ("run", "report", "--no-pictures", "--out", str(folder), "--json", str(results))
    assert exit_code(*arguments) == 1
    error = f"error: {folder / 'shot-2.csv'}: No space left on device\n"
    assert without_remarks(capsys.readouterr().err) == error
    first = {"shot-1.npz", "shot-1.csv", "shot-1-events.csv", "shot-1-persistent.csv"}
    assert all_whole(folder) == first | {"shot-2.npz"}
    shots = json.loads(results.read_text(encoding="utf-8"))["shots"]
    assert [shot["name"] for shot in shots] == ["Simulation 1", "Simulation 2"]


def test_a_full_disk_stops_stability_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(_table: object, path: Path) -> None:
        path.write_text("extreme,case")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(stability.suite, "check_all", lambda *_: one_cell())
    monkeypatch.setattr("pool_pymunk.results.table.ResultTable.csv", full)
    assert exit_code("stability", "--out", str(tmp_path)) == 1
    error = f"error: {tmp_path / 'stability.csv'}: No space left on device\n"
    printed, errors = capsys.readouterr()
    assert without_remarks(errors) == error
    assert "holds" in printed  # The table itself is not lost.
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Give a file system of 64 kB, if this machine lets us mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("needs the right to mount a file system")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "file"),
    [
        (("run", "report"), "shot-1.csv"),
        (("render", "report", "--size", "640x360"), "shot-1.mp4"),
        (("render", "report", "--no-films"), "shot-1-start.png"),
        (("tradeoff", "two-balls", "--budget", "0", "--samples", "2"), "tradeoff.png"),
        (("compare", "report"), "shot-1-pymunk.png"),
    ],
)
def test_a_disk_that_is_really_full(
    small_disk: Path, arguments: tuple[str, ...], file: str
) -> None:
    process = start(*arguments, "--out", small_disk / "out")
    _, stderr = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 1
    assert (
        without_remarks(stderr) == f"error: {small_disk / 'out' / file}: No space left on device\n"
    )
    assert file not in all_whole(small_disk / "out")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with a name here")
def test_a_pipe_takes_what_is_written_and_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    with subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE, text=True) as reader:
        try:
            with whole(pipe) as part:
                assert part == pipe
                part.write_text("all of it", encoding="utf-8")
            assert reader.communicate(timeout=TIMEOUT)[0] == "all of it"
        finally:
            reader.kill()
    assert pipe.is_fifo()


def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path: Path) -> None:
    link, target = tmp_path / "link.json", tmp_path / "target.json"
    link.symlink_to(target)
    with whole(link) as part:
        part.write_text("all of it", encoding="utf-8")
    assert link.is_symlink()
    assert target.read_text(encoding="utf-8") == "all of it"
