"""This module has what commands share: how shots are played, and where results go."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import typer

from pool_pymunk import __version__
from pool_pymunk.cli import lib, read
from pool_pymunk.physics.laws import LAWS
from pool_pymunk.safety.files import whole


class Setup(NamedTuple):
    """A setting has a solver, a step (s; None: its own), a law (None: the scene's), and options."""

    solver: str
    dt: float | None = None
    law: str | None = None
    options: Mapping[str, Any] = MappingProxyType({})


class How(NamedTuple):
    """These options say how any solver plays shots; None is the default."""

    law: str | None = None
    friction: str | None = None
    max_time: str | None = None

    def scene(self, scenario: str) -> lib.Scene:
        """Return the scene of a scenario with this law, and with this latest time of its shots."""
        scene = lib.scenario.load(scenario)
        latest = read.seconds("--max-time", self.max_time) or scene.physics.max_time
        law = self.law or scene.physics.law
        return replace(scene, physics=replace(scene.physics, law=law, max_time=latest))

    @property
    def options(self) -> dict[str, Any]:
        """Return the solver's options."""
        return {} if self.friction is None else {"friction": self.friction}

    def options_of(
        self, scene: lib.Scene, solvers: Iterable[str], named: bool
    ) -> dict[str, dict[str, Any]]:
        """Return the options of the solvers that can play the scene; if ``named``, all must."""
        found = {}
        for name in solvers:
            solver = lib.solvers.find_solver(name)
            if named or solver.rolls or not scene.surface.rolls:
                given = self.options
                found[name] = given if named else lib.solvers.options_for(solver, given)
                lib.solvers.request(scene, name, **found[name])
        return found

    def setting(self, scene: lib.Scene, solver: str, dt: str | None) -> Setup:
        """Return the solver and its step as typed; an error names an option that does not fit."""
        step = read.seconds("--dt", dt)
        lib.solvers.request(scene, solver, law=self.law, **self.options)
        if dt is not None and lib.solvers.find_solver(solver).dt is None:
            raise read.InputError(f"--dt = {dt}: {solver} has no time step")
        return Setup(solver, step, options=self.options)


def read_setting(
    text: str, key: str = "--overlay", dt: float | None = None, laws: Collection[str] = LAWS
) -> Setup:
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
    return Setup(solver, step, law[0] if law else None)


def simulate_beside(
    scene: lib.Scene, shots: Sequence[lib.Shot | None], settings: Sequence[Setup]
) -> list[tuple[lib.Run, ...]]:
    """Simulate every shot by each setting: return a row a shot, with a column a setting."""
    asked = [shot for shot in shots if shot is not None] or None
    columns = []
    with lib.terminal.progress("simulating", len(settings)) as bar:
        for solver, dt, law, options in settings:
            physics = replace(scene.physics, law=law or scene.physics.law)
            variant = replace(scene, physics=physics)
            runs = lib.solvers.simulate_all(variant, asked, solver=solver, dt=dt, **options)
            columns.append(list(runs))
            bar.step()
    return list(zip(*columns, strict=True))


def say(lines: Iterable[str]) -> None:
    """Print lines."""
    for line in lines:
        typer.echo(line)


def place(out: Path | None, scenario: str, inside: str = "") -> Path:
    """Return where files go: as typed, or in renders/<scenario>."""
    return out or Path("renders") / Path(scenario).stem / inside


def stem(run: lib.Run) -> str:
    """Return how the names of a shot's files begin: ``shot-3`` for the scene's third shot."""
    return f"shot-{run.scene.shots.index(run.shot) + 1 if run.shot else 1}"


def write_json(
    path: Path | None, results: Mapping[str, object], scenario: str = "", title: str | None = None
) -> None:
    """Write the file of ``--json``, if there is one: what was played, the version, the results."""
    if path is not None:
        what = {"scenario": lib.scenario.label(scenario), "title": title} if scenario else {}
        content = {**what, "version": __version__, **results}
        text = json.dumps(content, indent=1, ensure_ascii=False)
        with whole(path) as part:
            part.write_text(text + "\n", encoding="utf-8")
