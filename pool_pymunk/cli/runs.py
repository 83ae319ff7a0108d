"""This module plays runs beside each other, and has what commands say of runs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import typer

from pool_pymunk.cli import options, read
from pool_pymunk.cli.options import InputError
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.model import Scene, Shot, scenario
from pool_pymunk.page import other_part
from pool_pymunk.report.listing import Agreement
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import bundled
from pool_pymunk.solvers import SOLVERS
from pool_pymunk.studies.grid import Column

NUMBER = re.compile(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?")
Rows = list[tuple[Run, ...]]  # a row a shot, with a column a setting


def stem(run: Run) -> str:
    """Return how the names of a shot's files begin: ``shot-3`` for the scene's third shot."""
    return f"shot-{run.scene.shots.index(run.shot) + 1 if run.shot else 1}"


# -- runs beside each other ------------------------------------------------------------------------


def compared(
    asked: options.Played, scene: Scene, texts: Sequence[str], other: str | None = None
) -> tuple[list[Column], list[Scene]]:
    """Return what is compared with: solvers at their settings, and scenes that look the same."""
    scenes = [text for text in texts if text.endswith(".toml") or text in bundled()]
    others = [_other(asked, scene, text, "--overlay") for text in scenes]
    others += [] if other is None else [_other(asked, scene, other, "OTHER")]
    return [read.setting(text) for text in texts if text not in scenes], others


def _other(asked: options.Played, scene: Scene, text: str, key: str) -> Scene:
    """Return a scene to be shown beside another one."""
    if text not in bundled() and not Path(text).exists():
        raise InputError(f"{key} = {text}: there is no such file")
    other = read.scene(asked, text)
    if part := other_part(scene, other):
        raise InputError(f"{key} = {text}: must have the same {part} as {asked.scenario}")
    has, wanted = len(other.shots), len(scene.shots)
    if has != wanted:
        message = f"must have as many shots as {asked.scenario} ({wanted}), but has {has}"
        raise InputError(f"{key} = {text}: {message}")
    return other


def play_beside(
    scene: Scene, shots: Sequence[Shot | None], settings: Sequence[Column], others: Iterable[Scene]
) -> Rows:
    """Play every shot by each setting, and by the first one in the other scenes.

    What the runs warn of, and where they miss their ends, is printed on stderr.
    """
    rows = simulate_beside(scene, shots, settings)
    _warn(rows)
    for other in others:  # It has shots of the same numbers.
        its = [one and other.shots[scene.shots.index(one)] for one in shots]
        more = simulate_beside(other, its, settings[:1])
        _warn(more)
        rows = [row + one for row, one in zip(rows, more, strict=True)]
    return rows


def simulate_beside(
    scene: Scene, shots: Sequence[Shot | None], settings: Sequence[Column]
) -> Rows:  # fmt: skip
    """Play every shot by each setting."""
    columns = []
    with Bar("simulating", len(shots) * len(settings)) as bar:
        for one in settings:
            columns.append(list[Run]())
            for run in one.runs(scene, shots, bar.at):
                columns[-1].append(run)
                bar.step()
    return list(zip(*columns, strict=True))


# -- what is said of runs --------------------------------------------------------------------------


def _warn(rows: Rows) -> None:
    """Print on stderr what runs warn of, and where they miss their published ends."""
    for runs in rows:
        for line in warnings_of(runs):
            typer.echo(line, err=True)
        for run in runs:  # Where it misses published ends, some solver may have them.
            agreement = Agreement.of(run)
            if len(agreement.agreeing) < agreement.count:
                said = f"{agreement.sentence(run)}.{published_by(run)}"
                typer.echo(f"Warning: {run.name} ({run.solver}): {said}", err=True)


def warnings_of(runs: Iterable[Run]) -> Iterator[str]:
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


def published_by(run: Run) -> str:
    """Say which solver has the report's method, if ends are missed and the law is the report's."""
    law, agreement = scenario.load("report").physics.law, Agreement.of(run)
    known = SOLVERS.values()
    names = [one.name for one in known if one.published_step and one.name != run.solver]
    missed = len(agreement.agreeing) < agreement.count
    if not missed or run.scene.physics.law != law or not names:
        return ""
    return f" --solver {names[0]} plays by the report's own method."


def left_out_sentences(left_out: Mapping[str, str]) -> Iterator[str]:
    """Say which solvers are left out, and why."""
    for name, why in left_out.items():
        yield f"{name} is left out: it {why}."
