"""Requests of web pages to a service without keys, by the browser of its user."""

from __future__ import annotations

from collections.abc import Callable

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import JSON, RunningService

MAP = orjson.dumps(examples.MAP)
EVERY_CALL = [
    ("GET", "/v1/maps"),
    ("GET", "/v1/maps/m"),
    ("PUT", "/v1/maps/m"),
    ("DELETE", "/v1/maps/m"),
    ("POST", "/v1/associate"),
    ("POST", "/v1/maps:import"),
    ("GET", "/metrics"),
    ("GET", "/docs"),
    ("GET", "/"),
]


@pytest.mark.parametrize(("method", "path"), EVERY_CALL)
@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example"},
        {"host": "evil.example:8000", "origin": "http://evil.example:8000", "sec-fetch-site": "same-origin"},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"sec-fetch-site": "cross-site"},
    ],
    ids=["a name of its own", "a name of its own, and its page", "another page", "no page", "another site"],
)
def test_pages_of_others_may_do_nothing(client: httpx.Client, method: str, path: str, headers: dict[str, str]) -> None:
    answer = client.request(method, path, headers=headers, content=MAP if method in ("PUT", "POST") else None)
    assert (answer.status_code, answer.json()["code"]) == (403, "forbidden")


def test_a_form_cannot_post(client: httpx.Client) -> None:
    """A browser asks before it sends JSON as such for the page of another; without a media type it does not."""
    body = orjson.dumps(examples.ASSOCIATE)
    for media_type in (None, "text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
        headers = {} if media_type is None else {"content-type": media_type}
        answer = httpx.post(f"{client.base_url}/v1/associate", content=body, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (415, "unsupported_media_type")
    assert client.post("/v1/associate", content=body, headers=JSON).status_code == 200


def test_names_are_said_in_the_settings(start_service: Callable[..., RunningService]) -> None:
    client = start_service(hosts="linefix,robots.example").client
    for host, status in (("linefix:8000", 200), ("robots.example", 200), ("other.example", 403)):
        assert client.get("/v1/limits", headers={"host": host}).status_code == status
    page = {"host": "robots.example", "origin": "https://robots.example", "sec-fetch-site": "same-origin"}
    assert client.put("/v1/maps/m", content=MAP, headers=page).status_code == 201


def test_with_keys_any_name_and_no_media_type_will_do(guarded: RunningService) -> None:
    headers = {"host": "linefix.example", "authorization": "Bearer sesame", "origin": "http://evil.example"}
    body = orjson.dumps(examples.ASSOCIATE)
    assert httpx.post(guarded.url + "/v1/associate", content=body, headers=headers).status_code == 200
