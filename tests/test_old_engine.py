"""The core plays what the contact engine that was before it plays, bit by bit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from typing import Any

import core_movers as movers
import pytest
from core_movers import New, Play, Pose, piston
from core_scenes import BUNDLED, Case, bundled_shot, by_core, case_of, names, own_shots
from old_engine import DIFFERS, NEEDLESS, RAISES, SAME, WRONG, played_beside, verdicts
from scenes import seeds, share_of

from pool_pymunk import NT, Law, Pair
from pool_pymunk.core.engine import Engine
from pool_pymunk.results.trace import Trace
from pool_pymunk.results.variants import Variant

SHOTS = 100  # random ones of each bundled scene
MANY = 5_000  # random scenes; they are played by the HANDFUL, of which a few are QUICK
HANDFUL, QUICK = 25, 24


def wrong(cases: Iterable[Case]) -> list[str]:
    """Return what is wrong with cases that both engines play."""
    found = [each for case in cases for each in verdicts(case)]
    return [f"{name}: {word} {said}" for name, word, said, _ in found if word in WRONG]


# -- the same bits as the contact engine -----------------------------------------------------------


@pytest.mark.parametrize("name", BUNDLED)
def test_the_own_shots_of_a_bundled_scene(name: str) -> None:
    assert wrong(own_shots(name)) == []


@pytest.mark.seeded
@pytest.mark.parametrize("share", [0.1, pytest.param(1.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", BUNDLED)
def test_random_shots_of_a_bundled_scene(name: str, share: float) -> None:
    shots = seeds(round(share * SHOTS))
    assert wrong(bundled_shot(name, seed) for seed in shots) == []


@pytest.mark.seeded
@pytest.mark.parametrize(
    "handful",
    [pytest.param(k, marks=[pytest.mark.slow] if k >= QUICK else [])
     for k in range(share_of(MANY // HANDFUL))],
)  # fmt: skip
def test_random_scenes_of_all_kinds(handful: int) -> None:
    chosen = islice(names(), HANDFUL * handful, HANDFUL * (handful + 1))
    assert wrong(case_of(name) for name in chosen) == []


class Raising(Law):
    """This law answers no hit of two balls."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        raise ValueError("nothing")


def own_case(name: str) -> Case:
    """Return the first shot of a bundled scene."""
    return next(iter(own_shots(name)))


def test_another_engine_is_found_to_differ() -> None:
    case = own_case("report")

    def found(play: Callable[..., Trace | None]) -> str:
        return verdicts(case, play)[0].word

    def rounded(scene: Any, start: Any, settings: Any) -> Trace | None:
        return by_core(scene, start, settings._replace(variant=Variant(seed=1)))

    def failing(*_: Any) -> Trace | None:
        raise ValueError("nothing")

    assert found(by_core) == SAME
    assert found(rounded) == DIFFERS
    assert found(failing) == DIFFERS
    assert found(lambda *_: None) == NEEDLESS
    raising = case._replace(settings=case.settings._replace(law=Raising()))
    assert verdicts(raising)[0].word == RAISES


# -- walls that move -------------------------------------------------------------------------------

MANY_PLAYS = 600  # random plays; they are played by the PLAYS, of which a few are QUICK
PLAYS, FIRST = len(movers.KINDS), 6


@pytest.mark.seeded
@pytest.mark.parametrize(
    "handful",
    [pytest.param(k, marks=[pytest.mark.slow] if k >= FIRST else [])
     for k in range(share_of(MANY_PLAYS // PLAYS))],
)  # fmt: skip
def test_random_walls_that_move(handful: int) -> None:
    """Balls are pushed, squeezed and jammed by discs, boxes and bars that slide, turn and kick."""
    chosen = islice(movers.names(), PLAYS * handful, PLAYS * (handful + 1))
    found = [played_beside(name, movers.play_of(name)) for name in chosen]
    assert [each for each in found if each.word in WRONG] == []


# These plays have what walls that move bring about.
WITH = {
    "jam": "wedged 8", "collapse": "turned 22", "roll": "turned 58", "patch": "thrown 38",
    "pocket": "turned 47", "order": "wedged 8", "zero slip": "wedged 13", "stop": "thrown 57",
}  # fmt: skip


@pytest.mark.parametrize("what", WITH)
def test_what_walls_that_move_bring_about(what: str) -> None:
    found = played_beside(WITH[what], movers.play_of(WITH[what]))
    assert found.word == SAME
    assert what in found.heard


# Each of these plays ends otherwise if one thing is changed that hardly any other one shows. A wall
# may kick a ball again once the ball is fast; a wall that goes through a ball hits it no more; many
# hits, many meetings or a high speed jam a ball; a touch is found to the last bit; a wall that
# turns lifts a ball; the hits of a wall that moves are no collapse.
RARE = ("pressed 359", "wedged 37", "thrown 139", "pressed 516", "turned 68", "wedged 11")


@pytest.mark.parametrize("name", RARE)
def test_what_hardly_any_play_shows(name: str) -> None:
    found = played_beside(name, movers.play_of(name))
    assert found.word not in WRONG, found


class Late(New):
    """In this engine steps begin without a look at the walls."""

    def __init__(self, play: Play) -> None:
        super().__init__(play)
        self.engine = Forgetful(self.engine)  # type: ignore[assignment]


class Forgetful:
    """This engine plays on, but predicts nothing anew when a step begins."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    def begin_step(self, now: float) -> None:
        self.engine.now = now

    def __getattr__(self, name: str) -> Any:
        return getattr(self.engine, name)


class Kicking(New):
    """In this engine all walls that move kick a little more."""

    def __init__(self, play: Play) -> None:
        movers = [mover._replace(kick=mover.kick + 1e-9) for mover in play.movers]
        super().__init__(play._replace(movers=tuple(movers)))


class Giving(New):
    """In this engine contacts begin to persist where there are none."""

    def step(self, since: float, until: float, poses: Sequence[Pose]) -> bool:
        return super().step(since, until, poses) and since < 0.1


@pytest.mark.parametrize(
    ("engine", "word"), [(New, SAME), (Late, DIFFERS), (Kicking, DIFFERS), (Giving, NEEDLESS)]
)
def test_other_walls_are_found_to_differ(engine: type[New], word: str) -> None:
    assert played_beside("", piston(0.9, 1.0 / 60.0, 1.0), engine).word == word
