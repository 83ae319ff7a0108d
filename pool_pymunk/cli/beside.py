"""This module sets runs of one shot beside each other: settings as typed, and their runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from pool_pymunk.cli.common import InputError, input_errors, progress, read_step

if TYPE_CHECKING:
    from pool_pymunk.model import Scene, Shot
    from pool_pymunk.results.run import Run


class Setting(NamedTuple):
    """A setting is a solver, its step (s; None: its own), its law (None: the scene's), options."""

    solver: str
    dt: float | None = None
    law: str | None = None
    options: Mapping[str, Any] = MappingProxyType({})


def read_setting(text: str) -> Setting:
    """Return a solver, and in any order a step and a contact law, as typed.

    >>> read_setting("pymunk:1/64:published")[:3]
    ('pymunk', 0.015625, 'published')
    """
    from pool_pymunk.physics.laws import LAWS
    from pool_pymunk.solvers import find_solver

    solver, *more = (part.strip() for part in text.split(":"))
    with input_errors():
        method = find_solver(solver)
    laws = [part for part in more if part in LAWS]
    steps = [part for part in more if part not in LAWS]
    if len(laws) > 1 or len(steps) > 1:
        raise InputError(f"--overlay = {text}: must be a solver, or with :DT and :LAW behind it")
    if steps and method.dt is None:
        raise InputError(f"--overlay = {text}: {solver} has no time step")
    return Setting(solver, *(map(read_step, steps) if steps else [None]), *laws)


def simulate_beside(
    scene: Scene, shots: Sequence[Shot | None], settings: Sequence[Setting]
) -> list[tuple[Run, ...]]:
    """Simulate every shot by each of the settings: a row a shot, a column a setting."""
    from pool_pymunk.solvers import simulate_all

    asked = [shot for shot in shots if shot is not None] or None
    columns = []
    with progress("simulating", len(settings)) as bar, input_errors():
        for solver, dt, law, options in settings:
            physics = replace(scene.physics, law=law or scene.physics.law)
            variant = replace(scene, physics=physics)
            columns.append(list(simulate_all(variant, asked, solver=solver, dt=dt, **options)))
            bar.update(bar.task_ids[0], advance=1)
    return list(zip(*columns, strict=True))
