"""This command lets two balls meet at an offset, as Part 1 of the report does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import say, write_json

REST = ("0", "0")


def collide(
    mass_a: Annotated[str, opt.option("The mass of ball A.", "MASS")],
    mass_b: Annotated[str, opt.option("The mass of ball B.", "MASS")],
    radius: Annotated[str, opt.option("The radius of both balls.", "LENGTH")],
    velocity_a: Annotated[tuple[str, str], opt.option("The velocity of ball A.", "VX VY")],
    velocity_b: Annotated[tuple[str, str], opt.option("The velocity of ball B.", "VX VY")] = REST,
    radius_b: Annotated[
        str | None, opt.option("The radius of ball B, if it differs.", "LENGTH", for_experts=True)
    ] = None,
    offset: Annotated[str, opt.option("How far B's centre lies left of A's path.", "LENGTH")] = "0",
    angle: Annotated[
        str | None, opt.option("Direction from A to B in touch, instead of an offset.", "DEGREES")
    ] = None,
    restitution: Annotated[float, opt.option("Coefficient of restitution.")] = 1.0,
    friction: Annotated[float, opt.option("Coefficient of friction.")] = 0.0,
    law: Annotated[
        str,
        opt.option("Contact law.", opt.LAW_NAMES, autocompletion=opt.law_names, for_experts=True),
    ] = "coulomb",
    units: Annotated[
        str, opt.option(f"Units of numbers without one, and of the output: {opt.KNOWN}.", "U,...")
    ] = "m,kg,m/s",
    json: opt.JsonFile = None,
    picture: Annotated[Path | None, opt.option("A png, svg or pdf file.", "FILE")] = None,
) -> int:
    """Two balls meet at an offset: velocities, impulses, momentum and energy before and after.

    A's path is the straight line on which A comes, as seen from B. Numbers may have units: 200g,
    2.25in, 2m/s; numbers without a unit are in those of --units.
    """
    typed = {
        "a.mass": mass_a, "b.mass": mass_b, "a.radius": radius, "b.radius": radius_b or radius,
        "a.velocity": velocity_a, "b.velocity": velocity_b, "offset": offset,
        "angle": angle, "restitution": restitution, "friction": friction, "law": law,
    }  # fmt: skip
    read.names("--units", units)
    read.ending("--picture", picture, read.PICTURES, f"one of {', '.join(read.PICTURES)}")
    try:
        hit, unit = _collision(typed, units)
    except lib.problems.SceneError as error:
        raise read.InputError(_as_typed(error, typed)) from None
    _print(hit, unit)
    write_json(json, hit.as_dict())
    if picture is not None:
        lib.collision.collision_picture(hit, picture, unit)
        typer.echo(f"Picture: {picture}")
    return 0


def _as_typed(error: lib.problems.SceneError, typed: Mapping[str, object]) -> str:
    """Return the problems, with the options and values as they were typed."""
    lines = set()
    for problem in error.problems:
        key, value = problem.key, typed.get(problem.key, problem.value)
        value = " ".join(value) if isinstance(value, tuple) else value
        if key in typed:
            ball, _, name = key.rpartition(".")
            key = "--radius" if key == "a.radius" else f"--{name}-{ball}".rstrip("-")
        lines.add(str(lib.problems.Problem(key, value, problem.message)))
    return "\n".join(sorted(lines))


def _collision(typed: Mapping[str, Any], units: str) -> tuple[lib.collide.Collision, lib.Units]:
    unit, quantity = lib.quantities.read_units("--units", units), lib.quantities.quantity
    a, b = (
        lib.collide.Disc(
            quantity(f"{ball}.mass", typed[f"{ball}.mass"], "mass", unit),
            quantity(f"{ball}.radius", typed[f"{ball}.radius"], "length", unit),
            lib.quantities.vector(f"{ball}.velocity", typed[f"{ball}.velocity"], "speed", unit),
        )
        for ball in "ab"
    )
    material = lib.collide.Material(typed["restitution"], typed["friction"], typed["law"])
    offset = quantity("offset", typed["offset"], "length", unit)
    if typed["angle"] is None:
        return lib.collide.collide(a, b, offset, material), unit
    if offset != 0.0:
        raise read.InputError("--angle: give either --angle or --offset")
    angle = math.radians(quantity("angle", typed["angle"], "angle", unit))
    return lib.collide.collide_at(a, b, angle, material), unit


def _print(hit: lib.collide.Collision, units: lib.Units) -> None:
    offset, touching = (units.from_si(x, "length") for x in (hit.offset, hit.contact_distance))
    before, after = hit.energy
    for name, ball in (("A", hit.a), ("B", hit.b)):
        mass, radius = units.from_si(ball.mass, "mass"), units.from_si(ball.radius, "length")
        typer.echo(f"Ball {name}: {_six(mass)} {units.mass}, radius {_six(radius)} {units.length}")
    typer.echo(
        f"Offset {_six(offset)} of {_six(touching)} {units.length}; line of centres from A to B at "
        f"{_six(math.degrees(hit.angle))}° to x"
    )
    typer.echo(f"Velocities are in {units.speed}, momentum in {units.mass} {units.speed}")
    columns = (lib.table.TableColumn("", left=True), "x", "y", "n", "t")
    lib.terminal.show(lib.table.ResultTable(columns, _rows(hit, units)))
    lost = f"{1.0 - after / before:z.2%}" if before > 0.0 else ""
    change = f", {lost.lstrip('-')} {'gained' if lost.startswith('-') else 'lost'}" if lost else ""
    typer.echo(f"Kinetic energy: {before:.6g} J before, {after:.6g} J after{change}")
    say(f"Warning: {warning}" for warning in hit.warnings)


def _rows(hit: lib.collide.Collision, units: lib.Units) -> Iterator[list[str]]:
    """Yield velocities, impulses and momentum along x and y, and along n and t."""
    fastest = max(math.hypot(*ball.velocity) for ball in (hit.a, hit.b))
    heaviest, mass = max(hit.a.mass, hit.b.mass), units.to_si(1.0, "mass")
    speed = (units.to_si(1.0, "speed"), fastest)
    momentum = (mass * speed[0], heaviest * fastest)

    def cells(name: str, v: lib.Point, kind: tuple[float, float]) -> list[str]:
        """Return a vector along x and y, and along n and t; what is only rounding is zero."""
        size, largest = kind
        parts = (*v, *lib.contact.split(v, hit.normal))
        return [name, *(_six(0.0 if abs(x) < 1e-14 * largest else x / size) for x in parts)]

    balls = (("A", hit.a, hit.velocity_a), ("B", hit.b, hit.velocity_b))
    for name, ball, velocity in balls:
        yield cells(f"velocity of {name} before", ball.velocity, speed)
        yield cells(f"velocity of {name} after", velocity, speed)
        yield []
    for name, ball, (vx, vy) in balls:
        impulse = (ball.mass * (vx - ball.velocity[0]), ball.mass * (vy - ball.velocity[1]))
        yield cells(f"impulse on {name}", impulse, momentum)
    for when, both in zip(("before", "after"), hit.momentum, strict=True):
        yield cells(f"momentum {when}", both, momentum)


def _six(value: float) -> str:
    """Return six digits of a number; zero has no sign."""
    return f"{value + 0.0:.6g}"
