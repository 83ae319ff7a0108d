"""This module reads what is typed: a scenario, shots, times, sizes, lengths, angles and speeds."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from pool_pymunk.cli import lib, opt

KINDS = {"start": "length", "noise.speed": "speed"}  # of a sweep's own keys
PICTURES = tuple(f".{form}" for form in opt.PICTURES)


class InputError(ValueError):
    """This error is bad input; its text has one line a problem, and the exit code is 2."""


def seconds(key: str, text: str | None) -> float | None:
    """Return a time (s) as typed, which must be greater than 0; None if none is typed.

    >>> seconds("--dt", "1/240") == 1 / 240, seconds("--dt", "0.1 ms"), seconds("--dt", None)
    (True, 0.0001, None)
    """
    return (
        None if text is None else lib.quantities.positive(key, text, "time", lib.quantities.Units())
    )


def length(key: str, text: str, units: lib.Units) -> float:
    """Return a length (m) as typed, greater than 0; without a unit it is in the scenario's."""
    return lib.quantities.positive(key, text, "length", units)


def shots(scene: lib.Scene, name: str | None) -> list[lib.Shot | None]:
    """Return the shots asked for: all of the scene's, or one by its number from 1 or its name."""
    if name is None:
        return list(scene.shots) or [None]
    for k, shot in enumerate(scene.shots, start=1):
        if name in (str(k), shot.name):
            return [shot]
    meant = lib.problems.suggestion(name, [shot.name for shot in scene.shots])
    known = shot_names(scene) or "none"
    raise InputError(f"--shot = {name}: there is no such shot (there are: {known}){meant}")


def shot_names(scene: lib.Scene) -> str:
    """Return the shots' numbers and names, as a message lists them."""
    return ", ".join(f"{k} ({shot.name})" for k, shot in enumerate(scene.shots, start=1))


def names(key: str, text: str) -> list[str]:
    """Return the names in a list with commas, one or more."""
    if not text.strip(" ,"):
        raise InputError(f"{key} = {text}: give one name or more")
    return [name.strip() for name in text.split(",")]


def one_of(key: str, text: str, known: Collection[str]) -> None:
    """Raise InputError for a word that is not among the known ones."""
    if text not in known:
        raise InputError(f"{key} = {text}: must be one of {', '.join(known)}")


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


def numbers(key: str, text: str, units: lib.Units, kind: str = "") -> tuple[float, ...]:
    """Return numbers with colons between them; those of a ``kind`` in SI, angles in degrees."""
    parts = text.split(":")
    if kind != "":
        return tuple(lib.quantities.quantity(key, part, kind, units) for part in parts)
    try:
        return tuple(map(float, parts))
    except ValueError:
        raise InputError(f"{key} = {text}: must be numbers, LOW:HIGH") from None


def interval(key: str, text: str, units: lib.Units, kind: str) -> tuple[float, float]:
    """Return LOW:HIGH, as :func:`numbers` reads them."""
    found = numbers(key, text, units, kind)
    if len(found) != 2:
        raise InputError(f"{key} = {text}: must be LOW:HIGH")
    low, high = found
    if not low < high:
        raise InputError(f"{key} = {text}: LOW must be less than HIGH")
    return low, high


def pairs(key: str, texts: Sequence[str] | None) -> Iterator[tuple[str, str]]:
    """Yield the key and the value of each KEY=VALUE."""
    seen = set()
    for text in texts or ():
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"{key} = {text}: must be KEY=LOW:HIGH")
        if name in seen:
            raise InputError(f"{key} = {text}: {name} stands there twice")
        seen.add(name)
        yield name.strip(), value


def inputs(key: str, texts: Sequence[str] | None, units: lib.Units) -> dict[str, tuple[float, ...]]:
    """Return inputs of a scenario with their numbers, in SI, from KEY=LOW:HIGH."""
    return {name: input_values(key, name, text, units) for name, text in pairs(key, texts)}


def input_values(key: str, name: str, text: str, units: lib.Units) -> tuple[float, ...]:
    """Return the numbers of one input, in SI; the table of inputs has its quantity."""
    row = lib.inputs.TABLE.get(lib.inputs.parts(name)[0])
    kind = row.quantity or "" if row else KINDS.get(name, "")
    found = numbers(f"{key} {name}", text, units, kind)
    if len(found) == 2 and not found[0] <= found[1]:
        raise InputError(f"{key} {name} = {text}: LOW must not be above HIGH")
    return found
