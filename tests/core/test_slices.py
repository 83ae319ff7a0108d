"""Slices of time: how a disc moves in them, with the same bits compiled and as plain Python."""

from __future__ import annotations

import math
import os
import random
import subprocess
import sys
from dataclasses import replace
from hashlib import sha256

import pytest

from pool_pymunk.core.motion import slices
from pool_pymunk.core.motion.slices import SlicedDisc
from pool_pymunk.core.motion.times import Vector
from tests import ROOT

WAYS = ("slide", "slip", "roll_on")
LOSSES = (0.0, 1e-3, 0.02)  # m/s in a slice
DT = 1e-3  # s
# Zeros have signs, and atan2 turns these into angles.
SPEEDS = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e300)  # m/s


def random_disc(rng: random.Random) -> SlicedDisc:
    """Return a disc whose velocity and roll are any, or along an axis, or extreme."""
    any_speed = [rng.choice((rng.uniform(-3.0, 3.0), rng.choice(SPEEDS))) for _ in range(4)]
    return SlicedDisc(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), *any_speed)


def bits(disc: SlicedDisc) -> str:
    """Return every bit of a disc's place, velocity and roll."""
    return " ".join(number.hex() for number in (*disc.motion, *disc.roll))


def moved(how: str, disc: SlicedDisc, loss: float, count: int) -> int:
    """Move a disc that moves by one of the methods, and return how many slices it took."""
    if how == "slip" and not disc.slips:
        return 0
    used: int = getattr(disc, how)(loss, DT, count)
    return used


# -- physics -------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, -1.5])
def test_a_disc_slides_as_far_as_eq_10_says(angle: float) -> None:
    speed, loss = 2.0, 1e-4
    disc = SlicedDisc(0.0, 0.0, speed * math.cos(angle), speed * math.sin(angle), 0.0, 0.0)
    used = disc.slide(loss, DT, 10**6)
    assert abs(used - speed / loss) <= 1 and not disc.moves
    assert math.hypot(*disc.place) == pytest.approx(speed**2 / (2.0 * loss / DT), rel=1e-9)
    assert math.atan2(disc.y, disc.x) == pytest.approx(angle, abs=1e-9)


@pytest.mark.parametrize(
    ("velocity", "roll"), [((2.0, 0.5), (0.0, 0.0)), ((1.0, 0.0), (-2.0, 3.0))]
)
def test_a_disc_that_slips_rolls_at_last(velocity: Vector, roll: Vector) -> None:
    """About the point where it touches the surface, friction turns nothing: v + (2/5) w stays."""
    loss = 1e-4
    exact = 2.0 / 7.0 * math.dist(velocity, roll) / loss  # slices
    disc = SlicedDisc(0.0, 0.0, *velocity, *roll)
    used = disc.slip(loss, DT, 10**6)
    assert 0.0 <= used - exact <= 1.0 and not disc.slips
    for v, w, at_last, place in zip(velocity, roll, disc.velocity, disc.place, strict=True):
        assert at_last == pytest.approx((5.0 * v + 2.0 * w) / 7.0, rel=1e-12)
        how = (v + at_last) / 2.0 * exact + at_last * (used - exact)
        assert place == pytest.approx(how * DT, abs=loss * DT)


def test_a_disc_that_rolls_goes_on_rolling() -> None:
    disc = SlicedDisc(0.0, 0.0, 1.0, 0.5, 1.0, 0.5)
    assert disc.roll_on(1e-3, DT, 100) == 100
    assert disc.moves and not disc.slips
    assert math.hypot(*disc.velocity) == pytest.approx(math.hypot(1.0, 0.5) - 0.1, rel=1e-12)


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("how", WAYS)
def test_slices_may_be_made_in_parts(how: str, loss: float) -> None:
    """So a search for overlaps may be skipped: the bits are those of slice after slice."""
    rng = random.Random(f"{how} {loss}")
    for _ in range(50):
        at_once = random_disc(rng)
        in_parts = SlicedDisc(*at_once.motion, *at_once.roll)
        used = moved(how, at_once, loss, 300)
        assert sum(moved(how, in_parts, loss, 1) for _ in range(used)) == used
        assert bits(in_parts) == bits(at_once)


# -- compiled, and as Python ---------------------------------------------------------------------


def ends_of_discs() -> list[str]:
    """Move many discs by all methods; return all bits, and how many slices it took."""
    rng, found = random.Random(66), []
    for how in WAYS:
        for loss in LOSSES:
            for _ in range(60):
                disc = random_disc(rng)
                used = moved(how, disc, loss, rng.randint(1, 200))
                found.append(f"{how} {loss} {used} {bits(disc)}")
    return found


def ends_of_runs() -> list[str]:
    """Play the shots of every bundled scene, and random ones; return a hash of each run."""
    from pool_pymunk import Shot, load, simulate
    from pool_pymunk.safety.files import bundled

    rng, found = random.Random(67), []
    for name in bundled():
        scene = load(name)
        own = scene.shots[0]
        rolls = scene.friction.rolling is not None
        thrown = [
            Shot(
                f"thrown {k}", own.ball, speed=rng.uniform(0.3, 4.0), angle=rng.uniform(-180, 180),
                place=own.place, roll=rng.uniform(-1.0, 2.0) if rolls else 0.0,
            )
            for k in range(4)
        ]  # fmt: skip
        scene = replace(scene, shots=(*scene.shots, *thrown))
        for shot in scene.shots:
            run = simulate(scene, shot, solver="time-slice", dt=DT, max_time=2.0)
            rows = [rows.tolist() for rows in run.knots]
            hashed = sha256(repr((run.status, run.events, rows)).encode()).hexdigest()
            found.append(f"{name} {shot.name} {len(run.events)} {hashed}")
    return found


def as_python(function: str) -> list[str]:
    """Return what a function of this file returns where plain Python plays the core."""
    code = (
        f"import tests.core.test_slices as t; print(t.slices.__file__, *t.{function}(), sep='\\n')"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, check=True, text=True,
        env={**os.environ, "POOL_PYMUNK_PURE": "1"}, stdout=subprocess.PIPE,
    )  # fmt: skip
    file, *found = result.stdout.splitlines()
    assert file.endswith(".py")
    return found


needs_compiled = pytest.mark.skipif(
    slices.__file__.endswith(".py"), reason="the core is not compiled: plain Python plays it"
)


@needs_compiled
def test_compiled_discs_have_the_bits_of_python() -> None:
    assert ends_of_discs() == as_python("ends_of_discs")


@needs_compiled
@pytest.mark.long
def test_compiled_runs_have_the_bits_of_python() -> None:
    assert ends_of_runs() == as_python("ends_of_runs")
