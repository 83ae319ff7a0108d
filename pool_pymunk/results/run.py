"""Every solver returns a :class:`Run`, made from the :class:`Trace` that it kept.

A solver notes a *breakpoint* (time, position, velocity, acceleration) wherever a ball's motion
changes. Up to the next one the acceleration is constant, so a Run knows the positions at any time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.model import Point, Scene, Shot, State, Units
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.plain import argument, choice, made
from pool_pymunk.model.problems import no_such_ball, setting_error, shown
from pool_pymunk.model.state import NO_ROLLING
from pool_pymunk.results.events import Event
from pool_pymunk.results.motion import bent_motions, free_motions
from pool_pymunk.results.persistent import PersistentContact, bending, spells, turning_with
from pool_pymunk.results.together import losses, slowed
from pool_pymunk.results.variants import FINER, Variant
from pool_pymunk.results.words import counted, step_text

if TYPE_CHECKING:
    from pool_pymunk.laws import Law
    from pool_pymunk.render import Figure
    from pool_pymunk.results.contacts import ContactRow
    from pool_pymunk.results.table import ResultTable
    from pool_pymunk.results.trace import Trace
    from pool_pymunk.solvers.again import Again
    from pool_pymunk.studies.derivatives import Derivatives

Times = Array | Sequence[float] | float
# In archives these columns of tables are one array.
PAIRS = {"balls": ("ball", "other"), "impulse": ("impulse_x", "impulse_y")}
What = Literal["samples", "events", "persistent", "contacts"]  # the tables of a run

SAMPLES_PER_SECOND = 60
EARLIEST = -1e-9  # s; a time of 0 s, such as an end less a duration, may be so early by rounding
ROUNDED_RUNS = 4  # This many runs with random rounding errors tell how far rounding moved the ends.
EARLY = 1_000  # events; runs that are a radius apart by then never agree again

# These fields are made when somebody asks for one of them; until then there is the trace.
LATE, TRACE = ("knots", "events"), "_trace"

# how far (m) the ends may be off
FIGURES = ("rounding", "policy_shift", "persistent_shift")

STATUSES: Mapping[str, str] = {
    "settled": "every ball is at rest",
    "max_time": "the run ended at max_time, and balls still move",
    "max_events": "the run ended at max_events, before all was at rest",
    "non_finite": "the run ended where a number left the range of floating point",
}


@dataclass(frozen=True, eq=False)
class Run:
    """A run is a simulated shot: what happened, where every ball was at any time, and what it cost.

    ``t`` (T,), ``position`` (T, N, 2) and ``velocity`` (T, N, 2) are samples in s, m and m/s, N in
    the order of ``scene.balls``; ``final`` maps each ball to its end (m). ``knots`` has the
    breakpoints (K, 7) of each ball: t, x, y, vx, vy, ax, ay; (K, 9) if balls roll, with wx,
    wy, the roll (m/s). ``law`` names the law that answered the contacts. ``off`` has the ids of the
    balls that are off the table at the end; a pocketed ball ends at its pocket's position.
    ``policies`` names those that answered what has no exact answer: "zero slip", "one instant",
    "collapse cut off", "frozen balls"; see :attr:`policy_shift`. ``persistent`` has the contacts
    that lasted, in the order of their beginnings; see :attr:`persistent_shift`. They were played to
    the ``contact_tolerance`` (m; None: the solver has none).

    Two runs are equal if all their fields but ``wall_time`` are equal.
    """

    scene: Scene
    shot: Shot | None
    solver: str
    law: str
    dt: float | None
    knots: tuple[Array, ...] = field(compare=False)  # __eq__ compares them as arrays.
    events: tuple[Event, ...]
    status: str
    duration: float
    steps: int
    warnings: tuple[str, ...]
    wall_time: float = field(compare=False)
    sample_times: tuple[float, ...] | None = None
    off: frozenset[str] = frozenset()
    policies: frozenset[str] = frozenset()
    persistent: tuple[PersistentContact, ...] = ()
    contact_tolerance: float | None = None
    known_shift: float | None = None
    again: Again | None = field(default=None, compare=False)
    variants: tuple[Variant, ...] = field(default=(), compare=False)
    law_used: Law | None = field(default=None, compare=False)
    watched: str | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        step, numbers = "", {"event": len(self.events), "warning": len(self.warnings)}
        if self.dt is not None:
            step, numbers["step"] = f" at {step_text(self.dt)}", self.steps
        parts = ", ".join(counted(number, noun) for noun, number in numbers.items())
        return (
            f"<Run {self.name!r} by {self.solver}{step}, law {self.law}:\n"
            f" {self.status} at {self.duration:.6g} s, {parts} in {self.wall_time:.3g} s>"
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Run):
            return NotImplemented
        names = [each.name for each in fields(self) if each.compare]
        same = all(getattr(self, name) == getattr(other, name) for name in names)
        both = zip(self.knots, other.knots, strict=True)
        return same and all(np.array_equal(mine, its, equal_nan=True) for mine, its in both)

    if not TYPE_CHECKING:  # Then a type checker would accept any name.

        def __getattr__(self, name: str) -> Any:
            """Make the breakpoints or the events of a run whose trace still has them."""
            own = self.__dict__
            trace = own.get(TRACE) if name in LATE else None
            if trace is None:
                return object.__getattribute__(self, name)
            own["knots"] = tuple([np.array(rows) for rows in trace.knots])
            own["events"] = trace.events_of(self.scene)
            own.pop(TRACE, None)
            return own[name]

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what plays the run again: a callback or a law may not be picklable."""
        made = {name: getattr(self, name) for name in LATE}
        return {**self.__dict__, **made, "again": None, "law_used": None}

    def __hash__(self) -> int:
        return hash((self.scene, self.shot, self.solver, self.dt, self.events, self.duration))

    @property
    def success(self) -> bool:
        """Tell whether every ball came to rest, or the run lasted until its ``max_time``."""
        return self.status in ("settled", "max_time")

    @property
    def message(self) -> str:
        """Say in a plain sentence how the run ended.

        >>> from pool_pymunk import load, simulate
        >>> simulate(load("report"), "Simulation 3").message
        'Every ball is at rest.'
        """
        return f"{STATUSES[self.status].capitalize()}."

    @property
    def name(self) -> str:
        """Return the shot's name, or "as set up" if the scene ran without a shot."""
        return self.shot.name if self.shot else "as set up"

    @property
    def struck(self) -> str | None:
        """Return the struck ball (of the shot, or in a batch), whose speed and angle are inputs."""
        return self.watched if self.shot is None else self.shot.ball

    @cached_property
    def t(self) -> Array:
        """Return the times (T,) that were asked for, or 60 a second and the end."""
        if self.sample_times is not None:
            return np.array(self.sample_times, dtype=float)
        count = int(self.duration * SAMPLES_PER_SECOND) + 1
        grid = np.arange(count) / SAMPLES_PER_SECOND
        return grid if grid[-1] >= self.duration else np.append(grid, self.duration)

    @cached_property
    def _samples(self) -> tuple[Array, Array]:
        return self.at(self.t)

    @property
    def position(self) -> Array:
        """Return positions (T, N, 2) at the times ``t``, in m."""
        return self._samples[0]

    @property
    def velocity(self) -> Array:
        """Return velocities (T, N, 2) at the times ``t``, in m/s."""
        return self._samples[1]

    def at(self, times: Times) -> tuple[Array, Array]:
        """Return positions (m) and velocities (m/s) at ``times`` (s).

        A time after the end counts as the end. For a sequence of times (T,) both are of shape
        (T, N, 2), for a single time (N, 2).
        """
        if not self.persistent:
            return free_motions(*self._last_of(self.knots, times))
        place, velocity = bent_motions(*self._last_of(self._bent, times))
        return place, velocity * slowed(*self._last_of(self._losses, times))

    def roll_at(self, times: Times) -> Array:
        """Return the velocities (m/s) at which the balls would roll, at any ``times`` (s).

        For a sequence of times (T,) the answer is of shape (T, N, 2), for a single time (N, 2).
        Raises SettingError for a scene without friction of rolling.
        """
        if not self.scene.surface.rolls:
            raise setting_error("scene", self.scene.title, NO_ROLLING)
        last, t = self._last_of(self._rolls, times)
        s = (t - last[..., 0])[..., np.newaxis]
        roll = np.asarray(last[..., 1:3] + s * (last[..., 3:5] + s * last[..., 5:] / 2.0))
        return roll * slowed(*self._last_of(self._losses, times)) if self.persistent else roll

    def _last_of(self, tables: Sequence[Array], times: object) -> tuple[Array, Array]:
        """Return the rows (..., N, C) of the last breakpoints, and the times (..., 1) (s)."""
        t = np.clip(read_times(times), 0.0, self.duration)
        last = [
            table[np.searchsorted(rows[:, 0], t, side="right") - 1]
            for rows, table in zip(self.knots, tables, strict=True)
        ]
        return np.stack(last, axis=-2), t[..., np.newaxis]

    @cached_property
    def _bent(self) -> tuple[Array, ...]:
        """For each ball its breakpoints, and how fast its acceleration changes after them."""
        tolerance = self.contact_tolerance or 0.0
        return tuple(
            bending(rows, spells(self, ball.id), tolerance)
            for ball, rows in zip(self.scene.balls, self.knots, strict=True)
        )

    @cached_property
    def _rolls(self) -> tuple[Array, ...]:
        """For each ball the time (s) of each breakpoint, its roll (m/s), and how fast it changes.

        The change (m/s^2, m/s^3) is that of a ball alone, or while a contact persists that to the
        next breakpoint.
        """
        return tuple(
            np.column_stack((bent[:, 0], rows[:, 7:9], turning_with(rows, spells(self, id_), bent)))
            for id_, rows, bent in zip(self.scene.index, self.knots, self._bent, strict=True)
        )

    @cached_property
    def _losses(self) -> tuple[Array, ...]:
        """For each ball its breakpoints, and how balls lose energy that go on together."""
        rolls = (
            self._rolls if self.scene.surface.rolls else [np.zeros((len(k), 7)) for k in self.knots]
        )
        return losses(self, self._bent, rolls)

    def energy_at(self, times: Times) -> Array:
        """Return the energy (J) of all balls at any ``times`` (s): (T,), or one number.

        It is kinetic, and on a tilted table also that of the height above the lowest corner.

        >>> from pool_pymunk import load, simulate
        >>> run = simulate(load("report"), 1, solver="event-driven")
        >>> run.energy_at(run.duration), run.energy_at([0.0]) == run.energy["initial"]
        (array(0.), array([ True]))
        """
        return np.asarray(energies_of(self, times).sum(axis=-1))

    def on_table(self, times: Times) -> NDArray[np.bool_]:
        """Tell which balls are on the table at any ``times`` (s).

        For a sequence of times (T,) the answer is of shape (T, N), for a single time (N,).
        """
        t = read_times(times)
        leaves = dict.fromkeys(self.off, -math.inf)
        leaves |= {event.balls[0]: event.t for event in self.events if event.pocket is not None}
        until = np.array([leaves.get(ball.id, math.inf) for ball in self.scene.balls])
        return np.asarray(t[..., np.newaxis] < until)

    @cached_property
    def end(self) -> State:
        """Return positions (m) and velocities (m/s) at the end, exactly as the solver left them."""
        position, velocity = self.at(self.duration)
        roll = points(self.roll_at(self.duration)) if self.scene.surface.rolls else None
        return State(points(position), points(velocity), self.off, roll)

    @cached_property
    def final(self) -> dict[str, Point]:
        """Return where each ball ended (m), by its id; KeyError says which ids there are."""
        return Ends(zip(self.scene.index, self.end.position, strict=True))

    @cached_property
    def pocketed(self) -> dict[str, str]:
        """Return the pocket's id for each ball that was pocketed in this run, in their order."""
        return {event.balls[0]: event.pocket for event in self.events if event.pocket is not None}

    @cached_property
    def contacts(self) -> tuple[ContactRow, ...]:
        """Return the table of contacts: for each where, impulses, velocities, energy.

        It is worked out from the run's events and breakpoints when it is asked for first. For each
        ball the impulses and the friction of the surface add up to its change of momentum, unless a
        warning says that hits of a collapse are no events. ``pymunk-builtin`` does not tell how
        fast balls spin, so its contacts have neither kind nor loss of energy.
        ``to_frame("contacts")`` has the rows in SI.
        """
        from pool_pymunk.results.contacts import contact_rows

        return contact_rows(self)

    @cached_property
    def rounding(self) -> float:
        """Return how far (m) rounding may have moved the ends.

        The rounding errors of every contact are carried along the run, to first order
        (:func:`pool_pymunk.studies.changes.rounding`). If they grow so large that other contacts
        may happen, the figure is the size of the table. If the run has persistent contacts, or no
        derivatives, more runs with random errors give it (stochastic arithmetic: Vignes,
        Mathematics and Computers in Simulation 35, 1993, 233). The figure leaves out contacts that
        nearly happened. It is nan for a solver without the contact engine, and for a run loaded
        from a file.

        >>> from pool_pymunk import load, simulate
        >>> 0.0 < simulate(load("report"), "Simulation 1", solver="event-driven").rounding < 1e-11
        True
        """
        if self.again is None:
            return math.nan
        from pool_pymunk.studies.changes import rounding

        found = rounding(self)
        if math.isnan(found):
            variants = [Variant(seed=seed) for seed in range(ROUNDED_RUNS)]
            found = self._moved(variants, EARLY)
            if found > min(ball.radius for ball in self.scene.balls):
                found = math.inf
            elif len(self.events) > EARLY:
                found = self._moved(variants)
        places = [rows[:, 1:3] for rows in self.knots]
        if self.scene.table is not None:
            places.append(np.array(self.scene.table.polyline))
        return min(found, float(np.linalg.norm(np.ptp(np.concatenate(places), axis=0))))

    def derivatives(self, wrt: str | Sequence[str] = ("position", "velocity")) -> Derivatives:
        """Differentiate the ends and the event times of an exact run by its inputs.

        ``wrt`` names inputs or groups of them: "position" and "velocity" of all balls at the start,
        "speed", "angle" and "roll" of the shot, "mass", "radius", "restitution", "friction", or
        "all"; see :class:`~pool_pymunk.Derivatives` for names, shapes and units. The derivatives
        are exact (saltation matrices). Where none exists (for example at a graze, or where two
        contacts of one instant share a ball) the entry is NaN, and a warning says so. Derivatives
        end at a persistent contact: what it has changed is NaN, too. Raises SettingError for a run
        of a solver that is not exact.

        >>> from pool_pymunk import load, simulate
        >>> found = simulate(load("report"), 1, solver="event-driven").derivatives()
        >>> found.final.shape, found.times.shape
        ((11, 2, 44), (24, 44))
        >>> round(found.amplification["8"])
        672
        """
        from pool_pymunk.studies.derivatives import derivatives

        return derivatives(self, wrt)

    @cached_property
    def policy_shift(self) -> float:
        """Return how far (m) the ends would move if policies had answered otherwise.

        It is 0 where everything had an exact answer, and nan where it is not known. Otherwise it
        comes from some more runs. In some of them a slip of rounding size has the one sign and the
        other, and the largest change counts. In others the start is nudged: balls that touch have
        gaps of 1e-13 to 4e-6 m. These are samples, so four times their largest change counts. The
        figure is the largest of these, and at most the table's diagonal.
        """
        if not self.policies:
            return 0.0
        if self.known_shift is not None or self.again is None:
            return math.nan if self.known_shift is None else self.known_shift
        return min(self._moved(self.variants), self.scene.diagonal)

    @cached_property
    def persistent_shift(self) -> float:
        """Return how far (m) contacts that persist may put the ends off.

        It is 0 where no contact persisted, and nan where it is not known: for a run loaded from a
        file. Otherwise the run is played again at a tenth and at a thousandth of its
        ``contact_tolerance``. The figure is ten times the largest change of an end, at least ten
        times what one contact may move in the finest of these runs, and at most the table's
        diagonal.

        >>> from pool_pymunk import load, simulate
        >>> simulate(load("report"), 1, solver="event-driven").persistent_shift
        0.0
        """
        if not self.persistent:
            return 0.0
        if self.again is None:
            return math.nan
        least = min(each.sure * each.coarser for each in FINER) * (self.contact_tolerance or 0.0)
        return min(max(self._moved(FINER), least), self.scene.diagonal)

    def _moved(self, variants: Sequence[Variant], most: int | None = None) -> float:
        """Return how far (m) ends may move, by variants of the run, cut at ``most`` events."""
        assert self.again is not None
        moves = self.again.moves(self, variants, {}, most)
        return max(each.sure * move for each, move in zip(variants, moves, strict=True))

    @cached_property
    def energy(self) -> dict[str, float]:
        """Return the energy (J) of all balls, ``initial`` and ``final``, as in ``energy_at``."""
        start, end = self.energy_at([0.0, self.duration]).tolist()
        return {"initial": start, "final": end}

    def as_dict(self) -> dict[str, object]:
        """Return the shot as it stands in the JSON of ``run --json``, in SI."""
        shot, breakpoints = self.shot, dict(zip(self.scene.index, self.knots, strict=True))
        return {
            "name": self.name,
            "ball": shot and shot.ball,
            "velocity": shot and breakpoints[shot.ball][0, 3:5].tolist(),
            "status": self.status,
            "duration": self.duration,
            "steps": self.steps,
            "wall_time": self.wall_time,
            "final": {id_: list(point) for id_, point in self.final.items()},
            "pocketed": self.pocketed,
            "events": [event.as_dict() for event in self.events],
            "persistent": [contact.as_dict() for contact in self.persistent],
            "energy": self.energy,
            "warnings": list(self.warnings),
        }

    def plot(
        self,
        what: Literal["start", "end", "energy"] = "end",
        path: str | Path | None = None,
        *,
        dpi: float = 200.0,
    ) -> Figure:
        """Draw the run, save it where a ``path`` (.png, .svg or .pdf) is given, return the figure.

        The "start" has arrows at the balls that move, the "end" the balls' tracks; "energy" is
        kinetic energy and the size of momentum against time.
        """
        from pool_pymunk.render import energy_figure, figure_of, save_figure

        argument("what", what, choice(("start", "end", "energy")))
        figure = energy_figure(self) if what == "energy" else figure_of(self, what)
        if path is not None:
            save_figure(figure, path, dpi)
        return figure

    def film(self, path: str | Path, **settings: Any) -> None:
        """Film the run into a file (.mp4 or .gif).

        ``settings`` are those of :class:`~pool_pymunk.render.FilmSettings`, such as ``slow``.
        """
        from pool_pymunk.render import FilmSettings, film

        film(self, path, FilmSettings.of(path, **settings))

    @overload
    def to_html(self, path: None = None, *, overlay: Sequence[Run] = ...) -> str: ...

    @overload
    def to_html(self, path: str | Path, *, overlay: Sequence[Run] = ...) -> None: ...

    def to_html(self, path: str | Path | None = None, *, overlay: Sequence[Run] = ()) -> str | None:
        """Make a page that plays the run exactly: one HTML file that needs nothing else.

        It is written to ``path``, or returned where there is none. ``overlay`` are runs of the same
        balls, shown as ghosts. Raises SettingError for runs of different balls or tables.

        >>> from pool_pymunk import load, simulate
        >>> "window.pool" in simulate(load("report"), 1).to_html()
        True
        """
        from pool_pymunk.page import page, write_page

        if isinstance(overlay, Run):
            raise setting_error("overlay", shown(overlay), "must be a list of runs")
        shots = [[self, *overlay]]
        if path is None:
            return page(shots)
        write_page(shots, path)
        return None

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the page, in a frame."""
        from pool_pymunk.page import run_in_notebook

        return run_in_notebook(self)

    def table(self, what: What = "samples", units: Units | None = None) -> ResultTable:
        """Return a table that goes into CSV, JSON, arrays or a DataFrame (:meth:`to_frame`).

        Samples and contacts are in ``units``, by default in SI, and all else is in SI.

        >>> from pool_pymunk import load, simulate
        >>> simulate(load("two-balls"), max_time=0.5).table("events").json()[0]["kind"]
        'ball-ball'
        """
        from pool_pymunk.results.run_tables import TABLES

        argument("what", what, choice(TABLES))
        return TABLES[what](self, argument("units", units or Units(), made(Units)))

    def to_frame(self, what: What = "samples") -> Any:
        """Make a pandas DataFrame, a row for each time and ball, or one for each event, in SI.

        The columns of samples are t, ball, x, y, vx, vy and energy, those of events are t, kind,
        ball, other, cushion, pocket, impulse, tangential and tangential_first, those of persistent
        contacts are since, until, ball, other, cushion, impulse_x and impulse_y. Those of contacts
        are in :meth:`write_contacts_csv`. Raises ImportError where pandas is not installed.
        """
        return self.table(what).to_frame()

    def save(self, path: str | Path) -> None:
        """Save everything to one file, for :meth:`load`; a law of your own is saved by name."""
        from pool_pymunk.results.saved import save

        save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Run:
        """Load what :meth:`save` saved: an equal run, to the last bit.

        Raises ValueError for another file, OSError for one that cannot be read.
        """
        from pool_pymunk.results.saved import load

        return load(path)

    def write_npz(self, path: str | Path) -> None:
        """Write samples (SI), the balls' ids, events and persistent contacts as a NumPy archive.

        An event or contact without a cushion has -1 there, an event without a pocket an empty text,
        and one without impulses nan.
        """
        found: dict[str, Any] = {key: getattr(self, key) for key in ("t", "position", "velocity")}
        found["balls"] = np.array(list(self.scene.index))
        tables = {"event": self.table("events"), "persistent": self.table("persistent")}
        for name, table in tables.items():
            columns = table.arrays()
            for joint, both in PAIRS.items():
                if both[0] in columns:
                    columns[joint] = np.stack([columns.pop(key) for key in both], axis=1)
            found |= {f"{name}_{key}": column for key, column in columns.items()}
        np.savez_compressed(path, **found)

    def write_csv(self, path: str | Path, units: Units | None = None) -> None:
        """Write a row for each time and ball: time, ball, place, velocity, kinetic energy (J).

        The heading names the units: SI, or those of ``units``, such as ``scene.units``. All digits
        are written.
        """
        self.table("samples", units).csv(path)

    def write_events_csv(self, path: str | Path) -> None:
        """Write a row for each event: t (s), kind, ball, other (of two), cushion, pocket, impulses.

        The impulses are in N s, as the heading says.
        """
        self.table("events").csv(path)

    def write_persistent_csv(self, path: str | Path) -> None:
        """Write a row for each persistent contact: its time (s), balls, cushion, impulse (N s)."""
        self.table("persistent").csv(path)

    def write_contacts_csv(self, path: str | Path, units: Units | None = None) -> None:
        """Write a row for each of the :attr:`contacts`, in SI or with lengths and speeds in units.

        Its time (s), until when it lasts (s), kind, ball, other (of two), cushion, point, normal,
        velocities of ball and other before and after, impulses (N s): J_n, J_t, J_t of the first of
        two balls, along x and y on the last ball; and the energy lost (J).
        """
        self.table("contacts", units).csv(path)


class Ends(dict[str, Point]):
    """The ends of balls (m) say which ids there are if they are asked for another one."""

    def __missing__(self, id_: object) -> Point:
        raise KeyError(f"{id_!r}: {no_such_ball(self)}")


def made_later(run: Run, trace: Trace) -> Run:
    """Return a run whose breakpoints and events are made from its trace once they are asked for."""
    for name in LATE:
        del run.__dict__[name]
    run.__dict__[TRACE] = trace
    return run


# Every file that `run --out` writes of a shot: the end of its name, and the method that writes it.
FILES = (
    (".npz", Run.write_npz),
    (".csv", Run.write_csv),
    ("-events.csv", Run.write_events_csv),
    ("-persistent.csv", Run.write_persistent_csv),
)


def read_times(times: object) -> Array:
    """Read a number or a sequence of numbers, finite ones, as an array."""
    try:
        found = np.asarray(times)
    except ValueError:  # rows of different lengths
        found = np.array(None)
    if found.dtype.kind not in "iuf" or found.ndim > 1 or not np.isfinite(found).all():
        raise setting_error("times", shown(times), "must be a finite number or a sequence of them")
    if (found < EARLIEST).any():
        raise setting_error("times", shown(times), "must not be before the start, 0 s")
    return found.astype(float)


def energies_of(run: Run, times: Times) -> Array:
    """Return the energy (J) of each ball at times (s): (T, N), or (N,) for one time.

    It is kinetic, and on a tilted table also that of the height above the lowest corner.
    """
    scene = run.scene
    mass = np.array([ball.mass for ball in scene.balls])
    place, velocity = run.at(times)
    energy: Array = 0.5 * ((velocity**2).sum(axis=-1) * mass)
    if scene.surface.rolls:
        energy += 0.5 * GYRATION * ((run.roll_at(times) ** 2).sum(axis=-1) * mass)
    if scene.is_tilted:
        energy += lifted(scene, place)
    return energy


def lifted(scene: Scene, place: Array) -> Array:
    """Return the energy (J) of the balls' height over the lowest corner at places (..., N, 2)."""
    assert scene.table is not None
    falls, mass = np.array(scene.tilt), np.array([ball.mass for ball in scene.balls])
    found: Array = ((scene.table.polyline @ falls).max() - place @ falls) * mass
    return found


def points(rows: Array) -> tuple[Point, ...]:
    """Return rows (N, 2) as points of plain numbers."""
    return tuple((float(x), float(y)) for x, y in rows)
