"""Solvers that play by the core share how a run is listened to, and what is kept of it."""

from __future__ import annotations

import gc
import math
from collections.abc import Callable

from pool_pymunk.core.batch import Shots
from pool_pymunk.core.engine import NEVER_SETTLES, Engine
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.persistent.groups import persistence_of
from pool_pymunk.core.record import Record, Recorder
from pool_pymunk.core.table import Table
from pool_pymunk.core.variant import Errors
from pool_pymunk.laws import Law, law_in_core
from pool_pymunk.model import Scene, State
from pool_pymunk.results.persistent import warn_of_persisted
from pool_pymunk.results.trace import COLLAPSE, NONE, ZERO_SLIP, Trace
from pool_pymunk.results.variants import Variant
from pool_pymunk.results.words import without_slip
from pool_pymunk.solvers.in_core import balls_of, floor_of, new_balls, table_of
from pool_pymunk.solvers.record import CONTACT_TOLERANCE, OnTime, Settings

# as the engine counts them, and a batch
ENDINGS = ("settled", "max_time", "max_events", "non_finite", "cannot_start")
VISIBLE = 1e-3  # radii; balls that overlap by less do so by less than a pixel of a picture
LISTED = 100  # hits at one instant; more are a collapse, whose hits are no events


class Listener(Record):
    """This record writes into a trace, and lets others do something now and then."""

    def __init__(self, trace: Trace, on_time: OnTime | None) -> None:
        super().__init__(trace.knots, bool(trace.no_roll))
        self.on_time = on_time

    def pause(self, t: float) -> None:
        if self.on_time is not None:
            self.on_time(t)


def pull_of(path: Path) -> tuple[float, float]:
    """Return the acceleration (m/s^2) on a path."""
    return path.ax, path.ay


def engine_of(scene: Scene, start: State, law: Law, tolerance: float | None) -> Engine:
    """Return an engine that has a scene's balls on their first paths."""
    table = table_of(scene)
    balls = balls_of(scene, start, table)
    persistence = persistence_of(table, balls, tolerance or CONTACT_TOLERANCE)
    engine = Engine(table, balls, law_in_core(law), Recorder(), persistence)
    for id_ in start.off:
        i = scene.index[id_]
        engine.remove(balls[i], start.position[i])
    return engine


def shots_of(scene: Scene, settings: Settings, table: Table | None = None) -> Shots:
    """Return what plays shots of a scene one after the other, on its table or on another one."""
    table, law = table or table_of(scene), law_in_core(settings.law_of(scene))
    shots = Shots(table, new_balls(scene), law, floor_of(scene))
    shots.engine.most_events = settings.max_events
    shots.latest = math.inf if settings.max_time is None else settings.max_time
    shots.tolerance = settings.contact_tolerance * settings.variant.coarser
    return shots


def play(
    engine: Engine,
    scene: Scene,
    start: State,
    settings: Settings,
    advance: Callable[[float], object],
) -> Trace:
    """Return the trace of a run that ``advance`` plays with the engine, up to a time (s)."""
    trace = Trace(start, [pull_of(ball.path) for ball in engine.balls])
    record = engine.recorder = Listener(trace, settings.on_time)
    engine.errors = errors_of(settings.variant)
    engine.most_events = settings.max_events
    latest = math.inf if settings.max_time is None else settings.max_time
    is_collecting = gc.isenabled()
    gc.disable()  # A run leaves no circles of references.
    try:
        advance(latest)
    finally:
        if is_collecting:
            gc.enable()
    keep(trace, engine, record, latest)
    tell(trace, record, scene, settings.law_of(scene))
    return trace


def errors_of(variant: Variant) -> Errors:
    """Return the errors of a variant."""
    errors = Errors()
    if variant.nudge is not None:
        errors.kick(variant.nudge)
    elif variant.seed is not None:
        errors.round_off(variant.seed)
    if variant.slip is not None:
        errors.slip = variant.slip
    return errors


# -- what is kept of a run -------------------------------------------------------------------------


def keep(trace: Trace, engine: Engine, record: Record, latest: float) -> None:
    """Keep how a run has ended, and where the balls are that still move then."""
    trace.events = list(record.events)
    trace.instants = record.instants
    trace.duration = record.duration
    trace.steps = engine.answered
    trace.status = ENDINGS[engine.end(latest)]
    if trace.status == "settled":
        trace.persisted = engine.persistence.persisted(engine)
        return
    t = engine.now
    if engine.idle >= NEVER_SETTLES:
        trace.warn(
            f"the run was given up after {engine.idle} instants without an event, "
            "because surface friction presses balls together",
            t,
        )
    trace.duration = t
    trace.persisted = engine.persistence.persisted(engine)
    for ball, rows in zip(engine.balls, trace.knots, strict=True):
        path = ball.path
        if path.end > t or rows[-1][3:5] != NONE:
            (x, y, vx, vy), roll = engine.motion_of(ball)
            pull = pull_of(path) if path.end > t else NONE
            trace.breakpoint(ball.number, t, (x, y), (vx, vy), pull, roll)


def tell(trace: Trace, record: Record, scene: Scene, law: Law) -> None:
    """Put what no event says into words."""
    ids, crowded = [ball.id for ball in scene.balls], record.crowded
    if trace.persisted:
        presses = "gravity" if scene.is_tilted else "surface friction, a roll or an arc"
        warn_of_persisted(trace, ids, presses)
        if law.name != "coulomb":
            first = min(row[3] for row in trace.persisted)
            trace.warn("contacts that persist have the friction of the law coulomb", first)
    if crowded is not None:
        trace.is_crowded = True
        until = min(crowded.until, trace.duration)
        overlap = f", and overlap by up to {crowded.overlap:.1g} radii"
        trace.warn(
            f"up to {crowded.balls} balls hit each other over and over: until {until:.6g} s they "
            f"go on by steps of up to {1e3 * crowded.step:.2g} ms, "
            f"so that their ends are not exact{overlap if crowded.overlap >= VISIBLE else ''}",
            crowded.since,
        )
    for note in record.notes:
        balls = [ids[i] for i in note.balls]
        if note.hits is None:
            trace.warn(
                without_slip(law.name, f"the hit of balls {' and '.join(balls)}"),
                note.t, ZERO_SLIP,
            )  # fmt: skip
            continue
        text = (
            f"inelastic collapse of balls {', '.join(balls)}: after {LISTED} hits at one "
            f"instant {note.hits:,} more followed, which are no events"
        )
        if not note.is_over:
            text += ". The rest is one plastic hit without friction"
        trace.warn(text, note.t, None if note.is_over else COLLAPSE)
