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
    """A map, as a file of its own or to be stored."""

    segments: MapSegmentRows = Field(description="`[x1, y1, x2, y2]` each, metres, free space on the left")
    sigma: MapSigma | None = Field(
        None, description="standard deviation of the map's lines, normal to the lines, metres; null: estimated"
    )
    oriented: bool | None = Field(
        None,
        description="whether free space lies on the left of its segments; null: true; a request's option has "
        "precedence",
    )
    frame_id: FrameId = Field("map", description="frame of the map, as `frame_id` of the answer")
    points: MapPointRows = Field(
        default_factory=lambda: np.zeros((0, 2)),
        description="`[x, y]` each, metres: objects too small for a wall, such as legs and posts; evidence for the "
        "beams of a scan only; at most as many as `max_map_segments` of /v1/limits",
        json_schema_extra={"default": []},
    )
    points_sigma: PointSigma | None = Field(
        None, description="standard deviation of the points' positions, and half their width, metres; null: 0.05"
    )
    meta: FreeJson = Field(None, description="returned as it was sent")


class InlineMap(MapDocument):
    """A map in the request itself."""

    meta: FreeJson = Field(None, description="not used; allowed, so that a map file may be sent unchanged")


class StoredMap(Strict):
    """A map that was stored with PUT before."""

    map_id: MapId = Field(description="id under which the map was stored")


def is_oriented(asked: bool | None, own: bool | None) -> bool:
    """Tell whether directions mean anything: as the request says, else as the map does, else yes."""
    return next((said for said in (asked, own) if said is not None), True)


AnyMap = Annotated[InlineMap | StoredMap, OneOf("segments and map_id, found both or neither", ("segments", "map_id"))]


class _Scan(Strict):
    frame_id: FrameId = Field("laser", description="frame of the scan, as `child_frame_id` of the answer")
    stamp: FreeJson = Field(None, description="returned as it was sent")
    viewpoint: Point | None = Field(
        default_factory=lambda: [0.0, 0.0],
        description="position of the sensor, metres; null: several positions, and lines of sight are not used as "
        "evidence",
    )


def require_at_the_sensor(viewpoint: list[float] | None) -> None:
    """Refuse another viewpoint of ranges than where they were measured."""
    if viewpoint is not None and any(viewpoint):
        raise PydanticCustomError(
            "viewpoint",
            "expected [0, 0] or null for ranges, because beams start at the sensor; send the mount as `pose` of a view",
        )


class MeasuredFields(Strict):
    """Segments of a scan with what is known of the points behind them."""

    segments: ScanSegmentRows = Field(description="`[x1, y1, x2, y2]` each, metres, in the sensor's frame")
    sigma: SigmaOrSigmas = Field(
        0.02, description="standard deviation of single points normal to the wall, metres; of all or of each segment"
    )
    point_counts: PointCounts | None = Field(
        None, description="number of points on each segment; default length / 0.05, and at least 2 on each wall"
    )
    centroids: CentroidRows | None = Field(None, description="mean of those points, as /v1/vectorize gives it, metres")
    spreads: Spreads | None = Field(
        None, description="second moment of those points along the segment, m^2; send it with `centroids`"
    )

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
    """The header of a LaserScan message: `stamp` and `frame_id` of the scan, where it says nothing of them itself."""

    stamp: FreeJson = Field(None, description="returned as it was sent")
    frame_id: FrameId = Field("", description="frame of the scan where it names none itself")
    seq: Any = Field(None, description="sequence number of ROS 1; not used")


Increment = Annotated[
    float,
    AfterValidator(in_radians(-1.0, 1.0, "1 either way at most")),
    WithJsonSchema(
        {"anyOf": [{"type": "number", "minimum": a, "maximum": b} for a, b in ((-1.0, -1e-6), (1e-6, 1.0))]}
    ),
]


class Laser(Strict):
    """One turn of a scanner, as in a LaserScan message."""

    angle_min: Angle = Field(description="radians, of the first beam")
    angle_increment: Increment = Field(description="radians from beam to beam; negative for a clockwise scanner")
    ranges: Ranges = Field(
        description="metres; null or below range_min: unknown; above range_max: no return, so free space"
    )
    range_min: Annotated[float, Field(ge=0.0, le=1e9)] | None = Field(None, description="metres")
    range_max: Annotated[float, Field(gt=0.0, le=1e9)] | None = Field(
        None, description="metres; a range of exactly this is a return"
    )
    header: Header | None = Field(None, description="header of a LaserScan message")
    time_increment: Annotated[float, Field(ge=0.0, le=1.0)] | None = Field(
        None,
        description="seconds from beam to beam; with a `twist` the motion during the scan is corrected; without it "
        "the covariance is wider, and the answer has the warning `motion_unknown`",
    )
    angle_max: Annotated[float, Field(ge=-1e9, le=1e9)] | None = Field(
        None,
        description="radians, of the last beam; at most two beams or 3 degrees from that of the other fields",
    )
    scan_time: Any = Field(None, description="field of a LaserScan message; not used")
    intensities: Any = Field(None, description="field of a LaserScan message; not used")


Speed = Annotated[float, Field(ge=-100.0, le=100.0)]


class Twist(Strict):
    """Constant velocity of a sensor during a scan, in its own frame."""

    vx: Speed = Field(description="m/s")
    vy: Speed = Field(0.0, description="m/s")
    omega: Speed = Field(description="rad/s, counter-clockwise")


def require_times(laser: Laser, twist: Twist | None) -> None:
    """Refuse a motion of which it is not known when each beam was measured."""
    if twist is not None and laser.time_increment is None:
        raise PydanticCustomError(
            "twist", "a twist requires time_increment of the laser, found none; send time_increment, or omit the twist"
        )


class RangeFields(Strict):
    """Ranges of a sensor, measured where it stood."""

    laser: Laser
    sigma: RaySigma | None = Field(None, description="standard deviation of single ranges, metres; null: estimated")
    twist: Twist | None = Field(
        None, description="velocity of the sensor during the scan, in its own frame; 0: at rest"
    )

    @model_validator(mode="after")
    def _from_the_sensor(self) -> Self:
        require_at_the_sensor(getattr(self, "viewpoint", None))
        require_times(self.laser, self.twist)
        return self


class PointFields(Strict):
    """Points of a sensor, in scanning order."""

    points: PointRows = Field(description="`[x, y]` each, metres, in the sensor's frame, in scanning order")
    sigma: RaySigma | None = Field(None, description="standard deviation of single points, metres; null: estimated")


class LaserScan(_Scan, RangeFields):
    """A scan as ranges."""

    twist: Twist | None = Field(
        None,
        description="velocity of the sensor during the scan, in its own frame; 0: at rest; the pose of the answer is "
        "that of the first beam",
    )


class PointScan(_Scan, PointFields):
    """A scan as points in scanning order."""


class SoftPriorFields(Pose):
    """A Gaussian over the pose. It is part of the score, and never fused into pose or covariance."""

    covariance: Covariance = Field(
        description="covariance of additive (x, y, theta); m^2, m rad, rad^2; positive definite"
    )
    map_id: MapId | None = Field(None, description="of several maps the one whose frame the pose is in")


class HardPriorFields(Pose):
    """A window that must contain the answer."""

    radius: Annotated[float, Field(gt=0.0, le=1e6)] = Field(description="metres around (x, y)")
    angle: Annotated[
        float,
        AfterValidator(in_radians(5e-324, 4.0, "above 0 and up to 4")),
        Field(json_schema_extra={"exclusiveMinimum": 0.0, "maximum": 4.0}),
    ] = Field(description="radians around theta")
    map_id: MapId | None = Field(None, description="of several maps the one whose frame the pose is in")


AnyPrior = Annotated[
    SoftPriorFields | HardPriorFields,
    OneOf("covariance, or radius with angle", ("covariance", "radius angle")),
]


class SearchOptions(Strict):
    """How to search, and what to put into the answer."""

    max_alternatives: Annotated[int, Field(ge=0, le=50)] = Field(
        5, description="largest number of other poses to return"
    )
    confidence: Annotated[float, Field(ge=0.5, le=1.0)] = Field(
        0.9999, description="probability of not missing a better pose at which the search ends"
    )
    exhaustive: bool = Field(False, description="try every base, independent of `confidence`")
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = Field(0, description="seed of random sampling")
    sampling: Literal["ordered", "random"] = Field(
        "ordered", description="order of the bases: informative and cheap ones first, or random by `seed`"
    )
    deadline_ms: DeadlineMs | None = Field(
        None, description="milliseconds; a longer one than `max_deadline_ms` of /v1/limits is shortened to it"
    )
    oriented: bool | None = Field(
        None,
        description="whether free space lies on the left of segments; null: as the map states, else true",
    )
    offset_tolerance: Annotated[float, Field(ge=1e-3, le=0.4)] | None = Field(
        None, description="gate for offsets between scan lines and walls, metres; null: from the sigmas"
    )
    angle_tolerance: Annotated[float, Field(ge=1e-3, le=0.35)] | None = Field(
        None, description="gate for angles between scan lines and walls, radians; null: from the sigmas"
    )
    min_overlap: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        0.5, description="fraction of a scan segment's length that must lie on the map"
    )
    on_map: Annotated[float, Field(ge=0.5, le=1.0)] = Field(
        0.9, description="prior probability that the scan was taken on this map, or on one of these"
    )
    usable_from: Annotated[float, Field(ge=0.5, le=0.9999)] = Field(
        0.95, description="least `probability` of a usable answer"
    )
    estimator: Literal["joint", "one_step"] = Field(
        "joint", description="estimator of the final pose; `one_step` is the published closed form"
    )
    rotation: Literal["wahba", "mitsuta"] = Field("wahba", description="estimate of the rotation for `one_step`")
    include: list[IncludeName] = Field(
        default_factory=lambda: list(EVERYTHING),
        max_length=16,
        description="parts of the answer",
    )
