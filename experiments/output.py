"""Tables as CSV, figures as PNG, in one style."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

# Okabe and Ito's colours, told apart by every kind of colour vision.
INK, GREY, MAP = "#1b1f24", "#8a929c", "#a9b1ba"
BLUE, ORANGE, GREEN, VERMILION, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"
DPI = 100
COLOURS = 96  # of a PNG
DIGITS = 5

Cell = str | int | float


def write_table(path: Path, head: Sequence[str], rows: Iterable[Sequence[Cell]]) -> None:
    """Write rows as CSV, numbers with five digits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        for row in rows:
            writer.writerow([f"{cell:.{DIGITS}g}" if isinstance(cell, float) else cell for cell in row])


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure, inches, without a window."""
    matplotlib.use("Agg")
    matplotlib.rcParams.update(
        {
            "font.size": 9,
            "font.family": "DejaVu Sans",
            "axes.edgecolor": GREY,
            "axes.labelcolor": INK,
            "axes.titlesize": 10,
            "xtick.color": INK,
            "ytick.color": INK,
            "axes.grid": True,
            "grid.color": "#e4e7ea",
            "grid.linewidth": 0.6,
            "axes.axisbelow": True,
            "legend.frameon": False,
            "legend.fontsize": 8,
        }
    )
    return Figure(figsize=(width, height), dpi=DPI, facecolor="white", layout="constrained")


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG of few colours, which is a third of the size: the same bytes for the same picture."""
    full = io.BytesIO()
    figure.savefig(full, metadata={"Software": None})
    with Image.open(full) as image:
        image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def bars(axes: Axes, groups: Sequence[str], series: Sequence[tuple[str, Sequence[float], str]], form: str) -> None:
    """Draw bars side by side, a group for each label, with the numbers above.

    Parameters
    ----------
    axes : Axes
    groups : labels below
    series : (label, heights, colour) of each bar within the groups
    form : str
        Format of the numbers, like ".2f".
    """
    width = 0.84 / len(series)
    for k, (label, heights, colour) in enumerate(series):
        places = [g + (k - 0.5 * (len(series) - 1)) * width for g in range(len(groups))]
        drawn: Any = axes.bar(places, heights, 0.92 * width, label=label, color=colour)
        axes.bar_label(drawn, [f"{h:{form}}" for h in heights], padding=1.5, fontsize=7, color=INK)
    axes.set_xticks(range(len(groups)), groups)
    axes.grid(axis="x", visible=False)
    axes.margins(y=0.12)
