"""The process: keys, where it may listen, settings, probes, metrics, and how it ends."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import httpx
import numpy as np
import orjson
import pytest

from service.cli import unknown_settings
from service.schemas import examples
from service.settings import SettingsError, read_settings


@pytest.fixture(autouse=True)
def _no_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("LINEFIX_")]:
        monkeypatch.delenv(name)


def test_the_command_line_beats_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINEFIX_PORT", "81")
    monkeypatch.setenv("LINEFIX_QUEUE", "3")
    settings = read_settings(["--port", "82"])
    assert (settings.host, settings.port, settings.queue) == ("127.0.0.1", 82, 3)


def test_without_keys_only_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    for host in ("0.0.0.0", "::", "192.168.1.4", "example.org"):
        with pytest.raises(SettingsError, match="LINEFIX_KEYS"):
            read_settings(["--host", host])
    for host in ("127.0.0.1", "::1", "localhost"):
        read_settings(["--host", host])
    monkeypatch.setenv("LINEFIX_ALLOW_ANONYMOUS", "1")
    read_settings(["--host", "0.0.0.0"])
    monkeypatch.delenv("LINEFIX_ALLOW_ANONYMOUS")
    monkeypatch.setenv("LINEFIX_KEYS", " sesame, two ,")
    settings = read_settings(["--host", "0.0.0.0"])
    assert [key.get_secret_value() for key in settings.keys] == ["sesame", "two"]
    assert "sesame" not in repr(settings)


def test_a_wrong_setting_is_named_and_ends_the_start() -> None:
    with pytest.raises(SettingsError, match="queue"):
        read_settings(["--queue", "-1"])
    command = [sys.executable, "-m", "service", "--host", "0.0.0.0"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert "LINEFIX_ALLOW_ANONYMOUS" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_a_misspelt_setting_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINEFIX_PROT", "81")
    monkeypatch.setenv("LINEFIX_PORT", "81")
    assert unknown_settings() == ["LINEFIX_PROT"]


def test_keys(start_service: Callable[..., Any]) -> None:
    running = start_service(keys="sesame,open")
    client = running.client
    for path in ("/livez", "/readyz", "/metrics", "/version", "/docs", "/openapi.json", "/"):
        assert client.get(path).status_code == 200, path
    for headers in ({}, {"authorization": "Basic abc"}, {"authorization": "Bearer"}, {"authorization": "sesame"}):
        answer = client.get("/v1/limits", headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (401, "unauthorized")
        assert answer.headers["www-authenticate"].startswith("Bearer")
    wrong = client.get("/v1/limits", headers={"authorization": "Bearer sesam"})
    assert (wrong.status_code, wrong.json()["code"]) == (403, "forbidden")
    for key in ("sesame", "open"):
        assert client.get("/v1/limits", headers={"authorization": f"Bearer {key}"}).status_code == 200
    assert client.post("/v1/nothing", content=b"x" * 100_000).status_code == 401
    assert "sesame" not in running.log()


def test_probes_and_version(client: httpx.Client) -> None:
    assert client.get("/livez").json() == {"status": "ok"}
    assert client.get("/readyz").json() == {"status": "ok"}
    assert client.get("/version").json()["name"] == "linefix"
    assert client.get("/v1/limits").json()["max_batch"] == 256


def test_pages_need_no_internet(client: httpx.Client) -> None:
    assert "/docs" in client.get("/").text
    page = client.get("/docs").text
    assert "http://" not in page
    assert "https://" not in page
    for name in ("swagger-ui-bundle.js", "swagger-ui.css", "favicon.png"):
        assert f"/docs/assets/{name}" in page
        assert client.get(f"/docs/assets/{name}").status_code == 200
    assert client.get("/docs/assets/..%2f..%2fcore.py").status_code == 404


def test_metrics_count(client: httpx.Client) -> None:
    client.post("/v1/associate", json=examples.ASSOCIATE)
    client.get("/nothing/at/all")
    text = client.get("/metrics").text
    assert 'linefix_http_requests_total{method="POST",route="/v1/associate",status="200"}' in text
    assert 'route="unmatched"' in text
    assert "/nothing/at/all" not in text
    assert "linefix_verdicts_total" in text
    assert "linefix_searches_running 0.0" in text


def heavy_body(count: int = 200_000) -> bytes:
    """A request that keeps the service busy for a while: a large map that has to be indexed."""
    begins = np.random.default_rng(0).uniform(0.0, 1e3, (count, 2))
    segments = np.hstack([begins, begins + np.array([1.0, 0.1])])
    body = {"map": {"segments": segments}, "scan": {"segments": examples.SEEN}}
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)


def test_too_many_are_told_to_come_back_before_they_send(start_service: Callable[..., Any]) -> None:
    running = start_service(searches=1, queue=0)
    busy = threading.Thread(target=lambda: httpx.post(running.url + "/v1/associate", content=heavy_body(), timeout=60))
    busy.start()
    try:
        refused = b""
        give_up = time.monotonic() + 30
        while not refused.startswith(b"HTTP/1.1 503") and time.monotonic() < give_up:
            with socket.create_connection(("127.0.0.1", running.port), timeout=20) as connection:
                connection.sendall(b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n")
                connection.settimeout(0.1)
                with suppress(TimeoutError):
                    refused = connection.recv(4096)
                    refused += connection.recv(4096)
        head = refused.lower()
        assert refused.startswith(b"HTTP/1.1 503")
        assert b"retry-after: 1" in head
        assert b'"code":"overloaded"' in refused
        assert running.client.get("/livez").status_code == 200
        assert running.client.get("/readyz").status_code == 200
    finally:
        busy.join()
    assert running.client.post("/v1/associate", json=examples.ASSOCIATE).status_code == 200


def test_a_client_that_hangs_up_frees_its_place(start_service: Callable[..., Any]) -> None:
    running = start_service(searches=1, queue=1)

    def wait_for(state: str) -> None:
        give_up = time.monotonic() + 30
        while time.monotonic() < give_up:
            text = running.client.get("/metrics").text
            if "linefix_searches_running 1.0" in text and f"linefix_searches_waiting {state}" in text:
                return
            time.sleep(0.01)
        pytest.fail(f"never {state} waiting")

    busy = threading.Thread(target=lambda: httpx.post(running.url + "/v1/associate", content=heavy_body(), timeout=60))
    busy.start()
    wait_for("0.0")
    body = orjson.dumps(examples.ASSOCIATE)
    with socket.create_connection(("127.0.0.1", running.port), timeout=20) as connection:
        connection.sendall(
            f"POST /v1/associate HTTP/1.1\r\nHost: x\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body
        )
        wait_for("1.0")
    wait_for("0.0")
    # The one before it still runs: the place came free because its client left.
    assert busy.is_alive()
    busy.join()
    assert "a defect" not in running.log()


def test_sigterm_drains_and_ends(start_service: Callable[..., Any]) -> None:
    running = start_service(drain_seconds=1.0)
    answers: list[int] = []
    body = heavy_body(100_000)
    busy = threading.Thread(
        target=lambda: answers.append(httpx.post(running.url + "/v1/associate", content=body, timeout=60).status_code)
    )
    busy.start()
    time.sleep(0.2)
    begun = time.monotonic()
    running.process.send_signal(signal.SIGTERM)
    time.sleep(0.2)
    drained = running.client.get("/readyz")
    assert (drained.status_code, drained.json()["code"]) == (503, "not_ready")
    assert running.client.get("/livez").status_code == 200
    assert running.process.wait(15) == 0
    assert time.monotonic() - begun < 10.0
    busy.join()
    assert answers == [200]
    assert "Traceback" not in running.log()
