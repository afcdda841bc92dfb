"""What a check of a map answers; documents the JSON, is never built while answering."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from association.checking import FindingCode

from .replies import Index, MapReference, PoseAnswer, TimingAnswer
from .strict import Answer


class FindingAnswer(Answer):
    """Something doubtful."""

    code: FindingCode = Field(description="stable; further ones may come")
    message: str = Field(description="what is doubtful and what to do, for people")
    segments: list[Index] = Field(description="indices of the map's segments, the first 1,000")
    count: Index = Field(description="of all of them")


class SizeAnswer(Answer):
    """How much of a map there is."""

    segment_count: Index = Field(description="how many segments it has, as sent")
    walls: Index = Field(description="what they come to where collinear ones are one")
    length: float = Field(description="of the walls together, metres")
    diagonal: float = Field(description="of the box around them, metres")


class AdviceAnswer(Answer):
    """What the map's properties should be; null where nothing speaks for a value."""

    sigma: float | None = Field(description="metres")
    oriented: bool | None


class PlaceAnswer(Answer):
    """A pose from which the map shows what it shows from another, too."""

    pose: PoseAnswer
    similar_pose: PoseAnswer = Field(description="from where it shows about the same")


class SampleAnswer(Answer):
    """What came of one scan in the map as it is."""

    index: Index
    status: Literal["ok", "ambiguous", "degenerate", "no_match"] | None = Field(description="null: no time was left")
    usable: bool
    pose: PoseAnswer | None


class SamplesAnswer(Answer):
    """What came of the sample scans."""

    usable: Index = Field(description="of them, in the map as it is")
    usable_as_advised: Index = Field(description="with the map's properties as advised")
    wall_thickness: float | None = Field(
        description="metres by which walls are thicker than drawn; null: nothing says so"
    )
    scans: list[SampleAnswer]


class MapCheckAnswer(Answer):
    """What is doubtful in a map by itself."""

    findings: list[FindingAnswer] = Field(description="the weightiest first")
    size: SizeAnswer
    advice: AdviceAnswer
    places: list[PlaceAnswer] = Field(description="poses from which the map shows about the same as from another")
    viewpoints: Index = Field(description="number of poses that were compared")
    complete: bool = Field(description="false where the deadline left something out")


class CheckAnswer(MapCheckAnswer):
    """What is doubtful in a map, also beside sample scans."""

    samples: SamplesAnswer | None = Field(description="null where no scans were sent")
    map: MapReference
    client_ref: Any = Field(description="as sent")
    request_id: str
    timing_ms: TimingAnswer
