"""This is the command line: each command has a file of its own, imported when it is called.

An error is printed with one line for each problem. The exit code is 0 for done, 1 for a run that
could not be finished (what was computed is kept), 2 for bad input, and 130 for interrupted (143 by
SIGTERM).
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from functools import cache, partial
from importlib import import_module
from inspect import cleandoc
from pathlib import Path
from textwrap import fill
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand

from pool_pymunk import __version__
from pool_pymunk.cli import options
from pool_pymunk.cli.lines import CORE, InputError
from pool_pymunk.core import compiled
from pool_pymunk.safety.files import DEVICE_ERRORS, RenderError, bundled, check_place
from pool_pymunk.safety.interrupts import interrupted_code, patient_interrupts

# The commands, each with an example.
COMMANDS = {
    "run": "report --tolerance 0.01in",
    "collide": "--mass-a 170g --mass-b 170g --radius 1.125in --velocity-a 2m/s 0 --offset 1in",
    "compare": "report --shot 4",
    "tradeoff": "report --out renders/tradeoff",
    "sensitivity": "report --shot 1 --angle-error 0.1deg",
    "fit": "report --measured published --free restitution.cue_ball",
    "sweep": "report --shot 1 --grid angle=-5:5:101 --out renders/sweep",
    "atlas": "report --shot 1 --ball C --size 400x300",
    "stability": "--quick",
    "render": "eight-ball --fps 60",
    "page": "report --shot 1",
    "play": "eight-ball",
    "check": "nine-ball",
    "worksheet": "--out worksheet.html",
}

# what a name ends in that is taken for a file's, where a folder must be named
FILES = (".csv", ".gif", ".html", ".json", ".mp4", ".npz", ".pdf", ".png", ".svg", ".toml")
# an argument of the library, perhaps one of its keys, as errors name it, before its value
ARGUMENT = r"^(\w+)(?:\['(.+)'\])?(?= = (.*?):)"
PLAY_NOTHING = ("collide", "check", "worksheet")
PLAIN = "Warning: the core is plain Python here, ten to twenty times slower than compiled."
# what serves now, where somebody types an option that was there before
GONE = {
    "--verbose": "--json FILE has steps and wall_time",
    "--help-all": "--help explains all options",
    "--threads": "--workers says how many processes play",
    "--chunk": "files have 50,000 shots each; in Python, sweep(chunk=) takes another number",
}


class _Command(TyperCommand):
    """A command reads its options, then imports its module and calls it.

    It checks its places for files first; errors of the library name options as typed.
    """

    def get_help(self, ctx: Any) -> str:
        """Return the help, without the braces and types that some versions of typer add."""
        whole: str = super().get_help(ctx)
        return whole.replace("{SCENARIO}", "SCENARIO").replace(" <str>", "")

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options; one that takes two values does not take the next option for one."""
        for option in self.params:
            for k, word in enumerate(args):
                values = args[k + 1 : k + 1 + option.nargs]
                if word in option.opts and option.nargs > 1 and any(map(is_option, values)):
                    raise UsageError(f"{word} = {values[0]}: needs two values, {option.metavar}")
        rest: list[str] = super().parse_args(ctx, args)
        return rest

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        for option in self.params:
            if isinstance(path := ctx.params[option.name], Path):
                if option.metavar == "DIR" and path.suffix in FILES and not path.is_dir():
                    message = "must be a folder, in which each file gets a name"
                    raise InputError(f"{option.opts[0]} = {path}: {message}")
                check_place(path, is_folder=option.metavar == "DIR")
        is_asked_for = os.environ.get("POOL_PYMUNK_PURE") == "1"
        if self.name not in PLAY_NOTHING and not compiled and not is_asked_for:
            print(PLAIN, file=sys.stderr)
        module = import_module(f"pool_pymunk.cli.{self.name}")
        try:
            with json_as_output(ctx.params):
                return getattr(module, str(self.name))(super().invoke(ctx))
        except _refusals() as error:
            typed = partial(self._typed, ctx.params)
            raise InputError(re.sub(ARGUMENT, typed, str(error), flags=re.M)) from None

    def _typed(self, given: Mapping[str, Any], found: re.Match[str]) -> str:
        """Return the option for an argument of the library; that of a list has the plural.

        That of an input is the one with which KEY=... of this input is typed.
        """
        name, key, value = found.groups()
        for option in self.params:
            texts = given[option.name] if str(option.metavar).startswith("KEY=") else ()
            texts = [texts] if isinstance(texts, str) else texts or ()
            if any(text.partition("=")[0].strip() == (key or value) for text in texts):
                return f"{option.opts[0]} {key}" if key else option.opts[0]
        options = {option.name: option.opts[0] for option in self.params}
        return options.get(name) or options.get(f"{name}s", found[0])


@contextmanager
def json_as_output(given: dict[str, Any]) -> Iterator[None]:
    """Print the JSON if its file is -; all else that the block prints is on stderr then."""
    if given.get("json") != Path("-"):
        yield
        return
    from tempfile import TemporaryDirectory  # Only who writes waits for it.

    with TemporaryDirectory() as folder:
        given["json"] = file = Path(folder, "results.json")
        try:
            with redirect_stdout(sys.stderr):
                yield
        finally:
            if file.exists():
                print(file.read_text(encoding="utf-8"), end="")


def is_option(word: str) -> bool:
    """Tell whether a word of a command line is the name of an option."""
    return word.startswith("--")


# The bundled scenarios are listed here, and no command lists them again.
TOP = (
    "Simulate billiards in two dimensions, and say how far to trust the result.\n\n"
    "A SCENARIO is a TOML file, or the name of one that is bundled:\n\n\b\n"
    + fill(", ".join(bundled()) + ".", 76, break_on_hyphens=False)
)

app = typer.Typer(
    name="pool-pymunk",
    help=TOP,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command, example in COMMANDS.items():
    asked = getattr(options, f"{command.capitalize()}Options")
    said = [" ".join(part.split()) for part in cleandoc(asked.__doc__).split("\n\n")]
    app.command(
        command,
        cls=_Command,
        help="\n\n".join(said),
        short_help=said[0],
        epilog=f"Example: pool-pymunk {command} {example}",
    )(asked)

INTERRUPTED = 130  # what typer returns after a KeyboardInterrupt
# what the value of an option must be, by the type of pydantic's error
WANTED = {"int_parsing": "must be a whole number", "float_parsing": "must be a number"}

# Typer raises this for a command line that it cannot read, but exports only a subclass.
UsageError = cast(type[Exception], typer.BadParameter.__mro__[1])


@app.callback(invoke_without_command=True)
def _top(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version, and whether the core is compiled.")
    ] = False,
) -> None:
    if version:
        typer.echo(f"{__version__}\n{CORE}")
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())


@cache
def _commands() -> Any:
    """Return the commands with their options, which a process makes once."""
    return typer.main.get_command(app)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit."""
    sys.exit(_exit_code(arguments))


@contextmanager
def _plain_warnings() -> Iterator[None]:
    """Print each warning of this project once, as one plain line without a place in its source."""
    said, usual = set[str](), warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *where: Any) -> None:
        text = str(message)
        if category is not UserWarning:
            usual(message, category, *where)
        elif text not in said:
            said.add(text)
            print(f"Warning: {text}.", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.showwarning = show  # type: ignore[assignment]
        yield


def _exit_code(arguments: list[str] | None) -> int:
    try:
        with patient_interrupts(), _plain_warnings():
            code: int = _commands()(arguments, "pool-pymunk", standalone_mode=False) or 0
    except KeyboardInterrupt:
        code = INTERRUPTED
    except (ValueError, UsageError, RenderError) as error:
        if isinstance(error, ValueError) and not isinstance(error, _refusals()):
            raise
        _complain(_named(error))
        return 2
    except BrokenPipeError:  # the reader of our output left, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        _complain(f"{error.filename or 'file'}: {error.strerror or error}")
        return 1 if error.errno in DEVICE_ERRORS else 2  # the disk failed, or the place is bad
    if code == INTERRUPTED:
        _complain("interrupted")
        code = interrupted_code()
    return code


def _refusals() -> tuple[type[Exception], ...]:
    """Return the errors for bad input; an answer to --help does not wait for the library's."""
    from pool_pymunk.model.problems import SceneError, SettingError

    return InputError, RenderError, SceneError, SettingError


def _named(error: Exception) -> str:
    """Return the message of an error; if it is about an option, name it and the typed value."""
    if (gone := getattr(error, "option_name", None)) in GONE:
        return f"{gone}: is no more: {GONE[gone]}"
    option: Any = getattr(error, "param", None)
    if option is None:
        from pool_pymunk.model.problems import most_like

        known = {name.lstrip("-"): name for name in getattr(error, "possibilities", None) or ()}
        alike = most_like(str(gone).lstrip("-"), known)
        return f'{error}; did you mean "{known[alike]}"?' if alike else str(error)
    name = option.opts[0]
    if "Missing" in type(error).__name__:
        return f"{name}: is missing"
    found: Any = getattr(error.__cause__, "errors", list)()
    if not found:
        return f"{name}: {error}"
    wrong = found[0]
    return f"{name} = {wrong['input']}: {WANTED.get(wrong['type'], error)}"


def _complain(text: str) -> None:
    for line in text.splitlines() or [""]:
        print(line if line.startswith("error") else f"error: {line}", file=sys.stderr)
