"""A ball without losses
=====================

A ball without friction, on cushions of restitution 1, moves for ever: chaotically in a stadium,
regularly in a circle. Its centre moves in a region that is smaller than the table by its radius.
The lower panels are boundary maps: the places of its contacts on the boundary of that region, and
the sines of the angles at which it leaves.

The Lyapunov exponent is the rate at which the distance of two neighbouring paths grows.
Derivatives beyond 1e150 are NaN, so the motion is played in pieces, each from the end of the one
before. In the stadium the exponent is 0.433 +- 0.002 per second at 1 m/s (``--contacts 400000``),
and in the circle 0.001 (by default). ``run.rounding`` tells from when on the path itself is not
known, and only averages mean something: in the stadium after some 85 s.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pool_pymunk import Ball, Physics, Restitution, Run, Scene, Table, simulate

R, PIECE = 0.1, 400.0  # m, the ball's radius; s, what is differentiated at once
STADIUM, CIRCLE = Table.stadium(4.0 + 2.0 * R, 2.0 + 2.0 * R), Table.circle(1.0 + R)
STARTS = ((STADIUM, 63.0, "#0072b2"), (CIRCLE, 60.0, "#d55e00"), (CIRCLE, 20.0, "#009e73"))


def boundary_map(run: Run) -> list[tuple[float, float]]:
    """Return each contact's place (m) on the boundary of the centre's region, and its sine."""
    edges, found = run.scene.table.edges if run.scene.table else (), []
    lengths = [edge.arc_length - 4.0 * math.atan(edge.bulge) * R for edge in edges]
    for event, (_, x, y, vx, vy, _, _) in zip(run.events, run.knots[0][1:], strict=False):
        k = event.cushion or 0
        share = edges[k].share(x, y)
        nx, ny = edges[k].at(share)[1]
        s = sum(lengths[:k]) + share * lengths[k]
        found.append((s, (vx * ny - vy * nx) / math.hypot(vx, vy)))
    return found


def exponent(scene: Scene, pieces: int) -> tuple[float, float]:
    """Return the Lyapunov exponent (1/s) of a run of many pieces, and its standard error."""
    change, grown, end = np.ones(4), [], None
    for _ in range(pieces):
        run = simulate(scene, solver="event-driven", start=end, max_time=PIECE)
        found, end = run.derivatives(), run.end
        change = np.vstack((found.final[0], found.velocity[0])) @ change
        grown.append(math.log(np.linalg.norm(change)) / PIECE)
        change /= np.linalg.norm(change)
    return float(np.mean(grown)), float(np.std(grown) / math.sqrt(pieces))


def main(argv: Sequence[str] | None = None) -> list[tuple[Run, float]]:
    """Play, print the numbers, draw the picture, and return the runs with their exponents."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--contacts", type=int, default=10_000)
    options, found = parser.parse_args(argv), []
    figure = Figure((11.0, 6.4), layout="constrained")
    panels = figure.subplots(2, 2, width_ratios=(1.6, 1.0))
    for table, angle, color in STARTS:
        velocity = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        ball, long = Ball("a", (1.7, 1.1), R, 1.0, velocity=velocity), Physics(max_time=1e9)
        scene = Scene((ball,), table, Restitution(cushion=1.0), physics=long)
        run = simulate(scene, solver="event-driven", max_events=options.contacts)
        points, (grows, error) = boundary_map(run), exponent(scene, options.contacts // 400)
        energy, free = run.energy["final"], run.duration / len(run.events)
        print(f"{len(run.events)} contacts: {run.wall_time:.1f} s, {energy:.14f} J", end=", ")
        print(f"free path {free:.4f} m, exponent {grows:.5f} +- {error:.5f} / s")
        above, below = panels[:, int(table is CIRCLE)]
        above.fill(*np.transpose(table.polyline), fill=False, linewidth=2.0)
        above.plot(*run.knots[0][:100, 1:3].T, color=color, linewidth=0.6)
        above.set(aspect="equal", frame_on=False, xticks=[], yticks=[])
        below.plot(*np.transpose(points[:5_000]), ".", color=color, markersize=1.5)
        below.set(xlabel="along the boundary (m)", ylabel="sine", ylim=(-1.0, 1.0), xmargin=0.0)
        found.append((run, grows))
    figure.savefig(options.out / "dynamical_billiards.png", dpi=120)
    return found


if __name__ == "__main__":
    main()
