"""Answers of this process: the functions that the HTTP routes call, without HTTP."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import cached_property
from pathlib import Path

import orjson
from pydantic import ValidationError

from association import Deadline, MapIndex
from compiled import is_complete
from service.http.problems import problem_of
from service.importing.bounded import ReadMap
from service.importing.fields import Fields, options_of
from service.maps import IndexCache, MapStore, Preconditions
from service.maps.lookup import FoundMap, MapLookup, outline_of
from service.parsing.parser_process import ParserProcess
from service.parsing.reading import read_map as read_document
from service.parsing.reading import read_model
from service.schemas.analysis import MapAnalyzeRequest
from service.schemas.parts import InlineMap, StoredMap
from service.schemas.requests import AssociateRequest, CheckRequest, RegisterRequest, VectorizeRequest
from service.settings import Settings
from service.telemetry.metrics import Metrics
from service.work.analyzing import analysis_json, analysis_of, reference_to
from service.work.answers import outline_json
from service.work.association import Associator
from service.work.checking import check, check_done, conclude, sample
from service.work.importing import answer_import, index_import
from service.work.job import Done, Job, Stopwatch
from service.work.registration import answer_registration
from service.work.vectorization import answer_vectorization

from .all_cores import look_on_all_cores
from .compiling import compile_in
from .errors import NOTHING, Asked, CommandError, WrongUseError, error_of
from .inputs import document_of, needing_formats
from .service import Json, Progress, Question, id_of

MAPS_AT_ONCE = 1000


class InProcess:
    """Answers as the service does, with its limits and its store of maps.

    Raises
    ------
    WrongUseError
        When a setting in the environment is wrong.
    """

    def __init__(self) -> None:
        try:
            self._settings = Settings()
        except ValidationError as error:
            wrong = error.errors()[0]
            name = ".".join(str(part) for part in wrong["loc"])
            raise WrongUseError(f"LINEFIX_{name.upper()} in the environment: {wrong['msg']}") from None
        self._metrics = Metrics()
        self._parser = ParserProcess()
        self._has_compiled = False
        self._limits = self._settings.limits()

    def close(self) -> None:
        """Give back what was opened."""
        self._parser.close()
        if "_store" in self.__dict__:
            self._store.close()

    def ask(self, question: Question, body: Json) -> Json:
        """Return the answer of ``POST /v1/<question>``."""
        self._compile()
        with _refusing(Asked(id_of(body.get("map")))):
            return _json(self._done(question, orjson.dumps(body)))

    def import_map(self, files: Sequence[Path], fields: Fields) -> Json:
        """Return the answer of ``POST /v1/maps:import``; what is one's own is read in this process."""
        self._compile()
        asked, watch = Asked(files=tuple(file.name for file in files)), Stopwatch()
        with _refusing(asked), needing_formats(f"reading {files[0].name}", asked):
            from formats import read_map

            imported = read_map(files[0], options_of(fields))
            read = ReadMap(orjson.dumps(document_of(imported.map)), asdict(imported.report))
            watch.lap("read")
            line_map = read_model(InlineMap, read.map, self._limits)
            job = self._job(watch)
            return _json(answer_import(index_import(self._lookup, line_map, job.deadline), line_map, read, job))

    def check(self, on: Json, samples: Json | None) -> Json:
        """Return the answer of ``/v1/maps/{map_id}:check``, also for a map that is not stored."""
        self._compile()
        map_id = id_of(on)
        with _refusing(Asked(map_id=map_id)):
            asked = None if samples is None else read_model(CheckRequest, orjson.dumps(samples), self._limits)
            watch = Stopwatch()
            job = self._job(watch, None if asked is None else asked.deadline_ms)
            line_map = None if map_id else read_model(InlineMap, orjson.dumps(on), self._limits)
            checked = check(self._lookup, line_map or self._lookup.find(str(map_id), oriented=True), asked, job)
            judged = None
            if asked is not None:
                tried = [sample(checked, asked, number, job) for number in range(len(asked.scans))]
                judged = conclude(checked, tried, job)
            return _json(check_done(checked, judged, asked, job))

    def indexed(self, on: Json) -> MapIndex:
        """Return the map of a request, inline or stored, ready to be searched."""
        self._compile()
        map_id = id_of(on)
        with _refusing(Asked(map_id)):
            line_map = None if map_id else read_model(InlineMap, orjson.dumps(on), self._limits)
            found = line_map or self._lookup.find(str(map_id), oriented=None)
            return self._lookup.indexed(found, oriented=None, deadline=Deadline()).index

    @property
    def longest_search(self) -> float:
        """Seconds that a search may take."""
        return 1e-3 * self._settings.max_deadline_ms

    def put(self, map_id: str, document: Json) -> Json:
        """Store a map where a service with these settings would."""
        with _refusing():
            asked, kept = read_document(orjson.dumps(document), self._limits)
            outline = outline_of(asked)
            revision, _ = self._store.put(map_id, kept, outline, Preconditions())
            return outline_json(map_id, revision, outline)

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        with _refusing(Asked(map_id)):
            document: Json = orjson.loads(self._store.load(map_id).document)
            return document

    def maps(self) -> Iterator[Json]:
        """Give what is told of each stored map, by id."""
        after: str | None = ""
        while after is not None:
            with _refusing():
                page = self._store.list(MAPS_AT_ONCE, after)
            yield from (outline_json(one.map_id, one.revision, one.outline) for one in page.maps)
            after = page.next

    def remove(self, map_id: str) -> None:
        """Forget a stored map."""
        with _refusing(Asked(map_id)):
            self._store.delete(map_id, Preconditions())

    def analyze(self, body: Json, progress: Progress) -> Json:
        """Return the answer of ``POST /v1/analyze``, worked out on all cores, however long it takes."""
        self._compile()
        with _refusing():
            asked = read_model(MapAnalyzeRequest, orjson.dumps(body), self._limits)
            on = self._found(asked.map, None)
            watch = Stopwatch()
            deadline = Deadline() if asked.deadline_ms is None else watch.deadline(asked.deadline_ms, asked.deadline_ms)
            analysis = analysis_of(self._lookup.indexed(on, oriented=None, deadline=deadline), asked)
            found = look_on_all_cores(analysis, self._settings.searches, deadline, progress)
            watch.lap("search")
            sealed = {"map": reference_to(on), "client_ref": asked.client_ref, "timing_ms": watch.timing_ms()}
            return {**analysis_json(analysis, found), **sealed}

    def _compile(self) -> None:
        """Compile what is not kept from before; once: where nothing can be kept this process compiles what it needs."""
        if self._has_compiled or is_complete():
            return
        self._has_compiled = True
        compile_in(self._parser)

    def _done(self, question: Question, data: bytes) -> Done:
        watch = Stopwatch()
        if question == "register":
            return answer_registration(read_model(RegisterRequest, data, self._limits), self._job(watch))
        if question == "vectorize":
            return answer_vectorization(read_model(VectorizeRequest, data, self._limits), self._job(watch))
        asked = read_model(AssociateRequest, data, self._limits)
        on = self._found(asked.map, asked.options.oriented)
        return self._associator.answer(asked, on, self._job(watch, asked.options.deadline_ms))

    def _job(self, watch: Stopwatch, deadline_ms: float | None = None) -> Job:
        return Job(secrets.token_hex(16), watch, watch.deadline(deadline_ms, self._settings.max_deadline_ms))

    def _found(self, asked: InlineMap | StoredMap, oriented: bool | None) -> InlineMap | FoundMap:
        return asked if isinstance(asked, InlineMap) else self._lookup.find(asked.map_id, oriented=oriented)

    @cached_property
    def _store(self) -> MapStore:
        """The store that a service with these settings has; opened when first asked."""
        return MapStore(self._settings.url, most_bytes=self._settings.max_stored_bytes)

    @cached_property
    def _lookup(self) -> MapLookup:
        return MapLookup(IndexCache(self._settings.cache_bytes, self._metrics), self._store, self._parser)

    @cached_property
    def _associator(self) -> Associator:
        return Associator(self._lookup, self._metrics)


def _json(done: Done) -> Json:
    answer: Json = orjson.loads(done.body)
    return answer


@contextmanager
def _refusing(asked: Asked = NOTHING) -> Iterator[None]:
    """Turn what the service would answer as a problem into an error of the command line."""
    try:
        yield
    except CommandError:
        raise
    except Exception as error:
        problem = problem_of(error)
        if problem is None:
            raise
        faults = [{"pointer": fault.pointer, "message": fault.message} for fault in problem.faults]
        raise error_of(problem.kind.status, problem.kind.code, problem.detail, faults, asked) from error
