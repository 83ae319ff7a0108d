"""A law of one's own is played everywhere, by its name in LAWS or as an object."""

from __future__ import annotations

import json
import pickle
import re
from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    NT,
    Ball,
    Batch,
    Disc,
    Friction,
    Law,
    Material,
    Pair,
    Physics,
    Pocket,
    Restitution,
    Run,
    Scene,
    SettingError,
    Shot,
    Table,
    Uncertainty,
    atlas,
    collide,
    find,
    fit,
    loads,
    sensitivity,
    simulate,
    simulate_many,
    sweep,
)
from pool_pymunk.laws import LAWS
from pool_pymunk.laws.law import Coulomb, Published
from pool_pymunk.page.content import content
from pool_pymunk.page.live.answers import Answers
from pool_pymunk.render.view import settings
from pool_pymunk.studies.sensitivity import linear
from pool_pymunk.studies.sweep.job import begin, play_part
from pool_pymunk.studies.sweep.plan import as_begun, make_plan


class Damped(Law):
    """This law restores less the faster balls meet, so it is nobody's but one's own."""

    name = "damped"

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        e = pair.restitution / (1.0 + 0.2 * abs(a.n - b.n))
        return super().ball_ball(a, b, pair._replace(restitution=e))

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        return NT(-0.5 * restitution * v.n, v.t)


class OneByOne(Law):
    """This law answers single hits as Coulomb does; contacts of one instant come one by one."""

    def together(self, contacts: Any, velocity: Any, respond: Any) -> None:
        for contact in contacts:
            respond(contact, velocity)


DAMPED = Damped()
SAMPLES = 20


def laid_out(law: str = "coulomb") -> Scene:
    """Return a table with a pocket, a cue ball and a ball at which it is shot."""
    balls = Ball("C", (0.4, 0.5), 0.05, 0.2, cue=True), Ball("1", (1.0, 0.53), 0.05, 0.2)
    table = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)))
    return Scene(
        balls, table, Restitution(0.9, None, 0.7), Friction(0.1, 0.2, 0.1), Physics(law=law),
        shots=(Shot("S", "C", (2.0, 0.0)),), pockets=(Pocket("P", (2.0, 1.0), 0.08),),
    )  # fmt: skip


@pytest.fixture(params=["by name", "as an object"])
def asked(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str | Law:
    """Return the law by its name, which is added to LAWS, or as it is."""
    if request.param == "as an object":
        return DAMPED
    monkeypatch.setitem(LAWS, DAMPED.name, DAMPED)
    return DAMPED.name


def played(speed: float, law: str | Law, scene: Scene | None = None) -> Run:
    """Return the reference run of the cue ball struck along x at a speed (m/s)."""
    shot = Shot("S", "C", (speed, 0.0))
    return simulate(replace(scene or laid_out(), shots=(shot,)), solver="event-driven", law=law)


def ends_of(runs: Iterable[Run]) -> np.ndarray[Any, Any]:
    return np.array([run.end.position for run in runs])


def test_many_shots_have_the_law(asked: str | Law) -> None:
    speeds = np.linspace(1.0, 3.0, SAMPLES)
    velocity = np.zeros((SAMPLES, 2, 2))
    velocity[:, 0, 0] = speeds
    batch = simulate_many(laid_out(), velocity=velocity, law=asked)
    runs = [played(speed, asked) for speed in speeds]
    assert {batch.law, *[run.law for run in runs]} == {"damped"}
    np.testing.assert_array_equal(batch.final, ends_of(runs))
    others = ends_of(played(speed, "coulomb") for speed in speeds)
    assert np.abs(batch.final - others).max() > 0.01


def test_many_shots_of_a_scene_that_names_the_law(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LAWS, DAMPED.name, DAMPED)
    named = laid_out("damped")
    assert loads(named.to_toml()).physics.law == "damped"
    velocity = named.start(named.shots[0]).velocity
    end = simulate(laid_out(), 1, solver="event-driven", law=DAMPED).end.position
    np.testing.assert_array_equal(simulate_many(named, velocity=velocity).final[0], end)


def test_laws_with_the_single_hits_of_ours_are_played_by_the_core() -> None:
    velocity = np.array([[[2.0, 0.0], [0.0, 0.0]]])
    for law in (Law(), OneByOne(), Coulomb(), Published()):
        batch = simulate_many(laid_out(), velocity=velocity, law=law)
        assert batch.by_reference == 0
        run = simulate(laid_out(), 1, solver="event-driven", law=law)
        np.testing.assert_array_equal(batch.final[0], run.end.position)


def test_a_method_that_an_object_has_of_its_own_is_asked() -> None:
    law = Law()
    law.ball_ball = DAMPED.ball_ball  # type: ignore[method-assign]
    velocity = np.array([[[2.0, 0.0], [0.0, 0.0]]])
    batch = simulate_many(laid_out(), velocity=velocity, law=law)
    run = simulate(laid_out(), 1, solver="event-driven", law=law)
    np.testing.assert_array_equal(batch.final[0], run.end.position)


def test_sweep_and_atlas_have_the_law(asked: str | Law, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    grid = {"speed": (1.0, 3.0, 5)}
    sweep(laid_out(), 1, grid=grid, out=tmp_path, law=asked)
    ends = ends_of(played(speed, DAMPED) for speed in np.linspace(1.0, 3.0, 5))
    table = parquet.read_table(tmp_path)
    found = [table["x_1"].to_numpy(), table["y_1"].to_numpy()]
    np.testing.assert_array_equal(np.transpose(found), ends[:, 1])
    shown = atlas(laid_out(), 1, angle=(0.0, 1.0), speed=(1.0, 3.0), size=(2, 5), law=asked)
    np.testing.assert_array_equal(shown.end[:, 0], ends[:, 1])
    with pytest.raises(SettingError, match=r"another (scene|law)"):
        sweep(laid_out(), 1, grid=grid, out=tmp_path)


def test_a_sweep_elsewhere_has_the_law(tmp_path: Path) -> None:
    """A worker needs the class, and no name for it."""
    parquet = pytest.importorskip("pyarrow.parquet")
    begun = as_begun(laid_out(), 1, DAMPED)
    plan = make_plan(begun, None, {"speed": (1.0, 3.0, 2)}, None, 0, 9)
    begin(tmp_path, plan, resume=True)
    play_part(pickle.loads(pickle.dumps(plan)), tmp_path, 0)
    end = played(3.0, DAMPED).final
    assert parquet.read_table(tmp_path)["x_C"][1].as_py() == end["C"][0]


@pytest.mark.slow
def test_find_has_the_law(asked: str | Law) -> None:
    def moves(batch: Batch) -> np.ndarray[Any, np.dtype[np.bool_]]:
        assert batch.law == "damped"
        return np.asarray(batch.first_hit == 1)

    [found] = find(
        laid_out(), 1, moves, angle=(-8.0, 8.0), tries=640, samples=20, best=1, law=asked
    )
    assert found.run.law == "damped"


def test_sensitivity_has_the_law(asked: str | Law) -> None:
    again = replace(
        laid_out(), shots=(*laid_out().shots, Shot("on", "C", (1.0, 0.2), from_previous=True))
    )
    found = sensitivity(again, "on", Uncertainty(1e-4), 5, law=asked)
    assert found.reference.law == "damped"
    places = zip(again.balls, found.starts[0].tolist(), strict=True)
    balls = tuple(replace(ball, position=(x, y)) for ball, (x, y) in places)
    first = replace(again, balls=balls)
    run = simulate(first, "on", solver="event-driven", law=DAMPED)
    np.testing.assert_array_equal(found.ends[0], run.end.position)


@pytest.mark.slow
def test_linear_errors_have_the_law(asked: str | Law) -> None:
    """A millimetre more speed a second changes the ends as the derivatives of this law say."""
    found = linear(laid_out(), 1, Uncertainty(0.0, speed=1e-3), law=asked)
    slower, faster = ends_of(played(speed, DAMPED) for speed in (1.9995, 2.0005))
    std = np.abs(faster - slower) / np.sqrt(3.0)
    np.testing.assert_allclose(found.std, std, rtol=1e-3, atol=1e-9)


def test_fit_has_the_law(asked: str | Law) -> None:
    pytest.importorskip("scipy")
    true = replace(laid_out(), restitution=Restitution(0.8, None, 0.7))
    rows = [(1, id_, *end) for id_, end in played(2.0, DAMPED, true).final.items()]
    found = fit(laid_out(), rows, ["restitution.ball_ball"], starts=2, law=asked)
    assert found.values["restitution.ball_ball"] == pytest.approx(0.8, abs=1e-8)


def test_environments_play_the_law_that_their_scene_names(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gymnasium")
    env = import_module("pool_pymunk.env")
    monkeypatch.setitem(LAWS, DAMPED.name, DAMPED)
    ends = []
    for law in ("damped", "coulomb"):
        game = env.PotEnv(laid_out(law), layout="scenario")
        game.reset(seed=1)
        game.step(np.array([0.0, 0.5]))
        ends.append(game.position)
    assert np.abs(ends[0] - ends[1]).max() > 0.01


def test_the_live_table_offers_the_law(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LAWS, DAMPED.name, DAMPED)
    answers = Answers(laid_out())
    question = {
        "ball": "C",
        "speed": 2.0,
        "angle": 0.0,
        "law": "damped",
        "position": [ball.position for ball in answers.scene.balls],
        "velocity": [(0.0, 0.0), (0.0, 0.0)],
    }
    for kind in ("shot", "aim", "cloud"):
        answer = answers.to(kind, json.dumps(question).encode())
        assert answer.status == 200, answer.text


def test_pictures_and_pages_name_the_law_of_the_run() -> None:
    runs = [simulate(laid_out(), 1, solver="event-driven", law=law) for law in ("coulomb", DAMPED)]
    labels = [run["label"] for run in content([runs])["shots"][0]["runs"]]
    assert labels == ["event-driven, coulomb law", "event-driven, damped law"]
    assert settings(runs[:2]) == labels


def test_one_collision_has_the_law(asked: str | Law) -> None:
    a, b = Disc(0.2, 0.05, (1.0, 0.0)), Disc(0.2, 0.05)
    hit = collide(a, b, material=Material(0.9, 0.1, asked))
    assert hit.velocity_b[0] == pytest.approx((1.0 + 0.9 / 1.2) / 2.0, abs=1e-15)


def test_derivatives_are_those_of_the_law_that_was_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """The name may stand for another law by then."""
    monkeypatch.setitem(LAWS, "damped", DAMPED)
    run = simulate(laid_out(), 1, solver="event-driven", law="damped")
    found = run.derivatives(["speed"]).final
    monkeypatch.setitem(LAWS, "damped", Law())
    np.testing.assert_array_equal(run.derivatives(["speed"]).final, found)


@pytest.mark.parametrize("solver", ["event-driven", "time-slice"])
@pytest.mark.parametrize("method", ["ball_ball", "cushion"])
@pytest.mark.parametrize("answer", [None, (1.0, 0.0), 2.0, ((1.0, 0.0), (0.0, 0.0))])
def test_a_law_that_returns_no_velocities_is_named(
    solver: str, method: str, answer: object
) -> None:
    own = type("Silent", (Law,), {method: lambda *_: answer})()
    ball = Ball("a", (0.5, 0.5), 0.03, 0.2, velocity=(1.0, 0.0))
    other = Ball("b", (0.8, 0.5) if method == "ball_ball" else (0.8, 0.9), 0.03, 0.2)
    scene = Scene(
        (ball, other), Table.rectangle(2.0, 1.0), Restitution(0.9, cushion=0.8), Friction(0.02)
    )
    message = f"law Silent returned {answer!r}: its {method} must return"
    with pytest.raises(TypeError, match=re.escape(message)):
        simulate(scene, solver=solver, law=own, max_time=3.0)


@pytest.mark.parametrize(
    ("method", "own", "takes"),
    [
        ("ball_ball", lambda self, a, b: (a, b), "a, b, pair"),
        ("ball_ball", lambda a, b, pair: (a, b), "a, b, pair"),
        ("cushion", lambda self, v, e, mu, spin: v, "v, restitution, friction"),
        ("together", lambda self: None, "contacts, velocity, respond"),
        ("jumps", lambda self, *, a, b, pair: False, "a, b, pair"),
    ],
)
def test_a_law_says_at_once_which_arguments_are_asked(method: str, own: Any, takes: str) -> None:
    with pytest.raises(TypeError, match=f"^law Own: its {method} must take {takes} after self$"):
        type("Own", (Law,), {method: own})
    type("Own", (Law,), {method: lambda self, *any_number, more=0: None})


@pytest.mark.parametrize("solver", ["event-driven", "pymunk", "time-slice"])
@pytest.mark.parametrize("found", [NT(np.nan, 0.0), NT(np.inf, 0.0), NT(0.0, -np.inf)])
def test_a_law_that_returns_no_number_is_named(solver: str, found: NT) -> None:
    own = type("Odd", (Law,), {"ball_ball": lambda _, a, b, pair: (found, b)})()
    run = simulate(laid_out(), 1, solver=solver, law=own)
    assert run.status == "non_finite"
    assert not np.isfinite(run.final["C"]).all()  # Nothing warns of it; a page tells null.
    assert '"impulse":null' in run.to_html()
    assert any("see what the law Odd returned" in text for text in run.warnings)


@pytest.mark.parametrize("solver", ["event-driven", "pymunk"])
def test_a_law_that_returns_what_overflows_is_named(solver: str) -> None:
    """The square of the velocity is infinite; the ball was put to rest as if it were 0."""
    own = type("Odd", (Law,), {"ball_ball": lambda _, a, b, pair: (NT(1e300, 0.0), b)})()
    run = simulate(laid_out(), 1, solver=solver, law=own)
    assert run.status == "non_finite"
    assert any("see what the law Odd returned" in text for text in run.warnings)
