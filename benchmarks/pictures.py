"""Pictures of the figures, as PNG files in the folder that ``LINEFIX_BENCH_PICTURES`` names, by default ``out``."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

FOLDER = Path(os.environ.get("LINEFIX_BENCH_PICTURES") or "out")
INK = "#1b1f24"
COLOURS = ("#d1242f", "#0969da", "#1a7f37", "#8250df", "#bf8700", "#0a7d91", "#6e7781", "#cf5b9b")


def panels(rows: int, columns: int, size: tuple[float, float], title: str) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of plots in rows, inches per plot."""
    figure = Figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    figure.suptitle(title, color=INK)
    axes = [[figure.add_subplot(rows, columns, 1 + r * columns + c) for c in range(columns)] for r in range(rows)]
    for row in axes:
        for ax in row:
            ax.grid(True, which="major", color="#e6e8eb", linewidth=0.8)
            ax.set_axisbelow(True)
            ax.spines[["top", "right"]].set_visible(False)
    return figure, axes


def save(figure: Figure, name: str) -> None:
    """Write a figure and print its path."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{name}.png"
    figure.savefig(path, dpi=110)
    print(f"\nPicture: {path}")


@dataclass(frozen=True, slots=True)
class Curve:
    """Median and p95 in ms over something, with the goals that were set for some of its values."""

    over: str
    values: Sequence[float]
    times: Sequence[tuple[float, float]]
    goals: Mapping[int, tuple[float, float]] = field(default_factory=dict)


def draw_growth(
    curves: Sequence[Curve],
    indexes: Sequence[tuple[int, float, float]],
    sums: Sequence[tuple[int, tuple[float, float, float]]],
) -> None:
    """Draw the search's times, the index's seconds and megabytes by map size, and the sums' microseconds by pairs."""
    figure, [top, below] = panels(2, 3, (4.2, 3.4), "Growth of times")
    for ax, curve in zip(top, curves, strict=True):
        for k, name in enumerate(("median", "p95")):
            ax.plot(curve.values, [t[k] for t in curve.times], "o-", color=COLOURS[k], label=name)
            if curve.goals:
                goals = [g[k] for g in curve.goals.values()]
                ax.plot(list(curve.goals), goals, "_", markersize=14, color=COLOURS[k], label=f"goal, {name}")
        ax.set(yscale="log", xlabel=curve.over, ylabel="search, ms")
        if min(curve.values) > 0:
            ax.set(xscale="log")
        ax.legend(fontsize=8)
    for ax, k, unit in zip(below[:2], (1, 2), ("index, s", "index, MB"), strict=True):
        ax.plot([entry[0] for entry in indexes], [entry[k] for entry in indexes], "o-", color=COLOURS[3])
        ax.set(xscale="log", yscale="log", xlabel="map segments", ylabel=unit)
    for k, name in enumerate(("add one pair", "solve", "sum again")):
        below[2].plot([count for count, _ in sums], [times[k] for _, times in sums], "o-", color=COLOURS[k], label=name)
    below[2].set(xscale="log", yscale="log", xlabel="pairs in the sums", ylabel="us")
    below[2].legend(fontsize=8)
    save(figure, "growth")
