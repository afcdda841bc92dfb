"""What is refused from a request's head alone: before the body is read and before the application is asked."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter

from .gate import SearchGate
from .keys import Keyring
from .metrics import Metrics
from .problems import ProblemError

logger = logging.getLogger("linefix")
SEARCHING = {
    path.encode("ascii"): path for path in ("/v1/associate", "/v1/associate:batch", "/v1/register", "/v1/vectorize")
}
REPORT_SECONDS = 1.0


class Doors:
    """Sends away what would have to search while the queue is full, in some microseconds each.

    Under a flood the answers "no" are what costs: nothing of a search may be left for them. They are counted one by
    one, and logged once a second.
    """

    def __init__(self, gate: SearchGate, keyring: Keyring, metrics: Metrics) -> None:
        self._gate = gate
        self._keyring = keyring
        self._metrics = metrics
        self._refused: Counter[tuple[str, str]] = Counter()

    def refuse(self, method: bytes, url: bytes, headers: list[tuple[bytes, bytes]]) -> ProblemError | None:
        """Return why a request is not let in; None where the application is to answer."""
        if method != b"POST" or not self._gate.full:
            return None
        route = SEARCHING.get(url.partition(b"?")[0])
        if route is None:
            return None
        try:
            refusal = self._gate.refusal(self._keyring.holder(headers))
        except ProblemError:
            return None  # the application says what is wrong with the key
        if refusal is not None:
            self._count(route, refusal)
        return refusal

    def _count(self, route: str, refusal: ProblemError) -> None:
        self._metrics.count_refusal(route, refusal.status)
        if not self._refused:
            asyncio.get_running_loop().call_later(REPORT_SECONDS, self._report)
        self._refused[route, refusal.code] += 1

    def _report(self) -> None:
        for (route, code), count in self._refused.items():
            logger.warning("refused", extra={"route": route, "code": code, "count": count})
        self._refused.clear()
