"""The worksheet is printed without a build of the documentation, and gives no answer away."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from pool_pymunk import load, simulate
from pool_pymunk.cli.worksheet import html
from tests import ROOT
from tests.shared.commands import exit_code


def written(*options: str, folder: Path) -> str:
    """Return the page that the command writes."""
    path = folder / "page.html"
    assert exit_code("worksheet", *options, "--out", str(path)) == 0
    return path.read_text(encoding="utf-8")


def exercise(number: int) -> str:
    """Return an exercise of the worksheet."""
    text = (ROOT / "docs" / "worksheet.md").read_text(encoding="utf-8")
    return re.split(r"^## ", text, flags=re.MULTILINE)[number]


def test_each_exercise_has_a_sheet_with_a_line_for_the_name(tmp_path: Path) -> None:
    opening, *sheets = re.findall(
        r"<section>(.*?)</section>", written(folder=tmp_path), flags=re.DOTALL
    )
    assert "<h1>" in opening and "import math" in opening
    assert [int(re.findall(r"<h2>(\d+)", sheet)[0]) for sheet in sheets] == [*range(1, 12)]
    for sheet in sheets:
        assert sheet.count("<h2>") == sheet.count(">Name<") == 1


def test_a_sheet_with_python_has_its_imports_and_none_names_another_page(tmp_path: Path) -> None:
    page = written(folder=tmp_path)
    for sheet in re.findall(r"<section>(.*?)</section>", page, flags=re.DOTALL):
        assert sheet.count("import math") == min(sheet.count("language-python"), 1)
        assert "docs/" not in sheet


@pytest.mark.parametrize("options", [(), ("--answers",)])
def test_the_page_needs_nothing_else(options: tuple[str, ...], tmp_path: Path) -> None:
    page = written(*options, folder=tmp_path)
    assert "$" not in page and "\ue000" not in page
    assert not re.search(r"<(a|img|script|link)\b", page)
    assert "<math" in page


def test_the_answers_have_the_exercises_and_no_others(tmp_path: Path) -> None:
    sheets, answers = written(folder=tmp_path), written("--answers", folder=tmp_path)
    assert answers.count("<li>") == sheets.count(">Name<") == 11
    assert answers.count("<ol>") == 1 and "<h2>" not in answers
    assert exercise(11).startswith("11. A hit by hand")
    assert answers.rpartition("<li>")[2].count("<tr>") == 10


def test_the_hit_by_hand_has_the_numbers_of_its_scenario() -> None:
    a, b = (scene := load("two-balls")).balls
    for value in (a.mass * 1e3, b.mass * 1e3):
        assert f"({value:g} g, " in exercise(11)
    assert f"e = {scene.restitution.ball_ball:g}$" in exercise(11)
    assert f"mu = {scene.friction.ball_ball:g}$" in exercise(11)
    normal = simulate(scene).contacts[0].normal
    assert normal is not None
    angle = math.degrees(math.atan2(normal[1], normal[0]))
    assert f"at {angle:.4f} degrees" in exercise(11)


def test_every_line_that_is_printed_has_its_unit() -> None:
    text = (ROOT / "docs" / "worksheet.md").read_text(encoding="utf-8")
    prints = re.findall(r"^ *print\((.*)\)$", text, re.MULTILINE)
    assert len(prints) == 9
    for line in prints:
        assert re.search(r" degrees| N s|\} s: |\bm/s", line), line


def test_it_goes_where_commands_put_their_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert exit_code("worksheet", "--answers") == 0
    assert capsys.readouterr().out == "renders/worksheet-answers.html\n"
    assert (tmp_path / "renders" / "worksheet-answers.html").exists()


def test_formulas_and_code_stay_whole() -> None:
    page = html("`$a < b` costs a dollar")
    assert page == "<p><code>$a &lt; b</code> costs a dollar</p>\n"


def test_a_function_stands_apart_from_its_number_and_a_per_cent_sign_does_not() -> None:
    for formula in (r"$\tan 34.99^\circ$", r"$\ln 3.5$", r"$\sin\alpha$"):
        assert '</mi><mspace width="0.167em" />' in html(formula)
    assert "mspace" not in html(r"$\ln(44)$")
    assert html("It loses 37.5 %") == "<p>It loses 37.5\u00a0%</p>\n"


@pytest.mark.parametrize(("number", "answer"), [(3, "m_A ="), (3, "0.5"), (9, "sqrt"), (9, "mean")])
def test_an_exercise_does_not_give_its_answer_away(number: int, answer: str) -> None:
    assert answer not in exercise(number)
    answers = (ROOT / "docs" / "worksheet-answers.md").read_text(encoding="utf-8")
    assert answer in re.split(r"^\d+\. ", answers, flags=re.MULTILINE)[number]


def test_events_are_printed_with_their_kind() -> None:
    assert "{event.kind} of" in exercise(8)
