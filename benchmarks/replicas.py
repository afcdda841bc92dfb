"""Replicas over one database, behind nginx, by turns or by a hash of the map: ``python -m benchmarks replicas``.

Few maps, which each replica holds indexed, and more of them than one holds but three hold together. The id of a map is
in the body, where a proxy does not look: clients repeat it in the header ``X-Map-Id``.
"""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import orjson
import psycopg

from examples.running import free_port, running_service
from registration import Segments

from .growth import campus, draw_query
from .open_loop import beside, request_of, without_pause
from .table import Row, print_rows, quantile

COUNT = 3
SEGMENTS = 2_000  # of a map
FEW, MANY = 4, 24  # maps
HELD = 9  # that one replica holds: three hold them all
INDEXED_BYTES = 4_300_000  # of one map of this size
CONNECTIONS = 6
SECONDS = 10.0
SEED = 20190901
SERVER = os.environ.get("LINEFIX_TEST_POSTGRESQL", "postgresql://postgres@127.0.0.1:5432/test")

CONF = """
daemon off;
worker_processes 1;
pid {folder}/nginx.pid;
error_log {folder}/error.log error;
events {{ worker_connections 512; }}
http {{
  access_log off;
  client_body_temp_path {folder}/body;
  proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi;
  scgi_temp_path {folder}/scgi;
  {parts}
}}
"""
PART = """
  upstream {name} {{ {hashed} {servers} keepalive 16; }}
  server {{
    listen 127.0.0.1:{port};
    client_max_body_size 32m;
    location / {{
      proxy_pass http://{name};
      proxy_http_version 1.1;
      proxy_set_header Connection "";
      proxy_set_header Host $host;
    }}
  }}
"""


@dataclass(frozen=True, slots=True)
class Way:
    """Through the proxy to some of the replicas."""

    replicas: int
    hashed: bool
    port: int

    @property
    def name(self) -> str:
        """Its name in the proxy's settings."""
        return f"ways{self.replicas}{'h' if self.hashed else ''}"


def replicas(quick: int) -> list[Row]:
    """Measure rates and p99 of 1, 2 and 3 replicas."""
    nginx = shutil.which("nginx", path="/usr/sbin:/usr/bin:/usr/local/bin")
    if nginx is None:
        print("\nReplicas: no nginx is here.")
        return []
    segments = campus(SEGMENTS)
    rows: list[Row] = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        settings = {"database_url": stack.enter_context(postgresql_schema()), "cache_bytes": HELD * INDEXED_BYTES}
        urls = [stack.enter_context(running_service(**settings, searches=1, queue=64))[0] for _ in range(COUNT)]
        _put_maps(urls[0], segments)
        ways = [Way(count, hashed, free_port()) for count in range(1, COUNT + 1) for hashed in (False, True)[:count]]
        stack.enter_context(_proxy(nginx, folder, ways, urls))
        for maps in (FEW, MANY):
            asked = _requests(segments, maps)
            rows += [_measured(way, urls, maps, asked, SECONDS / quick) for way in ways]
    print_rows(f"Replicas of one core each, maps of {SEGMENTS:,} segments, each holds {HELD}", rows)
    return rows


def _measured(way: Way, urls: Sequence[str], maps: int, asked: list[bytes], seconds: float) -> Row:
    for _ in range(2):
        without_pause(way.port, asked[:maps], 1, 0.1 * seconds)
    before = [_misses(url) for url in urls]
    with beside(without_pause, way.port, asked, CONNECTIONS, seconds) as answers:
        found = answers()
    misses = sum(_misses(url) - one for url, one in zip(urls, before, strict=True))
    times = [1e3 * one.seconds for one in found if one.status == 200]
    failed = len(found) - len(times)
    told = f"{len(times) / seconds:.0f}/s, p99 {quantile(times, 0.99):.0f} ms, "
    told += f"{misses / max(1, len(found)):.1%} indexed again" + (f", {failed} FAILED" if failed else "")
    return Row(f"{maps} maps, {way.replicas} replicas{', hashed' if way.hashed else ''}", told)


def _requests(segments: Segments, maps: int) -> list[bytes]:
    """Return requests by turns that cannot be foreseen; each names its map in a header, too."""
    rng = np.random.default_rng(SEED)
    scans = [draw_query(segments, rng)[1].endpoints.tolist() for _ in range(16)]
    made = []
    for number in rng.integers(maps, size=480).tolist():
        body = orjson.dumps({"map": {"map_id": f"m{number}"}, "scan": {"segments": scans[rng.integers(len(scans))]}})
        whole = request_of("/v1/associate", body)
        made.append(whole.replace(b"\r\n", f"\r\nX-Map-Id: m{number}\r\n".encode(), 1))
    return made


def _put_maps(url: str, segments: Segments) -> None:
    for number in range(MANY):
        body = orjson.dumps({"segments": segments.endpoints.tolist(), "meta": number})
        head = {"Content-Type": "application/json"}
        request = urllib.request.Request(f"{url}/v1/maps/m{number}", body, head, method="PUT")
        with urllib.request.urlopen(request, timeout=60):
            pass


def _misses(url: str) -> float:
    time.sleep(0.25)  # they are counted again five times a second
    with urllib.request.urlopen(f"{url}/metrics", timeout=30) as answer:
        lines = answer.read().decode().splitlines()
    return float(next((line.split()[1] for line in lines if line.startswith("linefix_map_cache_misses_total ")), 0.0))


@contextmanager
def _proxy(nginx: str, folder: Path, ways: list[Way], urls: Sequence[str]) -> Iterator[None]:
    parts = []
    for way in ways:
        servers = " ".join(f"server {url.removeprefix('http://')} max_fails=0;" for url in urls[: way.replicas])
        hashed = "hash $http_x_map_id consistent;" if way.hashed else ""
        parts.append(PART.format(name=way.name, hashed=hashed, servers=servers, port=way.port))
    conf = folder / "nginx.conf"
    conf.write_text(CONF.format(folder=folder, parts="".join(parts)))
    process = subprocess.Popen([nginx, "-c", str(conf), "-p", str(folder), "-e", str(folder / "error.log")])
    try:
        give_up = time.monotonic() + 20.0
        while time.monotonic() < give_up:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", ways[-1].port)) == 0:
                    break
            time.sleep(0.05)
        yield
    finally:
        process.terminate()
        process.wait(20)


@contextmanager
def postgresql_schema() -> Iterator[str]:
    """Give the URL of an empty schema, which is dropped afterwards."""
    name = f"linefix_bench_{secrets.token_hex(6)}"
    with psycopg.connect(SERVER, autocommit=True, connect_timeout=3) as connection:
        connection.execute(f"CREATE SCHEMA {name}".encode())
        try:
            yield f"{SERVER}?options=-csearch_path%3D{name}"
        finally:
            connection.execute(f"DROP SCHEMA {name} CASCADE".encode())
