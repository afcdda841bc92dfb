"""HTTPS without a proxy, with a certificate of an authority that the test makes."""

from __future__ import annotations

import ssl
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
import trustme

from linefix.documents import examples
from service.settings import SettingsError, read_settings
from tests.running import JSON, RunningService, until


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
