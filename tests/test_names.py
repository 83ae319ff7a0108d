"""No command, option or exported name is lost: people outside use them.

``python -m tests.test_names`` writes the list in tests/data/names.json anew; names may come in.
"""

from __future__ import annotations

import json
from importlib import import_module
from typing import Any

import pytest
import typer

import pool_pymunk
from pool_pymunk.cli import app
from tests import DATA

LIST = DATA / "names.json"


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


def test_the_former_name_of_the_contact_distance_warns() -> None:
    hit = pool_pymunk.collide(pool_pymunk.Disc(1.0, 0.1, (1.0, 0.0)), pool_pymunk.Disc(1.0, 0.1))
    with pytest.warns(DeprecationWarning, match="reach is now contact_distance"):
        assert hit.reach == hit.contact_distance == 0.2


if __name__ == "__main__":
    names = {"commands": commands(), "exported": sorted(pool_pymunk.__all__)}
    LIST.write_text(json.dumps(names, indent=1) + "\n", encoding="utf-8")
