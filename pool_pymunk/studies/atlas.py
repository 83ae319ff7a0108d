"""This study maps the outcomes of a shot over its angle and speed, or over two other inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.laws import Law
from pool_pymunk.many.batch import CANNOT_START, Batch
from pool_pymunk.many.source import NOTHING
from pool_pymunk.many.workers import Workers, workers_of
from pool_pymunk.model import Scene, Shot
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import row_of
from pool_pymunk.model.parts import NEAREST
from pool_pymunk.model.plain import argument, read_pair, whole
from pool_pymunk.model.problems import setting_error
from pool_pymunk.solvers import find_shot
from pool_pymunk.studies.derivatives import ball_number
from pool_pymunk.studies.sweep.plan import Plan, as_begun, make_plan

Ints = NDArray[np.int32]
Range = tuple[float, float]

AT_ONCE = 60_000  # shots; their inputs take some 90 MB with 16 balls
STEPS = (16, 8, 4, 2, 1)  # pixels from one to the next in each pass, from coarse to fine
# Default pixels, angles (degrees) and speeds (times the shot's); the shot itself lies well within.
SIZE, ANGLES, SPEEDS = (1200, 800), (-30.0, 30.0), (0.25, 1.5)
# These are the maps, and what each of them shows.
MAPS = {"end": "end", "first-hit": "first_hit", "hits": "hits", "pocket": "pocketed",
        "duration": "duration"}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Atlas:
    """An atlas has the outcomes of a shot at W values of one input and H of another one.

    ``axes`` are their names. ``angle`` (W,) are the values across, and ``speed`` (H,) those
    upwards, in SI: angles (degrees, relative to the shot's) and speeds, or those of other axes.
    ``end`` (H, W, 2) is where ball number ``ball`` ended (m), ``pocketed`` (H, W) which pocket has
    it (-1: none), ``first_hit`` the ball that the struck one met first (-1: none), ``hits`` how
    many hits of two balls there were, and ``duration`` (s) when all rested; ``end`` and
    ``duration`` are NaN for shots that could not be played. ``by_reference`` counts the shots
    played in Python. An atlas of one map has only what this map shows, in single precision. One
    that is not finished yet has the outcome of a pixel close by where none was played.
    """

    plan: Plan
    ball: int
    angle: Array
    speed: Array
    end: NDArray[np.floating]
    pocketed: Ints
    first_hit: Ints
    hits: Ints
    duration: NDArray[np.floating]
    by_reference: int
    axes: tuple[str, str] = ("angle", "speed")

    def __repr__(self) -> str:
        wide, high = len(self.angle), len(self.speed)
        across, up = self.axes
        return f"<Atlas of {wide * high:,} shots: {across} ({wide}) by {up} ({high})>"

    @property
    def scene(self) -> Scene:
        """The scene that was played."""
        return self.plan.scene

    @property
    def maps(self) -> dict[str, NDArray[Any]]:
        """The arrays of all maps that are asked for, by their keys in ``MAPS``."""
        its: dict[str, NDArray[Any]] = {key: getattr(self, key) for key in MAPS.values()}
        return {key: each for key, each in its.items() if len(each)}


class CutShort(KeyboardInterrupt):
    """An interrupt comes while an atlas is played; ``found`` is the atlas so far."""

    def __init__(self, found: Atlas) -> None:
        super().__init__()
        self.found = found


def atlas(
    scene: Scene,
    shot: Shot | str | int | None = None,
    *,
    angle: Range = ANGLES,
    speed: Range | None = None,
    axes: Mapping[str, Range] | None = None,
    size: tuple[int, int] = SIZE,
    ball: str | None = None,
    law: str | Law | None = None,
    max_time: float | None = None,
    aims_anew: bool = False,
    show: str | None = None,
    workers: int | Executor | Workers | None = None,
    on_done: Callable[[int], object] | None = None,
    on_pass: Callable[[Atlas], object] | None = None,
) -> Atlas:
    """Play a shot at ``size`` (W, H) angles (degrees, relative to the shot's) and speeds (m/s).

    By default the speeds go from 0.25 to 1.5 times the shot's. ``axes`` has two other inputs with
    their ranges (SI), the one across first, named as in a sweep
    (:class:`~pool_pymunk.studies.sweep.plan.Plan`). ``ball`` is the id of the ball whose end is
    kept, by default the one aimed at or the nearest. A shot that aims at a ball is aimed once, in
    the scene as it is; with ``aims_anew`` it is aimed in each pixel. ``show``, one of ``MAPS``,
    keeps only what this map shows: 4 or 8 bytes a shot instead of 36. ``workers`` share the work,
    as in :func:`~pool_pymunk.simulate_many`. ``on_done(n)`` is called whenever ``n`` more shots are
    done. The pixels are played from coarse to fine, and ``on_pass(found)`` is called with the atlas
    so far, first when each 16th row and column is played, and then whenever it is twice as fine. An
    interrupt raises :class:`CutShort`, which has the atlas so far. Raises SettingError, which names
    the argument.

    >>> from pool_pymunk import load
    >>> found = atlas(load("report"), 1, size=(9, 5))
    >>> found.end.shape, found.first_hit[:, 4].tolist()
    ((5, 9, 2), [-1, 1, 1, 1, 1])
    """
    chosen = find_shot(scene, shot)
    if chosen is None:
        raise setting_error("shot", None, "the scene has no shots, and one is needed")
    (across, columns), (up, rows) = _axes(scene, chosen, angle, speed, axes).items()
    wide, high = read_pair("size", size)
    width, height = argument("width", wide, whole(2)), argument("height", high, whole(2))
    begun = as_begun(scene, chosen, law, max_time, aims_anew)
    grid = {up: (*rows, height), across: (*columns, width)}
    plan = make_plan(begun, None, grid, None, 0, AT_ONCE)
    found = Atlas(
        plan, _watched(scene, chosen, ball), np.linspace(*columns, width),
        np.linspace(*rows, height), **_nothing((height, width), show), by_reference=0,
        axes=(across, up),
    )  # fmt: skip
    with workers_of(workers) as several:
        _play(found, several, on_done, on_pass or (lambda _: None))
    return found


def _axes(
    scene: Scene, shot: Shot, angle: Range, speed: Range | None, axes: Mapping[str, Range] | None
) -> dict[str, Range]:
    """Read the ranges of two inputs, the one across first."""
    if axes is None:
        usual = np.hypot(*scene.start(shot).velocity[scene.index[shot.ball]])
        speeds = speed or (SPEEDS[0] * usual, SPEEDS[1] * usual)
        return {"angle": read_pair("angle", angle), "speed": read_pair("speed", speeds)}
    if not isinstance(axes, Mapping) or len(axes) != 2:
        raise setting_error("axes", axes, "must be two inputs with their ranges (low, high)")
    for name in axes.keys() - {"mass"}:
        row_of("axes", name, scene, ["mass"])
    return {name: read_pair(f"axes[{name!r}]", each) for name, each in axes.items()}


def _watched(scene: Scene, shot: Shot, ball: str | None) -> int:
    """Return the number of a ball, by default of the one aimed at or the nearest."""
    struck = scene.index[shot.ball]
    if ball is not None or shot.aim not in (None, NEAREST):
        return ball_number(scene, str(shot.aim) if ball is None else ball)
    return scene.nearest(struck) if len(scene.balls) > 1 else struck


def _play(
    found: Atlas, workers: Workers, on_done: Callable[[int], object] | None,
    on_pass: Callable[[Atlas], object],
) -> None:  # fmt: skip
    """Play the pixels of an atlas, from coarse to fine."""
    is_seen = False
    try:
        for step, parts in _passes(len(found.speed), len(found.angle)):
            for shots in parts:
                drawn = found.plan.draw(shots)
                _keep(found, shots, found.plan.play(drawn, workers=workers, on_done=on_done))
            _spread(found, step)
            is_seen = True
            on_pass(found)
    except KeyboardInterrupt:
        if not is_seen:
            raise
        raise CutShort(found) from None


def _passes(height: int, width: int) -> Iterator[tuple[int, list[NDArray[np.int_]]]]:
    """Yield each step from pixel to pixel, and the numbers of its new shots, AT_ONCE together."""
    numbers, is_new = (
        np.arange(height * width).reshape(height, width),
        np.ones((height, width), bool),
    )
    for step in STEPS:
        its = numbers[::step, ::step][is_new[::step, ::step]]
        is_new[::step, ::step] = False
        if len(its):
            yield step, np.array_split(its, -(-len(its) // AT_ONCE))


def _nothing(size: tuple[int, int], show: str | None) -> dict[str, NDArray[Any]]:
    """Return what all maps, or one of them, show of shots (H, W) that were not played."""
    if show is not None and show not in MAPS:
        raise setting_error("show", show, f"must be one of {', '.join(MAPS)}")
    real, kept = float if show is None else np.float32, dict[str, NDArray[Any]]()
    for name, key in MAPS.items():
        is_real = key in ("end", "duration")
        shape = (*(size if show in (None, name) else (0,)), *(2,) * (key == "end"))
        kept[key] = np.full(shape, np.nan if is_real else NOTHING, real if is_real else np.int32)
    return kept


def _spread(found: Atlas, step: int) -> None:
    """Let each pixel of a pass stand for those up to the next ones, which are not played yet."""
    for each in found.maps.values() if step > 1 else ():
        wide = each[::step, ::step].repeat(step, axis=0).repeat(step, axis=1)
        each[:] = wide[: len(each), : each.shape[1]]


def _keep(found: Atlas, shots: NDArray[np.int_], batch: Batch) -> None:
    """Keep what the maps show of some shots."""
    ball = found.ball
    its = vars(batch) | {"end": batch.final[:, ball], "pocketed": batch.pocketed[:, ball]}
    unplayed = batch.status == CANNOT_START
    its["end"][unplayed] = batch.duration[unplayed] = np.nan
    for key, each in found.maps.items():
        each.reshape(-1, *its[key].shape[1:])[shots] = its[key]
