"""Requests as documents to answers as documents: what the service answers over HTTP, for programs without it."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from association import AssociationOptions, AssociationResult, Deadline, KnownOfMaps, MapIndex, MapSet, Scan
from map_quality import check_map, finished

from . import operations
from .analyzing import Progress, look_on_all_cores
from .documents import inputs, results
from .documents.analysis import MapAnalyzeRequest
from .documents.errors import Fault, InvalidRequestError
from .documents.limits import Limits
from .documents.parts import InlineMap, MapDocument, SearchOptions, StoredMap, is_oriented
from .documents.reading import validate
from .documents.requests import AssociateRequest, BatchItem, CheckRequest, OnMaps, RegisterRequest, VectorizeRequest
from .documents.updates import UpdateRequest
from .driving import search
from .explaining import Explanation, explain_search
from .operations import Json, Search, Steps, Stopwatch, Target, require_time

if TYPE_CHECKING:
    from formats import ImportedMap


class NotStoredError(Exception):
    """A request names a stored map where none are stored."""


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
    return Target(MapSet(parts), frames, references, asked.map_weights)


def _document_of(on: InlineMap | StoredMap, within: Within) -> tuple[MapDocument, Json | None]:
    return (on, None) if isinstance(on, InlineMap) else within.stored(on.map_id)


def associate(document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/associate``.

    Raises
    ------
    RequestError, InputError
        When a part of the request is not taken, as of every function here.
    DeadlinePassedError
        When the deadline passes before the search starts, likewise.
    """
    watch = Stopwatch()
    asked = validate(AssociateRequest, document, within.limits)
    return locate(target_of(asked, asked.options.oriented, within), asked, asked.options, within, watch)


def locating(on: Json, options: Json, within: Within) -> Callable[[Json], Json]:
    """Index the map, or the maps, of a request once; return the function from its ``scan`` and ``prior`` to its answer.

    The function answers as `associate` does, and raises the same.
    """
    how = validate(SearchOptions, options, within.limits)
    maps = target_of(validate(OnMaps, on, within.limits), how.oriented, within)

    def answer(sought: Json) -> Json:
        watch = Stopwatch()
        return locate(maps, validate(BatchItem, sought, within.limits), how, within, watch)

    return answer


def locate(
    target: Target,
    sought: AssociateRequest | BatchItem,
    how: SearchOptions,
    within: Within,
    watch: Stopwatch,
    by: Search = search,
) -> Json:
    """Return the answer of ``POST /v1/associate`` on maps that are indexed."""
    _, answer = operations.find(target, sought, how, watch.deadline(how.deadline_ms, within.deadline_ms), watch, by)
    return _sealed(answer, watch, getattr(sought, "client_ref", None))


def explain(document: Json, within: Within) -> Json:
    """Return the answer of `associate` as ``answer``, and next to it how its verdict came about."""
    watch, explained = Stopwatch(), list[Explanation]()
    asked = validate(AssociateRequest, document, within.limits)
    target = target_of(asked, asked.options.oriented, within)

    def by(
        maps: MapIndex | MapSet, scan: Scan, known: KnownOfMaps, options: AssociationOptions, deadline: Deadline
    ) -> AssociationResult:
        if isinstance(maps, MapSet):
            raise InvalidRequestError([Fault("/maps", "found several maps, expected one map")])
        explained.append(explain_search(maps, scan, known.prior, options, deadline))
        return explained[-1].result

    answer = locate(target, asked, asked.options, within, watch, by)
    return {"answer": answer, **results.explanation_json(explained[-1])}


def register(document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/register``."""
    watch = Stopwatch()
    asked = validate(RegisterRequest, document, within.limits)
    return _sealed(operations.registered(asked, watch), watch)


def vectorize(document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/vectorize``."""
    watch = Stopwatch()
    asked = validate(VectorizeRequest, document, within.limits)
    return _sealed(operations.vectorized(asked, watch), watch)


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
    index, oriented = inputs.index_of(drawn, oriented=True), is_oriented(None, drawn.oriented)
    deadline = watch.deadline(None if asked is None else asked.deadline_ms, within.deadline_ms)
    answer = _worked(operations.check_steps(index, asked, deadline, oriented=oriented), watch, deadline)
    return _sealed({**answer, "map": reference}, watch, None if asked is None else asked.client_ref)


def update(on: Json, document: Json, within: Within) -> Json:
    """Return the answer of ``POST /v1/maps/{map_id}:update`` for the map of a request."""
    watch = Stopwatch()
    asked = validate(UpdateRequest, document, within.limits)
    old, reference = _map_at(on, within)
    index = inputs.index_of(old, oriented=is_oriented(None, old.oriented))
    deadline = Deadline() if asked.deadline_ms is None else watch.deadline(asked.deadline_ms, asked.deadline_ms)
    answer = _worked(operations.update_steps(index, old, asked, deadline), watch, Deadline())
    return _sealed({**answer, "based_on": reference}, watch, asked.client_ref)


def _worked(steps: Steps, watch: Stopwatch, deadline: Deadline) -> Json:
    """Take all steps of an operation."""
    next(steps)
    watch.lap("decode")
    require_time(deadline)
    answer = finished(steps)
    watch.lap("search")
    return answer


def check_import(imported: ImportedMap, watch: Stopwatch, within: Within) -> Json:
    """Return the answer of ``POST /v1/maps:import`` for a map that was read."""
    deadline = watch.deadline(None, within.deadline_ms)
    watch.lap("read")
    document = validate(InlineMap, results.map_json(imported.map), within.limits)
    inputs.require_map(document)
    index = inputs.index_of(document, oriented=True)
    require_time(deadline)
    found = check_map(index, deadline, oriented=imported.map.oriented)
    watch.lap("check")
    return _sealed(results.import_json(imported, found), watch)


def _map_at(on: Json, within: Within) -> tuple[MapDocument, Json | None]:
    """Return the map of a request, and id and revision of a stored one."""
    if "map_id" in on and "segments" not in on:
        return within.stored(on["map_id"])
    return validate(InlineMap, on, within.limits), None


_NO_REFERENCE = object()


def _sealed(answer: Json, watch: Stopwatch, client_ref: Any = _NO_REFERENCE) -> Json:
    """Return an answer with an id and its times."""
    given = {} if client_ref is _NO_REFERENCE else {"client_ref": client_ref}
    return {**answer, **given, "request_id": secrets.token_hex(16), "timing_ms": watch.timing_ms()}
