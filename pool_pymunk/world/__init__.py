"""This package puts the engine into any pymunk space, by this contract:

1. Between two steps each ball's body shows its exact place and its true velocity.
2. When a step or a call of the table begins, each body is compared with what it showed last: a
   place or a velocity that differs by a bit is a new start from now on, and the roll stays. A ball
   that was put into others lies beside them, or stays where it was if there is no room.
3. The engine plays all contacts of a step with balls, walls, pockets and patches before pymunk
   makes its own step. Callbacks are called when their instant is over. What they do counts from
   then on.
4. Each ball then moves in pymunk's step with the velocity of the step's end to its place there, so
   that everything else in the space meets it where it is.
5. What others change of a ball's velocity in that step, by contacts, springs, gravity, damping,
   forces or functions, is one push at the step's end. Friction holds a ball at rest against less
   than it takes off in a step. Without friction, gravity is exact: balls fall on parabolas.
6. Places come from the engine alone: what others change of a place in that step does not count.
7. Balls and walls are in one group of filters, so that pymunk leaves their pairs out. Categories
   and masks hold in the engine, too. Collision types are yours.
8. A wall of a kinematic body moves in a step with the velocities that it has when the step begins.
   All other bodies are guests of sentence 5.
9. What has left the space has left the table at the next step or call. Masses, radii and filters of
   balls, and the places of static walls, stay as they came: another one is refused in one sentence.
10. An error of a law or a pair is raised by the step, and the table stands at that instant. An
    error of a callback is raised when the step is over.

Balls are circles there, and walls are shapes of static or kinematic bodies.
"""

import warnings

from pool_pymunk.world.ball import ContactEvent, TableBall, TableState, same_balls
from pool_pymunk.world.billiards import Billiards
from pool_pymunk.world.outlook import Prediction

__all__ = ["Billiards", "ContactEvent", "Prediction", "TableBall", "TableState", "same_balls"]


def __getattr__(name: str) -> type[TableBall]:
    if name != "Ball":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn("pool_pymunk.world.Ball is now TableBall", DeprecationWarning, stacklevel=2)
    return TableBall
