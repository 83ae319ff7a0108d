"""The package `billiards` plays the scenes: exact, elastic, without friction."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

from billiards import Billiard, InfiniteWall

from torture.runners.common import serve, setting, sides

README = "https://github.com/markus-ebke/python-billiards"
OFFERS = {"any outline", "unequal masses", "unequal radii"}  # of convex outlines
SETTINGS = {"as it is": setting({}, "it has no tolerance or step to choose", README)}


def play(scene: dict[str, Any], balls: Any, times: list[float], given: dict[str, Any]) -> Any:
    """Evolve a billiard to each of the times."""
    table = Billiard([InfiniteWall(a, b) for a, b in sides(scene["walls"])])
    for x, y, vx, vy, r, m in balls:
        table.add_ball((x, y), (vx, vy), r, m)
    states = []
    for time in times:
        table.evolve(time)
        pairs = zip(table.balls_position.tolist(), table.balls_velocity.tolist(), strict=True)
        states.append([[*place, *velocity] for place, velocity in pairs])
    return states


if __name__ == "__main__":
    serve(OFFERS, {name: version(name) for name in ("billiards", "numpy")}, SETTINGS, play)
