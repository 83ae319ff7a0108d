"""``python -m tests.loops`` compiles all loops of many shots, so that tests need not wait for them.

Balls slide, or roll; sides are straight, or there are arcs among them.
"""

from __future__ import annotations

from dataclasses import replace

import pool_pymunk
from pool_pymunk import load

SLIDES, ROLLS, STADIUM = (load(name) for name in ("report", "follow-and-draw", "stadium"))

if __name__ == "__main__":
    for scene in (SLIDES, ROLLS, STADIUM, replace(STADIUM, friction=ROLLS.friction)):
        pool_pymunk.compile(scene)
