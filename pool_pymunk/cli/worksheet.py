"""This command writes the worksheet, or its answers, as one HTML file that a browser prints."""

from __future__ import annotations

import re

import typer
from latex2mathml.converter import convert
from markdown_it import MarkdownIt

from pool_pymunk.cli import read
from pool_pymunk.cli.options import WorksheetOptions
from pool_pymunk.safety.files import folder_of, whole

# A sheet is as high as A4 and Letter both are between these margins.
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
@page {{ margin: 15mm 18mm }}
body {{ font: 11pt/1.45 Georgia, serif; color: #111; max-width: 175mm; margin: 10mm auto }}
section {{ display: flex; flex-direction: column; min-height: 245mm; break-after: page }}
section:first-child {{ min-height: 0 }} section:last-child {{ break-after: auto }}
section > * {{ flex: none }}
.name {{ font-size: 10pt; margin: 0 0 6mm; display: flex; gap: 6mm }}
.name span {{ border-bottom: 0.3mm solid #555; flex: 1 }} .name span + span {{ flex: 0.4 }}
.room {{ flex: 1; margin-top: 4mm; print-color-adjust: exact; -webkit-print-color-adjust: exact;
  background: repeating-linear-gradient(#fff 0 8.7mm, #ccc 8.7mm 9mm) }}
h1 {{ font-size: 18pt; margin: 0 0 4mm }} h2 {{ font-size: 14pt; margin: 0 0 2mm }}
p, pre, ol, table {{ margin: 0 0 3mm }} li {{ margin-bottom: 2mm }}
pre {{ font: 8.5pt/1.4 monospace; background: #f4f4f4; padding: 2mm 3mm; white-space: pre-wrap;
  overflow-wrap: anywhere; print-color-adjust: exact; -webkit-print-color-adjust: exact }}
code {{ font-family: monospace; font-size: 0.9em }}
table {{ border-collapse: collapse }} tr {{ break-inside: avoid }}
td, th {{ border-bottom: 0.2mm solid #ccc; padding: 1mm 2mm; text-align: left }}
@media screen {{ section {{ margin-bottom: 15mm }} }}
</style></head><body>
{body}
</body></html>
"""
NAME = '<p class="name">Name<span></span>Date<span></span></p>'
ROOM = '<div class="room"></div>'  # to write on


def worksheet(asked: WorksheetOptions) -> int:
    """Write the worksheet or its answers."""
    name = "worksheet-answers" if asked.answers else "worksheet"
    path = asked.out or read.folder(None, "") / f"{name}.html"
    read.ending("--out", path, (".html", ".htm"), ".html")
    text = (folder_of("worksheets", "docs") / f"{name}.md").read_text(encoding="utf-8")
    title = text.partition("\n")[0].removeprefix("# ")
    page = PAGE.format(title=title, body=html(text) if asked.answers else sheets(text))
    with whole(path) as part:
        part.write_text(page, encoding="utf-8")
    typer.echo(path)
    return 0


def sheets(text: str) -> str:
    """Return a sheet of HTML for each exercise, after one for what comes before the first."""
    opening, *parts = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    exercises = [part for part in parts if re.match(r"## \d", part)]
    each = [html(opening), *(f"{NAME}\n{html(part)}{ROOM}" for part in exercises)]
    return "\n".join(f"<section>\n{one}\n</section>" for one in each)


def html(text: str) -> str:
    """Return HTML for Markdown with formulas; what a link of the docs leads to is named.

    >>> print(html("See [*this*](physics.md#a)."), end="")
    <p>See <em>this</em> (docs/physics.md).</p>
    """
    formulas = list[str]()

    def put_aside(found: re.Match[str]) -> str:
        formulas.append(convert(" ".join(found[1].split())))
        return f"\ue000{len(formulas) - 1}\ue000"

    text = re.sub(r"\$([^$]+)\$", put_aside, text)
    text = re.sub(r"\[([^\]]+)\]\(([\w-]+\.md)[^)]*\)", r"\1 (docs/\2)", text)
    found: str = MarkdownIt("commonmark").enable("table").render(text)
    return re.sub("\ue000(\\d+)\ue000", lambda one: formulas[int(one[1])], found)
