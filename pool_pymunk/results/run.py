"""What every solver returns: a :class:`Run`, made from the :class:`Trace` it kept on the way.

A solver notes a *knot* (time, position, velocity) wherever a ball's velocity changes: at the
start, at a contact, when it stops. Between knots a ball slides in closed form, so a Run can be
asked for the positions at any time.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pool_pymunk.physics.motion import Array, kinetic_energy, slide_many

if TYPE_CHECKING:
    from pool_pymunk.model import Point, Scene, Shot, State

SAMPLES_PER_SECOND = 60

STATUSES: Mapping[str, str] = {
    "settled": "every ball is at rest",
    "max_time": "stopped at max_time, balls still moving",
    "max_events": "stopped at max_events, balls still moving",
    "non_finite": "stopped: a number left the range of floating point",
}


@dataclass(frozen=True, slots=True)
class Event:
    """A contact, or a ball that comes to rest, at time ``t`` (s)."""

    t: float
    kind: str  # ball-ball | ball-cushion | stop
    balls: tuple[str, ...]
    cushion: int | None = None

    def as_dict(self) -> dict[str, object]:
        """The event as it stands in the JSON."""
        record: dict[str, object] = {"t": self.t, "kind": self.kind, "balls": list(self.balls)}
        return record if self.cushion is None else {**record, "cushion": self.cushion}


@dataclass(frozen=True)
class Run:
    """One shot, simulated: what happened, where every ball was at any time, and what it cost.

    ``t`` (T,), ``position`` (T, N, 2) and ``velocity`` (T, N, 2) are samples in s, m and m/s, N in
    the order of ``scene.balls``; ``final`` maps each ball to its end (m).
    """

    scene: Scene
    shot: Shot | None
    solver: str
    dt: float | None
    knots: tuple[Array, ...]
    events: tuple[Event, ...]
    status: str
    duration: float
    steps: int
    warnings: tuple[str, ...]
    wall_time: float
    sample_times: tuple[float, ...] | None = None

    @property
    def name(self) -> str:
        """The shot's name; "as set up" where the scene runs as its velocities have it."""
        return self.shot.name if self.shot else "as set up"

    @cached_property
    def t(self) -> Array:
        """The times (T,) asked for, or 60 a second and the end."""
        if self.sample_times is not None:
            return np.array(self.sample_times, dtype=float)
        count = int(self.duration * SAMPLES_PER_SECOND) + 1
        grid = np.arange(count) / SAMPLES_PER_SECOND
        return grid if grid[-1] >= self.duration else np.append(grid, self.duration)

    @cached_property
    def _samples(self) -> tuple[Array, Array]:
        return self.at(self.t)

    @property
    def position(self) -> Array:
        """Positions (T, N, 2) at the times ``t``, in m."""
        return self._samples[0]

    @property
    def velocity(self) -> Array:
        """Velocities (T, N, 2) at the times ``t``, in m/s."""
        return self._samples[1]

    def at(self, times: Array | Sequence[float]) -> tuple[Array, Array]:
        """Positions and velocities (T, N, 2) at any ``times`` (T,), s; after the end, the end."""
        t = np.clip(np.asarray(times, dtype=float), 0.0, self.duration)
        position = np.empty((len(t), len(self.knots), 2))
        velocity = np.empty_like(position)
        for i, knots in enumerate(self.knots):
            last = np.searchsorted(knots[:, 0], t, side="right") - 1
            position[:, i], velocity[:, i] = slide_many(knots[last], self.scene.deceleration, t)
        return position, velocity

    @cached_property
    def end(self) -> State:
        """Positions (m) and velocities (m/s) at the end, exactly as the solver left them."""
        from pool_pymunk.model import State

        position, velocity = self.at([self.duration])
        return State(_points(position[0]), _points(velocity[0]))

    @cached_property
    def final(self) -> dict[str, Point]:
        """Where each ball ended (m)."""
        return {b.id: p for b, p in zip(self.scene.balls, self.end.position, strict=True)}

    @cached_property
    def energy(self) -> dict[str, float]:
        """Kinetic energy (J) of all balls, ``initial`` and ``final``."""
        balls = self.scene.balls
        start = [(knots[0, 3], knots[0, 4]) for knots in self.knots]
        return {
            name: float(sum(kinetic_energy(b.mass, *v) for b, v in zip(balls, at, strict=True)))
            for name, at in (("initial", start), ("final", self.end.velocity))
        }

    def as_dict(self) -> dict[str, object]:
        """The shot as it stands in the JSON of ``run --json``, in SI."""
        shot = self.shot
        velocity = None
        if shot is not None:
            i = self.scene.index[shot.ball]
            velocity = [float(v) for v in self.knots[i][0, 3:5]]
        return {
            "name": self.name,
            "ball": shot.ball if shot else None,
            "velocity": velocity,
            "status": self.status,
            "duration": self.duration,
            "steps": self.steps,
            "wall_time": self.wall_time,
            "final": {id_: list(point) for id_, point in self.final.items()},
            "events": [event.as_dict() for event in self.events],
            "energy": self.energy,
            "warnings": list(self.warnings),
        }

    def write_npz(self, path: Path) -> None:
        """Write t, position, velocity (SI), the balls' ids and the events as a NumPy archive."""
        np.savez_compressed(
            path,
            t=self.t,
            position=self.position,
            velocity=self.velocity,
            balls=np.array([ball.id for ball in self.scene.balls]),
            event_t=np.array([event.t for event in self.events]),
            event_kind=np.array([event.kind for event in self.events], dtype=str),
            event_balls=np.array([_two(event.balls) for event in self.events], dtype=str),
            event_cushion=np.array(
                [-1 if event.cushion is None else event.cushion for event in self.events], dtype=int
            ),
        )

    def write_csv(self, path: Path) -> None:
        """Write one row a time and ball: t, ball, x, y, vx, vy (SI, all digits)."""
        with path.open("w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(["t", "ball", "x", "y", "vx", "vy"])
            for t, positions, velocities in zip(self.t, self.position, self.velocity, strict=True):
                for ball, p, v in zip(self.scene.balls, positions, velocities, strict=True):
                    rows.writerow([float(t), ball.id, *map(float, p), *map(float, v)])

    def write_events_csv(self, path: Path) -> None:
        """Write one row an event: t, kind, ball, other (of two balls), cushion."""
        with path.open("w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(["t", "kind", "ball", "other", "cushion"])
            for event in self.events:
                cushion = "" if event.cushion is None else event.cushion
                rows.writerow([event.t, event.kind, *_two(event.balls), cushion])


def _two(balls: tuple[str, ...]) -> tuple[str, str]:
    return (balls[0], balls[1] if len(balls) > 1 else "")


def _points(rows: Array) -> tuple[Point, ...]:
    return tuple((float(x), float(y)) for x, y in rows)
