"""Results of requests that need maps of the store or files: associations, batches, imports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import orjson

from association import CancelledError, Deadline, IndexingEndedError, MapIndex
from linefix.documents.encoding import encode
from linefix.documents.errors import DeadlinePassedError
from linefix.documents.parts import InlineMap, SearchOptions, is_oriented
from linefix.documents.requests import AssociateRequest, BatchItem, BatchRequest
from linefix.documents.results import check_json
from linefix.operations import Json, Stopwatch, Target, find
from map_quality import check_map

from ..importing.bounded import ReadFiles
from ..maps.lookup import MapLookup, outline_of
from ..telemetry.metrics import Metrics
from .job import Job


@dataclass(frozen=True, slots=True)
class BatchResult:
    """The result of one scan of a batch.

    Attributes
    ----------
    verdict : str
        Status of the answer, or the number that stands for its problem.
    body : bytes
        The item as JSON, in which it takes a fifth of the room.
    """

    verdict: str
    body: bytes


@dataclass(frozen=True, slots=True)
class Associator:
    """Finds scans in maps.

    Attributes
    ----------
    metrics : Metrics
        Counts verdicts, and the work of the searches.
    """

    metrics: Metrics

    def answer(self, asked: AssociateRequest, target: Target, job: Job) -> bytes:
        """Find one scan in one map, or on several; raises as `find`."""
        found = self.find(target, asked, asked.options, job.deadline, job.watch)
        noted = {"map": found["map"], "verdict": found["status"], "usable": found["usable"]}
        return job.encoded({**found, "client_ref": asked.client_ref}, **noted)

    def find(
        self,
        target: Target,
        sought: AssociateRequest | BatchItem,
        options: SearchOptions,
        deadline: Deadline,
        watch: Stopwatch,
    ) -> Json:
        """Find a scan in a map; raises as `linefix.operations.find`."""
        result, answer = find(target, sought, options, deadline, watch)
        seconds = 1e-3 * watch.milliseconds("search")
        self.metrics.observe_association(str(result.status), result.usable, seconds, result.search.hypotheses)
        return answer

    def find_for_batch(
        self, target: Target, index: int, sought: BatchItem | Exception, options: SearchOptions, deadline: Deadline
    ) -> BatchResult:
        """Find one scan of a batch; raises also the errors of the scan itself.

        An error of one scan is found here, where it spoils nothing else.
        """
        if isinstance(sought, Exception):
            raise sought
        found = self.find(target, sought, options, deadline, Stopwatch())
        if None in target.references:  # the map stands in the batch
            del found["map"]
        return BatchResult(found["status"], encode({"index": index, "status_code": 200, "result": found}))


def batch_done(asked: BatchRequest, target: Target, results: Sequence[BatchResult], job: Job) -> bytes:
    """Return the answer of a batch, given its items."""
    noted = dict(Counter(result.verdict for result in results))
    items = [orjson.Fragment(result.body) for result in results]
    reference = target.references.get(None)
    answer = {"results": items, "map": reference, "client_ref": asked.client_ref}
    return job.encoded(answer, map=reference, verdicts=noted)


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


def answer_import(index: MapIndex, line_map: InlineMap, read: ReadFiles, job: Job) -> bytes:
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
    return job.encoded(answer, format=report["format"], findings=[one.code for one in found.findings])


def answer_scans(read: ReadFiles, job: Job) -> bytes:
    """Return scans that may be sent as they are, and the report of reading them."""
    job.watch.lap("read")
    scans, report = orjson.Fragment(read.content.removeprefix(b'{"scans":').removesuffix(b"}\n")), read.head["report"]
    return job.encoded({"scans": scans, "count": int(read.head["count"]), "report": report}, format=report["format"])
