"""Associations: where in a map a scan was taken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import orjson

from association import Deadline
from linefix.documents.encoding import encode, encode_list
from linefix.documents.parts import InlineMap, SearchOptions
from linefix.documents.requests import AssociateRequest, BatchItem, BatchRequest, RegisterRequest, VectorizeRequest
from linefix.documents.updates import ApplyRequest
from linefix.operations import Json, Stopwatch, Target, applied, find, registered, vectorized

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
        job.searching.set()
        found = self.find(target, asked, asked.options, job.deadline, job.watch)
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
                frames: dict[str | None, str] = {
                    None: together.frame_ids[0],
                    **dict(zip(names, together.frame_ids, strict=True)),
                }
                references: dict[str | None, Json | None] = {name: source.reference_to(name) for name in names}
                return Target(together.maps, frames, references, asked.map_weights)
            cached = ready or self.lookup.indexed(source, oriented=oriented, deadline=deadline)
        assert isinstance(cached, CachedMap)
        return Target(cached.index, {None: cached.frame_id}, {None: reference_to(source)})

    def find(
        self,
        target: Target,
        sought: AssociateRequest | BatchItem,
        options: SearchOptions,
        deadline: Deadline,
        watch: Stopwatch,
    ) -> Json:
        """Find a scan in a map; raises as `linefix.operations.find`."""
        with stage("search"):
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


def answer_apply(asked: ApplyRequest, job: Job) -> Done:
    """Return a map with the changes that are accepted; raises `InputError` where it could not be put."""
    accepted = sum(one.accepted for one in asked.changes)
    return job.done({**applied(asked, job.watch), "client_ref": asked.client_ref}, changes=accepted)


def reference_to(source: InlineMap | FoundMap) -> Json | None:
    """Return id and revision of a stored map."""
    return (
        {"map_id": source.record.map_id, "revision": source.record.revision} if isinstance(source, FoundMap) else None
    )
