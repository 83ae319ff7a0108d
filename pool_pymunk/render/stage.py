"""This module makes a film's frames: it draws a background once, then what moves on each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.artist import setp
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.transforms import Bbox
from PIL import Image, ImageDraw, ImageFont

from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.render import balls
from pool_pymunk.render.balls import DrawnBall, Labels, discs, half_size, track_of
from pool_pymunk.render.canvas import Pixels, Sprite, canvas, glow, mixed, pixels, sprites
from pool_pymunk.render.sheet import Layout, draw_caption, draw_sheet, draw_tray, film_layout
from pool_pymunk.render.style import LOOK, Style, halo_color
from pool_pymunk.render.tracks import LIFE, Ground, Track
from pool_pymunk.render.view import Show, View, contact_places
from pool_pymunk.results.run import Run

Draw = Callable[[Axes, Sequence[DrawnBall], Style], None]
TRACK_STRENGTH = 0.9  # of a new track
CLEAR = 2.0  # A ball that travels this many radii in a second of film has its full halo.


class Cast:
    """A cast is the balls of one run in one view, solid or as ghosts, with tracks and flashes."""

    def __init__(self, run: Run, view: View, style: Style, slow: float, *, solid: bool) -> None:
        self.run, self.view, self.solid, self.slow = run, view, solid, slow
        self.light = _rgb(style.flash)
        self.discs = discs(run.scene, run.at([0.0])[0][0], view)
        # This is how far from its centre anything of a ball is drawn, except a label beside.
        extent = max(1.35 * disc.radius + 2.0 for disc in self.discs)
        draw = balls.draw_bodies if solid else balls.draw_ghosts
        self.sprites = _sprites(_at_origin(self.discs), extent, draw, style)
        self.labels = Labels(self.discs if solid else ())
        named = self.labels.balls
        extent = max((half_size(b.label, b.letter)[0] + 0.5 * b.letter for b in named), default=0.0)
        self.names = _sprites(_at_origin(named), extent, balls.draw_labels, style)
        self.tracks = [self._track(i) for i in range(len(self.discs))]
        flashes = contact_places(run) if solid else ()
        self.flashes = [(t, view.place(at), view.scale * radius) for t, at, radius in flashes]
        self.taken = {event.balls[0]: event.t for event in run.events if event.pocket is not None}

    def _track(self, i: int) -> Track:
        """Return a ball's track; a ghost's is thin and has no halo."""
        disc, breakpoints = self.discs[i], track_of(self.run, i)
        wide = max(1.2 * balls.track_width(len(self.discs)) * disc.radius, 1.5)
        corners = np.column_stack([breakpoints[:, 0], self.view.places(breakpoints[:, 1:3])])
        width, halo = (wide, _rgb(halo_color(disc.color))) if self.solid else (0.5 * wide, None)
        return Track(corners, width, _rgb(disc.color), TRACK_STRENGTH, halo)

    def leave_tracks(self, ground: Ground, t: float, position: Array) -> None:
        """Draw the tracks on the ground up to where the balls are."""
        places = self.view.places(position)
        for disc, track, place in zip(self.discs, self.tracks, places, strict=True):
            track.extend_to(ground, t, place if t < self.taken.get(disc.label, math.inf) else None)

    def appear(self, frame: Pixels, t: float, position: Array, velocity: Array) -> None:
        """Put the balls on the frame; light around them shines from below and hides nothing."""
        if self.solid:
            self._shine(frame, t, position, velocity)
        seen = [self._place(i, t, at) for i, at in enumerate(position.tolist())]
        places = self.view.places(np.array([place for place, _ in seen]))
        for sprite, (x, y), (_, strength) in zip(self.sprites, places.tolist(), seen, strict=True):
            sprite.stamp(frame, x, y, strength)
        beside = self.labels.place(places).tolist()
        for i, name, (x, y) in zip(self.labels.of, self.names, beside, strict=True):
            name.stamp(frame, x, y, seen[i][1])

    def _place(self, i: int, t: float, position: Point) -> tuple[Point, float]:
        """Return where a ball is seen (m), and how clearly: it fades as it falls into a pocket."""
        id_, (x, y) = self.discs[i].label, position
        if id_ in self.run.off and id_ not in self.taken:
            return (math.nan, math.nan), 0.0
        if id_ not in self.taken or t < self.taken[id_]:
            return (x, y), 1.0
        age = min((t - self.taken[id_]) * self.slow / LOOK.drop, 1.0)
        x0, y0 = track_of(self.run, i)[-1, 1:3].tolist()  # on the rim
        return (x0 + age * (x - x0), y0 + age * (y - y0)), 1.0 - age

    def _shine(self, frame: Pixels, t: float, position: Array, velocity: Array) -> None:
        """Draw flashes where contacts were, and a pale ring around every ball that moves."""
        for born, at, radius in self.flashes:
            age = (t - born) * self.slow / LOOK.flash
            if 0.0 <= age < 1.0:
                fade = (1.0 - age) ** 2
                glow(frame, at, 0.0, (0.5 + 0.5 * age) * radius, self.light, 0.9 * fade)
                glow(frame, at, (0.3 + 1.2 * age) * radius, 0.14 * radius, self.light, 0.8 * fade)
        speeds, places = np.hypot(*velocity.T).tolist(), self.view.places(position).tolist()
        for disc, (x, y), speed in zip(self.discs, places, speeds, strict=True):
            strength = min(1.0, speed * self.view.scale / self.slow / (CLEAR * disc.radius))
            if speed:
                glow(frame, (x, y), disc.radius, 0.16 * disc.radius, self.light, 0.5 * strength)


class Arrows:
    """These are the arrows of a shot, one at every ball that moves as it begins; they fade."""

    def __init__(self, cast: Cast, size: tuple[int, int], style: Style, life: float) -> None:
        figure, axes = canvas(*size)
        balls.draw_arrows(axes, cast.discs, cast.run.at([0.0])[1][0], cast.view.scale, style)
        cover = pixels(figure)[..., 3]
        left, top, right, bottom = Image.fromarray(cover).getbbox() or (0, 0, 0, 0)
        self.rows, self.columns = slice(top, bottom), slice(left, right)
        self.cover, self.color = cover[self.rows, self.columns] / 255.0, _rgb(style.arrow)
        self.life = life

    def appear(self, frame: Pixels, t: float) -> None:
        """Put the arrows on the frame, unless they have faded by the time ``t`` (s)."""
        if t < self.life and self.cover.size:
            part, share = frame[self.rows, self.columns], (1.0 - t / self.life) * self.cover
            part[:] = mixed(part, self.color, share)


class Strip:
    """A strip is a tray or plot, uncovered from left to right up to ``columns`` at ``times``."""

    def __init__(
        self, full: Pixels, box: Bbox, times: Array, columns: Sequence[float], ink: str = ""
    ) -> None:
        self.rows = slice(max(round(len(full) - box.y1), 0), round(len(full) - box.y0))
        self.full, self.left = full[self.rows], round(box.x0)
        self.times, self.columns, self.ink = times, columns, _rgb(ink) if ink else None

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
    times = np.repeat([at.get(id_, 0.0) for id_ in show.tray], 2)
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


class Stage:
    """A stage has all that a film of one shot is drawn from; :meth:`frames` draws its frames."""

    BLOCK = 64  # The positions of this many frames are asked for at once.

    def __init__(self, show: Show, size: tuple[int, int], timing: Timing, style: Style) -> None:
        self.timing = timing
        layout, slow = film_layout(show, size), timing.slow
        style = style.on(show.runs[0].scene.table)
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
            box, times = layout.plot, np.array(sheet.plot.get_xlim())
            self.curves = Strip(full, box, times, box.intervalx, style.ink)
        self.casts = [
            Cast(run, view, style, slow, solid=run is runs[0])
            for runs, view in zip(show.panels, sheet.views, strict=True)
            for run in reversed(runs)
        ]
        solid = [cast for cast in self.casts if cast.solid and timing.start == 0.0]
        self.arrows = [Arrows(cast, size, style, LOOK.shot / slow) for cast in solid]

    def frames(self) -> Iterator[Pixels]:
        """Yield the frames in order, (height, width, 3) of uint8 each; ask for them once only."""
        start, end, fps, slow = astuple(self.timing)
        times = np.minimum(start + np.arange(self.timing.frames) / (fps * slow), end)
        for first in range(0, len(times), self.BLOCK):
            yield from self._drawn(times[first : first + self.BLOCK])

    def samples(self) -> Iterator[Pixels]:
        """Yield a few frames that have the film's colours; ask for them once only."""
        return self._drawn(np.linspace(self.timing.start, self.timing.end, 5))

    def _drawn(self, times: Array) -> Iterator[Pixels]:
        moves = [cast.run.at(times) for cast in self.casts]
        for k, t in enumerate(times.tolist()):
            self.ground.fade(t)
            for cast, (position, _) in zip(self.casts, moves, strict=True):
                cast.leave_tracks(self.ground, t, position[k])
            frame = self.ground.seen.copy()
            for arrows in self.arrows:
                arrows.appear(frame, t)
            for cast, (position, velocity) in zip(self.casts, moves, strict=True):
                cast.appear(frame, t, position[k], velocity[k])
            for part in (self.curves, self.tray, self.clock):
                if part is not None:
                    part.appear(frame, t)
            yield frame


@lru_cache(maxsize=16)
def _sprites(
    shown: tuple[DrawnBall, ...], extent: float, draw: Draw, style: Style
) -> tuple[Sprite, ...]:
    """Return the sprites of balls or of their labels."""

    def draw_all(axes: Axes, middles: list[Point]) -> None:
        draw(axes, [d._replace(x=x, y=y) for d, (x, y) in zip(shown, middles, strict=True)], style)

    return sprites(len(shown), extent, draw_all) if shown else ()


def _at_origin(shown: list[DrawnBall]) -> tuple[DrawnBall, ...]:
    return tuple(disc._replace(x=0.0, y=0.0) for disc in shown)


def _rgb(color: str) -> Array:
    return 255.0 * np.array(to_rgb(color))
