"""This module compiles shots ahead, so that nobody waits for it in a game or in a notebook."""

from __future__ import annotations

import gc
import sys
import time
from contextlib import nullcontext
from typing import Any

import numpy as np

from pool_pymunk.fast import compiled, loop, single
from pool_pymunk.fast.records import CROWD, MOST_BALLS, nothing
from pool_pymunk.fast.tables import Form, loop_form
from pool_pymunk.model import Ball, Friction, Restitution, Scene, Table
from pool_pymunk.model.plain import argument, whole

FORMS: dict[Form, str] = {
    Form(False, False): "balls that slide",
    Form(True, False): "balls that roll",
    Form(False, True): "balls that slide between arcs, or posts with coefficients of their own",
    Form(True, True): "balls that roll between arcs, or posts with coefficients of their own",
}
FORMS |= {
    Form(False, True, moves=True): "balls that slide between walls that move",
    Form(True, True, moves=True): "balls that roll between walls that move",
}
FORMS |= {form._replace(many=True): f"{CROWD} {what}, at most" for form, what in FORMS.items()}


def compile(  # noqa: A001  It is called by its full name.
    scene: Scene | None = None,
    *,
    derivatives: bool = False,
    balls: int = MOST_BALLS,
    moving: bool = False,
) -> None:
    """Compile shots for this machine, or load them, and say so on standard error.

    By default this is done for all four kinds of scenes, each of which has a loop: balls may roll
    or only slide, and there may be arcs, or posts with coefficients of their own. With a ``scene``
    only the loop of its kind is compiled. Scenes and tables of 65 to 512 ``balls`` have four other
    loops. Tables with walls that move (``moving=True``) have two, for balls that slide and for
    balls that roll. To compile a loop takes a minute or two, once on each machine; to load it takes
    some 0.6 s in each process. Then ``Billiards`` plays its steps by it in this process, with the
    same bits. ``derivatives`` has no effect any more. Later garbage collections leave out the
    objects that exist by then (``gc.freeze``). Raises ModuleNotFoundError if numba is not
    installed.

    >>> from pool_pymunk import compile, load
    >>> compile(load("two-balls"))  # doctest: +SKIP
    balls that slide: ready after 0.6 s
    """
    many, moves = argument("balls", balls, whole(1, CROWD)) > MOST_BALLS, bool(moving)
    if not compiled.is_there():
        message = "compile() needs numba: pip install 'pool-pymunk[fast]'"
        raise ModuleNotFoundError(message, name="numba")
    forms = [form for form in FORMS if (form.many, form.moves) == (many, moves)]
    for form in forms if scene is None else [loop_form(scene)]:
        began = time.perf_counter()
        if form in single.loaded:
            single.remember(form, single.loaded[form])
        else:
            play_of(form)
        took = time.perf_counter() - began
        print(f"{FORMS[form]}: ready after {took:.1f} s", file=sys.stderr)
    # numba leaves so many objects that to look through them takes 50 ms in the midst of a game.
    gc.collect()
    gc.freeze()


def play_of(form: Form) -> Any:
    """Return the compiled loop of a form; compile it, or load it, if it is not there yet."""
    play = compiled.play_shots(*form)
    if not play.signatures:
        # To load it, nobody is waited for. This is the thread that an interrupt reaches.
        is_there = compiled.has_form(loop.play_shots, form)
        with nullcontext() if is_there else compiled.turn(play):
            play(np.zeros(1, dtype=form.work), *nothing(form.sides), 0, 0)
    single.remember(form, play)
    compiled.note_form(loop.play_shots, form)
    return play


def plainest(form: Form) -> Scene:
    """Return a scene of a form with as few balls as it has; they rest."""
    side = 2.0 if form.many else 1.0
    table = Table.circle(side) if form.differ else Table.rectangle(2.0 * side, 2.0 * side)
    friction = Friction(0.2, 0.1, rolling=0.01 if form.rolls else None)
    count = MOST_BALLS + 1 if form.many else 1
    places = [(side + 0.1 * (k % 9 - 4), side + 0.1 * (k // 9 - 4)) for k in range(count)]
    balls = tuple(Ball(f"{k}", place, 0.03, 0.2) for k, place in enumerate(places))
    return Scene(balls, table, Restitution(0.9, cushion=0.8), friction)
