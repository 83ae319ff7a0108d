"""The picture of a fit shows residuals in the unit of the scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pool_pymunk import Ball, Friction, Scene, Shot, Units, fit
from pool_pymunk.render import residuals
from pool_pymunk.render.canvas import Figure

pytest.importorskip("scipy")

SIGMA = 1e-3  # m


@pytest.mark.parametrize(("length", "metre"), [("m", 1.0), ("mm", 1000.0), ("in", 1 / 0.0254)])
def test_the_frame_of_residuals_is_four_sigma_wide(
    length: str, metre: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = list[Figure]()
    monkeypatch.setattr(residuals, "save_figure", lambda figure, *_: drawn.append(figure))
    balls, shots = (Ball("C", (0.0, 0.0), 0.03, 0.2),), (Shot("S", "C", (1.0, 0.0)),)
    scene = Scene(balls, friction=Friction(0.25), shots=shots, units=Units(length=length))
    end = 1.0 / (2.0 * 0.25 * 9.80665)
    off = [(SIGMA, 0.0), (-SIGMA, SIGMA), (0.0, -SIGMA), (20 * SIGMA, 0.0)]
    found = fit(scene, [(1, "C", end + x, y) for x, y in off], [], error=SIGMA)
    residuals.residuals_picture(found, Path("fit.png"))
    right = drawn[0].axes[1]
    edge = 4.0 * SIGMA * metre
    np.testing.assert_allclose([*right.get_xlim(), *right.get_ylim()], [-edge, edge] * 2)
    inside, beyond = (np.asarray(line.get_xydata(), float) for line in right.lines[:2])
    np.testing.assert_allclose(inside, np.array(off[:3]) * metre, atol=1e-9 * metre)
    np.testing.assert_allclose(beyond, [[0.97 * edge, 0.0]], atol=1e-9 * metre)
