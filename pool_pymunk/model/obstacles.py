"""This module lists what balls may touch in a scene, in rows of numbers."""

from __future__ import annotations

from typing import Any

from pool_pymunk.model.scene import Scene
from pool_pymunk.physics.sides import Arc

WHOLE = (0.0, 0.0, 0.0, 0.0)  # A disc that is no arc has no sector.


def obstacles(scene: Scene) -> tuple[list[Any], list[Any], list[Any]]:
    """Return what balls may touch in a scene: discs at rest, faces, and corners.

    A disc has x, y, radius, the factor of a ball's radius (1, 0 at a rim, -1 within an arc), the
    number of its wall (pockets come after the walls), and the first and the last direction of an
    arc. A face has its start, tangent, normal,
    length and wall. A corner has its place, and the tangent and normal of one side there.
    """
    table, discs, faces, corners = scene.table, list[Any](), list[Any](), list[Any]()
    for k, post in enumerate(scene.posts, start=scene.first_post):
        discs.append((*post.position, post.radius, 1.0, k, *WHOLE))
    for k, edge in enumerate(() if table is None else table.edges):
        assert table is not None
        last, side = table.edges[k - 1], edge.side
        if k in table.reflex_corners:
            discs.append((*edge.start, 0.0, 1.0, k, *WHOLE))
        if k in table.reflex_corners or last.bulge or edge.bulge:
            for tx, ty in (last.heading(True), edge.heading(False)):
                corners.append((*edge.start, tx, ty, -ty, tx))
        if isinstance(side, Arc):
            discs.append((*side.center, side.radius, side.facing, k, *side.first, *side.last))
        else:
            faces.append((*edge.start, *edge.tangent, *edge.normal, edge.length, k))
    for k, hole in enumerate(scene.pockets, start=len(scene.cushions)):
        discs.append((*hole.position, hole.radius, 0.0, k, *WHOLE))
    return discs, faces, corners
