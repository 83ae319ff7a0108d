"""This module reads the patches of a table: regions with other friction, of the form of a shape."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pymunk

from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.model import Patch
from pool_pymunk.model.outline import NO_FRICTION, misdrawn
from pool_pymunk.model.plain import argument, point, size
from pool_pymunk.model.problems import setting_error
from pool_pymunk.world.ball import FROM_ZERO
from pool_pymunk.world.checks import read_surface


def read_patch(shape: Any, deceleration: Any, rolling: Any) -> Patch:
    """Read the form of a static circle or polygon, and the decelerations (m/s^2) there.

    They are the coefficients of a patch of a scene whose gravity is 1 m/s^2. Where ``rolling`` is
    None, it is that of the table.
    """
    if not isinstance(shape, pymunk.Circle | pymunk.Poly):
        message = "a patch must be a Poly or a Circle"
        raise setting_error("shape", type(shape).__name__, message)
    body = shape.body
    if body is None or body.body_type != pymunk.Body.STATIC:
        message = "a patch's body must be static, as patches lie still"
        raise setting_error("shape", type(shape).__name__, message)
    corners, center, radius = tuple[Vector, ...](), None, None
    if isinstance(shape, pymunk.Circle):
        x, y = body.local_to_world(shape.offset)
        center = argument("shape: its place", (x, y), point)
        radius = argument("shape: its radius", shape.radius, size)
    else:
        places = [body.local_to_world(corner) for corner in shape.get_vertices()]
        corners = tuple([(x, y) for x, y in places])
        if shape.radius > 0.0 or misdrawn(corners):
            message = misdrawn(corners) or "a patch has sharp corners, so its radius must be 0"
            raise setting_error("shape", "Poly", message)
    pull = argument("deceleration", deceleration, FROM_ZERO)
    drag = None if rolling is None else argument("rolling", rolling, FROM_ZERO)
    return Patch(corners, center, radius, pull, drag)


def check_patches(table: Surface, patches: Sequence[Patch]) -> None:
    """Refuse patches that do not fit on a table with this surface."""
    for each in patches:
        if each.rolling is not None and not table.rolls:
            message = "balls do not roll on a table without rolling"
            raise setting_error("rolling", each.rolling, message)
        drag = table.drag if each.rolling is None else each.rolling
        read_surface(each.surface, drag if table.rolls else None)
        if isinstance(table, Falling) and each.surface:
            raise setting_error("deceleration", each.surface, f"must be 0: {NO_FRICTION}")
