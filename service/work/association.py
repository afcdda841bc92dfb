"""Associations: where in a map a scan was taken."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import orjson

from association import CancelledError, Deadline, IndexingEndedError
from linefix.answering import Json, Target, found_json, registered, search, vectorized
from linefix.documents.encoding import encode, encode_list
from linefix.documents.inputs import scanned_of
from linefix.documents.parts import InlineMap, SearchOptions
from linefix.documents.requests import AssociateRequest, BatchItem, BatchRequest, RegisterRequest, VectorizeRequest

from ..admission.errors import DeadlinePassedError
from ..maps import CachedMap, CachedMaps
from ..maps.lookup import FoundMap, FoundMaps, MapLookup
from ..telemetry.metrics import Metrics
from ..telemetry.traces import stage
from .job import Done, Job


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
        self,
        asked: AssociateRequest,
        source: InlineMap | FoundMap | FoundMaps,
        job: Job,
        ready: CachedMap | CachedMaps | None = None,
    ) -> Done:
        """Find one scan in one map, or on several, which may be ready already; raises as `target` and `find`."""
        target = self.target(asked, source, job.deadline, ready)
        job.watch.lap("decode")
        job.searching.set()
        found = self.find(target, asked, asked.options, job.deadline)
        job.watch.lap("search")
        noted = {"map": found["map"], "verdict": found["status"], "usable": found["usable"]}
        return job.done({**found, "client_ref": asked.client_ref}, **noted)

    def target(
        self,
        asked: AssociateRequest | BatchRequest,
        source: InlineMap | FoundMap | FoundMaps,
        deadline: Deadline,
        ready: CachedMap | CachedMaps | None = None,
    ) -> Target:
        """Return a map, or several, indexed unless ready; one that is begun is finished, whenever the deadline passes.

        Raises
        ------
        StoreError
            When it is stored, and cannot be had, or another indexes it and is not done in time.
        ParserEndedError
            When it is large and could not be read.
        InputError
            When it cannot be searched.
        """
        oriented = asked.options.oriented
        with stage("index"):
            if isinstance(source, FoundMaps):
                together = ready or self.lookup.indexed_together(source, oriented=oriented, deadline=deadline)
                assert isinstance(together, CachedMaps)  # several maps are ready as several
                names = together.maps.ids
                frames: dict[str | None, str] = dict(zip(names, together.frame_ids, strict=True))
                frames[None] = together.frame_ids[0]
                references: dict[str | None, Json | None] = {name: source.reference_to(name) for name in names}
                return Target(together.maps, frames, references, asked.map_weights)
            cached = ready or self.lookup.indexed(source, oriented=oriented, deadline=deadline)
        assert isinstance(cached, CachedMap)
        return Target(cached.index, {None: cached.frame_id}, {None: reference_to(source)})

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
        begun = time.perf_counter()
        with stage("search"):
            try:
                result = search(target, scanned.scan, sought.prior, options, deadline)
            except IndexingEndedError:
                raise DeadlinePassedError from None
        seconds = time.perf_counter() - begun
        self.metrics.observe_association(str(result.status), result.usable, seconds, result.search.hypotheses)
        return found_json(target, result, sought, scanned, options)

    def find_for_batch(
        self, target: Target, index: int, sought: BatchItem | Exception, options: SearchOptions, deadline: Deadline
    ) -> BatchResult:
        """Find one scan of a batch; raises also the errors of the scan itself.

        An error of one scan is found here, where it spoils nothing else.
        """
        if isinstance(sought, Exception):
            raise sought
        found = self.find(target, sought, options, deadline)
        if None in target.references:  # the map stands in the batch
            del found["map"]
        return BatchResult(found["status"], encode({"index": index, "status_code": 200, "result": found}))


def batch_done(asked: BatchRequest, target: Target, results: Sequence[BatchResult], job: Job) -> Done:
    """Return the answer of a batch, given its items."""
    noted = dict(Counter(result.verdict for result in results))
    items = [orjson.Fragment(result.body) for result in results]
    reference = target.references.get(None)
    answer = {"results": items, "map": reference, "client_ref": asked.client_ref}
    return job.done(answer, map=reference, verdicts=noted)


def answer_registration(asked: RegisterRequest, job: Job) -> Done:
    """Find the pose from known correspondences; raises `InputError`."""
    return job.done(registered(asked, job.watch, encode_list))


def answer_vectorization(asked: VectorizeRequest, job: Job) -> Done:
    """Cut a scan into directed segments; raises `InvalidRequestError` where the library refuses it."""
    return job.done(vectorized(asked, job.watch))


def reference_to(source: InlineMap | FoundMap) -> Json | None:
    """Return id and revision of a stored map."""
    return (
        {"map_id": source.record.map_id, "revision": source.record.revision} if isinstance(source, FoundMap) else None
    )
