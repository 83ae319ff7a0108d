"""This module has loops over rows of numbers, which numba does not inline."""

from __future__ import annotations

from typing import Any

from pool_pymunk.physics.saltation import MOST


def advance(by_state: Any, own: Any, by_pull: Any, of_pull: Any, out: Any) -> None:
    """Multiply a change by the derivatives of a motion."""
    size, count = len(by_pull), len(of_pull)
    for k in range(size):
        for p in range(count):
            out[k, p] = by_pull[k] * of_pull[p]
        for j in range(size):
            weight = by_state[k][j]
            if weight != 0.0:
                for p in range(count):
                    out[k, p] += weight * own[j, p]
    copy(out[:size], own)


def multiply(m: Any, z: Any, out: Any, last: int) -> None:
    """Multiply the changes of a contact by its matrix, which has so many columns."""
    size, count = m.shape[0], z.shape[1]
    for k in range(size):
        for p in range(count):
            out[k, p] = m[k, 0] * z[0, p]
    for j in range(1, last):
        if j < size or is_any(z[j]):
            for k in range(size):
                weight = m[k, j]
                if weight != 0.0:
                    for p in range(count):
                        out[k, p] += weight * z[j, p]
    copy(out[:size], z)


def is_any(row: Any) -> bool:
    """Tell whether a row has a number that is not 0."""
    found = False
    for p in range(len(row)):
        found |= row[p] != 0.0
    return found


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
