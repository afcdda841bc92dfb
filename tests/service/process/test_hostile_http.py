"""HTTP as no one should send it: what it costs the service, and what the sender is reported."""

from __future__ import annotations

import re
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress

import orjson
import pytest

from linefix.documents import examples
from tests.running import RunningService

HEAD = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
CHUNKED = HEAD + b"Transfer-Encoding: chunked\r\n\r\n"
LIVEZ = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"
LAST_LIVEZ = LIVEZ[:-2] + b"Connection: close\r\n\r\n"
BODY = orjson.dumps(examples.ASSOCIATE)
LAST_CHUNK = b"0\r\n"
LOCAL = b" HTTP/1.1\r\nHost: localhost\r\n"


def statuses(answer: bytes) -> list[int]:
    return [int(status) for status in re.findall(rb"HTTP/1\.1 (\d{3})", answer) if status != b"100"]


def pour(service: RunningService, head: bytes, piece: bytes, most: int, status: bytes = b"") -> int:
    """Send a head, then a piece again and again until the service has enough; return how many bytes it took."""
    sent = 0
    with service.connection(timeout=5.0) as connection, suppress(OSError):
        connection.sendall(head)
        if status:
            assert connection.recv(65_536)[9:].startswith(status)
        while sent < most:
            connection.sendall(piece)
            sent += len(piece)
    return sent


CHUNKED_LIVEZ = LIVEZ[:-2] + b"Transfer-Encoding: chunked\r\n\r\n" + LAST_CHUNK
WHOLE = CHUNKED + b"%x\r\n%b\r\n" % (len(BODY), BODY)
# A request that ends after some MB, though it is sent on and on: a head, and the bytes that follow it again and again.
ENDLESS = {
    "many short trailers": (CHUNKED_LIVEZ, b"a: b\r\n" * 10_000),
    "one long trailer": (CHUNKED_LIVEZ + b"x: ", b"c" * 60_000),
    "trailers of a body that is there": (WHOLE + LAST_CHUNK, b"a: b\r\n" * 10_000),
    "what a chunk is called": (CHUNKED + b"1;", b"e" * 60_000),
}


@pytest.mark.parametrize(
    "kind", [pytest.param(one, marks=pytest.mark.long) if "trailers" not in one[:20] else one for one in ENDLESS]
)
def test_what_has_no_end_costs_nothing(service: RunningService, kind: str) -> None:
    """121 MB of trailers took 2.9 GB, before a key was asked for."""
    with service.grows_by_less_than(20.0):
        assert pour(service, *ENDLESS[kind], 120_000_000) < 60_000_000


def test_a_few_trailers_are_passed_over(service: RunningService) -> None:
    answer = service.talk(WHOLE + b"0\r\nX-Checksum: 1\r\nHost: evil\r\n\r\n" + LAST_LIVEZ)
    assert answer.count(b"HTTP/1.1 200") == 2


UNREAD = {
    b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer wrong\r\n": b"40",
    b"POST /nothing HTTP/1.1\r\nHost: localhost\r\n": b"404",
    b"GET /livez HTTP/1.1\r\nHost: localhost\r\n": b"200",
}
FRAMES = {
    b"Content-Length: 9000000\r\n\r\n": b"x" * 65_536,
    b"Transfer-Encoding: chunked\r\n\r\n": b"10000\r\n" + b"x" * 65_536 + b"\r\n",
}


@pytest.mark.parametrize("head", UNREAD)
@pytest.mark.parametrize("framing", FRAMES)
def test_what_is_refused_is_not_read_on(guarded: RunningService, head: bytes, framing: bytes) -> None:
    """After a 401 the server read 4.9 GB more."""
    assert pour(guarded, head + framing, FRAMES[framing], 150_000_000, UNREAD[head]) < 60_000_000


def test_an_unknown_key_ends_the_connection(guarded: RunningService) -> None:
    for key in (b"", b"Authorization: Bearer wrong\r\n"):
        answer = guarded.talk(b"GET /v1/limits HTTP/1.1\r\nHost: localhost\r\n" + key + b"\r\n" + LIVEZ)
        assert answer[9:12] in (b"401", b"403")
        assert b"connection: close" in answer
        assert len(statuses(answer)) == 1


@pytest.mark.long
def test_long_heads_leave_nothing_behind(guarded: RunningService) -> None:
    """A thousand connections with 31 KB each, without a key, took 98 MB, and the next thousand as much again."""
    before = guarded.memory_mb()
    for number in range(1000):
        guarded.talk(b"GET /v1/maps/%d" % number + b"x" * 31_000 + LOCAL + b"\r\n")
    assert guarded.memory_mb() - before < 20.0


def test_many_requests_at_once_are_all_answered_in_order(service: RunningService) -> None:
    numbers = range(3000)
    requests = b"".join(LIVEZ[:-2] + b"X-Request-Id: %d\r\n\r\n" % number for number in numbers)
    answer = b""
    with service.connection() as connection, ThreadPoolExecutor(1) as thread:
        thread.submit(connection.sendall, requests)
        while answer.count(b'{"status":"ok"}') < len(numbers):
            part = connection.recv(65_536)
            assert part, answer.count(b"HTTP/1.1 200")
            answer += part
    assert [int(found) for found in re.findall(rb"x-request-id: (\d+)", answer)] == [*numbers]


@pytest.mark.long
def test_many_requests_at_once_take_little_memory(service: RunningService) -> None:
    """Each read held some ten thousand of them, each with all that belongs to one, and that on every connection."""
    requests = b"GET / HTTP/1.1\r\nHost:1\r\n\r\n" * 10_000
    with ExitStack() as stack, service.grows_by_less_than(50.0):
        for _ in range(40):
            connection = stack.enter_context(service.connection())
            connection.setblocking(False)
            with suppress(BlockingIOError):
                connection.send(requests)
        time.sleep(1.0)


REFUSED = {
    "no host": b"GET /livez HTTP/1.1\r\n\r\n",
    "two hosts": b"GET /livez HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n",
    "two hosts in HTTP/1.0": b"GET /livez HTTP/1.0\r\nHost: localhost\r\nHost: localhost\r\n\r\n",
    "a host that is none": b"GET /livez HTTP/1.1\r\nHost: a b\r\n\r\n",
    "another coding before chunked": HEAD + b"Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
    "chunked twice": HEAD + b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    "a chunk without a size": CHUNKED + b"zz\r\n",
    "a chunk longer than it says": CHUNKED + b"2\r\n{}}\r\n",
    "rubbish": b"RUBBISH\r\n\r\n",
    "TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc",
    "HTTP/0.9": b"GET /livez\r\n\r\n",
    "a control character in the path": b"GET /metrics\x0b HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "an escaped one": b"GET http://localhost/metrics%0A HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "a head without end": b"GET /livez HTTP/1.1\r\nHost: localhost\r\nA: " + b"a" * 3_000_000,
    "a target without end": b"GET /" + b"a" * 3_000_000,
    "NUL in a field": b"GET /livez HTTP/1.1\r\nHost: localhost\r\nA: a\0b\r\n\r\n",
    "a length and chunks": b"GET /livez HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n"
    b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    "two lengths": HEAD + b"Content-Length: 1\r\nContent-Length: 2\r\n\r\n{}",
    "a length below zero": HEAD + b"Content-Length: -1\r\n\r\n",
    "chunked in HTTP/1.0": HEAD.replace(b"1.1", b"1.0") + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_not_http_is_refused_and_ends_the_connection(service: RunningService, kind: str) -> None:
    """And what two servers could read in two ways."""
    answer = service.talk(REFUSED[kind], end=len(REFUSED[kind]) < 1000)
    assert statuses(answer) == [400] or (answer == b"" and "without end" in kind), (
        answer
    )  # a reset overtakes the answer
    assert len(answer) < 1000
    assert service.client.get("/livez").status_code == 200
    assert "Traceback" not in service.log()


OF_H2 = b"Upgrade: h2c\r\nHTTP2-Settings: AAMAAABkAARA\r\n"
OF_WEB_SOCKET = b"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
ODD = {
    "CONNECT to a path": (b"CONNECT /x" + LOCAL + b"\r\n", b"404"),
    "CONNECT to a host": (b"CONNECT example.org:443 HTTP/1.1\r\nHost: example.org:443\r\n\r\n", b"40"),
    "a method that is none": (b"BREW /" + LOCAL + b"\r\n", b"405"),
    "a method of WebDAV": (b"PROPFIND /livez" + LOCAL + b"\r\n", b"405"),
    "TRACE": (b"TRACE /livez" + LOCAL + b"\r\n", b"405"),
    "OPTIONS of everything": (b"OPTIONS *" + LOCAL + b"\r\n", b"404"),
    "an absolute target": (b"GET http://localhost/livez" + LOCAL + b"\r\n", b"404"),
    "a target without a slash": (b"GET livez" + LOCAL + b"\r\n", b"404"),
    "a web socket": (b"GET /livez" + LOCAL + b"Connection: Upgrade\r\n" + OF_WEB_SOCKET + b"\r\n", b"200"),
    "an upgrade to HTTP/2": (
        b"GET /livez" + LOCAL + b"Connection: Upgrade, HTTP2-Settings\r\n" + OF_H2 + b"\r\n", b"200"),
}  # fmt: skip


@pytest.mark.parametrize("kind", ODD)
def test_an_odd_request_gets_one_short_answer_and_one_line_in_the_log(service: RunningService, kind: str) -> None:
    """Forty bytes of CONNECT, without a key, were answered 492 times."""
    (sent, status), name = ODD[kind], f"odd-{list(ODD).index(kind)}"
    answer = service.talk(sent[:-2] + b"X-Request-Id: %b\r\nConnection: close\r\n\r\n" % name.encode())
    assert answer[9:].startswith(status), answer
    assert (len(statuses(answer)), len(answer) < 700) == (1, True)
    assert service.log().count(f'"{name}"') <= 1


def test_http_1_0_needs_no_host(service: RunningService) -> None:
    assert service.talk(b"GET /livez HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 200")


def test_what_comes_before_rubbish_is_answered_first(service: RunningService) -> None:
    answer = service.talk(HEAD + b"Content-Length: %d\r\n\r\n" % len(BODY) + BODY + LIVEZ + b"RUBBISH\r\n\r\n")
    assert statuses(answer) == [200, 200, 400]


def test_half_a_body_is_logged_and_ends(service: RunningService) -> None:
    for sent in (HEAD + b"Content-Length: 100\r\n\r\n{}", CHUNKED + b"2\r\n{}\r\n"):
        assert service.talk(sent, end=True)[9:12] in (b"400", b"")
    assert "Traceback" not in service.log()


@pytest.mark.parametrize("split", [20, 80, 130])
def test_an_upgrade_in_a_head_of_two_packets_keeps_its_body(service: RunningService, split: int) -> None:
    head = HEAD + b"Connection: Upgrade, HTTP2-Settings\r\n" + OF_H2
    for framed in (
        head + b"Content-Length: %d\r\n\r\n" % len(BODY) + BODY,
        head + b"Transfer-Encoding: chunked\r\n\r\n%x\r\n%b\r\n0\r\n\r\n" % (len(BODY), BODY),
    ):
        answer = service.talk(framed[:split], framed[split:] + LAST_LIVEZ)
        assert answer.count(b"HTTP/1.1 200") == 2, answer
    request = head + b"Content-Length: %d\r\n\r\n" % len(LIVEZ) + LIVEZ  # a body that looks like a request
    assert statuses(service.talk(request[:split], request[split:] + LAST_LIVEZ)) == [400, 200]
