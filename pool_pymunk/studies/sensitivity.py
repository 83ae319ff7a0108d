"""This study plays many runs from slightly different starts, and measures how far ends spread.

So it tells what the uncertainty of the inputs does to the ends. The exact solver plays every draw
of the inputs, so the spread comes from the scene alone. For small errors derivatives say the same
at once: for errors drawn uniformly within +-h the covariance of the ends is D diag(h^2 / 3) D^T.
For larger errors contacts come in another order, and the ends do not lie where the derivatives say.
A few samples find out where that begins.
"""

from __future__ import annotations

import csv
import math
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.model import Point, Scene, Shot
from pool_pymunk.model.plain import argument, whole
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import SettingError, find_shot
from pool_pymunk.studies.forecast import follow
from pool_pymunk.studies.uncertainty import (
    PRINTED_DECIMALS,
    Mask,
    Study,
    Uncertainty,
    read_study,
)

UNKNOWN = "?"
OFF = 0.1  # The linear answer holds where most samples end within this share of it.
MOST = 0.95
TRIED = 500  # This many samples are played at each width.
NARROWEST, WIDEST = 2.0**-40, 2.0**6  # These widths are tried, in those of the uncertainty.


# -- what comes out --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Spread:
    """A spread tells how far one ball's ends lie apart (m); points are x and y.

    ``end`` is where the unperturbed run ends. ``std`` are the standard deviations along x and y,
    and ``deviation`` is the larger one. 95 % of the ends lie between ``low`` and ``high`` along x,
    and along y. ``amplification`` is ``deviation`` over that of the starts (their root mean square
    over balls); it is None where no start is moved. ``horizon`` (s, to 1/256 of the run) is the
    time at which half of the runs have left the unperturbed one by more than ``Sensitivity.agree``;
    it is infinite if they never do. ``pocketed`` has, for each pocket by its id, the share of the
    samples in which the ball was in it at the end; pockets that never have it are left out.
    """

    ball: str
    start: Point
    end: Point
    std: Point
    deviation: float
    low: Point
    high: Point
    amplification: float | None
    horizon: float
    pocketed: Mapping[str, float]

    def digits(self, scene: Scene) -> tuple[str, str]:
        """Return the end's x and y as the log prints them, with ``?`` for a digit without meaning.

        A digit means something if the standard deviation is at most half its place value.
        """
        units = scene.units
        x, y = (
            digits_that_hold(units.from_si(value, "length"), units.from_si(std, "length"))
            for value, std in zip(self.end, self.std, strict=True)
        )
        return x, y


COLUMNS = (
    "shot", "ball", "start_x", "start_y", "end_x", "end_y", "std_x", "std_y", "low_x", "low_y",
    "high_x", "high_y", "amplification", "horizon", "samples", "seed", "pocketed",
)  # fmt: skip


def write_csv(found: Sequence[Sensitivity], path: Path) -> None:
    """Write one row a shot and ball, in SI; leave out what is not known.

    A ball may have no amplification and no horizon.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        for one in found:
            for ball in one.balls:
                points = (ball.start, ball.end, ball.std, ball.low, ball.high)
                numbers = (v for point in points for v in point)
                chance = sum(ball.pocketed.values())
                rest = (ball.amplification, _finite(ball.horizon), one.samples, one.seed, chance)
                rows.writerow([one.reference.name, ball.ball, *numbers, *rest])


def digits_that_hold(value: float, std: float) -> str:
    """Return ``value`` with two decimals, and ``?`` for every digit below twice ``std``.

    >>> digits_that_hold(14.76, 0.003), digits_that_hold(14.76, 0.04), digits_that_hold(14.76, 1.7)
    ('14.76', '14.7?', '1?.??')
    """
    text = f"{value:.{PRINTED_DECIMALS}f}"
    point = text.index(".")
    places = [point - k - (k < point) for k in range(len(text))]  # powers of ten
    return "".join(
        UNKNOWN if c.isdigit() and std > 0.5 * 10.0**place else c
        for c, place in zip(text, places, strict=True)
    )


@dataclass(frozen=True)
class Sensitivity:
    """A sensitivity holds the spread of one shot's ends.

    ``starts`` and ``ends`` (S, N, 2) are positions (m) of the samples that could be finished.
    ``left`` (S, N) is the time (s; inf: never) at which each ball first was more than ``agree`` (m)
    off the unperturbed run. ``agree`` is one unit of the last digit that the starts are written to:
    it is twice the largest uncertainty. Where no start is moved, it is the last digit of the
    printed ends. ``same_contacts`` (S,) says whether every ball met the same others in the same
    order. ``pocketed`` (S, N) are the numbers of the pockets that have the balls at the end, -1
    where none has. ``rejected`` counts balls that overlapped something as they were drawn, so that
    they were moved apart. ``unfinished`` counts samples that are left out.
    """

    reference: Run
    uncertainty: Uncertainty
    seed: int
    agree: float
    starts: Array
    ends: Array
    left: Array
    same_contacts: Mask
    pocketed: NDArray[np.int_]
    rejected: int
    unfinished: int
    wall_time: float

    @property
    def samples(self) -> int:
        """The number of samples that were finished."""
        return len(self.ends)

    @cached_property
    def balls(self) -> tuple[Spread, ...]:
        """Return each ball's spread, in the scene's order."""
        widths = self.uncertainty.widths(self.reference.scene)
        # A uniform draw within +-h has the variance h^2 / 3.
        moved = math.sqrt(float((widths**2).mean()) / 3.0)
        low, high = np.quantile(self.ends, (0.025, 0.975), axis=0)
        # If all ends are equal, this is exactly 0.
        std = (self.ends - self.reference.end.position).std(axis=0)
        horizon = np.quantile(self.left, 0.5, axis=0, method="higher")
        return tuple(
            Spread(
                ball=ball.id,
                start=_point(self.reference.knots[i][0, 1:3]),
                end=self.reference.final[ball.id],
                std=_point(std[i]),
                deviation=(deviation := float(std[i].max())),
                low=_point(low[i]),
                high=_point(high[i]),
                amplification=deviation / moved if moved > 0.0 else None,
                horizon=float(horizon[i]),
                pocketed=self._chances(i),
            )
            for i, ball in enumerate(self.reference.scene.balls)
        )

    def _chances(self, i: int) -> dict[str, float]:
        """Return the share of the samples that end with ball ``i`` in a pocket, by its id."""
        shares = {
            pocket.id: float((self.pocketed[:, i] == k).mean())
            for k, pocket in enumerate(self.reference.scene.pockets)
        }
        return {id_: share for id_, share in shares.items() if share > 0.0}

    def as_dict(self) -> dict[str, object]:
        """Return the shot as in the JSON of ``sensitivity --json``, in SI; null means never."""
        scene = self.reference.scene
        return {
            "name": self.reference.name,
            "uncertainty": {
                "position": self.uncertainty.widths(scene).tolist(),
                "speed": self.uncertainty.speed,
                "angle": self.uncertainty.angle,
                **self.uncertainty.inputs,
            },
            "seed": self.seed,
            "samples": self.samples,
            "unfinished": self.unfinished,
            "rejected": self.rejected,
            "same_contacts": self.same,
            "agree": self.agree,
            "horizon": _finite(self.horizon),
            "balls": {
                ball.ball: asdict(ball) | {"horizon": _finite(ball.horizon)} for ball in self.balls
            },
            "wall_time": self.wall_time,
        }

    def write_npz(self, path: Path) -> None:
        """Write the samples' arrays and the balls' ids as a NumPy archive (SI)."""
        kept = "starts", "ends", "left", "same_contacts", "pocketed"
        balls = np.array([ball.ball for ball in self.balls])
        np.savez_compressed(path, **{key: getattr(self, key) for key in kept}, balls=balls)

    @property
    def worst(self) -> Spread:
        """Return the spread of the ball that spreads most."""
        return max(self.balls, key=lambda ball: ball.deviation)

    @property
    def horizon(self) -> float:
        """Return the first ball's horizon (s), until which the whole shot is predictable."""
        return min(ball.horizon for ball in self.balls)

    @property
    def kept_digits(self) -> tuple[int, int]:
        """Count the digits of all printed ends that mean anything, and all digits."""
        texts = [text for ball in self.balls for text in ball.digits(self.reference.scene)]
        kept = sum(c.isdigit() for text in texts for c in text)
        return kept, sum(c.isdigit() or c == UNKNOWN for text in texts for c in text)

    @property
    def same(self) -> float:
        """The share of the runs in which every ball has the same contacts in the same order."""
        return float(self.same_contacts.mean())


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _point(xy: Array) -> Point:
    return (float(xy[0]), float(xy[1]))


# -- drawing the inputs ----------------------------------------------------------------------------


def sensitivity(
    scene: Scene,
    shot: Shot | str | int | None,
    uncertainty: Uncertainty,
    samples: int = 1000,
    seed: int = 0,
    threads: int | None = None,
    *,
    law: str | Law | None = None,
    on_done: Callable[[int], object] | None = None,
    processes: int | None = None,
) -> Sensitivity:
    """Play ``samples`` starts drawn within ``uncertainty``, with the exact solver.

    ``shot`` is chosen as in :func:`~pool_pymunk.simulate`, and so is the ``law`` of every contact.
    ``threads`` (None: one for each core) share the work. The numbers depend only on ``seed``, not
    on how many threads there are. With numba installed (``pip install 'pool-pymunk[fast]'``)
    samples are compiled, and give the same numbers. ``on_done(n)`` is called whenever ``n`` more
    samples are done. ``processes`` is the old name of ``threads``.

    Raises SettingError for settings that make no sense, for a ball that leaves no room for another,
    and if the unperturbed run, or every other one, cannot be finished.

    >>> from pool_pymunk import load
    >>> found = sensitivity(load("report"), "Simulation 1", Uncertainty(0.005 * 0.0254), 200)
    >>> found.worst.ball, round(found.worst.deviation / 0.0254), found.worst.amplification > 400
    ('8', 2, True)
    """
    if processes is not None:
        message = "sensitivity(processes=...) is now sensitivity(threads=...)"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        threads = processes
    began = time.perf_counter()
    samples, seed = argument("samples", samples, whole(2)), argument("seed", seed, whole(0))
    study = read_study(scene, find_shot(scene, shot), uncertainty, law)
    draws = study.draw(samples, seed)
    played = study.play(draws, threads, on_done)
    finished = played.finished
    if not finished.any():
        raise SettingError(f"shot = {study.reference.name}: none of the samples could be finished")
    return Sensitivity(
        reference=study.reference,
        uncertainty=uncertainty,
        seed=seed,
        agree=study.agree,
        starts=draws.starts[finished],
        **{key: each[finished] for key, each in played._asdict().items() if key != "finished"},
        rejected=draws.rejected,
        unfinished=int((~finished).sum()),
        wall_time=time.perf_counter() - began,
    )


# -- by derivatives --------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Linear:
    """A linear sensitivity has what errors within an uncertainty do to the ends, to first order.

    ``by_errors`` (N, 2, K) are the derivatives of the ends (m) by the K errors, in units of half
    their widths. ``holds`` is the multiple of the uncertainty within which 95 % of the samples end
    within a tenth of what the derivatives say; it is 0 if they do so nowhere, and nan if no
    derivatives are known. ``warnings`` say which are not known.
    """

    reference: Run
    uncertainty: Uncertainty
    by_errors: Array
    holds: float
    warnings: tuple[str, ...]

    @cached_property
    def covariance(self) -> Array:
        """Return the covariances of x and y of each ball's end (N, 2, 2), in m^2."""
        return np.asarray(self.by_errors @ self.by_errors.transpose(0, 2, 1) / 3.0)

    @property
    def std(self) -> Array:
        """Return the standard deviations (N, 2) of each ball's end along x and y, in m."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def radius(self) -> float:
        """Return the largest error of a start (m) within which the linear answer holds."""
        return self.holds * float(self.uncertainty.widths(self.reference.scene).max())

    def as_dict(self) -> dict[str, object]:
        """Return the shot as in the JSON of ``sensitivity --linear --json``, in SI."""
        ids = [ball.id for ball in self.reference.scene.balls]
        return {
            "std": {
                id_: std if all(map(math.isfinite, std)) else None
                for id_, std in zip(ids, self.std.tolist(), strict=True)
            },
            "holds": _finite(self.holds),
            "warnings": list(self.warnings),
        }


def linear(
    scene: Scene,
    shot: Shot | str | int | None,
    uncertainty: Uncertainty,
    *,
    seed: int = 0,
    law: str | Law | None = None,
) -> Linear:
    """Differentiate a shot's ends, and find out how far the derivatives can be believed.

    The errors are those of :func:`~pool_pymunk.sensitivity`: a shot that aims at a ball aims at
    where that ball is, and a shot that goes on from the one before starts where that one ends.
    ``law`` is that of every contact (default: the scene's).
    Raises SettingError as :func:`~pool_pymunk.sensitivity` does.

    >>> from pool_pymunk import load
    >>> found = linear(load("report"), "Simulation 3", Uncertainty(0.005 * 0.0254))
    >>> round(float(found.std.max()) / 0.0254, 4), found.holds > 1.0
    (0.0034, True)
    """
    study = read_study(scene, find_shot(scene, shot), uncertainty, law)
    errors = {name: width for name, width in study.errors().items() if width > 0.0}
    warned: dict[str, None] = {}
    for _, known in follow(study.runs(), tuple(errors)):
        warned |= dict.fromkeys(known.warnings)
    by_errors = known.final * np.array(list(errors.values()))
    sound = np.isfinite(by_errors).all() and bool(np.any(by_errors))
    holds = _reach(study, by_errors, seed) if sound else math.nan
    return Linear(study.reference, uncertainty, by_errors, holds, tuple(warned))


def _reach(study: Study, by_errors: Array, seed: int) -> float:
    """Return the multiple of the uncertainty within which the linear answer holds, to a tenth."""
    low, high = math.log2(NARROWEST), math.log2(WIDEST)
    while high - low > 0.1:
        middle = (low + high) / 2.0
        holds = _holds(study, 2.0**middle, by_errors, seed)
        low, high = (middle, high) if holds else (low, middle)
    return 0.0 if low == math.log2(NARROWEST) else float(f"{2.0**low:.2g}")


def _holds(study: Study, scale: float, by_errors: Array, seed: int) -> bool:
    """Tell whether most samples end within a tenth of what the derivatives say."""
    draws = study.draw(TRIED, seed, scale)
    played = study.play(draws, 1)
    base = np.array([ball.position for ball in study.reference.scene.balls])
    widths = np.array(list(study.errors().values()))
    errors = draws.columns(base)[:, widths > 0.0] / widths[widths > 0.0]
    said = np.einsum("nck,sk->snc", by_errors, errors)[played.finished]
    came = (played.ends - study.reference.end.position)[played.finished]
    off = np.sqrt(((came - said) ** 2).sum(axis=(1, 2)))
    size = np.sqrt((said**2).sum(axis=(1, 2)))
    return bool((off <= OFF * size).mean() >= MOST)


def ellipse(covariance: Array, share: float = MOST, points: int = 100) -> Array:
    """Return the outline (points, 2) that a normal distribution has this share within.

    >>> outline = ellipse(np.diag([4.0, 1.0]))
    >>> np.abs(outline).max(axis=0).round(2).tolist()
    [4.89, 2.45]
    """
    sizes, axes = np.linalg.eigh(covariance)
    reach = np.sqrt(-2.0 * math.log(1.0 - share) * np.maximum(sizes, 0.0))
    angle = np.linspace(0.0, 2.0 * math.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray((axes @ (reach[:, np.newaxis] * circle)).T)
