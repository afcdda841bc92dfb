"""The pictures of docs/concepts.md: ``python -m examples.concepts`` writes them there."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import linefix
from registration.layout import Floats

DOCS = Path(__file__).parents[1] / "docs"
ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
CORRIDOR = np.array([[0, 0, 14, 0], [14, 2, 0, 2]], dtype=float)
POSE = linefix.RigidTransform(1.5, 1.2, 0.7)
SCANNER = linefix.simulation.Scanner(beams=90, angle_increment=math.tau / 90, sigma=0.01)
MAP, SCAN, FREE = "#6e7781", "#d1242f", "#1a7f37"


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


def save(figure: Figure, name: str) -> None:
    """Write a figure beside the documents."""
    figure.savefig(DOCS / f"{name}.png", dpi=80)


def frames() -> None:
    """Draw a map, a scan, and the pose between them."""
    figure = Figure(figsize=(11, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    walls(left, ROOM, MAP, ticks=True)
    frame(left, linefix.RigidTransform(0.0, 0.0, 0.0), "map")
    left.set_title("A map: segments, free space on the left of each")
    points = seen(ROOM)
    walls(right, ROOM, MAP, width=1.0)
    for x, y in points:
        right.plot([POSE.x, x], [POSE.y, y], color="#eac54f", linewidth=0.5, zorder=0)
    right.plot(*points.T, ".", color=SCAN)
    frame(right, POSE, "laser")
    right.set_title("A scan, laid on the map by the laser's pose")
    save(figure, "concepts-frames")


def pairs() -> None:
    """Draw what a pose is found from: segments of the scan, and what is left of them on the map's lines."""
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    cut = linefix.vectorize(POSE.inverse().apply(seen(ROOM)))
    in_map = POSE.apply(cut.measured.segments.endpoints.reshape(-1, 2)).reshape(-1, 4)
    wrong = linefix.RigidTransform(0.35, 0.2, 0.12).apply(in_map.reshape(-1, 2)).reshape(-1, 4)
    for ax, segments, title in ((left, wrong, "A pose that does not fit"), (right, in_map, "The pose that does")):
        walls(ax, ROOM, MAP, width=5.0)
        for x1, y1, x2, y2 in segments:
            ax.plot([x1, x2], [y1, y2], color=SCAN, linewidth=2, zorder=10)
        ax.set_title(title)
    save(figure, "concepts-pairs")


def corridor() -> None:
    """Draw the direction that nothing fixes."""
    figure = Figure(figsize=(11, 2.4), layout="constrained")
    ax = figure.subplots()
    walls(ax, CORRIDOR, MAP, ticks=True)
    for x, alpha in ((4.0, 0.25), (7.0, 1.0), (10.0, 0.25)):
        ax.plot(x, 1.0, marker=(3, 0, -90), markersize=16, color=SCAN, alpha=alpha)
    arrow = {"arrowstyle": "<|-|>", "color": SCAN, "linewidth": 1.5}
    ax.annotate("", xy=(11.5, 1.0), xytext=(2.5, 1.0), arrowprops=arrow)
    ax.set_title("Along a corridor nothing fixes the pose: degenerate, with its unobservable direction")
    save(figure, "concepts-corridor")


if __name__ == "__main__":
    frames()
    pairs()
    corridor()
