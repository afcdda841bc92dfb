"""The answer of a check of a map; documents the JSON, is never built while answering."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from map_quality import FindingCode

from .replies import Index, MapReference, PoseAnswer, TimingAnswer, Verdict
from .strict import Answer


class FindingAnswer(Answer):
    """A finding of a check."""

    code: FindingCode = Field(description="stable; later versions may add codes")
    message: str = Field(description="doubtful part and remedy, for people")
    segments: list[Index] = Field(description="indices of the map's segments, the first 1,000")
    count: Index = Field(description="number of all such segments")


class SizeAnswer(Answer):
    """Size of a map."""

    segment_count: Index = Field(description="number of segments, as sent")
    walls: Index = Field(description="number of walls, with collinear segments joined")
    length: float = Field(description="total length of the walls, metres")
    diagonal: float = Field(description="diagonal of the box around the walls, metres")


class AdviceAnswer(Answer):
    """Recommended properties of the map; null: no recommendation."""

    sigma: float | None = Field(description="metres")
    oriented: bool | None


class PlaceAnswer(Answer):
    """A pose at which a scan looks as at another one."""

    pose: PoseAnswer
    similar_pose: PoseAnswer = Field(description="the other pose")


class SampleAnswer(Answer):
    """Result of one scan in the map as it is."""

    index: Index
    status: Verdict | None = Field(description="null: the deadline left no time for it")
    usable: bool
    pose: PoseAnswer | None


class SamplesAnswer(Answer):
    """Results of the sample scans."""

    usable: Index = Field(description="number of usable scans in the map as it is")
    usable_as_advised: Index = Field(description="number of usable scans with the advised properties of the map")
    wall_thickness: float | None = Field(description="metres by which walls are thicker than drawn; null: no estimate")
    scans: list[SampleAnswer]


class MapCheckAnswer(Answer):
    """Check of a map without scans."""

    findings: list[FindingAnswer] = Field(description="the most important first")
    size: SizeAnswer
    advice: AdviceAnswer
    places: list[PlaceAnswer] = Field(description="poses at which a scan looks as at another pose")
    viewpoints: Index = Field(description="number of poses that were compared")
    complete: bool = Field(description="false if the deadline ended the check early")


class CheckAnswer(MapCheckAnswer):
    """Check of a map, with or without sample scans."""

    samples: SamplesAnswer | None = Field(description="null without scans")
    map: MapReference
    client_ref: Any = Field(description="returned as it was sent")
    request_id: str
    timing_ms: TimingAnswer
