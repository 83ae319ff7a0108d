"""This command opens a live table in the browser, on which one aims and shoots."""

from __future__ import annotations

import errno
import threading
import webbrowser
from importlib.util import find_spec
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt, read

NEEDED = ("starlette", "uvicorn")
MOST_PORT = 65_535  # of TCP


def play(
    scenario: opt.Scenario,
    port: Annotated[int, opt.option("Listen on this port; 0: a free one.", "P")] = 0,
    browser: Annotated[bool, opt.option("Open the page in a browser.")] = True,
) -> int:
    """Play on a live table in the browser: aim, shoot, and see what the step costs.

    The table listens on this machine only, at the address that is printed. Ctrl-C ends it.
    """
    if any(find_spec(name) is None for name in NEEDED):
        raise read.InputError("play: needs a server: pip install 'pool-pymunk[play]'")
    if not 0 <= port <= MOST_PORT:
        raise read.InputError(f"--port = {port}: must be from 0 to {MOST_PORT}")
    scene = lib.scenario.load(scenario)
    try:
        server = lib.server.LiveServer(scene, port)
    except OSError as error:
        used = error.errno == errno.EADDRINUSE
        why = "another program listens there" if used else error.strerror
        raise read.InputError(f"--port = {port}: {why}") from None
    typer.echo(f"The table is at {server.address}")
    typer.echo("Ctrl-C ends it.")
    if browser:
        threading.Thread(target=webbrowser.open, args=(server.address,), daemon=True).start()
    server.run()
    return 0
