"""The pool game does what its player asks for, and its balls go where the exact solver has them."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pool_pymunk import Run, Shot, load, simulate
from pool_pymunk.world import ContactEvent
from tests.shared.scenes import example
from tests.shared.windows import frames_of, pygame

BREAK = (1.905, 0.64)  # m; aiming there hits the apex ball nearly full
Point = tuple[float, float]


pool_game = example("pool_game")


@pytest.fixture
def game() -> Iterator[Any]:
    """Return a game with the balls racked."""
    yield pool_game.Game()
    pygame.quit()


# -- what the player does --------------------------------------------------------------------------


def mouse(game: Any, kind: int, place: Point, *, button: int = 1, held: bool = False) -> None:
    """Let the mouse do something at a place on the table (m), to the nearest pixel."""
    x, y = pool_game.pixel(place) / pool_game.FINE
    what = {"buttons": (held, 0, 0)} if kind == pygame.MOUSEMOTION else {"button": button}
    game.handle(pygame.event.Event(kind, {"pos": (round(x), round(y)), **what}))


def press(game: Any, key: int) -> None:
    game.handle(pygame.event.Event(pygame.KEYDOWN, key=key))


def aim(game: Any, target: Point) -> None:
    mouse(game, pygame.MOUSEMOTION, target)


def pull(game: Any, target: Point, length: float) -> Point:
    """Aim at a target, press there, and pull back so far (m); return where the mouse is then."""
    cue = game.balls[0].body.position
    share = length / math.dist(cue, target)
    back = (target[0] + share * (cue.x - target[0]), target[1] + share * (cue.y - target[1]))
    aim(game, target)
    mouse(game, pygame.MOUSEBUTTONDOWN, target)
    mouse(game, pygame.MOUSEMOTION, back, held=True)
    return back


def shoot(game: Any, target: Point, length: float) -> Point:
    """Shoot at a target; return the velocity (m/s) of the shot."""
    back = pull(game, target, length)
    velocity = game.shot()
    mouse(game, pygame.MOUSEBUTTONUP, back)
    return (velocity.x, velocity.y)


def play(game: Any, seed: int = 0) -> None:
    """Let frames of any length pass, some of them longer than a step may be, until all rest."""
    rnd = random.Random(seed)
    while game.table.moving:
        game.advance(rnd.uniform(0.001, 0.05))


def draw(game: Any) -> None:
    game.draw(pygame.Surface(pool_game.WINDOW))


def places(game: Any) -> dict[int, Point]:
    """Return where the balls on the table are (m)."""
    return {k: tuple(ball.body.position) for k, ball in game.balls.items() if ball.is_on_table}


def set_up(game: Any, **balls: Point) -> None:
    """Leave only these balls on the table, named ball0, ball1 and so on, at these places (m)."""
    for number, ball in game.balls.items():
        if f"ball{number}" in balls:
            game.table.place(ball, balls[f"ball{number}"])
        else:
            game.table.remove_ball(ball)


# -- a break ---------------------------------------------------------------------------------------


def exact(velocity: Point) -> Run:
    """Play the same shot of the same scene without steps."""
    shot = Shot("mine", "cue", velocity=velocity)
    return simulate(replace(load("eight-ball"), shots=(shot,)), shot, solver="event-driven")


@pytest.mark.parametrize("length", [0.2, 0.3, 0.48])
def test_a_break_ends_where_the_exact_solver_has_it(game: Any, length: float) -> None:
    before = places(game)
    run = exact(shoot(game, BREAK, length))
    assert run.rounding < 1e-9  # Else the ends would mean nothing.
    play(game)
    after = places(game)
    assert sum(math.dist(before[k], after[k]) > 0.01 for k in after) > 8
    ids = ["cue", *map(str, range(1, 16))]
    assert {ids[k] for k in range(16) if k not in after} == set(run.pocketed)
    assert max(math.dist(after[k], run.final[ids[k]]) for k in after) < 1e-9


def test_time_is_that_of_the_clock_but_for_long_frames(game: Any) -> None:
    shoot(game, BREAK, 0.3)
    for seconds in (0.001, 0.016, 0.017, 1.0):
        game.advance(seconds)
    assert game.table.time == pytest.approx(0.034 + pool_game.STEP, abs=1e-12)


# -- undo and a new rack ---------------------------------------------------------------------------


def test_undo_puts_everything_back_shot_by_shot(game: Any) -> None:
    seen = [(places(game), game.table.time)]
    for target in (BREAK, (0.0, 0.1), (2.5, 0.4)):
        shoot(game, target, 0.4)
        play(game)
        seen.append((places(game), game.table.time))
    for before in reversed(seen[:-1]):
        press(game, pygame.K_u)
        assert (places(game), game.table.time) == before
    press(game, pygame.K_u)
    assert (places(game), game.table.time) == seen[0]


def test_undo_while_balls_move_and_the_same_shot_again(game: Any) -> None:
    shoot(game, BREAK, 0.3)
    play(game)
    first = places(game)
    press(game, pygame.K_u)
    shoot(game, BREAK, 0.3)
    for _ in range(30):
        game.advance(1 / 60)
    press(game, pygame.K_u)
    assert not game.table.moving
    shoot(game, BREAK, 0.3)
    play(game, seed=1)
    again = places(game)
    assert again.keys() == first.keys()
    assert max(math.dist(again[k], first[k]) for k in again) < 1e-9


def test_a_new_rack(game: Any) -> None:
    racked = places(game)
    press(game, pygame.K_r)
    assert places(game) == racked
    for target in (BREAK, (0.0, 0.1)):
        shoot(game, target, 0.4)
        play(game)
    press(game, pygame.K_r)
    assert places(game) == racked
    press(game, pygame.K_u)
    assert places(game) == racked


# -- pockets ---------------------------------------------------------------------------------------


def test_a_pocketed_ball_is_off_the_table_until_undo(game: Any) -> None:
    set_up(game, ball0=(0.8, 0.8), ball9=(0.3, 0.3))
    stripe = game.balls[9]
    shoot(game, (0.3, 0.3), 0.25)
    play(game)
    assert not stripe.is_on_table
    assert stripe.body not in game.space.bodies
    assert 0 in places(game)
    press(game, pygame.K_u)
    assert places(game) == {0: (0.8, 0.8), 9: (0.3, 0.3)}


@pytest.mark.parametrize("blocked", [False, True])
def test_a_pocketed_cue_ball_comes_back_at_the_head_spot_or_beside_it(
    game: Any, blocked: bool
) -> None:
    head = (pool_game.LENGTH / 4, pool_game.WIDTH / 2)
    set_up(game, ball0=(2.2, 0.3), ball5=head if blocked else (1.0, 1.0))
    cue, seen = game.balls[0], list[dict[int, Point]]()
    for target in ((2.54, 0.0), (2.54, 0.0), (2.0, 0.9)):
        seen.append(places(game))
        shoot(game, target, 0.12)
        game.advance(1 / 60)
        assert game.table.moving
        play(game)
        assert cue.is_on_table
    for before in seen[1:]:
        away = math.dist(before[0], head)
        assert away == pytest.approx(2.0 * pool_game.RADIUS if blocked else 0.0, abs=1e-6)
    assert math.dist(cue.body.position, head) > 0.1
    for before in reversed(seen):
        press(game, pygame.K_u)
        assert places(game) == before
    assert len(game.table.balls) == 16


def test_a_cue_ball_that_is_pocketed_while_others_move_waits_for_them(game: Any) -> None:
    set_up(game, ball0=(2.3, 0.2), ball1=(0.5, 0.6))
    game.table.strike(game.balls[1], (1.0, 0.0))
    game.table.strike(game.balls[0], (1.0, -1.0))
    while game.balls[0].is_on_table:
        game.advance(1 / 60)
    for _ in range(10):
        game.advance(1 / 60)
        draw(game)
        assert not game.balls[0].is_on_table
    play(game)
    assert game.balls[0].is_on_table


# -- the aiming line -------------------------------------------------------------------------------


def drawn(game: Any, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Draw a frame, and return the predictions that it shows."""
    shown: list[Any] = []
    predict = game.table.predict

    def noted(*shot: Any) -> Any:
        shown.append(predict(*shot))
        return shown[-1]

    with monkeypatch.context() as patch:
        patch.setattr(game.table, "predict", noted)
        draw(game)
    return shown


def note(met: list[tuple[ContactEvent, Point]], cue: Any, event: ContactEvent) -> None:
    """Note a contact of the cue ball, and where the cue ball was then."""
    if cue in event.balls:
        met.append((event, cue.path.at(event.t)[0]))


def test_the_line_says_what_is_met_and_where(game: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cue ball's real first contact is with the same ball or wall, at the same place."""
    shoot(game, BREAK, 0.36)
    play(game)
    rnd, kinds = random.Random(7), set()
    for _ in range(30):
        cue, met = game.balls[0], list[tuple[ContactEvent, Point]]()
        target = (rnd.uniform(0.0, 2.54), rnd.uniform(0.0, 1.27))
        back = pull(game, target, rnd.uniform(0.2, 0.5))
        [seen] = drawn(game, monkeypatch)
        game.table.on_contact = partial(note, met, cue)
        mouse(game, pygame.MOUSEBUTTONUP, back)
        assert drawn(game, monkeypatch) == []  # Balls move.
        while not met and cue.is_on_table and game.table.moving:
            game.advance(1 / 60)
        assert met or seen.pocket is not None
        if met:
            event, ghost = met[0]
            other = next((ball for ball in event.balls if ball is not cue), None)
            assert (seen.met, seen.wall) == (other, event.wall)
            assert math.dist(ghost, seen.where) < 1e-9
            if other is not None:
                assert math.dist(seen.where, seen.other_way[0]) == pytest.approx(
                    2.0 * pool_game.RADIUS, abs=1e-9
                )
        kinds.add("ball" if seen.met else "wall" if seen.wall is not None else "pocket")
        press(game, pygame.K_u)
    assert kinds >= {"ball", "wall"}


def test_a_mouse_on_the_cue_ball_aims_nowhere(game: Any) -> None:
    game.mouse = game.pressed = game.balls[0].body.position
    draw(game)
    mouse(game, pygame.MOUSEBUTTONUP, tuple(game.mouse))
    assert game.before == []


# -- shots -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("length", "share"), [(0.1, 0.2), (0.25, 0.5), (0.5, 1.0), (0.8, 1.0)])
def test_the_pull_is_the_speed(game: Any, length: float, share: float) -> None:
    pull(game, BREAK, length)
    assert game.shot().length == pytest.approx(share * pool_game.FULL, abs=0.05)


def test_no_shot_without_a_pull_nor_while_balls_move(game: Any) -> None:
    aim(game, BREAK)
    for button in (1, 2, 3, 4):
        mouse(game, pygame.MOUSEBUTTONDOWN, BREAK, button=button)
        mouse(game, pygame.MOUSEBUTTONUP, BREAK, button=button)
    mouse(game, pygame.MOUSEBUTTONDOWN, BREAK)
    mouse(game, pygame.MOUSEBUTTONUP, (2.3, 0.65))  # This pushes instead of pulling.
    assert not game.table.moving and game.before == []
    shoot(game, BREAK, 0.3)
    game.advance(1 / 60)
    assert shoot(game, (0.5, 0.1), 0.4) == (0.0, 0.0)
    assert len(game.before) == 1


# -- the window ------------------------------------------------------------------------------------


def test_the_window_opens_plays_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame.display.init()
    escape = pygame.event.Event(pygame.KEYDOWN, key=pygame.K_ESCAPE)
    frames = frames_of(monkeypatch, pool_game.Game, escape)
    pool_game.main()
    assert len(frames) == 4
    assert all(0.0 < seconds < 1.0 for seconds in frames)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    pool_game.main()
    assert len(frames) == 5
    pygame.quit()


def test_the_file_is_one_page() -> None:
    assert len(Path(pool_game.__file__).read_text(encoding="utf-8").splitlines()) < 150
