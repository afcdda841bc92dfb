"""Pairs of a scan segment with a map segment, gathered row by row."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidArgumentError
from .layout import LEAST_POINTS, Floats, X, Y
from .segments import MeasuredSegments, Segments

Indices = NDArray[np.intp]
Point = Floats | tuple[float, float]

MIN_SIGMA = 1e-12  # m; a smaller one that is not 0 counts as this, so that its square is not lost
SCAN, MAP = 0, 1  # columns of the (n, 2) indices that name pairs


@dataclass(frozen=True, slots=True, eq=False)
class Correspondences:
    """n pairs, a row each.

    Build with :meth:`of`, which validates. Map quantities are in the map frame, the others in the scan frame.

    Attributes
    ----------
    map_directions : (n, 2) unit directions of the map segments
    map_midpoints : (n, 2) their midpoints, metres
    map_offsets : (n,) signed distances of the map lines from the map frame's origin, metres
    map_lengths : (n,) metres
    directions : (n, 2) unit directions of the scan segments
    midpoints : (n, 2) their midpoints, metres
    lengths : (n,) metres
    centroids : (n, 2) means of the points behind the scan segments, metres
    spreads : (n,) second moments of those points along the scan segments, m^2
    variances : (n,) variances of the scan segments' offsets, ``sigma^2 / points``, m^2
    """

    map_directions: Floats
    map_midpoints: Floats
    map_offsets: Floats
    map_lengths: Floats
    directions: Floats
    midpoints: Floats
    lengths: Floats
    centroids: Floats
    spreads: Floats
    variances: Floats

    @classmethod
    def of(cls, map_segments: Segments, scan: MeasuredSegments, pairs: ArrayLike) -> Correspondences:
        """Gather the segments that `pairs` names.

        Parameters
        ----------
        map_segments : Segments
        scan : MeasuredSegments
        pairs : (n, 2) integers
            ``[scan_index, map_index]`` per row; n may be 0, and an index may come more than once.

        Raises
        ------
        InvalidArgumentError
            When `pairs` is not such an array or an index is out of range; argument ``correspondences`` with the index
            of the first row at fault.
        """
        chosen, m, s = _as_pairs(pairs), map_segments, scan.segments
        _require_indices(chosen, len(s), len(m))
        i, j = chosen[:, SCAN], chosen[:, MAP]
        sigmas, counts = scan.sigma[i], scan.point_counts[i]
        variances = np.where(sigmas > 0.0, np.maximum(sigmas, MIN_SIGMA), 0.0) ** 2 / counts
        if not scan.counted and scan.point_counts.min(initial=LEAST_POINTS) < LEAST_POINTS:
            variances *= np.minimum(1.0, np.bincount(j, counts)[j] / LEAST_POINTS)
        on_map = m.directions[j], m.midpoints[j], m.offsets[j], m.lengths[j]
        seen = s.directions[i], s.midpoints[i], s.lengths[i], scan.centroids[i], scan.spreads[i]
        return cls(*on_map, *seen, variances)

    def __len__(self) -> int:
        return len(self.lengths)

    @property
    def map_normals(self) -> Floats:
        """Left normals of the map segments, (n, 2)."""
        return np.stack([-self.map_directions[:, Y], self.map_directions[:, X]], axis=1)

    @property
    def offsets(self) -> Floats:
        """Signed distances of the scan lines from the scan frame's origin, (n,) metres."""
        return cross(self.directions, self.midpoints)

    def angles(self, theta: float) -> Floats:
        """Return ``wrap(angle(d_map) - angle(d_scan) - theta)``, (n,) radians."""
        cosines = np.einsum("ij,ij->i", self.directions, self.map_directions)
        return wrapped(np.arctan2(cross(self.directions, self.map_directions), cosines) - theta)

    def take(self, rows: NDArray[np.bool_] | Indices | slice) -> Correspondences:
        """Return some of the pairs."""
        return Correspondences(*(getattr(self, name)[rows] for name in self.__slots__))

    def about(self, map_origin: Point, scan_origin: Point) -> Correspondences:
        """Return the pairs in frames that have been moved to two new origins, each (2,) metres in its old frame."""
        on_map = self.map_midpoints - map_origin
        return replace(
            self,
            map_midpoints=on_map,
            map_offsets=cross(self.map_directions, on_map),
            midpoints=self.midpoints - scan_origin,
            centroids=self.centroids - scan_origin,
        )


def cross(a: Floats, b: Floats) -> Floats:
    """Return ``a_x b_y - a_y b_x`` of two arrays (n, 2), (n,)."""
    return a[:, X] * b[:, Y] - a[:, Y] * b[:, X]


def wrapped(angles: Floats) -> Floats:
    """Return the same angles from -pi to pi, radians."""
    return angles - math.tau * np.rint(angles / math.tau)


def _require_indices(pairs: Indices, scan_count: int, map_count: int) -> None:
    for column, count, what in ((SCAN, scan_count, "scan"), (MAP, map_count, "map")):
        outside = (pairs[:, column] < 0) | (pairs[:, column] >= count)
        if outside.any():
            row = int(np.argmax(outside))
            expected = f"expected a {what} index from 0 to {count - 1}, found {pairs[row, column]}"
            message = expected if count else f"the {what} has no segments"
            raise InvalidArgumentError(message, argument="correspondences", index=row)


def _as_pairs(pairs: ArrayLike) -> Indices:
    try:
        rows = np.asarray(pairs)
    except (ValueError, OverflowError) as error:
        raise InvalidArgumentError("expected rows of [scan, map]", argument="correspondences") from error
    if rows.size == 0:
        return np.zeros((0, 2), dtype=np.intp)
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise InvalidArgumentError(f"expected shape (n, 2), found {rows.shape}", argument="correspondences")
    if rows.dtype.kind not in "iu":
        broken = rows.dtype.kind == "f" and (rows != np.floor(rows)).any(axis=1)
        index = int(np.argmax(broken)) if np.any(broken) else None
        raise InvalidArgumentError(f"expected integers, found {rows.dtype}", argument="correspondences", index=index)
    return np.ascontiguousarray(rows, dtype=np.intp)
