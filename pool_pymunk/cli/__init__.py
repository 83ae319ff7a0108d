"""This is the command line: one file a command; errors become one line a problem and an exit code.

0 done; 1 a run that could not be finished (what was computed is kept); 2 bad input;
130 interrupted.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated, cast

import typer

from pool_pymunk.cli import lib
from pool_pymunk.cli.atlas import atlas
from pool_pymunk.cli.check import check
from pool_pymunk.cli.collide import collide
from pool_pymunk.cli.compare import compare
from pool_pymunk.cli.fit import fit
from pool_pymunk.cli.page import page
from pool_pymunk.cli.play import play
from pool_pymunk.cli.read import InputError
from pool_pymunk.cli.render import render
from pool_pymunk.cli.run import run
from pool_pymunk.cli.sensitivity import sensitivity
from pool_pymunk.cli.stability import stability
from pool_pymunk.cli.sweep import sweep
from pool_pymunk.cli.tradeoff import tradeoff
from pool_pymunk.safety.files import DEVICE_ERRORS, RenderError
from pool_pymunk.safety.interrupts import patient_interrupts

app = typer.Typer(
    name="pool-pymunk",
    help="2D billiards in pymunk, by the report's time slices, and exactly.",
    pretty_exceptions_enable=False,
)
COMMANDS = (
    run, collide, compare, tradeoff, sensitivity, fit, sweep, atlas, stability, render, page, play,
    check,
)  # fmt: skip
for command in COMMANDS:
    app.command()(command)

INTERRUPTED = 130

# Typer raises this for a command line that it cannot read; it exports only a subclass of it.
UsageError = cast(type[Exception], typer.BadParameter.__mro__[1])


@app.callback(invoke_without_command=True)
def _top(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        from pool_pymunk import __version__

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
    except (InputError, UsageError, RenderError) as error:
        _complain(str(error))
        return 2
    except ValueError as error:
        if not isinstance(error, lib.problems.SceneError | lib.problems.SettingError):
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
