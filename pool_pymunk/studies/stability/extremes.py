"""This module makes the extremes: small scenes from parameters, each row from mild to extreme."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import replace

from pool_pymunk.model import (
    Ball,
    Friction,
    Physics,
    Pocket,
    Point,
    Restitution,
    Scene,
    Table,
)
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.bent import (
    circles,
    corners_of_arcs,
    follows,
    held_to_arcs,
    joints,
    pressed_by_rolls,
    slides_and_rolls,
    tangents,
    turns_back,
)
from pool_pymunk.studies.stability.scenes import (
    CHALK,
    CLOTH,
    ELASTIC,
    GLIDE,
    LIVELY,
    MIXED,
    REST,
    SMOOTH,
    TOUCHING,
    Extreme,
    M,
    R,
    alike,
    grip,
    on_plane,
    rectangle,
    unit,
)
from pool_pymunk.studies.stability.trial import Case

# -- numbers large and small -----------------------------------------------------------------------


def speeds() -> Iterator[Case]:
    """Shoot a ball at another, near enough to be reached."""
    for speed in (1.0, 1e-6, 1e3, 1e6):
        (vx, vy), (ux, uy) = unit(20.0), unit(23.0)
        far = 2.0 * R + min(0.25, 0.01 * speed**2)
        target = (0.5 + far * ux, 0.375 + far * uy)
        rows = ((0.5, 0.375, speed * vx, speed * vy), (*target, *REST), (1.5, 0.75, *REST))
        yield Case(f"{speed:g} m/s", Scene(alike(rows), rectangle(2.0, 1.0), LIVELY, CLOTH))


def masses() -> Iterator[Case]:
    """Hit one ball of another mass from both sides."""
    rows = ((0.0, 0.0, 2.0, 0.0625), (0.375, R, *REST), (0.75, R, -1.0, 0.0), (0.5, -0.125, *REST))
    cue, odd, *others = alike(rows)
    for ratio in (1.0, 1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9):
        balls = (cue, replace(odd, mass=M * ratio), *others)
        yield Case(f"1 : {ratio:g}", on_plane(balls, 0.9, 1.0))


def radii() -> Iterator[Case]:
    """Let small balls meet one that is half a metre in radius."""
    for ratio in (1.0, 10.0, 100.0, 1000.0):
        big = Ball("big", (1.0, 1.25), 0.5, M, velocity=(0.5, 0.125))
        (small,) = alike([(3.0, 1.25, -2.0, 0.03125)], 0.5 / ratio)
        balls = (big, small, Ball("other", (0.5, 0.5), 0.125 / ratio, M))
        yield Case(f"1 : {ratio:g}", Scene(balls, rectangle(4.0, 2.5), LIVELY, CLOTH))


def restitutions() -> Iterator[Case]:
    """Vary the restitution from elastic to sticking."""
    for label, ball, cushion in (
        ("0.9, cushions 0.7", 0.9, 0.7), ("1", 1.0, 1.0), ("0, cushions 0.7", 0.0, 0.7),
        ("0.9, cushions 0", 0.9, 0.0), ("0", 0.0, 0.0),
    ):  # fmt: skip
        e = Restitution(ball, None, cushion)
        yield Case(label, Scene(alike(TOUCHING), rectangle(2.0, 1.0), e, CLOTH))


def frictions() -> Iterator[Case]:
    """Vary friction from none to far more than the laws have use for."""
    for label, friction in (
        ("as in the report", CLOTH),
        ("0", SMOOTH),
        ("balls 10", Friction(0.1, 0.2, 10.0)),
        ("cushions 10", Friction(0.1, 10.0, 0.05)),
        ("surface 10", Friction(10.0, 0.2, 0.05)),
        ("10", Friction(10.0, 10.0, 10.0)),
    ):
        physics = Physics(max_time=None if friction.surface else 3.0)
        # The ball is fast enough to meet something.
        faster = 1.0 if friction.surface < 1.0 else 5.0
        rows = ((x, y, faster * vx, faster * vy) for x, y, vx, vy in MIXED)
        yield Case(label, Scene(alike(rows), rectangle(2.0, 1.0), LIVELY, friction, physics))


def time_steps() -> Iterator[Case]:
    """Play one small, fast scene at all steps: it lasts 0.1 s and has ten contacts or more."""
    size = 2.0**-4
    rows = ((x * size, y * size, vx, vy) for x, y, vx, vy in MIXED)
    balls = alike(rows, R * size)
    friction = Friction(grip(3.0, 0.25), 0.2, 0.05)
    yield Case("", Scene(balls, rectangle(2.0 * size, size), LIVELY, friction))


def table_sizes() -> Iterator[Case]:
    """Play on the same table in every size, then with balls of usual size on the largest."""
    for length in (1.0, 1e-3, 100.0, 1e4):
        claim = must.as_in(sized(1.0), scale=length)
        yield Case(f"{length:g} m", sized(length), (claim,))
    yield Case("1e4 m, usual balls", sized(1e4, R / 1e4))


def sized(length: float, radius: float = R) -> Scene:
    """Return a scene whose table is crossed in about a second.

    ``radius`` is in units of the table's ``length`` (m).
    """
    rows = (
        (0.25, 0.125, 1.5, 0.25),
        (0.75, 0.125 + 0.5 / 6.0 - radius, *REST),
        (0.5, 0.375, *REST),
        (0.375, 0.25, 0.25, -1.0),
    )
    balls = alike(
        ((length * x, length * y, length * vx, length * vy) for x, y, vx, vy in rows),
        length * radius,
    )
    friction = Friction(grip(1.5 * length, 2.0 * length), 0.2, 0.05)
    return Scene(balls, rectangle(length, length / 2.0), LIVELY, friction)


def origins() -> Iterator[Case]:
    """Put the same table farther and farther from the origin."""
    for far in (0.0, 1e3, 1e5, 1e7):
        claim = must.as_in(moved(0.0, 0.0), shift=(far, -far))
        yield Case(f"{far:g} m", moved(far, -far), (claim,))


def moved(x0: float, y0: float) -> Scene:
    """Return the mixed scene on a table with its corner there; starts are exact up to 1e7 m."""
    rows = ((x + x0, y + y0, vx, vy) for x, y, vx, vy in MIXED)
    return Scene(alike(rows), rectangle(2.0, 1.0, (x0, y0)), LIVELY, CLOTH)


# -- contacts at one instant, or nearly ------------------------------------------------------------


def racks() -> Iterator[Case]:
    """Hit a rack of 15 head-on: the break stays symmetric."""
    for gap in (1e-6, 1e-9, 1e-12, 1e-15, 0.0):
        pitch = 2.0 * R + gap
        places = (
            (1.25 + row * pitch * math.sqrt(0.75), (k - row / 2.0) * pitch)
            for row in range(5)
            for k in range(row + 1)
        )
        balls = alike([(0.5, 0.0, 4.0, 0.0), *((x, y, *REST) for x, y in places)])
        table = rectangle(2.0, 1.0, (0.0, -0.5))
        scene = Scene(balls, table, Restitution(0.95, None, 0.7), CLOTH)
        yield Case(f"gaps of {gap:g} m", scene, (must.mirrored,))


def cradles() -> Iterator[Case]:
    """Hit a row of touching balls: as many balls leave it as hit it, at the same speed."""
    for strikers, count in ((1, 2), (1, 3), (1, 4), (1, 5), (1, 6), (1, 7), (2, 5), (3, 7)):
        rows = [
            (2.0 * R * k - (0.25 if k < strikers else 0.0), 0.0, float(k < strikers), 0.0)
            for k in range(count)
        ]
        ends = {str(k): (float(k >= count - strikers), 0.0) for k in range(count)}
        label = f"{strikers} on {count - strikers}"
        yield Case(label, on_plane(alike(rows), 1.0, 1.0), (must.leave_with(ends),))


def meetings() -> Iterator[Case]:
    """Let balls from all sides meet at one instant, around nothing or around a ball at rest."""
    for e in (0.9, 0.0):
        for count in (2, 3, 4, 6):
            turned = (unit(360.0 * k / count) for k in range(count))
            around = [(0.5 * x, 0.5 * y, -x, -y) for x, y in turned]
            for centre in ([], [(0.0, 0.0, *REST)]):
                scene = on_plane(alike([*centre, *around]), e, 1.0)
                where = "around one" if centre else "meet"
                yield Case(f"{count} {where}, e = {e:g}", scene, (must.all_as_far,))


def orders() -> Iterator[Case]:
    """Run a ball into two others, one a moment after the other, or both at one instant.

    A moment apart, the hits have a closed form however short the moment is. At one instant the
    order is unknown, and the run must say how far the ends may lie elsewhere for it.
    """
    for e in (1.0, 0.5):
        for moment in (1e-3, 1e-6, 1e-9, 1e-12, 0.0):
            balls, velocities = one_after_the_other(e, moment)
            scene = on_plane(balls, e, 1.0, SMOOTH)
            ends = {id_: (0.5 * x, 0.5 * y) for id_, (x, y) in velocities.items() if id_ == "0"}
            claim = must.leave_with(velocities) if moment else must.know_of_ends(ends)
            label = f"{moment:g} s apart" if moment else "at one instant"
            yield Case(f"{label}, e = {e:g}", scene, (claim,))


def one_after_the_other(e: float, moment: float) -> tuple[tuple[Ball, ...], dict[str, Point]]:
    """Return a ball that hits one at 30 degrees, and another at -30 a moment (s) later.

    It comes to the first at the origin, 0.5 s after the start. Return all velocities (m/s), too.
    """
    velocity, place, balls, ends = (1.0, 0.0), (0.0, 0.0), [(-0.5, 0.0, 1.0, 0.0)], {}
    for k, degrees in enumerate((30.0, -30.0), start=1):
        nx, ny = unit(degrees)
        balls.append((place[0] + 2.0 * R * nx, place[1] + 2.0 * R * ny, *REST))
        given = (1.0 + e) / 2.0 * (velocity[0] * nx + velocity[1] * ny)
        velocity = (velocity[0] - given * nx, velocity[1] - given * ny)
        place = (velocity[0] * moment, velocity[1] * moment)
        ends[str(k)] = (given * nx, given * ny)
    return alike(balls), {"0": velocity, **ends}


def head_ons() -> Iterator[Case]:
    """Hit without slip: the other ball leaves along the line of centres."""
    for angle in (0.0, 30.0, 45.0, 90.0, 165.0):
        x, y = unit(angle)
        scene = on_plane(alike([(0.0, 0.0, x, y), (0.5 * x, 0.5 * y, *REST)]), 0.95, 1.0)
        ends = {"0": (0.025 * x, 0.025 * y), "1": (0.975 * x, 0.975 * y)}
        yield Case(f"{angle:g} degrees", scene, (must.leave_with(ends),))


def grazing_hits() -> Iterator[Case]:
    """Let a ball pass another at the sum of the radii, more or less: it hits, or it misses."""
    for share in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12, 0.0):
        beside = 2.0 * R * (1.0 + share)
        inside = max(2.0 * R - beside, 0.0) * (2.0 * R + beside)
        # This is the normal change of velocity for e = 0.9.
        dv_n = 0.95 * math.sqrt(inside) / (2.0 * R)
        speed = dv_n * math.hypot(1.0, CHALK.ball_ball)
        scene = on_plane(alike([(-0.5, beside, 1.0, 0.0), (0.0, 0.0, *REST)]), 0.9, 1.0)
        claims = (must.contacts_are(int(beside < 2.0 * R)), must.leaves_at("1", speed))
        yield Case(f"{share:+g}", scene, claims)


# -- walls -----------------------------------------------------------------------------------------


def corners() -> Iterator[Case]:
    """Run a ball along the diagonal into a square's corner, or onto a corner that sticks out."""
    square = rectangle(1.0, 1.0)
    ell = Table(((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0)))
    for label, table, e, mu in (
        ("smooth", square, 0.7, 0.0),
        ("rough", square, 0.7, 0.2),
        ("reflex", ell, 0.7, 0.2),
        ("e = 1", square, 1.0, 0.0),
        ("e = 0", square, 0.0, 0.2),
        ("friction 10", square, 0.7, 10.0),
        ("reflex, e = 0", ell, 0.0, 0.0),
    ):
        v = 1.0 if table is ell else -1.0
        friction = Friction(0.05, mu)
        balls = alike([(0.25, 0.25, v, v)])
        scene = Scene(balls, table, Restitution(1.0, None, e), friction)
        yield Case(label, scene, (must.on_the_diagonal,))


def squeezes() -> Iterator[Case]:
    """Let a heavy ball drive a light one to a cushion; elastic, they count the digits of pi.

    With a mass ratio N there are ceil(pi / atan(sqrt(1/N))) - 1 hits (Galperin 2003). Hits that
    lose energy have no end here, and bring both balls to rest at the cushion.
    """
    for ratio in (1e2, 1e4, 1e6, 1e8):
        hits = math.ceil(math.pi / math.atan(math.sqrt(1.0 / ratio))) - 1
        scene = Scene(squeezed(ratio), rectangle(16.0, 1.0), ELASTIC, SMOOTH, Physics(max_time=9.0))
        yield Case(f"1 : {ratio:g}", scene, (must.contacts_are(hits),), slow=ratio > 1e4)
    far = 2.0**20  # m from the origin, where numbers are 2.3e-10 m apart
    for e in (0.9, 0.5, 0.0):
        for label, beside, x in (("", 0.0, 0.0), (", aslant", R / 4.0, 0.0), (", far", 0.0, far)):
            balls, table = squeezed(1e6, beside, x), rectangle(8.0, 1.0, (x, 0.0))
            scene = Scene(balls, table, Restitution(e, None, e), GLIDE)
            ends = {"light": (x + R, 0.5), "heavy": (x + 3.0 * R, 0.5)}
            claims = () if beside else (must.end_at(ends),)
            slow = e == 0.5 or (e == 0.9 and label != "")
            yield Case(f"1 : 1e6, e = {e:g}{label}", scene, claims, slow=slow)


def squeezed(ratio: float, beside: float = 0.0, far: float = 0.0) -> tuple[Ball, ...]:
    """Return a heavy ball that runs to a light one, which is before a cushion.

    ``beside`` (m) is how far the heavy ball's line is from the light ball.
    """
    heavy = Ball("heavy", (far + 2.0, 0.5), R, M * ratio, velocity=(-1.0, 0.0))
    return heavy, Ball("light", (far + 1.0, 0.5 + beside), R, M)


def wedges() -> Iterator[Case]:
    """Run a ball into a wedge; elastic, its path unfolds to a straight line through images of it.

    Aimed a seventh of the angle beside the tip, it meets ceil(180 / angle - 1/7 - 1/2) cushions.
    """
    for angle in (60.0, 10.0, 1.0, 0.1):
        half = math.radians(angle / 2.0)
        table = Table(((0.0, 0.0), (1.0, -math.tan(half)), (1.0, math.tan(half))))
        balls = alike([(0.5, 0.0, *unit(180.0 - angle / 7.0))], math.sin(half) / 8.0)
        hits = must.contacts_are(math.ceil(180.0 / angle - 1.0 / 7.0 - 0.5))
        scene = Scene(balls, table, ELASTIC, SMOOTH, Physics(max_time=1.0))
        yield Case(f"{angle:g} degrees", scene, (hits,))
        for e in (0.7, 0.0):
            lossy = Scene(balls, table, Restitution(e, None, e), CLOTH)
            yield Case(f"{angle:g} degrees, e = {e:g}", lossy, slow=angle == 1.0)


def pockets() -> Iterator[Case]:
    """Let a centre pass a rim, on this side or on that, or reach it as the ball meets others.

    A ball that is at the rim leaves the table before it meets a ball and a cushion there.
    """
    hole = Pocket("hole", (0.0, 0.0), 2.0 * R)
    for share in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12):
        balls = alike([(-0.5, hole.radius * (1.0 + share), 1.0, 0.0)])
        scene = replace(on_plane(balls, 1.0, 1.0, SMOOTH), pockets=(hole,))
        yield Case(f"{share:+g}", scene, (must.pocket("0" * (share < 0.0)),))
    x, y = unit(80.0)
    rows = [(-2.0 * R - 0.5, 0.0625, 1.0, -0.125), (2.0 * R * (x - 1.0), 2.0 * R * y, *REST)]
    table = rectangle(4.0, 2.0, (-2.0, -R))
    physics = Physics(max_time=1.0)
    scene = Scene(alike(rows), table, LIVELY, SMOOTH, physics, pockets=(hole,))
    stays = must.leave_with({"0": REST, "1": REST})
    yield Case("with a ball and a cushion", scene, (must.pocket("0"), stays))


# -- many, and without end -------------------------------------------------------------------------


def crowd(count: int, box: float, seed: int = 1) -> tuple[Ball, ...]:
    """Return balls on a grid in a square box (m), each in its own direction at 1 m/s."""
    rng, side = random.Random(seed), math.ceil(math.sqrt(count))
    pitch = box / side
    return alike(
        ((k % side + 0.5) * pitch, (k // side + 0.5) * pitch, *unit(rng.uniform(0.0, 360.0)))
        for k in range(count)
    )


def many_contacts() -> Iterator[Case]:
    """Play ten balls in a box, without losses, for this many contacts."""
    physics = Physics(max_time=1e6)
    for count in (1_000, 10_000, 100_000):
        scene = Scene(crowd(10, 0.5), rectangle(0.5, 0.5), ELASTIC, SMOOTH, physics)
        yield Case(f"{count}", scene, max_events=count, ends="max_events", slow=count > 1_000)


def many_balls() -> Iterator[Case]:
    """Play a box full of balls, for half a second."""
    for count in (10, 100, 1_000):
        box = 0.125 * math.ceil(math.sqrt(count))
        physics = Physics(max_time=0.5)
        scene = Scene(crowd(count, box), rectangle(box, box), LIVELY, CLOTH, physics)
        yield Case(f"{count}", scene, slow=count > 100)


def piles() -> Iterator[Case]:
    """Pack balls with gaps of a tenth of a radius, all moving, until they have come to rest.

    In one case every third ball is a hundred times as heavy as the others.
    """
    for count, e, heavy in (
        (9, 0.9, 1.0), (9, 0.5, 1.0), (25, 0.5, 1.0), (9, 0.5, 100.0), (9, 0.0, 1.0),
    ):  # fmt: skip
        box = 2.1 * R * math.ceil(math.sqrt(count))
        balls = [*crowd(count, box)]
        balls[::3] = (replace(ball, mass=heavy * ball.mass) for ball in balls[::3])
        scene = Scene(tuple(balls), rectangle(box, box), Restitution(e, None, e), CLOTH)
        masses = f", 1 : {heavy:g}" if heavy > 1.0 else ""
        slow = count > 9 or heavy > 1.0 or e == 0.0
        yield Case(f"{count}, e = {e:g}{masses}", scene, slow=slow)


def never_at_rest() -> Iterator[Case]:
    """Let nothing brake: the run ends at its ``max_time``, to the last bit, and not before."""
    physics = Physics(max_time=math.pi)
    one, table = (0.5, 0.5, 1.0, 0.25), rectangle(2.0, 1.0)
    for label, rows, where in (
        ("one ball", [one], table),
        ("along a cushion", [(0.5, R, 1.0, 0.0)], table),
        ("no table", [one], None),
        ("three balls", [one, (1.0, 0.5, *REST), (1.5, 0.5, 0.0, 0.5)], table),
    ):
        yield Case(label, Scene(alike(rows), where, ELASTIC, SMOOTH, physics))


def the_listing() -> Iterator[Case]:
    """Show what Listing 3, the report's own law, does to momentum and energy in an oblique hit."""
    for degrees in (0.0, 30.0, 60.0):
        x, y = unit(degrees)
        rows = ((-0.25 - 2.0 * R * x, -0.125 - 2.0 * R * y, 1.0, 0.5), (0.0, 0.0, *REST))
        scene = on_plane(alike(rows), 1.0, 1.0, Friction(ball_ball=0.2))
        yield Case(f"{degrees:g} degrees", scene, (must.momentum_kept, must.energy_kept))


EVERY_STEP = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1 / 240, 1 / 60, 0.1, 0.5)
LISTING = "line 132 pushes B with the slip, not against it: momentum is not kept"

EXTREMES = (
    Extreme("speeds", "1e-6 to 1e6 m/s on a 2 m table", speeds),
    Extreme("mass ratios", "up to 1e9 and 1e-9", masses),
    Extreme("radius ratios", "up to 1000", radii),
    Extreme("restitution", "0 and 1, three balls touching", restitutions),
    Extreme("friction", "0 and 10, of balls, cushions and cloth", frictions),
    Extreme("time steps", "1e-7 to 0.5 s", time_steps, steps=EVERY_STEP),
    Extreme("table sizes", "1 mm to 10 km, to scale and with usual balls", table_sizes),
    Extreme("far from the origin", "up to 1e7 m", origins),
    Extreme("frozen racks of 15", "gaps of 1e-6 to 0 m, hit head-on", racks),
    Extreme("Newton's cradles", "2 to 7 balls, gaps of 0", cradles),
    Extreme("meeting at one instant", "2 to 6 balls, and around one", meetings),
    Extreme("one after the other", "into two balls 1e-3 to 1e-12 s apart, and at once", orders),
    Extreme("head-on hits", "zero slip, at five angles", head_ons),
    Extreme("grazing hits", "within 1e-12 of a miss or a hit", grazing_hits),
    Extreme("exact corners", "of a square, and sticking out", corners),
    Extreme("squeezed to a cushion", "by a ball up to 1e8 times as heavy", squeezes),
    Extreme("pockets", "rims grazed within 1e-12, and one reached at contact", pockets),
    Extreme("converging cushions", "a wedge of 60 to 0.1 degrees", wedges),
    Extreme("sliding, then rolling", "draw that cancels the motion, slips of 1e-12, no end",
            slides_and_rolls, ("coulomb",)),
    Extreme("follow after a full hit", "at once, and within 1e-15 m of where it rolls", follows,
            ("coulomb",)),
    Extreme("draw that turns back", "at a face, corner or rim, within 1e-12", turns_back,
            ("coulomb",)),
    Extreme("pressed by a roll", "to a cushion, or to a ball that lies there", pressed_by_rolls,
            ("coulomb",)),
    Extreme("around a circle", "up to 10,000 contacts, by equal angles", circles, ("coulomb",)),
    Extreme("tangent to something round", "an arc, a post or a pin, within 1e-12 of a miss",
            tangents, ("coulomb",)),
    Extreme("joint of a face and an arc", "hit within 1e-9 to 1e-15 m", joints, ("coulomb",)),
    Extreme("corners of two arcs", "ran into, and sticking out", corners_of_arcs, ("coulomb",)),
    Extreme("held to an arc", "from a tangent, and after hits that converge", held_to_arcs,
            ("coulomb",)),
    Extreme("many contacts", "up to 100,000 without losses", many_contacts, ("coulomb",)),
    Extreme("many balls", "up to 1,000", many_balls),
    Extreme("dense piles", "9 and 25 moving balls, e from 0.9 to 0", piles, ("coulomb",)),
    Extreme("never at rest", "no friction, max_time = pi s", never_at_rest),
    Extreme(
        "the report's law", "Listing 3 in an oblique hit", the_listing, ("published",),
        because=LISTING,
    ),
)  # fmt: skip
