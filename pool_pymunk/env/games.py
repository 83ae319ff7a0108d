"""This module has the games that come with the package, and their environments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.env.environments import BilliardsEnv, BilliardsVectorEnv
from pool_pymunk.env.game import Flags, Game, Info, Played, Tables
from pool_pymunk.env.layouts import Generators
from pool_pymunk.model.plain import is_row
from pool_pymunk.model.problems import listed, setting_error
from pool_pymunk.results.words import counted


class Carom(Game):
    """These are the rules of Carom."""

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
        """Return the numbers of the balls (S,) of an id, or of one a table."""
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


class CaromEnv(BilliardsEnv):
    """In Carom the cue ball must meet two others for a point, and goes on as long as it does.

    The table is the report's, with eleven balls, and the law and coefficients that the report meant
    (``report-corrected``); ``max_speed`` is 5 m/s. A shot in which the cue ball meets two others or
    more scores 1 and the episode goes on from where the balls lie; any other shot, and one that
    pockets the cue ball, scores 0 and ends it, and so does a table with fewer than two other balls.
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
    """In Pot one shot must put the called ball into a pocket, and the episode is over.

    The table is that of ``eight-ball``, with the cue ball and three others; ``max_speed`` is 3 m/s.
    The shot scores 1 if the called ball goes into any pocket and the cue ball into none, otherwise
    0. ``info`` also has the number of the ``called`` ball, which ``reset`` tells, too, how many
    balls were ``pocketed``, and ``is_success``. The called ball is drawn, unless
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
