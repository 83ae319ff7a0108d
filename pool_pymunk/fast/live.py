"""This module plays the steps of a table by the compiled loop, where that is loaded.

The record has the balls of a table, their groups, and what is due, until somebody changes the table
between two steps, or in a callback. Then the engine takes all of it over, and the record reads it
anew before the next step. What is due has the same bits whenever it is predicted, and so has all
that follows.
"""

from __future__ import annotations

import math
import weakref
from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.due import Hit, What, ends_of, hit_of
from pool_pymunk.engine.groups import FORM, NONE, OF_PATCHES, contact_of
from pool_pymunk.engine.near import NOWHERE
from pool_pymunk.engine.recorder import Persisted
from pool_pymunk.fast.loop import ENTER, FORESEE, GO_ON, PAUSED, STATE
from pool_pymunk.fast.records import (
    CROWD,
    HITS,
    MOST_BALLS,
    MOST_MOVERS,
    MOST_TOGETHER,
    NOTHING,
    OUT,
    ROLL,
    STOP,
    STOPS,
    WHOLE,
    nothing,
)
from pool_pymunk.fast.tables import (
    IN_ORDERS,
    Form,
    arrays_of,
    coefficients_of,
    cue_of,
    fits,
    knows,
    law_number,
    moves,
    own_of,
    put_patches,
    together_number,
)
from pool_pymunk.model import Scene
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.impulses import Impulse
from pool_pymunk.physics.moving import MovingWall
from pool_pymunk.physics.path import Path, motion_at, standing
from pool_pymunk.physics.pressed import lengths
from pool_pymunk.physics.surface import Rolling, Sliding
from pool_pymunk.world.ball import of_any_two
from pool_pymunk.world.broad_phase import may_collide
from pool_pymunk.world.steps import Steps

# the numbers of an engine's groups besides their rows
NUMBERS = (
    "members", "loosened", "waits", "hits", "todos", "begun", "used", "free", "begun_t", "coarser",
)  # fmt: skip
# An instant that is handed back must not have changed these, nor its numbers.
KEPT = (
    "ball", "due", "last", "now", "errors", "is_hard", "in_doubt", "collapses", "groups", "struck",
    "met",
)  # fmt: skip
LISTS = "leader", "contact", "one", "other", "following", "on"  # of the contacts of groups
UNKNOWN = -math.inf  # What is due next must be asked for.
FREE: dict[Any, list[Any]] = {}  # records of engines that are gone, by their forms
# The engine plays; the engine has taken over what the record had; the loop plays.
OFF, TAKEN, ON = range(3)


class Loop:
    """A loop plays an engine in its record, by the compiled loops of this process (``loaded``)."""

    def __init__(self, loaded: dict[Form, Any], engine: ContactEngine, table: Steps) -> None:
        self.loaded, self.engine, self.table = loaded, engine, table
        self.state, self.next_t, self.given_up = OFF, math.inf, -math.inf
        self.until = -math.inf  # s; the end of the present step
        self.form = Form(False, False)
        self.array: Any = None
        self.walls: tuple[Any, ...] = ()
        self.balls = 0

    @property
    def is_on(self) -> bool:
        """Tell whether the record has what is due."""
        return self.state == ON

    @property
    def predicts(self) -> bool:
        """Tell whether the record has what is due, or will have it before anything is played."""
        return self.state != OFF

    def upcoming(self) -> float:
        """Return the time (s) at which something is due next; -infinite if that is unknown."""
        return self.next_t

    # -- playing -----------------------------------------------------------------------------------

    def play(self, until: float) -> bool:
        """Play what is due up to a time (s), or to what somebody hears of; return False if not."""
        if self.state == ON and until != self.until and not self._is_as_before():
            self.leave()
        self.until = until
        if self.state == OFF and until <= self.given_up:
            return False  # The engine plays this step to its end.
        if self.state != ON and not (self._may_play() and self._enter()):
            self._hand_back(until)
            return False
        hits, stops = self.table.callbacks.hears()
        self.scene["hears"] = HITS * hits + STOPS * stops
        self.scene["least"] = self.table.callbacks.least_heard
        has_told = False
        while self.next_t <= until and not has_told:
            kept = [part.copy() for part in self.parts]
            status, has_told = self.ask(GO_ON, until)
            if status != PAUSED:
                for part, old in zip(self.parts, kept, strict=True):
                    part[:] = old
                self.leave()
                self._hand_back(until)
                return False
            self._tell()
        return True

    def resume(self, until: float) -> None:
        """Play again after the engine has taken over; else let the engine play up to a time (s)."""
        if self.state == TAKEN and not (self._may_play() and self._enter()):
            self._hand_back(until)

    def _is_as_before(self) -> bool:
        """Tell whether walls and balls are as they were when the record began."""
        walls, balls = tuple(self.engine.walls), self.table.on_table()
        return self.walls == walls and all(ball.is_as_it_came() for ball in balls)

    def _may_play(self) -> bool:
        """Tell whether the compiled loop knows all that is on the table."""
        engine, law = self.engine, self.engine.law
        differ, rolls = own_of(engine.walls) is None, type(engine.surface) is Rolling
        self.form = Form(rolls, differ, len(engine.paths) > MOST_BALLS, bool(engine.movers))
        is_bounded = engine.tally.most < math.inf or engine.tally.most_unlisted < math.inf
        return (
            engine.compiled and self.form in self.loaded and not is_bounded
            and type(engine.surface) in (Sliding, Rolling) and knows(engine.walls)
            and len(engine.paths) <= CROWD and engine.is_finite
            and self._has_room(engine.groups) and not engine.jams and not engine.squeezed
            and law_number(law) != NOTHING and together_number(law) not in (NOTHING, IN_ORDERS)
            and engine.recorder is self.table.callbacks
            and all(ball.is_as_it_came() for ball in self.table.on_table())
            and fits(engine.patches) and self._all_collide()
            and pairs_of(self.table.pair_as_said, engine.masses) is not None
        )  # fmt: skip

    def _all_collide(self) -> bool:
        """Tell whether the filters of all shapes let them collide."""
        filters = {ball.circle.filter for ball in self.table.on_table()}
        filters |= {each.shape.filter for each in self.table.walls.obstacles.values()}
        return all(may_collide(one, other) for one in filters for other in filters)

    def _has_room(self, own: Any) -> bool:
        """Tell whether the record has room for an engine's groups, and for what met just now."""
        most = CROWD if self.form.many else MOST_TOGETHER
        is_met = self.engine.instant.mets <= MOST_TOGETHER
        return is_met and bool(max(own.used, own.waits, own.hits, len(own.persisted)) <= most)

    def ask(self, what: int, until: float = 0.0) -> tuple[int, bool]:
        """Ask the compiled loop to enter, or to go on until a time (s).

        Return how that ended, and whether somebody is to hear of it.
        """
        self.scene["asks"], self.scene["time"] = what, until
        self.loaded[self.form](self.array, self.arrays, *self.no_shots, 0, 0)
        status, self.next_t, has_told, _ = self.scene["answer"].tolist()
        return int(status), bool(has_told)

    # -- the record begins -------------------------------------------------------------------------

    def _enter(self) -> bool:
        """Let the record have all that the engine has; tell whether it has room."""
        engine = self.engine
        self._hold()
        self._write_scene()
        there = self._there()
        for i in range(self.balls):
            self._write_ball(i, i in there)
        self._write_groups()
        for name in ("is_in", "changed"):  # An instant that was handed back has left its marks.
            self.instant[name] = 0
        status, _ = self.ask(ENTER)
        if status != PAUSED:
            return False
        self._write_dues()
        self._write_instant()
        engine.queue.clear()
        engine.queue.presses.clear()
        engine.upcoming = self.upcoming
        self.state = ON
        return True

    def _hold(self) -> None:
        """Have a record of the right form, and arrays of the walls."""
        engine = self.engine
        if self.array is None or self.array.dtype != self.form.work:
            self.array = record_of(self.engine, self.form)
            self.scene = self.array["scene"][0]
            self.ball, self.due = self.array["ball"][0], self.array["due"][0]
            self.groups, self.track = self.array["groups"][0], self.array["track"][0]
            self.instant = self.array["instant"][0]
            self.lists = SimpleNamespace(**{name: self.groups[name] for name in LISTS})
            numbers = [name for name in self.instant.dtype.names if self.instant[name].ndim == 0]
            instant = [self.array["instant"][name] for name in (*numbers, "met")]
            self.parts = [
                as_bytes(part) for part in (*(self.array[name] for name in KEPT), *instant)
            ]
        self.walls, self.balls = tuple(engine.walls), len(engine.paths)
        _, differ, _, has_movers = self.form
        owned = [(wall.restitution, wall.friction) for wall in engine.walls] if differ else ()
        self.arrays = arrays_of(engine.walls, None, owned, has_movers)
        self.no_shots = nothing(self.form.sides)[1:]
        self.movers = [wall.moving for wall in engine.walls if isinstance(wall, MovingWall)]
        self.motions = [self.arrays.sides.motion[np.flatnonzero(self.arrays.sides.mover == k)[0]]
                        for k in range(len(self.movers))]  # fmt: skip
        self._write_movers()

    # -- walls that move ---------------------------------------------------------------------------

    def foresee(self) -> bool:
        """Predict whom walls meet that move in the step that begins; return False if not."""
        if self.state == ON and self.engine.jams:
            self.leave()
        if self.state != ON:
            return False
        self._write_movers()
        self.array["now"] = self.engine.now
        self.ask(FORESEE)
        return True

    def _write_movers(self) -> None:
        """Let the record know how walls move, and how often they have met balls in this step."""
        for side, row in zip(self.movers, self.motions, strict=True):
            row[:] = side.how[2:]
        if self.movers:
            for name, counts in ("struck", self.engine.struck), ("met", self.engine.met):
                row = self.array[name][0]
                row[:] = 0
                for (i, wall), count in counts.items():
                    row[i * MOST_MOVERS + self._mover_of(wall)] = count

    def _mover_of(self, wall: int) -> int:
        """Return the number by which the record knows a wall that moves."""
        return self.movers.index(self.walls[wall].moving)

    def _read_movers(self) -> None:
        """Let the engine know how often walls that move have met balls in this step."""
        engine, walls = self.engine, [k for k, wall in enumerate(self.walls) if moves(wall)]
        for name, counts in ("struck", engine.struck), ("met", engine.met):
            counts.clear()
            row = self.array[name][0]
            for k in np.flatnonzero(row).tolist():
                counts[k // MOST_MOVERS, walls[k % MOST_MOVERS]] = int(row[k])

    # -- what the record takes over ----------------------------------------------------------------

    def _write_scene(self) -> None:
        engine = self.engine
        pairs = pairs_of(self.table.pair_as_said, engine.masses)
        assert pairs is not None
        e, mu = own_of(engine.walls) or (1.0, 0.0)
        surface, pull = engine.surface, engine.surface.pull
        values = {
            "kind": law_number(engine.law), "together": together_number(engine.law), "keeps": WHOLE,
            "balls": self.balls, "walls": len(engine.walls), "watched": NOTHING, "cue": pairs.cue,
            "latest": math.inf, "most": 2**62, "resumes": 0, "slip": engine.slip,
            "coarser": engine.groups.coarser, "ahead": math.inf, "ball_ball": pairs.restitution,
            "cue_ball": pairs.cue_restitution, "cushion": e, "pull": pull,
            "drag": surface.drag if surface.rolls else pull, "cushion_friction": mu,
            "ball_friction": pairs.friction,
        }  # fmt: skip
        for key, value in values.items():
            self.scene[key] = value
        self.array["now"], self.array["collapses"] = engine.now, engine.collapses
        put_patches(self.array, engine.patches)
        for key, value in vars(engine.errors).items():
            self.array["errors"][0][key] = value

    def _write_ball(self, i: int, is_there: bool) -> None:
        engine = self.engine
        t, x, y, vx, vy, ax, ay, end, slows, wx, wy = engine.paths[i]
        roll = ([wx, wy],) if self.form.rolls else ([],)
        moves = is_there and engine.rested[i] == math.inf
        self.ball[i] = (
            t, x, y, vx, vy, ax, ay, end, slows, *roll, engine.speeds[i], engine.noises[i], NOWHERE,
            moves, engine.radii[i], engine.masses[i], not is_there,
        )  # fmt: skip

    def _write_groups(self) -> None:
        own = self.engine.groups
        for name in NUMBERS:
            self.groups[name] = getattr(own, name)
        self.groups["patch"] = NONE
        for name in ("other", "wait", "hit"):  # A table before may have had more walls.
            self.groups[name] = 0
        for name, many in self._rows():
            self.groups[name][:many] = getattr(own, name)[:many]
        sides = [self._side_of(k) if wall.sides else NOTHING for k, wall in enumerate(self.walls)]
        self._rename(np.array([*sides, NOTHING]))
        self.groups["asked"], self.groups["helds"] = 0, len(own.persisted)
        for m, (hit, (_, since, until, x, y)) in enumerate(own.persisted.items()):
            other = self._side_of(hit.j) if hit.kind == "wall" else hit.j
            self.groups["held"][m, :6] = hit.i, other, since, until, x, y

    def _rows(self) -> list[tuple[str, int]]:
        """Return the names of the rows of groups, and how many of each the record takes."""
        _, contacts = self.engine.groups.room
        many = {"N": self.balls, "C": min(contacts, len(self.groups["one"]))}
        form = FORM | OF_PATCHES if self.engine.has_patches else FORM
        rows = [(name, lengths(shape, *many.values())[0]) for name, (_, shape) in form.items()]
        return [row for row in rows if row[1]]

    def _rename(self, names: Any) -> None:
        """Let walls have other numbers in the contacts of groups: those of their first sides."""
        for row in self.groups["other"], self.groups["wait"][:, 1], self.groups["hit"][:, 1]:
            is_wall = row < 0
            row[is_wall] = names[-1 - row[is_wall]]

    def _side_of(self, wall: int) -> int:
        """Return the number by which the record knows a wall: that of its first side."""
        sides = self.arrays.sides
        return -1 - int(np.flatnonzero(sides.wall == wall)[0])

    def _write_dues(self) -> None:
        """Let what only the engine knows be due: ends of pieces, contacts that are to press."""
        due, queue = self.due, self.engine.queue
        for t, _, (kind, i, j), path, _ in queue:
            if self.engine.paths[i] is not path or kind in ("pair", "stop", "look"):
                continue
            name = f"{kind}_t"
            if t < due[i][name]:
                due[i][name] = t
                if kind == "wall":
                    due[i]["side"] = -1 - self._side_of(j)
            if kind == "press":
                for m in range(int(self.groups["waits"])):
                    its = self.groups["wait"][m, 0] == i and self.groups["until"][m] == t
                    self.groups["asked"][m] |= its
            next_t = self.array["next_t"][0]
            next_t[i] = min(next_t[i], t)
            self.next_t = min(self.next_t, t)

    def _write_instant(self) -> None:
        """Let an instant go on that the engine has begun."""
        at = self.engine.instant
        self.instant["began"], self.instant["rounds"] = at.began, at.rounds
        self.instant["mets"] = at.mets
        for k in range(at.mets):
            i, other = at.met[k]
            self.instant["met"][k] = i, other if other >= 0 else self._side_of(-1 - other)

    def _read_instant(self) -> None:
        """Let an instant go on that the loop has begun."""
        at = self.engine.instant
        at.began, at.rounds = self.instant["began"].item(), self.instant["rounds"].item()
        at.mets = int(self.instant["mets"])
        for k, (i, other) in enumerate(self.instant["met"][: at.mets].tolist()):
            wall = other if other >= 0 else -1 - int(self.arrays.sides.wall[-1 - other])
            at.met[k] = i, wall

    # -- the record ends ---------------------------------------------------------------------------

    def leave(self) -> None:
        """Let the engine have all that the record has; it predicts nothing yet."""
        if self.state != ON:
            return
        engine = self.engine
        self._read_balls(range(self.balls))
        moves = self.ball["moves"]
        for i in range(self.balls):
            if moves[i]:
                engine.rested[i] = math.inf
            elif engine.rested[i] == math.inf:
                engine.rested[i] = engine.now
        engine.collapses = int(self.array["collapses"][0])
        self._read_groups()
        self._read_movers()
        if engine.has_patches:
            engine.put_all()
        self._read_instant()
        for i in range(self.balls):
            for kind in ("piece", "press"):
                if (t := float(self.due[i][f"{kind}_t"])) < math.inf:
                    engine.push(t, What(kind, i))
        self.state, self.next_t = TAKEN, UNKNOWN

    def _read_groups(self) -> None:
        own = self.engine.groups
        for name in NUMBERS:
            setattr(own, name, self.groups[name].item())
        self._rename(-1 - np.array([*self.arrays.sides.wall, 0]))
        own.hold(self.balls, max(own.used, own.waits, own.hits))
        for name, many in self._rows():
            getattr(own, name)[:many] = self.groups[name][:many].tolist()
        self._read_held()

    def _hand_back(self, until: float) -> None:
        """Let the engine play alone up to a time (s)."""
        engine, self.given_up = self.engine, until
        if self.state == TAKEN:
            self.state, engine.upcoming = OFF, engine.queue.upcoming
            changed = dict(self.table.near.changed)
            engine.predict(sorted(self._there()))
            self.table.near.changed.clear()
            self.table.near.changed.update(changed)

    def _there(self) -> set[int]:
        """Return the numbers of the balls that are on the table."""
        return {ball.number for ball in self.table.on_table()}

    # -- telling what has happened -----------------------------------------------------------------

    def _read_balls(self, balls: Any) -> None:
        """Let the engine have these balls' paths."""
        engine = self.engine
        for i in balls:
            t, x, y, vx, vy, ax, ay, end, slows, roll, speed, noise, *_ = self.ball[i].tolist()
            path = Path(t, x, y, vx, vy, ax, ay, end, bool(slows), *(roll.tolist() or (0.0, 0.0)))
            if path != engine.paths[i]:
                engine.paths[i] = path
            engine.speeds[i], engine.noises[i] = speed, noise

    def _tell(self) -> None:
        """Tell the recorder what has happened, and let the engine have the paths of the balls."""
        engine, track, changed, done = self.engine, self.track, dict[int, None](), 0
        rows = track["row"][: track["rows"]].tolist()
        for t, i, other, *impulse, count in track["event"][: track["events"]].tolist():
            self._follow(rows[done : int(count)], changed)
            done, engine.now = max(done, int(count)), t
            self._tell_event(t, int(i), int(other), impulse)
        self._follow(rows[done:], changed)
        engine.now = float(self.array["now"][0])
        starts = enumerate(self.ball["t"][: self.balls].tolist())
        changed |= {i: None for i, began in starts if began != engine.paths[i].t}
        self._read_balls([i for i in changed if i not in self.table.near.gone])
        for past in track["past"][: track["pasts"]].tolist():
            engine.recorder.persistent(self._persisted(past))
        track["rows"] = track["events"] = track["notes"] = track["pasts"] = track["is_heard"] = 0
        self._read_held()
        own = engine.groups
        own.members = int(self.groups["members"])
        own.leader[: self.balls] = self.groups["leader"][: self.balls].tolist()

    def _follow(self, rows: list[list[float]], changed: dict[int, None]) -> None:
        """Put balls on the paths of their last breakpoints among these."""
        engine, last = self.engine, {int(row[0]): row for row in rows}
        for i, (_, t, x, y, vx, vy, ax, ay, wx, wy) in last.items():
            changed[i] = None
            if vx == vy == ax == ay == 0.0:
                path = standing(t, x, y)
            else:
                path = engine.surfaces[i].path(t, (x, y), (vx, vy), (wx, wy))
                if path.ax != ax or path.ay != ay:
                    path = Path(t, x, y, vx, vy, ax, ay, math.inf, False, wx, wy)
            engine.paths[i] = path
            engine.near.begin(i, path, engine.radii[i], t, path.end)

    def _tell_event(self, t: float, i: int, other: int, impulse: list[float]) -> None:
        """Tell the recorder of an event of a ball."""
        engine = self.engine
        if other == STOP:
            engine.recorder.stop(i, t, motion_at(engine.paths[i], t)[:2])
        elif other == ROLL:
            engine.recorder.roll(i, t)
        elif other <= OUT:
            engine.put(i, OUT - 1 - other)
            engine.recorder.crossed(i, OUT - 1 - other, t)
        elif other < 0 and engine.walls[-1 - other].is_pocket:
            wall, motion = engine.walls[-1 - other], motion_at(engine.paths[i], t)
            assert wall.center is not None
            engine.paths[i] = standing(t, *wall.center)
            engine.rested[i] = t
            engine.near.remove(i)
            engine.recorder.pocketed(i, wall.number, t, motion, wall.center)
        else:
            balls = (i, other) if other >= 0 else (i,)
            place = {k: motion_at(engine.paths[k], t)[:2] for k in balls}
            n, along, first = impulse
            impulses = Impulse(n, along, first if other >= 0 else None)
            engine.recorder.contact(engine.contact_at(i, other, place), impulses, t)

    # -- persistent contacts -----------------------------------------------------------------------

    def _read_held(self) -> None:
        """Let the engine know the contacts that persist."""
        if not self.groups["helds"] and not self.engine.groups.persisted:
            return
        held = self.groups["held"][: self.groups["helds"]].tolist()
        found = {self._hit(one): self._persisted(one) for one in held}
        self.engine.groups.persisted = found

    def _hit(self, one: list[float]) -> Hit:
        i, other = int(one[0]), int(one[1])
        return hit_of(i, other if other >= 0 else -1 - int(self.arrays.sides.wall[-1 - other]))

    def _persisted(self, one: list[float]) -> Persisted:
        """Return a persistent contact of the record; its sides are as it was first noted."""
        engine, hit, (since, until, x, y, *places) = self.engine, self._hit(one), one[2:]
        known = engine.groups.persisted.get(hit)
        if known is not None and known.since == since:
            return known._replace(until=until, x=x, y=y)
        (i, other), now = ends_of(hit), engine.now
        place: dict[int, Vector] = {i: (places[0], places[1])}
        if other >= 0:
            place[other] = places[2], places[3]
        else:
            engine.now = places[2]
        contact, engine.now = engine.contact_at(i, other, place), now
        return Persisted(contact, since, until, x, y)

    def state_of(self, i: int) -> list[float]:
        """Return the state of a ball of a group now, as the engine does."""
        self.scene["steps"] = i
        self.ask(STATE, self.engine.now)
        state: list[float] = self.array["last"][0, i].tolist()
        return state

    def presses(self, i: int, other: int) -> bool:
        """Tell whether a contact has a force now."""
        other = other if other >= 0 else self._side_of(-1 - other)
        k = contact_of(self.lists, i, other)
        return k != NONE and bool(self.lists.on[k])

    def forget(self, hit: Hit) -> None:
        """Forget a persistent contact of which somebody has heard."""
        helds = int(self.groups["helds"])
        rows = self.groups["held"]
        for m in range(helds):
            if self._hit(rows[m].tolist()) == hit:
                rows[m : helds - 1] = rows[m + 1 : helds].copy()
                self.groups["helds"] = helds - 1
                return


def as_bytes(part: Any) -> Any:
    """Return a view of a part of a record as bytes, which NumPy copies some times as fast."""
    return part.reshape(-1).view(np.uint8)


def record_of(engine: ContactEngine, form: Form) -> Any:
    """Return a record for an engine; that of an engine that is gone serves again.

    It takes a millisecond or more to make one.
    """
    free = FREE.setdefault((form.rolls, form.many, form.moves), [])
    try:  # Another thread may take the last one.
        record = free.pop()
    except IndexError:
        record = np.zeros(1, dtype=form.work)
    weakref.finalize(engine, free.append, record)
    return record


class Pairs(NamedTuple):
    """These are the numbers of a table's pairs: those of any two balls, and of the cue ball."""

    restitution: float
    friction: float
    cue: int = NOTHING
    cue_restitution: float = 1.0


def pairs_of(said: Any, masses: list[float]) -> Pairs | None:
    """Return the numbers of all pairs of balls, if the table's pair is known to the loop.

    It is known if it comes from `same_balls`, or is the `pair` of a scene.
    """
    if isinstance(said, partial) and said.func is of_any_two:
        pair = said.args[0]
        if pair.m_a == pair.m_a and any(mass != pair.m_a for mass in masses):
            return None
        return Pairs(pair.restitution, pair.friction)
    scene = getattr(said, "__self__", None)
    if isinstance(scene, Scene) and said.__func__ is Scene.pair:
        e, cue_e, _, _, _, mu, _ = coefficients_of(scene).tolist()
        return Pairs(e, mu, cue_of(scene), cue_e)
    return None
