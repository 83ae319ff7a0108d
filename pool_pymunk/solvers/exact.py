"""This module holds what both exact solvers need: a scene's pockets, and a trace of the engine."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from pool_pymunk.engine.contacts import ContactEngine, Tally
from pool_pymunk.engine.decisions import LISTED, NEVER_SETTLES
from pool_pymunk.engine.recorder import Persisted, Recorder
from pool_pymunk.model import Scene, State
from pool_pymunk.physics.collapse import Collapse
from pool_pymunk.physics.contact import Contact
from pool_pymunk.physics.impulses import Impulse
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.sides import Wall, pocket
from pool_pymunk.results.persistent import warn_of_persisted
from pool_pymunk.results.trace import COLLAPSE, NONE, ZERO_SLIP, Trace
from pool_pymunk.results.words import without_slip
from pool_pymunk.solvers.record import Settings

StateOf = Callable[[int], Sequence[float]]  # x, y (m), vx, vy, wx, wy (m/s) of a ball


def pockets(scene: Scene) -> list[Wall]:
    """Return the scene's pockets: walls that take balls in."""
    return [pocket(hole.position, hole.radius, k) for k, hole in enumerate(scene.pockets)]


def begin(scene: Scene, start: State, settings: Settings, engine: ContactEngine) -> EngineTrace:
    """Give the engine its variant and its bounds, and return the trace of its run."""
    trace = EngineTrace(scene, start, engine.paths, engine.law)
    engine.recorder = trace
    engine.tally = Tally(settings.max_events, NEVER_SETTLES)
    engine.vary(settings.variant)
    return trace


def cut_off(trace: EngineTrace, engine: ContactEngine, t: float) -> None:
    """Write down where the balls are that still move when the run ends at ``t`` (s)."""
    engine.now = t
    engine.tell_all()
    if engine.tally.unlisted >= NEVER_SETTLES and trace.status != "settled":
        trace.warn(
            f"the run was given up after {engine.tally.unlisted} instants without an event, "
            "because surface friction presses balls together",
            t,
        )
    trace.end_at(t, engine.paths, engine.state_of)


class EngineTrace(Trace, Recorder):
    """This trace listens to the contact engine, and words the warnings of its policies."""

    def __init__(self, scene: Scene, start: State, paths: Sequence[Path], law: Law) -> None:
        super().__init__(start, [path[5:7] for path in paths])
        self.scene, self.law = scene, law

    def end_at(self, t: float, paths: Sequence[Path], state_of: StateOf) -> None:
        """End the run at ``t`` (s), and write down where the balls are that still move."""
        self.warn_of_persisted()
        if self.status == "settled":
            return
        self.duration = t
        for i, path in enumerate(paths):
            if path.end > t or self.knots[i][-1][3:5] != NONE:
                x, y, vx, vy, wx, wy = state_of(i)
                pull = (path.ax, path.ay) if path.end > t else NONE
                self.breakpoint(i, t, (x, y), (vx, vy), pull, (wx, wy))

    def path(self, i: int, path: Path) -> None:
        """Ball ``i`` moves on along this path."""
        self.knots[i].append((*path[:7], *path[9:]) if self.no_roll else path[:7])

    def contact(self, contact: Contact, impulse: Impulse, t: float) -> None:
        if contact.cushion is None:
            self.ball_ball(t, contact.a, contact.b, impulse)
        else:
            self.ball_cushion(t, contact.a, contact.cushion, impulse)

    def zero_slip(self, contact: Contact, t: float) -> None:
        hit = f"the hit of balls {self._balls([contact], ' and ')}"
        self.warn(without_slip(self.law.name, hit), t, ZERO_SLIP)

    def persistent(self, persisted: Persisted) -> None:
        (a, b, _, _, cushion, *_), since, until, x, y = persisted
        self.persisted.append((a, b, -1 if cushion is None else cushion, since, until, x, y))

    def warn_of_persisted(self) -> None:
        """Warn once of each set of balls and cushions that contacts have joined."""
        warn_of_persisted(self, tuple(self.scene.index))

    def no_end(self, contacts: Collection[Contact], collapse: Collapse, t: float) -> None:
        text = (
            f"inelastic collapse of balls {self._balls(contacts)}: after {LISTED} hits at one "
            f"instant {collapse.hits:,} more followed, which are no events"
        )
        if not collapse.is_over:
            text += ". The rest is one plastic hit without friction"
        self.warn(text, t, None if collapse.is_over else COLLAPSE)

    def order_unknown(self, t: float) -> None:
        self.instants[t] = None

    def _balls(self, contacts: Collection[Contact], between: str = ", ") -> str:
        numbers = sorted({i for contact in contacts for i in contact.balls})
        return between.join(self.scene.balls[i].id for i in numbers)
