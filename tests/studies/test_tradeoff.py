"""Work and precision are measured right on scenes whose errors and orders are known."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from pool_pymunk import (
    Ball,
    Friction,
    PersistentContact,
    Physics,
    Restitution,
    Scene,
    Table,
    load,
    simulate,
)
from pool_pymunk.cli import read
from pool_pymunk.cli.options import CompareOptions
from pool_pymunk.render.diagram import figure_of
from pool_pymunk.studies.compare import Comparison
from pool_pymunk.studies.grid import (
    Column,
    Setting,
    at_tolerances,
    begin,
    cheapest,
    order,
    sentences,
)
from tests.shared.scenes import columns_of, tradeoff, turned

STEPS = tuple(0.9e-2 / 3**k for k in range(6))


def _one_cushion() -> Scene:
    """Return a ball off one cushion: the only error is how late the hit is found."""
    return Scene(
        balls=(Ball("1", (0.5, 0.5), 0.05, 0.2, velocity=(1.5, 0.3)),),
        table=Table.rectangle(1.0, 1.0),
        restitution=Restitution(cushion=0.8),
        friction=Friction(surface=0.1, cushion=0.1),
    )


def _head_on() -> Scene:
    """Return a head-on pair."""
    return Scene(
        balls=(Ball("1", (0, 0), 0.05, 0.2, velocity=(1.0, 0)), Ball("2", (0.4, 0), 0.05, 0.1)),
        restitution=Restitution(0.9),
        friction=Friction(surface=0.1),
    )


@pytest.mark.parametrize("solver", ["pymunk-discrete", "time-slice"])
@pytest.mark.parametrize("scene", [_one_cushion(), _head_on()], ids=["cushion", "head-on"])
def test_a_late_contact_is_an_error_of_order_one(scene: Scene, solver: str) -> None:
    result = tradeoff(scene, columns_of(**{solver: STEPS}))
    assert all(s.shared == s.contacts for s in result.settings)
    found = order(result.of(solver), result.rounding, 1.0)
    assert found is not None
    assert 0.7 < found < 1.3
    for s in result.settings:  # It is found up to dt late, at up to 1.5 m/s before and after.
        assert s.dt is not None
        assert s.largest < 2 * 1.5 * s.dt


@pytest.mark.parametrize("scene", [_one_cushion(), _head_on()], ids=["cushion", "head-on"])
def test_swept_contacts_err_by_rounding_and_have_no_order(scene: Scene) -> None:
    result = tradeoff(scene, columns_of(pymunk=STEPS[:3], event_driven=(None,)))
    assert all(s.largest < 1e-14 for s in result.settings)
    assert order(result.of("pymunk"), result.rounding, 1.0) is None


def test_the_end_of_one_cushion_is_the_one_on_paper() -> None:
    """The ball has v^2 - 2 a s at the cushion, answers by Eq. 9, then slides to rest."""
    scene = _one_cushion()
    a, v = scene.deceleration, math.hypot(1.5, 0.3)
    ux, uy = 1.5 / v, 0.3 / v
    distance = 0.45 / ux
    fast = math.sqrt(v * v - 2 * a * distance)
    vn, vt = -0.8 * fast * ux, fast * uy - 0.1 * 1.8 * fast * ux
    length = math.hypot(vn, vt) / (2 * a)
    end = (0.95 + vn * length, 0.5 + distance * uy + vt * length)
    for solver in ("event-driven", "pymunk"):
        assert simulate(scene, solver=solver).final["1"] == pytest.approx(end, abs=1e-14)


@pytest.mark.parametrize("angle", [math.pi / 2, 0.5])
def test_turning_a_scene_turns_its_ends(angle: float) -> None:
    """A turn takes (x, y) to (c x - s y, s x + c y), starts and ends alike."""
    scene, (c, s) = load("report-corrected"), (math.cos(angle), math.sin(angle))
    other_scene = turned(scene, angle)
    ends = simulate(scene, 1, solver="event-driven").final
    others = simulate(other_scene, 1, solver="event-driven").final
    for ball, other in zip(scene.balls, other_scene.balls, strict=True):
        x, y = ball.position
        assert other.position == pytest.approx((c * x - s * y, s * x + c * y), abs=1e-14)
        x, y = ends[ball.id]
        assert others[ball.id] == pytest.approx((c * x - s * y, s * x + c * y), abs=1e-9)


def test_the_cheapest_setting_within_a_tolerance() -> None:
    def setting(dt: float, error: float, time: float, failure: str = "") -> Setting:
        return Setting("s", dt, error, error, 0, 0, time, 1, failure)

    good, slow = setting(1, 0.1, 1.0), setting(2, 0.01, 2.0)
    failed, coarse = setting(3, 0.0, 0.1, "max_time"), setting(4, 5.0, 0.5)
    assert cheapest([slow, good, failed, coarse], 0.2) is good
    assert cheapest([slow, good, failed, coarse], 0.05) is slow
    assert cheapest([good], 0.01) is None


def test_shots_that_hang_on_a_slip_of_zero_are_left_out() -> None:
    result = tradeoff(load("report"), columns_of(pymunk=(1 / 60,)))
    assert result.left_out == ("Simulation 4",)
    assert any("Simulation 4 is left out" in line for line in sentences(result))
    assert result.settings[0].contacts == 14 + 5 + 1


def test_the_time_is_the_least_one_of_seven(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, times, column = _head_on(), iter([3.0, 2.0, 5.0, 4.0, 7.0, 6.0, 8.0]), Column("pymunk")
    run = simulate(scene)
    monkeypatch.setattr(Column, "runs", lambda *_: iter([replace(run, wall_time=next(times))]))
    [setting] = begin(scene).measured(column, math.inf).settings
    assert (setting.time, setting.repeats, setting.failure) == (2.0, 7, "")


def test_failures_are_failures() -> None:
    """A ball that tunnels through its cushion still runs at max_time, so it has no error."""
    scene = Scene(
        balls=(Ball("1", (0.5, 0.5), 0.05, 0.2, velocity=(50.0, 0.0)),),
        table=Table.rectangle(1.0, 1.0),
        restitution=Restitution(cushion=0.5),
        friction=Friction(surface=0.1),
        physics=Physics(max_time=10.0),
    )
    result = tradeoff(scene, columns_of(pymunk=(1 / 60,), pymunk_discrete=(1 / 60,)))
    good, failed = result.settings
    assert (good.failure, failed.failure) == ("", "max_time")
    assert good.largest < 1e-12
    assert all(map(math.isnan, (failed.largest, failed.rms, failed.time)))
    assert result.of("pymunk-discrete") == []
    assert cheapest(result.settings, math.inf) is good
    lost = tradeoff(scene, columns_of(pymunk_discrete=(1 / 60,)))
    assert sentences(lost)[0] == "No step tried comes within 1 m."


def test_every_solver_is_measured_those_with_steps_first() -> None:
    columns, _ = read.columns(
        CompareOptions(scenario="", solvers="all"), load("report"), every=True
    )
    solvers = list(dict.fromkeys(each.solver for each in columns))
    assert solvers == ["pymunk", "pymunk-discrete", "pymunk-builtin", "time-slice", "event-driven"]
    assert columns[-1] == Column("event-driven", None)
    for solver in solvers:
        known = [each.dt for each in columns if each.dt and each.solver == solver]
        assert known == sorted(known, reverse=True)


def test_slices_of_the_reports_own_step_are_compared_with() -> None:
    """A step that is as precise costs less than the report's slices; it is said how much."""
    steps = columns_of(pymunk=(1 / 60,), time_slice=(1e-5, 1e-6))
    result = tradeoff(load("two-balls"), steps)
    times = {("pymunk", 1 / 60): 0.002, ("time-slice", 1e-5): 0.3, ("time-slice", 1e-6): 3.0}
    timed = [replace(s, time=times[s.solver, s.dt or 0.0]) for s in result.settings]
    assert sentences(replace(result, settings=tuple(timed)))[0] == (
        "Within 1 in: pymunk at 1/60 s does, in 2 ms, 1,500 times faster than slices of 1e-06 s."
    )


def test_the_diagram_has_logarithmic_axes_and_a_legend_beside_them() -> None:
    steps = {"pymunk": (1 / 60, 1e-3), "pymunk-discrete": (1 / 60, 1e-4), "event-driven": (None,)}
    figure = figure_of(replace(tradeoff(load("report"), columns_of(**steps)), spread=0.04))
    figure.draw_without_rendering()
    (axes,), (legend,) = figure.axes, figure.legends
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    texts = [text.get_text() for text in legend.get_texts()]
    assert [text.split("\n")[0] for text in texts] == [*steps, "less than uncertain starts"]
    assert texts[1] == "pymunk-discrete\n1/60 s to 0.0001 s"
    assert texts[2] == "event-driven\nexact to rounding, no step"
    beside = legend.get_window_extent()
    assert beside.x0 > axes.get_window_extent().x1 and figure.bbox.containsx(beside.x1)
    words = [text.get_window_extent() for text in legend.get_texts()]
    assert not any(a.overlaps(b) for k, a in enumerate(words) for b in words[:k])


# -- tolerances of contacts that persist -----------------------------------------------------------

TOLERANCES = (1e-4, 1e-5, 1e-6)  # m


def _bounces_on() -> Scene:
    """Return a ball that turns fast behind another one, and bounces on it ever lower."""
    radius, mass = 0.0286, 0.17
    balls = (
        Ball("b0", (0.0, 0.0), radius, mass, velocity=(0.602, 0.0), roll=4.31),
        Ball("b1", (0.057307, 0.0), radius, mass, velocity=(0.602, 0.0), roll=1.0),
    )
    return Scene(balls, None, Restitution(0.9), Friction(0.25, 0.0, 0.0, rolling=0.01))


def test_errors_at_tolerances_are_distances_from_a_tenth_of_the_finest_one() -> None:
    scene = _bounces_on()
    result = begin(scene, tolerances=TOLERANCES)
    for column in at_tolerances(TOLERANCES):
        result = result.measured(column)
    [reference] = result.references
    assert reference.contact_tolerance == pytest.approx(1e-7)
    assert [s.contact_tolerance for s in result.settings] == list(TOLERANCES)
    for s in result.settings:
        run = simulate(scene, solver="event-driven", contact_tolerance=s.contact_tolerance)
        assert s.largest == Comparison(reference, run).largest > result.last_digit
        assert s.events == len(run.events) > 0
        assert (s.solver, s.dt, s.failure) == ("event-driven", None, "")
    errors = [s.largest for s in result.settings]
    assert errors == sorted(errors, reverse=True)


def test_a_distance_of_none_counts_as_a_last_digit() -> None:
    """Both runs round alike, so rounding is no error of theirs."""
    result = begin(load("report"), [load("report").shots[0]], TOLERANCES)
    [setting] = result.measured(at_tolerances(TOLERANCES)[0]).settings
    assert 0.0 < setting.largest == setting.rms == result.last_digit < result.rounding


def test_the_diagram_names_the_tolerances() -> None:
    def setting(tolerance: float) -> Setting:
        error = 30.0 * tolerance
        return Setting("event-driven", None, error, error, 0, 0, 1e-3, 1, "", tolerance, 9)

    result = replace(begin(_bounces_on()), settings=tuple(map(setting, TOLERANCES)))
    assert order(result.settings, 0.0, 1.0) == pytest.approx(1.0)
    figure = figure_of(result)
    (axes,), (legend,) = figure.axes, figure.legends
    assert [text.get_text() for text in axes.texts] == ["0.0001 m", "1e-05 m", "1e-06 m"]
    [said] = [text.get_text() for text in legend.get_texts()]
    assert said == "event-driven\n0.0001 m to 1e-06 m\norder 1.0"


def test_errors_are_told_as_multiples_of_the_tolerance() -> None:
    contact = PersistentContact(("b0", "b1"), None, 0.0, 1.0, (0.0, 0.0))
    result = begin(_bounces_on(), tolerances=(1e-5,))
    [reference] = result.references
    setting = Setting("event-driven", None, 3e-4, 3e-4, contact_tolerance=1e-5)
    none = replace(result, references=(replace(reference, persistent=()),), settings=(setting,))
    assert sentences(none) == [
        "No contact persists in these shots, so their tolerance does not matter."
    ]
    lasted = replace(reference, persistent=(contact,))
    said = sentences(replace(none, references=(lasted,)))
    assert said[0] == "The largest error is 30 times the tolerance, at 1e-05 m."
    assert said[1].startswith("Errors are distances from runs at 1e-06 m, which may be off by")
