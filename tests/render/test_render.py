"""Pictures and films: their files are sound, and balls are seen where the solver has them."""

from __future__ import annotations

import gc
import subprocess
import sys
import tracemalloc
import weakref
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.transforms import Bbox
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from pool_pymunk import Run, load, loads, simulate
from pool_pymunk.model import Ball, Physics, Restitution, Scene, Table
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.scenario import bundled
from pool_pymunk.render import (
    FilmSettings,
    RenderError,
    Show,
    balls,
    canvas,
    film,
    films,
    frame_count,
    join,
    picture,
    style,
)
from pool_pymunk.render.balls import DrawnBall, Labels, track_of, track_width, tracks
from pool_pymunk.render.canvas import Figure, Sprite, pixels
from pool_pymunk.render.pictures import figure_of
from pool_pymunk.render.sheet import film_layout, picture_layout
from pool_pymunk.render.stage import Stage
from pool_pymunk.render.style import LOOK, POOL, PRINT, ball_colors, halo_color, striped
from pool_pymunk.render.table import numbers, sights, woodwork
from pool_pymunk.render.tracks import Ground, Track
from pool_pymunk.render.view import contact_places, fit, headings, settings
from tests.shared.scenes import sliding, takes_long, typed
from tests.shared.texts import text_of

Frame = NDArray[np.uint8]

# One ball moves (magenta) and two never do (cyan, orange), in colours that cloth does not have.
SCENE = text_of("three_balls")
TABLES = {
    "rectangle": "length = 2.0\nwidth = 1.0",
    "hexagon": "outline = [[0.0,0.0],[2.0,0.0],[2.4,0.5],[2.0,1.0],[0.0,1.0],[-0.4,0.5]]",
    "L": "outline = [[0.0,0.0],[2.0,0.0],[2.0,1.0],[1.2,1.0],[1.2,1.6],[0.0,1.6]]",
}
SMALL = FilmSettings(size=(640, 360))


@pytest.fixture(scope="module", autouse=True)
def pale_tracks() -> Iterator[None]:
    """Have paler tracks in films, so that a strong colour tells where a ball is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pool_pymunk.render.tracks.STRENGTH", 0.5)
        yield


def shoot(table: str = "rectangle", velocity: str = "[1.8, 0.35]") -> Run:
    scene = loads(SCENE.format(table=TABLES[table], velocity=velocity))
    return simulate(scene, solver="event-driven")


@pytest.fixture(scope="module")
def run() -> Run:
    return shoot()


@pytest.fixture(scope="module")
def filmed(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    film(run, path, SMALL)
    return path


class Colors(Stage):
    """A stage of which the frames have red, green and blue alone."""

    def frames(self) -> Iterator[Frame]:
        return (frame[..., :3].copy() for frame in super().frames())


def stage_of(show: Show, settings: FilmSettings = SMALL) -> Colors:
    """Return what draws the frames of a film."""
    return Colors(show, settings)


def rows_of(box: Bbox | None) -> slice:
    """Return the rows of a part of small films."""
    assert box is not None
    return slice(round(SMALL.size[1] - box.y1), round(SMALL.size[1] - box.y0))


def has(frame: Frame, color: str) -> NDArray[np.bool_]:
    """Tell which pixels have the colour, or nearly."""
    wanted = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)])
    return np.asarray((np.abs(frame.astype(int) - wanted) < 70).all(axis=-1))


def centre(
    frame: Frame, color: str, left: int = 0, right: int | None = None
) -> tuple[Array, float]:
    """Return the middle and the radius of the disc of a colour in a frame's columns, in pixels.

    The middle is (x, y upwards). The body of the ball is found by its colour; spot, label and
    outline do not shift its middle.
    """
    mask = has(frame[:, left:right], color)
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    x = left + (columns[0] + columns[-1] + 1) / 2
    y = len(frame) - (rows[0] + rows[-1] + 1) / 2
    return np.array([x, y]), (len(rows) + len(columns)) / 4


class Gauge:
    """A gauge has pixels per metre and the origin, taken from the two balls that never move."""

    def __init__(self, frame: Frame, left: int = 0, right: int | None = None) -> None:
        a, self.radius = centre(frame, "#00ffff", left, right)
        b, _ = centre(frame, "#ff9000", left, right)
        self.scale = float(b[0] - a[0]) / 1.6
        self.origin = a - self.scale * 0.2
        assert abs(a[1] - b[1]) <= 1.0

    def place(self, position: Array) -> Array:
        return self.origin + self.scale * position


def read_image(path: Path) -> Frame:
    """Return red, green and blue of a picture."""
    return np.asarray(Image.open(path).convert("RGB"))


def frames_of(path: Path) -> list[Frame]:
    with av.open(str(path)) as film:
        frames = (each.reformat(format="rgb24", threads=1) for each in film.decode(video=0))
        return [frame.to_ndarray().astype(np.uint8, copy=False) for frame in frames]


def facts_of(path: Path) -> dict[str, Any]:
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert stream.duration is not None and stream.time_base is not None
        return {
            "codec": stream.codec_context.name,
            "video_format": stream.pix_fmt,
            "fps": float(stream.average_rate or 0),
            "size": (stream.width, stream.height),
            "duration": float(stream.duration * stream.time_base),
        }


# -- films -------------------------------------------------------------------------------------


def test_film_is_h264_that_plays_everywhere(filmed: Path, run: Run) -> None:
    facts = facts_of(filmed)
    frames = len(frames_of(filmed))
    assert facts["codec"] == "h264"
    assert facts["video_format"] == "yuv420p"
    assert facts["fps"] == 60.0
    assert facts["size"] == (640, 360)
    assert frames == int(np.ceil(run.duration * 60)) + 1 + 60
    assert facts["duration"] == pytest.approx(frames / 60, abs=0.02)
    assert frame_count(run, SMALL) == frames - 60


def test_the_options_of_the_codec_are_used(filmed: Path) -> None:
    """x264 writes into the film what it used."""
    with av.open(str(filmed)) as opened:
        codec = opened.streams.video[0].codec_context
        assert (codec.colorspace, codec.color_range) == (6, 1)  # BT.601's matrix, limited range
    content = filmed.read_bytes()
    written = content[content.index(b"x264 - core") :].split(b"\0")[0].decode("latin-1")
    options = dict(one.split("=") for one in written.split("options: ")[1].split() if "=" in one)
    superfast = {"me": "dia", "subme": "1", "ref": "1", "trellis": "0"}
    assert superfast.items() <= options.items()
    assert (options["crf"], options["bframes"], options["sliced_threads"]) == ("18.0", "0", "0")
    assert content.index(b"moov") < content.index(b"mdat")  # It starts to play at once.


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_colors_in_films_are_those_drawn(suffix: str, tmp_path: Path) -> None:
    """Also of fifteen balls, whose colours few pixels have, and some of which lie in the tray."""
    run = simulate(load("eight-ball"), "Break", solver="event-driven")
    show, settings = Show((run,)), FilmSettings(size=(640, 360), fps=2.0, pause=0.0)
    film(run, tmp_path / f"a{suffix}", settings)
    stage = stage_of(show, settings)
    for drawn, shown in zip(stage.frames(), frames_of(tmp_path / f"a{suffix}"), strict=True):
        error = np.abs(drawn.astype(int) - shown).max(axis=-1)
        assert error.mean() < 4.0
        assert (error > 64).mean() < 1e-3


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_film_is_written_while_it_is_drawn(suffix: str, tmp_path: Path) -> None:
    """No more than a few frames are in memory, and the file grows from the start."""
    path, random = tmp_path / f"a{suffix}", np.random.default_rng(1)
    drawn: list[weakref.ref[Frame]] = []
    sizes = []

    def frames() -> Iterator[Frame]:
        for _ in range(120):
            sizes.append(path.stat().st_size)
            frame = random.integers(0, 255, (90, 160, 4), np.uint8)
            drawn.append(weakref.ref(frame))
            assert sum(one() is not None for one in drawn) < 5
            yield frame

    path.touch()
    if suffix == ".mp4":
        films.write_mp4(path, frames(), 25.0)
    else:
        films.write_gif(
            path, films.timed(frames(), 25.0), [random.integers(0, 255, (90, 160, 4), np.uint8)]
        )
    assert sizes[-1] > 0.5 * path.stat().st_size


def test_frames_are_exact_to_a_fraction_of_a_pixel(run: Run) -> None:
    """Without the codec the moving ball's middle is right to half a pixel in every frame."""
    stage = stage_of(Show((run,)))
    gauge: Gauge | None = None
    for k, frame in enumerate(stage.frames()):
        gauge = gauge or Gauge(frame)
        found, _ = centre(frame, "#ff00ff")
        assert np.abs(found - gauge.place(run.at([k / 60])[0][0, 0])).max() <= 0.76, k


def test_last_frame_stays_for_a_second(filmed: Path) -> None:
    frames = frames_of(filmed)
    changes = [np.abs(a.astype(int) - b).max() for a, b in pairwise(frames)]
    assert max(changes[-59:]) < 40  # The encoder still sharpens the picture a little.
    assert max(changes[:10]) > 100


@pytest.mark.parametrize(
    ("settings", "frames", "first"),
    [
        (replace(SMALL, slow=4.0, start=0.1, end=0.3), 48 + 1, 0.1),
        (replace(SMALL, fps=30.0, end=0.51, pause=0.0), 16 + 1, 0.0),
        (replace(SMALL, slow=0.5, fps=25.0, start=0.2, end=1.0, pause=0.2), 10 + 1, 0.2),
    ],
    ids=["slow", "30 fps", "fast"],
)
def test_window_and_pace(
    run: Run, tmp_path: Path, settings: FilmSettings, frames: int, first: float
) -> None:
    path = tmp_path / "a.mp4"
    film(run, path, settings)
    shown = frames_of(path)
    assert len(shown) == frames + round(settings.pause * settings.fps)
    assert facts_of(path)["fps"] == settings.fps
    assert settings.end is not None
    gauge = Gauge(shown[0])
    for frame, t in ((shown[0], first), (shown[-1], settings.end)):
        found, _ = centre(frame, "#ff00ff")
        assert np.abs(found - gauge.place(run.at([t])[0][0, 0])).max() < 1.0


@pytest.mark.slow
def test_join_and_film_of_several_shots(filmed: Path, run: Run, tmp_path: Path) -> None:
    single = len(frames_of(filmed))
    join([filmed, filmed], tmp_path / "it's joined.mp4")
    film([run, run], tmp_path / "several.mp4", SMALL)
    for path in (tmp_path / "it's joined.mp4", tmp_path / "several.mp4"):
        frames = frames_of(path)
        assert len(frames) == 2 * single
        assert facts_of(path)["duration"] == pytest.approx(2 * single / 60, abs=0.05)
        again = frames[0].astype(int) - frames[single]
        assert np.abs(again).max() < 40
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("shots", [1, 2])
def test_gif(run: Run, tmp_path: Path, shots: int) -> None:
    path = tmp_path / "a.gif"
    settings = FilmSettings(size=(400, 226), fps=25.0, end=0.2, pause=0.2)
    film([run] * shots, path, settings)
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.size, gif.info["loop"]) == (shots * (6 + 5), (400, 226), 0)  # type: ignore[attr-defined]
        for k in (0, 5):
            gif.seek(k)
            frame = np.asarray(gif.convert("RGB"))
            found, _ = centre(frame, "#ff00ff")
            place = Gauge(frame).place(run.at([k / 25])[0][0, 0])
            assert np.abs(found - place).max() < 1.5
    assert set(delays_of(path)) == {40}


def delays_of(path: Path) -> list[int]:
    """Return how long each frame of a gif is shown (ms)."""
    with Image.open(path) as gif:
        return [frame.info["duration"] for frame in ImageSequence.Iterator(gif)]


def test_joined_gifs_have_all_frames_in_the_colours_of_all(run: Run, tmp_path: Path) -> None:
    settings = FilmSettings(size=(320, 180), fps=30.0, end=0.3, pause=0.2)
    recolored = replace(run.scene.balls[0], color="#ffff00")
    other = replace(run, scene=replace(run.scene, balls=(recolored, *run.scene.balls[1:])))
    gifs = [tmp_path / "one.gif", tmp_path / "other.gif"]
    for shot, path in zip((run, other), gifs, strict=True):
        film(shot, path, settings)
    join(gifs, tmp_path / "joined.gif")
    apart = [frame for path in gifs for frame in frames_of(path)]
    joined = frames_of(tmp_path / "joined.gif")
    assert len(joined) == len(apart) == 2 * (frame_count(run, settings) + settings.held)
    for one, again in zip(apart, joined, strict=True):
        assert np.abs(one.astype(int) - again).mean() < 1.0
    delays = [delays_of(path) for path in (*gifs, tmp_path / "joined.gif")]
    assert delays[2] == delays[0] + delays[1]
    assert set(delays[2]) == {30, 40}


@takes_long
@pytest.mark.slow
def test_memory_does_not_grow_with_the_film(run: Run) -> None:
    def peak(slow: float) -> float:
        settings = FilmSettings(size=(320, 180), slow=slow, end=0.4)
        stage = stage_of(Show((run,)), settings)
        frames = stage.frames()
        for _ in range(20):  # The sprites are drawn at all their fractions of a pixel.
            next(frames)
        tracemalloc.start()
        try:
            count = 0
            for count, _ in enumerate(frames, start=1):
                if count % 25 == 0:
                    gc.collect()  # Only what is kept counts.
            assert count > 20 * slow - 20
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(20.0)  # This fills the caches.
    assert peak(40.0) < 1.2 * peak(4.0) + 100_000


# -- what is drawn -----------------------------------------------------------------------------


def test_overlay_shows_both_runs_and_their_distance(run: Run) -> None:
    other = shoot(velocity="[0.5, -0.5]")
    show = Show((run, other))
    frames = list(stage_of(show).frames())
    assert len(frames) == frame_count(run, SMALL)
    plot = rows_of(film_layout(show, SMALL.size).plot)
    shown = [int((frame[plot] != frames[0][plot]).any(axis=-1).sum()) for frame in frames]
    assert shown[20] < shown[60] < shown[-1]
    gauge = Gauge(frames[0])
    x, y = gauge.place(np.array(other.end.position[0]))
    ghost = frames[-1][360 - round(y) - 3 : 360 - round(y) + 4, round(x) - 3 : round(x) + 4]
    cloth = frames[0][360 - round(y) - 3 : 360 - round(y) + 4, round(x) - 3 : round(x) + 4]
    assert np.abs(ghost.astype(int) - cloth).mean() > 20


def test_side_by_side_shows_the_runs_apart(run: Run) -> None:
    show = Show((run, shoot(velocity="[0.5, -0.5]")), side_by_side=True)
    *_, last = stage_of(show).frames()
    # These are the tables only, because the curves have the balls' colours.
    last = last[: rows_of(film_layout(show, SMALL.size).plot).start - 20]  # The key is higher.
    for one, left, right in ((show.runs[0], 0, 320), (show.runs[1], 320, 640)):
        found, _ = centre(last, "#ff00ff", left, right)
        place = Gauge(last, left, right).place(np.array(one.end.position[0]))
        assert np.abs(found - place).max() < 1.0


def test_tracks_show_where_balls_came_from(run: Run) -> None:
    stage = stage_of(Show((run,)), replace(SMALL, fps=20.0))
    bare = np.array(stage.ground.picture)[..., :3]
    first, *_, last = stage.frames()
    gauge = Gauge(first)
    for t in np.linspace(0.0, 0.7 * run.duration, 12):
        x, y = gauge.place(run.at([t])[0][0, 0])
        row, column = 360 - round(y), round(x)
        change = last[row, column].astype(int) - bare[row, column]
        assert change[0] > 30 and change[1] < -10, t  # It is a little magenta, and cloth.
    x, y = gauge.place(np.array([1.0, 0.15]))  # Nobody came by here.
    assert (last[360 - round(y), round(x)] == first[360 - round(y), round(x)]).all()


def test_tracks_are_as_new_where_balls_were_last() -> None:
    path = np.array([[20.0, 20.0], [80.0, 20.0], [20.0, 20.0]])
    ball = DrawnBall(0.0, 0.0, 10.0, "#ff00ff", "1", 7.0)
    old = tracks([path], [ball], "#000000", solid=True)
    red = np.array(old.get_colors())[len(old.get_segments()) // 2 :, 0]  # those of halos come first
    assert red[0] == pytest.approx(LOOK.oldest, abs=0.02)
    assert red[-1] == pytest.approx(1.0, abs=0.02)
    assert (np.diff(red) > -1e-9).all()


def test_the_track_of_a_struck_ball_is_as_wide_as_others() -> None:
    """What is drawn otherwise would need a word."""
    show = Show((simulate(load("report"), 1, solver="event-driven"),))
    widths = np.array(tracks_of(show).get_linewidths())
    assert len({*widths.tolist()}) == 3  # those of tracks, of their halos, and on other tracks
    wide = {track.lines[-1].width for track in stage_of(show).casts[0].tracks.values()}
    assert len(wide) == 1


def pixels_of(ground: Ground) -> Frame:
    return np.array(ground.picture)


def there_and_back() -> tuple[Ground, Track]:
    """Return a black ground, and a white track of two seconds."""
    ground = Ground(np.asarray(Image.new("RGBA", (100, 40), "#000")))
    return ground, Track(CORNERS, (100, 40), 7.0, "#ffffff", "#00ff00")


def test_track_that_comes_back_on_itself_is_drawn_once() -> None:
    ground, track = there_and_back()
    for t in np.linspace(0.0, 1.0, 40):
        track.follow(ground, t, (20.0 + 60.0 * t, 20.0))
    once = pixels_of(ground)
    for t in np.linspace(1.0, 2.0, 40):
        track.follow(ground, t, (80.0 - 60.0 * (t - 1.0), 20.0))
    whole = once[19, 24:80].astype(int)
    assert whole.min() > 115 and np.ptp(whole, axis=0).max() <= 3  # It has no seams.
    assert np.abs(pixels_of(ground).astype(int) - once).max() <= 3


def test_tracks_in_films_are_uncovered_by_their_balls() -> None:
    ground, track = there_and_back()
    track.follow(ground, 0.5, (50.0, 20.0))
    assert pixels_of(ground)[19, 24:48, 0].min() > 100
    assert not pixels_of(ground)[:, 60:, :3].any()
    track.follow(ground, 1.0, (80.0, 20.0))
    assert pixels_of(ground)[19, 24:78, 0].min() > 100
    assert (pixels_of(ground)[..., 3] == 255).all()


def test_the_tracks_of_ghosts_lie_under_those_of_solid_balls() -> None:
    """Also where the ghost comes by later."""
    ground, track = there_and_back()
    track.follow(ground, 1.0, (80.0, 20.0))
    solid = pixels_of(ground)
    ghost = Track(CORNERS + np.array([0.0, 0.0, 0.5]), (100, 40), 4.0, "#ff0000")
    ghost.follow(ground, 1.0, (80.0, 20.0))
    assert np.abs(pixels_of(ground).astype(int) - solid)[:, 24:76].max() <= 40
    beside = Track(CORNERS + np.array([0.0, 0.0, 12.0]), (100, 40), 4.0, "#ff0000")
    beside.follow(ground, 1.0, (80.0, 20.0))
    assert pixels_of(ground)[8, 50, 0] > 100


def test_a_track_along_another_one_leaves_both_seen() -> None:
    ground, track = there_and_back()
    track.follow(ground, 1.0, (80.0, 20.0))
    later = Track(CORNERS, (100, 40), 7.0, "#ff0000", "#0000ff")
    later.follow(ground, 1.0, (80.0, 20.0))
    across = pixels_of(ground)[10:30, 50, :3].astype(int)
    redder = across[:, 0] - across[:, 1]
    seen = across[:, 1] > 80  # green, which the later track has not
    assert redder.max() > 40  # the later one in the middle
    assert seen[: redder.argmax()].any() and seen[redder.argmax() :].any()  # the earlier one beside


def test_tracks_in_films_are_uncovered_without_gaps() -> None:
    rng = np.random.default_rng(1)
    for a, b in rng.uniform((20.0, 20.0), (780.0, 430.0), (20, 2, 2)):
        ground = Ground(np.asarray(Image.new("RGBA", (800, 450), "#000")))
        track = Track(np.array([[0.0, *a], [1.0, *b]]), (800, 450), 2.0, "#000000", "#ffffff")
        for t in np.linspace(0.0, 1.0, 20)[1:].tolist():
            track.follow(ground, t, tuple((a + (b - a) * t).tolist()))
        assert max(np.asarray(line.hidden).max() for line in track.lines) == 0


def test_a_film_begins_with_the_arrow_of_the_shot(run: Run) -> None:
    settings = replace(SMALL, end=0.7)
    stage = stage_of(Show((run,)), settings)
    first = next(stage.frames())
    x, y = Gauge(first).place(np.array([0.5, 0.5]) + 0.1 * np.array([1.0, 0.35 / 1.8]))
    row, column = 360 - round(float(y)), round(float(x))
    assert first[row - 1 : row + 2, column].max(axis=0).min() > 170  # It is white.
    (arrows,) = stage.arrows
    cloth = canvas.Frame(np.full((360, 640, 4), 90, np.uint8))
    arrows(cloth, LOOK.shot)
    assert (cloth.pixels == 90).all()
    later = replace(settings, start=0.1)
    assert not stage_of(Show((run,)), later).arrows


def test_flashes_at_cushions_are_smaller(run: Run) -> None:
    contacts = [event for event in run.events if event.is_contact]
    for event, (row, _, size) in zip(contacts, contact_places(run), strict=True):
        assert row.t == event.t
        assert size == pytest.approx(0.06 if event.kind == "ball-ball" else 0.03)


def test_flash_lights_the_contact_and_hides_no_ball(run: Run) -> None:
    contact = next(event for event in run.events if event.kind == "ball-cushion")
    settings = replace(SMALL, start=contact.t - 0.02, end=contact.t + 1.0)
    stage = stage_of(Show((run,)), settings)
    before, *after = list(stage.frames())
    found, radius = centre(after[3], "#ff00ff")
    x, y = Gauge(before).place(run.at([contact.t])[0][0, 0])
    nose = np.array([x + radius + 3, y])
    row, column = 360 - round(float(nose[1])), round(float(nose[0]))
    dark, lit = (int(f[row, column].astype(int).sum()) for f in (before, after[3]))
    assert lit > dark + 100
    assert abs(int(after[-1][row, column].astype(int).sum()) - dark) < 30
    spot = after[3][360 - round(float(found[1])), round(float(found[0] + 0.4 * radius))]
    assert spot.min() > 235


def disc_sprite() -> Sprite:
    """Draw a white disc with a radius of two and a half pixels."""
    side = 32
    distance = np.hypot(*(np.indices((side, side)) + 0.5 - side / 2))
    return Sprite(np.repeat(((distance < 10.0) * 255).astype(np.uint8)[..., None], 4, axis=-1))


def test_sprite_is_put_at_quarters_of_a_pixel() -> None:
    sprite = disc_sprite()
    rows, columns = np.indices((30, 40)) + 0.5
    for x, y in ((20.0, 15.0), (20.25, 14.5), (19.6, 15.9)):
        frame = canvas.Frame(np.zeros((30, 40, 4), np.uint8))
        sprite.stamp(frame, x, y)
        light = frame.pixels[..., 0].astype(float)
        assert (light * columns).sum() / light.sum() == pytest.approx(x, abs=0.13)
        assert 30 - (light * rows).sum() / light.sum() == pytest.approx(y, abs=0.13)


@pytest.mark.parametrize("place", [(-50.0, 15.0), (1.0, 1.0), (39.0, 31.0), (20.0, -1.5)])
def test_sprite_at_an_edge_is_cut_off_there(place: tuple[float, float]) -> None:
    """A sprite that is partly or wholly off a frame looks as it does in a larger frame."""
    (x, y), sprite = place, disc_sprite()
    small, large = (canvas.Frame(np.zeros((k, 2 * k, 4), np.uint8)) for k in (30, 90))
    sprite.stamp(small, x, y)
    sprite.stamp(large, x + 60.0, y + 30.0)
    assert small.pixels.any() == (x > 0.0)
    assert (small.pixels == large.pixels[30:60, 60:120]).all()


def test_default_colors_differ_for_every_eye() -> None:
    """Balls without a colour get one of their own, which deuteranopes can tell apart, too."""
    balls = tuple(Ball(str(k), (float(k), 0.0), 0.1, 1.0, cue=k == 0) for k in range(16))
    scene = Scene(balls, restitution=load("report").restitution)
    colors = style.ball_colors(scene)
    assert colors[0] == "#ffffff"
    assert len(set(colors)) == 16
    rgb = np.array([[int(c[k : k + 2], 16) / 255 for k in (1, 3, 5)] for c in colors[:9]])
    # Machado, Oliveira and Fernandes (2009) give this matrix for deuteranopia.
    deuteranope = np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.01182, 0.04294, 0.968881],
        ]
    )
    seen = rgb**2.2 @ deuteranope.T
    gaps = np.linalg.norm(seen[:, None] - seen[None], axis=-1) + 10.0 * np.eye(9)
    assert gaps.min() > 0.1


def test_words() -> None:
    run = shoot()
    assert settings((run,)) == ["event-driven"]
    pymunk = replace(run, solver="pymunk", dt=1 / 240)
    assert Show((pymunk,)).caption("end").split("  \N{MIDDLE DOT}  ") == [
        "Three balls", "Shot 1", "pymunk, dt = 1/240 s", "end",
    ]  # fmt: skip
    published = replace(pymunk, law="published")
    assert settings((run, published)) == [
        "event-driven, coulomb law", "pymunk, dt = 1/240 s, published law",
    ]  # fmt: skip


# -- pictures ----------------------------------------------------------------------------------


@pytest.fixture
def no_tracks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave tracks and rings out of pictures, because they have the balls' colours."""
    none = LineCollection([])
    monkeypatch.setattr("pool_pymunk.render.balls.tracks", lambda *_, **__: none)
    monkeypatch.setattr("pool_pymunk.render.balls.draw_rings", lambda *_: None)


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("when", ["start", "end"])
def test_picture_has_the_balls_in_place(
    table: str, when: Any, tmp_path: Path, no_tracks: None
) -> None:
    run = shoot(table)
    picture(run, tmp_path / "a.png", when=when, dpi=72)
    image = read_image(tmp_path / "a.png")
    gauge = Gauge(image)
    place = gauge.place(run.at([0.0 if when == "start" else run.duration])[0][0, 0])
    found, radius = centre(image, "#ff00ff")
    assert np.abs(found - place).max() < 1.0
    assert 0.88 < radius / (0.06 * gauge.scale) <= 1.0  # This is all except the outline.
    x, y = gauge.place(np.array([1.0, 0.9]))
    red, green, blue = map(int, image[len(image) - round(y), round(x)])
    assert green > 1.3 * max(red, blue)  # This is cloth.


def test_picture_is_as_fine_as_asked(run: Run, tmp_path: Path) -> None:
    for dpi, width in ((100, 1000), (300, 3000)):
        picture(run, tmp_path / "a.png", dpi=dpi)
        assert read_image(tmp_path / "a.png").shape[1] == width


@pytest.mark.parametrize(("suffix", "head"), [(".svg", b"<?xml"), (".pdf", b"%PDF")])
def test_pictures_to_print(run: Run, tmp_path: Path, suffix: str, head: bytes) -> None:
    for what in (run, Show((run, shoot(velocity="[0.5, -0.5]")))):
        path = tmp_path / f"a{suffix}"
        picture(what, path, when="end")
        assert path.read_bytes().startswith(head)


def test_picture_of_a_scene_and_of_an_open_plane(tmp_path: Path, no_tracks: None) -> None:
    picture(load("two-balls"), tmp_path / "scene.png", dpi=50)
    run = simulate(load("two-balls"), solver="event-driven")
    picture(run, tmp_path / "end.png", when="end", dpi=72)
    image = read_image(tmp_path / "end.png")
    found, radius = centre(image, "#d55e00")
    assert 3 * radius < found[0] < image.shape[1] - 2 * radius  # The whole path is in the picture.
    assert 3 * radius < found[1] < image.shape[0] - 2 * radius
    assert read_image(tmp_path / "scene.png").shape[1] <= 500


def test_tracks_in_pictures_fade_towards_rings_where_balls_started(run: Run) -> None:
    image = drawn(figure_of(run, "end"))
    bare = drawn(figure_of(run, "start"))
    gauge = Gauge(bare)

    def at(x: float, y: float, picture: Frame = image) -> NDArray[np.int_]:
        column, row = np.round(gauge.place(np.array([x, y]))).astype(int)
        return np.asarray(picture[len(picture) - row, column].astype(int))

    places = [run.at([share * run.duration])[0][0, 0] for share in (0.02, 0.25)]
    cloth = at(1.0, 0.9)
    old, new = (np.abs(at(*place) - cloth).sum() for place in places)
    assert 60 < old < new
    x, y = run.scene.balls[0].position
    ring = at(x - 0.055, y)  # It is thin and around what was the ball.
    assert ring[0] > cloth[0] + 60 and ring[2] > cloth[2] + 60
    assert np.abs(at(x - 0.04, y) - cloth).max() < 30


def drawn(figure: Figure) -> Frame:
    """Return a figure's pixels at 144 a inch."""
    return pixels(figure, 2.0)[..., :3]


def test_many_balls_have_thinner_tracks_and_every_color_a_halo() -> None:
    assert track_width(2) == track_width(8) > track_width(9) > track_width(30) > 0.0
    for color in ("#ffffff", "#ffff00"):
        assert halo_color(color) == "#000000"
    for color in ("#d6202f", "#7f1d26", "#000080", "#000000"):
        assert halo_color(color) == "#ffffff"


def lab(color: Array) -> Array:
    """Return CIELAB's coordinates (white D65) of red, green and blue in [0, 1]."""
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    share = (to_xyz @ linear) / (0.9505, 1.0, 1.089)
    f = np.where(share > 0.008856, np.cbrt(share), 7.787 * share + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


CLOTHS = ("#1f7d53", "#e2b779", "#d9b382", "#c9d3d2", "#4b5860", "#1f5d9b", "#a01c28", "#222222",
          "#ffffff", "#5b3a24", "#808080")  # fmt: skip
SHOWN, CLEAR = 15.0, 24.0  # in CIELAB, where a difference of 2.3 is just noticed


CORNERS = np.array([[0.0, 20.0, 20.0], [1.0, 80.0, 20.0], [2.0, 20.0, 20.0]])  # there and back


@pytest.mark.parametrize("cloth", CLOTHS)
def test_every_track_is_seen_on_every_cloth(cloth: str) -> None:
    """The track or its halo differs from the cloth, and both from each other, old or new."""
    scenes = [load(name) for name in ("report", "nine-ball", "carrom", "crokinole")]
    colors = {*style.PALETTE, *POOL, *(color for scene in scenes for color in ball_colors(scene))}
    ground = np.array(to_rgb(cloth))
    path = np.array([[20.0, 20.0], [80.0, 20.0]])
    for color in sorted(colors):
        lines = np.array(
            tracks([path], [DrawnBall(0, 0, 10.0, color, "", 7.0)], cloth, solid=True).get_colors()
        )[:, :3]
        halos, cores = np.split(lines, 2)
        film = Ground(np.asarray(Image.new("RGBA", (100, 40), cloth)))
        track = Track(CORNERS, (100, 40), 7.0, color, halo_color(color))
        track.follow(film, 1.0, (80.0, 20.0))
        column = pixels_of(film)[:, 50, :3] / 255.0
        farthest = max(np.linalg.norm(lab(pixel) - lab(ground)) for pixel in column)
        assert farthest > SHOWN, (color, "in a film")
        for core, edge in zip(cores, halos, strict=True):
            apart = (np.linalg.norm(lab(each) - lab(ground)) for each in (core, edge))
            assert max(apart) > CLEAR, color
            assert np.linalg.norm(lab(core) - lab(edge)) > CLEAR, color


def test_the_caption_of_an_end_says_how_long_it_took(run: Run) -> None:
    words = [text.get_text() for text in figure_of(run, "end").axes[0].texts]
    assert any(text.endswith(f"end after {run.duration:.2f} s") for text in words)


@pytest.mark.parametrize(
    ("unit", "words", "metres"), [("in", "5 in", 0.127), ("mm", "100 mm", 0.1)]
)
def test_an_open_plane_has_a_scale_bar_in_its_units(unit: str, words: str, metres: float) -> None:
    scene = load("two-balls")
    run = simulate(replace(scene, units=replace(scene.units, length=unit)), solver="event-driven")
    axes = figure_of(run, "end").axes[0]
    (text,) = [text for text in axes.texts if text.get_text() == words]
    lines = [part for part in axes.collections if isinstance(part, LineCollection)]
    (bar,) = [part.get_segments()[0] for part in lines if len(part.get_segments()[0]) == 4]
    show = Show((run,))
    scale = fit(show.seen, picture_layout(show).rooms[0], 1.0).scale
    assert bar[2][0] - bar[1][0] == pytest.approx(metres * scale)
    assert bar[1][0] < text.get_position()[0] < bar[2][0]


def test_a_label_beside_a_ball_lies_on_no_other_ball() -> None:
    ball = DrawnBall(50.0, 50.0, 6.0, "#ff00ff", "a long name", 7.0)
    others = [ball._replace(label="1", x=x, y=y) for x, y in ((70, 60), (70, 40))]

    def corner(discs: list[DrawnBall]) -> list[float]:
        labels = Labels(discs)
        labels.place(np.array([(disc.x, disc.y) for disc in discs]))
        return list(map(float, labels.corners[0]))

    assert corner([ball]) == [1, 1]
    assert corner([ball, others[0]]) == [1, -1]
    assert corner([ball, *others]) == [-1, 1]


def tracks_of(show: Show) -> Any:
    """Return the lines of the tracks in a picture of the end."""
    lines = figure_of(show, "end").axes[0].collections
    return next(part for part in lines if part.get_zorder() == 1.5)


def test_tracks_of_ghosts_are_thin_and_pale_and_have_no_halos(run: Run) -> None:
    alone, ghosts = tracks_of(Show((run,))), tracks_of(Show((shoot(velocity="[0.0, 0.5]"), run)))
    assert 2 * len(ghosts.get_segments()) == len(alone.get_segments())  # These are drawn first.
    assert max(ghosts.get_linewidths()) < min(alone.get_linewidths())
    assert ghosts.get_colors()[-1][0] < 0.8 * alone.get_colors()[-1][0]  # They are magenta.


def test_an_overlay_has_a_key(run: Run) -> None:
    assert key_of(Show((run, shoot(velocity="[0.5, -0.5]")))) is not None
    small = simulate(sliding("eight-ball"), "Break", solver="event-driven")
    other = simulate(sliding("eight-ball"), "Break", solver="pymunk-discrete", dt=1 / 240)
    key = key_of(Show((small, other)))
    assert key is not None
    assert {"cue", "1", "15"} <= {text.get_text() for text in key.get_texts()}


def key_of(show: Show) -> Any:
    return figure_of(show, "end").axes[1].get_legend()


def curves_of(names: tuple[str, ...], color: str | None = None) -> list[tuple[str, Any]]:
    """Return what a plot of distances says of balls with these names, and how it draws them."""
    scene = sliding("eight-ball")
    pockets = () if color else scene.pockets
    places = [(0.4 + 0.1 * k, 0.3) for k in range(len(names))]
    balls = [Ball(n, p, 0.02, 0.1, color=color) for n, p in zip(names, places, strict=True)]
    moved = [replace(b, velocity=(0.0, 0.1)) for b in balls]
    scenes = (
        replace(scene, balls=tuple(each), pockets=pockets, shots=()) for each in (balls, moved)
    )
    show = Show(tuple(simulate(one, solver="event-driven", max_time=0.1) for one in scenes))
    axes = figure_of(show, "end").axes[1]
    drawn: Any = axes.lines  # The dashes have no public name.
    looks = {line.get_label(): (line.get_color(), line._dash_pattern) for line in drawn}
    return [(text.get_text(), looks[text.get_text()]) for text in key_of(show).get_texts()]


@pytest.mark.parametrize("color", [None, "#123456"])
def test_curves_of_balls_of_one_colour_differ(color: str | None) -> None:
    """1 and 9 are yellow, 5 and 13 orange: stripes have dashes, whichever comes first."""
    curves = curves_of(("13", "1", "5", "9"), color)
    assert len({str(look) for _, look in curves}) == 4
    broken = {name for name, (_, (_, dashes)) in curves if dashes}
    assert broken == ({"9", "13"} if color is None else {"1", "5", "9"})


def test_a_key_has_the_balls_in_their_order() -> None:
    names = ("10", "cue", "9", "2", "black")
    assert [name for name, _ in curves_of(names)] == ["cue", "black", "2", "9", "10"]


def test_a_number_has_one_colour_wherever_its_ball_stands() -> None:
    """So a ball of a file looks like that of a scene in Python; what is called cue is white."""
    names = ("red", "3", "1", "2", "cue")
    balls = [Ball(name, (0.1 * k, 0.0), 0.02, 0.1) for k, name in enumerate(names)]
    for some in (balls, balls[::-1], balls[1:3]):
        scene = Scene(tuple(some), restitution=load("report").restitution)
        its = dict(zip(scene.index, ball_colors(scene), strict=True))
        assert (its["1"], its["3"]) == (style.PALETTE[0], style.PALETTE[2])
        assert its.get("cue", "#ffffff") == "#ffffff"
        assert len({*its.values()}) == len(some)
    for name in ("hexagon", "l-shaped"):
        assert ball_colors(load(name))[1:4] == style.PALETTE[:3]


def words_on(scene: Scene) -> list[str]:
    return [text.get_text() for text in figure_of(scene).axes[0].texts]


def test_a_picture_names_cushions_and_posts_and_has_a_scale() -> None:
    assert words_on(load("stadium"))[:6] == ["0", "1", "2", "3", "4", "0.2 m"]
    assert "10 in" in words_on(load("report"))


# -- trouble -----------------------------------------------------------------------------------


POCKETS = text_of("pocketed")


def test_a_ball_drops_into_a_pocket_and_is_listed_beside_the_table() -> None:
    run = simulate(loads(POCKETS), solver="event-driven")
    times = SMALL.times(Show((run,)))
    (falls,) = [event.t for event in run.events if event.pocket]
    assert times[-1] == pytest.approx(falls + LOOK.drop)
    frames = list(stage_of(Show((run,))).frames())
    seen = [np.flatnonzero(has(frame, "#ff00ff").any(axis=1)) for frame in frames]
    last = round(falls * 60)
    assert seen[0].mean() > seen[last - 1].mean() > 0  # It goes up, and rows count downwards.
    assert all(rows.size for rows in seen[:last])
    middle = frames[last + round(LOOK.drop * 54)]
    assert not has(middle[: len(middle) // 2], "#ff00ff").any()  # It has faded.
    assert seen[-1].min() > 0.8 * len(frames[-1])  # It lies below the table.


def test_nothing_says_pocketed_before_a_ball_is() -> None:
    run = simulate(loads(POCKETS), solver="event-driven")
    show = Show((run,))
    first, *_, last = stage_of(show).frames()
    words = rows_of(film_layout(show, SMALL.size).tray)
    page = np.array([int(SMALL.style.page[k : k + 2], 16) for k in (1, 3, 5)])
    assert first[words].size and (first[words] == page).all()
    assert not (last[words] == page).all()


@pytest.mark.parametrize("across", [0.0, 1.0])
def test_tracks_of_what_falls_are_smooth_and_as_high_as_it_rises(across: float) -> None:
    ball = Ball("a", (0.5, 0.1), 0.03, 0.2, velocity=(across, 4.0))
    table = Table.rectangle(2.0, 2.0, tilt=(0.0, -9.8))
    scene = Scene((ball,), table, Restitution(cushion=0.8), physics=Physics(max_time=0.8))
    run = simulate(scene, solver="event-driven")
    t, x, y = track_of(run, 0).T
    assert y.max() == pytest.approx(0.1 + 4.0**2 / (2.0 * 9.8), abs=1e-3)
    middles = run.at((t[1:] + t[:-1]) / 2.0)[0][:, 0]
    chords = np.column_stack((x[1:] + x[:-1], y[1:] + y[:-1])) / 2.0
    assert np.hypot(*(middles - chords).T).max() < 1e-3


def test_tracks_lie_along_flat_curves() -> None:
    """A slight turn over a long distance needs several lines, too."""
    ball = Ball("a", (0.2, 0.1), 0.03, 0.2, velocity=(3.0, 0.0))
    table = Table.rectangle(3.0, 2.0, tilt=(0.0, 0.15))
    scene = Scene((ball,), table, Restitution(cushion=0.8), physics=Physics(max_time=0.8))
    run = simulate(scene, solver="event-driven")
    t, *places = track_of(run, 0).T
    middles = run.at((t[1:] + t[:-1]) / 2.0)[0][:, 0]
    chords = np.column_stack([(one[1:] + one[:-1]) / 2.0 for one in places])
    assert np.hypot(*(middles - chords).T).max() < 0.011 * ball.radius


def test_the_rim_of_a_ghost_is_seen_on_a_ball(run: Run) -> None:
    near = shoot(velocity="[0.99, 0.0]"), shoot(velocity="[1.0, 0.0]")
    figures = [drawn(figure_of(Show(each), "end")) for each in (near, near[:1] * 2)]
    assert (np.abs(figures[0].astype(int) - figures[1]).max(axis=2) > 100).sum() > 100
    end = replace(SMALL, start=max(run.duration for run in near))
    film = [next(stage_of(Show(each), end).frames()) for each in (near, near[:1])]
    gauge = Gauge(film[0])
    x, y = gauge.place(np.array(near[1].end.position[0]))
    rows, columns = (
        slice(360 - round(y) - 4, 360 - round(y) + 5),
        slice(round(x) - 12, round(x) + 13),
    )
    change = np.abs(film[0][rows, columns].astype(int) - film[1][rows, columns])
    assert change[..., :3].max() > 40


def test_tracks_end_at_the_rim_of_a_pocket(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = loads(POCKETS.replace("velocity = [0.0, 1.0]", "velocity = [0.08, 1.0]"))
    run = simulate(scene, solver="event-driven")
    assert run.pocketed == {"12": "side"}
    (x, y), hole = track_of(run, 0)[-1, 1:3], run.scene.pockets[0]
    assert np.hypot(x - hole.position[0], y - hole.position[1]) == pytest.approx(hole.radius)
    drawn: list[Any] = []

    def keep(paths: Any, *_: Any, **__: Any) -> LineCollection:
        drawn.append(paths)
        return LineCollection([])

    monkeypatch.setattr("pool_pymunk.render.balls.tracks", keep)
    figure_of(run, "end")
    view = fit(Show((run,)).seen, picture_layout(Show((run,)), tray=True).rooms[0], 1.0)
    assert drawn[0][0][-1] == pytest.approx(view.place((x, y)))
    stage = stage_of(Show((run,)), replace(SMALL, fps=10.0))
    *_, _last = stage.frames()
    (cast,) = stage.casts
    assert cast.tracks[0].end == pytest.approx(cast.view.place((x, y)))


def test_a_label_beside_a_ball_in_a_film_makes_room_for_balls_that_come() -> None:
    run = shoot(velocity="[1.8, 0.35]")
    name = replace(run.scene.balls[0], id="a long name")
    scene = replace(
        run.scene,
        balls=(name, *run.scene.balls[1:]),
        shots=(replace(run.scene.shots[0], ball=name.id),),
    )
    run = simulate(scene, solver="event-driven")
    (cast,) = stage_of(Show((run,))).casts
    assert [ball.label for ball in cast.labels.balls] == ["a long name"]
    alone = np.array([[100.0, 100.0], [900.0, 100.0], [900.0, 200.0]])
    above = cast.labels.place(alone)[0]
    assert (above > alone[0]).all()
    covered = np.array([alone[0], above, alone[2]])
    below = cast.labels.place(covered)[0]
    assert np.abs(below - above).max() > 10.0
    assert (cast.labels.place(alone)[0] == below).all()  # It stays there.


def test_pictures_list_the_balls_that_are_off_the_table(tmp_path: Path, no_tracks: None) -> None:
    run = simulate(loads(POCKETS), solver="event-driven")
    heights = {}
    for when in ("start", "end"):
        path = tmp_path / f"{when}.png"
        run.plot(when, path, dpi=100)
        image = read_image(path)
        heights[when] = np.flatnonzero(has(image, "#ff00ff").any(axis=1)) / len(image)
    assert heights["start"].max() < 0.8 < heights["end"].min()


def test_balls_9_to_15_have_stripes_where_there_are_pockets() -> None:
    scene = loads(POCKETS.replace("color", "#color"))
    assert striped(scene) == (True, True)
    assert ball_colors(scene) == (POOL[3], POOL[0])
    assert striped(replace(scene, pockets=())) == (False, False)


def test_a_table_has_the_colour_of_its_own(run: Run, tmp_path: Path) -> None:
    assert run.scene.table is not None
    wood = replace(run.scene.table, color="#e2b779")
    made = PRINT.on(wood)
    assert PRINT.on(run.scene.table) is PRINT
    assert (made.cloth, made.arrow, made.rail) == ("#e2b779", "#000000", PRINT.rail)
    assert PRINT.on(replace(wood, color="#123456")).arrow == "#ffffff"
    assert sum(to_rgb(made.nose)) < sum(to_rgb(made.cushion)) < sum(to_rgb(made.cloth))
    assert woodwork(run.scene.table, ()).sights and not woodwork(wood, ()).sights  # It is a board.
    scene = replace(run.scene, table=wood)
    picture(scene, tmp_path / "wood.png", dpi=50)
    image = read_image(tmp_path / "wood.png")
    assert has(image, "#e2b779").mean() > 0.2
    frame = next(iter(stage_of(Show((replace(run, scene=scene),))).frames()))
    assert has(frame, "#e2b779").mean() > 0.1


def test_files_that_cannot_be_are_named(run: Run, tmp_path: Path) -> None:
    """What else cannot be stands in data/refusals.txt."""
    (tmp_path / "file").write_text("not a folder")
    for part, suffix, words in (
        ("none.mp4", "mp4", "none.mp4: No such file"),
        ("none.gif", "gif", "none.gif: No such file"),
        ("file", "mp4", "file: Invalid data found"),
    ):
        with pytest.raises(RenderError, match=words) as caught:
            join([tmp_path / part], tmp_path / f"b.{suffix}")
        assert "\n" not in str(caught.value)
    for suffix, make_in in ((".mp4", film), (".png", picture)):
        with pytest.raises(OSError, match="/file'"):
            make_in(run, tmp_path / "file" / f"a{suffix}")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_no_codec_or_a_full_disk(
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(films, "CODEC", "no-such-codec")
        with pytest.raises(RenderError, match=r"a\.mp4: ffmpeg: there is no codec no-such-codec$"):
            film(run, tmp_path / "a.mp4", SMALL)
    for form in ("mp4", "gif"):
        (full := tmp_path / f"full.{form}").symlink_to("/dev/full")
        with pytest.raises(OSError, match="No space left on device") as caught:
            film(run, full, replace(SMALL, fps=50.0))
        assert caught.value.filename == str(full)
        full.unlink()
    del caught
    gc.collect()  # What is said when an unfinished film is deleted would be heard here.
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("shots", [1, 2])
@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_interruption_leaves_nothing(run: Run, tmp_path: Path, suffix: str, shots: int) -> None:
    drawn = 0

    def interrupt(frames: int) -> None:
        nonlocal drawn
        drawn += frames
        if drawn == 9 * shots - 3:
            raise KeyboardInterrupt

    path = tmp_path / f"a{suffix}"
    path.write_text("the film before")
    with pytest.raises(KeyboardInterrupt):
        settings = FilmSettings(size=(320, 180), fps=25.0, end=0.3)
        film([run] * shots, path, settings, interrupt)
    assert path.read_text() == "the film before"
    assert list(tmp_path.iterdir()) == [path]


def test_matplotlib_is_imported_late_and_without_pyplot() -> None:
    code = (
        "import sys, pool_pymunk, pool_pymunk.cli;"
        "assert 'matplotlib' not in sys.modules, 'too early';"
        "import pool_pymunk.render;"
        "assert 'matplotlib.pyplot' not in sys.modules, 'pyplot'"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_mouth_of_a_pocket_fills_no_rail_with_sights() -> None:
    mouth = (0.95, 0.0), (0.96, -0.06), (1.04, -0.06), (1.05, 0.0)
    table = Table(((0.0, 0.0), *mouth, (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)))
    assert 10 < len([*sights(table, ())]) < 30
    scene = Scene((Ball("a", (1.0, 0.5), 0.03, 0.1),), table, Restitution(1.0, cushion=1.0))
    assert not {"1", "3"} & {number for _, _, number in numbers(scene)}


def test_numbers_that_are_none_are_left_out(run: Run, tmp_path: Path) -> None:
    """A run that left the range of floating point is drawn as far as it went."""
    breakpoints = run.knots[1].copy()
    breakpoints[-1, 1:] = np.nan
    broken = replace(run, knots=(run.knots[0], breakpoints, *run.knots[2:]))
    short = replace(SMALL, fps=20.0, end=0.1, pause=0.0)
    for what, seen in ((run, True), (broken, False)):
        picture(what, tmp_path / "a.png", when="end", dpi=40)
        film(what, tmp_path / "a.mp4", short)
        for image in (read_image(tmp_path / "a.png"), frames_of(tmp_path / "a.mp4")[0]):
            assert has(image, "#ff00ff").any()
            assert has(image, "#00ffff").any() == seen
    picture(Show((run, broken)), tmp_path / "a.png", when="end", dpi=40)
    film(Show((run, broken)), tmp_path / "a.mp4", short)
    assert len(frames_of(tmp_path / "a.mp4")) == 2 + 1
    with pytest.raises(RenderError, match="one can be shown, or two"):
        Show((run, run, run))
    with pytest.raises(RenderError, match="different balls"):
        Show((run, simulate(load("two-balls"), solver="event-driven")))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius", "label", "inside"),
    [(0.06, "10", True), (0.06, "a long name", False), (0.006, "10", False)],
)
def test_label_that_cannot_be_read_inside_stands_beside(
    tmp_path: Path, radius: float, label: str, inside: bool
) -> None:
    ball = Ball(label, (0.5, 0.5), radius, 0.2, color="#ff00ff")
    picture(replace(shoot().scene, balls=(ball,), shots=()), tmp_path / "a.png", dpi=288)
    image = read_image(tmp_path / "a.png")
    found, size = centre(image, "#ff00ff")
    row, column = len(image) - round(float(found[1])), round(float(found[0] + size))
    far = column + round(0.25 * size)  # beyond the ball's outline and halo
    beside = image[row - 120 : row, far : far + 160]
    is_cloth = int(beside[..., 0].max()) < 60  # Letters are white.
    assert is_cloth is inside


# -- the command -------------------------------------------------------------------------------


def test_command_writes_films_and_pictures(tmp_path: Path) -> None:
    options = ("--out", tmp_path, "--size", "320x180", "--dpi", "40", "--to", "0.2")
    done = typed("render", "report", *options)
    assert done.returncode == 0, done.stderr
    films = [f"shot-{k}.mp4" for k in (1, 2, 3, 4)] + ["all.mp4"]
    pictures = [f"shot-{k}-{when}.png" for k in (1, 2, 3, 4) for when in ("start", "end")]
    assert [Path(line).name for line in done.stdout.splitlines()] == films + pictures
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(films + pictures)
    counts = [len(frames_of(tmp_path / name)) for name in films]
    assert counts == [73, 73, 73, 73, 4 * 73]


def test_command_compares_two_files(tmp_path: Path) -> None:
    """The headings say what differs, on two tables or of a ghost."""
    text = bundled()["report"].read_text(encoding="utf-8")
    (tmp_path / "soft.toml").write_text(text)
    (tmp_path / "hard.toml").write_text(text.replace("cushion = 0.70", "cushion = 0.90"))
    options = ("--shot", 1, "--no-films", "--picture-format", "svg", "--out", tmp_path)
    soft, hard = tmp_path / "soft.toml", tmp_path / "hard.toml"
    done = typed("render", soft, "--side-by-side", hard, *options)
    assert done.returncode == 0, done.stderr
    drawn = (tmp_path / "shot-1-end-side-by-side.svg").read_text(encoding="utf-8")
    assert "<!-- cushion restitution 0.7 -->" in drawn
    assert "<!-- cushion restitution 0.9 -->" in drawn
    done = typed("render", soft, "--overlay", hard, *options)
    assert done.returncode == 0, done.stderr
    drawn = (tmp_path / "shot-1-end-overlay.svg").read_text(encoding="utf-8")
    assert "cushion restitution 0.7 (ghost: cushion restitution 0.9)" in drawn
    twice = typed("render", soft, hard, "--overlay", "pymunk-discrete", *options)
    assert twice.returncode == 2 and "is compared with already" in twice.stderr
    other = typed("render", soft, "--side-by-side", "hexagon", *options)
    assert other.returncode == 2 and "must have the same" in other.stderr


def test_what_differs_is_said_in_words() -> None:
    soft = load("report")

    def played(**parts: Any) -> Run:
        return simulate(replace(soft, **parts), 1, max_time=0.1)

    one = played()
    assert headings([one]) == headings([one, one])[:1] == ["pymunk, dt = 1/240 s"]
    heavy = tuple(replace(ball, mass=0.1) if ball.id == "8" else ball for ball in soft.balls)
    assert headings([one, played(balls=heavy)])[1] == "mass of ball 8: 100 g"
    law = replace(soft.physics, law="coulomb")
    assert headings([one, played(physics=law)]) == [
        "pymunk, dt = 1/240 s, published law", "pymunk, dt = 1/240 s, coulomb law"
    ]  # fmt: skip
    rolling = replace(soft.friction, surface=0.3, cushion=0.1, ball_ball=0.0)
    many = played(friction=rolling, restitution=replace(soft.restitution, cushion=0.1))
    assert headings([one, many])[1] == (
        "cushion restitution 0.1, surface friction 0.3, ball-ball friction 0, and 1 more"
    )
    titled = replace(many, scene=replace(many.scene, title="Other cloth"))
    assert headings([one, titled]) == [soft.title, "Other cloth"]


def test_command_compares(tmp_path: Path) -> None:
    done = typed(
        "render", "report", "--shot", 1, "--out", tmp_path,
        "--overlay", "pymunk-discrete:1/240:coulomb", "--side-by-side", "--format", "gif",
        "--size", "320x180", "--from", "0.1", "--to", "0.2", "--slow", "2",
        "--picture-format", "svg",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    names = ["shot-1-side-by-side.gif"]
    names += [f"shot-1-{when}-side-by-side.svg" for when in ("start", "end")]
    assert [Path(line).name for line in done.stdout.splitlines()] == names
    with Image.open(tmp_path / names[0]) as gif:
        assert (gif.size, gif.n_frames) == ((320, 180), 6 + 25)  # type: ignore[attr-defined]


def test_only_ghosts_that_move_have_rims(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = []
    monkeypatch.setattr(balls, "draw_rims", lambda _, its, __: drawn.append({b.label for b in its}))
    run = simulate(load("report"), 4, solver="event-driven")
    picture(Show((run, replace(run))), tmp_path / "a.png", when="end", dpi=40)
    assert drawn == [{id_ for event in run.events for id_ in event.balls}] == [set("C19") | {"10"}]
