"""Walls that move and kick, played step by step by the contact engine and by the core.

``python -m tests.core_movers 300`` plays this many random scenes, and prints each that differs, and
at the end how many of each kind came out how. ``python -m tests.core_movers "turned 17"`` plays
one.

Where a contact persists in one engine, both stop: what the core has heard until then must be what
the other one has heard first.
"""

from __future__ import annotations

import math
import random
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import count, islice, zip_longest
from pathlib import Path as FilePath
from typing import Any, NamedTuple

sys.path.insert(0, str(FilePath(__file__).parent))

import pymunk
from core_scenes import (
    LATEST,
    OWN_LAWS,
    STAY,
    M,
    Persists,
    Point,
    R,
    TooLong,
    Watched,
    friction,
    law,
    on_patches,
    pockets,
    rolling,
    scattered,
    some_posts,
    some_velocity,
)
from pool_pymunk.solvers.own import path_of
from scenes import BASE_SEED

from pool_pymunk import Ball, Law, Restitution, Scene, SceneError, Table
from pool_pymunk.core.contact.contact import Contact as CoreContact
from pool_pymunk.core.engine import NEVER_SETTLES, Engine
from pool_pymunk.core.persistent.declined import Declined
from pool_pymunk.core.record import Recorder as CoreRecorder
from pool_pymunk.core.table import Table as CoreTable
from pool_pymunk.core.walls import moving as core_moving
from pool_pymunk.core.walls.wall import Pocket
from pool_pymunk.engine.contacts import Tally
from pool_pymunk.engine.near import boxes_around
from pool_pymunk.engine.recorder import Recorder
from pool_pymunk.laws import LAWS
from pool_pymunk.physics.moving import Flat, Moving, MovingWall
from pool_pymunk.physics.path import sets_off
from pool_pymunk.physics.sides import OVERLAP, Wall
from pool_pymunk.physics.surface import NO_ROLL
from pool_pymunk.solvers.exact import pockets as pockets_of
from pool_pymunk.solvers.in_core import (
    balls_of,
    law_in_core,
    patches_in_core,
    side_in_core,
    surface_in_core,
    wall_in_core,
)
from pool_pymunk.world.walls import sides_of

Note = tuple[Any, ...]  # what an engine tells: what it is, when (s), and numbers

MOST = 300  # events of a run
TOO_LONG = 4.0  # s of the processor
RATES = (30, 60, 240)  # steps a second
FENCE = Table.rectangle(2.0, 1.0)


class Pose(NamedTuple):
    """A body lies so when a step begins, and moves so in it (m, rad, m/s, rad/s)."""

    place: Point
    angle: float
    velocity: Point
    turns: float


class Mover(NamedTuple):
    """A wall that moves: its sides in the frame of its body, its coefficients and its kick."""

    sides: tuple[Flat, ...]
    restitution: float
    friction: float
    kick: float


class Play(NamedTuple):
    """A play is a scene with walls of which some move, and where these are in each step."""

    scene: Scene
    law: Law
    kicks: tuple[float, ...]  # m/s, of the cushions
    movers: tuple[Mover, ...]
    dt: float  # s
    steps: tuple[tuple[Pose, ...], ...]

    def cushions(self) -> list[Wall]:
        """Return the cushions, with their kicks."""
        return [
            Wall(wall.sides, wall.restitution, wall.friction, wall.number, kick)
            for wall, kick in zip(self.scene.cushions, self.kicks, strict=True)
        ]


# -- two engines that play steps ------------------------------------------------------------------


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
        engine.walls = [*play.cushions(), *pockets_of(scene)]
        self.sides: dict[int, Moving] = {}  # by the places of their walls
        for k, one in enumerate(play.movers):
            place, side = len(engine.walls), Moving(one.sides, engine)
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


class CoreHeard(CoreRecorder):
    """This keeps what the core tells, in the same words."""

    def __init__(self) -> None:
        self.notes: list[Note] = []

    def contact(self, one: CoreContact, t: float) -> None:
        b, wall, pair = one.b, one.wall, one.pair
        self.notes.append((
            "contact", t, one.a.ball.number, -1 if b is None else b.ball.number,
            None if wall is None else wall.number, one.nx, one.ny,
            pair.m_a, pair.m_b, pair.restitution, pair.friction, one.ux, one.uy,
            one.normal, one.along, None if b is None else one.along_first,
        ))  # fmt: skip

    def path(self, ball: Any, path: Any) -> None:
        self.notes.append(("path", path.t, ball.number, *path_of(path)))

    def roll(self, ball: Any, t: float) -> None:
        self.notes.append(("roll", t, ball.number))

    def crossed(self, ball: Any, patch: int, t: float) -> None:
        self.notes.append(("patch", t, ball.number, patch))

    def stop(self, ball: Any, t: float, place: Point) -> None:
        self.notes.append(("stop", t, ball.number, *place))

    def pocketed(self, ball: Any, pocket: Any, t: float, motion: Any) -> None:
        self.notes.append(("pocket", t, ball.number, pocket.number, *motion, *pocket.center))

    def jammed(self, ball: Any, wall: Any, t: float) -> None:
        self.notes.append(("jam", t, ball.number, wall.number))

    def zero_slip(self, one: CoreContact, t: float) -> None:
        b = -1 if one.b is None else one.b.ball.number
        self.notes.append(("zero slip", t, one.a.ball.number, b))

    def collapse(self, contacts: list[CoreContact], hits: int, is_over: bool, t: float) -> None:
        balls = {one.a.ball.number for one in contacts}
        balls |= {one.b.ball.number for one in contacts if one.b is not None}
        self.notes.append(("collapse", t, *sorted(balls), hits, is_over))

    def order_unknown(self, t: float) -> None:
        self.notes.append(("order", t))


class New:
    """The core plays the same steps."""

    def __init__(self, play: Play) -> None:
        self.heard, scene, pairs = CoreHeard(), play.scene, play.scene.restitution
        walls = [wall_in_core(wall) for wall in play.cushions()]
        walls += [Pocket(hole.position, hole.radius, k) for k, hole in enumerate(scene.pockets)]
        self.movers: list[core_moving.MovingWall] = []
        for k, one in enumerate(play.movers):
            sides, number = [side_in_core(side) for side in one.sides], len(scene.cushions) + k
            self.movers.append(
                core_moving.MovingWall(sides, one.restitution, one.friction, number, one.kick)
            )
        e, cue = pairs.ball_ball or 0.0, pairs.cue_ball
        table = CoreTable(
            [*walls, *self.movers], surface_in_core(scene.surface), patches_in_core(scene.ground),
            e, e if cue is None else cue, scene.friction.ball_ball,
        )  # fmt: skip
        balls = balls_of(scene, scene.start(None), table)
        self.engine = Engine(table, balls, law_in_core(play.law), self.heard, Declined())
        self.engine.most_events = MOST
        self.engine.begin_run()

    def step(self, since: float, until: float, poses: Sequence[Pose]) -> bool:
        """Play a step, and tell whether no contact is about to persist."""
        for wall, pose in zip(self.movers, poses, strict=True):
            wall.body = core_moving.Body(*pose, since, until)
        self.engine.begin_step(since)
        self.engine.advance(until)
        return not self.engine.persistence.declines

    def state(self) -> Note:
        """Return what the engine counts, and all about balls that no note has."""
        e, s = self.engine, self.engine.squeezes
        counts = e.events, e.idle, e.answered, e.instant.collapses, e.is_finite
        jams = sorted(s.jams), sorted(s.squeezed), sorted(s.struck.items()), sorted(s.met.items())
        balls = [(*path_of(b.path), b.noise, b.speed, b.rested) for b in e.balls]
        return e.now, *counts, *jams, *balls


# -- random plays ----------------------------------------------------------------------------------


def shape(rnd: random.Random, body: pymunk.Body) -> pymunk.Shape:
    """Return a disc, a bar or a box."""
    kind = rnd.choice(("disc", "box", "bar"))
    if kind == "disc":
        return pymunk.Circle(body, rnd.uniform(0.03, 0.15), (rnd.choice((0.0, 0.05)), 0.0))
    if kind == "bar":
        ends = (-rnd.uniform(0.05, 0.3), 0.0), (rnd.uniform(0.05, 0.3), 0.0)
        return pymunk.Segment(body, *ends, rnd.choice((0.0, 0.005, 0.02)))
    size = rnd.uniform(0.04, 0.3), rnd.uniform(0.03, 0.1)
    return pymunk.Poly.create_box(body, size, rnd.choice((0.0, 0.01)))


def mover(rnd: random.Random, size: Point | None = None) -> Mover:
    """Return a wall that moves, and may kick; it is a box of a size (m), or of any shape."""
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    its = pymunk.Poly.create_box(body, size) if size else shape(rnd, body)
    e, mu = rnd.choice((1.0, 1.0, 0.9, 0.5, 0.0)), rnd.choice((0.0, 0.0, 0.1, 0.5))
    kick = rnd.choice((0.0, 0.0, 0.0, 0.5, 2.0))
    return Mover(sides_of(its), e, mu, kick)


def velocity(rnd: random.Random, speeds: Sequence[float] = (0.0, 0.1, 0.5, 1.0, 3.0)) -> Point:
    """Return a velocity (m/s) of one of these speeds."""
    speed, angle = rnd.choice(speeds), rnd.uniform(-math.pi, math.pi)
    return speed * math.cos(angle), speed * math.sin(angle)


def track(rnd: random.Random, kind: str, dt: float, steps: int) -> list[Pose]:
    """Return how the body of a wall moves in so many steps."""
    x, y = rnd.uniform(0.2, 1.8), rnd.uniform(0.2, 0.8)
    angle, turns, (ux, uy) = rnd.uniform(0.0, 6.0), 0.0, velocity(rnd)
    every, found = max(1, round(rnd.choice((0.02, 0.1, 9.0)) / dt)), list[Pose]()
    for k in range(steps):
        if k % every == 0:
            ux, uy = velocity(rnd)
            turns = rnd.choice((0.0, 1.0, 5.0, 30.0, -10.0)) if kind == "turned" else 0.0
        if kind == "thrown" and rnd.random() < 0.05:
            x, y, angle = rnd.uniform(0.1, 1.9), rnd.uniform(0.1, 0.9), rnd.uniform(0.0, 6.0)
        if kind == "still":
            ux = uy = 0.0
        ux = ux if 0.1 < x + ux * dt < 1.9 else -ux
        uy = uy if 0.1 < y + uy * dt < 0.9 else -uy
        found.append(Pose((x, y), angle, (ux, uy), turns))
        x, y, angle = x + dt * ux, y + dt * uy, angle + dt * turns
    return found


def pressing(rnd: random.Random, dt: float, steps: int) -> list[Pose]:
    """Return how a wall comes to an end of the table, waits there, and goes back."""
    speed, x = rnd.choice((0.1, 0.5, 1.0, 3.0)), rnd.uniform(1.2, 1.6)
    tilt, found = rnd.choice((0.0, 0.0, rnd.uniform(-0.3, 0.3))), list[Pose]()
    until = rnd.uniform(0.3, 0.9) * steps
    for k in range(steps):
        ux = speed if k < until and x < 2.0 else (-speed if k >= until else 0.0)
        found.append(Pose((x, 0.5), tilt, (ux, 0.0), 0.0))
        x += dt * ux
    return found


def closing(rnd: random.Random, dt: float, steps: int) -> tuple[list[Mover], list[list[Pose]]]:
    """Return two bars that are mirror images, and how they close on the table's middle line.

    Between them is a corner, perhaps a narrow one, out of which the law drives balls fast.
    """
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    bar = sides_of(pymunk.Segment(body, (-0.4, 0.0), (0.4, 0.0), rnd.choice((0.0, 0.01))))
    like, speed = mover(rnd)._replace(sides=bar), rnd.choice((0.1, 0.5, 1.0))
    angle, apart = rnd.choice((0.0, 0.01, 0.05, 0.3)), rnd.uniform(0.15, 0.25)
    tracks = [
        [
            Pose((1.0, 0.5 + up * (apart - k * dt * speed)), up * angle, (0.0, -up * speed), 0.0)
            for k in range(steps)
        ]
        for up in (1.0, -1.0)
    ]
    return [like, like], tracks


def on_middle_line(rnd: random.Random) -> Scene:
    """Return balls on the table's middle line, which mostly rest."""
    e, xs = rnd.choice((0.0, 0.5, 1.0)), rnd.sample((0.8, 0.9, 1.0, 1.06, 1.2), rnd.randint(1, 3))
    balls = tuple(
        Ball(str(k), (x, 0.5), R, M * rnd.choice((1.0, 1.0, 5.0)),
             velocity=(rnd.uniform(-1.0, 1.0), 0.0) if rnd.random() < 0.3 else STAY)
        for k, x in enumerate(sorted(xs))
    )  # fmt: skip
    rough = replace(friction(rnd), surface=0.0)
    return Scene(balls, FENCE, Restitution(e, None, e), rough, law(rnd, LATEST))


def packed(rnd: random.Random) -> Scene:
    """Return balls at an end of the table, which touch each other and it, or nearly do."""
    gap, rows = rnd.choice((0.0, 0.0, 1e-12, 1e-9, 1e-3)), rnd.randint(1, 3)
    pitch, e = 2.0 * R + gap, rnd.choice((0.0, 0.5, 0.9, 1.0))
    balls = tuple(
        Ball(
            str(k), (2.0 - R - gap - k // rows * pitch, 0.5 + k % rows * pitch), R,
            M * rnd.choice((1.0, 1.0, 0.01, 10.0)),
            velocity=some_velocity(rnd) if rnd.random() < 0.2 else STAY,
        )
        for k in range(rnd.randint(1, 6))
    )  # fmt: skip
    rough = friction(rnd)
    if rnd.random() < 0.6:
        rough = replace(rough, surface=0.0)
    return Scene(balls, FENCE, Restitution(e, None, e), rough, law(rnd, LATEST))


def open_field(rnd: random.Random) -> Scene:
    """Return balls anywhere, between posts, pockets or patches, or on a table without any."""
    draw = rnd.choice((None, None, None, pockets, on_patches))
    if draw is not None:
        return draw(rnd)
    rough, post = friction(rnd), some_posts(rnd) if rnd.random() < 0.2 else ()
    if rnd.random() < 0.5:
        rough = replace(rough, surface=0.0)
    parts: dict[str, Any] = {"friction": rough, "physics": law(rnd, LATEST), "posts": post}
    return scattered(rnd, FENCE, rnd.randint(1, 9), (0.02, 0.05), **parts)


KINDS = ("slid", "turned", "thrown", "still", "pressed", "wedged")
SCENES = {"pressed": packed, "wedged": on_middle_line}


def play_of(name: str) -> Play:
    """Return the play of a name: a kind and a seed."""
    kind, _, seed = name.rpartition(" ")
    rnd = random.Random(f"movers {kind} {seed}")
    while True:
        try:
            scene = SCENES.get(kind, open_field)(rnd)
            scene = rolling(rnd, scene) if rnd.random() < 0.3 else scene
            break
        except SceneError:
            continue
    dt = 1.0 / rnd.choice(RATES)
    steps = round(0.5 / dt)
    if kind == "pressed":
        movers, tracks = [mover(rnd, (0.06, 0.9))], [pressing(rnd, dt, steps)]
    elif kind == "wedged":
        movers, tracks = closing(rnd, dt, steps)
    else:
        many = range(rnd.randint(1, 3))
        movers, tracks = [mover(rnd) for _ in many], [track(rnd, kind, dt, steps) for _ in many]
    kicks = tuple(rnd.choice((0.0, 0.0, 0.5)) for _ in scene.cushions)
    own = rnd.choice(OWN_LAWS) if rnd.random() < 0.15 else LAWS[scene.physics.law]
    return Play(scene, own, kicks, tuple(movers), dt, tuple(zip(*tracks, strict=True)))


def names(kinds: Sequence[str] = KINDS, first: int = BASE_SEED) -> Iterator[str]:
    """Yield names of plays of these kinds in turn."""
    return (f"{kind} {seed}" for seed in count(first) for kind in kinds)


# -- side by side ----------------------------------------------------------------------------------

SAME, PERSISTS, NEARLY, LEFT_OUT = "same", "persists", "nearly persists", "takes too long"
NEEDLESS, DIFFERS = "DECLINED WITHOUT NEED", "DIFFERS"
WRONG = (NEEDLESS, DIFFERS)


class Verdict(NamedTuple):
    """A verdict says in a word what came of a play, where it differs, and how much was heard."""

    name: str
    word: str
    said: str = ""
    heard: tuple[str, ...] = ()


def verdict(name: str, play: Play, new: type[New] = New) -> Verdict:
    """Play this by both engines, and compare after each step what they have heard."""
    one, other, word, said = Old(play), new(play), SAME, ""
    for k, poses in enumerate(play.steps):
        since, until = k * play.dt, (k + 1) * play.dt
        try:
            goes_on = one.step(since, until, poses), other.step(since, until, poses)
        except TooLong:
            return Verdict(name, LEFT_OUT)
        said, word = compared(one, other, *goes_on)
        if word != SAME:
            said = f"in step {k} from {since!r} s: {said}"
            break
    return Verdict(name, word, said, tuple(note[0] for note in other.heard.notes))


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


def main(many: int, kinds: Sequence[str], first: int) -> None:
    """Play this many scenes, print what differs, and count the verdicts of each kind."""
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    heard, began = Counter[str](), time.perf_counter()
    for name in islice(names(kinds, first), many):
        each = verdict(name, play_of(name))
        counts[name.rpartition(" ")[0]][each.word] += 1
        heard.update(each.heard)
        if each.word in WRONG:
            print(f"{name}: {each.word} {each.said[:700]}", flush=True)
    for kind, its in counts.items():
        print(f"{kind:10}", ", ".join(f"{word} {n}" for word, n in its.most_common()))
    print(dict(heard), f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    said = sys.argv[1:]
    if said[0].isdigit():
        chosen = said[1].split(",") if len(said) > 1 else KINDS
        main(int(said[0]), chosen, int(said[2]) if len(said) > 2 else BASE_SEED)
    else:
        print(*verdict(said[0], play_of(said[0])), sep="\n")
