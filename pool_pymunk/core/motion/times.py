"""A disc comes to a place at these times: closed forms, and iterations that cannot overshoot.

A moving disc loses speed at a = mu_s g along its own velocity until it stops (Eq. 10), so its path
is a straight line: p(t) = p0 + u (v t - a t^2 / 2) for t <= v / a, with u = v / |v|.
"""

from __future__ import annotations

import math
from typing import Final

Vector = tuple[float, float]

INF: Final = 1e999
EPSILON: Final = 2.0**-52  # This is the spacing of floating-point numbers at 1.
# Resting discs that touch meet when they are nearer by this share of the contact distance. It is
# above rounding, 1e-16 of a place up to some thousand radii off, and below what an end shows.
STILL_TOUCHING: Final = 1e-12
# In the bundled scenes 9 iterations are the most, so half would do. Only a path that stays within
# rounding of a touch comes near this number, and twice as many would not tell whether it touches.
MOST_ITERATIONS: Final = 200
OUTSIDE: Final = 1e-9  # of the square of a radius; a point so far beyond a disc is not in it


def length_of(x: float, y: float) -> float:
    """Return the length of a vector; every machine gives it the same bits.

    >>> length_of(3.0, 4.0)
    5.0
    """
    return math.sqrt(x * x + y * y)


def unit(x: float, y: float) -> Vector:
    """Return the unit vector along (x, y), or the x axis if both are zero."""
    length = math.sqrt(x * x + y * y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)


def stopping_time(speed: float, deceleration: float) -> float:
    """Return how long (s) a disc at ``speed`` (m/s) keeps moving; infinite without friction.

    >>> stopping_time(2.0, 0.5), stopping_time(2.0, 0.0), stopping_time(0.0, 0.0)
    (4.0, inf, 0.0)
    """
    if speed == 0.0:
        return 0.0
    return speed / deceleration if deceleration > 0.0 else INF


def time_to_slide(distance: float, speed: float, pull: float) -> float:
    """Return how long (s) a disc at ``speed`` (m/s) that slows down takes for ``distance`` (m).

    It loses speed at ``pull`` (m/s^2). The time is infinite if it stops before, or just there.

    >>> time_to_slide(1.75, 2.0, 0.5), time_to_slide(4.0, 2.0, 0.5)
    (1.0, inf)
    """
    square = speed * speed - 2.0 * pull * distance if distance < INF else 0.0
    return 2.0 * distance / (speed + math.sqrt(square)) if square > 0.0 else INF


def time_to_return(gap: float, parting: float, pull: float) -> float:
    """Return when (s) a ``gap`` (m) is closed that widens first; infinite if it never is.

    It widens at ``parting`` (m/s), and this speed falls by ``pull`` (m/s^2).

    >>> time_to_return(0.0, 1.0, 2.0), time_to_return(1.5, 1.0, 1.0), time_to_return(1.0, 1.0, 0.0)
    (1.0, 3.0, inf)
    >>> time_to_return(1e-9, 0.0, 1e-320)
    inf
    """
    square = parting * parting + 2.0 * gap * pull
    is_too_weak = square == 0.0 and gap > 0.0  # so that the product has underflowed
    comes_back = square >= 0.0 and pull > 0.0 and not is_too_weak
    return (math.sqrt(square) + parting) / pull if comes_back else INF


def path_to_disc(offset: Vector, direction: Vector, touching: float) -> float:
    """Return the path length (m) after which a straight path touches a resting disc.

    The length is infinite if the path misses the disc. ``offset`` points from the moving centre to
    the resting one, ``direction`` is a unit vector, and ``touching`` is the sum of the radii (for a
    corner: the radius). The distance of the centre from the path decides, in full precision,
    whether a grazing path hits. A disc that touches already is hit now if the path leads into it,
    and otherwise never.

    >>> path_to_disc((3.0, 0.0), (1.0, 0.0), 1.0), path_to_disc((3.0, 1.5), (1.0, 0.0), 1.0)
    (2.0, inf)
    """
    dx, dy = offset
    ux, uy = direction
    along = dx * ux + dy * uy
    if along <= 0.0:
        return INF
    across = abs(dx * uy - dy * ux)
    if across >= touching:
        return INF
    distance = math.sqrt(dx * dx + dy * dy)
    chord = math.sqrt((touching - across) * (touching + across))
    return max((distance - touching) * (distance + touching) / (along + chord), 0.0)


def path_out_of_disc(
    offset: Vector, direction: Vector, touching: float, deepest: float, grazing: float
) -> float:
    """Return the path length (m) after which a straight path leaves a disc; infinite if it misses.

    The arguments are those of :func:`path_to_disc`. A path that begins at the disc's edge, or not
    farther out than ``deepest`` (m) from its middle, leaves at once if it does not lead inwards. A
    path that is tangent to the edge, to rounding, leaves there; so does one that passes it by less
    than the share ``grazing`` of its length until there.

    >>> path_out_of_disc((0.5, 0.0), (1.0, 0.0), 1.0, 1.1, 0.0)
    1.5
    >>> path_out_of_disc((-1.0, 0.0), (0.0, 1.0), 1.0, 1.1, 0.0)
    0.0
    """
    dx, dy = offset
    ux, uy = direction
    along, across = dx * ux + dy * uy, abs(dx * uy - dy * ux)
    distance = math.sqrt(dx * dx + dy * dy)
    room = (touching - distance) * (touching + distance)
    far = (touching - across) * (touching + across)  # keeps its digits where ``room`` is negative
    square = room + along * along if room > 0.0 else far  # of half the chord
    slack = touching * (16.0 * EPSILON * (touching + distance) + 2.0 * grazing * along)
    if distance > deepest and (along <= 0.0 or square <= -slack):
        return INF
    chord = math.sqrt(square) if square > 0.0 else 0.0
    if along > 0.0:
        return along + chord
    return room / (chord - along) if room > 0.0 else 0.0


def time_to_leave(
    offset: Vector, velocity: Vector, acceleration: Vector, touching: float, horizon: float
) -> float:
    """Return the time (s) at which a point leaves a disc; infinite if not within ``horizon`` (s).

    The arguments are those of :func:`time_of_impact`. With the distance d and g = touching^2 - d^2,
    g'' >= -2 (V^2 + d |acceleration|), where V is the largest speed. A Newton iteration by this
    bound cannot overshoot. V is that of a piece of the motion, and no step is longer than it. A
    point that touches the edge from within and moves along it leaves at once, unless it bends
    inwards.

    >>> round(time_to_leave((0.0, 0.0), (-1.0, 0.0), (-2.0, 0.0), 2.0, 10.0), 12)
    1.0
    """
    dx, dy = offset
    vx, vy = velocity
    ax, ay = acceleration
    pull, t = math.sqrt(ax * ax + ay * ay), 0.0
    tiny = 4.0 * EPSILON * (abs(dx) + abs(dy) + touching) * touching
    for iteration in range(MOST_ITERATIONS):
        x, y = dx + t * (vx + 0.5 * t * ax), dy + t * (vy + 0.5 * t * ay)
        ux, uy = vx + t * ax, vy + t * ay
        room, rate = touching * touching - x * x - y * y, -2.0 * (x * ux + y * uy)
        bends = ux * ux + uy * uy + x * ax + y * ay  # -g'' / 2
        if iteration == 0 and room <= tiny and rate <= 0.0:
            if bends >= 0.0 or rate * rate > -4.0 * bends * tiny:
                return t
            t = rate / bends  # It was out by less than rounding until then.
            continue
        if room <= tiny and rate < 0.0:
            return t
        speed = math.sqrt(ux * ux + uy * uy)
        slower = speed if speed > math.sqrt(pull * touching) else math.sqrt(pull * touching)
        if slower == 0.0:
            return INF
        piece = touching / slower
        bound = (speed + pull * piece) * (speed + pull * piece) + touching * pull
        is_outside = room < -OUTSIDE * touching * touching
        room = room if room > tiny else tiny
        root = math.sqrt(rate * rate + 4.0 * bound * room)
        step = 2.0 * room / (root - rate) if rate < 0.0 else (rate + root) / (2.0 * bound)
        if is_outside and rate > 0.0:  # It moves in first, for as long as this at least.
            step = rate / (2.0 * bound)
        before, t = t, t + (step if step < piece else piece)
        if t > horizon:
            return INF
        if t == before:
            return t
    return t


def leads_away(offset: Vector, velocity: Vector, acceleration: Vector) -> bool:
    """Tell whether an offset d (m) never becomes shorter from now on.

    If neither d v nor d a is negative, d d(t) = d^2 + t d v + t^2 d a / 2 is not below d^2, and so
    is the length of d(t) not below that of d.
    """
    x, y = offset
    vx, vy = velocity
    ax, ay = acceleration
    return x * vx + y * vy >= 0.0 and x * ax + y * ay >= 0.0


def time_of_impact(
    offset: Vector, velocity: Vector, acceleration: Vector, touching: float, horizon: float,
    noise: float,
) -> float:  # fmt: skip
    """Return the time (s) at which two discs first touch; infinite if not in time.

    Their relative acceleration is constant. ``offset`` (m), ``velocity`` (m/s) and ``acceleration``
    (m/s^2) are those of B relative to A, ``touching`` is the sum of the radii (m), and
    ``horizon`` (s) is how far to look.

    Three rules apply to discs that touch at the start. If they close faster than ``noise`` (m/s),
    they have an impact now. If they part, they have an impact when they are as near as now again.
    If they are at rest relative to each other, to rounding, they have an impact when they are
    nearer by a share ``STILL_TOUCHING`` of ``touching``.

    The method is a Newton iteration that cannot overshoot. The distance d has d'' >=
    -|acceleration|, so d + d' t - |acceleration| t^2 / 2 bounds it from below, and the root of this
    bound never lies beyond the first impact. The iteration converges quadratically.

    >>> time_of_impact((3.0, 0.0), (-1.0, 0.0), (0.0, 0.0), 1.0, 10.0, 0.0)
    2.0
    >>> round(time_of_impact((3.0, 0.0), (-2.0, 0.0), (0.5, 0.0), 1.0, 10.0, 0.0), 12)
    1.171572875254
    """
    dx, dy = offset
    vx, vy = velocity
    ax, ay = acceleration
    pull = math.sqrt(ax * ax + ay * ay)
    t = 0.0
    tiny = 4.0 * EPSILON * (abs(dx) + abs(dy) + touching)
    for iteration in range(MOST_ITERATIONS):
        x = dx + t * (vx + 0.5 * t * ax)
        y = dy + t * (vy + 0.5 * t * ay)
        distance = math.sqrt(x * x + y * y)
        if distance == 0.0:
            return t
        rate = (x * (vx + t * ax) + y * (vy + t * ay)) / distance
        gap = distance - touching
        if gap <= tiny:
            if rate < (0.0 if iteration > 0 else -noise):
                return t
            if iteration == 0:
                at_rest = rate <= noise or rate * rate <= 4.0 * pull * tiny
                nearer = STILL_TOUCHING * touching if at_rest else 0.0
                touching = min(touching, distance - nearer)
            gap = max(distance - touching, tiny)
        root = math.sqrt(rate * rate + 2.0 * pull * gap)
        if rate < 0.0:
            step = 2.0 * gap / (root - rate)
        elif pull == 0.0 or leads_away((x, y), (vx + t * ax, vy + t * ay), acceleration):
            return INF
        else:
            step = (rate + root) / pull
        before, t = t, t + step
        if t > horizon:
            return INF
        if t == before:
            return t
    return t
