"""There are reasons why something has no derivative, each with its number."""

from __future__ import annotations

from typing import Final

FOLLOWED: Final = 0
KNOWN_BEFORE: Final = 1
SHARED: Final = 2
CUT_OFF: Final = 3
ENDS_THERE: Final = 4
RESTS_THERE: Final = 5
UNTOLD: Final = 6
AT_CORNER: Final = 7
IS_GRAZE: Final = 8
JUMPS: Final = 9
BY_POLICY: Final = 10
AT_RIM: Final = 11
GROWN: Final = 12
TOUCHES: Final = 13
TOUCH_FIRST: Final = 14
BENT: Final = 15
STOPPED: Final = 16
PERSISTS: Final = 17
RESTS_LAST: Final = 18
CHAOS: Final = 19
AT_BORDER: Final = 20

REASONS: Final = [
    "",
    "it was not known before",
    "contacts of one instant share a ball",
    "the run was cut off at a contact",
    "the run ends just at a contact",
    "a ball comes to rest just as it is hit, or just where it touches",
    "a contact is persistent, or answered by a policy",
    "a ball meets a cushion just where a corner begins",
    "a contact is a graze",
    "law {} jumps or has a kink",
    "a contact is answered by a policy",
    "a ball grazes the rim of a pocket",
    "the derivatives have grown beyond 1e+150",
    "a path touches what it does not hit",
    "balls touch at the start",
    "law {} has a kink, as between sticking and slipping",
    "a ball stops at contact, so the time of its stop has a kink",
    "a contact is persistent",
    "a ball comes to rest just as the run ends",
    "errors grow until other contacts may come",
    "a ball grazes the border of a patch, or starts at one",
]
