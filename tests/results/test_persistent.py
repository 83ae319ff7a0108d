"""Users see which contacts persisted: in the run, its files and warnings, and from a table."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Billiards,
    Friction,
    PersistentContact,
    Physics,
    Restitution,
    Run,
    Scene,
    Table,
    load,
    same_balls,
    simulate,
)
from pool_pymunk.model import State
from pool_pymunk.page.content import content
from pool_pymunk.results.persistent import joined, warn_of_persisted
from pool_pymunk.results.trace import Persisted, Trace
from pool_pymunk.world import ContactEvent
from tests.shared.hard_scenes import disc, exact, persistent

ADDS_UP = 1e-7  # of an impulse


def on_an_arc(slows: float = 0.0, latest: float | None = None) -> Scene:
    """Return a ball that touches a round cushion at its lowest point, and runs along it."""
    ball = Ball("C", (0.5, 0.03), 0.03, 0.2, velocity=(1.0, 0.0))
    friction, physics = Friction(slows), Physics(max_time=latest)
    return Scene((ball,), Table.circle(0.5), Restitution(cushion=0.0), friction, physics)


def momentum(run: Run, ball: int) -> Any:
    """Return how the momentum (N s) of a ball has changed in a run."""
    rows = run.knots[ball]
    return run.scene.balls[ball].mass * (rows[-1, 3:5] - rows[0, 3:5])


def rubbed(run: Run, ball: int) -> Any:
    """Return the momentum (N s) that the surface has given a ball that slides without roll."""
    t = np.linspace(0.0, run.duration, 100_001)
    v = run.at(t)[1][:, ball]
    speed = np.hypot(*v.T)[:, np.newaxis]
    pull = -run.scene.deceleration * np.divide(v, speed, out=np.zeros_like(v), where=speed > 0.0)
    return run.scene.balls[ball].mass * np.trapezoid(pull, t, axis=0)


# -- the run ---------------------------------------------------------------------------------------


def test_impulses_of_a_ball_along_an_arc_are_its_change_of_momentum() -> None:
    """Nothing else acts on it: there is no surface friction."""
    run = simulate(on_an_arc(latest=0.3), solver="event-driven")
    [contact] = run.persistent
    assert (contact.balls, contact.since) == (("C",), 0.0)
    assert contact.until == 0.3
    assert contact.cushion is not None
    given = 0.2 * (run.at(contact.until)[1][0] - run.at(0.0)[1][0])
    assert contact.impulse == pytest.approx(given.tolist(), rel=ADDS_UP)
    assert contact.impulse[1] > 0.1


def test_impulses_of_two_balls_are_opposite_and_with_friction_explain_their_motion() -> None:
    run = exact(persistent(0.0))
    [contact] = run.persistent
    assert contact.balls == ("a", "b")
    assert 0.0 == contact.since < contact.until == run.knots[1][-1, 0]
    [hit] = [event for event in run.events if event.is_contact]
    assert hit.impulse is not None
    assert hit.t == 0.0
    n = np.array([1.0, 0.0])  # the line of centres at the hit
    given = np.array(contact.impulse) + hit.impulse * n
    assert np.hypot(*given) > 0.01
    assert momentum(run, 1) == pytest.approx(given + rubbed(run, 1), abs=1e-6)
    assert momentum(run, 0) == pytest.approx(-given + rubbed(run, 0), abs=1e-6)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
def test_sides_press_and_do_not_pull_whatever_order_balls_are_listed_in(
    order: tuple[int, ...],
) -> None:
    """Four balls fall into a heap, in a narrow table that is tilted."""
    places = (0.16, 0.11), (0.30, 0.10), (0.155, 0.23), (0.295, 0.22)
    balls = tuple(Ball(f"{k}", places[k], 0.05, 0.2 + 0.1 * k) for k in order)
    corners = ((0.0, 0.0), (0.45, 0.0), (0.45, 1.0), (0.0, 1.0))
    table, limit = Table(corners, tilt=(0.3, -9.0)), Physics(max_time=1.5)
    scene = Scene(balls, table, Restitution(0.2, cushion=0.2), Friction(0.0, 0.1, 0.1), limit)
    run, pairs = exact(scene), 0
    for contact in run.persistent:
        places_then = run.at((contact.since + contact.until) / 2.0)[0]
        ends = [places_then[scene.index[id_]] for id_ in contact.balls]
        if contact.cushion is None:
            pairs += 1
            assert np.dot(contact.impulse, ends[1] - ends[0]) > 0.0, contact
    assert pairs > 1


def test_contacts_stand_in_the_order_of_their_beginnings() -> None:
    """Two pairs are pressed together, and the one that is listed last is first."""
    near, far = persistent(0.0).balls
    late = [replace(b, id=b.id * 2, position=(b.position[0] + k * 1e-3, 1.0))
            for k, b in enumerate((near, far))]  # fmt: skip
    run = exact(replace(persistent(0.0), balls=(*late, near, far)))
    first, second = run.persistent
    assert (first.balls, second.balls) == (("a", "b"), ("aa", "bb"))
    assert first.since < second.since
    (said,) = [line for line in run.warnings if "presses" in line]
    assert said.index("a, b") < said.index("aa, bb")


@pytest.mark.parametrize("solver", ["time-slice", "pymunk-discrete", "pymunk-builtin"])
def test_a_solver_without_the_engine_tells_of_none(solver: str) -> None:
    run = simulate(persistent(0.0), solver=solver, dt=1e-3)
    assert run.persistent == ()
    assert run.as_dict()["persistent"] == []


# -- warnings --------------------------------------------------------------------------------------


def pressing(run: Run) -> list[str]:
    return [line for line in run.warnings if "presses" in line]


def test_one_warning_tells_which_balls_stay_in_contact() -> None:
    run = exact(persistent(0.0))
    assert run.policies == set()
    assert pressing(run) == [
        "surface friction, a roll or an arc presses balls a, b together: they stay in contact "
        f"until {run.persistent[0].until:.6g} s. In Python, run.persistent_shift says how far "
        "that may put the ends off (at 0 s)"
    ]


def test_a_ball_that_runs_from_cushion_to_cushion_gets_one_warning() -> None:
    run = exact(on_an_arc(slows=0.05))
    assert len({contact.cushion for contact in run.persistent}) == 2
    [line] = pressing(run)
    assert "presses ball C to cushions 0, 1: they stay in contact until" in line


def lasted(balls: tuple[int, ...], since: float, until: float, cushion: int = -1) -> Persisted:
    a, b = (*balls, -1)[:2]
    return a, b, cushion, since, until, 0.0, 0.0


def test_contacts_that_share_balls_and_overlap_in_time_are_one_group() -> None:
    groups = joined([
        lasted((2, 3), 0.5, 1.0), lasted((0, 1), 0.0, 1.0), lasted((1, 2), 0.2, 0.7),
        lasted((5, 6), 0.1, 0.2), lasted((5, 6), 0.3, 0.4), lasted((3,), 1.0, 2.0, cushion=4),
        lasted((5, 7), 0.45, 0.5),
    ])  # fmt: skip
    assert groups == [
        ((0, 1, 2, 3), (4,), 0.0, 2.0, 1), ((5, 6), (), 0.1, 0.4, 2), ((5, 7), (), 0.45, 0.5, 1)
    ]  # fmt: skip
    assert groups[0].words("ABCDEFGH") == "balls A, B, C, D and cushion 4 together"


# -- files -----------------------------------------------------------------------------------------


def test_all_formats_have_the_contacts(tmp_path: Path) -> None:
    run = exact(persistent(0.0))
    [contact] = run.persistent
    assert json.loads(json.dumps(run.as_dict()))["persistent"] == [
        {"balls": ["a", "b"], "since": contact.since, "until": contact.until,
         "impulse": list(contact.impulse)}
    ]  # fmt: skip
    run.save(tmp_path / "run.npz")
    assert Run.load(tmp_path / "run.npz").persistent == run.persistent
    run.write_persistent_csv(tmp_path / "run.csv")
    with (tmp_path / "run.csv").open(newline="", encoding="utf-8") as file:
        [row] = csv.DictReader(file)
    assert row == {
        "since (s)": str(contact.since), "until (s)": str(contact.until), "ball": "a",
        "other": "b", "cushion": "", "impulse_x (N s)": str(contact.impulse[0]),
        "impulse_y (N s)": str(contact.impulse[1]),
    }  # fmt: skip
    run.write_npz(tmp_path / "arrays.npz")
    arrays = np.load(tmp_path / "arrays.npz")
    assert arrays["persistent_balls"].tolist() == [["a", "b"]]
    assert arrays["persistent_cushion"].tolist() == [-1]
    assert arrays["persistent_until"].tolist() == [contact.until]
    assert arrays["persistent_impulse"].tolist() == [list(contact.impulse)]


def test_a_contact_with_a_cushion_has_its_number() -> None:
    contact = PersistentContact(("A",), 3, 0.0, 1.0, (0.5, 0.0))
    assert contact.as_dict()["cushion"] == 3


def test_a_run_without_such_contacts_has_empty_tables(tmp_path: Path) -> None:
    run = exact(load("two-balls"))
    assert run.persistent == ()
    run.write_npz(tmp_path / "arrays.npz")
    assert np.load(tmp_path / "arrays.npz")["persistent_impulse"].shape == (0, 2)


# -- rolls -----------------------------------------------------------------------------------------


def follows() -> Scene:
    """Return a ball that rolls into another one, does not bounce, and pushes it on."""
    balls = (
        Ball("A", (0.0, 0.0), 0.03, 0.2, velocity=(1.0, 0.0), roll=1.0),
        Ball("B", (0.0601, 0.01), 0.03, 0.2),
    )
    return Scene(balls, None, Restitution(0.0), Friction(0.1, 0.1, 0.1, rolling=0.01))


def test_energy_never_grows_while_a_ball_pushes_another_one() -> None:
    run = exact(follows())
    [contact] = run.persistent
    assert contact.until - contact.since > 0.1
    slips = run.at(contact.until / 2)[1] - run.roll_at(contact.until / 2)
    assert np.hypot(*slips.T).min() > 0.05  # Both balls slip.
    energy = run.energy_at(np.linspace(0.0, run.duration, 200_001))
    assert np.diff(energy).max() <= 1e-15 * energy[0]


def test_the_end_of_a_run_that_is_cut_in_a_contact_has_the_roll() -> None:
    whole, part = exact(follows()), exact(follows(), max_time=0.1)
    assert part.roll_at(0.1) == pytest.approx(whole.roll_at(0.1), abs=1e-5)
    assert part.persistent[0].balls == ("A", "B")


def test_a_page_has_how_a_pressed_ball_turns() -> None:
    run = exact(follows())
    [[shown]] = [shot["runs"] for shot in content([[run]])["shots"]]
    rows = np.array(shown["knots"][0])
    k = len(rows) // 2
    turned = rows[k, 7:9] + (rows[k + 1, 0] - rows[k, 0]) * rows[k, 9:]
    assert rows[k, 0] < run.persistent[0].until
    assert turned == pytest.approx(rows[k + 1, 7:9], abs=1e-12)


# -- tables ----------------------------------------------------------------------------------------


def test_a_table_tells_once_of_a_contact_that_is_over() -> None:
    space, heard = pymunk.Space(), list[ContactEvent]()
    scene = persistent(0.0)
    table = Billiards(space, 1 / 60, deceleration=scene.deceleration, pair=same_balls(0.0, 0.0))
    for ball in scene.balls:
        body = pymunk.Body(ball.mass, math.inf)
        body.position = ball.position
        table.strike(table.add_ball(pymunk.Circle(body, ball.radius)), ball.velocity)
    table.on_contact = heard.append
    for _ in range(10):
        space.step(1 / 60)
    hit, lasted = heard
    run = simulate(scene, solver="pymunk", dt=1 / 60)  # It has the same engine.
    [contact] = run.persistent
    assert (hit.since, hit.t) == (None, 0.0)
    assert (lasted.since, lasted.t) == pytest.approx((contact.since, contact.until), abs=1e-12)
    assert (lasted.closing, lasted.wall) == (0.0, None)
    (nx, ny), across = lasted.normal, (-lasted.normal[1], lasted.normal[0])
    places = run.at(contact.until)[0]
    assert lasted.normal == pytest.approx((places[1] - places[0]) / 0.1, abs=1e-7)
    given = [lasted.impulse * n + lasted.tangential * s
             for n, s in zip((nx, ny), across, strict=True)]  # fmt: skip
    assert given == pytest.approx(contact.impulse, abs=1e-12)


def test_on_stop_revoked_does_nothing_and_says_so() -> None:
    table = Billiards(pymunk.Space(), 1 / 60, deceleration=1.0, pair=same_balls(0.9, 0.0))
    with pytest.warns(DeprecationWarning, match="^on_stop_revoked does nothing: a ball of which"):
        table.on_stop_revoked = print  # type: ignore[attr-defined]
    with pytest.warns(DeprecationWarning, match="^on_stop_revoked does nothing"):

        class _Mine(Billiards):
            def on_stop_revoked(self, *_: object) -> None: ...


def test_two_balls_that_only_hit_have_no_such_contact() -> None:
    balls = (disc("a", (0.0, 0.0), (1.0, 0.0)), disc("b", (0.5, 0.0)))
    assert exact(Scene(balls, None, Restitution(0.5), Friction(0.1))).persistent == ()


def test_one_warning_tells_of_all_that_is_pressed() -> None:
    start = State(((0.0, 0.0),) * 4, ((0.0, 0.0),) * 4)
    trace = Trace(start, [(0.0, 0.0)] * 4)
    trace.persisted = [(0, 1, 0, 0.5, 2.0, 0.0, 0.0), (2, 3, 0, 1.0, 3.0, 0.0, 0.0)]
    warn_of_persisted(trace, "abcd", "gravity")
    [line] = trace.warnings
    assert "balls a, b together: they stay in contact from 0.5 s until 2 s; balls c, d" in line
