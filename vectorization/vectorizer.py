"""Ranges or ordered points in, directed segments out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from registration import Beams, MeasuredSegments
from registration.layout import Floats, Records
from registration.limits import MAX_BEAMS, MAX_COORDINATE, MAX_LENGTH

from .errors import InvalidScanError
from .kernels.rays import gather
from .laser import LaserScan, Motion
from .layout import POINT
from .options import VectorizationOptions
from .order import first_of_each, runs_along, runs_around, without_repeats
from .tracing import Traced, noise_of_points, noise_of_ranges, trace
from .tuning import LEAST_INCREMENT, REPEATED_NOISE, UNKNOWN_SIGMA

AT_ORIGIN = np.zeros(2)
USUAL = VectorizationOptions()
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Vectorization:
    """Segments and what they were made of.

    Attributes
    ----------
    measured : MeasuredSegments
        k segments in scanning order, counter-clockwise, free space on the left. `sigma` is normal to each wall: range
        noise counts only with the cosine of incidence. As that differs along a wall, `centroids` and `spreads` are
        the means weighted by each point's information and `sigma` is such that ``points / sigma^2`` is the sum of
        the weights; so they hold all that the points say of the line. A segment whose points lie worse than the noise
        explains has its sigma widened to what they show.
    rms : (k,) root of the (weighted) mean square distance of the points from their line, metres
    sigma : float
        Standard deviation of the ranges, given or estimated, metres.
    spans : (k, 2)
        Index of the beam or point at the begin and at the end of each segment. Counter-clockwise, so a clockwise scan
        counts down, and a segment across the seam of a full turn wraps.
    beams : Beams or None
        The single ranges, cleaned, with which `association` weighs a pose; None where the scan came as points.
    ordered : bool
        False where points are not in scanning order: once around their viewpoint, in one direction; without a
        viewpoint one next to the other.
    """

    measured: MeasuredSegments
    rms: Floats = field(repr=False)
    sigma: float
    spans: Indices = field(repr=False)
    beams: Beams | None = field(default=None, repr=False)
    ordered: bool = True

    @property
    def viewpoint(self) -> tuple[float, float]:
        """Viewpoint of the segments, metres: the middle of the way, of a scanner that moved."""
        if self.beams is None or self.beams.origins is None or not len(self.beams.origins):
            return 0.0, 0.0
        x, y = self.beams.origins.mean(axis=0).tolist()
        return x, y


def vectorize(
    scan: LaserScan | ArrayLike,
    options: VectorizationOptions | None = None,
    viewpoint: tuple[float, float] | None = (0.0, 0.0),
) -> Vectorization:
    """Find the straight walls in a scan.

    Stretches without a gap are split where the points leave the chord or two lines fit far better than one, pieces that
    one line explains are joined again, and each break is moved to its best place, all by total least squares from
    running sums. The lines are then fitted by maximum likelihood under noise along the rays, extended over the points
    that lie on them, and cut at the corner with their neighbour where it lies between the two's nearest rays.

    Points are taken to come from one place at one time. Of ranges with a `Motion` each beam is taken to where the
    sensor was; then they are points that are seen from the middle of its way.

    Parameters
    ----------
    scan : LaserScan or array-like of shape (m, 2)
        Ranges, or points in scanning order, metres.
    options : VectorizationOptions, optional
    viewpoint : (float, float) or None
        Position of the sensor, metres, for points only. Segments have it on their left, and noise acts along the rays
        from it. None: not seen from one place; segments run as the points do, and noise has no direction.

    Returns
    -------
    Vectorization

    Raises
    ------
    InvalidScanError
        When points are not finite numbers of shape (m, 2), or farther than 10 km from the first or from the viewpoint.
    """
    options = options or USUAL
    if isinstance(scan, LaserScan):
        return _from_laser(scan, options)
    points = _checked_points(scan)
    if viewpoint is None:
        return _from_bare_points(points, options)
    return _from_viewed_points(points, _checked_viewpoint(viewpoint, points), options)


def _from_laser(scan: LaserScan, options: VectorizationOptions) -> Vectorization:
    if scan.motion is not None:
        return _from_moving_laser(scan, scan.motion, options)
    angles = scan.angles
    increment = abs(scan.angle_increment)
    closed = increment * len(angles) > math.tau - 0.5 * increment
    ranges = scan.cleaned
    order, points = _gathered(ranges, angles, scan.angle_increment < 0.0, closed)
    sigma = options.sigma or noise_of_ranges(points, increment, points)
    traced = trace(points, increment, closed, sigma, options, AT_ORIGIN)
    return _vectorized(traced, sigma, order[traced.spans], Beams(angles, ranges, scan.range_max))


def _from_moving_laser(scan: LaserScan, motion: Motion, options: VectorizationOptions) -> Vectorization:
    ranges, places = scan.cleaned, scan.places
    angles, origins = scan.angles + places[:, 2], np.ascontiguousarray(places[:, :2])
    step = scan.angle_increment + motion.omega * motion.time_increment
    # Overlapping or apart by the turn, its two ends do not meet.
    order, as_read = _gathered(ranges, angles, step < 0.0, False)
    middle = origins.mean(axis=0) if len(origins) else np.zeros(2)
    seen = np.stack([as_read["x"], as_read["y"]], axis=1) + origins[order] - middle
    points = _points(seen, np.hypot(seen[:, 0], seen[:, 1]))
    sigma = options.sigma or noise_of_ranges(points, abs(step), as_read)
    traced = trace(points, abs(step), False, sigma, options, middle)
    beams = Beams(angles, ranges, scan.range_max, origins)
    return _vectorized(traced, sigma, order[_spans_along(traced, points)], beams)


def _gathered(ranges: Floats, angles: Floats, backward: bool, closed: bool) -> tuple[Indices, Records]:
    """Return indices and points of the beams that have a range, counter-clockwise."""
    order, points = np.empty(len(ranges), np.int64), np.empty(len(ranges), POINT)
    count = gather(ranges, np.cos(angles), np.sin(angles), backward, closed, order, points)
    return order[:count], points[:count]


def _points(places: Floats, ranges: Floats) -> Records:
    """Return the points at `places` (n, 2) about the sensor; those whose range is 0 have no ray."""
    points = np.zeros(len(places), POINT)
    points["x"], points["y"], points["range"] = places[:, 0], places[:, 1], ranges
    seen = ranges > 0.0
    points["ray_x"], points["ray_y"] = np.divide(places.T, ranges, out=np.zeros((2, len(places))), where=seen)
    return points


def _from_viewed_points(places: Floats, viewpoint: Floats, options: VectorizationOptions) -> Vectorization:
    seen = places - viewpoint
    r = np.hypot(seen[:, 0], seen[:, 1])
    order = first_of_each(seen)
    order = order[r[order] > 0.0]
    order, turns, ordered = _around(seen, r, order, options)
    if np.sum(np.sign(turns)) < 0.0:
        order = order[::-1]
    points = _points(seen[order], r[order])
    increment = max(LEAST_INCREMENT, float(np.median(np.abs(turns)))) if len(turns) else LEAST_INCREMENT
    sigma = options.sigma or noise_of_ranges(points, increment, points)
    # The viewpoint is on the left whatever way the points run.
    traced = trace(points, increment, False, sigma, options, viewpoint)
    return _vectorized(traced, sigma, order[_spans_along(traced, points)], ordered=ordered)


def _around(
    seen: Floats, ranges: Floats, order: Indices, options: VectorizationOptions
) -> tuple[Indices, Floats, bool]:
    """Return points without those that come again, the sines between their rays, and whether they run around once."""
    if len(order) < 2:
        return order, np.zeros(0), True
    directions = seen[order] / ranges[order, None]
    sines, cosines = _between_rays(directions)
    apart = np.hypot(*np.diff(seen[order], axis=0).T)
    near = apart <= REPEATED_NOISE * (options.sigma or UNKNOWN_SIGMA)
    left = without_repeats(np.abs(np.arctan2(sines, cosines)), near)
    if len(left) < len(order):
        order = order[left]
        sines, cosines = _between_rays(directions[left])
    return order, sines, runs_around(np.arctan2(sines, cosines))


def _between_rays(directions: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine from each ray to the next."""
    sines = directions[:-1, 0] * directions[1:, 1] - directions[:-1, 1] * directions[1:, 0]
    return sines, (directions[:-1] * directions[1:]).sum(axis=1)


def _from_bare_points(every: Floats, options: VectorizationOptions) -> Vectorization:
    order = first_of_each(every)
    if len(order) > 1:
        steps = np.hypot(*np.diff(every[order], axis=0).T)
        order = order[without_repeats(steps, np.ones(len(steps), dtype=np.bool_))]
    places = every[order]
    origin = places.mean(axis=0) if len(places) else np.zeros(2)
    points = _points(places - origin, np.zeros(len(places)))
    sigma = options.sigma or noise_of_points(places - origin)
    traced = trace(points, 0.0, False, sigma, options, origin)
    backward = _runs_backward(traced.lines, points)
    traced.found[backward, :4] = traced.found[backward][:, [2, 3, 0, 1]]
    return _vectorized(traced, sigma, order[traced.spans], ordered=runs_along(places))


def _vectorized(
    traced: Traced, sigma: float, spans: Indices, beams: Beams | None = None, *, ordered: bool = True
) -> Vectorization:
    return Vectorization(traced.measured(), traced.found[:, 7], sigma, spans, beams, ordered)


def _spans_along(traced: Traced, points: Records) -> Indices:
    """Return the points at the begin and at the end of each line, (k, 2), whatever way the points run."""
    backward = _runs_backward(traced.lines, points)
    return np.where(backward[:, None], traced.spans[:, ::-1], traced.spans)


def _runs_backward(lines: Records, points: Records) -> NDArray[np.bool_]:
    """Tell whether the points of each line run against its direction ``(-n_y, n_x)``."""
    first, last = points[lines["first"]], points[lines["last"]]
    backward: NDArray[np.bool_] = lines["nx"] * (last["y"] - first["y"]) < lines["ny"] * (last["x"] - first["x"])
    return backward


def _checked_points(points: ArrayLike) -> Floats:
    try:
        raw = np.asarray(points)
    except ValueError as error:
        raise InvalidScanError("expected an array of [x, y] rows of numbers", argument="points") from error
    if raw.size == 0:
        raw = np.zeros((0, 2))
    if raw.dtype.kind not in "fiu" or raw.ndim != 2 or raw.shape[1] != 2:
        raise InvalidScanError(
            f"expected numbers of shape (m, 2), found {raw.dtype} of shape {raw.shape}", argument="points"
        )
    if len(raw) > MAX_BEAMS:
        raise InvalidScanError(f"expected at most {MAX_BEAMS} points, found {len(raw)}", argument="points")
    values = np.array(raw, dtype=np.float64)
    bad = ~np.isfinite(values).all(axis=1)
    if len(values) and not bad.any():
        bad = (np.abs(values - values[0]) > MAX_LENGTH).any(axis=1) | (np.abs(values) > MAX_COORDINATE).any(axis=1)
    if bad.any():
        index = int(np.argmax(bad))
        x, y = values[index]
        raise InvalidScanError(
            f"expected finite numbers within {MAX_LENGTH:g} m of the first, found ({x:g}, {y:g}); leave out beams "
            "without a return",
            argument="points",
            index=index,
        )
    return values


def _checked_viewpoint(viewpoint: tuple[float, float], points: Floats) -> Floats:
    place = np.asarray(viewpoint, dtype=np.float64)
    if place.shape != (2,) or not np.isfinite(place).all():
        raise InvalidScanError(f"expected two finite numbers, found {viewpoint!r}", argument="viewpoint")
    if (np.abs(points - place) > MAX_LENGTH).any():
        raise InvalidScanError(
            f"expected a viewpoint within {MAX_LENGTH:g} m of all points, found {viewpoint!r}", argument="viewpoint"
        )
    return place
