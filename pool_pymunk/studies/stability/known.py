"""Scenes with known answers stand in ``known.json``; other programs play them, too (``torture/``).

They are plain numbers in SI units: ``checks`` have the answers and the errors within which other
programs are right, and ``also`` has what solvers of this one must answer beyond that. ``case`` is
the label of a scene here, if it is not its name; if it is null, this study leaves the scene out.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pool_pymunk.model import Ball, Friction, Physics, Restitution, Scene, Table
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.trial import Case, Claim

FILE = Path(__file__).with_name("known.json")
G = 9.81  # m/s^2


def known_answers() -> Iterator[Case]:
    """Play the scenes by all solvers."""
    for entry in json.loads(FILE.read_text(encoding="utf-8")):
        label = entry.get("case", entry["name"])
        if label is not None:
            yield Case(label, scene_of(entry), claims_of(entry), slow=entry.get("slow", False))


def scene_of(entry: Mapping[str, Any]) -> Scene:
    """Return the scene that an entry describes, with all but gravity in the plane."""
    balls = tuple(
        Ball(str(k), (x, y), r, m, velocity=(vx, vy), roll=entry.get("roll", 0.0))
        for k, (x, y, vx, vy, r, m) in enumerate(entry["balls"])
    )
    corners = tuple((x, y) for x, y in entry.get("walls", ()))
    restitution = Restitution(entry["restitution"], cushion=entry["wall_restitution"])
    friction = Friction(entry.get("friction", 0.0), rolling=entry.get("rolling"))
    physics = Physics(gravity=G, max_time=entry["time"])
    return Scene(balls, Table(corners) if corners else None, restitution, friction, physics)


def claims_of(entry: Mapping[str, Any]) -> tuple[Claim, ...]:
    """Return what an entry knows beyond what always holds, as that a run can be reversed."""
    known = entry["checks"] + entry.get("also", []) if "reverse" not in entry else []
    found = (_claim(kind, answer) for kind, answer, *_ in known)
    return tuple(claim for claim in found if claim is not None)


def _claim(kind: str, answer: Any) -> Claim | None:
    if kind == "mirror":
        return must.mirrored
    if kind == "contacts":
        return must.contacts_are(answer)
    if kind not in ("ends", "velocities"):
        return None
    vectors = {str(k): (x, y) for k, (x, y) in enumerate(answer)}
    return must.end_at(vectors) if kind == "ends" else must.leave_with(vectors)
