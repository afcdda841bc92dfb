"""Probes, counts, pages; and what a service does that has no place left."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Callable
from pathlib import Path

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import RunningService, until


def test_probes_and_version(client: httpx.Client) -> None:
    assert client.get("/livez").json() == client.get("/readyz").json() == {"status": "ok"}
    assert client.get("/version").json()["name"] == "linefix"
    assert client.get("/v1/limits").json()["max_batch"] == 256


def test_pages_need_no_internet(client: httpx.Client) -> None:
    assert "/docs" in client.get("/").text
    page = client.get("/docs").text
    assert "http://" not in page
    assert "https://" not in page
    for name in ("swagger-ui-bundle.js", "swagger-ui.css", "favicon.png"):
        assert f"/docs/assets/{name}" in page
        assert client.get(f"/docs/assets/{name}").status_code == 200
    assert client.get("/docs/assets/..%2f..%2fcore.py").status_code == 404


def test_before_the_kernels_are_there_nothing_is_searched(
    start_service: Callable[..., RunningService], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LINEFIX_KERNELS", str(tmp_path / "kernels"))
    running = start_service(probe="/livez")

    def told(detail: str) -> bool:
        return re.fullmatch(detail, running.client.get("/readyz").json()["detail"]) is not None

    for path, body in (("/v1/associate", orjson.dumps(examples.ASSOCIATE)), ("/v1/register", b"not even read")):
        answer = running.client.post(path, content=body)
        assert (answer.status_code, answer.json()["code"], answer.headers["retry-after"]) == (503, "not_ready", "1")
    until(lambda: told("the kernels are being compiled, [1-9][0-9]?% so far; send the request again later"))
    until(lambda: '"message":"compiling","share":0.' in running.log())
    assert running.client.put("/v1/maps/m", json=examples.MAP).status_code == 201
    assert running.client.get("/v1/maps/m").json() == examples.MAP


def test_pages_run_nothing_but_their_own(client: httpx.Client) -> None:
    for path in ("/", "/docs"):
        headers = client.get(path).headers
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy
        assert "'unsafe-inline'" not in policy.partition("style-src")[0]
        assert (headers["x-frame-options"], headers["referrer-policy"]) == ("DENY", "no-referrer")
        scripts = re.findall(r"<script>(.*?)</script>", client.get(path).text, re.DOTALL)
        for script in scripts:
            digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
            assert f"script-src 'self' 'sha256-{digest}';" in policy
    assert len(scripts) == 1
    for path in ("/livez", "/nothing", "/docs", "/v1/limits"):
        assert client.get(path).headers["x-content-type-options"] == "nosniff"
