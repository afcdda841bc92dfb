"""The pictures of docs/concepts.md: ``python -m examples.concepts`` writes them there."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import linefix
from formats.colours import ESTIMATE, INK, MATCHED, UNMATCHED, WALL
from registration.layout import Floats

DOCS = Path(__file__).parents[1] / "docs"
ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
CORRIDOR = np.array([[0, 0, 14, 0], [14, 2, 0, 2]], dtype=float)
POSE = linefix.RigidTransform(1.5, 1.2, 0.7)
SCANNER = linefix.simulation.Scanner(beams=90, angle_increment=math.tau / 90, sigma=0.01)
MAP, BEAM, FREE = WALL, "#c9ced4", INK


def walls(ax: Axes, segments: Floats, colour: str, *, ticks: bool = False, width: float = 3.0) -> None:
    """Draw segments as arrows; `ticks` towards the free side of each."""
    for x1, y1, x2, y2 in segments:
        arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", xy=(x2, y2), xytext=(x1, y1), arrowprops=arrow)
        if ticks:
            along = np.array([x2 - x1, y2 - y1]) / math.hypot(x2 - x1, y2 - y1)
            middle = np.array([x1 + x2, y1 + y2]) / 2
            tip = middle + 0.35 * np.array([-along[1], along[0]])
            ax.plot(*zip(middle, tip, strict=True), color=FREE, linewidth=2)
    ends = segments.reshape(-1, 2)
    ax.set_xlim(ends[:, 0].min() - 0.7, ends[:, 0].max() + 0.7)
    ax.set_ylim(ends[:, 1].min() - 0.7, ends[:, 1].max() + 0.7)
    ax.set_aspect("equal")
    ax.set_axis_off()


def frame(ax: Axes, pose: linefix.RigidTransform, name: str) -> None:
    """Draw the axes of a frame: x long, y short."""
    for angle, length in ((0.0, 1.0), (0.5 * math.pi, 0.6)):
        tip = pose.compose(linefix.RigidTransform(length * math.cos(angle), length * math.sin(angle), 0.0))
        arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.5, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", xy=(tip.x, tip.y), xytext=(pose.x, pose.y), arrowprops=arrow)
    ax.text(pose.x - 0.1, pose.y - 0.1, name, ha="right", va="top")


def seen(segments: Floats) -> Floats:
    """Return the points of a scan from the pose, in the map frame."""
    taken = linefix.simulation.scan(linefix.Segments.from_array(segments), POSE, SCANNER, np.random.default_rng(1))
    points: Floats = POSE.apply(taken.points)
    return points


def scale(ax: Axes) -> None:
    """Draw a bar of one metre below the map."""
    x, y = ax.get_xlim()[0] + 0.3, ax.get_ylim()[0] + 0.2
    ax.plot([x, x + 1.0], [y, y], color=INK, linewidth=2.5, solid_capstyle="butt")
    ax.text(x + 1.1, y, "1 m", va="center", fontsize=9, color=INK)


def legend(figure: Figure, **entries: tuple[str, str]) -> None:
    """Name colours below the plots; each entry is a text and a marker or line style."""
    handles = [
        Line2D([], [], color=colour, label=text.replace("_", " "), marker="" if mark == "-" else mark,
               linestyle="-" if mark == "-" else "", linewidth=2.5)
        for text, (colour, mark) in entries.items()
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)


def save(figure: Figure, name: str) -> None:
    """Add a scale to each plot, and write a figure into the documents."""
    for ax in figure.axes:
        scale(ax)
    figure.savefig(DOCS / f"{name}.png", dpi=80)


def frames() -> None:
    """Draw a map, a scan, and the pose between them."""
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    walls(left, ROOM, MAP, ticks=True)
    frame(left, linefix.RigidTransform(0.0, 0.0, 0.0), "map")
    left.set_title("A map: segments with free space on the left")
    points = seen(ROOM)
    walls(right, ROOM, MAP, width=1.0)
    for x, y in points:
        right.plot([POSE.x, x], [POSE.y, y], color=BEAM, linewidth=0.5, zorder=0)
    right.plot(*points.T, ".", color=MATCHED)
    frame(right, POSE, "laser")
    right.set_title("A scan at the pose of the laser")
    legend(figure, wall=(MAP, "-"), free_side=(FREE, "-"), beam=(BEAM, "-"), measured_point=(MATCHED, "."))
    save(figure, "concepts-frames")


def pairs() -> None:
    """Draw the segments of a scan at a wrong pose and at the right one."""
    figure = Figure(figsize=(11, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    cut = linefix.vectorize(POSE.inverse().apply(seen(ROOM)))
    in_map = POSE.apply(cut.measured.segments.endpoints.reshape(-1, 2)).reshape(-1, 4)
    wrong = linefix.RigidTransform(0.35, 0.2, 0.12).apply(in_map.reshape(-1, 2)).reshape(-1, 4)
    for ax, segments, title, colour in (
        (left, wrong, "A wrong pose: no segment lies on its wall", UNMATCHED),
        (right, in_map, "The right pose: each segment lies on its wall", MATCHED),
    ):
        walls(ax, ROOM, MAP, width=5.0)
        for x1, y1, x2, y2 in segments:
            ax.plot([x1, x2], [y1, y2], color=colour, linewidth=2, zorder=10)
        ax.set_title(title)
    legend(figure, wall=(MAP, "-"), scan_segment_on_no_wall=(UNMATCHED, "-"), scan_segment_on_a_wall=(MATCHED, "-"))
    save(figure, "concepts-pairs")


def corridor() -> None:
    """Draw the unobservable direction of a corridor."""
    figure = Figure(figsize=(11, 3.2), layout="constrained")
    ax = figure.subplots()
    walls(ax, CORRIDOR, MAP, ticks=True)
    for x, alpha in ((4.0, 0.25), (7.0, 1.0), (10.0, 0.25)):
        ax.plot(x, 1.0, marker=(3, 0, -90), markersize=16, color=ESTIMATE, alpha=alpha)
    arrow = {"arrowstyle": "<|-|>", "color": ESTIMATE, "linewidth": 1.5}
    ax.annotate("", xy=(11.5, 1.0), xytext=(2.5, 1.0), arrowprops=arrow)
    ax.set_title("A corridor: the position along it is unobservable (degenerate)")
    legend(figure, wall=(MAP, "-"), free_side=(FREE, "-"), possible_pose=(ESTIMATE, ">"))
    save(figure, "concepts-corridor")


if __name__ == "__main__":
    frames()
    pairs()
    corridor()
