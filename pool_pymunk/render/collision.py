"""This module draws two balls that meet at an offset as a textbook does."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyArrowPatch

from pool_pymunk.laws import find_law
from pool_pymunk.model import Point, Units
from pool_pymunk.model.arrays import Array
from pool_pymunk.render.canvas import Figure, Label, place_labels, save_figure
from pool_pymunk.report.collide import Collision

INK, FAINT, BEFORE, AFTER = "#22262a", "#7d858d", "#0072b2", "#d55e00"
FILLS = {"A": "#eef1f4", "B": "#f6e6cf"}
LONGEST = 1.3  # the longest velocity arrow; like all lengths here, in units of the radii's sum
AHEAD = 1.5  # the distance of A from the contact, relative to B, in the drawn approach
AT_REST = 0.02  # A shorter arrow is left out.
ARC = 1.12  # the radius of the impact angle's arc
WIDTH, MARGIN = 11.0, 1.25  # in; the width of the sheet, and the height of its titles and words
LETTER = 12.0  # points
MARKUP = str.maketrans("", "", r"$_'\{}")  # Labels have these for TeX; they are not drawn.
TITLES = (
    "before (dash-dotted: A's line, as B sees it)",
    "after (n: line of centres, t: tangent)",
)


def collision_picture(hit: Collision, path: Path, units: Units, *, dpi: float = 200.0) -> None:
    """Draw the balls as they approach and as they touch into a file (.png, .svg or .pdf)."""
    figure = Figure(layout="constrained")
    velocities = (hit.a.velocity, hit.b.velocity, hit.velocity_a, hit.velocity_b)
    scale = LONGEST / max(math.hypot(*v) for v in velocities)
    panels = [_Panel(axes, hit, scale, []) for axes in figure.subplots(1, 2)]
    _approach(panels[0], units)
    _contact(panels[1])
    width, height = 0.2 + np.max([panel.axes.dataLim.size for panel in panels], axis=0)
    for (axes, *_), title in zip(panels, TITLES, strict=True):
        x, y = (axes.dataLim.p0 + axes.dataLim.p1) / 2
        axes.set(xlim=(x - width / 2, x + width / 2), ylim=(y - height / 2, y + height / 2))
        axes.set_title(title, fontsize=LETTER, color=INK)
        axes.set_aspect("equal")
        axes.axis("off")
    figure.set_size_inches(WIDTH, MARGIN + WIDTH / 2 * height / width)
    figure.supxlabel(_facts(hit, units), fontsize=LETTER - 1, color=INK, linespacing=1.6)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for panel in panels:
        place_labels(panel.axes, panel.labels, fontsize=LETTER)
    save_figure(figure, path, dpi)


class _Panel(NamedTuple):
    """A panel has axes in the sum of both radii; ``scale`` is the length of an arrow for 1 m/s."""

    axes: Axes
    hit: Collision
    scale: float
    labels: list[Label]

    def ball(self, name: str, at: Array, **looks: Any) -> None:
        """Draw a ball as a disc, or with other looks."""
        radius = (self.hit.a if name == "A" else self.hit.b).radius / self.hit.contact_distance
        looks = {"fc": FILLS[name], "ec": INK, "lw": 1.6} | looks
        self.axes.add_patch(Circle((at[0], at[1]), radius, zorder=1, **looks))

    def line(self, a: Array, b: Array, style: str = "--") -> None:
        """Draw a construction line."""
        self.axes.plot(*zip(a, b, strict=True), style, color=FAINT, linewidth=1.0, zorder=2)

    def arrow(self, a: Array, b: Array, color: str, style: str, width: float) -> None:
        """Draw an arrow from ``a`` to ``b``."""
        looks: dict[str, Any] = {"arrowstyle": style, "mutation_scale": 8 + 4 * width}
        looks |= {"color": color, "lw": width, "shrinkA": 0.0, "shrinkB": 0.0, "zorder": 3}
        self.axes.add_patch(FancyArrowPatch((a[0], a[1]), (b[0], b[1]), **looks))
        self.axes.update_datalim([a, b])

    def text(self, at: Array, text: str, color: str = INK) -> None:
        """Have letters written beside a point, and leave room for them at its right."""
        self.labels.append((text, (at[0], at[1]), color))
        letters = len(text.translate(MARKUP))
        self.axes.update_datalim([at - 0.3, np.add(at, (0.2 + 0.09 * letters, 0.3))])

    def velocity(self, at: Array, v: Point, name: str, color: str) -> None:
        """Draw the arrow of ball ``name`` from its centre, with the names of both."""
        arrow = f"$v_{name}'$" if color == AFTER else f"$v_{name}$"
        tip = at + self.scale * np.array(v)
        self.text(at, name)
        if self.scale * math.hypot(*v) < AT_REST:
            self.text(at, f"{arrow} = 0", color)
        else:
            self.arrow(at, tip, color, "-|>", 2.4)
            self.text(tip, arrow, color)


def _approach(panel: _Panel, units: Units) -> None:
    """Draw A as it comes to B, with the line on which it comes and the offset across it."""
    hit, b = panel.hit, np.zeros(2)
    u = np.divide(hit.approach, math.hypot(*hit.approach))
    across, offset = np.array([-u[1], u[0]]), hit.offset / hit.contact_distance
    touching, foot = b - hit.normal, -offset * across  # of the perpendicular from B on A's line
    a = touching - AHEAD * u
    panel.ball("A", a)
    panel.ball("B", b)
    panel.ball("A", touching, fc="none", ls=":", lw=1.2)
    panel.line(a, foot + u, "-.")
    panel.line(b - 0.1 * u, b + u, "-.")
    if abs(offset) > 0.05:
        panel.arrow(foot + 0.9 * u, b + 0.9 * u, INK, "<->", 1.0)
    label = f"offset {units.from_si(hit.offset, 'length') + 0.0:.6g} {units.length}"
    panel.text(foot + u + offset / 2 * across, label)
    panel.velocity(a, hit.a.velocity, "A", BEFORE)
    panel.velocity(b, hit.b.velocity, "B", BEFORE)


def _contact(panel: _Panel) -> None:
    """Draw the balls as they touch: line of centres, tangent, impact angle, velocities after.

    The impact angle is between A's line, as B sees it, and the line of centres.
    """
    hit, origin, n = panel.hit, np.zeros(2), np.array(panel.hit.normal)
    a, b = (n * r / hit.contact_distance for r in (-hit.a.radius, hit.b.radius))
    panel.ball("A", a)
    panel.ball("B", b)
    after = hit.after[1]
    on_n = after.n > 0.0 and abs(after.t) < 0.2 * after.n  # B's arrow lies on the normal.
    beyond = hit.b.radius / hit.contact_distance + panel.scale * after.n + 0.35 if on_n else 0.0
    for axis, name, tip in ((n, "n", max(1.2, beyond)), (np.array([-n[1], n[0]]), "t", 1.2)):
        panel.line(-1.2 * axis, tip * axis)
        panel.arrow(tip * axis, (tip + 0.1) * axis, FAINT, "-|>", 1.0)
        panel.text((tip + 0.1) * axis, f"${name}$", FAINT)
    u = np.divide(hit.approach, math.hypot(*hit.approach))
    panel.line(origin, 1.3 * u, "-.")
    came, alpha = math.atan2(u[1], u[0]), math.atan2(u[0] * n[1] - u[1] * n[0], u @ n)
    turned = came + np.linspace(0.0, alpha, 60)
    panel.axes.plot(ARC * np.cos(turned), ARC * np.sin(turned), color=INK, linewidth=1.0)
    middle = came + alpha / 2.0
    panel.text(
        ARC * np.array([math.cos(middle), math.sin(middle)]),
        rf"$\alpha$ = {math.degrees(abs(alpha)):.1f}°",
    )
    panel.velocity(a, hit.velocity_a, "A", AFTER)
    panel.velocity(b, hit.velocity_b, "B", AFTER)


def _facts(hit: Collision, units: Units) -> str:
    """Return masses, coefficients and velocities in two lines."""
    m_a, m_b = (f"{units.from_si(ball.mass, 'mass'):.4g} {units.mass}" for ball in (hit.a, hit.b))
    (before, after), material = hit.energy, hit.material
    kind = "speed"
    velocities = {"v_A": hit.a.velocity, "v_B": hit.b.velocity}
    velocities |= {"v_A'": hit.velocity_a, "v_B'": hit.velocity_b}
    said = ", ".join(
        f"${name}$ = ({', '.join(f'{units.from_si(x, kind) + 0.0:.4g}' for x in v)})"
        for name, v in velocities.items()
    )
    return (
        f"A: {m_a}, B: {m_b}; restitution {material.restitution:g}, friction {material.friction:g}"
        f", law {find_law(material.law).name}; energy {before:.4g} J before, {after:.4g} J after\n"
        f"velocities along x and y ({units.speed}): {said}"
    )
