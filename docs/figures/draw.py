"""Draw the pictures of the documentation that are neither in renders/gallery nor beside this file.

``python docs/figures/draw.py`` draws them into docs/figures/made, and so does each ``make docs``.
"""

from __future__ import annotations

import importlib.util
import io
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from pool_pymunk import Disc, Material, Units, collide, load, simulate
from pool_pymunk.render.collision import collision_picture

HERE = Path(__file__).parent
EXAMPLES = HERE.parent.parent / "examples"
MADE = HERE / "made"
DPI = 100.0

Drawing = Callable[[Path], object]


def example(name: str) -> Drawing:
    """Return what draws the picture of an example."""

    def draw(out: Path) -> None:
        spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
        assert spec is not None and spec.loader is not None
        module: Any = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        with redirect_stdout(io.StringIO()):
            module.main(["--out", str(out)])

    return draw


def run(scenario: str, what: Any = "end") -> Drawing:
    """Return what draws the first shot of a scenario."""

    def draw(out: Path) -> None:
        simulate(load(scenario), solver="event-driven").plot(what, out, dpi=DPI)

    return draw


def collision(out: Path) -> None:
    """Draw what ``pool-pymunk collide ... --picture`` draws in the worksheet."""
    radius = 0.028575
    a, b = Disc(0.17, radius, (2.0, 0.0)), Disc(0.17, radius)
    hit = collide(a, b, offset=radius, material=Material(0.95, 0.06))
    collision_picture(hit, out, Units(), dpi=DPI)


PICTURES: dict[str, Drawing] = {
    "collision.png": collision,
    "l-shaped.png": run("l-shaped"),
    "mine-end.png": run(str(HERE / "mine.toml")),
    "mine-energy.png": run(str(HERE / "mine.toml"), "energy"),
    "obstacles-and-flipper.png": example("obstacles_and_flipper"),
    "round-ends.png": example("round_ends"),
    "tutorial-beside-ours.png": example("tutorial_beside_ours"),
}


def draw_all(folder: Path = MADE) -> None:
    """Draw every picture, whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, drawing in PICTURES.items():
        part = folder / f"part-{name}"
        drawing(part)
        part.replace(folder / name)


if __name__ == "__main__":
    draw_all()
