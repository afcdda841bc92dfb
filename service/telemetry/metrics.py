"""Metrics for Prometheus."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Callable
from pathlib import Path

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest, multiprocess

from ..version import VERSION

_SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_METHODS = frozenset(("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH"))
_DIRECTORY = "PROMETHEUS_MULTIPROC_DIR"
REFRESH_SECONDS = 0.5
EXPOSITION_SECONDS = 0.2  # between two texts; one takes 10 ms of the event loop, more of several workers


def forget_ended_workers(directory: str) -> None:
    """Take running and waiting requests of processes that have ended out of the sums; their counts stay."""
    for pid in {int(path.stem.rpartition("_")[2]) for path in Path(directory).glob("gauge_live*.db")}:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            multiprocess.mark_process_dead(pid, directory)  # type: ignore[no-untyped-call]


class Metrics:
    """The counts of one application, in a registry of its own; of all workers together where there are several."""

    def __init__(self) -> None:
        self.registry = made = CollectorRegistry()
        self._watched: list[tuple[Gauge, Callable[[], float]]] = []
        self._text: asyncio.Future[bytes] | None = None
        self._text_after = 0.0
        self.requests = Counter(
            "linefix_http_requests", "Requests answered", ("route", "method", "status"), registry=made
        )
        self.request_seconds = Histogram(
            "linefix_http_request_seconds", "Time to answer", ("route",), buckets=_SECONDS, registry=made
        )
        self.verdicts = Counter("linefix_verdicts", "Associations answered", ("status", "usable"), registry=made)
        self.search_seconds = Histogram("linefix_search_seconds", "Time in the search", buckets=_SECONDS, registry=made)
        self.hypotheses = Counter("linefix_hypotheses", "Poses that were tried", registry=made)
        self.cache_hits = Counter("linefix_map_cache_hits", "Maps found indexed", registry=made)
        self.cache_misses = Counter("linefix_map_cache_misses", "Maps that had to be indexed", registry=made)
        self.map_changes = Counter(
            "linefix_map_changes", "Stored maps created, replaced, deleted", ("change",), registry=made
        )
        build = Gauge("linefix_build_info", "Version", ("version",), registry=made, multiprocess_mode="livemax")
        build.labels(VERSION).set(1)
        self.watch("linefix_resident_bytes", "Memory of the workers", _resident_bytes)

    def watch(self, name: str, what: str, read: Callable[[], float]) -> None:
        """Report a number that is read now and then, and on each request to this worker."""
        gauge = Gauge(name, what, registry=self.registry, multiprocess_mode="livesum")
        self._watched.append((gauge, read))

    def refresh(self) -> None:
        """Read the watched values."""
        for gauge, read in self._watched:
            gauge.set(read())

    async def refreshed(self) -> None:
        """Read the watched values, in the event loop."""
        self.refresh()

    def observe_request(self, route: str, method: str, status: int, seconds: float) -> None:
        """Count one request; status 0 is a client that hung up before it was answered."""
        # Any string may come as a method: it must not become a time series.
        name = method if method in _METHODS else "other"
        self.requests.labels(route, name, str(status)).inc()
        self.request_seconds.labels(route).observe(seconds)

    def observe_association(self, status: str, usable: bool, seconds: float, hypotheses: int) -> None:
        """Count one answered search."""
        self.verdicts.labels(status, str(usable).lower()).inc()
        self.search_seconds.observe(seconds)
        self.hypotheses.inc(hypotheses)

    async def exposition(self) -> bytes:
        """Return the text for Prometheus, with the present values; however many request it, a few in a second.

        A request soon after another waits, together with all that arrive meanwhile.
        """
        if self._text is None:
            self._text = asyncio.ensure_future(self._next_text())
        return await asyncio.shield(self._text)

    async def _next_text(self) -> bytes:
        await asyncio.sleep(max(0.0, self._text_after - time.monotonic()))
        self._text = None
        try:
            return self.rendered()
        finally:
            self._text_after = time.monotonic() + EXPOSITION_SECONDS

    def rendered(self) -> bytes:
        """Return the text that Prometheus reads."""
        self.refresh()
        directory = os.environ.get(_DIRECTORY)
        if directory is None:
            return generate_latest(self.registry)
        together = CollectorRegistry()
        multiprocess.MultiProcessCollector(together, directory)  # type: ignore[no-untyped-call]
        return generate_latest(together)


def _resident_bytes() -> float:
    try:
        with open("/proc/self/statm") as file:
            return float(int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
    except OSError:
        return 0.0
