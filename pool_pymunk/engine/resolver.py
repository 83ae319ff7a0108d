"""The resolver answers the contacts of one instant by the law, or else by a policy.

- *One instant*: the law answers together the contacts that share a ball. A contact that closes
  only because of a hit, as in a row of touching balls, comes next at the same instant.
- *Rounding*: a closing speed of the size of rounding is no hit, and a ball with only such a speed
  after a hit rests.
- *Inelastic collapse*: after ``LISTED`` hits at one instant the others are played out
  (:mod:`pool_pymunk.physics.collapse`). They are no events; a warning gives their number.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

from pool_pymunk.engine import decisions
from pool_pymunk.physics.collapse import MOST_HITS, Collapse, play_out
from pool_pymunk.physics.contact import (
    NO_BALL,
    NT,
    Contact,
    Respond,
    Vector,
    Velocities,
    closing_speed,
    groups,
)
from pool_pymunk.physics.impulses import (
    Call,
    Impulse,
    Shared,
    impulse_of,
    slowing,
)
from pool_pymunk.physics.laws import Law, Slip, respond, settle
from pool_pymunk.physics.path import NOISE
from pool_pymunk.physics.surface import Push

SAME_NORMAL = 1e-12  # 1 - cosine of two normals; half or twice it moves no ball in tests.halved

# Kinds of answers:
HIT = "hit"  # The law answered, and this is an event.
COLLAPSED = "collapsed"  # The law answered many hits of an inelastic collapse.
LED = "led"  # A cushion leads a ball along itself.
MISSED = "missed"  # Two balls touch, but do not close.

# A recorder gets these notes on answers beside the hits:
ZERO_SLIP = "zero_slip"  # The slip was rounding alone, and the law jumps there.


class Answer:
    """An answer tells what became of one contact of an instant, by its ``kind`` and ``notes``."""

    notes: tuple[str, ...] = ()
    # m/s; of the balls, before and after a hit that came alone
    changed: tuple[Sequence[Vector], Sequence[Vector]] | None = None
    shared: Shared | None = None

    def __init__(self, contact: Contact, kind: str = MISSED) -> None:
        self.contact = contact
        self.kind = kind

    def impulse(self) -> Impulse:
        """Return the impulse that drives the two sides apart, and that of friction."""
        if self.changed is not None:
            return impulse_of(self.contact, *self.changed)
        return self.shared.impulse(self.contact) if self.shared else Impulse(0.0, 0.0)


class Resolution:
    """A resolution has an instant's answers; missed contacts of balls that were hit have none."""

    def __init__(self, answers: list[Answer]) -> None:
        self.answers = answers
        self.missed: list[Contact] = []  # balls that touch, but do not close
        self.velocity: dict[int, Vector] = {}  # m/s; of balls that begin a new path, or stop
        self.noise = 0.0  # m/s; how much of a velocity may be rounding


class Resolver:
    """The resolver answers contacts by a law; ``slip`` stands for slips that are rounding."""

    def __init__(self, law: Law, noises: Sequence[float]) -> None:
        self.law = law
        self.noises = noises
        self.slip: Slip | None = None  # Friction is left out where the law jumps.
        self.collapses = 0  # of more than two contacts, so far

    def resolve(self, contacts: Sequence[Contact], before: Mapping[int, Vector]) -> Resolution:
        """Answer the contacts of this instant; ``before`` (m/s) is the velocity of their balls."""
        velocity = dict(before)
        answers = [self._look_at(contact, velocity) for contact in contacts]
        hits = [answer for answer in answers if answer.kind != MISSED]
        resolution = Resolution(answers)
        if len(hits) == 1:
            self._answer_alone(hits[0], velocity)
        elif hits:
            self._answer_together(hits, velocity)
        if len(hits) < len(answers):
            self._leave_out(resolution, hits, velocity)
        self._conclude(before, velocity, hits, resolution)
        return resolution

    def play_out(
        self, contacts: Sequence[Contact], before: Mapping[int, Vector]
    ) -> tuple[Resolution, Collapse]:
        """Answer the hits of a collapse, at one instant, until closing speeds are rounding."""
        velocity = dict(before)
        answers = [Answer(contact, COLLAPSED) for contact in contacts]
        one, leaps = self._noting(answers), self.law.hits_are_coulombs
        self.collapses += len(contacts) > 2
        most = decisions.MOST_IN_PILE if self.collapses > decisions.PILE else MOST_HITS
        all_ = partial(self._answer_all, one=one)
        collapse = play_out(contacts, decisions.CONVERGED, velocity, all_, leaps, most)
        settle(contacts, velocity)  # Mostly this changes rounding only.
        shared = Shared(contacts, dict(before), velocity)
        for answer in answers:
            answer.shared = shared
        resolution = Resolution(answers)
        self._conclude(before, velocity, answers, resolution)
        return resolution, collapse

    def _answer_all(self, contacts: Sequence[Contact], velocity: Velocities, one: Respond) -> None:
        """Change the velocities (m/s) by the law, group by group of contacts that share a ball."""
        for group in groups(contacts) if len(contacts) > 1 else (contacts,):
            if len(group) == 1:
                one(group[0], velocity)
            else:
                self.law.together(group, velocity, one)

    def respond(self, contact: Contact, velocity: Velocities) -> bool:
        """Answer one contact by the law; return whether the law jumps there."""
        return respond(self.law, contact, velocity, self.slip)

    def _answer_alone(self, hit: Answer, velocity: Velocities) -> None:
        """Answer a hit that comes alone."""
        contact = hit.contact
        i, j = contact[:2] if contact.b != NO_BALL else (contact.a, contact.a)
        before = velocity[i], velocity[j]
        if self.respond(contact, velocity):
            hit.notes += (ZERO_SLIP,)
        hit.changed = before, (velocity[i], velocity[j])

    def _answer_together(self, hits: Sequence[Answer], velocity: Velocities) -> None:
        """Answer several hits of an instant, and keep the data from which impulses follow."""
        before, calls, contacts = dict(velocity), list[Call](), [hit.contact for hit in hits]
        self._answer_all(contacts, velocity, self._noting(hits, calls))
        shared = Shared(contacts, before, dict(velocity), calls)
        for hit in hits:
            hit.shared = shared

    def _noting(self, answers: Iterable[Answer], calls: list[Call] | None = None) -> Respond:
        """Return a function that answers one contact by the law, and notes jumps and calls."""
        of = {answer.contact[:3]: answer for answer in answers}

        def one(contact: Contact, velocity: Velocities) -> None:
            old = [velocity[i] for i in contact.balls]
            if self.respond(contact, velocity) and contact[:3] in of:
                of[contact[:3]].notes += (ZERO_SLIP,)
            if calls is not None:
                calls.append((contact, old, [velocity[i] for i in contact.balls]))

        return one

    def _look_at(self, contact: Contact, velocity: Velocities) -> Answer:
        """Decide whether a contact is a hit."""
        noise, other = self.noises[contact.a], contact.b
        if other != NO_BALL and self.noises[other] > noise:
            noise = self.noises[other]
        return Answer(contact, HIT if closing_speed(contact, velocity) > noise else MISSED)

    def _leave_out(self, resolution: Resolution, hits: list[Answer], velocity: Velocities) -> None:
        """Leave out missed contacts of balls that were hit; lead others along cushions."""
        moved = {i for hit in hits for i in hit.contact.balls}
        for answer in resolution.answers[:]:
            contact = answer.contact
            if answer.kind != MISSED:
                continue
            if not moved.isdisjoint(contact.balls):
                resolution.answers.remove(answer)
            elif contact.b == NO_BALL:
                answer.kind = LED
                before, (nx, ny) = velocity[contact.a], contact.normal
                n = before[0] * nx + before[1] * ny
                velocity[contact.a] = after = before[0] - n * nx, before[1] - n * ny
                resolution.velocity[contact.a] = after
                answer.changed = [before], [after]
            else:
                resolution.missed.append(contact)

    def _conclude(
        self, before: Mapping[int, Vector], velocity: Velocities, hits: list[Answer], to: Resolution
    ) -> None:
        """Keep the new velocities, and set to zero those that are rounding alone."""
        fastest = noise = 0.0  # the square of a speed, and a speed
        for i, (wx, wy) in before.items():
            vx, vy = velocity[i]
            if (square := vx * vx + vy * vy) > fastest:
                fastest = square
            if (square := wx * wx + wy * wy) > fastest:
                fastest = square
            if self.noises[i] > noise:
                noise = self.noises[i]
        to.noise = noise = decisions.noise_after(fastest, noise)
        moved = {*to.velocity}
        for hit in hits:
            moved.update(hit.contact.balls)
        for i in sorted(moved):
            vx, vy = after = velocity[i]
            rests = vx * vx + vy * vy <= noise * noise
            to.velocity[i] = (0.0, 0.0) if rests else after

    def loses_speed(self, contacts: Iterable[Contact]) -> bool:
        """Tell whether any of the contacts loses speed when it closes head-on at 1 m/s."""
        for contact in contacts:
            a, b, pair = NT(0.0, 0.0), NT(-1.0, 0.0), contact.pair
            if contact.b == NO_BALL:
                b = self.law.cushion(b, pair.restitution, pair.friction)
            else:
                a, b = self.law.ball_ball(NT(1.0, 0.0), a, pair)
            if b.n - a.n < 1.0 - NOISE:
                return True
        return False


def distinct(contacts: Iterable[Contact]) -> list[Contact]:
    """Return the contacts; where two cushions lie on one line, they give one contact."""
    kept: list[Contact] = []
    of_sides: dict[tuple[int, int], list[Contact]] = {}
    for contact in contacts:
        nx, ny = contact.normal
        others = of_sides.setdefault((contact.a, contact.b), [])
        turns = [nx * other.normal[0] + ny * other.normal[1] for other in others]
        if not any(turn > 1.0 - SAME_NORMAL for turn in turns):
            others.append(contact)
            kept.append(contact)
    return kept


def cushion_pushes(resolution: Resolution) -> dict[int, list[Push]]:
    """Return each ball's pushes by cushions: normals, and how much they slow the roll (m/s)."""
    pushes: dict[int, list[Push]] = {}
    for answer in resolution.answers:
        contact = answer.contact
        if contact.b == NO_BALL and answer.kind != MISSED:
            slows = slowing(contact.pair.friction, answer.impulse().normal, contact.pair.m_a)
            pushes.setdefault(contact.a, []).append((contact.normal, slows))
    return pushes
