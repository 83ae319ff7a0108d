"""This module follows what somebody does to balls and walls between two steps, or refuses it.

What somebody has done is the difference from where the table put a ball, whatever it was before:
the table compares each body that has moved with the ball's path.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pool_pymunk.engine.due import hit_of
from pool_pymunk.model.problems import SettingError
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.sides import OVERLAP
from pool_pymunk.world.ball import Disc, TableBall
from pool_pymunk.world.bodies import Moves, Snapshot
from pool_pymunk.world.checks import check_sound, check_space, check_unchanged, is_sound
from pool_pymunk.world.movers import Mover
from pool_pymunk.world.outlook import beside, free_spot, is_free
from pool_pymunk.world.state import LiveState, Phase
from pool_pymunk.world.walls import Walls

# A step of pymunk rounds velocity and place by less than this: a few roundings of EPSILON / 2.
STEP_ROUNDING = 4.0 * EPSILON
# Between steps a body has its mean velocity over the coming one. A change by less than this share
# of it is a push, which is added to the velocity now; a larger one is a new velocity. For a push
# in each step the difference counts, since friction would act one and a half times.
PUSH = 0.1
# A ball's new place (None: it is where it was) and velocity (m, m/s).
NewMove = tuple[Vector | None, Vector]


class WatchedState(LiveState):
    """This state follows what somebody does to balls and walls."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.walls = Walls(self)
        # the bodies when all balls were last seen to be on their paths
        self._seen = Snapshot()
        self.forces: dict[TableBall, Vector] = {}  # N, on balls then
        # Somebody gave these balls numbers that are not finite, or too large.
        self._unsound: dict[TableBall, Moves] = {}
        self._touched: set[TableBall] = set()  # by somebody, since the last step

    # -- walls that move -----------------------------------------------------------------------

    def begin_step(self) -> None:
        super().begin_step()
        if self.walls.movers:
            self.walls.plan()

    def make_room(self) -> None:
        """Keep balls out of walls that have come to lie in them since the last step."""
        moved, seen = list[TableBall](), self.bodies.read()
        for place, mover in self.walls.movers.items():
            mover.check()
            if not mover.goes_on():
                self.engine.now = self.time
                for ball in self.on_table() if self.engine.groups.members else ():
                    if self.engine.presses(hit_of(ball.number, -1 - place)):
                        self.engine.take_over()
                        self.engine.release(ball.number)
                        moved.append(ball)
            inside = self.walls.balls_in(mover, 0.0, among=self.walls.balls_around(mover, seen))
            near = {(ball.number, place) for ball in inside}
            jams = self.engine.jams
            jams -= {key for key in jams if key[1] == place and key not in near}
            for ball in inside:
                self._keep_out(ball, place, mover)
        if moved:
            self.set_out(moved)

    def _keep_out(self, ball: TableBall, place: int, mover: Mover) -> None:
        """Put a ball beside a wall that lies in it now; without room the wall goes through it."""
        engine, key = self.engine, (ball.number, place)
        x, y = self.state_of(ball.number)[0][:2]
        if mover.side.gap(x, y, ball.radius) >= -OVERLAP * ball.radius:
            engine.jams.discard(key)
            return
        most = 2.0 * ball.radius if mover.is_there() else math.inf
        spot = self._spot_for(ball, (x, y), self.discs(without=ball), most)
        if spot is None:
            engine.jam(key)
            return
        engine.jams.discard(key)
        self.send(ball, spot, None)

    def look(self) -> None:
        """Note that all bodies are on their paths now."""
        self._seen = self.bodies.read()
        self.stirred = set() if self._seen.is_plain else set(self.on_table())
        self.joined.clear()

    def follow(self) -> None:
        """Follow what the present callback has done."""

    def catch_up(self) -> None:
        """Follow what has happened to the balls since the last look."""
        for mover in self.walls.movers.values():
            mover.stand()
        seen, now, ball_of = self._seen, self.bodies.read(), self.ball_of
        if not (self.stirred or self.joined) and now.is_same(seen):
            return
        is_lost = any(thing.space is not self.space for thing in self.joined)
        if is_lost or not now.has_all_of(seen):
            self.follow_removals()
            now = self.bodies.read()
        rows = {ball_of[body]: move for body, move in now.changes(seen) if body in ball_of}
        for ball in self.stirred.difference(rows):
            if ball.is_on_table:  # It is where it was, which may be off its path.
                rows[ball] = now.moves[ball.body_id]
        moved = self._follow(rows)
        self._seen, self.stirred = now, set(self._unsound)
        self.joined.clear()
        if moved:
            self.set_out(moved)
            for ball in moved:
                self.drop_in(ball)
            self.catch_up()  # This second look finds them on their paths.

    def path_of(self, i: int) -> Path:
        """Return the exact path of ball ``i``, after what somebody has done to it."""
        if self.phase is Phase.BETWEEN:
            self.catch_up()
        elif self.phase is Phase.TELLING:
            self.follow()
        return super().path_of(i)

    def follow_removals(self) -> None:
        """Take balls and walls off the table that somebody has taken out of the space."""
        for ball in self.on_table():
            if not self.is_there(ball):
                self.drop(ball)
            elif ball.sensor.space is None:
                self.join(ball.sensor)
        self.walls.drop_lost()

    def refuse_changes(self) -> None:
        """Refuse changes that the table cannot follow, before anything moves."""
        check_space(self.space)
        for ball, move in self._unsound.items():
            check_sound(ball, move, self.end_of_step())
        for ball in self.moving.values():
            if not ball.is_as_it_came():
                check_unchanged(ball)
        number = self.steps % max(len(self.balls), 1)  # One ball a step is looked at closely.
        for ball in (*self._touched, *self.balls[number : number + 1]):
            if ball.is_on_table:
                check_unchanged(ball)
        self._touched.clear()
        if self.moving:
            self.walls.refuse_changed(some=True)

    # -- balls -----------------------------------------------------------------------------------

    def _follow(self, rows: Mapping[TableBall, Moves]) -> list[TableBall]:
        """Give balls new paths that somebody has moved off their own, and return them."""
        new: dict[TableBall, NewMove] = {}
        for ball, row in rows.items():
            if (found := self._new_move(ball, row)) is not None:
                new[ball] = found
        is_clear = {b: b not in new and sum(row) - sum(row) == 0.0 for b, row in rows.items()}
        end = self.end_of_step()
        unsound = {b: row for b, row in rows.items() if not (is_clear[b] or is_sound(b, row, end))}
        self._unsound = unsound
        for ball in self._unsound:
            new.pop(ball, None)
            self.forces.pop(ball, None)
        places = {ball: place for ball, (place, _) in new.items() if place is not None}
        discs = self.discs() if places else {}
        discs |= {ball: (place, ball.radius) for ball, place in places.items()}
        for ball, (place, velocity) in new.items():
            if place is not None:
                del discs[ball]
                place = self.room_for(ball, place, discs)
                discs[ball] = place, ball.radius
            self.begin_path(ball, place or self.state_of(ball.number)[0][:2], velocity)
        self._touched.update(new)
        return list(new)

    def _new_move(self, ball: TableBall, row: Moves) -> NewMove | None:
        """Return how a ball moves that somebody has moved off its path; None if nobody has."""
        x, y, vx, vy, _, fx, fy, _ = row
        if fx != 0.0 or fy != 0.0:
            self.forces[ball] = fx, fy
        elif self.forces:
            self.forces.pop(ball, None)
        now, path = self.time, self.engine.paths[ball.number]
        px, py, pvx, pvy = motion_at(path, now)
        ex, ey = self.mean_of(self.engine.surfaces[ball.number], path, path.end - now, pvx, pvy)
        off, gain = abs(x - px) + abs(y - py), abs(vx - ex) + abs(vy - ey)
        share = late = speed = 0.0
        if path.end > now:
            # All its steps along the path have rounded place, velocity and the clock (s).
            share = STEP_ROUNDING * (2.0 + min((now - path.t) / self.dt, self.count))
            speed, late = self.engine.speeds[ball.number], 2.0 * EPSILON * now
        size = abs(x) + abs(y) + speed * (now - path.t) + ball.radius
        is_there = off <= share * size + late * speed
        is_as_fast = gain <= share * speed + late * self.engine.pull
        if is_there and is_as_fast:
            return None
        if is_as_fast:  # Only its place is new.
            vx, vy = pvx, pvy
        elif gain <= PUSH * (abs(ex) + abs(ey)):
            vx, vy = pvx + vx - ex, pvy + vy - ey
        return None if is_there else (x, y), (vx, vy)

    def room_for(self, ball: TableBall, place: Vector, discs: Mapping[TableBall, Disc]) -> Vector:
        """Return where a ball that was pushed into balls and walls touches them instead."""
        spot = self._spot_for(ball, place, discs)
        if spot is None:  # There is no room for it: it stays where it was.
            return self.engine.paths[ball.number].at(self.now)[0]
        return spot

    def _spot_for(
        self,
        ball: TableBall,
        place: Vector,
        discs: Mapping[TableBall, Disc],
        most: float = math.inf,
    ) -> Vector | None:
        """Return the place for a ball that is nearest to a place in balls or walls (m), if any.

        It is not farther off than ``most``.
        """
        walls = [each for each in self.walls.obstacles.values() if not each.wall.is_pocket]
        others = list(discs.values())
        pushed = beside(place, ball.radius, others, walls)
        if is_free(pushed, ball.radius, others, walls):
            return pushed
        try:
            return free_spot(place, ball.radius, others, walls, most)
        except SettingError:
            return None
