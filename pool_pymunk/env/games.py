"""This module has the rules: what a shot is, what it scores, and what a learner sees.

A game plays on any number of tables (S) at once, by pure functions on arrays. An environment for
one table plays the same game with S = 1, so both give the same bits.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.env.layouts import Floats, Hands, Layouts
from pool_pymunk.fast import Batch, simulate_many
from pool_pymunk.model import Scene
from pool_pymunk.model.plain import argument, between, choice, size, whole
from pool_pymunk.model.problems import listed, setting_error, shown, suggestion
from pool_pymunk.model.scenario import load
from pool_pymunk.results.words import counted

Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]
Info = dict[str, NDArray[Any]]  # what is said beside the observation, one row a table

LAYOUTS = ("random", "scenario")
NOBODY = -1


class Tables(NamedTuple):
    """Tables tell how games stand: one row a table.

    ``position`` (S, N, 2) is in m, and NaN for a ball that is off the table. ``called`` (S,) is the
    number of the ball to pot, -1 where none is called; ``points`` (S,) are those of the episode.
    """

    position: Floats
    called: Ints
    points: Ints

    @property
    def off(self) -> Flags:
        """Tell which balls (S, N) are off the table."""
        return np.asarray(np.isnan(self.position[..., 0]))

    def at(self, rows: Any) -> Tables:
        """Return some of the tables."""
        return Tables(*(each[rows] for each in self))

    def put(self, rows: Any, others: Tables) -> None:
        """Replace some of the tables."""
        for mine, its in zip(self, others, strict=True):
            mine[rows] = its


class Played(NamedTuple):
    """These are shots that were played, one row a table: what they led to and what they scored."""

    batch: Batch
    tables: Tables
    reward: Floats
    terminated: Flags
    info: Info


class Game(ABC):
    """A game has a scene, rules, and scales of what is done and seen."""

    name: ClassVar[str]
    scenario: ClassVar[str]  # The table on which it is played if no other is asked for.
    others: ClassVar[int | None]  # this many balls beside the cue ball; None: all
    max_speed: ClassVar[float]  # m/s
    least: ClassVar[int]  # A game needs this many balls beside the cue ball.
    calls = False  # whether a ball is called

    def __init__(
        self,
        scenario: str | Path | Scene | None = None,
        *,
        balls: int | None = None,
        layout: str = "random",
        max_speed: float | None = None,
        angle_error: float = 0.0,
        speed_error: float = 0.0,
    ) -> None:
        argument("layout", layout, choice(LAYOUTS))
        self._enough = f"{counted(self.least, 'ball')} or more beside the cue ball"
        self.scene = self._scene(scenario, balls)
        fastest = self.max_speed if max_speed is None else max_speed
        self.fastest = argument("max_speed", fastest, size)
        self.angle_error = argument("angle_error", angle_error, between(0.0))
        self.speed_error = argument("speed_error", speed_error, between(0.0))
        assert self.scene.cue is not None and self.scene.table is not None
        self.cue = self.scene.index[self.scene.cue.id]
        self.layouts = Layouts(self.scene) if layout == "random" else None
        self.spots = np.array([ball.position for ball in self.scene.balls])
        x0, y0, x1, y1 = self.scene.table.bounds
        self.middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0])
        self.scale = max(x1 - x0, y1 - y0) / 2.0
        self.half_size = np.array([x1 - x0, y1 - y0]) / 2.0 / self.scale

    def _scene(self, scenario: str | Path | Scene | None, balls: int | None) -> Scene:
        """Return the table with the cue ball and the first of its other balls."""
        if scenario is None:
            scenario = self.scenario
            balls = self.others if balls is None else balls
        if not isinstance(scenario, Scene | str | Path):
            raise setting_error("scenario", scenario, "must be a name, a path or a Scene")
        scene = scenario if isinstance(scenario, Scene) else load(scenario)
        others = [ball for ball in scene.balls if not ball.cue]
        wanted = {
            "a table with cushions": scene.table is not None,
            "a cue ball (cue = true)": scene.cue is not None,
            self._enough: len(others) >= self.least,
            "pockets": bool(scene.pockets) or not self.calls,
            "surface friction or a max_time": scene.deceleration > 0.0
            or scene.physics.max_time is not None,
        }
        for what in [what for what, is_there in wanted.items() if not is_there]:
            given = repr(scene) if isinstance(scenario, Scene) else str(scenario)
            raise setting_error("scenario", given, f"{self.name} needs {what}")
        count = len(others) if balls is None else argument("balls", balls, whole(1))
        if not self.least <= count <= len(others):
            message = f"must be between {self.least} and {len(others)}"
            raise setting_error("balls", count, message)
        there = [ball for ball in scene.balls if ball.cue or ball in others[:count]]
        still = tuple(replace(ball, velocity=(0.0, 0.0)) for ball in there)
        return replace(scene, balls=still, shots=())

    # -- how a game begins -------------------------------------------------------------------------

    def start(self, hands: Hands, options: Any = None) -> Tables:
        """Lay out a table for each of the generators.

        ``options`` may have a ``position`` (N, 2) in m, NaN for a ball off the table, and the id of
        the ``called`` ball. Raises SettingError for other options.
        """
        asked, count = read_options(options), len(hands)
        known = ("position", "called") if self.calls else ("position",)
        for key in [key for key in asked if key not in known]:
            message = f"there is no such option (there are: {', '.join(known)})"
            raise setting_error("options", key, message + suggestion(key, known))
        given = asked.get("position")
        if given is None and self.layouts is not None:
            layouts = self.layouts.draw(hands)
        else:
            spots = self.spots if given is None else self._read_layout(given)
            layouts = np.tile(spots, (count, 1, 1))
        tables = Tables(layouts, np.full(count, NOBODY), np.zeros(count, np.int64))
        return tables._replace(called=self._call(tables, hands, asked.get("called")))

    def _read_layout(self, position: Any) -> Floats:
        """Read a layout (N, 2); raises SettingError or SceneError for what cannot be."""
        found = _read_numbers("position", position).copy()
        if found.shape != self.spots.shape:
            message = f"must have the shape {self.spots.shape}"
            raise setting_error("position", f"shape {found.shape}", message)
        off = np.asarray(np.isnan(found).any(axis=-1))
        found[off] = np.nan
        places = np.where(off[:, np.newaxis], self.spots, found)
        gone = frozenset(np.array(list(self.scene.index), dtype=object)[off])
        self.scene.state((places, np.zeros_like(places), gone))
        if off[self.cue]:
            raise setting_error("position", "NaN", "the cue ball must be on the table")
        if (others := int(np.count_nonzero(~off)) - 1) < self.least:
            message = f"{self.name} needs {self._enough}"
            raise setting_error("position", counted(others, "ball"), message)
        return found

    def _call(self, tables: Tables, hands: Hands, called: Any) -> Ints:
        """Return the called ball of each table: this one, or any of those on the table."""
        return tables.called

    # -- a shot ------------------------------------------------------------------------------------

    def play(self, tables: Tables, actions: Floats, hands: Hands | None) -> Played:
        """Play a shot on each table, by its action (S, 2); actions beyond [-1, 1] are clipped.

        Without ``hands`` there are no errors of the hand. Raises SettingError for an action that is
        NaN.
        """
        angle, speed = self._aim(actions, hands)
        velocity = np.zeros_like(tables.position)
        turned = np.radians(angle).tolist()
        # NumPy's own sine and cosine may round otherwise in a long array than in a short one.
        for axis, turn in enumerate((math.cos, math.sin)):
            velocity[:, self.cue, axis] = speed * np.array(list(map(turn, turned)))
        batch = simulate_many(self.scene, tables.position, velocity)
        is_lost = ~batch.ended
        rest = batch.final.copy()
        rest[batch.pocketed >= 0] = np.nan
        rest[is_lost] = tables.position[is_lost]
        after = tables._replace(position=rest)
        reward, terminated, info = self._judge(batch, after, is_lost)
        after = after._replace(points=after.points + reward.astype(np.int64))
        counts = ("hits", "cushions", "first_hit", "status")
        info = {
            "angle": angle,
            "speed": speed,
            "duration": batch.duration,
            **{key: getattr(batch, key).astype(np.int64) for key in counts},
            "met": batch.met.sum(axis=1),
            "foul": batch.pocketed[:, self.cue] >= 0,
            **info,
        }
        return Played(batch, after, reward, terminated, info)

    def rehearse(self, tables: Tables, actions: Any) -> Floats:
        """Return the rewards (K, S) of K shots a table (K, S, 2), without errors of the hand."""
        wanted = read_actions(actions, (len(tables.called), 2), many=True)
        rows = np.tile(np.arange(len(tables.called)), len(wanted))
        shots = self.play(tables.at(rows), wanted.reshape(-1, 2), hands=None)
        return shots.reward.reshape(wanted.shape[:2])

    def _aim(self, actions: Floats, hands: Hands | None) -> tuple[Floats, Floats]:
        """Return angles (degrees) and speeds (m/s): what is asked for, and the hand's errors."""
        bad = np.isnan(actions).any(axis=1)
        if bad.any():
            raise setting_error("action", actions[bad.argmax()], "must be two numbers")
        turn, power = np.clip(actions, -1.0, 1.0).T
        angle = 180.0 * turn
        speed = self.fastest * (1.0 + power) / 2.0
        if hands is not None and (self.angle_error or self.speed_error):
            errors = np.array([hand.standard_normal(2) for hand in hands]).reshape(-1, 2)
            angle = angle + self.angle_error * errors[:, 0]
            speed = np.maximum(speed + self.speed_error * errors[:, 1], 0.0)
        return angle, speed

    @abstractmethod
    def _judge(self, batch: Batch, after: Tables, is_lost: Flags) -> tuple[Floats, Flags, Info]:
        """Return the rewards, which episodes are over, and the info."""

    # -- what is seen ------------------------------------------------------------------------------

    @property
    def bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the least and the largest observation."""
        far = np.tile(self.half_size, len(self.scene.balls)).astype(np.float32)
        flags = np.ones(len(self.scene.balls) * (2 if self.calls else 1), np.float32)
        return np.append(-far, 0.0 * flags), np.append(far, flags)

    def observe(self, tables: Tables) -> NDArray[np.float32]:
        """Return what a learner sees (S, D)."""
        off, count = tables.off, len(self.scene.balls)
        seen = np.empty((len(off), len(self.bounds[0])), np.float32)
        places = tables.position - self.middle
        places /= self.scale
        places[off] = 0.0
        seen[:, : 2 * count] = places.reshape(len(off), -1)
        seen[:, 2 * count : 3 * count] = off
        if self.calls:
            seen[:, 3 * count :] = tables.called[:, np.newaxis] == np.arange(count)
        return seen

    @abstractmethod
    def caption(self, tables: Tables, k: int) -> str:
        """Return what stands below a picture of table ``k``."""

    def info_at_start(self, tables: Tables) -> Info:
        """Return the info of tables as they are laid out."""
        return {"called": tables.called.copy()} if self.calls else {}


class Carom(Game):
    """Carom: the cue ball must meet two others."""

    name, scenario, others, max_speed, least = "Carom", "report-corrected", None, 5.0, 2

    def _judge(self, batch: Batch, after: Tables, is_lost: Flags) -> tuple[Floats, Flags, Info]:
        foul = batch.pocketed[:, self.cue] >= 0
        scores = (batch.met.sum(axis=1) >= 2) & ~foul & ~is_lost
        too_few = np.count_nonzero(~after.off, axis=1) - 1 < self.least
        return scores.astype(float), ~scores | too_few, {"points": after.points + scores}

    def caption(self, tables: Tables, k: int) -> str:
        return counted(int(tables.points[k]), "point")


class Pot(Game):
    """Pot: the called ball must go into a pocket, and the cue ball must not."""

    name, scenario, others, max_speed, least = "Pot", "eight-ball", 3, 3.0, 1
    calls = True

    def _call(self, tables: Tables, hands: Hands, called: Any) -> Ints:
        there = ~tables.off
        there[:, self.cue] = False
        if called is not None:
            known = [ball.id for ball in self.scene.balls if not ball.cue]
            if called not in known:
                message = f"there is no such ball to pot (there are: {listed(known)})"
                raise setting_error("called", called, message)
            if not there[:, self.scene.index[called]].all():
                raise setting_error("called", called, "the ball is off the table")
            return np.full(len(hands), self.scene.index[called])
        shares = np.array([hand.random() for hand in hands])
        place = (shares * there.sum(axis=1)).astype(np.int64)
        return np.asarray((there.cumsum(axis=1) > place[:, np.newaxis]).argmax(axis=1))

    def _judge(self, batch: Batch, after: Tables, is_lost: Flags) -> tuple[Floats, Flags, Info]:
        rows = np.arange(len(is_lost))
        foul = batch.pocketed[:, self.cue] >= 0
        scores = (batch.pocketed[rows, after.called] >= 0) & ~foul & ~is_lost
        info = {
            "called": after.called.copy(),
            "pocketed": np.count_nonzero(batch.pocketed >= 0, axis=1),
            "is_success": scores,
        }
        return scores.astype(float), np.ones(len(rows), np.bool_), info

    def caption(self, tables: Tables, k: int) -> str:
        return f"ball {self.scene.balls[tables.called[k]].id} is called"


def read_options(options: Any) -> dict[str, Any]:
    """Read the options of ``reset``; raises SettingError for what is no dict of them."""
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise setting_error("options", options, "must be a dict or None")
    return dict(options)


def read_actions(actions: Any, shape: tuple[int, ...], many: bool = False) -> Floats:
    """Read actions of a shape: an angle and a speed a table, or ``many`` of them (K, ...).

    Raises SettingError for another shape.
    """
    found = _read_numbers("action", actions)
    wanted = (*found.shape[:1], *shape) if many else shape
    if found.shape != wanted:
        message = f"must have the shape {wanted}: an angle and a speed"
        raise setting_error("action", f"shape {found.shape}", message)
    return found


def _read_numbers(key: str, value: Any) -> Floats:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise setting_error(key, shown(value), "must be numbers") from None
