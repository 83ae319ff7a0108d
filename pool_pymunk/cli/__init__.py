"""This is the command line: one file a command; errors become one line a problem and an exit code.

0 done; 1 a run that could not be finished (what was computed is kept); 2 bad input;
130 interrupted.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Annotated, cast

import typer

from pool_pymunk import __version__
from pool_pymunk.cli import lib
from pool_pymunk.cli.read import InputError
from pool_pymunk.safety.files import DEVICE_ERRORS, RenderError
from pool_pymunk.safety.interrupts import patient_interrupts

app = typer.Typer(
    name="pool-pymunk",
    help="2D billiards in pymunk, by the report's time slices, and exactly.",
    pretty_exceptions_enable=False,
)
COMMANDS = (
    "run", "collide", "compare", "tradeoff", "sensitivity", "fit", "sweep", "atlas", "stability",
    "render", "page", "play", "check",
)  # fmt: skip
for command in COMMANDS:
    app.command()(getattr(import_module(f"pool_pymunk.cli.{command}"), command))

INTERRUPTED = 130

# Typer raises this for a command line that it cannot read; it exports only a subclass of it.
UsageError = cast(type[Exception], typer.BadParameter.__mro__[1])


@app.callback(invoke_without_command=True)
def _top(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        typer.echo(__version__)
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit."""
    sys.exit(_exit_code(arguments))


def _exit_code(arguments: list[str] | None) -> int:
    try:
        with patient_interrupts():
            code: int = app(args=arguments, prog_name="pool-pymunk", standalone_mode=False) or 0
    except KeyboardInterrupt:
        code = INTERRUPTED
    except (ValueError, UsageError, RenderError) as error:
        refused = InputError | lib.problems.SceneError | lib.problems.SettingError
        if isinstance(error, ValueError) and not isinstance(error, refused):
            raise
        _complain(str(error))
        return 2
    except BrokenPipeError:  # the reader of our output left, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        _complain(f"{error.filename or 'file'}: {error.strerror or error}")
        return 1 if error.errno in DEVICE_ERRORS else 2  # the disk failed, or the place is bad
    if code == INTERRUPTED:
        _complain("interrupted")
    return code


def _complain(text: str) -> None:
    for line in text.splitlines() or [""]:
        print(line if line.startswith("error") else f"error: {line}", file=sys.stderr)
