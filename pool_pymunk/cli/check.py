"""This command tells whether a scenario is sound, and what of it will be modelled."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt
from pool_pymunk.cli.common import CORE, say
from pool_pymunk.safety.files import bundled


def _print_schema(is_asked: bool) -> None:
    if is_asked:
        say([json.dumps(lib.schema.scenario_schema(), indent=2, ensure_ascii=False)])
        raise typer.Exit


def check(
    scenario: opt.Scenario,
    schema: Annotated[
        bool,
        opt.option(
            "Print the JSON schema of scenario files, for editors, and no more.",
            None, "--schema", is_eager=True, callback=_print_schema,
        ),
    ] = False,
) -> int:  # fmt: skip
    """Validate a scenario, and say what will be modelled, what will not, and its sizes."""
    scene = lib.scenario.load(scenario)
    say([f"{scenario}: sound"])
    if scenario in bundled():
        say([f"  file: {bundled()[scenario]}"])
    say(f"  {line}" for line in (*lib.listing.modelled(scene), *lib.listing.magnitudes(scene)))
    say([f"  {CORE}"])
    say(f"Warning: {x}; is a unit or a digit wrong?" for x in lib.listing.implausible(scene))
    return 0
