"""This module holds what both exact solvers need: a scene's walls, and a trace of the engine."""

from __future__ import annotations

from collections.abc import Collection

from pool_pymunk.engine.contacts import ContactEngine, Tally
from pool_pymunk.engine.decisions import CONTACT_TIME, LISTED
from pool_pymunk.engine.recorder import Doubt, Motion, Recorder
from pool_pymunk.model import Scene
from pool_pymunk.physics.collapse import Collapse
from pool_pymunk.physics.contact import Contact, Vector
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.sides import Wall, pocket
from pool_pymunk.results.trace import COLLAPSE, NONE, ONE_INSTANT, PERSISTENT, ZERO_SLIP, Trace
from pool_pymunk.solvers.record import NEVER_SETTLES, Settings


def walls(scene: Scene) -> list[Wall]:
    """Return the scene's cushions and posts as walls."""
    return list(scene.cushions)


def pockets(scene: Scene) -> list[Wall]:
    """Return the scene's pockets: walls that take balls in."""
    return [pocket(hole.position, hole.radius, k) for k, hole in enumerate(scene.pockets)]


def begin(trace: Trace, engine: ContactEngine, settings: Settings) -> None:
    """Write down how the balls set off, and give the engine its variant and its bounds."""
    for breakpoints, path in zip(trace.knots, engine.paths, strict=True):
        breakpoints[0] = (*breakpoints[0][:5], path.ax, path.ay, *breakpoints[0][7:])
    engine.tally = Tally(settings.most, NEVER_SETTLES)
    engine.vary(settings.variant, settings.measures_policies, settings.touch)


def cut_off(trace: Trace, engine: ContactEngine, t: float) -> None:
    """Write down where the balls are that still move when the run ends at ``t`` (s)."""
    if trace.status == "settled":
        return
    trace.duration = t
    if engine.tally.is_given_up:
        trace.warn(
            f"the run was given up after {engine.tally.unlisted} instants with micro-collisions "
            "only, which are no events: surface friction presses balls together",
            t,
        )
    for i, path in enumerate(engine.paths):
        if path.end > t or trace.knots[i][-1][3:5] != NONE:
            x, y, vx, vy = motion_at(path, t)
            pull, roll = (path.ax, path.ay), engine.surface.roll(path, t)
            trace.breakpoint(i, t, (x, y), (vx, vy), pull if path.end > t else NONE, roll)


class TraceRecorder(Recorder):
    """This recorder writes a :class:`~pool_pymunk.results.trace.Trace` of what happens."""

    def __init__(self, scene: Scene, trace: Trace, law: Law) -> None:
        self.scene, self.trace, self.law = scene, trace, law

    def contact(self, contact: Contact, t: float) -> None:
        if contact.cushion is None:
            self.trace.ball_ball(t, contact.a, contact.b)
        else:
            self.trace.ball_cushion(t, contact.a, contact.cushion)

    def path(self, i: int, path: Path) -> None:
        self.trace.path(i, path)

    def roll(self, i: int, path: Path) -> None:
        self.trace.roll(i, path.t)

    def stop(self, i: int, t: float, position: Vector) -> None:
        self.trace.stop(i, t, position)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        self.trace.pocketed(i, t, pocket, motion, center)

    def stop_revoked(self, i: int, t: float) -> None:
        self.trace.forget_stop(i, t)

    def zero_slip(self, contact: Contact, t: float) -> None:
        text = (
            f"law {self.law.name} jumps at zero slip: in the head-on hit of balls "
            f"{self._balls([contact], ' and ')} the slip was below 1e-9 of the closing speed and "
            "was taken for zero (no friction); rounding would have decided"
        )
        self._warn(ZERO_SLIP, text, t)

    def persistent(self, contact: Contact, t: float) -> None:
        presses = f"surface friction presses balls {self._balls([contact])} together"
        if contact.cushion is not None:
            what = "an arc" if contact.curvature < 0.0 else "its roll"
            presses = f"{what} presses ball {self._balls([contact])} to a cushion"
        text = (
            f"{presses}: instead of a collapse there is one hit in each contact time (at most "
            f"{CONTACT_TIME:g} of the time since the first hit or until rest)"
        )
        self._warn(PERSISTENT, text, t)

    def no_end(self, contacts: Collection[Contact], collapse: Collapse, t: float) -> None:
        text = (
            f"inelastic collapse of balls {self._balls(contacts)}: after {LISTED} hits "
            f"at one instant, {collapse.hits:,} more followed, which are not listed as events; "
        )
        if collapse.is_over:
            self.trace.warn(text + "they were played until nothing closes", t)
        else:
            text += (
                "they did not come to an end, so the rest is one plastic hit without friction, "
                "which changed velocities by up to {figure} m/s"
            )
            self._warn(COLLAPSE, text, t, collapse.forced)

    def order_unknown(self, doubt: Doubt, t: float) -> None:
        self.trace.orders.update(dict.fromkeys(doubt.orders))
        self.trace.spread = max(self.trace.spread, doubt.spread)
        text = (
            "contacts of one instant share a ball: in a real rack their order decides, and nothing "
            "tells it; if they came one after the other, velocities would differ by up to "
            "{figure} m/s"
        )
        self._warn(ONE_INSTANT, text, t, doubt.spread)

    def _warn(self, policy: str, text: str, t: float, figure: float = 0.0) -> None:
        self.trace.policies.add(policy)
        self.trace.warn(text, t, figure)

    def _balls(self, contacts: Collection[Contact], between: str = ", ") -> str:
        numbers = sorted({i for contact in contacts for i in contact.balls})
        return between.join(self.scene.balls[i].id for i in numbers)
