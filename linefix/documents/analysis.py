"""Request and answer of an analysis of a map; the answer documents the JSON, is never built while answering."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from association import ReasonCode

from .errors import TooManyError
from .limits import Limits
from .parts import AnyMap
from .replies import Index, MapReference, PoseAnswer, Row2, Share, TimingAnswer, Verdict
from .strict import Answer, Coordinate, DeadlineMs, FreeJson, Point, Strict, in_radians

Row = Annotated[list[Coordinate], Field(min_length=4, max_length=4)]
MOST_LANDMARK = 100
MOST_DRIVE = 30.0


class ScannerFields(Strict):
    """The scanner that the robot carries."""

    fov: Annotated[
        float,
        AfterValidator(in_radians(1e-3, 6.2832, "at most a full turn")),
        Field(json_schema_extra={"minimum": 1e-3, "maximum": 6.2832}),
    ] = Field(math.tau, description="field of view about straight ahead, radians")
    beams: Annotated[int, Field(ge=8, le=20_000)] = Field(720, description="over the field of view")
    range_max: Annotated[float, Field(ge=0.5, le=1000.0)] = Field(20.0, description="metres")
    sigma: Annotated[float, Field(ge=1e-6, le=10.0)] = Field(
        0.02, description="standard deviation of the ranges, metres"
    )


class AnalyzeRequest(Strict):
    """Options of an analysis of a map."""

    laser: ScannerFields = ScannerFields()
    spacing: Annotated[float, Field(ge=0.3, le=100.0)] | None = Field(
        None, description="metres between places; null: about 400 places over the box around the map"
    )
    point: Point | None = Field(
        None,
        description="a free point in the map, metres; only places that are reachable from it without crossing a wall",
    )
    drive: Annotated[float, Field(ge=0.0, le=MOST_DRIVE)] = Field(
        0.0, description="metres that the robot may drive where a single scan is not usable; 0: none"
    )
    landmark: Annotated[list[Row], Field(max_length=MOST_LANDMARK)] = Field(
        default=[],
        description="segments of a possible landmark, in the map frame: each place is also tried with it in the "
        "building and on the map; the free side of a box is its outside",
    )
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = Field(0, description="seed of the scanner's noise")
    deadline_ms: DeadlineMs | None = Field(
        None, description="milliseconds; places that it leaves no time for are omitted"
    )
    client_ref: FreeJson = Field(None, description="returned as it was sent")

    @model_validator(mode="after")
    def _within_limits(self, info: ValidationInfo) -> AnalyzeRequest:
        limits: Limits | None = info.context
        if limits is not None and self.laser.beams > limits.beams:
            raise TooManyError("/laser/beams", limits.beams, "beams")
        return self


class MapAnalyzeRequest(AnalyzeRequest):
    """The same, with a map in the request."""

    map: AnyMap = Field(description="the map to analyze, or the id of a stored one")


class WithLandmarkAnswer(Answer):
    """Result at a place with the landmark."""

    status: Verdict
    usable: bool
    probability: Share | None = Field(description="probability, as of /v1/associate; null for `degenerate`")


class AnalyzedPlaceAnswer(Answer):
    """Result at a place."""

    pose: PoseAnswer = Field(description="true pose of the robot")
    status: Verdict = Field(
        description="status, as of /v1/associate; `ambiguous` also for a usable answer at a wrong place"
    )
    usable: bool = Field(description="whether the answer is usable and correct")
    probability: Share | None = Field(description="probability, as of /v1/associate; null for `degenerate`")
    similar_pose: PoseAnswer | None = Field(description="another pose that fits the scan about as well")
    unobservable: Row2 | None = Field(
        description="unit vector in the map frame along which the position is unobservable"
    )
    reasons: list[ReasonCode] = Field(description="codes of why it is not usable, as of /v1/associate")
    resolved_after: float | None = Field(
        description="metres to drive until the answer is usable; 0: at once; null: not within `drive`, or `drive` is 0"
    )
    with_landmark: WithLandmarkAnswer | None = Field(
        description="null without a landmark, or where it occupies the place"
    )


class AnalysisSummaryAnswer(Answer):
    """Counts of the places."""

    places: Index
    usable: Index
    ok: Index
    ambiguous: Index
    degenerate: Index
    no_match: Index
    similar_pose: Index = Field(description="places with a similar pose")
    resolved_within: Index | None = Field(
        description="places with a usable answer at once or within `drive`; null: `drive` is 0"
    )
    usable_with_landmark: Index | None = Field(description="places usable with the landmark; null where there is none")
    not_free: Index = Field(description="poses of the grid that are not free")
    left_out: Index = Field(description="poses of the grid that the deadline left no time for")


class AnalyzeAnswer(Answer):
    """Analysis of a map."""

    places: list[AnalyzedPlaceAnswer] = Field(description="row by row")
    summary: AnalysisSummaryAnswer
    spacing: float = Field(description="metres between places")
    complete: bool = Field(description="false if the deadline ended the analysis early")
    map: MapReference | None = Field(description="null where the map came with the request")
    client_ref: Any = Field(description="returned as it was sent")
    request_id: str
    timing_ms: TimingAnswer
