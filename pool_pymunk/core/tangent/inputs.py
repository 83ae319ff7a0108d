"""Inputs are the numbers by which a run is differentiated, and what they change at first."""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.tangent.change import Change

# the numbers of a table that inputs change: restitutions of balls, of the cue ball and of cushions,
# the deceleration of sliding, friction of cushions and of balls, the deceleration of rolling
E_BALLS: Final = 0
E_CUE: Final = 1
E_WALLS: Final = 2
PULL: Final = 3
MU_WALLS: Final = 4
MU_BALLS: Final = 5
DRAG: Final = 6
UNCHANGED: Final = 7  # This number is that of a patch, and no input changes it.

Rows = list[list[float]]
Entry = tuple[int, int, int, float]


@final
class Inputs:
    """Inputs say how the starts and the numbers of a table depend on each of them.

    ``starts`` are what is not zero of the changes of the start: the ball, which of its six numbers
    (place, velocity, roll), the input, and the change.
    ``numbers`` (7, P) are those of the table, ``mass`` and ``radius`` (N, P) those of the balls.
    Walls and patches may have numbers of their own, which do not follow those of the table:
    ``own_restitution`` and ``own_friction`` say so of walls, ``own_pull`` and ``own_drag`` of
    patches.
    """

    def __init__(
        self, starts: list[Entry], numbers: Rows, mass: Rows, radius: Rows,
        walls: tuple[list[bool], list[bool]], patches: tuple[list[bool], list[bool]],
    ) -> None:  # fmt: skip
        self.count: Final = len(numbers[0])
        self.starts = starts
        self.numbers: Final = [*numbers, [0.0] * self.count]
        self.mass: Final = mass
        self.radius: Final = radius
        self.own_restitution, self.own_friction = walls
        self.own_pull, self.own_drag = patches

    def changes_at_first(self, balls: int) -> list[list[Change]]:
        """Return the changes (N, P) of the balls' starts."""
        found = [[Change() for _ in range(self.count)] for _ in range(balls)]
        for ball, k, p, by in self.starts:
            found[ball][p].add(k, by)
            found[ball][p].ever = True
        return found
