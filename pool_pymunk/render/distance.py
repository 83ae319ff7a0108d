"""This module plots how far two runs of one shot lie apart, ball by ball."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from pool_pymunk.physics.motion import Array
from pool_pymunk.render.canvas import POINTS_PER_INCH, dress
from pool_pymunk.render.style import LOOK, Style, ball_colors
from pool_pymunk.render.view import Box
from pool_pymunk.results.run import Run

SAMPLES = 1500


def plot_distances(
    figure: Figure,
    room: Box,
    runs: tuple[Run, Run],
    times: tuple[float, float],
    style: Style,
    letter: float,
) -> Axes:
    """Plot the distances between two ``times`` (s) into the ``room`` (points), ball by ball.

    Letters have ``letter`` points, and many lines are thin.
    """
    scene = runs[0].scene
    width, height = figure.get_size_inches() * POINTS_PER_INCH
    axes = figure.add_axes(
        (room.x0 / width, room.y0 / height, room.width / width, room.height / height)
    )
    t = np.linspace(*times, SAMPLES)
    gap = (runs[0].at(t)[0] - runs[1].at(t)[0]) / scene.units.to_si(1.0, "length")
    apart = np.hypot(gap[..., 0], gap[..., 1])
    moved = np.flatnonzero((apart > 0.0).any(axis=0))
    wide = 0.18 * letter * math.sqrt(LOOK.few / max(len(moved), LOOK.few))
    edge = [Stroke(linewidth=1.65 * wide, foreground=style.faint), Normal()]
    for k in moved:
        color, id_ = ball_colors(scene)[k], scene.balls[k].id
        axes.plot(t, apart[:, k], color=color, label=id_, linewidth=wide, path_effects=edge)
    _scale(axes, apart, letter)
    axes.set_xlim(t[0], max(t[-1], t[0] + 1e-9))
    axes.set_ylabel(f"apart ({scene.units.length})", fontsize=letter)
    axes.set_xlabel("time (s)", fontsize=letter)
    axes.grid(visible=True, color=style.faint, alpha=0.25, linewidth=0.06 * letter)
    axes.tick_params(labelsize=0.85 * letter, width=0.06 * letter, which="both")
    axes.spines[:].set_linewidth(0.08 * letter)
    dress(axes, style)
    return axes


def key_columns(count: int) -> int:
    """Return how many columns a key of this many balls has: six stand below each other."""
    return -(-count // 6)


def draw_key(axes: Axes, style: Style, letter: float) -> None:
    """Say to the right of the plot which colour is which ball, in columns."""
    if axes.lines:
        axes.legend(
            loc="upper left", bbox_to_anchor=(1.0, 1.08), ncols=key_columns(len(axes.lines)),
            fontsize=0.85 * letter, labelcolor=style.ink, frameon=False, borderpad=0.2,
            handlelength=1.0, handletextpad=0.4, columnspacing=0.8, labelspacing=0.25,
        )  # fmt: skip


def _scale(axes: Axes, apart: Array, letter: float) -> None:
    """Make the axis logarithmic if the distances span a wide range; else it begins at zero."""
    shown = apart[np.isfinite(apart) & (apart > 0.0)]
    if not shown.size:
        same = "the same in both, to the last digit"
        axes.text(0.5, 0.5, same, ha="center", transform=axes.transAxes, fontsize=letter)
        return
    high = float(shown.max())
    low = max(float(shown.min()), LOOK.decades * high)
    if high / low > LOOK.wide_range:
        axes.set_yscale("log", nonpositive="clip")
        axes.set_ylim(low, 2.0 * high)
    else:
        axes.set_ylim(0.0, 1.1 * high)
