"""This module plots against time: distances of two runs, energy and momentum of one."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import Normal, Stroke

from pool_pymunk.model.arrays import Array
from pool_pymunk.render.canvas import Figure, dress
from pool_pymunk.render.style import LOOK, PRINT, Style, ball_colors, by_number, dashes
from pool_pymunk.render.view import Show
from pool_pymunk.results.run import Run

SAMPLES = 1500
KEY_ROWS = 6  # balls below each other in a key
ENERGY, MOMENTUM = "#0072b2", "#d55e00"  # of Okabe and Ito's palette
HEADROOM = 1.08  # of the largest value shown


def plot_distances(
    axes: Axes, show: Show, times: tuple[float, float], style: Style, letter: float
) -> None:
    """Plot the distances of two runs at ``times`` (s), ball by ball, with a key."""
    runs = show.runs
    scene, t = runs[0].scene, np.linspace(*times, SAMPLES)
    gap = (runs[0].at(t)[0] - runs[1].at(t)[0]) / scene.units.to_si(1.0, "length")
    apart = np.hypot(gap[..., 0], gap[..., 1])
    moved = np.flatnonzero((apart > 0.0).any(axis=0))
    wide = 0.18 * letter * math.sqrt(LOOK.few / max(len(moved), LOOK.few))
    edge = [Stroke(linewidth=1.65 * wide, foreground=style.faint), Normal()]
    colors, broken = ball_colors(scene), dashes(scene)
    for id_ in by_number(scene.balls[k].id for k in moved):
        k = scene.index[id_]
        (line,) = axes.plot(t, apart[:, k], color=colors[k], label=id_, linewidth=wide)
        line.set(path_effects=edge, dashes=broken[k], dash_capstyle="butt")
    shown = apart[np.isfinite(apart) & (apart > 0.0)]
    if shown.size:  # The axis is logarithmic if the distances span a wide range.
        high = float(shown.max())
        low = max(float(shown.min()), LOOK.decades * high)
        wide_range = high / low > LOOK.wide_range
        axes.set_yscale("log" if wide_range else "linear")
        axes.set_ylim((low, 2.0 * high) if wide_range else (0.0, 1.1 * high))
    else:
        same = "the same in both, to the last digit"
        axes.text(0.5, 0.5, same, ha="center", transform=axes.transAxes, fontsize=letter)
    axes.set_xlim(t[0], max(t[-1], t[0] + 1e-9))
    axes.set(xlabel="time (s)", ylabel=f"apart ({scene.units.length})")
    axes.grid(visible=True, color=style.faint, alpha=0.25, linewidth=0.06 * letter)
    axes.tick_params(width=0.06 * letter, which="both")
    axes.spines[:].set_linewidth(0.08 * letter)
    dress(axes, style, letter)
    if axes.lines:
        axes.legend(
            loc="upper left", bbox_to_anchor=(1.0, 1.08), ncols=-(-len(axes.lines) // KEY_ROWS),
            fontsize=0.85 * letter, labelcolor=style.ink, frameon=False, borderpad=0.2,
            handlelength=1.8, handletextpad=0.4, columnspacing=0.8, labelspacing=0.25,
        )  # fmt: skip


def energy_figure(run: Run, style: Style = PRINT) -> Figure:
    """Draw the energy of all balls, and below it the size of their momentum, against time."""
    t, *values = energy_and_momentum(run)
    contacts = [event.t for event in run.events if event.is_contact]
    figure = Figure(figsize=(10.0, 6.0), layout="constrained", facecolor=style.page)
    what = "energy, with that of height" if run.scene.is_tilted else "kinetic energy"
    what += ", with that of rolling" * run.scene.surface.rolls
    names, colors = (f"{what} (J)", "size of momentum (N s)"), (ENERGY, MOMENTUM)
    plots = figure.subplots(2, 1, sharex=True)
    for axes, curve, name, color in zip(plots, values, names, colors, strict=True):
        axes.plot(t, curve, color=color, linewidth=1.8)
        axes.vlines(
            contacts, 0.0, 1.0, transform=axes.get_xaxis_transform(), color=style.faint,
            alpha=0.35, linewidth=0.8, zorder=0,
        )  # fmt: skip
        top = HEADROOM * float(curve.max()) or 1.0
        axes.set(xlim=(0.0, max(float(t[-1]), 1e-9)), ylim=(0.0, top), ylabel=name)
        axes.locator_params(axis="y", nbins=5)
        axes.grid(axis="y", color=style.faint, alpha=0.25, linewidth=0.6)
        dress(axes, style)
    plots[0].set_title(Show((run,)).caption(""), loc="left", fontsize=11, color=style.ink, pad=10.0)
    plots[1].set_xlabel("time (s); the upright lines are contacts")
    figure.align_ylabels()
    return figure


def energy_and_momentum(run: Run) -> tuple[Array, Array, Array]:
    """Return times (s), and energy (J) and size of momentum (N s) of all balls, each (T,)."""
    breaks = np.concatenate([breakpoints[:, 0] for breakpoints in run.knots])
    even = np.linspace(0.0, run.duration, SAMPLES)
    # Every breakpoint comes twice: just before it, and when it has happened.
    t = np.unique(np.concatenate([even, breaks, np.nextafter(breaks, -np.inf)]))
    t = t[(t >= 0.0) & (t <= run.duration)]
    mass = np.array([ball.mass for ball in run.scene.balls])
    momentum = np.einsum("tnk,n->kt", run.at(t)[1], mass)
    return t, run.energy_at(t), np.hypot(*momentum)
