"""No command, option or exported name is lost: people outside use them.

``python -m tests.test_names`` writes the list in tests/data/names.json anew; names may come in.
"""

from __future__ import annotations

import inspect
import json
import re
from functools import cache
from importlib import import_module
from typing import Any

import pymunk
import pytest
import typer

import pool_pymunk
from pool_pymunk.cli import app
from tests import DATA

LIST = DATA / "names.json"


@cache
def commands() -> dict[str, list[str]]:
    """Return the names of each command's arguments and options."""
    top: Any = typer.main.get_command(app)
    return {
        name: sorted(
            said for param in command.params for said in (*param.opts, *param.secondary_opts)
        )
        for name, command in {"": top, **top.commands}.items()
    }


LISTED: dict[str, Any] = json.loads(LIST.read_text(encoding="utf-8")) if LIST.exists() else {}


@pytest.mark.parametrize("command", LISTED.get("commands", ()))
def test_every_command_keeps_its_options(command: str) -> None:
    assert set(LISTED["commands"][command]) <= set(commands()[command])


def test_every_exported_name_stays() -> None:
    assert set(LISTED["exported"]) <= set(pool_pymunk.__all__)
    for name in LISTED["exported"]:
        assert getattr(pool_pymunk, name) is not None


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [("world", "Ball", "TableBall"), ("solvers", "yardstick", "reference_solver")],
)
def test_a_former_name_warns_and_means_the_new_one(module: str, old: str, new: str) -> None:
    home = import_module(f"pool_pymunk.{module}")
    with pytest.warns(DeprecationWarning, match=f"{old} is now {new}"):
        assert getattr(home, old) is getattr(home, new)
    with pytest.raises(AttributeError, match="no attribute 'Bill'"):
        _ = home.Bill


# What takes no argument and does more than tell a state: it acts, or it writes the object anew.
ACTS = r"(as|to|save)_\w+|clear|close|render|reset|come"
EXPORTING = ["pool_pymunk", "pool_pymunk.world", "pool_pymunk.env"]


@pytest.mark.parametrize("module", EXPORTING)
def test_a_state_is_a_property(module: str) -> None:
    """A method without arguments acts; what only tells a state is read without parentheses."""
    home = pytest.importorskip(module, exc_type=ImportError)
    exported = [getattr(home, name) for name in home.__all__]
    for kind in [each for each in exported if isinstance(each, type)]:
        for name, method in inspect.getmembers(kind, inspect.isfunction):
            is_own = method.__module__.startswith("pool_pymunk") and not name.startswith("_")
            if is_own and len(inspect.signature(method).parameters) == 1:
                assert re.fullmatch(ACTS, name), (kind, name)


def test_what_is_a_property_now_still_may_be_called() -> None:
    table = pool_pymunk.Billiards(pymunk.Space(), 0.01, pair=pool_pymunk.same_balls(0.9, 0.0))
    table.add_ball(pymunk.Circle(pymunk.Body(0.2, 1.0), 0.03))
    derivatives = pool_pymunk.simulate(pool_pymunk.load("follow-and-draw"), 1).derivatives("x.1")
    for state in (table.on_table, derivatives.amplification):
        with pytest.warns(DeprecationWarning, match="is a property now: leave out the parentheses"):
            assert state() == state
    assert table.on_table == table.balls
    assert derivatives.amplification.keys() == derivatives.run.final.keys()


def test_the_former_name_of_the_contact_distance_warns() -> None:
    hit = pool_pymunk.collide(pool_pymunk.Disc(1.0, 0.1, (1.0, 0.0)), pool_pymunk.Disc(1.0, 0.1))
    with pytest.warns(DeprecationWarning, match="reach is now contact_distance"):
        assert hit.reach == hit.contact_distance == 0.2


if __name__ == "__main__":
    names = {"commands": commands(), "exported": sorted(pool_pymunk.__all__)}
    LIST.write_text(json.dumps(names, indent=1) + "\n", encoding="utf-8")
