"""Operations: checked requests to answers as documents, for the service and for programs without it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from association import (
    AssociationOptions,
    AssociationResult,
    CancelledError,
    Deadline,
    IndexingEndedError,
    KnownOfMaps,
    MapIndex,
    MapSet,
    Scan,
)
from map_quality import apply_changes, finished, updating
from registration import InputError, Segments, register, register_estimating

from .analyzing import looks
from .checking import checking
from .documents import inputs, results
from .documents.analysis import AnalyzeRequest
from .documents.errors import DeadlinePassedError, Fault, InvalidRequestError
from .documents.parts import MapDocument, SearchOptions
from .documents.requests import AssociateRequest, BatchItem, CheckRequest, RegisterRequest, VectorizeRequest
from .documents.scans import measured_of, scanned_of, transform_of, vectorization_of
from .documents.updates import ApplyRequest, UpdateRequest
from .driving import search

T = TypeVar("T")
Json = dict[str, Any]
Search = Callable[[MapIndex | MapSet, Scan, KnownOfMaps, AssociationOptions, Deadline], AssociationResult]
Steps = Generator[None, None, Json]
"""Work on an answer; the first step reads the request, and the others look at the deadline."""


class Stopwatch:
    """Milliseconds since the request's body had arrived, in parts."""

    def __init__(self) -> None:
        self._begun = time.monotonic()
        self._last = self._begun
        self._parts: dict[str, float] = {}

    def lap(self, name: str) -> None:
        """Note the milliseconds since the last lap under a name."""
        now = time.monotonic()
        self._parts[name] = round(1e3 * (now - self._last), 3)
        self._last = now

    def timing_ms(self) -> dict[str, float]:
        """Return the parts and the total so far."""
        return {**self._parts, "total": round(1e3 * (time.monotonic() - self._begun), 3)}

    def milliseconds(self, name: str) -> float:
        """Return a part."""
        return self._parts[name]

    def deadline(self, asked_ms: float | None, most_ms: float = math.inf) -> Deadline:
        """Return when to end: so many milliseconds after the body had arrived, waiting for a slot included."""
        allowed = most_ms if asked_ms is None else min(asked_ms, most_ms)
        return Deadline() if allowed == math.inf else Deadline(at=self._begun + allowed / 1e3)


@dataclass(frozen=True, slots=True)
class Target:
    """A map, or several, ready to be searched.

    Attributes
    ----------
    maps : MapIndex or MapSet
    references : mapping
        Id and revision of each of several maps by name, of a single map by None; None if it came with the request.
    weights : mapping, or None
        Of several maps, as sent.
    """

    maps: MapIndex | MapSet
    references: Mapping[str | None, Json | None]
    weights: Mapping[str, float] | None = None


def require_time(deadline: Deadline) -> None:
    """Raise `DeadlinePassedError` when the deadline has passed, `CancelledError` when it was cancelled."""
    if deadline.cancelled:
        raise CancelledError
    if deadline.passed:
        raise DeadlinePassedError


def find(
    target: Target,
    sought: AssociateRequest | BatchItem,
    options: SearchOptions,
    deadline: Deadline,
    watch: Stopwatch,
    by: Search = search,
) -> tuple[AssociationResult, Json]:
    """Find a scan in a map, or on several, `by` a search; return also the answer.

    Raises
    ------
    InputError, InvalidRequestError
        When the libraries reject the scan, the prior or an option.
    DeadlinePassedError
        When the deadline passes before the search starts.
    CancelledError
        When the deadline was cancelled.
    """
    scanned = scanned_of(sought.scan)
    watch.lap("decode")
    require_time(deadline)
    prior_map = None if sought.prior is None else sought.prior.map_id
    known = KnownOfMaps(inputs.prior_of(sought.prior), prior_map, target.weights)
    how = inputs.association_options_of(options, oriented=target.maps.oriented)
    try:
        result = by(target.maps, scanned.scan, known, how, deadline)
    except IndexingEndedError:
        raise DeadlinePassedError from None
    watch.lap("search")
    references = {name: one for name, one in target.references.items() if name is not None and one is not None}
    segments = scanned.listed if "segments" in options.include else None
    included = results.Included(frozenset(options.include), segments, scanned.starts)
    answer = results.association_json(result, included, references)
    return result, answer if references else {**answer, "map": target.references[None]}


def registered(asked: RegisterRequest, watch: Stopwatch, listed: results.Listed = list) -> Json:
    """Return the answer of a registration; `listed` makes a list of its residuals, which are many."""
    segments, scan = Segments.from_array(asked.map.segments, argument="map.segments"), measured_of(asked.scan)
    pairs, how = inputs.pairs_of(asked, len(segments), len(scan)), inputs.registration_options_of(asked)
    watch.lap("decode")
    sigma = asked.map.sigma
    if sigma is None:
        result = register_estimating(segments, scan, pairs, how)
    else:
        result = register(segments, scan, pairs, sigma, how)
    watch.lap("search")
    return results.registration_json(result, pairs, listed)


def vectorized(asked: VectorizeRequest, watch: Stopwatch) -> Json:
    """Return the answer of a vectorization."""
    watch.lap("decode")
    found = vectorization_of(asked)
    watch.lap("search")
    return results.vectorization_json(*found)


def worked(steps: Steps, watch: Stopwatch, deadline: Deadline) -> Json:
    """Take all steps of an operation, and return its answer.

    Raises
    ------
    DeadlinePassedError
        When the deadline passes before the request is read.
    CancelledError
        When the deadline was cancelled.
    """
    next(steps)
    watch.lap("decode")
    require_time(deadline)
    answer = finished(steps)
    watch.lap("search")
    if deadline.cancelled:
        raise CancelledError
    return answer


def analysis_steps(index: MapIndex, asked: AnalyzeRequest, deadline: Deadline) -> Steps:
    """Return the steps of an analysis of a map.

    Raises
    ------
    AnalysisError, InputError
        When the requested places cannot be had, or the landmark is none.
    """
    analysis = inputs.analysis_of(index, asked)
    yield
    found = yield from looks(analysis, analysis.standing.order.tolist(), deadline)
    return results.analysis_json(analysis, found)


def check_steps(index: MapIndex, oriented: bool | None, asked: CheckRequest, deadline: Deadline) -> Steps:
    """Check a map, `oriented` as it states, and with sample scans; raises `InvalidRequestError` for one of these."""
    scans = _in_time(inputs.scans_of(asked), deadline)
    poses = [None if one is None else transform_of(one) for one in asked.poses or []]
    yield
    checked = yield from checking(index, scans, poses, deadline, oriented=oriented is not False)
    return results.checked_json(checked)


def update_steps(index: MapIndex, old: MapDocument, asked: UpdateRequest, deadline: Deadline) -> Steps:
    """Propose changes of a map; raises `InvalidRequestError` for a scan that the libraries reject."""
    scans = _in_time(inputs.visit_scans(asked), deadline)
    yield
    proposal = yield from updating(index, scans, deadline, accept=asked.accept, refuse=asked.refuse)
    return results.update_json(proposal, old)


def _in_time(scans: Iterable[T], deadline: Deadline) -> list[T]:
    """Return all scans, which are cut into segments one by one, while there is time."""
    found = []
    for one in scans:
        require_time(deadline)
        found.append(one)
    return found


def applied(asked: ApplyRequest, watch: Stopwatch) -> Json:
    """Return a map with the accepted changes.

    Raises
    ------
    InputError, InvalidRequestError
        When the map could not be put, or a change is not one of this map.
    """
    inputs.require_map(asked.map)
    old, known = asked.map, Segments.from_array(asked.map.segments, argument="map.segments")
    changes = inputs.replacements_of(asked)
    watch.lap("decode")
    try:
        new, sigma = apply_changes(known, old.sigma, list(changes.values()), inputs.sharpened_of(asked.sharpened))
    except InputError as error:
        if error.index is None:
            raise
        raise InvalidRequestError([Fault(f"/changes/{list(changes)[error.index]}", error.message)]) from error
    watch.lap("search")
    return {"map": {"segments": new.endpoints.tolist(), "sigma": sigma, **results.kept_fields(old)}}
