"""The answer of a check of a map; documents the JSON, is never built while answering."""

from __future__ import annotations

from map_quality import FindingCode

from .replies import MapReference, PoseAnswer, ReferencedAnswer
from .strict import Answer, Index, Verdict


class FindingAnswer(Answer):
    """A finding of a check.

    Attributes
    ----------
    code
        stable; later versions may add codes
    message
        doubtful part and remedy, for people
    segments
        indices of the map's segments, the first 1,000
    count
        number of all such segments
    """

    code: FindingCode
    message: str
    segments: list[Index]
    count: Index


class SizeAnswer(Answer):
    """Size of a map.

    Attributes
    ----------
    segment_count
        number of segments, as sent
    walls
        number of walls, with collinear segments joined
    length
        total length of the walls, metres
    diagonal
        diagonal of the box around the walls, metres
    """

    segment_count: Index
    walls: Index
    length: float
    diagonal: float


class AdviceAnswer(Answer):
    """Recommended properties of the map; null: no recommendation.

    Attributes
    ----------
    sigma
        metres
    """

    sigma: float | None
    oriented: bool | None


class PlaceAnswer(Answer):
    """A pose at which a scan looks as at another one.

    Attributes
    ----------
    similar_pose
        the other pose
    """

    pose: PoseAnswer
    similar_pose: PoseAnswer


class SampleAnswer(Answer):
    """Result of one scan in the map as it is.

    Attributes
    ----------
    status
        null: the deadline left no time for it
    """

    index: Index
    status: Verdict | None
    usable: bool
    pose: PoseAnswer | None


class SamplesAnswer(Answer):
    """Results of the sample scans.

    Attributes
    ----------
    usable
        number of usable scans in the map as it is
    usable_as_advised
        number of usable scans with the advised properties of the map
    wall_thickness
        metres by which walls are thicker than drawn; null: no estimate
    """

    usable: Index
    usable_as_advised: Index
    wall_thickness: float | None
    scans: list[SampleAnswer]


class MapCheckAnswer(Answer):
    """Check of a map without scans.

    Attributes
    ----------
    findings
        the most important first
    places
        poses at which a scan looks as at another pose
    viewpoints
        number of poses that were compared
    complete
        false if the deadline ended the check early
    """

    findings: list[FindingAnswer]
    size: SizeAnswer
    advice: AdviceAnswer
    places: list[PlaceAnswer]
    viewpoints: Index
    complete: bool


class CheckAnswer(MapCheckAnswer, ReferencedAnswer):
    """Check of a map, with or without sample scans.

    Attributes
    ----------
    samples
        null without scans
    """

    samples: SamplesAnswer | None
    map: MapReference
