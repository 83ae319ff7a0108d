"""Two balls that meet at an offset, as a textbook draws them: the approach, and the contact."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, FancyArrowPatch

from pool_pymunk.files import whole

if TYPE_CHECKING:
    from pool_pymunk.collide import Collision
    from pool_pymunk.scene import Point, Units

INK, FAINT, BEFORE, AFTER = "#22262a", "#7d858d", "#0072b2", "#d55e00"
FILLS = {"A": "#eef1f4", "B": "#f6e6cf"}
LONGEST = 1.3  # of the velocities' arrows; like all lengths here in sums of the radii
AHEAD = 1.5  # how far A still has to go, as B sees it, where the approach is drawn
AT_REST = 0.02  # a shorter arrow is left out
LETTER = 12.0  # points


def collision_picture(hit: Collision, path: Path, units: Units, *, dpi: float = 200.0) -> None:
    """Draw the balls as they approach, with the offset, and as they touch, with n and t.

    Arrows are velocities before and after, to one scale. The suffix of ``path`` says the format.
    """
    figure = Figure(figsize=(11.0, 6.6), facecolor="white")
    FigureCanvasAgg(figure)
    velocities = (hit.a.velocity, hit.b.velocity, hit.velocity_a, hit.velocity_b)
    fastest = max(math.hypot(*v) for v in velocities)
    for k, (draw, title) in enumerate(((_approach, "before"), (_contact, "after"))):
        axes = figure.add_axes((0.01 + 0.5 * k, 0.13, 0.48, 0.80))
        axes.set_title(title, fontsize=LETTER + 2, color=INK)
        panel = _Panel(axes, LONGEST / fastest)
        draw(panel, hit, units)
        panel.frame()
    for line, text in enumerate(_facts(hit, units)):
        y = 0.085 - 0.045 * line
        figure.text(0.5, y, text, ha="center", fontsize=LETTER - 1, color=INK)
    with whole(path) as part:
        figure.savefig(part, dpi=dpi)


@dataclass(frozen=True)
class _Panel:
    """Axes on which the sum of the radii is 1; ``scale`` is the length of an arrow for 1 m/s."""

    axes: Axes
    scale: float
    seen: list[Point] = field(default_factory=list)

    def frame(self) -> None:
        """Show all that was drawn, and nothing of the axes."""
        xs, ys = zip(*self.seen, strict=True)
        half = max(max(xs) - min(xs), max(ys) - min(ys)) / 2 + 0.15
        x, y = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2
        self.axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
        self.axes.axis("off")

    def ball(self, at: Point, radius: float, name: str, **looks: Any) -> None:
        """A disc with its name, or (dashed, without a name) where one will be."""
        looks = {"facecolor": FILLS.get(name, "none"), "edgecolor": INK, "linewidth": 1.6} | looks
        self.axes.add_patch(Circle(at, radius, zorder=1, **looks))
        self.seen.extend([(at[0] - radius, at[1] - radius), (at[0] + radius, at[1] + radius)])

    def line(self, a: Point, b: Point, style: str = "--") -> None:
        """A construction line."""
        self.axes.plot((a[0], b[0]), (a[1], b[1]), style, color=FAINT, linewidth=1.0, zorder=2)
        self.seen.extend([a, b])

    def arrow(self, a: Point, b: Point, color: str, style: str, width: float) -> None:
        """An arrow from ``a`` to ``b``."""
        arrow = FancyArrowPatch(
            a, b, arrowstyle=style, color=color, linewidth=width, mutation_scale=8 + 4 * width,
            shrinkA=0.0, shrinkB=0.0, zorder=4,
        )  # fmt: skip
        self.axes.add_patch(arrow)
        self.seen.extend([a, b])

    def text(self, at: Point, text: str, color: str = INK) -> None:
        """Letters centred on a point, on a light ground where they lie on lines."""
        box = {"boxstyle": "round,pad=0.12", "facecolor": "white", "alpha": 0.8, "linewidth": 0}
        self.axes.text(
            *at, text, color=color, ha="center", va="center", fontsize=LETTER, bbox=box, zorder=5
        )
        self.seen.extend([(at[0] - 0.15, at[1] - 0.1), (at[0] + 0.15, at[1] + 0.1)])

    def velocity(self, at: Point, v: Point, name: str, color: str) -> None:
        """An arrow from a ball's centre with its name past the tip; none for a ball at rest."""
        length = self.scale * math.hypot(*v)
        if length < AT_REST:
            self.text(_along(at, (0.0, -1.0), 0.2), f"{name} = 0", color)
            return
        tip = _along(at, v, self.scale)
        self.arrow(at, tip, color, "-|>", 2.4)
        self.text(_along(tip, v, 0.17 * self.scale / length), name, color)


def _along(a: Point, v: Point, by: float) -> Point:
    return (a[0] + by * v[0], a[1] + by * v[1])


def _left(v: Point) -> Point:
    return (-v[1], v[0])


def _approach(panel: _Panel, hit: Collision, units: Units) -> None:
    """A on its way to B: the line on which it comes, seen from B, and the offset across it."""
    speed = math.hypot(*hit.approach)
    u = (hit.approach[0] / speed, hit.approach[1] / speed)
    offset = hit.offset / hit.reach
    b, touching = (0.0, 0.0), _along((0.0, 0.0), hit.normal, -1.0)
    a = _along(touching, u, -AHEAD)
    foot = _along(b, _left(u), -offset)  # of B's centre on A's way
    panel.ball(a, hit.a.radius / hit.reach, "A")
    panel.ball(b, hit.b.radius / hit.reach, "B")
    panel.ball(touching, hit.a.radius / hit.reach, "", linestyle=":", linewidth=1.2)
    panel.line(a, _along(foot, u, 1.0), "-.")
    panel.line(_along(b, u, -0.1), _along(b, u, 1.0), "-.")
    label = f"e = {units.from_si(hit.offset, 'length'):.4g} {units.length}"
    ends = _along(foot, u, 0.8), _along(b, u, 0.8)
    if abs(offset) > 0.05:
        panel.arrow(*ends, INK, "<->", 1.0)
    panel.text(_along(ends[0], u, 0.45), label)
    panel.velocity(a, hit.a.velocity, r"$v_A$", BEFORE)
    panel.velocity(b, hit.b.velocity, r"$v_B$", BEFORE)
    for name, at in (("A", a), ("B", b)):
        panel.text(_along(at, _left(u), 0.28), name)


def _contact(panel: _Panel, hit: Collision, _units: Units) -> None:
    """The balls as they touch: line of centres, tangent, impact angle, velocities after."""
    n, t, origin = hit.normal, _left(hit.normal), (0.0, 0.0)
    a, b = (_along(origin, n, r / hit.reach) for r in (-hit.a.radius, hit.b.radius))
    panel.ball(a, hit.a.radius / hit.reach, "A")
    panel.ball(b, hit.b.radius / hit.reach, "B")
    for axis, name in ((n, "n"), (t, "t")):
        panel.line(_along(origin, axis, -1.2), _along(origin, axis, 1.2))
        panel.arrow(_along(origin, axis, 1.2), _along(origin, axis, 1.3), FAINT, "-|>", 1.0)
        panel.text(_along(origin, axis, 1.42), f"${name}$", FAINT)
    _angle(panel, math.degrees(hit.angle))
    panel.velocity(a, hit.velocity_a, r"$v_A'$", AFTER)
    panel.velocity(b, hit.velocity_b, r"$v_B'$", AFTER)


def _angle(panel: _Panel, degrees: float) -> None:
    """The impact angle, from x to n."""
    panel.line((0.0, 0.0), (0.85, 0.0), ":")
    panel.text((0.95, 0.0), "$x$", FAINT)
    low, high = sorted((0.0, degrees))
    panel.axes.add_patch(Arc((0, 0), 1.2, 1.2, theta1=low, theta2=high, color=INK, zorder=3))
    middle = math.radians(degrees / 2)
    at = (0.78 * math.cos(middle), 0.78 * math.sin(middle))
    panel.text(at, rf"$\theta$ = {degrees:.1f}°")


def _facts(hit: Collision, units: Units) -> tuple[str, str]:
    """Masses, coefficients and speeds in two lines."""
    masses = (f"{units.from_si(ball.mass, 'mass'):.4g} {units.mass}" for ball in (hit.a, hit.b))
    before, after = hit.energy
    speeds = ", ".join(
        f"{name} = {units.from_si(math.hypot(*v), 'speed'):.4g}"
        for name, v in (
            (r"$v_A$", hit.a.velocity), (r"$v_B$", hit.b.velocity),
            (r"$v_A'$", hit.velocity_a), (r"$v_B'$", hit.velocity_b),
        )
    )  # fmt: skip
    m_a, m_b = masses
    material = hit.material
    return (
        f"A: {m_a}, B: {m_b}; restitution {material.restitution:g}, friction {material.friction:g}"
        f", law {material.law}; energy {before:.4g} J before, {after:.4g} J after",
        f"speeds ({units.speed}): {speeds}",
    )
