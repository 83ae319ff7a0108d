"""``check``: is the scenario sound, and what of it will be modelled?"""

from __future__ import annotations

import typer

from pool_pymunk.cli.common import Scenario, read_scenario


def check(scenario: Scenario) -> int:
    """Validate a scenario and say what will be modelled and what will not."""
    from pool_pymunk.listing import modelled
    from pool_pymunk.scenario import label

    scene = read_scenario(scenario)
    typer.echo(f"{label(scenario)}: sound")
    for line in modelled(scene):
        typer.echo(f"  {line}")
    return 0
