"""This module makes a film's frames: it draws a background once, then what moves on each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.artist import setp
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.font_manager import FontProperties, findfont
from PIL import Image, ImageDraw, ImageFont

from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.render.balls import (
    DrawnBall,
    Labels,
    discs,
    draw_arrows,
    draw_bodies,
    draw_ghosts,
    draw_label,
    half_size,
    track_of,
    track_width,
)
from pool_pymunk.render.canvas import Pixels, Sprite, canvas, glow, mix, pixels, sprites
from pool_pymunk.render.sheet import Layout, draw_caption, draw_sheet, draw_tray, film_layout
from pool_pymunk.render.style import LOOK, Style, halo_color
from pool_pymunk.render.tracks import LIFE, Ground, Track
from pool_pymunk.render.view import Box, Show, View, contact_places
from pool_pymunk.results.run import Run

Draw = Callable[[Axes, Sequence[DrawnBall], Style], None]
TRACK_STRENGTH = 0.5  # of a new track
CLEAR = 2.0  # A ball that travels this many radii in a second of film has its full halo.


class Cast:
    """A cast is the balls of one run in one view, solid or as ghosts, with tracks and flashes."""

    def __init__(self, run: Run, view: View, style: Style, slow: float, *, solid: bool) -> None:
        self.run, self.view, self.solid, self.slow = run, view, solid, slow
        self.light = _rgb(style.flash)
        start = run.at([0.0])[0][0]
        self.discs = discs(run.scene, start, view)
        anywhere = tuple(disc._replace(x=0.0, y=0.0) for disc in self.discs)
        self.sprites = _balls(anywhere, style, draw_bodies if solid else draw_ghosts)
        self.labels = Labels(self.discs if solid else ())
        self.names = _names(tuple(self.labels.balls), style)
        self.tracks = [self._track(i) for i in range(len(self.discs))]
        self.flashes = Flashes(run, view) if solid else None
        self.taken = {event.balls[0]: event.t for event in run.events if event.pocket is not None}

    def _track(self, i: int) -> Track:
        """Return a ball's track; a ghost's is thin and has no halo."""
        disc, breakpoints = self.discs[i], track_of(self.run, i)
        places = self.view.scale * breakpoints[:, 1:3] + (self.view.x, self.view.y)
        wide = max(1.2 * track_width(len(self.discs)) * disc.radius, 1.5)
        corners = np.column_stack([breakpoints[:, 0], places])
        width, halo = (wide, _rgb(halo_color(disc.color))) if self.solid else (0.5 * wide, None)
        return Track(corners, width, _rgb(disc.color), TRACK_STRENGTH, halo)

    def leave_tracks(self, ground: Ground, t: float, position: Array) -> None:
        """Draw the tracks on the ground up to where the balls are."""
        places = self.view.scale * position + (self.view.x, self.view.y)
        for disc, track, place in zip(self.discs, self.tracks, places, strict=True):
            track.extend_to(ground, t, place if t < self.taken.get(disc.label, math.inf) else None)

    def appear(self, frame: Pixels, t: float, position: Array, velocity: Array) -> None:
        """Put the balls on the frame; light around them shines from below and hides nothing."""
        if self.flashes is not None:
            self.flashes.appear(frame, t, LOOK.flash / self.slow, self.light)
            self._halos(frame, position, velocity)
        seen = [self._place(i, t, at) for i, at in enumerate(position)]
        places = np.array([self.view.place(place) for place, _ in seen])
        for sprite, (x, y), (_, strength) in zip(self.sprites, places.tolist(), seen, strict=True):
            sprite.stamp(frame, x, y, strength)
        beside = self.labels.place(places).tolist()
        for i, name, (x, y) in zip(self.labels.of, self.names, beside, strict=True):
            name.stamp(frame, x, y, seen[i][1])

    def _place(self, i: int, t: float, position: Array) -> tuple[Point, float]:
        """Return where a ball is seen (m), and how clearly: it fades as it falls into a pocket."""
        id_ = self.discs[i].label
        if id_ in self.run.off and id_ not in self.taken:
            return (math.nan, math.nan), 0.0
        x, y = map(float, position)
        if id_ not in self.taken or t < self.taken[id_]:
            return (x, y), 1.0
        age = min((t - self.taken[id_]) * self.slow / LOOK.drop, 1.0)
        x0, y0 = track_of(self.run, i)[-1, 1:3].tolist()  # on the rim
        return (x0 + age * (x - x0), y0 + age * (y - y0)), 1.0 - age

    def _halos(self, frame: Pixels, position: Array, velocity: Array) -> None:
        """Draw a pale ring around every ball that moves; it fades as the ball comes to rest."""
        speeds = np.hypot(velocity[:, 0], velocity[:, 1])
        for i in np.flatnonzero(speeds):
            radius = self.discs[i].radius
            strength = min(1.0, speeds[i] * self.view.scale / self.slow / (CLEAR * radius))
            at = self.view.place((float(position[i, 0]), float(position[i, 1])))
            glow(frame, at, radius, 0.16 * radius, self.light, 0.5 * float(strength))


class Arrows:
    """These are the arrows of a shot, one at every ball that moves as it begins; they fade."""

    def __init__(self, cast: Cast, size: tuple[int, int], style: Style, life: float) -> None:
        figure, axes = canvas(*size)
        draw_arrows(axes, cast.discs, cast.run.at([0.0])[1][0], cast.view.scale, style)
        cover = pixels(figure)[..., 3] / 255.0
        self.rows, self.columns = (_extent(cover.max(axis=axis)) for axis in (1, 0))
        self.cover, self.color = cover[self.rows, self.columns], _rgb(style.arrow)
        self.life = life

    def appear(self, frame: Pixels, t: float) -> None:
        """Put the arrows on the frame, unless they have faded by the time ``t`` (s)."""
        if t < self.life and self.cover.size:
            mix(frame, self.rows, self.columns, (1.0 - t / self.life) * self.cover, self.color)


def _extent(drawn: Array) -> slice:
    """Return from where to where anything is drawn."""
    at = np.flatnonzero(drawn)
    return slice(int(at[0]), int(at[-1]) + 1) if at.size else slice(0)


class Flashes:
    """Flashes light up where contacts happen, and fade at once."""

    def __init__(self, run: Run, view: View) -> None:
        places = contact_places(run)
        self.coming = [(t, view.place(at), view.scale * r) for t, at, r in places][::-1]
        self.lit: list[tuple[float, Point, float]] = []

    def appear(self, frame: Pixels, t: float, life: float, light: Array) -> None:
        """Draw the flashes that are lit at ``t``, each for ``life`` (s)."""
        while self.coming and self.coming[-1][0] <= t:
            self.lit.append(self.coming.pop())
        self.lit = [flash for flash in self.lit if flash[0] > t - life]
        for born, at, radius in self.lit:
            age = (t - born) / life
            fade = (1.0 - age) ** 2
            glow(frame, at, 0.0, (0.5 + 0.5 * age) * radius, light, 0.9 * fade)
            glow(frame, at, (0.3 + 1.2 * age) * radius, 0.14 * radius, light, 0.8 * fade)


class Strip:
    """A strip of the frame is uncovered from left to right, up to ``columns`` at ``times`` (s).

    It is the tray, or the plot in full; an upright line in ``ink`` may show where it has come to.
    """

    def __init__(
        self,
        full: Pixels,
        box: Box,
        times: Sequence[float],
        columns: Sequence[float],
        ink: str | None = None,
    ) -> None:
        self.rows = slice(max(round(len(full) - box.y1), 0), round(len(full) - box.y0))
        self.full, self.left = full[self.rows], round(box.x0)
        self.times, self.columns, self.ink = times, columns, ink and _rgb(ink)

    def appear(self, frame: Pixels, t: float) -> None:
        """Show the strip as far as it is uncovered at ``t`` (s)."""
        now = round(float(np.interp(t, self.times, self.columns)))
        frame[self.rows, self.left : now] = self.full[:, self.left : now]
        if self.ink is not None:
            frame[self.rows, now : now + 2] = self.ink


def _tray(full: Pixels, show: Show, layout: Layout, slow: float) -> Strip:
    """Return the tray, which shows balls as they have fallen, and those that were off before."""
    assert layout.tray is not None
    at = {e.balls[0]: e.t + LOOK.drop / slow for e in show.runs[0].events if e.pocket}
    places = [x for x, _ in layout.places(len(show.tray))[1]]
    ends = [0.0, *((a + b) / 2 for a, b in pairwise(places)), layout.width]
    times = np.repeat([at.get(id_, 0.0) for id_ in show.tray], 2).tolist()
    return Strip(full, layout.tray, times, np.repeat(ends, 2)[1:-1].tolist())


class Clock:
    """The clock shows the time at the right of the caption, in figures that stand still."""

    def __init__(self, layout: Layout, style: Style, decimals: int) -> None:
        size, room = 1.15 * layout.letter, layout.caption
        self.font = ImageFont.truetype(findfont(FontProperties("DejaVu Sans")), size)
        self.decimals, self.ink = decimals, style.ink
        self.foot = round(layout.height - room.y0)
        self.rows = slice(self.foot - round(size), self.foot + round(0.3 * size))
        self.columns = slice(round(room.x1 - 0.16 * room.width), round(room.x1))

    def appear(self, frame: Pixels, t: float) -> None:
        """Write ``t`` (s)."""
        image = Image.fromarray(frame[self.rows, self.columns])
        at = (image.width, self.foot - self.rows.start)
        text = f"{t:.{self.decimals}f} s"
        ImageDraw.Draw(image).text(at, text, self.ink, self.font, anchor="rs")
        frame[self.rows, self.columns] = np.asarray(image)


@dataclass(frozen=True)
class Timing:
    """A timing has the times (s) that a film shows: 1/(fps slow) apart, the last one exactly."""

    start: float
    end: float
    fps: float
    slow: float

    @property
    def frames(self) -> int:
        """The number of frames."""
        return math.ceil((self.end - self.start) * self.fps * self.slow - 1e-6) + 1

    def times(self, first: int, last: int) -> Array:
        """Return the times of the frames from ``first`` to before ``last``."""
        t = self.start + np.arange(first, last) / (self.fps * self.slow)
        return np.minimum(t, self.end)


class Stage:
    """A stage has all that a film of one shot is drawn from; :meth:`frames` draws its frames."""

    BLOCK = 64  # The positions of this many frames are asked for at once.

    def __init__(self, show: Show, size: tuple[int, int], timing: Timing, style: Style) -> None:
        self.timing = timing
        layout, slow = film_layout(show, size), timing.slow
        sheet = draw_sheet(show, layout, style, (timing.start, timing.end))
        pace = f"{slow:g} times slower" if slow > 1.0 else f"{1.0 / slow:g} times faster"
        caption = show.caption("" if slow == 1.0 else pace)
        draw_caption(sheet, layout, caption, style, share=0.84)
        lines: Any = [] if sheet.plot is None else sheet.plot.lines
        setp(lines, alpha=0.3)
        bare = np.ascontiguousarray(pixels(sheet.figure)[..., :3])
        setp(lines, alpha=None)
        if show.tray:
            draw_tray(sheet, show.runs[0], show.tray, layout, style)
        full = pixels(sheet.figure)[..., :3] if show.tray or sheet.plot else bare
        self.ground = Ground(bare, life=LIFE / slow)
        self.clock = Clock(layout, style, decimals=2 + max(0, math.ceil(math.log10(slow))))
        self.tray = _tray(full, show, layout, slow) if show.tray else None
        self.curves = None
        if sheet.plot is not None and layout.plot is not None:
            times, box = sheet.plot.get_xlim(), layout.plot
            self.curves = Strip(full, box, times, (box.x0, box.x1), style.ink)
        self.casts = [
            Cast(run, view, style, slow, solid=run is runs[0])
            for runs, view in zip(show.panels, sheet.views, strict=True)
            for run in reversed(runs)
        ]
        solid = [cast for cast in self.casts if cast.solid and timing.start == 0.0]
        self.arrows = [Arrows(cast, size, style, LOOK.shot / slow) for cast in solid]

    def frames(self) -> Iterator[Pixels]:
        """Yield the frames in order, (height, width, 3) of uint8 each; ask for them once only."""
        for first in range(0, self.timing.frames, self.BLOCK):
            times = self.timing.times(first, min(first + self.BLOCK, self.timing.frames))
            yield from self._drawn(times)

    def samples(self) -> Iterator[Pixels]:
        """Yield a few frames that have the film's colours between them; ask for them once only."""
        return self._drawn(np.linspace(self.timing.start, self.timing.end, 5))

    def _drawn(self, times: Array) -> Iterator[Pixels]:
        moves = [cast.run.at(times) for cast in self.casts]
        for k, t in enumerate(times):
            yield self._frame(float(t), [(p[k], v[k]) for p, v in moves])

    def _frame(self, t: float, states: list[tuple[Array, Array]]) -> Pixels:
        self.ground.fade(t)
        for cast, (position, _) in zip(self.casts, states, strict=True):
            cast.leave_tracks(self.ground, t, position)
        frame = self.ground.seen.copy()
        for arrows in self.arrows:
            arrows.appear(frame, t)
        for cast, (position, velocity) in zip(self.casts, states, strict=True):
            cast.appear(frame, t, position, velocity)
        for part in (self.curves, self.tray, self.clock):
            if part is not None:
                part.appear(frame, t)
        return frame


@lru_cache(maxsize=8)
def _balls(discs: tuple[DrawnBall, ...], style: Style, draw_them: Draw) -> tuple[Sprite, ...]:
    """Return the sprites of balls, wherever they are."""

    def draw(axes: Axes, middles: list[Point]) -> None:
        placed = [d._replace(x=x, y=y) for d, (x, y) in zip(discs, middles, strict=True)]
        draw_them(axes, placed, style)

    # This is how far from its centre anything of a ball is drawn, except a label beside.
    return sprites(len(discs), max(1.35 * disc.radius + 2.0 for disc in discs), draw)


@lru_cache(maxsize=8)
def _names(balls: tuple[DrawnBall, ...], style: Style) -> tuple[Sprite, ...]:
    """Return the sprites of the labels that stand beside balls."""

    def draw(axes: Axes, middles: list[Point]) -> None:
        for ball, middle in zip(balls, middles, strict=True):
            draw_label(axes, ball, middle, style)

    extent = max((half_size(b.label, b.letter)[0] + 0.5 * b.letter for b in balls), default=0.0)
    return sprites(len(balls), extent, draw) if balls else ()


def _rgb(color: str) -> Array:
    return 255.0 * np.array(to_rgb(color))
