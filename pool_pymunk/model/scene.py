"""What is on the table: frozen objects in SI units, checked when they are made.

A :class:`Scene` holds everything a solver may know. What a scene leaves out (a table, surface
friction, a second ball) is physics that no solver computes.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, overload

from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import NEAREST, Ball, Friction, Physics, Pocket, Restitution, Shot
from pool_pymunk.model.places import SUNK, place_problems, placed
from pool_pymunk.model.plain import make_plain, one, optional, row, text
from pool_pymunk.model.problems import (
    LEFT_OUT,
    Point,
    Problem,
    key_of,
    listed,
    raise_any,
)
from pool_pymunk.model.state import State, read_state
from pool_pymunk.model.units import Units
from pool_pymunk.physics.contact import Pair
from pool_pymunk.physics.surface import Sliding


@dataclass(frozen=True)
class Scene:
    """Everything a solver may know: balls, table, pockets, materials, law, and shots to play.

    >>> scene = Scene(
    ...     balls=(Ball("C", (1.0, 1.0), 0.05, 0.2, cue=True), Ball("1", (2.0, 1.0), 0.05, 0.2)),
    ...     restitution=Restitution(ball_ball=0.9),
    ...     friction=Friction(surface=0.1),
    ...     shots=(Shot("straight", "C", speed=2.0, aim="nearest"),),
    ... )
    >>> round(scene.deceleration, 6), scene.index["1"], scene.start(scene.shots[0]).velocity[0]
    (0.980665, 1, (2.0, 0.0))
    """

    balls: tuple[Ball, ...]
    table: Table | None = None
    restitution: Restitution = field(default_factory=Restitution)
    friction: Friction = field(default_factory=Friction)
    physics: Physics = field(default_factory=Physics)
    shots: tuple[Shot, ...] = ()
    title: str = ""
    units: Units = field(default_factory=Units)
    pockets: tuple[Pocket, ...] = ()

    def __post_init__(self) -> None:
        make_plain(
            self, balls=row(Ball), table=optional(one(Table)), restitution=one(Restitution),
            friction=one(Friction), physics=one(Physics), shots=row(Shot), title=text,
            units=one(Units), pockets=row(Pocket),
        )  # fmt: skip
        raise_any(self._problems())

    def __repr__(self) -> str:
        return (
            f"<Scene {self.title!r}: balls {listed(self.index)}; {self._ground()}; "
            f"law {self.physics.law}; shots {listed([shot.name for shot in self.shots]) or 'none'}>"
        )

    def _repr_html_(self) -> str:
        """Return what a notebook shows: a picture of the table as it is set up."""
        from pool_pymunk.page import scene_in_notebook

        return scene_in_notebook(self)

    def _ground(self) -> str:
        count = len(self.pockets)
        holes = f" and {count} pocket{'s' * (count > 1)}" if count else ""
        if self.table is None:
            return f"an open plane{holes}"
        x0, y0, x1, y1 = self.table.bounds
        cushions = f"{len(self.table.edges)} cushions{holes}"
        return f"a table of {x1 - x0:g} x {y1 - y0:g} m with {cushions}"

    def _problems(self) -> Iterator[Problem]:
        balls, shots = dict(enumerate(self.balls)), dict(enumerate(self.shots))
        cues = [k for k, ball in balls.items() if ball.cue]
        moves = bool(shots) or any(ball.velocity != (0.0, 0.0) for ball in self.balls)
        if not self.balls:
            yield Problem("balls", LEFT_OUT, "one ball or more is wanted")
        yield from id_problems({k: ball.id for k, ball in balls.items()}, cues)
        yield from repeated("pockets", "id", {k: hole.id for k, hole in enumerate(self.pockets)})
        yield from place_problems(balls, self.table, self.pockets)
        yield from shot_problems(shots, [ball.id for ball in self.balls])
        yield from restitution_needs(self.restitution, self.table is not None, len(balls), cues)
        yield from rest_needs(self.friction, self.physics, moves)

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The place of each ball's id in ``balls``."""
        return {ball.id: i for i, ball in enumerate(self.balls)}

    @property
    def diagonal(self) -> float:
        """The length (m) of the diagonal of the table's bounding box; infinite without a table."""
        if self.table is None:
            return math.inf
        xs, ys = zip(*self.table.outline, strict=True)
        return math.hypot(max(xs) - min(xs), max(ys) - min(ys))

    @property
    def surface(self) -> Sliding:
        """How balls move on the table between contacts."""
        return Sliding(self.deceleration)

    @property
    def deceleration(self) -> float:
        """What surface friction takes from a moving ball's speed, a = mu_s g (m/s^2, Eq. 10)."""
        return _deceleration(self.friction, self.physics)

    @property
    def cue(self) -> Ball | None:
        """The cue ball, where there is one."""
        return next((ball for ball in self.balls if ball.cue), None)

    def pair(self, i: int, j: int) -> Pair:
        """Masses and coefficients of a hit of ball ``i`` (A) with ball ``j`` (B)."""
        a, b = self.balls[i], self.balls[j]
        e = ball_ball_restitution(self.restitution, a.cue or b.cue)
        assert e is not None, "restitution_needs saw to it"
        return Pair(a.mass, b.mass, e, self.friction.ball_ball)

    def start(self, shot: Shot | None, before: State | None = None) -> State:
        """Return the state at the moment of a shot, from ``before`` or the scene's own.

        Balls that are off the table there stay off. Raises SceneError for a shot that strikes or
        aims at such a ball, or at one that the scene has not.
        """
        state = before or State(
            tuple(ball.position for ball in self.balls), tuple(ball.velocity for ball in self.balls)
        )
        if shot is None:
            return state
        raise_any(self._absent(shot, state.off))
        i = self.index[shot.ball]
        velocity = shot.launch or self._aimed(shot, i, state)
        return state._replace(velocity=(*state.velocity[:i], velocity, *state.velocity[i + 1 :]))

    def _absent(self, shot: Shot, off: Collection[str]) -> Iterator[Problem]:
        """Find the balls that a shot strikes or aims at, and that are not on the table."""
        for key, id_ in (("ball", shot.ball), ("aim", shot.aim)):
            if id_ in off:
                yield Problem(f"shot.{key}", id_, f"the ball is off the table before {shot.name}")
            elif id_ not in (None, NEAREST, *self.index):
                message = f"there is no such ball (there are: {listed(self.index)})"
                yield Problem(f"shot.{key}", id_, message)
        if shot.aim == NEAREST and len(off) >= len(self.balls) - 1:
            yield Problem("shot.aim", NEAREST, "every other ball is off the table")

    def _aimed(self, shot: Shot, i: int, state: State) -> Point:
        assert shot.speed is not None and shot.aim is not None
        x, y = state.position[i]
        near = shot.aim == NEAREST
        target = self.nearest(i, state.position, state.off) if near else self.index[shot.aim]
        angle = math.atan2(state.position[target][1] - y, state.position[target][0] - x)
        return (math.cos(angle) * shot.speed, math.sin(angle) * shot.speed)

    def nearest(
        self, i: int, position: Sequence[Point] | None = None, off: Collection[str] = ()
    ) -> int:
        """Return the ball whose centre is nearest to that of ball ``i`` (the first of equals).

        Balls that are ``off`` the table, by their ids, do not count.
        """
        at = position or [ball.position for ball in self.balls]
        others = (j for j in range(len(at)) if j != i and self.balls[j].id not in off)
        return min(others, key=lambda j: math.dist(at[i], at[j]))

    def state(self, value: Any) -> State:
        """Read a state that somebody made: positions, velocities, and who is off the table.

        The balls may sink into each other and into cushions by ``SUNK`` of their radii, as they do
        where runs end that find contacts late. Raises SceneError for what cannot be, with the ball.
        """
        state = read_state(value, self.index)
        there = placed(self.balls, state)
        raise_any(
            replace(problem, key=_start_key(problem.key))
            for problem in place_problems(there, self.table, self.pockets, SUNK)
        )
        return state

    @overload
    def to_toml(self) -> str: ...

    @overload
    def to_toml(self, path: str | Path) -> None: ...

    def to_toml(self, path: str | Path | None = None) -> str | None:
        """Write the scene to a scenario file, or return its text where no ``path`` is given.

        The file is in the scene's units, and every digit survives: ``load(path) == scene``. Where a
        number has no exact counterpart in these units, all numbers of the file are SI.
        """
        from pool_pymunk.model.scenario_out import scenario_text, write

        if path is None:
            return scenario_text(self)
        write(self, path)
        return None


def _start_key(key: str) -> str:
    """Name ``balls[3].position`` as a state has it."""
    return "start.position" + key.removeprefix("balls").removesuffix(".position")


def ball_ball_restitution(restitution: Restitution, with_cue: bool) -> float | None:
    """The coefficient of a hit between two balls; ``cue_ball`` defaults to ``ball_ball``."""
    if with_cue and restitution.cue_ball is not None:
        return restitution.cue_ball
    return restitution.ball_ball


def _deceleration(friction: Friction, physics: Physics) -> float:
    return friction.surface * physics.gravity


# What can be wrong between the parts of a scene. Balls and shots come with their numbers: a
# scenario file of which some are unsound is checked as far as it is sound.


def id_problems(ids: Mapping[int, str], cues: Sequence[int]) -> Iterator[Problem]:
    """Repeated ids, a second cue ball."""
    yield from repeated("balls", "id", ids)
    for k in cues[1:]:
        yield Problem(f"balls[{k}].cue", True, f"balls[{cues[0]}] is the cue ball already")


def repeated(key: str, field: str, names: Mapping[int, str]) -> Iterator[Problem]:
    """Find names that stand there twice."""
    seen: dict[str, int] = {}
    for k, name in names.items():
        if seen.setdefault(name, k) != k:
            yield Problem(
                f"{key}[{k}].{field}", name, f"is the {field} of {key}[{seen[name]}] already"
            )


def shot_problems(shots: Mapping[int, Shot], ids: Collection[str]) -> Iterator[Problem]:
    """Repeated names, unknown balls, shots that aim at nothing or go on from no shot."""
    yield from repeated("shots", "name", {k: shot.name for k, shot in shots.items()})
    known = set(ids)
    unknown = f"there is no such ball (there are: {listed(ids)})"
    for k, shot in shots.items():
        if shot.ball not in known:
            yield Problem(f"shots[{k}].ball", shot.ball, unknown)
        yield from _aim_problems(f"shots[{k}].aim", shot, known, unknown)
        for id_, end in shot.published.items():
            if id_ not in known:
                yield Problem(f"shots[{k}].published.{key_of(id_)}", list(end), unknown)
        if k == 0 and shot.from_previous:
            yield Problem("shots[0].from", "previous", "there is no shot before the first")


def _aim_problems(key: str, shot: Shot, ids: set[str], unknown: str) -> Iterator[Problem]:
    if shot.aim is None:
        return
    if shot.aim == shot.ball:
        yield Problem(key, shot.aim, "a ball cannot aim at itself")
    elif shot.aim == NEAREST and len(ids) < 2:
        yield Problem(key, shot.aim, "there is no other ball to aim at")
    elif shot.aim != NEAREST and shot.aim not in ids:
        yield Problem(key, shot.aim, unknown)


def restitution_needs(
    restitution: Restitution, has_table: bool, balls: int, cues: Sequence[int]
) -> Iterator[Problem]:
    """Coefficients of restitution that the scene needs and leaves out."""
    if has_table and restitution.cushion is None:
        yield Problem("restitution.cushion", LEFT_OUT, "is wanted where there is a table")
    plain_pairs = balls - len(cues) > 1
    cue_pairs = balls > 1 and len(cues) > 0
    if (plain_pairs and ball_ball_restitution(restitution, False) is None) or (
        cue_pairs and ball_ball_restitution(restitution, True) is None
    ):
        yield Problem("restitution.ball_ball", LEFT_OUT, "is wanted where two balls can meet")


def rest_needs(friction: Friction, physics: Physics, moves: bool) -> Iterator[Problem]:
    """A bound in time, where something moves and nothing slows it."""
    if moves and _deceleration(friction, physics) == 0.0 and physics.max_time is None:
        message = "is wanted: without surface friction and gravity the balls never come to rest"
        yield Problem("physics.max_time", LEFT_OUT, message)
