"""The pictures of docs/explanation/search.md: ``python -m benchmarks.search_pictures`` writes them.

A base and the poses that it gives, the likelihood field of a map, and the bounds of branch and bound on three levels.
"""

from __future__ import annotations

import math

import numpy as np
from association.index.likelihood_field import LikelihoodField
from association.search.kernels.branch_and_bound import bound_of
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import linefix
from examples.concepts import legend, save
from formats.colours import ESTIMATE, INK, MATCHED, UNMATCHED, WALL
from registration import MeasuredSegments, RegistrationError, RigidTransform, Segments
from registration.layout import Floats

from .worlds.cases import Question, questions

WORLD, CONDITION, NUMBER = "garage", "clutter_33", 0
SAME_ANGLE, LONG_ENOUGH = math.radians(2.0), 0.95
LEVELS = (5, 3, 0)
POINTS = 80
SEED = 20190901


def main() -> None:
    (question,) = questions([WORLD], [CONDITION], [NUMBER])
    truth = question.case.truth
    assert truth is not None
    _draw_base(question, truth)
    field = question.index.likelihood_field
    assert field is not None
    points = _points(question)
    _draw_field(question, truth, field, points)
    _draw_bounds(question, truth, field, points)


def _draw_base(question: Question, truth: RigidTransform) -> None:
    """Draw two scan segments, and the poses at which both lie on walls."""
    scan, map_segments = question.scans["ranges"].measured.segments, question.case.map
    base = _base_of(scan, map_segments)
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    _lines(left, scan.endpoints, UNMATCHED, 1.5)
    _lines(left, scan.endpoints[list(base)], MATCHED, 3.5)
    left.plot(0.0, 0.0, "o", color=INK)
    left.set_title("the scan, and a base of it", fontsize=10)
    _lines(right, map_segments.endpoints, WALL, 1.5)
    poses = _poses_of(scan, map_segments, base)
    for pose in poses:
        _robot(right, pose, MATCHED)
    _robot(right, truth, ESTIMATE, 11.0)
    right.set_title(f"the {len(poses)} poses that it gives on this map", fontsize=10)
    for ax in (left, right):
        ax.set_aspect("equal")
        ax.set_axis_off()
    legend(figure, scan=(UNMATCHED, "-"), base_and_its_poses=(MATCHED, "-"), map=(WALL, "-"), true_pose=(ESTIMATE, "o"))
    save(figure, "search-bases")


def _draw_field(question: Question, truth: RigidTransform, field: LikelihoodField, points: Floats) -> None:
    """Draw the field, and the points of the scan at the true pose."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    ax = figure.subplots()
    _field(ax, question, field, field.pyramid[0].astype(float), 1)
    ax.plot(*truth.apply(points).T, ".", color=MATCHED, markersize=5)
    _robot(ax, truth, ESTIMATE, 8.0)
    legend(figure, likelihood=(WALL, "-"), ends_of_beams_at_the_true_pose=(MATCHED, "."), true_pose=(ESTIMATE, "o"))
    save(figure, "search-field")


def _draw_bounds(question: Question, truth: RigidTransform, field: LikelihoodField, points: Floats) -> None:
    """Draw the bounds of the blocks of three levels at the true heading; white where they are below the true value."""
    shape = field.shape[0]
    turned = RigidTransform(0.0, 0.0, truth.theta).apply(points)
    cells = np.round(turned[:, ::-1] / shape["cell"]).astype(np.int32)
    x, y = np.array([truth.x, truth.y]) - question.index.origin
    row, column = int((y - shape["y0"]) / shape["cell"]), int((x - shape["x0"]) / shape["cell"])
    reached = bound_of(field.pyramid[0], cells, row, column, 1, 0)
    figure = Figure(figsize=(12.0, 4.0), layout="constrained")
    for ax, level in zip(figure.subplots(1, len(LEVELS)), LEVELS, strict=True):
        size = 1 << level
        rows, columns = (range(0, n, size) for n in field.pyramid[0].shape)
        bounds = np.array([[bound_of(field.pyramid[level], cells, r, c, size, 0) for c in columns] for r in rows])
        left = bounds >= reached
        _field(ax, question, field, np.where(left, bounds, np.nan), size, 0.9 * reached)
        ax.set_title(f"blocks of {size * shape['cell']:.1f} m: {left.sum():,} of {left.size:,} are left", fontsize=10)
        _robot(ax, truth, ESTIMATE, 8.0)
    legend(figure, greatest_possible_value=(WALL, "s"), true_pose=(ESTIMATE, "o"))
    save(figure, "search-branch-and-bound")


def _base_of(scan: Segments, map_segments: Segments) -> tuple[int, int]:
    """Return the two scan segments, at least 1 m long and not parallel, that give the fewest poses, but several."""
    longest = np.argsort(-scan.lengths)[:8].tolist()
    pairs = [(a, b) for a in longest for b in longest if a < b and abs(math.sin(_between(scan, a, b))) > 0.5]
    counts = {pair: len(_poses_of(scan, map_segments, pair)) for pair in pairs}
    return min((pair for pair in pairs if counts[pair] > 3), key=lambda pair: counts[pair])


def _between(segments: Segments, a: int, b: int) -> float:
    angles = np.arctan2(segments.directions[:, 1], segments.directions[:, 0])
    return float(angles[b] - angles[a])


def _poses_of(scan: Segments, map_segments: Segments, base: tuple[int, int]) -> list[RigidTransform]:
    """Return the pose for each two map segments with the angle of the base between them, and as long."""
    long_enough = [np.flatnonzero(map_segments.lengths >= LONG_ENOUGH * scan.lengths[k]).tolist() for k in base]
    measured, poses = MeasuredSegments.from_segments(scan), []
    for one in long_enough[0]:
        for other in long_enough[1]:
            apart = _between(map_segments, one, other) - _between(scan, *base)
            if abs(math.remainder(apart, math.tau)) > SAME_ANGLE:
                continue
            try:
                found = linefix.register(map_segments, measured, np.array([(base[0], one), (base[1], other)]))
            except RegistrationError:
                continue
            if found.pose is not None and _lies_on(scan, map_segments, found.pose, ((base[0], one), (base[1], other))):
                poses.append(found.pose)
    return poses


def _lies_on(scan: Segments, map_segments: Segments, pose: RigidTransform, pairs: tuple[tuple[int, int], ...]) -> bool:
    """Return whether the scan segments of some pairs lie between the ends of their map segments."""
    for k, wall in pairs:
        begin, end = map_segments.endpoints[wall].reshape(2, 2)
        along = (pose.apply(scan.endpoints[k].reshape(2, 2)) - begin) @ (end - begin) / ((end - begin) @ (end - begin))
        if along.min() < -0.1 or along.max() > 1.1:
            return False
    return True


def _points(question: Question) -> Floats:
    """Return some ends of beams in the scan frame."""
    beams = question.scans["ranges"].beams
    assert beams is not None
    seen = np.flatnonzero(np.isfinite(beams.ranges))
    some = np.random.default_rng(SEED).permutation(seen)[:POINTS]
    found: Floats = beams.ranges[some, None] * np.stack(
        [np.cos(beams.angles[some]), np.sin(beams.angles[some])], axis=1
    )
    return found


def _field(
    ax: Axes, question: Question, field: LikelihoodField, values: NDArray[np.float64], size: int, least: float = 0.0
) -> None:
    """Draw values of blocks of `size` cells, in the map frame, those of `least` in white."""
    shape, (x0, y0) = field.shape[0], question.index.origin
    rows, columns = values.shape
    left, bottom, step = shape["x0"] + x0, shape["y0"] + y0, size * shape["cell"]
    extent = (left, left + columns * step, bottom, bottom + rows * step)
    ax.imshow(values, origin="lower", extent=extent, cmap="Greys", vmin=least)
    ax.set_axis_off()


def _lines(ax: Axes, endpoints: Floats, colour: str, width: float) -> None:
    for x1, y1, x2, y2 in endpoints:
        ax.plot([x1, x2], [y1, y2], color=colour, linewidth=width, solid_capstyle="butt")


def _robot(ax: Axes, pose: RigidTransform, colour: str, size: float = 5.0) -> None:
    """Draw a pose: a dot, and the heading."""
    ax.plot(pose.x, pose.y, "o", color=colour, markersize=size)
    ax.plot(
        [pose.x, pose.x + math.cos(pose.theta)], [pose.y, pose.y + math.sin(pose.theta)], color=colour, linewidth=1.5
    )


if __name__ == "__main__":
    main()
