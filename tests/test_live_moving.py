"""Steps of a table with walls that move: those of the compiled loop have the bits of Python."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pymunk
import pytest
from moving_scenes import R, Scene
from scenes import SHARE, seeds
from shots import needs_numba, uncompiled
from worlds import ball, fence, plane

from pool_pymunk import Billiards, same_balls
from pool_pymunk.engine import contacts
from pool_pymunk.fast import ahead
from pool_pymunk.fast.live import Loop

pytestmark = [needs_numba, pytest.mark.slow]


@pytest.fixture(autouse=True)
def played(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[bool]]:
    """Load the loops of tables with walls that move; tell whether they have played, each time.

    Where a share of the random scenes is played, nothing is compiled: Python plays the loop.
    """
    found, play = list[bool](), Loop.play

    def noted(loop: Loop, until: float) -> bool:
        found.append(play(loop, until))
        return found[-1]

    monkeypatch.setattr(Loop, "play", noted)
    if SHARE == 1.0:
        ahead.compile(moving=True)
    else:
        contacts.LOOPS.append(partial(Loop, dict.fromkeys(ahead.FORMS, uncompiled())))
    assert contacts.LOOPS
    yield found


def listen(table: Billiards, hears: bool) -> list[Any]:
    """Return a list of what a table's callbacks hear."""
    heard = list[Any]()
    table.on_jam = lambda one, wall, t: heard.append((one.number, wall, t))
    if hears:
        table.on_stop = lambda one, t: heard.append((one.number, t))
        table.on_contact = lambda e: heard.append(
            (e.t, e.wall, e.point, e.normal, e.closing, e.impulse, e.tangential, e.since)
        )
    return heard


def story(seed: int, turns: bool, hears: bool) -> list[Any]:
    """Return the paths of pucks after each step of a random scene, and what was heard."""
    scene = Scene(seed, turns)
    heard, shown = listen(scene.table, hears), list[Any]()
    for k in range(int(1.0 / scene.dt)):
        scene.steer(k)
        scene.table.step() if scene.table.alone else scene.space.step(scene.dt)
        shown.append(([puck.path for puck in scene.pucks], [*heard]))
    return shown


def in_python(monkeypatch: pytest.MonkeyPatch, tell: Any, *how: Any) -> Any:
    """Return a story that Python plays."""
    with monkeypatch.context() as patch:
        patch.setattr(contacts, "LOOPS", [])
        return tell(*how)


@pytest.mark.seeded
@pytest.mark.parametrize("hears", [True, False])
@pytest.mark.parametrize("turns", [True, False])
def test_random_scenes_are_those_of_python(
    turns: bool, hears: bool, played: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    for seed in seeds(12 if SHARE == 1.0 else 2):
        mine = story(seed, turns, hears)
        assert mine == in_python(monkeypatch, story, seed, turns, hears), seed
    assert sum(played) > 0


def squeezed(e: float, balls: int, hears: bool) -> list[Any]:
    """Return how a piston presses balls to a wall until they are jammed, and goes back."""
    space, table = plane(pair=same_balls(e, 0.0), deceleration=0.0)
    fence(table, [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)], 0.0, e, 0.0)
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    body.position, body.velocity = (1.5, 0.5), (0.5, 0.0)
    table.add_wall(pymunk.Segment(body, (0.0, -0.495), (0.0, 0.495), 0.0), e)
    pucks = [ball(table, 2.0 - R - (2 * R + 1e-6) * k, 0.5) for k in range(balls)]
    heard, shown = listen(table, hears), list[Any]()
    for k in range(120):
        body.velocity = (0.5 if k < 60 else -0.5, 0.0)
        space.step(1 / 60)
        shown.append(([puck.path for puck in pucks], [*heard]))
    assert any(len(each) == 3 for each in heard)
    return shown


@pytest.mark.parametrize("hears", [True, False])
@pytest.mark.parametrize("balls", [1, 3])
@pytest.mark.parametrize("e", [0.0, 0.9, 1.0])
def test_jams_are_those_of_python(
    e: float, balls: int, hears: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = squeezed(e, balls, hears)
    assert mine == in_python(monkeypatch, squeezed, e, balls, hears)


def pushed(removes: bool) -> list[Any]:
    """Return how a wall pushes a ball on that friction presses to it."""
    space, table = plane(pair=same_balls(0.5, 0.0), deceleration=2.0)
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    body.velocity = (0.4, 0.0)
    table.add_wall(pymunk.Segment(body, (0.0, -1.0), (0.0, 1.0), 0.0), 0.5)
    one, heard, shown = ball(table, R + 0.02), listen(table, True), list[Any]()
    for k in range(120):
        body.velocity = (0.4 if k < 60 else 0.3, 0.0)
        space.step(1 / 60)
        shown.append((one.path, [*heard], table.save_state().motions))
        if removes and k == 50:
            table.remove_ball(one)
    return shown


@pytest.mark.parametrize("removes", [True, False])
def test_a_wall_pushes_a_ball_on_as_in_python(
    removes: bool, monkeypatch: pytest.MonkeyPatch, played: list[bool]
) -> None:
    assert pushed(removes) == in_python(monkeypatch, pushed, removes)
    assert np.mean(played) > 0.9


def filtered() -> list[Any]:
    """Return how a ball goes through walls whose filters let it."""
    space, table = plane(deceleration=0.0)
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    body.position = (0.5, 0.0)
    moves = pymunk.Segment(body, (0.0, -1.0), (0.0, 1.0), 0.0)
    stands = pymunk.Segment(space.static_body, (0.8, -1.0), (0.8, 1.0), 0.0)
    one, shown = ball(table, 0.0), list[Any]()
    table.remove_ball(one)
    its = pymunk.Body(0.17, 1e-4)
    its.velocity, circle = (1.0, 0.0), pymunk.Circle(its, R)
    for shape in (moves, stands, circle):
        shape.filter = pymunk.ShapeFilter(group=1)
    table.add_wall(moves, 1.0)
    table.add_wall(stands, 1.0)
    other = table.add_ball(circle)
    for _ in range(90):
        space.step(1 / 60)
        shown.append(other.path)
    return shown


def test_filters_hold_as_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    found = filtered()
    assert found == in_python(monkeypatch, filtered)
    assert found[-1].vx == 1.0
