"""This module draws the table of the extremes: where each solver breaks, and how badly."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from pool_pymunk.model import Point
from pool_pymunk.render.figure import Figure
from pool_pymunk.render.pictures import save_figure
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import find_solver
from pool_pymunk.studies.stability.extremes import EXTREMES
from pool_pymunk.studies.stability.suite import Cell, columns, notes

# Blue against yellow to brown can be distinguished by the colour-blind, and in grey by lightness.
FAINT, EDGE = "#555555", "#bbbbbb"
HOLDS, NOT_RUN = "#cde2f2", "#ececec"
DEGREES = (  # Each row has a severity, the colour up to it, and its words.
    (1e-6, "#fff4c9", "error below 1e-6"),
    (1e-3, "#fdd783", "below 1e-3"),
    (0.1, "#f6a243", "below 0.1"),
    (1.0, "#b5541a", "more, or a wrong outcome"),
)
LABEL, WIDE, NARROW, GAP, HEIGHT = 3.4, 2.35, 0.85, 0.15, 0.6  # in
HEAD, FOOT = 1.8, 0.75  # in
TITLE = "Stability at the extremes: where each solver breaks, and how badly"
HOLDING = (
    "holds: all numbers are finite, the run ends as it must, energy and momentum are kept, and no "
    "ball is in a cushion or in another ball.\nA second run and another order of the balls give "
    "the same and, without losses, reversed velocities lead back to the start.\nBefore chaos, "
    "balls are where the reference run has them: up to rounding, or up to the distance of a step "
    "for solvers that answer contacts at the end of a step."
)
SCALE = "error as a share of a ball's radius, of the energy, or of the speed"


def draw(cells: Sequence[Cell], path: Path) -> None:
    """Draw the heat map of the cells; the suffix (.png, .svg, .pdf) gives the format."""
    found = {(cell.extreme, cell.solver): cell for cell in cells}
    rows = [e for e in EXTREMES if any(name == e.name for name, _ in found)]
    used = {solver.name: _steps_used(cells, solver.name) for solver in columns()}
    # One solver has steps and must be exact at each of them: its distance at each step is shown.
    in_steps = next((solver.name for solver in columns() if solver.exact and solver.dt), "")
    steps, beside = used.get(in_steps, []), LABEL + WIDE * len(used) + GAP
    width = beside + NARROW * max(len(steps), 3)
    reasons = [line for note in notes(cells) for line in textwrap.wrap(note, 170)]
    foot = HEAD + HEIGHT * len(rows) + 0.2
    height = foot + FOOT - 0.2 + 0.2 * len(reasons)
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(height, 0.0))
    axes.axis("off")
    _headings(axes, used, in_steps)
    for k, extreme in enumerate(rows):
        top = HEAD + HEIGHT * k
        axes.text(0.15, top + 0.21, extreme.name, fontsize=10.5, weight="bold", va="center")
        axes.text(0.15, top + 0.42, extreme.about, fontsize=8, color=FAINT, va="center")
        for column, solver in enumerate(used):
            color, text = _verdict(found.get((extreme.name, solver)))
            _box(axes, (LABEL + WIDE * column, top), WIDE, color, text)
        exact = found.get((extreme.name, in_steps))
        for column, dt in enumerate(steps):
            distance = exact.distance(dt) if exact else None
            text = "" if distance is None else f"{distance:.0e}" if distance > 0.0 else "0"
            color = NOT_RUN if distance is None else "#ffffff"
            _box(axes, (beside + NARROW * column, top), NARROW, color, text)
    _legend(axes, foot)
    axes.text(LABEL, foot + 0.55, "\n".join(reasons), fontsize=9, color=FAINT, va="top")
    save_figure(figure, path, 120)


def _steps_used(cells: Sequence[Cell], solver: str) -> list[float]:
    """Return the steps (s) that a solver was tried with, except in the row about steps."""
    about_steps = {extreme.name for extreme in EXTREMES if extreme.steps}
    tried = (c for c in cells if c.solver == solver and c.extreme not in about_steps)
    return sorted({o.dt for cell in tried for o in cell.outcomes if o.dt}, reverse=True)


def _headings(axes: Axes, used: Mapping[str, Sequence[float]], in_steps: str) -> None:
    axes.text(0.15, 0.3, TITLE, fontsize=16, weight="bold", va="center")
    axes.text(0.15, 0.72, HOLDING, fontsize=9, color=FAINT, va="center", linespacing=1.4)
    axes.text(0.15, HEAD - 0.12, "extreme", fontsize=10, color=FAINT, va="bottom")
    for column, (solver, steps) in enumerate(used.items()):
        left = LABEL + WIDE * column + 0.05
        about = ", ".join(map(step_text, steps))
        about = "exact, no step" if find_solver(solver).is_reference else about
        axes.text(left, HEAD - 0.34, solver, fontsize=11, weight="bold", va="bottom")
        axes.text(left, HEAD - 0.12, about, fontsize=9, color=FAINT, va="bottom")
    if in_steps in used:
        left = LABEL + WIDE * len(used) + GAP + 0.05
        text = f"{in_steps}: largest distance from\nthe reference run (m), before chaos"
        axes.text(left, HEAD - 0.38, text, fontsize=9, color=FAINT, va="bottom")
        for column, dt in enumerate(used[in_steps]):
            axes.text(left + NARROW * column, HEAD - 0.12, step_text(dt), fontsize=10, va="bottom")


def _verdict(cell: Cell | None) -> tuple[str, str]:
    """Return the colour of a cell, and what it says."""
    color, text = NOT_RUN, cell.left_out if cell is not None else ""
    if cell is not None and cell.run:
        text, severity = str(cell), min(cell.worst.severity, 1.0) if cell.worst else -1.0
        color = next((color for most, color, _ in DEGREES if 0.0 <= severity <= most), HOLDS)
    return color, "\n".join(textwrap.wrap(text, 38)[:3])


def _box(axes: Axes, at: Point, width: float, color: str, text: str) -> None:
    """Draw a box with text in it: at the left, or in the middle of a narrow one."""
    left, top = at
    size, ink = (width - 0.04, HEIGHT - 0.04), "#ffffff" if color == DEGREES[-1][1] else "#222222"
    axes.add_patch(Rectangle((left + 0.02, top + 0.02), *size, fc=color, ec=EDGE, lw=0.6))
    x, ha, letter = left + 0.08, "left", 10 if text.startswith("holds") and "\n" not in text else 8
    if width == NARROW:
        x, ha, letter = left + width / 2, "center", 9
    axes.text(x, top + HEIGHT / 2, text, ha=ha, va="center", fontsize=letter, color=ink)


def _legend(axes: Axes, top: float) -> None:
    entries = [(HOLDS, "holds"), *((color, words) for _, color, words in DEGREES)]
    for k, (color, words) in enumerate([*entries, (NOT_RUN, "not run")]):
        left = LABEL + 2.3 * k
        axes.add_patch(Rectangle((left, top), 0.3, 0.2, facecolor=color, edgecolor=EDGE))
        axes.text(left + 0.38, top + 0.1, words, fontsize=9, va="center")
    axes.text(LABEL, top + 0.38, SCALE, fontsize=9, color=FAINT, va="center")
