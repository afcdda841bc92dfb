"""Requests of web pages, by the browser of the service's user: none may ask but those that the operator names."""

from __future__ import annotations

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.issuing import ADMIN, PAGE, bearer
from tests.running import JSON, RunningService

MAP = orjson.dumps(examples.MAP)
OTHER = "https://evil.example"
CALLS = (
    "GET /v1/maps,PUT /v1/maps/m,DELETE /v1/maps/m,POST /v1/associate,POST /v1/maps:import,GET /metrics,GET /docs,GET /"
)
FOREIGN: dict[str, dict[str, str]] = {
    "a name of its own": {"host": "evil.example"},
    "a name of its own, and its page": {
        "host": "evil.example:8000", "origin": "http://evil.example:8000", "sec-fetch-site": "same-origin",
    },
    "another page": {"origin": "http://evil.example"},
    "a page of another port": {"host": "localhost:8000", "origin": "http://localhost:8001"},
    "no page": {"origin": "null"},
    "a page of a file": {"origin": "file://"},
    "another site": {"sec-fetch-site": "cross-site"},
    "another site, written otherwise": {"sec-fetch-site": "Cross-Site"},
}  # fmt: skip


@pytest.mark.parametrize("kind", FOREIGN)
def test_pages_of_others_may_do_nothing(client: httpx.Client, kind: str) -> None:
    for call in CALLS.split(","):
        method, path = call.split()
        answer = client.request(method, path, headers=FOREIGN[kind], content=MAP if method[0] == "P" else None)
        assert (answer.status_code, answer.json()["code"]) == (403, "forbidden"), call


HOSTS = [
    *("", ":8000", "evil.example:8000", "127.0.0.1.evil.example", "localhost.evil.example", "127.1", "0x7f000001"),
    *("2130706433", "localhost@evil.example", "evil.example@localhost:80:80", "localhost:80:80", "[::1", "[evil]"),
]
ORIGINS = [
    *("http://localhost", "http://127.0.0.1:8000", "http://localhost.evil.example:8000", "http://[", "", "file://"),
    "http://localhost:8000.evil.example",
]


def test_names_that_only_look_like_ours(client: httpx.Client) -> None:
    headers = [{"host": host} for host in HOSTS]
    headers += [{"host": "localhost:8000", "origin": origin} for origin in ORIGINS]
    for one in headers:
        assert client.get("/v1/limits", headers=one).status_code in (400, 403), one


OWN = ["127.0.0.1", "192.0.2.1:80", "[::1]", "[::1]:8000", "localhost", "LOCALHOST:8000", "localhost."]


@pytest.mark.parametrize("host", OWN)
def test_the_service_s_own_page_may_ask(client: httpx.Client, host: str) -> None:
    for site in ("same-origin", "none", "same-site"):
        page = {"host": host, "origin": f"http://{host}", "sec-fetch-site": site}
        for headers in ({"host": host}, page):
            assert client.get("/v1/limits", headers=headers).status_code == 200, headers


def test_names_are_said_in_the_settings(narrow: RunningService) -> None:
    for host, status in (("linefix:8000", 200), ("robots.example", 200), ("sub.robots.example", 403)):
        assert narrow.client.get("/v1/limits", headers={"host": host}).status_code == status
    page = {"host": "robots.example", "origin": "https://robots.example", "sec-fetch-site": "same-origin"}
    assert narrow.client.put("/v1/maps/m", content=MAP, headers=page).status_code == 201
    named = {"host": "evil.example", "origin": PAGE, "sec-fetch-site": "cross-site"}
    assert narrow.client.get("/v1/limits", headers=named).status_code == 403


def test_a_form_cannot_post(client: httpx.Client) -> None:
    """A browser asks before it sends JSON as such for the page of another; without a media type it does not."""
    body = orjson.dumps(examples.ASSOCIATE)
    for media_type in (None, "text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
        headers = {} if media_type is None else {"content-type": media_type}
        answer = httpx.post(f"{client.base_url}/v1/associate", content=body, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (415, "unsupported_media_type")
    assert client.post("/v1/associate", content=body, headers=JSON).status_code == 200


def test_with_keys_any_name_and_no_media_type_will_do(guarded: RunningService) -> None:
    headers = {"host": "linefix.example", "origin": "http://evil.example", "sec-fetch-site": "cross-site"}
    body = orjson.dumps(examples.ASSOCIATE)
    assert httpx.post(guarded.url + "/v1/associate", content=body, headers=headers | bearer(ADMIN)).status_code == 200


def asked_first(client: httpx.Client, origin: str) -> httpx.Response:
    asks = {"access-control-request-method": "POST", "access-control-request-headers": "authorization,content-type"}
    return client.options("/v1/associate", headers={"origin": origin, **asks})


@pytest.mark.parametrize("kind", ["narrow", "guarded"])
def test_a_named_page_may_ask(request: pytest.FixtureRequest, kind: str) -> None:
    client = request.getfixturevalue(kind).client
    keys = bearer(ADMIN) if kind == "guarded" else {}
    first = asked_first(client, PAGE)
    assert (first.status_code, first.headers["access-control-allow-origin"]) == (200, PAGE)
    assert "access-control-allow-credentials" not in first.headers
    from_page = {"origin": PAGE, "sec-fetch-site": "cross-site", **keys}
    for body, status in ((examples.ASSOCIATE, 200), ({}, 422)):
        answer = client.post("/v1/associate", json=body, headers=from_page)
        assert (answer.status_code, answer.headers["access-control-allow-origin"]) == (status, PAGE)
    if keys:  # what a page asks beforehand opens nothing
        assert client.post("/v1/associate", json=examples.ASSOCIATE, headers={"origin": PAGE}).status_code == 401
        assert client.options("/v1/associate", headers={"origin": PAGE}).status_code == 401
    for_other = asked_first(client, OTHER)
    answer = client.post("/v1/associate", json=examples.ASSOCIATE, headers={"origin": OTHER, **keys})
    assert not for_other.is_success
    assert answer.status_code == (200 if keys else 403)
    assert not any("access-control-allow-origin" in one.headers for one in (for_other, answer))


def test_none_is_named_by_default(client: httpx.Client) -> None:
    answer = asked_first(client, PAGE)
    assert answer.status_code == 403
    assert not any(name.startswith("access-control") for name in answer.headers)
