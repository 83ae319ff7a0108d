"""This program draws the pictures and films that the README shows; ``make gallery`` runs it.

``python docs/figures/gallery.py [FOLDER]`` draws them all again, into renders/gallery.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from pool_pymunk import Run, Shot, load, simulate, simulate_all
from pool_pymunk.render import FilmSettings, Show, film, picture
from pool_pymunk.solvers import reference_solver

DPI = 120.0
GIF = FilmSettings(size=(720, 406), fps=25.0)
BREAK = FilmSettings(size=(560, 316), fps=20.0, end=5.0)


def follow_break() -> Run:
    """Return a break of eight-ball whose cue ball rolls at once, and follows into the rack."""
    scene = load("eight-ball")
    shot = Shot("Break with follow", "cue", speed=11.0, aim="1", roll=1.0)  # m/s: 25 mph
    return simulate(replace(scene, shots=(shot,)), 1, solver=reference_solver().name)


def draw_gallery(folder: Path) -> None:
    """Draw the report's four shots, an overlay, a polygon, and follow and draw."""
    report = load("report")
    runs = [simulate(report, shot, solver=reference_solver().name) for shot in report.shots]
    drawn = {f"shot-{k}": run for k, run in enumerate(runs, start=1)}
    drawn["hexagon"] = simulate(load("hexagon"), "Break", solver=reference_solver().name)
    for name, run in drawn.items():
        for when in ("start", "end"):
            picture(run, folder / f"{name}-{when}.png", when=when, dpi=DPI)
    for name in ("shot-1", "hexagon"):
        film(drawn[name], folder / f"{name}.gif", GIF)
    film(follow_break(), folder / "eight-ball" / "shot-3.gif", BREAK)
    handlers = simulate(report, report.shots[0], solver="pymunk-discrete", dt=1 / 240)
    overlay = Show((runs[0], handlers))
    picture(overlay, folder / "overlay.png", when="end", dpi=DPI)
    film(overlay, folder / "overlay.gif", GIF)
    for run in simulate_all(load("follow-and-draw"), solver=reference_solver().name):
        picture(run, folder / f"{run.name}-end.png", when="end", dpi=DPI)


if __name__ == "__main__":
    draw_gallery(Path(sys.argv[1] if len(sys.argv) > 1 else "renders/gallery"))
