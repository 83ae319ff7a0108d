"""This module writes a run's log in the form of Listing 1, and compares it with published ends."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pool_pymunk.laws import LAWS
from pool_pymunk.model import Point, Scene, Table, Units
from pool_pymunk.model.places import room_beside
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.scenario import load
from pool_pymunk.results.run import FIGURES, STATUSES, Run
from pool_pymunk.results.words import counted

QUICK = 1.0  # s; of longer runs rounding is not measured, because that may take further runs
# What is outside of these bounds is implausible. kg/m^3: polystyrene foam has some 15, and the
# densest metal, osmium, 22,600; as spheres, flat discs seem lighter than they are. m: a toy, and a
# curling sheet of 45.7. m/s: the fastest golf balls have some 95.
DENSITY, TABLE, FASTEST = (10.0, 22_600.0), (0.1, 50.0), 100.0
TOUCHED = 400  # places at each cushion and corner at which a ball is tried
ROUNDED_UP = 1.0 + 1e-9  # A pocket that a centre just reaches may seem smaller by rounding.
DECIMALS = {"m": 4, "cm": 2, "mm": 1, "in": 2}  # of lengths: tenths of a millimetre, except inches


def opening(scene: Scene) -> Iterator[str]:
    """Yield the first lines of Listing 1: the ball closest to the cue ball, and its attitude."""
    if scene.title:
        yield scene.title
        yield ""
    if scene.cue is not None and len(scene.balls) > 1:
        closest = scene.balls[scene.nearest(scene.index[scene.cue.id])]
        (x, y), (x0, y0) = closest.position, scene.cue.position
        yield f"Closest ball to Cue ball: Ball {closest.id:>2s}"
        yield f"Attitude to closest ball: {math.degrees(math.atan2(y - y0, x - x0)):7.3f} deg"
        yield ""


class Others(NamedTuple):
    """The ends (m) of a shot's balls as an earlier run has written them into a folder."""

    folder: str
    ends: Mapping[str, Point]


def shot_lines(run: Run, others: Others | None = None) -> Iterator[str]:
    """Yield a shot's velocity, where each ball ended, and how far that is from published ends.

    Where ``others`` are given, only ends that differ from them are listed.
    """
    yield _heading(run)
    yield from _ends(run) if others is None else _differences(run, others)
    if run.shot and run.shot.published:
        yield f"    {Agreement.of(run).sentence(run)}"
    contacts = sum(event.is_contact for event in run.events)
    yield (
        f"    {STATUSES[run.status].capitalize()} at {run.duration:.4f} s; "
        f"{counted(contacts, 'contact')}"
    )
    for warning in run.warnings:
        yield f"    Warning: {warning}"
    for doubt in doubts(run):
        yield f"    {doubt}"
    yield ""


def _ends(run: Run) -> Iterator[str]:
    """Yield the end of each ball that moved, or should have; the others have a line in common."""
    units, agreement = run.scene.units, Agreement.of(run)
    published = run.shot.published if run.shot else {}
    yield "    Final Ball positions [X,Y]:" + ("                 Published:" if published else "")
    off = [id_ for id_ in run.final if id_ in run.off and id_ not in run.pocketed]
    missed = published.keys() - agreement.agreeing
    moved = {
        id_ for id_, rows in zip(run.final, run.knots, strict=True)
        if np.ptp(rows[:, 1:5], axis=0).any() or rows[0, 3:5].any()
    }  # fmt: skip
    rests = [id_ for id_ in run.final if id_ not in {*moved, *off, *missed}]
    for ball, end in run.final.items():
        if ball in off or ball in rests:
            continue
        line = f"    Ball {ball:>2s}: {_pair(run, end)} ({units.length})"
        if ball in published:
            mark = f"   off by {_far(run, end, published[ball])}" if ball in missed else ""
            line += f"   {_pair(run, published[ball])}{mark}"
        if ball in run.pocketed:
            line += f"   in pocket {run.pocketed[ball]}"
        yield line
    for those, said in ((rests, "did not move"), (off, "off the table")):
        if those:
            yield f"    Ball{'s' * (len(those) > 1)} {', '.join(those)}: {said}"


def _differences(run: Run, others: Others) -> Iterator[str]:
    """Yield the ends that differ from others in the log's digits, and how many do not."""
    unit = run.scene.units.length
    differ = {i: p for i, p in run.final.items() if _pair(run, p) != _pair(run, others.ends[i])}
    if differ:
        yield f"    Ends that differ from those in {others.folder}:"
    for ball, end in differ.items():
        far = f"{_far(run, end, others.ends[ball], more=1)} from there"
        yield f"    Ball {ball:>2s}: {_pair(run, end)} ({unit})   {far}"
    if same := len(run.final) - len(differ):
        which = f"The other {same}" if differ else f"All {same} ends in {others.folder}"
        yield f"    {which} are the same to {_last_digit(run)} {unit}"


def ends_in(folder: Path, name: str, scene: Scene) -> Others:
    """Read a shot's ends from what a run has written; ``name`` is that of the file.

    Raises SettingError if there is no such file, or if it has other balls.
    """
    try:
        with np.load(folder / name) as file:
            ends = dict(zip(file["balls"].tolist(), file["position"][-1].tolist(), strict=True))
    except (OSError, ValueError, KeyError) as error:
        message = f"{name} is missing there, or no run has written it"
        raise setting_error("against", str(folder), message) from error
    if ends.keys() != scene.index.keys():
        raise setting_error("against", str(folder), f"{name} has other balls")
    return Others(str(folder), {id_: (x, y) for id_, (x, y) in ends.items()})


def doubts(run: Run) -> Iterator[str]:
    """Yield how far policies, rounding and contacts that persist may have moved the ends.

    Rounding is not spoken of if printed digits do not show it.
    """
    if run.again is None:
        return
    units = run.scene.units
    shift = units.from_si(run.policy_shift, "length") if run.policies else 0.0
    if shift > 0.0 and run.known_shift is None:  # Otherwise a warning says it.
        why, far = ", ".join(sorted(run.policies)), f"{shift:.2g} {units.length}"
        yield (
            f"Some contacts have no exact answer ({why}). With other answers the ends may lie "
            f"up to {far} elsewhere"
        )
    if run.wall_time > QUICK:
        yield (
            f"Rounding was not measured, since that may take four runs of {run.wall_time:.2g} s; "
            "in Python, run.rounding measures it"
        )
        return
    if units.from_si(run.rounding, "length") >= 0.5 * 10.0 ** -_decimals(run):
        yield f"Rounding may have moved the ends by up to {units.text(run.rounding)}"
    if run.persistent:
        far = units.text(run.persistent_shift)
        yield f"Contacts that persist may have moved the ends by up to {far}"


def figures(run: Run) -> dict[str, float | None]:
    """Return for the JSON how far (m) the ends may be off; None is what was not measured."""
    if run.again is None or run.wall_time > QUICK:
        return dict.fromkeys(FIGURES)
    found = {name: getattr(run, name) for name in FIGURES}
    return {name: figure if math.isfinite(figure) else None for name, figure in found.items()}


def closing(runs: Sequence[Run]) -> Iterator[str]:
    """Yield the last line: how many published ends were reproduced, over all shots."""
    found = [Agreement.of(run) for run in runs if run.shot and run.shot.published]
    if found:
        counts, total = [len(one.agreeing) for one in found], sum(one.count for one in found)
        parts = f" ({' + '.join(map(str, counts))})" if len(counts) > 1 else ""
        yield f"Published ends: {sum(counts)} of {total} agree to {_last_digit(runs[0])}{parts}"


def is_of_the_report(run: Run) -> bool:
    """Tell whether a run is one of the report's own shots, with nothing changed."""
    report = load("report")
    return run.scene == report and run.shot in report.shots and run.law == report.physics.law


@dataclass(frozen=True)
class Agreement:
    """An agreement tells which of ``count`` ends agree with the published ones in every digit."""

    agreeing: tuple[str, ...]
    count: int
    farthest: str  # the ball that is farthest off
    largest: float  # m; how far that is

    @classmethod
    def of(cls, run: Run) -> Agreement:
        """Compare a run with its shot's published ends."""
        published: Mapping[str, Point] = run.shot.published if run.shot else {}
        off = {id_: math.dist(run.final[id_], end) for id_, end in published.items()}
        same = (id_ for id_, b in published.items() if _pair(run, run.final[id_]) == _pair(run, b))
        farthest = max(off, key=lambda id_: off[id_], default="")
        return cls(tuple(same), len(published), farthest, off.get(farthest, 0.0))

    def sentence(self, run: Run) -> str:
        """Return the comparison in words, in the scenario's units."""
        units = run.scene.units
        text = (
            f"{len(self.agreeing)} of {self.count} agree with the published ends to "
            f"{_last_digit(run)} {units.length}; the farthest is ball {self.farthest}, "
            f"{units.from_si(self.largest, 'length'):.2g} {units.length} off"
        )
        is_far = any(b.id == self.farthest and self.largest > b.radius for b in run.scene.balls)
        if is_far and run.shot not in load("report").shots:
            text += "; if you have changed the shot, delete its `published`"
        return text

    def as_dict(self) -> dict[str, object]:
        """Return the comparison for the JSON; ``largest`` is in m."""
        return {"agree": len(self.agreeing), "of": self.count, "largest": self.largest}


def _heading(run: Run) -> str:
    if run.shot is None:
        return f"{run.name}:"
    i, unit = run.scene.index[run.shot.ball], run.scene.units.speed
    vx, vy = (run.scene.units.from_si(v, "speed") for v in run.knots[i][0, 3:5])
    name = "Cue" if run.scene.balls[i].cue else f"Ball {run.shot.ball}"
    return f"{run.name}: {name} velocity = [{vx:6.3f},{vy:6.3f}] ({unit})"


def _pair(run: Run, point: Point) -> str:
    """Return a place in the log's digits; zero has no sign."""
    x, y = (run.scene.units.from_si(value, "length") for value in point)
    form = f"z{_decimals(run) + 3}.{_decimals(run)}f"
    return f"[{x:{form}}, {y:{form}}]"


def _far(run: Run, one: Point, other: Point, more: int = 0) -> str:
    """Return a distance in the log's digits or ``more``; if two figures are not seen, in those."""
    far, decimals = run.scene.units.from_si(math.dist(one, other), "length"), _decimals(run) + more
    return f"{far:.{decimals}f}" if far >= 9.5 * 10.0**-decimals else f"{far:#.2g}"


def _decimals(run: Run) -> int:
    """Return how many decimals a length has in the log."""
    return DECIMALS[run.scene.units.length]


def _last_digit(run: Run) -> str:
    """Return the unit of the last digit that the log prints, such as 0.01."""
    return f"{10.0 ** -_decimals(run):g}"


def modelled(scene: Scene) -> Iterator[str]:
    """Yield what solvers will compute for this scene, and what they will leave out."""
    count, rolling = len(scene.balls), scene.friction.rolling
    yield f"balls: {count}" + ("" if count > 1 else "; no ball-ball handler")
    if count > 1:
        slips = scene.friction.ball_ball > 0.0
        gain = "; it may gain energy" * (slips and LAWS[scene.physics.law].may_gain_energy)
        yield f"ball on ball: law {scene.physics.law}{'' if slips else ', no friction'}{gain}"
    if scene.table is None:
        yield "table: none, an open plane; no cushions"
    else:
        shape = "rectangle" if scene.table.is_rectangle else "polygon"
        friction = "" if scene.friction.cushion > 0.0 else ", no friction"
        arcs = sum(edge.bulge != 0.0 for edge in scene.table.edges)
        of_them = f" ({arcs} of them arcs)" if arcs else ""
        yield f"table: {shape} with {len(scene.table.edges)} cushions{of_them}{friction}"
    if scene.posts:
        first, last = scene.first_post, len(scene.cushions) - 1
        which = f"s {first} to {last}" if first < last else f" {last}"
        yield f"posts: {len(scene.posts)}, reported as cushion{which}"
    if scene.patches:
        yield f"patches of other friction: {len(scene.patches)}"
    if scene.pockets:
        yield f"pockets: {', '.join(pocket.id for pocket in scene.pockets)}"
    slows = f"{scene.deceleration:.6g} m/s^2" if scene.deceleration else "none; no damping callback"
    yield f"surface friction: {slows}"
    if scene.is_tilted:
        x, y = scene.tilt
        yield f"the table is tilted: balls fall at ({x:g}, {y:g}) m/s^2"
    if rolling is not None:
        slows = f"{rolling * scene.physics.gravity:.6g} m/s^2"
        yield f"rolling friction: {slows}; balls slide, then roll, without english"
    if scene.physics.max_time is not None:
        yield f"runs end after {scene.physics.max_time:g} s at the latest"
    yield f"shots: {len(scene.shots) or 'none, the scene runs as its velocities have it'}"


def magnitudes(scene: Scene) -> Iterator[str]:
    """Yield the sizes, masses, coefficients and speeds of a scene, in its units and in SI."""
    if scene.table is not None:
        x0, y0, x1, y1 = scene.table.bounds
        yield f"size over all: {_both(scene, 'length', x1 - x0, y1 - y0)}"
    for name, kind, values in (
        ("radius", "length", [ball.radius for ball in scene.balls]),
        ("mass", "mass", [ball.mass for ball in scene.balls]),
        ("fastest shot", "speed", [_fastest(scene)]),
    ):
        yield f"{name}: {_both(scene, kind, *sorted(set(values)), between=', ')}"
    for group, part in (("restitution", scene.restitution), ("friction", scene.friction)):
        given = {key: getattr(part, key) for key in part.KEYS if getattr(part, key) is not None}
        if given:
            yield f"{group}: {', '.join(f'{key} {value:g}' for key, value in given.items())}"


def odd_density(ball: str, mass: float, radius: float) -> Iterator[str]:
    """Yield what is implausible in the mass (kg) and the radius (m) of a ball."""
    density = mass / (4.0 / 3.0 * math.pi * radius**3)
    if not DENSITY[0] <= density <= DENSITY[1]:
        than = "less than a foam" if density < DENSITY[0] else "more than any metal"
        yield f"as a sphere, ball {ball} has {density:.3g} kg/m^3, {than}"


def implausible(scene: Scene) -> Iterator[str]:
    """Yield what is implausible in a scene: a unit or a digit may be wrong there.

    >>> from pool_pymunk import Ball, Restitution
    >>> list(implausible(Scene((Ball("a", (0.0, 0.0), radius=2.25, mass=160.0),))))
    ['as a sphere, ball a has 3.35 kg/m^3, less than a foam']
    """
    each = (text for ball in scene.balls for text in odd_density(ball.id, ball.mass, ball.radius))
    yield from islice(each, 1)
    if scene.table is not None:
        x0, y0, x1, y1 = scene.table.bounds
        length = max(x1 - x0, y1 - y0)
        if not TABLE[0] <= length <= TABLE[1]:
            yield f"the table is {length:.3g} m long"
    if _fastest(scene) > FASTEST:
        yield f"a ball starts with {_fastest(scene):.3g} m/s"
    yield from unreached(scene)
    yield from beside_table(scene)


def beside_table(scene: Scene) -> Iterator[str]:
    """Yield the patches that lie beside the table, in which no ball can be."""
    if scene.table is None:
        return
    x0, y0, x1, y1 = scene.table.bounds
    for k, patch in enumerate(scene.patches):
        (x, y), r = patch.center or (0.0, 0.0), patch.radius or 0.0
        corners = patch.corners or ((x - r, y - r), (x + r, y + r))
        xs, ys = zip(*corners, strict=True)
        if max(xs) <= x0 or min(xs) >= x1 or max(ys) <= y0 or min(ys) >= y1:
            yield f"patch {k} lies beside the table, so that no ball comes to it"


def unreached(scene: Scene) -> Iterator[str]:
    """Yield the pockets that no ball can reach because of the cushions."""
    if scene.table is None:
        return
    r = min(ball.radius for ball in scene.balls)
    for pocket in scene.pockets:
        far, error = _nearest_centre(scene.table, pocket.position, r)
        if far - error > pocket.radius * ROUNDED_UP:
            least, radius = (scene.units.text(length, ".3g") for length in (far, pocket.radius))
            yield (
                f"no ball can reach pocket {pocket.id}: cushions keep every centre {least} away, "
                f"and its radius is {radius}"
            )


def _nearest_centre(table: Table, place: Point, r: float) -> tuple[float, float]:
    """Return how near (m) to a place the centre of a ball of radius ``r`` can be, and an error.

    Any table but a rectangle is asked where a ball touches a cushion or a corner, at many places.

    >>> far, error = _nearest_centre(Table.circle(1.0), (2.0, 1.0), 0.1)
    >>> abs(far - 0.1) <= error < 0.01
    True
    """
    if table.is_rectangle:
        x0, y0, x1, y1 = table.bounds
        nearest = np.clip(place, (x0 + r, y0 + r), (x1 - r, y1 - r))
        return math.dist(nearest, place), 0.0
    shares, turns = np.linspace(0.0, 1.0, TOUCHED), np.linspace(0.0, math.tau, TOUCHED)
    feet = [edge.at(share) for edge in table.edges for share in shares.tolist()]
    corners = [table.outline[k] for k in table.reflex_corners]
    feet += [(at, (math.cos(t), math.sin(t))) for at in corners for t in turns.tolist()]
    touching = [(x + r * nx, y + r * ny) for (x, y), (nx, ny) in feet]
    near = sorted((math.dist(one, place), one) for one in [place, *touching])
    far = next((far for far, one in near if _fits(table, one, r)), math.inf)
    return far, max(r, *(edge.arc_length for edge in table.edges)) / TOUCHED


def _fits(table: Table, place: Point, r: float) -> bool:
    """Tell whether a ball of radius ``r`` can lie at a place on a table."""
    rooms = (room_beside(wall.sides, *place, r) for wall in table.walls)
    return table.contains(*place) and all(room >= -1e-9 * r for room in rooms)


def _fastest(scene: Scene) -> float:
    """Return the highest speed (m/s) of a ball at the start of the scene or of a shot."""
    velocities = [ball.velocity for ball in scene.balls]
    velocities += [shot.launch or (shot.speed or 0.0, 0.0) for shot in scene.shots]
    return max(math.hypot(*velocity) for velocity in velocities)


def _both(scene: Scene, kind: str, *values: float, between: str = " x ") -> str:
    """Return values in the scene's units, and in SI behind them where that is another unit."""
    own, si = getattr(scene.units, kind), getattr(Units(), kind)
    said = f"{between.join(f'{scene.units.from_si(value, kind):.6g}' for value in values)} {own}"
    return said if own == si else f"{said} ({between.join(f'{v:.6g}' for v in values)} {si})"
