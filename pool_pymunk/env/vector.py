"""This module has the environments with many tables, which play all shots in one call."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from pathlib import Path
from typing import Any, ClassVar, SupportsIndex

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from pool_pymunk.env.frames import FPS, MODES, read_mode
from pool_pymunk.env.games import Carom, Game, Info, Pot, read_actions, read_options
from pool_pymunk.env.single import Playing
from pool_pymunk.fast import Batch
from pool_pymunk.model import Scene
from pool_pymunk.model.plain import argument, whole
from pool_pymunk.model.problems import setting_error, shown

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Observations = NDArray[np.float32]
Rows = NDArray[np.int64]
Infos = dict[str, Any]
Step = tuple[Observations, Floats, Flags, Flags, Infos]


class BilliardsVectorEnv(Playing, VectorEnv[Observations, Observations, Any]):
    """A billiards vector environment plays a game on many tables: a step is a shot on each.

    All shots of a step are one call of ``simulate_many``. Table i gives the same bits as a
    :class:`BilliardsEnv` of its own with the seed of table i, and all comes as from Gymnasium's
    SyncVectorEnv, ``info`` included.

    ``autoreset_mode`` says when a table begins anew whose episode is over: under ``NEXT_STEP`` in
    the next step, instead of a shot; under ``SAME_STEP`` at once, and the end of the episode is
    in ``info["final_obs"]`` and ``info["final_info"]``; if ``DISABLED``, by
    ``reset(options={"reset_mask": ...})``. Under ``NEXT_STEP`` episodes of one shot waste every
    second step. ``max_episode_steps`` cuts episodes off. Other settings are as in
    :class:`BilliardsEnv`.
    """

    plays: ClassVar[type[Game]]

    def __init__(
        self,
        num_envs: int = 1,
        scenario: str | Path | Scene | None = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self.num_envs = argument("num_envs", num_envs, whole(1))
        self.game = self.plays(scenario, **settings)
        self.mode = _read_autoreset(autoreset_mode)
        limit = max_episode_steps
        self.most = np.inf if limit is None else argument("max_episode_steps", limit, whole(1))
        self.render_mode = read_mode(render_mode)
        drawn = {"render_modes": list(MODES), "render_fps": FPS}
        self.metadata = drawn | {"autoreset_mode": self.mode}
        self.single_observation_space = Box(*self.game.bounds, dtype=np.float32)
        self.single_action_space = Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._hands, self._seeds = list[np.random.Generator](), list[int]()
        self._batch: Batch | None = None
        self._played = np.full(self.num_envs, -1)  # the row of a table's last shot in the batch
        self._steps = np.zeros(self.num_envs, np.int64)
        self._done = np.zeros(self.num_envs, np.bool_)

    @property
    def position(self) -> Floats:
        """Where the balls are (S, N, 2), in m; NaN for those off the table."""
        return np.array(self._now.position)

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """The generators of random numbers, one a table."""
        self._draw_hands([None] * self.num_envs, range(self.num_envs))
        return tuple(self._hands)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seeds of the generators, one a table."""
        self._draw_hands([None] * self.num_envs, range(self.num_envs))
        return tuple(self._seeds)

    # -- beginning ---------------------------------------------------------------------------------

    def reset(
        self,
        *,
        seed: SupportsIndex | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, Infos]:
        """Begin a new episode on every table: return the observation and the info.

        Table i has the seed ``seed + i``, or the one in a list. ``options`` are those of one table,
        for all of them; ``reset_mask`` (S,) says which tables begin anew.
        """
        asked = read_options(options)
        rows, infos = self._read_mask(asked.pop("reset_mask", None)), Infos()
        self._draw_hands(_read_seeds(seed, self.num_envs), rows.tolist())
        self._set_up(rows, infos, asked)
        return self.game.observe(self._now), infos

    def _read_mask(self, mask: Any) -> Rows:
        """Return which tables begin anew."""
        if mask is None:
            return np.arange(self.num_envs)
        found, shape = np.asarray(mask), self._now.called.shape
        if found.dtype != np.bool_ or found.shape != shape or not found.any():
            message = f"must be {shape[0]} flags in an array, one of them True"
            raise setting_error("reset_mask", shown(mask), message)
        return np.flatnonzero(found)

    def _draw_hands(self, seeds: Sequence[int | None], rows: Sequence[int]) -> None:
        """Make new generators where a seed is given or none is there yet."""
        if not self._hands:
            drawn = [np_random(seed) for seed in seeds]
            self._hands, self._seeds = (list(each) for each in zip(*drawn, strict=True))
            return
        for row in [row for row in rows if seeds[row] is not None]:
            self._hands[row], self._seeds[row] = np_random(seeds[row])

    def _set_up(self, rows: Rows, infos: Infos, options: dict[str, Any] | None = None) -> None:
        """Lay out some tables anew."""
        tables = self.game.start([self._hands[row] for row in rows], options)
        if self._tables is None:
            self._tables = tables
        else:
            self._tables.put(rows, tables)
        self._steps[rows], self._done[rows], self._played[rows] = 0, False, -1
        _tell(infos, rows, self.game.info_at_start(tables), self.num_envs)

    # -- a shot on each table ----------------------------------------------------------------------

    def step(self, actions: Any) -> Step:
        """Play a shot on each table: return what is seen, rewards, who is done, and more.

        A table whose episode is over begins anew: under NEXT_STEP instead of its next shot, and
        under SAME_STEP at once. Raises SettingError for what are no actions, and ResetNeeded where
        no episode goes on.
        """
        tables, wanted = self._now, read_actions(actions, (self.num_envs, 2))
        ended = self._done
        if self.mode is AutoresetMode.DISABLED and ended.any():
            where = int(ended.argmax())
            raise ResetNeeded(f"The episode of table {where} is over: reset it by reset_mask.")
        rows = np.flatnonzero(~ended)
        reward, terminated = np.zeros(self.num_envs), np.zeros(self.num_envs, np.bool_)
        info: Info = {}
        if len(rows):
            hands = [self._hands[row] for row in rows]
            shots = self.game.play(tables.at(rows), wanted[rows], hands)
            tables.put(rows, shots.tables)
            reward[rows], terminated[rows], info = shots.reward, shots.terminated, shots.info
            self._batch, self._played[rows] = shots.batch, np.arange(len(rows))
        self._steps[rows] += 1
        truncated = (self._steps >= self.most) & ~ended
        self._done = terminated | truncated
        seen, infos = self._go_on(rows, np.flatnonzero(ended), info)
        return seen, reward, terminated, truncated, infos

    def _go_on(self, rows: Rows, ended: Rows, info: Info) -> tuple[Observations, Infos]:
        """Begin new episodes where it is time to, and return what is seen and the info."""
        infos, done = Infos(), self._done.copy()
        if self.mode is AutoresetMode.SAME_STEP:
            rows, ended = rows[~done], np.flatnonzero(done)
            if len(ended):
                infos |= self._final(ended, {key: values[done] for key, values in info.items()})
            info = {key: values[~done] for key, values in info.items()}
        _tell(infos, rows, info, len(done))
        if len(ended):
            self._set_up(ended, infos)
        return self.game.observe(self._now), infos

    def _final(self, ended: Rows, said: Info) -> Infos:
        """Return what is seen and the info at the end of some episodes, as Gymnasium has it."""
        info: Infos = {}
        _tell(info, ended, said, self.num_envs)
        seen, mask = np.full(self.num_envs, None, dtype=object), np.zeros(self.num_envs, np.bool_)
        seen[ended] = np.fromiter(self.game.observe(self._now.at(ended)), object, len(ended))
        mask[ended] = True
        both = {"final_obs": seen, "final_info": info}
        return both | {f"_{key}": mask.copy() for key in both}

    def rehearse(self, actions: Any) -> Floats:
        """Return the rewards (K, S) that K shots a table (K, S, 2) would get; nothing changes.

        For one shot a table take ``actions[None]``. A rehearsed shot is played as it is meant,
        without errors of the hand.
        """
        return self.game.rehearse(self._now, actions)

    def render(self) -> Any:
        """Return for each table the picture of its last shot's end, or all frames in a list."""
        if self.render_mode is None:
            return self._drawn(0, None, 0)
        rows = enumerate(self._played.tolist())
        return tuple(self._drawn(k, self._batch, row) for k, row in rows)


class CaromVectorEnv(BilliardsVectorEnv):
    """Carom on many tables, with the rules and settings of :class:`CaromEnv`.

    >>> from pool_pymunk.env import CaromEnv
    >>> envs = CaromVectorEnv(3, autoreset_mode="SameStep")
    >>> observations, infos = envs.reset(seed=5)
    >>> observations.shape, bool((observations[1] == CaromEnv().reset(seed=6)[0]).all())
    ((3, 33), True)
    """

    plays = Carom


class PotVectorEnv(BilliardsVectorEnv):
    """Pot on many tables, with the rules and settings of :class:`PotEnv`."""

    plays = Pot


def _tell(infos: Infos, rows: Rows, info: Info, count: int) -> None:
    """Write down the info of some tables, and of which, as Gymnasium has it."""
    if not len(rows):
        return
    for key, values in info.items():
        mine = infos.setdefault(key, np.zeros(count, values.dtype))
        mask = infos.setdefault(f"_{key}", np.zeros(count, np.bool_))
        mine[rows], mask[rows] = values, True


def _read_autoreset(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        known = ", ".join(each.value for each in AutoresetMode)
        raise setting_error("autoreset_mode", str(mode), f"must be one of {known}") from None


def _read_seeds(seed: Any, count: int) -> list[int | None]:
    """Return a seed for each table: seed, seed + 1, ..., or those of a list."""
    if seed is None or isinstance(seed, Integral):
        return [None if seed is None else int(seed) + i for i in range(count)]
    seeds = [None if each is None else int(each) for each in seed]
    if len(seeds) != count:
        raise setting_error("seed", f"{len(seeds)} seeds", f"must be one, or one a table ({count})")
    return seeds
