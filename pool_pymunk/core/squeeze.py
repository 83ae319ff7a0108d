"""Walls that move squeeze balls that have nowhere to go; walls that kick do so once in an instant.

A wall that moves hits such a ball ever more often. After many hits in one step the ball does not
bounce any more, and after some more the wall goes through it.
"""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.contact.together import discs_of, fastest_of
from pool_pymunk.core.motion.times import length_of
from pool_pymunk.core.walls.wall import Wall

SQUEEZED: Final = 20  # After so many hits in one step a ball bounces no more.
JAMMED: Final = 30  # After so many, the wall goes through it.
MET: Final = 100  # So it does after it has met the ball so often in one step, by hits or not.
# A ball is jammed if a wall would give it so many times the highest speed before. In a corner that
# closes, the law gives ever higher speeds.
SQUIRTS: Final = 10.0

Key = tuple[int, int]  # the number of a ball, and the place of a wall


@final
class Squeezes:
    """These are the hits of moving walls in the present step, and what came of them.

    The present owns it. ``is_idle`` says that no ball is squeezed and no wall goes through one.
    """

    def __init__(self) -> None:
        self.is_idle = True
        self.struck: dict[Key, int] = {}
        self.met: dict[Key, int] = {}
        self.squeezed: set[int] = set()
        self.jams: set[Key] = set()
        self.kicked: dict[Key, float] = {}  # s; when a wall has last kicked a ball
        self.jammed: dict[Key, float] = {}  # s; when the recorder last heard of a jam

    def begin_step(self) -> None:
        """Forget the hits of the last step; walls go on through balls until these are free."""
        self.struck.clear()
        self.met.clear()
        self.squeezed.clear()
        self.is_idle = len(self.jams) == 0

    def is_squeezed(self, ball: Ball) -> bool:
        """Tell whether a ball bounces no more."""
        return not self.is_idle and ball.number in self.squeezed

    def goes_through(self, ball: Ball, wall: Wall) -> bool:
        """Tell whether a wall goes through a ball."""
        return not self.is_idle and (ball.number, wall.place) in self.jams

    def strike(self, ball: Ball, wall: Wall) -> bool:
        """Count a hit of a moving wall; tell whether the wall goes through the ball from now on."""
        key = ball.number, wall.place
        count = self.struck[key] = self.struck.get(key, 0) + 1
        if count >= SQUEEZED:
            self.squeezed.add(ball.number)
            self.is_idle = False
        return count >= JAMMED

    def meet(self, ball: Ball, wall: Wall) -> bool:
        """Count that a ball meets a moving wall, hit or not; tell whether that is too often."""
        key = ball.number, wall.place
        count = self.met[key] = self.met.get(key, 0) + 1
        return count >= MET

    def jam(self, ball: Ball, wall: Wall) -> bool:
        """Let a wall go through a ball; tell whether this is new."""
        key = ball.number, wall.place
        if key in self.jams:
            return False
        self.jams.add(key)
        self.is_idle = False
        return True

    def free(self, ball: Ball, wall: Wall) -> None:
        """Let a wall meet a ball again, which does not lie in it any more."""
        self.jams.discard((ball.number, wall.place))
        self.is_idle = len(self.jams) == 0 and len(self.squeezed) == 0

    def forget(self, wall: Wall) -> None:
        """Forget a wall that is taken down."""
        self.jams = {key for key in self.jams if key[1] != wall.place}
        self.is_idle = len(self.jams) == 0 and len(self.squeezed) == 0


def usual_speed(contacts: list[Contact]) -> float:
    """Return the highest speed (m/s) of the balls and walls of contacts; 0 if all walls stand."""
    fastest = 0.0
    for one in contacts:
        fastest = max(fastest, length_of(one.ux, one.uy))
    return max(fastest, fastest_of(discs_of(contacts))) if fastest > 0.0 else 0.0


def have_no_room(contacts: list[Contact], usual: float, is_answered: bool) -> bool:
    """Tell whether walls that move leave balls no room, or throw them out too fast.

    ``usual`` (m/s) is the highest speed before the answer.
    """
    if usual == 0.0:
        return False
    return not is_answered or fastest_of(discs_of(contacts)) > SQUIRTS * usual
