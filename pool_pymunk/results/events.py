"""Events happen in a run: contacts, and balls that roll, stop, or come to a patch or a pocket."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

IMPULSES = ("impulse", "tangential", "tangential_first")


@dataclass(frozen=True, slots=True)
class Event:
    """An event is a contact, or a ball that begins to roll, stops or is pocketed, at ``t`` (s).

    A ball may also cross the border of a patch: into the ``patch`` of this number, or, where it is
    None, out of all patches.

    A contact has an ``impulse`` (N s) along its normal n, which points from the first ball to the
    second, or from the cushion to the ball. It drives the two apart: the second ball, or the ball
    at a cushion, gets +impulse, the first of two balls -impulse. ``tangential`` (N s) is what the
    second ball, or the ball at a cushion, gets along t = (-n_y, n_x), and ``tangential_first`` what
    the first of two balls gets along t. That is -tangential, unless the law keeps no momentum there
    (``published``). All are None for events that are no contacts.

    >>> from pool_pymunk import load, simulate
    >>> hit = simulate(load("two-balls"), max_time=2.0).events[0]
    >>> hit.kind, round(hit.impulse, 6), round(hit.tangential, 6), round(hit.tangential_first, 6)
    ('ball-ball', 0.262301, -0.013115, 0.013115)
    """

    t: float
    kind: str  # ball-ball | ball-cushion | roll | stop | pocket | patch
    balls: tuple[str, ...]
    cushion: int | None = None
    pocket: str | None = None  # its id
    impulse: float | None = None
    tangential: float | None = None
    tangential_first: float | None = None
    patch: int | None = None  # its number, from 0

    @property
    def is_contact(self) -> bool:
        """Tell whether balls meet each other or a cushion."""
        return self.kind in ("ball-ball", "ball-cushion")

    @property
    def impulses(self) -> tuple[float | None, float | None, float | None]:
        """Return the impulses (N s), as in IMPULSES."""
        return self.impulse, self.tangential, self.tangential_first

    def as_dict(self) -> dict[str, object]:
        """Return the event as it stands in the JSON."""
        return parts_of(self)


def parts_of(row: DataclassInstance) -> dict[str, object]:
    """Return what is known of an event or a contact for the JSON; a tuple is a list there."""
    said = {each.name: getattr(row, each.name) for each in fields(row)}
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in said.items() if value is not None
    }  # fmt: skip


def two(balls: tuple[str, ...]) -> tuple[str, str]:
    """Return the ids of a contact's balls; the second text is empty where there is one ball."""
    return (balls[0], balls[1] if len(balls) > 1 else "")
