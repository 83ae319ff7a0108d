"""This module draws what an environment renders, in the look of the films."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.env.games import Game, Tables
from pool_pymunk.fast import Batch, simulate_many
from pool_pymunk.model import Shot
from pool_pymunk.model.plain import argument, choice

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
    from pool_pymunk.render import FilmSettings, Show
    from pool_pymunk.render.stage import Stage

    shot = Shot(game.caption(tables, k), game.scene.balls[game.cue].id, velocity=(0.0, 0.0))
    run = batch.run(row)
    scene = replace(run.scene, title=game.name)
    show = Show((replace(run, scene=scene, shot=shot, solver=""),))
    settings = FilmSettings(size=SIZE, fps=FPS)
    timing = settings.timing(show)
    if mode != "rgb_array_list":
        timing = replace(timing, start=timing.end)
    frames = list(Stage(show, SIZE, timing, settings.style).frames())
    return frames if mode == "rgb_array_list" else frames[-1]
