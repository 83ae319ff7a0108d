"""This module works out how the ends of an exact run depend on its inputs, to first order.

Between contacts and through them everything is differentiable in closed form, so nothing is played
again: the changes of the balls' states follow the run from event to event
(:mod:`pool_pymunk.physics.saltation`), and contact times move with them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pool_pymunk.model import Scene
from pool_pymunk.model.problems import listed, setting_error, suggestion
from pool_pymunk.physics.contact import NT, Vector, split
from pool_pymunk.physics.dual import cushion_jacobian, hit_jacobian
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.physics.motion import EPSILON, Array, slide
from pool_pymunk.physics.saltation import Contact4, State4, bounce, hit, slide_jacobian
from pool_pymunk.physics.sides import Face, Post
from pool_pymunk.results.run import Event, Run
from pool_pymunk.solvers import find_solver
from pool_pymunk.solvers.exact import walls

GRAZE = 1e-6  # A contact that closes more slowly than this share of the speeds is a graze: rounding
# has a say in whether it comes at all.
AGREE = 1e-8  # of the speeds; a velocity farther off what the law answers is a policy's
RESTITUTIONS = ("ball_ball", "cue_ball", "cushion")
FRICTIONS = ("surface", "ball_ball", "cushion")
GROUPS = ("position", "velocity", "speed", "angle", "mass", "radius", "restitution", "friction")
ROUNDED = 32  # columns of random rounding errors

Names = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Derivatives:
    """These are the derivatives of a run's ends and event times by its inputs, in SI.

    ``names`` (P) are the inputs: ``"x.C"`` and ``"y.C"`` (m), ``"vx.C"`` and ``"vy.C"`` (m/s),
    ``"mass.C"`` (kg) and ``"radius.C"`` (m) of ball C, ``"speed"`` (m/s) and ``"angle"`` (degrees)
    of the shot, ``"restitution.ball_ball"``, ``"restitution.cue_ball"``,
    ``"restitution.cushion"``, ``"friction.surface"``, ``"friction.ball_ball"`` and
    ``"friction.cushion"``. ``final`` (N, 2, P)
    are the derivatives of the ends (m by the input's unit), with N as in ``scene.balls``.
    ``velocity`` (N, 2, P) are those of the velocities at the end (m/s), and ``times`` (E, P) those
    of the times of ``run.events`` (s). An end is that at the time ``run.duration``, which is held
    fixed where balls still move then. NaN stands where no derivative exists, or none is known;
    ``warnings`` say why.
    """

    run: Run = field(repr=False)
    names: Names
    final: Array = field(repr=False)
    velocity: Array = field(repr=False)
    times: Array = field(repr=False)
    warnings: Names
    spread: _Spread = field(repr=False)

    def of(self, ball: str, name: str) -> tuple[float, float]:
        """Return the derivatives of one ball's end (x, y) by one input."""
        if name not in self.names:
            known = listed(self.names)
            raise setting_error("name", name, f"there is no such input (there are: {known})")
        dx, dy = self.final[self.run.scene.index[ball], :, self.names.index(name)]
        return float(dx), float(dy)

    def at(self, times: Sequence[float] | Array, ball: str) -> Array:
        """Return the derivatives (T, 2, P) of one ball's positions at ``times`` (s).

        A time is held fixed, and so is the end of the run, where balls still move then.

        >>> from pool_pymunk import load, simulate
        >>> found = simulate(load("report"), 3, solver="event-driven").derivatives("speed")
        >>> found.at([0.0, 0.5, 99.0], "C")[:, 0, 0].round(6).tolist()
        [0.0, -0.433013, -0.829416]
        """
        return self.spread.at_times(times, self.run.scene.index[ball])

    def amplification(self) -> dict[str, float]:
        """Return how much farther each ball's end moves at most than the starts of all balls.

        It is the largest singular value of the derivatives by the positions of all balls.
        """
        columns = [k for k, name in enumerate(self.names) if name[:2] in ("x.", "y.")]
        by_place = self.final[:, :, columns]
        sound = np.isfinite(by_place).all(axis=(1, 2))
        most = np.full(len(by_place), math.nan)
        if columns and sound.any():
            most[sound] = np.linalg.svd(by_place[sound], compute_uv=False)[:, 0]
        return {ball.id: float(m) for ball, m in zip(self.run.scene.balls, most, strict=True)}


def derivatives(run: Run, wrt: str | Sequence[str] = ("position", "velocity")) -> Derivatives:
    """Differentiate the ends of an exact run.

    ``wrt`` names inputs, such as "angle" or "restitution.cushion", or groups of them: "position"
    (the starts of all balls, with the velocities held), "velocity", "speed", "angle", "mass",
    "radius", "restitution", "friction", or "all". Raises SettingError for a run of a solver that
    is not exact, and for a law that cannot be differentiated.

    >>> from pool_pymunk import load, simulate
    >>> run = simulate(load("report"), "Simulation 3", solver="event-driven")
    >>> found = run.derivatives("speed")
    >>> [round(each, 6) for each in found.of("C", "speed")]
    [-0.829416, -0.417076]
    """
    law = _law_of(run)
    if not find_solver(run.solver).exact:
        message = "is not exact, so its runs have no exact derivatives; take event-driven or pymunk"
        raise setting_error("solver", run.solver, message)
    names = tuple(_names(run, wrt))
    spread = _Spread(run, law, _Inputs(run, names))
    spread.follow()
    final, velocity = spread.ends()
    times = np.array(spread.times).reshape(len(run.events), len(names))
    return Derivatives(run, names, final, velocity, times, tuple(spread.warnings), spread)


def rounding(run: Run) -> float:
    """Return how far (m) rounding at every contact may have moved the ends, to first order.

    Every new path begins with errors of random signs, each of one rounding error of the place and
    of the velocity. The answer is four times the root mean square of what 32 such draws do to the
    farthest ball; it is nan where a derivative does not exist.
    """
    spread = _Spread(run, _law_of(run), _Rounded(run))
    spread.follow()
    final, _ = spread.ends()
    return float(4.0 * np.sqrt((final**2).sum(axis=1).mean(axis=1)).max())


def _law_of(run: Run) -> Law:
    law = run.law_used or LAWS.get(run.law)
    if law is None:
        message = "is a law of one's own, which a run that was loaded or copied does not keep"
        raise setting_error("law", run.law, message)
    return law


# -- what is varied ------------------------------------------------------------------------------


def _names(run: Run, wrt: object) -> list[str]:
    """Return the names of the inputs that are asked for, each once."""
    asked = [wrt] if isinstance(wrt, str) else wrt
    groups = _groups(run)
    known = [name for names in groups.values() for name in names]
    if not isinstance(asked, Iterable):
        raise setting_error("wrt", wrt, f"must be names, such as {', '.join(GROUPS)}")
    found: dict[str, None] = {}
    for name in asked:
        if not isinstance(name, str) or not (name in known or name in groups or name == "all"):
            meant = suggestion(name, [*groups, *known]) if isinstance(name, str) else ""
            raise setting_error("wrt", name, f"there is no such input of this run{meant}")
        names = known if name == "all" else groups.get(name, [name])
        found |= dict.fromkeys(names)
    return list(found)


def _groups(run: Run) -> dict[str, list[str]]:
    """Return the inputs that this run has, group by group."""
    scene, ids = run.scene, [ball.id for ball in run.scene.balls]
    e = scene.restitution
    groups = {
        "position": [f"{axis}.{id_}" for id_ in ids for axis in ("x", "y")],
        "velocity": [f"{axis}.{id_}" for id_ in ids for axis in ("vx", "vy")],
        "mass": [f"mass.{id_}" for id_ in ids],
        "radius": [f"radius.{id_}" for id_ in ids],
        "restitution": [
            f"restitution.{key}" for key in RESTITUTIONS if getattr(e, key) is not None
        ],
        "friction": [f"friction.{key}" for key in FRICTIONS],
    }
    if run.shot is not None:
        groups |= {"speed": ["speed"], "angle": ["angle"]}
    return groups


class _Inputs:
    """The inputs are what is varied: each has a column in every change.

    ``start(i)`` is the change (4, P) of a ball's state at the start, and ``radius(i)``, ``mass(i)``
    and ``coefficient(name)`` are the changes (P,) of what contacts are told; None stands for none.
    """

    def __init__(self, run: Run, names: Names) -> None:
        self.run, self.count = run, len(names)
        self.column = {name: k for k, name in enumerate(names)}
        self.index = run.scene.index

    def start(self, i: int) -> Array:
        change = np.zeros((4, self.count))
        id_ = self.run.scene.balls[i].id
        for row, axis in enumerate(("x", "y", "vx", "vy")):
            column = self.column.get(f"{axis}.{id_}")
            if column is not None:
                change[row, column] = 1.0
        if self.run.shot is not None and self.run.shot.ball == id_:
            vx, vy = self.run.knots[i][0, 3:5].tolist()
            speed = math.hypot(vx, vy)
            if "speed" in self.column and speed > 0.0:
                change[2:, self.column["speed"]] = vx / speed, vy / speed
            if "angle" in self.column:
                change[2:, self.column["angle"]] = math.radians(-vy), math.radians(vx)
        return change

    def at_knot(self, change: Array, place: Vector, velocity: Vector) -> Array:
        """Return the change of a new path's start; nothing is added to it."""
        return change

    def unit(self, name: str) -> Array | None:
        """Return the change of one input itself; None if it is not varied."""
        column = self.column.get(name)
        if column is None:
            return None
        change = np.zeros(self.count)
        change[column] = 1.0
        return change

    def radius(self, i: int) -> Array | None:
        return self.unit(f"radius.{self.run.scene.balls[i].id}")

    def mass(self, i: int) -> Array | None:
        return self.unit(f"mass.{self.run.scene.balls[i].id}")


class _Rounded(_Inputs):
    """These inputs are rounding errors of random signs, in every new path."""

    def __init__(self, run: Run) -> None:
        super().__init__(run, ())
        self.count = ROUNDED
        self.random = np.random.default_rng(0)

    def start(self, i: int) -> Array:
        return np.zeros((4, ROUNDED))

    def at_knot(self, change: Array, place: Vector, velocity: Vector) -> Array:
        far, fast = (EPSILON * (abs(x) + abs(y)) for x, y in (place, velocity))
        signs = self.random.choice((-1.0, 1.0), size=(4, ROUNDED))
        return np.asarray(change + np.array([[far], [far], [fast], [fast]]) * signs)


# -- following the run -----------------------------------------------------------------------------


class _Spread:
    """A spread follows the changes of all balls' states from event to event.

    ``change[i]`` (4, P) is how ball i's state at its last knot depends on the inputs, at the fixed
    time of that knot. ``kept[i]`` has the numbers of the knots it came to, and the changes there.
    """

    def __init__(self, run: Run, law: Law, inputs: _Inputs) -> None:
        self.run, self.law, self.inputs = run, law, inputs
        self.scene: Scene = run.scene
        self.deceleration = self.scene.deceleration
        self.drag = self._times(inputs.unit("friction.surface"), self.scene.physics.gravity)
        self.walls = walls(self.scene)
        self.knots = [knots.tolist() for knots in run.knots]
        self.at = [0] * len(self.knots)  # the number of each ball's last knot
        self.change = [inputs.start(i) for i in range(len(self.knots))]
        self.kept = [[(0, change)] for change in self.change]
        self.times: list[Array] = []
        self.warnings: dict[str, None] = {}

    @staticmethod
    def _times(change: Array | None, factor: float) -> Array | None:
        return None if change is None else change * factor

    def follow(self) -> None:
        """Go through the events of the run; raise SettingError for a law without derivatives."""
        try:
            self._follow()
        except TypeError as error:
            if "dual number" not in str(error):
                raise
            message = "cannot be differentiated: it may use + - * /, abs, min, max, and comparisons"
            raise setting_error("law", self.law.name, message) from None

    def _follow(self) -> None:
        for k, event in enumerate(self.run.events):
            balls = [self.scene.index[id_] for id_ in event.balls]
            if self._shares_a_ball(k):
                self._lose(balls, event, "contacts of one instant share a ball")
            elif event.kind == "stop":
                self._stop(balls[0], event)
            elif event.pocket is not None:
                self._fall(balls[0], event)
            else:
                self._contact(balls, event)
            for i in balls:
                self.kept[i].append((self.at[i], self.change[i]))

    def ends(self) -> tuple[Array, Array]:
        """Return the changes of the ends and of the velocities there, (N, 2, P) each."""
        t = self.run.duration
        changes = []
        for i, knots in enumerate(self.knots):
            if self.at[i] + 1 < len(knots) and knots[self.at[i] + 1][0] < t:
                self.change[i] = np.full_like(self.change[i], math.nan)
                self._warn("a contact lasts", knots[self.at[i] + 1][0])
            changes.append(self._moved(i, t)[1])
        found = np.array(changes).reshape(len(self.knots), 4, self.inputs.count)
        return found[:, :2], found[:, 2:]

    def at_times(self, times: Sequence[float] | Array, i: int) -> Array:
        """Return the changes (T, 2, P) of a ball's place at these times."""
        knots, kept = self.knots[i], self.kept[i]
        begun = [knots[k][0] for k, _ in kept]
        changes = []
        for time in times:
            t = min(max(float(time), 0.0), self.run.duration)
            k, change = kept[max(bisect_right(begun, t) - 1, 0)]
            if k + 1 < len(knots) and knots[k + 1][0] < t:  # Nothing is known of what began there.
                change = np.full_like(change, math.nan)
            changes.append(self._slid(knots[k], change, t)[1][:2])
        return np.array(changes).reshape(len(changes), 2, self.inputs.count)

    # -- events ------------------------------------------------------------------------------------

    def _shares_a_ball(self, k: int) -> bool:
        """Tell whether a contact has a ball in common with another contact of its instant."""
        event, events = self.run.events[k], self.run.events
        if not event.is_contact:
            return False
        beside = [
            events[j]
            for way in (-1, 1)
            for j in self._same_instant(k, way)
            if events[j].is_contact or j < k
        ]
        return any(set(event.balls) & set(other.balls) for other in beside)

    def _same_instant(self, k: int, way: int) -> Iterable[int]:
        events = self.run.events
        j = k + way
        while 0 <= j < len(events) and events[j].t == events[k].t:
            yield j
            j += way

    def _contact(self, balls: list[int], event: Event) -> None:
        """Follow the changes through a hit, or lose them where it has no derivative."""
        if not all(self._is_next(i, event.t) for i in balls):
            self._lose(balls, event, "a contact lasts, or is answered by a policy")
            return
        moved = [self._moved(i, event.t) for i in balls]
        states = [state for state, _ in moved]
        change = np.concatenate([each for _, each in moved])
        after = [(knot[3], knot[4]) for knot in (self.knots[i][self.at[i] + 1] for i in balls)]
        if len(balls) == 2:
            found, gap, told = self._hit(balls, states, change, after)
        else:
            found, gap, told = self._bounce(balls[0], states[0], change, after[0], event)
        if isinstance(found, str):
            self._lose(balls, event, found)
            return
        times = found.times(change, gap)
        change = found.after(change, times, told)
        self.times.append(times)
        for n, i in enumerate(balls):
            self._set(i, change[4 * n : 4 * n + 4])

    def _hit(
        self, balls: list[int], states: list[State4], change: Array, after: list[Vector]
    ) -> tuple[Contact4 | str, Array | float, Array | None]:
        (i, j), (a, b) = balls, states
        dx, dy = b[0] - a[0], b[1] - a[1]
        distance = math.sqrt(dx * dx + dy * dy)
        normal = (dx / distance, dy / distance)
        va, vb = split(a[2:], normal), split(b[2:], normal)
        pair = self.scene.pair(i, j)
        fastest = max(map(abs, (*a[2:], *b[2:])))
        if va.n - vb.n <= GRAZE * fastest:
            return "a contact is a graze", 0.0, None
        free = [bool(change[row : row + 2].any()) for row in (2, 6)]
        law = hit_jacobian(self.law, va, vb, pair, free)
        if law is None:
            return f"law {self.law.name} jumps or has a kink", 0.0, None
        if not self._agrees(after, self.law.ball_ball(va, vb, pair), normal, fastest):
            return "a contact is answered by a policy", 0.0, None
        told = self._told([self.inputs.mass(i), self.inputs.mass(j), *self._of_pair(i, j)])
        found = hit(a, b, (after[0], after[1]), law, self.deceleration)
        return found, self._gap(i, j), told

    def _bounce(
        self, i: int, state: State4, change: Array, after: Vector, event: Event
    ) -> tuple[Contact4 | str, Array | float, Array | None]:
        assert event.cushion is not None
        x, y, vx, vy = state
        wall = self.walls[event.cushion]
        side = wall.nearest(x, y, self.scene.balls[i].radius)
        assert isinstance(side, Face | Post)
        normal = side.normal(x, y)
        v = split((vx, vy), normal)
        fastest = max(abs(vx), abs(vy))
        if -v.n <= GRAZE * fastest:
            return "a contact is a graze", 0.0, None
        law = cushion_jacobian(self.law, v, wall.restitution, wall.friction)
        if law is None:
            return f"law {self.law.name} jumps or has a kink", 0.0, None
        if not self._agrees(
            [after], [self.law.cushion(v, wall.restitution, wall.friction)], normal, fastest
        ):
            return "a contact is answered by a policy", 0.0, None
        inputs = self.inputs
        told = self._told([inputs.unit("restitution.cushion"), inputs.unit("friction.cushion")])
        found = bounce(state, after, normal, side.curvature(x, y), law, self.deceleration)
        return found, self._gap(i), told

    def _of_pair(self, i: int, j: int) -> tuple[Array | None, Array | None]:
        """Return the changes of the restitution and the friction of two balls' hits."""
        balls = self.scene.balls
        with_cue = balls[i].cue or balls[j].cue
        of_cue = with_cue and self.scene.restitution.cue_ball is not None
        name = "restitution.cue_ball" if of_cue else "restitution.ball_ball"
        return self.inputs.unit(name), self.inputs.unit("friction.ball_ball")

    def _told(self, changes: Sequence[Array | None]) -> Array | None:
        """Return the changes (rows, P) of what a law is told; None if there are none."""
        if all(change is None for change in changes):
            return None
        zero = np.zeros(self.inputs.count)
        return np.array([zero if change is None else change for change in changes])

    def _gap(self, *balls: int) -> Array | float:
        """Return the change of the gap by the radii: it shrinks as they grow."""
        radii = [change for i in balls if (change := self.inputs.radius(i)) is not None]
        return -np.sum(radii, axis=0) if radii else 0.0

    def _agrees(
        self, after: Sequence[Vector], answer: Sequence[NT], normal: Vector, fastest: float
    ) -> bool:
        """Tell whether the run went on with what the law answers."""
        return all(
            max(abs(a - b) for a, b in zip(split(v, normal), its, strict=True)) <= AGREE * fastest
            for v, its in zip(after, answer, strict=True)
        )

    def _stop(self, i: int, event: Event) -> None:
        """Follow a ball to rest: t_stop = t + v / a."""
        knots, k = self.knots[i], self.at[i]
        vx, vy = knots[k][3:]
        speed = math.sqrt(vx * vx + vy * vy)
        change = self.change[i]
        if speed == 0.0:  # A contact has stopped it.
            self._warn("a ball stops at contact, so the time of its stop has a kink", event.t)
            self.times.append(np.full(self.inputs.count, math.nan))
        elif not self._is_next(i, event.t):
            self._lose([i], event, "a contact lasts, or is answered by a policy")
            return
        else:
            times = (vx * change[2] + vy * change[3]) / (speed * self.deceleration)
            if self.drag is not None:
                times = times - self.drag * speed / self.deceleration**2
            self.times.append(np.asarray(times))
            change = self._moved(i, event.t)[1]
            change[2:] = 0.0
        while self.at[i] + 1 < len(knots) and knots[self.at[i] + 1][0] == event.t:
            self.at[i] += 1
        self.change[i] = change

    def _fall(self, i: int, event: Event) -> None:
        """Follow a ball into its pocket, where it stays."""
        pocket = next(hole for hole in self.scene.pockets if hole.id == event.pocket)
        (x, y, vx, vy), change = self._moved(i, event.t)
        nx, ny = (x - pocket.position[0]) / pocket.radius, (y - pocket.position[1]) / pocket.radius
        closing = -(vx * nx + vy * ny)
        if closing <= GRAZE * max(abs(vx), abs(vy)) or not self._is_next(i, event.t):
            self._lose([i], event, "a ball grazes the rim of a pocket")
        else:
            self.times.append(np.asarray((nx * change[0] + ny * change[1]) / closing))
        self.at[i] = len(self.knots[i]) - 1
        self.change[i] = np.zeros_like(change)

    # -- states ------------------------------------------------------------------------------------

    def _is_next(self, i: int, t: float) -> bool:
        """Tell whether the ball's next knot is at this time."""
        knots, k = self.knots[i], self.at[i] + 1
        return k < len(knots) and knots[k][0] == t

    def _moved(self, i: int, t: float) -> tuple[State4, Array]:
        """Return a ball's state at the time t, and how it depends on the inputs."""
        return self._slid(self.knots[i][self.at[i]], self.change[i], t)

    def _slid(self, knot: Sequence[float], change: Array, t: float) -> tuple[State4, Array]:
        """Return the state at the time t of a ball that slides on from a knot, and its change."""
        t0, x, y, vx, vy = knot
        speed = math.sqrt(vx * vx + vy * vy)
        time = t - t0
        if self.deceleration > 0.0:
            time = min(time, speed / self.deceleration)
        by_state, by_drag = slide_jacobian(vx, vy, self.deceleration, time)
        moved = by_state @ change
        if self.drag is not None:
            moved += by_drag[:, np.newaxis] * self.drag
        return slide(x, y, vx, vy, self.deceleration, time), moved

    def _set(self, i: int, change: Array) -> None:
        """Begin a new path with this change."""
        self.at[i] += 1
        _, x, y, vx, vy = self.knots[i][self.at[i]]
        self.change[i] = self.inputs.at_knot(change, (x, y), (vx, vy))

    def _lose(self, balls: list[int], event: Event, why: str) -> None:
        """Note that what happens to these balls has no derivative."""
        self._warn(why, event.t)
        self.times.append(np.full(self.inputs.count, math.nan))
        for i in balls:
            self.change[i] = np.full_like(self.change[i], math.nan)
            knots = self.knots[i]
            while self.at[i] + 1 < len(knots) and knots[self.at[i] + 1][0] <= event.t:
                self.at[i] += 1

    def _warn(self, why: str, t: float) -> None:
        self.warnings[f"{why} (at {t:.6g} s): what hangs on it has no derivative, and is NaN"] = (
            None
        )
