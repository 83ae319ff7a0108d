"""This study plays many runs from slightly different starts, and measures how far ends spread.

The exact solver plays every draw, so the spread comes from the scene alone. For small errors the
derivatives D give the same without samples: if errors are uniform within +-h, the covariance of the
ends is D diag(h^2 / 3) D^T. Larger errors put contacts in another order; a few samples find out
where that begins. A shot that goes on from another one starts where that one ends. A shot that aims
at a ball is aimed once, in the reference run, because a player does not know the errors of the
starts; if it ``aims_anew``, each sample aims at where the ball lies there.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.laws import Law, find_law
from pool_pymunk.many.batch import STATUSES
from pool_pymunk.many.play import Results, play_all
from pool_pymunk.many.source import NOTHING, Source, is_gone, read_source
from pool_pymunk.many.workers import Workers, renamed, workers_of
from pool_pymunk.model import Point, Scene, Shot, inputs
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.plain import argument, flag, whole
from pool_pymunk.results.run import STATUSES as ENDS
from pool_pymunk.results.run import Run, points
from pool_pymunk.results.table import ResultTable
from pool_pymunk.solvers import (
    SettingError,
    find_shot,
    reference_solver,
    request,
    simulate_all,
)
from pool_pymunk.solvers.request import shot_before
from pool_pymunk.studies import Mask, known
from pool_pymunk.studies.changes import law_of
from pool_pymunk.studies.compare import Reference, play_beside, reference_of
from pool_pymunk.studies.derivatives import follow
from pool_pymunk.studies.uncertainty import StartSampler, Uncertainty, cause_of
from pool_pymunk.studies.variation import NOISE, Uniform, Variation, numbers, offsets

MAX_TIME = STATUSES.index("max_time")
PRINTED_DECIMALS = 2  # the decimals of a printed end, in the scenario's unit of length
# The linear answer holds if the share MOST of TRIED samples ends within a tenth (OFF) of it.
OFF, MOST, TRIED = 0.1, 0.95, 500
NARROWEST, WIDEST = 2.0**-40, 2.0**6  # times the uncertainty: the widths that are tried


@dataclass(frozen=True)
class Spread:
    """A spread tells how far one ball's ends lie apart (m); points are x and y.

    ``end`` is where the reference run ends. ``std`` are the standard deviations along x and y, and
    ``deviation`` is the larger one. 95 % of the ends lie between ``low`` and ``high`` along each.
    ``amplification`` is ``deviation`` over that of the starts (their root mean square over balls),
    None unless only starts are uncertain. ``horizon`` (s, to 1/256 of the run; inf: never) is when
    half of the runs have left the reference run by more than ``Sensitivity.agree``. ``pocketed``
    has the share of samples that end with the ball in a pocket, by the ids of those pockets.
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
        both = zip(self.end, self.std, strict=True)
        x, y = ([scene.units.from_si(each, "length") for each in axis] for axis in both)
        return digits_that_hold(*x), digits_that_hold(*y)


COLUMNS = (
    "shot", "ball", "start_x", "start_y", "end_x", "end_y", "std_x", "std_y", "low_x", "low_y",
    "high_x", "high_y", "amplification", "horizon", "samples", "seed", "pocketed",
)  # fmt: skip


def table(found: Sequence[Sensitivity]) -> ResultTable:
    """Return a row for each shot and ball, in SI; unknown amplifications and horizons are None."""
    return ResultTable(COLUMNS, [
        (one.reference.name, ball.ball, *ball.start, *ball.end, *ball.std, *ball.low, *ball.high,
         ball.amplification, known(ball.horizon), one.samples, one.seed,
         sum(ball.pocketed.values()))
        for one in found for ball in one.balls
    ])  # fmt: skip


def digits_that_hold(value: float, std: float) -> str:
    """Return ``value`` with two decimals, and ``?`` for every digit below twice ``std``.

    >>> digits_that_hold(14.76, 0.003), digits_that_hold(14.76, 0.04), digits_that_hold(14.76, 1.7)
    ('14.76', '14.7?', '1?.??')
    """
    text = f"{value:.{PRINTED_DECIMALS}f}"
    point = text.index(".")
    return "".join(
        "?" if c.isdigit() and std > 0.5 * 10.0 ** (point - k - (k < point)) else c
        for k, c in enumerate(text)
    )


@dataclass(frozen=True)
class Sensitivity:
    """A sensitivity holds the spread of one shot's ends.

    ``starts`` and ``ends`` (S, N, 2) are positions (m) of the samples that could be finished.
    ``left`` (S, N) is the time (s; inf: never) at which each ball first was more than ``agree`` (m)
    off the reference run. ``agree`` is one unit of the last digit that the starts are written to:
    twice the largest uncertainty, or, where no start is moved, the last digit of the printed ends.
    ``same_contacts`` (S,) says whether every ball met the same others in the same order, and
    ``pocketed`` (S, N) which pocket has each ball at the end (-1: none). ``rejected`` counts balls
    that overlapped something as drawn and were moved apart, ``unfinished`` samples left out.
    ``aims_anew`` says whether each sample aimed anew.
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
    aims_anew: bool = False

    def __repr__(self) -> str:
        worst, text = self.worst, self.reference.scene.units.text
        spread = f"ball {worst.ball} spreads most, by {text(worst.deviation, '.3g')}"
        return f"<Sensitivity of {self.reference.name!r}: {self.samples:,} samples; {spread}>"

    @property
    def table(self) -> ResultTable:
        """A row for each ball, in SI; unknown amplifications and horizons are None."""
        return table([self])

    @property
    def samples(self) -> int:
        """The number of samples that were finished."""
        return len(self.ends)

    @cached_property
    def balls(self) -> tuple[Spread, ...]:
        """Return each ball's spread, in the scene's order."""
        reference, pockets = self.reference, enumerate(self.reference.scene.pockets)
        alone = [*self.uncertainty.causes(reference.scene)] == ["starts"]
        low, high = map(points, np.quantile(self.ends, (0.025, 0.975), axis=0))
        # If all ends are equal, this is exactly 0.
        std = points((self.ends - reference.end.position).std(axis=0))
        horizon = np.quantile(self.left, 0.5, axis=0, method="higher").tolist()
        shares = {hole.id: (self.pocketed == k).mean(axis=0).tolist() for k, hole in pockets}
        start = points(np.array([breakpoints[0, 1:3] for breakpoints in reference.knots]))
        return tuple(
            Spread(
                id_, start[i], end, std[i], max(std[i]), low[i], high[i],
                max(std[i]) / self.deviation_of_starts if alone else None, horizon[i],
                {pocket: each[i] for pocket, each in shares.items() if each[i] > 0.0},
            )
            for i, (id_, end) in enumerate(reference.final.items())
        )  # fmt: skip

    def as_dict(self) -> dict[str, object]:
        """Return the shot as in the JSON of ``sensitivity --json``; null means never.

        It is in SI; the half width of the angle is in degrees, as it is typed and printed.
        """
        errors, counts = self.uncertainty, ("seed", "samples", "unfinished", "rejected")
        widths = errors.widths(self.reference.scene).tolist()
        of_shot = {"speed": errors.speed, "angle": math.degrees(errors.angle)}
        balls = {one.ball: asdict(one) | {"horizon": known(one.horizon)} for one in self.balls}
        return {
            "name": self.reference.name,
            "uncertainty": {"position": widths, **of_shot, **errors.inputs},
            **{key: getattr(self, key) for key in counts},
            "aims_anew": self.aims_anew,
            "same_contacts": self.same,
            "agree": self.agree,
            "horizon": known(self.horizon),
            "balls": balls,
            "wall_time": self.wall_time,
        }

    def write_npz(self, path: Path) -> None:
        """Write the samples' arrays and the balls' ids as a NumPy archive (SI)."""
        kept = "starts", "ends", "left", "same_contacts", "pocketed"
        balls = np.array([ball.ball for ball in self.balls])
        np.savez_compressed(path, **{key: getattr(self, key) for key in kept}, balls=balls)

    @property
    def deviation_of_starts(self) -> float:
        """The standard deviation of the starts (m), their root mean square over balls."""
        # A uniform draw within +-h has the variance h^2 / 3.
        widths = self.uncertainty.widths(self.reference.scene)
        return math.sqrt(float((widths**2).mean()) / 3.0)

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
        digits = sum(map(str.isdigit, text))
        return digits, digits + text.count("?")

    @property
    def same(self) -> float:
        """The share of the runs in which every ball has the same contacts in the same order."""
        return float(self.same_contacts.mean())


# -- samples ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Study:
    """A study plays samples of a ``chain`` of shots, and compares them with the reference run.

    ``widths`` are half the ranges of uncertain inputs, by names such as "turn.2", and ``places``
    (m) are those of the balls as the first shot of the chain begins. ``runs`` has the run of each
    shot of the chain, and the last one is the reference run. If a sample ``aims_anew``, its shots
    do not have the directions of these runs.
    """

    chain: tuple[Shot | None, ...]
    runs: tuple[Run, ...]
    beside: Reference
    law: Law
    widths: Mapping[str, float]
    places: Array
    aims_anew: bool

    @property
    def reference(self) -> Run:
        """The run of the scene's own numbers."""
        return self.runs[-1]

    def draw(self, samples: int, seed: int, scale: float = 1.0) -> tuple[dict[str, Array], int]:
        """Draw errors (S,) of the inputs by their names, and count balls that were moved apart."""
        scene, names = self.reference.scene, inputs.names_in(self.reference.scene)["position"]
        widths = np.array([scale * self.widths.get(name, 0.0) for name in names])
        sampler = StartSampler(scene, widths.reshape(-1, 2), self.places)
        off = sampler.starts(samples, seed) - self.places
        others = {name: Uniform(width) for name, width in self.widths.items() if name not in names}
        errors = {name: scale * each for name, each in numbers(others, samples, seed).items()}
        errors |= zip(names, off.reshape(samples, -1).T, strict=True)
        return errors, sampler.overlapping

    def play(
        self, errors: Mapping[str, Array], workers: Workers, done: Any = None
    ) -> tuple[dict[str, NDArray[Any]], Mask]:
        """Play samples through all shots of the chain; return arrays, and which are finished."""
        samples, last = self._samples(errors), len(self.chain)
        for k in range(1, last):
            source = self._source(samples, k)
            out = play_all(source, lambda _: None, workers)
            samples.take(out)
            samples.go_on(source, out.status == MAX_TIME)
        source, tell = self._source(samples, last), done or (lambda _: None)
        out, same, departure = play_beside(source, tell, self.beside, workers)
        for s, i in np.argwhere(samples.pocketed >= 0).tolist():  # in their pockets
            gap = self.beside.path[:, i : i + 1] - samples.position[s, i]
            departure[s, i] = self.beside.first_off(gap)[0]
        samples.take(out)
        arrays = {"starts": self.places + samples.off, "ends": samples.position, "left": departure}
        others = {"same_contacts": same, "pocketed": samples.pocketed}
        return arrays | others, samples.finished

    def _samples(self, errors: Mapping[str, Array]) -> Samples:
        """Return samples that have these errors, before the first shot."""
        scene, off = self.reference.scene, offsets(self.reference.scene, errors)
        values = {
            name: Variation(scene, {}, self.chain[0]).erring(name, errors[name])
            for name in self.widths.keys() - {*inputs.names_in(scene)["position"]}
            if inputs.TABLE[inputs.parts(name)[0]].of != inputs.SHOT
        }
        velocity = np.tile([ball.velocity for ball in scene.balls], (len(off), 1, 1))
        none, sound = np.full(off.shape[:2], NOTHING), np.ones(len(off), dtype=bool)
        return Samples(errors, off, values, self.places + off, velocity, None, none, sound)

    def _source(self, samples: Samples, k: int) -> Source:
        """Return the samples of shot ``k`` (from 1) of the chain as they begin."""
        scene, shot, errors = self.reference.scene, self.chain[k - 1], samples.errors
        its = Variation(scene, {}, shot, self.law, self.aims_anew)
        values: dict[str, Any] = {**samples.values}
        if shot is not None:
            ball, noise = its.ball, [errors.get(f"{n}.{k}", 0.0) for n in ("speed", "turn")]
            if shot.place is not None:
                samples.position[:, ball] = shot.place + samples.off[:, ball]
                samples.pocketed[:, ball] = NOTHING
            samples.velocity[:, ball] = self.runs[k - 1].knots[ball][0, 3:5]
            values["roll"] = shot.roll + errors.get(f"roll.{k}", 0.0)
            values |= zip(NOISE, noise, strict=True) if any(map(np.any, noise)) else ()
        there = np.where(samples.pocketed[..., np.newaxis] < 0, samples.position, np.nan)
        begun = its.begin(there, values, samples.velocity, samples.carried)
        is_lost = is_gone(begun.velocity) & ~is_gone(begun.position)  # It aims at no ball.
        samples.finished &= ~is_lost.any(axis=1)
        begun.position[is_lost], samples.values = np.nan, begun.vary
        return read_source(request(scene, law=self.law), *begun)


@dataclass
class Samples:
    """Samples are between two shots of a chain: their balls lie or move somewhere (S, N, 2).

    They have ``errors`` of their inputs, and with these the places of the first shot are ``off``
    (m). ``values`` (S,) are those of inputs that last. The rolls ``carried`` are those of balls
    that still move. ``pocketed`` (S, N) has their pockets, and ``finished`` (S,) says which samples
    could be played.
    """

    errors: Mapping[str, Array]
    off: Array
    values: dict[str, Array]
    position: Array
    velocity: Array
    carried: Array | None
    pocketed: NDArray[np.int_]
    finished: Mask

    def take(self, out: Results) -> None:
        """Take over where the balls of a shot have come to."""
        self.finished &= out.status <= MAX_TIME
        self.pocketed = np.where(self.pocketed < 0, out.pocketed, self.pocketed)
        self.position = np.where(np.isnan(out.final), self.position, out.final)

    def go_on(self, source: Source, is_cut: Mask) -> None:
        """Rest before the next shot; where time was up (S,), balls still move."""
        self.velocity, self.carried = np.zeros(self.off.shape), np.zeros(self.off.shape)
        for s in np.flatnonzero(is_cut).tolist():
            end = source.run(s, measures_policies=False).end
            self.velocity[s], self.carried[s] = end.velocity, end.roll or 0.0


def read_study(
    scene: Scene,
    shot: Shot | None,
    uncertainty: Uncertainty,
    law: str | Law | None = None,
    aims_anew: bool = False,
) -> Study:
    """Play the reference run; raise SettingError where the shot cannot be studied."""
    chain, widths = [shot], dict[str, float]()
    while (first := chain[0]) and (before := shot_before(scene, first)):
        chain.insert(0, before)
    for name, width in uncertainty.by_name(scene).items():
        row, _ = inputs.row_of("inputs", name, scene, (), first)
        if row.of == inputs.SHOT and shot is None:
            said = "there is no shot whose speed or angle (or roll) could be uncertain"
            raise SettingError(f"shot = none: {said}")
        shots = range(1, len(chain) + 1)
        its = [f"{name}.{k}" for k in shots] if row.of == inputs.SHOT else [name]
        widths |= dict.fromkeys(its, width)
    *_, reference = runs = tuple(
        simulate_all(scene, chain, solver=reference_solver().name, law=law)
    )
    if not reference.success:
        raise SettingError(f"shot = {reference.name}: {ENDS[reference.status]}")
    digit = 2.0 * float(uncertainty.widths(scene).max())
    agree = digit or scene.units.to_si(10.0**-PRINTED_DECIMALS, "length")
    law, beside = find_law(law or reference.scene.physics.law), reference_of(reference, agree)
    places = np.array(reference.scene.start(first).position)
    anew = argument("aims_anew", aims_anew, flag)
    return Study(tuple(chain), runs, beside, law, widths, places, anew)


def sensitivity(
    scene: Scene,
    shot: Shot | str | int | None,
    uncertainty: Uncertainty,
    samples: int = 1000,
    seed: int = 0,
    workers: int | Executor | Workers | None = None,
    *,
    law: str | Law | None = None,
    aims_anew: bool = False,
    on_done: Callable[[int], object] | None = None,
    threads: int | None = None,
    processes: int | None = None,
) -> Sensitivity:
    """Play ``samples`` starts drawn within ``uncertainty``, with the exact solver.

    ``shot`` is chosen as in :func:`~pool_pymunk.simulate`, and so is the ``law`` of every contact.
    A shot that aims at a ball is aimed once, in the scene as it is; with ``aims_anew`` it is aimed
    in each sample, at where the ball lies there.
    ``workers`` share the work, as in :func:`~pool_pymunk.simulate_many` (``threads`` and
    ``processes`` are old names), and the numbers depend only on ``seed``. ``on_done(n)`` is called
    whenever ``n`` more samples are done. Raises SettingError for settings that make no sense, for a
    ball that leaves no room for another, and if the reference run, or every other one, cannot be
    finished.

    >>> from pool_pymunk import load
    >>> found = sensitivity(load("report"), "Simulation 1", Uncertainty(0.005 * 0.0254), 200)
    >>> found.worst.ball, round(found.worst.deviation / 0.0254), found.worst.amplification > 400
    ('8', 2, True)
    """
    workers = renamed(workers, threads=threads, processes=processes)
    began = time.perf_counter()
    samples, seed = argument("samples", samples, whole(2)), argument("seed", seed, whole(0))
    study = read_study(scene, find_shot(scene, shot), uncertainty, law, aims_anew)
    errors, rejected = study.draw(samples, seed)
    with workers_of(workers) as several:
        arrays, finished = study.play(errors, several, on_done)
    if not finished.any():
        raise SettingError(f"shot = {study.reference.name}: none of the samples could be finished")
    arrays = {key: each[finished] for key, each in arrays.items()}
    return Sensitivity(
        study.reference, uncertainty, seed, study.beside.agree, **arrays, rejected=rejected,
        unfinished=int((~finished).sum()), wall_time=time.perf_counter() - began,
        aims_anew=study.aims_anew,
    )  # fmt: skip


def by_causes(
    found: Sensitivity,
    workers: int | Executor | Workers | None = None,
    on_done: Callable[[int], object] | None = None,
) -> dict[str, Sensitivity]:
    """Play the samples of a sensitivity again with each cause alone, by the names of the causes.

    The causes are "starts", "speed", "angle", and further inputs
    (:meth:`~pool_pymunk.Uncertainty.causes`). If there is only one, nothing is played.

    >>> from pool_pymunk import load
    >>> errors = Uncertainty(0.005 * 0.0254, angle=0.001)
    >>> alone = by_causes(sensitivity(load("report"), "Simulation 3", errors, 200))
    >>> [(name, round(each.worst.deviation / 0.0254, 3)) for name, each in alone.items()]
    [('starts', 0.003), ('angle', 0.027)]
    """
    run, samples = found.reference, found.samples + found.unfinished
    causes = found.uncertainty.causes(run.scene)
    if len(causes) < 2:
        return dict.fromkeys(causes, found)
    how = partial(sensitivity, law=law_of(run), aims_anew=found.aims_anew, on_done=on_done)
    with workers_of(workers) as several:
        return {
            name: how(run.scene, run.shot, one, samples, found.seed, several)
            for name, one in causes.items()
        }


# -- by derivatives --------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Linear:
    """A linear sensitivity has what errors within an uncertainty do to the ends, to first order.

    ``by_errors`` (N, 2, K) are the derivatives of the ends (m) by the K errors, in units of half
    their widths; ``causes`` say which of these (K) each cause has. ``holds`` is the multiple of
    the uncertainty within which 95 % of the samples end within a tenth of what the derivatives say:
    0 for none, nan if no derivatives are known. ``warnings`` say which are not known.
    """

    reference: Run
    uncertainty: Uncertainty
    by_errors: Array
    holds: float
    warnings: tuple[str, ...]
    causes: Mapping[str, list[bool]]

    @cached_property
    def covariance(self) -> Array:
        """Return the covariances of x and y of each ball's end (N, 2, 2), in m^2."""
        return np.asarray(self.by_errors @ self.by_errors.transpose(0, 2, 1) / 3.0)

    @property
    def std(self) -> Array:
        """Return the standard deviations (N, 2) of each ball's end along x and y, in m."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    def by_causes(self) -> dict[str, Array]:
        """Return the standard deviations (N, 2) that each cause makes alone, in m."""
        squares = self.by_errors**2 / 3.0
        return {cause: np.sqrt(squares[..., its].sum(axis=2)) for cause, its in self.causes.items()}

    @property
    def radius(self) -> float:
        """Return the largest error of a start (m) within which the linear answer holds."""
        return self.holds * float(self.uncertainty.widths(self.reference.scene).max())

    def as_dict(self) -> dict[str, object]:
        """Return the shot as in the JSON of ``sensitivity --linear --json``, in SI."""

        def by_ball(std: Array) -> dict[str, list[float] | None]:
            both = zip(self.reference.final, std.tolist(), strict=True)
            return {id_: each if np.isfinite(each).all() else None for id_, each in both}

        return {
            "std": by_ball(self.std),
            "causes": {cause: by_ball(std) for cause, std in self.by_causes().items()},
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
    aims_anew: bool = False,
) -> Linear:
    """Differentiate a shot's ends, and find out how far the derivatives can be believed.

    The errors and the arguments are those of :func:`~pool_pymunk.sensitivity`, and so is what it
    raises.

    >>> from pool_pymunk import load
    >>> found = linear(load("report"), "Simulation 3", Uncertainty(0.005 * 0.0254))
    >>> round(float(found.std.max()) / 0.0254, 4), found.holds > 1.0
    (0.0034, True)
    """
    study = read_study(scene, find_shot(scene, shot), uncertainty, law, aims_anew)
    runs = dict(enumerate(study.runs, start=1))
    *_, last = chain = [found for _, found in follow(runs, tuple(study.widths), study.aims_anew)]
    warned = dict.fromkeys(warning for found in chain for warning in found.warnings)
    by_errors = last.final * np.array(list(study.widths.values()))
    low, high = least, _ = math.log2(NARROWEST), math.log2(WIDEST)
    sound = np.isfinite(by_errors).all() and bool(np.any(by_errors))
    while sound and high - low > 0.1:
        middle = (low + high) / 2.0
        holds_here = _holds(study, 2.0**middle, by_errors, seed)
        low, high = (middle, high) if holds_here else (low, middle)
    width = 2.0**low if low > least else 0.0
    holds = float(f"{width:.2g}") if sound else math.nan
    of = [cause_of(name) for name in study.widths]
    causes = {cause: [each == cause for each in of] for cause in of}
    return Linear(study.reference, uncertainty, by_errors, holds, tuple(warned), causes)


def _holds(study: Study, scale: float, by_errors: Array, seed: int) -> bool:
    """Tell whether most samples end within a tenth of what the derivatives say."""
    errors, _ = study.draw(TRIED, seed, scale)
    played, finished = study.play(errors, Workers(None))
    shares = np.array([errors[name] / width for name, width in study.widths.items()])
    said = np.einsum("nck,ks->snc", by_errors, shares)[finished]
    came = (played["ends"] - study.reference.end.position)[finished]
    off, size = (np.sqrt((each**2).sum(axis=(1, 2))) for each in (came - said, said))
    return bool((off <= OFF * size).mean() >= MOST)


def ellipse(covariance: Array, share: float = MOST, points: int = 100) -> Array:
    """Return the outline (points, 2) within which this share of a normal distribution lies.

    >>> outline = ellipse(np.diag([4.0, 1.0]))
    >>> np.abs(outline).max(axis=0).round(2).tolist()
    [4.89, 2.45]
    """
    sizes, axes = np.linalg.eigh(covariance)
    lengths = np.sqrt(-2.0 * math.log(1.0 - share) * np.maximum(sizes, 0.0))
    angle = np.linspace(0.0, 2.0 * math.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray((axes @ (lengths[:, np.newaxis] * circle)).T)
