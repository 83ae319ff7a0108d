"""This module is the server of the live table: it listens on this machine only, and keeps nothing.

Two processes answer: one plays shots, the other clouds, so that a cloud never keeps a shot waiting.
Any page in this machine's browser can send requests here, under any name that leads to this
machine. So the host must be this machine's own name, the origin the table's own page, and every
request must know the token that was printed.
"""

from __future__ import annotations

import asyncio
import hmac
import secrets
import signal
import socket
import time
from collections.abc import Awaitable, Callable
from types import FrameType

import uvicorn
from anyio import to_thread
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.base import BaseHTTPMiddleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from pool_pymunk.model import Scene
from pool_pymunk.page.document import document
from pool_pymunk.page.live.answers import QUESTIONS, Reply, live_content, refusal
from pool_pymunk.page.live.worker import Worker
from pool_pymunk.safety.interrupts import raise_pending, uninterrupted

HOST = "127.0.0.1"
ANSWER_TIMEOUT = 5.0  # s; an answer that takes longer is cut off, and so is a question
MOST_CONNECTIONS = 64  # at once; uvicorn answers 503 to more
# most bytes of a question, and more bytes for each ball of the scene
BYTES, BYTES_A_BALL = 65_536, 256
TOKEN = "x-pool-token"  # the header that has the token; the page's own address has it, too
NAMES = ("127.0.0.1", "localhost")
RATE, BURST = 120.0, 240.0  # requests a second in the long run, and at once

HEADERS = {
    "cache-control": "no-store",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}


class LiveServer:
    """A live server has the address of a table, and serves it; ``port`` 0 is any free one."""

    def __init__(self, scene: Scene, port: int = 0, token: str | None = None) -> None:
        self.scene = scene
        self.socket = socket.create_server((HOST, port))
        # Without this an answer waits 40 ms for its first part to be acknowledged (RFC 896).
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.port: int = self.socket.getsockname()[1]
        self.token = token or secrets.token_urlsafe(16)
        self.most_bytes = BYTES + BYTES_A_BALL * len(scene.balls)
        app = Starlette(
            routes=[
                Route("/", self._page, methods=["GET"]),
                Route("/api/{name}", self._question, methods=["POST"]),
            ],
            middleware=[Middleware(BaseHTTPMiddleware, dispatch=Guard(self.port, self.token))],
            exception_handlers={HTTPException: _not_there},
        )
        config = uvicorn.Config(
            app, loop="asyncio", http="h11", ws="none", lifespan="off",
            log_level="critical", access_log=False, server_header=False, timeout_keep_alive=60,
            timeout_graceful_shutdown=0, limit_concurrency=MOST_CONNECTIONS,
        )  # fmt: skip
        self.server = _Server(config)

    @property
    def address(self) -> str:
        """The address of the page, with the token."""
        return f"http://{HOST}:{self.port}/?token={self.token}"

    def run(self) -> None:
        """Serve until somebody stops it; Ctrl-C raises KeyboardInterrupt."""
        self.shots = Worker(self.scene, ANSWER_TIMEOUT)
        self.clouds = Worker(self.scene, ANSWER_TIMEOUT)
        try:
            self.page = document(live_content(self.scene), live=True)
            self.server.run([self.socket])
        finally:
            with uninterrupted():
                self.socket.close()
                self.shots.end()
                self.clouds.end()
        raise_pending()  # uvicorn sends it again when it has ended.

    def stop(self) -> None:
        """End :meth:`run`, from another thread."""
        self.server.should_exit = self.server.force_exit = True

    async def _page(self, request: Request) -> Response:
        return HTMLResponse(self.page)

    async def _question(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in QUESTIONS:
            raise HTTPException(404)
        text = bytearray()
        try:
            async with asyncio.timeout(ANSWER_TIMEOUT):
                async for part in request.stream():
                    text += part
                    if len(text) > self.most_bytes:
                        why = f"the question has more than {self.most_bytes} bytes"
                        return respond(refusal(413, why))
        except TimeoutError:
            return respond(refusal(408, f"the question did not come within {ANSWER_TIMEOUT:g} s"))
        except ClientDisconnect:
            return respond(refusal(400, "the question broke off"))
        ask = (self.clouds if name == "cloud" else self.shots).ask
        return respond(await to_thread.run_sync(ask, name, bytes(text), abandon_on_cancel=True))


async def _not_there(request: Request, error: Exception) -> Response:
    """Answer a request that the table does not know."""
    assert isinstance(error, HTTPException)
    place = f"{request.method} {request.url.path[:60]}"
    return respond(refusal(error.status_code, f"{place}: there is no such question"))


class _Server(uvicorn.Server):
    """This server ends at once: nobody waits for connections that are still open."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        super().handle_exit(sig, frame)
        self.force_exit = True

    async def on_tick(self, counter: int) -> bool:
        """Hear of a Ctrl-C that came before this server listened to it."""
        try:
            raise_pending()
        except KeyboardInterrupt:
            self.handle_exit(signal.SIGINT, None)
        return bool(await super().on_tick(counter))


class Guard:
    """A guard knows the port and the token, and counts requests."""

    def __init__(self, port: int, token: str) -> None:
        self.hosts = {f"{name}:{port}" for name in NAMES}
        self.origins = {f"http://{host}" for host in self.hosts}
        self.token = token.encode()
        self.tokens, self.counted = BURST, time.monotonic()

    async def __call__(
        self, request: Request, go_on: Callable[[Request], Awaitable[Response]]
    ) -> Response:
        """Answer a request, or say why it is turned away."""
        refused = self.refuses(request)
        response = respond(refused) if refused else await go_on(request)
        response.headers.update(HEADERS)
        return response

    def refuses(self, request: Request) -> Reply | None:
        """Return why a request is turned away; None if it may pass."""
        host, origin = request.headers.get("host"), request.headers.get("origin")
        if host not in self.hosts:
            return refusal(403, "this host is not the table's: use the address that was printed")
        if origin is not None and origin not in self.origins:
            return refusal(403, "this page is not the table's: use the address that was printed")
        is_page = request.method in ("GET", "HEAD")  # The page has the token in its address.
        token = request.query_params.get("token") if is_page else request.headers.get(TOKEN)
        if not hmac.compare_digest((token or "").encode(errors="replace"), self.token):
            why = "the token is wrong or missing"
            return refusal(403, f"{why}: use the address that the program printed")
        since, self.counted = self.counted, time.monotonic()
        self.tokens = min(self.tokens + RATE * (self.counted - since), BURST)
        if self.tokens < 1.0:
            return refusal(429, "too many requests at once: wait a second")
        self.tokens -= 1.0
        return None


def respond(answer: Reply) -> Response:
    """Return an answer as a response of HTTP."""
    return Response(answer.text, answer.status, media_type=answer.type)
