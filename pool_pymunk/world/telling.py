"""This module tells the callbacks of a table what the engine does, and follows what they do."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pool_pymunk.engine.recorder import Motion, Recorder
from pool_pymunk.physics.contact import Contact, Vector, closing_speed
from pool_pymunk.physics.path import Path
from pool_pymunk.world.ball import Ball, ContactEvent
from pool_pymunk.world.bodies import Bodies, Snapshot
from pool_pymunk.world.state import Phase, State

# This is a callback's name, what it is called with, and balls' paths before it.
Told = tuple[str, tuple[object, ...], dict[Ball, Path]]


class Callbacks(Recorder):
    """This recorder passes on to callbacks what happens, as soon as its instant is over.

    ``of(name)`` is the callback of this name, or None.
    """

    def __init__(self, state: State, of: Callable[[str], Callable[..., object] | None]) -> None:
        self.state = state
        self.of = of
        self.told: list[Told] = []  # what has happened in the present instant
        self._bodies = Bodies(state.space)
        self._before = Snapshot()  # how the bodies moved when the present callback was called

    # -- what happens ----------------------------------------------------------------------------

    def contact(self, contact: Contact, t: float) -> None:
        """Tell ``on_contact``."""
        if self.of("on_contact") is not None:
            state = self.state
            velocity = {i: state.engine.paths[i].at(t)[1] for i in contact.balls}
            closing = closing_speed(contact, velocity)
            balls = tuple(state.balls[i] for i in contact.balls)
            event = ContactEvent(t, balls, contact.cushion, contact.point, contact.normal, closing)
            self._tell("on_contact", event, balls=contact.balls)

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Tell ``on_stop``."""
        self._tell("on_stop", self.state.balls[i], t)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        """Tell ``on_pocket`` the ball, the number of the pocket, and the time (s)."""
        self._tell("on_pocket", self.state.balls[i], pocket, t)

    def stop_revoked(self, i: int, t: float) -> None:
        """Tell ``on_stop_revoked``, because the ball had not come to rest."""
        self._tell("on_stop_revoked", self.state.balls[i], t)

    def _tell(self, name: str, *said: object, balls: Sequence[int] = ()) -> None:
        """Call a callback later; the ``path`` of these balls is for it what it is now."""
        if self.of(name) is not None:
            paths = {self.state.balls[i]: self.state.engine.paths[i] for i in balls}
            self.told.append((name, said, paths))

    # -- the instant is over ---------------------------------------------------------------------

    def tell_all(self) -> None:
        """Call the callbacks of this instant; errors of theirs are kept to the step's end."""
        told, self.told = self.told, []
        for name, said, paths in told:
            callback = self.of(name)
            if callback is not None:
                self._call(callback, said, paths)

    def _call(
        self, callback: Callable[..., object], said: tuple[object, ...], paths: dict[Ball, Path]
    ) -> None:  # fmt: skip
        state = self.state
        for ball, path in paths.items():
            ball.before = path
        state.phase = Phase.TELLING
        self._before = self._bodies.read()
        try:
            callback(*said)
            self.follow()
        except Exception as error:
            state.note(error)
        finally:
            state.phase = Phase.ANSWERING
            for ball in paths:
                ball.before = None

    def follow(self) -> None:
        """Follow what the present callback has done to bodies itself."""
        state, now = self.state, self._bodies.read()
        if now == self._before:
            return
        state.drop_lost()
        before, moves = self._before.moves(), now.moves()
        for ball in state.on_table():
            x, y, vx, vy = moves[ball.id][:4]
            left = state.carried.get(ball) or before.get(ball.id, moves[ball.id])
            there = None if (x, y) == left[:2] else state.beside(ball, x, y)
            goes = None if (vx, vy) == left[2:4] else (vx, vy)
            if there is not None or goes is not None:
                state.send(ball, there, goes)
