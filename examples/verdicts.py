"""The pictures of ``docs/guides/read-the-answer.md``: small scenes, searched when drawn, titled with their verdicts.

``python -m examples.verdicts`` writes them to ``docs``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from association import AssociationOptions, AssociationResult, HardPrior, MapIndex, Prior, Scan, associate
from formats.colours import CRITICAL, INK, OTHER, UNMATCHED, VERDICTS, verdict_of
from registration import MeasuredSegments, RigidTransform, Segments

FOLDER = Path(__file__).parents[1] / "docs"
LETTERS = 40  # of a title's line
MAP = "#c3c9d0"

# A floor of three unlike rooms on a corridor, metres; free space on the left.
FLOOR = np.array([
    [0, 0, 14, 0], [14, 0, 14, 2], [14, 2, 11, 2], [11, 2, 11, 6], [11, 6, 6.5, 6], [6.5, 6, 6.5, 2], [6.5, 2, 4, 2],
    [4, 2, 4, 5], [4, 5, 1.5, 5], [1.5, 5, 1.5, 4], [1.5, 4, 0, 4], [0, 4, 0, 0],
], dtype=float)  # fmt: skip
NICHE = np.array([[0, 0, 5, 0], [5, 0, 5, 4], [5, 4, 3, 4], [3, 4, 3, 5], [3, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
TWINS = np.vstack([NICHE, NICHE + np.tile([7.0, 0.0], 2)])
CORRIDOR = np.array([[0, 0, 24, 0], [24, 2, 0, 2]], dtype=float)
ELSEWHERE = np.array(
    [[0, 0, 3, 1], [3, 1, 2.2, 3.4], [2.2, 3.4, -0.8, 2.4], [-0.8, 2.4, -1.4, 1.2], [-1.4, 1.2, 0, 0]], dtype=float
)
HERE = RigidTransform(2.2, 1.6, 0.6)


@dataclass(frozen=True, slots=True)
class Scene:
    """A scan and the map that it is searched in.

    Attributes
    ----------
    title : str
        The special feature of the scene, in words.
    walls : (n, 4) metres
    seen : (m, 4) metres, in the map frame as if nothing were odd; what of it was not there is the caller's to know
    at : RigidTransform
        Of the sensor.
    prior : Prior or None
    factor, mirrored : float, bool
        By what the scan is sent too large, and whether left and right are exchanged.
    """

    title: str
    walls: np.ndarray
    seen: np.ndarray
    at: RigidTransform = HERE
    prior: Prior | None = None
    factor: float = 1.0
    mirrored: bool = False

    @property
    def scan(self) -> Scan:
        """As it is sent."""
        ends = self.factor * self.at.inverse().apply(self.seen.reshape(-1, 2, 2)).reshape(-1, 4)
        if self.mirrored:
            ends = (ends.reshape(-1, 2, 2)[:, ::-1] * [1.0, -1.0]).reshape(-1, 4)
        return Scan(MeasuredSegments.from_segments(Segments.from_array(ends), 0.02))

    def answer(self) -> AssociationResult:
        """Search it."""
        options = AssociationOptions(max_alternatives=5)
        return associate(MapIndex.build(Segments.from_array(self.walls)), self.scan, self.prior, options)


def part(walls: np.ndarray, rows: Sequence[int], shrink: float = 0.1) -> np.ndarray:
    """Return some walls, a little less of each than there is."""
    chosen = walls[list(rows)]
    begin, end = chosen[:, :2], chosen[:, 2:]
    along = (end - begin) / np.linalg.norm(end - begin, axis=1)[:, None]
    return np.hstack([begin + shrink * along, end - shrink * along])


def boxes(count: int, seed: int = 4) -> np.ndarray:
    """Return the fronts of so many boxes about the sensor."""
    rng = np.random.default_rng(seed)
    pieces = []
    for k in range(count):
        bearing = math.tau * (k + 0.5) / count
        middle = np.array([HERE.x, HERE.y]) + rng.uniform(1.1, 1.5) * np.array([math.cos(bearing), math.sin(bearing)])
        turn = bearing + 0.5 * math.pi + rng.uniform(-0.6, 0.6)
        half = 0.4 * np.array([math.cos(turn), math.sin(turn)])
        pieces.append([*(middle - half), *(middle + half)])
    return np.array(pieces)


def reasons() -> list[Scene]:
    """Return a scene for each answer that a robot may not go by."""
    shift = np.tile([9.0, 2.0], 2)
    corridor = np.array([[8.0, 0.0, 15.0, 0.0], [15.0, 2.0, 8.0, 2.0]])
    return [
        Scene("two equal rooms", TWINS, part(TWINS, range(6))),
        Scene("two walls of a room", FLOOR, part(FLOOR, (0, 11), 0.6)),
        Scene("one short wall across", np.vstack([CORRIDOR, [[24, 0, 24, 2]]]),
              np.vstack([corridor + np.tile([8.0, 0.0], 2), [[24.0, 0.9, 24.0, 1.3]]]), RigidTransform(20.0, 1.0, 0.3)),
        Scene("boxes all round", FLOOR, np.vstack([part(FLOOR, (0, 11), 0.8), boxes(6)])),
        Scene("a corridor without its ends", CORRIDOR, corridor, RigidTransform(11.0, 1.0, 0.2)),
        Scene("another building", FLOOR, ELSEWHERE + shift, RigidTransform(9.8, 3.6, 0.3)),
        Scene("a window in the wrong room", FLOOR, part(FLOOR, (0, 6, 7, 8, 9, 10, 11)),
              prior=HardPrior(RigidTransform(9.0, 3.5, 0.6), 1.5, 0.5)),
        Scene("all is well", FLOOR, part(FLOOR, (0, 6, 7, 8, 9, 10, 11))),
    ]  # fmt: skip


def mistakes() -> list[Scene]:
    """Return scenes of a caller's mistakes."""
    seen = part(FLOOR, (0, 6, 7, 8, 9, 10, 11))
    return [
        Scene("laser upside down", FLOOR, seen, mirrored=True),
        Scene("sent in feet", FLOOR, seen, factor=1.0 / 0.3048),
        Scene("sent in centimetres", FLOOR, seen, factor=100.0),
    ]


def draw(scene: Scene, scan_axes: Axes, map_axes: Axes) -> None:
    """Draw the scan as it was sent, and the map with the scan where the answer lays it."""
    answer, sent = scene.answer(), scene.scan.measured.segments.endpoints.reshape(-1, 2, 2)
    matched = {pair.scan for pair in answer.correspondences}
    colours = [INK if k in matched else UNMATCHED for k in range(len(sent))]
    scan_axes.add_collection(LineCollection(list(sent), colors=colours, linewidths=1.8))
    scan_axes.plot(0.0, 0.0, marker=(3, 0, -90), color=INK, markersize=8)
    map_axes.add_collection(LineCollection(list(scene.walls.reshape(-1, 2, 2)), colors=MAP, linewidths=3.5))
    colour = VERDICTS[verdict_of(answer.status, usable=answer.usable)]
    if answer.pose is not None:
        for other in [one.pose for one in answer.alternatives if answer.diagnostics is not None
                      and one.score > 0.8 * answer.diagnostics.score]:  # fmt: skip
            _lay(map_axes, sent, other, OTHER, 0.8)
        _lay(map_axes, sent, answer.pose, colour, 1.8)
        if answer.unobservable is not None:
            _arrow(map_axes, answer.pose, answer.unobservable, 3.0, colour)
        hinge = None if answer.diagnostics is None else answer.diagnostics.critical_wall
        if hinge is not None and not answer.usable and answer.unobservable is None:
            wall = scene.walls[list(hinge.map)].reshape(-1, 2, 2)
            map_axes.add_collection(LineCollection(list(wall), colors=CRITICAL, linewidths=8.0, zorder=1.5))
    for axes in (scan_axes, map_axes):
        axes.autoscale()
        axes.margins(0.08)
        axes.set(aspect="equal", xticks=[], yticks=[])
        axes.spines[:].set_color("#e1e4e8")
    told = fill(", ".join(one.code for one in answer.reasons) or "usable", LETTERS)
    scan_axes.set_title(fill(scene.title, 22), fontsize=8, color=INK)
    for axes in (scan_axes, map_axes):
        _scale(axes)
    warned = "".join(f"\nwarning: {one.code}" for one in answer.warnings)
    map_axes.set_title(f"{answer.status}\n{told}{warned}", fontsize=8, color=INK, weight="bold")


def _scale(axes: Axes) -> None:
    """Draw a bar of a round length below what is drawn."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    metres = 10.0 ** math.floor(math.log10(0.4 * (right - left)))
    y = low - 0.04 * (right - left)
    axes.plot([left, left + metres], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt")
    axes.text(left + 1.1 * metres, y, f"{metres:g} m", fontsize=7, va="center", color=INK)
    axes.set_ylim(low - 0.09 * (right - left), high)


def _legend(figure: Figure) -> None:
    """Name the colours of lines that are drawn, below the plots."""
    edges = [np.asarray(line.get_edgecolor(), dtype=float) for axes in figure.axes for line in axes.collections]
    drawn = {to_hex((red, green, blue)) for red, green, blue, _ in np.vstack(edges).tolist()}
    entries = [("map", MAP), ("matched scan segment, as sent", INK), ("unmatched", UNMATCHED), ("alternative", OTHER)]
    entries += [("critical wall", CRITICAL), *((f"pose: {name}", colour) for name, colour in VERDICTS.items())]
    handles = [Line2D([], [], color=c, linewidth=3.0, label=text) for text, c in entries if c in drawn]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=8)


def _lay(axes: Axes, sent: np.ndarray, pose: RigidTransform, colour: str, width: float) -> None:
    axes.add_collection(LineCollection(list(pose.apply(sent)), colors=colour, linewidths=width))
    axes.plot(pose.x, pose.y, marker=(3, 0, math.degrees(pose.theta) - 90.0), color=colour, markersize=8)


def _arrow(axes: Axes, pose: RigidTransform, direction: tuple[float, float], length: float, colour: str) -> None:
    for sign in (-length, length):
        end = pose.x + sign * direction[0], pose.y + sign * direction[1]
        axes.annotate("", end, (pose.x, pose.y), arrowprops={"arrowstyle": "->", "color": colour})


def picture(name: str, scenes: Sequence[Scene], columns: int) -> None:
    """Write one picture of several scenes."""
    rows = -(-len(scenes) // columns)
    figure = Figure(figsize=(4.6 * columns, 2.1 * rows + 0.6), layout="constrained")
    grid = figure.add_gridspec(rows, columns)
    for k, scene in enumerate(scenes):
        block = grid[k // columns, k % columns].subgridspec(1, 2, width_ratios=[1, 2])
        draw(scene, figure.add_subplot(block[0]), figure.add_subplot(block[1]))
    _legend(figure)
    path = FOLDER / f"{name}.png"
    figure.savefig(path, dpi=90)
    print(path)


def main() -> None:
    """Draw all."""
    picture("verdict-reasons", reasons(), 2)
    picture("verdict-causes", mistakes(), 2)


if __name__ == "__main__":
    main()
