"""This module says in what the scenes of runs differ, and whether one table can show them all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pool_pymunk.model import Scene, Units
from pool_pymunk.model.problems import shown
from pool_pymunk.render.table import seen_posts
from pool_pymunk.render.view import settings
from pool_pymunk.results.run import Run

MOST_SAID = 3  # A label has at most this many values.
UNSAID = {"law", "name", "color", "published"}  # ``settings`` has the law; the others move no ball


def other_part(scene: Scene, other: Scene) -> str:
    """Return the first part that looks different in two scenes, or an empty text."""
    looks, others = _looks(scene), _looks(other)
    return next((part for part in looks if looks[part] != others[part]), "")


def _looks(scene: Scene) -> dict[str, object]:
    return {
        "balls (ids and radii, in one order)": [(ball.id, ball.radius) for ball in scene.balls],
        "table": scene.table and scene.table.polyline,
        "pockets": scene.pockets,
        "posts": seen_posts(scene),
    }


def labels(runs: Sequence[Run]) -> list[str]:
    """Return what tells the runs of a shot apart: solver and step, or values of their scenes.

    >>> from pool_pymunk import load, simulate
    >>> labels([simulate(load(name), 1) for name in ("report", "report-corrected")])[0]
    'pymunk, dt = 1/240 s, published law, restitution.cue_ball 0.7'
    """
    plain, values = settings(runs), [_values(run) for run in runs]
    keys = list(dict.fromkeys(key for one in values for key in one))
    differ = [key for key in keys if any(one.get(key) != values[0].get(key) for one in values)]
    names = plain if len(set(plain)) > 1 or not differ else [""] * len(runs)
    more = [f"and {len(differ) - MOST_SAID} more"] * (len(differ) > MOST_SAID)
    units, found = runs[0].scene.units, []
    for name, its in zip(names, values, strict=True):
        said = [f"{key} {_written(*its.get(key, (None, '')), units)}" for key in differ[:MOST_SAID]]
        found.append(", ".join(filter(None, (name, *said, *more))))
    return found


def _values(run: Run) -> dict[str, tuple[Any, str]]:
    """Return the values of a run's scene and shot by their keys, each with the kind of its unit."""
    scene = run.scene
    parts = {name: getattr(scene, name) for name in ("physics", "restitution", "friction")}
    parts |= {f"posts.{k}": post for k, post in enumerate(scene.posts, scene.first_post)}
    parts |= {f"balls.{ball.id}": ball for ball in scene.balls}
    parts |= {"shot": run.shot} if run.shot else {}
    return {
        f"{name}.{key}": (getattr(part, key), unit)
        for name, part in parts.items()
        for key, (_, unit, _) in part.KEYS.items()
        if key not in UNSAID
    }


def _written(value: Any, kind: str, units: Units) -> str:
    """Write a value in these units, without the rounding of a conversion."""
    if value is None:
        return "left out"
    if isinstance(value, tuple):
        return f"[{', '.join(_written(one, kind, units) for one in value)}]"
    if isinstance(value, str | bool):
        return shown(value)
    return f"{units.from_si(value, kind) if kind else value:.12g}"
