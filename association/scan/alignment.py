"""Views laid on one another before the search: a wall that two of them show is one, whatever the odometry.

A wall that two views show moves these views, if its distance from its neighbours exceeds the error of odometry. From
then on the moves affect the gates of the search, and nothing else. The answer's own pose and covariance go back to the
poses of odometry (`association.consensus.view_estimation`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from registration.layout import Floats, Records, floats

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

    After the deadline no round ends: the views stay where the rounds before have laid them. `directed`: whether the
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
        pairs = lines.moved(shifts).pairs(views.root @ spread @ views.root.T, deadline)
        if pairs is None:
            break
        residuals, variances = pairs.apart.ravel(), pairs.variances.ravel()
        jacobian = (pairs.steps @ views.root[pairs.errors]).reshape(-1, len(found))
        weighed = jacobian * (ALIGNING_SHARE / variances)[:, None]
        spread = np.asarray(np.linalg.inv(np.eye(len(found)) + jacobian.T @ weighed))
        left = residuals - jacobian @ found
        found = np.asarray(spread @ (weighed.T @ -left))
        # If lines do not fit one another as they should, some of them are not one.
        worse = max(1.0, float(np.mean((left + jacobian @ found) ** 2 / variances)) if len(left) else 1.0)
        spread = spread * worse
    return corrected(scan, found, 0.5 * (spread + spread.T))


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

    def pairs(self, covariance: Floats, deadline: Deadline) -> _Pairs | None:
        """Pair lines of each view with those of the views before it that alone they can be; None past the deadline.

        Two can be one if they run the same way, have enough in common, and lie within the error of both and of their
        views. A line that can be two of another view, which are farther apart than one wall is, is none of them there.
        Each is paired at most once, with the nearest view before its own.
        """
        found: list[_Pairs] = [_Pairs.of(self, *np.zeros((2, 0), np.intp))]
        for view in range(1, len(self.places)):
            if deadline.passed:
                return None
            found.append(self._pairs_of(view, covariance))
        return _Pairs(*(np.concatenate([getattr(one, field.name) for one in found]) for field in fields(_Pairs)))

    def _pairs_of(self, view: int, covariance: Floats) -> _Pairs:
        pairs = _Pairs.of(self, *self._alike(view))
        lengths = self.lines["length"][pairs.rows]
        enough = pairs.common >= np.minimum(LEAST_ALIGNED, 0.5 * lengths.min(axis=1))
        pairs = pairs.taken(enough & (np.abs(pairs.apart[:, 0]) <= MOST_APART))
        at = pairs.errors
        steps = ((pairs.steps @ covariance[at[:, :, None], at[:, None]]) * pairs.steps).sum(axis=2)
        variances = pairs.variances + np.maximum(0.0, steps)
        return pairs.taken((np.abs(pairs.apart) <= GATE_SIGMAS * np.sqrt(variances)).all(axis=1)).nearest()

    def _alike(self, view: int) -> tuple[Indices, Indices]:
        """List the pairs of lines of a view and of those before it that run about the same way."""
        dx, dy = self.lines["dx"], self.lines["dy"]
        first, begin, end = np.searchsorted(self.of_view, [max(0, view - ALIGNED_VIEWS), view, view + 1]).tolist()
        own, before = slice(begin, end), slice(first, begin)
        sines = np.outer(dy[own], dx[before]) - np.outer(dx[own], dy[before])
        cosines = np.outer(dx[own], dx[before]) + np.outer(dy[own], dy[before])
        one, other = np.nonzero((np.abs(sines) <= MOST_TURNED) & (cosines > 0.0))
        return one + begin, other + first


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Pairs of lines: the first of a view, the second of one before it.

    Attributes
    ----------
    rows : (k, 2) which lines they are
    views : (k, 2) their views
    common : (k,) length that both cover along the second, m
    steps : (k, 2, 6) derivatives of `apart` by x, y, theta of both views
    apart : (k, 2) how far the first lies to the left of the second there, m, and the sine of the angle between them
    variances : (k, 2) of these, by the lines alone, m^2 and rad^2
    """

    rows: Indices
    views: Indices
    common: Floats
    steps: Floats
    apart: Floats
    variances: Floats

    @classmethod
    def of(cls, found: _Lines, first: Indices, second: Indices) -> _Pairs:
        a, b, rows = found.lines[first], found.lines[second], np.stack([first, second], axis=1)
        views = found.of_view[rows]
        a_x, a_y, a_dx, a_dy, a_length, to_x, to_y = floats(
            a, "x", "y", "dx", "dy", "length", "centroid_x", "centroid_y"
        )
        b_x, b_y, dx, dy, b_length = floats(b, "x", "y", "dx", "dy", "length")
        middle = dx * (a_x - b_x) + dy * (a_y - b_y)
        low = np.maximum(middle - 0.5 * a_length, -0.5 * b_length)
        high = np.minimum(middle + 0.5 * a_length, 0.5 * b_length)
        x, y = b_x + 0.5 * (low + high) * dx, b_y + 0.5 * (low + high) * dy
        along = a_dx * (x - to_x) + a_dy * (y - to_y)
        offset = dx * (to_y + along * a_dy - y) - dy * (to_x + along * a_dx - x)
        apart = np.stack([offset, dx * a_dy - dy * a_dx], axis=1)
        variances = np.add(*(np.stack([_variances_at(line, x, y), _angle_variances(line)], 1) for line in (a, b)))
        steps = np.zeros((len(rows), 2, 2, 3))
        steps[:, 0, :, 0], steps[:, 0, :, 1], steps[:, 1, :, 2] = -dy[:, None], dx[:, None], 1.0
        from_x, from_y = (place[:, None] - found.places[views, k] for k, place in enumerate((x, y)))
        steps[:, 0, :, 2] = dx[:, None] * from_x + dy[:, None] * from_y
        steps[:, :, 1] *= -1.0
        return cls(rows, views, high - low, steps.reshape(-1, 2, 6), apart, variances)

    @property
    def errors(self) -> Indices:
        """The places of x, y, theta of both views among those of all, (k, 6)."""
        return (3 * self.views[:, :, None] + np.arange(3)).reshape(-1, 6)

    def taken(self, chosen: Indices | Flags) -> _Pairs:
        """Return some of the pairs."""
        return _Pairs(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def nearest(self) -> _Pairs:
        """Return for each line the nearest one of the nearest view in which it can be one wall alone."""
        if not len(self.rows):
            return self
        offsets = self.apart[:, 0]
        order = np.lexsort((np.abs(offsets) / np.sqrt(self.variances[:, 0]), -self.views[:, 1], self.rows[:, 0]))
        first, earlier, offsets = self.rows[order, 0], self.views[order, 1], offsets[order]
        starts = np.flatnonzero(np.diff(first, prepend=-1) | np.diff(earlier, prepend=-1))
        between = np.maximum.reduceat(offsets, starts) - np.minimum.reduceat(offsets, starts)
        single = starts[between <= SAME_LINE]
        _, chosen = np.unique(first[single], return_index=True)
        return self.taken(order[single[chosen]])


def _variances_at(lines: Records, x: Floats, y: Floats) -> Floats:
    """Return the variance of each line's offset at the point of it nearest to a place, m^2."""
    to_x, to_y, dx, dy, spread, variance = floats(lines, "centroid_x", "centroid_y", "dx", "dy", "spread", "variance")
    along = dx * (x - to_x) + dy * (y - to_y)
    return np.asarray(ROUGHNESS**2 + variance * (1.0 + along**2 / np.maximum(spread, LEAST_SPREAD)))


def _angle_variances(lines: Records) -> Floats:
    """Return the variance of each line's angle, rad^2."""
    return np.asarray(MODEL_ANGLE**2 + lines["variance"] / np.maximum(lines["spread"], LEAST_SPREAD))
