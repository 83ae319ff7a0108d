"""Every change of a table may be made from every callback, or is refused in one sentence.

What a callback changes counts from the instant on of which it tells. So the run must end as one in
which a step ends at that instant, and the same change is made between two steps.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards, same_balls
from pool_pymunk.world import TableBall
from tests.shared import worlds
from tests.shared.scenes import lines_run
from tests.shared.worlds import A, M, R

STEP = 1 / 20  # s; in so long a step much happens after a callback
LAST = 2.0  # s; until then a run is compared with another one
PLACES = {"cue": (-0.4, 0.0), "hit": (0.0, 0.01), "still": (0.1, 0.4), "lazy": (-0.3, -0.4),
          "runner": (0.5, -0.5)}  # fmt: skip
VELOCITY = {"cue": (1.4, 0.0), "lazy": (0.11, 0.02), "runner": (-0.8, 0.55)}


class World:
    """A table on which a ball hits another one into a pocket, one stops, and one runs on."""

    def __init__(self) -> None:
        self.space, self.table = worlds.plane(max_dt=STEP)
        corners = [(-0.8, -0.8), (0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)]
        self.walls = worlds.fence(self.table, corners, 0.0, 0.8, 0.1)
        self.balls = {name: self.new_ball(at) for name, at in PLACES.items()}
        self.table.add_pocket((0.3, 0.1), 0.05)
        self.heard: list[tuple[Any, ...]] = []
        for name, velocity in VELOCITY.items():
            self.table.strike(self.balls[name], velocity)
        self.listen({})

    def new_ball(
        self, at: tuple[float, float], velocity: tuple[float, float] = (0, 0)
    ) -> TableBall:
        return worlds.ball(self.table, *at, velocity)

    def listen(self, acts: dict[str, Callable[[], object]]) -> None:
        """Write down what is heard, and at the first event of a kind act on it."""

        def hear(kind: str, *said: Any) -> None:
            self.heard.append((kind, *said))
            if kind in acts:
                acts.pop(kind)()

        table = self.table
        table.on_contact = lambda c: hear("contact", *[b.number for b in c.balls], c.wall, c.t)
        table.on_stop = lambda ball, t: hear("stop", ball.number, t)
        table.on_pocket = lambda ball, pocket, t: hear("pocket", ball.number, pocket, t)

    def step(self, dt: float = STEP) -> None:
        self.space.step(dt)

    def play(self, until: float) -> None:
        """Step until this time (s), and a hair beyond if rounding wants it."""
        while self.table.time < until:
            self.step(min(STEP, max(until - self.table.time, 1e-13)))

    def check(self) -> None:
        """No ball overlaps another one, and each is where its path is."""
        motions = list(self.table.save_state().motions.values())
        for k, one in enumerate(motions):
            assert all(math.dist(one[:2], other[:2]) > 2 * R - 1e-9 for other in motions[:k])
        for ball in self.table.on_table:
            place, _ = ball.path.at(self.table.time)
            assert math.dist(ball.body.position, place) < 1e-12


def take_out(world: World, name: str) -> None:
    world.space.remove(world.balls[name].circle, world.balls[name].body)


def put_by_hand(world: World, name: str) -> None:
    world.balls[name].body.position = 0.55, -0.1


def sent_by_hand(world: World, name: str) -> None:
    world.balls[name].body.velocity = -0.5, 0.7


def fence(world: World) -> None:
    """Put a wall close before the ball that runs, so that it is met in this step."""
    (x, y), (vx, vy) = world.balls["runner"].path.at(now(world))
    far = 1.2 * R / math.hypot(vx, vy)
    middle, across = (x + far * vx, y + far * vy), (-vy, vx)
    a, b = ((middle[0] + s * across[0], middle[1] + s * across[1]) for s in (-0.1, 0.1))
    world.table.add_wall(pymunk.Segment(world.space.static_body, a, b, 0.0), 0.7, 0.1)


def hole(world: World) -> None:
    """Make a pocket close before the ball that runs."""
    (x, y), (vx, vy) = world.balls["runner"].path.at(now(world))
    far = 0.055 / math.hypot(vx, vy)
    world.table.add_pocket((x + far * vx, y + far * vy), 0.05)


def in_the_way(world: World, velocity: tuple[float, float] = (0.0, 0.0)) -> None:
    """Add a ball close before the ball that runs."""
    (x, y), (vx, vy) = world.balls["runner"].path.at(now(world))
    far = 2.1 * R / math.hypot(vx, vy)
    world.new_ball((x + far * vx, y + far * vy), velocity)


def exchange(world: World) -> None:
    """Two balls change places; each step needs the one before."""
    spot = world.balls["lazy"].path.at(now(world))[0]
    world.table.place(world.balls["lazy"], (0.7, -0.7))
    world.table.place(world.balls["still"], spot)
    world.table.remove_ball(world.balls["lazy"])
    world.new_ball((0.7, -0.7), (0.0, 0.4))


def all_round(world: World) -> None:
    """Take a wall away, put another one up, and take a ball for a new one."""
    world.table.remove_wall(world.walls[2])
    wall = pymunk.Segment(world.space.static_body, (-0.8, 0.6), (0.8, 0.6), 0.0)
    world.table.add_wall(wall, 0.5)
    world.table.remove_ball(world.balls["runner"])
    world.table.add_ball(world.balls["runner"].circle)


def make_heavy(world: World, name: str) -> None:
    world.balls[name].body.mass = 0.2
    world.table.strike(world.balls[name], (1.0, 0.0))


def now(world: World) -> float:
    return world.table.save_state().time


Change = Callable[[World], object]
CHANGES: dict[str, Change] = {
    "nothing": lambda world: None,
    "strike a ball at rest": lambda w: w.table.strike(w.balls["still"], (0.3, -0.9)),
    "strike a ball that runs": lambda w: w.table.strike(w.balls["runner"], (0.3, 0.9)),
    "strike the cue": lambda w: w.table.strike(w.balls["cue"], (-0.4, -0.9)),
    "stop a ball": lambda w: w.table.strike(w.balls["runner"], (0.0, 0.0)),
    "place": lambda w: w.table.place(w.balls["still"], (-0.6, 0.6)),
    "place one that runs": lambda w: w.table.place(w.balls["runner"], (-0.6, 0.6)),
    "exchange": exchange,
    "add": lambda w: w.new_ball((-0.6, 0.6)),
    "add one that runs": lambda w: w.new_ball((-0.6, 0.6), (0.5, -0.8)),
    "add on the line": in_the_way,
    "add one that runs on the line": lambda w: in_the_way(w, (0.2, 0.3)),
    "remove": lambda w: w.table.remove_ball(w.balls["still"]),
    "remove the cue": lambda w: w.table.remove_ball(w.balls["cue"]),
    "remove one that runs": lambda w: w.table.remove_ball(w.balls["runner"]),
    "clear": lambda w: w.table.clear(),
    "add_wall": fence,
    "remove_wall": lambda w: w.table.remove_wall(w.walls[0]),
    "add_pocket": hole,
    "walls and balls": all_round,
    "free_spot": lambda w: w.new_ball(w.table.free_spot(PLACES["lazy"], R)),
    "predict": lambda w: w.table.predict(w.balls["still"], (0.2, -0.9)),
    "save_state": lambda w: w.table.save_state(),
}
# These follow what is done to a body, so others must be in the space.
BY_HAND: dict[str, Change] = {
    "put elsewhere by hand": lambda w: put_by_hand(w, "still"),
    "put elsewhere by hand while it runs": lambda w: put_by_hand(w, "runner"),
    "sent off by hand": lambda w: sent_by_hand(w, "still"),
    "sent off by hand while it runs": lambda w: sent_by_hand(w, "runner"),
    "taken out of the space": lambda w: take_out(w, "still"),
    "taken out of the space while it runs": lambda w: take_out(w, "runner"),
}
REFUSED: dict[str, tuple[Change, str]] = {
    "restore_state": (
        lambda w: w.table.restore_state(w.table.save_state()),
        "restore_state = in a step: wait until the present step is over",
    ),
    "step": (lambda w: w.step(), "wait until the present step is over"),
    "play": (lambda w: w.table.play(), "play = in a step: wait until the present step is over"),
    "mass": (
        lambda w: make_heavy(w, "still"),
        "ball 2: mass = 0.2: it was 0.17 when the ball came to the table",
    ),
    "place in another": (
        lambda w: w.table.place(w.balls["still"], w.balls["runner"].path.at(now(w))[0]),
        "the ball overlaps ball ",
    ),
    "a ball twice": (
        lambda w: w.table.add_ball(pymunk.Circle(w.balls["still"].body, R)),
        "is a ball already",
    ),
    "no wall": (lambda w: w.table.remove_wall(99), "wall = 99: there is no wall of this number"),
}
KINDS = ("contact", "stop", "pocket")
every_callback = pytest.mark.parametrize("kind", KINDS)


def first_times() -> dict[str, float]:
    """The time (s) of the first event of each kind."""
    world = World()
    world.play(LAST)
    return {event[0]: event[-1] for event in reversed(world.heard)}


FIRST = first_times()


def changed_from(kind: str, change: Change) -> World:
    world = World()
    world.listen({kind: lambda: change(world)})
    world.play(LAST)
    return world


def changed_between(kind: str, change: Change) -> World:
    world = World()
    world.play(FIRST[kind])
    change(world)
    world.play(LAST)
    return world


def alike(one: World, other: World) -> None:
    """Compare all balls' motions, and all that was heard."""
    motions = [world.table.save_state().motions for world in (one, other)]
    assert motions[0].keys() == motions[1].keys()
    for number, motion in motions[0].items():
        assert motion == pytest.approx(motions[1][number], abs=1e-9)
    assert len(one.heard) == len(other.heard)
    for event, same in zip(one.heard, other.heard, strict=True):
        assert event[:-1] == same[:-1]
        assert event[-1] == pytest.approx(same[-1], abs=1e-9)


@pytest.mark.parametrize("what", [*CHANGES, *BY_HAND])
@every_callback
def test_a_change_from_a_callback_is_one_between_two_steps(what: str, kind: str) -> None:
    change = (CHANGES | BY_HAND)[what]
    world = changed_from(kind, change)
    world.check()
    alike(world, changed_between(kind, change))


@every_callback
@pytest.mark.parametrize("what", REFUSED)
def test_what_a_callback_may_not_do_is_refused_and_nothing_is_lost(what: str, kind: str) -> None:
    change, line = REFUSED[what]
    errors: list[Exception] = []

    def attempt(world: World) -> None:
        try:
            change(world)
        except ValueError as error:
            errors.append(error)
        world.balls["still"].body.mass = M

    world = changed_from(kind, attempt)
    assert [line in str(error) for error in errors] == [True]
    assert "\n" not in str(errors[0])
    world.check()
    if what != "mass":
        alike(world, changed_between(kind, CHANGES["nothing"]))


@every_callback
def test_an_error_of_a_callback_comes_out_of_the_step(kind: str) -> None:
    world = World()
    world.listen({kind: lambda: world.table.remove_wall(99)})
    with pytest.raises(ValueError, match=r"^wall = 99: there is no wall of this number$"):
        world.play(LAST)
    world.play(LAST)
    alike(world, changed_between(kind, CHANGES["nothing"]))


def test_a_ball_that_was_pocketed_in_this_step_is_off_the_table() -> None:
    """Another ball stops in the same step, and then somebody strikes the one in the pocket."""
    world = World()
    table, cue = world.table, world.balls["cue"]
    table.clear()
    table.add_pocket((0.0, 0.0), 0.1)
    cue = world.new_ball((-0.1 - 0.02, 0.0), (1.0, 0.0))
    slow = world.new_ball((0.5, 0.5), (0.6 * STEP * A, 0.0))
    said: list[str] = []

    def again(_ball: TableBall, _t: float) -> None:
        assert not cue.is_on_table
        changes: tuple[Callable[[], object], ...] = (
            lambda: table.strike(cue, (1.0, 0.0)),
            lambda: table.predict(cue, (1.0, 0.0)),
            lambda: table.remove_ball(cue),
        )
        for change in changes:
            with pytest.raises(ValueError, match="the ball is off the table") as error:
                change()
            said.append(str(error.value))
        cue.body.position = 0.3, 0.3
        table.add_ball(cue.circle)

    table.on_stop = again
    world.step()
    assert len(said) == 3
    assert slow.path.end < STEP
    assert [ball.body for ball in table.on_table] == [slow.body, cue.body]


@every_callback
def test_a_state_saved_in_a_callback_goes_on_as_the_table_did(kind: str) -> None:
    saved: list[Any] = []
    world = changed_from(kind, lambda world: saved.append(world.table.save_state()))
    ends = world.table.save_state().motions
    [state] = saved
    assert state.time == pytest.approx(FIRST[kind], abs=1e-12)
    world.table.restore_state(state)
    world.play(LAST)
    again = world.table.save_state().motions
    assert again.keys() == ends.keys()
    for number, motion in again.items():
        assert motion == pytest.approx(ends[number], abs=1e-9)


@pytest.mark.parametrize("what", ["strike", "place", "add", "wall", "pocket"])
def test_the_pair_function_changes_nothing(what: str) -> None:
    """While a contact is answered nobody may touch the table; the error comes out."""
    space = pymunk.Space()
    table = Billiards(space, STEP, pair=lambda i, j: pair(i, j), deceleration=A)
    acts: list[Callable[[], object]] = []

    def pair(i: int, j: int) -> Any:
        for act in acts:
            act()
        return same_balls(0.9, 0.0)(i, j)

    balls = []
    for x in (0.0, 0.2, 0.9):
        body = pymunk.Body(M, 1e-4)
        body.position = x, 0.0
        balls.append(table.add_ball(pymunk.Circle(body, R)))
    body = pymunk.Body(M, 1e-4)
    body.position = 0.0, 0.7
    changes: dict[str, Callable[[], object]] = {
        "strike": lambda: table.strike(balls[2], (1.0, 0.0)),
        "place": lambda: table.place(balls[2], (0.9, 0.9)),
        "add": lambda: table.add_ball(pymunk.Circle(body, R)),
        "wall": lambda: table.add_wall(pymunk.Segment(space.static_body, (0, 2), (2, 2), 0), 0.5),
        "pocket": lambda: table.add_pocket((3.0, 0.0), 0.1),
    }
    table.strike(balls[0], (1.0, 0.0))
    acts.append(changes[what])
    with pytest.raises(ValueError, match="cannot be used while a contact is answered"):
        for _ in range(20):
            space.step(STEP)
    acts.clear()
    for _ in range(200):
        space.step(STEP)
    assert balls[1].body.position.x > 0.6 > balls[0].body.position.x


@pytest.mark.parametrize("what", ["strike", "remove", "place", "add"])
def test_a_handler_of_pymunk_may_strike_and_remove(what: str) -> None:
    """While pymunk steps the space, it is closed to new things."""
    space = pymunk.Space()
    table = Billiards(space, STEP, pair=same_balls(0.9, 0.0), deceleration=A)
    body, new = pymunk.Body(M, 1e-4), pymunk.Body(M, 1e-4)
    ball, new.position = table.add_ball(pymunk.Circle(body, R)), (0.0, 1.0)
    gate = pymunk.Segment(space.static_body, (0.4, -1.0), (0.4, 1.0), 0.01)
    gate.sensor, gate.collision_type = True, 7
    space.add(gate)
    changes: dict[str, Callable[[], object]] = {
        "strike": lambda: table.strike(ball, (-1.0, 0.0)),
        "remove": lambda: table.remove_ball(ball),
        "place": lambda: table.place(ball, (0.0, 0.5)),
        "add": lambda: table.add_ball(pymunk.Circle(new, R)),
    }
    count = [0]

    def act(*_: object) -> None:
        count[0] += 1
        if count[0] == 1:
            with contextlib.suppress(ValueError):
                changes[what]()

    space.on_collision(7, None, begin=act)
    table.strike(ball, (1.0, 0.0))
    if what in ("place", "add"):
        with pytest.raises(ValueError, match=r"^space = locked: pymunk is stepping the space"):
            for _ in range(200):
                space.step(STEP)
    for _ in range(200):
        space.step(STEP)
    assert count[0] >= 1
    assert ball.is_on_table == (what != "remove")
    if what == "strike":
        assert ball.body.position.x < -1.0
    elif what in ("place", "add"):
        assert ball.body.position.x == pytest.approx(1.0 / (2 * A), abs=1e-12)


def test_a_handler_of_pymunk_may_take_a_ball_out_on_which_forces_act() -> None:
    """pymunk takes it out as the step ends, before the table answers the step."""
    space = pymunk.Space()
    space.gravity = 0.5, 0.0
    table = Billiards(space, STEP, pair=same_balls(0.9, 0.0), deceleration=A)
    body, other = pymunk.Body(M, 1e-4), pymunk.Body(M, 1e-4)
    ball, other.position = table.add_ball(pymunk.Circle(body, R)), (0.0, 1.0)
    stays = table.add_ball(pymunk.Circle(other, R))
    gate = pymunk.Segment(space.static_body, (0.4, -0.5), (0.4, 0.5), 0.01)
    gate.sensor, gate.collision_type = True, 7
    space.add(gate)
    space.on_collision(7, None, begin=lambda *_: space.remove(ball.circle, body))
    for _ in range(100):
        space.step(STEP)
    assert table.on_table == [stays]
    assert stays.body.position.x == pytest.approx(0.5 * (0.5 - A) * 5.0**2, rel=0.02)


def test_a_callback_costs_the_same_however_many_balls_lie_around() -> None:
    def lines(count: int, hears: bool) -> int:
        space = pymunk.Space()
        table = Billiards(space, STEP, pair=same_balls(0.9, 0.0), deceleration=A)
        for k in range(count):
            body = pymunk.Body(M, 1e-4)
            body.position = 0.2 * k, 0.0
            table.add_ball(pymunk.Circle(body, R))
        if hears:
            table.on_contact, table.on_stop = (lambda _contact: None), (lambda _ball, _t: None)
        table.strike(table.balls[0], (1.0, 0.0))

        def play() -> None:
            for _ in range(40):
                space.step(STEP)

        play()
        table.strike(table.balls[0], (-1.0, 0.0))
        table.strike(table.balls[2], (-1.0, 0.0))
        return lines_run(play)

    few, many = (lines(count, True) - lines(count, False) for count in (20, 80))
    assert 0 < many < 1.1 * few
