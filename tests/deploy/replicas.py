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

# As deploy/replicas/nginx.conf has it, without root.
CONF = """
daemon off;
worker_processes 1;
pid {folder}/nginx.pid;
error_log {folder}/error.log warn;
events {{ worker_connections 512; }}
http {{
  access_log {folder}/access.log;
  client_body_temp_path {folder}/body;
  proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi;
  scgi_temp_path {folder}/scgi;
  upstream linefix {{
    {servers}
    keepalive 16;
  }}
  server {{
    listen 127.0.0.1:{port};
    client_max_body_size 32m;
    location / {{
      proxy_pass http://linefix;
      proxy_http_version 1.1;
      proxy_set_header Connection "";
      proxy_set_header Host $host;
      proxy_connect_timeout 1s;
      proxy_next_upstream error timeout http_503;
      proxy_next_upstream_tries 2;
    }}
  }}
}}
"""


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
    conf = folder / "nginx.conf"
    conf.write_text(CONF.format(folder=folder, servers=servers, port=port))
    process = subprocess.Popen([str(NGINX), "-c", str(conf), "-p", str(folder), "-e", str(folder / "error.log")])
    try:
        url = f"http://127.0.0.1:{port}"
        with client_of(url) as client:
            until(lambda: answers(client))
        yield url
    finally:
        process.terminate()
        process.wait(20)
