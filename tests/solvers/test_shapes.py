"""Every shape of cushion is played, studied, written and drawn by all that play straight ones."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest
from PIL import Image

from pool_pymunk import (
    Ball,
    Billiards,
    Friction,
    Post,
    Restitution,
    Run,
    Scene,
    SettingError,
    Shot,
    Table,
    Uncertainty,
    atlas,
    loads,
    same_balls,
    sensitivity,
    simulate,
    simulate_many,
    sweep,
)
from pool_pymunk.page import page
from pool_pymunk.render import FilmSettings, film, picture
from pool_pymunk.solvers.pymunk_space import cushion_shapes
from tests.shared.hard_scenes import exact

R, M = 0.03, 0.17  # m, kg
BOX = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
# These are the table, the posts, the direction of the shot (degrees), and the cushion that is met.
SHAPES: dict[str, tuple[Table, tuple[Post, ...], float, int]] = {
    "outward arc": (Table(BOX, (0.0, 0.4, 0.0, 0.0)), (), 8.0, 1),
    "inward arc": (Table(BOX, (-0.2, 0.0, 0.0, 0.0)), (), -31.0, 0),
    "circle": (Table.circle(0.6), (), 30.0, 0),
    "stadium": (Table.stadium(2.0, 1.0), (), 12.0, 1),
    "post": (Table(BOX), (Post((1.2, 0.55), 0.1, 0.9, 0.05),), 5.0, 4),
    "pin": (Table(BOX), (Post((1.2, 0.5), 0.0),), 0.5, 4),
}
SPEED, ROLL = 1.5, 0.3  # m/s; of the shot, and its roll as a share of it
PAIR = same_balls(0.95, 0.05)


def scene_with(shape: str, rolls: bool = False) -> Scene:
    """Return a scene with a shot at the shape, and two balls that lie beside."""
    table, posts, angle, _ = SHAPES[shape]
    places = {"C": (0.5, 0.5), "1": (0.4, 0.75), "2": (0.7, 0.8)}
    balls = tuple(Ball(id_, place, R, M, cue=id_ == "C") for id_, place in places.items())
    friction = Friction(0.2, 0.1, 0.05, 0.02) if rolls else Friction(0.06, 0.1, 0.05)
    shot = Shot("at it", "C", speed=SPEED, angle=angle, roll=ROLL if rolls else 0.0)
    e = Restitution(ball_ball=0.95, cushion=0.8)
    return Scene(balls, table, e, friction, shots=(shot,), posts=posts, title=shape)


def apart(run: Run, other: Run) -> float:
    """Return how far (m) the farthest ball ends elsewhere."""
    return max(math.dist(run.final[id_], end) for id_, end in other.final.items())


def met(run: Run) -> list[int | None]:
    """Return the cushions that were met."""
    return [event.cushion for event in run.events if event.kind == "ball-cushion"]


# -- solvers ---------------------------------------------------------------------------------------


def by_event_driven(scene: Scene, _: Path) -> None:
    run = exact(scene)
    assert met(run)[0] == SHAPES[scene.title][3]
    assert run.status == "settled" and not run.policies


def launch(scene: Scene) -> tuple[float, float]:
    """Return the velocity (m/s) of the shot."""
    velocity = scene.shots[0].launch
    assert velocity is not None
    return velocity


def by_time_slice(scene: Scene, _: Path) -> None:
    """The error falls with the slice, to first order and some luck."""
    off = [apart(simulate(scene, 1, solver="time-slice", dt=dt), exact(scene)) for dt in SLICES]
    assert off[1] < off[0] / 3.0
    assert off[1] < 2e-3


def by_pymunk_discrete(scene: Scene, _: Path) -> None:
    if scene.surface.rolls:
        refuses(scene, "pymunk-discrete")
        return
    run = simulate(scene, 1, solver="pymunk-discrete", dt=3e-4)
    assert met(run) == met(exact(scene))
    assert apart(run, exact(scene)) < 3e-3


def by_pymunk_builtin(scene: Scene, _: Path) -> None:
    """Its balls spin, so they end elsewhere; it meets the same cushion, up to two steps late."""
    if scene.surface.rolls:
        refuses(scene, "pymunk-builtin")
        return
    run = simulate(scene, 1, solver="pymunk-builtin", dt=1e-3)
    first, its = (
        next(e for e in each.events if e.cushion is not None) for each in (exact(scene), run)
    )
    assert (its.cushion, run.status) == (first.cushion, "settled")
    assert abs(its.t - first.t) < 3e-3
    assert scene.table is not None and all(scene.table.contains(*end) for end in run.final.values())


def refuses(scene: Scene, solver: str) -> None:
    with pytest.raises(SettingError, match=f"solver = {solver}: does not roll balls"):
        simulate(scene, 1, solver=solver)


SLICES = (1e-3, 1e-4)  # s


# -- spaces of one's own ---------------------------------------------------------------------------

GUESTS = pymunk.ShapeFilter(categories=0b10, mask=0b10)  # They meet each other alone.
BALLS = pymunk.ShapeFilter(categories=0b01, mask=0b01)


def in_a_space(scene: Scene, **settings: Any) -> Billiards:
    """Return a space of one's own with the balls, and the cushions as walls with their sides."""
    drag = scene.surface.drag if scene.surface.rolls else None
    table = Billiards(
        pymunk.Space(), max_dt=1 / 60, pair=PAIR, deceleration=scene.deceleration, rolling=drag,
        **settings,
    )  # fmt: skip
    for shape, wall in zip(cushion_shapes(scene, table.space), scene.cushions, strict=True):
        shape.sensor = True  # Guests are not to meet the hull of an arc.
        shape.filter = BALLS
        sides: Any = wall.sides
        table.add_wall(shape, wall.restitution, wall.friction, sides=sides)
    for ball in scene.balls:
        body = pymunk.Body(ball.mass, 1e-4)
        body.position = ball.position
        circle = pymunk.Circle(body, ball.radius)
        circle.filter = BALLS
        table.add_ball(circle)
    table.strike(table.balls[0], launch(scene), *([ROLL] if scene.surface.rolls else []))
    return table


def ends_as_the_exact_run(table: Billiards, scene: Scene) -> None:
    run = exact(scene)
    while table.moving:
        table.space.step(1 / 60)
    for ball, end in zip(table.balls, run.final.values(), strict=True):
        assert math.dist(ball.body.position, end) < 1e-10


def by_billiards_with_a_guest(scene: Scene, _: Path) -> None:
    """The guest bounces about in a polyline of pymunk's, and the balls know nothing of it."""
    assert scene.table is not None
    table, points = in_a_space(scene), scene.table.polyline
    ground = table.space.static_body
    sides = [pymunk.Segment(ground, a, b, 0.001) for a, b in pairwise([*points, points[0]])]
    posts = [pymunk.Circle(ground, post.radius, post.position) for post in scene.posts]
    guest = pymunk.Body(0.05, 1e-5)
    guest.position, guest.velocity = (0.6, 0.4), (1.5, -0.2)
    for shape in (*sides, *posts, box := pymunk.Poly.create_box(guest, (0.04, 0.04))):
        shape.elasticity, shape.filter = 1.0, GUESTS
    table.space.add(*sides, *posts, guest, box)
    ends_as_the_exact_run(table, scene)
    assert scene.table.contains(*guest.position)
    assert guest.velocity.length > 0.5


# -- studies ---------------------------------------------------------------------------------------


def by_sensitivity(scene: Scene, _: Path) -> None:
    found = sensitivity(scene, 1, Uncertainty(1e-7), 8)
    assert found.worst.amplification is not None
    assert 0.5 < found.worst.amplification < 1e3


def by_many_shots(scene: Scene, _: Path) -> None:
    velocity = np.zeros((3, 3, 2))
    velocity[:, 0] = np.array(launch(scene)) * np.array([[0.9], [1.0], [1.1]])
    roll = ROLL * velocity if scene.surface.rolls else None
    batch = simulate_many(scene, None, velocity, roll=roll)
    assert batch.final[1].tolist() == [list(end) for end in exact(scene).end.position]


def by_derivatives(scene: Scene, _: Path) -> None:
    """They agree with differences of two runs."""
    small = 1e-6
    found = exact(scene).derivatives(["speed"]).of("C", "speed")
    faster = [replace(scene.shots[0], speed=SPEED + k * small) for k in (-1, 1)]
    low, high = (np.array(exact(replace(scene, shots=(shot,))).final["C"]) for shot in faster)
    assert (high - low) / (2 * small) == pytest.approx(found, rel=1e-4, abs=1e-5)


def by_sweep(scene: Scene, out: Path) -> None:
    found = sweep(scene, 1, vary={"angle": (-1, 1)}, samples=6, out=out / "sweep")
    assert found.shots == 6


def by_atlas(scene: Scene, _: Path) -> None:
    found = atlas(scene, 1, angle=(-2, 2), speed=(1, 2), size=(3, 3), ball="C")
    assert found.end[1, 1] == pytest.approx(exact(scene).final["C"], abs=1e-12)


def by_environments(scene: Scene, _: Path) -> None:
    from pool_pymunk.env import CaromEnv

    env = CaromEnv(scene, max_speed=2.0)
    for seed in range(3):
        env.reset(seed=seed)
        info = env.step(np.array([0.1 * seed, 0.5], np.float32))[4]
        assert info["speed"] == pytest.approx(1.5)
        assert all(scene.table.contains(*place) for place in env.position)  # type: ignore[union-attr]


# -- files and pictures ----------------------------------------------------------------------------


def by_files(scene: Scene, out: Path) -> None:
    assert loads(scene.to_toml()) == scene
    inches = replace(scene, units=replace(scene.units, length="in"))
    assert loads(inches.to_toml()) == inches


def by_pages(scene: Scene, _: Path) -> None:
    document = page([[exact(scene)]])
    (text,) = re.findall(r'<script type="application/json" id="content">(.*?)</script>', document)
    content = json.loads(text)
    assert len(content["table"]["outline"]) == len(scene.table.polyline)  # type: ignore[union-attr]
    posts = [radius for _, _, radius, color in content["discs"] if color == "rail"]
    assert len(posts) == len(scene.posts)
    assert all(radius > 0.0 for radius in posts)  # A pin is seen, too.


def by_pictures(scene: Scene, out: Path) -> None:
    run = exact(scene)
    for name in ("end.png", "start.svg"):
        picture(run, out / name, when=name[: name.index(".")], dpi=40.0)  # type: ignore[arg-type]
    with Image.open(out / "end.png") as end:
        assert end.width > 300
    settings = FilmSettings(size=(160, 90), fps=5.0, end=0.5, pause=0.0)
    film(run, out / "film.gif", settings)
    with Image.open(out / "film.gif") as frames:
        assert frames.n_frames > 1  # type: ignore[attr-defined]


User = Callable[[Scene, Path], None]
PLAY: list[User] = [
    by_event_driven, by_time_slice, by_pymunk_discrete, by_pymunk_builtin,
    by_billiards_with_a_guest, by_many_shots, by_derivatives,
]  # fmt: skip
# It makes no difference to these whether balls roll.
USE: list[User] = [
    by_sensitivity, by_sweep, by_atlas, by_environments, by_files, by_pages, by_pictures,
]  # fmt: skip
NEEDS = {by_sweep: "pyarrow", by_environments: "gymnasium"}


@pytest.mark.parametrize(
    ("user", "rolls"),
    [(user, rolls) for user in (*PLAY, *USE) for rolls in (False, True)[: 1 + (user in PLAY)]],
    ids=lambda what: getattr(what, "__name__", "rolls" if what else "slides"),
)
@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_everywhere(user: User, shape: str, rolls: bool, tmp_path: Path) -> None:
    if user in NEEDS:
        pytest.importorskip(NEEDS[user])
    user(scene_with(shape, rolls), tmp_path)
