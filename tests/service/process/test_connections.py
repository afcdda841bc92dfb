"""Connections that are held open, requests that arrive slowly or not at all, and answers that no one reads."""

from __future__ import annotations

import gzip
import socket
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import RunningService, running, until
from tests.service.parsing.bodies import large_map


@pytest.fixture(scope="module")
def impatient(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    folder = tmp_path_factory.mktemp("impatient")
    with running(folder, request_timeout_s=2.0, max_body_bytes=20_000_000) as service:
        yield service


def trickle(service: RunningService, pieces: list[bytes]) -> bytes:
    """Send a piece every 0.1 s until the service ends the connection; return its answer.

    A service that does not end it before the last piece has been sent is a failure, however fast the machine is.
    """
    answer = b""
    with service.connection(timeout=0.1) as connection:
        for piece in pieces:
            with suppress(ConnectionError):
                connection.sendall(piece)
            with suppress(TimeoutError, ConnectionError):
                while part := connection.recv(4096):
                    answer += part
                break
        else:
            pytest.fail("was never ended")
    return answer


HEAD = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 5000\r\n"
SLOW: dict[str, tuple[list[bytes], bytes]] = {
    "a body": ([HEAD + b"\r\n"] + [b" "] * 100, b"408"),
    "a second request": ([b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n", *[b""] * 100], b"200"),
    "a body that no route reads": ([HEAD.replace(b"/v1/associate", b"/nothing") + b"\r\n"] + [b" "] * 100, b"404"),
}


def test_slow_clients_are_closed(impatient: RunningService) -> None:
    with ThreadPoolExecutor(len(SLOW)) as threads:
        found = {name: threads.submit(trickle, impatient, pieces) for name, (pieces, _) in SLOW.items()}
        for name, (_, status) in SLOW.items():
            assert found[name].result()[9:12] == status, name


@pytest.mark.long
def test_who_does_not_read_the_answer_is_closed(impatient: RunningService) -> None:
    segments = [[float(i % 1000), 0.125, float(i % 1000) + 0.1234567890123, 0.1234567890123] for i in range(150_000)]
    body = gzip.compress(orjson.dumps({"segments": segments}), 1)  # small: it has to arrive in time
    packed = {"content-encoding": "gzip"}
    assert impatient.client.put("/v1/maps/large", content=body, headers=packed).status_code == 201
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.connect(("127.0.0.1", impatient.port))
        connection.sendall(b"GET /v1/maps/large HTTP/1.1\r\nHost: localhost\r\n\r\n")
        connection.settimeout(20)
        received = len(connection.recv(12))
        time.sleep(5.0)
        with suppress(ConnectionError):
            while part := connection.recv(1 << 20):
                received += len(part)
    # What was on the way arrives, the rest was dropped with the connection.
    assert 0 < received < 5_000_000


@pytest.mark.parametrize("size", [1_000, 8_000_000])
def test_a_refusal_arrives_though_the_body_was_not_read(service: RunningService, size: int) -> None:
    """A reset overtook it: the client saw a broken connection."""
    head = HEAD.replace(b"/v1/associate", b"/nothing").replace(b"5000", b"%d" % size) + b"\r\n"
    for _ in range(5):
        with service.connection() as connection:
            connection.sendall(head)
            connection.sendall(b" " * size)
            assert connection.recv(4096)[9:12] == b"404"


def test_an_answer_without_a_body_comes(service: RunningService) -> None:
    service.client.put("/v1/maps/brief", json=examples.MAP).raise_for_status()
    etag = service.client.get("/v1/maps/brief").headers["etag"]
    assert service.client.get("/v1/maps/brief", headers={"if-none-match": etag}).status_code == 304
    assert service.client.delete("/v1/maps/brief").status_code == 204
    with service.connection() as connection:
        for path in (b"/livez", b"/nothing") * 2:
            connection.sendall(b"HEAD %b HTTP/1.1\r\nHost: localhost\r\n\r\n" % path)
            assert connection.recv(65_536).endswith(b"\r\n\r\n")


LIVEZ = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"


def test_beyond_all_that_may_be_open_a_request_is_refused(start_service: Callable[..., RunningService]) -> None:
    running = start_service(max_connections=8, request_timeout_s=60.0)
    with ExitStack() as stack:
        connections = [stack.enter_context(running.connection()) for _ in range(20)]
        for connection in connections:
            connection.sendall(LIVEZ)
        statuses = [connection.recv(4096)[9:12] for connection in connections]
    assert {*statuses} <= {b"200", b"503"}
    assert statuses.count(b"503") >= 12
    until(lambda: running.client.get("/livez").status_code == 200)


def slow_readers(running: RunningService, count: int, path: str, stack: ExitStack) -> list[socket.socket]:
    """Return connections that have sent a request and read nothing yet."""
    readers = []
    for _ in range(count):
        connection = stack.enter_context(socket.socket())
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.connect(("127.0.0.1", running.port))
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        readers.append(connection)
    return readers


@pytest.mark.long
def test_answers_that_nobody_reads_are_bounded(start_service: Callable[..., RunningService]) -> None:
    """Sixty readers of a map of 10 MB that took their time held 898 MB."""
    running = start_service(max_answers_bytes=30_000_000, max_body_bytes=12_000_000)
    body = large_map(110_000)
    assert running.client.put("/v1/maps/large", content=body).status_code == 201
    with ExitStack() as stack:
        with running.grows_by_less_than(120.0):
            readers = slow_readers(running, 60, "/v1/maps/large", stack)
            statuses = [connection.recv(12)[9:] for connection in readers]
        assert statuses.count(b"200") in (1, 2, 3)
        assert statuses.count(b"429") == 60 - statuses.count(b"200")
        # Another address still has its part, and a client that reads gets the whole answer.
        transport = httpx.HTTPTransport(local_address="127.0.0.2")
        with httpx.Client(base_url=running.url, transport=transport, timeout=30.0) as client:
            assert client.get("/v1/maps/large").content == body
    until(lambda: running.client.get("/v1/maps/large").status_code == 200)


@pytest.mark.long
def test_many_readers_of_the_pages_share_what_they_read(service: RunningService) -> None:
    """A script of 1.5 MB that everybody may request, without a key."""
    with ExitStack() as stack, service.grows_by_less_than(60.0):
        slow_readers(service, 150, "/docs/assets/swagger-ui-bundle.js", stack)
        time.sleep(2.0)
