"""A small pinball
===============

The left and right arrow keys beat the flippers, space lets a new ball fall. It needs pygame.

The board stands upright: gravity of the space lets balls of :class:`pool_pymunk.Billiards` fall on
exact parabolas. Flippers are kinematic bodies that turn, so they are walls that move. Bumpers are
walls with a kick, and the drain is a pocket.
"""

import math
from itertools import pairwise

import pygame
from pymunk import Body, Circle, Segment, Space, Vec2d

from pool_pymunk import Billiards, same_balls
from pool_pymunk.world import ContactEvent, TableBall

RADIUS, MASS, STEP = 0.0135, 0.08, 1 / 120  # m, kg, s
GRAVITY = (0.0, -3.0)  # m/s^2, along a board that leans back
WIDE, HIGH = 0.5, 0.9  # m
OUTLINE = ((0.0, 0.0), (0.0, HIGH), (WIDE, HIGH), (WIDE, 0.0))  # m; open below
GUIDES = (((0.0, 0.22), (0.13, 0.14)), ((WIDE, 0.22), (WIDE - 0.13, 0.14)))
BUMPERS = ((0.15, 0.62), (0.35, 0.62), (0.25, 0.75))
BUMPER, KICK, SCORE = 0.04, 0.6, 100  # m, m/s
DRAIN = (WIDE / 2.0, -0.35), 0.3  # m: a pocket below the board, and its radius
START = (0.42, 0.8)
PIVOTS, REACH = ((0.14, 0.135), (WIDE - 0.14, 0.135)), 0.085  # m
DOWN, UP, FAST = -0.5, 0.5, 18.0  # rad, rad, rad/s
SCALE, ROOM = 800, 20  # pixels a metre, and around the board
SIZE = round(WIDE * SCALE + 2 * ROOM), round(HIGH * SCALE + 2 * ROOM)
INK, BOARD, STEEL, RED, GOLD = "#10151f", "#1f3357", "#d8dee9", "#d1495b", "#edae49"


def pixel(point: tuple[float, float]) -> Vec2d:
    """Return where a point of the board (m) lies in the window."""
    return Vec2d(ROOM + point[0] * SCALE, SIZE[1] - ROOM - point[1] * SCALE)


class Flipper:
    """A flipper turns around its pivot; ``side`` is 1 for the left one and -1 for the right one."""

    def __init__(self, pivot: tuple[float, float], side: int) -> None:
        self.side, self.is_up = side, False
        self.body = Body(body_type=Body.KINEMATIC)
        self.body.position, self.body.angle = pivot, side * DOWN
        tip = (side * REACH, 0.0)
        self.blade = Segment(self.body, (0.0, 0.0), tip, 0.008)

    def steer(self) -> None:
        """Turn up or down in the next step, but not farther than the flipper goes."""
        left = self.side * (UP if self.is_up else DOWN) - self.body.angle
        self.body.angular_velocity = max(-FAST, min(FAST, left / STEP))


class Game:
    """A game has the board with its flippers, the balls, and the score."""

    def __init__(self) -> None:
        space = Space()
        space.gravity = GRAVITY
        self.table, ground = Billiards(space, STEP, pair=same_balls(0.9, 0.0)), space.static_body
        for a, b in (*pairwise(OUTLINE), *GUIDES):
            self.table.add_wall(Segment(ground, a, b, 0.004), 0.5, 0.05)
        self.bumpers = [
            self.table.add_wall(Circle(ground, BUMPER, place), 0.7, kick=KICK) for place in BUMPERS
        ]
        self.flippers = [Flipper(pivot, side) for pivot, side in zip(PIVOTS, (1, -1), strict=True)]
        for each in self.flippers:
            space.add(each.body)
            self.table.add_wall(each.blade, 0.4, 0.05)
        self.table.add_pocket(*DRAIN)
        self.table.on_contact = self.count
        self.is_open, self.score = True, 0
        self.drop()

    def drop(self) -> TableBall:
        """Let a new ball fall."""
        body = Body(MASS, math.inf)
        body.position, body.velocity = START, (-0.3, 0.0)
        return self.table.add_ball(Circle(body, RADIUS))

    def count(self, contact: ContactEvent) -> None:
        """Count what bumpers give."""
        self.score += SCORE * (contact.wall in self.bumpers)

    def advance(self) -> None:
        """Make one step."""
        for flipper in self.flippers:
            flipper.steer()
        self.table.step(STEP)

    def handle(self, event: pygame.event.Event) -> None:
        """Do what the player asks for."""
        self.is_open = self.is_open and event.type != pygame.QUIT
        if event.type not in (pygame.KEYDOWN, pygame.KEYUP):
            return
        is_down = event.type == pygame.KEYDOWN
        for key, flipper in zip((pygame.K_LEFT, pygame.K_RIGHT), self.flippers, strict=True):
            flipper.is_up = is_down if event.key == key else flipper.is_up
        if is_down and event.key == pygame.K_SPACE and not self.table.count:
            self.drop()

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the board, its bumpers and flippers, the balls, and the score."""
        surface.fill(INK)
        pygame.draw.polygon(surface, BOARD, [pixel(p) for p in OUTLINE])
        for a, b in (*pairwise(OUTLINE), *GUIDES):
            pygame.draw.line(surface, STEEL, pixel(a), pixel(b), 7)
        for place in BUMPERS:
            pygame.draw.circle(surface, RED, pixel(place), BUMPER * SCALE)
            pygame.draw.circle(surface, BOARD, pixel(place), 0.6 * BUMPER * SCALE)
        for each in self.flippers:
            a, b = (pixel(each.body.local_to_world(end)) for end in (each.blade.a, each.blade.b))
            pygame.draw.line(surface, GOLD, a, b, round(2 * each.blade.radius * SCALE))
            for end in (a, b):
                pygame.draw.circle(surface, GOLD, end, each.blade.radius * SCALE)
        for ball in self.table.on_table:
            pygame.draw.circle(surface, STEEL, pixel(ball.body.position), RADIUS * SCALE)
        text = f"{self.score}" if self.table.count else f"{self.score}: space drops a ball"
        words = pygame.font.Font(None, 36).render(text, True, STEEL)
        surface.blit(words, words.get_rect(center=pixel((WIDE / 2.0, 0.05))))


def main() -> None:
    """Play until the window is closed."""
    pygame.font.init()
    game, clock, surface = Game(), pygame.time.Clock(), pygame.display.set_mode(SIZE)
    while game.is_open:
        for event in pygame.event.get():
            game.handle(event)
        game.advance()
        game.draw(surface)
        pygame.display.flip()
        clock.tick(round(1 / STEP))


if __name__ == "__main__":
    main()
