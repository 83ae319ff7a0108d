"""Random shots of all kinds of scenes, for the tests of many shots."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pool_pymunk import Ball, Batch, Friction, Physics, Pocket, Restitution, Scene, Table, rack
from tests.oracle.reference import OUTLINES, random_round_scene
from tests.shared.core_scenes import ROLLS, rolling
from tests.shared.frozen import FORMS, random_frozen_scene
from tests.shared.hard_kinds import random_hard_scene
from tests.shared.scenes import TABLES, random_scene

KINDS = [*TABLES, "pockets", "rack", "no friction", "crowd", "frozen", "hard", "round"]
LATE = ("hard", "round")  # These take long.
SAME = 1e-13  # of a shot's largest derivative
ROLLING = [kind + ROLLS for kind in KINDS]


def some_scene(kind: str, seed: int) -> Scene:
    """Return a random scene of a kind, with balls of different sizes and masses."""
    if kind in ROLLING:
        return rolling(random.Random(f"roll {seed}"), some_scene(kind.removesuffix(ROLLS), seed))
    rnd = random.Random(seed)
    law = rnd.choice(("coulomb", "published"))
    if kind == "round":
        scene = random_round_scene(law, rnd.choice(sorted(OUTLINES)), rnd)
        slides = replace(scene.friction, rolling=None)
        without = tuple(replace(ball, roll=0.0) for ball in scene.balls)
        return replace(scene, balls=without, friction=slides)
    if kind == "rack":
        return many_balls(rnd, law, rows=5)
    if kind == "crowd":
        return many_balls(rnd, law, rows=9)
    if kind == "hard":
        kind = rnd.choice(("persistent", "struck", "slow", "moving", "packed", "corner"))
        return random_hard_scene(kind, rnd)
    if kind == "frozen":
        physics = Physics(max_time=30.0, law=law)
        if seed % 2:
            return replace(many_balls(rnd, law, rows=5, gap=0.0), physics=physics)
        form, at_cushion = rnd.choice(FORMS), rnd.random() < 0.7
        return replace(random_frozen_scene(form, at_cushion, rnd), physics=physics)
    scene = random_scene(seed, kind if kind in TABLES else "rectangle", law)
    balls = [replace(ball, mass=ball.mass * 10 ** rnd.uniform(-1, 2)) for ball in scene.balls]
    if rnd.random() < 0.5:
        balls[-1] = replace(balls[-1], cue=True)
    cue = rnd.choice((None, rnd.uniform(0.3, 1)))
    scene = replace(scene, balls=tuple(balls), restitution=replace(scene.restitution, cue_ball=cue))
    if kind == "pockets":
        holes = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0))
        pockets = (Pocket(str(k), place, 0.075) for k, place in enumerate(holes))
        kept = [ball for ball in balls if all(math.dist(ball.position, h) > 0.08 for h in holes)]
        return replace(scene, pockets=tuple(pockets), balls=tuple(kept or balls[:1]))
    if kind == "no friction":
        friction = replace(scene.friction, surface=0.0)
        return replace(scene, friction=friction, physics=replace(scene.physics, max_time=3.0))
    return scene


def many_balls(rnd: random.Random, law: str, rows: int, gap: float | None = None) -> Scene:
    """Return a rack, with small gaps by default, and a ball that breaks it."""
    gap = 10 ** rnd.uniform(-4, -2) if gap is None else gap
    balls = rack((0.3, 0.0), radius=0.03, mass=0.17, rows=rows, gap=gap)
    cue = Ball("C", (-0.3, rnd.uniform(-0.02, 0.02)), 0.03, 0.2, cue=True, velocity=(4.0, 0.1))
    friction = Friction(0.2, 0.1, 0.05)
    return Scene((cue, *balls), None, Restitution(0.9), friction, Physics(law=law))


def great_crowd(count: int, rolls: bool = False) -> Scene:
    """Return so many balls on a table, which all move; they need a larger record."""
    rnd, columns = random.Random(count), 10
    angles = [rnd.uniform(0.0, math.tau) for _ in range(count)]
    balls = tuple(
        Ball(
            f"{k}", (0.09 * (k % columns + 1), 0.09 * (k // columns + 1)), 0.03, 0.17,
            velocity=(math.cos(angle), math.sin(angle)),
        )
        for k, angle in enumerate(angles)
    )  # fmt: skip
    return Scene(
        balls, Table.rectangle(0.99, 0.09 * (count // columns + 2)), Restitution(0.9, cushion=0.8),
        Friction(0.2, 0.1, 0.05, rolling=0.02 if rolls else None),
    )  # fmt: skip


def shots_of(scene: Scene, count: int, seed: int) -> tuple[np.ndarray[Any, Any], ...]:
    """Return positions and velocities of some shots: every velocity is turned and scaled."""
    rng = np.random.default_rng(seed)
    position = np.tile([ball.position for ball in scene.balls], (count, 1, 1)).astype(float)
    velocity = np.tile([ball.velocity for ball in scene.balls], (count, 1, 1)).astype(float)
    turn, scale = rng.uniform(0, math.tau, (count, 1)), rng.uniform(0.2, 1.5, (count, 1))
    x, y = velocity[..., 0].copy(), velocity[..., 1].copy()
    velocity[..., 0] = scale * (x * np.cos(turn) - y * np.sin(turn))
    velocity[..., 1] = scale * (x * np.sin(turn) + y * np.cos(turn))
    gone = rng.random((count, len(scene.balls))) < 0.1
    gone[:, 0] = False
    position[gone] = np.nan
    return position, velocity


def check_bits(batch: Batch, numbers: range) -> None:
    """Check that these shots are bit for bit those of the exact solver."""
    scene, position = batch.scene, batch.source.position
    source = batch.source
    cue = next((k for k, ball in enumerate(scene.balls) if ball.cue), batch.source.watched)
    for k in numbers:
        run = source.run(k, measures_policies=False)
        off = np.isnan(position[k]).any(axis=-1)
        ends = np.where(off[:, None], np.nan, run.end.position)
        np.testing.assert_array_equal(batch.final[k], ends)
        assert batch.statuses[batch.status[k]] == run.status
        assert batch.duration[k] == run.duration
        assert batch.events[k] == len(run.events)
        pairs = [event.balls for event in run.events if event.kind == "ball-ball"]
        assert batch.hits[k] == len(pairs)
        assert batch.cushions[k] == sum(event.kind == "ball-cushion" for event in run.events)
        name = scene.balls[cue].id
        met = [b if a == name else a for a, b in pairs if name in (a, b)]
        assert batch.first_hit[k] == (scene.index[met[0]] if met else -1)
        assert [scene.balls[i].id for i in np.flatnonzero(batch.met[k])] == [
            ball.id for ball in scene.balls if ball.id in met
        ]
        holes = {pocket.id: number for number, pocket in enumerate(scene.pockets)}
        taken = [holes[run.pocketed[b.id]] if b.id in run.pocketed else -1 for b in scene.balls]
        assert batch.pocketed[k].tolist() == taken


def check_derivatives(batch: Batch, numbers: Sequence[int]) -> None:
    """Check that these shots have the derivatives of their runs."""
    found = batch.derivatives
    assert found is not None
    for k in numbers:
        if batch.status[k] == batch.statuses.index("cannot_start"):
            assert np.isnan(found[k]).all()
            continue
        expected = batch.run(k).derivatives(batch.by).final
        np.testing.assert_array_equal(np.isnan(found[k]), np.isnan(expected))
        scale = np.nanmax(np.abs(expected), initial=0.0)
        np.testing.assert_allclose(found[k], expected, rtol=0.0, atol=SAME * scale)
