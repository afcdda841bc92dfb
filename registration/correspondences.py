"""Pairs of a scan segment with a map segment, gathered row by row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidArgumentError
from .kernels import pairs as kernels
from .layout import LEAST_POINTS, PAIR, Floats, Records, X, Y
from .segments import MeasuredSegments, Segments
from .tables import Drawn, Points

Indices = NDArray[np.intp]
Point = Floats | tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Correspondences:
    """n pairs, a row each.

    Build with :meth:`of`, which validates. Map quantities are in the map frame, the others in the scan frame.

    Attributes
    ----------
    rows : (n,) PAIR
        The values of the properties.
    """

    rows: Records

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
        rows = np.empty(len(chosen), PAIR)
        on_map, of_scan = Drawn(m.directions, m.midpoints, m.lengths), Drawn(s.directions, s.midpoints, s.lengths)
        points = Points(scan.centroids, scan.spreads, scan.sigma, scan.point_counts)
        row, column, fewest = kernels.fill_in(rows, chosen, on_map, of_scan, points)
        if row >= 0:
            count, what = (len(s), "scan") if column == kernels.SCAN else (len(m), "map")
            raise InvalidArgumentError(
                f"expected a {what} index from 0 to {count - 1}, found {chosen[row, column]}"
                if count
                else f"the {what} has no segments",
                argument="correspondences",
                index=row,
            )
        if not scan.counted and fewest < LEAST_POINTS:
            together = np.bincount(chosen[:, 1], scan.point_counts[chosen[:, 0]])[chosen[:, 1]]
            rows["scan"]["variance"] *= np.minimum(1.0, together / LEAST_POINTS)
        return cls(rows)

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def map_directions(self) -> Floats:
        """Unit directions of the map segments, (n, 2)."""
        return _vectors(self.rows["map"], "dx", "dy")

    @property
    def map_normals(self) -> Floats:
        """Left normals of the map segments, (n, 2)."""
        return _left(self.map_directions)

    @property
    def map_midpoints(self) -> Floats:
        """Midpoints of the map segments, (n, 2) metres."""
        return _vectors(self.rows["map"], "x", "y")

    @property
    def map_offsets(self) -> Floats:
        """Signed distances of the map lines from the map frame's origin, (n,) metres."""
        return self.rows["map"]["offset"]

    @property
    def map_lengths(self) -> Floats:
        """Lengths of the map segments, (n,) metres."""
        return self.rows["map"]["length"]

    @property
    def directions(self) -> Floats:
        """Unit directions of the scan segments, (n, 2)."""
        return _vectors(self.rows["scan"], "dx", "dy")

    @property
    def midpoints(self) -> Floats:
        """Midpoints of the scan segments, (n, 2) metres."""
        return _vectors(self.rows["scan"], "x", "y")

    @property
    def offsets(self) -> Floats:
        """Signed distances of the scan lines from the scan frame's origin, (n,) metres."""
        return _dots(_left(self.directions), self.midpoints)

    @property
    def lengths(self) -> Floats:
        """Lengths of the scan segments, (n,) metres."""
        return self.rows["scan"]["length"]

    @property
    def centroids(self) -> Floats:
        """Means of the points behind the scan segments, (n, 2) metres."""
        return _vectors(self.rows["scan"], "centroid_x", "centroid_y")

    @property
    def spreads(self) -> Floats:
        """Second moments of those points along the scan segments, (n,) m^2."""
        return self.rows["scan"]["spread"]

    @property
    def variances(self) -> Floats:
        """Variances of the scan segments' offsets, ``sigma^2 / points``, (n,) m^2."""
        return self.rows["scan"]["variance"]

    def angles(self, theta: float) -> Floats:
        """Return ``wrap(angle(d_map) - angle(d_scan) - theta)``, (n,) radians."""
        return kernels.relative_angles(self.rows, theta)

    def take(self, rows: NDArray[np.bool_] | Indices | slice) -> Correspondences:
        """Return some of the pairs."""
        return Correspondences(self.rows[rows])

    def about(self, map_origin: Point, scan_origin: Point) -> Correspondences:
        """Return the pairs in frames that have been moved to two new origins, each (2,) metres in its old frame."""
        (map_x, map_y), (scan_x, scan_y) = map_origin, scan_origin
        moved = np.empty(len(self), PAIR)
        kernels.move_origins(self.rows, float(map_x), float(map_y), float(scan_x), float(scan_y), moved)
        return Correspondences(moved)


def _vectors(records: Records, x: str, y: str) -> Floats:
    return np.stack([records[x], records[y]], axis=1)


def _left(directions: Floats) -> Floats:
    return np.stack([-directions[:, Y], directions[:, X]], axis=1)


def _dots(a: Floats, b: Floats) -> Floats:
    products: Floats = np.einsum("ij,ij->i", a, b)
    return products


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
