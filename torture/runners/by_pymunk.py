"""Stock pymunk plays the scenes, as its tutorials have it: pixels, PivotJoints, fixed steps."""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import Any

import pymunk

from torture.runners.common import RIGID_BODIES, serve, setting, sides, stepped

TUTORIAL = "https://github.com/russs123/pool_tutorial"
TUNNELING = "https://www.pymunk.org/en/latest/overview.html"
STEP = "https://github.com/viblo/pymunk/blob/master/pymunk/space.py"
RADIUS = 18.0  # px; of the smallest ball, as in the tutorial, so that the slop of 0.1 px is small
SETTINGS = {
    "1/120 s": setting({"dt": 1 / 120}, "frames a second of the pool tutorial", TUTORIAL),
    "1/1200 s, fine": setting(
        {"dt": 1 / 1200, "slop": 0.001}, "smaller steps, several a frame", TUNNELING
    ),
    **{
        f"1/{n} s": setting({"dt": 1 / n, "slop": 0.001, "ladder": True}, "smaller steps", STEP)
        for n in (60, 480, 4800, 19200)
    },
}


def play(scene: dict[str, Any], balls: Any, times: list[float], given: dict[str, Any]) -> Any:
    """Step a space to each of the times."""
    scale = RADIUS / min(ball[4] for ball in balls)
    space = pymunk.Space()
    space.gravity = 0.0, scene["gravity"] * scale
    space.collision_slop = given.get("slop", space.collision_slop)
    bounce = math.sqrt(scene["restitution"])  # In pymunk elasticities multiply.
    bodies = [_ball(space, scale, ball, bounce, scene["friction"] * 9.81) for ball in balls]
    corners = [pymunk.Vec2d(*corner) * scale for corner in scene["walls"]]
    for a, b in sides(corners):
        thickness = 0.0 if scene["thin"] else RADIUS
        out = (b - a).normalized().rotated(-math.pi / 2) * thickness
        wall = pymunk.Segment(space.static_body, a + out, b + out, thickness)
        wall.elasticity = scene["wall_restitution"] / bounce
        space.add(wall)

    def look() -> list[list[float]]:
        return [[*(body.position / scale), *(body.velocity / scale)] for body in bodies]

    return stepped(times, given["dt"], space.step, look)


def _ball(space: Any, scale: float, ball: list[float], bounce: float, slows: float) -> Any:
    x, y, vx, vy, r, m = ball
    body = pymunk.Body(m, pymunk.moment_for_circle(m, 0.0, r * scale))
    body.position, body.velocity = (x * scale, y * scale), (vx * scale, vy * scale)
    circle = pymunk.Circle(body, r * scale)
    circle.elasticity, circle.friction = bounce, 0.0
    space.add(body, circle)
    if slows:
        brake = pymunk.PivotJoint(space.static_body, body, (0.0, 0.0), (0.0, 0.0))
        brake.max_bias, brake.max_force = 0.0, m * slows * scale
        space.add(brake)
    return body


if __name__ == "__main__":
    serve(RIGID_BODIES, {"pymunk": version("pymunk")}, SETTINGS, play)
