"""Hundreds of balls or forces at once: nothing in compiled code grows too deep, or takes long."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest

from pool_pymunk import Ball, Friction, Restitution, Run, Scene
from pool_pymunk.core.ball import Ball as CoreBall
from pool_pymunk.core.contact.contact import Contact, Disc, Pair, groups
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.near import near_of
from pool_pymunk.core.persistent.linear import System
from tests.shared.hard_scenes import exact, unmeasured

R = 0.03
Play = Callable[[Scene], Run]


def test_forces_of_hundreds_are_solved_and_their_rows_are_freed() -> None:
    """Rows that are filled by elimination are longer than what compiled code frees in one go."""
    count = 200
    for _ in range(3):
        system = System(count)
        for k, row in enumerate(system.rows):  # An arrow: the first force acts on all others.
            for column in range(count):
                if k in (0, column) or column == 0:
                    row.put(column, 3.0 if k == column else 1.0 / count)
        system.decompose()
        for times in (1.0, 2.0):  # Its factors serve again.
            for k, row in enumerate(system.rows):
                row.right = times * (1.0 if k > 0 else count + 1.0)
            system.solve()
            found = [system.solution(k) for k in range(count)]
            given = [3.0 * found[k] + found[0] / count for k in range(count)]
            given[0] = 3.0 * found[0] + sum(found[1:]) / count
            expected = [times * (count + 1.0)] + [times] * (count - 1)
            assert given == pytest.approx(expected, abs=1e-9)


def test_discs_that_contacts_join_do_not_hold_each_other() -> None:
    """A chain of so many would write over other memory when compiled code frees it."""
    discs = [
        Disc(CoreBall(k, R, 0.2, standing(0.0, 0.0, 0.0)), 0.0, 0.0, 0.0, 0.0) for k in range(60)
    ]
    pair = Pair(0.2, 0.2, 0.9, 0.0)
    row = [Contact(a, b, None, 1.0, 0.0, pair) for a, b in pairwise(discs)]
    assert [len(found) for found in groups(row[::-1])] == [59]
    assert {disc.first for disc in discs} == {None}


@pytest.mark.parametrize("is_reversed", [False, True])
@pytest.mark.parametrize(("count", "play"), [(150, unmeasured), (30, exact), (150, exact)])
def test_a_row_is_struck_at_its_end(count: int, play: Play, is_reversed: bool) -> None:
    """It takes no time, also where it is played with tiny gaps, in which balls lie in no line."""
    places = [0.5 + 2 * R * k for k in range(count)]
    start, speed = (0.2, 2.0) if not is_reversed else (places[-1] + 0.3, -2.0)
    row = [Ball(f"b{k}", (x, 0.5), R, 0.2) for k, x in enumerate(places)]
    balls = (Ball("cue", (start, 0.5), R, 0.2, velocity=(speed, 0.0)), *row)
    scene = Scene(
        balls[:1] + balls[:0:-1] if is_reversed else balls, None, Restitution(0.9, None, 0.9),
        Friction(0.2, 0.0, 0.0),
    )  # fmt: skip
    run = play(scene)
    assert run.status == "settled"
    doubts = {"frozen balls"} if play is exact else set[str]()
    assert run.policies <= doubts  # Gaps may also move no end to be seen.
    momentum = 0.2 * run.at(run.events[0].t)[1][:, 0].sum()
    left = math.sqrt(speed**2 - 2.0 * scene.deceleration * (0.3 - 2 * R))
    assert momentum == pytest.approx(0.2 * math.copysign(left, speed), rel=1e-9)


def test_balls_nearly_in_a_line_look_ahead_as_far_as_they_lie_apart() -> None:
    places = [(0.1 * k, 1e-12 * (k % 2)) for k in range(50)]
    near = near_of([CoreBall(k, R, 0.2, standing(0.0, *place)) for k, place in enumerate(places)])
    assert near.ahead == pytest.approx(0.1, rel=0.6)
