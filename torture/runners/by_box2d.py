"""Box2D v3 plays the scenes, in the metres that it is tuned for."""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import Any

from box2d import World
from box2d._box2d import lib

from torture.runners.common import RIGID_BODIES, serve, setting, sides, stepped

HELLO = "https://github.com/erincatto/box2d/blob/v3.1.0/docs/hello.md"
SUB_STEPS = "https://github.com/erincatto/box2d/blob/v3.1.0/docs/simulation.md"
DIAMETER = 1.0  # m; of the smallest ball: "1 meter being the sweet spot" (docs/FAQ.md)
SETTINGS = {
    "1/60 s, 4 sub-steps": setting(
        {"dt": 1 / 60, "sub": 4}, "time step and sub-steps of Hello Box2D", HELLO
    ),
    "1/240 s, 8 sub-steps, bullets": setting(
        {"dt": 1 / 240, "sub": 8, "bullet": True},
        "more sub-steps for accuracy; bullets for what is fast", SUB_STEPS,
    ),
    **{
        f"1/{n} s, 4 sub-steps": setting(
            {"dt": 1 / n, "sub": 4, "ladder": True}, "smaller steps", SUB_STEPS
        )
        for n in (240, 960, 3840, 15360)
    },
}  # fmt: skip


def play(scene: dict[str, Any], balls: Any, times: list[float], given: dict[str, Any]) -> Any:
    """Step a world to each of the times."""
    scale = DIAMETER / (2 * min(ball[4] for ball in balls))
    world = World(gravity=(0.0, scene["gravity"] * scale))
    world.restitution_threshold = 0.0  # By default, hits slower than 1 m/s have e = 0.
    world.enable_sleep = False
    lib.b2World_SetMaximumLinearSpeed(world._world_id, 1e5)  # By default 400 m/s.
    ground = world.new_body().static()
    corners = [(x * scale, y * scale) for x, y in scene["walls"]]
    for a, b in sides(corners):
        ground.segment(a, b, friction=0.0, restitution=scene["wall_restitution"])
    ground = ground.build()
    bodies = []
    for x, y, vx, vy, r, m in balls:
        new = world.new_body().dynamic().position(x * scale, y * scale)
        new.linear_velocity(vx * scale, vy * scale)
        new.bullet(bool(given.get("bullet")) and (vx, vy) != (0.0, 0.0))
        area = math.pi * (r * scale) ** 2
        new.circle(
            r * scale, density=m / area, friction=0.0, restitution=scene["restitution"]
        )  # fmt: skip
        bodies.append(new.build())
        if scene["friction"]:  # As the sample MotorJoint has top-down dry friction.
            world.add_motor_joint(
                ground, bodies[-1], max_force=m * scene["friction"] * 9.81 * scale,
                max_torque=0.0, correction_factor=0.0, collide_connected=True,
            )  # fmt: skip

    def look() -> list[list[float]]:
        rows = [(*body.position, *body.linear_velocity) for body in bodies]
        return [[number / scale for number in row] for row in rows]

    states = stepped(times, given["dt"], lambda dt: world.step(dt, given["sub"]), look)
    world.destroy()
    return states


if __name__ == "__main__":
    engine = lib.b2GetVersion()
    number = f"{engine.major}.{engine.minor}.{engine.revision}"
    serve(RIGID_BODIES, {"box2d-python": version("box2d-python"), "Box2D": number}, SETTINGS, play)
