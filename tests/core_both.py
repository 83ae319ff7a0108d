"""Functions, laws and sides of the contact engine and their twins in the core, asked together.

So closed forms, and references in forty digits, go over both: their answers have the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from core_scenes import flat

from pool_pymunk.core.contact import laws as core_laws
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.motion import pairs as core_pairs
from pool_pymunk.core.motion import times
from pool_pymunk.core.motion.path import sliding
from pool_pymunk.core.walls.side import Side
from pool_pymunk.physics import laws, motion, pairs
from pool_pymunk.physics import path as paths
from pool_pymunk.physics.contact import NT, Pair
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.sides import Wall
from pool_pymunk.solvers.in_core import law_in_core, side_in_core, wall_in_core
from pool_pymunk.solvers.own import path_in_core


def same_of(one: Any, other: Any) -> Any:
    """Return an answer that two have given with the same bits."""
    assert repr(flat(tuple_of(one))) == repr(flat(tuple_of(other)))
    return one


def tuple_of(answer: Any) -> Any:
    """Return an answer as a tuple."""
    return answer if isinstance(answer, tuple) else (answer,)


def both(old: Callable[..., Any], new: Callable[..., Any]) -> Any:
    """Return a function that asks two others, which must answer with the same bits."""
    return lambda *asked: same_of(old(*asked), new(*asked))


# -- motion ----------------------------------------------------------------------------------------


def core_impact(*asked: Any) -> float:
    """Return what the core's `time_of_impact` does; the last argument may be left out."""
    return times.time_of_impact(*asked, *[0.0] * (6 - len(asked)))


def core_pair_time(a: Path, b: Path, *asked: Any) -> float:
    """Return what the core's `pair_time` does for paths of the contact engine."""
    noise = [0.0] * (4 - len(asked))
    return core_pairs.pair_time(path_in_core(a), path_in_core(b), *asked, *noise)


def slid(*asked: Any) -> Any:
    """Return place and velocity of a ball that slides: its start, deceleration, and a time."""
    x, y, vx, vy, pull, t = asked
    old = paths.motion_at(paths.set_off(0.0, (x, y), (vx, vy), pull), t)
    return same_of(old, sliding(0.0, (x, y), (vx, vy), pull).at(t))


stopping_time = both(motion.stopping_time, times.stopping_time)
time_of_impact = both(motion.time_of_impact, core_impact)
path_to_disc = both(motion.path_to_disc, times.path_to_disc)
closing_acceleration = both(motion.closing_acceleration, times.closing_acceleration)
pair_time = both(pairs.pair_time, core_pair_time)


# -- sides and walls -------------------------------------------------------------------------------


class BothSides:
    """This side answers as a side of the contact engine and one of the core do alike."""

    def __init__(self, side: Any, core: Side | None = None) -> None:
        self.side, self.core = side, core or side_in_core(side)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        old = self.side.time_of_contact(path, r, now)
        return float(same_of(old, self.core.time_of_contact(path_in_core(path), r, now)))

    def gap(self, x: float, y: float, r: float) -> float:
        return float(same_of(self.side.gap(x, y, r), self.core.gap(x, y, r)))

    def normal(self, x: float, y: float) -> Any:
        return same_of(self.side.normal(x, y), self.core.normal(x, y))


class BothWalls:
    """This wall answers as a wall of the contact engine and one of the core do alike."""

    def __init__(self, wall: Wall) -> None:
        self.wall, self.core = wall, wall_in_core(wall)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        old = self.wall.time_of_contact(path, r, now)
        return float(same_of(old, self.core.time_of_contact(path_in_core(path), r, now)))

    def nearest(self, x: float, y: float, r: float) -> BothSides:
        return BothSides(self.wall.nearest(x, y, r), self.core.nearest(x, y, r, 0.0))


# -- laws ------------------------------------------------------------------------------------------


def plain(v: NT) -> tuple[float, float]:
    """Return a velocity as the core has it."""
    return v.n, v.t


class BothLaws(laws.Law):
    """This law answers as a law of the contact engine and its twin in the core do alike."""

    def __init__(self, law: laws.Law) -> None:
        self.law, self.core, self.name = law, law_in_core(law), law.name

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        after = self.law.ball_ball(a, b, pair)
        same_of(after, self.core.ball_ball(plain(a), plain(b), CorePair(*pair)))
        return after

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        after = self.law.cushion(v, restitution, friction)
        same_of(after, self.core.cushion(plain(v), restitution, friction))
        return after

    def jumps(self, a: NT, b: NT, pair: Pair) -> bool:
        jumps = self.law.jumps(a, b, pair)
        return bool(same_of(jumps, self.core.jumps(plain(a), plain(b), CorePair(*pair))))


LAWS = {name: BothLaws(law) for name, law in laws.LAWS.items()}
coulomb, published = LAWS["coulomb"].ball_ball, LAWS["published"].ball_ball
cushion = LAWS["coulomb"].cushion
decay = both(laws.decay, core_laws.decay)
