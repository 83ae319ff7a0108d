"""This study looks for shots that do what is asked, and ranks them by the error they forgive."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pool_pymunk.laws import Law
from pool_pymunk.many import Batch
from pool_pymunk.many.places import may_lie
from pool_pymunk.many.workers import Workers, workers_of
from pool_pymunk.model import Point, Scene, Shot
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import SHOT, row_of
from pool_pymunk.model.plain import argument, read_pair, size, whole
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.state import NO_ROLLING
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import find_shot
from pool_pymunk.studies import Mask
from pool_pymunk.studies.derivatives import ball_number, derivatives
from pool_pymunk.studies.variation import Normal, Variation, numbers

Range = tuple[float, float]
Wanted = Callable[[Batch], Any]

AT_ONCE = 100_000  # shots; with 16 balls they take some 70 MB
# These say how long the search is, and which shots differ; they were chosen, and change no run.
TALL = 60  # speeds on the grid of the first look; the rest of the tries are angles,
FURTHER = {"roll": 7, "x": 5, "y": 5}  # and these, if they have ranges
# Shots differ if they are three standard deviations apart. These are the player's errors, this
# share of the velocity for a roll without a given error, and this share of a radius for places.
ROLL_ERROR, PLACE_ERROR = 0.05, 0.5
CANDIDATES = 12  # spots that are looked at closely, for each shot that is asked for
STEPS, NARROWER = 4, 0.5  # moves to the middle of good tries; each range is narrower by this factor
# The search takes at most MOST_STEPS steps towards where balls shall end. Each takes the first of
# these shares of the whole step that reduces the distance by at least the share LEAST_GAIN.
MOST_STEPS, SIZES, LEAST_GAIN = 20, (1.0, 0.5, 0.25, 0.1, 0.03, 0.01), 1e-3


@dataclass(frozen=True, eq=False)
class Found:
    """A found shot does what is asked for; with the player's errors, a ``share`` of tries does.

    ``angle`` (degrees) and ``speed`` (m/s) are those of ``shot``; ``run`` is its exact run.
    ``off`` (m) is the root of the sum of the squared distances of balls from where they shall end.
    ``warnings`` say why it is not known how these ends depend on the shot, so that it may not have
    been moved to where they are least off.
    """

    shot: Shot
    angle: float
    speed: float
    share: float
    run: Run
    off: float = 0.0
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        off = f", {self.off:.2g} m off" if self.off else ""
        return (
            f"<Found {self.angle:.4g} degrees, {self.speed:.4g} m/s: "
            f"{100.0 * self.share:.3g} % of the tries{off}>"
        )


def find(
    scene: Scene,
    shot: Shot | str | int | None,
    wanted: Wanted,
    *,
    angle: Range = (-180.0, 180.0),
    speed: Range | None = None,
    roll: Range | None = None,
    place: tuple[Range, Range] | None = None,
    angle_error: float = 0.5,
    speed_error: float = 0.05,
    errors: Mapping[str, float] | None = None,
    tries: int = 100_000,
    samples: int = 2_000,
    best: int = 5,
    seed: int = 0,
    ends: Mapping[str, Point] | None = None,
    law: str | Law | None = None,
    workers: int | Executor | Workers | None = None,
    on_done: Callable[[int, int], object] | None = None,
) -> list[Found]:
    """Return the shots that do what is asked for, those that forgive the largest errors first.

    ``wanted(batch)`` takes a :class:`~pool_pymunk.Batch` and returns which of its shots do it, a
    Boolean array (S,). The ball that ``shot`` strikes is struck at angles (degrees, from +x) within
    ``angle``, speeds (m/s) within ``speed`` (default: 0.25 to 1.5 times the shot's) and rolls
    (shares of the velocity) within ``roll`` (default: the shot's). ``place`` has the ranges of x
    and y (m) in which the ball may be put before (default: it stays where it lies).
    ``tries`` shots (600 or more) on a grid are played first. The player's errors are normal, with
    the standard deviations ``angle_error`` (degrees) and ``speed_error`` (m/s); ``errors`` has
    those of further inputs (:mod:`pool_pymunk.model.inputs`), such as ``"x.8"``. A shot's share of
    success is measured by ``samples`` tries. The ``best`` shots are returned, no two of them within
    three standard deviations of each other; the list is empty if no try did it. All runs are exact.

    ``ends`` says where balls shall end (m), by their ids. Each found shot is then moved to where
    the sum of the squared distances is least (Gauss-Newton), as long as it does what is asked for,
    and the nearest shots come first; ``warnings`` of a shot say where its ends have no derivatives.
    ``law`` is that of every contact (default: the scene's). ``workers`` share the work, as in
    :func:`~pool_pymunk.simulate_many`. ``on_done(done, planned)`` counts the shots played, and
    those that will be at most. Raises SettingError, which names the argument.

    >>> from pool_pymunk import load
    >>> scene = load("report")
    >>> found = find(scene, 1, lambda batch: batch.hits > 3, tries=3000, samples=200, best=1)
    >>> len(found), found[0].share > 0.5
    (1, True)
    """
    chosen = find_shot(scene, shot)
    if chosen is None:
        raise setting_error("shot", None, "the scene has no shots, and one is needed")
    search = _ShotSearch(scene, chosen, wanted, seed, law)
    search.read_player(angle_error, speed_error, errors or {})
    search.read_goals({} if ends is None else ends)
    search.read_ranges(angle, speed, roll, place)
    argument("tries", tries, whole(10 * TALL))
    argument("samples", samples, whole(10))
    argument("best", best, whole(1))
    argument("seed", seed, whole(0))
    search.on_done = on_done or search.on_done
    with workers_of(workers) as search.workers:
        return search.best(tries, samples, best)


class _ShotSearch:
    """A search knows the scene, what is asked for, and the player.

    A spot (5,) is a shot: angle (degrees), speed (m/s), roll, and the x and y (m) of its ball.
    A try (5 + P,) is a spot, and the errors of P other inputs if there are any.
    """

    def __init__(
        self, scene: Scene, shot: Shot, wanted: Wanted, seed: int, law: str | Law | None
    ) -> None:
        self.scene, self.shot, self.wanted, self.seed = scene, shot, wanted, seed
        alone = replace(shot, from_previous=False)
        self.varied = Variation(scene, {}, alone, law, state=scene.start(shot))
        self.ball, self.usual = self.varied.ball, self.varied.own("speed")
        self.names = ("angle", "speed", "roll", f"x.{shot.ball}", f"y.{shot.ball}")
        self.own = np.array([self.varied.own(name) for name in self.names[3:]])
        self.on_done: Callable[[int, int], object] = lambda *_: None
        self.done = self.planned = 0
        self.workers = Workers(None)

    def tell(self, count: int) -> None:
        """Count this many shots as played, and say how far the search has come."""
        self.done += count
        self.planned = max(self.planned, self.done)
        self.on_done(self.done, self.planned)

    def read_player(self, angle: float, speed: float, errors: Mapping[str, float]) -> None:
        """Read how far the shot and further inputs may be off: their standard deviations."""
        self.errors = argument("angle_error", angle, size), argument("speed_error", speed, size)
        self.others: dict[str, float] = {}
        for name, error in errors.items():
            row, _ = row_of("errors", name, self.scene, (), self.shot)
            if row.of == SHOT and name != "roll":
                key = "speed_error" if row.quantity == "speed" else "angle_error"
                raise setting_error("errors", name, f"is the player's: give it as {key}")
            self.others[name] = argument(f"errors[{name!r}]", error, size)
        both = dict(zip(("turn", "speed"), self.errors, strict=True)) | self.others
        self.player = {name: Normal(error) for name, error in both.items()}

    def read_goals(self, ends: Mapping[str, Point]) -> None:
        """Read where balls shall end."""
        if not isinstance(ends, Mapping):
            raise setting_error("ends", ends, "must be places by the ids of balls")
        self.balls = [ball_number(self.scene, id_, "ends") for id_ in ends]
        goals = [read_pair(f"ends.{id_}", end) for id_, end in ends.items()]
        self.goals = np.array(goals).reshape(-1, 2)
        if not np.isfinite(self.goals).all():
            raise setting_error("ends", dict(ends), "must be finite numbers")

    def read_ranges(
        self, angle: Range, speed: Range | None, roll: Range | None,
        place: tuple[Range, Range] | None,
    ) -> None:  # fmt: skip
        """Read the ranges within which shots are looked for."""
        speed = speed or (0.25 * self.usual, 1.5 * self.usual)
        if place is not None and (not isinstance(place, Sequence) or len(place) != len("xy")):
            raise setting_error("place", place, "must be the ranges of x and of y")
        x, y = place or (None, None)
        given = {"angle": angle, "speed": speed, "roll": roll, "x": x, "y": y}
        ranges = {key: read_pair(key, each) for key, each in given.items() if each is not None}
        for key, (low, high) in ranges.items():
            if not low < high:
                raise setting_error(key, [low, high], "must be (low, high)")
            if key == "roll" and not self.scene.surface.rolls:
                raise setting_error(key, [low, high], NO_ROLLING)
        self.free = {key: k for k, key in enumerate(given) if key in ranges}
        own = dict(zip(given, (0.0, 0.0, self.shot.roll, *self.own), strict=True))
        self.low, self.high = np.array([ranges.get(key, (own[key],) * 2) for key in given]).T

    def within(self, spot: Array) -> Array:
        """Return a spot moved into the ranges; a range of 360 degrees is periodic."""
        spot, low = spot.copy(), self.low[0]
        if self.high[0] - low >= 360.0:
            spot[0] = low + (spot[0] - low) % 360.0
        return np.clip(spot, self.low, self.high)

    def play(self, tries: Array) -> tuple[Batch, Mask]:
        """Play tries (S, 5 + P), and tell in which the ball has room."""
        spots = dict(zip(self.names, tries.T, strict=False))
        values = {name: spots[name] for name in ("angle", "speed", "roll")}
        for name, errors in zip(self.others, tries.T[len(spots) :], strict=False):
            values[name] = self.varied.erring(name, errors, spots.get(name))
        starts, has_room = self.varied.places(len(tries)), np.ones(len(tries), bool)
        if "x" in self.free:
            starts[:, self.ball] = tries[:, 3:5]
            has_room = np.asarray(may_lie(self.scene, starts).all(axis=1))
            starts[~has_room] = self.varied.start.position
        begun = self.varied.begin(starts, values)
        return self.varied.play(begun, workers=self.workers, on_done=self.tell), has_room

    def does(self, tries: Array) -> Mask:
        """Tell which of these tries (S, 5 + P) do what is asked, AT_ONCE of them at a time."""
        found = []
        for k in range(0, len(tries), AT_ONCE):
            batch, has_room = self.play(tries[k : k + AT_ONCE])
            answer = np.asarray(self.wanted(batch))
            if answer.shape != (len(batch),) or answer.dtype != np.bool_:
                message = f"must return a Boolean array of shape ({len(batch)},)"
                said = f"{answer.dtype} of shape {answer.shape}"
                raise setting_error("wanted", said, message)
            found.append(answer & has_room)
        return np.concatenate(found)

    def best(self, tries: int, samples: int, count: int) -> list[Found]:
        """Return the best shots, at most this many."""
        found, spots, most = list[Found](), list[Array](), CANDIDATES * count
        self.planned = tries + most * (STEPS + 1) * samples
        for looked_at in self.look(tries)[:most]:
            one, spot = self.closely(looked_at, samples)
            if one is not None and not self.is_near(spot, spots):
                found.append(one)
                spots.append(spot)
        return sorted(found, key=lambda one: (one.off, -one.share))[:count]

    def look(self, tries: int) -> list[Array]:
        """Look at a grid, and return the spots around which most tries do what is asked."""
        deep = [count if key in self.free else 1 for key, count in FURTHER.items()]
        wide = max(tries // (TALL * math.prod(deep)), 2)
        axes = [*map(np.linspace, self.low, self.high, (wide, TALL, *deep))]
        grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(axes))
        does = self.does(grid).reshape(TALL, wide, *deep)
        share = does.astype(float)
        for axis, (values, error) in enumerate(zip(axes, self.errors, strict=False)):
            share = _smoothed(share, values[1] - values[0], error, axis=1 - axis)
        share[~does] = 0.0
        spots: list[Array] = []
        for k in np.argsort(-share, axis=None, kind="stable").tolist():
            if share.flat[k] == 0.0 or len(spots) >= 200:
                break
            if not self.is_near(grid[k], spots):
                spots.append(grid[k])
        return spots

    def closely(self, spot: Array, samples: int) -> tuple[Found | None, Array]:
        """Move a spot to where most tries around it do what is asked, and measure their share."""
        turn, speed, *others = numbers(self.player, samples, self.seed).values()
        still = np.zeros((samples, len(spot) - 2))
        errors = np.column_stack([turn, speed, still, *others])
        for k in range(STEPS):
            tries = self.around(spot, errors * NARROWER**k)
            does = self.does(tries)
            if does.any():
                middle = self.within(tries[does].mean(axis=0)[: len(spot)])
                spot = middle if self.does(middle[np.newaxis])[0] else spot
        run = self.played(spot)
        if run is None:
            return None, spot
        why: tuple[str, ...] = ()
        if self.balls:
            spot, run, why = self.improved(spot, run)
        share, (angle, speed, *_) = self.does(self.around(spot, errors)).mean(), spot.tolist()
        assert run.shot is not None
        return Found(run.shot, angle, speed, float(share), run, self.off(run), why), spot

    def around(self, spot: Array, errors: Array) -> Array:
        """Return tries of a spot with these errors, (S, 5 + P)."""
        return errors + np.pad(spot, (0, len(self.others)))

    def played(self, spot: Array) -> Run | None:
        """Play a shot exactly; return None if it does not do what is asked for."""
        (batch, has_room), (angle, speed, roll, x, y) = self.play(spot[np.newaxis]), spot.tolist()
        if not has_room[0] or not np.asarray(self.wanted(batch))[0]:
            return None
        place = (x, y) if "x" in self.free else self.shot.place
        shot = Shot(
            "found", self.shot.ball, speed=max(speed, 0.0), angle=angle, roll=roll, place=place
        )
        return replace(batch.run(0), scene=replace(self.scene, shots=(shot,)), shot=shot)

    def off(self, run: Run) -> float:
        """Return how far (m) the balls end from where they shall end."""
        ends = np.array(run.end.position)[self.balls]
        return float(np.sqrt(((ends - self.goals) ** 2).sum()))

    def improved(self, spot: Array, run: Run) -> tuple[Array, Run, tuple[str, ...]]:
        """Move a shot to where the balls end nearest to their goals, by steps of Gauss-Newton.

        What has no derivative at the present shot is not moved; say why it has none.
        """
        names = [self.names[k] for k in self.free.values()]
        why: tuple[str, ...] = ()
        for _ in range(MOST_STEPS):
            found = derivatives(run, names)
            slopes = found.final[self.balls].reshape(-1, len(names))
            why = found.warnings if np.isnan(slopes).any() else ()
            apart = (self.goals - np.array(run.end.position)[self.balls]).ravel()
            step = np.linalg.lstsq(np.nan_to_num(slopes), apart, rcond=None)[0]
            whole_step, least = np.zeros(len(spot)), (1.0 - LEAST_GAIN) * self.off(run)
            whole_step[list(self.free.values())] = step
            for share in SIZES:
                moved = self.within(spot + share * whole_step)
                other = self.played(moved)
                if other is not None and self.off(other) < least:
                    spot, run = moved, other
                    break
            else:
                break
        return spot, run, why

    def is_near(self, spot: Array, spots: Sequence[Array]) -> bool:
        """Tell whether a spot is within three standard deviations of one of the others."""
        away = np.reshape(spots, (-1, len(spot))) - spot
        away[:, 0] = (away[:, 0] + 180.0) % 360.0 - 180.0
        wide = PLACE_ERROR * self.scene.balls[self.ball].radius
        errors = np.array([*self.errors, self.others.get("roll") or ROLL_ERROR, wide, wide])
        return bool((((away / errors) ** 2).sum(axis=1) <= 9.0).any())


def _smoothed(values: Array, step: float, width: float, axis: int) -> Array:
    """Return values on a grid of this step, each a mean of its neighbours with normal weights."""
    far = min(int(3.0 * width / step), (values.shape[axis] - 1) // 2)
    if far == 0:
        return values
    kernel = np.exp(-0.5 * (np.arange(-far, far + 1) * step / width) ** 2)
    kernel /= kernel.sum()
    return np.apply_along_axis(np.convolve, axis, values, kernel, mode="same")
