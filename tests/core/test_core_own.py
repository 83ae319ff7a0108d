"""Laws, pairs, surfaces and sides of a user's own play in the core."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pytest

import pool_pymunk
from pool_pymunk import NT, Ball, Friction, Law, Pair, Physics, Restitution, Scene, Table
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import Push, Rolling, Surface
from pool_pymunk.core.walls.face import face_between
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws import LAWS
from pool_pymunk.solvers.event_driven import solve
from pool_pymunk.solvers.record import Settings
from tests.shared.core_scenes import parts_of

R = 0.05  # m
CORNERS = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))


def scene(kind: type[Scene] = Scene, table: Table | None = None, law: str = "coulomb") -> Scene:
    """Return a shot at two balls on a table."""
    balls = (
        Ball("C", (0.5, 0.5), R, 0.2, cue=True, velocity=(2.0, 0.1)),
        Ball("1", (1.0, 0.53), R, 0.2),
        Ball("2", (1.5, 0.3), R, 0.2),
    )
    rough, losses = Friction(0.1, 0.2, 0.1), Restitution(0.9, None, 0.7)
    return kind(balls, table or Table(CORNERS), losses, rough, Physics(law))


def into_a_corner(table: Table) -> Scene:
    """Return a ball that comes to the cushions at the bottom and on the right at one instant."""
    balls = (Ball("C", (1.45, 0.55), R, 0.2, velocity=(1.0, -1.0)),)
    return Scene(balls, table, Restitution(0.9, None, 0.7), physics=Physics(max_time=1.0))


def at_once() -> Scene:
    """Return a ball that hits two others at one instant, of which one hits a cushion."""
    far = 2.0 * R * math.sqrt(0.75)
    balls = (
        Ball("C", (1.95 - far - 0.3, 0.5), R, 0.2, velocity=(2.0, 0.0)),
        Ball("1", (1.95 - 0.2, 0.5 + R), R, 0.2),
        Ball("2", (1.95 - 0.2, 0.5 - R), R, 0.3),
    )
    return Scene(balls, Table(CORNERS), Restitution(0.9, None, 0.7), Friction(0.1, 0.2, 0.1))


def in_a_corner(kind: type[Scene] = Scene) -> Scene:
    """Return a heavy ball that squeezes a light one into a corner: their hits have no end."""
    balls = (
        Ball("a", (R, R), R, 0.001),
        Ball("b", (R + 2.0 * R / math.sqrt(2.0), R + 2.0 * R / math.sqrt(2.0)), R, 0.2,
             velocity=(-1.0, -1.0)),
    )  # fmt: skip
    return kind(balls, Table(CORNERS), Restitution(0.5, None, 0.5), Friction(0.1, 0.2, 0.1))


def played(where: Scene, law: Law | None = None) -> Any:
    """Return all that the core makes of a scene, in floats, or the error that it raises."""
    settings = Settings(None, law=law, max_events=40, max_time=2.0)
    try:
        trace = solve(where, where.start(None), settings)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return in_floats(list(parts_of(trace).values()))


def in_floats(what: Any) -> Any:
    """Return the same lists with floats in place of numbers of other types."""
    if isinstance(what, list | tuple):
        return [in_floats(each) for each in what]
    return float(what) if isinstance(what, int | float | np.generic) else what


def made(where: Scene, law: Law | None = None) -> str:
    """Return what the core makes of a scene and a law, in words."""
    return repr(played(where, law))


def own(name: str, method: Any) -> Law:
    """Return a law with one method, or one property, of a user's own."""
    law: Law = type("Own", (Law,), {name: method})()
    return law


# -- what a user's law is asked --------------------------------------------------------------------


class Listening(Law):
    """This law notes what it is asked."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        self.asked.append(repr((a, b, pair)))
        return super().ball_ball(a, b, pair)

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        self.asked.append(repr((v, restitution, friction)))
        return super().cushion(v, restitution, friction)

    def together(self, contacts: Any, velocity: Any, respond: Any) -> None:
        self.asked.append(repr((type(contacts), contacts, velocity)))
        super().together(contacts, velocity, respond)
        self.asked.append(repr(velocity))


@pytest.mark.parametrize("make", [scene, at_once, in_a_corner])
def test_a_law_is_asked_by_named_tuples(make: Callable[[], Scene]) -> None:
    law = Listening()
    assert "Error: " not in made(make(), law)
    assert len(law.asked) > 1
    assert any("Contact(" in each for each in law.asked) == (make is not scene)


# -- what a user's law answers ---------------------------------------------------------------------

NOTHING_OF_A_VELOCITY: dict[str, Any] = {
    "None": None, "a str": "ab", "a number": 1.0, "a NumPy number": np.float64(1.0), "an int": 1,
    "a pair": (1.0, 2.0), "three": (1.0, 0.0, 2.0), "a list": [1.0, 2.0],
    "strs": NT("a", "b"), "Nones": NT(None, 0.0), "too large": NT(10**400, 0.0),  # type: ignore
}  # fmt: skip
NUMBERS: dict[str, Callable[[float], Any]] = {
    "NumPy": np.float64,
    "ints": int,
    "NumPy's ints": np.int64,
}


@pytest.mark.parametrize("answer", NOTHING_OF_A_VELOCITY)
@pytest.mark.parametrize("method", ["cushion", "ball_ball", "the second of ball_ball"])
def test_a_law_that_answers_no_velocity_gets_an_error(method: str, answer: str) -> None:
    value = NOTHING_OF_A_VELOCITY[answer]
    if method.startswith("the second"):
        value = NT(1.0, 0.0), value
    law = own(method.rpartition(" ")[2], lambda *_: value)
    one = made(scene(), law)
    assert "Error: " in one


@pytest.mark.parametrize("kind", NUMBERS)
def test_a_law_may_answer_numbers_of_any_type(kind: str) -> None:
    def nt(v: NT) -> NT:
        return NT(*map(NUMBERS[kind], v))

    def ball_ball(_: Law, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        after = Law().ball_ball(a, b, pair)
        return nt(after[0]), nt(after[1])

    def cushion(_: Law, *asked: Any) -> NT:
        return nt(Law().cushion(*asked))

    for law in (own("ball_ball", ball_ball), own("cushion", cushion)):
        one = made(scene(), law)
        assert "Error: " not in one


@pytest.mark.parametrize("answer", [None, 0, 1, "", "yes", 1.0, (1,), np.True_, np.False_])
def test_whether_a_law_jumps_may_be_a_truth_value_or_a_whole_number(answer: Any) -> None:
    is_refused = bool(answer) and not isinstance(answer, int | np.bool_)
    for make in (scene, at_once):
        one = made(make(), own("jumps", lambda *_: answer))
        assert ("Error: " in one) == is_refused


def leaving(left: Any) -> Law:
    """Return a law that leaves something in place of a velocity, where contacts come at once."""

    def together(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
        for contact in contacts:
            respond(contact, velocity)
        velocity[contacts[0].a] = left

    return own("together", together)


@pytest.mark.parametrize("answer", NOTHING_OF_A_VELOCITY)
def test_a_law_that_leaves_no_velocity_gets_an_error(answer: str) -> None:
    one = made(at_once(), leaving(NOTHING_OF_A_VELOCITY[answer]))
    assert ("Error: " in one) == (answer not in ("a pair", "three", "a list"))


@pytest.mark.parametrize("left", [NT(0.5, 0.25), (1, 0), [0.5, 0.0], (np.float64(0.5), 0)])
def test_a_law_may_leave_any_two_numbers(left: Any) -> None:
    one = made(at_once(), leaving(left))
    assert "Error: " not in one


def deletes(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
    del velocity[contacts[0].a]


def answers_nothing(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
    respond(None, velocity)


def answers_others(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
    for contact in contacts:
        respond(contact._replace(a=7), velocity)


def raises(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
    raise RuntimeError("no answer")


@pytest.mark.parametrize("together", [deletes, answers_nothing, answers_others, raises])
def test_a_law_that_fails_at_once_gets_an_error(together: Any) -> None:
    one = made(at_once(), own("together", together))
    assert "Error: " in one


def smooth(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
    """Answer other contacts than those that were asked: without friction."""
    for contact in contacts:
        respond(contact._replace(pair=contact.pair._replace(friction=0.0)), velocity)


def elsewhere(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
    """Answer with velocities of one's own, and take the last ones over."""
    mine = dict(velocity)
    for contact in reversed(contacts):
        respond(contact, mine)
    velocity.update(mine)


@pytest.mark.parametrize("together", [smooth, elsewhere])
def test_a_law_may_answer_at_once_as_it_likes(together: Any) -> None:
    for make in (at_once, in_a_corner):
        one = made(make(), own("together", together))
        assert "Error: " not in one


def test_a_law_that_solves_as_coulomb_does_has_its_impulses() -> None:
    law = own("together", type(LAWS["coulomb"]).together)
    one = made(at_once(), law)
    assert "Error: " not in one


# -- pairs -----------------------------------------------------------------------------------------

PAIRS: dict[str, Any] = {
    "None": None, "a str": "abcd", "three": (1.0, 2.0, 3.0), "a tuple": (0.2, 0.2, 0.9, 0.1),
    "strs": Pair("a", "b", "c", "d"), "no restitution": Pair(0.2, 0.2, None, 0.1),  # type: ignore
    "friction in words": Pair(0.2, 0.2, 0.9, "a"), "a number": 1.0,  # type: ignore
}  # fmt: skip


@dataclass(frozen=True)
class WithPair(Scene):
    """This scene has a pair of its own."""

    def pair(self, i: int, j: int) -> Pair:
        asked.append((i, j))
        found: Pair = given[0](self, i, j)
        return found


given: list[Any] = [None]
asked: list[tuple[int, int]] = []


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("answer", PAIRS)
def test_what_is_no_pair_gets_an_error(answer: str, law: str) -> None:
    given[0] = lambda *_: PAIRS[answer]
    one = made(scene(WithPair, law=law), None)
    assert "Error: " in one


@pytest.mark.parametrize("kind", ["floats", "NumPy", "ints"])
def test_pairs_of_a_scene_have_numbers_of_any_type(kind: str) -> None:
    number: Any = {"floats": float, "NumPy": np.float64, "ints": math.ceil}[kind]
    given[0] = lambda _, i, j: Pair(*map(number, (0.2 + i, 0.2 + j, 0.5 + 0.1 * j, 0.1)))
    one = made(scene(WithPair), None)
    assert one != made(scene())


def test_a_scene_is_asked_once_in_a_run_for_each_two_balls() -> None:
    given[0] = Scene.pair
    where, counts = in_a_corner(WithPair), list[list[tuple[int, int]]]()
    for _ in range(2):  # Another run asks again.
        asked.clear()
        played(where)
        counts.append(list(asked))
    assert counts == [[(0, 1)]] * 2


# -- sides -----------------------------------------------------------------------------------------


class Odd(Side):
    """This side is a face whose answers are of another type."""

    def __init__(self, answer: Callable[..., Any]) -> None:
        self.face, self.answer = face_between((2.0, 0.0), (2.0, 1.0)), answer

    def time_of_contact(self, path: Path, r: float, now: float) -> Any:
        return self.answer(self.face.time_of_contact(path, r, now))

    def gap(self, x: float, y: float, r: float) -> Any:
        return self.answer(self.face.gap(x, y, r))

    def normal(self, x: float, y: float) -> Any:
        return tuple(map(self.answer, self.face.normal(x, y)))

    def curvature(self, x: float, y: float) -> Any:
        return self.answer(self.face.curvature(x, y))


def with_side(side: Any) -> Table:
    """Return a table whose cushion on the right has this side."""

    class Own(Table):
        @cached_property
        def walls(self) -> tuple[Wall, ...]:
            plain = Table(CORNERS).walls
            return (plain[0], Wall([side], 0.0, 0.0, 1), *plain[2:])

    return Own(CORNERS)


def test_a_side_may_answer_numbers_of_numpy() -> None:
    for make in (lambda table: scene(table=table), into_a_corner):
        plain = made(make(Table(CORNERS)))
        assert made(make(with_side(Odd(np.float64)))) == plain
        assert "Error: " not in plain


# -- surfaces --------------------------------------------------------------------------------------


class OddSurface(Surface):
    """Balls slide, then roll; cushions take all of a roll; answers are of another type."""

    def __init__(self, answer: Callable[[float], Any] = float) -> None:
        super().__init__(1.0, 0.1, True)
        self.usual, self.answer = Rolling(1.0, 0.1), answer

    def path(self, t: float, place: Any, velocity: Any, roll: Any) -> Path:
        return self._like(self.usual.path(t, place, velocity, roll))

    def then(self, path: Path) -> Path | None:
        then = self.usual.then(path)
        return None if then is None else self._like(then)

    def roll(self, path: Path, t: float) -> Any:
        return tuple(map(self.answer, self.usual.roll(path, t)))

    def roll_after(self, path: Path, t: float, pushes: list[Push]) -> Any:
        return (0.0, 0.0)

    def _like(self, path: Path) -> Path:
        p, as_one = path, self.answer
        return Path(
            as_one(p.t), as_one(p.x), as_one(p.y), as_one(p.vx), as_one(p.vy), as_one(p.ax),
            as_one(p.ay), as_one(p.end), p.slows, as_one(p.wx), as_one(p.wy),
        )  # fmt: skip


@dataclass(frozen=True)
class OnSurface(Scene):
    """This scene has a surface of its own."""

    @property
    def surface(self) -> Any:
        return given[0]


def on_surface(surface: Surface) -> str:
    """Return what the core makes of the scene on this surface."""
    given[0] = surface
    return made(scene(OnSurface))


def test_a_surface_says_how_cushions_slow_a_roll() -> None:
    assert on_surface(OddSurface()) != on_surface(Rolling(1.0, 0.1))


def test_a_surface_may_give_numbers_of_numpy() -> None:
    assert "Error: " not in on_surface(OddSurface())
    assert on_surface(OddSurface(np.float64)) == on_surface(OddSurface())


# -- plain Python ----------------------------------------------------------------------------------


@pytest.mark.skipif(not pool_pymunk.compiled, reason="the core is not compiled here")
def test_plain_python_raises_the_same_errors() -> None:
    command = [sys.executable, "-m", "pytest", "-q", __file__]
    plain = {**os.environ, "POOL_PYMUNK_PURE": "1"}
    ran = subprocess.run(command, env=plain, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout
