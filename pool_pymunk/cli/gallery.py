"""This program draws the pictures and films that the README shows; ``make gallery`` runs it.

``python -m pool_pymunk.cli.gallery [FOLDER]`` draws them all again, into renders/gallery.
"""

from __future__ import annotations

import sys
from pathlib import Path

from pool_pymunk import load, simulate
from pool_pymunk.render import FilmSettings, Show, film, picture
from pool_pymunk.solvers import yardstick

DPI = 120.0
GIF = FilmSettings(size=(720, 406), fps=25.0)


def draw_gallery(folder: Path) -> None:
    """Draw the report's four shots, an overlay, a polygon table and a break into a folder."""
    report = load("report")
    runs = [simulate(report, shot, solver=yardstick().name) for shot in report.shots]
    for k, run in enumerate(runs, start=1):
        picture(run, folder / f"shot-{k}-start.png", when="start", dpi=DPI)
        picture(run, folder / f"shot-{k}-end.png", when="end", dpi=DPI)
    film(runs[0], folder / "shot-1.gif", GIF)

    handlers = simulate(report, report.shots[0], solver="pymunk-discrete", dt=1 / 240)
    overlay = Show((runs[0], handlers))
    picture(overlay, folder / "overlay.png", when="end", dpi=DPI)
    film(overlay, folder / "overlay.gif", GIF)

    six_sides = simulate(load("hexagon"), "Break", solver=yardstick().name)
    picture(six_sides, folder / "hexagon-start.png", when="start", dpi=DPI)
    picture(six_sides, folder / "hexagon-end.png", when="end", dpi=DPI)
    film(six_sides, folder / "hexagon.gif", GIF)

    eight_ball = simulate(load("eight-ball"), "Break", solver=yardstick().name)
    picture(eight_ball, folder / "eight-ball-start.png", when="start", dpi=DPI)
    picture(eight_ball, folder / "eight-ball-end.png", when="end", dpi=DPI)
    film(eight_ball, folder / "eight-ball.gif", GIF)


if __name__ == "__main__":
    draw_gallery(Path(sys.argv[1] if len(sys.argv) > 1 else "renders/gallery"))
