"""This study plays many runs from slightly different starts, and measures how far ends spread.

So it tells what the uncertainty of the inputs does to the ends. The exact solver plays every draw
of the inputs, so the spread comes from the scene alone. A shot that aims at a ball aims at where
that ball is in each draw. A shot that goes on from the one before starts where that one ends,
played from the same draw.
"""

from __future__ import annotations

import csv
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast import compiled
from pool_pymunk.fast.loop import Model
from pool_pymunk.fast.many import empty, play_compiled
from pool_pymunk.fast.shots import read_source
from pool_pymunk.fast.tables import can_compile
from pool_pymunk.model import Point, Scene, Shot, State
from pool_pymunk.physics.laws import Law, find_law
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import STATUSES, Event, Run
from pool_pymunk.safety.interrupts import block_sigint, raise_pending
from pool_pymunk.solvers import (
    SettingError,
    find_shot,
    request,
    simulate,
    simulate_all,
    yardstick,
)
from pool_pymunk.studies.compare import contact_order, contacts
from pool_pymunk.studies.starts import StartSampler
from pool_pymunk.studies.uncertainty import Uncertainty

Mask = NDArray[np.bool_]

UNFINISHED = ("max_events", "non_finite")
FEW = 500  # From so many samples on, they are compiled.
CHUNK = 25  # A process plays so many samples before it reports.
INSTANTS = 256  # A run is compared at so many times, besides its start.
UNKNOWN = "?"
PRINTED_DECIMALS = 2  # the decimals of a printed end, in the scenario's unit of length


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
        np.savez_compressed(
            path,
            starts=self.starts,
            ends=self.ends,
            left=self.left,
            same_contacts=self.same_contacts,
            pocketed=self.pocketed,
            balls=np.array([ball.ball for ball in self.balls]),
        )

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
    processes: int | None = None,
    *,
    law: str | Law | None = None,
    on_done: Callable[[int], object] | None = None,
) -> Sensitivity:
    """Play ``samples`` starts drawn within ``uncertainty``, with the exact solver.

    ``shot`` is chosen as in :func:`~pool_pymunk.simulate`, and so is the ``law`` of every contact,
    which other processes must be able to import. ``processes`` (None: one for each core) share the
    work. The numbers depend only on ``seed``, not on how many processes there are. With
    numba installed (``pip install 'pool-pymunk[fast]'``) from 500 samples on they are compiled,
    and give the same numbers. Where Python starts processes afresh (Windows, macOS), a script must
    call this under ``if __name__ == "__main__"``. ``on_done(n)`` is called whenever ``n`` more
    samples are done.

    Raises SettingError for settings that make no sense, for a ball that leaves no room for another,
    and if the unperturbed run, or every other one, cannot be finished.

    >>> from pool_pymunk import load
    >>> found = sensitivity(load("report"), "Simulation 1", Uncertainty(0.005 * 0.0254), 200,
    ...                     processes=1)
    >>> found.worst.ball, round(found.worst.deviation / 0.0254), found.worst.amplification > 400
    ('8', 2, True)
    """
    if samples < 2:
        raise SettingError(f"samples = {samples}: must be 2 or more")
    if seed < 0:
        raise SettingError(f"seed = {seed}: must be 0 or more")
    began = time.perf_counter()
    study = read_study(scene, find_shot(scene, shot), uncertainty, law)
    starts, errors, rejected = _draw(study, uncertainty, samples, np.random.default_rng(seed))
    cores, done = _processes(processes), on_done or _nothing
    played = _play_samples(study, starts, errors, cores, done)
    if not played.finished.any():
        raise SettingError(f"shot = {study.reference.name}: none of the samples could be finished")
    finished = played.finished
    return Sensitivity(
        reference=study.reference,
        uncertainty=uncertainty,
        seed=seed,
        agree=study.agree,
        starts=starts[finished],
        ends=played.ends[finished],
        left=played.left[finished],
        same_contacts=played.same_contacts[finished],
        pocketed=played.pocketed[finished],
        rejected=rejected,
        unfinished=int((~finished).sum()),
        wall_time=time.perf_counter() - began,
    )


class Sampled(NamedTuple):
    """Samples have starts (S, N, 2) in m, errors of speed and angle (S, K, 2), and ends (S, N, 2).

    The errors of the K shots of a chain are in m/s and rad.
    """

    starts: Array
    errors: Array
    ends: Array


@dataclass(frozen=True)
class Study:
    """A study holds what a process needs to play samples of one shot.

    ``chain`` are the shots up to it.
    """

    chain: tuple[Shot | None, ...]
    reference: Run
    agree: float
    law: Law

    def runs(self) -> list[Run]:
        """Play the unperturbed shots up to this one, each from where the one before ends."""
        scene, exact = self.reference.scene, yardstick().name
        return list(simulate_all(scene, self.chain, solver=exact, law=self.law))

    def sample(self, uncertainty: Uncertainty, count: int, seed: int) -> Sampled:
        """Play so many starts drawn within an uncertainty; leave out what cannot be finished."""
        starts, errors, _ = _draw(self, uncertainty, count, np.random.default_rng(seed))
        played = _play_samples(self, starts, errors, 1, _nothing)
        finished = played.finished
        return Sampled(starts[finished], errors[finished], played.ends[finished])

    @property
    def can_be_compiled(self) -> bool:
        """Tell whether samples can be played compiled."""
        return compiled.is_there() and can_compile(self.reference.scene, self.law)

    @cached_property
    def model(self) -> Model:
        """Return the unperturbed run as compiled samples are compared with it."""
        run = self.reference
        seen: list[list[tuple[int, int]]] = [[] for _ in run.scene.balls]
        for event in contacts(run):
            one, *other = (run.scene.index[id_] for id_ in event.balls)
            for i in other:
                place = len(seen[one]) + 1, len(seen[i]) + 1
                seen[one].append((i, place[1]))
                seen[i].append((one, place[0]))
            if not other:
                seen[one].append((-1 - self._wall(event), 0))
        most = max(map(len, seen))
        rows = np.zeros((2, len(seen), most), dtype=np.int64)
        for i, each in enumerate(seen):
            rows[:, i, : len(each)] = np.array(each, dtype=np.int64).reshape(-1, 2).T
        counts = np.array([len(each) for each in seen])
        return Model(self.times, np.array(self.path), self.agree, rows[0], rows[1], counts)

    def _wall(self, event: Event) -> int:
        """Return the number of a cushion or pocket among all walls: cushions come first."""
        scene = self.reference.scene
        if event.cushion is not None:
            return event.cushion
        cushions = len(scene.table.edges) if scene.table else 0
        return cushions + [hole.id for hole in scene.pockets].index(str(event.pocket))

    @cached_property
    def times(self) -> Array:
        """Return the times (s) at which runs are compared."""
        return np.linspace(0.0, self.reference.duration, INSTANTS + 1)

    @cached_property
    def path(self) -> Array:
        """Return where the unperturbed run has the balls at ``times`` (T, N, 2), in m."""
        return self.reference.at(self.times)[0]


def read_study(
    scene: Scene, shot: Shot | None, uncertainty: Uncertainty, law: str | Law | None = None
) -> Study:
    """Play the unperturbed shot; raise SettingError where it cannot be studied."""
    chain: list[Shot | None] = [shot]
    while (first := chain[0]) is not None and first.from_previous:
        chain.insert(0, scene.shots[scene.shots.index(first) - 1])
    if shot is None and (uncertainty.speed or uncertainty.angle):
        raise SettingError("shot = none: there is no shot whose speed or angle could be uncertain")
    reference = simulate(scene, shot, solver=yardstick().name, law=law)
    if reference.status in UNFINISHED:
        raise SettingError(f"shot = {reference.name}: {STATUSES[reference.status]}")
    digit = 2.0 * float(uncertainty.widths(scene).max())
    agree = digit or scene.units.to_si(10.0**-PRINTED_DECIMALS, "length")
    return Study(tuple(chain), reference, agree, find_law(law or reference.scene.physics.law))


def _draw(
    study: Study, uncertainty: Uncertainty, samples: int, rng: np.random.Generator
) -> tuple[Array, Array, int]:
    """Draw starts (S, N, 2), and the errors of speed and angle of each shot (S, K, 2).

    Also return how many balls overlapped something as they were drawn.
    """
    scene = study.reference.scene
    errors = rng.uniform(-1.0, 1.0, (samples, len(study.chain), 2))
    errors *= (uncertainty.speed, uncertainty.angle)
    sampler = StartSampler(scene, uncertainty.widths(scene))
    starts = sampler.starts(samples, rng)
    return starts, errors, sampler.overlapping


# -- playing them ----------------------------------------------------------------------------------


class _Played(NamedTuple):
    """These are the results of some samples, in arrays as in :class:`Sensitivity`."""

    ends: Array
    left: Array
    same_contacts: Mask
    pocketed: NDArray[np.int_]
    finished: Mask


def _nothing(count: int) -> None:
    """Take no note that samples are done."""


def _play_samples(
    study: Study, starts: Array, errors: Array, cores: int, done: Callable[[int], object]
) -> _Played:
    """Play all samples: compiled, if they are many and can be."""
    if len(starts) >= FEW and study.can_be_compiled:
        return _play_compiled(study, starts, errors, cores, done)
    return _play_in_python(study, starts, errors, cores, done)


def _play_in_python(
    study: Study,
    starts: Array,
    errors: Array,
    processes: int,
    on_done: Callable[[int], object],
) -> _Played:
    """Play all samples by the exact solver, in processes."""
    parts = []
    for part in _play_all(study, starts, errors, processes):
        parts.append(part)
        on_done(len(part.finished))
    return _Played(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _play_compiled(
    study: Study,
    starts: Array,
    errors: Array,
    threads: int,
    on_done: Callable[[int], object],
) -> _Played:
    """Play all samples compiled; those that are hard take the exact solver from their start."""
    scene, count = study.reference.scene, len(starts)
    position, velocity = starts, np.tile([ball.velocity for ball in scene.balls], (count, 1, 1))
    pocketed = np.full(starts.shape[:2], -1)
    hard = np.zeros(count, dtype=bool)
    for k, shot in enumerate(study.chain):
        is_last = k == len(study.chain) - 1
        velocity = _struck_all(scene, shot, position, velocity, pocketed, errors[:, k])
        places = np.where(pocketed[..., np.newaxis] < 0, position, np.nan)
        source = read_source(scene, places, velocity, None, study.law, None)
        out = empty(count, len(scene.balls), is_last)
        play_compiled(
            source, out, threads, on_done if is_last else _nothing, study.model if is_last else None
        )
        hard |= out.status != 0 if not is_last else out.status < 0
        if is_last:
            for s, i in np.argwhere(pocketed >= 0).tolist():  # These balls lie in their pockets.
                out.left[s, i] = _first_off(study, study.path[:, i : i + 1] - position[s, i])[0]
        pocketed = np.where(pocketed < 0, out.pocketed, pocketed)
        position = np.where(np.isnan(out.final), position, out.final)
        velocity = np.zeros_like(velocity)
    played = _Played(position, out.left, out.same, pocketed, np.ones(count, dtype=bool))
    if hard.any():
        again = _play_in_python(study, starts[hard], errors[hard], threads, _nothing)
        for mine, theirs in zip(played, again, strict=True):
            mine[hard] = theirs
    return played


def _struck_all(
    scene: Scene,
    shot: Shot | None,
    position: Array,
    velocity: Array,
    pocketed: NDArray[np.int_],
    errors: Array,
) -> Array:
    """Return the velocities (S, N, 2) of all samples as a shot begins."""
    if shot is None:
        return velocity
    velocity, ball = velocity.copy(), scene.index[shot.ball]
    there = pocketed[:, ball] < 0
    if shot.launch is not None and not errors.any():
        velocity[there, ball] = shot.launch
        return velocity
    ids = np.array([each.id for each in scene.balls], dtype=object)
    speeds = [(0.0, 0.0)] * len(ids)
    for s in np.flatnonzero(there).tolist():
        places = tuple((x, y) for x, y in position[s].tolist())
        state = State(places, tuple(speeds), frozenset(ids[pocketed[s] >= 0]))
        struck = _struck(scene, shot, state, *errors[s].tolist())
        velocity[s, ball] = scene.start(struck, state).velocity[ball]
    return velocity


def _processes(asked: int | None) -> int:
    if asked is None:
        return (
            len(os.sched_getaffinity(0))
            if hasattr(os, "sched_getaffinity")
            else os.cpu_count() or 1
        )
    if asked < 1:
        raise SettingError(f"processes = {asked}: must be 1 or more")
    return asked


def _play_all(study: Study, starts: Array, errors: Array, processes: int) -> Iterator[_Played]:
    """Play all samples, chunk by chunk, in their order."""
    chunks = [slice(k, k + CHUNK) for k in range(0, len(starts), CHUNK)]
    play = partial(_play, study)
    if processes == 1 or len(chunks) == 1:
        yield from map(play, (starts[c] for c in chunks), (errors[c] for c in chunks))
        return
    from concurrent.futures import ProcessPoolExecutor

    pool = ProcessPoolExecutor(min(processes, len(chunks)))
    try:
        with block_sigint():
            played = pool.map(play, [starts[c] for c in chunks], [errors[c] for c in chunks])
        for part in played:
            raise_pending()
            yield part
    finally:
        pool.shutdown(cancel_futures=True)


def _play(study: Study, starts: Array, errors: Array) -> _Played:
    """Play some samples: their starts (S, N, 2) and errors of speed and angle (S, K, 2)."""
    order = contact_order(study.reference)
    ends, left, same, taken, finished = [], [], [], [], []
    for start, error in zip(starts.tolist(), errors.tolist(), strict=True):
        run, pocketed = _run(study, start, error)
        ends.append(run.end.position)
        left.append(_left(study, run))
        same.append(contact_order(run) == order)
        taken.append(pocketed)
        finished.append(run.status not in UNFINISHED)
    return _Played(*map(np.array, (ends, left, same, taken, finished)))


def _run(
    study: Study, start: Sequence[Sequence[float]], errors: Sequence[Sequence[float]]
) -> tuple[Run, list[int]]:
    """Play one sample: every shot of the chain from where the one before ended.

    Return the last run, and for each ball the number of the pocket that has it then, or -1.
    """
    scene = study.reference.scene
    numbers = {pocket.id: k for k, pocket in enumerate(scene.pockets)}
    pocketed = [-1] * len(scene.balls)
    asked = request(scene, yardstick().name, law=study.law)
    asked = asked._replace(settings=asked.settings._replace(measures_policies=False))
    state = State(tuple((x, y) for x, y in start), tuple(ball.velocity for ball in scene.balls))
    for shot, (faster, turned) in zip(study.chain, errors, strict=True):
        struck = _struck(scene, shot, state, faster, turned)
        if struck is not None and struck.ball in state.off:  # It cannot be struck any more.
            struck = None
        run = asked.play(struck, state)
        for id_, pocket in run.pocketed.items():
            pocketed[scene.index[id_]] = numbers[pocket]
        state = run.end
    return run, pocketed


def _struck(
    scene: Scene, shot: Shot | None, state: State, faster: float, turned: float
) -> Shot | None:
    """Return the shot with its velocity changed by ``faster`` (m/s) and ``turned`` (rad)."""
    if shot is None or (faster == 0.0 and turned == 0.0):
        return shot
    vx, vy = scene.start(shot, state).velocity[scene.index[shot.ball]]
    speed, angle = max(math.hypot(vx, vy) + faster, 0.0), math.atan2(vy, vx) + turned
    return Shot(shot.name, shot.ball, (speed * math.cos(angle), speed * math.sin(angle)))


def _left(study: Study, run: Run) -> Array:
    """Return when (s; inf: never) each ball (N,) first was ``agree`` off the unperturbed run."""
    return _first_off(study, run.at(study.times)[0] - study.path)


def _first_off(study: Study, off: Array) -> Array:
    """Return when (s; inf: never) each ball (N,) is first ``agree`` away, by offsets (T, N, 2)."""
    apart = np.hypot(off[..., 0], off[..., 1]) > study.agree
    return np.where(apart.any(axis=0), study.times[apart.argmax(axis=0)], math.inf)
