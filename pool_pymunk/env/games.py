"""This module has the games that come with the package, and their environments."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from pool_pymunk.env.environments import BilliardsEnv, BilliardsVectorEnv
from pool_pymunk.env.game import Flags, Game, Info, On, Played, Tables
from pool_pymunk.env.layouts import Floats, Generators
from pool_pymunk.model.plain import is_row
from pool_pymunk.model.problems import listed, setting_error
from pool_pymunk.results.words import counted

# The men of a colour have ids that begin with its letter, as in the scenario carrom.
OWN, OTHERS = "W", "B"
# The centres of the base circles are 74 cm / 2 - 15.09 cm from the middle (scenario carrom).
LINE = 0.2191 / 0.37  # of half the board's length
GAP = 1e-4  # m; that of the rack in the scenario carrom


class Carom(Game):
    """These are the rules of Carom, a game of billiards."""

    scenario, max_speed, least = "report-corrected", 5.0, 2

    def score(self, played: Played) -> Flags:
        return np.asarray((played.met >= 2) & ~played.foul)

    def is_over(self, played: Played) -> Flags:
        too_few = (~played.tables.off).sum(axis=1) - 1 < self.least
        return np.asarray((played.reward == 0.0) | too_few)

    def info(self, played: Played) -> Info:
        return {"points": played.tables["points"].astype(np.int64)}

    def caption(self, tables: Tables, k: int) -> str:
        return counted(int(tables["points"][k]), "point")


class Pot(Game):
    """These are the rules of Pot."""

    balls, needs_pockets, options, marked = 3, True, ("called",), ("called",)

    def begin(self, tables: Tables, rng: Generators, options: Mapping[str, Any]) -> None:
        there = ~tables.off
        there[:, self.cue] = False
        if (called := options.get("called")) is not None:
            tables["called"] = self._read_called(called, there)
        else:
            before = np.array(there.T, np.int64, order="C").cumsum(axis=0)
            place = (rng.random() * before[-1]).astype(np.int64)
            tables["called"] = (before <= place).sum(axis=0)

    def _read_called(self, called: Any, there: Flags) -> NDArray[np.int64]:
        """Return the balls' numbers (S,), from one id for all tables or from one a table."""
        asked = list(called) if is_row(called) else [called]
        known = [ball.id for ball in self.scene.balls if not ball.cue]
        for unknown in [each for each in asked if each not in known]:
            message = f"there is no such ball to pot (there are: {listed(known)})"
            raise setting_error("called", unknown, message)
        if len(asked) not in (1, len(there)):
            message = f"must be one, or one a table ({len(there)})"
            raise setting_error("called", f"{len(asked)} balls", message)
        found = np.resize([self.scene.index[each] for each in asked], len(there))
        for k in np.flatnonzero(~there[np.arange(len(there)), found])[:1]:
            raise setting_error("called", asked[k % len(asked)], "the ball is off the table")
        return found

    def score(self, played: Played) -> Flags:
        rows, called = np.arange(len(played.foul)), played.tables["called"]
        return np.asarray((played.batch.pocketed[rows, called] >= 0) & ~played.foul)

    def info(self, played: Played) -> Info:
        scored = {"is_success": played.reward > 0.0}
        scored["pocketed"] = (played.batch.pocketed >= 0).sum(axis=1)
        return self.info_at_start(played.tables) | scored

    def info_at_start(self, tables: Tables) -> Info:
        return {"called": tables["called"].copy()}

    def caption(self, tables: Tables, k: int) -> str:
        return f"ball {self.scene.balls[tables['called'][k]].id} is called"


class Carrom(Game):
    """These are the rules of Carrom, the board game, for one player."""

    scenario, layout, max_speed = "carrom", "scenario", 3.5
    has_place, needs_pockets, shots = True, True, 30

    def __init__(self, scenario: On = None, **settings: Any) -> None:
        super().__init__(scenario, **settings)
        first = np.array([ball.id[:1] for ball in self.scene.balls])
        first[self.cue] = ""
        self.worth = (first == OWN) - 1.0 * (first == OTHERS)
        if not (self.worth > 0.0).any():
            message = f"must have a man of one's own, whose id begins with {OWN}"
            raise setting_error("scenario", listed([ball.id for ball in self.scene.balls]), message)
        radius = np.array([ball.radius for ball in self.scene.balls])
        self._apart = radius + radius[self.cue] + GAP

    @cached_property
    def action_space(self) -> Box:
        return Box(-1.0, 1.0, (3,), np.float32)

    def begin(self, tables: Tables, rng: Generators, options: Mapping[str, Any]) -> None:
        tables.position[:, self.cue] = np.nan  # The striker is in hand.
        if self.is_cleared(tables).any():
            raise setting_error("position", "0 men", "a man of one's own must be on the board")

    def aim(self, actions: Floats) -> dict[str, Floats]:
        turn, power, along = actions.T
        place = np.tile(self.spots[self.cue], (len(actions), 1))
        place[:, 0] = self.middle[0] + LINE * self.half_size[0] * along
        angle, speed = 90.0 + 90.0 * turn, self.max_speed * (1.0 + power) / 2.0
        return {"angle": angle, "speed": speed, "place": place}

    def put(self, tables: Tables, place: Floats) -> Floats:
        """Return the nearest free places on the base line; where there are none, the given ones."""
        men = tables.position
        wide = np.sqrt(np.fmax(self._apart**2 - (men[..., 1] - place[:, 1:]) ** 2, 0.0))
        left, right = men[..., 0] - wide, men[..., 0] + wide
        put, end = place.copy(), LINE * self.half_size[0]
        for k in np.flatnonzero(((left < place[:, :1]) & (place[:, :1] < right)).any(axis=1)):
            tried = np.hstack([left[k], right[k]])
            # A place beside a man is rounded, so half of the gap is enough.
            taken = (left[k] + GAP / 2.0 < tried[:, None]) & (tried[:, None] < right[k] - GAP / 2.0)
            tried = tried[(abs(tried - self.middle[0]) <= end) & ~taken.any(axis=1)]
            if len(tried):
                put[k, 0] = tried[abs(tried - place[k, 0]).argmin()]
        return put

    def score(self, played: Played) -> Floats:
        played.tables.position[:, self.cue] = np.nan  # It comes back to the base line.
        pocketed = played.tables.off & ~played.before.off
        return np.asarray(pocketed @ self.worth - played.foul)

    def is_cleared(self, tables: Tables) -> Flags:
        """Tell from which boards (S,) all men of one's own are gone."""
        return np.asarray(tables.off[:, self.worth > 0.0].all(axis=1))

    def is_over(self, played: Played) -> Flags:
        return self.is_cleared(played.tables)

    def is_cut_off(self, played: Played) -> Flags:
        return np.asarray(played.tables["shots"] >= self.shots)

    def info(self, played: Played) -> Info:
        pocketed = played.tables.off & ~played.before.off
        counts = {"own": self.worth > 0.0, "others": self.worth < 0.0}
        said = {key: pocketed[:, men].sum(axis=1) for key, men in counts.items()}
        return said | self.info_at_start(played.tables)

    def info_at_start(self, tables: Tables) -> Info:
        return {"left": (~tables.off[:, self.worth > 0.0]).sum(axis=1)}

    def caption(self, tables: Tables, k: int) -> str:
        left = int(self.info_at_start(tables)["left"][k])
        return f"{tables['points'][k]:g} points, {left} of one's own men left"


class CaromEnv(BilliardsEnv):
    """In Carom the cue ball must meet two others for a point, and may play until it does not.

    The table is that of ``report-corrected``, with eleven balls; ``max_speed`` is 5 m/s. A shot in
    which the cue ball meets two others or more scores 1. A shot in which it does not, or in which
    it is pocketed, scores 0 and ends the episode. Fewer than two other balls end it, too.
    ``gym.make`` cuts a series off after 100 shots; ``info["points"]`` counts the series.

    >>> env = CaromEnv()
    >>> observation, info = env.reset(seed=3)
    >>> observation, reward, terminated, truncated, info = env.step([0.1, 0.6])
    >>> reward, terminated, info["met"], info["points"]
    (1.0, False, 2, 1)
    """

    plays = Carom


class CaromVectorEnv(BilliardsVectorEnv):
    """Carom on many tables has the rules and settings of :class:`CaromEnv`."""

    plays = Carom


class PotEnv(BilliardsEnv):
    """In Pot an episode is one shot, which must put the called ball into a pocket.

    The table is that of ``eight-ball``, with the cue ball and three others; ``max_speed`` is 3 m/s.
    The shot scores 1 if the called ball goes into any pocket and the cue ball into none, else 0.
    ``info`` also has the number of the ``called`` ball (also after ``reset``), how many balls were
    ``pocketed``, and ``is_success``. The called ball is random, unless
    ``reset(options={"called": "2"})`` has its id, or a list with one a table.

    >>> env = PotEnv()
    >>> observation, info = env.reset(seed=1, options={"called": "2"})
    >>> env.scene.balls[info["called"]].id
    '2'
    """

    plays = Pot


class PotVectorEnv(BilliardsVectorEnv):
    """Pot on many tables has the rules and settings of :class:`PotEnv`."""

    plays = Pot


class CarromEnv(BilliardsEnv):
    """In Carrom one player pockets the white men of a board, shot by shot, from a base line.

    This is the board game of the scenario ``carrom``; :class:`CaromEnv` is a game of billiards. An
    action is an angle, a speed and a place: the striker begins on the base line, whose ends are at
    a[2] = -1 and 1, and leaves forwards at 90 + 90 a[0] degrees, with at most 3.5 m/s. If a man
    lies there, the striker begins at the nearest free place, the ``place`` of ``info``; if there
    is none, the shot is lost, scores 0 and ends the episode.

    Each white man in a pocket scores 1, each black one -1, the striker -1. The episode is over when
    all white men are pocketed, and truncated after 30 shots. ``layout="random"`` puts men anywhere.
    Between shots the striker is in hand, and observed as off the board. ``info`` also has how many
    men of one's ``own`` and of the ``others`` were pocketed, and how many own ones are ``left``.

    >>> env = CarromEnv(layout="random")
    >>> observation, info = env.reset(seed=0)
    >>> info["left"], observation.shape, env.action_space.shape
    (9, (60,), (3,))
    """

    plays = Carrom


class CarromVectorEnv(BilliardsVectorEnv):
    """Carrom on many boards has the rules and settings of :class:`CarromEnv`."""

    plays = Carrom
