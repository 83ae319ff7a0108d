"""This module puts a scene into the core for small changes of its inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.surface import Rolling, Sliding
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.rounding import DRAWS
from pool_pymunk.core.tangent.touches import Corner
from pool_pymunk.model import Scene
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.problems import setting_error


def check_surface(scene: Scene) -> None:
    """Raise SettingError for a scene with a surface of somebody's own."""
    if not has_derivatives(scene):
        message = "has no derivatives: only surfaces on which balls slide, roll or fall have them"
        raise setting_error("surface", type(scene.surface).__name__, message)


def has_derivatives(scene: Scene) -> bool:
    """Tell whether small changes can be followed on the surface of a scene."""
    return type(scene.surface) in (Sliding, Rolling, Falling)


def inputs_of(scene: Scene, starts: Array, numbers: Sequence[Array]) -> Inputs:
    """Return what inputs change: the ``starts`` (N, K, P), and the numbers of a scene."""
    of_numbers, mass, radius = (each.tolist() for each in numbers)
    of_edges, posts = scene.first_post, scene.posts
    no_edge, no_pocket = [False] * of_edges, [False] * len(scene.pockets)
    own_e = [*no_edge, *(post.restitution is not None for post in posts), *no_pocket]
    own_mu = [*no_edge, *(post.friction is not None for post in posts), *no_pocket]
    rates = scene.patch_rates
    patches = [pull >= 0.0 for pull, _ in rates], [drag >= 0.0 for _, drag in rates]
    where = np.nonzero(starts)
    entries = zip(*(each.tolist() for each in where), starts[where].tolist(), strict=True)
    return Inputs(list(entries), of_numbers, mass, radius, (own_e, own_mu), patches)


def rounding_errors_of(scene: Scene) -> Inputs:
    """Return columns for rounding errors, which the starts and numbers of a scene do not have."""
    count = len(scene.balls)
    none = [np.zeros((rows, DRAWS)) for rows in (7, count, count)]
    return inputs_of(scene, np.zeros((count, 0, DRAWS)), none)


def corners_of(scene: Scene) -> list[Corner]:
    """Return the corners of a table at which a ball that meets a side may meet another one."""
    found, table = list[Corner](), scene.table
    for k, edge in enumerate(() if table is None else table.edges):
        assert table is not None
        last = table.edges[k - 1]
        if k in table.reflex_corners or last.bulge or edge.bulge:
            for heading in (last.heading(True), edge.heading(False)):
                found.append(Corner(*edge.start, heading))
    return found
