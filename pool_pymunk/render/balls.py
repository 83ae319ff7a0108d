"""This module draws balls, ghosts of balls, their tracks and the arrows of a shot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Circle, FancyArrowPatch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D

from pool_pymunk.model import Point, Scene
from pool_pymunk.physics.motion import Array, free_motions
from pool_pymunk.render.style import IVORY, LOOK, Style, ball_colors, halo_color, striped
from pool_pymunk.render.view import View
from pool_pymunk.results.run import Run

Color = tuple[float, float, float, float]
CAPITAL = 0.73  # height of the font's capitals and digits, in its size
CORNERS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])  # the first is preferred
CLEARLY = 0.3  # in half the height of a label
BOLD = FontProperties(family="DejaVu Sans", weight="bold")
LEGIBLE = 0.34  # in ``letter``; if capitals are smaller, the label stands beside the ball
SOFT = 14  # A soft shadow or light consists of this number of circles.
PALE = 0.7  # the strength of a ghost's track
STRAIGHT = 1e-9  # A track bends if its acceleration is farther off its velocity than this share.
CHORDS = 16  # A parabola is drawn as this number of straight lines.
HALO = 0.6  # the strength of the halo around tracks, rings and balls


class DrawnBall(NamedTuple):
    """A disc is a ball on the canvas, in points.

    It has a centre, a radius, and the size of small letters there.
    """

    x: float
    y: float
    radius: float
    color: str
    label: str
    letter: float
    striped: bool = False

    @property
    def spot(self) -> float:
        """Return the white spot's radius: half the ball's, or more if that could not be read."""
        return min(max(LOOK.spot * self.radius, 0.55 * self.letter), 0.72 * self.radius)

    @property
    def is_labelled_inside(self) -> bool:
        """Tell whether the label can be read in the spot."""
        height: float = _lettering(self.label).get_extents().height
        return self.spot * height > LEGIBLE * self.letter


def discs(scene: Scene, position: Array, view: View) -> list[DrawnBall]:
    """Return the scene's balls as ``view`` shows them at ``position`` (N, 2), m."""
    places = [view.place((float(x), float(y))) for x, y in position]
    return [
        DrawnBall(*place, view.scale * ball.radius, color, ball.id, view.letter, stripe)
        for ball, place, color, stripe in zip(
            scene.balls, places, ball_colors(scene), striped(scene), strict=True
        )
    ]


def draw_balls(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw balls with their labels: inside, or beside those that are too small."""
    draw_bodies(axes, balls, style)
    labels = Labels(balls)
    places = labels.place(np.array([(ball.x, ball.y) for ball in balls]))
    for ball, middle in zip(labels.balls, places.tolist(), strict=True):
        draw_label(axes, ball, middle, style)


def draw_bodies(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw balls, each with shadow, dark outline and soft light, and with a label if it has room.

    The label stands in a white spot.
    """
    for k in range(SOFT):  # This is the shadow, down to the right.
        _circles(axes, balls, (0.10, -0.14), 1.18 - 0.025 * k, (0.0, 0.0, 0.0, 0.026), 2.0)
    _circles(axes, balls, (0.0, 0.0), 1.07, (1.0, 1.0, 1.0, HALO), 2.05)
    _bodies(axes, balls, style)
    for k in range(SOFT):  # This is light from the upper left.
        offset = (-0.022 * k, 0.027 * k)
        _circles(axes, balls, offset, 0.90 - 0.04 * k, (1.0, 1.0, 1.0, 0.024), 2.2)
    for ball in balls:
        if ball.is_labelled_inside:
            spot = Circle((ball.x, ball.y), ball.spot, facecolor="#ffffff", zorder=2.3)
            spot.set(edgecolor=style.outline, linewidth=min(0.025 * ball.radius, 0.6))
            axes.add_artist(spot)
            axes.add_artist(_label(ball, style.outline, zorder=2.4))


def draw_ghosts(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw ghosts of balls: pale, clear discs with a ring in the ball's colour and a label."""
    for ball in balls:
        width = min(0.14 * ball.radius, 4.0)
        disc = Circle((ball.x, ball.y), ball.radius - width / 2, zorder=1.7)
        disc.set(facecolor=(1.0, 1.0, 1.0, 0.35), edgecolor=ball.color, linewidth=width)
        axes.add_artist(disc)
        for radius in (ball.radius, ball.radius - width):
            edge = Circle((ball.x, ball.y), radius, facecolor="none", zorder=1.8)
            edge.set(edgecolor=style.outline, linewidth=0.2 * width, alpha=0.7)
            axes.add_artist(edge)
        if ball.is_labelled_inside:
            axes.add_artist(_label(ball, style.outline, alpha=0.6, zorder=1.9))


def _circles(
    axes: Axes, balls: Sequence[DrawnBall], offset: Point, size: float, color: Color, zorder: float
) -> None:
    """Draw one circle a ball, all of them as one area.

    They are ``size`` radii large, and ``offset`` radii beside the centres.
    """
    circles = [
        Outline.circle((b.x + offset[0] * b.radius, b.y + offset[1] * b.radius), size * b.radius)
        for b in balls
    ]
    outline = Outline.make_compound_path(*circles)
    axes.add_artist(PathPatch(outline, facecolor=color, edgecolor="none", zorder=zorder))


def _bodies(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw the discs; outlines lie inside the radius, so that balls that touch are seen to."""
    lines = [min(0.07 * ball.radius, 1.6) for ball in balls]
    for ball, line in zip(balls, lines, strict=True):
        body = Circle((ball.x, ball.y), ball.radius - line / 2, linewidth=line, zorder=2.1)
        body.set(facecolor=IVORY if ball.striped else ball.color, edgecolor=style.outline)
        axes.add_artist(body)
        if ball.striped:
            shape = Affine2D().scale(ball.radius - line).translate(ball.x, ball.y)
            band = PathPatch(_band().transformed(shape), facecolor=ball.color, lw=0, zorder=2.15)
            axes.add_artist(band)


@lru_cache(maxsize=1)
def _band() -> Outline:
    """Return a level stripe over a disc of radius 1, as high as LOOK says."""
    turn = math.asin(LOOK.stripe)
    angles = np.concatenate(
        [np.linspace(-turn, turn, 24), np.linspace(math.pi - turn, math.pi + turn, 24)]
    )
    return Outline(np.stack([np.cos(angles), np.sin(angles)], axis=1), closed=False)


def _label(ball: DrawnBall, color: str, **looks: Any) -> PathPatch:
    """Return a ball's label as an outline that fills its spot, whatever the ball's size."""
    shape = Affine2D().scale(ball.spot).translate(ball.x, ball.y)
    path = _lettering(ball.label).transformed(shape)
    return PathPatch(path, facecolor=color, edgecolor="none", **looks)


@lru_cache(maxsize=1024)
def _lettering(text: str) -> Outline:
    """Return letters centred on the origin, in a circle of radius 0.87.

    They are no higher than a single letter.
    """
    path = TextPath((0.0, 0.0), text.replace("$", r"\$"), size=1.0, prop=BOLD)
    box = path.get_extents()
    size = min(1.74 / math.hypot(box.width, CAPITAL), 1.05 / CAPITAL)
    middle = Affine2D().translate(-(box.x0 + box.x1) / 2, -(box.y0 + box.y1) / 2)
    return path.transformed(middle.scale(size))


# -- labels beside balls ------------------------------------------------------------------------


class Labels:
    """Labels stand beside their balls, each at a corner where it covers no other ball.

    ``balls`` are those that have one. A label leaves its corner only for one with clearly more
    room, so that it stands still when balls move.
    """

    def __init__(self, discs: Sequence[DrawnBall]) -> None:
        beside = [k for k, disc in enumerate(discs) if not disc.is_labelled_inside]
        self.of = np.array(beside, dtype=int)
        self.balls = [discs[k] for k in beside]
        self.radii = np.array([disc.radius for disc in discs])
        self.halves = np.array([half_size(ball.label, ball.letter) for ball in self.balls]).reshape(
            -1, 2
        )
        self.corners = np.tile(CORNERS[0], (len(self.balls), 1))

    def place(self, places: Array) -> Array:
        """Return the middles (L, 2) of the labels when the balls are at ``places`` (N, 2)."""
        if self.balls:
            room = self._room(places, self.corners)
            if room.min() < 0.0:
                others = np.array([self._room(places, corner) for corner in CORNERS])
                better = others.max(axis=0) > room + CLEARLY * self.halves[:, 1]
                self.corners[better] = CORNERS[others.argmax(axis=0)][better]
        return self._middles(places, self.corners)

    def _middles(self, places: Array, corners: Array) -> Array:
        """Return where the middles of the labels are at these corners."""
        middles: Array = places[self.of] + corners * (0.8 * self.radii[self.of, None] + self.halves)
        return middles

    def _room(self, places: Array, corners: Array) -> Array:
        """Return 0 for a label that covers no other ball, and less the more it covers one."""
        middles = self._middles(places, corners)
        out = np.maximum(np.abs(places - middles[:, None]) - self.halves[:, None], 0.0)
        gaps = np.hypot(out[..., 0], out[..., 1]) - self.radii
        gaps[np.arange(len(self.of)), self.of] = 0.0
        nearest: Array = np.nan_to_num(gaps, nan=0.0).min(axis=1)
        return np.minimum(nearest, 0.0)


@lru_cache(maxsize=1024)
def half_size(label: str, letter: float) -> Point:
    """Return half the width and height (points) of a label in letters of a size."""
    box = TextPath((0.0, 0.0), label.replace("$", r"\$"), size=letter).get_extents()
    return max(float(box.width), 1.0) / 2, CAPITAL * letter / 2


def draw_label(axes: Axes, ball: DrawnBall, middle: Point, style: Style) -> None:
    """Draw the label of a ball, light with a dark rim, around its middle."""
    x, y = middle
    text = axes.text(x, y - CAPITAL * ball.letter / 2, ball.label, parse_math=False, zorder=2.4)
    text.set(color="#ffffff", fontsize=ball.letter, ha="center", va="baseline")
    text.set_path_effects([withStroke(linewidth=0.3 * ball.letter, foreground=style.outline)])


# -- where balls come from and go to -----------------------------------------------------------


def track_of(run: Run, i: int) -> Array:
    """Return times and places (K, 3) on the track of ball ``i``, as far as it is on the table.

    These are its breakpoints, and on a parabola some places between two. The last is on the rim if
    a pocket takes the ball.
    """
    breakpoints = run.knots[i]
    if run.scene.balls[i].id in run.pocketed:
        breakpoints = breakpoints[:-1]
    vx, vy, ax, ay = breakpoints[:-1, 3:7].T
    bends = np.abs(vx * ay - vy * ax) > STRAIGHT * np.abs(vx * ay)
    times = np.linspace(breakpoints[:-1, 0], breakpoints[1:, 0], CHORDS, endpoint=False, axis=1)
    kept = bends[:, None] | (np.arange(CHORDS) == 0)
    rows = np.repeat(breakpoints[:-1], CHORDS, axis=0)[kept.ravel()]
    places, _ = free_motions(rows, times[kept])
    return np.vstack((np.column_stack((times[kept], places)), breakpoints[-1:, :3]))


def track_width(count: int) -> float:
    """Return half the width of tracks, in the ball's radius: many balls have thin ones.

    >>> track_width(8), track_width(32)
    (0.24, 0.12)
    """
    return LOOK.track * math.sqrt(LOOK.few / max(count, LOOK.few))


def tracks(
    paths: Sequence[Array],
    balls: Sequence[DrawnBall],
    ground: str,
    *,
    solid: bool,
) -> LineCollection:
    """Return the paths (K, 2), in points, of the balls in their colours, with halos.

    They fade into the colour of the ``ground`` towards where they begin. Those of ghosts are thin
    and pale, and have no halos.
    """
    width = 2.0 * track_width(len(balls)) * (0.75 if solid else 0.35)
    bare = np.array(to_rgb(ground))
    lines: list[Array] = []
    colors: list[Array] = []
    widths: list[float] = []
    for path, ball in zip(paths, balls, strict=True):
        pieces, strengths = _pieces(path[np.isfinite(path).all(axis=1)])
        core = max(width * ball.radius, 0.9)
        strokes = [(halo_color(ball.color), HALO, core + max(0.5 * core, 0.8))]
        strokes += [(ball.color, 1.0, core)]
        for color, share, line in strokes if solid else [(ball.color, PALE, core)]:
            lines += pieces
            colors += [*bare + share * np.outer(strengths, to_rgb(color) - bare)]
            widths += [line] * len(pieces)
    shades = np.array(colors).reshape(-1, 3)
    drawn = LineCollection(lines, colors=shades, linewidths=widths, zorder=1.5)
    drawn.set(capstyle="round", joinstyle="round")
    return drawn


def _pieces(path: Array) -> tuple[list[Array], Array]:
    """Return the path in pieces, the oldest first, and the strength of each."""
    gone = np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
    if gone[-1] == 0.0:
        return [], gone[:0]
    at = np.union1d(gone, np.linspace(0.0, gone[-1], LOOK.pieces))
    points = np.stack([np.interp(at, gone, part) for part in path.T], axis=1)
    age = (at[:-1] + at[1:]) / (2.0 * gone[-1])
    strength = LOOK.oldest + (1.0 - LOOK.oldest) * age
    return list(np.stack([points[:-1], points[1:]], axis=1)), strength


def draw_rings(axes: Axes, balls: Sequence[DrawnBall]) -> None:
    """Draw a thin ring in the ball's colour where each ball started."""
    for ball in balls:
        line = min(max(0.07 * ball.radius, 0.9), 2.0)
        for color, width, alpha in ((halo_color(ball.color), 2.0, HALO), (ball.color, 1.0, 1.0)):
            ring = Circle((ball.x, ball.y), ball.radius - line, facecolor="none", zorder=1.45)
            ring.set(edgecolor=color, linewidth=width * line, alpha=alpha)
            axes.add_artist(ring)


def draw_arrows(
    axes: Axes, balls: Sequence[DrawnBall], velocities: Array, scale: float, style: Style
) -> list[FancyArrowPatch]:
    """Draw an arrow at every ball that moves, from its edge along its velocity (m/s)."""
    arrows = []
    for ball, velocity in zip(balls, velocities, strict=True):
        speed = float(np.hypot(*velocity))
        if not speed > 0.0:
            continue
        near = 1.25 * ball.radius
        far = near + max(LOOK.arrow * scale * speed, 1.2 * ball.radius)
        tail, tip = ((ball.x, ball.y) + s * velocity / speed for s in (near, far))
        arrow = FancyArrowPatch(
            tail, tip, arrowstyle="-|>", mutation_scale=0.8 * ball.radius, shrinkA=0.0, shrinkB=0.0,
            color=style.arrow, linewidth=0.11 * ball.radius, alpha=0.9, zorder=1.6,
        )  # fmt: skip
        arrow.set(capstyle="round")
        axes.add_artist(arrow)
        arrows.append(arrow)
    return arrows
