"""Part 1 of the report is right: the offset's geometry, Eqs. 1 to 7, conservation, bad input."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from pool_pymunk import Collision, Disc, Material, collide, collide_at, load, simulate
from pool_pymunk.model import Point, Units
from pool_pymunk.model.arrays import Array
from pool_pymunk.render import collision
from tests.shared.commands import exit_code

# It gives the angle of the line of centres, from d_y and d_x.
Angle = Callable[[float, float], float]
# It gives the change of v_n that mu multiplies, from v_n and v_n'.
Friction = Callable[[float, float], float]

numbers = st.floats(-5.0, 5.0)
velocities = st.tuples(numbers, numbers)
masses = st.floats(0.05, 5.0)
discs = st.builds(Disc, masses, st.floats(0.01, 0.1), velocities)
materials = st.builds(Material, st.floats(0.0, 1.0), st.floats(0.0, 0.5))
shares = st.floats(-0.99, 0.99)  # of the largest offset


# -- the report's form -----------------------------------------------------------------------------


def turned(v: Point, angle: float) -> Array:
    """Turn a velocity along x and y through the impact angle to normal and tangent (Eq. 4)."""
    rotation = [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    return np.array(rotation) @ v


def turned_back(v: Array, angle: float) -> Array:
    """Turn a velocity along normal and tangent back to x and y (Eq. 7)."""
    rotation = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    return np.array(rotation) @ v


def normal_velocities(m_a: float, m_b: float, a: float, b: float, e: float) -> tuple[float, float]:
    """Solve momentum and restitution, two linear equations (Eqs. 1 to 3)."""
    system = [[m_a, m_b], [1.0, -1.0]]
    after = np.linalg.solve(system, [m_a * a + m_b * b, -e * (a - b)])
    return float(after[0]), float(after[1])


def size_of_change(before: float, after: float) -> float:
    return abs(after - before)


def signed_change(before: float, after: float) -> float:
    """Return the change as Listing 3 has it: right for A if n points at B, wrong for B."""
    return before - after


def report(
    a: Disc,
    b: Disc,
    line: Point,
    material: Material,
    angle_of: Angle = math.atan2,
    change: Friction = size_of_change,
) -> tuple[Array, Array]:
    """Answer by Eqs. 4 to 7: turn, solve, brake the slip by mu |change of v_n|, turn back."""
    angle = angle_of(line[1], line[0])
    before_a, before_b = turned(a.velocity, angle), turned(b.velocity, angle)
    n_a, n_b = normal_velocities(a.mass, b.mass, before_a[0], before_b[0], material.restitution)
    slip = before_a[1] - before_b[1]
    brake_a = material.friction * change(before_a[0], n_a)
    brake_b = material.friction * size_of_change(before_b[0], n_b)
    t_a = before_a[1] - np.sign(slip) * brake_a
    t_b = before_b[1] + np.sign(slip) * brake_b
    if brake_a >= 0.0 and abs(slip) < brake_a + brake_b:  # Friction stops a slip, at most.
        t_a = t_b = (a.mass * before_a[1] + b.mass * before_b[1]) / (a.mass + b.mass)
    return turned_back(np.array([n_a, t_a]), angle), turned_back(np.array([n_b, t_b]), angle)


def plain_atan(dy: float, dx: float) -> float:
    return math.atan(dy / dx)


def largest_difference(hit: Collision, form: tuple[Array, Array]) -> float:
    found = np.array([hit.velocity_a, hit.velocity_b])
    return float(np.abs(found - np.array(form)).max())


def energy(a: Disc, b: Disc, velocities: tuple[Array, Array]) -> float:
    return float(sum(0.5 * d.mass * v @ v for d, v in zip((a, b), velocities, strict=True)))


@given(discs, discs, materials, shares)
def test_the_reports_form_is_the_vector_form(
    a: Disc, b: Disc, material: Material, share: float
) -> None:
    assume(math.dist(a.velocity, b.velocity) > 1e-6)
    hit = collide(a, b, share * (a.radius + b.radius), material)
    assert largest_difference(hit, report(a, b, hit.normal, material)) < 1e-11


@pytest.mark.parametrize("degrees", [0, 30, 90, 120, 180, 210, 270, 300])
def test_every_quadrant(degrees: int) -> None:
    angle = math.radians(degrees)
    n, t = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    a = Disc(0.2, 0.03, (2 * n[0] + t[0], 2 * n[1] + t[1]))
    b, material = Disc(0.16, 0.03), Material(0.9, 0.1)
    hit = collide_at(a, b, angle, material)
    assert hit.after[0] == pytest.approx(
        collide_at(Disc(0.2, 0.03, (2, 1)), b, 0, material).after[0]
    )
    assert largest_difference(hit, report(a, b, hit.normal, material)) < 1e-14


def test_atan_divides_by_zero_where_the_centres_are_one_above_the_other() -> None:
    a, b = Disc(0.2, 0.03, (0.0, 1.0)), Disc(0.2, 0.03)
    hit = collide(a, b)
    assert hit.velocity_b == (0.0, 1.0)
    with pytest.raises(ZeroDivisionError):
        report(a, b, (0.0, 0.06), Material(), plain_atan)


@given(discs, discs, materials, shares)
def test_atan_turns_the_frame_and_only_signed_friction_notices(
    a: Disc, b: Disc, material: Material, share: float
) -> None:
    """At d_x < 0 both axes are reversed, but Eqs. 1 to 3 and mu |change| give the same."""
    assume(math.dist(a.velocity, b.velocity) > 1e-6)
    hit = collide(a, b, share * (a.radius + b.radius), material)
    assume(abs(hit.normal[0]) > 1e-6)
    assert largest_difference(hit, report(a, b, hit.normal, material, plain_atan)) < 1e-9


def test_signed_friction_in_the_turned_frame_drives_the_slip() -> None:
    a, b, material = Disc(0.2, 0.03, (-1.0, 0.5)), Disc(0.2, 0.03), Material(1.0, 0.2)
    line = (-0.06, 0.0)
    right = report(a, b, line, material, math.atan2, signed_change)
    wrong = report(a, b, line, material, plain_atan, signed_change)
    assert right[0] == pytest.approx([0.0, 0.3])
    assert wrong[0] == pytest.approx([0.0, 0.7])  # A speeds up along the tangent.
    before = energy(a, b, (np.array(a.velocity), np.array(b.velocity)))
    assert energy(a, b, right) < before < energy(a, b, wrong)


def test_the_published_law_pushes_b_with_the_slip() -> None:
    a, b = Disc(0.2, 0.03, (1.0, 0.5)), Disc(0.2, 0.03)
    hit = collide_at(a, b, 0.0, Material(1.0, 0.2, "published"))
    assert hit.velocity_a == pytest.approx((0.0, 0.3))
    assert hit.velocity_b == pytest.approx((1.0, -0.2))  # A slips upwards along B.
    assert hit.momentum[1][1] != pytest.approx(hit.momentum[0][1])
    mended = collide_at(a, b, 0.0, Material(1.0, 0.2))
    assert mended.velocity_b == pytest.approx((1.0, 0.2))
    assert mended.momentum[1] == pytest.approx(mended.momentum[0])


def test_the_published_law_warns_where_it_jumps() -> None:
    hit = collide(Disc(0.2, 0.03, (1.0, 0.0)), Disc(0.2, 0.03), 0.0, Material(1, 0.1, "published"))
    assert "in this hit the slip was only a rounding error" in hit.warnings[0]


# -- what holds of any collision -------------------------------------------------------------------


@given(discs, discs, materials, shares)
def test_momentum_is_kept_energy_is_not_gained(
    a: Disc, b: Disc, material: Material, share: float
) -> None:
    assume(math.dist(a.velocity, b.velocity) > 1e-6)
    hit = collide(a, b, share * (a.radius + b.radius), material)
    assert hit.momentum[1] == pytest.approx(hit.momentum[0], abs=1e-11)
    assert hit.energy[1] <= hit.energy[0] * (1 + 1e-12)
    on_a, on_b = hit.impulses
    assert (on_a.n, on_a.t) == pytest.approx((-on_b.n, -on_b.t), abs=1e-11)
    assert abs(on_b.t) <= material.friction * on_b.n + 1e-11
    (a_n, a_t), (b_n, b_t) = hit.before
    assert on_b.t * (a_t - b_t) >= -1e-12  # A drags B along, and B holds A back.
    (a_n2, _), (b_n2, _) = hit.after
    assert b_n2 - a_n2 == pytest.approx(material.restitution * (a_n - b_n), abs=1e-11)


@given(discs, discs, shares)
def test_the_offset_is_across_the_approach(a: Disc, b: Disc, share: float) -> None:
    assume(math.dist(a.velocity, b.velocity) > 1e-6)
    offset = share * (a.radius + b.radius)
    hit = collide(a, b, offset)
    assert hit.offset == pytest.approx(offset, abs=1e-15)
    speed = math.hypot(*hit.approach)
    u = (hit.approach[0] / speed, hit.approach[1] / speed)
    along = hit.normal[0] * u[0] + hit.normal[1] * u[1]
    assert along == pytest.approx(math.sqrt(1.0 - share**2))  # The normal never points backwards.
    assert collide_at(a, b, hit.angle).offset == pytest.approx(offset, abs=1e-14)


def test_half_the_reach_is_thirty_degrees_to_the_left() -> None:
    hit = collide(Disc(1.0, 0.2, (1.0, 0.0)), Disc(1.0, 0.1), offset=0.15)
    assert math.degrees(hit.angle) == pytest.approx(30.0)


def test_it_is_the_collision_that_the_solvers_have() -> None:
    scene = load("two-balls")
    run = simulate(scene, solver="event-driven")
    a, b = (
        Disc(ball.mass, ball.radius, (float(breakpoints[0, 3]), float(breakpoints[0, 4])))
        for ball, breakpoints in zip(scene.balls, run.knots, strict=True)
    )
    dx, dy = np.subtract(scene.balls[1].position, scene.balls[0].position)
    ux, uy = a.velocity[0] - b.velocity[0], a.velocity[1] - b.velocity[1]
    material = Material(0.95, 0.05, scene.physics.law)
    hit = collide(a, b, (ux * dy - uy * dx) / math.hypot(ux, uy), material)
    assert hit.velocity_a == pytest.approx(run.knots[0][1, 3:5], abs=1e-12)
    assert hit.velocity_b == pytest.approx(run.knots[1][1, 3:5], abs=1e-12)


# -- bad input -------------------------------------------------------------------------------------

# -- the command line ------------------------------------------------------------------------------

TYPED = shlex.split(
    "collide --mass-a 200g --mass-b 160g --radius 2.25in --velocity-a 2 0 --units in,g"
)


def test_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, drawing = tmp_path / "hit.json", tmp_path / "hit.png"
    more = ["--velocity-b", "-0.5", "0.2m/s", "--offset", "2in", "--friction", 0.05]
    assert exit_code(*TYPED, *more, "--json", data, "--picture", drawing) == 0
    printed = capsys.readouterr().out
    assert "Offset 2 of 4.5 in; line of centres from A to B at 21.8139° to x" in printed
    assert "Velocities are in m/s, momentum in N s" in printed
    assert "velocity of A before  " in printed
    assert drawing.stat().st_size > 20_000
    found = json.loads(data.read_text(encoding="utf-8"))
    a, b = Disc(0.2, 0.05715, (2.0, 0.0)), Disc(0.16, 0.05715, (-0.5, 0.2))
    expected = collide(a, b, 0.0508, Material(1.0, 0.05)).as_dict()
    assert {key: found[key] for key in expected} == expected


@pytest.mark.parametrize("offset", [0.0, -0.0127, 0.056])
@pytest.mark.parametrize("other", [(0.0, 0.0), (-3.0, 0.5)])
def test_labels_of_the_picture_lie_beside_its_arrows(
    offset: float, other: tuple[float, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr(collision, "save_figure", lambda figure, *_: drawn.append(figure))
    a, b = Disc(0.17, 0.028575, (2.0, 0.3)), Disc(0.25, 0.028575, other)
    collision.collision_picture(collide(a, b, offset), tmp_path / "hit.png", Units())
    (figure,) = drawn
    for axes in figure.axes:
        arrows = [patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)]
        labels = [text.get_window_extent() for text in axes.texts]
        assert len(labels) >= 5
        assert not any(label.count_overlaps(labels[:k]) for k, label in enumerate(labels))
        for arrow in arrows:
            path = arrow.get_transform().transform_path(arrow.get_path())
            corners = np.concatenate([*map(np.asarray, path.to_polygons(closed_only=False))])
            on_it = np.concatenate(np.linspace(corners[:-1], corners[1:], 50))
            assert ((on_it > axes.bbox.p0) & (on_it < axes.bbox.p1)).all()
            for label in (box.padded(-1.0) for box in labels):
                assert not ((on_it > label.min) & (on_it < label.max)).all(axis=1).any()


def test_a_head_on_hit_prints_zeros(capsys: pytest.CaptureFixture[str]) -> None:
    equal = shlex.split("collide --mass-a 1 --mass-b 1 --radius 0.1 --velocity-a 0.3 0.4")
    assert exit_code(*equal) == 0
    (row,) = (line for line in capsys.readouterr().out.splitlines() if "of A after" in line)
    assert row.split() == ["velocity", "of", "A", "after", "0", "0", "0", "0"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("--restitution 0.5", "lost"),
        ("--offset 0.04", "0.00% lost"),  # to rounding
        ("--offset 0.05 --friction 0.5 --law published", "141.99% gained"),
    ],
)
def test_the_energy_that_is_lost_or_gained(
    more: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    balls = "collide --mass-a 0.2 --mass-b 0.1 --radius 0.05 --velocity-a 1 0 --velocity-b 0 3 "
    assert exit_code(*shlex.split(balls + more)) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if "Kinetic" in line)
    assert line.endswith(f" {said}") and "-" not in line


def test_the_picture_tells_which_way_a_ball_goes() -> None:
    a, b = Disc(0.2, 0.03, (1.0, 0.0)), Disc(0.2, 0.03, (-2.0, 0.0))
    assert "$v_B$ = (-2, 0)" in collision._facts(collide(a, b), Units())


@pytest.mark.parametrize(("mass", "doubted"), [("170", True), ("170g", False)])
def test_a_ball_of_no_material_is_doubted(
    mass: str, doubted: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    sizes = ("--mass-a", "170g", "--mass-b", mass, "--radius", "28.575mm")
    assert exit_code("collide", *sizes, "--velocity-a", "2", "0") == 0
    said = "Warning: as a sphere, ball B has 1.74e+06 kg/m^3, more than any metal"
    assert (said in capsys.readouterr().out) == doubted
