"""May a ball lie here? Whoever is asked gives the same answer, for numbers and for arrays."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Billiards,
    Friction,
    Pocket,
    Restitution,
    Scene,
    Table,
    loads,
    same_balls,
    simulate,
    simulate_many,
)
from pool_pymunk.core import layouts
from pool_pymunk.core.floor import TOUCHING, overlap
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import Side
from pool_pymunk.many.batch import CANNOT_START
from pool_pymunk.many.places import may_lie
from pool_pymunk.model.places import SUNK, room_beside
from pool_pymunk.model.quantities import Units
from pool_pymunk.page.live.answers import Answers

pytest.importorskip("gymnasium")

from pool_pymunk.env.games import Carom
from pool_pymunk.env.layouts import Generators, Layouts

Place = tuple[float, float]

R, SMALL, RIM = 0.05, 0.02, 0.08
FREE = (0.625, 0.375)  # Here the ball is free, in numbers that a file keeps.
OFFSETS = ((0.0, 0.0), (1000.125, -300.5))
OUTLINE = ((0.0, 0.0), (2.5, 0.0), (2.5, 1.0), (1.0, 1.0), (1.0, 2.5), (0.0, 2.0))
# shares of a radius by which an overlap is more than what is allowed
MORE = (-1e-2, -1e-9, -1e-13, 0.0, 1e-13, 1e-9, 1e-2)


class Case(NamedTuple):
    """A case is a place, and whether it is free, or None if rounding may decide."""

    place: Place
    is_free: bool | None


def scene_at(dx: float, dy: float) -> Scene:
    """Return a table with a slanted side, a corner that sticks out, a pocket, and three balls."""

    def there(x: float, y: float) -> Place:
        return (x + dx, y + dy)

    return Scene(
        balls=(
            Ball("small", there(1.75, 0.5), SMALL, 0.1),
            Ball("other", there(0.25, 0.625), SMALL, 0.1),
            Ball("C", there(*FREE), R, 0.2, cue=True),
        ),
        table=Table(tuple(there(*corner) for corner in OUTLINE)),
        restitution=Restitution(ball_ball=0.9, cushion=0.8),
        friction=Friction(surface=0.1),
        pockets=(Pocket("hole", there(1.25, 0.25), RIM),),
    )


def borders(scene: Scene, share: float) -> Iterator[tuple[Callable[[float], Place], float, float]]:
    """Yield each border: places by their depth (m), the size of what lies there, its share."""
    (dx, dy), *_ = scene.table.outline if scene.table else ()
    yield lambda depth: (dx + 0.5, dy + R - depth), R, share
    yield lambda depth: (dx + 2.5 - R + depth, dy + 0.75), R, share
    slant = math.atan2(0.5, 1.0)
    yield beside((dx + 0.5, dy + 2.25), R, (math.sin(slant), -math.cos(slant))), R, share
    for turn in (200.0, 225.0, 260.0):
        n = (math.cos(math.radians(turn)), math.sin(math.radians(turn)))
        yield beside((dx + 1.0, dy + 1.0), R, n), R, share
    for turn in (10.0, 135.0):
        n = (math.cos(math.radians(turn)), math.sin(math.radians(turn)))
        yield beside((dx + 1.75, dy + 0.5), R + SMALL, n), SMALL, share
        yield beside((dx + 1.25, dy + 0.25), RIM, n), RIM, TOUCHING


def beside(middle: Place, touching: float, n: Place) -> Callable[[float], Place]:
    """Return the places, by their depth (m), beside a circle whose normal there is ``n``."""
    return lambda depth: (
        middle[0] + (touching - depth) * n[0],
        middle[1] + (touching - depth) * n[1],
    )


def cases(scene: Scene, share: float) -> list[Case]:
    """Return places near every border, off the table, and anywhere."""
    (dx, dy), *_ = scene.table.outline if scene.table else ()
    found = []
    for at, size, own in borders(scene, share):
        for more in MORE:
            is_sure = abs(more) >= (1e-9 if dx == 0.0 else 1e-2)
            found.append(Case(at((own + more) * size), more < 0.0 if is_sure else None))
    off = [(-0.01, 0.5), (1.5, 1.5), (1.0 + 1e-13, 1.5), (-9.0, 0.5), (2.5 + R, 0.5), (1.1, 1.001)]
    deep = [(1.25, 0.25), (1.75, 0.5), (0.001, 0.001)]
    found += [Case((dx + x, dy + y), False) for x, y in (*off, *deep)]
    found += [Case((dx + x, dy + y), True) for x, y in (FREE, (2.3, 0.2), (0.9, 2.3))]
    rng = np.random.default_rng(3)
    anywhere = rng.uniform((dx - 0.2, dy - 0.2), (dx + 2.7, dy + 2.7), (150, 2)).tolist()
    return found + [Case((x, y), None) for x, y in anywhere]


def layout(scene: Scene, at: Place) -> np.ndarray[Any, Any]:
    """Return where the balls are (N, 2), with the cue ball at a place."""
    return np.array([*(ball.position for ball in scene.balls[:-1]), at])


def accepted(attempt: Callable[[], object]) -> bool:
    """Tell whether a place is taken; what is refused is said in a line for each problem."""
    try:
        attempt()
    except ValueError as error:
        assert "position" in str(error)
        return False
    return True


# -- who can be asked ------------------------------------------------------------------------------


def by_scene(scene: Scene, at: Place) -> bool:
    moved = replace(scene.balls[-1], position=at)
    return accepted(lambda: replace(scene, balls=(*scene.balls[:-1], moved)))


def by_file(scene: Scene, at: Place) -> bool:
    text, (x, y) = scene.to_toml(), scene.balls[-1].position
    written = f"position = [{x}, {y}]"
    assert text.count(written) == 1
    return accepted(lambda: loads(text.replace(written, f"position = [{at[0]!r}, {at[1]!r}]")))


def by_live_table(scene: Scene, at: Place) -> bool:
    resting = np.zeros((len(scene.balls), 2)).tolist()
    asked = {"position": layout(scene, at).tolist(), "velocity": resting, "ball": "C"}
    return Answers(scene).to("place", json.dumps(asked).encode()).status == 200


def by_few(scene: Scene, at: Place) -> bool:
    return bool(may_lie(scene, [layout(scene, at)]).all())


def by_layouts(scene: Scene, at: Place) -> bool:
    """Ask what draws random layouts, on a table without pockets."""
    return fits(Layouts(replace(scene, pockets=())), layout(scene, at))


def fits(drawn: Layouts, places: np.ndarray[Any, Any]) -> bool:
    """Tell whether the last ball may lie at its place of a layout (N, 2)."""
    for spot, place in zip(drawn.spots, places, strict=True):
        spot.put(place.tobytes(), 0)
    return layouts.is_free(drawn.floor, drawn.spots, len(places) - 1, TOUCHING)


def table_of(scene: Scene, by_shapes: bool = False) -> Billiards:
    table = Billiards(pymunk.Space(), 1 / 60, pair=same_balls(0.9, 0.0))
    assert scene.table is not None
    static = table.space.static_body
    for wall, edge in zip(scene.table.walls, scene.table.edges, strict=True):
        shape = pymunk.Segment(static, edge.start, edge.end, 0.0)
        own: Any = None if by_shapes else wall.sides
        table.add_wall(shape, 0.8, sides=own)
    for hole in scene.pockets:
        table.add_pocket(hole.position, hole.radius)
    for ball in scene.balls[:-1]:
        put(table, ball.position, ball.radius)
    return table


def put(table: Billiards, at: Place, radius: float) -> Any:
    """Add a ball to a table."""
    body = pymunk.Body(0.2, math.inf)
    body.position = at
    return table.add_ball(pymunk.Circle(body, radius))


def by_add_ball(scene: Scene, at: Place) -> bool:
    return accepted(lambda: put(table_of(scene), at, R))


def by_place(scene: Scene, at: Place) -> bool:
    table = table_of(scene)
    ball = put(table, scene.balls[-1].position, R)
    return accepted(lambda: table.place(ball, at))


def by_free_spot(scene: Scene, at: Place) -> bool:
    return table_of(scene).free_spot(at, R) == at


def by_state(scene: Scene, at: Place) -> bool:
    places = layout(scene, at)
    return accepted(lambda: scene.state((places, np.zeros_like(places))))


def by_simulate(scene: Scene, at: Place) -> bool:
    places = layout(scene, at)
    start = (places, np.zeros_like(places))
    return accepted(lambda: simulate(scene, solver="event-driven", start=start))


def by_environment(scene: Scene, at: Place) -> bool:
    game = Carom(scene, layout="scenario")
    return accepted(
        lambda: game.start(Generators([np.random.default_rng()]), {"position": layout(scene, at)})
    )


# Billiards knows no outline, so that it is not asked about places off the table.
ON_TABLE = {by_add_ball, by_place, by_free_spot}


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize(
    "ask", [by_file, by_live_table, by_few, by_layouts, by_add_ball, by_place, by_free_spot],
)  # fmt: skip
def test_a_ball_may_lie_where_a_scene_lets_it_lie(
    ask: Callable[[Scene, Place], bool], offset: Place
) -> None:
    scene = scene_at(*offset)
    if ask is by_layouts:
        scene = replace(scene, pockets=())
    table = scene.table
    assert table is not None
    for at, is_free in cases(scene, TOUCHING):
        answer = by_scene(scene, at)
        assert is_free in (None, answer) or ask is by_layouts, at
        if ask not in ON_TABLE or table.contains(*at):
            assert ask(scene, at) == answer, at


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("ask", [by_simulate, by_environment])
def test_a_run_may_start_where_a_state_may_lie(
    ask: Callable[[Scene, Place], bool], offset: Place
) -> None:
    scene = scene_at(*offset)
    for at, is_free in cases(scene, SUNK):
        answer = by_state(scene, at)
        assert is_free in (None, answer), at
        assert ask(scene, at) == answer, at


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize(("share", "ask"), [(TOUCHING, by_scene), (SUNK, by_state)])
def test_arrays_have_the_answers_of_numbers(
    share: float, ask: Callable[[Scene, Place], bool], offset: Place
) -> None:
    scene = scene_at(*offset)
    tried = [case.place for case in cases(scene, share)]
    many = np.array([layout(scene, at) for at in tried])
    wanted = [ask(scene, at) for at in tried]
    assert may_lie(scene, many, share).all(axis=1).tolist() == wanted
    if share == SUNK:
        batch = simulate_many(scene, many, np.zeros_like(many))
        assert (batch.status != CANNOT_START).tolist() == wanted


def test_shapes_of_pymunk_have_the_same_borders() -> None:
    """pymunk works a distance out by itself, so the last digits may differ."""
    scene = scene_at(0.0, 0.0)
    table = table_of(scene, by_shapes=True)
    ball = put(table, FREE, R)
    assert scene.table is not None
    for at, is_free in cases(scene, TOUCHING):
        if is_free is not None and scene.table.contains(*at):
            assert accepted(partial(table.place, ball, at)) == is_free, at


def test_a_ball_that_touches_the_rim_plays_compiled_as_it_does_in_python() -> None:
    scene = scene_at(0.0, 0.0)
    rng = np.random.default_rng(5)
    turn, far = rng.uniform(0.0, math.tau, 40), RIM * (1.0 - rng.uniform(0.0, TOUCHING, 40))
    places = np.stack([1.25 + far * np.cos(turn), 0.25 + far * np.sin(turn)], axis=-1)
    position = np.array([layout(scene, at) for at in places])
    velocity = np.zeros_like(position)
    velocity[10:, -1] = rng.normal(0.0, 0.5, (30, 2))
    batch = simulate_many(scene, position, velocity)
    for k in range(40):
        run = batch.run(k)
        np.testing.assert_array_equal(batch.final[k], np.array(run.end.position))
        assert (batch.pocketed[k, -1] >= 0) == ("C" in run.pocketed)


def test_layouts_keep_balls_off_pockets() -> None:
    scene = scene_at(0.0, 0.0)
    drawn = Layouts(scene)
    for far, free in ((RIM + R - 0.001, False), (RIM + R + 0.001, True)):
        at = (1.25 - far, 0.25)
        assert fits(drawn, layout(scene, at)) == free


def test_a_ball_whose_centre_is_within_a_post_lies_in_it() -> None:
    """What is behind a face is not in it; a round side is solid as far as its centre."""
    corner: Any = RoundSide((1.0, 0.0), 0.5)
    for x in (1.0, 1.1, 1.499):
        assert room_beside([corner], x, 0.0, 0.1) < 0.0
    face = scene_at(0.0, 0.0).table
    assert face is not None
    assert room_beside(face.walls[0].sides, 0.5, -0.2, R) == math.inf
    table = Billiards(pymunk.Space(), 1 / 60, pair=same_balls(0.9, 0.0))
    shape = pymunk.Circle(table.space.static_body, 0.5, (1.0, 0.0))
    table.add_wall(shape, 0.8, sides=(corner,))
    assert not accepted(lambda: put(table, (1.0, 0.0), 0.1))


class Bowl(Side):
    """A side of a new kind: the inside of a circle, all of whose outside is solid."""

    def __init__(self) -> None:
        super().__init__(math.inf)

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from a ball within the circle."""
        return 1.0 - math.sqrt(x * x + y * y) - r

    def normal(self, x: float, y: float) -> Place:
        """Return the unit vector to the middle."""
        far = math.sqrt(x * x + y * y)
        return (-x / far, -y / far)

    def curvature(self, x: float, y: float) -> float:
        """Return how fast the normal turns (1/m); it turns with the ball."""
        return -1.0 / math.sqrt(x * x + y * y)

    def time_of_contact(self, path: Any, r: float, now: float) -> float:
        """Return infinity: nothing moves here."""
        return math.inf


@pytest.mark.parametrize(("x", "is_free"), [(0.0, True), (0.9, True), (0.91, False), (3.0, False)])
def test_a_new_kind_of_side_needs_no_new_rule(x: float, is_free: bool) -> None:
    table = Billiards(pymunk.Space(), 1 / 60, pair=same_balls(0.9, 0.0))
    shape = pymunk.Circle(table.space.static_body, 1.0)
    table.add_wall(shape, 0.8, sides=(Bowl(),))
    assert accepted(lambda: put(table, (x, 0.0), 0.1)) == is_free


def test_two_balls_give_one_answer_in_either_order() -> None:
    rng = np.random.default_rng(11)
    for _ in range(2000):
        x, y, turn = (float(each) for each in rng.uniform(-5.0, 5.0, 3))
        touching = R + SMALL - TOUCHING * SMALL * (1.0 + float(rng.uniform(-1e-9, 1e-9)))
        u, v = x + touching * math.cos(turn), y + touching * math.sin(turn)
        assert overlap((x, y), R, (u, v), SMALL, TOUCHING) == overlap(
            (u, v), SMALL, (x, y), R, TOUCHING
        )


def test_the_words_are_in_the_units_of_the_file() -> None:
    scene = replace(scene_at(0.0, 0.0), units=Units(length="cm"))
    text = scene.to_toml().replace("[62.5, 37.5]", "[62.5, 4.0]")
    with pytest.raises(ValueError, match=r'ball "C" overlaps cushion 0 by 1 cm \(0\.2 radii\)'):
        loads(text)
    text = scene.to_toml().replace("[62.5, 37.5]", "[125, 27.0]")
    with pytest.raises(ValueError, match=r'is within pocket "hole" by 6 cm \(1\.2 radii\)'):
        loads(text)
