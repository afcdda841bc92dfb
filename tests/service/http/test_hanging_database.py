"""A database that takes connections and then says nothing: only those wait who need it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from urllib.parse import urlsplit

import httpx
import pytest

from linefix.documents import examples
from tests.running import JSON, RunningService, until
from tests.service.conftest import LOCAL, empty_database

STORED = {"map": {"map_id": "m"}, "scan": {"segments": examples.SEEN}}
INLINE = {"map": {"segments": examples.WALLS}, "scan": {"segments": examples.SEEN}}


class Line:
    """A way to a database that can be held up, as by a server that hangs or a network that is gone."""

    def __init__(self, host: str, port: int) -> None:
        self._there = (host, port)
        self.open = threading.Event()
        self.open.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self.open.set()
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                here, _ = self._listener.accept()
                there = socket.create_connection(self._there)
                for ends in ((here, there), (there, here)):
                    threading.Thread(target=self._pass, args=ends, daemon=True).start()

    def _pass(self, one: socket.socket, other: socket.socket) -> None:
        with suppress(OSError):
            while data := one.recv(65_536):
                self.open.wait()
                other.sendall(data)
        for end in (one, other):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        one.close()


@pytest.fixture
def line(tmp_path: object) -> Iterator[tuple[Line, str]]:
    with empty_database("postgresql", tmp_path) as url:  # type: ignore[arg-type]
        parts = urlsplit(LOCAL)
        made = Line(parts.hostname or "127.0.0.1", parts.port or 5432)
        yield made, url.replace(f":{parts.port}/", f":{made.port}/")
        made.close()


def test_inline_maps_do_not_wait_for_it(line: tuple[Line, str], start_service: Callable[..., RunningService]) -> None:
    """It held every search slot."""
    way, url = line
    running = start_service(database_url=url, searches=1, queue=8)
    running.client.put("/v1/maps/m", json=examples.MAP).raise_for_status()
    assert running.client.post("/v1/associate", json=STORED).status_code == 200
    way.open.clear()
    statuses: list[int] = []
    enough = threading.Event()

    def ask() -> None:
        body = {**STORED, "options": {"deadline_ms": 1500}}
        while not enough.is_set():
            answer = httpx.post(running.url + "/v1/associate", json=body, headers=JSON, timeout=60)
            statuses.append(answer.status_code)

    threads = [threading.Thread(target=ask) for _ in range(6)]
    for thread in threads:
        thread.start()
    try:
        until(lambda: len(statuses) > 0)  # so all of them have come, and wait again
        for path in ("/v1/associate", "/v1/associate:batch"):
            body = INLINE if path == "/v1/associate" else {"map": INLINE["map"], "scans": [INLINE["scan"]]}
            assert running.client.post(path, json=body).status_code == 200
            assert running.count("linefix_searches_running") == 0.0
    finally:
        enough.set()
        for thread in threads:
            thread.join()
    assert set(statuses) == {504}
    assert running.client.get("/v1/maps/m").json()["code"] == "not_ready"
    way.open.set()
    until(lambda: running.client.post("/v1/associate", json=STORED).status_code == 200)
    assert "a defect" not in running.log()
