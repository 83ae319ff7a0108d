"""A scene is put into the core here: its table, floor and balls."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real
from typing import Any

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.floor import Floor
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.table import Table as CoreTable
from pool_pymunk.core.walls.wall import Pocket, Wall
from pool_pymunk.laws import Pair
from pool_pymunk.model import Post, Scene, State, Table
from pool_pymunk.model.places import post_wall
from pool_pymunk.model.problems import setting_error, shown


def table_of(scene: Scene) -> CoreTable:
    """Return the table of a scene; the scene keeps it."""
    known = scene.found.get(table_of)
    if known is None:
        known = scene.found[table_of] = new_table_of(scene)
    assert isinstance(known, CoreTable)
    if isinstance(known, ScenePairs):
        known.begin(scene)
    return known


def new_table_of(scene: Scene) -> CoreTable:
    """Return a table of a scene that nobody else has."""
    own = [Wall(w.sides, w.restitution, w.friction, w.number, w.kick) for w in scene.cushions]
    e, cue = scene.restitution.ball_ball, scene.restitution.cue_ball
    coefficients = e or 0.0, (e if cue is None else cue) or 0.0, scene.friction.ball_ball
    kind = CoreTable if type(scene).pair is Scene.pair else ScenePairs
    return kind([*own, *pockets_of(scene)], scene.surface, scene.ground, *coefficients)


class ScenePairs(CoreTable):
    """This table asks a scene for the coefficients of two balls, because it has its own.

    It asks once for each two balls of a run.
    """

    scene: Scene

    def begin(self, scene: Scene) -> None:
        """Begin a run of a scene."""
        self.scene = scene
        self.known: dict[tuple[int, int], CorePair] = {}

    def pair(self, a: Ball, b: Ball) -> CorePair:
        both = a.number, b.number
        if both not in self.known:
            self.known[both] = pair_in_core(self.scene.pair(*both))
        return self.known[both]


def pair_in_core(pair: Any) -> CorePair:
    """Return a pair of a user's scene as the core has it; raises SettingError for what is none."""
    if not isinstance(pair, Pair) or not all(isinstance(number, Real) for number in pair):
        raise setting_error("pair", shown(pair), "must be a Pair of four numbers")
    return CorePair(*map(float, pair))


def pockets_of(scene: Scene) -> list[Wall]:
    """Return the pockets of a scene."""
    return [Pocket(hole.position, hole.radius, k) for k, hole in enumerate(scene.pockets)]


def floor_of(scene: Scene) -> Floor:
    """Return where balls may lie at the start; the scene keeps it."""
    known = scene.found.get(floor_of)
    if known is None:
        known = floor_between(scene.table, scene.posts)
        known.walls += pockets_of(scene)
        scene.found[floor_of] = known
    assert isinstance(known, Floor)
    return known


def floor_between(outline: Table | None, posts: Iterable[Post]) -> Floor:
    """Return where balls may lie between cushions and posts."""
    cushions = () if outline is None else outline.walls
    walls = [*cushions, *(post_wall(post, k) for k, post in enumerate(posts))]
    xs, ys, bows = ((), (), ()) if outline is None else outline.lines
    return Floor([*xs], [*ys], [*bows], walls)


def new_balls(scene: Scene) -> list[Ball]:
    """Return the balls of a scene, which are to begin shots."""
    nowhere = standing(0.0, 0.0, 0.0)
    return [Ball(k, b.radius, b.mass, nowhere, b.cue) for k, b in enumerate(scene.balls)]


def balls_of(scene: Scene, start: State, table: CoreTable) -> list[Ball]:
    """Return the balls of a scene, which set off from a start."""
    found, patches = list[Ball](), table.patches
    rolls = start.roll or ((0.0, 0.0),) * len(scene.balls)
    starts = zip(scene.balls, start.position, start.velocity, rolls, strict=True)
    for i, (ball, place, velocity, roll) in enumerate(starts):
        patch = patches.at(*place)
        path = table.surface_of(patch).path(0.0, place, velocity, roll)
        found.append(Ball(i, ball.radius, ball.mass, path, ball.cue))
        found[i].patch = patch
    return found
