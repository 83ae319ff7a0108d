"""Balls fall on a tilted table: closed forms, persistent contacts, a reference of forty digits.

``python -m tests.core.test_falling 400`` plays so many random scenes beside the reference.
"""

from __future__ import annotations

import math
import random
import sys
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Post,
    Restitution,
    Scene,
    SceneError,
    SettingError,
    Table,
    loads,
    simulate,
    simulate_many,
)
from pool_pymunk.model import inputs
from tests.oracle import falling_reference as reference
from tests.shared.scenes import seeds

G, R = 9.80665, 0.03
BOX = (-1.0, 0.0), (1.0, 0.0), (1.0, 4.0), (-1.0, 4.0)
Corners = tuple[tuple[float, float], ...]


def fallen(*balls: Ball, e: float = 0.6, mu: float = 0.0, until: float = 60.0,
           outline: Corners = BOX, posts: tuple[Post, ...] = (), **more: Any) -> Any:  # fmt: skip
    """Return the run of balls that fall in a box."""
    scene = Scene(
        balls, Table(outline, tilt=(0.0, -G)), Restitution(e, None, e), Friction(0.0, mu, mu),
        physics=Physics(max_time=until), posts=posts,
    )  # fmt: skip
    return simulate(scene, solver="event-driven", **more)


def ball(x: float, y: float, velocity: tuple[float, float] = (0.0, 0.0), id_: str = "a") -> Ball:
    return Ball(id_, (x, y), R, 0.2, velocity=velocity)


@pytest.mark.parametrize("e", [0.5, 0.8, 0.95, 1.0])
def test_ten_apexes_are_those_of_the_closed_form(e: float) -> None:
    height, fall = 2.0, math.sqrt(2.0 * 2.0 / G)
    run = fallen(ball(0.0, R + height), e=e, until=20.0 if e == 1.0 else 60.0)
    apexes = [fall * (1.0 + 2.0 * sum(e**j for j in range(1, k)) + e**k) for k in range(1, 11)]
    tops = run.at(np.array(apexes))[0][:, 0, 1] - R
    assert tops == pytest.approx([height * e ** (2 * k) for k in range(1, 11)], abs=1e-12)


@pytest.mark.parametrize("e", [0.0, 0.3, 0.5, 0.8, 0.95])
def test_a_ball_that_bounces_rests_when_its_bounces_have_an_end(e: float) -> None:
    """There are infinitely many, and they last (1 + e)/(1 - e) sqrt(2 h/g) in all."""
    run = fallen(ball(0.0, R + 2.0), e=e)
    last = (1.0 + e) / (1.0 - e) * math.sqrt(2.0 * 2.0 / G)
    assert run.status == "settled"
    assert run.duration == pytest.approx(last, abs=1e-10)
    assert run.end.position[0] == pytest.approx((0.0, R), abs=1e-14)
    assert [event.kind for event in run.events].count("stop") == 1


def test_friction_while_a_ball_bounces_is_that_of_its_weight() -> None:
    """In all bounces together the floor pushes as much as the weight, so the ball slides as far."""
    speed, mu, e = 1.0, 0.05, 0.8
    run = fallen(ball(-0.9, R + 0.2, (speed, 0.0)), e=e, mu=mu)
    bounces = (1.0 + e) / (1.0 - e) * math.sqrt(2.0 * 0.2 / G)
    left = speed - mu * G * bounces
    [contact] = run.persistent
    assert contact.until == pytest.approx(bounces + left / (mu * G), abs=1e-9)
    assert run.end.position[0][1] == pytest.approx(R, abs=1e-12)


def test_energy_stays_for_333_s_with_slopes_a_post_and_other_balls() -> None:
    outline = (-1.0, 0.4), (0.0, 0.0), (1.0, 0.4), (1.0, 4.0), (-1.0, 4.0)
    balls = [ball(-0.5, 1.0), ball(0.4, 1.6, (0.3, 0.0), "b"), ball(0.1, 2.5, (-0.6, 0.0), "c")]
    run = fallen(*balls, e=1.0, until=333.0, outline=outline, posts=(Post((0.05, 0.9), 0.12),))
    assert run.duration == 333.0 and len(run.events) > 1000
    before = sum(
        0.5 * (each.velocity[0] ** 2 + each.velocity[1] ** 2) + G * each.position[1]
        for each in balls
    )
    assert run.energy["initial"] == pytest.approx(0.2 * before, rel=1e-14)
    assert run.energy["final"] == pytest.approx(0.2 * before, rel=1e-9)
    places, velocities = np.array(run.end.position), np.array(run.end.velocity)
    after = 0.5 * (velocities**2).sum() + G * places[:, 1].sum()
    assert after == pytest.approx(before, rel=1e-9)


# -- what holds balls ------------------------------------------------------------------------------


def test_balls_that_lie_on_each_other_rest_at_once() -> None:
    run = fallen(ball(0.0, R), ball(0.0, 3 * R, id_="b"))
    assert (run.status, run.duration) == ("settled", 0.0)


def test_a_pile_in_a_valley_comes_to_rest_and_pushes_with_its_weight() -> None:
    outline = (-0.2, 0.2), (0.0, 0.0), (0.2, 0.2), (0.2, 4.0), (-0.2, 4.0)
    balls = [
        ball(0.0, 0.2),
        ball(-0.031, 0.3, id_="b"),
        ball(0.0311, 0.3, id_="c"),
        ball(0.001, 0.4, id_="d"),
    ]
    run = fallen(*balls, outline=outline)
    assert run.status == "settled"
    places = run.end.position
    gaps = [math.dist(p, q) - 2 * R for k, p in enumerate(places) for q in places[:k]]
    assert min(gaps) > -1e-6 * R
    assert places[0] == pytest.approx((0.0, math.sqrt(2.0) * R), abs=1e-6)  # It touches both sides.
    contacts = run.table("contacts").arrays()
    up = float(contacts["impulse_y"][~np.isnan(contacts["cushion"])].sum())
    assert up == pytest.approx(4 * 0.2 * G * run.duration, rel=1e-6)


@pytest.mark.parametrize(("mu", "stays"), [(0.4, False), (0.6, True)])
def test_friction_holds_a_ball_on_a_slope_that_is_not_too_steep(mu: float, stays: bool) -> None:
    """The slope has a tangent of 1/2."""
    slope = (-1.0, 1.0), (1.0, 0.0), (1.0, 4.0), (-1.0, 4.0)
    n = math.hypot(1.0, 2.0)
    start = -0.5 + R / n, 0.75 + 2.0 * R / n
    run = fallen(ball(*start), mu=mu, e=0.5, outline=slope, until=0.5)
    if stays:
        assert (run.status, run.duration) == ("settled", 0.0)
        return
    rate = G * (1.0 - 2.0 * mu) / n  # m/s^2
    assert math.dist(run.end.position[0], start) == pytest.approx(rate * 0.5**2 / 2.0, abs=1e-9)


def test_a_ball_slides_off_a_post_where_the_closed_form_says() -> None:
    """It begins a little beside the top, and leaves where cos(angle) is 2/3 of that at first."""
    first, radius = 0.01, 0.2
    far = radius + R
    run = fallen(
        ball(far * math.sin(first), 1.0 + far * math.cos(first)), e=0.0, until=2.0,
        posts=(Post((0.0, 1.0), radius),),
    )  # fmt: skip
    contact = run.persistent[0]
    leaves = run.at(np.array([contact.until]))[0][0, 0]
    assert (leaves[1] - 1.0) / far == pytest.approx(2.0 / 3.0 * math.cos(first), abs=1e-6)


@pytest.mark.parametrize(
    ("speed", "drop", "e", "mu"), [(3.0, 0.01, 0.3, 0.02), (5.0, 0.2, 0.5, 0.06)]
)
def test_a_ball_that_slides_off_a_ledge_hits_no_corner(
    speed: float, drop: float, e: float, mu: float
) -> None:
    """It bounces, slides at mu g, and leaves the ledge on a parabola; v^2 > g R there."""
    ledge = (10.0, 0.0), (14.0, 0.0), (14.0, 5.0), (0.0, 5.0), (0.0, 3.0), (10.0, 3.0)
    lands, lost = math.sqrt(2.0 * drop / G), mu * math.sqrt(2.0 * drop * G)
    x, v, t, parting = 2.0 + speed * lands, speed - (1.0 + e) * lost, lands, e * G * lands
    while parting > 1e-12:
        x, t = x + v * 2.0 * parting / G, t + 2.0 * parting / G
        v, parting = v - mu * (1.0 + e) * parting, e * parting
    leaves = math.sqrt(v * v - 2.0 * mu * G * (10.0 - x))
    after = 0.25
    until = t + (v - leaves) / (mu * G) + after
    end = 10.0 + leaves * after, 3.0 + R - G * after * after / 2.0
    for tolerance in (1e-7, 1e-9):  # m
        run = fallen(ball(2.0, 3.0 + R + drop, (speed, 0.0)), e=e, mu=mu, until=until,
                     outline=ledge, contact_tolerance=tolerance)  # fmt: skip
        assert [event.cushion for event in run.events if event.cushion == 5] == []
        assert math.dist(run.final["a"], end) <= tolerance


@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_a_ball_that_a_dead_round_wall_lets_go_meets_it_again(mu: float) -> None:
    """After the hit it moves along the wall, to rounding, and bends away from it."""
    size, r = 0.9216315835805715, 0.034881521366080005
    outline = (size, size / 2.0), (0.0, size / 2.0)
    table = Table(outline, (1.0, 1.0), tilt=(9.654309940885891, 1.6835378122607974))
    for faster in range(92, 120, 4):
        speed = (-0.005528672138829838 * faster, 0.005631469692341573 * faster)
        ball = Ball("b", (0.1754480046950281, 0.7574191802503069), r, 0.2, velocity=speed)
        coefficients = Restitution(0.0, cushion=0.0), Friction(0.0, cushion=mu)
        scene = Scene((ball,), table, *coefficients, Physics(max_time=2.0))
        run = simulate(scene, solver="event-driven")
        places = run.at(np.linspace(0.0, 2.0, 401))[0][:, 0] - size / 2.0
        assert np.hypot(*places.T).max() < size / 2.0 - r + 1e-6, faster


def test_a_ball_wakes_others_that_rest() -> None:
    run = fallen(ball(0.0, R), ball(0.5, R, (-1.0, 0.0), "b"), e=1.0, until=0.45)
    assert run.end.position[0] == pytest.approx((0.5 - 2 * R - 0.45 + 0.0, R), abs=1e-9)


# -- beside forty digits ---------------------------------------------------------------------------


def scene_of(seed: int) -> Scene | None:
    """Return a random scene, or None if its balls have no room."""
    rnd = random.Random(f"falling {seed}")
    low = [rnd.uniform(-0.3, 0.3) for _ in range(2)]
    outline = (-0.6, low[0]), (0.6, low[1]), (0.6, 2.0), (-0.6, 2.0)
    posts = tuple(
        Post((rnd.uniform(-0.4, 0.4), rnd.uniform(0.5, 1.2)), rnd.uniform(0.02, 0.15))
        for _ in range(rnd.randrange(3))
    )
    balls = tuple(
        Ball(str(k), (rnd.uniform(-0.5, 0.5), rnd.uniform(0.5, 1.9)), rnd.uniform(0.02, 0.05),
             rnd.uniform(0.1, 0.4), velocity=(rnd.gauss(0, 1), rnd.gauss(0, 1)))
        for k in range(rnd.randrange(1, 5))
    )  # fmt: skip
    tilt = (rnd.gauss(0.0, 2.0), rnd.gauss(-6.0, 4.0))
    e, e_balls = rnd.choice((1.0, 0.9, 0.75)), rnd.choice((1.0, 0.8))
    mu = rnd.choice((0.0, 0.1, 0.3))
    try:
        return Scene(
            balls, Table(outline, tilt=tilt), Restitution(e_balls, None, e), Friction(0.0, mu, 0.0),
            physics=Physics(max_time=rnd.uniform(0.3, 2.0)), posts=posts,
        )  # fmt: skip
    except SceneError:
        return None


def in_digits(scene: Scene) -> tuple[list[reference.Body], reference.World]:
    """Return the balls and the world of a scene, as the reference has them."""
    assert scene.table is not None

    def exact(point: tuple[float, float]) -> tuple[Any, Any]:
        return mpf(point[0]), mpf(point[1])

    bodies = [
        reference.Body(exact(b.position), exact(b.velocity), mpf(b.radius), mpf(b.mass))
        for b in scene.balls
    ]
    walls = []
    corners = scene.table.outline
    for p, q in zip(corners, (*corners[1:], corners[0]), strict=True):
        (px, py), (qx, qy) = exact(p), exact(q)
        length = mp.sqrt((qx - px) ** 2 + (qy - py) ** 2)
        walls.append(((px, py), ((py - qy) / length, (qx - px) / length)))
    posts = [(exact(post.position), mpf(post.radius)) for post in scene.posts]
    e, e_balls = scene.restitution.cushion, scene.restitution.ball_ball
    world = reference.World(
        walls, posts, exact(scene.tilt), mpf(e), mpf(scene.friction.cushion), mpf(e_balls)
    )
    return bodies, world


def compare(seed: int) -> tuple[str, float, float]:
    """Return what kind of scene it is, how far (m) its ends are off, and its figure (m)."""
    mp.dps = reference.DIGITS
    scene = scene_of(seed)
    if scene is None:
        return "no room", 0.0, 0.0
    run = simulate(scene, solver="event-driven")
    if run.persistent or run.status != "max_time":
        return "persists", 0.0, 0.0
    bodies, world = in_digits(scene)
    ends, _ = reference.play(bodies, world, run.duration, 1000)
    off = max(
        math.dist(own, (float(each.place[0]), float(each.place[1])))
        for own, each in zip(run.end.position, ends, strict=True)
    )
    return "played", off, run.rounding


def test_random_scenes_are_as_near_a_reference_of_forty_digits_as_they_say() -> None:
    found = [compare(seed) for seed in seeds(24, 12)]
    assert [kind for kind, *_ in found].count("played") >= len(found) // 3
    assert [(off, figure) for _, off, figure in found if off > figure + 1e-15] == []


# -- derivatives, and many shots -------------------------------------------------------------------


def test_derivatives_are_differences() -> None:
    table = Table(((0.0, 0.0), (2.0, 0.3), (2.0, 4.0), (0.0, 4.0)), tilt=(0.3, -G))
    scene = Scene(
        (Ball("a", (0.6, 1.0), R, 0.2, velocity=(0.7, 0.1)),
         Ball("b", (1.2, 0.5), R, 0.3, velocity=(-0.2, 2.0))),
        table, Restitution(0.9, None, 0.8), Friction(0.0, 0.1, 0.1),
        physics=Physics(max_time=2.0), posts=(Post((0.9, 0.5), 0.1),),
    )  # fmt: skip
    names = {"x.a": 0.6, "vx.b": -0.2, "restitution.cushion": 0.8, "friction.cushion": 0.1}
    found = simulate(scene, solver="event-driven").derivatives([*names]).final
    for k, (name, value) in enumerate(names.items()):
        ends = [
            np.array(
                simulate(
                    inputs.with_inputs(scene, {name: value + by}), solver="event-driven"
                ).end.position
            )
            for by in (1e-7, -1e-7)
        ]
        assert (ends[0] - ends[1]) / 2e-7 == pytest.approx(found[..., k], rel=1e-6, abs=1e-6)


def test_many_shots_fall_as_one_does() -> None:
    scene = scene_of(3)
    assert scene is not None
    speeds = np.linspace(0.0, 1.0, 5)
    velocity = np.array([[each.velocity for each in scene.balls]] * 5)
    velocity[:, 0, 0] = speeds
    batch = simulate_many(scene, velocity=velocity)
    for k in range(5):
        assert batch.run(k).end.position == tuple(map(tuple, batch.final[k].tolist()))


# -- what is refused -------------------------------------------------------------------------------

FALLS = """
[table]
length = 2.0
width = 1.0
tilt = [0.0, -9.80665]
[physics]
max_time = 1.0
[restitution]
cushion = 0.8
[[balls]]
id = "a"
position = [1.0, 0.5]
velocity = [0.1, 0.0]
radius = 0.03
mass = 0.2
"""


def test_a_file_has_a_tilt_in_any_units_and_is_written_again() -> None:
    scene = loads(FALLS)
    assert scene.tilt == (0.0, -9.80665)
    inches = loads("[units]\nlength = 'in'\n" + FALLS)
    assert inches.tilt == scene.tilt


PATCH = "[[patches]]\ncenter = [1.0, 0.5]\nradius = 0.1\nsurface = 0.2\n"
REFUSED = {  # what stands before a line of the file or in place of it, and what is said
    (
        "[restitution]",
        "[friction]\nsurface = 0.1\n[restitution]",
    ): "leave out friction.surface (0.1)",
    ("[restitution]", "[friction]\nrolling = 0.0\n[restitution]"): "leave out friction.rolling (0)",
    ("max_time = 1.0", ""): "on a tilted table balls may never come to rest",
    ("[0.0, -9.80665]", "[0.0]"): "table.tilt = [0.0]",
    ("[[balls]]", PATCH + "[[balls]]"): "patches[0].surface = 0.2: must be 0",
}


@pytest.mark.parametrize(("change", "message"), REFUSED.items())
def test_what_has_no_closed_form_is_refused(change: tuple[str, str], message: str) -> None:
    with pytest.raises(SceneError) as caught:
        loads(FALLS.replace(*change))
    assert message in str(caught.value)


def test_solvers_without_a_tilt_say_so_and_friction_cannot_be_varied() -> None:
    scene = loads(FALLS)
    for solver in ("time-slice", "pymunk-builtin", "pymunk-discrete"):
        with pytest.raises(SettingError, match="does not let balls fall"):
            simulate(scene, solver=solver)
    with pytest.raises(SettingError, match="no closed form"):
        simulate_many(scene, vary={"friction.surface": [0.0, 0.1]})


def main(count: int) -> None:
    for seed in range(count):
        kind, off, figure = compare(seed)
        if kind == "played" and off > figure:
            print(f"seed {seed}: off by {off:.2g} m, and says {figure:.2g}")


if __name__ == "__main__":
    main(int(sys.argv[1]))
