"""This module linearises the contacts of a run, for studies that follow small changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.contact import NT
from pool_pymunk.physics.dual import law_jacobian
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.saltation import (
    Geometry,
    Motion6,
    after,
    at_contact,
    bounce,
    hit,
    parts_before,
    turning,
)
from pool_pymunk.results.run import Run


def law_of(run: Run) -> Law:
    """Return the law of a run; raise SettingError for one that the run does not keep."""
    law = run.law_used or LAWS.get(run.law)
    if law is None:
        message = "is a law of your own, and a run that was loaded or copied does not keep it"
        raise setting_error("law", run.law, message)
    return law


class Contacts:
    """This object has what the contacts of a run depend on: its law, its walls and its balls."""

    def __init__(self, run: Run) -> None:
        self.law, self.scene, self.walls = law_of(run), run.scene, run.scene.cushions
        self.pair = cache(run.scene.pair)

    def geometry(self, balls: Sequence[int], motions: Sequence[Motion6], wall: int) -> Geometry:
        """Return the geometry of a contact of balls with these motions."""
        if len(balls) == 2:
            return hit(motions[0], motions[1])
        x, y = motions[0][:2]
        side = self.walls[wall].nearest(x, y, self.scene.balls[balls[0]].radius)
        return bounce(motions[0], side.normal(x, y), side.curvature(x, y))

    def asked(
        self, balls: Sequence[int], wall: int, before: Sequence[NT], moves: Sequence[bool],
        fastest: float,
    ) -> tuple[Array | None, list[NT]]:  # fmt: skip
        """Return the law's derivatives, as :func:`law_jacobian` does, and its answer.

        Raises SettingError for a law without derivatives.
        """
        numbers: Any
        if len(balls) == 2:
            numbers = self.pair(*balls)
            answer = [*self.law.ball_ball(before[0], before[1], numbers)]
        else:
            numbers = self.walls[wall].restitution, self.walls[wall].friction
            answer = [self.law.cushion(before[0], *numbers)]
        try:
            return law_jacobian(self.law, before, numbers, moves, fastest), answer
        except (TypeError, AttributeError) as error:
            if "dual" not in str(error).lower():
                raise
            message = "cannot be differentiated: it may use + - * / **, abs, min, max, comparisons"
            raise setting_error("law", self.law.name, message) from None


def through(
    geometry: Geometry,
    motions: Sequence[Any],
    rates: Sequence[Any],
    changes: Sequence[Array],
    late: Array,
    answer: Callable[[Array], Array],
    slow: Callable[[Array, Array, Array], Array],
    turned: Any = 0.0,
) -> list[Array]:
    """Return the changes (..., K, P) of the states of one or two balls after a contact.

    ``motions`` are x, y, vx, vy, ax, ay before it, and, where balls roll, the rolls' rates.
    ``rates`` are those after it, without x and y. ``changes`` are those before it. The contact
    is later by ``late`` (..., P), and its normal turns further by ``turned``. ``answer`` takes the
    changes (..., 2 C, P) of the velocities' parts before it, and returns those after it. ``slow``
    takes the change of a roll, the turning and the change of the push, and returns the new change
    of the roll. Numbers are scalars, or arrays (..., 1) for many contacts.
    """
    rows = [change.swapaxes(0, -2) for change in changes]
    moved = [at_contact(m[:6], own[:4], late) for m, own in zip(motions, rows, strict=True)]
    turn = turning(geometry, *offset(moved)) + turned
    split = (
        parts_before(geometry, motion[2:4], u, v, turn)
        for motion, (_, _, u, v) in zip(motions, moved, strict=True)
    )
    parts = np.stack([part for both in split for part in both], axis=-2)
    answered = answer(parts)
    found = []
    for n, (motion, rate, own) in enumerate(zip(motions, rates, rows, strict=True)):
        new = answered[..., 2 * n, :], answered[..., 2 * n + 1, :]
        state = [*after(geometry, rate[:4], moved[n][:2], new, turn, late)]
        if len(own) > 4:
            roll = own[4:] + np.array([each * late for each in motion[6:]])
            if len(motions) == 1:
                roll = slow(roll, turn, (answered - parts)[..., 0, :])
            state += [w - each * late for w, each in zip(roll, rate[4:], strict=True)]
        found.append(np.stack(state, axis=-2))
    return found


def offset(changes: Sequence[Any]) -> tuple[Any, Any]:
    """Return the change of a ball's place, or of the offset of two balls."""
    (x, y, *_), (from_x, from_y, *_) = changes[-1], changes[0]
    return (x, y) if len(changes) == 1 else (x - from_x, y - from_y)
