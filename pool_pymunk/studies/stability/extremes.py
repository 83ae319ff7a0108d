"""This module has the table of the extremes: small scenes, each row from mild to extreme."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.model import (
    STANDARD_GRAVITY,
    Ball,
    Friction,
    Physics,
    Pocket,
    Point,
    Post,
    Restitution,
    Scene,
    Table,
)
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.known import known_answers
from pool_pymunk.studies.stability.trial import LISTED, Case, Extreme

EXTREMES: list[Extreme] = []

EVERY_STEP = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1 / 240, 1 / 60, 0.1, 0.5)
LISTING = "line 132 pushes B with the slip, not against it: momentum is not kept"

Cases = Callable[[], Iterator[Case]]


def extreme(name: str, about: str, *laws: str, **more: Any) -> Callable[[Cases], Cases]:
    """Return a decorator that puts cases into the table, with their laws (default: LISTED)."""

    def put(cases: Cases) -> Cases:
        EXTREMES.append(Extreme(name, about, cases, laws or LISTED, **more))
        return cases

    return put


# -- what scenes are made of -----------------------------------------------------------------------

R = 2.0**-5  # m; sizes and places are short binary numbers, so that balls touch exactly
M = 0.2  # kg
REST = (0.0, 0.0)  # m/s
LIVELY = Restitution(ball_ball=0.9, cushion=0.7)
CLOTH = Friction(surface=0.1, cushion=0.2, ball_ball=0.05)
SMOOTH = Friction()
GLIDE = Friction(surface=0.01, cushion=0.2, ball_ball=0.05)
CHALK = Friction(ball_ball=0.05)
ROLLS = Friction(surface=0.2, rolling=0.1)
PULL, DRAG = 0.2 * STANDARD_GRAVITY, 0.1 * STANDARD_GRAVITY  # m/s^2; of sliding, and of rolling

Row = Sequence[float]  # x, y (m), vx, vy (m/s), and the roll of a ball that has one


def scaled(
    rows: Iterable[Row], size: float = 1.0, faster: float = 1.0, shift: Point = (0.0, 0.0)
) -> list[Row]:
    """Return the rows with places scaled and then shifted (m), and with velocities scaled."""
    dx, dy = shift
    return [(size * x + dx, size * y + dy, faster * vx, faster * vy) for x, y, vx, vy in rows]


def rectangle(length: float, width: float, corner: Point = (0.0, 0.0)) -> Table:
    """Return a table of that size (m) with its lower left corner anywhere."""
    x, y = corner
    return Table(((x, y), (x + length, y), (x + length, y + width), (x, y + width)))


def scene_of(
    rows: Iterable[Row], table: Table | None = None, e: float | Restitution = 1.0,
    friction: Friction = SMOOTH, time: float | None = None, *, r: float = R,
    heavier: Mapping[int, float] | None = None, **parts: Any,
) -> Scene:  # fmt: skip
    """Return a scene with one restitution, or with those given, for a time (s; None: to rest).

    Balls have one radius ``r`` (m), and one mass except those that are ``heavier`` by a factor.
    """
    factors = heavier or {}
    balls = tuple(
        Ball(str(k), (x, y), r, M * factors.get(k, 1.0), k == 0, (vx, vy), None, *roll)
        for k, (x, y, vx, vy, *roll) in enumerate(rows)
    )
    restitution = Restitution(e, None, e) if isinstance(e, float) else e
    return Scene(balls, table, restitution, friction, Physics(max_time=time), **parts)


def diagonal(label: str, table: Table, v: float, e: float, mu: float) -> Case:
    """Return a case of a ball that runs along the diagonal into a corner; v (m/s) is along x."""
    scene = scene_of([(0.25, 0.25, v, v)], table, e, Friction(0.05, mu))
    return Case(label, scene, (must.on_the_diagonal,))


def unit(degrees: float) -> Point:
    """Return the unit vector in that direction."""
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def grip(speed: float, length: float) -> float:
    """Return the coefficient of surface friction that stops a ball after ``length`` (m)."""
    return speed * speed / (2.0 * length * STANDARD_GRAVITY)


def far(v: float, w: float, time: float = math.inf, drag: float = DRAG) -> float:
    """Return how far (m) a ball slides and rolls from v with a roll w (m/s), to rest or for a time.

    It slides for 2 |v - w| / (7 mu_s g) s, until it rolls at 5/7 v + 2/7 w.
    """
    slides, last = 2.0 * abs(v - w) / (7.0 * PULL), (5.0 * v + 2.0 * w) / 7.0
    rolls = min(abs(last) / drag if drag else math.inf, time - slides)
    return (v + last) / 2.0 * slides + (last - math.copysign(drag, last) * rolls / 2.0) * rolls


def crowd(count: int, box: float) -> list[Row]:
    """Return balls on a grid in a square box (m), each in its own direction at 1 m/s."""
    rng, side = random.Random(1), math.ceil(math.sqrt(count))
    pitch = box / side
    places = (((k % side + 0.5) * pitch, (k // side + 0.5) * pitch) for k in range(count))
    return [(*place, *unit(rng.uniform(0.0, 360.0))) for place in places]


def rack(gap: float) -> list[Row]:
    """Return a triangle of fifteen balls, each with a gap (m) to the next ones."""
    pitch = 2.0 * R + gap
    return [
        (1.25 + row * pitch * math.sqrt(0.75), (k - row / 2.0) * pitch, *REST)
        for row in range(5) for k in range(row + 1)
    ]  # fmt: skip


# On a table of 2 m by 1 m, two balls move among others that rest; three of those touch.
MIXED: tuple[Row, ...] = (
    (0.5, 0.5, 3.0, 0.25), (1.0, 0.5, *REST), (1.25, 0.625, *REST), (1.5, 0.25, *REST),
    (1.75, 0.5 + R, -1.0, 0.0),
)  # fmt: skip
RIGHT = 1.0 + 2.0 * R  # m
TOUCHING = (*MIXED[:2], (RIGHT, 0.5, *REST), (RIGHT, 0.5 + 2.0 * R, *REST), *MIXED[3:])
TABLE = rectangle(2.0, 1.0)


# -- numbers large and small -----------------------------------------------------------------------


@extreme("speeds", "1e-6 to 1e6 m/s on a 2 m table")
def speeds() -> Iterator[Case]:
    """Shoot a ball at another one, which lies nearer if the ball is slow."""
    for speed in (1.0, 1e-6, 1e3, 1e6):
        (vx, vy), (ux, uy) = unit(20.0), unit(23.0)
        far = 2.0 * R + min(0.25, 0.01 * speed**2)
        target = (0.5 + far * ux, 0.375 + far * uy)
        rows = ((0.5, 0.375, speed * vx, speed * vy), (*target, *REST), (1.5, 0.75, *REST))
        yield Case(f"{speed:g} m/s", scene_of(rows, TABLE, LIVELY, CLOTH))


@extreme("mass ratios", "up to 1e9 and 1e-9")
def masses() -> Iterator[Case]:
    """Hit one ball of another mass from both sides."""
    rows = ((0.0, 0.0, 2.0, 0.0625), (0.375, R, *REST), (0.75, R, -1.0, 0.0), (0.5, -0.125, *REST))
    for ratio in (1.0, 1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9):
        yield Case(f"1 : {ratio:g}", scene_of(rows, None, 0.9, CHALK, 1.0, heavier={1: ratio}))


@extreme("radius ratios", "up to 1000")
def radii() -> Iterator[Case]:
    """Let small balls meet one that is half a metre in radius."""
    big = Ball("big", (1.0, 1.25), 0.5, M, velocity=(0.5, 0.125))
    for ratio in (1.0, 10.0, 100.0, 1000.0):
        row, other = (3.0, 1.25, -2.0, 0.03125), Ball("other", (0.5, 0.5), 0.125 / ratio, M)
        small = scene_of([row], rectangle(4.0, 2.5), LIVELY, CLOTH, r=0.5 / ratio)
        yield Case(f"1 : {ratio:g}", replace(small, balls=(big, *small.balls, other)))


@extreme("restitution", "0 and 1, three balls touching")
def restitutions() -> Iterator[Case]:
    """Vary the restitution from elastic to sticking."""
    for label, ball, cushion in (
        ("0.9, cushions 0.7", 0.9, 0.7), ("1", 1.0, 1.0), ("0, cushions 0.7", 0.0, 0.7),
        ("0.9, cushions 0", 0.9, 0.0), ("0", 0.0, 0.0),
    ):  # fmt: skip
        yield Case(label, scene_of(TOUCHING, TABLE, Restitution(ball, None, cushion), CLOTH))


@extreme("friction", "0 and 10, of balls, cushions and cloth")
def frictions() -> Iterator[Case]:
    """Vary friction from none to far more than it takes to stop all slip."""
    for label, friction in (
        ("as in the report", CLOTH), ("0", SMOOTH), ("balls 10", Friction(0.1, 0.2, 10.0)),
        ("cushions 10", Friction(0.1, 10.0, 0.05)), ("surface 10", Friction(10.0, 0.2, 0.05)),
        ("10", Friction(10.0, 10.0, 10.0)),
    ):  # fmt: skip
        rows = scaled(MIXED, faster=1.0 if friction.surface < 1.0 else 5.0)  # so that balls meet
        time = None if friction.surface else 3.0
        yield Case(label, scene_of(rows, TABLE, LIVELY, friction, time))


@extreme("time steps", "1e-7 to 0.5 s", steps=EVERY_STEP)
def time_steps() -> Iterator[Case]:
    """Play one small, fast scene at all steps: it lasts 0.1 s and has ten contacts or more."""
    size, friction = 2.0**-4, Friction(grip(3.0, 0.25), 0.2, 0.05)
    table = rectangle(2.0 * size, size)
    yield Case("", scene_of(scaled(MIXED, size), table, LIVELY, friction, r=R * size))


@extreme("table sizes", "1 mm to 10 km, to scale and with usual balls")
def table_sizes() -> Iterator[Case]:
    """Play on the same table in every size, then with balls of usual size on the largest."""
    for length in (1.0, 1e-3, 100.0, 1e4):
        alike = must.unless("weakening", must.as_in(sized(1.0), scale=length))
        yield Case(f"{length:g} m", sized(length), (alike,))
    yield Case("1e4 m, usual balls", sized(1e4, R / 1e4))


def sized(length: float, radius: float = R) -> Scene:
    """Return a scene whose table is crossed in about 1 s; a radius is a share of ``length`` (m)."""
    rows: list[Row] = [
        (0.25, 0.125, 1.5, 0.25), (0.75, 0.125 + 0.5 / 6.0 - radius, *REST), (0.5, 0.375, *REST),
        (0.375, 0.25, 0.25, -1.0),
    ]  # fmt: skip
    friction = Friction(grip(1.5 * length, 2.0 * length), 0.2, 0.05)
    rows, table = scaled(rows, length, length), rectangle(length, length / 2.0)
    return scene_of(rows, table, LIVELY, friction, r=length * radius)


@extreme("far from the origin", "up to 1e7 m")
def origins() -> Iterator[Case]:
    """Put the same table farther and farther from the origin; starts are exact up to 1e7 m."""
    home = scene_of(MIXED, TABLE, LIVELY, CLOTH)
    for away in (0.0, 1e3, 1e5, 1e7):
        shift = (away, -away)
        rows, table = scaled(MIXED, shift=shift), rectangle(2.0, 1.0, shift)
        claim = must.as_in(home, shift=shift)
        yield Case(f"{away:g} m", scene_of(rows, table, LIVELY, CLOTH), (claim,))


# -- contacts at one instant, or nearly ------------------------------------------------------------


@extreme("frozen racks of 15", "gaps of 1e-6 to 0 m, hit head-on")
def racks() -> Iterator[Case]:
    """Hit a rack of 15 head-on: the break stays symmetric."""
    for gap in (1e-6, 1e-9, 1e-12, 1e-15, 0.0):
        rows, table = [(0.5, 0.0, 4.0, 0.0), *rack(gap)], rectangle(2.0, 1.0, (0.0, -0.5))
        scene = scene_of(rows, table, Restitution(0.95, None, 0.7), CLOTH)
        yield Case(f"gaps of {gap:g} m", scene, (must.mirrored,))


@extreme("Newton's cradles", "2 to 7 balls, gaps of 0")
def cradles() -> Iterator[Case]:
    """Hit a row of touching balls: as many balls leave it as hit it, at the same speed."""
    for strikers, count in ((1, 2), (1, 3), (1, 4), (1, 5), (1, 6), (1, 7), (2, 5), (3, 7)):
        speeds = [1.0] * strikers + [0.0] * (count - strikers)
        rows = [(2.0 * R * k - 0.25 * v, 0.0, v, 0.0) for k, v in enumerate(speeds)]
        ends = {str(k): (v, 0.0) for k, v in enumerate(reversed(speeds))}
        scene = scene_of(rows, friction=CHALK, time=1.0)
        yield Case(f"{strikers} on {count - strikers}", scene, (must.leave_with(ends),))


@extreme("meeting at one instant", "2 to 6 balls, and around one")
def meetings() -> Iterator[Case]:
    """Let balls from all sides meet at one instant, around nothing or around a ball at rest."""
    for e in (0.9, 0.0):
        for count in (2, 3, 4, 6):
            turned = (unit(360.0 * k / count) for k in range(count))
            around = [(0.5 * x, 0.5 * y, -x, -y) for x, y in turned]
            for where, centre in (("meet", []), ("around one", [(0.0, 0.0, *REST)])):
                scene = scene_of([*centre, *around], None, e, CHALK, 1.0)
                yield Case(f"{count} {where}, e = {e:g}", scene, (must.all_as_far,))


@extreme("one after the other", "into two balls 1e-3 to 1e-12 s apart, and at once")
def orders() -> Iterator[Case]:
    """Run a ball into one at 30 degrees, and a moment later into another at -30, or into both.

    A moment apart, the hits have a closed form however short the moment is. At one instant the
    order is unknown, and the run must say how far the ends may lie elsewhere.
    """
    for e in (1.0, 0.5):
        for moment in (1e-3, 1e-6, 1e-9, 1e-12, 0.0):
            # The ball hits the first one when it is at the origin, 0.5 s after the start.
            (vx, vy), (x, y), rows, ends = (1.0, 0.0), (0.0, 0.0), [(-0.5, 0.0, 1.0, 0.0)], {}
            for id_, (nx, ny) in (("1", unit(30.0)), ("2", unit(-30.0))):
                rows.append((x + 2.0 * R * nx, y + 2.0 * R * ny, *REST))
                given = (1.0 + e) / 2.0 * (vx * nx + vy * ny)
                vx, vy, ends[id_] = vx - given * nx, vy - given * ny, (given * nx, given * ny)
                x, y = vx * moment, vy * moment
            label, claim = "at one instant", must.know_of_ends({"0": (0.5 * vx, 0.5 * vy)})
            if moment:
                label, claim = f"{moment:g} s apart", must.leave_with({"0": (vx, vy), **ends})
            yield Case(f"{label}, e = {e:g}", scene_of(rows, e=e, time=1.0), (claim,))


@extreme("head-on hits", "zero slip, at five angles")
def head_ons() -> Iterator[Case]:
    """Hit without slip: the other ball leaves along the line of centres."""
    for angle in (0.0, 30.0, 45.0, 90.0, 165.0):
        x, y = unit(angle)
        ends = {"0": (0.025 * x, 0.025 * y), "1": (0.975 * x, 0.975 * y)}
        scene = scene_of([(0.0, 0.0, x, y), (0.5 * x, 0.5 * y, *REST)], None, 0.95, CHALK, 1.0)
        yield Case(f"{angle:g} degrees", scene, (must.leave_with(ends),))


@extreme("grazing hits", "within 1e-12 of a miss or a hit")
def grazing_hits() -> Iterator[Case]:
    """Let a ball pass another nearly at the sum of the radii: it hits, or it misses."""
    for share in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12, 0.0):
        beside = 2.0 * R * (1.0 + share)
        inside = max(2.0 * R - beside, 0.0) * (2.0 * R + beside)
        dv_n = 0.95 * math.sqrt(inside) / (2.0 * R)  # m/s, for e = 0.9
        speed = dv_n * math.hypot(1.0, CHALK.ball_ball)
        scene = scene_of([(-0.5, beside, 1.0, 0.0), (0.0, 0.0, *REST)], None, 0.9, CHALK, 1.0)
        leaves = must.unless("weakening", must.leaves_at("1", speed))
        claims = (must.contacts_are(int(beside < 2.0 * R)), leaves)
        yield Case(f"{share:+g}", scene, claims)


# -- walls -----------------------------------------------------------------------------------------


@extreme("exact corners", "of a square, and sticking out")
def corners() -> Iterator[Case]:
    """Run a ball along the diagonal into a square's corner, or onto a corner that sticks out."""
    square = rectangle(1.0, 1.0)
    ell = Table(((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0)))
    for label, table, e, mu in (
        ("smooth", square, 0.7, 0.0), ("rough", square, 0.7, 0.2), ("reflex", ell, 0.7, 0.2),
        ("e = 1", square, 1.0, 0.0), ("e = 0", square, 0.0, 0.2),
        ("friction 10", square, 0.7, 10.0), ("reflex, e = 0", ell, 0.0, 0.0),
    ):  # fmt: skip
        yield diagonal(label, table, 1.0 if table is ell else -1.0, e, mu)


@extreme("squeezed to a cushion", "by a ball up to 1e8 times as heavy")
def squeezes() -> Iterator[Case]:
    """Let a heavy ball drive a light one to a cushion; elastic hits count the digits of pi.

    With a mass ratio N there are ceil(pi / atan(sqrt(1/N))) - 1 hits (Galperin 2003). Hits that
    lose energy never end here (inelastic collapse), and bring both balls to rest at the cushion.
    """
    for ratio in (1e2, 1e4, 1e6, 1e8):
        hits = math.ceil(math.pi / math.atan(math.sqrt(1.0 / ratio))) - 1
        rows, table = [(2.0, 0.5, -1.0, 0.0), (1.0, 0.5, *REST)], rectangle(16.0, 1.0)
        scene = scene_of(rows, table, time=9.0, heavier={0: ratio})
        yield Case(f"1 : {ratio:g}", scene, (must.contacts_are(hits),), slow=ratio > 1e4)
    far = 2.0**20  # m from the origin, where numbers are 2.3e-10 m apart
    for e in (0.9, 0.5, 0.0):
        for label, beside, x in (("", 0.0, 0.0), (", aslant", R / 4.0, 0.0), (", far", 0.0, far)):
            rows = [(x + 2.0, 0.5, -1.0, 0.0), (x + 1.0, 0.5 + beside, *REST)]
            scene = scene_of(rows, rectangle(8.0, 1.0, (x, 0.0)), e, GLIDE, heavier={0: 1e6})
            at_rest = must.end_at({"0": (x + 3.0 * R, 0.5), "1": (x + R, 0.5)})
            slow = e == 0.5 or (e == 0.9 and label != "")
            yield Case(f"1 : 1e6, e = {e:g}{label}", scene, (at_rest,) * (not beside), slow=slow)


@extreme("slow oblique bounces", "e = 1, at 1e-6 to 1e6 radii a second", "coulomb")
def bounces() -> Iterator[Case]:
    """Let a ball come to a cushion at 45 degrees: it leaves as fast as it came, however slow.

    Engines with a threshold of restitution glue slow balls to the wall (issue 710 of matter-js,
    1219 of GDevelop, 3094 of bullet3).
    """
    for speed in (1.0, 1e-3, 1e3, 1e-6, 1e6):
        v, gap = R * speed, R * min(speed, 1.0) / 1.5  # m/s, m; no step ends at the contact
        claims = (must.contacts_are(1), must.leave_with({"0": (v, v)}))
        scene = scene_of([(1.0, R + gap, v, -v)], TABLE, time=1.5 * gap / v)
        yield Case(f"{speed:g} radii a second", scene, claims)


@extreme("driven at a wall", "its velocity is set into the wall in each of 30 frames", "coulomb")
def driven() -> Iterator[Case]:
    """Set a ball's velocity into a cushion in every frame: it must stay outside.

    So people move players in games (issue 212 of Chipmunk2D, issue 840 of matter-js).
    """
    for label, e, friction, speed in (
        ("e = 0.7", 0.7, SMOOTH, 1.0), ("e = 1", 1.0, SMOOTH, 1.0), ("e = 0", 0.0, SMOOTH, 1.0),
        ("e = 0, with friction", 0.0, CLOTH, 1.0), ("e = 0, at 1e-6 m/s", 0.0, SMOOTH, 1e-6),
        ("e = 0, at 100 m/s", 0.0, SMOOTH, 100.0),
    ):  # fmt: skip
        scene = scene_of([(0.5, R, 0.5, -speed)], TABLE, e, friction, 1.0 / 60.0)
        yield Case(label, scene, (must.stay_inside_when_driven(30),))


@extreme("pockets", "rims grazed within 1e-12, and one reached at contact")
def pockets() -> Iterator[Case]:
    """Let a ball's centre pass inside or outside a rim, or come to it as the ball meets others.

    A ball that is at the rim leaves the table before it meets a ball and a cushion there.
    """
    hole = Pocket("hole", (0.0, 0.0), 2.0 * R)
    for share in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12):
        beside = hole.radius * (1.0 + share)
        scene = scene_of([(-0.5, beside, 1.0, 0.0)], time=1.0, pockets=(hole,))
        yield Case(f"{share:+g}", scene, (must.pocket("0" * (share < 0.0)),))
    x, y = unit(80.0)
    rows = [(-2.0 * R - 0.5, 0.0625, 1.0, -0.125), (2.0 * R * (x - 1.0), 2.0 * R * y, *REST)]
    table = rectangle(4.0, 2.0, (-2.0, -R))
    scene = scene_of(rows, table, LIVELY, time=1.0, pockets=(hole,))
    stays = must.leave_with({"0": REST, "1": REST})
    yield Case("with a ball and a cushion", scene, (must.pocket("0"), stays))


@extreme("converging cushions", "a wedge of 60 to 0.1 degrees")
def wedges() -> Iterator[Case]:
    """Run a ball into a wedge; without losses its path unfolds to a line through images of it.

    Aimed a seventh of the angle beside the tip, a ball has ceil(180 / angle - 1/7 - 1/2) contacts.
    """
    for angle in (60.0, 10.0, 1.0, 0.1):
        half = math.radians(angle / 2.0)
        table = Table(((0.0, 0.0), (1.0, -math.tan(half)), (1.0, math.tan(half))))
        rows, r = [(0.5, 0.0, *unit(180.0 - angle / 7.0))], math.sin(half) / 8.0
        hits = must.contacts_are(math.ceil(180.0 / angle - 1.0 / 7.0 - 0.5))
        yield Case(f"{angle:g} degrees", scene_of(rows, table, time=1.0, r=r), (hits,))
        for e in (0.7, 0.0):
            lossy = scene_of(rows, table, e, CLOTH, r=r)
            yield Case(f"{angle:g} degrees, e = {e:g}", lossy, slow=angle == 1.0)


# -- balls that slide, then roll -------------------------------------------------------------------


@extreme("sliding, then rolling", "draw that cancels the motion, slips of 1e-12, no end", "coulomb")
def slides_and_rolls() -> Iterator[Case]:
    """Let a ball slide, then roll: draw cancels its motion, slip is tiny, or rolling has no end."""
    for label, speed, roll, drag in (
        ("draw", 1.0, -1.0, DRAG), ("slip of 1e-9", 1.0, 1.0 + 1e-9, DRAG),
        ("slip of 1e-12", 1.0, 1.0 + 1e-12, DRAG), ("-1e-12", 1.0, 1.0 - 1e-12, DRAG),
        ("no slip", 1.0, 1.0, DRAG), ("v = w = 0 at once", 1.0, -2.5, DRAG),
        ("at 1e-6 m/s", 1e-6, -2.5, DRAG), ("at 1e3 m/s", 1e3, -2.5, DRAG),
        ("rolls for ever", 1.0, 0.5, 0.0),
    ):  # fmt: skip
        time = math.inf if drag else 3.0
        (x, y), track = unit(20.0), far(speed, roll * speed, time, drag)
        friction = replace(ROLLS, rolling=drag / STANDARD_GRAVITY)
        row = (0.0, 0.0, speed * x, speed * y, roll)
        scene = scene_of([row], friction=friction, time=None if drag else time)
        kinds = ["roll"] * (roll not in (1.0, -2.5)) + ["stop"] * (drag > 0.0)
        yield Case(label, scene, (must.end_at({"0": (track * x, track * y)}), must.happens(*kinds)))


@extreme("follow after a full hit", "at once, and within 1e-15 m of where it rolls", "coulomb")
def follows() -> Iterator[Case]:
    """Stop a ball by a full hit: it only rotates then, and sets off at 2/7 of its roll."""
    for roll in (1.0, 1e-6, -1.0):
        ends = {"0": (far(0.0, roll), 0.0), "1": (2.0 * R + far(1.0, 0.0), 0.0)}
        scene = scene_of([(0.0, 0.0, 1.0, 0.0, roll), (2.0 * R, 0.0, *REST)], friction=ROLLS)
        yield Case(f"at once, roll {roll:g}", scene, (must.end_at(ends), must.contacts_are(1)))
    slides, last = 12.0 / (49.0 * PULL), 5.0 / 7.0  # m, m/s
    for off in (1e-3, 1e-9, 1e-12, 1e-15, 0.0, -1e-15, -1e-12):
        x, v = slides + max(off, 0.0), math.sqrt(last * last - 2.0 * DRAG * max(off, 0.0))
        ends = {"0": (x + far(0.0, v), 0.0), "1": (x + 2.0 * R + far(v, 0.0), 0.0)}
        rows = [(0.0, 0.0, 1.0, 0.0), (slides + off + 2.0 * R, 0.0, *REST)]
        scene = scene_of(rows, friction=ROLLS)
        # A hit just before the end of sliding moves the ends by less than this.
        claims = (must.end_at(ends, 1e-11 * (off < 0.0)), must.contacts_are(1))
        yield Case(f"rolls {off:+g} m before", scene, claims)


@extreme("draw that turns back", "at a face, corner or rim, within 1e-12", "coulomb")
def turns_back() -> Iterator[Case]:
    """Let a ball with draw turn back as it grazes a face, a corner or a rim, or just before."""
    ell = Table(((-4.0, -4.0), (0.0, -4.0), (0.0, -R), (4.0, -R), (4.0, 4.0), (-4.0, 4.0)))
    hole = Pocket("hole", (0.0, 0.0), 2.0 * R)
    for deep in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12):
        met = int(deep > 0.0)
        # A full hit turns (0.25, -0.5) m/s into (0, -0.5) m/s; the roll stays (-1, 2) m/s.
        y = 0.05 * math.hypot(1.0, 2.5) / PULL - deep
        rows = [(0.0, y, 0.25, -0.5, -4.0), (2.0 * R, y, *REST)]
        face = scene_of(rows, rectangle(8.0, 4.0, (-4.0, -R)), friction=ROLLS)
        yield Case(f"face {deep:+g} m", face, (must.contacts_are(1 + met),))
        y = 0.125 / PULL - deep
        corner = scene_of([(0.0, y, 0.0, -0.5, -4.0)], ell, friction=ROLLS)
        yield Case(f"corner {deep:+g} m", corner, (must.contacts_are(met),))
        rim = scene_of([(0.0, y + hole.radius, 0.0, -0.5, -4.0)], friction=ROLLS, pockets=(hole,))
        yield Case(f"rim {deep:+g} m", rim, (must.pocket("0" * met),))


@extreme("pressed by a roll", "to a cushion, or to a ball that lies there", "coulomb")
def pressed_by_rolls() -> Iterator[Case]:
    """Let a roll press a ball to a cushion, or to a ball that lies there: there they rest."""
    alone, other = (2.0 - R - 2.0**-9, 0.5, 0.125, 0.0, 1.0), (2.0 - R, 0.5, *REST)
    follower = (2.0 - 3.0 * R - 2.0**-9, 0.5, 0.125, 0.0, 1.0)
    for label, e, rows in (
        ("e = 0", 0.0, [alone]), ("e = 0.2", 0.2, [alone]),
        ("follows a frozen ball, e = 0", 0.0, [follower, other]),
    ):  # fmt: skip
        claim = must.know_of_ends({"0": (2.0 - (2 * len(rows) - 1) * R, 0.5)})
        yield Case(label, scene_of(rows, TABLE, e, ROLLS), (claim,), slow=len(rows) > 1)


@extreme("soft breaks", "slow shots at a rack, with few events", "coulomb")
def soft_breaks() -> Iterator[Case]:
    """Break a rack by a slow ball that rolls: balls stay in contact, and the run ends soon."""
    friction = replace(CLOTH, surface=0.2, rolling=0.01)
    for label, gap, speed in (
        ("1 m/s", 0.0, 1.0), ("0.25 m/s", 0.0, 0.25), ("0.25 m/s, gaps of 1e-6 m", 1e-6, 0.25),
    ):  # fmt: skip
        rows = [(1.0, 0.0, speed, 0.0, 1.0), *rack(gap)]
        table, restitution = rectangle(2.0, 1.0, (0.0, -0.5)), Restitution(0.95, None, 0.7)
        scene = scene_of(rows, table, restitution, friction)
        yield Case(label, scene, max_events=1_000, slow=gap == 0.0)


# -- arcs, posts and pins --------------------------------------------------------------------------


@extreme("around a circle", "up to 10,000 contacts, by equal angles", "coulomb")
def circles() -> Iterator[Case]:
    """Let a ball go around a circle: each hit takes it on by twice its angle to the tangent."""
    angle, inner = 0.3, 0.5 - R
    middle = inner * math.cos(angle)  # m; the distance of each chord from the table's middle
    for hits, speed in ((10, 4.0), (300, 4.0), (10_000, 64.0)):
        time = (hits + 0.5) * 2.0 * inner * math.sin(angle) / speed
        row = (0.5, R, speed * math.cos(angle), speed * math.sin(angle))
        at = (2 * hits + 1) * angle - math.pi / 2.0
        ends = {"0": (0.5 + middle * math.cos(at), 0.5 + middle * math.sin(at))}
        # Each hit turns the ball by a few roundings, and all later hits add that angle again.
        turned = must.CARE * EPSILON * hits * hits * inner
        claims = (must.contacts_are(hits), must.end_at(ends, turned))
        scene = scene_of([row], Table.circle(0.5), time=time)
        yield Case(f"{hits} contacts", scene, claims, slow=hits > 300)


@extreme("tangent to something round", "an arc, a post or a pin, within 1e-12 of a miss", "coulomb")
def tangents() -> Iterator[Case]:
    """Let a ball pass an arc that bulges inwards, a post or a pin: it hits, or it misses."""
    nose = Table(TABLE.outline, (-0.25, 0.0, 0.0, 0.0))  # 0.25 m high, with a radius of 2.125 m
    for what, table, posts, radius in (
        ("arc", nose, (), 2.125), ("post", None, (Post((1.0, 0.0), 0.25),), 0.25),
        ("pin", None, (Post((1.0, 0.25), 0.0),), 0.0),
    ):  # fmt: skip
        for share in (-1e-6, 1e-6, -1e-9, 1e-9, -1e-12, 1e-12, 0.0):
            deep, apart = max(-share * R, 0.0), radius + R
            sine, cosine = math.sqrt(deep * (2.0 * apart - deep)) / apart, 1.0 - deep / apart
            leaves = (1.0 - 1.9 * sine * sine, 1.9 * sine * cosine)
            # Rounding lets the ball come a few units too deep, which turns the normal.
            slack = must.CARE * EPSILON / (apart * sine) if sine else 0.0
            claims = (must.contacts_are(int(sine > 0.0)), must.leave_with({"0": leaves}, slack))
            row = (0.25, 0.25 + R * (1.0 + share), 1.0, 0.0)
            scene = scene_of([row], table, 0.9, time=1.0, posts=posts)
            yield Case(f"{what} {share:+g}", scene, claims)


@extreme("joint of a face and an arc", "hit within 1e-9 to 1e-15 m", "coulomb")
def joints() -> Iterator[Case]:
    """Hit the joint of a face and an arc that continues it: one contact, and no gap there."""
    e, pull = 0.7, CLOTH.surface * STANDARD_GRAVITY
    back = e * e * (4.0 / (2.0 * pull) - (1.0 - R))  # m; how far the ball comes back
    for off in (-1e-9, 1e-9, -1e-10, 1e-10, -1e-12, 1e-12, -1e-15, 1e-15, 0.0):
        # The arc's normal is turned by off / (1 m) there, and the ball's path back by twice that.
        at_rest = must.end_at({"0": (3.0 + off, R + back)}, 2.0 * max(off, 0.0))
        scene = scene_of([(3.0 + off, 1.0, 0.0, -2.0)], Table.stadium(4.0, 2.0), LIVELY, CLOTH)
        yield Case(f"{off:+g} m", scene, (must.contacts_are(1), at_rest))


@extreme("corners of two arcs", "ran into, and sticking out", "coulomb")
def corners_of_arcs() -> Iterator[Case]:
    """Run a ball along the diagonal into a corner of two arcs, or onto one that sticks out."""
    square = rectangle(1.0, 1.0).outline
    for label, bulge, e, mu in (
        ("inwards, e = 0.7", -0.125, 0.7, 0.0), ("inwards, rough", -0.125, 0.7, 0.2),
        ("inwards, e = 0", -0.125, 0.0, 0.2), ("reflex, e = 0.7", 0.625, 0.7, 0.2),
        ("reflex, e = 1", 0.625, 1.0, 0.0), ("reflex, e = 0", 0.625, 0.0, 0.0),
    ):  # fmt: skip
        yield diagonal(label, Table(square, (bulge, 0.0, 0.0, bulge)), -1.0, e, mu)


@extreme("held to an arc", "from a tangent, and after hits that converge", "coulomb")
def held_to_arcs() -> Iterator[Case]:
    """Let a ball slide along the inside of a circle, from a tangent or after hits that converge.

    Along the arc d(v^2)/ds = -2 (mu_s g + mu v^2 / R). Hits at an angle to the tangent have closing
    speeds that shrink by e, and each turns the ball by twice the angle at which it leaves.
    """
    inner, speed, time = 0.5 - R, 1.0, 0.375
    for label, e, angle, mu in (
        ("e = 0", 0.0, 0.0, 0.0), ("e = 0, rough", 0.0, 0.0, 0.2), ("e = 0.2", 0.2, 0.0, 0.2),
        ("e = 0, from a hit", 0.0, 0.25, 0.2), ("e = 0.2, converging", 0.2, 0.25, 0.2),
    ):  # fmt: skip
        v_n, v_t, turned, left = speed * math.sin(angle), speed * math.cos(angle), 0.0, time
        while v_n > 1e-12:  # One chord after another, and then along the arc
            half = math.atan2(v_n, v_t)
            left -= 2.0 * inner * math.sin(half) / math.hypot(v_n, v_t)
            v_t, v_n, turned = v_t - mu * (1.0 + e) * v_n, e * v_n, turned + 2.0 * half
        along = math.log1p(mu * v_t * left / inner) / mu if mu else v_t * left / inner
        at = turned + along - math.pi / 2.0
        ends = {"0": (0.5 + inner * math.cos(at), 0.5 + inner * math.sin(at))}
        row = (0.5, R, speed * math.cos(angle), speed * math.sin(angle))
        scene = scene_of([row], Table.circle(0.5), e, Friction(0.0, mu), time)
        yield Case(label, scene, (must.know_of_ends(ends),), slow=angle == 0.0)


# -- scenes with known answers, many contacts, runs without end, and Listing 3 ---------------------


extreme("known answers", "scenes that other programs play, too", "coulomb")(known_answers)


@extreme("many contacts", "up to 100,000 without losses", "coulomb")
def many_contacts() -> Iterator[Case]:
    """Play ten balls in a box, without losses, for this many contacts."""
    scene = scene_of(crowd(10, 0.5), rectangle(0.5, 0.5), time=1e6)
    for count in (1_000, 10_000, 100_000):
        yield Case(f"{count}", scene, max_events=count, ends="max_events", slow=count > 1_000)


@extreme("many balls", "up to 1,000")
def many_balls() -> Iterator[Case]:
    """Play a box full of balls, for half a second."""
    for count in (10, 100, 1_000):
        box = 0.125 * math.ceil(math.sqrt(count))
        scene = scene_of(crowd(count, box), rectangle(box, box), LIVELY, CLOTH, 0.5)
        yield Case(f"{count}", scene, slow=count > 100)


@extreme("dense piles", "9 and 25 moving balls, e from 0.9 to 0", "coulomb")
def piles() -> Iterator[Case]:
    """Pack balls with gaps of a tenth of a radius, all moving, until they have come to rest."""
    for count, e, heavy in (
        (9, 0.9, 1.0), (9, 0.5, 1.0), (25, 0.5, 1.0), (9, 0.5, 100.0), (9, 0.0, 1.0),
    ):  # fmt: skip
        box = 2.1 * R * math.ceil(math.sqrt(count))
        heavier = dict.fromkeys(range(0, count, 3), heavy)
        scene = scene_of(crowd(count, box), rectangle(box, box), e, CLOTH, heavier=heavier)
        masses = f", 1 : {heavy:g}" if heavy > 1.0 else ""
        slow = count > 9 or heavy > 1.0 or e == 0.0
        yield Case(f"{count}, e = {e:g}{masses}", scene, slow=slow)


@extreme("never at rest", "no friction, max_time = pi s")
def never_at_rest() -> Iterator[Case]:
    """Let nothing brake: the run ends at its ``max_time``, to the last bit, and not before."""
    one = (0.5, 0.5, 1.0, 0.25)
    for label, rows, where in (
        ("one ball", [one], TABLE), ("along a cushion", [(0.5, R, 1.0, 0.0)], TABLE),
        ("no table", [one], None),
        ("three balls", [one, (1.0, 0.5, *REST), (1.5, 0.5, 0.0, 0.5)], TABLE),
    ):  # fmt: skip
        yield Case(label, scene_of(rows, where, time=math.pi))


@extreme("the report's law", "Listing 3 in an oblique hit", "published", because=LISTING)
def the_listing() -> Iterator[Case]:
    """Show what Listing 3, the report's own law, does to momentum and energy in an oblique hit."""
    for degrees in (0.0, 30.0, 60.0):
        x, y = unit(degrees)
        rows = ((-0.25 - 2.0 * R * x, -0.125 - 2.0 * R * y, 1.0, 0.5), (0.0, 0.0, *REST))
        scene = scene_of(rows, friction=Friction(ball_ball=0.2), time=1.0)
        yield Case(f"{degrees:g} degrees", scene, (must.momentum_kept, must.energy_kept))
