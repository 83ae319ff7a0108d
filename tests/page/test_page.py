"""The page is one file that shows runs and nothing else, whatever stands in a scenario."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Pocket,
    Restitution,
    Run,
    Scene,
    SettingError,
    load,
    simulate,
    simulate_all,
    simulate_many,
)
from pool_pymunk.page import page
from pool_pymunk.render.view import DOT
from pool_pymunk.safety.files import bundled
from tests.shared.commands import exit_code, refusal
from tests.shared.hostile import hostile_scene


@pytest.fixture(scope="module")
def report() -> list[Run]:
    return list(simulate_all(load("report"), solver="pymunk"))


def content_of(document: str) -> dict[str, Any]:
    """Return what a page shows."""
    (found,) = re.findall(r'<script type="application/json" id="content">(.*?)</script>', document)
    content: dict[str, Any] = json.loads(found)
    return content


def test_the_reports_four_shots_are_small(report: list[Run]) -> None:
    assert len(page([[run] for run in report]).encode()) < 150_000


def test_breakpoints_keep_every_bit(report: list[Run]) -> None:
    shots = content_of(page([[run] for run in report]))["shots"]
    for run, shot in zip(report, shots, strict=True):
        shown = shot["runs"][0]
        assert shown["duration"] == run.duration
        for breakpoints, its in zip(run.knots, shown["knots"], strict=True):
            assert np.array_equal(breakpoints, np.array(its))


def test_a_table_has_the_colour_of_its_own_in_light_and_dark() -> None:
    styles = content_of(page([[simulate(load("carrom"), 3)]]))["styles"]
    assert {styles[name]["cloth"] for name in ("light", "dark")} == {"#e2b779"}


def test_a_page_needs_no_other_file(report: list[Run]) -> None:
    document = page([report[:1]])
    assert not re.search(r"https?:|src=|href=|@import|url\(", document)


def test_the_policy_allows_the_pages_own_scripts_alone(report: list[Run]) -> None:
    document = page([report[:1]])
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="(.*?)"', document)
    assert "default-src 'none'" in policy and "unsafe" not in policy
    blocks = re.findall(r"<(script|style)>(.*?)</\1>", document, re.DOTALL)
    assert len(blocks) == 6
    for _, text in blocks:
        digest = hashlib.sha256(text.encode()).digest()
        assert base64.b64encode(digest).decode() in policy


def test_no_text_of_a_scenario_becomes_markup() -> None:
    plain, hostile = load("eight-ball"), hostile_scene()
    documents = [page([[simulate(scene, 1, solver="event-driven")]]) for scene in (plain, hostile)]
    tags = [re.findall(r"<[!/a-zA-Z][^>]*>", document) for document in documents]
    assert len(tags[0]) == len(tags[1])
    content = content_of(documents[1])
    assert content["title"] == hostile.title
    assert [ball["id"] for ball in content["balls"]] == [ball.id for ball in hostile.balls]


def test_to_html_returns_and_writes_the_same(report: list[Run], tmp_path: Path) -> None:
    path = tmp_path / "new" / "one.html"
    report[0].to_html(path)
    assert path.read_text(encoding="utf-8") == report[0].to_html()


def test_ghosts_say_what_they_are() -> None:
    scene = load("report")
    run = simulate(scene, 1, solver="event-driven")
    others = [simulate(scene, 1, solver="event-driven", law="coulomb"), simulate(scene, 1)]
    (shot,) = content_of(run.to_html(overlay=others))["shots"]
    assert [each["label"] for each in shot["runs"]] == [
        "event-driven, published law",
        "event-driven, coulomb law",
        "pymunk, dt = 1/240 s, published law",
    ]


def test_scenes_of_one_title_say_in_what_they_differ() -> None:
    scene = load("eight-ball")
    soft = replace(scene, restitution=replace(scene.restitution, cushion=0.6))
    runs = [simulate(each, 1, solver="event-driven", max_time=0.5) for each in (scene, soft)]
    (shot,) = content_of(runs[0].to_html(overlay=runs[1:]))["shots"]
    said = ["cushion restitution 0.75", "cushion restitution 0.6"]
    assert [each["label"] for each in shot["runs"]] == said


def test_a_page_of_no_runs_is_refused() -> None:
    with pytest.raises(SettingError, match="one run or more is needed"):
        page([])


def test_numbers_out_of_range_become_null(report: list[Run]) -> None:
    last = [1.0, np.inf, np.nan, 0.0, 0.0, 0.0, 0.0]
    breakpoints = tuple(np.vstack([rows, [last]]) for rows in report[0].knots)
    document = replace(report[0], knots=breakpoints, status="non_finite").to_html()
    assert content_of(document)["shots"][0]["runs"][0]["knots"][0][-1][:3] == [1.0, None, None]


# -- in notebooks --------------------------------------------------------------------------------


def test_a_ball_is_off_from_the_beginning_only_if_no_pocket_takes_it_in() -> None:
    balls = Ball("C", (0.0, 0.0), 0.03, 0.2, velocity=(2.0, 0.0)), Ball("1", (0.0, 1.0), 0.03, 0.2)
    hole, friction = Pocket("P", (0.5, 0.0), 0.1), Friction(0.2)
    scene = Scene(balls, None, Restitution(0.9), friction, pockets=(hole,))
    start = scene.start(None)._replace(off=frozenset({"1"}))
    run = simulate(scene, start=start, solver="event-driven")
    assert run.pocketed == {"C": "P"} and run.off == {"C", "1"}
    assert content_of(page([[run]]))["shots"][0]["runs"][0]["off"] == [scene.index["1"]]


@pytest.mark.parametrize(
    ("duration", "decimals"), [(0.0, 3), (12.3, 3), (1.23, 3), (0.123, 4), (0.00123, 6)]
)
def test_times_have_four_digits_of_the_duration(
    report: list[Run], duration: float, decimals: int
) -> None:
    shown = content_of(page([[replace(report[0], duration=duration)]]))["shots"][0]["runs"][0]
    assert shown["decimals"] == decimals


def test_a_run_shows_itself_as_its_page(report: list[Run]) -> None:
    shown = report[0]._repr_html_()
    (document,) = re.findall(r'srcdoc="(.*?)"', shown, re.DOTALL)
    assert html.unescape(document) == report[0].to_html()
    assert 'sandbox="allow-scripts"' in shown


def test_a_scene_shows_its_table_and_a_batch_its_cloud() -> None:
    scene = load("report")
    start = scene.start(scene.shots[0])
    many = (
        np.tile(np.array(start.position), (3, 1, 1)),
        np.tile(np.array(start.velocity), (3, 1, 1)),
    )
    many[1][1:] *= 0.5, 0.7
    for shown in (scene, simulate_many(scene, *many)):
        text = shown._repr_html_()
        image = re.findall(r'<img src="data:image/png;base64,(.*?)"', text)[0]
        assert base64.b64decode(image).startswith(b"\x89PNG")
        assert html.escape(repr(shown)) in text


def test_a_batch_without_ends_shows_an_empty_table() -> None:
    scene = load("report")
    nowhere = np.zeros((2, len(scene.balls), 2))
    assert "<img" in simulate_many(scene, nowhere, nowhere)._repr_html_()


def test_hostile_texts_are_escaped_in_notebooks() -> None:
    scene = Scene(balls=(Ball("<b>", (0.0, 0.0), 0.1, 1.0),), title="<script>")
    assert "<script>" not in scene._repr_html_()
    assert "<script" not in simulate(scene)._repr_html_()


# -- the command ---------------------------------------------------------------------------------


def test_the_command_writes_every_shot_with_its_ghosts(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    ghosts = ("--overlay", "pymunk-discrete:1/240:coulomb", "--overlay", "event-driven")
    assert exit_code("page", "report", *ghosts, "--out", path) == 0
    shots = content_of(path.read_text(encoding="utf-8"))["shots"]
    assert [shot["name"] for shot in shots] == [shot.name for shot in load("report").shots]
    assert all(len(shot["runs"]) == 3 for shot in shots)


def test_the_command_shows_one_shot_by_a_solver(tmp_path: Path) -> None:
    path = tmp_path / "one.html"
    chosen = ("--shot", "2", "--solver", "pymunk", "--dt", "1/60", "--law", "coulomb")
    assert exit_code("page", "report", *chosen, "--out", path) == 0
    (shot,) = content_of(path.read_text(encoding="utf-8"))["shots"]
    run = simulate(load("report"), 2, dt=1 / 60, law="coulomb")
    assert shot["runs"][0]["duration"] == run.duration
    assert shot["runs"][0]["label"] == "pymunk, dt = 1/60 s"


def test_a_scene_without_shots_is_played_as_set_up(tmp_path: Path) -> None:
    ball = Ball("a", (0.0, 0.0), 0.1, 1.0, velocity=(1.0, 0.0))
    scene = Scene(balls=(ball,), friction=Friction(surface=0.1))
    scene.to_toml(tmp_path / "one.toml")
    assert exit_code("page", tmp_path / "one.toml", "--out", tmp_path / "one.html") == 0
    assert "as set up" in (tmp_path / "one.html").read_text(encoding="utf-8")


# -- two scenario files --------------------------------------------------------------------------


def changed_report(path: Path, *changes: tuple[str, str]) -> Path:
    """Write the report's scenario with lines changed."""
    text = bundled()["report"].read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) >= 1
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


TITLE = "ME 212 report: eleven balls, four shots"


def test_two_files_are_labelled_by_their_titles(tmp_path: Path) -> None:
    soft = changed_report(
        tmp_path / "soft.toml", (TITLE, "Soft"), ("cushion = 0.70", "cushion = 0.6")
    )
    hard = changed_report(
        tmp_path / "hard.toml", (TITLE, "Hard"), ("cushion = 0.70", "cushion = 0.9")
    )
    ghosts = ("--overlay", hard, "--overlay", "report-corrected")
    out = tmp_path / "page.html"
    assert exit_code("page", soft, *ghosts[:2], "--shot", "2", "--out", out) == 0
    (shot,) = content_of(out.read_text(encoding="utf-8"))["shots"]
    assert [run["label"] for run in shot["runs"]] == ["Soft", "Hard"]
    assert shot["runs"][0]["setting"] == f"pymunk, dt = 1/240 s{DOT}Soft"
    for path, run in zip((soft, hard), shot["runs"], strict=True):
        assert run["duration"] == simulate(load(str(path)), 2).duration
    assert exit_code("page", soft, *ghosts, "--shot", "2", "--out", out) == 0
    (shot,) = content_of(out.read_text(encoding="utf-8"))["shots"]
    assert [run["label"] for run in shot["runs"]][2] == (
        "ME 212 report, as it meant to be: eleven balls, four shots, "
        "pymunk, dt = 1/240 s, coulomb law"
    )


BALLS = "balls (ids and radii, in one order)"


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (('id = "9"', 'id = "nine"'), f"must have the same {BALLS} as report"),
        (("radius = 2.25", "radius = 2.2"), f"must have the same {BALLS} as report"),
        (("width = 44.0", "width = 45.0"), "must have the same table as report"),
    ],
)
def test_files_that_one_picture_cannot_show_get_one_line(
    change: tuple[str, str], line: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    more = (("9 = [", "nine = ["),) if "nine" in change[1] else ()
    path = changed_report(tmp_path / "other.toml", change, *more)
    assert refusal(capsys, "page", "report", "--overlay", path) == (
        f"error: --overlay = {path}: {line}"
    )


def test_another_number_of_shots_gets_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scene = load("report")
    replace(scene, shots=scene.shots[:3]).to_toml(tmp_path / "three.toml")
    assert refusal(capsys, "page", "report", "--overlay", tmp_path / "three.toml").endswith(
        "three.toml: must have as many shots as report (4), but has 3"
    )


# -- cushions ------------------------------------------------------------------------------------


def test_every_cushion_and_post_has_its_number_on_the_picture() -> None:
    """The number stands outside the table next to its cushion, and on or beside its post."""
    for name in ("stadium", "crokinole", "hexagon"):
        run = simulate(load(name), 1, solver="event-driven")
        scene, shown = run.scene, content_of(run.to_html())
        assert [text for _, _, text in shown["numbers"]] == list(
            map(str, range(len(scene.cushions)))
        )
        for (x, y, _), cushion in zip(shown["numbers"], scene.cushions, strict=True):
            gaps = [math.dist((x, y), at) for at in places(scene)]
            assert gaps.index(min(gaps)) == cushion.number
        sides = {event.get("side") for event in shown["shots"][0]["runs"][0]["events"]} - {None}
        hit = {event.cushion for event in run.events if event.cushion is not None}
        assert sides == {f"{'post' if k >= scene.first_post else 'cushion'} {k}" for k in hit}


def places(scene: Scene) -> list[tuple[float, float]]:
    """Return the middle of each cushion, and of each post."""
    edges = scene.table.edges if scene.table else ()
    return [edge.at(0.5)[0] for edge in edges] + [post.position for post in scene.posts]
