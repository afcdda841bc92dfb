"""Request and answer of a map update; the answer documents the JSON, is never built while answering."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, ValidationInfo, model_validator
from pydantic_core import PydanticCustomError

from map_quality import ChangeCode

from .arrays import Covariance, MapSegmentRows
from .errors import TooManyError
from .limits import Limits
from .parts import LaserScan, MapDocument, MapSigma
from .replies import Index, MapReference, Row2, Row4, Share, TimingAnswer
from .strict import Answer, Coordinate, DeadlineMs, FreeJson, Pose, Strict

MOST_VISITS = 100


class UpdateScan(LaserScan):
    """A scan as ranges, and optionally the pose of it that the robot assumed, or its odometry."""

    pose: Pose | None = Field(
        None, description="assumed pose, a prior of the search; it is evidence only if the search confirms it"
    )
    covariance: Covariance | None = Field(
        None, description="covariance of additive (x, y, theta) of `pose`, required with it; m^2, m rad, rad^2"
    )
    flipped: bool = Field(False, description="the sensor is mounted upside down: y becomes -y in its data")
    odometry: Pose | None = Field(
        None,
        description="pose of the scan by odometry, in a frame that is fixed during the visit; "
        "it carries poses from usable scans of the visit to scans without `pose`",
    )

    @model_validator(mode="after")
    def _both(self) -> UpdateScan:
        if (self.pose is None) != (self.covariance is None):
            raise PydanticCustomError("pose", "expected both pose and covariance, found one of them; send both or none")
        return self


class Visit(Strict):
    """Scans of one visit to the building, such as a drive or a day."""

    visit: Annotated[str, Field(min_length=1, max_length=128)] = Field(description="name of the visit")
    scans: Annotated[list[UpdateScan], Field(min_length=1)] = Field(
        description="the scans; those with `odometry` in the order of time"
    )


class UpdateRequest(Strict):
    """Scans of several visits, from which changes of the map are learned."""

    visits: Annotated[list[Visit], Field(min_length=1, max_length=MOST_VISITS)] = Field(
        description="a change needs scans of two visits at least; all scans together at most `max_batch` of /v1/limits"
    )
    accept: Annotated[float, Field(ge=0.0, le=1.0)] | None = Field(
        None, description="confidence below which a change is not in the new map; null: all changes are in it"
    )
    refuse: Annotated[list[Annotated[int, Field(ge=0)]], Field(max_length=10_000)] = Field(
        default=[], description="indices of changes that are not in the new map"
    )
    deadline_ms: DeadlineMs | None = Field(
        None, description="milliseconds; if it passes before the changes are verified, none is proposed"
    )
    client_ref: FreeJson = Field(None, description="returned as it was sent")

    @model_validator(mode="after")
    def _checked(self, info: ValidationInfo) -> UpdateRequest:
        limits: Limits | None = info.context
        if limits is not None and sum(len(one.scans) for one in self.visits) > limits.batch:
            raise TooManyError("/visits", limits.batch, "scans of all visits together")
        names = [one.visit for one in self.visits]
        if len(set(names)) < len(names):
            raise PydanticCustomError(
                "visits", "found two visits of the same name, expected a name of its own for each"
            )
        return self


class NewSegmentAnswer(Answer):
    """A segment of the new map."""

    segment: Row4 = Field(description="`[x1, y1, x2, y2]`, metres, free space on the left")
    sigma: float = Field(description="standard deviation normal to the segment, metres")


class EvidenceAnswer(Answer):
    """Evidence for a change."""

    beams_through: Index = Field(description="number of beams through the old segments")
    beams_on: Index = Field(description="number of beams that end on the new segments")
    poses: Index = Field(description="number of places of the scans, squares of 0.5 m")
    visits: Index = Field(description="number of visits that show the change")
    from_: str = Field(alias="from", description="the first of them, in the order of the request")
    to: str = Field(description="the last of them")


class ChangeAnswer(Answer):
    """A proposed change."""

    code: ChangeCode = Field(description="later versions may add codes")
    segments: list[Index] = Field(description="indices of the old map's segments that it replaces")
    new: list[NewSegmentAnswer] = Field(description="segments in their place")
    evidence: EvidenceAnswer
    confidence: Share = Field(description="confidence that the building has changed so")
    accepted: bool = Field(description="whether it is in the new map")


class NewMapAnswer(Answer):
    """The new map, as PUT takes it."""

    segments: list[Row4]
    sigma: float | None
    oriented: bool | None
    frame_id: str
    points: list[Row2] = Field([], description="`[x, y]` each, metres; absent if the map has none")
    points_sigma: float | None = Field(None, description="metres; absent if the map has no points")
    meta: Any


class HeldBackAnswer(Answer):
    """Scans that gave no evidence, and test the proposal."""

    scans: Index
    usable_before: Index = Field(description="number of usable scans on the old map")
    usable_after: Index = Field(description="number of usable scans on the map with all changes")


class SharpenedAnswer(Answer):
    """Walls that are in the new map at better positions; only of a map that declares a sigma of 8 mm or more."""

    segments: list[Index] = Field(description="indices of the old map's segments")
    ends: list[Row4] = Field(description="`[x1, y1, x2, y2]` of each in the new map, metres")
    sigma: list[float] = Field(description="standard deviation of each normal to itself, metres")


class RefusedVisitAnswer(Answer):
    """A visit that gives no evidence."""

    visit: str
    message: str = Field(description="reason and remedy, for people")


class UpdateAnswer(Answer):
    """Proposed changes of a map; nothing is stored."""

    map: NewMapAnswer = Field(description="the new map, with the accepted changes")
    based_on: MapReference = Field(description="the map that it was made from; its revision is for If-Match")
    changes: list[ChangeAnswer] = Field(description="the surest first")
    scans: Index = Field(description="number of scans that were searched")
    usable_before: Index = Field(description="number of usable scans on the old map")
    usable_after: Index = Field(description="number of usable scans on the map with all changes")
    held_back: HeldBackAnswer = Field(description="one in ten of these scans")
    sharpened: SharpenedAnswer
    refused_visits: list[RefusedVisitAnswer]
    complete: bool = Field(description="false if the deadline ended the update; changes are then left out")
    client_ref: Any = Field(description="returned as it was sent")
    request_id: str
    timing_ms: TimingAnswer


MOST_NEW = 10_000  # segments of one change
_SegmentIndex = Annotated[int, Field(ge=0, le=10_000_000)]


class NewSegment(Strict):
    """A segment of the new map."""

    segment: Annotated[list[Coordinate], Field(min_length=4, max_length=4)] = Field(
        description="`[x1, y1, x2, y2]`, metres, free space on the left"
    )
    sigma: MapSigma = Field(description="standard deviation normal to the segment, metres; not used")


class ProposedChange(Strict):
    """A change as an update proposed it."""

    code: ChangeCode = Field(description="kind of change")
    segments: Annotated[list[_SegmentIndex], Field(max_length=100_000)] = Field(
        description="indices of the old map's segments that it replaces"
    )
    new: Annotated[list[NewSegment], Field(max_length=MOST_NEW)] = Field(description="segments in their place")
    evidence: FreeJson = Field(None, description="not used; allowed, so that a change may be sent unchanged")
    confidence: float | None = Field(None, description="not used, likewise")
    accepted: bool = Field(True, description="whether it is in the new map")


class SharpenedWalls(Strict):
    """Walls at better positions, as an update returned them."""

    segments: Annotated[list[_SegmentIndex], Field(max_length=1_000_000)] = Field(
        description="indices of the old map's segments"
    )
    ends: MapSegmentRows = Field(description="`[x1, y1, x2, y2]` of each, metres")
    sigma: Annotated[list[MapSigma], Field(max_length=1_000_000)] = Field(
        description="standard deviation of each normal to itself, metres"
    )

    @model_validator(mode="after")
    def _as_many(self) -> SharpenedWalls:
        if not len(self.segments) == len(self.ends) == len(self.sigma):
            raise PydanticCustomError(
                "sharpened", "expected as many segments as ends and sigma, found different numbers"
            )
        return self


class ApplyRequest(Strict):
    """A map, and changes of it that an update proposed."""

    map: MapDocument = Field(description="the old map, as the update had it")
    changes: Annotated[list[ProposedChange], Field(max_length=10_000)] = Field(
        description="as the update returned them; `accepted` of each says whether it is in the new map"
    )
    sharpened: SharpenedWalls | None = Field(None, description="as the update returned it")
    client_ref: FreeJson = Field(None, description="returned as it was sent")


class ApplyAnswer(Answer):
    """A map with the accepted changes; nothing is stored."""

    map: NewMapAnswer = Field(description="the new map, with the accepted changes")
    client_ref: Any = Field(description="returned as it was sent")
    request_id: str
    timing_ms: TimingAnswer
