"""Live tables whose walls all move, beside the exact solver, which knows no walls that move.

By Galileo, a table without friction of its surface that moves evenly with all its balls has the
hits of one at rest, and ends there, shifted by its motion. Friction of cushions and balls depends
on relative velocities, so it may be there, and so may gravity.

``python -m tests.world.test_moving_frames 500`` plays so many random scenes, and prints which
differ.
"""

from __future__ import annotations

import cmath
import math
import random
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import pymunk

from pool_pymunk import Billiards, Pair, Scene, SceneError, simulate
from pool_pymunk.core.record import BALL_BALL, BALL_CUSHION
from pool_pymunk.model.parts import Ball
from pool_pymunk.world import ContactEvent
from tests.oracle import turning_reference as turning
from tests.oracle.reference import Refused
from tests.shared.amplified import amplification
from tests.shared.core_scenes import STADIUM, R, no_friction, some_posts
from tests.shared.scenes import BASE_SEED, seeds

Point = tuple[float, float]
Hit = tuple[float, tuple[str, ...]]  # when (s), and which balls
End = dict[str, Point]  # places (m) of balls, by their ids

SECONDS = 0.6
LENGTHS = 1 / 60, 1 / 240, SECONDS  # s; the steps
ROUNDING = 1e-12  # m and s
BLURRED = 1e-3  # m and s; where rounding moves ends by more, they tell nothing
OFTEN = 9  # hits of the same two are usual; more of them collapse, or jam a ball
QUICK, LONG = 2, 500  # random scenes


class Frame(NamedTuple):
    """A frame moves with a velocity (m/s); the bodies of its walls stand somewhere (m)."""

    velocity: Point
    stands: Point


def scene_of(seed: int) -> Scene:
    """Return a scene without friction of the surface, perhaps with posts."""
    rnd = random.Random(f"frames {seed}")
    while True:
        try:
            scene = no_friction(rnd)
            if scene.table == STADIUM or scene.physics.law == "published":
                continue  # Walls that move have no arcs, and this law may ask rounding.
            posts = some_posts(rnd) if rnd.random() < 0.4 else ()
            if 0.0 in (scene.restitution.cushion, *(post.restitution for post in posts)):
                continue  # Balls glide along such walls, and rounding decides at their ends.
            physics = replace(scene.physics, max_time=SECONDS)
            tilt = (rnd.gauss(0, 3), rnd.gauss(-6, 6)) if rnd.random() < 0.5 else (0.0, 0.0)
            table = scene.table and replace(scene.table, tilt=tilt)
            return replace(scene, physics=physics, posts=posts, table=table)
        except SceneError:
            continue


def frame_of(seed: int) -> Frame:
    """Return a frame that moves at any speed up to some 3 m/s."""
    rnd = random.Random(f"moves {seed}")
    return Frame((rnd.gauss(0, 1), rnd.gauss(0, 1)), (rnd.uniform(-1, 1), rnd.uniform(-1, 1)))


def table_in(scene: Scene, frame: Frame, dt: float) -> Billiards:
    """Return a live table with the balls and the walls of a scene, all of which move."""
    (vx, vy), (px, py) = frame
    own, rubs = scene.restitution, scene.friction
    balls = scene.balls

    def pair(i: int, j: int) -> Pair:
        e = own.cue_ball if balls[i].cue or balls[j].cue else None
        hits = own.ball_ball if e is None else e
        return Pair(balls[i].mass, balls[j].mass, hits or 0.0, rubs.ball_ball)

    space = pymunk.Space()
    space.gravity = scene.tilt
    table = Billiards(space, dt, pair=pair, law=scene.physics.law)

    def put(shape: Any, e: float | None, mu: float | None) -> None:
        shape.body.position, shape.body.velocity = (px, py), (vx, vy)
        e, mu = own.cushion if e is None else e, rubs.cushion if mu is None else mu
        table.add_wall(shape, e or 0.0, mu)

    assert scene.table is not None
    outline = [(x - px, y - py) for x, y in scene.table.outline]
    for a, b in pairwise([*outline, outline[0]]):
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        put(pymunk.Segment(body, a, b, 0.0), None, None)
    for post in scene.posts:
        body, (x, y) = pymunk.Body(body_type=pymunk.Body.KINEMATIC), post.position
        put(pymunk.Circle(body, post.radius, (x - px, y - py)), post.restitution, post.friction)
    for ball in balls:
        body, (ux, uy) = pymunk.Body(ball.mass, 1e-4), start_of(ball)
        body.position, body.velocity = ball.position, (ux + vx, uy + vy)
        table.add_ball(pymunk.Circle(body, ball.radius), id=ball.id)
    return table


def start_of(ball: Ball) -> Point:
    """Return the velocity (m/s) with which a ball begins."""
    return ball.velocity or (0.0, 0.0)


def played(scene: Scene, frame: Frame, dt: float) -> tuple[End, list[Hit]]:
    """Play a scene in a frame, and return where its balls end there, and all hits."""
    table, hits = table_in(scene, frame, dt), list[Hit]()

    def on_contact(contact: ContactEvent) -> None:
        hits.append((contact.t, tuple(sorted(str(ball.id) for ball in contact.balls))))

    table.on_contact = on_contact
    for _ in range(round(SECONDS / dt)):
        table.space.step(dt)
    (vx, vy), t = frame.velocity, table.time
    ends = {}
    for ball in table.balls:
        x, y = ball.body.position
        ends[str(ball.id)] = x - t * vx, y - t * vy
    return ends, hits


class Apart(NamedTuple):
    """Ends (m) and hits (s) are apart so far, in units of rounding times amplification."""

    ends: float
    times: float
    are_same_hits: bool

    @property
    def is_much(self) -> bool:
        """Tell whether that is more than rounding."""
        return max(self.ends, self.times) > 1.0 or not self.are_same_hits


def compared(seed: int) -> dict[float, Apart]:
    """Compare a table in a frame that moves, by the steps' length, with the solver's that stands.

    There is nothing to compare where rounding decides, where contacts persist, which are played to
    a tolerance, and where a ball meets something so often that the hits collapse, or that a wall
    that moves would jam it.
    """
    scene, frame = scene_of(seed), frame_of(seed)
    run = simulate(scene, solver="event-driven")
    exact = [event for event in run.events if event.kind in (BALL_BALL, BALL_CUSHION)]
    met = Counter((event.balls, event.cushion) for event in exact)
    growth = [ROUNDING * grown for grown in amplification(scene, run)]
    if max(met.values(), default=0) > OFTEN or max(growth) > BLURRED or run.persistent:
        return {}
    found = dict[float, Apart]()
    for dt in LENGTHS:
        ends, hits = played(scene, frame, dt)
        late = [abs(t - event.t) for (t, _), event in zip(hits, exact, strict=False)]
        found[dt] = Apart(
            max(math.dist(ends[id_], run.final[id_]) for id_ in ends) / growth[0],
            max(late, default=0.0) / growth[1],
            Counter(who for _, who in hits) == Counter(tuple(sorted(e.balls)) for e in exact),
        )
    return found


def apart(drawn: Sequence[int]) -> list[tuple[int, float, Apart]]:
    """Return scenes and steps at which a frame that moves makes a difference.

    At least half of the scenes have to tell something.
    """
    found = {seed: compared(seed) for seed in drawn}
    assert sum(map(bool, found.values())) >= 0.5 * len(drawn)
    return [(seed, dt, one) for seed in drawn for dt, one in found[seed].items() if one.is_much]


def test_a_table_that_moves_ends_where_one_at_rest_does() -> None:
    assert not apart(seeds(QUICK))


def test_many_tables_that_move_end_where_those_at_rest_do() -> None:
    assert not apart(seeds(LONG))


# -- walls that turn -------------------------------------------------------------------------------

TURNING = 1e-9  # m; a start is nudged so far
FENCE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))  # m


def bars_of(rnd: random.Random) -> list[turning.Bar]:
    """Return a fence that stands, and one or two bars, boxes or discs that turn and move."""
    e, mu = rnd.uniform(0.6, 1.0), rnd.choice((0.0, 0.1, 0.5))
    lines = pairwise([complex(*each) for each in (*FENCE, FENCE[0])])
    bars = [turning.Bar((a, b), 0.0, 0j, 0.0, 0j, 0.0, e, mu) for a, b in lines]
    for x in rnd.sample((0.6, 1.4), rnd.randint(1, 2)):
        w, h = rnd.uniform(0.05, 0.25), rnd.uniform(0.02, 0.1)
        box = complex(-w, -h), complex(w, -h), complex(w, h), complex(-w, h)
        corners = rnd.choice([box, (complex(-w, h), complex(0.1, -h)), (complex(w, h),)])
        thick = rnd.uniform(0.02, 0.1) if len(corners) == 1 else rnd.choice((0.0, 0.01))
        bars.append(turning.Bar(
            corners, thick, complex(x, 0.5), rnd.uniform(0.0, 6.0),
            complex(rnd.uniform(-0.1, 0.1), rnd.uniform(-0.1, 0.1)), rnd.choice((1, -1))
            * 10 ** rnd.uniform(-0.5, 1.2), rnd.uniform(0.5, 1.0), rnd.choice((0.0, 0.2)),
        ))  # fmt: skip
    return bars


def put_bar(table: Billiards, bar: turning.Bar) -> None:
    """Put up a wall like a bar."""
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    body.position, body.angle = (bar.place.real, bar.place.imag), bar.angle
    body.velocity, body.angular_velocity = (bar.velocity.real, bar.velocity.imag), bar.turns
    corners = [(z.real, z.imag) for z in bar.corners]
    shape: Any = pymunk.Poly(body, corners, radius=bar.radius)
    if len(corners) == 1:
        shape = pymunk.Circle(body, bar.radius, corners[0])
    elif len(corners) == 2:
        shape = pymunk.Segment(body, corners[0], corners[1], bar.radius)
    table.add_wall(shape, bar.restitution, bar.friction)


def turned(seed: int) -> tuple[list[turning.Bar], turning.Ball, turning.Played, float] | None:
    """Return walls, a ball, what the reference makes of it, and how a nudge grows in it."""
    rnd = random.Random(f"turns {seed}")
    bars, place = bars_of(rnd), complex(rnd.uniform(0.1, 1.9), rnd.uniform(0.1, 0.9))
    ball = turning.Ball(
        0.0, place, cmath.rect(rnd.uniform(0.3, 3.0), rnd.uniform(0.0, 6.3)),
        rnd.choice((0.0, 0.0, 0.5, 2.0)),
    )  # fmt: skip
    if min(turning.gaps(bars, ball, R, 0.0)) < 1e-3:
        return None
    try:
        played = turning.play(bars, ball, R, SECONDS)
        near = [
            turning.play(bars, replace(ball, place=place + TURNING * by), R, SECONDS)
            for by in (1, 1j)
        ]
    except Refused:
        return None
    moved = [abs(each.end - played.end) for each in near]
    for each in near:
        if [k for _, k in each.hits] != [k for _, k in played.hits]:
            return None
        moved += [abs(t - s) for (t, _), (s, _) in zip(each.hits, played.hits, strict=True)]
    return bars, ball, played, max(1.0, max(moved) / TURNING)


def too_far(drawn: Sequence[int]) -> list[tuple[int, float, float]]:
    """Return scenes and steps whose ball ends, or hits, elsewhere than in the reference.

    There have to be many hits.
    """
    found, heard = list[tuple[int, float, float]](), 0
    for seed in drawn:
        if (case := turned(seed)) is None:
            continue
        bars, start, played, grown = case
        heard += len(played.hits)
        for dt in LENGTHS:
            table = Billiards(pymunk.Space(), dt, pair=one_pair, deceleration=start.slows)
            body = pymunk.Body(0.2, 1e-4)
            body.position = start.place.real, start.place.imag
            body.velocity = start.velocity.real, start.velocity.imag
            table.add_ball(pymunk.Circle(body, R))
            for bar in bars:
                put_bar(table, bar)
            hits = list[tuple[float, int]]()
            table.on_contact = lambda one, hits=hits: hits.append((one.t, one.wall))
            for _ in range(round(SECONDS / dt)):
                table.space.step(dt)
            far = abs(complex(*body.position) - played.end)
            late = [abs(t - s) for (t, _), (s, _) in zip(hits, played.hits, strict=False)]
            is_same = [k for _, k in hits] == [k for _, k in played.hits]
            far = max(far, *late, 0.0) / grown if is_same else math.inf
            if far > ROUNDING:
                found.append((seed, dt, far))
    assert heard > 0.5 * len(drawn)
    return found


def one_pair(i: int, j: int) -> Pair:
    """Return the pair of balls that are equal."""
    return Pair(0.2, 0.2, 1.0, 0.0)


def test_a_ball_between_walls_that_turn_goes_as_in_the_reference() -> None:
    assert not too_far(seeds(QUICK))


def test_a_ball_between_many_walls_that_turn_does_so() -> None:
    assert not too_far(seeds(LONG))


if __name__ == "__main__":
    for one in apart(range(BASE_SEED, BASE_SEED + int(sys.argv[1]))):
        print(*one)
    for other in too_far(range(BASE_SEED, BASE_SEED + int(sys.argv[1]))):
        print(*other)
