"""Hours in short: mixed load, and memory that stays where it is."""

from __future__ import annotations

import random
import socket
import statistics
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import JSON

CALLERS = 3
PAUSE = 0.1  # s between the requests of one caller, in the mean
MOST = 512.0  # MB


def rooms(count: int, seed: int) -> list[list[float]]:
    """A map of rooms of different sizes, count walls or a few more."""
    draw = random.Random(seed)
    walls: list[list[float]] = []
    while len(walls) < count:
        x, y = 20.0 * (len(walls) // 6 % 100), 20.0 * (len(walls) // 600)
        a, b, c = draw.uniform(0.7, 1.5), draw.uniform(0.7, 1.5), draw.uniform(-1.0, 1.0)
        walls += [[x + a * x1, y + b * y1, x + a * x2, y + b * y2] for x1, y1, x2, y2 in examples.WALLS]
        walls.append([x + c, y, x + c, y + 0.5])
    return walls


class Mix:
    """Draws requests of every kind, good, bad and broken off."""

    def __init__(self, seed: int, port: int) -> None:
        self._draw = random.Random(seed)
        self._port = port
        self._kinds: list[tuple[float, Callable[[httpx.Client], httpx.Response | None]]] = [
            (30, lambda client: client.post("/v1/associate", json=examples.ASSOCIATE)),
            (15, self._stored),
            (5, lambda client: client.post("/v1/associate:batch", json=examples.BATCH)),
            (10, lambda client: client.post("/v1/register", json=examples.REGISTER)),
            (10, lambda client: client.post("/v1/vectorize", json=examples.VECTORIZE)),
            (8, self._put),
            (6, lambda client: client.get(f"/v1/maps/{self._name()}")),
            (2, lambda client: client.delete(f"/v1/maps/{self._name()}")),
            (2, lambda client: client.get("/v1/maps")),
            (2, lambda client: client.get("/metrics")),
            (5, self._bad),
            (5, self._hang_up),
        ]

    def send(self, client: httpx.Client) -> str:
        """Send one request; return its status, or that there is none."""
        weights = [weight for weight, _ in self._kinds]
        answer = self._draw.choices(self._kinds, weights)[0][1](client)
        return "hung up" if answer is None else str(answer.status_code)

    def _name(self) -> str:
        return f"soak-{self._draw.randrange(20)}"

    def _stored(self, client: httpx.Client) -> httpx.Response:
        body = {"map": {"map_id": self._name()}, "scan": {"segments": examples.SEEN}, "options": {"deadline_ms": 500}}
        return client.post("/v1/associate", json=body)

    def _put(self, client: httpx.Client) -> httpx.Response:
        count = self._draw.choice([6, 60, 600, 600, 6000, 6000, 20_000])
        body = {"segments": rooms(count, self._draw.randrange(5)), "meta": self._draw.random()}
        return client.put(f"/v1/maps/{self._name()}", json=body)

    def _bad(self, client: httpx.Client) -> httpx.Response:
        bodies = [b"{", b"[" * 100_000, b"{}", b'{"map": NaN}', b"\x1f\x8b", b'{"map":{"segments":[' + b"0," * 50_000]
        return client.post("/v1/associate", content=self._draw.choice(bodies))

    def _hang_up(self, client: httpx.Client) -> None:
        body = orjson.dumps({"map": {"segments": rooms(600, 1)}, "scan": {"segments": examples.SEEN}})
        head = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        head += b"Content-Length: %d\r\n\r\n" % len(body)
        with socket.create_connection(("127.0.0.1", self._port), timeout=20) as connection:
            connection.sendall((head + body)[: self._draw.randrange(1, len(head) + len(body) + 1)])
            time.sleep(self._draw.uniform(0.0, 0.02))


@pytest.mark.long
def test_memory_is_flat_under_mixed_load(start_service: Callable[..., Any], request: pytest.FixtureRequest) -> None:
    seconds = 60.0 * request.config.getoption("--soak-minutes")
    running = start_service()
    counts: Counter[str] = Counter()
    end = time.monotonic() + seconds

    def call(seed: int) -> None:
        mix = Mix(seed, running.port)
        draw = random.Random(seed)
        with httpx.Client(base_url=running.url, timeout=60.0, headers=JSON) as client:
            while time.monotonic() < end:
                counts[mix.send(client)] += 1
                time.sleep(draw.expovariate(1.0 / PAUSE))

    callers = [threading.Thread(target=call, args=(seed,)) for seed in range(CALLERS)]
    for caller in callers:
        caller.start()
    samples: list[float] = []
    while any(caller.is_alive() for caller in callers):
        time.sleep(0.5)
        samples.append(running.memory_mb())
    fifth = len(samples) // 5
    medians = [statistics.median(samples[i * fifth : (i + 1) * fifth]) for i in range(5)]
    print(f"\n{seconds / 60:g} minutes, {sum(counts.values())} requests: {dict(sorted(counts.items()))}")
    print(f"resident memory in MB, medians of fifths: {', '.join(f'{m:.0f}' for m in medians)}; ", end="")
    print(f"peak {max(samples):.0f}")
    assert not [status for status in counts if status.startswith("5") and status not in ("503", "504")]
    assert "a defect" not in running.log()
    assert counts["200"] > 0.5 * sum(counts.values())
    assert max(samples) < MOST
    # The first fifth fills the caches.
    assert medians[4] < 1.1 * medians[1]
