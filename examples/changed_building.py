"""The picture of docs/guides/keep-the-map-true.md: ``python -m examples.changed_building``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import linefix
from benchmarks.worlds import FAMILIES, free_place
from benchmarks.worlds.changes import rearranged
from formats.colours import CHANGES, INK, WALL
from map_quality import MapUpdate
from registration import RigidTransform, Segments
from simulation import Scanner

PICTURE = Path(__file__).parents[1] / "docs" / "keep-the-map-true.png"
SCANNER = Scanner.over(math.tau, 720, range_max=20.0, sigma=0.02)
PLACES, DAYS = 40, ("monday", "tuesday", "wednesday")


def main() -> None:
    """Draw a warehouse, change it, visit it on three days, and draw the changes that Linefix proposes."""
    mapped, today, visits = warehouse()
    update = linefix.update_map({"segments": mapped.endpoints, "sigma": 0.005}, visits)
    before, after = (getattr(update.usable, name) + getattr(update.held_back, name) for name in ("before", "after"))
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    ax = figure.subplots()
    draw(ax, mapped, today, update)
    scans = update.usable.scans + update.held_back.scans
    ax.set_title(f"{len(update.changes)} changes; usable scans of {scans}: {before} before, {after} after", color=INK)
    figure.savefig(PICTURE, dpi=90)
    print(f"Picture: {PICTURE}")


def warehouse() -> tuple[Segments, Segments, dict[str, list[linefix.LaserScan]]]:
    """Return the walls of a warehouse on the day of its map and today, and the scans of each visit."""
    rng = np.random.default_rng(4)
    mapped = FAMILIES["warehouse"].draw(rng).build(rng)
    today = rearranged(mapped, rng, 0.2)
    places = [free_place(today.segments, rng) for _ in range(PLACES)]
    visits = {day: [take(today.segments, place, rng) for place in places] for day in DAYS}
    return mapped.segments, today.segments, visits


def take(walls: Segments, place: RigidTransform, rng: np.random.Generator) -> linefix.LaserScan:
    """Return a scan near a place."""
    at = RigidTransform(place.x + rng.uniform(-0.1, 0.1), place.y + rng.uniform(-0.1, 0.1), rng.uniform(-3.0, 3.0))
    ranges = linefix.simulation.scan(walls, at, SCANNER, rng).ranges
    return linefix.LaserScan(SCANNER.angle_min, SCANNER.angle_increment, ranges, 0.0, SCANNER.range_max)


def draw(ax: Axes, old: Segments, today: Segments, update: MapUpdate) -> None:
    """Draw the building of today in grey, and the changes in colours: old walls dashed, new ones solid."""
    plot(ax, today.endpoints, WALL, 0.7, "-", "building of today")
    for code, colour in CHANGES.items():
        mine = [one for one in update.changes if one.code == code]
        gone = [old.endpoints[k] for one in mine for k in one.segments if code != "extended"]
        plot(ax, np.array(gone).reshape(-1, 4), colour, 2.6, (0, (1, 0.7)), None)
        new = [one.new for one in mine]
        plot(ax, np.concatenate([np.zeros((0, 4)), *new]), colour, 3.2, "-", None)
        if mine:
            ax.plot([], [], color=colour, linewidth=2.0, label=f"{code}: {len(mine)}")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.set_aspect("equal")
    ax.set_axis_off()


def plot(ax: Axes, ends: np.ndarray, colour: str, width: float, style: Any, label: str | None) -> None:
    """Draw segments."""
    for number, (x1, y1, x2, y2) in enumerate(ends):
        ax.plot([x1, x2], [y1, y2], linestyle=style, color=colour, linewidth=width, label=None if number else label)


if __name__ == "__main__":
    main()
