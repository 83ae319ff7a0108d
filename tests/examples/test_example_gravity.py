"""The examples with gravity: what they show is so."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.shared.scenes import example
from tests.shared.windows import pygame

plinko, pinball = map(example, ("plinko", "pinball"))


@pytest.fixture(autouse=True)
def fonts() -> Iterator[None]:
    """Have the fonts of pygame."""
    pygame.font.init()
    yield
    pygame.quit()


def test_balls_of_the_plinko_board_lie_in_bins_around_the_middle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = plinko.main(["--balls", "100", "--out", str(tmp_path)])
    assert (tmp_path / "plinko.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().out.startswith("bin  balls  an ideal board\n -5")
    bins = np.arange(11) - 5
    assert found.sum() == 100
    assert abs((found * bins).sum() / 100) < 0.65  # four times the deviation of a mean
    assert 1.3 < np.sqrt((found * bins**2).sum() / 100) < 2.6
    assert plinko.ideal().sum() == pytest.approx(1.0)


def test_a_flipper_keeps_the_ball_in_play_and_bumpers_count() -> None:
    game, surface = pinball.Game(), pygame.Surface(pinball.SIZE)
    for k in range(600):
        for flipper in game.flippers:
            x = flipper.body.position.x
            flipper.is_up = any(
                ball.body.position.y < 0.2
                and abs(ball.body.position.x - x - flipper.side * 0.05) < 0.06
                for ball in game.table.on_table
            )
        game.advance()
        for ball in game.table.on_table:
            assert -0.001 < ball.body.position.x < pinball.WIDE + 0.001
        if k % 100 == 0:
            game.draw(surface)
    assert game.table.count == 1 and game.score > 0


def test_a_ball_drains_between_flippers_that_rest_and_space_drops_another() -> None:
    game = pinball.Game()
    for _ in range(120 * 30):
        game.advance()
        if not game.table.count:
            break
    assert game.table.count == 0
    game.handle(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE))
    assert game.table.count == 1
    game.handle(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_LEFT))
    assert [flipper.is_up for flipper in game.flippers] == [True, False]
