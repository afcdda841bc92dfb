"""Ranges and points of a request to scans, or to segments."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from association import AssociationWarning, Scan, View
from registration import RigidTransform
from vectorization import (
    LaserScan,
    Motion,
    Vectorization,
    VectorizationError,
    VectorizationOptions,
    require_angle_max,
    vectorize,
)

from ..ranges import RangeScan, motion_warning, view_of
from .errors import Fault, InvalidRequestError
from .parts import Laser, Twist
from .requests import VectorizeRequest

Floats = NDArray[np.float64]
Viewpoint = tuple[float, float] | None

MOST_NULLS = 1.0 / 3.0  # fraction of a scan's ranges
_OPTIONS = frozenset(("sigma", "min_points", "min_length", "max_gap"))
_PLACES = ("", "/options")  # where scan and options stand in a request to vectorize


def viewpoint_of(place: list[float] | None) -> Viewpoint:
    """Return where the sensor stood, metres; None where the scan is not from one place."""
    return None if place is None else (place[0], place[1])


@dataclass(frozen=True, slots=True)
class Scanned:
    """A scan, and its segments where the caller did not send them.

    Attributes
    ----------
    scan : Scan
    segments : (n, 4), or None
        Metres in the scan's frame; of several views None, see `parts`.
    parts : tuple of (m, 4) or None, or None
        Of several views the segments of each, likewise.
    starts : (v,) or None
        Which segment of the scan is the first of each view.
    """

    scan: Scan
    segments: Floats | None
    parts: tuple[Floats | None, ...] | None = None
    starts: NDArray[np.intp] | None = None

    @property
    def listed(self) -> list[Any] | None:
        """The segments that the caller did not send; of several views one list, or None, each."""
        if self.parts is None:
            return None if self.segments is None else self.segments.tolist()
        return [None if part is None else part.tolist() for part in self.parts]


def range_scan(laser: Laser, twist: Twist | None, place: str, *, timed: bool = True) -> RangeScan:
    """Return the ranges of a scanner; `place` is the pointer of its scan.

    If not `timed`, an unknown motion counts as none.
    """
    bounds = {
        name: value
        for name, value in (("range_min", laser.range_min), ("range_max", laser.range_max))
        if value is not None
    }
    motion = None
    if twist is not None and laser.time_increment:
        motion = Motion(laser.time_increment, twist.vx, twist.vy, twist.omega)
    with _naming_argument(f"{place}/laser", (place, place)):
        if laser.angle_max is not None and len(laser.ranges):
            require_angle_max(laser.angle_min, laser.angle_max, laser.angle_increment, len(laser.ranges))
        scan = LaserScan(laser.angle_min, laser.angle_increment, laser.ranges, motion=motion, **bounds)
    return RangeScan(scan, (timed and laser.time_increment) or 0.0)


def vectorize_laser(seen: RangeScan, options: VectorizationOptions, places: tuple[str, str]) -> Vectorization:
    """Return the segments in the ranges of a scanner; `places` are the pointers of scan and options."""
    with _naming_argument(f"{places[0]}/laser", places):
        return vectorize(seen.laser, options)


def vectorize_points(
    points: Floats, options: VectorizationOptions, viewpoint: Viewpoint, places: tuple[str, str]
) -> Vectorization:
    """Return the segments in ordered points; `places` are the pointers of scan and options."""
    with _naming_argument(places[0], places):
        return vectorize(points, options, viewpoint)


def view_laser(
    seen: RangeScan, at: RigidTransform, sigma: float | None, viewpoint: Viewpoint, place: str = "/scan"
) -> View:
    """Return a scanner's view; the single beams stay evidence. `at` is the pose of the frame it is mounted on."""
    with _naming_argument(f"{place}/laser", (place, place)):
        view = view_of(seen, at, sigma)
    nulls = _nulls_warning(seen.laser)
    if nulls is not None:
        view = replace(view, scan=replace(view.scan, warnings=(*view.scan.warnings, nulls)))
    return view if viewpoint is not None else replace(view, scan=replace(view.scan, viewpoint=None, beams=None))


def scan_points(points: Floats, sigma: float | None, viewpoint: Viewpoint, place: str = "/scan") -> Scan:
    """Return points in scanning order as a scan."""
    found = vectorize_points(points, VectorizationOptions(sigma=sigma), viewpoint, (place, place))
    return Scan(found.measured, viewpoint, ordered=found.ordered)


def _nulls_warning(laser: LaserScan) -> AssociationWarning | None:
    """Return the warning about nulls that may stand for beams without a return; None where that is unlikely."""
    nulls = int(np.isnan(laser.ranges).sum())  # strict JSON has no other NaN
    if nulls <= MOST_NULLS * len(laser.ranges) or (laser.ranges > laser.range_max).any():
        return None
    return AssociationWarning(
        "nulls_for_no_return",
        f"{nulls} of {len(laser.ranges)} ranges are null, and none exceeds range_max. A null beam is unknown and gives "
        "no evidence. If these beams had no return, send a number above range_max: some JSON bridges write infinity as "
        "null.",
    )


@contextmanager
def _naming_argument(form: str, places: tuple[str, str]) -> Iterator[None]:
    """Name the place in the request of an argument that the vectorizer rejects."""
    try:
        yield
    except VectorizationError as error:
        scan, options = places
        beside = {**dict.fromkeys(_OPTIONS, options), "twist": scan}
        place = f"{beside.get(error.argument, form)}/{error.argument}"
        row = "" if error.index is None else f"/{error.index}"
        raise InvalidRequestError([Fault(place + row, error.message)]) from error


def vectorization_of(asked: VectorizeRequest) -> tuple[Vectorization, AssociationWarning | None]:
    """Return the segments of a scan, and the warning about a sensor whose motion is not known.

    Raises
    ------
    InvalidRequestError
        When the library rejects it.
    """
    sent = asked.options
    options = VectorizationOptions(sent.sigma, sent.min_points, sent.min_length, sent.max_gap)
    if asked.laser is None:
        assert asked.points is not None  # the model takes exactly one of the two
        return vectorize_points(asked.points, options, viewpoint_of(asked.viewpoint), _PLACES), None
    seen = range_scan(asked.laser, asked.twist, _PLACES[0])
    return vectorize_laser(seen, options, _PLACES), motion_warning(seen)
