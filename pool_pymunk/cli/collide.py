"""This command lets two balls meet at an offset, as Part 1 of the report does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import typer

from pool_pymunk.cli import read
from pool_pymunk.cli.lines import InputError, say
from pool_pymunk.cli.options import CollideOptions
from pool_pymunk.cli.output import write_json
from pool_pymunk.cli.terminal import show
from pool_pymunk.laws.contact import split
from pool_pymunk.model import Point, Units
from pool_pymunk.model.problems import Problem, SceneError
from pool_pymunk.model.quantities import quantity, read_units, vector
from pool_pymunk.report.collide import Collision, Disc, Material, collide_at
from pool_pymunk.report.collide import collide as collide_off
from pool_pymunk.report.listing import odd_density
from pool_pymunk.results.table import ResultTable, TableColumn


def collide(asked: CollideOptions) -> int:
    """Let the balls collide, and print what changes."""
    radius = asked.radius
    typed = {
        "a.mass": asked.mass_a, "b.mass": asked.mass_b, "a.radius": radius,
        "b.radius": asked.radius_b or radius, "a.velocity": asked.velocity_a,
        "b.velocity": asked.velocity_b, "offset": asked.offset, "angle": asked.angle,
        "restitution": asked.restitution, "friction": asked.friction, "law": asked.law,
    }  # fmt: skip
    read.names("--units", asked.units)
    read.ending("--picture", asked.picture, read.PICTURES, f"one of {', '.join(read.PICTURES)}")
    try:
        hit, unit = _collision(typed, asked.units)
    except SceneError as error:
        raise InputError(_as_typed(error, typed)) from None
    _print(hit, unit)
    for ball, disc in (("A", hit.a), ("B", hit.b)):
        doubts = odd_density(ball, disc.mass, disc.radius)
        say(f"Warning: {doubt}; is a unit or a digit wrong?" for doubt in doubts)
    write_json(asked.json, {}, hit.as_dict())
    if asked.picture is not None:
        from pool_pymunk.render.collision import collision_picture

        collision_picture(hit, asked.picture, unit)
        typer.echo(f"Picture: {asked.picture}")
    return 0


def _as_typed(error: SceneError, typed: Mapping[str, object]) -> str:
    """Return the problems, with the options and values as they were typed."""
    lines = set()
    for problem in error.problems:
        key, value = problem.key, typed.get(problem.key, problem.value)
        value = " ".join(value) if isinstance(value, tuple) else value
        if key in typed:
            ball, _, name = key.rpartition(".")
            key = "--radius" if key == "a.radius" else f"--{name}-{ball}".rstrip("-")
        lines.add(str(Problem(key, value, problem.message)))
    return "\n".join(sorted(lines))


def _collision(typed: Mapping[str, Any], units: str) -> tuple[Collision, Units]:
    unit = read_units("--units", units)
    a, b = (
        Disc(
            quantity(f"{ball}.mass", typed[f"{ball}.mass"], "mass", unit),
            quantity(f"{ball}.radius", typed[f"{ball}.radius"], "length", unit),
            vector(f"{ball}.velocity", typed[f"{ball}.velocity"], "speed", unit),
        )
        for ball in "ab"
    )
    material = Material(typed["restitution"], typed["friction"], typed["law"])
    offset = quantity("offset", typed["offset"], "length", unit)
    if typed["angle"] is None:
        return collide_off(a, b, offset, material), unit
    if offset != 0.0:
        raise InputError("--angle: give either --angle or --offset")
    angle = math.radians(quantity("angle", typed["angle"], "angle", unit))
    return collide_at(a, b, angle, material), unit


def _print(hit: Collision, units: Units) -> None:
    offset, touching = (units.from_si(x, "length") for x in (hit.offset, hit.contact_distance))
    before, after = hit.energy
    for name, ball in (("A", hit.a), ("B", hit.b)):
        mass, radius = units.from_si(ball.mass, "mass"), units.from_si(ball.radius, "length")
        typer.echo(f"Ball {name}: {_six(mass)} {units.mass}, radius {_six(radius)} {units.length}")
    typer.echo(
        f"Offset {_six(offset)} of {_six(touching)} {units.length}; line of centres from A to B at "
        f"{_six(math.degrees(hit.angle))}° to x"
    )
    typer.echo(f"Velocities are in {units.speed}, momentum in N s")
    columns = (TableColumn("", left=True), "x", "y", "n", "t")
    show(ResultTable(columns, _rows(hit, units)))
    lost = f"{1.0 - after / before:z.2%}" if before > 0.0 else ""
    change = f", {lost.lstrip('-')} {'gained' if lost.startswith('-') else 'lost'}" if lost else ""
    typer.echo(f"Kinetic energy: {before:.6g} J before, {after:.6g} J after{change}")
    say(f"Warning: {warning}" for warning in hit.warnings)


def _rows(hit: Collision, units: Units) -> Iterator[list[str]]:
    """Yield velocities, impulses and momentum along x and y, and along n and t."""
    fastest = max(math.hypot(*ball.velocity) for ball in (hit.a, hit.b))
    speed = (units.to_si(1.0, "speed"), fastest)
    momentum = (1.0, max(hit.a.mass, hit.b.mass) * fastest)

    def cells(name: str, v: Point, kind: tuple[float, float]) -> list[str]:
        """Return a vector along x and y, and along n and t; what is only rounding is zero."""
        size, largest = kind
        parts = (*v, *split(v, hit.normal))
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
