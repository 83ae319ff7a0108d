"""The changes of one shot: it is played, and a tangent follows its course."""

from __future__ import annotations

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.tangent.course import Course
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.rounding import RoundingErrors
from pool_pymunk.core.tangent.tangent import Tangent
from pool_pymunk.core.tangent.touches import Corner

# when (s) a run ended, whether it was cut off there, and whether its number of events did that
End = tuple[float, bool, bool]


def play(engine: Engine, latest: float, listener: Recorder) -> tuple[Course, End]:
    """Play a run whose balls are on their first paths, and note its course and its end.

    It goes on to the ``latest`` (s) at most. The ``listener`` hears it, too.
    """
    engine.recorder = course = Course(engine.balls, listener)
    engine.begin_run()
    engine.advance(latest)
    return course, close(engine, course, latest)


def close(engine: Engine, course: Course, latest: float) -> End:
    """End the course of a run that might go on to the ``latest`` (s), and return how it ended."""
    end = end_of(engine, course, latest)
    engine.now, _is_cut, _by_events = end
    course.close(engine.persistence.persisted(engine), engine.now, engine.most_events)
    return end


def end_of(engine: Engine, course: Course, latest: float) -> End:
    """Return how a run has ended that might go on to the ``latest`` (s)."""
    upcoming = engine.upcoming()
    by_events = not engine.is_finite or (upcoming < INF and upcoming <= latest)
    is_cut = not by_events and upcoming < INF
    for ball in engine.balls:
        is_cut = is_cut or (not by_events and ball.path.end == INF)
    if by_events:
        return engine.now, False, True
    if not is_cut:
        return course.duration, course.duration == latest, False
    return (latest if latest < INF else engine.now), True, False


def tangent_of(engine: Engine, course: Course, corners: list[Corner], inputs: Inputs) -> Tangent:
    """Return a tangent along a course that an engine has played."""
    return Tangent(engine.table, engine.law, engine.balls, corners, course, inputs)


def errors_of(engine: Engine) -> RoundingErrors:
    """Return rounding errors for what an engine has played."""
    return RoundingErrors(engine.table.surface.rolls, engine.table.pull > 0.0)


def ends_of(tangent: Tangent) -> list[list[float]]:
    """Return the changes (N, K P) of all balls: place, velocity and, if they roll, roll."""
    found: list[list[float]] = []
    for track in tangent.tracks:
        x, y = [c.x for c in track.changes], [c.y for c in track.changes]
        vx, vy = [c.vx for c in track.changes], [c.vy for c in track.changes]
        row = x + y + vx + vy
        if tangent.rolls:
            row += [c.wx for c in track.changes]
            row += [c.wy for c in track.changes]
        found.append(row)
    return found
