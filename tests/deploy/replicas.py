"""Replicas of the service over one database, behind nginx, each a process of its own."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import pytest

from examples.running import free_port
from tests.running import RunningService, answers, client_of, start, stop, until
from tests.service.conftest import empty_database
from tests.service.lines import Line

NGINX = shutil.which("nginx", path="/usr/sbin:/usr/bin:/usr/local/bin:/opt/homebrew/bin")

DEPLOY = Path(__file__).parents[2] / "deploy"


def changed(path: Path, folder: Path, changes: dict[str, str]) -> Path:
    """Write a file that is deployed into a folder, with the ports and files of a test."""
    text = path.read_text()
    for before, after in changes.items():
        assert before in text
        text = text.replace(before, after)
    (folder / path.name).write_text(text)
    return folder / path.name


def temporary(folder: Path) -> str:
    """Return where nginx has its files, without root."""
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    return "access_log off;\n" + "".join(f"{kind}_temp_path {folder}/{kind};\n" for kind in kinds)


@dataclass
class Replicas:
    """Three services, and what stands between them, their clients and their database."""

    services: list[RunningService]
    url: str
    line: Line
    settings: dict[str, object]
    client: httpx.Client = field(init=False)

    def __post_init__(self) -> None:
        self.client = client_of(self.url)

    def replace(self, number: int) -> None:
        """End a replica as a rolling update does, where it has not ended already; start another at its port."""
        old = self.services[number]
        stop(old)
        self.services[number] = start(old.data_dir, port=old.port, **self.settings)

    def kill(self, number: int) -> None:
        """End a replica with what it is at."""
        self.services[number].kill()


@contextmanager
def replicas(folder: Path, count: int = 3, **settings: object) -> Iterator[Replicas]:
    """Start them; skip where there is no nginx or no PostgreSQL."""
    if NGINX is None:
        pytest.skip("no nginx")
    with ExitStack() as stack:
        url = stack.enter_context(empty_database("postgresql", folder))
        line = stack.enter_context(Line.to(url))
        told = {"database_url": line.url, "drain_s": 1, **settings}
        places = [folder / f"replica-{number}" for number in range(count)]
        for place in places:
            place.mkdir()
        side_by_side = stack.enter_context(ThreadPoolExecutor(count))
        services = list(side_by_side.map(lambda place: start(place, **told), places))
        found = Replicas(services, stack.enter_context(_proxy(folder, services)), line, told)
        stack.callback(lambda: list(side_by_side.map(stop, found.services)))
        stack.callback(found.client.close)
        yield found


@contextmanager
def _proxy(folder: Path, services: list[RunningService]) -> Iterator[str]:
    port = free_port()
    # No replica is ever left out: if all answer 503, clients get this 503, not a 502.
    servers = " ".join(f"server 127.0.0.1:{one.port} max_fails=0;" for one in services)
    changes = {
        "worker_processes auto;": "daemon off;",
        "pid /tmp": f"pid {folder}",
        "access_log off;": temporary(folder),
        "resolver 127.0.0.11 valid=2s;": "",
        "server linefix:8000 resolve max_fails=0;": servers,
        "listen 80": f"listen 127.0.0.1:{port}",
    }
    conf = changed(DEPLOY / "replicas" / "nginx.conf", folder, changes)
    process = subprocess.Popen([str(NGINX), "-c", str(conf), "-p", str(folder), "-e", str(folder / "error.log")])
    try:
        url = f"http://127.0.0.1:{port}"
        with client_of(url) as client:
            until(lambda: answers(client))
        yield url
    finally:
        process.terminate()
        process.wait(20)
