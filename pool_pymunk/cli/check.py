"""This command tells whether a scenario is sound, and what of it will be modelled."""

from __future__ import annotations

import typer

from pool_pymunk.cli import lib, opt


def check(scenario: opt.Scenario) -> int:
    """Validate a scenario and say what will be modelled and what will not."""
    scene = lib.scenario.load(scenario)
    typer.echo(f"{lib.scenario.label(scenario)}: sound")
    for line in lib.listing.modelled(scene):
        typer.echo(f"  {line}")
    return 0
