"""An opponent that looks ahead
============================

Two players play a rack of pool on a live table. Each tries two thousand shots before it plays one.

:meth:`pool_pymunk.Billiards.to_scene` gives the live table as a scene, and
:func:`pool_pymunk.simulate_many` plays all the shots from there, exactly. A player wants a shot
that pots balls and keeps the cue ball, also where its aim is off: its neighbours count, too. The
players err by some tenths of a degree. A pocketed cue ball comes back by ``place``.

Run it with ``python examples/pool_opponent.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray

from pool_pymunk import Billiards, load, same_balls, simulate
from pool_pymunk import simulate_many as play_many
from pool_pymunk.world import TableBall

SCENE = load("eight-ball")
ANGLES, SPEEDS = 400, (1.0, 2.0, 3.0, 4.5, 6.0)  # directions, and speeds (m/s), that are tried
ROLL = 0.5  # share of its velocity with which the cue ball rolls
ERROR = math.radians(0.3)  # standard deviation of a player's aim
STEP = 1 / 60  # s
NEIGHBOURS = 5  # directions whose mean counts; the middle one is the shot
MOST_SHOTS = 60


class Turn(NamedTuple):
    """A turn has its player, velocity (m/s), how long the choice took (s), and what was potted."""

    player: str
    velocity: tuple[float, float]
    took: float
    potted: tuple[str, ...]


class Game:
    """A game has its table and its balls by their names."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(1)
        e, mu = SCENE.restitution, SCENE.friction
        assert SCENE.table and e.ball_ball and e.cushion and mu.rolling
        self.table = Billiards(
            pymunk.Space(), STEP, pair=same_balls(e.ball_ball, mu.ball_ball),
            deceleration=SCENE.deceleration, rolling=mu.rolling * SCENE.physics.gravity,
        )  # fmt: skip
        ground = self.table.space.static_body
        for edge in SCENE.table.edges:
            wall = pymunk.Segment(ground, edge.start, edge.end, 0.0)
            self.table.add_wall(wall, e.cushion, mu.cushion)
        for hole in SCENE.pockets:
            self.table.add_pocket(hole.position, hole.radius)
        self.balls: dict[str, TableBall] = {}
        for ball in SCENE.balls:
            body = pymunk.Body(ball.mass, math.inf)
            body.position = ball.position
            self.balls[ball.id] = self.table.add_ball(pymunk.Circle(body, ball.radius), id=ball.id)
        self.cue = self.balls["cue"]

    def potted(self) -> set[str]:
        """Return the names of the balls that are off the table."""
        return {name for name, ball in self.balls.items() if not ball.is_on_table}

    def choose(self, angles: int = ANGLES) -> tuple[float, float]:
        """Return the velocity (m/s) of the best of many shots."""
        scene, state = self.table.to_scene()
        cue = scene.index["cue"]
        turns = np.linspace(0.0, math.tau, angles, endpoint=False)
        aims = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
        tries = np.zeros((len(SPEEDS), angles, len(scene.balls), 2))
        tries[:, :, cue] = np.array(SPEEDS)[:, np.newaxis, np.newaxis] * aims
        shots = tries.reshape(-1, len(scene.balls), 2)
        ends = play_many(scene, state.position, shots, roll=ROLL * shots)
        worth = value(ends.pocketed, cue).reshape(len(SPEEDS), angles)
        around = [np.roll(worth, k, axis=1) for k in range(-(NEIGHBOURS // 2), NEIGHBOURS // 2 + 1)]
        best = int(np.argmax(np.mean(around, axis=0) + worth))
        x, y = shots[best, cue]
        return float(x), float(y)

    def take_turn(self, player: str, angles: int = ANGLES) -> Turn:
        """Let a player choose a shot, and play it on the live table."""
        before, began = self.potted(), time.perf_counter()
        x, y = self.choose(angles)
        took, off = time.perf_counter() - began, self.rng.normal(0.0, ERROR)
        cos, sin = math.cos(off), math.sin(off)
        velocity = x * cos - y * sin, x * sin + y * cos
        self.table.strike(self.cue, velocity, ROLL)
        self.table.play()
        fell = self.potted() - before
        if not self.cue.is_on_table:
            self.table.place(self.cue, self.table.free_spot((0.6, 0.56), ball=self.cue))
        return Turn(player, velocity, took, tuple(sorted(fell)))


def value(pocketed: NDArray[np.int32], cue: int) -> NDArray[np.float64]:
    """Return what shots are worth: a ball each that is potted, and less if the cue ball is."""
    is_in = pocketed >= 0
    return np.where(is_in[:, cue], -2.0, is_in.sum(axis=1).astype(float))


def main(argv: Sequence[str] | None = None) -> list[Turn]:
    """Play a game, print its turns, draw the shot that potted most, and return the turns."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--angles", type=int, default=ANGLES)
    parser.add_argument("--shots", type=int, default=MOST_SHOTS)
    options = parser.parse_args(argv)
    game, turns, player, drawn = Game(), list[Turn](), "A", -1
    while len(turns) < options.shots and len(game.table.on_table) > 1:
        scene, state = game.table.to_scene()
        turns.append(turn := game.take_turn(player, options.angles))
        fell = ", ".join(turn.potted) or "nothing"
        speed = math.hypot(*turn.velocity)
        print(f"{player} tries {len(SPEEDS) * options.angles} shots in {turn.took:.2f} s, "
              f"plays one at {speed:.1f} m/s, and pots {fell}")  # fmt: skip
        if len(turn.potted) > drawn:
            drawn, cue = len(turn.potted), scene.index["cue"]
            moves = [turn.velocity if k == cue else (0.0, 0.0) for k in range(len(scene.balls))]
            rolls = [(ROLL * x, ROLL * y) for x, y in moves]
            start = state._replace(velocity=tuple(moves), roll=tuple(rolls))
            run = simulate(scene, start=start, solver="event-driven")
            run.plot(path=options.out / "pool_opponent.png", dpi=120)
        if not turn.potted or "cue" in turn.potted:
            player = "B" if player == "A" else "A"
    return turns


if __name__ == "__main__":
    main()
