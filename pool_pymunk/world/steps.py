"""This module makes the steps of a space: the engine plays, callbacks hear of it, pymunk steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from threading import get_ident
from typing import Any

import numpy as np

from pool_pymunk.core.live import MOST_EVENTS
from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.core.news import JAM, Event
from pool_pymunk.core.record import POCKET, STOP
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.world.ball import ContactEvent, TableBall
from pool_pymunk.world.bodies import Rows, rows_of
from pool_pymunk.world.checks import check_space, check_step
from pool_pymunk.world.table import NO_THREAD, NOTHING, LiveTable, Phase

# Callbacks may hear so often of one time, after which a game would not notice their end. A thousand
# calls take half a second; no test of games has more than five.
MOST_TOLD = 1000
ROUNDING = 4.0 * EPSILON  # of speeds: pymunk adds what gravity gives, and here it is taken off


def without(gains: Rows, falls: Rows, motions: Rows) -> Rows:
    """Return gains of velocities (m/s) without what balls gain as they fall, to rounding."""
    left = gains - falls
    left[np.abs(left) <= ROUNDING * (np.abs(motions) + np.abs(falls))] = 0.0
    return left


class Steps:
    """These are the steps of a table's space, and the calls of the table's callbacks in them."""

    def __init__(self, live: LiveTable, table: object) -> None:
        self.live = live
        self.count = 0
        self.least_closing = 0.0  # m/s
        self._of = partial(getattr, table)
        self._error: Exception | None = None
        self._later: list[Callable[[], object]] = []  # what pymunk's handlers have asked for
        self._told = -math.inf, 0  # the last time (s) of which callbacks heard, and how often
        # the time (s) since which steps have their present length, and how many have been made
        self._since, self._dt, self._made = 0.0, live.max_dt, 0
        self._step = live.space.step
        vars(live.space)["step"] = self.step

    def __reduce__(self) -> str | tuple[Any, ...]:
        message = "a Billiards and its space cannot be copied or pickled: use save_state"
        raise TypeError(message + " and restore_state")

    def note(self, error: Exception) -> None:
        """Keep the first error of a step until its end, as pymunk only prints what is raised."""
        self._error = self._error or error

    def do_later(self, call: Callable[[], object]) -> None:
        """Make a call when the present step is over."""
        self._later.append(call)

    def refuse_in_step(self, call: str, value: object = "in a step") -> None:
        """Refuse a call that is for the time between two steps."""
        if self.live.phase is not Phase.BETWEEN:
            raise setting_error(call, value, "wait until the present step is over")

    # -- a step ------------------------------------------------------------------------------------

    def step(self, dt: float) -> None:
        """Do what ``space.step(dt)`` does."""
        self.refuse_in_step("step")
        if dt == 0.0:  # pymunk does nothing in such a step.
            return
        check_step(dt, self.live.max_dt)
        self.step_until(self._end_of(float(dt)), float(dt))

    def _end_of(self, dt: float) -> float:
        """Return when (s) a step ends: many equal steps do not add up their roundings."""
        now = self.live.engine.now
        if dt != self._dt or now != self._since + self._made * dt:
            self._since, self._dt, self._made = now, dt, 0
        return self._since + (self._made + 1) * dt

    def step_until(self, until: float, dt: float) -> None:
        """Make a step of ``dt`` (s), which ends at a time (s)."""
        live = self.live
        live.follow()
        live.stepped_by = get_ident()
        try:
            self._make_step(until, dt)
        finally:
            live.stepped_by = NO_THREAD

    def _make_step(self, until: float, dt: float) -> None:
        live, engine = self.live, self.live.engine
        check_space(live.space)
        live.refuse_changes(self.count)
        if live.walls.moving:
            live.walls.stand()
            live.make_room()
            live.walls.plan(until)
        live.began = engine.now
        engine.start_step(engine.now)
        stands = not (live.walls.moving or engine.moving())
        is_quiet = stands and engine.upcoming() > until
        try:
            self._play(until)
            if engine.is_finite:  # Else the run of a solver ends here; others have raised an error.
                self._let_pymunk_step(dt, is_quiet)
        except BaseException:
            self._stand()
            raise
        if engine.is_finite:
            self.count += 1
            self._made += 1
            self._finish()

    def _stand(self) -> None:
        """Let the table stand where the engine is: a law or a pair has failed, or Ctrl-C came."""
        live, engine = self.live, self.live.engine
        engine.is_stale = True
        engine.news.take()
        live.walls.put_back()
        live.phase = Phase.BETWEEN
        live.take_out()
        live.show()

    def _play(self, until: float) -> None:
        """Let the engine play up to a time (s), and call the callbacks after each instant."""
        live, engine = self.live, self.live.engine
        live.phase = Phase.PLAYING
        self._listen()
        while engine.play(until):
            self._tell_all(engine.news.take())
        live.take_out()
        if engine.recorder is engine.news:  # Else a solver says how its run has ended.
            self._refuse_to_stand_still()
        live.phase = Phase.BETWEEN

    def _refuse_to_stand_still(self) -> None:
        """Refuse a step that the engine has not played to its end."""
        engine = self.live.engine
        if not engine.is_finite:
            message = "a ball got a velocity that is no number, or too large to be followed"
            falls = self.live.falls
            key, value = ("law", engine.law.name) if falls == NOTHING else ("gravity", [*falls])
            raise setting_error(key, value, f"{message}, at {engine.now:g} s")
        if engine.has_given_up:
            message = f"a step has at most {MOST_EVENTS:,} events: it stands at {engine.now:g} s"
            raise setting_error("dt", self._dt, message)

    def _let_pymunk_step(self, dt: float, is_quiet: bool) -> None:
        """Let pymunk take bodies to where balls are now, and everything else in the space act.

        It moves bodies first, and looks then who touches whom: so it sees each ball in its exact
        place, with its true velocity. What it changes of a velocity is a push. In a step that
        ``is_quiet`` no ball has moved: bodies show already how they are.
        """
        live, bodies, motions = self.live, self.live.bodies, self.live.written
        if not is_quiet:
            motions = rows_of(live.engine.motions())
            if not bodies.are_known:  # Else nobody has touched one since the step began.
                live.read()
            steered = motions.copy()
            steered[:, :2] -= dt * motions[:, 2:]
            bodies.write(steered, live.balls)
        live.walls.steer(dt)
        live.phase = Phase.STEPPING
        try:
            self._step(dt)
        finally:
            live.phase = Phase.BETWEEN
            live.written = motions
        live.read()
        if is_quiet and bodies.are_as_seen:
            return
        gains = bodies.shown(motions) - motions
        gains[:, :2] = 0.0  # Places differ, by rounding or by others; they come from the engine.
        if live.falls != NOTHING:
            falls = np.zeros_like(gains)
            falls[bodies.numbers, 2:] = dt * np.array(live.falls)
            gains = without(gains, falls, motions)
        if np.count_nonzero(gains):
            live.push(gains, dt)
            live.show()
        else:
            live.write(motions)

    def _finish(self) -> None:
        """Let walls stand, do what handlers have asked for, and raise what went wrong."""
        live = self.live
        if live.walls.moving:
            live.walls.leave()
        later, self._later = self._later, []
        for call in later:
            try:
                call()
            except Exception as error:
                self.note(error)
        first, self._error = self._error, None
        if first is not None:
            raise first

    def play(self, on_time: Callable[[float], object] | None, latest: float) -> None:
        """Step until everything rests, until ``latest`` (s), or until nothing more may happen."""
        self.refuse_in_step("play")
        live, engine = self.live, self.live.engine
        live.follow()
        if latest == math.inf and engine.is_playing and live.walls.solid and not live.slows:
            message = "is missing: between walls, balls without friction never come to rest"
            raise setting_error("latest", latest, message)
        while engine.now < latest and engine.may_go_on:
            is_due = engine.is_playing or engine.upcoming() <= engine.now
            if not (is_due or (latest < math.inf and live.walls.are_moving)):
                break
            engine.refresh()
            if latest == engine.upcoming() == math.inf:  # What moves goes on for ever.
                break
            end = self._end_of(self._dt)
            if end >= latest:
                self.step_until(latest, latest - engine.now)
            else:
                self.step_until(end, self._dt)
            if on_time is not None:
                on_time(engine.now)

    # -- callbacks ---------------------------------------------------------------------------------

    def _listen(self) -> None:
        """Let the engine tell of what somebody wants to hear."""
        news = self.live.engine.news
        news.hears_contacts = self._of("on_contact") is not None
        news.hears_stops = self._of("on_stop") is not None
        news.hears_jams = self._of("on_jam") is not None
        news.least = self.least_closing

    def _tell_all(self, events: list[Event]) -> None:
        """Call the callbacks of an instant, and keep their errors for the step's end.

        What a callback changes counts from this instant on.
        """
        live = self.live
        live.take_out()
        self._refuse_to_go_on_for_ever(events)
        for event in events:
            name, balls, said = self._call_of(event)
            callback: Callable[..., object] | None = self._of(name)
            if callback is None:
                continue
            live.show_some(balls)
            live.phase = Phase.TELLING
            try:
                try:
                    callback(*said)
                finally:
                    live.follow()
            except Exception as error:
                self.note(error)
            finally:
                live.phase = Phase.PLAYING
        self._listen()

    def _call_of(self, event: Event) -> tuple[str, tuple[TableBall, ...], tuple[Any, ...]]:
        """Return which callback hears of an event, the balls of the event, and what is said."""
        balls = tuple([self.live.balls[i] for i in (event.a, event.b) if i >= 0])
        if event.kind == STOP:
            return "on_stop", balls, (*balls, event.t)
        if event.kind in (POCKET, JAM):
            name = "on_pocket" if event.kind == POCKET else "on_jam"
            return name, balls, (*balls, event.wall, event.t)
        wall, since = (event.wall if event.wall >= 0 else None), event.since
        contact = ContactEvent(
            event.t, balls, wall, (event.px, event.py), (event.nx, event.ny), event.closing,
            event.normal, event.along, None if since == math.inf else since,
        )  # fmt: skip
        return "on_contact", balls, (contact,)

    def _refuse_to_go_on_for_ever(self, events: list[Event]) -> None:
        """Refuse a callback that makes contact after contact at one time."""
        now = self.live.engine.now
        t, many = self._told
        self._told = now, many + 1 if now == t else 1
        if many >= MOST_TOLD and now == t:
            self._told = -math.inf, 0
            name, _, _ = self._call_of(events[0])
            message = f"was called {many} times at {t:g} s, because each call makes another contact"
            raise setting_error(name, shown(self._of(name)), message)
