"""Maps of other tools after reading: checked against the rules of a map, and by the map check."""

from __future__ import annotations

import orjson

from association import CancelledError, Deadline, IndexingEndedError, MapIndex
from linefix.documents.parts import InlineMap, is_oriented
from linefix.documents.results import check_json
from map_quality import check_map

from ..errors import DeadlinePassedError
from ..importing.bounded import ReadFiles
from ..maps.lookup import MapLookup, outline_of
from .job import Done, Job


def index_import(lookup: MapLookup, line_map: InlineMap, deadline: Deadline) -> MapIndex:
    """Index an imported map, with the deadline; the index is not cached, since no search uses it.

    Raises
    ------
    InvalidSegmentsError, InvalidMapError
        When it could not be put.
    DeadlinePassedError
        When the deadline has passed.
    CancelledError
        When the client has gone.
    """
    outline_of(line_map)
    try:
        return lookup.index_once(line_map, deadline)
    except IndexingEndedError:
        raise CancelledError if deadline.cancelled else DeadlinePassedError from None


def answer_import(index: MapIndex, line_map: InlineMap, read: ReadFiles, job: Job) -> Done:
    """Return a map that could be put as it is, the report of its import, and its doubtful parts.

    Raises
    ------
    CancelledError
        When the client has gone.
    """
    found = check_map(index, job.deadline, oriented=is_oriented(None, line_map.oriented))
    job.watch.lap("check")
    report = read.head["report"]
    answer = {
        "map": orjson.Fragment(read.content),
        "report": report,
        "picture": read.head["picture"],
        "check": check_json(found),
    }
    return job.done(answer, format=report["format"], findings=[one.code for one in found.findings])


def answer_scans(read: ReadFiles, job: Job) -> Done:
    """Return scans that may be sent as they are, and the report of reading them."""
    job.watch.lap("read")
    scans, report = orjson.Fragment(read.content.removeprefix(b'{"scans":').removesuffix(b"}\n")), read.head["report"]
    return job.done({"scans": scans, "count": int(read.head["count"]), "report": report}, format=report["format"])
