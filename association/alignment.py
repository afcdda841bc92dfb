"""Views laid on one another before the search: a wall that two of them show is one, whatever odometry says.

Where it is told apart from its neighbours by more than odometry may be off, a wall that two views show moves these
views. What moves them is in the gates of the search from then on, and nothing else: the answer's own pose and
covariance go back to what odometry said (`association.view_settling`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats, Records

from .scan import Scan, Views
from .scan_lines import parts_of
from .tuning import (
    ALIGNED_LINES,
    ALIGNED_VIEWS,
    ALIGNING_ROUNDS,
    ALIGNING_SHARE,
    GATE_SIGMAS,
    LEAST_ALIGNED,
    LEAST_SPREAD,
    MODEL_ANGLE,
    MOST_APART,
    MOST_TURNED,
    ROUGHNESS,
    SAME_LINE,
)
from .views import corrected

Indices = NDArray[np.intp]


def aligned(scan: Scan) -> Scan:
    """Return a scan with its views laid on one another; one of exact views is returned as it is."""
    for _ in range(ALIGNING_ROUNDS):
        views = scan.views
        if views is None or not views.uncertain:
            break
        seams = _seams(scan, views)
        weighed = seams.jacobian * (ALIGNING_SHARE / seams.variances)[:, None]
        spread = np.linalg.inv(np.eye(len(views.found)) + seams.jacobian.T @ weighed)
        found = spread @ (weighed.T @ (seams.jacobian @ views.found - seams.residuals))
        scan = corrected(scan, found, 0.5 * (spread + spread.T))
    return scan


@dataclass(frozen=True, slots=True)
class _Seams:
    """How far lines that are one lie apart in two views: offsets and sines of angles, with their variances.

    Attributes
    ----------
    residuals, variances : (k,)
    jacobian : (k, 3 u)
        By the variates of `Views.root`.
    """

    residuals: Floats
    variances: Floats
    jacobian: Floats


def _seams(scan: Scan, views: Views) -> _Seams:
    _, parts, of_view = parts_of(scan.measured, views)
    longest = [
        own[np.argsort(-parts["length"][own], kind="stable")[:ALIGNED_LINES]]
        for own in (np.flatnonzero(of_view == v) for v in range(len(views)))
    ]
    covariance = views.covariance
    rows = [_Seams(np.zeros(0), np.zeros(0), np.zeros((0, views.root.shape[1])))]
    for v in range(1, len(views)):
        alone = np.ones(len(longest[v]), dtype=bool)
        for other in range(v - 1, max(-1, v - 1 - ALIGNED_VIEWS), -1):
            if not alone.any():
                break
            pair = _Pair(views, covariance, v, other)
            found, seams = pair.seams(parts[longest[v]], parts[longest[other]], alone)
            alone[found] = False
            rows.append(seams)
    return _Seams(
        np.concatenate([some.residuals for some in rows]),
        np.concatenate([some.variances for some in rows]),
        np.concatenate([some.jacobian for some in rows]),
    )


@dataclass(frozen=True, slots=True)
class _Pair:
    """Two views, with the covariance of all."""

    views: Views
    covariance: Floats
    one: int
    other: int

    def seams(self, ones: Records, others: Records, wanted: NDArray[np.bool_]) -> tuple[Indices, _Seams]:
        """Pair each line of the one view that is `wanted` with that of the other which it alone can be.

        Returns which of the lines found theirs, and by how much they lie apart.
        """
        if not (len(ones) and len(others)):
            return np.zeros(0, np.intp), _Seams(np.zeros(0), np.zeros(0), np.zeros((0, self.views.root.shape[1])))
        a, b = ones[:, None], others[None, :]
        sines = b["dx"] * a["dy"] - b["dy"] * a["dx"]
        cosines = b["dx"] * a["dx"] + b["dy"] * a["dy"]
        middles = b["dx"] * (a["x"] - b["x"]) + b["dy"] * (a["y"] - b["y"])
        low = np.maximum(middles - 0.5 * a["length"], -0.5 * b["length"])
        high = np.minimum(middles + 0.5 * a["length"], 0.5 * b["length"])
        at = 0.5 * (low + high)
        x, y = b["x"] + at * b["dx"], b["y"] + at * b["dy"]
        along = a["dx"] * (x - a["centroid_x"]) + a["dy"] * (y - a["centroid_y"])
        along_other = b["dx"] * (x - b["centroid_x"]) + b["dy"] * (y - b["centroid_y"])
        across_x, across_y = a["centroid_x"] + along * a["dx"] - x, a["centroid_y"] + along * a["dy"] - y
        offsets = -b["dy"] * across_x + b["dx"] * across_y
        noise = 2.0 * ROUGHNESS**2 + _variance_at(a, along) + _variance_at(b, along_other)
        turning = 2.0 * MODEL_ANGLE**2 + _angle_variance(a) + _angle_variance(b)
        first = self._steps(self.one, b, x, y)
        second = -self._steps(self.other, b, x, y)
        gate = GATE_SIGMAS * np.sqrt(noise + self._variance(first, second))
        turn = GATE_SIGMAS * np.sqrt(turning + self._turn_variance())
        fits = (np.abs(offsets) <= np.minimum(gate, MOST_APART)) & (np.abs(sines) <= np.minimum(turn, MOST_TURNED))
        fits &= (cosines > 0.0) & (high - low >= np.minimum(LEAST_ALIGNED, 0.5 * np.minimum(a["length"], b["length"])))
        far = np.where(fits, np.abs(offsets) / np.sqrt(noise), np.inf)
        best = far.argmin(axis=1)
        rows = np.arange(len(ones))
        apart = np.abs(offsets - offsets[rows, best][:, None])
        sure = wanted & fits[rows, best] & ~(fits & (apart > SAME_LINE)).any(axis=1)
        found = np.flatnonzero(sure)
        to = best[found]
        jacobian = np.concatenate(
            [self._by_variates(first[found, to], second[found, to]), self._by_variates(*self._turns(len(found)))]
        )
        residuals = np.concatenate([offsets[found, to], sines[found, to]])
        return found, _Seams(residuals, np.concatenate([noise[found, to], turning[found, to]]), jacobian)

    def _steps(self, view: int, lines: Records, x: Floats, y: Floats) -> Floats:
        """Return how offsets from lines change with the pose of a view at places on it, (..., 3)."""
        pose = self.views.poses[view]
        levers = lines["dx"] * (x - pose.x) + lines["dy"] * (y - pose.y)
        return np.stack(np.broadcast_arrays(-lines["dy"], lines["dx"], levers), axis=-1)

    @staticmethod
    def _turns(count: int) -> tuple[Floats, Floats]:
        by = np.tile([0.0, 0.0, 1.0], (count, 1))
        return by, -by

    def _variance(self, first: Floats, second: Floats) -> Floats:
        both = np.concatenate([first, second], axis=-1)
        return np.asarray(np.maximum(0.0, np.einsum("...i,ij,...j->...", both, self._block(), both)))

    def _turn_variance(self) -> float:
        block = self._block()
        return max(0.0, float(block[2, 2] + block[5, 5] - 2.0 * block[2, 5]))

    def _block(self) -> Floats:
        rows = np.concatenate([3 * self.one + np.arange(3), 3 * self.other + np.arange(3)])
        return np.asarray(self.covariance[np.ix_(rows, rows)])

    def _by_variates(self, first: Floats, second: Floats) -> Floats:
        root = self.views.root
        one, other = (root[3 * v : 3 * v + 3] for v in (self.one, self.other))
        return np.asarray(first @ one + second @ other)


def _variance_at(lines: Records, along: Floats) -> Floats:
    """Return the variance of a line's offset at a distance from the mean of its points."""
    variances: Floats = lines["variance"] * (1.0 + along**2 / np.maximum(lines["spread"], LEAST_SPREAD))
    return variances


def _angle_variance(lines: Records) -> Floats:
    variances: Floats = lines["variance"] / np.maximum(lines["spread"], LEAST_SPREAD)
    return variances
