"""This module draws what an environment renders, in the look of the films."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.env.games import Game, Tables
from pool_pymunk.fast import Batch, simulate_many
from pool_pymunk.model import Shot
from pool_pymunk.model.plain import argument, choice
from pool_pymunk.results.run import Run

Pixels = NDArray[np.uint8]

MODES = ("rgb_array", "rgb_array_list")
FPS = 30
SIZE = (800, 450)  # pixels


def read_mode(mode: str | None) -> str | None:
    """Return a mode that is known, or None; raises SettingError for others."""
    return None if mode is None else argument("render_mode", mode, choice(MODES))


def rendered(
    game: Game, tables: Tables, k: int, batch: Batch | None, row: int, mode: str
) -> Pixels | list[Pixels]:
    """Return the picture (450, 800, 3) of table ``k``, or the frames of its last shot in a list.

    ``batch`` has that shot in its ``row``; it is None before the first one.
    """
    if batch is None or row < 0:
        position = tables.position[k : k + 1]
        batch, row = simulate_many(game.scene, position, np.zeros_like(position)), 0
    stage = _stage(game, batch.run(row), game.caption(tables, k), whole=mode == "rgb_array_list")
    frames = list(stage.frames())
    return frames if mode == "rgb_array_list" else frames[-1]


def _stage(game: Game, run: Run, caption: str, *, whole: bool) -> Any:
    """Return the stage on which a shot is filmed, or its last frame drawn."""
    from pool_pymunk.render import FilmSettings, Show
    from pool_pymunk.render.stage import Stage

    shot = Shot(caption, game.scene.balls[game.cue].id, velocity=(0.0, 0.0))
    show = Show((replace(run, scene=replace(run.scene, title=game.name), shot=shot, solver=""),))
    settings = FilmSettings(size=SIZE, fps=FPS)
    timing = settings.timing(show)
    return Stage(show, SIZE, timing if whole else replace(timing, start=timing.end), settings.style)
