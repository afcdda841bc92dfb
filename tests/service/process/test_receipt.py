"""Requests that arrive slowly, wrongly or not at all."""

from __future__ import annotations

import gzip
import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import orjson
import pytest

from linefix.documents import examples
from tests.running import RunningService, running


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
