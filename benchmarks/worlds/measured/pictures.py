"""Pictures of the drawn worlds, each with one scan, in a folder ``worlds`` next to the other pictures."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from registration.layout import Floats

from ...pictures import COLOURS, FOLDER, INK, save
from ..cases import Case, draw_case

CONDITIONS = ("clean", "clutter_33")
NORMAL = 0.15  # m; length of the strokes on the free side


def draw_worlds(worlds: Iterable[str], number: int = 0) -> None:
    """Draw one case of each world as mapped and one among clutter: what stands there, and what the scanner measured."""
    (FOLDER / "worlds").mkdir(parents=True, exist_ok=True)
    for world in worlds:
        figure = Figure(figsize=(16, 8), layout="constrained")
        for k, condition in enumerate(CONDITIONS):
            draw_scene(figure.add_subplot(1, len(CONDITIONS), k + 1), draw_case(world, condition, number))
        save(figure, f"worlds/{world}")


def draw_scene(ax: Axes, case: Case) -> None:
    """Draw what stood there, short strokes on the free sides, the scanner and the ends of its beams."""
    ax.add_collection(LineCollection(_lines(case.scene.endpoints), colors=INK, linewidths=0.7))
    normals = case.scene.midpoints + NORMAL * case.scene.normals
    strokes = _lines(np.hstack([case.scene.midpoints, normals]))
    ax.add_collection(LineCollection(strokes, colors=COLOURS[0], linewidths=0.4))
    points = case.pose.apply(case.points)
    ax.plot(points[:, 0], points[:, 1], ".", color=COLOURS[1], markersize=2)
    ax.plot(case.pose.x, case.pose.y, "o", color=COLOURS[3])
    ax.set_aspect("equal")
    ax.set_title(f"{case.world}, {case.condition}: {len(case.scene)} segments", color=INK)


def _lines(endpoints: Floats) -> list[Floats]:
    return list(endpoints.reshape(-1, 2, 2))
