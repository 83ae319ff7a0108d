"""This command tells whether a scenario is sound, and what of it will be modelled."""

from __future__ import annotations

import typer

from pool_pymunk.cli import lib, opt


def check(scenario: opt.Scenario) -> int:
    """Validate a scenario and say what will be modelled, what will not, and how large it is."""
    scene = lib.scenario.load(scenario)
    typer.echo(f"{lib.scenario.label(scenario)}: sound")
    for line in lib.listing.modelled(scene):
        typer.echo(f"  {line}")
    for line in lib.listing.magnitudes(scene):
        typer.echo(f"  {line}")
    for line in lib.listing.implausible(scene):
        typer.echo(f"Warning: {line}; is a unit or a digit wrong?")
    return 0
