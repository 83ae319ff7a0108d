"""This package draws pictures and films of runs.

matplotlib is imported here and nowhere else in the package.
"""

from pool_pymunk.render.encode import join
from pool_pymunk.render.films import FilmSettings, film, frame_count
from pool_pymunk.render.output import RenderError
from pool_pymunk.render.pictures import picture
from pool_pymunk.render.sheet import Show
from pool_pymunk.render.style import PRINT, SCREEN, Style

__all__ = [
    "PRINT",
    "SCREEN",
    "FilmSettings",
    "RenderError",
    "Show",
    "Style",
    "film",
    "frame_count",
    "join",
    "picture",
]
