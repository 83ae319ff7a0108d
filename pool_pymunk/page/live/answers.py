"""This module answers what the page of the live table asks for.

A question is the text of a JSON object, and every answer is text with a status of HTTP. A refusal
has one line for each problem of the question.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pool_pymunk.core import compiled
from pool_pymunk.laws import LAWS
from pool_pymunk.model import Scene, SceneError, SettingError, Shot, State
from pool_pymunk.model.places import Surroundings, placed
from pool_pymunk.model.problems import Point, listed, setting_error, shown
from pool_pymunk.model.state import NO_ROLLING, read_state
from pool_pymunk.page.content import content
from pool_pymunk.page.document import page
from pool_pymunk.render.pictures import as_set_up
from pool_pymunk.render.table import round_number
from pool_pymunk.results.run import Run
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import SOLVERS, Solver, find_solver, reference_solver, request
from pool_pymunk.studies.variation import Normal, Variation, numbers

LONGEST = 60.0  # s; a run is ended at this time at the latest,
MOST_EVENTS = 5_000  # and after this many events.
MOST_LINES = 20  # This many problems are named at most.
SAMPLES = 1_000  # ends in a cloud
SOME = 50  # ends; a cloud begins with this number and doubles,
CLOUD_TIME = 1.5  # until it took this long (s).
FINEST = 1e-6  # s; the page offers no finer step
HARD_HIT = 2.5  # A full drag is up to this many times as fast as the fastest shot.
FULL_DRAG = 4.0  # widths; without a shot, a full drag makes a ball go about this far


class Reply(NamedTuple):
    """An answer is a text with a status of HTTP and a type."""

    status: int
    text: str
    type: str = "application/json"


def refusal(status: int, *problems: str) -> Reply:
    """Return the answer that says what is wrong, one line a problem."""
    return Reply(status, json.dumps({"problems": problems}))


class _Question(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class Start(_Question):
    """A start says where the balls are (m), how they move and roll (m/s), and which are off."""

    position: list[list[float]]
    velocity: list[list[float]]
    off: list[str] = []
    rolls: list[list[float]] | None = None

    @property
    def state(self) -> State:
        """The state as it was sent, unchecked."""
        return State(self.position, self.velocity, self.off, self.rolls)  # type: ignore[arg-type]


class Placing(Start):
    """This question asks whether a ball may lie where it is."""

    ball: str


class Ask(Start):
    """This question asks for a shot: speed in m/s, angle in degrees, a share of roll, step in s."""

    ball: str
    speed: float
    angle: float
    roll: float | None = None
    solver: str = "pymunk"
    dt: float | None = None
    law: str | None = None


class AskCloud(Ask):
    """This question asks for many shots, with the standard deviations of a player's errors.

    The error of the angle is in degrees, that of the speed a share of the speed.
    """

    angle_error: float = Field(0.0, ge=0.0, le=180.0)
    speed_error: float = Field(0.0, ge=0.0, le=1.0)


QUESTIONS: dict[str, type[Any]] = {
    **dict.fromkeys(("shot", "aim", "save", "scenario"), Ask), "place": Placing, "cloud": AskCloud,
}  # fmt: skip


class Answers:
    """This class answers questions about one scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.latest = min(scene.physics.max_time or math.inf, LONGEST)

    def to(self, name: str, text: bytes) -> Reply:
        """Return the answer to a question of that name."""
        try:
            answer: Reply = getattr(self, name)(QUESTIONS[name].model_validate_json(text))
            return answer
        except ValidationError as error:
            return refusal(400, *islice(_lines(error), MOST_LINES))
        except (SceneError, SettingError) as error:
            return refusal(400, *str(error).splitlines()[:MOST_LINES])
        except Exception as error:  # The page says so, and the table goes on.
            return refusal(500, f"the server failed: {type(error).__name__}: {error}")

    def shot(self, asked: Ask) -> Reply:
        """Play a shot, and beside it the reference run."""
        return _json(content([self._beside(asked)]))

    def aim(self, asked: Ask) -> Reply:
        """Tell exactly what the shot would do."""
        return _json(content([[self._play(asked, reference_solver().name)]])["shots"][0]["runs"][0])

    def save(self, asked: Ask) -> Reply:
        """Return the shot as a page of its own."""
        return Reply(200, page([self._beside(asked)]), "text/html")

    def place(self, asked: Placing) -> Reply:
        """Tell what is wrong with the place of a ball, if anything is."""
        state = read_state(asked.state, self.scene.index, self.scene.surface.rolls)
        if asked.ball not in self.scene.index:
            known = listed(self.scene.index)
            return refusal(400, f"ball = {shown(asked.ball)}: there is no such ball ({known})")
        scene, balls = self.scene, placed(self.scene.balls, state)
        others = {i: ball for i, ball in balls.items() if i != scene.index[asked.ball]}
        around = Surroundings(scene.table, scene.pockets, scene.posts, scene.units)
        before = list(around.problems(others))
        new = [one.message for one in around.problems(balls) if one not in before]
        return refusal(400, *new[:MOST_LINES]) if new else _json({})

    def scenario(self, asked: Ask) -> Reply:
        """Return the shot as lines of a scenario file; the whole file if more has changed."""
        scene, shot = self.scene, self._shot(asked)
        state = scene.state(asked.state)
        rolls = state.roll or ((0.0, 0.0),) * len(scene.balls)
        motions = zip(scene.balls, state.position, state.velocity, rolls, strict=True)
        balls = tuple(
            replace(ball, position=place, velocity=v, roll=_share(ball.id, v, w))
            for ball, place, v, w in motions
            if ball.id not in state.off
        )
        physics = replace(scene.physics, law=asked.law or scene.physics.law)
        changed = replace(scene, balls=balls, physics=physics, shots=(shot,))
        changed.start(shot)
        text = changed.to_toml()
        if changed == replace(scene, shots=(shot,)) and 'numbers = "SI"' not in text:
            text = "".join(text.rpartition("[[shots]]\n")[1:])
        step = "" if asked.dt is None else f" --dt {step_text(asked.dt).removesuffix(' s')}"
        return _json({"text": f"# played by --solver {asked.solver}{step}\n{text}"})

    def cloud(self, asked: AskCloud) -> Reply:
        """Return where the balls end if a player errs: for each ball its ends, if they differ."""
        shot = self._shot(asked)
        state = self.scene.start(shot, self.scene.state(asked.state))
        varied = Variation(self.scene, {}, shot, asked.law, state=state)
        turn, faster = Normal(asked.angle_error), Normal(asked.speed_error * asked.speed)
        spent, ends = 0.0, np.empty((0, len(self.scene.balls), 2))
        while len(ends) < SAMPLES and spent < CLOUD_TIME:
            some = range(len(ends), min(2 * len(ends) + SOME, SAMPLES))
            drawn = numbers({"turn": turn, "speed": faster}, some)
            values = {"angle": asked.angle + drawn["turn"], "speed": asked.speed + drawn["speed"]}
            begun = varied.begin(varied.places(len(some)), values, carried=state.roll)
            batch = varied.play(begun, max_time=self.latest)
            spent += batch.wall_time
            ends = np.concatenate([ends, batch.final])
        spread = []
        for each in ends.swapaxes(0, 1):  # to a hundredth of a millimetre
            there = each[np.isfinite(each).all(axis=1)]
            spread.append(there.round(5).tolist() if (there != there[:1]).any() else [])
        return _json({"ends": spread, "samples": len(ends), "compiled": compiled})

    def _beside(self, asked: Ask) -> list[Run]:
        """Return the run, and the reference run where that is another one."""
        names = dict.fromkeys((asked.solver, reference_solver().name))
        return [self._play(asked, name) for name in names]

    def _play(self, asked: Ask, solver: str) -> Run:
        law = None if find_solver(solver).own_law else asked.law
        limits: dict[str, Any] = {"max_time": self.latest, "max_events": MOST_EVENTS}
        wanted = request(self.scene, solver, dt=asked.dt, law=law, **limits)
        return wanted.play(self._shot(asked), self.scene.state(asked.state))

    def _shot(self, asked: Ask) -> Shot:
        units = self.scene.units
        name = f"{units.from_si(asked.speed, 'speed'):.6g} {units.speed} at {asked.angle:.6g}°"
        roll = asked.roll or 0.0
        if self.scene.surface.rolls:
            name += f", roll {roll:g}"
        elif roll:
            raise setting_error("roll", roll, NO_ROLLING)
        return Shot(name, asked.ball, speed=asked.speed, angle=asked.angle, roll=roll)


def _share(ball: str, velocity: Point, roll: Point) -> float:
    """Return a ball's roll as a share of its velocity, as scenario files say it."""
    (vx, vy), (wx, wy) = velocity, roll
    square = vx * vx + vy * vy
    share = (vx * wx + vy * wy) / square if square else 0.0
    if math.dist(roll, (share * vx, share * vy)) > 1e-9 * math.hypot(wx, wy):
        message = f"ball {shown(ball)} rolls across its velocity, which no scenario file can say"
        raise setting_error("rolls", roll, message)
    return share


def _json(value: object) -> Reply:
    return Reply(200, json.dumps(value, allow_nan=False, separators=(",", ":")))


def _lines(error: ValidationError) -> Iterator[str]:
    """Yield what does not fit, one line a problem."""
    for details in error.errors(include_url=False):
        key = ".".join(map(str, details["loc"])) or "question"
        missing = details["type"] == "missing"
        value = "" if missing or details["loc"] == () else f" = {shown(details['input'])}"
        message = details["msg"].removeprefix("Input ")
        yield f"{key}{value}: {message[:1].lower()}{message[1:]}"


def live_content(scene: Scene) -> dict[str, Any]:
    """Return what the page shows at first, and what one can choose on it."""
    shot = scene.shots[0] if scene.shots else None
    struck = scene.index[shot.ball] if shot else scene.index[(scene.cue or scene.balls[0]).id]
    vx, vy = scene.start(shot).velocity[struck]
    shown = content([[as_set_up(scene)]])
    width = shown["seen"][2] - shown["seen"][0]
    # A shot may be aimed at a ball, without a launch; only the speed counts here.
    launches = (one.launch or (one.speed or 0.0, 0.0) for one in scene.shots)
    fastest = max((math.hypot(*launch) for launch in launches), default=0.0)
    top = HARD_HIT * fastest or math.sqrt(2.0 * scene.deceleration * FULL_DRAG * width) or 2.0
    unit = shown["units"]["speed"][1]
    top = round_number(top / unit) * unit
    return shown | {
        "live": {
            "ball": struck,
            "speed": math.hypot(vx, vy) or top / 2.0,
            "angle": math.degrees(math.atan2(vy, vx)),
            "roll": (shot.roll if shot else 0.0) if scene.surface.rolls else None,
            "top": top,
            "solvers": [
                {"name": one.name, "about": one.about, "exact": one.exact}
                | {"dt": one.dt, "steps": _steps(one)}
                for one in SOLVERS.values()
                if one.plays(scene)
            ],
            "laws": list(LAWS),
            "law": scene.physics.law,
            "samples": SAMPLES,
        }
    }


def _steps(solver: Solver) -> list[tuple[float, str]]:
    """Return the steps that are offered for a solver, from long to short, with their names."""
    known = {*solver.ladder, *solver.stability_steps, *([solver.dt] if solver.dt else [])}
    return [(dt, step_text(dt)) for dt in sorted(known, reverse=True) if dt >= FINEST]
