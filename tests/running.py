"""A service in a process of its own, for the tests that talk to one."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from examples.running import free_port

START_SECONDS = 150.0  # the first start may have to compile every kernel
JSON = {"content-type": "application/json"}
PATIENCE = 60.0  # s for what has to come about


@dataclass(frozen=True)
class RunningService:
    """A service in a process of its own, on a loopback port."""

    url: str
    port: int
    data_dir: Path
    process: subprocess.Popen[bytes]
    client: httpx.Client

    def log(self) -> str:
        return (self.data_dir / "log").read_text()

    def count(self, line: str) -> float:
        """Return one of the service's own counts, 0 where it has none."""
        return self.counts(line)[0]

    def counts(self, *lines: str) -> tuple[float, ...]:
        """Return several of them as they were at one time."""
        told = dict(row.rsplit(" ", 1) for row in self.client.get("/metrics").text.splitlines() if row)
        return tuple(float(told.get(line, 0.0)) for line in lines)

    def ended(self) -> int:
        """Wait until it has ended; return its exit status."""
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"does not end: {self.log()}") from None

    def kill(self) -> None:
        """Kill all of its processes, as a machine does that goes down."""
        for pid in family_of(self.process.pid):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()

    def memory_mb(self) -> float:
        """Return what the service and its processes hold now, MB."""
        return sum(_status(pid, "VmRSS") for pid in family_of(self.process.pid))

    @contextmanager
    def peak_mb(self) -> Iterator[Callable[[], float]]:
        """Watch from here on what each of its processes has held at most; what is given returns their sum, MB."""
        pids = family_of(self.process.pid)
        for pid in pids:
            Path(f"/proc/{pid}/clear_refs").write_text("5")
        yield lambda: sum(_status(pid, "VmHWM") for pid in pids)

    @contextmanager
    def connection(self, timeout: float = 20.0, source: str = "127.0.0.1") -> Iterator[socket.socket]:
        """Talk to the service below HTTP."""
        with socket.create_connection(("127.0.0.1", self.port), timeout, (source, 0)) as connection:
            yield connection

    def talk(self, *pieces: bytes, pause: float = 0.0, end: bool = False) -> bytes:
        """Send pieces below HTTP; return everything that is answered until the service closes the connection."""
        answer = b""
        with self.connection(PATIENCE) as connection, suppress(ConnectionError):
            with suppress(ConnectionError):
                for piece in pieces:
                    connection.sendall(piece)
                    time.sleep(pause)
                if end:
                    connection.shutdown(socket.SHUT_WR)
            while part := connection.recv(65_536):
                answer += part
        return answer

    @contextmanager
    def grows_by_less_than(self, megabytes: float) -> Iterator[None]:
        """Fail where its processes together have held more than so much more within the block."""
        with self.peak_mb() as peak:
            before = self.memory_mb()
            yield
            assert peak() - before < megabytes


def client_of(url: str, timeout: float = PATIENCE, **headers: str) -> httpx.Client:
    """Return a client with connections of its own.

    It looks at no certificates: to load those of the system takes 20 ms of a processor for each client.
    """
    return httpx.Client(base_url=url, timeout=timeout, headers=JSON | headers, verify=False)


def start(data_dir: Path, *, probe: str = "/readyz", port: int | None = None, **settings: object) -> RunningService:
    port = port or free_port()
    kept = {name: value for name, value in os.environ.items() if not name.startswith("LINEFIX_")}
    environment = kept | {name: os.environ[name] for name in ("LINEFIX_KERNELS",) if name in os.environ}
    environment |= {f"LINEFIX_{name.upper()}": str(value) for name, value in settings.items()}
    command = [sys.executable, "-m", "service", "--port", str(port), "--data-dir", str(data_dir)]
    with (data_dir / "log").open("ab") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    url = f"{'https' if 'tls_cert' in settings else 'http'}://127.0.0.1:{port}"
    service = RunningService(url, port, data_dir, process, client_of(url))
    give_up = time.monotonic() + START_SECONDS
    while time.monotonic() < give_up:
        if process.poll() is not None:
            raise RuntimeError(f"the service ended with {process.returncode}: {service.log()}")
        if answers(service.client, probe):
            return service
        time.sleep(0.02)
    stop(service)
    raise RuntimeError(f"the service did not become ready: {service.log()}")


def answers(client: httpx.Client, probe: str = "/livez") -> bool:
    with suppress(httpx.TransportError):
        return client.get(probe).status_code == 200
    return False


def stop(service: RunningService) -> None:
    service.client.close()
    if service.process.poll() is None:
        service.process.send_signal(signal.SIGTERM)
        try:
            service.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            service.process.kill()
            service.process.wait()
            raise


@contextmanager
def running(data_dir: Path, **settings: Any) -> Iterator[RunningService]:
    """Start a service that ends with the block."""
    service = start(data_dir, **{"drain_s": 0, **settings})
    try:
        yield service
    finally:
        stop(service)


def until(condition: Callable[[], bool], patience: float = PATIENCE) -> None:
    give_up = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < give_up, "did not come about"
        time.sleep(0.01)


@contextmanager
def asked_again(count: int, ask: Callable[[], object]) -> Iterator[None]:
    """Have so many threads call a function again and again, for as long as the block takes."""
    enough = threading.Event()

    def repeat() -> None:
        while not enough.is_set():
            ask()

    with ThreadPoolExecutor(count) as threads:
        asked = [threads.submit(repeat) for _ in range(count)]
        try:
            yield
        finally:
            enough.set()
    for one in asked:
        one.result()


@contextmanager
def sending(*answers: bytes, piece: bytes = b"") -> Iterator[tuple[str, list[bytes]]]:
    """Answer requests one after the other as these bytes say, the last again and again; give the URL and the requests.

    After an answer pieces are sent until the other side closes.
    """
    ended, asked = threading.Event(), list[bytes]()

    def serve(listener: socket.socket) -> None:
        with suppress(OSError):
            while not ended.is_set():
                connection, _ = listener.accept()
                with connection, suppress(OSError):
                    asked.append(connection.recv(65_536))
                    connection.sendall(answers[min(len(asked), len(answers)) - 1])
                    while piece and not ended.is_set():
                        connection.sendall(piece)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, args=(listener,))
        thread.start()
        try:
            yield f"http://127.0.0.1:{listener.getsockname()[1]}", asked
        finally:
            ended.set()
            with suppress(OSError):
                listener.shutdown(socket.SHUT_RDWR)
            thread.join()


def children_of(pid: int) -> set[int]:
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return {int(child) for task in tasks for child in (task / "children").read_text().split()}


def family_of(pid: int) -> list[int]:
    return [pid, *(one for child in children_of(pid) for one in family_of(child))]


def _status(pid: int, name: str) -> float:
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return next((int(line.split()[1]) / 1e3 for line in lines if line.startswith(f"{name}:")), 0.0)


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
