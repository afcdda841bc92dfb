"""Starts: modules that one loads, directories with which there is none, and HTTPS without a proxy."""

from __future__ import annotations

import json
import socket
import ssl
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
import trustme

from examples.running import free_port
from linefix.documents import examples
from service.settings import SettingsError, read_settings
from tests.running import JSON, RunningService, until

# Loaded by the first request that needs them.
LATER = ("cryptography", "ezdxf", "psycopg", "rosbags", "scipy.ndimage")
PROGRAM = f"""
import asyncio, gc, json, sys
from service.app import create_app
from service.settings import Settings

async def start(app):
    async with app.router.lifespan_context(app):
        while not app.state.services.readiness.warm:
            await asyncio.sleep(0.01)
        return {{"loaded": [name for name in {LATER} if name in sys.modules], "collects": gc.isenabled(),
                "frozen": gc.get_freeze_count() > 100_000}}

gc.disable()
print(json.dumps(asyncio.run(start(create_app(Settings(data_dir=sys.argv[1]))))))
"""


def test_a_start_loads_nothing_that_waits_and_then_collects_garbage(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, str(tmp_path)], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == {"loaded": [], "collects": True, "frozen": True}


def start(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "service", "--port", str(free_port()), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_a_port_in_use_ends_the_start_in_one_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        ended = start("--data-dir", str(tmp_path), "--port", str(port))
    assert ended.returncode == 1
    (line,) = ended.stderr.splitlines()
    assert f"cannot listen on 127.0.0.1, port {port}" in line
    assert "--port" in line


@pytest.mark.parametrize("place", ["file/maps", "/proc/self"], ids=["cannot be made", "nothing can be made in it"])
def test_a_directory_that_is_of_no_use_ends_the_start(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("")
    ended = start("--data-dir", str(tmp_path / place), "--workers", "2", "--searches", "2")
    assert ended.returncode == 1
    (line,) = ended.stderr.splitlines()
    assert str(tmp_path / place) in line
    assert "--data-dir" in line


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    return written(trustme.CA(), tmp_path, "own")


def written(authority: trustme.CA, folder: Path, name: str) -> tuple[Path, Path]:
    """Write a certificate for this machine, and its key."""
    made = authority.issue_cert("127.0.0.1")
    chain, key = folder / f"{name}.crt", folder / f"{name}.key"
    chain.write_bytes(b"".join(blob.bytes() for blob in made.cert_chain_pems))
    made.private_key_pem.write_to_path(str(key))
    return chain, key


@contextmanager
def trusting(authority: trustme.CA, url: str) -> Iterator[httpx.Client]:
    context = ssl.create_default_context()
    authority.configure_trust(context)
    with httpx.Client(base_url=url, verify=context, headers=JSON, timeout=60) as client:
        yield client


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.long)])
def test_it_speaks_https_alone(start_service: Callable[..., RunningService], tmp_path: Path, workers: int) -> None:
    authority = trustme.CA()
    chain, key = written(authority, tmp_path, "service")
    running = start_service(tls_cert=chain, tls_key=key, workers=workers, searches=2)
    with trusting(authority, running.url) as client:
        # Of several workers only the first is ready by now.
        until(lambda: client.post("/v1/associate", json=examples.ASSOCIATE).status_code == 200)
        large = {"segments": [[0.0, float(row), 10.0, float(row)] for row in range(20_000)]}
        assert client.put("/v1/maps/m", json=large).status_code == 201
        assert client.get("/v1/maps/m").json() == large
    with trusting(trustme.CA(), running.url) as client, pytest.raises(httpx.ConnectError, match="certificate"):
        client.get("/livez")
    with pytest.raises(httpx.TransportError):
        httpx.get(running.url.replace("https", "http") + "/livez")
    assert "a defect" not in running.log()


@pytest.mark.parametrize("wrong", ["no key", "no file", "another key", "no certificate"])
def test_what_nobody_could_be_shown_ends_the_start(
    files: tuple[Path, Path], tmp_path: Path, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    chain, key = files
    if wrong == "no file":
        key = tmp_path / "none"
    elif wrong == "another key":
        _, key = written(trustme.CA(), tmp_path, "other")
    elif wrong == "no certificate":
        chain.write_text("nothing")
    monkeypatch.setenv("LINEFIX_TLS_CERT", str(chain))
    if wrong != "no key":
        monkeypatch.setenv("LINEFIX_TLS_KEY", str(key))
    with pytest.raises(SettingsError, match="tls_cert, tls_key"):
        read_settings([])
