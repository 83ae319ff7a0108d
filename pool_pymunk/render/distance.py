"""This module measures how far two runs of one shot lie apart, ball by ball, and plots it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from pool_pymunk.physics.motion import Array
from pool_pymunk.render.canvas import POINTS_PER_INCH
from pool_pymunk.render.style import Style, ball_colors
from pool_pymunk.render.view import Box
from pool_pymunk.results.run import Run

SAMPLES = 1500
FEW = 8  # More lines than these are thinner.
# From this ratio of the largest to the smallest distance on, the axis is logarithmic.
WIDE_RANGE = 30.0
DECADES = 1e-6  # the least distance shown, in the largest


class Distances(NamedTuple):
    """Distances are those of each ball from itself in another run.

    ``t`` (T,) is in s and ``apart`` (T, N) in m.
    """

    t: Array
    apart: Array


def distances(a: Run, b: Run, start: float, end: float) -> Distances:
    """Return the distances of two runs of the same balls, between two times (s)."""
    t = np.linspace(start, end, SAMPLES)
    gap = a.at(t)[0] - b.at(t)[0]
    return Distances(t, np.hypot(gap[..., 0], gap[..., 1]))


def plot_distances(
    figure: Figure, room: Box, runs: tuple[Run, Run], times: tuple[float, float]
) -> Axes:
    """Plot the distances between two ``times`` (s) into the ``room`` (points), ball by ball."""
    scene = runs[0].scene
    width, height = figure.get_size_inches() * POINTS_PER_INCH
    axes = figure.add_axes(
        (room.x0 / width, room.y0 / height, room.width / width, room.height / height)
    )
    t, apart = distances(*runs, *times)
    apart = apart / scene.units.to_si(1.0, "length")
    for k, color in enumerate(ball_colors(scene)):
        if (apart[:, k] > 0.0).any():
            axes.plot(t, apart[:, k], color=color, label=scene.balls[k].id)
    _scale(axes, apart)
    axes.set_xlim(t[0], max(t[-1], t[0] + 1e-9))
    axes.set_ylabel(f"apart ({scene.units.length})")
    axes.set_xlabel("time (s)")
    return axes


def dress_plot(axes: Axes, style: Style, letter: float) -> None:
    """Give the plot the page's colours and letters of ``letter`` points; many lines are thin."""
    axes.set_facecolor("none")
    wide = 0.18 * letter * math.sqrt(FEW / max(len(axes.lines), FEW))
    for line in axes.lines:
        line.set_linewidth(wide)
        edge = Stroke(linewidth=1.65 * wide, foreground=style.faint)
        line.set_path_effects([edge, Normal()])
    for label in (axes.xaxis.label, axes.yaxis.label, *axes.texts):
        label.set(fontsize=letter, color=style.ink)
    axes.tick_params(labelsize=0.85 * letter, colors=style.ink, width=0.06 * letter, which="both")
    axes.grid(visible=True, color=style.faint, alpha=0.25, linewidth=0.06 * letter)
    for side, spine in axes.spines.items():
        spine.set(visible=side in ("left", "bottom"), color=style.faint, linewidth=0.08 * letter)


def key_columns(count: int) -> int:
    """Return how many columns a key of so many balls has: six stand below each other."""
    return -(-count // 6)


def draw_key(axes: Axes, style: Style, letter: float) -> None:
    """Say to the right of the plot which colour is which ball, in columns."""
    if not axes.lines:
        return
    key = axes.legend(
        loc="upper left", bbox_to_anchor=(1.0, 1.08), ncols=key_columns(len(axes.lines)),
        fontsize=0.85 * letter, labelcolor=style.ink, frameon=False, borderpad=0.2,
        handlelength=1.0, handletextpad=0.4, columnspacing=0.8, labelspacing=0.25,
    )  # fmt: skip
    key.set_gid("key")


def _scale(axes: Axes, apart: Array) -> None:
    """Make the axis logarithmic if the distances span a wide range; else it begins at zero."""
    shown = apart[np.isfinite(apart) & (apart > 0.0)]
    if not shown.size:
        axes.set_ylim(0.0, 1.0)
        same = "the same in both, to the last digit"
        axes.text(0.5, 0.5, same, ha="center", transform=axes.transAxes)
        return
    high = float(shown.max())
    low = max(float(shown.min()), DECADES * high)
    if high / low > WIDE_RANGE:
        axes.set_yscale("log", nonpositive="clip")
        axes.set_ylim(low, 2.0 * high)
    else:
        axes.set_ylim(0.0, 1.1 * high)
