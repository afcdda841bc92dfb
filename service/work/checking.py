"""Checks of maps, in steps of one slot of the gate: the map alone, each sample scan, the conclusion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from association import Scan
from linefix.checking import CheckedMap, concluded, try_in_time
from linefix.documents.inputs import scans_of, transform_of
from linefix.documents.parts import InlineMap, is_oriented
from linefix.documents.requests import CheckRequest
from linefix.documents.results import checked_json
from map_quality import MapCheck, Sample, check_map

from ..maps import CachedMap
from ..maps.lookup import FoundMap, MapLookup
from .association import reference_to
from .job import Done, Job


@dataclass(frozen=True, slots=True)
class Begun:
    """A map whose own check is done, ready for samples.

    Attributes
    ----------
    source : FoundMap or InlineMap
    cached : CachedMap
        With its directions, whatever they mean.
    oriented : bool
        True when the map states that they mean something.
    scans : sequence of Scan
        The samples.
    found : MapCheck
    """

    source: InlineMap | FoundMap
    cached: CachedMap
    oriented: bool
    scans: Sequence[Scan]
    found: MapCheck


def check(lookup: MapLookup, source: InlineMap | FoundMap, asked: CheckRequest | None, job: Job) -> Begun:
    """Index a map and check it; read the samples, where there are some.

    Raises
    ------
    StoreError
        When the map cannot be had.
    ParserEndedError
        When it is large and could not be read.
    InvalidRequestError
        When the libraries reject one of the samples.
    DeadlinePassedError
        When the deadline has passed before.
    CancelledError
        When the client has gone.
    """
    cached = lookup.indexed(source, oriented=True, deadline=job.deadline)
    scans = [] if asked is None else scans_of(asked)
    job.begin_search()
    oriented = is_oriented(None, source.record.oriented if isinstance(source, FoundMap) else source.oriented)
    # Of its own: an index without directions, which a check may add to it, goes with the check, for the cache does not
    # count it.
    cached = replace(cached, index=replace(cached.index))
    return Begun(source, cached, oriented, scans, check_map(cached.index, job.deadline, oriented=oriented))


def sample(begun: Begun, asked: CheckRequest, number: int, job: Job) -> Sample | None:
    """Try one of the samples in a map; None when there is no time left. Raises `CancelledError`."""
    pose = None if asked.poses is None else asked.poses[number]
    said = None if pose is None else transform_of(pose)
    return try_in_time(begun.cached.index, begun.scans[number], job.deadline, oriented=begun.oriented, said=said)


def conclude(begun: Begun, samples: Sequence[Sample | None], job: Job) -> CheckedMap:
    """Conclude from all samples together; raises `CancelledError`."""
    return concluded(begun.cached.index, begun.scans, begun.found, samples, job.deadline, oriented=begun.oriented)


def check_done(begun: Begun, checked: CheckedMap, asked: CheckRequest | None, job: Job) -> Done:
    """Return the answer of a check."""
    job.watch.lap("search")
    reference = reference_to(begun.source)
    sealed = {"map": reference, "client_ref": None if asked is None else asked.client_ref}
    codes = [one.code for one in checked.all.findings]
    return job.done({**checked_json(checked), **sealed}, map=reference, findings=codes)
