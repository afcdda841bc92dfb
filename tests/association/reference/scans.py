"""Twins of the kernels that make lines of a scan's segments and describe them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from association.layout import LINE_PARTS, SCAN_LINE
from association.scan.tuning import LEAST_SPREAD, LEAST_VARIANCE, LINE_GAP
from association.tuning import GAIN, GAIN_LENGTH, GAIN_PER_METRE, LOOSE_WALLS, MODEL_ANGLE, MODEL_OFFSET, ROUGHNESS
from registration import MeasuredSegments, RigidTransform, Segments
from registration.layout import LEAST_POINTS, Floats, Record, Records

from .consensus import Pairs, log_determinant
from .geometry import TURN


def longest_first(lengths: Floats) -> list[int]:
    """Order by length, ties by index."""
    return sorted(range(len(lengths)), key=lambda i: (-lengths[i], i))


def collinear_segments(
    measured: MeasuredSegments, lateral: float, least_cosine: float, *, directed: bool = True
) -> list[int]:
    """Label segments by line: the longest that is left takes all that it can reach, one after the other."""
    segments = measured.segments
    left, labels, line = longest_first(segments.lengths), [-1] * len(segments), 0
    while left:
        first = left[0]
        d, middle = segments.directions[first], segments.midpoints[first]
        spans = {i: np.sort((segments.endpoints[i].reshape(2, 2) - middle) @ d) for i in left}
        beside = {i: abs(float((TURN @ d) @ (segments.midpoints[i] - middle))) for i in left}
        members = {first}
        while True:
            low, high = min(spans[i][0] for i in members), max(spans[i][1] for i in members)
            more = {
                i
                for i in left
                if (segments.directions[i] @ d if directed else abs(segments.directions[i] @ d)) >= least_cosine
                and beside[i] <= lateral
                and spans[i][0] <= high + LINE_GAP
                and spans[i][1] >= low - LINE_GAP
            }
            if more | members == members:
                break
            members |= more
        for i in members:
            labels[i] = line
        left = [i for i in left if i not in members]
        line += 1
    return labels


def new_lengths(spans: Floats) -> Floats:
    """Return of each interval (n, 2) how much none of those before it covers: of the stretches between all ends."""
    ends = np.unique(spans)
    middles, lengths = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)
    holds = (spans[:, :1] < middles) & (middles < spans[:, 1:])
    return np.array([lengths[own & ~holds[:k].any(axis=0)].sum() for k, own in enumerate(holds)])


def join_segments(measured: MeasuredSegments, labels: list[int]) -> Records:
    """Put a line through the points behind the segments of each label; one alone stays as it is."""
    lines = np.zeros(max(labels, default=-1) + 1, LINE_PARTS)
    for k, line in enumerate(lines):
        members = [i for i in longest_first(measured.segments.lengths) if labels[i] == k]
        _join(_of(measured, members), line)
    return lines


def _of(measured: MeasuredSegments, members: list[int]) -> MeasuredSegments:
    arrays = {name: getattr(measured, name)[members] for name in ("sigma", "point_counts", "centroids", "spreads")}
    return replace(measured, segments=measured.segments.take(members), **arrays)


def _join(measured: MeasuredSegments, line: Record) -> None:
    segments = measured.segments
    new = new_lengths(_spans(segments, segments.directions[0], segments.midpoints[0]))
    points = measured.point_counts * new / segments.lengths  # behind what overlaps those that were seen longest count
    mean, moment = _moments(measured, points)
    if len(segments) == 1:  # of which the points may lie next to it
        d = segments.directions[0]
        line["x"], line["y"] = segments.midpoints[0]
        line["length"] = segments.lengths[0]
    else:
        d = np.linalg.eigh(moment)[1][:, 1]
        d = d if d @ segments.directions[0] > 0.0 else -d
        spans = _spans(segments, d, mean)
        line["x"], line["y"] = mean + 0.5 * (spans.min() + spans.max()) * d
        line["length"] = spans.max() - spans.min()
    line["dx"], line["dy"] = d
    line["covered"] = new.sum()
    line["centroid_x"], line["centroid_y"] = mean
    line["spread"] = d @ moment @ d
    line["points"] = points.sum()
    if (measured.sigma[new > 0.0] > 0.0).all():
        on = new > 0.0
        of_one = points.sum() / (points[on] / measured.sigma[on] ** 2).sum()  # variance of one of the points
        line["variance"] = of_one / (points.sum() if measured.counted else max(LEAST_POINTS, points.sum()))
        line["sigma"] = math.sqrt(line["variance"] * line["points"])  # so that the points do not tell more than that


def _spans(segments: Segments, d: Floats, middle: Floats) -> Floats:
    """Return where segments lie along a direction, (n, 2): a segment's length along itself counts, not its shadow."""
    along: Floats = (segments.midpoints - middle) @ d
    return np.asarray(along[:, None] + 0.5 * segments.lengths[:, None] * np.array([-1.0, 1.0]))


def _moments(measured: MeasuredSegments, points: Floats) -> tuple[Floats, Floats]:
    """Return mean and second moment of two points a segment that have its mean and spread, weighed by its `points`."""
    root = np.sqrt(measured.spreads)[:, None] * measured.segments.directions
    both = np.concatenate([measured.centroids + root, measured.centroids - root])
    shares = np.tile(points, 2)
    mean = np.average(both, axis=0, weights=shares)
    off = both - mean
    return mean, np.einsum("i,ij,ik->jk", shares / shares.sum(), off, off)


def freedom_alone(line: Record, model: Record) -> float:
    """Return what freedom one line takes, on a wall that lies as it does."""
    wall = np.zeros(1, [("dx", float), ("dy", float), ("offset", float)])
    wall["dx"], wall["dy"] = line["dx"], line["dy"]
    alone = Pairs.of(np.array([line], SCAN_LINE), np.zeros(1, int), wall, float(model["wall_variance"]))
    return log_determinant(alone.information(RigidTransform(0.0, 0.0, 0.0).theta), model)


def describe_lines(lines: Records, variances: Record, model: Record) -> tuple[list[int], Records]:
    """Take one line at a time, the longest first; return their order and what is known of them."""
    order = longest_first(lines["length"])
    rows = np.zeros(len(order), SCAN_LINE)
    for row, line in zip(rows, lines[order], strict=True):
        for name in ("dx", "dy", "x", "y", "length", "centroid_x", "centroid_y", "spread"):
            row[name] = line[name]
        row["angle"] = math.atan2(line["dy"], line["dx"])
        row["offset_variance"] = max(variances["least_offset"], line["variance"] + variances["map"] + MODEL_OFFSET**2)
        spread = max(LEAST_SPREAD, line["spread"])
        angle = (line["variance"] + variances["common"]) / spread + MODEL_ANGLE**2
        row["angle_variance"] = max(variances["least_angle"], angle)
        row["weight"] = min(
            1.0 / (line["variance"] + ROUGHNESS**2), 1.0 / max(1e-300, variances["least_angle"] * spread)
        )
        row["gain"] = GAIN + GAIN_PER_METRE * min(line["covered"], GAIN_LENGTH)
        beyond = max(0.0, variances["map"] - LOOSE_WALLS**2)
        row["plain_variance"] = max(LEAST_VARIANCE, line["variance"] + beyond)
        row["freedom"] = freedom_alone(row, model)
    for k, row in enumerate(rows):
        row["later_gain"] = rows["gain"][k + 1 :].sum()
    return order, rows
