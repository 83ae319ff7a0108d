"""Compile pool_pymunk/core by mypyc while a wheel, or an editable install, is built.

It is all or nothing: where there is no compiler, or a file cannot be compiled, plain Python is
installed. A wheel gets its compiled files from a folder of their own. An editable install has them
beside their sources, and the file that they share at the top; they are compiled again only if a
source, the Python or an option has changed. ``make build`` runs this file to compile in place: it
shows what mypyc and the compiler say, which pip hides.

POOL_PYMUNK_PURE=1 builds plain Python, and POOL_PYMUNK_OPTIMIZE=3 (2 if left out) optimizes more.
POOL_PYMUNK_LATER=1 leaves an editable install as it is: `make` compiles it beside other work.
"""

import hashlib
import os
import shutil
import sys
import sysconfig
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import chdir
from importlib.metadata import version as version_of
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import shorten
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

CORE = Path("pool_pymunk", "core")
STAMP = CORE / "compiled.txt"  # the hash of the sources, and how they were compiled
GROUP = "pool_pymunk"  # The file that all compiled files share is pool_pymunk__mypyc.
OPTIMIZE = os.environ.get("POOL_PYMUNK_OPTIMIZE", "2")
# A product fused with a sum has other bits than in plain Python. What is hidden can be inlined.
# Calls of the interpreter need no table of jumps, and nobody steps through lines of C.
FLAGS = ["-ffp-contract=off", "-fvisibility=hidden", "-fno-plt", "-g0", "-Wno-error"]
if sys.platform == "win32":
    FLAGS = ["/fp:precise"]
elif OPTIMIZE == "2" and "gcc" in (os.environ.get("CC") or sysconfig.get_config_var("CC") or ""):
    # Without these passes the compiler takes two thirds of the time, and the core is as fast.
    FLAGS += ["-fno-tree-pre", "-fno-gcse", "-fno-schedule-insns2", "-fno-tree-vectorize"]
    # It inlines more than at -O3: shots of twenty events take 9 % fewer instructions than without.
    SMALL = {"max-inline-insns-auto": 100, "inline-min-speedup": 15, "early-inlining-insns": 40}
    FLAGS += [f"--param={key}={value}" for key, value in SMALL.items()]
# What a lone hit and its changes call is compiled as one file, so that functions are inlined into
# each other. These rooms and files are compiled beside it, which takes half the time of one file.
APART = {"persistent", "collapse", "rounds", "together", "moving", "live", "layouts"}
CORES = os.cpu_count() or 1


class CompiledCore(BuildHookInterface[Any]):
    """This hook compiles the core; hatchling calls it before and after it packs a wheel."""

    folder: TemporaryDirectory[str] | None = None

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile what has changed, and let a wheel have it, unless plain Python is asked for."""
        root, is_editable = Path(self.root), version == "editable"
        if is_editable and os.environ.get("POOL_PYMUNK_LATER") == "1":
            return
        home: Path | None = root
        if os.environ.get("POOL_PYMUNK_PURE") == "1":
            home = None
        elif not is_up_to_date(root):
            home = self.compile(root)
        if home:  # Plain Python does without what compiled modules read and write numbers by.
            build_data["dependencies"].append(f"librt>={version_of('librt')}")
        if is_editable and home != root:
            put_in_place(home, root)
        elif not is_editable and home:
            self.pack(home, build_data)

    def compile(self, root: Path) -> Path | None:
        """Return the folder of the compiled files; if it cannot be done, say why."""
        self.folder = TemporaryDirectory()
        try:
            return compile_core(root, Path(self.folder.name))
        except (Exception, SystemExit) as error:  # mypyc ends with SystemExit.
            self.app.display_warning(stays_plain(error))
            return None

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Leave nothing behind."""
        if self.folder:
            self.folder.cleanup()

    def pack(self, home: Path, build_data: dict[str, Any]) -> None:
        """Let the wheel have the compiled files below a folder, and a tag that says so."""
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
        for path in (*compiled_files(home), home / STAMP):
            build_data["force_include"][str(path)] = path.relative_to(home).as_posix()


def sources(root: Path) -> list[Path]:
    """Return the files that are compiled."""
    return sorted(path for path in (root / CORE).rglob("*.py") if path.name != "__init__.py")


def digest(root: Path) -> str:
    """Return a hash of the sources and their names."""
    found = hashlib.sha256()
    for path in sources(root):
        found.update(path.relative_to(root).as_posix().encode())
        found.update(path.read_bytes())
    return found.hexdigest()


def stamp(root: Path) -> str:
    """Return the hash of the sources, and a line on how they are compiled."""
    how = f"Python {sys.version}, mypy {version_of('mypy')}, optimization {OPTIMIZE}"
    words = [*how.split(), *FLAGS, os.environ.get("CFLAGS", "")]
    return f"{digest(root)}\n{' '.join(words)}\n"


def compiled_files(home: Path) -> Iterator[Path]:
    """Yield the compiled files below a folder."""
    yield from home.glob(f"{GROUP}__mypyc.*")
    for kind in ("*.so", "*.pyd"):
        yield from (home / CORE).rglob(kind)


def kept_stamp(root: Path) -> str:
    """Return the stamp of the compiled files that are there, or nothing."""
    return (root / STAMP).read_text("utf-8") if (root / STAMP).exists() else ""


def is_up_to_date(root: Path) -> bool:
    """Tell whether all sources are compiled as they are, by this Python, with these options."""
    count = len([*compiled_files(root)])
    return count == len(sources(root)) + 1 and kept_stamp(root) == stamp(root)


def is_stale(root: Path) -> bool:
    """Tell whether there are compiled files of other sources; tests refuse them."""
    return any(compiled_files(root)) and digest(root) not in kept_stamp(root)


def stays_plain(error: BaseException) -> str:
    """Say in one line why the core is not compiled; a command that failed is as long as a page."""
    return f"{CORE.as_posix()} stays plain Python: {shorten(str(error), 100, placeholder=' ...')}"


def remove_compiled(root: Path) -> None:
    """Remove all compiled files; one whose source is gone could still be imported."""
    (root / STAMP).unlink(missing_ok=True)
    for path in [*compiled_files(root)]:
        path.unlink()


def put_in_place(made: Path | None, root: Path) -> None:
    """Put the compiled files below a folder beside their sources, in place of all old ones."""
    remove_compiled(root)
    if made:
        for path in (*compiled_files(made), made / STAMP):  # The stamp says that all are there.
            shutil.copyfile(path, root / path.relative_to(made))


def compile_core(root: Path, folder: Path) -> Path:
    """Compile a copy of the core in a folder of its own; return the folder of what was made.

    Around the copy there is nothing else of the package, which mypy would look into.
    """
    from mypyc.build import mypycify
    from setuptools import Distribution
    from setuptools.command.build_ext import build_ext

    class ParallelBuild(build_ext):
        def build_extensions(self) -> None:
            self.compiler.compile = at_once(self.compiler.compile)
            super().build_extensions()

    shutil.copytree(root / CORE, folder / CORE, ignore=shutil.ignore_patterns("*.so", "*.pyd"))
    (folder / CORE.parent / "__init__.py").touch()
    with chdir(folder):
        names = [str(path.relative_to(folder)) for path in sources(folder)]
        options = ["--strict", "--config-file=", "--cache-dir=cache"]
        how: Any = {"multi_file": True, "group_name": GROUP, "target_dir": "c"}
        modules = mypycify([*options, *names], opt_level=OPTIMIZE, **how)
        for module in modules:
            module.extra_compile_args = [*module.extra_compile_args, *FLAGS]
        modules[0].sources = units(modules[0].sources)  # The others only lead to this one.
        command = ParallelBuild(Distribution({"name": GROUP, "ext_modules": modules}))
        command.build_lib, command.build_temp, command.parallel = "made", "c", CORES
        command.ensure_finalized()
        command.run()
    made = folder / "made"
    (made / STAMP).write_text(stamp(folder), "utf-8")  # Somebody may be writing in the root.
    return made


def units(files: list[str]) -> list[str]:
    """Return the files of C to compile: one that includes most, and those that stand apart."""
    apart = [name for name in files if APART.intersection(Path(name).stem.split("___"))]
    hits = Path("c", "hits.c")
    names = [Path(name).name for name in files if name not in apart]
    hits.write_text("".join(f'#include "{name}"\n' for name in names), "utf-8")
    return [str(hits), *apart]


def at_once(compile_files: Callable[..., list[str]]) -> Callable[..., list[str]]:
    """Return what compiles files on all cores, as ``compile_files`` does one after the other."""

    def compile_all(files: list[str], **how: Any) -> list[str]:
        with ThreadPoolExecutor(CORES) as pool:
            made = pool.map(lambda name: compile_files([name], **how), files)
            return [name for names in made for name in names]

    return compile_all


def main() -> None:
    """Compile in place, and say so."""
    root, began = Path(__file__).parent, time.monotonic()
    if is_up_to_date(root):
        print("The core is compiled as its sources are.")
        return
    remove_compiled(root)
    try:
        with TemporaryDirectory() as folder:
            put_in_place(compile_core(root, Path(folder)), root)
    except (Exception, SystemExit) as error:  # mypyc ends with SystemExit.
        sys.exit(stays_plain(error))
    count, seconds = len(sources(root)), time.monotonic() - began
    print(f"The {count} files of {CORE.as_posix()} are compiled, in {seconds:.0f} s.")


if __name__ == "__main__":
    main()
