"""This module draws two balls that meet at an offset as a textbook does.

One panel has the approach, the other the contact.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle

from pool_pymunk.physics.laws import find_law
from pool_pymunk.render.pictures import save_figure

if TYPE_CHECKING:
    from pool_pymunk.model import Point, Units
    from pool_pymunk.report.collide import Collision

INK, FAINT, BEFORE, AFTER = "#22262a", "#7d858d", "#0072b2", "#d55e00"
FILLS = {"A": "#eef1f4", "B": "#f6e6cf"}
LONGEST = 1.3  # the longest arrow of a velocity; like all lengths here in sums of the radii
AHEAD = 1.5  # how far A still has to go, as B sees it, where the approach is drawn
AT_REST = 0.02  # A shorter arrow is left out.
ARC = 1.12  # the radius of the impact angle's arc
WIDTH, MARGIN = 11.0, 1.25  # in; the width of the sheet, and the height of its titles and words
LETTER = 12.0  # points
LIGHT = {"boxstyle": "round,pad=0.12", "facecolor": "white", "alpha": 0.8, "linewidth": 0}


def collision_picture(hit: Collision, path: Path, units: Units, *, dpi: float = 200.0) -> None:
    """Draw the balls as they approach, with the offset, and as they touch, with n and t.

    Arrows are velocities before and after, to one scale. The suffix of ``path`` gives the format.
    """
    figure = Figure(layout="constrained")
    velocities = (hit.a.velocity, hit.b.velocity, hit.velocity_a, hit.velocity_b)
    scale = LONGEST / max(math.hypot(*v) for v in velocities)
    left, right = (_Panel(axes, scale) for axes in figure.subplots(1, 2))
    _approach(left, hit, units)
    _contact(right, hit)
    left.axes.set_title("before (dash-dotted: A's way, as B sees it)", fontsize=LETTER, color=INK)
    right.axes.set_title("after (n: line of centres, t: tangent)", fontsize=LETTER, color=INK)
    width, height = (max(side) for side in zip(left.size, right.size, strict=True))
    for panel in (left, right):
        panel.frame(width, height)
    figure.set_size_inches(WIDTH, MARGIN + WIDTH / 2 * height / width)
    facts = "\n".join(_facts(hit, units))
    figure.supxlabel(facts, fontsize=LETTER - 1, color=INK, linespacing=1.6)
    save_figure(figure, path, dpi)


class _Panel(NamedTuple):
    """A panel is a pair of axes on which the sum of the radii is 1.

    ``scale`` is the length of an arrow for 1 m/s.
    """

    axes: Axes
    scale: float

    @property
    def size(self) -> Point:
        """Return width and height of what was drawn."""
        return self.axes.dataLim.width + 0.2, self.axes.dataLim.height + 0.2

    def frame(self, width: float, height: float) -> None:
        """Show a rectangle of this size around what was drawn, and nothing of the axes."""
        box = self.axes.dataLim
        x, y = (box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2
        self.axes.set(xlim=(x - width / 2, x + width / 2), ylim=(y - height / 2, y + height / 2))
        self.axes.set_aspect("equal")
        self.axes.axis("off")

    def ball(self, at: Point, radius: float, name: str, **looks: Any) -> None:
        """Draw a disc with its name, or a dashed one without a name where a ball will be."""
        looks = {"facecolor": FILLS.get(name, "none"), "edgecolor": INK, "linewidth": 1.6} | looks
        self.axes.add_patch(Circle(at, radius, zorder=1, **looks))

    def line(self, a: Point, b: Point, style: str = "--") -> None:
        """Draw a construction line."""
        self.axes.plot((a[0], b[0]), (a[1], b[1]), style, color=FAINT, linewidth=1.0, zorder=2)

    def arrow(self, a: Point, b: Point, color: str, style: str, width: float) -> None:
        """Draw an arrow from ``a`` to ``b``."""
        look: dict[str, Any] = {"arrowstyle": style, "color": color, "linewidth": width}
        look |= {"mutation_scale": 8 + 4 * width, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", b, a, arrowprops=look, zorder=4)
        self.axes.update_datalim([a, b])

    def text(self, at: Point, text: str, color: str = INK) -> None:
        """Write letters centred on a point, on a light ground if they lie on lines."""
        self.axes.text(
            *at, text, color=color, ha="center", va="center", fontsize=LETTER, bbox=LIGHT, zorder=5
        )
        # This is half of its width, roughly.
        half = 0.1 + 0.04 * len(text.replace(r"$\theta$", "0"))
        self.axes.update_datalim([(at[0] - half, at[1] - 0.1), (at[0] + half, at[1] + 0.1)])

    def velocity(self, at: Point, v: Point, name: str, color: str) -> None:
        """Draw the arrow of ball ``name`` from its centre, with the names of both."""
        length = self.scale * math.hypot(*v)
        arrow = f"$v_{name}'$" if color == AFTER else f"$v_{name}$"
        if length < AT_REST:
            self.text(at, name)
            self.text(_along(at, (0.0, -1.0), 0.25), f"{arrow} = 0", color)
            return
        tip = _along(at, v, self.scale)
        self.arrow(at, tip, color, "-|>", 2.4)
        self.text(_along(at, v, -0.24 * self.scale / length), name)
        self.text(_along(tip, v, 0.17 * self.scale / length), arrow, color)


def _along(a: Point, v: Point, by: float) -> Point:
    return (a[0] + by * v[0], a[1] + by * v[1])


def _left(v: Point) -> Point:
    return (-v[1], v[0])


def _approach(panel: _Panel, hit: Collision, units: Units) -> None:
    """Draw A on its way to B, with the line on which it comes and the offset across it."""
    speed = math.hypot(*hit.approach)
    u = (hit.approach[0] / speed, hit.approach[1] / speed)
    offset = hit.offset / hit.reach
    b, touching = (0.0, 0.0), _along((0.0, 0.0), hit.normal, -1.0)
    a = _along(touching, u, -AHEAD)
    foot = _along(b, _left(u), -offset)  # the foot of the perpendicular from B's centre on A's way
    panel.ball(a, hit.a.radius / hit.reach, "A")
    panel.ball(b, hit.b.radius / hit.reach, "B")
    panel.ball(touching, hit.a.radius / hit.reach, "", linestyle=":", linewidth=1.2)
    panel.line(a, _along(foot, u, 1.0), "-.")
    panel.line(_along(b, u, -0.1), _along(b, u, 1.0), "-.")
    label = f"offset {units.from_si(hit.offset, 'length') + 0.0:.4g} {units.length}"
    ends = _along(foot, u, 0.8), _along(b, u, 0.8)
    if abs(offset) > 0.05:
        panel.arrow(*ends, INK, "<->", 1.0)
    middle = ((ends[0][0] + ends[1][0]) / 2, (ends[0][1] + ends[1][1]) / 2)
    panel.text(_along(middle, u, 0.2 + 0.25 * abs(u[0])), label)
    panel.velocity(a, hit.a.velocity, "A", BEFORE)
    panel.velocity(b, hit.b.velocity, "B", BEFORE)


def _contact(panel: _Panel, hit: Collision) -> None:
    """Draw the balls as they touch: line of centres, tangent, impact angle, velocities after."""
    n, t, origin = hit.normal, _left(hit.normal), (0.0, 0.0)
    a, b = (_along(origin, n, r / hit.reach) for r in (-hit.a.radius, hit.b.radius))
    panel.ball(a, hit.a.radius / hit.reach, "A")
    panel.ball(b, hit.b.radius / hit.reach, "B")
    after = hit.after[1]
    on_n = after.n > 0.0 and abs(after.t) < 0.2 * after.n  # B's arrow lies on the normal.
    beyond = hit.b.radius / hit.reach + panel.scale * after.n + 0.35 if on_n else 0.0
    for axis, name, tip in ((n, "n", max(1.2, beyond)), (t, "t", 1.2)):
        panel.line(_along(origin, axis, -1.2), _along(origin, axis, tip))
        panel.arrow(_along(origin, axis, tip), _along(origin, axis, tip + 0.1), FAINT, "-|>", 1.0)
        panel.text(_along(origin, axis, tip + 0.22), f"${name}$", FAINT)
    _angle(panel, math.degrees(hit.angle))
    panel.velocity(a, hit.velocity_a, "A", AFTER)
    panel.velocity(b, hit.velocity_b, "B", AFTER)


def _angle(panel: _Panel, degrees: float) -> None:
    """Draw the impact angle, from x to n; its label lies well away from the tangent."""
    panel.line((0.0, 0.0), (1.3, 0.0), ":")
    panel.text((1.4, 0.0) if abs(degrees) > 12.0 else (1.3, -0.12), "$x$", FAINT)
    low, high = sorted((0.0, degrees))
    panel.axes.add_patch(Arc((0, 0), 2 * ARC, 2 * ARC, theta1=low, theta2=high, color=INK))
    shares = (0.3, 0.5, 0.7) if abs(degrees) >= 60.0 else (0.5,)
    at = max(
        (share * degrees for share in shares),
        key=lambda place: abs(math.remainder(place - degrees - 90.0, 180.0)),
    )
    x, y = math.cos(math.radians(at)), math.sin(math.radians(at))
    place = ((ARC + 0.35) * x, (ARC + 0.2) * y)
    if abs(degrees) < 12.0:
        place = (ARC, math.copysign(0.3, -degrees))
    panel.text(place, rf"$\theta$ = {degrees:.1f}°")


def _facts(hit: Collision, units: Units) -> tuple[str, str]:
    """Return masses, coefficients and speeds in two lines."""
    m_a, m_b = (f"{units.from_si(ball.mass, 'mass'):.4g} {units.mass}" for ball in (hit.a, hit.b))
    before, after = hit.energy
    velocities = {"v_A": hit.a.velocity, "v_B": hit.b.velocity}
    velocities |= {"v_A'": hit.velocity_a, "v_B'": hit.velocity_b}
    speeds = ", ".join(
        f"${name}$ = {units.from_si(math.hypot(*v), 'speed'):.4g}" for name, v in velocities.items()
    )
    material = hit.material
    return (
        f"A: {m_a}, B: {m_b}; restitution {material.restitution:g}, friction {material.friction:g}"
        f", law {find_law(material.law).name}; energy {before:.4g} J before, {after:.4g} J after",
        f"speeds ({units.speed}): {speeds}",
    )
