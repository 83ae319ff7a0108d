"""The options of all commands, and the words that they take.

A command's options are a dataclass, which says in its docstring what the command does. What several
commands have is a dataclass of its own, from which theirs are derived. --help must come at once, so
no slow module is imported here: of the library, only laws and files. tests/cli/test_cli_manners.py
compares the words of other modules with the library.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
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


def option(says: str, metavar: str | None = None, *names: str, words: Iterable[str] = ()) -> Any:
    """Declare an option: its help, what stands for its value, its names, and words it may take."""
    complete = among(words) if words else None
    return typer.Option(*names, metavar=metavar, help=says, autocompletion=complete)


@dataclass_transform(kw_only_default=True)
class Options:
    """Classes that are derived from this one are dataclasses, whose fields are options."""

    def __init_subclass__(cls) -> None:
        dataclass(kw_only=True)(cls)


# -- what several commands have --------------------------------------------------------------------


class OfScenario(Options):
    """A scenario has what is played."""

    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            help="A file, or a bundled name (pool-pymunk --help).",
            autocompletion=among(bundled()),  # Where none begins as typed, shells offer files.
        ),
    ]


class OfShot(OfScenario):
    """One shot may be chosen."""

    shot: Annotated[str | None, option("One shot only: its number or its name.", "K")] = None


class Asked(OfShot):
    """The scenario's law and its latest time may be replaced."""

    law: Annotated[
        str | None, option("Contact law, instead of the scenario's.", "|".join(LAWS), words=LAWS)
    ] = None
    max_time: Annotated[str | None, option("End each shot at this time (s).", "S")] = None


class AnySolver(Asked):
    """Any solver may play, and this is how."""

    friction: Annotated[
        str | None,
        option(
            "How solvers in a space apply surface friction; default: joint, if it has that.",
            "|".join(FRICTION), words=FRICTION,
        ),
    ] = None  # fmt: skip
    contact_tolerance: Annotated[
        str | None,
        option(
            "How far what the exact solver leaves out where balls stay in contact may move a ball; "
            "default: 1e-7m. Without a unit it is in the scenario's.", "LENGTH",
        ),
    ] = None  # fmt: skip


class Stepped(AnySolver):
    """Solvers that have a step have this one."""

    dt: Annotated[str | None, option("Time step in s, e.g. 1e-4 or 1/240.", "DT")] = None


class BySolver(Stepped):
    """One solver plays."""

    solver: Annotated[str, option(f"One of {SOLVER_NAMES}.", "SOLVER", words=SOLVERS)] = "pymunk"


class BySolvers(AnySolver):
    """Several solvers play."""

    solvers: Annotated[
        str | None,
        option(
            f"Some of {SOLVER_NAMES}, each with :DT or without, or all; default: all but the "
            "report's slices of 1e-6 s.", "S[:DT],...", words=SOLVERS,
        ),
    ] = None  # fmt: skip


class Aimed(Options):
    """Many shots are aimed once, or each by itself."""

    aims_anew: Annotated[
        bool,
        option(
            "Aim again wherever the ball lies; default: aim once, as the scenario is.", None,
            "--aim-anew",
        ),
    ] = False  # fmt: skip


class Seeded(Options):
    """Numbers are drawn at random."""

    seed: Annotated[int, option("Seed of the random numbers.", "N")] = 0


class Uncertain(Seeded):
    """Starts are uncertain."""

    position_error: Annotated[
        str | None,
        option("Half-width of each start's error; default: half its last digit.", "LENGTH"),
    ] = None


class Shared(Options):
    """Many shots are shared out among processes."""

    workers: Annotated[int | None, option("Processes; default: one per core.", "N")] = None
    cluster: Annotated[
        str | None, option("A Dask scheduler: tcp://host:8786.", "ADDRESS")
    ] = None  # fmt: skip


class InFolder(Options):
    """Files go to a folder."""

    out: Annotated[Path | None, option("The folder for the files.", "DIR")] = None


class WithJson(Options):
    """The results may also be a JSON file."""

    json: Annotated[Path | None, option("Write the results to this JSON file.", "FILE")] = None


# -- the commands ----------------------------------------------------------------------------------


class RunOptions(InFolder, WithJson, BySolver):
    """Simulate every shot: the log, agreement with published ends, pictures and data.

    Files go to renders/<scenario>: for each shot its start and end as pictures, times, positions
    and velocities as npz and CSV, and the events as CSV, with --contacts also the contacts. If the
    command ends early, it keeps the files of the shots that were finished.
    """

    tolerance: Annotated[
        str | None, option("Choose a step whose ends are within this error: 0.01in.", "LENGTH")
    ] = None
    pictures: Annotated[bool, option("Draw the start and end of each shot.")] = True
    contacts: Annotated[
        bool,
        option("Also print each contact: place, impulses, velocities, energy.", None, "--contacts"),
    ] = False
    against: Annotated[
        str | None, option("List only ends that differ from those of a run there.", "FOLDER")
    ] = None
    show: Annotated[
        str | None, option("Draw energy and momentum over time, too.", "energy")
    ] = None  # fmt: skip
    units: Annotated[
        str, option(f'The units of the CSV: "scene", or some of {KNOWN}.', "U,...")
    ] = "m,kg,m/s"


class CollideOptions(WithJson):
    """Two balls meet at an offset: velocities, impulses, momentum and energy before and after.

    A's path is the straight line on which A comes, as seen from B. Numbers may have units: 200g,
    2.25in, 2m/s; numbers without a unit are in those of --units.
    """

    mass_a: Annotated[str, option("The mass of ball A.", "MASS")]
    mass_b: Annotated[str, option("The mass of ball B.", "MASS")]
    radius: Annotated[str, option("The radius of both balls.", "LENGTH")]
    velocity_a: Annotated[tuple[str, str], option("The velocity of ball A.", "VX VY")]
    velocity_b: Annotated[tuple[str, str], option("The velocity of ball B.", "VX VY")] = ("0", "0")
    radius_b: Annotated[
        str | None, option("The radius of ball B, if it differs.", "LENGTH")
    ] = None  # fmt: skip
    offset: Annotated[str, option("How far B's centre lies left of A's path.", "LENGTH")] = "0"
    angle: Annotated[
        str | None, option("Direction from A to B in touch, instead of an offset.", "DEGREES")
    ] = None
    restitution: Annotated[float, option("Coefficient of restitution.")] = 1.0
    friction: Annotated[float, option("Coefficient of friction.")] = 0.0
    law: Annotated[str, option("Contact law.", "|".join(LAWS), words=LAWS)] = "coulomb"
    units: Annotated[
        str, option(f"Units of numbers without one, and of the output: {KNOWN}.", "U,...")
    ] = "m,kg,m/s"
    picture: Annotated[Path | None, option("A png, svg or pdf file.", "FILE")] = None


class CompareOptions(InFolder, WithJson, Stepped, BySolvers):
    """Play every shot with several solvers; show the ends, and where runs first diverge."""

    pictures: Annotated[bool, option("Draw each run over the exact one.")] = True


class TradeoffOptions(InFolder, WithJson, Uncertain, BySolvers):
    """Work and precision: the error and the time of each solver and step on this scene.

    Writes tradeoff.csv, tradeoff.png and tradeoff.svg (contact-tolerance.csv and so on, if
    tolerances are measured) to renders/<scenario>, after Ctrl-C with what was measured.
    """

    contact_tolerance: Annotated[
        str | None,
        option(
            "Measure the exact solver at these tolerances of contacts that persist, in place of "
            "solvers and steps. Without a unit they are in the scenario's.", "LENGTH,...",
        ),
    ] = None  # fmt: skip
    budget: Annotated[float, option("About this time (s) for all repeated runs.", "S")] = 10.0
    samples: Annotated[
        int, option("Perturbed starts, for the effect of rounded inputs.", "N")
    ] = 1000  # fmt: skip


class SensitivityOptions(InFolder, WithJson, Aimed, Shared, Uncertain, OfShot):
    """Where may balls end if starts, and on request speed and angle, are uncertain?

    An error is typed as half the width of a uniform distribution; the ends are printed with their
    standard deviations. A length or speed may have a unit (0.1mm); without one it is in that of the
    scenario. Where several inputs are uncertain, each is also varied alone.
    """

    workers: Annotated[
        int | None, option("Processes; default: one per core.", "N", "--workers", "--processes")
    ] = None
    speed_error: Annotated[str, option("Half-width of the shot's speed.", "SPEED")] = "0"
    angle_error: Annotated[str, option("Half-width of the shot's angle.", "DEGREES")] = "0"
    samples: Annotated[int, option("Runs of each shot.", "N")] = 1000
    pictures: Annotated[bool, option("Draw the cloud of ends of every ball.")] = True
    by_derivatives: Annotated[
        bool,
        option(
            "Also use derivatives, and say how far they hold; --samples 0: only these.",
            None, "--linear",
        ),
    ] = False  # fmt: skip


class FitOptions(WithJson, Aimed, Seeded, OfScenario):
    """Fit numbers of a scenario to measured ends or tracks, with standard errors.

    Lengths of the file are in the scenario's unit. A row without t is an end. The command writes
    the new scenario, a table of residuals and their picture, and keeps those of earlier fits.
    """

    measured: Annotated[
        str, option('Columns: shot, ball, x, y, optionally t (s); or "published".', "FILE.csv")
    ]
    free: Annotated[
        str, option("Fit these inputs: restitution,friction or speed.2,mass.8.", "NAME,...")
    ]
    error: Annotated[
        str | None,
        option("Standard deviation of one measured coordinate; default: estimated.", "LENGTH"),
    ] = None
    starts: Annotated[int, option("Number of starts of the fit.", "N")] = 8
    out: Annotated[
        Path | None, option("Default: renders/<scenario>/fit, fit-2, ...", "DIR")
    ] = None  # fmt: skip
    force: Annotated[bool, option("Replace a fit that is there.", None, "--force")] = False
    pictures: Annotated[bool, option("Draw the residuals.")] = True


class SweepOptions(Aimed, Shared, Seeded, Asked):
    """Play many shots into a Parquet dataset; the same command resumes a sweep.

    Keys: speed, angle or turn (degrees, relative to the shot's), roll, mass (of the struck ball),
    restitution.*, friction.*, x.ID, y.ID, vx.ID, vy.ID, mass.ID, radius.ID; start (every ball, by
    up to WIDTH), noise.speed and noise.angle (standard deviations of the player's errors).
    Lengths, speeds and masses may have a unit (0.005in); without one they are in the scenario's.
    """

    out: Annotated[Path, option("Where the dataset goes.", "DIR")]
    vary: Annotated[
        list[str] | None,
        option("Vary this at random; start and noise: KEY=WIDTH.", "KEY=LOW:HIGH"),
    ] = None
    grid: Annotated[
        list[str] | None, option("Vary this in even steps.", "KEY=LOW:HIGH:COUNT")
    ] = None  # fmt: skip
    samples: Annotated[
        int | None, option("Number of shots; default: the whole grid.", "N")
    ] = None  # fmt: skip
    restart: Annotated[bool, option("Replace what is there.", None, "--restart")] = False


class AtlasOptions(Aimed, Shared, Asked):
    """Draw the results of a shot at every angle and speed: each pixel is an exact shot.

    Narrower ranges show where the result is fractal, and where it is safe. --across and --up take
    the keys of a sweep, such as mass.8 or restitution.cushion.
    """

    angle: Annotated[str, option("Degrees, from the shot's angle.", "LOW:HIGH")] = "-30:30"
    speed: Annotated[
        str | None, option("Speeds; default: 0.25 to 1.5 of the shot's.", "LOW:HIGH")
    ] = None
    across: Annotated[str | None, option("Vary this, not the angle.", "KEY=LOW:HIGH")] = None
    up: Annotated[str | None, option("Vary this, not the speed.", "KEY=LOW:HIGH")] = None
    size: Annotated[str, option("Pixels; each is a shot.", "WxH")] = "1200x800"
    ball: Annotated[
        str | None, option("Draw this ball's end; default: the one aimed at or nearest.", "ID")
    ] = None
    show: Annotated[str, option("What is drawn.", "|".join(SHOWS))] = "end"
    out: Annotated[Path | None, option("A png, svg or pdf file.", "FILE")] = None


class StabilityOptions(InFolder):
    """Play extreme scenes: which solver breaks, by how much, and from which case on.

    Writes stability.csv and stability.svg to renders/stability, after Ctrl-C with what was played.
    """

    quick: Annotated[bool, option("Fewer cases and steps.", None, "--quick")] = False
    solvers: Annotated[
        str | None, option(f"Some of {SOLVER_NAMES}; default: all.", "S,...", words=SOLVERS)
    ] = None
    processes: Annotated[int, option("Number of processes.", "N")] = 2


class RenderOptions(InFolder, BySolver):
    """Film every shot and draw its start and end.

    Files go to renders/<scenario>: for each shot a film and two pictures, and a film of all shots.
    A scenario to compare with must have the same table, and balls of the same ids and sizes; words
    say what differs (render soft.toml --side-by-side hard.toml).
    """

    other: Annotated[
        str | None,
        typer.Argument(metavar="OTHER", help="A scenario to compare with, as with --overlay."),
    ] = None
    overlay: Annotated[
        str | None,
        option("Compare with this solver or scenario, shown as a ghost.", COMPARED),
    ] = None
    side_by_side: Annotated[
        bool, option("Show the two runs on two tables.", None, "--side-by-side")
    ] = False
    films: Annotated[bool, option("Film each shot, and all shots in one film.")] = True
    form: Annotated[str, option("Format of the films.", "|".join(FILMS), "--format")] = "mp4"
    size: Annotated[
        str | None, option("Pixels; default: 1600x900, gif: 800x450.", "WxH")
    ] = None  # fmt: skip
    fps: Annotated[float | None, option("Frames a second; default: 60, gif: 25.")] = None
    slow: Annotated[float, option("Slower than life by this factor.")] = 1.0
    start: Annotated[float, option("Film from this time on (s).", None, "--from")] = 0.0
    end: Annotated[
        float | None, option("Film up to this time (s; default: to the end).", None, "--to")
    ] = None
    pictures: Annotated[bool, option("Draw the start and end of each shot.")] = True
    picture_format: Annotated[str, option("Their format.", "|".join(PICTURES))] = "png"
    dpi: Annotated[float, option("Dots per inch of a png, which is 10 in wide.")] = 200.0


class PageOptions(BySolver):
    """Make a page that plays every shot: one HTML file that needs nothing else.

    The page has the exact paths between contacts. Stop it, go from contact to contact, slow it
    down a hundred times, and see other runs as ghosts. A scenario to compare with must have the
    same table, and balls of the same ids and sizes; the page names it by its title. With --predict
    a class says where balls will go before the page shows it.
    """

    overlay: Annotated[
        list[str] | None,
        option("Compare with this solver, or with this scenario; may be repeated.", COMPARED),
    ] = None
    predict: Annotated[
        bool, option("Stop before the first contact, and ask for the rest.", None, "--predict")
    ] = False
    out: Annotated[
        Path | None, option("Default: page.html in renders/<scenario>.", "FILE.html")
    ] = None  # fmt: skip


class PlayOptions(OfScenario):
    """Play on a live table in the browser: aim, shoot, and see what the step costs.

    The table listens on this machine only, at the address that is printed. Ctrl-C ends it.
    """

    port: Annotated[int, option("Listen on this port; 0: a free one.", "P")] = 0
    browser: Annotated[bool, option("Open the page in a browser.")] = True


def _print_schema(is_asked: bool) -> None:
    if is_asked:
        from pool_pymunk.model.schema import scenario_schema

        print(json.dumps(scenario_schema(), indent=2, ensure_ascii=False))
        raise typer.Exit


class CheckOptions(OfScenario):
    """Validate a scenario, and say what will be modelled, what will not, and its sizes."""

    schema: Annotated[
        bool,
        typer.Option(
            "--schema",
            help="Print the JSON schema of scenario files, for editors, and no more.",
            is_eager=True,
            callback=_print_schema,
        ),
    ] = False
