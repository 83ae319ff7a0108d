"""The report's four shots are written down by a full Python, and played by the core alone.

Python in a browser plays them without NumPy, so it cannot load a scene (`play.mjs`). It gets the
numbers of table and balls as hexadecimal floats, a record for each shot, and what they became::

    python tests/browser_python/report_shots.py >shots.json
"""

from __future__ import annotations

import json
import math
from typing import Any

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.laws import Published
from pool_pymunk.core.engine import Engine
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.surface import Sliding
from pool_pymunk.core.persistent.persistence import Persistence
from pool_pymunk.core.record import Record
from pool_pymunk.core.table import Table
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.wall import Wall


def as_hex(value: Any) -> Any:
    """Return data with floats as texts that have all their bits."""
    if isinstance(value, float):
        return value.hex()
    return [as_hex(each) for each in value] if isinstance(value, list | tuple) else value


def as_floats(value: Any) -> Any:
    """Return data of which all texts were floats; lists become tuples."""
    if isinstance(value, str):
        return float.fromhex(value)
    return tuple(as_floats(each) for each in value) if isinstance(value, list) else value


def played(shot: dict[str, Any]) -> list[Any]:
    """Play a shot by the core alone; return its events and the paths of its balls."""
    pull, coefficients, walls, balls = (
        as_floats(shot[key]) for key in ("pull", "coefficients", "walls", "balls")
    )
    cushions = [
        Wall([Face(*side) for side in sides], e, mu, number)
        for number, (sides, e, mu) in enumerate(walls)
    ]
    table = Table(cushions, Sliding(pull), Patches([], []), *coefficients)
    discs = [
        Ball(i, r, m, table.surface.path(0.0, place, velocity, (0.0, 0.0)), is_cue)
        for i, (r, m, place, velocity, is_cue) in enumerate(balls)
    ]
    paths = [each.path for each in discs]
    record = Record([], False)
    record.knots = [[(p.t, p.x, p.y, p.vx, p.vy, p.ax, p.ay)] for p in paths]
    engine = Engine(table, discs, Published(), record, Persistence())
    engine.begin_run()
    engine.advance(math.inf)
    return [as_hex(record.events), as_hex(record.knots)]


def as_played(text: str) -> str:
    """Play all shots of such a file; return what they became, as JSON."""
    return json.dumps([played(shot) for shot in json.loads(text)])


def as_written() -> str:
    """Return the report's shots, and what its exact solver makes of them, as JSON."""
    from pool_pymunk import load
    from pool_pymunk.solvers import event_driven
    from pool_pymunk.solvers.in_core import table_of
    from pool_pymunk.solvers.request import request

    scene, found = load("report"), []
    table, settings = table_of(scene), request(scene, "event-driven").settings
    walls = [(faces_of(wall), wall.restitution, wall.friction) for wall in table.walls]
    coefficients = table.restitution, table.cue_restitution, table.friction
    for shot in scene.shots:
        start = scene.start(shot)
        motions = zip(scene.balls, start.position, start.velocity, strict=True)
        balls = [(ball.radius, ball.mass, *motion, ball.cue) for ball, *motion in motions]
        trace = event_driven.solve(scene, start, settings)
        numbers = {"pull": table.surface.pull, "coefficients": coefficients}
        numbers |= {"walls": walls, "balls": balls, "became": (trace.events, trace.knots)}
        found.append({key: as_hex(value) for key, value in numbers.items()})
    return json.dumps(found)


def faces_of(wall: Wall) -> list[tuple[Any, ...]]:
    """Return the numbers of a wall's sides, which are straight."""
    faces = [side for side in wall.sides if isinstance(side, Face)]
    assert len(faces) == len(wall.sides)
    return [(side.start, side.tangent, side.outward, side.length, side.core) for side in faces]


if __name__ == "__main__":
    print(as_written())
