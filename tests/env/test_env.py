"""The environments keep Gymnasium's conventions, their own rules, and agree with each other."""

from __future__ import annotations

import copy
import math
import pickle
import runpy
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Pocket,
    Restitution,
    Scene,
    SceneError,
    SettingError,
    Table,
    load,
    simulate,
    simulate_many,
)
from tests import ROOT
from tests.shared.scenes import takes_long

gym = pytest.importorskip("gymnasium")

from gymnasium.error import ResetNeeded  # noqa: E402
from gymnasium.utils.env_checker import check_env, data_equivalence  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402

from pool_pymunk.env import (  # noqa: E402
    BilliardsEnv,
    BilliardsVectorEnv,
    CaromEnv,
    CaromVectorEnv,
    CarromEnv,
    CarromVectorEnv,
    Game,
    Generators,
    Played,
    PotEnv,
    PotVectorEnv,
    Tables,
    game,
)

IDS = ("pool_pymunk/Carom-v0", "pool_pymunk/Pot-v0")  # of billiards
CARROM = "pool_pymunk/Carrom-v0"  # the board game
Places = dict[str, tuple[float, float]]
R = 0.03  # m; the radius of the balls in the scenes below
HOLE = 0.06  # m


LAYOUTS = "ee987967743c8c6b9ba735d043fb505d5ba3469928b502e2be9b29e3e12c9b19"


def scene(balls: Places, *pockets: tuple[float, float]) -> Scene:
    """Return a table of 2 x 1 m with these balls and pockets; the cue ball is called C."""
    made = (Ball(id_, place, R, 0.17, cue=id_ == "C") for id_, place in balls.items())
    holes = tuple(Pocket(str(k), place, HOLE) for k, place in enumerate(pockets))
    table, law = Table.rectangle(2.0, 1.0), Physics()
    return Scene(
        tuple(made), table, Restitution(0.95, cushion=0.7), Friction(0.1), law, pockets=holes
    )


class Nearest(Game):
    """The cue ball, which begins anywhere, shall stop near a spot that is drawn."""

    scenario, balls, max_speed = "follow-and-draw", 1, 2.0
    shots, least, lost_score, more_seen = 2, 0, -9.0, 2
    has_roll = has_place = True

    def layouts(self, rng: Generators) -> Any:
        places = np.tile(self.spots, (len(rng), 1, 1))
        places[:, self.cue] = [0.3, 0.3] + rng.integers(2, size=2) * 0.1
        return places

    def begin(self, tables: Tables, rng: Generators, options: Any) -> None:
        tables["spot"] = rng.uniform(0.2, 0.8, size=2)

    def score(self, played: Played) -> Any:
        away = played.tables.position[:, self.cue] - played.tables["spot"]
        return np.where(played.foul, -1.0, -np.hypot(*np.nan_to_num(away).T))

    def observe(self, tables: Tables) -> Any:
        seen = super().observe(tables)
        seen[:, -2:] = tables["spot"]
        return seen


def with_a_heavy_cue_ball(table: Scene) -> Scene:
    """Return the scene with a cue ball that hardly minds what it hits."""
    return replace(table, balls=(replace(table.balls[0], mass=100.0), *table.balls[1:]))


def as_set_up(plays: type[BilliardsEnv], table: Scene, **settings: Any) -> BilliardsEnv:
    """Return an environment with the balls where the scene has them."""
    env = plays(table, layout="scenario", **settings)
    env.reset(seed=0)
    return env


def to_the_right(power: float) -> np.ndarray[Any, Any]:
    """Return a shot along +x."""
    return np.array([0.0, power], np.float32)


# -- Gymnasium's conventions -----------------------------------------------------------------------


@pytest.mark.parametrize("id_", [*IDS, CARROM])
@pytest.mark.parametrize("mode", [None, "rgb_array", "rgb_array_list"])
def test_check_env_has_nothing_to_say(id_: str, mode: str | None) -> None:
    check_env(gym.make(id_, render_mode=mode).unwrapped)


@pytest.mark.parametrize(
    ("id_", "settings"),
    [
        (IDS[0], {"scenario": "l-shaped"}),
        (IDS[0], {"scenario": "report", "layout": "scenario", "angle_error": 1.0}),
        (IDS[0], {"scenario": "nine-ball"}),
        (IDS[1], {"scenario": "nine-ball", "balls": 2, "speed_error": 0.1}),
        (CARROM, {"layout": "random", "balls": 5}),
    ],
)
def test_check_env_has_nothing_to_say_of_other_tables(id_: str, settings: dict[str, Any]) -> None:
    check_env(gym.make(id_, **settings).unwrapped)


def test_a_series_is_cut_off_after_a_hundred_shots() -> None:
    assert gym.spec(IDS[0]).max_episode_steps == 100
    assert gym.spec(IDS[1]).max_episode_steps is None  # One shot ends the episode.


@pytest.mark.parametrize("id_", [*IDS, CARROM])
def test_make_vec_makes_the_native_environment(id_: str) -> None:
    envs = gym.make_vec(id_, num_envs=3, autoreset_mode=AutoresetMode.SAME_STEP)
    assert type(envs.unwrapped) in (CaromVectorEnv, CarromVectorEnv, PotVectorEnv)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert envs.unwrapped.most == (100 if id_ == IDS[0] else math.inf)
    seen, _ = envs.reset(seed=1)
    assert seen in envs.observation_space
    envs.close()
    envs.close()


@pytest.mark.parametrize("id_", IDS)
def test_seeds_reproduce_everything(id_: str) -> None:
    def episodes(seed: int) -> list[Any]:
        np.random.seed(seed)  # This must not matter.
        env = gym.make(id_, angle_error=0.5, speed_error=0.05)
        found: list[Any] = [env.reset(seed=7)]
        env.action_space.seed(3)
        for _ in range(10):
            found.append(env.step(env.action_space.sample()))
            if found[-1][2]:
                found.append(env.reset())
        return found

    assert data_equivalence(episodes(1), episodes(2), exact=True)
    env = gym.make(id_)
    assert (env.reset(seed=7)[0] != env.reset(seed=8)[0]).any()


def test_a_generator_of_ones_own_is_used() -> None:
    env, other = CaromEnv(), CaromEnv()
    env.reset(seed=0)
    env.np_random = np.random.default_rng(5)
    other.reset(seed=0)
    other.np_random = np.random.default_rng(5)
    assert (env.reset()[0] == other.reset()[0]).all()


def test_without_gymnasium_one_sentence_says_what_to_do() -> None:
    code = "import sys; sys.modules['gymnasium'] = None; import pool_pymunk.env"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    last = result.stderr.splitlines()[-1]
    assert last == ("ImportError: pool_pymunk.env needs Gymnasium: pip install 'pool-pymunk[env]'")


@pytest.mark.parametrize("again", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_go_on_alike(again: Callable[[Any], Any]) -> None:
    env = CaromEnv(angle_error=1.0)
    env.reset(seed=3)
    env.step([0.1, 0.6])
    other = again(env)
    env.reset(), other.reset()
    assert data_equivalence(env.step([0.2, 0.1]), other.step([0.2, 0.1]), exact=True)


# -- what is done and seen -------------------------------------------------------------------------


def test_a_shot_is_what_the_exact_solver_plays() -> None:
    env = CaromEnv()
    for seed in range(20):
        env.reset(seed=seed)
        env.action_space.seed(seed)
        action, start = env.action_space.sample(), env.position
        _, reward, terminated, _, info = env.step(action)
        assert info["angle"] == pytest.approx(180.0 * action[0], abs=1e-4)
        assert info["speed"] == pytest.approx(2.5 * (1.0 + action[1]), abs=1e-6)
        angle = math.radians(info["angle"])
        velocity = np.zeros_like(start)
        velocity[0] = info["speed"] * math.cos(angle), info["speed"] * math.sin(angle)
        run = simulate(env.scene, solver="event-driven", start=(start, velocity))
        assert (env.position == run.end.position).all()
        hits = [event.balls for event in run.events if event.kind == "ball-ball"]
        met = {*map(frozenset, hits)} & {frozenset({"C", ball.id}) for ball in env.scene.balls}
        assert (info["met"], info["hits"]) == (len(met), len(hits))
        assert info["cushions"] == sum(e.kind == "ball-cushion" for e in run.events)
        assert info["duration"] == run.duration
        assert reward == (len(met) >= 2) == (not terminated) == info["points"]


def test_observations_have_the_same_scale_along_x_and_y() -> None:
    env = as_set_up(PotEnv, scene({"C": (0.5, 0.25), "a": (1.0, 0.5), "b": (1.9, 0.9)}, (2.0, 0.0)))
    seen, info = env.reset(options={"position": [(0.5, 0.25), (1.0, 0.5), (np.nan, 0.0)]})
    assert info == {"called": 1}
    expected = [-0.5, -0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0]
    assert seen.tolist() == expected
    assert seen.dtype == np.float32
    assert env.observation_space.high.tolist() == [1.0, 0.5] * 3 + [1.0] * 6
    assert env.observation_space.low.tolist() == [-1.0, -0.5] * 3 + [0.0] * 6
    assert np.isnan(env.position[2]).all()


def test_actions_beyond_the_range_are_clipped() -> None:
    env = as_set_up(CaromEnv, scene({"C": (0.5, 0.5), "a": (1.0, 0.2), "b": (1.0, 0.8)}))
    for action, angle, speed in (((-3.0, 9.0), -180.0, 5.0), ((0.25, -math.inf), 45.0, 0.0)):
        env.reset()
        info = env.step(action)[-1]
        assert (info["angle"], info["speed"]) == (angle, speed)


def test_what_is_no_action_is_refused_and_changes_nothing() -> None:
    env = CaromEnv(angle_error=1.0)
    env.reset(seed=1)
    before, drawn = env.position, env.np_random.bit_generator.state
    with pytest.raises(SettingError, match="must be two numbers"):
        env.step([0.0, math.nan])
    assert (env.position == before).all()
    assert env.np_random.bit_generator.state == drawn
    env.step([0.0, 0.0])


def test_the_hand_errs_as_it_is_asked_to() -> None:
    envs = CaromVectorEnv(600, angle_error=2.0, speed_error=0.1)
    envs.reset(seed=0)
    info = envs.step(np.zeros((600, 2)))[-1]
    assert info["angle"].mean() == pytest.approx(0.0, abs=0.3)
    assert info["angle"].std() == pytest.approx(2.0, rel=0.1)
    assert info["speed"].mean() == pytest.approx(2.5, abs=0.015)
    assert info["speed"].std() == pytest.approx(0.1, rel=0.1)
    assert abs(np.corrcoef(info["angle"], info["speed"])[0, 1]) < 0.15
    envs.reset(seed=0)
    slow = envs.step(np.tile([0.0, -1.0], (600, 1)))[-1]["speed"]
    assert slow.min() == 0.0 < slow.max()


# -- the rules of carom ----------------------------------------------------------------------------

TWO = {"C": (0.4, 0.5), "a": (1.0, 0.555), "b": (1.3, 0.47)}


def test_two_balls_score_and_the_series_goes_on() -> None:
    env = as_set_up(CaromEnv, with_a_heavy_cue_ball(scene(TWO)))
    _, reward, terminated, truncated, info = env.step(to_the_right(0.4))
    assert (reward, terminated, truncated) == (1.0, False, False)
    assert (info["met"], info["points"], info["first_hit"], info["foul"]) == (2, 1, 1, False)
    reached = env.position
    _, reward, terminated, _, info = env.step(to_the_right(-1.0))
    assert (reward, terminated, info["points"], info["met"]) == (0.0, True, 1, 0)
    assert (env.position == reached).all()


def test_a_pocketed_cue_ball_scores_nothing() -> None:
    """It meets two balls before it falls into the pocket."""
    heavy = with_a_heavy_cue_ball(scene(TWO | {"c": (0.2, 0.2)}))
    end = as_set_up(CaromEnv, heavy)
    assert end.step(to_the_right(0.4))[-1]["met"] == 2
    last = tuple(end.position[0].tolist())
    env = as_set_up(CaromEnv, replace(heavy, pockets=(Pocket("p", last, 0.02),)))
    seen, reward, terminated, _, info = env.step(to_the_right(0.4))
    assert (info["met"], info["foul"]) == (2, True)
    assert (reward, terminated, info["points"]) == (0.0, True, 0)
    assert np.isnan(env.position[0]).all()
    assert seen.tolist()[:2] == [0.0, 0.0] and seen[8] == 1.0


def test_a_series_ends_when_too_few_balls_are_left() -> None:
    """The shot scores all the same."""
    heavy = with_a_heavy_cue_ball(scene(TWO))
    end = as_set_up(CaromEnv, heavy)
    assert not end.step(to_the_right(0.4))[2]
    last = tuple(end.position[1].tolist())
    env = as_set_up(CaromEnv, replace(heavy, pockets=(Pocket("p", last, 0.02),)))
    seen, reward, terminated, _, info = env.step(to_the_right(0.4))
    assert (reward, info["met"], info["foul"], info["points"]) == (1.0, 2, False, 1)
    assert seen[6:8].tolist() == [0.0, 1.0]
    assert terminated


# -- the rules of pot ------------------------------------------------------------------------------

STRAIGHT = {"C": (0.5, 0.5), "a": (1.0, 0.5), "b": (1.6, 0.2)}


@pytest.mark.parametrize(("called", "scores"), [("a", True), ("b", False)])
def test_only_the_called_ball_scores(called: str, scores: bool) -> None:
    env = as_set_up(PotEnv, scene(STRAIGHT, (2.0, 0.5)), max_speed=2.0)
    env.reset(options={"called": called})
    _, reward, terminated, truncated, info = env.step(to_the_right(0.8))
    assert info["pocketed"] == 1
    assert (reward, info["is_success"], info["foul"]) == (float(scores), scores, False)
    assert terminated and not truncated
    assert env.scene.balls[info["called"]].id == called


def test_the_cue_ball_must_stay_on_the_table() -> None:
    table = with_a_heavy_cue_ball(scene(STRAIGHT, (2.0, 0.5)))
    env = as_set_up(PotEnv, table, max_speed=4.0)
    env.reset(options={"called": "a"})
    _, reward, terminated, _, info = env.step(to_the_right(0.6))
    assert (info["pocketed"], info["foul"], info["is_success"]) == (2, True, False)
    assert (reward, terminated) == (0.0, True)


def test_every_ball_is_called_equally_often() -> None:
    envs = PotVectorEnv(3_000)
    called = envs.reset(seed=0)[1]["called"]
    counts = np.bincount(called, minlength=4)
    assert counts[0] == 0
    assert np.abs(counts[1:] - 1_000).max() < 100
    hidden = [(0.5, 0.5), (1.0, 0.5), (np.nan, 0.0), (1.5, 0.5)]
    called = envs.reset(options={"position": hidden})[1]["called"]
    assert set(called.tolist()) == {1, 3}


# -- the rules of carrom, the board game -----------------------------------------------------------

HOLE_AT, LINE_AT = np.array([0.02225, 0.71775]), np.array([0.37, 0.1174])  # m
TO_HOLE = math.degrees(math.atan2(*(HOLE_AT - LINE_AT)[::-1])) / 90.0 - 1.0


def men_at(env: Any, **places: Any) -> dict[str, Any]:
    """Return the option of ``reset`` that has no other men on the board than these."""
    position = np.full((len(env.scene.balls), 2), np.nan)
    for id_, place in places.items():
        position[env.scene.index[id_]] = place
    return {"position": position}


@pytest.mark.parametrize("power", [-0.45, 1.0])
@pytest.mark.parametrize(("id_", "worth"), [("W1", 1.0), ("B1", -1.0), ("Q", 0.0)])
def test_men_score_by_their_colour_and_the_striker_costs_one(
    id_: str, worth: float, power: float
) -> None:
    env, halfway = CarromEnv(), (HOLE_AT + LINE_AT) / 2.0
    env.reset(options=men_at(env, **{id_: halfway, "W9": (0.6, 0.6), "B9": (0.65, 0.4)}))
    _, reward, terminated, truncated, info = env.step([TO_HOLE, power, 0.0])
    foul = power == 1.0  # The striker, which is heavier, follows into the pocket.
    assert (reward, info["foul"]) == (worth - foul, foul)
    assert (info["own"], info["others"]) == (id_ == "W1", id_ == "B1")
    assert (info["left"], terminated, truncated) == (1, False, False)
    assert np.isnan(env.position[env.scene.index[id_]]).all()
    assert env.step([0.0, -1.0, 0.5])[1:4] == (0.0, False, False)  # The striker is back.


def test_a_board_of_carrom_is_over_when_the_own_men_are_gone() -> None:
    env, halfway = CarromEnv(), (HOLE_AT + LINE_AT) / 2.0
    for id_, is_over in (("W3", True), ("B3", False)):
        other = {"B4": (0.6, 0.6)} if is_over else {"W4": (0.6, 0.6)}
        assert env.reset(options=men_at(env, **{id_: halfway}, **other))[1] == {"left": 1}
        _, _, terminated, truncated, info = env.step([TO_HOLE, -0.45, 0.0])
        assert (terminated, truncated, info["left"]) == (is_over, False, not is_over)


def test_a_board_of_carrom_is_cut_off_after_thirty_shots() -> None:
    env = CarromEnv(balls=2)
    env.reset(seed=0)
    ends = [env.step([0.0, -1.0, 0.0])[2:4] for _ in range(30)]
    assert ends == [(False, False)] * 29 + [(False, True)]


def test_the_striker_leaves_forwards_from_the_base_line() -> None:
    env = CarromEnv()
    for action, angle, x in (((-1, -1, -1), 0.0, 0.1509), ((1, -1, 0.5), 180.0, 0.47955)):
        seen, _ = env.reset(seed=0)
        assert seen[2 * env.game.cue : 2 * env.game.cue + 2].tolist() == [0.0, 0.0]
        info = env.step(np.array(action, float))[-1]
        assert (info["angle"], info["speed"]) == (angle, 0.0)
        assert info["place"] == pytest.approx([x, 0.1174])


def test_the_striker_goes_to_the_nearest_free_place_on_the_line() -> None:
    """Two men leave no room between them, so the striker goes beside one of them."""
    env = CarromEnv()
    two = men_at(env, W1=(0.36, 0.1174), W2=(0.40, 0.1074), B1=(0.5, 0.5))
    for along, x in ((0.0, 0.36 - 0.03625), (0.1, 0.40 + math.sqrt(0.03625**2 - 0.01**2))):
        env.reset(options=two)
        tried = env.rehearse(np.array([[0.0, -0.5, along]]))
        _, reward, _, _, info = env.step([0.0, -0.5, along])
        assert info["place"] == pytest.approx([x, 0.1174])
        assert (info["status"], info["hits"], reward) == (0, 0, 0.0)
        assert tried.final[0, env.game.cue, 0] == pytest.approx(x)


def test_the_striker_fits_between_two_men_who_leave_just_its_room() -> None:
    """Edges of both are one place then, to rounding."""
    game, apart = CarromEnv().game, 0.0155 + 0.02065 + 1e-4
    middles = np.linspace(0.25, 0.5, 50)
    men = np.full((50, *game.spots.shape), np.nan)
    for k, side in ((1, -1.0), (2, 1.0)):
        men[:, k] = np.stack([middles + side * apart, np.full(50, 0.1174)], axis=1)
    asked = np.stack([middles + 0.01, np.full(50, 0.1174)], axis=1)
    found = game.put(Tables(position=men), asked)
    np.testing.assert_allclose(found[:, 0], middles, atol=1e-12)


def test_a_shot_is_lost_where_men_fill_the_base_line() -> None:
    env = CarromEnv()
    row = {f"W{k}": (0.10 + 0.06 * k, 0.1174) for k in range(1, 9)}
    env.reset(options=men_at(env, **row))
    _, reward, terminated, _, info = env.step([0.0, 1.0, 0.0])
    assert (reward, terminated, info["status"], info["left"]) == (0.0, True, 4, 8)


def test_men_of_carrom_lie_in_the_rack_or_anywhere() -> None:
    rack, anywhere = CarromVectorEnv(3), CarromVectorEnv(3, layout="random")
    men = np.arange(20) != rack.game.cue
    rack.reset(seed=1), anywhere.reset(seed=1)
    assert (rack.position[:, men] == rack.game.spots[men]).all()
    assert len(np.unique(anywhere.position[:, men, 0])) == 57
    assert np.isnan(anywhere.position[:, ~men]).all()
    with pytest.raises(SettingError, match="a man of one's own must be on the board"):
        rack.reset(options=men_at(rack, B1=(0.5, 0.5)))


# -- what else may come of a shot ----------------------------------------------------------------


def test_a_shot_that_is_cut_off_leaves_its_balls_where_they_are() -> None:
    table = replace(scene(TWO), friction=Friction(), physics=Physics(max_time=0.25))
    env = as_set_up(CaromEnv, table)
    _, _, _, _, info = env.step(to_the_right(-0.6))
    assert info["status"] == 1
    assert env.position[0] == pytest.approx([0.65, 0.5])


def test_a_shot_without_an_outcome_scores_nothing_and_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    play = simulate_many

    def lost(*arguments: Any) -> Any:
        batch = play(*arguments)
        final = np.full_like(batch.final, np.inf)
        return replace(batch, final=final, status=np.full_like(batch.status, 3))

    env = as_set_up(CaromEnv, with_a_heavy_cue_ball(scene(TWO)))
    before = env.position
    monkeypatch.setattr(game, "simulate_many", lost)
    seen, reward, terminated, _, info = env.step(to_the_right(0.4))
    assert (reward, terminated, info["status"], info["points"]) == (0.0, True, 3, 0)
    assert (env.position == before).all()
    assert seen in env.observation_space


def test_steps_come_after_a_reset() -> None:
    envs: tuple[Any, ...] = (CaromEnv(), CaromVectorEnv(2))
    for env in envs:
        with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
            env.step([0.0, 0.0])
        with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
            print(env.position)
    env = PotEnv()
    env.reset(seed=0)
    env.step([0.0, -1.0])
    with pytest.raises(ResetNeeded, match="The episode is over"):
        env.step([0.0, -1.0])


def test_a_rehearsal_changes_nothing_and_tells_what_a_shot_scores() -> None:
    env = CaromEnv(angle_error=3.0)
    env.reset(seed=3)
    before, drawn = env.position, env.np_random.bit_generator.state
    actions = np.random.default_rng(0).uniform(-1, 1, (40, 2))
    rehearsal = env.rehearse(actions)
    rewards = rehearsal.reward
    assert (env.position == before).all()
    assert env.np_random.bit_generator.state == drawn
    steady = CaromEnv()
    for k, (action, reward) in enumerate(zip(actions, rewards, strict=True)):
        steady.reset(options={"position": before})
        _, scored, terminated, _, info = steady.step(action)
        assert (scored, terminated) == (reward, rehearsal.terminated[k])
        assert (steady.position == rehearsal.final[k]).all()
        assert info["duration"] == rehearsal.duration[k] == rehearsal.run(k).duration
    assert 0 < rewards.sum() < 40
    envs = CaromVectorEnv(2)
    envs.reset(seed=3)
    two = np.stack([actions, actions[::-1]], axis=1)
    both = envs.rehearse(two)
    assert (both.reward[:, 0] == rewards).all()
    assert both.reward.shape == both.terminated.shape == (40, 2)
    assert (both.final[0::2] == rehearsal.final).all()
    some = envs.rehearse(actions[:3], tables=[0, 1, 0])
    assert (some.reward == both.reward[[0, 38, 2], [0, 1, 0]]).all()
    with pytest.raises(SettingError, match=r"must have the shape \(40, 2, 2\)"):
        envs.rehearse(actions)
    with pytest.raises(SettingError, match="must be numbers"):
        env.rehearse([[0.0, 0.0], [0.0]])
    assert env.rehearse(np.empty((0, 2))).reward.shape == (0,)


# -- games of one's own ----------------------------------------------------------------------------


def test_check_env_has_nothing_to_say_of_a_game_of_ones_own() -> None:
    check_env(gym.make("pool_pymunk/Billiards-v0", game=Nearest).unwrapped)
    made = gym.make("pool_pymunk/Billiards-v0", game=Nearest(max_speed=1.0)).unwrapped
    assert (made.game.max_speed, made.game.name) == (1.0, "Nearest")


def test_an_action_has_a_roll_and_a_place_where_the_game_says_so() -> None:
    env = BilliardsEnv(game=Nearest)
    assert env.action_space.shape == (5,)
    env.reset(seed=1)
    info = env.step([0.1, 0.2, -0.5, 0.25, -0.25])[-1]
    middle, half = env.game.middle, env.game.half_size
    assert info["roll"] == -0.5
    assert info["place"].tolist() == (middle + half * [0.25, -0.25]).tolist()
    angle = math.radians(18.0)
    velocity = np.zeros((2, 2))
    velocity[0] = 1.2 * math.cos(angle), 1.2 * math.sin(angle)
    position = np.array([info["place"], env.game.spots[1]])
    batch = simulate_many(env.scene, position, velocity, roll=-0.5 * velocity)
    assert (env.position == batch.final[0]).all()
    with pytest.raises(
        SettingError, match=r"shape \(5,\): an angle and a speed and a roll and a pl"
    ):
        env.step([0.0, 0.0])


def test_a_shot_whose_place_is_not_free_is_lost() -> None:
    envs = BilliardsVectorEnv(3, game=Nearest, autoreset_mode="Disabled")
    envs.reset(seed=1)
    before, game = envs.position, envs.game
    on_the_ball = (game.spots[1] - game.middle) / game.half_size
    actions = [[0.0, 0.0, 0.0, *on_the_ball], [0.0] * 5, [0.0, 0.0, 0.0, 1.0, 1.0]]
    _, reward, terminated, _, infos = envs.step(actions)
    assert reward[[0, 2]].tolist() == [-9.0, -9.0] and -3.0 < reward[1] < 0.0
    assert terminated.tolist() == [True, False, True]
    assert infos["status"].tolist() == [4, 0, 4]
    assert (envs.position[[0, 2]] == before[[0, 2]]).all()


def test_a_ball_in_hand_comes_back() -> None:
    """Without a place of its own, a pocketed cue ball ends the episode of any game."""
    table = scene({"C": (0.5, 0.5), "a": (1.0, 0.2)}, (2.0, 0.5))

    class Hand(Game):
        scenario, shots, has_place = table, 9, True

        def score(self, played: Played) -> Any:
            return played.foul

    class NoHand(Hand):
        has_place = False

    env = BilliardsEnv(game=Hand)
    env.reset(options={"position": [(np.nan, 0.0), (1.0, 0.2)]})
    for _ in range(2):
        _, reward, terminated, _, _ = env.step([0.0, 1.0, -0.5, 0.0])
        assert (reward, terminated) == (1.0, False)
        assert np.isnan(env.position[0]).all()
    other = as_set_up(BilliardsEnv, table, game=NoHand)
    assert other.step([0.0, 1.0])[1:3] == (1.0, True)
    with pytest.raises(SettingError, match="the cue ball must be on the table"):
        other.reset(options={"position": [(np.nan, 0.0), (1.0, 0.2)]})


def test_what_is_seen_suits_the_space() -> None:
    class Wrong(Nearest):
        def observe(self, tables: Any) -> Any:
            return super().observe(tables)[:, :-1]

    for env in (BilliardsEnv(game=Wrong), BilliardsVectorEnv(2, game=Wrong)):
        with pytest.raises(SettingError, match=r"Wrong\.observe = shape .*: must have the shape"):
            env.reset(seed=0)


@pytest.mark.parametrize("score", [np.zeros(3), np.array([0.0, np.nan]), 1.0, "a", None])
def test_a_score_is_a_finite_number_a_table(score: Any) -> None:
    class Wrong(Nearest):
        def score(self, played: Played) -> Any:
            return score

    envs = BilliardsVectorEnv(2, game=Wrong)
    envs.reset(seed=0)
    with pytest.raises(SettingError, match=r"Wrong\.score = .*: must be a finite number for each"):
        envs.step(np.zeros((2, 5)))


def test_layouts_of_a_game_are_checked() -> None:
    class Wrong(Nearest):
        def layouts(self, rng: Generators) -> Any:
            return np.tile(self.spots[:1], (len(rng), 2, 1))

    with pytest.raises(SceneError, match="overlaps ball"):
        BilliardsVectorEnv(2, game=Wrong).reset(seed=0)


def test_a_game_judges_a_shot_by_the_tables_before_and_after_it() -> None:
    class Watched(Nearest):
        shots = 3

        def info(self, played: Played) -> Any:
            both = {"before": played.before, "after": played.tables}
            return {key: tables["points"].copy() for key, tables in both.items()}

    env, points = BilliardsEnv(game=Watched), 0.0
    env.reset(seed=0)
    for _ in range(2):
        _, reward, _, _, info = env.step([0.1, -0.5, 0.0, 0.0, 0.0])
        assert reward < 0.0
        assert (info["before"], info["after"]) == (points, points + reward)
        points += reward


def test_a_game_may_cut_episodes_off() -> None:
    class Cut(Nearest):
        def is_cut_off(self, played: Played) -> Any:
            return played.tables["shots"] >= 1

    env = BilliardsEnv(game=Cut)
    env.reset(seed=0)
    assert env.step([0.0] * 5)[2:4] == (False, True)
    with pytest.raises(ResetNeeded):
        env.step([0.0] * 5)


def test_every_table_may_have_a_layout_of_its_own() -> None:
    envs, drawn = PotVectorEnv(3), PotVectorEnv(3)
    drawn.reset(seed=1)
    seen, infos = envs.reset(options={"position": drawn.position, "called": ["1", "9", "2"]})
    assert (envs.position == drawn.position).all()
    assert [envs.scene.balls[k].id for k in infos["called"]] == ["1", "9", "2"]
    assert (seen[:, :8] == drawn.reset(options={"position": drawn.position})[0][:, :8]).all()
    bad = drawn.position
    bad[2, 1] = bad[2, 2]
    with pytest.raises(SceneError, match="overlaps ball"):
        envs.reset(options={"position": bad})
    with pytest.raises(SettingError, match=r"called = 2 balls: must be one, or one a table \(3\)"):
        envs.reset(options={"called": ["1", "2"]})


def test_generators_draw_one_row_a_table_as_each_alone() -> None:
    def alone() -> list[Any]:
        return [np.random.default_rng(k) for k in range(4)]

    rng, each = Generators(alone()), alone()
    assert (rng.random((2, 3)) == [one.random((2, 3)) for one in each]).all()
    assert (rng.normal(1.0, 2.0, size=2) == [one.normal(1.0, 2.0, size=2) for one in each]).all()
    some = pickle.loads(pickle.dumps(rng)).at(np.array([3, 1]))
    assert (some.random() == [each[3].random(), each[1].random()]).all()
    with pytest.raises(AttributeError):
        rng.rolls(3)


# -- layouts ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["report", "l-shaped", "nine-ball", "hexagon"])
def test_random_layouts_are_sound_and_differ(name: str) -> None:
    envs = CaromVectorEnv(50, name)
    envs.reset(seed=0)
    position = envs.position
    for layout in position:
        envs.scene.state((layout, np.zeros_like(layout), ()))  # This would find what overlaps.
        for ball, place in zip(envs.scene.balls, layout.tolist(), strict=True):
            for hole in envs.scene.pockets:
                assert math.dist(place, hole.position) >= hole.radius + ball.radius
    assert len({layout.tobytes() for layout in position}) == 50


def test_layouts_are_the_same_for_a_seed() -> None:
    """Their bits are those of numpy's generators, and of sums and products, everywhere."""
    envs = CaromVectorEnv(40)
    envs.reset(seed=0)
    assert sha256(envs.position.tobytes()).hexdigest() == LAYOUTS


def test_a_ball_lies_anywhere() -> None:
    envs = CaromVectorEnv(4_000)
    envs.reset(seed=0)
    x, y = envs.position[:, 0].T
    assert envs.scene.table is not None
    _, _, length, width = envs.scene.table.bounds
    for found, side in ((x, length), (y, width)):
        share = (found - 0.05715) / (side - 2 * 0.05715)
        counts = np.histogram(share, 10, (0.0, 1.0))[0]
        assert counts.sum() == 4_000
        assert np.abs(counts - 400).max() < 100


def test_the_scenarios_own_layout() -> None:
    env = as_set_up(CaromEnv, scene(TWO))
    assert env.position.tolist() == [list(place) for place in TWO.values()]
    assert env.reset(seed=1)[0].tolist() == env.reset(seed=2)[0].tolist()


def test_a_table_too_full_for_random_layouts_says_so() -> None:
    grid = [(0.031 + 0.0601 * i, 0.031 + 0.0601 * j) for i in range(32) for j in range(16)]
    balls = {f"b{k}" if k else "C": place for k, place in enumerate(grid)}
    env = CaromEnv(scene(balls))
    with pytest.raises(SettingError, match="no free places for all balls were found"):
        env.reset(seed=0)


# -- settings and options --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("plays", "settings", "message"),
    [
        (BilliardsEnv, {"game": Nearest(), "balls": 1}, "or a game without more settings"),
        (
            BilliardsVectorEnv,
            {"game": Nearest, "scenario": "report"},
            "scenario = report: Nearest needs friction of rolling",
        ),
    ],
)
def test_bad_settings_of_ones_own_game_are_refused_in_one_line(
    plays: Callable[..., Any], settings: dict[str, Any], message: str
) -> None:
    with pytest.raises((SettingError, SceneError)) as error:
        plays(**settings)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("make", [PotEnv, lambda: PotVectorEnv(2)])
@pytest.mark.parametrize("options", [{"called": "cue"}, {"position": [(0.5, 0.5)] * 4}])
def test_bad_options_change_nothing(make: Callable[[], Any], options: Any) -> None:
    env = make()
    env.reset(seed=0)
    before = env.position
    with pytest.raises((SettingError, SceneError)):
        env.reset(options=options)
    assert (env.position == before).all()


def test_any_scenario_is_a_table(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    scene(TWO).to_toml(path)
    for table in (str(path), path, load(path)):
        env = gym.make(IDS[0], scenario=table)
        env.reset(seed=0)
        assert len(env.unwrapped.position) == 3
    assert [ball.id for ball in CaromEnv("report", balls=3).scene.balls] == ["C", "1", "2", "3"]


# -- the vector environment ------------------------------------------------------------------------

CASES: dict[str, tuple[type[BilliardsEnv], Any, dict[str, Any]]] = {
    "carom": (CaromEnv, CaromVectorEnv, {}),
    "carom with errors": (CaromEnv, CaromVectorEnv, {"angle_error": 1.0, "speed_error": 0.2}),
    "carom among pockets": (CaromEnv, CaromVectorEnv, {"scenario": "nine-ball", "balls": 4}),
    "pot": (PotEnv, PotVectorEnv, {}),
    "pot with errors": (PotEnv, PotVectorEnv, {"balls": 6, "angle_error": 1.0}),
    "board of carrom": (CarromEnv, CarromVectorEnv, {"layout": "random", "angle_error": 1.0}),
    "own": (BilliardsEnv, BilliardsVectorEnv, {"game": Nearest, "speed_error": 0.1}),
}
MODES = (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)


def alike(one: Any, other: Any) -> bool:
    """Tell whether what two environments gave is the same, to the last bit."""
    if isinstance(one, np.ndarray) and one.dtype == object:
        return all(alike(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, tuple):
        return all(alike(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(alike(one[k], other[k]) for k in one)
    return bool(data_equivalence(one, other, exact=True))


def agree(case: str, mode: AutoresetMode, count: int, limit: int, steps: int) -> int:
    """Play single environments beside a native one; return how many episodes ended."""
    single, vector, settings = CASES[case]

    def one() -> Any:
        return gym.wrappers.TimeLimit(single(**settings), limit)

    beside = SyncVectorEnv([one] * count, autoreset_mode=mode)
    native = vector(count, autoreset_mode=mode, max_episode_steps=limit, **settings)
    assert native.observation_space == beside.observation_space
    assert native.action_space == beside.action_space
    assert alike(native.reset(seed=11), beside.reset(seed=11))
    assert native.np_random_seed == beside.np_random_seed
    rng, ended = np.random.default_rng(1), 0
    for _ in range(steps):
        shape = count, *native.single_action_space.shape
        actions = rng.uniform(-1.2, 1.2, shape).astype(np.float32)
        answer = native.step(actions)
        assert alike(answer, beside.step(actions))
        assert answer[0] in native.observation_space
        ended += int((answer[2] | answer[3]).sum())
    for mine, its in zip(native.np_random, beside.np_random, strict=True):
        assert mine.bit_generator.state == its.bit_generator.state
    return ended


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("case", CASES)
def test_single_and_vector_agree_bit_for_bit(case: str, mode: AutoresetMode) -> None:
    assert agree(case, mode, count=7, limit=3, steps=8) > 10


def test_a_reset_mask_begins_some_tables_anew() -> None:
    settings = {"autoreset_mode": AutoresetMode.DISABLED}
    native = PotVectorEnv(4, **settings)
    beside = SyncVectorEnv([PotEnv] * 4, **settings)
    assert alike(native.reset(seed=2), beside.reset(seed=2))
    actions = np.random.default_rng(0).uniform(-1, 1, (4, 2))
    assert alike(native.step(actions), beside.step(actions))
    with pytest.raises(ResetNeeded, match="The episode of table 0 is over"):
        native.step(actions)
    mask = np.array([True, False, True, False])
    options = {"reset_mask": mask, "called": "9"}
    assert alike(native.reset(options=options), beside.reset(options=dict(options)))
    assert "reset_mask" in options
    with pytest.raises(ResetNeeded, match="The episode of table 1 is over"):
        native.step(actions)
    for bad in ([True], np.zeros(4, bool), np.ones(4), np.ones(3, bool)):
        with pytest.raises(SettingError, match="reset_mask"):
            native.reset(options={"reset_mask": bad})
    with pytest.raises(ResetNeeded):
        PotVectorEnv(4).reset(options={"reset_mask": mask})


def test_seeds_of_tables() -> None:
    envs = CaromVectorEnv(3)
    first = envs.reset(seed=5)[0]
    assert envs.np_random_seed == (5, 6, 7)
    assert (envs.reset(seed=[5, None, 7])[0][[0, 2]] == first[[0, 2]]).all()
    assert (envs.reset(seed=np.int64(5))[0] == first).all()
    assert (envs.reset()[0] != first).any()
    with pytest.raises(SettingError, match="seed = 2 seeds: must be one, or one a table"):
        envs.reset(seed=[1, 2])
    drawn = CaromVectorEnv(3)
    seen, _ = drawn.reset()
    again = CaromVectorEnv(3)
    assert (again.reset(seed=list(drawn.np_random_seed))[0] == seen).all()


@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_step_is_one_call_and_its_arrays_are_not_used_again(
    mode: AutoresetMode, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[int] = []
    play = simulate_many

    def counted(*arguments: Any) -> Any:
        calls.append(len(arguments[1]))
        return play(*arguments)

    monkeypatch.setattr(game, "simulate_many", counted)
    envs = CaromVectorEnv(6, autoreset_mode=mode)
    envs.reset(seed=0)
    first = envs.step(np.zeros((6, 2)))
    kept = copy.deepcopy(first)
    done = first[2]
    assert calls == [6]
    if mode is not AutoresetMode.DISABLED:
        envs.step(np.where(done[:, np.newaxis], 0.0, 0.5) * np.ones(2))
        waiting = int(done.sum()) if mode is AutoresetMode.NEXT_STEP else 0
        assert calls == [6, *([6 - waiting] if waiting < 6 else [])]
    assert alike(first, kept)


def test_actions_of_tables_that_begin_anew_do_not_matter() -> None:
    envs = PotVectorEnv(2, autoreset_mode=AutoresetMode.NEXT_STEP)
    envs.reset(seed=0)
    assert envs.step(np.zeros((2, 2)))[2].all()
    _, reward, terminated, truncated, infos = envs.step(np.full((2, 2), np.nan))
    assert not (reward.any() or terminated.any() or truncated.any())
    assert set(infos) == {"called", "_called"}
    with pytest.raises(SettingError, match="must be two numbers"):
        envs.step(np.full((2, 2), np.nan))
    with pytest.raises(SettingError, match=r"must have the shape \(2, 2\)"):
        envs.step([0.0, 0.0])


@pytest.mark.parametrize("mode", MODES)
def test_wrappers_of_vector_environments(mode: AutoresetMode) -> None:
    if mode is AutoresetMode.SAME_STEP and tuple(map(int, gym.__version__.split(".")[:2])) < (1, 4):
        pytest.skip("Gymnasium before 1.4 counts the steps of SAME_STEP wrongly")
    envs = gym.wrappers.vector.RecordEpisodeStatistics(
        gym.make_vec(IDS[0], num_envs=40, autoreset_mode=mode)
    )
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(10):
        _, _, terminated, _, infos = envs.step(envs.action_space.sample())
        if mode is AutoresetMode.SAME_STEP:
            info = infos["final_info"]["points"][terminated]
        else:
            info = infos["points"][terminated]
        assert (infos["episode"]["r"][terminated] == info).all()
    assert max(envs.return_queue) >= 1.0


# -- pictures --------------------------------------------------------------------------------------


def test_pictures_show_the_layout_and_how_a_shot_ends() -> None:
    pytest.importorskip("matplotlib")
    env = CaromEnv(render_mode="rgb_array")
    env.reset(seed=3)
    before = env.render()
    assert before.shape == (450, 800, 3) and before.dtype == np.uint8
    env.step([0.1, 0.6])
    after = env.render()
    assert after.shape == before.shape
    assert (after != before).mean() > 0.01
    assert (env.render() == after).all()
    env.reset(seed=3)
    assert (env.render() == before).all()
    films = CaromEnv(render_mode="rgb_array_list")
    films.reset(seed=3)
    assert [frame.shape for frame in films.render()] == [(450, 800, 3)]
    info = films.step([0.1, 0.6])[-1]
    frames = films.render()
    assert len(frames) == pytest.approx(30 * info["duration"], abs=2)
    assert np.abs(frames[-1].astype(int) - after).mean() < 1.0


def test_a_film_of_shots_has_frames_of_one_size() -> None:
    """A ball in a pocket lies in the tray below the table."""
    env = as_set_up(PotEnv, scene(STRAIGHT, (2.0, 0.5)), render_mode="rgb_array_list")
    still = env.render()[0]
    info = env.step(to_the_right(0.3))[-1]
    assert info["pocketed"] == 1
    assert {frame.shape for frame in env.render()} == {still.shape}


def test_vector_environments_render_as_single_ones_do() -> None:
    for mode in MODES:
        native = PotVectorEnv(2, render_mode="rgb_array", autoreset_mode=mode)
        beside = SyncVectorEnv([lambda: PotEnv(render_mode="rgb_array")] * 2, autoreset_mode=mode)
        for envs in (native, beside):
            envs.reset(seed=1)
        assert alike(native.render(), beside.render())
        actions = np.array([[0.3, 0.0], [-0.5, 0.2]])
        for _ in range(2):
            native.step(actions), beside.step(actions)
            assert alike(native.render(), beside.render())


def test_without_a_mode_nothing_is_drawn_and_it_says_so() -> None:
    for env in (CaromEnv(), CaromVectorEnv(1)):
        env.reset(seed=0)
        with pytest.warns(UserWarning, match="Nothing is drawn"):
            assert env.render() is None


# -- learning --------------------------------------------------------------------------------------


@takes_long
@pytest.mark.slow
def test_a_planner_learns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The cross-entropy planner beats random play, and more rounds beat fewer."""
    path = ROOT / "examples" / "learn_caroms.py"
    assert len(path.read_text(encoding="utf-8").splitlines()) < 80
    example = runpy.run_path(str(path))
    shares = example["main"](["--out", str(tmp_path)])
    assert shares[0] < 0.3
    assert shares[1] > 2.5 * shares[0]
    assert shares[8] > shares[1] + 0.03
    assert (tmp_path / "learn_caroms.png").read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.splitlines()) == len(shares)
