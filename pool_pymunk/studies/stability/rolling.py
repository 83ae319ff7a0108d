"""This module makes the extremes of balls that slide, then roll."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from pool_pymunk.model import (
    STANDARD_GRAVITY,
    Pocket,
    Restitution,
    Table,
)  # fmt: skip
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.making import (
    CLOTH,
    DRAG,
    PULL,
    REST,
    ROLLS,
    TABLE,
    R,
    far,
    into,
    rack,
    rectangle,
    scene_of,
    unit,
)  # fmt: skip
from pool_pymunk.studies.stability.trial import Case, Extreme

ROWS: list[Extreme] = []
extreme = into(ROWS)


@extreme("sliding, then rolling", "draw that cancels the motion, slips of 1e-12, no end", "coulomb")
def slides_and_rolls() -> Iterator[Case]:
    """Let a ball slide, then roll: draw cancels its motion, slip is tiny, or rolling has no end."""
    for label, speed, roll, drag in (
        ("draw", 1.0, -1.0, DRAG), ("slip of 1e-9", 1.0, 1.0 + 1e-9, DRAG),
        ("slip of 1e-12", 1.0, 1.0 + 1e-12, DRAG), ("-1e-12", 1.0, 1.0 - 1e-12, DRAG),
        ("no slip", 1.0, 1.0, DRAG), ("v = w = 0 at once", 1.0, -2.5, DRAG),
        ("at 1e-6 m/s", 1e-6, -2.5, DRAG), ("at 1e3 m/s", 1e3, -2.5, DRAG),
        ("rolls for ever", 1.0, 0.5, 0.0),
    ):  # fmt: skip
        time = math.inf if drag else 3.0
        (x, y), track = unit(20.0), far(speed, roll * speed, time, drag)
        friction = replace(ROLLS, rolling=drag / STANDARD_GRAVITY)
        row = (0.0, 0.0, speed * x, speed * y, roll)
        scene = scene_of([row], friction=friction, time=None if drag else time)
        kinds = ["roll"] * (roll not in (1.0, -2.5)) + ["stop"] * (drag > 0.0)
        yield Case(label, scene, (must.end_at({"0": (track * x, track * y)}), must.happens(*kinds)))


@extreme("follow after a full hit", "at once, and within 1e-15 m of where it rolls", "coulomb")
def follows() -> Iterator[Case]:
    """Stop a ball by a full hit: it only rotates then, and sets off at 2/7 of its roll."""
    for roll in (1.0, 1e-6, -1.0):
        ends = {"0": (far(0.0, roll), 0.0), "1": (2.0 * R + far(1.0, 0.0), 0.0)}
        scene = scene_of([(0.0, 0.0, 1.0, 0.0, roll), (2.0 * R, 0.0, *REST)], friction=ROLLS)
        yield Case(f"at once, roll {roll:g}", scene, (must.end_at(ends), must.contacts_are(1)))
    slides, last = 12.0 / (49.0 * PULL), 5.0 / 7.0  # m, m/s
    for off in (1e-3, 1e-9, 1e-12, 1e-15, 0.0, -1e-15, -1e-12):
        x, v = slides + max(off, 0.0), math.sqrt(last * last - 2.0 * DRAG * max(off, 0.0))
        ends = {"0": (x + far(0.0, v), 0.0), "1": (x + 2.0 * R + far(v, 0.0), 0.0)}
        rows = [(0.0, 0.0, 1.0, 0.0), (slides + off + 2.0 * R, 0.0, *REST)]
        scene = scene_of(rows, friction=ROLLS)
        # A hit just before the end of sliding moves the ends by less than this.
        claims = (must.end_at(ends, 1e-11 * (off < 0.0)), must.contacts_are(1))
        yield Case(f"rolls {off:+g} m before", scene, claims)


@extreme("draw that turns back", "at a face, corner or rim, within 1e-12", "coulomb")
def turns_back() -> Iterator[Case]:
    """Let a ball with draw turn back as it grazes a face, a corner or a rim, or just before."""
    ell = Table(((-4.0, -4.0), (0.0, -4.0), (0.0, -R), (4.0, -R), (4.0, 4.0), (-4.0, 4.0)))
    hole = Pocket("hole", (0.0, 0.0), 2.0 * R)
    for deep in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12):
        met = int(deep > 0.0)
        # A full hit turns (0.25, -0.5) m/s into (0, -0.5) m/s; the roll stays (-1, 2) m/s.
        y = 0.05 * math.hypot(1.0, 2.5) / PULL - deep
        rows = [(0.0, y, 0.25, -0.5, -4.0), (2.0 * R, y, *REST)]
        face = scene_of(rows, rectangle(8.0, 4.0, (-4.0, -R)), friction=ROLLS)
        yield Case(f"face {deep:+g} m", face, (must.contacts_are(1 + met),))
        y = 0.125 / PULL - deep
        corner = scene_of([(0.0, y, 0.0, -0.5, -4.0)], ell, friction=ROLLS)
        yield Case(f"corner {deep:+g} m", corner, (must.contacts_are(met),))
        rim = scene_of([(0.0, y + hole.radius, 0.0, -0.5, -4.0)], friction=ROLLS, pockets=(hole,))
        yield Case(f"rim {deep:+g} m", rim, (must.pocket("0" * met),))


@extreme("pressed by a roll", "to a cushion, or to a ball that lies there", "coulomb")
def pressed_by_rolls() -> Iterator[Case]:
    """Let a roll press a ball to a cushion, or to a ball that lies there: there they rest."""
    alone, other = (2.0 - R - 2.0**-9, 0.5, 0.125, 0.0, 1.0), (2.0 - R, 0.5, *REST)
    follower = (2.0 - 3.0 * R - 2.0**-9, 0.5, 0.125, 0.0, 1.0)
    for label, e, rows in (
        ("e = 0", 0.0, [alone]), ("e = 0.2", 0.2, [alone]),
        ("follows a frozen ball, e = 0", 0.0, [follower, other]),
    ):  # fmt: skip
        claim = must.know_of_ends({"0": (2.0 - (2 * len(rows) - 1) * R, 0.5)})
        yield Case(label, scene_of(rows, TABLE, e, ROLLS), (claim,), slow=len(rows) > 1)


@extreme("soft breaks", "slow shots at a rack, with few events", "coulomb")
def soft_breaks() -> Iterator[Case]:
    """Break a rack by a slow ball that rolls: balls stay in contact, and the run ends soon."""
    friction = replace(CLOTH, surface=0.2, rolling=0.01)
    for label, gap, speed in (
        ("1 m/s", 0.0, 1.0), ("0.25 m/s", 0.0, 0.25), ("0.25 m/s, gaps of 1e-6 m", 1e-6, 0.25),
    ):  # fmt: skip
        rows = [(1.0, 0.0, speed, 0.0, 1.0), *rack(gap)]
        table, restitution = rectangle(2.0, 1.0, (0.0, -0.5)), Restitution(0.95, None, 0.7)
        scene = scene_of(rows, table, restitution, friction)
        yield Case(label, scene, max_events=1_000, slow=gap == 0.0)
