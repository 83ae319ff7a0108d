"""Many layouts of balls at once: which balls may lie where they are, and random free places."""

from __future__ import annotations

from struct import Struct
from typing import Final, final

from pool_pymunk.core.floor import TOUCHING, Floor, overlap
from pool_pymunk.core.motion.times import Vector

DRAWN: Final = 2  # So many places a ball are drawn at once.
PLACE: Final = Struct("2d")  # x, y (m) of a ball; NaN for a ball off the table


@final
class Spot:
    """A spot is where a ball with a radius (m) lies, or it is off the table.

    Random places lie in a box, which has a ``corner`` and a ``size`` (m).
    """

    def __init__(
        self, radius: float, corner: Vector = (0.0, 0.0), size: Vector = (0.0, 0.0)
    ) -> None:
        self.radius = radius
        self.corner = corner
        self.size = size
        self.x = self.y = 0.0
        self.is_off = False

    def put(self, places: bytes | bytearray, at: int) -> None:
        """Read the place of the ball."""
        place: Vector = PLACE.unpack_from(places, at)
        self.x, self.y = place
        self.is_off = self.x != self.x or self.y != self.y

    def draw(self, shares: Vector) -> None:
        """Go to a place at random ``shares`` of the box."""
        across, along = shares
        x, y = self.corner
        width, height = self.size
        self.x, self.y = across * width + x, along * height + y
        self.is_off = False


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


def lay_out(
    floor: Floor, spots: list[Spot], shares: bytes, places: bytearray, begun: list[int]
) -> None:
    """Lay balls out at random places where they are free, on several tables.

    So many balls of each table have ``begun`` to lie at their ``places``; both go on. The
    ``shares`` of a table are ``DRAWN`` pairs of random numbers for each of its balls, and a ball
    tries at most so many.
    """
    count = len(spots)
    for s in range(len(begun)):
        first, n, k = s * count * PLACE.size, begun[s], 0
        for m in range(n):
            spots[m].put(places, first + m * PLACE.size)
        while n < count and k < DRAWN:
            one = spots[n]
            at = ((s * DRAWN + k) * count + n) * PLACE.size
            pair: Vector = PLACE.unpack_from(shares, at)
            one.draw(pair)
            k += 1
            if is_free(floor, spots, n, TOUCHING):
                PLACE.pack_into(places, first + n * PLACE.size, one.x, one.y)
                n, k = n + 1, 0
        begun[s] = n
