"""The scan as the search wants it: the most telling segments first, with what each is worth and how far to trust it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._match_kernels import MAX_ANGLE_GATE, REACH
from ._scan_kernels import fill_rows
from .options import AssociationOptions, Scan

Floats = NDArray[np.float64]

# Roughness of a wall and bias of the ranges shift neighbouring points together: no number of points averages it out. It
# decides the angle of short segments, which come with raw ranges.
COMMON_ERROR = 0.008  # m
LEAST_OVERLAP = 1e-3  # and as much less than all of a segment: its end may lie on a wall's

GATE_SIGMAS = 3.0
MIN_OFFSET_GATE = 0.08  # m
MIN_ANGLE_GATE = math.radians(4.0)

DEFAULT_OPTIONS = AssociationOptions()


@dataclass(frozen=True, slots=True)
class ScanRows:
    """A scan as rows for the kernels, the columns named in `_match_kernels`.

    Attributes
    ----------
    order : (n,) the scan index of each row
    rows : (n, 16)
    """

    order: NDArray[np.intp]
    rows: Floats


def scan_rows(scan: Scan, map_sigma: float, options: AssociationOptions = DEFAULT_OPTIONS) -> ScanRows:
    """Order a scan by what its segments tell; ties by index.

    Parameters
    ----------
    scan : Scan
    map_sigma : float
        Standard deviation of the map's lines, metres.
    options : AssociationOptions
        A tolerance wider than the sigmas' own gate says that the map is that far off.
    """
    measured, segments = scan.measured, scan.measured.segments
    order = np.argsort(-segments.lengths, kind="stable")
    rows = fill_rows(
        segments.directions, segments.midpoints, segments.lengths, measured.centroids, measured.spreads,
        measured.sigma, measured.points, order, float(map_sigma) ** 2, 0.0 if scan.beams is None else COMMON_ERROR**2,
        ((options.offset_tolerance or 0.0) / GATE_SIGMAS) ** 2, ((options.angle_tolerance or 0.0) / GATE_SIGMAS) ** 2,
    )  # fmt: skip
    return ScanRows(order, rows)


def gates(options: AssociationOptions) -> Floats:
    """Return the gates: sigmas, least and greatest offset (m), least and greatest angle (rad), least overlap."""
    offset, angle = options.offset_tolerance, options.angle_tolerance
    return np.array(
        [
            GATE_SIGMAS,
            MIN_OFFSET_GATE if offset is None else offset,
            REACH if offset is None else offset,
            MIN_ANGLE_GATE if angle is None else angle,
            MAX_ANGLE_GATE if angle is None else angle,
            min(max(options.min_overlap, LEAST_OVERLAP), 1.0 - LEAST_OVERLAP),
        ]
    )
