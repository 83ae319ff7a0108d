"""Claims measure what must hold in all trials or in one extreme, and compare it with a bound.

The bounds come from three sources:

- *Rounding*: a contact rounds velocities and positions a few times. After K contacts that is at
  most ``CARE * (K + 1)`` units of rounding, of the velocities or of the largest coordinate.
- *Amplification*: two exact runs whose starts differ by one unit of rounding move apart. How far
  is measured (:func:`pool_pymunk.studies.stability.trial.reference_of`). Every contact may nudge a
  run like that, so two exact solvers may differ by ``CARE * (K + 1)`` times as much at most.
- *Lateness*: a solver that answers contacts at the end of a step may err by a step at each of them.
  Balls may overlap by the path of the fastest ball in one step, and every contact may move a run by
  the same length. But a run is wrong if a ball is off by more than a radius.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Concatenate, ParamSpec

import numpy as np

from pool_pymunk.core.floor import lies_between
from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.model import Point, Scene, SceneError, State, Table
from pool_pymunk.model.arrays import Array
from pool_pymunk.studies.compare import Comparison, end_distances, longest
from pool_pymunk.studies.stability.trial import Claim, Measure, Trial, grid, wrong

NEAR = "exact run"  # the claim that compares with the reference run, as the CSV file names it
# A contact has some thirty sums and products, and may cost this many units of rounding. Exact
# solvers use 28 % of their bounds at most: half as much breaks nothing, twice as much notices less.
CARE = 32.0
# Within a piece of a persistent contact, the velocity is that of a parabola, which is so far off.
PARABOLA = 5e-8
# of a speed and of a radius; persistent contacts of a solver that plays them to no tolerance
ERROR, DEVIATION = 1e-9, 4e-9
OVERLAP = 1e-9  # of the sum of the radii; far less than scenes may overlap by at the start
AT_ONCE = 1_000_000  # pairs of balls and times that are looked at together
QUICK = 0.5  # s; a run slower than this is not repeated

P = ParamSpec("P")


def measures(trial: Trial) -> Iterator[Measure]:
    """Measure what must hold in every trial, then what must hold in this one."""
    sound = all(np.isfinite(breakpoints).all() for breakpoints in trial.run.knots)
    broken = not sound or trial.run.status == "non_finite"
    yield wrong("finite", "numbers out of range", broken)
    for each in () if broken else (*ALWAYS, *trial.case.claims):  # Others would mean nothing.
        if (measure := each(trial)) is not None:
            yield measure


def ends(trial: Trial) -> Measure:
    """Measure that the run ends as it must, and not after ``max_time``; it may rest before."""
    run = trial.run
    expected = trial.case.ends or ("max_time" if trial.scene.physics.max_time else "settled")
    rests = run.status == "settled" and not any(map(any, run.end.velocity))
    if run.status != expected and not rests:
        return wrong("ends", f"ends with {run.status}, not {expected}")
    over = max(run.duration - (trial.scene.physics.max_time or math.inf), 0.0)
    bound = 1.000001 * (trial.dt or 0.0) if trial.method.late else 0.0
    return Measure("ends", over, bound, run.duration, "s", "goes on for {} too long")


def unless(law: str, claim: Claim) -> Claim:
    """Return the claim for all other laws.

    `published` answers in the listing's order, and the friction of `weakening` depends on m/s.
    """
    return lambda trial: None if trial.law == law else claim(trial)


but_published = partial(unless, "published")


def energy_kept(trial: Trial) -> Measure:
    """Measure by which share energy grows or, in a scene without losses, changes."""
    total = trial.run.energy_at(trial.times) / trial.run.energy["initial"]
    keeps = lossless(trial.scene)
    change = float(np.ptp(total) if keeps else max(np.diff(total).max(), 0.0))
    words = f"energy {'changes' if keeps else 'grows'} by {{}} of itself"
    bound = CARE * EPSILON * (trial.contacts + 1)
    error = ERROR if trial.run.contact_tolerance is None else PARABOLA
    bound = max(bound, 2.0 * error * bool(trial.run.persistent))  # Both are of a speed.
    return Measure("energy", change, bound, words=words)


def momentum(trial: Trial) -> Measure | None:
    """Measure that momentum is kept, where balls meet only balls and nothing brakes them."""
    scene = trial.scene
    others = scene.table or scene.deceleration > 0.0 or scene.pockets or scene.posts
    return None if others else momentum_kept(trial)


def momentum_kept(trial: Trial) -> Measure:
    """Measure the change of momentum, as a share of the sum of the momenta of all balls."""
    mass = np.array([ball.mass for ball in trial.scene.balls])[:, None]
    _, speeds = trial.run.at([0.0, trial.run.duration])
    start, end = (mass * speeds).sum(axis=1)
    change = math.dist(start, end) / float((mass * np.abs(speeds)).sum(axis=(1, 2)).max())
    bound = CARE * EPSILON * (trial.contacts + 1)
    return Measure("momentum", change, bound, words="momentum changes by {} of itself")


def inside(trial: Trial) -> Measure | None:
    """Measure that no ball is beyond a cushion, by more than its errors and pieces explain."""
    if (table := trial.scene.table) is None:
        return None
    points, there = trial.run.at(trial.times)[0], trial.run.on_table(trial.times)
    depth = float(beyond(table, points, trial.radii)[there].max(initial=0.0))
    bound = OVERLAP * trial.smallest + CARE * trial.rounding + trial.late
    bound = max(bound, sunk(trial))
    return Measure("inside", depth, bound, trial.smallest, "m", "a ball {} beyond a cushion")


def sunk(trial: Trial) -> float:
    """Return how far (m) a ball may sink in where contacts persist: by the run's tolerance."""
    if not trial.run.persistent:
        return 0.0
    return trial.run.contact_tolerance or DEVIATION * trial.smallest


def beyond(table: Table, points: Array, radii: Array) -> Array:
    """Return how far (m) discs at ``points`` (T, N, 2) lie beyond the cushions; < 0: inside."""
    x, y = points[..., 0], points[..., 1]
    nearest, within = np.full(x.shape, np.inf), np.zeros(x.shape, dtype=bool)
    for edge in table.edges:
        (ax, ay), (bx, by), (tx, ty) = edge.start, edge.end, edge.tangent
        if ay != by:
            within ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) / (by - ay) * (bx - ax))
        if edge.bulge:
            far = np.vectorize(edge.distance, otypes=[float])(x, y)
        else:
            foot = np.clip((x - ax) * tx + (y - ay) * ty, 0.0, edge.length)
            far = np.hypot(x - ax - foot * tx, y - ay - foot * ty)
        nearest = np.minimum(nearest, far)
    for arc in table.lines[2]:
        within ^= np.vectorize(partial(lies_between, arc), otypes=[bool])(x, y)
    return np.asarray(radii - np.where(within, nearest, -nearest))


def overlap(trial: Trial) -> Measure | None:
    """Measure that balls overlap by no more than rounding, lateness or pressing explain."""
    radii = trial.radii
    if len(radii) < 2:
        return None
    each = max(1, AT_ONCE // len(radii) ** 2)
    times = trial.times if each > 1 else trial.times[:: len(trial.times) // 20 + 1]
    deepest = 0.0
    for part in range(0, len(times), each):
        points = trial.run.at(times[part : part + each])[0]
        points[~trial.run.on_table(times[part : part + each])] = np.nan
        deepest = max(deepest, deepest_overlap(points, radii))
    bound = OVERLAP * 2.0 * trial.smallest + CARE * trial.rounding + 2.0 * trial.late
    bound = max(bound, 2.0 * sunk(trial))
    return Measure("overlap", deepest, bound, trial.smallest, "m", "balls overlap by {}")


def deepest_overlap(points: Array, radii: Array) -> float:
    """Return how deep (m) two of the balls at ``points`` (T, N, 2) are in each other; nan: gone."""
    touching, gaps = radii[:, None] + radii, points[:, :, None] - points[:, None]
    np.fill_diagonal(touching, -np.inf)
    depths = touching - np.hypot(gaps[..., 0], gaps[..., 1])
    return float(np.fmax.reduce(depths, axis=None, initial=0.0))


def near_reference(trial: Trial) -> Measure | None:
    """Measure that the run is no farther from the reference than amplification explains."""
    if trial.is_reference:
        return None
    apart = Comparison(trial.run, trial.reference.run).apart(trial.reference.times)
    apart = np.maximum(apart - trial.reference.run.persistent_shift, 0.0)  # It errs itself.
    return farthest(NEAR, apart, trial, "{} from the reference run")


def farthest(claim: str, apart: Array, trial: Trial, words: str, care: float = 1.0) -> Measure:
    """Measure the distance (m, of T) from where balls should be that is largest for its bound."""
    reference = trial.reference
    share = care * CARE * (trial.contacts + 1) * (EPSILON + trial.late / reference.extent)
    bound = np.minimum(share * (reference.growth + reference.extent), trial.smallest)
    k = int((apart / bound).argmax())
    return Measure(claim, float(apart[k]), float(bound[k]), trial.smallest, "m", words)


def same_bits(trial: Trial) -> Measure | None:
    """Measure that the same input gives the same bits."""
    if trial.run.wall_time > QUICK:
        return None
    again = trial.simulate(trial.scene)
    same = again.final == trial.run.final and again.events == trial.run.events
    return wrong("same bits", "a second run differs", not same)


def any_order(trial: Trial) -> Measure | None:
    """Measure that the listing order of the balls does not matter; to `published` it does."""
    scene, run, times = trial.scene, trial.run, trial.reference.times
    if len(scene.balls) < 2 or run.wall_time > QUICK:
        return None
    turned = trial.simulate(replace(scene, balls=scene.balls[::-1]))
    apart = longest(run.at(times)[0] - turned.at(times)[0][:, ::-1])
    measured = farthest("any order", apart, trial, "balls listed in another order end {} off")
    # Each may be as far off as it says, and 99 % of such figures cover.
    said = run.persistent_shift + turned.persistent_shift
    return measured._replace(bound=max(measured.bound, 3.0 * said))


def there_and_back(trial: Trial) -> Measure | None:
    """Measure that all velocities reversed lead back to the start, where nothing dissipates."""
    run = trial.run
    if not lossless(trial.scene) or run.status != "max_time" or run.wall_time > QUICK:
        return None
    states = zip(trial.scene.balls, run.end.position, run.end.velocity, strict=True)
    balls = (replace(b, position=p, velocity=(-vx, -vy)) for b, p, (vx, vy) in states)
    try:
        home = trial.of(replace(trial.scene, balls=tuple(balls)))
    except SceneError:
        return None  # It ended off the table, and `inside` says so.
    times = home.reference.times
    apart = longest(home.run.at(times)[0] - run.at(run.duration - times)[0])
    return farthest("there and back", apart, home, "comes back {} off its start", care=2.0)


def lossless(scene: Scene) -> bool:
    """Tell whether nothing in the scene takes energy."""
    r, f = scene.restitution, scene.friction
    rubs = scene.deceleration > 0.0 or f.cushion > 0.0 or f.ball_ball > 0.0
    elastic = {r.ball_ball, r.cue_ball, r.cushion} <= {None, 1.0}
    return elastic and not rubs and not scene.pockets


ALWAYS = (
    ends, but_published(energy_kept), but_published(momentum), inside, overlap, near_reference,
    same_bits, but_published(any_order), there_and_back,
)  # fmt: skip


# -- of single extremes: a closed form, a symmetry, or a likeness ----------------------------------


def claim(measure: Callable[Concatenate[Trial, P], Measure | None]) -> Callable[P, Claim]:
    """Return a maker of claims: it takes the arguments of a measure that follow the trial."""
    return lambda *about, **named: lambda trial: measure(trial, *about, **named)


@claim
def contacts_are(trial: Trial, expected: int) -> Measure:
    """Measure that the run has this number of contacts."""
    words = f"{trial.contacts} contacts, not {expected}"
    return wrong("contacts", words, trial.contacts != expected)


@claim
def pocket(trial: Trial, *ids: str) -> Measure:
    """Measure that just these balls are pocketed; an empty id is none."""
    found, expected = set(trial.run.pocketed), {id_ for id_ in ids if id_}
    words = f"{sorted(found) or 'nothing'} pocketed, not {sorted(expected) or 'nothing'}"
    return wrong("pocketed", words, found != expected)


@claim
def stay_inside_when_driven(trial: Trial, frames: int) -> Measure | None:
    """Measure how far balls get beyond cushions if each frame sets their first velocities anew."""
    table, measured, run = trial.scene.table, inside(trial), trial.run
    if table is None or measured is None:
        return None
    velocity, deepest = tuple(ball.velocity for ball in trial.scene.balls), measured.value
    for _ in range(1, frames):
        try:
            run = trial.simulate(trial.scene, State(run.end.position, velocity))
        except SceneError:
            return wrong("driven", "a ball sinks into a cushion")
        points = run.at(grid(run.duration))[0]
        deepest = max(deepest, float(beyond(table, points, trial.radii).max()))
    return measured._replace(claim="driven", value=deepest, words="a ball driven {} into a cushion")


@claim
def leave_with(trial: Trial, velocities: Mapping[str, Point], slack: float = 0.0) -> Measure:
    """Measure that balls end with these velocities (m/s), up to ``slack`` (m/s)."""
    ends = dict(zip(trial.scene.index, trial.run.end.velocity, strict=True))
    return _velocity(trial, max(math.dist(ends[id_], v) for id_, v in velocities.items()), slack)


@claim
def leaves_at(trial: Trial, id_: str, speed: float) -> Measure:
    """Measure that a ball ends with this speed (m/s)."""
    end = math.hypot(*trial.run.end.velocity[trial.scene.index[id_]])
    return _velocity(trial, abs(end - speed))


@claim
def happens(trial: Trial, *kinds: str) -> Measure:
    """Measure that the run has events of these kinds, in this order."""
    found = [event.kind for event in trial.run.events]
    return wrong("events", f"{found or 'nothing'} happens, not {list(kinds)}", found != [*kinds])


@claim
def end_at(trial: Trial, places: Mapping[str, Point], slack: float = 0.0) -> Measure | None:
    """Measure that balls end at these places (m), up to ``slack`` (m), by Coulomb's law."""
    off = max(end_distances(trial.run, places).values())
    bound = min(_displaced(trial) + slack, trial.smallest)
    found = Measure("limit", off, bound, trial.smallest, "m", "{} from where balls must end")
    return found if trial.law == "coulomb" else None


@claim
def know_of_ends(trial: Trial, places: Mapping[str, Point]) -> Measure | None:
    """Measure that an exact run's figures cover its distance from these ends (m)."""
    if not trial.method.exact:
        return None
    off = max(end_distances(trial.run, places).values())
    words = "{} from where balls may end, and the run does not say so"
    said = trial.run.policy_shift + trial.run.persistent_shift
    return Measure("order", off, said, trial.smallest, "m", words)


@claim
def as_in(trial: Trial, base: Scene, scale: float = 1.0, shift: Point = (0.0, 0.0)) -> Measure:
    """Measure that everything happens as in another scene, scaled and then shifted (m)."""
    like, times = trial.of(base), trial.reference.times
    apart = longest(trial.run.at(times)[0] - (like.run.at(times)[0] * scale + shift))
    return farthest("likeness", apart, trial, "{} off the scene that it must be like", care=2.0)


@but_published
def mirrored(trial: Trial) -> Measure:
    """Measure that a scene which is symmetric about y = 0 at the start stays so."""
    start = {ball.position: k for k, ball in enumerate(trial.scene.balls)}
    partner = [start[x, -y] for x, y in start]
    points = trial.run.at(trial.reference.times)[0]
    apart = longest(points - points[:, partner] * (1.0, -1.0))
    measured = farthest("symmetry", apart, trial, "{} from symmetric")
    # Balls are looked at by their numbers, and both of a pair may be as far off as the run says.
    return measured._replace(bound=max(measured.bound, 6.0 * trial.run.persistent_shift))


@but_published
def on_the_diagonal(trial: Trial) -> Measure:
    """Measure that a ball that comes along the diagonal x = y of a square stays on it."""
    points = trial.run.at(trial.times)[0]
    off = float(np.abs(points[..., 0] - points[..., 1]).max())
    return Measure("symmetry", off, _displaced(trial), trial.smallest, "m", "{} from symmetric")


@but_published
def all_as_far(trial: Trial) -> Measure:
    """Measure that balls come to the origin and leave it alike; one that was there stays."""
    points = trial.run.at(trial.times)[0]
    far = np.hypot(points[..., 0], points[..., 1])
    comes = far[0] > 0.0
    off = max(float(np.ptp(far[:, comes], axis=1).max()), float(far[:, ~comes].max(initial=0.0)))
    bound = _share(trial) * trial.reference.extent
    return Measure("symmetry", off, bound, trial.smallest, "m", "{} from symmetric")


def _velocity(trial: Trial, off: float, slack: float = 0.0) -> Measure:
    bound = _share(trial) * trial.fastest + slack
    return Measure("velocity", off, bound, trial.fastest, "m/s", "a velocity is {} off")


def _share(trial: Trial) -> float:
    """Return through which angle (rad, at most 1) rounding or lateness may turn normals."""
    return min(_displaced(trial) / trial.smallest, 1.0)


def _displaced(trial: Trial) -> float:
    """Return how far (m) rounding or lateness may displace the contacts of a short run."""
    return CARE * (trial.contacts + 1) * trial.rounding + trial.late
