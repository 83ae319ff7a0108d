"""A surface of one's own: a tilted table, on which balls fall along parabolas."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Ball, Physics, Restitution, Scene, Table, simulate
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import Surface
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
