"""Random scenes of mallets and pucks: no puck is in a mallet, or off the table, at any time.

``python -m tests.shared.moving_scenes 1000`` plays so many scenes, half of them with mallets that
turn. It prints how deep pucks came to lie in mallets, how fast they were, and how long a step took.
The check has its own geometry, and looks at twelve times in each step.
"""

from __future__ import annotations

import math
import random
import sys
import time
from itertools import pairwise
from typing import Any, NamedTuple

import pymunk

from pool_pymunk import Billiards, same_balls
from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.motion.path import Path, standing
from pool_pymunk.core.news import News
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.world import TableBall

WIDTH, HEIGHT, R = 2.0, 1.0, 0.03  # m
RATES = 30, 60, 120, 240  # steps a second
LOOKS = 12  # in each step


class Played(NamedTuple):
    """A scene was played: what came of it, in m, m/s and s."""

    deepest: float  # how deep a puck was in a mallet without a jam
    outside: float  # how far a puck was beyond the table's edge
    fastest: float
    contacts: int
    jams: int
    longest: float  # the time that a step took


class Spy(Recorder):
    """This recorder notes the paths of pucks, and tells the table what it wants to hear."""

    def __init__(self, news: News) -> None:
        self.news, self.paths = news, list[tuple[int, Path]]()

    def path(self, ball: Ball, path: Path) -> None:
        self.paths.append((ball.number, path))

    def stop(self, ball: Ball, t: float, place: tuple[float, float]) -> None:
        self.paths.append((ball.number, standing(t, *place)))
        self.news.stop(ball, t, place)

    def contact(self, one: Contact, t: float) -> None:
        self.news.contact(one, t)

    def jammed(self, ball: Ball, wall: Wall, t: float) -> None:
        self.news.jammed(ball, wall, t)


def place_of(table: Billiards, number: int) -> int:
    """Return the place of the wall of a number in the engine, by which jams are kept."""
    return next(wall.place for wall in table.engine.movers if wall.number == number)


class Scene:
    """A scene has a table with random mallets and pucks; walls and mallets may be bumpers."""

    def __init__(self, seed: int, turns: bool, kicks: bool = False) -> None:
        self.rnd = rnd = random.Random(seed)
        self.turns, self.dt, self.space = turns, 1.0 / rnd.choice(RATES), pymunk.Space()
        e, mu, pull = (rnd.choice(each) for each in ((1.0, 0.9, 0.5, 0.0), (0, 0.1), (0, 0.1, 1)))
        rolling = 0.05 if pull and rnd.random() < 0.3 else None
        how: dict[str, Any] = {"deceleration": pull, "rolling": rolling}
        self.table = Billiards(self.space, self.dt, pair=same_balls(e, mu), **how)
        kick = rnd.choice((0.1, 0.5, 2.0)) if kicks else 0.0
        corners = [(0, 0), (WIDTH, 0), (WIDTH, HEIGHT), (0, HEIGHT)]
        for a, b in pairwise([*corners, corners[0]]):
            edge = pymunk.Segment(self.space.static_body, a, b, 0.0)
            self.table.add_wall(edge, e, mu, kick=kick * (kicks and rnd.random() < 0.5))
        self.mallets: list[tuple[pymunk.Body, Any, int]] = []
        for _ in range(rnd.randint(1, 3)):
            body, shape = self.mallet()  # A shape does not keep its body.
            self.mallets.append((body, shape, self.table.add_wall(shape, e, mu, kick=kick)))
        self.pucks = [puck for _ in range(rnd.randint(1, 10)) if (puck := self.puck())]

    def mallet(self) -> tuple[pymunk.Body, Any]:
        rnd, body = self.rnd, pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position = rnd.uniform(0.3, WIDTH - 0.3), rnd.uniform(0.3, HEIGHT - 0.3)
        body.angle, kind = rnd.uniform(0, 6), rnd.choice(["disc", "box", "bar"])
        if kind == "disc":
            return body, pymunk.Circle(body, rnd.uniform(0.03, 0.08))
        if kind == "bar":
            ends = (-rnd.uniform(0.05, 0.2), 0), (0.1, 0)
            return body, pymunk.Segment(body, *ends, rnd.choice([0.0, 0.005, 0.02]))
        size = rnd.uniform(0.04, 0.3), rnd.uniform(0.03, 0.1)
        return body, pymunk.Poly.create_box(body, size, rnd.choice([0, 0.01]))

    def puck(self) -> TableBall | None:
        rnd, body = self.rnd, pymunk.Body(0.17, 1e-4)
        if rnd.random() < 0.6:
            body.velocity = rnd.gauss(0, 1), rnd.gauss(0, 1)
        for _ in range(100):
            body.position = rnd.uniform(R, WIDTH - R), rnd.uniform(R, HEIGHT - R)
            try:
                return self.table.add_ball(pymunk.Circle(body, R))
            except ValueError:
                continue
        return None

    def steer(self, k: int) -> None:
        """Give mallets other velocities now and then, and put them elsewhere."""
        rnd, dt = self.rnd, self.dt
        for body, _, _ in self.mallets:
            if k % max(1, int(0.1 / dt)) == 0:
                speed, angle = rnd.choice([0, 0.3, 1.0, 3.0]), rnd.uniform(0, 2 * math.pi)
                body.velocity = speed * math.cos(angle), speed * math.sin(angle)
                if self.turns:
                    body.angular_velocity = rnd.choice([0, 0, 1.0, 5.0, 30.0, -10.0])
            (x, y), (vx, vy) = body.position, body.velocity
            vx = vx if 0.1 < x + vx * dt < WIDTH - 0.1 else -vx
            vy = vy if 0.1 < y + vy * dt < HEIGHT - 0.1 else -vy
            body.velocity = vx, vy
            if rnd.random() < 0.01:
                body.position = rnd.uniform(0.15, WIDTH - 0.15), rnd.uniform(0.15, HEIGHT - 0.15)

    def play(self, seconds: float) -> Played:
        """Play the scene, and look where the pucks are."""
        table, contacts, jams = self.table, list[object](), list[object]()
        table.engine.recorder = spy = Spy(table.engine.news)
        paths = spy.paths
        table.on_contact, table.on_jam = contacts.append, lambda *said: jams.extend(said[:1])
        deepest = outside = fastest = longest = 0.0
        for k in range(int(seconds / self.dt)):
            self.steer(k)
            poses = [(*b.position, b.angle, *b.velocity, b.angular_velocity)
                     for b, _, _ in self.mallets]  # fmt: skip
            jammed, began = set(table.engine.squeezes.jams), table.time
            paths.clear()
            since = time.perf_counter()
            self.space.step(self.dt)
            longest = max(longest, time.perf_counter() - since)
            jammed |= table.engine.squeezes.jams
            for i, x, y, speed, late in self.places(paths, began):
                fastest = max(fastest, speed)
                outside = max(outside, R - x, x - WIDTH + R, R - y, y - HEIGHT + R)
                for pose, (_, shape, number) in zip(poses, self.mallets, strict=True):
                    if (i, place_of(table, number)) not in jammed:
                        deepest = max(deepest, -gap(pose, late, shape, x, y))
        return Played(deepest, outside, fastest, len(contacts), len(jams), longest)

    def places(self, paths: list[tuple[int, Path]], began: float) -> Any:
        """Return where pucks were in a step, how fast, and how long after its beginning."""
        for puck in self.pucks:
            its = [path for i, path in paths if i == puck.number]
            for m in range(LOOKS + 1):
                t = began + (self.table.time - began) * m / LOOKS
                found = [path for path in its if path.t <= t]
                if found or not its:
                    path = found[-1] if found else puck.core.path
                    x, y, vx, vy = path.at(t)
                    yield puck.number, x, y, math.hypot(vx, vy), t - began


def gap(pose: tuple[float, ...], late: float, shape: Any, x: float, y: float) -> float:
    """Return the gap (m) between a puck and a mallet some time after it had a pose."""
    px, py, angle, vx, vy, turns = pose
    x, y, angle = x - px - late * vx, y - py - late * vy, angle + late * turns
    c, s = math.cos(angle), math.sin(angle)
    x, y = x * c + y * s, y * c - x * s
    if isinstance(shape, pymunk.Circle):
        return math.hypot(x, y) - shape.radius - R
    is_bar = isinstance(shape, pymunk.Segment)
    corners = [shape.a, shape.b] if is_bar else shape.get_vertices()
    nearest, is_inside = math.inf, not is_bar
    for (ax, ay), (bx, by) in pairwise([*corners, corners[0]]):
        dx, dy = bx - ax, by - ay
        share = min(max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        nearest = min(nearest, math.hypot(x - ax - share * dx, y - ay - share * dy))
        is_inside = is_inside and dx * (y - ay) - dy * (x - ax) >= 0.0
    return float((-nearest if is_inside else nearest) - shape.radius - R)


if __name__ == "__main__":
    many = int(sys.argv[1])
    all_played = []
    for seed in range(many):
        played = Scene(seed, turns=seed % 2 == 1).play(1.0)
        all_played.append(played)
        if played.deepest > 1e-6 * R or played.outside > 1e-6 * R:
            print(f"scene {seed}: {played}")
    for name in Played._fields:
        print(f"{name}: at most {max(getattr(each, name) for each in all_played):.3g}")
    print(f"{sum(each.contacts for each in all_played)} contacts, of which "
          f"{sum(each.jams for each in all_played)} are jams")  # fmt: skip
