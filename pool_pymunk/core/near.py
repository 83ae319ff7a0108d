"""Boxes around paths tell which balls a ball may meet, and a grid does for many balls."""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import INF

# From FEW balls on, paths are looked at in pieces of AHEAD times the balls' mean distance.
FEW: Final = 40
AHEAD: Final = 1.5
MANY: Final = 60  # From this many balls on, a grid is faster than to look through all boxes.


class Near:
    """Near finds the balls whose boxes overlap that of a ball; this one looks through all."""

    def __init__(self, balls: list[Ball]) -> None:
        self.balls: Final = balls
        self.ahead = INF  # m; the length of a path that is looked at
        if len(balls) >= FEW:
            xs, ys = [ball.path.x for ball in balls], [ball.path.y for ball in balls]
            width, height, many = max(xs) - min(xs), max(ys) - min(ys), len(balls)
            apart = max(math.sqrt(width * height / many), max(width, height) / many)
            self.ahead = AHEAD * apart if apart > 0.0 else INF

    def horizon(self, path: Path, now: float) -> float:
        """Return up to when (s) a path is looked at: the ball has gone ``ahead`` (m) by then."""
        speed = path.speed
        return now + self.ahead / speed if speed > 0.0 else INF

    def put(self, ball: Ball, since: float, end: float) -> None:
        """Let a ball's box be that of its path between two times (s)."""
        ball.put_box(since, end)

    def add(self, ball: Ball) -> None:
        """Take a ball in that has come to the table."""

    def remove(self, ball: Ball) -> None:
        ball.take_box_away()

    def candidates(self, ball: Ball) -> list[Ball]:
        """Return balls of which some, it among them, have boxes that overlap that of a ball."""
        return self.balls

    def around(self, ball: Ball) -> list[Ball]:
        """Return the balls whose boxes overlap that of a ball."""
        return [other for other in self.balls if other is not ball and overlap(ball, other)]


def near_of(balls: list[Ball]) -> Near:
    """Return what finds near balls among so many."""
    return Near(balls) if len(balls) < MANY else Grid(balls)


def overlap(one: Ball, other: Ball) -> bool:
    return (
        other.low_x <= one.high_x
        and other.high_x >= one.low_x
        and other.low_y <= one.high_y
        and other.high_y >= one.low_y
    )


@final
class Cell:
    """A cell of a grid has the balls whose boxes reach into it."""

    def __init__(self) -> None:
        self.balls: list[Ball] = []


@final
class Grid(Near):
    """A grid has cells as wide as the balls lie apart; boxes reach into few of them."""

    def __init__(self, balls: list[Ball]) -> None:
        super().__init__(balls)
        self.searches = 0
        self.low_x, self.low_y = min([b.path.x for b in balls]), min([b.path.y for b in balls])
        width = max([b.path.x for b in balls]) - self.low_x
        height = max([b.path.y for b in balls]) - self.low_y
        largest = max([b.radius for b in balls])
        self.size = max(math.sqrt(width * height / len(balls)), 2.0 * largest)
        self.columns, self.rows = int(width / self.size) + 1, int(height / self.size) + 1
        self.cells = [Cell() for _ in range(self.columns * self.rows)]
        self.places: list[tuple[int, int, int, int]] = [(0, 0, -1, -1) for _ in balls]

    def put(self, ball: Ball, since: float, end: float) -> None:
        ball.put_box(since, end)
        place = self._column(ball.low_x), self._row(ball.low_y), self._column(ball.high_x), \
            self._row(ball.high_y)  # fmt: skip
        if place != self.places[ball.number]:
            self._take_out(ball)
            self.places[ball.number] = place
            for cell in self._cells(ball):
                cell.balls.append(ball)

    def add(self, ball: Ball) -> None:
        self.places.append((0, 0, -1, -1))

    def remove(self, ball: Ball) -> None:
        super().remove(ball)
        self._take_out(ball)
        self.places[ball.number] = (0, 0, -1, -1)

    def candidates(self, ball: Ball) -> list[Ball]:
        return self.around(ball)

    def around(self, ball: Ball) -> list[Ball]:
        found: list[Ball] = []
        self.searches += 1
        ball.seen = self.searches
        for cell in self._cells(ball):
            for other in cell.balls:
                if other.seen != self.searches:
                    other.seen = self.searches
                    if overlap(ball, other):
                        found.append(other)
        return found

    def _cells(self, ball: Ball) -> list[Cell]:
        """Return the cells that have a ball."""
        i0, j0, i1, j1 = self.places[ball.number]
        rows = [j * self.columns for j in range(j0, j1 + 1)]
        return [self.cells[row + i] for row in rows for i in range(i0, i1 + 1)]

    def _take_out(self, ball: Ball) -> None:
        for cell in self._cells(ball):
            cell.balls.remove(ball)

    def _column(self, x: float) -> int:
        return int(max(0.0, min((x - self.low_x) / self.size, self.columns - 1.0)))

    def _row(self, y: float) -> int:
        return int(max(0.0, min((y - self.low_y) / self.size, self.rows - 1.0)))
