"""This module has two environments: of many tables, which play in one call, and of one table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from numbers import Integral
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from pool_pymunk.env.game import Flags, Game, Info, On, Rehearsal, Tables, read_options
from pool_pymunk.env.layouts import Floats, Generators
from pool_pymunk.many import Batch, simulate_many
from pool_pymunk.many.workers import Workers
from pool_pymunk.model import Shot
from pool_pymunk.model.plain import argument, choice, whole
from pool_pymunk.model.problems import setting_error, shown

Seen = NDArray[np.float32]
Rows = NDArray[np.int64] | slice
Infos = dict[str, Any]
Asked = type[Game] | Game | None
ALL = slice(None)  # With it, arrays of all tables are not copied.
MODES, FPS, SIZE = ("rgb_array", "rgb_array_list"), 30, (800, 450)  # frames a second; pixels
DRAWN = {"render_modes": list(MODES), "render_fps": FPS}


class BilliardsVectorEnv(VectorEnv[Seen, Seen, Any]):
    """A billiards vector environment plays a game on many tables: a step is a shot on each.

    All shots of a step are one call of ``simulate_many``. Table i gives the same bits as a
    :class:`BilliardsEnv` with the seed of table i, in the form of Gymnasium's SyncVectorEnv. A
    table whose episode is over begins again as ``autoreset_mode`` says: by ``NEXT_STEP`` in place
    of the next shot; by ``SAME_STEP`` at once, and ``info`` has the end as ``final_obs`` and
    ``final_info``; by ``DISABLED`` in ``reset(options={"reset_mask": ...})``. ``max_episode_steps``
    cuts episodes off. ``workers`` share the shots of a step, as in ``simulate_many``, until
    ``close``. Other settings are as in :class:`BilliardsEnv`.
    """

    plays: ClassVar[type[Game] | None] = None  # the game, if no other is asked for

    def __init__(
        self, num_envs: int = 1, scenario: On = None, *, game: Asked = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None, render_mode: str | None = None,
        workers: int | Executor | None = None, **settings: Any,
    ) -> None:  # fmt: skip
        self.num_envs = argument("num_envs", num_envs, whole(1))
        self.game = _game_of(game or self.plays, scenario, settings)
        self.scene = self.game.scene
        if workers is not None:
            self.game.workers = Workers(workers)
        known = [mode.value for mode in AutoresetMode]
        mode = getattr(autoreset_mode, "value", autoreset_mode)
        self.mode = AutoresetMode(argument("autoreset_mode", mode, choice(known)))
        limit = max_episode_steps
        self.most = np.inf if limit is None else argument("max_episode_steps", limit, whole(1))
        if render_mode is not None:
            argument("render_mode", render_mode, choice(MODES))
        self.render_mode, self.metadata = render_mode, DRAWN | {"autoreset_mode": self.mode}
        self.single_observation_space = self.game.observation_space
        self.single_action_space = self.game.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._rng, self._seeds = Generators([]), list[int]()
        self._tables: Tables | None = None
        self._batch: Batch | None = None
        self._played = np.full(self.num_envs, -1)  # the row of a table's last shot in the batch
        self._steps, self._done = np.zeros(self.num_envs, np.int64), np.zeros(self.num_envs, bool)

    @property
    def position(self) -> Floats:
        """Where the balls are (S, N, 2), in m; NaN for those off the table."""
        return np.array(self._now.position)

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """The generators of random numbers, one a table."""
        self._seed(None, [])
        return tuple(self._rng.each)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seeds of the generators, one a table."""
        self._seed(None, [])
        return tuple(self._seeds)

    @property
    def _now(self) -> Tables:
        if self._tables is None:
            raise ResetNeeded("There are no layouts yet: call reset() first.")
        return self._tables

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[Seen, Infos]:
        """Begin a new episode on every table: return the observation and the info.

        Table i has the seed ``seed + i``, or the one in a list. ``options`` are those of one table,
        and hold for all, or have a row for each; ``reset_mask`` (S,) has the tables to begin anew.
        """
        asked, infos = read_options(options), Infos()
        rows: Rows = ALL
        if (mask := asked.pop("reset_mask", None)) is not None:
            flags, shape = np.asarray(mask), self._now["shots"].shape
            if flags.dtype != np.bool_ or flags.shape != shape or not flags.any():
                message = f"must be {self.num_envs} flags in an array, one of them True"
                raise setting_error("reset_mask", shown(mask), message)
            rows = _rows(flags)
        self._seed(seed, np.arange(self.num_envs)[rows].tolist())
        self._begin(rows, infos, asked)
        return self.game.observe(self._now), infos

    def _seed(self, seed: Any, rows: Sequence[int]) -> None:
        """Make new generators where a seed is given, and all of them if there are none yet."""
        if seed is None or isinstance(seed, Integral):  # Table i has the seed + i.
            seed = [None if seed is None else int(seed) + i for i in range(self.num_envs)]
        seeds = [None if each is None else int(each) for each in seed]
        if (count := len(seeds)) != self.num_envs:
            message = f"must be one, or one a table ({self.num_envs})"
            raise setting_error("seed", f"{count} seeds", message)
        each, new = [*self._rng.each], [row for row in rows if seeds[row] is not None]
        if not each:
            each, self._seeds, new = [None] * count, [-1] * count, [*range(count)]
        for row in new:
            each[row], self._seeds[row] = np_random(seeds[row])
        self._rng = Generators(each) if new else self._rng

    def _begin(self, rows: Rows, infos: Infos, options: dict[str, Any] | None = None) -> Seen:
        """Begin new episodes on some tables, write down their info, and return what is seen."""
        tables = self.game.start(self._rng.at(rows), options)
        self._tables = tables if rows is ALL else self._now.put(rows, tables)
        self._steps[rows], self._done[rows], self._played[rows] = 0, False, -1
        _tell(infos, rows, self.game.info_at_start(tables), self.num_envs)
        seen, shape = self.game.observe(tables), self.game.observation_space.shape
        if np.shape(seen) != (shape := (len(tables.off), *shape)):
            found = f"shape {np.shape(seen)}"
            raise setting_error(f"{self.game.name}.observe", found, f"must have the shape {shape}")
        return seen

    def step(self, actions: Any) -> tuple[Seen, Floats, Flags, Flags, Infos]:
        """Play a shot on each table: return what is seen, rewards, which episodes end, and info.

        Raises SettingError for bad actions, and ResetNeeded without an episode to be continued.
        """
        tables, over, infos = self._now, self._done, Infos()
        wanted = self.game.read(actions, self.num_envs)
        if self.mode is AutoresetMode.DISABLED and over.any():
            where = int(over.argmax())
            raise ResetNeeded(f"The episode of table {where} is over: reset it by reset_mask.")
        reward, (terminated, truncated) = np.zeros(len(over)), np.zeros((2, len(over)), np.bool_)
        rows, info = _rows(~over), Info()
        if not over.all():
            shots = self.game.play(tables.at(rows), wanted[rows], self._rng.at(rows))
            self._tables = shots.tables if rows is ALL else tables.put(rows, shots.tables)
            self._batch, self._played[rows] = shots.batch, np.arange(len(shots.batch))
            self._steps[rows] += 1
            reward[rows], terminated[rows], info = shots.reward, shots.terminated, shots.info
            truncated[rows] = shots.truncated | (self._steps[rows] >= self.most)
        self._done = terminated | truncated
        seen = self.game.observe(self._now)
        if self.mode is AutoresetMode.SAME_STEP:
            over = self._done.copy()
            infos = self._final(over, seen, info) if over.any() else infos
            rows, info = _rows(~over), {key: each[~over] for key, each in info.items()}
        _tell(infos, rows, info, self.num_envs)
        if over.any():
            seen[_rows(over)] = self._begin(_rows(over), infos)
        return seen, reward, terminated, truncated, infos

    def _final(self, over: Flags, seen: Seen, said: Info) -> Infos:
        """Return what is seen and the info at the end of some episodes, in Gymnasium's form."""
        info, rows = Infos(), _rows(over)
        _tell(info, rows, {key: each[rows] for key, each in said.items()}, len(over))
        last = np.full(len(over), None, dtype=object)
        last[rows] = np.fromiter(seen[over], object)
        flags = {"_final_obs": over.copy(), "_final_info": over.copy()}
        return flags | {"final_obs": last, "final_info": info}

    def rehearse(self, actions: Any, tables: Any = None) -> Rehearsal:
        """Return the batch of shots from the present layouts, with ``reward``; nothing changes.

        ``actions`` (K, S, A) are K shots a table; shot k of table i is row k S + i of the batch. If
        ``tables`` (M,) has their numbers, actions (M, A) are a shot on each. No player errs.
        """
        rows = np.arange(self.num_envs)
        if tables is None:
            wanted = self.game.read(actions, -1, len(rows))
            rows = np.tile(rows, len(wanted))
        else:
            read = whole(0, len(rows) - 1)
            rows = np.array([argument("tables", each, read) for each in tables], np.int64)
            wanted = self.game.read(actions, len(rows))
        flat, shape = wanted.reshape(-1, wanted.shape[-1]), wanted.shape[:-1]
        played = self.game.play(self._now.at(rows), flat, None)
        reward, ended = played.reward.reshape(shape), played.terminated.reshape(shape)
        return Rehearsal(**vars(played.batch), reward=reward, terminated=ended)

    def close_extras(self, **_: Any) -> None:
        """End the workers of this environment."""
        if self.game.workers is not None:
            self.game.workers.end()

    def render(self) -> Any:
        """Return for each table the picture of its last shot's end, or all frames in a list."""
        if self.render_mode is None:
            message = 'Nothing is drawn: the environment was made without render_mode="rgb_array".'
            return gymnasium.logger.warn(message)
        return tuple(map(self._drawn, range(self.num_envs)))

    def _drawn(self, k: int) -> Any:
        """Return the picture (450, 800, 3) of table ``k``, or the frames of its last shot."""
        from pool_pymunk.render import FilmSettings, Show
        from pool_pymunk.render.stage import Stage

        batch, row, cue = self._batch, int(self._played[k]), self.scene.balls[self.game.cue].id
        if batch is None or row < 0:
            position = self._now.position[k : k + 1]
            batch, row = simulate_many(self.scene, position, np.zeros_like(position)), 0
        run, shot = batch.run(row), Shot(self.game.caption(self._now, k), cue, (0.0, 0.0))
        scene = replace(run.scene, title=self.game.name)
        show = Show((replace(run, scene=scene, shot=shot, solver=""),))
        is_film = self.render_mode == "rgb_array_list"  # Otherwise it is a film of the end alone.
        settings = FilmSettings(size=SIZE, fps=FPS, start=0.0 if is_film else sys.float_info.max)
        frames = [frame[..., :3].copy() for frame in Stage(show, settings).frames()]
        return frames if is_film else frames[-1]


class BilliardsEnv(gymnasium.Env[Seen, Seen]):
    """A billiards environment plays a game on one table: a step is a shot of the cue ball.

    ``game`` is a subclass of :class:`Game`, and other settings are those of the game. An action has
    numbers a, clipped to [-1, 1]: the cue ball leaves at 180 a[0] degrees, counter-clockwise from
    +x, at the speed ``max_speed`` (1 + a[1]) / 2. A step lasts until all balls rest; its shot is
    exact, as in ``simulate_many``. An observation is a float32 array: x and y of all balls, in the
    order of ``scene.balls``, then for each ball 1 if it is off the table, and in Pot 1 if it is
    called. The middle of the table is (0, 0), and half of its longer side is 1; a ball off the
    table is at (0, 0).

    ``info`` has ``angle`` (degrees) and ``speed`` (m/s) of the cue ball, with the player's
    errors; the ``duration`` (s); the numbers of ``hits`` of balls and on ``cushions``; the number
    of the ball that the cue ball met first (``first_hit``, -1: none), how many it ``met``, and
    whether it was pocketed (``foul``); and the ``status`` of :class:`~pool_pymunk.Batch`.

    ``render_mode="rgb_array"`` draws the end of the last shot, (450, 800, 3); ``"rgb_array_list"``
    draws all its frames, 30 a second. ``reset(options={"position": ...})`` puts the balls at places
    (N, 2) in m, NaN for a ball off the table. Bad input raises SettingError or SceneError.
    """

    metadata: ClassVar[dict[str, Any]] = dict(DRAWN)
    plays: ClassVar[type[Game] | None] = None  # the game, if no other is asked for

    def __init__(
        self, scenario: On = None, *, game: Asked = None, render_mode: str | None = None,
        **settings: Any,
    ) -> None:  # fmt: skip
        self.game = _game_of(game or self.plays, scenario, settings)
        one = BilliardsVectorEnv(game=self.game, autoreset_mode="Disabled", render_mode=render_mode)
        self._one, self.scene, self.render_mode = one, self.game.scene, render_mode
        self.observation_space = self.game.observation_space
        self.action_space = self.game.action_space

    @property
    def position(self) -> Floats:
        """Where the balls are (N, 2), in m; NaN for those off the table."""
        return np.array(self._one._now.position[0])

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Seen, dict[str, Any]]:
        """Begin a new episode: return the observation and the info."""
        super().reset(seed=seed)
        infos, self._one._rng = Infos(), Generators([self.np_random])
        return self._one._begin(ALL, infos, options)[0], _only(infos)

    def step(self, action: Any) -> tuple[Seen, float, bool, bool, dict[str, Any]]:
        """Play a shot: return what is seen, the reward, if the episode ends or is cut, and info."""
        if self._one._now and self._one._done[0]:
            raise ResetNeeded("The episode is over: call reset() before the next step.")
        if self._one._rng.each[0] is not self.np_random:
            self._one._rng = Generators([self.np_random])
        found = self._one.step(self.game.read(action)[np.newaxis])
        seen, reward, terminated, truncated = (each[0] for each in found[:-1])
        return seen, float(reward), bool(terminated), bool(truncated), _only(found[-1])

    def rehearse(self, actions: Any) -> Rehearsal:
        """Return the batch of K shots (K, A) without the player's errors; nothing changes."""
        wanted = self.game.read(actions, -1)
        return self._one.rehearse(wanted, np.zeros(len(wanted), np.int64))

    def render(self) -> Any:
        """Return the picture of the last shot's end, or all of its frames in a list."""
        drawn = self._one.render()
        return None if drawn is None else drawn[0]


def _game_of(game: Any, scenario: On, settings: dict[str, Any]) -> Game:
    """Return a game: made from a class and its settings, or the given one."""
    if isinstance(game, type) and issubclass(game, Game):
        return game(scenario, **settings)
    if isinstance(game, Game) and scenario is None and not settings:
        return game
    message = "must be a subclass of pool_pymunk.env.Game, or a game without more settings"
    raise setting_error("game", game, message)


def _only(infos: Infos) -> dict[str, Any]:
    """Return the info of the only table, in plain numbers."""
    own = {key: np.asarray(each[0]) for key, each in infos.items() if not key.startswith("_")}
    return {key: each if each.ndim else each.item() for key, each in own.items()}


def _tell(infos: Infos, rows: Rows, info: Info, count: int) -> None:
    """Add the info of some tables, and which tables these are, in Gymnasium's form."""
    for key, values in info.items():
        if len(values):
            mine = infos.setdefault(key, np.zeros((count, *values.shape[1:]), values.dtype))
            mask = infos.setdefault(f"_{key}", np.zeros(count, np.bool_))
            mine[rows], mask[rows] = values, True


def _rows(mask: Flags) -> Rows:
    return ALL if mask.all() else np.flatnonzero(mask)
