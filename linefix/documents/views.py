"""Scans of several views: what each sensor saw, and where it was."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, ValidationInfo, model_validator

from .arrays import StepCovariance
from .limits import require_within
from .sensors import LaserScan, MeasuredFields, PointFields, PointScan, RangeFields, SegmentScan
from .strict import FrameId, FreeJson, OneOf, Point, Pose, Strict


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
