"""This command tells whether a scenario is sound, and what of it will be modelled."""

from __future__ import annotations

from pool_pymunk.cli.lines import CORE, say
from pool_pymunk.cli.options import CheckOptions
from pool_pymunk.model import scenario
from pool_pymunk.report import listing
from pool_pymunk.safety.files import bundled


def check(asked: CheckOptions) -> int:
    """Validate a scenario, and say what will be modelled, what will not, and its sizes."""
    scene = scenario.load(asked.scenario)
    say([f"{asked.scenario}: sound"])
    if asked.scenario in bundled():
        say([f"  file: {bundled()[asked.scenario]}"])
    say(f"  {line}" for line in (*listing.modelled(scene), *listing.magnitudes(scene)))
    say([f"  {CORE}"])
    say(f"Warning: {x}; is a unit or a digit wrong?" for x in listing.implausible(scene))
    return 0
