"""This module has the environments with one table."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from numpy.typing import NDArray

from pool_pymunk.env.frames import FPS, MODES, read_mode, rendered
from pool_pymunk.env.games import Carom, Game, Played, Pot, Tables, read_actions
from pool_pymunk.fast import Batch
from pool_pymunk.model import Scene

Observation = NDArray[np.float32]


class Playing:
    """Environments with one table and with many have this in common."""

    game: Game
    render_mode: str | None
    _tables: Tables | None = None

    @property
    def scene(self) -> Scene:
        """The scene in which the balls are, with the table and its coefficients."""
        return self.game.scene

    @property
    def _now(self) -> Tables:
        if self._tables is None:
            raise ResetNeeded("There are no layouts yet: call reset() first.")
        return self._tables

    def _drawn(self, k: int, batch: Batch | None, row: int) -> Any:
        """Return the picture or the frames of table ``k``; None, with a warning, without a mode."""
        if self.render_mode is not None:
            return rendered(self.game, self._now, k, batch, row, self.render_mode)
        message = 'Nothing is drawn: the environment was made without render_mode="rgb_array".'
        gymnasium.logger.warn(message)
        return None


class BilliardsEnv(Playing, gymnasium.Env[Observation, Observation]):
    """A billiards environment plays a game on one table: a step is a shot of the cue ball.

    An action is two numbers in [-1, 1], clipped to this range. The cue ball leaves at the angle
    180 a[0] degrees, counter-clockwise from +x, with the speed ``max_speed`` (1 + a[1]) / 2. The
    next step begins when all balls rest; every shot is exact, as of ``simulate_many``.

    An observation is a float32 array of three or four numbers a ball: x and y of all balls, then
    for each ball 1 if it is off the table, and in Pot 1 if it is called. Balls stand in the order
    of ``scene.balls``. The middle of the table is (0, 0), and half of its longer side is 1, for x
    and for y, so angles are true; a ball off the table is at (0, 0).

    ``info`` tells of a shot: the ``angle`` (degrees) and ``speed`` (m/s) of the cue ball, errors
    of the hand included; its ``duration`` (s); how many ``hits`` of balls and hits on ``cushions``
    there were; the number of the ball that the cue ball met first (``first_hit``, -1: none), and
    how many balls it ``met``; whether the cue ball was pocketed (``foul``); and the ``status`` as
    :class:`~pool_pymunk.Batch` has it. A shot that is cut off at the scene's ``max_time`` leaves
    its balls at rest where they are; one whose numbers leave the range of floating point leaves
    them where they were, scores nothing and ends the episode.

    - ``scenario``: a bundled scenario, a file, or a Scene; it gives table, balls and coefficients.
    - ``balls``: this many balls beside the cue ball, the first of the scenario.
    - ``layout``: ``"random"`` puts the balls at random places where they touch nothing,
      ``"scenario"`` where the scenario has them.
    - ``max_speed`` (m/s).
    - ``angle_error`` (degrees) and ``speed_error`` (m/s): standard deviations of the errors of the
      player's hand, which are normal; 0 by default.
    - ``render_mode``: ``"rgb_array"`` draws how the last shot ended, (450, 800, 3);
      ``"rgb_array_list"`` draws all its frames, 30 a second.

    ``reset(options={"position": ...})`` sets where the balls are, (N, 2) in m, NaN for a ball off
    the table. Bad settings, options and actions raise SettingError or SceneError, a line each.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": list(MODES), "render_fps": FPS}
    plays: ClassVar[type[Game]]

    def __init__(
        self,
        scenario: str | Path | Scene | None = None,
        *,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self.game = self.plays(scenario, **settings)
        self.render_mode = read_mode(render_mode)
        self.observation_space = Box(*self.game.bounds, dtype=np.float32)
        self.action_space = Box(-1.0, 1.0, (2,), np.float32)
        self._shots: Played | None = None
        self._is_over = False

    @property
    def position(self) -> NDArray[np.float64]:
        """Where the balls are (N, 2), in m; NaN for those off the table."""
        return np.array(self._now.position[0])

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a new episode: return the observation and the info."""
        super().reset(seed=seed)
        self._tables = self.game.start([self.np_random], options)
        self._shots, self._is_over = None, False
        return self.game.observe(self._tables)[0], _only(self.game.info_at_start(self._tables))

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Play a shot: return what is seen, the reward, whether the episode is over, and more.

        Raises SettingError for what is no action, and ResetNeeded where no episode goes on.
        """
        before = self._now
        if self._is_over:
            raise ResetNeeded("The episode is over: call reset() before the next step.")
        shots = self.game.play(before, read_actions(action, (2,))[np.newaxis], [self.np_random])
        self._tables, self._shots, self._is_over = shots.tables, shots, bool(shots.terminated[0])
        seen = self.game.observe(shots.tables)[0]
        return seen, float(shots.reward[0]), self._is_over, False, _only(shots.info)

    def rehearse(self, actions: Any) -> NDArray[np.float64]:
        """Return the rewards (K,) that K shots (K, 2) would get; nothing changes.

        A rehearsed shot is played as it is meant, without errors of the hand.
        """
        wanted = read_actions(actions, (2,), many=True)
        return self.game.rehearse(self._now, wanted[:, np.newaxis])[:, 0]

    def render(self) -> Any:
        """Return the picture of the last shot's end, or all of its frames in a list."""
        return self._drawn(0, None if self._shots is None else self._shots.batch, 0)


class CaromEnv(BilliardsEnv):
    """Carom: the cue ball must meet two others for a point, and goes on as long as it does.

    The table is the report's, with eleven balls; its law and coefficients are those that the report
    meant (``report-corrected``), because the law of its program may gain energy, which a learner
    would find out. Actions, observations, ``info`` and settings are those of
    :class:`BilliardsEnv`; ``max_speed`` is 5 m/s by default.

    A shot in which the cue ball meets two others or more scores 1 and the episode goes on from
    where the balls lie; any other shot scores 0 and ends it. Where there are pockets, a shot
    that pockets the cue ball scores 0, and the episode also ends when fewer than two other balls
    remain. ``gym.make`` cuts a series off after 100 shots. ``info["points"]`` counts the series.

    >>> env = CaromEnv()
    >>> observation, info = env.reset(seed=3)
    >>> observation, reward, terminated, truncated, info = env.step([0.1, 0.6])
    >>> reward, terminated, info["met"], info["points"]
    (1.0, False, 2, 1)
    """

    plays = Carom


class PotEnv(BilliardsEnv):
    """Pot: one shot must put the called ball into a pocket, and the episode is over.

    The table is that of ``eight-ball``, with the cue ball and three others, one of them called.
    Actions, observations, ``info`` and settings are those of :class:`BilliardsEnv`; ``max_speed``
    is 3 m/s by default.

    The shot scores 1 if the called ball goes into any pocket and the cue ball into none, however
    it comes about; otherwise 0. ``info`` also has the number of the ``called`` ball, which
    ``reset`` tells, too, how many balls were ``pocketed``, and ``is_success``.
    ``reset(options={"called": "2"})`` calls a ball by its id; by default it is drawn.

    >>> env = PotEnv()
    >>> observation, info = env.reset(seed=1, options={"called": "2"})
    >>> env.scene.balls[info["called"]].id
    '2'
    """

    plays = Pot


def _only(info: dict[str, NDArray[Any]]) -> dict[str, Any]:
    """Return the info of the only table, in plain numbers."""
    return {key: values[0].item() for key, values in info.items()}
