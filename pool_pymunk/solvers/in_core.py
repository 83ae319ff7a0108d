"""A scene is put into the core here: walls, surface, patches, balls and law as the core has them.

The core knows no scene, and its laws, sides and surfaces take plain numbers. Those of a user's own
are adapted (:mod:`pool_pymunk.solvers.own`).
"""

from __future__ import annotations

from collections.abc import Iterable

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact import laws as core_laws
from pool_pymunk.core.floor import Floor
from pool_pymunk.core.motion.patches import Border, Circle, Line, Patches
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.motion.surface import Rolling, Sliding, Surface
from pool_pymunk.core.table import Table as CoreTable
from pool_pymunk.core.walls.arc import Arc
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Pocket, Wall
from pool_pymunk.model import Post, Scene, State, Table
from pool_pymunk.model.places import post_wall
from pool_pymunk.physics import laws, patches, sides, surface
from pool_pymunk.solvers.own import OwnLaw, OwnSide, OwnSurface, ScenePairs

BUILT_IN: dict[type[laws.Law], core_laws.Law] = {
    laws.Coulomb: core_laws.Coulomb(),
    laws.Published: core_laws.Published(),
    laws.Weakening: core_laws.Weakening(),
}


def law_in_core(law: laws.Law) -> core_laws.Law:
    """Return a law as the core takes it."""
    return BUILT_IN.get(type(law)) or OwnLaw(law)


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
    walls = [*map(wall_in_core, scene.cushions), *pockets_of(scene)]
    e, cue = scene.restitution.ball_ball, scene.restitution.cue_ball
    coefficients = e or 0.0, (e if cue is None else cue) or 0.0, scene.friction.ball_ball
    kind = CoreTable if type(scene).pair is Scene.pair else ScenePairs
    return kind(walls, surface_in_core(scene.surface), patches_in_core(scene.ground), *coefficients)


def pockets_of(scene: Scene) -> list[Wall]:
    """Return the pockets of a scene."""
    return [Pocket(hole.position, hole.radius, k) for k, hole in enumerate(scene.pockets)]


def wall_in_core(wall: sides.Wall) -> Wall:
    """Return a wall as the core has it."""
    own = [side_in_core(side) for side in wall.sides]
    return Wall(own, wall.restitution, wall.friction, wall.number, wall.kick)


def side_in_core(side: sides.Side) -> Side:
    """Return a side as the core has it."""
    if isinstance(side, sides.Face):
        return Face(*side)
    if isinstance(side, sides.RoundSide):
        return RoundSide(*side)
    if isinstance(side, sides.Arc):
        return Arc(*side)
    return OwnSide(side)


def surface_in_core(own: surface.Surface) -> Surface:
    """Return a surface as the core has it."""
    if isinstance(own, surface.Sliding):
        return Sliding(own.pull)
    if isinstance(own, surface.Rolling):
        return Rolling(own.pull, own.drag)
    return OwnSurface(own)


def patches_in_core(ground: patches.Patches) -> Patches:
    """Return patches as the core has them."""
    borders = list[Border]()
    for patch, is_round, *numbers in ground.borders:
        x, y, u, v = numbers
        if is_round:
            borders.append(Circle(int(patch), (x, y), u))
        else:
            borders.append(Line(int(patch), (x, y), (u, v)))
    return Patches(borders, [surface_in_core(each) for each in ground.surfaces])


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
    return Floor([*xs], [*ys], [*bows], [*map(wall_in_core, walls)])


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
