"""A scene is what is on the table: frozen objects in SI units, checked when they are made.

A :class:`Scene` holds everything a solver may know. What a scene leaves out (a table, surface
friction, a second ball) is physics that no solver computes.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, overload

from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.patches import Border, Circle, Line, Patches
from pool_pymunk.core.motion.surface import Rolling, Sliding, Surface
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws.contact import Pair
from pool_pymunk.model.outline import LEVEL, NEVER_RESTS, NO_FRICTION, Table
from pool_pymunk.model.parts import (
    NEAREST,
    Ball,
    Friction,
    Patch,
    Physics,
    Pocket,
    Post,
    Restitution,
    Shot,
)
from pool_pymunk.model.places import METRES, SUNK, Placed, Surroundings, placed, post_wall
from pool_pymunk.model.plain import Part, Text
from pool_pymunk.model.problems import (
    LEFT_OUT,
    Location,
    Point,
    Problem,
    listed,
    no_such_ball,
    raise_any,
    written,
)
from pool_pymunk.model.quantities import Units
from pool_pymunk.model.state import NO_ROLLING, State, read_state
from pool_pymunk.safety.files import whole


@dataclass(frozen=True)
class Scene(Part):
    """A scene has all that a solver may know: balls, table, pockets, materials, law, and shots.

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
    title: Annotated[Text, "What the scene is called."] = ""
    units: Units = field(default_factory=Units)
    pockets: tuple[Pocket, ...] = ()
    posts: tuple[Post, ...] = ()
    patches: tuple[Patch, ...] = ()

    def __repr__(self) -> str:
        shots = listed([shot.name for shot in self.shots]) or "none"
        parts = f"balls {listed(self.index)}; {self._ground()}; law {self.physics.law}"
        return f"<Scene {self.title!r}: {parts}; shots {shots}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: a picture of the table as it is set up."""
        from pool_pymunk.page import scene_in_notebook

        return scene_in_notebook(self)

    def _ground(self) -> str:
        has, ground = [], "an open plane"
        if self.table is not None:
            x0, y0, x1, y1 = self.table.bounds
            has, ground = [f"{self.first_post} cushions"], f"a table of {x1 - x0:g} x {y1 - y0:g} m"
        for count, name, names in (
            (len(self.posts), "post", "posts"),
            (len(self.pockets), "pocket", "pockets"),
            (len(self.patches), "patch", "patches"),
        ):
            has += [f"{count} {name if count == 1 else names}"] if count else []
        return f"{ground} with {' and '.join(has)}" if has else ground

    def _problems(self) -> Iterator[Problem]:
        return self.clashes(METRES)

    # -- what must fit together --------------------------------------------------------------------

    def clashes(self, units: Units) -> Iterator[Problem]:
        """Find what is wrong between the parts; messages are in ``units``."""
        if not self.balls:
            yield Problem("balls", LEFT_OUT, "one ball or more is needed")
        yield from repeated("id", [(("balls", k), ball.id) for k, ball in enumerate(self.balls)])
        cues = [k for k, ball in enumerate(self.balls) if ball.cue]
        for k in cues[1:]:
            yield Problem(("balls", k, "cue"), True, f"balls[{cues[0]}] is the cue ball already")
        yield from repeated(
            "id", [(("pockets", k), each.id) for k, each in enumerate(self.pockets)]
        )
        yield from self._of_places(units)
        yield from repeated(
            "name", [(("shots", k), shot.name) for k, shot in enumerate(self.shots)]
        )
        for k, shot in enumerate(self.shots):
            yield from (each.under("shots", k) for each in self._of_shot(shot, is_first=k == 0))
        yield from self._of_coefficients(len(cues))
        for k, patch in enumerate(self.patches):
            yield from (each.under("patches", k) for each in self._of_patch(patch))
        yield from self._of_tilt()
        yield from self._of_time()

    def _of_places(self, units: Units) -> Iterator[Problem]:
        """Find balls, posts, arcs and shots' places that have no room."""
        around = Surroundings(self.table, self.pockets, self.posts, units)
        yield from around.problems(dict(enumerate(self.balls)))
        largest = max([ball.radius for ball in self.balls], default=0.0)
        for k, edge in enumerate(self.table.edges if self.table else ()):
            if edge.bulge > 0.0 and edge.arc_radius <= largest:
                message = f"cushion {k} is no wider than the largest ball"
                yield Problem(("table", "bulge", k), edge.bulge, message)
        for k, post in enumerate(self.posts):
            for message in around.post_problems(post):
                yield Problem(("posts", k, "position"), list(post.position), message)
        radii = {ball.id: ball.radius for ball in self.balls}
        for k, shot in enumerate(self.shots):
            if shot.place is not None and shot.ball in radii:
                here = Placed(shot.ball, shot.place, radii[shot.ball])
                for message in around.no_room(here, () if shot.from_previous else self.balls):
                    yield Problem(("shots", k, "place"), list(shot.place), message)

    def _of_shot(self, shot: Shot, is_first: bool) -> Iterator[Problem]:
        """Find balls in a shot that are not there, and a shot that aims at or follows nothing."""
        asked: dict[Location, str] = {("ball",): shot.ball}
        if shot.aim == shot.ball:
            yield Problem("aim", shot.aim, "a ball cannot aim at itself")
        elif shot.aim == NEAREST and len(self.index) == 1:
            yield Problem("aim", shot.aim, "there is no other ball to aim at")
        elif shot.aim not in (None, NEAREST):
            asked[("aim",)] = str(shot.aim)
        asked |= {("published", id_): id_ for id_ in shot.published}
        for key, id_ in asked.items():
            if self.balls and id_ not in self.index:
                value = list(shot.published[id_]) if len(key) > 1 else id_
                yield Problem(key, value, no_such_ball(self.index))
        if is_first and shot.from_previous:
            yield Problem("from", "previous", "there is no shot before the first")

    def _of_coefficients(self, cues: int) -> Iterator[Problem]:
        """Find coefficients that the scene needs and leaves out, and needless rolls."""
        lacks = any(post.restitution is None for post in self.posts)
        why = "a table" if self.table else "a post without its own" * lacks
        if why and self.restitution.cushion is None:
            yield Problem(("restitution", "cushion"), LEFT_OUT, f"is missing ({why} needs it)")
        balls = len(self.balls)
        met = [False] * (balls - cues > 1) + [True] * (balls > 1 and cues > 0)  # with the cue ball
        if None in [ball_ball_restitution(self.restitution, cue) for cue in met]:
            yield Problem(("restitution", "ball_ball"), LEFT_OUT, "is missing (two balls need it)")
        rolls = [(("balls", k), ball.roll) for k, ball in enumerate(self.balls)]
        rolls += [(("shots", k), shot.roll) for k, shot in enumerate(self.shots)]
        for where, roll in rolls if self.friction.rolling is None else ():
            if roll != 0.0:
                yield Problem((*where, "roll"), roll, NO_ROLLING)

    def _of_patch(self, patch: Patch) -> Iterator[Problem]:
        """Find coefficients of a patch that do not fit those of the scene."""
        if self.is_tilted and patch.surface:
            yield Problem("surface", patch.surface, f"must be 0: {NO_FRICTION}")
        surface = self.friction.surface if patch.surface is None else patch.surface
        rolling = self.friction.rolling if patch.rolling is None else patch.rolling
        if self.friction.rolling is None and patch.rolling is not None:
            yield Problem("rolling", patch.rolling, NO_ROLLING)
        elif rolling is None or rolling <= surface:
            return
        elif patch.rolling is None:
            message = f"must not be below rolling ({rolling:g}, of [friction])"
            yield Problem("surface", patch.surface, message)
        else:
            whose = "" if patch.surface is not None else ", of [friction]"
            yield Problem(
                "rolling", patch.rolling, f"must not be above surface ({surface:g}{whose})"
            )

    def _of_tilt(self) -> Iterator[Problem]:
        """Find friction of a surface that is tilted."""
        friction = self.friction
        if not self.is_tilted:
            return
        if friction.surface != 0.0 or friction.rolling is not None:
            key = "surface" if friction.surface != 0.0 else "rolling"
            message = f"leave out friction.{key} ({getattr(friction, key):g}): {NO_FRICTION}"
            yield Problem(("table", "tilt"), list(self.tilt), message)

    def _of_time(self) -> Iterator[Problem]:
        """Find that a run needs a latest end, because balls may never come to rest."""
        moves = self.shots or any(ball.velocity != (0.0, 0.0) for ball in self.balls)
        if not moves or self.physics.max_time is not None:
            return
        key = "surface" if self.friction.rolling is None else "rolling"
        ice = [k for k, patch in enumerate(self.patches) if getattr(patch, key) == 0.0]
        why = ""
        if self.is_tilted:
            why = NEVER_RESTS
        elif slowest(self.friction, self.physics) == 0.0:
            why = f"friction.{key} or gravity is 0, so balls never come to rest"
        elif ice:
            why = f"patches[{ice[0]}].{key} is 0, so a ball may never come to rest"
        if why:
            yield Problem(("physics", "max_time"), LEFT_OUT, f"is missing: {why}")

    # -- what solvers ask --------------------------------------------------------------------------

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The place of each ball's id in ``balls``."""
        return {ball.id: i for i, ball in enumerate(self.balls)}

    @cached_property
    def cushions(self) -> tuple[Wall, ...]:
        """The walls that balls bounce off: the cushions of the table, and after them the posts."""
        own = self.restitution.cushion or 0.0, self.friction.cushion
        edges = () if self.table is None else self.table.walls
        found = [Wall(wall.sides, *own, wall.number) for wall in edges]
        posts = enumerate(self.posts, start=len(found))
        return (*found, *(post_wall(post, k, *own) for k, post in posts))

    @cached_property
    def found(self) -> dict[Any, Any]:
        """Solvers keep here what they have found out about the scene; no copy of it has that."""
        return {}

    @property
    def first_post(self) -> int:
        """The number of the first post among the cushions."""
        return 0 if self.table is None else len(self.table.edges)

    def side_name(self, cushion: int) -> str:
        """Return what the cushion of a number is called: "cushion 2", or "post 4"."""
        return f"{'cushion' if cushion < self.first_post else 'post'} {cushion}"

    @property
    def diagonal(self) -> float:
        """The length (m) of the diagonal of the table's bounding box; infinite without a table."""
        if self.table is None:
            return math.inf
        x0, y0, x1, y1 = self.table.bounds
        return math.hypot(x1 - x0, y1 - y0)

    @cached_property
    def surface(self) -> Surface:
        """The surface says how balls move on the table between contacts."""
        if self.is_tilted:
            return Falling(*self.tilt)
        if self.friction.rolling is None:
            return Sliding(self.deceleration)
        return Rolling(self.deceleration, self.friction.rolling * self.physics.gravity)

    @cached_property
    def ground(self) -> Patches:
        """The patches of the table, as solvers ask them."""
        return ground_of(self.surface, self.patches, self.physics.gravity)

    @property
    def patch_rates(self) -> list[Point]:
        """The decelerations (m/s^2) of sliding and rolling that patches have of their own, or -1.

        It is -1 where they are those of the table.
        """
        g, own = self.physics.gravity, [(patch.surface, patch.rolling) for patch in self.patches]
        return [(-1.0 if mu is None else mu * g, -1.0 if w is None else w * g) for mu, w in own]

    @property
    def tilt(self) -> Point:
        """The acceleration (m/s^2) at which balls fall along the table."""
        return LEVEL if self.table is None else self.table.tilt

    @property
    def is_tilted(self) -> bool:
        """Tell whether balls fall along the table."""
        return self.tilt != LEVEL

    @property
    def deceleration(self) -> float:
        """Surface friction decelerates a sliding ball by a = mu_s g (m/s^2, Eq. 10)."""
        return self.friction.surface * self.physics.gravity

    @cached_property
    def always_rests(self) -> bool:
        """Tell whether friction brings every ball to rest."""
        return slowest(self.friction, self.physics, self.patches) > 0.0

    @property
    def cue(self) -> Ball | None:
        """The cue ball, where there is one."""
        return next((ball for ball in self.balls if ball.cue), None)

    def pair(self, i: int, j: int) -> Pair:
        """Return the masses and coefficients of a hit of ball ``i`` (A) with ball ``j`` (B)."""
        a, b = self.balls[i], self.balls[j]
        e = ball_ball_restitution(self.restitution, a.cue or b.cue)
        assert e is not None, "a scene without it has a problem"
        return Pair(a.mass, b.mass, e, self.friction.ball_ball)

    def start(self, shot: Shot | None, before: State | None = None) -> State:
        """Return the state at the moment of a shot, from ``before`` or the scene's own.

        Balls that are off the table before stay off, except for one that the shot places. Raises
        SceneError if the shot strikes or aims at a ball that is off the table or not in the scene,
        and if it places the ball where there is no room.
        """
        state = before or self._as_set_up
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

    @property
    def _around(self) -> Surroundings:
        return Surroundings(self.table, self.pockets, self.posts)

    def _with_ball_at(self, i: int, place: Point, state: State) -> State:
        """Return the state with ball ``i`` on the table, at another place (m)."""
        ball = self.balls[i]
        here = Placed(ball.id, place, ball.radius)
        room = self._around.no_room(here, placed(self.balls, state).values())
        raise_any(Problem("shot.place", list(place), message) for message in room)
        position = _with(state.position, i, place)
        return state._replace(position=position, off=state.off - {ball.id})

    @cached_property
    def _as_set_up(self) -> State:
        """The state in which the scene's balls are before any shot."""
        places = tuple(ball.position for ball in self.balls)
        velocities = tuple(ball.velocity for ball in self.balls)
        rolls = tuple(_scaled(ball.velocity, ball.roll) for ball in self.balls)
        return State(places, velocities, roll=rolls if self.surface.rolls else None)

    def _absent(self, shot: Shot, off: Collection[str]) -> Iterator[Problem]:
        """Find the balls that a shot strikes or aims at, and that are not on the table."""
        for key, id_ in (("ball", shot.ball), ("aim", shot.aim)):
            if id_ in off and not (key == "ball" and shot.place is not None):
                yield Problem(f"shot.{key}", id_, f"the ball is off the table before {shot.name}")
            elif id_ not in (None, NEAREST, *self.index):
                yield Problem(f"shot.{key}", id_, no_such_ball(self.index))
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
        """Read a state that a user made: positions, velocities, and which balls are off the table.

        Balls may overlap each other and cushions by ``SUNK`` of their radii, as at the end of a run
        that finds contacts late. Raises SceneError for an impossible state, and names the ball.
        """
        state = read_state(value, self.index, self.surface.rolls)
        there = placed(self.balls, state)
        raise_any(
            Problem(("start", "position", problem.steps[1]), problem.value, problem.message)
            for problem in self._around.problems(there, SUNK)
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
        from pool_pymunk.model.scenario_out import scenario_text

        text = scenario_text(self)
        if path is None:
            return text
        with whole(Path(path)) as part:
            part.write_text(text, encoding="utf-8", newline="\n")
        return None


def borders_of(number: int, patch: Patch) -> list[Border]:
    """Return the borders of a patch, which has this number.

    >>> [circle] = borders_of(3, Patch(center=(2.0, 1.0), radius=0.5))
    >>> circle.patch, circle.distance(2.0, 2.0)
    (3, 0.5)
    """
    if patch.center is not None and patch.radius is not None:
        return [Circle(number, patch.center, patch.radius)]
    ends = zip(patch.corners, (*patch.corners[1:], *patch.corners[:1]), strict=True)
    return [Line(number, start, end) for start, end in ends]


def ground_of(table: Surface, patches: Sequence[Patch], gravity: float) -> Patches:
    """Return patches as solvers ask them; what they leave out is that of the table's surface."""
    found = list[Surface]()
    for each in patches:
        pull = table.pull if each.surface is None else each.surface * gravity
        drag = table.drag if each.rolling is None else each.rolling * gravity
        own = Rolling(pull, drag) if table.rolls else Sliding(pull)
        found.append(table if isinstance(table, Falling) else own)  # There no patch slows balls.
    return Patches([one for k, each in enumerate(patches) for one in borders_of(k, each)], found)


def ball_ball_restitution(restitution: Restitution, with_cue: bool) -> float | None:
    """Return the coefficient of a hit of two balls; ``cue_ball`` defaults to ``ball_ball``."""
    if with_cue and restitution.cue_ball is not None:
        return restitution.cue_ball
    return restitution.ball_ball


def slowest(friction: Friction, physics: Physics, patches: Iterable[Patch] = ()) -> float:
    """Return the deceleration (m/s^2) of a ball that rolls, or that slides where none rolls.

    It is the least one, of the table and of its patches.
    """
    key = "surface" if friction.rolling is None else "rolling"
    found = [getattr(friction, key), *(getattr(patch, key) for patch in patches)]
    return float(physics.gravity * min(mu for mu in found if mu is not None))


def _with(vectors: tuple[Point, ...], i: int, vector: Point) -> tuple[Point, ...]:
    return (*vectors[:i], vector, *vectors[i + 1 :])


def _scaled(vector: Point, share: float) -> Point:
    return (share * vector[0], share * vector[1])


def repeated(field: str, names: Iterable[tuple[Location, str]]) -> Iterator[Problem]:
    """Find names that are given twice."""
    seen: dict[str, Location] = {}
    for where, name in names:
        if name in seen:
            message = f"is the {field} of {written(seen[name])} already"
            yield Problem((*where, field), name, message)
        seen.setdefault(name, where)
