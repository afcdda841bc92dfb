"""Pairs of a scan segment with a map segment, gathered row by row."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidArgumentError
from .segments import MeasuredSegments, Segments

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

MIN_SIGMA = 1e-12  # m; a smaller one that is not 0 counts as this, so that its square is not lost


@dataclass(frozen=True, slots=True, eq=False)
class Correspondences:
    """n pairs; row i of every array belongs to pair i.

    Build with :meth:`of`, which validates. Map quantities are in the map frame, the others in the scan frame.

    Attributes
    ----------
    map_directions : (n, 2) unit vectors
    map_midpoints : (n, 2) metres
    map_lengths : (n,) metres
    directions : (n, 2) unit vectors
    midpoints : (n, 2) metres
    lengths : (n,) metres
    centroids : (n, 2) mean of the points behind each scan segment, metres
    spreads : (n,) their second moment along it, m^2
    variances : (n,) of each scan segment's offset, ``sigma^2 / points``, m^2
    """

    map_directions: Floats
    map_midpoints: Floats
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
        rows = _checked_pairs(pairs, len(scan), len(map_segments))
        i, j = rows[:, 0], rows[:, 1]
        segments = scan.segments
        return cls(
            map_segments.directions[j],
            map_segments.midpoints[j],
            map_segments.lengths[j],
            segments.directions[i],
            segments.midpoints[i],
            segments.lengths[i],
            scan.centroids[i],
            scan.spreads[i],
            floored_sigma(scan.sigma[i]) ** 2 / scan.points[i],
        )

    def __len__(self) -> int:
        return len(self.lengths)

    @property
    def map_normals(self) -> Floats:
        """Left normals of the map segments, (n, 2)."""
        return _left(self.map_directions)

    @property
    def map_offsets(self) -> Floats:
        """Signed distances of the map lines from the map frame's origin, (n,) metres."""
        return _dots(self.map_normals, self.map_midpoints)

    @property
    def offsets(self) -> Floats:
        """Signed distances of the scan lines from the scan frame's origin, (n,) metres."""
        return _dots(_left(self.directions), self.midpoints)

    def angles(self, theta: float) -> Floats:
        """Return ``wrap(angle(d_map) - angle(d_scan) - theta)``, (n,) radians."""
        c, s = math.cos(theta), math.sin(theta)
        d = self.directions @ np.array([[c, s], [-s, c]])
        angles: Floats = np.arctan2(_dots(_left(d), self.map_directions), _dots(d, self.map_directions))
        return angles

    def runs_against(self, theta: float) -> NDArray[np.bool_]:
        """Tell which scan segments, turned by `theta`, run against their map segments."""
        return np.abs(self.angles(theta)) > 0.5 * math.pi

    def take(self, rows: NDArray[np.bool_] | Indices | slice) -> Correspondences:
        """Return some of the pairs."""
        return Correspondences(*(getattr(self, f.name)[rows] for f in fields(self)))

    def turned(self, rows: NDArray[np.bool_]) -> Correspondences:
        """Return the pairs with the scan segments of `rows` running the other way."""
        return replace(self, directions=np.where(rows[:, None], -self.directions, self.directions))

    def about(self, map_origin: Floats, scan_origin: Floats) -> Correspondences:
        """Return the pairs in frames that have been moved to two new origins, each (2,) metres in its old frame."""
        return replace(
            self,
            map_midpoints=self.map_midpoints - map_origin,
            midpoints=self.midpoints - scan_origin,
            centroids=self.centroids - scan_origin,
        )


def floored_sigma(sigma: ArrayLike) -> Floats:
    """Return standard deviations, metres, with those between 0 and 1e-12 m raised to 1e-12 m."""
    s = np.asarray(sigma, dtype=np.float64)
    return np.where(s > 0.0, np.maximum(s, MIN_SIGMA), 0.0)


def _left(directions: Floats) -> Floats:
    normals = np.empty_like(directions)
    np.negative(directions[:, 1], out=normals[:, 0])
    normals[:, 1] = directions[:, 0]
    return normals


def _dots(a: Floats, b: Floats) -> Floats:
    products: Floats = np.einsum("ij,ij->i", a, b)
    return products


def _checked_pairs(pairs: ArrayLike, scan_count: int, map_count: int) -> Indices:
    try:
        rows = np.asarray(pairs)
    except (ValueError, OverflowError) as error:
        raise InvalidArgumentError("expected rows of [scan, map]", argument="correspondences") from error
    if rows.size == 0:
        return np.zeros((0, 2), dtype=np.intp)
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise InvalidArgumentError(f"expected shape (n, 2), got {rows.shape}", argument="correspondences")
    if rows.dtype.kind not in "iu":
        broken = rows.dtype.kind == "f" and (rows != np.floor(rows)).any(axis=1)
        index = int(np.argmax(broken)) if np.any(broken) else None
        raise InvalidArgumentError(f"expected integers, got {rows.dtype}", argument="correspondences", index=index)
    for column, count, what in ((0, scan_count, "scan"), (1, map_count, "map")):
        bad = (rows[:, column] < 0) | (rows[:, column] >= count)
        if bad.any():
            index = int(np.argmax(bad))
            raise InvalidArgumentError(
                f"expected a {what} index from 0 to {count - 1}, got {rows[index, column]}"
                if count
                else f"the {what} has no segments",
                argument="correspondences",
                index=index,
            )
    return rows.astype(np.intp)
