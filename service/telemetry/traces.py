"""Traces for OpenTelemetry: off, and free, unless ``linefix[otel]`` is there and ``OTEL_`` variables request them."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar, copy_context
from threading import Thread
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.trace import Span, Tracer

T = TypeVar("T")
logger = logging.getLogger("linefix")

ENDPOINTS = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
FLUSH_SECONDS = 1.0  # at the end, for a collector that may be away
CARRIED = (b"traceparent", b"tracestate")
_TRACER: ContextVar[Tracer | None] = ContextVar("tracer", default=None)


def stage(name: str) -> AbstractContextManager[object]:
    """Return a context that records a stage of the current request as a span, if the request is traced."""
    tracer = _TRACER.get()
    if tracer is None:
        return nullcontext()
    # Errors are in the log; a collector gets no messages and no tracebacks.
    return tracer.start_as_current_span(name, record_exception=False, set_status_on_exception=False)


def queued(call: Callable[[], T]) -> Callable[[], T]:
    """Return a call for another thread that records its wait as a span and continues the current trace."""
    tracer = _TRACER.get()
    if tracer is None:
        return call
    waiting, context = tracer.start_span("queue"), copy_context()

    def run() -> T:
        waiting.end()
        return context.run(call)

    return run


class Traces:
    """Records requests as spans.

    Parameters
    ----------
    provider : TracerProvider
        Exports them to a collector.
    """

    def __init__(self, provider: TracerProvider) -> None:
        from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

        self._provider = provider
        self._tracer = provider.get_tracer("linefix")
        self._propagator = TraceContextTextMapPropagator()

    @contextmanager
    def request(self, headers: Iterable[tuple[bytes, bytes]]) -> Iterator[Span]:
        """Record the block as a request, below the span that its headers name; its name is set at the end."""
        from opentelemetry.trace import SpanKind, use_span

        outer = self._propagator.extract(
            {key.decode(): value.decode("latin-1") for key, value in headers if key in CARRIED}
        )
        span = self._tracer.start_span("request", outer, SpanKind.SERVER)
        token = _TRACER.set(self._tracer)
        try:
            with use_span(span, end_on_exit=True, record_exception=False, set_status_on_exception=False):
                yield span
        finally:
            _TRACER.reset(token)

    def close(self) -> None:
        """Send the remaining spans, if the collector takes them soon."""
        # In a thread: the exporter tries again for longer than its timeout.
        flushing = Thread(target=self._provider.force_flush, daemon=True)
        flushing.start()
        flushing.join(FLUSH_SECONDS)


def traces_of_environment() -> Traces | None:
    """Return the traces that the ``OTEL_`` variables request; None where they request none."""
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
        logger.warning(
            'OTEL_ variables enable traces, but OpenTelemetry is missing: in a checkout, pip install ".[otel]"'
        )
        return None
    named = {} if os.environ.get("OTEL_SERVICE_NAME") else {SERVICE_NAME: "linefix"}
    # At the end of the process it would wait for a collector that is away.
    provider = TracerProvider(resource=Resource.create(named), shutdown_on_exit=False)
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    return Traces(provider)
