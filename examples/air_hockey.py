"""A game of air hockey
====================

Your mallet follows the mouse; the other one plays by itself. It needs pygame.

The mallets are kinematic bodies: the game gives each a velocity for the next step, and
:class:`pool_pymunk.Billiards` answers their hits at the true time inside the step, so that no puck
gets behind a mallet, however fast the mouse is.
"""

import math

import pygame
from pymunk import Body, Circle, Segment, Space, Vec2d

from pool_pymunk import Billiards, same_balls

LENGTH, WIDTH, GOAL = 2.0, 1.0, 0.4  # m
PUCK, MALLET = 0.032, 0.05  # m; radii
MASS, STEP = 0.015, 1 / 60  # kg, s
FASTEST, CLEVER = 6.0, 1.6  # m/s; how fast the mallets can be
AIR, BOUNCE, RUB = 0.15, 0.9, 0.05  # m/s^2 of the air cushion; restitution and friction
SCALE, ROOM = 440, 40  # pixels a metre, and around the table
SIZE = round(LENGTH * SCALE + 2 * ROOM), round(WIDTH * SCALE + 2 * ROOM)
ICE, LINE, RIM = "#f3f7fa", "#c9d6df", "#22313f"
COLORS = ("#d55e00", "#0072b2")
HOMES = Vec2d(0.15 * LENGTH, WIDTH / 2), Vec2d(0.85 * LENGTH, WIDTH / 2)
MIDDLE = Vec2d(LENGTH / 2, WIDTH / 2)
GAP = (WIDTH - GOAL) / 2


def pixel(point: tuple[float, float]) -> Vec2d:
    """Return where a point of the table (m) lies in the window."""
    return Vec2d(ROOM + point[0] * SCALE, SIZE[1] - ROOM - point[1] * SCALE)


class Game:
    """A game has a table with a puck and two mallets, of which the first one is the player's."""

    def __init__(self) -> None:
        self.table = Billiards(Space(), STEP, pair=same_balls(1.0, 0.0), deceleration=AIR)
        ground = self.table.space.static_body
        for a, b in (
            ((0, 0), (LENGTH, 0)), ((0, WIDTH), (LENGTH, WIDTH)),
            ((0, 0), (0, GAP)), ((0, WIDTH - GAP), (0, WIDTH)),
            ((LENGTH, 0), (LENGTH, GAP)), ((LENGTH, WIDTH - GAP), (LENGTH, WIDTH)),
        ):  # fmt: skip
            self.table.add_wall(Segment(ground, a, b, 0.0), BOUNCE, RUB)
        self.mallets = [Body(body_type=Body.KINEMATIC) for _ in HOMES]
        for body, home in zip(self.mallets, HOMES, strict=True):
            body.position = home
            self.table.space.add(body)
            self.table.add_wall(Circle(body, MALLET), BOUNCE, RUB)
        body = Body(MASS, math.inf)
        body.position = MIDDLE
        self.puck = self.table.add_ball(Circle(body, PUCK))
        self.mouse, self.goals, self.is_open = HOMES[0], [0, 0], True

    def steer(self, mallet: int, goal: Vec2d, fastest: float) -> None:
        """Give a mallet the velocity that takes it to a place (m) of its own half, if it can."""
        low = MALLET + mallet * LENGTH / 2
        x = min(max(goal.x, low), low + LENGTH / 2 - 2 * MALLET)
        y = min(max(goal.y, MALLET), WIDTH - MALLET)
        body = self.mallets[mallet]
        velocity = (Vec2d(x, y) - body.position) / STEP
        body.velocity = velocity * min(1.0, fastest / max(velocity.length, 1e-9))

    def answer(self) -> Vec2d:
        """Return where the mallet that plays by itself wants to be: behind the puck, or at home."""
        place, velocity = self.puck.body.position, self.puck.body.velocity
        if place.x < LENGTH / 2 + MALLET or velocity.x < -0.5:
            return Vec2d(HOMES[1].x, min(max(place.y, GAP), WIDTH - GAP))
        return place + Vec2d(0.02, 0.0)

    def advance(self) -> None:
        """Make one step; after a goal the puck comes back, on the side of who got it."""
        self.steer(0, self.mouse, FASTEST)
        self.steer(1, self.answer(), CLEVER)
        self.table.step(STEP)
        x = self.puck.body.position.x
        if not -PUCK < x < LENGTH + PUCK:
            self.goals[x < 0.0] += 1
            self.table.place(self.puck, MIDDLE + Vec2d(0.25 if x > 0.0 else -0.25, 0.0))

    def handle(self, event: pygame.event.Event) -> None:
        """Follow the mouse, and the wish to end."""
        self.is_open = self.is_open and event.type != pygame.QUIT
        if "pos" in event.dict:
            x, y = event.pos
            self.mouse = Vec2d(x - ROOM, SIZE[1] - ROOM - y) / SCALE

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the table with its lines and goals, the puck, the mallets, and the score."""
        surface.fill(RIM)
        corner, size = pixel((0.0, WIDTH)), (LENGTH * SCALE, WIDTH * SCALE)
        pygame.draw.rect(surface, ICE, (*corner, *size))
        pygame.draw.line(surface, LINE, pixel((MIDDLE.x, 0.0)), pixel((MIDDLE.x, WIDTH)), 3)
        pygame.draw.circle(surface, LINE, pixel(MIDDLE), 0.15 * SCALE, 3)
        for x, color in zip((0.0, LENGTH), COLORS, strict=True):
            ends = pixel((x, GAP)), pixel((x, WIDTH - GAP))
            pygame.draw.line(surface, color, *ends, 8)
        for body, color in zip(self.mallets, COLORS, strict=True):
            pygame.draw.circle(surface, color, pixel(body.position), MALLET * SCALE)
            pygame.draw.circle(surface, ICE, pixel(body.position), 0.45 * MALLET * SCALE, 3)
        pygame.draw.circle(surface, RIM, pixel(self.puck.body.position), PUCK * SCALE)
        words = pygame.font.Font(None, 36).render(f"{self.goals[0]} : {self.goals[1]}", True, ICE)
        surface.blit(words, words.get_rect(center=(SIZE[0] / 2, ROOM / 2)))


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
        clock.tick(60)


if __name__ == "__main__":
    main()
