"""This module draws how far measured places lie from fitted ones."""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from numpy.linalg import norm

from pool_pymunk.render.canvas import Figure, dress, save_figure
from pool_pymunk.render.style import PRINT, Style
from pool_pymunk.studies import Mask
from pool_pymunk.studies.fit import Fit

BEFORE, AFTER = "#8a9199", "#0072b2"
OUT = "#d55e00"  # places that were left out, or that lie beyond the frame
SHARP = 1e-9  # m; a place that is nearer was never in doubt, and is not drawn
NEAREST = 0.03  # sigma; nearer places are drawn at this distance
MOST_NUMBERS = 6  # in the title
MOST_LINES = 45  # With more lines than this, each shot has one line, and its balls have none.
FRAME = 4.0  # sigma; half the width of the frame of the second plot
NARROW = 20  # If lines have more dots than this on average, the dots are faint.


def residuals_picture(found: Fit, path: Path, *, dpi: float = 150.0, style: Style = PRINT) -> None:
    """Draw how far measured places lie from the fit before and after it, and in which direction."""
    off = np.maximum(*(norm(each, axis=-1) for each in (found.residuals, found.residuals_before)))
    shown = off > SHARP
    lines = _lines(found, np.flatnonzero(shown).tolist())
    size = (12.0, max(4.6, 1.6 + 0.24 * len(lines)))
    figure = Figure(size, facecolor=style.page, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    _draw_distances(left, found, lines, style)
    _draw_frame(right, found, shown & found.used, style)
    names = [*found.values]
    numbers = ", ".join(f"{name} = {found.written(name)}" for name in names[:MOST_NUMBERS])
    if len(names) > MOST_NUMBERS:
        numbers += f" and {len(names) - MOST_NUMBERS} more"
    hidden = int((~shown).sum())
    beside = f" ({hidden} of them are exact and not drawn)" if hidden else ""
    figure.suptitle(
        f"{found.scene.title or 'Fit'}: {len(found.measured)} places{beside}\n{numbers}",
        x=0.01, ha="left", fontsize=11, color=style.ink, parse_math=False, wrap=True,
    )  # fmt: skip
    save_figure(figure, path, dpi)


def _lines(found: Fit, places: list[int]) -> dict[str, list[int]]:
    """Return the places on each line: a line for each ball of a shot, or for each shot."""
    shots = [shot.name for shot in found.scene.shots] or ["as set up"]
    by_ball, by_shot = defaultdict(list), defaultdict(list)
    for m, one in ((m, found.measured[m]) for m in places):
        by_shot[shots[one.shot - 1]].append(m)
        by_ball[f"{shots[one.shot - 1]}, {one.ball}"].append(m)
    return by_ball if len(by_ball) <= MOST_LINES else by_shot


def _scales(found: Fit) -> tuple[float, float]:
    """Return a metre in the scene's unit, and the error of a coordinate (m) or its stand-in."""
    known = [found.sigma, found.rms / math.sqrt(2.0), SHARP]
    sigma = next(sigma for sigma in known if math.isfinite(sigma) and sigma > 0.0)
    return found.scene.units.from_si(1.0, "length"), sigma


def _draw_distances(axes: Axes, found: Fit, lines: dict[str, list[int]], style: Style) -> None:
    """Draw distances on a logarithmic axis: rings before the fit, dots after it."""
    unit, sigma = _scales(found)
    before, after = (
        np.maximum(norm(each, axis=-1), max(NEAREST * sigma, SHARP)) * unit
        for each in (found.residuals_before, found.residuals)
    )
    line_of = {m: y for y, places in enumerate(lines.values()) for m in places}
    every = np.array(list(line_of), dtype=int)
    used = found.used[every]
    strength = 0.35 if len(every) > NARROW * len(lines) else 1.0
    ring, dot = {"mfc": "none", "ms": 5.5, "mew": 1.0}, {"ms": 4.0, "mew": 0.0}
    for values, chosen, color, label, looks in (
        (before, every, BEFORE, "the scenario's own numbers", ring),
        (after, every[used], AFTER, "fitted", dot | {"mfc": AFTER}),
        (after, every[~used], OUT, "left out" if not used.all() else None, dot | {"mfc": OUT}),
    ):
        ys = [line_of[m] for m in chosen]
        axes.plot(values[chosen], ys, "o", alpha=strength, mec=color, label=label, **looks)
    axes.axvspan(0.0, 2.0 * sigma * unit, color="#f0e442", alpha=0.25, linewidth=0)
    axes.set_xscale("log")
    axes.set_yticks(range(len(lines)), list(lines), parse_math=False)
    axes.set_ylim(len(lines) - 0.4, -0.6)
    length = found.scene.units.length
    axes.set_xlabel(f"distance of measured and fitted place ({length}); shaded: within 2 sigma")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False, fontsize=9)
    axes.grid(axis="y", color=style.faint, alpha=0.25, linewidth=0.6)
    dress(axes, style)


def _draw_frame(axes: Axes, found: Fit, drawn: Mask, style: Style) -> None:
    """Draw the residuals in a frame of some sigma; what lies beyond is drawn at its edge."""
    unit, sigma = _scales(found)
    sigma *= unit
    off, edge = found.residuals[drawn] * unit, FRAME * sigma
    farthest = np.abs(off).max(axis=1, keepdims=True, initial=SHARP * unit)
    shown = off * np.minimum(0.97 * edge / farthest, 1.0)
    beyond = farthest[:, 0] > edge
    halo = [withStroke(linewidth=2, foreground=style.page)]
    for sigmas in (1.0, 2.0):
        circle = Circle((0.0, 0.0), sigmas * sigma, fill=False, color=style.faint, lw=0.8)
        axes.add_patch(circle)
        axes.annotate(
            f"{sigmas:g} sigma", (0.0, sigmas * sigma), ha="center", va="bottom",
            fontsize=8, zorder=4, path_effects=halo,
        )  # fmt: skip
    strength = 0.35 if len(off) > 10 * NARROW else 0.9
    axes.plot(*shown[~beyond].T, "o", color=AFTER, ms=4.0, mew=0, alpha=strength)
    axes.plot(*shown[beyond].T, "D", color=OUT, ms=5.0, mew=0)
    words = f"; {beyond.sum()} beyond the frame (at its edge)" if beyond.any() else ""
    x, y = (f"measured less fitted {k} ({found.scene.units.length})" for k in "xy")
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal", xlabel=x + words, ylabel=y)
    for line in (axes.axhline, axes.axvline):
        line(0.0, color=style.faint, alpha=0.4, linewidth=0.6)
    dress(axes, style)
