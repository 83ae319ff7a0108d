"""The log says how far ends are off in as many digits as show it, and sums up what agrees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Patch,
    Pocket,
    Restitution,
    Run,
    Scene,
    Shot,
    Table,
    load,
    simulate,
)  # fmt: skip
from pool_pymunk.model import Point
from pool_pymunk.report.listing import Agreement, closing, implausible, shot_lines, unreached
from tests.shared.scenes import INCH

END = 1.0 / (2.0 * 0.25 * 9.80665)  # m; where a ball stops that starts at 1 m/s


def played(published: Mapping[str, Point], name: str = "S") -> Run:
    """Return a shot of a ball, along x, with published ends."""
    shot = Shot(name, "1", (1.0, 0.0), published=dict(published))
    scene = Scene((Ball("1", (0.0, 0.0), 0.03, 0.2),), None, friction=Friction(0.25), shots=(shot,))
    return simulate(scene, solver="event-driven")


@pytest.mark.parametrize(
    ("off", "said"),
    [(0.00031, "0.00031"), (0.00096, "0.0010"), (0.0123, "0.0123"), (1.5, "1.5000")],
)
def test_two_figures_of_a_distance_are_seen_at_least(off: float, said: str) -> None:
    [line] = [line for line in shot_lines(played({"1": (END + off, 0.0)})) if "off by" in line]
    assert line.endswith(f"off by {said}")


def test_the_last_line_sums_up_the_ends_of_all_shots() -> None:
    right, wrong = played({"1": (END, 0.0)}), played({"1": (END, 0.5)}, "T")
    assert [*closing([right])] == ["Published ends: 1 of 1 agree to 0.0001"]
    assert [*closing([right, wrong])] == ["Published ends: 1 of 2 agree to 0.0001 (1 + 0)"]
    assert [*closing([played({})])] == []


@pytest.mark.parametrize(("radius", "is_reached"), [(3.0, False), (3.181, False), (3.183, True)])
def test_a_pocket_that_no_ball_can_reach_is_warned_of(radius: float, is_reached: bool) -> None:
    """Balls of 2.25 in stay 2.25 sqrt(2) in away from a corner of the report's table."""
    corner = Pocket("corner", (88.0 * INCH, 44.0 * INCH), radius * INCH)
    found = list(unreached(replace(load("report"), pockets=(corner,))))
    said = "no ball can reach pocket corner: cushions keep every centre 3.18 in away, and"
    assert [text[: len(said)] for text in found] == ([] if is_reached else [said])


def test_a_pocket_at_a_cushion_is_reached_by_a_ball_that_touches_it() -> None:
    side = Pocket("side", (44.0 * INCH, 0.0), 2.25 * INCH)
    assert list(unreached(replace(load("report"), pockets=(side,)))) == []


@pytest.mark.parametrize(("x", "is_beside"), [(1.2, True), (1.099, False), (-0.101, True)])
def test_a_patch_beside_the_table_is_warned_of(x: float, is_beside: bool) -> None:
    corners = ((x - 0.1, 0.2), (x + 0.1, 0.2), (x, 0.4))
    for patch in (Patch(corners, surface=0.5), Patch(center=(x, 0.2), radius=0.1, surface=0.5)):
        ball, table = Ball("a", (0.5, 0.5), 0.02, 0.1), Table.rectangle(1.0, 1.0)
        scene = Scene((ball,), table, Restitution(cushion=0.8), patches=(patch,))
        said = ["patch 0 lies beside the table, so that no ball comes to it"]
        assert [*implausible(scene)] == (said if is_beside else [])


def test_a_changed_shot_is_told_to_go_without_published_ends() -> None:
    """It is not, where the report's own shot is played by another law or solver."""
    report, hint = load("report"), "; if you have changed the shot, delete its `published`"
    changed = replace(report.shots[0], velocity=(-2.0, 0.0))
    run = simulate(replace(report, shots=(changed,)), solver="event-driven")
    assert Agreement.of(run).sentence(run).endswith(f" in off{hint}")
    for run in (
        simulate(report, 1, solver="event-driven", law="coulomb"),
        simulate(report, 1, solver="pymunk-builtin"),
        simulate(report, 1, solver="event-driven"),
    ):
        assert hint not in Agreement.of(run).sentence(run)


@pytest.mark.parametrize(("place", "reached"), [((2.0, 1.0), True), ((2.4, 1.0), False)])
@pytest.mark.parametrize("shape", ["circle", "octagon", "bay"])
def test_a_pocket_out_of_reach_is_found_on_every_table(
    shape: str, place: Point, reached: bool
) -> None:
    """The centres of the balls come up to x = 1.9 m."""
    outlines = {
        "circle": Table.circle(1.0),
        "octagon": Table(((0.6, 0.0), (1.4, 0.0), (2.0, 0.6), (2.0, 1.4), (1.4, 2.0), (0.6, 2.0),
                          (0.0, 1.4), (0.0, 0.6))),
        "bay": Table(((0.0, 0.0), (1.5, 0.0), (1.5, 0.6), (2.0, 0.6), (2.0, 1.4), (0.0, 1.4))),
    }  # fmt: skip
    ball = Ball("a", (1.0, 1.0), 0.1, 0.2)
    scene = Scene(
        (ball,), outlines[shape], Restitution(cushion=0.8), pockets=(Pocket("end", place, 0.11),)
    )
    found = [*unreached(scene)]
    assert len(found) == (not reached)
    assert (
        reached or "no ball can reach pocket end: cushions keep every centre 0.5 m away" in found[0]
    )
