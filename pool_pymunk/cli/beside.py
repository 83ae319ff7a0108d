"""This module plays runs beside each other: by several solvers, and in scenes that look alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import typer

from pool_pymunk.cli import options, read
from pool_pymunk.cli.lines import InputError
from pool_pymunk.cli.runs import published_by, warnings_of
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.model import Scene, Shot
from pool_pymunk.page import other_part
from pool_pymunk.report.listing import Agreement
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import bundled
from pool_pymunk.studies.grid import Column

Rows = list[tuple[Run, ...]]  # a row a shot, with a column a setting


def compared(
    asked: options.AnySolver, scene: Scene, texts: Sequence[str], other: str | None = None
) -> tuple[list[Column], list[Scene]]:
    """Return what is compared with: solvers at their settings, and scenes that look the same."""
    scenes = [text for text in texts if text.endswith(".toml") or text in bundled()]
    others = [_other(asked, scene, text, "--overlay") for text in scenes]
    others += [] if other is None else [_other(asked, scene, other, "OTHER")]
    return [read.setting(text) for text in texts if text not in scenes], others


def _other(asked: options.AnySolver, scene: Scene, text: str, key: str) -> Scene:
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
