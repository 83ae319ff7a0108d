"""This study plays many runs from slightly different starts, and measures how far ends spread.

The exact solver plays every draw, so the spread comes from the scene alone. For small errors
derivatives say the same at once: for errors drawn uniformly within +-h the covariance of the ends
is D diag(h^2 / 3) D^T. Larger errors put contacts in another order; a few samples find out where
that begins. A shot that aims at a ball aims at where that ball is in each sample, and a shot that
goes on from the one before starts where that one ends, played from the same sample.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.batch import STATUSES
from pool_pymunk.fast.many import empty, play_all
from pool_pymunk.fast.shots import read_source
from pool_pymunk.model import Point, Scene, Shot, inputs
from pool_pymunk.model.plain import argument, whole
from pool_pymunk.physics.laws import Law, find_law
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import STATUSES as ENDS
from pool_pymunk.results.run import Run, points, write_rows
from pool_pymunk.solvers import SettingError, find_shot, reference_solver, simulate, simulate_all
from pool_pymunk.solvers.request import shot_before
from pool_pymunk.studies import Mask, known
from pool_pymunk.studies.changes import law_of
from pool_pymunk.studies.compare import Beside, Reference, reference_of
from pool_pymunk.studies.derivatives import follow
from pool_pymunk.studies.uncertainty import StartSampler, Uncertainty, launched

MAX_TIME = STATUSES.index("max_time")
PRINTED_DECIMALS = 2  # the decimals of a printed end, in the scenario's unit of length
# The linear answer holds where this share of TRIED samples ends within a tenth (OFF) of it.
OFF, MOST, TRIED = 0.1, 0.95, 500
NARROWEST, WIDEST = 2.0**-40, 2.0**6  # widths that are tried, in those of the uncertainty


@dataclass(frozen=True)
class Spread:
    """A spread tells how far one ball's ends lie apart (m); points are x and y.

    ``end`` is where the reference run ends. ``std`` are the standard deviations along x and y, and
    ``deviation`` is the larger one. 95 % of the ends lie between ``low`` and ``high`` along each.
    ``amplification`` is ``deviation`` over that of the starts (their root mean square over balls),
    None where no start is moved, or something else, too. ``horizon`` (s, to 1/256 of the run; inf:
    never) is when half of the runs have left the reference run by more than
    ``Sensitivity.agree``. ``pocketed`` has the share of samples that end with the ball in a pocket,
    by the ids of the pockets that have it at all.
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


def write_csv(found: Sequence[Sensitivity], path: Path) -> None:
    """Write one row a shot and ball, in SI; leave out amplifications and horizons not known."""
    write_rows(path, COLUMNS, (
        (one.reference.name, ball.ball, *ball.start, *ball.end, *ball.std, *ball.low, *ball.high,
         ball.amplification, known(ball.horizon), one.samples, one.seed,
         sum(ball.pocketed.values()))
        for one in found for ball in one.balls
    ))  # fmt: skip


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
        """Return the shot as in the JSON of ``sensitivity --json``, in SI; null means never."""
        errors, counts = self.uncertainty, ("seed", "samples", "unfinished", "rejected")
        widths = errors.widths(self.reference.scene).tolist()
        of_shot = {"speed": errors.speed, "angle": errors.angle}
        balls = {one.ball: asdict(one) | {"horizon": known(one.horizon)} for one in self.balls}
        return {
            "name": self.reference.name,
            "uncertainty": {"position": widths, **of_shot, **errors.inputs},
            **{key: getattr(self, key) for key in counts},
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
    """A study plays samples of a ``chain`` of shots, and compares them with the reference run."""

    chain: tuple[Shot | None, ...]
    reference: Run
    beside: Reference
    law: Law
    uncertainty: Uncertainty

    def errors(self) -> dict[str, float]:
        """Return half the width of the range of every input, by its name, angles in degrees."""
        scene, own = self.reference.scene, self.uncertainty
        widths = own.widths(scene).ravel().tolist()
        found = dict(zip(inputs.names_in(scene)["position"], widths, strict=True))
        for k in range(1, len(self.chain) + 1):
            found |= {f"speed.{k}": own.speed, f"turn.{k}": math.degrees(own.angle)}
        return found | self.further

    @property
    def places(self) -> tuple[Point, ...]:
        """The places of the balls as the first shot of the chain begins (m)."""
        return self.reference.scene.start(self.chain[0]).position

    @property
    def further(self) -> dict[str, float]:
        """The half widths of further inputs by their names; each shot has a roll of its own."""
        own, shots = self.uncertainty.inputs, range(1, len(self.chain) + 1)
        rolls = {f"roll.{k}": own["roll"] for k in shots if "roll" in own}
        return {name: width for name, width in own.items() if name != "roll"} | rolls

    def draw(
        self, samples: int, seed: int, scale: float = 1.0
    ) -> tuple[Array, dict[str, Array], int]:
        """Draw starts (S, N, 2) in m, and errors (S,) such as "turn.2"; count balls moved apart."""
        scene, own = self.reference.scene, self.uncertainty.scaled(scale)
        rng = np.random.default_rng(seed)
        shots = rng.uniform(-1.0, 1.0, (samples, len(self.chain), 2)) * (own.speed, own.angle)
        sampler = StartSampler(scene, own.widths(scene), self.places)
        starts, errors = sampler.starts(samples, rng), dict[str, Array]()
        for k, (speed, turn) in enumerate(shots.transpose(1, 2, 0), start=1):
            errors |= {f"speed.{k}": speed, f"turn.{k}": np.degrees(turn)}
        for name, width in self.further.items():
            row = inputs.TABLE[inputs.parts(name)[0]]
            value = 0.0 if row.of == inputs.SHOT else inputs.input_value(scene, name)
            drawn = value + scale * width * rng.uniform(-1.0, 1.0, samples)
            errors[name] = row.clipped(drawn) - value
        return starts, errors, sampler.overlapping

    def play(
        self, position: Array, errors: Mapping[str, Array], threads: int | None, done: Any = None
    ) -> tuple[dict[str, NDArray[Any]], Mask]:
        """Play samples through all shots of the chain; return arrays, and which are finished."""
        scene, count = self.reference.scene, len(position)
        velocity = np.tile([ball.velocity for ball in scene.balls], (count, 1, 1))
        pocketed, finished = np.full(position.shape[:2], -1), np.ones(count, dtype=bool)
        carried = None
        others = {
            name: inputs.input_value(scene, name) + errors[name]
            for name in self.uncertainty.inputs if name != "roll"
        }  # fmt: skip
        for name in [name for name in others if name[:3] in ("vx.", "vy.")]:
            velocity[:, scene.index[name[3:]], "xy".index(name[1])] = others.pop(name)
        errors_of_places, position = position - self.places, position.copy()
        for k, shot in enumerate(self.chain, start=1):
            if shot is not None and shot.place is not None:
                i = scene.index[shot.ball]
                position[:, i], pocketed[:, i] = shot.place + errors_of_places[:, i], -1
            there = np.where(pocketed[..., np.newaxis] < 0, position, np.nan)
            ball, share = None, None
            if shot is not None:
                ball, share = scene.index[shot.ball], shot.roll + errors.get(f"roll.{k}", 0.0)
                of_shot = errors[f"speed.{k}"], errors[f"turn.{k}"]
                velocity, is_struck = _struck(scene, shot, there, velocity, of_shot)
                finished &= is_struck
            is_last = k == len(self.chain)
            roll = inputs.rolled(scene, velocity, ball, share, carried)
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
        inputs.row_of("inputs", name, scene, (), first)
    reference = simulate(scene, shot, solver=reference_solver().name, law=law)
    if not reference.success:
        raise SettingError(f"shot = {reference.name}: {ENDS[reference.status]}")
    digit = 2.0 * float(uncertainty.widths(scene).max())
    agree = digit or scene.units.to_si(10.0**-PRINTED_DECIMALS, "length")
    law, beside = find_law(law or reference.scene.physics.law), reference_of(reference, agree)
    return Study(tuple(chain), reference, beside, law, uncertainty)


def _struck(
    scene: Scene, shot: Shot, there: Array, velocity: Array, change: tuple[Array, Array]
) -> tuple[Array, Mask]:
    """Return velocities (S, N, 2) as a shot begins, and where it can: its aim may be gone."""
    ball, own, (faster, turn) = scene.index[shot.ball], launched(scene, shot, there), change
    if faster.any() or turn.any():
        speed = np.maximum(np.hypot(*own.T) + faster, 0.0)
        own = inputs.struck(own, {"speed": speed, "turn": turn})
    is_there, is_struck = (np.isfinite(each).all(axis=-1) for each in (there[:, ball], own))
    both, velocity = is_there & is_struck, velocity.copy()
    velocity[both, ball] = own[both]
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
    ``threads`` (None: one for each core; ``processes`` is its old name) share the work, and the
    numbers depend only on ``seed``. With numba installed (``pip install 'pool-pymunk[fast]'``)
    samples are compiled, and give the same numbers. ``on_done(n)`` is called whenever ``n`` more
    samples are done. Raises SettingError for settings that make no sense, for a ball that leaves no
    room for another, and if the reference run, or every other one, cannot be finished.

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
    starts, errors, rejected = study.draw(samples, seed)
    arrays, finished = study.play(starts, errors, threads, on_done)
    if not finished.any():
        raise SettingError(f"shot = {study.reference.name}: none of the samples could be finished")
    arrays = {key: each[finished] for key, each in (arrays | {"starts": starts}).items()}
    return Sensitivity(
        study.reference, uncertainty, seed, study.beside.agree, **arrays, rejected=rejected,
        unfinished=int((~finished).sum()), wall_time=time.perf_counter() - began,
    )  # fmt: skip


def by_causes(
    found: Sensitivity,
    threads: int | None = None,
    on_done: Callable[[int], object] | None = None,
) -> dict[str, Sensitivity]:
    """Play the samples of a sensitivity again with each cause alone, by the names of the causes.

    The causes are "starts", "speed", "angle", and further inputs
    (:meth:`~pool_pymunk.Uncertainty.causes`). Where there is one alone, nothing is played.

    >>> from pool_pymunk import load
    >>> errors = Uncertainty(0.005 * 0.0254, angle=0.001)
    >>> alone = by_causes(sensitivity(load("report"), "Simulation 3", errors, 200))
    >>> [(name, round(each.worst.deviation / 0.0254, 3)) for name, each in alone.items()]
    [('starts', 0.003), ('angle', 0.028)]
    """
    run, samples = found.reference, found.samples + found.unfinished
    causes = found.uncertainty.causes(run.scene)
    if len(causes) < 2:
        return dict.fromkeys(causes, found)
    how, law = (samples, found.seed, threads), law_of(run)
    return {
        name: sensitivity(run.scene, run.shot, one, *how, law=law, on_done=on_done)
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
) -> Linear:
    """Differentiate a shot's ends, and find out how far the derivatives can be believed.

    The errors and the arguments are those of :func:`~pool_pymunk.sensitivity`, and so is what it
    raises.

    >>> from pool_pymunk import load
    >>> found = linear(load("report"), "Simulation 3", Uncertainty(0.005 * 0.0254))
    >>> round(float(found.std.max()) / 0.0254, 4), found.holds > 1.0
    (0.0034, True)
    """
    study = read_study(scene, find_shot(scene, shot), uncertainty, law)
    errors = {name: width for name, width in study.errors().items() if width > 0.0}
    exact = reference_solver().name
    runs = simulate_all(study.reference.scene, study.chain, solver=exact, law=study.law)
    *_, last = chain = [found for _, found in follow(dict(enumerate(runs, start=1)), tuple(errors))]
    warned = dict.fromkeys(warning for found in chain for warning in found.warnings)
    by_errors = last.final * np.array(list(errors.values()))
    low, high = least, _ = math.log2(NARROWEST), math.log2(WIDEST)
    sound = np.isfinite(by_errors).all() and bool(np.any(by_errors))
    while sound and high - low > 0.1:
        middle = (low + high) / 2.0
        holds_here = _holds(study, 2.0**middle, by_errors, seed)
        low, high = (middle, high) if holds_here else (low, middle)
    width = 2.0**low if low > least else 0.0
    holds = float(f"{width:.2g}") if sound else math.nan
    alone = {
        cause: replace(study, uncertainty=one.everywhere(scene)).errors()
        for cause, one in uncertainty.causes(scene).items()
    }
    causes = {cause: [own.get(n, 0.0) > 0.0 for n in errors] for cause, own in alone.items()}
    return Linear(study.reference, uncertainty, by_errors, holds, tuple(warned), causes)


def _holds(study: Study, scale: float, by_errors: Array, seed: int) -> bool:
    """Tell whether most samples end within a tenth of what the derivatives say."""
    starts, errors, _ = study.draw(TRIED, seed, scale)
    played, finished = study.play(starts, errors, 1)
    drawn = np.column_stack(((starts - study.places).reshape(TRIED, -1), *errors.values()))
    widths = np.array(list(study.errors().values()))
    shares = drawn[:, widths > 0.0] / widths[widths > 0.0]
    said = np.einsum("nck,sk->snc", by_errors, shares)[finished]
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
