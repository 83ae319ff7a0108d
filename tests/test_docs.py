"""The documentation builds without a warning; its code runs, and its links lead somewhere."""

from __future__ import annotations

import ast
import importlib.metadata
import importlib.util
import io
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from html.parser import HTMLParser
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

import pool_pymunk
from pool_pymunk import load, loads, simulate
from pool_pymunk.cli import app
from pool_pymunk.model.scenario import bundled
from tests import ROOT
from tests.shared.scenes import typed

HOME = ROOT
DOCS = HOME / "docs"
README, CONTRIBUTING = HOME / "README.md", HOME / "CONTRIBUTING.md"
PAGES = [README, *sorted(DOCS.glob("*.md"))]
MARKED = [*PAGES, CONTRIBUTING, HOME / "CHANGELOG.md", HOME / "torture" / "README.md"]

# These pages play thousands of shots, or compile the derivatives of shots.
LONG = ("environments.md", "fit.md", "derivatives.md", "many-shots.md", "shots-in-torch.md",
        "inputs.md", "solver-and-step.md")  # fmt: skip
# The tests of what they print run these pages (test_figures.py, and below).
RUN_ELSEWHERE = ("accuracy.md", "report.md", "worksheet.md", "i-want-to.md")
NEEDS = {
    "environments.md": "gymnasium",
    "fit.md": "scipy",
    "i-want-to.md": "scipy",
    "many-shots.md": "pyarrow",
    "notebooks.md": "pandas",
    "shots-in-torch.md": "torch",
}


def text_of(page: Path) -> str:
    """Return what a page says."""
    return page.read_text(encoding="utf-8")


def test_a_release_is_installed_by_one_line_of_the_readme() -> None:
    """All else says how to install from a clone, or names an extra of what is installed."""
    asks = r"(?:install|add|uvx|pipx run|--from)\s+['\"`]*pool[-_]pymunk\b(?!\[)"
    assert len(re.findall(asks, text_of(README))) == 1
    known = [*PAGES[1:], CONTRIBUTING, *(HOME / "pool_pymunk").rglob("*.py")]
    for path in [*known, *(HOME / "examples").glob("*.py"), *(HOME / "torture").rglob("*.py")]:
        assert not re.search(asks, text_of(path)), path


def test_one_version_is_everywhere() -> None:
    """The newest section of the changelog and the citation have the version and day of release."""
    newest = re.search(r"^## (\S+) - (\S+)$", text_of(HOME / "CHANGELOG.md"), re.MULTILINE)
    cited = text_of(HOME / "CITATION.cff")
    assert newest and newest[1] == pool_pymunk.__version__
    assert f"\nversion: {newest[1]}\ndate-released: {newest[2]}\n" in cited
    assert importlib.metadata.version("pool-pymunk") == pool_pymunk.__version__


def test_readme_and_docs_are_short() -> None:
    """The glossary and the reference of names are looked up, not read."""
    looked_up = {"glossary.md", *(page.name for page in DOCS.glob("api-*.md"))}
    read = [page for page in PAGES[1:] if page.name not in looked_up]
    assert len(text_of(README).split()) < 900
    assert sum(len(text_of(page).split()) for page in read) < 23_000


def test_a_time_says_what_it_needs() -> None:
    """Whoever reads that something takes seconds or minutes knows on how many cores."""
    takes = re.compile(r"\b(takes?|took|in) (\d[\d.]*|two|three|ten) (to \d+ )?(s|minutes|hours)\b")
    where = re.compile(r"\bcores?\b|reads? |slices? of|of motion|the table's")
    for page in PAGES:
        text = re.sub(r"```.*?```", " ", text_of(page), flags=re.DOTALL)
        said = re.split(r"(?<=[.!?:|]) ", " ".join(text.split()))
        bare = [one for one in said if takes.search(one) and not where.search(one)]
        assert not bare, (page.name, bare)


def python_blocks(page: Path) -> list[str]:
    """Return the blocks of Python on a page."""
    return re.findall(r"^```python\n(.*?)^```", text_of(page), flags=re.DOTALL | re.MULTILINE)


def commands_of(page: Path) -> list[str]:
    """Return the lines of the blocks on a page that have no language."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", text_of(page), flags=re.DOTALL | re.MULTILINE)
    return [line for language, text in blocks if not language for line in text.splitlines()]


def run_python(page: Path, folder: Path) -> None:
    """Run the blocks of a page one after the other, beside the scenario of the tutorial."""
    shutil.copy(DOCS / "figures" / "mine.toml", folder)
    run_code("\n".join(python_blocks(page)), folder)


def run_code(code: str, folder: Path) -> str:
    """Run Python in a folder, in this process, and return what it prints; a warning is an error."""
    with chdir(folder), redirect_stdout(io.StringIO()) as said:
        exec(compile(code, "docs", "exec"), {"__name__": "__main__"})
    return said.getvalue()


def links(page: Path) -> Iterator[str]:
    """Yield where the links and the pictures of a page lead, except for other hosts and anchors."""
    prose = re.sub(r"^```.*?^```", "", text_of(page), flags=re.DOTALL | re.MULTILINE)
    prose = re.sub(r"`[^`\n]+`", "code", prose)
    for target in re.findall(r"\]\(([^)\s]+)\)", prose):
        if not re.match(r"[a-z]+:", target) and not target.startswith("#"):
            yield target.partition("#")[0]


def source_of(target: str) -> str:
    """Return the file in examples/ of which sphinx-gallery makes a page or a picture."""
    name = re.sub(r"^sphx_glr_(\w+)_\d{3}$", r"\1", Path(target).stem)
    return "README.rst" if name == "index" else f"{name}.py"


def test_python_parses() -> None:
    for page in PAGES:
        for code in python_blocks(page):
            ast.parse(code, page.name)


def test_code_is_as_wide_as_the_page_at_most() -> None:
    """What is wider is cut off in a window of 1280 pixels (docs/static/wide.css)."""
    block = re.compile(r"^```(\S*).*?\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)
    for page in PAGES:
        for name, code in block.findall(text_of(page)):
            is_wide = any(len(line) > 100 for line in code.splitlines())
            assert name.startswith("{") or not is_wide, (page.name, code)


def test_relative_links_lead_to_files() -> None:
    drawn = text_of(DOCS / "figures" / "draw.py")
    for page in PAGES:
        for target in links(page):
            if target.startswith("figures/made/"):
                assert f'"{Path(target).name}"' in drawn, target
            elif target.startswith("examples/"):
                assert (HOME / "examples" / source_of(target)).exists(), target
            else:
                assert (page.parent / target).exists(), (page.name, target)


def test_code_and_links_are_found() -> None:
    assert sum(len(python_blocks(page)) for page in PAGES) > 20
    assert sum(len(list(links(page))) for page in PAGES) > 50


def test_every_public_name_is_in_the_reference() -> None:
    pages = "".join(text_of(page) for page in DOCS.glob("api-*.md"))
    documented = re.findall(r"^\.\. [\w:]+:: pool_pymunk\.(\w+)$", pages, flags=re.MULTILINE)
    assert sorted(documented) == sorted(pool_pymunk.__all__)


def test_every_public_name_of_the_environments_is_in_the_reference() -> None:
    env = pytest.importorskip("pool_pymunk.env", exc_type=ImportError)
    page = text_of(DOCS / "api-env.md")
    documented = re.findall(r"^\.\. autoclass:: pool_pymunk\.env\.(\w+)$", page, flags=re.MULTILINE)
    assert sorted(documented) == sorted(env.__all__)


def test_every_command_is_in_the_reference() -> None:
    named = re.findall(r"^```\{command\} (\w+)$", text_of(DOCS / "commands.md"), re.MULTILINE)
    assert named == [command.name for command in app.registered_commands]


@pytest.mark.parametrize("example", sorted((HOME / "examples").glob("*.py")), ids=lambda p: p.name)
def test_an_example_begins_with_a_title(example: Path) -> None:
    lines = (ast.get_docstring(ast.parse(text_of(example))) or "").splitlines()
    assert len(lines) > 3
    assert lines[1] == "=" * len(lines[0])
    assert lines[2] == ""


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[pytest.mark.slow] if page.name in LONG else [], id=page.name)
     for page in PAGES[1:] if python_blocks(page) and page.name not in RUN_ELSEWHERE],
)  # fmt: skip
def test_python_runs(page: Path, tmp_path: Path) -> None:
    """The blocks of a page run one after the other, beside the scenario of the tutorial."""
    if page.name in NEEDS:
        pytest.importorskip(NEEDS[page.name])
    run_python(page, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("page", [DOCS / "i-want-to.md"], ids=["i-want-to.md"])
def test_commands_run(page: Path, tmp_path: Path) -> None:
    """The commands of a page run as they are written, behind its blocks of Python."""
    for needed in ("pyarrow", "scipy"):
        pytest.importorskip(needed)
    run_python(page, tmp_path)
    commands = commands_of(page)
    assert len(commands) > 10
    for command in commands:
        name, *arguments = shlex.split(command)
        answer = typed(*arguments, cwd=tmp_path)
        assert (name, answer.returncode) == ("pool-pymunk", 0), f"{command}: {answer.stderr}"


# -- README and CONTRIBUTING -----------------------------------------------------------------------


@pytest.mark.parametrize("code", python_blocks(README) + python_blocks(CONTRIBUTING))
def test_the_code_of_readme_and_contributing_runs(code: str, tmp_path: Path) -> None:
    assert run_code(code, tmp_path)


def test_the_scenario_is_sound() -> None:
    text = text_of(DOCS / "scenario-files.md").partition("```toml\n")[2].partition("```")[0]
    scene = loads(text)
    assert scene.balls[0].radius == pytest.approx(2.25 * 0.0254)


def test_every_bundled_scenario_is_named() -> None:
    for name in bundled():
        assert f"`{name}`" in text_of(README)


def test_every_file_that_contributing_names_is_there() -> None:
    named = set(re.findall(r"`((?:[a-z]+/)+[a-z_]*(?:\.py)?)`", text_of(CONTRIBUTING)))
    assert len(named) > 20
    for name in named:
        assert (HOME / name).exists() or (HOME / "pool_pymunk" / name).exists(), name


def test_the_tour_follows_the_first_shot_of_the_report() -> None:
    """It takes an hour, its eight files have what it names, and its numbers are the run's."""
    tour = text_of(CONTRIBUTING).partition("## A tour in an hour")[2].partition("\n## ")[0]
    stops = re.findall(r"^\| (\d+) \| `([\w/.]+)` \| (.*) \|$", tour, flags=re.MULTILINE)
    assert (len(stops), sum(int(minutes) for minutes, _, _ in stops)) == (8, 60)
    for _, name, said in stops:
        file = HOME / name if (HOME / name).exists() else HOME / "pool_pymunk" / name
        for word in re.findall(r"`(\w+)`", said) if file.suffix == ".py" else ():
            assert re.search(rf"\b(def|class|import) .*\b{word}\b", text_of(file)), (name, word)
    run = simulate(load("report"), 1, solver="event-driven")
    _, x, _, _, _, pull, _ = run.knots[0][0]
    t, _, _, vx, vy, _, _ = run.knots[0][1]
    numbers = f"x = {x:.5g} m", f"by {pull:.6g} m/s^2", f"at {t:.4g} s", f"at {vx:.5g} m/s"
    for number in (
        *numbers,
        f"at {vy:.4g} m/s",
        f"{len(run.events)} events",
        f"{run.duration:.4g} s",
    ):
        assert number in tour
    assert run.events[0].balls == ("C", "1")


@pytest.mark.parametrize("page", MARKED, ids=lambda page: page.name)
def test_markup_is_seen(page: Path) -> None:
    """No line of a table is read as text, or has too many or too few columns; no sign stays."""
    lines, tables = text_of(page).splitlines(), set[int]()
    for token in MarkdownIt("commonmark").enable("table").parse(text_of(page)):
        first, last = token.map or (0, 0)
        if token.type == "table_open":
            tables.update(range(first, last))
            bars = {len(re.findall(r"(?<!\\)\|", line)) for line in lines[first:last]}
            assert len(bars) == 1, lines[first]
        elif token.type in ("fence", "code_block"):
            tables.update(range(first, last))
        plain = [child.content for child in token.children or () if child.type == "text"]
        assert not re.search(r"\]\(|\*\*|`|\|\s*:?--", "\n".join(plain)), plain
    for k, line in enumerate(lines):
        assert k in tables or not line.lstrip().startswith("|"), line


def test_the_readme_has_what_a_newcomer_asks_for() -> None:
    """It has two commands, one picture, what is exact, what is not, how fast it is, and more."""
    page = text_of(README)
    assert re.findall(r"^## (.*)$", page, flags=re.MULTILINE) == [
        "Start", "What it is exact about", "What it is not exact about",
        "How fast it is by default", "Where to go on",
    ]  # fmt: skip
    assert commands_of(README) == ["make run", "make test"]
    assert len(re.findall(r"!\[", page)) == 1
    fast = page.partition("## How fast")[2].partition("\n## ")[0]
    known = "".join(text_of(DOCS / name) for name in ("speed.md", "many-shots.md"))
    for number in re.findall(
        r"(?<![\w./])\d[\d.,]*(?= (?:ms|s|breaks|of balls|events|exact)\b)", fast
    ):
        assert re.search(rf"(?<![\d.,]){re.escape(number)}(?![\d,])", known), number


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the documentation once, and return its folder."""
    needed = ("sphinx", "sphinx_gallery", "furo", "myst_parser", "latex2mathml", "pygame",
              "gymnasium")  # fmt: skip
    if any(importlib.util.find_spec(name) is None for name in needed):
        pytest.skip("the documentation needs pip install '.[docs]'")
    folder = tmp_path_factory.mktemp("docs")
    result = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", DOCS, folder],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    return folder


@pytest.mark.docs
def test_the_documentation_builds_without_a_warning(built: Path) -> None:
    assert (built / "index.html").exists()
    shown = text_of(built / "examples" / "index.html")
    for example in (HOME / "examples").glob("*.py"):
        assert f"images/sphx_glr_{example.stem}_thumb.png" in shown


class Loads(HTMLParser):
    """This parser notes what a page loads: scripts, styles, pictures, frames, fonts."""

    LINKS = ("stylesheet", "preload", "modulepreload", "prefetch", "preconnect", "dns-prefetch",
             "icon", "manifest")  # fmt: skip

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        has = {key: value or "" for key, value in attrs}
        sources = [has.get("src"), has.get("srcset"), has.get("poster"), has.get("data")]
        if tag == "link" and set(has.get("rel", "").split()) & {*self.LINKS}:
            sources.append(has.get("href"))
        self.found += list(filter(None, sources))


def from_elsewhere(text: str, is_page: bool) -> list[str]:
    """Return the addresses on other hosts from which a page or a style loads something."""
    found = Loads(text).found if is_page else []
    style = r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)"
    found += ["".join(pair) for pair in re.findall(style, text)]
    return [each for each in found if re.match(r"\s*(https?:)?//", each)]


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ('<script async src="https://host/es5/tex-mml-chtml.js"></script>', 1),
        ('<link rel="stylesheet" href="//host/a.css">', 1),
        (
            "<style>@import 'https://host/a.css'; a { background: url(http://host/b.png) }</style>",
            2,
        ),
        ('<img src="https://host/a.png"><iframe src="http://host"></iframe>', 2),
        ('<a href="https://host">host</a><img src="a.png"><link rel="next" href="//host/b">', 0),
    ],
)
def test_what_comes_from_elsewhere_is_found(text: str, count: int) -> None:
    assert len(from_elsewhere(text, is_page=True)) == count


@pytest.mark.docs
def test_no_page_loads_from_another_host(built: Path) -> None:
    """So the documentation can be read offline, formulas included."""
    pages = [*built.rglob("*.html"), *built.rglob("*.css")]
    assert len(pages) > 50
    for page in pages:
        assert not from_elsewhere(text_of(page), page.suffix == ".html"), page
    formulas = text_of(built / "physics.html").count("<math")
    assert formulas > 20 and "MathJax" not in text_of(built / "physics.html")


def test_formulas_can_be_written_as_mathml() -> None:
    """A command that the converter does not know would stand in the formula as it is."""
    convert = pytest.importorskip("latex2mathml.converter").convert
    formula = re.compile(r"\$\$(.+?)\$\$|(?<!\\)\$([^$]+?)\$", re.DOTALL)
    for page in PAGES:
        text = re.sub(r"^```.*?^```|`[^`\n]*`", "", text_of(page), flags=re.DOTALL | re.MULTILINE)
        for block, line in formula.findall(text):
            written = re.sub(r"<[^>]*>", "", convert(block or line))
            assert "\\" not in written, (page.name, block or line)
