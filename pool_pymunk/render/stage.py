"""This module makes a film's frames: it draws a background once, then what moves on each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.render.balls import (
    Disc,
    discs,
    draw_arrows,
    draw_balls,
    draw_bodies,
    draw_ghosts,
    track_width,
    way,
)
from pool_pymunk.render.canvas import Pixels, canvas, draw_text, pixels
from pool_pymunk.render.labels import Labels, draw_label, half_size
from pool_pymunk.render.sheet import (
    Layout,
    Sheet,
    Show,
    draw_caption,
    draw_sheet,
    draw_tray,
    film_layout,
    in_tray,
)
from pool_pymunk.render.sprites import Sprite, glow, mix, sprites
from pool_pymunk.render.style import LOOK, Style, halo_color
from pool_pymunk.render.tracks import LIFE, Ground, Track
from pool_pymunk.render.view import View, contact_places
from pool_pymunk.results.run import Run

Draw = Callable[[Axes, Sequence[Disc], Style], None]
TRACK_STRENGTH = 0.5  # of a new track
CLEAR = 2.0  # A ball that travels this many radii in a second of film has its full halo.


class Cast:
    """A cast is the balls of one run in one view, solid or as ghosts.

    It also has their tracks, halos and flashes.
    """

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
        disc, knots = self.discs[i], way(self.run, i)
        places = self.view.scale * knots[:, 1:3] + (self.view.x, self.view.y)
        wide = max(1.2 * track_width(len(self.discs)) * disc.radius, 1.5)
        corners = np.column_stack([knots[:, 0], places])
        width, halo = (wide, _rgb(halo_color(disc.color))) if self.solid else (0.5 * wide, None)
        return Track(corners, width, _rgb(disc.color), TRACK_STRENGTH, halo)

    def leave_tracks(self, ground: Ground, t: float, position: Array) -> None:
        """Draw the tracks on the ground up to where the balls are."""
        places = self.view.scale * position + (self.view.x, self.view.y)
        for disc, track, place in zip(self.discs, self.tracks, places, strict=True):
            track.reach(ground, t, place if t < self.taken.get(disc.label, math.inf) else None)

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
        x0, y0 = way(self.run, i)[-1, 1:3].tolist()  # on the rim
        return (x0 + age * (x - x0), y0 + age * (y - y0)), 1.0 - age

    def _halos(self, frame: Pixels, position: Array, velocity: Array) -> None:
        """Draw a pale ring around every ball that moves; it fades as the ball comes to rest."""
        speeds = np.hypot(velocity[:, 0], velocity[:, 1])
        for i in np.flatnonzero(speeds):
            radius = self.discs[i].radius
            strength = min(1.0, speeds[i] * self.view.scale / self.slow / (CLEAR * radius))
            at = self.view.place((float(position[i, 0]), float(position[i, 1])))
            glow(frame, at, radius, 0.16 * radius, self.light, 0.5 * float(strength))


class Print:
    """A print is a drawing of one colour that stands still and can be put on any frame."""

    def __init__(self, figure: Figure, color: str) -> None:
        self.color = _rgb(color)
        cover = pixels(figure)[..., 3] / 255.0
        rows, columns = (np.flatnonzero(cover.any(axis=k)) for k in (1, 0))
        self.rows, self.columns = (
            slice(int(at[0]), int(at[-1]) + 1) if at.size else slice(0) for at in (rows, columns)
        )
        self.cover = cover[self.rows, self.columns]

    def appear(self, frame: Pixels, strength: float) -> None:
        """Put the drawing on the frame; it is not seen unless the ``strength`` is above 0."""
        if strength > 0.0 and self.cover.size:
            mix(frame, self.rows, self.columns, strength * self.cover, self.color)


def _arrows(run: Run, balls: list[Disc], size: tuple[int, int], style: Style) -> Print:
    """Return the arrows of the shot, one at every ball that moves as it begins."""
    figure, axes = canvas(*size)
    scale = balls[0].radius / run.scene.balls[0].radius
    draw_arrows(axes, balls, run.at([0.0])[1][0], scale, style)
    return Print(figure, style.arrow)


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


class Tray:
    """The tray shows the balls that pockets have taken, and those that were off before.

    As long as there are none it is not seen.
    """

    def __init__(self, show: Show, layout: Layout, view: View, style: Style, slow: float) -> None:
        run = show.runs[0]
        at = {event.balls[0]: event.t + LOOK.drop / slow for event in run.events if event.pocket}
        balls = in_tray(run, show.tray, layout, view)
        anywhere = tuple(ball._replace(x=0.0, y=0.0) for ball in balls)
        beside = max(2.0 * half_size(ball)[0] for ball in balls)
        drawn = _balls(anywhere, style, draw_balls, beside)
        self.balls = [
            (at.get(ball.label, 0.0), sprite, (ball.x, ball.y))
            for ball, sprite in zip(balls, drawn, strict=True)
        ]
        figure, axes = canvas(layout.width, layout.height)
        draw_tray(axes, layout, style)
        self.words = Print(figure, style.faint)

    def appear(self, frame: Pixels, t: float) -> None:
        """Show the balls that have fallen by the time ``t`` (s)."""
        if any(t >= since for since, *_ in self.balls):
            self.words.appear(frame, 1.0)
        for since, sprite, place in self.balls:
            if t >= since:
                sprite.stamp(frame, *place)


class Clock:
    """The clock shows the time, in figures of one width that stand still."""

    def __init__(self, layout: Layout, style: Style, decimals: int) -> None:
        size = 1.15 * layout.letter
        self.decimals = decimals
        self.right, self.y = layout.caption.x1, layout.caption.y0 + 0.36 * size
        self.letters = _letters("0123456789.s", size, style.ink)
        self.width = dict.fromkeys("0123456789", 0.65 * size)
        self.width |= {".": 0.36 * size, " ": 0.3 * size, "s": 0.5 * size}

    def appear(self, frame: Pixels, t: float) -> None:
        """Write ``t`` (s) at the right."""
        x = self.right
        for letter in reversed(f"{t:.{self.decimals}f} s"):
            x -= self.width[letter]
            if letter != " ":
                self.letters[letter].stamp(frame, round(x + self.width[letter] / 2), self.y)


class Curves:
    """Curves are the plot of the distances.

    They are faint at first, and drawn in full up to the time of the frame.
    """

    def __init__(self, sheet: Sheet, layout: Layout, style: Style) -> None:
        assert sheet.plot is not None and layout.plot is not None
        box = layout.plot
        self.rows = slice(round(layout.height - box.y1), round(layout.height - box.y0))
        self.start, self.end = sheet.plot.get_xlim()
        self.left, self.right = round(box.x0), round(box.x1)
        self.full = pixels(sheet.figure)[self.rows, :, :3]
        self.ink = _rgb(style.ink).astype(np.uint8)
        for line in sheet.plot.lines:
            line.set(alpha=0.3, path_effects=[])

    def appear(self, frame: Pixels, t: float) -> None:
        """Show the curves up to ``t`` (s), with an upright line there."""
        share = min(max((t - self.start) / (self.end - self.start), 0.0), 1.0)
        now = self.left + round(share * (self.right - self.left))
        columns = slice(self.left, now)
        frame[self.rows, columns] = self.full[:, columns]
        frame[self.rows, now : now + 2] = self.ink


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
        layout = film_layout(show, size)
        sheet = draw_sheet(show, layout, style, (timing.start, timing.end))
        pace = "" if timing.slow == 1.0 else _pace(timing.slow)
        draw_caption(sheet, layout, show.caption(pace), style, share=0.84)
        self.curves = Curves(sheet, layout, style) if sheet.plot is not None else None
        bare = np.ascontiguousarray(pixels(sheet.figure)[..., :3])
        self.ground = Ground(bare, life=LIFE / timing.slow)
        self.clock = Clock(layout, style, decimals=2 + max(0, math.ceil(math.log10(timing.slow))))
        self.tray = Tray(show, layout, sheet.views[0], style, timing.slow) if show.tray else None
        self.casts = [
            Cast(run, view, style, timing.slow, solid=run is runs[0])
            for runs, view in zip(show.panels, sheet.views, strict=True)
            for run in reversed(runs)
        ]
        at_start = timing.start == 0.0
        self.arrows = [
            _arrows(c.run, c.discs, size, style) for c in self.casts if at_start and c.solid
        ]

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
            arrows.appear(frame, 1.0 - t * self.timing.slow / LOOK.shot)
        for cast, (position, velocity) in zip(self.casts, states, strict=True):
            cast.appear(frame, t, position, velocity)
        if self.curves is not None:
            self.curves.appear(frame, t)
        if self.tray is not None:
            self.tray.appear(frame, t)
        self.clock.appear(frame, t)
        return frame


@lru_cache(maxsize=8)
def _balls(
    discs: tuple[Disc, ...], style: Style, draw_them: Draw, beside: float = 0.0
) -> tuple[Sprite, ...]:
    """Return the sprites of balls, wherever they are, with so much room ``beside`` for labels."""

    def draw(axes: Axes, middles: list[Point]) -> None:
        placed = [d._replace(x=x, y=y) for d, (x, y) in zip(discs, middles, strict=True)]
        draw_them(axes, placed, style)

    return sprites(len(discs), max(disc.reach for disc in discs) + beside, draw)


@lru_cache(maxsize=8)
def _names(balls: tuple[Disc, ...], style: Style) -> tuple[Sprite, ...]:
    """Return the sprites of the labels that stand beside balls."""

    def draw(axes: Axes, middles: list[Point]) -> None:
        for ball, middle in zip(balls, middles, strict=True):
            draw_label(axes, ball, middle, style)

    reach = max((half_size(ball)[0] + 0.5 * ball.letter for ball in balls), default=0.0)
    return sprites(len(balls), reach, draw) if balls else ()


@lru_cache(maxsize=8)
def _letters(text: str, size: float, color: str) -> dict[str, Sprite]:
    """Return a sprite for each letter; they stand 0.36 sizes below their middles."""

    def draw(axes: Axes, middles: list[Point]) -> None:
        for letter, (x, y) in zip(text, middles, strict=True):
            at = (x, y - 0.36 * size)
            draw_text(axes, letter, at, size, 4.0 * size, ha="center", color=color)

    return dict(zip(text, sprites(len(text), size, draw), strict=True))


def _rgb(color: str) -> Array:
    return 255.0 * np.array(to_rgb(color))


def _pace(slow: float) -> str:
    return f"{slow:g} times slower" if slow > 1.0 else f"{1.0 / slow:g} times faster"
