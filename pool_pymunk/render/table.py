"""This module says how a table or an open plane looks from above (m), and draws it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from statistics import fmean
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.transforms import Bbox

from pool_pymunk.model import Pocket, Point, Scene, Table, Units
from pool_pymunk.model.outline import STRAIGHT_ON
from pool_pymunk.render.style import LOOK, Style
from pool_pymunk.render.view import CUSHION, RAIL, View

SHARPEST_MITRE = math.radians(60.0)  # A sharper corner of the cushions is drawn round.
PIN = 0.3  # of the smallest ball's radius; no post is drawn smaller
ROUND = 120  # corners of a round patch as it is drawn
MOUTH = 0.3  # of the width; sides that are shorter are those of pockets' mouths, and not rails
PITCH = 0.16  # of the width; the lines of an open plane are at most this far apart


class Woodwork(NamedTuple):
    """The woodwork lies around the cloth: wide strokes along the outline, and sights (m)."""

    outline: Sequence[Point]
    # a layer's colour in the style, how far it is seen beside the outline, and its joints
    layers: tuple[tuple[str, float, str], ...]
    shades: tuple[float, ...]  # All together are the cushions' soft shadow.
    sights: tuple[Point, ...]
    sight: float


def woodwork(table: Table, pockets: Sequence[Pocket]) -> Woodwork:
    """Return the woodwork of a table; one with a colour of its own is a board without sights."""
    short = min(Bbox.from_extents(*table.bounds).size)
    cushion, rail, thin = CUSHION * short, (CUSHION + RAIL) * short, 0.006 * short
    edges = table.edges
    ends = [(edges[k - 1].heading(True), edge.heading(False)) for k, edge in enumerate(edges)]
    turns = [math.atan2(b[1], b[0]) - math.atan2(a[1], a[0]) for a, b in ends]
    sharpest = min(math.pi - math.remainder(turn, math.tau) for turn in turns)
    join = "round" if sharpest <= SHARPEST_MITRE else "miter"
    layers = (
        ("rail_edge", rail, "round"), ("rail", rail - thin, "round"),
        ("inlay", cushion + thin, join), ("cushion", cushion, join), ("nose", thin / 2, join),
    )  # fmt: skip
    shades = tuple(0.12 * k * cushion for k in range(1, 7))
    seen = () if table.color else tuple(sights(table, pockets))
    return Woodwork(table.polyline, layers, shades, seen, 0.007 * short)


def draw_patches(axes: Axes, scene: Scene, view: View, style: Style) -> None:
    """Draw patches as a light tint on the cloth."""
    for points, color in seen_patches(scene):
        tint = Polygon([view.place(point) for point in points], alpha=LOOK.tint, zorder=1.15, lw=0)
        tint.set_facecolor(getattr(style, color))
        axes.add_artist(tint)
        if scene.table is not None:
            corners = [view.place(corner) for corner in scene.table.polyline]
            tint.set_clip_path(Polygon(corners, transform=axes.transData))


def seen_patches(scene: Scene) -> Iterator[tuple[Sequence[Point], str]]:
    """Yield the outline of each patch (m), and its colour in the style.

    It is like sand where there is more friction than elsewhere, and like ice where there is less.
    """
    kinds = ("surface",) if scene.friction.rolling is None else ("rolling", "surface")
    for patch in scene.patches:
        own = [(getattr(patch, kind), getattr(scene.friction, kind)) for kind in kinds]
        less = next((mu < usual for mu, usual in own if mu not in (None, usual)), False)
        points: Sequence[Point] = patch.corners
        if patch.center is not None and patch.radius is not None:
            (x, y), r, turn = patch.center, patch.radius, math.tau / ROUND
            points = [
                (x + r * math.cos(k * turn), y + r * math.sin(k * turn)) for k in range(ROUND)
            ]
        yield points, "ice" if less else "sand"


def draw_table(
    axes: Axes, table: Table, pockets: Sequence[Pocket], view: View, style: Style
) -> None:
    """Draw wooden rails, cushions and cloth, each as a wide stroke around what lies on it."""
    wood = woodwork(table, pockets)
    corners = [view.place(corner) for corner in wood.outline]

    def stroke(width: float, color: str, join: str, **looks: Any) -> Polygon:
        line = Polygon(corners, fill=False, edgecolor=color, lw=2.0 * view.scale * width, **looks)
        line.set_joinstyle(join)  # type: ignore[arg-type]
        axes.add_artist(line)
        return line

    for name, width, join in wood.layers:
        stroke(width, getattr(style, name), join, zorder=1.0)
    cloth = Polygon(corners, facecolor=style.cloth, edgecolor="none", zorder=1.1)
    axes.add_artist(cloth)
    for width in wood.shades:
        stroke(width, "#000000", "round", alpha=0.05, zorder=1.2).set_clip_path(cloth)
    for sight in wood.sights:
        place, radius = view.place(sight), view.scale * wood.sight
        axes.add_artist(Circle(place, radius, color=style.sight, linewidth=0, zorder=1.3))


def draw_pockets_and_posts(axes: Axes, scene: Scene, view: View, style: Style) -> None:
    """Draw pockets, as the circles in which they take centres of balls, and posts, like rails."""
    for x, y, radius, color in pockets_and_posts(scene):
        place, size = view.place((x, y)), radius * view.scale
        axes.add_artist(Circle(place, size, color=getattr(style, color), lw=0, zorder=1.4))


def pockets_and_posts(scene: Scene) -> Iterator[tuple[float, float, float, str]]:
    """Yield place and radius (m) of the discs that make these, and their colours in the style."""
    holes = (((*hole.position, hole.radius), "lip", "hole", 0.9) for hole in scene.pockets)
    posts = ((post, "rail_edge", "rail", 0.85) for post in seen_posts(scene))
    for (x, y, radius), rim, inner, share in (*holes, *posts):
        yield x, y, radius, rim
        yield x, y, share * radius, inner


def seen_posts(scene: Scene) -> list[tuple[float, float, float]]:
    """Return place and radius (m) of each post as it is drawn: pins, too, can be seen."""
    least = PIN * min(ball.radius for ball in scene.balls)
    return [(*post.position, max(post.radius, least)) for post in scene.posts]


def sights(table: Table, pockets: Sequence[Pocket]) -> Iterator[Point]:
    """Yield points on the rails (m) where there is room.

    One is at each joint at which a cushion goes on without a corner.
    """
    out = (CUSHION + RAIL / 2) * min(Bbox.from_extents(*table.bounds).size)
    step, count = pitch_of_sights(table), len(table.edges)
    for k, edge in enumerate(table.edges):
        low = 2.0 * out * (k in table.reflex_corners)
        high = 2.0 * out * ((k + 1) % count in table.reflex_corners)
        parts = round(edge.arc_length / step)
        goes_on = math.dist(table.edges[k - 1].heading(True), edge.heading(False)) < STRAIGHT_ON
        for share in (part / parts for part in range(1 - goes_on, parts)):
            (x, y), (nx, ny) = edge.at(share)
            x, y = x - out * nx, y - out * ny
            far = all(math.dist((x, y), hole.position) > 2.0 * hole.radius for hole in pockets)
            if far and low <= share * edge.arc_length < edge.arc_length - high:
                yield x, y


def pitch_of_sights(table: Table) -> float:
    """Return how far (m) sights are apart: a quarter of the shortest side that is no mouth."""
    lengths = [edge.arc_length for edge in table.edges]
    least = min(MOUTH * min(Bbox.from_extents(*table.bounds).size), max(lengths))
    return min(length for length in lengths if length >= least) / 4.0


def numbers(scene: Scene) -> Iterator[tuple[float, float, str]]:
    """Yield places (m) and numbers of cushions, on rails between two sights, posts, and patches.

    Sides that are so short that their numbers would cover each other have none.
    """
    if scene.table is not None:
        sides = scene.table.edges
        out = (CUSHION + RAIL / 2.0) * min(Bbox.from_extents(*scene.table.bounds).size)
        step = pitch_of_sights(scene.table)
        for k, side in enumerate(sides):
            parts = max(round(side.arc_length / step), 1)
            (x, y), (nx, ny) = side.at((parts // 2 + 0.5) / parts)
            if side.arc_length > out:
                yield x - out * nx, y - out * ny, str(k)
    beside = min(ball.radius for ball in scene.balls)
    for k, (x, y, radius) in enumerate(seen_posts(scene), start=scene.first_post):
        yield (x, y, str(k)) if radius > beside else (x + radius + 0.7 * beside, y, str(k))
    for k, patch in enumerate(scene.patches):
        x, y = patch.center or map(fmean, zip(*patch.corners, strict=True))
        yield x, y, f"patch {k}"


class Plane(NamedTuple):
    """An open plane has a grid (m), and a ``bar`` as long as its pitch, which ``text`` says."""

    lines: list[tuple[Point, Point]]
    bar: tuple[Point, Point, Point, Point]
    text: str


def plane(seen: Bbox, units: Units) -> Plane:
    """Return how the part of an open plane that is ``seen`` (m) is drawn."""
    pitch, text = scale(seen, units)
    size = 0.015 * (seen.width + seen.height)
    x0, y0, x1, y1 = map(float, seen.extents)
    across, up = (
        [pitch * k for k in range(math.ceil(a / pitch), math.floor(b / pitch) + 1)]
        for a, b in ((x0, x1), (y0, y1))
    )
    lines = [((x, y0), (x, y1)) for x in across] + [((x0, y), (x1, y)) for y in up]
    x, y, top = x0 + size, y0 + size, y0 + 1.3 * size
    bar = ((x, top), (x, y), (x + pitch, y), (x + pitch, top))
    return Plane(lines, bar, text)


def scale(seen: Bbox, units: Units) -> tuple[float, str]:
    """Return a round length (m) that suits the part that is ``seen`` (m), and its name."""
    unit = units.to_si(1.0, "length")
    count = round_number(PITCH * seen.width / unit)
    return count * unit, f"{count:g} {units.length}"


def draw_plane(axes: Axes, room: Bbox, view: View, units: Units, style: Style) -> None:
    """Draw an open plane: a calm sheet with a faint grid, and a bar that shows its pitch."""
    seen = Bbox((room.get_points() - (view.x, view.y)) / view.scale)
    lines, bar, text = plane(seen, units)
    sheet = Rectangle((room.x0, room.y0), room.width, room.height)
    axes.add_artist(sheet).set(color=style.plane, lw=0, zorder=1)
    placed = [list(map(view.place, line)) for line in lines]
    grid = LineCollection(placed, colors=style.grid, linewidths=0.8, zorder=1.1)
    axes.add_collection(grid, autolim=False)
    draw_bar(axes, list(map(view.place, bar)), text, view.letter, style)


def draw_bar(axes: Axes, bar: Sequence[Point], text: str, letter: float, style: Style) -> None:
    """Draw a scale along points of the canvas, and its name above its middle."""
    line = LineCollection([bar], colors=style.ink, linewidths=0.2 * letter, zorder=1.3)
    axes.add_collection(line, autolim=False)
    (x0, y), (x1, _) = bar[1:3]
    axes.text(
        (x0 + x1) / 2, y + 0.35 * letter, text, fontsize=1.2 * letter, color=style.ink,
        ha="center", va="bottom", parse_math=False, zorder=1.3,
    )  # fmt: skip


def round_number(most: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not more than ``most``.

    >>> round_number(7.3), round_number(0.049), round_number(100.0)
    (5.0, 0.02, 100.0)
    """
    power = 10.0 ** math.floor(math.log10(most))
    return next(k * power for k in (5.0, 2.0, 1.0) if k * power <= most)
