"""An instant answers what is due: a contact that comes alone, or several at once.

- *One instant*: contacts belong to one instant if their gaps are closed, to rounding, at the time
  of the first. At a corner, for example, both cushions answer.
- *Rounds*: what closes after an answer is the next round of the same instant. After many rounds all
  that touches here is answered, round after round, until nothing closes.
- *Inelastic collapse*: after ``LISTED`` hits at one instant the others are played out. They are no
  events; a warning gives their number.
- *Pockets*: a ball leaves the table when its centre comes to a pocket's rim, and has no part in
  contacts of that instant.
"""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import i64

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact import rounds
from pool_pymunk.core.contact.collapse import go_on
from pool_pymunk.core.contact.contact import HIT, MISSED, Contact, Disc
from pool_pymunk.core.motion.path import NOISE
from pool_pymunk.core.motion.times import EPSILON, INF
from pool_pymunk.core.persistent.persistence import Persistence
from pool_pymunk.core.present import Present, is_new
from pool_pymunk.core.queue import Due, Queue
from pool_pymunk.core.walls.wall import Pocket

# After this many rounds of contacts at one instant, what touches is looked at once. With 1 or 6,
# one end of 54 hard runs moves by up to 1e-6 m.
FEW_ROUNDS: Final = 3
# More hits at one instant are a collapse, and are not listed one by one. With 50 or 200, one end of
# 54 hard runs moves by up to 3e-6 m, and a run may list half or twice as many events.
LISTED: Final = 100


@final
class Instant:
    """An instant began at a time (s), had some rounds, and these contacts have met in it.

    The last contact to come alone ``is_special`` if it is one of a pocket or a group.

    The engine hands it what is due, and asks it after several contacts which balls are ``changed``
    and which pairs have ``missed`` each other: it predicts anew what they meet.
    """

    def __init__(self, queue: Queue) -> None:
        self.queue: Final = queue
        self.began = -INF
        self.rounds: i64 = 0
        self.is_special = False
        self.met: list[Due] = []
        self.collapses = 0  # of more than two contacts, so far
        self.changed: list[Ball] = []
        self.missed: list[Contact] = []

    def begin_run(self) -> None:
        """Begin another run: its first contact begins an instant, in which nothing has met yet."""
        self.began = -INF
        self.rounds = 0
        self.collapses = 0

    def _begin(self) -> None:
        """Forget what has met, as another instant begins or all is over in this one."""
        self.rounds = 0
        if len(self.met) > 0:
            self.met = []

    def _begin_with(self, due: Due, now: float) -> None:
        """Begin another instant now (s) with a lone hit; mostly the one before was one, too."""
        self.began, self.rounds = now, 1
        if len(self.met) == 1:
            self.queue.keep(self.met[0])
            self.met[0] = due
        else:
            self.met = [due]

    def answer(self, present: Present, persistence: Persistence, dues: list[Due]) -> None:
        """Answer contacts of one instant, of which none is a lone hit."""
        self.changed, self.missed = [], []
        if len(dues) == 1 and not self.is_special:
            self._answer_several(present, persistence, dues)
            return
        dues = self._take_all_in(present, persistence, dues)
        dues = persistence.loud(present, dues)
        if len(dues) > 0:
            self._answer_several(present, persistence, dues)
        else:
            persistence.go_after(present, [], [])

    def _take_all_in(
        self, present: Present, persistence: Persistence, dues: list[Due]
    ) -> list[Due]:
        """Let pockets take balls in, and return the contacts of the others."""
        if not any(due.wall is not None and due.wall.is_pocket for due in dues):
            return dues
        for due in dues:
            if isinstance(due.wall, Pocket) and not due.a.is_off:
                persistence.leave(present, due.a)
                present.take_in(due.a, due.wall)
        self.met = [due for due in self.met if due.is_on_table]
        return [due for due in dues if due.is_on_table]

    # -- one contact -------------------------------------------------------------------------------

    def answer_lone(self, present: Present, persistence: Persistence, due: Due) -> bool:
        """Answer a contact that comes alone if it is a mere hit, as mostly; tell whether it is."""
        wall, fastest = due.wall, due.a
        self.is_special = True
        if wall is not None and wall.is_pocket:
            return False
        a, b = present.disc(due.a), None
        if due.b is not None:
            b = present.disc(due.b)
            fastest = due.b if due.b.speed > fastest.speed else fastest
        one = present.contact(a, b, wall)
        self.is_special = persistence.concerns(present, one)
        noise, begins = one.noise, self._is_over(present, fastest)
        if (
            self.is_special
            or one.closing <= noise
            or (self.rounds >= FEW_ROUNDS and not begins)
            or (b is not None and present.law.jumps(one.parts_of_a(), one.parts_of_b(), one.pair))
        ):
            return False
        if begins:
            self._begin_with(due, present.now)
        else:
            self.rounds += 1
            self._note_met(due)
        square = a.square if b is None else max(a.square, b.square)
        one.kind = HIT
        rounds.answer_single(present, one)
        if len(self.met) > 2:
            present.recorder.order_unknown(present.now)
        rounds.kick(present, one)
        rounds.tell(present, one)
        square = max(square, a.square if b is None else max(a.square, b.square))
        self._send_off(present, one, max(NOISE * math.sqrt(square), noise))
        persistence.go_after_lone(present, one)
        return True

    def _send_off(self, present: Present, one: Contact, noise: float) -> None:
        """Give the balls of a lone hit their new paths; ``noise`` (m/s) may be rounding."""
        a, b, rolls = one.a, one.b, present.table.surface.rolls
        roll = rounds.roll_after(present, [one], a) if rolls else (0.0, 0.0)
        present.begin(a.ball, (a.x, a.y), (a.vx, a.vy), roll, noise)
        if b is not None:
            roll = present.roll_of(b.ball) if rolls else (0.0, 0.0)
            present.begin(b.ball, (b.x, b.y), (b.vx, b.vy), roll, noise)

    # -- rounds ------------------------------------------------------------------------------------

    def _is_over(self, present: Present, fastest: Ball) -> bool:
        """Tell whether another instant has begun."""
        path = fastest.path
        return present.now - self.began > present.instant_at(fastest, path.x, path.y)

    def _note_met(self, due: Due) -> None:
        """Note what has met at this instant, once."""
        if is_new(due, self.met):
            self.met.append(due)

    def _answer_several(self, present: Present, persistence: Persistence, dues: list[Due]) -> None:
        """Answer a round of contacts of this instant, or after many rounds all that touches."""
        fastest = dues[0].a
        for due in dues:
            for ball in due.balls:
                if ball.speed > fastest.speed:
                    fastest = ball
        if self._is_over(present, fastest):
            self._begin()
            self.began = present.now
        self.rounds += 1
        has_many = self.rounds > FEW_ROUNDS
        for due in dues:
            self._note_met(due)
        discs: list[Disc] = []
        contacts = read(present, dues, discs)
        if len(contacts) > 1 or len(self.met) > 2:
            present.recorder.order_unknown(present.now)
        missed: list[Contact] = []
        if has_many:
            contacts = self._answer_cluster(present, persistence, contacts, discs, missed)
        else:
            rounds.resolve(present, contacts, discs, missed)
        self.changed = [each.ball for each in discs if each.changed]
        for one in missed:
            if not (has_many and any(each.changed for each in one.discs)):
                self.missed.append(one)
        persistence.go_after(present, contacts, self.changed)

    def _answer_cluster(
        self, present: Present, persistence: Persistence, first: list[Contact], discs: list[Disc],
        missed: list[Contact],
    ) -> list[Contact]:  # fmt: skip
        """Answer all that touches here, round after round, until nothing closes; return it.

        The contacts that are read already come first.
        """
        dues = present.touching(self.met, [])
        contacts = read(present, dues, discs)
        find_gaps(present, contacts)
        turn = [one for one in contacts if any(other.is_same(one) for other in first)]
        hits = 0
        while len(turn) > 0 and present.may_go_on:
            if hits > LISTED and rounds.loses_speed(present.law, contacts):  # They may have no end.
                self.collapses += 1 if len(contacts) > 2 else 0
                rounds.play_out(present, contacts, discs, self.collapses)
                break
            if any(present.squeezes.is_squeezed(each.ball) for each in discs):
                rounds.press_together(present, contacts, discs)
                break
            hits += rounds.resolve(present, turn, discs, missed)
            turn = next_round(present, contacts, discs)
            if persistence.takes_over(present, turn, len(contacts)):
                break
        self._begin()
        return contacts


# -- contacts --------------------------------------------------------------------------------------


def read(present: Present, dues: list[Due], discs: list[Disc]) -> list[Contact]:
    """Read contacts, and their balls; where two cushions lie on one line, they are one."""
    found: list[Contact] = []
    for due in dues:
        a = disc_of(present, discs, due.a)
        b = None if due.b is None else disc_of(present, discs, due.b)
        one = present.contact(a, b, due.wall)
        if b is not None or not any(one.is_same(other) for other in found):
            found.append(one)
    return found


def disc_of(present: Present, discs: list[Disc], ball: Ball) -> Disc:
    """Return the disc of a ball; put a new one among the others by its number."""
    k = len(discs)
    while k > 0 and discs[k - 1].ball.number >= ball.number:
        k -= 1
        if discs[k].ball is ball:
            return discs[k]
    disc = present.disc(ball)
    discs.insert(k, disc)
    return disc


def find_gaps(present: Present, contacts: list[Contact]) -> None:
    """Find the gaps (m) of contacts, which are 0 where rounding hides them."""
    for one in contacts:
        a, b = one.a, one.b
        gap = present.gap(Due(present.now, HIT, a.ball, None if b is None else b.ball, one.wall))
        size = abs(a.x) + abs(a.y) + a.ball.radius
        one.gap = max(gap if gap > 2.0 * EPSILON * size else 0.0, 0.0)


def next_round(present: Present, contacts: list[Contact], discs: list[Disc]) -> list[Contact]:
    """Go on to the contacts of the cluster that hit next."""
    noise = 0.0
    for each in discs:
        noise = max(noise, each.ball.noise)
    if all(each.moved == MISSED for each in discs):
        return []
    squeezes = present.squeezes
    if squeezes.is_idle:
        return go_on(contacts, noise)
    for one in contacts:
        if any(squeezes.is_squeezed(each.ball) for each in one.discs):
            one.pair = one.pair.with_restitution(0.0)
    return go_on([one for one in contacts if not is_jammed(present, one)], noise)


def is_jammed(present: Present, one: Contact) -> bool:
    """Tell whether a wall goes through the ball of a contact."""
    wall = one.wall
    return wall is not None and wall.moves and present.squeezes.goes_through(one.a.ball, wall)
