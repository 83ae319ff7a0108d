"""The contact engine that was before the core, played beside the core, bit by bit.

``python -m tests.old_engine 5000`` plays this many scenes of tests/core_scenes.py, all kinds in
turn, and prints each that differs. Where a contact persists in the old engine, the core must
decline the run. The run is then played again up to shortly before that, and there both must agree.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).parent))

from core_movers import MOST, New, Note, Play, Pose
from core_scenes import Case, Point, by_core, case_of, names, same
from scenes import BASE_SEED

from pool_pymunk import Scene, State
from pool_pymunk.core.engine import NEVER_SETTLES
from pool_pymunk.engine.contacts import ContactEngine, Tally
from pool_pymunk.engine.near import boxes_around
from pool_pymunk.engine.recorder import Recorder
from pool_pymunk.physics.moving import Moving, MovingWall
from pool_pymunk.physics.of_core import side_of, wall_of
from pool_pymunk.physics.path import sets_off
from pool_pymunk.physics.sides import OVERLAP
from pool_pymunk.physics.surface import NO_ROLL
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers import grouped
from pool_pymunk.solvers.exact import pockets as pockets_of
from pool_pymunk.solvers.record import Settings

TOO_LONG = 4.0  # s of the processor; a run of the old engine that takes longer is left out
SHORTLY = 1e-3  # A run is cut off by this share of the time before a contact persists.

# -- the old engine --------------------------------------------------------------------------------


class Persists(Exception):
    """This exception says that a contact has begun to persist."""


class TooLong(Exception):
    """This exception says that the old engine takes long to play a run."""


class Watched(ContactEngine):
    """The old engine, which ends a run where a contact begins to persist."""

    latest = math.inf  # s of the processor

    def next(self) -> None:
        super().next()
        if self.groups.members or self.groups.persisted:
            raise Persists
        if time.process_time() > self.latest:
            raise TooLong

    @property
    def has_tried(self) -> bool:
        """Tell whether a group might have begun, or is due to begin, or a contact waits."""
        due = len(self.queue.presses)
        return self.groups.begun_t > -math.inf or self.groups.waits > 0 or due > 0


class Outcome(NamedTuple):
    """A run came to a trace, an error, or at a time (s) to a contact that ``persists``.

    A contact ``nearly`` persisted where the engine has only looked whether it does.
    """

    trace: Trace | None
    error: str = ""
    persists: float | None = None
    nearly: bool = False


def outcome(play: Callable[[Scene, State, Settings], Trace | None], case: Case) -> Outcome:
    """Play a case, and return its trace, or the error that it raises."""
    try:
        return Outcome(play(case.scene, case.start, case.settings))
    except (Persists, TooLong):
        raise
    except Exception as error:
        return Outcome(None, f"{type(error).__name__}: {error}")


def watched(case: Case) -> Outcome:
    """Play a case by the old engine, up to where a contact persists."""
    engines: list[Watched] = []

    def engine(*parts: Any) -> Watched:
        engines.append(Watched(*parts))
        engines[-1].latest = time.process_time() + TOO_LONG
        return engines[-1]

    with patch.object(grouped, "ContactEngine", engine):
        try:
            found = outcome(grouped.solve, case)
        except Persists:
            return Outcome(None, persists=engines[-1].now)
    return found._replace(nearly=any(each.has_tried for each in engines))


# -- verdicts --------------------------------------------------------------------------------------

SAME, RAISES, PERSISTS, NEARLY = "same", "same error", "persists", "nearly persists"
NEEDLESS, DIFFERS, LEFT_OUT = "DECLINED WITHOUT NEED", "DIFFERS", "takes too long"
WRONG = (NEEDLESS, DIFFERS)


class Verdict(NamedTuple):
    """A verdict says in a word what came of a case, where it differs, and how many events it had.

    A case that persists has a second verdict, of its run up to shortly before that.
    """

    name: str
    word: str
    said: str = ""
    events: int = 0


def verdicts(case: Case, play: Any = None) -> list[Verdict]:
    """Play a case by the old engine and by the new core, or by another one."""
    play = play or by_core
    try:
        old = watched(case)
    except TooLong:
        return [Verdict(case.name, LEFT_OUT)]
    found = [judged(case, old, outcome(play, case))]
    if old.persists is not None and old.persists > 0.0:
        until = (1.0 - SHORTLY) * old.persists
        before = case._replace(
            name=f"{case.name} up to {until!r} s", settings=case.settings._replace(max_time=until)
        )
        found += verdicts(before, play)
    return found


def judged(case: Case, old: Outcome, new: Outcome) -> Verdict:
    """Compare what came of a case."""
    name, trace = case.name, new.trace
    if new.error or old.error:
        said = f"it raises {new.error or 'nothing'!r}, not {old.error or 'nothing'!r}"
        return Verdict(name, RAISES if new.error == old.error else DIFFERS, said)
    if trace is None:
        word = PERSISTS if old.persists is not None else NEARLY if old.nearly else NEEDLESS
        return Verdict(name, word)
    if old.trace is None:
        return Verdict(name, DIFFERS, f"it is played, but a contact persists at {old.persists} s")
    said = same(old.trace, trace)
    return Verdict(name, DIFFERS if said else SAME, said, len(old.trace.events))


# -- walls that move -------------------------------------------------------------------------------


@dataclass
class Heard(Recorder):
    """This keeps what the contact engine tells."""

    notes: list[Note] = field(default_factory=list)

    def contact(self, contact: Any, impulse: Any, t: float) -> None:
        a, b, normal, pair, cushion, _, _, _, drift, _ = contact
        push = *impulse[:2], impulse[2] if cushion is None else None
        self.notes.append(("contact", t, a, b, cushion, *normal, *pair, *drift, *push))

    def path(self, i: int, path: Any) -> None:
        self.notes.append(("path", path.t, i, *path))

    def roll(self, i: int, t: float) -> None:
        self.notes.append(("roll", t, i))

    def crossed(self, i: int, patch: int, t: float) -> None:
        self.notes.append(("patch", t, i, patch))

    def stop(self, i: int, t: float, position: Point) -> None:
        self.notes.append(("stop", t, i, *position))

    def pocketed(self, i: int, pocket: int, t: float, motion: Any, center: Point) -> None:
        self.notes.append(("pocket", t, i, pocket, *motion, *center))

    def jammed(self, i: int, wall: int, t: float) -> None:
        self.notes.append(("jam", t, i, wall))

    def zero_slip(self, contact: Any, t: float) -> None:
        self.notes.append(("zero slip", t, *contact[:2]))

    def no_end(self, contacts: Any, collapse: Any, t: float) -> None:
        balls = sorted({i for contact in contacts for i in contact.balls})
        self.notes.append(("collapse", t, *balls, *collapse))

    def order_unknown(self, t: float) -> None:
        self.notes.append(("order", t))


class Old:
    """The contact engine plays steps as a table of pymunk has it play them."""

    def __init__(self, play: Play) -> None:
        self.heard, self.play, scene = Heard(), play, play.scene
        engine = self.engine = Watched(play.law, scene.pair, scene.surface, self.heard)
        engine.latest = time.process_time() + TOO_LONG
        engine.compiled = False
        engine.lay(scene.surface, scene.ground)
        start = scene.start(None)
        rolls = start.roll or (NO_ROLL,) * len(scene.balls)
        starts = zip(scene.balls, start.position, start.velocity, rolls, strict=True)
        for i, (ball, *motion) in enumerate(starts):
            engine.add_ball(engine.path_at(i, 0.0, *motion), ball.radius, ball.mass)
        engine.walls = [*map(wall_of, play.cushions()), *pockets_of(scene)]
        for wall, kick in zip(engine.walls, play.kicks, strict=False):
            wall.kick = kick
        self.sides: dict[int, Moving] = {}  # by the places of their walls
        for k, one in enumerate(play.movers):
            place, side = len(engine.walls), Moving(tuple(map(side_of, one.sides)), engine)
            number = len(scene.cushions) + k
            engine.walls.append(MovingWall(side, one.restitution, one.friction, number, one.kick))
            engine.movers[number], self.sides[place] = place, side
        engine.near = boxes_around(engine.paths, engine.radii, len(engine.walls))
        engine.tally = Tally(MOST, NEVER_SETTLES)
        engine.predict([i for i, path in enumerate(engine.paths) if sets_off(path)])

    def step(self, since: float, until: float, poses: Sequence[Pose]) -> bool:
        """Play a step, and tell whether no contact has persisted in it."""
        engine = self.engine
        engine.struck.clear()
        engine.met.clear()
        engine.squeezed.clear()
        for side, pose in zip(self.sides.values(), poses, strict=True):
            side.move(*pose, since, until)
        engine.now = since
        try:
            gone = {note[2] for note in self.heard.notes if note[0] == "pocket"}
            for i, radius in enumerate(engine.radii):
                for place, side in self.sides.items() if i not in gone else ():
                    (x, y), _ = engine.paths[i].at(since)
                    if side.gap(x, y, radius) >= -OVERLAP * radius:
                        engine.jams.discard((i, place))
                    engine.meet_wall(i, place)
            engine.advance(until)
        except Persists:
            return False
        return True

    @property
    def may_persist(self) -> bool:
        """Tell whether a group might have begun."""
        return self.engine.has_tried

    def state(self) -> Note:
        """Return what the engine counts, and all about balls that no note has."""
        e, t = self.engine, self.engine.tally
        counts = t.listed, t.unlisted, t.answered, e.collapses, e.is_finite
        jams = sorted(e.jams), sorted(e.squeezed), sorted(e.struck.items()), sorted(e.met.items())
        balls = [(*p, n, s, r) for p, n, s, r in zip(e.paths, e.noises, e.speeds, e.rested,
                                                     strict=True)]  # fmt: skip
        return e.now, *counts, *jams, *balls


class Played(NamedTuple):
    """This says in a word what came of a play, where it differs, and how much was heard."""

    name: str
    word: str
    said: str = ""
    heard: tuple[str, ...] = ()


def played_beside(name: str, play: Play, new: type[New] = New) -> Played:
    """Play this by both engines, and compare after each step what they have heard."""
    one, other, word, said = Old(play), new(play), SAME, ""
    for k, poses in enumerate(play.steps):
        since, until = k * play.dt, (k + 1) * play.dt
        try:
            goes_on = one.step(since, until, poses), other.step(since, until, poses)
        except TooLong:
            return Played(name, LEFT_OUT)
        said, word = compared(one, other, *goes_on)
        if word != SAME:
            said = f"in step {k} from {since!r} s: {said}"
            break
    return Played(name, word, said, tuple(note[0] for note in other.heard.notes))


def compared(one: Old, other: New, goes_on: bool, its_goes_on: bool) -> tuple[str, str]:
    """Compare two engines after a step; say where they differ, and what to call that."""
    notes, its = one.heard.notes, other.heard.notes
    if not its_goes_on:
        notes = notes[: len(its)]
    if said := first_difference(notes, its):
        return said, DIFFERS
    if not its_goes_on:
        return "", PERSISTS if not goes_on else NEARLY if one.may_persist else NEEDLESS
    if not goes_on:
        return "the core plays on, but a contact persists", DIFFERS
    said = first_difference(one.state(), other.state())
    return said, DIFFERS if said else SAME


def first_difference(one: Sequence[Any], other: Sequence[Any]) -> str:
    """Say where two lists differ first, by all digits of their numbers; nothing if they do not."""
    for k, (a, b) in enumerate(zip_longest(one, other)):
        if repr(a) != repr(b):
            return f"{k} of {len(one)} is {b}, not {a}"
    return ""


# -- the command line ------------------------------------------------------------------------------


def kind_of(name: str) -> str:
    """Return the kind of a case by its name."""
    return name.partition(" up to ")[0].rpartition(" ")[0]


def main(count: int, kinds: Sequence[str], first: int) -> None:
    """Play this many cases, print what differs, and count the verdicts of each kind."""
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    began, events = time.perf_counter(), 0
    for name in islice(names(kinds, first), count):
        for each in verdicts(case_of(name)):
            counts[kind_of(name)][each.word] += 1
            events += each.events
            if each.word in WRONG:
                print(f"{each.name}: {each.word} {each.said[:400]}", flush=True)
    for kind, its in counts.items():
        print(f"{kind:28}", ", ".join(f"{word} {n}" for word, n in its.most_common()))
    total = sum(counts.values(), Counter())
    print("all", dict(total), f"{events} events, {time.perf_counter() - began:.0f} s")


def show(name: str) -> None:
    """Play one case, and print what came of it."""
    case = case_of(name)
    print(case.scene, case.settings, sep="\n")
    for each in verdicts(case):
        print(f"{each.name}: {each.word}, {each.events} events", *each.said.split("; "), sep="\n  ")


if __name__ == "__main__":
    said = sys.argv[1:]
    if len(said) == 1 and not said[0].isdigit():
        show(said[0])
    else:
        chosen = tuple(said[1].split(",")) if len(said) > 1 and said[1] != "all" else ()
        main(int(said[0]), chosen, int(said[2]) if len(said) > 2 else BASE_SEED)
