"""Requests as documents to answers as documents: what the service answers over HTTP, for programs without it."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import BaseModel

from association import (
    AssociationResult,
    Deadline,
    IndexingEndedError,
    InvalidSearchError,
    KnownOfMaps,
    MapIndex,
    MapSet,
    Scan,
    map_set,
)
from map_quality import apply_changes, check_map
from map_quality import update as propose
from registration import (
    InputError,
    Segments,
    register_estimating,
)
from registration import register as register_pairs

from . import checking, explaining
from .analyzing import Progress, look_on_all_cores
from .documents import inputs, results
from .documents.analysis import MapAnalyzeRequest
from .documents.errors import Fault, InvalidRequestError
from .documents.limits import Limits
from .documents.parts import (
    HardPriorFields,
    InlineMap,
    MapDocument,
    SearchOptions,
    SoftPriorFields,
    StoredMap,
    is_oriented,
)
from .documents.reading import validate
from .documents.requests import (
    AssociateRequest,
    BatchItem,
    CheckRequest,
    OnMaps,
    RegisterRequest,
    VectorizeRequest,
)
from .documents.scans import Scanned, vectorization_of
from .documents.updates import ApplyRequest, UpdateRequest
from .driving import associate as associate_drive
from .driving import associate_on_maps

if TYPE_CHECKING:
    from formats import ImportedMap

Json = dict[str, Any]
M = TypeVar("M", bound=BaseModel)


class TooLateError(Exception):
    """The deadline passed before the search started."""

    def __str__(self) -> str:
        """Name the remedy."""
        return "the deadline passed before the search started; extend deadline_ms, or send the request again later"


class NotStoredError(Exception):
    """A request names a stored map where none are stored."""


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

    def deadline(self, asked_ms: float | None, most_ms: float) -> Deadline:
        """Return when to end: so many milliseconds after the body had arrived, waiting for a slot included."""
        allowed = most_ms if asked_ms is None else min(asked_ms, most_ms)
        return Deadline(at=self._begun + allowed / 1e3)


def _none_stored(map_id: str) -> tuple[MapDocument, Json]:
    raise NotStoredError(f"found the id of a stored map, {map_id}, expected a map with segments")


@dataclass(frozen=True, slots=True)
class Within:
    """Bounds of requests, and the stored maps that they may name.

    Attributes
    ----------
    limits : Limits
    deadline_ms : float
        Of a search: its default, and the longest.
    stored : callable
        From the id of a stored map to its document, and its id and revision as they are answered.
    """

    limits: Limits = field(default_factory=Limits)
    deadline_ms: float = 30_000.0
    stored: Callable[[str], tuple[MapDocument, Json]] = _none_stored


@dataclass(frozen=True, slots=True)
class Target:
    """A map, or several, ready to be searched.

    Attributes
    ----------
    maps : MapIndex or MapSet
    frames : mapping
        Frame of each of several maps by name; of the first, or of the single map, by None.
    references : mapping
        Id and revision of each, likewise; None of a map that came with the request.
    weights : mapping, or None
        Of several maps, as sent.
    """

    maps: MapIndex | MapSet
    frames: Mapping[str | None, str]
    references: Mapping[str | None, Json | None]
    weights: Mapping[str, float] | None = None

    @property
    def oriented(self) -> bool:
        """Return whether directions of segments mean anything on all of the maps."""
        if isinstance(self.maps, MapSet):
            return self.maps.oriented
        return len(self.maps.segments) == self.maps.directed


def target_of(asked: OnMaps, oriented: bool | None, within: Within) -> Target:
    """Return the map of a request, or its maps, indexed.

    Raises
    ------
    InputError
        When one cannot be searched.
    """
    if not asked.maps:
        assert asked.map is not None  # the model takes exactly one of the two
        document, reference = _document_of(asked.map, within)
        index = inputs.index_of(document, oriented=is_oriented(oriented, document.oriented))
        return Target(index, {None: document.frame_id}, {None: reference})
    if not isinstance(asked.maps, list):
        raise NotStoredError("found a prefix of stored maps, expected the maps")
    parts, frames, references = [], dict[str | None, str](), dict[str | None, Json | None]()
    for number, one in enumerate(asked.maps):
        document, reference = _document_of(one, within)
        directed = is_oriented(oriented, document.oriented)
        parts.append((one.map_id, inputs.part_of(document, oriented=directed, path=f"maps.{number}.")))
        frames.setdefault(None, document.frame_id)
        frames[one.map_id] = document.frame_id
        references[one.map_id] = reference or {"map_id": one.map_id, "revision": None}
    return Target(map_set(parts), frames, references, asked.map_weights)


def _document_of(on: InlineMap | StoredMap, within: Within) -> tuple[MapDocument, Json | None]:
    return (on, None) if isinstance(on, InlineMap) else within.stored(on.map_id)


def search(
    target: Target,
    scan: Scan,
    sent: SoftPriorFields | HardPriorFields | None,
    options: SearchOptions,
    deadline: Deadline,
) -> AssociationResult:
    """Find a scan in a map, or on several.

    Raises
    ------
    InputError
        When the search rejects the prior or an option.
    IndexingEndedError
        When the deadline passes before the search.
    """
    prior, prior_map = inputs.prior_of(sent), None if sent is None else sent.map_id
    how = inputs.association_options_of(options, oriented=target.oriented)
    if isinstance(target.maps, MapSet):
        return associate_on_maps(target.maps, scan, KnownOfMaps(prior, prior_map, target.weights), how, deadline)
    if prior_map is not None:
        raise InvalidSearchError(
            "found `map_id` in the prior of a single map, expected it with `maps`; omit it", argument="prior.map_id"
        )
    return associate_drive(target.maps, scan, prior, how, deadline)


def found_json(
    target: Target,
    result: AssociationResult,
    sought: AssociateRequest | BatchItem,
    scanned: Scanned,
    how: SearchOptions,
) -> Json:
    """Return the answer of a search."""
    references = {name: one for name, one in target.references.items() if name is not None and one is not None}
    included = inputs.included_of(sought.scan, how, scanned, target.frames[result.map_id])
    answer = results.association_json(result, included, references)
    return answer if references else {**answer, "map": target.references[None]}


def associate(document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/associate``.

    Raises
    ------
    RequestError, InputError
        When a part of the request is not taken, as of every function here.
    TooLateError
        When the deadline passes before the search starts, likewise.
    """
    watch = Stopwatch()
    asked = validate(AssociateRequest, document, within.limits)
    return locate(target_of(asked, asked.options.oriented, within), asked, asked.options, within, watch)


def locate(
    target: Target, sought: AssociateRequest | BatchItem, how: SearchOptions, within: Within, watch: Stopwatch
) -> Json:
    """Return the answer of ``POST /v1/associate`` on maps that are indexed."""
    deadline = watch.deadline(how.deadline_ms, within.deadline_ms)
    scanned = inputs.scanned_of(sought.scan)
    watch.lap("decode")
    _require_time(deadline)
    try:
        result = search(target, scanned.scan, sought.prior, how, deadline)
    except IndexingEndedError:
        raise TooLateError from None
    watch.lap("search")
    return _sealed(found_json(target, result, sought, scanned, how), watch, getattr(sought, "client_ref", None))


def explain(document: Json, within: Within) -> Json:
    """Return the answer of `associate` as ``answer``, and next to it how its verdict came about."""
    watch = Stopwatch()
    asked = validate(AssociateRequest, document, within.limits)
    how, target = asked.options, target_of(asked, asked.options.oriented, within)
    if isinstance(target.maps, MapSet):
        raise InvalidRequestError([Fault("/maps", "found several maps, expected one map")])
    deadline, scanned = watch.deadline(how.deadline_ms, within.deadline_ms), inputs.scanned_of(asked.scan)
    watch.lap("decode")
    _require_time(deadline)
    search_options = inputs.association_options_of(how, oriented=target.oriented)
    found = explaining.explain_search(target.maps, scanned.scan, inputs.prior_of(asked.prior), search_options, deadline)
    watch.lap("search")
    answer = found_json(target, found.result, asked, scanned, how)
    return {"answer": _sealed(answer, watch, asked.client_ref), **results.explanation_json(found)}


def register(document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/register``."""
    watch = Stopwatch()
    asked = validate(RegisterRequest, document, within.limits)
    return _sealed(registered(asked, watch), watch)


def registered(asked: RegisterRequest, watch: Stopwatch, listed: Callable[[Iterable[Json]], Any] = list) -> Json:
    """Return the answer of a registration; `listed` makes a list of its residuals, which are many."""
    segments, scan = Segments.from_array(asked.map.segments, argument="map.segments"), inputs.measured_of(asked.scan)
    pairs, how = inputs.pairs_of(asked, len(segments), len(scan)), inputs.registration_options_of(asked)
    watch.lap("decode")
    sigma = asked.map.sigma
    if sigma is None:
        result = register_estimating(segments, scan, pairs, how)
    else:
        result = register_pairs(segments, scan, pairs, sigma, how)
    watch.lap("search")
    return results.registration_json(result, pairs, listed)


def vectorize(document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/vectorize``."""
    watch = Stopwatch()
    asked = validate(VectorizeRequest, document, within.limits)
    return _sealed(vectorized(asked, watch), watch)


def vectorized(asked: VectorizeRequest, watch: Stopwatch) -> Json:
    """Return the answer of a vectorization."""
    watch.lap("decode")
    found = vectorization_of(asked)
    watch.lap("search")
    return results.vectorization_json(*found)


def analyze(document: Json, within: Within, cores: int = 1, progress: Progress = lambda done, total: None) -> Json:
    """Return the answer of ``POST /v1/analyze``; it takes as long as it takes where no deadline is given."""
    watch = Stopwatch()
    asked = validate(MapAnalyzeRequest, document, within.limits)
    drawn, reference = _document_of(asked.map, within)
    index = inputs.index_of(drawn, oriented=is_oriented(None, drawn.oriented))
    analysis = inputs.analysis_of(index, asked)
    deadline = Deadline() if asked.deadline_ms is None else watch.deadline(asked.deadline_ms, asked.deadline_ms)
    watch.lap("decode")
    looks = look_on_all_cores(analysis, cores, deadline, progress)
    watch.lap("search")
    return _sealed({**results.analysis_json(analysis, looks), "map": reference}, watch, asked.client_ref)


def check(on: Json, document: Json | None, within: Within) -> Json:
    """Return the answer of ``/v1/maps/{map_id}:check`` for the map of a request; a document has sample scans."""
    watch = Stopwatch()
    asked = None if document is None else validate(CheckRequest, document, within.limits)
    drawn, reference = _map_at(on, within)
    index, scans = inputs.index_of(drawn, oriented=True), [] if asked is None else inputs.scans_of(asked)
    poses = None
    if asked is not None and asked.poses is not None:
        poses = [None if one is None else inputs.transform_of(one) for one in asked.poses]
    deadline = watch.deadline(None if asked is None else asked.deadline_ms, within.deadline_ms)
    watch.lap("decode")
    _require_time(deadline)
    checked = checking.check(index, scans, poses, deadline, oriented=is_oriented(None, drawn.oriented))
    watch.lap("search")
    answer = {**results.checked_json(checked), "map": reference}
    return _sealed(answer, watch, None if asked is None else asked.client_ref)


def update(on: Json, document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/maps/{map_id}:update`` for the map of a request."""
    watch = Stopwatch()
    asked = validate(UpdateRequest, document, within.limits)
    old, reference = _map_at(on, within)
    index, scans = inputs.index_of(old, oriented=is_oriented(None, old.oriented)), inputs.visit_scans(asked)
    deadline = None if asked.deadline_ms is None else watch.deadline(asked.deadline_ms, asked.deadline_ms)
    watch.lap("decode")
    proposal = propose(index, scans, deadline, accept=asked.accept, refuse=asked.refuse)
    watch.lap("search")
    return _sealed({**results.update_json(proposal, old), "based_on": reference}, watch, asked.client_ref)


def apply(document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/maps:apply``."""
    watch = Stopwatch()
    asked = validate(ApplyRequest, document, within.limits)
    return _sealed(applied(asked, watch), watch, asked.client_ref)


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


def check_import(imported: ImportedMap, watch: Stopwatch, within: Within) -> Json:
    """Return the answer of ``POST /v1/maps:import`` for a map that was read."""
    deadline = watch.deadline(None, within.deadline_ms)
    watch.lap("read")
    document = validate(InlineMap, results.map_json(imported.map), within.limits)
    inputs.require_map(document)
    index = inputs.index_of(document, oriented=True)
    _require_time(deadline)
    found = check_map(index, deadline, oriented=imported.map.oriented)
    watch.lap("check")
    return _sealed(results.import_json(imported, found), watch)


def _map_at(on: Json, within: Within) -> tuple[MapDocument, Json | None]:
    """Return the map of a request, and id and revision of a stored one."""
    if "map_id" in on and "segments" not in on:
        return within.stored(on["map_id"])
    return validate(InlineMap, on, within.limits), None


def _require_time(deadline: Deadline) -> None:
    if deadline.passed:
        raise TooLateError


_NO_REFERENCE = object()


def _sealed(answer: Json, watch: Stopwatch, client_ref: Any = _NO_REFERENCE) -> Json:
    """Return an answer with an id and its times."""
    given = {} if client_ref is _NO_REFERENCE else {"client_ref": client_ref}
    return {**answer, **given, "request_id": secrets.token_hex(16), "timing_ms": watch.timing_ms()}
