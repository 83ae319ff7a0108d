"""There are reasons why something has no derivative; {} stands for the name of the law."""

from __future__ import annotations

from typing import Final

FOLLOWED: Final = ""  # There is no such reason.
KNOWN_BEFORE: Final = "it was not known before"
SHARED: Final = "contacts of one instant share a ball"
CUT_OFF: Final = "the run was cut off at a contact"
ENDS_THERE: Final = "the run ends just at a contact"
RESTS_THERE: Final = "a ball comes to rest just as it is hit, or just where it touches"
UNTOLD: Final = "a contact is persistent, or answered by a policy"
AT_CORNER: Final = "a ball meets a cushion just where a corner begins"
IS_GRAZE: Final = "a contact is a graze"
JUMPS: Final = "law {} jumps or has a kink"
BY_POLICY: Final = "a contact is answered by a policy"
AT_RIM: Final = "a ball grazes the rim of a pocket"
GROWN: Final = "the derivatives have grown beyond 1e+150"
TOUCHES: Final = "a path touches what it does not hit"
TOUCH_FIRST: Final = "balls touch at the start"
BENT: Final = "law {} has a kink, as between sticking and slipping"
STOPPED: Final = "a ball stops at contact, so the time of its stop has a kink"
PERSISTS: Final = "a contact is persistent"
RESTS_LAST: Final = "a ball comes to rest just as the run ends"
CHAOS: Final = "errors grow until other contacts may come"
AT_BORDER: Final = "a ball grazes the border of a patch, or starts at one"
