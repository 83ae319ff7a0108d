"""This module writes a run's log in the form of Listing 1, and compares it with published ends."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from pool_pymunk.model import Point, Scene
from pool_pymunk.model.scenario import load
from pool_pymunk.physics.laws import LAWS
from pool_pymunk.results.run import STATUSES, Run
from pool_pymunk.results.words import counted

QUICK = 1.0  # s
DECIMALS = {"m": 4, "cm": 2, "mm": 1, "in": 2}  # of lengths: tenths of a millimetre, except inches


def opening(scene: Scene) -> Iterator[str]:
    """Yield the first lines of Listing 1: the ball closest to the cue ball, and its attitude."""
    if scene.title:
        yield scene.title
        yield ""
    if scene.cue is None or len(scene.balls) < 2:
        return
    cue = scene.index[scene.cue.id]
    closest = scene.balls[scene.nearest(cue)]
    (x, y), (x0, y0) = closest.position, scene.cue.position
    yield f"Closest ball to Cue ball: Ball {closest.id:>2s}"
    yield f"Attitude to closest ball: {math.degrees(math.atan2(y - y0, x - x0)):7.3f} deg"
    yield ""


def shot_lines(run: Run) -> Iterator[str]:
    """Yield a shot's velocity, where each ball ended, and how that compares with the published."""
    unit = run.scene.units.length
    yield _heading(run)
    published = run.shot.published if run.shot else {}
    agreement = Agreement.of(run)
    yield "    Final Ball positions [X,Y]:" + ("                 Published:" if published else "")
    for ball in run.scene.balls:
        line = f"    Ball {ball.id:>2s}: {_pair(run, run.final[ball.id])} ({unit})"
        if ball.id in published:
            off = run.scene.units.from_si(
                math.dist(run.final[ball.id], published[ball.id]), "length"
            )
            mark = "" if ball.id in agreement.agreeing else f"   off by {off:.{_decimals(run)}f}"
            line += f"   {_pair(run, published[ball.id])}{mark}"
        if ball.id in run.pocketed:
            line += f"   in pocket {run.pocketed[ball.id]}"
        elif ball.id in run.off:
            line += "   off the table"
        yield line
    if published:
        yield f"    {agreement.sentence(run)}"
    contacts = sum(event.is_contact for event in run.events)
    yield (
        f"    {STATUSES[run.status].capitalize()} at {run.duration:.4f} s; "
        f"{counted(contacts, 'contact')}; {counted(run.steps, 'step')} in {run.wall_time:.3g} s"
    )
    for warning in run.warnings:
        yield f"    Warning: {warning}"
    yield from _doubts(run)
    yield ""


def _doubts(run: Run) -> Iterator[str]:
    """Yield how far policies and rounding may have moved the ends, if the printed digits show it.

    Both may take further runs, so rounding is not measured where one takes more than ``QUICK``.
    """
    if run.again is None:
        return
    units = run.scene.units
    shown = 0.5 * 10.0 ** -_decimals(run)
    shift = units.from_si(run.policy_shift, "length") if run.policies else 0.0
    if shift > 0.0 and run.known_shift is None:  # Else a warning has it.
        yield (
            f"    Policies ({', '.join(sorted(run.policies))}): other answers would move the ends "
            f"by up to {shift:.2g} {units.length}"
        )
    if run.wall_time > QUICK:
        yield "    Rounding was not measured: that may take four more runs as long as this one"
        return
    rounding = units.from_si(run.rounding, "length")
    if rounding >= shown:
        yield f"    Rounding may have moved the ends by up to {rounding:.2g} {units.length}"


def closing(runs: Sequence[Run]) -> Iterator[str]:
    """Yield the last line: how many published ends were reproduced, over all shots."""
    agreements = [Agreement.of(run) for run in runs if run.shot and run.shot.published]
    if agreements:
        counts = [len(agreement.agreeing) for agreement in agreements]
        total = sum(agreement.count for agreement in agreements)
        parts = f" ({' + '.join(map(str, counts))})" if len(counts) > 1 else ""
        yield f"Published ends: {sum(counts)} of {total} agree to {_last_digit(runs[0])}{parts}"


def is_of_the_report(run: Run) -> bool:
    """Tell whether a run is one of the report's own shots, with nothing changed."""
    report = load("report")
    return run.scene == report and run.shot in report.shots and run.law == report.physics.law


@dataclass(frozen=True)
class Agreement:
    """An agreement tells which ends agree with the published ones in every printed digit.

    It also holds the largest distance.
    """

    agreeing: tuple[str, ...]
    count: int
    farthest: str
    largest: float  # m

    @classmethod
    def of(cls, run: Run) -> Agreement:
        """Compare a run with its shot's published ends."""
        published: Mapping[str, Point] = run.shot.published if run.shot else {}
        off = {id_: math.dist(run.final[id_], end) for id_, end in published.items()}
        agreeing = tuple(
            i for i in published if _pair(run, run.final[i]) == _pair(run, published[i])
        )
        farthest = max(off, key=lambda id_: off[id_], default="")
        return cls(agreeing, len(published), farthest, off.get(farthest, 0.0))

    def sentence(self, run: Run) -> str:
        """Return the comparison in words, in the scenario's units."""
        largest = run.scene.units.from_si(self.largest, "length")
        return (
            f"{len(self.agreeing)} of {self.count} agree with the published ends to "
            f"{_last_digit(run)} {run.scene.units.length}; the farthest is ball {self.farthest}, "
            f"{largest:.2g} {run.scene.units.length} off"
        )

    def as_dict(self) -> dict[str, object]:
        """Return the comparison for the JSON; ``largest`` is in m."""
        return {"agree": len(self.agreeing), "of": self.count, "largest": self.largest}


def _heading(run: Run) -> str:
    if run.shot is None:
        return f"{run.name}:"
    i = run.scene.index[run.shot.ball]
    ball = run.scene.balls[i]
    vx, vy = (run.scene.units.from_si(v, "speed") for v in run.knots[i][0, 3:5])
    name = "Cue" if ball.cue else f"Ball {ball.id}"
    return f"{run.name}: {name} velocity = [{vx:6.3f},{vy:6.3f}] ({run.scene.units.speed})"


def _pair(run: Run, point: Point) -> str:
    x, y = (run.scene.units.from_si(value, "length") + 0.0 for value in point)
    return f"[{_rounded(x, _decimals(run))}, {_rounded(y, _decimals(run))}]"


def _rounded(value: float, decimals: int) -> str:
    """Return a number with this many decimals; zero has no sign.

    >>> _rounded(3.926, 2), _rounded(-0.001, 2), _rounded(-0.00004, 4)
    (' 3.93', ' 0.00', ' 0.0000')
    """
    width = decimals + 3
    text = f"{value:{width}.{decimals}f}"
    return f"{0.0:{width}.{decimals}f}" if float(text) == 0.0 else text


def _decimals(run: Run) -> int:
    """Return how many decimals a length has in the log."""
    return DECIMALS[run.scene.units.length]


def _last_digit(run: Run) -> str:
    """Return the unit of the last digit that the log prints, such as 0.01."""
    return f"{10.0 ** -_decimals(run):g}"


def modelled(scene: Scene) -> Iterator[str]:
    """Yield what solvers will compute for this scene, and what they will leave out."""
    count = len(scene.balls)
    yield f"balls: {count}" + ("" if count > 1 else "; no ball-ball handler")
    if count > 1:
        friction = _coefficient(scene.friction.ball_ball)
        gains = friction != "no friction" and not LAWS[scene.physics.law].hits_are_coulombs
        yield (
            f"ball on ball: law {scene.physics.law}, {friction}"
            + "; this law may gain energy" * gains
        )
    if scene.table is None:
        yield "table: none, an open plane; no cushions"
    else:
        shape = "rectangle" if scene.table.is_rectangle else "polygon"
        friction = _coefficient(scene.friction.cushion)
        yield f"table: {shape} with {len(scene.table.edges)} cushions, {friction}"
    if scene.pockets:
        yield f"pockets: {', '.join(pocket.id for pocket in scene.pockets)}"
    if scene.deceleration > 0.0:
        yield f"surface friction: {scene.deceleration:.6g} m/s^2"
        if scene.friction.rolling is not None:
            slows = scene.friction.rolling * scene.physics.gravity
            yield f"friction of rolling: {slows:.6g} m/s^2"
    else:
        yield "surface friction: none; no damping callback"
    if scene.friction.rolling is not None:
        rolling = scene.friction.rolling * scene.physics.gravity
        yield f"rolling friction: {rolling:.6g} m/s^2; balls slide, then roll, without english"
    if scene.physics.max_time is not None:
        yield f"runs end after {scene.physics.max_time:g} s at the latest"
    yield f"shots: {len(scene.shots) or 'none, the scene runs as its velocities have it'}"


def _coefficient(friction: float) -> str:
    return f"friction {friction:g}" if friction > 0.0 else "no friction"
