"""Answers that only HTTP has, for OpenAPI: problems, batches, stored maps, imports, operations; never built."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from linefix.documents.checks import MapCheckAnswer
from linefix.documents.found import FoundAnswer
from linefix.documents.replies import MapReference, PoseAnswer, ReferencedAnswer
from linefix.documents.strict import Answer, Index, Milliseconds, Row4
from linefix.documents.updates import NewMapAnswer

from ..settings import Settings
from .problems import KINDS


class Place(Answer):
    """One fault of a request."""

    pointer: str = Field(description="JSON pointer")
    message: str


class Problem(Answer):
    """An error, RFC 9457.

    Attributes
    ----------
    detail
        the fault; with `errors` the pointer and message of the first
    code
        stable, for programs; later versions may add codes
    """

    type: str
    title: str
    status: Annotated[int, Field(ge=400, le=599)]
    detail: str
    code: Annotated[str, Field(json_schema_extra={"enum": list(KINDS)})]
    request_id: str
    errors: Annotated[list[Place], Field(max_length=20)] = Field([])


class BatchResult(Answer):
    """One scan's answer, or its problem."""

    index: Index
    status_code: int
    result: FoundAnswer | None = Field(None, description="answer of /v1/associate, if `status_code` is 200")
    problem: Problem | None = Field(None, description="otherwise")


class BatchAnswer(ReferencedAnswer):
    """The answers in the order of the scans."""

    results: list[BatchResult]
    map: MapReference | None


class MapSummaryAnswer(Answer):
    """A stored map without its content."""

    map_id: str
    revision: Annotated[int, Field(ge=1)]
    segment_count: Index = Field(description="number of segments")
    bounds: Row4 = Field(description="min_x, min_y, max_x, max_y; metres")
    sigma: float | None = Field(description="standard deviation of the lines, metres; null: not stated")
    oriented: bool | None = Field(description="whether free space lies on the left of its segments; null: not stated")


class MapList(Answer):
    """One page of maps, by id.

    Attributes
    ----------
    corrupt
        ids of damaged maps on this page; each is rejected until it is stored again with PUT
    next
        `cursor` of the next page
    """

    maps: list[MapSummaryAnswer]
    corrupt: list[str]
    next: str | None


class Live(Answer):
    """A probe's answer."""

    status: Literal["ok"]


class Version(Answer):
    """Name and version of the service."""

    name: str
    version: str
    api: str


class _FixedLimits(Answer):
    """Limits of requests; a request beyond one is rejected."""

    max_views: int = Field(description="views of one scan")
    max_beams_together: int = Field(description="ranges or points of all views of one scan")
    max_segments_together: int = Field(description="segments of all views of one scan")
    max_magnitude: float = Field(description="magnitude of any number")
    min_segment_length: float = Field(description="metres")
    max_segment_length: float = Field(description="metres")
    max_map_extent: float = Field(description="metres")


_OTHERS = ("request_timeout_s", "searches", "queue")
_NOT_OF_REQUESTS = ("max_stored_bytes", "max_import_bytes")
LIMITS: dict[str, Any] = {
    name: (field.annotation, Field(description=field.description))
    for name, field in Settings.model_fields.items()
    if name in _OTHERS or (name.startswith("max_") and name not in _NOT_OF_REQUESTS)
}
"""The settings that are limits of requests."""
Limits = create_model("Limits", __base__=_FixedLimits, __doc__=_FixedLimits.__doc__, **LIMITS)


class NoteAnswer(Answer):
    """One thing that an import did."""

    code: str = Field(description="stable; part of it may name an entity of the file, as in `entity_hatch`")
    message: str
    count: Index = Field(description="cells, entities, segments that it is about; 0 where nothing is counted")


class ReportAnswer(Answer):
    """Report of an import."""

    format: str = Field(description="such as map_server, dxf, rosbag2")
    files: list[str]
    read: list[NoteAnswer]
    merged: list[NoteAnswer] = Field(description="parts that were merged")
    dropped: list[NoteAnswer] = Field(description="parts that were omitted, and why")
    assumed: list[NoteAnswer] = Field(description="assumptions, where the files state nothing")


class ImportedMapAnswer(NewMapAnswer):
    """A map, as it may be stored or sent with a request.

    Attributes
    ----------
    segments
        metres; free space on the left where `oriented`
    """

    oriented: bool


class GridPictureAnswer(Answer):
    """The grid that a map comes from, as a picture.

    Attributes
    ----------
    png
        PNG in base64: occupied cells are black, free ones white; at most 2048 pixels each way
    pose
        of the lower left corner, in the frame of the map
    resolution
        edge of a pixel, metres
    """

    png: str
    pose: PoseAnswer
    resolution: float


class ScansTimingAnswer(Answer):
    """Duration of reading a log, milliseconds."""

    read: Milliseconds = Field(description="reading the files, waiting for that included")
    total: Milliseconds = Field(description="from the arrival of the body until the answer is written")


class ImportTimingAnswer(ScansTimingAnswer):
    """Duration of an import, milliseconds."""

    check: Milliseconds = Field(description="indexing and checking the map")


class ImportAnswer(Answer):
    """A map of another tool."""

    map: ImportedMapAnswer
    report: ReportAnswer
    picture: GridPictureAnswer | None = Field(description="of a grid; null for a drawing")
    check: MapCheckAnswer
    request_id: str
    timing_ms: ImportTimingAnswer


class ScansAnswer(Answer):
    """Scans of a log."""

    scans: list[Any] = Field(description="each as the `scan` of a request, in the frame of the robot where it is known")
    count: Index = Field(description="scans in the log that can be used")
    report: ReportAnswer
    request_id: str
    timing_ms: ScansTimingAnswer
