"""Groups of balls in persistent contact move in pieces, by the forces that keep their gaps closed.

Each ball of a group gets two short paths for a piece. What ends the piece is due like the end of
any path: a force, a slip or a speed falls to zero, or a side ends. A hit on a ball of a group takes
the group apart; what presses after it is a group again. Groups are in
:mod:`pool_pymunk.engine.groups`.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import asked, groups
from pool_pymunk.engine.groups import NONE
from pool_pymunk.engine.persisting import persists_now, stays, wait
from pool_pymunk.physics import pieces
from pool_pymunk.physics.complementarity import guess, set_scale
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.pressed import (
    LET_GO,
    REST,
    ROLL,
    STUCK,
    find_units,
    look,
    opening,
    set_time,
)

# s; the first piece of a mode is no longer. Where a contact has just opened it is shorter, because
# the gap is still narrower than pieces deviate.
FIRST, OPENED = 5e-5, 1e-6
# After this many changes of the mode at one instant, or groups that begin at it for each ball, a
# group has no forces for a moment.
MOST_CHANGES = 50


def begin_at(w: Any, sides: Any, i: int) -> None:
    """Let the contacts around ball ``i`` press that persist from now on."""
    r = w.groups
    end_waits(w)
    asked.find_touching(w, sides, i)
    kept = 0
    for k in range(r.hits):
        one, other = r.hit[k][0], r.hit[k][1]
        if stays(w, sides, one, other):
            r.hit[kept][0], r.hit[kept][1] = one, other
            kept += 1
    r.hits = kept
    for k in range(kept):
        for b in (r.hit[k][0], r.hit[k][1]):
            if b >= 0:
                release(w, b, 0.0)
    r.begun = r.begun + 1 if r.begun_t == w.now else 1
    r.begun_t = w.now
    if kept > 0 and asked.has_room(w, 2 * kept, kept):
        gather(w, sides)
        if r.begun > MOST_CHANGES * w.press.balls:
            wait_all(w)
        else:
            join_sides(w)
            guess(w.press, w.press.state)
            pieces.close(w.press, w.press.state)
            for k in range(w.press.contacts):
                w.press.was_on[k] = 0
            decide_mode(w, 0, w.now, FIRST)
            play_pieces(w)
            wait_for_others(w, sides, kept)
    asked.predict_loose(w, sides)


def wait_for_others(w: Any, sides: Any, kept: int) -> None:
    """Look again in a moment at balls that have no force, though their walls press them on.

    Such a ball moves on beyond the end of a side, and then touches the next side of the same wall.
    """
    r = w.groups
    for k in range(kept):
        i, other = r.hit[k][0], r.hit[k][1]
        if other < 0 and r.leader[i] == NONE and persists_now(w, sides, i, other):
            wait(w, i, other)


def end_waits(w: Any) -> None:
    """Predict the hits of contacts again whose wait is over."""
    r = w.groups
    for m in range(r.waits):
        if r.until[m] <= w.now and r.until[m] > -math.inf:
            r.ended[m], r.until[m] = r.until[m], -math.inf
            for b in (r.wait[m][0], r.wait[m][1]):
                if b >= 0:
                    groups.loosen(r, b)


def gather(w: Any, sides: Any) -> None:
    """Put the balls and contacts of a new group into the press."""
    g, r = w.press, w.groups
    g.balls = g.contacts = 0
    for k in range(r.hits):
        for b in (r.hit[k][0], r.hit[k][1]):
            if b >= 0:
                insert(g, b)
    for m in range(g.balls):
        i, s, p = g.ball[m], g.state, 6 * m
        groups.put_ball(w, m, i, 0, 0)
        s[p], s[p + 1], s[p + 2], s[p + 3] = asked.motion(w, i)
        s[p + 4], s[p + 5] = asked.roll_of(w, i)
    for k in range(r.hits):
        i, other = r.hit[k][0], r.hit[k][1]
        _, mu = asked.coefficients(w, sides, i, other)
        groups.put_contact(w, k, i, other)
        g.mu[k], g.what[k] = mu, asked.read_shape(w, sides, i, other, g.edge[k])
        asked.read_drift(w, sides, other, g.drift[k])
        g.on[k], g.over[k], g.slides[k], g.into[k] = 1, 0, 0, 0
    set_time(g, w.now)
    g.contacts, g.small[2] = r.hits, r.coarser
    find_units(g)
    pieces.clear_total(g)
    set_scale(g, g.state)


def insert(g: Any, i: int) -> None:
    """Put a ball among those of the press, which are in the order of their numbers, once."""
    m = g.balls
    for n in range(g.balls):
        if g.ball[n] == i:
            return
    while m > 0 and g.ball[m - 1] > i:
        g.ball[m] = g.ball[m - 1]
        m -= 1
    g.ball[m] = i
    g.balls += 1


def join_sides(w: Any) -> None:
    """Take away the speeds at which the sides of a new group part or close."""
    g, r, noise, fastest = w.press, w.groups, 0.0, 0.0
    for m in range(g.balls):
        noise = max(noise, asked.noise_of(w, g.ball[m]))
    for k in range(g.contacts):
        fastest = max(fastest, abs(opening(g, g.state, k)))
    if fastest > noise:
        pieces.join(g, g.state, noise)
        for m in range(g.balls):  # All of them leave their paths.
            groups.set_leader(r, g.ball[m], g.ball[0])


def release(w: Any, i: int, gap: float) -> bool:
    """Take the group of a ball apart, at the present time; tell whether there was one.

    A variant opens the gaps (m) of a group that is hit: their order is unknown then.
    """
    r, leader = w.groups, w.groups.leader[i]
    if leader == NONE:
        return False
    cut(w, leader)
    if gap != 0.0:
        open_gaps(w.press, gap)
    for m in range(w.press.balls):
        let_go(w, m)
    groups.free_contacts(r, leader)
    return True


def open_gaps(g: Any, gap: float) -> None:
    """Move the balls of a press away from a wall that one of them touches, or from each other."""
    x = y = 0.0
    for m in range(g.balls):
        x, y = x + g.state[6 * m] / g.balls, y + g.state[6 * m + 1] / g.balls
    look(g, g.state)
    for k in range(g.contacts - 1, -1, -1):
        if g.other[k] < 0:
            p, r = 6 * g.one[k], g.radius[g.one[k]]
            x, y = g.state[p] - r * g.normal[k][0], g.state[p + 1] - r * g.normal[k][1]
    least = math.inf
    for m in range(g.balls):
        least = min(least, g.radius[m])
    share = gap / (2.0 * least)
    for m in range(g.balls):
        g.state[6 * m] += share * (g.state[6 * m] - x)
        g.state[6 * m + 1] += share * (g.state[6 * m + 1] - y)


def let_go(w: Any, m: int) -> None:
    """Let ball ``m`` of the press go on by itself."""
    s, p, i = w.press.state, 6 * m, w.press.ball[m]
    groups.set_leader(w.groups, i, NONE)
    path = asked.path_from(w, i, (s[p], s[p + 1]), (s[p + 2], s[p + 3]), (s[p + 4], s[p + 5]))
    if asked.moves_on(path):
        asked.lead(w, i, path)
        groups.loosen(w.groups, i)
    else:
        rest(w, m)


def rest(w: Any, m: int) -> None:
    """Let ball ``m`` of the press rest, if it has moved."""
    s = w.press.state
    if asked.begins_to_rest(w, w.press.ball[m], s[6 * m], s[6 * m + 1]):
        groups.loosen(w.groups, w.press.ball[m])


def wait_all(w: Any) -> None:
    """Let no contact of the press have a force for a moment."""
    for k in range(w.press.contacts):
        wait_at(w, k)


def wait_at(w: Any, k: int) -> None:
    """Let a contact of the press have no force for a moment."""
    wait(w, w.press.ball[w.press.one[k]], w.press.place[k])


def cut(w: Any, leader: int) -> None:
    """Put a group into the press as it is now, and note its impulses until now."""
    groups.find_state(w, leader, w.now)
    g = w.press  # that of this group now
    for p in range(6 * g.balls):
        g.state[p] = g.end[p]
    set_time(g, w.now)
    note_impulses(w, w.groups.began[leader])


def note_impulses(w: Any, began: float) -> None:
    """Note the impulses of the press's contacts, of a piece that ``began`` at a time (s)."""
    g = w.press
    for k in range(g.contacts):
        much, x, y = g.total[k][0], g.total[k][1], g.total[k][2]
        if g.on[k] or much != 0.0:
            asked.note_impulse(w, g.ball[g.one[k]], g.place[k], began, (x, y))
    pieces.clear_total(g)


def go_on(w: Any, sides: Any, i: int) -> None:
    """Go on at the end of a half of a piece, or of the piece."""
    r, leader = w.groups, w.groups.leader[i]
    if leader == NONE:  # A ball at rest has kept its path.
        return
    end = r.began[leader] + r.span[leader]
    if w.now == asked.path_of(w, i).end < end:
        groups.load(w, leader)
        load_end(w)
        set_out(w, leader, 1)
    else:
        is_cut = w.now < end
        cut(w, leader)
        r.todos = 0
        goes_on = r.fell[leader] < 0 and not r.faded[leader]
        if is_cut:
            keep_start(w, leader, r.span[leader])
        elif not goes_on or any_is(w.press, STUCK):
            unstick(w.press)
            turn(w, leader, r.after[leader] if goes_on else FIRST)
        elif hold_creeping(w.press):
            r.held_for[leader] = pieces.GROWTH * max(r.held_for[leader], r.span[leader])
            turn(w, leader, r.held_for[leader])
        else:
            r.held_for[leader] = 0.0
            keep_start(w, leader, r.after[leader])
        play_pieces(w)
    asked.predict_loose(w, sides)


def cross(w: Any, i: int, patch: int) -> None:
    """Let ball ``i`` of a group cross into another patch; the group goes on in a mode that fits.

    What would have ended its piece later has not come yet.
    """
    r, leader = w.groups, w.groups.leader[i]
    cut(w, leader)
    asked.enter(w, i, patch)
    g, m = w.press, r.local[i]
    g.pull[m], g.drag[m] = asked.pull_and_drag(w, i)
    set_scale(g, g.state)
    r.todos, r.fell[leader], r.faded[leader] = 0, NONE, 0
    unstick(g)
    turn(w, leader, FIRST)
    play_pieces(w)


def load_end(w: Any) -> None:
    """Put the end of the piece of the group in the press into it, and the first rates."""
    g = w.press
    for m in range(g.balls):
        for p in range(6):
            g.end[6 * m + p] = w.groups.end[g.ball[m]][p]


def hold_creeping(g: Any) -> bool:
    """Let balls rest or roll for a piece that were let go and creep; tell whether there are any.

    The direction of a slip or a speed that stays so low turns fast: many short pieces would follow.
    """
    s, found = g.state, False
    for m in range(g.balls):
        if g.stuck[m] == LET_GO and g.phase[m] != REST and pieces.creeps(g, s, m):
            pieces.hold(g, s, m)
            found = True
    if found:
        pieces.close(g, s)
    return found


def any_is(g: Any, what: int) -> bool:
    """Tell whether a ball of the press is stuck, or was let go just now."""
    found = False
    for m in range(g.balls):
        found |= g.stuck[m] == what
    return found


def unstick(g: Any) -> None:
    """Let no ball of the press be stuck any more."""
    for m in range(g.balls):
        g.stuck[m] = LET_GO if g.stuck[m] == LET_GO else 0


def keep_start(w: Any, leader: int, longest: float) -> None:
    """Let the group in the press, whose mode goes on, have its next piece from now on."""
    g, r = w.press, w.groups
    for m in range(g.balls):
        for p in range(6):
            r.state[g.ball[m]][p] = g.state[6 * m + p]
    r.began[leader], r.longest[leader] = w.now, longest
    r.todo[r.todos] = leader
    r.todos += 1


def play_pieces(w: Any) -> None:
    """Play the next pieces of the groups that wait for them; their modes may change at once."""
    r = w.groups
    while r.todos > 0:
        r.todos -= 1
        leader = r.todo[r.todos]
        groups.load(w, leader)
        piece = asked.find_piece(w, r.longest[leader])
        keep_piece(w, leader, piece)
        if piece.time == 0.0:
            r.changes[leader] += 1
            turn(w, leader, r.longest[leader] if any_is(w.press, LET_GO) else FIRST)
        else:
            r.changes[leader] = 0
            set_out(w, leader, 0)


def keep_piece(w: Any, leader: int, piece: pieces.Piece) -> None:
    """Keep the piece of the group in the press."""
    g, r = w.press, w.groups
    r.span[leader], r.after[leader], r.fell[leader], r.faded[leader] = piece
    r.steps[leader] = g.steps
    for m in range(g.balls):
        i = g.ball[m]
        if r.stuck[i] == LET_GO and piece.time > 0.0 and not pieces.creeps(g, g.end, m):
            r.stuck[i] = 0
        for p in range(6):
            r.end[i][p] = g.end[6 * m + p]
    k, c = 0, r.contact[leader]
    while c != NONE:
        for n in range(3):
            r.total[c][n] = g.total[k][n]
        k, c = k + 1, r.following[c]


def turn(w: Any, leader: int, longest: float) -> None:
    """Change the mode of the group in the press at the end of its piece.

    The next piece is not longer than a time (s).
    """
    g, r = w.press, w.groups
    set_time(g, w.now)
    if r.faded[leader]:
        pieces.settle(g, g.state)
        for m in range(g.balls):
            if g.phase[m] == ROLL != r.phase[g.ball[m]]:
                asked.begins_to_roll(w, g.ball[m], w.now)
    for k in range(g.contacts):
        g.was_on[k] = g.on[k]
    fell = r.fell[leader]
    if fell >= 0:
        pieces.change(g, g.state, fell)
        if r.span[leader] == 0.0 and fell < 4 * g.contacts and fell % 4 == 0:
            wait_at(w, fell // 4)
    changes = r.changes[leader]
    groups.free_contacts(r, leader)
    decide_mode(w, changes, w.now, longest)


def decide_mode(w: Any, changes: int, began: float, longest: float) -> None:
    """Go on with the press in a mode that fits, or without forces for a moment if there is none."""
    g = w.press
    if changes <= MOST_CHANGES and asked.finds_forces(w):
        note_impulses(w, began)
        lost = 0
        for k in range(g.contacts):
            lost += g.was_on[k] - g.on[k]
            if changes > 0 and g.was_on[k] > g.on[k]:  # It may come back at once.
                wait_at(w, k)
        split(w, OPENED if lost > 0 else longest, changes)
        return
    pieces.join(g, g.state, 0.0)
    note_impulses(w, began)
    wait_all(w)
    for m in range(g.balls):
        let_go(w, m)


def split(w: Any, longest: float, changes: int) -> None:
    """Go on with the balls that contacts press together, and let go of the others."""
    g, r = w.press, w.groups
    for m in range(g.balls):
        if g.phase[m] == REST:
            rest(w, m)
    find_parts(w)
    for m in range(g.balls):
        if r.leader[g.ball[m]] != NONE and not r.joined[m]:
            let_go(w, m)
    for m in range(g.balls - 1, -1, -1):  # The first part is played first.
        if r.joined[m] and r.first[m] == m:
            store(w, m)
            leader = g.ball[m]
            r.changes[leader], r.began[leader], r.longest[leader] = changes, w.now, longest
            r.todo[r.todos] = leader
            r.todos += 1


def find_parts(w: Any) -> None:
    """Find which balls of the press contacts join, and the ``first`` ball of each part.

    A part in which no ball moves is none: all of it rests.
    """
    g, r = w.press, w.groups
    for m in range(g.balls):
        r.first[m], r.joined[m] = m, 0
    for _ in range(g.balls):
        for k in range(g.contacts):
            i, j = g.one[k], g.other[k] if g.other[k] >= 0 else g.one[k]
            if g.on[k] and (pieces.moves(g, k) or STUCK in (g.stuck[i], g.stuck[j])):
                r.first[i] = r.first[j] = min(r.first[i], r.first[j])
                r.joined[i] = r.joined[j] = 1
    for m in range(g.balls):
        if r.joined[m] and g.phase[m] != REST:
            r.joined[r.first[m]] = 2
    for m in range(g.balls - 1, -1, -1):  # The first ball of a part tells whether one moves.
        r.joined[m] = r.joined[r.first[m]] // 2


def store(w: Any, root: int) -> None:
    """Keep the part of the press that has the ball ``root`` first."""
    g, r = w.press, w.groups
    leader, last, count = g.ball[root], NONE, 0
    for m in range(root, g.balls):
        if r.first[m] != root:
            continue
        i = g.ball[m]
        groups.set_leader(r, i, leader)
        r.phase[i], r.stuck[i], r.next[i] = g.phase[m], g.stuck[m], NONE
        for p in range(6):
            r.state[i][p] = g.state[6 * m + p]
        if last != NONE:
            r.next[last] = i
        last, count = i, count + 1
    r.balls_of[leader], r.contacts_of[leader], r.contact[leader] = count, 0, NONE
    for n in range(3):
        r.small[leader][n] = g.small[n]
    for k in range(g.contacts - 1, -1, -1):  # The list is built from its end.
        is_in = r.first[g.one[k]] == root
        if is_in and (g.other[k] < 0 or r.first[g.other[k]] == root):
            store_contact(w, k, leader)


def store_contact(w: Any, k: int, leader: int) -> None:
    """Keep contact ``k`` of the press, before the other ones of its group."""
    g, r = w.press, w.groups
    c = r.free
    if c != NONE:
        r.free = r.following[c]
    else:
        c = asked.next_place(w)
    r.following[c], r.contact[leader] = r.contact[leader], c
    r.contacts_of[leader] += 1
    r.one[c], r.other[c], r.what[c], r.mu[c] = g.ball[g.one[k]], g.place[k], g.what[k], g.mu[k]
    r.on[c], r.over[c], r.slides[c], r.into[c] = g.on[k], g.over[k], g.slides[k], g.into[k]
    for n in range(8):
        r.edge[c][n] = g.edge[k][n]
    for n in range(6):
        r.drift[c][n] = g.drift[k][n]


def set_out(w: Any, leader: int, is_second: int) -> None:
    """Put the balls of the group in the press on the paths of a half of its piece."""
    g, r, first = w.press, w.groups, NONE
    began, span = r.began[leader], r.span[leader]
    for m in range(g.balls):
        if g.phase[m] != REST:
            i = g.ball[m]
            asked.lead(w, i, half_of(g, m, (began, span), is_second))
            groups.loosen(r, i)
            first = i if first == NONE else first
    asked.count_unlisted(w)
    asked.push_piece(w, first, asked.path_of(w, first).end)


def half_of(g: Any, m: int, when: tuple[float, float], is_second: int) -> Path:
    """Return the path of ball ``m`` of the press in a half of its piece.

    ``when`` tells when (s) the piece began, and its length (s).
    """
    (began, h), s, end, p = when, g.state, g.end, 6 * m
    middle = h / 2.0
    x, y, vx, vy, wx, wy = s[p], s[p + 1], s[p + 2], s[p + 3], s[p + 4], s[p + 5]
    if pieces.is_even(g, h):
        ax, ay = (end[p + 2] - vx) / h, (end[p + 3] - vy) / h
        return Path(began, x, y, vx, vy, ax, ay, began + h, False, wx, wy)
    (ax, ay), (bx, by) = pieces.halves(g, h, m)
    if not is_second:
        return Path(began, x, y, vx, vy, ax, ay, began + middle, False, wx, wy)
    x, y = x + middle * (vx + middle * ax / 2.0), y + middle * (vy + middle * ay / 2.0)
    vx, vy = vx + middle * ax, vy + middle * ay
    if g.phase[m] == ROLL:
        wx, wy = vx, vy
    else:
        wx, wy = (wx + end[p + 4]) / 2.0, (wy + end[p + 5]) / 2.0
    return Path(began + middle, x, y, vx, vy, bx, by, began + h, False, wx, wy)
