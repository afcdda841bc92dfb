"""The effect of one hostile client on an honest one: ``python -m benchmarks.siege``.

Each attack runs alone, next to a client with another key and next to probes. Printed are how soon `/livez` answers,
what the honest client gets over half of what the service can do, how much memory all processes hold at most, and what
was answered as nothing should be. Attacks by connections alone are the proxy's.
With two cores or more the service has the first half to itself.
"""

from __future__ import annotations

import argparse
import gzip
import itertools
import os
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import orjson

from linefix.documents import examples

from .open_loop import at_rate, beside, request_of, without_pause
from .overload import Service, goodput, highest, loaded_service
from .table import Row, at_least, at_most, print_rows, quantile

SECONDS = 60.0
SHARE, PROBE_MS, MEMORY_MB = 0.9, 50.0, 600
PROBES = 50.0  # a second
KEY = b"Authorization: Bearer flood\r\n"
POST = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
Script = Callable[[socket.socket], None]


def request(body: bytes, more: bytes = b"") -> bytes:
    """Return a search as it goes over the wire."""
    return POST + KEY + more + b"Content-Length: %d\r\n\r\n" % len(body) + body


def encoded(value: object) -> bytes:
    """Return JSON, arrays included."""
    return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)


def sent(data: bytes, wait: float = 0.0) -> Script:
    """Send something, wait, and read what comes."""

    def script(connection: socket.socket) -> None:
        connection.sendall(data)
        time.sleep(wait)
        connection.recv(65_536)

    return script


def without_end(head: bytes, piece: bytes) -> Script:
    """Send a head, and then a piece again and again."""

    def script(connection: socket.socket) -> None:
        connection.sendall(head)
        while True:
            connection.sendall(piece)

    return script


def unread(data: bytes) -> Script:
    """Send something, and read next to nothing of what comes."""

    def script(connection: socket.socket) -> None:
        connection.sendall(data)
        for _ in range(100):
            connection.recv(1000)
            time.sleep(0.5)

    return script


def parallel_walls() -> bytes:
    """Return a map and a scan of lines that are all alike, for as long as the deadline lets it."""
    rows = np.arange(2000.0)[:, None]
    walls = np.hstack([0 * rows, rows, 0 * rows + 9900.0, rows])
    seen = np.hstack([0 * rows, 0.01 * rows, 0 * rows + 9.0, 0.01 * rows])
    return encoded({"map": {"segments": walls}, "scan": {"segments": seen}})


def one_cell() -> bytes:
    """Return a map whose walls are all in one place."""
    rng = np.random.default_rng(0)
    ends = rng.uniform(0.0, 2.0, (20_000, 4))
    return encoded({"map": {"segments": ends}, "scan": {"segments": rng.uniform(-2.0, 2.0, (200, 4))}})


def maps_anew() -> Script:
    """Send along a map of 20,000 segments, another each time."""
    rng, numbers = np.random.default_rng(0), itertools.count(1)
    begins = rng.uniform(0.0, 300.0, (20_000, 2))
    rows = encoded(np.hstack([begins, begins + rng.uniform(-1.0, 1.0, begins.shape)]).round(3))
    scan = encoded(examples.ASSOCIATE["scan"])

    def script(connection: socket.socket) -> None:
        body = b'{"map": {"sigma": %.6f, "segments": %b}, "scan": %b}' % (1e-6 * next(numbers), rows, scan)
        connection.sendall(request(body))
        connection.recv(65_536)

    return script


def large_map() -> bytes:
    """Return a map of some 8 MB; it is stored as ``siege`` before each attack."""
    return encoded({"segments": np.random.default_rng(0).uniform(0.0, 1e3, (110_000, 4))})


def attacks() -> dict[str, tuple[int, Script]]:
    """Return each attack: how many connections at once do what, again and again."""
    names = b'{"options": {"include": [%b]}}' % b",".join([b'"a"'] * 110_000)
    many = b'{"options": {"include": [%b]}}' % b",".join([b'"a"'] * 1_900_000)
    unknown = b"{%b}" % b",".join(b'"%x":1' % number for number in range(45_000))
    packed = gzip.compress(b'{"map": ' + b" " * 30_000_000 + b"1}", 9)
    large = large_map()
    put = (
        b"PUT /v1/maps/siege HTTP/1.1\r\nHost: localhost\r\n" + KEY + b"Content-Length: %d\r\n\r\n" % len(large) + large
    )
    get = b"GET /v1/maps/siege HTTP/1.1\r\nHost: localhost\r\n" + KEY + b"\r\n"
    half = POST + KEY + b"Content-Length: 20000000\r\n\r\n" + b" " * 19_999_999
    asked = request(orjson.dumps(examples.ASSOCIATE))
    wrong = POST + b"Authorization: Bearer wrong\r\nContent-Length: 31000000\r\n\r\n"
    page = b"GET /docs/assets/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n"
    return {
        "names in include": (4, sent(request(names))),
        "1.9 million names": (4, sent(request(many))),
        "unknown fields": (4, sent(request(unknown))),
        "parallel walls": (8, sent(request(parallel_walls()))),
        "one cell": (8, sent(request(one_cell()))),
        "maps again": (4, maps_anew()),
        "gzip": (12, sent(request(packed, b"Content-Encoding: gzip\r\n"))),
        "bodies withheld": (20, sent(half, 10.0)),
        "a large map stored": (2, sent(put)),
        "slow readers": (60, unread(get)),
        "slow readers of pages": (120, unread(page)),
        "an unknown key": (4, without_end(wrong, b" " * 65_536)),
        "the contract, by many": (64, sent(b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n")),
        "counts, by many": (64, sent(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n")),
        "searches": (64, sent(asked)),
    }


def attack(port: int, name: str, seconds: float) -> int:
    """Run one attack; return how many times it connected."""
    count, script = attacks()[name]
    end = time.monotonic() + seconds
    connected = [0] * count

    def repeat(number: int) -> None:
        while time.monotonic() < end:
            with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=10.0) as connection:
                connected[number] += 1
                script(connection)

    threads = [threading.Thread(target=repeat, args=(number,), daemon=True) for number in range(count)]
    for thread in threads:
        thread.start()
    time.sleep(seconds)
    return sum(connected)


def besieged(service: Service, name: str, seconds: float, capacity: float) -> list[Row]:
    """Run an attack next to an honest client and probes."""
    probes = (service.port, [request_of("/livez")], PROBES, seconds)
    with (
        beside(attack, service.port, name, seconds) as connected,
        beside(at_rate, *probes) as answers,
        highest(service.memory_mb) as most,
    ):
        honest = without_pause(service.port, service.requests(), service.cores, seconds)
        probed = [a.seconds if a.status == 200 else seconds for a in answers()]
        count = connected()
    lost = sum(a.status not in (200, 503) for a in honest)
    return [
        Row(f"{name}: connected", str(count)),
        at_most(f"  /livez, p99 of {len(probed)}, ms", 1e3 * quantile(probed, 0.99), PROBE_MS, form=".1f"),
        at_least("  the honest client, over half the capacity", goodput(honest, seconds) / (0.5 * capacity), SHARE),
        at_most("  memory of all processes, at most, MB", max(most), MEMORY_MB, form=".0f"),
        at_most("  of the honest client answered neither 200 nor 503", lost, 0, form=".0f"),
    ]


def main() -> None:
    """Print what each attack does."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.siege", description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of each attack")
    parser.add_argument("--only", nargs="*", help="names of attacks")
    args = parser.parse_args()
    for name in args.only or attacks():
        with loaded_service() as service:
            assert service.call("PUT", "/v1/maps/siege", large_map()) == 201
            capacity = goodput(without_pause(service.port, service.requests(), service.cores, 5.0), 5.0)
            print_rows(name, besieged(service, name, args.seconds, capacity))
            assert service.call("PUT", "/v1/maps/after", examples.MAP) == 201
    print(f"\nload {os.getloadavg()[0]:.1f} at the end")


if __name__ == "__main__":
    main()
