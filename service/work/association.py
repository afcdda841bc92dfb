"""Associations: where in a map a scan was taken."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import orjson

from association import CancelledError, Deadline, associate
from linefix.answers import Json, association_json

from ..admission.errors import DeadlinePassedError
from ..maps import CachedMap
from ..maps.lookup import FoundMap, MapLookup
from ..schemas.encoding import encode
from ..schemas.parts import InlineMap, SearchOptions
from ..schemas.requests import AssociateRequest, BatchItem, BatchRequest
from ..telemetry.metrics import Metrics
from ..telemetry.traces import stage
from .inputs import association_options_of, included_of, prior_of, scanned_of
from .job import Done, Job


@dataclass(frozen=True, slots=True)
class Target:
    """A map that is ready to be searched.

    Attributes
    ----------
    cached : CachedMap
    reference : dict, or None
        Id and revision of a stored map, as they are answered.
    """

    cached: CachedMap
    reference: Json | None


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
    lookup : MapLookup
    metrics : Metrics
        Counts verdicts, and the work of the searches.
    """

    lookup: MapLookup
    metrics: Metrics

    def answer(
        self, asked: AssociateRequest, on: InlineMap | FoundMap, job: Job, ready: CachedMap | None = None
    ) -> Done:
        """Find one scan in one map, which may be ready already; raises what `target` and `find` raise."""
        target = self.target(on, asked.options, job.deadline, ready)
        job.watch.lap("decode")
        job.searching.set()
        found = self.find(target, asked, asked.options, job.deadline)
        job.watch.lap("search")
        answer = {**found, "map": target.reference, "client_ref": asked.client_ref}
        return job.done(answer, map=target.reference, verdict=found["status"], usable=found["usable"])

    def target(
        self, on: InlineMap | FoundMap, options: SearchOptions, deadline: Deadline, ready: CachedMap | None = None
    ) -> Target:
        """Return a map, indexed unless it is ready; one that is begun is finished, whenever the deadline passes.

        Raises
        ------
        StoreError
            When it is stored, and cannot be had, or another indexes it and is not done in time.
        ParserEndedError
            When it is large and could not be read.
        InputError
            When it cannot be searched.
        """
        with stage("index"):
            cached = ready or self.lookup.indexed(on, oriented=options.oriented, deadline=deadline)
        return Target(cached, reference_to(on))

    def find(
        self, target: Target, sought: AssociateRequest | BatchItem, options: SearchOptions, deadline: Deadline
    ) -> Json:
        """Find a scan in a map.

        Raises
        ------
        InputError, InvalidRequestError
            When the libraries reject the scan.
        DeadlinePassedError
            When the deadline has passed before the search starts.
        CancelledError
            When the client has gone.
        """
        scanned = scanned_of(sought.scan)
        if deadline.cancelled:
            raise CancelledError
        if deadline.passed:
            raise DeadlinePassedError
        prior, how = prior_of(sought.prior), association_options_of(options, oriented=target.cached.oriented)
        begun = time.perf_counter()
        with stage("search"):
            result = associate(target.cached.index, scanned.scan, prior, how, deadline)
        seconds = time.perf_counter() - begun
        self.metrics.observe_association(str(result.status), result.usable, seconds, result.search.hypotheses)
        return association_json(result, included_of(sought.scan, options, scanned, target.cached.frame_id))

    def find_for_batch(
        self, target: Target, index: int, sought: BatchItem | Exception, options: SearchOptions, deadline: Deadline
    ) -> BatchResult:
        """Find one scan of a batch; raises also the errors of the scan itself.

        An error of one scan is found here, where it spoils nothing else.
        """
        if isinstance(sought, Exception):
            raise sought
        found = self.find(target, sought, options, deadline)
        return BatchResult(found["status"], encode({"index": index, "status_code": 200, "result": found}))


def batch_done(asked: BatchRequest, target: Target, results: Sequence[BatchResult], job: Job) -> Done:
    """Return the answer of a batch, given its items."""
    noted = dict(Counter(result.verdict for result in results))
    items = [orjson.Fragment(result.body) for result in results]
    answer = {"results": items, "map": target.reference, "client_ref": asked.client_ref}
    return job.done(answer, map=target.reference, verdicts=noted)


def reference_to(on: InlineMap | FoundMap) -> Json | None:
    """Return id and revision of a stored map."""
    return {"map_id": on.record.map_id, "revision": on.record.revision} if isinstance(on, FoundMap) else None
