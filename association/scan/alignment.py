"""Views laid on one another before the search: a wall that two of them show is one, whatever the odometry.

A wall that two views show moves these views, if its distance from its neighbours exceeds the error of odometry. From
then on the moves affect the gates of the search, and nothing else. The answer's own pose and covariance go back to the
poses of odometry (`association.consensus.view_estimation`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats, Records

from ..deadline import Deadline
from ..layout import POINT, as_records
from ..tuning import MODEL_ANGLE, ROUGHNESS
from .kernels.alignment import pair_lines
from .scan import Scan, Views
from .scan_lines import parts_of
from .tuning import ALIGNED_LINES, ALIGNING_ROUNDS, ALIGNING_SHARE, LEAST_SPREAD
from .views import corrected

Indices = NDArray[np.intp]


def aligned(scan: Scan, deadline: Deadline, *, directed: bool = True) -> Scan:
    """Return a scan with its views laid on one another; one of exact views is returned as it is.

    After the deadline no round begins: the views stay where the rounds before have laid them. `directed`: whether the
    directions of its segments mean anything.
    """
    views = scan.views
    if views is None or not views.uncertain:
        return scan
    lines = _Lines.of(scan, views, directed=directed)
    found, spread = views.found, views.spread
    for _ in range(ALIGNING_ROUNDS):
        if deadline.passed:
            break
        shifts = (views.root @ (found - views.found)).reshape(-1, 3)
        seams = lines.moved(shifts).seams(views.root @ spread @ views.root.T, views.root)
        weighed = seams.jacobian * (ALIGNING_SHARE / seams.variances)[:, None]
        spread = np.asarray(np.linalg.inv(np.eye(len(found)) + seams.jacobian.T @ weighed))
        left = seams.residuals - seams.jacobian @ found
        found = np.asarray(spread @ (weighed.T @ -left))
        # If lines do not fit one another as they should, some of them are not one.
        worse = max(1.0, float(np.mean((left + seams.jacobian @ found) ** 2 / seams.variances)) if len(left) else 1.0)
        spread = spread * worse
    return corrected(scan, found, 0.5 * (spread + spread.T))


@dataclass(frozen=True, slots=True)
class _Seams:
    """Distances of lines that are one in two views: offsets and sines of angles, with their variances.

    Attributes
    ----------
    residuals, variances : (k,)
    jacobian : (k, 3 u)
        By the variates of `Views.root`.
    """

    residuals: Floats
    variances: Floats
    jacobian: Floats


@dataclass(frozen=True, slots=True)
class _Lines:
    """The longest lines of each view, and where the views were.

    Attributes
    ----------
    lines : (n,) of `LINE_PARTS`, view by view
    of_view : (n,)
    places : (v, 2) metres
    """

    lines: Records
    of_view: Indices
    places: Floats

    @classmethod
    def of(cls, scan: Scan, views: Views, *, directed: bool) -> _Lines:
        _, parts, of_view = parts_of(scan.measured, views, directed=directed)
        order = np.lexsort((-parts["length"], of_view))
        rank = np.arange(len(order)) - np.searchsorted(of_view[order], of_view[order])
        chosen = order[rank < ALIGNED_LINES]
        places = np.array([[pose.x, pose.y] for pose in views.poses])
        return cls(np.ascontiguousarray(parts[chosen]), of_view[chosen], places)

    def moved(self, shifts: Floats) -> _Lines:
        """Return them with the views' poses moved by (x, y, theta) each, (v, 3)."""
        out = self.lines.copy()
        moved = shifts[self.of_view]
        c, s = np.cos(moved[:, 2]), np.sin(moved[:, 2])
        ox, oy = self.places[self.of_view].T
        for x, y in (("x", "y"), ("centroid_x", "centroid_y")):
            px, py = self.lines[x] - ox, self.lines[y] - oy
            out[x], out[y] = c * px - s * py + ox + moved[:, 0], s * px + c * py + oy + moved[:, 1]
        dx, dy = self.lines["dx"], self.lines["dy"]
        out["dx"], out["dy"] = c * dx - s * dy, s * dx + c * dy
        return _Lines(out, self.of_view, self.places + shifts[:, :2])

    def seams(self, covariance: Floats, root: Floats) -> _Seams:
        """Return how far lines lie apart that are one; `covariance` is that of the views' poses."""
        starts = np.searchsorted(self.of_view, np.arange(len(self.places) + 1))
        places = as_records(POINT, self.places)
        pairs = pair_lines(self.lines, starts, places, np.ascontiguousarray(covariance))
        a, b = self.lines[pairs[:, 0]], self.lines[pairs[:, 1]]
        middle = b["dx"] * (a["x"] - b["x"]) + b["dy"] * (a["y"] - b["y"])
        low = np.maximum(middle - 0.5 * a["length"], -0.5 * b["length"])
        at = 0.5 * (low + np.minimum(middle + 0.5 * a["length"], 0.5 * b["length"]))
        x, y = b["x"] + at * b["dx"], b["y"] + at * b["dy"]
        along = a["dx"] * (x - a["centroid_x"]) + a["dy"] * (y - a["centroid_y"])
        across_x, across_y = a["centroid_x"] + along * a["dx"] - x, a["centroid_y"] + along * a["dy"] - y
        offsets = -b["dy"] * across_x + b["dx"] * across_y
        sines = b["dx"] * a["dy"] - b["dy"] * a["dx"]
        by_offset, by_angle = np.zeros((2, len(pairs), root.shape[1]))
        for sign, views in ((1.0, self.of_view[pairs[:, 0]]), (-1.0, self.of_view[pairs[:, 1]])):
            there = self.places[views]
            levers = b["dx"] * (x - there[:, 0]) + b["dy"] * (y - there[:, 1])
            steps = np.stack([-b["dy"], b["dx"], levers], axis=1)
            by_views = root.reshape(-1, 3, root.shape[1])[views]
            by_offset += sign * np.einsum("ki,kij->kj", steps, by_views)
            by_angle += sign * by_views[:, 2]
        noise, turning = _variances_at(a, x, y) + _variances_at(b, x, y), _angle_variances(a) + _angle_variances(b)
        return _Seams(
            np.concatenate([offsets, sines]), np.concatenate([noise, turning]), np.concatenate([by_offset, by_angle])
        )


def _variances_at(lines: Records, x: Floats, y: Floats) -> Floats:
    """Return the variance of each line's offset at the point of it nearest to a place, m^2."""
    along = lines["dx"] * (x - lines["centroid_x"]) + lines["dy"] * (y - lines["centroid_y"])
    return np.asarray(ROUGHNESS**2 + lines["variance"] * (1.0 + along**2 / np.maximum(lines["spread"], LEAST_SPREAD)))


def _angle_variances(lines: Records) -> Floats:
    """Return the variance of each line's angle, rad^2."""
    return np.asarray(MODEL_ANGLE**2 + lines["variance"] / np.maximum(lines["spread"], LEAST_SPREAD))
