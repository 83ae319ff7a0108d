"""Steps of a table by the compiled loop are those of Python: every bit, and every call."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pymunk
import pytest
from press_scenes import AT_A_CUSHION
from scenes import seeds, takes_long
from shots import KINDS, ROLLING, great_crowd, needs_numba, some_scene

from pool_pymunk import Billiards, Law, Restitution, Scene, Table, load, rack
from pool_pymunk.engine import contacts
from pool_pymunk.fast import ahead
from pool_pymunk.fast.live import Loop
from pool_pymunk.solvers.pymunk_space import set_up
from pool_pymunk.solvers.record import Settings
from pool_pymunk.world import ContactEvent, TableBall

pytestmark = needs_numba
DT = 1 / 60
Meddle = Callable[[Billiards, int], object]


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> Iterator[Counter[bool]]:
    """Count the calls in which the loop plays, and those that it leaves to the engine."""
    count, play = Counter[bool](), Loop.play

    def counted(loop: Loop, until: float) -> bool:
        done = play(loop, until)
        count[done] += 1
        return done

    monkeypatch.setattr(Loop, "play", counted)
    yield count


def struck(scene: Scene) -> Scene:
    """Return a scene whose first shot begins at once."""
    start = scene.start(scene.shots[0])
    balls = [
        replace(ball, position=place, velocity=velocity)
        for ball, place, velocity in zip(scene.balls, start.position, start.velocity, strict=True)
    ]
    return replace(scene, balls=tuple(balls), shots=())


def story(scene: Scene, steps: int, meddle: Meddle, hears: bool, law: Any = None) -> list[Any]:
    """Return what a table shows after each step, and what its callbacks hear."""
    table, heard = set_up(scene, scene.start(None), Settings(DT, law=law), "joint"), list[Any]()
    if hears:
        table.on_contact = lambda event: heard.append(said(event))
        table.on_stop = lambda ball, t: heard.append((ball.number, t))
        table.on_pocket = lambda ball, k, t: heard.append((ball.number, k, t))
    for k in range(steps):
        meddle(table, k)
        table.step(DT)
        heard.append([(*b.body.position, *b.body.velocity) for b in table.on_table()])
    state = table.save_state()
    return [*heard, state.motions, state.rolls, table.time]


def said(event: ContactEvent) -> Any:
    """Return what an event tells, with the paths before it."""
    paths = [(ball.number, ball.path) for ball in event.balls]
    return (*event[:1], *event[2:], paths)


def check_same(
    scene: Scene, steps: int, meddle: Meddle = lambda *_: None, hears: bool = True, law: Any = None
) -> None:
    """Check that a table has the same story with the loop and without."""
    ahead.compile(scene)
    assert contacts.LOOPS
    mine = story(scene, steps, meddle, hears, law)
    kept, contacts.LOOPS[:] = contacts.LOOPS[:], []
    its = story(scene, steps, meddle, hears, law)
    contacts.LOOPS[:] = kept
    for k, (one, other) in enumerate(zip(mine, its, strict=True)):
        assert is_same(one, other), k


def is_same(one: Any, other: Any) -> bool:
    """Tell whether two parts of a story are the same.

    Python puts a body on its path again where a wait ends, and the loop lets it go on by itself, so
    that what is shown may differ by rounding. Paths, events and states do not.
    """
    if not isinstance(one, list):
        return bool(one == other)
    return bool(np.shape(one) == np.shape(other) and np.allclose(one, other, rtol=0.0, atol=1e-14))


def hit_now_and_then(table: Billiards, step: int) -> None:
    """Strike a ball, put one elsewhere, save and restore, and take one off."""
    rnd = random.Random(step)
    balls = table.on_table()
    if step % 20 == 7:
        table.strike(rnd.choice(balls), (rnd.uniform(-1, 1), rnd.uniform(-1, 1)))
    if step % 50 == 31:
        table.restore_state(table.save_state())
    if step == 90 and len(balls) > 2:
        table.remove_ball(balls[1])
    if step % 40 == 13:
        ball = rnd.choice(balls)
        ball.body.velocity = (0.3, 0.1)


def test_a_table_with_a_bumper_is_left_to_python(played: Counter[bool]) -> None:
    """As long as a wall kicks, the loop plays no step."""
    began = list[int]()

    def put_up(table: Billiards, step: int) -> None:
        if step % 20 == 7:
            table.strike(table.on_table()[0], (1.0, -1.0))
        if step == 20:
            edge = pymunk.Segment(table.space.static_body, (0.0, 0.05), (9.0, 0.05), 0.0)
            table.add_wall(edge, 0.5, 0.1, kick=0.7)
            began.append(played[True])

    scene = some_scene("rectangle", 7)
    ahead.compile(scene)
    story(scene, 80, put_up, hears=True)
    assert began == [played[True]]
    assert began[0] > 0
    assert played[False] > 0


def test_a_wall_that_is_put_up_in_play_is_met_as_in_python() -> None:
    def put_up(table: Billiards, step: int) -> None:
        if step % 20 == 7:
            table.strike(table.on_table()[0], (1.0, -1.0))
        if step == 20:
            edge = pymunk.Segment(table.space.static_body, (0.0, 0.05), (9.0, 0.05), 0.0)
            table.add_wall(edge, 0.5, 0.1)

    check_same(some_scene("rectangle", 7), 60, put_up)


@pytest.mark.parametrize("hears", [True, False])
@pytest.mark.parametrize("kind", ["rectangle", "pockets", "rack", "frozen", "crowd"])
def test_steps_are_those_of_python(kind: str, hears: bool, played: Counter[bool]) -> None:
    for seed in seeds(3):
        check_same(some_scene(kind, seed), 120, hears=hears)
    assert played[True] > 9 * played[False]


@pytest.mark.slow
@pytest.mark.seeded
@pytest.mark.parametrize("kind", [*KINDS, *ROLLING])
def test_steps_of_all_kinds_are_those_of_python(kind: str, played: Counter[bool]) -> None:
    for seed in seeds(6):
        scene = some_scene(kind, seed)
        check_same(scene, 200, hears=seed % 2 == 0)
        check_same(scene, 200, hit_now_and_then)
    assert played[True] > 0


@pytest.mark.slow
def test_a_break_of_balls_that_roll_is_that_of_python(played: Counter[bool]) -> None:
    scene = struck(load("eight-ball"))
    check_same(scene, 500)
    check_same(scene, 300, hit_now_and_then)
    assert set(played) == {True}


def test_changes_between_steps_are_followed(played: Counter[bool]) -> None:
    scene = replace(some_scene("rectangle", 1), restitution=Restitution(0.8, cushion=0.7))
    check_same(scene, 240, hit_now_and_then)
    assert played[True] > played[False]


def test_a_persistent_contact_is_heard_when_it_is_over(played: Counter[bool]) -> None:
    scene = Scene(
        AT_A_CUSHION.balls, AT_A_CUSHION.table, Restitution(0.3, cushion=0.2),
        replace(AT_A_CUSHION.friction, rolling=None),
    )  # fmt: skip
    check_same(scene, 120)
    assert played[True] > 0


@pytest.mark.parametrize("least", [0.1, 1.0])
def test_hits_that_nobody_hears_change_nothing(least: float, played: Counter[bool]) -> None:
    def hear_less(table: Billiards, step: int) -> None:
        table.least_closing = least

    for seed in seeds(3):
        check_same(some_scene("crowd", seed), 120, hear_less)
        check_same(some_scene("pockets", seed), 120, hear_less)
    assert played[True] > 9 * played[False]


def test_the_loop_waits_for_nobody_who_hears_of_pockets_alone() -> None:
    """It tells what has happened once a step, and not at each hit."""
    scene, heard = some_scene("rack", 1), {}
    ahead.compile(scene)
    for name in ("on_contact", "on_pocket"):
        table = set_up(scene, scene.start(None), Settings(DT), "joint")
        setattr(table, name, lambda *_: None)
        heard[name] = 0
        tell = table.engine.recorder.tell_all  # type: ignore[attr-defined]

        def counted(name: str = name, tell: Callable[[], object] = tell) -> None:
            heard[name] += 1
            tell()

        table.engine.recorder.tell_all = counted  # type: ignore[attr-defined]
        for _ in range(60):
            table.step(DT)
    assert heard["on_pocket"] == 0 < heard["on_contact"]


def test_another_cloth_is_that_of_python(played: Counter[bool]) -> None:
    def sweep(table: Billiards, step: int) -> None:
        if step % 20 == 11:
            table.deceleration *= 0.9
        if step == 60:
            table.place(table.balls[0], table.free_spot((0.5, 0.5), ball=table.balls[0]))

    for seed in seeds(3):
        check_same(some_scene("rectangle", seed), 120, sweep)
    assert played[True] > played[False]


def test_a_callback_may_change_what_follows(played: Counter[bool]) -> None:
    scene = struck(load("report"))

    def turn(table: Billiards, step: int) -> None:
        def push(event: ContactEvent) -> None:
            ball: TableBall = event.balls[0]
            table.strike(ball, (0.5, -0.25))

        if step == 0:
            table.on_contact = push

    check_same(scene, 120, turn, hears=False)
    assert played[True] > 0


def test_what_the_loop_has_no_room_for_is_played_by_the_engine(played: Counter[bool]) -> None:
    cue = load("report").balls[0]
    balls = rack((0.6, 0.5), radius=0.02, mass=0.2, rows=9)
    scene = Scene(
        (replace(cue, position=(0.2, 0.5), radius=0.02, velocity=(3.0, 0.0)), *balls),
        Table.rectangle(1.5, 1.0), Restitution(0.9, cushion=0.7), load("report").friction,
    )  # fmt: skip
    check_same(scene, 30)
    assert played[False] > 0 < played[True]


@takes_long
@pytest.mark.slow
def test_a_great_crowd_is_that_of_python(played: Counter[bool]) -> None:
    check_same(great_crowd(130, rolls=True), 40)
    assert played[True] > 0 == played[False]


def test_laws_of_ones_own_are_played_by_the_engine(played: Counter[bool]) -> None:
    class Own(Law):
        def cushion(self, v: Any, restitution: float, friction: float) -> Any:
            return v._replace(n=-restitution * v.n)

    check_same(struck(load("report")), 60, law=Own())
    assert set(played) == {False}
