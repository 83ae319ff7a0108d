"""This study plays many runs from slightly different starts, and measures how far ends spread.

So it tells what the uncertainty of the inputs does to the ends. The exact solver plays every draw
of the inputs, so the spread comes from the scene alone. For small errors derivatives say the same
at once: for errors drawn uniformly within +-h the covariance of the ends is D diag(h^2 / 3) D^T.
For larger errors contacts come in another order, and the ends do not lie where the derivatives say.
A few samples find out where that begins.

A shot that aims at a ball aims at where that ball is in each sample. A shot that goes on from the
one before starts where that one ends, played from the same sample.
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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.batch import STATUSES
from pool_pymunk.fast.many import empty, play_all
from pool_pymunk.fast.shots import read_source
from pool_pymunk.model import Point, Scene, Shot
from pool_pymunk.model.inputs import SHOT, TABLE, input_value, parts, rolled, row_of, struck
from pool_pymunk.model.plain import argument, whole
from pool_pymunk.physics.laws import Law, find_law
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import STATUSES as ENDS
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import SettingError, find_shot, reference_solver, simulate, simulate_all
from pool_pymunk.solvers.request import shot_before
from pool_pymunk.studies import Mask, known
from pool_pymunk.studies.compare import Beside, Reference, reference_of
from pool_pymunk.studies.derivatives import follow
from pool_pymunk.studies.uncertainty import StartSampler, Uncertainty, launched

UNFINISHED = ("max_events", "non_finite")
MAX_TIME = STATUSES.index("max_time")
PRINTED_DECIMALS = 2  # the decimals of a printed end, in the scenario's unit of length
UNKNOWN = "?"
OFF = 0.1  # The linear answer holds where most samples end within this share of it.
MOST = 0.95
TRIED = 500  # This many samples are played at each width.
NARROWEST, WIDEST = 2.0**-40, 2.0**6  # These widths are tried, in those of the uncertainty.


# -- what comes out --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Spread:
    """A spread tells how far one ball's ends lie apart (m); points are x and y.

    ``end`` is where the reference run ends. ``std`` are the standard deviations along x and y,
    and ``deviation`` is the larger one. 95 % of the ends lie between ``low`` and ``high`` along x,
    and along y. ``amplification`` is ``deviation`` over that of the starts (their root mean square
    over balls); it is None where no start is moved. ``horizon`` (s, to 1/256 of the run) is the
    time at which half of the runs have left the reference run by more than ``Sensitivity.agree``;
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
        """Return the end's x and y as printed, with ``?`` for a digit that means nothing."""
        written = [scene.units.from_si(each, "length") for each in (*self.end, *self.std)]
        x, y, std_x, std_y = written
        return digits_that_hold(x, std_x), digits_that_hold(y, std_y)


COLUMNS = (
    "shot", "ball", "start_x", "start_y", "end_x", "end_y", "std_x", "std_y", "low_x", "low_y",
    "high_x", "high_y", "amplification", "horizon", "samples", "seed", "pocketed",
)  # fmt: skip


def write_csv(found: Sequence[Sensitivity], path: Path) -> None:
    """Write one row a shot and ball, in SI; leave out amplifications and horizons not known."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        for one in found:
            for ball in one.balls:
                rows.writerow([
                    one.reference.name, ball.ball, *ball.start, *ball.end, *ball.std, *ball.low,
                    *ball.high, ball.amplification, known(ball.horizon), one.samples, one.seed,
                    sum(ball.pocketed.values()),
                ])  # fmt: skip


def digits_that_hold(value: float, std: float) -> str:
    """Return ``value`` with two decimals, and ``?`` for every digit below twice ``std``.

    >>> digits_that_hold(14.76, 0.003), digits_that_hold(14.76, 0.04), digits_that_hold(14.76, 1.7)
    ('14.76', '14.7?', '1?.??')
    """
    text = f"{value:.{PRINTED_DECIMALS}f}"
    point = text.index(".")
    return "".join(
        UNKNOWN if c.isdigit() and std > 0.5 * 10.0 ** (point - k - (k < point)) else c
        for k, c in enumerate(text)
    )


@dataclass(frozen=True)
class Sensitivity:
    """A sensitivity holds the spread of one shot's ends.

    ``starts`` and ``ends`` (S, N, 2) are positions (m) of the samples that could be finished.
    ``left`` (S, N) is the time (s; inf: never) at which each ball first was more than ``agree`` (m)
    off the reference run. ``agree`` is one unit of the last digit that the starts are written to:
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
        reference = self.reference
        # A uniform draw within +-h has the variance h^2 / 3.
        moved = math.sqrt(float((self.uncertainty.widths(reference.scene) ** 2).mean()) / 3.0)
        low, high = np.quantile(self.ends, (0.025, 0.975), axis=0)
        # If all ends are equal, this is exactly 0.
        std = (self.ends - reference.end.position).std(axis=0)
        horizon = np.quantile(self.left, 0.5, axis=0, method="higher")
        shares = {
            pocket.id: (self.pocketed == k).mean(axis=0)
            for k, pocket in enumerate(reference.scene.pockets)
        }
        return tuple(
            Spread(
                ball=ball.id,
                start=_point(reference.knots[i][0, 1:3]),
                end=reference.final[ball.id],
                std=_point(std[i]),
                deviation=(deviation := float(std[i].max())),
                low=_point(low[i]),
                high=_point(high[i]),
                amplification=deviation / moved if moved > 0.0 else None,
                horizon=float(horizon[i]),
                pocketed={id_: float(each[i]) for id_, each in shares.items() if each[i] > 0.0},
            )
            for i, ball in enumerate(reference.scene.balls)
        )

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
            **{key: getattr(self, key) for key in ("seed", "samples", "unfinished", "rejected")},
            "same_contacts": self.same,
            "agree": self.agree,
            "horizon": known(self.horizon),
            "balls": {
                ball.ball: asdict(ball) | {"horizon": known(ball.horizon)} for ball in self.balls
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
        scene = self.reference.scene
        text = "".join(text for ball in self.balls for text in ball.digits(scene))
        kept = sum(map(str.isdigit, text))
        return kept, kept + text.count(UNKNOWN)

    @property
    def same(self) -> float:
        """The share of the runs in which every ball has the same contacts in the same order."""
        return float(self.same_contacts.mean())


def _point(xy: Array) -> Point:
    return (float(xy[0]), float(xy[1]))


# -- samples ---------------------------------------------------------------------------------------


class Draws(NamedTuple):
    """Draws have starts (S, N, 2) in m, and the ``errors`` (S,) of further inputs by their names.

    Shots have their places in the chain, as in "turn.2" (degrees). ``rejected`` counts balls.
    """

    starts: Array
    errors: dict[str, Array]
    rejected: int


@dataclass(frozen=True)
class Study:
    """A study plays samples of a ``chain`` of shots, and compares them to ``agree`` (m)."""

    chain: tuple[Shot | None, ...]
    reference: Run
    agree: float
    law: Law
    uncertainty: Uncertainty

    def errors(self) -> dict[str, float]:
        """Return half the width of the range of every input, by its name, angles in degrees."""
        scene, own = self.reference.scene, self.uncertainty
        axes = (f"{axis}.{ball.id}" for ball in scene.balls for axis in "xy")
        found = dict(zip(axes, own.widths(scene).ravel().tolist(), strict=True))
        for k, _ in enumerate(self.chain, start=1):
            found |= {f"speed.{k}": own.speed, f"turn.{k}": math.degrees(own.angle)}
        return found | self.further

    @cached_property
    def further(self) -> dict[str, float]:
        """The half widths of further inputs by their names; each shot has a roll of its own."""
        found = dict(self.uncertainty.inputs)
        if "roll" in found:
            shots = range(1, len(self.chain) + 1)
            found |= dict.fromkeys((f"roll.{k}" for k in shots), found.pop("roll"))
        return found

    def draw(self, samples: int, seed: int, scale: float = 1.0) -> Draws:
        """Draw samples within this many times the uncertainty."""
        scene, own = self.reference.scene, self.uncertainty.scaled(scale)
        rng = np.random.default_rng(seed)
        shots = rng.uniform(-1.0, 1.0, (samples, len(self.chain), 2)) * (own.speed, own.angle)
        sampler = StartSampler(scene, own.widths(scene))
        starts, errors = sampler.starts(samples, rng), dict[str, Array]()
        for k, (speed, turn) in enumerate(shots.transpose(1, 2, 0), start=1):
            errors |= {f"speed.{k}": speed, f"turn.{k}": np.degrees(turn)}
        for name, width in self.further.items():
            row = TABLE[parts(name)[0]]
            value = 0.0 if row.of == SHOT else input_value(scene, name)
            drawn = value + scale * width * rng.uniform(-1.0, 1.0, samples)
            errors[name] = row.clipped(drawn) - value
        return Draws(starts, errors, sampler.overlapping)

    def play(
        self, draws: Draws, threads: int | None = None, done: Callable[[int], object] | None = None
    ) -> tuple[dict[str, NDArray[Any]], Mask]:
        """Play samples through all shots of the chain; return arrays, and which are finished."""
        scene, count = self.reference.scene, len(draws.starts)
        own = np.array([ball.velocity for ball in scene.balls])
        position, velocity = draws.starts, np.tile(own, (count, 1, 1))
        pocketed, finished = np.full(position.shape[:2], -1), np.ones(count, dtype=bool)
        inputs, carried = [name for name in self.uncertainty.inputs if name != "roll"], None
        others = {name: input_value(scene, name) + draws.errors[name] for name in inputs}
        for name in [name for name in inputs if name[:3] in ("vx.", "vy.")]:
            velocity[:, scene.index[name[3:]], "xy".index(name[1])] = others.pop(name)
        for k, shot in enumerate(self.chain, start=1):
            there = np.where(pocketed[..., np.newaxis] < 0, position, np.nan)
            ball, share = None, None
            if shot is not None:
                ball, share = scene.index[shot.ball], shot.roll + draws.errors.get(f"roll.{k}", 0.0)
                of_shot = draws.errors[f"speed.{k}"], draws.errors[f"turn.{k}"]
                velocity, is_struck = _struck(scene, shot, there, velocity, *of_shot)
                finished &= is_struck
            is_last = k == len(self.chain)
            roll = rolled(scene, velocity, ball, share, carried)
            source = read_source(scene, there, velocity, others, self.law, None, roll)
            out = empty(*there.shape[:2])
            found = Beside(self.reference, self.beside, out)
            tell = done if is_last and done else lambda _: None
            play_all(source, out, threads, tell, found if is_last else None)
            # Balls still move where time was up.
            velocity, carried = np.zeros(position.shape), np.zeros(position.shape)
            for s in () if is_last else np.flatnonzero(out.status == MAX_TIME).tolist():
                end = source.run(s, measures_policies=False).end
                velocity[s], carried[s] = end.velocity, end.roll or 0.0
            for s, i in np.argwhere(pocketed >= 0).tolist():  # They lie in their pockets.
                off = self.beside.path[:, i : i + 1] - position[s, i]
                found.departure[s, i] = found.first_off(off)[0]
            finished &= out.status <= MAX_TIME
            pocketed = np.where(pocketed < 0, out.pocketed, pocketed)
            position = np.where(np.isnan(out.final), position, out.final)
        arrays = {"ends": position, "left": found.departure, "same_contacts": found.same}
        return arrays | {"pocketed": pocketed}, finished

    @cached_property
    def beside(self) -> Reference:
        """Return the reference run as samples are compared with it."""
        return reference_of(self.reference, self.agree)


def read_study(
    scene: Scene, shot: Shot | None, uncertainty: Uncertainty, law: str | Law | None = None
) -> Study:
    """Play the reference run; raise SettingError where the shot cannot be studied."""
    uncertainty = uncertainty.everywhere(scene)
    chain = [shot]
    while (first := chain[0]) and (before := shot_before(scene, first)):
        chain.insert(0, before)
    if shot is None and (uncertainty.speed or uncertainty.angle or "roll" in uncertainty.inputs):
        said = "there is no shot whose speed or angle (or roll) could be uncertain"
        raise SettingError(f"shot = none: {said}")
    for name in uncertainty.inputs:
        row_of("inputs", name, scene, (), chain[0])
    reference = simulate(scene, shot, solver=reference_solver().name, law=law)
    if reference.status in UNFINISHED:
        raise SettingError(f"shot = {reference.name}: {ENDS[reference.status]}")
    digit = 2.0 * float(uncertainty.widths(scene).max())
    agree = digit or scene.units.to_si(10.0**-PRINTED_DECIMALS, "length")
    law = find_law(law or reference.scene.physics.law)
    return Study(tuple(chain), reference, agree, law, uncertainty)


def _struck(
    scene: Scene, shot: Shot, there: Array, velocity: Array, faster: Array, turn: Array
) -> tuple[Array, Mask]:
    """Return velocities (S, N, 2) as a shot begins, and where it can: its aim may be gone."""
    ball, own = scene.index[shot.ball], launched(scene, shot, there)
    if faster.any() or turn.any():
        speed = np.maximum(np.hypot(*own.T) + faster, 0.0)
        own = struck(own, {"speed": speed, "turn": turn})
    is_there = np.isfinite(there[:, ball]).all(axis=-1)
    is_struck = np.isfinite(own).all(axis=-1)
    velocity = velocity.copy()
    velocity[is_there & is_struck, ball] = own[is_there & is_struck]
    return velocity, np.asarray(is_struck | ~is_there)


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
    and if the reference run, or every other one, cannot be finished.

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
    arrays, finished = study.play(draws, threads, on_done)
    if not finished.any():
        raise SettingError(f"shot = {study.reference.name}: none of the samples could be finished")
    return Sensitivity(
        reference=study.reference,
        uncertainty=uncertainty,
        seed=seed,
        agree=study.agree,
        starts=draws.starts[finished],
        **{key: each[finished] for key, each in arrays.items()},
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
            "holds": known(self.holds),
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
    exact = reference_solver().name
    runs = simulate_all(study.reference.scene, study.chain, solver=exact, law=study.law)
    warned: dict[str, None] = {}
    for _, found in follow(dict(enumerate(runs, start=1)), tuple(errors)):
        warned |= dict.fromkeys(found.warnings)
    by_errors = found.final * np.array(list(errors.values()))
    sound = np.isfinite(by_errors).all() and bool(np.any(by_errors))
    holds = _linear_up_to(study, by_errors, seed) if sound else math.nan
    return Linear(study.reference, uncertainty, by_errors, holds, tuple(warned))


def _linear_up_to(study: Study, by_errors: Array, seed: int) -> float:
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
    played, finished = study.play(draws, 1)
    moved = draws.starts - [ball.position for ball in study.reference.scene.balls]
    drawn = np.column_stack((moved.reshape(TRIED, -1), *draws.errors.values()))
    widths = np.array(list(study.errors().values()))
    errors = drawn[:, widths > 0.0] / widths[widths > 0.0]
    said = np.einsum("nck,sk->snc", by_errors, errors)[finished]
    came = (played["ends"] - study.reference.end.position)[finished]
    off, size = (np.sqrt((each**2).sum(axis=(1, 2))) for each in (came - said, said))
    return bool((off <= OFF * size).mean() >= MOST)


def ellipse(covariance: Array, share: float = MOST, points: int = 100) -> Array:
    """Return the outline (points, 2) that a normal distribution has this share within.

    >>> outline = ellipse(np.diag([4.0, 1.0]))
    >>> np.abs(outline).max(axis=0).round(2).tolist()
    [4.89, 2.45]
    """
    sizes, axes = np.linalg.eigh(covariance)
    lengths = np.sqrt(-2.0 * math.log(1.0 - share) * np.maximum(sizes, 0.0))
    angle = np.linspace(0.0, 2.0 * math.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray((axes @ (lengths[:, np.newaxis] * circle)).T)
