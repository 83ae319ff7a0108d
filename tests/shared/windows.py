"""Windows of pygame without a screen, for the tests of examples."""

from __future__ import annotations

import importlib
import os
import warnings
from typing import Any

import pytest

os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
with warnings.catch_warnings():  # pygame asks for pkg_resources, which setuptools warns of.
    warnings.simplefilter("ignore")
    pygame: Any = pytest.importorskip("pygame")
    importlib.import_module("pygame.pkgdata")


def frames_of(monkeypatch: pytest.MonkeyPatch, game: Any, last: Any) -> list[float]:
    """Return where the seconds of a game's frames will be; with the third comes an event."""
    frames, advance = list[float](), game.advance

    def watched(self: Any, seconds: float) -> None:
        frames.append(seconds)
        advance(self, seconds)
        if len(frames) == 3:
            pygame.event.post(last)

    monkeypatch.setattr(game, "advance", watched)
    return frames
