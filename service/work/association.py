"""Associations: where in a map a scan was taken."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import orjson

from association import (
    AssociationResult,
    CancelledError,
    Deadline,
    IndexingEndedError,
    InvalidSearchError,
    KnownOfMaps,
    Scan,
)
from linefix.answers import Json, association_json
from linefix.documents.encoding import encode
from linefix.documents.parts import HardPriorFields, InlineMap, SearchOptions, SoftPriorFields
from linefix.documents.requests import AssociateRequest, BatchItem, BatchRequest
from linefix.driving import associate, associate_on_maps

from ..admission.errors import DeadlinePassedError
from ..maps import CachedMap, CachedMaps, FoundMaps
from ..maps.lookup import FoundMap, MapLookup
from ..telemetry.metrics import Metrics
from ..telemetry.traces import stage
from .inputs import association_options_of, included_of, prior_of, scanned_of
from .job import Done, Job


@dataclass(frozen=True, slots=True)
class Target:
    """A map, or several, ready to be searched.

    Attributes
    ----------
    cached : CachedMap or CachedMaps
    reference : dict, or None
        Id and revision of a stored map, as they are answered; None of several.
    maps : FoundMaps, or None
        Several maps.
    map_weights : mapping, or None
        Of several maps, as sent.
    """

    cached: CachedMap | CachedMaps
    reference: Json | None
    maps: FoundMaps | None = None
    map_weights: Mapping[str, float] | None = None


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
        reference = found.get("map", target.reference)
        answer = {**found, "map": reference, "client_ref": asked.client_ref}
        return job.done(answer, map=reference, verdict=found["status"], usable=found["usable"])

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
                return Target(together, None, source, asked.map_weights)
            cached = ready or self.lookup.indexed(source, oriented=oriented, deadline=deadline)
        return Target(cached, reference_to(source))

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
            result = _search(target, scanned.scan, sought.prior, options, deadline)
        seconds = time.perf_counter() - begun
        self.metrics.observe_association(str(result.status), result.usable, seconds, result.search.hypotheses)
        cached, maps = target.cached, target.maps
        frame_id = cached.frame_of(result.map_id) if isinstance(cached, CachedMaps) else cached.frame_id
        answer = association_json(result, included_of(sought.scan, options, scanned, frame_id))
        if maps is None:
            return answer
        verdicts = [{**one, **maps.reference_to(one["map_id"])} for one in answer["maps"]]
        reference = None if result.map_id is None else maps.reference_to(result.map_id)
        return {**answer, "maps": verdicts, "map": reference}

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


def _search(
    target: Target, scan: Scan, sent: SoftPriorFields | HardPriorFields | None, options: SearchOptions, until: Deadline
) -> AssociationResult:
    """Search a map, or several."""
    cached, prior, prior_map = target.cached, prior_of(sent), None if sent is None else sent.map_id
    search = association_options_of(options, oriented=cached.oriented)
    if not isinstance(cached, CachedMaps):
        if prior_map is not None:
            raise InvalidSearchError(
                "found `map_id` in the prior of a single map, expected it with `maps`; omit it", argument="prior.map_id"
            )
        return associate(cached.index, scan, prior, search, until)
    try:
        return associate_on_maps(cached.maps, scan, KnownOfMaps(prior, prior_map, target.map_weights), search, until)
    except IndexingEndedError:
        raise DeadlinePassedError from None


def batch_done(asked: BatchRequest, target: Target, results: Sequence[BatchResult], job: Job) -> Done:
    """Return the answer of a batch, given its items."""
    noted = dict(Counter(result.verdict for result in results))
    items = [orjson.Fragment(result.body) for result in results]
    answer = {"results": items, "map": target.reference, "client_ref": asked.client_ref}
    return job.done(answer, map=target.reference, verdicts=noted)


def reference_to(source: InlineMap | FoundMap) -> Json | None:
    """Return id and revision of a stored map."""
    return (
        {"map_id": source.record.map_id, "revision": source.record.revision} if isinstance(source, FoundMap) else None
    )
