"""Maps of other tools once they are read: held to what a map may be, and checked."""

from __future__ import annotations

from typing import Any

import orjson

from ..importing.bounded import ReadMap
from ..maps.lookup import MapLookup, outline_of
from ..schemas.parts import InlineMap
from .checking import check, check_json
from .job import Done, Job


def answer_import(lookup: MapLookup, line_map: InlineMap, read: ReadMap, job: Job) -> Done:
    """Return a map that could be put as it is, what was done to make it, and what is doubtful in it.

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
    found = check(lookup, line_map, None, job).found
    job.watch.lap("check")
    answer: dict[str, Any] = {"map": orjson.Fragment(read.map), "report": read.report, "check": check_json(found)}
    return job.done(answer, format=read.report["format"], findings=[one.code for one in found.findings])
