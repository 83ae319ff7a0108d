"""What a solver is told beside the scene, the form all solvers share, and what they write down."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple, Protocol

from pool_pymunk.engine.contacts import ContactEngine, Recorder
from pool_pymunk.engine.decisions import CONTACT_TIME
from pool_pymunk.model import Scene, State
from pool_pymunk.physics.contact import Contact, Vector
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.physics.path import Path
from pool_pymunk.results.trace import Trace

NEVER_SETTLES = 1_000_000  # events after which a run is given up, unless the user says otherwise;
# and instants of micro-collisions, which are no events, after which it is given up in any case


class Settings(NamedTuple):
    """The time step (s; None for solvers without one), the bounds of a run, and its law.

    Without a ``law`` the scene's own, which it knows by name, answers the contacts.
    """

    dt: float | None
    max_time: float | None = None
    max_events: int | None = None
    law: Law | None = None

    def law_of(self, scene: Scene) -> Law:
        """The law that answers every contact of the run."""
        return self.law or LAWS[scene.physics.law]

    @property
    def most(self) -> int:
        """After how many events the run is given up."""
        return NEVER_SETTLES if self.max_events is None else self.max_events

    def bound(self, engine: ContactEngine) -> None:
        """Tell the contact engine when to stop."""
        engine.most, engine.most_unlisted = self.most, NEVER_SETTLES


class Solve(Protocol):
    """Every solver's form."""

    def __call__(self, scene: Scene, start: State, settings: Settings) -> Trace: ...


class TraceRecorder(Recorder):
    """Writes what the contact engine does into a :class:`~pool_pymunk.results.trace.Trace`."""

    def __init__(self, scene: Scene, trace: Trace, law: Law) -> None:
        self.scene = scene
        self.trace = trace
        self.law = law

    def contact(self, contact: Contact, t: float) -> None:
        """List a hit."""
        if contact.cushion is None:
            self.trace.ball_ball(t, contact.a, contact.b)
        else:
            self.trace.ball_cushion(t, contact.a, contact.cushion)

    def path(self, i: int, path: Path) -> None:
        """Write down where a new path begins."""
        self.trace.knot(i, path.t, path.position, path.velocity)

    def stop(self, i: int, t: float, position: Vector) -> None:
        """List a stop."""
        self.trace.stop(i, t, position)

    def stop_revoked(self, i: int, t: float) -> None:
        """Take a stop off the list."""
        self.trace.forget_stop(i, t)

    def zero_slip(self, contact: Contact, t: float) -> None:
        """Warn of a law that jumps at zero slip."""
        self.trace.warn(
            f"law {self.law.name} jumps at zero slip: in the head-on hit of "
            f"{self._balls([contact])} the slip was below 1e-9 of the closing speed and "
            "was taken for zero (no friction); rounding would have decided",
            t,
        )

    def persistent(self, contact: Contact, t: float) -> None:
        """Warn of balls that surface friction presses together."""
        self.trace.warn(
            f"surface friction presses {self._balls([contact])} together: their endless hits were "
            f"spread out to one in {CONTACT_TIME:g} of their stopping time",
            t,
        )

    def no_end(self, contacts: Collection[Contact], t: float) -> None:
        """Warn of hits without end."""
        self.trace.warn(
            f"inelastic collapse of {self._balls(contacts)}: hits without end at one instant were "
            "given their limit, no more closing",
            t,
        )

    def _balls(self, contacts: Collection[Contact]) -> str:
        numbers = sorted({i for contact in contacts for i in contact.balls})
        return "balls " + ", ".join(self.scene.balls[i].id for i in numbers)


def warn_if_given_up(engine: ContactEngine, trace: Trace) -> None:
    """Tell users that a run ended early, though its events are fewer than it may have."""
    if engine.is_given_up:
        trace.warn(
            f"the run was given up after {engine.unlisted} instants with micro-collisions only, "
            "which are no events: surface friction presses balls together",
            engine.now,
        )


def sign_warning(a: str, b: str, slip: float) -> str:
    """Tell users that the listing's arithmetic lets rounding decide."""
    return (
        f"law published jumps at zero slip: in the head-on hit of balls {a} and {b} the slip was "
        f"{slip:.0e} m/s, a rounding error, and its sign decided, as in the report"
    )
