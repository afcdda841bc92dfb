"""Class of attack: two that read one path differently, a proxy with a rule for it and the service behind."""

from __future__ import annotations

import httpx
import pytest

from tests.running import RunningService

PATHS = (
    "/metrics",
    "/version",
    "/livez",
    "/v1/limits",
    "/v1/maps",
    "/docs",
    "/",
    "/nothing",
    "/v1/maps/m",
    "/v1/maps/m:check",
)
CONTROLS = ("%0A", "%0a", "%0D%0A", "%0D", "%00", "%09", "%0B", "%0C", "%1F", "%7F", "%C2%85", "%E2%80%A8", "%E2%80%A9")


@pytest.mark.parametrize("path", PATHS)
def test_a_path_with_a_control_character_is_refused(client: httpx.Client, path: str) -> None:
    for control in CONTROLS:
        for sent in (path + control, path[:2] + control + path[2:], f"{path}{control}?a=b", path + control * 2):
            answer = client.get(sent)
            assert (answer.status_code, answer.headers["content-type"]) == (400, "application/problem+json"), sent
            problem = answer.json()
            assert (problem["code"], problem["request_id"]) == ("invalid_http", answer.headers["x-request-id"])
            assert "control character U+" in problem["detail"]
            assert "linefix_" not in answer.text


@pytest.mark.parametrize("method", ["HEAD", "POST", "PUT", "DELETE", "OPTIONS"])
def test_with_any_method(client: httpx.Client, method: str) -> None:
    for path in ("/metrics%0A", "/v1/associate%0A", "/v1/maps/m%0A", "/v1/maps:import%0A"):
        assert client.request(method, path, content=b"{}").status_code == 400


def test_on_the_wire(service: RunningService) -> None:
    """As bytes: what a client library would not send is none of a path, and ends the connection."""
    for line in (b"/metrics%0A", b"/metrics\x0b", b"/metrics\x85", b"/metrics\x7f", b"http://other/metrics%0A"):
        with service.connection() as connection:
            connection.sendall(b"GET " + line + b" HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
            said = b"".join(iter(lambda: connection.recv(65536), b""))
            assert said == b"" or said.split()[1] in (b"400", b"404"), line
            assert b"linefix_" not in said


def test_a_plain_path_is_what_it_was(client: httpx.Client) -> None:
    assert client.get("/metrics").status_code == 200
    assert client.get("/livez?a=%0A").status_code == 200  # what follows the path is no part of it
    for path in ("/%250A", "/v1/maps/%C3%A4", "/v1/maps/%20", "/metrics%20", "/metrics%C2%A0"):
        assert client.get(path).status_code in (404, 422)
