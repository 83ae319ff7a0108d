"""A tangent follows small changes of the inputs along the course of a run, to first order.

Between events a change evolves with the motion (:mod:`pool_pymunk.core.tangent.carry`), and a
contact takes it over to the new velocities (:mod:`pool_pymunk.core.tangent.encounter`). Where there
is no derivative, there is a reason, and what depends on it is nan.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.tangent import reasons
from pool_pymunk.core.tangent.change import GRAZE, Column, Rates
from pool_pymunk.core.tangent.course import (
    CROSS,
    FALL,
    HIT,
    LASTS,
    NOTHING,
    ROLL,
    STOP,
    Course,
    Step,
)
from pool_pymunk.core.tangent.encounter import Encounter
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.reasons import FOLLOWED
from pool_pymunk.core.tangent.rounding import TIMES, UNIT, RoundingErrors, sizes_of
from pool_pymunk.core.tangent.touches import Corner, Found, Lookout
from pool_pymunk.core.tangent.track import Track, are_now, is_now


@final
class Tangent:
    """A tangent follows the changes by all inputs along the course that an engine has played, once.

    ``lates`` (E, P) are how much later (s) events come. ``found`` are times (s) and reasons why
    something is nan. The tracks then have the changes of the balls at the end. With ``errors`` the
    columns are those of rounding; they end where they cannot be followed. If it ``keeps`` changes,
    it knows them at any time, and it ``times`` events unless nobody asks.
    """

    def __init__(
        self, engine: Engine, course: Course, corners: list[Corner], inputs: Inputs
    ) -> None:
        self.table: Final = engine.table
        self.law: Final = engine.law
        self.corners: Final = corners
        self.steps: Final[list[Step]] = course.steps
        self.inputs: Final = inputs
        self.errors: RoundingErrors | None = None
        self.keeps = False
        self.times = True
        self.rolls: Final = engine.table.surface.rolls
        self.tracks: Final[list[Track]] = []
        changes = inputs.changes_at_first(len(engine.balls))
        for ball, own, legs, is_off in zip(engine.balls, changes, course.legs, course.is_off):
            self.tracks.append(Track(ball, legs, own, is_off))
        self.columns: Final = [Column() for _ in range(inputs.count)]
        self.lates: Final[list[list[float]]] = []
        self.found: Final[Found] = []
        self.lookout: Final = Lookout(engine.table, inputs, self.tracks, self.found)
        self.duration = 0.0
        self.is_cut = False
        self.is_cut_by_events = False

    def follow(self, duration: float, is_cut: bool, is_cut_by_events: bool) -> str:
        """Follow the changes to the end of a run (s); return why errors cannot be, if so.

        The run may have been cut off at its end, maybe by its number of events.
        """
        self.duration, self.is_cut = duration, is_cut
        self.is_cut_by_events = is_cut_by_events
        for track in self.tracks:
            track.keeps = self.keeps
            track.keep(0.0)
        for k in range(len(self.steps)):
            why = self._go_through(k)
            if why != FOLLOWED and self.errors is not None:
                return why
        return self._finish()

    def ends(self) -> list[list[float]]:
        """Return the changes (N, K P) of all balls: place, velocity and, if they roll, roll."""
        found: list[list[float]] = []
        for track in self.tracks:
            row = [c.x for c in track.changes] + [c.y for c in track.changes]
            row += [c.vx for c in track.changes] + [c.vy for c in track.changes]
            if self.rolls:
                row += [c.wx for c in track.changes] + [c.wy for c in track.changes]
            found.append(row)
        return found

    def _go_through(self, k: int) -> str:
        """Follow the changes through one step; return why that cannot be, if so."""
        step = self.steps[k]
        a, b = self.tracks[step.a], self.tracks[step.other]
        why = self._reason(k, step, a, b)
        if self.errors is None:
            self.lookout.look_before(step, a, b, why == reasons.SHARED or step.kind == LASTS)
        if why == FOLLOWED:
            why = self._take(step, a, b)
        if self.errors is None:
            self._settle(step, a, b, why)
        return why

    def _finish(self) -> str:
        """Follow the changes to the end of the run; return why errors cannot be, if so."""
        t = self.duration
        if self.errors is None:
            self.lookout.catch_up(t)
        for track in self.tracks:
            then = track.following
            if then is not None and then.t < t:
                if self.errors is not None:
                    return reasons.PERSISTS
                self._lose(reasons.PERSISTS, track, track, then.t)
            if self.errors is None:
                self.lookout.look(track, t, NOTHING, track)
        for track in self.tracks:
            rests = self.is_cut and track.rests_just_at(t)
            self._move(track, t)
            if rests and self.errors is None:
                self._lose_velocity(track, t)
        return FOLLOWED

    # -- steps -------------------------------------------------------------------------------------

    def _reason(self, k: int, step: Step, a: Track, b: Track) -> str:
        """Return why a step has no derivative, as far as its time tells."""
        if self.errors is None and (a.is_lost or b.is_lost):
            return reasons.KNOWN_BEFORE
        if step.kind == LASTS:
            return reasons.PERSISTS
        if step.kind != HIT and step.kind != FALL:
            return FOLLOWED
        if self._shares(k, step, a, b):
            return reasons.SHARED
        if self.errors is not None:
            return FOLLOWED
        if step.t == self.duration and self.is_cut_by_events:
            return reasons.CUT_OFF
        if self.is_cut and are_now(step.t, self.duration, a, b):
            return reasons.ENDS_THERE
        rests = a.rests_just_at(step.t) or b.rests_just_at(step.t)
        return reasons.RESTS_THERE if rests else FOLLOWED

    def _shares(self, k: int, step: Step, a: Track, b: Track) -> bool:
        """Tell whether a contact has a ball in common with another event of its instant.

        A contact before may have stopped the ball. For errors, only contacts before count, and
        those at this very time.
        """
        if self._shares_with(k, -1, step, a, b):
            return True
        return self.errors is None and self._shares_with(k, 1, step, a, b)

    def _shares_with(self, k: int, stride: int, step: Step, a: Track, b: Track) -> bool:
        """Tell whether it shares a ball with one of its time, before it (-1) or after it (1)."""
        is_exact, n = self.errors is not None, k + stride
        while 0 <= n < len(self.steps):
            other = self.steps[n]
            if other.t != step.t and (is_exact or not are_now(other.t, step.t, a, b)):
                return False
            has_hit = other.kind != STOP or (n < k and not is_exact)
            if other.kind != LASTS and has_hit and (other.has(step.a) or other.has(step.other)):
                return True
            n += stride
        return False

    def _take(self, step: Step, a: Track, b: Track) -> str:
        """Take the changes through a step; return why that cannot be, if so."""
        t, kind = step.t, step.kind
        if self.errors is not None:
            self.errors.begin(a.at)
        if kind == STOP and a.path.vx == 0.0 and a.path.vy == 0.0:  # A contact left it at rest.
            self.found.append((t, reasons.STOPPED))
            for column in self.columns:
                column.late = math.nan
            a.come_to(t)
            return FOLLOWED
        if not a.goes_on_at(t) or not b.goes_on_at(t):
            return reasons.AT_RIM if kind == FALL else reasons.UNTOLD
        if kind == HIT:
            return self._meet(step, a, None if b is a else b)
        if kind in (STOP, ROLL):
            self._end_path(step, a)
            return FOLLOWED
        return self._cross(a, t) if kind == CROSS else self._fall(step, a)

    def _settle(self, step: Step, a: Track, b: Track, why: str) -> None:
        """Note what a step has changed, and lose what is not known after it."""
        if why == FOLLOWED and (a.is_beyond or b.is_beyond):
            self._lose(reasons.GROWN, a, b, step.t)
        elif why != FOLLOWED:
            self._lose(why, a, b, step.t)
            for column in self.columns:
                column.late = math.nan
        if step.kind != LASTS and self.times:
            self.lates.append([column.late for column in self.columns])
        a.keep(step.t)
        a.note_ever(why != FOLLOWED)
        if b is not a:
            b.keep(step.t)
            b.note_ever(why != FOLLOWED)

    def _end_path(self, step: Step, track: Track) -> None:
        """Let a ball come to rest, where changes of its place stay, or begin to roll.

        Then its acceleration changes, and its slip is gone.
        """
        track.ground(self.table, self.inputs).note_end(track.path, track.changes, self.columns)
        self._move(track, step.t)
        if step.kind == STOP:
            for each in track.changes:
                each.stop()
            track.come_to(step.t)
            return
        self._change_path(track, step.t)
        for each in track.changes:
            each.wx, each.wy = each.vx, each.vy

    def _cross(self, track: Track, t: float) -> str:
        """Let a ball cross the border of a patch: its acceleration changes, sooner or later."""
        x, y, vx, vy = track.path.at(t)
        nx, ny = self.table.patches.normal(x, y)
        across = nx * vx + ny * vy
        self._move(track, t)
        if abs(across) <= GRAZE * max(abs(vx), abs(vy)):
            return reasons.AT_BORDER
        if self.errors is None and is_now(t, 0.0, track.fastest, track.size):
            return reasons.AT_BORDER
        for p, c in enumerate(track.changes):
            self.columns[p].late = -(nx * c.x + ny * c.y) / across
        self._change_path(track, t)
        return FOLLOWED

    def _change_path(self, track: Track, t: float) -> None:
        """Go on to another path at the same place and velocity, sooner or later.

        By rounding, its time errs by a unit, and by three units of the path before.
        """
        errors, vx, vy = self.errors, 0.0, 0.0
        if errors is not None:
            errors.draw(UNIT * (t + 3.0 * (t - track.path.t)), TIMES, 0)
            for p, column in enumerate(self.columns):
                column.late += errors.of(p)
        before = Rates(track.path, vx, vy, self.rolls)
        track.come_to(t)
        after = Rates(track.path, vx, vy, self.rolls)
        for p, c in enumerate(track.changes):
            late = self.columns[p].late
            c.advance(before, late)
            c.advance(after, -late)

    def _fall(self, step: Step, track: Track) -> str:
        """Let a ball fall into its pocket, where it stays."""
        x, y, vx, vy = track.path.at(step.t)
        wall = step.wall
        assert wall is not None, "a ball falls into a pocket"
        side = wall.sides[0]
        nx, ny = side.normal(x, y)
        closing = -(vx * nx + vy * ny)
        self._move(track, step.t)
        if self.errors is not None:
            speed = math.sqrt(vx * vx + vy * vy)
            within = (1.0 - abs(nx * vy - ny * vx) / speed) / side.curvature(x, y)
            _along, across = sizes_of(track.changes, None, vx / speed, vy / speed)
            if across >= within:
                return reasons.AT_RIM
        elif closing <= GRAZE * max(abs(vx), abs(vy)):
            return reasons.AT_RIM
        for p, c in enumerate(track.changes):
            self.columns[p].late = (nx * c.x + ny * c.y) / closing
            c.hold()
        track.come_to(step.t)
        track.is_gone = True
        return FOLLOWED

    # -- contacts ----------------------------------------------------------------------------------

    def _meet(self, step: Step, a: Track, b: Track | None) -> str:
        """Follow the changes through a hit; return why that cannot be, if so."""
        if step.drifts:
            return reasons.UNTOLD
        encounter, errors = Encounter(step, a, b, self.rolls), self.errors
        if errors is None:
            x, y = encounter.x, encounter.y
            if b is None and any(corner.is_met(x, y, a.radius) for corner in self.corners):
                return reasons.AT_CORNER
            if encounter.is_graze:
                return reasons.IS_GRAZE
        self._move(a, step.t)
        if b is not None:
            self._move(b, step.t)
        if errors is not None and not encounter.misjudge(errors, self.columns):
            return reasons.CHAOS
        touch_first = errors is None and are_now(step.t, 0.0, a, a if b is None else b)
        encounter.come_late(self.columns, self.inputs)
        if touch_first and any(column.late != 0.0 for column in self.columns):
            self.found.append((step.t, reasons.TOUCH_FIRST))
        hit = encounter.hit(self.law, errors is None)
        sides = encounter.sides(hit, self.columns, errors is None)
        if len(sides) == 0:
            return reasons.JUMPS
        cue = a.is_cue or (b is not None and b.is_cue)
        if not (encounter.is_usual(self.table, cue) and encounter.is_by_law(hit)):
            return reasons.BY_POLICY
        encounter.answer(sides, self.columns, self.inputs, cue)
        if errors is not None:
            encounter.round_answer(errors, hit)
        else:
            self._lose_where(a, b, step.t, touch_first)
        a.go_on(step.met)
        if b is not None:
            b.go_on(a.number)
        return FOLLOWED

    def _lose_where(self, a: Track, b: Track | None, t: float, touch_first: bool) -> None:
        """Lose the changes by inputs at whose kink a contact is.

        If balls touch at the start, these are all by which they would not.
        """
        is_bent = False
        for p, column in enumerate(self.columns):
            lost = touch_first and column.late != 0.0
            is_bent = is_bent or column.is_bent
            if lost:
                column.late = math.nan
            if lost or column.is_bent:
                a.changes[p].lose()
                if b is not None:
                    b.changes[p].lose()
        if is_bent:
            self.found.append((t, reasons.BENT))

    # -- changes -----------------------------------------------------------------------------------

    def _move(self, track: Track, t: float) -> None:
        """Take the changes of a ball along its path to a time (s), with the errors of that."""
        track.ground(self.table, self.inputs).carry(track.path, track.changes, t)
        if self.errors is not None:
            self.errors.misplace(track.path, track.changes, t)

    def _lose(self, why: str, a: Track, b: Track, t: float) -> None:
        """Note that balls have no derivatives from a time (s) on, and why."""
        if why != reasons.KNOWN_BEFORE:
            self.found.append((t, why))
        a.lose(t)
        if b is not a:
            b.lose(t)

    def _lose_velocity(self, track: Track, t: float) -> None:
        """Lose what changes the velocity of a ball that rests just at the end."""
        for each in track.changes:
            if not each.is_zero:
                self.found.append((t, reasons.RESTS_LAST))
                each.vx = each.vy = each.wx = each.wy = math.nan
