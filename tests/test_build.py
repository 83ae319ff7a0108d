"""The core is compiled whole or not at all, and says which; small cores are compiled here."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

import hatch_build
import pool_pymunk
from hatch_build import CORE, STAMP, CompiledCore, compiled_files, is_stale
from pool_pymunk import cli, core
from pool_pymunk.cli.lines import CORE as SAID
from pool_pymunk.render import RenderError
from pool_pymunk.render.films import written
from tests.conftest import STALE
from tests.shared.commands import Capture, exit_code

ROOT = Path(hatch_build.__file__).parent
SUFFIX = EXTENSION_SUFFIXES[0]
PURE = os.environ.get("POOL_PYMUNK_PURE") == "1"
HAS_COMPILER = shutil.which("cc") is not None and (
    Path(sysconfig.get_path("include"), "Python.h").exists()
)
compiles = pytest.mark.skipif(not HAS_COMPILER, reason="there is no C compiler")

ONE = """
class Disc:
    def __init__(self, r: float) -> None:
        self.r = r
"""
TWO = """
from pool_pymunk.core.one import Disc

def doubled(disc: Disc) -> float:
    return 2.0 * disc.r
"""
WRONG = 'r: float = "two"\n'


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a project with a core of two files; it has a space in its name."""
    monkeypatch.delenv("POOL_PYMUNK_PURE", raising=False)
    home = tmp_path / "a b"
    (home / CORE / "walls").mkdir(parents=True)
    (home / "pool_pymunk" / "__init__.py").write_text("import nowhere\n")
    shutil.copyfile(core.__file__, home / CORE / "__init__.py")
    (home / CORE / "walls" / "__init__.py").touch()
    (home / CORE / "one.py").write_text(ONE)
    (home / CORE / "walls" / "two.py").write_text(TWO)
    return home


class Said:
    """What a hook tells pip stands in ``warnings``."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def display_warning(self, text: str) -> None:
        self.warnings.append(text)


def built(root: Path, kind: str, said: Said | None = None) -> tuple[dict[str, Any], list[str]]:
    """Call the hook as hatchling does; return what it wants, and the files that wheels get."""
    wants: dict[str, Any] = {"pure_python": True, "infer_tag": False}
    wants |= {"force_include": {}, "dependencies": []}
    hook = CompiledCore(str(root), {}, None, None, "", "wheel", said or Said())
    try:
        hook.initialize(kind, wants)
        assert all(Path(path).is_file() for path in wants["force_include"])
    finally:
        hook.finalize(kind, wants, "")
    return wants, sorted(wants["force_include"].values())


def in_place(root: Path) -> list[str]:
    """Return the compiled files that stand in a project, with their stamp."""
    found = {path.relative_to(root).as_posix() for path in compiled_files(root)}
    return sorted(found | {STAMP.as_posix()} if (root / STAMP).exists() else found)


MADE = sorted(
    [
        f"pool_pymunk__mypyc{SUFFIX}",
        STAMP.as_posix(),
        f"{CORE.as_posix()}/one{SUFFIX}",
        f"{CORE.as_posix()}/walls/two{SUFFIX}",
    ]
)


@pytest.fixture
def pretended(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Let nothing be compiled, but make the files; return the folders in which it was done."""
    done = list[Path]()

    def pretend(root: Path, folder: Path) -> Path:
        done.append(folder)
        for path in hatch_build.sources(root):
            made = folder / path.relative_to(root).with_suffix(SUFFIX)
            made.parent.mkdir(parents=True, exist_ok=True)
            made.touch()
        (folder / f"pool_pymunk__mypyc{SUFFIX}").touch()
        (folder / STAMP).write_text(hatch_build.stamp(root))
        return folder

    monkeypatch.setattr(hatch_build, "compile_core", pretend)
    return done


# -- what is built, and where it stands ------------------------------------------------------------


def test_a_wheel_takes_compiled_files_and_leaves_none(root: Path, pretended: list[Path]) -> None:
    wants, packed = built(root, "standard")
    assert packed == MADE and in_place(root) == []
    assert (wants["pure_python"], wants["infer_tag"]) == (False, True)
    assert len(pretended) == 1


@pytest.mark.parametrize("kind", ["standard", "editable"])
def test_only_what_is_compiled_needs_librt(
    kind: str, root: Path, pretended: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    (needed,) = built(root, kind)[0]["dependencies"]
    assert needed.startswith("librt>=")
    monkeypatch.setenv("POOL_PYMUNK_PURE", "1")
    assert built(root, kind)[0]["dependencies"] == []


def test_an_editable_install_compiles_once(root: Path, pretended: list[Path]) -> None:
    for _ in range(2):
        wants, packed = built(root, "editable")
        assert packed == [] and wants["pure_python"] and in_place(root) == MADE
    assert built(root, "standard")[1] == MADE  # A wheel takes what is there.
    assert len(pretended) == 1


@pytest.mark.parametrize("change", ["text", "name", "gone", "options", "lost"])
def test_it_is_compiled_again_when_something_has_changed(
    change: str, root: Path, pretended: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    built(root, "editable")
    one = root / CORE / "one.py"
    if change == "text":
        one.write_text(ONE + "\n")
    elif change == "name":
        one.rename(root / CORE / "other.py")
    elif change == "gone":
        one.unlink()
    elif change == "options":
        monkeypatch.setattr(hatch_build, "OPTIMIZE", "3")
    else:
        one.with_suffix(SUFFIX).unlink()
    assert is_stale(root) == (change in ("text", "name", "gone"))
    built(root, "editable")
    assert len(pretended) == 2 and not is_stale(root)
    sources = [path.with_suffix(SUFFIX) for path in hatch_build.sources(root)]
    assert sorted((root / CORE).rglob(f"*{SUFFIX}")) == sources  # Nothing of what is gone stays.


def test_plain_python_can_be_asked_for(
    root: Path, pretended: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    built(root, "editable")
    monkeypatch.setenv("POOL_PYMUNK_PURE", "1")
    wants, packed = built(root, "standard")
    assert packed == [] and wants["pure_python"] and in_place(root) == MADE
    built(root, "editable")
    assert in_place(root) == [] and len(pretended) == 1


def test_an_editable_install_can_leave_the_core_for_later(
    root: Path, pretended: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("POOL_PYMUNK_LATER", "1")
    built(root, "editable")
    assert not pretended and not in_place(root)
    assert built(root, "standard")[1] == MADE


@pytest.mark.parametrize("kind", ["standard", "editable"])
@pytest.mark.parametrize("why", [SystemExit(1), OSError("there is no compiler")], ids=repr)
def test_where_it_fails_nothing_is_compiled(
    why: BaseException, kind: str, root: Path, pretended: list[Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    built(root, "editable")
    (root / CORE / "one.py").write_text(ONE + "\n")

    def fail(*_: Path) -> Path:
        raise why

    monkeypatch.setattr(hatch_build, "compile_core", fail)
    said = Said()
    wants, packed = built(root, kind, said)
    assert packed == [] and wants["pure_python"] and not wants["infer_tag"]
    assert said.warnings == [f"pool_pymunk/core stays plain Python: {why}"]
    assert kind == "standard" or in_place(root) == []


def test_make_compiles_what_has_changed_alone(
    root: Path, pretended: list[Path], monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.setattr(hatch_build, "__file__", str(root / "hatch_build.py"))
    for _ in range(2):
        hatch_build.main()
        assert in_place(root) == MADE and len(pretended) == 1
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("The 2 files of ") and second == (
        "The core is compiled as its sources are."
    )


def test_an_interrupt_ends_a_build(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: Path) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr(hatch_build, "compile_core", interrupt)
    with pytest.raises(KeyboardInterrupt):
        built(root, "standard")


@compiles
@pytest.mark.long
def test_a_small_core_is_compiled_and_runs(root: Path) -> None:
    built(root, "editable")
    assert in_place(root) == MADE and not is_stale(root)
    (root / "pool_pymunk" / "__init__.py").write_text("")
    code = (
        "from pool_pymunk.core.walls import two; from pool_pymunk.core.one import Disc; "
        "print(two.__file__.endswith('.py'), two.doubled(Disc(2.0)))"
    )
    for pure in "01":
        env = {**os.environ, "POOL_PYMUNK_PURE": pure, "PYTHONPATH": str(root)}
        run = [sys.executable, "-c", code]
        ran = subprocess.run(run, cwd=root, env=env, capture_output=True, text=True, check=True)
        assert ran.stdout == f"{pure == '1'} 4.0\n"


def test_what_is_compiled_apart_is_there() -> None:
    """A room or file of another name would become a part of the one file, in silence."""
    known = {part for path in (ROOT / CORE).rglob("*.py") for part in (path.stem, path.parent.name)}
    assert known >= hatch_build.APART


@compiles
@pytest.mark.long
@pytest.mark.parametrize("broken", ["type", "compiler"])
def test_what_cannot_be_compiled_is_not(
    broken: str, root: Path, monkeypatch: pytest.MonkeyPatch, capfd: Capture
) -> None:
    if broken == "type":
        (root / CORE / "walls" / "two.py").write_text(TWO + WRONG)
    else:
        monkeypatch.setenv("CC", "false")
    said, here = Said(), Path.cwd()
    wants, packed = built(root, "standard", said)
    assert packed == [] and wants["pure_python"] and in_place(root) == []
    assert len(said.warnings) == 1 and Path.cwd() == here
    assert broken == "compiler" or "two.py:6: error: Incompatible types" in "".join(
        capfd.readouterr()
    )


# -- this project ----------------------------------------------------------------------------------


def test_one_mypy_checks_and_compiles() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    (exact,) = (each for each in project["build-system"]["requires"] if each.startswith("mypy="))
    assert exact in project["project"]["optional-dependencies"]["test"]
    assert exact == f"mypy=={version('mypy')}"


def test_the_plain_wheel_has_no_compiled_file_and_all_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hatchling.builders.wheel import WheelBuilder

    monkeypatch.setenv("POOL_PYMUNK_PURE", "1")
    (made,) = WheelBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["standard"])
    assert made.endswith("-py3-none-any.whl")
    packed = set(zipfile.ZipFile(made).namelist())
    suffixes = {Path(name).suffix for name in packed}
    assert suffixes.isdisjoint({".so", ".pyd"}) and STAMP.as_posix() not in packed
    wanted = {path.relative_to(ROOT).as_posix() for path in (ROOT / CORE).rglob("*.py")}
    wanted |= {f"pool_pymunk/scenarios/{path.name}" for path in (ROOT / "scenarios").glob("*.toml")}
    for path in (ROOT / "pool_pymunk" / "page" / "static").iterdir():
        wanted.add(path.relative_to(ROOT).as_posix())
    assert {*wanted, "pool_pymunk/py.typed"} <= packed


@pytest.mark.skipif(PURE, reason="plain Python is asked for")
@compiles
def test_the_core_is_compiled_where_there_is_a_compiler() -> None:
    assert pool_pymunk.compiled


def test_the_switch_gives_sources_to_every_module() -> None:
    names = [
        path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
        for path in hatch_build.sources(ROOT)
    ]
    code = (
        "import sys, pool_pymunk; from importlib import import_module\n"
        f"print({{import_module(name).__file__.rpartition('.')[2] for name in {names}}}, "
        "pool_pymunk.compiled)"
    )
    env = {**os.environ, "POOL_PYMUNK_PURE": "1"}
    run = [sys.executable, "-c", code]
    ran = subprocess.run(run, env=env, capture_output=True, text=True, check=True)
    assert len(names) > 20 and ran.stdout == "{'py'} False\n"


def test_compiled_tells_what_is_imported() -> None:
    engine = importlib.util.find_spec("pool_pymunk.core.engine")
    assert engine is not None and engine.origin is not None
    assert pool_pymunk.compiled == (Path(engine.origin).suffix != ".py")


@pytest.mark.long
def test_tests_refuse_compiled_code_of_other_sources() -> None:
    code = (
        "import sys, hatch_build, pool_pymunk.core, pytest\n"
        "pool_pymunk.core.compiled, hatch_build.is_stale = True, lambda _: True\n"
        "sys.exit(pytest.main(['--collect-only', 'tests/test_build.py']))"
    )
    run = [sys.executable, "-c", code]
    ran = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr.strip()) == (pytest.ExitCode.USAGE_ERROR, f"ERROR: {STALE}")


# -- what it says ----------------------------------------------------------------------------------


def test_version_and_check_tell_whether_the_core_is_compiled(capsys: Capture) -> None:
    said = "core: compiled" if pool_pymunk.compiled else "core: plain Python"
    assert exit_code("--version") == 0
    assert capsys.readouterr().out == f"{pool_pymunk.__version__}\n{said}\n"
    assert exit_code("check", "two-balls") == 0
    assert f"  {said}\n" in capsys.readouterr().out and said == SAID


@pytest.mark.parametrize(
    ("compiled", "pure", "command", "lines"),
    [
        (False, "0", "run", 1),
        (True, "0", "run", 0),
        (False, "1", "run", 0),
        (False, "0", "check", 0),
        (False, "0", "--version", 0),
    ],
)
def test_commands_that_play_say_once_that_they_are_plain_python(
    compiled: bool, pure: str, command: str, lines: int,
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path,
) -> None:  # fmt: skip
    monkeypatch.setattr(cli, "compiled", compiled)
    monkeypatch.setenv("POOL_PYMUNK_PURE", pure)
    run = ["two-balls", "--solver", "event-driven", "--no-pictures", "--out", tmp_path]
    more = {"run": run}
    exit_code(command, *more.get(command, ["two-balls"] if command == "check" else []))
    assert capsys.readouterr().err.splitlines().count(cli.PLAIN) == lines


def test_films_say_that_pyav_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with (
        pytest.raises(RenderError, match=r"shot\.mp4: films need PyAV, which is not installed"),
        written(tmp_path / "shot.mp4"),
    ):
        pass
