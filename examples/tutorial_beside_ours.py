"""The pygame tutorial beside ours
===============================

This rebuilds the table of the well-known pygame and pymunk pool tutorial, and puts ours beside it.

The tutorial has balls of 5 kg and an elasticity of 0.8, static polygons of the same elasticity as
cushions, and as friction a joint to the static body with ``max_bias = 0`` and ``max_force = 1000``.
It steps by 1/FPS, with 120 frames a second. Ours is :class:`pool_pymunk.Billiards` on the same
shapes, in the same pixels, and its numbers mean the same: elasticities multiply, so the restitution
is 0.8 * 0.8, and a force of 1000 on 5 kg is a deceleration of 200 px/s^2. There are no pockets, so
that every ball has an end to compare with that of the exact solver, which has no steps.

What differs is how time passes. The tutorial's error is of first order in the step; at 10,000
frames a second it is still a pixel off the exact ends:

- It finds a contact at the end of a step. By then the balls have sunk into each other, and they
  part along the normal of the overlap.
- It finds no contact at all with what is thinner than the distance of one step.
- It moves a ball by the velocity from before the friction of the same step, so a ball that slides
  out freely goes v dt / 2 too far. The friction joint pulls in the step of a contact, too.

What does not differ here: energy is never gained, and the order in which the balls are listed moves
the ends by 0.02 px at most. In a rack whose balls touch, contacts of one instant have no unique
answer: pymunk's differs from ours, and the ends do not converge.

Run it with ``python examples/tutorial_beside_ours.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pymunk
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import pool_pymunk as pool

Array = NDArray[np.float64]
Velocity = tuple[float, float]
Play = Callable[[Array, Velocity, int, float], Array]

RADIUS, MASS, FORCE, ELASTICITY = 18.0, 5.0, 1000.0, 0.8  # px, kg, kg px/s^2
DECELERATION, RESTITUTION = FORCE / MASS, ELASTICITY * ELASTICITY
LENGTH, WIDTH, RAIL = 1046.0, 524.0, 21.0  # px
HARDEST = 2000.0  # px/s; the tutorial's cue gives an impulse of 10,000 at most
BREAK = (-HARDEST, 30.0)
SECONDS = 3.0  # By then all balls rest.
DIRECTIONS = 36  # of hard shots, all around
OFFSETS = (0.0, 0.25, 0.5, 0.75, 0.9)  # of hard hits, as shares of two radii
COLORS = {30: "#d55e00", 60: "#e69f00", 120: "#56b4e9", 240: "#0072b2"}  # by the frame rate
INK, DISC = "#22262a", 16.0  # the colour of the exact ends, and a ball's size (points)


def rack() -> Array:
    """Return the tutorial's start (16, 2): the cue ball, and fifteen balls a pixel apart."""
    x, y = 320.0, WIDTH / 2
    spots = [(x - 37.0 * k, y + 37.0 * (j - k / 2)) for k in range(5) for j in range(k + 1)]
    return np.array([(811.0, y), *spots])


def bodies_at(start: Array, velocity: Velocity) -> list[pymunk.Body]:
    """Return the bodies of the balls, the first of which moves."""
    moment = pymunk.moment_for_circle(MASS, 0.0, RADIUS)
    bodies = [pymunk.Body(MASS, moment) for _ in start]
    for body, (x, y) in zip(bodies, start, strict=True):
        body.position = float(x), float(y)
    bodies[0].velocity = velocity
    return bodies


def cushions(space: pymunk.Space) -> list[pymunk.Poly]:
    """Return four static boxes around the table."""
    boxes = [(-RAIL, -RAIL, LENGTH + RAIL, 0.0), (-RAIL, WIDTH, LENGTH + RAIL, WIDTH + RAIL),
             (-RAIL, 0.0, 0.0, WIDTH), (LENGTH, 0.0, LENGTH + RAIL, WIDTH)]  # fmt: skip
    return [pymunk.Poly.create_box_bb(space.static_body, pymunk.BB(*box)) for box in boxes]


def tutorial(start: Array, velocity: Velocity, rate: int, seconds: float = SECONDS) -> Array:
    """Play a shot as the tutorial does, and return its film."""
    space, bodies = pymunk.Space(), bodies_at(start, velocity)
    for body in bodies:
        circle = pymunk.Circle(body, RADIUS)
        circle.elasticity = ELASTICITY
        brake = pymunk.PivotJoint(space.static_body, body, (0.0, 0.0), (0.0, 0.0))
        brake.max_bias, brake.max_force = 0.0, FORCE
        space.add(body, circle, brake)
    for cushion in cushions(space):
        cushion.elasticity = ELASTICITY
        space.add(cushion)
    return film(space, bodies, rate, seconds)


def ours(start: Array, velocity: Velocity, rate: int, seconds: float = SECONDS) -> Array:
    """Play a shot by Billiards in a space with the same shapes, and return its film."""
    space, bodies = pymunk.Space(), bodies_at(start, velocity)
    pair = pool.same_balls(RESTITUTION, friction=0.0)
    table = pool.Billiards(space, max_dt=1 / rate, pair=pair, deceleration=DECELERATION)
    for cushion in cushions(space):
        table.add_wall(cushion, RESTITUTION)
    for body in bodies:
        table.add_ball(pymunk.Circle(body, RADIUS))
    return film(space, bodies, rate, seconds)


def film(space: pymunk.Space, bodies: list[pymunk.Body], rate: int, seconds: float) -> Array:
    """Step the space, and return where the balls are at each frame (frames, balls, 2)."""
    frames = [[body.position for body in bodies]]
    for _ in range(round(seconds * rate)):
        space.step(1 / rate)
        frames.append([body.position for body in bodies])
    return np.array(frames)


def exact_ends(start: Array, velocity: Velocity) -> Array:
    """Return the ends (balls, 2) by the exact solver, for which a pixel is a metre."""
    scene = pool.Scene(
        tuple(pool.Ball(str(k), tuple(place), RADIUS, MASS) for k, place in enumerate(start)),
        table=pool.Table.rectangle(LENGTH, WIDTH),
        restitution=pool.Restitution(ball_ball=RESTITUTION, cushion=RESTITUTION),
        friction=pool.Friction(surface=1.0),
        physics=pool.Physics(gravity=DECELERATION),
        shots=(pool.Shot("break", "0", velocity=velocity),),
    )
    return np.array(list(pool.simulate(scene, solver="event-driven").final.values()))


def farthest(ends: Array, others: Array) -> float:
    """Return the largest distance (px) between both ends of a ball."""
    return float(np.linalg.norm(ends - others, axis=-1).max())


def deepest(frames: Array) -> float:
    """Return how deep (px) two balls were in each other at most."""
    i, j = np.triu_indices(frames.shape[1], k=1)
    distance = np.linalg.norm(frames[:, i] - frames[:, j], axis=-1)
    return max(0.0, 2.0 * RADIUS - float(distance.min()))


def lost(play: Play, rate: int) -> int:
    """Count the hard shots of a lone ball that leave the table within a second."""
    count = 0
    for k in range(DIRECTIONS):
        angle = math.tau * (k + 0.5) / DIRECTIONS
        velocity = (HARDEST * math.cos(angle), HARDEST * math.sin(angle))
        x, y = play(rack()[:1], velocity, rate, 1.0)[-1, 0]
        count += not (0.0 <= x <= LENGTH and 0.0 <= y <= WIDTH)
    return count


def hit(play: Play, rate: int, offset: float, x: float) -> float | None:
    """Hit a resting ball hard, from ``x``, at a share of two radii beside its middle.

    Returns by how much its direction is off (degrees), or None if the balls pass each other.
    """
    at_rest = np.array([500.0, WIDTH / 2])
    start = np.array([(x, WIDTH / 2 - offset * 2.0 * RADIUS), at_rest])
    dx, dy = play(start, (HARDEST, 0.0), rate, 0.3)[-1, 1] - at_rest
    if dx == 0.0:
        return None
    return abs(math.degrees(math.atan2(dy, dx) - math.asin(offset)))


class Row(NamedTuple):
    """A row has the errors of one player at a frame rate."""

    rate: int  # frames a second
    off: float  # px; how far the farthest ball ends from its exact end
    deepest: float  # px; how deep two balls were in each other at most
    lost: int  # the hard shots that left the table
    turned: float  # degrees; by how much a half-full hit sends a ball off at most
    passed: int  # the balls of 100 that a hard shot passes through


def measure(play: Play, rate: int, frames: Array, ends: Array) -> Row:
    """Measure a break whose film is there, hard shots of a lone ball, and hits of two."""
    hits = {
        offset: [hit(play, rate, offset, 200.0 - 4.0 * k) for k in range(20)] for offset in OFFSETS
    }
    return Row(
        rate, farthest(frames[-1], ends), deepest(frames), lost(play, rate),
        turned=max(off for off in hits[0.5] if off is not None),
        passed=sum(each.count(None) for each in hits.values()),
    )  # fmt: skip


def draw(axes: Axes, title: str, films: dict[int, Array], ends: Array) -> None:
    """Draw the tracks at all frame rates over each other, and circles at the exact ends."""
    axes.set_title(title)
    axes.set(xlim=(0.0, LENGTH), ylim=(0.0, WIDTH), aspect="equal", xticks=[], yticks=[])
    axes.plot(*rack().T, "o", color="#e8ebee", markersize=DISC)
    axes.plot(*ends.T, "o", color=INK, fillstyle="none", markersize=DISC, label="exact ends")
    for rate, frames in films.items():
        axes.plot(frames[..., 0], frames[..., 1], color=COLORS[rate], linewidth=0.9)
        axes.plot(*frames[-1].T, "o", color=COLORS[rate], markersize=4, label=f"{rate} frames/s")


def main(argv: Sequence[str] | None = None) -> dict[str, list[Row]]:
    """Play, print the table, draw the picture, and return the rows."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    out = parser.parse_args(argv).out
    ends = exact_ends(rack(), BREAK)
    players: dict[str, Play] = {"the tutorial": tutorial, "Billiards": ours}
    rows: dict[str, list[Row]] = {}
    figure = Figure((14.0, 4.3), layout="constrained")
    for axes, (name, play) in zip(figure.subplots(1, 2), players.items(), strict=True):
        films = {rate: play(rack(), BREAK, rate, SECONDS) for rate in COLORS}
        rows[name] = [measure(play, rate, frames, ends) for rate, frames in films.items()]
        draw(axes, name, films, ends)
        print(f"{name}: frames/s, farthest end off, deepest overlap, hard shots lost,")
        print("  direction of a half-full hit off, balls passed through")
        for row in rows[name]:
            lengths = f"{row.off:11.3g} px {row.deepest:11.3g} px"
            hits = f"{row.turned:8.3g} deg {row.passed:4} of 100"
            print(f"{row.rate:6} {lengths} {row.lost:6} of {DIRECTIONS} {hits}")
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, markerscale=0.7)
    figure.savefig(out / "tutorial_beside_ours.png", dpi=120)
    return rows


if __name__ == "__main__":
    main()
