"""This program puts into one folder what a class hands in; ``make handin`` runs it.

``python docs/figures/hand_in.py [SCENARIO]`` plays the report's four shots, or those of a scenario
of one's own, by the report's own algorithm. It draws where they begin and end, writes the table of
ends with the exact ones beside them, and puts all of it on one page, hand-in.html, with captions
and, of the report, a paragraph on Simulation 4. Then it films the shots.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from html import escape
from itertools import product
from pathlib import Path
from typing import get_args

from pool_pymunk import Run, Scene, SceneError, SettingError, load, simulate
from pool_pymunk.cli import read
from pool_pymunk.cli.beside import simulate_beside
from pool_pymunk.cli.render import save_films
from pool_pymunk.cli.runs import stem
from pool_pymunk.render import FilmSettings, Show, picture
from pool_pymunk.render.pictures import When
from pool_pymunk.report.listing import DECIMALS, magnitudes
from pool_pymunk.results.words import counted
from pool_pymunk.studies.grid import Column

FILM = FilmSettings(size=(1280, 720), fps=30.0)
DPI, WHENS = 150.0, get_args(When)
TURN = 1e-6  # degrees; the cue ball of Simulation 4 is turned by so little
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


def in_units(scene: Scene, *lengths: float) -> list[float]:
    """Return lengths (m) in the scene's units."""
    return [scene.units.from_si(length, "length") for length in lengths]


def rows(pairs: Sequence[tuple[Run, ...]]) -> Iterator[dict[str, str]]:
    """Yield the rows of the table of ends: computed, exact, published, and how far off the last is.

    Published places have the digits of the log; others have two more, so that distances are seen.
    """
    for run, exact in pairs:
        unit, digits = run.scene.units.length, DECIMALS[run.scene.units.length]
        for ball, end in run.final.items():
            row = {"shot": run.name, "ball": ball}
            places = {"": (end, digits + 2), "exact ": (exact.final[ball], digits + 2)}
            printed = run.shot.published.get(ball) if run.shot else None
            if printed:
                places["published "] = (printed, digits)
            for whose, (place, shown) in places.items():
                for axis, value in zip("xy", in_units(run.scene, *place), strict=True):
                    row[f"{whose}{axis} ({unit})"] = f"{value:.{shown}f}"
            if printed:
                [off] = in_units(run.scene, math.dist(end, printed))
                row[f"off ({unit})"] = f"{off:.{digits + 2}f}"
            yield row


def ends_of_nine(scene: Scene) -> list[tuple[float, float]]:
    """Return where ball 9 ends (in) if the fourth shot is turned to either side, or not at all."""
    shot, found = scene.shots[3], []
    vx, vy = scene.start(shot).velocity[scene.index["C"]]
    for turn in (TURN, 0.0, -TURN):
        angle = math.degrees(math.atan2(vy, vx)) + turn
        turned = replace(scene, shots=(replace(shot, aim=None, angle=angle),))
        x, y = in_units(scene, *simulate(turned, solver="event-driven").final["9"])
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


def table(found: Sequence[Mapping[str, str]], columns: Sequence[str]) -> str:
    """Return the table of ends as HTML."""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    body = "\n".join(
        "<tr>" + "".join(f"<td>{escape(row.get(name, ''))}</td>" for name in columns) + "</tr>"
        for row in found
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table>"


def setting(run: Run) -> str:
    """Return the paragraph on what all shots have in common, and on how to read the figures."""
    scene = run.scene
    said = dict(line.partition(" (")[0].split(": ") for line in magnitudes(scene))
    numbers = f"The table: {said['size over all']}. " if scene.table else "There is no table. "
    numbers += f"The balls' radius: {said['radius']}; their mass: {said['mass']}"
    others = {ball.mass for ball in scene.balls if not ball.cue}
    if scene.cue and len(others) == 1 and scene.cue.mass not in others:
        numbers += f" (the cue ball {scene.units.text(scene.cue.mass, 'g', 'mass')})"
    groups = [f"{key}: {said[key]}" for key in ("restitution", "friction") if key in said]
    coefficients = "; ".join(groups).replace("_", " on ").capitalize()
    slices = "a microsecond" if run.dt == 1e-6 else f"{1e6 * (run.dt or 0.0):g} microseconds"
    law = scene.physics.law
    by = "the law of the report's Listing 3" if law == "published" else f"the law {law}"
    return (
        f"{numbers}. {coefficients}. All shots are computed by the report's algorithm in slices of "
        f"{slices}, by {by}; exact ends, without slices, stand beside them. In the figures, the "
        "arrow is the velocity of the struck ball, rings are where balls started, lines are the "
        "tracks of balls that moved, and cushions are numbered on the rails."
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


def hand_in(
    folder: Path, settings: FilmSettings = FILM, dt: float | None = None, scenario: str = "report"
) -> Path:
    """Fill the folder, and return its page; ``dt`` (s) is the length of the slices."""
    scene = load(scenario)
    folder.mkdir(parents=True, exist_ok=True)
    slices = Column("time-slice", dt)  # by default the report's own
    pairs = simulate_beside(scene, read.shots(scene, None), [slices, Column("event-driven")])
    runs = [run for run, _ in pairs]
    shows = [Show((run,)) for run in runs]
    for show, when in product(shows, WHENS):
        path = folder / f"{stem(show.runs[0])}-{when}.png"
        picture(show, path, when=when, dpi=DPI, caption="")
    found = list(rows(pairs))
    columns = list(dict.fromkeys(name for row in found for name in row))
    with (folder / "ends.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(found)
    parts = [f"<p>{escape(setting(runs[0]))}</p>", *figures(runs)]
    parts.append(f"<h2>Where the balls end</h2>\n{table(found, columns)}")
    if scene == load("report"):
        parts.append(f"<h2>On Simulation 4</h2>\n<p>{escape(on_simulation_4(scene))}</p>")
    written = folder / "hand-in.html"
    title = escape(scene.title or Path(scenario).stem)
    written.write_text(PAGE.format(title=title, body="\n".join(parts)), encoding="utf-8")
    print(f"{written} is there; its films follow.", flush=True)
    save_films(shows, folder, ".mp4", settings)
    return written


def main() -> None:
    """Read the command line, and fill the folder."""
    parser = argparse.ArgumentParser(description="Put into one folder what a class hands in.")
    about = "a TOML file of your own, or the name of a bundled one (default: report)"
    parser.add_argument("scenario", nargs="?", default="report", help=about)
    about = "the folder (default: renders/handin)"
    parser.add_argument("--out", default="renders/handin", type=Path, metavar="DIR", help=about)
    asked = parser.parse_args()
    try:
        print(hand_in(asked.out, scenario=asked.scenario))
    except (SceneError, SettingError) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
