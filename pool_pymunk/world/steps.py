"""This module steps a space, answers the contacts of its balls, and calls the callbacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from functools import partial

import pymunk

from pool_pymunk.engine import contacts
from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.due import Hit
from pool_pymunk.engine.recorder import Motion, Persisted, Recorder
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.physics.contact import Contact, Pair, Vector, closing_speed
from pool_pymunk.physics.impulses import Impulse
from pool_pymunk.physics.path import Path
from pool_pymunk.world.ball import HAIR, ContactEvent, TableBall
from pool_pymunk.world.bodies import Snapshot
from pool_pymunk.world.broad_phase import BroadPhase
from pool_pymunk.world.checks import check_sound, check_step
from pool_pymunk.world.hands import WatchedState
from pool_pymunk.world.state import NOTHING, Phase

# At most this many quiet steps come between two calls of ``on_time``: they take some ms.
MOST_QUIET = 1000.0
# Callbacks may hear so often of one time, after which a game would not notice their end. A thousand
# calls take half a second; no test of games has more than five.
MOST_TOLD = 1000

ALONE = "of a table that is alone: leave out alone=True"
USUAL = {
    "velocity_func": pymunk.Body.update_velocity, "position_func": pymunk.Body.update_position
}  # fmt: skip

# a callback's name, its arguments, and the paths of balls before it
PendingCall = tuple[str, tuple[object, ...], dict[TableBall, Path]]


class Callbacks(Recorder):
    """This recorder calls a table's callbacks for what happened, once an instant is over."""

    def __init__(self, state: WatchedState, table: object) -> None:
        self.state = state
        self.of = partial(getattr, table)
        self.least_closing = 0.0  # m/s; above 0, nobody hears of persistent contacts, either
        self.pending: list[PendingCall] = []  # what has happened in the present instant
        self._before = Snapshot()  # how the bodies moved when the present callback was called
        self._told = -math.inf, 0  # the last time (s) of which callbacks heard, and how often

    # -- what happens ----------------------------------------------------------------------------

    def contact(self, contact: Contact, impulse: Impulse, t: float) -> None:
        if self.of("on_contact") is not None:
            balls = tuple(self.state.balls[i] for i in contact.balls)
            closing = closing_speed(contact, {ball.number: ball.path.at(t)[1] for ball in balls})
            if closing < self.least_closing:
                return
            where = contact.point, contact.normal
            event = ContactEvent(t, balls, contact.cushion, *where, closing, *impulse[:2])
            self._tell("on_contact", event, balls=balls)

    def jammed(self, i: int, wall: int, t: float) -> None:
        self._tell("on_jam", self.state.balls[i], wall, t)

    def persistent(self, persisted: Persisted) -> None:
        if self.least_closing > 0.0:
            return
        contact, since, t, x, y = persisted
        balls = tuple(self.state.balls[i] for i in contact.balls)
        nx, ny = contact.normal
        where, parts = (contact.point, contact.normal), (x * nx + y * ny, y * nx - x * ny)
        event = ContactEvent(t, balls, contact.cushion, *where, 0.0, *parts, since)
        self._tell("on_contact", event)

    def stop(self, i: int, t: float, position: Vector) -> None:
        ball = self.state.balls[i]
        # In one instant a ball may come to rest in each of many rounds of hits.
        self.pending = [call for call in self.pending if call[:2] != ("on_stop", (ball, t))]
        self._tell("on_stop", ball, t)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        self._tell("on_pocket", self.state.balls[i], pocket, t)

    def _tell(self, name: str, *said: object, balls: Sequence[TableBall] = ()) -> None:
        """Call a callback later, which then sees these balls' ``path`` as it is now."""
        if self.of(name) is not None:
            self.pending.append((name, said, {ball: ball.path for ball in balls}))

    def note_ends(self) -> list[Hit]:
        """Return the persistent contacts that are over; one that ends now has its place of now."""
        engine, persisted = self.state.engine, self.state.engine.groups.persisted
        over = [hit for hit in persisted if not engine.presses(hit)]
        for hit in over:
            if self._is_there(hit, persisted[hit]):
                persisted[hit] = persisted[hit]._replace(contact=engine.contact(hit))
        return over

    def _is_there(self, hit: Hit, persisted: Persisted) -> bool:
        """Tell whether a contact is over just now, and both of its sides are still there."""
        engine, balls = self.state.engine, self.state.balls
        if hit.kind == "wall" and engine.walls[hit.j].number != persisted.contact.cushion:
            return False
        return persisted.until == engine.now and all(balls[i].is_on_table for i in hit.balls)

    def hears(self) -> tuple[bool, bool]:
        """Tell whether anybody hears of contacts and pockets, and whether of stops."""
        is_heard = [self.of(name) is not None for name in ("on_contact", "on_pocket", "on_stop")]
        return is_heard[0] or is_heard[1], is_heard[2]

    @property
    def least_heard(self) -> float:
        """The speed (m/s) below which nobody hears of hits; infinite if nobody hears of any."""
        return math.inf if self.of("on_contact") is None else self.least_closing

    # -- the instant is over ---------------------------------------------------------------------

    def tell_all(self) -> None:
        """Call the callbacks of this instant, and keep their errors for the step's end."""
        state, pending, self.pending = self.state, self.pending, []
        self._refuse_to_go_on_for_ever(pending[0][0])
        stepped, has_told = state.show_instant(), False
        for name, said, paths in pending:
            callback = self.of(name)
            if callback is None:
                continue
            if has_told:  # The callback before this one may have changed paths.
                state.show_instant()
            has_told = True
            for ball, path in paths.items():
                ball.before = path
            state.phase, self._before = Phase.TELLING, state.bodies.read()
            try:
                try:
                    callback(*said)
                finally:
                    self.follow()
            except Exception as error:
                state.note(error)
            finally:
                state.phase = Phase.ANSWERING
                for ball in paths:
                    ball.before = None
        state.show_step(stepped)

    def _refuse_to_go_on_for_ever(self, name: str) -> None:
        """Refuse a callback that makes contact after contact at one time."""
        t, many = self._told
        self._told = self.state.now, many + 1 if self.state.now == t else 1
        if many >= MOST_TOLD:
            self._told = -math.inf, 0
            message = f"was called {many} times at {t:g} s, because each call makes another contact"
            raise setting_error(name, shown(self.of(name)), message)

    def follow(self) -> None:
        """Follow what the present callback has done directly to bodies."""
        state, before = self.state, self._before
        now = state.bodies.read()
        if now.is_same(before):
            return
        if not now.has_all_of(before):
            state.follow_removals()
        self._before = now
        for ball in state.on_table():
            move = now.moves[ball.body_id]
            known = state.carried.get(ball) or before.moves.get(ball.body_id, move)
            if move[:4] == known[:4]:
                continue
            check_sound(ball, move, state.end_of_step())
            there, goes = move[:2], move[2:4]
            place = None
            if there != known[:2]:
                place = state.room_for(ball, there, state.discs(without=ball))
            state.send(ball, place, None if goes == known[2:4] else goes)


class Steps(WatchedState):
    """These are the steps and the state of a table whose space has nothing else in it."""

    def __init__(
        self, engine: ContactEngine, near: BroadPhase, max_dt: float, joints: bool, table: object
    ) -> None:
        super().__init__(engine, near, max_dt, joints)
        self.callbacks = engine.recorder = Callbacks(self, table)
        self._pymunk_step = self.space.step
        vars(self.space)["step"] = self.step_of_space

    def follow(self) -> None:
        self.callbacks.follow()

    def set_out(self, balls: Collection[TableBall]) -> None:
        self.callbacks.note_ends()
        super().set_out(balls)

    @property
    def pair_as_said(self) -> Callable[[int, int], Pair]:
        """The pair that the user has given the table."""
        return self.callbacks.of("_said_pair")  # type: ignore[no-any-return]

    def step_of_space(self, dt: float) -> None:
        """Do what ``space.step(dt)`` does from now on."""
        raise setting_error("alone", True, "the space is the table's own: call table.step(dt)")

    def refuse_in_step(self, call: str, value: object = "in a step") -> None:
        """Refuse a call that is for the time between two steps."""
        if self.phase is not Phase.BETWEEN:
            raise setting_error(call, value, "wait until the present step is over")

    def step(self, dt: float | None) -> None:
        """Make one step (s), by default as long as the last one."""
        self.refuse_in_step("step")
        self._follow_all()
        is_other = dt is not None and dt != self.dt
        if dt is not None and is_other:
            check_step(dt, self.max_dt)
            self.set_clock(self.time, float(dt))
            self.carry_all()
        self._make_steps(1)
        if is_other:
            self.carry_all()
        self.look()
        self.raise_noted()

    def play(self, on_time: Callable[[float], object] | None, latest: float) -> None:
        """Step until everything rests, until ``latest``, or until nothing more may happen."""
        self.refuse_in_step("play")
        self._follow_all()
        engine, self.latest, self.wake = self.engine, latest, -math.inf  # A strike may have come.
        while self.time < latest and (
            self.moving
            or engine.upcoming() <= self.time
            or (latest < math.inf and self.walls.are_moving)
        ):
            # Unless sensors touch, nothing is due in at least this many steps.
            is_bare = self.has_joints and not self.damped
            bare = (min(self.wake, latest) - self.time) / self.dt if is_bare else 0.0
            self._make_steps(1 + int(max(0.0, min(bare * (1.0 - HAIR), MOST_QUIET))))
            self.raise_noted()
            if on_time is not None:
                before = self.bodies.read()
                on_time(self.time)
                if not before.is_same(self.bodies.read()):
                    self._follow_all()
            if engine.is_over or not engine.is_finite:
                self.time = engine.now
                self.stop_balls()
                break
        self.latest = math.inf

    def _follow_all(self) -> None:
        """Follow what somebody has done since the last step, and refuse what acts in a step."""
        self.catch_up()
        self.refuse_changes()
        self.put_back_joints()
        acting: dict[str, object] = {
            f"ball {ball.number}: force": force for ball, force in self.forces.items()
        }
        acting |= {"gravity": self.space.gravity, "damping": self.space.damping}
        number = self.steps % max(len(self.balls), 1)  # One ball a step is looked at.
        for ball in self.balls[number : number + 1]:
            for key, usual in USUAL.items():
                if getattr(ball.body, key) not in (usual, self._damp):
                    acting[f"ball {ball.number}: {key}"] = "a function of your own"
        for key, value in acting.items():
            if value not in (NOTHING, 1.0):
                raise setting_error(key, value, f"acts on no ball {ALONE}")
        own = len(self.ball_of) + len(self.walls.obstacles), self.joints
        for key, count in zip(("shapes", "constraints"), own, strict=True):
            there = len(getattr(self.space, key))
            if there != count:
                message = f"{count} of them are the table's, and others act on no ball {ALONE}"
                raise setting_error(f"space.{key}", there, message)

    def _make_steps(self, count: int) -> None:
        """Step the space until two sensors touch, but at most ``count`` times."""
        dt, quiet = self.dt, 0
        if self.walls.movers:
            self.make_room()
            count = 1
        self.begin_step()
        try:
            self._pymunk_step(dt)
            while quiet < count - 1 and not self.near.pairs and self.error is None:
                self._pymunk_step(dt)
                quiet += 1
            if quiet:
                self.tick(quiet)
            began = self.time
            self.tick()
            if self.time >= self.wake or self.near.pairs or self.sent:
                self.answer(began)
        finally:
            self.walls.finish()
            self.phase = Phase.BETWEEN

    def answer(self, began: float) -> None:
        """Answer the contacts and stops of the step that ``began`` at this time (s)."""
        engine, near = self.engine, self.near
        if engine.has_loop:
            engine.now = began
            engine.loop.resume(self.time)
        if near.pairs or self.sent or engine.upcoming() <= self.time:
            engine.now, near.until = began, self.time
            is_ours = engine.recorder is self.callbacks
            if engine.loop is None and contacts.LOOPS and is_ours:
                engine.loop = contacts.LOOPS[0](engine, self)
            near.foresee()
            try:
                self._play_instants()
            except Exception:  # A law or pair has failed: the table stands at this contact.
                engine.turn_back(engine.now)
                self.set_clock(engine.now, self.dt)
                self.sent = [*self.moving, *(near.changed.keys() - self.moving.keys())]
                self.wake = -math.inf
                self.carry_all()
                raise
            finally:
                for i in near.changed:
                    self.carry(self.balls[i])
                near.settle()
        ahead = 0.0 if self.alone else self.max_dt  # Other bodies see how a ball stops.
        if self.time + ahead >= self.next_stop:
            self.stop_balls()
        self.wake = min(engine.upcoming(), self.next_stop - (1.0 + HAIR) * ahead)

    def _play_instants(self) -> None:
        """Play the instants of this step, and call the callbacks after each."""
        engine, callbacks, self.phase = self.engine, self.callbacks, Phase.ANSWERING
        try:
            if callbacks.pending:
                callbacks.tell_all()
            if self.sent:
                sent, self.sent = dict.fromkeys(self.sent), []
                engine.predict([i for i in sent if self.balls[i].is_on_table])
            while engine.upcoming() <= self.time and engine.is_finite and not engine.is_over:
                engine.play(self.time)
                if self.near.gone:
                    self.take_out_gone()
                if engine.groups.persisted and engine.upcoming() > engine.now:
                    for hit in callbacks.note_ends():
                        engine.tell(hit)
                if callbacks.pending:
                    callbacks.tell_all()
        finally:
            self.phase = Phase.STEPPING
            callbacks.pending.clear()
