"""Keys over HTTP: what requests one, and what is stated to whom."""

from __future__ import annotations

import pytest

from tests.running import RunningService


def test_probes_and_pages_ask_for_no_key(guarded: RunningService) -> None:
    for path in ("/livez", "/readyz", "/metrics", "/version", "/docs", "/openapi.json", "/"):
        assert guarded.client.get(path).status_code == 200, path


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/v1/limits"),
        ("POST", "/v1/associate"),
        ("PUT", "/v1/maps/m"),
        ("POST", "/v1/nothing"),
        ("GET", "/%76%31/limits"),  # the same path in other letters
        ("HEAD", "/v1/maps"),
    ],
)
def test_everything_under_v1_asks_for_one(guarded: RunningService, method: str, path: str) -> None:
    body = {} if method in ("GET", "HEAD") else {"content": b"x" * 100_000}
    none = guarded.client.request(method, path, **body)  # type: ignore[arg-type]
    assert none.status_code == 401
    assert none.headers["www-authenticate"] == 'Bearer realm="linefix"'
    wrong = guarded.client.request(method, path, headers={"authorization": "Bearer sesam"}, **body)  # type: ignore[arg-type]
    assert (wrong.status_code, "www-authenticate" in wrong.headers) == (403, False)
    if method != "HEAD":
        assert (none.json()["code"], wrong.json()["code"]) == ("unauthorized", "forbidden")
