"""The contact laws: `coulomb` does what physics demands, and `published` has its defects.

`weakening` is Coulomb's law with a friction that falls with the slip.
"""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from pool_pymunk.core.contact.laws import RATE, decay
from pool_pymunk.laws import LAWS, Law
from pool_pymunk.laws.contact import NT, Pair

coulomb, published = LAWS["coulomb"].ball_ball, LAWS["published"].ball_ball
cushion = LAWS["coulomb"].cushion
EPSILON = 2.0**-52
Vector = tuple[float, float]

# A law is some ten operations, and each is rounded by EPSILON / 2 of the largest number in it.
ROUNDING = 16 * EPSILON

speeds = st.floats(-1e3, 1e3)
masses = st.floats(-4.5, 4.5).map(lambda power: 10.0**power)  # ratios up to 1e9
restitutions = st.sampled_from((0.0, 1.0)) | st.floats(0.0, 1.0)
frictions = st.sampled_from((0.0, 10.0)) | st.floats(0.0, 10.0)
velocities = st.builds(NT, speeds, speeds)
pairs = st.builds(Pair, masses, masses, restitutions, frictions)
angles = st.floats(-math.pi, math.pi)
sound = pytest.mark.parametrize(
    "law", (LAWS["coulomb"], LAWS["weakening"]), ids=lambda law: law.name
)


@st.composite
def hits(draw: st.DrawFn) -> tuple[NT, NT, Pair]:
    """Return two balls that approach each other."""
    a, b, pair = draw(velocities), draw(velocities), draw(pairs)
    assume(a.n > b.n)
    return a, b, pair


def top_speed(*balls: NT) -> float:
    return max(abs(v) for ball in balls for v in ball)


def momentum_scale(a: NT, b: NT, pair: Pair) -> float:
    """Return the scale of rounding of momenta: both balls can end with the other's speed."""
    m_eff = pair.m_a * pair.m_b / (pair.m_a + pair.m_b)
    exchanged = 2.0 * m_eff * (1.0 + pair.friction) * top_speed(a, b)
    return (pair.m_a * max(map(abs, a))) + (pair.m_b * max(map(abs, b))) + exchanged


def energy(a: NT, b: NT, pair: Pair) -> float:
    return 0.5 * (pair.m_a * (a.n**2 + a.t**2) + pair.m_b * (b.n**2 + b.t**2))


# -- all laws ------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@given(hit=hits())
@example(hit=(NT(1.0, 1.0), NT(0.0, 0.0), Pair(1e-4, 1e5, 1.0, 10.0)))
def test_momentum_is_kept_and_balls_part_with_the_restitution(
    law: Law, hit: tuple[NT, NT, Pair]
) -> None:
    """The published law keeps the normal momentum alone."""
    a, b, pair = hit
    after_a, after_b = law.ball_ball(a, b, pair)
    for k in range(1 if law.name == "published" else 2):
        before = pair.m_a * a[k] + pair.m_b * b[k]
        after = pair.m_a * after_a[k] + pair.m_b * after_b[k]
        assert abs(after - before) <= ROUNDING * momentum_scale(a, b, pair)
    parting = after_b.n - after_a.n
    assert abs(parting - pair.restitution * (a.n - b.n)) <= ROUNDING * top_speed(a, b)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@given(hit=hits())
def test_mirror_image_of_a_hit_gives_the_mirror_image_of_its_outcome(
    law: Law, hit: tuple[NT, NT, Pair]
) -> None:
    a, b, pair = hit
    mirrored = law.ball_ball(NT(a.n, -a.t), NT(b.n, -b.t), pair)
    # This is to the last bit, because a change of sign rounds nothing.
    assert mirrored == tuple(NT(v.n, -v.t) for v in law.ball_ball(a, b, pair))


def split(v: Vector, normal: Vector) -> NT:
    nx, ny = normal
    return NT(v[0] * nx + v[1] * ny, v[1] * nx - v[0] * ny)


def join(v: NT, normal: Vector) -> Vector:
    nx, ny = normal
    return (v.n * nx - v.t * ny, v.n * ny + v.t * nx)


def meet(law: Law, a: Vector, b: Vector, normal: Vector, pair: Pair) -> tuple[Vector, Vector]:
    """Apply the law to velocities in the plane, as the solvers do."""
    after_a, after_b = law.ball_ball(split(a, normal), split(b, normal), pair)
    return join(after_a, normal), join(after_b, normal)


def turned(v: Vector, angle: float) -> Vector:
    c, s = math.cos(angle), math.sin(angle)
    return (c * v[0] - s * v[1], s * v[0] + c * v[1])


def assert_close(found: Vector, wanted: Vector, tolerance: float) -> None:
    assert math.dist(found, wanted) <= tolerance, (found, wanted)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@given(hit=hits(), angle=angles)
def test_turning_the_table_turns_the_outcome(
    law: Law, hit: tuple[NT, NT, Pair], angle: float
) -> None:
    a, b, pair = hit
    # `published` jumps where a velocity or the slip is zero, and turning rounds: stay away from
    # there.
    assume(law.name != "published" or min(abs(a.t), abs(b.t), abs(a.t - b.t)) > 1e-6)
    plain = meet(law, a, b, (1.0, 0.0), pair)
    normal = turned((1.0, 0.0), angle)
    found = meet(law, turned(a, angle), turned(b, angle), normal, pair)
    # Both turns and both splits round, and friction passes on the normal's error times mu.
    tolerance = 4 * ROUNDING * (1.0 + pair.friction) * top_speed(a, b)
    # The slip's error changes the friction of `weakening`, by RATE of it in a metre a second.
    tolerance *= 1.0 + RATE * top_speed(a, b) * (law.name == "weakening")
    clamped = law.name == "published" and 0.0 in (plain[0][1], plain[1][1])
    for x, y in zip(found, plain, strict=True):
        assert_close(x, turned(y, angle), tolerance * (2.0 if clamped else 1.0))


# -- coulomb and weakening -----------------------------------------------------------------------


@sound
@given(a=velocities, b=velocities, pair=pairs)
@example(a=NT(0.0, 0.0), b=NT(1.0, 1.0), pair=Pair(1.0, 1.0, 1.0, 10.0))
def test_energy_never_grows(law: Law, a: NT, b: NT, pair: Pair) -> None:
    after = law.ball_ball(a, b, pair)
    # m v dv is the error of a momentum times the speed it has.
    tolerance = ROUNDING * momentum_scale(a, b, pair) * top_speed(a, b, *after)
    assert energy(*after, pair) <= energy(a, b, pair) + tolerance


@sound
@given(a=velocities, b=velocities, m_a=masses, m_b=masses)
def test_without_losses_energy_is_kept(law: Law, a: NT, b: NT, m_a: float, m_b: float) -> None:
    pair = Pair(m_a, m_b, 1.0, 0.0)
    after = law.ball_ball(a, b, pair)
    tolerance = ROUNDING * momentum_scale(a, b, pair) * top_speed(a, b, *after)
    assert abs(energy(*after, pair) - energy(a, b, pair)) <= tolerance


@sound
@given(hit=hits())
def test_relabelling_the_balls_changes_nothing(law: Law, hit: tuple[NT, NT, Pair]) -> None:
    a, b, pair = hit
    # From B to A, normal and tangent point against that.
    flipped = law.ball_ball(NT(-b.n, -b.t), NT(-a.n, -a.t), Pair(pair.m_b, pair.m_a, *pair[2:]))
    after_a, after_b = law.ball_ball(a, b, pair)
    # This is to the last bit, because the same operations act on the same numbers.
    assert flipped == (NT(-after_b.n, -after_b.t), NT(-after_a.n, -after_a.t))


@sound
@given(hit=hits())
def test_friction_slows_the_slip_and_never_reverses_it(law: Law, hit: tuple[NT, NT, Pair]) -> None:
    a, b, pair = hit
    after_a, after_b = law.ball_ball(a, b, pair)
    slip, rest = a.t - b.t, after_a.t - after_b.t
    rounding = ROUNDING * top_speed(a, b)
    assert abs(rest) <= abs(slip) + rounding
    assert rest * math.copysign(1.0, slip) >= -rounding


@given(hit=hits())
def test_coulomb_friction_is_mu_times_the_normal_impulse_while_it_slips(
    hit: tuple[NT, NT, Pair],
) -> None:
    a, b, pair = hit
    after_a, after_b = coulomb(a, b, pair)
    # These are impulses over the mass of A.
    normal, tangential = a.n - after_a.n, abs(a.t - after_a.t)
    rounding = ROUNDING * (1.0 + pair.friction) * top_speed(a, b)
    assert tangential <= pair.friction * normal + rounding
    if abs(after_a.t - after_b.t) > rounding:  # It still slips, so Coulomb's limit is reached.
        assert abs(tangential - pair.friction * normal) <= rounding


@given(hit=hits(), common=velocities)
def test_coulomb_looks_the_same_to_every_observer(hit: tuple[NT, NT, Pair], common: NT) -> None:
    a, b, pair = hit
    seen = coulomb(NT(a.n + common.n, a.t + common.t), NT(b.n + common.n, b.t + common.t), pair)
    # The common velocity rounds the closing speed and the slip, and friction scales that.
    tolerance = 4 * ROUNDING * (1.0 + pair.friction) * (top_speed(a, b) + top_speed(common))
    for found, own in zip(seen, coulomb(a, b, pair), strict=True):
        assert_close(found, (own.n + common.n, own.t + common.t), tolerance)


@sound
@given(hit=hits(), slip=st.floats(0.0, 1e-9))
def test_it_does_not_jump_at_zero_slip(law: Law, hit: tuple[NT, NT, Pair], slip: float) -> None:
    a, b, pair = hit
    forth = law.ball_ball(NT(a.n, b.t + slip), b, pair)
    back = law.ball_ball(NT(a.n, b.t - slip), b, pair)
    for x, y in zip(forth, back, strict=True):
        assert_close(x, y, 2 * slip + ROUNDING * top_speed(a, b))


@sound
@given(a=velocities, b=velocities, pair=pairs)
def test_it_leaves_balls_alone_that_part(law: Law, a: NT, b: NT, pair: Pair) -> None:
    assume(a.n <= b.n)
    assert law.ball_ball(a, b, pair) == (a, b)


# For m_a = 3, m_b = 1, e = 0.5, closing 4 m/s: J_n = 1.5 * 0.75 * 4 = 4.5 N s, and A goes on with
# 2.5, B with 4.5 m/s. These are the law, mu, what A and B have along the contact, before and after.
BY_HAND = [
    # 1.5 N s would end the slip of 2 m/s; mu J_n = 0.9 N s is less, so it slips on.
    ("coulomb", 0.2, (2.0, 0.0), (1.7, 0.9)),
    ("coulomb", 10.0, (2.0, 0.0), (1.5, 1.5)),
    # A has 2 - 0.2 * 1.5 = 1.7 m/s. B is pushed with the slip and has 1 + 0.2 * (-4.5) = 0.1 m/s.
    ("published", 0.2, (2.0, 1.0), (1.7, 0.1)),
    # A would lose 0.3 m/s: it changes sign, so it gets 0. B was at rest, so it is not clamped.
    ("published", 0.2, (0.1, 0.0), (0.0, -0.9)),
    # B is pushed by 0.9 m/s, past zero: it gets 0.
    ("published", 0.2, (2.0, 0.5), (1.7, 0.0)),
]


@pytest.mark.parametrize(("law", "mu", "before", "after"), BY_HAND)
def test_by_hand(
    law: str, mu: float, before: tuple[float, float], after: tuple[float, float]
) -> None:
    a, b = LAWS[law].ball_ball(NT(4.0, before[0]), NT(0.0, before[1]), Pair(3.0, 1.0, 0.5, mu))
    assert a == pytest.approx((2.5, after[0]), rel=1e-15, abs=0.0)
    assert b == pytest.approx((4.5, after[1]), rel=1e-14, abs=0.0)  # 1 - 0.9 loses a digit.


# -- weakening -------------------------------------------------------------------------------------


def test_decay_is_the_exponential_function() -> None:
    for k in range(5000):
        x = k / 100.0
        assert abs(decay(x) - math.exp(-x)) <= 4 * EPSILON
    assert (decay(0.0), decay(1e9)) == (1.0, 0.0)


def test_decay_has_the_same_bits_everywhere() -> None:
    found = [decay(x).hex() for x in (2.0**-30, 0.1, 1.0, 10.0)]
    assert found == [
        "0x1.fffffff800000p-1", "0x1.cf46d99d52b3ap-1", "0x1.78b56362cef38p-2",
        "0x1.7cd79b5648000p-15",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("slip", "share"), [(0.0, 1.0), (0.1, 0.90561), (1.0, 0.39283), (3.0, 0.11937), (30.0, 0.08437)]
)
def test_weakening_by_hand(slip: float, share: float) -> None:
    """A.14 has mu(0) = 0.11795, mu(0.1) = 0.10682, mu(1) = 0.04634, mu(3) = 0.01408.

    The scene's friction 0.02 stands for mu(0), so it is mu(s) / mu(0) of that. For equal masses and
    e = 1, closing at 1 m/s, J_n / m = 1 m/s, and friction moves B by 0.02 of that, or less.
    """
    after = LAWS["weakening"].ball_ball(NT(1.0, slip), NT(0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.02))
    taken = 0.02 * share if slip > 0.0 else 0.0
    assert after[0] == pytest.approx((0.0, slip - taken), abs=2e-7)
    assert after[1] == pytest.approx((1.0, taken), abs=2e-7)


def test_weakening_by_hand_where_the_slip_ends() -> None:
    """With friction 0.2, a slip of 0.1 m/s would lose up to 0.18 m/s on either side: it ends."""
    after = LAWS["weakening"].ball_ball(NT(1.0, 0.1), NT(0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.2))
    assert after == (NT(0.0, 0.05), NT(1.0, 0.05))


@given(hit=hits())
def test_weakening_is_coulombs_with_the_friction_of_its_slip(hit: tuple[NT, NT, Pair]) -> None:
    a, b, pair = hit
    mu = pair.friction * (9.951e-3 + 0.108 * math.exp(-1.088 * abs(a.t - b.t))) / 0.117951
    after = coulomb(a, b, pair._replace(friction=mu))
    tolerance = 4 * ROUNDING * (1.0 + pair.friction) * top_speed(a, b)
    for found, wanted in zip(LAWS["weakening"].ball_ball(a, b, pair), after, strict=True):
        assert_close(found, wanted, tolerance)


@given(e=restitutions, mu=frictions, closing=st.floats(0.1, 10.0), slip=st.floats(0.1, 10.0))
def test_weakening_takes_less_than_coulomb(
    e: float, mu: float, closing: float, slip: float
) -> None:
    hit = NT(closing, slip), NT(0.0, 0.0), Pair(0.2, 0.2, e, mu)
    less, more = LAWS["weakening"].ball_ball(*hit)[1].t, coulomb(*hit)[1].t
    assert 0.0 <= less <= more * (1.0 + ROUNDING)


# -- published, and its defects -------------------------------------------------------------------


@given(hit=hits())
def test_published_changes_a_by_mu_times_its_own_change_or_stops_it(
    hit: tuple[NT, NT, Pair],
) -> None:
    a, b, pair = hit
    after_a, _ = published(a, b, pair)
    change = pair.friction * (a.n - after_a.n)
    wanted = a.t - math.copysign(change, a.t - b.t) if a.t != b.t else a.t
    stopped = a.t != 0.0 and not (wanted > 0.0 < a.t or wanted < 0.0 > a.t)
    assert after_a.t == (0.0 if stopped else wanted)


@given(a=st.floats(0.5, 1e3), slip=st.floats(0.5, 1e3), m_a=masses, m_b=masses)
def test_defect_line_132_pushes_b_with_the_slip(
    a: float, slip: float, m_a: float, m_b: float
) -> None:
    """A rubs B towards +t, so friction must push B towards +t, but B moves towards -t."""
    before = NT(a, slip), NT(0.0, 0.0)
    pair = Pair(m_a, m_b, 0.5, 0.1)
    assert published(*before, pair)[1].t < 0.0 < coulomb(*before, pair)[1].t


def test_defect_tangential_momentum_is_not_kept() -> None:
    """Both balls are pushed towards -t: 1 kg m/s in t direction becomes 0.8."""
    a, b = published(NT(1.0, 1.0), NT(0.0, 0.0), Pair(1.0, 1.0, 1.0, 0.1))
    assert a.t + b.t == pytest.approx(0.8, rel=1e-15, abs=0.0)


def test_defect_friction_can_add_energy() -> None:
    """B rests, is pushed against the slip's own direction, and gains energy from nothing."""
    pair = Pair(1.0, 1.0, 1.0, 10.0)
    before = NT(1.0, 0.1), NT(0.0, 0.0)
    assert energy(*published(*before, pair), pair) > 50 * energy(*before, pair)


def test_defect_the_law_depends_on_the_observer() -> None:
    """The clamps look at each ball's own tangential velocity.

    To an observer who moves along the tangent, the same hit ends otherwise.
    """
    pair = Pair(1.0, 1.0, 1.0, 0.2)
    a, b = published(NT(1.0, 0.1), NT(0.0, 0.0), pair)
    moving_a, moving_b = published(NT(1.0, 5.1), NT(0.0, 5.0), pair)
    assert a.t == 0.0  # It is clamped.
    assert moving_a.t - 5.0 == pytest.approx(-0.1)  # It is not clamped.
    assert (moving_b.t - 5.0) == pytest.approx(b.t)


@given(closing=st.floats(0.1, 1e3), mu=st.floats(0.01, 10.0))
def test_defect_the_law_jumps_at_zero_slip(closing: float, mu: float) -> None:
    """Slips of +1e-15 and -1e-15 m/s, both of them rounding, send B off to opposite sides."""
    pair = Pair(1.0, 1.0, 1.0, mu)
    left = published(NT(closing, -1e-15), NT(0.0, 0.0), pair)[1].t
    right = published(NT(closing, 1e-15), NT(0.0, 0.0), pair)[1].t
    assert left == pytest.approx(mu * closing) and right == pytest.approx(-mu * closing)
    assert published(NT(closing, 0.0), NT(0.0, 0.0), pair)[1].t == 0.0


def test_defect_relabelling_the_balls_changes_the_answer() -> None:
    """Friction is right for the ball that is called A and wrong for the other, whichever it is.

    Equal masses close at 1 m/s with e = 1, mu = 0.1 and a slip of 1 m/s. A at 1 m/s is slowed to
    0.9 and B is pushed to -0.1 m/s. With the labels exchanged B is pushed to +0.1 and A to 1.1 m/s.
    """
    pair = Pair(1.0, 1.0, 1.0, 0.1)
    a, b = published(NT(1.0, 1.0), NT(0.0, 0.0), pair)
    # From B to A, normal and tangent point against that.
    other_b, other_a = published(NT(0.0, 0.0), NT(-1.0, -1.0), pair)
    assert (a.t, b.t) == pytest.approx((0.9, -0.1), rel=1e-15, abs=0.0)
    assert (-other_a.t, -other_b.t) == pytest.approx((1.1, 0.1), rel=1e-15, abs=0.0)


def test_rounding_slips_are_told_from_real_ones() -> None:
    pair, jumps = Pair(1.0, 1.0, 0.5, 0.1), LAWS["published"].jumps
    assert jumps(NT(1.0, 4e-14), NT(0.0, 0.0), pair)
    assert not jumps(NT(1.0, 1e-8), NT(0.0, 0.0), pair)


# -- cushions (Eq. 9) ----------------------------------------------------------------------------


def test_cushion_by_hand() -> None:
    """4 m/s come back as 3 m/s: of this change of 7 m/s, mu = 0.1 takes 0.7 m/s from 2 m/s."""
    assert cushion(NT(-4.0, -2.0), 0.75, 0.1) == pytest.approx((3.0, -1.3), rel=1e-15, abs=0.0)


@given(v=velocities, e=restitutions, mu=frictions)
def test_cushion_reverses_the_normal_speed_e_times(v: NT, e: float, mu: float) -> None:
    assert cushion(v, e, mu).n == -(e * v.n)


@given(v=velocities, e=restitutions, mu=frictions)
def test_cushion_friction_slows_and_never_reverses(v: NT, e: float, mu: float) -> None:
    after = cushion(v, e, mu)
    loss = mu * (1.0 + e) * abs(v.n)
    wanted = math.copysign(max(abs(v.t) - loss, 0.0), v.t)
    assert after.t * v.t >= 0.0 and abs(after.t) <= abs(v.t)
    # The change of normal speed and the loss are rounded once each, the smallest numbers as well.
    rounding = 4 * EPSILON * (abs(v.t) + loss) + 4 * math.ulp(0.0)
    assert after.t == pytest.approx(wanted, rel=0, abs=rounding)


@given(v=velocities, e=restitutions, mu=frictions)
def test_cushion_never_adds_energy(v: NT, e: float, mu: float) -> None:
    after = cushion(v, e, mu)
    assert math.hypot(*after) <= math.hypot(*v) * (1 + EPSILON)  # The function hypot rounds.


@given(v=velocities, e=restitutions, mu=frictions)
def test_cushion_mirrors(v: NT, e: float, mu: float) -> None:
    after = cushion(v, e, mu)
    assert cushion(NT(v.n, -v.t), e, mu) == NT(after.n, -after.t)
    assert cushion(NT(-v.n, v.t), e, mu) == NT(-after.n, after.t)


def test_cushion_stops_what_friction_would_reverse() -> None:
    assert cushion(NT(-4.0, 0.1), 1.0, 10.0) == NT(4.0, 0.0)
