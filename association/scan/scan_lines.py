"""Prepare a scan for the search: its lines, the most informative first, with the gain and the variances of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from registration import MeasuredSegments
from registration.layout import Records, floats

from ..layout import GATES, LINE_PARTS, MODEL, SIGHTING, VARIANCES, Indices, as_records, record
from ..options import AssociationOptions
from ..tuning import FREE_ANGLE, FREE_DISTANCE, GREATEST_ANGLE_GATE, MODEL_OFFSET, REACH, ROUGHNESS
from .kernels.joining import describe_lines, join_lines
from .scan import Scan, Views
from .tuning import (
    COMMON_ERROR,
    CUT_COSINE,
    CUT_LATERAL,
    GATE_SIGMAS,
    LEAST_ANGLE_GATE,
    LEAST_OFFSET_GATE,
    LEAST_OVERLAP,
    LINE_ANGLE,
    LINE_COSINE,
    LINE_LATERAL,
    MOST_LATERAL,
    MOST_TURN,
    VIEW_SIGMAS,
)

_FIELDS = len(LINE_PARTS.names or ())
# Lateral offsets (m) and cosines. Of a view, first what was cut is joined, then what lies about on one line.
JOINTS = np.array([[CUT_LATERAL, CUT_COSINE], [LINE_LATERAL, LINE_COSINE]])


@dataclass(frozen=True, slots=True)
class ScanLines:
    """A scan as the kernels take it.

    Attributes
    ----------
    row_of : (segments,) which row each segment of the scan is part of
    rows : (n,) of `SCAN_LINE`
    model : (1,) of `MODEL`
    sightings : (k,) of `SIGHTING`
        The part of them that each view shows, view by view; of one view the rows themselves.
    """

    row_of: Indices
    rows: Records
    model: Records
    sightings: Records

    @classmethod
    def of(cls, scan: Scan, map_sigma: float | None, options: AssociationOptions) -> ScanLines:
        """Join the segments that continue or repeat one another, and order them by their information; ties by index.

        Parameters
        ----------
        scan : Scan
        map_sigma : float or None
            Standard deviation of the map's lines, metres; None where it is not known.
        options : AssociationOptions
            If a tolerance is wider than the sigmas' own gate, the map is taken to be that far off.
        """
        measured = scan.measured
        variances, model = variances_of(map_sigma or 0.0, options, with_beams=scan.beams is not None)
        if scan.views is None:
            row_of, lines = join_lines(_given(measured), JOINTS, measured.counted, options.oriented)
            model = _with_sensor(model, scan, lines)
            rows, seen = describe_lines(lines, variances, model)
            return cls(row_of, rows, model, seen)
        part_of, parts, views = parts_of(measured, scan.views, directed=options.oriented)
        line_row, lines = _joined_views(parts, scan.views, directed=options.oriented)
        model = _with_sensor(model, scan, lines)
        rows, _ = describe_lines(lines, variances, model)
        return cls(line_row[part_of], rows, model, _sightings(parts, views, line_row))

    def mirrored(self) -> ScanLines:
        """Return those of the scan with left and right exchanged, which has to be of one view."""
        rows, seen, model = self.rows.copy(), self.sightings.copy(), self.model.copy()
        for values in (rows["dx"], rows["y"], rows["centroid_y"], seen["dx"], seen["y"], model["sensor_y"]):
            np.negative(values, out=values)
        dx, dy = floats(rows, "dx", "dy")
        rows["angle"] = np.arctan2(dy, dx)
        return ScanLines(self.row_of, rows, model, seen)


def _with_sensor(model: Records, scan: Scan, lines: Records) -> Records:
    """Return a model with the sensor's place, or the middle of the lines where that is not known."""
    model = model.copy()
    middle = (float(lines["x"].mean()), float(lines["y"].mean())) if len(lines) else (0.0, 0.0)
    model["sensor_x"], model["sensor_y"] = scan.viewpoint or middle
    return model


def _given(measured: MeasuredSegments) -> Records:
    """Return each segment as a line of its own, (n,) of `LINE_PARTS`, without what `join_lines` writes."""
    segments = measured.segments
    rows = np.zeros((len(segments), _FIELDS))
    rows[:, :2], rows[:, 2:4], rows[:, 4] = segments.directions, segments.midpoints, segments.lengths
    rows[:, 6:8], rows[:, 8] = measured.centroids, measured.spreads
    rows[:, 9], rows[:, 10] = measured.point_counts, measured.sigma
    return as_records(LINE_PARTS, rows)


def parts_of(
    measured: MeasuredSegments, views: Views, *, directed: bool = True
) -> tuple[NDArray[np.intp], Records, NDArray[np.intp]]:
    """Join the parts of a line in each view; unless they are `directed`, also segments that run against one another.

    Returns
    -------
    (n,) the part of each segment
    (k,) of `LINE_PARTS`, with what is not known of where they were seen from
    (k,) the view of each
    """
    part_of = np.empty(len(measured), dtype=np.intp)
    found, of_view = [np.zeros(0, LINE_PARTS)], [np.zeros(0, dtype=np.intp)]
    covariance, given, before = views.covariance, _given(measured), 0
    for v, pose in enumerate(views.poses):
        own = np.flatnonzero(views.of_segment == v)
        labels, lines = join_lines(given[own], JOINTS, measured.counted, directed)
        part_of[own] = labels + before
        block = covariance[3 * v : 3 * v + 3, 3 * v : 3 * v + 3]
        x, y, dx, dy = floats(lines, "centroid_x", "centroid_y", "dx", "dy")
        g = np.stack([-dy, dx, dx * (x - pose.x) + dy * (y - pose.y)], axis=1)
        lines["common_offset"] = np.maximum(0.0, np.einsum("ij,jk,ik->i", g, block, g))
        lines["common_angle"] = max(0.0, block[2, 2])
        found.append(lines)
        of_view.append(np.full(len(lines), v))
        before += len(lines)
    return part_of, np.concatenate(found), np.concatenate(of_view)


def _joined_views(parts: Records, views: Views, *, directed: bool) -> tuple[Indices, Records]:
    """Join the parts of a line that several views show, so that it is one piece of evidence.

    The uncertainty of the viewpoints lets them lie so much farther apart. The line that they make is as uncertain as
    its parts, weighted by their lengths: their errors may be one.
    """
    lateral, turn = LINE_LATERAL, LINE_ANGLE
    if views.uncertain and len(parts):
        lateral = min(MOST_LATERAL, lateral + VIEW_SIGMAS * float(np.sqrt(parts["common_offset"].mean())))
        turn = min(MOST_TURN, turn + VIEW_SIGMAS * float(np.sqrt(parts["common_angle"].mean())))
    return join_lines(parts, np.array([[lateral, math.cos(turn)]]), True, directed)


def _sightings(parts: Records, views: NDArray[np.intp], rows: NDArray[np.intp]) -> Records:
    """Return the parts of the rows that each view shows."""
    seen = np.zeros(len(parts), SIGHTING)
    seen["sensor"], seen["row"] = views, rows
    for name in ("dx", "dy", "x", "y", "length", "centroid_x", "centroid_y", "spread", "variance"):
        seen[name] = parts[name]
    return seen[np.lexsort((rows, views))]


@lru_cache
def variances_of(map_sigma: float, options: AssociationOptions, *, with_beams: bool) -> tuple[Records, Records]:
    """Return the terms of the variances of lines, (1,) of `VARIANCES`, and of walls, (1,) of `MODEL`."""
    least_offset, least_angle = (
        ((tolerance or 0.0) / GATE_SIGMAS) ** 2 for tolerance in (options.offset_tolerance, options.angle_tolerance)
    )
    of_map, common = map_sigma * map_sigma, COMMON_ERROR**2 if with_beams else 0.0
    variances = record(VARIANCES, map=of_map, common=common, least_offset=least_offset, least_angle=least_angle)
    # If the tolerance is wider, the map is taken to be that far off.
    wall = max(of_map + (MODEL_OFFSET**2 - ROUGHNESS**2), least_offset)
    return variances, record(MODEL, wall_variance=wall, free_distance=FREE_DISTANCE, free_angle=FREE_ANGLE)


@lru_cache
def gates(options: AssociationOptions) -> Records:
    """Return the gates of a match, (1,) of `GATES`."""
    offset, angle = options.offset_tolerance, options.angle_tolerance
    return record(
        GATES,
        sigmas=GATE_SIGMAS,
        least_offset=LEAST_OFFSET_GATE if offset is None else offset,
        greatest_offset=REACH if offset is None else offset,
        least_angle=LEAST_ANGLE_GATE if angle is None else angle,
        greatest_angle=GREATEST_ANGLE_GATE if angle is None else angle,
        least_overlap=min(max(options.min_overlap, LEAST_OVERLAP), 1.0 - LEAST_OVERLAP),
    )
