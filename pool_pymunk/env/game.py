"""This module defines games: functions of arrays that have one row for each of S tables."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from pool_pymunk.env.layouts import Floats, Generators, Layouts
from pool_pymunk.many import Batch, simulate_many
from pool_pymunk.many.batch import CANNOT_START
from pool_pymunk.many.places import may_lie
from pool_pymunk.many.workers import Workers
from pool_pymunk.model import Scene
from pool_pymunk.model.places import SUNK
from pool_pymunk.model.plain import argument, between, choice, size, whole
from pool_pymunk.model.problems import setting_error, shown, suggestion
from pool_pymunk.model.scenario import load
from pool_pymunk.results.words import counted
from pool_pymunk.studies.variation import Normal

Flags = NDArray[np.bool_]
On = str | Path | Scene | None  # the table that is asked for
Info = dict[str, NDArray[Any]]  # what is said beside the observation, one row a table

SETTINGS = {
    "layout": choice(("random", "scenario")),
    "max_speed": size,
    "angle_error": between(0.0),
    "speed_error": between(0.0),
}


class Tables(dict[str, NDArray[Any]]):
    """Tables hold the state of games: arrays by name, with one row for each table (S).

    ``position`` (S, N, 2) is in m, NaN for a ball off the table; ``shots`` and ``points`` (S,) are
    those of the episode. A game adds arrays of its own.
    """

    @property
    def position(self) -> Floats:
        """Where the balls are (S, N, 2), in m."""
        return self["position"]

    @property
    def off(self) -> Flags:
        """The flags of balls (S, N) that are off the table."""
        return np.asarray(np.isnan(self.position[..., 0]))

    def at(self, rows: Any) -> Tables:
        """Return some of the tables."""
        return Tables({key: values[rows] for key, values in self.items()})

    def put(self, rows: Any, others: Tables) -> Tables:
        """Replace some of the tables, and return all."""
        for key, values in self.items():
            values[rows] = others[key]
        return self


@dataclass(eq=False)
class Played:
    """These are shots that were played, one row a table (S), for a game to judge.

    ``before`` has the games before the shots of ``batch``, ``tables`` after them. The cue ball
    ``met`` this number of balls, or was pocketed (``foul``). ``lost`` shots could not be played.
    """

    batch: Batch
    before: Tables
    tables: Tables
    met: NDArray[np.int64]
    foul: Flags
    lost: Flags
    reward: Floats = field(init=False)
    terminated: Flags = field(init=False)
    truncated: Flags = field(init=False)
    info: Info = field(init=False)


@dataclass(frozen=True, eq=False, repr=False)
class Rehearsal(Batch):
    """A rehearsal is a batch of shots that were tried; its scores have the shape of the actions."""

    reward: Floats = field(kw_only=True)
    terminated: Flags = field(kw_only=True)


class Game(ABC):
    """A game says which balls lie where, what a shot is, what it scores, and what is observed.

    A game of your own is a subclass that has a ``score``, and overrides what else differs. These
    attributes are defaults of settings: ``scenario``, a bundled one, a file, or a Scene; the number
    of ``balls`` besides the cue ball (None: all); their ``layout``, ``"random"`` (they touch
    nothing) or ``"scenario"``; ``max_speed`` (m/s); and the standard deviations of the
    player's normal errors, ``angle_error`` (degrees) and ``speed_error`` (m/s).

    These are no settings: the ``name``; whether an action ``has_roll`` or ``has_place``; the number
    of ``shots`` in an episode; the ``least`` number of balls besides the cue ball; whether the game
    ``needs_pockets``; the names of its ``options`` of ``reset``, and of the arrays of ``marked``
    balls for learners; how many numbers from -1 to 1 are ``more_seen``; and the ``lost_score``
    of a shot that could not be played, which ends the episode.

    A game has its ``scene``, the number of the ``cue`` ball in it, the balls' places in the
    scenario, ``spots`` (N, 2), and the table's ``middle`` and ``half_size`` (2,), all in m.
    """

    name: str = ""  # by default that of the class
    scenario: On = "eight-ball"
    balls: int | None = None
    layout: str = "random"
    max_speed, angle_error, speed_error = 3.0, 0.0, 0.0
    has_roll, has_place, needs_pockets = False, False, False
    shots, least, more_seen, lost_score = 1, 1, 0, 0.0
    options: tuple[str, ...] = ()
    marked: tuple[str, ...] = ()
    workers: Workers | None = None  # They share the shots; an environment says which.

    def __init__(self, scenario: On = None, **settings: Any) -> None:
        _check_known("setting", settings, ("scenario", "balls", *SETTINGS))
        for key, read in SETTINGS.items():
            asked = settings.get(key)
            setattr(self, key, argument(key, getattr(self, key) if asked is None else asked, read))
        self.name = self.name or type(self).__name__
        self._enough = f"{counted(self.least, 'ball')} or more beside the cue ball"
        self.scene = self._scene(scenario, settings.get("balls"))
        assert self.scene.cue is not None and self.scene.table is not None
        self.cue = self.scene.index[self.scene.cue.id]
        self.spots = np.array([ball.position for ball in self.scene.balls])
        self._layouts = Layouts(self.scene) if self.layout == "random" else None
        corners = np.array(self.scene.table.bounds).reshape(2, 2)
        self.middle, self.half_size = corners.mean(axis=0), np.diff(corners, axis=0)[0] / 2.0
        self._origin = np.tile(self.middle, len(self.spots))

    def _scene(self, scenario: On, balls: int | None) -> Scene:
        """Return the table with the cue ball and the first of its other balls."""
        if scenario is None:
            scenario, balls = self.scenario, self.balls if balls is None else balls
        if not isinstance(scenario, Scene | str | Path):
            raise setting_error("scenario", scenario, "must be a name, a path or a Scene")
        scene = scenario if isinstance(scenario, Scene) else load(scenario)
        others = [ball for ball in scene.balls if not ball.cue]
        wanted = {
            "a table with cushions": scene.table is not None,
            "a cue ball (cue = true)": scene.cue is not None,
            self._enough: len(others) >= self.least,
            "pockets": bool(scene.pockets) or not self.needs_pockets,
            "friction of rolling": scene.surface.rolls or not self.has_roll,
            "surface friction or a max_time": scene.deceleration > 0.0
            or scene.physics.max_time is not None,
        }
        for what in [what for what, is_there in wanted.items() if not is_there]:
            given = repr(scene) if isinstance(scenario, Scene) else str(scenario)
            raise setting_error("scenario", given, f"{self.name} needs {what}")
        count = len(others) if balls is None else argument("balls", balls, whole(0))
        if not self.least <= count <= len(others):
            message = f"must be between {self.least} and {len(others)}, beside the cue ball"
            raise setting_error("balls", count, message)
        there = [ball for ball in scene.balls if ball.cue or ball in others[:count]]
        still = tuple(replace(ball, velocity=(0.0, 0.0)) for ball in there)
        return replace(scene, balls=still, shots=())

    def layouts(self, rng: Generators) -> Any:
        """Return where the balls are as episodes begin (S, N, 2), in m; NaN is off the table."""
        if self._layouts is not None:
            return self._layouts.draw(rng)
        return np.tile(self.spots, (len(rng), 1, 1))

    def begin(self, tables: Tables, rng: Generators, options: Mapping[str, Any]) -> None:
        """Add to the tables what else the game has to remember, one row a table."""
        return

    def start(self, rng: Generators, options: Any = None) -> Tables:
        """Lay out a table for each of the generators, or as the options of ``reset`` say."""
        asked, count = read_options(options), len(rng)
        _check_known("option", asked, ("position", *self.options))
        given = asked.get("position")
        layouts = self.layouts(rng) if given is None else given
        if given is not None or type(self).layouts is not Game.layouts:
            layouts = self._read_layouts(layouts, count)
        tables = Tables(position=layouts, shots=np.zeros(count, np.int64), points=np.zeros(count))
        self.begin(tables, rng, asked)
        return tables

    def _read_layouts(self, given: Any, count: int) -> Floats:
        """Read layouts (S, N, 2), or one; raises SettingError or SceneError for bad ones."""
        found, shape = _read_numbers("position", given), self.spots.shape
        if found.shape not in (shape, (count, *shape)):
            message = f"must have the shape {shape}, or {(count, *shape)}: one for each table"
            raise setting_error("position", f"shape {found.shape}", message)
        layouts = found.reshape(-1, *shape).copy()
        off = np.asarray(np.isnan(layouts).any(axis=-1))
        layouts[off] = np.nan
        ids = np.array(list(self.scene.index))
        for k in np.flatnonzero(~may_lie(self.scene, layouts, SUNK).all(axis=1)):
            places = np.where(off[k][:, np.newaxis], self.spots, layouts[k])
            self.scene.state((places, np.zeros_like(places), {*ids[off[k]].tolist()}))
        if off[:, self.cue].any() and not self.has_place:
            raise setting_error("position", "NaN", "the cue ball must be on the table")
        if (others := np.delete(~off, self.cue, axis=1).sum(axis=1).min()) < self.least:
            message = f"{self.name} needs {self._enough}"
            raise setting_error("position", counted(others, "ball"), message)
        return np.array(np.broadcast_to(layouts, (count, *shape)))

    @cached_property
    def action_space(self) -> Box:
        """The actions of one table (A,), from -1 to 1."""
        return Box(-1.0, 1.0, (2 + self.has_roll + 2 * self.has_place,), np.float32)

    def read(self, actions: Any, *shape: int) -> Floats:
        """Read actions (*shape, A), where -1 is any number; raises SettingError for others."""
        found, width = _read_numbers("action", actions), self.action_space.shape
        wanted = (*(found.shape[:1] if shape[:1] == (-1,) else shape[:1]), *shape[1:], *width)
        if found.shape != wanted:
            parts = " and a roll" * self.has_roll + " and a place" * self.has_place
            message = f"must have the shape {wanted}: an angle and a speed{parts}"
            raise setting_error("action", f"shape {found.shape}", message)
        return found

    def aim(self, actions: Floats) -> dict[str, Floats]:
        """Return what actions (S, A) from -1 to 1 mean, with one row a table.

        These are ``angle`` (degrees), ``speed`` (m/s), ``roll``, a share of it, and ``place`` (m).
        """
        turn, power, *more = actions.T
        asked = {"angle": 180.0 * turn, "speed": self.max_speed * (1.0 + power) / 2.0}
        if self.has_roll:
            asked["roll"] = more.pop(0)
        if self.has_place:
            asked["place"] = self.middle + self.half_size * np.transpose(more)
        return asked

    def put(self, tables: Tables, place: Floats) -> Floats:
        """Return places (S, 2) in m for the cue ball if ``place`` is asked for; by default it."""
        return place

    def play(self, tables: Tables, actions: Floats, rng: Generators | None) -> Played:
        """Play a shot on each table, by its action (S, A); without ``rng`` no player errs."""
        if (bad := np.isnan(actions)).any():
            width = "two" if actions.shape[1] == 2 else actions.shape[1]
            raise setting_error("action", actions[bad.any(axis=1)][0], f"must be {width} numbers")
        asked = self.aim(np.clip(actions, -1.0, 1.0))
        if "place" in asked:
            asked["place"] = self.put(tables, asked["place"])
        if rng is not None and (self.angle_error or self.speed_error):
            turn, faster = rng.random(2).T
            asked["angle"] = asked["angle"] + Normal(self.angle_error).at(turn)
            asked["speed"] = np.maximum(asked["speed"] + Normal(self.speed_error).at(faster), 0.0)
        batch = self._strike(tables.position, **asked)
        rest, pocketed, lost = batch.final.copy(), batch.pocketed >= 0, ~batch.ended
        if self.scene.pockets:
            rest[pocketed] = np.nan
        rest[lost] = tables.position[lost]
        after = Tables({key: each.copy() for key, each in tables.items() if key != "position"})
        after |= {"position": rest, "shots": after["shots"] + 1}
        met = np.asarray(np.einsum("ij->i", batch.met, dtype=np.int64))  # faster than a sum
        played = Played(batch, tables, after, met, pocketed[:, self.cue], lost)
        given = self.score(played)
        try:
            score = np.asarray(given, float)
        except (TypeError, ValueError):  # a text, or None
            score = np.empty(0)
        if score.shape != lost.shape or not np.isfinite(score[~lost]).all():
            message = f"must be a finite number for each of {len(lost)} tables"
            raise setting_error(f"{self.name}.score", given, message)
        played.reward = np.where(lost, self.lost_score, score)
        after["points"] += played.reward
        is_out = after.off[:, self.cue] & (not self.has_place)
        played.terminated = self.is_over(played) | lost | is_out
        played.truncated = self.is_cut_off(played)
        numbers = ("hits", "cushions", "first_hit", "status")
        played.info = asked | {key: getattr(batch, key).astype(np.int64) for key in numbers}
        said = {"duration": batch.duration, "met": played.met, "foul": played.foul}
        played.info |= said | self.info(played)
        return played

    def _strike(
        self, position: Floats, angle: Floats, speed: Floats, roll: Any = None, place: Any = None
    ) -> Batch:
        """Play the shots; a shot cannot start where its place is not free: there nothing moves."""
        taken = np.zeros(len(position), np.bool_)
        if place is not None:
            position = position.copy()
            position[:, self.cue] = place
            taken = np.asarray(~may_lie(self.scene, position, SUNK).all(axis=1))
            position[taken, self.cue] = np.nan
        velocity = np.zeros_like(position)
        # NumPy's own sine and cosine may round otherwise in a long array than in a short one.
        turned = np.exp(1j * np.radians(angle))
        velocity[:, self.cue] = np.stack((speed * turned.real, speed * turned.imag), axis=1)
        more: dict[str, Any] = {} if self.workers is None else {"workers": self.workers}
        if roll is not None:
            more["roll"] = velocity * roll[:, np.newaxis, np.newaxis]
        batch = simulate_many(self.scene, position, velocity, **more)
        batch.status[taken] = CANNOT_START
        return batch

    @abstractmethod
    def score(self, played: Played) -> Any:
        """Return what shots score, a number a table (S,)."""

    def is_over(self, played: Played) -> Any:
        """Tell which episodes (S,) are over; the ``reward`` of the shots is known."""
        return played.tables["shots"] >= self.shots

    def is_cut_off(self, played: Played) -> Any:
        """Tell which episodes (S,) are cut off, although they are not over by the rules."""
        return np.zeros(len(played.lost), np.bool_)

    def info(self, played: Played) -> Info:
        """Return what the game adds to ``info``, with one row a table."""
        return {}

    def info_at_start(self, tables: Tables) -> Info:
        """Return the ``info`` of tables as they are laid out."""
        return {}

    def caption(self, tables: Tables, k: int) -> str:
        """Return what stands below a picture of table ``k``."""
        return f"{tables['points'][k]:.3g} points"

    @cached_property
    def observation_space(self) -> Box:
        """The observations of one table (D,)."""
        far = np.tile(self.half_size / self.half_size.max(), len(self.spots)).astype(np.float32)
        flags = np.ones(len(self.spots) * (1 + len(self.marked)), np.float32)
        more = np.ones(self.more_seen, np.float32)
        return Box(np.hstack([-far, 0.0 * flags, -more]), np.hstack([far, flags, more]))

    def observe(self, tables: Tables) -> NDArray[np.float32]:
        """Return what a learner sees (S, D): places, who is off the table, which are marked.

        The last ``more_seen`` numbers are 0; a game may put its own there.
        """
        off, balls = tables.off, len(self.spots)
        seen = np.zeros((len(off), *self.observation_space.shape), np.float32)
        # NumPy takes four times as long for a row of two numbers as for one of all balls.
        places = tables.position.reshape(len(off), -1) - self._origin
        places /= self.half_size.max()
        if off.any():
            places[np.isnan(places)] = 0.0
            seen[:, 2 * balls : 3 * balls] = off
        seen[:, : 2 * balls] = places
        for k, key in enumerate(self.marked, start=3):
            seen[:, k * balls : (k + 1) * balls] = tables[key][:, np.newaxis] == np.arange(balls)
        return seen


def read_options(options: Any) -> dict[str, Any]:
    """Read the options of ``reset``; raises SettingError if they are no dict."""
    if options is not None and not isinstance(options, Mapping):
        raise setting_error("options", options, "must be a dict or None")
    return dict(options or {})


def _check_known(what: str, asked: Mapping[str, Any], known: Collection[str]) -> None:
    """Raise SettingError for the first setting or option that is not known, if there is one."""
    for key in [key for key in asked if key not in known]:
        message = f"there is no such {what} (there are: {', '.join(known)}){suggestion(key, known)}"
        name, value = ("options", key) if what == "option" else (key, asked[key])
        raise setting_error(name, value, message)


def _read_numbers(key: str, value: Any) -> Floats:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise setting_error(key, shown(value), "must be numbers") from None
