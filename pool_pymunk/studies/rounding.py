"""This module works out how far rounding may have moved the ends of an exact run.

Every path and every contact makes errors of a few units of rounding: of the place, of the time of
the contact, of the normal, of the new velocities. The saltation matrices of
:mod:`pool_pymunk.physics.saltation` carry them through the run, in ``COLUMNS`` draws of random
signs. The matrices do not depend on the errors, so those of many events are worked out at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.engine.policies import SURE
from pool_pymunk.model import SettingError
from pool_pymunk.physics.contact import NT
from pool_pymunk.physics.motion import EPSILON, Array, free_motions
from pool_pymunk.physics.saltation import AGREE, Geometry, most_of_roll, slowed_roll
from pool_pymunk.physics.surface import roll_rates, rolls_of
from pool_pymunk.results.run import Event, Run
from pool_pymunk.solvers import find_solver
from pool_pymunk.studies import Mask
from pool_pymunk.studies.contacts import Contacts, through

# A sum or a product errs by up to half a spacing; this is the root mean square, as a share.
UNIT = EPSILON / 2.0 / math.sqrt(3.0)
COLUMNS = 32  # draws of random signs; their root mean square is then right to some 12 %
# Contacts of one kind err alike: a ball between two cushions adds the same interval to the time
# again and again, with the same rounding. SURE times this share of UNIT is half a spacing.
ALIKE = 0.43
# time_of_contact shrinks corners by 8 EPSILON of the coordinates; SURE times this is twice that.
CORNER = 4.0 * EPSILON
PLACES = 16  # kinds of contacts, by balls and cushion; each kind errs alike; a free choice
CHUNK = 2048  # This many events are worked out at once: their matrices take some 10 MB.
TURNED = 0.5  # rad; where a normal may have turned this far, the first order says nothing


class Unfollowed(Exception):
    """This says that errors cannot be followed: they are inf (other contacts may come), or nan."""


class Step(NamedTuple):
    """A step is an event, with the numbers of its balls and of their breakpoints before it."""

    balls: tuple[int, ...]
    rows: tuple[int, ...]
    event: Event


class Leap(NamedTuple):
    """A leap takes errors (K C, COLUMNS) of C balls from one breakpoint to the next.

    They become ``matrix`` @ errors + ``own``. At a contact the gap is wrong by ``guard`` @ errors,
    the contact is late by that over ``closing`` (m/s), and ``late`` (K C,) is a delay's effect. The
    normal turns by ``curvature`` (1/m) times the error along the tangent: ``along`` @ errors at the
    time of the contact, plus ``slip`` (m/s) times the delay. A pocketed ball would have
    missed if ``within`` (m) farther to the side, and ``along`` @ errors is its error to that side.
    """

    matrix: Array
    own: Array
    is_known: bool = True
    guard: Array | None = None
    along: Array | None = None
    late: Array | None = None
    closing: float = 0.0
    slip: float = 0.0
    curvature: float = 0.0
    within: float = math.inf


def rounding(run: Run) -> float:
    """Return how far (m) rounding may have moved the ends, to first order.

    The answer is ``SURE`` times the largest root mean square move of a ball over the draws. It is
    inf where errors grow until other contacts may come, and nan where the run has no derivative.
    """
    if not find_solver(run.solver).exact:
        return math.nan
    try:
        with np.errstate(all="ignore"):
            return Errors(run).at_the_end()
    except Unfollowed as size:
        return float(size.args[0])
    except SettingError:
        return math.nan


class Errors:
    """These are the errors ``now`` (N, K, COLUMNS) of the balls' states at their last breakpoints.

    A state has place and velocity (K = 4), and where balls roll also the roll (K = 6).
    ``breakpoints`` has those of all balls, one ball after the other; ``until`` (s) tells when
    their paths end, and ``masses`` and ``radii`` are those of their balls.
    """

    def __init__(self, run: Run) -> None:
        self.run, self.scene, self.contacts = run, run.scene, Contacts(run)
        self.size = 6 if run.scene.surface.rolls else 4
        self.random = np.random.default_rng(0)
        counts = [len(each) for each in run.knots]
        ends = np.cumsum(counts)
        self.at: list[int] = [0, *ends[:-1].tolist()]  # the number of each ball's last breakpoint
        self.ends: list[int] = ends.tolist()
        self.breakpoints = np.concatenate(run.knots)
        self.until = np.append(self.breakpoints[1:, 0], run.duration)
        self.until[ends - 1] = run.duration
        self.masses = np.repeat([ball.mass for ball in run.scene.balls], counts)
        self.radii = np.repeat([ball.radius for ball in run.scene.balls], counts)
        self.alike = self._random(5, PLACES, 2 * self.size)
        self.now = np.zeros((len(self.at), self.size, COLUMNS))

    def at_the_end(self) -> float:
        """Follow the run, and return how far its ends may have moved (m)."""
        steps, is_whole = self._steps()
        for k in range(0, len(steps), CHUNK):
            self._follow(steps[k : k + CHUNK])
        if not is_whole:
            raise Unfollowed(math.nan)
        rows = np.array(self.at)
        state, by_state = self._slide(rows, np.full(len(rows), self.run.duration))
        places = np.zeros(len(rows), dtype=int)
        moved = (by_state @ self.now + self._misplaced(places, rows, state))[:, :2]
        return float(SURE * np.sqrt((moved**2).sum(axis=1).mean(axis=1)).max())

    # -- steps -------------------------------------------------------------------------------------

    def _steps(self) -> tuple[list[Step], bool]:
        """Return the steps of a run, and whether they reach its end; move ``at`` to the last ones.

        They stop where contacts of one instant share a ball, or where a policy answers a contact.
        """
        times, index, steps = self.breakpoints[:, 0].tolist(), self.scene.index, list[Step]()
        at_rest: list[bool] = np.all(self.breakpoints[:, 3:7] == 0.0, axis=1).tolist()
        at, instant, met = self.at, -1.0, set[int]()
        for event in self.run.events:
            balls = tuple([index[id_] for id_ in event.balls])
            if event.t != instant:
                instant, met = event.t, set()
            if event.is_contact and not met.isdisjoint(balls):
                return steps, False
            met.update(balls)
            if event.kind == "stop" and at_rest[at[balls[0]]]:
                continue  # A contact has stopped the ball.
            steps.append(Step(balls, tuple([at[i] for i in balls]), event))
            for i in balls:
                at[i] += 1
                if at[i] == self.ends[i] or times[at[i]] != event.t:
                    return steps[:-1], False
                at[i] += event.pocket is not None  # Its last breakpoint is the pocket's centre.
        last = zip(at, self.ends, strict=True)
        return steps, all(times[k + 1] >= self.run.duration for k, end in last if k + 1 < end)

    def _follow(self, steps: Sequence[Step]) -> None:
        """Take the errors through these steps."""
        leaps = dict[int, Leap]()
        kinds = {"ball-ball": self._contacts, "ball-cushion": self._contacts,
                 "stop": self._stops, "roll": self._rolls, "pocket": self._falls}  # fmt: skip
        for kind, found in kinds.items():
            those = [k for k, step in enumerate(steps) if step.event.kind == kind]
            if those:
                leaps.update(zip(those, found([steps[k] for k in those]), strict=True))
        now = self.now
        for k, (balls, _, _) in enumerate(steps):
            leap = leaps[k]
            if not leap.is_known:
                raise Unfollowed(math.nan)
            before = now[balls[0]] if len(balls) == 1 else now[balls,].reshape(-1, COLUMNS)
            after = leap.matrix @ before
            after += leap.own
            if leap.curvature > 0.0:
                self._check(leap, before, after)
            now[balls,] = after.reshape(-1, self.size, COLUMNS)

    def _check(self, leap: Leap, before: Array, after: Array) -> None:
        """Correct the errors after a graze, because the errors before it change its closing speed.

        A gap g changes a closing speed c, at the slip s and the curvature k, to the root of
        c^2 +- 2 s^2 k g. It therefore changes c by s^2 k g / c, but by no more than s sqrt(2 k g).
        The linear map gives this bound for a contact that closes at s sqrt(k g / 2).
        """
        assert leap.along is not None
        if leap.guard is None or leap.late is None:
            if SURE * _size(leap.along @ before) >= leap.within:
                raise Unfollowed(math.nan)
            return
        gaps = leap.guard @ before
        gap, closing = SURE * _size(gaps), leap.closing
        least = leap.slip * math.sqrt(leap.curvature * gap / 2.0)
        if least > closing:
            after += np.outer(leap.late, gaps * (1.0 / least - 1.0 / closing))
            closing = least
        along = SURE * _size(leap.along @ before) + leap.slip * gap / closing
        if not leap.curvature * along <= TURNED:
            raise Unfollowed(math.inf)

    # -- leaps -------------------------------------------------------------------------------------

    def _stops(self, steps: Sequence[Step]) -> list[Leap]:
        """Return the leaps to where balls rest: errors of places stay, those of velocities end."""
        rows = np.array([step.rows[0] for step in steps])
        state, by_state = self._slide(rows, self.until[rows])
        by_state[:, 2:] = 0.0
        own = self._misplaced(rows % PLACES, rows, state)
        own[:, 2:] = 0.0
        return list(map(Leap, by_state, own))

    def _rolls(self, steps: Sequence[Step]) -> list[Leap]:
        """Return the leaps to where balls begin to roll; errors of slips delay that.

        The time errs by a unit of itself, and by three units of the time of the slide.
        """
        rows = np.array([step.rows[0] for step in steps])
        state, matrix = self._slide(rows, self.until[rows])
        own, slid = self._misplaced(rows % PLACES, rows, state), self.until - self.breakpoints[:, 0]
        delay = UNIT * (self.until + 3.0 * slid)[rows, np.newaxis]
        delays = delay * self._signs(0, rows % PLACES, 1)[:, 0]
        late = self.breakpoints[rows, 5:7] - self.breakpoints[rows + 1, 5:7]
        slopes = np.array([self.scene.surface.end_slopes(self.breakpoints[row])[0] for row in rows])
        for errors, times in ((matrix, slopes), (own, delays)):
            errors[:, 2:4] += late[:, :, np.newaxis] * times[:, np.newaxis]
            errors[:, 4:] = errors[:, 2:4]
        return list(map(Leap, matrix, own))

    def _falls(self, steps: Sequence[Step]) -> list[Leap]:
        """Return the leaps of balls into pockets, where errors end; a ball at the rim may miss."""
        rows = np.array([step.rows[0] for step in steps])
        states, path = self._slide(rows, self.until[rows])
        none, own, leaps = np.zeros((self.size, self.size)), np.zeros((self.size, COLUMNS)), []
        holes = {hole.id: hole for hole in self.scene.pockets}
        for step, (x, y, vx, vy), slid in zip(steps, states.tolist(), path, strict=True):
            hole = holes[str(step.event.pocket)]
            dx, dy, speed = x - hole.position[0], y - hole.position[1], math.hypot(vx, vy)
            within = hole.radius - abs(dx * vy - dy * vx) / speed
            across, bend = np.array((-vy, vx)) @ slid[:2] / speed, 1.0 / hole.radius
            leaps.append(Leap(none, own, along=across, within=within, curvature=bend))
        return leaps

    def _contacts(self, steps: Sequence[Step]) -> list[Leap]:
        """Return the leaps of hits, or of bounces: the saltation matrices, and the errors made.

        A change has columns for the states at the last breakpoints, for the draws of misplaced
        balls, for a delay of 1 s, and for a normal that turns by 1 rad.
        """
        rows = np.array([step.rows for step in steps])
        count, many = rows.shape
        size = self.size * many
        places = np.array([sum(step.balls) + (step.event.cushion or 0) for step in steps]) % PLACES
        states, slid = self._slide(rows, self.until[rows])
        before, rates = (
            self._rates(rows, states[..., 2:]),
            self._rates(rows + 1, self.breakpoints[rows + 1, 3:5]),
        )
        motions = np.concatenate((states[..., :2], before), axis=-1)
        geometries = [
            self.contacts.geometry(step.balls, each, step.event.cushion or 0)
            for step, each in zip(steps, motions[..., :6].tolist(), strict=True)
        ]
        normal, curvature, closing, _ = map(np.array, zip(*geometries, strict=True))
        axes = np.stack((normal, normal @ [[0.0, 1.0], [-1.0, 0.0]]), axis=1)  # (K, 2, 2)
        before_nt = np.einsum("kai,kci->kca", axes, states[..., 2:])
        after_nt = np.einsum("kai,kci->kca", axes, rates[..., :2])
        slip = np.abs(before_nt[:, -1, 1] - before_nt[:, : many - 1, 1].sum(axis=1))
        law, missed, known = self._laws(steps, before_nt, after_nt)
        gap = self._gap_errors(rows, steps, states, normal, curvature)
        bend = np.maximum(curvature, 0.0)
        closing = np.maximum(closing, slip * np.sqrt(bend * gap / 2.0))  # See _check.

        changes = np.zeros((count, many, self.size, size + COLUMNS + 2))
        for n in range(many):
            changes[:, n, :, n * self.size : (n + 1) * self.size] = slid[:, n]
        changes[..., size:-2] = self._misplaced(places, rows, states)
        from_other = changes[:, 0, :2] if many == 2 else 0.0
        guard, along = (axes @ (changes[:, -1, :2] - from_other))[..., :size].swapaxes(0, 1)
        late, turned = np.zeros((2, count, size + COLUMNS + 2))
        late[:, :size] = guard / closing[:, np.newaxis]
        late[:, -2], turned[:, -1] = 1.0, 1.0
        numbers: Any = normal.T[..., np.newaxis], curvature[:, np.newaxis], closing, closing
        found = np.concatenate(
            through(
                Geometry(*numbers),
                list(motions.transpose(1, 2, 0)[..., np.newaxis]),
                list(rates.transpose(1, 2, 0)[..., np.newaxis]),
                list(changes.swapaxes(0, 1)),
                late,
                partial(np.matmul, law),
                partial(self._slowed, steps, geometries, after_nt - before_nt),
                turned,
            ),
            axis=1,
        )
        matrix, own, delayed, tilted = np.split(found, (size, size + COLUMNS, -1), axis=2)
        tilts = tilted.reshape(count, many, self.size)[:, :, 2:4]
        own = own + self._made(places, rows, axes, before_nt, after_nt, missed, tilts)
        delay = gap / closing + UNIT * self.until[rows[:, 0]]
        own += delayed * delay[:, np.newaxis, np.newaxis] * self._signs(0, places, 1)
        return list(map(Leap, matrix, own, known.tolist(), guard, along, delayed[..., 0],
                        closing.tolist(), slip.tolist(), curvature.tolist()))  # fmt: skip

    def _rates(self, rows: Array, velocity: Array) -> Array:
        """Return how fast (..., K) states change on the paths from these breakpoints on."""
        rates = [velocity, self.breakpoints[rows, 5:7]]
        if self.size > 4:
            rates.append(roll_rates(self.breakpoints[rows]))
        return np.concatenate(rates, axis=-1)

    def _slowed(
        self, steps: Sequence[Step], geometries: Sequence[Geometry], pushes: Array, rolls: Array,
        turn: Array, of_push: Array,
    ) -> Array:  # fmt: skip
        """Return the changes (2, K, ...) of the rolls that cushions slow down."""
        found = np.empty_like(rolls)
        for k, (step, geometry) in enumerate(zip(steps, geometries, strict=True)):
            row, mu = step.rows[0], self.contacts.walls[step.event.cushion or 0].friction
            ((wx, wy),) = rolls_of(self.breakpoints[row : row + 1], np.array([step.event.t]))
            most, of_most = most_of_roll(mu, pushes[k, 0, 0], 0.0, of_push[k])
            w, z = rolls[:, k]
            found[:, k] = slowed_roll(geometry, (wx, wy), w, z, turn[k], most, of_most)
        return found

    def _laws(
        self, steps: Sequence[Step], before: Array, after: Array
    ) -> tuple[Array, Array, Mask]:
        """Return a law's derivatives (K, 2 C, 2 C), how far runs are off it, and which are known.

        Derivatives are unknown where the law jumps, or where a policy answered.
        """
        count, many, _ = before.shape
        fastest = np.abs(before).max(axis=(1, 2))
        laws, answers = np.full((count, 2 * many, 2 * many), math.nan), np.empty(before.shape)
        for k, (step, each) in enumerate(zip(steps, before.tolist(), strict=True)):
            velocities, wall = [NT(*parts) for parts in each], step.event.cushion or 0
            moves = [any(parts) for parts in each]
            law, answers[k] = self.contacts.asked(
                step.balls, wall, velocities, moves, float(fastest[k])
            )
            if law is not None:
                laws[k] = sum(law[..., : 2 * many]) / len(law)
        missed = np.abs(answers - after)
        known = (missed.max(axis=(1, 2)) <= AGREE * fastest) & ~np.isnan(laws).any(axis=(1, 2))
        return laws, missed, known

    # -- errors ------------------------------------------------------------------------------------

    def _misplaced(self, places: Array, rows: Array, states: Array) -> Array:
        """Return the errors (..., K, COLUMNS) of the places at the ends of paths.

        A coordinate errs by a unit of itself, and the path there, a product, by two. An
        acceleration errs by three where a ball slips: a difference, a root and a quotient.
        """
        at, own = states[..., :2], np.zeros((*rows.shape, self.size))
        moved = self._moved(rows, at)
        own[..., :2] = UNIT * np.where(moved > 0.0, np.abs(at) + 2.0 * moved, 0.0)
        if self.scene.surface.pull > 0.0:
            own[..., 2:4] = UNIT * np.abs(self.breakpoints[rows, 3:5])
        if self.size > 4:
            start, time = self.breakpoints[rows], (self.until - self.breakpoints[:, 0])[rows]
            turned = 3.0 * UNIT * time[..., np.newaxis]
            own[..., 2:4] += turned * np.abs(start[..., 5:7])
            own[..., 4:] = UNIT * np.abs(start[..., 7:9]) + turned * np.abs(roll_rates(start))
        return own[..., np.newaxis] * self._signs(1, places, *own.shape[1:])

    def _moved(self, rows: Array, at: Array) -> Array:
        """Return how far (..., 2) (m) balls move along paths, even if rolls turn them back."""
        start = self.breakpoints[rows]
        if self.size == 4:
            return np.asarray(np.abs(at - start[..., 1:3]))
        time = (self.until - self.breakpoints[:, 0])[rows][..., np.newaxis]
        return np.asarray(time * (np.abs(start[..., 3:5]) + time / 2.0 * np.abs(start[..., 5:7])))

    def _gap_errors(
        self, rows: Array, steps: Sequence[Step], states: Array, normal: Array, curvature: Array
    ) -> Array:
        """Return the errors (K,) of the gaps that are found closed.

        A gap between balls errs by a unit of their offset at the start of a path, or by four where
        the time is found by an iteration: both move, or one slips. If the ball that set off
        first still moved when the other one set off, its place was rounded then. At a straight side
        the path along the normal counts, and the offset from the start of the side. A circle errs
        by some units of its radius and of the path. A circle that bulges into the table was shrunk
        by some spacings of the coordinates.
        """
        if states.shape[1] == 1:
            start = self.breakpoints[rows[:, 0], 1:3]
            radius = self.radii[rows[:, 0]]
            outline = () if self.scene.table is None else self.scene.table.outline
            corners = np.array([*outline, *(post.position for post in self.scene.posts)])
            offset = states[:, 0, :2] - corners[[step.event.cushion or 0 for step in steps]]
            moved = self._moved(rows[:, 0], states[:, 0, :2]) + np.abs(offset)
            straight = UNIT * ((moved * np.abs(normal)).sum(axis=1) + 2.0 * radius)
            corner = CORNER * (np.abs(start).sum(axis=1) + radius) * (curvature > 0.0)
            with np.errstate(divide="ignore"):
                far = 2.0 * (1.0 / np.abs(curvature) + radius) + moved.sum(axis=1)
            return np.asarray(np.where(curvature == 0.0, straight, corner + 2.0 * UNIT * far))
        moved = self._moved(rows, states[..., :2]).sum(axis=(1, 2))
        size = moved + 2.0 * self.radii[rows].sum(axis=1)
        starts = self.breakpoints[rows, 0]
        moves = np.any(self.breakpoints[rows, 3:7] != 0.0, axis=2)
        first = np.take_along_axis(moves, starts.argmin(axis=1)[:, np.newaxis], axis=1)[:, 0]
        worked_out = first & (np.ptp(starts, axis=1) > 0.0)
        places = np.abs(states[..., :2]).sum(axis=(1, 2)) * worked_out
        found_closer = moves.all(axis=1)
        if self.size > 4:
            begun = self.breakpoints[rows]
            found_closer |= np.any(begun[..., 3:5] != begun[..., 7:9], axis=(1, 2))
        return np.asarray(UNIT * (np.where(found_closer, 4.0, 1.0) * size + places))

    def _made(
        self, places: Array, rows: Array, axes: Array, before: Array, after: Array, missed: Array,
        turned: Array,
    ) -> Array:  # fmt: skip
        """Return the errors (M, K C, COLUMNS) that the contacts and the new paths make.

        The parts of the velocities before a contact are sums of products, and so err by a unit of
        each. A part that the law does not change keeps every bit. A normal errs by a unit.
        """
        count, many, _ = before.shape
        own = np.zeros((count, many, self.size))
        own[..., 2:4] = UNIT * np.abs(self.breakpoints[rows + 1, 3:5])
        own[..., 4:] = UNIT * np.abs(self.breakpoints[rows + 1, 7:9])
        own = own[..., np.newaxis] * self._signs(2, places, many, self.size)
        share = np.ones((count, many))
        if many == 2:
            masses = self.masses[rows]
            share = masses[:, ::-1] / masses.sum(axis=1)[:, np.newaxis]
        # |v_x n_x| + |v_y n_y| and |v_x t_x| + |v_y t_y|, of all balls in the contact
        velocity = np.abs(np.einsum("kai,kca->kci", axes, before))
        parts = np.einsum("kai,kci->ka", np.abs(axes), velocity)
        skew = np.abs(axes[:, 0]).prod(axis=1)
        parts *= 1.0 + (skew > 0.0)[:, np.newaxis]
        changed = np.abs(after - before) > 0.0
        errors = UNIT * share[..., np.newaxis] * parts[:, np.newaxis] * changed + missed
        signed = errors[..., np.newaxis] * self._signs(3, places, many, 2)
        own[:, :, 2:4] += np.einsum("kai,kcas->kcis", axes, signed)
        tilted = 2.0 * UNIT * turned * skew[:, np.newaxis, np.newaxis]
        own[:, :, 2:4] += tilted[..., np.newaxis] * self._signs(4, places, 1, 1)
        return own.reshape(count, self.size * many, COLUMNS)

    def _signs(self, source: int, places: Array, *shape: int) -> Array:
        """Return random signs (K, *shape, COLUMNS), plus ALIKE times the signs of their kind."""
        signs = self._random(len(places), *shape)
        kept = self.alike[source, places, : math.prod(shape)]
        return np.asarray(signs + ALIKE * kept.reshape(signs.shape))

    def _random(self, *shape: int) -> Array:
        return np.asarray(self.random.integers(0, 2, (*shape, COLUMNS), dtype=np.int8) * 2.0 - 1.0)

    # -- motion ------------------------------------------------------------------------------------

    def _slide(self, rows: Array, times: Array) -> tuple[Array, Array]:
        """Return the states (..., 4) at times (s), and how (..., K, K) the paths change them."""
        start = self.breakpoints[rows]
        state = np.concatenate(free_motions(start, times), axis=-1)
        return state, self.scene.surface.jacobian(start, times - start[..., 0])[0]


def _size(errors: Array) -> float:
    """Return the root mean square of the draws (COLUMNS,) of an error."""
    return math.sqrt(errors @ errors / COLUMNS)
