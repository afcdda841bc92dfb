"""Request and answer of an analysis of a map; the answer documents the JSON, is never built while answering."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from association import ReasonCode

from .limits import require_within
from .parts import AnyMap
from .replies import MapReference, PoseAnswer, ReferencedAnswer
from .strict import Answer, Coordinate, DeadlineMs, Index, Point, Referenced, Row2, Share, Strict, Verdict, in_radians

Row = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
MOST_LANDMARK = 100
MOST_DRIVE = 30.0


class ScannerFields(Strict):
    """The scanner that the robot carries.

    Attributes
    ----------
    fov
        field of view about straight ahead, radians
    beams
        over the field of view
    range_max
        metres
    sigma
        standard deviation of the ranges, metres
    """

    fov: Annotated[
        float,
        AfterValidator(in_radians(1e-3, 6.2832, "at most a full turn")),
        Field(json_schema_extra={"minimum": 1e-3, "maximum": 6.2832}),
    ] = math.tau
    beams: Annotated[int, Field(ge=8, le=20_000)] = 720
    range_max: Annotated[float, Field(ge=0.5, le=1000.0)] = 20.0
    sigma: Annotated[float, Field(ge=1e-6, le=10.0)] = 0.02


class AnalyzeRequest(Referenced):
    """Options of an analysis of a map.

    Attributes
    ----------
    spacing
        metres between places; null: about 400 places over the box around the map
    point
        a free point in the map, metres; only places that are reachable from it without crossing a wall
    drive
        metres that the robot may drive where a single scan is not usable; 0: none
    landmark
        segments of a possible landmark, in the map frame: each place is also tried with it in the building and on the
        map; the free side of a box is its outside
    seed
        seed of the scanner's noise
    deadline_ms
        milliseconds; places that it leaves no time for are omitted
    """

    laser: ScannerFields = ScannerFields()
    spacing: Annotated[float, Field(ge=0.3, le=100.0)] | None = None
    point: Point | None = None
    drive: Annotated[float, Field(ge=0.0, le=MOST_DRIVE)] = 0.0
    landmark: Annotated[list[Row], Field(max_length=MOST_LANDMARK)] = Field(default=[])
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    deadline_ms: DeadlineMs | None = None

    @model_validator(mode="after")
    def _within_limits(self, info: ValidationInfo) -> AnalyzeRequest:
        require_within(info, "beams", self.laser.beams, "beams", "/laser/beams")
        return self


class MapAnalyzeRequest(AnalyzeRequest):
    """The same, with a map in the request.

    Attributes
    ----------
    map
        the map to analyze, or the id of a stored one
    """

    map: AnyMap


class WithLandmarkAnswer(Answer):
    """Result at a place with the landmark.

    Attributes
    ----------
    probability
        probability, as of /v1/associate; null for `degenerate`
    """

    status: Verdict
    usable: bool
    probability: Share | None


class AnalyzedPlaceAnswer(Answer):
    """Result at a place.

    Attributes
    ----------
    pose
        true pose of the robot
    status
        status, as of /v1/associate; `ambiguous` also for a usable answer at a wrong place
    usable
        whether the answer is usable and correct
    probability
        probability, as of /v1/associate; null for `degenerate`
    similar_pose
        another pose that fits the scan about as well
    unobservable
        unit vector in the map frame along which the position is unobservable
    reasons
        codes of why it is not usable, as of /v1/associate
    resolved_after
        metres to drive until the answer is usable; 0: at once; null: not within `drive`, or `drive` is 0
    with_landmark
        null without a landmark, or where it occupies the place
    """

    pose: PoseAnswer
    status: Verdict
    usable: bool
    probability: Share | None
    similar_pose: PoseAnswer | None
    unobservable: Row2 | None
    reasons: list[ReasonCode]
    resolved_after: float | None
    with_landmark: WithLandmarkAnswer | None


class AnalysisSummaryAnswer(Answer):
    """Counts of the places.

    Attributes
    ----------
    similar_pose
        places with a similar pose
    resolved_within
        places with a usable answer at once or within `drive`; null: `drive` is 0
    usable_with_landmark
        places usable with the landmark; null where there is none
    not_free
        poses of the grid that are not free
    left_out
        poses of the grid that the deadline left no time for
    """

    places: Index
    usable: Index
    ok: Index
    ambiguous: Index
    degenerate: Index
    no_match: Index
    similar_pose: Index
    resolved_within: Index | None
    usable_with_landmark: Index | None
    not_free: Index
    left_out: Index


class AnalyzeAnswer(ReferencedAnswer):
    """Analysis of a map.

    Attributes
    ----------
    places
        row by row
    spacing
        metres between places
    complete
        false if the deadline ended the analysis early
    map
        null where the map came with the request
    """

    places: list[AnalyzedPlaceAnswer]
    summary: AnalysisSummaryAnswer
    spacing: float
    complete: bool
    map: MapReference | None
