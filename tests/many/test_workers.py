"""Workers share many shots, and change no bit; they end when the work is over."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Batch, Law, Uncertainty, load, sensitivity, simulate_many
from pool_pymunk.many import play, workers
from pool_pymunk.many.workers import Workers, cores, workers_of
from pool_pymunk.studies.atlas import atlas
from pool_pymunk.studies.find import find
from tests.shared.scenes import AT_A_TERMINAL

SHOTS = 120
ARRAYS = (
    "final", "duration", "events", "hits", "cushions", "first_hit", "met", "pocketed", "status",
    "in_doubt",
)  # fmt: skip


@pytest.fixture(scope="module")
def two() -> Iterator[Workers]:
    """Yield two processes, to which everything is sent."""
    with pytest.MonkeyPatch.context() as patch, Workers(2) as found:
        patch.setattr(workers, "START", 0.0)
        patch.setattr(workers, "SEND", 0.0)
        patch.setattr(play, "FEWEST", 40)
        yield found


def some(name: str = "report", **more: Any) -> Batch:
    rng, scene = np.random.default_rng(1), load(name)
    vary = {"angle": rng.uniform(0.0, 360.0, SHOTS), "speed": rng.uniform(0.5, 4.0, SHOTS)}
    return simulate_many(scene, vary=vary | more.pop("vary", {}), **more)


def check(one: Batch, other: Batch) -> None:
    """Check that two batches have the same bits."""
    for name in ARRAYS:
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
    assert (one.derivatives is None) == (other.derivatives is None)
    if one.derivatives is not None and other.derivatives is not None:
        assert one.derivatives.tobytes() == other.derivatives.tobytes()


@pytest.mark.parametrize("name", ["report", "follow-and-draw", "nine-ball"])
def test_two_processes_have_the_same_bits(name: str, two: Workers) -> None:
    done = list[int]()
    check(some(name), some(name, workers=two, on_done=done.append))
    assert two.pool is not None
    assert sum(done) == SHOTS and done[0] == 0


def test_what_differs_from_shot_to_shot_is_sent(two: Workers) -> None:
    rng = np.random.default_rng(2)
    vary = {"mass.C": rng.uniform(0.1, 0.3, SHOTS), "friction.cushion": rng.uniform(0, 0.3, SHOTS)}
    how: dict[str, Any] = {"vary": vary, "derivatives": ["angle", "x.C", "mass.C"]}
    check(some(**how), some(**how, workers=two))
    radii: dict[str, Any] = {"vary": {"radius.C": rng.uniform(0.02, 0.03, SHOTS)}}
    check(some(**radii), some(**radii, workers=two))


def test_figures_of_the_ends_are_shared_out(two: Workers) -> None:
    scene = load("nine-ball")
    vary = {"angle": np.linspace(-3.0, 3.0, 60), "speed": np.full(60, 6.0)}
    one, other = (simulate_many(scene, vary=vary, figures=True, workers=w) for w in (None, two))
    for name in ("final", "rounding", "policy_shift", "persistent_shift"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
    assert one.rounding is not None and one.rounding[59] == one.run(59).rounding


def test_tables_of_an_environment_are_shared_out(monkeypatch: pytest.MonkeyPatch) -> None:
    env = pytest.importorskip("pool_pymunk.env")
    monkeypatch.setattr(workers, "START", 0.0)
    monkeypatch.setattr(workers, "SEND", 0.0)
    one, other = env.PotVectorEnv(600), env.PotVectorEnv(600, workers=2)
    for each in (one, other):
        each.reset(seed=3)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (600, 2)).astype(np.float32)
    for found, its in zip(one.step(actions)[:4], other.step(actions)[:4], strict=True):
        np.testing.assert_array_equal(found, its)
    assert other.game.workers.pool is not None
    other.close()
    assert other.game.workers.pool is None


def test_an_executor_of_ones_own_plays() -> None:
    with ThreadPoolExecutor(2) as executor:
        check(some(), some(workers=executor))
        assert executor.submit(int).result() == 0  # It goes on.


def test_a_law_that_cannot_be_sent_is_played_here(two: Workers) -> None:
    class Own(Law):
        pass

    with (
        workers_of(Workers(2)) as alone,
        pytest.warns(UserWarning, match="this process plays alone, because .* the law"),
    ):
        check(some(law=Own()), some(law=Own(), workers=alone))


class Unread(Law):
    """No other process can read this law, such as one of a script that it does not have."""

    def __reduce__(self) -> tuple[Any, ...]:
        return read_elsewhere, ()


def read_elsewhere() -> None:
    raise ModuleNotFoundError("No module named 'elsewhere'")


def test_a_law_that_workers_cannot_read_is_played_here() -> None:
    said = r"this process plays alone, because .* the law.*\(No module named 'elsewhere'\)"
    with ThreadPoolExecutor(1) as executor, pytest.warns(UserWarning, match=said):
        check(some(law=Unread()), some(law=Unread(), workers=executor))


def test_studies_have_the_same_numbers(two: Workers) -> None:
    scene, errors = load("report"), Uncertainty(1e-4)
    one, other = (sensitivity(scene, 1, errors, 90, 1, each) for each in (None, two))
    for name in ("ends", "left", "same_contacts"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    maps = [atlas(scene, 1, size=(10, 9), workers=each) for each in (None, two)]
    assert maps[0].end.tobytes() == maps[1].end.tobytes()
    found = [
        find(scene, 1, lambda b: b.hits > 3, tries=600, samples=50, best=1, workers=each)
        for each in (None, two)
    ]
    assert found[0][0].share == found[1][0].share


def test_few_shots_start_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "START", 1.0)
    with Workers(2) as found:
        some(workers=found)
        assert found.pool is None


def test_threads_are_workers_now() -> None:
    with pytest.warns(DeprecationWarning, match="threads= is now workers="):
        assert len(simulate_many(load("report"), vary={"speed": [1.0]}, threads=2)) == 1
    assert cores() >= 1


# -- scripts ---------------------------------------------------------------------------------------

SCRIPT = """
import time
import numpy as np
from pool_pymunk import Law, load, simulate_many
from pool_pymunk.many import workers

class Own(Law):
    pass

def play(count, law=None):
    vary = {"angle": np.linspace(0.0, 90.0, count), "speed": np.full(count, 4.0)}
    return simulate_many(load("report"), vary=vary, law=law, workers=2)

workers.START = workers.SEND = 0.0
"""
GUARD = "if __name__ == '__main__':\n    "


def run(path: Path, text: str) -> subprocess.CompletedProcess[str]:
    """Run a script."""
    path.write_text(SCRIPT + text, "utf-8")
    command = [sys.executable, str(path)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.slow
def test_a_script_without_a_guard_hears_one_sentence(tmp_path: Path) -> None:
    found = run(tmp_path / "without.py", "play(2_000)\n")
    assert found.returncode == 1
    assert found.stderr.count("Traceback") == 1
    assert "RuntimeError: workers = 2: no process can start from this script" in found.stderr


@pytest.mark.slow
def test_a_script_that_is_no_file_hears_another_sentence() -> None:
    found = subprocess.run(
        [sys.executable, "-"], input=f"{SCRIPT}{GUARD}play(2_000)\n",
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert found.returncode == 1
    assert "RuntimeError: workers = 2: no process can start from a script that is" in found.stderr


@pytest.mark.slow
def test_a_law_of_a_script_is_sent_and_one_of_a_notebook_is_not(tmp_path: Path) -> None:
    found = run(tmp_path / "with.py", GUARD + "print(play(2_000, Own()))")
    assert (found.returncode, found.stderr) == (0, "")
    assert found.stdout.startswith("<Batch of 2,000 shots: 2000 settled")
    typed = subprocess.run(
        [sys.executable, "-c", f"{SCRIPT}\nprint(play(2_000, Own()))"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (typed.returncode, typed.stdout) == (0, found.stdout)
    assert "this process plays alone" in typed.stderr


def alive(group: int) -> bool:
    """Tell whether a process of a group is there."""
    try:
        os.kill(-group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to one process")
@pytest.mark.parametrize(
    ("send", "number"), [("kill", "SIGINT"), ("killpg", "SIGINT"), ("kill", "SIGKILL")]
)
def test_all_workers_end_with_the_first_process(tmp_path: Path, send: str, number: str) -> None:
    path = tmp_path / "long.py"
    path.write_text(SCRIPT + GUARD + "print('ready', flush=True); play(5_000_000)\n", "utf-8")
    process = subprocess.Popen(
        [sys.executable, str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=AT_A_TERMINAL, start_new_session=True,
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    time.sleep(4.0)
    getattr(os, send)(process.pid, getattr(signal, number))
    began = time.perf_counter()
    _, said = process.communicate(timeout=30)
    assert time.perf_counter() - began < 3.0
    if number == "SIGINT":
        assert said.endswith("KeyboardInterrupt\n") and said.count("Traceback") == 1
    last = time.perf_counter() + 5.0
    while alive(process.pid):
        assert time.perf_counter() < last
        time.sleep(0.05)
