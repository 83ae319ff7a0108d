"""This module writes steps and counts in words, for logs, tables and diagrams."""

from __future__ import annotations


def step_text(dt: float) -> str:
    """Return a time step as people write it: a number, or a fraction if digits would be lost.

    >>> step_text(0.0001), step_text(1 / 240), step_text(1e-6)
    ('0.0001 s', '1/240 s', '1e-06 s')
    """
    per_second = round(1.0 / dt)
    if per_second > 0 and abs(per_second * dt - 1.0) < 1e-9 and float(f"{dt:g}") != dt:
        return f"1/{per_second} s"
    return f"{dt:g} s"


def seconds(duration: float) -> str:
    """Return a duration to hundredths of a second, or to three figures if it is below 0.1 s.

    >>> seconds(2.5749), seconds(0.5), seconds(0.01234)
    ('2.57 s', '0.50 s', '0.0123 s')
    """
    return f"{duration:.2f} s" if duration >= 0.1 or duration == 0.0 else f"{duration:.3g} s"


def counted(number: int, noun: str) -> str:
    """``counted(1, "ball")`` is "1 ball", ``counted(2, "ball")`` "2 balls".

    >>> counted(0, "contact")
    '0 contacts'
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def without_slip(law: str, hit: str) -> str:
    """Say that the slip of a hit was rounding alone, under a law that jumps at zero slip.

    >>> print(without_slip("published", "the hit of balls C and 1"))
    in the hit of balls C and 1 the slip was only a rounding error, and its sign would decide the \
friction of law published. So there was no friction
    """
    return (
        f"in {hit} the slip was only a rounding error, and its sign would decide the friction of "
        f"law {law}. So there was no friction"
    )
