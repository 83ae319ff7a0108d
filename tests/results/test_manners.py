"""Python objects behave as people expect: arguments, results, files, shots, states."""

from __future__ import annotations

import csv
import json
import math
import pickle
import sys
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pool_pymunk import (
    NT,
    SOLVERS,
    Ball,
    Friction,
    Law,
    Pair,
    Physics,
    Pocket,
    Restitution,
    Run,
    Scene,
    SettingError,
    Shot,
    State,
    Table,
    Units,
    load,
    loads,
    simulate,
    simulate_all,
)
from pool_pymunk.model.scenario import bundled
from pool_pymunk.model.scenario_out import in_units, scenario_text
from pool_pymunk.solvers import Settings
from tests.shared.scenes import TABLES, random_scene

STEPS = {"time-slice": 1e-3, "pymunk-discrete": 1e-3}  # s; those that are too fine by default
REPORT = load("report-corrected")
PLACES = [ball.position for ball in REPORT.balls]
AT_REST = [(0.0, 0.0)] * len(PLACES)
INF, NAN = math.inf, math.nan
any_ball: Any = Ball  # for values that the type checker would not let pass
any_shot: Any = Shot
any_scene: Any = Scene
any_table: Any = Table
any_replace: Any = replace

every_solver = pytest.mark.parametrize("solver", SOLVERS)


def played(solver: str, scene: Scene = REPORT, **arguments: Any) -> Run:
    """The first shot of a scene, at a step that is quick."""
    return simulate(scene, **{"solver": solver, "dt": STEPS.get(solver)} | arguments)


@cache
def whole(solver: str) -> Run:
    """The first shot of the report, up to its end."""
    return played(solver)


def line_of(make: Callable[[], object]) -> str:
    """The one line of the ValueError that comes of it."""
    with pytest.raises(ValueError) as caught:
        make()
    (line,) = str(caught.value).splitlines()
    return line


def disc(id_: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> Ball:
    return Ball(id_, (x, y), 0.05, 0.2, velocity=(vx, vy))


def plane(*balls: Ball, friction: float = 0.1, **parts: Any) -> Scene:
    return Scene(balls, restitution=Restitution(0.9), friction=Friction(friction), **parts)


# -- arguments -------------------------------------------------------------------------------------


class Mine(Law):
    """A law of one's own."""


def any_run() -> Any:
    return played("pymunk")


@every_solver
def test_a_start_that_nothing_would_stop_needs_max_time(solver: str) -> None:
    still, start = plane(disc("a", 0, 0), friction=0.0), ([(0, 0)], [(1, 0)])
    assert "max_time = None: is missing" in line_of(lambda: played(solver, still, start=start))
    assert played(solver, still, start=start, max_time=0.5).final["a"] == pytest.approx((0.5, 0))


@pytest.mark.parametrize("bad", [INF, NAN])
@pytest.mark.parametrize("solver", ["time-slice", "pymunk-builtin", "event-driven"])
def test_numbers_out_of_range_end_a_run_as_non_finite(solver: str, bad: float) -> None:
    """``simulate`` refuses such a start, so the solver is asked itself."""
    start = State(((0.0, 0.0), (1.0, 0.0)), ((bad, 0.0), (0.0, 0.0)))
    settings = Settings(SOLVERS[solver].dt, max_time=1.0)
    scene = plane(disc("a", 0, 0), disc("b", 1, 0))
    assert SOLVERS[solver].solve(scene, start, settings).status == "non_finite"


def listening() -> tuple[Law, list[object]]:
    """A law that remembers what kinds of numbers it was given."""
    heard: list[object] = []

    class Listening(Law):
        def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
            heard.extend(map(type, (*a, *b, *pair)))
            return super().ball_ball(a, b, pair)

    return Listening(), heard


@pytest.mark.parametrize("solver", [name for name in SOLVERS if not SOLVERS[name].own_law])
def test_numbers_and_arrays_of_numpy_work_and_stay_outside(solver: str) -> None:
    one, f, any_law = np.float32(1.0), np.float64, listening()
    coefficients: Any = (f(0.9), None, one), (f(0.1), np.float16(0.5), np.int64(0))
    balls = [
        any_ball(np.str_("C"), np.array([0.5, 0.5]), f(0.03), np.float32(0.25), np.bool_(True)),
        any_ball("1", [one, f(0.52)], np.array(0.03), 1),
    ]
    scene = any_scene(
        balls,
        any_table(np.array([[0, 0], [2, 0], [2, 1], [0, 1]])),
        Restitution(*coefficients[0]),
        Friction(*coefficients[1]),
        any_replace(Physics(), gravity=f(9.8), max_time=np.int32(5)),
        [any_shot("s", "C", speed=f(2.0), angle=np.int8(0))],
    )
    plain = loads(scene.to_toml())
    assert plain == scene
    for part in ("balls", "table", "restitution", "friction", "physics", "shots"):
        assert repr(getattr(scene, part)) == repr(getattr(plain, part))
    asked: dict[str, Any] = {
        "shot": np.int64(1), "dt": f(1e-3), "times": np.linspace(0, 1, 5), "max_time": f(3),
        "start": np.array([[[0.5, 0.5], [1.0, 0.52]], [[0, 0], [0, 0]]]), "max_events": np.int64(4),
    }  # fmt: skip
    run = simulate(scene, solver=solver, law=any_law[0], **asked)
    assert set(any_law[1]) == {float}
    same = simulate(plain, 1, solver=solver, law=any_law[0], dt=1e-3, max_time=3.0, max_events=4,
                    times=[0, 0.25, 0.5, 0.75, 1])  # fmt: skip
    assert run == same
    assert json.dumps(run.as_dict()) == json.dumps(same.as_dict() | {"wall_time": run.wall_time})
    assert {type(x) for point in (*run.end.position, *run.end.velocity) for x in point} == {float}
    assert any_ball("8", (Fraction(1, 2), 0), 1, 1).position == (0.5, 0.0)


# -- max_events ------------------------------------------------------------------------------------


@every_solver
@pytest.mark.parametrize("most", [1, 2, 3, 7])
def test_exactly_max_events_are_listed_and_the_run_ends_at_the_last(solver: str, most: int) -> None:
    cut = played(solver, max_events=most)
    assert (cut.status, cut.success) == ("max_events", False)
    assert cut.events == whole(solver).events[:most]
    assert cut.duration == cut.events[-1].t
    assert cut.end.position == pytest.approx(whole(solver).at(cut.duration)[0], abs=1e-12)
    assert all(breakpoints[-1, 0] <= cut.duration for breakpoints in cut.knots)


@every_solver
def test_the_run_ends_where_the_last_event_is_though_the_solver_went_on(solver: str) -> None:
    """One ball stops before the other, and no solver needs to look at what is between."""
    scene = plane(disc("slow", 0, 0, 1.0), disc("fast", 0, 1, 2.0))
    uncut, run = played(solver, scene), played(solver, scene, max_events=1)
    assert [event.balls for event in run.events] == [("slow",)]
    assert run.duration == uncut.events[0].t < uncut.duration
    assert all(breakpoints[-1, 0] <= run.duration for breakpoints in run.knots)
    assert run.end.velocity[1] == pytest.approx((1.0, 0.0), rel=1e-2)


@every_solver
def test_as_many_as_there_are_is_no_bound_and_one_less_is(solver: str) -> None:
    events = whole(solver).events
    assert "stop" in {event.kind for event in events}
    enough = played(solver, max_events=len(events))
    assert (enough.status, enough.events) == ("settled", events)
    assert played(solver, max_events=len(events) - 1).status == "max_events"


@every_solver
@pytest.mark.parametrize("most", [2, 4])
def test_of_contacts_and_stops_at_one_instant_exactly_max_events_are_listed(
    solver: str, most: int
) -> None:
    """Three pairs meet at once and, as they are alike, all six balls stop at once."""
    pairs = [disc(f"{k}{s}", s * 0.2, k, -s * 1.0) for k in range(3) for s in (-1, 1)]
    events = played(solver, plane(*pairs)).events
    assert [event.kind for event in events] == ["ball-ball"] * 3 + ["stop"] * 6
    run = played(solver, plane(*pairs), max_events=most)
    assert (run.status, run.events) == ("max_events", events[:most])


# -- objects ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", bundled())
def test_reprs_are_short_and_say_the_most_important(name: str) -> None:
    scene = load(name)
    solver, step = ("event-driven", "") if scene.surface.rolls else ("pymunk", " at 1/240 s")
    run = simulate(scene, solver=solver, max_time=0.5)
    for text in (repr(scene), repr(run), *map(repr, scene.shots)):
        assert len(text.splitlines()) <= 5 and len(text) < 400
    assert f"<Scene {scene.title!r}: balls {scene.balls[0].id}, " in repr(scene)
    assert f"<Run {scene.shots[0].name!r} by {solver}{step}, law {run.law}:" in repr(run)
    assert f"{run.status} at {run.duration:.6g} s, {len(run.events)} event" in repr(run)
    assert (" step" in repr(run)) == (run.dt is not None)
    assert repr(REPORT.shots[0]) == "Shot('Simulation 1', 'C', velocity=(-4.0, 0.0))"


@pytest.mark.parametrize(
    ("bounds", "success", "message"),
    [
        ({}, True, "Every ball is at rest."),
        ({"max_time": 0.5}, True, "The run ended at max_time, and balls still move."),
        ({"max_events": 3}, False, "The run ended at max_events, before all was at rest."),
    ],
)
def test_success_and_message(bounds: dict[str, Any], success: bool, message: str) -> None:
    run = simulate(REPORT, 1, **bounds)
    assert (run.success, run.message) == (success, message)


def test_a_run_says_which_law_answered() -> None:
    laws: list[Any] = [None, "published", Mine()]
    assert [simulate(REPORT, law=law).law for law in laws] == ["coulomb", "published", "Mine"]
    assert simulate(REPORT, solver="pymunk-builtin").law == "pymunk-builtin"


def test_scenes_and_runs_compare_and_can_be_keys() -> None:
    assert {load("report"): 1}[load("report")] == 1
    assert load("report") != REPORT

    def played(shot: int = 1, **how: Any) -> Run:
        return simulate(REPORT, shot, **{"max_time": 0.2} | how)

    run, again = played(), played()
    assert run.wall_time != again.wall_time
    assert run == again and hash(run) == hash(again)
    others = (
        played(2), played(max_time=0.1), played(times=[0.0]), played(dt=1e-3),
        replace(run, law="x"), replace(run, off=frozenset("1")),
        replace(run, knots=(run.knots[0] + 1e-16, *run.knots[1:])), "a run",
    )  # fmt: skip
    assert all(run != other for other in others)


def test_at_takes_a_single_time_or_a_sequence() -> None:
    run = simulate(REPORT, 1)
    position, velocity = run.at(0.25)
    assert position.shape == velocity.shape == (11, 2)
    for times in ([0.25], (0.25,), np.array([0.25])):
        positions, velocities = run.at(times)
        assert positions.shape == velocities.shape == (1, 11, 2)
        assert (positions[0] == position).all() and (velocities[0] == velocity).all()
    assert run.at([])[0].shape == (0, 11, 2)


def test_samples_come_sixty_a_second_and_end_with_the_run() -> None:
    run = simulate(plane(disc("a", 0.0, 0.0, 1.0), friction=0.3), solver="event-driven")
    assert run.t[-1] == run.duration == pytest.approx(1.0 / (0.3 * 9.80665))
    np.testing.assert_allclose(np.diff(run.t)[:-1], 1 / 60, atol=1e-15)
    assert 0.0 < np.diff(run.t)[-1] <= 1 / 60
    assert run.velocity[-1].tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize(
    "how",
    [
        {"velocity": (0.0, 2.0)},
        {"speed": 2.0, "angle": 90.0},
        {"speed": 2, "aim": "1"},
    ],
    ids=str,
)
def test_a_shot_says_in_one_of_three_ways_how_it_starts(how: dict[str, Any]) -> None:
    shot = Shot("up", "C", **how)
    scene = plane(disc("C", 0, 0), disc("1", 0, 1), shots=(shot,))
    assert scene.start(shot).velocity[0] == pytest.approx((0.0, 2.0), abs=1e-15)
    assert loads(scene.to_toml()).shots == (shot,)
    if "speed" in how:
        assert replace(shot, speed=3.0).speed == 3.0
    assert "give either velocity or" in line_of(
        lambda: replace(shot, velocity=(1, 0), speed=1, aim=None, angle=None)
    )


# -- pictures, films and tables --------------------------------------------------------------------


def test_plots_are_figures_and_files(tmp_path: Path) -> None:
    run = simulate(load("two-balls"))
    for what in ("start", "end", "energy"):
        figure = any_run().plot(what, str(tmp_path / f"{what}.png"), dpi=40)
        assert (tmp_path / f"{what}.png").read_bytes().startswith(b"\x89PNG")
        assert figure.axes
    assert [axes.get_ylabel() for axes in run.plot("energy").axes] == [
        "kinetic energy (J)", "size of momentum (N s)",
    ]  # fmt: skip
    with pytest.raises(RuntimeError, match=r"must end in one of .png, .svg, .pdf"):
        run.plot(path=tmp_path / "end.txt")


def test_the_energy_drawn_is_that_of_the_run() -> None:
    from pool_pymunk.render.plots import energy_and_momentum

    run = simulate(load("two-balls"))
    t, energy, momentum = energy_and_momentum(run)
    assert (energy[0], energy[-1]) == (run.energy["initial"], pytest.approx(run.energy["final"]))
    masses = [ball.mass for ball in run.scene.balls]
    start = np.array(masses) @ run.velocity[0]
    assert momentum == pytest.approx(np.full(len(t), math.hypot(*start)))  # only the balls push
    (hit,) = (event.t for event in run.events)
    assert {hit, math.nextafter(hit, 0.0)} <= set(t)  # the step is upright
    assert set(np.round(energy[t < hit], 12)) == {round(float(energy[0]), 12)}
    assert set(np.round(energy[t >= hit], 12)) == {round(float(energy[-1]), 12)}


def test_the_energy_of_a_ball_that_slides_until_it_rolls() -> None:
    """It loses (1/2) m (2/7) v0^2 of its own motion's energy until it rolls, roll included."""
    from pool_pymunk.render.plots import energy_and_momentum

    mass, speed, a = 0.17, 2.0, 0.2 * 9.80665
    ball = Ball("C", (0.0, 0.0), 0.03, mass, velocity=(speed, 0.0))
    run = simulate(Scene((ball,), friction=Friction(0.2, rolling=0.01)), solver="event-driven")
    rolls = 2.0 * speed / (7.0 * a)
    t = np.linspace(0.0, rolls, 7)
    own, roll = 0.5 * mass * (speed - a * t) ** 2, 0.2 * mass * (2.5 * a * t) ** 2
    assert run.energy_at(t) == pytest.approx(own + roll, rel=1e-12)
    assert run.energy_at(rolls) == pytest.approx(5.0 / 7.0 * 0.5 * mass * speed**2)
    assert run.energy_at(rolls) == run.energy_at([rolls])[0]
    drawn = energy_and_momentum(run)
    assert drawn[1] == pytest.approx(run.energy_at(drawn[0]))


def test_to_frame_is_the_table_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    run = simulate(load("two-balls"), times=[0.0, 0.5])
    pandas: Any = ModuleType("pandas")
    pandas.DataFrame = lambda rows, columns: (rows, columns)
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    rows, columns = run.to_frame()
    assert columns == ["t", "ball", "x", "y", "vx", "vy", "energy"]
    assert [row[:2] for row in rows] == [[0.0, "A"], [0.0, "B"], [0.5, "A"], [0.5, "B"]]
    assert rows[3][2:6] == [*run.position[1, 1], *run.velocity[1, 1]]
    assert rows[2][6] + rows[3][6] == pytest.approx(float(run.energy_at(0.5)))
    [hit], columns = run.to_frame("events")
    assert columns[:6] == ["t", "kind", "ball", "other", "cushion", "pocket"]
    assert columns[6:] == ["impulse", "tangential", "tangential_first"]
    assert hit == (run.events[0].t, "ball-ball", "A", "B", None, None, *run.events[0].impulses)
    with pytest.raises(SettingError, match=r"^what = "):
        run.to_frame("shots")  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"^to_frame needs pandas: pip install pandas$"):
        run.to_frame()


@pytest.mark.parametrize("what", ["samples", "events", "persistent", "contacts"])
def test_tables_say_the_same_in_all_their_forms(what: Any, tmp_path: Path) -> None:
    run = simulate(load("eight-ball"), 1, solver="event-driven", max_time=1.0)
    table = run.table(what, run.scene.units)
    table.csv(tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(newline="", encoding="utf-8") as file:
        heading, *lines = csv.reader(file)
    rows, columns = table.json(), table.arrays()
    assert len(lines) == len(rows) and len(heading) == len(columns)
    assert (what == "persistent") == (not rows)
    for k, (key, column) in enumerate(columns.items()):
        assert heading[k].startswith(key) and len(column) == len(rows)
        for cell, value, row in zip(
            [line[k] for line in lines], column.tolist(), rows, strict=True
        ):
            said = row[key]
            assert cell == ("" if said is None else str(said))
            assert value == said or (said is None and (value in ("", -1) or math.isnan(value)))


@pytest.mark.parametrize("what", ["end", "energy"])
def test_a_notebook_shows_a_figure_without_a_backend(what: Any) -> None:
    """IPython asks for this picture where no line has chosen a backend of matplotlib."""
    png = simulate(load("two-balls"), max_time=1.0).plot(what)._repr_png_()
    assert png.startswith(b"\x89PNG") and len(png) > 1000


def test_paths_may_be_text(tmp_path: Path) -> None:
    run = simulate(load("two-balls"))
    for name in ("write_npz", "write_csv", "write_events_csv", "save"):
        getattr(run, name)(str(tmp_path / f"{name}.npz"))
        assert (tmp_path / f"{name}.npz").stat().st_size > 10
    REPORT.to_toml(str(tmp_path / "mine.toml"))
    too_long = str(tmp_path / f"{300 * 'a'}.toml")
    with pytest.raises(OSError, match="toml") as caught:
        REPORT.to_toml(too_long)
    assert caught.value.filename == too_long  # and not the name of a temporary file
    assert load(str(tmp_path / "mine.toml")) == REPORT
    assert Run.load(str(tmp_path / "save.npz")) == run


# -- runs and scenes as files ----------------------------------------------------------------------


@every_solver
def test_a_saved_run_is_the_same_to_the_last_bit(solver: str, tmp_path: Path) -> None:
    law = None if SOLVERS[solver].own_law else Mine()
    start = State(tuple(PLACES), tuple(AT_REST), frozenset({"10"}))
    run = played(solver, law=law, times=[0.1, 1 / 3], start=start, max_time=2.0)
    run.save(tmp_path / "one")
    loaded = Run.load(tmp_path / "one")
    assert loaded == run and loaded.wall_time == run.wall_time and loaded.off == {"10"}
    times = np.linspace(0.0, 2.0, 1001)
    for before, after in zip(run.at(times), loaded.at(times), strict=True):
        assert before.tobytes() == after.tobytes()
    assert loaded.as_dict() == run.as_dict()


def test_runs_of_all_kinds_can_be_saved(tmp_path: Path) -> None:
    runs = (
        *simulate_all(load("hexagon"), solver="event-driven"),
        simulate(plane(disc("a", 0, 0, 1.0), disc("b", 1, 0))),
        simulate(REPORT, solver="event-driven", max_events=2),
        simulate(load("report"), "Simulation 4"),
    )
    for run in runs:
        run.save(tmp_path / "run.npz")
        assert Run.load(tmp_path / "run.npz") == run


@pytest.mark.parametrize("name", bundled())
def test_a_bundled_scene_survives_its_own_file(name: str) -> None:
    scene = load(name)
    text = scene.to_toml()
    assert loads(text) == scene
    assert "numbers" not in text  # they are in the scene's own units
    assert "66.0" in text or name not in ("report", "report-corrected")


letters = st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"])
names = st.text(letters, min_size=1, max_size=6).filter(str.strip)
sizes = st.floats(1e-3, 10.0)
speeds = st.floats(-1e3, 1e3)
units = st.builds(
    Units, st.sampled_from(["m", "cm", "mm", "in"]), st.sampled_from(["kg", "g"]),
    st.sampled_from(["m/s", "in/s"]),
)  # fmt: skip
launches = st.one_of(
    st.fixed_dictionaries({"velocity": st.tuples(speeds, speeds)}),
    st.fixed_dictionaries({"speed": sizes, "angle": st.floats(-1e4, 1e4)}),
    st.fixed_dictionaries({"speed": sizes, "aim": st.just("nearest")}),
)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Any scene: random balls on any table, with names, shots and units of all kinds."""
    made = random_scene(draw(st.integers(0, 10**6)), draw(st.sampled_from(list(TABLES))))
    ids = draw(st.lists(names, min_size=len(made.balls), max_size=len(made.balls), unique=True))
    shots = draw(st.lists(st.tuples(names, launches, st.booleans()), unique_by=lambda s: s[0]))
    point = st.tuples(speeds, speeds)
    balls = [
        replace(ball, id=id_, mass=draw(sizes), color=draw(st.sampled_from([None, "#12abEF"])))
        for ball, id_ in zip(made.balls, ids, strict=True)
    ]
    played_shots = [
        Shot(
            name,
            draw(st.sampled_from(ids)),
            **how,
            from_previous=k > 0 and goes_on,
            published=draw(st.dictionaries(st.sampled_from(ids), point, max_size=2)),
        )
        for k, (name, how, goes_on) in enumerate(shots)
    ]
    return replace(
        made,
        balls=tuple(balls),
        shots=tuple(played_shots),
        restitution=Restitution(draw(st.floats(0, 1)), draw(st.none() | st.floats(0, 1)), 0.5),
        title=draw(st.text(st.characters(exclude_categories=["Cs"]))),
        units=draw(units),
    )


@settings(max_examples=50)
@given(scenes())
def test_any_scene_survives_its_own_file(scene: Scene) -> None:
    text = scene.to_toml()
    assert loads(text) == scene
    in_its_units = loads(text.replace('numbers = "SI"\n', ""))  # the same numbers, in these units
    assert "numbers" not in in_its_units.to_toml()
    assert loads(in_its_units.to_toml()) == in_its_units


def test_a_title_may_hold_whatever_has_to_be_escaped() -> None:
    scene = replace(REPORT, title='quotes "\\", \x00\x1f\x7f\x85\u2028, lines\r\n\t')
    assert loads(scene.to_toml()) == scene


@given(st.floats(1e-3, 1e3), units)
def test_numbers_that_were_written_in_units_come_back_as_short(number: float, unit: Units) -> None:
    for kind in ("length", "mass", "speed"):
        value = unit.to_si(number, kind)
        again = in_units(value, kind, unit)
        assert unit.to_si(again, kind) == value
        assert len(repr(again)) <= len(repr(number))


def test_where_no_number_in_the_units_is_exact_the_file_is_in_si() -> None:
    """3.3 m are no float in inches: the nearest ones give 3.3 m except for the last bit."""
    scene = replace(plane(disc("a", 3.3, 0)), units=Units("in"))
    assert 'length = "in"\nnumbers = "SI"' in scenario_text(scene)
    assert "position = [3.3, 0.0]" in scenario_text(scene)
    assert loads(scene.to_toml()) == scene
    odd = scene.to_toml().replace('"SI"', '"in"')
    assert line_of(lambda: loads(odd)) == (
        'scenario: units.numbers = "in": must be one of units, SI'
    )


# -- shots count from 1 ----------------------------------------------------------------------------


def test_a_shot_goes_by_name_by_itself_or_by_its_number_from_1() -> None:
    short = replace(REPORT, physics=Physics(max_time=0.01))
    for k, shot in enumerate(short.shots, start=1):
        assert simulate(short, k).shot is simulate(short, shot.name).shot is shot
        assert simulate(short, replace(shot)).shot == shot
    both = [run.shot for run in simulate_all(short, [2, "Simulation 1"])]
    assert both == [short.shots[1], short.shots[0]]
    one = replace(REPORT, shots=(replace(REPORT.shots[0], name="2"), REPORT.shots[1]))
    assert simulate(one, "2").shot is one.shots[0]  # a text is a name


# -- balls off the table ---------------------------------------------------------------------------

LANE = plane(
    disc("C", 0, 0), disc("1", 0.5, 0), disc("2", 0, 0.7), shots=(Shot("s", "C", (1.0, 0.0)),)
)


@every_solver
def test_balls_off_the_table_meet_nothing_and_stay_where_they_are(solver: str) -> None:
    assert any(event.kind == "ball-ball" for event in played(solver, LANE).events)
    start = State(((0, 0), (0.5, 0), (0, 0.7)), ((0, 0), (3, 0), (0, 0)), frozenset({"1"}))
    run = played(solver, LANE, start=start)
    assert [(event.kind, event.balls) for event in run.events] == [("stop", ("C",))]
    assert run.final["1"] == (0.5, 0.0)
    assert run.final["C"][0] == pytest.approx(1.0 / (2 * LANE.deceleration), rel=1e-2)
    assert run.off == run.end.off == {"1"}
    assert played(solver, LANE, start=run.end._replace(velocity=((1, 0),) * 3)).off == {"1"}


def test_a_ball_is_on_the_table_until_a_pocket_takes_it_in() -> None:
    balls = (disc("gone", 0.0, 0.0), disc("C", 0.25, 0.0), disc("there", 0.0, 0.5))
    pockets, shots = (Pocket("P", (1.0, 0.0), 0.05),), (Shot("in", "C", (3.0, 0.0)),)
    scene = Scene(balls, None, Restitution(0.9), Friction(0.3), pockets=pockets, shots=shots)
    start = scene.start(shots[0])._replace(off=frozenset({"gone"}))
    run = simulate(replace(scene, shots=()), solver="event-driven", start=start)
    (t,) = [event.t for event in run.events if event.pocket is not None]
    before, after = [False, True, True], [False, False, True]
    times = [0.0, np.nextafter(t, 0.0), t, run.duration, 2.0 * run.duration]
    assert run.on_table(times).tolist() == [before, before, after, after, after]
    assert run.on_table(t).tolist() == after


@every_solver
def test_balls_off_the_table_may_be_anywhere(solver: str) -> None:
    """In another ball, or beyond the cushions; and many of them, so that arrays are used."""
    balls = tuple(disc(str(k), 0.2 + 0.2 * (k % 9), 0.2 + 0.2 * (k // 9)) for k in range(45))
    scene = Scene(balls, Table.rectangle(2, 2), Restitution(0.9, None, 0.9), Friction(0.3))
    still = [(0.0, 0.0)] * 45
    start = (
        [(0.2, 0.2)] * 44 + [(1.0, 1.0)],
        [*still[:-1], (1, 0)],
        [ball.id for ball in balls[:44]],
    )
    run = played(solver, scene, start=start, max_time=2.0)
    assert {ball for event in run.events for ball in event.balls} == {"44"}


def test_a_shot_aims_at_the_nearest_ball_that_is_there() -> None:
    shot = Shot("s", "C", speed=1.0, aim="nearest")
    scene = replace(LANE, shots=(shot,))
    places = tuple(ball.position for ball in scene.balls)
    assert scene.start(shot).velocity[0] == (1.0, 0.0)
    without = State(places, ((0.0, 0.0),) * 3, frozenset({"1"}))
    assert scene.start(shot, without).velocity[0] == pytest.approx((0.0, 1.0))
    assert scene.start(shot, without).off == {"1"}
    alone = without._replace(off=frozenset({"1", "2"}))
    assert "every other ball is off the table" in line_of(lambda: scene.start(shot, alone))
    for foreign in (replace(shot, ball="9"), replace(shot, aim="9")):
        assert '"9": there is no such ball (there are: C, 1, 2)' in line_of(
            partial(scene.start, foreign)
        )
    aimed = replace(shot, aim="1")
    assert 'shot.aim = "1": the ball is off' in line_of(lambda: scene.start(aimed, without))


def test_a_run_may_start_where_another_ended() -> None:
    """Solvers that find contacts late leave balls in each other by a little."""
    for solver in SOLVERS:
        assert played(solver, start=whole(solver).end, shot=2).status == "settled"
    for solver in ("pymunk", "pymunk-discrete", "event-driven"):
        cut = played(solver, max_events=6)
        assert played(solver, start=cut.end, shot=2).status == "settled"


def test_ends_say_which_balls_there_are() -> None:
    ends = simulate(load("two-balls")).final
    with pytest.raises(KeyError, match=r"1: there is no such ball \(there are: A, B\)"):
        ends[1]  # type: ignore[index]
    assert ends.get("1") is None and ends == dict(ends)
    assert pickle.loads(pickle.dumps(ends)) == ends
