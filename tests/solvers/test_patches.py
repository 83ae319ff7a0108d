"""Balls slide and roll over regions with other friction: sand and ice."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Patch,
    Physics,
    Restitution,
    Run,
    Scene,
    SceneError,
    SettingError,
    State,
    Table,
    load,
    loads,
    simulate,
)
from pool_pymunk.core.motion.patches import OPEN, Circle, Patches
from pool_pymunk.model.inputs import with_inputs
from tests.oracle.patch_reference import patch_run
from tests.oracle.reference import Refused
from tests.shared.hard_scenes import unmeasured
from tests.shared.patch_scenes import M, R, random_scene
from tests.shared.scenes import seeds, some_slow

G = 9.80665  # m/s^2
SAND = Patch(((1.0, -1.0), (2.0, -1.0), (2.0, 1.0), (1.0, 1.0)), surface=0.6)
CLOTH = Friction(0.1)


def ball(
    x: float, y: float, vx: float, vy: float = 0.0, roll: float = 0.0, name: str = "a"
) -> Ball:
    return Ball(name, (x, y), R, M, velocity=(vx, vy), roll=roll)


def plane(*balls: Ball, patches: tuple[Patch, ...] = (SAND,), **parts: Any) -> Scene:
    """Return an open plane with patches."""
    parts = {"friction": CLOTH, "restitution": Restitution(0.9)} | parts
    return Scene(balls, patches=patches, **parts)


def played(scene: Scene, **settings: Any) -> Run:
    return simulate(scene, **{"solver": "event-driven"} | settings)


def crossings(run: Run) -> list[int | None]:
    """Return the patches into which balls come, one after the other."""
    return [event.patch for event in run.events if event.kind == "patch"]


def far(run: Run) -> float:
    """Return how far (m) along x the first ball ends."""
    return run.end.position[0][0]


# -- closed forms ----------------------------------------------------------------------------------


def test_a_ball_slides_straight_across_sand() -> None:
    run = played(plane(ball(0.0, 0.2, 4.0)))
    at_sand = math.sqrt(16.0 - 2 * 0.1 * G)
    after = math.sqrt(at_sand**2 - 2 * 0.6 * G)
    assert crossings(run) == [0, None]
    first, second = (event.t for event in run.events if event.kind == "patch")
    assert first == pytest.approx((4.0 - at_sand) / (0.1 * G), rel=1e-14)
    assert second - first == pytest.approx((at_sand - after) / (0.6 * G), rel=1e-14)
    assert run.at(first)[1][0][0] == pytest.approx(at_sand, rel=1e-15)
    assert run.at(second)[1][0][0] == pytest.approx(after, rel=1e-14)
    assert run.at(second)[0][0].tolist() == [pytest.approx(2.0, rel=1e-15), 0.2]
    assert far(run) == pytest.approx(2.0 + after**2 / (2 * 0.1 * G), rel=1e-14)


def test_a_ball_stops_in_sand() -> None:
    run = played(plane(ball(0.5, 0.0, 2.0)))
    assert crossings(run) == [0]
    assert far(run) == pytest.approx(1.0 + (4.0 - 0.1 * G) / (2 * 0.6 * G), rel=1e-14)


def test_a_ball_rolls_over_ice() -> None:
    ice = replace(SAND, surface=None, rolling=0.005)
    rolls = Friction(0.2, rolling=0.05)
    run = played(plane(ball(0.0, 0.0, 1.5, roll=1.0), patches=(ice,), friction=rolls))
    after = 2.25 - 2 * G * (0.05 + 0.005)
    assert crossings(run) == [0, None]
    assert far(run) == pytest.approx(2.0 + after / (2 * 0.05 * G), rel=1e-14)


def test_ice_without_friction_takes_no_speed() -> None:
    scene = plane(
        ball(0.0, 0.0, 2.0), patches=(replace(SAND, surface=0.0),), physics=Physics(max_time=9.0)
    )
    run = played(scene)
    assert far(run) == pytest.approx(1.0 + 4.0 / (2 * 0.1 * G), rel=1e-14)


def test_the_last_patch_that_holds_a_ball_wins() -> None:
    inner = Patch(((1.2, -1.0), (1.6, -1.0), (1.6, 1.0), (1.2, 1.0)), surface=0.3)
    run = played(plane(ball(0.0, 0.0, 5.0), patches=(SAND, inner)))
    lost = 2 * G * (0.1 + 0.6 * 0.2 + 0.3 * 0.4 + 0.6 * 0.4)
    assert crossings(run) == [0, 1, 0, None]
    assert far(run) == pytest.approx(2.0 + (25.0 - lost) / (2 * 0.1 * G), rel=1e-14)
    hidden = played(plane(ball(0.0, 0.0, 5.0), patches=(inner, SAND)))
    assert crossings(hidden) == [1, None]
    assert far(hidden) == pytest.approx(2.0 + (25.0 - 2 * G * 0.7) / (2 * 0.1 * G), rel=1e-14)


@pytest.mark.parametrize("k", [0, 1, 2])
def test_a_patch_that_lies_elsewhere_changes_nothing_of_that(k: int) -> None:
    small, large, elsewhere = ((0.0, 0.0), 0.25), ((0.0, 0.0), 0.5), ((9.0, 0.0), 0.5)
    listed = [small, large]
    listed.insert(k, elsewhere)
    patches = Patches([Circle(i, *each) for i, each in enumerate(listed)], [])
    assert patches.at(0.1, 0.0) == patches.at(0.4, 0.0) == listed.index(large)
    assert patches.at(9.0, 0.1) == k and patches.at(5.0, 0.0) == OPEN


def test_a_chord_of_a_round_patch() -> None:
    patch = Patch(center=(1.5, 0.0), radius=0.5, surface=0.4)
    run = played(plane(ball(0.0, 0.3, 4.0), patches=(patch,)))
    lost = 2 * G * (0.1 * 1.1 + 0.4 * 0.8)  # The chord is 2 sqrt(0.5^2 - 0.3^2) = 0.8 m long.
    assert crossings(run) == [0, None]
    assert far(run) == pytest.approx(1.9 + (16.0 - lost) / (2 * 0.1 * G), rel=1e-13)


@pytest.mark.parametrize("edge", [0.12, 0.55])
def test_a_ball_that_slides_across_its_roll_begins_to_roll_before_or_behind_a_border(
    edge: float,
) -> None:
    """It begins to roll at v = (5/7) v0 + (2/7) w0, after 2 |u| / 7 has left its slip."""
    v, w = np.array([1.0, 0.3]), np.array([0.0, -0.6])
    pulls, slip = (0.2 * G, 0.5 * G), v - w
    size, at, place = math.hypot(*slip), v.copy(), np.zeros(2)
    first = 2.0 * size / (7.0 * pulls[0])
    a = -pulls[0] * slip / size
    t = float(min(r.real for r in np.roots([a[0] / 2, v[0], -edge]) if r.real > 0))
    assert (t > first) == (edge > 0.3)
    if t < first:
        place, at = v * t + a * t * t / 2, v + a * t
        rest = (first - t) * pulls[0] / pulls[1]
        a = -pulls[1] * slip / size
        place, at = place + at * rest + a * rest * rest / 2, at + a * rest
        place = place + at * math.hypot(*at) / (2 * 0.1 * G)
    else:
        place, at = v * first + a * first * first / 2, v + a * first
        speed = math.hypot(*at)
        length = (edge - place[0]) / at[0] * speed
        left = speed**2 - 2 * 0.02 * G * length
        place = place + at / speed * (length + left / (2 * 0.1 * G))
    sand = Patch(((edge, -5.0), (9.0, -5.0), (9.0, 5.0), (edge, 5.0)), surface=0.5, rolling=0.1)
    scene = plane(ball(0.0, 0.0, *v), patches=(sand,), friction=Friction(0.2, rolling=0.02))
    run = played(scene, start=State(((0.0, 0.0),), (tuple(v),), roll=(tuple(w),)))
    assert [event.kind for event in run.events][:2] == (
        ["patch", "roll"] if t < first else ["roll", "patch"]
    )
    assert np.array(run.end.position[0]) == pytest.approx(place, abs=1e-14)


# -- borders ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("vx", "patch"), [(1.0, 0.6), (-1.0, 0.1)])
def test_a_ball_that_is_struck_on_a_border_goes_where_it_is_headed(vx: float, patch: float) -> None:
    for x in (1.0, math.nextafter(1.0, 0.0), math.nextafter(1.0, 2.0)):
        run = played(plane(ball(x, 0.0, vx)))
        assert far(run) == pytest.approx(1.0 + vx / (2 * patch * G), abs=1e-14)
        assert len(run.events) <= 2


def test_a_ball_at_rest_on_a_patch_is_struck_there() -> None:
    scene = plane(ball(0.0, 0.0, 3.2), ball(1.5, 0.0, 0.0, name="b"))
    scene = replace(scene, restitution=Restitution(1.0))
    run = played(scene)
    at_hit = 3.2**2 - 2 * G * (0.1 + 0.6 * (0.5 - 2 * R))
    assert run.final["b"][0] == pytest.approx(1.5 + at_hit / (2 * 0.6 * G), rel=1e-14)


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15, 1e-9, -1e-9])
def test_a_ball_stops_at_a_border_or_just_beside_it(off: float) -> None:
    length = 1.0 / (2 * 0.1 * G)
    run = played(plane(ball(1.0 - length + off, 0.0, 1.0)))
    assert far(run) == pytest.approx(1.0, abs=1.1e-9)
    assert run.events[-1].kind == "stop"
    assert len(crossings(run)) <= 1
    assert (len(crossings(run)) == 1) if off > 1e-12 else True
    assert (len(crossings(run)) == 0) if off < -1e-12 else True


@pytest.mark.parametrize("angle", [0.0, 10.0, 45.0, 90.0, 133.0])
def test_a_ball_that_grazes_a_corner_ends_where_it_would_without_the_patch(angle: float) -> None:
    """It comes in or not, as rounding has it, and nothing else depends on that."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))

    def turned(x: float, y: float) -> tuple[float, float]:
        return c * x - s * y, s * x + c * y

    square = tuple(turned(1 + x, y) for x, y in ((0, 0), (0.3, 0.3), (0, 0.6), (-0.3, 0.3)))
    for k in range(-5, 6):
        x, y = turned(0.0, k * 1e-16)
        run = played(plane(ball(x, y, *turned(3.0, 0.0)), patches=(Patch(square, surface=0.6),)))
        assert math.hypot(*run.end.position[0]) == pytest.approx(9.0 / (2 * 0.1 * G), rel=1e-12)
        assert len(run.events) <= 3


def test_a_diagonal_through_the_corners_is_not_missed() -> None:
    for k in range(-8, 9):
        square = Patch(((1, 0), (2, 1), (1, 2), (0, 1)), surface=0.3)
        run = played(plane(ball(-1.0, 1.0 + k * 1.2e-16, 5.0), patches=(square,)))
        lost = 2 * G * (0.1 + 0.3 * 2.0)
        assert crossings(run) == [0, None]
        assert far(run) == pytest.approx(2.0 + (25.0 - lost) / (2 * 0.1 * G), rel=1e-12)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12, 1e-15])
def test_a_drawn_ball_turns_back_at_a_border(depth: float) -> None:
    """It comes in by a depth, and rolls back: its roll backwards is as large as its velocity."""
    pull = 0.2 * G
    edge = 1.0 / (2 * pull) - depth
    sand = Patch(((edge, -1.0), (9.0, -1.0), (9.0, 1.0), (edge, 1.0)), surface=0.4)
    run = played(
        plane(ball(0.0, 0.1, 1.0, roll=-4.0), patches=(sand,), friction=Friction(0.2, rolling=0.02))
    )
    slower = math.sqrt(2 * pull * depth)
    assert run.events[-1].kind == "stop"
    assert crossings(run)[: 2 if depth > 1e-10 else 0] == [0, None][: 2 if depth > 1e-10 else 0]
    assert len(run.events) <= 5
    alone = played(
        plane(ball(0.0, 0.1, 1.0, roll=-4.0), patches=(), friction=Friction(0.2, rolling=0.02))
    )
    assert far(run) == pytest.approx(far(alone), abs=10 * slower + 1e-12)


def test_a_ball_that_runs_along_a_border_meets_nothing_there() -> None:
    for y in (1.0, math.nextafter(1.0, 0.0), math.nextafter(1.0, 2.0)):
        run = played(plane(ball(0.5, y, 2.0)))
        assert len(run.events) <= 3
        assert far(run) > 1.0


def test_a_border_at_the_cushion_that_a_ball_hits() -> None:
    table, sand = (
        Table.rectangle(1.0, 1.0),
        Patch(((1 - R, 0), (1, 0), (1, 1), (1 - R, 1)), surface=0.9),
    )
    scene = plane(
        ball(0.5, 0.5, 2.0), patches=(sand,), table=table, restitution=Restitution(cushion=0.8)
    )
    with_sand, without = played(scene), played(replace(scene, patches=()))
    assert far(with_sand) == pytest.approx(far(without), abs=1e-12)
    assert len(crossings(with_sand)) in (0, 2)


HELD = State(((0.2, R),), ((0.6, 0.0),), roll=((0.4, -0.9),))


def held_along_a_cushion() -> Scene:
    """Return a ball that its roll presses on to a dead cushion, beside which a border lies."""
    return replace(
        plane(ball(0.2, R, 0.6), friction=Friction(0.2, 0.2, rolling=0.02)),
        table=Table.rectangle(3.0, 1.0), restitution=Restitution(cushion=0.0),
        patches=(Patch(((0.25, 0), (2, 0), (2, 1), (0.25, 1)), surface=0.3, rolling=0.1),),
    )  # fmt: skip


def test_a_ball_held_along_a_cushion_crosses_a_border() -> None:
    scene = held_along_a_cushion()
    run = played(scene, start=HELD)
    crossed = next(event for event in run.events if event.kind == "patch")
    (contact,) = run.persistent
    assert contact.since < crossed.t < contact.until
    end = patch_run(scene, HELD).final[0]
    assert math.dist(run.end.position[0], (end.real, end.imag)) < run.persistent_shift <= 1e-7


# -- an independent reference ----------------------------------------------------------------------


@pytest.mark.parametrize("seed", some_slow(60, quick=5))
def test_random_scenes_end_where_the_reference_ends(seed: int) -> None:
    scene = random_scene(seed)
    run = played(scene)
    try:
        reference = patch_run(scene)
    except Refused as error:
        pytest.skip(str(error))
    off = [
        abs(complex(*run.final[b.id]) - p)
        for b, p in zip(scene.balls, reference.final, strict=True)
    ]
    assert max(off) < 1e-10 + run.rounding + run.policy_shift + run.persistent_shift


@pytest.mark.parametrize("seed", some_slow(20, quick=4))
def test_soft_scenes_whose_contacts_persist_end_where_the_reference_ends(seed: int) -> None:
    scene = random_scene(("soft", seed), restitution=Restitution(0.0, cushion=0.0))
    run = played(scene)
    try:
        reference = patch_run(scene)
    except Refused as error:
        pytest.skip(str(error))
    if len(run.events) > 50:
        pytest.skip("a ball that presses another one to a cushion hits both, ever faster")
    off = [
        abs(complex(*run.final[b.id]) - p)
        for b, p in zip(scene.balls, reference.final, strict=True)
    ]
    assert max(off) < 1e-9 + run.rounding + run.policy_shift + run.persistent_shift


def test_energy_never_grows() -> None:
    for seed in seeds(40):
        run = played(random_scene(seed))
        energy = run.energy_at(np.linspace(0.0, run.duration, 400))
        grows = [after > before * (1 + 1e-12) for before, after in pairwise(energy.tolist())]
        assert not any(grows), seed


def test_no_scene_has_many_crossings() -> None:
    for seed in seeds(100):
        run = unmeasured(coarse_scene(seed), max_events=2_000)
        assert run.status == "settled", seed
        assert len(crossings(run)) <= 60, seed


def coarse_scene(seed: int) -> Scene:
    """Return one whose patches have corners and sides on starts, in the middle, and on each other.

    Balls go along them, or not at all.
    """
    rnd = random.Random(f"coarse {seed}")

    def place() -> tuple[float, float]:
        return rnd.randrange(1, 8) / 10.0, rnd.randrange(1, 5) / 10.0

    balls, rolls = list[Ball](), rnd.random() < 0.6
    while len(balls) < rnd.choice((1, 2, 3)):
        at = place()
        if all(math.dist(at, other.position) > 2 * R for other in balls):
            goes = rnd.choice((-1.0, 0.0, 1.0)), rnd.choice((-1.0, 0.0, 1.0))
            roll = rnd.choice((0.0, 1.0, -1.0, -2.5)) if rolls else 0.0
            balls.append(Ball(f"{len(balls)}", at, R, M, velocity=goes, roll=roll))
    patches = list[Patch]()
    while len(patches) < rnd.choice((1, 2, 3, 4)):
        own: dict[str, Any] = {"surface": rnd.choice((0.1, 0.2, 0.5))}
        if rolls:
            own["rolling"] = rnd.choice((0.01, 0.05, 0.1))
        try:
            if rnd.random() < 0.4:
                patches.append(Patch(center=place(), radius=rnd.choice((0.1, 0.2)), **own))
            else:
                corners = tuple(place() for _ in range(rnd.choice((3, 4))))
                patches.append(Patch(corners, **own))
        except SceneError:
            continue
    e = rnd.choice((0.0, 0.5, 0.9))
    return Scene(
        tuple(balls), Table.rectangle(0.8, 0.5), Restitution(e, cushion=e),
        Friction(0.2, rnd.choice((0.0, 0.2)), rolling=0.02 if rolls else None),
        patches=tuple(patches),
    )  # fmt: skip


# -- derivatives -----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", some_slow(30, quick=12))
def test_derivatives_go_through_borders(seed: int) -> None:
    scene, h = random_scene(seed), 1e-6
    names = ["x.0", "y.0", "vx.0", "vy.0", "friction.surface", "restitution.cushion"]
    run = played(scene)
    derived = run.derivatives(names)
    for k, name in enumerate(names):
        old = {"x": scene.balls[0].position[0], "y": scene.balls[0].position[1]}
        old |= dict(zip(("vx", "vy"), scene.balls[0].velocity, strict=True))
        value = old.get(name[:-2], {"friction.surface": scene.friction.surface}.get(name, 0.0))
        value = (scene.restitution.cushion or 0.0) if name == "restitution.cushion" else value
        try:
            both = [played(with_inputs(scene, {name: value + step})) for step in (h, -h)]
        except SceneError:
            continue
        kinds = [[(e.kind, e.balls) for e in each.events] for each in (run, *both)]
        if kinds[0] == kinds[1] == kinds[2]:
            ends = [np.array(each.end.position) for each in both]
            slope = (ends[0] - ends[1]) / (2 * h)
            scale = max(1.0, float(np.abs(slope).max()))
            assert np.abs(slope - derived.final[:, :, k]).max() < 1e-4 * scale


def test_the_derivative_of_a_straight_crossing() -> None:
    """x = 1 + (v^2 - 2 a d) / (2 b), with a before the border and b behind it."""
    run = played(plane(ball(0.5, 0.0, 2.0)))
    derived = run.derivatives(["x.a", "vx.a", "friction.surface"])
    assert derived.final[0, 0].tolist() == pytest.approx(
        [0.1 / 0.6, 2.0 / (0.6 * G), -0.5 / 0.6], rel=1e-13
    )
    first = 2.0 - math.sqrt(4.0 - 0.1 * G)
    assert run.events[0].t == pytest.approx(first / (0.1 * G), rel=1e-13)
    speed = math.sqrt(4.0 - 0.1 * G)
    assert derived.times[0, 0] == pytest.approx(-1.0 / speed, rel=1e-13)


def test_a_border_that_a_ball_crosses_in_persistent_contact_has_no_derivative() -> None:
    run = played(held_along_a_cushion(), start=HELD)
    derived = run.derivatives(["x.a", "friction.surface"])
    crossed = [k for k, event in enumerate(run.events) if event.kind == "patch"]
    assert crossed and np.isnan(derived.times[crossed]).all() and np.isnan(derived.final).all()
    assert "a contact is persistent" in derived.warnings[0]


def test_a_graze_and_a_start_at_a_border_have_no_derivative() -> None:
    run = played(plane(ball(1.0, 0.0, 1.0)))
    found = played(plane(ball(math.nextafter(1.0, 0.0), 0.0, 1.0))).derivatives("position")
    assert np.isnan(found.final).any()
    assert "border of a patch" in found.warnings[0]
    assert run.rounding < 1e-14


def test_rounding_goes_through_borders() -> None:
    for seed in range(10):
        run = played(random_scene(seed))
        assert 0.0 <= run.rounding < 1e-11


# -- files, Python, other solvers ------------------------------------------------------------------


def test_a_file_gives_the_scene_back() -> None:
    scene = plane(
        ball(0.0, 0.0, 1.0), patches=(SAND, Patch(center=(1.0, 2.0), radius=0.3, surface=0.1))
    )
    assert loads(scene.to_toml()) == scene
    text = scene.to_toml() + '\n[units]\nlength = "in"\n'
    assert loads(text).patches[1].radius == pytest.approx(0.3 * 0.0254)
    assert repr(scene).endswith("an open plane with 2 patches; law coulomb; shots none>")


def test_runs_say_what_was_crossed(tmp_path: Any) -> None:
    run = played(plane(ball(0.0, 0.2, 4.0)))
    into, out, _ = (event.as_dict() for event in run.events)
    assert into == {"t": run.events[0].t, "kind": "patch", "balls": ["a"], "patch": 0}
    assert out == {"t": run.events[1].t, "kind": "patch", "balls": ["a"]}
    run.save(tmp_path / "run.npz")
    assert Run.load(tmp_path / "run.npz").events == run.events
    assert not run.events[0].is_contact


@pytest.mark.parametrize("solver", ["time-slice", "pymunk-discrete", "pymunk-builtin"])
def test_other_solvers_refuse_in_a_sentence(solver: str) -> None:
    text = f"solver = {solver}: does not play patches, and the scene has some (these do: "
    with pytest.raises(SettingError) as refused:
        simulate(plane(ball(0.0, 0.0, 1.0)), solver=solver)
    assert str(refused.value) == text + "pymunk, event-driven)"


def test_the_end_of_a_run_goes_on() -> None:
    scene = plane(ball(0.0, 0.0, 4.0))
    half = played(scene, max_time=0.4)
    assert crossings(half) == [0]
    assert far(played(scene, start=half.end)) == pytest.approx(far(played(scene)), rel=1e-14)


def test_scenes_without_patches_ask_for_none() -> None:
    assert load("report").ground.borders == []
