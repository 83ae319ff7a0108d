"""A round of contacts is answered by the law, and its balls begin new paths.

- *One round*: the law answers together the contacts that share a ball. A contact that closes only
  because of a hit, as in a row of touching balls, comes in the next round of the same instant.
- *Rounding*: a closing speed of the size of rounding is no hit, and a ball with only such a speed
  after a hit rests.
- *Inelastic collapse*: hits that have no end are played out at one instant.
"""

from __future__ import annotations

import math
from typing import Final

from pool_pymunk.core.contact import impulses
from pool_pymunk.core.contact.collapse import MOST_HITS, Collapse
from pool_pymunk.core.contact.contact import (
    COLLAPSED,
    HIT,
    LED,
    MISSED,
    Contact,
    Disc,
    Pair,
    groups,
)
from pool_pymunk.core.contact.impulses import NotedHits
from pool_pymunk.core.contact.laws import Coulomb, HitsByLaw, Law
from pool_pymunk.core.contact.together import Hits, at_once
from pool_pymunk.core.motion.path import NOISE
from pool_pymunk.core.motion.surface import Push
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.present import Present
from pool_pymunk.core.squeeze import have_no_room, usual_speed
from pool_pymunk.core.variant import NO_SLIP

# After this many collapses of more than two contacts, balls are a pile, in which at most this many
# hits of a collapse are played: both bound the time that a run takes.
PILE: Final = 20
MOST_IN_PILE: Final = 200


def resolve(
    present: Present, contacts: list[Contact], discs: list[Disc], missed: list[Contact]
) -> int:
    """Answer the contacts of a round, and return how many were hits.

    ``discs`` are the balls of the instant. Balls that touch, but do not close, are ``missed``.
    """
    begin_round(contacts, discs)
    hitting: list[Contact] = []
    for one in contacts:
        one.kind = HIT if one.closing > one.noise else MISSED
        if one.kind == HIT:
            hitting.append(one)
    for group in groups(hitting):
        if len(group) == 1:
            answer_single(present, group[0])
        else:
            answer_group(present, group)
    for one in hitting:
        kick(present, one)
    leave_out(contacts, missed)
    report(present, contacts, len(hitting) > 0)
    carry_out(present, contacts, discs)
    return len(hitting)


def begin_round(contacts: list[Contact], discs: list[Disc]) -> None:
    """Note which balls take part in a round, and how fast they are before it."""
    for each in discs:
        each.moved = MISSED
        each.plays = False
    for one in contacts:
        one.jumped = False
        for each in one.discs:
            each.plays = True
            each.before_x, each.before_y = each.vx, each.vy


def answer_single(present: Present, one: Contact) -> None:
    """Answer a hit that shares no ball with another one."""
    a, b = one.a, one.b
    ax, ay, bx, by = a.vx, a.vy, 0.0, 0.0
    if b is not None:
        bx, by = b.vx, b.vy
    one.jumped = present.law.respond(one, present.errors.slip) or one.jumped
    one.measure(ax, ay, bx, by)


def answer_group(present: Present, group: list[Contact]) -> None:
    """Answer hits that share balls, and find their impulses."""
    hits = NotedHits(present.law, present.errors.slip)
    if not answer_together(present, group, hits):
        impulses.explain(group)


def answer_together(present: Present, group: list[Contact], hits: Hits) -> bool:
    """Answer hits that share balls; tell whether their impulses are noted."""
    law, usual = present.law, usual_speed(group)
    impulses.begin(group)
    is_noted = law.together(group, hits)
    if law.solves_at_once and have_no_room(group, usual, is_noted):
        answer_without_movers(present, group)
        return True
    return is_noted


def answer_without_movers(present: Present, group: list[Contact]) -> None:
    """Answer hits anew without their walls that move, which go through their balls."""
    standing: list[Contact] = []
    for one in group:
        for each in one.discs:
            each.vx, each.vy = each.start_x, each.start_y
        one.normal = one.along = one.along_first = 0.0
        if not one.drifts:
            standing.append(one)
        elif one.wall is not None and one.wall.moves:
            present.jam(one.a.ball, one.wall)
    if len(standing) > 0:
        present.law.together(standing, HitsByLaw(present.law, NO_SLIP))
    for one in standing:
        one.normal = one.along = one.along_first = 0.0


def kick(present: Present, one: Contact) -> None:
    """Let the wall of a hit kick its ball, after the law's answer.

    The kick is an impulse along the normal, without friction, which slows no roll.
    """
    if one.kick != 0.0 and one.wall is not None:
        is_new = present.is_first(present.squeezes.kicked, one.a.ball, one.wall)
        one.kicked = one.kick if is_new else 0.0
        one.a.change(one.kicked, 0.0, one.nx, one.ny)


def leave_out(contacts: list[Contact], missed: list[Contact]) -> None:
    """Lead balls along their cushions that were not hit, and note balls that only touch."""
    for one in contacts:
        if one.kind != MISSED:
            for each in one.discs:
                each.moved = HIT
    for one in contacts:
        if one.kind != MISSED or one.a.moved == HIT:
            continue
        if one.b is None:
            vx, vy = one.a.vx, one.a.vy
            one.a.change(one.closing, 0.0, one.nx, one.ny)
            one.a.moved = one.kind = LED
            one.measure(vx, vy, 0.0, 0.0)
        elif one.b.moved != HIT:
            missed.append(one)


def report(present: Present, contacts: list[Contact], is_listed: bool) -> None:
    """Tell of the hits of a round, and count a round without one."""
    for one in contacts:
        if one.kind == HIT:
            tell(present, one)
    if not is_listed:
        present.idle += 1
    for one in contacts:
        if one.jumped:
            present.recorder.zero_slip(one, present.now)


def tell(present: Present, one: Contact) -> None:
    """Tell of a hit, with its impulses; the kick of a wall is part of that along the normal."""
    present.events += 1
    wall, slows = one.wall, one.normal
    if wall is not None:
        one.normal += one.pair.m_a * one.kicked
        if wall.moves and present.squeezes.strike(one.a.ball, wall):
            present.jam(one.a.ball, wall)
    present.recorder.contact(one, present.now)
    one.normal = slows  # What slows a roll is the law's impulse.


def carry_out(present: Present, contacts: list[Contact], discs: list[Disc]) -> None:
    """Give the balls their new paths, or put them to rest."""
    fastest, noise = 0.0, 0.0  # the square of a speed, and a speed
    for each in discs:
        if each.plays:
            before = each.before_x * each.before_x + each.before_y * each.before_y
            fastest = max(fastest, max(each.square, before))
            noise = max(noise, each.ball.noise)
    noise = max(NOISE * math.sqrt(fastest), noise)
    for each in discs:
        if each.moved != MISSED:
            roll = roll_after(present, contacts, each)
            present.begin(each.ball, (each.x, each.y), (each.vx, each.vy), roll, noise)
            each.vx, each.vy = each.ball.path.vx, each.ball.path.vy
            each.changed = True


def roll_after(present: Present, contacts: list[Contact], disc: Disc) -> Vector:
    """Return the roll (m/s) of a ball after the cushions of a round have slowed it."""
    surface = present.table.surface
    if not surface.rolls:
        return 0.0, 0.0
    pushes: list[Push] = []
    for one in contacts:
        if one.a is disc and one.b is None and one.kind != MISSED:
            pushes.append((one.nx, one.ny, one.pair.friction * one.normal / one.pair.m_a))
    return surface.roll_after(disc.ball.path, present.now, pushes)


# -- collapse --------------------------------------------------------------------------------------


def loses_speed(law: Law, contacts: list[Contact]) -> bool:
    """Tell whether any contact of a cluster loses speed when it closes head-on at 1 m/s.

    None does while a wall moves into a ball: its hits end when the ball is jammed.
    """
    if any(one.drifts for one in contacts):
        return False
    for one in contacts:
        a, b, pair = (0.0, 0.0), (-1.0, 0.0), one.pair
        if one.b is None:
            b = law.cushion(b, pair.restitution, pair.friction)
        else:
            a, b = law.ball_ball((1.0, 0.0), a, pair)
        if b[0] - a[0] < 1.0 - NOISE:
            return True
    return False


def play_out(present: Present, contacts: list[Contact], discs: list[Disc], collapses: int) -> None:
    """Answer the hits of a collapse, at one instant, until closing speeds are rounding.

    So many collapses of more than two contacts there were.
    """
    begin_round(contacts, discs)
    most = MOST_IN_PILE if collapses > PILE else MOST_HITS
    can_leap = present.law.is_coulomb and not any(one.drifts for one in contacts)
    collapse = Collapse(contacts, present.errors.left_out, can_leap, most)
    hits = HitsByLaw(present.law, present.errors.slip)
    while True:
        hitting = collapse.next_hits()
        if len(hitting) == 0:
            break
        for group in groups(hitting):  # Nobody asks for their impulses.
            if len(group) == 1:
                hits.answer(group[0])
            else:
                answer_together(present, group, hits)
    settle(present, contacts)  # Mostly this changes rounding only.
    present.recorder.collapse(contacts, collapse.played, collapse.is_over, present.now)
    end_collapse(present, contacts, discs)


def press_together(present: Present, contacts: list[Contact], discs: list[Disc]) -> None:
    """Answer all contacts of a cluster by one plastic hit, because a wall squeezes its balls."""
    begin_round(contacts, discs)
    settle(present, contacts)
    end_collapse(present, contacts, discs)


def settle(present: Present, contacts: list[Contact]) -> None:
    """Give an inelastic collapse its limit: a plastic hit (e = 0) without friction.

    Its impulses are those of the whole collapse.
    """
    for group in groups(contacts):
        pairs = [one.pair for one in group]
        for one in group:
            one.pair = Pair(one.pair.m_a, one.pair.m_b, 0.0, 0.0)
        has_room = settle_group(present, group)
        for one, pair in zip(group, pairs):
            one.pair = pair
        if has_room:
            impulses.begin_before(group)
            impulses.explain(group)


def settle_group(present: Present, group: list[Contact]) -> bool:
    """Answer plastic hits that share balls; tell whether walls that move leave them room."""
    usual = usual_speed(group)
    impulses.begin(group)
    is_known = at_once(group)
    if have_no_room(group, usual, is_known):
        answer_without_movers(present, group)
        return False
    if not is_known:
        law = Coulomb()
        law.together(group, HitsByLaw(law, NO_SLIP))
    return True


def end_collapse(present: Present, contacts: list[Contact], discs: list[Disc]) -> None:
    """Tell what the hits of a collapse have changed, and let their balls go on."""
    for one in contacts:
        one.kind = COLLAPSED
    for each in discs:
        each.moved = COLLAPSED
    report(present, contacts, False)
    carry_out(present, contacts, discs)
