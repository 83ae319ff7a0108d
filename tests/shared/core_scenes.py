"""Random scenes of every kind for the core, and all that comes of a run, in lists.

``python -m tests.shared.core_scenes --kinds`` lists the kinds, and ``--digests 50`` prints a hash
of what comes of each of 50 scenes and of a shot of each bundled one.
"""

from __future__ import annotations

import math
import random
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from hashlib import sha256
from itertools import islice
from typing import Any, NamedTuple

from pool_pymunk import (
    NT,
    Ball,
    Friction,
    Law,
    Pair,
    Patch,
    Physics,
    Pocket,
    Post,
    Restitution,
    Scene,
    SceneError,
    Shot,
    State,
    Table,
    load,
    rack,
)
from pool_pymunk.laws.contact import NO_BALL, Contact, Respond, Velocities, closing_speed
from pool_pymunk.model.parts import STANDARD_GRAVITY
from pool_pymunk.model.places import SUNK
from pool_pymunk.results.trace import SLIPS, Trace
from pool_pymunk.results.variants import AS_IT_IS, Variant
from pool_pymunk.safety.files import bundled
from pool_pymunk.solvers.event_driven import solve
from pool_pymunk.solvers.frozen import nudged
from pool_pymunk.solvers.record import Settings
from tests.oracle import reference
from tests.shared.hard_kinds import random_hard_scene
from tests.shared.patch_scenes import random_scene as random_patches
from tests.shared.press_scenes import press_scene
from tests.shared.scenes import BASE_SEED, TABLES, gas, random_scene
from tests.shared.small_tables import small_table

Draw = Callable[[random.Random], Scene]
Point = tuple[float, float]

R, M = 0.03, 0.17  # m, kg
MOST = 300  # events of a run, unless a scene is cut off sooner
LATEST = 3.0  # s; a run without friction of the surface ends then
RECTANGLE, STADIUM = Table.rectangle(2.0, 1.0), Table.stadium(2.0, 1.0)
ELL = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 0.9), (0.9, 0.9), (0.9, 2.0), (0.0, 2.0)))
LAWS = ("coulomb", "published", "weakening")
STAY = (0.0, 0.0)


class Case(NamedTuple):
    """A case is a scene with a start and settings; its name, "kind seed", makes it again."""

    name: str
    scene: Scene
    start: State
    settings: Settings


# -- laws of a user's own --------------------------------------------------------------------------


class Damped(Law):
    """This law restores less the faster balls meet."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        e = pair.restitution / (1.0 + 0.2 * abs(a.n - b.n))
        return super().ball_ball(a, b, pair._replace(restitution=e))

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        return NT(-0.5 * restitution * v.n, v.t)


class OneByOne(Law):
    """This law answers contacts of one instant one by one."""

    def together(self, contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
        for contact in contacts:
            if closing_speed(contact, velocity) > 0.0:
                respond(contact, velocity)


class Dull(Law):
    """This law lets balls that meet at one instant not bounce, and calls ``respond`` for none."""

    def together(self, contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
        for contact in contacts:
            closing, (nx, ny) = closing_speed(contact, velocity), contact.normal
            if closing <= 0.0:
                continue
            if contact.b == NO_BALL:
                respond(contact, velocity)
                continue
            share = contact.pair.m_b / (contact.pair.m_a + contact.pair.m_b)
            for i, by in ((contact.a, -share * closing), (contact.b, (1.0 - share) * closing)):
                (x, y) = velocity[i]
                velocity[i] = x + by * nx, y + by * ny


class Bursting(Law):
    """This law answers fast hits by a number that is not finite."""

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        return NT(math.inf, v.t) if v.n < -1.0 else super().cushion(v, restitution, friction)


OWN_LAWS = (Damped(), OneByOne(), Dull(), Bursting())


# -- what scenes are made of -----------------------------------------------------------------------


def restitution(rnd: random.Random) -> Restitution:
    """Return coefficients, often 0 or 1."""
    ball, cue, cushion = (rnd.choice((0.0, 0.5, 0.9, 1.0, rnd.random())) for _ in range(3))
    return Restitution(ball, rnd.choice((None, cue)), cushion)


def friction(rnd: random.Random) -> Friction:
    """Return coefficients of sliding, often 0 between balls and at cushions."""
    cushion, ball = (rnd.choice((0.0, 0.05, 0.2, 1.0, rnd.random())) for _ in range(2))
    return Friction(rnd.choice((0.02, 0.1, 0.2, 0.5)), cushion, ball)


def some_velocity(rnd: random.Random) -> Point:
    """Return a velocity (m/s) of any direction."""
    speed, angle = 10 ** rnd.uniform(-1.5, 0.8), rnd.uniform(-math.pi, math.pi)
    return speed * math.cos(angle), speed * math.sin(angle)


def scattered(rnd: random.Random, table: Table, count: int, size: Point, **parts: Any) -> Scene:
    """Return balls of radii within ``size`` (m) anywhere on a table; three of four move."""
    x0, y0, x1, y1 = table.bounds
    has = {"restitution": restitution(rnd), "friction": friction(rnd), "physics": law(rnd), **parts}
    balls: tuple[Ball, ...] = ()
    scene: Scene | None = None
    for _ in range(300):
        if len(balls) == count:
            break
        place, r = (rnd.uniform(x0, x1), rnd.uniform(y0, y1)), rnd.uniform(*size)
        mass = M * (r / R) ** 2 * rnd.choice((1.0, 1.0, 10 ** rnd.uniform(-1.5, 1.5)))
        moves = some_velocity(rnd) if rnd.random() < 0.75 else STAY
        ball = Ball(str(len(balls)), place, r, mass, cue=not balls, velocity=moves)
        try:
            scene = Scene((*balls, ball), table, **has)
        except SceneError:
            continue
        balls = scene.balls
    if scene is None:
        raise SceneError([])
    return replace(scene, balls=balls)


def law(rnd: random.Random, max_time: float | None = None) -> Physics:
    """Return physics with one of the laws that scenes may name, now and then on the Moon."""
    gravity = rnd.choice((STANDARD_GRAVITY, STANDARD_GRAVITY, STANDARD_GRAVITY, 1.62))
    return Physics(rnd.choice(LAWS), gravity, max_time)


def rolling(rnd: random.Random, scene: Scene) -> Scene:
    """Return the scene with balls that slide, then roll, some of them without end."""
    rolls = [rnd.choice((0.0, 1.0, rnd.uniform(-3.0, 3.0))) for _ in scene.balls]
    least = scene.friction.surface * rnd.choice((0.0, 0.02, 0.1, rnd.random()))
    return replace(
        scene,
        balls=tuple(replace(b, roll=roll) for b, roll in zip(scene.balls, rolls, strict=True)),
        friction=replace(scene.friction, rolling=least),
        physics=scene.physics if least else replace(scene.physics, max_time=LATEST),
    )


# -- kinds of scenes whose balls slide -------------------------------------------------------------


def discs(table: str) -> Draw:
    """Return what draws discs of different sizes and masses on a table, all of one law."""

    def drawn(rnd: random.Random) -> Scene:
        scene = random_scene(rnd.getrandbits(40), table, rnd.choice(LAWS))
        heavier = [replace(ball, mass=ball.mass * 10 ** rnd.uniform(-1, 2)) for ball in scene.balls]
        heavier[-1] = replace(heavier[-1], cue=rnd.random() < 0.5)
        cue = rnd.choice((None, rnd.random()))
        own = replace(scene.restitution, cue_ball=cue)
        return replace(scene, balls=tuple(heavier), restitution=own)

    return drawn


def pockets(rnd: random.Random) -> Scene:
    """Return balls between pockets, in corners or anywhere; nets have no rims."""
    table = rnd.choice((RECTANGLE, ELL, STADIUM))
    scene = scattered(rnd, table, rnd.randint(2, 9), (0.02, 0.05))
    x0, y0, x1, y1 = table.bounds
    corners = [*table.outline, ((x0 + x1) / 2.0, y0)]
    found: list[Pocket] = []
    for k in range(rnd.randint(1, 8)):
        anywhere = rnd.uniform(x0, x1), rnd.uniform(y0, y1)
        place, radius = rnd.choice((rnd.choice(corners), anywhere)), rnd.uniform(0.02, 0.25)
        if all(math.dist(ball.position, place) > 1.05 * radius for ball in scene.balls):
            found.append(Pocket(f"p{k}", place, radius))
    return replace(scene, pockets=tuple(found), friction=replace(scene.friction, surface=0.05))


def broken_rack(rnd: random.Random) -> Scene:
    """Return a rack with gaps or frozen, in the open or on a table, and a ball that breaks it."""
    gap = rnd.choice((0.0, 0.0, 1e-6, 10 ** rnd.uniform(-4, -2)))
    balls = rack((1.2, 0.5), radius=R, mass=M, rows=rnd.choice((2, 3, 4, 5)), gap=gap)
    aside = rnd.choice((0.0, 0.0, rnd.uniform(-0.02, 0.02)))
    goes = rnd.uniform(0.5, 6.0), rnd.choice((0.0, rnd.uniform(-0.1, 0.1)))
    cue = Ball("C", (0.5, 0.5 + aside), R, rnd.choice((M, 0.2)), cue=True, velocity=goes)
    table = rnd.choice((None, RECTANGLE))
    return Scene((cue, *balls), table, restitution(rnd), friction(rnd), law(rnd))


def lattice(rnd: random.Random) -> Scene:
    """Return balls that touch, on a lattice or anywhere, some at a cushion; some of them move."""
    step, places = rnd.choice((math.pi / 3, math.pi / 2, 0.0)), [(0.0, 0.0)]
    count, tries = rnd.randint(2, 9), 0
    while len(places) < count and (tries := tries + 1) < 500:
        x, y = rnd.choice(places)
        angle = rnd.randrange(6) * step if step else rnd.uniform(0.0, math.tau)
        place = x + 2.0 * R * math.cos(angle), y + 2.0 * R * math.sin(angle)
        if all(math.dist(place, other) > 2.0 * R * (1.0 - 1e-13) for other in places):
            places.append(place)
    low = min(y for _, y in places) if rnd.random() < 0.5 else -0.5
    widest = rnd.choice((0.0, 0.0, 1.0, 3.0))
    moves = rnd.choice((0.2, 0.5, 1.0))
    balls = [
        Ball(str(k), (1.0 + x, y - low + R), R, M * 10 ** rnd.uniform(0.0, widest),
             velocity=some_velocity(rnd) if rnd.random() < moves else STAY)
        for k, (x, y) in enumerate(places)
    ]  # fmt: skip
    if rnd.random() < 0.6:
        balls.append(shot_at(rnd, rnd.choice(balls)))
    scene = Scene(tuple(balls), RECTANGLE, restitution(rnd), friction(rnd), law(rnd))
    return scene if rnd.random() < 0.8 else replace(scene, table=None)


def shot_at(rnd: random.Random, ball: Ball) -> Ball:
    """Return a cue ball that goes to another one, mostly to its middle."""
    (x, y), away, far = ball.position, rnd.uniform(-math.pi, math.pi), rnd.uniform(0.1, 0.4)
    c, s, speed = math.cos(away), math.sin(away), rnd.uniform(0.2, 4.0)
    aside = rnd.choice((0.0, rnd.uniform(-1.5, 1.5) * R))
    place = x + far * c - aside * s, y + far * s + aside * c
    return Ball("C", place, R, M, cue=True, velocity=(-speed * c, -speed * s))


def grid(rnd: random.Random) -> Scene:
    """Return balls at places of a grid with whole velocities: much happens at one instant.

    Balls come to corners, meet head-on without a slip, and mirror each other.
    """
    r, cells = 1.0 / 32.0, [(x, y) for x in range(1, 16) for y in range(1, 8)]
    places = rnd.sample(cells, rnd.randint(2, 8))
    if rnd.random() < 0.4:  # The other half is a mirror image.
        places = sorted({*places, *((16 - x, y) for x, y in places if x != 8)})
    speeds = (-1.0, 0.0, 0.0, 0.5, 1.0, 2.0)
    balls: list[Ball] = []
    for x, y in places:
        velocity = rnd.choice(speeds), rnd.choice(speeds)
        twin = next((b for b in balls if b.position == (2.0 - x / 8.0, y / 8.0)), None)
        if twin is not None and rnd.random() < 0.8:
            velocity = -twin.velocity[0], twin.velocity[1]
        mass = 0.25 * rnd.choice((1.0, 1.0, 2.0))
        balls.append(Ball(f"{x}.{y}", (x / 8.0, y / 8.0), r, mass, velocity=velocity))
    table = rnd.choice((RECTANGLE, RECTANGLE, RECTANGLE, None))
    return Scene(tuple(balls), table, restitution(rnd), friction(rnd), law(rnd))


def no_slip(rnd: random.Random) -> Scene:
    """Return balls in a line that meet without a slip, where the law `published` jumps."""
    turn, count = rnd.choice((0.0, math.pi / 2, rnd.uniform(0.0, math.tau))), rnd.randint(2, 4)
    c, s = math.cos(turn), math.sin(turn)
    gaps, along = [rnd.choice((0.0, 1e-9, 0.01, 0.1)) for _ in range(count)], rnd.choice((0.0, 0.3))
    balls, far = list[Ball](), 0.0
    for k, gap in enumerate(gaps):
        fast = rnd.uniform(0.3, 3.0) if k == 0 else rnd.choice((0.0, 0.0, -0.5))
        velocity = fast * c - along * s, fast * s + along * c
        moves = velocity if fast != 0.0 or rnd.random() < 0.3 else STAY
        mass = M * rnd.choice((1.0, 1.0, 2.0))
        balls.append(Ball(str(k), (1.0 + far * c, 0.5 + far * s), R, mass, velocity=moves))
        far += 2.0 * R + gap
    rough = replace(friction(rnd), ball_ball=rnd.choice((0.05, 0.5)))
    physics = replace(law(rnd), law="published")
    return Scene(tuple(balls), None, restitution(rnd), rough, physics)


def unequal(rnd: random.Random) -> Scene:
    """Return balls whose radii go from 1 to 5, and their masses over decades."""
    return scattered(rnd, RECTANGLE, rnd.randint(3, 12), (0.02, 0.1))


def no_friction(rnd: random.Random) -> Scene:
    """Return balls that never come to rest, of which some rest for ever."""
    free = replace(friction(rnd), surface=0.0)
    table = rnd.choice((RECTANGLE, ELL, STADIUM))
    parts: dict[str, Any] = {"friction": free, "physics": law(rnd, LATEST)}
    return scattered(rnd, table, rnd.randint(2, 8), (0.02, 0.06), **parts)


def some_posts(rnd: random.Random) -> tuple[Post, ...]:
    """Return posts and pins, some with their own coefficients."""
    return tuple(
        Post((rnd.uniform(0.2, 1.8), rnd.uniform(0.2, 0.8)), rnd.choice((0.0, 0.0, 0.02, 0.1)),
             rnd.choice((None, 0.0, 0.5, 1.0)), rnd.choice((None, 0.0, 0.3)))
        for _ in range(rnd.randint(1, 4))
    )  # fmt: skip


def posts(rnd: random.Random) -> Scene:
    """Return balls between posts and pins."""
    table = rnd.choice((RECTANGLE, STADIUM))
    return scattered(rnd, table, rnd.randint(2, 8), (0.02, 0.05), posts=some_posts(rnd))


def bulges(rnd: random.Random) -> Scene:
    """Return a table whose sides bulge outwards, inwards, or do both."""
    corners = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
    bulge = tuple(rnd.choice((0.0, rnd.uniform(-0.2, 0.0), rnd.uniform(0.0, 0.9))) for _ in "abcd")
    table = rnd.choice((Table(corners, bulge), STADIUM, Table.circle(0.6)))
    return scattered(rnd, table, rnd.randint(1, 7), (0.02, 0.06))


def star(rnd: random.Random) -> Scene:
    """Return a table with corners that stick out, and balls before them."""
    count, near = rnd.choice((3, 4, 5, 6)), rnd.uniform(0.3, 0.6)
    outline = tuple(
        (rnd.choice((0.9, 1.0)) * (1.0, near)[k % 2] * math.cos(math.pi * k / count),
         (1.0, near)[k % 2] * math.sin(math.pi * k / count))
        for k in range(2 * count)
    )  # fmt: skip
    return scattered(rnd, Table(outline), rnd.randint(2, 7), (0.015, 0.05))


def on_patches(rnd: random.Random) -> Scene:
    """Return balls between posts on a table with patches, some of them of ice."""
    x, y = rnd.uniform(0.3, 1.7), rnd.uniform(0.2, 0.8)
    corners = ((x - 0.3, y - 0.2), (x + 0.3, y - 0.1), (x + 0.1, y), (x + 0.2, y + 0.3))
    laid = (
        Patch(center=(y, x / 2.0), radius=rnd.uniform(0.1, 0.6), surface=rnd.uniform(0.05, 0.9)),
        Patch(corners, surface=rnd.choice((0.0, 0.02, 0.9))),
        Patch(((1.0, 0.0), (1.5, 0.0), (1.5, 1.0), (1.0, 1.0)), surface=0.4),
    )
    patches = tuple(rnd.sample(laid, rnd.randint(1, 3)))
    post = some_posts(rnd) if rnd.random() < 0.3 else ()
    table = rnd.choice((RECTANGLE, STADIUM))
    parts: dict[str, Any] = {"patches": patches, "posts": post, "physics": law(rnd, LATEST)}
    return faster(scattered(rnd, table, rnd.randint(1, 5), (0.02, 0.05), **parts), 2.0)


def faster(scene: Scene, times: float) -> Scene:
    """Return the scene with balls that move so many times as fast."""
    balls = scene.balls
    return replace(
        scene, balls=tuple(replace(b, velocity=scaled(b.velocity, times)) for b in balls)
    )


def scaled(vector: Point, times: float) -> Point:
    """Return a vector, so many times as long."""
    return times * vector[0], times * vector[1]


def many(rnd: random.Random) -> Scene:
    """Return a gas of some dozens of balls."""
    scene = gas(rnd.choice((12, 30, 45)), rnd.choice((0.1, 0.3)), 1.0)
    moved = tuple(replace(ball, velocity=some_velocity(rnd)) for ball in scene.balls)
    return replace(
        scene, balls=moved, physics=law(rnd, 1.0), friction=friction(rnd),
        restitution=restitution(rnd),
    )  # fmt: skip


def extreme(rnd: random.Random) -> Scene:
    """Return balls on a table of any size, at any speed, of any mass."""
    scene = scattered(rnd, RECTANGLE, rnd.randint(2, 6), (0.02, 0.06))
    assert scene.table is not None
    size, speed, mass = (10 ** rnd.uniform(-6, 6) for _ in "xvm")
    speed = rnd.choice((speed, speed, speed, 1e150, 1e300))
    table = Table(tuple(scaled(corner, size) for corner in scene.table.outline))
    balls = tuple(
        replace(
            ball, position=scaled(ball.position, size), velocity=scaled(ball.velocity, speed),
            radius=size * ball.radius, mass=mass * ball.mass,
        )
        for ball in scene.balls
    )  # fmt: skip
    return replace(scene, table=table, balls=balls)


SLIDING: dict[str, Draw] = {
    **{f"discs on {table}": discs(table) for table in TABLES},
    "pockets": pockets,
    "rack": broken_rack,
    "lattice": lattice,
    "grid": grid,
    "no slip": no_slip,
    "unequal": unequal,
    "no friction": no_friction,
    "posts": posts,
    "bulges": bulges,
    "star": star,
    "patches": on_patches,
    "many": many,
    "extreme": extreme,
}

# -- further kinds ---------------------------------------------------------------------------------


def of_reference(make: Callable[[str, str, random.Random], Scene]) -> Draw:
    """Return what draws scenes that the independent reference has, too."""
    return lambda rnd: make(rnd.choice(LAWS[:2]), rnd.choice(sorted(reference.OUTLINES)), rnd)


def hard(rnd: random.Random) -> Scene:
    """Return squeezed balls, rows, corners, balls that are slow or packed."""
    kinds = ("squeeze", "corner", "row", "slow", "packed", "moving", "persistent")
    scene = random_hard_scene(rnd.choice(kinds), rnd)
    return replace(scene, physics=replace(scene.physics, law=rnd.choice(LAWS)))


def small_patches(rnd: random.Random) -> Scene:
    """Return a few balls on a small table with patches, which slide or roll."""
    return random_patches(f"core {rnd.getrandbits(40)}", physics=law(rnd))


def crowd(count: int) -> Draw:
    """Return what draws so many balls, near each other, of which some move."""

    def drawn(rnd: random.Random) -> Scene:
        scene = gas(count, 0.3, 0.5)
        few = rnd.choice((0.05, 0.5, 1.0))
        moved = tuple(
            replace(ball, velocity=some_velocity(rnd) if rnd.random() < few else STAY)
            for ball in scene.balls
        )
        return replace(scene, balls=moved, physics=law(rnd, 0.5), restitution=restitution(rnd))

    return drawn


ROLLS = " that rolls"
LONG: dict[str, Draw] = {"crowd of 60": crowd(60), "crowd of 250": crowd(250)}
OTHERS: dict[str, Draw] = {
    "reference": of_reference(reference.random_scene),
    "reference with pockets": of_reference(reference.random_pocket_scene),
    "reference that rolls": of_reference(reference.random_rolling_scene),
    "reference with arcs": of_reference(reference.random_round_scene),
    "hard": hard,
    "press": lambda rnd: press_scene(rnd.getrandbits(40)),
    "small table": lambda rnd: small_table(rnd.getrandbits(40)),
    "small patches": small_patches,
}


def with_rolls(draw: Draw) -> Draw:
    """Return what draws the same scenes, but whose balls roll."""
    return lambda rnd: rolling(rnd, draw(rnd))


SCENES: dict[str, Draw] = {
    **SLIDING,
    **{kind + ROLLS: with_rolls(draw) for kind, draw in SLIDING.items()},
    **OTHERS,
    **LONG,
}

# -- starts and settings ---------------------------------------------------------------------------


def usual(scene: Scene) -> Settings:
    """Return the settings of a whole run by the scene's law, which Python plays."""
    return Settings(None, max_time=scene.physics.max_time)


def drawn(rnd: random.Random, kind: str) -> Scene:
    """Return a scene of a kind."""
    while True:
        try:
            return SCENES[kind](rnd)
        except (SceneError, reference.Refused):
            continue


def varied(rnd: random.Random, scene: Scene, start: State) -> tuple[State, Settings]:
    """Return the start and settings of a run: as it is, or cut off, or a variant, by any law."""
    settings = usual(scene)._replace(max_events=MOST)
    if rnd.random() < 0.15:
        settings = settings._replace(law=rnd.choice(OWN_LAWS))
    if rnd.random() < 0.15:
        settings = settings._replace(max_events=rnd.randint(1, 12))
    if rnd.random() < 0.15:
        latest = 10 ** rnd.uniform(-2.0, 0.5)
        settings = settings._replace(max_time=min(latest, settings.max_time or math.inf))
    what = rnd.random()
    variant = AS_IT_IS
    if what < 0.15:
        variant = Variant(seed=rnd.randrange(6))
    elif what < 0.3:
        variant = Variant(nudge=rnd.randrange(8))
        start = nudged(scene, start, variant.nudge or 0)
    elif what < (0.6 if settings.law_of(scene).name == "published" else 0.4):
        variant = Variant(slip=rnd.choice(SLIPS).slip)
    return start, settings._replace(variant=variant)


def some_off(rnd: random.Random, kind: str) -> tuple[Scene, State]:
    """Return a scene some of whose balls are off the table."""
    scene = drawn(rnd, kind)
    start = scene.start(None)
    gone = {ball.id for ball in scene.balls if rnd.random() < 0.3}
    still = tuple(
        STAY if b.id in gone else v for b, v in zip(scene.balls, start.velocity, strict=True)
    )
    start = start._replace(off=frozenset(gone), velocity=still)
    if start.roll is not None:
        turns = tuple(
            STAY if b.id in gone else w for b, w in zip(scene.balls, start.roll, strict=True)
        )
        start = start._replace(roll=turns)
    return scene, start


def spun(rnd: random.Random, kind: str) -> tuple[Scene, State]:
    """Return a scene whose balls have rolls of any direction, those at rest, too."""
    scene = drawn(rnd, kind.removesuffix(ROLLS) + ROLLS)
    rolls = tuple(some_velocity(rnd) if rnd.random() < 0.7 else STAY for _ in scene.balls)
    return scene, scene.start(None)._replace(roll=rolls)


def sunk(rnd: random.Random, _: str) -> tuple[Scene, State]:
    """Return balls that lie in each other and in cushions, as far as a start may have it."""
    scene = drawn(rnd, "lattice" + rnd.choice(("", ROLLS)))
    start, far = scene.start(None), rnd.choice((1e-12, 1e-6, 0.3 * SUNK)) * R
    moved = tuple(
        (x + far * rnd.uniform(-1.0, 1.0), y + far * rnd.uniform(-1.0, 1.0))
        for x, y in start.position
    )
    return scene, scene.state(start._replace(position=moved))


def gone_on(rnd: random.Random, kind: str) -> tuple[Scene, State]:
    """Return a scene that goes on from where another run of it was cut off."""
    scene = drawn(rnd, kind)
    latest = 10 ** rnd.uniform(-1.5, 0.5)
    how = usual(scene)._replace(max_time=latest, max_events=rnd.choice((3, 10, MOST)))
    before = outcome(Case("", scene, scene.start(None), how)).trace
    if before is None:
        return gone_on(rnd, kind)
    start = end_of(scene, scene.start(None), before)
    moves = [i for i, b in enumerate(scene.balls) if b.id not in start.off and rnd.random() < 0.3]
    new = tuple(some_velocity(rnd) if i in moves else v for i, v in enumerate(start.velocity))
    return scene, start._replace(velocity=new)


def end_of(scene: Scene, start: State, trace: Trace) -> State:
    """Return the state at the end of a run."""
    rows = [own[-1] for own in trace.knots]
    taken = {scene.balls[row[2][0]].id for row in trace.events if row[1] == "pocket"}
    return State(
        tuple((row[1], row[2]) for row in rows),
        tuple((row[3], row[4]) for row in rows),
        start.off | taken,
        None if start.roll is None else tuple((row[7], row[8]) for row in rows),
    )


@cache
def bundled_scene(name: str) -> Scene:
    """Return a bundled scene."""
    return load(name)


def own_shots(name: str) -> Iterator[Case]:
    """Yield the shots of a bundled scene; some go on from the end of the one before."""
    scene, end = bundled_scene(name), None
    for shot in scene.shots:
        start = scene.start(shot, end if shot.from_previous else None)
        yield Case(f"{name}, {shot.name}", scene, start, usual(scene))
        end = end_of(scene, start, solve(scene, start, usual(scene)))


def bundled_shot(name: str, seed: int) -> Case:
    """Return a random shot of a bundled scene, by the settings of the scene or others."""
    rnd, scene = random.Random(f"core {name} {seed}"), bundled_scene(name)
    ball = scene.cue or rnd.choice(scene.balls)
    roll = rnd.choice((0.0, 1.0, rnd.uniform(-1.0, 1.0))) if scene.surface.rolls else 0.0
    angle, speed = rnd.uniform(-180.0, 180.0), rnd.uniform(0.3, 8.0)
    shot = Shot("random", ball.id, speed=speed, angle=angle, roll=roll)
    start, settings = scene.start(shot), usual(scene)._replace(max_events=2 * MOST)
    if rnd.random() < 0.5:
        start, settings = varied(rnd, scene, start)
    return Case(f"{name} {seed}", scene, start, settings)


STARTS: dict[str, Callable[[random.Random, str], tuple[Scene, State]]] = {
    "off the table": some_off,
    "spun": spun,
    "sunk": sunk,
    "goes on": gone_on,
}
BUNDLED = tuple(bundled())
KINDS = (*SCENES, *STARTS)
SHORT = tuple(kind for kind in KINDS if kind not in LONG)


def case_of(name: str) -> Case:
    """Return the case of a name: a kind or a bundled scene, and a seed."""
    kind, _, seed = name.rpartition(" ")
    if kind in BUNDLED:
        return bundled_shot(kind, int(seed))
    rnd = random.Random(f"core {name}")
    if kind in STARTS:
        scene, start = STARTS[kind](rnd, rnd.choice(tuple(SLIDING)) + rnd.choice(("", ROLLS)))
    else:
        scene = drawn(rnd, kind)
        start = scene.start(None)
    return Case(name, scene, *varied(rnd, scene, start))


LONG_EVERY = 50  # A case of a kind that takes long comes after 49 others.


def names(kinds: Sequence[str] = (), first: int = BASE_SEED) -> Iterator[str]:
    """Yield names of cases of these kinds in turn, by default of all; those of LONG are rare."""
    seeds: defaultdict[str, int] = defaultdict(lambda: first)
    turn = 0
    while True:
        for kind in kinds or SHORT:
            turn += 1
            chosen = kind if kinds or turn % LONG_EVERY else tuple(LONG)[turn // LONG_EVERY % 2]
            yield f"{chosen} {seeds[chosen]}"
            seeds[chosen] += 1


# -- the core -------------------------------------------------------------------------------------


class Outcome(NamedTuple):
    """A run came to a trace, or to an error."""

    trace: Trace | None
    error: str = ""


def outcome(case: Case) -> Outcome:
    """Play a case by the core, and return its trace, or the error that it raises."""
    try:
        return Outcome(solve(case.scene, case.start, case.settings))
    except Exception as error:
        return Outcome(None, f"{type(error).__name__}: {error}")


# -- two traces ------------------------------------------------------------------------------------


def parts_of(trace: Trace) -> dict[str, list[Any]]:
    """Return all that a trace has, in lists; what adds up an impulse is asked for it."""
    events = [
        (t, kind, balls, where, push if push is None else tuple(push() if callable(push) else push))
        for t, kind, balls, where, push in trace.events
    ]
    points = [(row[0], i, row) for i, rows in enumerate(trace.knots) for row in rows]
    return {
        "event": events,
        "breakpoint (s, ball)": sorted(points, key=lambda point: point[:2]),
        "warning": list(trace.warned.items()),
        "policy": sorted(trace.policies),
        "instant": list(trace.instants),
        "end": [("status", trace.status), ("duration", trace.duration), ("steps", trace.steps)],
        "persistent contact": list(trace.persisted),
        "roll at rest": list(trace.no_roll),
    }


def same(one: Trace, other: Trace) -> str:
    """Return an empty string if two traces have the same bits; else say where they first differ.

    ``repr`` tells all digits of a float, the sign of a zero, and a float from any other number.
    """
    pairs = zip(parts_of(one).items(), parts_of(other).values(), strict=True)
    said = [differ(what, a, b) for (what, a), b in pairs if repr(a) != repr(b)]
    return "; ".join(said)


def differ(what: str, one: list[Any], other: list[Any]) -> str:
    """Say where two lists of this differ first."""
    for k, (a, b) in enumerate(zip(one, other, strict=False)):
        if repr(a) != repr(b):
            return f"{what} {k} of {len(one)}, {entries(a, b)}"
    if len(one) > len(other):
        return f"{what} {len(other)} of {len(one)} is missing: {one[len(other)]}"
    return f"{what} {len(one)} is one too many: {other[len(one)]}"


def entries(one: Any, other: Any) -> str:
    """Say which entries differ of two rows, which begin with the time (s)."""
    a, b = flat(one), flat(other)
    if len(a) != len(b):
        return f"is {other}, not {one}"
    return f"which begins {a[:3]}: " + ", ".join(
        f"entry {k} is {y}, not {x}"
        for k, (x, y) in enumerate(zip(a, b, strict=True))
        if repr(x) != repr(y)
    )


def flat(row: Any) -> list[Any]:
    """Return the entries of a row whose entries may be rows."""
    return [x for each in row for x in flat(each)] if isinstance(row, tuple) else [row]


def digest(found: Outcome) -> str:
    """Return a hash of all that came of a run."""
    said = found.error if found.trace is None else parts_of(found.trace)
    return sha256(repr(said).encode()).hexdigest()


def digests(count: int) -> list[str]:
    """Return hashes of what the core makes of this many cases, and of a shot of each bundled scene.

    Compiled or not, they are the same.
    """
    chosen = [*islice(names(), count), *(f"{name} {BASE_SEED}" for name in BUNDLED)]
    return [f"{name}: {digest(outcome(case_of(name)))}" for name in chosen]


if __name__ == "__main__":
    if sys.argv[1] == "--kinds":
        print(*KINDS, *BUNDLED, sep="\n")
    else:
        print(*digests(int(sys.argv[2])), sep="\n")
