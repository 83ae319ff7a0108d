"""This command lets two balls meet at an offset, as Part 1 of the report does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pool_pymunk.cli.choices import UNITS, law_names
from pool_pymunk.cli.common import InputError
from pool_pymunk.physics.laws import LAWS

if TYPE_CHECKING:
    from rich.table import Table

    from pool_pymunk.model import Point, Units
    from pool_pymunk.report.collide import Collision, Disc

OPTIONS = {  # by what the library calls them
    "a.mass": "--mass-a",
    "b.mass": "--mass-b",
    "a.radius": "--radius",
    "b.radius": "--radius-b",
    "a.velocity": "--velocity-a",
    "b.velocity": "--velocity-b",
    "offset": "--offset",
    "angle": "--angle",
    "restitution": "--restitution",
    "friction": "--friction",
    "law": "--law",
}
KNOWN = ", ".join("|".join(units) for units in UNITS.values())
SUFFIXES = (".png", ".svg", ".pdf")


def collide(
    mass_a: Annotated[str, typer.Option(metavar="MASS", help="Of ball A.")],
    mass_b: Annotated[str, typer.Option(metavar="MASS", help="Of ball B.")],
    radius: Annotated[str, typer.Option(metavar="LENGTH", help="Of both balls.")],
    velocity_a: Annotated[tuple[str, str], typer.Option(metavar="VX VY", help="Of ball A.")],
    velocity_b: Annotated[tuple[str, str], typer.Option(metavar="VX VY", help="Of ball B.")] = (
        "0",
        "0",
    ),
    radius_b: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Of ball B, if it is another.")
    ] = None,
    offset: Annotated[
        str, typer.Option(metavar="LENGTH", help="Of B's centre to the left of A's way.")
    ] = "0",
    angle: Annotated[
        float | None,
        typer.Option(metavar="DEGREES", help="Of the line from A to B, instead of an offset."),
    ] = None,
    restitution: Annotated[float, typer.Option(help="Coefficient of restitution.")] = 1.0,
    friction: Annotated[float, typer.Option(help="Coefficient of friction.")] = 0.0,
    law: Annotated[
        str,
        typer.Option(metavar="|".join(LAWS), help="Contact law.", autocompletion=law_names),
    ] = "coulomb",
    units: Annotated[
        str,
        typer.Option(metavar="U,...", help=f"Of bare numbers, and of what is printed: {KNOWN}."),
    ] = "m,kg,m/s",
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the results here.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it here: png, svg or pdf.")
    ] = None,
) -> int:
    """Two balls meet at an offset: velocities, impulses, momentum and energy before and after.

    A's way is the line on which A comes, seen from B. Numbers may have their own units: 200g,
    2.25in, 2m/s; bare ones are in those of --units, as in a scenario (m cm mm in, kg g, m/s in/s).
    """
    typed = {
        "a.mass": mass_a, "b.mass": mass_b, "a.radius": radius, "b.radius": radius_b or radius,
        "a.velocity": velocity_a, "b.velocity": velocity_b, "offset": offset,
        "angle": angle, "restitution": restitution, "friction": friction, "law": law,
    }  # fmt: skip
    if picture is not None and picture.suffix.lower() not in SUFFIXES:
        raise InputError(f"--picture = {picture}: must end in one of {', '.join(SUFFIXES)}")
    with _as_typed(typed):
        hit, unit = _collision(typed, units)
    _print(hit, unit)
    if json is not None:
        _write_json(hit, json)
    if picture is not None:
        from pool_pymunk.render.collision import collision_picture

        collision_picture(hit, picture, unit)
        typer.echo(f"Picture: {picture}")
    return 0


@contextmanager
def _as_typed(typed: Mapping[str, object]) -> Iterator[None]:
    """Raise bad input, with the options and values as they were typed."""
    from pool_pymunk.model import Problem, SceneError

    try:
        yield
    except SceneError as error:
        problems = {
            str(Problem(OPTIONS.get(p.key, p.key), typed.get(p.key, p.value), p.message))
            for p in error.problems
        }
        raise InputError("\n".join(sorted(problems))) from None


def _collision(typed: Mapping[str, Any], units: str) -> tuple[Collision, Units]:
    from pool_pymunk.model.quantities import quantity, read_units
    from pool_pymunk.report.collide import Material, collide, collide_at

    unit = read_units("--units", units)
    a, b = (_disc(name, typed, unit) for name in "ab")
    material = Material(typed["restitution"], typed["friction"], typed["law"])
    offset = quantity("offset", typed["offset"], "length", unit)
    if typed["angle"] is None:
        return collide(a, b, offset, material), unit
    if offset != 0.0:
        raise InputError("--angle and --offset: one of the two")
    return collide_at(a, b, math.radians(typed["angle"]), material), unit


def _disc(name: str, typed: Mapping[str, Any], units: Units) -> Disc:
    from pool_pymunk.model.quantities import quantity, vector
    from pool_pymunk.report.collide import Disc

    return Disc(
        quantity(f"{name}.mass", typed[f"{name}.mass"], "mass", units),
        quantity(f"{name}.radius", typed[f"{name}.radius"], "length", units),
        vector(f"{name}.velocity", typed[f"{name}.velocity"], "speed", units),
    )


# -- the terminal ----------------------------------------------------------------------------------


def _print(hit: Collision, units: Units) -> None:
    from rich.console import Console

    offset, reach = (units.from_si(x, "length") for x in (hit.offset, hit.reach))
    before, after = hit.energy
    typer.echo(
        f"Offset {_six(offset)} of {_six(reach)} {units.length}; line of centres from A to B at "
        f"{_six(math.degrees(hit.angle))}° to x"
    )
    Console(width=None if Console().is_terminal else 100, highlight=False).print(_table(hit, units))
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


def _table(hit: Collision, units: Units) -> Table:
    """Return velocities, impulses and momentum along x and y, and along n and t."""
    from rich.table import Table

    table = Table()
    for heading in ("", "unit", "x", "y", "n", "t"):
        table.add_column(heading, justify="right" if len(heading) == 1 else "left")
    mass, speed = units.to_si(1.0, "mass"), units.to_si(1.0, "speed")
    fastest = max(math.hypot(*ball.velocity) for ball in (hit.a, hit.b))
    rows = (("A", hit.a, hit.velocity_a), ("B", hit.b, hit.velocity_b))
    for name, ball, velocity in rows:
        for when, v in (("before", ball.velocity), ("after", velocity)):
            cells = _four(hit, v, speed, fastest)
            table.add_row(f"velocity of {name} {when}", units.speed, *cells)
        table.rows[-1].end_section = True
    (before, after), heaviest = hit.momentum, max(hit.a.mass, hit.b.mass)
    given = [(f"impulse on {n}", _impulse(ball, velocity)) for n, ball, velocity in rows]
    for name, v in (*given, ("momentum before", before), ("momentum after", after)):
        cells = _four(hit, v, mass * speed, heaviest * fastest)
        table.add_row(name, f"{units.mass} {units.speed}", *cells)
    return table


def _impulse(ball: Disc, after: Point) -> Point:
    (vx, vy), (wx, wy) = ball.velocity, after
    return (ball.mass * (wx - vx), ball.mass * (wy - vy))


def _four(hit: Collision, v: Point, unit: float, largest: float) -> list[str]:
    """Return a vector along x and y, and along n and t; what is only rounding is zero."""
    from pool_pymunk.physics.contact import split

    parts = (0.0 if abs(x) < 1e-14 * largest else x / unit for x in (*v, *split(v, hit.normal)))
    return [_six(part) for part in parts]


def _six(value: float) -> str:
    """Return six digits of a number; zero has no sign."""
    return f"{value + 0.0:.6g}"


def _write_json(hit: Collision, path: Path) -> None:
    import json

    from pool_pymunk import __version__
    from pool_pymunk.safety.files import whole

    content = {"version": __version__, **hit.as_dict()}
    with whole(path) as part:
        part.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
