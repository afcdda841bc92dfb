"""Requests and answers of a map update, and of its accepted changes; answers document the JSON, and are never built."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from map_quality import ChangeCode, KeptCode

from .arrays import Covariance, MapSegmentRows
from .limits import require_within
from .parts import MapDocument, MapSigma
from .replies import MapReference, ReferencedAnswer
from .sensors import LaserScan
from .strict import Answer, Coordinate, DeadlineMs, FreeJson, Index, Pose, Referenced, Row2, Row4, Share, Strict

MOST_VISITS = 100
MOST_NEW = 10_000  # segments of all changes; each is an object, and takes a kilobyte
_SegmentIndex = Annotated[int, Field(ge=0, le=10_000_000)]


class UpdateScan(LaserScan):
    """A scan as ranges, and optionally the pose of it that the robot assumed, or its odometry.

    Attributes
    ----------
    pose
        assumed pose, a prior of the search; it is evidence only if the search confirms it
    covariance
        covariance of additive (x, y, theta) of `pose`, required with it; m^2, m rad, rad^2
    flipped
        the sensor is mounted upside down: y becomes -y in its data
    odometry
        pose of the scan by odometry, in a frame that is fixed during the visit; it carries poses from usable scans of
        the visit to scans without `pose`
    """

    pose: Pose | None = None
    covariance: Covariance | None = None
    flipped: bool = False
    odometry: Pose | None = None

    @model_validator(mode="after")
    def _both(self) -> UpdateScan:
        if (self.pose is None) != (self.covariance is None):
            raise PydanticCustomError("pose", "expected both pose and covariance, found one of them; send both or none")
        return self


class Visit(Strict):
    """Scans of one visit to the building, such as a drive or a day.

    Attributes
    ----------
    visit
        name of the visit
    scans
        the scans; those with `odometry` in the order of time
    """

    visit: Annotated[str, Field(min_length=1, max_length=128)]
    scans: Annotated[list[UpdateScan], Field(min_length=1)]


class UpdateRequest(Referenced):
    """Scans of several visits, from which changes of the map are learned.

    Attributes
    ----------
    visits
        a change needs scans of two visits at least; all scans together at most `max_batch` of /v1/limits
    accept
        confidence below which a change is not in the new map; null: all changes are in it
    refuse
        indices of changes that are not in the new map
    deadline_ms
        milliseconds; if it passes before the changes are verified, none is proposed
    """

    visits: Annotated[list[Visit], Field(min_length=1, max_length=MOST_VISITS)]
    accept: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    refuse: Annotated[list[Annotated[int, Field(ge=0)]], Field(max_length=10_000)] = Field(default=[])
    deadline_ms: DeadlineMs | None = None

    @model_validator(mode="after")
    def _checked(self, info: ValidationInfo) -> UpdateRequest:
        require_within(
            info, "batch", sum(len(one.scans) for one in self.visits), "scans of all visits together", "/visits"
        )
        names = [one.visit for one in self.visits]
        if len(set(names)) < len(names):
            raise PydanticCustomError(
                "visits", "found two visits of the same name, expected a name of its own for each"
            )
        return self


class NewSegmentAnswer(Answer):
    """A segment of the new map.

    Attributes
    ----------
    segment
        `[x1, y1, x2, y2]`, metres, free space on the left
    sigma
        standard deviation normal to the segment, metres
    """

    segment: Row4
    sigma: float


class EvidenceAnswer(Answer):
    """Evidence for a change.

    Attributes
    ----------
    beams_through
        number of beams through the old segments
    beams_on
        number of beams that end on the new segments
    poses
        number of places of the scans, squares of 0.5 m
    visits
        number of visits that show the change
    from_
        the first of them, in the order of the request
    to
        the last of them
    """

    beams_through: Index
    beams_on: Index
    poses: Index
    visits: Index
    from_: str = Field(alias="from")
    to: str


class ChangeAnswer(Answer):
    """A proposed change.

    Attributes
    ----------
    code
        later versions may add codes
    segments
        indices of the old map's segments that it replaces
    new
        segments in their place
    confidence
        confidence that the building has changed so
    accepted
        whether it is in the new map
    """

    code: ChangeCode
    segments: list[Index]
    new: list[NewSegmentAnswer]
    evidence: EvidenceAnswer
    confidence: Share
    accepted: bool


class NewMapAnswer(Answer):
    """The new map, as PUT takes it.

    Attributes
    ----------
    points
        `[x, y]` each, metres; absent if the map has none
    points_sigma
        metres; absent if the map has no points
    """

    segments: list[Row4]
    sigma: float | None
    oriented: bool | None
    frame_id: str
    points: list[Row2] = Field([])
    points_sigma: float | None = None
    meta: Any


class HeldBackAnswer(Answer):
    """Scans that gave no evidence, and test the proposal.

    Attributes
    ----------
    usable_before
        number of usable scans on the old map
    usable_after
        number of usable scans on the map with all changes
    """

    scans: Index
    usable_before: Index
    usable_after: Index


class SharpenedAnswer(Answer):
    """Walls that are in the new map at better positions; only of a map that declares a sigma of 8 mm or more.

    Attributes
    ----------
    segments
        indices of the old map's segments
    ends
        `[x1, y1, x2, y2]` of each in the new map, metres
    sigma
        standard deviation of each normal to itself, metres
    """

    segments: list[Index]
    ends: list[Row4]
    sigma: list[float]


class RefusedVisitAnswer(Answer):
    """A visit that gives no evidence.

    Attributes
    ----------
    message
        reason and remedy, for people
    """

    visit: str
    message: str


class KeptWallsAnswer(Answer):
    """Walls of the map that stay although beams of several visits pass through a part of them.

    Attributes
    ----------
    code
        later versions may add codes
    message
        the reason, for people
    segments
        indices of the old map's segments
    """

    code: KeptCode
    message: str
    segments: list[Index]


class UpdateAnswer(ReferencedAnswer):
    """Proposed changes of a map; nothing is stored.

    Attributes
    ----------
    map
        the new map, with the accepted changes
    based_on
        the map that it was made from; its revision is for If-Match
    changes
        the surest first
    scans
        number of scans that were searched
    usable_before
        number of usable scans on the old map
    usable_after
        number of usable scans on the map with all changes
    held_back
        one in ten of these scans
    complete
        false if the deadline ended the update; changes are then left out
    """

    map: NewMapAnswer
    based_on: MapReference
    changes: list[ChangeAnswer]
    scans: Index
    usable_before: Index
    usable_after: Index
    held_back: HeldBackAnswer
    sharpened: SharpenedAnswer
    refused_visits: list[RefusedVisitAnswer]
    kept: list[KeptWallsAnswer]
    complete: bool


class NewSegment(Strict):
    """A segment of the new map.

    Attributes
    ----------
    segment
        `[x1, y1, x2, y2]`, metres, free space on the left
    sigma
        standard deviation normal to the segment, metres; not used
    """

    segment: Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
    sigma: MapSigma


class ProposedChange(Strict):
    """A change as an update proposed it.

    Attributes
    ----------
    code
        kind of change
    segments
        indices of the old map's segments that it replaces
    new
        segments in their place
    evidence
        not used; allowed, so that a change may be sent unchanged
    confidence
        not used, likewise
    accepted
        whether it is in the new map
    """

    code: ChangeCode
    segments: Annotated[list[_SegmentIndex], Field(max_length=100_000)]
    new: Annotated[list[NewSegment], Field(max_length=MOST_NEW)]
    evidence: FreeJson = None
    confidence: float | None = None
    accepted: bool = True


class SharpenedWalls(Strict):
    """Walls at better positions, as an update returned them.

    Attributes
    ----------
    segments
        indices of the old map's segments
    ends
        `[x1, y1, x2, y2]` of each, metres
    sigma
        standard deviation of each normal to itself, metres
    """

    segments: Annotated[list[_SegmentIndex], Field(max_length=1_000_000)]
    ends: MapSegmentRows
    sigma: Annotated[list[MapSigma], Field(max_length=1_000_000)]

    @model_validator(mode="after")
    def _as_many(self) -> SharpenedWalls:
        if not len(self.segments) == len(self.ends) == len(self.sigma):
            raise PydanticCustomError(
                "sharpened", "expected as many segments as ends and sigma, found different numbers"
            )
        return self


class ApplyRequest(Referenced):
    """A map, and changes of it that an update proposed.

    Attributes
    ----------
    map
        the old map, as the update had it
    changes
        as the update returned them, with at most 10,000 new segments together; `accepted` of each says whether it is in
        the new map
    sharpened
        as the update returned it
    """

    map: MapDocument
    changes: Annotated[list[ProposedChange], Field(max_length=10_000)]
    sharpened: SharpenedWalls | None = None

    @field_validator("changes")
    @classmethod
    def _few_new(cls, value: list[ProposedChange]) -> list[ProposedChange]:
        if (count := sum(len(one.new) for one in value)) > MOST_NEW:
            raise PydanticCustomError(
                "new", f"expected at most {MOST_NEW} new segments of all changes, found {count}; accept fewer at once"
            )
        return value


class ApplyAnswer(ReferencedAnswer):
    """A map with the accepted changes; nothing is stored.

    Attributes
    ----------
    map
        the new map, with the accepted changes
    """

    map: NewMapAnswer
