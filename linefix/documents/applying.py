"""Request and answer of changes that a user accepts of an update; the answer documents the JSON."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from map_quality import ChangeCode

from .arrays import MapSegmentRows
from .parts import MapDocument, MapSigma
from .replies import ReferencedAnswer
from .strict import Coordinate, FreeJson, Referenced, Strict
from .updates import NewMapAnswer

MOST_NEW = 10_000  # segments of one change
_SegmentIndex = Annotated[int, Field(ge=0, le=10_000_000)]


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
        as the update returned them; `accepted` of each says whether it is in the new map
    sharpened
        as the update returned it
    """

    map: MapDocument
    changes: Annotated[list[ProposedChange], Field(max_length=10_000)]
    sharpened: SharpenedWalls | None = None


class ApplyAnswer(ReferencedAnswer):
    """A map with the accepted changes; nothing is stored.

    Attributes
    ----------
    map
        the new map, with the accepted changes
    """

    map: NewMapAnswer
