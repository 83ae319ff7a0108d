"""A table has walls, a surface with its patches, and the coefficients of balls that hit."""

from __future__ import annotations

from mypy_extensions import mypyc_attr

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Pair
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.walls.arc import Arc
from pool_pymunk.core.walls.wall import Wall


@mypyc_attr(allow_interpreted_subclasses=True)
class Table:
    """A table is all that balls move on and meet; hits of the cue ball may differ.

    ``restitution``, ``cue_restitution`` and ``friction`` are those of two balls. The engine asks
    it; a user's scene may have other pairs.
    """

    def __init__(
        self, walls: list[Wall], surface: Surface, patches: Patches, restitution: float,
        cue_restitution: float, friction: float,
    ) -> None:  # fmt: skip
        self.walls = walls
        self.surface = surface
        self.patches = patches
        self.restitution = restitution
        self.cue_restitution = cue_restitution
        self.friction = friction
        self.last = Pair(0.0, 0.0, 0.0, 0.0)  # the last pair; mostly the next one is the same

    @property
    def pull(self) -> float:
        """The largest deceleration (m/s^2) of balls that slide anywhere."""
        most = self.surface.pull
        for surface in self.patches.surfaces:
            most = max(most, surface.pull)
        return most

    @property
    def slows(self) -> bool:
        """This tells whether friction of the surface slows balls."""
        return self.surface.drag > 0.0

    def surface_of(self, patch: int) -> Surface:
        """Return the surface of a patch, or that of the table (-1)."""
        return self.surface if patch < 0 else self.patches.surfaces[patch]

    def pair(self, a: Ball, b: Ball) -> Pair:
        """Return the masses and coefficients of a hit of two balls."""
        e, mu = self.cue_restitution if a.is_cue or b.is_cue else self.restitution, self.friction
        last = self.last
        if last.m_a != a.mass or last.m_b != b.mass or last.restitution != e or last.friction != mu:
            last = self.last = Pair(a.mass, b.mass, e, mu)
        return last

    def forget(self) -> None:
        """Forget pairs that a user's function gave, which may give others now; here are none."""


def may_press(table: Table) -> bool:
    """Tell whether anything presses balls together: a surface, a hollow wall, one that moves."""
    if table.pull > 0.0 or any(wall.moves for wall in table.walls):
        return True
    sides = [side for wall in table.walls for side in wall.sides]
    return any(isinstance(side, Arc) and side.facing < 0.0 for side in sides)
