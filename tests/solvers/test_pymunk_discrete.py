"""The method in one file answers by the law alone, and converges to the exact solver."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pool_pymunk import (
    NT,
    SOLVERS,
    Ball,
    Friction,
    Law,
    Pair,
    Physics,
    Post,
    Restitution,
    Run,
    Scene,
    Table,
    load,
    simulate,
)
from pool_pymunk.cli import read
from pool_pymunk.cli.options import CompareOptions
from pool_pymunk.solvers import options_for
from tests.shared.scenes import off_exact, share_of, takes_long

R = 0.05


def discrete(scene: Scene, shot: int | None = None, **settings: object) -> Run:
    return simulate(scene, shot, solver="pymunk-discrete", **settings)  # type: ignore[arg-type]


def on_plane(*rows: tuple[float, float, float, float], time: float = 0.5) -> Scene:
    """Return lossy, rough balls at x, y (m) that move with vx, vy (m/s), on an open plane."""
    balls = tuple(
        Ball(str(k), (x, y), R, 0.2, velocity=(vx, vy)) for k, (x, y, vx, vy) in enumerate(rows)
    )
    return Scene(balls, None, Restitution(0.9), Friction(ball_ball=0.1), Physics(max_time=time))


# -- it converges ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shot", "coarse", "low", "high"),
    [
        pytest.param(1, 5e-4, 0.8, 2.2, marks=takes_long),
        (2, 1e-2, 0.7, 1.2),
        (3, 1e-2, 0.7, 1.2),
    ],
)
@pytest.mark.parametrize(
    ("name", "law"), [("report", "published"), ("report-corrected", "coulomb")]
)
def test_the_reports_ends_converge_with_order_one(
    name: str, law: str, shot: int, coarse: float, low: float, high: float
) -> None:
    """Shot 1 is amplified so much that above 5e-4 s its error is the size of the scene."""
    steps = np.geomspace(coarse, 1e-4, share_of(7, 4))
    errors = [typical_error(load(name), law, shot, dt) for dt in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert low < slope < high


def typical_error(scene: Scene, law: str, shot: int, dt: float) -> float:
    """Return a mean over near steps, because a contact is late by any share of a step."""
    near = [dt * share for share in (0.93, 0.97, 1.0, 1.03, 1.07)]
    errors = [off_exact(discrete(scene, shot, dt=step), law, shot) for step in near]
    return math.exp(sum(map(math.log, errors)) / len(errors))


# -- what answers ----------------------------------------------------------------------------------


class Ghostly(Law):
    """This law changes nothing: what meets goes on."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        return a, b

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        return v


def test_pymunk_itself_answers_nothing() -> None:
    """Under a law that changes nothing, balls go through each other, cushions and posts."""
    scene = replace(
        on_plane((0.3, 0.5, 2.0, 0.0), (0.8, 0.52, 0.0, 0.0), time=1.5),
        table=Table.rectangle(2.0, 1.0),
        posts=(Post((1.4, 0.5), 0.05),),
        restitution=Restitution(0.9, None, 0.9),
    )
    run = discrete(scene, dt=1e-3, law=Ghostly())
    assert run.final["0"] == pytest.approx((3.3, 0.5), abs=1e-9)
    assert run.final["1"] == (0.8, 0.52)
    met = [(event.kind, event.cushion) for event in run.events if event.is_contact]
    assert set(met) == {("ball-ball", None), ("ball-cushion", 1), ("ball-cushion", 4)}


def test_a_hit_is_answered_by_the_law_and_friction_takes_its_share_of_each_step() -> None:
    """Eqs. 1-7 in the frame of the normal at the step's end, then Eq. 10, in numbers by hand."""
    dt, e, mu, a = 1e-2, 0.9, 0.1, 0.2 * 9.80665
    scene = on_plane((0.0, 0.0, 2.0, 0.0), (0.15, 0.06, 0.0, 0.0))
    scene = replace(scene, friction=Friction(0.2, 0.0, mu))
    run = discrete(scene, dt=dt)
    t, v = 3 * dt, 2.0 - 3 * a * dt  # In the fourth step the balls overlap.
    x = 2.0 * t - a * t * t / 2.0 + v * dt
    nx, ny = (0.15 - x) / math.hypot(0.15 - x, 0.06), 0.06 / math.hypot(0.15 - x, 0.06)
    j_n = (1.0 + e) * v * nx / 2.0
    j_t = -mu * j_n  # The slip is v t = -v ny, and more friction is at hand than it takes.
    after = [
        (v - j_n * nx + j_t * ny, -j_n * ny - j_t * nx),
        (j_n * nx - j_t * ny, j_n * ny + j_t * nx),
    ]
    for i, (ux, uy) in enumerate(after):
        share = a * dt / math.hypot(ux, uy)
        t, at_x, at_y, vx, vy = run.knots[i][1, :5]
        assert t == 4 * dt
        assert (vx, vy) == pytest.approx((ux * (1.0 - share), uy * (1.0 - share)), abs=1e-14)
        # The step ends half of the loss times dt before where pymunk has moved the ball.
        assert at_x == pytest.approx((x, 0.15)[i] - ux * share * dt / 2.0, abs=1e-14)
        assert at_y == pytest.approx((0.0, 0.06)[i] - uy * share * dt / 2.0, abs=1e-14)


def test_sides_that_friction_presses_together_are_few_events() -> None:
    """They touch in most of the steps that follow, and the law answers them each time."""
    balls = (
        Ball("a", (0.0, 0.0), R, 0.2, velocity=(0.0697, 0.0717)),
        Ball("b", (0.1, 0.0), R, 0.2, velocity=(0.0348, 0.0)),
    )
    run = discrete(Scene(balls, None, Restitution(0.0), Friction(0.1)), dt=1e-4)
    assert 1 <= sum(event.is_contact for event in run.events) <= 3
    assert max(len(rows) for rows in run.knots) > 100


@pytest.mark.parametrize("bulge", [0.2, -0.2])
def test_a_contact_with_an_arc_is_late_by_less_than_a_step(bulge: float) -> None:
    """The segments lie up to 4e-5 radii off the arc, which is more than the ball travels then."""
    corners = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
    table, dt = Table(corners, (bulge, 0.0, 0.0, 0.0)), 1e-5
    for x in (0.9, 0.9312, 1.0, 1.0007):
        ball = Ball("0", (x, 0.3000034), R, 0.2, velocity=(0.0, -1.0))
        scene = Scene((ball,), table, Restitution(cushion=1.0), physics=Physics(max_time=0.7))
        late, exact = (
            simulate(scene, solver=name, dt=step).events[0].t
            for name, step in (("pymunk-discrete", dt), ("event-driven", None))
        )
        assert 0.0 < late - exact < dt


@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_arcs_bounce_as_round_as_they_are(gap: float) -> None:
    """A ball along a diameter of a circle comes back along it, at whatever angle."""
    table = Table.circle(1.0)
    for degrees in (0.0, 10.25, 33.4, 181.7):
        ux, uy = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        (x, y) = (1.0 + gap * ux, 1.0 + gap * uy)
        ball = Ball("0", (x, y), R, 0.2, velocity=(ux, uy))
        scene = Scene((ball,), table, Restitution(cushion=1.0), physics=Physics(max_time=4.0))
        run = discrete(scene, dt=1e-4)
        (vx, vy), (ex, ey) = run.end.velocity[0], run.final["0"]
        assert abs(vx * uy - vy * ux) < 1e-11
        assert abs((ex - 1.0) * uy - (ey - 1.0) * ux) < 1e-11


# -- laws of one's own -----------------------------------------------------------------------------


class Broken(Law):
    """This law fails at the second ball that it is asked about."""

    def __init__(self) -> None:
        self.asked = 0

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        self.asked += 1
        raise LookupError(f"no answer {self.asked}")


def test_what_a_law_raises_arrives_after_the_step() -> None:
    """pymunk swallows it; the first one is raised, and the law is asked no more."""
    scene = on_plane((-0.11, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), (0.11, 0.0, -1.0, 0.0))
    law = Broken()
    with pytest.raises(LookupError, match="no answer 1"):
        discrete(scene, dt=1e-3, law=law)
    assert law.asked == 1


# -- options ---------------------------------------------------------------------------------------


def test_contacts_is_no_option_any_more() -> None:
    scene = load("two-balls")
    with pytest.warns(DeprecationWarning, match='contacts="swept" does nothing') as heard:
        run = simulate(scene, contacts="swept")
    assert heard[0].filename == __file__
    assert run.final == simulate(scene).final


def test_each_solver_of_a_study_gets_the_options_that_it_takes() -> None:
    """An option that no solver takes stays, and is refused; that of one kind changes none."""
    for value, takers in (
        ("joint", {"pymunk"}),
        ("callback", {"pymunk", "pymunk-discrete"}),
        ("glue", set(SOLVERS)),
    ):
        asked = {"friction": value}
        found = {name for name, each in SOLVERS.items() if options_for(each, asked) == asked}
        assert found == takers
    scene = load("two-balls")
    assert discrete(scene, friction="callback").final == discrete(scene).final
    columns, _ = read.columns(CompareOptions(scenario="", friction="joint"), scene)
    assert [each.options for each in columns] == [{"friction": "joint"}, {}, {}]
