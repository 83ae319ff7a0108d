"""Walls that kick: closed forms, what persists, several contacts at once, and random scenes."""

from __future__ import annotations

import math
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards, same_balls
from pool_pymunk.world import TableState
from tests.shared.moving_scenes import Scene
from tests.shared.scenes import share_of
from tests.shared.worlds import M, R, ball, heard_by, plane

K = 0.5  # m/s


def bare(e: float = 1.0, **how: Any) -> Billiards:
    """Return an open plane, by default without any friction."""
    return plane(**{"pair": same_balls(e, 0.0), "deceleration": 0.0, **how})[1]


def bumper(
    table: Billiards, x: float = 0.0, e: float = 1.0, mu: float = 0.0, u: float | None = None
) -> pymunk.Body:
    """Put up a bumper across x, whose body moves at ``u`` (m/s) if that is given."""
    body = table.space.static_body
    if u is not None:
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.velocity = u, 0.0
    table.add_wall(pymunk.Segment(body, (x, -9.0), (x, 9.0), 0.0), e, mu, kick=K)
    return body


def go(table: Billiards, seconds: float) -> None:
    """Let time pass."""
    for _ in range(round(seconds * 60)):
        table.space.step(1 / 60)


# -- closed forms ----------------------------------------------------------------------------------


@pytest.mark.parametrize("u", [None, 0.0, 0.4, -0.3])
@pytest.mark.parametrize(("e", "mu"), [(1.0, 0.0), (0.7, 0.2), (0.0, 0.1)])
def test_a_kick_is_added_to_the_answer_of_the_law(e: float, mu: float, u: float | None) -> None:
    """v_n' - u = e (u - v_n) + k, and the friction is that without the kick."""
    table = bare()
    body, heard = bumper(table, 0.0, e, mu, u), heard_by(table)
    one, closing = ball(table, 0.5, 0.0, (-1.0, 0.5)), 1.0 + (u or 0.0)
    go(table, 1.0)
    assert one.path.vx == pytest.approx((u or 0.0) + e * closing + K, abs=1e-12)
    assert one.path.vy == pytest.approx(0.5 - mu * (1 + e) * closing, abs=1e-12)
    assert [each.closing for each in heard] == [pytest.approx(closing, abs=1e-12)]
    assert heard[0].impulse == pytest.approx(M * (one.path.vx + 1.0), abs=1e-12)
    assert heard[0].tangential == pytest.approx(M * (one.path.vy - 0.5), abs=1e-12)
    assert body.velocity.x == (u or 0.0)


@pytest.mark.parametrize("e", [1.0, 0.8])
def test_a_ball_between_two_bumpers(e: float) -> None:
    """At e = 1 it gains 2 k a round trip; below 1 its speed tends to k / (1 - e)."""
    table = bare()
    bumper(table, 0.0, e)
    bumper(table, 1.0, e)
    one, heard = ball(table, 0.5, 0.0, (-1.0, 0.0)), heard_by(table)
    go(table, 2.0 if e == 1.0 else 30.0)
    speed = 1.0
    for each in heard:
        assert each.closing == pytest.approx(speed, abs=1e-11)
        speed = e * speed + K
    assert one.path.speed == pytest.approx(speed, abs=1e-11)
    assert len(heard) > 3
    if e < 1.0:
        assert one.path.speed == pytest.approx(K / (1.0 - e), abs=1e-6)


def test_a_kick_slows_no_roll() -> None:
    """The roll shrinks by (5/2) mu (1 + e) v, as at a wall without a kick."""
    table = bare(rolling=0.1, deceleration=1.0)
    bumper(table, 0.0, 0.5, 0.1)
    one = ball(table, R + 1e-6)
    table.strike(one, (-1.0, 0.0), roll=1.0)
    table.space.step(1e-4)
    assert one.path.vx == pytest.approx(0.5 + K, abs=1e-4)
    assert one.path.wx == pytest.approx(-1.0 + 2.5 * 0.1 * 1.5, abs=1e-3)


# -- what persists, and what comes at once ---------------------------------------------------------


def test_a_bumper_does_not_kick_what_persists() -> None:
    """A ball that only its roll presses on does not hit the bumper; one that hits it is kicked."""
    table = bare(rolling=0.1, deceleration=1.0)
    bumper(table, 0.0, 0.5, 0.1)
    one, heard = ball(table, R), heard_by(table)
    table.restore_state(TableState(0.0, {0: (R, 0.0, 0.0, 0.0)}, {0: (-0.5, 0.0)}))
    go(table, 5.0)
    assert one.body.position.x == pytest.approx(R, abs=1e-9)
    assert [each.since is None for each in heard] == [False]
    table.strike(one, (-0.1, 0.0))
    go(table, 0.01)
    go(table, 1 / 60)
    assert heard[-1].closing == pytest.approx(0.1)
    assert one.path.vx > K / 2


def test_a_dead_bumper_that_pushes_kicks_at_each_hit() -> None:
    """At e = 0 a wall that pushes a ball stays in contact with it; a bumper kicks it off again."""
    table = bare(0.0, deceleration=1.0)
    bumper(table, 0.0, 0.0, 0.0, 0.4)
    ball(table, R + 0.1)
    heard = heard_by(table)
    go(table, 3.0)
    assert len(heard) > 1
    assert all(each.since is None for each in heard)
    assert heard[1].closing == pytest.approx(0.4, abs=1e-9)  # The ball rests by then.


def test_two_bumpers_at_once_kick_once_each() -> None:
    table = bare()
    for a, b in (((0.0, 0.0), (9.0, 0.0)), ((0.0, 9.0), (0.0, 0.0))):
        table.add_wall(pymunk.Segment(table.space.static_body, a, b, 0.0), 0.5, 0.0, kick=K)
    one, heard = ball(table, 0.5, 0.5, (-1.0, -1.0)), heard_by(table)
    go(table, 0.6)
    assert (one.path.vx, one.path.vy) == pytest.approx((0.5 + K, 0.5 + K))
    assert [each.impulse for each in heard] == pytest.approx([M * (1.5 + K)] * 2)


@pytest.mark.parametrize("heavy", [1.0, 3.0, 30.0])
@pytest.mark.parametrize("gap", [0.0, 1e-4])
def test_a_ball_that_is_hit_on_to_a_bumper_is_kicked_once_an_instant(
    heavy: float, gap: float
) -> None:
    """A touching ball goes to and fro between bumper and striker, and only its first hit kicks.

    Where there is a gap, the hits come one after the other, and each of them kicks.
    """
    table = bare()
    bumper(table)
    body = pymunk.Body(M * heavy, 1e-4)
    body.position, body.velocity = (3.0 * R + 0.1 + gap, 0.0), (-1.0, 0.0)
    one, other = ball(table, R + gap), table.add_ball(pymunk.Circle(body, R))
    heard = heard_by(table)
    go(table, 0.5)
    v, w, kick = 0.0, -1.0, K
    while w < v or v < 0.0:
        if w < v:
            mean = (v + heavy * w) / (1.0 + heavy)
            v, w = 2.0 * mean - v, 2.0 * mean - w
        if v < 0.0:
            v, kick = -v + kick, 0.0 if gap == 0.0 else K
    assert (one.path.vx, other.path.vx) == pytest.approx((v, w), abs=1e-9)
    given = sum(each.impulse for each in heard if each.wall is not None)
    assert given == pytest.approx(M * (v + heavy * (w + 1.0)), abs=1e-12)


def test_a_bumper_does_not_kick_a_ball_that_it_squeezes() -> None:
    """After 20 hits in a step, which all kick, the ball bounces no more."""
    table = bare()
    table.add_wall(pymunk.Segment(table.space.static_body, (0.5, -9.0), (0.5, 9.0), 0.0), 1.0)
    body, heard, jams = bumper(table, u=0.5), heard_by(table), list[float]()
    ball(table, 0.5 - R - 1e-3)
    table.on_jam = lambda _ball, _wall, t: jams.append(t)
    while body.position.x < 0.5 - R:
        go(table, 1 / 60)
    assert len(jams) == 1
    hits = [each for each in heard if each.wall == 1]
    gains = [each.impulse / M - each.closing for each in hits]
    assert gains[:20] == pytest.approx([each.closing + K for each in hits[:20]])
    assert gains[20:] == pytest.approx([0.0] * (len(hits) - 20), abs=1e-12)


# -- what else a table does ------------------------------------------------------------------------


def test_a_shot_that_is_taken_back_is_kicked_again() -> None:
    table = bare()
    bumper(table)
    one, saved = ball(table, 0.5, 0.0, (-1.0, 0.0)), table.save_state()
    for _ in range(2):
        go(table, 1.0)
        assert one.path.vx == pytest.approx(1.0 + K)
        table.restore_state(TableState.from_json(saved.to_json()))


def test_a_clock_that_is_set_back_takes_no_kick_away() -> None:
    table = bare()
    bumper(table)
    one = ball(table, 0.5)
    for _ in range(2):
        table.time = 0.0
        table.place(one, (0.5, 0.0))
        table.strike(one, (-1.0, 0.0))
        go(table, 1.0)
        assert one.path.vx == pytest.approx(1.0 + K)


@pytest.mark.parametrize("u", [None, 0.0])
def test_an_aiming_line_sees_the_kick(u: float | None) -> None:
    table = bare(deceleration=1.0)
    bumper(table, u=u)
    one = ball(table, 0.5)
    found = table.predict(one, (-1.0, 0.0))
    speed = math.sqrt(1.0 - 2.0 * (0.5 - R)) + K
    assert found.way[-1][0] == pytest.approx(R + speed * speed / 2.0)


@pytest.mark.parametrize("kick", [-0.1, math.nan, math.inf, "1", None])
def test_an_impossible_kick_is_refused(kick: Any) -> None:
    table = bare()
    shape = pymunk.Circle(table.space.static_body, 0.1)
    with pytest.raises(ValueError, match=r"^kick = [^\n]*: must be [^\n]*$"):
        table.add_wall(shape, 1.0, kick=kick)
    assert not table.walls


def test_a_scene_has_no_bumpers() -> None:
    table = bare()
    bumper(table)
    with pytest.raises(ValueError, match=r"^kick = 0.5: a scene has no walls that kick"):
        table.to_scene()


def scenes(first: int, last: int, seconds: float) -> None:
    """Check that no puck tunnels in random scenes with bumpers."""
    for seed in range(first, last):
        played = Scene(seed, turns=seed % 2 == 1, kicks=True).play(seconds)
        assert played.deepest < 1e-6 * R, seed
        assert played.outside < 1e-6 * R, seed


def test_no_puck_passes_a_bumper() -> None:
    scenes(0, 4, 0.3)


@pytest.mark.parametrize("tens", range(share_of(200) // 10))
def test_no_puck_passes_a_bumper_in_200_scenes(tens: int) -> None:
    scenes(10 * tens, 10 * tens + 10, 1.0)
