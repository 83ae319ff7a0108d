"""A surface of one's own: a tilted table, on which balls fall along parabolas."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import pytest

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, Table, simulate
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import Sliding, Surface
from pool_pymunk.laws.contact import Vector

R, PULL = 0.05, 0.5  # m, m/s^2


class Tilted(Surface):
    """Every ball is pulled along -y at ``pull`` (m/s^2), without end and without friction."""

    def __init__(self, pull: float) -> None:
        super().__init__(pull, pull, False)

    def path(self, t: float, place: Vector, velocity: Vector, roll: Vector) -> Path:
        return Path(t, *place, *velocity, 0.0, -self.pull, math.inf, False, 0.0, 0.0)


@dataclass(frozen=True)
class TiltedScene(Scene):
    """This is a scene whose table is tilted."""

    @property
    def surface(self) -> Any:
        return Tilted(PULL)


def fallen(*balls: Ball, e: float = 1.0, until: float = 10.0) -> Any:
    scene = TiltedScene(
        balls, Table(((-1, 0), (1, 0), (1, 4), (-1, 4))), Restitution(1.0, None, e),
        physics=Physics(max_time=until),
    )  # fmt: skip
    return simulate(scene, solver="event-driven", max_events=20)


def test_a_ball_that_falls_from_rest_bounces_as_high_as_it_was() -> None:
    height = 2.0
    run = fallen(Ball("a", (0.0, R + height), R, 0.2))
    fall = math.sqrt(2.0 * height / PULL)
    times = [event.t for event in run.events]
    assert {event.kind for event in run.events} == {"ball-cushion"}
    assert times == pytest.approx([fall * (2 * k + 1) for k in range(len(times))], rel=1e-13)
    tops = run.at(2.0 * fall * np.arange(1, len(times)))[0][:, 0, 1]
    assert tops == pytest.approx(R + height, abs=1e-12)


def test_dull_bounces_come_in_a_geometric_series() -> None:
    e, height = 0.5, 1.0
    run = fallen(Ball("a", (0.0, R + height), R, 0.2), e=e)
    fall = math.sqrt(2.0 * height / PULL)
    gaps = np.diff([event.t for event in run.events])[:8]
    assert gaps == pytest.approx([2.0 * fall * e ** (k + 1) for k in range(8)], rel=1e-12)


def test_balls_that_are_thrown_meet_where_two_parabolas_do() -> None:
    """The relative motion of two balls that fall alike is straight."""
    run = fallen(
        Ball("a", (-0.5, 1.0), R, 0.2, velocity=(0.3, 0.4)),
        Ball("b", (0.5, 1.0), R, 0.2, velocity=(-0.3, 0.4)),
        until=1.6,
    )
    hit = run.events[0]
    assert (hit.kind, hit.t) == ("ball-ball", pytest.approx((1.0 - 2 * R) / 0.6, rel=1e-14))
    energy = [0.1 * (v * v).sum() + 0.2 * PULL * p[:, 1].sum()
              for p, v in zip(*run.at(np.linspace(0.0, 1.6, 33)), strict=True)]  # fmt: skip
    assert energy == pytest.approx([energy[0]] * 33, rel=1e-12)


# -- contacts that persist -------------------------------------------------------------------------


def test_a_ball_that_has_fallen_slides_along_the_floor_until_friction_holds_it() -> None:
    """It lands without a bounce, slows down at mu g, and stays: N = m g all the time."""
    height, speed, mu = 0.1, 0.4, 0.1
    scene = TiltedScene(
        (Ball("a", (-0.9, R + height), R, 0.2, velocity=(speed, 0.0)),),
        Table(((-1, 0), (1, 0), (1, 4), (-1, 4))), Restitution(1.0, None, 0.0),
        Friction(0.0, mu, 0.0), physics=Physics(max_time=20.0),
    )  # fmt: skip
    run = simulate(scene, solver="event-driven")
    fall = math.sqrt(2.0 * height / PULL)
    left = speed - mu * PULL * fall  # m/s, after the landing
    x = -0.9 + speed * fall + left**2 / (2.0 * mu * PULL)
    assert run.end.position[0] == pytest.approx((x, R), abs=1e-9)
    [contact] = run.persistent
    assert run.status == "settled"
    assert contact.until == run.duration == pytest.approx(fall + left / (mu * PULL))
    assert contact.since == pytest.approx(fall)
    assert contact.impulse[1] == pytest.approx(0.2 * PULL * (run.duration - fall), abs=1e-8)
    assert contact.impulse[0] == pytest.approx(-0.2 * left, abs=1e-8)


def test_a_ball_in_a_bowl_swings_like_a_pendulum() -> None:
    """After the period 4 sqrt(l / g) K(sin^2(angle / 2)) it is where it was."""
    angle, length = 0.8, 1.0 - R
    start = 1.0 + length * math.sin(angle), 1.0 - length * math.cos(angle)
    period = 4.0 * math.sqrt(length / PULL) * float(mpmath.ellipk(math.sin(angle / 2.0) ** 2))
    scene = TiltedScene(
        (Ball("a", start, R, 0.2),), Table.circle(1.0), Restitution(1.0, None, 0.0),
        physics=Physics(max_time=period),
    )  # fmt: skip
    run = simulate(scene, solver="event-driven")
    assert math.dist(run.end.position[0], start) < 1e-8


class Named(Surface):
    """This surface is that of a scene, but a class of its own."""

    def __init__(self, pull: float) -> None:
        super().__init__(pull, pull, False)
        self.slides = Sliding(pull)

    def path(self, t: float, place: Vector, velocity: Vector, roll: Vector) -> Path:
        return self.slides.path(t, place, velocity, roll)


@dataclass(frozen=True)
class NamedScene(Scene):
    @property
    def surface(self) -> Any:
        return Named(PULL)


def test_a_class_of_ones_own_that_slides_is_pressed_as_the_scenes_is() -> None:
    balls = (
        Ball("a", (0.3, 1.0), R, 0.2, velocity=(0.8, -0.8)),
        Ball("b", (0.3 + 2.0 * R, 1.003), R, 0.2, velocity=(0.8, -0.8)),
        Ball("c", (0.8, 0.4), R, 0.2),
    )
    how = Table.circle(1.0), Restitution(0.0, None, 0.0), Friction(PULL / 9.80665, 0.1, 0.0)
    runs = [simulate(kind(balls, *how), solver="event-driven") for kind in (Scene, NamedScene)]
    assert runs[0].persistent and runs[1].status == "settled"
    for one, other in zip(runs[0].end.position, runs[1].end.position, strict=True):
        assert math.dist(one, other) < 1e-7
