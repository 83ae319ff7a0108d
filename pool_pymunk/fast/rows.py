"""This module has loops over rows and columns of numbers."""

from __future__ import annotations

from typing import Any

from pool_pymunk.physics.saltation import MOST


def copy(own: Any, there: Any) -> None:
    """Copy the rows of a change."""
    for k in range(own.shape[0]):
        for p in range(own.shape[1]):
            there[k, p] = own[k, p]


def is_unknown(own: Any) -> bool:
    """Tell whether nothing is known of a change."""
    for k in range(own.shape[0]):
        for p in range(own.shape[1]):
            if own[k, p] == own[k, p]:
                return False
    return True


def is_beyond(own: Any) -> bool:
    """Tell whether a change has grown too large."""
    found = False
    for k in range(own.shape[0]):
        for p in range(own.shape[1]):
            found |= abs(own[k, p]) > MOST
    return found


def is_changed(own: Any, p: int) -> bool:
    """Tell whether an input changes a ball's state."""
    for k in range(own.shape[0]):  # noqa: SIM110
        if own[k, p] != 0.0:
            return True
    return False
