"""This module plays single runs by the compiled loop, where it is loaded in this process."""

from __future__ import annotations

import math
from functools import partial
from operator import is_
from threading import local
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.engine import asked, contacts
from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.policies import Errors, begin_errors
from pool_pymunk.engine.recorder import Persisted, Recorder
from pool_pymunk.fast.live import Loop
from pool_pymunk.fast.loop import OUT_OF_EVENTS, OUT_OF_TIME, PAUSED, SETTLED
from pool_pymunk.fast.press import Presses
from pool_pymunk.fast.records import (
    IN_COLLAPSE,
    IS_OVER,
    NOTHING,
    OUT,
    ROLL,
    STOP,
    WHOLE,
    Out,
    Shots,
    TableArrays,
    empty,
    tracks,
)
from pool_pymunk.fast.tables import (
    Form,
    can_compile,
    coefficients_of,
    cue_of,
    law_number,
    loop_form,
    put_patches,
    table_of,
    together_number,
)
from pool_pymunk.model import Scene, State
from pool_pymunk.physics.collapse import Collapse
from pool_pymunk.physics.contact import NO_BALL, Contact, Pair
from pool_pymunk.physics.impulses import Impulse
from pool_pymunk.physics.laws import NO_FRICTION, Law
from pool_pymunk.physics.path import Path
from pool_pymunk.solvers import grouped
from pool_pymunk.solvers.exact import EngineTrace, pockets
from pool_pymunk.solvers.record import Settings

STATUSES = {SETTLED: "settled", OUT_OF_TIME: "max_time", OUT_OF_EVENTS: "max_events"}
NO_PAIR = Pair(math.nan, math.nan, math.nan, math.nan)
NO_TRACKS = tracks(1, 0)

loaded: dict[Form, Any] = {}  # the compiled loops of this process
own = local()  # Each thread has its records.


def remember(form: Form, play: Any) -> None:
    """Let single runs of scenes of this form use a compiled loop from now on.

    Tables play their steps by it, and engines persistent contacts in whatever they play.
    """
    loaded[form] = play
    if not asked.PRESSES:
        asked.PRESSES.append(Presses(form, play))
    if not contacts.LOOPS:
        contacts.LOOPS.append(partial(Loop, loaded))
    if solve not in grouped.FASTER:
        grouped.FASTER.append(solve)


class SceneArrays(NamedTuple):
    """This is what all runs of a scene have in common."""

    form: Form
    knows: bool  # whether the compiled loop plays the scene
    table: TableArrays
    mass: Any
    radius: Any
    coefficients: Any
    cue: int


def arrays_of(scene: Scene) -> SceneArrays:
    """Return what all runs of a scene have in common; the scene keeps it."""
    found: SceneArrays | None = scene.found.get(SceneArrays)
    if found is None:
        form = loop_form(scene)
        balls, knows = scene.balls, can_compile(scene, Law())
        table = table_of(scene, form.differ) if knows else TableArrays(None, None, None, None)
        found = scene.found[SceneArrays] = SceneArrays(
            form, knows, table,
            np.array([[ball.mass for ball in balls]]), np.array([ball.radius for ball in balls]),
            np.array([coefficients_of(scene)]), cue_of(scene),
        )  # fmt: skip
    return found


def solve(scene: Scene, start: State, settings: Settings) -> EngineTrace | None:
    """Simulate exactly by the compiled loop; return None where it cannot."""
    law, arrays = settings.law_of(scene), arrays_of(scene)
    play, latest = loaded.get(arrays.form), settings.max_time
    is_known = arrays.knows and law_number(law) != NOTHING and together_number(law) != NOTHING
    if play is None or not is_known or (latest is None and not scene.always_rests):
        return None
    desk, balls = desk_of(arrays.form), len(scene.balls)
    desk.prepare(scene, settings)
    shots, out, kept = shots_of(scene, start), desk.out_of(balls), Kept()
    while True:
        play(desk.work, arrays.table, shots, out, NO_TRACKS, 0, 1)
        status = int(out.status[0])
        if status != PAUSED and status not in STATUSES:
            return None
        kept.take(desk)
        if status != PAUSED:
            return trace_of(scene, start, law, desk, kept)
        desk.scene["resumes"] = 1


class Desk:
    """A desk is the record in which a thread plays runs, with views of what it reads and writes."""

    def __init__(self, form: Form) -> None:
        self.work = array = np.zeros(1, dtype=form.work)
        self.scene, self.errors, self.ball = array["scene"][0], array["errors"][0], array["ball"][0]
        self.now, self.last = array["now"], array["last"][0]
        self.answered, self.duration = array["count"]["answered"], array["count"]["duration"]
        track = array["track"]
        # the numbers of rows, and the rows, of breakpoints, events, notes, and past contacts
        names = ("rows", "row"), ("events", "event"), ("notes", "note"), ("pasts", "past")
        self.tracks = [(track[many], track[one][0]) for many, one in names]
        self.outs: dict[int, Out] = {}
        self.prepared: tuple[object, ...] = ()

    def out_of(self, balls: int) -> Out:
        """Return arrays for the results of a run with so many balls."""
        if balls not in self.outs:
            self.outs[balls] = empty(1, balls)
        self.out = self.outs[balls]
        return self.out

    def prepare(self, scene: Scene, settings: Settings) -> None:
        """Write down how a run of a scene is to be played."""
        law, variant, latest = settings.law_of(scene), settings.variant, settings.max_time
        self.scene["resumes"] = 0
        its = scene, law, variant, latest, settings.max_events
        is_same = len(its) == len(self.prepared) and all(map(is_, its, self.prepared))
        if not is_same:
            values = {
                "kind": law_number(law), "together": together_number(law), "keeps": WHOLE,
                "balls": len(scene.balls), "walls": len(scene.cushions), "watched": NOTHING,
                "cue": arrays_of(scene).cue, "latest": math.inf if latest is None else latest,
                "most": settings.max_events, "coarser": variant.coarser,
                "slip": variant.slip or NO_FRICTION,
            }  # fmt: skip
            for key, value in values.items():
                self.scene[key] = value
            put_patches(self.work, scene.ground)
            self.prepared = its
        begin_errors(errors := Errors(), variant)
        for key, value in vars(errors).items():
            self.errors[key] = value


def desk_of(form: Form) -> Desk:
    """Return this thread's desk for scenes of a form."""
    name = f"desk{form.rolls:d}{form.many:d}"
    if not hasattr(own, name):
        setattr(own, name, Desk(form))
    found: Desk = getattr(own, name)
    return found


def shots_of(scene: Scene, start: State) -> Shots:
    """Return a start as the compiled loop takes it."""
    arrays = arrays_of(scene)
    is_off = np.array([[ball.id in start.off for ball in scene.balls]], np.int64)
    roll = np.empty((0, 0, 2)) if start.roll is None else np.array([start.roll])
    return Shots(
        np.array([start.position]), np.array([start.velocity]), roll, is_off, arrays.mass,
        arrays.radius, arrays.coefficients,
    )  # fmt: skip


class Kept:
    """This is what a run has kept so far: breakpoints, events, notes, and past contacts."""

    def __init__(self) -> None:
        self.rows: list[list[float]] = []
        self.events: list[list[float]] = []
        self.notes: list[list[float]] = []
        self.past: list[list[float]] = []

    def take(self, desk: Desk) -> None:
        """Take over what a track has."""
        lists = self.rows, self.events, self.notes, self.past
        for each, (many, rows) in zip(lists, desk.tracks, strict=True):
            each += rows[: many[0]].tolist()
            many[0] = 0


def trace_of(scene: Scene, start: State, law: Law, desk: Desk, kept: Kept) -> EngineTrace:
    """Return the trace of a run from what it has kept, as the engine would tell it."""
    balls, numbers = len(scene.balls), slice(1, 10 if start.roll is not None else 8)
    trace = EngineTrace(scene, start, (), law)
    for i, rows in enumerate(trace.knots):
        rows[0] = (*rows[0][:5], *kept.rows[i][6:8], *rows[0][7:])
    for row in kept.rows[balls:]:
        trace.knots[int(row[0])].append(tuple(row[numbers]))
    for t, one, other, *impulse, _ in kept.events:
        note_event(trace, t, int(one), int(other), impulse)
    note_all(trace, kept.notes)
    for contact in kept.past:
        trace.persistent(persisted_of(scene, contact))
    trace.steps, trace.status = int(desk.answered[0]), STATUSES[int(desk.out.status[0])]
    trace.duration = float(desk.duration[0])
    if trace.status == "settled":
        trace.warn_of_persisted()
        return trace
    t = trace.duration if trace.status == "max_time" else float(desk.now[0])
    last, paths = desk.last[:balls].tolist(), [path_of(ball) for ball in desk.ball[:balls]]
    trace.end_at(t, paths, last.__getitem__)
    return trace


def note_all(trace: EngineTrace, notes: list[list[float]]) -> None:
    """Take note of what warnings tell."""
    balls: list[Contact] = []
    for t, one, other in notes:
        contact = Contact(int(one), int(other), (0.0, 0.0), NO_PAIR)
        if one == NOTHING:
            trace.order_unknown(t)
        elif other >= 0:
            trace.zero_slip(contact, t)
        elif other == IN_COLLAPSE:
            balls.append(contact._replace(b=NO_BALL))
        else:
            trace.no_end(balls, Collapse(int(one), other == IS_OVER), t)
            balls = []


def note_event(trace: EngineTrace, t: float, i: int, other: int, impulse: list[float]) -> None:
    """Note an event of a ball: with another one, with a wall, or by itself."""
    cushions = len(trace.scene.cushions)
    if other >= 0:
        trace.ball_ball(t, i, other, Impulse(*impulse))
    elif other == ROLL:
        trace.roll(i, t)
    elif other <= OUT:
        trace.crossed(i, OUT - 1 - other, t)
    elif other == STOP:
        trace.events.append((t, "stop", (i,), None, None))
    elif -1 - other < cushions:
        trace.ball_cushion(t, i, trace.scene.cushions[-1 - other].number, Impulse(*impulse[:2]))
    else:
        trace.events.append((t, "pocket", (i,), -1 - other - cushions, None))


def path_of(ball: Any) -> Path:
    """Return the path of a ball's record."""
    t, x, y, vx, vy, ax, ay, end, slows = ball.tolist()[:9]
    return Path(t, x, y, vx, vy, ax, ay, end, bool(slows), 0.0, 0.0)


def persisted_of(scene: Scene, one: list[float]) -> Persisted:
    """Return a persistent contact that is over, as the engine tells it."""
    (i, other), (since, until, x, y), places = map(int, one[:2]), one[2:6], one[6:]
    place = {i: (places[0], places[1])}
    if other >= 0:
        place[other] = places[2], places[3]
    else:  # The number of a wall is that of its first side in the loop.
        other = -1 - int(arrays_of(scene).table.sides.wall[-1 - other])
    return Persisted(walls_of(scene).contact_at(i, other, place), since, until, x, y)


def walls_of(scene: Scene) -> ContactEngine:
    """Return an engine that knows the walls and balls of a scene, and plays nothing."""
    found: ContactEngine | None = scene.found.get(ContactEngine)
    if found is None:
        found = ContactEngine(Law(), scene.pair, scene.surface, Recorder())
        found.walls = [*scene.cushions, *pockets(scene)]
        found.radii = [ball.radius for ball in scene.balls]
        found.masses = [ball.mass for ball in scene.balls]
        scene.found[ContactEngine] = found
    return found
