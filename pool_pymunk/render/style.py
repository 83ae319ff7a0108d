"""This module says how things look: the colours of table, page and balls, as plain numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import count
from typing import NamedTuple

import numpy as np
from matplotlib.colors import to_hex, to_rgb

from pool_pymunk.model import Scene, Table

# This is Okabe and Ito's palette, which can be distinguished with any kind of colour vision.
# The eighth is black, as in pool.
PALETTE = ("#e69f00", "#0072b2", "#f0e442", "#d55e00", "#56b4e9", "#cc79a7", "#009e73", "#000000")
CUE = "#ffffff"
# These are the colours of pool balls 1 to 8; those of 9 to 15 are stripes on ivory.
POOL = ("#f6c915", "#1b4fb3", "#d6202f", "#5f2c8c", "#f1741c", "#0f7f46", "#7f1d26", "#000000")
IVORY = "#f6f1e3"
POOL_IDS = frozenset(map(str, range(1, 16)))
STRIPES = frozenset(map(str, range(9, 16)))
# These are further rounds through the palette, darker and lighter.
SHADES = (("#000000", 0.45), ("#ffffff", 0.55))
# Cushions and their noses have a table's own colour times these, about as on the green table.
CUSHION_SHADE, NOSE_SHADE = 0.77, 0.59


class Look(NamedTuple):
    """A look has what pictures, films and the page draw alike; times are in s on the screen."""

    spot: float = 0.5  # the radius of the white spot, in that of the ball
    stripe: float = 0.62  # half the height of a stripe, in the ball's radius
    track: float = 0.24  # half the width of a ball's track, in the ball's radius
    slim: float = 0.4  # the width of a track where it lies on another one, in its own
    few: int = 8  # More balls than these have thinner tracks, and thinner lines in plots.
    pieces: int = 40  # A track that fades consists of about this number of pieces.
    oldest: float = 0.6  # The oldest end of a track is as strong as this, the newest end 1.
    # Halos around balls and tracks are as strong as this. With it every ball's track, or its halo,
    # differs from cloths of eleven colours by 24 in CIELAB (tests/render/test_render.py).
    halo: float = 0.6
    arrow: float = 0.08  # An arrow is as long as the path of a ball in this time, if that shows.
    shot: float = 0.5  # The arrow of the shot fades in this time.
    flash: float = 0.22  # A contact lights up for this time.
    drop: float = 0.35  # A ball takes this time to fall into a pocket.
    # From this ratio of the largest to the smallest distance on, a plot's axis is logarithmic.
    wide_range: float = 30.0
    tint: float = 0.4  # the opacity of a patch on the cloth
    decades: float = 1e-6  # the least distance that a plot shows, as a share of the largest


LOOK = Look()


@dataclass(frozen=True, slots=True)
class Style:
    """A style has the colours of all but the balls: page and words, table, open plane, light."""

    page: str = "#ffffff"
    ink: str = "#22262a"
    faint: str = "#8a9199"
    cloth: str = "#1f7d53"
    cushion: str = "#17603f"
    nose: str = "#114a31"
    rail: str = "#5b3a24"
    rail_edge: str = "#3a2416"
    inlay: str = "#8a6242"
    sight: str = "#efe6d2"
    plane: str = "#c9d3d2"
    grid: str = "#bbc6c5"
    outline: str = "#101418"
    arrow: str = "#ffffff"
    impulse: str = "#ff6fcf"
    flash: str = "#fff6c8"
    hole: str = "#0b0d0f"
    lip: str = "#2c2622"
    sand: str = "#f2d98b"
    ice: str = "#e4f4ff"

    def on(self, table: Table | None) -> Style:
        """Return the style with a table's own colour, shades of it on cushions, clear arrows.

        Without a table, the open plane is the cloth.
        """
        if table is None:
            return replace(self, cloth=self.plane)
        if table.color is None:
            return self
        r, g, b = to_rgb(table.color)
        cushion, nose = (to_hex((s * r, s * g, s * b)) for s in (CUSHION_SHADE, NOSE_SHADE))
        arrow = halo_color(table.color)
        return replace(self, cloth=table.color, cushion=cushion, nose=nose, arrow=arrow)


PRINT = Style()
SCREEN = Style(page="#15191d", ink="#e8ebee", faint="#8b949c", plane="#4b5860", grid="#57656e")


def ball_colors(scene: Scene) -> tuple[str, ...]:
    """Return every ball's colour: its own, of pool if there are pockets, or of the palette.

    A number has the same colour of the palette wherever it stands among the balls. The cue ball is
    white, and so is a ball that is called "cue".
    """
    white = {ball.id for ball in scene.balls if ball.cue or ball.id == "cue"}
    ids = [ball.id for ball in scene.balls if ball.id not in white]
    places = {id_: int(id_) - 1 for id_ in ids if id_ in POOL_IDS}
    free = (place for place in count() if place not in places.values())
    places |= {id_: next(free) for id_ in ids if id_ not in places}
    pool = {id_: POOL[(int(id_) - 1) % len(POOL)] for id_ in POOL_IDS if scene.pockets}
    usual = {id_: pool.get(id_) or default_color(place) for id_, place in places.items()}
    return tuple(ball.color or usual.get(ball.id, CUE) for ball in scene.balls)


def striped(scene: Scene) -> tuple[bool, ...]:
    """Tell which balls have a stripe: 9 to 15, on a table with pockets."""
    return tuple(
        bool(scene.pockets) and ball.id in STRIPES and not (ball.color or ball.cue)
        for ball in scene.balls
    )


def dashes(scene: Scene) -> tuple[tuple[float, ...], ...]:
    """Return how every ball's curve is dashed, in its width: curves of equal colours differ.

    Stripes have dashes. Other balls of a colour that was there have a dash, and more and more dots.
    """
    seen: set[tuple[str, int]] = set()
    found = []
    for color, stripe in zip(ball_colors(scene), striped(scene), strict=True):
        place = next(k for k in count(int(stripe)) if (color, k) not in seen)
        seen.add((color, place))
        found.append((4.0, 1.5, *(1.0, 1.5) * (place - 1)) if place else ())
    return tuple(found)


def by_number(ids: Iterable[str]) -> list[str]:
    """Return ids of balls in the order of a legend: numbers come last, from low to high.

    >>> by_number(["cue", "10", "9", "red"])
    ['cue', 'red', '9', '10']
    """
    return sorted(ids, key=lambda id_: int(id_) if id_.isdecimal() else -1)


def default_color(place: int) -> str:
    """Return a colour for the ball at a ``place`` (from 0): the palette first, then its shades.

    >>> default_color(0), default_color(7), default_color(8)
    ('#e69f00', '#000000', '#7e5700')
    """
    if place < len(PALETTE):
        return PALETTE[place]
    again, hue = divmod(place - len(PALETTE), len(PALETTE) - 1)  # Black has no shades.
    other, share = SHADES[again % len(SHADES)]
    own, more = (np.array(to_rgb(color)) for color in (PALETTE[hue], other))
    return to_hex(own + share * (more - own))


def halo_color(color: str) -> str:
    """Return white or black, whichever is farther from a colour, for a halo around its lines."""
    red, green, blue = np.array(to_rgb(color)) ** 2.2
    return "#ffffff" if 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.4 else "#000000"
