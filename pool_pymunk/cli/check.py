"""This command tells whether a scenario is sound, and what of it will be modelled."""

from __future__ import annotations

import typer

from pool_pymunk.cli.common import Scenario, read_scenario


def check(scenario: Scenario) -> int:
    """Validate a scenario and say what will be modelled and what will not."""
    from pool_pymunk.model.scenario import label
    from pool_pymunk.report.listing import modelled

    scene = read_scenario(scenario)
    typer.echo(f"{label(scenario)}: sound")
    for line in modelled(scene):
        typer.echo(f"  {line}")
    return 0
