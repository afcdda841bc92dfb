"""The scan as the search wants it: the most telling segments first, with what each is worth and how far to trust it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from registration.layout import Records

from .kernels.scans import describe_segments
from .layout import GATES, POINT, VARIANCES, Measured, as_records, record
from .options import AssociationOptions, Scan
from .tuning import (
    COMMON_ERROR,
    GATE_SIGMAS,
    GREATEST_ANGLE_GATE,
    LEAST_ANGLE_GATE,
    LEAST_OFFSET_GATE,
    LEAST_OVERLAP,
    REACH,
)


@dataclass(frozen=True, slots=True)
class ScanSegments:
    """A scan as the kernels are handed it.

    Attributes
    ----------
    order : (n,) the scan index of each row
    rows : (n,) of `SCAN_SEGMENT`
    """

    order: NDArray[np.intp]
    rows: Records

    @classmethod
    def of(cls, scan: Scan, map_sigma: float, options: AssociationOptions) -> ScanSegments:
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
        given = Measured(
            as_records(POINT, segments.directions), as_records(POINT, segments.midpoints), segments.lengths,
            as_records(POINT, measured.centroids), measured.spreads, measured.sigma, measured.points,
        )  # fmt: skip
        variances = record(
            VARIANCES,
            map=float(map_sigma) ** 2,
            common=0.0 if scan.beams is None else COMMON_ERROR**2,
            least_offset=((options.offset_tolerance or 0.0) / GATE_SIGMAS) ** 2,
            least_angle=((options.angle_tolerance or 0.0) / GATE_SIGMAS) ** 2,
        )
        return cls(order, describe_segments(given, order, variances))


@lru_cache
def gates(options: AssociationOptions) -> Records:
    """Return what a match has to pass, (1,) of `GATES`."""
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
