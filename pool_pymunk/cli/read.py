"""This module reads what is typed: scenes, shots, solvers and their steps, numbers and lengths."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from pool_pymunk.cli import options
from pool_pymunk.cli.lines import InputError
from pool_pymunk.laws import LAWS
from pool_pymunk.many.workers import Workers, cores
from pool_pymunk.model import Scene, Shot, Units, inputs, scenario
from pool_pymunk.model.problems import SettingError, suggestion
from pool_pymunk.model.quantities import positive, quantity
from pool_pymunk.safety.files import check_place
from pool_pymunk.solvers import SOLVERS, find_solver, options_for, reference_solver, request
from pool_pymunk.studies.grid import Column
from pool_pymunk.studies.uncertainty import digits_sentence, written_uncertainty

ALL = "all"  # of --solvers
LONGEST = f"takes longest; --solvers {ALL} plays it, too"
KINDS = {"start": "length", "noise.speed": "speed"}  # of a sweep's own keys
PICTURES = tuple(f".{form}" for form in options.PICTURES)

Widths = float | Mapping[str, tuple[float, float]]  # m, of all starts or of each ball's


# -- what is played --------------------------------------------------------------------------------


def scene(asked: options.Asked, other: str | None = None) -> Scene:
    """Return the scene, or another one, with the law and the latest time of its shots as typed."""
    found = scenario.load(other or asked.scenario)
    latest = seconds("--max-time", asked.max_time) or found.physics.max_time
    law = asked.law or found.physics.law
    return replace(found, physics=replace(found.physics, law=law, max_time=latest))


def shots(found: Scene, name: str | None) -> list[Shot | None]:
    """Return the shots asked for: all of the scene's, or one by its number from 1 or its name."""
    if name is None:
        return list(found.shots) or [None]
    for k, shot in enumerate(found.shots, start=1):
        if name in (str(k), shot.name):
            return [shot]
    meant = suggestion(name, [shot.name for shot in found.shots])
    known = shot_names(found) or "none"
    raise InputError(f"--shot = {name}: there is no such shot (there are: {known}){meant}")


def shot_names(found: Scene) -> str:
    """Return the shots' numbers and names, as a message lists them."""
    return ", ".join(f"{k} ({shot.name})" for k, shot in enumerate(found.shots, start=1))


def folder(out: Path | None, scenario: str, inside: str = "") -> Path:
    """Return where files go: as typed, or in renders/<scenario>. Raises OSError if none can."""
    found = out or Path("renders") / Path(scenario).stem / inside
    check_place(found, is_folder=True)
    return found


# -- by whom it is played --------------------------------------------------------------------------


def solver_options(asked: options.AnySolver, solver: str, units: Units) -> dict[str, Any]:
    """Return the solver's options; a solver without a tolerance does not get one."""
    found: dict[str, Any] = {} if asked.friction is None else {"friction": asked.friction}
    if asked.contact_tolerance is not None:
        tolerance = length("--contact-tolerance", asked.contact_tolerance, units)
        if find_solver(solver).to_tolerance:
            found["contact_tolerance"] = tolerance
    return found


def column(asked: options.BySolver, found: Scene) -> Column:
    """Return the solver and its step as typed; an error names an option that does not fit."""
    step, solver = seconds("--dt", asked.dt), asked.solver
    more = solver_options(asked, solver, found.units)
    request(found, solver, law=asked.law, **more)
    if asked.dt is not None and find_solver(solver).dt is None:
        raise InputError(f"--dt = {asked.dt}: {solver} has no time step")
    if asked.contact_tolerance is not None and "contact_tolerance" not in more:
        message = f"{solver} does not play contacts to a tolerance"
        raise InputError(f"--contact-tolerance = {asked.contact_tolerance}: {message}")
    return Column(solver, step, options=more)


def columns(
    asked: options.BySolvers, found: Scene, dt: float | None = None, every: bool = False
) -> tuple[list[Column], dict[str, str]]:
    """Return the columns of --solvers, by default of all solvers, and why others are left out.

    Solvers without a typed step have the step ``dt`` (s), or their own, or ``every`` one. Those
    that are named must be able to play the scene.
    """
    named = asked.solvers not in (None, ALL)
    known = sorted(SOLVERS.values(), key=lambda solver: solver.dt is None)
    usual = [solver.name for solver in known if every or not solver.is_reference]
    its, left_out = list[Column](), dict[str, str]()
    for name in names("--solvers", asked.solvers or "") if named else usual:
        one = setting(name, "--solvers", dt, laws=())
        more = solver_options(asked, one.solver, found.units)
        more = more if named else options_for(find_solver(one.solver), more)
        try:
            request(found, one.solver, **more)
        except SettingError as error:
            if named:
                raise
            left_out[name] = str(error).partition(": ")[2]
        else:
            its += [each._replace(options=more) for each in one.at_steps(every)]
    longest = [each for each in its if each.is_longest and asked.solvers is None]
    left_out |= {str(each): LONGEST for each in longest}
    return [each for each in its if each not in longest], left_out


def reference(asked: options.AnySolver, found: Scene) -> Column:
    """Return the exact solver, with which others are compared."""
    name = reference_solver().name
    more = solver_options(replace(asked, friction=None), name, found.units)
    return Column(name, options=more)


def setting(
    text: str, key: str = "--overlay", dt: float | None = None, laws: Collection[str] = LAWS
) -> Column:
    """Return a setting as typed: a solver, then in any order a step (else ``dt``, s) and a law.

    >>> setting("pymunk:1/64:published")[:3]
    ('pymunk', 0.015625, 'published')
    """
    solver, *more = (part.strip() for part in text.split(":"))
    try:
        has_step = find_solver(solver).dt is not None
    except SettingError as error:
        raise InputError(str(error).replace("solver =", f"{key} =", 1)) from None
    law = [part for part in more if part in laws]
    steps = [part for part in more if part not in laws]
    if len(law) > 1 or len(steps) > 1:
        behind = ":DT and :LAW" if laws else ":DT"
        raise InputError(f"{key} = {text}: must be a solver, and may have {behind} behind it")
    if steps and not has_step:
        raise InputError(f"{key} = {text}: {solver} has no time step")
    step = seconds(key, steps[0]) if steps else dt if has_step else None
    return Column(solver, step, law[0] if law else None)


@contextmanager
def players(asked: options.Shared) -> Iterator[Any]:
    """Yield what plays many shots: processes on all cores, or a Dask cluster."""
    if asked.workers is not None and asked.cluster is not None:
        raise InputError("--workers: a --cluster has workers of its own")
    if asked.cluster is None:
        with Workers(cores() if asked.workers is None else asked.workers) as found:
            yield found
        return
    if find_spec("distributed") is None:
        raise InputError("--cluster: needs Dask: pip install 'pool-pymunk[cluster]'")
    try:
        client: Any = import_module("distributed").Client(asked.cluster, timeout=10)
    except (OSError, ValueError) as error:
        said = f"no scheduler answers ({str(error).splitlines()[0]})"
        raise InputError(f"--cluster = {asked.cluster}: {said}") from None
    with client:
        yield client.get_executor(retries=3)


# -- numbers and words -----------------------------------------------------------------------------


def seconds(key: str, text: str | None) -> float | None:
    """Return a time (s) as typed, which must be greater than 0; None if none is typed.

    >>> seconds("--dt", "1/240") == 1 / 240, seconds("--dt", "0.1 ms"), seconds("--dt", None)
    (True, 0.0001, None)
    """
    return None if text is None else positive(key, text, "time", Units())


def length(key: str, text: str, units: Units) -> float:
    """Return a length (m) as typed, greater than 0; without a unit it is in the scenario's."""
    return positive(key, text, "length", units)


def position_errors(asked: options.Uncertain, name: str, found: Scene) -> tuple[Widths, str]:
    """Return half the widths (m) of starts, as typed or by last digits, and whence they are."""
    key, typed = "--position-error", asked.position_error
    if typed is not None:
        return quantity(key, typed, "length", found.units, 0.0), ""
    widths = written_uncertainty(name).position
    if not isinstance(widths, Mapping) or widths.keys() != found.index.keys():
        raise InputError(f"{key}: is missing; the scenario cannot be read twice")
    return widths, digits_sentence(name)


def names(key: str, text: str) -> list[str]:
    """Return the names in a list with commas, one or more."""
    if not text.strip(" ,"):
        raise InputError(f"{key} = {text}: give one name or more")
    return [name.strip() for name in text.split(",")]


def one_of(key: str, text: str, known: Collection[str]) -> None:
    """Raise InputError for a word that is not among the known ones."""
    if text not in known:
        raise InputError(f"{key} = {text}: must be one of {', '.join(known)}")


def at_least(least: float, **typed: float) -> None:
    """Raise InputError for a number that is less than this."""
    for name, value in typed.items():
        if not value >= least:
            raise InputError(f"--{name} = {value}: must be {least} or more")


def ending(key: str, path: Path | None, known: Sequence[str], said: str) -> None:
    """Raise InputError for a file whose name does not end as it must."""
    if path is not None and path.suffix.lower() not in known:
        raise InputError(f"{key} = {path}: must end in {said}")


def size(text: str, said: str, smallest: int = 0) -> tuple[int, int]:
    """Return a width and a height in pixels as typed; ``said`` is the message for anything else."""
    sides = [part.strip() for part in text.lower().split("x")]
    if len(sides) != 2 or not all(side.isdecimal() and int(side) >= smallest for side in sides):
        raise InputError(f"--size = {text}: {said}")
    return int(sides[0]), int(sides[1])


def numbers(key: str, text: str, units: Units, kind: str = "") -> tuple[float, ...]:
    """Return numbers with colons between them; those of a ``kind`` in SI, angles in degrees."""
    parts = text.split(":")
    if ".." in text:
        raise InputError(f"{key} = {text}: must be LOW:HIGH")
    if kind != "":
        return tuple(quantity(key, part, kind, units) for part in parts)
    try:
        return tuple(map(float, parts))
    except ValueError:
        raise InputError(f"{key} = {text}: must be numbers, LOW:HIGH") from None


def interval(key: str, text: str, units: Units, kind: str) -> tuple[float, float]:
    """Return LOW:HIGH, as :func:`numbers` reads them."""
    found = numbers(key, text, units, kind)
    if len(found) != 2:
        raise InputError(f"{key} = {text}: must be LOW:HIGH")
    low, high = found
    if not low < high:
        raise InputError(f"{key} = {text}: LOW must be less than HIGH")
    return low, high


def varied(key: str, texts: Sequence[str] | None, units: Units) -> dict[str, tuple[float, ...]]:
    """Return inputs of a scenario with their numbers, in SI, from KEY=LOW:HIGH."""
    return {name: input_values(key, name, text, units) for name, text in pairs(key, texts)}


def widths(key: str, texts: Sequence[str] | None, units: Units) -> dict[str, float]:
    """Return half the widths of inputs, in SI, from KEY=WIDTH."""
    found = dict[str, float]()
    for name, text in pairs(key, texts, "WIDTH"):
        width, *more = input_values(key, name, text, units)
        if more:
            raise InputError(f"{key} {name} = {text}: must be one number")
        found[name] = width
    return found


def pairs(
    key: str, texts: Sequence[str] | None, value: str = "LOW:HIGH"
) -> Iterator[tuple[str, str]]:
    """Yield the key and the value of each KEY=VALUE."""
    seen = set()
    for text in texts or ():
        name, equals, typed = text.partition("=")
        if not equals:
            raise InputError(f"{key} = {text}: must be KEY={value}")
        if name in seen:
            raise InputError(f"{key} = {text}: {name} stands there twice")
        seen.add(name)
        yield name.strip(), typed


def input_values(key: str, name: str, text: str, units: Units) -> tuple[float, ...]:
    """Return the numbers of one input, in SI; the table of inputs has its quantity."""
    row = inputs.TABLE.get(inputs.parts(name)[0])
    kind = row.quantity or "" if row else KINDS.get(name, "")
    found = numbers(f"{key} {name}", text, units, kind)
    if len(found) == 2 and not found[0] <= found[1]:
        raise InputError(f"{key} {name} = {text}: LOW must not be above HIGH")
    return found
