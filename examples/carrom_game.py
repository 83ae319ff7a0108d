"""A game of carrom
================

Drag the striker along the base line. Press above the line, pull back and let go. It needs pygame.
"""

import pygame
from pymunk import Body, Circle, Segment, Space, Vec2d

from pool_pymunk import Billiards, load, same_balls

SCENE = load("carrom")
E, MU = SCENE.restitution, SCENE.friction
assert SCENE.table and E.ball_ball and E.cushion
EDGES, SIDE, MIDDLE = SCENE.table.edges, SCENE.table.bounds[2], Vec2d(0.37, 0.37)  # m
PAIR, FRAME = same_balls(E.ball_ball, MU.ball_ball), (E.cushion, MU.cushion)
STEP, FULL, PULL = 1 / 30, 3.5, 0.2  # s; m/s at a full pull, and how far (m) that is
LEFT, RIGHT, LINE, HALF = 0.1509, SIDE - 0.1509, 0.1174, 0.0159  # m; the base line, half its width
SCALE, ROOM, SIZE = 1000, 0.1, (940, 940)  # pixels a metre; m; pixels
LAYERS = {0.1: "#15191d", 0.076: "#2a1a0e", 0.072: "#5b3a24", 0.006: "#8a6242", 0.0: "#e2b779"}
INK, RED, PALE, HOLE = "#3a2416", "#c62828", "#efe6d2", "#0b0d0f"


def pixel(point: tuple[float, float]) -> Vec2d:
    """Return where a point of the board (m) lies in the window."""
    return Vec2d(point[0] + ROOM, SIDE - point[1] + ROOM) * SCALE


class Game:
    """A game has its table, and the discs in the order of the scene's balls."""

    def __init__(self) -> None:
        self.table = Billiards(Space(), STEP, pair=PAIR, deceleration=SCENE.deceleration)
        for a, b, *_ in EDGES:
            self.table.add_wall(Segment(self.table.space.static_body, a, b, 0.0), *FRAME)
        for hole in SCENE.pockets:
            self.table.add_pocket(hole.position, hole.radius)
        for ball in SCENE.balls:
            body = Body(ball.mass, 1e-6)
            body.position = ball.position
            self.table.add_ball(Circle(body, ball.radius), ball.id)
        self.discs, self.striker = self.table.balls, self.table.balls[0]
        self.mouse, self.pressed, self.is_aiming, self.is_open = MIDDLE, MIDDLE, True, True

    def lay(self, x: float) -> None:
        """Lay the striker on the base line, as near to x (m) as there is room."""
        men = [(d.body.position, d.radius) for d in self.discs[1:] if d.is_on_table]
        line = [Vec2d(LEFT + k * (RIGHT - LEFT) / 400, LINE) for k in range(401)]
        free = [p for p in line if all(p.get_distance(q) > r + self.striker.radius for q, r in men)]
        state, place = self.table.save_state(), min(free, key=lambda p: abs(p.x - x))
        state.motions[self.striker.number] = (*place, 0.0, 0.0)
        self.table.restore_state(state)

    def shot(self) -> Vec2d:
        """Return the velocity (m/s) of a shot now."""
        aim = (self.pressed - self.striker.body.position).normalized()
        pull = (self.pressed - self.mouse).dot(aim) * (self.pressed.y > LINE + HALF)
        return aim * FULL * min(max(pull / PULL, 0.0), 1.0)

    def advance(self, seconds: float) -> None:
        """Let time (s) pass; when all discs rest, the striker comes back to the base line."""
        self.table.space.step(min(seconds, STEP))
        if not self.is_aiming and not self.table.moving:
            self.is_aiming = True
            self.lay(MIDDLE.x)

    def handle(self, event: pygame.event.Event) -> None:
        """Do what the player asks for."""
        self.is_open = self.is_open and event.type != pygame.QUIT
        if not self.is_aiming or "pos" not in event.dict:
            return
        self.mouse = Vec2d(event.pos[0], SIZE[1] - event.pos[1]) / SCALE - (ROOM, ROOM)
        is_held = event.type == pygame.MOUSEMOTION and event.buttons[0]
        if is_held and self.pressed.y < LINE + HALF:
            self.lay(self.mouse.x)
        elif event.type == pygame.MOUSEBUTTONUP and self.shot().length > 0.05:
            self.is_aiming = False
            self.table.strike(self.striker, self.shot())
        self.pressed = self.pressed if is_held else self.mouse

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the board, what the shot would do, the discs, and how many are in pockets."""
        for out, color in LAYERS.items():
            corner, size = pixel((-out, SIDE + out)), (SIDE + 2 * out) * SCALE
            pygame.draw.rect(surface, color, (*corner, size, size))
        corner, size = pixel((LEFT - HALF, LINE + HALF)), 2 * HALF * SCALE
        line = (*corner, size + (RIGHT - LEFT) * SCALE, size)
        pygame.draw.rect(surface, INK, line, 3, border_radius=round(HALF * SCALE))
        pygame.draw.circle(surface, RED, pixel(MIDDLE), 0.085 * SCALE, 3)
        for hole in SCENE.pockets:
            pygame.draw.circle(surface, HOLE, pixel(hole.position), hole.radius * SCALE)
        if self.is_aiming and self.shot():
            seen = self.table.predict(self.striker, self.shot())
            for turns, color in ((seen.other_way or seen.way, RED), (seen.way, INK)):
                pygame.draw.aalines(surface, color, False, [pixel(point) for point in turns])
        for ball, disc in zip(SCENE.balls, self.discs, strict=True):
            place, size = pixel(disc.body.position), disc.is_on_table * disc.radius * SCALE
            for share, its in ((1.0, HOLE), (0.9, ball.color), (0.6, INK), (0.54, ball.color)):
                pygame.draw.circle(surface, its or PALE, place, share * size)
        gone = [str(disc.id)[0] for disc in self.discs if not disc.is_on_table]
        count = "   ".join(f"{name} {gone.count(name[0])}" for name in ("White", "Black", "Queen"))
        words = pygame.font.Font(None, 30).render(count, True, PALE)
        surface.blit(words, words.get_rect(center=pixel((SIDE / 2, -0.04))))


def main() -> None:
    """Play until the window is closed."""
    pygame.font.init()
    game, clock, surface = Game(), pygame.time.Clock(), pygame.display.set_mode(SIZE)
    while game.is_open:
        for event in pygame.event.get():
            game.handle(event)
        game.advance(clock.tick(60) / 1000)
        game.draw(surface)
        pygame.display.flip()


if __name__ == "__main__":
    main()
