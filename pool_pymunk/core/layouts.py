"""Many layouts of balls at once: which balls may lie where they are, and random free places."""

from __future__ import annotations

from struct import Struct
from typing import Final, final

from pool_pymunk.core.floor import Floor, overlap
from pool_pymunk.core.motion.times import Vector

PLACE: Final = Struct("2d")  # x, y (m) of a ball; NaN for a ball off the table


@final
class Spot:
    """A spot is where a ball with a radius (m) lies, or it is off the table."""

    def __init__(self, radius: float) -> None:
        self.radius = radius
        self.x = self.y = 0.0
        self.is_off = False

    def put(self, places: bytes, at: int) -> None:
        """Read the place of the ball."""
        place: Vector = PLACE.unpack_from(places, at)
        self.x, self.y = place
        self.is_off = self.x != self.x or self.y != self.y


def is_free(floor: Floor, spots: list[Spot], n: int, share: float) -> bool:
    """Tell whether a ball may lie where it is: in no wall, no pocket, and no ball before it."""
    one = spots[n]
    if one.is_off:
        return True
    if not floor.holds(one.x, one.y, one.radius, share):
        return False
    for k in range(n):
        other = spots[k]
        if not other.is_off:
            here, there = (one.x, one.y), (other.x, other.y)
            if overlap(here, one.radius, there, other.radius, share):
                return False
    return True


def may_lie(floor: Floor, radii: list[float], places: bytes, share: float) -> bytes:
    """Tell which balls of layouts may lie where they are: one byte each, 1 or 0.

    An overlap of up to a ``share`` of a radius counts as a touch.
    """
    spots, found = [Spot(r) for r in radii], bytearray()
    for at in range(0, len(places), PLACE.size * len(radii)):
        for n in range(len(spots)):
            spots[n].put(places, at + n * PLACE.size)
        for n in range(len(spots)):
            found.append(1 if is_free(floor, spots, n, share) else 0)
    return bytes(found)
