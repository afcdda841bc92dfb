"""Request and answer of an import; documents both, is never built while answering."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from .checks import MapCheckAnswer
from .replies import Index, Milliseconds, PoseAnswer, Row2, Row4
from .strict import Answer


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


class ImportedMapAnswer(Answer):
    """A map, as it may be stored or sent with a request."""

    segments: list[Row4] = Field(description="metres; free space on the left where `oriented`")
    sigma: float | None
    oriented: bool
    frame_id: str
    points: list[Row2] = Field([], description="`[x, y]` each, metres; absent if the map has none")
    points_sigma: float | None = Field(None, description="metres; absent if the map has no points")
    meta: Any


class GridPictureAnswer(Answer):
    """The grid that a map comes from, as a picture."""

    png: str = Field(
        description="PNG in base64: occupied cells are black, free ones white; at most 2048 pixels each way"
    )
    pose: PoseAnswer = Field(description="of the lower left corner, in the frame of the map")
    resolution: float = Field(description="edge of a pixel, metres")


class ImportTimingAnswer(Answer):
    """Duration of an import, milliseconds."""

    read: Milliseconds = Field(description="reading the files, waiting for that included")
    check: Milliseconds = Field(description="indexing and checking the map")
    total: Milliseconds = Field(description="from the arrival of the body until the answer is written")


class ImportAnswer(Answer):
    """A map of another tool."""

    map: ImportedMapAnswer
    report: ReportAnswer
    picture: GridPictureAnswer | None = Field(description="of a grid; null for a drawing")
    check: MapCheckAnswer
    request_id: str
    timing_ms: ImportTimingAnswer


class ScansTimingAnswer(Answer):
    """Duration of reading a log, milliseconds."""

    read: Milliseconds = Field(description="reading the files, waiting for that included")
    total: Milliseconds = Field(description="from the arrival of the body until the answer is written")


class ScansAnswer(Answer):
    """Scans of a log."""

    scans: list[Any] = Field(description="each as the `scan` of a request, in the frame of the robot where it is known")
    count: Index = Field(description="scans in the log that can be used")
    report: ReportAnswer
    request_id: str
    timing_ms: ScansTimingAnswer


SCANS_FORM: dict[str, Any] = {
    "type": "object",
    "required": ["file"],
    "additionalProperties": False,
    "properties": {
        "file": {
            "type": "array",
            "minItems": 1,
            "items": {"type": "string", "format": "binary"},
            "description": "a log: a bag of ROS 1 or ROS 2, an mcap, or a CARMEN log; a part with a filename is a file",
        },
        "topic": {"type": "string", "description": "of the scans; left out: the one with most of them"},
        "max_scans": {
            "type": "string",
            "description": "greatest number of scans that are returned, 1 to 1000, by default 100, evenly spread",
        },
    },
}
"""The schema of the form with a log."""

FORM: dict[str, Any] = {
    "type": "object",
    "required": ["file"],
    "additionalProperties": False,
    "properties": {
        "file": {
            "type": "array",
            "minItems": 1,
            "items": {"type": "string", "format": "binary"},
            "description": "the map and the files that it names, such as a yaml and its picture; a part with a "
            "filename is a file",
        },
        "unknown": {
            "type": "string",
            "description": "of a grid: the grey value of unknown cells, 0 to 255, or none; left out: recognized",
        },
        "units": {
            "type": "string",
            "description": "of a drawing: mm, cm, dm, m, km, in, ft, yd, us-ft, or metres per unit",
        },
        "layers": {"type": "string", "description": "patterns such as *WALL*, comma separated"},
        "point": {"type": "string", "description": "a free place, `x y` in metres; may be repeated"},
        "drawn": {
            "enum": ["faces", "centres"],
            "description": "whether lines of a drawing are faces or centre lines of walls",
        },
        "thickness": {"type": "string", "description": "of walls drawn as centre lines, metres"},
        "directions": {"enum": ["drawn", "none"], "description": "whether free space lies on the left of the lines"},
        "local_metres": {"enum": ["true", "false"], "description": "whether a GeoJSON is in metres"},
        "topic": {"type": "string", "description": "of the grid in a bag"},
        "where": {
            "type": "string",
            "description": "entities of a drawing to read, as property=value, the value a pattern; may be repeated",
        },
        "level": {"type": "string", "description": "floor of a drawing that has several levels"},
        "surface": {
            "type": "string",
            "description": "of a grid: cells from the front of occupied cells to the surface of walls, 0 to 10; "
            "left out: found from the grid",
        },
    },
}
"""The schema of the form; everything in a form is text."""
