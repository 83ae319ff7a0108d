"""The carrom game does what its player asks for, and its discs go where they should."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pool_pymunk import Shot, load, simulate
from tests.shared.scenes import example
from tests.shared.windows import frames_of, pygame

carrom_game = example("carrom_game")
LINE = 0.1174
Point = tuple[float, float]


@pytest.fixture
def game() -> Iterator[Any]:
    """Return a game with the men in their circle."""
    pygame.font.init()
    yield carrom_game.Game()
    pygame.quit()


def mouse(game: Any, kind: int, place: Point, *, held: bool = False) -> None:
    """Let the mouse do something at a place on the board (m), to the nearest pixel."""
    x, y = carrom_game.pixel(place)
    what = {"buttons": (held, 0, 0)} if kind == pygame.MOUSEMOTION else {"button": 1}
    game.handle(pygame.event.Event(kind, {"pos": (round(x), round(y)), **what}))


def drag(game: Any, start: Point, end: Point) -> Point:
    """Press at a place, move the mouse to another and let go; return where the striker is then."""
    mouse(game, pygame.MOUSEMOTION, start)
    mouse(game, pygame.MOUSEBUTTONDOWN, start)
    mouse(game, pygame.MOUSEMOTION, end, held=True)
    mouse(game, pygame.MOUSEBUTTONUP, end)
    return tuple(game.striker.body.position)


def play(game: Any) -> None:
    """Let frames pass until the striker is back."""
    for _ in range(500):
        if not game.is_aiming:
            game.advance(1 / 50)
    assert game.is_aiming


def places(game: Any) -> dict[str, Point]:
    """Return where the discs on the board are (m)."""
    return {disc.id: tuple(disc.body.position) for disc in game.discs if disc.is_on_table}


def test_the_striker_is_dragged_along_the_base_line(game: Any) -> None:
    at = game.striker.body.position
    for x, least, most in ((0.46, 0.459, 0.461), (0.0, 0.1509, 0.1509), (0.74, 0.5891, 0.5891)):
        at = drag(game, at, (x, 0.3))
        assert at[1] == LINE
        assert least - 1e-12 <= at[0] <= most + 1e-12
    assert game.is_aiming


def test_the_striker_lies_beside_a_man_on_the_base_line(game: Any) -> None:
    man = game.discs[1]
    game.table.place(man, (0.3, LINE + 0.01))
    x, y = drag(game, game.striker.body.position, (0.3, LINE))
    apart = math.dist((x, y), man.body.position) - man.radius - game.striker.radius
    assert y == LINE
    assert 0.0 < apart < 0.002


def test_a_break_ends_where_the_exact_solver_has_it(game: Any) -> None:
    drag(game, game.striker.body.position, (0.46, LINE))
    start = tuple(game.striker.body.position)
    mouse(game, pygame.MOUSEMOTION, (0.424, 0.339))
    mouse(game, pygame.MOUSEBUTTONDOWN, (0.424, 0.339))
    mouse(game, pygame.MOUSEMOTION, (0.459, 0.125), held=True)
    velocity = tuple(game.shot())
    assert math.hypot(*velocity) == pytest.approx(carrom_game.FULL)
    mouse(game, pygame.MOUSEBUTTONUP, (0.459, 0.125))
    assert not game.is_aiming
    shot = Shot("mine", "S", velocity=velocity, place=start)
    run = simulate(replace(load("carrom"), shots=(shot,)), shot, solver="event-driven")
    assert run.rounding < 1e-9  # Else the ends would mean nothing.
    play(game)
    after = places(game)
    assert after.pop("S")[1] == LINE
    assert {ball.id for ball in run.scene.balls} - {"S"} - after.keys() == set(run.pocketed)
    assert run.pocketed
    assert max(math.dist(after[id_], run.final[id_]) for id_ in after) < 1e-9


def test_a_pocketed_striker_comes_back_and_pocketed_men_are_counted(
    game: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    real = pygame.font.Font

    class Watched:
        def __init__(self, *about: Any) -> None:
            self.font = real(*about)

        def render(self, text: str, *about: Any) -> Any:
            said.append(text)
            return self.font.render(text, *about)

    monkeypatch.setattr(pygame.font, "Font", Watched)
    surface = pygame.Surface(carrom_game.SIZE)
    game.draw(surface)
    by_id = {disc.id: disc for disc in game.discs}
    game.table.place(by_id["W1"], (0.65, 0.65))
    game.table.strike(by_id["W1"], (0.8, 0.8))
    game.table.place(game.striker, (0.65, 0.09))
    game.table.strike(game.striker, (1.2, -1.2))
    game.is_aiming = False
    for _ in range(3):
        game.advance(1 / 50)
    assert not game.striker.is_on_table
    game.draw(surface)
    play(game)
    assert places(game)["S"] == pytest.approx((0.37, LINE), abs=1e-3)
    assert "W1" not in places(game)
    game.draw(surface)
    assert said[0] == "White 0   Black 0   Queen 0"
    assert said[-1] == "White 1   Black 0   Queen 0"


def test_the_window_opens_plays_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame.display.init()
    frames = frames_of(monkeypatch, carrom_game.Game, pygame.event.Event(pygame.QUIT))
    carrom_game.main()
    assert len(frames) == 4
    pygame.quit()


def test_the_file_is_short() -> None:
    assert len(Path(carrom_game.__file__).read_text(encoding="utf-8").splitlines()) < 120
