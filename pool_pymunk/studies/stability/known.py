"""These scenes have known answers: all solvers play them, and other programs, too (``torture/``).

They are plain numbers, in m, m/s, kg and s. Each says how its answer is known, and within which
errors a program is right.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from pool_pymunk.model import Ball, Friction, Physics, Point, Restitution, Scene, Table
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.trial import Case, Claim

R, POOL, M = 0.03, 0.028575, 0.17  # m, m, kg
REST = (0.0, 0.0)  # m/s
G = 9.81  # m/s^2
LIGHT, HEAVY = 1e-3, 1e3  # kg
BRAKE, SLOW_DOWN = 0.2 * G, 0.01 * G  # m/s^2; of a ball that slides, and of one that rolls
ROLLS: Mapping[str, Any] = {"friction": 0.2, "rolling": 0.01}

GITHUB = "https://github.com"
UNFOLDED = "closed form: a straight path, folded at the walls"
MOMENTUM = "closed form: momentum, energy and symmetry leave one answer"
SYMMETRY = "symmetry: what is mirrored stays mirrored"
SEVENTHS = "closed form: 5/7 and 2/7 of the speed"
KEPT = {"energy": 0.02}  # 2 % of energy is 1 % of speed.
KEPT_BACK = (  # what programs do not learn
    "about", "known", "right", "ends", "velocities", "gradient", "contacts", "mirrored", "case",
    "slow",
)  # fmt: skip
UNITS = {"velocities": "m/s", "energy": "of E", "gradient": ""}  # The others are lengths, in m.


class Disc(NamedTuple):
    """A disc has a place, a velocity, a radius and a mass."""

    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0
    r: float = R
    m: float = M


class Check(NamedTuple):
    """A check says what is compared, the known answer, what counts as right, and its unit."""

    kind: str
    answer: Any
    tolerance: float
    unit: str = "m"


@dataclass(frozen=True)
class KnownScene:
    """A scene has a known answer: the last places, velocities or ``gradient``, or an invariant.

    ``known`` says from where, and ``right`` within which error of each kind a program is right.
    ``walls`` are the corners of a closed outline, anticlockwise; ``thin`` ones have no thickness.
    ``together`` says that several balls meet at one instant, and the answer is that of this. The
    states are judged at ``looks`` equally spaced times, up to ``time`` (s). The scene is played in
    this number of ``parts``, each from the end of the last. ``reverse`` plays it, turns all
    velocities round, and plays it again. Balls that roll start with a ``roll``, a share of their
    velocity. ``nudge`` asks for the derivatives of the last ball's end along x by every ball's x
    and vx, by central differences of that size. ``limit`` is the processor time (s) for one play.
    ``case`` is its label among the extremes ("": its name; None: only others play it).
    """

    name: str
    about: str
    known: str
    balls: tuple[Disc, ...]
    time: float
    right: Mapping[str, float]
    walls: tuple[Point, ...] = ()
    restitution: float = 1.0
    wall_restitution: float = 1.0
    friction: float = 0.0
    rolling: float | None = None
    roll: float = 0.0
    gravity: float = 0.0
    ends: tuple[Point, ...] = ()
    velocities: tuple[Point, ...] = ()
    gradient: tuple[float, ...] = ()
    contacts: int | None = None
    mirrored: bool = False
    thin: bool = False
    together: bool = False
    looks: int = 1
    parts: int = 1
    reverse: bool = False
    nudge: float = 0.0
    thread: str = ""
    timed: bool = False
    limit: int = 60
    case: str | None = ""
    slow: bool = False

    @property
    def checks(self) -> tuple[Check, ...]:
        """Return what is compared of a program's answer; a scene that is reversed ends at home."""
        starts = [(ball.x, ball.y) for ball in self.balls]
        mirrored = ((k, starts.index((x, -y))) for k, (x, y) in enumerate(starts) if self.mirrored)
        answers: dict[str, Sequence[Any]] = {
            "ends": self.ends or starts, "velocities": self.velocities,
            "gradient": self.gradient, "mirror": tuple(mirrored),
        }  # fmt: skip
        return tuple(
            Check(kind, answers.get(kind), within, UNITS.get(kind, "m"))
            for kind, within in self.right.items()
        )

    @property
    def needs(self) -> tuple[str, ...]:
        """Return what a simulator must offer to play this."""
        sides = zip(self.walls, self.walls[1:] + self.walls[:1], strict=True)
        asked = {
            "restitution below 1": min(self.restitution, self.wall_restitution) < 1.0,
            "friction of sliding discs": self.friction > 0.0 and self.rolling is None,
            "balls that roll": self.rolling is not None,
            "gravity in the plane": self.gravity != 0.0,
            "any outline": any(ax != bx and ay != by for (ax, ay), (bx, by) in sides),
            "unequal masses": len({ball.m for ball in self.balls}) > 1,
            "hits of one instant": self.together,
            "unequal radii": len({ball.r for ball in self.balls}) > 1,
        }
        return tuple(need for need, is_asked in asked.items() if is_asked)

    def plain(self) -> dict[str, Any]:
        """Return all that a program learns: everything except the answer."""
        lines = len({(ball.y, ball.vy) for ball in self.balls})
        pairs = ((a, b) for k, a in enumerate(self.balls) for b in self.balls[:k])
        touch = any(abs(math.dist(a[:2], b[:2]) - a.r - b.r) < 1e-9 for a, b in pairs)
        numbers = {key: value for key, value in vars(self).items() if key not in KEPT_BACK}
        kinds = {"touching": touch, "in line": lines == 1 < len(self.balls)}
        return numbers | kinds | {"needs": self.needs}

    @property
    def table(self) -> Table | None:
        """Return the walls as a table."""
        return Table(self.walls) if self.walls else None

    @property
    def scene(self) -> Scene:
        """Return the scene as this program plays it."""
        balls = tuple(
            Ball(str(k), (x, y), r, m, velocity=(vx, vy), roll=self.roll)
            for k, (x, y, vx, vy, r, m) in enumerate(self.balls)
        )
        restitution = Restitution(self.restitution, cushion=self.wall_restitution)
        friction = Friction(self.friction, rolling=self.rolling)
        physics = Physics(gravity=G, max_time=self.time)
        return Scene(balls, self.table, restitution, friction, physics)

    @property
    def claims(self) -> tuple[Claim, ...]:
        """Return what is claimed of all solvers."""
        ids = [str(k) for k in range(len(self.balls))]
        found = list[Claim]()
        if self.velocities:
            found.append(must.leave_with(dict(zip(ids, self.velocities, strict=True))))
        if self.ends:
            found.append(must.end_at(dict(zip(ids, self.ends, strict=True))))
        if self.contacts is not None:
            found.append(must.contacts_are(self.contacts))
        return (*found, must.mirrored) if self.mirrored else tuple(found)


# -- closed forms ----------------------------------------------------------------------------------


def in_box(start: Point, velocity: Point, r: float, size: Point, time: float) -> Point:
    """Return where a lone ball in a rectangle from the origin is (m), e = 1."""
    one, other = zip(start, velocity, size, strict=True)
    (x, y) = (_folded(at - r, v * time, wide - 2.0 * r) + r for at, v, wide in (one, other))
    return x, y


def _folded(start: float, path: float, width: float) -> float:
    """Return where a point between two mirrors is (m), by a straight path that is folded."""
    unfolded = (start + path) % (2.0 * width)
    return min(unfolded, 2.0 * width - unfolded)


def in_wedge(start: Point, velocity: Point, half: float, time: float) -> Point:
    """Return where a lone ball is (m) in a wedge from the origin, by an unfolded path."""
    tip = R / math.sin(half)  # m; the tip of the wedge of centres
    x, y = start[0] - tip + velocity[0] * time, start[1] + velocity[1] * time
    angle = _folded(math.atan2(y, x) + half, 0.0, 2.0 * half) - half
    return tip + math.hypot(x, y) * math.cos(angle), math.hypot(x, y) * math.sin(angle)


def elastic(m: float, v: float, other_m: float, other_v: float) -> tuple[float, float]:
    """Return both velocities (m/s) after a head-on hit with e = 1."""
    common = (m * v + other_m * other_v) / (m + other_m)
    return 2.0 * common - v, 2.0 * common - other_v


def pi_velocities(light: float, heavy: float) -> tuple[float, float, int]:
    """Return both last velocities (m/s), and the hits, of Galperin's balls and a wall."""
    v, big, hits = 0.0, -1.0, 0
    while v > big or v < 0.0:
        v, big = elastic(light, v, heavy, big) if v > big else (-v, big)
        hits += 1
    return v, big, hits


def beside(across: float) -> tuple[Point, Point]:
    """Return both velocities after a ball at 1 m/s along x hits one ``across`` (m) beside it."""
    x, y = math.sqrt(4.0 * R * R - across**2) / (2.0 * R), across / (2.0 * R)
    return (1.0 - x * x, -x * y), (x * x, x * y)


def roll_on(speed: float, roll: float) -> float:
    """Return how far (m) a ball moves along its line: it slides, then rolls, then rests."""
    slip, rolls_at = speed - roll, speed - 2.0 / 7.0 * (speed - roll)
    slides = 2.0 / 7.0 * abs(slip) / BRAKE
    return (speed + rolls_at) / 2.0 * slides + rolls_at**2 / (2.0 * 0.01 * G)


def rack(
    pitch: float, tip: Point = (1.25, 0.0), along: Point = (1.0, 0.0)
) -> list[Sequence[float]]:
    """Return fifteen balls at rest in a triangle that opens ``along`` a direction from its tip."""
    (x, y), (a, b) = tip, along
    at = [
        (k * pitch * math.sqrt(0.75), (j - k / 2.0) * pitch) for k in range(5) for j in range(k + 1)
    ]
    return [(x + a * u - b * w, y + b * u + a * w, *REST) for u, w in at]


# -- the scenes ------------------------------------------------------------------------------------

AROUND = ((-1.27, -0.635), (1.27, -0.635), (1.27, 0.635), (-1.27, 0.635))
ROOM, SQUARE = Table.rectangle(2.0, 1.0).outline, Table.rectangle(4.5, 4.5).outline
TABLE = Table.rectangle(2.54, 1.27).outline
SIX = (
    Disc(0.5, 0.6, 4.0, 0.15), Disc(1.5, 0.635), Disc(1.62, 0.7), Disc(1.64, 0.56),
    Disc(1.9, 0.65), Disc(2.1, 0.3),
)  # fmt: skip
# These are the places (m) of SIX after 2 s, in forty digits; tests/test_torture.py computes them.
SIX_ENDS = (
    (1.44122631104375061, 0.929414110556115874), (1.9412329216008767, 0.305649623903262667),
    (1.62, 0.7), (1.64, 0.56), (1.874297236299658, 0.0635624828980220188),
    (2.50816199634496953, 1.21520200375483121),
)  # fmt: skip
MIRROR = tuple(  # No ball is on the axis, so every hit is of two balls.
    Disc(x, side * y, vx, side * vy)
    for x, y, vx, vy in ((-1.0, 0.3, 2.0, -0.1), (0.0, 0.24, 0.0, 0.0), (0.3, 0.1, 0.0, 0.0),
                         (0.6, 0.35, 0.0, 0.0))
    for side in (1.0, -1.0)
)  # fmt: skip
TEN_THOUSAND = KnownScene(
    "e = 1, ten thousand contacts", "ten balls in a box", "energy is kept",
    tuple(
        Disc(0.15 + 0.23 * (k % 4), 0.2 + 0.3 * (k // 4), math.cos(2.4 * k), math.sin(2.4 * k))
        for k in range(10)
    ),
    25.0, KEPT, Table.rectangle(1.0, 1.0).outline, parts=20, case="ten balls in a box", slow=True,
)  # fmt: skip


def known_scenes() -> Iterator[KnownScene]:
    """Yield all scenes."""
    yield from balls_that_meet()
    yield from walls()
    yield from unequal_and_inelastic()
    yield from braked()
    yield from for_others()


def balls_that_meet() -> Iterator[KnownScene]:
    """Yield elastic hits of equal balls, alone, at one instant, in racks, and within a graze."""
    comes = Disc(-0.5, 0.0, 1.0)
    yield KnownScene(
        "fast ball, ball at rest", "a ball at 100 m/s hits another one head-on", MOMENTUM,
        (Disc(0.0, 0.0, 100.0), Disc(1.0, 0.0)), 0.05, {"velocities": 1.0},
        velocities=(REST, (100.0, 0.0)),
    )  # fmt: skip
    leaves, angle = 2.0 * math.sqrt(3.0) / 5.0, math.radians(30.0)  # m/s, rad
    x, y = leaves * math.cos(angle), leaves * math.sin(angle)
    yield KnownScene(
        "three balls at once", "a ball hits two that touch, both at one instant", MOMENTUM,
        (comes, Disc(0.0, 0.03), Disc(0.0, -0.03)), 1.0, {"velocities": 0.01},
        velocities=((-0.2, 0.0), (x, y), (x, -y)), together=True,
    )  # fmt: skip
    yield KnownScene(
        "Newton's cradle", "a ball hits five that touch in a row",
        "experiment and textbook: one comes, one goes",
        (comes, *(Disc(0.06 * k, 0.0) for k in range(5))), 1.0, {"velocities": 0.01},
        velocities=(*[REST] * 5, (1.0, 0.0)),
    )  # fmt: skip
    frozen = KnownScene(
        "frozen rack", "a break along the axis of fifteen balls that touch", "energy is kept",
        (Disc(-0.6, 0.0, 3.0), *(Disc(*at) for at in rack(2.0 * R, (0.3, 0.0)))), 0.5,
        {**KEPT, "overlap": 3e-3}, AROUND, mirrored=True, looks=50,
    )  # fmt: skip
    yield frozen
    yield replace(
        frozen, name="frozen rack, mirrored", known=SYMMETRY, right={"mirror": 0.01}, looks=1,
        about="the same: the upper half mirrors the lower one", together=True, case=None,
    )  # fmt: skip
    yield KnownScene(
        "mirror", "two mirrored shots at mirrored balls, for three seconds", SYMMETRY, MIRROR, 3.0,
        {"mirror": 0.01}, AROUND, mirrored=True,
    )  # fmt: skip
    for label, part, share, within in (
        ("thin cut", "thousandth", 1e-3, 2e-3), ("graze", "billionth", 1e-9, 2e-6),
    ):  # fmt: skip
        across = 2.0 * R * (1.0 - share)
        yield KnownScene(
            label, f"a ball hits the outer {part} of another's width", MOMENTUM,
            (comes, Disc(0.0, across)), 1.0, {"velocities": within}, velocities=beside(across),
        )  # fmt: skip


def walls() -> Iterator[KnownScene]:
    """Yield elastic bounces, of balls alone and of several."""
    yield KnownScene(
        "fast ball, thin walls", "at 100 m/s in a room of walls without thickness", UNFOLDED,
        (Disc(0.4, 0.5, 100.0, 7.0),), 0.5, {"inside": 0.03, **KEPT}, ROOM,
        ends=(in_box((0.4, 0.5), (100.0, 7.0), R, (2.0, 1.0), 0.5),), thin=True, looks=50,
    )  # fmt: skip
    v = math.sqrt(2.0)
    corner = KnownScene(
        "corner", "into a corner of a square: at one wall 1e-9 m before the other one", UNFOLDED,
        (Disc(1.0, 1.0 + 1e-9, v, v, POOL),), 6.0, {"ends": 0.01}, SQUARE,
        ends=(in_box((1.0, 1.0 + 1e-9), (v, v), POOL, (4.5, 4.5), 6.0),),
    )  # fmt: skip
    yield corner
    yield replace(
        corner, name="corner, both walls at once", balls=(Disc(1.0, 1.0, v, v, POOL),),
        about="along the diagonal of a square table, to its corner",
        right={"inside": 3e-3, "ends": 0.01}, thread=f"{GITHUB}/ekiefl/pooltool/issues/217",
        ends=(in_box((1.0, 1.0), (v, v), POOL, (4.5, 4.5), 6.0),),
    )  # fmt: skip
    half = math.radians(10.0)
    yield KnownScene(
        "wedge", "a ball between walls that converge at 20 degrees", UNFOLDED,
        (Disc(3.0, 0.1, -1.0, 0.02),), 5.5, {"ends": 0.01},
        tuple((x, y * math.tan(half)) for x, y in ((0, 0), (4, -4), (4, 4))),
        ends=(in_wedge((3.0, 0.1), (-1.0, 0.02), half, 5.5),),
    )  # fmt: skip
    yield KnownScene(
        "e = 1, a thousand bounces", "a lone ball in a box, without gravity", "energy is kept",
        (Disc(0.5, 0.5, 1.9, 0.7),), 600.0, KEPT, ROOM,
        thread=f"{GITHUB}/liabru/matter-js/issues/256", slow=True,
    )  # fmt: skip
    yield TEN_THOUSAND
    yield KnownScene(
        "reversal", "two seconds forwards, all velocities reversed, two seconds more",
        "reversibility: it comes back to where it began", SIX[:4], 2.0, {"ends": 0.01}, TABLE,
        reverse=True,
    )  # fmt: skip
    yield KnownScene(
        "six balls", "a shot at five balls on a table, for two seconds", "forty digits", SIX, 2.0,
        {"ends": 0.01}, TABLE, ends=SIX_ENDS, timed=True,
    )  # fmt: skip


def unequal_and_inelastic() -> Iterator[KnownScene]:
    """Yield hits of a heavy and a light ball, and a collapse of three in a row."""
    fast, slow = elastic(LIGHT, 0.0, HEAVY, 1.0)
    yield KnownScene(
        "heavy on light", "1e6 to 1: the heavy ball hits the light one", MOMENTUM,
        (Disc(0.5, 0.0, m=LIGHT), Disc(0.0, 0.0, 1.0, m=HEAVY)), 1.0, {"velocities": 0.01},
        velocities=((fast, 0.0), (slow, 0.0)),
    )  # fmt: skip
    back, on = elastic(LIGHT, 1.0, HEAVY, 0.0)
    yield KnownScene(
        "light on heavy", "1 to 1e6: the light ball hits the heavy one", MOMENTUM,
        (Disc(0.0, 0.0, 1.0, m=LIGHT), Disc(0.5, 0.0, m=HEAVY)), 1.0, {"velocities": 0.01},
        velocities=((back, 0.0), (on, 0.0)),
    )  # fmt: skip
    light, heavy, hits = pi_velocities(LIGHT, HEAVY)
    yield KnownScene(
        "three digits of pi", "a light ball between a wall and one 1e6 times as heavy",
        "closed form: 3141 hits (Galperin 2003)",
        (Disc(0.5, 1.0, m=LIGHT), Disc(1.5, 1.0, -1.0, m=HEAVY)), 4.0, {"velocities": 0.01},
        Table.rectangle(10.0, 2.0).outline, velocities=((light, 0.0), (heavy, 0.0)), contacts=hits,
    )  # fmt: skip
    yield KnownScene(
        "inelastic collapse", "three balls in a row, e = 0.05: infinitely many hits",
        "closed form: e < 7 - 4 sqrt(3), so they go on together",
        (Disc(-0.5, 0.0, 1.0), Disc(0.0, 0.0), Disc(0.9, 0.0, -0.6)), 2.0, {"velocities": 0.01},
        restitution=0.05, velocities=(((1.0 - 0.6) / 3.0, 0.0),) * 3,
    )  # fmt: skip


def braked() -> Iterator[KnownScene]:
    """Yield balls that slide or roll to rest: one hits another head-on, and a break."""
    meets, right = 0.5 - 2.0 * R, {"ends": 0.01}  # m
    left = 2.0**2 - 2.0 * BRAKE * meets  # (m/s)^2; the square of the speed at which they meet
    slid, after = left / (2.0 * BRAKE), math.sqrt(left)
    yield KnownScene(
        "slide to rest", "discs on a surface with friction: one hits another head-on",
        "closed form: v^2 / (2 mu g)", (Disc(0.0, 0.0, 2.0), Disc(0.5, 0.0)), 3.0, right,
        friction=0.2, ends=((meets, 0.0), (0.5 + slid, 0.0)),
    )  # fmt: skip
    rolls = math.sqrt(1.5**2 - 2.0 * 0.01 * G * meets)
    yield KnownScene(
        "follow", "a ball that rolls hits another head-on, and follows it", SEVENTHS,
        (Disc(0.0, 0.0, 1.5), Disc(0.5, 0.0)), 60.0, right, **ROLLS, roll=1.0,
        ends=((meets + roll_on(0.0, rolls), 0.0), (0.5 + roll_on(rolls, 0.0), 0.0)),
    )  # fmt: skip
    gained = 2.5 * (2.0 - after)  # m/s; the roll that the cloth has given the ball by then
    yield KnownScene(
        "stop shot", "the same by a ball that slides at first", SEVENTHS,
        (Disc(0.0, 0.0, 2.0), Disc(0.5, 0.0)), 60.0, right, **ROLLS,
        ends=((meets + roll_on(0.0, gained), 0.0), (0.5 + roll_on(after, 0.0), 0.0)),
        thread=f"{GITHUB}/ekiefl/pooltool/pull/354",
    )  # fmt: skip
    angle = 1.428286  # rad; from the thread
    spots = rack((2.0 + 1e-3) * POOL, (0.4953, 1.4859), (0.0, 1.0))
    yield KnownScene(
        "balls pass through each other", "a break of balls that slide, then roll",
        "two balls are never in one place",
        (
            Disc(0.4953, 0.4953, 5.0 * math.cos(angle), 5.0 * math.sin(angle), POOL),
            *(Disc(x, y, r=POOL) for x, y, *_ in spots),
        ),
        6.0, {"overlap": 3e-3, "inside": 3e-3}, Table.rectangle(0.9906, 1.9812).outline,
        0.95, 0.85, **ROLLS, looks=600, timed=True, slow=True,
        thread=f"{GITHUB}/ekiefl/pooltool/issues/154",
    )  # fmt: skip


def for_others() -> Iterator[KnownScene]:
    """Yield what the extremes leave to others: a derivative, gravity in the plane, a long game."""
    yield KnownScene(
        "gradient", "how the end of ball 2 depends on both places and speeds",
        "closed form: x = x1 + v1 T + 2 r, so 1, 0, 1, 0",
        (Disc(0.0, 0.0, 1.0, 0.0, 0.1, 1.0), Disc(0.52, 0.0, 0.0, 0.0, 0.1, 1.0)), 1.0,
        {"gradient": 0.05}, gradient=(1.0, 0.0, 1.0, 0.0), nudge=1e-3, case=None,
        thread=f"{GITHUB}/keenon/nimblephysics/issues/97",
    )  # fmt: skip
    dropped = KnownScene(
        "e = 1, dropped on a floor", "a ball bounces for a minute under gravity", "energy is kept",
        (Disc(0.0, 2.0, r=0.1),), 60.0, KEPT, ((-2.0, 0.0), (5.0, 0.0), (5.0, 9.0), (-2.0, 9.0)),
        gravity=-G, thread=f"{GITHUB}/dimforge/rapier/issues/97", case=None,
    )  # fmt: skip
    yield dropped
    yield replace(
        dropped, name="e = 1, two sizes dropped", known="energy is kept, whatever the size",
        about="a ball and one five times its size, under gravity", time=10.0,
        balls=(Disc(0.0, 2.0, r=0.1), Disc(3.0, 2.0, r=0.5)),
        thread=f"{GITHUB}/liabru/matter-js/issues/13",
    )  # fmt: skip
    yield replace(
        TEN_THOUSAND, name="e = 1, a million contacts", parts=2000, limit=900, case=None,
        about="ten balls in a box, a hundred times as long",
    )  # fmt: skip


def known_answers() -> Iterator[Case]:
    """Play the scenes by all solvers."""
    for known in known_scenes():
        if known.case is not None:
            label = known.case or known.name
            yield Case(label, known.scene, known.claims, slow=known.slow)
