"""A real browser plays on the live table: `make test-browser` runs this."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Run, Scene, Shot, State, load, simulate
from pool_pymunk.model.scenario import loads
from tests.shared.hostile import hostile_scene

pytest.importorskip("starlette")
browsers = pytest.importorskip("tests.shared.browsers")  # It needs playwright.
live = pytest.importorskip("pool_pymunk.page.live.server")

Visit = browsers.Visit
browser = browsers.browser  # This is a fixture.
picture = browsers.picture

pytestmark = pytest.mark.browser

FAILED = "Failed to load resource"  # The browser complains so of every refusal.
TIMEOUT = 60.0  # s
SHOTS, REST = 10, 100  # shots that are timed, and how long (ms) the pointer rests before each


class Server:
    """A server of a live table in a thread; it can be ended, and started again."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.begin()

    def begin(self, port: int = 0, token: str | None = None) -> None:
        self.live = live.LiveServer(self.scene, port, token)
        self.address = self.live.address
        self.thread = threading.Thread(target=self.live.run)
        self.thread.start()

    def end(self) -> None:
        self.live.stop()
        self.thread.join(TIMEOUT)
        assert not self.thread.is_alive()

    def begin_again(self) -> None:
        self.begin(self.live.port, self.live.token)


@pytest.fixture(scope="module")
def report() -> Iterator[Server]:
    yield from served(load("report"))


@pytest.fixture(scope="module")
def eight_ball() -> Iterator[Server]:
    yield from served(load("eight-ball"))


def served(scene: Scene) -> Iterator[Server]:
    server = Server(scene)
    yield server
    server.end()


class Player:
    """A player has the page of a live table open, and plays on it."""

    def __init__(self, visit: Any, scene: Scene) -> None:
        self.visit, self.scene = visit, scene
        self.page, self.ask, self.wait = visit.page, visit.ask, visit.wait
        self.press, self.text = visit.press, visit.text

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the table (m) is in the window."""
        script = "([x, y]) => live.table.place(x, y).map((p) => p / live.table.ratio)"
        box = self.page.locator("#table").bounding_box()
        px, py = self.ask(script, [x, y])
        return box["x"] + px, box["y"] + py

    def drag(self, ball: str, x: float, y: float, let_go: bool = True) -> None:
        """Press on a ball where it lies, and drag to a point of the table (m)."""
        place = self.ask("(i) => live.start.position[i]", self.scene.index[ball])
        self.page.mouse.move(*self.pixel(*place))
        self.page.mouse.down()
        self.page.mouse.move(*self.pixel(x, y), steps=5)
        if let_go:
            self.page.mouse.up()

    def played(self) -> None:
        """Wait until a shot was played to its end."""
        self.wait("live.last !== null && !live.shooting && player.time > 0")
        self.ask("player.jump(player.duration)")

    def question(self) -> dict[str, Any]:
        found: dict[str, Any] = self.ask("live.last ?? live.question()")
        return found

    def simulated(self, **more: Any) -> Run:
        """Return what `simulate` makes of the shot that is shown."""
        asked = self.question()
        roll = asked["roll"] or 0.0
        shot = Shot("asked", asked["ball"], speed=asked["speed"], angle=asked["angle"], roll=roll)
        begin = State(
            tuple(map(tuple, asked["position"])),
            tuple(map(tuple, asked["velocity"])),
            frozenset(asked["off"]),
            asked["rolls"] and tuple(map(tuple, asked["rolls"])),
        )
        settings = {"solver": asked["solver"], "dt": asked["dt"], "law": asked["law"]} | more
        return simulate(replace(self.scene, shots=(shot,)), 1, start=begin, **settings)

    def lies(self) -> list[list[float]]:
        """Return where the balls lie."""
        found: list[list[float]] = self.ask("live.start.position")
        return found


@pytest.fixture
def sit_down(browser: Any) -> Iterator[Any]:
    """Open pages; in the end nothing was complained of, and nothing but the server asked."""
    players: list[tuple[Player, Server, bool]] = []

    def open_page(server: Server, refusals: bool = False, **settings: Any) -> Player:
        settings = {"viewport": {"width": 1280, "height": 800}} | settings
        player = Player(Visit(browser, server.address, **settings), server.scene)
        players.append((player, server, refusals))
        return player

    yield open_page
    for player, server, refusals in players:
        visit = player.visit
        said = [line for line in visit.said if not (refusals and FAILED in line)]
        assert said == []
        begins = (server.address, server.address.partition("?")[0] + "api/", "blob:")
        assert all(url.startswith(begins) for url in visit.asked)
        visit.context.close()


# -- shots ---------------------------------------------------------------------------------------


def test_a_drag_shoots_what_simulate_plays(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.drag("C", 0.9, 0.62)
    player.played()
    run = player.simulated()
    asked = player.question()
    assert run.scene.shots[0].speed == asked["speed"] > 0.0
    assert 170.0 < abs(asked["angle"]) < 180.0
    ends = player.ask("pool.positions(pool.duration)")
    assert {id_: tuple(place) for id_, place in ends.items()} == run.final
    assert np.array_equal(player.lies(), run.end.position)
    assert player.ask("pool.duration") == run.duration


def test_the_shots_go_on_from_each_other(sit_down: Any, eight_ball: Server) -> None:
    player = sit_down(eight_ball)
    for x, y in ((1.9, 0.63), (0.3, 0.3), (2.0, 1.0)):
        ball = next(b for b in player.scene.index if b not in player.ask("live.start.off"))
        player.drag(ball, x, y)
        player.played()
        run = player.simulated()
        assert np.array_equal(player.lies(), run.end.position)
        assert set(player.ask("live.start.off")) == run.end.off


def test_the_aim_shows_exactly_what_the_shot_would_do(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.wait("live.track !== null")
    player.press("Escape")
    before = picture(player.visit)
    player.drag("C", 0.9, 0.62, let_go=False)
    player.wait("live.track !== null && !live.aims.busy")
    exact = player.simulated(solver="event-driven", dt=None)
    assert player.ask("live.track.events.length") == len(exact.events)
    assert player.ask("live.track.duration") == exact.duration
    assert picture(player.visit) != before
    assert player.text("tip") == "{:g} m/s at {:.1f}°".format(
        player.question()["speed"], player.question()["angle"]
    )
    player.press("Escape")
    player.page.mouse.up()
    player.page.mouse.move(2, 2)
    assert player.ask("live.last") is None
    assert picture(player.visit) == before


def test_who_lets_go_on_the_ball_does_not_shoot(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.drag("C", 1.0, 0.62, let_go=False)
    player.page.mouse.move(*player.pixel(*player.lies()[0]))
    player.page.mouse.up()
    player.page.wait_for_timeout(200)
    assert player.ask("live.last") is None and player.ask("live.before.length") == 0


def test_numbers_and_keys_aim_too(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.page.select_option("#aim-ball", label="9")
    player.page.fill("#aim-angle", "45")
    player.page.fill("#aim-speed", "1.5")
    player.press("Enter")
    player.played()
    asked = player.question()
    assert (asked["ball"], asked["angle"], asked["speed"]) == ("9", 45.0, 1.5)
    player.press("u", "[", "[")
    assert player.question()["angle"] == 45.2
    player.page.click("#shoot")
    player.played()
    assert np.array_equal(player.lies(), player.simulated().end.position)


def test_speeds_are_in_the_scenarios_units(sit_down: Any) -> None:
    scene = load("report")
    scene = replace(scene, units=replace(scene.units, speed="in/s"))
    for server in served(scene):
        player = sit_down(server)
        player.page.fill("#aim-speed", "50")
        player.press("Enter")
        player.played()
        assert player.question()["speed"] == scene.units.to_si(50.0, "speed")
        assert player.text("setting").startswith("50 in/s at 180°")


def test_a_slider_rolls_from_draw_to_follow(sit_down: Any, report: Server) -> None:
    assert not sit_down(report).page.locator("#roll-slider").is_visible()
    for server in served(load("follow-and-draw")):
        player = sit_down(server)
        rolls = [one["name"] for one in player.ask("live.choices.solvers")]
        assert player.page.locator("#solver").input_value() == rolls[0]
        assert player.page.locator("#aim-roll").input_value() == "1"
        player.page.locator("#roll-slider").fill("-1.25")
        assert player.page.locator("#aim-roll").input_value() == "-1.25"
        player.wait("live.track !== null && !live.aims.busy")
        player.page.click("#shoot")
        player.played()
        assert player.question()["roll"] == -1.25
        assert np.array_equal(player.lies(), player.simulated().end.position)
        player.page.fill("#aim-roll", "3")
        player.press("Enter")
        player.wait("live.last?.roll === 3")
        assert player.page.locator("#roll-slider").input_value() == "2"
        player.played()
        assert np.array_equal(player.lies(), player.simulated().end.position)
        player.press("u", "u")
        assert player.page.locator("#roll-slider").input_value() == "-1.25"
        player.page.goto("about:blank")  # It asks for the aim, and the server ends.


def test_keys_move_the_slider_that_has_the_focus(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.page.click("#shoot")
    player.played()
    player.page.focus("#angle-error")
    for key, value in (("ArrowRight", "0.05"), ("End", "2"), ("ArrowLeft", "1.95"), ("Home", "0")):
        player.press(key)
        assert player.page.locator("#angle-error").input_value() == value
        assert player.page.locator("#angle-error-box").input_value() == value
        assert player.ask("player.time === player.duration")


def test_an_error_can_be_typed(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.ask("() => { live.clouds.ask = async (cloud) => ((live.asked = cloud), null); }")
    for what, typed, sent, slid in (("angle", "0.013", 0.013, "0"), ("speed", "30", 0.3, "20")):
        player.page.fill(f"#{what}-error-box", typed)
        player.press("Enter")
        assert player.ask("live.asked")[f"{what}_error"] == sent
        assert player.page.locator(f"#{what}-error").input_value() == slid
    assert player.ask("live.last") is None
    assert "standard deviations" in player.text("errors")


# -- what the step costs -------------------------------------------------------------------------


def test_another_solver_plays_the_same_shot_beside_the_exact_one(
    sit_down: Any, report: Server
) -> None:
    player = sit_down(report)
    player.page.click("#shoot")
    player.played()
    assert "except for rounding" in player.text("cost")
    assert not player.page.locator("#ghost").is_visible()
    assert not player.page.locator("#plot").is_visible()
    player.page.select_option("#solver", "pymunk-discrete")
    player.wait("live.last.solver === 'pymunk-discrete'")
    player.page.select_option("#step", label="1/60 s")
    player.wait(f"live.last.dt === {1 / 60}")
    player.page.select_option("#law", "coulomb")
    player.wait("live.last.law === 'coulomb' && !live.shooting")
    player.played()
    run = player.simulated()
    exact = player.simulated(solver="event-driven", dt=None)
    assert (run.solver, run.dt, run.law) == ("pymunk-discrete", 1 / 60, "coulomb")
    assert np.array_equal(player.lies(), run.end.position)
    gaps = {id_: math.dist(end, exact.final[id_]) for id_, end in run.final.items()}
    worst = max(gaps, key=gaps.__getitem__)
    text = player.text("cost")
    assert text.startswith(f"Ball {worst} ends ") and text.endswith(" in from its exact end.")
    inches = player.scene.units.from_si(gaps[worst], "length")
    assert float(text.split()[3]) == pytest.approx(inches, rel=1e-2)
    assert player.page.locator("#plot").is_visible()
    assert player.ask("live.before.length") == 1


def test_a_ghost_that_was_put_away_stays_away(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.page.click("#shoot")
    player.played()
    player.page.select_option("#solver", "pymunk-discrete")
    player.wait("player.ghost !== null")
    player.page.select_option("#ghost", "0")
    player.page.select_option("#solver", "pymunk-builtin")
    player.wait("live.last.solver === 'pymunk-builtin' && !live.shooting")
    assert player.ask("player.ghost") is None


# -- the table -----------------------------------------------------------------------------------


@pytest.mark.parametrize("by", ["button", "shift"])
def test_balls_can_be_moved(by: str, sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    if by == "button":
        player.page.click("#move")
    else:
        player.page.keyboard.down("Shift")
    player.drag("5", 2.0, 1.0)
    player.wait("live.before.length === 1")
    i = player.scene.index["5"]
    assert player.lies()[i] == pytest.approx([2.0, 1.0], abs=5e-3)
    player.page.keyboard.up("Shift")
    player.page.click("#undo")
    assert player.lies() == [list(ball.position) for ball in player.scene.balls]


def test_a_place_that_is_taken_is_refused(sit_down: Any, report: Server) -> None:
    player = sit_down(report, refusals=True)
    before = player.lies()
    player.page.click("#move")
    player.drag("5", *player.scene.balls[player.scene.index["9"]].position)
    player.wait("byId('message').textContent.includes('overlaps')")
    assert player.text("message").startswith('ball "9" overlaps ball "5" by ')
    assert player.lies() == before and player.ask("live.before.length") == 0


def test_undo_and_reset(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    first = player.lies()
    for x in (0.9, 1.5):
        player.drag("C", x, 0.6)
        player.played()
        ends = player.lies()
    asked = player.question()
    assert player.page.locator("#plots").is_visible()
    player.press("u")
    assert not player.page.locator("#plots").is_visible()
    assert player.lies() == asked["position"] != first
    assert player.question()["angle"] == asked["angle"]
    player.press("Enter")
    player.played()
    assert player.lies() == ends
    player.page.click("#reset")
    assert player.lies() == first
    player.press("u", "u", "u", "u", "u")
    assert player.lies() == first and player.page.locator("#undo").is_disabled()


def test_a_pocketed_ball_can_be_put_back(sit_down: Any, eight_ball: Server) -> None:
    player = sit_down(eight_ball)
    x, y = player.scene.balls[0].position
    player.page.fill("#aim-angle", str(math.degrees(math.atan2(-y, -x))))  # to the corner
    player.press("Enter")
    player.played()
    assert player.ask("live.start.off") == ["cue"]
    player.page.click("#off button")
    player.wait("live.start.off.length === 0")
    assert player.lies()[0] == list(player.scene.balls[0].position)


def test_a_cloud_shows_what_the_players_error_does(sit_down: Any, report: Server) -> None:
    player = sit_down(report, refusals=True)
    before = picture(player.visit)
    player.page.fill("#angle-error", "0.5")
    for _ in range(240):
        if "ends" in player.text("cloud-text"):
            break
        player.page.wait_for_timeout(1000)
    assert "the errors are standard deviations" in player.text("cloud-text")
    assert player.ask("live.cloud.ends.filter((ends) => ends.length).length") > 3
    player.ask("player.draw()")
    assert picture(player.visit) != before
    player.page.fill("#angle-error-box", "-1")
    player.wait("byId('cloud-text').textContent.startsWith('angle_error = -1: ')")
    player.page.fill("#angle-error", "0")
    player.wait("live.cloud === null")
    assert player.text("cloud-text") == ""


# -- copy and save -------------------------------------------------------------------------------


def test_the_shot_can_be_copied_as_a_scenario(sit_down: Any, report: Server) -> None:
    player = sit_down(report, permissions=["clipboard-read", "clipboard-write"])
    player.page.click("#move")
    player.drag("5", 2.0, 1.0)
    player.wait("live.before.length === 1")
    player.page.click("#move")
    player.drag("C", 0.9, 0.62)
    player.played()
    player.page.click("#copy")
    player.wait("byId('message').textContent.startsWith('Copied')")
    copied = player.ask("navigator.clipboard.readText()")
    assert simulate(loads(copied), 1).end == player.simulated().end


def test_the_shot_can_be_saved_as_a_page(sit_down: Any, report: Server, tmp_path: Path) -> None:
    player = sit_down(report)
    player.drag("C", 0.9, 0.62)
    player.played()
    with player.page.expect_download() as download:
        player.page.click("#save")
    download.value.save_as(tmp_path / "shot.html")
    assert download.value.suggested_filename == "shot.html"
    page = player.visit.context.new_page()
    page.goto((tmp_path / "shot.html").as_uri())
    run = player.simulated()
    ends = page.evaluate("pool.positions(pool.duration)")
    assert {id_: tuple(place) for id_, place in ends.items()} == run.final
    assert not page.locator("#panel").count()


# -- what may go wrong ---------------------------------------------------------------------------


def test_a_second_tab_has_a_table_of_its_own(sit_down: Any, report: Server) -> None:
    one, other = sit_down(report), sit_down(report)
    start = other.lies()
    one.drag("C", 0.9, 0.62)
    one.played()
    assert other.lies() == start
    other.drag("9", 1.2, 0.9)
    other.played()
    for player in (one, other):
        assert np.array_equal(player.lies(), player.simulated().end.position)
    assert one.lies() != other.lies()


def test_it_outlives_its_server(sit_down: Any) -> None:
    server = Server(load("report"))
    player = sit_down(server, refusals=True)
    player.drag("C", 0.9, 0.62)
    player.played()
    lies = player.lies()
    server.end()
    player.page.click("#shoot")
    player.wait("byId('message').textContent !== ''")
    assert player.text("message").startswith("The server does not answer.")
    assert player.lies() == lies and player.ask("live.before.length") == 1
    server.begin_again()
    player.page.click("#shoot")
    player.wait("live.before.length === 2")
    player.played()
    assert player.question()["position"] == lies
    assert np.array_equal(player.lies(), player.simulated().end.position)
    assert player.text("message") == ""
    server.end()


def test_a_refusal_is_shown_and_the_table_goes_on(sit_down: Any, report: Server) -> None:
    player = sit_down(report, refusals=True)
    player.ask("live.changeAim({ speed: 1e200 })")
    player.page.click("#shoot")
    player.wait("byId('message').textContent.startsWith('speed = 1e+200: is too large')")
    player.drag("C", 0.9, 0.62)
    player.played()
    assert player.text("message") == ""


def test_hostile_texts_stay_texts(sit_down: Any) -> None:
    for server in served(hostile_scene()):
        player = sit_down(server)
        player.page.click("#shoot")
        player.played()
        assert player.ask("window.hacked") is None
        assert player.ask("document.images.length") == 0


# -- how it looks and feels ----------------------------------------------------------------------


@pytest.mark.parametrize("width", [200, 320, 360, 768, 1280, 1920])
def test_nothing_sticks_out_at_the_sides(width: int, sit_down: Any, report: Server) -> None:
    player = sit_down(report, viewport={"width": width, "height": 800})
    player.page.click("#shoot")
    player.played()
    assert player.ask("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("size", [(1280, 800), (1600, 1000)])
def test_it_fits_the_window(size: tuple[int, int], sit_down: Any, report: Server) -> None:
    looks = dict(zip(("width", "height"), size, strict=True))
    player = sit_down(report, viewport=looks)
    player.page.click("#shoot")
    player.played()
    player.page.select_option("#solver", "pymunk-discrete")
    player.wait("live.last.solver === 'pymunk-discrete' && !live.shooting")
    assert player.ask("document.documentElement.scrollHeight") <= looks["height"]
    for part in ("panel", "events", "plot"):
        box = player.page.locator(f"#{part}").bounding_box()
        assert box["y"] + box["height"] <= looks["height"]


def test_the_speed_covers_no_ball(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    for ball in player.scene.balls[1:]:
        x, y = ball.position
        player.drag("C", x, y, let_go=False)
        tip = player.page.locator("#tip").bounding_box()
        assert tip["y"] + tip["height"] < player.pixel(x, y + ball.radius)[1]
        player.press("Escape")
        player.page.mouse.up()


def test_the_controls_stay_where_they_are(sit_down: Any, report: Server) -> None:
    player = sit_down(report, refusals=True)

    def places() -> list[Any]:
        ids = ("shoot", "solver", "angle-error", "undo", "save")
        return [player.page.locator(f"#{name}").bounding_box() for name in ids]

    before = places()
    player.page.click("#shoot")
    player.played()
    assert places() == before
    player.ask("live.changeAim({ speed: 1e200 })")
    player.wait("byId('message').textContent !== ''")
    assert places() == before


def test_the_first_aim_is_shown_and_reset_goes_back_to_it(sit_down: Any, report: Server) -> None:
    player = sit_down(report)
    player.wait("live.track !== null")
    first = player.question()
    player.drag("9", 1.2, 0.9)
    player.played()
    player.press("r")
    player.wait("live.track !== null")
    assert player.question() == first
    player.press("Enter")
    player.played()
    assert player.question() == first
    assert np.array_equal(player.lies(), player.simulated().end.position)


def test_a_finger_shoots(sit_down: Any, report: Server) -> None:
    phone = {"viewport": {"width": 360, "height": 740}, "has_touch": True, "is_mobile": True}
    player = sit_down(report, **phone)
    session = player.visit.context.new_cdp_session(player.page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        at = [{"x": x, "y": y} for x, y in points]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})

    x, y = player.pixel(*player.lies()[0])
    touch("touchStart", (x + 12, y))  # A finger is not that precise.
    for k in range(1, 6):
        touch("touchMove", (x - 20 * k, y + k))
    touch("touchEnd")
    player.played()
    assert np.array_equal(player.lies(), player.simulated().end.position)


def test_how_long_from_letting_go_to_the_first_moving_frame(
    sit_down: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """This measures, from the server's start on; the page's documentation has the figures."""
    for server in served(load("report")):
        player = sit_down(server)
        player.ask("""() => {
            window.took = [];
            let since = null;
            const up = (event) => { since = event.timeStamp; };
            byId("table").addEventListener("pointerup", up, true);
            const draw = live.table.draw.bind(live.table);
            live.table.draw = (moment) => {
                draw(moment);
                if (since === null || moment.t === 0) return;
                took.push(performance.now() - since);
                since = null;
            };
        }""")
        for k in range(SHOTS):
            player.drag("C", 1.1 - 0.01 * k, 0.62, let_go=False)
            player.wait("live.track !== null && !live.aims.busy")
            player.page.wait_for_timeout(REST)
            player.page.mouse.up()
            player.played()
            player.press("u")
        took = player.ask("took")
    assert len(took) == SHOTS
    late = sorted(took)[math.ceil(0.95 * SHOTS) - 1]
    with capsys.disabled():
        print(f"\nfrom letting go to the first moving frame: the first shot took {took[0]:.0f} ms,")
        print(
            f"{SHOTS} shots {median(took):.0f} ms (median); 95 % of them took {late:.0f} ms at most"
        )
