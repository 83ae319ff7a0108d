"""This command writes the worksheet, or its answers, as one HTML file that a browser prints."""

from __future__ import annotations

import re
from string import Template

import typer
from latex2mathml.converter import convert
from markdown_it import MarkdownIt

from pool_pymunk.cli import read
from pool_pymunk.cli.options import WorksheetOptions
from pool_pymunk.page.document import source
from pool_pymunk.safety.files import folder_of, whole

NAME = '<p class="name">Name<span></span>Date<span></span></p>'
FUNCTION = r"(\\(?:cos|ln|sin|tan)) ?(?=[\\\d])"  # before a number or a letter, not a bracket
PYTHON = "```python\n"  # opens a block
ROOM = '<div class="room"></div>'  # to write on


def worksheet(asked: WorksheetOptions) -> int:
    """Write the worksheet or its answers."""
    name = "worksheet-answers" if asked.answers else "worksheet"
    path = asked.out or read.folder(None, "") / f"{name}.html"
    read.ending("--out", path, (".html", ".htm"), ".html")
    text = (folder_of("worksheets", "docs") / f"{name}.md").read_text(encoding="utf-8")
    title = text.partition("\n")[0].removeprefix("# ")
    body = html(text) if asked.answers else sheets(text)
    with whole(path) as part:
        page = Template(source("worksheet.html")).substitute(title=title, body=body)
        part.write_text(page, encoding="utf-8")
    typer.echo(path)
    return 0


def sheets(text: str) -> str:
    """Return a sheet of HTML for each exercise, after one for what comes before the first.

    Each sheet stands alone: the lines of Python of that one stand before those of an exercise, too.
    """
    opening, *parts = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    before = opening[opening.index(PYTHON) :].partition("\n```\n")[0]
    exercises = [
        part.replace(PYTHON, f"{before}\n\n", 1) for part in parts if re.match(r"## \d", part)
    ]
    each = [html(opening), *(f"{NAME}\n{html(part)}{ROOM}" for part in exercises)]
    return "\n".join(f"<section>\n{one}\n</section>" for one in each)


def html(text: str) -> str:
    """Return HTML for Markdown with formulas; what a link of the docs leads to is named.

    A function stands apart from its number, and a per cent sign stays in the line of its own.

    >>> print(html("See [*this*](physics.md#a)."), end="")
    <p>See <em>this</em> (docs/physics.md).</p>
    """
    formulas = list[str]()

    def put_aside(found: re.Match[str]) -> str:
        formula = re.sub(FUNCTION, r"\1\\,", " ".join(found[1].split()))
        formulas.append(convert(formula))
        return f"\ue000{len(formulas) - 1}\ue000"

    text = re.sub(r"\$([^$]+)\$", put_aside, text)
    text = re.sub(r"(?<=\d) %", "\u00a0%", text)
    text = text.replace("[worksheet](worksheet.md)", "worksheet")
    text = re.sub(r"\[([^\]]+)\]\(([\w-]+\.md)[^)]*\)", r"\1 (docs/\2)", text)
    found: str = MarkdownIt("commonmark").enable("table").render(text)
    return re.sub("\ue000(\\d+)\ue000", lambda one: formulas[int(one[1])], found)
