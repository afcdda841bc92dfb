"""What is refused from a request's head alone: before the body is read and before the application is asked."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from ..http.problems import ProblemError
from ..parsing.reading import too_large
from ..telemetry.metrics import Metrics
from .gate import ANNOUNCED, SearchGate
from .keys import Keyring

logger = logging.getLogger("linefix")
SEARCHING = {
    path.encode("ascii"): path for path in ("/v1/associate", "/v1/associate:batch", "/v1/register", "/v1/vectorize")
}
OTHER = "unmatched"
REPORT_SECONDS = 1.0
NAP_SECONDS = 0.01


class Doors:
    """Sends away what would have to search while the queue is full, in some microseconds each.

    Under a flood the answers "no" are what costs: nothing of a search may be left for them. They are counted and logged
    once a second.
    """

    def __init__(self, gate: SearchGate, keyring: Keyring, metrics: Metrics, max_body_bytes: int) -> None:
        self._gate = gate
        self._max_body_bytes = max_body_bytes
        self._keyring = keyring
        self._metrics = metrics
        self._nap: asyncio.Handle | None = None
        self._refused: Counter[tuple[str, str, str, int]] = Counter()

    def refuse(self, method: bytes, url: bytes, headers: list[tuple[bytes, bytes]]) -> ProblemError | None:
        """Return why a request is not let in; None where the application is to answer."""
        if method not in (b"POST", b"PUT"):
            return None
        route = SEARCHING.get(url.partition(b"?")[0]) if method == b"POST" else None
        refusal = self._too_large(headers)
        if refusal is None and route is not None and self._gate.full:
            refusal = self._no_room(headers)
            if refusal is not None and self._nap is None:
                self._nap = asyncio.get_running_loop().call_soon(self._rest)
        if refusal is not None:
            if not self._refused:
                asyncio.get_running_loop().call_later(REPORT_SECONDS, self.report)
            self._refused[route or OTHER, method.decode(), refusal.code, refusal.status] += 1
        return refusal

    def _too_large(self, headers: list[tuple[bytes, bytes]]) -> ProblemError | None:
        """Refuse here what says so of itself: the connection then listens until the answer has been read."""
        for name, value in headers:
            if name == b"content-length" and int(value) > self._max_body_bytes:
                return too_large(self._max_body_bytes)
        return None

    def _no_room(self, headers: list[tuple[bytes, bytes]]) -> ProblemError | None:
        try:
            return self._gate.refusal(self._keyring.holder(headers))
        except ProblemError:
            return None  # the application says what is wrong with the key

    def _rest(self) -> None:
        """Hear nobody for a moment, the event loop included, and then all who came meanwhile in one go.

        To be woken for each by itself, away from a search, costs several times what it takes to refuse.
        """
        self._nap = None
        self._gate.rest(NAP_SECONDS)

    def announce(self, scope: Mapping[str, Any]) -> None:
        """Note that the body of a request is there, so that no more are let in than find room."""
        if scope["method"] == "POST" and scope["path"] in SEARCHING.values():
            with suppress(ProblemError):  # which the application tells
                scope["state"][ANNOUNCED] = self._gate.announce(self._keyring.holder(scope["headers"]))

    def report(self) -> None:
        """Count and log what was refused since the last time."""
        for (route, method, code, status), count in self._refused.items():
            self._metrics.count_refusals(route, method, status, count)
            logger.warning("refused", extra={"route": route, "code": code, "count": count})
        self._refused.clear()
