"""Contact laws take the velocities before a contact and return those after it.

A new law is one class. Override what you want to change; what you do not override stays Coulomb's.

>>> class Smooth(Law):
...     def ball_ball(self, a, b, pair):
...         return super().ball_ball(a, b, pair.with_friction(0.0))
>>> Smooth().ball_ball((1.0, 0.5), (0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.1))
((0.0, 0.5), (1.0, 0.0))
"""

from __future__ import annotations

from typing import Final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.contact.contact import NT, Contact, Pair
from pool_pymunk.core.contact.together import Hits, at_once, mean_over_orders
from pool_pymunk.core.motion.times import Vector

# A slip below this share of the closing speed is rounding, and `published` jumps at zero slip. Half
# or twice of it keeps all ends that were tried.
ZERO_SLIP: Final = 1e-9
# The friction of pool balls against their slip (m/s), for `weakening`: mu(s) = LEAST + FADING
# exp(-RATE s). This is Alciatore's fit to Marlow's measurements: Technical Proof A.14, "The effects
# of cut angle, speed, and spin on object ball throw", billiards.colostate.edu.
LEAST: Final = 9.951e-3
FADING: Final = 0.108
RATE: Final = 1.088


@mypyc_attr(allow_interpreted_subclasses=True)
class Law:
    """A law answers contacts; this base class is Coulomb's law for a single hit.

    For contacts of one instant it takes the mean over their orders. ``is_coulomb`` tells whether
    single hits are Coulomb's, so that their cycles may be leapt over in a collapse, and
    ``solves_at_once`` whether contacts of one instant are solved as Coulomb's are. Rounds of
    contacts ask it.
    """

    name = "law"
    is_coulomb = False
    solves_at_once = False

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        """Return the velocities of A and B after their hit; the normal points from A to B."""
        return coulomb(a, b, pair)

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        """Return the velocity after a hit on a cushion by Eq. 9: v_n' = -e v_n.

        The tangential speed shrinks by mu |v_n' - v_n|, never past zero. The normal points into the
        table.

        >>> Law().cushion((-2.0, 1.0), 0.5, 0.1)
        (1.0, 0.7)
        """
        n, t = v
        after = -(n * restitution)
        return after, not_reversed(t, t - sign(t) * (friction * abs(after - n)))

    def jumps(self, a: NT, b: NT, pair: Pair) -> bool:
        """Tell whether the law jumps here, so that rounding would decide its answer."""
        return False

    def together(self, contacts: list[Contact], hits: Hits) -> bool:
        """Answer closing contacts of one instant that share balls.

        ``hits`` answers single ones. Return whether the impulses of the contacts are noted; if they
        are not, they are found by those of the single hits. In a real rack the outcome depends on
        the order of the hits. This method therefore takes the mean over the orders in which the
        hits could have come.
        """
        mean_over_orders(contacts, hits)
        return False

    def respond(self, one: Contact, slip: Vector) -> bool:
        """Answer one contact; return whether the law jumps there.

        If it does, leave friction out, or answer with this ``slip`` of A and B along the tangent
        (as multiples of the least that counts) instead of the one that only rounding knows.
        """
        a, pair, nx, ny = one.parts_of_a(), one.pair, one.nx, one.ny
        an, at = a
        if one.b is None:
            n, t = self.cushion(a, pair.restitution, pair.friction)
            one.a.change(n - an, t - at, nx, ny)
            return False
        b = one.parts_of_b()
        bn, bt = b
        if not self.jumps(a, b, pair):
            new_a, new_b = self.ball_ball(a, b, pair)
            jumps = False
        else:
            new_a, new_b = self._respond_to_no_slip(a, b, pair, slip)
            jumps = True
        n, t = new_a
        one.a.change(n - an, t - at, nx, ny)
        n, t = new_b
        one.b.change(n - bn, t - bt, nx, ny)
        return jumps

    def _respond_to_no_slip(self, a: NT, b: NT, pair: Pair, slip: Vector) -> tuple[NT, NT]:
        """Answer a hit whose slip is rounding, without friction or with another slip."""
        by_a, by_b = slip
        if by_a == 0.0 and by_b == 0.0:
            return self.ball_ball(a, b, pair.with_friction(0.0))
        least = ZERO_SLIP * (a[0] - b[0])
        return self.ball_ball(moved_along(a, by_a * least), moved_along(b, by_b * least), pair)


class HitsByLaw(Hits):
    """These single hits are answered by a law."""

    def __init__(self, law: Law, slip: Vector) -> None:
        super().__init__(slip)
        self.law = law

    def answer(self, one: Contact) -> None:
        one.jumped = self.law.respond(one, self.slip) or one.jumped


class Coulomb(Law):
    """This is the default law; it solves contacts of one instant for all impulses at once."""

    name = "coulomb"
    is_coulomb = True
    solves_at_once = True

    def together(self, contacts: list[Contact], hits: Hits) -> bool:
        return at_once(contacts) or super().together(contacts, hits)


class Published(Law):
    """This law is Listing 3 of the report to the letter; it answers contacts in its order.

    It alone gives the published numbers. Two defects are kept: line 132 pushes B *with* the slip,
    and the clamps after it look at each ball's own tangential velocity, not at the slip.

    >>> Published().ball_ball((1.0, 0.5), (0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.1))
    ((0.0, 0.4), (1.0, -0.1))
    """

    name = "published"

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        """Return the velocities of A and B after their hit; A is listed first in the scenario.

        The normal velocities solve momentum and restitution (Eqs. 1-3). Each tangential velocity
        changes by mu times its own change of normal velocity.
        """
        an, at = a
        bn, bt = b
        m_a, m_b, e, mu = pair.m_a, pair.m_b, pair.restitution, pair.friction
        momentum, closing = m_a * an + m_b * bn, e * (an - bn)
        a_n = (momentum - m_b * closing) / (m_a + m_b)
        b_n = (momentum + m_a * closing) / (m_a + m_b)
        a_t = at - sign(at - bt) * (mu * (an - a_n))
        b_t = bt - sign(bt - at) * (mu * (bn - b_n))
        return (a_n, not_reversed(at, a_t)), (b_n, not_reversed(bt, b_t))

    def together(self, contacts: list[Contact], hits: Hits) -> bool:
        """Answer one contact after the other: cushions first, then pairs in the scene's order."""
        for one in sorted(contacts, key=as_listed):
            if one.closing > 0.0:
                hits.answer(one)
        return False

    def jumps(self, a: NT, b: NT, pair: Pair) -> bool:
        return pair.friction > 0.0 and abs(a[1] - b[1]) < ZERO_SLIP * (a[0] - b[0])


class Weakening(Law):
    """This law is Coulomb's, but friction of two balls falls with their slip, as measured.

    The scene's friction is that without slip: mu(s) = mu (0.009951 + 0.108 exp(-1.088 s)) /
    0.117951, with the slip s before the hit in m/s. The slip does not turn round, and energy never
    grows.

    >>> for slip in (2.0, 0.2):
    ...     (_, t), _ = Weakening().ball_ball((1.0, slip), (0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.1))
    ...     print(round(slip - t, 4))
    0.0188
    0.0821
    """

    name = "weakening"

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        share = (LEAST + FADING * decay(RATE * abs(a[1] - b[1]))) / (LEAST + FADING)
        return coulomb(a, b, pair.with_friction(pair.friction * share))


def coulomb(a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Answer a hit by Eqs. 1-7, with Coulomb friction against the slip.

    J_n = (1 + e) m_eff (a_n - b_n); J_t = m_eff s against the slip s = a_t - b_t, or mu J_n if that
    is less. Momentum is kept, energy never grows, and nothing jumps. Balls that already part keep
    their velocities.

    >>> coulomb((1.0, 0.0), (0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.0))
    ((0.0, 0.0), (1.0, 0.0))
    """
    an, at = a
    bn, bt = b
    total = pair.m_a + pair.m_b
    share_a, share_b = pair.m_b / total, pair.m_a / total  # m_eff / m_a, m_eff / m_b
    j_n = (1.0 + pair.restitution) * max(an - bn, 0.0)  # impulses over m_eff
    j_t = clamped(at - bt, pair.friction * j_n)
    return (an - j_n * share_a, at - j_t * share_a), (bn + j_n * share_b, bt + j_t * share_b)


def clamped(value: float, most: float) -> float:
    """Return a value, or the nearest of ``-most`` and ``most`` if it lies beyond them.

    >>> clamped(0.3, 0.2), clamped(-0.3, 0.2), clamped(0.1, 0.2)
    (0.2, -0.2, 0.1)
    """
    if value > most:
        return most
    return -most if value < -most else value


def decay(x: float) -> float:
    """Return exp(-x) for x of at least 0, to 15 decimals, with the same bits on every machine.

    It is made of sums and products. A series gives exp(-x / 1024) - 1, and is squared ten times;
    beyond 40 the answer is 0.

    >>> decay(0.0), round(decay(1.0), 12)
    (1.0, 0.367879441171)
    """
    if x > 40.0:
        return 0.0 * x
    y = x / -1024.0
    less_one = y * (1.0 + y / 2.0 * (1.0 + y / 3.0 * (1.0 + y / 4.0 * (1.0 + y / 5.0))))
    for _ in range(10):
        less_one = less_one * (2.0 + less_one)
    return 1.0 + less_one


def as_listed(one: Contact) -> tuple[bool, int, int, bool]:
    """Return the place in the listing's order: cushions (across x, then y) before pairs."""
    across, b = abs(one.nx) < abs(one.ny), one.b
    return b is not None, one.a.ball.number, -1 if b is None else b.ball.number, across


def moved_along(v: NT, by: float) -> NT:
    """Return a velocity with a slip (m/s) added; a ball at rest stays at rest."""
    n, t = v
    return (n, t + by) if n != 0.0 or t != 0.0 else v


def sign(x: float) -> float:
    """Return 1, -1 or 0."""
    if x > 0.0:
        return 1.0
    return -1.0 if x < 0.0 else 0.0


def not_reversed(before: float, after: float) -> float:
    """Return a velocity (m/s) after friction, or 0 where friction would turn it round."""
    return 0.0 if before != 0.0 and sign(after) != sign(before) else after
