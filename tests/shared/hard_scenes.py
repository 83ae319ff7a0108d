"""Scenes that policies answer: squeezed balls, and balls that friction presses together."""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk import Ball, Friction, Restitution, Run, Scene, State, Table, simulate
from pool_pymunk.laws.contact import Vector
from pool_pymunk.solvers.request import request

R = 0.05


def exact(scene: Scene, start: State | None = None, **bounds: Any) -> Run:
    return simulate(scene, solver="event-driven", start=start, **bounds)


def unmeasured(scene: Scene, **bounds: Any) -> Run:
    """Play a scene exactly, without measuring what its policies change."""
    asked = request(scene, "event-driven", **bounds)
    return asked._replace(settings=asked.settings._replace(measures_policies=False)).play(None)


def disc(
    id_: str, position: Vector, velocity: Vector = (0.0, 0.0), mass: float = 1.0, r: float = R
) -> Ball:
    return Ball(id_, position, r, mass, velocity=velocity)


def squeezed(ratio: float, e: float, e_cushion: float, mu: float, beside: float) -> Scene:
    """A heavy ball drives a light one to a cushion that leans by 0.1 rad where it comes aslant."""
    lean = 0.1 if beside else 0.0
    corners = ((0.0, 0.0), (8.0, 0.0), (8.0, 2.0), (2.0 * math.tan(lean), 2.0))
    balls = (
        disc("light", (1.0, 1.0 + beside), mass=0.1),
        disc("heavy", (2.0, 1.0), (-1.0, 0.0), mass=0.1 * ratio),
    )
    restitution, friction = Restitution(e, None, e_cushion), Friction(0.01, mu, mu)
    return Scene(balls, Table(tuple(corners)), restitution, friction)


def persistent(e: float, speed: float = 0.1, r: float = R) -> Scene:
    """Return a ball that catches up with another at an angle; friction presses it on."""
    velocity = (speed * math.cos(0.8), speed * math.sin(0.8))
    balls = (
        disc("a", (0.0, 0.0), velocity, r=r),
        disc("b", (2 * r, 0.0), (velocity[0] / 2, 0.0), r=r),
    )
    return Scene(balls, None, Restitution(e), Friction(0.1))
