"""Walls that move and kick in the core: as in the contact engine bit by bit, and closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import islice, pairwise
from typing import Any

import mpmath
import pymunk
import pytest
from core_movers import (
    DIFFERS,
    KINDS,
    NEEDLESS,
    SAME,
    WRONG,
    Mover,
    New,
    Note,
    Old,
    Play,
    Pose,
    names,
    play_of,
    verdict,
)
from core_scenes import M, R
from scenes import share_of

from pool_pymunk import Ball, Physics, Restitution, Scene
from pool_pymunk.core.engine import Engine
from pool_pymunk.laws import LAWS
from pool_pymunk.model import Point
from pool_pymunk.physics.sides import RoundSide
from pool_pymunk.world.walls import sides_of

MANY = 600  # random plays; they are played by the HANDFUL, of which a few are QUICK
HANDFUL, QUICK = len(KINDS), 6


@pytest.mark.seeded
@pytest.mark.parametrize(
    "handful",
    [pytest.param(k, marks=[pytest.mark.slow] if k >= QUICK else [])
     for k in range(share_of(MANY // HANDFUL))],
)  # fmt: skip
def test_random_walls_that_move(handful: int) -> None:
    """Balls are pushed, squeezed and jammed by discs, boxes and bars that slide, turn and kick."""
    chosen = islice(names(), HANDFUL * handful, HANDFUL * (handful + 1))
    found = [verdict(name, play_of(name)) for name in chosen]
    assert [each for each in found if each.word in WRONG] == []


# These plays have what walls that move bring about.
WITH = {
    "jam": "wedged 8", "collapse": "turned 22", "roll": "turned 58", "patch": "thrown 38",
    "pocket": "turned 47", "order": "wedged 8", "zero slip": "wedged 13", "stop": "thrown 57",
}  # fmt: skip


@pytest.mark.parametrize("what", WITH)
def test_what_walls_that_move_bring_about(what: str) -> None:
    found = verdict(WITH[what], play_of(WITH[what]))
    assert found.word == SAME
    assert what in found.heard


# Each of these plays ends otherwise if one thing is changed that hardly any other one shows. A wall
# may kick a ball again once the ball is fast; a wall that goes through a ball hits it no more; many
# hits, many meetings or a high speed jam a ball; a touch is found to the last bit; a wall that
# turns lifts a ball; the hits of a wall that moves are no collapse.
RARE = ("pressed 359", "wedged 37", "thrown 139", "pressed 516", "turned 68", "wedged 11")


@pytest.mark.parametrize("name", RARE)
def test_what_hardly_any_play_shows(name: str) -> None:
    found = verdict(name, play_of(name))
    assert found.word not in WRONG, found


class Late(New):
    """In this engine steps begin without a look at the walls."""

    def __init__(self, play: Play) -> None:
        super().__init__(play)
        self.engine = Forgetful(self.engine)  # type: ignore[assignment]


class Forgetful:
    """This engine plays on, but predicts nothing anew when a step begins."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    def begin_step(self, now: float) -> None:
        self.engine.now = now

    def __getattr__(self, name: str) -> Any:
        return getattr(self.engine, name)


class Kicking(New):
    """In this engine all walls that move kick a little more."""

    def __init__(self, play: Play) -> None:
        movers = [mover._replace(kick=mover.kick + 1e-9) for mover in play.movers]
        super().__init__(play._replace(movers=tuple(movers)))


class Giving(New):
    """In this engine contacts begin to persist where there are none."""

    def step(self, since: float, until: float, poses: Sequence[Pose]) -> bool:
        return super().step(since, until, poses) and since < 0.1


@pytest.mark.parametrize(
    ("engine", "word"), [(New, SAME), (Late, DIFFERS), (Kicking, DIFFERS), (Giving, NEEDLESS)]
)
def test_another_engine_is_found_to_differ(engine: type[New], word: str) -> None:
    assert verdict("", piston(0.9, 1.0 / 60.0, 1.0), engine).word == word


# -- closed forms ----------------------------------------------------------------------------------

Pose_at = Callable[[float], Pose]  # of a time (s)
ENGINES = (Old, New)
both = pytest.mark.parametrize("engine", ENGINES)
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


def played(engine: Any, play: Play) -> list[Note]:
    """Return what an engine tells of a play."""
    its = engine(play)
    for k, poses in enumerate(play.steps):
        assert its.step(k * play.dt, (k + 1) * play.dt, poses)
    notes: list[Note] = its.heard.notes
    return notes


def hits(notes: list[Note], wall: int = 0) -> list[tuple[float, float, float, float]]:
    """Return the times (s) of hits on a wall, the velocities (m/s) after them, and impulses."""
    return [
        (note[1], path[6], path[7], note[13])
        for note, path in pairwise(notes)
        if note[0] == "contact" and note[4] == wall
    ]


PISTON = 0.2  # m/s


def piston(e: float, dt: float, until: float) -> Play:
    """Return a ball between a piston that comes from x = 0, and a wall at x = 1."""
    ball = Ball("a", (0.5, 0.0), R, M, velocity=(1.0, 0.0))
    walls = (upright(e), going((PISTON, 0.0))), (upright(), going(place=(1.0, 0.0)))
    return on_a_plane(ball, walls, dt, until)


@both
@pytest.mark.parametrize("dt", [1 / 30, 1 / 240])
def test_a_piston_keeps_length_times_relative_speed(engine: Any, dt: float) -> None:
    """Between a piston at u and a wall, L (v - u) is the same after each hit on the piston."""
    kept = [
        (1.0 - PISTON * t - 2.0 * R) * (vx - PISTON)
        for t, vx, *_ in hits(played(engine, piston(1.0, dt, 4.0)))
    ]
    assert len(kept) == 13
    assert max(kept) - min(kept) < 1e-12


@both
@pytest.mark.parametrize(("e", "mu"), [(1.0, 0.0), (0.5, 0.0), (0.7, 0.2)])
def test_a_hit_is_that_of_the_law_in_the_walls_frame(engine: Any, e: float, mu: float) -> None:
    """v_n' - u_n = -e (v_n - u_n), and friction slows the slip relative to the wall (Eq. 9)."""
    ball = Ball("a", (0.5, 0.0), R, M, velocity=(-1.0, 0.5))
    play = on_a_plane(ball, [(upright(e, mu), going((0.4, -0.3)))], 1 / 60, 0.5)
    [(_, vx, vy, impulse)] = hits(played(engine, play))
    assert vx == pytest.approx(0.4 + e * 1.4, abs=1e-12)
    assert vy == pytest.approx(0.5 - mu * (1.0 + e) * 1.4, abs=1e-12)
    assert impulse == pytest.approx(M * (1.0 + e) * 1.4, abs=1e-12)


@both
@pytest.mark.parametrize(("turns", "speed"), [(1.0, 1.0), (8.0, 0.5), (-30.0, 2.0)])
@pytest.mark.parametrize("dt", [1 / 30, 1 / 120])
def test_a_bat_that_turns_hits_at_the_root_of_its_equation(
    engine: Any, turns: float, speed: float, dt: float
) -> None:
    """The gap to the bat's line is c(t) . n(t) - r; its first root is found in 40 digits."""
    up = math.copysign(1.0, turns)
    ball = Ball("a", (0.2, 0.4 * up), R, M, velocity=(0.0, -speed * up))
    play = on_a_plane(ball, [(bar((-0.5, 0.0), (0.5, 0.0)), going(turns=turns))], dt, 0.4)
    with mpmath.workdps(40):
        w = mpmath.mpf(turns)

        def gap(t: Any) -> Any:
            y = up * mpmath.mpf(0.4) - up * mpmath.mpf(speed) * t
            away = y * mpmath.cos(w * t) - mpmath.mpf(0.2) * mpmath.sin(w * t)
            return up * away - mpmath.mpf(R)

        low = high = mpmath.mpf(0)
        while gap(high) > 0:
            low, high = high, high + mpmath.mpf(1) / 10000
        for _ in range(120):
            middle = (low + high) / 2
            low, high = (middle, high) if gap(middle) > 0 else (low, middle)
        assert abs(hits(played(engine, play))[0][0] - high) < 1e-14


@both
def test_a_ball_at_rest_is_struck_at_its_time(engine: Any) -> None:
    disc = Mover((RoundSide((0.0, 0.0), 0.05),), 1.0, 0.0, 0.0)
    play = on_a_plane(Ball("a", (0.9, 0.5), R, M), [(disc, going((0.6, 0.0), place=(0.5, 0.5)))],
                      1 / 30, 1.0)  # fmt: skip
    [(t, vx, _, impulse)] = hits(played(engine, play))
    assert t == pytest.approx((0.4 - 0.05 - R) / 0.6, abs=1e-14)
    assert vx == pytest.approx(1.2, abs=1e-12)
    assert impulse == pytest.approx(M * 1.2, abs=1e-12)


@both
@pytest.mark.parametrize("kick", [0.5, 2.0])
def test_a_wall_kicks_once_in_an_instant(engine: Any, kick: float) -> None:
    """A wall adds its kick to the law's answer, along the normal; its impulse has both."""
    ball = Ball("a", (0.5, 0.0), R, M, velocity=(-1.0, 0.0))
    play = on_a_plane(ball, [(upright(0.5)._replace(kick=kick), going())], 1 / 60, 1.0)
    [(_, vx, _, impulse)] = hits(played(engine, play))
    assert vx == pytest.approx(0.5 + kick, abs=1e-12)
    assert impulse == pytest.approx(M * (1.5 + kick), abs=1e-12)


@both
def test_a_wall_goes_through_a_ball_that_has_nowhere_to_go_and_meets_it_again(engine: Any) -> None:
    """A wall comes up at 1 m/s, jams the ball, goes on for 0.1 m, and comes back at 2 m/s."""

    def pose(t: float) -> Pose:
        if t < 0.6 - 1e-9:
            return Pose((0.5 + t, 0.0), 0.0, (1.0, 0.0), 0.0)
        return Pose((1.1 - 2.0 * (t - 0.6), 0.0), 0.0, (-2.0, 0.0), 0.0)

    ball, still = Ball("a", (1.0 - R, 0.0), R, M), (upright(), going(place=(1.0, 0.0)))
    notes = played(engine, on_a_plane(ball, [(upright(), pose), still], 1 / 60, 0.8))
    [jam] = [k for k, note in enumerate(notes) if note[0] == "jam"]
    assert notes[jam][1] == pytest.approx(0.5 - 2.0 * R, abs=1e-9)
    [(t, vx, *_)] = hits(notes[jam:])
    assert t == pytest.approx(0.65, abs=1e-9)
    assert vx == pytest.approx(-4.0, abs=1e-9)
