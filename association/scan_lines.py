"""The scan as the search wants it: its lines, the most telling first, what each is worth and how far to trust it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats, Records

from .kernels.scans import collinear_segments, describe_lines, join_segments
from .layout import GATES, LINE_PARTS, MODEL, POINT, VARIANCES, Integers, Measured, as_records, record
from .options import AssociationOptions, Scan
from .tuning import (
    COMMON_ERROR,
    CUT_COSINE,
    CUT_LATERAL,
    FREE_ANGLE,
    FREE_DISTANCE,
    GATE_SIGMAS,
    GREATEST_ANGLE_GATE,
    LEAST_ANGLE_GATE,
    LEAST_OFFSET_GATE,
    LEAST_OVERLAP,
    LINE_COSINE,
    LINE_LATERAL,
    MODEL_OFFSET,
    REACH,
    ROUGHNESS,
)


@dataclass(frozen=True, slots=True)
class ScanLines:
    """A scan as the kernels are handed it.

    Attributes
    ----------
    row_of : (segments,) which row each segment of the scan is part of
    rows : (n,) of `SCAN_LINE`
    model : (1,) of `MODEL`
    """

    row_of: NDArray[np.intp]
    rows: Records
    model: Records

    @classmethod
    def of(cls, scan: Scan, map_sigma: float | None, options: AssociationOptions) -> ScanLines:
        """Join the segments that continue or repeat one another, and order them by what they tell; ties by index.

        Parameters
        ----------
        scan : Scan
        map_sigma : float or None
            Standard deviation of the map's lines, metres; None where it is not known.
        options : AssociationOptions
            A tolerance wider than the sigmas' own gate says that the map is that far off.
        """
        measured, segments = scan.measured, scan.measured.segments
        given = Measured(
            as_records(POINT, segments.directions), as_records(POINT, segments.midpoints), segments.lengths,
            as_records(POINT, measured.centroids), measured.spreads, measured.sigma, measured.points,
        )  # fmt: skip
        cut, lines = _joined(given, CUT_LATERAL, CUT_COSINE, counted=True)
        whole = given if len(lines) == len(measured) else _measured(lines)
        apart, lines = _joined(whole, LINE_LATERAL, LINE_COSINE, counted=measured.counted)
        labels = apart if whole is given else apart[cut]
        variances, model = _variances(map_sigma or 0.0, options, with_beams=scan.beams is not None)
        order = np.argsort(-lines["length"], kind="stable")
        place = np.empty(len(order), dtype=np.intp)
        place[order] = np.arange(len(order))
        return cls(place[labels], describe_lines(lines, order, variances, model), model)


def _joined(given: Measured, lateral: float, cosine: float, *, counted: bool) -> tuple[Integers, Records]:
    """Join what continues or repeats one another; return (n,) the line of each segment, and the lines."""
    longest = np.argsort(-given.lengths, kind="stable")
    labels = collinear_segments(given, longest, lateral, cosine)
    lines = np.zeros(int(labels.max(initial=-1)) + 1, LINE_PARTS)
    join_segments(given, longest, labels, counted, lines)
    return labels, lines


def _measured(lines: Records) -> Measured:
    """Return lines as segments to be joined further."""

    def fixed(array: Floats) -> Floats:
        # As what was sent is: for a kernel an array that may be written to is another type.
        array.setflags(write=False)
        return array

    def points(x: str, y: str) -> Records:
        return as_records(POINT, fixed(np.stack([lines[x], lines[y]], axis=1)))

    lengths, spreads, counts = (fixed(lines[name].copy()) for name in ("length", "spread", "points"))
    sigma = fixed(np.sqrt(lines["variance"] * counts))
    return Measured(
        points("dx", "dy"), points("x", "y"), lengths, points("centroid_x", "centroid_y"), spreads, sigma, counts
    )


@lru_cache
def _variances(map_sigma: float, options: AssociationOptions, *, with_beams: bool) -> tuple[Records, Records]:
    """Return what goes into the variances of lines, (1,) of `VARIANCES`, and of walls, (1,) of `MODEL`."""
    of_map, wall = float(map_sigma) ** 2, MODEL_OFFSET**2 - ROUGHNESS**2
    least_offset = ((options.offset_tolerance or 0.0) / GATE_SIGMAS) ** 2
    return record(
        VARIANCES,
        map=of_map,
        common=COMMON_ERROR**2 if with_beams else 0.0,
        least_offset=least_offset,
        least_angle=((options.angle_tolerance or 0.0) / GATE_SIGMAS) ** 2,
    ), record(MODEL, wall_variance=max(of_map + wall, least_offset), free_distance=FREE_DISTANCE, free_angle=FREE_ANGLE)


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
