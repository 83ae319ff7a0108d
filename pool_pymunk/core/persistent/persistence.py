"""The engine asks a persistence about contacts that persist; where nothing presses, none does."""

from __future__ import annotations

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due
from pool_pymunk.core.walls.wall import Wall

# the balls (the second one is -1 at a cushion), the cushion (-1 of balls), from when until when
# (s), and the impulse (N s) given to the last ball
Persisted = tuple[int, int, int, float, float, float, float]


class Persistence:
    """On a table without friction, and without hollow arcs, no contact persists.

    The engine and its instants ask this whether hits are hits, and tell it of those that were
    answered. ``loose`` are balls on new paths, which the engine is to predict, and ``seeds`` those
    around which groups are to begin at the end of an instant. It ``is_hushed`` while slow hits
    wait.
    """

    def __init__(self) -> None:
        self.loose: list[Ball] = []
        self.seeds: list[Ball] = []
        self.is_hushed = False

    def begin_run(self) -> None:
        """Forget all contacts that have persisted, for another run."""
        if len(self.loose) > 0 or len(self.seeds) > 0:
            self.loose, self.seeds = [], []

    def take_loose(self) -> list[Ball]:
        """Return the balls on new paths, which are to be predicted, and forget them."""
        balls, self.loose = self.loose, []
        return balls

    # -- before a hit ------------------------------------------------------------------------------

    def allows(self, present: Present, hit: Due) -> float:
        """Return when (s) a predicted hit is due: later than predicted, or never (infinity)."""
        return hit.t

    def concerns(self, present: Present, one: Contact) -> bool:
        """Tell whether a hit that comes alone may be more than that."""
        return False

    def loud(self, present: Present, dues: list[Due]) -> list[Due]:
        """Return those of some hits that are to be answered."""
        return dues

    def takes_over(self, present: Present, contacts: list[Contact], many: int) -> bool:
        """Tell whether groups begin instead of the next hits of a cluster with so many contacts."""
        return False

    # -- after it ----------------------------------------------------------------------------------

    def go_after_lone(self, present: Present, one: Contact) -> None:
        """Take note of a hit that came alone."""

    def go_after(self, present: Present, contacts: list[Contact], changed: list[Ball]) -> None:
        """Take note of the contacts of an instant, and of the balls that it has changed."""

    def form(self, present: Present) -> None:
        """Let groups begin around the seeds, as nothing more hits at this instant."""

    # -- while contacts persist --------------------------------------------------------------------

    def go_on(self, present: Present, ball: Ball) -> None:
        """Go on at the end of a piece of a ball's group."""

    def leave(self, present: Present, ball: Ball) -> None:
        """Take the group of a ball apart, which is to go on otherwise."""

    def go_on_from(self, present: Present, ball: Ball) -> None:
        """Let contacts persist around a ball that goes on otherwise."""

    def begin_step(self, present: Present) -> None:
        """Take groups apart that have gone on until now, when walls begin to move otherwise."""

    # -- at the end of a run -----------------------------------------------------------------------

    def persisted(self, present: Present) -> list[Persisted]:
        """Return the rows of the contacts that have persisted, up to now."""
        return []


def sides_of(a: Ball, b: Ball | None, wall: Wall | None) -> tuple[int, int]:
    """Return the numbers of two sides: a ball, and another one or -1 - a wall's place."""
    if b is not None:
        return (a.number, b.number) if a.number < b.number else (b.number, a.number)
    return a.number, -1 if wall is None else -1 - wall.place
