"""Traces for OpenTelemetry: off, and free, unless the extra ``linefix[otel]`` is there and ``OTEL_`` variables ask.

What a request does is noted while it does it, in `stage` and `queued`, and told when it is answered: nothing of
OpenTelemetry runs during a search.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import TracerProvider

T = TypeVar("T")
logger = logging.getLogger("linefix")

ENDPOINTS = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
FLUSH_SECONDS = 1.0  # at the end, for a collector that may be away
CARRIED = (b"traceparent", b"tracestate")


@dataclass(frozen=True, slots=True)
class Stage:
    """A part of a request: nanoseconds since 1970."""

    name: str
    begin: int
    end: int


@dataclass(frozen=True, slots=True)
class Trail:
    """What a request has done so far, in whichever thread."""

    begin: int = field(default_factory=time.time_ns)
    stages: list[Stage] = field(default_factory=list)

    def note(self, name: str, begin: int) -> None:
        """Note a stage that ends now."""
        self.stages.append(Stage(name, begin, time.time_ns()))


_TRAIL: ContextVar[Trail | None] = ContextVar("trail", default=None)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Note what the block takes as a stage of the present request, if that is traced."""
    trail = _TRAIL.get()
    if trail is None:
        yield
        return
    begin = time.time_ns()
    try:
        yield
    finally:
        trail.note(name, begin)


def queued(call: Callable[[], T]) -> Callable[[], T]:
    """Return a call for another thread that notes how long it waited there, and goes on with the present trail."""
    trail = _TRAIL.get()
    if trail is None:
        return call
    begin = time.time_ns()

    def run() -> T:
        trail.note("queue", begin)
        token = _TRAIL.set(trail)
        try:
            return call()
        finally:
            _TRAIL.reset(token)

    return run


class Traces:
    """Tells a collector what requests did.

    Parameters
    ----------
    provider : TracerProvider
    """

    def __init__(self, provider: TracerProvider) -> None:
        from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

        self._provider = provider
        self._tracer = provider.get_tracer("linefix")
        self._propagator = TraceContextTextMapPropagator()

    def begin(self) -> Trail:
        """Begin the trail of the present task's request."""
        trail = Trail()
        _TRAIL.set(trail)
        return trail

    def tell(self, trail: Trail, headers: Iterable[tuple[bytes, bytes]], name: str, told: Mapping[str, Any]) -> None:
        """Hand over what a request did, below the span that its headers name; it is sent later.

        Parameters
        ----------
        trail : Trail
        headers : iterable of (name, value)
        name : str
            Of the span, such as ``POST /v1/associate``.
        told : mapping
            Its attributes.
        """
        from opentelemetry.trace import SpanKind, set_span_in_context

        carrier = {key.decode(): value.decode("latin-1") for key, value in headers if key in CARRIED}
        outer = self._propagator.extract(carrier)
        span = self._tracer.start_span(name, outer, SpanKind.SERVER, attributes=dict(told), start_time=trail.begin)
        inside = set_span_in_context(span)
        for one in trail.stages:
            self._tracer.start_span(one.name, inside, start_time=one.begin).end(one.end)
        span.end()

    def close(self) -> None:
        """Send what is left, if somebody takes it soon."""
        # In a thread: it tries again for longer than it is told to.
        flushing = Thread(target=self._provider.force_flush, daemon=True)
        flushing.start()
        flushing.join(FLUSH_SECONDS)


def traces_of_environment() -> Traces | None:
    """Return what tells of traces as the ``OTEL_`` variables say; None where they do not ask for any."""
    asked = any(os.environ.get(name) for name in ENDPOINTS)
    off = os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true" or os.environ.get("OTEL_TRACES_EXPORTER") == "none"
    if not asked or off:
        return None
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import SERVICE_NAME, Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ModuleNotFoundError:
        logger.warning('traces are asked for, and not sent: pip install "linefix[otel]"')
        return None
    named = {} if os.environ.get("OTEL_SERVICE_NAME") else {SERVICE_NAME: "linefix"}
    # At the end of the process it would wait for a collector that is away.
    provider = TracerProvider(resource=Resource.create(named), shutdown_on_exit=False)
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    return Traces(provider)
