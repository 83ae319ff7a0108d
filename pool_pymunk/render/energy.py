"""This module draws the energy and the momentum of a run against time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pool_pymunk.physics.motion import Array
from pool_pymunk.render.canvas import dress
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
    t, *values = energy_and_momentum(run)
    contacts = [event.t for event in run.events if event.is_contact]
    figure = Figure(figsize=(10.0, 6.0), layout="constrained", facecolor=style.page)
    names, colors = ("kinetic energy (J)", "size of momentum (kg m/s)"), (ENERGY, MOMENTUM)
    plots = figure.subplots(2, 1, sharex=True)
    for axes, curve, name, color in zip(plots, values, names, colors, strict=True):
        axes.plot(t, curve, color=color, linewidth=1.8)
        axes.vlines(
            contacts, 0.0, 1.0, transform=axes.get_xaxis_transform(), color=style.faint,
            alpha=0.35, linewidth=0.8, zorder=0,
        )  # fmt: skip
        axes.set_xlim(0.0, max(float(t[-1]), 1e-9))
        axes.set_ylim(0.0, HEADROOM * float(curve.max()) or 1.0)
        axes.set_ylabel(name)
        axes.locator_params(axis="y", nbins=5)
        axes.grid(axis="y", color=style.faint, alpha=0.25, linewidth=0.6)
    plots[0].set_title(Show((run,)).caption(""), loc="left", fontsize=11, color=style.ink, pad=10.0)
    plots[1].set_xlabel("time (s); the upright lines are contacts")
    for axes in plots:
        dress(axes, style)
    figure.align_ylabels()
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
