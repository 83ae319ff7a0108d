"""The table of contacts agrees with calculations by hand, and momentum and energy add up."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    NT,
    Ball,
    ContactRow,
    Friction,
    Law,
    Pair,
    Physics,
    Restitution,
    Run,
    Scene,
    Table,
    load,
    simulate,
    simulate_all,
)
from tests import ROOT
from tests.shared.hard_scenes import exact, persistent
from tests.shared.scenes import frozen_rack, random_scene, typed

R = 0.03
# a solver, its settings, and how far (m/s, N s) it may be off a calculation by hand
HOW: list[tuple[str, dict[str, Any], float]] = [
    ("event-driven", {}, 1e-14),
    ("pymunk", {}, 1e-14),
    ("time-slice", {"dt": 1e-5}, 1e-3),
    ("pymunk-discrete", {"dt": 1e-5}, 1e-3),
]
Vector = tuple[float, float]


def hit(offset: float, friction: float, how: tuple[str, dict[str, Any], float]) -> ContactRow:
    """Return the hit of a ball of 0.3 kg at 2 m/s along x on one of 0.1 kg; e is 0.8.

    Without friction of the surface the speed at the hit is that of the start.
    """
    balls = (
        Ball("A", (0.0, 0.0), R, 0.3, velocity=(2.0, 0.0)),
        Ball("B", (0.2, offset), R, 0.1),
    )
    limits = Physics(max_time=0.2)
    scene = Scene(balls, None, Restitution(0.8), Friction(ball_ball=friction), limits)
    [row] = simulate(scene, solver=how[0], **how[1]).contacts
    return row


# -- by hand ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", HOW, ids=lambda how: how[0])
def test_a_full_hit(how: tuple[str, dict[str, Any], float]) -> None:
    """J_n = (1 + e) m_A m_B / (m_A + m_B) v = 1.8 * 0.075 * 2; the velocities follow."""
    row, near = hit(0.0, 0.1, how), how[2]
    assert row.impulse == pytest.approx(0.27, abs=near)
    assert row.tangential == pytest.approx(0.0, abs=near)
    assert row.normal == pytest.approx((1.0, 0.0), abs=near)
    assert row.point == pytest.approx((0.2 - R, 0.0), abs=near)
    assert row.t == pytest.approx((0.2 - 2 * R) / 2.0, abs=near)
    assert row.before == ((2.0, 0.0), (0.0, 0.0))
    assert row.after[0] == pytest.approx((2.0 - 0.27 / 0.3, 0.0), abs=near)
    assert row.after[1] == pytest.approx((2.7, 0.0), abs=near)
    assert row.impulses == pytest.approx(np.array([(-0.27, 0.0), (0.27, 0.0)]), abs=near)
    # (1 - e^2) m_eff v^2 / 2
    assert row.lost == pytest.approx(0.36 * 0.075 * 4.0 / 2.0, abs=near)
    assert (row.balls, row.cushion, row.until) == (("A", "B"), None, None)


@pytest.mark.parametrize("how", HOW, ids=lambda how: how[0])
def test_an_oblique_hit_that_slips(how: tuple[str, dict[str, Any], float]) -> None:
    """At an offset of R the line of centres is at 30 degrees, and J_t = mu J_n."""
    row, near = hit(R, 0.05, how), how[2]
    v_n, v_t = 2.0 * math.cos(math.pi / 6), -2.0 * math.sin(math.pi / 6)
    j_n = 1.8 * 0.075 * v_n
    j_t = -0.05 * j_n  # A drags B along its own tangential velocity.
    assert row.kind == "slip"
    assert row.normal == pytest.approx((math.cos(math.pi / 6), 0.5), abs=near)
    assert (row.impulse, row.tangential) == pytest.approx((j_n, j_t), abs=near)
    assert row.tangential_first == pytest.approx(-j_t, abs=near)
    assert split(row, 0, row.before) == pytest.approx((v_n, v_t), abs=near)
    assert split(row, 0, row.after) == pytest.approx((v_n - j_n / 0.3, v_t - j_t / 0.3), abs=near)
    assert split(row, 1, row.after) == pytest.approx((j_n / 0.1, j_t / 0.1), abs=near)
    slip = (v_t, v_t - j_t / 0.3 - j_t / 0.1)  # of A on B, before and after
    lost = 0.36 * 0.075 * v_n**2 / 2.0 + abs(j_t) * -sum(slip) / 2.0
    assert row.lost == pytest.approx(lost, abs=near)


@pytest.mark.parametrize("how", HOW, ids=lambda how: how[0])
def test_an_oblique_hit_that_sticks(how: tuple[str, dict[str, Any], float]) -> None:
    """J_t = m_eff s is less than mu J_n, and both have one tangential velocity after it."""
    row, near = hit(R, 0.9, how), how[2]
    s = -2.0 * math.sin(math.pi / 6)
    assert row.kind == "stick"
    assert row.tangential == pytest.approx(0.075 * s, abs=near)
    assert split(row, 0, row.after)[1] == pytest.approx(0.75 * s, abs=near)
    assert split(row, 1, row.after)[1] == pytest.approx(0.75 * s, abs=near)
    v_n = 2.0 * math.cos(math.pi / 6)
    lost = 0.36 * 0.075 * v_n**2 / 2.0 + 0.075 * s * s / 2.0
    assert row.lost == pytest.approx(lost, abs=near)


@pytest.mark.parametrize("how", HOW, ids=lambda how: how[0])
@pytest.mark.parametrize(("friction", "kind"), [(0.1, "slip"), (0.9, "stick")])
def test_a_cushion_at_45_degrees(
    friction: float, kind: str, how: tuple[str, dict[str, Any], float]
) -> None:
    """Eq. 9: J_n = (1 + e) m v_n; the ball keeps v_t - mu (1 + e) v_n, or nothing."""
    ball = Ball("A", (0.5, 0.4), R, 0.2, velocity=(1.0, -1.0))
    scene = Scene(
        (ball,), Table.rectangle(2.0, 1.0), Restitution(cushion=0.7),
        Friction(cushion=friction), Physics(max_time=0.5),
    )  # fmt: skip
    [row] = simulate(scene, solver=how[0], **how[1]).contacts
    near, rest = how[2], max(1.0 - friction * 1.7, 0.0)
    assert (row.balls, row.cushion, row.kind) == (("A",), 0, kind)
    assert row.normal == pytest.approx((0.0, 1.0))
    assert row.point == pytest.approx((0.5 + 0.4 - R, 0.0), abs=near)
    assert row.impulse == pytest.approx(0.2 * 1.7, abs=near)
    assert row.tangential == pytest.approx(0.2 * (1.0 - rest), abs=near)  # along -x
    assert row.after == pytest.approx(np.array([(rest, 0.7)]), abs=near)
    assert row.impulses == pytest.approx(np.array([(0.2 * (rest - 1.0), 0.34)]), abs=near)
    assert row.lost == pytest.approx(0.1 * (2.0 - rest**2 - 0.49), abs=near)


def split(row: ContactRow, ball: int, velocities: tuple[Vector, ...]) -> Vector:
    """Return a velocity along the normal and the tangent."""
    assert row.normal is not None
    (nx, ny), (vx, vy) = row.normal, velocities[ball]
    return vx * nx + vy * ny, vy * nx - vx * ny


# -- sums ------------------------------------------------------------------------------------------


def pull(run: Run, row: Any) -> Any:
    """Return the deceleration (m/s^2) by the surface after a breakpoint, from v and w alone."""
    v, w = row[3:5], row[7:9] if len(row) > 7 else np.zeros(2)
    u, g = v - w, run.scene.physics.gravity
    if np.hypot(*u) > 1e-12 * (np.hypot(*v) + np.hypot(*w)):
        return -run.scene.friction.surface * g * u / np.hypot(*u)
    rolling = run.scene.friction.rolling or 0.0
    return -rolling * g * v / np.hypot(*v) if v.any() else np.zeros(2)


def breakpoints(run: Run, ball: int) -> Any:
    """Return the breakpoints of a ball; at the last one it falls into its pocket, if it does."""
    return run.knots[ball][:-1] if run.scene.balls[ball].id in run.pocketed else run.knots[ball]


def assert_momentum_adds_up(run: Run, within: float) -> None:
    """Impulses of contacts and of the surface are each ball's change of momentum (N s)."""
    given = {id_: np.zeros(2) for id_ in run.scene.index}
    whole = sum(b.mass * np.hypot(*rows[0, 3:5]) for b, rows in zip(run.scene.balls, run.knots))  # noqa: B905
    for row in run.contacts:
        for id_, impulse in zip(row.balls, row.impulses, strict=True):
            given[id_] += impulse
            whole += math.hypot(*impulse)
    for i, ball in enumerate(run.scene.balls):
        rows = breakpoints(run, i)
        rubbed = [ball.mass * t * pull(run, row) for row, t in zip(rows, np.diff(rows[:, 0]))]  # noqa: B905
        lacking = ball.mass * (rows[-1, 3:5] - rows[0, 3:5]) - given[ball.id] - sum(rubbed)
        assert np.hypot(*lacking) <= within * whole, ball.id


def energy(run: Run, i: int, v: Any, w: Any) -> float:
    mass = run.scene.balls[i].mass
    return float(mass / 2.0 * (v @ v) + mass / 5.0 * (w @ w))


def assert_energy_adds_up(run: Run, within: float) -> None:
    """What contacts take is the energy at the start less the surface's work and that at the end."""
    lost = sum(row.lost or 0.0 for row in run.contacts)
    taken = 0.0
    for i in range(len(run.scene.balls)):
        rows, fallen = breakpoints(run, i), len(breakpoints(run, i)) < len(run.knots[i])
        for k, (row, t) in enumerate(zip(rows, np.diff(rows[:, 0]))):  # noqa: B905
            v, w, a = row[3:5], row[7:9], pull(run, row)
            slides = len(w) and np.hypot(*(v - w)) > 1e-12 * (np.hypot(*v) + np.hypot(*w))
            w = w if len(w) else np.zeros(2)
            turned = w - 2.5 * t * a if slides else w + t * a * bool(w.any())
            last = energy(run, i, v + t * a, turned)
            taken += energy(run, i, v, w) - last
            if fallen and k == len(rows) - 2:
                taken += last  # The pocket takes it.
    whole = run.energy["initial"]
    assert lost == pytest.approx(whole - run.energy["final"] - taken, abs=within * whole)
    assert lost > 0.0


BUNDLED = [path.stem for path in sorted((ROOT / "scenarios").glob("*"))]


@pytest.mark.parametrize("name", BUNDLED)
def test_sums_on_bundled_scenes(name: str) -> None:
    hits = 0
    for run in simulate_all(load(name), solver="event-driven", max_time=3.0):
        assert not run.persistent
        hits += len(run.contacts)
        assert len(run.contacts) == sum(event.is_contact for event in run.events)
        assert_momentum_adds_up(run, 1e-12)
        if run.contacts:
            assert_energy_adds_up(run, 1e-12)
    assert hits > 0


@pytest.mark.parametrize(("solver", "within"), [("time-slice", 1e-9), ("pymunk-discrete", 1e-3)])
def test_sums_of_solvers_with_steps(solver: str, within: float) -> None:
    """A step of pymunk-discrete answers contacts, and then it has its friction."""
    for name in ("report", "carrom", "stadium"):
        run = simulate(load(name), 1, solver=solver, dt=1e-4, max_time=1.0)
        assert_momentum_adds_up(run, within)
        assert_energy_adds_up(run, within)


def test_momentum_adds_up_in_stock_pymunk() -> None:
    """Its balls spin; without friction of the surface nothing but contacts changes velocities."""
    for seed in (3, 4, 5, 6):
        scene = random_scene(seed)
        smooth = replace(scene, friction=replace(scene.friction, surface=0.0))
        run = simulate(smooth, solver="pymunk-builtin", max_time=2.0)
        assert_momentum_adds_up(run, 1e-9)


def test_a_contact_sticks_where_the_friction_of_a_step_hides_it() -> None:
    """The log of pymunk-discrete has velocities after the friction of the step."""
    exact_run = simulate(load("hexagon"), 1, solver="event-driven")
    run = simulate(load("hexagon"), 1, solver="pymunk-discrete", dt=1e-4)
    assert [row.kind for row in run.contacts].count("stick") == 3
    assert [row.kind for row in run.contacts] == [row.kind for row in exact_run.contacts]


def test_impulses_of_a_persistent_contact_are_in_the_sum() -> None:
    """A ball at rest stays in contact with one that slides behind it; no friction acts there."""
    run = exact(persistent(0.0))
    first, *others = run.contacts
    assert first.kind in ("stick", "slip")
    assert [row.kind for row in others] == ["persistent"]
    [row] = others
    assert row.until is not None and row.until > row.t
    assert (row.point, row.before, row.impulse, row.lost) == (None, (), None, None)
    for i, ball in enumerate(run.scene.balls):
        t = np.linspace(0.0, run.duration, 100_001)
        v = run.at(t)[1][:, i]
        speed = np.hypot(*v.T)[:, np.newaxis]
        slows = -run.scene.deceleration * np.divide(v, speed, np.zeros_like(v), where=speed > 0.0)
        rubbed = ball.mass * np.trapezoid(slows, t, axis=0)
        given = np.sum([r.impulses[r.balls.index(ball.id)] for r in run.contacts], axis=0)
        change = ball.mass * (run.knots[i][-1, 3:5] - run.knots[i][0, 3:5])
        assert change == pytest.approx(given + rubbed, abs=1e-6)


# -- instants, laws, solvers -----------------------------------------------------------------------


def test_a_chain_of_touching_balls_has_a_round_for_each_hit() -> None:
    balls = [Ball("0", (-0.2, 0.0), R, 0.2, velocity=(1.0, 0.0))]
    balls += [Ball(str(k), (2.0 * R * k, 0.0), R, 0.2) for k in (1, 2, 3)]
    scene = Scene(tuple(balls), None, Restitution(1.0), physics=Physics(max_time=0.5))
    rows = simulate(scene, solver="event-driven").contacts
    assert [row.balls for row in rows] == [("0", "1"), ("1", "2"), ("2", "3")]
    assert rows[1].t == rows[2].t
    for row in rows:
        assert [v for v, _ in row.before] == pytest.approx([1.0, 0.0])
        assert [v for v, _ in row.after] == pytest.approx([0.0, 1.0])


def test_contacts_that_are_answered_together_have_the_velocities_of_all() -> None:
    """Two balls, hit at once by a third, part from it at e times the speed of approach."""
    y = R * 1.001
    balls = (
        Ball("A", (-0.2, 0.0), R, 0.2, velocity=(1.0, 0.0)),
        Ball("B", (0.0, y), R, 0.2),
        Ball("C", (0.0, -y), R, 0.2),
    )
    scene = Scene(balls, None, Restitution(0.9), physics=Physics(max_time=0.5))
    run = simulate(scene, solver="event-driven")
    one, other = run.contacts[:2]
    assert one.t == other.t and one.before[0] == other.before[0] == (1.0, 0.0)
    assert one.after[0] == other.after[0]
    for row in (one, other):
        closing = split(row, 0, row.before)[0]
        parting = split(row, 1, row.after)[0] - split(row, 0, row.after)[0]
        assert parting == pytest.approx(0.9 * closing)


class Tearing(Law):
    """This law gives each ball of a hit a friction of its own, so that momentum is not kept."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        a, b = super().ball_ball(a, b, pair)
        return NT(a.n, 0.5 * a.t), NT(b.n, 0.7 * b.t)


class Gripping(Law):
    """Cushions of this law stop whatever slips."""

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        return NT(-0.5 * v.n, 0.0)


@pytest.mark.parametrize("law", [Tearing(), Gripping()], ids=lambda law: law.name)
def test_sums_under_a_law_of_ones_own(law: Law) -> None:
    run = simulate(load("report"), 1, solver="event-driven", law=law)
    assert_momentum_adds_up(run, 1e-12)
    assert_energy_adds_up(run, 1e-12)
    walls = {row.kind for row in run.contacts if row.cushion is not None}
    assert walls == {"stick"} if law.name == "Gripping" else "slip" in walls


@pytest.mark.parametrize("law", ["coulomb", "published", Tearing()])
def test_sums_in_a_frozen_rack(law: str | Law) -> None:
    """Contacts of one instant share balls, and come in rounds."""
    rack = frozen_rack(0.0)
    run = simulate(rack, solver="event-driven", law=law, max_time=0.3)
    assert sum(row.t == run.contacts[0].t for row in run.contacts) > 2
    assert not run.persistent
    assert_momentum_adds_up(run, 1e-9)
    assert_energy_adds_up(run, 1e-9)


def test_stock_pymunk_knows_no_kind_and_no_energy() -> None:
    """Its balls spin, and the run does not say how fast."""
    rows = simulate(load("two-balls"), solver="pymunk-builtin", max_time=0.5).contacts
    assert rows and all(row.kind is None and row.lost is None for row in rows)
    assert all(row.impulse and row.point and row.before and row.after for row in rows)


def test_a_run_without_impulses_has_places_alone() -> None:
    run = simulate(load("two-balls"), max_time=0.5)
    bare = type(run.events[0])(*[getattr(run.events[0], key) for key in ("t", "kind", "balls")])
    [row] = type(run)(**{**vars(run), "events": (bare,)}).contacts
    assert row.point == run.contacts[0].point
    assert (row.impulses, row.before, row.kind, row.lost) == ((), (), None, None)


def test_nobody_pays_who_does_not_ask(tmp_path: Path) -> None:
    run = simulate(load("report"), 1)
    run.save(tmp_path / "run.npz")
    run.write_events_csv(tmp_path / "events.csv")
    assert "contacts" not in vars(run)
    assert Run.load(tmp_path / "run.npz").contacts == run.contacts


# -- what is printed and written -------------------------------------------------------------------


def test_the_command_prints_tables_of_80_columns_and_writes_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    options = ("--no-pictures", "--max-time", 0.7, "--units", "scene", "--out", tmp_path)
    plain = typed("run", "report", "--shot", 1, *options)
    assert "J_n" not in plain.stdout and not (tmp_path / "shot-1-contacts.csv").exists()
    answer = typed("run", "report", "--shot", 1, "--contacts", *options)
    assert answer.returncode == 0, answer.stderr
    shown = answer.stdout.partition("Contacts.")[2].partition("Published ends")[0].splitlines()
    tables = [line for line in shown if line.lstrip()[:1].isdigit()]
    assert max(map(len, shown)) <= 80
    run = simulate(load("report"), 1, max_time=0.7)
    assert len(tables) == sum(1 + len(row.balls) for row in run.contacts)
    first = "1 0.13880 C, 1 42.30 21.61 -170.1 0.5753 0.0288 slip 0.3429"
    assert tables[0].split() == first.split()
    with (tmp_path / "shot-1-contacts.csv").open(newline="", encoding="utf-8") as file:
        heading, *rows = csv.reader(file)
    assert heading[:10] == ["t (s)", "until (s)", "kind", "ball", "other", "cushion", "x (in)",
                            "y (in)", "normal_x", "normal_y"]  # fmt: skip
    assert heading[-6:] == ["impulse (N s)", "tangential (N s)", "tangential_first (N s)",
                            "impulse_x (N s)", "impulse_y (N s)", "lost (J)"]  # fmt: skip
    for cells, row in zip(rows, run.contacts, strict=True):
        assert row.point is not None
        assert float(cells[0]) == row.t and float(cells[6]) == row.point[0] / 0.0254
        assert cells[10:14] == [repr(v) for both in zip(row.before, row.after, strict=True)
                                for pair in both for v in pair][:4]  # fmt: skip


def test_a_data_frame_has_a_row_for_each_contact() -> None:
    pytest.importorskip("pandas")
    run = simulate(load("report"), 1)
    frame = run.to_frame("contacts")
    assert frame["impulse"].tolist() == [row.impulse for row in run.contacts]
