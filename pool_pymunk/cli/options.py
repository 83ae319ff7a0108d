"""The options of all commands, and the words that they take.

A command's options are a dataclass, which says in its docstring what the command does. What several
commands have is a dataclass of its own, from which theirs are derived. --help must come at once, so
no slow module is imported here: of the library, only laws and files. tests/cli/test_cli_manners.py
compares the words of other modules with the library.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, dataclass_transform

import typer

from pool_pymunk.laws import LAWS
from pool_pymunk.safety.files import bundled

SOLVERS = ("pymunk", "pymunk-discrete", "pymunk-builtin", "event-driven", "time-slice")
FRICTION = ("joint", "callback")
FILMS = ("mp4", "gif")
PICTURES = ("png", "svg", "pdf")
SHOWS = ("end", "first-hit", "hits", "pocket", "duration")
UNITS = {"length": ("m", "cm", "mm", "in"), "mass": ("kg", "g"), "speed": ("m/s", "in/s")}
KNOWN = ", ".join("|".join(units) for units in UNITS.values())
SOLVER_NAMES = ", ".join(SOLVERS)
COMPARED = "SOLVER[:DT][:LAW]|SCENARIO"


def among(words: Iterable[str]) -> Callable[[str], list[str]]:
    """Return a function that finds the words that begin as the last one of a list with commas."""

    def complete(incomplete: str) -> list[str]:
        before, comma, last = incomplete.rpartition(",")
        return [before + comma + word for word in words if word.startswith(last)]

    return complete


def typed(what: Any, default: Any = ...) -> Any:
    """Declare what is typed, an option or an argument, and its default; without one it must be."""
    return field(default=MISSING if default is ... else default, metadata={"typed": what})


def option(
    says: str, metavar: str | None = None, *names: str, default: Any = None,
    words: Iterable[str] = (),
) -> Any:  # fmt: skip
    """Declare an option: its help, what stands for its value, its names, and words it may take."""
    complete = among(words) if words else None
    return typed(typer.Option(*names, metavar=metavar, help=says, autocompletion=complete), default)


def flag(says: str, name: str) -> Any:
    """Declare an option that is there or not: its help, and its name."""
    return option(says, None, name, default=False)


@dataclass_transform(kw_only_default=True)
class Options:
    """Classes that are derived from this one are dataclasses, whose fields are options."""

    def __init_subclass__(cls) -> None:
        dataclass(kw_only=True)(cls)
        annotated: Any = Annotated  # Its types are known only here.
        for each in fields(cls):  # type: ignore[arg-type]  # It is a dataclass now.
            own = annotated[each.type, each.metadata["typed"]]
            cls.__init__.__annotations__[each.name] = own


# -- what several commands have --------------------------------------------------------------------


class OfScenario(Options):
    """A scenario has what is played."""

    scenario: str = typed(
        typer.Argument(
            metavar="SCENARIO",
            help="A file, or a bundled name (pool-pymunk --help).",
            autocompletion=among(bundled()),  # Where none begins as typed, shells offer files.
        )
    )


class OfShot(OfScenario):
    """One shot may be chosen."""

    shot: str | None = option("One shot only: its number or its name.", "K")


class Asked(OfShot):
    """The scenario's law and its latest time may be replaced."""

    law: str | None = option("Contact law, instead of the scenario's.", "|".join(LAWS), words=LAWS)
    max_time: str | None = option("End each shot at this time (s).", "S")


class AnySolver(Asked):
    """Any solver may play, and this is how."""

    friction: str | None = option(
        "How solvers in a space apply surface friction; default: joint, if it has that.",
        "|".join(FRICTION),
        words=FRICTION,
    )
    contact_tolerance: str | None = option(
        "How far what the exact solver leaves out where balls stay in contact may move a ball; "
        "default: 1e-7m. Without a unit it is in the scenario's.",
        "LENGTH",
    )


class Stepped(AnySolver):
    """Solvers that have a step have this one."""

    dt: str | None = option("Time step in s, e.g. 1e-4 or 1/240.", "DT")


class BySolver(Stepped):
    """One solver plays."""

    solver: str = option(f"One of {SOLVER_NAMES}.", "SOLVER", words=SOLVERS, default="pymunk")


class BySolvers(AnySolver):
    """Several solvers play."""

    solvers: str | None = option(
        f"Some of {SOLVER_NAMES}, each with :DT or without, or all; default: all but the "
        "report's slices of 1e-6 s.",
        "S[:DT],...",
        words=SOLVERS,
    )


class Aimed(Options):
    """Many shots are aimed once, or each by itself."""

    aims_anew: bool = flag(
        "Aim again wherever the ball lies; default: aim once, as the scenario is.", "--aim-anew"
    )


class Seeded(Options):
    """Numbers are drawn at random."""

    seed: int = option("Seed of the random numbers.", "N", default=0)


class Uncertain(Seeded):
    """Starts are uncertain."""

    position_error: str | None = option(
        "Half-width of each start's error; default: half its last digit.", "LENGTH"
    )


class Shared(Options):
    """Many shots are shared out among processes."""

    workers: int | None = option("Processes; default: one per core.", "N")
    cluster: str | None = option("A Dask scheduler: tcp://host:8786.", "ADDRESS")


class InFolder(Options):
    """Files go to a folder."""

    out: Path | None = option("The folder for the files.", "DIR")


class WithJson(Options):
    """The results may also be a JSON file."""

    json: Path | None = option(
        "Write the results to this JSON file; - prints them, and the log to stderr.", "FILE"
    )


# -- the commands ----------------------------------------------------------------------------------


class RunOptions(InFolder, WithJson, BySolver):
    """Simulate every shot: the log, agreement with published ends, pictures and data.

    Files go to renders/<scenario>: for each shot its start and end as pictures, times, positions
    and velocities as npz and CSV, and the events as CSV, with --contacts also the contacts. If the
    command ends early, it keeps the files of the shots that were finished.
    """

    tolerance: str | None = option(
        "Choose a step whose ends are within this error: 0.01in.", "LENGTH"
    )
    pictures: bool = option("Draw the start and end of each shot.", default=True)
    contacts: bool = flag(
        "Also print each contact: place, impulses, velocities, energy.", "--contacts"
    )
    against: str | None = option("List only ends that differ from those of a run there.", "FOLDER")
    show: str | None = option("Draw energy and momentum over time, too.", "energy")
    units: str = option(
        f'The units of the CSV: "scene", or some of {KNOWN}.', "U,...", default="m,kg,m/s"
    )


class CollideOptions(WithJson):
    """Two balls meet at an offset: velocities, impulses, momentum and energy before and after.

    A's path is the straight line on which A comes, as seen from B. Numbers may have units: 200g,
    2.25in, 2m/s; numbers without a unit are in those of --units.
    """

    mass_a: str = option("The mass of ball A.", "MASS", default=...)
    mass_b: str = option("The mass of ball B.", "MASS", default=...)
    radius: str = option("The radius of both balls.", "LENGTH", default=...)
    velocity_a: tuple[str, str] = option("The velocity of ball A.", "VX VY", default=...)
    velocity_b: tuple[str, str] = option("The velocity of ball B.", "VX VY", default=("0", "0"))
    radius_b: str | None = option("The radius of ball B, if it differs.", "LENGTH")
    offset: str = option("How far B's centre lies left of A's path.", "LENGTH", default="0")
    angle: str | None = option("Direction from A to B in touch, instead of an offset.", "DEGREES")
    restitution: float = option("Coefficient of restitution.", default=1.0)
    friction: float = option("Coefficient of friction.", default=0.0)
    law: str = option("Contact law.", "|".join(LAWS), words=LAWS, default="coulomb")
    units: str = option(
        f"Units of numbers without one, and of the output: {KNOWN}.", "U,...", default="m,kg,m/s"
    )
    picture: Path | None = option("A png, svg or pdf file.", "FILE")


class CompareOptions(InFolder, WithJson, Stepped, BySolvers):
    """Play every shot with several solvers; show the ends, and where runs first diverge."""

    pictures: bool = option("Draw each run over the exact one.", default=True)


class TradeoffOptions(InFolder, WithJson, Uncertain, BySolvers):
    """Work and precision: the error and the time of each solver and step on this scene.

    Writes tradeoff.csv, tradeoff.png and tradeoff.svg (contact-tolerance.csv and so on, if
    tolerances are measured) to renders/<scenario>, after Ctrl-C with what was measured.
    """

    contact_tolerance: str | None = option(
        "Measure the exact solver at these tolerances of contacts that persist, in place of "
        "solvers and steps. Without a unit they are in the scenario's.",
        "LENGTH,...",
    )
    budget: float = option("About this time (s) for all repeated runs.", "S", default=10.0)
    samples: int = option("Perturbed starts, for the effect of rounded inputs.", "N", default=1000)


class SensitivityOptions(InFolder, WithJson, Aimed, Shared, Uncertain, OfShot):
    """Where may balls end if starts, and on request speed and angle, are uncertain?

    An error is typed as half the width of a uniform distribution; the ends are printed with their
    standard deviations. A length or speed may have a unit (0.1mm); without one it is in that of the
    scenario. Where several inputs are uncertain, each is also varied alone.
    """

    workers: int | None = option(
        "Processes; default: one per core.", "N", "--workers", "--processes"
    )
    speed_error: str = option("Half-width of the shot's speed.", "SPEED", default="0")
    angle_error: str = option("Half-width of the shot's angle.", "DEGREES", default="0")
    input_error: list[str] | None = option(
        "Half-width of another input, such as restitution.cushion or mass.8.", "KEY=WIDTH"
    )
    samples: int = option("Runs of each shot.", "N", default=1000)
    pictures: bool = option("Draw the cloud of ends of every ball.", default=True)
    by_derivatives: bool = flag(
        "Also use derivatives, and say how far they hold; --samples 0: only these.", "--linear"
    )


class FitOptions(WithJson, Aimed, Seeded, OfScenario):
    """Fit numbers of a scenario to measured ends or tracks, with standard errors.

    Lengths of the file are in the scenario's unit. A row without t is an end. The command writes
    the new scenario, a table of residuals and their picture, and keeps those of earlier fits.
    """

    measured: str = option(
        'Columns: shot, ball, x, y, optionally t (s); or "published".', "FILE.csv", default=...
    )
    free: str = option(
        "Fit these inputs: restitution,friction or speed.2,mass.8.", "NAME,...", default=...
    )
    error: str | None = option(
        "Standard deviation of one measured coordinate; default: estimated.", "LENGTH"
    )
    starts: int = option("Number of starts of the fit.", "N", default=8)
    out: Path | None = option("Default: renders/<scenario>/fit, fit-2, ...", "DIR")
    force: bool = flag("Replace a fit that is there.", "--force")
    pictures: bool = option("Draw the residuals.", default=True)


class SweepOptions(Aimed, Shared, Seeded, Asked):
    """Play many shots into a Parquet dataset; the same command resumes a sweep.

    Keys: speed, angle or turn (degrees, relative to the shot's), roll, mass (of the struck ball),
    restitution.*, friction.*, x.ID, y.ID, vx.ID, vy.ID, mass.ID, radius.ID; start (every ball, by
    up to WIDTH), noise.speed and noise.angle (standard deviations of the player's errors).
    Lengths, speeds and masses may have a unit (0.005in); without one they are in the scenario's.
    """

    out: Path = option("Where the dataset goes.", "DIR", default=...)
    vary: list[str] | None = option(
        "Vary this at random; start and noise: KEY=WIDTH.", "KEY=LOW:HIGH"
    )
    grid: list[str] | None = option("Vary this in even steps.", "KEY=LOW:HIGH:COUNT")
    samples: int | None = option("Number of shots; default: the whole grid.", "N")
    restart: bool = flag("Replace what is there.", "--restart")


class AtlasOptions(Aimed, Shared, Asked):
    """Draw the results of a shot at every angle and speed: each pixel is an exact shot.

    Narrower ranges show where the result is fractal, and where it is safe. --across and --up take
    the keys of a sweep, such as mass.8 or restitution.cushion. The pixels are played from coarse to
    fine; if they take long, and after Ctrl-C, the picture has what was played.
    """

    angle: str = option("Degrees, from the shot's angle.", "LOW:HIGH", default="-30:30")
    speed: str | None = option("Speeds; default: 0.25 to 1.5 of the shot's.", "LOW:HIGH")
    across: str | None = option("Vary this, not the angle.", "KEY=LOW:HIGH")
    up: str | None = option("Vary this, not the speed.", "KEY=LOW:HIGH")
    size: str = option("Pixels; each is a shot.", "WxH", default="1200x800")
    ball: str | None = option("Draw this ball's end; default: the one aimed at or nearest.", "ID")
    show: str = option("What is drawn.", "|".join(SHOWS), default="end")
    out: Path | None = option("A png, svg or pdf file.", "FILE")


class StabilityOptions(InFolder):
    """Play extreme scenes: which solver breaks, by how much, and from which case on.

    With --quick it takes three minutes on two cores, and much longer without. Writes stability.csv
    and stability.svg to renders/stability, after Ctrl-C with what was played.
    """

    quick: bool = flag("Fewer cases and steps.", "--quick")
    solvers: str | None = option(f"Some of {SOLVER_NAMES}; default: all.", "S,...", words=SOLVERS)
    processes: int = option("Number of processes.", "N", default=2)


class RenderOptions(InFolder, BySolver):
    """Film every shot and draw its start and end.

    Files go to renders/<scenario>: for each shot a film and two pictures, and a film of all shots.
    A scenario to compare with must have the same table, and balls of the same ids and sizes; words
    say what differs (render soft.toml --side-by-side hard.toml).
    """

    other: str | None = typed(
        typer.Argument(metavar="OTHER", help="A scenario to compare with, as with --overlay."), None
    )
    overlay: str | None = option(
        "Compare with this solver or scenario, shown as a ghost.", COMPARED
    )
    side_by_side: bool = flag("Show the two runs on two tables.", "--side-by-side")
    films: bool = option("Film each shot, and all shots in one film.", default=True)
    form: str = option("Format of the films.", "|".join(FILMS), "--format", default="mp4")
    size: str | None = option("Pixels; default: 1600x900, gif: 800x450.", "WxH")
    fps: float | None = option("Frames a second; default: 60, gif: 25.")
    slow: float = option("Slower than life by this factor.", default=1.0)
    start: float = option("Film from this time on (s).", None, "--from", default=0.0)
    end: float | None = option("Film up to this time (s; default: to the end).", None, "--to")
    pictures: bool = option("Draw the start and end of each shot.", default=True)
    picture_format: str = option("Their format.", "|".join(PICTURES), default="png")
    dpi: float = option("Dots per inch of a png, which is 10 in wide.", default=200.0)


class PageOptions(BySolver):
    """Make a page that plays every shot: one HTML file that needs nothing else.

    The page has the exact paths between contacts. Stop it, go from contact to contact, slow it
    down a hundred times, and see other runs as ghosts. A scenario to compare with must have the
    same table, and balls of the same ids and sizes; the page names it by its title. With --predict
    a class says where balls will go before the page shows it.
    """

    overlay: list[str] | None = option(
        "Compare with this solver, or with this scenario; may be repeated.", COMPARED
    )
    predict: bool = flag("Stop before the first contact, and ask for the rest.", "--predict")
    out: Path | None = option("Default: page.html in renders/<scenario>.", "FILE.html")


class PlayOptions(OfScenario):
    """Play on a live table in the browser: aim, shoot, and see what the step costs.

    The table listens on this machine only, at the address that is printed. Ctrl-C ends it.
    """

    port: int = option("Listen on this port; 0: a free one.", "P", default=0)
    browser: bool = option("Open the page in a browser.", default=True)


class WorksheetOptions(Options):
    """Write eleven exercises on collisions as one HTML file, to be printed: an exercise a sheet."""

    answers: bool = flag("Write the answers instead.", "--answers")
    out: Path | None = option("Default: renders/worksheet.html, or -answers.html.", "FILE.html")


def _print_schema(is_asked: bool) -> None:
    if is_asked:
        from pool_pymunk.model.schema import scenario_schema

        print(json.dumps(scenario_schema(), indent=2, ensure_ascii=False))
        raise typer.Exit


class CheckOptions(OfScenario):
    """Validate a scenario, and say what will be modelled, what will not, and its sizes."""

    schema: bool = typed(
        typer.Option(
            "--schema",
            help="Print the JSON schema of scenario files, for editors, and no more.",
            is_eager=True,
            callback=_print_schema,
        ),
        False,
    )
