"""This module draws the work-precision diagram: error and time on logarithmic axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from pool_pymunk.render.canvas import Figure, save_figure
from pool_pymunk.solvers import SOLVERS, Solver
from pool_pymunk.studies.grid import SHARED_ENGINE, Setting, Tradeoff, order

HIDDEN = "less than uncertain starts\nmove the ends ({})"
NO_ORDER = 0.3  # If the slope of error over dt is smaller than this, the error does not converge.


def draw(result: Tradeoff, paths: Sequence[Path]) -> None:
    """Draw the diagram into each of ``paths``; the suffix (.png, .svg, .pdf) gives the format."""
    figure = figure_of(result)
    for path in paths:
        save_figure(figure, path)


def figure_of(result: Tradeoff) -> Figure:
    """Draw what :func:`draw` saves: a line for each solver, and a legend with its steps."""
    figure = Figure(figsize=(10.5, 5.5), layout="constrained")
    axes, units = figure.add_subplot(xscale="log", yscale="log"), result.scene.units
    axes.set_xlabel(f"largest error of any ball's end ({units.length}): more precise to the left")
    axes.set_ylabel(f"time for {result.measured_shots} (ms): faster below")
    axes.set_title(": ".join(filter(None, ("Work and precision", result.scene.title))), loc="left")
    axes.grid(color="#dddddd")
    for solver in SOLVERS.values():
        if settings := result.of(solver.name):
            _line(axes, result, solver, settings)
    if result.spread is not None:
        hidden, left = units.from_si(result.spread, "length"), axes.get_xlim()[0]
        said = HIDDEN.format(f"{hidden:.2g} {units.length}")
        axes.axvspan(left, hidden, color="#f0e442", alpha=0.25, linewidth=0, label=said)
        axes.set_xlim(left)
    if len(result.exact) > 1:
        figure.supxlabel(SHARED_ENGINE, fontsize="small", color="#555555")
    figure.legend(loc="outside right upper", fontsize="small", labelspacing=1.0)
    return figure


def _line(axes: Axes, result: Tradeoff, solver: Solver, settings: Sequence[Setting]) -> None:
    """Draw the solver's errors and times, and say which steps it has and what its order is."""
    units = result.scene.units
    errors = [units.from_si(s.largest, "length") for s in settings]
    steps = [s.text(units) for s in settings if s.fineness is not None]
    said = " to ".join(dict.fromkeys((*steps[:1], *steps[-1:])))
    words = "\n".join(filter(None, (solver.name, said, _about(result, solver, settings))))
    axes.plot(
        errors, [1e3 * s.time for s in settings], label=words, color=solver.color,
        marker=solver.marker, markersize=14 if solver.marker == "*" else 7,
    )  # fmt: skip
    for error, one in zip(errors, settings, strict=True):
        if one.contact_tolerance is not None:
            axes.annotate(
                one.text(units), (error, 1e3 * one.time), (8.0, 5.0), textcoords="offset points",
                size="small", color="#555555",
            )  # fmt: skip


def _about(result: Tradeoff, solver: Solver, settings: Sequence[Setting]) -> str:
    """Say how the solver's error shrinks with the step, or nothing where that is not known."""
    floor = result.rounding
    if any(s.contact_tolerance for s in settings):
        floor = result.last_digit
    elif solver.is_reference or max(s.largest for s in settings) < 100 * floor:
        return f"exact to rounding{', no step' if solver.is_reference else ' at every step'}"
    table, places = result.scene.table, [ball.position for ball in result.scene.balls]
    # Errors as large (m) as the scene say nothing about the order.
    sides = np.ptp(table.outline if table else places, axis=0)
    size = float(sides.min() if table else max(sides.max(), 1e-9))
    slope = order(settings, floor, 0.5 * size)
    if slope is None or (solver.is_reference and slope < NO_ORDER):
        return ""
    return f"order {slope:.1f}" if slope >= NO_ORDER else "does not converge to this contact law"
