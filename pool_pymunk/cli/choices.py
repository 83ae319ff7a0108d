"""This module has the words that options take, for --help and for the shell's completion.

Nothing slow is imported for them, because --help must come at once: of the library only the laws.
tests/test_cli_manners.py holds the other words to what the library has.
"""

from __future__ import annotations

from pool_pymunk.physics.laws import LAWS

SOLVERS = ("pymunk", "pymunk-discrete", "pymunk-builtin", "event-driven", "time-slice")
FRICTION = ("joint", "callback")
SHOWS = ("end", "first-hit", "hits", "pocket", "duration")
UNITS = {"length": ("m", "cm", "mm", "in"), "mass": ("kg", "g"), "speed": ("m/s", "in/s")}


def solver_names(incomplete: str) -> list[str]:
    """Return the solvers that begin as typed.

    >>> solver_names("pymunk-")
    ['pymunk-discrete', 'pymunk-builtin']
    """
    return [name for name in SOLVERS if name.startswith(incomplete)]


def solver_lists(incomplete: str) -> list[str]:
    """Return what a list of solvers, such as ``pymunk,ev``, may go on with.

    >>> solver_lists("pymunk,ev")
    ['pymunk,event-driven']
    """
    before, comma, last = incomplete.rpartition(",")
    return [before + comma + name for name in solver_names(last)]


def law_names(incomplete: str) -> list[str]:
    """Return the laws that begin as typed."""
    return [name for name in LAWS if name.startswith(incomplete)]


def friction_names(incomplete: str) -> list[str]:
    """Return the ways to apply surface friction that begin as typed."""
    return [name for name in FRICTION if name.startswith(incomplete)]


def scenario_names(incomplete: str) -> list[str]:
    """Return the bundled scenarios that begin as typed; where none does, shells offer files."""
    from pool_pymunk.model.scenario import bundled

    return [name for name in bundled() if name.startswith(incomplete)]
