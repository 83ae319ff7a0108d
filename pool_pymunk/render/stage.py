"""This module makes a film's frames: parts are drawn once, and put together on each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import setp
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.transforms import Bbox
from PIL import Image, ImageDraw, ImageFont

from pool_pymunk.model.arrays import Array
from pool_pymunk.model.plain import argument, number
from pool_pymunk.render import balls
from pool_pymunk.render.balls import DrawnBall, Labels, discs, half_size, moves, track_of
from pool_pymunk.render.canvas import FINE, Frame, Pixels, Sprite, canvas, dimmed, pixels
from pool_pymunk.render.sheet import Layout, draw_caption, draw_sheet, draw_tray, film_layout
from pool_pymunk.render.style import LOOK, SCREEN, Style, halo_color
from pool_pymunk.render.tracks import Ground, Track
from pool_pymunk.render.view import Show, View, contact_places
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import RenderError

Part = Callable[[Frame, float], None]  # It puts a part of the picture of a time (s) on a frame.
Draw = Callable[[Axes, Sequence[DrawnBall], Style], None]
USUAL: Mapping[str, Mapping[str, Any]] = {".gif": {"size": (800, 450), "fps": 25.0}}  # by format
RIM = 181  # what Pillow's gradient has in the middle of a side, and 0 is in the centre
SPOT = [round(255 * max(1 - k / RIM, 0) ** 1.5) for k in range(256)]  # light that ends at the rim


class Cast:
    """A cast is the balls of one run in one view, solid or as ghosts, with tracks and flashes."""

    def __init__(self, run: Run, view: View, settings: FilmSettings, *, solid: bool) -> None:
        self.run, self.view, self.solid, self.slow = run, view, solid, settings.slow
        style = settings.style.on(run.scene.table)
        self.light = to_hex(style.flash)
        self.discs = discs(run.scene, run.at([0.0])[0][0], view)
        draw = balls.draw_bodies if solid else balls.draw_ghosts
        # This is how far from its centre anything of a ball is drawn, except a label beside.
        extent = max(1.35 * disc.radius + 2.0 for disc in self.discs)
        self.sprites = _sprites(_at_origin(self.discs), extent, draw, style)
        # The rims of ghosts are seen on solid balls, too.
        self.rims = (
            () if solid else _sprites(_at_origin(self.discs), extent, balls.draw_rims, style)
        )
        self.labels = Labels(self.discs if solid else ())
        named = self.labels.balls
        extent = max((half_size(b.label, b.letter)[0] + 0.5 * b.letter for b in named), default=0.0)
        self.names = _sprites(_at_origin(named), extent, balls.draw_labels, style)
        movers = [i for i, rows in enumerate(run.knots) if moves(rows)]
        self.tracks = {i: self._track(i, settings.size) for i in movers}
        flashes = contact_places(run) if solid else ()
        self.flashes = [(row.t, view.place(at), view.scale * size) for row, at, size in flashes]
        index = run.scene.index
        taken = {index[event.balls[0]]: event.t for event in run.events if event.pocket is not None}
        self.falls = {i: (t, track_of(run, i)[-1, 1:]) for i, t in taken.items()}  # from the rim
        self.absent = [index[id_] for id_ in run.off if index[id_] not in taken]
        self.still = [i for i in range(len(self.discs)) if i not in movers]

    def _track(self, i: int, size: tuple[int, int]) -> Track:
        """Return the track of ball ``i``."""
        corners, count = track_of(self.run, i), len(self.discs)
        corners[:, 1:] = self.view.places(corners[:, 1:])
        color, wide = self.discs[i].color, balls.track_width(count) * self.discs[i].radius
        if not self.solid:
            return Track(corners, size, max(0.8 * wide, 1.0), color)
        return Track(corners, size, max(1.65 * wide, 2.0), color, halo_color(color))

    def leave_tracks(self, ground: Ground, t: float, position: Array) -> None:
        """Uncover the tracks on the ground up to where the balls are."""
        places = self.view.places(position).tolist()
        for i, track in self.tracks.items():
            track.follow(ground, t, tuple(places[i]))

    def appear(self, frame: Frame, t: float, position: Array) -> None:
        """Put the balls on the frame; light of contacts is drawn first and hides nothing.

        A ball that falls into a pocket fades.
        """
        self._shine(frame, t)
        places, strengths = self._stamp(self.sprites, frame, t, position)
        beside = self.labels.place(places).tolist() if self.names else []
        for i, name, (x, y) in zip(self.labels.of, self.names, beside, strict=True):
            name.stamp(frame, x, y, strengths[i])

    def appear_above(self, frame: Frame, t: float, position: Array) -> None:
        """Put on the frame what balls of another run must not hide: rims of ghosts that move."""
        if self.rims:
            moving = position.copy()
            moving[self.still] = math.nan
            self._stamp(self.rims, frame, t, moving)

    def _stamp(
        self, sprites: Sequence[Sprite], frame: Frame, t: float, position: Array
    ) -> tuple[Array, list[float]]:
        """Put a sprite at every ball; return the places on the frame and how strong they are."""
        seen, strengths = position.copy(), [1.0] * len(self.discs)
        seen[self.absent] = math.nan
        for i, (since, rim) in self.falls.items():
            age = min(max((t - since) * self.slow / LOOK.drop, 0.0), 1.0)
            if age > 0.0:
                seen[i], strengths[i] = rim + age * (seen[i] - rim), 1.0 - age
        places = self.view.places(seen)
        for sprite, (x, y), strength in zip(sprites, places.tolist(), strengths, strict=True):
            sprite.stamp(frame, x, y, strength)
        return places, strengths

    def _shine(self, frame: Frame, t: float) -> None:
        """Light up the places of contacts for a moment."""
        for born, (x, y), radius in self.flashes:
            age = (t - born) * self.slow / LOOK.flash
            if 0.0 <= age < 1.0:
                half = math.ceil((1.0 + age) * radius)
                at = round(x) - half, round(frame.picture.height - y) - half
                frame.picture.paste(self.light, at, dimmed(_spot(half), (1.0 - age) ** 2))


def _arrows(cast: Cast, size: tuple[int, int], style: Style, life: float) -> Part:
    """Return the arrows of a shot, one at every ball that moves as it begins; they fade."""
    figure, axes = canvas(*size)
    balls.draw_arrows(axes, cast.discs, cast.run.at([0.0])[1][0], cast.view.scale, style)
    cover, color = Image.fromarray(pixels(figure)[..., 3]), to_hex(style.arrow)
    left, top, *_ = box = cover.getbbox() or (0, 0, 1, 1)
    cover = cover.crop(box)

    def appear(frame: Frame, t: float) -> None:
        if t < life:
            frame.picture.paste(color, (left, top), dimmed(cover, 1.0 - t / life))

    return appear


def _strip(
    full: Image.Image, box: Bbox, times: Array, columns: Sequence[float], ink: str = ""
) -> Part:
    """Return a tray or plot, uncovered from left to right up to ``columns`` at ``times`` (s)."""
    left, top, foot = round(box.x0), round(full.height - box.y1), round(full.height - box.y0)

    def appear(frame: Frame, t: float) -> None:
        now = round(float(np.interp(t, times, columns)))
        frame.picture.paste(full.crop((left, top, max(now, left), foot)), (left, top))
        if ink:
            frame.picture.paste(ink, (now, top, now + 2, foot))

    return appear


def _tray(full: Image.Image, show: Show, layout: Layout, slow: float) -> Part:
    """Return the tray, which shows balls once they have fallen, and those that were off before."""
    assert layout.tray is not None
    at = {e.balls[0]: e.t + LOOK.drop / slow for e in show.runs[0].events if e.pocket}
    places = [x for x, _ in layout.places(len(show.tray))[1]]
    ends = [0.0, *((a + b) / 2 for a, b in pairwise(places)), layout.width]
    times = np.repeat([at.get(id_, 0.0) for id_ in show.tray], 2)
    return _strip(full, layout.tray, times, np.repeat(ends, 2)[1:-1].tolist())


def _clock(layout: Layout, style: Style, decimals: int) -> Part:
    """Return the time at the right of the caption, in figures that stand still."""
    size, room, ink = 1.15 * layout.letter, layout.caption, to_hex(style.ink)
    file = findfont(FontProperties("DejaVu Sans"))
    font = ImageFont.truetype(file, size, layout_engine=ImageFont.Layout.BASIC)
    wide, high, foot = round(0.16 * room.width), round(1.3 * size), round(size)
    at = round(room.x1) - wide, round(layout.height - room.y0) - foot

    def appear(frame: Frame, t: float) -> None:
        cover = Image.new("L", (wide, high))
        ImageDraw.Draw(cover).text((wide, foot), f"{t:.{decimals}f} s", 255, font, anchor="rs")
        frame.picture.paste(ink, at, cover)

    return appear


@dataclass(frozen=True)
class FilmSettings:
    """The settings say how a film is made; RenderError says what no film can have.

    ``size`` (width, height) is in pixels, ``fps`` in frames a second. ``slow`` is how many times
    slower than life it is. ``start`` and ``end`` are the times shown (s; by default it ends when
    the last ball stops), and ``pause`` (s) is how long the last frame stays.
    """

    size: tuple[int, int] = (1600, 900)
    fps: float = 60.0
    slow: float = 1.0
    start: float = 0.0
    end: float | None = None
    pause: float = 1.0
    style: Style = SCREEN

    def __post_init__(self) -> None:
        for key in ("fps", "slow"):
            if not 0.0 < (value := argument(key, getattr(self, key), number)) < math.inf:
                raise RenderError(f"{key} = {value:g}: must be greater than 0, and finite")
        sides = np.ravel(self.size).tolist()
        if [side in range(64, 8193, 2) for side in sides] != [True, True]:
            size = "x".join(map(str, sides))
            raise RenderError(f"size = {size}: must be two even numbers from 64 to 8192")
        if not 0.0 <= argument("pause", self.pause, number) < math.inf:
            raise RenderError(f"pause = {self.pause:g}: must be 0 or more, and finite")
        if not 0.0 <= self.start < (math.inf if self.end is None else self.end):
            raise RenderError(f"start = {self.start:g}: must be 0 or more, and before the end")

    @classmethod
    def of(cls, path: Path | str, **settings: Any) -> FilmSettings:
        """Make settings; what is left out gets the default of the format of the file ``path``."""
        return cls(**{**USUAL.get(Path(path).suffix.lower(), {}), **settings})

    def times(self, show: Show) -> Array:
        """Return the times (s) of a show's frames: 1/(fps slow) apart, the last one at the end.

        The last ball may still have to fall after all others have stopped.
        """
        last = max((e.t for run in show.runs for e in run.events if e.pocket), default=-math.inf)
        whole = max(show.duration, last + LOOK.drop / self.slow)
        end = whole if self.end is None else min(self.end, whole)
        start, pace = min(self.start, end), self.fps * self.slow
        count = math.ceil((end - start) * self.fps * self.slow - 1e-6)
        return np.append(start + np.arange(count) / pace, end)

    @property
    def held(self) -> int:
        """Return how many times more the last frame is shown."""
        return round(self.pause * self.fps)


class Stage:
    """A stage has all that a film of one shot is drawn from; :meth:`frames` draws its frames."""

    BLOCK = 64  # The positions of this many frames are asked for at once.

    def __init__(self, show: Show, settings: FilmSettings) -> None:
        self.times = settings.times(show)
        start, end = map(float, self.times[[0, -1]])
        size, slow, style = settings.size, settings.slow, settings.style
        layout, style = film_layout(show, size), style.on(show.runs[0].scene.table)
        sheet = draw_sheet(show, layout, style, (start, end))
        pace = f"{slow:g} times slower" if slow > 1.0 else f"{1.0 / slow:g} times faster"
        draw_caption(sheet, layout, show.caption("" if slow == 1.0 else pace), style, share=0.84)
        lines: Any = [] if sheet.plot is None else sheet.plot.lines
        setp(lines, alpha=0.3)
        bare = pixels(sheet.figure)
        self.ground = Ground(bare)
        setp(lines, alpha=None)
        if show.tray:
            draw_tray(sheet, show.runs[0], show.tray, layout, style)
        full = Image.fromarray(pixels(sheet.figure) if show.tray or sheet.plot else bare)
        self.above = [_clock(layout, style, decimals=2 + max(0, math.ceil(math.log10(slow))))]
        if show.tray:
            self.above.append(_tray(full, show, layout, slow))
        if sheet.plot is not None and layout.plot is not None:
            box, times = layout.plot, np.array(sheet.plot.get_xlim())
            self.above.append(_strip(full, box, times, box.intervalx, to_hex(style.ink)))
        self.casts = [
            Cast(run, view, settings, solid=run is runs[0])
            for runs, view in zip(show.panels, sheet.views, strict=True)
            for run in reversed(runs)
        ]
        solid = [cast for cast in self.casts if cast.solid and start == 0.0]
        self.arrows = [_arrows(cast, size, style, LOOK.shot / slow) for cast in solid]

    def frames(self) -> Iterator[Pixels]:
        """Yield the frames in order, (height, width, 4) of uint8 each; ask for them once only."""
        for first in range(0, len(self.times), self.BLOCK):
            yield from self._drawn(self.times[first : first + self.BLOCK])

    def samples(self) -> Iterator[Pixels]:
        """Yield a few frames that have the film's colours; ask for them once only."""
        return self._drawn(np.linspace(self.times[0], self.times[-1], 5))

    def _drawn(self, times: Array) -> Iterator[Pixels]:
        moves = [cast.run.at(times)[0] for cast in self.casts]
        for k, t in enumerate(times.tolist()):
            for cast, position in zip(self.casts, moves, strict=True):
                cast.leave_tracks(self.ground, t, position[k])
            frame = Frame(self.ground.pixels.copy())
            for arrows in self.arrows:
                arrows(frame, t)
            for cast, position in zip(self.casts, moves, strict=True):
                cast.appear(frame, t, position[k])
            for cast, position in zip(self.casts, moves, strict=True):
                cast.appear_above(frame, t, position[k])
            for part in self.above:
                part(frame, t)
            yield frame.pixels


@lru_cache(maxsize=16)
def _sprites(
    shown: tuple[DrawnBall, ...], extent: float, draw: Draw, style: Style
) -> tuple[Sprite, ...]:
    """Return the sprites of balls or of labels, each ``extent`` pixels around its middle."""
    if not shown:
        return ()
    half, side = math.ceil(extent) + 1, 2 * FINE * (math.ceil(extent) + 1)
    columns = math.ceil(math.sqrt(len(shown)))
    rows = math.ceil(len(shown) / columns)
    figure, axes = canvas(2 * half * columns, 2 * half * rows)
    cells = [divmod(k, columns) for k in range(len(shown))]
    middles = [(half * (2.0 * c + 1.0), half * (2.0 * (rows - r) - 1.0)) for r, c in cells]
    draw(axes, [b._replace(x=x, y=y) for b, (x, y) in zip(shown, middles, strict=True)], style)
    fine = pixels(figure, FINE)
    return tuple(Sprite(fine[r * side :, c * side :][:side, :side]) for r, c in cells)


def _at_origin(shown: list[DrawnBall]) -> tuple[DrawnBall, ...]:
    return tuple(disc._replace(x=0.0, y=0.0) for disc in shown)


@lru_cache(maxsize=256)
def _spot(half: int) -> Image.Image:
    """Return the cover of a spot of light, ``half`` pixels to each side of its middle."""
    return Image.radial_gradient("L").resize((2 * half, 2 * half)).point(SPOT)
