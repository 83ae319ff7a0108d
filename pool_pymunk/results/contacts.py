"""A run tells what each contact did: where, which impulses, velocities before and after, energy.

All of it is worked out from the run's events and breakpoints, once somebody asks for it. Contacts
of one instant are worked out one after another, as the events list them.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.laws.contact import split
from pool_pymunk.model import Point, Units
from pool_pymunk.results.events import IMPULSES, Event, two
from pool_pymunk.results.table import Columns, ResultTable, alike, numbers
from pool_pymunk.results.trace import NONE, path_of

if TYPE_CHECKING:
    from pool_pymunk.results.run import Run

# Velocities that differ by less than this share of the fastest one differ by rounding: some
# thousand slices leave 1e-12 of it, and of what a law does to a slip nothing is so small.
ROUNDING = 1e-9

SMALL = 0.1  # N s and J; smaller impulses and energies are printed in mN s and mJ
Numbered = Sequence[tuple[int, "ContactRow"]]

STICK, SLIP, PERSISTENT = "stick", "slip", "persistent"


@dataclass(frozen=True, slots=True)
class ContactRow:
    """A row of a run's table of contacts; what cannot be known is None, or empty.

    ``balls`` are the ids of two balls, or of the one that meets the ``cushion`` of this number. At
    the time ``t`` (s) they touch at ``point`` (m). The unit vector ``normal`` points from the first
    ball to the second, or from the cushion to the ball, and the tangent is (-n_y, n_x).

    ``before`` and ``after`` are the velocities (m/s) of the balls. Contacts that a law answers
    together have the velocities before and after all of them. ``impulses`` (N s) are what the
    contact gave to each ball. ``impulse`` J_n and ``tangential`` J_t (N s) are its parts along
    normal and tangent, on the last ball, as in :class:`Event`. ``lost`` (J) is the kinetic energy
    that the contact took, with that of the roll.

    ``kind`` is "stick" if the two sides do not slip on each other after the contact, "slip" if they
    do, and "persistent" if they stay in contact ``until`` a later time (s). A persistent contact
    has its impulse in all this time, but no point, no velocities and no energy: nobody can tell
    what it takes from what the surface takes.

    >>> from pool_pymunk import load, simulate
    >>> [hit] = simulate(load("two-balls"), max_time=0.5).contacts
    >>> hit.balls, hit.kind, round(hit.impulse, 6), round(hit.tangential, 6)
    (('A', 'B'), 'slip', 0.262301, -0.013115)
    """

    t: float
    kind: str | None
    balls: tuple[str, ...]
    cushion: int | None
    until: float | None = None
    point: Point | None = None
    normal: Point | None = None
    before: tuple[Point, ...] = ()
    after: tuple[Point, ...] = ()
    impulses: tuple[Point, ...] = ()
    impulse: float | None = None
    tangential: float | None = None
    tangential_first: float | None = None
    lost: float | None = None


class MovingBall(NamedTuple):
    """A ball has this velocity and this roll (m/s)."""

    velocity: Point
    roll: Point = NONE


class RoundOfHits(NamedTuple):
    """In a round of an instant, ``contacts`` changed how a ball moves; these are all the ball's."""

    before: MovingBall
    after: MovingBall
    contacts: Sequence[Met]


class Met(NamedTuple):
    """Two balls met, or a ball and a cushion; ``impulses`` (N s) are empty if they are unknown."""

    event: Event
    balls: tuple[TrackedBall, ...]
    normal: Point
    point: Point
    impulses: tuple[Point, ...]


class TrackedBall:
    """A ball of a run; it comes to one of the ``contacts`` of an instant after another."""

    def __init__(self, run: Run, number: int) -> None:
        ball, rows = run.scene.balls[number], run.knots[number]
        rows = rows[:-1] if ball.id in run.pocketed else rows  # The last one is in the pocket.
        self.mass, self.radius = ball.mass, ball.radius
        self.rows, self.times = rows.tolist(), rows[:, 0].tolist()
        self.rolls = run._rolls[number].tolist() if run.scene.surface.rolls else []
        self.step_loss = run.scene.surface.pull * (run.dt or 0.0)  # m/s
        self.contacts = defaultdict[float, list[Met]](list)  # by instants
        self.rounds = list[RoundOfHits]()  # of the contacts to come at this instant

    def place(self, t: float) -> Point:
        """Return where it is (m) at an instant (s)."""
        return path_of(self.rows[max(bisect_right(self.times, t) - 1, 0)]).place(t)

    def states(self, t: float) -> list[MovingBall]:
        """Return its motion as it comes to an instant (s), and after each breakpoint in it."""
        first, end = bisect_left(self.times, t), bisect_right(self.times, t)
        return [self._state(k, t) for k in (max(first - 1, 0), *range(max(first, 1), end))]

    def _state(self, k: int, t: float) -> MovingBall:
        """Return its motion at a time (s), from one breakpoint on."""
        velocity = path_of(self.rows[k]).velocity(t)
        if not self.rolls:
            return MovingBall(velocity)
        since, wx, wy, ax, ay, jx, jy = self.rolls[k]
        s = t - since
        return MovingBall(velocity, (wx + s * (ax + s * jx / 2.0), wy + s * (ay + s * jy / 2.0)))

    def take(self, t: float) -> RoundOfHits:
        """Come to the next contact, at an instant (s); return the round in which it is."""
        self.rounds = self.rounds or list(self._rounds(t))
        return self.rounds.pop(0)

    def _rounds(self, t: float) -> Iterator[RoundOfHits]:
        """Yield the round of each contact of an instant (s).

        After a round the impulses up to there explain the velocity that a breakpoint has. A step of
        ``pymunk-discrete`` ends with friction, so there the impulses alone tell the velocity, which
        is known to within ``slack`` (m/s).
        """
        before, *later = self.states(t)
        self.slack = ROUNDING * max(math.hypot(*each.velocity) for each in (before, *later))
        (vx, vy), its = before.velocity, list[Met]()
        for one in self.contacts[t]:
            x, y = one.impulses[one.balls.index(self)]
            vx, vy, its = vx + x / self.mass, vy + y / self.mass, [*its, one]
            for m, after in enumerate(later, start=1):
                if math.dist((vx, vy), after.velocity) <= self.slack:
                    yield from [RoundOfHits(before, after, its)] * len(its)
                    before, later, its = after, later[m:], []
                    break
        if its:
            self.slack += 2.0 * self.step_loss
            after = (before, *later)[-1]._replace(velocity=(vx, vy))
            yield from [RoundOfHits(before, after, its)] * len(its)


def contact_rows(run: Run) -> tuple[ContactRow, ...]:
    """Return the table of a run's contacts, in the order of their times."""
    met = list(_met(run))
    for one in met:
        for ball in one.balls if one.impulses else ():
            ball.contacts[one.event.t].append(one)
    has_its_law = run.law != run.solver  # Else balls spin, and the run does not say how fast.
    rows = [_row(one, has_its_law) for one in met]
    for each in run.persistent:
        x, y = each.impulse
        given = ((-x, -y), (x, y))[2 - len(each.balls) :]
        where = (each.since, PERSISTENT, each.balls, each.cushion, each.until)
        rows.append(ContactRow(*where, impulses=given))
    return tuple(sorted(rows, key=lambda row: row.t))


def _met(run: Run) -> Iterator[Met]:
    """Yield every contact of a run, with its place and its impulses."""
    balls = {ball.id: TrackedBall(run, i) for i, ball in enumerate(run.scene.balls)}
    for event in run.events:
        if not event.is_contact:
            continue
        its = tuple(balls[id_] for id_ in event.balls)
        (x, y), *other = (ball.place(event.t) for ball in its)
        r = its[0].radius
        if event.cushion is not None:
            (nx, ny), far = run.scene.cushions[event.cushion].nearest(x, y, r, 0.0).normal(x, y), -r
        else:
            [(u, v)] = other
            apart = math.hypot(u - x, v - y) or 1.0
            (nx, ny), far = ((u - x) / apart, (v - y) / apart), apart * r / (r + its[1].radius)
        point = x + far * nx, y + far * ny
        yield Met(event, its, (nx, ny), point, _impulses(event, (nx, ny)))


def _impulses(event: Event, normal: Point) -> tuple[Point, ...]:
    """Return what a contact has given to each ball (N s), if the run knows it."""
    if event.impulse is None or event.tangential is None:
        return ()
    n, t, (nx, ny) = event.impulse, event.tangential, normal
    last = n * nx - t * ny, n * ny + t * nx
    if event.cushion is not None:
        return (last,)
    t = -t if event.tangential_first is None else event.tangential_first
    return (-n * nx - t * ny, t * nx - n * ny), last


def _row(one: Met, has_its_law: bool) -> ContactRow:
    """Return a contact's row; what stock pymunk's spin decides is left out."""
    event, kind, lost = one.event, None, None
    its = [ball.take(event.t) for ball in one.balls if one.impulses]
    before = tuple(each.before.velocity for each in its)
    after = tuple(each.after.velocity for each in its)
    if has_its_law and its:
        (x, y), (u, v) = after[-1], (NONE, *after)[-2]
        slack = max(ball.slack for ball in one.balls)
        kind = STICK if abs(split((x - u, y - v), one.normal).t) <= slack else SLIP
        lost = sum(map(_lost, [one] * len(its), one.balls, its, one.impulses))
    return ContactRow(
        event.t, kind, event.balls, event.cushion, None, one.point, one.normal,
        before, after, one.impulses, *event.impulses, lost,
    )  # fmt: skip


def _lost(one: Met, ball: TrackedBall, its: RoundOfHits, impulse: Point) -> float:
    """Return the energy (J) that a contact took from a ball: its impulse times the mean velocity.

    So the contacts of a round share its loss. What cushions take from a roll is shared along their
    normals.
    """
    (before, after, contacts), (jx, jy) = its, impulse
    (vx, vy), (ux, uy) = before.velocity, after.velocity
    lost = -0.5 * (jx * (vx + ux) + jy * (vy + uy))
    walls = [each for each in contacts if each.event.cushion is not None]
    if before.roll == after.roll or one not in walls:
        return lost
    normals, rolls = np.array([each.normal for each in walls]), np.array((before.roll, after.roll))
    shares = np.linalg.lstsq(normals.T, rolls[1] - rolls[0], rcond=None)[0]
    along = float(rolls.mean(axis=0) @ one.normal)
    return lost - ball.mass * GYRATION * float(shares[walls.index(one)]) * along


def contacts_table(run: Run, units: Units) -> ResultTable:
    """Return the contacts; lengths and velocities are in ``units``, and all else is in SI."""
    speeds = [
        f"{who}_v{axis}{when}"
        for who in ("ball", "other") for when in ("", "_after") for axis in "xy"
    ]  # fmt: skip
    columns: Columns = (
        *numbers("s", "t", "until"), "kind", "ball", "other", "cushion",
        *numbers(units.length, "x", "y"), "normal_x", "normal_y", *numbers(units.speed, *speeds),
        *numbers("N s", *IMPULSES, "impulse_x", "impulse_y"), *numbers("J", "lost"),
    )  # fmt: skip
    return ResultTable(columns, [_cells(row, units) for row in run.contacts])


def _cells(row: ContactRow, units: Units) -> list[object]:
    """Return a row of the table."""
    nothing = (None, None)
    point = [units.from_si(x, "length") for x in row.point or ()]
    velocities = (v for both in zip(row.before, row.after, strict=True) for v in both)
    speeds = [units.from_si(x, "speed") for velocity in velocities for x in velocity]
    return [
        row.t, row.until, row.kind, *two(row.balls), row.cushion,
        *(point or nothing), *(row.normal or nothing), *speeds, *[None] * (8 - len(speeds)),
        row.impulse, row.tangential, row.tangential_first,
        *(row.impulses[-1] if row.impulses else nothing), row.lost,
    ]  # fmt: skip


def printed_tables(run: Run) -> Iterator[tuple[str, ResultTable]]:
    """Yield what a terminal shows of a run's contacts in the scene's units, with headings."""
    rows = list(enumerate(run.contacts, start=1))
    hits = [(k, row) for k, row in rows if row.kind != PERSISTENT]
    lasted = [(k, row) for k, row in rows if row.kind == PERSISTENT]
    if hits:
        heading = "Contacts. Impulses are those on the last ball, along normal and tangent"
        heading += "; lost is energy, with that of rolling" * run.scene.surface.rolls
        yield f"{heading}:", _hits(run, hits)
        heading = "Velocities before and after, along x and y, and along normal and tangent:"
        yield heading, _ends(run, hits)
    if lasted:
        yield "Persistent contacts. Impulses are those on the last ball:", _persistent(run, lasted)


def _hits(run: Run, rows: Numbered) -> ResultTable:
    """Return where contacts are, and what they did; small numbers are in mN s and mJ."""
    unit, from_si = run.scene.units.length, run.scene.units.from_si
    pushes, push = _readable([x for _, row in rows for x in (row.impulse, row.tangential)], "N s")
    losses, energy = _readable([row.lost for _, row in rows], "J")
    columns: Columns = (
        "#", *numbers("s", "t", digits=5), "sides", *numbers(unit, "x", "y", digits=4),
        *numbers("°", "normal", digits=4), *numbers(push, "J_n", "J_t", digits=4), "kind",
        *numbers(energy, "lost", digits=4),
    )  # fmt: skip
    cells = []
    for k, row in rows:
        at, (nx, ny) = (from_si(x, "length") for x in row.point or ()), row.normal or (1.0, 0.0)
        angle, j_n, j_t = math.degrees(math.atan2(ny, nx)), next(pushes), next(pushes)
        cells.append((k, row.t, _sides(run, row), *at, angle, j_n, j_t, row.kind, next(losses)))
    return ResultTable(columns, cells)


def _ends(run: Run, rows: Numbered) -> ResultTable:
    """Return how fast the balls were before and after their contacts."""
    unit, from_si = run.scene.units.speed, run.scene.units.from_si
    heads = [f"{axis} {when}" for axis in "xynt" for when in ("before", "after")]
    columns: Columns = ("#", "ball", *numbers(unit, *heads))
    found: list[tuple[int, str]] = []
    speeds: list[float | None] = []
    for k, row in rows:
        for ball, *ends in zip(row.balls, row.before, row.after, strict=False):
            both = [(*v, *split(v, row.normal or (1.0, 0.0))) for v in ends]
            found.append((k, ball))
            speeds += [from_si(v, "speed") for pair in zip(*both, strict=True) for v in pair]
    texts = np.array(alike(speeds, largest=4)).reshape(-1, len(heads)).tolist()
    return ResultTable(columns, [(*who, *its) for who, its in zip(found, texts, strict=True)])


def _persistent(run: Run, rows: Numbered) -> ResultTable:
    """Return how long contacts persisted, and what they gave."""
    times, pushes = numbers("s", "since", "until", digits=5), numbers("N s", "J_x", "J_y", digits=4)
    columns: Columns = ("#", *times, "sides", *pushes)
    return ResultTable(columns, [
        (k, row.t, row.until, _sides(run, row), *row.impulses[-1]) for k, row in rows
    ])  # fmt: skip


def _readable(values: Sequence[float | None], unit: str) -> tuple[Iterator[str], str]:
    """Return numbers in one notation, and their unit, or a thousandth of it if all are small."""
    small = max((abs(x) for x in values if x is not None), default=1.0) < SMALL
    scaled = [1e3 * x if small and x is not None else x for x in values]
    return iter(alike(scaled, largest=4)), f"m{unit}" if small else unit


def _sides(run: Run, row: ContactRow) -> str:
    """Return the two sides of a contact: "C, 1", "C, cushion 2" or "C, post 4"."""
    other = () if row.cushion is None else (run.scene.side_name(row.cushion),)
    return ", ".join((*row.balls, *other))
