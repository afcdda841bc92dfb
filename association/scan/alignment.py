"""Views laid on one another before the search: a wall that two of them show is one, whatever the odometry.

A wall that two views show moves these views, if its distance from its neighbours exceeds the error of odometry. From
then on the moves affect the gates of the search, and nothing else. The answer's own pose and covariance go back to the
poses of odometry (`association.consensus.view_estimation`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from registration.layout import Floats, Records

from ..deadline import Deadline
from ..layout import Flags, Indices
from ..tuning import MODEL_ANGLE, ROUGHNESS
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
    MOST_APART,
    MOST_TURNED,
    SAME_LINE,
)
from .views import corrected


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
        pairs = self.pairs(covariance)
        steps, turns = pairs.by_views(self.places, root)
        return _Seams(
            np.concatenate([pairs.offsets, pairs.sines]),
            np.concatenate([pairs.noise, pairs.turning]),
            np.concatenate([steps, turns]),
        )

    def pairs(self, covariance: Floats) -> _Pairs:
        """Pair lines of each view with those of the views before it that alone they can be.

        Two can be one if they run the same way, have enough in common, and lie within the error of both and of their
        views. A line that can be two of another view, which are farther apart than one wall is, is none of them there.
        Each is paired at most once, with the nearest view before its own.
        """
        pairs = _Pairs.of(self.lines, self.of_view, *self._alike())
        lengths = self.lines["length"]
        least = np.minimum(LEAST_ALIGNED, 0.5 * np.minimum(lengths[pairs.one], lengths[pairs.other]))
        pairs = pairs.taken((pairs.common >= least) & (np.abs(pairs.offsets) <= MOST_APART))
        # Of the covariance, a factor: the errors of the views by independent variates.
        values, vectors = np.linalg.eigh(covariance)
        steps, turns = pairs.by_views(self.places, vectors * np.sqrt(np.maximum(0.0, values)))
        offset, angle = pairs.noise + (steps**2).sum(axis=1), pairs.turning + (turns**2).sum(axis=1)
        near = np.abs(pairs.offsets) <= GATE_SIGMAS * np.sqrt(offset)
        return pairs.taken(near & (np.abs(pairs.sines) <= GATE_SIGMAS * np.sqrt(angle))).nearest()

    def _alike(self) -> tuple[Indices, Indices]:
        """List the pairs of lines of a view and of those before it that run about the same way."""
        dx, dy = self.lines["dx"], self.lines["dy"]
        starts = np.searchsorted(self.of_view, np.arange(len(self.places) + 1)).tolist()
        found = [np.zeros((0, 2), np.intp)]
        for v in range(1, len(self.places)):
            own, before = slice(starts[v], starts[v + 1]), slice(starts[max(0, v - ALIGNED_VIEWS)], starts[v])
            sines = np.outer(dy[own], dx[before]) - np.outer(dx[own], dy[before])
            cosines = np.outer(dx[own], dx[before]) + np.outer(dy[own], dy[before])
            alike = np.argwhere((np.abs(sines) <= MOST_TURNED) & (cosines > 0.0))
            found.append(alike + np.array([own.start, before.start]))
        one, other = np.concatenate(found).T
        return one, other


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Pairs of lines, (k,): `one` of a view, and the `other` of a view before it; which lines they are, of which views.

    Attributes
    ----------
    common : length that both cover along the other, m
    x, y : the middle of that, on the other
    dx, dy : direction of the other
    offsets : how far the one lies to the left of the other there, m
    noise : variance of that by the lines alone, m^2
    sines : of the angle to the other
    turning : variance of that by the lines alone
    """

    one: Indices
    other: Indices
    views: Indices
    earlier: Indices
    common: Floats
    x: Floats
    y: Floats
    dx: Floats
    dy: Floats
    offsets: Floats
    noise: Floats
    sines: Floats
    turning: Floats

    @classmethod
    def of(cls, lines: Records, of_view: Indices, one: Indices, other: Indices) -> _Pairs:
        a, b = lines[one], lines[other]
        dx, dy = b["dx"], b["dy"]
        middle = dx * (a["x"] - b["x"]) + dy * (a["y"] - b["y"])
        low = np.maximum(middle - 0.5 * a["length"], -0.5 * b["length"])
        high = np.minimum(middle + 0.5 * a["length"], 0.5 * b["length"])
        x, y = b["x"] + 0.5 * (low + high) * dx, b["y"] + 0.5 * (low + high) * dy
        along = a["dx"] * (x - a["centroid_x"]) + a["dy"] * (y - a["centroid_y"])
        across_x, across_y = a["centroid_x"] + along * a["dx"] - x, a["centroid_y"] + along * a["dy"] - y
        noise, turning = _variances_at(a, x, y) + _variances_at(b, x, y), _angle_variances(a) + _angle_variances(b)
        return cls(
            one, other, of_view[one], of_view[other], high - low, x, y, dx, dy,
            dx * across_y - dy * across_x, noise, dx * a["dy"] - dy * a["dx"], turning,
        )  # fmt: skip

    def taken(self, chosen: Indices | Flags) -> _Pairs:
        """Return some of the pairs."""
        return _Pairs(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def by_views(self, places: Floats, root: Floats) -> tuple[Floats, Floats]:
        """Return how offsets and angles change with the variates of the poses, (k, 3 u) each: see `Views.root`."""
        offsets, angles = np.zeros((2, len(self.one), root.shape[1]))
        for sign, views in ((1.0, self.views), (-1.0, self.earlier)):
            x, y = places[views].T
            steps = np.stack([-self.dy, self.dx, self.dx * (self.x - x) + self.dy * (self.y - y)], axis=1)
            of_views = root.reshape(-1, 3, root.shape[1])[views]
            offsets += sign * np.einsum("ki,kij->kj", steps, of_views)
            angles += sign * of_views[:, 2]
        return offsets, angles

    def nearest(self) -> _Pairs:
        """Return for each line the nearest one of the nearest view in which it can be one wall alone."""
        if not len(self.one):
            return self
        order = np.lexsort((np.abs(self.offsets) / np.sqrt(self.noise), -self.earlier, self.one))
        one, earlier, offsets = self.one[order], self.earlier[order], self.offsets[order]
        starts = np.flatnonzero(np.diff(one, prepend=-1) | np.diff(earlier, prepend=-1))
        apart = np.maximum.reduceat(offsets, starts) - np.minimum.reduceat(offsets, starts)
        single = starts[apart <= SAME_LINE]
        _, first = np.unique(one[single], return_index=True)
        return self.taken(order[single[first]])


def _variances_at(lines: Records, x: Floats, y: Floats) -> Floats:
    """Return the variance of each line's offset at the point of it nearest to a place, m^2."""
    along = lines["dx"] * (x - lines["centroid_x"]) + lines["dy"] * (y - lines["centroid_y"])
    return np.asarray(ROUGHNESS**2 + lines["variance"] * (1.0 + along**2 / np.maximum(lines["spread"], LEAST_SPREAD)))


def _angle_variances(lines: Records) -> Floats:
    """Return the variance of each line's angle, rad^2."""
    return np.asarray(MODEL_ANGLE**2 + lines["variance"] / np.maximum(lines["spread"], LEAST_SPREAD))
