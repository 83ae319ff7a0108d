"""Air hockey and mini golf: walls that move, and patches, as a game has them."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from typing import Any

import pytest
from pymunk import Vec2d

from tests.shared.scenes import example
from tests.shared.windows import pygame

air_hockey, mini_golf = map(example, ("air_hockey", "mini_golf"))


@pytest.fixture(autouse=True)
def fonts() -> Iterator[None]:
    """Have the fonts of pygame."""
    pygame.font.init()
    yield
    pygame.quit()


def mouse(game: Any, kind: int, place: tuple[int, int]) -> None:
    """Let the mouse do something at a pixel of the window."""
    game.handle(pygame.event.Event(kind, {"pos": place, "button": 1}))


@pytest.mark.parametrize("seed", range(3))
def test_no_puck_gets_behind_a_mallet_or_through_a_rail(seed: int) -> None:
    """The mouse jumps about; the mallet follows it as fast as it can."""
    rnd, game = random.Random(seed), air_hockey.Game()
    for k in range(600):
        if k % 11 == 0:
            place = rnd.randrange(air_hockey.SIZE[0]), rnd.randrange(air_hockey.SIZE[1])
            mouse(game, pygame.MOUSEMOTION, place)
        game.advance()
        x, y = game.puck.body.position
        assert air_hockey.PUCK - 1e-6 <= y <= air_hockey.WIDTH - air_hockey.PUCK + 1e-6
        is_between = air_hockey.PUCK - 1e-6 <= x <= air_hockey.LENGTH - air_hockey.PUCK + 1e-6
        assert is_between or air_hockey.GAP <= y <= air_hockey.WIDTH - air_hockey.GAP
        assert game.puck.body.velocity.length < 50.0


def test_a_goal_counts_and_the_puck_comes_back() -> None:
    game = air_hockey.Game()
    game.table.strike(game.puck, (-3.0, 0.15))
    game.mouse = Vec2d(0.5, 0.05)
    for _ in range(120):
        game.advance()
    assert sum(game.goals) == 1
    assert 0.0 < game.puck.body.position.x < air_hockey.LENGTH


def test_a_mallet_drives_the_puck() -> None:
    game = air_hockey.Game()
    place = air_hockey.pixel(air_hockey.MIDDLE)
    mouse(game, pygame.MOUSEMOTION, (round(place.x), round(place.y)))
    for _ in range(40):
        game.advance()
    assert game.puck.body.velocity.length > 1.0 or game.puck.body.position.x > 1.2


def test_sand_stops_a_ball_that_the_green_would_not(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = []
    for pull in (mini_golf.SLOW, (mini_golf.SLIDES, mini_golf.ROLLS)):
        monkeypatch.setattr(mini_golf, "SLOW", pull)
        game = mini_golf.Game()
        game.mill.angular_velocity = 0.0
        game.table.place(game.ball, (1.6, 0.2))
        game.table.strike(game.ball, (1.2, 0.0), roll=1.0)
        for _ in range(300):
            game.advance()
        ends.append(game.ball.body.position.x)
    (edge, _), before = mini_golf.SAND[0], 1.44 - 2 * mini_golf.ROLLS * 0.3
    assert ends[0] == pytest.approx(edge + before / (2 * 2.5), abs=1e-9)
    assert ends[1] > 2.5


def test_the_windmill_hits_the_ball() -> None:
    game, hits = mini_golf.Game(), list[Any]()
    game.table.on_contact = hits.append
    game.table.place(game.ball, (mini_golf.MILL[0] + 0.2, mini_golf.MILL[1] + 0.05))
    for _ in range(120):
        game.advance()
    assert {hit.wall for hit in hits} & set(range(6, 10))
    assert game.ball.body.position.get_distance(mini_golf.MILL) > 0.25


def test_a_stroke_is_pulled_and_a_click_after_the_hole_begins_anew() -> None:
    game = mini_golf.Game()
    start = mini_golf.pixel(mini_golf.TEE)
    place = (round(start.x), round(start.y))
    mouse(game, pygame.MOUSEBUTTONDOWN, place)
    mouse(game, pygame.MOUSEMOTION, (place[0] - 60, place[1]))
    assert game.shot().x > 1.0
    mouse(game, pygame.MOUSEBUTTONUP, (place[0] - 60, place[1]))
    assert game.strokes == 1
    assert game.ball.body.velocity.x > 0.0
    game.table.place(game.ball, (mini_golf.HOLE[0], 1.45))
    game.table.strike(game.ball, (0.0, 0.8), roll=1.0)
    for _ in range(30):
        game.advance()
    assert game.is_in
    mouse(game, pygame.MOUSEBUTTONDOWN, place)
    assert (game.is_in, game.strokes) == (False, 0)
    assert math.dist(game.ball.body.position, mini_golf.TEE) < 1e-9


@pytest.mark.parametrize("module", [air_hockey, mini_golf])
def test_the_window_opens_and_closes(module: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    frames = list[int]()
    advance = module.Game.advance

    def watched(game: Any) -> None:
        frames.append(1)
        advance(game)
        if len(frames) == 3:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    monkeypatch.setattr(module.Game, "advance", watched)
    pygame.display.init()
    module.main()
    assert len(frames) >= 3
    assert len((module.__doc__ or "").splitlines()) > 3
