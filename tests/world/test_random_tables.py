"""Random calls from everywhere: between steps, from callbacks, and from a handler of pymunk.

Whatever is called, in whatever order, balls never overlap, stops are reported once, nothing grows
without bound, and a table that is set up anew from a saved state goes on alike.
"""

from __future__ import annotations

import math
import random
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards, same_balls
from pool_pymunk.world import TableBall, TableState
from pool_pymunk.world.table import Phase

R, M, A = 0.03, 0.17, 0.4
LONGEST = 1 / 20  # s; the longest step
SIZE = 0.9  # m; half of the table's length
MOST = 9  # balls
PAIR = same_balls(0.9, 0.05)
OVERLAP = 1e-7 * R  # In persistent contact the paths of balls overlap by 1e-8 radii.


class RandomTable:
    """A table on which everything may happen at any time."""

    def __init__(self, seed: int) -> None:
        self.rnd = random.Random(seed)
        self.space = pymunk.Space()
        self.table = Billiards(self.space, LONGEST, pair=PAIR, deceleration=A)
        self.ends: dict[int, tuple[Any, Any]] = {}  # where each wall is that still stands
        self.holes: list[tuple[tuple[float, float], float]] = []
        corners = [(-SIZE, -SIZE), (SIZE, -SIZE), (SIZE, SIZE), (-SIZE, SIZE)]
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            self.wall(a, b)
        self.stops: list[tuple[int, float]] = []  # each stop
        self.at_rest_by_hand: set[int] = set()
        self.depth = 0
        table = self.table
        table.on_contact = lambda _contact: self.heard()
        table.on_stop = self.stopped
        table.on_pocket = lambda _ball, _pocket, _t: self.heard()
        self.guest = pymunk.Segment(self.space.static_body, (-0.2, -0.9), (0.1, 0.9), 0.0)
        self.guest.sensor, self.guest.collision_type = True, 5
        self.space.add(self.guest)
        self.space.on_collision(5, None, begin=self.felt)
        self.saved: TableState | None = None

    # -- what happens ------------------------------------------------------------------------------

    def stopped(self, ball: TableBall, t: float) -> None:
        self.stops.append((ball.number, t))
        self.heard()

    def heard(self) -> None:
        if self.depth < 40 and self.rnd.random() < 0.3:
            self.depth += 1
            self.do(self.rnd.choice(FROM_CALLBACKS))

    def felt(self, arbiter: pymunk.Arbiter, *_: object) -> None:
        balls = [self.table.ball_of(shape) for shape in arbiter.shapes]
        for ball in balls:
            if ball is not None and self.rnd.random() < 0.2:
                self.rested(ball)
                if self.rnd.random() < 0.7:
                    self.table.strike(ball, self.velocity())
                else:
                    self.table.remove_ball(ball)

    def do(self, what: str) -> None:
        """Do it; a sentence that refuses it is as good."""
        try:
            getattr(self, what)()
        except ValueError as error:
            assert len(str(error).splitlines()) == 1

    # -- what is called ----------------------------------------------------------------------------

    def wall(self, a: tuple[float, float], b: tuple[float, float]) -> None:
        number = self.table.add_wall(pymunk.Segment(self.space.static_body, a, b, 0.0), 0.8, 0.1)
        self.ends[number] = a, b

    def spot(self) -> tuple[float, float]:
        return self.rnd.uniform(-0.8, 0.8), self.rnd.uniform(-0.8, 0.8)

    def velocity(self) -> tuple[float, float]:
        speed = 10 ** self.rnd.uniform(-6, 0.3)
        angle = self.rnd.uniform(0, math.tau)
        return speed * math.cos(angle), speed * math.sin(angle)

    def some(self) -> TableBall:
        """One of the balls on the table, or now and then one that was there."""
        balls = self.table.on_table if self.rnd.random() < 0.9 else []
        return self.rnd.choice(balls or self.table.balls[-MOST:])

    def rested(self, ball: TableBall) -> None:
        self.at_rest_by_hand.add(ball.number)

    def add(self) -> None:
        if len(self.table.on_table) < MOST:
            body = pymunk.Body(M, 1e-4)
            body.position = self.spot()
            body.velocity = self.velocity() if self.rnd.random() < 0.5 else (0.0, 0.0)
            self.table.add_ball(pymunk.Circle(body, R))

    def strike(self) -> None:
        ball = self.some()
        self.table.strike(ball, self.velocity())

    def halt(self) -> None:
        ball = self.some()
        self.table.strike(ball, (0.0, 0.0))
        self.rested(ball)

    def place(self) -> None:
        ball = self.some()
        self.table.place(ball, self.spot())
        self.rested(ball)

    def remove(self) -> None:
        self.table.remove_ball(self.some())

    def again(self) -> None:
        """Take a ball off, and make a new one of its circle."""
        ball = self.some()
        self.table.remove_ball(ball)
        self.table.add_ball(ball.circle)

    def new_wall(self) -> None:
        """Put up a wall where it touches no ball."""
        (x, y), state = self.spot(), self.table.save_state()
        if all(math.dist((x, y), motion[:2]) > 0.11 for motion in state.motions.values()):
            self.wall((x - 0.05, y), (x + 0.05, y + 0.05))

    def old_wall(self) -> None:
        number = self.rnd.choice([*self.ends, 99_999])
        if number > 3:
            self.table.remove_wall(number)
            del self.ends[number]

    def hole(self) -> None:
        at = self.spot()
        if len(self.holes) < 3 and max(map(abs, at)) < 0.7:
            self.table.add_pocket(at, 0.05)
            self.holes.append((at, 0.05))

    def look(self) -> None:
        self.table.predict(self.some(), self.velocity())
        self.table.free_spot(self.spot(), R)

    def save(self) -> None:
        state, table = self.table.save_state(), self.table
        taken = [(table.balls[i].body, motion[:2]) for i, motion in state.motions.items()]
        assert len({id(body) for body, _ in taken}) == len(taken)

    def by_hand(self) -> None:
        self.some().body.velocity = self.velocity()

    def nudge(self) -> None:
        ball = self.some()
        ball.body.velocity += self.rnd.choice([1e-13, 1e-9, 1e-3]) * pymunk.Vec2d(1, 0)

    def take_out(self) -> None:
        ball = self.some()
        if ball.is_on_table:
            self.space.remove(ball.circle, ball.body)

    def nonsense(self) -> None:
        """Each of these is refused, and changes nothing."""
        table, ball = self.table, self.some()
        wrong: list[Any] = [
            lambda: table.strike(ball, (math.nan, 0.0)),
            lambda: table.place(ball, (3.0 * SIZE, math.inf)),
            lambda: table.place(ball, (SIZE, 0.0)),
            lambda: table.remove_wall(99_999),
            lambda: table.add_pocket((0.0, 0.0), -1.0),
            lambda: table.add_ball(ball.circle) if ball.is_on_table else None,
            lambda: table.restore_state(TableState(0.0, {99_999: (0, 0, 0, 0)})),
        ]
        self.rnd.choice(wrong)()

    def wrong_step(self) -> None:
        self.step(self.rnd.choice([0.051, 1.0, 0.0, -0.01, math.nan]))

    def go(self) -> None:
        self.step(math.exp(self.rnd.uniform(math.log(1e-9), math.log(LONGEST))))

    def run(self) -> None:
        for _ in range(self.rnd.randrange(8)):
            self.step(LONGEST)

    def step(self, dt: float) -> None:
        """Make a step, and look whether each ball that has come to rest in it was reported."""
        table, known = self.table, len(self.stops)
        table.save_state()  # follows what was done by hand
        before = set(table.moving)
        if table.live.phase not in (Phase.PLAYING, Phase.TELLING):
            self.at_rest_by_hand.clear()
        self.space.step(dt)
        rest = {i for i in before - set(table.moving) if table.balls[i].is_on_table}
        assert rest <= {i for i, _ in self.stops[known:]} | self.at_rest_by_hand

    def keep(self) -> None:
        self.saved = self.table.save_state()

    def undo(self) -> None:
        if self.saved is not None:
            self.table.restore_state(self.saved)
            self.stops.clear()

    # -- what must hold ----------------------------------------------------------------------------

    def check(self) -> None:
        table = self.table
        state = table.save_state()
        places = [motion[:2] for motion in state.motions.values()]
        for k, one in enumerate(places):
            assert all(math.dist(one, other) > 2 * R - OVERLAP for other in places[:k])
        assert all(abs(x) < SIZE - 0.99 * R and abs(y) < SIZE - 0.99 * R for x, y in places)
        assert len(set(self.stops)) == len(self.stops)
        assert len(table.engine.queue.line) <= 1001
        assert len(table.engine.table.walls) < 60
        there = {ball.body for ball in table.on_table}
        dynamic = {each for each in self.space.bodies if each.body_type == pymunk.Body.DYNAMIC}
        assert there == dynamic
        shapes = len(there) + len(self.ends) + len(self.holes) + 1
        assert len(self.space.shapes) == shapes

    def anew(self) -> None:
        """A table that is set up from this one's state goes on as this one does, by other steps."""
        state, table = self.table.save_state(), self.table
        space = pymunk.Space()
        other = Billiards(space, LONGEST, pair=PAIR, deceleration=A)
        for a, b in self.ends.values():
            other.add_wall(pymunk.Segment(space.static_body, a, b, 0.0), 0.8, 0.1)
        for x, y, vx, vy in state.motions.values():
            body = pymunk.Body(M, 1e-4)
            body.position, body.velocity = (x, y), (vx, vy)
            other.put_ball(pymunk.Circle(body, R))
        for at, radius in self.holes:
            other.add_pocket(at, radius)
        heard = table.on_contact, table.on_stop, table.on_pocket
        table.on_contact = table.on_stop = table.on_pocket = None
        self.guest.collision_type = 0
        other.restore_state(TableState(state.time, dict(enumerate(state.motions.values()))))
        while table.time < state.time + 0.3 - 1e-12:
            dt = min(self.rnd.uniform(1e-4, LONGEST), state.time + 0.3 - table.time)
            self.space.step(dt)
        for _ in range(10):
            other.step(0.03)
        ends, twins = table.save_state().motions, other.save_state().motions
        names = list(state.motions)
        assert {names[i] for i in twins} == set(ends)
        for i, motion in twins.items():
            assert motion[:2] == pytest.approx(ends[names[i]][:2], abs=1e-9)
        table.restore_state(state)
        table.on_contact, table.on_stop, table.on_pocket = heard
        self.guest.collision_type = 5
        self.stops.clear()


CHANGES = ["add", "strike", "strike", "halt", "place", "remove", "again", "new_wall", "old_wall",
           "hole", "look", "save", "by_hand", "nudge", "take_out", "nonsense"]  # fmt: skip
FROM_CALLBACKS = [*CHANGES, "wrong_step", "undo"]
BETWEEN_STEPS = [*CHANGES, "add", "add", "wrong_step", "go", "go", "run", "run", "keep", "undo"]


def play(seed: int, calls: int) -> RandomTable:
    world = RandomTable(seed)
    for _ in range(5):
        world.do("add")
    for k in range(calls):
        world.depth = 0
        world.do(world.rnd.choice(BETWEEN_STEPS))
        world.check()
        if k % 25 == 24:
            world.anew()
    return world


def test_random_calls_from_everywhere() -> None:
    for seed in range(9):
        play(seed, 120)
