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
from pool_pymunk.model.arrays import Array
from pool_pymunk.render.style import IVORY, LOOK, Style, ball_colors, halo_color, striped
from pool_pymunk.render.view import View
from pool_pymunk.results.motion import free_motions
from pool_pymunk.results.run import Run

Color = tuple[float, float, float, float]
CAPITAL = 0.73  # height of the font's capitals and digits, in its size
CORNERS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])  # the first is preferred
CLEARLY = 0.3  # A label moves to a corner with this much more room, in half heights of the label.
BOLD = FontProperties(family="DejaVu Sans", weight="bold")
LEGIBLE = 0.34  # in ``letter``; if capitals are smaller, the label stands beside the ball
SOFT = 14  # A soft shadow or light consists of this number of circles.
PALE = 0.7  # the strength of a ghost's track
KINK = 0.06  # rad; a parabola is drawn as straight lines, one for each so much of its turn
NEAR = 0.01  # of the ball's radius; no middle of a line lies farther from the parabola
CHORDS = 250  # A parabola consists of at most this number of lines.
TINY = 1e-300  # m/s; a ball that turns straight back has no velocity between both ends
# A level stripe crosses a disc of radius 1; these are its corners' angles at the right side.
ANGLES = math.asin(LOOK.stripe) * np.linspace(-1.0, 1.0, 24)
BAND = Outline([(side * np.cos(a), side * np.sin(a)) for side in (1.0, -1.0) for a in ANGLES])


class DrawnBall(NamedTuple):
    """A disc is a ball on the canvas, in points; ``letter`` is the size of small letters there."""

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
    places, looks = view.places(position).tolist(), (ball_colors(scene), striped(scene))
    return [
        DrawnBall(x, y, view.scale * ball.radius, color, ball.id, view.letter, stripe)
        for ball, (x, y), color, stripe in zip(scene.balls, places, *looks, strict=True)
    ]


def circle(axes: Axes, ball: DrawnBall, radius: float, **looks: Any) -> None:
    """Draw a circle of a ``radius`` (points) around the middle of a ball."""
    axes.add_artist(Circle((ball.x, ball.y), radius, **looks))


def draw_balls(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw balls with their labels: inside, or beside those that are too small."""
    draw_bodies(axes, balls, style)
    labels = Labels(balls)
    places = labels.place(np.array([(ball.x, ball.y) for ball in balls])).tolist()
    beside = zip(labels.balls, places, strict=True)
    draw_labels(axes, [ball._replace(x=x, y=y) for ball, (x, y) in beside], style)


def draw_bodies(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw balls with shadow, outline and light, and with a label in a white spot if it fits."""
    for k in range(SOFT):  # This is the shadow, down to the right.
        _circles(axes, balls, (0.10, -0.14), 1.18 - 0.025 * k, (0.0, 0.0, 0.0, 0.026), 2.0)
    _circles(axes, balls, (0.0, 0.0), 1.07, (1.0, 1.0, 1.0, LOOK.halo), 2.05)
    for k in range(SOFT):  # This is light from the upper left.
        offset = (-0.022 * k, 0.027 * k)
        _circles(axes, balls, offset, 0.90 - 0.04 * k, (1.0, 1.0, 1.0, 0.024), 2.2)
    for ball in balls:
        # The outline lies inside the radius, so that balls that touch also do so in the picture.
        line, ink = min(0.07 * ball.radius, 1.6), style.outline
        body = IVORY if ball.striped else ball.color
        circle(axes, ball, ball.radius - line / 2, lw=line, ec=ink, fc=body, zorder=2.1)
        if ball.striped:
            _shape(axes, BAND, ball, ball.radius - line, fc=ball.color, lw=0, zorder=2.15)
        if ball.is_labelled_inside:
            edge = min(0.025 * ball.radius, 0.6)
            circle(axes, ball, ball.spot, fc="#ffffff", ec=ink, lw=edge, zorder=2.3)
            _shape(axes, _lettering(ball.label), ball, ball.spot, fc=ink, ec="none", zorder=2.4)


def draw_ghosts(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw ghosts of balls: pale, clear discs with a label, to lie below the balls."""
    for ball in balls:
        circle(axes, ball, ball.radius, fc=(1.0, 1.0, 1.0, 0.35), lw=0, zorder=1.7)
        if ball.is_labelled_inside:
            looks = {"fc": style.outline, "ec": "none", "alpha": 0.6, "zorder": 1.9}
            _shape(axes, _lettering(ball.label), ball, ball.spot, **looks)


def draw_rims(axes: Axes, balls: Sequence[DrawnBall], _style: Style) -> None:
    """Draw the rims of ghosts, which are seen on balls, too: rings in the balls' colours."""
    draw_rings(axes, balls, wide=0.1, zorder=2.25)


def _circles(
    axes: Axes, balls: Sequence[DrawnBall], offset: Point, size: float, color: Color, zorder: float
) -> None:
    """Draw a circle at each ball, all as one area; ``size`` and ``offset`` are in its radii."""
    circles = [
        Outline.circle((b.x + offset[0] * b.radius, b.y + offset[1] * b.radius), size * b.radius)
        for b in balls
    ]
    outline = Outline.make_compound_path(*circles)
    axes.add_artist(PathPatch(outline, facecolor=color, edgecolor="none", zorder=zorder))


def _shape(axes: Axes, outline: Outline, ball: DrawnBall, size: float, **looks: Any) -> None:
    """Draw an outline around the middle of a ball; ``size`` (points) is its unit of length."""
    shape = Affine2D().scale(size).translate(ball.x, ball.y)
    axes.add_artist(PathPatch(outline.transformed(shape), **looks))


@lru_cache(maxsize=1024)
def _lettering(text: str) -> Outline:
    """Return letters no higher than a capital, around the origin in a circle of radius 0.87."""
    path = TextPath((0.0, 0.0), text.replace("$", r"\$"), size=1.0, prop=BOLD)
    box = path.get_extents()
    size = min(1.74 / math.hypot(box.width, CAPITAL), 1.05 / CAPITAL)
    middle = Affine2D().translate(-(box.x0 + box.x1) / 2, -(box.y0 + box.y1) / 2)
    return path.transformed(middle.scale(size))


class Labels:
    """Labels stand beside their ``balls``, each at a corner where it covers no other ball.

    A label changes its corner only for one with clearly more room, so it does not flicker.
    """

    def __init__(self, discs: Sequence[DrawnBall]) -> None:
        beside = [k for k, disc in enumerate(discs) if not disc.is_labelled_inside]
        self.of = np.array(beside, dtype=int)
        self.balls = [discs[k] for k in beside]
        self.radii = np.array([disc.radius for disc in discs])
        self.halves = np.reshape([half_size(b.label, b.letter) for b in self.balls], (-1, 2))
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
        """Return 0 for a label that covers no other ball, else minus its depth (points) in one."""
        middles = self._middles(places, corners)
        out = np.maximum(np.abs(places - middles[:, None]) - self.halves[:, None], 0.0)
        gaps = np.hypot(out[..., 0], out[..., 1]) - self.radii
        gaps[np.arange(len(self.of)), self.of] = 0.0
        room: Array = np.minimum(np.nan_to_num(gaps, nan=0.0).min(axis=1), 0.0)
        return room


@lru_cache(maxsize=1024)
def half_size(label: str, letter: float) -> Point:
    """Return half the width and height (points) of a label in letters of a size."""
    box = TextPath((0.0, 0.0), label.replace("$", r"\$"), size=letter).get_extents()
    return max(float(box.width), 1.0) / 2, CAPITAL * letter / 2


def draw_labels(axes: Axes, balls: Sequence[DrawnBall], style: Style) -> None:
    """Draw the labels of balls, light with a dark rim, around their middles."""
    for ball in balls:
        halo = [withStroke(linewidth=0.3 * ball.letter, foreground=style.outline)]
        axes.text(
            ball.x, ball.y - CAPITAL * ball.letter / 2, ball.label, parse_math=False, zorder=2.4,
            color="#ffffff", fontsize=ball.letter, ha="center", va="baseline", path_effects=halo,
        )  # fmt: skip


def moves(rows: Array) -> bool:
    """Tell whether a ball with these breakpoints ever moves."""
    return bool(np.nan_to_num(rows[:, 3:5]).any())


def track_of(run: Run, i: int) -> Array:
    """Return the track of ball ``i``, up to the rim of a pocket: times and places (K, 3)."""
    breakpoints = run.knots[i]
    if run.scene.balls[i].id in run.pocketed:
        breakpoints = breakpoints[:-1]
    spans, (vx, vy, ax, ay) = np.diff(breakpoints[:, 0]), breakpoints[:-1, 3:7].T
    ux, uy = vx + spans * ax, vy + spans * ay  # the velocity at the end
    turns = np.abs(np.arctan2(vx * uy - vy * ux, vx * ux + vy * uy))
    across = np.abs(ax * (vy + uy) - ay * (vx + ux)) / np.maximum(np.hypot(vx + ux, vy + uy), TINY)
    off = np.sqrt(across * spans**2 / (8.0 * NEAR * run.scene.balls[i].radius))
    count = np.clip(np.ceil(np.nan_to_num(np.maximum(turns / KINK, off))), 1, CHORDS).astype(int)
    rows, share = np.repeat(breakpoints[:-1], count, axis=0), np.repeat(spans / count, count)
    chord = np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
    times = rows[:, 0] + chord * share
    places, _ = free_motions(rows, times)
    return np.vstack((np.column_stack((times, places)), breakpoints[-1:, :3]))


def track_width(count: int) -> float:
    """Return half the width of tracks, in the ball's radius: many balls have thin ones."""
    return LOOK.track * math.sqrt(LOOK.few / max(count, LOOK.few))


class _Layer(NamedTuple):
    """A layer is a track's pieces, each with its strength, in one colour and width."""

    pieces: list[Array]
    strengths: Array
    color: str
    share: float
    width: float


def tracks(
    paths: Sequence[Array], balls: Sequence[DrawnBall], ground: str, *, solid: bool
) -> LineCollection:
    """Return balls' paths (K, 2), in points, as lines that fade towards where they begin.

    Their halos do not fade: of a white track on a light table they are what is seen. A track that
    others cover is drawn on them once more, slimmer.
    """
    full = 2.0 * track_width(len(balls)) * (0.75 if solid else 0.35)
    layers, above, bare = list[_Layer](), list[_Layer](), np.array(to_rgb(ground))
    for path, ball in zip(paths, balls, strict=True):
        pieces, strengths = _pieces(path[np.isfinite(path).all(axis=1)])
        core = max(full * ball.radius, 0.9)
        own = _Layer(pieces, strengths, ball.color, 1.0 if solid else PALE, core)
        if solid and pieces:
            halo = halo_color(ball.color), LOOK.halo, core + max(0.5 * core, 1.0)
            layers.append(_Layer(pieces, np.ones_like(strengths), *halo))
            above.append(own._replace(width=LOOK.slim * core))
        layers.append(own)
    layers += above[-2::-1]  # Nothing covers the last one.
    colors = [
        bare + share * np.outer(strengths, to_rgb(color) - bare)
        for _, strengths, color, share, _ in layers
    ]
    lines = [piece for layer in layers for piece in layer.pieces]
    widths = [layer.width for layer in layers for _ in layer.pieces]
    looks: dict[str, Any] = {"capstyle": "round", "joinstyle": "round", "zorder": 1.5}
    return LineCollection(lines, colors=np.vstack(colors), linewidths=widths, **looks)


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


def draw_rings(
    axes: Axes, balls: Sequence[DrawnBall], wide: float = 0.07, zorder: float = 1.45
) -> None:
    """Draw a thin ring in the ball's colour where each ball started; it is ``wide`` radii wide."""
    for ball in balls:
        line = min(max(wide * ball.radius, 0.9), 30.0 * wide)
        halo = (halo_color(ball.color), 2.0, LOOK.halo)
        for color, width, alpha in (halo, (ball.color, 1.0, 1.0)):
            looks = {"ec": color, "lw": width * line, "alpha": alpha, "zorder": zorder}
            circle(axes, ball, ball.radius - line, fc="none", **looks)


def draw_arrows(
    axes: Axes, balls: Sequence[DrawnBall], velocities: Array, scale: float, style: Style
) -> None:
    """Draw an arrow at every ball that moves, from its edge along its velocity (m/s)."""
    for ball, velocity in zip(balls, velocities, strict=True):
        speed, near = float(np.hypot(*velocity)), 1.25 * ball.radius
        if not speed > 0.0:
            continue
        far = near + max(LOOK.arrow * scale * speed, 1.2 * ball.radius)
        tail, tip = ((ball.x, ball.y) + s * velocity / speed for s in (near, far))
        arrow = FancyArrowPatch(
            tail, tip, arrowstyle="-|>", mutation_scale=0.8 * ball.radius, shrinkA=0.0, shrinkB=0.0,
            color=style.arrow, lw=0.11 * ball.radius, alpha=0.9, zorder=1.6, capstyle="round",
        )  # fmt: skip
        axes.add_artist(arrow)
