"""This module makes the extremes of many contacts, of runs without end, and of Listing 3."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pool_pymunk.model import (
    Friction,
)  # fmt: skip
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.making import (
    CLOTH,
    LIVELY,
    REST,
    TABLE,
    R,
    crowd,
    into,
    rectangle,
    scene_of,
    unit,
)  # fmt: skip
from pool_pymunk.studies.stability.trial import Case, Extreme

ROWS: list[Extreme] = []
extreme = into(ROWS)

LISTING = "line 132 pushes B with the slip, not against it: momentum is not kept"


@extreme("many contacts", "up to 100,000 without losses", "coulomb")
def many_contacts() -> Iterator[Case]:
    """Play ten balls in a box, without losses, for this many contacts."""
    scene = scene_of(crowd(10, 0.5), rectangle(0.5, 0.5), time=1e6)
    for count in (1_000, 10_000, 100_000):
        yield Case(f"{count}", scene, max_events=count, ends="max_events", slow=count > 1_000)


@extreme("many balls", "up to 1,000")
def many_balls() -> Iterator[Case]:
    """Play a box full of balls, for half a second."""
    for count in (10, 100, 1_000):
        box = 0.125 * math.ceil(math.sqrt(count))
        scene = scene_of(crowd(count, box), rectangle(box, box), LIVELY, CLOTH, 0.5)
        yield Case(f"{count}", scene, slow=count > 100)


@extreme("dense piles", "9 and 25 moving balls, e from 0.9 to 0", "coulomb")
def piles() -> Iterator[Case]:
    """Pack balls with gaps of a tenth of a radius, all moving, until they have come to rest."""
    for count, e, heavy in (
        (9, 0.9, 1.0), (9, 0.5, 1.0), (25, 0.5, 1.0), (9, 0.5, 100.0), (9, 0.0, 1.0),
    ):  # fmt: skip
        box = 2.1 * R * math.ceil(math.sqrt(count))
        heavier = dict.fromkeys(range(0, count, 3), heavy)
        scene = scene_of(crowd(count, box), rectangle(box, box), e, CLOTH, heavier=heavier)
        masses = f", 1 : {heavy:g}" if heavy > 1.0 else ""
        slow = count > 9 or heavy > 1.0 or e == 0.0
        yield Case(f"{count}, e = {e:g}{masses}", scene, slow=slow)


@extreme("never at rest", "no friction, max_time = pi s")
def never_at_rest() -> Iterator[Case]:
    """Let nothing brake: the run ends at its ``max_time``, to the last bit, and not before."""
    one = (0.5, 0.5, 1.0, 0.25)
    for label, rows, where in (
        ("one ball", [one], TABLE), ("along a cushion", [(0.5, R, 1.0, 0.0)], TABLE),
        ("no table", [one], None),
        ("three balls", [one, (1.0, 0.5, *REST), (1.5, 0.5, 0.0, 0.5)], TABLE),
    ):  # fmt: skip
        yield Case(label, scene_of(rows, where, time=math.pi))


@extreme("the report's law", "Listing 3 in an oblique hit", "published", because=LISTING)
def the_listing() -> Iterator[Case]:
    """Show what Listing 3, the report's own law, does to momentum and energy in an oblique hit."""
    for degrees in (0.0, 30.0, 60.0):
        x, y = unit(degrees)
        rows = ((-0.25 - 2.0 * R * x, -0.125 - 2.0 * R * y, 1.0, 0.5), (0.0, 0.0, *REST))
        scene = scene_of(rows, friction=Friction(ball_ball=0.2), time=1.0)
        yield Case(f"{degrees:g} degrees", scene, (must.momentum_kept, must.energy_kept))
