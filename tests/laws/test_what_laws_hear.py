"""A law of one's own hears all of a contact, and what it answers is not forgotten."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pymunk

from pool_pymunk import NT, Ball, Friction, Law, Pair, Restitution, Scene, simulate
from pool_pymunk.laws.contact import NO_BALL, Contact, Respond, Velocities, closing_speed
from tests.shared.worlds import R, ball, plane

UP = (0.0, 1.0)
KICK = 0.5  # m/s


class Listener(Law):
    """This law keeps the contacts that it hears of."""

    name = "listener"

    def __init__(self) -> None:
        self.heard: list[Contact] = []

    def together(self, contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
        self.heard += contacts
        super().together(contacts, velocity, respond)


class JumpsOnce(Law):
    """This law jumps at the first hit that it is asked of, and answers contacts twice."""

    name = "jumps once"

    def __init__(self) -> None:
        self.asked = 0

    def jumps(self, a: NT, b: NT, pair: Pair) -> bool:
        self.asked += 1
        return self.asked == 1

    def together(self, contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
        for contact in [*contacts, *contacts]:
            respond(contact, velocity)


def test_a_cushion_that_moves_closes_by_its_own_speed_along_the_normal() -> None:
    contact = Contact(0, NO_BALL, UP, Pair(0.2, math.inf, 1.0, 0.0), drift=(7.0, 2.0))
    assert closing_speed(contact, {0: (5.0, 0.5)}) == 1.5
    assert closing_speed(contact, {0: (5.0, 3.0)}) == -1.0


def test_it_hears_of_the_kick_and_the_drift_of_walls() -> None:
    """A ball comes to a corner of a wall that moves and kicks, and of one that does neither."""
    law = Listener()
    space, table = plane(law=law, deceleration=0.0)
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    body.velocity = 0.25, 0.0
    table.add_wall(pymunk.Segment(body, (0.0, -9.0), (0.0, 9.0), 0.0), 1.0, 0.0, kick=KICK)
    table.add_wall(pymunk.Segment(space.static_body, (9.0, 0.0), (-9.0, 0.0), 0.0), 1.0, 0.0)
    ball(table, R + 0.0125, R + 0.01, (-1.0, -1.0))
    space.step(1 / 60)
    heard = {contact.cushion: contact for contact in law.heard}
    assert [heard[k].kick for k in (0, 1)] == [KICK, 0.0]
    assert [heard[k].drift for k in (0, 1)] == [(0.25, 0.0), (0.0, 0.0)]


def test_a_jump_is_not_forgotten_where_the_same_contact_is_answered_again() -> None:
    balls = (
        Ball("a", (0.0, 0.0), 0.03, 0.2, velocity=(1.0, 0.0)),
        Ball("b", (0.1, 0.03), 0.03, 0.2), Ball("c", (0.1, -0.03), 0.03, 0.2),
    )  # fmt: skip
    scene = Scene(balls, None, Restitution(0.9), Friction(0.1, 0.0, 0.05))
    for law in (JumpsOnce(), Law()):
        run = simulate(scene, solver="event-driven", law=law, max_time=1.0)
        assert ("zero slip" in run.policies) == isinstance(law, JumpsOnce)
        assert len(run.events) >= 2
