"""The impulses of contacts explain how the velocities of their balls change."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from pool_pymunk import Law
from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact import impulses
from pool_pymunk.core.contact.contact import Contact as CoreContact
from pool_pymunk.core.contact.together import at_once, discs_of
from pool_pymunk.core.engine import Engine
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.path import Path, sliding
from pool_pymunk.core.motion.surface import Sliding
from pool_pymunk.core.persistent.persistence import Persistence
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws import LAWS, law_in_core
from pool_pymunk.laws.contact import NO_BALL, Contact, Pair
from pool_pymunk.laws.law import Coulomb
from tests.shared.core_clusters import InCore

R = 0.05
Row = tuple[float, float, float, float, float]  # x, y (m), vx, vy (m/s), mass (kg)


class Notes(Recorder):
    """This recorder keeps the impulses that it hears of, and has the balls."""

    def __init__(self, balls: list[Ball]) -> None:
        self.impulses: dict[tuple[int, ...], float] = {}
        self.balls = balls

    @property
    def paths(self) -> list[Path]:
        return [ball.path for ball in self.balls]

    def contact(self, one: CoreContact, t: float) -> None:
        balls = [disc.ball.number for disc in (one.a, one.b) if disc is not None]
        cushion = 0 if one.wall is None else one.wall.number
        self.impulses[(*balls, cushion)] = one.normal


def played(law: Law, rows: Sequence[Row], walls: Sequence[Wall] = (), e: float = 0.8) -> Notes:
    """Return what is reported of the first instant of balls on a plane without friction."""
    balls = [
        Ball(i, R, mass, sliding(0.0, (x, y), (vx, vy), 0.0))
        for i, (x, y, vx, vy, mass) in enumerate(rows)
    ]
    table = Table([*walls], Sliding(0.0), Patches([], []), e, e, 0.1)
    notes = Notes(balls)
    engine = Engine(table, balls, law_in_core(law), notes, Persistence())
    engine.begin_run()
    engine.advance(engine.upcoming())
    return notes


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
    """Those of the single hits, and of the solution, are those of least norm: they explain all."""
    own, (contacts, before) = law_in_core(law), cluster()
    found = InCore(contacts, before).contacts
    impulses.begin(found)
    if not own.together(found, impulses.NotedHits(own, (0.0, 0.0))):
        impulses.explain(found)
    shared = [(one.normal, one.along, one.along_first) for one in found]
    impulses.find_least(found, discs_of(found))
    for one, (normal, along, first) in zip(found, shared, strict=True):
        if law.name != "published":  # Its friction keeps no momentum.
            least = one.normal, one.along, one.along_first
            assert (normal, along, first) == pytest.approx(least, rel=1e-6, abs=1e-12)
        assert normal > 0.0


def test_the_impulses_of_a_triangle_are_those_that_the_law_has_solved_for() -> None:
    """Friction of three balls that touch can be shared variously: the law chose one."""
    normals = {(0, 1): (1.0, 0.0), (0, 2): (0.5, math.sqrt(0.75)), (1, 2): (-0.5, math.sqrt(0.75))}
    contacts = [
        Contact(i, j, normal, Pair(0.1 + 0.1 * i, 0.1 + 0.1 * j, 0.9, 0.2))
        for (i, j), normal in normals.items()
    ]
    found = InCore(contacts, {0: (1.0, 0.7), 1: (-1.2, 0.4), 2: (0.1, -1.5)}).contacts
    impulses.begin(found)
    assert at_once(found)
    solved = [(one.normal, one.along) for one in found]
    impulses.explain(found)
    assert [(one.normal, one.along) for one in found] == solved
    assert all(one.along_first == -one.along for one in found)
