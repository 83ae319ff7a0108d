"""This command lets two balls meet at an offset, as Part 1 of the report does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.choices import UNITS, law_names
from pool_pymunk.cli.common import write_json
from pool_pymunk.cli.read import InputError

KNOWN = ", ".join("|".join(units) for units in UNITS.values())


def collide(
    mass_a: Annotated[str, opt.option("Of ball A.", "MASS")],
    mass_b: Annotated[str, opt.option("Of ball B.", "MASS")],
    radius: Annotated[str, opt.option("Of both balls.", "LENGTH")],
    velocity_a: Annotated[tuple[str, str], opt.option("Of ball A.", "VX VY")],
    velocity_b: Annotated[tuple[str, str], opt.option("Of ball B.", "VX VY")] = ("0", "0"),
    radius_b: Annotated[str | None, opt.option("Of ball B, if it is another.", "LENGTH")] = None,
    offset: Annotated[str, opt.option("Of B's centre to the left of A's line.", "LENGTH")] = "0",
    angle: Annotated[
        float | None, opt.option("Of the line from A to B, instead of an offset.", "DEGREES")
    ] = None,
    restitution: Annotated[float, opt.option("Coefficient of restitution.")] = 1.0,
    friction: Annotated[float, opt.option("Coefficient of friction.")] = 0.0,
    law: Annotated[
        str, opt.option("Contact law.", opt.LAW_NAMES, autocompletion=law_names)
    ] = "coulomb",
    units: Annotated[
        str, opt.option(f"Of bare numbers, and of what is printed: {KNOWN}.", "U,...")
    ] = "m,kg,m/s",
    json: opt.JsonFile = None,
    picture: Annotated[Path | None, opt.option("Draw it here: png, svg or pdf.", "FILE")] = None,
) -> int:
    """Two balls meet at an offset: velocities, impulses, momentum and energy before and after.

    A's line is the one on which A comes, seen from B. Numbers may have their own units: 200g,
    2.25in, 2m/s; bare ones are in those of --units, as in a scenario (m cm mm in, kg g, m/s in/s).
    """
    typed = {
        "a.mass": mass_a, "b.mass": mass_b, "a.radius": radius, "b.radius": radius_b or radius,
        "a.velocity": velocity_a, "b.velocity": velocity_b, "offset": offset,
        "angle": angle, "restitution": restitution, "friction": friction, "law": law,
    }  # fmt: skip
    read.ending("--picture", picture, read.PICTURES, f"one of {', '.join(read.PICTURES)}")
    try:
        hit, unit = _collision(typed, units)
    except lib.problems.SceneError as error:
        raise InputError(_as_typed(error, typed)) from None
    _print(hit, unit)
    write_json(json, hit.as_dict())
    if picture is not None:
        lib.collision.collision_picture(hit, picture, unit)
        typer.echo(f"Picture: {picture}")
    return 0


def _as_typed(error: lib.SceneError, typed: Mapping[str, object]) -> str:
    """Return the problems, with the options and values as they were typed."""
    lines = set()
    for problem in error.problems:
        key, value = problem.key, typed.get(problem.key, problem.value)
        if key in typed:
            ball, _, name = key.rpartition(".")
            key = "--radius" if key == "a.radius" else f"--{name}-{ball}".rstrip("-")
        lines.add(str(lib.problems.Problem(key, value, problem.message)))
    return "\n".join(sorted(lines))


def _collision(typed: Mapping[str, Any], units: str) -> tuple[lib.Collision, lib.Units]:
    unit = lib.quantities.read_units("--units", units)

    def number(key: str, kind: str) -> float:
        return lib.quantities.quantity(key, typed[key], kind, unit)

    a, b = (
        lib.collide.Disc(
            number(f"{ball}.mass", "mass"),
            number(f"{ball}.radius", "length"),
            lib.quantities.vector(f"{ball}.velocity", typed[f"{ball}.velocity"], "speed", unit),
        )
        for ball in "ab"
    )
    material = lib.collide.Material(typed["restitution"], typed["friction"], typed["law"])
    offset = number("offset", "length")
    if typed["angle"] is None:
        return lib.collide.collide(a, b, offset, material), unit
    if offset != 0.0:
        raise InputError("--angle and --offset: one of the two")
    return lib.collide.collide_at(a, b, math.radians(typed["angle"]), material), unit


# -- the terminal ----------------------------------------------------------------------------------


def _print(hit: lib.Collision, units: lib.Units) -> None:
    offset, touching = (units.from_si(x, "length") for x in (hit.offset, hit.contact_distance))
    before, after = hit.energy
    typer.echo(
        f"Offset {_six(offset)} of {_six(touching)} {units.length}; line of centres from A to B at "
        f"{_six(math.degrees(hit.angle))}° to x"
    )
    headings = ("", "unit", "x", "y", "n", "t")
    lib.terminal.show(lib.terminal.TextTable(headings, _rows(hit, units), left=("", "unit")))
    change = f", {_change(1.0 - after / before)}" if before > 0.0 else ""
    typer.echo(f"Kinetic energy: {before:.6g} J before, {after:.6g} J after{change}")
    for warning in hit.warnings:
        typer.echo(f"Warning: {warning}")


def _change(lost: float) -> str:
    """Return in words what share of the energy was lost, or gained.

    >>> _change(0.25), _change(-2e-16), _change(-0.01)
    ('25.00% lost', '0.00% lost', '1.00% gained')
    """
    text = f"{abs(lost):.2%}"
    return f"{text} gained" if lost < 0.0 and text != "0.00%" else f"{text} lost"


def _rows(hit: lib.Collision, units: lib.Units) -> Iterator[list[str]]:
    """Yield velocities, impulses and momentum along x and y, and along n and t."""
    mass, speed = units.to_si(1.0, "mass"), units.to_si(1.0, "speed")
    fastest = max(math.hypot(*ball.velocity) for ball in (hit.a, hit.b))
    balls = (("A", hit.a, hit.velocity_a), ("B", hit.b, hit.velocity_b))
    for name, ball, velocity in balls:
        for when, v in (("before", ball.velocity), ("after", velocity)):
            yield [f"velocity of {name} {when}", units.speed, *_four(hit, v, speed, fastest)]
        yield []
    (before, after), heaviest = hit.momentum, max(hit.a.mass, hit.b.mass)
    given = [(f"impulse on {n}", _impulse(ball, velocity)) for n, ball, velocity in balls]
    for name, v in (*given, ("momentum before", before), ("momentum after", after)):
        cells = _four(hit, v, mass * speed, heaviest * fastest)
        yield [name, f"{units.mass} {units.speed}", *cells]


def _impulse(ball: lib.collide.Disc, after: lib.Point) -> lib.Point:
    return ball.mass * (after[0] - ball.velocity[0]), ball.mass * (after[1] - ball.velocity[1])


def _four(hit: lib.Collision, v: lib.Point, unit: float, largest: float) -> list[str]:
    """Return a vector along x and y, and along n and t; what is only rounding is zero."""
    parts = (
        0.0 if abs(x) < 1e-14 * largest else x / unit
        for x in (*v, *lib.contact.split(v, hit.normal))
    )
    return [_six(part) for part in parts]


def _six(value: float) -> str:
    """Return six digits of a number; zero has no sign."""
    return f"{value + 0.0:.6g}"
