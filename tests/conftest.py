"""The running service that the HTTP tests talk to."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

START_SECONDS = 120.0  # the first start may have to compile every kernel
STOP_SECONDS = 15.0


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--soak-minutes", type=float, default=30.0, help="how long the mixed load of tests/faults lasts")


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


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def start(data_dir: Path, *, probe: str = "/readyz", **settings: object) -> RunningService:
    port = free_port()
    environment = {name: value for name, value in os.environ.items() if not name.startswith("LINEFIX_")}
    environment |= {f"LINEFIX_{name.upper()}": str(value) for name, value in settings.items()}
    command = [sys.executable, "-m", "service", "--port", str(port), "--data-dir", str(data_dir)]
    with (data_dir / "log").open("ab") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    url = f"http://127.0.0.1:{port}"
    service = RunningService(url, port, data_dir, process, httpx.Client(base_url=url, timeout=30.0))
    give_up = time.monotonic() + START_SECONDS
    while time.monotonic() < give_up:
        if process.poll() is not None:
            raise RuntimeError(f"the service ended with {process.returncode}: {service.log()}")
        try:
            if service.client.get(probe).status_code == 200:
                return service
        except httpx.TransportError:
            pass
        time.sleep(0.02)
    stop(service)
    raise RuntimeError(f"the service did not become ready: {service.log()}")


def stop(service: RunningService) -> None:
    service.client.close()
    if service.process.poll() is None:
        service.process.send_signal(signal.SIGTERM)
        try:
            service.process.wait(STOP_SECONDS)
        except subprocess.TimeoutExpired:
            service.process.kill()
            service.process.wait()
            raise


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """One service for all tests that leave it as it was."""
    running = start(tmp_path_factory.mktemp("service"), drain_seconds=0)
    yield running
    stop(running)


@pytest.fixture
def client(service: RunningService) -> httpx.Client:
    return service.client


@pytest.fixture
def start_service(tmp_path: Path) -> Iterator[Callable[..., RunningService]]:
    """Start services with settings of their own; they end with the test."""
    started: list[RunningService] = []

    def start_one(data_dir: Path = tmp_path, **settings: object) -> RunningService:
        running = start(data_dir, **{"drain_seconds": 0, **settings})
        started.append(running)
        return running

    yield start_one
    for running in started:
        stop(running)


@contextmanager
def raw_connection(service: RunningService) -> Iterator[socket.socket]:
    """Talk to the service below HTTP."""
    with socket.create_connection(("127.0.0.1", service.port), timeout=20.0) as connection:
        yield connection


@pytest.fixture
def connect(service: RunningService) -> Callable[[], object]:
    return lambda: raw_connection(service)
