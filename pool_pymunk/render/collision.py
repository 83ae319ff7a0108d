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
WIDE, ASIDE = 15.0, 0.35  # degrees, rad; a smaller angle has its label beside the arc
WIDTH, MARGIN = 11.0, 1.25  # in; the width of the sheet, and the height of its titles and words
LETTER = 12.0  # points
CLEAR = 0.3  # A direction that is as close to an axis as this counts as along the axis.
LIGHT = {"boxstyle": "round,pad=0.12", "facecolor": "white", "alpha": 0.8, "linewidth": 0}


def collision_picture(hit: Collision, path: Path, units: Units, *, dpi: float = 200.0) -> None:
    """Draw the balls as they approach, with the offset, and as they touch, with n and t.

    Arrows are velocities before and after, to one scale. The suffix of ``path`` gives the format.
    """
    figure = Figure(layout="constrained")
    velocities = (hit.a.velocity, hit.b.velocity, hit.velocity_a, hit.velocity_b)
    scale = LONGEST / max(math.hypot(*v) for v in velocities)
    left, right = (_Panel(axes, hit, scale) for axes in figure.subplots(1, 2))
    _approach(left, hit, units)
    _contact(right, hit)
    left.axes.set_title("before (dash-dotted: A's line, as B sees it)", fontsize=LETTER, color=INK)
    right.axes.set_title("after (n: line of centres, t: tangent)", fontsize=LETTER, color=INK)
    boxes = [panel.axes.dataLim for panel in (left, right)]
    width, height = (0.2 + max(each) for each in zip(*(box.size for box in boxes), strict=True))
    for panel, box in zip((left, right), boxes, strict=True):
        x, y = (box.p0 + box.p1) / 2
        panel.axes.set(xlim=(x - width / 2, x + width / 2), ylim=(y - height / 2, y + height / 2))
        panel.axes.set_aspect("equal")
        panel.axes.axis("off")
    figure.set_size_inches(WIDTH, MARGIN + WIDTH / 2 * height / width)
    facts = "\n".join(_facts(hit, units))
    figure.supxlabel(facts, fontsize=LETTER - 1, color=INK, linespacing=1.6)
    save_figure(figure, path, dpi)


class _Panel(NamedTuple):
    """A panel is a pair of axes on which the sum of the radii is 1.

    ``scale`` is the length of an arrow for 1 m/s.
    """

    axes: Axes
    hit: Collision
    scale: float

    def ball(self, name: str, at: Point, **looks: Any) -> None:
        """Draw a ball as a disc, or with other looks."""
        radius = (self.hit.a if name == "A" else self.hit.b).radius / self.hit.contact_distance
        looks = {"facecolor": FILLS[name], "edgecolor": INK, "linewidth": 1.6} | looks
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

    def text(self, at: Point, away: Point, text: str, color: str = INK) -> None:
        """Write letters beside a point, on the side to which ``away`` leads."""
        x, y = (
            0 if abs(part) < CLEAR * math.hypot(*away) else round(part / abs(part)) for part in away
        )
        self.axes.annotate(
            text, at, (6 * x, 6 * y), textcoords="offset points", color=color, fontsize=LETTER,
            ha=("right", "center", "left")[x + 1], va=("top", "center", "bottom")[y + 1],
            bbox=LIGHT, zorder=5,
        )  # fmt: skip
        # This is half of its width and height, roughly.
        half = 0.1 + 0.045 * len(text.replace(r"$\theta$", "0")), 0.12
        middle = (at[0] + x * half[0], at[1] + y * half[1])
        self.axes.update_datalim([_along(middle, half, side) for side in (-1.0, 1.0)])

    def velocity(self, at: Point, v: Point, name: str, color: str) -> None:
        """Draw the arrow of ball ``name`` from its centre, with the names of both."""
        arrow = f"$v_{name}'$" if color == AFTER else f"$v_{name}$"
        if self.scale * math.hypot(*v) < AT_REST:
            self.text(at, (0.0, 1.0), name)
            self.text(at, (0.0, -1.0), f"{arrow} = 0", color)
            return
        tip = _along(at, v, self.scale)
        self.arrow(at, tip, color, "-|>", 2.4)
        self.text(at, _along((0.0, 0.0), v, -1.0), name)
        self.text(tip, v, arrow, color)


def _along(a: Point, v: Point, by: float) -> Point:
    return (a[0] + by * v[0], a[1] + by * v[1])


def _approach(panel: _Panel, hit: Collision, units: Units) -> None:
    """Draw A as it comes to B, with the line on which it comes and the offset across it."""
    speed = math.hypot(*hit.approach)
    u = (hit.approach[0] / speed, hit.approach[1] / speed)
    offset = hit.offset / hit.contact_distance
    b, touching = (0.0, 0.0), _along((0.0, 0.0), hit.normal, -1.0)
    a = _along(touching, u, -AHEAD)
    foot = _along(b, (-u[1], u[0]), -offset)  # of the perpendicular from B's centre on A's line
    panel.ball("A", a)
    panel.ball("B", b)
    panel.ball("A", touching, facecolor="none", linestyle=":", linewidth=1.2)
    panel.line(a, _along(foot, u, 1.0), "-.")
    panel.line(_along(b, u, -0.1), _along(b, u, 1.0), "-.")
    ends = _along(foot, u, 0.9), _along(b, u, 0.9)
    if abs(offset) > 0.05:
        panel.arrow(*ends, INK, "<->", 1.0)
    label = f"offset {units.from_si(hit.offset, 'length') + 0.0:.4g} {units.length}"
    panel.text(_along(_along(foot, u, 1.0), (-u[1], u[0]), offset / 2), u, label)
    panel.velocity(a, hit.a.velocity, "A", BEFORE)
    panel.velocity(b, hit.b.velocity, "B", BEFORE)


def _contact(panel: _Panel, hit: Collision) -> None:
    """Draw the balls as they touch: line of centres, tangent, impact angle, velocities after."""
    n, t, origin = hit.normal, (-hit.normal[1], hit.normal[0]), (0.0, 0.0)
    a, b = (_along(origin, n, r / hit.contact_distance) for r in (-hit.a.radius, hit.b.radius))
    panel.ball("A", a)
    panel.ball("B", b)
    after = hit.after[1]
    on_n = after.n > 0.0 and abs(after.t) < 0.2 * after.n  # B's arrow lies on the normal.
    beyond = hit.b.radius / hit.contact_distance + panel.scale * after.n + 0.35 if on_n else 0.0
    for axis, name, tip in ((n, "n", max(1.2, beyond)), (t, "t", 1.2)):
        panel.line(_along(origin, axis, -1.2), _along(origin, axis, tip))
        panel.arrow(_along(origin, axis, tip), _along(origin, axis, tip + 0.1), FAINT, "-|>", 1.0)
        panel.text(_along(origin, axis, tip + 0.1), axis, f"${name}$", FAINT)
    degrees = math.degrees(hit.angle)
    panel.line(origin, (1.3, 0.0), ":")
    is_wide = abs(degrees) > WIDE
    panel.text((1.3, 0.0), (1.0, 0.0) if is_wide else (0.0, -degrees or -1.0), "$x$", FAINT)
    low, high = sorted((0.0, degrees))
    panel.axes.add_patch(Arc(origin, 2 * ARC, 2 * ARC, theta1=low, theta2=high, color=INK))
    half = hit.angle / 2.0 if is_wide else -math.copysign(ASIDE, degrees)
    middle = (math.cos(half), math.sin(half))
    panel.text(_along(origin, middle, ARC), middle, rf"$\theta$ = {degrees:.1f}°")
    panel.velocity(a, hit.velocity_a, "A", AFTER)
    panel.velocity(b, hit.velocity_b, "B", AFTER)


def _facts(hit: Collision, units: Units) -> tuple[str, str]:
    """Return masses, coefficients and speeds in two lines."""
    m_a, m_b = (f"{units.from_si(ball.mass, 'mass'):.4g} {units.mass}" for ball in (hit.a, hit.b))
    (before, after), material = hit.energy, hit.material
    velocities = {"v_A": hit.a.velocity, "v_B": hit.b.velocity}
    velocities |= {"v_A'": hit.velocity_a, "v_B'": hit.velocity_b}
    speeds = ", ".join(
        f"${name}$ = {units.from_si(math.hypot(*v), 'speed'):.4g}" for name, v in velocities.items()
    )
    return (
        f"A: {m_a}, B: {m_b}; restitution {material.restitution:g}, friction {material.friction:g}"
        f", law {find_law(material.law).name}; energy {before:.4g} J before, {after:.4g} J after",
        f"speeds ({units.speed}): {speeds}",
    )
