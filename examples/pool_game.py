"""A game of pool
==============

Aim with the mouse, press, pull back and let go. It needs pygame (``pip install pygame``).
"""

import pygame
from pymunk import Body, Circle, Segment, Space, Vec2d

from pool_pymunk import Billiards, load, same_balls
from pool_pymunk.world import TableBall, TableState

SCENE = load("eight-ball")
E, MU = SCENE.restitution, SCENE.friction
assert SCENE.table and E.ball_ball and E.cushion and MU.rolling
EDGES, RADIUS, (LENGTH, WIDTH) = SCENE.table.edges, SCENE.balls[0].radius, SCENE.table.bounds[2:]
PAIR, RAIL = same_balls(E.ball_ball, MU.ball_ball), (E.cushion, MU.cushion)
SLIDES, ROLLS = SCENE.deceleration, MU.rolling * SCENE.physics.gravity  # m/s^2
STEP, FULL, PULL = 1 / 30, 8.0, 0.5  # s; m/s at a full pull, and how far (m) that is
FINE, SCALE = 2, 780  # The canvas, of 780 pixels a metre, is twice as fine as the window.
ROOM, BELOW, TRAY = 0.16, 0.3, [Vec2d(0.071 * k - 0.034, WIDTH + 0.2) for k in range(16)]  # m
WINDOW = (round((LENGTH + 2 * ROOM) * SCALE / FINE), round((WIDTH + ROOM + BELOW) * SCALE / FINE))
IVORY, GOLD, INK, PAGE, HOLE, LIP = "#f6f1e3", "#f0c674", "#c9d0d6", "#15191d", "#0b0d0f", "#2c2622"
COLORS = ("#22252b", "#f7c815", "#1f57c0", "#d8232f", "#6a37a0", "#f3771f", "#118048", "#8a2129")
FRAMES = {1.0: PAGE, 0.13: "#2a1a0e", 0.125: "#64402a", 0.07: "#58371f", 0.057: "#a57a48",
          0.05: "#17603f", 0.045: "#1a6b48", 0.003: "#0e4a31", 0.0: "#1f7d53"}  # fmt: skip


def pixel(point: tuple[float, float]) -> Vec2d:
    """Return where a point of the table (m) lies on the canvas."""
    return Vec2d(point[0] + ROOM, point[1] + ROOM) * SCALE


def picture(number: int) -> pygame.Surface:
    """Draw a ball with its shadow, light, stripe and number, at first four times too large."""
    r, color = round(4 * RADIUS * SCALE), pygame.Color(COLORS[number % 8] if number else IVORY)
    ball, middle = pygame.Surface((3 * r, 3 * r), pygame.SRCALPHA), Vec2d(1.5 * r, 1.5 * r)
    pygame.draw.circle(ball, (0, 0, 0, 70), middle * 1.09, 1.07 * r)
    for tint, band in ((pygame.Color(IVORY) if number > 8 else color, 1.0), (color, 0.6)):
        ball.set_clip((0, (1.5 - band) * r, 3 * r, 2 * band * r))
        for k in range(r):  # The light comes from the upper left.
            shade = tint.lerp("black", 0.5 * (1 - k / r) ** 3).lerp("white", 0.6 * (k / r) ** 4)
            pygame.draw.circle(ball, shade, middle - Vec2d(0.36, 0.48) * k, r - k)
    pygame.draw.circle(ball, IVORY, middle, 0.5 * r if number else 0)
    digits = pygame.font.Font(None, round(0.95 * r)).render(str(number or ""), True, HOLE)
    ball.blit(digits, digits.get_rect(center=middle * 1.02))
    return pygame.transform.smoothscale(ball, (3 * r // 4, 3 * r // 4))


def empty_table() -> pygame.Surface:
    """Draw what stays: page, wood, cushions and cloth, one in the other, sights and holes."""
    canvas = pygame.Surface((FINE * WINDOW[0], FINE * WINDOW[1]))
    for out, color in FRAMES.items():
        rect = (pixel((-out, -out)), Vec2d(LENGTH + 2 * out, WIDTH + 2 * out) * SCALE)
        pygame.draw.rect(canvas, color, rect, border_radius=round(max(out - 0.05, 0.0) * SCALE))
    sights = [(LENGTH * k / 8, y) for k in (1, 2, 3, 5, 6, 7) for y in (-0.093, WIDTH + 0.093)]
    for sight in sights + [(x, WIDTH * k / 4) for k in (1, 2, 3) for x in (-0.093, LENGTH + 0.093)]:
        pygame.draw.circle(canvas, IVORY, pixel(sight), 0.007 * SCALE)
    holes = [(hole.position, hole.radius) for hole in SCENE.pockets]
    for place, radius in holes + [(place, 1.15 * RADIUS) for place in TRAY[1:]]:
        pygame.draw.circle(canvas, LIP, pixel(place), radius * SCALE)
        pygame.draw.circle(canvas, HOLE, pixel(place), 0.9 * radius * SCALE)
    return canvas


class Game:
    """A game has its space, its table, and the balls by their numbers; 0 is the cue ball."""

    def __init__(self) -> None:
        pygame.font.init()
        self.space, self.balls = Space(), dict[int, TableBall]()
        self.table = Billiards(self.space, STEP, pair=PAIR, deceleration=SLIDES, rolling=ROLLS)
        for a, b, *_ in EDGES:
            self.table.add_wall(Segment(self.space.static_body, a, b, 0.0), *RAIL)
        for hole in SCENE.pockets:
            self.table.add_pocket(hole.position, hole.radius)
        for ball in SCENE.balls:
            body, number = Body(ball.mass, 1e-4), 0 if ball.cue else int(ball.id)
            body.position = ball.position
            self.balls[number] = self.table.add_ball(Circle(body, ball.radius))
        self.mouse = self.pressed = Vec2d(0.75 * LENGTH, 0.5 * WIDTH)
        self.before, self.is_open = list[TableState](), True
        self.background, self.font = empty_table(), pygame.font.Font(None, 40)
        self.pictures = [picture(number) for number in range(16)]

    def shot(self, otherwise: float = 0.0) -> Vec2d:
        """Return the velocity (m/s) of a shot now; its speed is that of the pull, or another."""
        aim = (self.pressed - self.balls[0].body.position).normalized()
        pull = min(max((self.pressed - self.mouse).dot(aim) / PULL, 0.0), 1.0)
        return aim * (FULL * pull * (not self.table.moving) or otherwise)

    def advance(self, seconds: float) -> None:
        """Let time (s) pass; when all balls rest, a pocketed cue ball comes back."""
        self.space.step(min(seconds, STEP))
        if not self.table.moving and not self.balls[0].is_on_table:
            self.table.place(self.balls[0], self.table.free_spot((LENGTH / 4, WIDTH / 2)))

    def handle(self, event: pygame.event.Event) -> None:
        """Do what the player asks for."""
        key = event.key if event.type == pygame.KEYDOWN else None
        self.is_open = self.is_open and event.type != pygame.QUIT and key != pygame.K_ESCAPE
        self.before = self.before[:1] if key == pygame.K_r else self.before
        if key in (pygame.K_u, pygame.K_r) and self.before:
            self.table.restore_state(self.before.pop())
        if "pos" in event.dict:
            self.mouse = Vec2d(*event.pos) * FINE / SCALE - Vec2d(ROOM, ROOM)
            if event.type == pygame.MOUSEBUTTONUP and self.shot().length > 0.05:
                self.before.append(self.table.save_state())
                self.table.strike(self.balls[0], self.shot())
            if event.type != pygame.MOUSEMOTION or not event.buttons[0]:
                self.pressed = self.mouse

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the table, the balls, and while all of them rest what the shot would do."""
        canvas, speed, cue = self.background.copy(), self.shot().length, self.balls[0]
        seen = None if self.table.moving else self.table.predict(cue, self.shot(FULL / 2))
        for line, color in ((seen.other_way or seen.way, GOLD), (seen.way, IVORY)) if seen else ():
            pygame.draw.lines(canvas, color, False, [pixel(point) for point in line], 3)
        for number, ball in self.balls.items():
            place = ball.body.position if ball.is_on_table else TRAY[number]
            canvas.blit(self.pictures[number], self.pictures[number].get_rect(center=pixel(place)))
        if seen:
            pygame.draw.circle(canvas, IVORY, pixel(seen.where or seen.way[-1]), RADIUS * SCALE, 3)
            away = -self.shot(1.0).normalized()
            for *ends, color in ((0.05, 0.07, IVORY), (0.07, 0.5, "tan"), (0.5, 0.8, "#5a2d18")):
                a, b = (cue.body.position + away * (end + speed / 30) for end in ends)
                s = away.perpendicular() * 0.006
                pygame.draw.polygon(canvas, color, [*map(pixel, (a - s, a + s, b + s, b - s))])
        pygame.draw.rect(canvas, GOLD, (*pixel((0, 1.2 * WIDTH)), LENGTH * SCALE * speed / FULL, 9))
        words = self.font.render(f"Pull: {speed:.1f} m/s   U undo   R rack   Esc quit", True, INK)
        canvas.blit(words, words.get_rect(midright=pixel((LENGTH, WIDTH + 0.2))))
        surface.blit(pygame.transform.smoothscale(canvas, surface.get_size()), (0, 0))


def main() -> None:
    """Play until the window is closed."""
    game, clock, surface = Game(), pygame.time.Clock(), pygame.display.set_mode(WINDOW)
    while game.is_open:
        for event in pygame.event.get():
            game.handle(event)
        game.advance(clock.tick(60) / 1000)
        game.draw(surface)
        pygame.display.flip()


if __name__ == "__main__":
    main()
