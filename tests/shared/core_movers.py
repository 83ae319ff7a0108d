"""Walls that move and kick, played step by step by the core."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import count
from typing import Any, NamedTuple

import pymunk

from pool_pymunk import Ball, Law, Physics, Restitution, Scene, SceneError, Table
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.engine import Engine
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.persistent.groups import persistence_of
from pool_pymunk.core.persistent.scale import TOLERANCE
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table as CoreTable
from pool_pymunk.core.walls import moving
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Pocket, Wall
from pool_pymunk.laws import LAWS, law_in_core
from pool_pymunk.solvers.in_core import balls_of
from pool_pymunk.world.checks import Drawn
from pool_pymunk.world.walls import sides_of
from tests.shared.core_scenes import (
    LATEST,
    OWN_LAWS,
    STAY,
    M,
    Point,
    R,
    friction,
    law,
    on_patches,
    pockets,
    rolling,
    scattered,
    some_posts,
    some_velocity,
)
from tests.shared.scenes import BASE_SEED

Note = tuple[Any, ...]  # what an engine tells: what it is, when (s), and numbers

MOST = 300  # events of a run
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

    sides: list[Side]
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


# -- the core plays steps --------------------------------------------------------------------------


class Heard(Recorder):
    """This keeps what the core tells."""

    def __init__(self) -> None:
        self.notes: list[Note] = []

    def contact(self, one: Contact, t: float) -> None:
        b, wall, pair = one.b, one.wall, one.pair
        self.notes.append((
            "contact", t, one.a.ball.number, -1 if b is None else b.ball.number,
            None if wall is None else wall.number, one.nx, one.ny,
            pair.m_a, pair.m_b, pair.restitution, pair.friction, one.ux, one.uy,
            one.normal, one.along, None if b is None else one.along_first,
        ))  # fmt: skip

    def path(self, ball: Any, path: Any) -> None:
        self.notes.append(("path", path.t, ball.number, *numbers_of(path)))

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

    def zero_slip(self, one: Contact, t: float) -> None:
        b = -1 if one.b is None else one.b.ball.number
        self.notes.append(("zero slip", t, one.a.ball.number, b))

    def collapse(self, contacts: list[Contact], hits: int, is_over: bool, t: float) -> None:
        balls = {one.a.ball.number for one in contacts}
        balls |= {one.b.ball.number for one in contacts if one.b is not None}
        self.notes.append(("collapse", t, *sorted(balls), hits, is_over))

    def order_unknown(self, t: float) -> None:
        self.notes.append(("order", t))


class New:
    """The core plays the steps."""

    def __init__(self, play: Play) -> None:
        self.heard, scene, pairs = Heard(), play.scene, play.scene.restitution
        walls = play.cushions()
        walls += [Pocket(hole.position, hole.radius, k) for k, hole in enumerate(scene.pockets)]
        self.movers: list[moving.MovingWall] = []
        for k, one in enumerate(play.movers):
            sides, number = one.sides, len(scene.cushions) + k
            self.movers.append(
                moving.MovingWall(sides, one.restitution, one.friction, number, one.kick)
            )
        e, cue = pairs.ball_ball or 0.0, pairs.cue_ball
        table = CoreTable(
            [*walls, *self.movers], scene.surface, scene.ground,
            e, e if cue is None else cue, scene.friction.ball_ball,
        )  # fmt: skip
        balls = balls_of(scene, scene.start(None), table)
        persistence = persistence_of(table, balls, TOLERANCE)
        self.engine = Engine(table, balls, law_in_core(play.law), self.heard, persistence)
        self.engine.most_events = MOST
        self.engine.begin_run()

    def step(self, since: float, until: float, poses: Sequence[Pose]) -> None:
        """Play a step."""
        for wall, pose in zip(self.movers, poses, strict=True):
            wall.body = moving.Body(*pose, since, until)
        self.engine.begin_step(since)
        self.engine.advance(until)

    def state(self) -> Note:
        """Return what the engine counts, and all about balls that no note has."""
        e, s = self.engine, self.engine.squeezes
        counts = e.events, e.idle, e.answered, e.instant.collapses, e.is_finite
        jams = sorted(s.jams), sorted(s.squeezed), sorted(s.struck.items()), sorted(s.met.items())
        balls = [(*numbers_of(b.path), b.noise, b.speed, b.rested) for b in e.balls]
        return e.now, *counts, *jams, *balls


def numbers_of(path: Path) -> Note:
    """Return the numbers of a path."""
    return (path.t, path.x, path.y, path.vx, path.vy, path.ax, path.ay, path.end, path.slows,
            path.wx, path.wy)  # fmt: skip


# -- random plays ----------------------------------------------------------------------------------


def shape(rnd: random.Random, body: pymunk.Body) -> Drawn:
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


# -- walls on a plane ------------------------------------------------------------------------------

Pose_at = Callable[[float], Pose]  # of a time (s)
KEPT: list[pymunk.Body] = []


def bar(a: Point, b: Point, e: float = 1.0, mu: float = 0.0) -> Mover:
    """Return a thin wall between two places (m) of its frame."""
    KEPT.append(pymunk.Body(body_type=pymunk.Body.KINEMATIC))  # A shape does not keep its body.
    return Mover(sides_of(pymunk.Segment(KEPT[-1], a, b, 0.0)), e, mu, 0.0)


def upright(e: float = 1.0, mu: float = 0.0) -> Mover:
    """Return a thin wall across x."""
    return bar((0.0, -1.0), (0.0, 1.0), e, mu)


def going(velocity: Point = (0.0, 0.0), turns: float = 0.0, place: Point = (0.0, 0.0)) -> Pose_at:
    """Return how a wall moves evenly."""

    def pose(t: float) -> Pose:
        x, y = place[0] + t * velocity[0], place[1] + t * velocity[1]
        return Pose((x, y), t * turns, velocity, turns)

    return pose


def on_a_plane(
    ball: Ball, movers: Sequence[tuple[Mover, Pose_at]], dt: float, until: float
) -> Play:
    """Return a ball on an open plane without friction, and walls that move, until a time (s)."""
    poses = [tuple(pose(k * dt) for _, pose in movers) for k in range(round(until / dt))]
    scene = Scene((ball,), None, Restitution(1.0), physics=Physics(max_time=until))
    return Play(scene, LAWS["coulomb"], (), tuple(one for one, _ in movers), dt, tuple(poses))


PISTON = 0.2  # m/s


def piston(e: float, dt: float, until: float) -> Play:
    """Return a ball between a piston that comes from x = 0, and a wall at x = 1."""
    ball = Ball("a", (0.5, 0.0), R, M, velocity=(1.0, 0.0))
    walls = (upright(e), going((PISTON, 0.0))), (upright(), going(place=(1.0, 0.0)))
    return on_a_plane(ball, walls, dt, until)
