"""The two clients: one for threads, one for event loops; method for method the operations of the service.

Every method raises `ProblemError` when the service rejects it, and `UnreachableError` without an answer. A request that
is answered by 429 or 503 was not carried out; it is sent again when `Retry-After` says.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping, Sequence
from contextlib import aclosing, closing
from typing import Any, cast

import httpx

from . import schema
from .asking import (
    Answer,
    Question,
    Reading,
    Settings,
    answer_of,
    check_of,
    if_match,
    import_of,
    map_path,
    update_of,
    wait_before_next,
)
from .problems import UnreachableError


class Client:
    """A service, asked in this thread; to be closed, or used in ``with``.

    Parameters
    ----------
    url : str
    key : str, optional
        Needed if the service requires one.
    timeout : float
        Seconds for one try.
    retries : int
        Number of times that a request is sent again after 429 or 503.
    transport : optional
        Of httpx, such as one with a certificate of one's own.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8000",
        key: str | None = None,
        *,
        timeout: float = 30.0,
        retries: int = 3,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self._settings = Settings(url, key, timeout, retries)
        self._http = httpx.Client(transport=transport, **self._settings.of_httpx())

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back its connections."""
        self._http.close()

    def _ask(self, question: Question) -> Any:
        tries = 0
        while True:
            tries += 1
            try:
                answer = self._send(question)
            except (httpx.TransportError, httpx.DecodingError) as error:
                raise UnreachableError(f"{self._settings.url}: {error}") from error
            wait = wait_before_next(answer, tries, self._settings.retries)
            if wait is None:
                return answer_of(answer)
            time.sleep(wait)

    def _send(self, question: Question) -> Answer:
        response = self._http.send(question.on(self._http), stream=True)
        with closing(response):
            reading = Reading(response, self._settings.timeout)
            for piece in response.iter_bytes():
                reading.take(piece)
            return reading.done()

    def associate(self, body: schema.AssociateRequest) -> schema.AssociateAnswer:
        """Find where in a map a scan was taken; gate on `usable`."""
        return cast(schema.AssociateAnswer, self._ask(Question("POST", "/v1/associate", body)))

    def associate_batch(self, body: schema.BatchRequest) -> schema.BatchAnswer:
        """Find many scans in one map; one that is wrong is one item."""
        return cast(schema.BatchAnswer, self._ask(Question("POST", "/v1/associate:batch", body)))

    def register(self, body: schema.RegisterRequest) -> schema.RegisterAnswer:
        """Fit a scan to a map whose correspondences are known."""
        return cast(schema.RegisterAnswer, self._ask(Question("POST", "/v1/register", body)))

    def vectorize(self, body: schema.VectorizeRequest) -> schema.VectorizeAnswer:
        """Cut ranges or points into segments."""
        return cast(schema.VectorizeAnswer, self._ask(Question("POST", "/v1/vectorize", body)))

    def put_map(
        self, map_id: str, document: schema.MapDocument, *, revision: int | None = None
    ) -> schema.MapSummaryAnswer:
        """Store a map; with `revision` only in place of that one."""
        return cast(schema.MapSummaryAnswer, self._ask(Question("PUT", map_path(map_id), document, if_match(revision))))

    def get_map(self, map_id: str) -> schema.MapDocument:
        """Return a map as it was stored."""
        return cast(schema.MapDocument, self._ask(Question("GET", map_path(map_id))))

    def delete_map(self, map_id: str, *, revision: int | None = None) -> None:
        """Remove a map; with `revision` only that one."""
        self._ask(Question("DELETE", map_path(map_id), None, if_match(revision)))

    def list_maps(self, *, limit: int | None = None, cursor: str | None = None) -> schema.MapList:
        """Return maps by id, and where to go on in `next`."""
        return cast(schema.MapList, self._ask(Question("GET", "/v1/maps", params={"limit": limit, "cursor": cursor})))

    def check_map(self, map_id: str, body: schema.CheckRequest | None = None) -> schema.CheckAnswer:
        """Report what is doubtful in a stored map; with a body also compare it to scans taken there."""
        return cast(schema.CheckAnswer, self._ask(check_of(map_id, body)))

    def import_map(
        self, files: Sequence[tuple[str, bytes]], fields: Mapping[str, str | Sequence[str]] | None = None
    ) -> schema.ImportAnswer:
        """Read the map of another tool, which is not stored; the first file is the map, the others are those it names.

        Each file is its name and content; `fields` are those of the form, such as ``{"units": "mm"}``.
        """
        return cast(schema.ImportAnswer, self._ask(import_of(files, fields)))

    def analyze(self, body: schema.MapAnalyzeRequest) -> schema.AnalyzeAnswer:
        """Simulate scans all over a map and report where localization succeeds; takes long on a large map."""
        return cast(schema.AnalyzeAnswer, self._ask(Question("POST", "/v1/analyze", body)))

    def update_map(self, map_id: str, body: schema.UpdateRequest) -> schema.UpdateAnswer:
        """Propose changes of a stored map that scans of several visits show; `put_map` accepts them."""
        return cast(schema.UpdateAnswer, self._ask(update_of(map_id, body)))

    def apply_changes(self, body: schema.ApplyRequest) -> schema.ApplyAnswer:
        """Return a map with those changes of an update that are accepted; `put_map` stores it."""
        return cast(schema.ApplyAnswer, self._ask(Question("POST", "/v1/maps:apply", body)))

    def limits(self) -> schema.Limits:
        """Tell what is too much for the service."""
        return cast(schema.Limits, self._ask(Question("GET", "/v1/limits")))

    def version(self) -> schema.Version:
        """Tell which version the service is."""
        return cast(schema.Version, self._ask(Question("GET", "/version")))


class AsyncClient:
    """A service, asked from an event loop; to be closed, or used in ``async with``.

    Parameters
    ----------
    url : str
    key : str, optional
        Needed if the service requires one.
    timeout : float
        Seconds for one try.
    retries : int
        Number of times that a request is sent again after 429 or 503.
    transport : optional
        Of httpx, such as one with a certificate of one's own.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8000",
        key: str | None = None,
        *,
        timeout: float = 30.0,
        retries: int = 3,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        self._settings = Settings(url, key, timeout, retries)
        self._http = httpx.AsyncClient(transport=transport, **self._settings.of_httpx())

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *failure: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Give back its connections."""
        await self._http.aclose()

    async def _ask(self, question: Question) -> Any:
        tries = 0
        while True:
            tries += 1
            try:
                answer = await self._send(question)
            except (httpx.TransportError, httpx.DecodingError) as error:
                raise UnreachableError(f"{self._settings.url}: {error}") from error
            wait = wait_before_next(answer, tries, self._settings.retries)
            if wait is None:
                return answer_of(answer)
            await asyncio.sleep(wait)

    async def _send(self, question: Question) -> Answer:
        response = await self._http.send(question.on(self._http), stream=True)
        async with aclosing(response):
            reading = Reading(response, self._settings.timeout)
            async for piece in response.aiter_bytes():
                reading.take(piece)
            return reading.done()

    async def associate(self, body: schema.AssociateRequest) -> schema.AssociateAnswer:
        """Find where in a map a scan was taken; gate on `usable`."""
        return cast(schema.AssociateAnswer, await self._ask(Question("POST", "/v1/associate", body)))

    async def associate_batch(self, body: schema.BatchRequest) -> schema.BatchAnswer:
        """Find many scans in one map; one that is wrong is one item."""
        return cast(schema.BatchAnswer, await self._ask(Question("POST", "/v1/associate:batch", body)))

    async def register(self, body: schema.RegisterRequest) -> schema.RegisterAnswer:
        """Fit a scan to a map whose correspondences are known."""
        return cast(schema.RegisterAnswer, await self._ask(Question("POST", "/v1/register", body)))

    async def vectorize(self, body: schema.VectorizeRequest) -> schema.VectorizeAnswer:
        """Cut ranges or points into segments."""
        return cast(schema.VectorizeAnswer, await self._ask(Question("POST", "/v1/vectorize", body)))

    async def put_map(
        self, map_id: str, document: schema.MapDocument, *, revision: int | None = None
    ) -> schema.MapSummaryAnswer:
        """Store a map; with `revision` only in place of that one."""
        return cast(
            schema.MapSummaryAnswer, await self._ask(Question("PUT", map_path(map_id), document, if_match(revision)))
        )

    async def get_map(self, map_id: str) -> schema.MapDocument:
        """Return a map as it was stored."""
        return cast(schema.MapDocument, await self._ask(Question("GET", map_path(map_id))))

    async def delete_map(self, map_id: str, *, revision: int | None = None) -> None:
        """Remove a map; with `revision` only that one."""
        await self._ask(Question("DELETE", map_path(map_id), None, if_match(revision)))

    async def list_maps(self, *, limit: int | None = None, cursor: str | None = None) -> schema.MapList:
        """Return maps by id, and where to go on in `next`."""
        return cast(
            schema.MapList, await self._ask(Question("GET", "/v1/maps", params={"limit": limit, "cursor": cursor}))
        )

    async def check_map(self, map_id: str, body: schema.CheckRequest | None = None) -> schema.CheckAnswer:
        """Report what is doubtful in a stored map; with a body also compare it to scans taken there."""
        return cast(schema.CheckAnswer, await self._ask(check_of(map_id, body)))

    async def import_map(
        self, files: Sequence[tuple[str, bytes]], fields: Mapping[str, str | Sequence[str]] | None = None
    ) -> schema.ImportAnswer:
        """Read the map of another tool, which is not stored; the first file is the map, the others are those it names.

        Each file is its name and content; `fields` are those of the form, such as ``{"units": "mm"}``.
        """
        return cast(schema.ImportAnswer, await self._ask(import_of(files, fields)))

    async def analyze(self, body: schema.MapAnalyzeRequest) -> schema.AnalyzeAnswer:
        """Simulate scans all over a map and report where localization succeeds; takes long on a large map."""
        return cast(schema.AnalyzeAnswer, await self._ask(Question("POST", "/v1/analyze", body)))

    async def update_map(self, map_id: str, body: schema.UpdateRequest) -> schema.UpdateAnswer:
        """Propose changes of a stored map that scans of several visits show; `put_map` accepts them."""
        return cast(schema.UpdateAnswer, await self._ask(update_of(map_id, body)))

    async def apply_changes(self, body: schema.ApplyRequest) -> schema.ApplyAnswer:
        """Return a map with those changes of an update that are accepted; `put_map` stores it."""
        return cast(schema.ApplyAnswer, await self._ask(Question("POST", "/v1/maps:apply", body)))

    async def limits(self) -> schema.Limits:
        """Tell what is too much for the service."""
        return cast(schema.Limits, await self._ask(Question("GET", "/v1/limits")))

    async def version(self) -> schema.Version:
        """Tell which version the service is."""
        return cast(schema.Version, await self._ask(Question("GET", "/version")))
