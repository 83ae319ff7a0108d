"""This program draws the pictures and films that the README shows; ``make gallery`` runs it.

``python -m pool_pymunk.cli.gallery [FOLDER]`` draws them all again, into renders/gallery.
"""

from __future__ import annotations

import sys
from pathlib import Path

from pool_pymunk import load, loads, simulate
from pool_pymunk.model import Scene
from pool_pymunk.render import FilmSettings, Show, film, picture
from pool_pymunk.solvers import yardstick

DPI = 120.0
GIF = FilmSettings(size=(720, 406), fps=25.0)

HEXAGON = """
title = "A table with six sides"

[table]
outline = [[0.6, 0.0], [1.8, 0.0], [2.4, 1.039], [1.8, 2.078], [0.6, 2.078], [0.0, 1.039]]

[restitution]
ball_ball = 0.95
cushion = 0.80

[friction]
surface = 0.06
cushion = 0.15
ball_ball = 0.05

[ball]
radius = 0.055
mass = 0.17

[[balls]]
id = "C"
cue = true
position = [0.65, 1.039]
{rack}
[[shots]]
name = "Break"
speed = 7.0
angle = 0.6
"""


def hexagon() -> Scene:
    """Return fifteen balls on a hexagonal table, a millimetre apart, in the default colours."""
    gap = 2 * 0.055 + 0.001
    places = [
        (1.35 + 0.866 * gap * row, 1.039 + gap * (k - row / 2))
        for row in range(5)
        for k in range(row + 1)
    ]
    balls = (
        f'[[balls]]\nid = "{n}"\nposition = [{x:.5f}, {y:.5f}]\n'
        for n, (x, y) in enumerate(places, start=1)
    )
    return loads(HEXAGON.format(rack="".join(balls)))


def draw_gallery(folder: Path) -> None:
    """Draw the report's four shots, an overlay and a polygon table into a folder."""
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

    six_sides = simulate(hexagon(), solver=yardstick().name)
    picture(six_sides, folder / "hexagon-start.png", when="start", dpi=DPI)
    picture(six_sides, folder / "hexagon-end.png", when="end", dpi=DPI)
    film(six_sides, folder / "hexagon.gif", GIF)


if __name__ == "__main__":
    draw_gallery(Path(sys.argv[1] if len(sys.argv) > 1 else "renders/gallery"))
