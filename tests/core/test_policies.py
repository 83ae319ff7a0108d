"""Each piece of the policies for hard contacts is needed: the tests fail without it."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from pool_pymunk import Friction, Physics, Restitution, Run, Scene, Table
from pool_pymunk.core.motion.path import sliding
from pool_pymunk.core.walls.face import Face, face_between
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws import LAWS, Law
from pool_pymunk.laws.contact import NT, Contact, Pair, Respond, Velocities
from pool_pymunk.results.trace import COLLAPSE, farthest
from pool_pymunk.results.variants import FINER, Variant
from tests.shared.hard_scenes import R, disc, exact, persistent, squeezed
from tests.shared.scenes import largest_distance
from tests.shared.shots import some_scene

# -- one instant -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("e", "ratio"), [(0.9, 200.0), (0.97, 200.0), (0.997, 1e5)])
def test_many_hits_at_one_instant_that_have_an_end_are_played_to_it(e: float, ratio: float) -> None:
    """A light ball touches a cushion and a heavy ball: they hit dozens or thousands of times.

    With a gap of a micrometre the same hits come one after the other, and end alike.
    """
    ends = []
    for gap in (0.0, 1e-6):
        balls = (
            disc("light", (R + gap, 0.0)),
            disc("heavy", (3 * R + 2 * gap, 0.0), (-1.0, 0.0), mass=ratio),
        )
        box = Table(((0.0, -1.0), (20.0, -1.0), (20.0, 1.0), (0.0, 1.0)))
        scene = Scene(balls, box, Restitution(e, None, e), physics=Physics(max_time=1.0))
        run = exact(scene)
        assert bool(run.warnings) == (gap == 0.0 and ratio > 200.0)  # not all hits are listed
        assert len(run.events) > 20
        ends.append(run.end.velocity)
    for touching, apart in zip(*ends, strict=True):
        assert touching == pytest.approx(apart, abs=1e-4)


def test_hits_a_moment_apart_are_not_one_instant() -> None:
    """A fast ball between two cushions hits 2,000 times: these are not rounds of one instant."""
    gap = 1e-3
    slot = Table(((0.0, 0.0), (2 * R + gap, 0.0), (2 * R + gap, 1.0), (0.0, 1.0)))
    scene = Scene(
        (disc("a", (R, 0.5), (1e3, 0.0)),),
        slot,
        Restitution(None, None, 0.999),
        physics=Physics(max_time=5e-3),
    )
    run = exact(scene)
    assert not run.warnings
    assert len(run.events) > 1000


def test_a_ball_that_a_cushion_leads_along_by_rounding_goes_on() -> None:
    """It closes by less than rounding: this is no hit, and the ball slides on until it stops."""
    lane = Table(((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (0.0, 1.0)))
    balls = (disc("a", (1.0, R + 1e-16), (1.0, -1e-15)),)
    run = exact(Scene(balls, lane, Restitution(None, None, 0.5), Friction(0.1)))
    length = 1.0 / (2 * 0.1 * 9.80665)
    assert [event.kind for event in run.events] == ["stop"]
    assert run.final["a"] == pytest.approx((1.0 + length, R), abs=1e-15)


def test_a_ball_that_others_press_to_a_cushion_does_not_hit_it_for_nothing() -> None:
    """Five balls that lose all in every hit come to rest in a box, in some dozens of instants.

    Without the rule of the test above they need a million: rounding turns a ball that lies at a
    cushion to it again and again.
    """
    pitch = 2.1 * R
    directions = ((-1.59, -0.42), (-1.73, -0.39), (1.2, 1.06), (0.15, -0.89), (-1.58, -1.14))
    balls = tuple(
        disc(str(k), ((k % 3 + 0.6) * pitch, (k // 3 + 0.6) * pitch), direction)
        for k, direction in enumerate(directions)
    )
    box = Table.rectangle(3.2 * pitch, 3.2 * pitch)
    scene = Scene(balls, box, Restitution(0.0, None, 0.0), Friction(0.1, 0.05, 0.05))
    run = exact(scene)
    assert run.status == "settled"
    assert run.steps < 1_000


@pytest.mark.parametrize("fast", [1e-2, 1.0, 1e2])
def test_what_rounding_leaves_of_a_hit_is_rest(fast: float) -> None:
    """Equal masses, e = 1, head-on along no axis: the first ball stops, and its stop is listed."""
    ux, uy = math.cos(0.3), math.sin(0.3)
    balls = (disc("a", (0.0, 0.0), (fast * ux, fast * uy)), disc("b", (0.5 * ux, 0.5 * uy)))
    run = exact(Scene(balls, None, Restitution(1.0), physics=Physics(max_time=1.0 / fast)))
    assert run.end.velocity[0] == (0.0, 0.0)
    assert [event.kind for event in run.events] == ["ball-ball", "stop"]


def test_two_contacts_that_take_turns_need_no_alarm() -> None:
    """Millions of hits amplify what nudges the start, but their order is known."""
    run = exact(squeezed(1e6, 0.8, 0.8, 0.0, 0.0))
    assert run.again is not None and run.policies == frozenset()
    assert farthest(run, run.again.play(Variant(nudge=0))) > 1e-3


# -- inelastic collapse ----------------------------------------------------------------------------


class HitByHit(Law):
    """This law is Coulomb's, but nobody knows that its hits are: none of them are leapt over."""

    @property
    def hits_are_coulombs(self) -> bool:
        return False

    def together(self, contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
        LAWS["coulomb"].together(contacts, velocity, respond)


class Counted(HitByHit):
    """This law is known to be Coulomb's, and counts the single hits that it answers."""

    answered = 0

    @property
    def hits_are_coulombs(self) -> bool:
        return True

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        self.answered += 1
        return super().ball_ball(a, b, pair)

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        self.answered += 1
        return super().cushion(v, restitution, friction)


RATIOS = 10.0, 1e2, 5e2  # of masses
LOSSES = (0.0, 0.5), (0.5, 0.5), (0.8, 0.8), (0.8, 1.0), (0.9, 0.0)  # e of balls, of the cushion
SLIPS = (0.0, 0.0), (0.0, 1e-3), (0.1, 0.0), (0.1, 1e-3), (0.02, 1e-2)  # mu, how far beside


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("losses", LOSSES)
@pytest.mark.parametrize("slips", SLIPS)
def test_the_limit_of_hits_without_end_is_what_playing_them_comes_to(
    ratio: float, losses: tuple[float, float], slips: tuple[float, float]
) -> None:
    """Hit by hit, until nothing but rounding closes; and by leaps over cycles of hits."""
    scene = squeezed(ratio, *losses, *slips)
    limit, played = exact(scene), exact(scene, law=HitByHit())
    assert COLLAPSE not in played.policies  # All hits have been played.
    assert limit.status == played.status == "settled"
    assert largest_distance(limit, played) < 1e-11


def test_some_squeezes_have_no_end_and_some_have() -> None:
    """Else the test above shows nothing. A warning tells of all hits, and the law answers some."""
    leapt = []
    for ratio, losses, slips in product(RATIOS, LOSSES, SLIPS):
        law = Counted()
        run = exact(squeezed(ratio, *losses, *slips), law=law)
        said = re.findall(r"at one instant ([0-9,]+) more", " ".join(map(str, run.warnings)))
        leapt.append(sum(int(hits.replace(",", "")) for hits in said) - law.answered)
    assert sum(count > 1000 for count in leapt) >= 15
    assert sum(count <= 0 for count in leapt) >= 3


# -- persistent contact ----------------------------------------------------------------------------


def deepest(run: Run) -> float:
    """Return how far (radii) the two balls sink into each other."""
    positions, _ = run.at(np.linspace(0.0, run.duration, 20_001))
    r = run.scene.balls[0].radius
    return float(2.0 - np.hypot(*(positions[:, 1] - positions[:, 0]).T).min() / r)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("speed", [0.01, 0.1, 1.0, 10.0])
def test_balls_in_persistent_contact_hardly_sink(e: float, speed: float) -> None:
    run = exact(persistent(e, speed))
    assert run.status == "settled"
    assert deepest(run) < 1e-8


def test_the_figure_of_policies_is_the_same_when_asked_later() -> None:
    """The run ends at its 12th event: its variants are compared with it up to there."""
    run = exact(some_scene("frozen", 5008), max_events=12)
    assert run.status == "max_events"
    assert replace(run, known_shift=None).policy_shift == run.policy_shift > 0.0


def test_variants_end_when_a_run_with_bounded_events_does() -> None:
    """Where contacts leave more out, they come to fewer events in the same time."""
    run = exact(some_scene("hard that rolls", 102), max_events=300)
    assert run.again is not None and run.status == "max_events"
    coarser = [Variant(coarser=times) for times in (30.0, 300.0)]
    assert all(run.again.play(each).duration <= run.duration for each in (*run.variants, *coarser))


@pytest.mark.parametrize(
    ("scene", "most"), [("frozen 5008", 12), ("frozen 5011", 300), ("hard that rolls 102", 60)]
)
def test_variants_that_are_played_together_have_the_bits_that_they_have_alone(
    scene: str, most: int
) -> None:
    kind, _, seed = scene.rpartition(" ")
    run = exact(some_scene(kind, int(seed)), max_events=most)
    assert run.again is not None
    rounded = [Variant(seed=0), Variant(seed=1)]
    slips = [Variant(slip=(1.0, -1.0)), Variant(nudge=0), Variant(nudge=1), *FINER]
    variants = list(dict.fromkeys((*rounded, *slips, *run.variants)))
    moves = [*run.again.moves(run, variants, {}, 40)]
    alone = run.again._replace(settings=run.again.settings._replace(max_events=min(most, 40)))
    assert moves == [farthest(run, alone.play(each)) for each in variants]
    assert max(moves) > 0.0


def test_a_persistent_contact_is_no_row_of_events_and_each_ball_stops_once() -> None:
    run = exact(persistent(0.0))
    kinds = [event.kind for event in run.events]
    assert kinds.count("ball-ball") <= 3
    assert kinds.count("stop") == 2
    last = {event.balls[0]: event.t for event in run.events if event.kind == "stop"}
    for ball, t in last.items():
        k = run.scene.index[ball]
        assert run.knots[k][-1, 0] == t


# -- sides -----------------------------------------------------------------------------------------


def test_a_wall_with_two_faces_back_to_back_turns_the_nearer_one_to_the_ball() -> None:
    """A segment of no thickness, as most people write it, has two faces that are as near."""
    front, back = face_between((0.0, 0.0), (1.0, 0.0)), face_between((1.0, 0.0), (0.0, 0.0))
    wall = Wall([front, back], 1.0, 0.0, 0)
    for y in (R, -R):
        side = wall.nearest(0.5, y, R, 0.0)
        assert side.normal(0.5, y) == (0.0, math.copysign(1.0, y))
        assert side.gap(0.5, y, R) == 0.0


def test_a_wall_is_met_where_its_first_side_is() -> None:
    sides: list[Side] = [face_between((0.0, 0.0), (1.0, 0.0)), RoundSide((1.0, 0.0))]
    wall = Wall(sides, 1.0, 0.0, 0)
    down = sliding(0.0, (0.5, 1.0), (0.0, -1.0), 0.0)
    past = sliding(0.0, (1.0 + R / 2, 1.0), (0.0, -1.0), 0.0)
    beside = sliding(0.0, (1.0 + 2 * R, 1.0), (0.0, -1.0), 0.0)
    assert wall.time_of_contact(down, R, 0.0) == pytest.approx(1.0 - R)
    assert wall.time_of_contact(past, R, 0.0) == pytest.approx(1.0 - R * math.sqrt(0.75))
    assert wall.time_of_contact(beside, R, 0.0) == math.inf


def test_a_face_is_beside_whoever_has_its_foot_on_it() -> None:
    face = Face((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), 1.0)
    assert face.gap(0.5, 0.3, R) == pytest.approx(0.3 - R)
    assert face.gap(1.1, 0.3, R) == math.inf
