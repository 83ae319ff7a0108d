"""The reference for contacts that persist agrees with closed forms, and with other references."""

from __future__ import annotations

import cmath
import json
import math
import random
from itertools import accumulate, combinations, pairwise
from typing import Any

import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Pocket,
    Post,
    Restitution,
    Scene,
    SceneError,
    State,
    Table,
)
from tests import DATA
from tests.oracle import press_reference
from tests.oracle.press_reference import PressRun, press_run
from tests.oracle.reference import Refused, scene_from_dict
from tests.shared.press_scenes import ON_FILE, farthest
from tests.shared.scenes import seeds, takes_long

pytestmark = pytest.mark.slow  # No change of the engine reaches the reference.
G, R, M = 9.80665, 0.0286, 0.17
DEAD = Restitution(0.0, cushion=0.0)
Vec = tuple[float, float]


def ball(k: int, place: Vec, velocity: Vec = (0.0, 0.0), roll: float = 0.0, m: float = M) -> Ball:
    return Ball(f"b{k}", place, R, m, velocity=velocity, roll=roll)


def grows(run: PressRun) -> bool:
    """Tell whether the energy ever grows by more than rounding."""
    return any(after > before * (1 + 1e-12) + 1e-20 for before, after in pairwise(run.energy))


# -- closed forms ----------------------------------------------------------------------------------


@pytest.mark.parametrize("straight", [0.0, 0.3])
@pytest.mark.parametrize("rolling", [0.02, None])
@pytest.mark.parametrize("mu", [0.0, 0.2, 0.6])
def test_a_ball_along_an_arc(mu: float, rolling: float | None, straight: float) -> None:
    """The arc's friction loses mu N; 5/7 of the pushes move a ball that rolls.

    N / m = (7/5) v^2 / (R - r) / (1 + mu) where friction holds less of the roll than it should
    (mu < 2/5), else v^2 / (R - r). The loss is k v^2 / (R - r) + drag. Along a straight side
    before the arc, nothing presses.
    """
    speed, inner = 0.6, 0.5 - R
    surface = 0.2 if rolling else 0.05
    drag = (rolling or surface) * G
    force = 7 / 5 / (1 + min(mu, 0.4)) if rolling else 1.0
    k = mu * force * (5 / 7 if rolling else 1)
    balls = (ball(0, (1.5 - straight, R), (speed, 0.0), 1.0 if rolling else 0.0),)
    run = press_run(Scene(balls, Table.stadium(2, 1), DEAD, Friction(surface, mu, rolling=rolling)))
    left = speed**2 - 2 * drag * straight
    if left < 0:
        assert abs(run.final[0] - (1.5 - straight + speed**2 / 2 / drag + 1j * R)) < 1e-9
        return
    length = inner / (2 * k) * math.log1p(k * left / (inner * drag)) if mu else left / 2 / drag
    assert abs(run.final[0] - (1.5 + 0.5j - 1j * inner * cmath.exp(1j * length / inner))) < 1e-9
    assert max(run.strongest.values()) == pytest.approx(M * force * left / inner, rel=1e-9)
    assert not grows(run)


def along_a_wall(
    v: float, w: complex, bend: float, surface: float, mu: float, time: float = math.inf
) -> tuple[float, float, complex]:
    """Return the length, velocity and roll of a ball that slips along a wall and rolls on to it.

    It goes by tiny steps until its roll on to the wall is gone, or for a time. All directions are
    the wall's own: the imaginary one is towards it, and turns with the length by ``bend``.
    """

    def rates(v: float, w: complex) -> tuple[float, complex]:
        against = surface * G * (v - w) / abs(v - w)
        force = bend * v**2 - against.imag
        loss = against.real + mu * force
        a = -loss if v > 0 else max(-loss, 0.0)
        return a, 2.5 * against - 2.5j * mu * force + 1j * bend * v * w

    length, h = 0.0, 5e-5
    while min(h, time) > 1e-10:
        h = min(h, time)
        a, b = rates(v, w)
        if (w + b * h).imag <= 0:
            h /= 2
            continue
        a, b = rates(v + a * h / 2, w + b * h / 2)
        length, v, w, time = (
            length + v * h + a * h * h / 2,
            max(v + a * h, 0.0),
            w + b * h,
            time - h,
        )
    return length, v, w


@pytest.mark.parametrize(
    ("mu", "speed", "along"), [(0.1, 1.0, 1.0), (0.3, 1.0, 1.0), (0.3, 0.03, 0.03), (0.5, 0.0, 0.3)]
)
def test_a_roll_aslant_to_a_cushion_with_friction(mu: float, speed: float, along: float) -> None:
    """The ball slips along the cushion until its roll into it is gone, then freely.

    Friction stops the slow one, and holds it until its roll is nearly along the cushion. It holds
    the last one at first, for a shorter time.
    """
    surface, rolling = 0.2, 0.02
    length, v, w = along_a_wall(speed, along + 0.8j, 0.0, surface, mu)
    scene = Scene(
        (ball(0, (0.5, R)),), Table.rectangle(6, 2), DEAD, Friction(surface, mu, rolling=rolling)
    )
    run = press_run(scene, State(((0.5, R),), ((speed, 0.0),), frozenset(), ((along, -0.8),)))
    slips, rolls = 2 * (w.real - v) / (7 * surface * G), (5 * v + 2 * w.real) / 7
    length += (v + rolls) / 2 * slips + rolls**2 / (2 * rolling * G)
    assert abs(run.final[0] - (0.5 + length + 1j * R)) < 1e-6
    assert not grows(run)


def test_a_ball_too_fast_for_an_arc_slips_along_it() -> None:
    """Beyond v^2 = (5/2) mu_s g (R - r), static friction cannot turn the roll with the arc."""
    speed, surface, bend = 2.0, 0.1, 1 / (0.8 - R)
    length, v, w = along_a_wall(speed, speed + 1e-6j, bend, surface, 0.0, time=0.5)
    scene = Scene(
        (ball(0, (0.0, R - 0.8), (speed, 0.0), 1.0),),
        Table(((-0.8, 0.0), (0.8, 0.0)), bulge=(1.0, 1.0)),
        DEAD,
        Friction(surface, rolling=0.01),
        Physics(max_time=0.5),
    )
    run = press_run(scene)
    assert abs(run.final[0] + 1j / bend * cmath.exp(1j * length * bend)) < 1e-6
    assert abs(length - speed * 0.5) > 1e-3
    assert run.energy[-1] == pytest.approx(M * (v**2 / 2 + abs(w) ** 2 / 5), abs=1e-6)


def test_a_roll_draws_a_ball_off_an_arc() -> None:
    """The force falls through zero, for the roll pulls inwards; the ball goes on freely."""
    surface, inner, v0, w0, end = 0.05, 0.8 - R, 0.8, complex(-3.0, 1.0), 0.9
    scene = Scene(
        (ball(0, (0.0, -inner)),),
        Table(((-0.8, 0.0), (0.8, 0.0)), bulge=(1.0, 1.0)),
        DEAD,
        Friction(surface, rolling=0.01),
        Physics(max_time=end),
    )
    run = press_run(scene, State(((0.0, -inner),), ((v0, 0.0),), frozenset(), ((-3.0, 1.0),)))
    place, v, w, h = complex(0, -inner), complex(v0), w0, 1e-4
    for _ in range(round(end / h)):
        a = -surface * G * (v - w) / abs(v - w)
        inwards = -place / abs(place)
        force = abs(v) ** 2 / inner - (a * inwards.conjugate()).real
        touches = abs(place) > inner - 1e-12 and force > 0
        w -= 2.5 * a * h
        place, v = place + v * h + a * h * h / 2, v + a * h
        if touches:
            place *= inner / abs(place)
            v -= (v * inwards.conjugate()).real * inwards
    assert abs(run.final[0] - place) < 1e-4
    assert abs(run.final[0]) < inner - 1e-3


@pytest.mark.parametrize("mass", [0.6, 1.0])
def test_a_roll_that_presses_a_ball_on_to_one_at_rest(mass: float) -> None:
    """A heavy ball at rest stays; a light one rolls on with the ball that pushes it."""
    surface, rolling, roll = 0.2, 0.05, 0.8
    light, heavy = M, mass * M * surface / rolling
    scene = Scene(
        (ball(0, (0.0, 0.0)), ball(1, (2 * R, 0.0), m=heavy)),
        None,
        DEAD,
        Friction(surface, rolling=rolling),
    )
    still, start = ((0.0, 0.0),) * 2, ((0.0, 0.0), (2 * R, 0.0))
    run = press_run(scene, State(start, still, frozenset(), ((roll, 0.0), (0.0, 0.0))))
    force = min((surface + rolling) * G / (5 / 7 / heavy + 1 / light), light * surface * G)
    a = max(surface * G - force / light, 0.0)
    length = (a * (roll / (a + 2.5 * surface * G)) ** 2 / 2) * (1 + a / (rolling * G))
    assert max(map(abs, (run.final[0] - length, run.final[1] - 2 * R - length))) < 1e-9
    assert (length > 1e-3) == (mass < 5 / 7)


@pytest.mark.parametrize(("share", "moves"), [(0.9, False), (1.1, True)])
def test_friction_of_balls_holds_up_to_its_bound(share: float, moves: bool) -> None:
    """A roll aslant to a heavy ball: its surface force may be aslant by the angle of friction."""
    mu, heading = 0.3, cmath.exp(1j * math.atan(share * 0.3))
    scene = Scene(
        (ball(0, (0.0, 0.0)), ball(1, (2 * R, 0.0), m=100.0)),
        None,
        DEAD,
        Friction(0.2, ball_ball=mu, rolling=0.05),
    )
    still, start = ((0.0, 0.0),) * 2, ((0.0, 0.0), (2 * R, 0.0))
    roll = ((heading.real, heading.imag), (0.0, 0.0))
    run = press_run(scene, State(start, still, frozenset(), roll))
    assert (abs(run.final[0]) > 1e-3) == moves
    assert moves or abs(run.final[0]) < 1e-9


def test_a_ball_that_rolls_into_one_that_it_touches() -> None:
    """Both go on at V / 2; the first pushes with mu_s g until both roll, at one instant."""
    speed, mu, rolling = 1.0, 0.2, 0.02
    balls = (ball(0, (0.0, 0.0), (speed, 0.0), 1.0), ball(1, (2 * R, 0.0)))
    run = press_run(Scene(balls, None, DEAD, Friction(mu, rolling=rolling)))
    length = speed**2 / (10 * mu * G) + speed**2 / (8 * rolling * G)
    assert max(map(abs, (run.final[0] - length, run.final[1] - 2 * R - length))) < 1e-9
    assert run.strongest["ball", 0, 1] == pytest.approx(M * mu * G, rel=1e-9)
    assert not grows(run)


@pytest.mark.parametrize("along", [0.0, 0.7])
def test_a_roll_that_presses_a_ball_on_to_a_cushion(along: float) -> None:
    """After a dead hit the roll into the cushion fades; the ball then rolls along it."""
    speed, mu, rolling = 0.8, 0.2, 0.02
    balls = (ball(0, (0.5, R), (along, -speed), 1.0),)
    run = press_run(Scene(balls, Table.rectangle(6, 2), DEAD, Friction(mu, rolling=rolling)))
    fades = speed / (2.5 * mu * G)
    length = along * fades + along**2 / (2 * rolling * G)
    assert abs(run.final[0] - (0.5 + length + 1j * R)) < 1e-10
    assert run.duration == pytest.approx(fades + along / (rolling * G), abs=1e-9)
    assert run.strongest["face", 0, 0] == pytest.approx(M * mu * G, rel=1e-9)


def test_cushion_friction_slows_the_roll_into_it() -> None:
    """The hit takes (5/2) mu V off the roll, and what presses on (5/2) mu N / m."""
    speed, surface, mu = 0.8, 0.2, 0.1
    balls = (ball(0, (0.5, R), (0.0, -speed), 1.0),)
    run = press_run(Scene(balls, Table.rectangle(6, 2), DEAD, Friction(surface, mu, rolling=0.02)))
    left = speed * (1 - 2.5 * mu)
    assert abs(run.final[0] - (0.5 + 1j * R)) < 1e-12
    assert run.duration == pytest.approx(left / (2.5 * surface * G * (1 + mu)), abs=1e-9)


def test_a_ball_leaves_a_post_at_once() -> None:
    """Nothing presses a ball on to what bulges towards it: it goes straight on."""
    scene = Scene(
        (ball(0, (0.0, 0.1 + R), (0.5, 0.0), 1.0),),
        None,
        DEAD,
        Friction(0.2, 0.2, rolling=0.02),
        posts=(Post((0.0, 0.0), 0.1),),
    )
    run = press_run(scene)
    assert abs(run.final[0] - (0.25 / (0.04 * G) + 1j * (0.1 + R))) < 1e-10
    assert not run.strongest


# -- scenes whose ends were found by tiny time steps and by closed forms ---------------------------

SOME_ON_FILE = [
    pytest.param(*ON_FILE[name], id=name)
    for name in (
        "along a cushion into a ball that touches it", "ball in a stadium, e 0 mu 0.2",
        "a ball into two, off centre, e 0",
    )
]  # fmt: skip


@takes_long
@pytest.mark.parametrize(("scene", "ends"), SOME_ON_FILE)
def test_ends_are_those_of_tiny_time_steps_and_shorter_ones_leave_them(
    scene: Scene, ends: list[complex], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = press_run(scene)
    assert farthest(run.final, ends) < 1e-6
    assert not grows(run)
    assert run.strongest
    monkeypatch.setattr(press_reference, "STEP", 0.005)
    monkeypatch.setattr(press_reference, "ERROR", 3e-15)
    assert farthest(run.final, press_run(scene).final) < 1e-11


@takes_long
@pytest.mark.seeded
def test_energy_never_grows_in_random_scenes_and_no_balls_overlap() -> None:
    tables = (None, Table.rectangle(1.2, 0.8), Table.stadium(1.6, 0.8), Table.circle(0.5))
    played = 0
    for seed in seeds(30):
        rng = random.Random(f"press {seed}")
        angles = accumulate((rng.uniform(0, 2 * math.pi), rng.uniform(-2, 2)))
        places = accumulate((cmath.rect(2 * R + 1e-4, a) for a in angles), initial=0.5 + 0.4j)
        velocity = (rng.uniform(-1, 1), rng.uniform(-1, 1))
        moving = [velocity, (0.0, 0.0), (0.0, 0.0)]
        try:
            scene = Scene(
                tuple(
                    ball(k, (p.real, p.imag), v, rng.choice((1.0, 0.0, -1.0)) if v[0] else 0.0)
                    for k, (p, v) in enumerate(zip(places, moving, strict=True))
                ),
                rng.choice(tables),
                Restitution(rng.choice((0.0, 0.5, 0.9)), cushion=rng.choice((0.0, 0.5))),
                Friction(0.2, rng.choice((0.0, 0.1)), rng.choice((0.0, 0.1)), rolling=0.02),
            )
            run = press_run(scene)
        except (Refused, SceneError):
            continue
        played += 1
        assert not grows(run), seed
        apart = [abs(p - q) - 2 * R for p, q in combinations(run.final, 2)]
        assert min(apart) > -1e-10, seed
    assert played > len(seeds(30)) / 2


# -- the other references --------------------------------------------------------------------------


def records(file: str, *kinds: str) -> list[Any]:
    """Return the answers on file whose names begin so."""
    found = json.loads((DATA / f"{file}_runs.json").read_text())
    return [pytest.param(one, id=one["name"]) for one in found if one["name"].startswith(kinds)]


@pytest.mark.parametrize("record", records("hard", "persistent", "struck"))
def test_discs_that_press_on_each_other(record: dict[str, Any]) -> None:
    """These answers come from the reference in ninety digits."""
    run = press_run(scene_from_dict(record["scene"]))
    ends = [complex(float(x), float(y)) for x, y in record["final"]]
    assert farthest(run.final, ends) < 1e-10


@pytest.mark.parametrize("record", records("rolling", "coulomb plane", "coulomb hexagon"))
def test_balls_that_roll_and_never_press(record: dict[str, Any]) -> None:
    """These answers come from the reference in forty digits."""
    scene = scene_from_dict(record["scene"])
    if scene.pockets:
        with pytest.raises(Refused, match="pockets"):
            press_run(scene)
        return
    run = press_run(scene)
    ends = [complex(float(x), float(y)) for x, y in record["run"]["final"]]
    assert farthest(run.final, ends) < 1e-9


# -- what is refused -------------------------------------------------------------------------------

L_SHAPE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))


@pytest.mark.parametrize(
    ("table", "more", "message"),
    [
        (Table.rectangle(2, 1), {"pockets": (Pocket("p", (1.0, 0.5), 0.1),)}, "pockets"),
        (Table.rectangle(2, 1), {"physics": Physics(law="published")}, "not coulomb"),
        (Table(L_SHAPE), {}, "points inwards"),
        (Table((*L_SHAPE[:3], (0.0, 1.0)), bulge=(-0.1, 0.0, 0.0, 0.0)), {}, "bulges inwards"),
    ],
)
def test_other_scenes_are_refused(table: Table, more: dict[str, Any], message: str) -> None:
    scene = Scene((ball(0, (0.5, 0.5), (1.0, 0.0)),), table, DEAD, Friction(0.1), **more)
    with pytest.raises(Refused, match=message):
        press_run(scene)
