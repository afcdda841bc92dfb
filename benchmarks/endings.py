"""The time until things end that have to: ``python -m benchmarks.endings``.

A client that hangs up, one that is slow in the head, in the body, in both, or in reading; a worker that is killed; and
the service when it is reported to end while it searches.
"""

from __future__ import annotations

import http.client
import math
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import numpy as np
import orjson

from examples.running import running_service
from linefix.documents import examples

from .open_loop import request_of
from .siege import parallel_walls
from .table import Row, at_most, machine, print_rows

HANG_UP_MS, SLOW_S, REPLACED_S, DRAINED_S = 250.0, 10.0, 3.0, 10.0
TRIES = 10
HEAVY = 199_000  # segments of a large map
HEAD = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 5000\r\n"


def heavy(seed: int) -> bytes:
    """Return a request that takes a second or so: a large map, which has to be indexed."""
    begins = np.random.default_rng(seed).uniform(0.0, 1e3, (HEAVY, 2))
    body = {
        "map": {"segments": np.hstack([begins, begins + np.array([1.0, 0.1])])},
        "scan": {"segments": examples.SEEN},
    }
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)


def long_search() -> bytes:
    """Return a request whose search takes all of its deadline, a second."""
    return orjson.dumps({**orjson.loads(parallel_walls()), "options": {"deadline_ms": 1000}})


def ask(port: int, body: bytes) -> int:
    """Return the status of an association, 0 when the connection broke."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request("POST", "/v1/associate", body, {"Content-Type": "application/json"})
        return connection.getresponse().status
    except (OSError, http.client.HTTPException):
        return 0
    finally:
        connection.close()


def count(port: int, name: str) -> float:
    """Return one of the service's own counts; NaN if the worker that was to return it was killed meanwhile."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request("GET", "/metrics")
        lines = connection.getresponse().read().decode().splitlines()
    except (ConnectionError, http.client.HTTPException):
        return math.nan
    finally:
        connection.close()
    return next((float(line.split()[1]) for line in lines if line.startswith(name + " ")), 0.0)


def until(condition: Callable[[], bool], pause: float = 0.002) -> float:
    """Wait; return how long it took, seconds."""
    begun = time.monotonic()
    while not condition():
        time.sleep(pause)
    return time.monotonic() - begun


def hang_ups() -> list[Row]:
    """Hang up while waiting in the queue, and count until the place is free."""
    with running_service(searches=1, queue=1) as (url, _):
        port = int(url.rsplit(":", 1)[1])
        seconds = [_hang_up(port) for _ in range(TRIES)]
    found = [one for one in seconds if one is not None]
    return [
        at_most(f"a hang-up frees the place, longest of {len(found)}, ms", 1e3 * max(found), HANG_UP_MS, form=".0f")
    ]


def _hang_up(port: int) -> float | None:
    """Return how long it took, seconds; None when the turn came before."""
    busy = threading.Thread(target=ask, args=(port, long_search()))
    busy.start()
    until(lambda: count(port, "linefix_searches_running") == 1)
    with socket.create_connection(("127.0.0.1", port)) as waiting:
        waiting.sendall(request_of("/v1/associate", orjson.dumps(examples.ASSOCIATE)))
        until(lambda: count(port, "linefix_searches_waiting") == 1 or not busy.is_alive())
    taken = until(lambda: count(port, "linefix_searches_waiting") == 0)
    was_waiting = busy.is_alive()
    busy.join()
    return taken if was_waiting else None


def slow_clients() -> list[Row]:
    """Send a byte now and then, or read none, and count until the connection is closed."""
    trickles = {
        "nothing at all": [b""] * 40,
        "slow head": [HEAD] + [b"X-A: a\r\n"] * 40,
        "slow body": [HEAD + b"\r\n"] + [b" "] * 40,
        "slow head, then slow body": [HEAD] + [b"X-A: a\r\n"] * 12 + [b"\r\n"] + [b" "] * 40,
    }
    with running_service() as (url, _), ThreadPoolExecutor(8) as threads:
        port = int(url.rsplit(":", 1)[1])
        found = {name: threads.submit(_trickle, port, pieces) for name, pieces in trickles.items()}
        return [at_most(f"{name}: closed after, s", one.result(), SLOW_S, form=".1f") for name, one in found.items()]


def _trickle(port: int, pieces: list[bytes]) -> float:
    begun = time.monotonic()
    with socket.create_connection(("127.0.0.1", port), timeout=0.5) as connection:
        for piece in pieces:
            with suppress(ConnectionError):
                connection.sendall(piece)
            with suppress(TimeoutError, ConnectionError):
                while connection.recv(4096):
                    pass
                break
    return time.monotonic() - begun


def killed_workers() -> list[Row]:
    """Kill one of two workers, and time until two respond again; no request may be rejected meanwhile."""
    seconds: list[float] = []
    failed = asked = 0
    with running_service(workers=2, searches=2) as (url, pid):
        port = int(url.rsplit(":", 1)[1])
        for _ in range(TRIES):
            until(lambda: count(port, "linefix_workers_ready") == 2)
            os.kill(_newest_worker(pid), signal.SIGKILL)
            begun = time.monotonic()
            until(lambda: count(port, "linefix_workers_ready") < 2)
            while not count(port, "linefix_workers_ready") >= 2:
                asked += 1
                failed += ask(port, orjson.dumps(examples.ASSOCIATE)) != 200
                time.sleep(0.02)  # a robot's pace: who starts needs a processor
            seconds.append(time.monotonic() - begun)
            time.sleep(10.0)  # one that dies again at once is started again later
    return [
        at_most(f"a killed worker is replaced, longest of {TRIES}, s", max(seconds), REPLACED_S, form=".2f"),
        Row("the same, median, s", f"{np.median(seconds):.2f}"),
        Row(f"requests meanwhile on new connections, failed of {asked}", str(failed)),
    ]


def _newest_worker(pid: int) -> int:
    listed = subprocess.run(["ps", "-o", "pid=,args=", "--ppid", str(pid)], capture_output=True, text=True, check=True)
    return max(int(line.split()[0]) for line in listed.stdout.splitlines() if "spawn_main" in line)


def drains() -> list[Row]:
    """Tell a service to end while it searches, and count until it has."""
    seconds: list[float] = []
    statuses: list[int] = []
    lost = 0
    for number in range(TRIES):
        workers = 1 + number % 2
        with running_service(workers=workers, searches=2, drain_s=1) as (url, pid), ThreadPoolExecutor(4) as some:
            port = int(url.rsplit(":", 1)[1])
            asked = [some.submit(ask, port, heavy(seed=k)) for k in range(2)]
            time.sleep(0.5)
            begun = time.monotonic()
            os.kill(pid, signal.SIGTERM)
            lost += sum(one.result() != 200 for one in asked)
            _, status = os.waitpid(pid, 0)
            seconds.append(time.monotonic() - begun)
            statuses.append(os.waitstatus_to_exitcode(status))
    return [
        at_most(f"SIGTERM to exit, longest of {TRIES} (one worker and two), s", max(seconds), DRAINED_S, form=".1f"),
        at_most("exits with another status than 0", sum(map(bool, statuses)), 0, form=".0f"),
        at_most("requests that ran and were not answered with 200", lost, 0, form=".0f"),
    ]


def main() -> None:
    print(f"{machine()}; load {os.getloadavg()[0]:.1f} at the start")
    print_rows("Clients that leave or linger", hang_ups() + slow_clients())
    print_rows("Workers and the service", killed_workers() + drains())


if __name__ == "__main__":
    main()
