"""This module has what commands say of runs, and how files of theirs are called."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from pool_pymunk.model import scenario
from pool_pymunk.report.listing import Agreement, doubts
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import SOLVERS

NUMBER = re.compile(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?")


def stem(run: Run) -> str:
    """Return how the names of a shot's files begin: ``shot-3`` for the scene's third shot."""
    return f"shot-{run.scene.shots.index(run.shot) + 1 if run.shot else 1}"


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


def doubts_of(runs: Iterable[Run]) -> Iterator[str]:
    """Yield how far the ends of exact runs may be off themselves."""
    for run in runs:
        yield from (f"{run.name} ({run.solver}): {doubt}." for doubt in doubts(run))


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
