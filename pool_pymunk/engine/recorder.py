"""A recorder listens to the contact engine."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from pool_pymunk.physics.collapse import Collapse
from pool_pymunk.physics.contact import Contact, Vector
from pool_pymunk.physics.impulses import Impulse
from pool_pymunk.physics.path import Path

Motion = tuple[float, float, float, float]  # x, y (m), vx, vy (m/s)
Motions = dict[int, Motion]  # by ball number


class Persisted(NamedTuple):
    """A contact has persisted from ``since`` until ``until`` (s).

    (``x``, ``y``) is the impulse (N s) that it has given its ball, or the second of two.
    """

    contact: Contact
    since: float
    until: float
    x: float = 0.0
    y: float = 0.0


class Recorder:
    """A recorder listens to the engine; this one does nothing. Times are in s, places in m."""

    def contact(self, contact: Contact, impulse: Impulse, t: float) -> None:
        """Take note that two balls, or a ball and a cushion, hit each other."""

    def path(self, i: int, path: Path) -> None:
        """Take note that ball ``i`` begins a new path."""

    def roll(self, i: int, t: float) -> None:
        """Take note that ball ``i`` begins to roll."""

    def crossed(self, i: int, patch: int, t: float) -> None:
        """Take note that ball ``i`` comes into a patch, or out of all patches (-1)."""

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Take note that ball ``i`` comes to rest."""

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        """Take note that a pocket took in ball ``i``, which came with this ``motion``."""

    def jammed(self, i: int, wall: int, t: float) -> None:
        """Take note that a wall moves into ball ``i``, which has nowhere to go."""

    def zero_slip(self, contact: Contact, t: float) -> None:
        """Take note that the law jumps at zero slip, and that the slip was rounding alone."""

    def persistent(self, persisted: Persisted) -> None:
        """Take note of a contact that has persisted, and is over."""

    def no_end(self, contacts: Collection[Contact], collapse: Collapse, t: float) -> None:
        """Take note of an inelastic collapse, whose hits are not listed one by one."""

    def order_unknown(self, t: float) -> None:
        """Take note of several contacts at one instant, whose order may matter."""
