"""Variants of a run show what rounding and policies decide: they have small errors.

The errors are random, but the same ones each time.
"""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.motion.path import NOISE
from pool_pymunk.core.motion.times import EPSILON, Vector

# The numbers are those of the minimal standard generator of Park and Miller, Communications of the
# ACM 36 (1993), 108.
MULTIPLIER: Final = 48_271
MODULUS: Final = 2**31 - 1
# This leaves out a thousand draws, because those of near seeds are alike at first.
LEAP: Final[int] = pow(MULTIPLIER, 1_000, MODULUS)
# of the velocities in a variant with a nudged start: balls that a hit leaves together part later
KICK: Final = 1e-12
CONVERGED: Final = 64.0 * EPSILON  # of the speeds; a collapse is over at closing speeds below it
NEARLY_CLOSED: Final = 16.0  # A gap up to so many times as wide as a closed one closes in a moment.
NO_SLIP: Vector = (0.0, 0.0)  # This slip stands for an answer without friction.


@final
class Errors:
    """These are the errors of a variant: a ``share`` of velocities and of places, or none.

    ``slip`` is that of balls whose slip is rounding, where the law jumps. The present asks it.
    """

    def __init__(self) -> None:
        self.share = 0.0
        self.state = 1  # of the random numbers
        self.of_places = False
        self.slip: Vector = NO_SLIP

    def round_off(self, seed: int) -> None:
        """Err as rounding does, in places and in velocities."""
        self._seed(seed)
        self.share, self.of_places = EPSILON, True

    def kick(self, seed: int) -> None:
        """Err in velocities, as starts do that are nudged."""
        self._seed(seed)
        self.share, self.of_places = KICK, False

    def _seed(self, seed: int) -> None:
        self.state = (seed % (MODULUS - 1) + 1) * LEAP % MODULUS

    def draw(self) -> float:
        """Return a random number between -1 and 1."""
        self.state = self.state * MULTIPLIER % MODULUS
        return 2.0 * self.state / MODULUS - 1.0

    def error(self, number: float) -> float:
        """Return a random error of a number."""
        return 0.5 * self.share * number * self.draw()

    def place_met(self, x: float, y: float, vx: float, vy: float, now: float) -> Vector:
        """Return where a ball is that would be at (x, y) at a contact, now (s)."""
        late = self.error(now)
        return x + self.error(x) + vx * late, y + self.error(y) + vy * late

    def velocity_after(self, velocity: Vector, noise: float) -> Vector:
        """Return a new velocity (m/s), of which ``noise`` may be rounding."""
        vx, vy = velocity
        if self.share == 0.0 or (vx == 0.0 and vy == 0.0):
            return velocity
        fastest = noise / NOISE
        return vx + self.error(fastest), vy + self.error(fastest)

    @property
    def nearly_closed(self) -> float:
        """The width of a gap that closes in a moment, as a multiple of that of a closed one.

        In a variant the sides of such a gap go on until they meet.
        """
        return 1.0 if self.of_places else NEARLY_CLOSED

    @property
    def left_out(self) -> float:
        """The share of the speeds that a collapse leaves out; a variant has twice it."""
        return 2.0 * CONVERGED if self.of_places else CONVERGED
