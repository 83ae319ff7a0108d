"""Commands that play a shot tell the same of how far its ends may be off."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.shared.commands import exit_code

# A ball falls exactly on a post without friction: rounding decides on which side it leaves.
PIN = """
restitution = {{cushion = 0.8}}
table = {{outline = [[0, 0], [1, 0], [1, 2], [0, 2]], tilt = [0.0, -9.8]}}
physics = {{max_time = {}}}
posts = [{{position = [0.5, 0.5], radius = 0.05}}]
balls = [{{id = "a", radius = 0.03, mass = 0.2, position = [0.5, 1.5]}}]
"""


def said(command: str, scene: Path, capsys: pytest.CaptureFixture[str], *more: str) -> str:
    """Return what a command prints."""
    assert exit_code(command, str(scene), "--out", str(scene.parent), *more) == 0
    return capsys.readouterr().out


def test_run_compare_and_tradeoff_say_that_an_end_is_not_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "pin.toml"
    scene.write_text(PIN.format(6))
    sentence = "Rounding may have moved the ends by up to 2.2 m"
    solver = ("--solvers", "pymunk:1/60")
    exact = ("--no-pictures", "--solver", "event-driven")
    assert sentence in said("run", scene, capsys, *exact)
    assert f"as set up (event-driven): {sentence}." in said(
        "compare", scene, capsys, "--no-pictures", *solver
    )
    tradeoff = said("tradeoff", scene, capsys, "--samples", "2", "--budget", "0", *solver)
    assert f"as set up (event-driven): {sentence}." in tradeoff
    assert " 2.2 " in tradeoff and "No step tried comes within 1 m." in tradeoff


def test_what_is_sure_is_not_doubted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "pin.toml"
    scene.write_text(PIN.format(1))
    assert "may have moved" not in said("run", scene, capsys, "--no-pictures")
    options = ("--no-pictures", "--solvers", "pymunk:1/60")
    assert "may have moved" not in said("compare", scene, capsys, *options)
