"""A real browser visits pages: `make test-browser` says how to get one."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

sync_api = pytest.importorskip("playwright.sync_api")


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


# A browser without a screen, and without asking its maker's hosts for anything.
SWITCHES = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    assert path, "no Chromium is installed: on Debian, `apt-get install chromium` installs one"
    with sync_api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=list(SWITCHES))
        yield browser
        browser.close()


class Visit:
    """A visit has an open page, and what the browser complained of or asked for meanwhile."""

    def __init__(self, browser: Any, address: str, **settings: Any) -> None:
        self.context = browser.new_context(**settings)
        self.page = self.context.new_page()
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("dialog", lambda dialog: self.said.append(dialog.message))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(address)

    def ask(self, script: str, value: Any = None) -> Any:
        return self.page.evaluate(script, value)

    def wait(self, script: str) -> None:
        """Wait until this is so; the page's policy forbids the browser's own waiting."""
        for _ in range(500):
            if self.ask(script):
                return
            self.page.wait_for_timeout(20)
        raise AssertionError(f"{script} did not come true")

    def time(self) -> float:
        return float(self.ask("pool.time"))

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def text(self, name: str) -> str:
        return str(self.page.locator(f"#{name}").inner_text())


def picture(seen: Visit) -> str:
    return str(seen.ask("document.getElementById('table').toDataURL()"))
