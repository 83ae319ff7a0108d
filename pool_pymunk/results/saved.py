"""This module keeps all of a run in one file, a NumPy archive, and loads it again."""

from __future__ import annotations

import json
from dataclasses import astuple
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.scenario import loads
from pool_pymunk.results.events import Event
from pool_pymunk.results.persistent import PersistentContact
from pool_pymunk.results.run import Run
from pool_pymunk.results.trace import completed
from pool_pymunk.safety.files import whole

FORMAT = "pool-pymunk run 2"
BEFORE = "pool-pymunk run 1"  # Its breakpoints have no accelerations, and all its balls slide.
PLAIN = ("solver", "law", "dt", "status", "duration", "steps", "wall_time")  # as in the JSON


def save(run: Run, path: str | Path) -> None:
    """Write the breakpoints as arrays, and all else as JSON, which keeps every digit."""
    about = {
        "format": FORMAT,
        "scene": run.scene.to_toml(),
        "shot": None if run.shot is None else run.scene.shots.index(run.shot),
        "events": [astuple(event) for event in run.events],
        "warnings": run.warnings,
        "sample_times": run.sample_times,
        "off": sorted(run.off),
        "policies": sorted(run.policies),
        "contact_tolerance": run.contact_tolerance,
        "persistent": [astuple(contact) for contact in run.persistent],
        "known_shift": run.known_shift,
        **{key: getattr(run, key) for key in PLAIN},
    }
    with whole(Path(path)) as part, part.open("wb") as file:
        np.savez_compressed(
            file,
            about=np.array(json.dumps(about)),
            knots=np.concatenate(run.knots),
            counts=np.array([len(rows) for rows in run.knots]),
        )


def load(path: str | Path) -> Run:
    """Read what :func:`save` wrote."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            about = json.loads(str(archive["about"]))
            breakpoints = np.split(archive["knots"], np.cumsum(archive["counts"])[:-1])
    except (ValueError, KeyError, TypeError, EOFError, BadZipFile):
        about = {}
    if about.get("format") not in (FORMAT, BEFORE):
        raise setting_error("path", str(path), "Run.save did not write this file")
    scene = loads(about["scene"])
    if about["format"] == BEFORE:
        slides, end = scene.surface, about["duration"]
        breakpoints = [np.array(completed(rows.tolist(), slides, end)) for rows in breakpoints]
    events, times = about["events"], about["sample_times"]
    return Run(
        scene=scene,
        shot=None if about["shot"] is None else scene.shots[about["shot"]],
        knots=tuple(breakpoints),
        events=tuple(Event(t, kind, tuple(balls), *where) for t, kind, balls, *where in events),
        warnings=tuple(about["warnings"]),
        sample_times=None if times is None else tuple(times),
        off=frozenset(about["off"]),
        policies=frozenset(about.get("policies", ())),
        persistent=tuple(
            PersistentContact(tuple(balls), cushion, since, until, tuple(impulse))
            for balls, cushion, since, until, impulse in about.get("persistent", ())
        ),
        contact_tolerance=about.get("contact_tolerance"),
        known_shift=about.get("known_shift"),
        **{key: about[key] for key in PLAIN},
    )
