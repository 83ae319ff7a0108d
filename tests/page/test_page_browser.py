"""A real browser plays pages: `make test-browser` runs this, and says how to get a browser."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    Shot,
    load,
    simulate,
    simulate_all,
)
from pool_pymunk.page import write_page
from tests.shared import browsers
from tests.shared.browsers import Visit, picture
from tests.shared.hostile import HOSTILE, hostile_scene

browser = browsers.browser  # This is a fixture.

pytestmark = pytest.mark.browser


@pytest.fixture
def visit(browser: Any) -> Iterator[Any]:
    """Open pages; in the end nothing was complained of, and nothing but the files asked for."""
    visits: list[Visit] = []

    def open_page(path: Path, **settings: Any) -> Visit:
        visits.append(Visit(browser, path.as_uri(), **settings))
        return visits[-1]

    yield open_page
    for each in visits:
        assert each.said == []
        assert all(url.startswith("file://") for url in each.asked) and len(each.asked) == 1
        each.context.close()


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    return list(simulate_all(load("report"), solver="pymunk"))


@pytest.fixture(scope="module")
def others() -> list[Run]:
    return list(simulate_all(load("report"), solver="pymunk-discrete", dt=1 / 60))


@pytest.fixture(scope="module")
def report(runs: list[Run], others: list[Run], tmp_path_factory: Any) -> Path:
    """Return the page of the report's four shots, each with a ghost."""
    path = Path(tmp_path_factory.mktemp("page")) / "report.html"
    write_page(list(zip(runs, others, strict=True)), path)
    return path


def assert_plays_exactly(visit: Visit, run: Run) -> None:
    """The page has the run's positions to the last bit, at a hundred times."""
    assert visit.ask("pool.duration") == run.duration
    times = np.linspace(0.0, 1.1 * run.duration, 100).tolist()
    shown = visit.ask("(times) => times.map((t) => pool.positions(t))", times)
    ids = [ball.id for ball in run.scene.balls]
    places = np.array([[moment[id_] for id_ in ids] for moment in shown])
    assert np.array_equal(places, run.at(times)[0])


def contact_times(run: Run) -> list[float]:
    return sorted({event.t for event in run.events if event.is_contact or event.pocket})


def test_the_report_is_played_exactly(visit: Any, report: Path, runs: list[Run]) -> None:
    seen = visit(report)
    for k, run in enumerate(runs, start=1):
        seen.ask("(k) => pool.shot(k)", k)
        assert_plays_exactly(seen, run)


@pytest.mark.parametrize(
    ("scenario", "solver"),
    [
        ("eight-ball", "event-driven"),
        ("two-balls", "pymunk"),
        ("hexagon", "pymunk-builtin"),
        ("l-shaped", "pymunk"),
        ("follow-and-draw", "event-driven"),
    ],
)
def test_other_scenes_are_played_exactly(
    scenario: str, solver: str, visit: Any, tmp_path: Path
) -> None:
    run = simulate(load(scenario), 1, solver=solver)
    run.to_html(tmp_path / "one.html")
    seen = visit(tmp_path / "one.html")
    assert_plays_exactly(seen, run)
    seen.press("End")
    assert seen.time() == run.duration


def test_a_ball_that_slides_then_rolls(visit: Any, tmp_path: Path) -> None:
    """The page has the roll to the last bit, curved tracks, and no contact where rolling begins."""
    run = simulate(load("follow-and-draw"), "draw", solver="event-driven")
    run.to_html(tmp_path / "draw.html")
    seen = visit(tmp_path / "draw.html")
    times = np.linspace(0.0, run.duration, 100).tolist()
    shown = seen.ask("(times) => times.map((t) => statesAt(player.run, t))", times)
    rolls = [[[ball["wx"], ball["wy"]] for ball in moment] for moment in shown]
    assert np.array_equal(rolls, run.roll_at(times))
    begins = [event.t for event in run.events if event.kind == "roll"]
    assert seen.page.locator("#events button", has_text="begins to roll").count() == len(begins)
    for t in contact_times(run):
        seen.press("ArrowRight")
        assert seen.time() == t and t not in begins
    hit, end = run.events[0].t, begins[1]
    corners = np.array(seen.ask("(t) => player.table.track(player.run, 0, t, 1)[0]", end))
    steps = np.linspace(0.0, len(corners) - 1.0, 4_000)
    track = np.stack([np.interp(steps, range(len(corners)), xy) for xy in corners.T], axis=-1)
    curve = run.at(np.linspace(hit, end, 50))[0][:, 0]
    assert np.hypot(*(track[:, None] - curve).T).min(axis=1).max() < 1e-3


def test_it_plays_and_pauses(visit: Any, report: Path) -> None:
    seen = visit(report)
    seen.press("Space")
    seen.wait("pool.time > 0.1")
    seen.press("Space")
    stopped = seen.time()
    assert not seen.ask("pool.playing")
    seen.page.wait_for_timeout(100)
    assert seen.time() == stopped
    seen.page.click("#play")
    seen.wait(f"pool.time > {stopped}")
    seen.ask("pool.pause()")
    seen.ask("pool.seek(player.duration - 0.01); pool.play()")
    seen.wait("!pool.playing")
    assert seen.time() == seen.ask("player.duration")


def test_one_loop_plays_however_often_play_is_called(visit: Any, report: Path) -> None:
    seen = visit(report)
    draws = """() => new Promise((done) => {
        for (let k = 0; k < 20; k += 1) { pool.play(); pool.pause(); pool.play(); }
        let [draws, frames, draw] = [0, 0, player.draw];
        player.draw = () => { draws += 1; draw.call(player); };
        requestAnimationFrame(function tick() {
            frames += 1;
            if (frames < 5) requestAnimationFrame(tick);
            else { pool.pause(); done(draws); }
        });
    })"""
    assert 3 <= seen.ask(draws) <= 6


def test_slower_is_slower(visit: Any, report: Path) -> None:
    """In the same time on the screen, a hundredth of the track is shown."""
    seen = visit(report)
    seen.page.select_option("#speed", "0.01")
    between = """(pace) => new Promise((done) => {
        pool.seek(0); pool.play();
        requestAnimationFrame((first) => requestAnimationFrame(function tick(now) {
            if (now - first < 400) requestAnimationFrame(tick);
            else { pool.pause(); done(pool.time / (now - first) * 1000); }
        }));
    })"""
    assert 0.005 < seen.ask(between) < 0.015
    seen.press("+", "+", "+")
    assert seen.page.input_value("#speed") == "0.25"


def test_steps_go_from_contact_to_contact(
    visit: Any, report: Path, runs: list[Run], others: list[Run]
) -> None:
    seen = visit(report)
    times = contact_times(runs[0])
    for t in times[:5]:
        seen.press("ArrowRight")
        assert seen.time() == t
    seen.page.click("#back")
    assert seen.time() == times[3]
    seen.press("Home")
    seen.press("ArrowLeft")
    assert seen.time() == 0.0
    seen.press("End", "ArrowLeft")
    assert seen.time() == times[-1]
    seen.press("ArrowRight")
    assert seen.time() == max(runs[0].duration, others[0].duration)


def test_the_slider_scrubs(visit: Any, report: Path, runs: list[Run]) -> None:
    seen = visit(report)
    box = seen.page.locator("#time").bounding_box()
    seen.page.mouse.move(box["x"] + 8, box["y"] + box["height"] / 2)
    seen.page.mouse.down()
    seen.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=5)
    seen.page.mouse.up()
    longest = float(seen.page.get_attribute("#time", "max"))
    assert abs(seen.time() / longest - 0.5) < 0.02


def test_an_event_jumps_there(visit: Any, report: Path, runs: list[Run]) -> None:
    seen = visit(report)
    rows = seen.page.locator("#events button")
    assert rows.count() == len(runs[0].events) + 1
    rows.nth(3).click()
    assert seen.time() == runs[0].events[3].t
    assert seen.page.locator("#events [aria-current]").inner_text() == rows.nth(3).inner_text()


def test_the_picker_chooses_a_shot(visit: Any, report: Path, runs: list[Run]) -> None:
    seen = visit(report)
    seen.page.select_option("#shot", label=f"3: {runs[2].name}")
    assert seen.ask("pool.duration") == runs[2].duration
    seen.press("2")
    assert seen.ask("pool.duration") == runs[1].duration
    seen.page.locator("#table").click(position={"x": 5, "y": 5})
    seen.press("4")
    assert seen.ask("pool.duration") == runs[3].duration


def test_the_ghost_shows_how_far_it_is_apart(
    visit: Any, report: Path, runs: list[Run], others: list[Run]
) -> None:
    seen = visit(report)
    assert "pymunk-discrete" in seen.text("apart-text")
    assert float(seen.page.get_attribute("#time", "max")) == max(
        runs[0].duration, others[0].duration
    )
    t = 0.7 * runs[0].duration
    apart = seen.ask("(t) => apart(player.run, player.ghost, t)", t)
    gap = runs[0].at(t)[0] - others[0].at(t)[0]
    assert np.allclose(apart, np.hypot(gap[:, 0], gap[:, 1]), rtol=1e-12, atol=0.0)
    box = seen.page.locator("#plot").bounding_box()
    seen.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert seen.time() > 0.3
    with_ghost = picture(seen)
    seen.page.select_option("#ghost", "0")
    assert not seen.page.locator("#apart").is_visible()
    assert picture(seen) != with_ghost


def test_the_ball_under_the_pointer_says_what_it_does(
    visit: Any, report: Path, runs: list[Run]
) -> None:
    seen = visit(report)
    run, t = runs[0], 0.05
    seen.ask("(t) => pool.seek(t)", t)
    i = run.scene.index["C"]
    (x, y), (vx, vy) = (part[i].tolist() for part in run.at(t))
    place = "([x, y]) => player.table.place(x, y).map((p) => p / player.table.ratio)"
    px, py = seen.ask(place, [x, y])
    seen.page.locator("#table").hover(position={"x": px, "y": py})
    text = seen.text("ball")
    speed, unit = run.scene.units.from_si(math.hypot(vx, vy), "speed"), run.scene.units.speed
    angle = float(np.degrees(np.arctan2(vy, vx)))
    assert text.startswith(f"C: {speed:.3f} {unit} at {angle:.1f}°")
    seen.page.mouse.move(2, 2)
    assert not seen.page.locator("#ball").is_visible()


def test_a_finger_picks_a_ball(visit: Any, report: Path, runs: list[Run]) -> None:
    seen = visit(report, viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    x, y = runs[0].at(0.0)[0][runs[0].scene.index["5"]].tolist()
    place = "([x, y]) => player.table.place(x, y).map((p) => p / player.table.ratio)"
    px, py = seen.ask(place, [x, y])
    seen.page.locator("#table").tap(position={"x": px + 8, "y": py})
    assert seen.text("ball").startswith("5: at rest")
    seen.page.locator("#on").tap()
    assert seen.time() == contact_times(runs[0])[0]


@pytest.mark.parametrize("width", [200, 320, 360, 768, 1280, 1920])
def test_nothing_sticks_out_at_the_sides(width: int, visit: Any, report: Path) -> None:
    seen = visit(report, viewport={"width": width, "height": 800})
    seen.ask("byId('ghost').options[1].textContent += ', a law that has quite a long name'")
    seen.page.wait_for_timeout(50)
    assert seen.ask("document.documentElement.scrollWidth") <= width
    shown = float(seen.ask("document.getElementById('table').clientWidth"))
    assert 0.6 * min(width, 900) < shown < width


@pytest.mark.parametrize("width", [740, 1280])
def test_a_low_window_shows_the_controls(width: int, visit: Any, report: Path) -> None:
    seen = visit(report, viewport={"width": width, "height": 300})
    bar = seen.page.locator("#bar").bounding_box()
    assert bar["y"] + bar["height"] <= 300


def test_it_is_dark_where_the_reader_likes_it_dark(visit: Any, report: Path) -> None:
    ground = "getComputedStyle(document.body).backgroundColor"
    dark, light = (visit(report, color_scheme=scheme) for scheme in ("dark", "light"))
    assert (dark.ask(ground), light.ask(ground)) == ("rgb(21, 25, 29)", "rgb(255, 255, 255)")
    light.press("d")
    assert light.ask(ground) == dark.ask(ground)


def test_pockets_take_balls_in(visit: Any, tmp_path: Path) -> None:
    run = simulate(load("eight-ball"), 1)
    run.to_html(tmp_path / "one.html")
    seen = visit(tmp_path / "one.html")
    assert not seen.page.locator("#pocketed").is_visible()
    seen.press("End")
    names = ", ".join(f"{ball} ({pocket})" for ball, pocket in run.pocketed.items())
    assert seen.text("pocketed") == f"Off the table: {names}"


def test_hostile_texts_stay_texts(visit: Any, tmp_path: Path) -> None:
    scene = hostile_scene()
    simulate(scene, 1).to_html(tmp_path / "one.html")
    seen = visit(tmp_path / "one.html")
    seen.press("End")
    assert seen.ask("window.hacked") is None
    assert seen.text("title") == f"title {HOSTILE}"
    assert seen.ask("document.title") == f"title {HOSTILE}"
    assert seen.ask("document.images.length") == 0
    assert HOSTILE in seen.text("pocketed")


def test_an_id_may_be_any_name_of_the_language(visit: Any, tmp_path: Path) -> None:
    scene = load("two-balls")
    text = scene.to_toml().replace('"A"', '"__proto__"').replace('"B"', '"constructor"')
    (tmp_path / "odd.toml").write_text(text, encoding="utf-8")
    simulate(load(str(tmp_path / "odd.toml")), 1).to_html(tmp_path / "one.html")
    seen = visit(tmp_path / "one.html")
    assert sorted(seen.ask("Object.keys(pool.positions(0))")) == ["__proto__", "constructor"]


def test_other_code_gets_clear_errors(visit: Any, report: Path) -> None:
    seen = visit(report)
    for call, message in (
        ("pool.shot(5)", "shot(5): the shots have the numbers 1 to 4"),
        ("pool.seek(NaN)", "seek(NaN): the time must be a finite number"),
        ("pool.positions(NaN)", "positions(NaN): the time must be a finite number"),
        ("pool.positions()", "positions(undefined): the time must be a finite number"),
    ):
        caught = f"() => {{ try {{ {call}; }} catch (error) {{ return error.message; }} }}"
        assert seen.ask(caught) == message


def test_a_notebooks_frame_plays(visit: Any, runs: list[Run], tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(f"<!doctype html><body>{runs[0]._repr_html_()}</body>", encoding="utf-8")
    seen = visit(path)
    frame = seen.page.frames[1]
    frame.wait_for_selector("#events button")
    assert frame.evaluate("pool.duration") == runs[0].duration
    assert seen.ask("window.pool") is None


def test_a_frame_in_another_page_cuts_no_plot(browser: Any, report: Path) -> None:
    """As on docs/page.md, where the frame is as wide as the text."""
    outer = report.with_name("outer.html")
    outer.write_text(f"<iframe src='{report.name}' style='width: 736px; height: 720px'></iframe>")
    seen = Visit(browser, outer.as_uri())
    frame = seen.page.frames[1]
    frame.wait_for_selector("#events button")
    feet = "['energy-plot', 'plot'].map((id) => byId(id).getBoundingClientRect().bottom)"
    assert max(frame.evaluate(feet)) <= 720
    seen.context.close()


def many_balls(count: int, radius: float = 0.03) -> Scene:
    """Return this many balls in a square on an open plane; they move in all directions."""
    side = math.ceil(math.sqrt(count))
    balls = tuple(
        Ball(str(k), (0.1 * (k % side), 0.1 * (k // side)), radius, 0.2,
             velocity=(math.cos(k), math.sin(k)))
        for k in range(count)
    )  # fmt: skip
    return Scene(balls, restitution=Restitution(0.9), friction=Friction(surface=0.1))


def test_a_scene_of_many_balls_is_drawn(visit: Any, tmp_path: Path) -> None:
    simulate(many_balls(200), solver="event-driven").to_html(tmp_path / "many.html")
    seen = visit(tmp_path / "many.html")
    seen.press("ArrowRight", "End")
    assert seen.time() == seen.ask("pool.duration")


# Return how many strokes the tracks at a time take, and the names that stand beside balls.
COUNTED = """(t) => {
    let [strokes, names] = [0, []];
    const { stroke, fillText } = CanvasRenderingContext2D.prototype;
    const pen = byId("table").getContext("2d");
    pen.stroke = function (...path) { strokes += 1; stroke.apply(this, path); };
    pen.fillText = function (...text) { names.push(text[0]); fillText.apply(this, text); };
    player.jump(t);
    byId("trails").checked = false;
    const tracks = strokes;
    [strokes, names] = [0, []];
    player.draw();
    byId("trails").checked = true;
    return [tracks - strokes, names];
}"""


@pytest.mark.parametrize(("count", "least", "most"), [(11, 300, 700), (100, 300, 700)])
def test_tracks_of_many_balls_take_a_few_hundred_strokes(
    count: int, least: int, most: int, visit: Any, tmp_path: Path
) -> None:
    run = simulate(many_balls(count), solver="event-driven")
    run.to_html(tmp_path / "many.html")
    strokes, _ = visit(tmp_path / "many.html").ask(COUNTED, run.duration)
    assert least < strokes < most


def test_an_old_white_track_is_seen_on_a_white_table(visit: Any, tmp_path: Path) -> None:
    report = load("report")
    ball = Ball("cue", (0.2, 0.5), 0.05, 0.2, velocity=(1.0, 0.0), color="#ffffff")
    assert report.table is not None
    table = replace(report.table, color="#ffffff")
    scene = replace(report, table=table, balls=(ball,), shots=())
    simulate(scene, solver="event-driven", max_time=1.0).to_html(tmp_path / "white.html")
    darkest = """(place) => {
        const [x, y] = player.table.place(...place);
        return Math.min(...player.table.pen.getImageData(x, y - 12, 1, 24).data);
    }"""
    seen = visit(tmp_path / "white.html")
    seen.ask("pool.seek(1.0)")
    assert 90 < seen.ask(darkest, [0.3, 0.5]) < 120


def test_in_a_crowd_only_the_picked_ball_has_its_name_beside_it(visit: Any, tmp_path: Path) -> None:
    for count, shown in ((20, 20), (200, 0)):
        run = simulate(many_balls(count, 0.01), solver="event-driven", max_events=10)
        run.to_html(tmp_path / "many.html")
        seen = visit(tmp_path / "many.html", viewport={"width": 320, "height": 400})
        assert len(seen.ask(COUNTED, 0.0)[1]) == shown
    seen.ask("player.picked = 7")
    assert seen.ask(COUNTED, 0.0)[1] == ["7"]


def test_a_run_of_minutes_has_each_event_in_a_line(visit: Any, tmp_path: Path) -> None:
    balls = (
        Ball("a", (0.0, 0.0), 0.03, 0.2, velocity=(0.01, 0.0)),
        Ball("b", (20.0, 0.0), 0.03, 0.2),
    )
    scene = Scene(balls, restitution=Restitution(0.9), physics=Physics(max_time=3000.0))
    simulate(scene, solver="event-driven").to_html(tmp_path / "long.html")
    seen = visit(tmp_path / "long.html")
    time = seen.page.locator("#events button span").first
    assert time.inner_text() == "1994.0000 s"
    lines = """(span) => {
        const words = document.createRange();
        words.selectNodeContents(span);
        return words.getClientRects().length;
    }"""
    assert time.evaluate(lines) == 1


@pytest.mark.parametrize(
    ("scenario", "solver"),
    [("report", "pymunk"), ("follow-and-draw", "event-driven"), ("eight-ball", "pymunk-builtin")],
)
def test_the_energy_is_that_of_the_run_and_jumps_at_contacts(
    scenario: str, solver: str, visit: Any, tmp_path: Path
) -> None:
    scene = load(scenario)
    if solver == "pymunk-builtin":
        scene = replace(scene, friction=replace(scene.friction, rolling=None), shots=SLIDES)
    run = simulate(scene, 1, solver=solver)
    run.to_html(tmp_path / "one.html")
    seen = visit(tmp_path / "one.html")
    points = np.array(seen.ask("player.plots[0].curves[0].points"))
    assert np.allclose(points[:, 1], run.energy_at(points[:, 0]), rtol=1e-12, atol=1e-15)
    jumps = np.array(sorted({t for rows in run.knots for t in rows[1:, 0].tolist()}))
    before = points[np.searchsorted(points[:, 0], jumps) - 1]
    assert np.all(before[:, 0] >= jumps * (1.0 - 3e-16)) and np.all(before[:, 0] < jumps)
    seen.ask("(t) => pool.seek(t)", jumps[0])
    assert seen.text("energy") == f"{significant(float(run.energy_at(jumps[0])))} J"


SLIDES = (Shot("break", "cue", speed=4.0, angle=0.0),)


def significant(number: float) -> str:
    """Write a number with four digits that count, as JavaScript does."""
    return f"{number:#.4g}"


@pytest.mark.parametrize(("shot", "height"), [(1, 800), (4, 800), (1, 720)])
def test_a_window_has_room_for_the_whole_page(
    shot: int, height: int, visit: Any, report: Path
) -> None:
    seen = visit(report, viewport={"width": 1280, "height": height})
    seen.ask("(k) => pool.shot(k)", shot)
    for ghost in ("1", "0"):
        seen.page.select_option("#ghost", ghost)
        seen.page.wait_for_timeout(50)
        assert seen.ask("document.documentElement.scrollHeight") <= height
        for plot in ("#energy-plot", "#plot")[: 1 + int(ghost)]:
            box = seen.page.locator(plot).bounding_box()
            assert box["height"] > 80 and box["y"] + box["height"] <= height


def test_the_legend_has_the_balls_that_are_apart(
    visit: Any, report: Path, runs: list[Run], others: list[Run]
) -> None:
    """Each has a colour or a border that shows on the page, also a black one in the dark."""
    seen = visit(report, color_scheme="dark")
    times = np.linspace(0.0, runs[0].duration, 400)
    gaps = np.abs(runs[0].at(times)[0] - others[0].at(times)[0]).max(axis=(0, 2))
    names = [ball.id for ball, gap in zip(runs[0].scene.balls, gaps, strict=True) if gap > 0.0]
    keys = seen.page.locator("#apart-legend span")
    assert keys.all_inner_texts() == names and "8" in names
    black = keys.nth(names.index("8")).locator("i")
    assert black.evaluate("(dot) => getComputedStyle(dot).borderTopColor") == "rgb(255, 255, 255)"


def test_stripes_have_dashes_and_the_legend_has_the_balls_order(visit: Any, tmp_path: Path) -> None:
    scene = load("eight-ball")
    soft = replace(scene, restitution=replace(scene.restitution, cushion=0.7))
    rows = [[simulate(each, 1, solver="event-driven", max_time=4.0) for each in (scene, soft)]]
    write_page(rows, tmp_path / "two.html")
    keys = visit(tmp_path / "two.html").page.locator("#apart-legend span")
    numbers = [int(text) for text in keys.all_inner_texts()]
    assert numbers == sorted(numbers) and {5, 13} <= {*numbers}
    for number, key in zip(numbers, keys.locator("i").all(), strict=True):
        ground = key.evaluate("(line) => getComputedStyle(line).backgroundImage")
        assert ("gradient" in ground) == (number > 8)


def test_the_end_is_told_at_the_end(visit: Any, report: Path, runs: list[Run]) -> None:
    seen = visit(report)
    assert "rest" not in seen.text("setting")
    last = seen.page.locator("#events button").last
    assert last.inner_text().endswith("Every ball is at rest.")
    assert "past" not in (last.get_attribute("class") or "")
    last.click()
    assert seen.time() == runs[0].duration
    assert "past" in (last.get_attribute("class") or "")


def test_names_beside_balls_cover_no_ball_and_no_name(visit: Any, tmp_path: Path) -> None:
    run = simulate(load("nine-ball"), 1)
    run.to_html(tmp_path / "rack.html")
    seen = visit(tmp_path / "rack.html", viewport={"width": 400, "height": 800})
    boxes = """() => {
        const { table } = player;
        const found = [];
        const write = table.pen.strokeText;
        table.pen.strokeText = function (text, x, y) {
            const half = this.measureText(text).width / 2;
            found.push([text, x - half, x + half, y - 4 * table.ratio, y + 4 * table.ratio]);
            write.call(this, text, x, y);
        };
        player.draw();
        const balls = statesAt(player.run, 0).map(({ x, y }) => table.place(x, y));
        return [found, balls, table.scale * player.content.balls[1].radius];
    }"""
    names, balls, radius = seen.ask(boxes)
    assert "cue" in {text for text, *_ in names} and len(names) < len(balls)
    for k, (text, left, right, top, foot) in enumerate(names):
        for (x, y), ball in zip(balls, run.scene.balls, strict=True):
            gap = math.hypot(max(left - x, x - right, 0.0), max(top - y, y - foot, 0.0))
            assert ball.id == text or gap > radius
        for _, left2, right2, top2, foot2 in names[:k]:
            assert right < left2 or right2 < left or foot < top2 or foot2 < top


def test_a_ball_off_the_table_is_not_picked(visit: Any, tmp_path: Path) -> None:
    run = simulate(load("crokinole"), 1)
    run.to_html(tmp_path / "one.html")
    seen = visit(tmp_path / "one.html")
    seen.press("End")
    place = "([x, y]) => player.table.place(x, y).map((p) => p / player.table.ratio)"
    px, py = seen.ask(place, list(run.scene.pockets[0].position))
    seen.page.locator("#table").hover(position={"x": px, "y": py})
    assert run.pocketed and not seen.page.locator("#ball").is_visible()


def test_a_ball_that_slides_tells_its_roll(visit: Any, tmp_path: Path) -> None:
    run = simulate(load("follow-and-draw"), "draw", solver="event-driven")
    run.to_html(tmp_path / "draw.html")
    seen = visit(tmp_path / "draw.html")
    t = run.events[0].t
    wx, wy = run.roll_at(t)[0].tolist()
    seen.ask("(t) => { pool.seek(t); player.picked = 0; player.draw(); }", t)
    assert f"its roll: {math.hypot(wx, wy):.3f} m/s at" in seen.text("ball")
    seen.press("End")
    assert "roll" not in seen.text("ball")


def test_what_is_chosen_stays_and_leaves_the_keys_to_the_page(visit: Any, report: Path) -> None:
    """The ghost that was chosen is that of the next shot, too; a list gives the focus back."""
    seen = visit(report)
    seen.page.select_option("#ghost", "0")
    seen.page.click("#shot")
    seen.page.select_option("#shot", "1")
    assert seen.ask("document.activeElement === document.body")
    assert seen.page.input_value("#shot") == "1" and seen.page.input_value("#ghost") == "0"
    seen.press("Space")
    seen.wait("pool.time > 0.05")
    keys = seen.text("keys")
    assert all(key in keys for key in ("Home", "End", "T", "D"))


ODD = "a\u202eb"  # What follows this is read from right to left,
CLOSED = "c\u2069\u202ed"  # and this closes what would end that.
LONG = "long " + "x" * 195


def tiny_scene(*ids: str) -> Scene:
    """Return a shot across a millionth of a metre that lasts two milliseconds."""
    balls = (
        Ball(ids[0], (0.0, 0.0), 1e-7, 1e-9, velocity=(1e-3, 0.0)),
        Ball(ids[1], (8e-7, 5e-8), 1e-7, 1e-9),
    )
    return Scene(balls, restitution=Restitution(0.9), friction=Friction(surface=0.05))


def test_a_short_run_has_small_steps_and_more_decimals(visit: Any, tmp_path: Path) -> None:
    run = simulate(tiny_scene("a", "b"), solver="event-driven")
    run.to_html(tmp_path / "tiny.html")
    seen = visit(tmp_path / "tiny.html")
    tips = """() => {
        const [found, { table }] = [[], player];
        const draw = table.drawArrow;
        table.drawArrow = (...arrow) => { found.push(arrow.at(5)); draw.apply(table, arrow); };
        player.draw();
        const [x0, , x1] = player.content.seen;
        return found.map((tip) => tip / (x1 - x0));
    }"""
    assert [0.1 < share < 0.5 for share in seen.ask(tips)] == [True]
    seen.press(".", ".")
    assert seen.time() == pytest.approx(0.02 * run.duration)
    assert seen.text("clock") == f"{seen.time():.6f} s"
    contact = seen.page.locator("#events button span").first.inner_text()
    assert contact == f"{run.events[0].t:.7f} s"


def test_ids_turn_no_words_round(visit: Any, tmp_path: Path) -> None:
    simulate(tiny_scene(ODD, CLOSED), solver="event-driven").to_html(tmp_path / "odd.html")
    seen = visit(tmp_path / "odd.html")
    one, other = f"\u2068{ODD}\u2069", "\u2068c\u202ed\u2069"
    assert seen.page.locator("#events button span").nth(1).inner_text() == f"{one} meets {other}"
    seen.ask("player.picked = 0; player.draw()")
    assert seen.text("ball").startswith(f"{one}: ")
    seen.ask("player.run.off.push(1); player.tellPocketed()")
    assert seen.text("pocketed") == f"Off the table: {other}"


@pytest.mark.parametrize("width", [320, 1280])
def test_the_words_beside_a_ball_stay_in_the_frame(width: int, visit: Any, tmp_path: Path) -> None:
    simulate(tiny_scene(LONG, "b" * 200), solver="event-driven").to_html(tmp_path / "long.html")
    seen = visit(tmp_path / "long.html", viewport={"width": width, "height": 700})
    for ball in (0, 1):
        seen.ask("(i) => { player.picked = i; player.draw(); }", ball)
        box, frame = (seen.page.locator(name).bounding_box() for name in ("#ball", "#frame"))
        assert frame["x"] <= box["x"] and box["y"] >= frame["y"]
        assert box["x"] + box["width"] <= frame["x"] + frame["width"] + 1
        assert box["height"] < 120


def test_the_row_of_a_contact(visit: Any, report: Path, runs: list[Run]) -> None:
    """Where the page stands at a contact, it says what the contact did, and nowhere else."""
    seen = visit(report)
    assert seen.page.locator("#contact").is_hidden()
    seen.press("ArrowRight")
    row = runs[0].contacts[0]
    assert row.impulse is not None and row.lost is not None
    said = seen.text("contact")
    assert "C meets 1 at 42.297, 21.615 in; normal -170.15\N{DEGREE SIGN}; they slip" in said
    assert f"Jn {row.impulse:.4g} N s" in said and f"energy lost: {row.lost:.4g} J" in said
    assert seen.page.locator("#contact sub").all_inner_texts() == ["n", "t"]
    assert " ".join(f"{v:.4f}" for v in row.after[0]) in said.replace(",", "")
    seen.press(".")
    assert seen.page.locator("#contact").is_hidden()


def test_arrows_are_switched_on(visit: Any, report: Path) -> None:
    seen = visit(report)
    seen.press("ArrowRight")
    without = picture(seen)
    seen.press("a")
    assert seen.page.locator("#arrows").is_checked()
    assert picture(seen) != without
    seen.press("a")
    assert picture(seen) == without


def test_momentum_stands_beside_energy(visit: Any, report: Path, runs: list[Run]) -> None:
    seen = visit(report)
    masses = np.array([ball.mass for ball in runs[0].scene.balls])
    x, y = masses @ runs[0].at(0.0)[1]
    assert seen.text("momentum") == f"{x:.4f}, {y:.4f} N s along x, y"
    times = [0.1, 0.7, runs[0].duration]
    shown = seen.ask("(times) => times.map((t) => momentumAt(player.run, t))", times)
    assert np.allclose(shown, np.einsum("i,tij->tj", masses, runs[0].at(times)[1]), atol=1e-15)


def test_a_page_that_asks_stops_before_the_first_contact(visit: Any, tmp_path: Path) -> None:
    """Its answers are compared with the velocities after the contact, and the shot goes on."""
    run = simulate(load("two-balls"), 1, solver="event-driven")
    write_page([[run]], tmp_path / "asks.html", predict=True)
    shown = visit(tmp_path / "asks.html")
    first = next(row for row in run.contacts if row.point)
    assert 0.999999 * first.t < shown.ask("pool.duration") < first.t
    points = "player.plots.flatMap((plot) => plot.curves.flatMap(({ points }) => points))"
    assert max(t for t, _ in shown.ask(points)) <= shown.ask(
        "pool.duration"
    )  # Curves end where their plot ends.
    assert shown.page.locator("#events").inner_text().endswith("The first contact.")
    said = "document.getElementById('question').textContent"
    for name in first.balls:
        assert f"where will {name} go?" in shown.ask(said)
        index = run.scene.index[name]
        x, y = run.at([first.t])[0][0][index]
        vx, vy = first.after[first.balls.index(name)]
        place = shown.ask(f"player.table.place({x + 0.2 * vx}, {y + 0.2 * vy})")
        box = shown.page.locator("#table").bounding_box()
        ratio = shown.ask("player.table.ratio")
        shown.page.mouse.click(box["x"] + place[0] / ratio, box["y"] + place[1] / ratio)
    shown.wait("pool.duration > 1.01 * player.first.t")
    off = [float(text) for text in re.findall(r"goes ([\d.]+)°", shown.ask(said))]
    assert len(off) == 2
    assert max(off) < 3.0  # A pointer is on a pixel.
    assert shown.ask("pool.duration") == run.duration
