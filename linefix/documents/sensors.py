"""Scans that requests have, as each sensor sends them: segments, ranges, points; and of several views."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, ValidationInfo, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from .arrays import (
    CentroidRows,
    PointCounts,
    PointRows,
    Ranges,
    ScanSegmentRows,
    SigmaOrSigmas,
    Spreads,
    StepCovariance,
)
from .limits import require_within
from .strict import Angle, FrameId, FreeJson, OneOf, Point, Pose, Strict, in_radians

RaySigma = Annotated[float, Field(ge=1e-6, le=10.0)]


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


class SensorPose(Pose):
    """The sensor's pose in the scan's frame: ``p_scan = R(theta) p_sensor + [x, y]``."""


class _View(Strict):
    """Fields of a view in each form.

    Attributes
    ----------
    flipped
        mounted upside down: y becomes -y in the sensor's data before `pose`
    covariance
        covariance of the step from the view `relative_to`: of additive (x, y, theta) of this pose in the frame of that
        view; m^2, m rad, rad^2; deviations of at most 10 m and 10 rad; null: exact
    relative_to
        index of the view that `covariance` is relative to; null: the scan's frame itself
    viewpoint
        position of the sensor in its own frame, metres; null: several positions
    """

    pose: SensorPose
    flipped: bool = False
    covariance: StepCovariance | None = None
    relative_to: Annotated[int, Field(ge=0)] | None = None
    viewpoint: Point | None = Field(default_factory=lambda: [0.0, 0.0])


class SegmentView(_View, MeasuredFields):
    """A view as segments."""


class LaserView(RangeFields, _View):
    """A view as ranges."""


class PointView(PointFields, _View):
    """A view as points in scanning order."""


OneScan = SegmentScan | LaserScan | PointScan
OneView = SegmentView | LaserView | PointView
BY_FORM = ("segments", "laser ranges", "points")  # ranges: without the `laser` around them
AnyView = Annotated[OneView, OneOf("segments, laser and points", BY_FORM)]


class ViewsScan(Strict):
    """A scan of several views: of the sensors of a robot, or from places along its way.

    Attributes
    ----------
    views
        the views, at most `max_views` of /v1/limits
    frame_id
        frame that the views share; `child_frame_id` of the answer
    stamp
        returned as it was sent
    """

    views: list[AnyView] = Field(min_length=1)
    frame_id: FrameId = "base_link"
    stamp: FreeJson = None

    @model_validator(mode="before")
    @classmethod
    def _few(cls, value: Any, info: ValidationInfo) -> Any:
        views = value.get("views") if isinstance(value, dict) else None
        if isinstance(views, list):
            require_within(info, "views", len(views), "views")
        return value

    @model_validator(mode="after")
    def _within_limits(self, info: ValidationInfo) -> ViewsScan:
        segments = sum(len(view.segments) for view in self.views if isinstance(view, SegmentView))
        beams = sum(len(view.laser.ranges) for view in self.views if isinstance(view, LaserView))
        beams += sum(len(view.points) for view in self.views if isinstance(view, PointView))
        require_within(info, "segments_together", segments, "segments of all views together")
        require_within(info, "beams_together", beams, "ranges or points of all views together")
        return self


AnyScan = Annotated[OneScan | ViewsScan, OneOf("segments, laser, points and views", (*BY_FORM, "views"))]
