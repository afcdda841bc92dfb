"""The parts that requests are put together from: maps, scans, priors, options."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from .arrays import (
    CentroidRows,
    Covariance,
    MapPointRows,
    MapSegmentRows,
    PointCounts,
    PointRows,
    Ranges,
    ScanSegmentRows,
    SigmaOrSigmas,
    Spreads,
)
from .strict import Angle, DeadlineMs, FrameId, FreeJson, MapId, OneOf, Point, Pose, Strict, in_radians

MapSigma = Annotated[float, Field(ge=0.0, le=10.0)]
PointSigma = Annotated[float, Field(gt=0.0, le=10.0)]
RaySigma = Annotated[float, Field(ge=1e-6, le=10.0)]
IncludeName = Literal["correspondences", "alternatives", "segments", "missing_map"]
EVERYTHING: tuple[IncludeName, ...] = ("correspondences", "alternatives", "segments", "missing_map")


class MapDocument(Strict):
    """A map, as a file of its own or to be stored.

    Attributes
    ----------
    segments
        `[x1, y1, x2, y2]` each, metres, free space on the left
    sigma
        standard deviation of the map's lines, normal to the lines, metres; null: estimated
    oriented
        whether free space lies on the left of its segments; null: true; a request's option has precedence
    frame_id
        frame of the map, as `frame_id` of the answer
    points
        `[x, y]` each, metres: objects too small for a wall, such as legs and posts; evidence for the beams of a scan
        only; at most as many as `max_map_segments` of /v1/limits
    points_sigma
        standard deviation of the points' positions, and half their width, metres; null: 0.05
    meta
        returned as it was sent
    """

    segments: MapSegmentRows
    sigma: MapSigma | None = None
    oriented: bool | None = None
    frame_id: FrameId = "map"
    points: MapPointRows = Field(default_factory=lambda: np.zeros((0, 2)), json_schema_extra={"default": []})
    points_sigma: PointSigma | None = None
    meta: FreeJson = None


class InlineMap(MapDocument):
    """A map in the request itself.

    Attributes
    ----------
    meta
        not used; allowed, so that a map file may be sent unchanged
    """

    meta: FreeJson = None


class StoredMap(Strict):
    """A map that was stored with PUT before.

    Attributes
    ----------
    map_id
        id under which the map was stored
    """

    map_id: MapId


def is_oriented(asked: bool | None, own: bool | None) -> bool:
    """Tell whether directions mean anything: as the request says, else as the map does, else yes."""
    return next((said for said in (asked, own) if said is not None), True)


AnyMap = Annotated[InlineMap | StoredMap, OneOf("segments and map_id, found both or neither", ("segments", "map_id"))]


class _Scan(Strict):
    """Fields of a scan in each form.

    Attributes
    ----------
    frame_id
        frame of the scan, as `child_frame_id` of the answer
    stamp
        returned as it was sent
    viewpoint
        position of the sensor, metres; null: several positions, and lines of sight are not used as evidence
    """

    frame_id: FrameId = "laser"
    stamp: FreeJson = None
    viewpoint: Point | None = Field(default_factory=lambda: [0.0, 0.0])


def require_at_the_sensor(viewpoint: list[float] | None) -> None:
    """Refuse another viewpoint of ranges than where they were measured."""
    if viewpoint is not None and any(viewpoint):
        raise PydanticCustomError(
            "viewpoint",
            "expected [0, 0] or null for ranges, because beams start at the sensor; send the mount as `pose` of a view",
        )


class MeasuredFields(Strict):
    """Segments of a scan with what is known of the points behind them.

    Attributes
    ----------
    segments
        `[x1, y1, x2, y2]` each, metres, in the sensor's frame
    sigma
        standard deviation of single points normal to the wall, metres; of all or of each segment
    point_counts
        number of points on each segment; default length / 0.05, and at least 2 on each wall
    centroids
        mean of those points, as /v1/vectorize gives it, metres
    spreads
        second moment of those points along the segment, m^2; send it with `centroids`
    """

    segments: ScanSegmentRows
    sigma: SigmaOrSigmas = 0.02
    point_counts: PointCounts | None = None
    centroids: CentroidRows | None = None
    spreads: Spreads | None = None

    @model_validator(mode="after")
    def _both_moments(self) -> MeasuredFields:
        if (self.centroids is None) != (self.spreads is None):
            raise PydanticCustomError(
                "moments", "expected both centroids and spreads, found one of them; send both or neither"
            )
        return self


class SegmentScan(_Scan, MeasuredFields):
    """A scan as segments."""


class Header(Strict):
    """The header of a LaserScan message: `stamp` and `frame_id` of the scan, where it says nothing of them itself.

    Attributes
    ----------
    stamp
        returned as it was sent
    frame_id
        frame of the scan where it names none itself
    seq
        sequence number of ROS 1; not used
    """

    stamp: FreeJson = None
    frame_id: FrameId = ""
    seq: Any = None


Increment = Annotated[
    float,
    AfterValidator(in_radians(-1.0, 1.0, "1 either way at most")),
    WithJsonSchema(
        {"anyOf": [{"type": "number", "minimum": a, "maximum": b} for a, b in ((-1.0, -1e-6), (1e-6, 1.0))]}
    ),
]


class Laser(Strict):
    """One turn of a scanner, as in a LaserScan message.

    Attributes
    ----------
    angle_min
        radians, of the first beam
    angle_increment
        radians from beam to beam; negative for a clockwise scanner
    ranges
        metres; null or below range_min: unknown; above range_max: no return, so free space
    range_min
        metres
    range_max
        metres; a range of exactly this is a return
    header
        header of a LaserScan message
    time_increment
        seconds from beam to beam; with a `twist` the motion during the scan is corrected; without it the covariance is
        wider, and the answer has the warning `motion_unknown`
    angle_max
        radians, of the last beam; at most two beams or 3 degrees from that of the other fields
    scan_time, intensities
        field of a LaserScan message; not used
    """

    angle_min: Angle
    angle_increment: Increment
    ranges: Ranges
    range_min: Annotated[float, Field(ge=0.0, le=1e9)] | None = None
    range_max: Annotated[float, Field(gt=0.0, le=1e9)] | None = None
    header: Header | None = None
    time_increment: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    angle_max: Annotated[float, Field(ge=-1e9, le=1e9)] | None = None
    scan_time: Any = None
    intensities: Any = None


Speed = Annotated[float, Field(ge=-100.0, le=100.0)]


class Twist(Strict):
    """Constant velocity of a sensor during a scan, in its own frame.

    Attributes
    ----------
    vx, vy
        m/s
    omega
        rad/s, counter-clockwise
    """

    vx: Speed
    vy: Speed = 0.0
    omega: Speed


def require_times(laser: Laser, twist: Twist | None) -> None:
    """Refuse a motion of which it is not known when each beam was measured."""
    if twist is not None and laser.time_increment is None:
        raise PydanticCustomError(
            "twist", "a twist requires time_increment of the laser, found none; send time_increment, or omit the twist"
        )


class RangeFields(Strict):
    """Ranges of a sensor, measured where it stood.

    Attributes
    ----------
    sigma
        standard deviation of single ranges, metres; null: estimated
    twist
        velocity of the sensor during the scan, in its own frame; 0: at rest
    """

    laser: Laser
    sigma: RaySigma | None = None
    twist: Twist | None = None

    @model_validator(mode="after")
    def _from_the_sensor(self) -> Self:
        require_at_the_sensor(getattr(self, "viewpoint", None))
        require_times(self.laser, self.twist)
        return self


class PointFields(Strict):
    """Points of a sensor, in scanning order.

    Attributes
    ----------
    points
        `[x, y]` each, metres, in the sensor's frame, in scanning order
    sigma
        standard deviation of single points, metres; null: estimated
    """

    points: PointRows
    sigma: RaySigma | None = None


class LaserScan(_Scan, RangeFields):
    """A scan as ranges.

    Attributes
    ----------
    twist
        velocity of the sensor during the scan, in its own frame; 0: at rest; the pose of the answer is that of the
        first beam
    """

    twist: Twist | None = None


class PointScan(_Scan, PointFields):
    """A scan as points in scanning order."""


class SoftPriorFields(Pose):
    """A Gaussian over the pose. It is part of the score, and never fused into pose or covariance.

    Attributes
    ----------
    covariance
        covariance of additive (x, y, theta); m^2, m rad, rad^2; positive definite
    map_id
        of several maps the one whose frame the pose is in
    """

    covariance: Covariance
    map_id: MapId | None = None


class HardPriorFields(Pose):
    """A window that must contain the answer.

    Attributes
    ----------
    radius
        metres around (x, y)
    angle
        radians around theta
    map_id
        of several maps the one whose frame the pose is in
    """

    radius: Annotated[float, Field(gt=0.0, le=1e6)]
    angle: Annotated[
        float,
        AfterValidator(in_radians(5e-324, 4.0, "above 0 and up to 4")),
        Field(json_schema_extra={"exclusiveMinimum": 0.0, "maximum": 4.0}),
    ]
    map_id: MapId | None = None


AnyPrior = Annotated[
    SoftPriorFields | HardPriorFields,
    OneOf("covariance, or radius with angle", ("covariance", "radius angle")),
]


class SearchOptions(Strict):
    """How to search, and what to put into the answer.

    Attributes
    ----------
    max_alternatives
        largest number of other poses to return
    confidence
        probability of not missing a better pose at which the search ends
    exhaustive
        try every base, independent of `confidence`
    seed
        seed of random sampling
    sampling
        order of the bases: informative and cheap ones first, or random by `seed`
    deadline_ms
        milliseconds; a longer one than `max_deadline_ms` of /v1/limits is shortened to it
    oriented
        whether free space lies on the left of segments; null: as the map states, else true
    offset_tolerance
        gate for offsets between scan lines and walls, metres; null: from the sigmas
    angle_tolerance
        gate for angles between scan lines and walls, radians; null: from the sigmas
    min_overlap
        fraction of a scan segment's length that must lie on the map
    on_map
        prior probability that the scan was taken on this map, or on one of these
    usable_from
        least `probability` of a usable answer
    estimator
        estimator of the final pose; `one_step` is the published closed form
    rotation
        estimate of the rotation for `one_step`
    include
        parts of the answer
    """

    max_alternatives: Annotated[int, Field(ge=0, le=50)] = 5
    confidence: Annotated[float, Field(ge=0.5, le=1.0)] = 0.9999
    exhaustive: bool = False
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    sampling: Literal["ordered", "random"] = "ordered"
    deadline_ms: DeadlineMs | None = None
    oriented: bool | None = None
    offset_tolerance: Annotated[float, Field(ge=1e-3, le=0.4)] | None = None
    angle_tolerance: Annotated[float, Field(ge=1e-3, le=0.35)] | None = None
    min_overlap: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    on_map: Annotated[float, Field(ge=0.5, le=1.0)] = 0.9
    usable_from: Annotated[float, Field(ge=0.5, le=0.9999)] = 0.95
    estimator: Literal["joint", "one_step"] = "joint"
    rotation: Literal["wahba", "mitsuta"] = "wahba"
    include: list[IncludeName] = Field(default_factory=lambda: list(EVERYTHING), max_length=16)
