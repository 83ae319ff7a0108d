"""This module turns away whom the table is not for, and what is too much.

The server listens on this machine only. But any page in its browser can send requests there, under
any name that leads to this machine. So the host must be this machine's own name, the origin the
table's own page, and every request must know the token that was printed.
"""

from __future__ import annotations

import hmac
import time
from collections.abc import Awaitable, Callable

from starlette.requests import Request
from starlette.responses import Response

from pool_pymunk.page.live.answers import Answer, refusal

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


class Guard:
    """A guard knows the port and the token, and counts requests."""

    def __init__(self, port: int, token: str) -> None:
        self.hosts = {f"{name}:{port}" for name in NAMES}
        self.origins = {f"http://{host}" for host in self.hosts}
        self.token = token.encode()
        self.left, self.counted = BURST, time.monotonic()

    async def __call__(
        self, request: Request, go_on: Callable[[Request], Awaitable[Response]]
    ) -> Response:
        """Answer a request, or say why it is turned away."""
        refused = self.refuses(request)
        response = respond(refused) if refused else await go_on(request)
        response.headers.update(HEADERS)
        return response

    def refuses(self, request: Request) -> Answer | None:
        """Return why a request is turned away; None if it may pass."""
        host, origin = request.headers.get("host"), request.headers.get("origin")
        if host not in self.hosts:
            return refusal(403, "this host is not the table's: use the address that was printed")
        if origin is not None and origin not in self.origins:
            return refusal(403, "this page is not the table's: use the address that was printed")
        if not self._has_token(request):
            return refusal(
                403, "the token is wrong or missing: use the address that the program printed"
            )
        if not self._is_in_time():
            return refusal(429, "too many requests at once: wait a second")
        return None

    def _has_token(self, request: Request) -> bool:
        """Tell whether a request knows the token; the page itself has it in its address."""
        is_page = request.method in ("GET", "HEAD")
        given = request.query_params.get("token") if is_page else request.headers.get(TOKEN)
        return hmac.compare_digest((given or "").encode(errors="replace"), self.token)

    def _is_in_time(self) -> bool:
        """Take one from what is left; it fills up with time."""
        now = time.monotonic()
        self.left = min(self.left + RATE * (now - self.counted), BURST)
        self.counted = now
        if self.left < 1.0:
            return False
        self.left -= 1.0
        return True


def respond(answer: Answer) -> Response:
    """Return an answer as a response of HTTP."""
    return Response(answer.text, answer.status, media_type=answer.type)
