"""Keys: the role of every endpoint, with and without a prefix of maps, and attempts with keys of few rights."""

from __future__ import annotations

import gzip
import json
import os
from typing import Any

import httpx
import pytest

from linefix.documents import examples
from service.admission.entrance import GUARDED
from service.admission.keys import Role
from tests.issuing import ADMIN, PREFIX, bearer, key_lines, key_of
from tests.running import RunningService, until

MINE, FOREIGN = "hq-1", "lab-1"
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


SECRET = 77.123456
SECRETS = {"segments": [[SECRET, 0, 81, 0], [81, 0, 81, 5], [81, 5, SECRET, 5]], "frame_id": "secret"}


def call_with(service: RunningService, method: str, path: str, key: str, map_id: str = MINE) -> httpx.Response:
    body = _with_id(CALLS.get((method, path), (None, None))[1], map_id)
    return service.client.request(method, path.replace("{map_id}", map_id), json=body, headers=bearer(key))


def _with_id(value: Any, map_id: str) -> Any:
    if isinstance(value, dict):
        return {name: _with_id(item, map_id) for name, item in value.items()}
    return map_id if value == "{map_id}" else value


@pytest.fixture(autouse=True)
def _maps(guarded: RunningService) -> None:
    """Have a map that each key sees, and one that those of the prefix do not."""
    for map_id in (MINE, FOREIGN):
        assert call_with(guarded, "PUT", "/v1/maps/{map_id}", ADMIN, map_id).is_success


@pytest.fixture
def _a_secret(guarded: RunningService) -> Any:
    """Have a map that the lesser keys do not see, which has to be as it was at the end."""
    client, owner = guarded.client, bearer(ADMIN)
    client.put(f"/v1/maps/{FOREIGN}", json=SECRETS, headers=owner).raise_for_status()
    asked = {"map": {"map_id": FOREIGN}, "scan": SCAN}
    assert client.post("/v1/associate", json=asked, headers=owner).status_code == 200  # its index is there
    before = client.get(f"/v1/maps/{FOREIGN}", headers=owner)
    yield
    after = client.get(f"/v1/maps/{FOREIGN}", headers=owner)
    assert (after.content, after.headers["etag"]) == (before.content, before.headers["etag"])


def test_every_route_has_a_role_named(guarded: RunningService) -> None:
    """The method of a request decides on its role."""
    paths = guarded.client.get("/openapi.json").json()["paths"]
    there = {(method.upper(), path) for path, item in paths.items() for method in item if path.startswith(GUARDED)}
    assert set(CALLS) == there


@pytest.mark.parametrize(("method", "path", "role"), TOLD, ids=[" ".join(map(str, told)) for told in TOLD])
def test_a_role_is_good_for_what_asks_for_it(guarded: RunningService, method: str, path: str, role: Role) -> None:
    wanted, _ = CALLS[method, path]
    for maps in ("", PREFIX):
        key = key_of(role, maps)
        answer = call_with(guarded, method, path, key)
        if wanted not in (None, role):
            assert (answer.status_code, answer.json()["code"]) == (403, "forbidden")
            continue
        assert answer.is_success or ((method, path) in FORMS and answer.status_code == 415), answer.text
        if method == "DELETE":
            assert call_with(guarded, "PUT", "/v1/maps/{map_id}", ADMIN).is_success
        if (method, path) not in NAMES_A_MAP:
            continue
        foreign = call_with(guarded, method, path, key, FOREIGN)
        if maps:
            assert (foreign.status_code, foreign.json()["code"]) == (404, "unknown_map")
            none = call_with(guarded, method, path, key, "lab-none")
            assert none.json() | {"request_id": ""} == foreign.json() | {"request_id": ""}
        else:
            assert foreign.is_success, foreign.text


def test_probes_and_pages_ask_for_no_key(guarded: RunningService) -> None:
    for path in ("/livez", "/readyz", "/metrics", "/version", "/docs", "/openapi.json", "/"):
        assert guarded.client.get(path).status_code == 200, path


GUARDED_CALLS = "GET /v1/limits,POST /v1/associate,PUT /v1/maps/m,POST /v1/nothing,GET /%76%31/limits,HEAD /v1/maps"


@pytest.mark.parametrize("call", GUARDED_CALLS.split(","))
def test_everything_under_v1_asks_for_one(guarded: RunningService, call: str) -> None:
    """Also where the same path is in other letters."""
    method, path = call.split()
    body = None if method in ("GET", "HEAD") else b"x" * 100_000
    none = guarded.client.request(method, path, content=body)
    assert none.status_code == 401
    assert none.headers["www-authenticate"] == 'Bearer realm="linefix"'
    wrong = guarded.client.request(method, path, content=body, headers=bearer(ADMIN[:-1]))
    assert (wrong.status_code, "www-authenticate" in wrong.headers) == (403, False)
    if method != "HEAD":
        assert (none.json()["code"], wrong.json()["code"]) == ("unauthorized", "forbidden")


def test_a_list_has_no_foreign_maps(guarded: RunningService) -> None:
    mine = key_of(Role.READ, PREFIX)
    for query, found in (("", [MINE]), ("?limit=1", [MINE]), (f"?cursor={MINE}", []), ("?cursor=a", [MINE])):
        answer = call_with(guarded, "GET", f"/v1/maps{query}", mine).json()
        assert ([item["map_id"] for item in answer["maps"]], answer["next"]) == (found, None)
    for query in ("cursor=lab-0", "limit=1000", "cursor=a&cursor=lab-0", "prefix=lab-", "cursor=%27%20OR%201=1"):
        answer = guarded.client.get(f"/v1/maps?{query}", headers=bearer(mine))
        assert answer.status_code in (200, 422)
        assert "lab-" not in answer.text


def test_a_key_searches_on_the_maps_of_its_prefix_alone(guarded: RunningService) -> None:
    call_with(guarded, "PUT", "/v1/maps/{map_id}", ADMIN, "hq-2")
    for prefix in ("h", PREFIX):
        assert {one["map_id"] for one in several(guarded, {"prefix": prefix}).json()["maps"]} == {"hq-1", "hq-2"}
    call_with(guarded, "DELETE", "/v1/maps/{map_id}", ADMIN, "hq-2")
    for maps in ({"prefix": "lab-"}, [{"map_id": MINE}, {"map_id": FOREIGN}]):
        assert several(guarded, maps).status_code == 404


def several(guarded: RunningService, maps: Any) -> httpx.Response:
    body = {"maps": maps, "scan": SCAN}
    return guarded.client.post("/v1/associate", json=body, headers=bearer(key_of(Role.ASSOCIATE, PREFIX)))


def test_what_is_no_route_is_for_whole_keys(guarded: RunningService) -> None:
    for method, path in (("GET", "/v1/nothing"), ("POST", "/v1/maps"), ("PATCH", "/v1/maps/{map_id}")):
        assert call_with(guarded, method, path, ADMIN).status_code in (404, 405)
        assert call_with(guarded, method, path, key_of(Role.WRITE)).json()["code"] == "forbidden"


def told(service: RunningService, *lines: str) -> bytes:
    """Send lines of a head as they are; return all that comes back."""
    return service.talk("\r\n".join([*lines, "Host: x", "Connection: close", "\r\n"]).encode())


READER, ASKER, WRITER = (key_of(role, PREFIX) for role in (Role.READ, Role.ASSOCIATE, Role.WRITE))
SHOWN = f"Authorization: Bearer {READER}"
FOREIGN_PATHS = [
    *("/v1/maps/%6cab-1", "/v1/maps/lab%2D1", "/v1/maps/hq-%2F..%2Flab-1", "/v1/maps/hq-1/../lab-1", "/v1//maps/lab-1"),
    *("/v1/maps/lab-1/", "/v1/maps/lab-1%0A", "/v1/maps/lab-1:check", "/v1/maps/hq-1:check/lab-1"),
    "/v1/maps/lab-1?map_id=hq-1",
]


@pytest.mark.usefixtures("_a_secret")
def test_a_foreign_map_is_not_had_in_other_letters(guarded: RunningService) -> None:
    for path in FOREIGN_PATHS:
        answer = told(guarded, f"GET {path} HTTP/1.1", SHOWN)
        assert int(answer[9:12]) in (400, 403, 404, 422), path
        assert b"segments" not in answer
    for name in ("X-Original-URL", "X-Rewrite-URL", "X-Forwarded-Path", "X-HTTP-Method-Override"):
        for value in ("/v1/maps/lab-1", "DELETE"):
            answers = [told(guarded, f"GET {path} HTTP/1.1", SHOWN, f"{name}: {value}")
                       for path in ("/v1/maps/lab-1", "/v1/maps/hq-1")]  # fmt: skip
            assert [answer[9:12] for answer in answers] == [b"404", b"200"]


# Which of two names counts may depend on who reads: bodies of each size are read by another.
FOREIGN_BODIES = [
    '{"map": {"map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "hq-1"}, "map": {"map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "hq-1", "map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "\\u006cab-1"}, "S": SEEN}',
    '{"m\\u0061p": {"map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "lab-1", "segments": [[0, 0, 1, 0]]}, "S": SEEN}',
    '{"map": {"map_id": "hq-1/../lab-1"}, "S": SEEN}',
    '{"map": {"map_id": ["lab-1"]}, "S": SEEN}',
]


@pytest.mark.usefixtures("_a_secret")
@pytest.mark.parametrize("packed", ["as-it-is", "gzip", "large"])
def test_a_body_that_names_a_foreign_map(guarded: RunningService, packed: str) -> None:
    headers = bearer(ASKER) | ({"content-encoding": "gzip"} if packed == "gzip" else {})
    seen = json.dumps(SCAN)
    for body in FOREIGN_BODIES:
        for path, scans, sent in (("/v1/associate", "scan", seen), ("/v1/associate:batch", "scans", f"[{seen}]")):
            content = body.replace('"S"', f'"{scans}"').replace("SEEN", sent).encode()
            content = content + b" " * 2_000_000 if packed == "large" else content
            content = gzip.compress(content) if packed == "gzip" else content
            answer = guarded.client.post(path, content=content, headers=headers)
            assert answer.status_code in (404, 422), answer.text
            assert str(SECRET) not in answer.text


DEMANDS = [{}, *({"if-none-match": one} for one in ('"1"', "*")), *({"if-match": one} for one in ('"1"', "*", "x"))]


@pytest.mark.usefixtures("_a_secret")
@pytest.mark.parametrize("method", ["GET", "HEAD", "PUT", "DELETE"])
def test_demands_tell_nothing_of_a_foreign_map(guarded: RunningService, method: str) -> None:
    def answer(key: str, map_id: str, demand: dict[str, str]) -> tuple[object, ...]:
        body = examples.MAP if method == "PUT" else None
        said = guarded.client.request(method, f"/v1/maps/{map_id}", json=body, headers=bearer(key) | demand)
        fields = {name: value for name, value in said.headers.items() if name not in ("date", "x-request-id")}
        return said.status_code, fields, said.text.replace(said.headers["x-request-id"], "")

    for key in (READER, WRITER):
        for demand in DEMANDS:
            assert answer(key, "lab-1", demand) == answer(key, "lab-2", demand)
            assert answer(key, "lab-1", demand)[0] in (403, 404)


def test_each_request_of_a_connection_shows_its_own_key(guarded: RunningService) -> None:
    one = f"GET /v1/maps/hq-1 HTTP/1.1\r\n{SHOWN}\r\nHost: x\r\n\r\n"
    answer = told(guarded, one + "GET /v1/maps/hq-1 HTTP/1.1")
    assert (answer.count(b"HTTP/1.1 200"), answer.count(b"HTTP/1.1 401")) == (1, 1)
    answer = told(guarded, one + "GET /v1/maps/lab-1 HTTP/1.1", SHOWN)
    assert (answer.count(b"HTTP/1.1 200"), answer.count(b"HTTP/1.1 404")) == (1, 1)


NO_KEYS = [
    *("", READER, f"Basic {READER}", f"Bearer {READER}, Bearer {WRITER}", "Bearer", f"Bearer {READER[:-1]}"),
    *(f"Bearer {READER.upper()}", f"Bearer {READER.replace('k', '%6b')}", f"Bearer {READER} x"),
    *("Bearer " + "x" * 30_000, "Bearer Schl\u00fcssel-\u202e"),
]


def test_a_key_is_shown_in_one_way(guarded: RunningService) -> None:
    """Which of two would count is for each server to guess: neither."""
    shown = [[f"Authorization: {value}"] for value in NO_KEYS]
    shown += [[SHOWN, f"Authorization: Bearer {WRITER}"], [SHOWN, SHOWN], [f"Authorization : Bearer {READER}"]]
    shown += [[f"Proxy-Authorization: Bearer {READER}"], [f"Cookie: authorization=Bearer {READER}"]]
    for lines in shown:
        assert int(told(guarded, "GET /v1/maps HTTP/1.1", *lines)[9:12]) in (400, 401, 403), lines
    for right in (f"authorization: bearer \t{READER} ", f"AUTHORIZATION: BEARER   {READER}"):
        assert told(guarded, "GET /v1/maps HTTP/1.1", right)[9:12] == b"200"


def test_keys_come_and_go_without_a_restart(guarded: RunningService) -> None:
    keys = guarded.data_dir / "keys"

    def status(key: str) -> int:
        return httpx.get(guarded.url + "/v1/limits", headers=bearer(key)).status_code

    def write(text: str) -> None:
        (guarded.data_dir / "new").write_text(text)
        os.replace(guarded.data_dir / "new", keys / "more.toml")

    write(key_lines("first", ["associate"]))
    until(lambda: (status("first"), status("second")) == (200, 403))
    write(key_lines("second", ["associate"]))
    until(lambda: (status("first"), status("second")) == (403, 200))
    write("this is no TOML, and a secret")
    until(lambda: "the keys stay as they were" in guarded.log())
    assert (status("first"), status("second")) == (403, 200)
    assert "a secret" not in guarded.log()
    (keys / "more.toml").unlink()
    until(lambda: status("second") == 403)
    assert status(READER) == 200
