"""Draw the pictures of the documentation that nothing else draws.

``python docs/figures/draw.py`` draws them into docs/figures/made, and so does each ``make docs``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pool_pymunk import (
    Ball,
    Disc,
    Friction,
    Material,
    Restitution,
    Run,
    Scene,
    Units,
    collide,
    fit,
    load,
    simulate,
    simulate_all,
)
from pool_pymunk.model.arrays import Array
from pool_pymunk.page import write_page
from pool_pymunk.render.collision import collision_picture
from pool_pymunk.render.residuals import residuals_picture
from pool_pymunk.render.style import PALETTE, Style

HERE = Path(__file__).parent
MADE = HERE / "made"
DPI = 100.0

Drawing = Callable[[Path], object]


def run(scenario: str, what: Any = "end", shot: int | None = None) -> Drawing:
    """Return what draws a shot of a scenario, by default the first."""

    def draw(out: Path) -> None:
        simulate(load(scenario), shot, solver="event-driven").plot(what, out, dpi=DPI)

    return draw


def collision(out: Path) -> None:
    """Draw what ``pool-pymunk collide ... --picture`` draws in the worksheet."""
    radius = 0.028575
    a, b = Disc(0.17, radius, (2.0, 0.0)), Disc(0.17, radius)
    hit = collide(a, b, offset=radius, material=Material(0.95, 0.06))
    collision_picture(hit, out, Units(), dpi=DPI)


def residuals(out: Path) -> None:
    """Draw how far the report's printed ends lie off before and after a fit from 0.95."""
    report = load("report")
    stated = replace(report, restitution=replace(report.restitution, cue_ball=0.95))
    residuals_picture(fit(stated, "published", "restitution.cue_ball"), out, dpi=DPI)


def pushing() -> Run:
    """Play a ball that rolls into a lighter one at rest, does not bounce, and pushes it on."""
    radius, turned = 0.0286, 0.3
    place = 2.0 * radius * math.cos(turned) + 1e-3, 2.0 * radius * math.sin(turned)
    balls = (
        Ball("A", (0.0, 0.0), radius, 0.17, velocity=(1.0, 0.0), roll=1.0),
        Ball("B", place, radius, 0.10),
    )
    friction = Friction(0.2, ball_ball=0.06, rolling=0.01)
    return simulate(Scene(balls, None, Restitution(0.0), friction), solver="event-driven")


def normal_force(run: Run) -> tuple[Array, Array]:
    """Return times (s) in the contact of :func:`pushing`, and its normal force N (N) then.

    B slips as long as the contact lasts, so its push is f = dv/dt + mu_s g u/|u|.
    """
    [contact], b = run.persistent, run.knots[1]
    b = b[(b[:, 0] >= contact.since) & (b[:, 0] < contact.until)]
    b = b[np.append(np.diff(b[:, 0]) > 0.0, True)]  # the last one of each instant
    slip = b[:, 3:5] - b[:, 7:9]
    slip /= np.hypot(*slip.T)[:, np.newaxis]
    push = b[:, 5:7] + run.scene.deceleration * slip
    apart = b[:, 1:3] - run.at(b[:, 0])[0][:, 0]
    normal = apart / np.hypot(*apart.T)[:, np.newaxis]
    return b[:, 0], run.scene.balls[1].mass * np.sum(push * normal, axis=1)


def contact_force(out: Path) -> None:
    """Draw the normal force of a persistent contact over the time since it began."""
    run, look = pushing(), Style()
    (t, force), [contact] = normal_force(run), run.persistent
    began, over = contact.since, contact.until
    t = np.concatenate([[began - 0.01, began], t, [over, over, over + 0.1]])
    force = np.concatenate([[0.0, 0.0], force, [force[-1], 0.0, 0.0]])
    figure = Figure((6.4, 3.0), layout="constrained", facecolor=look.page)
    axes = figure.subplots()
    axes.text(1.0, 0.24, "A hits B", va="top", color=look.ink)
    for event in run.events:
        if event.kind == "roll":
            ms, text = 1e3 * (event.t - began), f"{event.balls[0]} begins to roll "
            axes.axvline(ms, color=look.faint, linewidth=1.0, linestyle="--")
            axes.text(ms, 0.24, text, ha="right", va="top", color=look.ink)
    axes.plot(1e3 * (t - began), force, color=PALETTE[1], linewidth=2.0)
    axes.set(xlim=(-5.0, 125.0), ylim=(0.0, 0.24))
    axes.set(xlabel="time since the hit (ms)", ylabel="normal force N (N)")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(out, dpi=DPI)


def live_page(out: Path) -> None:
    """Make the page of the report's shots beside stock pymunk, which the documentation plays."""
    scene = load("report")
    runs = zip(
        simulate_all(scene, solver="event-driven"),
        simulate_all(scene, solver="pymunk-builtin"),
        strict=True,
    )
    write_page(list(runs), out)


PICTURES: dict[str, Drawing] = {
    "contact-force.png": contact_force,
    "collision.png": collision,
    "crokinole.png": run("crokinole", shot=3),
    "played/played.html": live_page,
    "residuals.png": residuals,
    "mine-end.png": run(str(HERE / "mine.toml")),
    "mine-energy.png": run(str(HERE / "mine.toml"), "energy"),
}


def draw_all(folder: Path = MADE) -> None:
    """Draw every picture, whole or not at all."""
    for name, drawing in PICTURES.items():
        path = folder / name
        part = path.with_name(f"part-{path.name}")
        part.parent.mkdir(parents=True, exist_ok=True)
        drawing(part)
        part.replace(path)


if __name__ == "__main__":
    draw_all()
