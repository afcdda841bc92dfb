"""Pages of other sites: none may ask but those that the operator names."""

from __future__ import annotations

from collections.abc import Callable

import httpx
import pytest

from linefix.documents import examples
from service.settings import SettingsError, read_settings
from tests.running import RunningService

PAGE, OTHER = "https://fleet.example", "https://evil.example"
ASKS = {"access-control-request-method": "POST", "access-control-request-headers": "authorization,content-type"}


def asked_first(client: httpx.Client, origin: str, path: str = "/v1/associate") -> httpx.Response:
    return client.options(path, headers={"origin": origin, **ASKS})


@pytest.mark.parametrize("keys", ["", "sesame"])
def test_a_named_page_may_ask(start_service: Callable[..., RunningService], keys: str) -> None:
    client = start_service(cors_origins=PAGE, keys=keys).client
    first = asked_first(client, PAGE)
    assert (first.status_code, first.headers["access-control-allow-origin"]) == (200, PAGE)
    assert "access-control-allow-credentials" not in first.headers
    bearer = {"authorization": f"Bearer {keys}"} if keys else {}
    from_page = {"origin": PAGE, "sec-fetch-site": "cross-site", **bearer}
    answer = client.post("/v1/associate", json=examples.ASSOCIATE, headers=from_page)
    assert (answer.status_code, answer.headers["access-control-allow-origin"]) == (200, PAGE)
    wrong = client.post("/v1/associate", json={}, headers=from_page)
    assert (wrong.status_code, wrong.headers["access-control-allow-origin"]) == (422, PAGE)
    if keys:  # what a page asks beforehand opens nothing
        assert client.post("/v1/associate", json=examples.ASSOCIATE, headers={"origin": PAGE}).status_code == 401
        assert client.options("/v1/associate", headers={"origin": PAGE}).status_code == 401
    for_other = asked_first(client, OTHER)
    assert not for_other.is_success
    assert "access-control-allow-origin" not in for_other.headers
    answer = client.post("/v1/associate", json=examples.ASSOCIATE, headers={"origin": OTHER, **bearer})
    assert "access-control-allow-origin" not in answer.headers
    assert answer.status_code == (200 if keys else 403)


def test_none_is_named_by_default(client: httpx.Client, guarded: RunningService) -> None:
    for asked in (client, guarded.client):
        answer = asked_first(asked, PAGE)
        assert answer.status_code in (401, 403)
        assert not any(name.startswith("access-control") for name in answer.headers)


@pytest.mark.parametrize(
    "origin", ["*", "fleet.example", "https://fleet.example/", "https://fleet.example/page", "null"]
)
def test_an_origin_is_named_as_a_browser_does(monkeypatch: pytest.MonkeyPatch, origin: str) -> None:
    monkeypatch.setenv("LINEFIX_CORS_ORIGINS", origin)
    with pytest.raises(SettingsError, match="cors_origins"):
        read_settings([])
