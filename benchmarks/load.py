"""The service under ten times too much load: ``python -m benchmarks load``.

Goodput at ten times the capacity over goodput at capacity, in alternating pairs; the slowest of the accepted; how a
flood with one key leaves another its share; how probes are answered meanwhile, and while maps of 16 MB are stored,
parsed and indexed; and the memory that takes. With two cores or more the service has the first half to itself and the
clients have the others.
"""

from __future__ import annotations

import http.client
import math
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import orjson
from scipy import stats

from examples.running import running_service
from simulation import World
from simulation import scan as simulate

from .drawn import SCANNER, campus_of_offices
from .open_loop import Answered, at_rate, beside, request_of, without_pause
from .table import Row, at_least, at_most, machine, print_rows, quantile

PAIRS = 8
SECONDS = 5.0
FACTOR = 10
PROBES = 100.0  # a second
IDLE_S = 3.0  # after which memory has been given back
GOODPUT, SHARE, PROBE_MS, MEMORY_MB = 0.9, 0.9, 50.0, 600
QUEUE = 16
FLOORS = 8
LARGE_SEGMENTS = 199_000  # 16 MB with all their digits


class Service:
    """The service under load, and the requests that it gets."""

    def __init__(self, url: str, pid: int, cores: int) -> None:
        self.port = int(url.rsplit(":", 1)[1])
        self.pid = pid
        self.cores = cores
        self.started_mb = self.memory_mb()
        self._bodies: list[bytes] = []
        rng = np.random.default_rng(0)
        for number in range(FLOORS):
            world = campus_of_offices(rng, 1 + number % 4)
            put = {"segments": world.segments.endpoints.tolist()}
            assert self.call("PUT", f"/v1/maps/{number}", put) == 201
            for _ in range(3):
                laser = one_turn(world, rng)
                asked = {"map": {"map_id": str(number)}, "scan": {"laser": laser, "sigma": SCANNER.sigma}}
                self._bodies.append(orjson.dumps(asked, option=orjson.OPT_SERIALIZE_NUMPY))
                # The first request indexes the map. That is no part of the capacity, however short a run is.
                assert self.call("POST", "/v1/associate", self._bodies[-1]) == 200

    def call(self, method: str, path: str, body: object) -> int:
        """Send one request with the robot's key; return the status."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        data = body if isinstance(body, bytes) else orjson.dumps(body)
        connection.request(method, path, data, {"Authorization": "Bearer robot", "Content-Type": "application/json"})
        status = connection.getresponse().status
        connection.close()
        return status

    def requests(self, key: str = "robot") -> list[bytes]:
        """Return the requests, in turn."""
        return [request_of("/v1/associate", body, key) for body in self._bodies]

    def memory_mb(self) -> float:
        """Return what the service and its processes hold now, MB."""
        return sum(_resident(pid) for pid in family(self.pid)) / 1e6


def one_turn(world: World, rng: np.random.Generator) -> dict[str, object]:
    """Return what a scanner sees from a random place of a world, as it is sent: to the millimetre."""
    centre = world.poses[rng.integers(len(world.poses))]
    seen = simulate(world.segments, replace(centre, theta=rng.uniform(-math.pi, math.pi)), SCANNER, rng)
    ranges = [round(r, 3) if math.isfinite(r) else None for r in seen.ranges.tolist()]
    return {
        "angle_min": SCANNER.angle_min,
        "angle_increment": SCANNER.angle_increment,
        "range_min": SCANNER.range_min,
        "range_max": SCANNER.range_max,
        "ranges": ranges,
    }


def goodput(answered: Sequence[Answered], seconds: float) -> float:
    """Return how many were answered with 200 a second, counting only those that came within the time."""
    return sum(a.status == 200 and a.due + a.seconds <= seconds for a in answered) / seconds


def overload(service: Service, pairs: int, seconds: float) -> list[Row]:
    """Ask for as much as the service can do, and for ten times that, by turns."""
    probes = (service.port, [request_of("/livez")], PROBES, seconds)
    full = (service.port, service.requests(), service.cores + QUEUE // 2, seconds)
    alone = without_pause(service.port, service.requests(), 1, seconds)
    ratios: list[float] = []
    rates: list[float] = []
    accepted: list[float] = []
    probed: list[float] = []
    lost = 0
    capacity = goodput(without_pause(*full), seconds)
    for number in range(pairs):
        found = {}
        for kind in ("full", "over") if number % 2 == 0 else ("over", "full"):
            if kind == "full":
                with beside(at_rate, *probes):
                    found[kind] = capacity = goodput(without_pause(*full), seconds)
                continue
            with beside(at_rate, *probes) as answers:
                many = at_rate(service.port, service.requests(), FACTOR * capacity, seconds)
                probed += [a.seconds for a in answers()]
            found[kind] = goodput(many, seconds)
            rates.append(found[kind])
            accepted += [a.seconds for a in many if a.status == 200]
            lost += sum(a.status not in (200, 503) for a in many)
            print(f"pair {number + 1}: {len(many) / seconds:.0f} asked a second, {found[kind]:.0f} answered")
        ratios.append(found["over"] / found["full"])
        print(f"pair {number + 1}: {found['full']:.0f} a second at capacity, ratio {ratios[-1]:.3f}")
    half = stats.t.ppf(0.975, len(ratios) - 1) * np.std(ratios, ddof=1) / math.sqrt(len(ratios))
    times = [1e3 * a.seconds for a in alone]
    rate = float(np.mean(rates))
    return [
        at_least(
            f"goodput at {FACTOR} x over goodput at capacity, mean (+- {half:.3f})", float(np.mean(ratios)), GOODPUT
        ),
        at_most(
            "accepted, p99, ms (goal: of what a full queue takes)",
            1e3 * quantile(accepted, 0.99),
            full_queue_ms(times, rate, service.cores),
            form=".1f",
        ),
        at_most("answered neither 200 nor 503", lost, 0, form=".0f"),
        at_most(f"/livez meanwhile, p99 of {len(probed)}, ms", 1e3 * quantile(probed, 0.99), PROBE_MS, form=".1f"),
    ]


def full_queue_ms(times: Sequence[float], rate: float, cores: int) -> float:
    """Return within what time 99 of 100 requests are answered that find one place left in the queue.

    Before it is answered, those ahead of it have been, what runs, and it itself: a sum of as many service times, drawn
    from those that were measured by themselves and stretched to `rate` answers a second.
    """
    sums = np.random.default_rng(0).choice(times, (20_000, QUEUE // cores + 2)).sum(axis=1)
    return quantile(sums * (1e3 * cores / rate / np.mean(times)), 0.99)


def share(service: Service, seconds: float) -> list[Row]:
    """Flood the service with one key while another requests more than its part."""
    connections = service.cores + QUEUE // 2
    capacity = goodput(without_pause(service.port, service.requests(), connections, seconds), seconds)
    flood = (service.port, service.requests("flood"), FACTOR * capacity, seconds)
    with beside(at_rate, *flood) as answers:
        asked = without_pause(service.port, service.requests(), connections // 2, seconds)
        flooded = answers()
    refused = sum(a.status == 429 for a in flooded)
    return [
        at_least(
            "a key's goodput next to a flood, over half the capacity", goodput(asked, seconds) / (0.5 * capacity), SHARE
        ),
        at_most("refusals of that key", sum(a.status != 200 for a in asked), 0, form=".0f"),
        Row(
            "the flood: asked, answered, told 429",
            f"{len(flooded)}, {sum(a.status == 200 for a in flooded)}, {refused}",
        ),
    ]


def large(service: Service, rounds: int) -> list[Row]:
    """Store maps of 16 MB, search in them, and send them along, while probes and small requests come."""
    begins = np.random.default_rng(0).uniform(0.0, 1e3, (LARGE_SEGMENTS, 2))
    ends = begins + np.random.default_rng(1).uniform(-1.0, 1.0, (LARGE_SEGMENTS, 2))
    rows = orjson.dumps(np.hstack([begins, ends]), option=orjson.OPT_SERIALIZE_NUMPY)
    size = len(rows) / 1e6
    scan = b'"scan": {"segments": [[0.0, 1.0, 5.0, 1.0], [5.0, 1.0, 5.0, 4.0]]}}'
    statuses: list[int] = []
    seconds = 12.0 * rounds
    probes = (service.port, [request_of("/livez")], PROBES, seconds)
    with beside(at_rate, *probes) as answers, highest(service.memory_mb) as most:
        end = time.monotonic() + seconds
        number = 0
        while time.monotonic() < end:
            number += 1
            # Each time another map, so that none of it is in the cache.
            document = b'{"sigma": %f, "segments": ' % (1e-6 * number) + rows
            inline = document.replace(b'"sigma"', b'"frame_id": "inline", "sigma"') + b"}"
            statuses.append(service.call("PUT", "/v1/maps/large", document + b"}"))
            statuses.append(service.call("POST", "/v1/associate", b'{"map": {"map_id": "large"}, ' + scan))
            statuses.append(service.call("POST", "/v1/associate", b'{"map": ' + inline + b", " + scan))
        probed = [a.seconds for a in answers()]
    time.sleep(IDLE_S)
    return [
        Row(f"maps of {size:.1f} MB stored, searched, sent along", f"{len(statuses)} requests in {seconds:.0f} s"),
        at_most("not answered with 2xx", sum(not 200 <= status < 300 for status in statuses), 0, form=".0f"),
        at_most(f"/livez meanwhile, p99 of {len(probed)}, ms", 1e3 * quantile(probed, 0.99), PROBE_MS, form=".1f"),
        Row("/livez meanwhile, longest, ms", f"{1e3 * max(probed):.1f}"),
        Row("after the start, MB", f"{service.started_mb:.0f}"),
        Row("with a map of 200,000 segments in the cache, MB", f"{service.memory_mb():.0f}"),
        at_most("while another such map is read and indexed, MB", max(most), MEMORY_MB, form=".0f"),
    ]


def family(pid: int) -> Iterator[int]:
    """Yield a process and its descendants, as far as they are still there."""
    yield pid
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            with suppress(OSError):  # a thread that has just ended
                for child in (task / "children").read_text().split():
                    yield from family(int(child))


def _resident(pid: int) -> float:
    """Return a process's memory, bytes; 0 of one that has just ended."""
    with suppress(OSError):
        return float(int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
    return 0.0


@contextmanager
def highest(read: Callable[[], float]) -> Iterator[list[float]]:
    """Read a number every 20 ms meanwhile; what is given is the list of them."""
    found = [read()]
    over = threading.Event()

    def watch() -> None:
        while not over.wait(0.02):
            found.append(read())

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield found
    finally:
        over.set()
        thread.join()


@contextmanager
def loaded_service() -> Iterator[Service]:
    """Start a service on the first half of the cores; this process and its children keep to the others."""
    all_cores = sorted(os.sched_getaffinity(0))
    its, ours = all_cores[: max(1, len(all_cores) // 2)], all_cores[len(all_cores) // 2 :]
    os.sched_setaffinity(0, its)
    settings = {"keys": "robot,flood", "searches": len(its), "queue": QUEUE}
    with running_service(**settings) as (url, pid):
        os.sched_setaffinity(0, ours or its)
        print(f"{machine()}; service on core {its}, clients on core {ours}; load {os.getloadavg()[0]:.1f} at the start")
        yield Service(url, pid, len(its))
    os.sched_setaffinity(0, all_cores)


def load(quick: int) -> list[Row]:
    """Print the tables, and return their rows."""
    found: list[Row] = []

    def told(title: str, rows: list[Row]) -> None:
        print_rows(title, rows)
        found.extend(rows)

    with loaded_service() as service:
        told("Ten times too much", overload(service, max(2, PAIRS // quick), SECONDS))
        told("One key's flood", share(service, 2 * SECONDS))
    with loaded_service() as service:
        told("Large maps", large(service, 3))
    print(f"\nload {os.getloadavg()[0]:.1f} at the end")
    return found
