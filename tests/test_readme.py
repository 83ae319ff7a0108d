"""The code that README and CONTRIBUTING show works as it stands there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from pool_pymunk import loads
from pool_pymunk.model.scenario import bundled

pytestmark = pytest.mark.heavy

HOME = Path(__file__).parent.parent
README, CONTRIBUTING = (
    (HOME / name).read_text(encoding="utf-8") for name in ("README.md", "CONTRIBUTING.md")
)


def blocks(language: str, text: str = README) -> list[str]:
    """Return the blocks of code in one language."""
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


@pytest.mark.parametrize("code", blocks("python") + blocks("python", CONTRIBUTING))
def test_code_runs(code: str, tmp_path: Path) -> None:
    if "simulate_many" in code:
        pytest.importorskip("numba")
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout


def test_the_scenario_is_sound() -> None:
    text = blocks("toml", (HOME / "docs" / "scenario-files.md").read_text(encoding="utf-8"))[0]
    scene = loads(text)
    assert scene.balls[0].radius == pytest.approx(2.25 * 0.0254)


def test_every_bundled_scenario_is_named() -> None:
    for name in bundled():
        assert f"`{name}`" in README


def test_pictures_are_there() -> None:
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", README):
        assert (HOME / picture).exists(), picture


def test_every_file_that_contributing_names_is_there() -> None:
    named = set(re.findall(r"`((?:[a-z]+/)+[a-z_]*(?:\.py)?)`", CONTRIBUTING))
    assert len(named) > 20
    for name in named:
        assert (HOME / name).exists() or (HOME / "pool_pymunk" / name).exists(), name
