"""The picture: per case the scan as it was sent, and the map with the scan where the answer lays it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from formats.colours import AMBIGUOUS, INK, POINT, UNMATCHED, VERDICTS, verdict_of
from registration import RigidTransform, Segments

from .building import Case
from .words import comparison_in_words, equals, verdict_in_words

matplotlib.use("Agg")
Floats = NDArray[np.float64]

GREY, MAP = POINT, "#a9b1ba"
MARGIN = 1.2  # m about what is shown


@dataclass(frozen=True)
class Exhibit:
    """A case with the service's answer to it."""

    case: Case
    answer: dict[str, Any]


def draw(map_segments: Segments, exhibits: list[Exhibit], path: Path) -> None:
    """Write the picture of four cases as PNG."""
    matplotlib.rcParams.update({"font.size": 10, "font.family": "DejaVu Sans"})
    figure = Figure(figsize=(15.0, 9.6), dpi=100, facecolor="white")
    blocks = figure.add_gridspec(2, 2, left=0.008, right=0.992, top=0.9, bottom=0.05, wspace=0.03, hspace=0.3)
    for k, exhibit in enumerate(exhibits):
        block = blocks[k // 2, k % 2].subgridspec(1, 2, width_ratios=[1, 2], wspace=0.025)
        before, after = figure.add_subplot(block[0]), figure.add_subplot(block[1])
        numbers = {pair["scan"]: k + 1 for k, pair in enumerate(exhibit.answer["correspondences"])}
        _draw_scan(before, exhibit, numbers)
        _draw_map(after, map_segments, exhibit, numbers)
        _caption(before, exhibit)
    _legend(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def _colour_of(answer: dict[str, Any]) -> str:
    return VERDICTS[verdict_of(answer["status"], usable=answer["usable"])]


def _caption(axes: Any, exhibit: Exhibit) -> None:
    """Write case, verdict and truth above the scan."""
    answer = exhibit.answer
    colour = _colour_of(answer)
    verdict = axes.annotate(
        f"{answer['status']}, {'usable' if answer['usable'] else 'not usable'}",
        (0.0, 1.0),
        (6, 49),
        xycoords="axes fraction",
        textcoords="offset points",
        fontsize=13,
        weight="bold",
        color=INK if colour == AMBIGUOUS else "white",
        bbox={"boxstyle": "round,pad=0.35", "facecolor": colour, "edgecolor": "none"},
    )
    axes.annotate(
        exhibit.case.title, (1.0, 0.0), (14, 0), xycoords=verdict, textcoords="offset points", fontsize=13, color=INK
    )
    for line, height in (
        (f"Answer: {verdict_in_words(answer)}", 26),
        (f"Truth: {comparison_in_words(answer, exhibit.case.truth)}", 10),
    ):
        axes.annotate(line, (0.0, 1.0), (0, height), xycoords="axes fraction", textcoords="offset points", color=INK)


def _draw_scan(axes: Any, exhibit: Exhibit, numbers: dict[int, int]) -> None:
    """Draw the scan as it was sent, in the sensor's frame, with the segments found in it."""
    points = exhibit.case.scan.points
    axes.plot(*points.T, ".", color=GREY, markersize=1.6, zorder=1)
    segments = np.array(exhibit.answer["segments"]).reshape(-1, 2, 2)
    for i, ends in enumerate(segments):
        found = i in numbers
        axes.plot(
            *ends.T,
            color=INK if found else UNMATCHED,
            lw=2.2 if found else 1.4,
            ls="-" if found else (0, (2, 1.2)),
            zorder=3,
        )
        if found:
            _number(axes, ends, np.zeros(2), numbers[i], outward=True)
    _robot(axes, RigidTransform(0.0, 0.0, 0.0), INK)
    _frame(axes, np.vstack([points, [[0.0, 0.0]]]), "as sent")


def _draw_map(axes: Any, map_segments: Segments, exhibit: Exhibit, numbers: dict[int, int]) -> None:
    """Draw the map with the scan where the answer lays it, the other poses and the truth."""
    answer, truth = exhibit.answer, exhibit.case.truth
    walls = map_segments.endpoints.reshape(-1, 2, 2)
    axes.add_collection(LineCollection(list(walls), colors=MAP, linewidths=1.3, zorder=1))
    shown: list[Floats] = []
    points = exhibit.case.scan.points
    colour = _colour_of(answer)
    if answer["pose"] is None:
        shown.append(walls.reshape(-1, 2))
    else:
        pose = _transform(answer["pose"])
        laid = pose.apply(points)
        shown.append(laid)
        axes.plot(*laid.T, ".", color=colour, markersize=2.2, zorder=4)
        for pair in answer["correspondences"]:
            wall = walls[pair["map"]]
            axes.plot(*wall.T, color=INK, lw=2.0, zorder=2, solid_capstyle="butt")
            seen = pose.apply(np.array(answer["segments"][pair["scan"]]).reshape(2, 2))
            _number(axes, seen, np.array([pose.x, pose.y]), numbers[pair["scan"]])
        if answer["status"] == "ambiguous":
            for letter, other in zip("ABCDE", equals(answer), strict=False):
                there = _transform(other["pose"])
                ghost = there.apply(points)
                shown.append(ghost)
                axes.plot(*ghost.T, ".", color=GREY, markersize=1.2, zorder=3)
                _robot(axes, there, "white", edge=INK, label=letter)
        if answer["unobservable"] is not None:
            _free_direction(axes, pose, np.array(answer["unobservable"]), colour)
        _robot(axes, pose, colour)
    if truth is not None:
        shown.append(np.array([[truth.x, truth.y]]))
        axes.plot(truth.x, truth.y, "+", color=INK, markersize=15, markeredgewidth=1.6, zorder=7)
    _frame(axes, np.vstack(shown), "the map" if answer["pose"] is None else "the map, the scan laid on it")


def _transform(pose: dict[str, float]) -> RigidTransform:
    return RigidTransform(pose["x"], pose["y"], pose["theta"])


def _robot(axes: Any, pose: RigidTransform, colour: str, edge: str = "white", label: str = "") -> None:
    """Draw an arrow head that looks along the pose's x axis."""
    shape = pose.apply(0.45 * np.array([[1.3, 0.0], [-0.8, 0.8], [-0.4, 0.0], [-0.8, -0.8]]))
    axes.fill(*shape.T, facecolor=colour, edgecolor=edge, lw=1.1, zorder=6)
    if label:
        axes.annotate(label, (pose.x, pose.y), (9, 5), textcoords="offset points", weight="bold", color=INK, zorder=8)


def _number(axes: Any, ends: Floats, sensor: Floats, number: int, *, outward: bool = False) -> None:
    """Write a correspondence's number next to its scan segment, near its middle, on the sensor's side or the other."""
    (x, y), at = ends[1] - ends[0], ends[0] + 0.42 * (ends[1] - ends[0])
    normal = np.array([-y, x]) / math.hypot(x, y)
    if ((sensor - at) @ normal > 0.0) == outward:
        normal = -normal
    axes.annotate(
        str(number), at, 9.0 * normal, textcoords="offset points", ha="center", va="center", fontsize=8.5, zorder=8
    )


def _free_direction(axes: Any, pose: RigidTransform, direction: Floats, colour: str) -> None:
    middle = np.array([pose.x, pose.y])
    for sign in (-1.0, 1.0):
        axes.annotate(
            "",
            middle + sign * 5.0 * direction,
            middle + sign * 0.8 * direction,
            arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8},
            zorder=5,
        )


def _frame(axes: Any, points: Floats, label: str) -> None:
    """Show the points and a margin, as large as the axes allow, with a bar of round length."""
    box = axes.get_position()
    ratio = box.width * axes.figure.get_figwidth() / (box.height * axes.figure.get_figheight())
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    middle, size = 0.5 * (low + high), high - low
    width = max(float(size[0]), ratio * float(size[1]))
    axes.set_xlim(middle[0] - 0.5 * width, middle[0] + 0.5 * width)
    axes.set_ylim(middle[1] - 0.5 * width / ratio, middle[1] + 0.5 * width / ratio)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_color("#d5dae0")
    bar = 10.0 ** math.floor(math.log10(0.3 * width))
    bar *= 5.0 if 0.3 * width >= 5.0 * bar else 2.0 if 0.3 * width >= 2.0 * bar else 1.0
    x, y = middle[0] - 0.48 * width, middle[1] - 0.46 * width / ratio
    axes.plot([x, x + bar], [y, y], color=INK, lw=2.5, solid_capstyle="butt", zorder=9)
    axes.text(x + bar, y, f" {bar:g} m", va="center", fontsize=8.5, color=INK, zorder=9)
    axes.text(0.98, 0.03, label, transform=axes.transAxes, ha="right", fontsize=9, color="#4d5661", zorder=9)


def _legend(figure: Figure) -> None:
    def line(label: str, **style: Any) -> Line2D:
        return Line2D([], [], label=label, **style)

    figure.legend(
        handles=[
            line("map", color=MAP, lw=1.5),
            line("matched wall, with its number", color=INK, lw=2.2),
            line("on no map", color=UNMATCHED, lw=1.4, ls=(0, (2, 1.2))),
            line("measured point", color=GREY, marker=".", ls="", markersize=5),
            *(
                line(f"at the pose: {name.replace('_', ' ')}", color=colour, marker=(3, 0, -90), ls="", markersize=9)
                for name, colour in VERDICTS.items()
                if name != "no_match"
            ),
            line("A, B: alternatives", markerfacecolor="white", color=INK, marker=(3, 0, -90), ls="", markersize=9),
            line("truth", color=INK, marker="+", ls="", markersize=11, markeredgewidth=1.6),
        ],
        loc="lower left",
        bbox_to_anchor=(0.008, 0.005),
        ncols=9,
        frameon=False,
        fontsize=9,
        handletextpad=0.5,
        columnspacing=1.3,
    )
