"""Prepare a scan for the search: its lines, the most informative first, with the gain and the variances of each."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from registration import MeasuredSegments
from registration.layout import Records
from registration.values import value

from ..layout import GATES, LINE_PARTS, MODEL, POINT, SIGHTING, VARIANCES, Integers, as_records, record
from ..options import AssociationOptions
from ..tables import Measured
from ..tuning import FREE_ANGLE, FREE_DISTANCE, GREATEST_ANGLE_GATE, REACH
from .kernels import describing
from .kernels.describing import describe_labelled
from .kernels.joining import join_lines, lines_of_a_view
from .scan import Scan, Views
from .tuning import (
    COMMON_ERROR,
    GATE_SIGMAS,
    LEAST_ANGLE_GATE,
    LEAST_OFFSET_GATE,
    LEAST_OVERLAP,
    LINE_ANGLE,
    LINE_LATERAL,
    MOST_LATERAL,
    MOST_TURN,
    VIEW_SIGMAS,
)

_describe_view, _mirror_lines = describing.describe_view, describing.mirror_lines
_set_map_sigma = describing.set_map_sigma


@value(frozen=True, slots=True)
class ScanLines:
    """A scan as the kernels take it.

    Attributes
    ----------
    row_of : (segments,) which row each segment of the scan is part of
    rows : (n,) of `SCAN_LINE`
    model : (1,) of `MODEL`
    sightings : (k,) of `SIGHTING`
        The part of them that each view shows, view by view; of one view the rows themselves.
    given : Measured or None
        The input that they were made from, of a scan of one view.
    """

    row_of: NDArray[np.intp]
    rows: Records
    model: Records
    sightings: Records
    given: Measured | None = None

    @classmethod
    def of(
        cls, scan: Scan, map_sigma: float | None, options: AssociationOptions, given: Measured | None = None
    ) -> ScanLines:
        """Join the segments that continue or repeat one another, and order them by their information; ties by index.

        Parameters
        ----------
        scan : Scan
        map_sigma : float or None
            Standard deviation of the map's lines, metres; None where it is not known.
        options : AssociationOptions
            If a tolerance is wider than the sigmas' own gate, the map is taken to be that far off.
        given : Measured or None
            Of other lines of the same scan, where there are any.
        """
        measured = scan.measured
        variances, model = variances_of(map_sigma or 0.0, options, with_beams=scan.beams is not None)
        if scan.views is None:
            given = given or _given(measured)
            row_of, rows, seen = _describe_view(given, measured.counted, options.oriented, variances, model)
            return cls(row_of, rows, model, seen, given)
        part_of, parts, views = parts_of(measured, scan.views, directed=options.oriented)
        line_row, rows = describe_labelled(
            *_joined_views(parts, scan.views, directed=options.oriented), variances, model
        )
        return cls(line_row[part_of], rows, model, _sightings(parts, views, line_row))

    def mirrored(self) -> ScanLines:
        """Return those of the scan with left and right exchanged, which has to be of one view."""
        rows, seen = _mirror_lines(self.rows)
        return ScanLines(self.row_of, rows, self.model, seen)


def _given(measured: MeasuredSegments) -> Measured:
    """Return segments as the kernels take them."""
    segments = measured.segments
    return Measured(
        as_records(POINT, segments.directions), as_records(POINT, segments.midpoints), segments.lengths,
        as_records(POINT, measured.centroids), measured.spreads, measured.sigma, measured.point_counts,
    )  # fmt: skip


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
    covariance, before = views.covariance, 0
    for v, pose in enumerate(views.poses):
        own = np.flatnonzero(views.of_segment == v)
        labels, lines = lines_of_a_view(_given(_taken(measured, own)), measured.counted, directed)
        part_of[own] = labels + before
        block = covariance[3 * v : 3 * v + 3, 3 * v : 3 * v + 3]
        levers = lines["dx"] * (lines["centroid_x"] - pose.x) + lines["dy"] * (lines["centroid_y"] - pose.y)
        g = np.stack([-lines["dy"], lines["dx"], levers], axis=1)
        lines["common_offset"] = np.maximum(0.0, np.einsum("ij,jk,ik->i", g, block, g))
        lines["common_angle"] = max(0.0, block[2, 2])
        found.append(lines)
        of_view.append(np.full(len(lines), v))
        before += len(lines)
    return part_of, np.concatenate(found), np.concatenate(of_view)


def _taken(measured: MeasuredSegments, rows: NDArray[np.intp]) -> MeasuredSegments:
    return replace(
        measured,
        segments=measured.segments.take(rows),
        sigma=measured.sigma[rows],
        point_counts=measured.point_counts[rows],
        centroids=measured.centroids[rows],
        spreads=measured.spreads[rows],
    )


def _joined_views(parts: Records, views: Views, *, directed: bool) -> tuple[Integers, Records]:
    """Join the parts of a line that several views show, so that it is one piece of evidence.

    The uncertainty of the viewpoints lets them lie so much farther apart. The line that they make is as uncertain as
    its parts, weighted by their lengths: their errors may be one.
    """
    lateral, turn = LINE_LATERAL, LINE_ANGLE
    if views.uncertain and len(parts):
        lateral = min(MOST_LATERAL, lateral + VIEW_SIGMAS * float(np.sqrt(parts["common_offset"].mean())))
        turn = min(MOST_TURN, turn + VIEW_SIGMAS * float(np.sqrt(parts["common_angle"].mean())))
    labels, lines = join_lines(parts, lateral, math.cos(turn), True, directed)
    weights = np.bincount(labels, parts["length"], len(lines))
    for name in ("common_offset", "common_angle"):
        lines[name] = np.bincount(labels, parts["length"] * parts[name], len(lines)) / weights
    return labels, lines


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
    variances = record(
        VARIANCES,
        common=COMMON_ERROR**2 if with_beams else 0.0,
        least_offset=((options.offset_tolerance or 0.0) / GATE_SIGMAS) ** 2,
        least_angle=((options.angle_tolerance or 0.0) / GATE_SIGMAS) ** 2,
    )
    model = record(MODEL, free_distance=FREE_DISTANCE, free_angle=FREE_ANGLE)
    _set_map_sigma(float(map_sigma), variances, model)
    return variances, model


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
