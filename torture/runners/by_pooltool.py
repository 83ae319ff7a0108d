"""pooltool plays the scenes: event-based, with balls that slide and roll in three dimensions."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np
import pooltool
from pooltool.objects import BilliardTableSpecs, LinearCushionSegment
from pooltool.objects.table.components import CushionSegments
from pooltool.physics.engine import PhysicsEngine
from pooltool.physics.evolve import evolve_ball_motion
from pooltool.physics.resolve.ball_ball.friction import AverageBallBallFriction
from pooltool.physics.resolve.ball_ball.frictional_inelastic import (
    FrictionalInelastic,
)
from pooltool.physics.resolve.ball_ball.frictionless_elastic import (
    FrictionlessElastic,
)
from pooltool.physics.resolve.ball_cushion.unrealistic import (
    UnrealisticCircular,
    UnrealisticLinear,
)
from pooltool.physics.resolve.resolver import default_resolver

from torture.runners.common import serve, setting, sides

MODELS = "https://github.com/ekiefl/pooltool/blob/v0.6.0/docs/resources/custom_physics.md"
LAYOUTS = "https://github.com/ekiefl/pooltool/blob/v0.6.0/pooltool/layouts.py"
ROOTS = "https://github.com/ekiefl/pooltool/pull/354"
OFFERS = {"restitution below 1", "balls that roll", "any outline"}
NONE = 1e-10  # Friction must be positive; of 1e-3 to 1e-15, this one came closest to none.
FAR = 100.0  # m; a table so large that no ball meets a cushion
SLIDING, RESTING = 2, 0  # pooltool.constants
SETTINGS = {
    "as it is": setting(
        {}, "event-based, no step; its models FrictionlessElastic (or FrictionalInelastic for "
        "e < 1) and Unrealistic cushions, which are the laws of the scenes", MODELS,
    ),
    "balls in touch 1e-3 radii apart": setting(
        {"gap": 1e-3, "only": "touching"}, "the spacing_factor of its own racks", LAYOUTS
    ),
    "frictions 1e-6 apart": setting(
        {"uneven": 1e-6, "only": "in line"},
        "a fix under review, for balls in line, whose relative acceleration is zero", ROOTS,
    ),
}  # fmt: skip


def play(scene: dict[str, Any], balls: Any, times: list[float], given: dict[str, Any]) -> Any:
    """Simulate a system, and look at its history at the times."""
    x0, y0 = np.min(scene["walls"], axis=0) if scene["walls"] else (-FAR, -FAR)
    stretch = 1.0 + given.get("gap", 0.0) / 2
    friction, rolling = scene["friction"] or NONE, scene["rolling"] or NONE
    made = {}
    for i, (x, y, vx, vy, r, m) in enumerate(balls):
        own = 1.0 + given.get("uneven", 0.0) * i
        ball = pooltool.Ball.create(
            str(i), xy=(x * stretch - x0, y * stretch - y0), m=m, R=r, g=9.81, u_b=NONE,
            u_s=own * friction, u_r=own * rolling,
            e_b=scene["restitution"], e_c=scene["wall_restitution"],
        )  # fmt: skip
        ball.state.rvw[1] = vx, vy, 0.0
        ball.state.rvw[2] = -scene["roll"] * vy / r, scene["roll"] * vx / r, 0.0
        ball.state.s = SLIDING if vx or vy else RESTING
        made[str(i)] = ball
    cue = pooltool.Cue(cue_ball_id="0")
    system = pooltool.System(cue=cue, table=_table(scene, x0, y0), balls=made)
    pooltool.simulate(system, engine=_engine(scene), inplace=True, t_final=times[-1])
    moved = np.array((x0, y0))
    return [[_state(ball, time, moved) for ball in system.balls.values()] for time in times]


def _engine(scene: dict[str, Any]) -> Any:
    resolver = default_resolver()
    rubs = FrictionalInelastic(friction=AverageBallBallFriction())
    resolver.ball_ball = FrictionlessElastic() if scene["restitution"] == 1.0 else rubs
    loses = scene["wall_restitution"] < 1.0
    resolver.ball_linear_cushion = UnrealisticLinear(restitution=loses)
    resolver.ball_circular_cushion = UnrealisticCircular(restitution=loses)
    return PhysicsEngine(resolver=resolver)


def _table(scene: dict[str, Any], x0: float, y0: float) -> Any:
    corners = [(x - x0, y - y0) for x, y in scene["walls"]] or [(0.0, 0.0), (2 * FAR, 2 * FAR)]
    width, length = np.max(corners, axis=0)
    table = pooltool.Table.from_table_specs(BilliardTableSpecs(l=length, w=width))
    if "any outline" in scene["needs"]:
        height = table.cushion_segments.linear["3"].height
        ends = [np.array((x, y, height)) for x, y in corners]
        lines = {
            str(k): LinearCushionSegment(str(k), a.copy(), b.copy())
            for k, (a, b) in enumerate(sides(ends))
        }
        table.cushion_segments = CushionSegments(linear=lines, circular={})
    return table


def _state(ball: Any, time: float, moved: Any) -> list[float]:
    """Return x, y, vx, vy at a time: the last state before it, evolved to it."""
    state = [state for state in ball.history.states if state.t <= time][-1]
    p = ball.params
    rvw, _ = evolve_ball_motion(
        state.s, state.rvw, p.R, p.m, p.u_s, p.u_sp, p.u_r, p.g, time - state.t
    )
    return [*(rvw[0, :2] + moved).tolist(), *rvw[1, :2].tolist()]


if __name__ == "__main__":
    names = ("pooltool-billiards", "numba", "numpy")
    serve(OFFERS, {name: version(name) for name in names}, SETTINGS, play)
