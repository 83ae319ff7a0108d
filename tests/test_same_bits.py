"""Ends of many shots have the same bits on every machine: their hashes are on file.

``python -m tests.test_same_bits`` makes ``tests/data/same_bits.json`` anew, for a change that moves
bits on purpose. Starts are sums and products of short binary fractions and of numbers written in
this file, and no function of libm but the square root has a part in them.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from pool_pymunk import (
    Ball,
    Batch,
    Friction,
    Physics,
    Pocket,
    Post,
    Restitution,
    Scene,
    Table,
    core,
    load,
    rack,
    simulate_many,
)
from tests import DATA, ROOT

FILE = DATA / "same_bits.json"
LAWS = ("coulomb", "published")
SHOTS = 5_000  # of each law in a kind of scene
FEW = 10  # So many of them are played as plain Python, too.
FIRST = f"{2 * FEW} shots"
# of each law, where balls roll or walls differ
SLOW = {"rolling": 100, "stadium": 100, "circle with posts": 100, "noses": 100, "posts": 100,
        "rolling in a stadium": 10, "rolling between posts": 10}  # fmt: skip
R = 2.0**-5  # m
TABLE = Table.rectangle(2.0, 1.0)
LIVELY, CLOTH = Restitution(0.9, None, 0.7), Friction(0.1, 0.2, 0.05)
HEXAGON = Table(((0.25, 0.0), (1.75, 0.0), (2.25, 0.5), (1.75, 1.0), (0.25, 1.0), (-0.25, 0.5)))
ELL = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.125, 1.0), (1.125, 2.0), (0.0, 2.0)))
STADIUM = Table(((0.5, 0.0), (1.5, 0.0), (1.5, 1.0), (0.5, 1.0)), (0.0, 1.0, 0.0, 1.0))
CIRCLE = Table(((2.0, 0.5), (0.0, 0.5)), (1.0, 1.0))
NOSES = Table(TABLE.outline, (-0.0625, 0.125, 0.0, -0.0625))  # Two sides bulge into the table.
PIN, PILLAR = Post((1.5, 0.75), 0.0), Post((0.5, 0.8125), 0.0625)
OWN = (Post((1.0, 0.125), 0.0625, 0.5, 0.25), Post((0.5, 0.8125), 0.125, None, 0.5),
       Post((1.5, 0.75), 0.0, 0.875))  # fmt: skip
HOLES = tuple(
    Pocket(str(k), place, 0.0625)
    for k, place in enumerate(
        ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (0.0, 1.0))
    )
)
PLACES = ((0.5, 0.5), (1.0, 0.5), (1.25, 0.625), (1.5, 0.25), (1.75, 0.5), (0.25, 0.25))

Array = NDArray[Any]


class Shots(NamedTuple):
    """Shots are a scene, its balls' places (m) and velocities (m/s), and what else differs."""

    scene: Scene
    position: Array
    velocity: Array
    others: dict[str, Any] = {}  # noqa: RUF012  (arguments of simulate_many)

    def first(self, count: int) -> Shots:
        """Return the first of these shots."""
        few: dict[str, Any] = {
            key: {k: v[:count] for k, v in each.items()} if key == "vary" else each[:count]
            for key, each in self.others.items()
        }
        return Shots(self.scene, self.position[:count], self.velocity[:count], few)


def numbers(seed: int, low: float, high: float, *shape: int) -> Array:
    """Return random numbers of 20 binary digits, from a stream that numpy keeps as it is."""
    raw = np.random.PCG64(seed).random_raw(math.prod(shape)) >> np.uint64(44)
    return low + (high - low) * (raw.astype(float).reshape(shape) / 2.0**20)


# -- kinds of scenes -------------------------------------------------------------------------------


def balls_at(places: tuple[tuple[float, float], ...]) -> tuple[Ball, ...]:
    """Return balls of one kind; the first is the cue ball."""
    return tuple(Ball(str(k), at, R, 0.17, cue=k == 0) for k, at in enumerate(places))


def varied(scene: Scene, count: int, shake: float = R) -> tuple[Array, Array]:
    """Return starts: all balls lie up to ``shake`` (m) aside, and every second one moves."""
    size = (count, len(scene.balls), 2)
    position = np.array([ball.position for ball in scene.balls]) + numbers(1, -shake, shake, *size)
    velocity = numbers(2, -3.0, 3.0, *size)
    velocity[:, 1::2] = 0.0
    return position, velocity


def struck(scene: Scene, count: int, shake: float) -> tuple[Array, Array]:
    """Return starts in which the first ball comes along +x, and the others rest."""
    position, velocity = varied(scene, count, shake)
    position[:, 0, 1] = scene.balls[0].position[1] + numbers(3, -R, R, count)
    velocity[:, 1:] = 0.0
    velocity[:, 0, 0], velocity[:, 0, 1] = numbers(4, 2, 6, count), numbers(5, -0.25, 0.25, count)
    return position, velocity


def mixed(count: int, **parts: Any) -> Shots:
    """Return six balls anywhere."""
    scene = Scene(
        balls_at(PLACES), **{"table": TABLE, "restitution": LIVELY, "friction": CLOTH, **parts}
    )
    return Shots(scene, *varied(scene, count))


def report(count: int) -> Shots:
    """Return the report's table, with the cue ball shot anywhere."""
    scene = load("report")
    position, _ = varied(scene, count, 2.0**-13)
    velocity = np.zeros(position.shape)
    velocity[:, 0] = numbers(2, -4.0, 4.0, count, 2)
    return Shots(scene, position, velocity)


def broken(count: int, gap: float) -> Shots:
    """Return a rack of fifteen, whose gaps differ unless there are none, and its break."""
    cue = Ball("cue", (0.5, 0.5), R, 0.17, cue=True)
    balls = rack((1.25, 0.5), radius=R, mass=0.17, rows=5, gap=gap)
    scene = Scene((cue, *balls), TABLE, LIVELY, CLOTH)
    return Shots(scene, *struck(scene, count, gap / 8.0))


def at_a_cushion(count: int) -> Shots:
    """Return three balls that touch each other, two of them a cushion, and a fourth that hits."""
    high = R + math.sqrt(3.0) * R
    places = ((0.5, high), (1.0, R), (1.0 + 2.0 * R, R), (1.0 + R, high))
    scene = Scene(balls_at(places), TABLE, LIVELY, CLOTH)
    return Shots(scene, *struck(scene, count, 0.0))


def unequal(count: int) -> Shots:
    """Return balls of other sizes and masses, in every shot other ones."""
    shots = mixed(count)
    balls = tuple(replace(b, radius=R * (1 + k % 3) / 2) for k, b in enumerate(shots.scene.balls))
    mass = numbers(6, 0.0625, 4.0, count, len(balls))
    scene = replace(shots.scene, balls=balls)
    return shots._replace(scene=scene, others={"vary": {"mass": mass}})


def restituting(count: int, e: float) -> Shots:
    """Return balls and cushions of one restitution, slow enough for hits that have an end."""
    shots = mixed(count, restitution=Restitution(e, None, e))
    return shots._replace(velocity=shots.velocity / 2.0)


def rough(count: int) -> Shots:
    """Return balls, cushions and cloth whose friction differs from shot to shot."""
    most = {"friction.ball_ball": 1.0, "friction.cushion": 1.0, "friction.surface": 0.5}
    vary = {key: numbers(7, 0.03125, high, count) for key, high in most.items()}
    return mixed(count)._replace(others={"vary": vary})


def slow(count: int) -> Shots:
    """Return balls that next to touch, and that friction may press together."""
    places = tuple((0.5 + 2.125 * R * k, 0.5) for k in range(3))
    scene = Scene(balls_at(places), None, Restitution(0.0), Friction(0.2, 0.2, 0.05))
    position, velocity = varied(scene, count, R / 32.0)
    return Shots(scene, position, velocity / 16.0)


def rolling(count: int, **parts: Any) -> Shots:
    """Return balls that slide, then roll, with rolls (m/s) of their own."""
    shots = mixed(count, friction=Friction(0.2, 0.2, 0.05, 0.01), **parts)
    return shots._replace(others={"roll": numbers(8, -3.0, 3.0, *shots.velocity.shape)})


KINDS: dict[str, Callable[[int], Shots]] = {
    "report": report,
    "racks with gaps": lambda count: broken(count, 2.0**-10),
    "frozen racks": lambda count: broken(count, 0.0),
    "frozen to a cushion": at_a_cushion,
    "pockets": lambda count: mixed(count, pockets=HOLES),
    "oblique cushions": lambda count: mixed(count, table=HEXAGON),
    "a corner that sticks out": lambda count: mixed(count, table=ELL),
    "no table": lambda count: mixed(count, table=None),
    "unequal balls": unequal,
    "e = 0": lambda count: restituting(count, 0.0),
    "e = 1": lambda count: restituting(count, 1.0),
    "friction": rough,
    "no surface friction": lambda count: mixed(
        count, friction=Friction(0.0, 0.2, 0.05), physics=Physics(max_time=2.0)
    ),
    "persistent contacts": slow,
    "rolling": lambda count: rolling(count, pockets=HOLES),
    "stadium": lambda count: mixed(count, table=STADIUM, posts=(PIN, PILLAR)),
    "circle with posts": lambda count: mixed(count, table=CIRCLE, posts=OWN),
    "noses": lambda count: mixed(count, table=NOSES, restitution=Restitution(0.9, None, 0.25)),
    "posts": lambda count: mixed(count, posts=OWN),
    "rolling in a stadium": lambda count: rolling(count, table=STADIUM),
    "rolling between posts": lambda count: rolling(count, table=CIRCLE, posts=OWN),
}


# -- hashes ----------------------------------------------------------------------------------------


def digest(found: Iterator[Any]) -> str:
    """Return the SHA-256 of ends, durations and counts, which are little-endian doubles."""
    made = hashlib.sha256()
    for each in found:
        for values in (each.final, each.duration, each.events, each.hits, each.cushions):
            array = np.asarray(values).astype("<f8")
            array[np.isnan(array)] = math.nan  # a pocketed ball; NaNs may differ in their bits
            made.update(array.tobytes())
    return made.hexdigest()


def play(shots: Shots, law: str) -> Batch:
    """Play shots by a law."""
    scene, position, velocity, others = shots
    return simulate_many(scene, position, velocity, law=law, **others)


def hashes(kind: str) -> dict[str, str]:
    """Return the hashes of all shots of a kind, and of the first few."""
    count = SLOW.get(kind, SHOTS)
    shots = KINDS[kind](count)
    return {f"{2 * count} shots": digest(play(shots, law) for law in LAWS), FIRST: few(kind)}


def few(kind: str) -> str:
    """Return the hash of the first few shots of a kind."""
    shots = KINDS[kind](SLOW.get(kind, SHOTS)).first(FEW)
    return digest(play(shots, law) for law in LAWS)


@pytest.fixture(scope="module")
def on_file() -> dict[str, dict[str, str]]:
    found: dict[str, dict[str, str]] = json.loads(FILE.read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_ends_have_the_same_bits_on_every_machine(
    kind: str, on_file: dict[str, dict[str, str]]
) -> None:
    assert hashes(kind) == on_file[kind]


@pytest.mark.skipif(not core.compiled, reason="the core is not compiled here")
@pytest.mark.slow
def test_plain_python_has_the_same_bits(on_file: dict[str, dict[str, str]]) -> None:
    command = [sys.executable, "-m", "tests.test_same_bits", "--few"]
    plain = os.environ | {"POOL_PYMUNK_PURE": "1"}
    played = subprocess.run(
        command, cwd=ROOT, env=plain, capture_output=True, text=True, check=True
    )
    assert json.loads(played.stdout) == {kind: each[FIRST] for kind, each in on_file.items()}


def main() -> None:
    """Make the file anew, or print the hashes of few shots."""
    if "--few" in sys.argv:
        print(json.dumps({kind: few(kind) for kind in KINDS}))
        return
    found = {kind: hashes(kind) for kind in KINDS}
    FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
