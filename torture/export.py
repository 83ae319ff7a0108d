"""Write the scenes and their known answers into `scenes.json`: `python -m torture.export`."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from pool_pymunk.studies.stability.known import KEPT_BACK, KnownScene
from torture.scenes import FILE, SCENES

ALWAYS = ("restitution", "wall_restitution")  # Other numbers are left out where nothing needs them.


def exported(scene: KnownScene) -> dict[str, Any]:
    """Return a scene as it stands in the file."""
    head = {"name": scene.name, "about": scene.about, "known": scene.known}
    rest = {
        field.name: getattr(scene, field.name)
        for field in fields(scene)
        if field.name not in KEPT_BACK
        and (field.name in ALWAYS or getattr(scene, field.name) != field.default)
    }
    return head | rest | {"checks": scene.checks}


def text() -> str:
    """Return the file, with a line for each scene."""
    return "[\n" + ",\n".join(json.dumps(exported(scene)) for scene in SCENES) + "\n]\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
