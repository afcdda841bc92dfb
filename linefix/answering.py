"""Requests as documents to answers as documents: what the service answers over HTTP, for programs without it."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from association import AssociationResult, MapSet
from map_quality import check_map

from . import operations
from .analyzing import Progress, look_on_all_cores
from .documents import inputs, results
from .documents.analysis import MapAnalyzeRequest
from .documents.errors import Fault, InvalidRequestError
from .documents.parts import InlineMap, MapDocument, SearchOptions, StoredMap
from .documents.reading import validate
from .documents.requests import (
    NO_SAMPLES,
    AssociateRequest,
    BatchItem,
    CheckRequest,
    OnMaps,
    RegisterRequest,
    VectorizeRequest,
)
from .documents.updates import UpdateRequest
from .driving import Explanation, explain_search, search
from .operations import Json, Search, Stopwatch, Target, worked

if TYPE_CHECKING:
    from formats import ImportedMap


def _none_stored(map_id: str) -> tuple[MapDocument, Json]:
    raise InvalidRequestError([Fault("/map/map_id", "found the id of a stored map, expected the map itself")])


@dataclass(frozen=True, slots=True)
class LocalService:
    """Answers requests in this process; the methods are those of the client of a service.

    Each raises `RequestError` or `InputError` when a part of the request is not taken, and `DeadlinePassedError` when
    the deadline of the request passes before the search starts. The limits of a service do not apply.

    Attributes
    ----------
    stored : callable
        From the id of a stored map to its document, and its id and revision as they are answered. Default: there are
        none.
    """

    stored: Callable[[str], tuple[MapDocument, Json]] = _none_stored

    def associate(self, document: Json, by: Search = search) -> Json:
        """Return the answer of ``POST /v1/associate``."""
        watch = Stopwatch()
        asked = validate(AssociateRequest, document)
        return self._find(watch, self._target(asked, asked.options), asked, asked.options, by)

    def locating(self, on: Json, options: Json) -> Callable[[Json], Json]:
        """Index the map, or the maps, of a request once; return the function from its ``scan`` and ``prior``.

        The function answers as `associate` does, and raises the same.
        """
        how = validate(SearchOptions, options)
        target = self._target(validate(OnMaps, on), how)
        return lambda sought: self._find(Stopwatch(), target, validate(BatchItem, sought), how)

    def explain(self, document: Json) -> Json:
        """Return the answer of `associate` as ``answer``, and next to it how its verdict came about."""
        explained = list[Explanation]()

        def by(*search: Any) -> AssociationResult:
            explained.append(explain_search(*search))
            return explained[-1].result

        return {"answer": self.associate(document, by), **results.explanation_json(explained[-1])}

    def register(self, document: Json) -> Json:
        """Return the answer of ``POST /v1/register``."""
        watch = Stopwatch()
        return _sealed(watch, operations.registered(validate(RegisterRequest, document), watch))

    def vectorize(self, document: Json) -> Json:
        """Return the answer of ``POST /v1/vectorize``."""
        watch = Stopwatch()
        return _sealed(watch, operations.vectorized(validate(VectorizeRequest, document), watch))

    def analyze(self, document: Json, progress: Progress = lambda done, total: None) -> Json:
        """Return the answer of ``POST /v1/analyze``, worked out on all cores."""
        watch = Stopwatch()
        asked = validate(MapAnalyzeRequest, document)
        drawn, reference = self._document_of(asked.map)
        analysis = inputs.analysis_of(inputs.index_of(drawn), asked)
        deadline = watch.deadline(asked.deadline_ms)
        watch.lap("decode")
        looks = look_on_all_cores(analysis, deadline, progress)
        watch.lap("search")
        return _sealed(watch, results.analysis_json(analysis, looks), map=reference, client_ref=asked.client_ref)

    def check_map(self, on: Json, document: Json | None = None) -> Json:
        """Return the answer of ``/v1/maps/{map_id}:check`` for the map of a request; a document has sample scans."""
        watch = Stopwatch()
        asked = NO_SAMPLES if document is None else validate(CheckRequest, document)
        drawn, reference = self._map_at(on)
        deadline = watch.deadline(asked.deadline_ms)
        steps = operations.check_steps(inputs.index_of(drawn, oriented=True), drawn.oriented, asked, deadline)
        return _sealed(watch, worked(steps, watch, deadline), map=reference, client_ref=asked.client_ref)

    def update_map(self, on: Json, document: Json) -> Json:
        """Return the answer of ``POST /v1/maps/{map_id}:update`` for the map of a request."""
        watch = Stopwatch()
        asked = validate(UpdateRequest, document)
        old, reference = self._map_at(on)
        deadline = watch.deadline(asked.deadline_ms)
        steps = operations.update_steps(inputs.index_of(old), old, asked, deadline)
        return _sealed(watch, worked(steps, watch, deadline), based_on=reference, client_ref=asked.client_ref)

    def check_import(self, imported: ImportedMap, watch: Stopwatch) -> Json:
        """Return the answer of ``POST /v1/maps:import`` for a map that was read."""
        watch.lap("read")
        document = validate(InlineMap, results.map_json(imported.map))
        inputs.require_map(document)
        found = check_map(inputs.index_of(document, oriented=True), oriented=imported.map.oriented)
        watch.lap("check")
        return _sealed(watch, results.import_json(imported, found))

    def _find(
        self,
        watch: Stopwatch,
        target: Target,
        sought: AssociateRequest | BatchItem,
        how: SearchOptions,
        by: Search = search,
    ) -> Json:
        deadline = watch.deadline(how.deadline_ms)
        _, answer = operations.find(target, sought, how, deadline, watch, by)
        return _sealed(watch, answer, client_ref=getattr(sought, "client_ref", None))

    def _target(self, asked: OnMaps, how: SearchOptions) -> Target:
        """Return the map of a request, or its maps, indexed; raises `InputError` when one cannot be searched."""
        named = {one.map_id: one for one in asked.maps} if isinstance(asked.maps, list) else {None: asked.map}
        found = {name: self._document_of(one) for name, one in named.items() if one is not None}
        parts = inputs.parts_of(((name, document) for name, (document, _) in found.items()), how.oriented)
        references = {name: one or inputs.reference_of(name) for name, (_, one) in found.items()}
        maps = MapSet(parts) if asked.maps else parts[""].indexed()
        return Target(maps, references, asked.map_weights)

    def _map_at(self, on: Json) -> tuple[MapDocument, Json | None]:
        """Return the map of a request, and the id and revision of a stored one."""
        if "map_id" in on and "segments" not in on:
            return self.stored(on["map_id"])
        return validate(InlineMap, on), None

    def _document_of(self, on: InlineMap | StoredMap) -> tuple[MapDocument, Json | None]:
        """Return a map, and the id and revision of a stored one."""
        return (on, None) if isinstance(on, InlineMap) else self.stored(on.map_id)


def _sealed(watch: Stopwatch, answer: Json, **given: Any) -> Json:
    """Return an answer with more fields, an id and its times."""
    return {**answer, **given, "request_id": secrets.token_hex(16), "timing_ms": watch.timing_ms()}
