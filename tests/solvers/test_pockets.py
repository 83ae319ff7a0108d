"""Pockets take balls in, exactly when and where they must, in every solver."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Pocket,
    Restitution,
    Run,
    Scene,
    SceneError,
    Shot,
    State,
    Table,
    load,
    loads,
    simulate,
    simulate_all,
)
from pool_pymunk.solvers import SOLVERS
from tests.shared.texts import POCKETS

R, HOLE = 0.05, 0.1


# -- one ball and one pocket -----------------------------------------------------------------------


def plane(*balls: Ball, **parts: Any) -> Scene:
    """Return balls on a plane with one pocket at the origin."""
    made = {
        "restitution": Restitution(0.9, None, 0.7),
        "friction": Friction(0.02),
        "pockets": (Pocket("hole", (0.0, 0.0), HOLE),),
        **parts,
    }
    return Scene(tuple(balls), **made)


def rolling(y: float = 0.0, speed: float = 1.0, id_: str = "a") -> Ball:
    return Ball(id_, (-1.0, y), R, 0.2, velocity=(speed, 0.0))


@pytest.mark.parametrize("solver", list(SOLVERS))
def test_a_pocketed_ball_lies_in_the_pocket(solver: str) -> None:
    run = simulate(plane(rolling()), solver=solver)
    assert run.status == "settled"
    assert [(e.kind, e.balls, e.cushion, e.pocket) for e in run.events] == [
        ("pocket", ("a",), None, "hole")
    ]
    assert run.pocketed == {"a": "hole"}
    assert run.off == {"a"}
    assert run.final == {"a": (0.0, 0.0)}
    assert run.end.velocity == ((0.0, 0.0),)
    a = 0.02 * 9.80665
    due = (1.0 - math.sqrt(1.0 - 2 * a * 0.9)) / a  # the time for 0.9 m
    assert run.duration == pytest.approx(due, abs=1e-12 if run.dt is None else 1.5 * run.dt)


def test_a_ball_that_stops_before_the_rim_stays() -> None:
    a = 0.02 * 9.80665
    for short, falls in ((1e-9, False), (-1e-9, True)):
        speed = math.sqrt(2 * a * (0.9 - short))
        assert bool(simulate(plane(rolling(speed=speed)), solver="event-driven").pocketed) == falls


def test_a_ball_on_the_rim_falls_when_it_is_hit_towards_the_pocket() -> None:
    resting = Ball("b", (-HOLE, 0.0), R, 0.2)
    run = simulate(plane(rolling(), resting), solver="event-driven")
    assert [event.kind for event in run.events][:2] == ["ball-ball", "pocket"]
    assert run.pocketed["b"] == "hole"


@pytest.mark.parametrize("solver", ["time-slice", "pymunk-discrete"])
def test_a_finer_step_comes_nearer_to_the_time_of_the_pocket(solver: str) -> None:
    exact = simulate(plane(rolling(0.03)), solver="event-driven").duration
    late = [simulate(plane(rolling(0.03)), solver=solver, dt=dt).duration - exact
            for dt in (1e-2, 1e-3, 1e-4)]  # fmt: skip
    for error, dt in zip(late, (1e-2, 1e-3, 1e-4), strict=True):
        assert -1e-9 <= error <= dt


def test_a_pocketed_ball_is_in_nobodys_way() -> None:
    """The second ball takes the same line, and through where the first one lies."""
    first, second = rolling(id_="a"), Ball("b", (-1.2, 0.0), R, 0.2, velocity=(0.9, 0.0))
    run = simulate(plane(first, second), solver="event-driven")
    assert run.pocketed == {"a": "hole", "b": "hole"}
    assert [event.kind for event in run.events] == ["pocket", "pocket"]


def test_two_balls_fall_into_a_pocket_within_one_step() -> None:
    """The first one lies in the pocket, nearer to the second than two radii, and is not there."""
    left = Ball("a", (-0.2, 0.0), 0.08, 0.2, velocity=(3.0, 0.0))
    right = Ball("b", (0.215, 0.0), 0.08, 0.2, velocity=(-3.0, 0.0))
    scene = plane(left, right, pockets=(Pocket("hole", (0.0, 0.0), 0.1),))
    run = simulate(scene, solver="pymunk", dt=1 / 30)
    assert [(event.kind, event.balls) for event in run.events] == [
        ("pocket", ("a",)),
        ("pocket", ("b",)),
    ]


def test_the_path_ends_at_the_rim_and_the_ball_is_in_the_pocket_from_then_on() -> None:
    run = simulate(plane(rolling(0.06)), solver="event-driven")
    t = run.events[0].t
    before, after = (run.at(when)[0][0] for when in (t * (1 - 1e-12), t))
    assert math.hypot(*before) == pytest.approx(HOLE, abs=1e-9)
    assert tuple(after) == (0.0, 0.0)
    assert run.energy["final"] == 0.0
    when, x, y, vx, vy, _, _ = run.knots[0][-2]
    assert when == t
    assert math.hypot(x, y) == pytest.approx(HOLE, abs=1e-15)
    assert math.hypot(vx, vy) == pytest.approx(1.0 - 0.02 * 9.80665 * t, abs=1e-14)


# -- shots and states ------------------------------------------------------------------------------

SCENE = plane(
    Ball("cue", (-1.0, 0.0), R, 0.2, cue=True),
    Ball("1", (-0.4, 0.0), R, 0.2),
    Ball("2", (-1.0, 1.0), R, 0.2),
    shots=(
        Shot("pot", "cue", speed=1.0, angle=0.0),
        Shot("then", "cue", speed=0.5, aim="nearest", from_previous=True),
        Shot("gone", "1", speed=0.5, angle=0.0, from_previous=True),
    ),
)


@pytest.mark.parametrize("solver", list(SOLVERS))
def test_the_next_shot_goes_on_without_the_pocketed_balls(solver: str) -> None:
    dt = 1e-4 if solver == "time-slice" else None
    runs = simulate_all(SCENE, ["pot", "then"], solver=solver, dt=dt)
    pot, then = runs
    assert pot.pocketed == {"1": "hole"}
    assert then.pocketed == {}
    assert then.off == {"1"}
    assert then.final["1"] == (0.0, 0.0)
    assert all("1" not in event.balls for event in then.events)
    alone = simulate(SCENE, "then", solver=solver, dt=dt)
    assert alone.final == then.final


def test_each_shot_goes_on_from_the_one_before() -> None:
    """Alone on a plane a ball goes v^2 / (2 mu g) along each shot."""
    speeds, angles = (1.0, 0.5, 2.0), (0.0, 90.0, 180.0)
    each = enumerate(zip(speeds, angles, strict=True))
    shots = [Shot(str(k), "1", speed=v, angle=a, from_previous=k > 0) for k, (v, a) in each]
    mu, g = 0.25, 9.80665
    scene = Scene((Ball("1", (0.0, 0.0), R, 0.2),), None, friction=Friction(mu), shots=tuple(shots))
    lengths = [v * v / (2.0 * mu * g) for v in speeds]
    for run in (simulate(scene, "2"), [*simulate_all(scene)][2]):
        assert run.final["1"] == pytest.approx((lengths[0] - lengths[2], lengths[1]), abs=1e-12)


def test_a_shot_of_a_pocketed_ball_is_refused() -> None:
    with pytest.raises(SceneError, match="the ball is off the table before gone"):
        simulate(SCENE, "gone", start=simulate(SCENE, "pot").end)


def test_a_state_says_who_is_off_the_table() -> None:
    state = SCENE.start(None)
    start = State(state.position, state.velocity, frozenset({"1"}))
    run = simulate(SCENE, "pot", solver="event-driven", start=start)
    assert run.pocketed == {"cue": "hole"}
    assert run.off == {"1", "cue"}


def test_a_run_is_saved_written_and_loaded_with_its_pockets(tmp_path: Path) -> None:
    run = simulate(SCENE, "pot", solver="event-driven")
    run.save(tmp_path / "run.npz")
    assert Run.load(tmp_path / "run.npz") == run
    record: dict[str, Any] = run.as_dict()
    assert record["pocketed"] == {"1": "hole"}
    assert record["final"]["1"] == [0.0, 0.0]
    _, _, event = record["events"]
    assert event | {"t": 0} == {"t": 0, "kind": "pocket", "balls": ["1"], "pocket": "hole"}
    run.write_events_csv(tmp_path / "events.csv")
    lines = (tmp_path / "events.csv").read_text().splitlines()
    impulses = "impulse (N s),tangential (N s),tangential_first (N s)"
    assert lines[0] == f"t,kind,ball,other,cushion,pocket,{impulses}"
    assert lines[3].endswith(",pocket,1,,,hole,,,")


def test_a_run_without_pockets_has_nobody_pocketed() -> None:
    assert simulate(load("report"), 3).as_dict()["pocketed"] == {}


def test_max_events_counts_pockets() -> None:
    run = simulate(SCENE, "pot", solver="event-driven", max_events=2)
    assert [event.kind for event in run.events] == ["ball-ball", "stop"]
    assert run.status == "max_events"
    assert run.pocketed == {}
    assert len(simulate(SCENE, "pot", solver="event-driven", max_events=3).pocketed) == 1


# -- files -----------------------------------------------------------------------------------------


def test_pockets_of_a_file_have_numbers_for_ids() -> None:
    scene = loads(POCKETS.format(place="[0.5, 0.0]"))
    assert scene.pockets == (Pocket("1", (0.0, 0.0), 0.1), Pocket("far", (1.0, 0.0), 0.1))
    assert loads(scene.to_toml()) == scene


def test_a_state_may_not_have_a_ball_in_a_pocket() -> None:
    places = ((-1.0, 0.0), (0.01, 0.0), (-1.0, 1.0))
    with pytest.raises(SceneError, match=r'start.position\[1\] = .*is within pocket "hole"'):
        simulate(SCENE, "pot", start=[places, ((0.0, 0.0),) * 3])


def test_a_wall_and_a_pocket_count_by_themselves() -> None:
    table = Table(((-2.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-2.0, 1.0)))
    scene = plane(Ball("a", (-1.0, 0.5), R, 0.2, velocity=(-3.0, -0.4)), table=table,
                  physics=Physics(max_time=9.0))  # fmt: skip
    assert next(event.cushion for event in simulate(scene, solver="event-driven").events) == 3
