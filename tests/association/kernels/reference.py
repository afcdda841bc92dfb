"""Slow, obviously right references of the kernels that Python calls, and what is drawn for both."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from association.layout import LINE_PARTS, SCAN_LINE
from association.scan.tuning import LEAST_SPREAD, LEAST_VARIANCE, LINE_GAP
from association.tuning import GAIN, GAIN_LENGTH, GAIN_PER_METRE, LOOSE_WALLS, MODEL_ANGLE, MODEL_OFFSET, ROUGHNESS
from registration import MeasuredSegments, Segments
from registration.layout import LEAST_POINTS, Floats, Record, Records

SEEDS = st.integers(0, 2**31 - 1)
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])  # by 90 degrees


def assert_records(got: Records, expected: Records, **tolerance: Any) -> None:
    """Compare records field by field."""
    assert got.dtype == expected.dtype
    for name in expected.dtype.names or ():
        np.testing.assert_allclose(got[name], expected[name], err_msg=name, **tolerance)


def point(record: Record, x: str = "x", y: str = "y") -> Floats:
    """Return two fields of a record as a vector; of an array (n,) as (n, 2)."""
    return np.array((record[x], record[y])).T


# --- Walls of a map ---------------------------------------------------------------------------------------------------


def collinear_groups(ends: Floats, max_gap: float, max_lateral: float, max_angle: float) -> list[int]:
    """Compare every piece with the begin of every other; label by the lowest index that links lead to.

    One that begins along another has to end next to its line, too.
    """
    count = len(ends)
    label = list(range(count))
    turns = np.arctan2(ends[:, 3] - ends[:, 1], ends[:, 2] - ends[:, 0])
    for i in range(count):
        d = np.array([math.cos(turns[i]), math.sin(turns[i])])
        for j in range(count):
            begin, end = ends[j, :2] - ends[i, 2:], ends[j, 2:] - ends[i, 2:]
            length, along = math.dist(ends[i, :2], ends[i, 2:]), begin @ d
            aside, beyond = (abs(gap @ [-d[1], d[0]]) for gap in (begin, end))
            turn = abs(math.remainder(turns[j] - turns[i], math.tau))
            continues = abs(along) <= max_gap
            repeats = -length - max_gap <= along <= max_gap and beyond <= max_lateral
            if i != j and (continues or repeats) and aside <= max_lateral and turn <= max_angle:
                one, other = sorted((label[i], label[j]))
                label = [one if value == other else value for value in label]
    return label


# --- Lines of a scan --------------------------------------------------------------------------------------------------


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
    """Return half of the log-determinant of ``1 + F S`` for the information F of one line on a wall as it lies."""
    d, m = point(line, "dx", "dy"), point(line, "centroid_x", "centroid_y")
    n = TURN @ d
    rows = np.array([[*n, n @ TURN @ m], [0.0, 0.0, math.sqrt(line["spread"])]])
    variances = 1.0 / line["weight"] + np.array([model["wall_variance"], 0.0])
    s = np.diag([model["free_distance"], model["free_distance"], model["free_angle"]]) ** 2
    return 0.5 * float(np.log(np.linalg.det(np.eye(3) + (rows.T / variances) @ rows @ s)))


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
    return order, rows
