"""This module says what a page shows, in plain numbers and words: the scene, and runs of its shots.

All lengths are in m, times in s. A number that is not finite becomes null.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from pool_pymunk.model import Scene
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.units import UNITS
from pool_pymunk.render import PRINT, SCREEN
from pool_pymunk.render.style import IVORY, LOOK, ball_colors, halo_color, striped
from pool_pymunk.render.table import plane, seen_posts, woodwork
from pool_pymunk.render.view import contact_places, extent, settings
from pool_pymunk.results.run import Run


def content(shots: Sequence[Sequence[Run]]) -> dict[str, Any]:
    """Return what a page shows of each shot: its run, and the runs to compare it with.

    Raises SettingError for runs of different scenes.
    """
    runs = [run for shot in shots for run in shot]
    if not runs:
        raise setting_error("runs", [], "one run or more is needed")
    scene, number = runs[0].scene, f"{len(runs)} runs"
    if any(_on_the_table(run.scene) != _on_the_table(scene) for run in runs):
        raise setting_error("runs", number, "must be on one table, with the same balls")
    seen = extent(scene, runs)
    return {
        "title": scene.title or "Billiards",
        "units": {
            kind: [name, UNITS[kind][name]]
            for kind, name in (("length", scene.units.length), ("speed", scene.units.speed))
        },
        "look": LOOK._asdict(),
        "styles": {
            name: asdict(style.on(scene.table))
            for name, style in {"light": PRINT, "dark": SCREEN}.items()
        },
        "ivory": IVORY,
        "seen": list(map(float, seen.extents)),
        "plane": None if scene.table else plane(seen, scene.units)._asdict(),
        "table": scene.table and woodwork(scene.table, scene.pockets)._asdict(),
        "pockets": [
            {"id": hole.id, "x": hole.position[0], "y": hole.position[1], "radius": hole.radius}
            for hole in scene.pockets
        ],
        "posts": seen_posts(scene),
        "balls": [
            {"id": b.id, "radius": b.radius, "color": c, "halo": halo_color(c), "striped": s}
            for b, c, s in zip(scene.balls, ball_colors(scene), striped(scene), strict=True)
        ],
        "shots": [
            {"name": shot[0].name, "runs": list(map(_run, shot, settings(shot)))} for shot in shots
        ],
    }


def _on_the_table(scene: Scene) -> tuple[object, ...]:
    balls = tuple((b.id, b.radius, b.color) for b in scene.balls)
    return scene.table, scene.pockets, scene.posts, balls


def _run(run: Run, label: str) -> dict[str, Any]:
    index, places, events = run.scene.index, iter(contact_places(run)), []
    for event in run.events:
        events.append(event.as_dict() | {"balls": [index[id_] for id_ in event.balls]})
        if event.is_contact:  # It has a place and a size: x, y and a radius.
            _, place, radius = next(places)
            events[-1]["place"] = list(map(_finite, (*place, radius)))
    return {
        "solver": run.solver,
        "label": label,
        "message": run.message if run.solver else "",
        "warnings": list(run.warnings),
        "duration": run.duration,
        "off": sorted(index[id_] for id_ in run.off - run.pocketed.keys()),
        "events": events,
        "knots": [[list(map(_finite, row)) for row in rows.tolist()] for rows in run.knots],
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
