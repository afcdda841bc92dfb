"""The cost of a request without its search: ``python -m benchmarks request``.

Processor time by part, what a client sees that asks one request after the other, and requests per second, all next to a
bare route of the same server that answers a constant. The turns of what is compared alternate.
"""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import httpx
import numpy as np
import orjson

from association import Deadline
from examples.running import free_port, running_service
from linefix.documents.encoding import encode
from linefix.documents.reading import read_model
from linefix.documents.requests import AssociateRequest
from linefix.operations import Stopwatch, Target
from service.database_location import database_url
from service.maps import IndexCache, MapOutline, MapStore
from service.maps.lookup import FoundMaps, MapLookup
from service.parsing.child import Child
from service.settings import Settings
from service.telemetry.metrics import Metrics
from service.work.results import Associator

from .load import family
from .open_loop import request_of, without_pause
from .table import Row, at_most, print_rows, print_table

ROUNDS = 15
CALLS = 100  # of each part in a round
BESIDE_MS, CLIENT_MS = 0.7, 1.3  # goals: of the processor, and as a client sees it
BARE = """
import sys, uvicorn
ANSWER = b'{"status":"ok"}'
HEADERS = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(ANSWER))]
async def answer(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": HEADERS})
    await send({"type": "http.response.body", "body": ANSWER})
how = dict(loop="uvloop", http="h11", ws="none", lifespan="off", log_level="error", access_log=False)
uvicorn.run(answer, port=int(sys.argv[1]), proxy_headers=False, **how)
"""


@dataclass(frozen=True, slots=True)
class Served:
    """A service process, and a request that is sent to it repeatedly."""

    port: int
    pid: int
    request: bytes

    def cost(self, seconds: float) -> tuple[float, float]:
        """Return the processor time of one request, and how long a client waits for it, milliseconds."""
        before = _processor_seconds(self.pid)
        answered = without_pause(self.port, [self.request], 1, seconds)
        spent = _processor_seconds(self.pid) - before
        assert all(answer.status == 200 for answer in answered)
        return 1e3 * spent / len(answered), 1e3 * median(answer.seconds for answer in answered)

    def rate(self, connections: int, seconds: float) -> float:
        """Return how many requests are answered in a second of one core's time."""
        before = _processor_seconds(self.pid)
        answered = without_pause(self.port, [self.request], connections, seconds)
        return len(answered) / (_processor_seconds(self.pid) - before)


@dataclass(frozen=True, slots=True)
class Asked:
    """A stored map, a request that names it, and one that brings nothing to search for, as they are sent."""

    map: bytes
    request: bytes
    nothing: bytes


def request(quick: int) -> list[Row]:
    """Measure, and print the tables."""
    seconds, rounds = 1.0, max(3, ROUNDS // quick)
    asked = asked_of(np.random.default_rng(0))
    with ExitStack() as stack:
        url, pid = stack.enter_context(running_service(searches=2))
        port = int(url.rsplit(":", 1)[1])
        httpx.put(f"{url}/v1/maps/m", content=asked.map, timeout=60).raise_for_status()
        servers = {
            "a bare route": stack.enter_context(bare()),
            "a probe (/livez)": Served(port, pid, request_of("/livez")),
            "a stored map, no walls seen": Served(port, pid, request_of("/v1/associate", asked.nothing)),
            "a stored map, 25 walls seen": Served(port, pid, request_of("/v1/associate", asked.request)),
        }
        parts = stack.enter_context(parts_of(asked))
        costs: dict[str, list[tuple[float, float]]] = {name: [] for name in servers}
        spent: dict[str, list[float]] = {name: [] for name in parts}
        for server in servers.values():
            server.cost(seconds)
        for _ in range(rounds):
            for name, server in servers.items():
                costs[name].append(server.cost(seconds))
            # By turns, as in a request: of one part in a row, each call would find the processor's caches filled.
            for name, call in CALLS * [*parts.items()]:
                spent[name].append(_thread_ms(call))
        rates = {(name, many): server.rate(many, 3.0) for many in (1, 2, 4) for name, server in servers.items()}
    cost = {name: (median(one for one, _ in got), median(seen for _, seen in got)) for name, got in costs.items()}
    each = {name: median(times) for name, times in spent.items()}
    bare_ms, _ = cost["a bare route"]
    print_table(
        "A request: processor time of the service, and what a client sees that asks one after the other",
        ("request", "processor ms", "client ms", "times a bare route"),
        [(name, f"{one:.3f}", f"{seen:.3f}", f"{one / bare_ms:.1f}") for name, (one, seen) in cost.items()],
    )
    print_table(
        "Requests a second of one core's time",
        ("connections", *servers),
        [(str(many), *(f"{rates[name, many]:.0f}" for name in servers)) for many in (1, 2, 4)],
    )
    return [*_by_part(cost, each), *_as_measured(cost, rates)]


def _as_measured(cost: dict[str, tuple[float, float]], rates: dict[tuple[str, int], float]) -> list[Row]:
    """Return the figures of both tables as rows without goals, for the file of results."""
    what = "a stored map, 25 walls seen"
    rows = [Row(f"{name}: processor ms", f"{one:.3f}") for name, (one, _) in cost.items()]
    rows += [Row(f"{name}: client ms", f"{seen:.3f}") for name, (_, seen) in cost.items()]
    counts = [many for name, many in rates if name == what]
    told = "{} connections: requests a second of one core, " + what
    return rows + [Row(told.format(many), f"{rates[what, many]:.0f}") for many in counts]


def _by_part(cost: dict[str, tuple[float, float]], each: dict[str, float]) -> list[Row]:
    """Print what a request for a stored map costs without its search, by part."""
    whole, seen = cost["a stored map, no walls seen"]
    layers, _ = cost["a probe (/livez)"]
    # The time of an empty search is not a part; the other request reads and writes 25 walls in addition.
    more = each["parsing and checking"] + each["encoding"] - each.pop("an empty search")
    shown = {"server, framework, admission, log (a probe)": layers} | each
    beside = whole + more
    shown["hand-over between threads, and what is left"] = beside - sum(shown.values())
    print_table(
        "By part, next to the search",
        ("part", "processor ms", "share"),
        [(name, f"{ms:.3f}", f"{100 * ms / beside:.0f} %") for name, ms in {**shown, "together": beside}.items()],
    )
    rows = [
        at_most("without its search, processor ms", beside, BESIDE_MS),
        at_most("without its search, times a bare route", beside / cost["a bare route"][0]),
        at_most("as a client sees it, its search left out, ms", seen + more, CLIENT_MS),
    ]
    print_rows("A request for a stored map", rows)
    return rows


def asked_of(rng: np.random.Generator) -> Asked:
    """Return a room of 25 walls, and all of them as a robot in its middle sees them."""
    angles = np.sort(rng.uniform(-np.pi, np.pi, 25))
    corners = rng.uniform(3.0, 8.0, 25)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    walls = np.hstack([corners, np.roll(corners, -1, axis=0)])
    seen = (walls + rng.normal(0.0, 0.005, walls.shape)).tolist()
    return Asked(orjson.dumps({"segments": walls.tolist()}), _request_for(seen), _request_for([]))


def _request_for(segments: list[list[float]]) -> bytes:
    return orjson.dumps({"map": {"map_id": "m"}, "scan": {"segments": segments, "sigma": 0.02}})


@contextmanager
def parts_of(asked: Asked) -> Iterator[dict[str, Callable[[], object]]]:
    """Give what is done for the request, one part after the other, as functions to be called again and again."""
    limits, deadline = Settings().limits(), Deadline()
    with TemporaryDirectory() as folder:
        store = MapStore(database_url(f"sqlite:///{folder}/maps.sqlite3"))
        store.put("m", asked.map, MapOutline(1, 0, (0.0, 0.0, 1.0, 1.0)))
        lookup = MapLookup(IndexCache(100_000_000, Metrics()), store, Child())
        associator = Associator(Metrics())
        wanted, empty = (read_model(AssociateRequest, body, limits) for body in (asked.request, asked.nothing))
        stored = store.load("m")
        found = FoundMaps({None: stored.record}, stored.document)
        ready = lookup.indexed(found, oriented=None, deadline=deadline)
        target = Target(ready.maps, found.references)
        answer = associator.find(target, wanted, wanted.options, deadline, Stopwatch())
        yield {
            "parsing and checking": partial(read_model, AssociateRequest, asked.request, limits),
            "look-up of the map": partial(store.record_at_once, "m"),
            "encoding": partial(encode, answer),
            "an empty search": partial(associator.find, target, empty, empty.options, deadline, Stopwatch()),
        }
        store.close()


@contextmanager
def bare() -> Iterator[Served]:
    """Give a route of the same server that answers a constant, without application."""
    port = free_port()
    with subprocess.Popen([sys.executable, "-c", BARE, str(port)]) as process:
        try:
            for _ in range(600):
                with socket.socket() as probe:
                    if probe.connect_ex(("127.0.0.1", port)) == 0:
                        break
                time.sleep(0.05)
            yield Served(port, process.pid, request_of("/"))
        finally:
            process.terminate()


def _thread_ms(call: Callable[[], object]) -> float:
    before = time.thread_time()
    call()
    return 1e3 * (time.thread_time() - before)


def _processor_seconds(pid: int) -> float:
    """Return what all threads of a process, and of those below it, have had of the processors."""
    seconds = 0.0
    for task in (task for one in family(pid) for task in Path(f"/proc/{one}/task").iterdir()):
        with suppress(OSError):  # a thread that has just ended
            seconds += 1e-9 * int((task / "schedstat").read_text().split()[0])
    return seconds
