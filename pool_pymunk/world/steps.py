"""This module makes steps of a space, and answers what happens to the balls in them."""

from __future__ import annotations

import math
from collections.abc import Callable

from pool_pymunk.model.problems import setting_error
from pool_pymunk.world.checks import check_step
from pool_pymunk.world.state import HAIR, Phase, State
from pool_pymunk.world.telling import Callbacks
from pool_pymunk.world.walls import Walls

MOST_QUIET = 1000.0  # steps between two looks at the clock


class Steps:
    """These are the steps of a space that holds a table alone."""

    def __init__(self, state: State, walls: Walls, callbacks: Callbacks) -> None:
        self.state = state
        self.walls = walls
        self.callbacks = callbacks
        self._pymunk_step = state.space.step
        vars(state.space)["step"] = self.step_of_space

    def step_of_space(self, dt: float) -> None:
        """Do what ``space.step(dt)`` does from now on."""
        raise setting_error("alone", True, "the space is the table's own: call table.step(dt)")

    def catch_up(self) -> None:
        """Follow what others have done to the balls: nobody else is here."""

    def refuse_in_step(self, call: str, value: object = "in a step") -> None:
        """Refuse a call that is for the time between two steps."""
        if self.state.phase is not Phase.BETWEEN:
            raise setting_error(call, value, "wait until the present step is over")

    def step(self, dt: float | None) -> None:
        """Make one step (s), by default as long as the last one."""
        state = self.state
        if state.phase is not Phase.BETWEEN:
            self.refuse_in_step("step")
        is_other = dt is not None and dt != state.dt
        if dt is not None and is_other:
            check_step(dt, state.max_dt)
            state.take_steps_of(float(dt))
        state.begin_step()
        try:
            self._pymunk_step(state.dt)
            self.answer()
        finally:
            state.phase = Phase.BETWEEN
        if is_other:
            state.carry_all()
        if state.error is not None:
            state.raise_noted()

    def play(self, on_time: Callable[[float], object] | None, latest: float) -> None:
        """Step until everything rests, until ``latest``, or until nothing more may happen."""
        state, engine = self.state, self.state.engine
        self.refuse_in_step("play")
        state.latest, state.wake = latest, -math.inf  # Balls may have been struck since.
        while state.moving and state.time < latest:
            self._make_steps(self._steps_until_due())
            state.raise_noted()
            if on_time is not None:
                on_time(state.time)
            if engine.is_over or not engine.is_finite:
                state.time = engine.now
                state.stop_balls()
                break
        state.latest = math.inf

    def _make_steps(self, count: int) -> None:
        """Step the space until two sensors touch, but at most ``count`` times."""
        state, step, pairs = self.state, self._pymunk_step, self.state.near.pairs
        dt, quiet = state.dt, 0
        state.begin_step()
        try:
            step(dt)
            while quiet < count - 1 and not pairs and state.error is None:
                step(dt)
                quiet += 1
            if quiet:
                state.tick(quiet)
            self.answer()
        finally:
            state.phase = Phase.BETWEEN

    def _steps_until_due(self) -> int:
        """Return in how many steps something is due, if no two sensors touch until then."""
        state = self.state
        if not state.has_joints or state.wake == -math.inf:
            return 1
        steps = (min(state.wake, state.latest) - state.time) / state.dt
        return int(max(0.0, min(steps * (1.0 - HAIR), MOST_QUIET))) + 1  # rather too early

    def answer(self) -> None:
        """Answer what happened in the step that pymunk has just made; mostly it is nothing."""
        state, end = self.state, self.state.end_of_step
        if end >= state.wake or state.near.pairs or state.sent:
            self._answer_due(end)
        else:
            state.tick()

    def is_bare(self) -> bool:
        """Tell whether nothing is to be done for the step that pymunk has just made."""
        state = self.state
        return state.end_of_step < state.wake and not state.near.pairs and not state.sent

    def _answer_due(self, end: float) -> None:
        state, engine, since = self.state, self.state.engine, self.state.time
        is_due = state.near.pairs or state.sent or engine.upcoming() <= end
        if is_due:
            self._check_walls()
        state.tick()
        if is_due:
            self._answer_contacts(since)
        ahead = 0.0 if state.alone else state.max_dt  # Others see how a ball stops.
        if state.time + ahead >= state.next_stop:
            state.stop_balls()
        state.wake = min(engine.upcoming(), state.next_stop - (1.0 + HAIR) * ahead)

    def _check_walls(self) -> None:
        """Refuse this step if a wall has moved; nobody else is here who could move one."""

    def _answer_contacts(self, since: float) -> None:
        """Answer the contacts of the step that began at ``since`` (s), in their order."""
        state, engine, near = self.state, self.state.engine, self.state.near
        engine.now, near.until = since, state.time
        near.foresee()
        sent, state.sent = dict.fromkeys(state.sent), []
        engine.predict([i for i in sent if state.balls[i].is_on_table])
        self._play_instants()
        for i in near.changed:
            state.carry(state.balls[i])
        near.settle()

    def _play_instants(self) -> None:
        """Play the instants of this step, and call the callbacks after each."""
        state, engine, callbacks = self.state, self.state.engine, self.callbacks
        state.phase = Phase.ANSWERING
        try:
            while engine.is_finite and not engine.is_over and engine.upcoming() <= state.time:
                engine.next()
                if state.near.gone:
                    state.take_out_gone()
                if callbacks.told:
                    callbacks.tell_all()
        except Exception:  # A law or pair of the user's has failed: its contact is still due.
            engine.predict(list(state.moving))
            state.wake = -math.inf
            raise
        finally:
            state.phase = Phase.STEPPING
            callbacks.told.clear()
