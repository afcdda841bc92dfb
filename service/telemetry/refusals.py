"""Refusals that the application never sees, counted and logged once a second.

Under a flood there are thousands a second. A line in the log for each would take time from the searches.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter

from .metrics import Metrics

logger = logging.getLogger("linefix")
REPORT_SECONDS = 1.0


class RefusalTally:
    """Gathers refusals; belongs to one event loop."""

    def __init__(self, metrics: Metrics) -> None:
        self._metrics = metrics
        self._refused: Counter[tuple[str, str, str, int]] = Counter()

    def count(self, route: str, method: str, code: str, status: int) -> None:
        """Count one, and have it reported soon."""
        if not self._refused:
            asyncio.get_running_loop().call_later(REPORT_SECONDS, self.report)
        self._refused[route, method, code, status] += 1

    def report(self) -> None:
        """Count and log what was refused since the last time."""
        for (route, method, code, status), count in self._refused.items():
            self._metrics.count_refusals(route, method, status, count)
            logger.warning("refused", extra={"route": route, "code": code, "count": count})
        self._refused.clear()
