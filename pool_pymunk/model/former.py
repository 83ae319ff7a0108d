"""This module has what a former version called a method, and is a property now."""

from __future__ import annotations

import warnings
from typing import ClassVar, Self


class Former:
    """A state was the answer of a method of this ``name``, so it still may be called."""

    name: ClassVar[str]

    def __call__(self) -> Self:
        text = f"{self.name} is a property now: leave out the parentheses"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        return self
