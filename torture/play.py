"""Play the torture scenes by a simulator: `python -m torture.play pooltool`.

It makes an environment in `.venv-torture/`, installs the pinned version, plays all scenes there,
and writes `torture/results/NAME.json`. Without a name it plays them by every simulator.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from torture.scenes import SCENES, Scene, judge

HERE = Path(__file__).parent
ROOT = HERE.parent
ROUNDS, AT_MOST = 15, 60.0  # of timing, which ends after AT_MOST s
OURS = "ours"

# The simulators, and what pip installs for each, in this order.
PACKAGES: dict[str, tuple[tuple[str, ...], ...]] = {
    OURS: ((str(ROOT),),),
    "pooltool": (  # It asks for a development version of panda3d that the index does not have.
        ("--no-deps", "pooltool-billiards==0.6.0", "panda3d-simplepbr", "panda3d-gltf", "h11"),
        (
            "panda3d==1.10.16", "llvmlite<0.46", "numba<0.63", "rich<15", "attrs", "cattrs",
            "msgpack", "msgpack-numpy", "pyyaml", "click", "h5py", "numpy-quaternion",
            "pillow", "scipy",
        ),
    ),
    "pymunk": (("pymunk==7.3.1",),),
    "box2d": (("box2d-python==0.1.2",),),
    "billiards": (("billiards==0.5.0", "numpy<3"),),
}  # fmt: skip
PYTHONS = {"box2d": ((3, 12), (3, 13))}  # box2d-python has wheels for these alone.


def environment(name: str, python: str | None) -> Path:
    """Return the Python of a simulator's environment, which is made if it is not there."""
    home = ROOT / ".venv-torture" / name
    inside = home / "bin" / "python"
    if not (home / "installed").exists():
        shutil.rmtree(home, ignore_errors=True)
        subprocess.run([python or _python(name), "-m", "venv", str(home)], check=True)
        for what in PACKAGES[name]:
            subprocess.run([str(inside), "-m", "pip", "install", "-q", *what], check=True)
        (home / "installed").touch()
    return inside


def _python(name: str) -> str:
    """Return a Python of a version for which the simulator has wheels."""
    wanted = PYTHONS.get(name, (sys.version_info[:2],))
    names = [f"python{major}.{minor}" for major, minor in wanted]
    found = [shutil.which(each) for each in names]
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found += [str(path) for each in names for path in versions.glob(f"*/bin/{each}")]
    for path in [sys.executable, *filter(None, found)]:
        ask = [path, "-c", "import sys; print(*sys.version_info[:2])"]
        answer = subprocess.run(ask, capture_output=True, text=True)
        if answer.stdout.split() in [[str(a), str(b)] for a, b in wanted]:
            return path
    raise SystemExit(f"{name} needs {' or '.join(names)}: give one by --python PATH")


class Player:
    """A player is a simulator that plays scenes in a process of its own, which ends with it."""

    def __init__(self, name: str, python: str | None = None) -> None:
        self.command = [str(environment(name, python)), "-m", f"torture.runners.by_{name}"]
        self.start()

    def start(self) -> None:
        """Start the process, which says at first what it is."""
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(self.command, stdin=pipe, stdout=pipe, text=True, cwd=ROOT)
        self.about = self._read()

    def _read(self) -> dict[str, Any]:
        assert self.process.stdout
        line = self.process.stdout.readline()
        if not line:
            return {"error": f"its process ended with {self.process.wait()}"}
        answer: dict[str, Any] = json.loads(line)
        return answer

    def play(self, scene: Scene, setting: str) -> dict[str, Any]:
        """Return its answer to a scene."""
        if self.process.poll() is not None:
            self.start()
        assert self.process.stdin
        request = {"scene": scene.plain(), "setting": setting, "limit": scene.limit}
        print(json.dumps(request), file=self.process.stdin, flush=True)
        return self._read()

    def close(self) -> None:
        """End its process."""
        self.process.kill()
        self.process.wait()


def result(scene: Scene, answer: dict[str, Any]) -> dict[str, Any]:
    """Return what is kept of an answer: errors by check, and the time."""
    if not ("states" in answer or "gradient" in answer):
        return answer
    return {
        "errors": {check.kind: float(f"{error:.3g}") for check, error in judge(scene, answer)},
        "seconds": float(f"{answer['seconds']:.3g}"),
    }


def timed(scene: Scene, peer: Player, ours: Player) -> dict[str, Any]:
    """Return errors and best times (s) by setting; ours and the peer take turns."""
    measured: dict[str, Any] = {}
    scene = replace(scene, looks=1)
    for setting, about in peer.about["settings"].items():
        if "only" in about["given"]:
            continue
        ends = time.monotonic() + AT_MOST
        for _ in range(ROUNDS):
            answer = result(scene, peer.play(scene, setting))
            if "seconds" not in answer:
                break
            beside = ours.play(scene, next(iter(ours.about["settings"])))["seconds"]
            best = measured.setdefault(setting, answer | {"beside": beside})
            best["seconds"] = min(best["seconds"], answer["seconds"])
            best["beside"] = float(f"{min(best['beside'], beside):.3g}")
            if time.monotonic() > ends:
                break
    return measured


def machine() -> dict[str, Any]:
    """Return the machine of the measurement."""
    cpu = Path("/proc/cpuinfo")
    lines = cpu.read_text().splitlines() if cpu.exists() else []
    model = next((line.split(":")[1].strip() for line in lines if "model name" in line), "")
    return {"system": f"{platform.system()} {platform.machine()}", "cpu": model,
            "cores": os.cpu_count()}  # fmt: skip


def is_for(given: dict[str, Any], scene: Scene) -> bool:
    """Tell whether a setting is for this scene: some are for timing, or for scenes of a kind."""
    return not given.get("ladder") and scene.plain().get(given.get("only", "name")) is not False


def play(name: str, scenes: list[Scene], python: str | None) -> dict[str, Any]:
    """Play scenes by every setting of a simulator, and return the results."""
    out: dict[str, Any] = {"name": name}
    with closing(Player(name, python)) as peer, closing(Player(OURS)) as ours:
        out |= {"versions": peer.about["versions"], "machine": machine()}
        out["settings"] = peer.about["settings"]
        out |= {"scenes": {}, "timed": {}}
        for scene in scenes:
            rows = out["scenes"].setdefault(scene.name, {})
            for setting, about in peer.about["settings"].items():
                if is_for(about["given"], scene):
                    rows[setting] = result(scene, peer.play(scene, setting))
                    rows[setting].pop("seconds", None)  # It may have compiled at first.
                    print(name, "|", scene.name, "|", setting, "|", rows[setting], flush=True)
            if scene.timed:
                out["timed"][scene.name] = timed(scene, peer, ours)
    return out


def main() -> None:
    """Play, and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    known = f"one or more of {', '.join(PACKAGES)}"
    parser.add_argument("names", nargs="*", choices=[[], *PACKAGES], metavar="NAME", help=known)
    parser.add_argument("--only", default="", metavar="REGEX", help="scenes with this in the name")
    parser.add_argument("--python", metavar="PATH", help="the Python to make an environment by")
    asked = parser.parse_args()
    scenes = [scene for scene in SCENES if re.search(asked.only, scene.name)]
    for name in asked.names or PACKAGES:
        out = play(name, scenes, asked.python)
        path = HERE / "results" / f"{name}.json"
        if asked.only and path.exists():
            old = json.loads(path.read_text())
            names = {scene.name for scene in SCENES}
            for key in ("scenes", "timed"):
                kept = {name: row for name, row in old[key].items() if name in names}
                out[key] = kept | out[key]
        path.write_text(json.dumps(out, indent=1) + "\n")


if __name__ == "__main__":
    main()
