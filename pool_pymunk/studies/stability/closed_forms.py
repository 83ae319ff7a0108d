"""These claims are for single extremes: a closed form, a symmetry, or a likeness."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pool_pymunk.model import Point, Scene
from pool_pymunk.studies.compare import end_distances, longest
from pool_pymunk.studies.stability.claims import CARE, by_coulomb, farthest
from pool_pymunk.studies.stability.trial import Claim, Measure, Trial, wrong


def contacts_are(expected: int) -> Claim:
    """Claim that the run has this number of contacts."""
    return lambda trial: wrong(
        "contacts", f"{trial.contacts} contacts, not {expected}", trial.contacts != expected
    )


def pocket(*ids: str) -> Claim:
    """Claim that just these balls are pocketed; an empty id is none."""
    expected = {id_ for id_ in ids if id_}

    def pocketed(trial: Trial) -> Measure:
        found = set(trial.run.pocketed)
        words = f"{sorted(found) or 'nothing'} pocketed, not {sorted(expected) or 'nothing'}"
        return wrong("pocketed", words, found != expected)

    return pocketed


def leave_with(velocities: Mapping[str, Point]) -> Claim:
    """Claim that balls end with these velocities (m/s)."""

    def velocity(trial: Trial) -> Measure:
        ends = dict(zip(trial.scene.index, trial.run.end.velocity, strict=True))
        return _velocity(trial, max(math.dist(ends[id_], v) for id_, v in velocities.items()))

    return velocity


def leaves_at(id_: str, speed: float) -> Claim:
    """Claim that a ball ends with this speed (m/s)."""

    def leaves(trial: Trial) -> Measure:
        end = math.hypot(*trial.run.end.velocity[trial.scene.index[id_]])
        return _velocity(trial, abs(end - speed))

    return leaves


def end_at(places: Mapping[str, Point]) -> Claim:
    """Claim that balls come to rest at these places (m), by Coulomb's law."""

    def limit(trial: Trial) -> Measure:
        off = max(end_distances(trial.run, places).values())
        bound = min(_displaced(trial), trial.smallest)
        return Measure("limit", off, bound, trial.smallest, "m", "{} from the limit of the hits")

    return by_coulomb(limit)


def know_of_ends(places: Mapping[str, Point]) -> Claim:
    """Claim that an exact solver says how far (m) balls may end elsewhere, and no less.

    They end at these places (m) if the contacts come one after the other.
    """

    def order(trial: Trial) -> Measure | None:
        if not trial.method.exact:
            return None
        off = max(end_distances(trial.run, places).values())
        words = "{} off what an order gives, and the run does not say so"
        return Measure("order", off, trial.run.policy_shift, trial.smallest, "m", words)

    return order


def as_in(base: Scene, scale: float = 1.0, shift: Point = (0.0, 0.0)) -> Claim:
    """Claim that everything happens as in another scene, scaled and then shifted (m)."""

    def likeness(trial: Trial) -> Measure:
        like, times = trial.of(base), trial.exact.times
        apart = longest(trial.run.at(times)[0] - (like.run.at(times)[0] * scale + shift))
        return farthest("likeness", apart, trial, "{} off the scene that it must be like", care=2.0)

    return likeness


@by_coulomb
def mirrored(trial: Trial) -> Measure:
    """Measure that a scene which is symmetric about y = 0 at the start stays so."""
    start = {ball.position: k for k, ball in enumerate(trial.scene.balls)}
    partner = [start[x, -y] for x, y in start]
    points = trial.run.at(trial.exact.times)[0]
    apart = longest(points - points[:, partner] * (1.0, -1.0))
    return farthest("symmetry", apart, trial, "{} from symmetric")


@by_coulomb
def on_the_diagonal(trial: Trial) -> Measure:
    """Measure that a ball that comes along the diagonal x = y of a square stays on it."""
    points = trial.run.at(trial.times)[0]
    off = float(np.abs(points[..., 0] - points[..., 1]).max())
    return Measure("symmetry", off, _displaced(trial), trial.smallest, "m", "{} from symmetric")


@by_coulomb
def all_as_far(trial: Trial) -> Measure:
    """Measure that balls that come to the origin alike leave it alike; one that was there stays."""
    points = trial.run.at(trial.times)[0]
    far = np.hypot(points[..., 0], points[..., 1])
    comes = far[0] > 0.0
    off = max(float(np.ptp(far[:, comes], axis=1).max()), float(far[:, ~comes].max(initial=0.0)))
    bound = _share(trial) * trial.exact.extent
    return Measure("symmetry", off, bound, trial.smallest, "m", "{} from symmetric")


def _velocity(trial: Trial, off: float) -> Measure:
    bound = _share(trial) * trial.fastest
    return Measure("velocity", off, bound, trial.fastest, "m/s", "a velocity is {} off")


def _share(trial: Trial) -> float:
    """Return by how much (rad, at most 1) rounding, or coming late, may turn normals."""
    return min(_displaced(trial) / trial.smallest, 1.0)


def _displaced(trial: Trial) -> float:
    """Return how far (m) rounding, or coming late, may displace the contacts of a short run."""
    return CARE * (trial.contacts + 1) * trial.rounding + trial.late
