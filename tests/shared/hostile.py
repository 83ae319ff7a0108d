"""A scene whose every text would be markup if a page took it for that."""

from __future__ import annotations

from dataclasses import replace

from pool_pymunk import Scene, load

HOSTILE = "</script><script>parent.hacked = 1</script><img src=x onerror='parent.hacked = 1'>"


def hostile_scene() -> Scene:
    """Return a scene whose every text would be markup if a page took it for that."""
    scene = load("eight-ball")
    balls = tuple(replace(ball, id=f"{ball.id}{HOSTILE}") for ball in scene.balls)
    pockets = tuple(replace(hole, id=f"{hole.id}{HOSTILE}") for hole in scene.pockets)
    first = scene.shots[0]
    name, ball, aim = (f"{text}{HOSTILE}" for text in (first.name, first.ball, first.aim))
    shots = (replace(first, name=name, ball=ball, aim=aim),)
    return replace(scene, title=f"title {HOSTILE}", balls=balls, pockets=pockets, shots=shots)
