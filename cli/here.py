"""Answers of this process, by `linefix`, as the JSON documents that the routes of the API answer with."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import linefix
from association import IndexingEndedError, KnownOfMaps, Prior
from linefix.answers import Included, association_json, registration_json
from linefix.driving import associate_on_maps
from linefix.explaining import explain_search, explanation_json
from linefix.map_answers import checked_json, import_json, map_json, update_json
from map_quality import check_map
from service.contract import (
    AssociateRequest,
    CheckRequest,
    InlineMap,
    KnownPairs,
    RegisterRequest,
    Stopwatch,
    VectorizeRequest,
    association_options_of,
    included_of,
    is_oriented,
    prior_of,
    scanned_of,
    scans_of,
    validate,
    vectorization_of,
)

from .compiling import compile_first
from .contract import Json, Question, id_of
from .errors import Asked, NoServerError
from .inputs import needing_formats, refusing
from .stored import FoundMap, map_here, require_storable, settings_here

TOO_LATE = "the deadline passed before the search started; extend deadline_ms, or send the request again later"

if TYPE_CHECKING:
    from formats import ImportOptions, LoggedScan


def associate(body: Json) -> Json:
    """Return the answer of ``POST /v1/associate``."""
    if "maps" in body:
        return _associate_on_maps(body)
    asked = _Search.of(body)
    return asked.answer(linefix.associate(*asked.arguments))


def explain(body: Json) -> Json:
    """Return the answer of ``POST /v1/associate`` as ``answer``, and next to it how its verdict came about.

    Raises
    ------
    RefusedError
        When a part of the request is not taken.
    """
    compile_first()
    with refusing(Asked(id_of(body.get("map")))):
        asked = _Search.of(body)
        found = explain_search(*asked.arguments)
        return {"answer": asked.answer(found.result), **explanation_json(found)}


@dataclass(frozen=True, slots=True)
class _Search:
    """A request of ``POST /v1/associate``, ready to be searched.

    Attributes
    ----------
    arguments : tuple
        Of `linefix.associate`.
    included : Included
    reference : dict or None
        Of the map.
    watch : Stopwatch
    """

    arguments: tuple[linefix.MapIndex, linefix.Scan, Prior | None, linefix.AssociationOptions, linefix.Deadline]
    included: Included
    reference: Json | None
    watch: Stopwatch

    @staticmethod
    def of(body: Json) -> _Search:
        """Read a request."""
        settings, watch = settings_here(), Stopwatch()
        asked = validate(AssociateRequest, body, settings.limits())
        options, deadline = asked.options, watch.deadline(asked.options.deadline_ms, settings.max_deadline_ms)
        found = map_here(body["map"])
        directed = is_oriented(options.oriented, found.document.get("oriented"))
        index = linefix.index_map({**found.document, "oriented": directed})
        watch.lap("decode")
        scanned, search = scanned_of(asked.scan), association_options_of(options, oriented=directed)
        included = included_of(asked.scan, options, scanned, found.document.get("frame_id", "map"))
        require_time(deadline)
        return _Search((index, scanned.scan, prior_of(asked.prior), search, deadline), included, found.reference, watch)

    def answer(self, result: linefix.AssociationResult) -> Json:
        """Return the answer with a result."""
        self.watch.lap("search")
        return _sealed(
            {**association_json(result, self.included), "map": self.reference, "client_ref": None}, self.watch
        )


def _associate_on_maps(body: Json) -> Json:
    """Return the answer of ``POST /v1/associate`` for several maps, of files or stored ones."""
    settings, watch = settings_here(), Stopwatch()
    asked = validate(AssociateRequest, body, settings.limits())
    options, deadline = asked.options, watch.deadline(asked.options.deadline_ms, settings.max_deadline_ms)
    maps: Sequence[Json] = body["maps"]
    found = {one["map_id"]: FoundMap(one, None) if "segments" in one else map_here(one) for one in maps}
    documents = {
        name: {
            "segments": one.document["segments"],
            "sigma": one.document.get("sigma"),
            "oriented": is_oriented(options.oriented, one.document.get("oriented")),
        }
        for name, one in found.items()
    }
    index = linefix.index_maps(documents)
    watch.lap("decode")
    scanned, search = scanned_of(asked.scan), association_options_of(options, oriented=index.oriented)
    require_time(deadline)
    prior_map = None if asked.prior is None else asked.prior.map_id
    known = KnownOfMaps(prior_of(asked.prior), prior_map, asked.map_weights)
    try:
        result = associate_on_maps(index, scanned.scan, known, search, deadline)
    except IndexingEndedError:
        raise NoServerError(TOO_LATE) from None
    watch.lap("search")
    frame_id = found[result.map_id or next(iter(found))].document.get("frame_id", "map")
    answer = association_json(result, included_of(asked.scan, options, scanned, frame_id))
    references = {name: one.reference or {"map_id": name, "revision": None} for name, one in found.items()}
    answer["maps"] = [{**one, **references[one["map_id"]]} for one in answer["maps"]]
    on = None if result.map_id is None else references[result.map_id]
    return _sealed({**answer, "map": on, "client_ref": None}, watch)


def register(body: Json) -> Json:
    """Return the answer of ``POST /v1/register``."""
    watch = Stopwatch()
    known = KnownPairs.of(validate(RegisterRequest, body, settings_here().limits()))
    watch.lap("decode")
    result = known.register()
    watch.lap("search")
    return _sealed(registration_json(result, known.pairs), watch)


def vectorize(body: Json) -> Json:
    """Return the answer of ``POST /v1/vectorize``."""
    watch = Stopwatch()
    asked = validate(VectorizeRequest, body, settings_here().limits())
    watch.lap("decode")
    answer = vectorization_of(asked)
    watch.lap("search")
    return _sealed(answer, watch)


_ANSWERS: Mapping[Question, Callable[[Json], Json]] = {
    "associate": associate,
    "register": register,
    "vectorize": vectorize,
}


def answer(question: Question, body: Json) -> Json:
    """Return the answer of ``POST /v1/<question>``.

    Raises
    ------
    RefusedError
        When a part of the request is not taken.
    """
    compile_first()
    with refusing(Asked(id_of(body.get("map")))):
        return _ANSWERS[question](body)


def check(on: Json, documents: Sequence[Json], logged: Sequence[LoggedScan] = ()) -> Json:
    """Return the answer of ``/v1/maps/{map_id}:check``, also for a map that is not stored.

    Parameters
    ----------
    on : dict
        The map of a request.
    documents : sequence of dict
        Sample scans, each as in a request.
    logged : sequence of LoggedScan
        Further ones, of a log.
    """
    compile_first()
    with refusing(Asked(map_id=id_of(on))):
        settings, watch = settings_here(), Stopwatch()
        limits, deadline = settings.limits(), watch.deadline(None, settings.max_deadline_ms)
        asked = validate(CheckRequest, {"scans": list(documents)}, limits) if documents else None
        if id_of(on) is None:
            validate(InlineMap, on, limits)
        found = map_here(on)
        index = linefix.index_map({**found.document, "oriented": True})
        # Neither the mount nor a motion that is not known matters to the map.
        scans = [linefix.scan_of(replace(one, mount=None, time_increment=0.0)) for one in logged]
        scans = [*scans_of(asked), *scans] if asked is not None else scans
        watch.lap("decode")
        require_time(deadline)
        oriented = is_oriented(None, found.document.get("oriented"))
        checked = linefix.check(index, scans, deadline=deadline, oriented=oriented)
        watch.lap("search")
        return _sealed({**checked_json(checked), "map": found.reference, "client_ref": None}, watch)


def update(on: Json, visits: Mapping[str, Sequence[LoggedScan]], accept: float | None, refuse: Sequence[int]) -> Json:
    """Return the answer of ``/v1/maps/{map_id}:update``, also for a map that is not stored.

    Parameters
    ----------
    on : dict
        The map of a request.
    visits : mapping of str to sequence of LoggedScan
        The scans of each visit.
    accept : float or None
        Confidence below which a change is not in the new map.
    refuse : sequence of int
        Changes that are not in the new map either.
    """
    compile_first()
    with refusing(Asked(map_id=id_of(on))):
        watch = Stopwatch()
        if id_of(on) is None:
            validate(InlineMap, on, settings_here().limits())
        found = map_here(on)
        index = linefix.index_map(found.document)
        watch.lap("decode")
        proposal = linefix.update_map(index, visits, accept=accept, refuse=refuse)
        watch.lap("search")
        answer = update_json(proposal, found.document)
        return _sealed({**answer, "based_on": found.reference, "client_ref": None}, watch)


def import_map(file: Path, options: ImportOptions) -> Json:
    """Return the answer of ``POST /v1/maps:import`` for a file of this machine."""
    compile_first()
    with refusing(Asked(files=(file.name,))), needing_formats(f"reading {file.name}"):
        settings, watch = settings_here(), Stopwatch()
        imported, deadline = linefix.read_map(file, options), watch.deadline(None, settings.max_deadline_ms)
        watch.lap("read")
        document = map_json(imported.map)
        require_storable(validate(InlineMap, document, settings.limits()))
        index = linefix.index_map({**document, "oriented": True})
        require_time(deadline)
        found = check_map(index, deadline, oriented=imported.map.oriented)
        watch.lap("check")
        return _sealed(import_json(imported, found), watch)


def require_time(deadline: linefix.Deadline) -> None:
    """Raise `NoServerError` where the deadline has passed before the search."""
    if deadline.passed:
        raise NoServerError(TOO_LATE)


def _sealed(answer: Json, watch: Stopwatch) -> Json:
    """Return an answer with an id and its times."""
    return {**answer, "request_id": secrets.token_hex(16), "timing_ms": watch.timing_ms()}
