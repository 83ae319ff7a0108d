"""The impulses of contacts explain how the velocities of their balls change."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from pool_pymunk.solvers.own import path_of

from pool_pymunk import Law
from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact as CoreContact
from pool_pymunk.core.engine import Engine
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.path import sliding
from pool_pymunk.core.motion.surface import Sliding as CoreSliding
from pool_pymunk.core.persistent.declined import Declined
from pool_pymunk.core.record import Recorder as CoreRecorder
from pool_pymunk.core.table import Table as CoreTable
from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.near import Boxes
from pool_pymunk.engine.recorder import Recorder
from pool_pymunk.laws import LAWS
from pool_pymunk.laws.contact import NO_BALL, Contact, Impulse, Pair, Velocities
from pool_pymunk.laws.law import Coulomb
from pool_pymunk.physics.impulses import Shared
from pool_pymunk.physics.laws import respond
from pool_pymunk.physics.path import Path, set_off
from pool_pymunk.physics.sides import Wall, face_between
from pool_pymunk.physics.surface import Sliding
from pool_pymunk.physics.together import at_once
from pool_pymunk.solvers.in_core import law_in_core, wall_in_core

R = 0.05
Row = tuple[float, float, float, float, float]  # x, y (m), vx, vy (m/s), mass (kg)


class Notes(Recorder):
    """This recorder keeps the impulses that it hears of."""

    def __init__(self) -> None:
        self.impulses: dict[tuple[int, ...], float] = {}
        self.paths: list[Path] = []  # of the balls, after the first instant

    def contact(self, contact: Contact, impulse: Impulse, t: float) -> None:
        self.impulses[(*contact.balls, contact.cushion or 0)] = impulse.normal


def played(law: Law, rows: Sequence[Row], walls: Sequence[Wall] = (), e: float = 0.8) -> Notes:
    """Return what is reported of the first instant of balls on a plane without friction.

    The core reports the same.
    """
    notes, its = Notes(), played_by_core(law, rows, walls, e)

    def pair(i: int, j: int) -> Pair:
        return Pair(rows[i][4], rows[j][4], e, 0.1)

    engine = ContactEngine(law, pair, Sliding(), notes)
    engine.walls = list(walls)
    engine.near = Boxes(len(rows), len(walls))
    for x, y, vx, vy, mass in rows:
        engine.add_ball(set_off(0.0, (x, y), (vx, vy), 0.0), R, mass)
    for i, path in enumerate(engine.paths):
        engine.near.begin(i, path, R, 0.0, math.inf)
    engine.predict(range(len(rows)))
    engine.next()
    notes.paths = engine.paths
    assert repr(its.impulses) == repr(notes.impulses)
    assert repr([path_of(ball.path) for ball in its.balls]) == repr(notes.paths)
    return notes


class CoreNotes(CoreRecorder):
    """This recorder keeps the impulses that it hears of from the core, and has its balls."""

    def __init__(self, balls: list[Ball]) -> None:
        self.impulses: dict[tuple[int, ...], float] = {}
        self.balls = balls

    def contact(self, one: CoreContact, t: float) -> None:
        balls = [disc.ball.number for disc in (one.a, one.b) if disc is not None]
        cushion = 0 if one.wall is None else one.wall.number
        self.impulses[(*balls, cushion)] = one.normal


def played_by_core(law: Law, rows: Sequence[Row], walls: Sequence[Wall], e: float) -> CoreNotes:
    """Return what the core reports of the first instant."""
    balls = [
        Ball(i, R, mass, sliding(0.0, (x, y), (vx, vy), 0.0))
        for i, (x, y, vx, vy, mass) in enumerate(rows)
    ]
    its = [wall_in_core(wall) for wall in walls]
    table = CoreTable(its, CoreSliding(0.0), Patches([], []), e, e, 0.1)
    notes = CoreNotes(balls)
    engine = Engine(table, balls, law_in_core(law), notes, Declined())
    engine.begin_run()
    engine.advance(engine.upcoming())
    return notes


@pytest.mark.parametrize("law", ["coulomb", "published"])
def test_a_single_hit(law: str) -> None:
    """J_n = (1 + e) m_eff v, whatever friction does."""
    notes = played(LAWS[law], [(0.0, 0.0, 2.0, 0.0, 0.3), (0.3, 0.03, 0.0, 0.0, 0.1)])
    normal = math.sqrt(1.0 - 0.3**2)  # The line of centres leans by 0.03 of 0.1 m.
    assert notes.impulses == {(0, 1, 0): pytest.approx(1.8 * 0.075 * 2.0 * normal)}


def test_a_cushion() -> None:
    """J_n = (1 + e) m v_n."""
    wall = Wall((face_between((0.0, 1.0), (0.0, -1.0)),), 0.5, 0.2, 7)
    notes = played(Coulomb(), [(0.5, 0.0, -2.0, 0.3, 0.2)], [wall])
    assert notes.impulses == {(0, 7): pytest.approx(0.2 * 1.5 * 2.0)}


class Mean(Law):
    """This law leaves contacts of one instant to the mean over their orders."""


class Wrapped(Law):
    """This law solves for all impulses at once, with a ``respond`` of its own."""

    def together(self, contacts: Any, velocity: Any, respond: Any) -> None:
        Coulomb().together(contacts, velocity, lambda contact, v: respond(contact, v))


class Halves(Law):
    """This law takes the mean over two orders by itself."""

    def together(self, contacts: Any, velocity: Any, respond: Any) -> None:
        ends = []
        for order in (contacts, contacts[::-1]):
            after = dict(velocity)
            for contact in order:
                respond(contact, after)
            ends.append(after)
        for i in velocity:
            x, y = ((ends[0][i][k] + ends[1][i][k]) / 2.0 for k in (0, 1))
            velocity[i] = (x, y)


class Alone(Law):
    """This law asks nobody: it turns the ball in the middle back, and stops the others."""

    def together(self, contacts: Any, velocity: Any, respond: Any) -> None:
        masses = {c.a: c.pair.m_a for c in contacts} | {c.b: c.pair.m_b for c in contacts}
        momentum = masses[0] * velocity[0][0]
        velocity[0] = (0.0, 0.0)
        for i in (1, 2):
            velocity[i] = (momentum / 2.0 / masses[i], velocity[i][1])


WEDGE = [
    (0.0, 0.0, 2.0, 0.0, 0.3),
    (0.2 + R * math.sqrt(3.0), R, 0.0, 0.0, 0.1),
    (0.2 + R * math.sqrt(3.0), -R, 0.0, 0.0, 0.1),
]


@pytest.mark.parametrize("law", [Coulomb, Wrapped, Mean, Halves, Alone])
def test_one_ball_between_two(law: Callable[[], Law]) -> None:
    """Both take the same, and what it takes along x explains what the first ball loses."""
    notes = played(law(), WEDGE)
    assert notes.impulses.keys() == {(0, 1, 0), (0, 2, 0)}
    one, other = notes.impulses.values()
    assert one == pytest.approx(other, rel=1e-9)
    ball = notes.paths[0]
    if law is Coulomb or law is Wrapped:
        closing = 2.0 * math.sqrt(0.75)
        m_eff = 1.0 / (1.0 / 0.1 + (1.0 + 0.5) / 0.3)
        assert one == pytest.approx(1.8 * closing * m_eff, rel=1e-12)
    lost = 0.3 * (2.0 - ball.vx)
    if law is Alone:
        assert one == pytest.approx(lost / 2.0 * math.sqrt(0.75), rel=1e-9)
    assert 0.0 < one * math.sqrt(3.0) <= lost * (1.0 + 1e-12)


def cluster() -> tuple[list[Contact], dict[int, tuple[float, float]]]:
    """Return a ball that others press to a cushion, which is redundant in no direction."""
    pairs = [Pair(0.2, math.inf, 0.7, 0.1), Pair(0.2, 0.4, 0.9, 0.1)]
    contacts = [
        Contact(0, NO_BALL, (0.0, 1.0), pairs[0], 3),
        Contact(0, 1, (0.6, 0.8), pairs[1]),
    ]
    return contacts, {0: (1.0, -1.0), 1: (-0.3, -2.0)}


@pytest.mark.parametrize("law", [Coulomb(), Mean(), LAWS["published"]])
def test_every_way_finds_the_same_impulses_where_there_is_one_answer(law: Law) -> None:
    """Those of the calls, and of the solution, are those of least norm: they explain the change."""
    contacts, before = cluster()
    after, calls = dict(before), []

    def one(contact: Contact, velocity: Velocities) -> None:
        old = [velocity[i] for i in contact.balls]
        respond(law, contact, velocity)
        calls.append((contact, old, [velocity[i] for i in contact.balls]))

    law.together(contacts, after, one)
    shared, least = Shared(contacts, before, after, calls), Shared(contacts, before, after)
    for contact in contacts:
        if law.name != "published":  # Its friction keeps no momentum.
            for found, other in zip(shared.impulse(contact), least.impulse(contact), strict=True):
                assert other is None or found == pytest.approx(other, rel=1e-6, abs=1e-12)
        assert shared.impulse(contact).normal > 0.0


def test_the_impulses_of_a_triangle_are_those_that_the_law_has_solved_for() -> None:
    """Friction of three balls that touch can be shared variously: the law chose one."""
    normals = {(0, 1): (1.0, 0.0), (0, 2): (0.5, math.sqrt(0.75)), (1, 2): (-0.5, math.sqrt(0.75))}
    contacts = [
        Contact(i, j, normal, Pair(0.1 + 0.1 * i, 0.1 + 0.1 * j, 0.9, 0.2))
        for (i, j), normal in normals.items()
    ]
    before = {0: (1.0, 0.7), 1: (-1.2, 0.4), 2: (0.1, -1.5)}
    after = dict(before)
    solved = at_once(contacts, after)
    assert solved is not None
    shared = Shared(contacts, before, after)
    normal, tangential, first = zip(*map(shared.impulse, contacts), strict=True)
    assert ([*normal], [*tangential]) == solved
    assert first == tuple(-t for t in tangential)
