"""This module draws two balls that meet at an offset as a textbook does.

One panel has the approach, the other the contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, FancyArrowPatch

from pool_pymunk.physics.laws import find_law
from pool_pymunk.safety.files import whole

if TYPE_CHECKING:
    from pool_pymunk.model import Point, Units
    from pool_pymunk.report.collide import Collision

INK, FAINT, BEFORE, AFTER = "#22262a", "#7d858d", "#0072b2", "#d55e00"
FILLS = {"A": "#eef1f4", "B": "#f6e6cf"}
LONGEST = 1.3  # the longest arrow of a velocity; like all lengths here in sums of the radii
AHEAD = 1.5  # how far A still has to go, as B sees it, where the approach is drawn
AT_REST = 0.02  # A shorter arrow is left out.
ARC = 1.12  # the radius of the impact angle's arc
WIDTH, HEAD, FOOT = 11.0, 0.4, 0.85  # These are sizes of the sheet and its margins, in inches.
LETTER = 12.0  # points
APPROACH = "before (dash-dotted: A's way, as B sees it)"
CONTACT = "after (n: line of centres, t: tangent)"


def collision_picture(hit: Collision, path: Path, units: Units, *, dpi: float = 200.0) -> None:
    """Draw the balls as they approach, with the offset, and as they touch, with n and t.

    Arrows are velocities before and after, to one scale. The suffix of ``path`` gives the format.
    """
    figure = Figure(facecolor="white")
    FigureCanvasAgg(figure)
    velocities = (hit.a.velocity, hit.b.velocity, hit.velocity_a, hit.velocity_b)
    scale = LONGEST / max(math.hypot(*v) for v in velocities)
    left, right = (_Panel(figure.add_axes((0.0, 0.0, 1.0, 1.0)), scale) for _ in range(2))
    _approach(left, hit, units)
    _contact(right, hit)
    _arrange(figure, left, right)
    for line, text in enumerate(_facts(hit, units)):
        y = (0.55 - 0.3 * line) / figure.get_figheight()
        figure.text(0.5, y, text, ha="center", fontsize=LETTER - 1, color=INK)
    with whole(path) as part:
        figure.savefig(part, dpi=dpi)


def _arrange(figure: Figure, left: _Panel, right: _Panel) -> None:
    """Put two panels of one scale side by side, and make the sheet as high as they need."""
    sizes = [panel.size for panel in (left, right)]
    width, height = (max(side) + 0.2 for side in zip(*sizes, strict=True))
    inches = WIDTH / 2 * height / width
    total = inches + FOOT + HEAD
    figure.set_size_inches(WIDTH, total)
    for k, (panel, title) in enumerate(((left, APPROACH), (right, CONTACT))):
        panel.axes.set_position((0.5 * k, FOOT / total, 0.5, inches / total))
        panel.axes.set_title(title, fontsize=LETTER, color=INK)
        panel.frame(width, height)


@dataclass(frozen=True)
class _Panel:
    """A panel is a pair of axes on which the sum of the radii is 1.

    ``scale`` is the length of an arrow for 1 m/s.
    """

    axes: Axes
    scale: float
    seen: list[Point] = field(default_factory=list)

    @property
    def box(self) -> tuple[Point, Point]:
        """Return two corners of what was drawn."""
        xs, ys = zip(*self.seen, strict=True)
        return (min(xs), min(ys)), (max(xs), max(ys))

    @property
    def size(self) -> Point:
        """Return width and height of what was drawn."""
        (x0, y0), (x1, y1) = self.box
        return (x1 - x0, y1 - y0)

    def frame(self, width: float, height: float) -> None:
        """Show a rectangle of this size around what was drawn, and nothing of the axes."""
        (x0, y0), (x1, y1) = self.box
        x, y = (x0 + x1) / 2, (y0 + y1) / 2
        self.axes.set(
            xlim=(x - width / 2, x + width / 2), ylim=(y - height / 2, y + height / 2),
            aspect="equal",
        )  # fmt: skip
        self.axes.axis("off")

    def ball(self, at: Point, radius: float, name: str, **looks: Any) -> None:
        """Draw a disc with its name, or a dashed one without a name where a ball will be."""
        looks = {"facecolor": FILLS.get(name, "none"), "edgecolor": INK, "linewidth": 1.6} | looks
        self.axes.add_patch(Circle(at, radius, zorder=1, **looks))
        self.seen.extend([(at[0] - radius, at[1] - radius), (at[0] + radius, at[1] + radius)])

    def line(self, a: Point, b: Point, style: str = "--") -> None:
        """Draw a construction line."""
        self.axes.plot((a[0], b[0]), (a[1], b[1]), style, color=FAINT, linewidth=1.0, zorder=2)
        self.seen.extend([a, b])

    def arrow(self, a: Point, b: Point, color: str, style: str, width: float) -> None:
        """Draw an arrow from ``a`` to ``b``."""
        arrow = FancyArrowPatch(
            a, b, arrowstyle=style, color=color, linewidth=width, mutation_scale=8 + 4 * width,
            shrinkA=0.0, shrinkB=0.0, zorder=4,
        )  # fmt: skip
        self.axes.add_patch(arrow)
        self.seen.extend([a, b])

    def text(self, at: Point, text: str, color: str = INK) -> None:
        """Write letters centred on a point, on a light ground if they lie on lines."""
        box = {"boxstyle": "round,pad=0.12", "facecolor": "white", "alpha": 0.8, "linewidth": 0}
        self.axes.text(
            *at, text, color=color, ha="center", va="center", fontsize=LETTER, bbox=box, zorder=5
        )
        # This is half of its width, roughly.
        half = 0.1 + 0.04 * len(text.replace(r"$\theta$", "0"))
        self.seen.extend([(at[0] - half, at[1] - 0.1), (at[0] + half, at[1] + 0.1)])

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
    for axis, name, tip in ((n, "n", _free(panel, hit)), (t, "t", 1.2)):
        panel.line(_along(origin, axis, -1.2), _along(origin, axis, tip))
        panel.arrow(_along(origin, axis, tip), _along(origin, axis, tip + 0.1), FAINT, "-|>", 1.0)
        panel.text(_along(origin, axis, tip + 0.22), f"${name}$", FAINT)
    _angle(panel, math.degrees(hit.angle))
    panel.velocity(a, hit.velocity_a, "A", AFTER)
    panel.velocity(b, hit.velocity_b, "B", AFTER)


def _free(panel: _Panel, hit: Collision) -> float:
    """Return how far the normal is drawn: past B, and past B's arrow if that lies on it."""
    after = hit.after[1]
    on_it = after.n > 0.0 and abs(after.t) < 0.2 * after.n
    return max(1.2, hit.b.radius / hit.reach + panel.scale * after.n + 0.35 if on_it else 0.0)


def _angle(panel: _Panel, degrees: float) -> None:
    """Draw the impact angle, from x to n."""
    panel.line((0.0, 0.0), (1.3, 0.0), ":")
    panel.text((1.4, 0.0) if abs(degrees) > 12.0 else (1.3, -0.12), "$x$", FAINT)
    low, high = sorted((0.0, degrees))
    arc = Arc((0, 0), 2 * ARC, 2 * ARC, theta1=low, theta2=high, color=INK, zorder=3)
    panel.axes.add_patch(arc)
    panel.seen.append((0.0, math.copysign(ARC, degrees) if abs(degrees) > 90.0 else 0.0))
    at = math.radians(_free_of_tangent(degrees))
    place = ((ARC + 0.35) * math.cos(at), (ARC + 0.2) * math.sin(at))
    if abs(degrees) < 12.0:
        place = (ARC, math.copysign(0.3, -degrees))
    panel.text(place, rf"$\theta$ = {degrees:.1f}°")


def _free_of_tangent(degrees: float) -> float:
    """Return where on the arc its label lies: in the middle, or well away from the tangent."""
    if abs(degrees) < 60.0:
        return degrees / 2
    apart = {
        share * degrees: abs(math.remainder(share * degrees - degrees - 90.0, 180.0))
        for share in (0.3, 0.5, 0.7)
    }
    return max(apart, key=lambda at: apart[at])


def _facts(hit: Collision, units: Units) -> tuple[str, str]:
    """Return masses, coefficients and speeds in two lines."""
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
        f", law {find_law(material.law).name}; energy {before:.4g} J before, {after:.4g} J after",
        f"speeds ({units.speed}): {speeds}",
    )
