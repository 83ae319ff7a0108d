"""This module is what commands do with what they find: it is printed, written and drawn."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

from pool_pymunk import __version__
from pool_pymunk.cli.terminal import Bar, Part, show
from pool_pymunk.safety.files import whole


class File(NamedTuple):
    """A report has a file of this name in the folder; ``write`` writes it."""

    name: str
    write: Callable[[Path], object]


Report = Iterable[Part | File | dict[str, object]]  # Results for the file of --json are a dict.


@dataclass
class Output:
    """An output prints and writes what reports yield; ``kinds`` says what the files have.

    The JSON has the last results, and comes at the end. An error or Ctrl-C that ends the command
    early changes nothing of this: what there is is kept.
    """

    folder: Path
    kinds: str
    json: Path | None = None
    played: tuple[str, str | None] = ("", None)  # the scenario and its title
    waiting: Report = ()
    results: dict[str, object] | None = None
    writes: bool = False

    def __enter__(self) -> Self:
        return self

    def at_end(self, report: Report) -> None:
        """Print and write this, in place of an earlier report, when the command ends."""
        self.waiting = report

    def __call__(self, report: Report) -> None:
        """Print and write this now."""
        for part in report:
            if isinstance(part, dict):
                self.results = part
            elif isinstance(part, File):
                self.writes = True
                with whole(self.folder / part.name) as path:
                    part.write(path)
            else:
                show(part)

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        parts = list(self.waiting)
        self(part for part in parts if not isinstance(part, File))
        if files := [part for part in parts if isinstance(part, File)]:
            with Bar("writing", len(files)) as bar:
                for part in files:
                    self([part])
                    bar.step()
        if self.results is not None:
            scenario, title = self.played
            write_json(self.json, {"scenario": scenario, "title": title}, self.results)
        if self.writes and not isinstance(error, Exception):
            print(f"{self.kinds}: {self.folder}")


def write_json(
    path: Path | None, played: Mapping[str, object], results: Mapping[str, object]
) -> None:
    """Write the file of ``--json``, if there is one: what was played, the version, the results."""
    if path is not None:
        content = {**played, "version": __version__, **results}
        with whole(path) as part:
            text = json.dumps(content, indent=1, ensure_ascii=False)
            part.write_text(text + "\n", encoding="utf-8")
