"""Draw the diagram of the contact engine: ``python docs/figures/engine.py`` writes engine.svg."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

INK, FAINT = "#22262a", "#7d858d"
ROOMS = {"solvers": "#e3eef7", "core": "#fdf0d9", "core/motion": "#e2f2ea",
         "core/contact": "#f7e3e0", "results": "#f1e7f3"}  # fmt: skip

# Each box has its centre, its width, its height, its room and its text.
BOXES = {
    "scene": (1.2, 4.6, 1.9, 0.9, "solvers", "Scene\nballs, walls, law"),
    "near": (1.2, 2.8, 1.9, 1.2, "core", "Near\nboxes around paths,\nand a grid"),
    "predict": (
        4.2, 2.8, 2.2, 1.2, "core/motion",
        "Prediction\nwhen do two paths\nmeet, or a path and a wall?",
    ),
    "queue": (7.2, 2.8, 1.9, 1.2, "core", "Queue\nthe earliest\nprediction is next"),
    "instant": (7.2, 0.9, 1.9, 1.2, "core/contact", "One instant\nall contacts with\nclosed gaps"),
    "law": (4.2, 0.9, 2.2, 1.2, "core/contact", "Resolver and law\nvelocities after,\nor a policy"),
    "paths": (1.2, 0.9, 1.9, 1.2, "core", "New paths\nof the balls\nthat were hit"),
    "run": (4.2, -0.9, 2.2, 0.9, "results", "Recorder\nbreakpoints, events: a Run"),
}  # fmt: skip
ARROWS = (
    ("scene", "near"), ("near", "predict"), ("predict", "queue"), ("queue", "instant"),
    ("instant", "law"), ("law", "paths"), ("paths", "near"), ("law", "run"),
)  # fmt: skip


def edge(name: str, other: str) -> tuple[float, float]:
    """Return where an arrow between two boxes touches the first of them."""
    x, y, width, height, *_ = BOXES[name]
    dx, dy = BOXES[other][0] - x, BOXES[other][1] - y
    if abs(dx) > abs(dy):
        return (x + width / 2 * (1 if dx > 0 else -1), y)
    return (x, y + height / 2 * (1 if dy > 0 else -1))


def draw(axes: Axes) -> None:
    """Draw the boxes and the arrows between them."""
    axes.set(xlim=(0.0, 8.4), ylim=(-1.5, 5.2), aspect="equal")
    axes.axis("off")
    for x, y, width, height, room, text in BOXES.values():
        place = (x - width / 2 + 0.08, y - height / 2 + 0.08)
        style = "round,pad=0.08"
        axes.add_patch(FancyBboxPatch(place, width - 0.16, height - 0.16, boxstyle=style,
                                      facecolor=ROOMS[room], edgecolor=FAINT))  # fmt: skip
        head, _, rest = text.partition("\n")
        middle = y + (0.27 if rest.count("\n") else 0.18 if rest else 0.0)
        axes.text(x, middle, head, ha="center", va="center", fontsize=9, weight="bold", color=INK)
        axes.text(x, y - 0.15, rest, ha="center", va="center", fontsize=8, color=INK)
    for start, end in ARROWS:
        axes.annotate(
            "",
            edge(end, start),
            edge(start, end),
            arrowprops={"arrowstyle": "-|>", "color": INK, "shrinkA": 1, "shrinkB": 1},
        )
    for k, (room, color) in enumerate(ROOMS.items()):
        axes.add_patch(FancyBboxPatch((2.4 + 1.25 * k, 4.5), 0.14, 0.14, boxstyle="square,pad=0",
                                      facecolor=color, edgecolor=FAINT))  # fmt: skip
        axes.text(2.64 + 1.25 * k, 4.57, room, va="center", fontsize=8, color=INK)


def main() -> None:
    """Write the diagram beside this file; the same bytes each time."""
    with mpl.rc_context({"svg.hashsalt": "engine"}):
        figure = Figure((8.4, 6.7), layout="constrained", facecolor="white")
        draw(figure.subplots())
        figure.savefig(Path(__file__).with_suffix(".svg"), metadata={"Date": None})


if __name__ == "__main__":
    main()
