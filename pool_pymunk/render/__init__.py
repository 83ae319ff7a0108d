"""This package draws pictures and films of runs.

matplotlib is imported here and nowhere else in the package.
"""

from pool_pymunk.render.canvas import Figure, save_figure
from pool_pymunk.render.films import film, frame_count, join
from pool_pymunk.render.pictures import figure_of, picture
from pool_pymunk.render.plots import energy_figure
from pool_pymunk.render.stage import FilmSettings
from pool_pymunk.render.style import PRINT, SCREEN, Style
from pool_pymunk.render.view import Show
from pool_pymunk.safety.files import RenderError

__all__ = [
    "PRINT",
    "SCREEN",
    "Figure",
    "FilmSettings",
    "RenderError",
    "Show",
    "Style",
    "energy_figure",
    "figure_of",
    "film",
    "frame_count",
    "join",
    "picture",
    "save_figure",
]
