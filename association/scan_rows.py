"""The scan as the search wants it: the most telling segments first, with what each is worth and how far to trust it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._match_kernels import MAX_ANGLE_GATE, REACH, SCAN_COLUMNS
from .options import AssociationOptions, Scan

Floats = NDArray[np.float64]

# What no sigma that is sent accounts for: maps drawn or built with some slack, walls that are not quite straight.
MODEL_OFFSET = 0.02  # m
MODEL_ANGLE = math.radians(0.6)
# Roughness of a wall and bias of the ranges shift neighbouring points together: no number of points averages it out. It
# decides the angle of short segments, which come with raw ranges.
COMMON_ERROR = 0.008  # m

# What finding a segment on a wall is worth against its being clutter, nats: a share of its own, and one by length.
GAIN = 6.0
GAIN_PER_METRE = 2.0
GAIN_LENGTH = 4.0  # m; beyond it a segment tells no more

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

    @property
    def total_gain(self) -> float:
        """What a scan that is found whole scores, nats."""
        return float(self.rows[:, 12].sum())


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
    measured, s = scan.measured, scan.measured.segments
    common = COMMON_ERROR if scan.beams is not None else 0.0
    line_var = measured.sigma**2 / measured.points
    offset_var = line_var + map_sigma**2 + MODEL_OFFSET**2
    angle_var = (line_var + common**2) / np.maximum(measured.spreads, 1e-6) + MODEL_ANGLE**2
    offset_var = np.maximum(offset_var, ((options.offset_tolerance or 0.0) / GATE_SIGMAS) ** 2)
    angle_var = np.maximum(angle_var, ((options.angle_tolerance or 0.0) / GATE_SIGMAS) ** 2)
    gains = GAIN + GAIN_PER_METRE * np.minimum(s.lengths, GAIN_LENGTH)
    angles = np.arctan2(s.directions[:, 1], s.directions[:, 0])
    order = np.lexsort((np.arange(len(s)), -s.lengths))
    rows = np.zeros((len(s), SCAN_COLUMNS))
    rows[:, :13] = np.column_stack(
        [s.directions, s.midpoints, s.lengths, angles, measured.centroids, measured.spreads, offset_var, angle_var,
         1.0 / offset_var, gains]
    )[order]  # fmt: skip
    rows[:, 14] = np.maximum(line_var + map_sigma**2, 1e-8)[order]
    rows[:, 13] = gains.sum() - np.cumsum(gains[order])
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
            max(options.min_overlap, 1e-3),
        ]
    )
