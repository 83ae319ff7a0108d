"""This module says what a page shows, in plain numbers and words: the scene, and runs of its shots.

All lengths are in m, times in s. A number that is not finite becomes null.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.model import Scene
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.render import style, table
from pool_pymunk.render.view import DOT, contact_places, extent, headings, settings
from pool_pymunk.results.persistent import spells, turning
from pool_pymunk.results.run import Run

# what a page shows of a contact
ROW = ("kind", "normal", "before", "after", "impulses", "impulse", "tangential", "lost")
STYLES = {"light": style.PRINT, "dark": style.SCREEN}


def content(shots: Sequence[Sequence[Run]]) -> dict[str, Any]:
    """Return what a page shows of each shot: its run, and the runs to compare it with.

    Raises SettingError for runs of different scenes.
    """
    runs = [run for shot in shots for run in shot]
    if any(not hasattr(run, "scene") for run in runs):
        raise setting_error("overlay", shown(runs[1:]), "must be a list of runs")
    if not runs:
        raise setting_error("runs", [], "one run or more is needed")
    scene, number = runs[0].scene, f"{len(runs)} runs"
    if any(other_part(scene, run.scene) for run in runs):
        raise setting_error("runs", number, "must be on one table, with the same balls")
    seen, units = extent(scene, runs), scene.units
    looks = style.ball_colors(scene), style.striped(scene), style.dashes(scene)
    return {
        "title": scene.title or "Billiards",
        "units": {k: [getattr(units, k), units.to_si(1.0, k)] for k in ("length", "speed")},
        "look": style.LOOK._asdict(),
        "styles": {name: asdict(one.on(scene.table)) for name, one in STYLES.items()},
        "ivory": style.IVORY,
        "seen": list(map(float, seen.extents)),
        "plane": None if scene.table else table.plane(seen, units)._asdict(),
        "table": scene.table and table.woodwork(scene.table, scene.pockets)._asdict(),
        "patches": list(table.seen_patches(scene)),
        "discs": list(table.pockets_and_posts(scene)),
        "numbers": list(table.numbers(scene)),
        "balls": [
            {"id": b.id, "radius": b.radius, "color": c, "halo": style.halo_color(c)}
            | {"striped": s, "dashes": d}
            for b, c, s, d in zip(scene.balls, *looks, strict=True)
        ],
        "legend": [scene.index[id_] for id_ in style.by_number(scene.index)],
        "shots": [
            {"name": shot[0].name, "runs": list(map(_run, shot, settings(shot), labels(shot)))}
            for shot in shots
        ],
    }


def other_part(scene: Scene, other: Scene) -> str:
    """Return the first part that looks different in two scenes, or an empty text."""
    looks, others = _looks(scene), _looks(other)
    return next((part for part in looks if looks[part] != others[part]), "")


def _looks(scene: Scene) -> dict[str, object]:
    return {
        "balls (ids and radii, in one order)": [(ball.id, ball.radius) for ball in scene.balls],
        "table": scene.table and scene.table.polyline,
        "pockets": scene.pockets,
        "posts": table.seen_posts(scene),
        "patches": list(table.seen_patches(scene)),
    }


def labels(runs: Sequence[Run]) -> list[str]:
    """Return what tells the runs of a shot apart: titles of their scenes, solvers and steps.

    Two scenes of one title say in what they differ, as in pictures. Runs alike in all are numbered.

    >>> from pool_pymunk import load, simulate
    >>> labels([simulate(load(name), 1) for name in ("report", "report-corrected")])[0]
    'ME 212 report: eleven balls, four shots, pymunk, dt = 1/240 s, published law'
    >>> labels([simulate(load("report"), 1) for _ in range(2)])[1]
    'pymunk, dt = 1/240 s, run 2'
    """
    titles, plain = [run.scene.title for run in runs], settings(runs)
    tells = [names for names in (titles, plain) if len(set(names)) > 1] or [plain]
    found = [", ".join(filter(None, names)) for names in zip(*tells, strict=True)]
    if len(runs) == 2 and tells == [plain]:
        found = headings(runs)
    return [
        name if found.count(name) == 1 else f"{name}, run {k}" for k, name in enumerate(found, 1)
    ]


def _run(run: Run, setting: str, label: str) -> dict[str, Any]:
    scene, events, breakpoints = run.scene, [], []
    places = contact_places(run)
    for event in run.events:
        said = {key: _finite(value) for key, value in event.as_dict().items()}
        events.append(said | {"balls": [scene.index[id_] for id_ in event.balls]})
        if event.cushion is not None:
            events[-1]["side"] = scene.side_name(event.cushion)
        if event.is_contact:  # It has a place and a size: x, y and a radius.
            row, place, radius = next(places)
            events[-1]["place"] = list(map(_finite, (*place, radius)))
            events[-1]["row"] = {key: _rounded(getattr(row, key)) for key in ROW}
    for ball, rows in zip(scene.balls, run.knots, strict=True):
        if scene.surface.rolls and (when := spells(run, ball.id)):  # It rolls otherwise then.
            rows = np.column_stack((rows, turning(rows, when)))
        breakpoints.append([list(map(_finite, row)) for row in rows.tolist()])
    # These show four digits of the duration (s), and at least three decimals.
    decimals = min(max(3, 3 - math.floor(math.log10(run.duration or 1.0))), 15)
    return {
        "solver": run.solver,
        "setting": label if setting in label else setting + DOT + label,
        "label": label,
        "message": run.message if run.solver else "",
        "warnings": list(run.warnings),
        "duration": run.duration,
        "decimals": decimals,
        "masses": [ball.mass for ball in scene.balls],
        "gyration": GYRATION if scene.surface.rolls else 0.0,
        "off": sorted(scene.index[id_] for id_ in run.off - run.pocketed.keys()),
        "events": events,
        "knots": breakpoints,
    }


def _rounded(value: Any) -> Any:
    """Return a number, or those of a row, to nine digits: a page shows some of them."""
    if isinstance(value, tuple):
        return [_rounded(each) for each in value]
    return _finite(float(f"{value:.9g}")) if isinstance(value, float) else value


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
