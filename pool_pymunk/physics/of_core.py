"""Walls, surfaces and patches of the core, as the contact engine has them."""

from __future__ import annotations

from typing import Any

from pool_pymunk.core.motion import patches as core_patches
from pool_pymunk.core.motion import surface as core
from pool_pymunk.core.motion.path import Path as CorePath
from pool_pymunk.core.walls import arc, face, side, wall
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.physics import patches, sides, surface
from pool_pymunk.physics.path import Path


def wall_of(one: wall.Wall) -> sides.Wall:
    """Return a wall."""
    return sides.Wall(
        tuple(map(side_of, one.sides)), one.restitution, one.friction, one.number, one.kick
    )


def side_of(one: Any) -> Any:
    """Return a side; what is none of the core is returned as it is."""
    if isinstance(one, face.Face):
        return sides.Face(one.start, one.tangent, one.outward, one.length, one.core)
    if isinstance(one, RoundSide):
        return sides.RoundSide(one.center, one.radius, one.first, one.last)
    if isinstance(one, arc.Arc):
        return sides.Arc(one.center, one.radius, one.first, one.last, one.facing)
    return OwnSide(one) if isinstance(one, side.Side) else one


class OwnSide:
    """This is a side of a user's own."""

    def __init__(self, own: side.Side) -> None:
        self.own, self.core = own, own.core
        self.gap, self.normal, self.curvature = own.gap, own.normal, own.curvature

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        return self.own.time_of_contact(CorePath(*path), r, now)


def surface_of(one: Any) -> Any:
    """Return a surface; what is none of the core is returned as it is."""
    if type(one) is core.Sliding:
        return surface.Sliding(one.pull)
    if type(one) is core.Rolling:
        return surface.Rolling(one.pull, one.drag)
    return OwnSurface(one) if isinstance(one, core.Surface) else one


class OwnSurface:
    """This is a surface of a user's own."""

    def __init__(self, own: core.Surface) -> None:
        self.own, self.pull, self.drag, self.rolls = own, own.pull, own.drag, own.rolls

    def path(self, t: float, place: Any, velocity: Any, roll: Any = (0.0, 0.0)) -> Path:
        return path_of(self.own.path(t, place, velocity, roll))

    def then(self, path: Path) -> Path | None:
        then = self.own.then(CorePath(*path))
        return None if then is None else path_of(then)

    def roll(self, path: Path, t: float, pushes: Any = ()) -> Any:
        own = CorePath(*path)
        if not pushes:
            return self.own.roll(own, t)
        return self.own.roll_after(own, t, [(*normal, slows) for normal, slows in pushes])


def path_of(one: CorePath) -> Path:
    """Return a path."""
    return Path(
        one.t, one.x, one.y, one.vx, one.vy, one.ax, one.ay, one.end, one.slows, one.wx, one.wy
    )


def patches_of(ground: Any) -> Any:
    """Return patches; what is none of the core is returned as it is."""
    if not isinstance(ground, core_patches.Patches):
        return ground
    rows = tuple([row_of(border) for border in ground.borders])
    return patches.Patches(rows, tuple(map(surface_of, ground.surfaces)))


def row_of(border: core_patches.Border) -> tuple[float, float, float, float, float, float]:
    """Return the numbers of a border."""
    if isinstance(border, core_patches.Circle):
        return float(border.patch), 1.0, border.cx, border.cy, border.radius, 0.0
    assert isinstance(border, core_patches.Line)
    return float(border.patch), 0.0, border.px, border.py, border.qx, border.qy
