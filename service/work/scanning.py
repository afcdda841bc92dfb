"""The one place that calls `vectorization`: ranges and points to what the search takes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from association import Scan
from vectorization import LaserScan, Vectorization, VectorizationError, VectorizationOptions, vectorize

from ..schemas.errors import Fault, InvalidRequestError
from ..schemas.parts import Laser

Floats = NDArray[np.float64]
Viewpoint = tuple[float, float] | None

_OPTIONS = frozenset(("sigma", "min_points", "min_length", "max_gap"))


def viewpoint_of(place: list[float] | None) -> Viewpoint:
    """Return where the sensor stood, metres; None where the scan is not from one place."""
    return None if place is None else (place[0], place[1])


@dataclass(frozen=True, slots=True)
class Scanned:
    """A scan, and its segments where the caller did not send them."""

    scan: Scan
    segments: Floats | None


def vectorize_laser(laser: Laser, options: VectorizationOptions, places: tuple[str, str]) -> Vectorization:
    """Return the segments in a turn of a scanner; `places` are the pointers of scan and options."""
    bounds = {
        name: value
        for name, value in (("range_min", laser.range_min), ("range_max", laser.range_max))
        if value is not None
    }
    with _placed(f"{places[0]}/laser", places[1]):
        return vectorize(LaserScan(laser.angle_min, laser.angle_increment, laser.ranges, **bounds), options)


def vectorize_points(
    points: Floats, options: VectorizationOptions, viewpoint: Viewpoint, places: tuple[str, str]
) -> Vectorization:
    """Return the segments in ordered points; `places` are the pointers of scan and options."""
    with _placed(*places):
        return vectorize(points, options, viewpoint)


def scan_laser(laser: Laser, sigma: float | None, viewpoint: Viewpoint) -> Scanned:
    """Return ranges as a scan; the single beams stay evidence."""
    found = vectorize_laser(laser, VectorizationOptions(sigma=sigma), ("/scan", "/scan"))
    beams = None if viewpoint is None else found.beams
    return Scanned(Scan(found.measured, viewpoint, beams), found.measured.segments.endpoints)


def scan_points(points: Floats, sigma: float | None, viewpoint: Viewpoint) -> Scanned:
    """Return points in scanning order as a scan."""
    found = vectorize_points(points, VectorizationOptions(sigma=sigma), viewpoint, ("/scan", "/scan"))
    return Scanned(Scan(found.measured, viewpoint), found.measured.segments.endpoints)


@contextmanager
def _placed(scan: str, options: str) -> Iterator[None]:
    """Say where in the request the argument is that the vectorizer refuses."""
    try:
        yield
    except VectorizationError as error:
        place = f"{options if error.argument in _OPTIONS else scan}/{error.argument}"
        row = "" if error.index is None else f"/{error.index}"
        raise InvalidRequestError([Fault(place + row, error.message)]) from error
