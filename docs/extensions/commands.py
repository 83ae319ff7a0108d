"""This extension writes the reference of a command from the command line itself.

````{command} run```` gives what the command says of itself, and a table of its options.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer
from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from pool_pymunk.cli import app as command_line


def plain(text: str) -> str:
    """Return a text of the command line as Markdown, in one line."""
    text = " ".join(text.split()).replace("<", r"\<").replace("|", r"\|")
    return re.sub(r"(?<![\w-])(--[a-z-]+)", r"`\1`", text)


def option_name(option: Any) -> str:
    """Return how an option or an argument is written on the command line."""
    if option.param_type_name == "argument":
        return f"`{option.metavar or option.name.upper()}`"
    names = " / ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
    if option.is_flag:
        return names
    metavar = (option.metavar or "VALUE").replace("|", r"\|")
    return f"{names} `{metavar}`"


def default(option: Any) -> str:
    """Return the default of an option as its help shows it, or nothing."""
    if option.required:
        return "required"
    shown = getattr(option, "show_default", None)
    if isinstance(shown, str):
        return f"({shown})"
    value = option.default
    if getattr(option, "is_flag", False):  # An argument has no such word.
        names = option.opts if value else option.secondary_opts
        return f"`{names[0]}`" if option.secondary_opts else ""
    if shown is False or value in (None, (), []) or callable(value):
        return ""
    return f"`{' '.join(map(str, value)) if isinstance(value, list | tuple) else value}`"


def lines(command: Any) -> Iterator[str]:
    """Yield the Markdown of a command's reference."""
    yield from (f"{plain(part)}\n" for part in (command.help or "").split("\n\n"))
    yield from ("| option | what it says | default |", "|---|---|---|")
    for option in command.params:
        said = plain(getattr(option, "help", None) or "")
        yield f"| {option_name(option)} | {said} | {default(option)} |"


class Command(SphinxDirective):
    """This directive stands for the reference of one command."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the nodes of the command's reference."""
        top: Any = typer.main.get_command(command_line)
        text = "\n".join(lines(top.commands[self.arguments[0]])).splitlines()
        section = nodes.container()
        self.state.nested_parse(StringList(text, "the command line"), self.content_offset, section)
        return section.children


def setup(app: Sphinx) -> dict[str, bool]:
    """Give Sphinx the directive."""
    app.add_directive("command", Command)
    return {"parallel_read_safe": True}
