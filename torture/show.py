"""Make the tables and the picture of docs/beside-others.md and torture/README.md.

`python -m torture.show` does so.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from torture.play import HERE, PACKAGES, ROOT
from torture.scenes import SCENES, Scene

PAGES = ROOT / "docs" / "beside-others.md", HERE / "README.md"
PICTURE = ROOT / "docs" / "figures" / "beside-others.svg"
NAMES = {"ours": "pool_pymunk", "pymunk": "stock pymunk", "box2d": "Box2D"}
COLORS = {"ours": "#1b6e4b", "pooltool": "#c2410c", "pymunk": "#1d4ed8", "box2d": "#7e22ce",
          "billiards": "#111111"}  # fmt: skip
MARKS = {"ours": "*", "pooltool": "D", "pymunk": "o", "box2d": "s", "billiards": "^"}
Results = dict[str, dict[str, Any]]


def results() -> Results:
    """Return what was measured, by name."""
    files = {name: HERE / "results" / f"{name}.json" for name in PACKAGES}
    return {name: json.loads(path.read_text()) for name, path in files.items() if path.exists()}


def called(name: str) -> str:
    """Return the name of a simulator on the page."""
    return NAMES.get(name, name)


def short(number: float) -> str:
    """Return a number with two digits."""
    if 10 <= number < 1e5:
        return f"{float(f'{number:.2g}'):.0f}"
    return re.sub(r"e([-+])0*", r"e\1", f"{number:.2g}").replace("e+", "e")


def verdict(scene: Scene, row: dict[str, Any]) -> str:
    """Return the cell of one setting: survives, off by x, or not offered."""
    if "not offered" in row:
        return "not offered"
    if "error" in row:
        late = "TimeoutError" in row["error"]
        return f"**{'not done in ' + str(scene.limit) + ' s' if late else 'ends with an error'}**"
    errors = [(row["errors"][check.kind], check) for check in scene.checks]
    error, check = max(errors, key=lambda one: one[0] / one[1].tolerance)
    said = f"{short(error)} {check.unit}".strip()
    return f"✓ {said}" if error <= check.tolerance else f"**off by {said}**"


def table(rows: Iterator[list[str]]) -> str:
    """Return rows as a table; the first row is its head."""
    head, *body = list(rows)
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *body])


def for_all(found: Results) -> list[tuple[str, str]]:
    """Return the simulators with each setting that is for all scenes."""
    return [
        (name, setting)
        for name, result in found.items()
        for setting, about in result["settings"].items()
        if not {"ladder", "only"} & set(about["given"])
    ]


def counts(found: Results) -> Iterator[list[str]]:
    """Yield how many scenes each simulator plays, and in how many it is right."""
    yield ["who", "setting", "scenes", "right in"]
    for name, setting in for_all(found):
        rows = found[name]["scenes"]
        said = [verdict(scene, rows[scene.name][setting]) for scene in SCENES]
        offered = [one for one in said if one != "not offered"]
        right = sum(one.startswith("✓") for one in offered)
        yield [called(name), setting, str(len(offered)), str(right)]


def survivors(found: Results) -> Iterator[list[str]]:
    """Yield rows of results by setting; a setting for some scenes only is in the others' cells."""
    columns = for_all(found)
    yield ["scene", *(f"{called(name)}, {setting}" for name, setting in columns)]
    for scene in SCENES:
        cells = []
        for name, setting in columns:
            rows = found[name]["scenes"][scene.name]
            about = found[name]["settings"]
            cell = verdict(scene, rows[setting])
            for other in rows:
                if "only" in about[other]["given"] and "not offered" not in cell:
                    cell += f"; {other}: {verdict(scene, rows[other])}"
            cells.append(cell)
        yield [scene.name, *cells]


def scenes() -> Iterator[list[str]]:
    """Yield what the scenes are, and what counts as right."""
    yield ["scene", "what it is", "known by", "right within", "thread"]
    for scene in SCENES:
        right = ", ".join(f"{c.kind} {short(c.tolerance)} {c.unit}".strip() for c in scene.checks)
        number = "#" + scene.thread.rsplit("/", 1)[-1]
        where = scene.thread.split("/")[4] if scene.thread else ""
        thread = f"[{where} {number}]({scene.thread})" if scene.thread else ""
        yield [scene.name, scene.about, scene.known, right, thread]


def settings(found: Results) -> Iterator[list[str]]:
    """Yield the versions and settings of each simulator, and the page that recommends them."""
    yield ["who", "versions", "setting", "recommended by"]
    for name, result in found.items():
        versions = ", ".join(
            f"{package} {number}" for package, number in result["versions"].items()
        )
        for setting, about in result["settings"].items():
            link = about["link"]
            link = f"../{link}" if link.startswith("docs/") else link  # as torture/README.md has it
            why = f"[{about['why']}]({link})" if link else about["why"]
            yield [called(name), versions, setting, why]


def speeds(found: Results) -> Iterator[list[str]]:
    """Yield the best times beside the errors."""
    yield ["shot", "who", "setting", "off by", "ms", "event-driven in turn, ms", "ratio"]
    for scene in (scene for scene in SCENES if scene.timed):
        for name, result in found.items():
            for setting, row in result["timed"].get(scene.name, {}).items():
                off = f"{short(row['errors']['ends'])} m" if "ends" in row["errors"] else ""
                mine, ours = row["seconds"], row["beside"]
                times = [short(1e3 * mine), short(1e3 * ours), short(mine / ours)]
                yield [scene.name, called(name), setting, off, *times]


def machine(found: Results) -> str:
    """Return the machines of the measurements."""
    machines = [result["machine"] for result in found.values()]
    said = {f"{m['cpu']}, {m['cores']} cores, {m['system']}" for m in machines}
    return "; ".join(sorted(said))


def draw(found: Results) -> None:
    """Draw error over time for the shot that all can play."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "beside"
    import matplotlib.pyplot as plt

    scene = next(scene for scene in SCENES if scene.timed)
    figure, axes = plt.subplots(figsize=(7.6, 4.6), layout="constrained")
    for name, result in found.items():
        rows = sorted(result["timed"][scene.name].items(), key=lambda row: row[1]["seconds"])
        x = [1e3 * row["seconds"] for _, row in rows]
        y = [row["errors"]["ends"] for _, row in rows]
        look = {"color": COLORS[name], "marker": MARKS[name], "label": called(name)}
        axes.loglog(x, y, linestyle="-" if len(rows) > 2 else "", markersize=7, **look)
        for k, ((setting, _), a, b) in enumerate(zip(rows, x, y, strict=True)):
            said = setting.split(" s")[0] if len(rows) > 1 else ""
            below = name == "box2d" or (name == "ours" and k > 0)
            place = (4, -12) if below else (4, 5)
            axes.annotate(said, (a, b), place, textcoords="offset points", fontsize=7)
    axes.margins(0.09)
    axes.axhline(0.01, color="0.6", linewidth=0.8, linestyle=":")
    axes.annotate("right within 1 cm", (0.01, 0.012), xycoords=("axes fraction", "data"),
                  fontsize=7, color="0.4")  # fmt: skip
    axes.set_xlabel("time from plain numbers to ends (ms; best of up to fifteen)")
    axes.set_ylabel("farthest end off forty digits (m)")
    axes.set_title("Six balls on a table, two seconds, no losses", fontsize=10)
    axes.grid(which="major", color="0.9", linewidth=0.6)
    axes.legend(fontsize=8, loc="center right")
    figure.savefig(PICTURE, metadata={"Date": None})


def page(text: str, found: Results) -> str:
    """Return a page with its tables made anew."""
    made = {
        "counts": table(counts(found)),
        "survivors": table(survivors(found)),
        "scenes": table(scenes()),
        "settings": table(settings(found)),
        "speeds": table(speeds(found)),
        "machine": f"Measured on {machine(found)}.",
    }
    for name, block in made.items():
        before, begin, rest = text.partition(f"<!-- {name} -->\n")
        if begin:
            text = before + begin + block + "\n" + rest[rest.index("<!-- end -->") :]
    return text


def main() -> None:
    """Write the pages and the picture."""
    found = results()
    for path in PAGES:
        path.write_text(page(path.read_text(encoding="utf-8"), found), encoding="utf-8")
    draw(found)
    print("wrote", *(path.relative_to(Path.cwd()) for path in (*PAGES, PICTURE)))


if __name__ == "__main__":
    main()
