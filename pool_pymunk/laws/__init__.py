"""Contact laws as users write them, and how the core asks them.

A law of a user's own is a subclass of :class:`Law`. ``LAWS`` has those that a scenario file, an
option and an argument may name.
"""

from pool_pymunk.laws.contact import NT as NT
from pool_pymunk.laws.contact import Contact as Contact
from pool_pymunk.laws.contact import Pair as Pair
from pool_pymunk.laws.law import LAWS as LAWS
from pool_pymunk.laws.law import Law as Law
from pool_pymunk.laws.law import find_law as find_law
from pool_pymunk.laws.own import law_in_core as law_in_core
from pool_pymunk.laws.own import respond as respond
