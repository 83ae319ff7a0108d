"""This module draws the work-precision diagram: error and time on logarithmic axes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from pool_pymunk.render.canvas import Label, place_labels
from pool_pymunk.render.figure import Figure
from pool_pymunk.render.pictures import save_figure
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import SOLVERS, Solver
from pool_pymunk.studies.grid import SHARED_ENGINE, Setting, Tradeoff, order

HIDDEN = (
    "In the shaded region errors are smaller than the\nuncertainty of the ends that "
    "uncertain start positions\ncause ({}): more precision is of no use"
)
LETTER = 8.5  # points
NO_ORDER = 0.3  # If the slope of error over dt is smaller than this, the error does not converge.


def draw(result: Tradeoff, paths: Sequence[Path]) -> None:
    """Draw the diagram into each of ``paths``; the suffix (.png, .svg, .pdf) gives the format."""
    figure = figure_of(result)
    for path in paths:
        save_figure(figure, path)


def figure_of(result: Tradeoff) -> Figure:
    """Draw what :func:`draw` saves: a line for each solver, with its name at its end."""
    figure = Figure(figsize=(10.5, 6.5), layout="constrained")
    axes = figure.add_subplot()
    units = result.scene.units
    measured = [(s, result.of(s.name)) for s in SOLVERS.values() if result.of(s.name)]
    errors = [s.largest for _, settings in measured for s in settings]
    cut = Cut(units.from_si(error, "length") for error in errors if error > 0.0)
    axes.set_yscale("log")
    _dress(axes, cut, result)
    labels = [label for each in measured for label in _line(axes, cut, result, *each)]
    if result.spread is not None:
        hidden, left = units.from_si(result.spread, "length"), axes.get_xlim()[0]
        axes.axvspan(left, cut.place(hidden), color="#f0e442", alpha=0.25, linewidth=0)
        axes.set_xlim(left)
        axes.text(
            0.012, 0.985, HIDDEN.format(f"{hidden:.2g} {units.length}"), va="top",
            transform=axes.transAxes, fontsize=LETTER, color="#6b6200",
        )  # fmt: skip
    if len(result.exact) > 1:
        figure.supxlabel(SHARED_ENGINE, fontsize=LETTER, color="#555555")
    axes.margins(y=0.08)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    halo = [withStroke(linewidth=2, foreground="#ffffff")]
    place_labels(axes, labels, fontsize=LETTER, path_effects=halo)
    return figure


class Cut:
    """A cut axis shows the decades of values (above 0), but of a wide empty range only a strip.

    >>> Cut([2e-12, 0.03, 5.0]).ticks
    [-12, -11, -2, -1, 0, 1]
    """

    STRIP: ClassVar[float] = 1.6  # decades; the width of what stands for an empty range
    WIDE: ClassVar[int] = 3  # Only an empty range of this many decades is cut out.

    def __init__(self, values: Iterable[float]) -> None:
        lows = {math.floor(math.log10(value)) for value in values} or {0}
        self.ticks = sorted({tick for low in lows for tick in (low, low + 1)})  # decades
        gaps = np.diff(self.ticks)
        self.places = np.append(0.0, np.cumsum(np.where(gaps < self.WIDE, gaps, self.STRIP)))
        self.strips = (self.places[:-1][gaps >= self.WIDE] + self.STRIP / 2).tolist()

    def place(self, value: float) -> float:
        """Return the place of a value, in decades from the left end, clipped to the axis."""
        decade = math.log10(value) if value > 0.0 else -math.inf
        return float(np.interp(decade, self.ticks, self.places))


def _dress(axes: Axes, cut: Cut, result: Tradeoff) -> None:
    """Give the diagram its axes, with marks where empty decades are cut out, and its words."""
    axes.set_xticks(cut.places, [f"$10^{{{decade}}}$" for decade in cut.ticks])
    axes.set_xlim(-0.4, cut.places[-1] + 0.4)
    for x in cut.strips:
        axes.axvspan(x - 0.05, x + 0.05, color="#ffffff", linewidth=0, zorder=1.9)
        axes.text(
            x, 0.0, "//", transform=axes.get_xaxis_transform(), ha="center", va="center",
            weight="bold", gid="cut",
            bbox={"facecolor": "#ffffff", "edgecolor": "none", "pad": 1.0},
        )  # fmt: skip
    length = result.scene.units.length
    axes.set_xlabel(f"largest error of any ball's end ({length}): more precise to the left")
    axes.set_ylabel("time for all shots (ms): faster below")
    axes.set_title(f"Work and precision: {result.scene.title}", loc="left", fontsize=12)
    axes.grid(which="major", color="#dddddd", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _line(
    axes: Axes, cut: Cut, result: Tradeoff, solver: Solver, settings: list[Setting]
) -> list[Label]:
    """Draw the solver's line, and return the labels of its ends."""
    units = result.scene.units
    points = [(cut.place(units.from_si(s.largest, "length")), s.time * 1e3) for s in settings]
    size = 14 if solver.marker == "*" else 7
    looks: dict[str, Any] = {"color": solver.color, "marker": solver.marker, "ms": size}
    axes.plot(*zip(*points, strict=True), zorder=3, **looks)
    first, last = settings[0].dt, settings[-1].dt
    name = solver.name if last is None else f"{solver.name}, {step_text(last)}"
    about = _about(result, solver, settings)
    labels: list[Label] = [(f"{name}\n{about}".rstrip(), points[-1], solver.color)]
    if first is not None and len(settings) > 1:
        labels.append((step_text(first), points[0], solver.color))
    return labels


def _about(result: Tradeoff, solver: Solver, settings: list[Setting]) -> str:
    """Say how the solver's error shrinks with the step, or nothing where that is not known."""
    if solver.is_reference or max(s.largest for s in settings) < 100 * result.rounding:
        return f"exact to rounding{', no step' if solver.is_reference else ' at every step'}"
    table, places = result.scene.table, [ball.position for ball in result.scene.balls]
    # Errors as large (m) as the scene say nothing about the order.
    sides = np.ptp(table.outline if table else places, axis=0)
    size = float(sides.min() if table else max(sides.max(), 1e-9))
    slope = order(settings, result.rounding, 0.5 * size)
    if slope is None:
        return ""
    return f"order {slope:.1f}" if slope >= NO_ORDER else "does not converge to this contact law"
