"""A picture of an open plane shows all that is there."""

from __future__ import annotations

from typing import Any

import pytest

from pool_pymunk.model import Ball, Patch, Pocket, Post, Restitution, Scene
from pool_pymunk.render.view import extent

R = 0.03


@pytest.mark.parametrize(
    ("parts", "x"),
    [
        ({"posts": (Post((-3.0, 0.0), 0.5),)}, -3.5),
        ({"pockets": (Pocket("P", (-2.0, 0.0), 0.25),)}, -2.25),
        ({"patches": (Patch(center=(-2.0, 0.0), radius=0.5, surface=0.3),)}, -2.5),
        ({"patches": (Patch(((-2.0, 0.0), (-1.0, -1.0), (-1.0, 1.0)), surface=0.3),)}, -2.0),
        ({}, 0.0),
    ],
)
def test_what_lies_on_a_plane_is_in_its_picture(parts: dict[str, Any], x: float) -> None:
    """The margin is 2.5 radii of the largest ball."""
    balls = Ball("1", (0.0, 0.0), R, 0.2), Ball("2", (1.0, 0.0), R / 2.0, 0.2)
    seen = extent(Scene(balls, None, Restitution(0.9, cushion=0.9), **parts))
    assert (seen.x0, seen.x1) == pytest.approx((x - 2.5 * R, 1.0 + 2.5 * R))
