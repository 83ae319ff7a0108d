"""The command line behaves as people expect: hints, choices, digits, and clear refusals."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pool_pymunk import load, simulate
from pool_pymunk.cli import main
from pool_pymunk.report.listing import shot_lines

Capture = pytest.CaptureFixture[str]


def exit_code(*arguments: object) -> int:
    """Run the command line in this process and return its exit code."""
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


def refusal(capsys: Capture, *arguments: object) -> str:
    """Return the one line on stderr that answers bad input."""
    assert exit_code(*arguments) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    (line,) = answer.err.splitlines()
    return line


def scene_in(folder: Path, unit: str, start: float, more: str = "") -> Path:
    """Write a scene of one ball that rolls along x, with lengths in ``unit``."""
    file = folder / f"{unit}.toml"
    file.write_text(
        f"[units]\nlength = '{unit}'\n[friction]\nsurface = 0.1\n[[balls]]\nid = 'C'\ncue = true\n"
        f"radius = 0.05\nmass = 0.2\nposition = [{start}, 0.0]\n"
        f"[[shots]]\nvelocity = [1.0, 0.0]\n{more}"
    )
    return file


# -- collide -----------------------------------------------------------------------------------

HIT = ("collide", "--mass-a", 0.2, "--mass-b", 0.2, "--radius", 0.03, "--velocity-a", -1, 0)


def test_collide_prints_no_negative_zero(capsys: Capture) -> None:
    for offset in (0.0, 1e-9, 0.02, 0.03):
        assert exit_code(*HIT, "--offset", offset) == 0
        printed = capsys.readouterr().out
        assert "0.00% lost" in printed
        assert re.search(r"-0(\.0*)?(?![\d.e])", printed) is None, printed


def test_a_collision_that_gains_energy_says_so(capsys: Capture) -> None:
    sideways = ("--velocity-b", 0, 1, "--law", "published", "--friction", 0.1, "--angle", 180)
    assert exit_code(*HIT, *sideways) == 0
    assert "0.2 J before, 0.221 J after, 10.50% gained\n" in capsys.readouterr().out


def test_the_picture_of_a_collision_calls_the_offset_by_its_name(tmp_path: Path) -> None:
    file = tmp_path / "hit.svg"
    assert exit_code(*HIT, "--offset", 0.02, "--picture", file) == 0
    drawn = file.read_text(encoding="utf-8")
    assert "<!-- offset 0.02 m -->" in drawn
    assert "<!-- e = " not in drawn


# -- the log's digits ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "start", "end"),
    [
        ("m", 0.2, "[ 0.7099,  0.0000] (m)"),
        ("cm", 20.0, "[70.99,  0.00] (cm)"),
        ("mm", 200.0, "[709.9,  0.0] (mm)"),
        ("in", 0.0, "[20.07,  0.00] (in)"),
    ],
)
def test_the_log_has_digits_that_suit_the_unit(
    unit: str, start: float, end: str, tmp_path: Path
) -> None:
    run = simulate(load(scene_in(tmp_path, unit, start)), solver="event-driven")
    assert f"    Ball  C: {end}" in list(shot_lines(run))


def test_published_ends_are_compared_in_the_digits_of_the_log(
    tmp_path: Path, capsys: Capture
) -> None:
    file = scene_in(tmp_path, "m", 0.2, "published = { C = [0.7089, 0.0] }\n")
    assert exit_code("run", file, "--out", tmp_path, "--no-pictures") == 0
    printed = capsys.readouterr().out
    assert "[ 0.7089,  0.0000]   off by 0.0010" in printed
    assert "0 of 1 agree with the published ends to 0.0001 m; the farthest" in printed
    assert "Published ends: 0 of 1 agree to 0.0001\n" in printed


# -- what makes no sense -------------------------------------------------------------------------


@pytest.mark.parametrize("films", ["mp4", "gif"])
def test_a_film_cannot_begin_after_its_end(films: str, tmp_path: Path, capsys: Capture) -> None:
    where = ("--out", tmp_path / "films", "--format", films)
    line = refusal(capsys, "render", "two-balls", "--from", "3", *where)
    assert line == ("error: --from = 3: is beyond the end of the film: Offset hit ends at 0.5 s")
    assert not list(tmp_path.iterdir())
