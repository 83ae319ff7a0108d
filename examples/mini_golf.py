"""A hole of mini golf
===================

Pull back from the ball and let go. The windmill turns, sand stops the ball, and ice does not.
It needs pygame.

Sand and ice are patches of :class:`pool_pymunk.Billiards`, with decelerations of their own, and the
windmill is a kinematic body that turns. Balls cross borders and meet the vanes at the true times.
"""

import math

import pygame
from pymunk import Body, Circle, Poly, Segment, Space, Vec2d

from pool_pymunk import Billiards, same_balls

RADIUS, MASS, STEP = 0.0213, 0.046, 1 / 60  # m, kg, s
OUTLINE = ((0.0, 0.0), (3.2, 0.0), (3.2, 1.8), (2.1, 1.8), (2.1, 1.0), (0.0, 1.0))  # m
SAND = ((1.9, 0.0), (2.35, 0.0), (2.35, 0.45), (1.9, 0.45))
ICE = ((2.1, 1.0), (3.2, 1.0), (3.2, 1.35), (2.1, 1.35))
TEE, HOLE, CUP = (0.3, 0.35), (2.4, 1.6), 0.054  # m
MILL, VANE, TURNS = (1.15, 0.5), 0.3, 1.6  # m, m, rad/s
SLIDES, ROLLS = 4.0, 0.35  # m/s^2, on the green
SLOW, FAST = (5.0, 2.5), (0.3, 0.02)  # m/s^2, in sand and on ice
FULL, PULL, QUIET = 4.0, 0.6, 0.05  # m/s at a full pull (m); a shorter pull is none
SCALE, ROOM = 300, 40  # pixels a metre, and around the course
SIZE = round(3.2 * SCALE + 2 * ROOM), round(1.8 * SCALE + 2 * ROOM)
INK, GREEN, WOOD, PALE = "#16241a", "#3f8f55", "#6b4a2e", "#f7f7f2"
SANDY, ICY, RED = "#dcc48e", "#cfe8f3", "#c62828"


def pixel(point: tuple[float, float]) -> Vec2d:
    """Return where a point of the course (m) lies in the window."""
    return Vec2d(ROOM + point[0] * SCALE, SIZE[1] - ROOM - point[1] * SCALE)


class Game:
    """A game has the course with its ball, its windmill, and the number of strokes so far."""

    def __init__(self) -> None:
        self.table = Billiards(
            Space(), STEP, pair=same_balls(0.9, 0.05), deceleration=SLIDES, rolling=ROLLS,
        )  # fmt: skip
        ground = self.table.space.static_body
        for a, b in zip(OUTLINE, (*OUTLINE[1:], OUTLINE[0]), strict=True):
            self.table.add_wall(Segment(ground, a, b, 0.0), 0.7, 0.1)
        self.table.add_patch(Poly(ground, SAND), *SLOW)
        self.table.add_patch(Poly(ground, ICE), *FAST)
        self.table.add_pocket(HOLE, CUP)
        self.mill = Body(body_type=Body.KINEMATIC)
        self.mill.position, self.mill.angular_velocity = MILL, TURNS
        self.table.space.add(self.mill)
        self.vanes = [
            Segment(self.mill, (0.04 * u.x, 0.04 * u.y), (VANE * u.x, VANE * u.y), 0.012)
            for u in (Vec2d(1.0, 0.0).rotated(k * math.pi / 2) for k in range(4))
        ]
        for vane in self.vanes:
            self.table.add_wall(vane, 0.7, 0.1)
        body = Body(MASS, math.inf)
        body.position = TEE
        self.ball = self.table.add_ball(Circle(body, RADIUS))
        self.mouse = self.pressed = Vec2d(*TEE)
        self.is_held, self.is_open, self.strokes = False, True, 0

    @property
    def is_in(self) -> bool:
        """Tell whether the ball is in the hole."""
        return not self.ball.is_on_table

    def shot(self) -> Vec2d:
        """Return the velocity (m/s) of a stroke now."""
        pull = self.pressed - self.mouse
        share = min(pull.length / PULL, 1.0) * (pull.length > QUIET)
        return pull.normalized() * FULL * share

    def advance(self) -> None:
        """Make one step."""
        self.table.step(STEP)

    def handle(self, event: pygame.event.Event) -> None:
        """Do what the player asks for; after the hole a click begins anew."""
        self.is_open = self.is_open and event.type != pygame.QUIT
        if "pos" not in event.dict:
            return
        self.mouse = Vec2d(event.pos[0] - ROOM, SIZE[1] - ROOM - event.pos[1]) / SCALE
        if event.type == pygame.MOUSEBUTTONDOWN:
            if self.is_in:
                self.table.place(self.ball, TEE)
                self.strokes = 0
            self.is_held, self.pressed = not self.table.moving, self.mouse
        elif event.type == pygame.MOUSEBUTTONUP and self.is_held:
            self.is_held = False
            if self.shot():
                self.strokes += 1
                self.table.strike(self.ball, self.shot(), roll=1.0)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the course, the hole, the windmill, the ball, and the pull."""
        surface.fill(INK)
        pygame.draw.polygon(surface, GREEN, [pixel(corner) for corner in OUTLINE])
        for corners, color in ((SAND, SANDY), (ICE, ICY)):
            pygame.draw.polygon(surface, color, [pixel(corner) for corner in corners])
        for a, b in zip(OUTLINE, (*OUTLINE[1:], OUTLINE[0]), strict=True):
            pygame.draw.line(surface, WOOD, pixel(a), pixel(b), 10)
            pygame.draw.circle(surface, WOOD, pixel(a), 5)
        pygame.draw.circle(surface, INK, pixel(HOLE), CUP * SCALE)
        for vane in self.vanes:
            a, b = (pixel(self.mill.local_to_world(end)) for end in (vane.a, vane.b))
            pygame.draw.line(surface, RED, a, b, round(2 * vane.radius * SCALE))
        pygame.draw.circle(surface, WOOD, pixel(MILL), 0.05 * SCALE)
        if not self.is_in:
            place = self.ball.body.position
            if self.is_held and self.shot():
                pygame.draw.line(surface, PALE, pixel(place), pixel(place + self.shot() * 0.15), 3)
            pygame.draw.circle(surface, PALE, pixel(place), RADIUS * SCALE)
        text = f"In with {self.strokes}" if self.is_in else f"Strokes: {self.strokes}"
        words = pygame.font.Font(None, 36).render(text, True, PALE)
        surface.blit(words, words.get_rect(center=pixel((1.0, 1.4))))


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
