"""The table of the extremes as a picture: where each solver breaks, and how badly."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from pool_pymunk.listing import step_text
from pool_pymunk.stability.extremes import EXTREMES, Extreme
from pool_pymunk.stability.suite import STEPS, Cell

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Blue against yellow to brown: told apart by the colour-blind, and by lightness in grey.
HOLDS, NOT_RUN = "#cde2f2", "#ececec"
DEGREES = (  # severity up to which, colour, in words
    (1e-6, "#fff4c9", "error below 1e-6"),
    (1e-3, "#fdd783", "below 1e-3"),
    (0.1, "#f6a243", "below 0.1"),
    (1.0, "#b5541a", "more, or a wrong outcome"),
)
LABEL, WIDE, NARROW, GAP, HEIGHT = 3.1, 2.35, 0.95, 0.15, 0.6  # in
HEAD, FOOT = 1.35, 0.75  # in
TITLE = "Stability at the extremes: where each solver breaks, and how badly"
SCALE = "error as a share of a ball's radius, of the energy, or of the speed"


def draw(cells: Sequence[Cell], path: Path) -> None:
    """Draw the heat map of the cells; its suffix (.png, .svg, .pdf) says the format."""
    found = {(cell.extreme, cell.solver): cell for cell in cells}
    rows = [e for e in EXTREMES if any(name == e.name for name, _ in found)]
    steps = [dt for dt in STEPS["pymunk"] if any(cell.distance(dt or 0.0) for cell in cells)]
    width = LABEL + WIDE * len(STEPS) + (GAP + NARROW * len(steps) if steps else 0.0) + 0.2
    height = HEAD + HEIGHT * len(rows) + FOOT
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(height, 0.0))
    axes.axis("off")
    _headings(axes, steps)
    for k, extreme in enumerate(rows):
        top = HEAD + HEIGHT * k
        _label(axes, extreme, top)
        for column, solver in enumerate(STEPS):
            _verdict(axes, found.get((extreme.name, solver)), LABEL + WIDE * column, top)
        exact = found.get((extreme.name, "pymunk"))
        for column, dt in enumerate(steps):
            left = LABEL + WIDE * len(STEPS) + GAP + NARROW * column
            _distance(axes, exact.distance(dt or 0.0) if exact else None, left, top)
    _legend(axes, HEAD + HEIGHT * len(rows) + 0.2)
    figure.savefig(path, dpi=120)


def _headings(axes: Axes, steps: Sequence[float | None]) -> None:
    axes.text(0.15, 0.3, TITLE, fontsize=16, weight="bold", va="center")
    axes.text(0.15, HEAD - 0.12, "extreme", fontsize=10, color="#555555", va="bottom")
    for column, solver in enumerate(STEPS):
        left = LABEL + WIDE * column
        axes.text(left + 0.05, HEAD - 0.12, solver, fontsize=11, weight="bold", va="bottom")
    left = LABEL + WIDE * len(STEPS) + GAP
    if steps:
        text = "pymunk: largest distance from\nthe exact run (m), by step"
        axes.text(left + 0.05, HEAD - 0.38, text, fontsize=9, color="#555555", va="bottom")
    for column, dt in enumerate(steps):
        label = step_text(dt or 0.0)
        axes.text(left + 0.05 + NARROW * column, HEAD - 0.12, label, fontsize=10, va="bottom")


def _label(axes: Axes, extreme: Extreme, top: float) -> None:
    axes.text(0.15, top + 0.21, extreme.name, fontsize=10.5, weight="bold", va="center")
    axes.text(0.15, top + 0.42, extreme.about, fontsize=8, color="#555555", va="center")


def _verdict(axes: Axes, cell: Cell | None, left: float, top: float) -> None:
    color, text = NOT_RUN, ""
    if cell is not None:
        worst = cell.worst
        color = HOLDS if worst is None else _degree(worst.severity)
        text = str(cell) if cell.run else cell.left_out
        color = color if cell.run else NOT_RUN
    _box(axes, (left, top), WIDE, color)
    _text(axes, text, left, top, color, bold=text.startswith("holds"))


def _degree(severity: float) -> str:
    return next(color for most, color, _ in DEGREES if min(severity, 1.0) <= most)


def _distance(axes: Axes, distance: float | None, left: float, top: float) -> None:
    _box(axes, (left, top), NARROW, "#ffffff" if distance is not None else NOT_RUN)
    if distance is not None:
        text = f"{distance:.0e}" if distance > 0.0 else "0"
        axes.text(left + NARROW / 2, top + HEIGHT / 2, text, fontsize=9, ha="center", va="center")


def _box(axes: Axes, corner: tuple[float, float], width: float, color: str) -> None:
    axes.add_patch(
        Rectangle((corner[0] + 0.02, corner[1] + 0.02), width - 0.04, HEIGHT - 0.04,
                  facecolor=color, edgecolor="#bbbbbb", linewidth=0.6)
    )  # fmt: skip


def _text(axes: Axes, text: str, left: float, top: float, color: str, bold: bool) -> None:
    lines = textwrap.wrap(text, 38)[:3]
    dark = color == DEGREES[-1][1]
    axes.text(
        left + 0.08, top + HEIGHT / 2, "\n".join(lines), va="center",
        fontsize=10 if bold and len(lines) == 1 else 8, color="#ffffff" if dark else "#222222",
    )  # fmt: skip


def _legend(axes: Axes, top: float) -> None:
    entries = [(HOLDS, "holds"), *((color, words) for _, color, words in DEGREES)]
    for k, (color, words) in enumerate([*entries, (NOT_RUN, "not run")]):
        left = LABEL + 1.9 * k
        axes.add_patch(Rectangle((left, top), 0.3, 0.2, facecolor=color, edgecolor="#bbbbbb"))
        axes.text(left + 0.38, top + 0.1, words, fontsize=9, va="center")
    axes.text(LABEL, top + 0.38, SCALE, fontsize=9, color="#555555", va="center")
