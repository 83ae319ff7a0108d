"""Draw the pictures of the documentation that nothing else draws.

``python docs/figures/draw.py`` draws them into docs/figures/made, and so does each ``make docs``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pool_pymunk import Disc, Material, Units, collide, load, simulate
from pool_pymunk.render.collision import collision_picture

HERE = Path(__file__).parent
MADE = HERE / "made"
DPI = 100.0

Drawing = Callable[[Path], object]


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
