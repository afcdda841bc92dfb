"""Validated sets of directed line segments, and the single ranges that they are made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidArgumentError, InvalidSegmentsError
from .kernels.arrays import lines_of
from .layout import Floats
from .limits import MAX_COORDINATE, MAX_LENGTH, MAX_POINTS, MAX_SIGMA, MIN_LENGTH
from .transform import RigidTransform

ALONG, ACROSS = np.array([-1.0, 1.0]), np.array([1.0, -1.0])  # of y for -y
ACROSS_BOTH = np.tile(ACROSS, 2)
DEFAULT_POINT_SPACING = 0.05  # m, what a segment without a count of points is taken to have


def _frozen(array: Floats) -> Floats:
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True)
class Segments:
    """n directed segments ``[x1, y1, x2, y2]`` with free space on their left.

    Build with :meth:`from_array`, which validates; the arrays are read-only float64.

    Attributes
    ----------
    endpoints : (n, 4) metres
    directions : (n, 2) unit vectors from begin to end
    normals : (n, 2) left normals, ``(-d_y, d_x)``
    offsets : (n,) signed distance of the line from the origin, ``normal . begin``, metres
    lengths : (n,) metres
    midpoints : (n, 2) metres
    """

    endpoints: Floats
    directions: Floats
    normals: Floats
    offsets: Floats
    lengths: Floats
    midpoints: Floats

    @classmethod
    def from_array(cls, endpoints: ArrayLike, *, argument: str = "segments") -> Segments:
        """Validate endpoints and derive lines from them.

        Parameters
        ----------
        endpoints : array-like of shape (n, 4)
            Metres, n may be 0.
        argument : str
            Name of the argument in errors.

        Raises
        ------
        InvalidArgumentError
            When it is not an (n, 4) array of numbers.
        InvalidSegmentsError
            When a segment is not finite, has a coordinate beyond 1e9 m, or is not between 1e-6 m and 10 km long; with
            the index of the first one.
        """
        try:
            raw = np.asarray(endpoints)
        except ValueError as error:
            raise InvalidArgumentError("expected an array of [x1, y1, x2, y2]", argument=argument) from error
        if raw.size == 0:
            raw = np.zeros((0, 4))
        if raw.dtype.kind not in "fiu" or raw.ndim != 2 or raw.shape[1] != 4:
            raise InvalidArgumentError(
                f"expected numbers of shape (n, 4), found {raw.dtype} of shape {raw.shape}", argument=argument
            )
        e = np.array(raw, dtype=np.float64, order="C")
        if not _are_within(e, -MAX_COORDINATE, MAX_COORDINATE):
            _refuse(~np.isfinite(e).all(axis=1), "has a coordinate that is not finite", argument)
            _refuse((np.abs(e) > MAX_COORDINATE).any(axis=1), f"has a coordinate beyond {MAX_COORDINATE:g} m", argument)
        found = cls._lines(e)
        if not _are_within(found.lengths, MIN_LENGTH, MAX_LENGTH):
            _refuse(found.lengths < MIN_LENGTH, f"is shorter than {MIN_LENGTH:g} m", argument)
            _refuse(found.lengths > MAX_LENGTH, f"is longer than {MAX_LENGTH:g} m; check the unit", argument)
        return found

    @classmethod
    def derived(cls, endpoints: Floats) -> Segments:
        """Return segments that were made of validated ones: merged they may be longer than what is taken from outside.

        Parameters
        ----------
        endpoints : (n, 4)
            Finite, metres; each of some length.
        """
        return cls._lines(np.array(endpoints, dtype=np.float64, order="C"))

    @classmethod
    def _lines(cls, e: Floats) -> Segments:
        n = len(e)
        derived = np.empty((n, 2)), np.empty((n, 2)), np.empty(n), np.empty(n), np.empty((n, 2))
        lines_of(e, *derived)
        return cls(*map(_frozen, (e, *derived)))

    def __len__(self) -> int:
        return len(self.lengths)

    def take(self, indices: ArrayLike) -> Segments:
        """Return the segments at `indices`, in that order."""
        i = np.asarray(indices, dtype=np.intp)
        arrays = (self.endpoints, self.directions, self.normals, self.offsets, self.lengths, self.midpoints)
        return Segments(*(_frozen(a[i]) for a in arrays))

    def mirrored(self) -> Segments:
        """Return them with y for -y, and begin and end exchanged: the free side stays on the left."""
        e, d, n, middles = self.endpoints[:, [2, 3, 0, 1]], self.directions, self.normals, self.midpoints
        arrays = (e * ACROSS_BOTH, d * ALONG, n * ACROSS, self.offsets, self.lengths, middles * ACROSS)
        return Segments(*map(_frozen, arrays))

    def reversed(self) -> Segments:
        """Return the same segments with begin and end exchanged."""
        return Segments.derived(self.endpoints[:, [2, 3, 0, 1]])

    def moved_left(self, by: ArrayLike) -> Segments:
        """Return the segments moved along their left normals, by one distance or one for each, metres."""
        aside = self.normals * np.broadcast_to(np.asarray(by, dtype=np.float64), len(self))[:, None]
        return Segments.derived(self.endpoints + np.tile(aside, 2))

    def points(self, step: float) -> Floats:
        """Return points along all segments, (m, 2), ends included, at most `step` metres from one to the next."""
        counts = np.ceil(self.lengths / step).astype(np.intp) + 1
        which = np.repeat(np.arange(len(self)), counts)
        along = (np.arange(len(which)) - (np.cumsum(counts) - counts)[which]) / (counts[which] - 1)
        begins, ends = self.endpoints[which, :2], self.endpoints[which, 2:]
        return np.asarray(begins + along[:, None] * (ends - begins))

    def shifted(self, by: ArrayLike) -> Segments:
        """Return the segments moved by a vector of 2 metres, to work near the origin."""
        offset = np.asarray(by, dtype=np.float64)
        return Segments.derived(self.endpoints + np.tile(offset, 2))


def _are_within(values: Floats, low: float, high: float) -> bool:
    """Tell whether all values are numbers from `low` to `high`, which are finite."""
    return bool(((values >= low) & (values <= high)).all())  # so written that nan is not


def _refuse(bad: NDArray[np.bool_] | np.bool_, what: str, argument: str) -> None:
    if bad.any():
        raise InvalidSegmentsError(what, argument=argument, index=int(np.argmax(bad)))


@dataclass(frozen=True, slots=True)
class MeasuredSegments:
    """Segments with what is known of the points behind them.

    Attributes
    ----------
    segments : Segments
    sigma : (n,) standard deviation of single points normal to the wall, metres
    point_counts : (n,) number of points behind each segment; below 1 for a short segment whose points were not counted
    centroids : (n, 2) mean of those points, metres
    spreads : (n,) their second moment along the segment, m^2
    counted : bool
        True if the points were counted; if not, the segments of one wall together have 2 at least.
    """

    segments: Segments
    sigma: Floats
    point_counts: Floats
    centroids: Floats = field(repr=False)
    spreads: Floats = field(repr=False)
    counted: bool = True

    def __post_init__(self) -> None:
        # For a kernel an array that may be written to is another type, and each type is compiled separately.
        for name in ("sigma", "point_counts", "centroids", "spreads"):
            given = getattr(self, name)
            if given.flags.writeable or not given.flags.c_contiguous or given.dtype != np.float64:
                array = np.ascontiguousarray(given, dtype=np.float64)
                object.__setattr__(self, name, _frozen(array.view()))

    @classmethod
    def from_segments(
        cls,
        segments: Segments,
        sigma: ArrayLike = 0.02,
        point_counts: ArrayLike | None = None,
        moments: tuple[ArrayLike, ArrayLike] | None = None,
        *,
        argument: str = "scan",
    ) -> MeasuredSegments:
        """Fill in what the caller does not know.

        Parameters
        ----------
        segments : Segments
        sigma : float or (n,)
            Standard deviation of single points normal to the wall, metres, 0 to 1e3.
        point_counts : (n,), optional
            Number of points behind each segment, at least 1; default ``length / 0.05``, and 2 at least behind all that
            is seen of one wall.
        moments : ((n, 2) centroids, (n,) spreads), optional
            Mean of the points and their second moment along the segment; default midpoint and ``length^2 / 12``, that
            of points spread evenly.
        argument : str
            Name of the argument in errors.

        Raises
        ------
        InvalidArgumentError
            When a number is out of range or an array has another length than `segments`.
        """
        n = len(segments)
        given = np.full(n, sigma, dtype=np.float64) if np.ndim(sigma) == 0 else sigma
        sigmas = _checked(given, (n,), 0.0, MAX_SIGMA, f"{argument}.sigma")
        # Values that are derived from segments were checked with them.
        if point_counts is None:
            counts = _frozen(segments.lengths / DEFAULT_POINT_SPACING)
        else:
            counts = _checked(point_counts, (n,), 1.0, MAX_POINTS, f"{argument}.point_counts")
        if moments is None:
            means, along = segments.midpoints, _frozen(segments.lengths**2 / 12.0)
        else:
            means = _checked(moments[0], (n, 2), -MAX_COORDINATE, MAX_COORDINATE, f"{argument}.centroids")
            along = _checked(moments[1], (n,), 0.0, MAX_LENGTH**2, f"{argument}.spreads")
        return cls(segments, sigmas, counts, means, along, point_counts is not None)

    def __len__(self) -> int:
        return len(self.segments)


def _checked(values: Any, shape: tuple[int, ...], low: float, high: float, argument: str) -> Floats:
    array = np.array(values, dtype=np.float64, order="C")
    if array.size == 0 and shape[0] == 0:
        array = array.reshape(shape)
    if array.shape != shape:
        raise InvalidArgumentError(f"expected shape {shape}, found {array.shape}", argument=argument)
    if not _are_within(array, low, high):
        bad = ~(np.isfinite(array) & (array >= low) & (array <= high))
        index = int(np.argmax(bad.reshape(len(array), -1).any(axis=1)))
        raise InvalidArgumentError(
            f"expected a number from {low:g} to {high:g}, found {array[bad][0]:g}", argument=argument, index=index
        )
    return _frozen(array)


@dataclass(frozen=True, slots=True)
class Beams:
    """Single range measurements, evidence for and against a pose.

    Attributes
    ----------
    angles : (m,) radians in the scan frame
    ranges : (m,) metres; inf where the beam came back from nothing within `range_max`; nan where nothing is known
    range_max : float
        Metres; how far a beam without return is known to be free; inf where the scanner does not say.
    origins : (m, 2) or None
        Origin of each beam in the scan frame, metres; None: at the scan's viewpoint.
    """

    angles: Floats
    ranges: Floats
    range_max: float
    origins: Floats | None = None

    def mirrored(self) -> Beams:
        """Return them with left and right exchanged, in the same order, which is that of time."""
        return Beams(-self.angles, self.ranges, self.range_max, None if self.origins is None else self.origins * ACROSS)

    def scaled(self, factor: float) -> Beams:
        """Return them with all lengths multiplied."""
        origins = None if self.origins is None else self.origins * factor
        return Beams(self.angles, self.ranges * factor, self.range_max * factor, origins)

    def moved(self, by: RigidTransform, viewpoint: tuple[float, float]) -> Beams:
        """Return them in another frame; those without an origin of their own begin at `viewpoint`."""
        origins = np.tile(np.asarray(viewpoint), (len(self.angles), 1)) if self.origins is None else self.origins
        return Beams(self.angles + by.theta, self.ranges, self.range_max, by.apply(origins))
