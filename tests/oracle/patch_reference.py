"""This is an independent reference for patches: sand and ice, of discs and of balls that roll.

It plays as ``press_reference`` does, by a rule of order five, and shares no code with the solvers.
A ball crosses a border where its signed distance from a patch falls through zero. Which patches
hold a ball is remembered, and changes there alone. No step is so long that a ball near a border
could pass a corner unseen, except within 0.1 mm.
"""

from __future__ import annotations

import math

from pool_pymunk import Patch, Scene, State
from tests.oracle.press_reference import Measures, PressReference, PressRun, dot

SKIPS = 1e-4  # m; a ball moves on so far at most where it is near a border


def distance(patch: Patch, place: complex) -> float:
    """Return how far (m) a place is from the border of a patch; it is negative in the patch."""
    if patch.center is not None and patch.radius is not None:
        return abs(place - complex(*patch.center)) - patch.radius
    least, winds = math.inf, 0.0
    corners = [complex(*corner) for corner in patch.corners]
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        share = min(1.0, max(0.0, dot(place - a, b - a) / abs(b - a) ** 2))
        least = min(least, abs(place - a - share * (b - a)))
        first, last = a - place, b - place
        winds += math.atan2(first.real * last.imag - first.imag * last.real, dot(first, last))
    return -least if abs(winds) > math.pi else least


class PatchReference(PressReference):
    """This is a scene with patches in floats; ``run`` plays it."""

    def __init__(self, scene: Scene, start: State) -> None:
        super().__init__(scene, start)
        self.patches, g = scene.patches, scene.physics.gravity
        self.table = self.grip[0], self.drag[0]
        self.own = [
            tuple(-1.0 if mu is None else mu * g for mu in (patch.surface, patch.rolling))
            for patch in scene.patches
        ]
        self.holds = [[distance(patch, p) < 0 for patch in self.patches] for p in self.place]
        for i in self.everybody:
            self._enter(i)

    def _enter(self, i: int) -> None:
        """Let a ball have the friction of the last patch that holds it."""
        self.grip[i], self.drag[i] = self.table
        for holds, (grip, drag) in zip(self.holds[i], self.own, strict=True):
            if holds:
                self.grip[i] = self.table[0] if grip < 0 else grip
                self.drag[i] = self.table[1] if drag < 0 else drag

    def _measures(self) -> Measures:
        found = super()._measures()
        for i in self.everybody:
            for k, patch in enumerate(self.patches):
                far = distance(patch, self.place[i])
                found["border", ("patch", i, k)] = -far if self.holds[i][k] else far
        return found

    def _go_on(self, step: float) -> tuple[float, bool]:
        for i in self.everybody:
            speed = max(abs(self.v[i]), abs(self.w[i]), 1e-9)
            near = min(abs(distance(patch, self.place[i])) for patch in self.patches)
            step = min(step, max(0.5 * near, SKIPS) / speed)
        before = len(self.out.events)
        found = super()._go_on(step)
        for _, kind, (_, i, k) in self.out.events[before:]:
            if kind == "border":
                self.holds[i][k] = not self.holds[i][k]
                self._enter(i)
        return found


def patch_run(scene: Scene, start: State | None = None) -> PressRun:
    """Play a scene with patches from a state, by default with the velocities of its balls."""
    return PatchReference(scene, start or scene.start(None)).run()
