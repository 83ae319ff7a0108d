"""This module makes a film's frames: it draws a background once, then what moves on each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.render.balls import (
    Disc,
    discs,
    draw_arrows,
    draw_balls,
    draw_bodies,
    draw_ghosts,
    tracks,
    way,
)
from pool_pymunk.render.canvas import Pixels, pixels
from pool_pymunk.render.labels import Labels, draw_label, half_size
from pool_pymunk.render.screen import FINE, Screen, Sprite, glow, sprites
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
from pool_pymunk.render.style import LOOK, Style
from pool_pymunk.render.view import View, contact_places
from pool_pymunk.results.run import Run

Draw = Callable[[Axes, Sequence[Disc], Style], None]
CLEAR = 2.0  # A ball that travels this many radii in a second of film has its full halo.
TRACK = 0.5  # the strength of a new track
TICK = 0.16  # s of film; tracks are drawn anew, and fade, as often


class Cast:
    """A cast is the balls of one run in one view, solid or as ghosts.

    It also has their tracks, halos and flashes.
    """

    def __init__(self, run: Run, view: View, style: Style, slow: float, *, solid: bool) -> None:
        self.run, self.view, self.style, self.slow, self.solid = run, view, style, slow, solid
        self.ground = style.plane if run.scene.table is None else style.cloth
        self.discs = discs(run.scene, run.at([0.0])[0][0], view)
        anywhere = tuple(disc._replace(x=0.0, y=0.0) for disc in self.discs)
        self.sprites = _balls(anywhere, style, draw_bodies if solid else draw_ghosts)
        self.labels = Labels(self.discs if solid else ())
        self.names = _names(tuple(self.labels.balls), style)
        self.flashes = contact_places(run) if solid else []
        self.taken = {event.balls[0]: event.t for event in run.events if event.pocket is not None}
        self.leaves = [self.taken.get(disc.label, math.inf) for disc in self.discs]
        origin = np.array([0.0, view.x, view.y])
        scale = np.array([1.0, view.scale, view.scale])
        self.ways = [scale * way(run, i)[:, :3] + origin for i in range(len(self.discs))]

    def tracks(self, t: float, position: Array, since: float | None = None) -> LineCollection:
        """Return the tracks up to the time ``t`` (s), or what is new of them since they were laid.

        They were laid at the time ``since``.
        """
        places = self.view.scale * position + (self.view.x, self.view.y)
        if since is None:
            self.laid = places
        paths = []
        for i, path in enumerate(self.ways):
            passed = path[(path[:, 0] <= t) & (since is None or path[:, 0] > since), 1:]
            first = self.laid[:0] if since is None else self.laid[i : i + 1]
            here = places[i : i + 1] if t < self.leaves[i] else places[:0]
            paths.append(np.concatenate([first, passed, here]))
        new = since is not None
        return tracks(paths, self.discs, self.ground, solid=self.solid, strength=TRACK, new=new)

    def appear(self, screen: Screen, t: float, position: Array, velocity: Array) -> None:
        """Put the balls on the screen; light around them shines from below and hides nothing."""
        if self.solid:
            self._flash(screen, t)
            self._halos(screen, position, velocity)
        seen = [self._place(i, t, at) for i, at in enumerate(position)]
        places = np.array([self.view.place(place) for place, _ in seen])
        for sprite, (x, y), (_, strength) in zip(self.sprites, places.tolist(), seen, strict=True):
            sprite.stamp(screen, x, y, strength)
        beside = self.labels.place(places).tolist()
        for i, name, (x, y) in zip(self.labels.of, self.names, beside, strict=True):
            name.stamp(screen, x, y, seen[i][1])

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

    def _halos(self, screen: Screen, position: Array, velocity: Array) -> None:
        """Draw a pale ring around every ball that moves; it fades as the ball comes to rest."""
        speeds = np.hypot(velocity[:, 0], velocity[:, 1])
        for i in np.flatnonzero(speeds):
            radius = self.discs[i].radius
            strength = min(1.0, speeds[i] * self.view.scale / self.slow / (CLEAR * radius))
            halo = _halo(radius, self.style.flash)
            halo.stamp(screen, *self.view.place(position[i]), 0.5 * float(strength))

    def _flash(self, screen: Screen, t: float) -> None:
        """Light up where contacts have just happened."""
        life = LOOK.flash / self.slow
        for born, place, size in self.flashes:
            if not t - life < born <= t:
                continue
            age, radius = (t - born) / life, size * self.view.scale
            x, y = self.view.place(place)
            for ring, soft, strength in (
                (0.0, 0.5 + 0.5 * age, 0.9),
                (0.3 + 1.2 * age, 0.14, 0.8),
            ):
                light = glow(ring * radius, soft * radius, self.style.flash)
                half = len(light) // 2
                screen.put(light, round(x) - half, round(y) - half, strength * (1.0 - age) ** 2)


class Tray:
    """The tray shows the balls that pockets have taken, and those that were off before."""

    def __init__(self, show: Show, layout: Layout, sheet: Sheet, style: Style, slow: float) -> None:
        run, view = show.runs[0], sheet.views[0]
        self.words = draw_tray(sheet.axes, layout, style)
        at = {event.balls[0]: event.t + LOOK.drop / slow for event in run.events if event.pocket}
        balls = in_tray(run, show.tray, layout, view)
        anywhere = tuple(ball._replace(x=0.0, y=0.0) for ball in balls)
        beside = max(2.0 * half_size(ball)[0] for ball in balls)
        drawn = _balls(anywhere, style, draw_balls, beside)
        self.balls = [
            (at.get(ball.label, -math.inf), sprite, (ball.x, ball.y))
            for ball, sprite in zip(balls, drawn, strict=True)
        ]

    def appear(self, screen: Screen, t: float) -> None:
        """Show the balls that have fallen by the time ``t`` (s)."""
        lying = [(sprite, place) for since, sprite, place in self.balls if t >= since]
        if lying:
            self.words.draw(screen.renderer)
        for sprite, place in lying:
            sprite.stamp(screen, *place)


class Curves:
    """Curves are the plot of the distances.

    They are faint at first, and drawn in full up to the time of the frame.
    """

    def __init__(self, sheet: Sheet, layout: Layout, style: Style) -> None:
        assert sheet.plot is not None and layout.plot is not None
        box = layout.plot
        self.rows = slice(round(layout.height - box.y1), round(layout.height - box.y0))
        self.start, self.end = sheet.plot.get_xlim()
        self.left, self.right, self.foot = round(box.x0), round(box.x1), round(box.y0)
        self.full = pixels(sheet.figure)[self.rows, self.left : self.right][::-1]
        for line in sheet.plot.lines:
            line.set(alpha=0.3, path_effects=[])
        self.line = np.array([[_bytes(style.ink)] * 2] * len(self.full), dtype=np.uint8)

    def appear(self, screen: Screen, t: float) -> None:
        """Show the curves up to ``t`` (s), with an upright line there."""
        share = min(max((t - self.start) / (self.end - self.start), 0.0), 1.0)
        now = round(share * (self.right - self.left))
        if now:
            screen.put(np.ascontiguousarray(self.full[:, :now]), self.left, self.foot)
        screen.put(self.line, self.left + now, self.foot)


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

    BLOCK = 64  # The positions of this number of frames are asked for at once.

    def __init__(self, show: Show, size: tuple[int, int], timing: Timing, style: Style) -> None:
        self.timing, self.style = timing, style
        self.layout = film_layout(show, size)
        self.sheet = draw_sheet(show, self.layout, style, (timing.start, timing.end))
        pace = "" if timing.slow == 1.0 else _pace(timing.slow)
        draw_caption(self.sheet, self.layout, show.caption(pace), style, share=0.84)
        has_plot = self.sheet.plot is not None
        self.curves = Curves(self.sheet, self.layout, style) if has_plot else None
        self.screen = Screen(self.sheet.figure)
        self.bare, self.tick = self.screen.kept, math.inf
        has_tray = bool(show.tray)
        self.tray = Tray(show, self.layout, self.sheet, style, timing.slow) if has_tray else None
        self.casts = [
            Cast(run, view, style, timing.slow, solid=run is runs[0])
            for runs, view in zip(show.panels, self.sheet.views, strict=True)
            for run in reversed(runs)
        ]
        self.arrows = [
            arrow
            for cast in self.casts
            if cast.solid and timing.start == 0.0
            for arrow in draw_arrows(
                self.sheet.axes, cast.discs, cast.run.at([0.0])[1][0], cast.view.scale, style
            )
        ]

    def frames(self) -> Iterator[Pixels]:
        """Yield the frames in order, (height, width, 3) of uint8 each; ask for them once only."""
        for first in range(0, self.timing.frames, self.BLOCK):
            times = self.timing.times(first, min(first + self.BLOCK, self.timing.frames))
            yield from self._drawn(times)

    def samples(self) -> Iterator[Pixels]:
        """Yield a few frames that have the film's colours between them."""
        return self._drawn(np.linspace(self.timing.start, self.timing.end, 5))

    def _drawn(self, times: Array) -> Iterator[Pixels]:
        moves = [cast.run.at(times) for cast in self.casts]
        for k, t in enumerate(times):
            yield self._frame(float(t), [(p[k], v[k]) for p, v in moves])

    def _frame(self, t: float, states: list[tuple[Array, Array]]) -> Pixels:
        screen, slow = self.screen, self.timing.slow
        if not 0.0 <= t - self.tick < TICK / slow:
            self._lay_ground(t, [position for position, _ in states])
        screen.clear()
        for cast, (position, _) in zip(self.casts, states, strict=True):
            cast.tracks(t, position, self.tick).draw(screen.renderer)
        strength = 1.0 - t * slow / LOOK.shot
        for arrow in self.arrows if strength > 0.0 else ():
            arrow.set_alpha(0.9 * strength)
            arrow.draw(screen.renderer)
        for cast, (position, velocity) in zip(self.casts, states, strict=True):
            cast.appear(screen, t, position, velocity)
        if self.curves is not None:
            self.curves.appear(screen, t)
        if self.tray is not None:
            self.tray.appear(screen, t)
        size, caption = 1.15 * self.layout.letter, self.layout.caption
        decimals = 2 + max(0, math.ceil(math.log10(slow)))
        screen.write(f"{t:.{decimals}f} s", caption.x1, caption.y0, size, self.style.ink)
        return screen.pixels()

    def _lay_ground(self, t: float, positions: list[Array]) -> None:
        """Draw what lies under the balls from now on: the table, and tracks as old as they are."""
        self.screen.kept, self.tick = self.bare, t
        self.screen.clear()
        for cast, position in zip(self.casts, positions, strict=True):
            cast.tracks(t, position).draw(self.screen.renderer)
        self.screen.keep()


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


@lru_cache(maxsize=64)
def _halo(radius: float, color: str) -> Sprite:
    return Sprite(glow(FINE * radius, FINE * 0.16 * radius, color))


def _bytes(color: str) -> tuple[int, int, int, int]:
    red, green, blue = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue, 255


def _pace(slow: float) -> str:
    return f"{slow:g} times slower" if slow > 1.0 else f"{1.0 / slow:g} times faster"
