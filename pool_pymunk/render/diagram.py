"""This module draws the work-precision diagram: error and time on logarithmic axes.

Each solver has a line.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import SOLVERS, Solver
from pool_pymunk.studies.tradeoff import SHARED_ENGINE, Setting, Tradeoff, order

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NO_ORDER = 0.3  # If the slope of error over dt is smaller than this, the error does not converge.


def draw(result: Tradeoff, paths: Sequence[Path]) -> None:
    """Draw the diagram into each of ``paths``; the suffix (.png, .svg, .pdf) gives the format."""
    figure = Figure(figsize=(9.5, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    units = result.scene.units
    for solver in SOLVERS.values():
        if settings := result.of(solver.name):
            _line(axes, result, solver, settings)
    axes.set_xscale("log")
    axes.set_yscale("log")
    if result.spread is not None:
        _band(axes, units.from_si(result.spread, "length"), units.length)
    axes.set_xlabel(f"largest error of any ball's end ({units.length}): more precise to the left")
    axes.set_ylabel("time for all shots (ms): faster below")
    axes.set_title(f"Work and precision: {result.scene.title}", loc="left", fontsize=12)
    axes.grid(which="major", color="#dddddd", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=True, framealpha=0.9, fontsize=9, loc="center", bbox_to_anchor=(0.42, 0.55))
    if len(result.exact) > 1:
        figure.supxlabel(SHARED_ENGINE, fontsize=8.5, color="#555555")
    for path in paths:
        figure.savefig(path, dpi=200)


def _line(axes: Axes, result: Tradeoff, solver: Solver, settings: list[Setting]) -> None:
    units = result.scene.units
    errors = [units.from_si(s.largest, "length") for s in settings]
    times = [s.time * 1e3 for s in settings]
    color, marker = solver.color, solver.marker
    size = 14 if marker == "*" else 7
    label = _label(result, solver, settings)
    axes.plot(errors, times, color=color, marker=marker, markersize=size, label=label)
    if settings[0].dt is not None:
        shown = {0: settings[0], len(settings) - 1: settings[-1]}
        for k, s in shown.items():
            assert s.dt is not None
            axes.annotate(
                step_text(s.dt),
                (errors[k], times[k]),
                xytext=(8, -3 if k == 0 else 4),
                textcoords="offset points",
                fontsize=8,
                color=color,
            )


def _label(result: Tradeoff, solver: Solver, settings: list[Setting]) -> str:
    """Return the solver's name, and how its error shrinks with the step."""
    slope = order(settings, result.rounding, 0.5 * _size(result))
    if solver.is_yardstick:
        return f"{solver.name}: exact to rounding, no step"
    if max(s.largest for s in settings) < 100 * result.rounding:
        return f"{solver.name}: exact to rounding at every step"
    if slope is not None and slope < NO_ORDER:
        return f"{solver.name}: does not converge to this contact law"
    return solver.name if slope is None else f"{solver.name}: order {slope:.1f}"


def _size(result: Tradeoff) -> float:
    """Return the size of the scene (m): an error of that size says only that all is lost."""
    xs = [ball.position[0] for ball in result.scene.balls]
    ys = [ball.position[1] for ball in result.scene.balls]
    if result.scene.table is not None:
        x0, y0, x1, y1 = result.scene.table.bounds
        return min(x1 - x0, y1 - y0)
    return max(max(xs) - min(xs), max(ys) - min(ys), 1e-9)


def _band(axes: Axes, spread: float, unit: str) -> None:
    """Shade the errors that the input's uncertainty hides."""
    left, right = axes.get_xlim()
    axes.axvspan(left, spread, color="#f0e442", alpha=0.25, linewidth=0)
    axes.set_xlim(left, right)
    axes.text(
        0.012, 0.985,
        f"In the shaded region errors are smaller than what the\nuncertainty of the start "
        f"positions does to the ends ({spread:.2g} {unit}):\nmore precision buys nothing",
        transform=axes.transAxes, fontsize=8.5, color="#6b6200", va="top",
    )  # fmt: skip
