"""This module draws the energy and the momentum of a run against time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pool_pymunk.physics.motion import Array
from pool_pymunk.render.sheet import Show
from pool_pymunk.render.style import PRINT, Style
from pool_pymunk.results.run import Run

SAMPLES = 1500
ENERGY, MOMENTUM = "#0072b2", "#d55e00"  # of Okabe and Ito's palette
HEADROOM = 1.08  # of the largest value shown


def energy_figure(run: Run, style: Style = PRINT) -> Figure:
    """Draw the kinetic energy of all balls, and below it the size of their momentum, against time.

    Faint upright lines in both are contacts.
    """
    t, energy, momentum = energy_and_momentum(run)
    figure = Figure(figsize=(10.0, 6.0), layout="constrained", facecolor=style.page)
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    _curve(upper, t, energy, ENERGY, style)
    _curve(lower, t, momentum, MOMENTUM, style)
    upper.set_ylabel("kinetic energy (J)", color=style.ink)
    lower.set_ylabel("size of momentum (kg m/s)", color=style.ink)
    lower.set_xlabel("time (s); the upright lines are contacts", color=style.ink)
    contacts = [event.t for event in run.events if event.is_contact]
    for axes in (upper, lower):
        for at in contacts:
            axes.axvline(at, color=style.faint, alpha=0.35, linewidth=0.8, zorder=0)
    figure.align_ylabels()
    upper.set_title(Show((run,)).caption(""), loc="left", fontsize=11, color=style.ink, pad=10.0)
    return figure


def energy_and_momentum(run: Run) -> tuple[Array, Array, Array]:
    """Return times (s), and the energy (J) and size of momentum (kg m/s) of all balls, each (T,).

    Every breakpoint comes twice: just before it, and when it has happened.
    """
    breaks = np.concatenate([knots[:, 0] for knots in run.knots])
    even = np.linspace(0.0, run.duration, SAMPLES)
    t = np.unique(np.concatenate([even, breaks, np.nextafter(breaks, -np.inf)]))
    t = t[(t >= 0.0) & (t <= run.duration)]
    mass = np.array([ball.mass for ball in run.scene.balls])
    _, velocity = run.at(t)
    energy = 0.5 * (velocity**2).sum(axis=2) @ mass
    momentum = np.einsum("tnk,n->tk", velocity, mass)
    return t, energy, np.hypot(momentum[:, 0], momentum[:, 1])


def _curve(axes: Axes, t: Array, values: Array, color: str, style: Style) -> None:
    """Draw one curve from zero upwards."""
    axes.plot(t, values, color=color, linewidth=1.8)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlim(0.0, max(float(t[-1]), 1e-9))
    axes.set_ylim(0.0, HEADROOM * float(values.max()) or 1.0)
    axes.set_facecolor("none")
    axes.grid(axis="y", color=style.faint, alpha=0.25, linewidth=0.6)
    axes.tick_params(colors=style.ink)
    for side, spine in axes.spines.items():
        spine.set(visible=side in ("left", "bottom"), color=style.faint)
