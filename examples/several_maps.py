"""The picture of docs/guides/several-maps.md, one scan on five floors: ``python -m examples.several_maps``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import linefix
from association import MapVerdict
from benchmarks.worlds import FLOOR_KINDS, draw_floors
from formats.colours import INK, MATCHED, UNMATCHED, WALL
from registration.layout import Floats

PICTURE = Path(__file__).parents[1] / "docs" / "several-maps.png"
KIND = FLOOR_KINDS["laboratories"]
SCANNER = linefix.simulation.Scanner(beams=720, sigma=0.01)
POSE = linefix.RigidTransform(20.0, 9.5, 0.7)
FLOOR = 1  # that the scan is taken on


def main() -> None:
    """Draw five floors, take a scan on one of them, and draw it at its best pose on each."""
    drawn = draw_floors(KIND, 5, np.random.default_rng(5))
    floors = {f"floor-{number}": one for number, one in enumerate(drawn)}
    ranges = linefix.simulation.scan(drawn[FLOOR], POSE, SCANNER, np.random.default_rng(FLOOR)).ranges
    laser = linefix.LaserScan(SCANNER.angle_min, SCANNER.angle_increment, ranges)
    answer = linefix.locate(linefix.index_maps(floors), laser)
    verdicts = {one.map_id: one for one in answer.maps}
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    axes = figure.subplots(3, 2).ravel()
    for ax, (name, floor) in zip(axes, floors.items(), strict=False):
        draw(ax, floor.endpoints, laser.points(), verdicts[name], usable=answer.usable and answer.map_id == name)
    axes[-1].set_axis_off()
    told = f"usable: {answer.usable}\nmap_id: {answer.map_id}\nprobability: {answer.probability:.4f}"
    axes[-1].text(0.1, 0.5, told, transform=axes[-1].transAxes, fontsize=13, color=INK, va="center")
    figure.savefig(PICTURE, dpi=90)
    print(f"Picture: {PICTURE}")


def draw(ax: Axes, walls: Floats, points: Floats, verdict: MapVerdict, *, usable: bool) -> None:
    """Draw a floor, and the points of the scan at its best pose there."""
    ax.plot(walls[:, [0, 2]].T, walls[:, [1, 3]].T, color=WALL, linewidth=1.2)
    title = f"{verdict.map_id}: {verdict.status}"
    if verdict.score is not None:
        title += f", score {verdict.score:.0f}, probability {verdict.probability or 0.0:.4f}"
    if verdict.pose is not None:
        at = verdict.pose.apply(points)
        ax.scatter(at[:, 0], at[:, 1], s=3, color=MATCHED if usable else UNMATCHED, zorder=3)
        ax.plot(verdict.pose.x, verdict.pose.y, "o", color=INK, markersize=5)
    ax.set_title(title, fontsize=9, color=INK)
    ax.set_aspect("equal")
    ax.set_axis_off()


if __name__ == "__main__":
    main()
