"""This program puts into one folder what a class hands in; ``make handin`` runs it.

``python docs/figures/hand_in.py [FOLDER]`` plays the report's four shots by the report's own
algorithm. It draws where they begin and end, writes the table of ends, and puts all of it on one
page, hand-in.html, with captions and a paragraph on Simulation 4. Then it films them.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from html import escape
from itertools import product
from pathlib import Path
from typing import get_args

from pool_pymunk import Run, Scene, load, simulate
from pool_pymunk.cli.beside import simulate_beside
from pool_pymunk.cli.render import save_films
from pool_pymunk.cli.runs import stem
from pool_pymunk.render import FilmSettings, Show, picture
from pool_pymunk.render.pictures import When
from pool_pymunk.report.listing import magnitudes
from pool_pymunk.results.words import counted
from pool_pymunk.studies.grid import Column

FILM = FilmSettings(size=(1280, 720), fps=30.0)
DPI, WHENS = 150.0, get_args(When)
TURN = 1e-6  # degrees; the cue ball of Simulation 4 is turned by so little
COLUMNS = ("shot", "ball", "x (in)", "y (in)", "published x (in)", "published y (in)", "off (in)")
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 16px/1.5 Georgia, serif; color: #111; max-width: 52rem }}
body {{ margin: 2rem auto; padding: 0 1rem }}
img, video {{ width: 100%; border: 1px solid #ccc; box-sizing: border-box }}
figure {{ margin: 1.5rem 0; break-inside: avoid }} figcaption {{ font-size: 0.9rem }}
table {{ border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums }}
th, td {{ padding: 0.1rem 0.6rem; text-align: right; border-bottom: 1px solid #ddd }}
th:first-child, td:first-child {{ text-align: left }} tr {{ break-inside: avoid }}
@media print {{
  body {{ margin: 0 auto }} video {{ display: none }} h2 {{ break-before: page }}
  h1 + h2 {{ break-before: avoid }} figure {{ margin: 0.8rem auto; width: 80% }}
}}
</style></head><body>
<h1>{title}</h1>
{body}
</body></html>
"""


def inches(scene: Scene, *lengths: float) -> list[float]:
    """Return lengths (m) in the report's inches."""
    return [scene.units.from_si(length, "length") for length in lengths]


def rows(runs: Sequence[Run]) -> Iterator[list[str]]:
    """Yield the rows of the table of ends: computed, published, and how far apart they are.

    The report prints two decimals; computed places have four, so that the distance can be seen.
    """
    for run in runs:
        assert run.shot is not None
        for ball, end in run.final.items():
            printed = run.shot.published[ball]
            *numbers, off = inches(run.scene, *end, *printed, math.dist(end, printed))
            texts = (f"{x:.{digits}f}" for x, digits in zip(numbers, (4, 4, 2, 2), strict=True))
            yield [run.name, ball, *texts, f"{off:.4f}"]


def ends_of_nine(scene: Scene) -> list[tuple[float, float]]:
    """Return where ball 9 ends (in) if the fourth shot is turned to either side, or not at all."""
    shot, found = scene.shots[3], []
    vx, vy = scene.start(shot).velocity[scene.index["C"]]
    for turn in (TURN, 0.0, -TURN):
        angle = math.degrees(math.atan2(vy, vx)) + turn
        turned = replace(scene, shots=(replace(shot, aim=None, angle=angle),))
        x, y = inches(scene, *simulate(turned, solver="event-driven").final["9"])
        found.append((x, y))
    return found


def on_simulation_4(scene: Scene) -> str:
    """Return the paragraph on Simulation 4."""
    left, straight, right = (f"({x:.2f}, {y:.2f}) in" for x, y in ends_of_nine(scene))
    return (
        "In Simulation 4 the cue ball is aimed at the centre of ball 1. The hit is head-on, so "
        "there is no slip between the two balls, but the law of the report (its Listing 3) takes "
        "the full friction of the hit however small the slip is: only the sign of the slip counts. "
        "So the shot has three answers. If the cue ball is turned by a millionth of a degree to "
        f"one side, ball 9 ends at {left}, which is what the report prints; turned to the other "
        f"side, it ends at {right}; without any slip it ends at {straight}. In the report the "
        "slip was a rounding error of 4e-14 m/s. None of the three ends is wrong: the model does "
        "not decide between them, and no player could."
    )


def table(runs: Sequence[Run]) -> str:
    """Return the table of ends as HTML."""
    head = "".join(f"<th>{escape(name)}</th>" for name in COLUMNS)
    body = "\n".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows(runs)
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table>"


def setting(run: Run) -> str:
    """Return the paragraph on what all shots have in common, and on how to read the figures."""
    size, radius, mass, _, restitution, friction = (
        each.partition(" (")[0] for each in magnitudes(run.scene)
    )  # without what they are in SI
    numbers = f"{size.replace('size over all', 'The table')}. The balls' {radius}; their {mass}"
    if len({ball.mass for ball in run.scene.balls if not ball.cue}) == 1:
        cue = next(ball.mass for ball in run.scene.balls if ball.cue)
        numbers += f" (the cue ball {run.scene.units.text(cue, 'g', 'mass')})"
    coefficients = f"{restitution}; {friction}".replace("_", " on ").capitalize()
    slices = "a microsecond" if run.dt == 1e-6 else f"{1e6 * (run.dt or 0.0):g} microseconds"
    return (
        f"{numbers}. {coefficients}. All shots are computed in slices of {slices}, by the law of "
        "the report's Listing 3. In the figures, the arrow is the velocity of the struck ball, "
        "rings are where balls started, lines are the tracks of balls that moved, and cushions are "
        "numbered on the rails."
    )


def figures(runs: Sequence[Run]) -> Iterator[str]:
    """Yield each shot's section: its film, and its start and end with captions."""
    number = 0
    for run in runs:
        contacts = counted(sum(event.is_contact for event in run.events), "contact")
        yield f"<h2>{escape(run.name)}</h2>\n<video controls src='{stem(run)}.mp4'></video>"
        for when, caption in (
            ("start", f"{run.name} at its start."),
            ("end", f"{run.name} at its end, after {run.duration:.2f} s and {contacts}."),
        ):
            number += 1
            yield (
                f"<figure><img src='{stem(run)}-{when}.png' alt='{escape(caption)}'>"
                f"<figcaption>Figure {number}. {escape(caption)}</figcaption></figure>"
            )


def hand_in(folder: Path, settings: FilmSettings = FILM, dt: float | None = None) -> Path:
    """Fill the folder, and return its page; ``dt`` (s) is the length of the slices."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = load("report")
    slices = Column("time-slice", dt)  # by default the report's own
    runs = [run for [run] in simulate_beside(scene, scene.shots, [slices])]
    shows = [Show((run,)) for run in runs]
    for show, when in product(shows, WHENS):
        path = folder / f"{stem(show.runs[0])}-{when}.png"
        picture(show, path, when=when, dpi=DPI, caption="")
    with (folder / "ends.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows(runs)])
    ends = [f"<h2>Where the balls end</h2>\n{table(runs)}"]
    last = [f"<h2>On Simulation 4</h2>\n<p>{escape(on_simulation_4(scene))}</p>"]
    body = "\n".join([f"<p>{escape(setting(runs[0]))}</p>", *figures(runs), *ends, *last])
    written = folder / "hand-in.html"
    written.write_text(PAGE.format(title=escape(scene.title), body=body), encoding="utf-8")
    print(f"{written} is there; its films follow.", flush=True)
    save_films(shows, folder, ".mp4", settings)
    return written


def main() -> None:
    """Read the command line, and fill the folder."""
    parser = argparse.ArgumentParser(description="Put into one folder what a class hands in.")
    parser.add_argument("folder", nargs="?", default="renders/handin", type=Path)
    print(hand_in(parser.parse_args().folder))


if __name__ == "__main__":
    main()
