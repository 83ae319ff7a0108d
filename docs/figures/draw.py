"""Draw the pictures of the documentation that nothing else draws.

``python docs/figures/draw.py`` draws them into docs/figures/made, and so does each ``make docs``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pool_pymunk import Disc, Material, Units, collide, fit, load, simulate, simulate_all
from pool_pymunk.page import write_page
from pool_pymunk.render.collision import collision_picture
from pool_pymunk.render.residuals import residuals_picture

HERE = Path(__file__).parent
MADE = HERE / "made"
DPI = 100.0

Drawing = Callable[[Path], object]


def run(scenario: str, what: Any = "end", shot: int | None = None) -> Drawing:
    """Return what draws a shot of a scenario, by default the first."""

    def draw(out: Path) -> None:
        simulate(load(scenario), shot, solver="event-driven").plot(what, out, dpi=DPI)

    return draw


def collision(out: Path) -> None:
    """Draw what ``pool-pymunk collide ... --picture`` draws in the worksheet."""
    radius = 0.028575
    a, b = Disc(0.17, radius, (2.0, 0.0)), Disc(0.17, radius)
    hit = collide(a, b, offset=radius, material=Material(0.95, 0.06))
    collision_picture(hit, out, Units(), dpi=DPI)


def residuals(out: Path) -> None:
    """Draw how far the report's printed ends lie off before and after a fit from 0.95."""
    report = load("report")
    stated = replace(report, restitution=replace(report.restitution, cue_ball=0.95))
    residuals_picture(fit(stated, "published", "restitution.cue_ball"), out, dpi=DPI)


def live_page(out: Path) -> None:
    """Make the page of the report's shots beside stock pymunk, which the documentation plays."""
    scene = load("report")
    runs = zip(
        simulate_all(scene, solver="event-driven"),
        simulate_all(scene, solver="pymunk-builtin"),
        strict=True,
    )
    write_page(list(runs), out)


PICTURES: dict[str, Drawing] = {
    "collision.png": collision,
    "l-shaped.png": run("l-shaped"),
    "stadium.png": run("stadium"),
    "crokinole.png": run("crokinole", shot=3),
    "played/played.html": live_page,
    "residuals.png": residuals,
    "mine-end.png": run(str(HERE / "mine.toml")),
    "mine-energy.png": run(str(HERE / "mine.toml"), "energy"),
}


def draw_all(folder: Path = MADE) -> None:
    """Draw every picture, whole or not at all."""
    for name, drawing in PICTURES.items():
        path = folder / name
        part = path.with_name(f"part-{path.name}")
        part.parent.mkdir(parents=True, exist_ok=True)
        drawing(part)
        part.replace(path)


if __name__ == "__main__":
    draw_all()
