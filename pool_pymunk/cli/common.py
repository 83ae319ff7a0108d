"""This module has what commands share: how shots are played, and where results go."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Collection, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import typer

from pool_pymunk import __version__
from pool_pymunk.cli import lib, read
from pool_pymunk.core import compiled
from pool_pymunk.laws import LAWS
from pool_pymunk.safety.files import bundled, check_place, whole

NUMBER = re.compile(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?")

Widths = float | Mapping[str, tuple[float, float]]  # m, of all starts or of each ball's

CORE = f"core: {'compiled' if compiled else 'plain Python'}"

ALL = "all"  # of --solvers
LONGEST = f"takes longest; --solvers {ALL} plays it, too"


class How(NamedTuple):
    """These options say how any solver plays shots; None is the default."""

    law: str | None = None
    friction: str | None = None
    max_time: str | None = None
    contact_tolerance: str | None = None

    def scene(self, scenario: str) -> lib.Scene:
        """Return the scene of a scenario with this law, and with this latest time of its shots."""
        scene = lib.scenario.load(scenario)
        latest = read.seconds("--max-time", self.max_time) or scene.physics.max_time
        law = self.law or scene.physics.law
        return replace(scene, physics=replace(scene.physics, law=law, max_time=latest))

    def options(self, solver: str, units: lib.Units) -> dict[str, Any]:
        """Return the solver's options; a solver without a tolerance does not get one."""
        found: dict[str, Any] = {} if self.friction is None else {"friction": self.friction}
        key, typed = "--contact-tolerance", self.contact_tolerance
        tolerance = None if typed is None else read.length(key, typed, units)
        if tolerance is not None and lib.solvers.find_solver(solver).to_tolerance:
            found["contact_tolerance"] = tolerance
        return found

    def reference(self, scene: lib.Scene) -> lib.grid.Column:
        """Return the exact solver, with which others are compared."""
        name = lib.solvers.reference_solver().name
        options = self._replace(friction=None).options(name, scene.units)
        return lib.grid.Column(name, options=options)

    def columns(
        self, scene: lib.Scene, typed: str | None, dt: float | None = None, every: bool = False
    ) -> tuple[list[lib.grid.Column], dict[str, str]]:
        """Return the columns of --solvers, by default of all solvers, and why others are left out.

        Solvers without a typed step have the step ``dt`` (s), or their own, or ``every`` one. Those
        that are named must be able to play the scene.
        """
        named = typed not in (None, ALL)
        known = sorted(lib.solvers.SOLVERS.values(), key=lambda solver: solver.dt is None)
        names = [solver.name for solver in known if every or not solver.is_reference]
        columns, left_out = list[lib.grid.Column](), dict[str, str]()
        for name in read.names("--solvers", typed or "") if named else names:
            one = read_setting(name, "--solvers", dt, laws=())
            solver = lib.solvers.find_solver(one.solver)
            options = self.options(solver.name, scene.units)
            options = options if named else lib.solvers.options_for(solver, options)
            try:
                lib.solvers.request(scene, solver.name, **options)
            except lib.problems.SettingError as error:
                if named:
                    raise
                left_out[name] = str(error).partition(": ")[2]
            else:
                columns += [each._replace(options=options) for each in one.at_steps(every)]
        longest = [each for each in columns if each.is_longest and typed is None]
        left_out |= {str(each): LONGEST for each in longest}
        return [each for each in columns if each not in longest], left_out

    def setting(self, scene: lib.Scene, solver: str, dt: str | None) -> lib.grid.Column:
        """Return the solver and its step as typed; an error names an option that does not fit."""
        step = read.seconds("--dt", dt)
        options = self.options(solver, scene.units)
        lib.solvers.request(scene, solver, law=self.law, **options)
        if dt is not None and lib.solvers.find_solver(solver).dt is None:
            raise read.InputError(f"--dt = {dt}: {solver} has no time step")
        if self.contact_tolerance is not None and "contact_tolerance" not in options:
            message = f"{solver} does not play contacts to a tolerance"
            raise read.InputError(f"--contact-tolerance = {self.contact_tolerance}: {message}")
        return lib.grid.Column(solver, step, options=options)


def read_setting(
    text: str, key: str = "--overlay", dt: float | None = None, laws: Collection[str] = LAWS
) -> lib.grid.Column:
    """Return a setting as typed: a solver, then in any order a step (else ``dt``, s) and a law.

    >>> read_setting("pymunk:1/64:published")[:3]
    ('pymunk', 0.015625, 'published')
    """
    solver, *more = (part.strip() for part in text.split(":"))
    try:
        has_step = lib.solvers.find_solver(solver).dt is not None
    except lib.problems.SettingError as error:
        raise read.InputError(str(error).replace("solver =", f"{key} =", 1)) from None
    law = [part for part in more if part in laws]
    steps = [part for part in more if part not in laws]
    if len(law) > 1 or len(steps) > 1:
        behind = ":DT and :LAW" if laws else ":DT"
        raise read.InputError(f"{key} = {text}: must be a solver, and may have {behind} behind it")
    if steps and not has_step:
        raise read.InputError(f"{key} = {text}: {solver} has no time step")
    step = read.seconds(key, steps[0]) if steps else dt if has_step else None
    return lib.grid.Column(solver, step, law[0] if law else None)


def simulate_beside(
    scene: lib.Scene, shots: Sequence[lib.Shot | None], settings: Sequence[lib.grid.Column]
) -> Generator[tuple[lib.Run, ...], None, None]:
    """Simulate every shot by each setting: yield a row a shot, with a column a setting."""
    with lib.terminal.Bar("simulating", len(shots) * len(settings)) as bar:
        found = [lib.grid.estimate(scene, shots, one) for one in settings]
        share = lib.terminal.Share(bar, [one for row in zip(*found, strict=True) for one in row])
        columns = [one.runs(scene, shots, on_time=share.move) for one in settings]
        for _ in shots:
            row = []
            for runs in columns:
                row.append(next(runs))
                share.finish()
            yield tuple(row)


def is_scenario(text: str) -> bool:
    """Tell whether a text of --overlay is a scenario, and no solver."""
    return text.endswith(".toml") or text in bundled()


def other_scene(
    how: How, scene: lib.Scene, scenario: str, text: str, key: str = "--overlay"
) -> lib.Scene:
    """Return a scene to be shown beside another one; it must look the same."""
    if text not in bundled() and not Path(text).exists():
        raise read.InputError(f"{key} = {text}: there is no such file")
    other = how.scene(text)
    if part := lib.page.other_part(scene, other):
        raise read.InputError(f"{key} = {text}: must have the same {part} as {scenario}")
    has, wanted = len(other.shots), len(scene.shots)
    if has != wanted:
        message = f"must have as many shots as {scenario} ({wanted}), but has {has}"
        raise read.InputError(f"{key} = {text}: {message}")
    return other


def same_shots(
    scene: lib.Scene, other: lib.Scene, shots: Sequence[lib.Shot | None]
) -> list[lib.Shot | None]:
    """Return the shots of another scene that have the same numbers."""
    return [one and other.shots[scene.shots.index(one)] for one in shots]


def left_out_sentences(left_out: Mapping[str, str]) -> Iterator[str]:
    """Say which solvers are left out, and why."""
    for name, why in left_out.items():
        yield f"{name} is left out: it {why}."


def simulate_and_warn(
    scene: lib.Scene, shots: Sequence[lib.Shot | None], settings: Sequence[lib.grid.Column]
) -> list[tuple[lib.Run, ...]]:
    """Simulate as above, and print on stderr what runs warn of, and where they miss their ends."""
    rows = list(simulate_beside(scene, shots, settings))
    for runs in rows:
        for line in warnings_of(runs):
            typer.echo(line, err=True)
        for run in runs:  # Where it misses published ends, some solver may have them.
            agreement = lib.listing.Agreement.of(run)
            if len(agreement.agreeing) < agreement.count:
                said = f"{agreement.sentence(run)}.{published_by(run)}"
                typer.echo(f"Warning: {run.name} ({run.solver}): {said}", err=True)
    return rows


def warnings_of(runs: Iterable[lib.Run]) -> Iterator[str]:
    """Yield the warnings of runs, each once: runs of a shot may differ in numbers alone."""
    said: dict[tuple[str, str, int], tuple[str, list[str]]] = {}
    for run in runs:
        alike = Counter[str]()
        for text in run.warnings:
            form = NUMBER.sub("#", text)
            alike[form] += 1
            said.setdefault((run.name, form, alike[form]), (text, []))[1].append(run.solver)
    for (name, _, _), (text, solvers) in said.items():
        first, *others = dict.fromkeys(solvers)
        also = f"; alike: {', '.join(others)}" if others else ""
        yield f"Warning: {name} ({first}{also}): {text}."


def published_by(run: lib.Run) -> str:
    """Say which solver has the report's method, if ends are missed and the law is the report's."""
    law, agreement = lib.scenario.load("report").physics.law, lib.listing.Agreement.of(run)
    known = lib.solvers.SOLVERS.values()
    names = [one.name for one in known if one.published_step and one.name != run.solver]
    missed = len(agreement.agreeing) < agreement.count
    if not missed or run.scene.physics.law != law or not names:
        return ""
    return f" --solver {names[0]} plays by the report's own method."


def position_errors(scenario: str, scene: lib.Scene, typed: str | None) -> tuple[Widths, str]:
    """Return half the widths (m) of starts, as typed or by last digits, and whence they are."""
    key = "--position-error"
    if typed is not None:
        return lib.quantities.quantity(key, typed, "length", scene.units, 0.0), ""
    widths = lib.uncertainty.written_uncertainty(scenario).position
    if not isinstance(widths, Mapping) or widths.keys() != scene.index.keys():
        raise read.InputError(f"{key}: is missing; the scenario cannot be read twice")
    return widths, lib.uncertainty.digits_sentence(scenario)


def say(lines: Iterable[str]) -> None:
    """Print lines, above a bar if there is one."""
    for line in lines:
        print(line)


def place(out: Path | None, scenario: str, inside: str = "") -> Path:
    """Return where files go: as typed, or in renders/<scenario>. Raises OSError if none can."""
    folder = out or Path("renders") / Path(scenario).stem / inside
    check_place(folder, is_folder=True)
    return folder


def stem(run: lib.Run) -> str:
    """Return how the names of a shot's files begin: ``shot-3`` for the scene's third shot."""
    return f"shot-{run.scene.shots.index(run.shot) + 1 if run.shot else 1}"


def write_json(
    path: Path | None, results: Mapping[str, object], scenario: str = "", title: str | None = None
) -> None:
    """Write the file of ``--json``, if there is one: what was played, the version, the results."""
    if path is not None:
        what = {"scenario": scenario, "title": title} if scenario else {}
        content = {**what, "version": __version__, **results}
        text = json.dumps(content, indent=1, ensure_ascii=False)
        with whole(path) as part:
            part.write_text(text + "\n", encoding="utf-8")
