"""This module has loops over rows and columns of numbers."""

from __future__ import annotations

from typing import Any

from pool_pymunk.physics.saltation import MOST


def advance(by_state: Any, own: Any, by_pull: Any, of_pull: Any, out: Any) -> None:
    """Multiply a change by the derivatives of a motion."""
    size = len(by_pull)
    for p in range(len(of_pull)):
        if of_pull[p] != 0.0 or is_changed(own, p):
            for k in range(size):
                out[k] = by_pull[k] * of_pull[p]
                for j in range(size):
                    out[k] += by_state[k][j] * own[j, p]
            for k in range(size):
                own[k, p] = out[k]


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
