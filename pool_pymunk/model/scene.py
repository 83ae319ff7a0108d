"""A scene is what is on the table: frozen objects in SI units, checked when they are made.

A :class:`Scene` holds everything a solver may know. What a scene leaves out (a table, surface
friction, a second ball) is physics that no solver computes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar, overload

from pool_pymunk.model.keys import Part, Text
from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import (
    NEAREST,
    Ball,
    Friction,
    Physics,
    Pocket,
    Post,
    Restitution,
    Shot,
)
from pool_pymunk.model.places import (
    METRES,
    SUNK,
    Placed,
    no_room,
    place_problems,
    placed,
    post_problems,
)
from pool_pymunk.model.problems import (
    LEFT_OUT,
    Location,
    Point,
    Problem,
    listed,
    raise_any,
    written,
)
from pool_pymunk.model.state import NO_ROLLING, State, read_state
from pool_pymunk.model.units import Units
from pool_pymunk.physics import sides
from pool_pymunk.physics.contact import Pair
from pool_pymunk.physics.surface import Rolling, Sliding

SomePart = TypeVar("SomePart")
Located = Sequence[tuple[Location, SomePart]]


@dataclass(frozen=True)
class Scene(Part):
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
    title: Text = ""
    units: Units = field(default_factory=Units)
    pockets: tuple[Pocket, ...] = ()
    posts: tuple[Post, ...] = ()

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
        counts = {"post": len(self.posts), "pocket": len(self.pockets)}
        more = [f"{count} {name}{'s' * (count > 1)}" for name, count in counts.items() if count]
        if self.table is None:
            return " with ".join(["an open plane", *filter(None, [" and ".join(more)])])
        x0, y0, x1, y1 = self.table.bounds
        has = listed([f"{len(self.table.edges)} cushions", *more]).replace(", ", " and ")
        return f"a table of {x1 - x0:g} x {y1 - y0:g} m with {has}"

    def _problems(self) -> Iterator[Problem]:
        lists: dict[str, Any] = {
            name: [((name, k), part) for k, part in enumerate(getattr(self, name))]
            for name in ("balls", "pockets", "posts", "shots")
        }
        yield from scene_problems(
            **lists, table=self.table, restitution=self.restitution, friction=self.friction,
            physics=self.physics,
        )  # fmt: skip

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The place of each ball's id in ``balls``."""
        return {ball.id: i for i, ball in enumerate(self.balls)}

    @cached_property
    def cushions(self) -> tuple[sides.Wall, ...]:
        """The walls that balls bounce off: the cushions of the table, and after them the posts."""
        own = self.restitution.cushion, self.friction.cushion
        edges = () if self.table is None else self.table.walls
        found = [sides.Wall(wall.sides, own[0] or 0.0, own[1], wall.number) for wall in edges]
        for post in self.posts:
            e, friction = (
                its if its is not None else scenes or 0.0
                for its, scenes in zip((post.restitution, post.friction), own, strict=True)
            )
            side = sides.RoundSide(post.position, post.radius)
            found.append(sides.Wall((side,), e, friction, len(found)))
        return tuple(found)

    @property
    def first_post(self) -> int:
        """The number of the first post among the cushions."""
        return 0 if self.table is None else len(self.table.edges)

    @property
    def diagonal(self) -> float:
        """The length (m) of the diagonal of the table's bounding box; infinite without a table."""
        if self.table is None:
            return math.inf
        x0, y0, x1, y1 = self.table.bounds
        return math.hypot(x1 - x0, y1 - y0)

    @cached_property
    def surface(self) -> Sliding | Rolling:
        """The surface says how balls move on the table between contacts."""
        if self.friction.rolling is None:
            return Sliding(self.deceleration)
        return Rolling(self.deceleration, self.friction.rolling * self.physics.gravity)

    @property
    def deceleration(self) -> float:
        """Surface friction takes this from a moving ball's speed, a = mu_s g (m/s^2, Eq. 10)."""
        return _deceleration(self.friction, self.physics)

    @property
    def always_rests(self) -> bool:
        """Tell whether friction brings every ball to rest."""
        return not _never_rests(self.friction, self.physics)

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

        Balls that are off the table there stay off, except for one that the shot places. Raises
        SceneError for a shot that strikes or aims at such a ball, or at one that the scene has not,
        and for a place where the ball has no room.
        """
        state = before or self._as_set_up()
        if shot is None:
            return state
        raise_any(self._absent(shot, state.off))
        i = self.index[shot.ball]
        if shot.place is not None:
            state = self._with_ball_at(i, shot.place, state)
        velocity = shot.launch or self._aimed(shot, i, state)
        state = state._replace(velocity=_with(state.velocity, i, velocity))
        if state.roll is None:
            return state
        return state._replace(roll=_with(state.roll, i, _scaled(velocity, shot.roll)))

    def _with_ball_at(self, i: int, place: Point, state: State) -> State:
        """Return the state with ball ``i`` on the table, at another place (m)."""
        ball = self.balls[i]
        others = placed(self.balls, state).values()
        here = Placed(ball.id, place, ball.radius)
        room = no_room(here, others, self.table, self.pockets, self.posts)
        raise_any(Problem("shot.place", list(place), message) for message in room)
        position = _with(state.position, i, place)
        return state._replace(position=position, off=state.off - {ball.id})

    def _as_set_up(self) -> State:
        """Return the state in which the scene's balls are before any shot."""
        places = tuple(ball.position for ball in self.balls)
        velocities = tuple(ball.velocity for ball in self.balls)
        if not self.surface.rolls:
            return State(places, velocities)
        rolls = tuple(_scaled(ball.velocity, ball.roll) for ball in self.balls)
        return State(places, velocities, frozenset(), rolls)

    def _absent(self, shot: Shot, off: Collection[str]) -> Iterator[Problem]:
        """Find the balls that a shot strikes or aims at, and that are not on the table."""
        for key, id_ in (("ball", shot.ball), ("aim", shot.aim)):
            if id_ in off and not (key == "ball" and shot.place is not None):
                yield Problem(f"shot.{key}", id_, f"the ball is off the table before {shot.name}")
            elif id_ not in (None, NEAREST, *self.index):
                message = f"there is no such ball (there are: {listed(self.index)})"
                yield Problem(f"shot.{key}", id_, message)
        if shot.aim == NEAREST and len({*off, shot.ball}) >= len(self.balls):
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
        state = read_state(value, self.index, self.surface.rolls)
        there = placed(self.balls, state)
        raise_any(
            Problem(("start", "position", problem.steps[1]), problem.value, problem.message)
            for problem in place_problems(there, self.table, self.pockets, SUNK, posts=self.posts)
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


def ball_ball_restitution(restitution: Restitution, with_cue: bool) -> float | None:
    """The coefficient of a hit between two balls; ``cue_ball`` defaults to ``ball_ball``."""
    if with_cue and restitution.cue_ball is not None:
        return restitution.cue_ball
    return restitution.ball_ball


def _deceleration(friction: Friction, physics: Physics) -> float:
    return friction.surface * physics.gravity


def _never_rests(friction: Friction, physics: Physics) -> bool:
    """Tell whether a ball that rolls, or slides where none rolls, goes on without end."""
    least = friction.surface if friction.rolling is None else friction.rolling
    return least * physics.gravity == 0.0


def _with(vectors: tuple[Point, ...], i: int, vector: Point) -> tuple[Point, ...]:
    return (*vectors[:i], vector, *vectors[i + 1 :])


def _scaled(vector: Point, share: float) -> Point:
    return (share * vector[0], share * vector[1])


# What can be wrong between the parts of a scene. Parts come with where they stand: a scenario file
# of which some are unsound is checked as far as it is sound.


def scene_problems(
    balls: Located[Ball],
    pockets: Located[Pocket],
    posts: Located[Post],
    shots: Located[Shot],
    table: Table | None,
    restitution: Restitution,
    friction: Friction,
    physics: Physics,
    *,
    has_table: bool | None = None,
    nowhere: Collection[Location] = (),
    knows_balls: bool = True,
    units: Units = METRES,
) -> Iterator[Problem]:
    """Find what is wrong between the parts of a scene; lengths are said in ``units``.

    A table may be there of which nothing is known. Balls ``nowhere`` are not asked for their
    places. Unless it ``knows_balls``, a shot may be of any ball.
    """
    if knows_balls and not balls:
        yield Problem("balls", LEFT_OUT, "one ball or more is needed")
    cues = [where for where, ball in balls if ball.cue]
    yield from repeated("id", [(where, ball.id) for where, ball in balls])
    for where in cues[1:]:
        yield Problem((*where, "cue"), True, f"{written(cues[0])} is the cue ball already")
    yield from repeated("id", [(where, pocket.id) for where, pocket in pockets])
    there = {k: ball for k, (where, ball) in enumerate(balls) if where not in nowhere}
    holes, obstacles = [hole for _, hole in pockets], [post for _, post in posts]
    for problem in place_problems(there, table, holes, posts=obstacles, units=units):
        where = balls[int(problem.steps[1])][0]
        yield Problem((*where, "position"), problem.value, problem.message)
    largest = max([ball.radius for _, ball in balls], default=0.0)
    for k, edge in enumerate(table.edges if table else ()):
        if edge.bulge > 0.0 and edge.arc_radius <= largest:
            message = f"cushion {k} is no wider than the largest ball"
            yield Problem(("table", "bulge", k), edge.bulge, message)
    for where, post in posts:
        for message in post_problems(post, table, holes, units):
            yield Problem((*where, "position"), list(post.position), message)
    yield from _shots_without_room(
        shots, there.values(), partial(no_room, table=table, pockets=holes, posts=obstacles,
                                       units=units)
    )  # fmt: skip
    ids = [ball.id for _, ball in balls]
    yield from shot_problems(shots, ids if knows_balls and ids else None)
    has_table = table is not None if has_table is None else has_table
    lacks = [post for _, post in posts if post.restitution is None]
    needs = "there is a table" if has_table else "a post has none of its own" if lacks else ""
    yield from restitution_needs(restitution, needs, len(balls), len(cues))
    moves = bool(shots) or any(ball.velocity != (0.0, 0.0) for _, ball in balls)
    if friction.rolling is None:
        given = [(where, ball.roll) for where, ball in balls]
        for where, roll in [*given, *((where, shot.roll) for where, shot in shots)]:
            if roll != 0.0:
                yield Problem((*where, "roll"), roll, NO_ROLLING)
    if moves and _never_rests(friction, physics) and physics.max_time is None:
        message = "is missing: without surface friction and gravity the balls never come to rest"
        yield Problem(("physics", "max_time"), LEFT_OUT, message)


def _shots_without_room(
    shots: Located[Shot], balls: Collection[Ball], no_room: Callable[..., Iterable[str]]
) -> Iterator[Problem]:
    """Find shots that place their ball where it has no room, as far as others are known."""
    radii = {ball.id: ball.radius for ball in balls}
    for where, shot in shots:
        if shot.place is not None and shot.ball in radii:
            here = Placed(shot.ball, shot.place, radii[shot.ball])
            for message in no_room(here, () if shot.from_previous else balls):
                yield Problem((*where, "place"), list(shot.place), message)


def repeated(field: str, names: Iterable[tuple[Location, str]]) -> Iterator[Problem]:
    """Find names that stand there twice."""
    seen: dict[str, Location] = {}
    for where, name in names:
        if name in seen:
            message = f"is the {field} of {written(seen[name])} already"
            yield Problem((*where, field), name, message)
        seen.setdefault(name, where)


def shot_problems(shots: Located[Shot], ids: Collection[str] | None) -> Iterator[Problem]:
    """Find repeated names, unknown balls, shots that aim at nothing or go on from no shot.

    Without ``ids`` no ball is unknown.
    """
    yield from repeated("name", [(where, shot.name) for where, shot in shots])
    known = None if ids is None else set(ids)
    for k, (where, shot) in enumerate(shots):
        asked: dict[Location, str] = {("ball",): shot.ball}
        if shot.aim == shot.ball:
            yield Problem((*where, "aim"), shot.aim, "a ball cannot aim at itself")
        elif shot.aim == NEAREST and known is not None and len(known) < 2:
            yield Problem((*where, "aim"), shot.aim, "there is no other ball to aim at")
        elif shot.aim not in (None, NEAREST):
            asked[("aim",)] = str(shot.aim)
        asked |= {("published", id_): id_ for id_ in shot.published}
        for key, id_ in asked.items():
            if known is not None and id_ not in known:
                value = list(shot.published[id_]) if len(key) > 1 else id_
                message = f"there is no such ball (there are: {listed(ids or ())})"
                yield Problem((*where, *key), value, message)
        if k == 0 and shot.from_previous:
            yield Problem((*where, "from"), "previous", "there is no shot before the first")


def restitution_needs(
    restitution: Restitution, cushion: str, balls: int, cues: int
) -> Iterator[Problem]:
    """Find coefficients of restitution that the scene needs and leaves out.

    ``cushion`` says why that of the cushions is needed, and is empty if it is not.
    """
    if cushion and restitution.cushion is None:
        yield Problem(("restitution", "cushion"), LEFT_OUT, f"is missing where {cushion}")
    meet = {False: balls - cues > 1, True: balls > 1 and cues > 0}  # without the cue ball, with it
    if any(meet[cue] and ball_ball_restitution(restitution, cue) is None for cue in meet):
        message = "is missing where two balls can meet"
        yield Problem(("restitution", "ball_ball"), LEFT_OUT, message)
