"""Laws, pairs, surfaces and sides of a user's own play in the core as in the contact engine."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from core_scenes import by_core, parts_of

import pool_pymunk
from pool_pymunk import NT, Ball, Friction, Law, Pair, Physics, Restitution, Scene, Table
from pool_pymunk.laws import LAWS
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.sides import Wall, face_between
from pool_pymunk.physics.surface import Rolling, Sliding
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers import grouped
from pool_pymunk.solvers.record import Settings

R = 0.05  # m
CORNERS = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
ENGINES = (grouped.solve, by_core)  # the contact engine, and the core


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


def played(solve: Callable[..., Trace | None], where: Scene, law: Law | None = None) -> Any:
    """Return all that an engine makes of a scene, in floats, or the error that it raises."""
    settings = Settings(None, law=law, compiled=False, max_events=40, max_time=2.0)
    try:
        trace = solve(where, where.start(None), settings)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    assert trace is not None, "no contact persists"
    return in_floats(list(parts_of(trace).values()))


def in_floats(what: Any) -> Any:
    """Return the same lists with floats in place of numbers of other types."""
    if isinstance(what, list | tuple):
        return [in_floats(each) for each in what]
    return float(what) if isinstance(what, int | float | np.generic) else what


def both(make: Callable[[], tuple[Scene, Law | None]]) -> tuple[str, str]:
    """Return what both engines make of a scene and a law, which are made anew for each."""
    one, other = (repr(played(solve, *make())) for solve in ENGINES)
    return one, other


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
def test_a_law_is_asked_the_same_in_the_same_order(make: Callable[[], Scene]) -> None:
    laws = Listening(), Listening()
    one, other = (
        repr(played(solve, make(), law)) for solve, law in zip(ENGINES, laws, strict=True)
    )
    assert one == other
    assert laws[0].asked == laws[1].asked
    assert len(laws[0].asked) > 1
    assert any("Contact(" in each for each in laws[0].asked) == (make is not scene)


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
def test_a_law_that_answers_no_velocity_gets_the_same_error(method: str, answer: str) -> None:
    value = NOTHING_OF_A_VELOCITY[answer]
    if method.startswith("the second"):
        value = NT(1.0, 0.0), value
    law = own(method.rpartition(" ")[2], lambda *_: value)
    one, other = both(lambda: (scene(), law))
    assert one == other
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
        one, other = both(lambda law=law: (scene(), law))  # type: ignore[misc]
        assert one == other
        assert "Error: " not in one


@pytest.mark.parametrize("answer", [None, 0, 1, "", "yes", 1.0, (1,), np.True_, np.False_])
def test_whether_a_law_jumps_may_be_any_truth_value(answer: Any) -> None:
    for make in (scene, at_once):
        one, other = both(lambda make=make: (make(), own("jumps", lambda *_: answer)))  # type: ignore
        assert one == other


def leaving(left: Any) -> Law:
    """Return a law that leaves something in place of a velocity, where contacts come at once."""

    def together(_: Law, contacts: Any, velocity: Any, respond: Any) -> None:
        for contact in contacts:
            respond(contact, velocity)
        velocity[contacts[0].a] = left

    return own("together", together)


@pytest.mark.parametrize("answer", NOTHING_OF_A_VELOCITY)
def test_a_law_that_leaves_no_velocity_gets_the_same_error(answer: str) -> None:
    one, other = both(lambda: (at_once(), leaving(NOTHING_OF_A_VELOCITY[answer])))
    assert one == other
    assert ("Error: " in one) == (answer not in ("a pair", "three", "a list"))


@pytest.mark.parametrize("left", [NT(0.5, 0.25), (1, 0), [0.5, 0.0], (np.float64(0.5), 0)])
def test_a_law_may_leave_any_two_numbers(left: Any) -> None:
    one, other = both(lambda: (at_once(), leaving(left)))
    assert one == other
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
def test_a_law_that_fails_at_once_gets_the_same_error(together: Any) -> None:
    one, other = both(lambda: (at_once(), own("together", together)))
    assert one == other
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
        one, other = both(lambda make=make: (make(), own("together", together)))  # type: ignore
        assert one == other
        assert "Error: " not in one


def test_a_law_that_solves_as_coulomb_does_has_its_impulses() -> None:
    law = own("together", type(LAWS["coulomb"]).together)
    one, other = both(lambda: (at_once(), law))
    assert one == other
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
def test_what_is_no_pair_gets_the_same_error(answer: str, law: str) -> None:
    given[0] = lambda *_: PAIRS[answer]
    one, other = both(lambda: (scene(WithPair, law=law), None))
    assert one == other
    assert "Error: " in one


@pytest.mark.parametrize("kind", ["floats", "NumPy", "ints"])
def test_pairs_of_a_scene_have_numbers_of_any_type(kind: str) -> None:
    number: Any = {"floats": float, "NumPy": np.float64, "ints": math.ceil}[kind]
    given[0] = lambda _, i, j: Pair(*map(number, (0.2 + i, 0.2 + j, 0.5 + 0.1 * j, 0.1)))
    one, other = both(lambda: (scene(WithPair), None))
    assert one == other
    assert one != repr(played(grouped.solve, scene()))


def test_a_scene_is_asked_once_in_a_run_for_each_two_balls() -> None:
    given[0] = Scene.pair
    where, counts = in_a_corner(WithPair), list[list[tuple[int, int]]]()
    for solve in (*ENGINES, by_core):  # Another run asks again.
        asked.clear()
        played(solve, where)
        counts.append(list(asked))
    assert counts == [[(0, 1)]] * 3


# -- sides -----------------------------------------------------------------------------------------


class Odd:
    """This side is a face, and one of its methods may answer something else from some call on."""

    def __init__(self, method: str, answer: Callable[..., Any]) -> None:
        self.face = face_between((2.0, 0.0), (2.0, 1.0))
        self.method, self.answer, self.is_odd = method, answer, False

    def _ask(self, method: str, *asked: Any) -> Any:
        found = getattr(self.face, method)(*asked)
        return self.answer(found) if self.is_odd and method == self.method else found

    def time_of_contact(self, *asked: Any) -> Any:
        return self._ask("time_of_contact", *asked)

    def gap(self, *asked: Any) -> Any:
        return self._ask("gap", *asked)

    def normal(self, *asked: Any) -> Any:
        return self._ask("normal", *asked)

    def curvature(self, *asked: Any) -> Any:
        return self._ask("curvature", *asked)


def with_side(side: Odd, make: Callable[[Table], Scene]) -> Scene:
    """Return a scene whose cushion on the right has this side."""

    class Own(Table):
        @cached_property
        def walls(self) -> tuple[Wall, ...]:
            plain = Table(CORNERS).walls
            return (plain[0], Wall((side,), 0.0, 0.0, 1), *plain[2:])

    found = make(Own(CORNERS))
    side.is_odd = True  # The scene itself has asked it for gaps.
    return found


def with_table(table: Table) -> Scene:
    """Return the shot at two balls on this table."""
    return scene(table=table)


SIDES = ("time_of_contact", "gap", "normal", "curvature")


@pytest.mark.parametrize("answer", [None, "ab", (1.0, 0.0, 2.0), (None, None), ("a", "b")])
@pytest.mark.parametrize("method", SIDES)
def test_a_side_that_answers_wrongly_gets_the_same_error(method: str, answer: Any) -> None:
    make = into_a_corner if method == "gap" else with_table
    one, other = both(lambda: (with_side(Odd(method, lambda _: answer), make), None))
    assert one == other
    assert "Error: " in one


@pytest.mark.parametrize("method", SIDES)
def test_a_side_may_answer_numbers_of_numpy(method: str) -> None:
    def answer(found: Any) -> Any:
        return tuple(map(np.float64, found)) if isinstance(found, tuple) else np.float64(found)

    for make in (with_table, into_a_corner):
        one, other = both(lambda make=make: (with_side(Odd(method, answer), make), None))  # type: ignore
        assert one == other == both(lambda make=make: (make(Table(CORNERS)), None))[0]  # type: ignore


# -- surfaces --------------------------------------------------------------------------------------


class OddSurface:
    """Balls slide, then perhaps roll; cushions take all of a roll; a method may answer oddly."""

    def __init__(
        self, method: str = "", answer: Callable[..., Any] | None = None, rolls: bool = True
    ) -> None:
        self.usual = Rolling(1.0, 0.1) if rolls else Sliding(1.0)
        self.pull, self.drag, self.rolls = 1.0, self.usual.drag, rolls
        self.method, self.answer = method, answer

    def _found(self, method: str, found: Any) -> Any:
        return self.answer(found) if self.answer and method == self.method else found

    def path(self, *asked: Any) -> Any:
        return self._found("path", self.usual.path(*asked))

    def then(self, path: Path) -> Any:
        return self._found("then", self.usual.then(path))

    def roll(self, path: Path, t: float, pushes: Sequence[Any] = ()) -> Any:
        found = (0.0, 0.0) if pushes else self.usual.roll(path, t)
        return self._found("roll", found)


@dataclass(frozen=True)
class OnSurface(Scene):
    """This scene has a surface of its own."""

    @property
    def surface(self) -> Any:
        return given[0]


def on_surface(surface: OddSurface) -> Scene:
    """Return the scene on this surface."""
    given[0] = surface
    return scene(OnSurface)


def fields() -> Iterator[tuple[int, Any, bool]]:
    """Yield the places of numbers in a path, something that is none, and whether balls roll."""
    for k in (0, 1, 2, 3, 4, 5, 6, 7, 9, 10):
        for what in (None, "a"):
            yield k, what, True
            if k < 9:  # Only balls that roll have a roll.
                yield k, what, False


def test_a_surface_says_how_cushions_slow_a_roll() -> None:
    one, other = both(lambda: (on_surface(OddSurface()), None))
    assert one == other
    given[0] = Rolling(1.0, 0.1)
    assert one != repr(played(grouped.solve, scene(OnSurface)))


@pytest.mark.parametrize("answer", ["ab", (1.0, 0.0, 2.0), 1.0, 1, np.float64(1.0)])
@pytest.mark.parametrize("method", ["path", "then"])
def test_a_surface_that_gives_no_path_gets_the_same_error(method: str, answer: Any) -> None:
    one, other = both(lambda: (on_surface(OddSurface(method, lambda _: answer)), None))
    assert one == other
    assert "Error: " in one


def test_a_surface_that_gives_no_path_at_all_gets_the_same_error() -> None:
    one, other = both(lambda: (on_surface(OddSurface("path", lambda _: None)), None))
    assert one == other == repr("AttributeError: 'NoneType' object has no attribute 'vx'")


@pytest.mark.parametrize(("k", "what", "rolls"), list(fields()))
def test_a_path_without_a_number_gets_the_same_error(k: int, what: Any, rolls: bool) -> None:
    def wrong(path: Path) -> Path:
        return Path._make((*path[:k], what, *path[k + 1 :]))

    one, other = both(lambda: (on_surface(OddSurface("path", wrong, rolls)), None))
    assert one == other
    assert "Error: " in one


NO_ROLLS = (None, 1.0, "ab", (None, None), (1.0, 2.0, 3.0), (0.0, "a"), ("a", 0.0))


@pytest.mark.parametrize("answer", NO_ROLLS)
def test_a_roll_that_is_none_gets_the_same_error(answer: Any) -> None:
    one, other = both(lambda: (on_surface(OddSurface("roll", lambda _: answer)), None))
    assert one == other
    assert "Error: " in one


def test_a_surface_may_give_numbers_of_numpy() -> None:
    def path(found: Path) -> Path:
        return Path._make((*map(np.float64, found[:8]), found.slows, *map(np.float64, found[9:])))

    def roll(found: Any) -> Any:
        return tuple(map(np.float64, found))

    for method, answer in (("path", path), ("roll", roll)):
        one, other = both(
            lambda method=method, answer=answer: (on_surface(OddSurface(method, answer)), None)  # type: ignore
        )
        assert one == other == both(lambda: (on_surface(OddSurface()), None))[0]


# -- plain Python ----------------------------------------------------------------------------------


@pytest.mark.skipif(not pool_pymunk.compiled, reason="the core is not compiled here")
def test_plain_python_raises_the_same_errors() -> None:
    command = [sys.executable, "-m", "pytest", "-q", __file__]
    plain = {**os.environ, "POOL_PYMUNK_PURE": "1"}
    ran = subprocess.run(command, env=plain, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout
