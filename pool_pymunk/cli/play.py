"""This command opens a live table in the browser, on which one aims and shoots."""

from __future__ import annotations

import errno
import threading
import webbrowser
from contextlib import suppress
from importlib.util import find_spec

import typer

from pool_pymunk.cli.lines import InputError
from pool_pymunk.cli.options import PlayOptions
from pool_pymunk.model import scenario

NEEDED = ("starlette", "uvicorn")
MOST_PORT = 65_535  # of TCP


def play(asked: PlayOptions) -> int:
    """Serve the table until Ctrl-C."""
    if any(find_spec(name) is None for name in NEEDED):
        raise InputError("play: needs a server: pip install 'pool-pymunk[play]'")
    from pool_pymunk.page.live.server import LiveServer

    if not 0 <= asked.port <= MOST_PORT:
        raise InputError(f"--port = {asked.port}: must be from 0 to {MOST_PORT}")
    scene = scenario.load(asked.scenario)
    try:
        server = LiveServer(scene, asked.port)
    except OSError as error:
        used = error.errno == errno.EADDRINUSE
        why = "another program listens there" if used else error.strerror
        raise InputError(f"--port = {asked.port}: {why}") from None
    typer.echo(f"The table is at {server.address}")
    typer.echo("Ctrl-C ends it.")
    if asked.browser:
        threading.Thread(target=webbrowser.open, args=(server.address,), daemon=True).start()
    with suppress(KeyboardInterrupt):
        server.run()
    return 0
