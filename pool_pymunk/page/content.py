"""This module says what a page shows, in plain numbers and words: the scene, and runs of its shots.

All lengths are in m, times in s. A number that is not finite becomes null.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from pool_pymunk.model import Scene, Table
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.units import UNITS
from pool_pymunk.render import PRINT, SCREEN
from pool_pymunk.render.sheet import setting
from pool_pymunk.render.style import IVORY, ball_colors, halo_color, striped
from pool_pymunk.render.table import is_sharp, round_number, sights
from pool_pymunk.render.view import extent
from pool_pymunk.results.run import Run

PITCH = 0.16  # of the width; the lines of an open plane are at most so far apart


def content(shots: Sequence[Sequence[Run]]) -> dict[str, Any]:
    """Return what a page shows of each shot: its run, and the runs to compare it with.

    Raises SettingError for runs of different scenes.
    """
    runs = [run for shot in shots for run in shot]
    if not runs:
        raise setting_error("runs", [], "one run or more is wanted")
    scene = runs[0].scene
    if any(_on_the_table(run.scene) != _on_the_table(scene) for run in runs):
        raise setting_error(
            "runs", f"{len(runs)} runs", "must be on one table, with the same balls"
        )
    seen = extent(scene, runs)
    length, speed = scene.units.length, scene.units.speed
    return {
        "title": scene.title or "Billiards",
        "units": {
            "length": [length, UNITS["length"][length]],
            "speed": [speed, UNITS["speed"][speed]],
        },
        "styles": {"light": asdict(PRINT), "dark": asdict(SCREEN)},
        "ivory": IVORY,
        "seen": list(seen),
        "grid": _grid(scene, seen.width),
        "table": scene.table and _table(scene.table, scene),
        "pockets": [
            {"id": hole.id, "x": hole.position[0], "y": hole.position[1], "radius": hole.radius}
            for hole in scene.pockets
        ],
        "balls": [
            {"id": b.id, "radius": b.radius, "color": c, "halo": halo_color(c), "striped": s}
            for b, c, s in zip(scene.balls, ball_colors(scene), striped(scene), strict=True)
        ],
        "shots": [{"name": shot[0].name, "runs": _runs(shot)} for shot in shots],
    }


def _on_the_table(scene: Scene) -> tuple[object, ...]:
    return scene.table, scene.pockets, tuple((b.id, b.radius, b.color) for b in scene.balls)


def _grid(scene: Scene, width: float) -> dict[str, Any]:
    """Return how far the lines of an open plane are apart: a round number of the scene's units."""
    unit = scene.units.to_si(1.0, "length")
    count = round_number(PITCH * width / unit)
    return {"pitch": count * unit, "text": f"{count:g} {scene.units.length}"}


def _table(table: Table, scene: Scene) -> dict[str, Any]:
    x0, y0, x1, y1 = table.bounds
    return {
        "outline": table.outline,
        "short": min(x1 - x0, y1 - y0),
        "sharp": is_sharp(table),
        "sights": list(sights(table, scene.pockets)),
    }


def _runs(shot: Sequence[Run]) -> list[dict[str, Any]]:
    """Return the runs of one shot; their labels say the laws where they differ in them."""
    laws = {run.law for run in shot} - {run.solver for run in shot}
    return [_run(run, setting(run, with_law=len(laws) > 1)) for run in shot]


def _run(run: Run, label: str) -> dict[str, Any]:
    index = run.scene.index
    gone = run.off - run.pocketed.keys()
    return {
        "solver": run.solver,
        "label": label,
        "message": run.message if run.solver else "",
        "warnings": list(run.warnings),
        "duration": run.duration,
        "off": [index[id_] for id_ in sorted(gone, key=lambda id_: index[id_])],
        "events": [
            event.as_dict() | {"balls": [index[id_] for id_ in event.balls]} for event in run.events
        ],
        "knots": [[list(map(_finite, knot)) for knot in knots.tolist()] for knots in run.knots],
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
