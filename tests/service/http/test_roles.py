"""Every role at every endpoint with and without a prefix, over HTTP, by keys of a file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from linefix.documents import examples
from service.admission.entrance import GUARDED
from service.admission.key_file import Role
from tests.running import RunningService, running, until
from tests.service.issuing import key_lines

ADMIN = "the-key-of-who-may-do-everything"
MINE, FOREIGN = "hq-1", "lab-1"
PREFIX = "hq-"
SCAN = {"segments": examples.SEEN}
# The role of each route. A route that is not here fails the test: whether its method says its role must be intended.
# Body None: there is none. "{map_id}" in a body becomes the map's id.
CALLS: dict[tuple[str, str], tuple[Role | None, Any]] = {
    ("GET", "/v1/limits"): (None, None),
    ("POST", "/v1/associate"): (Role.ASSOCIATE, {"map": {"map_id": "{map_id}"}, "scan": SCAN}),
    ("POST", "/v1/associate:batch"): (Role.ASSOCIATE, {"map": {"map_id": "{map_id}"}, "scans": [SCAN]}),
    ("POST", "/v1/register"): (Role.ASSOCIATE, examples.REGISTER),
    ("POST", "/v1/vectorize"): (Role.ASSOCIATE, examples.VECTORIZE),
    ("GET", "/v1/maps"): (Role.READ, None),
    ("GET", "/v1/maps/{map_id}"): (Role.READ, None),
    ("PUT", "/v1/maps/{map_id}"): (Role.WRITE, examples.MAP),
    ("DELETE", "/v1/maps/{map_id}"): (Role.WRITE, None),
    ("GET", "/v1/maps/{map_id}:check"): (Role.READ, None),
    ("POST", "/v1/maps/{map_id}:check"): (Role.ASSOCIATE, {"scans": [SCAN]}),
    ("POST", "/v1/maps/{map_id}:analyze"): (Role.ASSOCIATE, {"spacing": 4.0}),
    ("POST", "/v1/maps/{map_id}:update"): (Role.ASSOCIATE, examples.UPDATE),
    ("POST", "/v1/maps:apply"): (Role.ASSOCIATE, examples.APPLY),
    ("POST", "/v1/analyze"): (Role.ASSOCIATE, {"map": {"map_id": "{map_id}"}, "spacing": 4.0}),
    ("POST", "/v1/maps:import"): (Role.ASSOCIATE, {}),
    ("POST", "/v1/scans:import"): (Role.ASSOCIATE, {}),
}
# A key with the right gets 415, because the body is no form.
FORMS = frozenset({("POST", "/v1/maps:import"), ("POST", "/v1/scans:import")})
NAMES_A_MAP = {call for call, (_, body) in CALLS.items() if "{map_id}" in call[1] or "{map_id}" in str(body)}
TOLD = [(method, path, role) for method, path in CALLS for role in Role]


class Guarded:
    """A service with keys of every kind, and who may do what."""

    def __init__(self, service: RunningService) -> None:
        self.service = service

    def call(self, method: str, path: str, bearer: str, map_id: str = MINE) -> httpx.Response:
        body = _with_id(CALLS.get((method, path), (None, None))[1], map_id)
        headers = {"authorization": f"Bearer {bearer}"}
        return self.service.client.request(method, path.replace("{map_id}", map_id), json=body, headers=headers)

    def put_maps(self) -> None:
        for map_id in (MINE, FOREIGN):
            assert self.call("PUT", "/v1/maps/{map_id}", ADMIN, map_id).is_success


def key_of(role: Role, maps: str) -> str:
    return f"key-that-may-{role}-{maps or 'all'}"


def _with_id(value: Any, map_id: str) -> Any:
    if isinstance(value, dict):
        return {name: _with_id(item, map_id) for name, item in value.items()}
    return map_id if value == "{map_id}" else value


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    folder = tmp_path_factory.mktemp("roles")
    (folder / "keys.toml").write_text(
        "".join(key_lines(key_of(role, p), [role], p) for role in Role for p in ("", PREFIX))
    )
    with running(folder, keys=ADMIN, keys_file=folder / "keys.toml") as service:
        made = Guarded(service)
        made.put_maps()
        yield made
        log = service.log()
        assert "a defect" not in log
        for role in Role:
            for bearer in (ADMIN, key_of(role, ""), key_of(role, PREFIX)):
                assert bearer not in log
                assert bearer not in service.client.get("/metrics").text


def test_every_route_has_a_role_named(guarded: Guarded) -> None:
    """The method of a request decides on its role."""
    paths = guarded.service.client.get("/openapi.json").json()["paths"]
    there = {(method.upper(), path) for path, item in paths.items() for method in item if path.startswith(GUARDED)}
    assert set(CALLS) == there


@pytest.mark.parametrize(("method", "path", "role"), TOLD, ids=[" ".join(map(str, told)) for told in TOLD])
def test_a_role_is_good_for_what_asks_for_it(guarded: Guarded, method: str, path: str, role: Role) -> None:
    wanted, _ = CALLS[method, path]
    for maps in ("", PREFIX):
        for bearer in [key_of(role, maps)]:
            guarded.put_maps()
            answer = guarded.call(method, path, bearer)
            if wanted not in (None, role):
                assert (answer.status_code, answer.json()["code"]) == (403, "forbidden")
                continue
            assert answer.is_success or ((method, path) in FORMS and answer.status_code == 415), answer.text
            if (method, path) not in NAMES_A_MAP:
                continue
            foreign = guarded.call(method, path, bearer, FOREIGN)
            if maps:
                assert (foreign.status_code, foreign.json()["code"]) == (404, "unknown_map")
                none = guarded.call(method, path, bearer, "lab-none")
                assert none.json() | {"request_id": ""} == foreign.json() | {"request_id": ""}
            else:
                assert foreign.is_success, foreign.text


def test_a_list_has_no_foreign_maps(guarded: Guarded) -> None:
    guarded.put_maps()
    for bearer in [key_of(Role.READ, PREFIX)]:
        for query, found in (("", [MINE]), ("?limit=1", [MINE]), (f"?cursor={MINE}", []), ("?cursor=a", [MINE])):
            answer = guarded.call("GET", f"/v1/maps{query}", bearer).json()
            assert ([item["map_id"] for item in answer["maps"]], answer["next"]) == (found, None)


def test_what_is_no_route_is_for_whole_keys(guarded: Guarded) -> None:
    for method, path in (("GET", "/v1/nothing"), ("POST", "/v1/maps"), ("PATCH", "/v1/maps/{map_id}")):
        assert guarded.call(method, path, ADMIN).status_code in (404, 405)
        for bearer in [key_of(Role.WRITE, "")]:
            assert guarded.call(method, path, bearer).json()["code"] == "forbidden"


@pytest.mark.parametrize(
    "path",
    [
        "/v1/maps/%6cab-1",
        "/v1/maps/lab%2D1",
        "/v1/maps/hq-%2F..%2Flab-1",
        "/v1/maps/hq-1/../lab-1",
        "/v1//maps/lab-1",
        "/v1/maps/lab-1/",
        "/v1/maps/lab-1%0A",
        "/v1/maps/lab-1:check",
        "/v1/maps/hq-1:check/lab-1",
        "/v1/maps/lab-1?map_id=hq-1",
    ],
)
def test_a_foreign_map_is_not_had_in_other_letters(guarded: Guarded, path: str) -> None:
    guarded.put_maps()
    for bearer in [key_of(Role.READ, PREFIX)]:
        request = f"GET {path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {bearer}\r\nConnection: close\r\n\r\n"
        with guarded.service.connection() as connection:
            connection.sendall(request.encode())
            answer = b"".join(iter(lambda: connection.recv(65_536), b""))
        assert int(answer[9:12]) in (400, 403, 404, 422)
        assert b"segments" not in answer


def test_keys_come_and_go_without_a_restart(tmp_path: Path) -> None:
    keys = tmp_path / "keys"
    keys.mkdir()
    (keys / "robots.toml").write_text(key_lines("first", ["associate"]))
    with running(tmp_path, keys_file=keys) as service:

        def status(bearer: str) -> int:
            headers = {"authorization": f"Bearer {bearer}"}
            return httpx.get(service.url + "/v1/limits", headers=headers).status_code

        def write(name: str, text: str) -> None:
            (tmp_path / "new").write_text(text)
            os.replace(tmp_path / "new", keys / name)

        assert (status("first"), status("second")) == (200, 403)
        write("robots.toml", key_lines("second", ["associate"]))
        until(lambda: (status("first"), status("second")) == (403, 200))
        write("more.toml", key_lines("first", ["read"]))
        until(lambda: (status("first"), status("second")) == (200, 200))
        write("more.toml", "this is no TOML, and a secret")
        until(lambda: "the keys stay as they were" in service.log())
        assert (status("first"), status("second")) == (200, 200)
        assert "a secret" not in service.log()
        (keys / "more.toml").unlink()
        until(lambda: status("first") == 403)
        assert status("second") == 200
