"""The live table plays what `simulate` plays, keeps strangers out, and survives garbage."""

from __future__ import annotations

import http.client
import importlib
import json
import math
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import pool_pymunk
from pool_pymunk import SOLVERS, Run, Scene, Shot, State, load, simulate
from pool_pymunk.model.scenario import bundled, loads
from tests.shared.commands import exit_code, refusal
from tests.shared.programs import TIMEOUT, interrupt, is_alive, start, wait_until

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

from pool_pymunk.page.live import answers, server, worker
from pool_pymunk.page.live.answers import Answers
from pool_pymunk.page.live.server import LiveServer
from pool_pymunk.page.live.worker import Worker
from pool_pymunk.studies.variation import Normal, numbers

STILL = [[0.0, 0.0]]
Question = dict[str, Any]


def question(scene: Scene, **more: Any) -> Question:
    """Return the question of a shot from where the scene has its balls."""
    shot = scene.shots[0]
    return {
        "position": [list(ball.position) for ball in scene.balls],
        "velocity": STILL * len(scene.balls),
        "ball": shot.ball,
        "speed": 2.0,
        "angle": 180.0,
    } | more


def answered(scene: Scene, name: str, asked: object) -> tuple[int, Any]:
    """Return the status and the content of an answer."""
    text = asked if isinstance(asked, bytes) else json.dumps(asked).encode()
    answer = Answers(scene).to(name, text)
    return answer.status, json.loads(answer.text)


def simulated(scene: Scene, asked: Question, **more: Any) -> Run:
    """Return what `simulate` makes of a question."""
    roll = asked.get("roll", 0.0)
    shot = Shot("asked", asked["ball"], speed=asked["speed"], angle=asked["angle"], roll=roll)
    off = frozenset(asked.get("off", ()))
    rolls = asked.get("rolls") and tuple(map(tuple, asked["rolls"]))
    places, velocities = (tuple(map(tuple, asked[key])) for key in ("position", "velocity"))
    begin = State(places, velocities, off, rolls)
    return simulate(replace(scene, shots=(shot,)), 1, start=begin, **more)


def assert_same(shown: Any, run: Run) -> None:
    """A shown run is this run, to the last bit."""
    assert shown["duration"] == run.duration
    assert shown["solver"] == run.solver
    assert len(shown["events"]) == len(run.events)
    for breakpoints, its in zip(run.knots, shown["knots"], strict=True):
        assert np.array_equal(breakpoints, np.array(its))


# -- answers -------------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", [name for name in SOLVERS if name != "time-slice"])
def test_a_shot_is_what_simulate_plays_beside_the_exact_run(solver: str) -> None:
    scene = load("report")
    asked = question(scene, solver=solver)
    status, content = answered(scene, "shot", asked)
    assert status == 200
    (shot,) = content["shots"]
    assert_same(shot["runs"][0], simulated(scene, asked, solver=solver))
    assert_same(shot["runs"][-1], simulated(scene, asked, solver="event-driven"))
    assert len(shot["runs"]) == (1 if solver == "event-driven" else 2)


def test_step_and_law_are_those_that_were_asked_for() -> None:
    scene = load("report")
    asked = question(scene, solver="pymunk-discrete", dt=1 / 60, law="coulomb")
    run, exact = answered(scene, "shot", asked)[1]["shots"][0]["runs"]
    assert_same(run, simulated(scene, asked, solver="pymunk-discrete", dt=1 / 60, law="coulomb"))
    assert_same(exact, simulated(scene, asked, solver="event-driven", law="coulomb"))


def test_the_next_shot_goes_on_from_the_end_of_the_one_before() -> None:
    scene = load("eight-ball")
    first = simulate(scene, 1, solver="event-driven")
    assert first.off
    end = first.end
    state = {"position": end.position, "velocity": end.velocity, "off": sorted(end.off)}
    asked = question(scene, solver="event-driven", **state)
    asked["ball"] = next(ball.id for ball in scene.balls if ball.id not in end.off)
    shown = answered(scene, "shot", asked)[1]["shots"][0]["runs"][0]
    assert_same(shown, simulated(scene, asked, solver="event-driven"))
    assert [scene.balls[i].id for i in shown["off"]] == [
        ball.id for ball in scene.balls if ball.id in end.off
    ]


def test_the_aim_is_the_exact_run() -> None:
    scene = load("l-shaped")
    asked = question(scene, solver="pymunk-builtin")
    assert_same(answered(scene, "aim", asked)[1], simulated(scene, asked, solver="event-driven"))


def test_runs_have_an_end() -> None:
    scene = load("two-balls")
    assert answered(scene, "aim", question(scene))[1]["duration"] == scene.physics.max_time
    free = replace(scene, physics=replace(scene.physics, max_time=1e6))
    assert answered(free, "aim", question(scene))[1]["duration"] == answers.LONGEST
    report = load("report")
    fast = answered(report, "aim", question(report, speed=1e6))[1]
    assert len(fast["events"]) <= answers.MOST_EVENTS


# -- balls that roll -----------------------------------------------------------------------------

ROLLS = load("follow-and-draw")


@pytest.mark.parametrize("name", ["shot", "aim"])
@pytest.mark.parametrize("rolls", [None, [[0.3, 0.1], [0.0, -0.4]]])
def test_roll_is_sent_with_the_shot(name: str, rolls: list[list[float]] | None) -> None:
    asked = question(ROLLS, solver="event-driven", angle=0.0, roll=-1.3, rolls=rolls)
    answer = answered(ROLLS, name, asked)[1]
    shown = answer if name == "aim" else answer["shots"][0]["runs"][0]
    assert_same(shown, simulated(ROLLS, asked, solver="event-driven"))
    if name == "shot":
        assert answer["shots"][0]["name"] == "2 m/s at 0°, roll -1.3"


def test_only_solvers_that_roll_are_offered_where_balls_roll() -> None:
    live = answers.live_content(ROLLS)["live"]
    rolling = [name for name, solver in SOLVERS.items() if solver.rolls]
    assert [one["name"] for one in live["solvers"]] == rolling
    assert live["roll"] == ROLLS.shots[0].roll == 1.0
    slides = answers.live_content(load("report"))["live"]
    assert [one["name"] for one in slides["solvers"]] == list(SOLVERS) and slides["roll"] is None


def test_lines_say_how_the_balls_roll() -> None:
    moving = {"velocity": [[0.0, 0.0], [0.5, 0.0]], "rolls": [[0.0, 0.0], [-0.25, 0.0]]}
    asked = question(ROLLS, solver="event-driven", angle=0.0, roll=0.5, **moving)
    again = simulate(loads(lines(ROLLS, asked)), 1, solver="event-driven")
    assert again.end == simulated(ROLLS, asked, solver="event-driven").end
    curves = asked | {"rolls": [[0.0, 0.0], [0.0, 0.1]]}
    status, answer = answered(ROLLS, "scenario", curves)
    assert status == 400 and "rolls across its velocity" in answer["problems"][0]


def test_a_cloud_of_balls_that_roll() -> None:
    asked = question(ROLLS, angle=0.0, roll=-1.0, angle_error=0.01)
    status, cloud = answered(ROLLS, "cloud", asked)
    end = simulated(ROLLS, asked, solver="event-driven").final["cue"]
    assert status == 200
    assert np.median(cloud["ends"][0], axis=0) == pytest.approx(end, abs=0.01)


@pytest.mark.parametrize(
    ("scene", "more", "line"),
    [
        (load("report"), {"roll": 1.0}, "roll = 1.0: balls do not roll"),
        (load("report"), {"rolls": STILL * 11}, "start.roll = "),
        (ROLLS, {"roll": math.inf}, "roll = inf: "),
        (ROLLS, {"rolls": STILL}, "start.roll = [[0.0, 0.0]]: must be 2 points"),
    ],
)
def test_a_roll_that_cannot_be_gets_one_line(scene: Scene, more: Question, line: str) -> None:
    status, answer = answered(scene, "shot", question(scene, solver="event-driven", **more))
    assert status == 400
    assert len(answer["problems"]) == 1 and line in answer["problems"][0]


def test_a_saved_shot_is_a_page_of_its_own() -> None:
    scene = load("report")
    answer = Answers(scene).to("save", json.dumps(question(scene)).encode())
    assert answer.type == "text/html" and answer.status == 200
    assert 'id="shoot"' not in answer.text and "connect-src" not in answer.text
    assert '"event-driven"' in answer.text


# -- places of balls -----------------------------------------------------------------------------


def placed(scene: Scene, ball: str, x: float, y: float) -> tuple[int, Any]:
    """Ask whether a ball may lie at a point (m)."""
    asked = question(scene)
    asked["position"][scene.index[ball]] = [x, y]
    for key in ("speed", "angle"):
        del asked[key]
    return answered(scene, "place", asked | {"ball": ball})


def test_a_ball_may_lie_where_it_is_free() -> None:
    assert placed(load("eight-ball"), "cue", 1.0, 0.3) == (200, {})


@pytest.mark.parametrize(
    ("x", "y", "why"),
    [
        (1.905, 0.64, 'overlaps ball "'),
        (-0.5, 0.3, 'ball "cue" is off the table'),
        (0.6, 0.01, 'ball "cue" overlaps cushion 0 by 0.019 m'),
        (0.05, 0.05, 'ball "cue" is within pocket "head-left"'),
    ],
)
def test_a_refused_place_says_why(x: float, y: float, why: str) -> None:
    status, answer = placed(load("eight-ball"), "cue", x, y)
    assert status == 400
    assert why in answer["problems"][0]


def test_what_is_wrong_with_other_balls_is_not_held_against_this_one() -> None:
    scene = load("eight-ball")
    asked = question(scene, ball="cue")
    asked["position"][scene.index["3"]] = asked["position"][scene.index["4"]]
    del asked["speed"], asked["angle"]
    assert answered(scene, "place", asked) == (200, {})
    assert answered(scene, "place", asked | {"ball": "3"})[0] == 400
    assert answered(scene, "place", asked | {"ball": "x"})[1]["problems"][0].startswith(
        'ball = "x"'
    )


# -- scenario lines ------------------------------------------------------------------------------


def lines(scene: Scene, asked: Question) -> str:
    """Return the scenario lines of a shot."""
    status, answer = answered(scene, "scenario", asked)
    assert status == 200, answer
    return str(answer["text"])


@pytest.mark.parametrize("name", ["report", "eight-ball", "two-balls"])
def test_where_nothing_was_moved_the_lines_are_the_shot_alone(name: str) -> None:
    scene = load(name)
    velocity = [list(ball.velocity) for ball in scene.balls]
    asked = question(scene, velocity=velocity, speed=1.25, solver="event-driven")
    text = lines(scene, asked)
    assert "[[balls]]" not in text and text.count("[[shots]]") == 1
    whole = loads(bundled()[name].read_text(encoding="utf-8") + "\n" + text)
    run = simulate(whole, len(whole.shots), solver="event-driven")
    assert run.end == simulated(scene, asked, solver="event-driven").end


def test_else_the_lines_are_the_whole_scenario() -> None:
    scene = load("eight-ball")
    end = simulate(scene, 1, solver="event-driven").end
    remaining = next(ball.id for ball in scene.balls if ball.id not in end.off)
    asked = question(scene, position=end.position, off=sorted(end.off), ball=remaining, dt=1 / 240)
    text = lines(scene, asked)
    assert text.startswith("# played by --solver pymunk --dt 1/240\n")
    again, run = simulate(loads(text), 1), simulated(scene, asked)
    assert again.final == {id_: run.final[id_] for id_ in again.final}
    assert run.final.keys() - again.final.keys() == end.off


def test_another_law_is_in_the_lines() -> None:
    scene = load("report")
    assert loads(lines(scene, question(scene, law="coulomb"))).physics.law == "coulomb"


# -- clouds --------------------------------------------------------------------------------------


def test_a_cloud_has_the_ends_of_shots_with_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answers, "SAMPLES", 40)
    monkeypatch.setattr(answers, "SOME", 4)  # So it is drawn in four parts.
    scene = load("report")
    asked = question(scene, angle_error=0.5, speed_error=0.02)
    status, cloud = answered(scene, "cloud", asked)
    assert status == 200 and cloud["compiled"] == pool_pymunk.compiled
    assert cloud["samples"] == 40
    drawn = numbers({"turn": Normal(0.5), "speed": Normal(0.02 * 2.0)}, 40)
    struck = scene.index["C"]
    for k in (0, 4, 39):
        erring = asked | {"angle": 180.0 + drawn["turn"][k], "speed": 2.0 + drawn["speed"][k]}
        end = simulated(scene, erring, solver="event-driven").final["C"]
        assert cloud["ends"][struck][k] == pytest.approx(end, abs=1e-5)
    assert len(cloud["ends"][struck]) == cloud["samples"]
    assert cloud["ends"][scene.index["5"]] == []  # It is never met.


def test_a_player_who_never_errs_has_no_cloud() -> None:
    scene = load("report")
    assert not any(answered(scene, "cloud", question(scene))[1]["ends"])


@pytest.mark.slow
def test_a_ball_off_the_table_has_no_cloud() -> None:
    scene = load("eight-ball")
    cloud = answered(scene, "cloud", question(scene, off=["1"], angle_error=1.0))[1]
    assert cloud["ends"][scene.index["1"]] == [] and cloud["ends"][scene.index["cue"]]


def test_plain_python_has_a_small_cloud_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answers, "compiled", False)
    scene = load("report")
    monkeypatch.setattr(answers, "SOME", 4)
    monkeypatch.setattr(answers, "CLOUD_TIME", 1e-9)
    cloud = answered(scene, "cloud", question(scene, angle_error=0.5))[1]
    assert cloud["compiled"] is False and cloud["samples"] == 4


# -- bad questions -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "line"),
    [
        ({"speed": "fast"}, 'speed = "fast": should be a valid number'),
        ({"speed": -1.0}, "speed = -1.0: must be 0 or more"),
        ({"speed": 1e200}, "speed = 1e+200: is too large"),
        ({"dt": -1}, "dt = -1.0: must be greater than 0"),
        ({"solver": "x"}, "solver = x: there is no such solver"),
        ({"law": "x"}, "law = x: must be one of coulomb, published"),
        ({"ball": "x"}, 'shot.ball = "x": there is no such ball'),
        ({"off": ["C"]}, 'shot.ball = "C": the ball is off the table'),
        ({"off": ["x"]}, 'start.off = "x": there is no such ball'),
        ({"position": []}, "start.position = []: must be 11 points"),
        ({"position": [[1.0]] * 11}, "start.position[0] = [1.0]: must be two numbers"),
        ({"position": [[9.0, 9.0]] * 11}, "is off the table"),
        ({"more": 1}, "more = 1: extra inputs are not permitted"),
    ],
)
def test_a_bad_question_gets_one_line_a_problem(more: Question, line: str) -> None:
    scene = load("report")
    status, answer = answered(scene, "shot", question(scene, **more))
    assert status == 400
    assert any(line in problem for problem in answer["problems"]), answer
    assert all("\n" not in problem for problem in answer["problems"])


@pytest.mark.parametrize(
    "text",
    [b"", b"{", b"null", b"[]", b"\xff\xfe", b'{"speed": NaN}', b"[" * 100_000, b"9" * 10_000],
    ids=["empty", "open", "null", "list", "bytes", "nan", "deep", "long"],
)
def test_what_is_no_question_is_refused(text: bytes) -> None:
    status, answer = answered(load("report"), "shot", text)
    assert status == 400 and 1 <= len(answer["problems"]) <= answers.MOST_LINES
    if text == b"[]":
        assert answer["problems"] == ["question: should be an object"]


WORDS = st.text(max_size=9) | st.sampled_from(["C", "1", "pymunk", "event-driven", "coulomb"])
# A shot at 1e90 m/s is sound and takes half a minute: that is for the worker, which cuts it.
NUMBERS = (
    st.integers(-9, 9)
    | st.floats(-1e6, 1e6)
    | st.sampled_from([math.nan, math.inf, 1e-300, 1e101, 1e308, 10**400])
)
ODD: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | WORDS | NUMBERS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(WORDS, inner, max_size=4),
    max_leaves=12,
)
POINTS = st.lists(st.lists(NUMBERS, min_size=2, max_size=2), min_size=11, max_size=11)
SOUND: dict[str, st.SearchStrategy[Any]] = {
    "position": POINTS, "velocity": POINTS, "off": st.lists(WORDS, max_size=3), "ball": WORDS,
    "speed": NUMBERS, "angle": NUMBERS, "law": WORDS, "angle_error": NUMBERS,
}  # fmt: skip
# Each key has a value of its type, or any.
QUESTIONS = st.fixed_dictionaries({}, optional={key: one | ODD for key, one in SOUND.items()})


@pytest.mark.slow
@given(st.sampled_from([*answers.QUESTIONS]), QUESTIONS, st.sampled_from([b"", b"", b"}", b"\0"]))
@example("aim", {"angle": 1e300}, b"")
@example("cloud", {"angle_error": 180.0, "off": ["1"]}, b"")
@settings(max_examples=200)
def test_no_question_makes_it_stumble(name: str, odd: Question, tail: bytes) -> None:
    """Whatever is asked, the answer is JSON or a page, and never the server's own failure."""
    scene = load("report")
    asked = question(scene) | odd
    if name == "place":
        del asked["speed"], asked["angle"]
    answer = Answers(scene).to(name, json.dumps(asked).encode() + tail)
    assert answer.status in (200, 400), answer.text
    if answer.type == "application/json":
        json.loads(answer.text)


# -- the server ----------------------------------------------------------------------------------


class LiveTable:
    """A table is a server in a thread, and asks itself."""

    def __init__(self, scene: Scene) -> None:
        self.server = LiveServer(scene)
        self.thread = threading.Thread(target=self.server.run)
        self.thread.start()

    def ask(
        self, method: str = "POST", path: str = "/api/aim", body: Any = None, **headers: str
    ) -> tuple[int, str]:
        """Send one request and return status and text; an empty header is left out."""
        connection = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=TIMEOUT)
        sent = {"x-pool-token": self.server.token} | {
            key.replace("_", "-"): value for key, value in headers.items()
        }
        body = json.dumps(question(self.server.scene)) if body is None else body
        try:
            connection.putrequest(method, path, skip_host="host" in sent)
            chunked = isinstance(body, list)
            sent |= (
                {"transfer-encoding": "chunked"} if chunked else {"content-length": str(len(body))}
            )
            for key, value in sent.items():
                if value:
                    connection.putheader(key, value.encode("utf-8", "replace"))
            parts = body if chunked else [body]
            connection.endheaders(
                (part.encode() if isinstance(part, str) else part for part in parts),
                encode_chunked=chunked,
            )
            response = connection.getresponse()
            return response.status, response.read().decode()
        finally:
            connection.close()

    def close(self) -> None:
        self.server.stop()
        self.thread.join(TIMEOUT)
        assert not self.thread.is_alive()


@pytest.fixture(scope="module")
def table() -> Iterator[LiveTable]:
    """Give a table whose server has begun to answer."""
    made = LiveTable(load("report"))
    wait_until(lambda: made.ask()[0] == 200)
    yield made
    made.close()


@pytest.fixture(autouse=True)
def _with_all_requests_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no test suffer from the number of requests of those before."""
    monkeypatch.setattr(server, "RATE", 1e9)


def test_it_answers(table: LiveTable) -> None:
    scene = table.server.scene
    status, text = table.ask()
    assert status == 200
    assert_same(json.loads(text), simulated(scene, question(scene), solver="event-driven"))


def test_the_page_wants_the_token_in_its_address(table: LiveTable) -> None:
    path = table.server.address.removeprefix(f"http://127.0.0.1:{table.server.port}")
    status, text = table.ask("GET", path, "", x_pool_token="")
    assert status == 200 and 'id="shoot"' in text and "connect-src 'self'" in text
    for wrong in ("/", "/?token=", "/?token=x", path[:-1]):
        status, text = table.ask("GET", wrong, "", x_pool_token="")
        assert status == 403 and "the token is wrong" in text


@pytest.mark.parametrize("token", ["", "x", "ä", "0" * 10_000])
def test_without_the_token_nothing_is_answered(table: LiveTable, token: str) -> None:
    status, text = table.ask(x_pool_token=token)
    assert status == 403 and "the token is wrong or missing" in text


@pytest.mark.parametrize("host", ["", "example.com", "127.0.0.1", "127.0.0.1.evil.example:80"])
def test_foreign_hosts_are_refused(table: LiveTable, host: str) -> None:
    status, text = table.ask(host=host)
    assert status in (400, 403) and "Traceback" not in text


def test_it_has_two_names(table: LiveTable) -> None:
    port = table.server.port
    for name in ("127.0.0.1", "localhost"):
        assert table.ask(host=f"{name}:{port}", origin=f"http://{name}:{port}")[0] == 200


@pytest.mark.parametrize("origin", ["http://example.com", "null", "http://127.0.0.1:1", "x"])
def test_foreign_origins_are_refused(table: LiveTable, origin: str) -> None:
    status, text = table.ask(origin=origin)
    assert status == 403 and "this page is not the table's" in text


def test_it_listens_on_one_address_only(table: LiveTable) -> None:
    assert table.server.socket.getsockname()[0] == "127.0.0.1"
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.2", table.server.port), timeout=TIMEOUT)


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/api/aim", 403),  # A page that is asked for has its token in the address.
        ("PUT", "/api/aim", 405),
        ("OPTIONS", "/api/aim", 405),
        ("POST", "/api/x", 404),
        ("POST", "/api/../aim", 404),
        ("POST", "/", 405),
        ("POST", "/%00", 404),
    ],
)
def test_other_requests_get_a_clear_answer(
    table: LiveTable, method: str, path: str, status: int
) -> None:
    answered, text = table.ask(method, path)
    assert answered == status
    (problem,) = json.loads(text)["problems"]
    assert status == 403 or problem.endswith("there is no such question")


@pytest.mark.parametrize("chunked", [False, True])
def test_large_questions_are_refused(table: LiveTable, chunked: bool) -> None:
    most = table.server.most_bytes
    parts = ["x" * 1000] * (most // 1000 + 1)
    status, text = table.ask(body=parts if chunked else "".join(parts))
    assert status == 413 and f"more than {most} bytes" in text


def test_a_question_that_never_comes_is_given_up(
    table: LiveTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "ANSWER_TIMEOUT", 0.1)
    with connected(table, b"content-length: 10\r\n\r\n{") as line:
        assert b" 408 " in line.recv(1000)


def connected(table: LiveTable, rest: bytes) -> socket.socket:
    """Return a connection on which a question has begun."""
    port, token = table.server.port, table.server.token
    line = socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT)
    head = f"POST /api/aim HTTP/1.1\r\nhost: 127.0.0.1:{port}\r\nx-pool-token: {token}\r\n"
    line.sendall(head.encode() + rest)
    return line


def test_lost_connections_harm_nobody(table: LiveTable, capfd: pytest.CaptureFixture[str]) -> None:
    for _ in range(20):
        connected(table, b"content-length: 10\r\n\r\n{").close()
    asked = json.dumps(question(table.server.scene)).encode()
    for _ in range(5):
        head = f"content-length: {len(asked)}\r\n\r\n".encode()
        connected(table, head + asked).close()
    assert table.ask()[0] == 200
    assert capfd.readouterr().err == ""


@given(st.binary(max_size=300))
@settings(max_examples=30)
def test_bytes_that_are_no_request_harm_nobody(table: LiveTable, bytes_: bytes) -> None:
    with socket.create_connection(("127.0.0.1", table.server.port), timeout=TIMEOUT) as line:
        line.sendall(bytes_ + b"\r\n\r\n")
        line.shutdown(socket.SHUT_WR)
        assert b"Traceback" not in line.recv(10_000)
    assert table.ask()[0] in (200, 429)


@pytest.mark.slow
def test_a_flood_is_slowed_down_and_goes_by(
    table: LiveTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "RATE", 10.0)
    monkeypatch.setattr(server, "BURST", 20.0)
    answered = [table.ask(body="{}") for _ in range(60)]
    assert {status for status, _ in answered} == {400, 429}
    refusals = [said for status, said in answered if status == 429]
    assert all("too many requests at once" in said for said in refusals)
    wait_until(lambda: table.ask()[0] == 200)


def test_many_ask_at_once(table: LiveTable) -> None:
    """Tabs do not disturb each other: the server keeps nothing of them."""
    found: list[tuple[int, str]] = []
    asked = [json.dumps(question(table.server.scene, angle=float(k))) for k in range(8)]
    threads = [
        threading.Thread(target=lambda body=body: found.append(table.ask(body=body)))
        for body in asked
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT)
    again = [table.ask(body=body) for body in asked]
    assert sorted(found) == sorted(again) and len(set(again)) == 8


def test_no_other_page_may_show_or_keep_it(table: LiveTable) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", table.server.port, timeout=TIMEOUT)
    connection.request("GET", f"/?token={table.server.token}")
    headers = connection.getresponse().headers
    connection.close()
    assert headers["x-frame-options"] == "DENY"
    assert headers["cache-control"] == "no-store"
    assert headers["referrer-policy"] == "no-referrer"


# -- the process that plays ----------------------------------------------------------------------


@pytest.fixture
def player() -> Iterator[Worker]:
    """Give a worker that has begun to answer."""
    made = Worker(load("report"), timeout=TIMEOUT)
    assert made.ask("aim", json.dumps(question(made.scene)).encode()).status == 200
    yield made
    made.end()
    assert not made.process.is_alive()


@pytest.mark.slow
def test_a_shot_that_takes_too_long_is_cut(player: Worker) -> None:
    asked = question(player.scene)
    slow = json.dumps(asked | {"solver": "time-slice", "dt": 1e-9}).encode()
    before, player.timeout = player.process.pid, 0.2
    cut = player.ask("shot", slow)
    assert cut.status == 400 and "takes longer than 0.2 s, so it was cut" in cut.text
    player.timeout = TIMEOUT
    assert player.ask("aim", json.dumps(asked).encode()).status == 200
    assert player.process.pid != before


def test_who_waits_too_long_for_another_is_told(
    player: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "WAIT", 0.1)
    with player.turn:
        assert player.ask("aim", b"{}").status == 503


def test_who_comes_while_another_is_played_waits(player: Worker) -> None:
    asked, found = json.dumps(question(player.scene)).encode(), []
    thread = threading.Thread(target=lambda: found.append(player.ask("aim", asked).status))
    with player.turn:
        player.timeout = 0.01
        thread.start()
        thread.join(0.2)
        assert thread.is_alive()
        player.timeout = TIMEOUT
    thread.join(TIMEOUT)
    assert found == [200]


@pytest.mark.slow
def test_a_process_that_dies_is_started_again(player: Worker) -> None:
    player.process.kill()
    player.process.join()
    asked = json.dumps(question(player.scene)).encode()
    assert player.ask("aim", asked).status == 500
    assert player.ask("aim", asked).status == 200


def test_a_process_that_has_not_begun_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "WAIT", 0.0)
    made = Worker(load("report"), timeout=TIMEOUT)
    try:
        assert made.ask("aim", b"{}").status == 503
    finally:
        made.end()


# -- the command ---------------------------------------------------------------------------------


@contextmanager
def playing() -> Iterator[subprocess.Popen[str]]:
    """Give the command as it runs, with a connection open on which it plays a shot of minutes."""
    process = start("play", "report", "--no-browser")
    assert process.stdout is not None
    address = process.stdout.readline().removeprefix("The table is at ").strip()
    port, token = int(address.split(":")[2].split("/")[0]), address.partition("token=")[2]
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=TIMEOUT)
    asked, aimed = question(load("report")), {"x-pool-token": token}
    connection.request("POST", "/api/aim", json.dumps(asked), aimed)
    assert json.loads(connection.getresponse().read())
    slow = asked | {"solver": "time-slice", "dt": 1e-9}
    connection.request("POST", "/api/shot", json.dumps(slow), aimed)
    time.sleep(0.3)
    yield process
    connection.close()


@pytest.mark.slow
def test_ctrl_c_ends_it_and_its_processes() -> None:
    """That is how one ends it, and no error."""
    with playing() as process:
        assert interrupt(process, code=0) == ""
        wait_until(lambda: not is_alive(process.pid))


@pytest.mark.slow
def test_a_ctrl_c_that_comes_as_it_begins_is_not_lost() -> None:
    process = start("play", "report", "--no-browser")
    assert process.stdout is not None and process.stdout.readline()
    assert interrupt(process, code=0) == ""
    wait_until(lambda: not is_alive(process.pid))


@pytest.mark.slow
def test_its_processes_do_not_outlive_it() -> None:
    with playing() as process:
        process.send_signal(signal.SIGKILL)
        process.wait(TIMEOUT)
        wait_until(lambda: not is_alive(process.pid))
        process.communicate(timeout=TIMEOUT)


def test_a_port_in_use_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        line = refusal(capsys, "play", "report", "--no-browser", "--port", port)
    assert line == f"error: --port = {port}: another program listens there"


def test_without_the_extra_it_says_how_to_get_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    command = importlib.import_module("pool_pymunk.cli.play")
    monkeypatch.setattr(command, "NEEDED", ("json", "no_such_library"))
    line = refusal(capsys, "play", "report", "--no-browser")
    assert line == "error: play: needs a server: pip install 'pool-pymunk[play]'"


def test_it_opens_the_page_where_it_is_wanted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(LiveServer, "run", lambda self: self.socket.close())
    assert exit_code("play", "report", "--no-browser") == 0
    assert opened == []
    assert exit_code("play", "report") == 0
    wait_until(lambda: bool(opened))
    printed = capsys.readouterr().out
    assert f"The table is at {opened[0]}\n" in printed


# -- the page's content --------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(bundled()))
def test_the_first_aim_is_the_first_shot(name: str) -> None:
    scene = load(name)
    content = answers.live_content(scene)
    live = content["live"]
    vx, vy = scene.start(scene.shots[0]).velocity[live["ball"]]
    assert live["speed"] == math.hypot(vx, vy) <= live["top"]
    assert live["angle"] == pytest.approx(math.degrees(math.atan2(vy, vx)))
    for solver in live["solvers"]:
        assert solver["dt"] in [dt for dt, _ in solver["steps"]] or solver["dt"] is None


def test_a_scene_without_shots_can_be_played(tmp_path: Path) -> None:
    scene = replace(load("report"), shots=())
    live = answers.live_content(scene)["live"]
    assert live["ball"] == scene.index["C"] and 0.0 < live["speed"] <= live["top"]
