"""This module draws where every ball may end: a cloud of ends, one point a sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import CircleCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path as Outline

from pool_pymunk.many import Batch
from pool_pymunk.model.arrays import Array
from pool_pymunk.render.balls import DrawnBall, circle, discs, draw_balls, draw_rings
from pool_pymunk.render.canvas import Figure, save_figure
from pool_pymunk.render.pictures import as_set_up
from pool_pymunk.render.sheet import Sheet, draw_caption, draw_sheet, picture_layout
from pool_pymunk.render.style import LOOK, PRINT, halo_color
from pool_pymunk.render.view import DOT, Show
from pool_pymunk.results.run import Run
from pool_pymunk.studies.sensitivity import Linear, Sensitivity, ellipse

DOTS = 0.9  # the radius of a point, in points
CLEAR = 0.75  # the strength of a point; where many lie on each other they are strongest
HAZE = 2.0  # the radius of the haze around all points together, in points
TAG = 0.38  # the radius of a label's spot, in that of the ball
MOST_ENDS = 20_000  # This many ends of a ball are drawn at most.
SHOWN = 0.03  # of a radius; a cloud is drawn if its standard deviation is at least this share


def cloud_picture(found: Sensitivity | None, path: Path, linear: Linear | None = None) -> None:
    """Draw the clouds of ends: starts as rings, reference ends as discs, samples as points.

    With a ``linear`` sensitivity, beside samples or alone, ellipses have 95 % of the ends within
    them. ``path`` ends in .png, .svg or .pdf.
    """
    study = found or linear
    assert study is not None
    run, errors = study.reference, study.uncertainty.described(study.reference.scene)
    key = "rings: starts; discs: the ends without errors"
    key += "; ellipses: 95 % of the ends by derivatives" * (linear is not None)
    said = errors if found is None else f"{found.samples:,} ends with {errors}"
    sheet = _sheet(run, run.name, said, key)
    start, end = (discs(run.scene, run.at(t)[0], sheet.views[0]) for t in (0.0, run.duration))
    draw_rings(sheet.axes, [a for a, b in zip(start, end, strict=True) if (a.x, a.y) != (b.x, b.y)])
    if found is not None:
        deviation = np.array([ball.deviation for ball in found.balls])
        _draw_ends(sheet, end, found.ends, deviation)
    for ball in () if found else end:
        _faded(sheet.axes, ball, np.array([(ball.x, ball.y)]), [])
    scale = sheet.views[0].scale
    for i, ball in enumerate(end):
        if linear is not None and scale * linear.std[i].max() >= SHOWN * ball.radius:
            corners = scale * ellipse(linear.covariance[i]) + (ball.x, ball.y)
            for color, width in ((halo_color(ball.color), 2.6), (ball.color, 1.3)):
                line = Polygon(corners, fc="none", ec=color, lw=width, zorder=2.7)
                sheet.axes.add_patch(line)
    save_figure(sheet.figure, path)


def batch_figure(batch: Batch) -> Figure:
    """Draw where the balls of many shots end: points, around discs at the medians."""
    scene = batch.scene
    played = batch.final[batch.ended]
    ends = played[:: max(1, -(-len(played) // MOST_ENDS))]
    shown = f"{len(ends):,} ends" + f" of {len(played):,}" * (len(ends) < len(played))
    sheet = _sheet(as_set_up(scene), shown)
    if len(ends):
        balls = discs(scene, np.nan_to_num(np.median(ends, axis=0)), sheet.views[0])
        _draw_ends(sheet, balls, ends, ends.std(axis=0).max(axis=1))
    return sheet.figure


def _sheet(run: Run, *words: str) -> Sheet:
    """Return a table or plane with a caption: the scene's title, and words."""
    show = Show((run,))
    layout = picture_layout(show)
    sheet = draw_sheet(show, layout, PRINT, (0.0, 1.0))
    text = DOT.join(part for part in (run.scene.title, *words) if part)
    draw_caption(sheet, layout, text, PRINT)
    return sheet


def _draw_ends(sheet: Sheet, balls: list[DrawnBall], ends: Array, spread: Array) -> None:
    """Draw the ``ends`` (S, N, 2) of balls on the table, with clouds where ``spread`` (m) shows."""
    there, view = np.isfinite(ends).all(axis=(0, 2)), sheet.views[0]
    clouds = there & (view.scale * spread >= SHOWN * np.array([ball.radius for ball in balls]))
    still = [balls[i] for i in np.flatnonzero(there & ~clouds)]
    if still:
        draw_balls(sheet.axes, still, PRINT)
    for i in np.flatnonzero(clouds):
        points = view.places(ends[:, i])
        _cloud(sheet.axes, balls[i], points)
        _faded(sheet.axes, balls[i], points, [b for b in balls if b is not balls[i]])


def _cloud(axes: Axes, ball: DrawnBall, points: Array) -> None:
    """Draw the points in the ball's colour, without rims, in a faint common haze."""
    unit = Outline.unit_circle()
    around = points[:, None] + HAZE * np.asarray(unit.vertices)
    haze = Outline(around.reshape(-1, 2), np.tile(np.asarray(unit.codes), len(points)))
    light = halo_color(ball.color)
    axes.add_artist(PathPatch(haze, facecolor=light, alpha=LOOK.halo, linewidth=0, zorder=2.5))
    dots = CircleCollection(
        [np.pi * DOTS**2], offsets=points, offset_transform=axes.transData, facecolor=ball.color,
        alpha=CLEAR, edgecolor="none", zorder=2.51,
    )  # fmt: skip
    axes.add_collection(dots, autolim=False)


def _faded(axes: Axes, ball: DrawnBall, points: Array, others: list[DrawnBall]) -> None:
    """Draw the reference run's end of a ball, and its label where there is most room on the rim."""
    line, ink, pale = 0.07 * ball.radius, PRINT.outline, (*to_rgb(ball.color), 0.45)
    circle(axes, ball, ball.radius - line / 2, fc=pale, ec=ink, lw=line, zorder=2.05)
    angles = np.arange(8) * np.pi / 4 + np.pi / 8
    rim = ball.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1) + (ball.x, ball.y)
    free = np.array([np.hypot(*(points - at).T).min() for at in rim])
    for other in others:
        free = np.minimum(free, np.hypot(*(rim - (other.x, other.y)).T) - other.radius)
    x, y = rim[free.argmax()]
    circle(axes, ball._replace(x=x, y=y), TAG * ball.radius, fc="#fff", ec=ink, lw=0.6, zorder=2.6)
    axes.text(
        x, y, ball.label, fontsize=1.2 * TAG * ball.radius, weight="bold", color=ink,
        ha="center", va="center_baseline", parse_math=False, zorder=2.61,
    )  # fmt: skip
