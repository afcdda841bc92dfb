"""Traces, as a collector on the loopback gets them."""

from __future__ import annotations

import gzip
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import pairwise
from typing import Any

import pytest

from linefix.documents import examples
from service.telemetry.traces import queued, stage, traces_of_environment
from tests.running import RunningService, until

pytest.importorskip("opentelemetry.exporter.otlp.proto.http")
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

TRACE, PARENT = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"


@dataclass
class Collector:
    """Takes traces as OTLP over HTTP."""

    url: str = ""
    services: set[str] = field(default_factory=set)
    spans: list[Any] = field(default_factory=list)
    close: Callable[[], None] = print

    def take(self, body: bytes) -> None:
        for resource in ExportTraceServiceRequest.FromString(body).resource_spans:
            told = {one.key: one.value.string_value for one in resource.resource.attributes}
            self.services.add(told["service.name"])
            self.spans += [span for scope in resource.scope_spans for span in scope.spans]

    def named(self, name: str) -> list[Any]:
        return [span for span in self.spans if span.name == name]


@pytest.fixture
def collector() -> Iterator[Collector]:
    found = Collector()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["content-length"]))
            found.take(gzip.decompress(body) if self.headers["content-encoding"] == "gzip" else body)
            self.send_response(200)
            self.send_header("content-type", "application/x-protobuf")
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        found.url = f"http://127.0.0.1:{server.server_port}"
        threading.Thread(target=server.serve_forever, daemon=True).start()
        found.close = server.shutdown
        yield found
        server.shutdown()


def traced(monkeypatch: pytest.MonkeyPatch, url: str) -> None:
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", url)
    monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")


def test_a_search_is_told_with_its_stages_below_the_callers_span(
    collector: Collector, monkeypatch: pytest.MonkeyPatch, start_service: Callable[..., RunningService]
) -> None:
    traced(monkeypatch, collector.url)
    running = start_service()
    client = running.client
    headers = {"traceparent": f"00-{TRACE}-{PARENT}-01", "x-request-id": "mine"}
    client.post("/v1/associate", json=examples.ASSOCIATE, headers=headers).raise_for_status()
    until(lambda: len(collector.named("POST /v1/associate")) > 0)  # ends last
    (request,) = collector.named("POST /v1/associate")
    assert (request.trace_id.hex(), request.parent_span_id.hex()) == (TRACE, PARENT)
    assert {one.key: one.value.string_value or one.value.int_value for one in request.attributes} == {
        "http.request.method": "POST",
        "http.route": "/v1/associate",
        "http.response.status_code": 200,
        "linefix.request_id": "mine",
    }
    inside = [span for span in collector.spans if span.parent_span_id == request.span_id]
    assert [span.name for span in sorted(inside, key=lambda span: span.start_time_unix_nano)] == [
        "parse",
        "index",
        "queue",
        "search",
    ]
    for before, after in pairwise(inside):
        assert before.start_time_unix_nano <= before.end_time_unix_nano <= after.end_time_unix_nano
    assert collector.services == {"linefix"}
    collector.close()  # without one it ends in time, too
    assert client.post("/v1/associate", json=examples.ASSOCIATE).status_code == 200
    running.process.terminate()
    assert running.ended() == 0


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:1", "OTEL_SDK_DISABLED": "true"},
        {"OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:1", "OTEL_TRACES_EXPORTER": "none"},
    ],
    ids=["nothing said", "disabled", "no exporter"],
)
def test_nothing_is_noted_where_nobody_asks(environment: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert traces_of_environment() is None

    def call() -> int:
        with stage("search"):
            return 1

    assert queued(call) is call
    assert call() == 1
