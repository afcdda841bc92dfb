"""What Prometheus is told."""

from __future__ import annotations

from collections.abc import Callable

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

from .version import VERSION

_SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_METHODS = frozenset(("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH"))


class Metrics:
    """The counts of one application, in a registry of its own."""

    def __init__(self) -> None:
        self.registry = made = CollectorRegistry()
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
        Gauge("linefix_build_info", "Version", ("version",), registry=made).labels(VERSION).set(1)

    def watch(self, name: str, what: str, read: Callable[[], float]) -> None:
        """Report a number that is read when asked for."""
        Gauge(name, what, registry=self.registry).set_function(read)

    def observe_request(self, route: str, method: str, status: int, seconds: float) -> None:
        """Count one request; status 0 is a client that hung up before it was answered."""
        # Any string may come as a method: it must not become a time series.
        name = method if method in _METHODS else "other"
        self.requests.labels(route, name, str(status)).inc()
        self.request_seconds.labels(route).observe(seconds)

    def count_refusals(self, route: str, status: int, count: int) -> None:
        """Count requests that were refused before the application saw them."""
        self.requests.labels(route, "POST", str(status)).inc(count)

    def observe_association(self, status: str, usable: bool, seconds: float, hypotheses: int) -> None:
        """Count one answered search."""
        self.verdicts.labels(status, str(usable).lower()).inc()
        self.search_seconds.observe(seconds)
        self.hypotheses.inc(hypotheses)

    def exposition(self) -> bytes:
        """Return the text that Prometheus reads."""
        return generate_latest(self.registry)
