"""Answers of this process: the functions that the HTTP routes call, without HTTP."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import asdict
from functools import cached_property
from pathlib import Path

import orjson

from service.importing.bounded import ReadMap
from service.importing.fields import Fields, options_of
from service.maps import IndexCache, MapStore
from service.maps.lookup import FoundMap, MapLookup
from service.parsing.parser_process import ParserProcess
from service.parsing.reading import read_model
from service.schemas.parts import InlineMap, StoredMap
from service.schemas.requests import AssociateRequest, CheckRequest, RegisterRequest, VectorizeRequest
from service.telemetry.metrics import Metrics
from service.work.association import Associator
from service.work.checking import check, check_done, conclude, sample
from service.work.importing import answer_import, index_import
from service.work.job import Done, Job, Stopwatch
from service.work.registration import answer_registration
from service.work.vectorization import answer_vectorization

from .compiling import compile_first
from .contract import Json, Question, id_of
from .errors import Asked
from .inputs import document_of, needing_formats
from .stored import refusing, settings_here


class InProcess:
    """Answers as the service does, with its limits and its store of maps.

    Raises
    ------
    WrongUseError
        When a setting in the environment is wrong.
    """

    def __init__(self) -> None:
        self._settings = settings_here()
        self._metrics = Metrics()
        self._parser = ParserProcess()
        self._limits = self._settings.limits()

    def close(self) -> None:
        """Give back what was opened."""
        self._parser.close()
        if "_store" in self.__dict__:
            self._store.close()

    def ask(self, question: Question, body: Json) -> Json:
        """Return the answer of ``POST /v1/<question>``."""
        compile_first()
        with refusing(Asked(id_of(body.get("map")))):
            return _json(self._done(question, orjson.dumps(body)))

    def import_map(self, files: Sequence[Path], fields: Fields) -> Json:
        """Return the answer of ``POST /v1/maps:import``; what is one's own is read in this process."""
        compile_first()
        asked, watch = Asked(files=tuple(file.name for file in files)), Stopwatch()
        with refusing(asked), needing_formats(f"reading {files[0].name}", asked):
            from formats import read_map

            imported = read_map(files[0], options_of(fields))
            read = ReadMap(orjson.dumps(document_of(imported.map)), asdict(imported.report))
            watch.lap("read")
            line_map = read_model(InlineMap, read.map, self._limits)
            job = self._job(watch)
            return _json(answer_import(index_import(self._lookup, line_map, job.deadline), line_map, read, job))

    def check(self, on: Json, samples: Json | None) -> Json:
        """Return the answer of ``/v1/maps/{map_id}:check``, also for a map that is not stored."""
        compile_first()
        map_id = id_of(on)
        with refusing(Asked(map_id=map_id)):
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
