"""This module knows the solvers by name, checks the request for a run, and plays the run."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.core.record import POCKET
from pool_pymunk.laws import LAWS, Law
from pool_pymunk.model import Scene, Shot, State
from pool_pymunk.model.outline import NEVER_RESTS
from pool_pymunk.model.plain import (
    Reader,
    Value,
    argument,
    check_choice,
    read_law,
    size,
    whole,
)
from pool_pymunk.model.problems import listed, setting_error, shown, suggestion
from pool_pymunk.results.persistent import contacts_of
from pool_pymunk.results.run import Run, lifted, made_later, read_times
from pool_pymunk.results.trace import NEVER_SETTLES, ZERO_SLIP, Trace
from pool_pymunk.results.variants import Variant
from pool_pymunk.results.words import counted
from pool_pymunk.solvers.again import Again
from pool_pymunk.solvers.frozen import DECIDED, touching
from pool_pymunk.solvers.record import CONTACT_TOLERANCE, OnTime, Settings, Solver
from pool_pymunk.solvers.registry import PYMUNK
from pool_pymunk.solvers.registry import SOLVERS as SOLVERS

# of the energy at the start; a smaller gain of a contact is rounding, which gains 1e-15
GAINED = 1e-9
# what the scene asks for, and a solver does not do
NO_ROLLS = (
    "does not roll balls, and the scene has friction.rolling (these do: {}; without this key balls "
    "only slide, with every solver)"
)
NO_PATCHES = "does not play patches, and the scene has some (these do: {})"
NO_TILT = "does not let balls fall, and the table has a tilt (these do: {})"
# s; a run that took longer, or is a crowd's, is not played again to measure its policies
QUICK = 2.0


def find_solver(name: str) -> Solver:
    """Return the solver of that name."""
    if not isinstance(name, str) or name not in SOLVERS:
        known = f"({', '.join(SOLVERS)}){suggestion(name, SOLVERS)}"
        raise setting_error("solver", name, f"there is no such solver {known}")
    return SOLVERS[name]


def options_for(solver: Solver, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that a solver takes, and those that no solver takes, to be refused."""
    found = {}
    for key, value in options.items():
        takers = [each for each in SOLVERS.values() if value in each.options.get(key, ())]
        if solver in takers or not takers:
            found[key] = value
    return found


def reference_solver() -> Solver:
    """Return the exact solver without a step, with which the others are compared."""
    return next(solver for solver in SOLVERS.values() if solver.is_reference)


class Request(NamedTuple):
    """A request is a run that is asked for, in plain Python values; ``times`` (s) are sampled."""

    scene: Scene
    solver: Solver
    options: Mapping[str, str]
    settings: Settings
    times: tuple[float, ...] | None = None

    @property
    def law(self) -> str:
        """Return the name of the law that answers; a solver with a law of its own gives its own."""
        if self.solver.own_law:
            return self.solver.name
        return str(self.settings.law_of(self.scene).name)

    def play(self, shot: Shot | None, start: State | None = None) -> Run:
        """Simulate a shot from ``start``; by default from the scene's own, or as the shot says."""
        scene, settings = self.scene, self.settings
        state = self.start(shot, start)
        drifts = settings.max_time is None and not scene.always_rests
        moves = any(v != (0.0, 0.0) for v in (*state.velocity, *(state.roll or ())))
        if drifts and (scene.is_tilted or moves):
            friction = "rolling" if scene.surface.rolls else "surface"
            never = f"without {friction} friction the balls of this start never come to rest"
            never = NEVER_RESTS if scene.is_tilted else never
            raise setting_error("max_time", None, f"is missing: {never}")
        self.solver.load()
        began = time.perf_counter()
        again = Again(scene, self.solver, self.options, settings, state)
        trace = again.play()
        wall_time = time.perf_counter() - began
        if trace.status == "max_events":  # Variants end when the run does.
            again = again._replace(settings=settings._replace(max_time=trace.duration))
        shift = _policy_shift(again, trace, wall_time)
        if not self.solver.own_law and not settings.law_of(scene).hits_are_coulombs:
            if trace.status == "non_finite" and self.law not in LAWS:
                text = f"a number was not finite: see what the law {self.law} returned"
                trace.warn(text, trace.duration)
            warn_of_gained_energy(trace, scene, self.law)
        return self._run(shot, again, trace, wall_time, shift)

    def start(self, shot: Shot | None, before: State | None = None) -> State:
        """Return the state at the moment of a shot, which may go on from the end of another."""
        if before is None and shot is not None and shot.from_previous:
            bounds = self.settings._replace(max_time=self.scene.physics.max_time)
            alone = self._replace(settings=bounds, times=None)
            before = alone.play(shot_before(self.scene, shot)).end
        return self.scene.start(shot, before)

    def _run(
        self, shot: Shot | None, again: Again, trace: Trace, wall_time: float, shift: float | None
    ) -> Run:
        ids = tuple(self.scene.index)
        taken = [ids[balls[0]] for _, kind, balls, _, _ in trace.events if kind == POCKET]
        run = Run(
            scene=self.scene,
            shot=shot,
            solver=self.solver.name,
            law=self.law,
            dt=self.settings.dt,
            knots=(),
            events=(),
            status=trace.status,
            duration=trace.duration,
            steps=trace.steps,
            warnings=trace.warnings,
            wall_time=wall_time,
            sample_times=self.times,
            off=again.start.off.union(taken),
            policies=frozenset(trace.policies),
            persistent=contacts_of(trace.persisted, ids),
            contact_tolerance=self.settings.contact_tolerance if self.solver.to_tolerance else None,
            known_shift=shift,
            variants=trace.variants,
            again=again if self.solver.engine else None,
            law_used=None if self.solver.own_law else self.settings.law_of(self.scene),
        )
        return made_later(run, trace)


def _policy_shift(again: Again, trace: Trace, wall_time: float) -> float | None:
    """Warn of how far (m) other answers of policies would move the ends; return it if known."""
    scene, moves = again.scene, dict[Variant, float]()
    measures = again.settings.measures_policies and again.solver.engine
    is_measured = measures and wall_time <= QUICK and not trace.is_crowded
    touches = trace.instants or (is_measured and len(touching(scene, again.start)))
    is_open = measures and bool(touches)
    if not (is_open or trace.policies):
        return 0.0
    narrow = again.moves(trace, trace.nudges(0), moves)
    if is_open and (not is_measured or any(move > DECIDED for move in narrow)):
        trace.order_decides()
    if not trace.policies:
        return 0.0
    if trace.policies == {ZERO_SLIP} or not is_measured:
        return None  # A zero slip has its own warning.
    changed, sure = 0.0, 1.0
    variants = trace.variants
    for variant, move in zip(variants, again.moves(trace, variants, moves), strict=True):
        changed, sure = max((changed, sure), (variant.sure * move, variant.sure))
        if changed > scene.diagonal:  # A larger shift is not reported.
            break
    shift, said = min(changed, scene.diagonal), ""
    if shift < changed:
        said = " (the diagonal of the table)"
    elif sure > 1.0:
        said = f" ({sure:g} times as far as those that were tried)"
    trace.warn(
        f"some contacts have no exact answer ({', '.join(sorted(trace.policies))}). With other "
        f"answers the ends may lie up to {scene.units.text(shift)} elsewhere{said}",
        trace.duration,
    )
    return shift


def with_law(scene: Scene, law: str) -> Scene:
    """Return a scene with the law of this name; the scene keeps it."""
    known = scene.found.get((with_law, law))
    if known is None:
        known = replace(scene, physics=replace(scene.physics, law=law))
        scene.found[with_law, law] = known
    assert isinstance(known, Scene)
    return known


def request(
    scene: Scene,
    solver: str | None = None,
    *,
    dt: object = None,
    law: str | Law | None = None,
    times: object = None,
    max_time: object = None,
    max_events: object = None,
    on_time: OnTime | None = None,
    contact_tolerance: object = None,
    compiled: bool = True,
    **options: Any,
) -> Request:
    """Check what a run is asked for, as :func:`~pool_pymunk.simulate_all` takes it.

    By default the reference solver plays it.
    """
    _check_scene(scene)
    method = reference_solver() if solver is None else find_solver(solver)
    if method is PYMUNK and "contacts" in options:
        from pool_pymunk.world.checks import refuse_contacts

        refuse_contacts(options.pop("contacts"), stacklevel=4)
    for key, value in options.items():
        if key not in method.options:
            known = ", ".join(method.options) or "it has none"
            raise setting_error(key, value, f"{method.name} has no such option ({known})")
        check_choice(key, value, method.options[key])
    if law is not None and read_law(law) and method.own_law:
        message = f"{method.name} has a law of its own and cannot take another"
        raise setting_error("law", read_law(law).name, message)
    for can, is_asked, message in (
        ("rolls", scene.surface.rolls, NO_ROLLS),
        ("patches", scene.patches, NO_PATCHES),
        ("tilts", scene.is_tilted, NO_TILT),
    ):
        if is_asked and not getattr(method, can):
            others = ", ".join(name for name, other in SOLVERS.items() if getattr(other, can))
            raise setting_error("solver", method.name, message.format(others))
    if isinstance(law, str) and law != scene.physics.law:
        scene = with_law(scene, law)
    step, latest = _given("dt", dt, size), _given("max_time", max_time, size)
    left_out = _given("contact_tolerance", contact_tolerance, size)
    settings = Settings(
        dt=None if method.dt is None else step or method.dt,
        max_time=latest or scene.physics.max_time,
        max_events=_given("max_events", max_events, whole(1)) or NEVER_SETTLES,
        law=law if isinstance(law, Law) else None,
        on_time=on_time,
        contact_tolerance=left_out or CONTACT_TOLERANCE,
    )
    at = None if times is None else read_times(times)
    if at is not None and at.ndim != 1:
        raise setting_error("times", shown(times), "must be a sequence of numbers")
    return Request(scene, method, options, settings, None if at is None else tuple(at.tolist()))


def find_shot(scene: Scene, shot: Shot | str | int | None) -> Shot | None:
    """Return the scene's shot of that name or number (from 1), or this one; None: the first."""
    _check_scene(scene)
    if shot is None:
        return scene.shots[0] if scene.shots else None
    if isinstance(shot, bool) or not isinstance(shot, Shot | str | Integral):
        raise setting_error("shot", shot, "must be a Shot, a name or a number from 1")
    for k, each in enumerate(scene.shots, start=1):
        if shot in (each, each.name, k):
            return each
    if isinstance(shot, Integral) and shot < 1:
        raise setting_error("shot", shot, "shots count from 1")
    meant = suggestion(shot, [each.name for each in scene.shots])
    if isinstance(shot, Shot) or not scene.shots:
        meant = "; replace(scene, shots=(Shot(...),)) gives a scene its shots"
    known = listed([f"{k} ({each.name})" for k, each in enumerate(scene.shots, start=1)]) or "none"
    raise setting_error("shot", shot, f"there is no such shot (there are: {known}){meant}")


def shot_before(scene: Scene, shot: Shot) -> Shot | None:
    """Return the shot that this one goes on from, if it does."""
    return scene.shots[scene.shots.index(shot) - 1] if shot.from_previous else None


def _check_scene(scene: Scene) -> None:
    if not isinstance(scene, Scene):
        raise setting_error("scene", scene, "must be a Scene, such as load() gives")


def _given(key: str, value: object, read: Reader[Value]) -> Value | None:
    """Read an argument, if it is given."""
    return None if value is None else argument(key, value, read)


def warn_of_gained_energy(trace: Trace, scene: Scene, law: str) -> None:
    """Warn if a law added kinetic energy: how much, how often, and where first."""
    initial, changes = 0.0, dict[float, float]()  # J, by time
    if scene.is_tilted:
        initial = float(lifted(scene, np.array([rows[0][1:3] for rows in trace.knots])).sum())
    for ball, rows in zip(scene.balls, trace.knots, strict=True):
        half, (vx, vy) = 0.5 * ball.mass, rows[0][3:5]
        initial += half * (vx * vx + vy * vy)
        for row, after in pairwise(rows):
            t, ux, uy = after[0], after[3], after[4]
            time = t - row[0]
            vx, vy = row[3] + time * row[5], row[4] + time * row[6]
            change = half * (ux * ux + uy * uy - vx * vx - vy * vy)
            changes[t] = changes.get(t, 0.0) + change
    gains = {t: gain for t, gain in changes.items() if gain > GAINED * initial}
    if gains and initial > 0.0:  # What only rolls has none yet.
        first = min(gains)
        each = zip(scene.balls, trace.knots, strict=True)
        who = [b.id for b, rows in each if any(row[0] == first for row in rows[1:])]
        trace.warn(
            f"law {law} added energy in {counted(len(gains), 'contact')}: "
            f"{100.0 * sum(gains.values()) / initial:.3g} % of the energy at the start. This is a "
            "fault of the law, not of the solver. The first was that of "
            f"ball{'s' * (len(who) > 1)} {', '.join(who)}",
            first,
        )
