"""This module lets small changes go through an exact run (:mod:`pool_pymunk.physics.changes`)."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Sequence
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.fast.tables import coefficients_of, cue_of, own_of_walls
from pool_pymunk.model.inputs import Names, changed_numbers, starts_of
from pool_pymunk.model.obstacles import obstacles
from pool_pymunk.model.problems import SettingError, setting_error
from pool_pymunk.physics import changes, columns, errors, motion_changes
from pool_pymunk.physics.columns import Follow
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.motion_changes import CHAOS, FOLLOWED, LASTS, OUT, REASONS, ROLL, STOP
from pool_pymunk.physics.path import NOISE, Path, from_breakpoint
from pool_pymunk.physics.saltation import AGREE, BLUR
from pool_pymunk.physics.sides import pocket
from pool_pymunk.physics.surface import Rolling, Sliding
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import find_solver

NO_SIGNS = {"signs": np.empty((0, 0)), "alike": np.empty((0, 0, 0, 0)), "drawn": [0, 0]}


class Paths(dict[int, Path]):
    """These are the paths from breakpoints on, by their numbers, once somebody asks for them."""

    def __init__(self, rows: Any) -> None:
        super().__init__()
        self.rows = rows

    def __missing__(self, number: int) -> Path:
        path = self[number] = from_breakpoint(*self.rows[number][1:8])
        return path


class Changes(NamedTuple):
    """Changes say how the balls' states depend on the inputs.

    ``ends`` (N, K, P) are those at the end of the run, and ``times`` (E, P) are the changes of the
    times of the events. ``warnings`` say what has no derivative.
    """

    run: Run
    pass_: Any
    ends: Array
    times: Array
    warnings: Names

    def at(self, times: Sequence[float], i: int) -> Array:
        """Return the changes (T, 2, P) of a ball's place at these times."""
        g, t = self.pass_, np.clip(np.asarray(times, float), 0.0, self.run.duration)
        found = np.empty((len(t), 2, len(g.late)))
        kept = sorted(g.kept.changes[i], key=lambda one: one[0])
        last = np.searchsorted([begun for begun, _, _ in kept], t, side="right") - 1
        for n in np.unique(last):
            _, row, change = kept[max(n, 0)]
            found[last == n] = self._along(row, change, t[last == n])
        for (_, row, before), (_, later, after) in pairwise(kept):
            is_now = self._is_hit(g.kept.paths[row], g.rows[later], t)
            found[is_now] += np.where((before != 0.0) | (after != 0.0), math.nan, 0.0).sum(axis=0)
        return found

    def _along(self, row: int, change: Array, t: Array) -> Array:
        """Return changes of the place on the path of a breakpoint, where it begins with a change.

        They are quadratic in the time, so three of them have all (Lagrange's polynomial).
        """
        g, after = self.pass_, t - self.pass_.rows[row][1]
        longest, three = after.max(), (change.copy(), change.copy(), change.copy())
        for share, own in zip((0.5, 1.0), three[1:], strict=True):
            motion_changes.carry(g, g.rows[row], own, g.rows[row][1] + share * longest)
        first, half, whole = (own[:2] for own in three)
        s = (after / (longest or 1.0))[:, np.newaxis, np.newaxis]
        found = np.asarray((1.0 - s) * ((1.0 - 2.0 * s) * first + 4.0 * s * half))
        found += s * (2.0 * s - 1.0) * whole
        following = g.following[row]
        if following >= 0:  # What begins later than its breakpoint is unknown.
            found[g.rows[following][1] < t] = math.nan
        return found

    def _is_hit(self, path: Path, row: Any, t: Array) -> Any:
        """Tell which times (s) are those of a hit, to rounding, between a path and a breakpoint."""
        _, begun, x, y, vx, vy, *_ = row
        ux, uy = path.at(begun)[1]
        fastest = max(abs(vx), abs(vy), abs(ux), abs(uy))
        jump = max(abs(vx - ux), abs(vy - uy))
        if jump <= AGREE * math.hypot(vx, vy) + NOISE * path.speed:
            return np.zeros(len(t), bool)
        far = BLUR * (abs(x) + abs(y) + begun * fastest)
        is_now = (t == begun) | (abs(t - begun) * fastest < far)
        # The end may be at no fixed time.
        return is_now & ((t != self.run.duration) | bool(self.pass_.one.ends[1]))


def by_names(run: Run, names: Names, some: Collection[str]) -> Array:
    """Return the changes (N, K, P) of the balls' states at the start, by some of the inputs."""
    scene, shot = run.scene, run.shot
    struck = None if run.struck is None else scene.index[run.struck]
    begun = np.array([breakpoints[0] for breakpoints in run.knots])[np.newaxis]
    share = shot.roll if shot and shot.ball == run.struck else None
    roll = begun[..., 7:9] if scene.surface.rolls else None
    found = starts_of(scene, some, struck, begun[..., 3:5], roll, share)[0]
    starts = np.zeros((*found.shape[:2], len(names)))
    starts[..., [names.index(name) for name in some]] = found
    return starts


def changes_of(run: Run, names: Names, starts: Array) -> Changes:
    """Follow the changes of the ``starts`` (N, K, P) through a run, up to persistent contacts.

    Raises SettingError for a law or a surface that has no derivatives.
    """
    g = follow_of(run, starts, changed_numbers(run.scene, names))
    g, _ = followed(g, run, follow_all)
    found = sorted(g.kept.found, key=lambda one: one[0])
    lost = "what depends on it has no derivative, and is NaN"
    texts = dict.fromkeys(
        f"{REASONS[k].format(g.law.name)} (at {t:.6g} s): {lost}" for t, k in found
    )
    lates = np.array(g.kept.lates).reshape(len(g.events), len(names))
    is_event = np.array([other != LASTS for *_, other in g.events], bool)
    return Changes(run, g, g.change, lates[is_event], tuple(texts))


def follow_all(g: Any) -> int:
    """Follow the changes through a run; return why errors cannot be followed, if so."""
    return changes.follow(g, 0, len(g.events)) or changes.finish(g)


def follow_of(
    run: Run, starts: Array, numbers: Sequence[Array], signs: dict[str, Any] = NO_SIGNS
) -> Any:
    """Return what a pass through a run needs, with the changes of its starts and its numbers."""
    scene, (count, size, inputs) = run.scene, starts.shape
    if type(scene.surface) not in (Sliding, Rolling):
        message = "is a surface of your own, and has no derivatives"
        raise setting_error("surface", type(scene.surface).__name__, message)
    is_cut = run.status == "max_time" or run.duration == scene.physics.max_time
    rows, gone = rows_of(run), run.off - run.pocketed.keys()
    walls = (*scene.cushions, *(pocket(p.position, p.radius, 0) for p in scene.pockets))
    anchors = [*(scene.table.outline if scene.table else ()), *(p.position for p in scene.posts)]
    discs, faces, corners = obstacles(scene)
    of_numbers, of_mass, of_radius = numbers
    one = SimpleNamespace(**{name: np.zeros(shape) for name, shape in columns.ONE.items()})
    one.ends[:3] = run.duration, is_cut, run.status == "max_events"
    one.numbers[:] = coefficients_of(scene)
    kept = SimpleNamespace(
        paths=Paths(rows), found=[], lates=[],
        changes=[[(0.0, i, start.copy())] for i, start in enumerate(starts)],
    )  # fmt: skip
    g: Any = Follow(
        rows, following_of(rows, count), events_of(run), walls, len(scene.cushions),
        own_of_walls(scene), cue_of(scene), law_of(run), discs, faces,
        corners, [SimpleNamespace(at=0, met=STOP, gone=ball.id in gone, mass=ball.mass,
                                  radius=ball.radius) for ball in scene.balls],
        np.vstack((of_numbers, np.zeros(inputs))), of_mass, of_radius, starts.copy(),
        np.zeros((count, inputs), bool), np.zeros(inputs), one, **columns.room(size, inputs),
        **signs, anchors=anchors, kept=kept,
        borders=scene.ground.borders, ground=scene.ground.own,
    )  # fmt: skip
    return g


def followed(g: Any, run: Run, follow: Callable[[Any], int | None]) -> tuple[Any, int | None]:
    """Follow the changes through a run, by compiled code where ``FASTER`` has it, or by ``follow``.

    Return the pass and its answer; raise SettingError for a law that cannot be differentiated.
    """
    try:
        why: int | None = changes.FASTER[0](g, run) if changes.FASTER else None
        if why is None:
            g = listed(g)
            why = follow(g)
    except (TypeError, AttributeError) as error:
        if "dual" not in str(error).lower():
            raise
        message = "cannot be differentiated: it may use + - * / **, abs, min, max, comparisons"
        raise setting_error("law", g.law.name, message) from None
    return g, why


def listed(g: Any) -> Any:
    """Return the pass with lists in place of arrays, because Python reads them faster.

    The balls are on their first paths.
    """
    rows, one = g.rows.tolist(), {name: getattr(g.one, name).tolist() for name in columns.ONE}
    g.kept.paths.rows = rows
    g = g._replace(
        rows=rows, following=g.following.tolist(), events=g.events.tolist(),
        one=SimpleNamespace(**one),
    )  # fmt: skip
    changes.start(g, 0)
    return g


def rows_of(run: Run) -> Array:
    """Return the breakpoints (B, 10) of a run, each after its ball; the first ones come first."""
    numbers = np.repeat(np.arange(len(run.knots)), [len(own) for own in run.knots])
    rows = np.zeros((len(numbers), 10))
    rows[:, 0] = numbers
    if len(rows):
        rows[:, 1 : 1 + run.knots[0].shape[1]] = np.concatenate(run.knots)
    first = np.searchsorted(numbers, range(len(run.knots)))
    return np.concatenate((rows[first], np.delete(rows, first, axis=0)))


def following_of(rows: Array, balls: int) -> Any:
    """Return the number of the breakpoint of the same ball that follows each one, or -1."""
    later = rows[balls:, 0]
    nexts = np.append(np.searchsorted(later, range(balls)), np.arange(1, len(later) + 1))
    is_own = np.append(later, -1.0)[nexts] == rows[:, 0]
    return np.where(is_own, balls + nexts, -1)


def events_of(run: Run) -> Array:
    """Return the time (E, 3) of each event, its ball, and what that meets.

    Between them are the rows from which on balls are in persistent contacts.
    """
    scene, found = run.scene, list[tuple[float, int, int]]()
    holes = {hole.id: k for k, hole in enumerate(scene.pockets, start=len(scene.cushions))}
    for event in run.events:
        i, *others = (scene.index[id_] for id_ in event.balls)
        wall = event.cushion if event.pocket is None else holes[event.pocket]
        into = OUT if event.patch is None else OUT - 1 - event.patch
        met = {"stop": STOP, "roll": ROLL, "patch": into}.get(event.kind, -1 - (wall or 0))
        found.append((event.t, i, others[0] if others else met))
    rows, begun = np.array(found, float).reshape(-1, 3), beginnings(run)
    lost = np.array([(t, i, LASTS) for _, t, i in begun], float).reshape(-1, 3)
    return np.insert(rows, [k for k, _, _ in begun], lost, axis=0)


def beginnings(run: Run) -> list[tuple[int, float, int]]:
    """Return before which event (its number) and when (s) balls come to persistent contacts.

    Each ball comes to its first one after its hits of that instant. Where it has none, that is
    after what else it does then, such as to stop.
    """
    firsts: dict[str, float] = {}
    for contact in run.persistent:
        for id_ in contact.balls:
            firsts[id_] = min(contact.since, firsts.get(id_, math.inf))
    times, found = [event.t for event in run.events], []
    for id_, t in firsts.items():
        first, last = bisect_left(times, t), bisect_right(times, t)
        own = [k for k in range(first, last) if id_ in run.events[k].balls]
        hits = [k for k in own if run.events[k].is_contact]
        if t <= run.duration:
            found.append((max(hits or own, default=first - 1) + 1, t, run.scene.index[id_]))
    return sorted(found)


def law_of(run: Run) -> Law:
    """Return the law of a run; raise SettingError for one that the run does not keep."""
    law = run.law_used or LAWS.get(run.law)
    if law is None:
        message = "is a law of your own, and a run that was loaded or copied does not keep it"
        raise setting_error("law", run.law, message)
    return law


def rounding(run: Run) -> float:
    """Return how far (m) rounding may have moved the ends of an exact run, to first order.

    The errors that every path and every contact make (:mod:`pool_pymunk.physics.errors`) go through
    the run as changes do, in ``COLUMNS`` draws of random signs. The answer is ``SURE`` times the
    largest root mean square move of a ball over the draws. It is inf where errors grow until other
    contacts may come, and nan where the run has no derivative, or where contacts persisted.
    """
    if not find_solver(run.solver).exact or run.persistent:
        return math.nan
    count, size = len(run.scene.balls), 6 if run.scene.surface.rolls else 4
    none = [np.zeros((rows, errors.COLUMNS)) for rows in (7, count, count)]

    try:
        g = follow_of(run, np.zeros((count, size, errors.COLUMNS)), none, errors.room())
        with np.errstate(all="ignore"):
            g, why = followed(g, run, follow_all)
    except SettingError:
        return math.nan
    if why != FOLLOWED:
        return math.inf if why == CHAOS else math.nan
    means = (g.change[:, :2] ** 2).sum(axis=1).mean(axis=1)
    return float(errors.SURE * np.sqrt(means).max(initial=0.0))
