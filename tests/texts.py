"""These are scenario files, of which tests change a text."""

from __future__ import annotations

GOOD = """
title = "two balls"
[units]
length = "in"
mass = "g"
[table]
length = 88
width = 44
[restitution]
ball_ball = 0.9
cushion = 0.7
[friction]
surface = 0.1
[ball]
radius = 2.25
mass = 160
[[balls]]
id = "C"
cue = true
position = [66, 22]
[[balls]]
id = "1"
position = [40, 21]
[[shots]]
name = "break"
velocity = [-4, 0]
"""
SIZE = "length = 88\nwidth = 44"
LAUNCH = "velocity = [-4, 0]"
RACK = """
[units]
length = "in"
[restitution]
ball_ball = 0.9
[friction]
surface = 0.1
[ball]
radius = 1.125
mass = 0.17
[[balls]]
id = "cue"
cue = true
position = [0, 0]
[[racks]]
rows = 3
apex = [20, 0]
gap = 0.01
"""
HEXAGON = RACK.replace("rows = 3\napex", 'shape = "hexagon"\nrings = 2\ncenter')
POCKETS = """
[restitution]
ball_ball = 0.9
[friction]
surface = 0.1
[ball]
radius = 0.05
mass = 0.2
[[pockets]]
position = [0.0, 0.0]
radius = 0.1
[[pockets]]
id = "far"
position = [1.0, 0.0]
radius = 0.1
[[balls]]
id = "a"
position = {place}
"""
PLACE = """
[table]
length = 2.0
width = 1.0
[restitution]
ball_ball = 0.9
cushion = 0.8
[friction]
surface = 0.1
[[pockets]]
position = [2.0, 0.5]
radius = 0.08
[[posts]]
position = [1.5, 0.8]
radius = 0.05
[ball]
radius = 0.03
mass = 0.2
[[balls]]
id = "C"
cue = true
position = [0.5, 0.5]
[[balls]]
id = "A"
position = [1.0, 0.5]
[[shots]]
speed = 2.0
angle = 0.0
place = {}
"""


def changed(*changes: tuple[str, str], text: str = GOOD) -> str:
    """Return the good scenario, or another text, with each first text replaced by the second."""
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text
